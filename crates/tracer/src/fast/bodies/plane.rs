//! Planes without end, and where rays meet the plane of anything flat.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::{Local, Met};
use crate::fast::packet::no_lane;
use crate::fast::real::{Lanes, Mask, Real, Vec3, constant};

/// Where rays meet the plane z = 0. The distance is worked out as that to a box's slab, so that what lies in the plane of
/// a face is met where the face is. A ray along the plane meets nothing: its distance is infinite or not a number.
#[inline(always)]
pub(super) fn along<S: Simd, E: Real>(simd: S, ray: Local<S, E>) -> (Mask<S, E>, Lanes<S, E>) {
    across::<S, E>(simd, ray.origin.z, ray.direction.z)
}

/// The same for rays of which no more is known than how `high` over the plane they start, and how they `climb`.
#[inline(always)]
pub(super) fn across<S: Simd, E: Real>(
    simd: S,
    high: Lanes<S, E>,
    climb: Lanes<S, E>,
) -> (Mask<S, E>, Lanes<S, E>) {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let distance = (zero - high) * (one / climb);
    let is_ahead = distance.simd_gt(zero) & distance.simd_lt(constant::<S, E>(simd, E::FAR));
    (is_ahead, distance)
}

/// The surface of the plane z = 0.
#[inline(always)]
pub(super) fn surface<S: Simd, E: Real>(simd: S, ray: Local<S, E>, distance: Lanes<S, E>) -> Met<S, E> {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let Vec3 { x, y, .. } = ray.direction.scale_add(distance, ray.origin);
    let up = ray.direction.z.simd_gt(zero).select(zero - one, one);
    let (point, normal) = (Vec3::<S, E>::new(x, y, zero), Vec3::<S, E>::new(zero, zero, up));
    Met { point, normal, within: no_lane::<S, E>(simd) }
}
