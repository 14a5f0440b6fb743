//! The first surface along a ray from the camera, without its light.

use glam::DVec3;
use rayfold_scene::Tone;

use super::pattern::coefficients;
use super::world::{World, glass};
use super::{Hit, shapes};
use crate::camera::Ray;
use crate::meshes::Expanded;

/// The surfaces behind the pixels of a scene.
pub(crate) struct FirstSurfaces<'a>(World<'a>);

/// The first surface along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FirstSurface {
    /// The position of the object among those of the scene.
    pub(crate) object: usize,
    /// The distance from the ray's origin.
    pub(crate) distance: f64,
    /// The unit normal that light sees. It faces the ray.
    pub(crate) normal: DVec3,
    /// The share of light that the surface reflects, from 0 to 1 for each channel.
    pub(crate) albedo: DVec3,
}

impl<'a> FirstSurfaces<'a> {
    pub(crate) fn new(expanded: &'a Expanded) -> Self {
        Self(World::of(expanded))
    }

    /// Returns the surface behind column `i` from the left and row `j` from the bottom. `order` is the object that is
    /// known to be the first there. If the ray misses that object by a rounding error, returns the nearest surface of
    /// all.
    pub(crate) fn of_object(&self, i: f64, j: f64, object: usize) -> Option<FirstSurface> {
        let ray = self.0.rays.ray(i, j);
        let Some(distance) = shapes::distance(&self.0.objects[object], ray) else {
            return self.nearest(i, j);
        };
        let surface = shapes::surface(&self.0.objects[object], ray, distance);
        Some(self.seen(ray, &Hit { object, distance, surface }))
    }

    /// Returns the nearest surface behind column `i` from the left and row `j` from the bottom.
    pub(crate) fn nearest(&self, i: f64, j: f64) -> Option<FirstSurface> {
        let ray = self.0.rays.ray(i, j);
        self.0.nearest(ray).map(|hit| self.seen(ray, &hit))
    }

    fn seen(&self, ray: Ray, hit: &Hit) -> FirstSurface {
        let Self(world) = self;
        let (object, place, local_normal) = world.in_script(hit.object, &hit.surface);
        let is_linear = world.scene.tone == Tone::Srgb;
        let coefficients = coefficients(object, place, local_normal, &hit.surface, is_linear);
        let shading = world.shading(hit, ray.direction);
        let normal = shading.map_or(hit.surface.normal, |shading| shading.normal);
        let tint = shading.map_or(DVec3::ONE, |shading| shading.color);
        let albedo = match glass(object) {
            Some(_) => DVec3::ONE,
            None => coefficients.diffuse() * tint + coefficients.mirror(),
        };
        let albedo = albedo.clamp(DVec3::ZERO, DVec3::ONE);
        FirstSurface { object: hit.object, distance: hit.distance, normal, albedo }
    }
}
