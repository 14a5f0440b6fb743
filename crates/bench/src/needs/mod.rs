//! `rayfold-bench needs`: the cost to a scene of parts of the tracer that it does not use.
//!
//! The tracer is built whole and without parts (its cargo features). valgrind counts instructions, which are the same
//! on every run, also on a busy machine. valgrind's processor has AVX2 and not AVX-512, so only the AVX2 path is built
//! and counted.

mod parts;
mod subjects;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;

pub(crate) use self::parts::parts;
use self::parts::{Build, builds, uses};
pub(crate) use self::subjects::SKY;
use self::subjects::{Subject, subjects};

use crate::report_folder::ReportFolder;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Print the table and write nothing
    #[arg(long)]
    check: bool,
    /// Use only builds without a part whose name contains this, and write nothing
    #[arg(long, default_value = "")]
    only: String,
    /// Use one build without parts, drawn at random; write nothing
    #[arg(long)]
    slice: bool,
    /// Use this one of them, counted from 0
    #[arg(long, requires = "slice")]
    first: Option<usize>,
}

impl Args {
    fn builds(&self) -> Vec<Build> {
        let mut builds = builds();
        if self.slice {
            let first = self.first.unwrap_or_else(|| fastrand::usize(..builds.len()));
            eprintln!("a slice: --first {first} repeats it");
            builds = builds.into_iter().nth(first).into_iter().collect();
        }
        builds.retain(|build| build.name.contains(&self.only));
        builds
    }
}

/// The goal: a scene executes at most this many more instructions than in a build without its unused parts, in percent.
const MOST: f64 = 0.5;

/// The driver's exit code for a scene that needs a part that its build lacks.
const LEFT_OUT: i32 = 3;

/// The number of concurrent builds. A build of the tracer is a single unit, on one core.
const AT_ONCE: usize = 2;

/// A line of the table.
struct Row {
    subject: &'static str,
    /// The parts that the build lacks.
    without: String,
    whole: u64,
    less: u64,
}

impl Row {
    /// Returns the excess of instructions of the whole build over the other, in percent.
    fn beyond(&self) -> f64 {
        100.0 * (self.whole as f64 / self.less as f64 - 1.0)
    }

    fn is_beyond(&self) -> bool {
        self.beyond() > MOST
    }

    fn summary(&self) -> String {
        format!("{} without {} ({:+.2} %)", self.subject, self.without, self.beyond())
    }
}

/// Counts, prints the table and writes the report.
///
/// # Errors
/// Fails if a part costs too much to a scene that does not use it, if a build draws a scene whose parts it lacks or
/// draws another picture, or if valgrind or cargo fails.
pub fn run(args: &Args) -> Result<()> {
    if !args.check {
        args.output.prepare()?;
    }
    ensure!(
        Command::new("valgrind").arg("--version").output().is_ok_and(|run| run.status.success()),
        "valgrind cannot be run; on Debian: apt-get install valgrind"
    );
    let folder = tempfile::tempdir()?;
    let builds = args.builds();
    let programs = build(&builds, folder.path())?;
    let subjects = subjects()?;
    let scripts: Vec<PathBuf> = subjects
        .iter()
        .enumerate()
        .map(|(k, subject)| {
            let script = folder.path().join(format!("{k}.txt"));
            std::fs::write(&script, &subject.script)?;
            std::fs::write(script.with_file_name("model.obj"), subjects::MODEL)?;
            std::fs::write(script.with_file_name("sky.png"), subjects::SKY)?;
            Ok(script)
        })
        .collect::<Result<_>>()?;
    eprintln!("counting {} scenes", subjects.len());
    let counted: Vec<Vec<Row>> = subjects
        .par_iter()
        .zip(&scripts)
        .map(|(subject, script)| compare(subject, script, (&builds, &programs)))
        .collect::<Result<_>>()?;
    let mut rows: Vec<Row> = counted.into_iter().flatten().collect();
    rows.sort_by_key(|row| builds.iter().position(|build| build.name == row.without));
    let report = report(&rows)?;
    eprintln!("{report}");
    if !args.check && !args.slice && args.only.is_empty() {
        args.output.write("needs.md", &report)?;
    }
    let beyond: Vec<_> = rows.iter().filter(|row| row.is_beyond()).map(Row::summary).collect();
    ensure!(beyond.is_empty(), "scenes execute over {MOST} % more than they need: {}", beyond.join("; "));
    Ok(())
}

/// Builds the driver whole and without parts.
fn build(builds: &[Build], folder: &Path) -> Result<Vec<PathBuf>> {
    let next = AtomicUsize::new(0);
    let target =
        |place: usize| Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../target/needs-{place}"));
    // The tracer's dependencies are built once, on all cores.
    cargo_build(&["--package", "rayfold-scene"], &target(0)).context("the tracer's dependencies")?;
    for other in (1..AT_ONCE).map(target).filter(|target| !target.exists()) {
        let status = Command::new("cp").arg("-a").args([target(0), other]).status().context("cp")?;
        ensure!(status.success(), "cp: {status}");
    }
    let builder = |place: usize| -> Result<Vec<(usize, PathBuf)>> {
        let target = target(place);
        let mut built = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let without = match k {
                0 => &[][..],
                k => match builds.get(k - 1) {
                    Some(build) => &build.without,
                    None => return Ok(built),
                },
            };
            built.push((k, build_without(without, &target, &folder.join(k.to_string()))?));
        }
    };
    let built: Result<Vec<Vec<_>>> = std::thread::scope(|scope| {
        let builder = &builder;
        let builders: Vec<_> = (0..AT_ONCE).map(|place| scope.spawn(move || builder(place))).collect();
        let finished = builders
            .into_iter()
            .map(|builder| builder.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        finished.collect()
    });
    let mut programs = built?.concat();
    programs.sort_by_key(|(k, _)| *k);
    Ok(programs.into_iter().map(|(_, program)| program).collect())
}

fn build_without(without: &[&str], target: &Path, program: &Path) -> Result<PathBuf> {
    let name = if without.is_empty() { "whole".into() } else { format!("without {}", without.join(", ")) };
    eprintln!("building the tracer, {name}");
    let with: Vec<_> = parts().map(|(part, _)| part).filter(|part| !without.contains(part)).collect();
    let with = with.join(",");
    let example =
        ["--package", "rayfold-tracer", "--example", "frames", "--no-default-features", "--features", &with];
    cargo_build(&example, target).context(name)?;
    std::fs::copy(target.join("release/examples/frames"), program)?;
    Ok(program.to_owned())
}

fn cargo_build(what: &[&str], target: &Path) -> Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let status = Command::new(cargo)
        .args(["build", "--quiet", "--locked", "--release"])
        .args(what)
        // One codegen unit, because the division into several depends on the code, and changes counts by up to 10 %.
        .args(["--config", "profile.release.package.rayfold-tracer.codegen-units=1"])
        .arg("--target-dir")
        .arg(target)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
        .status()
        .context("cargo")?;
    ensure!(status.success(), "cargo build: {status}");
    Ok(())
}

/// Returns a row for each build that lacks only parts that the scene does not use. Checks that the other builds refuse
/// the scene.
fn compare(subject: &Subject, script: &Path, (builds, programs): (&[Build], &[PathBuf])) -> Result<Vec<Row>> {
    let (whole, picture) = frame(&programs[0], script, subject.precision)?;
    let mut rows = Vec::new();
    for (Build { name, without, is_of_version_2 }, program) in builds.iter().zip(&programs[1..]) {
        if without.iter().any(|part| uses(part, &subject.scene)) {
            let run = Command::new(program).arg(script).args(["1", subject.precision]).output()?;
            ensure!(
                run.status.code() == Some(LEFT_OUT),
                "{}, without {name}: {}, where it must be refused",
                subject.name,
                run.status
            );
        } else if *is_of_version_2 == subject.is_of_version_2 {
            let (less, same) = frame(program, script, subject.precision)?;
            ensure!(picture == same, "{}: another picture without {name}", subject.name);
            rows.push(Row { subject: subject.name, without: name.clone(), whole, less });
        }
    }
    Ok(rows)
}

/// Returns the instructions of one frame, and a digest of several frames.
fn frame(program: &Path, script: &Path, precision: &str) -> Result<(u64, String)> {
    let (one, _) = count(program, script, "1", precision)?;
    let (two, digest) = count(program, script, "2", precision)?;
    Ok((two - one, digest))
}

fn count(program: &Path, script: &Path, times: &str, precision: &str) -> Result<(u64, String)> {
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .arg(script)
        .args([times, precision])
        .output()?;
    let told = String::from_utf8_lossy(&run.stderr);
    ensure!(run.status.success(), "valgrind: {}: {told}", run.status);
    let answer = String::from_utf8(run.stdout)?;
    ensure!(answer.starts_with("Avx2"), "not the AVX2 path but {answer}");
    let collected = told.lines().find_map(|line| line.split_once("Collected :"));
    let (_, collected) = collected.with_context(|| format!("valgrind says {told}"))?;
    Ok((collected.trim().parse()?, answer))
}

/// Returns the row with the largest excess.
fn worst<'a>(rows: impl Iterator<Item = &'a Row>) -> Option<&'a Row> {
    rows.max_by(|a, b| a.beyond().total_cmp(&b.beyond()))
}

fn report(rows: &[Row]) -> Result<String> {
    let beyond: Vec<_> = rows.iter().filter(|row| row.is_beyond()).map(Row::summary).collect();
    let verdict = if beyond.is_empty() {
        let most = worst(rows.iter()).context("nothing counted")?;
        format!("All {} pairs are within the bound; the largest excess is {}.", rows.len(), most.summary())
    } else {
        format!("**This run failed** for {} of {} pairs: {}.", beyond.len(), rows.len(), beyond.join("; "))
    };
    let mut text = format!(
        "# The cost of unused features\n\n\
         Written by `cargo run -p rayfold-bench -- needs`; `.ci/run` runs it with `--check`. `valgrind \
         --tool=callgrind` counts the instructions of a frame, including its preparation, on one thread and the AVX2 \
         path. It does so for the whole tracer, compiled as one unit, and for builds without a part that the scene \
         does not use. *Beyond* is the share of instructions that the whole tracer executes in excess. The run fails \
         if this share is more than {MOST} %. Both builds of a pair draw the same picture bit for bit. A build refuses \
         a scene that uses a part which the build lacks. Builds without a part of version 1 of the language also lack \
         all of version 2. Parts of version 2 are left out several at a time, such that for each scene of version 2 \
         and each part that it does not use there is a build without that part.\n\n\
         {verdict}\n\n\
         | built without | scenes | most beyond | of |\n\
         | --- | --- | --- | --- |\n"
    );
    for of_build in rows.chunk_by(|a, b| a.without == b.without) {
        let most = worst(of_build.iter()).context("a build without scenes")?;
        let (count, beyond, subject) = (of_build.len(), most.beyond(), most.subject);
        writeln!(text, "| {} | {count} | {beyond:+.2} % | {subject} |", most.without)?;
    }
    text += "\n| built without | scene | instructions, whole | without | beyond |\n\
             | --- | --- | --- | --- | --- |\n";
    for row in rows {
        let Row { subject, without, whole, less } = row;
        writeln!(text, "| {without} | {subject} | {whole} | {less} | {:+.2} % |", row.beyond())?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(whole: u64) -> Vec<Row> {
        let row = |build: Build| Row { subject: "balls", without: build.name, whole: 100_000, less: 100_000 };
        let mut rows: Vec<_> = builds().into_iter().map(row).collect();
        rows[2].whole = whole;
        rows
    }

    #[test]
    fn a_report_says_that_all_hold() {
        let report = report(&rows(100_500)).expect("rows of each part");
        let all = format!("All {} pairs are within the bound", builds().len());
        let expected = format!("{all}; the largest excess is balls without mirrors (+0.50 %).");
        assert!(report.contains(&expected), "{report}");
        assert!(!report.contains("failed"), "{report}");
    }

    #[test]
    fn a_report_says_which_pairs_failed() {
        let report = report(&rows(100_600)).expect("rows of each part");
        let failed = format!("**This run failed** for 1 of {} pairs", builds().len());
        assert!(report.contains(&format!("{failed}: balls without mirrors (+0.60 %).")), "{report}");
        assert!(!report.contains("within the bound"), "{report}");
    }
}
