//! The fast tracer, which draws the pictures: packets of rays, tile by tile, with the machine's widest instructions.
//!
//! It draws the picture of [`crate::reference`], at most one level apart except in isolated pixels. The picture is the
//! same bit for bit for any tile size, number of threads and width of fused multiply-add. It uses the scene only as
//! [`placement::geometry`] has recentred and scaled it.

mod acceleration;
mod arithmetic;
mod bodies;
mod build;
mod film;
mod lights;
mod materials;
mod placement;
pub mod probe;
mod rays;
mod sampled;
mod shapes;
mod shared;
mod transport;

use core::ops::Range;
use std::sync::atomic::Ordering;

use fearless_simd::{Level, Simd};
use image::{DynamicImage, RgbImage};
use rayfold_scene::Scene;

use self::sampled::Sampled;
use self::shapes::{Formulas, Shape};
use crate::cover::{self, Lit};
use crate::fast::arithmetic::dispatch::on;
use crate::fast::arithmetic::real::Real;
use crate::fast::arithmetic::rounding::MARGIN;
use crate::fast::build::features::{self, Kernel};
use crate::fast::build::precision;
use crate::fast::build::prepare::Prepared;
use crate::fast::build::ties::Ranked;
use crate::fast::film::band::{Band, FlatBackground, Tile};
use crate::fast::film::tile::{self, Scratch};
use crate::fast::placement::geometry::Geometry;
use crate::fast::placement::window::{Grid, Window};
#[cfg(feature = "accuracy")]
use crate::fast::shapes::naive;
use crate::fast::shapes::shape::Robust;
use crate::meshes::Shared;
use crate::parallel::{CHANNELS, bands, bands_of};
use crate::parts;
use crate::reference::windows;
use crate::sampling::guide::Guide;
use crate::sampling::rough::Energies;
use crate::{Exposure, Precision, RenderError, RenderOptions};

pub(crate) use crate::fast::film::tone::encoded;
pub(crate) use crate::fast::probe::Finder;

/// The columns and rows of a tile.
const SIDE: (u32, u32) = (16, 16);

/// The columns and rows of a tile in scenes of more than `MANY` objects, none of which is a body of glass: a small tile shows
/// few of them.
const SMALL_SIDE: (u32, u32) = (8, 8);
const MANY: usize = 512;

/// A prepared scene, the first half of [`crate::render`]: the scene with all data that is computed before its first
/// pixel, such as a tree of its objects.
pub struct Drawing<'a>(Backend<'a>);

/// The renderer of a scene.
enum Backend<'a> {
    Single(Setup<'a, f32>),
    Double(Setup<'a, f64>),
    SampledSingle(Sampled<'a, f32>),
    SampledDouble(Sampled<'a, f64>),
    /// The reference tracer, which traces one ray at a time, for scenes whose numbers the kernels cannot represent.
    Reference(Exposure<'a>, &'a RenderOptions<'a>),
}

impl<'a> Drawing<'a> {
    /// Prepares a scene, on the current rayon pool.
    ///
    /// # Errors
    /// Fails if this build leaves out a feature that the scene needs.
    pub fn new(scene: &'a Scene, options: &'a RenderOptions) -> Result<Self, RenderError> {
        Self::exposed(Exposure::still(scene), options)
    }

    /// Prepares a scene that may move while the shutter is open, on the current rayon pool.
    ///
    /// # Errors
    /// Fails if this build leaves out a feature that the scene needs.
    pub fn exposed(exposure: Exposure<'a>, options: &'a RenderOptions) -> Result<Self, RenderError> {
        parts::check(exposure.scene())?;
        let scene = exposure.scene();
        if parts::BUILT.samples && scene.samples.most() > 1 {
            return Ok(Self(
                sampled_backend(exposure, options)?.unwrap_or(Backend::Reference(exposure, options)),
            ));
        }
        let Ranked { scene: ranked, faces, .. } = &Ranked::new(scene, Shared::by(options));
        let geometry = || Geometry::with_faces(ranked, faces.as_ref(), options.tree).ok();
        let geometry = if has_kernels(options) { geometry() } else { None };
        let precision = |geometry| Some((precision::resolve(options, &geometry, ranked)?, geometry));
        Ok(Self(match geometry.and_then(precision) {
            Some((Precision::F64, geometry)) => {
                let geometry = geometry.with_shared_planes(ranked).with_shared_surfaces(ranked);
                Backend::Double(Setup::new(scene, ranked, &geometry, options)?)
            }
            Some((_, geometry)) => {
                let geometry = geometry.with_shared_surfaces_if_single(ranked, options);
                Backend::Single(Setup::new(scene, ranked, &geometry, options)?)
            }
            None => Backend::Reference(exposure, options),
        }))
    }

    /// Draws the picture. A scene without background gives a picture with alpha, unless there is a
    /// [matte](crate::RenderOptions::matte).
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn draw_picture(&self) -> Result<DynamicImage, RenderError> {
        self.draw_picture_rows(0..self.scene().screen.height())
    }

    /// Draws some rows of the picture, as [`Self::draw_rows`] does of the image.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn draw_picture_rows(&self, rows: Range<u32>) -> Result<DynamicImage, RenderError> {
        if !self.has_alpha() {
            return self.draw_rows(rows).map(DynamicImage::ImageRgb8);
        }
        let rows = self.inside(rows);
        let lit = self.lit_rows(rows.clone(), self.margin())?;
        let size = (self.scene().screen.width(), rows.end - rows.start);
        Ok(DynamicImage::ImageRgba8(cover::straight(size, self.scene().tone, &lit)))
    }

    /// Returns whether pictures have alpha.
    fn has_alpha(&self) -> bool {
        self.scene().background.is_none() && self.options().matte.is_none()
    }

    /// Draws the image: the second half of [`crate::render`]. The result is the same each time. If a scene has no
    /// background, the image shows the [matte](crate::RenderOptions::matte), or black.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn draw(&self) -> Result<RgbImage, RenderError> {
        self.draw_rows(0..self.scene().screen.height())
    }

    /// Draws some rows of the image, counted from the top. The pixels are exactly those of the whole image. It takes
    /// the time and memory of those rows, and of the [margin](Self::margin) above and below them. Rows outside the
    /// image are left out.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn draw_rows(&self, rows: Range<u32>) -> Result<RgbImage, RenderError> {
        self.draw_within(rows, self.margin())
    }

    /// Draws rows without their margin and discards the pixels, which can differ from those of the image. Takes about
    /// as long as [`Self::draw_rows`]: for estimates of the time that the whole image will take.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn sketch_rows(&self, rows: Range<u32>) -> Result<(), RenderError> {
        self.draw_within(rows, 0).map(drop)
    }

    /// Returns how many rows above and below a row can change its pixels. It is 0 unless sampling is adaptive: then
    /// noisy pixels request samples for their neighbours.
    pub fn margin(&self) -> u32 {
        match &self.0 {
            Backend::SampledSingle(sampled) => sampled.margin(),
            Backend::SampledDouble(sampled) => sampled.margin(),
            Backend::Single(_) | Backend::Double(_) | Backend::Reference(..) => 0,
        }
    }

    /// Draws the picture as [`Self::draw_picture`] does. `each` is called after each pass over the image except the
    /// last, with a function that makes the picture so far: an estimate of the whole picture, each with more samples
    /// than the one before. With one sample per pixel `each` is not called.
    ///
    /// # Errors
    /// The errors of [`crate::render`], and those of `each`.
    pub fn draw_progressively(
        &self,
        mut each: impl FnMut(&dyn Fn() -> Result<DynamicImage, RenderError>) -> Result<(), RenderError>,
    ) -> Result<DynamicImage, RenderError> {
        match &self.0 {
            Backend::SampledSingle(sampled) => sampled.draw_progressively(&mut each),
            Backend::SampledDouble(sampled) => sampled.draw_progressively(&mut each),
            Backend::Single(_) | Backend::Double(_) | Backend::Reference(..) => self.draw_picture(),
        }
    }

    /// Draws the light of the image before its conversion to levels: three numbers from 0 to 1 for each pixel, row by
    /// row from the top, before [`rayfold_scene::Tone`]. With one sample per pixel the reference tracer draws it, which
    /// takes longer the more objects there are.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn draw_light(&self) -> Result<Vec<f32>, RenderError> {
        match &self.0 {
            Backend::SampledSingle(sampled) => sampled.light(),
            Backend::SampledDouble(sampled) => sampled.light(),
            Backend::Single(setup) => crate::reference::light(Exposure::still(setup.scene), setup.options),
            Backend::Double(setup) => crate::reference::light(Exposure::still(setup.scene), setup.options),
            Backend::Reference(exposure, options) => crate::reference::light(*exposure, options),
        }
    }

    /// Draws the light of the image as [`Self::draw_light`] does, and its cover: four numbers from 0 to 1 for each
    /// pixel. The light is premultiplied by the cover. A scene with a background covers every pixel.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn draw_light_and_cover(&self) -> Result<Vec<f32>, RenderError> {
        let scene = self.scene();
        let lit = if scene.background.is_none() {
            self.lit_rows(0..scene.screen.height(), 0)?
        } else {
            self.draw_light()?
                .as_chunks()
                .0
                .iter()
                .map(|&[red, green, blue]| [red, green, blue, 1.0])
                .collect()
        };
        Ok(lit.into_flattened())
    }

    /// Draws rows of a scene without background.
    fn lit_rows(&self, rows: Range<u32>, margin: u32) -> Result<Vec<Lit>, RenderError> {
        match &self.0 {
            Backend::Single(setup) => setup.lit_rows(rows),
            Backend::Double(setup) => setup.lit_rows(rows),
            Backend::SampledSingle(sampled) => sampled.lit_rows(rows, margin),
            Backend::SampledDouble(sampled) => sampled.lit_rows(rows, margin),
            Backend::Reference(exposure, options) => crate::reference::lit_rows(*exposure, rows, options),
        }
    }

    fn draw_within(&self, rows: Range<u32>, margin: u32) -> Result<RgbImage, RenderError> {
        let rows = self.inside(rows);
        if rows.is_empty() {
            return Ok(RgbImage::default());
        }
        let scene = self.scene();
        if scene.background.is_none() {
            let size = (scene.screen.width(), rows.end - rows.start);
            let lit = self.lit_rows(rows, margin)?;
            return Ok(cover::over(size, scene.tone, &lit, self.options().matte.unwrap_or_default()));
        }
        match &self.0 {
            Backend::Single(setup) => setup.draw::<Robust>(rows),
            Backend::Double(setup) => setup.draw::<Robust>(rows),
            Backend::SampledSingle(sampled) => sampled.draw_rows(rows, margin),
            Backend::SampledDouble(sampled) => sampled.draw_rows(rows, margin),
            Backend::Reference(exposure, options) => {
                crate::reference::render_exposed_rows(*exposure, rows, options)
            }
        }
    }

    /// Returns the part of some rows that is inside the image.
    fn inside(&self, rows: Range<u32>) -> Range<u32> {
        let end = rows.end.min(self.scene().screen.height());
        rows.start.min(end)..end
    }

    fn scene(&self) -> &Scene {
        match &self.0 {
            Backend::Single(setup) => setup.scene,
            Backend::Double(setup) => setup.scene,
            Backend::SampledSingle(sampled) => sampled.scene(),
            Backend::SampledDouble(sampled) => sampled.scene(),
            Backend::Reference(exposure, _) => exposure.scene(),
        }
    }

    fn options(&self) -> &RenderOptions<'_> {
        match &self.0 {
            Backend::Single(setup) => setup.options,
            Backend::Double(setup) => setup.options,
            Backend::SampledSingle(sampled) => sampled.options(),
            Backend::SampledDouble(sampled) => sampled.options(),
            Backend::Reference(_, options) => options,
        }
    }
}

/// A picture before its conversion to levels.
#[cfg(feature = "accuracy")]
#[derive(Clone, Debug)]
pub struct Means {
    /// The means of the pixels, row by row from the top, in 0..1, before [`rayfold_scene::Tone`].
    pub means: Vec<glam::DVec3>,
    /// The number of camera rays of each pixel.
    pub counts: Vec<u32>,
}

#[cfg(feature = "accuracy")]
impl Drawing<'_> {
    /// Returns the picture before its conversion to levels, or `None` if it is not drawn by sampling kernels.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub fn draw_means(&self) -> Result<Option<Means>, RenderError> {
        let rows = 0..self.scene().screen.height();
        let film = match &self.0 {
            Backend::SampledSingle(sampled) => sampled.expose(rows, |_| Ok(()))?,
            Backend::SampledDouble(sampled) => sampled.expose(rows, |_| Ok(()))?,
            Backend::Single(_) | Backend::Double(_) | Backend::Reference(..) => return Ok(None),
        };
        let (means, counts) = film.means().unzip();
        Ok(Some(Means { means, counts }))
    }
}

/// Returns the backend for pictures of several samples per pixel, or `None` if there are no kernels for the scene.
fn sampled_backend<'a>(
    exposure: Exposure<'a>,
    options: &'a RenderOptions,
) -> Result<Option<Backend<'a>>, RenderError> {
    let scene = exposure.scene();
    if !has_kernels(options) {
        return Ok(None);
    }
    let moments = exposure.moments();
    let guides = if parts::BUILT.paths {
        Guide::of(&moments, windows(&moments[0]))
    } else {
        vec![None; moments.len()]
    };
    let (moments, faces): (Vec<Scene>, Vec<_>) = moments
        .iter()
        .map(|moment| {
            let Ranked { scene, faces, .. } = Ranked::new(moment, Shared::by(options));
            (scene.into_owned(), faces)
        })
        .unzip();
    let energies = if parts::BUILT.paths { Energies::of(&moments) } else { Energies::default() };
    let geometries = moments.iter().zip(&faces).zip(guides).map(|((moment, faces), guide)| {
        let geometry = Geometry::with_faces(moment, faces.as_ref(), options.tree);
        geometry.map(|geometry| geometry.with_paths(&energies, guide))
    });
    let Ok(geometries) = geometries.collect::<Result<Vec<_>, _>>() else { return Ok(None) };
    let precisions = geometries.iter().zip(&moments);
    let precisions = precisions.map(|(geometry, moment)| precision::resolve(options, geometry, moment));
    let Some(precisions) = precisions.collect::<Option<Vec<_>>>() else { return Ok(None) };
    Ok(Some(if precisions.contains(&Precision::F64) {
        let geometries = geometries.into_iter().zip(&moments);
        let exact = |(geometry, moment): (Geometry, &Scene)| {
            geometry.with_shared_planes(moment).with_shared_surfaces(moment)
        };
        let geometries: Vec<_> = geometries.map(exact).collect();
        Backend::SampledDouble(Sampled::new(scene, &moments, &geometries, options)?)
    } else {
        let geometries = geometries.into_iter().zip(&moments);
        let single =
            |(geometry, moment): (Geometry, &Scene)| geometry.with_shared_surfaces_if_single(moment, options);
        let geometries: Vec<_> = geometries.map(single).collect();
        Backend::SampledSingle(Sampled::new(scene, &moments, &geometries, options)?)
    }))
}

/// Returns whether there are kernels for the instruction set. The first 64-bit x86 processors lack the instructions
/// that kernels need.
#[cfg(target_arch = "x86_64")]
fn has_kernels(options: &RenderOptions) -> bool {
    let level = options.level.unwrap_or_else(Level::new);
    if cfg!(feature = "narrow") { level.as_sse4_2().is_some() } else { level.as_avx2().is_some() }
}

#[cfg(not(target_arch = "x86_64"))]
fn has_kernels(_: &RenderOptions) -> bool {
    true
}

/// Returns the precision that [`Precision::Auto`] selects for a scene.
pub(crate) fn precision(scene: &Scene) -> Precision {
    let Ranked { scene, faces, .. } = &Ranked::new(scene, Shared::by(&RenderOptions::default()));
    let geometry = Geometry::with_faces(scene, faces.as_ref(), None).ok();
    let resolved =
        geometry.and_then(|geometry| precision::resolve(&RenderOptions::default(), &geometry, scene));
    resolved.unwrap_or(Precision::F64)
}

/// Draws a scene by textbook formulas.
///
/// # Errors
/// The errors of [`crate::render`].
#[cfg(feature = "accuracy")]
pub(crate) fn render_naive(scene: &Scene, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    let Ranked { scene: ranked, .. } = &Ranked::new(scene, Shared::NONE);
    let setup = Setup::<f32>::new(scene, ranked, &Geometry::new(ranked, options.tree)?, options)?;
    setup.draw::<naive::Naive>(0..scene.screen.height())
}

/// The data that a kernel needs to draw a scene.
struct Setup<'a, E> {
    scene: &'a Scene,
    options: &'a RenderOptions<'a>,
    prepared: Prepared<E>,
    window: Window,
    /// The window of the bodies, if there are few.
    bodies: Option<Window>,
    /// The columns and rows of a tile.
    side: (u32, u32),
}

impl<'a, E: Real> Setup<'a, E> {
    fn new(
        scene: &'a Scene,
        ranked: &Scene,
        geometry: &Geometry,
        options: &'a RenderOptions<'a>,
    ) -> Result<Self, RenderError> {
        let size = (scene.screen.width(), scene.screen.height());
        // Rays in glass are many, and go apart soon: the more of them wait together, the fuller are packets.
        let has_glass = || geometry.faces.as_ref().is_some_and(|faces| faces.have_inside());
        let many = geometry.solids.len() > MANY && !has_glass();
        let side = options.tile.unwrap_or(if many { SMALL_SIDE } else { SIDE });
        let grid = Grid { size, side, margin: MARGIN, lens: None };
        let prepared = Prepared::<E>::new(ranked, geometry, options.tree, &grid)?;
        let mut shapes: Vec<Shape> = match &prepared.tree {
            Some(_) => vec![Shape::of_box(geometry.whole())],
            None => geometry.solids.iter().map(|solid| solid.shape).collect(),
        };
        shapes.sort_by_key(|shape| shape.kind().number());
        let window = Window::new(geometry.view, &shapes, &grid, E::ROUNDOFF);
        let bodies = Window::of_bodies(geometry.view, prepared.boxes_of_bodies(), &grid, E::ROUNDOFF);
        Ok(Self { scene, options, prepared, window, bodies, side })
    }

    /// Draws bands of tiles in parallel, those that contain these rows.
    fn draw<By: Formulas<E>>(&self, rows: Range<u32>) -> Result<RgbImage, RenderError> {
        let Self { scene, options, side, .. } = self;
        let image = bands(
            scene.screen,
            rows,
            side.1,
            options,
            || self.scratch(),
            |scratch, row, bytes| {
                let rows = bytes.len() / (scene.screen.width() as usize * CHANNELS);
                self.draw_band::<By>(scratch, row, rows as u32, (bytes, &mut []));
            },
        )?;
        if self.is_cut_short() { Err(RenderError::Cancelled) } else { Ok(image) }
    }

    /// Draws rows of a scene without background.
    fn lit_rows(&self, rows: Range<u32>) -> Result<Vec<Lit>, RenderError> {
        let Self { scene, options, side, .. } = self;
        let lit = bands_of::<_, Lit, 1>(
            scene.screen,
            rows,
            side.1,
            options,
            || self.scratch(),
            |scratch, row, lit| {
                let rows = lit.len() / scene.screen.width() as usize;
                self.draw_band::<Robust>(scratch, row, rows as u32, (&mut [], lit));
            },
        )?;
        if self.is_cut_short() { Err(RenderError::Cancelled) } else { Ok(lit) }
    }

    // Boxed, because it is passed from band to band by value.
    fn scratch(&self) -> Box<Scratch<'_, E>> {
        Box::new(Scratch::new(self.options.cancel))
    }

    /// Draws a band of this many rows, from a row on, into bytes or into pixels.
    fn draw_band<By: Formulas<E>>(
        &self,
        scratch: &mut Scratch<E>,
        row: u32,
        rows: u32,
        (bytes, lit): (&mut [u8], &mut [Lit]),
    ) {
        let Self { scene, options, prepared, window, bodies, side } = self;
        let size = (scene.screen.width(), scene.screen.height());
        let backdrop = if prepared.is_clear() { glam::DVec3::ZERO } else { scene.surroundings().colors().0 };
        let background = FlatBackground::new::<E>(backdrop, scene.tone);
        let band = Band { bytes, lit, rows, size, background, tone: scene.tone };
        let windows = (window, bodies.as_ref());
        let job = Job { prepared, windows, side: *side, row, bounces: options.bounces(scene) };
        draw::<E, By>(&job, options.level.unwrap_or_else(Level::new), band, scratch);
    }

    /// Returns whether a tile may have stopped halfway, as it does with much glass if the picture is cancelled.
    fn is_cut_short(&self) -> bool {
        let is_cancelled = || self.options.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed));
        self.prepared.has_glass() && is_cancelled()
    }
}

/// A row of tiles to draw.
struct Job<'a, E> {
    prepared: &'a Prepared<E>,
    /// The windows of the objects and, if there are few, of the bodies.
    windows: (&'a Window, Option<&'a Window>),
    /// The columns and rows of a tile.
    side: (u32, u32),
    /// The first row of pixels.
    row: u32,
    /// The number of bounces that are followed.
    bounces: u32,
}

impl<E: Real> Job<'_, E> {
    #[inline(always)]
    fn draw<S: Simd, N: Kernel<E>>(&self, simd: S, mut band: Band, scratch: &mut Scratch<E>) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (width, _) = band.size;
                let height = band.rows;
                for (column, left) in (0..width).step_by(self.side.0 as usize).enumerate() {
                    let place = (column, (self.row / self.side.1) as usize);
                    let tile = Tile {
                        left,
                        top: self.row,
                        width: self.side.0.min(width - left),
                        height,
                        candidates: self.windows.0.candidates(place.0, place.1),
                        bodies: self.prepared.bodies_in(self.windows.1, place),
                        place,
                        bounces: self.bounces,
                    };
                    tile::draw::<S, E, N>(simd, self.prepared, tile, scratch, &mut band);
                }
            },
        );
    }
}

/// Draws with the best kernel for the instruction set.
#[cfg(target_arch = "x86_64")]
fn draw<E: Real, By: Formulas<E>>(job: &Job<E>, level: Level, band: Band, scratch: &mut Scratch<E>) {
    #[cfg(all(feature = "avx512", not(all(test, feature = "narrow"))))]
    if let Some(simd) = level.as_avx512() {
        return job.draw::<_, features::FullKernel<By>>(simd, band, scratch);
    }
    #[cfg(not(all(test, feature = "narrow")))]
    if let Some(simd) = level.as_avx2() {
        return job.draw::<_, features::FullKernel<By>>(simd, band, scratch);
    }
    // Such machines are old and rare, so one variant of each step is enough for them.
    on!(narrow level, simd => job.draw::<_, features::CompactKernel<By>>(simd, band, scratch));
}

#[cfg(not(target_arch = "x86_64"))]
fn draw<E: Real, By: Formulas<E>>(job: &Job<E>, level: Level, band: Band, scratch: &mut Scratch<E>) {
    on!(level, simd => job.draw::<_, features::FullKernel<By>>(simd, band, scratch));
}
