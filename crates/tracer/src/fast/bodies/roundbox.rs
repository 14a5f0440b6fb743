//! Boxes with round edges: all points within a radius of a smaller box, the core.
//!
//! Along a ray the square of the distance from the core is a convex function of the ray's parameter. It consists of at
//! most seven parabolas, which meet, with equal slopes, where the ray enters and leaves the three slabs of the core.
//! The ray enters the body in the last parabola that begins outside and descends there. So there is only one square
//! root, there are no tests of faces, edges and corners, and there is no seam between them. If rounding selects the
//! parabola next to the right one, both have the same value and slope there. A ray leaves the body where the reversed
//! ray enters it.
//!
//! Most rays leave no slab before they enter the body. So the beginnings at which a ray enters a slab are examined
//! first. As long as the ray enters no other slab, the parabola found in this way is no higher than the function after
//! it, so a ray that misses the parabola misses the body. The beginnings at which a ray leaves a slab are examined only
//! for rays that leave one before they enter the body. For a ray that starts outside the bounding box, the point where
//! it leaves the body is not needed.
//!
//! Whether a ray is beside the core along an axis is decided only by comparing its parameter with those of the slabs.
//! So a point outside the core is always outside along some axis. A ray parallel to a slab gets a small slope across
//! it, so that its parameters there are large numbers of the right signs.
//!
//! As for cones, the ray's parameter is counted from its point nearest to the body's centre, so that the numbers are no
//! larger than the body. The points beside the core have errors of two roundoffs of the body's size, and the
//! discriminant is that of a cross product. Across the ray, the ends of the interval have errors of less than 16
//! roundoffs, within the bound of bodies.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};
use rayfold_scene::Placement;

use super::solid::{Form, Frame, Place, Span, flat};
use super::{BodyHit, Local};
use crate::fast::acceleration::hollow::Hollow;
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::bounds::Bounds;
use crate::fast::shared::{Plain, Side, Surface};

/// A box with round edges, centred at the origin: half of the lengths of its core, and the radius around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roundbox<E> {
    core: [E; 3],
    radius: E,
    /// The distance of the bounding box from the core, with the rounding errors of tests against the box.
    reach: E,
    /// The half lengths of that box, and a bound on the rounding errors of the moment of a ray and of distances.
    outer: [E; 3],
    slack: E,
    /// The inverse of the radius, and whether rounding errors are more than a small part of the radius.
    inverse: E,
    is_sharp: bool,
}

/// The smallest absolute component of a ray along an axis, for a direction of length 1.
const LEAST_STEP: f64 = 1e-30;

/// The radius, in units of half of the greatest length, below which normals need the same accuracy as the ends of
/// intervals.
const SHARP_TO_SEE: f64 = 1e-5;

/// The widening of the bounding box, in roundoffs of the body's size.
const WIDER: f64 = 64.0;

/// A slab of the core, along one axis.
#[derive(Clone, Copy)]
struct Slab<S: Simd, E: Real> {
    half: Lanes<S, E>,
    place: Lanes<S, E>,
    direction: Lanes<S, E>,
    /// The parameters at which rays enter and leave it.
    near: Lanes<S, E>,
    far: Lanes<S, E>,
    /// At the parameter 0, the distances of the rays beyond the face by which they enter, and beyond that by which they
    /// leave.
    before: Lanes<S, E>,
    behind: Lanes<S, E>,
    /// The parameters at which rays enter and leave the slab of the bounding box.
    outer: [Lanes<S, E>; 2],
}

/// The distance of rays beyond the core along an axis at the parameter 0, and its slope.
type Beside<S, E> = (Lanes<S, E>, Lanes<S, E>);

/// The points where rays enter the body: the parameter, and the vector there from the core.
struct Entry<S: Simd, E: Real> {
    at: Lanes<S, E>,
    from_core: Vec3<S, E>,
    enters: Mask<S, E>,
}

/// The slabs of the core, along the three axes.
struct Slabs<S: Simd, E: Real>([Slab<S, E>; 3]);

impl<S: Simd, E: Real> Slab<S, E> {
    #[inline(always)]
    fn new(
        simd: S,
        (half, reach): (E, E),
        place: Lanes<S, E>,
        (direction, inverse): (Lanes<S, E>, Lanes<S, E>),
    ) -> Self {
        let zero = constant::<S, E>(simd, 0.0);
        let half = splat::<S, E>(simd, half);
        let face = direction.simd_gt(zero).select(half, zero - half);
        let (before, behind) = (place + face, place - face);
        let (near, far) = (zero - before * inverse, zero - behind * inverse);
        let grown = splat::<S, E>(simd, reach) * inverse.abs();
        Self { half, place, direction, near, far, before, behind, outer: [near - grown, far + grown] }
    }

    /// Returns the distance of rays beyond it at a parameter.
    #[inline(always)]
    fn beyond(&self, simd: S, at: Lanes<S, E>) -> Lanes<S, E> {
        let place = at.fused_mul_add(self.direction, self.place);
        place - place.max(constant::<S, E>(simd, 0.0) - self.half).min(self.half)
    }

    /// Returns the rays that leave it between two parameters.
    #[inline(always)]
    fn is_left(&self, begin: Lanes<S, E>, end: Lanes<S, E>) -> Mask<S, E> {
        begin.simd_lt(self.far) & self.far.simd_lt(end)
    }

    /// Returns the distance of rays beyond it from a parameter on.
    #[inline(always)]
    fn from(&self, simd: S, at: Lanes<S, E>) -> Beside<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let (is_before, is_behind) = (at.simd_lt(self.near), at.simd_ge(self.far));
        let place = is_before.select(self.before, is_behind.select(self.behind, zero));
        (place, (is_before | is_behind).select(self.direction, zero))
    }
}

impl<S: Simd, E: Real> Slabs<S, E> {
    /// Returns the slabs relative to rays, whose parameter counts from their points nearest to the body's centre.
    #[inline(always)]
    fn new(simd: S, roundbox: &Roundbox<E>, place: Vec3<S, E>, direction: Vec3<S, E>) -> Self {
        let Roundbox { core: [x, y, z], reach, .. } = *roundbox;
        let dx = not_along::<S, E>(simd, direction.x);
        let dy = not_along::<S, E>(simd, direction.y);
        let dz = not_along::<S, E>(simd, direction.z);
        // One division for three. The parameters may err, because neighbouring parabolas are alike where they meet.
        let yz = dy * dz;
        let all = constant::<S, E>(simd, 1.0) / (dx * yz);
        let x_all = dx * all;
        Self([
            Slab::new(simd, (x, reach), place.x, (dx, yz * all)),
            Slab::new(simd, (y, reach), place.y, (dy, dz * x_all)),
            Slab::new(simd, (z, reach), place.z, (dz, dy * x_all)),
        ])
    }

    /// Returns the parameters at which rays enter and leave the bounding box. For rays that miss, the first is greater.
    #[inline(always)]
    fn outer(&self) -> [Lanes<S, E>; 2] {
        let Self([x, y, z]) = self;
        [x.outer[0].max(y.outer[0]).max(z.outer[0]), x.outer[1].min(y.outer[1]).min(z.outer[1])]
    }

    /// Returns where rays enter the body. Its surface is at the distance of the root of `square` from the core.
    #[inline(always)]
    fn entry(&self, simd: S, square: Lanes<S, E>) -> Entry<S, E> {
        let Self([x, y, z]) = self;
        let mut begin = constant::<S, E>(simd, -E::FAR);
        begin = later(simd, begin, x.near, (y, z), square);
        begin = later(simd, begin, y.near, (z, x), square);
        begin = later(simd, begin, z.near, (x, y), square);
        let first = self.crossing(simd, begin, square);
        let left = x.is_left(begin, first.at) | y.is_left(begin, first.at) | z.is_left(begin, first.at);
        let leaves = first.enters & left;
        if !leaves.any_true() {
            return first;
        }
        begin = later(simd, begin, x.far, (y, z), square);
        begin = later(simd, begin, y.far, (z, x), square);
        begin = later(simd, begin, z.far, (x, y), square);
        let second = self.crossing(simd, begin, square);
        Entry {
            at: leaves.select(second.at, first.at),
            from_core: Vec3::<S, E>::new(
                leaves.select(second.from_core.x, first.from_core.x),
                leaves.select(second.from_core.y, first.from_core.y),
                leaves.select(second.from_core.z, first.from_core.z),
            ),
            enters: first.enters & (second.enters | !leaves),
        }
    }

    /// Returns where the parabola that begins at a parameter descends through the value `square`.
    #[inline(always)]
    fn crossing(&self, simd: S, begin: Lanes<S, E>, square: Lanes<S, E>) -> Entry<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let Self([x, y, z]) = self;
        let (x, y, z) = (x.from(simd, begin), y.from(simd, begin), z.from(simd, begin));
        let from = Vec3::<S, E>::new(x.0, y.0, z.0);
        let along = Vec3::<S, E>::new(x.1, y.1, z.1);
        let a = along.dot(along);
        let inverse = constant::<S, E>(simd, 1.0) / a;
        // As a cross product, because the squares of the vectors cancel.
        let across = from.cross(along);
        let discriminant = square.fused_mul_sub(a, across.dot(across));
        let at = (zero - from.dot(along) - discriminant.max(zero).sqrt()) * inverse;
        let enters = discriminant.simd_ge(zero) & a.simd_gt(zero);
        Entry { at, from_core: along.scale_add(at, from), enters }
    }
}

/// Returns the component of rays along an axis, which is never 0.
#[inline(always)]
fn not_along<S: Simd, E: Real>(simd: S, step: Lanes<S, E>) -> Lanes<S, E> {
    let (zero, least) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, LEAST_STEP));
    step.simd_gt(zero).select(step.max(least), step.min(zero - least))
}

/// Returns the later of the possible beginnings of the parabola in which rays enter the body, given a parameter at
/// which they are at a face of one slab, and the other two slabs.
#[inline(always)]
fn later<S: Simd, E: Real>(
    simd: S,
    begin: Lanes<S, E>,
    at: Lanes<S, E>,
    (one, other): (&Slab<S, E>, &Slab<S, E>),
    square: Lanes<S, E>,
) -> Lanes<S, E> {
    let (u, v) = (one.beyond(simd, at), other.beyond(simd, at));
    let is_outside = u.fused_mul_add(u, v * v).simd_gt(square);
    let slope = u.fused_mul_add(one.direction, v * other.direction);
    let goes_down = slope.simd_lt(constant::<S, E>(simd, 0.0));
    (is_outside & goes_down).select(begin.max(at), begin)
}

impl<E: Real> Roundbox<E> {
    /// `far` is at least the largest coordinate of its centre.
    pub(super) fn new(half: DVec3, radius: f64, far: f64) -> Self {
        let core = (half - radius).max(DVec3::ZERO);
        let reach = radius + WIDER * E::ROUNDOFF * half.element_sum();
        Self {
            core: core.to_array().map(E::narrow),
            radius: E::narrow(radius),
            reach: E::narrow(reach),
            outer: (core + reach).to_array().map(E::narrow),
            inverse: E::narrow(1.0 / radius),
            is_sharp: radius < SHARP_TO_SEE * half.max_element().max(0.1),
            slack: E::narrow(WIDER * E::ROUNDOFF * (1.0 + far + half.element_sum())),
        }
    }

    #[inline(always)]
    fn square<S: Simd>(&self, simd: S) -> Lanes<S, E> {
        let radius = splat::<S, E>(simd, self.radius);
        radius * radius
    }

    /// Returns the parameter of each ray's point nearest to the centre, and that point.
    #[inline(always)]
    fn nearest<S: Simd>(simd: S, Local { origin, direction }: Local<S, E>) -> (Lanes<S, E>, Vec3<S, E>) {
        let nearest = constant::<S, E>(simd, 0.0) - origin.dot(direction);
        (nearest, direction.scale_add(nearest, origin))
    }

    /// Returns where rays leave the body.
    #[inline(always)]
    fn exit<S: Simd>(&self, simd: S, place: Vec3<S, E>, direction: Vec3<S, E>) -> Entry<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let back = Vec3::<S, E>::new(zero - direction.x, zero - direction.y, zero - direction.z);
        let mut exit = Slabs::new(simd, self, place, back).entry(simd, self.square(simd));
        exit.at = zero - exit.at;
        exit
    }

    /// Returns the rays whose lines meet the bounding box, by the three planes through a line and along an axis. It is
    /// the fastest test to detect a miss, because it has no division.
    #[inline(always)]
    fn passes<S: Simd>(&self, simd: S, Local { origin, direction }: Local<S, E>) -> Mask<S, E> {
        let [x, y, z] = self.outer.map(|half| splat::<S, E>(simd, half));
        let slack = splat::<S, E>(simd, self.slack);
        let moment = origin.cross(direction);
        let Vec3 { x: dx, y: dy, z: dz } = direction;
        let (dx, dy, dz) = (dx.abs(), dy.abs(), dz.abs());
        moment.x.abs().simd_le(y.fused_mul_add(dz, z.fused_mul_add(dy, slack)))
            & moment.y.abs().simd_le(z.fused_mul_add(dx, x.fused_mul_add(dz, slack)))
            & moment.z.abs().simd_le(x.fused_mul_add(dy, y.fused_mul_add(dx, slack)))
    }

    /// Returns the hits of the rays and their distances, at least all that are no farther than `before`.
    #[inline(always)]
    pub(super) fn intersect<S: Simd>(
        &self,
        simd: S,
        ray: Local<S, E>,
        before: Lanes<S, E>,
    ) -> (Mask<S, E>, Lanes<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let passes = self.passes(simd, ray);
        if !passes.any_true() {
            return (passes, zero);
        }
        let (nearest, place) = Self::nearest(simd, ray);
        let slabs = Slabs::new(simd, self, place, ray.direction);
        let [enter, leave] = slabs.outer();
        let before = before + splat::<S, E>(simd, self.slack);
        let is_before = (leave + nearest).simd_gt(zero) & (enter + nearest).simd_le(before);
        let hits = enter.simd_le(leave) & is_before;
        if !hits.any_true() {
            return (hits, zero);
        }
        let entry = slabs.entry(simd, self.square(simd));
        let first = entry.at + nearest;
        let hits = hits & entry.enters;
        let starts_within = (enter + nearest).simd_le(zero) & first.simd_le(zero);
        let mut distance = first;
        if (hits & starts_within).any_true() {
            let last = self.exit(simd, place, ray.direction).at + nearest;
            distance = starts_within.select(last, first);
        }
        (hits & distance.simd_gt(zero), distance)
    }

    /// Returns the hit of each ray.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Local<S, E>, distance: Lanes<S, E>) -> BodyHit<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let place = ray.direction.scale_add(distance, ray.origin);
        let in_core = self.in_core(simd, place);
        let (normal, within) = if self.is_sharp {
            self.sharp(simd, ray)
        } else {
            let start = ray.origin.sub(self.in_core(simd, ray.origin));
            // The length of the normal is 1 but for rounding errors, of which a step of Newton's method leaves none.
            let normal = place.sub(in_core).scale(splat::<S, E>(simd, self.inverse));
            let half = constant::<S, E>(simd, -0.5);
            let normal = normal.scale(normal.dot(normal).fused_mul_add(half, constant::<S, E>(simd, 1.5)));
            (normal, start.dot(start).simd_lt(self.square(simd)))
        };
        let point = normal.scale_add(splat::<S, E>(simd, self.radius), in_core);
        BodyHit { point, normal: normal.scale(within.select(zero - one, one)), within }
    }

    /// Returns the outer normal at the hit of each ray, for a radius that is not much more than the rounding errors,
    /// and whether the ray starts within.
    #[inline(always)]
    fn sharp<S: Simd>(&self, simd: S, ray: Local<S, E>) -> (Vec3<S, E>, Mask<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let (nearest, place) = Self::nearest(simd, ray);
        let slabs = Slabs::new(simd, self, place, ray.direction);
        let entry = slabs.entry(simd, self.square(simd));
        let [enter, _] = slabs.outer();
        let within = (enter + nearest).simd_le(zero) & (entry.at + nearest).simd_le(zero);
        let first = entry.from_core;
        let last = self.exit(simd, place, ray.direction).from_core;
        let from_core = Vec3::<S, E>::new(
            within.select(last.x, first.x),
            within.select(last.y, first.y),
            within.select(last.z, first.z),
        );
        (from_core.normalize(simd), within)
    }

    /// Returns the points of the core that are nearest to some points.
    #[inline(always)]
    fn in_core<S: Simd>(&self, simd: S, point: Vec3<S, E>) -> Vec3<S, E> {
        let [x, y, z] = self.core;
        Vec3::<S, E>::new(
            clamped::<S, E>(simd, point.x, x),
            clamped::<S, E>(simd, point.y, y),
            clamped::<S, E>(simd, point.z, z),
        )
    }
}

/// Returns a coordinate, moved into the core.
#[inline(always)]
fn clamped<S: Simd, E: Real>(simd: S, place: Lanes<S, E>, half: E) -> Lanes<S, E> {
    let half = splat::<S, E>(simd, half);
    place.max(constant::<S, E>(simd, 0.0) - half).min(half)
}

/// A box with round edges in its frame, given by its half lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoundboxForm {
    pub(super) half: DVec3,
    pub(super) radius: f64,
}

/// The radius, in units of the body's numbers, below which edges are sharp as far as rounding errors allow to tell.
/// Such edges are drawn with this radius, so that no ray passes through them.
const SHARP: f64 = 1.0 / (1u64 << 46) as f64;

impl RoundboxForm {
    /// Makes the form of a box of the world, or of a group that is placed there.
    pub(super) fn new(
        roundbox: &rayfold_scene::Roundbox,
        placement: Option<&Placement>,
        place: Place,
    ) -> (Frame, Self) {
        let (min, max) = (roundbox.min(), roundbox.max());
        let center = min + 0.5 * (max - min);
        let (rotation, scale, center) = match placement {
            Some(placement) => (placement.rotation(), placement.scale(), placement.point(center)),
            None => (DMat3::IDENTITY, 1.0, center),
        };
        let scale = scale * place.scale;
        let half = 0.5 * (max - min) * scale;
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

    fn slab(&self, frame: &Frame) -> Option<Span> {
        Span::of_box(frame, self.half)
    }

    fn hollow(&self, frame: &Frame) -> Option<Hollow> {
        Some((frame.center, self.half.min_element()))
    }
}
