//! Cones and cylinders: round about an axis, straight from end to end and closed by caps.
//!
//! With ρ the distance from the axis and r(z) = Ra + k·z the radius at the height z, the side is where ρ² - r² is 0. The
//! body is convex: all that a ray has of it is one stretch, from the latest place where it enters the side or the slab of
//! the caps to the first where it leaves them.
//!
//! A ray is followed from its place that is nearest to the end a, so that the numbers of the side are no larger than the
//! body; along A·t² + 2·B·t + C the discriminant is n² - x², with n = r·s - k·dz·ρ⃗, x = ρ⃗ × s and s the part of the
//! direction that is square to the axis. Errors are then some roundoffs of the body's size aside, far less than what a new
//! ray starts off the surface by. (Products of sum and difference would take roots, whose rounding is as large as that of the
//! squares.)

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::{Local, Met};
use crate::fast::real::{Lanes, Mask, Real, Vec3, constant, splat};

/// Rounding errors of where a ray meets the side or a cap, in roundoffs of the body's size and of the distance: edges
/// belong to the body.
const EDGE: f64 = 8.0;

/// From the end a at the origin along z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone<E> {
    radii: [E; 2],
    /// How much the radius changes for a unit of height.
    slope: E,
    height: E,
    /// The largest of these lengths.
    size: E,
}

/// The stretch of rays in the body.
struct Stretch<S: Simd, E: Real> {
    enter: Lanes<S, E>,
    leave: Lanes<S, E>,
    hit: Mask<S, E>,
    /// Whether it begins and ends at the side.
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

    /// `over` is how high over the end b the ray starts.
    #[inline(always)]
    fn stretch<S: Simd>(&self, simd: S, ray: Local<S, E>, over: Lanes<S, E>) -> Stretch<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let (far, back) = (constant::<S, E>(simd, E::FAR), constant::<S, E>(simd, -E::FAR));
        let Local { origin, direction } = ray;
        let nearest = zero - origin.dot(direction);
        let place = direction.scale_add(nearest, origin);
        let slope = splat::<S, E>(simd, self.slope);
        let radius = slope.mul_add(place.z, splat::<S, E>(simd, self.radii[0]));
        let growth = slope * direction.z;
        let a = direction.x.mul_add(direction.x, direction.y * direction.y) - growth * growth;
        let b = place.x.mul_add(direction.x, place.y * direction.y) - radius * growth;
        let c = place.x.mul_add(place.x, place.y * place.y) - radius * radius;
        let nx = radius.mul_sub(direction.x, growth * place.x);
        let ny = radius.mul_sub(direction.y, growth * place.y);
        let x = place.x.mul_sub(direction.y, place.y * direction.x);
        let discriminant = nx.mul_add(nx, ny * ny) - x * x;
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
        // The caps.
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
    pub(super) fn meet<S: Simd>(
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

    /// On a rim it is that of the side. A tip has no direction of its own: it is taken from where the ray comes from.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(
        &self,
        simd: S,
        ray: Local<S, E>,
        over: Lanes<S, E>,
        distance: Lanes<S, E>,
    ) -> Met<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let Stretch { enter, enters_side, leaves_side, .. } = self.stretch(simd, ray, over);
        let within = enter.simd_le(zero);
        let is_side = (within & leaves_side) | (!within & enters_side);
        let place = ray.direction.scale_add(distance, ray.origin);
        let forwards = ray.direction.z.simd_gt(zero);
        // The caps are left upwards at b, and entered upwards at a.
        let is_b = !(within ^ forwards);
        let height = splat::<S, E>(simd, self.height);
        let cap = is_b.select(height, zero);
        let z = is_side.select(place.z.max(zero).min(height), cap);

        let apart = place.x.mul_add(place.x, place.y * place.y).sqrt();
        let is_tip = apart.simd_eq(zero);
        let spread = ray.direction.x.mul_add(ray.direction.x, ray.direction.y * ray.direction.y).sqrt();
        let length = is_tip.select(spread, apart);
        let inverse = length.simd_gt(zero).select(one / length, zero);
        let x = is_tip.select(zero - ray.direction.x, place.x) * inverse;
        let y = is_tip.select(zero - ray.direction.y, place.y) * inverse;
        let slope = splat::<S, E>(simd, self.slope);
        let [at_a, at_b] = self.radii;
        let (at_a, at_b) = (splat::<S, E>(simd, at_a), splat::<S, E>(simd, at_b));
        let rim = is_b.select(at_b, at_a);
        let radius = is_side.select(slope.mul_add(z, at_a), apart.min(rim));
        let up = is_b.select(one, zero - one);
        let normal = Vec3::<S, E>::new(
            is_side.select(x, zero),
            is_side.select(y, zero),
            is_side.select(zero - slope, up),
        );
        let normal = normal.normalize(simd);
        let side = within.select(zero - one, one);
        Met { point: Vec3::<S, E>::new(x * radius, y * radius, z), normal: normal.scale(side), within }
    }
}
