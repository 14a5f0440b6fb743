//! Cones, also cut off: frusta.

use glam::DVec3;
use rayfold_scene::{Cone, Object};

use super::frustum::Frustum;
use super::{Shape, Surface};
use crate::camera::Ray;

fn frustum(cone: &Cone) -> Frustum {
    Frustum { radii: cone.radii(), ends: cone.ends() }
}

impl Shape for Cone {
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
        let placed = Self::new(self.radii(), ends, self.material().clone()).ok()?;
        (frustum(self).sides(eye) == frustum(&placed).sides(DVec3::ZERO)).then_some(placed.into())
    }
}
