//! `rayfold-bench accuracy`: the error of each backend and its cost.

mod examples;
mod flip;
mod images;
mod naive;
pub(crate) mod rays;

use std::fmt::Write as _;
use std::time::Instant;

use anyhow::{Context, Result};
use rayfold_tracer::MAX_BOUNCES;

use crate::backends;
use crate::cpu_time::{self, median};
use crate::hard_cases::{CASES, Report, Run, Size, one_of_each};
use crate::plot::{Labels, Series, log_log};
use crate::report_folder::ReportFolder;
use crate::scenes::{EXAMPLES, example, rock, table};
pub(crate) use naive::NAME as NAIVE;

use images::{Comparison, DEEPEST, Measurement, Subject, compare};

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Use small images, each drawn once, and hard cases at the sizes of the tests
    #[arg(long)]
    quick: bool,
    /// Measure the hard cases at full size instead of the images
    #[arg(long)]
    hard_cases: bool,
    /// Compare the frames of all example scenes, as users get them, and write accuracy-examples.md
    #[arg(long, conflicts_with = "hard_cases")]
    examples: bool,
    /// Measure only this hard case
    #[arg(long, requires = "hard_cases")]
    case: Option<String>,
    /// Measure nothing: write the page on the hard cases from the figures beside it
    #[arg(long, requires = "hard_cases", conflicts_with = "case")]
    page: bool,
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if a scene cannot be rendered or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    if args.hard_cases {
        return hard_cases(args);
    }
    if args.examples {
        return examples::run(&args.output, args.quick);
    }
    let report = {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let subjects = subjects(args.quick)?;
        let mut comparisons = Vec::new();
        for subject in &subjects {
            eprintln!("scene {}", subject.name);
            comparisons.push(one.install(|| compare(subject))?);
        }
        let cost = one.install(|| cost_of_robustness(&subjects, args.quick))?;
        let plots = plots(&args.output, &comparisons)?;
        introduction(args.quick) + &cost + &plots + &tables(&comparisons)?
    };
    args.output.write("accuracy.md", report)
}

fn introduction(quick: bool) -> String {
    let command = if quick { " --quick" } else { "" };
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let load = load.trim();
    format!(
        "# Accuracy\n\n\
         Written by `cargo run --release -p rayfold-bench -- accuracy{command}`; all figures are from one run. The \
         load at its end was {load} (`/proc/loadavg`). `... accuracy --hard-cases` measures the hard cases at full \
         size and writes `hard-cases.md`; `... accuracy --examples` compares frames of all example scenes as users get \
         them and writes [accuracy-examples.md](accuracy-examples.md).\n\n\
         Every backend draws the same scenes on one thread, in turn. The times are processor times, because the \
         machine may be busy with other work, and medians of the rounds. `f32 naive` uses the same packets, tiles and \
         trees with textbook formulas: quadratic roots, edges and slabs without error bounds, and rays that start 1e-4 \
         off their surface. `auto` is the default: `f32 robust`, or `f64` if the bounds on the errors of `f32` require \
         it.\n\n\
         The true image is that of the plain `f64` tracer (`reference`) at the same depth. Its own error is measured \
         against an oracle that computes with 640 bits. *Depth* is the number of reflections that are traced. The \
         language's depth is {MAX_BOUNCES}; depths up to {DEEPEST} are drawn if they add rays. *Unfinished* is the \
         root mean square difference from the true image of the greatest depth, caused by rounding and by stopping \
         early. *Front* marks the rows for which no other combination of backend and depth is both as fast and as \
         accurate.\n\n\
         RMSE and the largest error are in levels (0 to 255) over the three channels; FLIP is the mean of LDR-FLIP \
         (Andersson et al. 2020) at 67 pixels per degree; *dots* are pixels that differ by more than 16 levels from \
         each of the nine pixels around them in the true image. This is the visible part of an error at an outline \
         ([outlines.md](outlines.md) searches for them thoroughly). NaN counts channels that were not a number before \
         they were converted to a level. Rays are those that the language prescribes: from the camera, to each light \
         that a surface faces, and from mirrors. Pictures have one sample per pixel; for several see \
         [sampling.md](sampling.md).\n\n"
    )
}

fn subjects(quick: bool) -> Result<Vec<Subject>> {
    let (rounds, samples) = if quick { (1, 200) } else { (5, 2000) };
    let subject =
        |name: &str, scene| Subject { name: name.into(), scene, rounds, samples, plain: true, deep: true };
    let mut all = Vec::new();
    for name in EXAMPLES {
        all.push(subject(name, example(name)?));
    }
    all.push(subject("table", if quick { table(160, 120)? } else { table(480, 360)? }));
    for (name, scene) in one_of_each(if quick { 48 } else { 128 })? {
        all.push(Subject { samples: samples / 20, deep: false, ..subject(name, scene) });
    }
    let (plain, big) = if quick { (1280, 20_480) } else { (20_480, 327_680) };
    all.push(Subject { samples: samples / 50, ..subject("rock", rock(plain, 128, 128)?) });
    all.push(Subject { samples: 4, plain: false, ..subject("big mesh", rock(big, 512, 512)?) });
    Ok(all)
}

/// Compares the time of robust formulas with that of naive ones, in pairs.
fn cost_of_robustness(subjects: &[Subject], quick: bool) -> Result<String> {
    let pairs = if quick { 3 } else { 31 };
    let mut text = format!(
        "## The cost of robustness\n\n\
         CPU time of `f32 robust` divided by that of `f32 naive`, both with packets, drawn in turn {pairs} times. \
         *Fastest* is the ratio of the fastest runs, *median* the median of the ratios. The naive backend has three \
         kernels. The robust backend has a kernel for each kind of scene, which is an advantage.\n\n\
         | scene | naive, ms | robust, ms | fastest | median |\n\
         | --- | --- | --- | --- | --- |\n"
    );
    let all = backends::for_pictures(MAX_BOUNCES);
    let find = |name: &str| all.iter().find(|backend| backend.name == name).context("a backend");
    let (naive, robust) = (find("f32 naive")?, find("f32 robust")?);
    let named = |subject: &&Subject| EXAMPLES.contains(&subject.name.as_str());
    let others = |subject: &&Subject| ["table", "rock", "big mesh"].contains(&subject.name.as_str());
    for subject in subjects.iter().filter(|subject| named(subject) || others(subject)) {
        let mut times = [Vec::new(), Vec::new()];
        for round in 0..pairs {
            // Each goes first in every other round.
            for which in [round % 2, 1 - round % 2] {
                let (seconds, image) = cpu_time::of(|| [naive, robust][which].render(&subject.scene))?;
                image?;
                times[which].push(seconds);
            }
        }
        let ratios = times[1].iter().zip(&times[0]).map(|(robust, naive)| robust / naive).collect();
        let [naive, robust] = times.map(|times| times.into_iter().fold(f64::INFINITY, f64::min));
        writeln!(
            text,
            "| {} | {:.2} | {:.2} | {:.3} | {:.3} |",
            subject.name,
            1e3 * naive,
            1e3 * robust,
            robust / naive,
            median(ratios)
        )?;
    }
    text.push('\n');
    Ok(text)
}

fn tables(comparisons: &[Comparison]) -> Result<String> {
    let mut text = String::from("## Images\n");
    for c in comparisons {
        let truth = &c.truth;
        write!(
            text,
            "\n\
             ### {}\n\n\
             {} objects, {} x {} pixels. `{}` draws the true image. Its own error at {} pixels: at most {:.1e} levels; \
             {} pixels show another object than the oracle's.\n\n\
             | backend | depth | CPU ms | rays | Mrays/s | RMSE | largest | off by > 2 | dots | FLIP | NaN | \
             unfinished | front |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
            c.scene, c.objects, c.size.0, c.size.1, truth.backend, truth.samples, truth.largest, truth.off
        )?;
        for m in &c.measurements {
            let e = &m.error;
            writeln!(
                text,
                "| {} | {} | {:.2} | {} | {:.2} | {:.4} | {} | {} ({:.4} %) | {} | {:.5} | {} | {:.4} | {} |",
                m.backend,
                m.bounces,
                1e3 * m.seconds,
                m.rays,
                m.rays as f64 / m.seconds / 1e6,
                e.rmse,
                e.largest,
                e.off,
                100.0 * e.off as f64 / c.pixels() as f64,
                e.dots,
                e.flip,
                e.nans,
                m.unfinished,
                if m.on_front { "yes" } else { "" }
            )?;
        }
    }
    Ok(text)
}

/// An image without any error is plotted at the bottom, at this value.
const NONE: f64 = 1e-4;

/// Plots the error over time: all scenes at the language's depth, and each scene with mirrors at all depths.
fn plots(output: &ReportFolder, comparisons: &[Comparison]) -> Result<String> {
    let mut text = String::from("## Error over time\n\n![Error over time](accuracy-images.svg)\n\n");
    let count = comparisons.first().map_or(0, |c| c.pictures().count());
    let names = comparisons.first().into_iter().flat_map(Comparison::pictures).map(|m| m.backend.clone());
    let series: Vec<Series> = names
        .filter(|name| name != "reference")
        .map(|name| {
            let pictures = comparisons.iter().flat_map(Comparison::pictures).filter(|m| m.backend == name);
            Series {
                points: pictures.map(|m| (m.seconds, m.error.rmse.max(NONE))).collect(),
                name,
                joined: false,
            }
        })
        .collect();
    let labels = Labels {
        title: "Error over time at the language's depth, one point per scene",
        x: "CPU seconds an image",
        y: "RMSE in levels (1e-4: none)",
    };
    log_log(&output.path("accuracy-images.svg"), &labels, &series)?;
    for c in comparisons.iter().filter(|c| c.measurements.len() > count) {
        let mut series: Vec<Series> = Vec::new();
        for m in c.measurements.iter().filter(|m| m.backend != "reference") {
            let point = |m: &Measurement| (m.seconds, m.unfinished.max(NONE));
            match series.last_mut() {
                Some(last) if last.name == m.backend => last.points.push(point(m)),
                _ => series.push(Series { name: m.backend.clone(), points: vec![point(m)], joined: true }),
            }
        }
        let file = format!("accuracy-{}.svg", c.scene.replace(' ', "-"));
        let title = format!("{}: error over time, one point per depth", c.scene);
        let labels = Labels {
            title: &title,
            x: "CPU seconds an image",
            y: "RMSE in levels relative to the greatest depth (1e-4: none)",
        };
        log_log(&output.path(&file), &labels, &series)?;
        writeln!(text, "![{title}]({file})\n")?;
    }
    Ok(text)
}

/// Measures the hard cases, or one of them, and writes their page and the files beside it.
fn hard_cases(args: &Args) -> Result<()> {
    let size = if args.quick { Size::Quick } else { Size::Full };
    let folder = args.output.path("hard-cases");
    let mut report = Report::read(&folder)?;
    if !args.page {
        let mut all = backends::all();
        let robust = all.len();
        all.push(naive::backend());
        let chosen = |number: &str| args.case.as_ref().is_none_or(|case| case == number);
        for case in CASES.iter().filter(|case| chosen(case.number)) {
            let began = Instant::now();
            let backends = if case.is_of_version_1() { &all[..] } else { &all[..robust] };
            let figures = case.figures(backends, size)?;
            let seconds = began.elapsed().as_secs_f64();
            eprintln!("hard case {}: {}, {seconds:.1} s", case.number, case.title);
            report.add(Run::now(case, size, seconds), figures);
        }
        report.write(&folder)?;
    }
    args.output.write("hard-cases.md", report.page(NAIVE)?)
}
