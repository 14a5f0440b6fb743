//! The palette entry nearest to each colour of a frame, and its error.

use rayon::prelude::*;

use crate::colour;
use crate::histogram::Histogram;
use crate::palette::{Guesses, Palette, Sample};

/// The palette entry nearest to a colour, and the squared distance between them (see [`colour`]).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nearest {
    pub(crate) index: u8,
    pub(crate) error: f32,
}

impl Nearest {
    /// Makes the entry that is drawn for a bin.
    pub(crate) fn new(index: u8, bin: &Sample, palette: &Palette) -> Self {
        Self { index, error: colour::error(&bin.point, &palette.points[usize::from(index)]) }
    }

    /// Finds the nearest entry of each bin of a histogram.
    pub(crate) fn of_bins(bins: &[Sample], palette: &Palette, guesses: &Guesses) -> Vec<Self> {
        let nearest = bins.par_iter().enumerate().with_min_len(512).map(|(number, bin)| {
            Self::new(palette.nearest(&bin.point, guesses.of(number, bin.rgb)), bin, palette)
        });
        nearest.collect()
    }
}

/// Returns the mean [level error](colour::level_error) of all pixels counted, if they are drawn
/// with their nearest entries.
pub(crate) fn mean_level_error(histogram: &Histogram, nearest: &[Nearest], palette: &Palette) -> f32 {
    let (mut sum, mut pixels) = (0.0, 0.0);
    for (bin, entry) in histogram.bins().iter().zip(nearest) {
        let mean = bin.mean().map(|level| level.round() as u8);
        let error = colour::level_error(mean, palette.colours[usize::from(entry.index)]);
        sum += bin.count as f32 * error as f32;
        pixels += bin.count as f32;
    }
    sum / f32::max(pixels, 1.0)
}

/// Returns the mean squared error of all pixels counted, if they are drawn with their nearest entries.
pub(crate) fn mean_error(histogram: &Histogram, nearest: &[Nearest]) -> f32 {
    let bins = histogram.bins().iter().zip(nearest);
    let sum = bins.map(|(bin, entry)| bin.count as f32 * entry.error).sum::<f32>();
    sum / f32::max(histogram.pixels() as f32, 1.0)
}
