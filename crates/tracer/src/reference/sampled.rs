//! Pixels as means of samples, in the terms of the language: points of the pixel's square, of the lens and of the
//! lights, and moments.

use core::ops::Range;
use std::borrow::Cow;

use glam::DVec3;
use image::RgbImage;
use rayfold_scene::{Camera, Light, Scene};
use rayon::prelude::*;

use super::shading::{PathNumbers, Seen, Shader};
use super::tone;
use super::windows::windows;
use super::world::World;
use crate::camera::Ray;
use crate::cover::Lit;
use crate::meshes::{Expanded, Shared};
use crate::parallel::{CHANNELS, bands, bands_of};
use crate::sampling::guide::Guide;
use crate::sampling::lights;
use crate::sampling::paths::{Way, choice, choice_dimension, direction_dimension};
use crate::sampling::places::on_disc;
use crate::sampling::rough::Energies;
use crate::sampling::{Dimensions, coordinate, pixel_seed};
use crate::{Exposure, RenderError, RenderOptions};

/// A scene at a moment.
struct Moment<'a> {
    world: World<'a>,
    energies: Energies,
    guide: Option<Guide>,
    dimensions: &'a Dimensions,
    bounces: u32,
}

/// Draws a scene with the samples of the kernels, and with the largest number of samples in every pixel.
///
/// # Errors
/// The errors of [`crate::render`].
pub fn render_exposed(exposure: Exposure, options: &RenderOptions) -> Result<RgbImage, RenderError> {
    render_rows(exposure, 0..exposure.scene().screen.height(), options)
}

/// Draws some rows of a scene with these samples.
pub(crate) fn render_rows(
    exposure: Exposure,
    rows: Range<u32>,
    options: &RenderOptions,
) -> Result<RgbImage, RenderError> {
    let scene = exposure.scene();
    if scene.samples.most() == 1 {
        return super::render_rows(scene, rows, options);
    }
    let image = with_pixels(exposure, options, |seen| {
        bands(
            scene.screen,
            rows,
            1,
            options,
            || (),
            |(), row, band| {
                for (pixel, column) in band.chunks_exact_mut(CHANNELS).zip(0u32..) {
                    pixel.copy_from_slice(&tone::toned(scene.tone, seen(column, row).color));
                }
            },
        )
    })?;
    if is_cancelled(options) { Err(RenderError::Cancelled) } else { Ok(image) }
}

/// Returns the light of a scene, before it becomes levels: three numbers from 0 to 1 for each pixel, row by row from
/// the top. With one sample it is the light along the ray through the pixel's middle.
///
/// # Errors
/// The errors of [`crate::render`].
pub(crate) fn light(exposure: Exposure, options: &RenderOptions) -> Result<Vec<f32>, RenderError> {
    let lit = lit_rows(exposure, 0..exposure.scene().screen.height(), options)?;
    Ok(lit.into_par_iter().flat_map_iter(|[red, green, blue, _]| [red, green, blue]).collect())
}

/// Returns the light of a scene, as [`crate::Drawing::draw_light_and_cover`] does, with the largest number of samples in
/// every pixel.
///
/// # Errors
/// The errors of [`crate::render`].
pub fn light_and_cover(exposure: Exposure, options: &RenderOptions) -> Result<Vec<f32>, RenderError> {
    Ok(lit_rows(exposure, 0..exposure.scene().screen.height(), options)?.into_flattened())
}

/// Returns the light and the cover of some rows of a scene, row by row from the top, as [`light`] does.
///
/// # Errors
/// The errors of [`crate::render`].
pub(crate) fn lit_rows(
    exposure: Exposure,
    rows: Range<u32>,
    options: &RenderOptions,
) -> Result<Vec<Lit>, RenderError> {
    let rows = with_pixels(exposure, options, |seen| {
        bands_of::<_, Lit, 1>(
            exposure.scene().screen,
            rows,
            1,
            options,
            || (),
            |(), row, band| {
                for (pixel, column) in band.iter_mut().zip(0u32..) {
                    let Seen { color, clear } = seen(column, row);
                    let [red, green, blue] = color.to_array().map(|channel| channel as f32);
                    *pixel = [red, green, blue, (1.0 - clear) as f32];
                }
            },
        )
    })?;
    if is_cancelled(options) { Err(RenderError::Cancelled) } else { Ok(rows) }
}

/// Returns the colour and the clear share of a pixel, with the colour clamped. Columns count from the left, rows from
/// the top.
type Mean<'a> = dyn Fn(u32, u32) -> Seen + Sync + 'a;

/// Calls `draw` with a function that returns the mean of a pixel, with the largest number of samples.
fn with_pixels<T>(exposure: Exposure, options: &RenderOptions, draw: impl FnOnce(&Mean) -> T) -> T {
    let scene = exposure.scene();
    let samples = scene.samples.most();
    let scenes = exposure.moments();
    let dimensions = Dimensions::new(&scenes);
    let energies = Energies::of(&scenes);
    let guides = Guide::of(&scenes, windows(&scenes[0]));
    let bounces = options.bounces(scene);
    let scenes: Vec<Expanded> =
        scenes.iter().map(|scene| Expanded::new(Cow::Borrowed(scene), Shared::NONE)).collect();
    let moments = scenes.iter().zip(guides).map(|(scene, guide)| {
        let energies = energies.clone();
        Moment { world: World::of(scene), energies, guide, dimensions: &dimensions, bounces }
    });
    let moments: Vec<Moment> = moments.collect();
    let middles = moments[0].world.middles();
    draw(&|column, row| {
        if samples == 1 {
            let world = &moments[0].world;
            let ray = world.rays.ray(f64::from(column), f64::from(scene.screen.height() - 1 - row));
            let shader = Shader { world, lights: &middles, cancel: options.cancel, paths: None };
            return clamped(shader.seen(ray, bounces));
        }
        let seed = pixel_seed(column, row);
        let mut sum = Seen::BLACK;
        for sample in 0..samples {
            let number = |dimension| coordinate(seed, sample, dimension);
            let time = dimensions.time.map_or(0.0, number) * moments.len() as f64;
            let moment = &moments[time as usize];
            let choice = |hits, way| choice(seed, sample, hits, way);
            let seen = moment.seen(scene, (column, row), (&number, &choice), options);
            sum = Seen { color: sum.color + seen.color, clear: sum.clear + seen.clear };
        }
        let count = f64::from(samples);
        clamped(Seen { color: sum.color / count, clear: sum.clear / count })
    })
}

/// Returns `Seen` with its colour clamped to 0..1. A NaN becomes black.
fn clamped(Seen { color, clear }: Seen) -> Seen {
    Seen { color: DVec3::select(color.cmpgt(DVec3::ZERO), color.min(DVec3::ONE), DVec3::ZERO), clear }
}

fn is_cancelled(options: &RenderOptions) -> bool {
    options.cancel.is_some_and(|flag| flag.load(std::sync::atomic::Ordering::Relaxed))
}

impl Moment<'_> {
    /// Returns the colour and the clear share of a sample of a pixel. The colour is clamped unless surfaces light each
    /// other. Rows count from the top. `number` returns the sample's coordinates, and `choice` the numbers that decide
    /// which rays are followed.
    fn seen(
        &self,
        scene: &Scene,
        (column, row): (u32, u32),
        (number, choice): Numbers,
        options: &RenderOptions,
    ) -> Seen {
        let i = f64::from(column) + number(0) - 0.5;
        let j = f64::from(scene.screen.height() - 1 - row) + number(1) - 0.5;
        let ray = self.ray(i, j, number);
        let lights = self.light_points(number);
        let direction = |hits| {
            let first = direction_dimension(self.dimensions, hits);
            (number(first), number(first + 1))
        };
        let goes_round = scene.goes_round();
        let (energies, guide) = (&self.energies, self.guide.as_ref());
        let paths = goes_round.then_some(PathNumbers { direction: &direction, choice, energies, guide });
        let seen = Shader { world: &self.world, lights: &lights, cancel: options.cancel, paths }
            .seen(ray, self.bounces);
        if goes_round { seen } else { clamped(seen) }
    }

    /// Returns the ray from a point of the lens through the point at which the eye's own ray is in focus.
    fn ray(&self, i: f64, j: f64, number: impl Fn(usize) -> f64) -> Ray {
        let World { scene, rays, .. } = &self.world;
        let ray = rays.ray(i, j);
        let Some(first) = self.dimensions.lens else { return ray };
        let ((u, v, w), own) = match &scene.camera {
            Camera::Orthographic => return ray,
            Camera::Pinhole(pinhole) => (pinhole.basis(), pinhole.distance()),
            Camera::Look(look) => (look.basis(), look.distance()),
        };
        let distance = scene.lens.distance().unwrap_or(own);
        let at = scene.lens.radius() * on_disc(number(first), number(first + 1));
        let offset = at.x * u + at.y * v;
        // Scaled to a component of 1 along the view direction.
        let along = ray.direction / -ray.direction.dot(w);
        Ray { origin: ray.origin + offset, direction: (along - offset / distance).normalize() }
    }

    fn light_points(&self, number: impl Fn(usize) -> f64) -> Vec<DVec3> {
        let lights = self.world.lights.iter().zip(&self.dimensions.lights);
        let point = |(light, first): (&Light, &Option<usize>)| match *first {
            Some(first) => lights::shape(light).point(&|k| number(first + k)),
            None => lights::shape(light).middle(),
        };
        lights.map(point).collect()
    }
}

/// The coordinates of a sample, and the numbers that decide which rays are followed.
type Numbers<'a> = (&'a dyn Fn(usize) -> f64, &'a dyn Fn(u32, Way) -> f64);

/// An estimate of a picture before it is rounded: the means of independent samples.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The means of the pixels, row by row from the top, before [`rayfold_scene::Tone`]. They are in 0..1 unless
    /// surfaces light each other.
    pub means: Vec<DVec3>,
    /// The standard errors of the means.
    pub errors: Vec<DVec3>,
}

/// Estimates a picture by independent random samples, the same number in every pixel. Sampled pictures are tested
/// against it. All pixels share the moment of a sample.
pub fn estimate(exposure: Exposure, samples: u32, seed: u64) -> Estimate {
    let scene = exposure.scene();
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); width as usize * height as usize];
    let mut all = vec![exposure.at(0.0), exposure.at(1.0)];
    if exposure.motion().is_none() {
        all.truncate(1);
    }
    let dimensions = Dimensions::new(&all);
    let options = RenderOptions::default();
    let bounces = options.bounces(scene);
    // A scene that does not move is prepared once.
    let batch = if exposure.motion().is_some() { 1 } else { samples };
    for first in (0..samples).step_by(batch as usize) {
        let time = independent(seed, u64::MAX, first.into(), 0);
        let at = exposure.at(time);
        let energies = Energies::of(core::slice::from_ref(&at));
        let guide = Guide::of(core::slice::from_ref(&at), windows(&at)).pop().flatten();
        let of_moment = Expanded::new(Cow::Owned(at), Shared::NONE);
        let moment =
            Moment { world: World::of(&of_moment), energies, guide, dimensions: &dimensions, bounces };
        sums.par_iter_mut().enumerate().for_each(|(place, sum)| {
            let place = place as u64;
            let pixel = ((place % u64::from(width)) as u32, (place / u64::from(width)) as u32);
            for sample in first..first + batch {
                let number = |dimension| independent(seed, place, sample.into(), dimension);
                let choice = |hits, way| number(choice_dimension(hits, way));
                let color = moment.seen(scene, pixel, (&number, &choice), &options).color;
                *sum = (sum.0 + color, sum.1 + color * color);
            }
        });
    }
    let count = f64::from(samples);
    let means: Vec<DVec3> = sums.iter().map(|sum| sum.0 / count).collect();
    let errors = sums.iter().zip(&means).map(|(sum, mean)| {
        let variance = (sum.1 / count - mean * mean).max(DVec3::ZERO);
        DVec3::from_array((variance / (count - 1.0)).to_array().map(f64::sqrt))
    });
    Estimate { errors: errors.collect(), means }
}

/// Returns a number above 0 and below 1: the SplitMix64 hash of Steele, Lea and Flood (2014).
fn independent(seed: u64, place: u64, sample: u64, dimension: usize) -> f64 {
    let mixed = |mut x: u64| {
        x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let hash = mixed(mixed(mixed(mixed(seed) ^ place) ^ sample) ^ dimension as u64);
    ((hash >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}
