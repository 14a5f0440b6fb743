//! How much of what stays may be drawn anew.
//!
//! A pixel that keeps its colour from frame to frame may be seen a little wrong, and a later palette may have a better
//! colour for it. To draw it then makes the animation better, and flicker. So there is an allowance, of pixels and of
//! visible difference, that grows with each frame; the pixels with the largest error are drawn first.

use crate::colour;

/// At first, as a part of the pixels that stay, and as a CIE 1976 difference of all of them.
const AT_FIRST: f64 = 0.35;
/// More of both with each frame: over 20 frames and the first the mean stays at 0.05.
const EACH_FRAME: f64 = 0.03;
/// Steps of error in an octave, as a power of two.
const FINENESS: u32 = 3;
const STEPS: usize = 128;

/// Pixels that stay as they were in the frame before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Still {
    pixels: u64,
    /// How many are seen with which error.
    errors: [u64; STEPS],
}

impl Still {
    pub(crate) fn none() -> Self {
        Self { pixels: 0, errors: [0; STEPS] }
    }

    /// Counts one that is seen right enough.
    pub(crate) fn count(&mut self) {
        self.pixels += 1;
    }

    /// Counts one that is seen with an error that calls for a better colour.
    pub(crate) fn count_wrong(&mut self, error: f32) {
        self.pixels += 1;
        self.errors[step(error)] += 1;
    }

    pub(crate) fn join(mut self, other: Self) -> Self {
        self.pixels += other.pixels;
        for (sum, more) in self.errors.iter_mut().zip(other.errors) {
            *sum += more;
        }
        self
    }
}

/// Still pixels that were drawn anew.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Redrawn {
    pixels: u64,
    difference: f64,
}

impl Redrawn {
    pub(crate) fn count(&mut self, from: [u8; 3], to: [u8; 3]) {
        self.pixels += 1;
        self.difference += visible(colour::near_error(from, to));
    }
}

/// What is left.
#[derive(Debug)]
pub(crate) struct Allowance {
    share: f64,
    difference: f64,
}

impl Allowance {
    pub(crate) fn new() -> Self {
        Self { share: AT_FIRST, difference: AT_FIRST }
    }

    /// The error from which still pixels of the next frame may be drawn anew.
    pub(crate) fn least_error(&mut self, still: &Still) -> f32 {
        self.share += EACH_FRAME;
        self.difference += EACH_FRAME;
        let pixels = still.pixels as f64;
        let (mut share, mut difference) = (self.share * pixels, self.difference * pixels);
        for at in (0..STEPS).rev() {
            let count = still.errors[at] as f64;
            share -= count;
            difference -= count * visible(from(at + 1));
            if share < 0.0 || difference < 0.0 {
                return from(at + 1);
            }
        }
        0.0
    }

    /// Takes off what was used.
    pub(crate) fn pay(&mut self, still: &Still, redrawn: &[Redrawn]) {
        if still.pixels > 0 {
            let pixels = still.pixels as f64;
            self.share -= redrawn.iter().map(|r| r.pixels).sum::<u64>() as f64 / pixels;
            self.difference -= redrawn.iter().map(|r| r.difference).sum::<f64>() / pixels;
        }
    }
}

/// The CIE 1976 difference of a squared error of which L\*a\*b\* makes up half.
fn visible(error: f32) -> f64 {
    f64::from((error / (2.0 * colour::LAB_WEIGHT * colour::LAB_WEIGHT)).sqrt())
}

/// Errors from 1 up in steps of equal ratio: the exponent and the first bits of the number.
fn step(error: f32) -> usize {
    let first = 1.0_f32.to_bits() >> (23 - FINENESS);
    ((error.to_bits() >> (23 - FINENESS)).saturating_sub(first) as usize).min(STEPS - 1)
}

/// The least error of a step.
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
        let mut still = Still::none();
        (0..1_000).for_each(|k| still.count_wrong(2.0 + k as f32 * 0.01));
        let least = Allowance::new().least_error(&still);
        let drawn = (0..1_000).filter(|&k| 2.0 + k as f32 * 0.01 >= least).count();
        assert!((100..=380).contains(&drawn), "{drawn} of 1000 from {least}");
    }

    #[test]
    fn what_is_used_up_comes_back_slowly() {
        let mut still = Still::none();
        (0..100).for_each(|_| still.count_wrong(50.0));
        let mut allowance = Allowance::new();
        let mut all = Redrawn::default();
        (0..100).for_each(|_| all.count([0; 3], [4; 3]));
        allowance.pay(&still, &[all]);
        assert!(allowance.least_error(&still) > 50.0);
    }
}
