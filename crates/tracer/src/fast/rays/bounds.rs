//! Bounding boxes, and the test of packets of rays against them.
//!
//! A bounding box is not a shape, so there is no hit point. A box is padded for every rounding error of its test, so
//! that it never hides its contents (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013).

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant};
use crate::fast::arithmetic::rounding::{BOX, LATE_IN_TREE};
use crate::fast::rays::packet::{Ray, Slopes};

/// The smallest and the largest corner of a box.
pub(crate) type Bounds = (DVec3, DVec3);

/// The empty box: joined with another box it gives that box.
pub(crate) const NOTHING: Bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);

/// Returns the box around two boxes.
pub(crate) fn join(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Returns a box as packets are tested against it. If one box contains another, its padded box contains the other's
/// padded box too.
pub(crate) fn padded<E: Real>((min, max): Bounds) -> ([E; 3], [E; 3]) {
    let slack = BOX * E::ROUNDOFF;
    ((min - slack).to_array().map(E::narrow), (max + slack).to_array().map(E::narrow))
}

/// The per-ray constants of the test against boxes, for a packet of rays.
#[derive(Clone, Copy)]
pub(crate) struct Crossing<S: Simd, E: Real> {
    inverse: Vec3<S, E>,
    /// The quotient -origin / direction.
    shift: Vec3<S, E>,
}

impl<S: Simd, E: Real> Crossing<S, E> {
    #[inline(always)]
    pub(crate) fn new(simd: S, ray: Ray<S, E>) -> Self {
        let inverse = Slopes::new(simd, ray.direction).inverse;
        Self { inverse, shift: Vec3::zero(simd).sub(ray.origin.mul(inverse)) }
    }

    /// Returns the lanes that hit a [padded] box nearer than `limit`.
    #[inline(always)]
    pub(crate) fn intersects(&self, simd: S, low: [E; 3], high: [E; 3], limit: Lanes<S, E>) -> Mask<S, E> {
        let (enter, leave) = self.span(simd, low, high);
        enter.simd_le(leave.min(limit))
    }

    /// Returns the lanes that come within `wider` of a [padded] box, anywhere ahead.
    #[inline(always)]
    pub(crate) fn comes_near(
        &self,
        simd: S,
        (low, high): ([E; 3], [E; 3]),
        wider: Lanes<S, E>,
    ) -> Mask<S, E> {
        let (low, high) = (Vec3::<S, E>::splat(simd, low), Vec3::<S, E>::splat(simd, high));
        let low = Vec3::<S, E>::new(low.x - wider, low.y - wider, low.z - wider);
        let high = Vec3::<S, E>::new(high.x + wider, high.y + wider, high.z + wider);
        let (enter, leave) = self.between(simd, low, high);
        enter.simd_le(leave)
    }

    /// Returns the distances at which the rays enter a [padded] box and the largest at which they can leave it. The
    /// interval of a box contains that of each box within it, because rounding is monotonic.
    #[inline(always)]
    pub(crate) fn span(&self, simd: S, low: [E; 3], high: [E; 3]) -> (Lanes<S, E>, Lanes<S, E>) {
        self.between(simd, Vec3::splat(simd, low), Vec3::splat(simd, high))
    }

    /// Returns [`Self::span`] for rays with one box each.
    #[inline(always)]
    fn between(&self, simd: S, low: Vec3<S, E>, high: Vec3<S, E>) -> (Lanes<S, E>, Lanes<S, E>) {
        let (inverse, shift) = (self.inverse, self.shift);
        let (ax, bx) = (low.x.fused_mul_add(inverse.x, shift.x), high.x.fused_mul_add(inverse.x, shift.x));
        let (ay, by) = (low.y.fused_mul_add(inverse.y, shift.y), high.y.fused_mul_add(inverse.y, shift.y));
        let (az, bz) = (low.z.fused_mul_add(inverse.z, shift.z), high.z.fused_mul_add(inverse.z, shift.z));
        let enter = ax.min(bx).max(ay.min(by)).max(az.min(bz)).max(constant::<S, E>(simd, 0.0));
        let leave = ax.max(bx).min(ay.max(by)).min(az.max(bz));
        (enter, leave * constant::<S, E>(simd, 1.0 + LATE_IN_TREE * E::ROUNDOFF))
    }
}
