//! Packets of rays against one object.
//!
//! Each kind has a test for rays from anywhere, one for rays from the eye, which is the origin of the coordinates, and
//! one that only asks whether the object stands between a point and a light. All take what is on an edge or within the
//! rounding error of it for a hit, as closed sets do.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::doubt::{Beside, Place, distance_error, settle, settle_shadows};
use super::prepare::{Cuboid, Edge, GRAZING, Light, Prepared, Shade, Sphere, Triangle};
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};

/// A packet of rays with what the tests share.
#[derive(Clone, Copy)]
pub(super) struct Ray<S: Simd, E: Real> {
    pub(super) origin: Vec3<S, E>,
    pub(super) direction: Vec3<S, E>,
}

/// The slab test's part of a ray.
#[derive(Clone, Copy)]
pub(super) struct Slopes<S: Simd, E: Real> {
    /// 1 / direction, and a far number instead of infinity.
    pub(super) inverse: Vec3<S, E>,
    /// Whether a lane runs along an axis plane.
    pub(super) flat: bool,
}

/// The triangle test's part of a ray.
#[derive(Clone, Copy)]
pub(super) struct Moment<S: Simd, E: Real> {
    /// origin x direction
    pub(super) moment: Vec3<S, E>,
    /// |origin|₁
    pub(super) reach: Lanes<S, E>,
}

/// The nearest hits so far.
#[derive(Clone, Copy)]
pub(super) struct Nearest<S: Simd, E: Real> {
    pub(super) distance: Lanes<S, E>,
    /// Positions in the script.
    pub(super) order: Lanes<S, E>,
}

impl<S: Simd, E: Real> Nearest<S, E> {
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        Self { distance: constant::<S, E>(simd, E::FAR), order: constant::<S, E>(simd, E::FAR) }
    }

    #[inline(always)]
    pub(super) fn hit(&self, simd: S) -> Mask<S, E> {
        self.distance.simd_lt(constant::<S, E>(simd, E::FAR))
    }

    #[inline(always)]
    pub(super) fn offer(&mut self, simd: S, hit: Mask<S, E>, distance: Lanes<S, E>, order: E) {
        let order = splat::<S, E>(simd, order);
        let first = distance.simd_eq(self.distance) & order.simd_lt(self.order);
        let take = hit & (distance.simd_lt(self.distance) | first);
        self.distance = take.select(distance, self.distance);
        self.order = take.select(order, self.order);
    }
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

impl<S: Simd, E: Real> Moment<S, E> {
    #[inline(always)]
    pub(super) fn new(ray: Ray<S, E>) -> Self {
        let Ray { origin, direction } = ray;
        Self { moment: origin.cross(direction), reach: origin.x.abs() + origin.y.abs() + origin.z.abs() }
    }
}

/// The formulas of each kind: where rays meet it first, and its surface there.
///
/// These are robust; whoever has others to compare with puts them in their place.
pub(super) trait Formulas {
    /// Haines, Günther, Akenine-Möller, "Precision improvements for ray/sphere intersection", Ray Tracing Gems ch. 7.
    ///
    /// The subtraction that is left costs no more than the origin's own rounding.
    #[inline(always)]
    fn sphere<S: Simd, E: Real>(simd: S, sphere: &Sphere<E>, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let to_center = Vec3::splat(simd, sphere.center).sub(ray.origin);
        let middle = to_center.dot(ray.direction);
        let closest = ray.direction.scale_sub(middle, to_center);
        let rest = splat::<S, E>(simd, sphere.square) - closest.dot(closest);
        let meets = rest.simd_ge(zero);
        if meets.any_true() {
            let half_chord = rest.sqrt();
            let near = middle - half_chord;
            let distance = near.simd_gt(zero).select(near, middle + half_chord);
            nearest.offer(simd, meets & distance.simd_gt(zero), distance, sphere.order);
        }
    }

    /// As [`Formulas::sphere`], with the second root from the eye's power, so that a sphere next to the eye is as exact as one far
    /// away.
    #[inline(always)]
    fn sphere_from_eye<S: Simd, E: Real>(
        simd: S,
        sphere: &Sphere<E>,
        direction: Vec3<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let zero = constant::<S, E>(simd, 0.0);
        let center = Vec3::splat(simd, sphere.center);
        let middle = center.dot(direction);
        let ahead = middle.simd_gt(zero);
        let power = splat::<S, E>(simd, sphere.power);
        if sphere.power > E::narrow(0.0) {
            let closest = direction.scale_sub(middle, center);
            let rest = splat::<S, E>(simd, sphere.square) - closest.dot(closest);
            let hit = rest.simd_ge(zero) & ahead;
            if hit.any_true() {
                nearest.offer(simd, hit, power / (middle + rest.sqrt()), sphere.order);
            }
        } else {
            // A sum without cancellation: every ray from within meets the sphere, grazing ones from its surface too.
            let half_chord = middle.mul_add(middle, -power).sqrt();
            let far = ahead.select(middle + half_chord, middle - half_chord);
            let distance = ahead.select(far, power / far);
            nearest.offer(simd, distance.simd_gt(zero), distance, sphere.order);
        }
    }

    #[inline(always)]
    fn cuboid<S: Simd, E: Real>(
        simd: S,
        cuboid: &Cuboid<E>,
        ray: Ray<S, E>,
        slopes: Slopes<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let zero = constant::<S, E>(simd, 0.0);
        let (near, leave) = slabs(simd, cuboid, ray, slopes);
        let enter = near.x.max(near.y).max(near.z);
        let hit = enter.simd_le(leave * constant::<S, E>(simd, 1.0 + LATE * E::ROUNDOFF));
        if hit.any_true() {
            let distance = enter.simd_gt(zero).select(enter, leave);
            nearest.offer(simd, hit & distance.simd_gt(zero), distance, cuboid.order);
        }
    }

    /// By the sides of its edges in Plücker coordinates, each with a bound on its error; what that leaves open is
    /// [settled](settle). The distance is that of the plane, by the operations of a box's slab, so that one in the plane
    /// of a face is met where the face is. A ray within the rounding error of the plane misses.
    #[inline(always)]
    fn triangle<S: Simd, E: Real>(
        simd: S,
        triangle: &Triangle<E>,
        place: Place,
        ray: Ray<S, E>,
        moment: Moment<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let zero = constant::<S, E>(simd, 0.0);
        let (a_left, a_right) = side(simd, &triangle.edges[0], ray, moment);
        let (b_left, b_right) = side(simd, &triangle.edges[1], ray, moment);
        let (c_left, c_right) = side(simd, &triangle.edges[2], ray, moment);
        let left = a_left.min(b_left).min(c_left).simd_ge(zero);
        let right = a_right.max(b_right).max(c_right).simd_le(zero);
        let inside = left | right;
        if inside.any_true() {
            let normal = Vec3::splat(simd, triangle.normal);
            let slope = normal.dot(ray.direction);
            let above = splat::<S, E>(simd, triangle.height) - normal.dot(ray.origin);
            let distance = above * (constant::<S, E>(simd, 1.0) / slope);
            let away = distance.simd_gt(constant::<S, E>(simd, distance_error::<E>()));
            let clear = away
                & (a_right.min(b_right).min(c_right).simd_gt(zero)
                    | a_left.max(b_left).max(c_left).simd_lt(zero));
            let hit = inside & distance.simd_gt(zero);
            let ray = (ray.origin, ray.direction, Beside::Anywhere);
            offer_settled(simd, (triangle, place), ray, (hit, clear), (slope, distance), nearest);
        }
    }

    #[inline(always)]
    fn triangle_from_eye<S: Simd, E: Real>(
        simd: S,
        triangle: &Triangle<E>,
        place: Place,
        direction: Vec3<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let [a, b, c] = triangle.from_eye;
        let (a, b) = (affine(simd, a, direction), affine(simd, b, direction));
        let least = a.min(b).min(affine(simd, c, direction));
        let inside = least.simd_ge(constant::<S, E>(simd, 0.0));
        if inside.any_true() {
            let slope = Vec3::splat(simd, triangle.normal).dot(direction);
            let distance = splat::<S, E>(simd, triangle.height) * (constant::<S, E>(simd, 1.0) / slope);
            // What is clear of the edges lies ahead: the sides are turned that way.
            let clear = least.simd_gt(constant::<S, E>(simd, 1.0));
            let ray = (Vec3::zero(simd), direction, Beside::Eye);
            offer_settled(simd, (triangle, place), ray, (inside, clear), (slope, distance), nearest);
        }
    }

    #[inline(always)]
    fn sphere_surface<S: Simd, E: Real, const EYE: bool>(
        simd: S,
        sphere: &Sphere<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        let center = Vec3::splat(simd, sphere.center);
        let to_center = if EYE { center } else { center.sub(ray.origin) };
        let outward = ray.direction.scale_sub(distance, to_center).normalize(simd);
        let outside =
            Surface { start: outward.scale_add(splat::<S, E>(simd, sphere.outer), center), normal: outward };
        if EYE && sphere.power > E::narrow(0.0) {
            return outside;
        }
        let inside = if EYE {
            let zero = constant::<S, E>(simd, 0.0);
            zero.simd_eq(zero)
        } else {
            // What starts on the surface and meets the sphere goes through it.
            to_center.dot(to_center).simd_le(splat::<S, E>(simd, sphere.square))
        };
        if !EYE && !inside.any_true() {
            return outside;
        }
        let away = inside.select(splat::<S, E>(simd, sphere.inner), splat::<S, E>(simd, sphere.outer));
        let side = inside.select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0));
        Surface { start: outward.scale_add(away, center), normal: outward.scale(side) }
    }

    #[inline(always)]
    fn triangle_surface<S: Simd, E: Real>(
        simd: S,
        triangle: &Triangle<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
        roundoffs: f64,
    ) -> Surface<S, E> {
        let normal = Vec3::splat(simd, triangle.normal);
        let zero = constant::<S, E>(simd, 0.0);
        let point = ray.direction.scale_add(distance, ray.origin);
        let height = splat::<S, E>(simd, triangle.height);
        let above = normal.dot(point) - height;
        let side = normal
            .dot(ray.direction)
            .simd_gt(zero)
            .select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0));
        let offset =
            offset(simd, point, roundoffs) + height.abs() * constant::<S, E>(simd, roundoffs * E::ROUNDOFF);
        Surface { start: normal.scale_add(side * offset - above, point), normal: normal.scale(side) }
    }

    #[inline(always)]
    fn cuboid_surface<S: Simd, E: Real>(
        simd: S,
        cuboid: &Cuboid<E>,
        ray: Ray<S, E>,
        slopes: Slopes<S, E>,
        distance: Lanes<S, E>,
        roundoffs: f64,
    ) -> Surface<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let (min, max) = (Vec3::splat(simd, cuboid.min), Vec3::splat(simd, cuboid.max));
        let (near, leave) = slabs(simd, cuboid, ray, slopes);
        let enter = near.x.max(near.y).max(near.z);
        let entering = enter.simd_gt(zero);
        let d = ray.direction;
        let out = min.sub(ray.origin).mul(slopes.inverse);
        let other = max.sub(ray.origin).mul(slopes.inverse);
        let out_x = d.x.simd_ne(zero) & out.x.max(other.x).simd_eq(leave);
        let out_y = d.y.simd_ne(zero) & out.y.max(other.y).simd_eq(leave);
        let is_x = (entering & near.x.simd_eq(enter)) | (!entering & out_x);
        let is_y = !is_x & ((entering & near.y.simd_eq(enter)) | (!entering & out_y));
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
        Surface { start: normal.scale_add(offset(simd, point, roundoffs), point), normal }
    }
}

/// Where the ray enters each slab of a box and where it leaves the box (Kay and Kajiya); planes belong to their slab.
#[inline(always)]
fn slabs<S: Simd, E: Real>(
    simd: S,
    cuboid: &Cuboid<E>,
    ray: Ray<S, E>,
    slopes: Slopes<S, E>,
) -> (Vec3<S, E>, Lanes<S, E>) {
    let a = Vec3::splat(simd, cuboid.min).sub(ray.origin).mul(slopes.inverse);
    let b = Vec3::splat(simd, cuboid.max).sub(ray.origin).mul(slopes.inverse);
    let mut near = Vec3::<S, E>::new(a.x.min(b.x), a.y.min(b.y), a.z.min(b.z));
    let mut far = Vec3::<S, E>::new(a.x.max(b.x), a.y.max(b.y), a.z.max(b.z));
    if slopes.flat {
        let Ray { origin: o, direction: d } = ray;
        (near.x, far.x) = along::<S, E>(simd, d.x, o.x, cuboid.min[0], cuboid.max[0], (near.x, far.x));
        (near.y, far.y) = along::<S, E>(simd, d.y, o.y, cuboid.min[1], cuboid.max[1], (near.y, far.y));
        (near.z, far.z) = along::<S, E>(simd, d.z, o.z, cuboid.min[2], cuboid.max[2], (near.z, far.z));
    }
    (near, far.x.min(far.y).min(far.z))
}

/// A slab that the ray runs along is one that it is in for ever, or never; any other stays as it is.
#[inline(always)]
fn along<S: Simd, E: Real>(
    simd: S,
    direction: Lanes<S, E>,
    origin: Lanes<S, E>,
    min: E,
    max: E,
    (near, far): (Lanes<S, E>, Lanes<S, E>),
) -> (Lanes<S, E>, Lanes<S, E>) {
    let end = constant::<S, E>(simd, E::FAR);
    let start = constant::<S, E>(simd, -E::FAR);
    let within = origin.simd_ge(splat::<S, E>(simd, min)) & origin.simd_le(splat::<S, E>(simd, max));
    let flat = direction.simd_eq(constant::<S, E>(simd, 0.0));
    (flat.select(within.select(start, end), near), flat.select(within.select(end, start), far))
}

/// Entering may come this much later than leaving: the rounding errors of both (Ize, "Robust BVH ray traversal", JCGT
/// 2(2), 2013).
const LATE: f64 = 8.0;

/// Offers a `hit`, where it is not `clear` of the edges or nearly in the plane what comes of it when settled. A ray
/// within the rounding error of the plane misses.
#[inline(always)]
fn offer_settled<S: Simd, E: Real>(
    simd: S,
    (triangle, place): (&Triangle<E>, Place),
    (origin, direction, beside): (Vec3<S, E>, Vec3<S, E>, Beside),
    (hit, clear): (Mask<S, E>, Mask<S, E>),
    (slope, distance): (Lanes<S, E>, Lanes<S, E>),
    nearest: &mut Nearest<S, E>,
) {
    let sure = clear & slope.abs().simd_ge(constant::<S, E>(simd, beside.flat()));
    let doubtful = hit & !sure;
    if !doubtful.any_true() {
        return nearest.offer(simd, hit, distance, triangle.order);
    }
    let steep = slope.abs().simd_gt(constant::<S, E>(simd, GRAZING * E::ROUNDOFF));
    // Put together here, so that only rays in doubt go through memory.
    let ray = Ray { origin, direction };
    let (met, settled) = settle(simd, place, ray, beside, (doubtful & steep, clear), distance);
    let distance = doubtful.select(settled, distance);
    let met = sure | (met & steep & distance.simd_gt(constant::<S, E>(simd, 0.0)));
    nearest.offer(simd, hit & met, distance, triangle.order);
}

/// The least and the most that the ray's side of an edge can be.
#[inline(always)]
fn side<S: Simd, E: Real>(
    simd: S,
    edge: &Edge<E>,
    ray: Ray<S, E>,
    moment: Moment<S, E>,
) -> (Lanes<S, E>, Lanes<S, E>) {
    let side = Vec3::splat(simd, edge.moment).dot(ray.direction);
    let side = Vec3::splat(simd, edge.direction).dot_add(moment.moment, side);
    let slack = moment.reach.mul_add(splat::<S, E>(simd, edge.slack.1), splat::<S, E>(simd, edge.slack.0));
    (side + slack, side - slack)
}

/// `slope · point + start`
#[inline(always)]
fn affine<S: Simd, E: Real>(simd: S, (slope, start): ([E; 3], E), point: Vec3<S, E>) -> Lanes<S, E> {
    Vec3::splat(simd, slope).dot_add(point, splat::<S, E>(simd, start))
}

/// A point in a light's own axes.
#[inline(always)]
pub(super) fn facing<S: Simd, E: Real>(simd: S, light: &Light<E>, point: Vec3<S, E>) -> Vec3<S, E> {
    let [x, y, z] = light.axes;
    Vec3::<S, E>::new(
        Vec3::splat(simd, x).dot(point),
        Vec3::splat(simd, y).dot(point),
        Vec3::splat(simd, z).dot(point),
    )
}

/// Whether a sphere keeps the light from points, which are in the light's axes.
///
/// With the sphere's circle on the light's screen, `rest` is the square of half the chord; the far end of it is
/// ahead when `z + √rest > 0`, which for `rest >= 0` is `z·|z| > -rest`.
#[inline(always)]
pub(super) fn sphere_shades<S: Simd, E: Real>(simd: S, sphere: &[E; 4], point: Vec3<S, E>) -> Mask<S, E> {
    let [x, y, z, square] = *sphere;
    let Vec3 { x, y, z } = Vec3::splat(simd, [x, y, z]).sub(point);
    let rest = splat::<S, E>(simd, square) - x.mul_add(x, y * y);
    let ahead = z.mul_add(z.abs(), rest);
    let zero = constant::<S, E>(simd, 0.0);
    rest.simd_ge(zero) & ahead.simd_gt(zero)
}

/// Whether a triangle keeps the light from points: not below 0, certainly from 1.
#[inline(always)]
pub(super) fn triangle_shades<S: Simd, E: Real>(simd: S, shade: &Shade<E>, point: Vec3<S, E>) -> Lanes<S, E> {
    let [a, b, c] = shade.sides;
    let (a, b, c) = (affine(simd, a, point), affine(simd, b, point), affine(simd, c, point));
    a.min(b).min(c).min(affine(simd, shade.depth, point))
}

/// The points that stay lit, by the largest of [`triangle_shades`] over the triangles at these positions.
#[inline(always)]
pub(super) fn unshaded_by_triangles<S: Simd, E: Real>(
    simd: S,
    scene: &Prepared<E>,
    light: &Light<E>,
    (point, lit): (Vec3<S, E>, Mask<S, E>),
    shaded: Lanes<S, E>,
    triangles: impl Iterator<Item = usize>,
) -> Mask<S, E> {
    let over = shaded.simd_ge(constant::<S, E>(simd, 0.0));
    if !over.any_true() {
        return lit;
    }
    let lit = lit & shaded.simd_lt(constant::<S, E>(simd, 1.0));
    let doubtful = lit & over;
    if doubtful.any_true() {
        lit & !settle_shadows(simd, &scene.corners, light, point, doubtful, triangles)
    } else {
        lit
    }
}

#[inline(always)]
pub(super) fn cuboid_shades<S: Simd, E: Real>(
    simd: S,
    cuboid: &Cuboid<E>,
    light: &Light<E>,
    point: Vec3<S, E>,
) -> Mask<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    let mut enter = constant::<S, E>(simd, -E::FAR);
    let mut leave = constant::<S, E>(simd, E::FAR);
    let mut within = zero.simd_eq(zero);
    shade_slab::<S, E>(simd, 0, cuboid, light, point.x, &mut enter, &mut leave, &mut within);
    shade_slab::<S, E>(simd, 1, cuboid, light, point.y, &mut enter, &mut leave, &mut within);
    shade_slab::<S, E>(simd, 2, cuboid, light, point.z, &mut enter, &mut leave, &mut within);
    let late = constant::<S, E>(simd, 1.0 + LATE * E::ROUNDOFF);
    within & enter.simd_le(leave * late) & leave.simd_gt(zero)
}

#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "an axis of the loop above, unrolled because the lanes have no index"
)]
fn shade_slab<S: Simd, E: Real>(
    simd: S,
    axis: usize,
    cuboid: &Cuboid<E>,
    light: &Light<E>,
    origin: Lanes<S, E>,
    enter: &mut Lanes<S, E>,
    leave: &mut Lanes<S, E>,
    within: &mut Mask<S, E>,
) {
    let (min, max) = (splat::<S, E>(simd, cuboid.min[axis]), splat::<S, E>(simd, cuboid.max[axis]));
    match light.inverse[axis] {
        None => *within &= origin.simd_ge(min) & origin.simd_le(max),
        Some(inverse) => {
            let inverse = splat::<S, E>(simd, inverse);
            let (a, b) = ((min - origin) * inverse, (max - origin) * inverse);
            *enter = enter.max(a.min(b));
            *leave = leave.min(a.max(b));
        }
    }
}

/// Where a ray goes on from: the point, off its surface on the side that the ray came from, and the unit normal on
/// that side.
#[derive(Clone, Copy)]
pub(super) struct Surface<S: Simd, E: Real> {
    pub(super) start: Vec3<S, E>,
    pub(super) normal: Vec3<S, E>,
}

#[inline(always)]
fn offset<S: Simd, E: Real>(simd: S, point: Vec3<S, E>, offset: f64) -> Lanes<S, E> {
    (point.x.abs() + point.y.abs() + point.z.abs()) * constant::<S, E>(simd, offset * E::ROUNDOFF)
}

/// A coordinate, brought onto the face where the ray meets it there, and the normal's.
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
