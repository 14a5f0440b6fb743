//! The backends, each a way to trace a scene, that tests and measurements compare.
//!
//! A new backend is one line in [`all`].

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::Scene;
use rayfold_tracer::{Level, Precision, RenderOptions, probe, reference};

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

/// The numbers that a backend computes with.
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
pub struct Backend {
    /// For people.
    pub name: String,
    /// What its errors are measured in.
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

/// Every backend that there is on this machine: each precision with each width of vectors, and what must not be seen in a
/// picture (the tree, the tile's size, the number of threads) with the widest.
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

/// The truth first, then the backends to compare with it, each following light through so many mirrors.
pub(crate) fn for_pictures(bounces: u32) -> Vec<Backend> {
    let options = RenderOptions { bounces: Some(bounces), ..Default::default() };
    let mut all = vec![reference_with(options), packets_by_the_textbook(options)];
    all.extend(PRECISIONS.map(|(precision, name)| packets(name, RenderOptions { precision, ..options })));
    all
}

/// The packets with formulas that know nothing of rounding.
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

/// The widths of vectors that the processor has, the widest first.
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

/// The tracer that pictures are made with.
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
    // A direction that `f32` holds stays one.
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

/// The plain `f64` tracer.
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
