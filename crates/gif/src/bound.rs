//! The largest error that a pixel of a frame may have.
//!
//! A frame that is drawn over others must not look worse than if it were the only one. The bound of a frame is
//! therefore 1.25 times the error of its worst pixel when the frame is encoded alone. Errors are measured here as one
//! compares two pictures: by the largest difference of a level of sRGB.
//!
//! The bound holds for every pixel that is shown, whether the frame draws it or leaves it as it was. So small changes
//! cannot add up from frame to frame.

use rayon::prelude::*;

use crate::colour::{closest, levels_off};
use crate::histogram::{Bin, Histogram};
use crate::palette::{Palette, Sample};

/// A pixel may exceed the error of the worst pixel of the frame encoded alone by this factor.
const OF_ALONE: f32 = 1.25;
/// The bound of frames that have few colours and drift, in levels.
pub(crate) const DRIFTING: u8 = 4;
/// The bound of a frame that is encoded alone: no limit.
pub(crate) const NONE: u8 = u8::MAX;
/// Pixels that one thread processes at a time.
const PART: usize = 1 << 14;

/// Returns the bound of a frame of more than 256 colours. `histogram` counts all its pixels.
pub(crate) fn of(pixels: &[[u8; 3]], histogram: &Histogram) -> u8 {
    let bins = Sample::of_bins(histogram);
    let (Palette { colours, .. }, guesses) = Palette::of_bins(histogram, &bins, 256);
    // Returns the smallest error that this colour or a worse one before it can have.
    let worse = |worst: u8, rgb: [u8; 3]| {
        let near = histogram.find(rgb).map_or(0, |bin| guesses.of(bin, bins[bin].rgb));
        if levels_off(colours[usize::from(near)], rgb) <= worst {
            return worst;
        }
        closest(&colours, rgb).1.max(worst)
    };
    let worst = if histogram.is_exact() {
        histogram.bins().iter().map(Bin::colour).fold(0, worse)
    } else {
        let parts = pixels
            .par_chunks(PART)
            .map(|pixels| pixels.chunk_by(|a, b| a == b).map(|run| run[0]).fold(0, worse));
        parts.reduce(|| 0, u8::max)
    };
    // With more than 256 colours, two share an entry: the error is at least 1.
    (OF_ALONE * f32::from(worst.max(1))) as u8
}
