//! Planes without end, and where rays meet the plane of anything flat.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::{Local, Met};
use crate::fast::packet::{Ray, no_lane};
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

/// The surface of a plane through `center`, square to `up`, in the coordinates of the scene: of all bodies it alone needs no
/// axes of its own.
#[inline(always)]
pub(super) fn surface<S: Simd, E: Real>(
    simd: S,
    (up, center): (Vec3<S, E>, Vec3<S, E>),
    ray: Ray<S, E>,
    distance: Lanes<S, E>,
) -> Met<S, E> {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let place = ray.direction.scale_add(distance, ray.origin);
    let beside = zero - up.dot(place.sub(center));
    let side = up.dot(ray.direction).simd_gt(zero).select(zero - one, one);
    Met { point: up.scale_add(beside, place), normal: up.scale(side), within: no_lane::<S, E>(simd) }
}
