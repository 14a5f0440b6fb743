//! `cargo xtask`: chores that need more than Cargo, without a shell.
//!
//! - `package` builds the zip files for Lambda, linked against the glibc of Amazon Linux 2023, and reproducible.
//! - `dist` builds the archive of a release for the machine that it runs on, also reproducible. It runs the built
//!   `rayfold` to make the completions and the manual pages.
//! - `pictures` draws the pictures of `docs/language.md` from its scripts.
//! - `site` builds the studio as a static site. `--draft` builds it sooner, with a larger module, for tests.
//! - `wheel` builds the Python package with maturin.
//!
//! `package` and `dist` use `archive` (the zip file) and `sources` (the checkout and its copy).

use clap::{Parser, Subcommand};

mod archive;
mod dist;
mod glibc;
mod manual;
mod package;
mod pictures;
mod plot;
mod site;
mod sources;
mod toolchain;
mod wheel;

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
    /// Build the archive of a release for this machine: target/dist/rayfold-VERSION-TARGET.zip
    Dist(dist::Args),
    /// Build the wheel of the Python package for this machine: target/wheels/rayfold-VERSION-cp310-abi3-PLATFORM.whl
    Wheel,
    /// Draw the pictures of docs/language.md from the scripts in it, into docs/images/language
    Pictures(pictures::Args),
    /// Build the studio as a static site: target/site, a folder for any host of files
    Site {
        /// Build one variant of the module, larger and sooner, for tests: target/site-draft
        #[arg(long)]
        draft: bool,
    },
}

fn main() -> anyhow::Result<()> {
    match Xtask::parse().chore {
        Chore::Package(args) => package::run(&args),
        Chore::Dist(args) => dist::run(&args),
        Chore::Wheel => wheel::run(),
        Chore::Pictures(args) => pictures::run(&args),
        Chore::Site { draft } => site::run(draft),
    }
}
