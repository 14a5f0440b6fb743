//! Rotated boxes: slabs along axes of their own (Kay and Kajiya). Faces, edges and corners belong to the box.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::Placement;

use super::solid::{Form, Frame, Place, Span, flat};
use super::{BodyHit, Local};
use crate::fast::acceleration::hollow::Hollow;
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::arithmetic::rounding::LATE;
use crate::fast::rays::bounds::Bounds;
use crate::fast::shared::{Plain, Surface};

/// A box centred at the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cuboid<E> {
    half: [E; 3],
}

/// The distances at which rays enter and leave each slab.
struct Slabs<S: Simd, E: Real> {
    near: Vec3<S, E>,
    far: Vec3<S, E>,
    enter: Lanes<S, E>,
    leave: Lanes<S, E>,
}

impl<E: Real> Cuboid<E> {
    pub(super) fn new(half: DVec3) -> Self {
        Self { half: half.to_array().map(E::narrow) }
    }

    #[inline(always)]
    fn slabs<S: Simd>(&self, simd: S, ray: Local<S, E>) -> Slabs<S, E> {
        let [x, y, z] = self.half;
        let (x, y, z) = (
            slab::<S, E>(simd, splat::<S, E>(simd, x), ray.origin.x, ray.direction.x),
            slab::<S, E>(simd, splat::<S, E>(simd, y), ray.origin.y, ray.direction.y),
            slab::<S, E>(simd, splat::<S, E>(simd, z), ray.origin.z, ray.direction.z),
        );
        Slabs {
            near: Vec3::<S, E>::new(x.0, y.0, z.0),
            far: Vec3::<S, E>::new(x.1, y.1, z.1),
            enter: x.0.max(y.0).max(z.0),
            leave: x.1.min(y.1).min(z.1),
        }
    }

    #[inline(always)]
    pub(super) fn intersect<S: Simd>(&self, simd: S, ray: Local<S, E>) -> (Mask<S, E>, Lanes<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let Slabs { enter, leave, .. } = self.slabs(simd, ray);
        let hit = enter.simd_le(leave * constant::<S, E>(simd, 1.0 + LATE * E::ROUNDOFF));
        let distance = enter.simd_gt(zero).select(enter, leave);
        (hit & distance.simd_gt(zero), distance)
    }

    /// Returns the hit of each ray. Where faces share an edge, the face of the first axis wins; a rectangle (one half
    /// length of 0) always has the normal of its plane.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Local<S, E>, distance: Lanes<S, E>) -> BodyHit<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let Slabs { near, far, enter, leave } = self.slabs(simd, ray);
        let entering = enter.simd_gt(zero);
        let is_x = (entering & near.x.simd_eq(enter)) | (!entering & far.x.simd_eq(leave));
        let is_y = !is_x & ((entering & near.y.simd_eq(enter)) | (!entering & far.y.simd_eq(leave)));
        let d = ray.direction;
        let (is_x, is_y) = match self.half.map(|half| half > E::narrow(0.0)) {
            [false, true, true] => (is_x | d.x.simd_ne(zero), is_y & d.x.simd_eq(zero)),
            [true, false, true] => (is_x & d.y.simd_eq(zero), is_y | d.y.simd_ne(zero)),
            [true, true, false] => (is_x & d.z.simd_eq(zero), is_y & d.z.simd_eq(zero)),
            _ => (is_x, is_y),
        };
        let is_z = !is_x & !is_y;
        let place = ray.direction.scale_add(distance, ray.origin);
        let [hx, hy, hz] = self.half.map(
            #[inline(always)]
            |half| splat::<S, E>(simd, half),
        );
        let (x, nx) = face::<S, E>(simd, is_x, entering, ray.direction.x, hx, place.x);
        let (y, ny) = face::<S, E>(simd, is_y, entering, ray.direction.y, hy, place.y);
        let (z, nz) = face::<S, E>(simd, is_z, entering, ray.direction.z, hz, place.z);
        let (point, normal) = (Vec3::<S, E>::new(x, y, z), Vec3::<S, E>::new(nx, ny, nz));
        BodyHit { point, normal, within: !entering }
    }
}

/// Returns the distances at which rays enter and leave a slab. A ray parallel to the slab is in it for all distances,
/// or for none.
#[inline(always)]
fn slab<S: Simd, E: Real>(
    simd: S,
    half: Lanes<S, E>,
    origin: Lanes<S, E>,
    direction: Lanes<S, E>,
) -> (Lanes<S, E>, Lanes<S, E>) {
    let (zero, far) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, E::FAR));
    let inverse = constant::<S, E>(simd, 1.0) / direction;
    let (a, b) = ((zero - half - origin) * inverse, (half - origin) * inverse);
    let is_along = direction.simd_eq(zero);
    let within = origin.abs().simd_le(half);
    (
        is_along.select(within.select(zero - far, far), a.min(b)),
        is_along.select(within.select(far, zero - far), a.max(b)),
    )
}

/// Returns a coordinate of the hit, moved onto the face if the ray hits that face, and the coordinate of the normal.
#[inline(always)]
fn face<S: Simd, E: Real>(
    simd: S,
    here: Mask<S, E>,
    entering: Mask<S, E>,
    direction: Lanes<S, E>,
    half: Lanes<S, E>,
    place: Lanes<S, E>,
) -> (Lanes<S, E>, Lanes<S, E>) {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let forwards = direction.simd_gt(zero);
    let low = !(forwards ^ entering);
    let within = place.max(zero - half).min(half);
    (here.select(low.select(zero - half, half), within), here.select(forwards.select(zero - one, one), zero))
}

/// A box in its frame, given by its half lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct CuboidForm {
    pub(super) half: DVec3,
}

impl CuboidForm {
    pub(super) fn new(cuboid: &rayfold_scene::Cuboid, placement: &Placement, place: Place) -> (Frame, Self) {
        let rotation = placement.rotation();
        let (min, max) = (cuboid.min(), cuboid.max());
        let center = place.point(placement.point(min + 0.5 * (max - min)));
        let half = 0.5 * (max - min) * (placement.scale() * place.scale);
        (Frame { axes: [rotation.x_axis, rotation.y_axis, rotation.z_axis], center }, Self { half })
    }
}

impl Form for CuboidForm {
    fn size(&self) -> f64 {
        self.half.element_sum()
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface)) {
        let (half, center) = (self.half, frame.center);
        for number in 0..3 {
            let (normal, across) = (frame.axes[number], half * (1.0 - DVec3::AXES[number]));
            let apart = half[number] * normal;
            each(flat(normal, center - apart, across.length(), Plain::No));
            if half[number] > 0.0 {
                each(flat(normal, center + apart, across.length(), Plain::No));
            }
        }
    }

    fn is_near(&self, place: DVec3, near: f64, _: bool) -> bool {
        (place.abs() - self.half).max_element().abs() <= near
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (frame.center, self.half.length())
    }

    fn bounds(&self, frame: &Frame) -> Option<Bounds> {
        let ([x, y, z], half) = (frame.axes, self.half);
        let reach = x.abs() * half.x + y.abs() * half.y + z.abs() * half.z;
        Some((frame.center - reach, frame.center + reach))
    }

    fn slab(&self, frame: &Frame) -> Option<Span> {
        Span::of_box(frame, self.half)
    }

    fn hollow(&self, frame: &Frame) -> Option<Hollow> {
        Some((frame.center, self.half.min_element()))
    }
}
