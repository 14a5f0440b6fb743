//! `rayfold-bench accuracy`: how far each way to trace is from the truth, and what it costs.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::hard_cases::{CASES, SEED, Size};
use crate::tracers;

/// What to measure.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder that receives accuracy.md
    #[arg(long, default_value = "docs/reports")]
    output: PathBuf,
    /// Take the quick sizes of the tests
    #[arg(long)]
    quick: bool,
}

/// Measures and writes the report.
///
/// # Errors
/// When a scene cannot be rendered or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    let size = if args.quick { Size::Quick } else { Size::Full };
    let report = hard_cases(size)?;
    std::fs::create_dir_all(&args.output)?;
    let path = args.output.join("accuracy.md");
    std::fs::write(&path, report).with_context(|| path.display().to_string())
}

/// The hard cases as a table.
fn hard_cases(size: Size) -> Result<String> {
    let tracers = tracers::all();
    let mut text = format!(
        "## Hard cases\n\nSeed {SEED}. A figure is the worst or the count found; the bound is that of `tests/hard_cases.rs`.\n\n\
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
