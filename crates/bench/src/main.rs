//! The program that measures: a subcommand a report.

use clap::{Parser, Subcommand};
use rayfold_bench::{accuracy, simulate};

#[derive(Debug, Parser)]
#[command(name = "rayfold-bench", about = "Measures rayfold and writes the reports in docs/reports")]
struct Cli {
    #[command(subcommand)]
    measurement: Measurement,
}

#[derive(Debug, Subcommand)]
enum Measurement {
    /// Error and speed of every way to trace, and the hard cases at full size
    Accuracy(accuracy::Args),
    /// The pipeline's protocol in a simulated world: seeds, broken rules, requests at scale
    Simulate(simulate::Args),
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().measurement {
        Measurement::Accuracy(args) => accuracy::run(&args),
        Measurement::Simulate(args) => simulate::run(&args),
    }
}
