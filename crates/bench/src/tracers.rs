//! The ways to trace a scene that tests and measurements compare.
//!
//! A new way is one line in [`all`].

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::Scene;
use rayfold_tracer::{RenderOptions, reference};

/// A half-line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes, of any length but zero.
    pub direction: DVec3,
}

/// Where a ray meets an object first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Position of the object in the script.
    pub object: usize,
    /// In lengths of the ray's direction.
    pub t: f64,
    /// Unit normal, facing the ray.
    pub normal: DVec3,
}

/// The numbers that a way computes with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arithmetic {
    /// Always `f32`.
    Single,
    /// Always `f64`.
    Double,
    /// What the scene needs.
    Chosen,
}

type Nearest = Box<dyn Fn(&Scene, &[Ray]) -> Vec<Option<Hit>> + Sync>;
type Render = Box<dyn Fn(&Scene) -> anyhow::Result<RgbImage> + Sync>;

/// A way to trace.
pub struct Tracer {
    /// For people.
    pub name: String,
    /// What its errors are measured in.
    pub arithmetic: Arithmetic,
    nearest: Nearest,
    render: Render,
}

impl Tracer {
    /// The nearest hit of each ray.
    pub fn nearest(&self, scene: &Scene, rays: &[Ray]) -> Vec<Option<Hit>> {
        (self.nearest)(scene, rays)
    }

    /// The image.
    ///
    /// # Errors
    /// Those of [`rayfold_tracer::render`].
    pub fn render(&self, scene: &Scene) -> anyhow::Result<RgbImage> {
        (self.render)(scene)
    }

    /// The distance from `x` to the next number of this arithmetic (`f32` where it is chosen).
    pub fn ulp(&self, x: f64) -> f64 {
        let epsilon = match self.arithmetic {
            Arithmetic::Double => f64::EPSILON,
            Arithmetic::Single | Arithmetic::Chosen => f64::from(f32::EPSILON),
        };
        x.abs().log2().floor().exp2() * epsilon
    }
}

/// Every way that there is on this machine.
pub fn all() -> Vec<Tracer> {
    vec![reference()]
}

/// The plain `f64` tracer.
pub fn reference() -> Tracer {
    Tracer {
        name: "reference".into(),
        arithmetic: Arithmetic::Double,
        nearest: Box::new(|scene, rays| rays.iter().map(|ray| reference_nearest(scene, *ray)).collect()),
        render: Box::new(|scene| Ok(reference::render(scene, &RenderOptions::default())?)),
    }
}

fn reference_nearest(scene: &Scene, ray: Ray) -> Option<Hit> {
    let length = ray.direction.length();
    let hit = reference::nearest(&scene.objects, ray.origin, ray.direction / length)?;
    Some(Hit { object: hit.object, t: hit.distance / length, normal: hit.surface.normal })
}
