//! A lamp: a point, or a ball.

use glam::DVec3;
use rayfold_scene::{Lamp, Light};

use super::LightShape;
use crate::sampling::places::in_ball;

impl LightShape for Lamp {
    fn middle(&self) -> DVec3 {
        self.position()
    }

    fn towards(&self, point: DVec3) -> DVec3 {
        (self.position() - point).normalize_or_zero()
    }

    fn coordinates(&self) -> usize {
        if self.radius() > 0.0 { 3 } else { 0 }
    }

    fn point(&self, number: &dyn Fn(usize) -> f64) -> DVec3 {
        self.middle() + self.radius() * in_ball(number(0), number(1), number(2))
    }

    fn seen_from(&self, eye: DVec3) -> Option<Light> {
        Lamp::new(self.color(), self.position() - eye, self.radius(), self.reach()).ok().map(Light::Lamp)
    }
}
