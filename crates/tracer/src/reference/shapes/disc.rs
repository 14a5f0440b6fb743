//! Discs, intersected by the plane that contains them.

use glam::DVec3;
use rayfold_scene::Disc;
use rayfold_scene::model::unit;

use super::double_double::Place;
use super::{ROUNDOFF, Shape, Sides, Surface, plane};
use crate::camera::Ray;

/// The rounding error of a hit's distance from the centre, in roundoffs. The rim belongs to the disc.
const RIM: f64 = 4.0;

impl Shape for Disc {
    fn extent(&self, origin: DVec3) -> f64 {
        self.center().abs().max(origin.abs()).max_element().max(self.radius())
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        let distance = plane::along(ray, self.center(), self.normal());
        let normal = unit(self.normal());
        let from_center = (ray.origin - self.center()) + distance * ray.direction;
        let aside = (from_center - from_center.dot(normal) * normal).length();
        (aside <= self.radius() * (1.0 + RIM * ROUNDOFF)).then_some(distance)
    }

    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        plane::surface(ray, distance, self.center(), self.normal())
    }

    fn sides(&self, place: Place) -> Sides {
        [plane::side(place, self.center(), self.normal()), 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    fn has_inside(&self) -> bool {
        false
    }

    fn is_flat_at(&self, _: DVec3) -> bool {
        true
    }

    fn face(&self, _: DVec3, _: DVec3) -> Option<(usize, f64)> {
        plane::along_an_axis(self.normal()).map(|axis| (axis, self.center()[axis]))
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::Material;

    use super::*;
    use crate::reference::shapes::distance;

    fn t(origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let disc = Disc::new(5.0, DVec3::Y, DVec3::new(0.0, 0.5, 0.0), Material::default()).unwrap();
        let ray = Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() };
        distance(&disc.into(), ray)
    }

    #[test]
    fn a_disc_has_its_rim_and_is_missed_edge_on() {
        assert_eq!(t([1.0, 4.0, 2.0], [0.0, -1.0, 0.0]), Some(3.0));
        assert_eq!(t([3.0, -4.0, 4.0], [0.0, 1.0, 0.0]), Some(5.0), "on the rim");
        assert_eq!(t([3.0, 4.0, 4.000_000_000_000_01], [0.0, -1.0, 0.0]), None);
        assert_eq!(t([-9.0, 1.0, 0.0], [1.0, 0.0, 0.0]), None, "edge on");
        assert_eq!(t([0.0, 1.0, 0.0], [0.0, 1.0, 0.0]), None, "from within");
    }
}
