//! The tracer that pictures are made with: packets of rays, by tiles, with the machine's widest instructions.
//!
//! It draws what [`crate::reference`] draws, at most one level apart but for isolated pixels, and the same picture bit
//! for bit for any tile size, number of threads and width of fused multiply-add. It knows the scene only as
//! [`geometry`] has recentred and scaled it.

/// Compiles an expression for every instruction set that has kernels, and evaluates the one for `level`.
#[cfg(target_arch = "x86_64")]
macro_rules! on {
    (narrow $level:expr, $simd:ident => $work:expr) => {
        if let Some($simd) = $level.as_sse4_2() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $work,
            )
        } else {
            unreachable!("asked for kernels that this machine has not")
        }
    };
    ($level:expr, $simd:ident => $work:expr) => {
        if let Some($simd) = $level.as_avx512() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $work,
            )
        } else if let Some($simd) = $level.as_avx2() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $work,
            )
        } else {
            on!(narrow $level, $simd => $work)
        }
    };
}

#[cfg(not(target_arch = "x86_64"))]
macro_rules! on {
    ($level:expr, $simd:ident => $work:expr) => {
        fearless_simd::dispatch!($level, $simd => $work)
    };
}

mod band;
mod coincidence;
mod doubt;
mod exact;
mod features;
mod generation;
mod geometry;
mod intersect;
mod light;
mod lists;
#[cfg(feature = "accuracy")]
mod naive;
mod precision;
mod prepare;
pub mod probe;
mod real;
mod search;
mod surfaces;
mod tile;
mod tree;
mod window;

use fearless_simd::{Level, Simd};
use image::RgbImage;
use rayfold_scene::Scene;

use crate::parallel::{CHANNELS, bands};
use crate::{Precision, RenderError, RenderOptions};
use band::{Band, Tile};
use features::{BUILT, Everything, Features, Kernel};
use geometry::{Geometry, Solid};
use prepare::Prepared;
use real::Real;
use tile::Scratch;
use window::Window;

/// Columns and rows of a tile.
const SIDE: (u32, u32) = (16, 16);

/// The same for scenes of more than so many objects: small tiles show few of them.
const SMALL_SIDE: (u32, u32) = (8, 8);
const MANY: usize = 512;

/// The first half of [`crate::render`]: a scene with all that is worked out before its first pixel, a tree of its
/// objects among it.
pub struct Drawing<'a>(Way<'a>);

enum Way<'a> {
    Single(Setup<'a, f32>),
    Double(Setup<'a, f64>),
    /// Numbers that the kernels cannot hold are left to the tracer that takes them one by one.
    Plain(&'a Scene, &'a RenderOptions<'a>),
}

impl<'a> Drawing<'a> {
    /// Prepares a scene, on the current rayon pool.
    ///
    /// # Errors
    /// When this build leaves out what the scene needs.
    pub fn new(scene: &'a Scene, options: &'a RenderOptions) -> Result<Self, RenderError> {
        let geometry = if has_kernels(options) { Geometry::new(scene, options.tree).ok() } else { None };
        let precision = |geometry| Some((geometry, precision::resolve(options, geometry, scene)?));
        Ok(Self(match geometry.as_ref().and_then(precision) {
            Some((geometry, Precision::F64)) => Way::Double(Setup::new(scene, geometry, options)?),
            Some((geometry, _)) => Way::Single(Setup::new(scene, geometry, options)?),
            None => Way::Plain(scene, options),
        }))
    }

    /// The second half: the image, the same each time.
    ///
    /// # Errors
    /// Those of [`crate::render`].
    pub fn draw(&self) -> Result<RgbImage, RenderError> {
        match &self.0 {
            Way::Single(setup) => setup.draw(kernel::<f32>),
            Way::Double(setup) => setup.draw(kernel::<f64>),
            Way::Plain(scene, options) => crate::reference::render(scene, options),
        }
    }
}

/// Whether there are kernels for the instructions; the first 64-bit processors of the x86 line have none of use.
#[cfg(target_arch = "x86_64")]
fn has_kernels(options: &RenderOptions) -> bool {
    options.level.unwrap_or_else(Level::new).as_sse4_2().is_some()
}

#[cfg(not(target_arch = "x86_64"))]
fn has_kernels(_: &RenderOptions) -> bool {
    true
}

/// The precision that [`Precision::Auto`] stands for in a scene.
pub(crate) fn precision(scene: &Scene) -> Precision {
    let geometry = Geometry::new(scene, None).ok();
    let resolved =
        geometry.and_then(|geometry| precision::resolve(&RenderOptions::default(), &geometry, scene));
    resolved.unwrap_or(Precision::F64)
}

/// Draws a scene by the textbook.
///
/// # Errors
/// Those of [`crate::render`].
#[cfg(feature = "accuracy")]
pub(crate) fn render_naive(scene: &Scene, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    Setup::new(scene, &Geometry::new(scene, options.tree)?, options)?.draw(naive::draw)
}

/// What a kernel needs to draw a scene.
struct Setup<'a, E> {
    scene: &'a Scene,
    options: &'a RenderOptions<'a>,
    prepared: Prepared<E>,
    window: Window,
    /// Columns and rows of a tile.
    side: (u32, u32),
}

impl<'a, E: Real> Setup<'a, E> {
    fn new(
        scene: &'a Scene,
        geometry: &Geometry,
        options: &'a RenderOptions<'a>,
    ) -> Result<Self, RenderError> {
        let size = (scene.screen.width(), scene.screen.height());
        let many = geometry.solids.len() > MANY;
        let side = options.tile.unwrap_or(if many { SMALL_SIDE } else { SIDE });
        let prepared = Prepared::<E>::new(scene, geometry, options.tree, side)?;
        let whole = geometry.whole();
        let mut solids: Vec<&Solid> =
            if prepared.tree.is_some() { vec![&whole] } else { geometry.solids.iter().collect() };
        solids.sort_by_key(|solid| solid.kind_rank());
        let window = Window::new(geometry, &solids, size, side, E::ROUNDOFF);
        Ok(Self { scene, options, prepared, window, side })
    }

    /// Draws bands of tiles side by side, each by `kernel`.
    fn draw(
        &self,
        kernel: impl Fn(&Job<E>, Level, Band, &mut Scratch<E>) + Sync,
    ) -> Result<RgbImage, RenderError> {
        let Self { scene, options, prepared, window, side } = self;
        let size = (scene.screen.width(), scene.screen.height());
        let background = crate::reference::levels(scene.background());
        let level = options.level.unwrap_or_else(Level::new);
        let bounces = options.bounces();
        // Boxed: it is passed from band to band by value.
        bands(
            scene.screen,
            side.1,
            options,
            || Box::new(Scratch::new()),
            |scratch, row, bytes| {
                let band = Band { bytes, size, background };
                kernel(&Job { prepared, window, side: *side, row, bounces }, level, band, scratch);
            },
        )
    }
}

/// A row of tiles to draw.
struct Job<'a, E> {
    prepared: &'a Prepared<E>,
    window: &'a Window,
    /// Columns and rows of a tile.
    side: (u32, u32),
    /// The first row of pixels.
    row: u32,
    /// Mirrorings that are followed.
    bounces: u32,
}

impl<E: Real> Job<'_, E> {
    #[inline(always)]
    fn draw<S: Simd, F: Features>(&self, simd: S, mut band: Band, scratch: &mut Scratch<E>) {
        let (width, _) = band.size;
        let height = (band.bytes.len() / (width as usize * CHANNELS)) as u32;
        for (column, left) in (0..width).step_by(self.side.0 as usize).enumerate() {
            let place = (column, (self.row / self.side.1) as usize);
            let tile = Tile {
                left,
                top: self.row,
                width: self.side.0.min(width - left),
                height,
                candidates: self.window.candidates(place.0, place.1),
                place,
                bounces: self.bounces,
            };
            tile::draw::<S, E, F>(simd, self.prepared, tile, scratch, &mut band);
        }
    }
}

/// Draws with the kernel that has just what the scene has.
#[cfg(target_arch = "x86_64")]
fn kernel<E: Real>(job: &Job<E>, level: Level, band: Band, scratch: &mut Scratch<E>) {
    if let Some(simd) = level.as_avx512() {
        job.draw_by_kernel(simd, band, scratch);
    } else if let Some(simd) = level.as_avx2() {
        job.draw_by_kernel(simd, band, scratch);
    } else {
        // Such machines are old, and few: one kernel will do for them.
        on!(narrow level, simd => job.draw::<_, Everything>(simd, band, scratch));
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn kernel<E: Real>(job: &Job<E>, level: Level, band: Band, scratch: &mut Scratch<E>) {
    on!(level, simd => job.draw_by_kernel(simd, band, scratch));
}

impl<E: Real> Job<'_, E> {
    #[inline(always)]
    fn draw_by_kernel<S: Simd>(&self, simd: S, band: Band, scratch: &mut Scratch<E>) {
        if BUILT.cuboids && self.prepared.needs.cuboids {
            self.by_triangles::<S, true>(simd, band, scratch);
        } else {
            self.by_triangles::<S, false>(simd, band, scratch);
        }
    }

    #[inline(always)]
    fn by_triangles<S: Simd, const C: bool>(&self, simd: S, band: Band, scratch: &mut Scratch<E>) {
        if BUILT.triangles && self.prepared.needs.triangles {
            self.by_mirrors::<S, C, true>(simd, band, scratch);
        } else {
            self.by_mirrors::<S, C, false>(simd, band, scratch);
        }
    }

    #[inline(always)]
    fn by_mirrors<S: Simd, const C: bool, const T: bool>(
        &self,
        simd: S,
        band: Band,
        scratch: &mut Scratch<E>,
    ) {
        if BUILT.mirrors && self.prepared.needs.mirrors {
            self.by_tree::<S, C, T, true>(simd, band, scratch);
        } else {
            self.by_tree::<S, C, T, false>(simd, band, scratch);
        }
    }

    #[inline(always)]
    fn by_tree<S: Simd, const C: bool, const T: bool, const M: bool>(
        &self,
        simd: S,
        band: Band,
        scratch: &mut Scratch<E>,
    ) {
        if BUILT.tree && self.prepared.needs.tree {
            simd.vectorize(
                #[inline(always)]
                || self.draw::<S, Kernel<C, T, M, true>>(simd, band, scratch),
            );
        } else {
            simd.vectorize(
                #[inline(always)]
                || self.draw::<S, Kernel<C, T, M, false>>(simd, band, scratch),
            );
        }
    }
}
