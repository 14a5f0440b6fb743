//! Textbook formulas, to measure the cost of robustness.
//!
//! Tiles, candidates, constants and shadows are those of the robust kernels. Three things differ: the formula of a
//! root, no error bound widens an edge or a slab, and new rays start a fixed distance off their surface.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::arithmetic::real::{Fused, Lanes, Real, Vec3, constant, splat};
use crate::fast::rays::packet::{Nearest, Ray, Slopes, Surface, no_lane};
use crate::fast::rays::predicate::Place;
use crate::fast::shapes::cuboid::Cuboid;
use crate::fast::shapes::shape::{Robust, Tests};
use crate::fast::shapes::sphere::Sphere;
use crate::fast::shapes::triangle::{Edge, Moment, Triangle};

/// The offset of a new ray from its surface. A scene has a size of 1.
const EPSILON: f64 = 1e-4;

/// The textbook intersection tests.
pub(crate) struct Naive;

impl<E: Real> Tests<Sphere<E>, E> for Naive {
    #[inline(always)]
    fn intersect<S: Simd, const EYE: bool>(
        simd: S,
        sphere: &Sphere<E>,
        _: Place,
        ray: Ray<S, E>,
        (): (),
        nearest: &mut Nearest<S, E>,
    ) {
        if EYE {
            let middle = Vec3::splat(simd, sphere.center).dot(ray.direction);
            let rest = middle.fused_mul_sub(middle, splat::<S, E>(simd, sphere.power));
            return roots(simd, middle, rest, sphere.order, nearest);
        }
        let from_center = ray.origin.sub(Vec3::splat(simd, sphere.center));
        let half = from_center.dot(ray.direction);
        let rest =
            half.fused_mul_sub(half, from_center.dot(from_center) - splat::<S, E>(simd, sphere.square));
        let middle = constant::<S, E>(simd, 0.0) - half;
        roots(simd, middle, rest, sphere.order, nearest);
    }

    #[inline(always)]
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        sphere: &Sphere<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        let point = ray.direction.scale_add(distance, ray.origin);
        let inverse = constant::<S, E>(simd, 1.0) / splat::<S, E>(simd, sphere.outer);
        let outward = point.sub(Vec3::splat(simd, sphere.center)).scale(inverse);
        let is_facing = EYE && sphere.is_outside_the_eye();
        let surface = off(simd, point, if is_facing { outward } else { facing(simd, outward, ray) });
        let inwards = surface.normal.dot(outward).simd_lt(constant::<S, E>(simd, 0.0));
        Surface { within: inwards, ..surface }
    }
}

impl<E: Real> Tests<Cuboid<E>, E> for Naive {
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
        let a = Vec3::splat(simd, cuboid.min).sub(ray.origin).mul(slopes.inverse);
        let b = Vec3::splat(simd, cuboid.max).sub(ray.origin).mul(slopes.inverse);
        let enter = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z));
        let leave = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z));
        let hit = enter.simd_le(leave);
        if hit.any_true() {
            let distance = enter.simd_gt(zero).select(enter, leave);
            nearest.offer(simd, hit & distance.simd_gt(zero), distance, cuboid.order);
        }
    }

    /// Returns the robust surface, because the textbook formula for a face is the same.
    #[inline(always)]
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        cuboid: &Cuboid<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        Robust::surface::<S, EYE>(simd, cuboid, ray, distance)
    }
}

impl<E: Real> Tests<Triangle<E>, E> for Naive {
    #[inline(always)]
    fn intersect<S: Simd, const EYE: bool>(
        simd: S,
        triangle: &Triangle<E>,
        place: Place,
        ray: Ray<S, E>,
        moment: Moment<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        if EYE {
            return Robust::intersect::<S, EYE>(simd, triangle, place, ray, moment, nearest);
        }
        let zero = constant::<S, E>(simd, 0.0);
        let [a, b, c] = &triangle.facet.edges;
        let (a, b, c) = (side(simd, a, ray, moment), side(simd, b, ray, moment), side(simd, c, ray, moment));
        let inside = a.min(b).min(c).simd_ge(zero) | a.max(b).max(c).simd_le(zero);
        if inside.any_true() {
            let normal = Vec3::splat(simd, triangle.facet.normal);
            let above = splat::<S, E>(simd, triangle.facet.height) - normal.dot(ray.origin);
            let distance = above / normal.dot(ray.direction);
            nearest.offer(simd, inside & distance.simd_gt(zero), distance, triangle.facet.order);
        }
    }

    #[inline(always)]
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        triangle: &Triangle<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        let point = ray.direction.scale_add(distance, ray.origin);
        off(simd, point, facing(simd, Vec3::splat(simd, triangle.facet.normal), ray))
    }
}

#[inline(always)]
fn roots<S: Simd, E: Real>(
    simd: S,
    middle: Lanes<S, E>,
    rest: Lanes<S, E>,
    order: E,
    nearest: &mut Nearest<S, E>,
) {
    let zero = constant::<S, E>(simd, 0.0);
    let meets = rest.simd_ge(zero);
    if meets.any_true() {
        let root = rest.sqrt();
        let near = middle - root;
        let distance = near.simd_gt(zero).select(near, middle + root);
        nearest.offer(simd, meets & distance.simd_gt(zero), distance, order);
    }
}

#[inline(always)]
fn side<S: Simd, E: Real>(simd: S, edge: &Edge<E>, ray: Ray<S, E>, moment: Moment<S, E>) -> Lanes<S, E> {
    let side = Vec3::splat(simd, edge.moment).dot(ray.direction);
    Vec3::splat(simd, edge.direction).dot_add(moment.moment, side)
}

#[inline(always)]
fn facing<S: Simd, E: Real>(simd: S, normal: Vec3<S, E>, ray: Ray<S, E>) -> Vec3<S, E> {
    let away = normal.dot(ray.direction).simd_gt(constant::<S, E>(simd, 0.0));
    normal.scale(away.select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0)))
}

#[inline(always)]
fn off<S: Simd, E: Real>(simd: S, point: Vec3<S, E>, normal: Vec3<S, E>) -> Surface<S, E> {
    let offset = constant::<S, E>(simd, EPSILON);
    Surface { start: normal.scale_add(offset, point), normal, offset, within: no_lane::<S, E>(simd) }
}
