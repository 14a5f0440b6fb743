//! How far a pixel may be off.
//!
//! A frame that is drawn over others must not look worse than if it were the only one. So each frame has a bound: a quarter
//! more than the error, of the worst pixel, that it cannot avoid when it is encoded alone. Errors are counted here as one
//! who compares two pictures counts them: the largest difference of a level of sRGB.
//!
//! The bound holds for every pixel that is shown, whether the frame draws it or leaves it as it was. It is what keeps small
//! changes from adding up.

use rayon::prelude::*;

use crate::colour::{closest, levels_off};
use crate::histogram::{Bin, Histogram};
use crate::palette::{Palette, Sample};

/// A pixel may be off by so many times what the worst pixel of the frame alone is.
const OF_ALONE: f32 = 1.25;
/// The bound of frames of few colours that drift.
pub(crate) const DRIFTING: u8 = 4;
/// The bound of what is encoded alone: there is none.
pub(crate) const NONE: u8 = u8::MAX;
/// Pixels that are looked at together.
const PART: usize = 1 << 14;

/// The bound of a frame of more than 256 colours. `histogram`: of all its pixels.
pub(crate) fn of(pixels: &[[u8; 3]], histogram: &Histogram) -> u8 {
    let bins = Sample::of_bins(histogram);
    let (Palette { colours, .. }, guesses) = Palette::of_bins(histogram, &bins, 256);
    // How far a colour, or the worst before it, is off at least.
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
    // Two of more than 256 colours share an entry.
    (OF_ALONE * f32::from(worst.max(1))) as u8
}
