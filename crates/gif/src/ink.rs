//! Which palette colour is nearest to a colour, and how far that is off.

use rayon::prelude::*;

use crate::colour;
use crate::histogram::Histogram;
use crate::palette::{Guesses, Palette, Sample};

/// A palette colour, and its squared error as the colour that is meant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ink {
    pub(crate) index: u8,
    pub(crate) error: f32,
}

impl Ink {
    /// The nearest for each bin.
    pub(crate) fn of_bins(bins: &[Sample], palette: &Palette, guesses: &Guesses) -> Vec<Self> {
        let inks =
            bins.par_iter().enumerate().with_min_len(512).map(|(number, Sample { point, rgb, .. })| {
                let index = palette.nearest(point, guesses.of(number, *rgb));
                Self { index, error: colour::error(point, &palette.points[usize::from(index)]) }
            });
        inks.collect()
    }
}

/// Mean [level error](colour::level_error) of all pixels.
pub(crate) fn mean_level_error(histogram: &Histogram, of_bins: &[Ink], palette: &Palette) -> f32 {
    let (mut sum, mut pixels) = (0.0, 0.0);
    for (bin, ink) in histogram.bins().iter().zip(of_bins) {
        let mean = bin.mean().map(|level| level.round() as u8);
        let error = colour::level_error(mean, palette.colours[usize::from(ink.index)]);
        sum += bin.count as f32 * error as f32;
        pixels += bin.count as f32;
    }
    sum / f32::max(pixels, 1.0)
}

/// Mean squared error of all pixels.
pub(crate) fn mean_error(histogram: &Histogram, of_bins: &[Ink]) -> f32 {
    let bins = histogram.bins().iter().zip(of_bins);
    let sum = bins.map(|(bin, ink)| bin.count as f32 * ink.error).sum::<f32>();
    sum / f32::max(histogram.pixels() as f32, 1.0)
}
