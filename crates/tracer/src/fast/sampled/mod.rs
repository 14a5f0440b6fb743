//! Pictures whose pixels are means over points of their squares, of the lens and of the lights, and over moments.
//!
//! Passes over the image give more samples to the pixels whose means are not yet accurate enough ([`Film`]). In a pass,
//! a tile's samples are sorted by moment. They are drawn in batches that fit into a tile's memory, by the steps that
//! draw single rays. Only the step `light` handles lights that have an extent.

mod gauge;
mod scouts;
mod stand_ins;
mod tile;

use core::ops::Range;
use std::borrow::Cow;

use fearless_simd::{Level, Simd};
use image::{DynamicImage, RgbImage};
use rayfold_scene::{Scene, Tone};
use rayon::prelude::*;
use std::sync::atomic::Ordering;

use self::scouts::Scouts;
use self::tile::{Drawn, Pass, SampledTile, Workspace};
use super::shapes::Shape;
use crate::cover::{self, Lit};
use crate::exposure::fewest_samples;
use crate::fast::arithmetic::dispatch::on;
use crate::fast::arithmetic::real::Real;
use crate::fast::build::features::{self, Kernel};
use crate::fast::build::prepare::Prepared;
use crate::fast::film::watch::Watch;
use crate::fast::placement::geometry::Geometry;
use crate::fast::placement::lens::Aperture;
use crate::fast::placement::window::{Grid, Window};
use crate::fast::rays::view::View;
use crate::fast::shapes::shape::Robust;
use crate::fast::transport::soft_light::Extents;
use crate::parallel::{CHANNELS, image, values, whole_bands};
use crate::parts;
use crate::sampling::film::{self, Band, Bits, Film, First, PassTargets};
use crate::sampling::{Dimensions, Points};
use crate::{RenderError, RenderOptions, Sampler};

/// A callback that gets a function that makes the picture so far.
pub(super) type Each<'a> =
    dyn FnMut(&dyn Fn() -> Result<DynamicImage, RenderError>) -> Result<(), RenderError> + 'a;

/// The largest number of samples that a pass adds to a pixel. Their points are kept.
const PASS: u32 = 256;

/// The columns and rows of a tile.
pub(super) const SIDE: (u32, u32) = (16, 16);

/// The columns and rows of a tile in moving scenes. Larger tiles have more rays per moment.
const MOVING_SIDE: (u32, u32) = (32, 32);

/// The largest distance of a ray from the middle of its pixel: half a pixel, plus a margin for rounding.
pub(super) const MARGIN: f64 = 0.5 + crate::fast::arithmetic::rounding::MARGIN;

/// A scene at a moment, ready to be drawn.
#[derive(Debug)]
struct Moment<E> {
    prepared: Prepared<E>,
    window: Window,
    /// The candidates among the bodies, if they are few.
    bodies: Option<Window>,
    extents: Option<Extents>,
    lens: Option<Aperture<E>>,
    /// The boxes that the first look watches.
    watch: Option<Watch<E>>,
}

/// A scene at all its moments.
#[derive(Debug)]
pub(super) struct Sampled<'a, E> {
    /// The scene in the middle of the exposure.
    scene: Cow<'a, Scene>,
    options: RenderOptions<'a>,
    dimensions: Dimensions,
    moments: Vec<Moment<E>>,
    side: (u32, u32),
    scouts: Scouts<'a>,
}

impl<'a, E: Real> Sampled<'a, E> {
    /// Makes the scene from its `moments`, from the first opening of the shutter to the last closing, each with its
    /// geometry. A scene without motion has a single moment.
    pub(super) fn new(
        scene: &'a Scene,
        moments: &[Scene],
        geometries: &[Geometry],
        options: &'a RenderOptions<'a>,
    ) -> Result<Self, RenderError> {
        let scouts = Scouts::new(moments, options)?;
        let mut sampled = Self::of_one_look(Cow::Borrowed(scene), moments, geometries, *options)?;
        if let Some(boxes) = scouts.boxes()
            && options.sampler == Sampler::default()
        {
            for (moment, geometry) in sampled.moments.iter_mut().zip(geometries) {
                // What rays meet within glass, and where they go by chance, is not followed.
                if !moment.prepared.has_glass() && !scene.goes_round() {
                    moment.watch = Some(Watch::new(geometry, &boxes));
                }
            }
        }
        sampled.scouts = scouts;
        Ok(sampled)
    }

    /// The same for [`Self::first_look`] alone.
    fn of_one_look(
        scene: Cow<'a, Scene>,
        moments: &[Scene],
        geometries: &[Geometry],
        options: RenderOptions<'a>,
    ) -> Result<Self, RenderError> {
        let side = options.tile.unwrap_or(if moments.len() > 1 { MOVING_SIDE } else { SIDE });
        let dimensions = Dimensions::new(moments);
        let moments = moments
            .par_iter()
            .zip(geometries)
            .map(|(scene, geometry)| Moment::new(scene, geometry, &options, side, &dimensions))
            .collect::<Result<_, _>>()?;
        Ok(Self { scene, options, dimensions, moments, side, scouts: Scouts::default() })
    }

    /// Draws all passes. `each` may see the picture so far after every pass except the last.
    pub(super) fn draw_progressively(&self, each: &mut Each<'_>) -> Result<DynamicImage, RenderError> {
        let rows = 0..self.scene.screen.height();
        let size = (self.scene.screen.width(), self.scene.screen.height());
        let picture = |film: &Film| {
            Ok(match (film.has_cover(), self.options.matte) {
                (false, _) => DynamicImage::ImageRgb8(self.develop(film, 0, rows.clone())?),
                (true, matte) => {
                    let lit = self.develop_lit(film, 0, rows.clone())?;
                    match matte {
                        None => DynamicImage::ImageRgba8(cover::straight(size, self.scene.tone, &lit)),
                        Some(matte) => {
                            DynamicImage::ImageRgb8(cover::over(size, self.scene.tone, &lit, matte))
                        }
                    }
                }
            })
        };
        let film = self.expose(rows.clone(), |film| each(&|| picture(film)))?;
        picture(&film)
    }

    /// Draws rows of the image. They equal those of the whole image if as many rows beside them are drawn as
    /// [`Self::margin`] returns.
    pub(super) fn draw_rows(&self, rows: Range<u32>, margin: u32) -> Result<RgbImage, RenderError> {
        let drawn = self.drawn_with(&rows, margin);
        let film = self.expose(drawn.clone(), |_| Ok(()))?;
        self.develop(&film, drawn.start, rows)
    }

    /// Returns the light and the cover of rows of a scene without background.
    pub(super) fn lit_rows(&self, rows: Range<u32>, margin: u32) -> Result<Vec<Lit>, RenderError> {
        let drawn = self.drawn_with(&rows, margin);
        let film = self.expose(drawn.clone(), |_| Ok(()))?;
        self.develop_lit(&film, drawn.start, rows)
    }

    /// Returns the whole rows of tiles that contain these rows of the image and `margin` rows beside them.
    fn drawn_with(&self, rows: &Range<u32>, margin: u32) -> Range<u32> {
        let height = self.scene.screen.height();
        let drawn = rows.start.saturating_sub(margin)..rows.end.saturating_add(margin).min(height);
        whole_bands(&drawn, self.side.1, height)
    }

    pub(super) fn options(&self) -> &RenderOptions<'a> {
        &self.options
    }

    /// Returns the scene in the middle of its exposure.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the number of neighbouring rows that influence a row.
    pub(super) fn margin(&self) -> u32 {
        if self.scene.samples.error() > 0.0 { film::MARGIN } else { 0 }
    }

    /// Draws the samples of rows that are whole rows of tiles, before the rows become levels.
    pub(super) fn expose(
        &self,
        rows: Range<u32>,
        mut each: impl FnMut(&Film) -> Result<(), RenderError>,
    ) -> Result<Film, RenderError> {
        let mut film = self.film(&rows)?;
        let is_watched = self.moments.iter().all(|moment| moment.watch.is_some());
        if is_watched {
            film.watch().ok_or(RenderError::TooLarge {
                width: self.scene.screen.width(),
                height: rows.end - rows.start,
            })?;
        } else if let Some(floors) = self.scouts.floors(rows.clone(), None)? {
            film.raise(floors);
        }
        if let Some(progress) = self.options.progress {
            progress.set(0, 0);
        }
        let mut passes = 0;
        while let Some(span) = film.plan() {
            if passes > 0 {
                each(&film)?;
            }
            passes += 1;
            self.pass(&mut film, rows.start, span)?;
            // Where no first ray came near narrow objects none of them matters. In one of several moments that is likely if
            // none beside it did in others.
            let beside = if self.moments.len() > 1 { film::BESIDE } else { 1 };
            if let Some(near) = film.near(beside)
                && let Some(floors) = self.scouts.floors(rows.clone(), Some(&near))?
            {
                film.raise(floors);
            }
        }
        if let Some(progress) = self.options.progress {
            progress.set(progress.done(), 0);
        }
        Ok(film)
    }

    /// Returns an empty film of some rows.
    fn film(&self, rows: &Range<u32>) -> Result<Film, RenderError> {
        let scene = &self.scene;
        let size = (scene.screen.width(), rows.end - rows.start);
        let too_large = || RenderError::TooLarge { width: size.0, height: size.1 };
        let has_cover = parts::BUILT.covers && scene.background.is_none();
        let is_unclamped = parts::BUILT.paths && scene.goes_round();
        let kinds = (has_cover, is_unclamped);
        let mut film =
            Film::new(size, self.side, scene.samples, scene.tone, PASS, kinds).ok_or_else(too_large)?;
        let fewest = if self.moments.len() > 1 { fewest_samples(scene) } else { 1 };
        if fewest > 1 && scene.samples.error() > 0.0 {
            film.raise_all(fewest.min(scene.samples.most())).ok_or_else(too_large)?;
        }
        Ok(film)
    }

    /// Returns the first samples of all or some pixels of rows that are whole rows of tiles.
    fn first_look(&self, rows: Range<u32>, some: Option<&Bits>) -> Result<Option<First>, RenderError> {
        let mut film = self.film(&rows)?;
        if let Some(span) = film.plan() {
            if let Some(some) = some {
                film.want_only(some);
            }
            self.pass(&mut film, rows.start, span)?;
        }
        Ok(film.into_first())
    }

    /// Gives each pixel the samples that it lacks.
    fn pass(&self, film: &mut Film, above: u32, (first, end): (u32, u32)) -> Result<(), RenderError> {
        // Where light goes round the first look is no sample, so that samples count from 0 after it.
        let start = if self.scene.goes_round() && first == 1 { 0 } else { first };
        let points = Points::new(&self.dimensions, self.options.sampler, start, end);
        let level = self.options.level.unwrap_or_else(Level::new);
        let side = film.side();
        let watched = self.options.progress.map(|progress| (progress, progress.done(), film.work()));
        if let Some((progress, before, work)) = &watched {
            progress.set(*before, work.ahead);
        }
        let (bands, wanted) = film.split();
        let all = watched.as_ref().map_or(0, |_| wanted.pixels.count(0..wanted.pixels.rows()));
        bands.into_par_iter().enumerate().try_for_each_init(
            || Box::new(Workspace::new(self.options.cancel)),
            |workspace, (row, mut band)| {
                if self.options.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                    return Err(RenderError::Cancelled);
                }
                let job = Job { of: self, points: &points, wanted, side, row, above };
                draw::<E>(&job, level, &mut band, workspace);
                if let Some((progress, _, work)) = &watched {
                    let end = ((row + 1) * side.1).min(wanted.pixels.rows());
                    // Pixels of a pass can get different numbers of samples: this is the mean.
                    let share = wanted.pixels.count(row * side.1..end) as f64 / all.max(1) as f64;
                    progress.add((work.now as f64 * share) as u64);
                }
                Ok(())
            },
        )?;
        if let Some((progress, before, work)) = &watched {
            progress.set(before + work.now, work.ahead - work.now);
        }
        Ok(())
    }

    /// Returns the light of the image, before it becomes levels: three numbers from 0 to 1 for each pixel, row by row from the
    /// top.
    pub(super) fn light(&self) -> Result<Vec<f32>, RenderError> {
        let (width, height) = (self.scene.screen.width(), self.scene.screen.height());
        let film = self.expose(0..height, |_| Ok(()))?;
        let mut light = Vec::new();
        let length = (width as usize).checked_mul(CHANNELS * height as usize);
        let too_large = || RenderError::TooLarge { width, height };
        light.try_reserve_exact(length.ok_or_else(too_large)?).map_err(|_| too_large())?;
        for row in 0..height as usize {
            film.each_of_row(row, |color| {
                light.extend(color.unit().to_array().map(|channel| channel as f32))
            });
        }
        Ok(light)
    }

    /// Returns the light and the cover of rows of the image. The film begins `above` rows below the top of the image.
    fn develop_lit(&self, film: &Film, above: u32, rows: Range<u32>) -> Result<Vec<Lit>, RenderError> {
        let width = self.scene.screen.width();
        let first = (rows.start - above) as usize;
        let mut lit = values::<Lit>((width, rows.end - rows.start), 1)?;
        lit.par_chunks_exact_mut(width as usize).enumerate().for_each(|(row, lit)| {
            let mut pixels = lit.iter_mut();
            film.each_of_row(first + row, |color| {
                if let Some(pixel) = pixels.next() {
                    let [red, green, blue] = color.unit().to_array().map(|channel| channel as f32);
                    *pixel = [red, green, blue, 1.0];
                }
            });
            let mut pixels = lit.iter_mut();
            film.each_cover_of_row(first + row, |cover| {
                if let Some(pixel) = pixels.next() {
                    pixel[3] = cover.unit().x as f32;
                }
            });
        });
        Ok(lit)
    }

    /// Returns the levels of rows of the image. The film begins `above` rows below the top of the image.
    fn develop(&self, film: &Film, above: u32, rows: Range<u32>) -> Result<RgbImage, RenderError> {
        let (width, tone) = (self.scene.screen.width(), self.scene.tone);
        let first = (rows.start - above) as usize;
        let level = self.options.level.unwrap_or_else(Level::new);
        image((width, rows.end - rows.start), |bytes| {
            bytes.par_chunks_exact_mut(CHANNELS * width as usize).enumerate().for_each(|(row, bytes)| {
                if tone == Tone::Plain {
                    return on!(level, _simd => film.put_levels(first + row, bytes));
                }
                let mut bytes = bytes.chunks_exact_mut(CHANNELS);
                film.each_shown_of_row(first + row, |color| {
                    if let Some(bytes) = bytes.next() {
                        bytes.copy_from_slice(&crate::fast::film::tone::levels(color.unit(), tone));
                    }
                });
            });
        })
    }
}

impl<E: Real> Moment<E> {
    fn new(
        scene: &Scene,
        geometry: &Geometry,
        options: &RenderOptions,
        side: (u32, u32),
        dimensions: &Dimensions,
    ) -> Result<Self, RenderError> {
        let size = (scene.screen.width(), scene.screen.height());
        let grid = Grid { size, side, margin: MARGIN, lens: geometry.lens };
        let prepared = Prepared::<E>::new(scene, geometry, options.tree, &grid)?;
        let mut shapes: Vec<Shape> = match &prepared.tree {
            Some(_) => vec![Shape::of_box(geometry.whole())],
            None => geometry.solids.iter().map(|solid| solid.shape).collect(),
        };
        shapes.sort_by_key(|shape| shape.kind().number());
        let window = Window::new(geometry.view, &shapes, &grid, E::ROUNDOFF);
        let few = prepared.tree.is_none().then_some(&shapes[..]);
        let boxes = prepared.boxes_of_bodies();
        let bodies = Window::of_bodies(geometry.view, boxes, &grid, E::ROUNDOFF);
        let extents = Extents::new::<E>(scene, geometry, (few, boxes), dimensions);
        let lens = match geometry.view {
            View::Pinhole { right, up, .. } => geometry.lens.map(|lens| Aperture::new(lens, right, up)),
            View::Parallel { .. } => None,
        };
        Ok(Self { prepared, window, bodies, extents, lens, watch: None })
    }
}

/// A row of tiles to draw.
struct Job<'a, E> {
    of: &'a Sampled<'a, E>,
    points: &'a Points,
    wanted: PassTargets<'a>,
    /// The columns and rows of a tile.
    side: (usize, usize),
    /// The row of tiles, from the top of the film.
    row: usize,
    /// The number of rows of the image above the film.
    above: u32,
}

impl<E: Real> Job<'_, E> {
    #[inline(always)]
    fn draw<S: Simd, N: Kernel<E>>(&self, simd: S, band: &mut Band<'_>, workspace: &mut Workspace<E>) {
        simd.vectorize(
            #[inline(always)]
            || {
                let Sampled { scene, options, dimensions, moments, .. } = self.of;
                let (width, height) = (scene.screen.width() as usize, scene.screen.height() as usize);
                let pass = Pass {
                    moments,
                    points: self.points,
                    dimensions,
                    bounces: options.bounces(scene),
                    indirect: scene.indirect_bounces(),
                    wanted: self.wanted,
                    height: height as u32,
                };
                let (top, above) = (self.row * self.side.1, self.above as usize);
                let place = above / self.of.side.1 as usize + self.row;
                let rows = self.wanted.pixels.rows();
                for (column, pixels) in band.tiles.iter_mut().enumerate() {
                    let left = column * self.side.0;
                    let tile = SampledTile {
                        place: (column, place),
                        left,
                        top,
                        above,
                        width: self.side.0.min(width - left),
                        height: self.side.1.min(rows - top),
                        side: self.side,
                        stride: width,
                    };
                    if self.wanted.pixels.has_any(tile.columns(), tile.rows()) {
                        let cover = band.cover.as_mut().map(|cover| cover.of_tile(column));
                        let (first, judged) = (band.first.as_mut(), &mut band.judged);
                        let drawn = Drawn { pixels, first, cover, judged, near: band.near.as_mut() };
                        tile::draw::<S, E, N>(simd, &pass, &tile, drawn, workspace);
                    }
                }
            },
        );
    }
}

/// Draws with the best kernel for the instruction set.
#[cfg(target_arch = "x86_64")]
fn draw<E: Real>(job: &Job<E>, level: Level, band: &mut Band<'_>, workspace: &mut Workspace<E>) {
    #[cfg(all(feature = "avx512", not(all(test, feature = "narrow"))))]
    if let Some(simd) = level.as_avx512() {
        return job.draw::<_, features::FullKernel<Robust>>(simd, band, workspace);
    }
    #[cfg(not(all(test, feature = "narrow")))]
    if let Some(simd) = level.as_avx2() {
        return job.draw::<_, features::FullKernel<Robust>>(simd, band, workspace);
    }
    on!(narrow level, simd => job.draw::<_, features::CompactKernel<Robust>>(simd, band, workspace));
}

#[cfg(not(target_arch = "x86_64"))]
fn draw<E: Real>(job: &Job<E>, level: Level, band: &mut Band<'_>, workspace: &mut Workspace<E>) {
    on!(level, simd => job.draw::<_, features::FullKernel<Robust>>(simd, band, workspace));
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, parse};

    use super::*;

    /// Wires, a triangle that the sun sees edge-on, and their images in mirrors.
    const NARROW: &str = "Screen 120 90\nLook 0 2.4 8  0 .7 0  34\nBackground .5 .6 .8\nSamples 16 1\n\
        Box -9 -1 -9 9 0 9  .1 .1 .1 .5 .5 .45\nSphere .9 -1.2 .9 -.4  .04 .04 .04 .2 .2 .2 .6 .6 .6\n\
        Sphere .5 1.6 .5 1.2  .08 .02 .02 .8 .2 .15\nCylinder .004 2.4 0 0  2.4 1.5 .4  .3 .3 .3 .6 .6 .6\n\
        Triangle -3 .2 2  -1.7 .2 2  -2.4 1.6 2  .1 .1 .02 .7 .7 .2\n";

    #[test]
    fn narrow_objects_matter_only_where_rays_come_near_them() {
        for more in [
            "Ilight .6 .6 .6  .3 -1 0",
            "Ilight .6 .6 .6  .3 -1 0  5\nLens .1 8",
            "Plight .8 .8 .8  -1 4 2.01  .1",
        ] {
            let text = format!("{NARROW}{more}\nTrace\n");
            let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
            let scene = parsed.script.and_then(|script| script.frame(0)).unwrap();
            let geometry = Geometry::new(&scene, None).unwrap();
            let options = RenderOptions::default();
            let sampled =
                Sampled::<f64>::new(&scene, core::slice::from_ref(&scene), &[geometry], &options).unwrap();
            let rows = 0..scene.screen.height();
            let mut film = sampled.film(&rows).unwrap();
            film.watch().unwrap();
            let span = film.plan().unwrap();
            sampled.pass(&mut film, 0, span).unwrap();
            let near = film.near(1).unwrap();
            let all = sampled.scouts.floors(rows.clone(), None).unwrap();
            let some = sampled.scouts.floors(rows, Some(&near)).unwrap();
            assert!(all.is_some() && all == some, "{more}");
            let share = near.count(0..90) as f64 / (120.0 * 90.0);
            println!("{more}: {:.1} % of the pixels", 100.0 * share);
            assert!(share > 0.0 && share < 0.7, "{more}: {share}");
        }
    }
}
