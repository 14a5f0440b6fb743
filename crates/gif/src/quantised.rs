//! The colours of a frame drawn with those of a palette: the palette, and the entry for each colour.

use rayon::prelude::*;

use crate::colour::{closest, levels_off};
use crate::histogram::{Bin, Histogram};
use crate::nearest::{self, Nearest};
use crate::palette::{Guesses, Palette, Sample};
use crate::update_map::PixelUpdate;

/// The mean squared error (see [`colour`](crate::colour)) up to which a palette of half as many colours is used. Such
/// a palette takes half as many bytes, and its indices take fewer bytes, too.
const GOOD_ENOUGH: f32 = 0.8;
/// The error allowed in addition is this divided by the number of pixels drawn, but at most `AT_MOST`. If few pixels
/// are drawn, the palette is much of the file.
const BY_PIXELS: f32 = 5000.0;
const AT_MOST: f32 = 3.0;
/// The smallest palette after halving, transparent included.
const FEWEST: usize = 16;
/// A frame with more bins keeps its large palette: a smaller one would hardly suffice, and takes long to compute.
const MAX_BINS_HALVED: usize = 4096;

/// The largest number of colours that are added to a palette because of the bound.
const MAX_ADDED: usize = 64;
/// A palette is not repaired if more colours than this are too far off.
const MAX_FAR: usize = 1 << 9;
/// Pixels that one thread processes at a time.
const PART: usize = 1 << 14;

/// A palette, the entry nearest to each bin, and the mean squared error of the pixels drawn.
#[derive(Debug)]
pub(crate) struct Quantised {
    pub(crate) palette: Palette,
    pub(crate) nearest: Vec<Nearest>,
    pub(crate) error: f32,
}

impl Quantised {
    /// Quantises to at most `size` colours.
    pub(crate) fn new(histogram: &Histogram, bins: &[Sample], size: usize) -> Self {
        let (palette, guesses) = Palette::of_bins(histogram, bins, size);
        Self::of(palette, &guesses, histogram, bins)
    }

    /// Quantises to the colours of a palette.
    pub(crate) fn of(palette: Palette, guesses: &Guesses, histogram: &Histogram, bins: &[Sample]) -> Self {
        let nearest = Nearest::of_bins(bins, &palette, guesses);
        let error = nearest::mean_error(histogram, &nearest);
        Self { palette, nearest, error }
    }

    /// Halves the palette as long as its error stays small enough. One index is left for transparent.
    pub(crate) fn of_fewer_colours(mut self, histogram: &Histogram, bins: &[Sample]) -> Self {
        if bins.len() > MAX_BINS_HALVED {
            return self;
        }
        let bound = GOOD_ENOUGH + (BY_PIXELS / histogram.pixels() as f32).min(AT_MOST);
        // Half as many colours have at least twice the error.
        while self.error * 2.0 <= bound {
            let size = (self.palette.colours.len() + 1).next_power_of_two() / 2;
            if size < FEWEST {
                break;
            }
            let fewer = Self::new(histogram, bins, size - 1);
            if fewer.error > bound {
                break;
            }
            self = fewer;
        }
        self
    }

    /// Replaces entries so that each colour drawn has one within `bound`. Returns `None` if that is impossible.
    pub(crate) fn within(
        mut self,
        (pixels, updates): (&[[u8; 3]], &[PixelUpdate]),
        histogram: &Histogram,
        bins: &[Sample],
        bound: u8,
    ) -> Option<Self> {
        let mut room = (self.palette.colours.len() + 1).next_power_of_two() - 1;
        for again in [true, true, true, true, false] {
            let mut far = self.too_far((pixels, updates), histogram, bound)?;
            if far.is_empty() {
                return Some(self);
            }
            // First the colour that can replace most of the others.
            let mut added = Vec::new();
            let covered =
                |rgb, far: &[[u8; 3]]| far.iter().filter(|far| levels_off(**far, rgb) <= bound).count();
            while let Some(&rgb) = far.iter().max_by_key(|rgb| covered(**rgb, &far)) {
                added.push(rgb);
                far.retain(|&other| levels_off(other, rgb) > bound);
                if added.len() > MAX_ADDED {
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

    /// Returns the colours that are drawn and have no entry within `bound`, or `None` if there are too many.
    fn too_far(
        &self,
        (pixels, updates): (&[[u8; 3]], &[PixelUpdate]),
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
                pixels.par_chunks(PART).zip(updates.par_chunks(PART)).flat_map_iter(|(pixels, updates)| {
                    let drawn = pixels.iter().zip(updates).filter(|(_, update)| update.may_draw());
                    drawn.filter_map(|(&rgb, _)| far(rgb)).take(MAX_FAR)
                });
            parts.collect()
        };
        found.sort_unstable();
        found.dedup();
        (found.len() < MAX_FAR).then_some(found)
    }

    /// Returns `count` colours of the palette: those that others could replace best are left out.
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

    /// Quantises to other colours, most of which are those of this palette.
    fn with(&self, colours: Vec<[u8; 3]>, histogram: &Histogram, bins: &[Sample]) -> Self {
        let place = |rgb: &[u8; 3]| {
            colours.binary_search(rgb).unwrap_or_else(|next| next.min(colours.len() - 1)) as u8
        };
        let places = self.palette.colours.iter().map(place).collect::<Vec<_>>();
        let guesses = self.nearest.iter().map(|entry: &Nearest| places[usize::from(entry.index)]).collect();
        Self::of(Palette::new(colours), &Guesses::of_each(guesses), histogram, bins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::histogram::MAX_BINS;

    fn of_fewer(colours: impl Iterator<Item = [u8; 3]>, count: u32) -> (usize, f32) {
        let mut histogram = Histogram::new(MAX_BINS);
        colours.for_each(|rgb| histogram.add(rgb, count));
        let bins = Sample::of_bins(&histogram);
        let Quantised { palette, nearest, error } =
            Quantised::new(&histogram, &bins, 255).of_fewer_colours(&histogram, &bins);
        assert_eq!(nearest.len(), histogram.bins().len());
        (palette.colours.len(), error)
    }

    #[test]
    fn colours_that_are_nearly_one_share_a_small_palette() {
        let (colours, error) = of_fewer((0..200).map(|k| [100 + k % 4, 100 + k / 4 % 4, 100]), 10_000);
        assert!(colours < FEWEST && error <= GOOD_ENOUGH + 0.1, "{colours} colours, error {error}");
    }

    #[test]
    fn colours_far_apart_keep_theirs() {
        let (colours, error) = of_fewer((0..200_u8).map(|k| [k, 255 - k, k.wrapping_mul(91)]), 10_000);
        assert_eq!((colours, error), (200, 0.0));
    }

    #[test]
    fn few_pixels_are_worth_fewer_colours_than_many() {
        let gray = || (0..120).map(|level| [level; 3]);
        let (few, many) = (of_fewer(gray(), 1), of_fewer(gray(), 10_000));
        assert!(few.0 < many.0, "{few:?} {many:?}");
    }

    #[test]
    fn a_colour_that_is_too_far_off_is_taken_in_and_what_cannot_be_is_refused() {
        let mut histogram = Histogram::new(MAX_BINS);
        (0..400_u16).for_each(|k| histogram.add([(k / 4) as u8, (k % 4) as u8 * 8, 90], 1_000));
        histogram.add([255, 0, 255], 1);
        let bins = Sample::of_bins(&histogram);
        let of_31 = || Quantised::new(&histogram, &bins, 31);
        let far = of_31().too_far((&[], &[]), &histogram, 8).unwrap();
        assert!(!far.is_empty());
        let within = of_31().within((&[], &[]), &histogram, &bins, 8).unwrap();
        assert!(within.palette.colours.contains(&[255, 0, 255]));
        assert_eq!(within.too_far((&[], &[]), &histogram, 8), Some(Vec::new()));
        assert!(of_31().within((&[], &[]), &histogram, &bins, 0).is_none());
    }
}
