//! The measurements of a picture with several samples per pixel: its time, rays and error.

use anyhow::{Context, Result};
use glam::DVec3;
use rayfold_scene::{Samples, Scene};
use rayfold_tracer::{Drawing, Exposure, Means, Precision, RenderOptions};

use super::scenes::Picture;
use crate::cpu_time;
use crate::report_folder::ReportFolder;

/// The parts of the report to measure.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    pub(super) output: ReportFolder,
    /// Columns of the pictures; rows are three quarters of that
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..))]
    pub(super) width: u32,
    /// Samples of the truth
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(64..))]
    pub(super) truth: u32,
    /// Independent samples of the plain tracer that the truth is held against
    #[arg(long, default_value_t = 65_536, value_parser = clap::value_parser!(u32).range(2..))]
    pub(super) independent: u32,
    /// The scene of the report on speed instead: the time to an error, at the sizes of the targets
    #[arg(long)]
    pub(super) targets: bool,
    /// Pictures in which light goes round instead: the time to an error beside Mitsuba, for light.md
    #[arg(long, conflicts_with_all = ["targets", "small"])]
    pub(super) light: bool,
    /// Measure small objects instead, for sampling-small.md
    #[arg(long)]
    pub(super) small: bool,
    /// The number of patterned floors and of random scenes
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) scenes: u64,
    /// The seed of the first of them
    #[arg(long, default_value_t = 1000)]
    pub(super) seed: u64,
    /// Only this effect, or `random`: the floors and scenes
    #[arg(long)]
    pub(super) only: Option<String>,
    /// Print the figures and write nothing
    #[arg(long)]
    pub(super) check: bool,
}

/// The number of times that a picture is drawn; the shortest time counts.
pub(super) const ROUNDS: u32 = 3;

/// The measurements of a drawn picture.
pub(super) struct Drawn {
    pub(super) effect: &'static str,
    pub(super) way: &'static str,
    pub(super) asked: Samples,
    /// The processor time of preparing and drawing, in seconds.
    pub(super) seconds: f64,
    /// The number of camera rays per pixel.
    pub(super) rays: f64,
    /// The root mean square error over pixels and channels, in levels before rounding.
    pub(super) error: f64,
    /// The share of pixels with a channel off by more than 4 levels.
    pub(super) off: f64,
    /// The root mean square error of means over blocks of 4 x 4 pixels. Noise makes it small; bias does not.
    pub(super) of_blocks: f64,
}

/// The agreement of the truth with independent samples.
pub(super) struct Agreement {
    pub(super) effect: &'static str,
    /// The mean square of the difference in standard errors, which is 1 for two estimates of the same thing.
    pub(super) mean_square: f64,
    /// The largest difference in standard errors.
    pub(super) largest: f64,
    /// The root mean squares, in levels, of the difference and of the standard errors.
    pub(super) difference: f64,
    pub(super) standard_error: f64,
}

/// Returns the picture of a scene before it is converted to levels.
pub(super) fn means(picture: &Picture, samples: Samples, options: &RenderOptions) -> Result<Means> {
    let scene = Scene { samples, ..picture.scene.clone() };
    let after = |frames| picture.after(frames);
    let drawing = Drawing::exposed(Exposure::moving(&scene, &after), options)?;
    drawing.draw_means()?.context("no kernels for this picture")
}

/// Returns the means as exactly as the kernels can.
pub(super) fn truth(picture: &Picture, samples: u32) -> Result<Means> {
    let options = RenderOptions { precision: Precision::F64, ..RenderOptions::default() };
    means(picture, Samples::new(samples, 0.0)?, &options)
}

/// Returns the processor time of preparing and drawing, in seconds: the shortest of several.
pub(super) fn shortest(picture: &Picture, asked: Samples, options: &RenderOptions) -> Result<f64> {
    let scene = Scene { samples: asked, ..picture.scene.clone() };
    let after = |frames| picture.after(frames);
    let mut shortest = f64::INFINITY;
    for _ in 0..ROUNDS {
        let (seconds, drawn) =
            cpu_time::of(|| Drawing::exposed(Exposure::moving(&scene, &after), options)?.draw())?;
        drawn?;
        shortest = shortest.min(seconds);
    }
    Ok(shortest)
}

pub(super) fn measure(
    effect: &'static str,
    way: &'static str,
    picture: &Picture,
    asked: Samples,
    options: &RenderOptions,
    truth: &[DVec3],
) -> Result<Drawn> {
    let seconds = shortest(picture, asked, options)?;
    let drawn = means(picture, asked, options)?;
    let errors: Vec<DVec3> = drawn.means.iter().zip(truth).map(|(a, b)| 255.0 * (*a - *b)).collect();
    let pixels = errors.len() as f64;
    let width = picture.scene.screen.width() as usize;
    Ok(Drawn {
        effect,
        way,
        asked,
        seconds,
        rays: drawn.counts.iter().map(|&count| f64::from(count)).sum::<f64>() / pixels,
        error: root_mean_square(&errors),
        off: errors.iter().filter(|e| e.abs().max_element() > 4.0).count() as f64 / pixels,
        of_blocks: root_mean_square(&blocks(&errors, width)),
    })
}

pub(super) fn root_mean_square(errors: &[DVec3]) -> f64 {
    (errors.iter().map(|e| e.length_squared()).sum::<f64>() / (3 * errors.len()) as f64).sqrt()
}

/// Returns the means of blocks of 4 x 4 pixels.
pub(super) fn blocks(errors: &[DVec3], width: usize) -> Vec<DVec3> {
    let rows: Vec<&[DVec3]> = errors.chunks_exact(width).collect();
    let mut blocks = vec![];
    for rows in rows.chunks_exact(4) {
        for left in (0..width - 3).step_by(4) {
            let sum: DVec3 = rows.iter().flat_map(|row| &row[left..left + 4]).sum();
            blocks.push(sum / 16.0);
        }
    }
    blocks
}
