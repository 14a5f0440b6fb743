//! Boxes with round edges: all points within a radius of a smaller box, the core.
//!
//! Along a ray, the square of the distance from the core is a convex function of the ray's parameter. It consists of at
//! most seven parabolas, which meet with equal slopes where the ray enters and leaves the slabs of the core. The ray
//! enters the body in the last parabola that begins outside and descends. So faces, edges and corners need no tests of
//! their own, and there is no seam between them. The exit of a ray is the entry of the reversed ray.
//!
//! Lengths are in units of the body, scaled by a power of two, and a distant origin is first moved near the body along
//! the ray, as for frusta. So the errors across the ray are some roundoffs of the body's size.

use glam::DVec3;
use rayfold_scene::Roundbox;
use rayfold_scene::model::unit;

use super::cuboid::largest;
use super::double_double::{DoubleDouble, Place, between};
use super::frustum::CAP;
use super::{ROUNDOFF, Shape, Sides, Surface, nearer, sign};
use crate::camera::Ray;
use crate::scale::below_inverse;

/// The distance, in sizes of the body, beyond which an origin is moved near it.
const FAR: f64 = 8.0;

/// The radius, relative to the body's size, below which edges are sharp for all rounding errors. They are drawn with
/// this radius, so that no ray passes through them.
const SHARP: f64 = 1.0 / (1u64 << 46) as f64;

/// A place where a line meets the surface: its parameter, and the vector there from the nearest point of the core.
#[derive(Clone, Copy)]
struct Crossing {
    at: f64,
    from_core: DVec3,
}

/// The core relative to a place on the line, and the radius around it.
struct Core {
    low: DVec3,
    high: DVec3,
    radius: f64,
}

/// Returns the scale that brings the body's size near 1.
fn size(roundbox: &Roundbox) -> f64 {
    below_inverse((roundbox.max() - roundbox.min()).max_element())
}

/// Returns d² - r² for the distance d of a point from the core, in units of 1 / scale: positive outside, exactly 0 on
/// the surface. It has twice the precision, because the point may be on the surface.
fn outside(roundbox: &Roundbox, place: impl Into<Place>, scale: f64) -> f64 {
    let place = place.into();
    let radius = DoubleDouble::from(roundbox.radius() * scale);
    let (above_low, above_high) =
        (between(place, roundbox.min(), scale), between(place, roundbox.max(), scale));
    let mut square = DoubleDouble::from(0.0);
    for axis in 0..3 {
        let (below, above) = (radius - above_low[axis], radius + above_high[axis]);
        let over = if below.value() > above.value() { below } else { above };
        if over.value() > 0.0 {
            square = square + over * over;
        }
    }
    let near = radius * radius;
    (square - near).beside(square.value() + near.value())
}

impl Core {
    /// Returns the vector from the core to the line, at `at` and just behind it, as a place and a direction. Both are 0
    /// along axes on which the line is within the core's slab.
    fn beside(&self, direction: DVec3, at: f64) -> (DVec3, DVec3) {
        let (mut from, mut along) = (DVec3::ZERO, DVec3::ZERO);
        for axis in 0..3 {
            let (low, high, d) = (self.low[axis], self.high[axis], direction[axis]);
            if d == 0.0 {
                from[axis] = -0f64.clamp(low, high);
                continue;
            }
            let (first, last) = if d > 0.0 { (low, high) } else { (high, low) };
            if at < first / d {
                (from[axis], along[axis]) = (-first, d);
            } else if at >= last / d {
                (from[axis], along[axis]) = (-last, d);
            }
        }
        (from, along)
    }

    /// Returns where a line enters.
    fn enter(&self, direction: DVec3) -> Option<Crossing> {
        let mut begin = f64::NEG_INFINITY;
        for axis in (0..3).filter(|&axis| direction[axis] != 0.0) {
            for at in [self.low[axis] / direction[axis], self.high[axis] / direction[axis]] {
                let (from, along) = self.beside(direction, at);
                let apart = from + at * along;
                if apart.length_squared() > self.radius * self.radius && apart.dot(along) < 0.0 {
                    begin = begin.max(at);
                }
            }
        }
        let (from, along) = self.beside(direction, begin);
        let square = along.length_squared();
        // As a cross product, because the squares of |from| cancel.
        let discriminant = self.radius * self.radius * square - from.cross(along).length_squared();
        if square == 0.0 || discriminant < 0.0 {
            return None;
        }
        let at = (-from.dot(along) - discriminant.sqrt()) / square;
        Some(Crossing { at, from_core: from + at * along })
    }
}

/// A hit: its distance, the vector there from the core, and whether the ray comes from within.
struct Met {
    distance: f64,
    from_core: DVec3,
    within: bool,
}

fn met(roundbox: &Roundbox, ray: Ray) -> Option<Met> {
    let (min, max, direction) = (roundbox.min(), roundbox.max(), ray.direction);
    let scale = size(roundbox);
    let sides = (max - min) * scale;
    let radius = (roundbox.radius() * scale).max(SHARP).min(0.5 * sides.min_element());
    let middle = 0.5 * (max - min) - (ray.origin - min);
    let is_far = middle.abs().max_element() * scale > FAR;
    let near = if is_far { middle.dot(direction) } else { 0.0 };
    let from_low = ((min - ray.origin) - near * direction) * scale;
    let core =
        Core { low: from_low + radius, high: (from_low + sides - radius).max(from_low + radius), radius };
    let enter = core.enter(direction)?;
    let leave = core.enter(-direction).map_or(enter, |back| Crossing { at: -back.at, ..back });
    let placed = |crossing: Crossing| near + crossing.at / scale;
    let (first, last) = (placed(enter), placed(leave));
    let side = if is_far { 1.0 } else { outside(roundbox, ray.origin, scale) };
    if side > 0.0 {
        // Both ends of the interval are on the same side of the origin.
        let distance = first.max(f64::MIN_POSITIVE);
        return (first + last > 0.0).then_some(Met { distance, from_core: enter.from_core, within: false });
    }
    (first + last > 0.0 || first < 0.0 && last > 0.0 && side < 0.0).then_some(Met {
        distance: last,
        from_core: leave.from_core,
        within: true,
    })
}

impl Shape for Roundbox {
    fn extent(&self, origin: DVec3) -> f64 {
        self.corners().iter().fold(origin.abs(), |m, v| m.max(v.abs())).max_element()
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        met(self, ray).map(|met| met.distance)
    }

    /// Returns the surface. The point has the rounding errors of its vector from the core, of the place on the ray, and of
    /// the clamping to the core: fewer than 16 roundoffs of the largest number.
    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let Some(Met { from_core, within, .. }) = met(self, ray) else {
            unreachable!("the ray hits the box at {distance}")
        };
        let (min, max, radius) = (self.min(), self.max(), self.radius());
        let outward = unit(from_core);
        let place = ray.origin + distance * ray.direction;
        // Rounding may have made the core empty along an axis.
        let core = place.max(min + radius).min((max - radius).max(min + radius));
        let mut point = (core + radius * outward).clamp(min, max);
        let flat = self.is_flat_at(outward);
        if flat {
            let axis = largest(outward);
            point[axis] = if outward[axis] > 0.0 { max[axis] } else { min[axis] };
        }
        Surface {
            point,
            normal: if within { -outward } else { outward },
            offset: 64.0 * ROUNDOFF * min.abs().max(max.abs()).max_element(),
            flat,
            within,
        }
    }

    fn sides(&self, place: Place) -> Sides {
        [sign(outside(self, place, size(self))), 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn is_flat_at(&self, normal: DVec3) -> bool {
        normal.abs().max_element() > CAP
    }

    fn face(&self, place: DVec3, normal: DVec3) -> Option<(usize, f64)> {
        let axis = largest(normal);
        Some((axis, nearer(axis, place, [self.min(), self.max()])))
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Camera, Capsule, Material, Object, Scene, Screen, Sphere};

    use super::*;
    use crate::RenderOptions;
    use crate::probe::nearest_hits;
    use crate::reference::shapes::{distance, surface};

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn roundbox(half: DVec3, radius: f64) -> Object {
        Roundbox::new([half, -half], radius, Material::default()).unwrap().into()
    }

    fn soap() -> Object {
        roundbox(DVec3::new(4.0, 3.0, 7.0), 2.0)
    }

    /// Random rays from around and within a body of half lengths about 1.
    fn random_rays(seed: u64, count: usize) -> Vec<Ray> {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut random = || DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        let ray = |_| {
            let (origin, target) = (3.0 * random(), 1.2 * random());
            Ray { origin, direction: (target - origin).normalize() }
        };
        (0..count).map(ray).collect()
    }

    /// The hits of the kernels: distances and normals.
    fn fast(object: &Object, rays: &[Ray]) -> Vec<Option<(f64, DVec3)>> {
        let mut scene = Scene::new(Screen::new(4, 3).unwrap(), Camera::Orthographic);
        scene.objects = vec![object.clone()].into();
        let rays: Vec<_> = rays.iter().map(|ray| (ray.origin, ray.direction)).collect();
        let hits = nearest_hits(&scene, &rays, &RenderOptions::default()).unwrap();
        hits.into_iter().map(|hit| hit.map(|hit| (hit.distance, hit.normal))).collect()
    }

    #[test]
    fn a_round_box_has_faces_edges_and_corners() {
        let hit = |origin, direction| {
            let ray = ray(origin, direction);
            distance(&soap(), ray).map(|t| (t, surface(&soap(), ray, t).normal))
        };
        let t = |origin, direction| hit(origin, direction).map(|hit| hit.0);
        assert_eq!(hit([9.0, 0.5, 2.0], [-1.0, 0.0, 0.0]), Some((5.0, DVec3::X)));
        assert_eq!(hit([9.0, 1.0, 5.0], [-1.0, 0.0, 0.0]), Some((5.0, DVec3::X)), "at a seam");
        assert_eq!(hit([0.0; 3], [0.0, 0.0, 1.0]), Some((7.0, DVec3::NEG_Z)), "from within");
        assert_eq!(t([9.0, 3.0, 0.0], [-1.0, 0.0, 0.0]), Some(7.0), "a tangent");
        assert_eq!(t([9.0, 3.000_000_000_000_1, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(t([4.0, 0.0, 0.0], [1.0, 0.0, 0.0]), None, "from a face");
        assert_eq!(t([4.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some(8.0), "from a face inwards");
        let (at, normal) = hit([9.0, 2.2, 0.0], [-1.0, 0.0, 0.0]).unwrap();
        assert!(
            (at - 5.4).abs() < 1e-14 && normal.distance(DVec3::new(0.8, 0.6, 0.0)) < 1e-14,
            "{at} {normal}"
        );
        // 1² + 1² + √2² = 2².
        let (at, normal) = hit([3.0, 2.0, 19.0], [0.0, 0.0, -1.0]).unwrap();
        let expected = DVec3::new(0.5, 0.5, 0.5f64.sqrt());
        assert!(
            (at - 14.0 + 2f64.sqrt()).abs() < 1e-14 && normal.distance(expected) < 1e-14,
            "{at} {normal}"
        );
        assert_eq!(t([3.9, 2.9, 19.0], [0.0, 0.0, -1.0]), None, "past a corner");
    }

    /// The signed distance of a point from the surface.
    fn signed(point: DVec3, half: DVec3, radius: f64) -> f64 {
        let beside = point.abs() - (half - radius);
        beside.max(DVec3::ZERO).length() + beside.max_element().min(0.0) - radius
    }

    /// Marches along a ray by the distance from the surface. Returns the place at which it comes within `near`, and the
    /// least distance.
    fn march(ray: Ray, half: DVec3, radius: f64, near: f64) -> (Option<f64>, f64) {
        let side = signed(ray.origin, half, radius).signum();
        let (mut at, mut least) = (0.0, f64::INFINITY);
        for _ in 0..100_000 {
            let apart = side * signed(ray.origin + at * ray.direction, half, radius);
            least = least.min(apart);
            if apart < near {
                return (Some(at), least);
            }
            at += apart;
            if at > 20.0 {
                break;
            }
        }
        (None, least)
    }

    #[test]
    fn rays_meet_what_a_march_by_distances_meets() {
        for (seed, half, radius) in [
            (1, DVec3::new(1.0, 0.7, 0.4), 0.2),
            (2, DVec3::new(1.0, 0.7, 0.4), 0.4),
            (3, DVec3::splat(0.8), 0.8),
            (4, DVec3::new(0.9, 0.3, 0.3), 0.3),
            (5, DVec3::new(1.0, 0.01, 0.8), 0.01),
            (6, DVec3::new(0.6, 0.9, 0.7), 1e-3),
        ] {
            let (object, rays) = (roundbox(half, radius), random_rays(seed, 4000));
            let fast = fast(&object, &rays);
            let mut hits = 0;
            for (ray, fast) in rays.iter().zip(fast) {
                let (marched, least) = march(*ray, half, radius, 1e-9);
                let exact = distance(&object, *ray);
                if !(1e-9..=1e-6).contains(&least) {
                    assert_eq!(exact.is_some(), marched.is_some(), "{ray:?} {half} {radius}");
                }
                assert_eq!(fast.is_some(), exact.is_some(), "{ray:?} {half} {radius}");
                let (Some(t), Some(marched), Some((at, normal))) = (exact, marched, fast) else { continue };
                hits += 1;
                let met = surface(&object, *ray, t);
                // A march stops early where it comes near at a slight angle.
                assert!(marched <= t + 1e-9 && t - marched < 1e-3, "{t} {marched} {ray:?}");
                assert!(signed(ray.origin + t * ray.direction, half, radius).abs() < 1e-13);
                assert!(signed(met.point, half, radius).abs() < 1e-14);
                assert!((at - t).abs() * met.normal.dot(ray.direction).abs() < 1e-12, "{at} {t} {ray:?}");
                assert!(normal.distance(met.normal) < 1e-12 / radius, "{normal} {} {ray:?}", met.normal);
            }
            assert!(hits > 400, "{hits}");
        }
    }

    #[test]
    fn with_half_of_its_sides_it_is_a_ball_or_a_capsule() {
        let ball = Sphere::new(0.8, DVec3::ZERO, Material::default()).unwrap().into();
        let ends = [DVec3::new(-0.6, 0.0, 0.0), DVec3::new(0.6, 0.0, 0.0)];
        let pill = Capsule::new(0.4, ends, Material::default()).unwrap().into();
        for (round, other) in
            [(roundbox(DVec3::splat(0.8), 0.8), ball), (roundbox(DVec3::new(1.0, 0.4, 0.4), 0.4), pill)]
        {
            let rays = random_rays(7, 4000);
            for (ray, fast) in rays.iter().zip(fast(&round, &rays)) {
                let (a, b) = (distance(&round, *ray), distance(&other, *ray));
                assert_eq!(a.is_some(), b.is_some(), "{ray:?}");
                assert_eq!(a.is_some(), fast.is_some(), "{ray:?}");
                if let (Some(a), Some(b)) = (a, b) {
                    let normals = [(&round, a), (&other, b)].map(|(o, t)| surface(o, *ray, t).normal);
                    let slant = normals[1].dot(ray.direction).abs();
                    assert!((a - b).abs() * slant < 1e-14, "{a} {b} {ray:?}");
                    assert!(normals[0].distance(normals[1]) * slant < 1e-14, "{normals:?} {ray:?}");
                }
            }
        }
    }

    #[test]
    fn the_normal_has_no_step_at_a_seam() {
        let (half, radius) = (DVec3::new(1.0, 0.7, 0.4), 0.2);
        let object = roundbox(half, radius);
        // Across a face, its two edges and beyond: the normal turns by what the surface bends.
        let rays: Vec<Ray> = (0..=20_000)
            .map(|k| {
                let x = -1.0 + 1e-4 * f64::from(k);
                Ray { origin: DVec3::new(x, 0.37 * x, 9.0), direction: DVec3::NEG_Z }
            })
            .collect();
        let fast = fast(&object, &rays);
        let normals = |k: usize| distance(&object, rays[k]).map(|t| surface(&object, rays[k], t).normal);
        for k in 1..rays.len() {
            for (a, b) in
                [(normals(k - 1), normals(k)), (fast[k - 1].map(|hit| hit.1), fast[k].map(|hit| hit.1))]
            {
                let (Some(a), Some(b)) = (a, b) else { continue };
                // Near the outline it turns as the root of the distance from there.
                let most = if a.z.min(b.z) > 0.1 { 1.07e-4 / radius / a.z.min(b.z) } else { 0.2 };
                assert!(a.distance(b) <= 1.1 * most, "{a} {b} at {}", rays[k].origin);
            }
        }
        assert!((0..rays.len()).filter(|&k| fast[k].is_some()).count() > 19_000);
    }

    #[test]
    fn no_ray_passes_through_an_edge_that_is_hardly_round() {
        for radius in [1e-3, 1e-9, 1e-14, 1e-16, 1e-40, 1e-300] {
            let half = DVec3::new(1.0, 0.75, 0.5);
            let object = roundbox(half, radius);
            let mut rng = fastrand::Rng::with_seed(9);
            // At edges, and into corners.
            let rays: Vec<Ray> = (0..3000)
                .map(|k| {
                    let mut place =
                        half * DVec3::new(2.0 * rng.f64() - 1.0, 1.0, if k % 2 == 0 { -1.0 } else { 1.0 });
                    if k % 5 == 0 {
                        place.x = 1.0;
                    }
                    let inwards = -(0.05 + DVec3::new(rng.f64(), rng.f64(), rng.f64())) * place.signum();
                    let direction = inwards.normalize();
                    let inner = place + 1.0 * radius.max(1e-13) * inwards.signum();
                    Ray { origin: inner - 4.0 * direction, direction }
                })
                .collect();
            for (ray, fast) in rays.iter().zip(fast(&object, &rays)) {
                let t = distance(&object, *ray).unwrap_or_else(|| panic!("{ray:?} {radius}"));
                assert!((t - 4.0).abs() < 1e-11 + 60.0 * radius, "{t} {ray:?} {radius}");
                let normal = surface(&object, *ray, t).normal;
                assert!((normal.length() - 1.0).abs() < 1e-14 && normal.dot(ray.direction) < 0.0, "{normal}");
                let (at, normal) = fast.unwrap_or_else(|| panic!("{ray:?} {radius} by the kernels"));
                assert!(
                    (at - t).abs() < 1e-12 + 60.0 * radius && (normal.length() - 1.0).abs() < 1e-14,
                    "{at} {t}"
                );
            }
        }
    }

    #[test]
    fn a_far_eye_and_a_power_of_two_change_nothing() {
        let near = ray([2.5, 6.0, 1.5], [-2.25, -5.25, -1.375]);
        let expected = distance(&soap(), near).unwrap();
        for exponent in [-700, -90, -1, 1, 90, 700] {
            let scale = 2f64.powi(exponent);
            let placed = soap().placed(scale, |p| scale * p).unwrap();
            let r = Ray { origin: near.origin * scale, ..near };
            assert_eq!(distance(&placed, r), Some(expected * scale), "2^{exponent}");
        }
        for far in [1e3, 1e9, 1e15] {
            let r = Ray { origin: near.origin - far * near.direction, ..near };
            let t = distance(&soap(), r).unwrap() - far;
            assert!((t - expected).abs() <= 4.0 * f64::EPSILON * far, "{t} from {far:e}");
        }
    }

    #[test]
    fn what_leaves_the_surface_does_not_meet_it_again() {
        let mut rng = fastrand::Rng::with_seed(41);
        let mut random = || DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        for round in 0..20_000 {
            let (center, half) = (10.0 * random(), 0.1 + 3.0 * random().abs());
            let radius = [1.0, 1e-9, 0.5, random().x.abs()][round % 4] * half.min_element();
            let object = Roundbox::new([center - half, center + half], radius, Material::default());
            let object = object.unwrap().into();
            let (origin, target) = (20.0 * random(), center + half * random());
            let r = Ray { origin, direction: (target - origin).normalize() };
            let Some(t) = distance(&object, r) else { continue };
            let s = surface(&object, r, t);
            assert!(s.normal.dot(r.direction) < 1e-7);
            let start = s.point + s.offset * s.normal;
            let again = distance(&object, Ray { origin: start, direction: s.normal });
            assert!(again.is_none() != s.within, "round {round}");
            let through =
                distance(&object, Ray { origin: s.point - s.offset * s.normal, direction: r.direction });
            assert!(s.within || through.is_some(), "round {round}");
        }
    }
}
