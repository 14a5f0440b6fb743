//! Powers of two that bring numbers of any size near 1, where their products neither overflow nor underflow.
//!
//! Scaling by them is exact, so results do not depend on the unit of length.

/// Returns the largest power of two whose product with `x` is below 1, or the nearest to it whose inverse is also
/// finite; 1 for zero.
pub(crate) fn below_inverse(x: f64) -> f64 {
    if x == 0.0 {
        return 1.0;
    }
    // From the exponent bits, not by a logarithm: the result must double exactly when x halves.
    let exponent = ((x.to_bits() >> 52) & 0x7ff) as i32 - 1022;
    let inverse = 1023 - exponent.clamp(-1000, 1000);
    f64::from_bits((inverse as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_product_is_near_one() {
        for x in [1e-290, 0.3, 1.0, 1.5, 1e7, 1e290] {
            assert!((0.5..1.0).contains(&(x * below_inverse(x))), "{x}");
        }
        for x in [5e-324, 1e-305, 1e305, f64::MAX] {
            let product = x * below_inverse(x);
            assert!((1e-25..1e8).contains(&product), "{x} becomes {product}");
        }
        assert_eq!(below_inverse(0.0), 1.0);
    }
}
