//! `rayfold-bench parsing`: time and memory to read and write the largest scripts, valid and invalid ones.

use std::fmt::Write as _;

use anyhow::{Context, Result, ensure};
use rayfold_scene::{Limits, Parsed, parse};

use crate::cpu_time;
use crate::report_folder::ReportFolder;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Use scripts of this many MiB
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=256))]
    mebibytes: u32,
    /// Read each script this often; the median counts
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
}

/// A kind of script: its description and one of its lines.
struct Kind {
    about: &'static str,
    line: fn(&mut fastrand::Rng) -> String,
}

const KINDS: [Kind; 6] = [
    Kind { about: "triangles, numbers with all their digits", line: |rng| triangle(rng, 17) },
    Kind { about: "triangles, numbers with four decimals", line: |rng| triangle(rng, 4) },
    Kind { about: "nothing but `Trace`", line: |_| "Trace".into() },
    Kind { about: "every triangle has no area", line: |_| format!("Triangle{}", " 0".repeat(15)) },
    Kind { about: "every command is misspelt", line: |_| "Sphree 1 0 0 0 1 1 1 0 0 0".into() },
    Kind { about: "no parameter is a number", line: |_| format!("Triangle{}", " x".repeat(15)) },
];

fn triangle(rng: &mut fastrand::Rng, decimals: usize) -> String {
    (0..15).fold("Triangle".to_string(), |mut line, _| {
        let _ = write!(line, " {:.decimals$}", 200.0 * rng.f64() - 100.0);
        line
    })
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if the clock cannot be read or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    let mut report = format!(
        "# Parsing\n\n\
         Written by `cargo run --release -p rayfold-bench -- parsing`; all figures are from one run. Times are \
         processor times in seconds on one thread, medians of {} rounds. Every script has {} MiB, the default limit. \
         *Show* is the time to format all diagnostics that are described. At most {} errors and as many warnings are \
         described; the others are only counted. *Write* is the time to convert the script to text.\n\n\
         | script | lines | parse | MiB/s | errors and warnings described | show | write |\n\
         | --- | --: | --: | --: | --: | --: | --: |\n",
        args.rounds,
        args.mebibytes,
        Limits::DESCRIBED,
    );
    for kind in &KINDS {
        eprintln!("{}", kind.about);
        report += &row(kind, args)?;
    }
    args.output.write("parsing.md", report)
}

fn row(kind: &Kind, args: &Args) -> Result<String> {
    let text = script(kind, (args.mebibytes as usize) << 20);
    let mut seconds = Vec::new();
    let mut parsed = None;
    for _ in 0..args.rounds {
        drop(parsed.take());
        let (time, result) = cpu_time::of(|| parse("measured.txt", text.as_bytes(), &Limits::default()))?;
        seconds.push(time);
        parsed = Some(result);
    }
    let Parsed { script, diagnostics, .. } = parsed.context("at least one round")?;
    let parse_seconds = cpu_time::median(seconds);
    let (show, shown) = cpu_time::of(|| diagnostics.iter().map(|d| d.render(true).len()).sum::<usize>())?;
    ensure!((shown == 0) == diagnostics.is_empty(), "a diagnostic that shows nothing");
    let write = match script {
        Some(script) => format!("{:.2}", cpu_time::of(|| script.to_string())?.0),
        None => "–".to_string(),
    };
    Ok(format!(
        "| {} | {} | {parse_seconds:.2} | {:.0} | {} | {show:.2} | {write} |\n",
        kind.about,
        text.lines().count(),
        f64::from(args.mebibytes) / parse_seconds,
        diagnostics.len(),
    ))
}

/// Returns a script of at most `size` bytes, with as many lines as fit.
fn script(kind: &Kind, size: usize) -> String {
    let mut rng = fastrand::Rng::with_seed(1);
    let mut text = String::with_capacity(size);
    text.push_str("Screen 640 480\n");
    loop {
        let line = (kind.line)(&mut rng);
        if text.len() + line.len() + "\nTrace\n".len() > size {
            text.push_str("Trace\n");
            return text;
        }
        text.push_str(&line);
        text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_are_what_they_are_called() {
        let errors: Vec<_> = KINDS
            .iter()
            .map(|kind| {
                let text = script(kind, 10_000);
                assert!((9_500..=10_000).contains(&text.len()), "{}: {}", kind.about, text.len());
                parse("small.txt", text.as_bytes(), &Limits::default()).script.is_none()
            })
            .collect();
        assert_eq!(errors, [false, false, false, false, true, true]);
    }
}
