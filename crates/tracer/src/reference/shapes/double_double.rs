//! Double-double numbers, which have twice the precision. They give the sign that decides on which side of a surface a
//! ray starts.
//!
//! A number is a sum of two `f64`s (Dekker, "A floating-point technique for extending the available precision", 1971).
//! Each operation has an error below 2⁻¹⁰⁰ of its operands. A result no larger than such errors is zero
//! ([`DoubleDouble::beside`]). No operation may overflow or underflow, so callers must scale their numbers to near 1.

use std::ops::{Add, Mul, Sub};

use glam::DVec3;
use rayfold_scene::Placement;

/// The accumulated error of each of the polynomials here, relative to the magnitude of their terms.
const NOISE: f64 = 1.0 / (1u128 << 96) as f64;

/// A sum of two numbers, the second of which is below the last bit of the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct DoubleDouble {
    high: f64,
    low: f64,
}

/// A vector of double-double numbers.
pub(super) type Vector = [DoubleDouble; 3];

impl DoubleDouble {
    /// Returns `a - b`, exactly.
    fn difference(a: f64, b: f64) -> Self {
        let high = a - b;
        let of_b = high - a;
        Self { high, low: (a - (high - of_b)) - (b + of_b) }
    }

    /// Returns the nearest `f64`, or zero if the value is only a rounding error relative to numbers of this
    /// `magnitude`.
    pub(super) fn beside(self, magnitude: f64) -> f64 {
        let value = self.high + self.low;
        if value.abs() <= NOISE * magnitude { 0.0 } else { value }
    }

    /// Divides by a number.
    fn over(self, divisor: f64) -> Self {
        let part = self.high / divisor;
        let rest = (-part).mul_add(divisor, self.high) + self.low;
        Self::from(part) + Self::from(rest / divisor)
    }

    /// Returns the value without its last bits.
    pub(super) fn value(self) -> f64 {
        self.high
    }

    /// The last bits.
    pub(super) fn rest(self) -> f64 {
        self.low
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let sum = Self::difference(self.high, -other.high);
        let low = sum.low + (self.low + other.low);
        let high = sum.high + low;
        Self { high, low: low - (high - sum.high) }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = self.high * other.high;
        let low = self.high.mul_add(other.high, -product) + (self.high * other.low + self.low * other.high);
        let high = product + low;
        Self { high, low: low - (high - product) }
    }
}

/// A point as an unevaluated sum: `low` holds what `high` lost by rounding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    high: DVec3,
    low: DVec3,
}

impl From<DVec3> for Place {
    fn from(high: DVec3) -> Self {
        Self { high, low: DVec3::ZERO }
    }
}

impl Place {
    /// Converts a point of the world to the coordinates of a group.
    pub(crate) fn in_group(world: DVec3, placement: &Placement) -> Self {
        let scale = placement.scale();
        let from = between(world, placement.translation(), 1.0);
        let along = |axis: DVec3| dot(from, axis.to_array().map(DoubleDouble::from)).over(scale);
        let [x, y, z] = [0, 1, 2].map(|axis| along(placement.rotation().col(axis)));
        Self { high: DVec3::new(x.high, y.high, z.high), low: DVec3::new(x.low, y.low, z.low) }
    }

    pub(super) fn rounded(self) -> DVec3 {
        self.high
    }

    /// Returns the vector from here to another point, rounded once.
    pub(crate) fn towards(self, other: DVec3) -> DVec3 {
        let [x, y, z] = between(self, other, 1.0);
        -DVec3::new(x.high, y.high, z.high)
    }
}

/// Returns `(a - b)·scale` for a power of two.
pub(super) fn between(a: impl Into<Place>, b: DVec3, scale: f64) -> Vector {
    let Place { high, low } = a.into();
    [0, 1, 2].map(|axis| {
        let apart = DoubleDouble::difference(high[axis] * scale, b[axis] * scale);
        if low[axis] == 0.0 { apart } else { apart + DoubleDouble::from(low[axis] * scale) }
    })
}

/// Returns the dot product.
pub(super) fn dot(u: Vector, v: Vector) -> DoubleDouble {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}

/// Returns the cross product.
pub(super) fn cross(u: Vector, v: Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| u[i] * v[j] - u[j] * v[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cancels_is_zero_and_what_hardly_does_is_not() {
        let square = |x: f64| DoubleDouble::from(x) * DoubleDouble::from(x);
        assert_eq!((square(3.0) + square(4.0) - square(5.0)).beside(50.0), 0.0);
        // In integers, because the squares are multiples of 2^-106.
        let whole = |x: f64| ((x * 2f64.powi(53)) as i128).pow(2);
        let exact = whole(0.6) + whole(0.8) - whole(1.0);
        assert_eq!((square(0.6) + square(0.8) - square(1.0)).beside(2.0), exact as f64 * 2f64.powi(-106));
    }

    #[test]
    fn products_of_vectors() {
        let v = |x, y, z| between(DVec3::new(x, y, z), DVec3::ZERO, 1.0);
        assert_eq!(dot(v(1.0, 2.0, 3.0), v(4.0, -5.0, 6.0)).value(), 12.0);
        assert_eq!(cross(v(1.0, 2.0, 3.0), v(4.0, 5.0, 6.0)).map(DoubleDouble::value), [-3.0, 6.0, -3.0]);
    }
}
