//! A sun: a direction, or a disc on the sky.

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{DirectionalLight, Light};

use super::LightShape;
use crate::sampling::places::{in_cone, spread};

impl LightShape for DirectionalLight {
    fn middle(&self) -> DVec3 {
        -unit(self.direction())
    }

    fn towards(&self, _point: DVec3) -> DVec3 {
        self.middle()
    }

    fn coordinates(&self) -> usize {
        if self.angle() > 0.0 { 2 } else { 0 }
    }

    fn point(&self, number: &dyn Fn(usize) -> f64) -> DVec3 {
        let middle = self.middle();
        let (x, y) = middle.any_orthonormal_pair();
        let at = in_cone(number(0), number(1), spread(self.angle()));
        at.x * x + at.y * y + at.z * middle
    }

    fn seen_from(&self, _eye: DVec3) -> Option<Light> {
        Some((*self).into())
    }
}
