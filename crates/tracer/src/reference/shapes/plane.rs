//! Planes, and what is asked of the plane of anything flat.

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Object, Plane};

use super::twofold::{between, dot};
use super::{ROUNDOFF, Shape, Surface};
use crate::camera::Ray;
use crate::scale::below_inverse;

impl Shape for Plane {
    fn extent(&self, origin: DVec3) -> f64 {
        self.point().abs().max(origin.abs()).max_element()
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        Some(along(ray, self.point(), self.normal()))
    }

    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        surface(ray, distance, self.point(), self.normal())
    }

    fn seen_from(&self, eye: DVec3) -> Option<Object> {
        let placed = Self::new(self.point() - eye, self.normal(), self.material().clone()).ok()?;
        let same =
            side(eye, self.point(), self.normal()) == side(DVec3::ZERO, placed.point(), placed.normal());
        same.then_some(placed.into())
    }
}

/// How far along the ray a plane is met; not a finite number for a ray that runs along it, and 0 exactly for one that starts
/// in it. Whatever lies in one plane square to an axis, faces of boxes too, is met at the same distance bit for bit.
pub(super) fn along(ray: Ray, point: DVec3, normal: DVec3) -> f64 {
    let largest = normal.abs().max_element();
    let square_to_an_axis = normal.to_array().iter().filter(|x| **x != 0.0).count() == 1;
    let normal = if square_to_an_axis { normal / largest } else { normal * below_inverse(largest) };
    height(ray.origin, point, normal) / -ray.direction.dot(normal)
}

/// On which side of a plane a place is; 0 in it.
pub(super) fn side(place: DVec3, point: DVec3, normal: DVec3) -> f64 {
    let height = height(place, point, normal * below_inverse(normal.abs().max_element()));
    if height == 0.0 { 0.0 } else { height.signum() }
}

/// `(place - point)·normal`, with an error of one rounding.
fn height(place: DVec3, point: DVec3, normal: DVec3) -> f64 {
    let scale = below_inverse(place.abs().max(point.abs()).max_element());
    let height = dot(between(place, point, scale), normal.to_array().map(Into::into));
    height.beside((place.abs() + point.abs()).dot(normal.abs()) * scale) / scale
}

/// The surface of a plane where a ray meets it.
///
/// The hit and its way back onto the plane have roundings of the largest of their numbers: 3 in the hit, 1 in what is taken
/// off it, and those of the height, which is no larger.
pub(super) fn surface(ray: Ray, distance: f64, point: DVec3, normal: DVec3) -> Surface {
    let outward = unit(normal);
    let near = ray.origin + distance * ray.direction;
    let mut on = near - (near - point).dot(outward) * outward;
    // Of a plane that is square to an axis one number is known.
    for axis in 0..3 {
        if outward[axis].abs() == 1.0 {
            on[axis] = point[axis];
        }
    }
    let normal = if outward.dot(ray.direction) > 0.0 { -outward } else { outward };
    let largest = near.abs().max(point.abs()).max_element();
    Surface { point: on, normal, offset: 32.0 * ROUNDOFF * largest, flat: true, within: false }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::Material;

    use super::*;
    use crate::reference::shapes::distance;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn plane(point: [f64; 3], normal: [f64; 3]) -> Object {
        Plane::new(point.into(), normal.into(), Material::default()).unwrap().into()
    }

    #[test]
    fn a_plane_is_two_sided_without_end_and_missed_along_itself() {
        let floor = plane([3.0, 1.0, -7.0], [0.0, -5.0, 0.0]);
        assert_eq!(distance(&floor, ray([1e9, 3.0, 0.0], [0.0, -1.0, 0.0])), Some(2.0));
        assert_eq!(distance(&floor, ray([0.0, -3.0, 0.0], [0.0, 1.0, 0.0])), Some(4.0));
        assert_eq!(distance(&floor, ray([0.0, 3.0, 0.0], [0.0, 1.0, 0.0])), None);
        assert_eq!(distance(&floor, ray([0.0, 3.0, 0.0], [1.0, 0.0, 0.0])), None);
        assert_eq!(distance(&floor, ray([0.0, 1.0, 0.0], [1.0, 0.0, 0.0])), None, "in the plane");
        assert_eq!(distance(&floor, ray([0.0, 1.0, 0.0], [1.0, -1.0, 0.0])), None, "from the plane");
        assert!(distance(&floor, ray([0.0, 3.0, 0.0], [1.0, -1e-12, 0.0])).is_some(), "near the horizon");
    }

    #[test]
    fn a_ray_that_starts_in_a_slanted_plane_does_not_hit_it() {
        let normal = DVec3::new(0.1, 0.7, -0.3);
        let slanted = plane([0.0; 3], normal.to_array());
        // Halves of a plane's directions: exactly in it, though no product is exact.
        let within = DVec3::new(0.7, -0.1, 0.0);
        let r = Ray { origin: within, direction: DVec3::new(0.0, -0.6, 0.8) };
        assert_eq!(distance(&slanted, r), None);
    }
}
