//! Culling for a queue of rays: a cone around all of them, and the objects that it reaches.
//!
//! Rays that were reflected or refracted alike start near each other and have similar directions. A sphere around their
//! origins, and the smallest cosine between them and their mean direction, define a cone with a blunt tip. No ray hits
//! an object whose bounding sphere the cone does not reach. This holds with rounding errors included, so no picture
//! depends on which rays share a queue.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant};
use crate::fast::rays::bounce::RayBatch;
use crate::fast::rays::bounds::Bounds;

/// The bounding spheres of objects; each object has one bit of a mask.
#[derive(Debug)]
pub(crate) struct BoundingSpheres(Vec<(DVec3, f64)>);

/// A cone around rays.
#[derive(Debug)]
struct Cone {
    /// The sphere that contains the ray origins.
    center: DVec3,
    radius: f64,
    /// The axis, of length 1.
    axis: DVec3,
    /// The cosine of the largest angle between the axis and a ray.
    cosine: f64,
    /// The relative error of the kernel's results from these coordinates.
    error: f64,
}

impl BoundingSpheres {
    /// Makes the bounding spheres of boxes. There are at most as many boxes as a mask has bits.
    pub(crate) fn new(boxes: impl Iterator<Item = Bounds>) -> Self {
        Self(boxes.map(|(low, high)| (0.5 * (low + high), 0.5 * low.distance(high))).collect())
    }

    /// Returns the objects that a ray of the queue can hit, as bits. The queue must be filled up to whole packets.
    #[inline(always)]
    pub(crate) fn met_by<S: Simd, E: Real>(&self, simd: S, queue: &RayBatch<E>) -> u64 {
        // A single object is tested as fast as it is culled.
        if self.0.len() < 2 {
            return u64::MAX;
        }
        match Cone::around(simd, queue) {
            Some(cone) => cone.reaches(&self.0),
            None => u64::MAX,
        }
    }
}

impl Cone {
    /// Returns the cone around a queue's rays, or `None` if they diverge too much.
    #[inline(always)]
    fn around<S: Simd, E: Real>(simd: S, queue: &RayBatch<E>) -> Option<Self> {
        let (far, near) = (constant::<S, E>(simd, E::FAR), constant::<S, E>(simd, -E::FAR));
        let mut low = Vec3::<S, E>::new(far, far, far);
        let mut high = Vec3::<S, E>::new(near, near, near);
        let mut sum = Vec3::<S, E>::zero(simd);
        let one = constant::<S, E>(simd, 1.0);
        let packets = || (0..queue.count).step_by(Lanes::<S, E>::LEN);
        for at in packets() {
            let Vec3 { x, y, z } = Vec3::<S, E>::load(simd, &queue.origin, at);
            low = Vec3::<S, E>::new(low.x.min(x), low.y.min(y), low.z.min(z));
            high = Vec3::<S, E>::new(high.x.max(x), high.y.max(y), high.z.max(z));
            sum = Vec3::load(simd, &queue.direction, at).scale_add(one, sum);
        }
        let mean = DVec3::new(total::<S, E>(sum.x), total::<S, E>(sum.y), total::<S, E>(sum.z));
        let axis = mean.normalize_or_zero();
        let along = Vec3::splat(simd, axis.to_array().map(E::narrow));
        let mut least = one;
        for at in packets() {
            least = least.min(Vec3::<S, E>::load(simd, &queue.direction, at).dot(along));
        }
        let error = 1024.0 * E::ROUNDOFF;
        let cosine = least.reduce_min().widen() - error;
        let low =
            DVec3::new(low.x.reduce_min().widen(), low.y.reduce_min().widen(), low.z.reduce_min().widen());
        let high =
            DVec3::new(high.x.reduce_max().widen(), high.y.reduce_max().widen(), high.z.reduce_max().widen());
        let (center, radius) = (0.5 * (low + high), 0.5 * low.distance(high));
        (cosine > 0.0 && radius.is_finite()).then_some(Self { center, radius, axis, cosine, error })
    }

    /// Returns the spheres that the cone reaches, as bits.
    ///
    /// Let a ray start within a sphere of radius s. It hits a sphere of radius r only if the parallel ray from the
    /// first centre comes as near as r + s to the second. Then the angle between that ray and the line of centres is at
    /// most the one whose sine is (r + s)/distance.
    fn reaches(&self, balls: &[(DVec3, f64)]) -> u64 {
        let sine = (1.0 - self.cosine * self.cosine).max(0.0).sqrt();
        let mut bits = 0;
        for (bit, &(center, radius)) in balls.iter().enumerate() {
            let way = center - self.center;
            let distance = way.length();
            let size = center.length() + self.center.length() + radius + self.radius;
            let reach = radius + self.radius + self.error * size;
            let is_reached = distance <= reach || {
                let across = reach / distance;
                let least = self.cosine * (1.0 - across * across).sqrt() - sine * across;
                // For a cosine near 1 the angle is inaccurate.
                way.dot(self.axis) >= (least - 1e-9) * distance
            };
            bits |= u64::from(is_reached) << bit;
        }
        bits
    }
}

/// Returns the sum of the lanes.
#[inline(always)]
fn total<S: Simd, E: Real>(lanes: Lanes<S, E>) -> f64 {
    let mut numbers = [E::narrow(0.0); 16];
    lanes.store_slice(&mut numbers[..Lanes::<S, E>::LEN]);
    let mut total = 0.0;
    for number in numbers {
        total += number.widen();
    }
    total
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    /// A generator of numbers between -1 and 1, the same on every run.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn point(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }
    }

    /// Returns the smallest distance between a ray and a point.
    fn nearness(origin: DVec3, direction: DVec3, point: DVec3) -> f64 {
        let way = point - origin;
        way.distance(direction * way.dot(direction).max(0.0))
    }

    #[test]
    fn all_that_a_ray_meets_is_reached_and_much_else_is_not() {
        let mut numbers = Numbers(20_261_123);
        let (mut left_out, mut all) = (0, 0);
        for round in 0..400 {
            let (start, way) = (numbers.point(), numbers.point());
            let [wide, apart] = [0.3, 0.02].map(|most| most * f64::from(round % 7) / 6.0);
            let mut queue = RayBatch::<f64>::new();
            queue.count = 1 + round as usize % 40;
            let mut rays = vec![];
            for at in 0..queue.count {
                let origin = start + apart * numbers.point();
                let direction = (way.normalize_or(DVec3::X) + wide * numbers.point()).normalize();
                for axis in 0..3 {
                    queue.origin[axis].0[at] = origin[axis];
                    queue.direction[axis].0[at] = direction[axis];
                }
                rays.push((origin, direction));
            }
            queue.fill_up(16);
            let balls: Vec<_> =
                (0..64).map(|_| (numbers.point(), 0.2 * numbers.next().abs().powi(3))).collect();
            let bits = dispatch!(Level::new(), simd => BoundingSpheres(balls.clone()).met_by(simd, &queue));
            for (bit, &(center, radius)) in balls.iter().enumerate() {
                let is_met = rays.iter().any(|&(origin, way)| nearness(origin, way, center) <= radius);
                assert!(!is_met || bits >> bit & 1 != 0, "round {round}, ball {bit}");
            }
            left_out += bits.count_zeros();
            all += 64;
        }
        assert!(left_out > all / 2, "{left_out} of {all}");
    }

    #[test]
    fn rays_that_go_apart_may_meet_anything() {
        let mut queue = RayBatch::<f64>::new();
        queue.count = 2;
        (queue.direction[0].0[0], queue.direction[0].0[1]) = (1.0, -1.0);
        queue.fill_up(16);
        let balls = BoundingSpheres(vec![(DVec3::Y, 0.1), (DVec3::Z, 0.1)]);
        assert_eq!(dispatch!(Level::new(), simd => balls.met_by(simd, &queue)), u64::MAX);
    }
}
