//! Capsules: the union of two balls and of the cylinder between their centres.
//!
//! The body is convex, so a ray has one interval in it: from the first point where it enters one of the three to the
//! last where it leaves one. Where the side meets the round ends, the interval of a ball overlaps that of the cylinder,
//! so that no ray passes between them.
//!
//! As for cones, the ray's parameter is counted from its point nearest to the end a, so that the numbers are no larger
//! than the body. The three discriminants have errors of a few roundoffs of the squares of these numbers. Across the
//! ray, the ends of the interval have errors of less than 16 roundoffs of the body's size, as for a cone, within the
//! bound of bodies.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::solid::{Form, Frame, Place};
use super::{BodyHit, Local};
use crate::fast::acceleration::hollow::Hollow;
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::bounds::Bounds;
use crate::fast::shared::{Side, Surface};

/// A capsule from the origin along z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capsule<E> {
    radius: E,
    height: E,
}

/// The interval of each ray in the body.
struct Stretch<S: Simd, E: Real> {
    enter: Lanes<S, E>,
    leave: Lanes<S, E>,
    hit: Mask<S, E>,
}

impl<E: Real> Capsule<E> {
    pub(super) fn new(radius: f64, height: f64) -> Self {
        Self { radius: E::narrow(radius), height: E::narrow(height) }
    }

    /// Returns the interval of each ray in the body. Lanes in which `hit` is not set have an empty interval.
    #[inline(always)]
    fn stretch<S: Simd>(&self, simd: S, ray: Local<S, E>) -> Stretch<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let (far, back) = (constant::<S, E>(simd, E::FAR), constant::<S, E>(simd, -E::FAR));
        let Local { origin, direction } = ray;
        let radius = splat::<S, E>(simd, self.radius);
        let height = splat::<S, E>(simd, self.height);
        let square = radius * radius;
        let nearest = zero - origin.dot(direction);
        let place = direction.scale_add(nearest, origin);
        // The balls. The point nearest to the second is higher by the height's part along the ray.
        let higher = height * direction.z;
        let of_b = Vec3::<S, E>::new(
            place.x + higher * direction.x,
            place.y + higher * direction.y,
            place.z + higher * direction.z - height,
        );
        let (at_a, at_b) = (square - place.dot(place), square - of_b.dot(of_b));
        let (half_a, half_b) = (at_a.max(zero).sqrt(), at_b.max(zero).sqrt());
        let (hits_a, hits_b) = (at_a.simd_ge(zero), at_b.simd_ge(zero));
        let enter_a = hits_a.select(zero - half_a, far);
        let leave_a = hits_a.select(half_a, back);
        let enter_b = hits_b.select(higher - half_b, far);
        let leave_b = hits_b.select(higher + half_b, back);
        // The cylinder, cut off at both ends.
        let a = direction.x.fused_mul_add(direction.x, direction.y * direction.y);
        let b = place.x.fused_mul_add(direction.x, place.y * direction.y);
        let c = place.x.fused_mul_add(place.x, place.y * place.y) - square;
        let x = place.x.fused_mul_sub(direction.y, place.y * direction.x);
        let discriminant = square.fused_mul_sub(a, x * x);
        let is_along = a.simd_eq(zero);
        let root = discriminant.max(zero).sqrt();
        let inverse = one / a;
        let enter = is_along.select(back, (zero - b - root) * inverse);
        let leave = is_along.select(far, (root - b) * inverse);
        let crosses = is_along.select(zero - c, discriminant).simd_ge(zero);
        let is_level = direction.z.simd_eq(zero);
        let inverse = one / direction.z;
        let (low, high) = ((zero - place.z) * inverse, (height - place.z) * inverse);
        let between = place.z.simd_ge(zero) & place.z.simd_le(height);
        let first = is_level.select(between.select(back, far), low.min(high));
        let last = is_level.select(between.select(far, back), low.max(high));
        let (enter, leave) = (enter.max(first), leave.min(last));
        let crosses = crosses & enter.simd_le(leave);
        let enter = crosses.select(enter, far).min(enter_a).min(enter_b);
        let leave = crosses.select(leave, back).max(leave_a).max(leave_b);
        Stretch { enter: enter + nearest, leave: leave + nearest, hit: crosses | hits_a | hits_b }
    }

    #[inline(always)]
    pub(super) fn intersect<S: Simd>(&self, simd: S, ray: Local<S, E>) -> (Mask<S, E>, Lanes<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let Stretch { enter, leave, hit } = self.stretch(simd, ray);
        let distance = enter.simd_gt(zero).select(enter, leave);
        (hit & distance.simd_gt(zero), distance)
    }

    /// Returns the hit of each ray.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Local<S, E>, distance: Lanes<S, E>) -> BodyHit<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let within = self.stretch(simd, ray).enter.simd_le(zero);
        let place = ray.direction.scale_add(distance, ray.origin);
        let z = place.z.max(zero).min(splat::<S, E>(simd, self.height));
        let normal = Vec3::<S, E>::new(place.x, place.y, place.z - z).normalize(simd);
        let radius = splat::<S, E>(simd, self.radius);
        let point =
            Vec3::<S, E>::new(normal.x * radius, normal.y * radius, normal.z.fused_mul_add(radius, z));
        BodyHit { point, normal: normal.scale(within.select(zero - one, one)), within }
    }
}

/// A capsule along the last axis, from its end a at the frame's centre to its end b, `end`.
#[derive(Clone, Copy, Debug)]
pub(super) struct CapsuleForm {
    pub(super) radius: f64,
    pub(super) height: f64,
    end: DVec3,
}

impl CapsuleForm {
    pub(super) fn new(capsule: &rayfold_scene::Capsule, place: Place) -> (Frame, Self) {
        let [a, b] = capsule.ends();
        // The difference of the ends is more accurate than their positions.
        let along = (b - a) * place.scale;
        let form =
            Self { radius: place.scale * capsule.radius(), height: along.length(), end: place.point(b) };
        (Frame::round_about(along.normalize_or(DVec3::Z), place.point(a)), form)
    }
}

impl Form for CapsuleForm {
    fn size(&self) -> f64 {
        self.height + self.radius
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface)) {
        let &Frame { axes: [.., axis], center } = frame;
        let &Self { radius, height, end } = self;
        each(Surface::Ball { center, radius });
        if height > 0.0 {
            each(Surface::Ball { center: end, radius });
            each(Surface::Side(Side { end: center, axis, height, radii: [radius; 2] }));
        }
    }

    fn is_near(&self, place: DVec3, near: f64, _: bool) -> bool {
        let over = place.z - place.z.clamp(0.0, self.height);
        (libm::hypot(libm::hypot(place.x, place.y), over) - self.radius).abs() <= near
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (0.5 * (frame.center + self.end), self.radius + 0.5 * self.height)
    }

    fn bounds(&self, frame: &Frame) -> Option<Bounds> {
        let (a, b) = (frame.center, self.end);
        Some((a.min(b) - self.radius, a.max(b) + self.radius))
    }

    fn hollow(&self, frame: &Frame) -> Option<Hollow> {
        Some((self.ball(frame).0, self.radius))
    }
}
