//! The program for measurements: one subcommand per report.

use clap::{Parser, Subcommand};
use rayfold_bench::{
    accuracy, coincident, fingerprints, gif, growth, measure, metamorphic, models, needs, outlines, parsing,
    paths, sampling, speed, studio,
};
#[cfg(feature = "bucket")]
use rayfold_bench::{cold_start, explore, footprint, laptop, packages, pipeline, scale, simulate};

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
    /// Random pairs of solids that share a surface: checks that the first in the script is visible
    Coincident(coincident::Args),
    /// The paper's table: scenes from upload to GIF, in a local store and with the local invoker
    #[cfg(feature = "bucket")]
    Pipeline(pipeline::Args),
    /// Small animations on few places, by the real programs: seconds and requests
    #[cfg(feature = "bucket")]
    Laptop(laptop::Args),
    /// Size of the functions, and the time until a new process requests its first invocation
    #[cfg(feature = "bucket")]
    ColdStart(cold_start::Args),
    /// The packages for Lambda, run by the local invoker: they make the GIF that this machine's functions make
    #[cfg(feature = "bucket")]
    Packages(packages::Args),
    /// Indirect light: means of blocks of pixels, compared with independent paths of the oracle
    Paths(paths::Args),
    /// Time and memory to read and write the largest scripts
    Parsing(parsing::Args),
    /// The pipeline's protocol in a simulated world: many seeds, broken rules, requests at scale
    #[cfg(feature = "bucket")]
    Simulate(simulate::Args),
    /// The pipeline's protocol in small worlds: every interleaving, and provoking schedules
    #[cfg(feature = "bucket")]
    Explore(explore::Args),
    /// Time, memory, size and quality of GIFs, compared with other encoders
    Gif(gif::Args),
    /// Memory and processor time of the shipped functions, by the size of an animation
    #[cfg(feature = "bucket")]
    Footprint(footprint::Args),
    /// A line for each of many pictures, to compare the program before and after a change
    Fingerprints(fingerprints::Args),
    /// Processor time by number of objects, in scenes where a tree helps least
    Growth(growth::Args),
    /// Run a program and print its time and memory
    #[command(hide = true)]
    Measure(measure::Args),
    /// Random scenes compared with variants that must look the same: scaled, rotated, reordered, split, grouped
    Metamorphic(metamorphic::Args),
    /// Models of many triangles: time to load and to draw them
    Models(models::Args),
    /// Instructions that scenes execute for unused parts of the tracer (needs valgrind)
    Needs(needs::Args),
    /// Dots at the outlines of triangle meshes, and wrong pixels at needles and planes seen edge-on
    Outlines(outlines::Args),
    /// Animations of 10 to 100,000 frames, and many at once, in a simulated world with the limits of AWS
    #[cfg(feature = "bucket")]
    Scale(scale::Args),
    /// Error by time of pictures with several samples per pixel
    Sampling(sampling::Args),
    /// The cost of a ray by shape, compared with POV-Ray and Mitsuba if they are installed
    Shapes(speed::shapes::Args),
    /// Processor time by the amount of work, compared with POV-Ray and Embree if they are installed
    Speed(speed::Args),
    /// The studio's page in Chromium: pictures per second, and latency from the pointer to the canvas
    Studio(studio::Args),
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().measurement {
        Measurement::Accuracy(args) => accuracy::run(&args),
        Measurement::Coincident(args) => coincident::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Pipeline(args) => pipeline::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Laptop(args) => laptop::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::ColdStart(args) => cold_start::run(&args),
        #[cfg(feature = "bucket")]
        Measurement::Packages(args) => packages::run(&args),
        Measurement::Paths(args) => paths::run(&args),
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
        Measurement::Models(args) => models::run(&args),
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
