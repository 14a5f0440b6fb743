//! The reference tracer. Every faster tracer is tested against it.
//!
//! It traces one ray after another and tests every object for every ray, all in `f64`, in the terms of the scene
//! language. It is written for clarity and correctness, without packets, tiles or trees. Bounds on its own rounding
//! errors are defined where the errors arise ([`Surface::offset`]), relative to the numbers involved.
//!
//! ```
//! use glam::DVec3;
//! use rayfold_scene::{Material, Object, Sphere};
//! use rayfold_tracer::reference::nearest;
//!
//! let sphere = Object::Sphere(Sphere::new(1.0, DVec3::ZERO, Material::default())?);
//! let hit = nearest(&[sphere], DVec3::new(0.0, 0.0, 5.0), DVec3::NEG_Z).ok_or("missed")?;
//! assert_eq!((hit.object, hit.distance, hit.surface.normal), (0, 4.0, DVec3::Z));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod first;
mod glass;
mod light;
mod noise;
mod pattern;
mod sampled;
mod shading;
mod shapes;
mod tone;
mod whole;
mod windows;
mod world;

use core::ops::Range;
use std::borrow::Cow;
use std::sync::atomic::Ordering;

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::{Object, Scene};

pub(crate) use first::{FirstSurface, FirstSurfaces};
pub(crate) use glass::{Refraction, onward_normal, refract};
pub(crate) use light::highlight;
pub(crate) use pattern::coefficients;
pub use sampled::{Estimate, estimate, light_and_cover, render_exposed};
pub(crate) use sampled::{light, lit_rows, render_rows as render_exposed_rows};
pub(crate) use shading::{FAINT, FAINT_LINEAR, clearness};
pub use shapes::Surface;
pub(crate) use shapes::{
    Place, has_inside, is_flat_at, normal_and_width, power, triangle_normal, turns_axes_to_axes,
};
pub(crate) use tone::{encoded, levels};
pub(crate) use windows::windows;

use crate::camera::Ray;
use crate::meshes::{Colors, Expanded, Faces, Shared, expanded, mesh};
use crate::parallel::{CHANNELS, bands};
use crate::{RenderError, RenderOptions};
use shading::Shader;
use world::World;

/// The first hit of a ray with an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The position of the object in the script, from 0.
    pub object: usize,
    /// The distance from the ray's origin, in world units, greater than zero.
    pub distance: f64,
    /// The surface at the hit.
    pub surface: Surface,
}

/// Draws a scene with the reference tracer, one ray per pixel.
///
/// # Errors
/// The errors of [`crate::render`].
pub fn render(scene: &Scene, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    render_rows(scene, 0..scene.screen.height(), options)
}

/// Draws some rows of a scene with the reference tracer.
fn render_rows(scene: &Scene, rows: Range<u32>, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    let expanded = Expanded::new(Cow::Borrowed(scene), Shared::NONE);
    let world = World::of(&expanded);
    let lights = world.middles();
    let image = bands(
        scene.screen,
        rows,
        1,
        options,
        || (),
        |(), row, band| {
            let shader = Shader { world: &world, lights: &lights, cancel: options.cancel, paths: None };
            let j = scene.screen.height() - 1 - row;
            for (pixel, i) in band.chunks_exact_mut(CHANNELS).zip(0u32..) {
                let ray = world.rays.ray(f64::from(i), f64::from(j));
                let color = shader.color(ray, options.bounces(scene));
                pixel.copy_from_slice(&tone::toned(scene.tone, color));
            }
        },
    )?;
    // A pixel with much glass stops halfway if the picture is cancelled.
    let is_cancelled = options.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed));
    if is_cancelled { Err(RenderError::Cancelled) } else { Ok(image) }
}

/// Returns the colour of a pixel, unclamped. `i` counts from the left, `j` from the bottom.
pub fn color(scene: &Scene, i: u32, j: u32) -> DVec3 {
    let expanded = Expanded::new(Cow::Borrowed(scene), Shared::NONE);
    let world = World::of(&expanded);
    let ray = world.rays.ray(f64::from(i), f64::from(j));
    Shader { world: &world, lights: &world.middles(), cancel: None, paths: None }
        .color(ray, scene.depth.bounces())
}

/// Returns the nearest hit of a ray. Hits are equal if they are within the bound on rounding errors of each other.
/// Among equal hits, those without glass win over those with glass, and then the object that comes first wins.
///
/// `direction` is of unit length.
pub fn nearest(objects: &[Object], origin: DVec3, direction: DVec3) -> Option<Hit> {
    if objects.iter().any(|object| mesh(object).is_some()) {
        let (objects, faces) = expanded(objects, Colors::default(), Shared::NONE);
        let hit = nearest_of(&objects, Ray { origin, direction }, Some(&faces))?;
        return Some(Hit { object: faces.origin(hit.object), ..hit });
    }
    nearest_of(objects, Ray { origin, direction }, None)
}

/// Returns the nearest hit among objects that are not meshes.
fn nearest_of(objects: &[Object], ray: Ray, faces: Option<&Faces>) -> Option<Hit> {
    if objects.iter().any(|object| matches!(object, Object::Instance(_))) {
        let objects: Vec<Object> = objects.iter().map(|o| shapes::in_world(o).into_owned()).collect();
        world::nearest(&objects, ray, DVec3::ZERO, faces)
    } else {
        world::nearest(objects, ray, DVec3::ZERO, faces)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use glam::DVec2;
    use rayfold_scene::{Camera, DirectionalLight, Light, Material, Pinhole, Screen, Sphere};

    use super::*;

    fn material(ambient: f64, diffuse: f64, mirror: f64) -> Material {
        Material::new(DVec3::splat(ambient), DVec3::splat(diffuse), DVec3::splat(mirror)).unwrap()
    }

    fn one_pixel(objects: Vec<Object>, light: Option<DVec3>) -> Scene {
        let mut scene = Scene::new(Screen::new(1, 1).unwrap(), Camera::Orthographic);
        scene.set_background(DVec3::new(0.0, 0.25, 1.0)).unwrap();
        scene.objects = objects.into();
        scene.lights = light
            .into_iter()
            .map(|d| Light::Directional(DirectionalLight::new(DVec3::ONE, d).unwrap()))
            .collect();
        scene
    }

    fn sphere(radius: f64, z: f64, material: Material) -> Object {
        Object::Sphere(Sphere::new(radius, DVec3::new(0.0, 0.0, z), material).unwrap())
    }

    #[test]
    fn a_lit_sphere_is_ambient_plus_lambert() {
        let light = DVec3::new(3.0, 0.0, -3.0);
        let scene = one_pixel(vec![sphere(1.0, -5.0, material(0.125, 0.5, 0.0))], Some(light));
        let expected = 0.125 + 0.5 * 0.5f64.sqrt();
        assert!((color(&scene, 0, 0).x - expected).abs() < 1e-15);
    }

    #[test]
    fn what_stands_in_the_way_of_the_light_casts_a_shadow() {
        let objects =
            vec![sphere(1.0, -5.0, material(0.125, 0.5, 0.0)), sphere(0.5, 5.0, material(0.0, 0.0, 1.0))];
        let scene = one_pixel(objects, Some(DVec3::NEG_Z));
        assert_eq!(color(&scene, 0, 0).x, 0.125);
    }

    #[test]
    fn a_mirror_shows_the_background_and_a_light_from_behind_nothing() {
        let scene = one_pixel(vec![sphere(1.0, -5.0, material(0.125, 0.5, 0.5))], Some(DVec3::Z));
        assert_eq!(color(&scene, 0, 0), DVec3::new(0.125, 0.25, 0.625));
    }

    #[test]
    fn two_facing_mirrors_end_after_the_fifth_bounce() {
        let mirror = |z: f64| sphere(1.0, z, material(1.0, 0.0, 1.0));
        let scene = one_pixel(vec![mirror(-2.0), mirror(2.0)], None);
        assert_eq!(color(&scene, 0, 0), DVec3::splat(6.0));
    }

    #[test]
    fn an_eye_next_to_a_surface_stays_on_its_side() {
        // 1e-16 and 8e-16 from the surface of a sphere. The difference of its centre and the eye cannot be computed
        // without rounding.
        let eye = DVec3::new(-0.4922580368599684, -0.3291578856127372, -0.45973944677895595);
        let ball = |radius: f64| {
            let center = DVec3::new(eye.x, 5.269517229842112, eye.z);
            Object::Sphere(Sphere::new(radius, center, material(0.5, 0.0, 0.0)).unwrap())
        };
        for (radius, inside) in [(5.598675115454849, true), (5.598675115454848, false)] {
            let mut scene = one_pixel(vec![ball(radius)], None);
            let half = DVec2::splat(0.1);
            let away = Pinhole::new(eye, DVec3::NEG_Y, DVec3::Z, 1.0, -half, half).unwrap();
            scene.camera = Camera::Pinhole(away);
            assert_eq!(color(&scene, 0, 0) == DVec3::splat(0.5), inside, "{radius}");
        }
    }

    #[test]
    fn colours_beyond_all_numbers_cancel_none() {
        let bright = Material::new(DVec3::splat(-1e308), DVec3::splat(1e308), DVec3::new(1e308, 0.0, 0.0));
        let mut scene = one_pixel(vec![sphere(1.0, -5.0, bright.unwrap())], None);
        let light = |color: f64| {
            let light = DirectionalLight::new(DVec3::splat(color), DVec3::NEG_Z);
            Light::Directional(light.unwrap())
        };
        scene.lights = vec![light(1e308), light(-1e308), light(1e308)].into();
        assert_eq!(levels(color(&scene, 0, 0)), [255; 3]);
    }

    #[test]
    fn a_raised_flag_stops_the_rendering() {
        let flag = AtomicBool::new(true);
        let options = RenderOptions { cancel: Some(&flag), ..Default::default() };
        assert!(matches!(render(&one_pixel(vec![], None), &options), Err(RenderError::Cancelled)));
    }
}
