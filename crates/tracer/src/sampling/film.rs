//! The samples of an image, summed up pixel by pixel, and which pixels get more.
//!
//! Passes are synchronous: what a pixel gets next follows from the counts and sums of the pass before, its own and its
//! neighbours'. So a picture does not depend on tiles or threads, and a still part of an animation only on what is near it.
//!
//! A pixel goes on if its error is estimated to be too large, if that of a neighbour with as few samples is, or if a
//! neighbour has more than twice its samples. Slivers thinner than a pixel, of which some pixels see nothing at first, are
//! found along their length in this way, and the bias of asking a pixel about itself shrinks to that of asking many.

use glam::DVec3;
use rayfold_scene::{Samples, Tone};
use rayon::prelude::*;

use crate::parallel::CHANNELS;

/// A channel's sums count in parts of this, so that no order of adding makes a difference.
const ONE: f64 = 65535.0;

/// Samples a pixel that are looked at before any decision, and where variances begin to say something.
const FIRST: u32 = 1;
const SECOND: u32 = 4;

/// So many times the error that is asked for, two neighbours with a sample each may differ by.
const CONTRAST: f64 = 1.5;

/// What a pixel has got so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pixel {
    sum: [u64; CHANNELS],
    squares: [u64; CHANNELS],
    count: u32,
    /// What the first sample met: equal numbers for equal objects.
    first: u32,
}

impl Pixel {
    /// Adds a sample; what is not a number is black.
    #[inline(always)]
    pub(crate) fn add(&mut self, color: [f64; CHANNELS]) {
        for ((sum, squares), channel) in self.sum.iter_mut().zip(&mut self.squares).zip(color) {
            let level = (if channel > 0.0 { channel.min(1.0) } else { 0.0 } * ONE + 0.5) as u64;
            *sum += level;
            *squares += level * level;
        }
        self.count += 1;
    }

    /// Adds as many of the same colour.
    pub(crate) fn add_equal(&mut self, color: [f64; CHANNELS], count: u32) {
        let mut one = Self::default();
        one.add(color);
        for (sum, level) in self.sum.iter_mut().zip(one.sum) {
            *sum += level * u64::from(count);
        }
        for (squares, square) in self.squares.iter_mut().zip(one.squares) {
            *squares += square * u64::from(count);
        }
        self.count += count;
    }

    /// Notes what its first sample met.
    #[inline(always)]
    pub(crate) fn note(&mut self, object: u32) {
        self.first = object;
    }

    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Of all samples.
    pub(crate) fn mean(&self) -> DVec3 {
        DVec3::from_array(self.sum.map(|sum| sum as f64)) / (ONE * f64::from(self.count.max(1)))
    }

    /// The estimated error of the mean in levels: the root mean square over the channels.
    fn error(&self, tone: Tone) -> f64 {
        if self.count < 2 {
            return f64::INFINITY;
        }
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
        255.0 * (sum / (CHANNELS as f64 * count)).sqrt()
    }
}

/// By how much the sRGB curve stretches differences of about `apart` there.
fn slope(light: f64, apart: f64) -> f64 {
    let (low, high) = ((light - 0.5 * apart).max(0.0), (light + 0.5 * apart).min(1.0));
    if high - low < 1e-9 { 12.92 } else { (encoded(high) - encoded(low)) / (high - low) }
}

/// The sRGB curve (IEC 61966-2-1).
fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055 }
}

/// An image of samples, its first row at the top.
#[derive(Debug)]
pub(crate) struct Film {
    pub(crate) pixels: Vec<Pixel>,
    pub(crate) width: usize,
    samples: Samples,
    tone: Tone,
}

impl Film {
    /// Nothing yet; `None` where there is no memory for it.
    pub(crate) fn new((width, height): (u32, u32), samples: Samples, tone: Tone) -> Option<Self> {
        let count = usize::try_from(u64::from(width) * u64::from(height)).ok()?;
        let mut pixels = Vec::new();
        pixels.try_reserve_exact(count).ok()?;
        pixels.resize(count, Pixel::default());
        Some(Self { pixels, width: width as usize, samples, tone })
    }

    /// The number of samples that each pixel shall have after the next pass; `None` once all have what they need. No pass adds
    /// more than `most` to a pixel.
    pub(crate) fn next_pass(&self, most: u32) -> Option<Vec<u32>> {
        let asked = self.samples.most();
        let begun = self.pixels.first().is_some_and(|pixel| pixel.count > 0);
        if self.samples.error() == 0.0 || !begun {
            let so_far = self.pixels.first().map_or(asked, |pixel| pixel.count);
            let first = if self.samples.error() == 0.0 { asked } else { FIRST.min(asked) };
            let next = first.min(so_far.saturating_add(most));
            return (next > so_far).then(|| vec![next; self.pixels.len()]);
        }
        let unsettled: Vec<bool> = self.each(|row, column| self.is_unsettled(row, column));
        let next = self.each(|row, column| {
            let pixel = &self.pixels[row * self.width + column];
            let mut goes_on = unsettled[row * self.width + column];
            self.neighbours(row, column, |place| {
                let other = &self.pixels[place];
                goes_on |= unsettled[place] && other.count >= pixel.count
                    || u64::from(other.count) > 2 * u64::from(pixel.count.max(SECOND / 2));
            });
            if goes_on {
                following(pixel.count).min(asked).min(pixel.count.saturating_add(most))
            } else {
                pixel.count
            }
        });
        next.par_iter().zip(&self.pixels).any(|(&next, pixel)| next > pixel.count).then_some(next)
    }

    /// Something for each pixel, by its row and column.
    fn each<T: Send>(&self, of: impl Fn(usize, usize) -> T + Sync) -> Vec<T> {
        let rows = self.pixels.len() / self.width.max(1);
        (0..rows)
            .into_par_iter()
            .flat_map_iter(|row| {
                let of = &of;
                (0..self.width).map(move |column| of(row, column))
            })
            .collect()
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

    fn is_unsettled(&self, row: usize, column: usize) -> bool {
        let pixel = &self.pixels[row * self.width + column];
        if pixel.count >= self.samples.most() {
            return false;
        }
        if pixel.count >= SECOND {
            return pixel.error(self.tone) > self.samples.error();
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

    fn fill(film: &mut Film, to: &[u32], mut color: impl FnMut(usize, u32) -> f64) {
        for (place, (pixel, &to)) in film.pixels.iter_mut().zip(to).enumerate() {
            for sample in pixel.count..to {
                pixel.add([color(place, sample); 3]);
            }
        }
    }

    #[test]
    fn without_an_error_all_get_all() {
        let mut film = film(100, 0.0);
        let mut counts = vec![];
        while let Some(next) = film.next_pass(64) {
            fill(&mut film, &next, |_, _| 0.5);
            counts.push(next[7]);
        }
        assert_eq!(counts, [64, 100]);
    }

    #[test]
    fn what_is_even_gets_one() {
        let mut film = film(64, 1.0);
        while let Some(next) = film.next_pass(1024) {
            fill(&mut film, &next, |_, _| 0.5);
        }
        assert!(film.pixels.iter().all(|pixel| pixel.count == 1));
    }

    #[test]
    fn rays_go_where_the_noise_is_and_fall_off_around_it() {
        let mut film = film(64, 1.0);
        let mut dice = fastrand::Rng::with_seed(5);
        while let Some(next) = film.next_pass(1024) {
            fill(&mut film, &next, |place, _| if place % 8 == 0 { f64::from(dice.bool()) } else { 0.5 });
        }
        let counts: Vec<u32> = film.pixels[..8].iter().map(|pixel| pixel.count).collect();
        assert_eq!(counts, [64, 32, 16, 8, 4, 1, 1, 1]);
    }

    #[test]
    fn sums_are_means_and_errors_are_standard_errors() {
        let mut pixel = Pixel::default();
        for k in 0..100 {
            pixel.add([f64::from(k % 2), 0.25, f64::NAN]);
        }
        assert!((pixel.mean() - DVec3::new(0.5, 0.25, 0.0)).abs().max_element() < 1e-5);
        // A channel that is 0 or 1 has the deviation 1/2; a third of the variance is that of the mean over channels.
        let expected = 255.0 * (0.25 * 100.0 / 99.0 / 3.0 / 100.0f64).sqrt();
        assert!((pixel.error(Tone::Plain) / expected - 1.0).abs() < 1e-3, "{}", pixel.error(Tone::Plain));
        let mut equal = Pixel::default();
        equal.add_equal([0.5, 2.0, -1.0], 7);
        assert_eq!(equal.error(Tone::Srgb), 0.0);
        assert!((equal.mean() - DVec3::new(0.5, 1.0, 0.0)).abs().max_element() < 1e-5);
    }
}
