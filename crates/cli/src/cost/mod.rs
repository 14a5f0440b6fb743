//! `rayfold cost`: what an animation costs on AWS, before it is made.
//!
//! Asks nobody: the prices are a data file, the rest is arithmetic.

mod estimate;
mod prices;

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Context;
use clap::ValueEnum;
use rayfold_scene::Screen;
use serde::Serialize;

use crate::console::{Console, Format};
use crate::outcome::Outcome;
use crate::render::parse_size;
use estimate::{Section, Workload, estimate};
use prices::{BUILT_IN, Prices};

/// Bytes of a frame's PNG, a pixel: about twice what `scenes/hello` gives.
const FRAME_BYTES_A_PIXEL: f64 = 0.15;

/// Bytes of the GIF, a pixel of a frame: about twice what `scenes/hello` gives.
const GIF_BYTES_A_PIXEL: f64 = 0.06;

/// Time that the assemble function takes for a pixel: reading the frame, decoding, quantising, encoding. Measured: 30 to
/// 50 ns of a processor (`docs/decisions/gif-in-one-piece.md`).
const ASSEMBLE_NS_A_PIXEL: f64 = 60.0;

/// Estimate what an animation costs on AWS
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold cost --frames 50 --ms 180                             50 frames of 512x512
  rayfold cost --frames 1000 --ms 1500 --size 1920x1080
  rayfold cost --frames 1000 --ms 750 --memory 3538 --architecture arm64

Free allowances are left out. What it counts, and how: docs/cost.md.")]
pub(crate) struct Args {
    /// How many frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// Milliseconds that the render function takes for one, as its log says, with this --memory
    #[arg(long, value_name = "MS", value_parser = positive)]
    ms: f64,
    /// The frames' size in pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = parse_size)]
    size: Screen,
    /// Memory of the render function, in MB
    #[arg(long, value_name = "MB", default_value = "1769", value_parser = positive)]
    memory: f64,
    /// Memory of the assemble function, in MB
    #[arg(long, value_name = "MB", default_value = "3008", value_parser = positive)]
    assemble_memory: f64,
    /// What the functions run on
    #[arg(long, value_enum, default_value_t)]
    architecture: Architecture,
    /// Milliseconds that the assemble function takes for a frame, if you know better than from the size
    #[arg(long, value_name = "MS", value_parser = positive)]
    assemble_ms: Option<f64>,
    /// Size of a frame's PNG in kB, if you know better
    #[arg(long, value_name = "KB", value_parser = positive)]
    frame_kb: Option<f64>,
    /// Size of the GIF in MB, if you know better
    #[arg(long, value_name = "MB", value_parser = positive)]
    gif_mb: Option<f64>,
    /// Minutes between two sweeps
    #[arg(long, value_name = "MIN", default_value = "15", value_parser = positive)]
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
    workload: &'a Workload,
    sections: &'a [Section],
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let prices = read(args.prices.as_ref())?;
    let work = workload(args);
    let sections = estimate(&work, &prices);
    match args.format {
        Format::Text => console.print(table(&work, &prices, &sections))?,
        Format::Json => {
            let report = Report {
                as_of: &prices.as_of,
                region: &prices.region,
                currency: &prices.currency,
                sources: &prices.sources,
                workload: &work,
                sections: &sections,
            };
            console.print(serde_json::to_string_pretty(&report)? + "\n")?;
        }
    }
    Ok(Outcome::Done)
}

fn read(file: Option<&PathBuf>) -> anyhow::Result<Prices> {
    let Some(path) = file else { return Ok(serde_json::from_str(BUILT_IN)?) };
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} holds no prices", path.display()))
}

fn workload(args: &Args) -> Workload {
    let pixels = args.size.pixels() as f64;
    Workload {
        frames: args.frames,
        ms: args.ms,
        width: args.size.width() as usize,
        height: args.size.height() as usize,
        memory_mb: args.memory,
        assemble_memory_mb: args.assemble_memory,
        arm64: args.architecture == Architecture::Arm64,
        assemble_ms: args.assemble_ms.unwrap_or(pixels * ASSEMBLE_NS_A_PIXEL / 1e6),
        frame_kb: args.frame_kb.unwrap_or(pixels * FRAME_BYTES_A_PIXEL / 1e3),
        gif_mb: args.gif_mb.unwrap_or(args.frames as f64 * pixels * GIF_BYTES_A_PIXEL / 1e6),
        sweep_minutes: args.sweep_minutes,
        customer_managed_key: args.customer_managed_key,
    }
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
    for section in sections {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\n{}", section.title);
        for line in &section.lines {
            let amount = format!("{} {}", amount(line.amount), line.unit);
            let _ = writeln!(text, "  {:<28} {:>16} {:>12.4}", line.item, amount.trim_end(), line.usd);
        }
        let _ = writeln!(text, "  {:<28} {:>16} {:>12.4}", "Together", "", section.usd);
    }
    text
}

/// With thousands separated; small ones with as many places as tell something.
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

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number greater than 0".to_owned()),
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

    #[test]
    fn the_prices_that_come_with_the_program_are_whole() {
        let prices = read(None).unwrap();
        assert_eq!(prices.region, "us-east-1");
        assert!(prices.sources.iter().all(|page| page.starts_with("https://aws.amazon.com/")));
    }
}
