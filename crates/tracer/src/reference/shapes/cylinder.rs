//! Cylinders: frusta whose radius does not change.

use glam::DVec3;
use rayfold_scene::{Cylinder, Object};

use super::frustum::Frustum;
use super::{Shape, Surface};
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

    fn seen_from(&self, eye: DVec3) -> Option<Object> {
        let ends = self.ends().map(|end| end - eye);
        let placed = Self::new(self.radius(), ends, self.material().clone()).ok()?;
        (frustum(self).sides(eye) == frustum(&placed).sides(DVec3::ZERO)).then_some(placed.into())
    }
}
