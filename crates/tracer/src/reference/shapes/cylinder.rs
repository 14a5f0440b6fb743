//! Cylinders: frusta whose radius is constant.

use glam::DVec3;
use rayfold_scene::Cylinder;

use super::double_double::Place;
use super::frustum::Frustum;
use super::{Shape, Sides, Surface};
use crate::camera::Ray;

fn frustum(cylinder: &Cylinder) -> Frustum {
    Frustum { radii: [cylinder.radius(); 2], ends: cylinder.ends() }
}

impl Shape for Cylinder {
    fn extent(&self, origin: DVec3) -> f64 {
        frustum(self).extent(origin)
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        frustum(self).distance(ray)
    }

    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        frustum(self).surface(ray, distance)
    }

    fn sides(&self, place: Place) -> Sides {
        frustum(self).sides(place)
    }

    fn is_flat_at(&self, normal: DVec3) -> bool {
        frustum(self).is_cap(normal)
    }

    fn face(&self, place: DVec3, _: DVec3) -> Option<(usize, f64)> {
        frustum(self).cap(place)
    }
}
