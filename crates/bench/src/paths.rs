//! `rayfold-bench paths`: checks that pictures with indirect light have the expectation that the language defines.
//!
//! The pixels of a picture are averaged over blocks. The oracle estimates the same means by independent paths, in the
//! most direct way: it follows each ray that a hit spawns, however faint, and draws directions by other formulas than
//! the tracer's. A mean that differs by more than chance allows is a bias.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use fastrand::Rng;
use glam::DVec3;
use rayfold_scene::{Limits, Samples, Scene, parse};
use rayfold_tracer::{Drawing, RenderOptions};
use rayon::prelude::*;

use crate::oracle;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The number of the oracle's paths for each block
    #[arg(long, default_value_t = 16_384)]
    paths: u32,
    /// The number of samples of each pixel
    #[arg(long, default_value_t = 1024)]
    samples: u32,
    /// Also draw the pictures with this error in levels, and report the bias of stopping early
    #[arg(long, default_value_t = 2.0)]
    error: f64,
    /// Write the report to this file
    #[arg(long, default_value = "docs/reports/paths.md")]
    report: PathBuf,
}

/// The size of the pictures, and the number of blocks across and down.
const SIZE: (u32, u32) = (64, 48);
const BLOCKS: (u32, u32) = (4, 3);

/// The brightness below which a mean has no clamped pixels.
const CLAMPED: f64 = 0.8;

const ROOM: &str = "Look 0 1 3.4 0 1 0 50
Material white diffuse .75 .75 .75
Material red diffuse .75 .1 .1
Material green diffuse .1 .7 .15
Box -1.1 -.1 -1.1 1.1 0 3.6 white
Box -1.1 0 -1.1 1.1 2 -1 white
Box -1.1 0 -1.1 -1 2 3.6 red
Box 1 0 -1.1 1.1 2 3.6 green
Box -1.1 2 .4 1.1 2.1 3.6 white
Box -1.1 0 3.5 1.1 2 3.6 white
";

const OPEN: &str = "Look 0 1.4 5 0 .5 0 36
Material clay diffuse .6 .35 .25
Material floor diffuse .6 .6 .6
Plane 0 0 0 0 1 0 floor
Sphere .6 -.8 .6 0 clay
Cone .5 .1 .5 0 .3 .5 1 .3 clay
";

/// A room with a window in its left wall.
const WINDOW: &str = "Look 0 1 3.4 0 1 0 50\nMaterial white diffuse .75 .75 .75\nMaterial red diffuse .75 .1 .1\n\
     Box -1.1 -.1 -1.1 1.1 0 3.6 white\nBox -1.1 0 -1.1 1.1 2 -1 white\nBox 1 0 -1.1 1.1 2 3.6 white\n\
     Box -1.1 2 -1.1 1.1 2.1 3.6 white\nBox -1.1 0 3.5 1.1 2 3.6 white\nBox -1.1 0 -1.1 -1 .6 3.6 red\n\
     Box -1.1 1.5 -1.1 -1 2 3.6 red\nBox -1.1 .6 -1.1 -1 1.5 -.6 red\nBox -1.1 .6 .3 -1 1.5 3.6 red\n";

/// Names, settings, and objects after those of a room or of an open place. Nothing in them is brighter than 1, because
/// a picture clamps its pixels, but the oracle does not clamp its paths.
const SCENES: [(&str, &str, &str, &str); 12] = [
    ("a room under a hole", "Indirect 3\nBackground .9 1 1", ROOM, "Sphere .35 -.4 .35 -.3 white"),
    (
        "a room with a lamp",
        "Indirect 2",
        ROOM,
        "Sphere .35 -.4 .35 -.3 white\nPlight .2 .18 .16 0 1.5 .5 0 .8",
    ),
    (
        "a room with a pane that glows",
        "Indirect 2",
        ROOM,
        "Material lit glow .8 .7 .6\nDisc .4 0 1.9 .2 0 1 0 lit\nSphere .35 -.4 .35 -.3 white",
    ),
    (
        "a room with glass and mirrors",
        "Indirect 2\nDepth 3\nBackground .9 1 1",
        ROOM,
        "Material pane glass .9 .95 .9 1.5\nMaterial chrome mirror .8 .7 .6 diffuse .1 .1 .1\nSphere .3 .5 .3 .3 pane\n\
         Sphere .3 -.4 .3 -.3 chrome",
    ),
    ("a room with a window", "Indirect 3\nSky .7 .75 .8", WINDOW, "Sphere .35 -.4 .35 -.3 white"),
    (
        "a room with a window and a sun",
        "Indirect 3\nSky .2 .25 .3",
        WINDOW,
        "Sphere .35 -.4 .35 -.3 white\nIlight .9 .85 .8 1 -.7 -.2",
    ),
    ("an overcast day", "Indirect 2\nBackground .3 .3 .3 .7 .75 .8", OPEN, ""),
    ("a sun in fog", "Indirect 1\nFog .3 .35 .4 8", OPEN, "Ilight .8 .7 .6 1 -2 -1"),
    (
        "patterns",
        "Indirect 2\nBackground .5 .6 .7",
        OPEN,
        "Material dark diffuse .1 .2 .5\nMaterial tiles diffuse .7 .7 .4 checker .3 dark\nBox 1.2 0 -.6 2 .8 .4 tiles",
    ),
    (
        "rough mirrors",
        "Depth 3\nBackground .3 .35 .4 .5 .6 .7",
        OPEN,
        "Material brushed mirror .7 .6 .5 rough .25\nMaterial satin diffuse .1 .1 .1 mirror .4 .4 .4 rough .7\n\
         Sphere .5 .9 .5 .8 brushed\nBox -1.9 0 -.4 -1.4 1 .2 satin\nIlight .3 .3 .25 -.4 -1 -.6\nPlight .3 .3 .3 .5 2 1",
    ),
    (
        "frosted glass",
        "Depth 3\nIndirect 1\nBackground .3 .35 .4 .5 .6 .7",
        OPEN,
        "Material frost glass .9 .95 .9 1.5 rough .3\nSphere .5 .9 .5 .8 frost\nDisc .5 -1 .8 .8 .2 .1 1 frost",
    ),
    (
        "neon over a wet floor",
        "Indirect 1\nDepth 2",
        "Look 0 1.2 5 0 .6 0 36\nMaterial wet diffuse .2 .2 .25 mirror .2 .2 .2\nPlane 0 0 0 0 1 0 wet\n",
        "Material neon glow .6 .2 .1\nCapsule .1 -1 1 0 1 1 0 neon\nSphere .4 .9 .4 .6 .0 .0 .0 .6 .6 .6",
    ),
];

/// The means of a block, estimated by the oracle.
struct Block {
    mean: DVec3,
    /// The standard deviation of one path.
    deviation: DVec3,
    /// The standard deviation of the mean of its three channels, which vary together.
    deviation_of_mean: f64,
}

fn scene(settings: &str, before: &str, things: &str) -> Result<Scene> {
    let (width, height) = SIZE;
    let script = format!("Screen {width} {height}\n{settings}\n{before}{things}\nTrace\n");
    let parsed = parse("scene", script.as_bytes(), &Limits::default());
    let scene = parsed.script.and_then(|script| script.frame(0));
    scene.with_context(|| format!("{:?}", parsed.diagnostics))
}

/// Estimates the mean of a block by this many paths.
fn by_paths(scene: &Scene, (column, row): (u32, u32), paths: u32) -> Block {
    let dice = RefCell::new(Rng::with_seed(u64::from(1 + column + BLOCKS.0 * row)));
    let (width, height) = (f64::from(SIZE.0 / BLOCKS.0), f64::from(SIZE.1 / BLOCKS.1));
    let (mut sum, mut squares, mut squares_of_mean) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for _ in 0..paths {
        let (u, v) = {
            let mut dice = dice.borrow_mut();
            (dice.f64(), dice.f64())
        };
        let x = (f64::from(column) + u) * width - 0.5;
        // Rows count from the bottom.
        let y = f64::from(SIZE.1) - 0.5 - (f64::from(row) + v) * height;
        let color = oracle::path_at(scene, x, y, &dice);
        sum += color;
        squares += color * color;
        squares_of_mean += color.element_sum().powi(2) / 9.0;
    }
    let mean = sum / f64::from(paths);
    let variance = (squares / f64::from(paths) - mean * mean).max(DVec3::ZERO);
    let variance_of_mean = squares_of_mean / f64::from(paths) - mean.element_sum().powi(2) / 9.0;
    Block { mean, deviation: variance.map(f64::sqrt), deviation_of_mean: variance_of_mean.max(0.0).sqrt() }
}

/// Returns the means of all blocks of a picture with these samples.
fn drawn(scene: &Scene, samples: Samples) -> Result<Vec<DVec3>> {
    let scene = Scene { samples, ..scene.clone() };
    let options = RenderOptions::default();
    let light = Drawing::new(&scene, &options)?.draw_light()?;
    let (width, height) = (SIZE.0 / BLOCKS.0, SIZE.1 / BLOCKS.1);
    let mut means = vec![DVec3::ZERO; (BLOCKS.0 * BLOCKS.1) as usize];
    for (place, pixel) in (0..).zip(light.as_chunks::<3>().0) {
        let (column, row) = (place % SIZE.0 / width, place / SIZE.0 / height);
        let pixel = DVec3::from_array(pixel.map(f64::from));
        means[(row * BLOCKS.0 + column) as usize] += pixel / f64::from(width * height);
    }
    Ok(means)
}

/// The comparison of a picture with the oracle.
#[derive(Debug, Default)]
struct Compared {
    /// The number of means.
    count: u32,
    /// The sum of the squares of their differences, in standard errors.
    squares: f64,
    /// The largest of them.
    worst: f64,
    /// The mean difference in levels over the blocks whose channels all count, and its standard error.
    bias: f64,
    error: f64,
}

fn compared(blocks: &[Block], means: &[DVec3], paths: u32, samples: f64) -> Compared {
    let mut of = Compared::default();
    let (mut sum, mut variances, mut whole) = (0.0, 0.0, 0);
    let shrunk = 1.0 / f64::from(paths) + 1.0 / samples;
    for (block, mean) in blocks.iter().zip(means) {
        let counted = of.count;
        for channel in 0..3 {
            if block.mean[channel] > CLAMPED || block.deviation[channel] == 0.0 {
                continue;
            }
            let variance = block.deviation[channel].powi(2) * shrunk;
            let apart = mean[channel] - block.mean[channel];
            of.count += 1;
            of.squares += apart * apart / variance;
            of.worst = of.worst.max(apart.abs() / variance.sqrt());
        }
        if of.count == counted + 3 {
            sum += (*mean - block.mean).element_sum() / 3.0;
            variances += block.deviation_of_mean.powi(2) * shrunk;
            whole += 1;
        }
    }
    let count = f64::from(whole.max(1));
    (of.bias, of.error) = (255.0 * sum / count, 255.0 * variances.sqrt() / count);
    of
}

/// Compares all scenes, and writes the report.
///
/// # Errors
/// Fails if a mean has a bias beyond chance at an error of 0, or if a scene cannot be drawn.
pub fn run(args: &Args) -> Result<()> {
    let mut report = String::from(
        "# Indirect light: bias\n\n`rayfold-bench paths` wrote this page. Pictures of 64 x 48 pixels are compared with \
         independent paths of the oracle, in 12 blocks and three channels each. *Mean square* and *worst* are the \
         differences in standard errors: about 1, and below 4, if there is no bias. *Bias* is the mean difference in \
         levels with its standard error, with all samples, and where sampling stops at an error.\n\n",
    );
    writeln!(report, "{} paths of the oracle a block, {} samples a pixel.\n", args.paths, args.samples)?;
    writeln!(report, "| scene | mean square | worst | bias | bias at `Samples 4096 {}` |", args.error)?;
    writeln!(report, "| --- | ---: | ---: | ---: | ---: |")?;
    let mut is_biased = false;
    for (name, settings, before, things) in SCENES {
        let scene = scene(settings, before, things).context(name)?;
        let all = Compared::of(&scene, Samples::new(args.samples, 0.0)?, args.paths)?;
        let (full, stopped) =
            (all.0, compared(&all.1, &drawn(&scene, Samples::new(4096, args.error)?)?, args.paths, 1e9));
        let square = full.squares / f64::from(full.count.max(1));
        eprintln!("{name}: {square:.2} {:.2}", full.worst);
        writeln!(
            report,
            "| {name} | {square:.2} | {:.2} | {:.3} ± {:.3} | {:.3} ± {:.3} |",
            full.worst, full.bias, full.error, stopped.bias, stopped.error
        )?;
        is_biased |= full.worst > 4.5 || full.bias.abs() > 4.0 * full.error;
    }
    std::fs::write(&args.report, report)?;
    ensure!(!is_biased, "a scene has a bias");
    Ok(())
}

impl Compared {
    /// Compares a scene's picture with the oracle, which uses this many paths per block. Also returns the oracle's
    /// means.
    fn of(scene: &Scene, samples: Samples, paths: u32) -> Result<(Self, Vec<Block>)> {
        let blocks: Vec<Block> = (0..BLOCKS.0 * BLOCKS.1)
            .into_par_iter()
            .map(|block| by_paths(scene, (block % BLOCKS.0, block / BLOCKS.0), paths))
            .collect();
        let pixels = f64::from(SIZE.0 / BLOCKS.0) * f64::from(SIZE.1 / BLOCKS.1);
        let of = compared(&blocks, &drawn(scene, samples)?, paths, pixels * f64::from(samples.most()));
        Ok((of, blocks))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_paths_of_the_oracle_agree_with_the_pictures() {
        let (mut squares, mut count) = (0.0, 0.0);
        for (name, settings, before, things) in SCENES {
            let scene = scene(settings, before, things).unwrap();
            // Few of the paths are bright: of fewer paths the spread is not known.
            let (of, _) = Compared::of(&scene, Samples::new(64, 0.0).unwrap(), 500).unwrap();
            println!("{name}: {of:?}");
            assert!(of.worst < 4.5 && of.bias.abs() < 4.0 * of.error, "{name}: {of:?}");
            squares += of.squares;
            count += f64::from(of.count);
        }
        assert!(count > 200.0 && squares / count < 1.4, "{}", squares / count);
    }
}
