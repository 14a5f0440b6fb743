//! Infinite planes, and the intersection of rays with the plane of any flat shape.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::Plane;
use rayfold_scene::model::unit;

use super::solid::{Form, Frame, Place, flat};
use super::{BodyHit, Local};
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::packet::{Ray, no_lane};
use crate::fast::shared::{Plain, Surface};

/// Returns the hits of rays with the plane z = 0. The distance is computed in the same way as that to a slab of a box,
/// so that a shape in the plane of a face is hit at the face's distance. A ray parallel to the plane hits nothing: its
/// distance is infinite or NaN.
#[inline(always)]
pub(super) fn along<S: Simd, E: Real>(simd: S, ray: Local<S, E>) -> (Mask<S, E>, Lanes<S, E>) {
    across::<S, E>(simd, ray.origin.z, ray.direction.z)
}

/// Returns the hits of rays with a plane, given only the height `high` of their origins above it and their rate of
/// ascent `climb`.
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

/// Returns the hits on a plane through `center`, perpendicular to `up`, in the coordinates of the scene. A plane is the
/// only body that needs no axes of its own.
#[inline(always)]
pub(super) fn surface<S: Simd, E: Real>(
    simd: S,
    (up, center): (Vec3<S, E>, Vec3<S, E>),
    ray: Ray<S, E>,
    distance: Lanes<S, E>,
) -> BodyHit<S, E> {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let place = ray.direction.scale_add(distance, ray.origin);
    let beside = zero - up.dot(place.sub(center));
    let side = up.dot(ray.direction).simd_gt(zero).select(zero - one, one);
    BodyHit { point: up.scale_add(beside, place), normal: up.scale(side), within: no_lane::<S, E>(simd) }
}

/// An infinite plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneForm;

impl PlaneForm {
    /// Makes the plane. Its origin is its point nearest to the eye, whatever point the script gives.
    pub(super) fn new(plane: &Plane, place: Place) -> (Frame, Self) {
        let normal = unit(plane.normal());
        (Frame::round_about(normal, normal * normal.dot(place.point(plane.point()))), Self)
    }
}

impl Form for PlaneForm {
    fn size(&self) -> f64 {
        0.0
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface)) {
        each(flat(frame.axes[2], frame.center, f64::INFINITY, Plain::ByAxis));
    }

    fn is_near(&self, place: DVec3, near: f64, is_slanted: bool) -> bool {
        is_slanted && place.z.abs() <= near
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (frame.center, 0.0)
    }

    fn bounds(&self, _: &Frame) -> Option<Bounds> {
        None
    }
}
