//! Builds the archive of a release for this machine.
//!
//! It contains the programs, the completion scripts, the manual pages, the README, the changelog and the licences.
//!
//! Invariant: the same sources, lock file, Rust release and linker give the same bytes, wherever the folders are.
//! `--verify` builds a second time, from a copy elsewhere, and compares.

use std::env::consts::EXE_SUFFIX;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, ensure};

use crate::archive::{self, Entry};
use crate::sources::{copy_sources, remapped, root};
use crate::toolchain::{self, say};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The programs. The last two are run by `rayfold dev`, which exists only on Unix.
const PROGRAMS: &[&str] =
    if cfg!(unix) { &["rayfold", "rayfold-render", "rayfold-assemble"] } else { &["rayfold"] };
const TEXTS: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT"];
/// Shells, and the names that each one looks for.
const COMPLETIONS: [(&str, &str); 5] = [
    ("bash", "rayfold.bash"),
    ("elvish", "rayfold.elv"),
    ("fish", "rayfold.fish"),
    ("powershell", "_rayfold.ps1"),
    ("zsh", "_rayfold"),
];

/// The options of `cargo xtask dist`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Build a second time, from a copy of the sources in another folder, and compare the archives
    #[arg(long)]
    verify: bool,
}

/// Builds and writes the archive.
pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let root = root()?;
    let triple = host()?;
    let name = format!("rayfold-{VERSION}-{triple}");
    let folder = root.join("target/dist");
    let zip = build(&root, &folder.join("build"), &triple, &name)?;
    if args.verify {
        let elsewhere = tempfile::tempdir()?;
        let copy = elsewhere.path().join("a folder of another name");
        copy_sources(&root, &copy)?;
        let again = build(&copy, &elsewhere.path().join("target"), &triple, &name)?;
        ensure!(zip == again, "{name}: a build from another folder differs");
        say(&format!("{name}: a build from another folder is the same"));
    }
    let path = folder.join(format!("{name}.zip"));
    fs::write(&path, &zip).with_context(|| format!("cannot write {}", path.display()))?;
    say(&format!("target/dist/{name}.zip ({:.2} MB)", zip.len() as f64 / 1e6));
    Ok(())
}

/// Returns the archive of the checkout at `root`, built into `target`.
fn build(root: &Path, target: &Path, triple: &str, name: &str) -> anyhow::Result<Vec<u8>> {
    let mut flags = remapped(root)?;
    if triple.ends_with("-msvc") {
        // Otherwise the linker writes the time into the program.
        flags.push("-Clink-arg=/Brepro".to_owned());
    }
    let mut command = Command::new(env!("CARGO"));
    command.args(["build", "--locked", "--release", "--target", triple, "--target-dir"]).arg(target);
    command.args(["--package", "rayfold", "--package", "rayfold-lambda"]);
    command.args(PROGRAMS.iter().flat_map(|program| ["--bin", program]));
    command
        .current_dir(root)
        .env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"))
        .env("CARGO_PROFILE_RELEASE_STRIP", "symbols")
        .env_remove("RUSTFLAGS");
    toolchain::run(&mut command)?;

    let built = target.join(triple).join("release");
    let pages = tempfile::tempdir()?;
    write_pages(&built.join(format!("rayfold{EXE_SUFFIX}")), pages.path())?;
    Ok(archive::zip(entries(name, &built, pages.path(), root)?)?)
}

/// Makes `program` write its completion scripts and its manual pages into `folder`.
fn write_pages(program: &Path, folder: &Path) -> anyhow::Result<()> {
    let completions = folder.join("completions");
    fs::create_dir(&completions)?;
    for (shell, file) in COMPLETIONS {
        let script = Command::new(program).args(["completions", shell]).output()?;
        ensure!(script.status.success(), "completions for {shell}: {}", script.status);
        fs::write(completions.join(file), script.stdout)?;
    }
    toolchain::run(Command::new(program).args(["--quiet", "man"]).arg(folder.join("man/man1")))
}

/// Returns the files of the archive, below the folder `name`: programs from `built`, their generated files from
/// `pages`, and texts from `root`.
fn entries(name: &str, built: &Path, pages: &Path, root: &Path) -> anyhow::Result<Vec<Entry>> {
    let read = |path: &Path| fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    let mut entries = Vec::new();
    for program in PROGRAMS {
        let file = format!("{program}{EXE_SUFFIX}");
        entries.push(Entry::program(format!("{name}/{file}"), read(&built.join(&file))?));
    }
    for folder in ["completions", "man/man1"] {
        for file in fs::read_dir(pages.join(folder)).with_context(|| format!("there are no {folder}"))? {
            let file = file?;
            let file_name = file.file_name().into_string().ok().context("a name that is no text")?;
            entries.push(Entry::text(format!("{name}/{folder}/{file_name}"), read(&file.path())?));
        }
    }
    for text in TEXTS {
        entries.push(Entry::text(format!("{name}/{text}"), read(&root.join(text))?));
    }
    Ok(entries)
}

/// Returns the target triple of this machine.
fn host() -> anyhow::Result<String> {
    let version = Command::new("rustc").arg("-vV").output().context("cannot run rustc")?;
    let version = String::from_utf8(version.stdout)?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(host.context("rustc -vV names no host")?.to_owned())
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;

    /// Writes the files of a release into a new folder in the given order, all changed at `time`.
    fn release(order: &[&str], time: SystemTime) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for name in order {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, format!("the content of {name}")).unwrap();
            fs::File::options().write(true).open(&path).unwrap().set_modified(time).unwrap();
        }
        folder
    }

    fn names() -> Vec<String> {
        let programs = PROGRAMS.iter().map(|program| format!("{program}{EXE_SUFFIX}"));
        let pages = ["completions/_rayfold", "completions/rayfold.bash", "man/man1/rayfold.1"];
        programs.chain(pages.into_iter().chain(TEXTS).map(str::to_owned)).collect()
    }

    fn archive_of(folder: &Path) -> anyhow::Result<Vec<u8>> {
        Ok(archive::zip(entries("rayfold-1", folder, folder, folder)?)?)
    }

    #[test]
    fn an_archive_is_the_same_from_another_folder_at_another_time() {
        let names = names();
        let mut order: Vec<&str> = names.iter().map(String::as_str).collect();
        let first = release(&order, SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000));
        order.reverse();
        let second = release(&order, SystemTime::UNIX_EPOCH + Duration::from_secs(1_500_000_000));
        let archive = archive_of(first.path()).unwrap();
        assert_eq!(archive, archive_of(second.path()).unwrap());

        let unpacked = zip::ZipArchive::new(std::io::Cursor::new(archive)).unwrap();
        let mut expected: Vec<String> = names.iter().map(|name| format!("rayfold-1/{name}")).collect();
        expected.sort();
        let there: Vec<String> = unpacked.file_names().map(|name| name.unwrap().into_owned()).collect();
        assert_eq!(there, expected);
    }

    #[test]
    fn an_archive_without_one_of_its_files_is_refused() {
        let names = names();
        for missing in names.iter().filter(|name| !name.contains('/')) {
            let order: Vec<&str> = names.iter().filter(|name| *name != missing).map(String::as_str).collect();
            let folder = release(&order, SystemTime::UNIX_EPOCH);
            let error = archive_of(folder.path()).unwrap_err().to_string();
            assert!(error.contains(missing.as_str()), "{missing}: {error}");
        }
    }
}
