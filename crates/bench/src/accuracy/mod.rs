//! `rayfold-bench accuracy`: how far each way to trace is from the truth, and what it costs.

mod flip;
mod images;
mod naive;
mod rays;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rayfold_tracer::MAX_BOUNCES;

use crate::hard_cases::{CASES, SEED, Size};
use crate::plot::{Labels, Series, log_log};
use crate::scenes::{EXAMPLES, example, rock, table};
use crate::tracers;
use images::{Comparison, compare};

/// What to measure.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder that receives accuracy.md and its plots
    #[arg(long, default_value = "docs/reports")]
    output: PathBuf,
    /// Take the hard cases at the quick sizes of the tests, and each image once
    #[arg(long)]
    quick: bool,
}

/// Measures and writes the report.
///
/// # Errors
/// When a scene cannot be rendered or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    std::fs::create_dir_all(&args.output)?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let comparisons = one.install(|| comparisons(args.quick))?;
    let mut report = introduction(args.quick);
    report += &image_tables(&comparisons)?;
    plot_images(&args.output, &comparisons)?;
    report += &hard_cases(if args.quick { Size::Quick } else { Size::Full })?;
    let path = args.output.join("accuracy.md");
    std::fs::write(&path, report).with_context(|| path.display().to_string())
}

fn introduction(quick: bool) -> String {
    let command = if quick { " --quick" } else { "" };
    format!(
        "# Accuracy\n\n\
         Written by `cargo run --release -p rayfold-bench -- accuracy{command}`; all figures are of one run.\n\n\
         Every way to trace draws the same scenes on one thread, in turn, and its processor time is taken (the machine \
         may be busy with other work; the median of the rounds is shown). The truth is the plain `f64` tracer \
         (`reference`), whose own error is measured against an oracle that computes with 640 bits. `f32 naive` is a \
         tracer of textbook formulas with an absolute epsilon, written for this report, scalar and without any tree: \
         it shows what the hard cases find, its speed is not that of a packet tracer without robustness. The number \
         of bounces is fixed by the language ({MAX_BOUNCES}), so depth is no setting.\n\n\
         RMSE and the largest error are in levels (0 to 255) over the three channels; FLIP is the mean of LDR-FLIP \
         (Andersson et al. 2020) at 67 pixels a degree. Images are of 8 bits, in which no NaN can hide: a NaN becomes \
         level 0 and counts as an error. *Front*: no other way is both as fast and as close to the truth. Rays are \
         those that the language asks for: from the camera, to each light that a surface faces, from mirrors.\n\n"
    )
}

fn comparisons(quick: bool) -> Result<Vec<Comparison>> {
    let tracers = tracers::for_pictures();
    let naive = naive::tracer();
    let mut ways: Vec<_> = tracers.iter().collect();
    ways.push(&naive);
    let (rounds, samples) = if quick { (1, 500) } else { (7, 4000) };
    let mut all = Vec::new();
    for name in EXAMPLES {
        eprintln!("scene {name}");
        all.push(compare(name, &example(name)?, &ways, rounds, samples)?);
    }
    eprintln!("scene table");
    all.push(compare("table (22 spheres, mirrors)", &table(640, 480)?, &ways, rounds, samples)?);
    eprintln!("scene rock");
    let mesh = rock(if quick { 1280 } else { 20_480 }, 256, 256)?;
    all.push(compare("rock (mesh)", &mesh, &ways, 1, samples / 50)?);
    Ok(all)
}

fn image_tables(comparisons: &[Comparison]) -> Result<String> {
    let mut text = String::from("## Images\n\n![Error over time](accuracy-images.svg)\n");
    for c in comparisons {
        let truth = &c.truth;
        write!(
            text,
            "\n### {}\n\n{} objects, {} pixels, {} rays. The truth's own error at {} pixels: largest {:.1e} levels; \
             {} see something else than the oracle.\n\n\
             | way | CPU s | Mrays/s | RMSE | largest | off by > 2 | FLIP | front |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- |\n",
            c.scene, c.objects, c.pixels, c.rays, truth.samples, truth.largest, truth.off
        )?;
        for m in &c.measurements {
            writeln!(
                text,
                "| {} | {:.4} | {:.2} | {:.4} | {} | {} ({:.4} %) | {:.5} | {} |",
                m.tracer,
                m.seconds,
                c.rays as f64 / m.seconds / 1e6,
                m.rmse,
                m.largest,
                m.off,
                100.0 * m.off as f64 / c.pixels as f64,
                m.flip,
                if m.on_front { "yes" } else { "" }
            )?;
        }
    }
    text.push('\n');
    Ok(text)
}

/// Error over time, a colour a way, a point a scene. Images without any error are drawn at the bottom.
fn plot_images(folder: &Path, comparisons: &[Comparison]) -> Result<()> {
    const NONE: f64 = 1e-4;
    let ways = comparisons.first().map_or(0, |c| c.measurements.len());
    let series: Vec<Series> = (0..ways)
        .map(|way| Series {
            name: comparisons[0].measurements[way].tracer.clone(),
            points: comparisons
                .iter()
                .map(|c| (c.measurements[way].seconds, c.measurements[way].rmse.max(NONE)))
                .collect(),
            joined: false,
        })
        .collect();
    let labels = Labels {
        title: "Error over time, one point a scene",
        x: "CPU seconds an image",
        y: "RMSE in levels (1e-4: none)",
    };
    log_log(&folder.join("accuracy-images.svg"), &labels, &series)
}

/// The hard cases as a table, and the error over the distance as a plot.
fn hard_cases(size: Size) -> Result<String> {
    let mut tracers = tracers::all();
    tracers.push(naive::tracer());
    let mut text = format!(
        "## Hard cases\n\nSeed {SEED}. A figure is the worst or the count found. The bounds are those of \
         `tests/hard_cases.rs`, which holds every way but the naive one to them.\n\n\
         | case | what | way | figure | bound | of | |\n| --- | --- | --- | --- | --- | --- | --- |\n"
    );
    for case in CASES {
        eprintln!("hard case {}: {}", case.number, case.title);
        for figure in case.figures(&tracers, size)? {
            let bound = figure.bound.map_or("none".into(), |bound| format!("{bound:.1e}"));
            let verdict = if figure.passes() { "ok" } else { "**fails**" };
            writeln!(
                text,
                "| {} {} | {} | {} | {:.2e} | {bound} | {} | {verdict} |",
                case.number, case.title, figure.what, figure.tracer, figure.measured, figure.samples
            )?;
        }
    }
    Ok(text)
}
