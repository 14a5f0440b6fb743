//! Fingerprints of pictures that are the same on every kind of machine, compared with the table in the repository.
//!
//! The table has a line for the first and the middle script of each example, in a small size, one for each script of
//! guided light ([`lights`]), and one for each hundred of random scripts. This machine draws them with each of its instruction sets. Other kinds of machines are emulated:
//! a small program is compiled for them ([`Machine`]), and gets the same scripts.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use rayfold_files::OutputFile;
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Limits, parse_with_files};
use rayfold_tracer::{Level, RenderOptions, probe};
use rayon::prelude::*;

use super::folders::{is_script, sorted};
use super::{lights, scripts};
use crate::backends::levels;
use crate::needs::parts;

/// The table.
const TABLE: &str = include_str!("../../fingerprints.txt");

/// The random scripts in a line of the table.
pub(super) const IN_A_LINE: u64 = 100;

/// The scripts that a process draws.
const IN_A_PROCESS: usize = 25;

/// Arguments of Cargo for a program that is built sooner.
const SOONER: [&str; 4] = [
    "--config",
    "profile.release.opt-level=0",
    "--config",
    "profile.release.package.rayfold-tracer.opt-level=1",
];

/// The size of the examples' pictures.
const SCREEN: &str = "Screen 96 72";

/// A kind of machine that is emulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Machine {
    /// 64-bit Arm, by qemu
    Aarch64,
    /// WebAssembly, by Node
    Wasm32,
    /// WebAssembly with relaxed instructions, by Node on a machine that has a fused multiply-add
    Wasm32Relaxed,
}

/// The fingerprints of pictures by the names of their scripts.
type Fingerprints = BTreeMap<String, String>;

/// Files that scripts name, and then the scripts.
struct Batch {
    files: Vec<(String, Vec<u8>)>,
    scripts: Vec<(String, String)>,
}

/// Draws the examples, guided light and the random scripts of these seeds, and compares them with the table. If the
/// seeds do not begin at 1, it draws only random scripts. A slice omits the examples and this machine, so it takes
/// little time.
///
/// # Errors
/// Fails if a picture differs, or if a script cannot be drawn.
pub(super) fn check(seeds: Range<u64>, machines: &[Machine], is_slice: bool) -> Result<()> {
    let is_first = seeds.start == 1;
    let mut batches = batches(seeds)?;
    if !is_first {
        batches.drain(..batches.len() - 1);
    }
    if is_slice {
        batches.drain(..batches.len().saturating_sub(2));
    } else {
        for (name, level) in levels() {
            compare(name, &here(&batches, level)?, &batches)?;
        }
    }
    for machine in machines {
        compare(machine.name(), &machine.draw(&batches, is_slice)?, &batches)?;
    }
    Ok(())
}

/// Rewrites the table.
///
/// # Errors
/// Fails if a script cannot be drawn, or the file cannot be written.
pub(super) fn write(scripts: u64) -> Result<()> {
    let (_, level) = *levels().first().context("this machine has no instruction set that is known")?;
    let drawn = here(&batches(1..scripts + 1)?, level)?;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fingerprints.txt");
    let mut table = String::from(
        "# Fingerprints of pictures, the same on every machine. Compared by `rayfold-bench fingerprints --check`, written by `--write`.\n",
    );
    lines(&drawn).iter().for_each(|(name, number)| table += &format!("{name} {number}\n"));
    OutputFile::write(&path, &table, true)?;
    Ok(())
}

/// Returns the lines of a table: those of examples as they are, and those of random scripts by the hundred.
fn lines(drawn: &Fingerprints) -> Fingerprints {
    let mut lines = Fingerprints::new();
    for (name, number) in drawn {
        match seed_of(name) {
            Some(seed) => {
                let first = (seed - 1) / IN_A_LINE * IN_A_LINE + 1;
                let line = lines.entry(format!("random {first:05}")).or_default();
                *line = format!("{:016x}", probe::hash(line.bytes().chain(number.bytes())));
            }
            None => drop(lines.insert(name.clone(), number.clone())),
        }
    }
    lines
}

fn random_name(seed: u64) -> String {
    format!("{seed:05}.txt")
}

fn seed_of(name: &str) -> Option<u64> {
    name.strip_suffix(".txt")?.parse().ok()
}

/// Fails with the names of pictures that differ from the table.
fn compare(machine: &str, drawn: &Fingerprints, batches: &[Batch]) -> Result<()> {
    let table: BTreeMap<_, _> = TABLE
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.rsplit_once(' '))
        .collect();
    let lines = lines(drawn);
    let mut differing = Vec::new();
    for (name, number) in &lines {
        let kept = table.get(&name[..]).with_context(|| format!("the table has no {name}"))?;
        if kept != number {
            differing.push(name.clone());
        }
    }
    eprintln!("{machine}: {} scripts, {} of {} lines differ", drawn.len(), differing.len(), lines.len());
    if differing.is_empty() {
        return Ok(());
    }
    // The table says which hundred; this machine's widest kernels say which scripts, unless they differ themselves.
    let (_, level) = *levels().first().context("this machine has no instruction set that is known")?;
    let own = here(batches, level)?;
    let scripts: Vec<_> = own
        .iter()
        .filter(|(name, number)| drawn.get(*name) != Some(*number))
        .map(|(name, _)| &name[..])
        .collect();
    let scripts = if scripts.is_empty() { "none against this machine".into() } else { scripts.join(", ") };
    anyhow::bail!(
        "{machine} draws other pictures than the table has: {}; scripts: {scripts}",
        differing.join(", ")
    )
}

/// Draws on this machine with an instruction set.
fn here(batches: &[Batch], level: Level) -> Result<Fingerprints> {
    let of_batch = |batch: &Batch| -> Result<Vec<(String, String)>> {
        let mut files = MemoryFiles::default();
        batch.files.iter().for_each(|(name, bytes)| files.insert(name, bytes.clone()));
        let library = Library::new(files);
        let options = RenderOptions { level: Some(level), ..Default::default() };
        let fingerprint = |(name, text): &(String, String)| {
            let parsed = parse_with_files(name, text.as_bytes(), &Limits::default(), &library);
            let script = parsed.script.with_context(|| format!("{name}: {:?}", parsed.diagnostics))?;
            let number = probe::fingerprint(&script, &options).with_context(|| name.clone())?;
            Ok((name.clone(), format!("{number:016x}")))
        };
        batch.scripts.par_iter().map(fingerprint).collect()
    };
    let drawn: Vec<_> = batches.par_iter().map(of_batch).collect::<Result<_>>()?;
    Ok(drawn.into_iter().flatten().collect())
}

/// Returns the examples, a batch a folder, then guided light, and the random scripts.
fn batches(seeds: Range<u64>) -> Result<Vec<Batch>> {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut batches: Vec<Batch> = Vec::new();
    for folder in sorted(&scenes)?.into_iter().filter(|path| path.is_dir()) {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (scripts, files): (Vec<_>, Vec<_>) =
            sorted(&folder)?.into_iter().partition(|path| is_script(path));
        let named = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let files =
            files.iter().map(|path| Ok((named(path), std::fs::read(path)?))).collect::<Result<_>>()?;
        let mut chosen: Vec<_> = scripts.first().into_iter().chain(scripts.get(scripts.len() / 2)).collect();
        chosen.dedup();
        let small = |path: &PathBuf| {
            Ok((format!("{name}/{}", named(path)), in_small(&std::fs::read_to_string(path)?)))
        };
        batches.push(Batch { files, scripts: chosen.into_iter().map(small).collect::<Result<_>>()? });
    }
    let files = scripts::FILES.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())).to_vec();
    let named = |(name, text): (&str, &str)| (format!("light {name}.txt"), text.to_owned());
    let of_light = [&files[..], &[(lights::SKY.to_owned(), lights::sky())]].concat();
    batches.push(Batch { files: of_light, scripts: lights::SCRIPTS.map(named).to_vec() });
    let scripts = seeds.map(|seed| (random_name(seed), scripts::script(seed))).collect();
    batches.push(Batch { files, scripts });
    Ok(batches)
}

/// Returns a script with small pictures.
pub(crate) fn in_small(text: &str) -> String {
    let small =
        |line: &str| if line.trim_start().starts_with("Screen ") { SCREEN.into() } else { line.to_owned() };
    text.lines().map(small).collect::<Vec<_>>().join("\n") + "\n"
}

impl Machine {
    const fn name(self) -> &'static str {
        match self {
            Self::Aarch64 => "aarch64",
            Self::Wasm32 => "wasm32",
            Self::Wasm32Relaxed => "wasm32-relaxed",
        }
    }

    /// Returns the target of the compiler, and its flags. WebAssembly begins with a gibibyte of memory, because Node 20
    /// crashed when the memory grew during drawing.
    const fn target(self) -> (&'static str, &'static str) {
        match self {
            Self::Aarch64 => ("aarch64-unknown-linux-gnu", ""),
            Self::Wasm32 => {
                ("wasm32-wasip1", "-Ctarget-feature=+simd128 -Clink-arg=--initial-memory=1073741824")
            }
            Self::Wasm32Relaxed => (
                "wasm32-wasip1",
                "-Ctarget-feature=+simd128,+relaxed-simd -Clink-arg=--initial-memory=1073741824",
            ),
        }
    }

    /// Builds the program that draws, and runs it emulated: a process for a few scripts, and several at once.
    fn draw(self, batches: &[Batch], is_slice: bool) -> Result<Fingerprints> {
        let program = self.build(is_slice)?;
        let runs: Vec<_> = batches
            .iter()
            .flat_map(|batch| batch.scripts.chunks(IN_A_PROCESS).map(|scripts| (&batch.files, scripts)))
            .collect();
        let drawn: Vec<_> = runs
            .par_iter()
            .map(|(files, scripts)| self.run(&program, files, scripts))
            .collect::<Result<_>>()?;
        Ok(drawn.into_iter().flatten().collect())
    }

    /// Runs the program with some files and scripts.
    fn run(
        self,
        program: &Path,
        files: &[(String, Vec<u8>)],
        scripts: &[(String, String)],
    ) -> Result<Vec<(String, String)>> {
        let mut run = match self {
            Self::Aarch64 => {
                let mut run = Command::new("qemu-aarch64");
                run.args(["-L", "/usr/aarch64-linux-gnu"]);
                run
            }
            Self::Wasm32 | Self::Wasm32Relaxed => {
                let mut run = Command::new("node");
                // With threads that compile, version 20 crashes at its end after some scripts.
                run.args(["--no-warnings", "--single-threaded", "--input-type=module", "--eval", WASI]);
                run
            }
        };
        let mut child = run
            .arg(program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("{}: {:?} cannot be run", self.name(), run.get_program()))?;
        let mut input = Vec::new();
        for (name, bytes) in files {
            writeln!(input, "{name} {}", bytes.len())?;
            input.extend_from_slice(bytes);
        }
        for (name, text) in scripts {
            write!(input, "{name} {}\n{text}", text.len())?;
        }
        let mut stdin = child.stdin.take().context("standard input")?;
        let writer = std::thread::spawn(move || stdin.write_all(&input));
        let output = child.wait_with_output()?;
        // Writing fails if the program has ended before it has read everything, as the count below shows.
        let _ = writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        let text = String::from_utf8(output.stdout)?;
        let lines = text.lines().filter_map(|line| line.rsplit_once(' '));
        let drawn: Vec<_> = lines.map(|(name, number)| (name.to_owned(), number.to_owned())).collect();
        // A program that crashes when everything has been printed has drawn.
        ensure!(
            drawn.len() == scripts.len(),
            "{}: {} of {} scripts are drawn, {}",
            self.name(),
            drawn.len(),
            scripts.len(),
            output.status
        );
        Ok(drawn)
    }

    /// Builds the program. With less optimisation it draws the same pictures and is built sooner.
    fn build(self, is_slice: bool) -> Result<PathBuf> {
        let (target, flags) = self.target();
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target").join(self.name());
        eprintln!("{}: building the tracer", self.name());
        let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
        let with: Vec<_> = parts().map(|(part, _)| part).collect();
        let status = Command::new(cargo)
            .args([
                "build",
                "--quiet",
                "--locked",
                "--release",
                "--package",
                "rayfold-tracer",
                "--example",
                "fingerprints",
            ])
            .args([
                "--no-default-features",
                "--features",
                &with.join(","),
                "--target",
                target,
                "--target-dir",
            ])
            .arg(&folder)
            .args(if is_slice { &SOONER[..] } else { &[] })
            .env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", "aarch64-linux-gnu-gcc")
            .env("RUSTFLAGS", flags)
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
            .status()
            .context("cargo")?;
        ensure!(status.success(), "{}: cargo build: {status}", self.name());
        let file = if self == Self::Aarch64 { "fingerprints" } else { "fingerprints.wasm" };
        Ok(folder.join(target).join("release/examples").join(file))
    }
}

/// Runs a program of WebAssembly in Node. Version 20 has relaxed instructions only if a flag asks for them.
const WASI: &str = "
import { readFileSync } from 'node:fs';
import { setFlagsFromString } from 'node:v8';
import { WASI } from 'node:wasi';
setFlagsFromString('--experimental-wasm-relaxed-simd');
const wasi = new WASI({ version: 'preview1', returnOnExit: true });
const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[1]), wasi.getImportObject());
process.exitCode = wasi.start(instance);
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_instruction_set_draws_the_pictures_of_the_table() {
        check(1..IN_A_LINE + 1, &[], false).unwrap();
    }
}
