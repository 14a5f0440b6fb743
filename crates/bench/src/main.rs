//! The program that measures: a subcommand a report.

use clap::{Parser, Subcommand};
use rayfold_bench::{
    accuracy, coincident, fingerprints, gif, growth, measure, metamorphic, needs, outlines, parsing,
    sampling, speed, studio,
};
#[cfg(feature = "bucket")]
use rayfold_bench::{cold_start, explore, footprint, pipeline, scale, simulate};

#[derive(Debug, Parser)]
#[command(name = "rayfold-bench", about = "Measures rayfold and writes the reports in docs/reports")]
struct Cli {
    #[command(subcommand)]
    measurement: Measurement,
}

#[derive(Debug, Subcommand)]
enum Measurement {
    /// Error and speed of every backend, and the hard cases at full size
    Accuracy(accuracy::Args),
    /// Random pairs of solids that share a surface: the first in the script is seen
    Coincident(coincident::Args),
    /// The paper's table: scenes from upload to GIF, in a local bucket and by the local invoker
    #[cfg(feature = "bucket")]
    Pipeline(pipeline::Args),
    /// Size of the functions, and how soon a new process asks for its first invocation
    #[cfg(feature = "bucket")]
    ColdStart(cold_start::Args),
    /// What it takes to read and write the largest scripts
    Parsing(parsing::Args),
    /// The pipeline's protocol in a simulated world: seeds, broken rules, requests at scale
    #[cfg(feature = "bucket")]
    Simulate(simulate::Args),
    /// The pipeline's protocol in small worlds: every interleaving, and schedules that provoke
    #[cfg(feature = "bucket")]
    Explore(explore::Args),
    /// Time, memory, size and quality of GIFs, beside those of other encoders
    Gif(gif::Args),
    /// Memory and processor time of the functions that ship, by the size of an animation
    #[cfg(feature = "bucket")]
    Footprint(footprint::Args),
    /// A line for each of many pictures, by which the program before a change is compared with the one after
    Fingerprints(fingerprints::Args),
    /// Processor time against the number of objects where a tree helps least
    Growth(growth::Args),
    /// Run a program and print what it took
    #[command(hide = true)]
    Measure(measure::Args),
    /// Random scenes against what must show the same: scaled, turned, in another order, taken apart, as groups
    Metamorphic(metamorphic::Args),
    /// Instructions that scenes execute for parts of the tracer that they do not use (needs valgrind)
    Needs(needs::Args),
    /// Dots at the outlines of bodies of triangles, and pixels off at needles and planes seen from the side
    Outlines(outlines::Args),
    /// Animations of 10 to 100,000 frames, and many at once, in a simulated world with the limits of AWS
    #[cfg(feature = "bucket")]
    Scale(scale::Args),
    /// Error against time of pictures of several samples a pixel
    Sampling(sampling::Args),
    /// What a ray costs, shape by shape, beside POV-Ray and Mitsuba where they are
    Shapes(speed::shapes::Args),
    /// Processor time against the work asked for, and beside POV-Ray and Embree where they are
    Speed(speed::Args),
    /// The studio's page in Chromium: pictures a second, and from the pointer to the canvas
    Studio(studio::Args),
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().measurement {
        Measurement::Accuracy(args) => accuracy::run(&args),
        Measurement::Coincident(args) => coincident::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Pipeline(args) => pipeline::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::ColdStart(args) => cold_start::run(&args),
        Measurement::Parsing(args) => parsing::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Simulate(args) => simulate::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Explore(args) => explore::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Footprint(args) => footprint::run(&args),
        Measurement::Gif(args) => gif::run(&args),
        Measurement::Fingerprints(args) => fingerprints::run(&args),
        Measurement::Growth(args) => growth::run(&args),
        Measurement::Measure(args) => measure::run(&args),
        Measurement::Metamorphic(args) => metamorphic::run(&args),
        Measurement::Needs(args) => needs::run(&args),
        Measurement::Outlines(args) => outlines::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Scale(args) => scale::run(&args),
        Measurement::Sampling(args) => sampling::run(&args),
        Measurement::Shapes(args) => speed::shapes::run(&args),
        Measurement::Speed(args) => speed::run(&args),
        Measurement::Studio(args) => studio::run(&args),
    }
}
