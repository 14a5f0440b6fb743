//! `rayfold-bench coincident`: checks that a surface shared by two objects shows the object that comes first in the
//! script.
//!
//! Each random script has two solids that share a surface: faces, caps, discs, planes, triangles, the sides of
//! cylinders and cones, spheres, tori, capsules and boxes with round edges. They are axis-aligned or rotated, near and
//! far, given by their numbers or in groups, opaque or of glass. They are seen directly, in mirrors and through panes,
//! with light and shadows. The comparison needs no tracer that handles coincidence: the picture must equal that of a script in which the winning
//! solid is thicker by a millionth, so that nothing coincides. Only pixels away from all outlines are compared, that
//! is, those whose neighbours have the same colour in the second picture.

mod scene;
mod solid;

use anyhow::{Context, Result};
use image::RgbImage;
use rayfold_scene::{Limits, Scene, parse};
use rayfold_tracer::{Precision, RenderOptions, render};
use rayon::prelude::*;

use crate::backends::{self, Arithmetic, Backend};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Draw this many random scripts
    #[arg(long, default_value_t = 10_000)]
    scenes: u64,
    /// Seed of the first script; the others have the seeds that follow
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Neighbours that differ by more levels in a channel are at an outline.
const OUTLINE: u8 = 24;

/// A pixel that is off by more levels shows another surface.
const OTHER: u8 = 12;

/// Draws all scripts and counts wrong pixels.
///
/// # Errors
/// Fails if a pixel shows another surface than the one that wins, or if a script cannot be drawn.
pub fn run(args: &Args) -> Result<()> {
    let mut sum = Found::default();
    for from in (0..args.scenes).step_by(500) {
        let seeds = args.seed + from..args.seed + args.scenes.min(from + 500);
        sum.add(judge_all(seeds)?);
        eprintln!("{} of {} scripts: {sum:?}", args.scenes.min(from + 500), args.scenes);
    }
    anyhow::ensure!(sum.wrong == 0, "{} pixels show another surface", sum.wrong);
    Ok(())
}

/// The result of the comparison.
#[derive(Clone, Debug, Default)]
struct Found {
    /// The number of pixels away from outlines, of all backends.
    judged: usize,
    /// The number of those pixels that show another surface.
    wrong: usize,
    /// The seeds of the scripts with wrong pixels.
    seeds: Vec<u64>,
}

impl Found {
    fn add(&mut self, other: Self) {
        self.judged += other.judged;
        self.wrong += other.wrong;
        self.seeds.extend(other.seeds);
    }
}

fn judge_all(seeds: std::ops::Range<u64>) -> Result<Found> {
    let backends = backends::all();
    let found: Vec<Found> = seeds
        .into_par_iter()
        .map(|seed| {
            let scene::Pair { script, expected, is_fine, is_sampled } = scene::of_seed(seed);
            // The plain tracer, which comes first, takes one ray per pixel.
            let judges = backends.iter().skip(usize::from(is_sampled));
            let judges = judges.filter(|of| !is_fine || of.arithmetic != Arithmetic::Single);
            let found = judge(&script, &expected, judges).with_context(|| format!("seed {seed}"))?;
            Ok(if found.wrong > 0 { Found { seeds: vec![seed], ..found } } else { found })
        })
        .collect::<Result<_>>()?;
    let mut sum = Found::default();
    found.into_iter().for_each(|of| sum.add(of));
    Ok(sum)
}

/// Counts the pixels of a script, drawn by each backend, that differ from the picture of the script `expected`.
fn judge<'a>(script: &str, expected: &str, backends: impl Iterator<Item = &'a Backend>) -> Result<Found> {
    let options = RenderOptions { precision: Precision::F64, ..Default::default() };
    let expected = render(&parsed(expected)?, &options)?;
    let scene = parsed(script)?;
    let mut found = Found::default();
    for backend in backends {
        let image = backend.render(&scene)?;
        let (judged, wrong) = compared(&image, &expected);
        if wrong > 0 {
            eprintln!("{}: {wrong} of {judged} pixels are wrong in\n{script}", backend.name);
        }
        found.judged += judged;
        found.wrong += wrong;
    }
    Ok(found)
}

fn parsed(script: &str) -> Result<Scene> {
    let parsed = parse("script", script.as_bytes(), &Limits::default());
    let whole = parsed.script.with_context(|| format!("{:?} in\n{script}", parsed.diagnostics))?;
    whole.frame(0).context("a script without a frame")
}

/// Returns the number of pixels away from outlines, and how many of them differ.
fn compared(image: &RgbImage, expected: &RgbImage) -> (usize, usize) {
    let (width, height) = expected.dimensions();
    let apart = |a: [u8; 3], b: [u8; 3]| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0);
    let (mut judged, mut wrong) = (0, 0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let here = expected.get_pixel(x, y).0;
            let mut around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
            if around.all(|(x, y)| apart(expected.get_pixel(x, y).0, here) <= OUTLINE) {
                judged += 1;
                wrong += usize::from(apart(image.get_pixel(x, y).0, here) > OTHER);
            }
        }
    }
    (judged, wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shows(script: &str, expected: &str) {
        let found = judge(script, expected, backends::all().iter()).unwrap();
        assert!(found.judged > 1000, "{found:?}");
        assert_eq!(found.wrong, 0);
    }

    #[test]
    fn of_two_equal_rings_the_first_is_seen() {
        let head = "Screen 81 61\nLook 2.1 2.7 3.3 0 .4 0 35\nTorus .8 .25 0 .4 0 0 1 0 1 0 0 0 0 0\n";
        let second = "Torus .8 .25 0 .4 0 0 1 0 0 1 0 0 0 0\n";
        shows(&format!("{head}{second}Trace\n"), &format!("{head}Trace\n"));
    }

    #[test]
    fn a_label_is_seen_on_its_bottle() {
        let script = |label: &str| {
            format!(
                "Screen 201 151\nLook 2.1 1.3 3.3 0 .5 0 30\nCylinder {label} 1 0 0 0 0 0\n\
                 Cylinder .6 0 0 0 0 1 0 0 1 0 0 0 0\nTrace\n"
            )
        };
        shows(&script(".6 0 .2 0 0 .6 0"), &script(".600001 0 .2 0 0 .6 0"));
    }

    #[test]
    fn a_triangle_is_seen_on_top_of_a_turned_box() {
        let script = |height: f64| {
            format!(
                "Screen 201 151\nLook 1 4 4 0 .3 0 40\nGroup t\nTriangle -1 {height} -1 1 {height} -1 0 {height} 1 1 0 0 0 0 0\n\
                 Box -1 0 -1 1 .5 1 0 1 0 0 0 0\nEnd\nUse t 0 0 0 33 0 0\nTrace\n"
            )
        };
        shows(&script(0.5), &script(0.500001));
    }

    #[test]
    fn a_slice_of_coincident_surfaces_shows_the_first() {
        let seed = std::env::var("RAYFOLD_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
        println!("seed {seed}");
        let found = judge_all(seed..seed + 150).unwrap();
        assert!(found.judged > 100_000, "{found:?}");
        assert_eq!(found.wrong, 0, "seeds {:?}", found.seeds);
    }

    #[test]
    fn the_other_surface_is_noticed() {
        let script =
            |color: &str| format!("Screen 40 30\nLook 0 0 5 0 0 0 40\nSphere 1 0 0 0 {color} 0 0 0\nTrace\n");
        let found = judge(&script("0 1 0"), &script("1 0 0"), backends::all()[..1].iter()).unwrap();
        assert!(found.wrong > 100, "{found:?}");
    }
}
