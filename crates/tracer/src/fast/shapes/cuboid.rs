//! Boxes along the axes.

use std::ops::Range;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::arithmetic::rounding::{LATE, OFFSET};
use crate::fast::lights::sun::Sun;
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::packet::{Nearest, Ray, Slopes, Surface, offset};
use crate::fast::rays::placed;
use crate::fast::rays::placed::{Face, Sight, across_corners, edge_nearest, nearest_within};
use crate::fast::rays::predicate::Place;
use crate::fast::shapes::shape::{Items, Obstacles, Obstructs, Precalculations, Robust, Tests};

/// A box in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct RenderSpaceCuboid {
    pub(in crate::fast) min: DVec3,
    pub(in crate::fast) max: DVec3,
}

impl RenderSpaceCuboid {
    /// Makes a box that is moved so that `center` is the origin, and is then scaled.
    pub(in crate::fast) fn new(cuboid: &rayfold_scene::Cuboid, center: DVec3, scale: f64) -> Self {
        Self { min: (cuboid.min() - center) * scale, max: (cuboid.max() - center) * scale }
    }
}

/// Returns the largest distance along an axis from `center` to a point of the box.
pub(in crate::fast) fn reach(cuboid: &rayfold_scene::Cuboid, center: DVec3) -> f64 {
    let from = |point: DVec3| (point - center).abs().max_element();
    from(cuboid.min()).max(from(cuboid.max()))
}

impl placed::RenderSpaceShape for RenderSpaceCuboid {
    fn bounds(&self) -> Bounds {
        (self.min, self.max)
    }

    fn support(&self, direction: DVec3) -> f64 {
        (direction * self.min).max(direction * self.max).element_sum()
    }

    fn across(&self, axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)> {
        let &Self { min, max } = self;
        let mut corners = [min; 8];
        for (k, corner) in corners.iter_mut().enumerate() {
            *corner =
                DVec3::new([min.x, max.x][k & 1], [min.y, max.y][k >> 1 & 1], [min.z, max.z][k >> 2 & 1]);
        }
        across_corners(&corners, axis, back, slack)
    }

    fn is_its_box(&self) -> bool {
        true
    }

    fn faces(&self) -> Range<usize> {
        0..6
    }

    fn face(&self, number: usize) -> Face {
        let &Self { min, max } = self;
        let axis = number % 3;
        let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
        let start = if number < 3 { min } else { min + (max - min) * DVec3::AXES[axis] };
        let (u, v) = (u * (max - min), v * (max - min));
        let (normal, height) = (DVec3::AXES[axis], if number < 3 { min[axis] } else { max[axis] });
        Face { corners: [start, start + u, start + u + v, start + v], normal, height }
    }

    fn nearest(&self) -> f64 {
        let inside = DVec3::ZERO.clamp(self.min, self.max) == DVec3::ZERO;
        if inside { (-self.min).min(self.max).min_element() } else { nearest_within(self.bounds()) }
    }

    /// Returns the smallest distance over all edges, though not every edge is an edge of the shadow.
    fn shadow_nearest(&self, x: DVec3, y: DVec3) -> f64 {
        let faces = (0..6).map(|number| self.face(number).corners);
        let edges = faces.flat_map(|corners| (0..4).map(move |k| [corners[k], corners[(k + 1) % 4]]));
        edges.map(|edge| edge_nearest(edge, x, y)).fold(f64::INFINITY, f64::min)
    }

    fn is_fine(&self, sight: &Sight) -> bool {
        sight.is_fine_if_flat(self.magnitude())
    }
}

/// A box as the kernels use it.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Cuboid<E> {
    pub(in crate::fast) min: [E; 3],
    pub(in crate::fast) max: [E; 3],
    pub(in crate::fast) order: E,
    /// The axis to which the box is perpendicular, if it is a rectangle.
    flat: Option<u8>,
}

impl<E: Real> Cuboid<E> {
    pub(in crate::fast) fn new(&RenderSpaceCuboid { min, max }: &RenderSpaceCuboid, order: u32) -> Self {
        let (min, max) = (min.to_array().map(E::narrow), max.to_array().map(E::narrow));
        let mut axes = (0..3u8).filter(|&axis| min[usize::from(axis)] == max[usize::from(axis)]);
        let flat = axes.next().filter(|_| axes.next().is_none());
        Self { min, max, order: E::narrow(f64::from(order)), flat }
    }

    /// Returns the distances at which the ray enters each slab of the box, and the one at which it leaves the box (Kay
    /// and Kajiya). The planes belong to their slab.
    #[inline(always)]
    fn slabs<S: Simd>(&self, simd: S, ray: Ray<S, E>, slopes: Slopes<S, E>) -> (Vec3<S, E>, Lanes<S, E>) {
        let a = Vec3::splat(simd, self.min).sub(ray.origin).mul(slopes.inverse);
        let b = Vec3::splat(simd, self.max).sub(ray.origin).mul(slopes.inverse);
        let mut near = Vec3::<S, E>::new(a.x.min(b.x), a.y.min(b.y), a.z.min(b.z));
        let mut far = Vec3::<S, E>::new(a.x.max(b.x), a.y.max(b.y), a.z.max(b.z));
        if slopes.flat {
            let Ray { origin: o, direction: d } = ray;
            (near.x, far.x) = along::<S, E>(simd, d.x, o.x, (self.min[0], self.max[0]), (near.x, far.x));
            (near.y, far.y) = along::<S, E>(simd, d.y, o.y, (self.min[1], self.max[1]), (near.y, far.y));
            (near.z, far.z) = along::<S, E>(simd, d.z, o.z, (self.min[2], self.max[2]), (near.z, far.z));
        }
        (near, far.x.min(far.y).min(far.z))
    }

    /// Returns the points that the box occludes from the sun.
    #[inline(always)]
    fn occludes<S: Simd>(&self, simd: S, sun: &Sun<E>, point: Vec3<S, E>) -> Mask<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let mut span = (constant::<S, E>(simd, -E::FAR), constant::<S, E>(simd, E::FAR));
        let mut within = zero.simd_eq(zero);
        self.narrow_to_slab(simd, 0, sun, point.x, &mut span, &mut within);
        self.narrow_to_slab(simd, 1, sun, point.y, &mut span, &mut within);
        self.narrow_to_slab(simd, 2, sun, point.z, &mut span, &mut within);
        let (enter, leave) = span;
        let late = constant::<S, E>(simd, 1.0 + LATE * E::ROUNDOFF);
        within & enter.simd_le(leave * late) & leave.simd_gt(zero)
    }

    /// Intersects the interval with the slab of one axis, for [`Cuboid::occludes`]. There is no loop over the axes,
    /// because a vector of lanes has no index.
    #[inline(always)]
    fn narrow_to_slab<S: Simd>(
        &self,
        simd: S,
        axis: usize,
        sun: &Sun<E>,
        origin: Lanes<S, E>,
        (enter, leave): &mut (Lanes<S, E>, Lanes<S, E>),
        within: &mut Mask<S, E>,
    ) {
        let (min, max) = (splat::<S, E>(simd, self.min[axis]), splat::<S, E>(simd, self.max[axis]));
        match sun.inverse[axis] {
            None => *within &= origin.simd_ge(min) & origin.simd_le(max),
            Some(inverse) => {
                let inverse = splat::<S, E>(simd, inverse);
                let (a, b) = ((min - origin) * inverse, (max - origin) * inverse);
                *enter = enter.max(a.min(b));
                *leave = leave.min(a.max(b));
            }
        }
    }
}

/// Returns the interval of a slab. A ray parallel to the slab is in it for all distances, or for none; for any other
/// ray the interval is unchanged.
#[inline(always)]
fn along<S: Simd, E: Real>(
    simd: S,
    direction: Lanes<S, E>,
    origin: Lanes<S, E>,
    (min, max): (E, E),
    (near, far): (Lanes<S, E>, Lanes<S, E>),
) -> (Lanes<S, E>, Lanes<S, E>) {
    let end = constant::<S, E>(simd, E::FAR);
    let start = constant::<S, E>(simd, -E::FAR);
    let within = origin.simd_ge(splat::<S, E>(simd, min)) & origin.simd_le(splat::<S, E>(simd, max));
    let flat = direction.simd_eq(constant::<S, E>(simd, 0.0));
    (flat.select(within.select(start, end), near), flat.select(within.select(end, start), far))
}

impl<E: Real> Precalculations<E> for Cuboid<E> {
    type RayPrecalculations<S: Simd> = Slopes<S, E>;

    #[inline(always)]
    fn aim<S: Simd>(simd: S, ray: Ray<S, E>) -> Slopes<S, E> {
        Slopes::new(simd, ray.direction)
    }
}

impl<E: Real> Tests<Cuboid<E>, E> for Robust {
    #[inline(always)]
    fn intersect<S: Simd, const EYE: bool>(
        simd: S,
        cuboid: &Cuboid<E>,
        _: Place,
        ray: Ray<S, E>,
        slopes: Slopes<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let zero = constant::<S, E>(simd, 0.0);
        let (near, leave) = cuboid.slabs(simd, ray, slopes);
        let enter = near.x.max(near.y).max(near.z);
        let hit = enter.simd_le(leave * constant::<S, E>(simd, 1.0 + LATE * E::ROUNDOFF));
        if hit.any_true() {
            let distance = enter.simd_gt(zero).select(enter, leave);
            nearest.offer(simd, hit & distance.simd_gt(zero), distance, cuboid.order);
        }
    }

    /// Returns the surface with the point moved onto the face. Where faces share an edge, the face of the first axis
    /// wins. A rectangle always has the normal of its plane, because its sides have no area.
    #[inline(always)]
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        cuboid: &Cuboid<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        let slopes = Slopes::new(simd, ray.direction);
        let zero = constant::<S, E>(simd, 0.0);
        let (min, max) = (Vec3::splat(simd, cuboid.min), Vec3::splat(simd, cuboid.max));
        let (near, leave) = cuboid.slabs(simd, ray, slopes);
        let enter = near.x.max(near.y).max(near.z);
        let entering = enter.simd_gt(zero);
        let d = ray.direction;
        let out = min.sub(ray.origin).mul(slopes.inverse);
        let other = max.sub(ray.origin).mul(slopes.inverse);
        let out_x = d.x.simd_ne(zero) & out.x.max(other.x).simd_eq(leave);
        let out_y = d.y.simd_ne(zero) & out.y.max(other.y).simd_eq(leave);
        let is_x = (entering & near.x.simd_eq(enter)) | (!entering & out_x);
        let is_y = !is_x & ((entering & near.y.simd_eq(enter)) | (!entering & out_y));
        let (is_x, is_y) = match cuboid.flat {
            None => (is_x, is_y),
            Some(0) => (is_x | d.x.simd_ne(zero), is_y & d.x.simd_eq(zero)),
            Some(1) => (is_x & d.y.simd_eq(zero), is_y | d.y.simd_ne(zero)),
            Some(_) => (is_x & d.z.simd_eq(zero), is_y & d.z.simd_eq(zero)),
        };
        let is_z = !is_x & !is_y;
        let point = d.scale_add(distance, ray.origin);
        let point = Vec3::<S, E>::new(
            point.x.max(min.x).min(max.x),
            point.y.max(min.y).min(max.y),
            point.z.max(min.z).min(max.z),
        );
        let (x, nx) = face::<S, E>(simd, is_x, d.x.simd_gt(zero), entering, (min.x, max.x), point.x);
        let (y, ny) = face::<S, E>(simd, is_y, d.y.simd_gt(zero), entering, (min.y, max.y), point.y);
        let (z, nz) = face::<S, E>(simd, is_z, d.z.simd_gt(zero), entering, (min.z, max.z), point.z);
        let (point, normal) = (Vec3::<S, E>::new(x, y, z), Vec3::<S, E>::new(nx, ny, nz));
        let offset = offset(simd, point, OFFSET);
        Surface { start: normal.scale_add(offset, point), normal, offset, within: !entering }
    }
}

/// Returns a coordinate of the hit, moved onto the face if the ray hits that face, and the coordinate of the normal.
#[inline(always)]
fn face<S: Simd, E: Real>(
    simd: S,
    here: Mask<S, E>,
    forwards: Mask<S, E>,
    entering: Mask<S, E>,
    (low, high): (Lanes<S, E>, Lanes<S, E>),
    coordinate: Lanes<S, E>,
) -> (Lanes<S, E>, Lanes<S, E>) {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let on_low = !(forwards ^ entering);
    (
        here.select(on_low.select(low, high), coordinate),
        here.select(forwards.select(constant::<S, E>(simd, -1.0), one), zero),
    )
}

impl<E: Real> Obstructs<E> for Cuboid<E> {
    type Obstacle = Self;
    type SunPrecalculations<S: Simd> = ();

    #[inline(always)]
    fn face<S: Simd>(_: S, _: &Sun<E>, _: Vec3<S, E>) {}

    #[inline(always)]
    fn unoccluded<S: Simd>(
        simd: S,
        (cuboids, _): Obstacles<Self>,
        items: impl Items,
        sun: &Sun<E>,
        (point, ()): (Vec3<S, E>, ()),
        mut lit: Mask<S, E>,
    ) -> Mask<S, E> {
        for (_, cuboid) in items.of(cuboids) {
            lit &= !cuboid.occludes(simd, sun, point);
        }
        lit
    }
}
