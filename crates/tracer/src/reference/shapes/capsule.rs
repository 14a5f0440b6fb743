//! Capsules: the union of two balls and the cylinder between their centres.
//!
//! The body is convex, so a ray has one interval in it, from the first entry into one of the three to the last exit.
//! Lengths are in units of the body, scaled by a power of two. A distant origin is first moved near the body along the
//! ray, as for frusta. So the errors across the ray are some roundoffs of the body's size.

use glam::DVec3;
use rayfold_scene::Capsule;
use rayfold_scene::model::unit;

use super::double_double::{DoubleDouble, Place, between, cross, dot};
use super::{ROUNDOFF, Shape, Sides, Surface, sign};
use crate::camera::Ray;
use crate::scale::below_inverse;

/// The distance, in sizes of the body, beyond which an origin is moved near it.
const FAR: f64 = 8.0;

/// Returns the scale that brings the body's size near 1.
fn size(capsule: &Capsule) -> f64 {
    let [a, b] = capsule.ends();
    below_inverse((b - a).abs().max_element().max(capsule.radius()))
}

/// Returns the unit vector from a to b, or any unit vector for a ball.
fn axis(capsule: &Capsule) -> DVec3 {
    let [a, b] = capsule.ends();
    if a == b { DVec3::Z } else { unit(b - a) }
}

/// Returns d² - R² for the distance d of a point from the segment, in units of 1 / scale: positive outside, exactly 0
/// on the surface. It has twice the precision, because the point may be on the surface.
fn outside(capsule: &Capsule, place: impl Into<Place>, scale: f64) -> f64 {
    let [a, b] = capsule.ends();
    let place = place.into();
    let (along, from_a) = (between(b, a, scale), between(place, a, scale));
    let (square, height) = (dot(along, along), dot(from_a, along));
    let radius = DoubleDouble::from(capsule.radius() * scale);
    let near = radius * radius;
    if height.value() > 0.0 && height.value() < square.value() {
        let aside = cross(from_a, along);
        let (far, near) = (dot(aside, aside), near * square);
        let largest = dot(from_a, from_a).value() * square.value() + near.value();
        return (far - near).beside(largest) / square.value();
    }
    let from_end = if height.value() > 0.0 { between(place, b, scale) } else { from_a };
    let far = dot(from_end, from_end);
    (far - near).beside(far.value() + near.value())
}

/// Returns the interval of a line in a ball. The arguments are the vector from the centre to the line's start, and the
/// line's unit direction.
fn in_ball(from_center: DVec3, direction: DVec3, radius: f64) -> Option<(f64, f64)> {
    let middle = -from_center.dot(direction);
    let closest = (from_center + middle * direction).length();
    let half = (closest <= radius).then(|| ((radius - closest) * (radius + closest)).sqrt())?;
    Some((middle - half, middle + half))
}

/// Returns the interval of a line in a cylinder from the origin to the height along an axis.
fn in_cylinder(from_a: DVec3, direction: DVec3, axis: DVec3, height: f64, radius: f64) -> Option<(f64, f64)> {
    let (start, rise) = (from_a.dot(axis), direction.dot(axis));
    let (aside, spread) = (from_a - start * axis, direction - rise * axis);
    let square = spread.length_squared();
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    if square == 0.0 {
        (aside.length() <= radius).then_some(())?;
    } else {
        let middle = -aside.dot(spread) / square;
        let closest = (aside + middle * spread).length();
        (closest <= radius).then_some(())?;
        let half = ((radius - closest) * (radius + closest) / square).sqrt();
        (enter, leave) = (middle - half, middle + half);
    }
    if rise == 0.0 {
        (0.0..=height).contains(&start).then_some(())?;
    } else {
        let (low, high) = (-start / rise, (height - start) / rise);
        (enter, leave) = (enter.max(low.min(high)), leave.min(low.max(high)));
    }
    (enter <= leave).then_some((enter, leave))
}

impl Shape for Capsule {
    fn extent(&self, origin: DVec3) -> f64 {
        let [a, b] = self.ends();
        a.abs().max(b.abs()).max(origin.abs()).max_element().max(self.radius())
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        let [a, b] = self.ends();
        let (scale, axis, direction) = (size(self), axis(self), ray.direction);
        let along = (b - a) * scale;
        let (height, radius) = (along.length(), self.radius() * scale);
        let middle = 0.5 * (b - a) - (ray.origin - a);
        let is_far = middle.abs().max_element() * scale > FAR;
        let near = if is_far { middle.dot(direction) } else { 0.0 };
        let from_a = ((ray.origin - a) + near * direction) * scale;
        let parts = [
            in_ball(from_a, direction, radius),
            in_ball(from_a - along, direction, radius),
            in_cylinder(from_a, direction, axis, height, radius),
        ];
        let join = |(enter, leave): (f64, f64), (e, l): (f64, f64)| (enter.min(e), leave.max(l));
        let (enter, leave) = parts.into_iter().flatten().reduce(join)?;
        let (enter, leave) = (near + enter / scale, near + leave / scale);
        if is_far || outside(self, ray.origin, scale) > 0.0 {
            // Both ends of the interval are on the same side of the origin.
            return (enter + leave > 0.0).then_some(enter.max(f64::MIN_POSITIVE));
        }
        (enter + leave > 0.0 || enter < 0.0 && leave > 0.0 && outside(self, ray.origin, scale) < 0.0)
            .then_some(leave)
    }

    /// Returns the surface. The point has the rounding errors of its height, of its vector from the segment, and of the
    /// sum with a: fewer than 16 roundoffs of the largest number.
    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let [a, b] = self.ends();
        let (scale, axis) = (size(self), axis(self));
        let height = ((b - a) * scale).length() / scale;
        let from_a = (ray.origin - a) + distance * ray.direction;
        let along = from_a.dot(axis).clamp(0.0, height);
        let outward = unit(from_a - along * axis);
        let within = outside(self, ray.origin, scale) <= 0.0;
        let largest = a.abs().max(b.abs()).max_element().max(self.radius());
        Surface {
            point: a + along * axis + self.radius() * outward,
            normal: if within { -outward } else { outward },
            offset: 64.0 * ROUNDOFF * largest,
            flat: false,
            within,
        }
    }

    fn sides(&self, place: Place) -> Sides {
        [sign(outside(self, place, size(self))), 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::reference::shapes::{distance, surface};

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn pill() -> Object {
        let ends = [DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 3.0, 0.0)];
        Capsule::new(2.0, ends, Material::default()).unwrap().into()
    }

    fn hit(origin: [f64; 3], direction: [f64; 3]) -> Option<(f64, DVec3)> {
        let (object, ray) = (pill(), ray(origin, direction));
        distance(&object, ray).map(|t| (t, surface(&object, ray, t).normal))
    }

    #[test]
    fn a_capsule_has_a_side_and_two_round_ends() {
        let t = |origin, direction| hit(origin, direction).map(|hit| hit.0);
        assert_eq!(hit([5.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some((3.0, DVec3::X)));
        assert_eq!(hit([0.0, 8.0, 0.0], [0.0, -1.0, 0.0]), Some((3.0, DVec3::Y)));
        assert_eq!(hit([0.0, -8.0, 0.0], [0.0, 1.0, 0.0]), Some((5.0, DVec3::NEG_Y)));
        assert_eq!(hit([0.0, 0.0, 0.0], [0.0, -1.0, 0.0]), Some((3.0, DVec3::Y)), "from within");
        assert_eq!(hit([0.5, 0.0, 0.0], [1.0, 0.0, 0.0]), Some((1.5, DVec3::NEG_X)), "from within");
        assert_eq!(t([2.0, 0.0, 5.0], [0.0, 0.0, -1.0]), Some(5.0), "a tangent");
        assert_eq!(t([2.000_000_000_000_1, 0.0, 5.0], [0.0, 0.0, -1.0]), None);
        assert_eq!(t([5.0, 5.0, 0.0], [-1.0, 0.0, 0.0]), Some(5.0), "at the top");
        assert_eq!(t([5.0, 5.000_000_000_000_1, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(t([2.0, 0.0, 0.0], [1.0, 0.0, 0.0]), None, "from the side");
        assert_eq!(t([2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some(4.0), "from the side inwards");
        assert_eq!(t([0.0, 5.0, 0.0], [0.0, 1.0, 0.0]), None, "from an end");
        assert_eq!(t([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]), Some(8.0), "from an end inwards");
        let (at, normal) = hit([9.0, 4.2, 0.0], [-1.0, 0.0, 0.0]).unwrap();
        assert!(
            (at - 7.4).abs() < 1e-14 && normal.distance(DVec3::new(0.8, 0.6, 0.0)) < 1e-14,
            "{at} {normal}"
        );
    }

    #[test]
    fn a_capsule_without_length_is_a_ball() {
        let ball = Object::from(Capsule::new(2.0, [DVec3::X; 2], Material::default()).unwrap());
        let r = ray([1.0, 9.0, 0.0], [0.0, -1.0, 0.0]);
        assert_eq!(distance(&ball, r), Some(7.0));
        assert_eq!(surface(&ball, r, 7.0).normal, DVec3::Y);
    }

    #[test]
    fn a_far_eye_and_a_power_of_two_change_nothing() {
        let near = ray([2.5, 6.0, 1.5], [-2.25, -5.25, -1.375]);
        let expected = distance(&pill(), near).unwrap();
        for exponent in [-700, -90, -1, 1, 90, 700] {
            let scale = 2f64.powi(exponent);
            let placed = pill().placed(scale, |p| scale * p).unwrap();
            let r = Ray { origin: near.origin * scale, ..near };
            assert_eq!(distance(&placed, r), Some(expected * scale), "2^{exponent}");
        }
        for far in [1e3, 1e9, 1e15] {
            let r = Ray { origin: near.origin - far * near.direction, ..near };
            let t = distance(&pill(), r).unwrap() - far;
            assert!((t - expected).abs() <= 4.0 * f64::EPSILON * far, "{t} from {far:e}");
        }
    }

    #[test]
    fn what_leaves_the_surface_does_not_meet_it_again() {
        let mut rng = fastrand::Rng::with_seed(41);
        let mut random = || DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        for round in 0..20_000 {
            let ends = [10.0 * random(), 10.0 * random()];
            let object = Capsule::new(3.0, ends, Material::default()).unwrap().into();
            let (origin, target) = (20.0 * random(), ends[0].lerp(ends[1], 0.5) + 3.0 * random());
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
