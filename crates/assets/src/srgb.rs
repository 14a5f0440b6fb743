//! The transfer function of sRGB (IEC 61966-2-1).

/// Returns the linear value of an encoded one, both from 0 to 1. Beyond 1 the curve goes on.
pub(crate) fn decoded(x: f64) -> f64 {
    if x <= 0.04045 { x / 12.92 } else { libm::pow((x + 0.055) / 1.055, 2.4) }
}

/// Returns the encoded value of a linear one, both from 0 to 1.
pub(crate) fn encoded(x: f64) -> f64 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_are_inverse() {
        for k in 0..=255 {
            let x = f64::from(k) / 255.0;
            assert!((encoded(decoded(x)) - x).abs() < 1e-7, "{k}");
        }
        assert_eq!((decoded(0.0), encoded(0.0)), (0.0, 0.0));
        assert!((decoded(1.0) - 1.0).abs() < 1e-15 && (encoded(1.0) - 1.0).abs() < 1e-15);
    }
}
