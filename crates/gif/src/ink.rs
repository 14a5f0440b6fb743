//! Which palette colours a colour is drawn with.
//!
//! Each is drawn with the palette's nearest, or with a pattern of that and another where the mean over the pattern is
//! so much better that the coarser grain is worth it. Let `t` be a colour, drawn with `a` except for a part `f` of its
//! pixels, which get `b`. The mean squared error of the pixels is `E = (1 - f) |t - a|² + f |t - b|²`, that of a
//! neighbourhood's mean `B = |t - (1 - f) a - f b|²`. `E + BLEND B` is least at `f = p + (p - 1/2) / BLEND`, with
//! `p = (t - a)(b - a) / |b - a|²`, cut to 0..1: the whole of `p`, as error diffusion has it, for large `BLEND`, and no
//! pattern for small. A fixed threshold map says which pixels get `b`, so a colour that stays is drawn alike in every
//! frame.

use rayon::prelude::*;

use crate::colour::{self, DIMENSIONS, Point};
use crate::histogram::Histogram;
use crate::palette::Palette;

/// How much the error of a neighbourhood's mean counts against that of its pixels. Larger values dither more, and cost
/// size and PSNR.
const BLEND: f32 = 0.2;

/// What colours of a bin are drawn with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ink {
    /// The nearest colour.
    pub(crate) plain: u8,
    other: u8,
    /// The part of pixels, in 1/256, that get `other` rather than `plain`.
    part: u16,
}

impl Ink {
    /// One for each bin.
    pub(crate) fn of_bins(histogram: &Histogram, palette: &Palette) -> Vec<Self> {
        let chunks = histogram.bins().par_chunks(1024).flat_map_iter(|bins| {
            let mut guess = 0;
            bins.iter().map(move |bin| {
                let ink = Self::of(&colour::point(bin.mean()), palette, guess);
                guess = ink.plain;
                ink
            })
        });
        chunks.collect()
    }

    fn of(target: &Point, palette: &Palette, guess: u8) -> Self {
        let plain = palette.nearest(target, guess);
        let a = &palette.points[usize::from(plain)];
        let from_a = colour::error(target, a);
        let mut least = (1.0 + BLEND) * from_a;
        let mut ink = Self { plain, other: plain, part: 0 };
        for neighbour in palette.neighbours(plain) {
            let b = &palette.points[usize::from(neighbour.index)];
            let along = (0..DIMENSIONS).map(|k| (target[k] - a[k]) * (b[k] - a[k])).sum::<f32>();
            let p = along / neighbour.apart;
            let f = (p + (p - 0.5) / BLEND).clamp(0.0, 1.0);
            if f == 0.0 {
                continue;
            }
            let pixels = from_a + f * (neighbour.apart - 2.0 * along);
            let mean = from_a - 2.0 * f * along + f * f * neighbour.apart;
            let cost = pixels + BLEND * mean;
            if cost < least {
                least = cost;
                ink.other = neighbour.index;
                ink.part = (f * 256.0) as u16;
            }
        }
        ink
    }

    /// The index for a pixel of the frame.
    pub(crate) fn at(&self, x: usize, y: usize) -> u8 {
        if self.part > threshold(x, y) { self.other } else { self.plain }
    }
}

/// Bayer's 8 x 8 map, at the middle of each of its 64 steps of 4.
fn threshold(x: usize, y: usize) -> u16 {
    let mut value = 0;
    for bit in 0..3 {
        let (x, y) = ((x >> bit & 1) as u16, (y >> bit & 1) as u16);
        value |= ((x ^ y) << 1 | y) << (2 * (2 - bit));
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
            (0..64).filter(|k| ink.at(k % 8, k / 8) == 1).count()
        };
        assert_eq!((drawn(100.0), drawn(104.0), drawn(116.0), drawn(120.0)), (0, 0, 64, 64));
        assert!((20..=44).contains(&drawn(110.0)), "{} of 64", drawn(110.0));
    }
}
