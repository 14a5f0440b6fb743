//! Boxes that bound things, and packets of rays against them.
//!
//! Not a shape: nothing is ever hit here. A box is wide enough for every rounding error of its test, so that it never
//! hides what is within it (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013).

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::packet::{Ray, Slopes};
use super::real::{Lanes, Mask, Real, Vec3, constant};
use super::rounding::{BOX, LATE_IN_TREE};

/// The least and the greatest corner of a box.
pub(super) type Bounds = (DVec3, DVec3);

/// What [`join`] makes of nothing.
pub(super) const NOTHING: Bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);

/// The box around two.
pub(super) fn join(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// A box as packets are tested against it. One that lies within another is within that one here too.
pub(super) fn padded<E: Real>((min, max): Bounds) -> ([E; 3], [E; 3]) {
    let slack = BOX * E::ROUNDOFF;
    ((min - slack).to_array().map(E::narrow), (max + slack).to_array().map(E::narrow))
}

/// What a test against boxes needs of a packet of rays.
#[derive(Clone, Copy)]
pub(super) struct Crossing<S: Simd, E: Real> {
    inverse: Vec3<S, E>,
    /// -origin / direction
    shift: Vec3<S, E>,
}

impl<S: Simd, E: Real> Crossing<S, E> {
    #[inline(always)]
    pub(super) fn new(simd: S, ray: Ray<S, E>) -> Self {
        let inverse = Slopes::new(simd, ray.direction).inverse;
        Self { inverse, shift: Vec3::zero(simd).sub(ray.origin.mul(inverse)) }
    }

    /// Which lanes meet a [padded] box nearer than `limit`.
    #[inline(always)]
    pub(super) fn meets(&self, simd: S, low: [E; 3], high: [E; 3], limit: Lanes<S, E>) -> Mask<S, E> {
        let (enter, leave) = self.span(simd, low, high);
        enter.simd_le(leave.min(limit))
    }

    /// Where the rays enter a [padded] box and where they leave it, at the latest. A box within another has a span within
    /// its span: rounding keeps order.
    #[inline(always)]
    pub(super) fn span(&self, simd: S, low: [E; 3], high: [E; 3]) -> (Lanes<S, E>, Lanes<S, E>) {
        let (low, high) = (Vec3::splat(simd, low), Vec3::splat(simd, high));
        let (inverse, shift) = (self.inverse, self.shift);
        let (ax, bx) = (low.x.mul_add(inverse.x, shift.x), high.x.mul_add(inverse.x, shift.x));
        let (ay, by) = (low.y.mul_add(inverse.y, shift.y), high.y.mul_add(inverse.y, shift.y));
        let (az, bz) = (low.z.mul_add(inverse.z, shift.z), high.z.mul_add(inverse.z, shift.z));
        let enter = ax.min(bx).max(ay.min(by)).max(az.min(bz)).max(constant::<S, E>(simd, 0.0));
        let leave = ax.max(bx).min(ay.max(by)).min(az.max(bz));
        (enter, leave * constant::<S, E>(simd, 1.0 + LATE_IN_TREE * E::ROUNDOFF))
    }
}
