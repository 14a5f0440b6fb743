//! The geometry of lights, for both tracers: each kind of light has a file.
//!
//! How light arrives at a surface is in `reference/light` and in `fast/lights`.

mod lamp;
mod sun;

use glam::DVec3;
use rayfold_scene::Light;

/// The geometry of a light.
pub(crate) trait LightShape {
    /// Returns the centre of the light: for a sun the unit vector towards it, for a lamp its position.
    fn middle(&self) -> DVec3;

    /// Returns the unit vector from a point towards the centre, or 0 at the centre.
    fn towards(&self, point: DVec3) -> DVec3;

    /// Returns the number of coordinates of one of its points, or 0 for a light without extent.
    fn coordinates(&self) -> usize;

    /// Returns the point of the light with these coordinates, each from 0 to 1. `number` returns a coordinate by its index.
    fn point(&self, number: &dyn Fn(usize) -> f64) -> DVec3;

    /// Returns the light in coordinates with the origin at the eye, or `None` if its position overflows.
    fn seen_from(&self, eye: DVec3) -> Option<Light>;
}

/// Returns the geometry of a light.
pub(crate) fn shape(light: &Light) -> &dyn LightShape {
    match light {
        Light::Directional(sun) => sun,
        Light::Lamp(lamp) => lamp,
    }
}
