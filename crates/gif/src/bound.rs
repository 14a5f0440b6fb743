//! How far a pixel may be off.
//!
//! A frame that is drawn over others must not look worse than if it were the only one. So each frame has a bound: a quarter
//! more than the error, of the worst pixel, that it cannot avoid when it is encoded alone. Errors are counted here as one
//! who compares two pictures counts them: the largest difference of a level of sRGB.
//!
//! The bound holds for every pixel that is shown, whether the frame draws it or leaves it as it was. It is what keeps small
//! changes from adding up.

use rayon::prelude::*;

use crate::histogram::{Bin, Histogram};
use crate::nearest::Nearest;
use crate::needs::Need;
use crate::palette::{Guesses, Palette, Sample};
use crate::plan::Quantised;

/// A pixel may be off by so many times what the worst pixel of the frame alone is.
const OF_ALONE: f32 = 1.25;
/// The bound of frames of few colours that drift.
pub(crate) const DRIFTING: u8 = 4;
/// The bound of what is encoded alone: there is none.
pub(crate) const NONE: u8 = u8::MAX;
/// The most colours that a palette takes in because of the bound.
const MOST_ADDED: usize = 64;
/// With more colours that are too far off, a palette is not mended.
const MOST_FAR: usize = 1 << 9;
/// Pixels that are looked at together.
const PART: usize = 1 << 14;

/// The largest difference of a level.
pub(crate) fn levels_off(a: [u8; 3], b: [u8; 3]) -> u8 {
    a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1])).max(a[2].abs_diff(b[2]))
}

/// The index of the colour that is off least, and by how much.
pub(crate) fn closest(colours: &[[u8; 3]], rgb: [u8; 3]) -> (u8, u8) {
    let off = colours.iter().map(|&colour| levels_off(colour, rgb));
    (0..=u8::MAX).zip(off).fold((0, u8::MAX), |best, now| if now.1 < best.1 { now } else { best })
}

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

impl Quantised {
    /// Changes entries so that each colour that is drawn has one within `bound`; `None` if that cannot be.
    pub(crate) fn within(
        mut self,
        (pixels, needs): (&[[u8; 3]], &[Need]),
        histogram: &Histogram,
        bins: &[Sample],
        bound: u8,
    ) -> Option<Self> {
        let mut room = (self.palette.colours.len() + 1).next_power_of_two() - 1;
        for again in [true, true, true, true, false] {
            let mut far = self.too_far((pixels, needs), histogram, bound)?;
            if far.is_empty() {
                return Some(self);
            }
            // The one first that stands in for most of the others.
            let mut added = Vec::new();
            let covered =
                |rgb, far: &[[u8; 3]]| far.iter().filter(|far| levels_off(**far, rgb) <= bound).count();
            while let Some(&rgb) = far.iter().max_by_key(|rgb| covered(**rgb, &far)) {
                added.push(rgb);
                far.retain(|&other| levels_off(other, rgb) > bound);
                if added.len() > MOST_ADDED {
                    return None;
                }
            }
            while room < 255 && added.len() > room / 4 {
                room = 2 * room + 1;
            }
            if !again {
                return None;
            }
            let mut colours = self.most_useful(histogram.bins(), room - added.len());
            colours.append(&mut added);
            colours.sort_unstable();
            colours.dedup();
            self = self.with(colours, histogram, bins);
            room = (2 * room + 1).min(255);
        }
        None
    }

    /// The colours that are drawn and have no entry within `bound`; `None` if there are too many.
    fn too_far(
        &self,
        (pixels, needs): (&[[u8; 3]], &[Need]),
        histogram: &Histogram,
        bound: u8,
    ) -> Option<Vec<[u8; 3]>> {
        let far = |rgb: [u8; 3]| {
            let nearest = histogram.find(rgb).map_or(0, |bin| self.nearest[bin].index);
            if levels_off(self.palette.colours[usize::from(nearest)], rgb) <= bound {
                return None;
            }
            (closest(&self.palette.colours, rgb).1 > bound).then_some(rgb)
        };
        let mut found: Vec<_> = if histogram.is_exact() {
            histogram.bins().iter().map(Bin::colour).filter_map(far).collect()
        } else {
            let parts =
                pixels.par_chunks(PART).zip(needs.par_chunks(PART)).flat_map_iter(|(pixels, needs)| {
                    let drawn = pixels.iter().zip(needs).filter(|(_, need)| need.may_draw());
                    drawn.filter_map(|(&rgb, _)| far(rgb)).take(MOST_FAR)
                });
            parts.collect()
        };
        found.sort_unstable();
        found.dedup();
        (found.len() < MOST_FAR).then_some(found)
    }

    /// So many of the colours of the palette, without those that others can stand in for best.
    fn most_useful(&self, bins: &[Bin], count: usize) -> Vec<[u8; 3]> {
        let colours = &self.palette.colours;
        if colours.len() <= count {
            return colours.clone();
        }
        let mut uses = vec![0.0_f32; colours.len()];
        for (bin, entry) in bins.iter().zip(&self.nearest) {
            uses[usize::from(entry.index)] += bin.count as f32;
        }
        let cost = |at: usize| (uses[at] * self.palette.apart_from_others(at as u8), at);
        let mut costs = (0..colours.len()).map(cost).collect::<Vec<_>>();
        costs.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        costs[..count].iter().map(|&(_, at)| colours[at]).collect()
    }

    /// With other colours, most of which are the same.
    fn with(&self, colours: Vec<[u8; 3]>, histogram: &Histogram, bins: &[Sample]) -> Self {
        let place = |rgb: &[u8; 3]| {
            colours.binary_search(rgb).unwrap_or_else(|next| next.min(colours.len() - 1)) as u8
        };
        let places = self.palette.colours.iter().map(place).collect::<Vec<_>>();
        let guesses = self.nearest.iter().map(|entry: &Nearest| places[usize::from(entry.index)]).collect();
        Self::of(Palette::new(colours), &Guesses::of_each(guesses), histogram, bins)
    }
}
