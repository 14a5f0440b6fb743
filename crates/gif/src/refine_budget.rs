//! The budget for redrawing static pixels.
//!
//! A pixel that keeps its colour from frame to frame may be seen slightly wrong, and a later palette may have a
//! better colour for it. Redrawing it makes the picture better, but also makes it flicker. So there is a budget, of
//! pixels and of visible difference. It grows with each frame, and by more if more of the frame changes. The tiles
//! with the largest error are redrawn first.
//!
//! A frame is prepared before the previous one has been drawn, hence before it is known how much that one used. So a
//! frame reserves a part of the budget with a [`Reservation`], and returns what it did not use.

use std::io;

use crate::colour;
use crate::error::Error;
use crate::state::{StateReader, StateWriter, damaged};

/// An amount of the budget, relative to the static pixels: a share of them, and the CIE 1976 difference in the mean
/// over all of them.
struct BudgetShare {
    pixels: f64,
    difference: f64,
}
/// The budget at the start. With the later additions, the mean difference stays below 0.05 over the first 11 frames.
const AT_FIRST: BudgetShare = BudgetShare { pixels: 0.1, difference: 0.13 };
/// The addition per frame if a fair part of it changes.
const EACH_FRAME: BudgetShare = BudgetShare { pixels: 0.2, difference: 0.024 };
/// A frame adds the full amount if at least one in this many of its pixels changes, else proportionally less.
const FOR_CHANGES: f64 = 8.0;
/// A reservation may exceed the remaining budget by this factor, because only a part of it is used. One large
/// improvement costs fewer bytes than many small ones.
const AHEAD: f64 = 4.0;
/// No pixel is redrawn if fewer than one in this many are static: those stay by chance, as in noise, or not for long.
const FEW_STAY: f64 = 16.0;
/// The part of a reservation that is subtracted until it is known what was drawn.
const LENT: f64 = 0.5;
/// Errors are counted in logarithmic steps: 2 to this power per doubling.
const FINENESS: u32 = 3;
const STEPS: usize = 128;

/// Pixels with the same colour as in the frame before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StaticPixels {
    pixels: u64,
    /// The number of pixels seen with an error of each step.
    errors: [u64; STEPS],
}

impl StaticPixels {
    pub(crate) fn none() -> Self {
        Self { pixels: 0, errors: [0; STEPS] }
    }

    /// Counts pixels that are seen right.
    pub(crate) fn count(&mut self, pixels: usize) {
        self.pixels += pixels as u64;
    }

    /// Counts pixels that can be refined, given their mean error.
    pub(crate) fn count_wrong(&mut self, pixels: u64, error: f32) {
        self.pixels += pixels;
        self.errors[step(error)] += pixels;
    }

    pub(crate) fn join(mut self, other: Self) -> Self {
        self.pixels += other.pixels;
        for (sum, more) in self.errors.iter_mut().zip(other.errors) {
            *sum += more;
        }
        self
    }
}

/// Static pixels that were redrawn.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Redrawn {
    pixels: u64,
    difference: f64,
}

impl Redrawn {
    /// Counts a pixel whose colour changed by a squared error. `levels` is the part of the error
    /// from the sRGB levels.
    pub(crate) fn count(&mut self, error: f32, levels: u32) {
        self.pixels += 1;
        self.difference += difference(error - levels as f32);
    }
}

/// The budget that is left.
#[derive(Debug)]
pub(crate) struct RefineBudget {
    share: f64,
    difference: f64,
    /// The number of frames in a row that refined nothing outside of the changed area, plus one.
    pub(crate) waited: usize,
}

impl RefineBudget {
    pub(crate) fn new() -> Self {
        Self { share: AT_FIRST.pixels, difference: AT_FIRST.difference, waited: 1 }
    }

    pub(crate) fn write(&self, state: &mut StateWriter) -> io::Result<()> {
        state.f64(self.share)?;
        state.f64(self.difference)?;
        state.u64(self.waited as u64)
    }

    pub(crate) fn read(state: &mut StateReader<'_>) -> Result<Self, Error> {
        let (share, difference, waited) = (state.f64()?, state.f64()?, state.u64()?);
        let waited = u32::try_from(waited).map_err(|_| damaged("it has waited for too many frames"))?;
        Ok(Self { share, difference, waited: waited as usize })
    }

    pub(crate) fn is_left(&self) -> bool {
        self.share > 0.01 && self.difference > 0.01
    }

    /// Reserves a part of the budget for the next frame, before the previous one has committed. `of`: the pixels
    /// of the whole frame.
    pub(crate) fn reserve(&mut self, still: &StaticPixels, of: usize) -> Reservation {
        let pixels = still.pixels as f64;
        if pixels * FEW_STAY < of as f64 {
            return Reservation { pixels, share: 0.0, difference: 0.0, least_error: f32::INFINITY };
        }
        let most = [self.share * pixels * AHEAD, self.difference * pixels * AHEAD];
        let (mut asked, mut least_error) = ([0.0; 2], 0.0);
        for at in (0..STEPS).rev() {
            let count = still.errors[at] as f64;
            let more = [asked[0] + count, asked[1] + count * visible(from(at + 1))];
            if more[0] > most[0] || more[1] > most[1] {
                least_error = from(at + 1);
                break;
            }
            asked = more;
        }
        let [share, difference] = asked.map(|sum| LENT * sum / pixels.max(1.0));
        self.share -= share;
        self.difference -= difference;
        Reservation { pixels, share, difference, least_error }
    }

    /// Releases a reservation of which nothing was used.
    pub(crate) fn release(&mut self, reservation: &Reservation) {
        self.share += reservation.share;
        self.difference += reservation.difference;
    }

    /// Returns the unused part of a reservation, and adds the growth of a frame of which the part `changed` changed.
    pub(crate) fn commit(&mut self, reservation: &Reservation, redrawn: &[Redrawn], changed: f64) {
        if reservation.least_error == f32::INFINITY {
            return;
        }
        let more = (changed * FOR_CHANGES).min(1.0);
        let pixels = reservation.pixels.max(1.0);
        self.share += EACH_FRAME.pixels * more + reservation.share
            - redrawn.iter().map(|r| r.pixels).sum::<u64>() as f64 / pixels;
        self.difference += EACH_FRAME.difference * more + reservation.difference
            - redrawn.iter().map(|r| r.difference).sum::<f64>() / pixels;
    }
}

/// The part of the budget that a frame may use.
#[derive(Debug)]
pub(crate) struct Reservation {
    /// The number of static pixels.
    pixels: f64,
    share: f64,
    difference: f64,
    /// The least error at which the static pixels of a tile may be redrawn.
    pub(crate) least_error: f32,
}

impl Reservation {
    pub(crate) fn write(&self, state: &mut StateWriter) -> io::Result<()> {
        state.f64(self.pixels)?;
        state.f64(self.share)?;
        state.f64(self.difference)?;
        state.f32(self.least_error)
    }

    pub(crate) fn read(state: &mut StateReader<'_>) -> Result<Self, Error> {
        let (pixels, share, difference) = (state.f64()?, state.f64()?, state.f64()?);
        Ok(Self { pixels, share, difference, least_error: state.f32()? })
    }
}

/// Returns the CIE 1976 difference for a squared error of which L\*a\*b\* makes up half.
fn visible(error: f32) -> f64 {
    difference(error / 2.0)
}

/// Returns the CIE 1976 difference for the part of a squared error that is due to L\*a\*b\*.
fn difference(lab: f32) -> f64 {
    f64::from((lab.max(0.0) / (colour::LAB_WEIGHT * colour::LAB_WEIGHT)).sqrt())
}

/// Returns the step of an error from 1 up. Steps have equal ratios: the exponent and the first bits of the number.
fn step(error: f32) -> usize {
    let first = 1.0_f32.to_bits() >> (23 - FINENESS);
    ((error.to_bits() >> (23 - FINENESS)).saturating_sub(first) as usize).min(STEPS - 1)
}

/// Returns the least error of a step.
fn from(step: usize) -> f32 {
    f32::from_bits(1.0_f32.to_bits() + ((step as u32) << (23 - FINENESS)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_hold_their_errors() {
        for error in [1.0, 1.1, 2.0, 7.3, 100.0, 40_000.0] {
            assert!(from(step(error)) <= error && error < from(step(error) + 1), "{error}");
        }
        assert_eq!((step(0.0), step(f32::MAX)), (0, STEPS - 1));
    }

    #[test]
    fn the_largest_errors_come_first_and_no_more_than_allowed() {
        let mut still = StaticPixels::none();
        (0..1_000).for_each(|k| still.count_wrong(1, 2.0 + k as f32 * 0.01));
        let least = RefineBudget::new().reserve(&still, still.pixels as usize).least_error;
        let drawn = (0..1_000).filter(|&k| 2.0 + k as f32 * 0.01 >= least).count();
        let most = 1_000.0 * AHEAD * AT_FIRST.pixels;
        assert!((100..=most as usize).contains(&drawn), "{drawn} of 1000 from {least}");
    }

    #[test]
    fn in_the_long_run_no_more_is_drawn_than_granted() {
        let mut budget = RefineBudget::new();
        let (frames, mut sum) = (200, 0.0);
        let mut uncommitted: Option<(Reservation, Redrawn)> = None;
        for frame in 0..frames {
            let errors = (0..1_000_u32).map(|k| 2.0 + (k * 37 + frame * 101) as f32 % 97.0);
            let mut still = StaticPixels::none();
            if budget.is_left() {
                errors.clone().for_each(|error| still.count_wrong(1, error));
            } else {
                still.count(1_000);
            }
            let reservation = budget.reserve(&still, still.pixels as usize);
            let mut redrawn = Redrawn::default();
            if still.errors.iter().any(|&count| count > 0) {
                errors
                    .filter(|&error| error >= reservation.least_error)
                    .for_each(|error| redrawn.count(error, error as u32 / 2));
            }
            sum += redrawn.difference / 1_000.0;
            // As in the encoder: a frame commits after the next one has reserved.
            if let Some((reservation, redrawn)) = uncommitted.replace((reservation, redrawn)) {
                budget.commit(&reservation, &[redrawn], 1.0);
            }
        }
        let granted = AT_FIRST.difference * AHEAD + EACH_FRAME.difference * f64::from(frames);
        assert!(sum <= granted && sum > 0.5 * granted, "{sum} of {granted}");
    }

    #[test]
    fn what_is_used_up_comes_back_slowly() {
        let mut still = StaticPixels::none();
        (0..100).for_each(|_| still.count_wrong(1, 50.0));
        let mut budget = RefineBudget::new();
        let mut all = Redrawn::default();
        (0..100).for_each(|_| all.count(50.0, 25));
        let reservation = budget.reserve(&still, still.pixels as usize);
        budget.commit(&reservation, &[all], 1.0);
        assert!(budget.reserve(&still, still.pixels as usize).least_error > 50.0);
    }

    #[test]
    fn where_few_stay_nothing_is_drawn_anew() {
        let mut still = StaticPixels::none();
        (0..100).for_each(|k| still.count_wrong(1, if k < 20 { 50.0 } else { 3.0 }));
        let mut budget = RefineBudget::new();
        let reservation = budget.reserve(&still, 10_000);
        assert!(reservation.least_error > from(STEPS));
        budget.commit(&reservation, &[], 1.0);
        assert_eq!((budget.share, budget.difference), (AT_FIRST.pixels, AT_FIRST.difference));
        assert!(budget.reserve(&still, 1_000).least_error <= 50.0);
    }

    #[test]
    fn what_was_not_used_comes_back_at_once() {
        let mut still = StaticPixels::none();
        (0..100).for_each(|k| still.count_wrong(1, if k < 20 { 50.0 } else { 3.0 }));
        let mut budget = RefineBudget::new();
        let first = budget.reserve(&still, still.pixels as usize);
        let meanwhile = budget.reserve(&still, still.pixels as usize);
        budget.commit(&first, &[], 0.0);
        budget.commit(&meanwhile, &[], 0.0);
        let later = budget.reserve(&still, still.pixels as usize);
        assert!(meanwhile.least_error > first.least_error);
        assert_eq!(later.least_error, first.least_error);
    }
}
