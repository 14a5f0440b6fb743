//! Numbers of twice the precision, for the sign that decides on which side of a surface a ray starts.
//!
//! A number is a sum of two `f64`s (Dekker, "A floating-point technique for extending the available precision", 1971).
//! Each operation errs by less than 2⁻¹⁰⁰ of the numbers that it is given; what is no larger than such errors is zero
//! ([`Twofold::beside`]). Nothing may overflow or vanish: whoever works with these brings its numbers near 1.

use std::ops::{Add, Mul, Sub};

use glam::DVec3;

/// What errors add up to in any of the polynomials here, as a part of the magnitude of their terms.
const NOISE: f64 = 1.0 / (1u128 << 96) as f64;

/// A sum of two numbers of which the second is below the first one's last bit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twofold {
    high: f64,
    low: f64,
}

/// A vector of them.
pub(super) type Vector = [Twofold; 3];

impl Twofold {
    /// `a - b`, exactly.
    fn difference(a: f64, b: f64) -> Self {
        let high = a - b;
        let of_b = high - a;
        Self { high, low: (a - (high - of_b)) - (b + of_b) }
    }

    /// The nearest `f64`; zero where it is nothing but rounding error beside numbers of this `magnitude`.
    pub(super) fn beside(self, magnitude: f64) -> f64 {
        let value = self.high + self.low;
        if value.abs() <= NOISE * magnitude { 0.0 } else { value }
    }

    /// Without its last bits.
    pub(super) fn value(self) -> f64 {
        self.high
    }
}

impl From<f64> for Twofold {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for Twofold {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let sum = Self::difference(self.high, -other.high);
        let low = sum.low + (self.low + other.low);
        let high = sum.high + low;
        Self { high, low: low - (high - sum.high) }
    }
}

impl Sub for Twofold {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for Twofold {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = self.high * other.high;
        let low = self.high.mul_add(other.high, -product) + (self.high * other.low + self.low * other.high);
        let high = product + low;
        Self { high, low: low - (high - product) }
    }
}

/// `(a - b)·scale` for a power of two.
pub(super) fn between(a: DVec3, b: DVec3, scale: f64) -> Vector {
    [0, 1, 2].map(|axis| Twofold::difference(a[axis] * scale, b[axis] * scale))
}

/// The scalar product.
pub(super) fn dot(u: Vector, v: Vector) -> Twofold {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

/// The vector product.
pub(super) fn cross(u: Vector, v: Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| u[i] * v[j] - u[j] * v[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cancels_is_zero_and_what_hardly_does_is_not() {
        let square = |x: f64| Twofold::from(x) * Twofold::from(x);
        assert_eq!((square(3.0) + square(4.0) - square(5.0)).beside(50.0), 0.0);
        // By integers, as 2^-106 is what their squares are multiples of.
        let whole = |x: f64| ((x * 2f64.powi(53)) as i128).pow(2);
        let exact = whole(0.6) + whole(0.8) - whole(1.0);
        assert_eq!((square(0.6) + square(0.8) - square(1.0)).beside(2.0), exact as f64 * 2f64.powi(-106));
    }

    #[test]
    fn products_of_vectors() {
        let v = |x, y, z| between(DVec3::new(x, y, z), DVec3::ZERO, 1.0);
        assert_eq!(dot(v(1.0, 2.0, 3.0), v(4.0, -5.0, 6.0)).value(), 12.0);
        assert_eq!(cross(v(1.0, 2.0, 3.0), v(4.0, 5.0, 6.0)).map(Twofold::value), [-3.0, 6.0, -3.0]);
    }
}
