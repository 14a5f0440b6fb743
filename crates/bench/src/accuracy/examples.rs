//! Compares frames of all example scenes, drawn as users get them (with samples and shutter), with the plain tracer.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use image::RgbImage;
use rayfold_scene::Script;
use rayfold_tracer::{Exposure, RenderOptions, precision, reference, render_frame};

use crate::report_folder::ReportFolder;
use crate::scenes::{EXAMPLES, MOVING_EXAMPLES, script};

/// The number of frames compared per animation, spread evenly.
const FRAMES: usize = 8;

/// The goal: at most this share of pixels is off by more than 2 levels, in percent.
const MOST: f64 = 0.01;

/// The result for an animation.
struct Row {
    name: &'static str,
    frames: usize,
    precision: String,
    samples: u32,
    pixels: usize,
    different: usize,
    off: usize,
    largest: u8,
}

impl Row {
    fn share(&self) -> f64 {
        100.0 * self.off as f64 / self.pixels as f64
    }
}

/// Compares and writes accuracy-examples.md.
///
/// # Errors
/// Fails if a scene cannot be drawn or the report cannot be written.
pub(super) fn run(output: &ReportFolder, quick: bool) -> Result<()> {
    let names = EXAMPLES.into_iter().chain(MOVING_EXAMPLES);
    let rows: Vec<Row> = names
        .map(|name| {
            eprintln!("scene {name}");
            compared(name, &script(name)?, if quick { 1 } else { FRAMES })
        })
        .collect::<Result<_>>()?;
    output.write("accuracy-examples.md", report(&rows, quick)?)
}

fn compared(name: &'static str, script: &Script, most: usize) -> Result<Row> {
    let count = script.frame_count();
    let frames = count.min(most);
    let first = script.frame(0).context("a frame")?;
    let mut row = Row {
        name,
        frames,
        precision: format!("{:?}", precision(&first)).to_lowercase(),
        samples: first.samples.most(),
        pixels: 0,
        different: 0,
        off: 0,
        largest: 0,
    };
    for k in 0..frames {
        // The middles of equal ranges of frames.
        let (ours, plain) = both(script, (2 * k + 1) * count / (2 * frames))?;
        for (a, b) in ours.pixels().zip(plain.pixels()) {
            let apart = (0..3).map(|c| a.0[c].abs_diff(b.0[c])).max().unwrap_or(0);
            row.pixels += 1;
            row.different += usize::from(apart > 0);
            row.off += usize::from(apart > 2);
            row.largest = row.largest.max(apart);
        }
    }
    Ok(row)
}

/// Returns a frame as users get it, and as the plain tracer draws it.
fn both(script: &Script, k: usize) -> Result<(RgbImage, RgbImage)> {
    let options = RenderOptions::default();
    let scene = script.frame(k).context("a frame")?;
    let after = |frames| script.frame_after(k, frames).unwrap_or_else(|| scene.clone());
    let plain = reference::render_exposed(Exposure::moving(&scene, &after), &options)?;
    Ok((render_frame(script, k, &options).context("a frame")??, plain))
}

fn report(rows: &[Row], quick: bool) -> Result<String> {
    let command = if quick { " --quick" } else { "" };
    let mut text = format!(
        "# Accuracy of the example scenes\n\n\
         Written by `cargo run --release -p rayfold-bench -- accuracy --examples{command}`. Frames of each animation \
         in `scenes/`, in its own size and with its samples, shutter and lights, drawn by `auto` and by the plain \
         `f64` tracer. For the first five it is the middle script, for the others up to {FRAMES} frames. *Off*: pixels \
         off by more than 2 levels; the goal is at most {MOST} %.\n\n"
    );
    let beyond: Vec<_> = rows.iter().filter(|row| row.share() > MOST).map(|row| row.name).collect();
    if beyond.is_empty() {
        writeln!(text, "All {} scenes meet the goal.\n", rows.len())?;
    } else {
        writeln!(text, "**Above the goal**: {}.\n", beyond.join(", "))?;
    }
    text += "| scene | frames | precision | rays per pixel, at most | pixels | different | off | off, % | largest, \
             levels |\n\
             | --- | --: | --- | --: | --: | --: | --: | --: | --: |\n";
    for row in rows {
        let Row { name, frames, precision, samples, pixels, different, off, largest } = row;
        let share = row.share();
        writeln!(
            text,
            "| {name} | {frames} | {precision} | {samples} | {pixels} | {different} | {off} | {share:.4} | {largest} |"
        )?;
    }
    Ok(text)
}
