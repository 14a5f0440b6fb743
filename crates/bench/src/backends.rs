//! The backends that tests and measurements compare. A backend is a way to trace a scene.
//!
//! To add a backend, add a line to [`all`].

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::Scene;
use rayfold_tracer::{Level, Precision, RenderOptions, probe, reference};

/// A ray with its origin and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The start of the ray.
    pub origin: DVec3,
    /// The direction, of any length but zero.
    pub direction: DVec3,
}

/// The first hit of a ray with an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The position of the object in the script.
    pub object: usize,
    /// The distance along the ray, in units of the length of its direction.
    pub t: f64,
    /// The unit normal, facing the ray.
    pub normal: DVec3,
}

/// The arithmetic of a backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arithmetic {
    /// `f32` for every scene.
    Single,
    /// `f64` for every scene.
    Double,
    /// Chosen for each scene.
    Chosen,
}

type Hits = anyhow::Result<Vec<Option<Hit>>>;
type Nearest = Box<dyn Fn(&Scene, &[Ray]) -> Hits + Sync>;
type Render = Box<dyn Fn(&Scene) -> anyhow::Result<RgbImage> + Sync>;

/// A way to trace a scene.
pub struct Backend {
    /// The name in reports.
    pub name: String,
    /// The arithmetic in whose units its errors are measured.
    pub arithmetic: Arithmetic,
    nearest: Nearest,
    render: Render,
}

impl Backend {
    pub(crate) fn new(
        name: impl Into<String>,
        arithmetic: Arithmetic,
        nearest: impl Fn(&Scene, &[Ray]) -> Hits + Sync + 'static,
        render: impl Fn(&Scene) -> anyhow::Result<RgbImage> + Sync + 'static,
    ) -> Self {
        Self { name: name.into(), arithmetic, nearest: Box::new(nearest), render: Box::new(render) }
    }

    /// Returns the nearest hit of each ray.
    ///
    /// # Errors
    /// The errors of [`rayfold_tracer::render`].
    pub fn nearest(&self, scene: &Scene, rays: &[Ray]) -> Hits {
        (self.nearest)(scene, rays)
    }

    /// Renders the image of a scene.
    ///
    /// # Errors
    /// The errors of [`rayfold_tracer::render`].
    pub fn render(&self, scene: &Scene) -> anyhow::Result<RgbImage> {
        (self.render)(scene)
    }

    /// Returns the distance from `x` to the next number of this arithmetic (`f32` for [`Arithmetic::Chosen`]).
    pub fn ulp(&self, x: f64) -> f64 {
        let epsilon = match self.arithmetic {
            Arithmetic::Double => f64::EPSILON,
            Arithmetic::Single | Arithmetic::Chosen => f64::from(f32::EPSILON),
        };
        x.abs().log2().floor().exp2() * epsilon
    }
}

/// Returns every backend available on this machine: each precision with each vector width, and with the widest also
/// variants that must give the same picture (tree, tile size, number of threads).
pub fn all() -> Vec<Backend> {
    let mut all = vec![reference()];
    for ((precision, name), tile) in PRECISIONS.into_iter().zip([(4, 4), (64, 4), (8, 32)]) {
        let options = RenderOptions { precision, ..Default::default() };
        for (width, level) in levels() {
            all.push(packets(format!("{name} {width}"), RenderOptions { level: Some(level), ..options }));
        }
        all.push(packets(format!("{name} by a tree"), RenderOptions { tree: Some(true), ..options }));
        all.push(packets(
            format!("{name} {} x {} tiles", tile.0, tile.1),
            RenderOptions { tile: Some(tile), ..options },
        ));
    }
    all
}

/// Returns the true backend, then the backends to compare with it, each tracing this number of bounces.
pub(crate) fn for_pictures(bounces: u32) -> Vec<Backend> {
    let options = RenderOptions { bounces: Some(bounces), ..Default::default() };
    let mut all = vec![reference_with(options), packets_by_the_textbook(options)];
    all.extend(PRECISIONS.map(|(precision, name)| packets(name, RenderOptions { precision, ..options })));
    all
}

/// Returns the packets with textbook formulas that ignore rounding.
fn packets_by_the_textbook(options: RenderOptions<'static>) -> Backend {
    Backend::new(
        "f32 naive",
        Arithmetic::Single,
        |_, _| anyhow::bail!("only whole pictures are drawn by the textbook"),
        move |scene| Ok(rayfold_tracer::render_naive(scene, &options)?),
    )
}

const PRECISIONS: [(Precision, &str); 3] =
    [(Precision::Auto, "auto"), (Precision::F32, "f32 robust"), (Precision::F64, "f64")];

/// Returns the vector widths that the processor has, the widest first.
pub fn levels() -> Vec<(&'static str, Level)> {
    let best = Level::new();
    #[cfg(target_arch = "x86_64")]
    return [
        best.as_avx512().map(|level| ("AVX-512", Level::Avx512(level))),
        best.as_avx2().map(|level| ("AVX2", Level::Avx2(level))),
        best.as_sse4_2().map(|level| ("SSE4.2", Level::Sse4_2(level))),
    ]
    .into_iter()
    .flatten()
    .collect();
    #[cfg(not(target_arch = "x86_64"))]
    return vec![("the machine's vectors", best)];
}

/// Returns the tracer that draws pictures for users.
pub(crate) fn packets(name: impl Into<String>, options: RenderOptions<'static>) -> Backend {
    let arithmetic = match options.precision {
        Precision::Auto => Arithmetic::Chosen,
        Precision::F32 => Arithmetic::Single,
        Precision::F64 => Arithmetic::Double,
    };
    let nearest = move |scene: &Scene, rays: &[Ray]| packet_nearest(scene, rays, &options);
    Backend::new(name, arithmetic, nearest, move |scene| Ok(rayfold_tracer::render(scene, &options)?))
}

fn packet_nearest(scene: &Scene, rays: &[Ray], options: &RenderOptions) -> Hits {
    // A direction that is exact in `f32` stays so.
    let about_unit =
        |d: DVec3| if (d.length() - 1.0).abs() < f64::from(f32::EPSILON) { d } else { d.normalize() };
    let precision = match options.precision {
        Precision::Auto => rayfold_tracer::precision(scene),
        forced => forced,
    };
    let single = precision == Precision::F32;
    let unit = |d: DVec3| if single { about_unit(d) } else { d.normalize() };
    let units: Vec<_> = rays.iter().map(|ray| (ray.origin, unit(ray.direction))).collect();
    let found = probe::nearest_hits(scene, &units, &RenderOptions { precision, ..*options })?;
    let hit = |(found, ray): (Option<probe::Found>, &Ray)| {
        let found = found?;
        Some(Hit { object: found.object, t: found.distance / ray.direction.length(), normal: found.normal })
    };
    Ok(found.into_iter().zip(rays).map(hit).collect())
}

/// Returns the plain `f64` tracer.
pub fn reference() -> Backend {
    reference_with(RenderOptions::default())
}

fn reference_with(options: RenderOptions<'static>) -> Backend {
    Backend::new(
        "reference",
        Arithmetic::Double,
        |scene, rays| Ok(rays.iter().map(|ray| reference_nearest(scene, *ray)).collect()),
        move |scene| Ok(reference::render(scene, &options)?),
    )
}

fn reference_nearest(scene: &Scene, ray: Ray) -> Option<Hit> {
    let length = ray.direction.length();
    let hit = reference::nearest(&scene.objects, ray.origin, ray.direction / length)?;
    Some(Hit { object: hit.object, t: hit.distance / length, normal: hit.surface.normal })
}
