//! Integers in `f64`. On targets without an instruction for them, `floor` and the remainder are library calls. This
//! module avoids these calls, because patterns need several in every pixel.

/// The bound from which on every number is an integer.
const ALL_WHOLE: f64 = (1u64 << f64::MANTISSA_DIGITS) as f64;

/// The bound from which on every number is a multiple of 256.
const ALL_ROUND: f64 = 256.0 * ALL_WHOLE;

/// Returns the largest integer that is not larger than `x`.
pub(super) fn floor(x: f64) -> f64 {
    if x.abs() < ALL_WHOLE {
        let towards_zero = x as i64 as f64;
        if towards_zero > x { towards_zero - 1.0 } else { towards_zero }
    } else {
        x
    }
}

/// Returns the smallest integer that is not smaller than `x`.
pub(super) fn ceil(x: f64) -> f64 {
    -floor(-x)
}

/// Returns the remainder, from 0 to 255, of an integer of any size and sign divided by 256; 0 for a NaN.
pub(super) fn remainder(whole: f64) -> u8 {
    if whole.abs() < ALL_ROUND { whole as i64 as u8 } else { 0 }
}

/// Returns whether a whole number is odd.
pub(super) fn is_odd(whole: f64) -> bool {
    remainder(whole) % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_those_of_the_library() {
        let seed = fastrand::u64(..);
        println!("seed {seed}");
        let mut rng = fastrand::Rng::with_seed(seed);
        let nasty =
            [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 255.0, -256.0, 1e300, -1e300, f64::MIN_POSITIVE, -5e-324];
        let edges =
            [ALL_WHOLE, ALL_ROUND].into_iter().flat_map(|x| [x.next_down(), x, x.next_up(), 0.5 * x - 0.5]);
        let random = (0..100_000).map(|_| (rng.f64() - 0.5) * f64::from(rng.i32(-8..80)).exp2());
        for x in nasty.into_iter().chain(edges).chain(random).flat_map(|x| [x, -x]) {
            assert_eq!((floor(x), ceil(x)), (x.floor(), x.ceil()), "{x:e}");
            let whole = x.floor();
            assert_eq!(f64::from(remainder(whole)), whole.rem_euclid(256.0), "{whole:e}");
            assert_eq!(is_odd(whole), whole.rem_euclid(2.0) == 1.0, "{whole:e}");
        }
        assert_eq!((remainder(f64::INFINITY), remainder(f64::NAN)), (0, 0));
        assert!(floor(f64::NAN).is_nan() && floor(f64::NEG_INFINITY) == f64::NEG_INFINITY);
    }
}
