//! Triangles, intersected by Plücker coordinates.

use std::ops::Range;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};

use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::arithmetic::rounding::{
    CONSTANT, EDGE_ON, GRAZING, OFFSET, SIDE_OF_PIXEL, VOLUME, distance_error, side_of_going_on,
};
use crate::fast::lights::sun::Sun;
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::packet::{Nearest, Ray, Surface, affine, no_lane, offset};
use crate::fast::rays::placed;
use crate::fast::rays::placed::{Face, Sight, across_corners, edge_nearest, nearest_within};
use crate::fast::rays::predicate::{Beside, Corners, Place, settle};
use crate::fast::shapes::shape::{Items, Obstacles, Obstructs, Precalculations, Robust, Tests};
use crate::reference::{normal_and_width, triangle_normal};

/// A triangle in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct RenderSpaceTriangle {
    pub(in crate::fast) vertices: [DVec3; 3],
    pub(in crate::fast) normal: DVec3,
    /// `normal · point` of its points.
    pub(in crate::fast) height: f64,
}

/// The ratio of a triangle's width to its length below which its normal is computed from its rounded corners.
const NEEDLE: f64 = 0.1;

impl RenderSpaceTriangle {
    /// Makes a triangle that is moved so that `center` is the origin, and is then scaled. Returns `None` if it has no
    /// area, or if rounding leaves it none because it is too thin to be visible.
    pub(in crate::fast) fn new(corners: &[DVec3; 3], center: DVec3, scale: f64) -> Option<Self> {
        let place = |vertex: DVec3| (vertex - center) * scale;
        let vertices = [place(corners[0]), place(corners[1]), place(corners[2])];
        // Its own size decides whether it has an area, independent of its position.
        let (own, width) = normal_and_width(corners);
        if own == DVec3::ZERO {
            return None;
        }
        let [a, b, c] = vertices;
        if a == b || b == c || c == a {
            return None;
        }
        // A needle rotates when its corners are rounded. Rays hit the rounded triangle.
        let normal = if width < NEEDLE { triangle_normal(&vertices) } else { own };
        let height = normal.dot(Ends::new(vertices).nearest());
        (normal != DVec3::ZERO).then_some(Self { vertices, normal, height })
    }
}

/// Returns the largest distance along an axis from `center` to a corner.
pub(in crate::fast) fn reach(triangle: &rayfold_scene::Triangle, center: DVec3) -> f64 {
    triangle.vertices().iter().map(|v| (v - center).abs().max_element()).fold(0.0, f64::max)
}

impl placed::RenderSpaceShape for RenderSpaceTriangle {
    fn bounds(&self) -> Bounds {
        let [a, b, c] = self.vertices;
        (a.min(b).min(c), a.max(b).max(c))
    }

    fn support(&self, direction: DVec3) -> f64 {
        self.vertices.iter().map(|v| direction.dot(*v)).fold(f64::NEG_INFINITY, f64::max)
    }

    fn across(&self, axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)> {
        across_corners(&self.vertices, axis, back, slack)
    }

    fn faces(&self) -> Range<usize> {
        0..1
    }

    fn face(&self, _: usize) -> Face {
        let [a, b, c] = self.vertices;
        Face { corners: [a, b, c, c], normal: self.normal, height: self.height }
    }

    fn plane(&self) -> Option<DVec3> {
        Some(self.normal)
    }

    fn nearest(&self) -> f64 {
        nearest_within(self.bounds()).max(self.height.abs())
    }

    fn shadow_nearest(&self, x: DVec3, y: DVec3) -> f64 {
        let [a, b, c] = self.vertices;
        [[a, b], [b, c], [c, a]]
            .map(|edge| edge_nearest(edge, x, y))
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    fn is_fine(&self, sight: &Sight) -> bool {
        sight.is_fine_if_flat(self.magnitude())
    }
}

/// The Plücker coordinates of an edge: its direction and its moment, the cross product of its ends.
///
/// The sign of `d · moment + direction · (o × d)` gives the side of the edge on which the ray from `o` along `d`
/// passes. Its error is below `slack.0 + slack.1 · |o|₁`. Points within the error belong to the triangle unless they
/// are beyond its corners, so meshes have no cracks, neither along edges nor at vertices.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Edge<E> {
    pub(in crate::fast) direction: [E; 3],
    pub(in crate::fast) moment: [E; 3],
    slack: (E, E),
}

impl<E: Real> Edge<E> {
    /// Returns the largest and the smallest value that the ray's side of the edge can have.
    #[inline(always)]
    fn side<S: Simd>(&self, simd: S, ray: Ray<S, E>, moment: Moment<S, E>) -> (Lanes<S, E>, Lanes<S, E>) {
        let side = Vec3::splat(simd, self.moment).dot(ray.direction);
        let side = Vec3::splat(simd, self.direction).dot_add(moment.moment, side);
        let slack =
            moment.reach.fused_mul_add(splat::<S, E>(simd, self.slack.1), splat::<S, E>(simd, self.slack.0));
        (side + slack, side - slack)
    }
}

/// A triangle as the kernels use it.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Triangle<E> {
    pub(in crate::fast) facet: Facet<E>,
    /// The edges for rays from the eye, in units of twice a bound on the error, with signs such that visible points are
    /// not negative. Below 0 is outside; from 0 to 1 is in doubt. The last number is a half, or negative if the eye is
    /// in the plane.
    from_eye: [([E; 3], E); 3],
}

/// A triangle for rays from any origin.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Facet<E> {
    pub(in crate::fast) edges: [Edge<E>; 3],
    pub(in crate::fast) normal: [E; 3],
    /// `normal · point` of its points.
    pub(in crate::fast) height: E,
    pub(in crate::fast) order: E,
}

/// An edge before it is rounded.
struct Line {
    direction: DVec3,
    moment: DVec3,
    /// A bound on the error that rounding in `f64` adds to the moment.
    noise: f64,
}

impl Line {
    /// Returns the edges opposite to the corners.
    #[inline(always)]
    fn all(ends: &Ends) -> [Self; 3] {
        [(1, 2), (2, 0), (0, 1)].map(|(from, to)| {
            let (direction, anchor) = (ends.vertices[to] - ends.vertices[from], ends.nearer(from, to));
            let noise = CONSTANT * l1(anchor) * l1(direction);
            Self { direction, moment: anchor.cross(direction), noise }
        })
    }
}

impl<E: Real> Triangle<E> {
    // Out of line, and below too, so that the code that runs for a million triangles is the same for every caller.
    #[inline(never)]
    pub(in crate::fast) fn new(triangle: &RenderSpaceTriangle, order: u32) -> Self {
        let vertices = triangle.vertices;
        let [a, b, c] = vertices;
        let ends = Ends::new(vertices);
        let [to_a, to_b, to_c] = ends.squares.map(f64::sqrt);
        let volume = a.dot((b - a).cross(c - a));
        let lengths = to_a * to_b.max(to_c) * (b - a).length().max((c - a).length());
        let coordinates = vertices.iter().fold(DVec3::ZERO, |most, v| most.max(v.abs()));
        let noise = VOLUME * lengths.min(6.0 * coordinates.element_product());
        let sign = if volume.abs() > noise { volume.signum() } else { 0.0 };
        let lines = Line::all(&ends);
        let facet = Facet::of(&lines, triangle, order);
        let from_eye = lines.map(|Line { moment, noise, .. }| {
            let scale = 0.5 * sign / (SIDE_OF_PIXEL * E::ROUNDOFF * moment.length() + noise);
            (point(moment * scale), E::narrow(if sign == 0.0 { -1.0 } else { 0.5 }))
        });
        Self { facet, from_eye }
    }

    #[inline(always)]
    fn meet_from_eye<S: Simd>(
        &self,
        simd: S,
        place: Place,
        direction: Vec3<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let [a, b, c] = self.from_eye;
        let (a, b) = (affine(simd, a, direction), affine(simd, b, direction));
        let least = a.min(b).min(affine(simd, c, direction));
        let inside = least.simd_ge(constant::<S, E>(simd, 0.0));
        if inside.any_true() {
            let slope = Vec3::splat(simd, self.facet.normal).dot(direction);
            let distance = splat::<S, E>(simd, self.facet.height) * (constant::<S, E>(simd, 1.0) / slope);
            // A hit that is clear of the edges is ahead, because of the signs of the sides.
            let clear = least.simd_gt(constant::<S, E>(simd, 1.0));
            let ray = (Vec3::zero(simd), direction, Beside::Eye);
            self.facet.offer_settled(simd, place, ray, (inside, clear), (slope, distance), nearest);
        }
    }
}

impl<E: Real> Facet<E> {
    /// Returns a triangle that no ray meets, in place of one without an area.
    pub(in crate::fast) fn nothing(order: u32) -> Self {
        let zero = [E::narrow(0.0); 3];
        let edge = Edge { direction: zero, moment: zero, slack: (E::narrow(-1.0), E::narrow(0.0)) };
        Self { edges: [edge; 3], normal: zero, height: E::narrow(0.0), order: E::narrow(f64::from(order)) }
    }

    #[inline(never)]
    pub(in crate::fast) fn new(triangle: &RenderSpaceTriangle, order: u32) -> Self {
        Self::of(&Line::all(&Ends::new(triangle.vertices)), triangle, order)
    }

    /// Returns whether the triangle replaces one without an area.
    pub(in crate::fast) fn is_nothing(&self) -> bool {
        self.edges[0].slack.0.widen() < 0.0
    }

    #[inline(always)]
    fn of(lines: &[Line; 3], triangle: &RenderSpaceTriangle, order: u32) -> Self {
        // From other origins a cross product adds its errors.
        let slack =
            |size: f64, noise: f64| E::narrow(2.0 * side_of_going_on::<E>() * E::ROUNDOFF * size + noise);
        let edges = lines.each_ref().map(|&Line { direction, moment, noise }| Edge {
            direction: point(direction),
            moment: point(moment),
            slack: (slack(l1(moment), noise), slack(l1(direction), 0.0)),
        });
        Self {
            edges,
            normal: point(triangle.normal),
            height: E::narrow(triangle.height),
            order: E::narrow(f64::from(order)),
        }
    }

    /// Intersects rays from any origin by the sides of the edges in Plücker coordinates, each with a bound on its
    /// error. [`settle`] decides the rays that these bounds leave in doubt. The distance is that of the plane, computed
    /// like that of a box's slab, so that a triangle in the plane of a face is hit at the face's distance. A ray within
    /// the rounding error of the plane misses.
    #[inline(always)]
    pub(in crate::fast) fn meet_from_anywhere<S: Simd>(
        &self,
        simd: S,
        place: Place,
        ray: Ray<S, E>,
        moment: Moment<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let zero = constant::<S, E>(simd, 0.0);
        let (a_left, a_right) = self.edges[0].side(simd, ray, moment);
        let (b_left, b_right) = self.edges[1].side(simd, ray, moment);
        let (c_left, c_right) = self.edges[2].side(simd, ray, moment);
        let left = a_left.min(b_left).min(c_left).simd_ge(zero);
        let right = a_right.max(b_right).max(c_right).simd_le(zero);
        let inside = left | right;
        if inside.any_true() {
            let normal = Vec3::splat(simd, self.normal);
            let slope = normal.dot(ray.direction);
            let above = splat::<S, E>(simd, self.height) - normal.dot(ray.origin);
            let distance = above * (constant::<S, E>(simd, 1.0) / slope);
            let away = distance.simd_gt(constant::<S, E>(simd, distance_error::<E>()));
            let clear = away
                & (a_right.min(b_right).min(c_right).simd_gt(zero)
                    | a_left.max(b_left).max(c_left).simd_lt(zero));
            let hit = inside & distance.simd_gt(zero);
            let ray = (ray.origin, ray.direction, Beside::Anywhere);
            self.offer_settled(simd, place, ray, (hit, clear), (slope, distance), nearest);
        }
    }

    /// Offers a `hit`. If the hit is not `clear` of the edges, or if the ray is nearly in the plane, offers the settled
    /// result. A ray within the rounding error of the plane misses.
    #[inline(always)]
    fn offer_settled<S: Simd>(
        &self,
        simd: S,
        place: Place,
        (origin, direction, beside): (Vec3<S, E>, Vec3<S, E>, Beside),
        (hit, clear): (Mask<S, E>, Mask<S, E>),
        (slope, distance): (Lanes<S, E>, Lanes<S, E>),
        nearest: &mut Nearest<S, E>,
    ) {
        let sure = clear & slope.abs().simd_ge(constant::<S, E>(simd, beside.flat()));
        let doubtful = hit & !sure;
        if !doubtful.any_true() {
            return nearest.offer(simd, hit, distance, self.order);
        }
        let steep = slope.abs().simd_gt(constant::<S, E>(simd, GRAZING * E::ROUNDOFF));
        // Built here, so that only rays in doubt go through memory.
        let ray = Ray { origin, direction };
        let (met, settled) = settle(simd, place, ray, beside, (doubtful & steep, clear), distance);
        let distance = doubtful.select(settled, distance);
        let met = sure | (met & steep & distance.simd_gt(constant::<S, E>(simd, 0.0)));
        nearest.offer(simd, hit & met, distance, self.order);
    }

    /// Returns the surface at the hits of the rays. The point is moved onto the plane by its height above it.
    #[inline(always)]
    pub(in crate::fast) fn surface<S: Simd>(
        &self,
        simd: S,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        let normal = Vec3::splat(simd, self.normal);
        let zero = constant::<S, E>(simd, 0.0);
        let point = ray.direction.scale_add(distance, ray.origin);
        let height = splat::<S, E>(simd, self.height);
        let above = normal.dot(point) - height;
        let side = normal
            .dot(ray.direction)
            .simd_gt(zero)
            .select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0));
        let offset =
            offset(simd, point, OFFSET) + height.abs() * constant::<S, E>(simd, OFFSET * E::ROUNDOFF);
        let start = normal.scale_add(side * offset - above, point);
        Surface { start, normal: normal.scale(side), offset, within: no_lane::<S, E>(simd) }
    }
}

/// The per-ray constants of the triangle test.
#[derive(Clone, Copy)]
pub(in crate::fast) struct Moment<S: Simd, E: Real> {
    /// The cross product origin × direction.
    pub(in crate::fast) moment: Vec3<S, E>,
    /// The sum norm |origin|₁.
    reach: Lanes<S, E>,
}

impl<E: Real> Precalculations<E> for Triangle<E> {
    type RayPrecalculations<S: Simd> = Moment<S, E>;

    #[inline(always)]
    fn aim<S: Simd>(simd: S, ray: Ray<S, E>) -> Moment<S, E> {
        Facet::aim(simd, ray)
    }
}

impl<E: Real> Precalculations<E> for Facet<E> {
    type RayPrecalculations<S: Simd> = Moment<S, E>;

    #[inline(always)]
    fn aim<S: Simd>(_: S, ray: Ray<S, E>) -> Moment<S, E> {
        let Ray { origin, direction } = ray;
        Moment { moment: origin.cross(direction), reach: origin.x.abs() + origin.y.abs() + origin.z.abs() }
    }
}

impl<E: Real> Tests<Triangle<E>, E> for Robust {
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
            triangle.meet_from_eye(simd, place, ray.direction, nearest);
        } else {
            triangle.facet.meet_from_anywhere(simd, place, ray, moment, nearest);
        }
    }

    #[inline(always)]
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        triangle: &Triangle<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        triangle.facet.surface(simd, ray, distance)
    }
}

/// A triangle as an occluder of one sun: affine functions of the ray's origin.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Prism<E> {
    /// The sides, in units of twice a bound on the error. Below 0 is outside the triangle; from 0 to 1 is in doubt.
    sides: [([E; 3], E); 3],
    /// The depth behind the plane, on the side away from the light, in the same units. Below 0 is the lit side.
    depth: ([E; 3], E),
}

impl<E: Real> Prism<E> {
    /// Makes an occluder from the Plücker coordinates of the ray through `o` along `d`:
    /// `d · moment + direction · (o × d)`. `axes` are the sun's [rounded](Sun::rounded) axes.
    #[inline(never)]
    pub(in crate::fast) fn new(
        &RenderSpaceTriangle { vertices, normal, height }: &RenderSpaceTriangle,
        axes: DMat3,
    ) -> Self {
        let towards = axes.row(2);
        let facing = normal.dot(towards);
        let sign = facing.signum();
        if facing.abs() <= EDGE_ON * E::ROUNDOFF {
            return Self {
                sides: [([E::narrow(0.0); 3], E::narrow(-1.0)); 3],
                depth: ([E::narrow(0.0); 3], E::narrow(-1.0)),
            };
        }
        let ends = Ends::new(vertices);
        // No point has a coordinate above 1, and no corner is farther away than the root of 3.
        let scale = |slope: DVec3, start: f64, noise: f64| {
            0.5 / (side_of_going_on::<E>() * E::ROUNDOFF * (l1(slope) + start.abs()) + noise)
        };
        let side = |from: usize, to: usize| {
            let edge = vertices[to] - vertices[from];
            let slope = towards.cross(edge) * sign;
            let start = -slope.dot(ends.nearer(from, to));
            let scale = scale(slope, start, 3.0 * CONSTANT * l1(edge));
            (point(slope * scale), E::narrow(start * scale + 0.5))
        };
        let scale = sign * scale(normal, height, CONSTANT);
        Self {
            sides: [side(1, 2), side(2, 0), side(0, 1)],
            depth: (point(-normal * scale), E::narrow(height * scale)),
        }
    }

    /// Returns the depth of points in the triangle's shadow: negative outside, at least 1 if certainly inside.
    #[inline(always)]
    fn within<S: Simd>(&self, simd: S, point: Vec3<S, E>) -> Lanes<S, E> {
        let [a, b, c] = self.sides;
        let (a, b, c) = (affine(simd, a, point), affine(simd, b, point), affine(simd, c, point));
        a.min(b).min(c).min(affine(simd, self.depth, point))
    }
}

impl<E: Real> Obstructs<E> for Triangle<E> {
    type Obstacle = Prism<E>;
    type SunPrecalculations<S: Simd> = ();

    #[inline(always)]
    fn face<S: Simd>(_: S, _: &Sun<E>, _: Vec3<S, E>) {}

    /// Returns the points that none of the triangles occludes, by the largest depth. [`settle`] decides the points in
    /// doubt.
    #[inline(always)]
    fn unoccluded<S: Simd>(
        simd: S,
        obstacles: Obstacles<Prism<E>>,
        items: impl Items,
        sun: &Sun<E>,
        (point, ()): (Vec3<S, E>, ()),
        lit: Mask<S, E>,
    ) -> Mask<S, E> {
        let mut most = constant::<S, E>(simd, -1.0);
        for (_, prism) in items.clone().of(obstacles.0) {
            most = most.max(prism.within(simd, point));
        }
        let over = most.simd_ge(constant::<S, E>(simd, 0.0));
        if !over.any_true() {
            return lit;
        }
        let lit = lit & most.simd_lt(constant::<S, E>(simd, 1.0));
        let doubtful = lit & over;
        if doubtful.any_true() {
            lit & !settle_shadows(simd, obstacles, items, sun, point, doubtful)
        } else {
            lit
        }
    }
}

/// Returns the points in doubt that are in the shadow of one of the triangles.
#[cold]
#[inline(never)]
fn settle_shadows<S: Simd, E: Real>(
    simd: S,
    (prisms, corners): (&[Prism<E>], &dyn Corners),
    items: impl Items,
    sun: &Sun<E>,
    point: Vec3<S, E>,
    doubtful: Mask<S, E>,
) -> Mask<S, E> {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = constant::<S, E>(simd, 0.0);
            let ray = Ray { origin: point, direction: sun.towards(simd) };
            let none = zero.simd_lt(zero);
            let mut dark = none;
            for (at, prism) in items.of(prisms) {
                let over = prism.within(simd, point).simd_ge(zero);
                let open = doubtful & over & !dark;
                if open.any_true() {
                    dark |= settle(simd, (corners, at), ray, Beside::Light, (open, none), zero).0;
                }
            }
            dark
        },
    )
}

/// A triangle's corners with their distances from the eye. Relative to the nearer corner, numbers are smaller and have
/// smaller rounding errors.
struct Ends {
    vertices: [DVec3; 3],
    /// The squares of their distances.
    squares: [f64; 3],
}

impl Ends {
    #[inline(always)]
    fn new(vertices: [DVec3; 3]) -> Self {
        Self { vertices, squares: vertices.map(|v| v.length_squared()) }
    }

    #[inline(always)]
    fn nearer(&self, i: usize, j: usize) -> DVec3 {
        self.vertices[if self.squares[i] < self.squares[j] { i } else { j }]
    }

    #[inline(always)]
    fn nearest(&self) -> DVec3 {
        let [a, b, c] = self.squares;
        self.vertices[if a <= b && a <= c {
            0
        } else if b <= c {
            1
        } else {
            2
        }]
    }
}

fn l1(v: DVec3) -> f64 {
    v.abs().element_sum()
}

fn point<E: Real>(v: DVec3) -> [E; 3] {
    v.to_array().map(E::narrow)
}
