//! A packet of rays, its nearest hits, and the surfaces there: the parts that the tests of all shapes share.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};

/// A packet of rays with directions of length 1.
#[derive(Clone, Copy)]
pub(crate) struct Ray<S: Simd, E: Real> {
    pub(crate) origin: Vec3<S, E>,
    pub(crate) direction: Vec3<S, E>,
}

/// The per-ray constants of tests against planes perpendicular to the axes.
#[derive(Clone, Copy)]
pub(crate) struct Slopes<S: Simd, E: Real> {
    /// 1 / direction, with a large number in place of infinity.
    pub(crate) inverse: Vec3<S, E>,
    /// Whether any lane is parallel to such a plane.
    pub(crate) flat: bool,
}

/// The nearest hits so far.
#[derive(Clone, Copy)]
pub(crate) struct Nearest<S: Simd, E: Real> {
    pub(crate) distance: Lanes<S, E>,
    /// The positions of the objects in the script.
    pub(crate) order: Lanes<S, E>,
}

/// The surface at a hit, for rays that start there: the start point, off the surface on the side that the ray came
/// from, and the unit normal on that side.
#[derive(Clone, Copy)]
pub(crate) struct Surface<S: Simd, E: Real> {
    pub(crate) start: Vec3<S, E>,
    pub(crate) normal: Vec3<S, E>,
    /// The distance of the start point from the surface.
    pub(crate) offset: Lanes<S, E>,
    /// The rays that hit the surface from within the object; none if the object has no inside.
    pub(crate) within: Mask<S, E>,
}

impl<S: Simd, E: Real> Surface<S, E> {
    /// Returns the point at the same distance from the surface on its other side.
    #[inline(always)]
    pub(crate) fn beyond(&self, simd: S) -> Vec3<S, E> {
        self.normal.scale_add(self.offset * constant::<S, E>(simd, -2.0), self.start)
    }
}

/// Returns the empty mask.
#[inline(always)]
pub(crate) fn no_lane<S: Simd, E: Real>(simd: S) -> Mask<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    zero.simd_lt(zero)
}

impl<S: Simd, E: Real> Slopes<S, E> {
    #[inline(always)]
    pub(crate) fn new(simd: S, direction: Vec3<S, E>) -> Self {
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
    /// Returns the state before any hit: all distances are infinite.
    #[inline(always)]
    pub(crate) fn none(simd: S) -> Self {
        Self { distance: constant::<S, E>(simd, E::FAR), order: constant::<S, E>(simd, E::FAR) }
    }

    /// Returns the rays that have a hit.
    #[inline(always)]
    pub(crate) fn hit(&self, simd: S) -> Mask<S, E> {
        self.distance.simd_lt(constant::<S, E>(simd, E::FAR))
    }

    /// Takes a hit if it is nearer, or equally near and earlier in the script.
    #[inline(always)]
    pub(crate) fn offer(&mut self, simd: S, hit: Mask<S, E>, distance: Lanes<S, E>, order: E) {
        let order = splat::<S, E>(simd, order);
        let first = distance.simd_eq(self.distance) & order.simd_lt(self.order);
        let take = hit & (distance.simd_lt(self.distance) | first);
        self.distance = take.select(distance, self.distance);
        self.order = take.select(order, self.order);
    }
}

/// Returns `slope · point + start`.
#[inline(always)]
pub(crate) fn affine<S: Simd, E: Real>(
    simd: S,
    (slope, start): ([E; 3], E),
    point: Vec3<S, E>,
) -> Lanes<S, E> {
    Vec3::splat(simd, slope).dot_add(point, splat::<S, E>(simd, start))
}

/// Returns `roundoffs` roundoffs of the sum of a point's coordinates.
#[inline(always)]
pub(crate) fn offset<S: Simd, E: Real>(simd: S, point: Vec3<S, E>, roundoffs: f64) -> Lanes<S, E> {
    (point.x.abs() + point.y.abs() + point.z.abs()) * constant::<S, E>(simd, roundoffs * E::ROUNDOFF)
}
