//! `rayfold-bench sampling`: the error of pictures whose pixels are means, against the time and the rays that they take.
//!
//! The truth of each picture is computed by the same kernels in `f64` with many samples, and held against independent random
//! samples of the plain tracer, which share nothing with them but the words of the language.

mod report;
mod scenes;
mod targets;

use std::path::PathBuf;

use anyhow::{Context, Result};
use glam::DVec3;
use rayfold_scene::{Samples, Scene};
use rayfold_tracer::reference::estimate;
use rayfold_tracer::{Drawing, Exposure, Means, Precision, RenderOptions, Sampler};

use self::scenes::{EFFECTS, Effect, Picture};
use crate::cpu_time;

/// What to measure.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder that receives sampling.md, sampling.csv and its plots
    #[arg(long, default_value = "docs/reports")]
    output: PathBuf,
    /// Columns of the pictures; rows are three quarters of that
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(16..))]
    width: u32,
    /// Samples of the truth
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u32).range(64..))]
    truth: u32,
    /// Independent samples of the plain tracer that the truth is held against
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..))]
    independent: u32,
    /// The scene of the report on speed instead: the time to an error, at the sizes of the targets
    #[arg(long)]
    targets: bool,
    /// Only this effect
    #[arg(long)]
    only: Option<String>,
    /// Print the figures and write nothing
    #[arg(long)]
    check: bool,
}

/// Rays a pixel of pictures that are not adaptive.
const COUNTS: [u32; 7] = [2, 4, 8, 16, 32, 64, 256];

/// Errors that adaptive pictures are asked for, with at most so many rays a pixel.
const ERRORS: [(u32, f64); 6] = [(16, 4.0), (64, 2.0), (64, 1.0), (256, 1.0), (256, 0.5), (1024, 0.25)];

/// How often a picture is drawn; the shortest time counts.
const ROUNDS: u32 = 3;

/// A picture that was drawn.
struct Drawn {
    effect: &'static str,
    way: &'static str,
    asked: Samples,
    /// Processor time, of preparing and drawing.
    seconds: f64,
    /// From the camera, a pixel.
    rays: f64,
    /// Root mean square over pixels and channels, in levels before rounding.
    error: f64,
    /// The share of pixels of which a channel is off by more than 4 levels.
    off: f64,
    /// The root mean square of errors of blocks of 4 x 4 pixels, which noise leaves small and bias does not.
    of_blocks: f64,
}

/// How the truth stands beside independent samples.
struct Agreement {
    effect: &'static str,
    /// The mean square of the difference in standard errors, which is 1 for two estimates of the same thing.
    mean_square: f64,
    /// The largest difference in standard errors.
    largest: f64,
}

/// Measures, and writes the report.
///
/// # Errors
/// When a picture cannot be drawn or a file not written.
pub fn run(args: &Args) -> Result<()> {
    if args.targets {
        return targets::run(args);
    }
    let size = (args.width, args.width * 3 / 4);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let (mut drawn, mut agreements) = (vec![], vec![]);
    for effect in EFFECTS.iter().filter(|effect| args.only.as_ref().is_none_or(|only| only == effect.name)) {
        let picture = effect.picture(size)?;
        let truth = truth(&picture, args.truth)?;
        agreements.push(agreement(effect, args)?);
        let mut ways = vec![];
        for (way, sampler) in
            [("uniform", Sampler::Sobol), ("pairs", Sampler::Pairs), ("independent", Sampler::Independent)]
        {
            ways.extend(COUNTS.map(|count| (way, sampler, (count, 0.0))));
        }
        ways.extend(ERRORS.map(|asked| ("adaptive", Sampler::Sobol, asked)));
        for (way, sampler, (most, error)) in ways {
            let asked = Samples::new(most, error)?;
            let options = RenderOptions { sampler, ..RenderOptions::default() };
            let row = one.install(|| measure(effect.name, way, &picture, asked, &options, &truth.means))?;
            eprintln!(
                "{:8} {:12} {most:5} {error:5}: {:8.2} ms {:7.2} rays, error {:6.3}, {:.3} % off, blocks {:.3}",
                row.effect,
                row.way,
                1e3 * row.seconds,
                row.rays,
                row.error,
                100.0 * row.off,
                row.of_blocks
            );
            drawn.push(row);
        }
    }
    if args.check { Ok(()) } else { report::write(&args.output, size, &drawn, &agreements, args.truth) }
}

/// The picture of a scene, before it becomes levels.
fn means(picture: &Picture, samples: Samples, options: &RenderOptions) -> Result<Means> {
    let scene = Scene { samples, ..picture.scene.clone() };
    let after = |frames| picture.after(frames);
    let drawing = Drawing::exposed(Exposure::moving(&scene, &after), options)?;
    drawing.draw_means()?.context("no kernels for this picture")
}

/// The same as exactly as the kernels can.
fn truth(picture: &Picture, samples: u32) -> Result<Means> {
    let options = RenderOptions { precision: Precision::F64, ..RenderOptions::default() };
    means(picture, Samples::new(samples, 0.0)?, &options)
}

/// Processor time of preparing and drawing, in seconds: the shortest of several.
fn shortest(picture: &Picture, asked: Samples, options: &RenderOptions) -> Result<f64> {
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

fn measure(
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

fn root_mean_square(errors: &[DVec3]) -> f64 {
    (errors.iter().map(|e| e.length_squared()).sum::<f64>() / (3 * errors.len()) as f64).sqrt()
}

/// The means of blocks of 4 x 4 pixels.
fn blocks(errors: &[DVec3], width: usize) -> Vec<DVec3> {
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

/// A small picture by the plain tracer, beside the kernels' truth at that size.
fn agreement(effect: &Effect, args: &Args) -> Result<Agreement> {
    let picture = effect.picture((48, 36))?;
    let truth = truth(&picture, args.truth)?;
    let scene = Scene { samples: Samples::new(2, 0.0)?, ..picture.scene.clone() };
    let after = |frames| picture.after(frames);
    let plain = estimate(Exposure::moving(&scene, &after), args.independent, 1);
    let (mut sum, mut count, mut largest) = (0.0, 0.0, 0f64);
    for ((mean, error), truth) in plain.means.iter().zip(&plain.errors).zip(&truth.means) {
        for channel in 0..3 {
            // Where all samples agree nothing is known of the error; a level is counted as one.
            let error = error[channel].hypot(0.25 / 255.0);
            let difference = (mean[channel] - truth[channel]) / error;
            sum += difference * difference;
            count += 1.0;
            largest = largest.max(difference.abs());
        }
    }
    let agreement = Agreement { effect: effect.name, mean_square: sum / count, largest };
    eprintln!(
        "{:8} beside independent samples: mean square {:.3}, largest {:.2}",
        effect.name, agreement.mean_square, largest
    );
    Ok(agreement)
}
