//! Counts the rays of a scene.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Light, Scene, model::unit};

use crate::backends::{Backend, Ray};
use crate::scenes::pixel_ray;

/// Returns the number of rays from the camera, to lights and from mirrors, up to the depths 0, 1, 2 and so on to
/// `bounces`. These are the rays that the language prescribes, including those that a tracer avoids.
pub(crate) fn count(scene: &Scene, backend: &Backend, bounces: u32) -> Result<Vec<u64>> {
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let mut rays: Vec<Ray> = (0..width * height).map(|k| pixel_ray(scene, k % width, k / width)).collect();
    let mut counts = Vec::new();
    let mut total = 0;
    for _ in 0..=bounces {
        total += rays.len() as u64;
        let mut mirrored = Vec::new();
        for (ray, hit) in rays.iter().zip(backend.nearest(scene, &rays)?) {
            let Some(hit) = hit else { continue };
            let normal = hit.normal;
            let lit = |light: &&Light| match light {
                Light::Directional(light) => normal.dot(-unit(light.direction())) > 0.0,
                Light::Lamp(light) => {
                    normal.dot(light.position() - (ray.origin + hit.t * ray.direction)) > 0.0
                }
            };
            total += scene.lights.iter().filter(lit).count() as u64;
            if scene.objects[hit.object].material().mirror() != DVec3::ZERO {
                let direction = ray.direction - 2.0 * ray.direction.dot(normal) * normal;
                let origin = ray.origin + hit.t * (1.0 - 1e-9) * ray.direction;
                mirrored.push(Ray { origin, direction: direction.normalize() });
            }
        }
        counts.push(total);
        rays = mirrored;
    }
    Ok(counts)
}
