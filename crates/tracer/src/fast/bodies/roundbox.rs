//! Boxes with round edges: all points within a radius of a smaller box, the core.
//!
//! Along a ray the square of the distance from the core is a convex function of the ray's parameter. It consists of at
//! most seven parabolas, which meet, with equal slopes, where the ray enters and leaves the three slabs of the core. The
//! ray enters the body in the last parabola whose beginning is outside and goes down, and leaves it in the first whose
//! end is outside and goes up. So there are two square roots, no tests of faces, edges and corners, and no seam between
//! them: if rounding chooses the parabola beside the right one, both have the same value and slope there.
//!
//! A ray is beside the core along an axis by comparisons of its parameter with those of the slabs alone. So a place that
//! is outside has an axis along which it is, and the parabola's square coefficient is not 0.
//!
//! As for cones, the ray's parameter is counted from its point nearest to the body's centre, so that the numbers are no
//! larger than the body. The places beside the core have errors of two roundoffs of that, the discriminant is one of a
//! cross product, and the ends of the interval have errors across the ray of less than 16: within the bound of bodies.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};

use super::solid::{Form, Frame, Place, flat};
use super::{BodyHit, Local};
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::bounds::Bounds;
use crate::fast::shared::{Plain, Side, Surface};

/// A box with round edges, centred at the origin: half of the lengths of its core, and the radius around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roundbox<E> {
    core: [E; 3],
    radius: E,
}

/// A slab of the core, along one axis.
#[derive(Clone, Copy)]
struct Slab<S: Simd, E: Real> {
    /// The parameters at which rays enter and leave it; those of no numbers for rays along it.
    near: Lanes<S, E>,
    far: Lanes<S, E>,
    /// The places of the rays, at the parameter 0, beyond the face by which they enter, and that by which they leave.
    before: Lanes<S, E>,
    behind: Lanes<S, E>,
    /// The places of rays along it, beyond the nearer face; 0 within it, and for all other rays.
    aside: Lanes<S, E>,
    direction: Lanes<S, E>,
}

/// The place of rays beyond the core along an axis, at the parameter 0, and how it grows.
type Beside<S, E> = (Lanes<S, E>, Lanes<S, E>);

/// A place where rays cross the surface: the parameter, and the vector there from the core.
struct Crossing<S: Simd, E: Real> {
    at: Lanes<S, E>,
    from_core: Vec3<S, E>,
    crosses: Mask<S, E>,
}

/// The interval of each ray in the body, and what its parameters are counted from.
struct Stretch<S: Simd, E: Real> {
    enter: Crossing<S, E>,
    leave: Crossing<S, E>,
    nearest: Lanes<S, E>,
}

impl<S: Simd, E: Real> Slab<S, E> {
    #[inline(always)]
    fn new(simd: S, half: E, place: Lanes<S, E>, direction: Lanes<S, E>) -> Self {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let (far, back) = (constant::<S, E>(simd, E::FAR), constant::<S, E>(simd, -E::FAR));
        let half = splat::<S, E>(simd, half);
        let (over, under) = (place + half, place - half);
        let forwards = direction.simd_gt(zero);
        let (before, behind) = (forwards.select(over, under), forwards.select(under, over));
        let inverse = one / direction;
        let is_along = direction.simd_eq(zero);
        let aside = place - place.max(zero - half).min(half);
        Self {
            near: is_along.select(back, (zero - before) * inverse),
            far: is_along.select(far, (zero - behind) * inverse),
            before,
            behind,
            aside: is_along.select(aside, zero),
            direction,
        }
    }

    /// Returns the place of rays beyond it from the parameter `at` on.
    #[inline(always)]
    fn from(&self, simd: S, at: Lanes<S, E>) -> Beside<S, E> {
        let (is_before, is_behind) = (at.simd_lt(self.near), at.simd_ge(self.far));
        self.beside(simd, is_before, is_behind)
    }

    /// Returns the place of rays beyond it up to the parameter `at`.
    #[inline(always)]
    fn up_to(&self, simd: S, at: Lanes<S, E>) -> Beside<S, E> {
        let (is_before, is_behind) = (at.simd_le(self.near), at.simd_gt(self.far));
        self.beside(simd, is_before, is_behind)
    }

    #[inline(always)]
    fn beside(&self, simd: S, is_before: Mask<S, E>, is_behind: Mask<S, E>) -> Beside<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let place = is_before.select(self.before, is_behind.select(self.behind, self.aside));
        (place, (is_before | is_behind).select(self.direction, zero))
    }
}

impl<E: Real> Roundbox<E> {
    pub(super) fn new(half: DVec3, radius: f64) -> Self {
        let core = (half - radius).max(DVec3::ZERO);
        Self { core: core.to_array().map(E::narrow), radius: E::narrow(radius) }
    }

    /// Returns the interval of each ray in the body.
    #[inline(always)]
    fn stretch<S: Simd>(&self, simd: S, ray: Local<S, E>) -> Stretch<S, E> {
        let Local { origin, direction } = ray;
        let (mut begin, mut end) = (constant::<S, E>(simd, -E::FAR), constant::<S, E>(simd, E::FAR));
        let radius = splat::<S, E>(simd, self.radius);
        let square = radius * radius;
        let nearest = constant::<S, E>(simd, 0.0) - origin.dot(direction);
        let place = direction.scale_add(nearest, origin);
        let [x, y, z] = self.core;
        let x = Slab::new(simd, x, place.x, direction.x);
        let y = Slab::new(simd, y, place.y, direction.y);
        let z = Slab::new(simd, z, place.z, direction.z);
        (begin, end) = narrower(simd, (begin, end), x.near, (&y, &z), square);
        (begin, end) = narrower(simd, (begin, end), x.far, (&y, &z), square);
        (begin, end) = narrower(simd, (begin, end), y.near, (&z, &x), square);
        (begin, end) = narrower(simd, (begin, end), y.far, (&z, &x), square);
        (begin, end) = narrower(simd, (begin, end), z.near, (&x, &y), square);
        (begin, end) = narrower(simd, (begin, end), z.far, (&x, &y), square);
        let minus = constant::<S, E>(simd, -1.0);
        let enter = (x.from(simd, begin), y.from(simd, begin), z.from(simd, begin));
        let leave = (x.up_to(simd, end), y.up_to(simd, end), z.up_to(simd, end));
        Stretch {
            enter: crossing(simd, enter, square, minus),
            leave: crossing(simd, leave, square, constant::<S, E>(simd, 1.0)),
            nearest,
        }
    }

    #[inline(always)]
    pub(super) fn intersect<S: Simd>(&self, simd: S, ray: Local<S, E>) -> (Mask<S, E>, Lanes<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let Stretch { enter, leave, nearest } = self.stretch(simd, ray);
        let (first, last) = (enter.at + nearest, leave.at + nearest);
        let distance = first.simd_gt(zero).select(first, last);
        (enter.crosses & distance.simd_gt(zero), distance)
    }

    /// Returns the hit of each ray.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Local<S, E>, distance: Lanes<S, E>) -> BodyHit<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let Stretch { enter, leave, nearest } = self.stretch(simd, ray);
        let within = (enter.at + nearest).simd_le(zero);
        let (first, last) = (enter.from_core, leave.from_core);
        let from_core = Vec3::<S, E>::new(
            within.select(last.x, first.x),
            within.select(last.y, first.y),
            within.select(last.z, first.z),
        );
        let normal = from_core.normalize(simd);
        let place = ray.direction.scale_add(distance, ray.origin);
        let radius = splat::<S, E>(simd, self.radius);
        let [x, y, z] = self.core;
        let point = Vec3::<S, E>::new(
            normal.x.mul_add(radius, clamped::<S, E>(simd, place.x, x)),
            normal.y.mul_add(radius, clamped::<S, E>(simd, place.y, y)),
            normal.z.mul_add(radius, clamped::<S, E>(simd, place.z, z)),
        );
        BodyHit { point, normal: normal.scale(within.select(zero - one, one)), within }
    }
}

/// Returns a coordinate, moved into the core.
#[inline(always)]
fn clamped<S: Simd, E: Real>(simd: S, place: Lanes<S, E>, half: E) -> Lanes<S, E> {
    let half = splat::<S, E>(simd, half);
    place.max(constant::<S, E>(simd, 0.0) - half).min(half)
}

/// Returns the later beginning and the earlier end of the parabolas in which rays cross the surface, given a parameter
/// at which they are in or at the faces of one slab, and the other two slabs.
#[inline(always)]
fn narrower<S: Simd, E: Real>(
    simd: S,
    (begin, end): (Lanes<S, E>, Lanes<S, E>),
    at: Lanes<S, E>,
    (one, other): (&Slab<S, E>, &Slab<S, E>),
    square: Lanes<S, E>,
) -> (Lanes<S, E>, Lanes<S, E>) {
    let zero = constant::<S, E>(simd, 0.0);
    let ((u, du), (v, dv)) = (one.from(simd, at), other.from(simd, at));
    let (u, v) = (at.mul_add(du, u), at.mul_add(dv, v));
    let is_outside = u.mul_add(u, v * v).simd_gt(square);
    let slope = u.mul_add(du, v * dv);
    let begin = (is_outside & slope.simd_lt(zero)).select(begin.max(at), begin);
    let end = (is_outside & slope.simd_gt(zero)).select(end.min(at), end);
    (begin, end)
}

/// Returns where a parabola has the value `square`: the smaller root for a `side` of -1, the larger for 1.
#[inline(always)]
fn crossing<S: Simd, E: Real>(
    simd: S,
    (x, y, z): (Beside<S, E>, Beside<S, E>, Beside<S, E>),
    square: Lanes<S, E>,
    side: Lanes<S, E>,
) -> Crossing<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    let from = Vec3::<S, E>::new(x.0, y.0, z.0);
    let along = Vec3::<S, E>::new(x.1, y.1, z.1);
    let a = along.dot(along);
    // As a cross product, because the squares of the vectors cancel.
    let across = from.cross(along);
    let discriminant = square.mul_sub(a, across.dot(across));
    let at = side.mul_sub(discriminant.max(zero).sqrt(), from.dot(along)) / a;
    let crosses = discriminant.simd_ge(zero) & a.simd_gt(zero);
    Crossing { at, from_core: along.scale_add(at, from), crosses }
}

/// A box with round edges in its frame, by half of its lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoundboxForm {
    pub(super) half: DVec3,
    pub(super) radius: f64,
}

/// The radius, in units of the body's numbers, below which edges are sharp for all rounding errors. They are drawn with
/// this radius, so that no ray passes through them.
const SHARP: f64 = 1.0 / (1u64 << 46) as f64;

impl RoundboxForm {
    /// Makes the form of a box that is turned by `rotation` and scaled, and has its centre at `center` in the world.
    pub(super) fn new(
        roundbox: &rayfold_scene::Roundbox,
        (rotation, scale): (DMat3, f64),
        center: DVec3,
        place: Place,
    ) -> (Frame, Self) {
        let scale = scale * place.scale;
        let half = 0.5 * (roundbox.max() - roundbox.min()) * scale;
        let center = place.point(center);
        let sharp = SHARP * (center.abs().max_element() + half.max_element());
        let radius = (roundbox.radius() * scale).max(sharp).min(half.min_element());
        (Frame { axes: [rotation.x_axis, rotation.y_axis, rotation.z_axis], center }, Self { half, radius })
    }

    fn core(&self) -> DVec3 {
        (self.half - self.radius).max(DVec3::ZERO)
    }
}

impl Form for RoundboxForm {
    fn size(&self) -> f64 {
        self.half.element_sum()
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface)) {
        let (core, radius) = (self.core(), self.radius);
        let at = |place: DVec3| {
            frame.center + DMat3::from_cols_array_2d(&frame.axes.map(|a| a.to_array())) * place
        };
        for (number, [one, other]) in [(0, [1, 2]), (1, [2, 0]), (2, [0, 1])] {
            let (axis, across) = (DVec3::AXES[number], core * (1.0 - DVec3::AXES[number]));
            let is_flat = core[one] > 0.0 && core[other] > 0.0;
            for side in [-1.0, 1.0].into_iter().filter(|_| is_flat) {
                let center = at(side * self.half[number] * axis);
                each(flat(frame.axes[number], center, across.length(), Plain::No));
            }
            if core[number] > 0.0 {
                for (u, v) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                    let mut end = -core;
                    (end[one], end[other]) = (u * core[one], v * core[other]);
                    let (end, height) = (at(end), 2.0 * core[number]);
                    each(Surface::Side(Side { end, axis: frame.axes[number], height, radii: [radius; 2] }));
                }
            }
        }
        for corner in 0..8 {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            each(Surface::Ball { center: at(core * DVec3::new(sign(0), sign(1), sign(2))), radius });
        }
    }

    fn is_near(&self, place: DVec3, near: f64, _: bool) -> bool {
        let beside = place.abs() - self.core();
        (beside.max(DVec3::ZERO).length() + beside.max_element().min(0.0) - self.radius).abs() <= near
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (frame.center, self.core().length() + self.radius)
    }

    fn bounds(&self, frame: &Frame) -> Option<Bounds> {
        let ([x, y, z], core) = (frame.axes, self.core());
        let reach = x.abs() * core.x + y.abs() * core.y + z.abs() * core.z + self.radius;
        Some((frame.center - reach, frame.center + reach))
    }
}
