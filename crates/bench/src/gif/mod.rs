//! Encoders of GIF side by side: time, memory, size, and how near the picture is.
//!
//! rayfold and the peers found on this machine encode the same PNG files, one after the other; FFmpeg decodes all
//! results; what it shows is compared with the frames.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use image::RgbImage;
use serde::{Deserialize, Serialize};

mod metrics;
mod programs;
mod report;
mod sets;

use crate::measure::Cost;
use metrics::Quality;
use programs::{Job, Program};
use sets::Set;

/// Frames a second of every set.
const FPS: u32 = 20;

/// The command line.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Only these sets; no report is written then
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    sets: Vec<String>,
    /// Where frames and GIFs are kept
    #[arg(long, value_name = "DIR", default_value = "target/gif-bench")]
    work: PathBuf,
    /// The rayfold to measure; built when it is not given
    #[arg(long, value_name = "FILE")]
    rayfold: Option<PathBuf>,
    /// Where the report goes
    #[arg(long, value_name = "DIR", default_value = "docs/reports")]
    reports: PathBuf,
}

/// One program on one set.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Outcome {
    program: String,
    cost: Cost,
    bytes: u64,
    quality: Quality,
    frames: usize,
    delays: Vec<u32>,
    gif: PathBuf,
}

/// Measures and writes `gif.md`.
///
/// # Errors
/// When a program fails, or its result cannot be decoded.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let rayfold = match &args.rayfold {
        Some(path) => path.clone(),
        None => programs::build()?,
    };
    let programs = programs::all(&rayfold);
    let mut results = Vec::new();
    for set in sets::all() {
        if !args.sets.is_empty() && !args.sets.iter().any(|name| name == set.name) {
            continue;
        }
        eprintln!("{}: {}", set.name, set.about);
        let folder = args.work.join(set.name);
        let paths = write_frames(&set, &folder)?;
        let costs = programs
            .iter()
            .map(|program| {
                let gif = folder.join(program.file_name());
                let job = Job { frames: &paths, size: set.size, fps: FPS, out: &gif };
                Ok((program, program.run(&job)?, gif))
            })
            .collect::<anyhow::Result<Vec<_>>>()?;
        let meant = (0..set.count).map(|number| set.frame(number)).collect::<Vec<_>>();
        let mut outcomes = Vec::new();
        for (program, cost, gif) in costs {
            let outcome = judge(program, cost, gif, &set, &meant)?;
            eprintln!("{}", report::line(&outcome));
            outcomes.push(outcome);
        }
        results.push((set, outcomes));
    }
    if args.sets.is_empty() {
        report::write(&args.reports, &programs, &results)?;
    }
    Ok(())
}

fn write_frames(set: &Set, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    (0..set.count)
        .map(|number| {
            let path = folder.join(format!("{:04}.png", number + 1));
            set.frame(number).save(&path)?;
            Ok(path)
        })
        .collect()
}

fn judge(
    program: &Program,
    cost: Cost,
    gif: PathBuf,
    set: &Set,
    meant: &[RgbImage],
) -> anyhow::Result<Outcome> {
    let (shown, delays) = programs::decode(&gif, set.size)?;
    ensure!(!shown.is_empty(), "{} wrote no frame", program.name);
    // A program that leaves frames out is judged by what is on the screen at each frame's time.
    let mut ends = delays.iter().scan(0, |at, delay| {
        *at += delay;
        Some(*at)
    });
    let mut end = ends.next().unwrap_or(0);
    let mut index = 0;
    let at_time = (0..meant.len() as u32).map(|frame| {
        while frame * (100 / FPS) >= end && index + 1 < shown.len() {
            index += 1;
            end = ends.next().unwrap_or(u32::MAX);
        }
        &shown[index]
    });
    let quality = metrics::quality(meant, &at_time.collect::<Vec<_>>());
    let bytes = std::fs::metadata(&gif)?.len();
    Ok(Outcome { program: program.name.clone(), cost, bytes, quality, frames: shown.len(), delays, gif })
}
