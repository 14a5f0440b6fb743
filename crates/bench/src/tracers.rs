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
    /// Unit normal, facing the ray, where the way tells it.
    pub normal: Option<DVec3>,
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

type Hits = anyhow::Result<Vec<Option<Hit>>>;
type Nearest = Box<dyn Fn(&Scene, &[Ray]) -> Hits + Sync>;
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
    pub(crate) fn new(
        name: impl Into<String>,
        arithmetic: Arithmetic,
        nearest: impl Fn(&Scene, &[Ray]) -> Hits + Sync + 'static,
        render: impl Fn(&Scene) -> anyhow::Result<RgbImage> + Sync + 'static,
    ) -> Self {
        Self { name: name.into(), arithmetic, nearest: Box::new(nearest), render: Box::new(render) }
    }

    /// The nearest hit of each ray.
    ///
    /// # Errors
    /// Those of [`rayfold_tracer::render`].
    pub fn nearest(&self, scene: &Scene, rays: &[Ray]) -> Hits {
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

/// The truth first, then the ways between which the user can choose.
pub fn for_pictures() -> Vec<Tracer> {
    vec![reference()]
}

/// The plain `f64` tracer.
pub fn reference() -> Tracer {
    Tracer::new(
        "reference",
        Arithmetic::Double,
        |scene, rays| Ok(rays.iter().map(|ray| reference_nearest(scene, *ray)).collect()),
        |scene| Ok(reference::render(scene, &RenderOptions::default())?),
    )
}

fn reference_nearest(scene: &Scene, ray: Ray) -> Option<Hit> {
    let length = ray.direction.length();
    let hit = reference::nearest(&scene.objects, ray.origin, ray.direction / length)?;
    Some(Hit { object: hit.object, t: hit.distance / length, normal: Some(hit.surface.normal) })
}
