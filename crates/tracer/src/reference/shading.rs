//! The colour along a ray, in the words of the language.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayfold_scene::Tone;

use super::glass::{Refraction, is_flat, refract};
use super::light::{arriving, held, highlight};
use super::pattern::coefficients;
use super::world::{World, glass};
use crate::camera::Ray;

/// Once a path has met glass, a ray that counts for less than this in every channel is not followed.
const FAINT: f64 = 1.0 / 4096.0;

/// The same where the picture is of linear light, whose dark tones are spread.
const FAINT_LINEAR: f64 = 1.0 / 65536.0;

/// Follows rays.
pub(super) struct Shader<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) cancel: Option<&'a AtomicBool>,
}

/// A way from the camera.
#[derive(Clone, Copy)]
struct Path {
    /// So many more mirrorings and refractions are followed.
    bounces: u32,
    /// The product of all factors so far, absolute.
    weight: DVec3,
    has_met_glass: bool,
}

impl Shader<'_> {
    /// The colour along a ray from the camera, unclamped.
    pub(super) fn color(&self, ray: Ray, bounces: u32) -> DVec3 {
        self.color_along(ray, Path { bounces, weight: DVec3::ONE, has_met_glass: false })
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    fn color_along(&self, ray: Ray, path: Path) -> DVec3 {
        if self.is_cancelled() {
            return DVec3::ZERO;
        }
        let world = self.world;
        let Some(hit) = world.nearest(ray) else { return world.scene.background.along(ray.direction) };
        let (object, place, local_normal) = world.in_script(hit.object, &hit.surface);
        let coefficients = coefficients(object, place, local_normal, &hit.surface);
        let normal = hit.surface.normal;
        let start = hit.surface.point + hit.surface.offset * normal;

        let mut color = coefficients.ambient();
        let shine = object.material().finish().and_then(|finish| finish.shine);
        for light in world.lights.iter() {
            let Some(arriving) = arriving(light, &hit.surface) else { continue };
            let cosine = normal.dot(arriving.towards);
            if cosine <= 0.0 {
                continue;
            }
            let Some(left) = arriving.let_through(world, start) else { continue };
            let light = held(arriving.color * left);
            color = held(color + light * coefficients.diffuse() * cosine);
            if let Some(shine) = shine {
                let part = highlight(&shine, normal, arriving.towards, -ray.direction);
                color = held(color + light * shine.color() * part);
            }
        }
        if path.bounces == 0 {
            return color;
        }

        let mut factor = coefficients.mirror();
        let mut refracted = None;
        if let Some(glass) = glass(object) {
            let Refraction { mirrored, direction } =
                refract(glass, ray.direction, normal, hit.surface.within, is_flat(object));
            factor += mirrored;
            refracted = Some(((1.0 - mirrored) * glass.color(), direction));
        }
        let has_met_glass = path.has_met_glass || refracted.is_some();
        if let Some(path) = self.onwards(path, factor, has_met_glass) {
            // The normal faces the ray; where rounding says otherwise, the ray grazes.
            let towards_surface = ray.direction.dot(normal).min(0.0);
            let direction = (ray.direction - 2.0 * towards_surface * normal).normalize();
            let mirrored = self.color_along(Ray { origin: start, direction }, path);
            color = held(color + factor * mirrored);
        }
        if let Some((factor, direction)) = refracted
            && let Some(path) = self.onwards(path, factor, has_met_glass)
        {
            let origin = hit.surface.point - hit.surface.offset * normal;
            let seen = self.color_along(Ray { origin, direction }, path);
            color = held(color + factor * seen);
        }
        color
    }

    /// The path of a ray that counts by this factor; `None` where it is not followed.
    fn onwards(&self, path: Path, factor: DVec3, has_met_glass: bool) -> Option<Path> {
        let weight = held(path.weight * factor.abs());
        let faint = match self.world.scene.tone {
            Tone::Plain => FAINT,
            Tone::Srgb => FAINT_LINEAR,
        };
        let is_followed = if has_met_glass { weight.max_element() >= faint } else { factor != DVec3::ZERO };
        is_followed.then(|| Path { bounces: path.bounces - 1, weight, has_met_glass })
    }
}
