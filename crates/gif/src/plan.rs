//! How a frame is to be drawn: without loss, or with the palette that serves it best.

use crate::allowance::Loan;
use crate::block::Area;
use crate::bound;
use crate::exact::FewColours;
use crate::histogram::Histogram;
use crate::nearest::{self, Nearest};
use crate::needs::Needs;
use crate::palette::{Guesses, Palette, Sample};

/// Mean squared error (see [`colour`](crate::colour)) up to which a palette of half as many colours is taken: it takes up
/// half as many bytes, and the indices fewer, too.
const GOOD_ENOUGH: f32 = 0.8;
/// Added to it: this divided by the number of pixels drawn, but at most `AT_MOST`. Where little is drawn, the palette is
/// much of the file.
const BY_PIXELS: f32 = 5000.0;
const AT_MOST: f32 = 3.0;
/// The fewest colours that a palette is halved to, transparent included.
const FEWEST: usize = 16;
/// A frame with more bins keeps its large palette: a smaller one would hardly do, and takes long to make.
const MOST_BINS_HALVED: usize = 4096;

/// How a frame is to be drawn.
#[derive(Debug)]
pub(crate) enum Plan {
    /// Without loss.
    Lossless(FewColours),
    /// With the colours of a palette.
    Lossy(LossyPlan),
}

/// What is drawn with which palette.
#[derive(Debug)]
pub(crate) struct LossyPlan {
    /// `None` if the frame is encoded as if it were alone: the first one, and those that cannot be drawn well enough over
    /// others.
    pub(crate) loan: Option<Loan>,
    /// How far a pixel may be off.
    pub(crate) bound: u8,
    /// The part of the frame that is drawn because it changed.
    pub(crate) changed: f64,
    /// `None` if nothing is to be drawn.
    pub(crate) area: Option<Area>,
    pub(crate) quantised: Box<Quantised>,
    /// Mean level error of what is drawn.
    pub(crate) level_error: f32,
}

/// A palette, the entry nearest to each bin, and the mean squared error of what is drawn.
#[derive(Debug)]
pub(crate) struct Quantised {
    pub(crate) palette: Palette,
    pub(crate) nearest: Vec<Nearest>,
    pub(crate) error: f32,
}

impl LossyPlan {
    /// For a frame of which the needs are known. Fills the histogram with the colours that are drawn; each of `parts` counts
    /// a part of them. `loan`: given if the frame is drawn over others, so that no pixel is further off than `bound`.
    /// Where that cannot be, the loan is back in `loan`, and the frame is planned as if it were alone.
    pub(crate) fn new(
        pixels: &[[u8; 3]],
        width: usize,
        loan: &mut Option<Loan>,
        bound: u8,
        needs: &mut Needs,
        histogram: &mut Histogram,
        parts: &mut [Histogram],
    ) -> Self {
        if let Some(lent) = loan.take() {
            let changed =
                needs.count(pixels, lent.least_error, histogram, parts) as f64 / pixels.len() as f64;
            let area = Area::around(&needs.pixels, width, |need| need.may_draw());
            let bins = Sample::of_bins(histogram);
            let best = Quantised::new(histogram, &bins, 255).of_fewer_colours(histogram, &bins);
            if let Some(quantised) = best.within((pixels, &needs.pixels), histogram, &bins, bound) {
                let level_error =
                    nearest::mean_level_error(histogram, &quantised.nearest, &quantised.palette);
                return Self {
                    loan: Some(lent),
                    bound,
                    changed,
                    area,
                    quantised: Box::new(quantised),
                    level_error,
                };
            }
            *loan = Some(lent);
        }
        needs.draw_all(width, pixels.len());
        histogram.count(pixels, parts);
        let bins = Sample::of_bins(histogram);
        // A viewer may see the first frame for long, or see nothing else.
        let quantised = Quantised::new(histogram, &bins, 256);
        let level_error = nearest::mean_level_error(histogram, &quantised.nearest, &quantised.palette);
        let area = Some(Area::whole(width, pixels.len()));
        Self {
            loan: None,
            bound: bound::NONE,
            changed: 1.0,
            area,
            quantised: Box::new(quantised),
            level_error,
        }
    }
}

impl Quantised {
    /// With at most so many colours.
    pub(crate) fn new(histogram: &Histogram, bins: &[Sample], size: usize) -> Self {
        let (palette, guesses) = Palette::of_bins(histogram, bins, size);
        Self::of(palette, &guesses, histogram, bins)
    }

    /// With the colours of a palette.
    pub(crate) fn of(palette: Palette, guesses: &Guesses, histogram: &Histogram, bins: &[Sample]) -> Self {
        let nearest = Nearest::of_bins(bins, &palette, guesses);
        let error = nearest::mean_error(histogram, &nearest);
        Self { palette, nearest, error }
    }

    /// Halves the palette as long as its error stays small enough. One index of it is left for transparent.
    fn of_fewer_colours(mut self, histogram: &Histogram, bins: &[Sample]) -> Self {
        if bins.len() > MOST_BINS_HALVED {
            return self;
        }
        let bound = GOOD_ENOUGH + (BY_PIXELS / histogram.pixels() as f32).min(AT_MOST);
        // Half as many colours have twice the error or more.
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::histogram::MOST_BINS;

    fn of_fewer(colours: impl Iterator<Item = [u8; 3]>, count: u32) -> (usize, f32) {
        let mut histogram = Histogram::new(MOST_BINS);
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
}
