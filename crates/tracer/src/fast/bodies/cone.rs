//! Cones and cylinders: rotationally symmetric about an axis, with straight sides, closed by caps.
//!
//! Let ρ be the distance from the axis and r(z) = Ra + k·z the radius at the height z. The side is the surface where ρ²
//! = r². The body is convex, so a ray has one interval in it: from the last place where it enters the side or the slab
//! of the caps to the first place where it leaves them.
//!
//! The ray's parameter is counted from its point nearest to the end a, so that the numbers of the side are no larger
//! than the body. The quadratic is `A·t² + 2·B·t + C`. Its discriminant is `n² - x²`, with `n = r·s - k·dz·ρ⃗`, `x = ρ⃗
//! × s`, and s the part of the direction perpendicular to the axis. So the errors across the ray are a few roundoffs of
//! the body's size, far less than the offset of a new ray from the surface. (Products of sum and difference would need
//! square roots, whose rounding errors are as large as those of the squares.)

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::model::unit;

use super::solid::{Form, Frame, Place, Span, flat};
use super::{BodyHit, Local};
use crate::fast::acceleration::hollow::Hollow;
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::bounds::Bounds;
use crate::fast::shared::{Plain, Side, Surface};

/// The rounding error of a hit on the side or a cap, in roundoffs of the body's size and of the distance. Edges belong
/// to the body.
const EDGE: f64 = 8.0;

/// A cone or cylinder with its end a at the origin, along z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone<E> {
    radii: [E; 2],
    /// The change of the radius per unit of height.
    slope: E,
    height: E,
    /// The largest of these lengths.
    size: E,
}

/// The interval of each ray in the body.
struct Stretch<S: Simd, E: Real> {
    enter: Lanes<S, E>,
    leave: Lanes<S, E>,
    hit: Mask<S, E>,
    /// Whether the interval begins and ends at the side.
    enters_side: Mask<S, E>,
    leaves_side: Mask<S, E>,
}

impl<E: Real> Cone<E> {
    pub(super) fn new(radii: [f64; 2], height: f64) -> Self {
        Self {
            radii: radii.map(E::narrow),
            slope: E::narrow((radii[1] - radii[0]) / height),
            height: E::narrow(height),
            size: E::narrow(height.max(radii[0]).max(radii[1])),
        }
    }

    /// Returns the interval of each ray in the body. `over` is the height of the ray's start above the end b.
    #[inline(always)]
    fn stretch<S: Simd>(&self, simd: S, ray: Local<S, E>, over: Lanes<S, E>) -> Stretch<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let (far, back) = (constant::<S, E>(simd, E::FAR), constant::<S, E>(simd, -E::FAR));
        let Local { origin, direction } = ray;
        let nearest = zero - origin.dot(direction);
        let place = direction.scale_add(nearest, origin);
        let slope = splat::<S, E>(simd, self.slope);
        let radius = slope.fused_mul_add(place.z, splat::<S, E>(simd, self.radii[0]));
        let growth = slope * direction.z;
        let a = direction.x.fused_mul_add(direction.x, direction.y * direction.y) - growth * growth;
        let b = place.x.fused_mul_add(direction.x, place.y * direction.y) - radius * growth;
        let c = place.x.fused_mul_add(place.x, place.y * place.y) - radius * radius;
        let nx = radius.fused_mul_sub(direction.x, growth * place.x);
        let ny = radius.fused_mul_sub(direction.y, growth * place.y);
        let x = place.x.fused_mul_sub(direction.y, place.y * direction.x);
        let discriminant = nx.fused_mul_add(nx, ny * ny) - x * x;
        let widens = a.simd_gt(zero);
        let misses = widens & discriminant.simd_lt(zero);
        // Neither root subtracts numbers of the same sign.
        let root = discriminant.max(zero).sqrt();
        let q = zero - b.simd_lt(zero).select(b - root, b + root);
        let still = a.simd_eq(zero) & b.simd_eq(zero);
        let one_root = q / a;
        let other = q.simd_eq(zero).select(zero, c / q);
        let (first, last) = (one_root.min(other) + nearest, one_root.max(other) + nearest);
        let narrows = a.simd_lt(zero);
        let grows = growth.simd_gt(zero);
        let enter = (narrows & grows).select(last, (narrows & !grows).select(back, first));
        let leave = (narrows & grows).select(far, (narrows & !grows).select(first, last));
        let outside = still & c.simd_gt(zero);
        let enter = still.select(back, enter).max(back);
        let leave = still.select(far, leave).min(far);
        // The interval in the slab of the caps.
        let is_along = direction.z.simd_eq(zero);
        let inverse = one / direction.z;
        let (at_a, at_b) = ((zero - origin.z) * inverse, (zero - over) * inverse);
        let between = origin.z.simd_ge(zero) & over.simd_le(zero);
        let low = is_along.select(between.select(back, far), at_a.min(at_b));
        let high = is_along.select(between.select(far, back), at_a.max(at_b));
        let along_side = still & c.simd_eq(zero);
        let enters_side = enter.simd_ge(low) | along_side;
        let leaves_side = leave.simd_le(high) | along_side;
        let (enter, leave) = (enter.max(low), leave.min(high));
        let slack =
            (leave.abs() + splat::<S, E>(simd, self.size)) * constant::<S, E>(simd, EDGE * E::ROUNDOFF);
        let hit = enter.simd_le(leave + slack) & !misses & !outside;
        Stretch { enter, leave, hit, enters_side, leaves_side }
    }

    #[inline(always)]
    pub(super) fn intersect<S: Simd>(
        &self,
        simd: S,
        ray: Local<S, E>,
        over: Lanes<S, E>,
    ) -> (Mask<S, E>, Lanes<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let Stretch { enter, leave, hit, .. } = self.stretch(simd, ray, over);
        let distance = enter.simd_gt(zero).select(enter, leave);
        (hit & distance.simd_gt(zero), distance)
    }

    /// Returns the hit of each ray. On a rim the normal is that of the side. At a tip, which has no normal, the normal
    /// points back along the ray.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(
        &self,
        simd: S,
        ray: Local<S, E>,
        over: Lanes<S, E>,
        distance: Lanes<S, E>,
    ) -> BodyHit<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let Stretch { enter, enters_side, leaves_side, .. } = self.stretch(simd, ray, over);
        let within = enter.simd_le(zero);
        let is_side = (within & leaves_side) | (!within & enters_side);
        let place = ray.direction.scale_add(distance, ray.origin);
        let forwards = ray.direction.z.simd_gt(zero);
        // A ray that goes up leaves through the cap at b and enters through the cap at a.
        let is_b = !(within ^ forwards);
        let height = splat::<S, E>(simd, self.height);
        let cap = is_b.select(height, zero);
        let z = is_side.select(place.z.max(zero).min(height), cap);

        let apart = place.x.fused_mul_add(place.x, place.y * place.y).sqrt();
        let is_tip = apart.simd_eq(zero);
        let spread = ray.direction.x.fused_mul_add(ray.direction.x, ray.direction.y * ray.direction.y).sqrt();
        let length = is_tip.select(spread, apart);
        let inverse = length.simd_gt(zero).select(one / length, zero);
        let x = is_tip.select(zero - ray.direction.x, place.x) * inverse;
        let y = is_tip.select(zero - ray.direction.y, place.y) * inverse;
        let slope = splat::<S, E>(simd, self.slope);
        let [at_a, at_b] = self.radii;
        let (at_a, at_b) = (splat::<S, E>(simd, at_a), splat::<S, E>(simd, at_b));
        let rim = is_b.select(at_b, at_a);
        let radius = is_side.select(slope.fused_mul_add(z, at_a), apart.min(rim));
        let up = is_b.select(one, zero - one);
        let normal = Vec3::<S, E>::new(
            is_side.select(x, zero),
            is_side.select(y, zero),
            is_side.select(zero - slope, up),
        );
        let normal = normal.normalize(simd);
        let side = within.select(zero - one, one);
        BodyHit { point: Vec3::<S, E>::new(x * radius, y * radius, z), normal: normal.scale(side), within }
    }
}

/// A cone or cylinder along the last axis, from its end a at the frame's centre to its end b, `end`.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConeForm {
    pub(super) radii: [f64; 2],
    pub(super) height: f64,
    pub(super) end: DVec3,
}

impl ConeForm {
    pub(super) fn new(radii: [f64; 2], [a, b]: [DVec3; 2], place: Place) -> (Frame, Self) {
        // The difference of the ends is more accurate than their positions.
        let along = (b - a) * place.scale;
        let radii = radii.map(|radius| place.scale * radius);
        let form = Self { radii, height: along.length(), end: place.point(b) };
        (Frame::round_about(unit(along), place.point(a)), form)
    }
}

impl Form for ConeForm {
    fn size(&self) -> f64 {
        self.height + self.radii[0].max(self.radii[1])
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface)) {
        let &Frame { axes: [.., axis], center } = frame;
        let &Self { radii, height, end } = self;
        for (center, radius) in [center, end].into_iter().zip(radii) {
            if radius > 0.0 {
                each(flat(axis, center, radius, Plain::ByAxis));
            }
        }
        each(Surface::Side(Side { end: center, axis, height, radii }));
    }

    fn is_near(&self, place: DVec3, near: f64, _: bool) -> bool {
        let &Self { radii: [a, b], height, .. } = self;
        let (z, aside) = (place.z, libm::hypot(place.x, place.y));
        let radius = a + (b - a) * (z / height).clamp(0.0, 1.0);
        let ends = z.abs().min((z - height).abs());
        let within = z >= -near && z <= height + near;
        let slope = 1.0 + (b - a).abs() / height;
        within && ((aside - radius).abs() <= near * slope || ends <= near && aside <= radius + near)
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        let radius = libm::hypot(self.radii[0].max(self.radii[1]), 0.5 * self.height);
        (0.5 * (frame.center + self.end), radius)
    }

    fn bounds(&self, frame: &Frame) -> Option<Bounds> {
        let (circle, center) = (frame.circle(), frame.center);
        let [a, b] = self.radii.map(|radius| radius * circle);
        Some(((center - a).min(self.end - b), (center + a).max(self.end + b)))
    }

    fn slab(&self, frame: &Frame) -> Option<Span> {
        Some(Span::across(frame, 0.5 * self.height, 0.0))
    }

    fn hollow(&self, frame: &Frame) -> Option<Hollow> {
        let ([a, b], height) = (self.radii, self.height);
        let side = 0.5 * (a + b) * height / libm::hypot(height, b - a);
        Some((0.5 * (frame.center + self.end), side.min(0.5 * height)))
    }
}
