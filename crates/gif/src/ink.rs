//! Which palette colours a colour is drawn with.
//!
//! Each is drawn with the palette's nearest, or in smooth surroundings with a pattern of that and one or two others,
//! where the mean over the pattern is so much better that the coarser grain is worth it. Let `t` be a colour and `m`
//! what it is drawn with in the mean, with the mean squared error `E` of the pixels; a part `f` of them is given the
//! colour `c` instead. That makes the error of the pixels `(1 - f) E + f |t - c|²` and that of a neighbourhood's mean
//! `B = |t - (1 - f) m - f c|²`. `E + blend B` is least at `f = p - (|t - c|² - E) / (2 blend |c - m|²)`, with
//! `p = (t - m)(c - m) / |c - m|²`, cut to 0..1: the whole of `p`, as error diffusion has it, for large `blend`, and no
//! pattern for small. `blend` grows with the square of the nearest colour's error: what is hardly wrong needs no pattern. A fixed
//! threshold map says which pixels get which colour, so a colour that stays is drawn alike in every frame.

use rayon::prelude::*;

use crate::colour::{self, DIMENSIONS, Point};
use crate::histogram::Histogram;
use crate::palette::{Guesses, Palette};

/// The squared error of the nearest colour at which that of a neighbourhood's mean counts as much as that of its pixels.
/// Smaller values dither more, and cost size and PSNR.
const BLEND_FROM: f32 = 48.0;
/// The most that it counts.
const MOST_BLEND: f32 = 32.0;
/// The squared error up to which a colour is drawn plainly.
const SMALL: f32 = 1.5;
/// How many of a colour's nearest others are tried.
const TRIED: usize = 12;

/// What colours of a bin are drawn with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ink {
    /// The nearest colour.
    pub(crate) plain: Dye,
    /// Others, and the parts of pixels, in 1/256, that get them or one after them.
    others: [(Dye, u16); 2],
}

/// A palette colour, and its squared error as the colour that is meant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Dye {
    pub(crate) index: u8,
    pub(crate) error: f32,
}

impl Ink {
    /// One for each bin.
    pub(crate) fn of_bins(histogram: &Histogram, palette: &Palette, guesses: &Guesses) -> Vec<Self> {
        let bins = histogram.bins().par_iter().enumerate().with_min_len(512);
        let inks = bins.map(|(number, bin)| {
            let mean = bin.mean();
            Self::of(&colour::point(mean), palette, guesses.of(number, mean))
        });
        inks.collect()
    }

    fn of(target: &Point, palette: &Palette, guess: u8) -> Self {
        let index = palette.nearest(target, guess);
        let mut mean = palette.points[usize::from(index)];
        let mut pixels = colour::error(target, &mean);
        let plain = Dye { index, error: pixels };
        let mut ink = Self { plain, others: [(plain, 0); 2] };
        if pixels < SMALL {
            return ink;
        }
        let wrong = pixels / BLEND_FROM;
        let blend = (wrong * wrong).min(MOST_BLEND);
        let mut off = pixels;
        for at in 0..2 {
            let mut least = pixels + blend * off;
            let mut found = None;
            // `part` is above 0 only for colours nearer to `m`; in the first round that is `plain`.
            let reach = if at == 0 { 4.0 * (1.0 + blend) * (1.0 + blend) * pixels } else { f32::INFINITY };
            for neighbour in palette.neighbours(index).iter().take(TRIED) {
                if neighbour.apart > reach {
                    break;
                }
                let c = &palette.points[usize::from(neighbour.index)];
                let (mut along, mut apart, mut error) = (0.0, 0.0, 0.0);
                for k in 0..DIMENSIONS {
                    let (t, c) = (target[k] - mean[k], c[k] - mean[k]);
                    along += t * c;
                    apart += c * c;
                    error += (t - c) * (t - c);
                }
                let part = ((along - (error - pixels) / (2.0 * blend)) / apart).min(1.0);
                if part > 0.0 {
                    let mixed = pixels + part * (error - pixels);
                    let cost = mixed + blend * (off - 2.0 * part * along + part * part * apart);
                    if cost < least {
                        least = cost;
                        found = Some((Dye { index: neighbour.index, error }, part, mixed));
                    }
                }
            }
            let Some((dye, part, mixed)) = found else { break };
            if at == 1 {
                // All before give way in proportion.
                ink.others[0].1 = (f32::from(ink.others[0].1) * (1.0 - part) + part * 256.0) as u16;
            }
            ink.others[at] = (dye, (part * 256.0) as u16);
            let c = &palette.points[usize::from(dye.index)];
            off = 0.0;
            for k in 0..DIMENSIONS {
                mean[k] += part * (c[k] - mean[k]);
                off += (target[k] - mean[k]) * (target[k] - mean[k]);
            }
            pixels = mixed;
        }
        ink
    }

    /// What a pixel of the frame gets.
    pub(crate) fn at(&self, x: usize, y: usize) -> Dye {
        let threshold = THRESHOLDS[y % 8][x % 8];
        let [first, second] = self.others;
        match threshold {
            t if t < second.1 => second.0,
            t if t < first.1 => first.0,
            _ => self.plain,
        }
    }

    /// The squared distance from `plain` beyond which no palette colour has an error below `allowed`.
    pub(crate) fn reach(&self, allowed: f32) -> f32 {
        let reach = self.plain.error.sqrt() + allowed.sqrt();
        reach * reach
    }
}

/// Mean [level error](colour::level_error) of all pixels, drawn plainly.
pub(crate) fn mean_level_error(histogram: &Histogram, of_bins: &[Ink], palette: &Palette) -> f32 {
    let (mut sum, mut pixels) = (0.0, 0.0);
    for (bin, ink) in histogram.bins().iter().zip(of_bins) {
        let mean = bin.mean().map(|level| level.round() as u8);
        let error = colour::level_error(mean, palette.colours[usize::from(ink.plain.index)]);
        sum += bin.count as f32 * error as f32;
        pixels += bin.count as f32;
    }
    sum / f32::max(pixels, 1.0)
}

static THRESHOLDS: [[u16; 8]; 8] = {
    let mut map = [[0; 8]; 8];
    let mut at = 0;
    while at < 64 {
        map[at / 8][at % 8] = threshold(at % 8, at / 8);
        at += 1;
    }
    map
};

/// Bayer's 8 x 8 map, at the middle of each of its 64 steps of 4.
const fn threshold(x: usize, y: usize) -> u16 {
    let mut value = 0;
    let mut bit = 0;
    while bit < 3 {
        let (x, y) = ((x >> bit & 1) as u16, (y >> bit & 1) as u16);
        value |= ((x ^ y) << 1 | y) << (2 * (2 - bit));
        bit += 1;
    }
    value * 4 + 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threshold_map_has_each_step_once() {
        let mut steps = (0..64).map(|k| threshold(k % 8, k / 8)).collect::<Vec<_>>();
        steps.sort_unstable();
        assert!(steps.iter().enumerate().all(|(k, &step)| step == k as u16 * 4 + 2));
    }

    #[test]
    fn half_way_is_a_pattern_and_near_a_colour_is_none() {
        let palette = Palette::new(vec![[100, 100, 100], [120, 120, 120]]);
        let drawn = |level: f32| {
            let ink = Ink::of(&colour::point([level; 3]), &palette, 0);
            (0..64).filter(|k| ink.at(k % 8, k / 8).index == 1).count()
        };
        assert_eq!((drawn(100.0), drawn(101.0), drawn(119.0), drawn(120.0)), (0, 0, 64, 64));
        assert!((1..20).contains(&drawn(105.0)) && (45..64).contains(&drawn(115.0)));
        assert!((20..=44).contains(&drawn(110.0)), "{} of 64", drawn(110.0));
    }

    #[test]
    fn a_third_colour_mends_the_mean() {
        let corners = [[100, 100, 100], [130, 100, 100], [100, 130, 100]];
        let palette = Palette::new(corners.to_vec());
        let target = [109.0, 109.0, 100.0];
        let ink = Ink::of(&colour::point(target), &palette, 0);
        let mut mean = [0.0; 3];
        for k in 0..64 {
            let drawn = corners[usize::from(ink.at(k % 8, k / 8).index)];
            (0..3).for_each(|c| mean[c] += f32::from(drawn[c]) / 64.0);
        }
        assert!((0..3).all(|c| (mean[c] - target[c]).abs() < 4.0), "{mean:?}");
    }
}
