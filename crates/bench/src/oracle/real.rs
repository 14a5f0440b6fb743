//! Numbers of high precision, and vectors of them.
//!
//! For numbers that come from `f64`s within 2^±150 of one another, the sums, differences and products in the
//! discriminants, areas and cross products of the oracle are exact. Quotients and roots have 190 correct decimal
//! digits.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

use astro_float_num::{BigFloat, Consts, RoundingMode, Sign};
use glam::DVec3;

/// The bits of the significand. They make `b² - a·c` of a sphere exact, with room for scenes of wide range.
const BITS: usize = 640;
const ROUNDING: RoundingMode = RoundingMode::ToEven;

/// A real number.
#[derive(Clone, Debug)]
pub struct Real(BigFloat);

impl Real {
    /// Returns zero.
    pub fn zero() -> Self {
        Self::from(0.0)
    }

    /// Returns `self / other`.
    pub fn over(&self, other: &Self) -> Self {
        Self(self.0.div(&other.0, BITS, ROUNDING))
    }

    /// Returns the square root of a number that is not negative.
    pub fn root(&self) -> Self {
        Self(self.0.sqrt(BITS, ROUNDING))
    }

    /// Returns the real roots of a·t² + 2·b·t + c, for a greater than 0. If c is 0, one root is exact.
    pub(super) fn roots(a: &Self, b: &Self, c: &Self) -> Vec<Self> {
        let discriminant = &(b * b) - &(a * c);
        if discriminant.sign() < 0 {
            return Vec::new();
        }
        // From a point of a surface one root is 0, which the other formula would round.
        let root = discriminant.root();
        let q = if b.sign() < 0 { &root - b } else { &(-b) - &root };
        let mut roots = vec![q.over(a)];
        if q.sign() != 0 {
            roots.push(c.over(&q));
        }
        roots
    }

    /// Returns the tangent of half an angle in degrees.
    pub(super) fn tangent_of_half(degrees: f64) -> Self {
        // The cache of constants only saves time.
        let Ok(mut constants) = Consts::new() else { return Self(BigFloat::nan(None)) };
        let half_turn = Self(constants.pi(BITS, ROUNDING));
        let angle = (&Self::from(degrees) * &half_turn).over(&Self::from(360.0));
        Self(angle.0.tan(BITS, ROUNDING, &mut constants))
    }

    /// Returns the smallest integer that is not less, for numbers below 2^50.
    pub(super) fn ceiling(&self) -> f64 {
        let near = self.to_f64().ceil();
        [near - 1.0, near, near + 1.0].into_iter().find(|&whole| Self::from(whole) >= *self).unwrap_or(near)
    }

    /// Returns -1, 0 or 1.
    pub fn sign(&self) -> i32 {
        if self.0.is_zero() {
            0
        } else if self.0.is_negative() {
            -1
        } else {
            1
        }
    }

    /// Returns the absolute value.
    pub fn magnitude(&self) -> Self {
        Self(self.0.abs())
    }

    /// Returns `self · 2^exponent`.
    pub fn shifted(&self, exponent: i32) -> Self {
        let mut shifted = self.0.clone();
        if let Some(e) = shifted.exponent().filter(|_| !shifted.is_zero()) {
            shifted.set_exponent(e + exponent);
        }
        Self(shifted)
    }

    /// Returns the nearest `f64`.
    pub fn to_f64(&self) -> f64 {
        let Some((words, _, sign, exponent, _)) = self.0.as_raw_parts() else {
            return if self.0.is_nan() { f64::NAN } else { f64::INFINITY.copysign(f64::from(self.sign())) };
        };
        let Some((&top, rest)) = words.split_last() else { return 0.0 };
        // The 64 leading bits, with a sticky last bit. Their conversion to 53 bits therefore rounds as all bits would.
        let sticky = u64::from(rest.iter().any(|&word| word != 0));
        let value = scaled((top | sticky) as f64, exponent - 64);
        if sign == Sign::Neg { -value } else { value }
    }
}

/// Returns `x · 2^exponent`. Intermediate results overflow or underflow only if the result does.
fn scaled(mut x: f64, mut exponent: i32) -> f64 {
    while exponent != 0 {
        let step = exponent.clamp(-1000, 1000);
        x *= 2f64.powi(step);
        exponent -= step;
    }
    x
}

impl From<f64> for Real {
    fn from(x: f64) -> Self {
        // The conversion accepts normal numbers only.
        let shift = if x.is_subnormal() { 100 } else { 0 };
        Self(BigFloat::from_f64(x * 2f64.powi(shift), BITS)).shifted(-shift)
    }
}

impl Add for &Real {
    type Output = Real;
    fn add(self, other: &Real) -> Real {
        Real(self.0.add(&other.0, BITS, ROUNDING))
    }
}

impl Sub for &Real {
    type Output = Real;
    fn sub(self, other: &Real) -> Real {
        Real(self.0.sub(&other.0, BITS, ROUNDING))
    }
}

impl Mul for &Real {
    type Output = Real;
    fn mul(self, other: &Real) -> Real {
        Real(self.0.mul(&other.0, BITS, ROUNDING))
    }
}

impl Neg for &Real {
    type Output = Real;
    fn neg(self) -> Real {
        Real(BigFloat::neg(&self.0))
    }
}

impl PartialEq for Real {
    fn eq(&self, other: &Self) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}

impl PartialOrd for Real {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.0.cmp(&other.0).map(|sign| sign.cmp(&0))
    }
}

/// A vector of real numbers.
#[derive(Clone, Debug)]
pub struct Vector(pub [Real; 3]);

impl Vector {
    /// Returns the scalar product.
    pub fn dot(&self, other: &Self) -> Real {
        let [x, y, z] = &self.0;
        let [a, b, c] = &other.0;
        &(&(x * a) + &(y * b)) + &(z * c)
    }

    /// Returns the cross product.
    pub fn cross(&self, other: &Self) -> Self {
        let [x, y, z] = &self.0;
        let [a, b, c] = &other.0;
        Self([&(y * c) - &(z * b), &(z * a) - &(x * c), &(x * b) - &(y * a)])
    }

    /// Returns `self + factor · other`.
    pub fn plus(&self, factor: &Real, other: &Self) -> Self {
        Self(std::array::from_fn(|axis| &self.0[axis] + &(factor * &other.0[axis])))
    }

    /// Returns `self - other`.
    pub fn minus(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|axis| &self.0[axis] - &other.0[axis]))
    }

    /// Returns the vector of length 1 in this direction.
    pub fn unit(&self) -> Self {
        let length = self.dot(self).root();
        Self(std::array::from_fn(|axis| self.0[axis].over(&length)))
    }

    /// Returns the componentwise product.
    pub(super) fn times(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|axis| &self.0[axis] * &other.0[axis]))
    }

    /// Returns the absolute values of the components.
    pub(super) fn magnitude(&self) -> Self {
        Self(std::array::from_fn(|axis| self.0[axis].magnitude()))
    }

    /// Returns the vector of the opposite direction.
    pub fn opposite(&self) -> Self {
        Self(std::array::from_fn(|axis| -&self.0[axis]))
    }

    /// Returns the nearest vector of `f64`s.
    pub fn to_dvec3(&self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|axis| self.0[axis].to_f64()))
    }
}

impl From<DVec3> for Vector {
    fn from(v: DVec3) -> Self {
        Self(v.to_array().map(Real::from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_survive_the_way_there_and_back() {
        for x in [0.0, 1.0, -1.5, 0.1, 1e-300, -1e300, f64::MAX, f64::MIN_POSITIVE, 5e-324, 1.0 / 3.0] {
            assert_eq!(Real::from(x).to_f64(), x);
        }
    }

    #[test]
    fn a_result_is_rounded_once() {
        let half_ulp = Real::from(f64::EPSILON / 2.0);
        let tie = &Real::from(1.0) + &half_ulp;
        assert_eq!(tie.to_f64(), 1.0);
        let above = &tie + &Real::from(1e-100);
        assert_eq!(above.to_f64(), 1.0 + f64::EPSILON);
        assert_eq!(Real::from(2.0).root().to_f64(), 2f64.sqrt());
        assert_eq!(Real::from(1.0).over(&Real::from(3.0)).to_f64(), 1.0 / 3.0);
    }

    #[test]
    fn what_cancels_in_f64_does_not_here() {
        let (big, small) = (Real::from(1e30), Real::from(1e-30));
        assert_eq!((&(&big + &small) - &big).to_f64(), 1e-30);
        assert_eq!(Real::from(3.0).shifted(-1000).shifted(1000).to_f64(), 3.0);
    }
}
