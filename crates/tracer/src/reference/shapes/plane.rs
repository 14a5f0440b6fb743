//! Planes, and the plane of any flat shape.

use glam::DVec3;
use rayfold_scene::Plane;
use rayfold_scene::model::unit;

use super::double_double::{Place, between, dot};
use super::{ROUNDOFF, Shape, Sides, Surface, sign};
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

    fn sides(&self, place: Place) -> Sides {
        [side(place, self.point(), self.normal()), 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn has_inside(&self) -> bool {
        false
    }

    fn is_flat_at(&self, _: DVec3) -> bool {
        true
    }

    fn face(&self, _: DVec3, _: DVec3) -> Option<(usize, f64)> {
        along_an_axis(self.normal()).map(|axis| (axis, self.point()[axis]))
    }
}

/// Returns the distance along the ray to a plane. It is not finite for a ray parallel to the plane, and exactly 0 for
/// one that starts in it. All flat shapes in one plane perpendicular to an axis, including faces of boxes, are hit at
/// the same distance bit for bit.
pub(super) fn along(ray: Ray, point: DVec3, normal: DVec3) -> f64 {
    let largest = normal.abs().max_element();
    let square_to_an_axis = normal.to_array().iter().filter(|x| **x != 0.0).count() == 1;
    let normal = if square_to_an_axis { normal / largest } else { normal * below_inverse(largest) };
    height(ray.origin, point, normal) / -ray.direction.dot(normal)
}

/// Returns the axis along which a direction runs exactly.
pub(super) fn along_an_axis(direction: DVec3) -> Option<usize> {
    let mut other = (0..3).filter(|&axis| direction[axis] != 0.0);
    let axis = other.next()?;
    other.next().is_none().then_some(axis)
}

/// Returns the side of a plane on which a point is; 0 in the plane.
pub(super) fn side(place: impl Into<Place>, point: DVec3, normal: DVec3) -> f64 {
    let height = height(place, point, normal * below_inverse(normal.abs().max_element()));
    sign(height)
}

/// Returns `(place - point)·normal`, with an error of one rounding.
fn height(place: impl Into<Place>, point: DVec3, normal: DVec3) -> f64 {
    let place = place.into();
    let rounded = place.rounded();
    let scale = below_inverse(rounded.abs().max(point.abs()).max_element());
    let height = dot(between(place, point, scale), normal.to_array().map(Into::into));
    height.beside((rounded.abs() + point.abs()).dot(normal.abs()) * scale) / scale
}

/// Returns the surface of a plane at the hit of a ray.
///
/// The hit, and its move onto the plane, have rounding errors relative to the largest of their numbers: 3 in the hit, 1
/// in the difference, and those of the height, which is no larger.
pub(super) fn surface(ray: Ray, distance: f64, point: DVec3, normal: DVec3) -> Surface {
    let outward = unit(normal);
    let near = ray.origin + distance * ray.direction;
    let mut on = near - (near - point).dot(outward) * outward;
    // For a plane that is perpendicular to an axis, one coordinate is exact.
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
    use rayfold_scene::{Material, Object};

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
        // A point exactly in the plane, though no product is exact: two coordinates of the normal, swapped.
        let within = DVec3::new(0.7, -0.1, 0.0);
        let r = Ray { origin: within, direction: DVec3::new(0.0, -0.6, 0.8) };
        assert_eq!(distance(&slanted, r), None);
    }
}
