//! Builds the zip files for Lambda from the sources.
//!
//! Invariant: the same sources, lock file and Rust release give the same bytes, wherever the folders of the checkout,
//! of Cargo and of the user are. `--verify` builds a second time, from a copy elsewhere, and compares.

use std::fs;
use std::path::Path;

use anyhow::{Context, ensure};
use clap::ValueEnum;

use crate::archive::{self, Entry};
use crate::glibc::{AMAZON_LINUX_2023, Needs};
use crate::sources::{copy_sources, remapped, root};
use crate::toolchain::{self, Toolchain, say};

/// The package, and its binaries that are functions.
const PACKAGE: &str = "rayfold-lambda";
const FUNCTIONS: [&str; 2] = ["rayfold-render", "rayfold-assemble"];

/// The file that the `provided` runtimes start.
const BOOTSTRAP: &str = "bootstrap";

/// The largest size of a zip file. It is read at each cold start, before the program runs.
const LARGEST_ZIP_MB: f64 = 8.0;

/// The options of `cargo xtask package`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Instruction set to build for; another than this machine's needs `rustup target add`
    #[arg(long, value_enum, default_value = "x86_64")]
    architecture: Architecture,
    /// Build a second time, from a copy of the sources in another folder, and compare the files
    #[arg(long)]
    verify: bool,
}

/// An instruction set, by Lambda's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Architecture {
    #[value(name = "x86_64")]
    X86_64,
    #[value(name = "arm64")]
    Arm64,
}

impl Architecture {
    fn name(self) -> &'static str {
        match self {
            Self::X86_64 => "x86_64",
            Self::Arm64 => "arm64",
        }
    }

    /// Returns the Rust target triple.
    fn target(self) -> &'static str {
        match self {
            Self::X86_64 => "x86_64-unknown-linux-gnu",
            Self::Arm64 => "aarch64-unknown-linux-gnu",
        }
    }
}

/// Builds, checks and writes both packages.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let root = root()?;
    let toolchain = Toolchain::get()?;
    let folder = root.join("target/packages").join(args.architecture.name());
    let zips = build(&toolchain, &root, &root.join("target/packages/build"), args.architecture)?;
    if args.verify {
        verify(&toolchain, &root, args.architecture, &zips)?;
    }
    fs::create_dir_all(&folder)?;
    for (function, zip) in zips {
        let path = folder.join(format!("{function}.zip"));
        fs::write(&path, &zip).with_context(|| format!("cannot write {}", path.display()))?;
        say(&format!("{} ({:.2} MB)", path.strip_prefix(&root).unwrap_or(&path).display(), megabytes(&zip)));
    }
    Ok(())
}

/// Returns the zip file of each function, built from the checkout at `root` into `target`.
fn build(
    toolchain: &Toolchain,
    root: &Path,
    target: &Path,
    architecture: Architecture,
) -> anyhow::Result<Vec<(&'static str, Vec<u8>)>> {
    let triple = architecture.target();
    let mut command = toolchain.cargo_zigbuild()?;
    command
        .args(["--locked", "--profile", "lambda", "--package", PACKAGE, "--bins"])
        .args(["--target", &format!("{triple}.{AMAZON_LINUX_2023}")])
        .arg("--target-dir")
        .arg(target)
        .current_dir(root)
        .env("CARGO_ENCODED_RUSTFLAGS", remapped(root)?.join("\x1f"))
        .env_remove("RUSTFLAGS");
    toolchain::run(&mut command)?;
    FUNCTIONS
        .into_iter()
        .map(|function| {
            let path = target.join(triple).join("lambda").join(function);
            let program = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            let newest =
                Needs::of(&program).and_then(|needs| needs.newest()).with_context(|| function.to_owned())?;
            let zip = archive::zip(vec![Entry::program(BOOTSTRAP, program)])?;
            ensure!(
                megabytes(&zip) <= LARGEST_ZIP_MB,
                "{function} is {:.2} MB zipped, more than {LARGEST_ZIP_MB} MB",
                megabytes(&zip)
            );
            match newest {
                Some(version) => say(&format!("{function} needs glibc {version}")),
                None => say(&format!("{function} needs no glibc")),
            }
            Ok((function, zip))
        })
        .collect()
}

/// Builds the files that Git tracks in `root` again in another folder, and compares the results.
fn verify(
    toolchain: &Toolchain,
    root: &Path,
    architecture: Architecture,
    expected: &[(&str, Vec<u8>)],
) -> anyhow::Result<()> {
    let elsewhere = tempfile::tempdir()?;
    let copy = elsewhere.path().join("a folder of another name");
    copy_sources(root, &copy)?;
    let again = build(toolchain, &copy, &elsewhere.path().join("target"), architecture)?;
    for ((function, first), (_, second)) in expected.iter().zip(&again) {
        ensure!(first == second, "{function}: a build from another folder differs");
        say(&format!("{function}: a build from another folder is the same"));
    }
    Ok(())
}

fn megabytes(bytes: &[u8]) -> f64 {
    bytes.len() as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lambda_finds_one_executable_named_bootstrap() {
        let bytes = archive::zip(vec![Entry::program(BOOTSTRAP, b"program".to_vec())]).unwrap();
        let mut archive = zip::ZipArchive::new(std::io::Cursor::new(&bytes)).unwrap();
        assert_eq!(archive.len(), 1);
        let entry = archive.by_index(0).unwrap();
        assert_eq!(entry.name().unwrap(), "bootstrap");
        assert_eq!(entry.unix_mode().unwrap() & 0o777, 0o755);
    }
}
