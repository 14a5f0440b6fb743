//! `cargo xtask`: what needs more than Cargo, and no shell.
//!
//! Knows how the function binaries become what Lambda runs, and nothing of what they do; and how the scripts in the page
//! of the language become its pictures.

use clap::{Parser, Subcommand};

mod archive;
mod glibc;
mod manual;
mod package;
mod pictures;
mod plot;
mod toolchain;

/// Chores of the project.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Xtask {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Debug, Subcommand)]
enum Chore {
    /// Build the zip files that Lambda runs: target/packages/ARCHITECTURE/rayfold-render.zip and rayfold-assemble.zip
    Package(package::Args),
    /// Draw the pictures of docs/language.md from the scripts in it, into docs/images/language
    Pictures(pictures::Args),
}

fn main() -> anyhow::Result<()> {
    match Xtask::parse().chore {
        Chore::Package(args) => package::run(&args),
        Chore::Pictures(args) => pictures::run(&args),
    }
}
