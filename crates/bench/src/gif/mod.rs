//! `rayfold-bench gif`: compares GIF encoders in time, memory, size and picture quality.
//!
//! rayfold and the peers found on this machine encode the same PNG files, one after the other. FFmpeg decodes all
//! results, and its pictures are compared with the frames.

use std::path::{Path, PathBuf};

use anyhow::Context;
use image::{GenericImageView, RgbImage};
use rayon::prelude::*;

mod metrics;
mod palettes;
mod programs;
mod report;
mod sets;
mod viewer;

use crate::measure::Cost;
use metrics::{Colours, Judge, Meant, Quality};
use palettes::Palettes;
use programs::{Job, Program};
use sets::Set;
use viewer::Viewer;

/// The frame rate of every set.
const FPS: u32 = 20;
/// The time of a frame in hundredths of a second.
const DELAY: u32 = 100 / FPS;
/// At most this many frames of a set, evenly spread, are compared by colour differences. All are compared by PSNR and
/// flicker.
const JUDGED: usize = 12;
/// The numbers of repetitions of the large set's frames for which memory is measured.
const REPEATED: [usize; 2] = [1, 10];
/// The side of a crop, in pixels.
const CROP: u32 = 64;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Measure only these sets; no report is written unless --reports is given
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    sets: Vec<String>,
    /// Run rayfold and gifski at quality 100 this often; the best run counts. The others run once
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// Keep frames and GIFs in this folder
    #[arg(long, value_name = "DIR", default_value = "target/gif-bench")]
    work: PathBuf,
    /// The rayfold to measure [default: it is built]
    #[arg(long, value_name = "FILE")]
    rayfold: Option<PathBuf>,
    /// Write the report into this folder [default: docs/reports]
    #[arg(long, value_name = "DIR")]
    reports: Option<PathBuf>,
}

/// The measurements of a set.
struct Measured {
    name: &'static str,
    about: &'static str,
    size: (u32, u32),
    count: usize,
    outcomes: Vec<Outcome>,
    palettes: Option<Palettes>,
    /// The crop of the middle frame as intended, if the report shows one.
    crop: Option<RgbImage>,
}

/// The result of one program on one set.
struct Outcome {
    program: &'static str,
    cost: Cost,
    bytes: u64,
    seen: Seen,
}

/// The result of decoding a GIF.
struct Seen {
    quality: Quality,
    frames: usize,
    /// Whether every frame is present and each is shown for its time.
    on_time: bool,
    crop: Option<RgbImage>,
}

/// The peak memory for a number of frames.
struct Held {
    frames: usize,
    memory: f64,
}

/// Measures and writes `gif.md`.
///
/// # Errors
/// Fails if a program fails or its result cannot be decoded.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let rayfold = match &args.rayfold {
        Some(path) => path.clone(),
        None => programs::build()?,
    };
    let programs = programs::all(&rayfold);
    let mut results = Vec::new();
    let mut held = Vec::new();
    for set in sets::all() {
        if !args.sets.is_empty() && !args.sets.iter().any(|name| name == set.name) {
            continue;
        }
        eprintln!("{}: {}", set.name, set.about);
        let frames = set.frames()?;
        let folder = args.work.join(set.name);
        let paths = write_frames(&frames, &folder)?;
        let measured = measure(&set, &programs, &frames, &paths, args.rounds)?;
        for outcome in &measured.outcomes {
            eprintln!("{}", report::line(outcome));
        }
        if set.name == sets::LARGE {
            held = memory(&rayfold, &paths, measured.size, &folder)?;
        }
        results.push(measured);
    }
    let all = args.sets.is_empty().then_some(Path::new("docs/reports"));
    match args.reports.as_deref().or(all) {
        Some(folder) => report::write(folder, &programs, &results, &held),
        None => Ok(()),
    }
}

fn write_frames(frames: &[RgbImage], folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let write = |(index, frame): (usize, &RgbImage)| {
        let path = folder.join(format!("{:04}.png", index + 1));
        frame.save(&path).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    };
    frames.par_iter().enumerate().map(write).collect()
}

fn measure(
    set: &Set,
    programs: &[Program],
    frames: &[RgbImage],
    paths: &[PathBuf],
    rounds: u32,
) -> anyhow::Result<Measured> {
    let folder = paths[0].parent().context("a folder with frames")?;
    let size = frames[0].dimensions();
    let here = programs.iter().filter(|program| program.version.is_some()).collect::<Vec<_>>();
    let gifs = here.iter().map(|program| folder.join(program.file_name())).collect::<Vec<_>>();
    let mut costs = vec![None::<Cost>; here.len()];
    for round in 0..rounds {
        for (at, program) in here.iter().enumerate() {
            if round == 0 || at == 0 || program.name == programs::RIVAL {
                let job = Job { frames: paths, size, fps: FPS, out: &gifs[at] };
                let cost = program.run(&job)?;
                costs[at] = Some(costs[at].map_or(cost, |best| best.least(cost)));
            }
        }
    }
    let crop = report::CROPS.iter().find(|(name, ..)| *name == set.name);
    let crop = crop.map(|&(_, left, top)| (left, top));
    let judged = judge(&gifs, frames, crop)?;
    let outcomes = here
        .iter()
        .zip(costs)
        .zip(gifs.iter().zip(judged))
        .map(|((program, cost), (gif, seen))| {
            let cost = cost.context("every program runs in the first round")?;
            let bytes = std::fs::metadata(gif)?.len();
            Ok(Outcome { program: program.name, cost, bytes, seen })
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let middle = &frames[frames.len() / 2];
    let palettes = (size.0 < 1000).then(|| palettes::compare(middle, folder)).transpose()?;
    let crop = crop.map(|(left, top)| cropped(middle, left, top));
    Ok(Measured {
        name: set.name,
        about: set.about,
        size,
        count: frames.len(),
        outcomes,
        palettes: palettes.flatten(),
        crop,
    })
}

/// Decodes all GIFs in parallel and compares them with the frames. If a program drops frames, the picture on the screen
/// at each frame's time counts.
fn judge(gifs: &[PathBuf], frames: &[RgbImage], crop: Option<(u32, u32)>) -> anyhow::Result<Vec<Seen>> {
    let size = frames[0].dimensions();
    let open = |gif: &PathBuf| Ok((Viewer::open(gif, size)?, Judge::default(), None));
    let mut shows = gifs.iter().map(open).collect::<anyhow::Result<Vec<_>>>()?;
    let step = frames.len().div_ceil(JUDGED);
    for (number, image) in frames.iter().enumerate() {
        let before = number.checked_sub(1).map(|before| &frames[before]);
        let colours = (number % step == step / 2).then(|| Colours::of(image));
        let meant = Meant { image, before, colours };
        shows.par_iter_mut().try_for_each(|(viewer, judge, cut)| {
            let shown = viewer.at(number as u32 * DELAY)?;
            judge.see(&meant, shown);
            if number == frames.len() / 2 {
                *cut = crop.map(|(left, top)| cropped(shown, left, top));
            }
            anyhow::Ok(())
        })?;
    }
    let close = |(viewer, judge, crop): (Viewer, Judge, _)| {
        let on_time =
            viewer.delays.len() == frames.len() && viewer.delays.iter().all(|&delay| delay == DELAY);
        Ok(Seen { quality: judge.quality(), frames: viewer.close()?, on_time, crop })
    };
    shows.into_iter().map(close).collect()
}

fn cropped(image: &RgbImage, left: u32, top: u32) -> RgbImage {
    image.view(left, top, CROP, CROP).to_image()
}

/// Measures the peak memory of `rayfold encode` with two threads, for few and for many frames.
fn memory(rayfold: &Path, paths: &[PathBuf], size: (u32, u32), folder: &Path) -> anyhow::Result<Vec<Held>> {
    REPEATED
        .iter()
        .map(|&times| {
            let frames = vec![paths; times].concat();
            let job = Job { frames: &frames, size, fps: FPS, out: &folder.join("memory.gif") };
            let mut command = programs::rayfold(rayfold, &job);
            command.args(["--threads", "2"]);
            Ok(Held { frames: frames.len(), memory: programs::cost_of(&command)?.memory })
        })
        .collect()
}
