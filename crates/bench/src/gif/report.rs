//! `docs/reports/gif.md`: tables, plots and enlarged crops.

use std::fmt::Write as _;
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, GenericImage, ImageEncoder, Rgb, RgbImage, imageops};

use super::palettes::Judged;
use super::programs::{Program, RIVAL};
use super::sets::NOISE;
use super::{CROP, FPS, Held, JUDGED, Measured, Outcome};
use crate::plot::{Labels, Series, columns, log_log};
use rayfold_files::OutputFile;

/// The sets of which crops are shown, and their positions: left, top.
pub(super) const CROPS: [(&str, u32, u32); 3] =
    [("artisticsss", 200, 190), ("spheres", 380, 180), ("texture", 215, 180)];
/// The programs whose crops are shown, after the intended one.
const SHOWN: [&str; 4] = ["rayfold", RIVAL, "ffmpeg", "Pillow"];
const ENLARGED: u32 = 3;
/// The goal: at most this memory at 1080p with two threads, in MB.
const MAX_MEMORY: f64 = 64.0;

/// A goal relative to the rival.
struct Goal {
    name: &'static str,
    asked: &'static str,
    figure: fn(&Outcome, &Outcome) -> f64,
    met: fn(f64, &str) -> bool,
}

const NO_WORSE: &str = "at most 1.01";

const GOALS: [Goal; 9] = [
    Goal { name: "wall", asked: "at most 1/3", figure: |a, b| ratio(a.cost.wall, b.cost.wall), met: third },
    Goal { name: "CPU", asked: "at most 1/3", figure: |a, b| ratio(a.cost.cpu, b.cost.cpu), met: third },
    Goal {
        name: "size",
        asked: "at most 1, noise 1.3",
        figure: |a, b| a.bytes as f64 / b.bytes as f64,
        met: |ratio, set| ratio <= if set == NOISE { 1.3 } else { 1.0 },
    },
    Goal {
        name: "PSNR",
        asked: "at least 0.99",
        figure: |a, b| a.seen.quality.psnr / b.seen.quality.psnr,
        met: |ratio, _| ratio >= 0.99,
    },
    Goal {
        name: "worst",
        asked: "at least 0.99",
        figure: |a, b| a.seen.quality.psnr_worst / b.seen.quality.psnr_worst,
        met: |ratio, _| ratio >= 0.99,
    },
    Goal {
        name: "dE",
        asked: NO_WORSE,
        figure: |a, b| ratio(a.seen.quality.de76, b.seen.quality.de76),
        met: no_worse,
    },
    Goal {
        name: "dE 2000",
        asked: NO_WORSE,
        figure: |a, b| ratio(a.seen.quality.de2000, b.seen.quality.de2000),
        met: no_worse,
    },
    Goal {
        name: "blurred",
        asked: NO_WORSE,
        figure: |a, b| ratio(a.seen.quality.blurred, b.seen.quality.blurred),
        met: no_worse,
    },
    Goal {
        name: "flicker",
        asked: "at most .05, no ratio",
        figure: |a, _| a.seen.quality.flicker,
        met: |flicker, _| flicker <= 0.05,
    },
];

/// Returns the ratio of errors or times. Two zeros have the ratio 1.
fn ratio(ours: f64, theirs: f64) -> f64 {
    if ours == 0.0 && theirs == 0.0 { 1.0 } else { ours / theirs }
}

fn third(ratio: f64, _: &str) -> bool {
    ratio <= 1.0 / 3.0
}

fn no_worse(ratio: f64, _: &str) -> bool {
    ratio <= 1.01
}

const HEAD: &str = "\
| program | wall s | CPU s | MB | file MB | PSNR | worst | dE | dE 2000 | blurred | flicker | share | frames | on time |
| --- | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --- |
";

/// Returns a row of a set's table.
pub(super) fn line(o: &Outcome) -> String {
    let q = &o.seen.quality;
    format!(
        "| {} | {:.2} | {:.2} | {:.0} | {:.3} | {:.2} | {:.2} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {} | {} |",
        o.program,
        o.cost.wall,
        o.cost.cpu,
        o.cost.memory,
        o.bytes as f64 / 1e6,
        q.psnr,
        q.psnr_worst,
        q.de76,
        q.de2000,
        q.blurred,
        q.flicker,
        q.flicker_share,
        o.seen.frames,
        if o.seen.on_time { "yes" } else { "**no**" },
    )
}

pub(super) fn write(
    folder: &Path,
    programs: &[Program],
    results: &[Measured],
    held: &[Held],
) -> anyhow::Result<()> {
    let beside = folder.join("gif");
    std::fs::create_dir_all(&beside)?;
    let mut text = format!(
        "# GIFs: rayfold compared with other encoders\n\n\
        Written by `cargo run --release -p rayfold-bench -- gif`. All programs encode the same PNG files at {FPS} \
        frames per second, one after the other on the same machine ({} processors). rayfold and {RIVAL} run in turns, \
        several times, and the best run counts; the others run once. Wall times depend on the other load of the \
        machine. FFmpeg decodes every result.\n\n\
        PSNR is computed over the three channels of sRGB. The tables give the mean of all frames, and the PSNR of the \
        worst frame (99: exact). dE is the CIE 1976 colour difference. dE 2000 is the difference of CIE 142-2001 \
        (every seventh pixel). *Blurred* is the CIE 1976 difference of pictures averaged over 5 x 5 pixels. These \
        three are means over at most {JUDGED} frames of a set, evenly spread. Flicker is measured on pixels that \
        should not change from one frame to the next. *Flicker* is their mean CIE 1976 difference between the shown \
        frames, and *share* is the share of these pixels that changes. If a program drops a frame, the picture that it \
        shows at the time of that frame counts. *On time* means that every frame is present and is shown for its \
        time.\n\n",
        std::thread::available_parallelism().map_or(1, usize::from),
    );
    goals(&mut text, results, held)?;
    text.push_str("\n## Programs\n\n| program | version | how |\n| --- | --- | --- |\n");
    for Program { name, version, how, .. } in programs {
        let version = version.as_deref().unwrap_or("**not on this machine: not measured**");
        writeln!(text, "| {name} | {version} | {how} |")?;
    }
    palettes(&mut text, results)?;
    text.push_str("\n## All sets\n\n![CPU time and size](gif/cost.svg)\n\n![dE and size](gif/quality.svg)\n");
    for set in results {
        let (width, height) = set.size;
        writeln!(text, "\n## {}\n\n{} frames of {width} x {height}: {}.\n", set.name, set.count, set.about)?;
        text.push_str(HEAD);
        for outcome in &set.outcomes {
            writeln!(text, "{}", line(outcome))?;
        }
        if let Some((sheet, names)) = crops(set)? {
            let file = format!("{}.png", set.name);
            save(&sheet, &beside.join(&file))?;
            let names = names.join(", ");
            writeln!(
                text,
                "\nEnlarged parts of the middle frame: {names}.\n\n![Crops: {names}](gif/{file})"
            )?;
        }
    }
    plots(&beside, results)?;
    OutputFile::write(folder.join("gif.md"), text, false)?;
    Ok(())
}

/// Returns the two programs that the goals compare, if both are present.
fn rivals(set: &Measured) -> Option<(&Outcome, &Outcome)> {
    let of = |name| set.outcomes.iter().find(|o| o.program == name);
    of("rayfold").zip(of(RIVAL))
}

fn goals(text: &mut String, results: &[Measured], held: &[Held]) -> anyhow::Result<()> {
    text.push_str("## rayfold against gifski at quality 100\n\n");
    if results.iter().all(|set| rivals(set).is_none()) {
        text.push_str("gifski is not on this machine, so there is no comparison.\n");
        return Ok(());
    }
    text.push_str("Ratios of rayfold's figure to gifski's. A bold ratio misses its goal.\n\n| set |");
    GOALS.iter().for_each(|goal| text.push_str(&format!(" {} |", goal.name)));
    text.push_str("\n| --- |");
    GOALS.iter().for_each(|_| text.push_str(" --: |"));
    text.push_str("\n| *goal* |");
    GOALS.iter().for_each(|goal| text.push_str(&format!(" *{}* |", goal.asked)));
    text.push('\n');
    let (mut figures, mut missed) = (0, Vec::new());
    for set in results {
        let Some((ours, theirs)) = rivals(set) else { continue };
        write!(text, "| {} |", set.name)?;
        for goal in &GOALS {
            let figure = (goal.figure)(ours, theirs);
            figures += 1;
            if (goal.met)(figure, set.name) {
                write!(text, " {figure:.3} |")?;
            } else {
                write!(text, " **{figure:.3}** |")?;
                missed.push(format!("{} of {} ({figure:.3}, goal: {})", goal.name, set.name, goal.asked));
            }
        }
        text.push('\n');
    }
    for Held { frames, memory } in held {
        figures += 1;
        if *memory > MAX_MEMORY {
            missed.push(format!("memory for {frames} frames ({memory:.0} MB, goal: at most {MAX_MEMORY})"));
        }
    }
    writeln!(text, "\n{} of {figures} figures meet their goals.", figures - missed.len())?;
    if !missed.is_empty() {
        text.push_str("Missed:\n\n");
        missed.iter().for_each(|miss| text.push_str(&format!("- {miss}\n")));
    }
    text.push_str("\n![Ratios to gifski at quality 100](gif/ratios.svg)\n");
    if held.is_empty() {
        return Ok(());
    }
    let memory = held.iter().map(|h| format!("{:.0} MB for {} frames", h.memory, h.frames));
    let memory = memory.collect::<Vec<_>>().join(", ");
    writeln!(text, "\nPeak memory at 1920 x 1080 with two threads (goal: at most 64 MB): {memory}.")?;
    Ok(())
}

fn palettes(text: &mut String, results: &[Measured]) -> anyhow::Result<()> {
    text.push_str(
        "\n\
        ## The palette compared with quantette's\n\n\
        The middle frame alone is encoded with palettes of `rayfold-gif` and of the crate `quantette` (k-means in \
        Oklab, no dithering; `rayfold-gif` writes its result without further loss). PSNR and dE are those of the frame \
        with each pixel in the nearest colour of the palette. CPU is the time in milliseconds from pixels to GIF.\n\n\
        | set | PSNR | quantette | dE | quantette | CPU ms | quantette | kB | quantette |\n\
        | --- | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    for set in results {
        let Some(both) = &set.palettes else { continue };
        let pair = |figure: fn(&Judged) -> f64, places: usize| {
            format!("{:.places$} | {:.places$}", figure(&both.ours), figure(&both.theirs))
        };
        writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            set.name,
            pair(|p| p.psnr, 2),
            pair(|p| p.de76, 3),
            pair(|p| p.cpu * 1e3, 1),
            pair(|p| p.bytes as f64 / 1e3, 1),
        )?;
    }
    Ok(())
}

/// Returns the intended crop and those of some programs side by side, and their names.
fn crops(set: &Measured) -> anyhow::Result<Option<(RgbImage, Vec<&str>)>> {
    let Some(meant) = &set.crop else { return Ok(None) };
    let of = |name| set.outcomes.iter().find(|o| o.program == name).and_then(|o| o.seen.crop.as_ref());
    let shown = SHOWN.iter().filter_map(|&name| Some((name, of(name)?)));
    let panels = std::iter::once(("the frame", meant)).chain(shown).collect::<Vec<_>>();
    let side = CROP * ENLARGED;
    let mut sheet = RgbImage::from_pixel((side + 6) * panels.len() as u32 - 6, side, Rgb([255; 3]));
    for ((_, crop), x) in panels.iter().zip((0..).step_by(side as usize + 6)) {
        sheet.copy_from(&imageops::resize(*crop, side, side, imageops::FilterType::Nearest), x, 0)?;
    }
    Ok(Some((sheet, panels.into_iter().map(|(name, _)| name).collect())))
}

/// Saves with the best compression, because the repository keeps the file.
fn save(image: &RgbImage, path: &Path) -> anyhow::Result<()> {
    let mut file = Vec::new();
    PngEncoder::new_with_quality(&mut file, CompressionType::Best, FilterType::Up).write_image(
        image.as_raw(),
        image.width(),
        image.height(),
        ExtendedColorType::Rgb8,
    )?;
    Ok(OutputFile::write(path, file, false)?)
}

fn plots(folder: &Path, results: &[Measured]) -> anyhow::Result<()> {
    let mut programs = results.iter().flat_map(|set| &set.outcomes).map(|o| o.program).collect::<Vec<_>>();
    let mut seen = std::collections::HashSet::new();
    programs.retain(|&name| seen.insert(name));
    let series = |y: fn(&Outcome) -> f64| {
        let of = |&name: &&str| {
            let outcomes = results.iter().flat_map(|set| &set.outcomes).filter(|o| o.program == name);
            let points = outcomes.map(|o| (o.bytes as f64, y(o))).filter(|p| p.1 > 0.0).collect();
            Series { name: name.to_owned(), points, joined: false }
        };
        programs.iter().map(of).collect::<Vec<_>>()
    };
    let cost = Labels { title: "CPU time and size of each set", x: "bytes", y: "CPU seconds" };
    log_log(&folder.join("cost.svg"), &cost, &series(|o| o.cost.cpu))?;
    let quality = Labels { title: "dE and size of each set", x: "bytes", y: "mean CIE 1976 difference" };
    log_log(&folder.join("quality.svg"), &quality, &series(|o| o.seen.quality.de76))?;

    let compared = results.iter().filter_map(|set| Some((set.name, rivals(set)?))).collect::<Vec<_>>();
    if compared.is_empty() {
        return Ok(());
    }
    let ratios = GOALS.iter().filter(|goal| goal.name != "flicker" && goal.name != "dE 2000").map(|goal| {
        let points = compared.iter().enumerate().map(|(k, (_, (a, b)))| (k as f64, (goal.figure)(a, b)));
        Series { name: goal.name.to_owned(), points: points.collect(), joined: false }
    });
    let names = compared.iter().map(|(name, _)| *name).collect::<Vec<_>>();
    let labels = Labels { title: "rayfold / gifski at quality 100", x: "", y: "ratio (0 is left out)" };
    columns(&folder.join("ratios.svg"), &labels, &names, &[1.0 / 3.0, 1.0], &ratios.collect::<Vec<_>>())
}
