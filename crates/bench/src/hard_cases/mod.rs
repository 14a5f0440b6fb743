//! Inputs on which ray tracers are known to go wrong, each with a figure and the bound that it must keep.
//!
//! The table [`CASES`] is the list; a case measures every way to trace and says by how much it stays within its bound.
//! What is right is said by the [oracle], or where an image is compared with itself by that image. Rays
//! and positions are numbers that `f32` holds, unless the case is about those that it does not: so a figure is the
//! error of tracing, not that of rounding the input. Everything random comes from [`SEED`].

mod bounces;
mod boxes;
mod everyday;
mod extremes;
mod images;
mod nasty;
mod searched;
mod spheres;
mod ties;
mod triangles;

use std::fmt;

use anyhow::{Context, Result};
use glam::DVec3;
use rayfold_scene::{Camera, Object, Scene, Screen};

use crate::oracle;
use crate::tracers::{Arithmetic, Hit, Ray, Tracer};

pub(crate) use nasty::one_of_each;

/// Where all random numbers of the cases come from.
pub const SEED: u64 = 20_240_607;

/// How much of a case is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Seconds for all cases together.
    Quick,
    /// What the report shows.
    Full,
}

impl Size {
    fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

/// One measurement.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The way that was measured.
    pub tracer: String,
    /// What was measured, with its unit.
    pub what: String,
    /// How many rays, pixels or inputs the figure stands for.
    pub samples: usize,
    /// The worst or the count found; not a number is a failure.
    pub measured: f64,
    /// What it may be at most; `None` where nothing is promised.
    pub bound: Option<f64>,
}

impl Figure {
    /// Whether the bound is kept.
    pub fn passes(&self) -> bool {
        self.bound.is_none_or(|bound| self.measured <= bound)
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.passes() { "ok  " } else { "FAIL" };
        write!(f, "{verdict} {:24} {}: {:.3e}", self.tracer, self.what, self.measured)?;
        match self.bound {
            Some(bound) => write!(f, " <= {bound:.1e}")?,
            None => write!(f, " (no bound)")?,
        }
        write!(f, " of {}", self.samples)
    }
}

/// Collects the figures of a case.
#[derive(Debug, Default)]
pub struct Figures(Vec<Figure>);

impl Figures {
    fn add(
        &mut self,
        tracer: &Tracer,
        what: impl Into<String>,
        samples: usize,
        measured: f64,
        bound: impl Into<Option<f64>>,
    ) {
        let (tracer, what, bound) = (tracer.name.clone(), what.into(), bound.into());
        self.0.push(Figure { tracer, what, samples, measured, bound });
    }
}

/// A hard case.
pub struct Case {
    /// Its number.
    pub number: &'static str,
    /// What makes it hard.
    pub title: &'static str,
    run: fn(&[Tracer], Size, &mut Figures) -> Result<()>,
}

impl Case {
    /// Measures every tracer.
    ///
    /// # Errors
    /// When a scene cannot be built or rendered.
    pub fn figures(&self, tracers: &[Tracer], size: Size) -> Result<Vec<Figure>> {
        let mut figures = Figures::default();
        (self.run)(tracers, size, &mut figures).with_context(|| format!("case {}", self.number))?;
        Ok(figures.0)
    }
}

/// All hard cases.
pub const CASES: &[Case] = &[
    Case { number: "1-2", title: "a sphere at 10 to 1e6 radii", run: spheres::distant },
    Case { number: "3", title: "a sphere of radius 1e7 from height 1", run: spheres::horizon },
    Case { number: "4", title: "tangent rays", run: spheres::tangent },
    Case { number: "5", title: "an origin on or in a sphere or box", run: spheres::inside },
    Case { number: "6", title: "radii 1e7 : 1 in one scene", run: spheres::giant_and_dwarf },
    Case { number: "7", title: "scaled by powers of two", run: images::scaled_by_two },
    Case { number: "8", title: "scaled by powers of ten", run: images::scaled_by_ten },
    Case { number: "9", title: "a scene of size 1 at offset 1e6", run: images::far_from_the_origin },
    Case { number: "10", title: "shared edges", run: triangles::shared_edges },
    Case { number: "11", title: "shared vertices", run: triangles::shared_vertices },
    Case { number: "12", title: "a needle triangle 1e6 : 1", run: triangles::needles },
    Case { number: "13", title: "degenerate triangles", run: triangles::degenerate },
    Case { number: "14", title: "rays in a triangle's plane", run: triangles::in_plane },
    Case { number: "15-16", title: "rays parallel to slabs, with +0 and -0", run: boxes::parallel },
    Case { number: "17", title: "a BVH against brute force", run: triangles::tree_or_not },
    Case { number: "18", title: "flat boxes", run: boxes::flat },
    Case { number: "19", title: "subnormal, huge and infinite inputs", run: extremes::inputs },
    Case { number: "20", title: "lit convex objects", run: images::acne },
    Case { number: "21", title: "a contact shadow", run: images::contact_shadow },
    Case { number: "22", title: "grazing light on a coarse mesh", run: images::grazing_light },
    Case { number: "23", title: "mirror spheres face to face", run: bounces::face_to_face },
    Case { number: "24", title: "identical objects", run: ties::identical },
    Case { number: "25", title: "random scenes", run: nasty::scenes },
    Case { number: "26", title: "random scenes as people write them", run: everyday::scenes },
    Case { number: "27", title: "random scenes searched in every way", run: searched::scenes },
];

/// A random number generator of a case's own.
fn random(case: u64) -> fastrand::Rng {
    fastrand::Rng::with_seed(SEED.wrapping_mul(1000) + case)
}

/// A point of the unit sphere.
fn direction(rng: &mut fastrand::Rng) -> DVec3 {
    loop {
        let v = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        if (0.01..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// A scene of objects alone, for rays that are given.
fn objects_only(objects: Vec<Object>) -> Result<Scene> {
    let mut scene = Scene::new(Screen::new(1, 1)?, Camera::Orthographic);
    scene.objects = objects.into();
    Ok(scene)
}

/// The nearest hits on an object of rays that are those of a camera: it stands wherever rays start.
fn from_eyes(tracer: &Tracer, object: Object, rays: &[Ray]) -> Result<Vec<Option<Hit>>> {
    let mut hits = Vec::new();
    for rays in rays.chunk_by(|a, b| a.origin == b.origin) {
        let eye = rays[0].origin;
        let scene = objects_seen(vec![object], eye, eye + DVec3::new(0.3, 0.2, -1.0), 1.0)?;
        hits.extend(tracer.nearest(&scene, rays)?);
    }
    Ok(hits)
}

/// A scene of objects that a camera at `eye` sees `width` wide a unit of distance, and whose rays are given: what
/// chooses the arithmetic looks at all of it.
fn objects_seen(objects: Vec<Object>, eye: DVec3, target: DVec3, width: f64) -> Result<Scene> {
    let mut scene = objects_only(objects)?;
    scene.screen = Screen::new(1000, 1000)?;
    scene.camera = crate::scenes::looking_at(eye, target, width, scene.screen)?;
    Ok(scene)
}

/// A ray from `origin` towards `target`, rounded to `f32`, about of unit length.
fn aimed(origin: DVec3, target: DVec3) -> Ray {
    let origin = crate::scenes::single(origin);
    Ray { origin, direction: crate::scenes::single((target - origin).normalize()) }
}

/// What is right for a ray: distance in lengths of the direction, normal.
struct Truth {
    t: f64,
    normal: DVec3,
}

fn truths(objects: &[Object], rays: &[Ray]) -> Vec<Option<Truth>> {
    rays.iter()
        .map(|ray| {
            let hit = oracle::nearest(objects, ray.origin, ray.direction)?;
            Some(Truth { t: hit.t.to_f64(), normal: hit.normal.to_dvec3() })
        })
        .collect()
}

/// The larger; not a number wins.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// A bound for those that choose their arithmetic or use `f64`; `f32` by force is only shown.
fn unless_single(tracer: &Tracer, bound: f64) -> Option<f64> {
    (tracer.arithmetic != Arithmetic::Single).then_some(bound)
}
