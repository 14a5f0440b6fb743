//! Spheres, with an intersection test that avoids cancellation.

use glam::DVec3;
use rayfold_scene::Sphere;

use super::double_double::{Place, between};
use super::{ROUNDOFF, Shape, Sides, Surface, sign};
use crate::camera::Ray;
use crate::scale::below_inverse;

impl Shape for Sphere {
    fn extent(&self, origin: DVec3) -> f64 {
        (self.center() - origin).abs().max_element().max(self.radius())
    }

    /// Returns the distance by the method of Haines, Günther, Akenine-Möller, "Precision improvements for ray/sphere
    /// intersection", Ray Tracing Gems ch. 7.
    fn distance(&self, ray: Ray) -> Option<f64> {
        let radius = self.radius();
        let from_center = ray.origin - self.center();
        let middle = -from_center.dot(ray.direction);
        let closest = (from_center + middle * ray.direction).length();
        if closest > radius {
            return None;
        }
        let half_chord = ((radius - closest) * (radius + closest)).sqrt();
        // The two solutions are `far` and `power / far`. Neither subtracts numbers of the same sign.
        let far = if middle > 0.0 { middle + half_chord } else { middle - half_chord };
        let power = power(ray.origin, self, 1.0);
        if power > 0.0 {
            (middle > 0.0).then(|| power / far)
        } else if middle > 0.0 {
            Some(far)
        } else {
            (far != 0.0).then(|| power / far)
        }
    }

    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let outward = (ray.origin - self.center() + distance * ray.direction).normalize();
        let outside = power(ray.origin, self, 1.0) > 0.0;
        let normal = if outside { outward } else { -outward };
        let largest = self.center().abs().max_element() + self.radius();
        let point = self.center() + self.radius() * outward;
        Surface { point, normal, offset: 16.0 * ROUNDOFF * largest, flat: false, within: !outside }
    }

    fn sides(&self, place: Place) -> Sides {
        [sign(power(place, self, below_inverse(self.extent(DVec3::ZERO)))), 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

/// Returns `|point - center|² - radius²` of a sphere in units of 1 / scale, a power of two: positive outside, negative
/// inside. Its error is at most a part in 10^30 of the squares, so that the side of a point near the surface is
/// certain.
///
/// Uses sums and products with their errors (Dekker, "A floating-point technique for extending the available
/// precision", 1971).
pub(crate) fn power(point: impl Into<Place>, sphere: &Sphere, scale: f64) -> f64 {
    let apart = between(point, sphere.center(), scale);
    let product = |a: f64| (a * a, a.mul_add(a, -(a * a)));
    let sum = |a: f64, b: f64| {
        let s = a + b;
        let part = s - a;
        (s, (a - (s - part)) + (b - part))
    };
    let (mut power, mut rest) = product(sphere.radius() * scale);
    (power, rest) = (-power, -rest);
    for axis in 0..3 {
        let (apart, error) = (apart[axis].value(), apart[axis].rest());
        let (square, less) = product(apart);
        let (total, lost) = sum(power, square);
        power = total;
        rest += lost + less + 2.0 * apart * error;
    }
    power + rest
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::reference::shapes::distance;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn sphere(radius: f64, center: [f64; 3]) -> Object {
        Sphere::new(radius, center.into(), Material::default()).unwrap().into()
    }

    #[test]
    fn a_sphere_gives_the_root_in_front() {
        let unit = sphere(1.0, [0.0; 3]);
        assert_eq!(distance(&unit, ray([0.0, 0.0, 3.0], [0.0, 0.0, -1.0])), Some(2.0));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 3.0], [0.0, 0.0, 1.0])), None);
        assert_eq!(distance(&unit, ray([0.0; 3], [0.0, 0.0, 1.0])), Some(1.0));
        assert_eq!(
            distance(&unit, ray([0.0; 3], [0.0, 0.0, -1.0])),
            Some(1.0),
            "from the middle, whatever the sign of 0"
        );
        assert_eq!(distance(&unit, ray([0.0, 0.0, 0.5], [0.0, 0.0, -1.0])), Some(1.5));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 0.5], [0.0, 0.0, 1.0])), Some(0.5));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 1.0], [0.0, 0.0, -1.0])), Some(2.0));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])), None);
        assert_eq!(distance(&unit, ray([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])), None);
    }

    #[test]
    fn the_side_of_a_point_on_the_surface_is_known() {
        // 0.6² + 0.8² = 1 - 1.7e-17 for the numbers that are nearest to these decimals.
        let Object::Sphere(unit) = sphere(1.0, [0.0; 3]) else { panic!("a sphere") };
        let just_inside = power(DVec3::new(0.6, 0.8, 0.0), &unit, 1.0);
        // In integers, because the squares are multiples of 2^-106.
        let square = |x: f64| ((x * 2f64.powi(53)) as i128).pow(2);
        let exact = square(0.6) + square(0.8) - square(1.0);
        assert_eq!(just_inside, exact as f64 * 2f64.powi(-106));
        assert_eq!(
            power(
                DVec3::new(3.0, 4.0, 0.0),
                &Sphere::new(5.0, DVec3::ZERO, unit.material().clone()).unwrap(),
                1.0
            ),
            0.0
        );
    }
}
