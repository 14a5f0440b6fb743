//! A packet of rays, the nearest of what they meet, and the surface there: what the tests of all shapes have in common.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::real::{Lanes, Mask, Real, Vec3, constant, splat};

/// A packet of rays; directions have the length 1.
#[derive(Clone, Copy)]
pub(super) struct Ray<S: Simd, E: Real> {
    pub(super) origin: Vec3<S, E>,
    pub(super) direction: Vec3<S, E>,
}

/// What tests against planes square to the axes need of a ray.
#[derive(Clone, Copy)]
pub(super) struct Slopes<S: Simd, E: Real> {
    /// 1 / direction, and a far number instead of infinity.
    pub(super) inverse: Vec3<S, E>,
    /// Whether a lane runs along such a plane.
    pub(super) flat: bool,
}

/// The nearest hits so far.
#[derive(Clone, Copy)]
pub(super) struct Nearest<S: Simd, E: Real> {
    pub(super) distance: Lanes<S, E>,
    /// Positions in the script.
    pub(super) order: Lanes<S, E>,
}

/// Where a ray goes on from: the point, off its surface on the side that the ray came from, and the unit normal on
/// that side.
#[derive(Clone, Copy)]
pub(super) struct Surface<S: Simd, E: Real> {
    pub(super) start: Vec3<S, E>,
    pub(super) normal: Vec3<S, E>,
    /// How far the start is off the surface.
    pub(super) offset: Lanes<S, E>,
    /// Which rays come there from within the object; none for what has no inside.
    pub(super) within: Mask<S, E>,
}

impl<S: Simd, E: Real> Surface<S, E> {
    /// The point as far off the surface on its other side.
    #[inline(always)]
    pub(super) fn beyond(&self, simd: S) -> Vec3<S, E> {
        self.normal.scale_add(self.offset * constant::<S, E>(simd, -2.0), self.start)
    }
}

/// No lane of a packet.
#[inline(always)]
pub(super) fn no_lane<S: Simd, E: Real>(simd: S) -> Mask<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    zero.simd_lt(zero)
}

impl<S: Simd, E: Real> Slopes<S, E> {
    #[inline(always)]
    pub(super) fn new(simd: S, direction: Vec3<S, E>) -> Self {
        let (one, zero, far) =
            (constant::<S, E>(simd, 1.0), constant::<S, E>(simd, 0.0), constant::<S, E>(simd, E::FAR));
        let Vec3 { x, y, z } = direction;
        let flat = x.simd_eq(zero) | y.simd_eq(zero) | z.simd_eq(zero);
        let inverse = Vec3::<S, E>::new(one / x, one / y, one / z);
        if !flat.any_true() {
            return Self { inverse, flat: false };
        }
        let inverse = Vec3::<S, E>::new(
            x.simd_eq(zero).select(far, inverse.x),
            y.simd_eq(zero).select(far, inverse.y),
            z.simd_eq(zero).select(far, inverse.z),
        );
        Self { inverse, flat: true }
    }
}

impl<S: Simd, E: Real> Nearest<S, E> {
    /// Nothing yet, however far.
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        Self { distance: constant::<S, E>(simd, E::FAR), order: constant::<S, E>(simd, E::FAR) }
    }

    /// Which rays meet something.
    #[inline(always)]
    pub(super) fn hit(&self, simd: S) -> Mask<S, E> {
        self.distance.simd_lt(constant::<S, E>(simd, E::FAR))
    }

    /// Takes a hit where it is nearer, or as near and earlier in the script.
    #[inline(always)]
    pub(super) fn offer(&mut self, simd: S, hit: Mask<S, E>, distance: Lanes<S, E>, order: E) {
        let order = splat::<S, E>(simd, order);
        let first = distance.simd_eq(self.distance) & order.simd_lt(self.order);
        let take = hit & (distance.simd_lt(self.distance) | first);
        self.distance = take.select(distance, self.distance);
        self.order = take.select(order, self.order);
    }
}

/// `slope · point + start`
#[inline(always)]
pub(super) fn affine<S: Simd, E: Real>(
    simd: S,
    (slope, start): ([E; 3], E),
    point: Vec3<S, E>,
) -> Lanes<S, E> {
    Vec3::splat(simd, slope).dot_add(point, splat::<S, E>(simd, start))
}

/// So many roundoffs of the sum of a point's coordinates.
#[inline(always)]
pub(super) fn offset<S: Simd, E: Real>(simd: S, point: Vec3<S, E>, roundoffs: f64) -> Lanes<S, E> {
    (point.x.abs() + point.y.abs() + point.z.abs()) * constant::<S, E>(simd, roundoffs * E::ROUNDOFF)
}
