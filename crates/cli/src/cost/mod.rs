//! `rayfold cost`: what an animation costs on AWS, before it is made.
//!
//! Sends no requests: the prices are a data file, the rest is arithmetic, and drawing times are measured on this
//! machine.

mod measure;

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Context;
use clap::ValueEnum;
use rayfold_client::cost::{Prices, Section, Workload, estimate};
use rayfold_pipeline::assemble::MAX_PIECES;
use rayfold_scene::Screen;
use serde::Serialize;

use crate::console::{Console, Format};
use crate::interrupt;
use crate::outcome::Outcome;
use crate::values;
use measure::measure;

/// The maximum time of an assembly in seconds: invocations of the assemble function, of 15 minutes each.
const MAX_ASSEMBLING_S: f64 = MAX_PIECES as f64 * 900.0;

/// The least amount that is shown, in units of 0.0001 US dollars; smaller ones are summed up.
const LEAST_SHOWN: f64 = 0.000_05;

/// Estimate what an animation costs on AWS
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold cost scenes/hello
      draws some frames to see how long that takes
  rayfold cost --frames 50 --ms 180
      50 frames of 512x512
  rayfold cost --frames 1000 --ms 1500 --size 1920x1080
  rayfold cost --frames 1000 --ms 750 --memory 3538 --architecture arm64

Free allowances are left out. What it counts, and how: docs/cost.md.")]
pub(crate) struct Args {
    /// A folder, or script files, of which some frames are drawn to measure what a frame takes
    #[arg(required_unless_present = "frames")]
    input: Vec<PathBuf>,
    /// How many frames
    #[arg(long, value_name = "N", value_parser = values::count::<u64>, allow_negative_numbers = true, conflicts_with = "input", requires = "ms")]
    frames: Option<u64>,
    /// Milliseconds that the render function takes for one, as its log says, with this --memory [default: measured]
    #[arg(long, value_name = "MS", value_parser = positive, allow_negative_numbers = true)]
    ms: Option<f64>,
    /// The frames' size in pixels [default: 512x512, or that of the scripts]
    #[arg(long, value_name = "WxH", value_parser = values::size, allow_negative_numbers = true, conflicts_with = "input")]
    size: Option<Screen>,
    /// Number of invocations of the render function that run at once [default: 1000, the limit of most accounts]
    #[arg(long, value_name = "N", value_parser = values::count::<u64>)]
    places: Option<u64>,
    /// Memory of the render function, in MB
    #[arg(long, value_name = "MB", default_value = "1769", value_parser = positive, allow_negative_numbers = true)]
    memory: f64,
    /// Memory of the assemble function, in MB
    #[arg(long, value_name = "MB", default_value = "3008", value_parser = positive, allow_negative_numbers = true)]
    assemble_memory: f64,
    /// What the functions run on
    #[arg(long, value_enum, default_value_t)]
    architecture: Architecture,
    /// Milliseconds that the assemble function takes for a frame, if you know better than from the size
    #[arg(long, value_name = "MS", value_parser = positive, allow_negative_numbers = true)]
    assemble_ms: Option<f64>,
    /// Size of a frame's PNG in kB, if you know better than what is measured, or from the size
    #[arg(long, value_name = "KB", value_parser = positive, allow_negative_numbers = true)]
    frame_kb: Option<f64>,
    /// Size of the GIF in MB, if you know better
    #[arg(long, value_name = "MB", value_parser = positive, allow_negative_numbers = true)]
    gif_mb: Option<f64>,
    /// Minutes between two sweeps
    #[arg(long, value_name = "MIN", default_value = "15", value_parser = positive, allow_negative_numbers = true)]
    sweep_minutes: f64,
    /// With a key of the stack's own
    #[arg(long)]
    customer_managed_key: bool,
    /// Other prices than those that come with the program: a file like infra/prices.json
    #[arg(long, value_name = "FILE")]
    prices: Option<PathBuf>,
    /// How to show the estimate
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Architecture {
    #[default]
    #[value(name = "x86_64")]
    X86_64,
    Arm64,
}

#[derive(Serialize)]
struct Report<'a> {
    as_of: &'a str,
    region: &'a str,
    currency: &'a str,
    sources: &'a [String],
    /// The total while the animation is made, and in the first month.
    first_month_usd: f64,
    /// The total in each later month.
    later_month_usd: f64,
    workload: &'a Workload,
    sections: &'a [Section],
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let prices = read(args.prices.as_ref())?;
    let work = workload(args, console)?;
    let sections = estimate(&work, &prices);
    let assembling_s = work.assembling_s();
    if assembling_s > MAX_ASSEMBLING_S {
        console.warn(format_args!(
            "assembling takes about {} s, and what takes more than {} s is refused: expected \
             fewer or smaller frames; or fetch the frames, and assemble them by rayfold encode",
            amount(assembling_s),
            amount(MAX_ASSEMBLING_S)
        ));
    }
    match args.format {
        Format::Text => console.print(table(&work, &prices, &sections))?,
        Format::Json => {
            let report = Report {
                as_of: &prices.as_of,
                region: &prices.region,
                currency: &prices.currency,
                sources: &prices.sources,
                first_month_usd: sections.iter().map(|section| section.usd).sum(),
                later_month_usd: later_month(&sections),
                workload: &work,
                sections: &sections,
            };
            console.print(serde_json::to_string_pretty(&report)? + "\n")?;
        }
    }
    Ok(Outcome::Done)
}

fn read(file: Option<&PathBuf>) -> anyhow::Result<Prices> {
    let Some(path) = file else { return Ok(Prices::built_in()?) };
    let place = path.clone();
    let text = interrupt::wait_for(move || std::fs::read_to_string(place))?;
    let text = text.with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} holds no prices", path.display()))
}

fn workload(args: &Args, console: &Console) -> anyhow::Result<Workload> {
    let measured = match args.frames {
        Some(_) => None,
        None => Some(measure(&args.input, args.memory, args.places, console)?),
    };
    let measured = measured.as_ref();
    let frames = measured.map(|measured| measured.frames).or(args.frames).context("how many frames?")?;
    let ms = args.ms.or(measured.map(|measured| measured.ms)).context("how long does a frame take?")?;
    let size = match measured.map(|measured| measured.size).or(args.size) {
        Some(size) => size,
        None => Screen::new(512, 512)?,
    };
    let guessed = Workload::new(frames, size, ms);
    Ok(Workload {
        places: args.places,
        memory_mb: args.memory,
        assemble_memory_mb: args.assemble_memory,
        arm64: args.architecture == Architecture::Arm64,
        assemble_ms: args.assemble_ms.unwrap_or(guessed.assemble_ms),
        frame_kb: args.frame_kb.or(measured.map(|measured| measured.frame_kb)).unwrap_or(guessed.frame_kb),
        gif_mb: args.gif_mb.unwrap_or(guessed.gif_mb),
        outputs: measured.map_or(guessed.outputs, |measured| measured.outputs.clone()),
        files: measured.map_or(0, |measured| measured.files),
        files_mb: measured.map_or(0.0, |measured| measured.files_mb),
        sweep_minutes: args.sweep_minutes,
        customer_managed_key: args.customer_managed_key,
        ..guessed
    })
}

/// Returns the sum without the costs that are paid once, which are the first section.
fn later_month(sections: &[Section]) -> f64 {
    sections.iter().skip(1).map(|section| section.usd).sum()
}

/// The estimate for people.
fn table(work: &Workload, prices: &Prices, sections: &[Section]) -> String {
    let mut text = format!(
        "{} of {}x{}, {} ms each with {} MB on {}\nPrices of {} on {}, in {}, free allowances left out\n",
        if work.frames == 1 {
            "1 frame".to_owned()
        } else {
            format!("{} frames", amount(work.frames as f64))
        },
        work.width,
        work.height,
        amount(work.ms),
        amount(work.memory_mb),
        if work.arm64 { "arm64" } else { "x86_64" },
        prices.region,
        prices.as_of,
        prices.currency,
    );
    if let Some(places) = work.places {
        let (rendering, assembling) =
            (amount(work.rendering_s()), amount(work.outputs.len() as f64 * work.assembling_s()));
        let at_once =
            if places == 1 { "1 place".to_owned() } else { format!("{} places", amount(places as f64)) };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "On {at_once}: drawn in {rendering} s, assembled in {assembling} s");
    }
    for section in sections {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\n{}", section.title);
        let mut row = |item: &str, amount: &str, usd: f64| {
            let _ = writeln!(text, "  {item:<28} {amount:>16} {usd:>12.4}");
        };
        let (shown, rest): (Vec<_>, Vec<_>) = section.lines.iter().partition(|line| line.usd >= LEAST_SHOWN);
        for line in shown {
            row(line.item, format!("{} {}", amount(line.amount), line.unit).trim_end(), line.usd);
        }
        let rest: f64 = rest.iter().map(|line| line.usd).sum();
        if rest >= LEAST_SHOWN {
            row("What costs less than 0.0001", "", rest);
        }
        row("Together", "", section.usd);
    }
    let all: f64 = sections.iter().map(|section| section.usd).sum();
    let later = later_month(sections);
    let _ = writeln!(text, "\nTotal\n  {:<45} {all:>12.4}", "The first month");
    let _ = writeln!(text, "  {:<45} {later:>12.4}", "Each month after");
    text
}

/// Formats an amount with thousands separators; small amounts get as many decimal places as are significant.
fn amount(value: f64) -> String {
    if value < 100.0 && value.fract() != 0.0 {
        return format!("{value:.3}");
    }
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number above 0.
///
/// # Errors
/// The form that was expected.
fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number greater than 0".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_read_easily() {
        let cases = [(0.0075, "0.007"), (12.5, "12.500"), (7.0, "7"), (100.4, "100"), (1234.0, "1,234")];
        for (value, text) in cases {
            assert_eq!(amount(value), text);
        }
        assert_eq!(amount(1_234_567.0), "1,234,567");
        assert_eq!(amount(123_456.0), "123,456");
    }
}
