//! `rayfold-bench sampling`: the error of pictures with several samples per pixel, by the time and the rays that they
//! take.
//!
//! The truth of each picture is computed by the same kernels in `f64` with many samples. It is compared with
//! independent random samples of the plain tracer, which shares nothing with the kernels but the definition of the
//! language.

mod curve;
mod drawn_at_random;
mod light;
mod measure;
mod mitsuba;
mod report;
mod scenes;
mod small;
mod targets;
mod targets_page;
mod works;

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Samples, Scene};
use rayfold_tracer::reference::estimate;
use rayfold_tracer::{Exposure, RenderOptions, Sampler};

pub use self::measure::Args;
use self::measure::{Agreement, measure, root_mean_square, truth};
use self::scenes::{EFFECTS, Effect};

/// The rays per pixel of pictures that are not adaptive.
const COUNTS: [u32; 7] = [2, 4, 8, 16, 32, 64, 256];

/// The errors requested of adaptive pictures, with the maximum number of rays per pixel.
const ERRORS: [(u32, f64); 6] = [(16, 4.0), (64, 2.0), (64, 1.0), (256, 1.0), (256, 0.5), (1024, 0.25)];

/// Measures and writes the report.
///
/// # Errors
/// Fails if a picture cannot be drawn, or a file cannot be written.
pub fn run(args: &Args) -> Result<()> {
    if !args.check {
        args.output.prepare()?;
    }
    if args.targets {
        return targets::run(args);
    }
    if args.light {
        return light::run(args);
    }
    if args.small {
        return small::run(args);
    }
    if args.only.as_deref() == Some("random") {
        return report::renew_random(args, &small::at_random(args)?);
    }
    let size = (args.width, args.width * 3 / 4);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let (mut drawn, mut agreements) = (vec![], vec![]);
    for effect in EFFECTS.iter().filter(|effect| args.only.as_ref().is_none_or(|only| only == effect.name)) {
        let picture = effect.picture(size)?;
        let truth = truth(&picture, args.truth)?;
        agreements.push(one.install(|| agreement(effect, args))?);
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
    if args.check { Ok(()) } else { report::write(args, size, &drawn, &agreements) }
}

/// The kernels sum a channel in units of 1 divided by this.
const PARTS: f64 = 65535.0;

/// Compares a small picture by the plain tracer with the kernels' truth at that size.
fn agreement(effect: &Effect, args: &Args) -> Result<Agreement> {
    let picture = effect.picture((48, 36))?;
    // As many samples, so that the rest is the error of the independent ones.
    let truth = truth(&picture, args.truth.max(args.independent))?;
    let scene = Scene { samples: Samples::new(2, 0.0)?, ..picture.scene.clone() };
    let after = |frames| picture.after(frames);
    let plain = estimate(Exposure::moving(&scene, &after), args.independent, 1);
    // If all samples agree, nothing is known of the error. The change by one of so many samples is counted as a
    // quarter of that; the kernels' sums are of whole parts of a channel.
    let unseen = 0.25 / f64::from(args.independent) + 0.5 / PARTS;
    let (mut sum, mut count, mut largest) = (0.0, 0.0, 0f64);
    for ((mean, error), truth) in plain.means.iter().zip(&plain.errors).zip(&truth.means) {
        for channel in 0..3 {
            let difference = (mean[channel] - truth[channel]) / error[channel].hypot(unseen);
            sum += difference * difference;
            count += 1.0;
            largest = largest.max(difference.abs());
        }
    }
    let differences: Vec<DVec3> = plain.means.iter().zip(&truth.means).map(|(a, b)| *a - *b).collect();
    let agreement = Agreement {
        effect: effect.name,
        mean_square: sum / count,
        largest,
        difference: 255.0 * root_mean_square(&differences),
        standard_error: 255.0 * root_mean_square(&plain.errors),
    };
    eprintln!(
        "{:8} beside independent samples: mean square {:.3}, largest {:.2}, {:.4} levels, standard error {:.4}",
        effect.name, agreement.mean_square, largest, agreement.difference, agreement.standard_error
    );
    Ok(agreement)
}
