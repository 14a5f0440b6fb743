//! The samples of an image, summed up pixel by pixel, and which pixels get more.
//!
//! Passes are synchronous: what a pixel gets next follows from the counts and sums of the pass before, its own and its
//! neighbours'. So a picture does not depend on tiles or threads, and a still part of an animation only on what is near it.
//!
//! A pixel goes on if its error is estimated to be too large, if that of a neighbour with as few samples is, or if a
//! neighbour has more than twice its samples. Slivers thinner than a pixel, of which some pixels see nothing at first, are
//! found along their length in this way, and the bias of asking a pixel about itself shrinks to that of asking many.

use std::ops::Range;

use glam::DVec3;
use rayfold_scene::{Samples, Tone};
use rayon::prelude::*;

use crate::parallel::CHANNELS;
use crate::reference::encoded;

/// A channel's sums count in parts of this, so that no order of adding makes a difference.
const ONE: f64 = 65535.0;

/// Samples a pixel that are looked at before any decision, and where variances begin to say something.
const FIRST: u32 = 1;
const SECOND: u32 = 4;

/// So many times the error that is asked for, two neighbours with a sample each may differ by.
const CONTRAST: f64 = 1.5;

/// The error of a mean of n samples is taken for their deviation times n to this power: steeper than the -1/2 of independent
/// samples, and less steep than what edges and penumbrae have (docs/reports/sampling.md).
const SLOPE: f64 = -0.65;

/// So many times the error that is asked for a pixel may have: most others have less.
const SPARED: f64 = 3.0;

/// What a pixel has got so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pixel {
    sum: [u64; CHANNELS],
    squares: [u64; CHANNELS],
    count: u32,
    /// What the first sample met: equal numbers for equal objects.
    first: u32,
}

/// A channel of a colour as a part of [`ONE`]; what is not a number is black.
#[inline(always)]
pub(crate) fn quantised(channel: f64) -> u32 {
    let channel = if channel > 0.0 { channel } else { 0.0 };
    (channel.min(1.0) * ONE + 0.5) as u32
}

impl Pixel {
    /// Adds samples: their [`quantised`] channels.
    #[inline(always)]
    pub(crate) fn add(&mut self, channels: [&[u32]; CHANNELS]) {
        for ((sum, squares), levels) in self.sum.iter_mut().zip(&mut self.squares).zip(channels) {
            for &level in levels {
                *sum += u64::from(level);
                // At most 32 bits.
                *squares += u64::from(level.wrapping_mul(level));
            }
        }
        self.count += channels[0].len() as u32;
    }

    /// Adds as many of the same colour.
    pub(crate) fn add_equal(&mut self, color: [f64; CHANNELS], count: u32) {
        for ((sum, squares), channel) in self.sum.iter_mut().zip(&mut self.squares).zip(color) {
            let level = u64::from(quantised(channel));
            *sum += level * u64::from(count);
            *squares += level * level * u64::from(count);
        }
        self.count += count;
    }

    /// Notes what its first sample met.
    #[inline(always)]
    pub(crate) fn note(&mut self, object: u32) {
        self.first = object;
    }

    #[inline(always)]
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Of all samples.
    pub(crate) fn mean(&self) -> DVec3 {
        DVec3::from_array(self.sum.map(|sum| sum as f64)) / (ONE * f64::from(self.count.max(1)))
    }

    /// The standard deviation of its samples in levels: the root mean square over the channels.
    fn deviation(&self, tone: Tone) -> f64 {
        let count = f64::from(self.count);
        let mean = self.mean();
        let mut sum = 0.0;
        for channel in 0..CHANNELS {
            let squares = self.squares[channel] as f64 / (ONE * ONE);
            let spread = (squares - count * mean[channel] * mean[channel]).max(0.0) / (count - 1.0);
            let slope = match tone {
                Tone::Plain => 1.0,
                Tone::Srgb => slope(mean[channel], spread.sqrt()),
            };
            sum += spread * slope * slope;
        }
        255.0 * (sum / CHANNELS as f64).sqrt()
    }
}

/// By how much the sRGB curve stretches differences of about `apart` there.
fn slope(light: f64, apart: f64) -> f64 {
    let (low, high) = ((light - 0.5 * apart).max(0.0), (light + 0.5 * apart).min(1.0));
    if high - low < 1e-9 { 12.92 } else { (encoded(high) - encoded(low)) / (high - low) }
}

/// An image of samples, its first row at the top.
#[derive(Debug)]
pub(crate) struct Film {
    pub(crate) pixels: Vec<Pixel>,
    pub(crate) width: usize,
    samples: Samples,
    tone: Tone,
    /// Whose error is too large.
    unsettled: Vec<bool>,
    /// How many samples each had when that was found out.
    judged: Vec<u32>,
    goals: Goals,
}

/// The number of samples that each pixel shall have after a pass.
#[derive(Debug)]
pub(crate) struct Goals {
    pub(crate) counts: Vec<u32>,
    /// The blocks of [`BLOCK`] x [`BLOCK`] pixels in which a pixel gets more.
    blocks: Vec<bool>,
    blocks_in_row: usize,
}

/// Columns and rows of the blocks in which an image is looked at.
pub(crate) const BLOCK: usize = 16;

impl Goals {
    /// Whether any pixel of a rectangle may get more.
    pub(crate) fn any(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        let blocks = |range: Range<usize>| range.start / BLOCK..range.end.div_ceil(BLOCK);
        blocks(rows)
            .any(|row| blocks(columns.clone()).any(|column| self.blocks[row * self.blocks_in_row + column]))
    }
}

impl Film {
    /// Nothing yet; `None` where there is no memory for it.
    pub(crate) fn new((width, height): (u32, u32), samples: Samples, tone: Tone) -> Option<Self> {
        let (width, height) = (width as usize, height as usize);
        let count = width.checked_mul(height)?;
        let blocks_in_row = width.div_ceil(BLOCK);
        Some(Self {
            pixels: filled(count, Pixel::default())?,
            width,
            samples,
            tone,
            unsettled: filled(count, true)?,
            judged: filled(count, 0)?,
            goals: Goals {
                counts: filled(count, 0)?,
                blocks: filled(blocks_in_row * height.div_ceil(BLOCK), true)?,
                blocks_in_row,
            },
        })
    }

    /// The pixels, and the goals of the pass that [`Self::plan`] planned.
    pub(crate) fn split(&mut self) -> (&mut [Pixel], &Goals) {
        (&mut self.pixels, &self.goals)
    }

    /// Plans the next pass; `None` once all pixels have what they need. No pass adds more than `most` to a pixel. Gives the least
    /// and the largest number of samples between which it is.
    pub(crate) fn plan(&mut self, most: u32) -> Option<(u32, u32)> {
        let asked = self.samples.most();
        let so_far = self.pixels.first().map_or(asked, |pixel| pixel.count);
        if self.samples.error() == 0.0 || so_far == 0 {
            let goal = if self.samples.error() == 0.0 { asked } else { FIRST.min(asked) };
            let goal = goal.min(so_far.saturating_add(most));
            self.goals.counts.fill(goal);
            return (goal > so_far).then_some((so_far, goal));
        }
        let lively = self.lively();
        self.judge(&lively);
        let film = &*self;
        let next = film.each_block(&lively, |row, columns, next: &mut Next| {
            for column in columns {
                let place = row * film.width + column;
                let (count, goal) = (film.goals.counts[place], film.goal(row, column, most));
                if goal > count {
                    next.goals.push((place, goal));
                    next.first = next.first.min(count);
                    next.end = next.end.max(goal);
                }
            }
        });
        let (mut first, mut end) = (u32::MAX, 0);
        self.goals.blocks.fill(false);
        for (block, next) in next {
            self.goals.blocks[block] = next.end > 0;
            first = first.min(next.first);
            end = end.max(next.end);
            for (place, goal) in next.goals {
                self.goals.counts[place] = goal;
            }
        }
        (end > 0).then_some((first, end))
    }

    /// The blocks in which, or beside which, pixels got samples in the pass before.
    fn lively(&self) -> Vec<usize> {
        let (columns, blocks) = (self.goals.blocks_in_row, &self.goals.blocks);
        let rows = blocks.len() / columns;
        let near = |at: usize, of: usize| at.saturating_sub(1)..(at + 2).min(of);
        let is_lively = |block: &usize| {
            let (row, column) = (block / columns, block % columns);
            near(row, rows).any(|row| near(column, columns).any(|column| blocks[row * columns + column]))
        };
        (0..blocks.len()).filter(is_lively).collect()
    }

    /// Finds out whose errors are too large, of those that have got samples since.
    fn judge(&mut self, lively: &[usize]) {
        let film = &*self;
        // All counts are among these: how much their samples may vary.
        let mut limits = vec![];
        let mut count = SECOND;
        while count < self.samples.most() {
            limits.push((count, film.limit(count)));
            count = following(count).min(self.samples.most());
        }
        let judged = film.each_block(lively, |row, columns, into: &mut Vec<(usize, bool)>| {
            for column in columns {
                let place = row * film.width + column;
                if film.goals.counts[place] != film.judged[place] {
                    into.push((place, film.is_unsettled(row, column, &limits)));
                }
            }
        });
        for (place, is_unsettled) in judged.into_iter().flat_map(|(_, of_block)| of_block) {
            self.unsettled[place] = is_unsettled;
            self.judged[place] = self.goals.counts[place];
        }
    }

    /// The deviation of so many samples at which their mean is as good as is asked for.
    fn limit(&self, count: u32) -> f64 {
        SPARED * self.samples.error() * libm::pow(f64::from(count), -SLOPE)
    }

    /// Something for each of some blocks, gathered from the parts of rows that lie in it.
    fn each_block<T: Default + Send>(
        &self,
        blocks: &[usize],
        of_row: impl Fn(usize, Range<usize>, &mut T) + Sync,
    ) -> Vec<(usize, T)> {
        let height = self.pixels.len() / self.width;
        let of_block = |&block: &usize| {
            let (top, left) =
                (block / self.goals.blocks_in_row * BLOCK, block % self.goals.blocks_in_row * BLOCK);
            let mut gathered = T::default();
            for row in top..(top + BLOCK).min(height) {
                of_row(row, left..(left + BLOCK).min(self.width), &mut gathered);
            }
            (block, gathered)
        };
        blocks.par_iter().map(of_block).collect()
    }

    /// The places of the up to eight pixels around one.
    #[inline(always)]
    fn neighbours(&self, row: usize, column: usize, mut each: impl FnMut(usize)) {
        let rows = self.pixels.len() / self.width;
        for other_row in row.saturating_sub(1)..(row + 2).min(rows) {
            for other_column in column.saturating_sub(1)..(column + 2).min(self.width) {
                if (other_row, other_column) != (row, column) {
                    each(other_row * self.width + other_column);
                }
            }
        }
    }

    /// How many samples a pixel shall have after the next pass.
    fn goal(&self, row: usize, column: usize, most: u32) -> u32 {
        let place = row * self.width + column;
        let count = self.goals.counts[place];
        let mut goes_on = self.unsettled[place];
        self.neighbours(row, column, |place| {
            let other = self.goals.counts[place];
            goes_on |= self.unsettled[place] && other >= count
                || u64::from(other) > 2 * u64::from(count.max(SECOND / 2));
        });
        if goes_on {
            following(count).min(self.samples.most()).min(count.saturating_add(most))
        } else {
            count
        }
    }

    fn is_unsettled(&self, row: usize, column: usize, limits: &[(u32, f64)]) -> bool {
        let pixel = &self.pixels[row * self.width + column];
        if pixel.count >= self.samples.most() {
            return false;
        }
        if pixel.count >= SECOND {
            let known = limits.iter().find(|(count, _)| *count == pixel.count);
            let limit = known.map_or_else(|| self.limit(pixel.count), |(_, limit)| *limit);
            return pixel.deviation(self.tone) > limit;
        }
        let limit = CONTRAST * self.samples.error() / 255.0;
        let mean = self.shown(pixel);
        let mut differs = false;
        self.neighbours(row, column, |place| {
            let other = &self.pixels[place];
            differs |= other.first != pixel.first
                || other.count == pixel.count && (self.shown(other) - mean).abs().max_element() > limit;
        });
        differs
    }

    fn shown(&self, pixel: &Pixel) -> DVec3 {
        match self.tone {
            Tone::Plain => pixel.mean(),
            Tone::Srgb => DVec3::from_array(pixel.mean().to_array().map(encoded)),
        }
    }
}

/// What a block's pixels shall have.
struct Next {
    goals: Vec<(usize, u32)>,
    first: u32,
    end: u32,
}

impl Default for Next {
    fn default() -> Self {
        Self { goals: vec![], first: u32::MAX, end: 0 }
    }
}

/// `None` where there is no memory for it.
fn filled<T: Clone>(count: usize, value: T) -> Option<Vec<T>> {
    let mut filled = Vec::new();
    filled.try_reserve_exact(count).ok()?;
    filled.resize(count, value);
    Some(filled)
}

/// How many samples come after so many.
fn following(count: u32) -> u32 {
    if count < SECOND { SECOND } else { count.saturating_mul(2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(most: u32, error: f64) -> Film {
        Film::new((8, 4), Samples::new(most, error).unwrap(), Tone::Plain).unwrap()
    }

    fn expose(film: &mut Film, most: u32, mut color: impl FnMut(usize, u32) -> f64) -> Vec<(u32, u32)> {
        let mut passes = vec![];
        while let Some(span) = film.plan(most) {
            passes.push(span);
            let (pixels, goals) = film.split();
            for (place, (pixel, &goal)) in pixels.iter_mut().zip(&goals.counts).enumerate() {
                for sample in pixel.count..goal {
                    assert!((span.0..span.1).contains(&sample));
                    let level = [quantised(color(place, sample))];
                    pixel.add([&level; 3]);
                }
            }
        }
        passes
    }

    #[test]
    fn without_an_error_all_get_all() {
        let mut film = film(100, 0.0);
        assert_eq!(expose(&mut film, 64, |_, _| 0.5), [(0, 64), (64, 100)]);
        assert!(film.pixels.iter().all(|pixel| pixel.count == 100));
    }

    #[test]
    fn what_is_even_gets_one() {
        let mut film = film(64, 1.0);
        assert_eq!(expose(&mut film, 1024, |_, _| 0.5), [(0, 1)]);
        assert!(film.pixels.iter().all(|pixel| pixel.count == 1));
    }

    #[test]
    fn rays_go_where_the_noise_is_and_fall_off_around_it() {
        let mut film = film(64, 1.0);
        let mut dice = fastrand::Rng::with_seed(5);
        expose(
            &mut film,
            1024,
            |place, _| if place % 8 == 0 { f64::from(u8::from(dice.bool())) } else { 0.5 },
        );
        let counts: Vec<u32> = film.pixels[..8].iter().map(|pixel| pixel.count).collect();
        assert_eq!(counts, [64, 64, 32, 16, 8, 4, 1, 1]);
    }

    /// A line of which few pixels see anything at first is found along its length.
    #[test]
    fn a_sliver_is_found_along_its_length() {
        let mut film = Film::new((64, 9), Samples::new(64, 1.0).unwrap(), Tone::Plain).unwrap();
        let mut dice = fastrand::Rng::with_seed(3);
        let mut seen = |place: usize, _| f64::from(u8::from(place / 64 == 4 && dice.f64() < 0.15));
        expose(&mut film, 1024, &mut seen);
        let row = &film.pixels[4 * 64..5 * 64];
        assert!(
            row.iter().all(|pixel| pixel.count >= 32),
            "{:?}",
            row.iter().map(|p| p.count).collect::<Vec<_>>()
        );
        assert!(film.pixels[..64].iter().all(|pixel| pixel.count < 32));
    }

    #[test]
    fn sums_are_means_and_deviations() {
        let mut pixel = Pixel::default();
        for k in 0..100 {
            pixel.add([f64::from(k % 2), 0.25, f64::NAN].map(quantised).each_ref().map(std::slice::from_ref));
        }
        assert!((pixel.mean() - DVec3::new(0.5, 0.25, 0.0)).abs().max_element() < 1e-5);
        // A channel that is 0 or 1 has the deviation 1/2; a third of the variance is that of the mean over channels.
        let expected = 255.0 * (0.25 * 100.0 / 99.0 / 3.0f64).sqrt();
        let deviation = pixel.deviation(Tone::Plain);
        assert!((deviation / expected - 1.0).abs() < 1e-3, "{deviation}");
        let mut equal = Pixel::default();
        equal.add_equal([0.5, 2.0, -1.0], 7);
        assert_eq!(equal.deviation(Tone::Srgb), 0.0);
        assert!((equal.mean() - DVec3::new(0.5, 1.0, 0.0)).abs().max_element() < 1e-5);
    }
}
