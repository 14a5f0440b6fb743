//! The factor by which the sRGB curve stretches small differences of light.

use crate::reference::encoded;

/// The sRGB curve is linear up to [`LINEAR`], and a power beyond it. [`BENT`] is 1 minus the exponent of that power.
pub(super) const LINEAR: f64 = 0.003_130_8;
pub(super) const BENT: f64 = 1.0 - 1.0 / 2.4;

/// The least light for which slopes have bounds. It is above [`LINEAR`].
const LEAST: f64 = 1.0 / 256.0;

/// The least difference for which slopes have bounds: the slopes of shorter chords have too large rounding errors.
const APART: f64 = 1e-6;

/// The number of bits of the mantissa by which slopes are looked up, and the shift that leaves them.
const BITS: u32 = 6;
const SHIFT: u32 = f64::MANTISSA_DIGITS - 1 - BITS;

/// The number of entries from [`LEAST`] to 1, and one beyond.
const ENTRIES: usize = (8 << BITS) + 2;

/// Returns the slope of the curve's chord that is `apart` long, with its middle at `light`.
pub(super) fn slope(light: f64, apart: f64) -> f64 {
    let (low, high) = ends(light, apart);
    if high - low < 1e-9 { 12.92 } else { (encoded(high) - encoded(low)) / (high - low) }
}

fn ends(light: f64, apart: f64) -> (f64, f64) {
    ((light - 0.5 * apart).max(0.0), (light + 0.5 * apart).min(1.0))
}

/// Bounds of [`slope`], which takes two powers.
#[derive(Debug)]
pub(super) struct SlopeBounds {
    /// The curve's slope at the start of each interval of numbers with the same first bits.
    slopes: [f64; ENTRIES],
}

impl SlopeBounds {
    pub(super) fn new() -> Self {
        let light = |at: usize| f64::from_bits((first() + at as u64) << SHIFT);
        Self { slopes: core::array::from_fn(|at| 1.055 / 2.4 * libm::pow(light(at), -BENT)) }
    }

    /// Returns a lower and an upper bound of the slope, apart from rounding errors of less than a millionth. Returns
    /// `None` near black and for tiny differences.
    #[inline(always)]
    pub(super) fn of(&self, light: f64, apart: f64) -> Option<(f64, f64)> {
        let (low, high) = ends(light, apart);
        if low < LEAST || high - low < APART {
            return None;
        }
        // The curve is concave there: a chord is as steep as the curve is at one of its points.
        let at = |light: f64| (light.to_bits() >> SHIFT).wrapping_sub(first()) as usize;
        Some((*self.slopes.get(at(high) + 1)?, *self.slopes.get(at(low))?))
    }
}

const fn first() -> u64 {
    LEAST.to_bits() >> SHIFT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_between_their_bounds_which_are_close() {
        let bounds = SlopeBounds::new();
        let mut dice = fastrand::Rng::with_seed(2026);
        let mut bounded = 0;
        for _ in 0..300_000 {
            // Small differences as well as large ones, and also dark and bright light.
            let light = dice.f64() * 0.5f64.powi(dice.i32(0..10));
            let apart = (light * dice.f64() * 0.5f64.powi(dice.i32(0..16))).min(1.0);
            let Some((least, most)) = bounds.of(light, apart) else { continue };
            bounded += 1;
            let slope = slope(light, apart);
            assert!(
                least * (1.0 - 1e-6) <= slope && slope <= most * (1.0 + 1e-6),
                "{light}, {apart}: {slope}"
            );
            if apart < 0.01 * light {
                assert!(most < 1.04 * least, "{light}, {apart}: {least} to {most}");
            }
        }
        assert!(bounded > 150_000, "{bounded}");
        assert!(bounds.of(1.0, 1e-3).is_some(), "the brightest light");
        assert!(
            [(0.5, 0.0), (LINEAR, 1e-5), (LEAST, 1e-3)]
                .iter()
                .all(|&(light, apart)| bounds.of(light, apart).is_none())
        );
    }
}
