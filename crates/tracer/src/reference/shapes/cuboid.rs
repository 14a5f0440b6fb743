//! Boxes along the axes.

use glam::DVec3;
use rayfold_scene::Cuboid;

use super::double_double::Place;
use super::{ROUNDOFF, Shape, Sides, Surface, nearer, sign};
use crate::camera::Ray;

impl Shape for Cuboid {
    fn extent(&self, origin: DVec3) -> f64 {
        self.corners().iter().fold(origin.abs(), |m, v| m.max(v.abs())).max_element()
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        let (enter, leave) = slabs(self, ray)?;
        Some(if enter.0 > 0.0 { enter.0 } else { leave.0 })
    }

    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let (min, max) = (self.min(), self.max());
        let (axis, entering) = match slabs(self, ray) {
            Some(((near, axis), _)) if near > 0.0 => (axis, true),
            Some((_, (_, axis))) => (axis, false),
            None => unreachable!("the ray hits the box at {distance}"),
        };
        let axis = flat_axis(self).filter(|&axis| ray.direction[axis] != 0.0).unwrap_or(axis);
        let forwards = ray.direction[axis] > 0.0;
        let mut point = (ray.origin + distance * ray.direction).clamp(min, max);
        point[axis] = if forwards == entering { min[axis] } else { max[axis] };
        let normal = if forwards { -DVec3::AXES[axis] } else { DVec3::AXES[axis] };
        let largest = point.abs().max_element();
        Surface { point, normal, offset: 16.0 * ROUNDOFF * largest, flat: true, within: !entering }
    }

    fn sides(&self, place: Place) -> Sides {
        let [low, high] = [self.min(), self.max()].map(|corner| place.towards(corner).map(sign));
        [low.x, low.y, low.z, high.x, high.y, high.z]
    }

    fn has_inside(&self) -> bool {
        self.min().cmpne(self.max()).all()
    }

    fn is_flat_at(&self, _: DVec3) -> bool {
        true
    }

    fn face(&self, place: DVec3, normal: DVec3) -> Option<(usize, f64)> {
        let axis = largest(normal);
        Some((axis, nearer(axis, place, [self.min(), self.max()])))
    }
}

/// Returns the axis of the largest component.
pub(super) fn largest(v: DVec3) -> usize {
    let v = v.abs();
    if v.x >= v.y && v.x >= v.z {
        0
    } else if v.y >= v.z {
        1
    } else {
        2
    }
}

/// Returns the axis to which the box is perpendicular, if it is a rectangle. The sides of a rectangle have no area.
fn flat_axis(cuboid: &Cuboid) -> Option<usize> {
    let mut axes = (0..3).filter(|&axis| cuboid.min()[axis] == cuboid.max()[axis]);
    axes.next().filter(|_| axes.next().is_none())
}

/// Returns the distances at which the ray enters and leaves the box, each with its axis, by Kay and Kajiya's slabs. The
/// planes of a slab belong to it. A ray parallel to them is inside for its whole length.
///
/// The exit distance is increased by the rounding error of the divisions (Ize, "Robust BVH ray traversal", JCGT 2(2),
/// 2013), so that edges and corners belong to the box.
fn slabs(cuboid: &Cuboid, ray: Ray) -> Option<((f64, usize), (f64, usize))> {
    let (min, max) = (cuboid.min(), cuboid.max());
    let mut enter = (f64::NEG_INFINITY, 0);
    let mut leave = (f64::INFINITY, 0);
    for axis in 0..3 {
        let (o, d) = (ray.origin[axis], ray.direction[axis]);
        if d == 0.0 {
            if o < min[axis] || o > max[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((min[axis] - o) / d, (max[axis] - o) / d);
        let (near, far) = (a.min(b), a.max(b));
        if near > enter.0 {
            enter = (near, axis);
        }
        if far < leave.0 {
            leave = (far, axis);
        }
    }
    let slack = 8.0 * ROUNDOFF * leave.0.abs();
    (enter.0 <= leave.0 + slack).then_some((enter, leave))
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::reference::shapes::distance;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn cuboid(u: [f64; 3], v: [f64; 3]) -> Object {
        Cuboid::new([u.into(), v.into()], Material::default()).unwrap().into()
    }

    #[test]
    fn the_faces_edges_and_corners_belong_to_a_box() {
        let unit = cuboid([1.0; 3], [-1.0; 3]);
        for zero in [0.0, -0.0] {
            assert_eq!(distance(&unit, ray([1.0, 0.0, 4.0], [zero, zero, -1.0])), Some(3.0));
            assert_eq!(distance(&unit, ray([1.0, -1.0, 4.0], [zero, zero, -1.0])), Some(3.0));
            assert_eq!(distance(&unit, ray([1.0 + 1e-15, 0.0, 4.0], [zero, zero, -1.0])), None);
        }
        assert!(distance(&unit, ray([3.0, 3.0, 3.0], [-1.0, -1.0, -1.0])).is_some());
        assert!(distance(&unit, ray([0.0, 0.0, 6.0], [1.0, 1.0, -5.0])).is_some());
    }

    #[test]
    fn a_flat_box_is_a_rectangle() {
        let flat = cuboid([-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]);
        assert_eq!(distance(&flat, ray([0.5, 0.5, 2.0], [0.0, 0.0, -1.0])), Some(2.0));
        assert_eq!(distance(&flat, ray([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0])), Some(2.0));
        assert_eq!(distance(&flat, ray([3.0, 0.0, 1e-300], [-1.0, 0.0, 0.0])), None);
    }

    #[test]
    fn the_edge_of_a_rectangle_has_its_normal() {
        let floor =
            Cuboid::new([DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 0.0, 1.0)], Material::default());
        let floor = floor.unwrap();
        for x in [-1.0, -0.3, 1.0] {
            let r = ray([x - 2.0, 2.0, -1.0], [2.0, -2.0, 0.0]);
            let met = Shape::distance(&floor, r).unwrap();
            assert_eq!(Shape::surface(&floor, r, met).normal, DVec3::Y, "at {x}");
        }
        let along = ray([-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]);
        assert_eq!(Shape::surface(&floor, along, 2.0).normal, DVec3::NEG_X);
    }
}
