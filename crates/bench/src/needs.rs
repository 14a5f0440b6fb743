//! `rayfold-bench needs`: what a scene pays for parts of the tracer that it does not use.
//!
//! The tracer is built whole and without each part (its cargo features), and instructions are counted by valgrind: the
//! same on every run, on a busy machine too. valgrind's processor has AVX2 and not AVX-512, so that this is the path
//! that is counted.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use glam::DVec3;
use rayfold_scene::{Light, Object, Scene};
use rayon::prelude::*;

use crate::scenes::{cloud, example, rock, table};

/// What to do with the counts.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The folder that receives needs.md
    #[arg(long, default_value = "docs/reports")]
    output: PathBuf,
    /// Print the table and write nothing
    #[arg(long)]
    check: bool,
}

/// The most that a scene may execute beyond a build without what it does not use, in percent.
const MOST: f64 = 0.5;

/// The driver's exit code for a scene that needs what it was built without.
const LEFT_OUT: i32 = 3;

/// The tracer's cargo features.
const PARTS: [Part; 7] = [
    Part { feature: "boxes", is_used: |scene| scene.objects.iter().any(|o| matches!(o, Object::Cuboid(_))) },
    Part {
        feature: "triangles",
        is_used: |scene| scene.objects.iter().any(|o| matches!(o, Object::Triangle(_))),
    },
    Part { feature: "mirrors", is_used: |scene| scene.objects.iter().any(is_mirror) },
    Part { feature: "shadows", is_used: |scene| !scene.lights.is_empty() && !is_one_ball(scene) },
    Part { feature: "tree", is_used: |scene| scene.objects.len() > 64 },
    Part { feature: "beyond", is_used: has_more_than_version_1 },
    Part { feature: "glass", is_used: |scene| scene.objects.iter().any(is_glass) },
];

struct Part {
    feature: &'static str,
    is_used: fn(&Scene) -> bool,
}

fn is_ball(object: &Object) -> bool {
    matches!(object, Object::Sphere(_))
}

fn is_mirror(object: &Object) -> bool {
    object.material().mirror() != DVec3::ZERO
}

fn is_glass(object: &Object) -> bool {
    object.material().finish().is_some_and(|finish| finish.glass.is_some())
}

/// Skies, lamps, finishes, and shapes with axes of their own.
fn has_more_than_version_1(scene: &Scene) -> bool {
    let is_old =
        |object: &Object| matches!(object, Object::Sphere(_) | Object::Cuboid(_) | Object::Triangle(_));
    scene.background.color().is_none()
        || scene.lights.iter().any(|light| matches!(light, Light::Lamp(_)))
        || scene.objects.iter().any(|object| !is_old(object) || object.material().finish().is_some())
}

/// Nothing is in the light of a ball alone.
fn is_one_ball(scene: &Scene) -> bool {
    matches!(scene.objects[..], [Object::Sphere(_)])
}

/// A scene, and the numbers that it is drawn with.
struct Subject {
    name: &'static str,
    precision: &'static str,
    scene: Scene,
}

/// Scenes that each lack something, and have much else or little.
fn subjects() -> Result<Vec<Subject>> {
    let whole = table(320, 240)?;
    let only = |keep: fn(&Object) -> bool| {
        let mut scene = whole.clone();
        scene.objects = whole.objects.iter().filter(|o| keep(o)).cloned().collect();
        scene
    };
    let unlit = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.lights = Vec::new().into();
        scene
    };
    let mut one = only(is_ball);
    one.objects = one.objects.iter().filter(|o| !is_mirror(o)).take(1).cloned().collect();
    let mut together = rock(1280, 320, 240)?;
    together.objects = together.objects.iter().chain(whole.objects.iter().skip(1)).cloned().collect();
    let mut blocks = cloud(200, 320, 240)?;
    blocks.objects = blocks.objects.iter().map(boxed).collect::<Result<Vec<_>>>()?.into();
    let scenes = [
        ("balls", only(|o| is_ball(o) && !is_mirror(o))),
        ("balls and mirrors", only(is_ball)),
        ("boxes and mirrors", only(|o| !matches!(o, Object::Triangle(_)))),
        ("triangles and mirrors", only(|o| !matches!(o, Object::Cuboid(_)))),
        ("boxes", only(|o| !matches!(o, Object::Triangle(_)) && !is_mirror(o))),
        ("triangles", only(|o| !matches!(o, Object::Cuboid(_)) && !is_mirror(o))),
        ("all but mirrors", only(|o| !is_mirror(o))),
        ("all", whole.clone()),
        ("balls, unlit", unlit(&only(|o| is_ball(o) && !is_mirror(o)))),
        ("all, unlit", unlit(&whole)),
        ("one ball", one),
        ("hello", example("hello")?),
        ("1,000 balls and mirrors", cloud(1000, 320, 240)?),
        ("200 boxes", blocks),
        ("1,280 triangles", rock(1280, 320, 240)?),
        ("1,280 triangles, unlit", unlit(&rock(1280, 320, 240)?)),
        ("1,280 triangles, mirrors, a box", together),
    ];
    let named = |(name, scene)| Subject { name, precision: "auto", scene };
    let mut subjects: Vec<_> = scenes.into_iter().map(named).collect();
    subjects.push(Subject { name: "balls, f64", precision: "f64", scene: only(is_ball) });
    subjects.push(Subject {
        name: "boxes, f64",
        precision: "f64",
        scene: only(|o| !is_mirror(o) && !matches!(o, Object::Triangle(_))),
    });
    Ok(subjects)
}

/// The box around a ball, without its mirror.
fn boxed(object: &Object) -> Result<Object> {
    let Object::Sphere(ball) = object else { bail!("not a ball") };
    let reach = DVec3::splat(0.8 * ball.radius());
    let material = crate::scenes::material(ball.material().diffuse(), 0.0)?;
    let corners = [ball.center() - reach, ball.center() + reach];
    Ok(Object::Cuboid(rayfold_scene::Cuboid::new(corners, material)?))
}

/// A line of the table.
struct Row {
    subject: &'static str,
    without: &'static str,
    whole: u64,
    less: u64,
}

impl Row {
    /// What the whole build executes beyond the other, in percent.
    fn beyond(&self) -> f64 {
        100.0 * (self.whole as f64 / self.less as f64 - 1.0)
    }

    fn is_beyond(&self) -> bool {
        self.beyond() > MOST
    }

    fn told(&self) -> String {
        format!("{} without {} ({:+.2} %)", self.subject, self.without, self.beyond())
    }
}

/// Counts, prints the table and writes the report.
///
/// # Errors
/// When a part costs a scene too much that does not use it, when a build draws what it cannot or another picture, or
/// when valgrind or cargo fails.
pub fn run(args: &Args) -> Result<()> {
    ensure!(
        Command::new("valgrind").arg("--version").output().is_ok_and(|run| run.status.success()),
        "valgrind cannot be run; on Debian: apt-get install valgrind"
    );
    let folder = tempfile::tempdir()?;
    let builds = build(folder.path())?;
    let subjects = subjects()?;
    let scripts: Vec<PathBuf> = subjects
        .iter()
        .enumerate()
        .map(|(k, subject)| {
            let script = folder.path().join(format!("{k}.txt"));
            std::fs::write(&script, subject.scene.to_string())?;
            Ok(script)
        })
        .collect::<Result<_>>()?;
    eprintln!("counting {} scenes", subjects.len());
    let counted: Vec<Vec<Row>> = subjects
        .par_iter()
        .zip(&scripts)
        .map(|(subject, script)| compare(subject, script, &builds))
        .collect::<Result<_>>()?;
    let mut rows: Vec<Row> = counted.into_iter().flatten().collect();
    rows.sort_by_key(|row| PARTS.iter().position(|part| part.feature == row.without));
    let report = report(&rows)?;
    eprintln!("{report}");
    if !args.check {
        std::fs::create_dir_all(&args.output)?;
        let path = args.output.join("needs.md");
        std::fs::write(&path, &report).with_context(|| path.display().to_string())?;
    }
    let beyond: Vec<_> = rows.iter().filter(|row| row.is_beyond()).map(Row::told).collect();
    ensure!(beyond.is_empty(), "scenes execute over {MOST} % more than they need: {}", beyond.join("; "));
    Ok(())
}

/// The driver whole, and without each of [`PARTS`].
fn build(folder: &Path) -> Result<Vec<PathBuf>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let target = root.join("target/needs");
    let parts = PARTS.iter().map(|part| Some(part.feature));
    let build = |without: Option<&'static str>| {
        let name = without.map_or("everything".to_owned(), |part| format!("without-{part}"));
        eprintln!("building the tracer: {name}");
        let with: Vec<_> =
            PARTS.iter().map(|part| part.feature).filter(|part| Some(*part) != without).collect();
        let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
        let status = Command::new(cargo)
            .args([
                "build",
                "--quiet",
                "--locked",
                "--release",
                "--package",
                "rayfold-tracer",
                "--example",
                "frames",
            ])
            .args(["--no-default-features", "--features", &with.join(",")])
            .arg("--target-dir")
            .arg(&target)
            .current_dir(&root)
            .status()
            .context("cargo")?;
        ensure!(status.success(), "cargo build, {name}: {status}");
        let program = folder.join(name);
        std::fs::copy(target.join("release/examples/frames"), &program)?;
        Ok(program)
    };
    std::iter::once(None).chain(parts).map(build).collect()
}

/// A row for each build that leaves out what the scene does not use; the others must refuse it.
fn compare(subject: &Subject, script: &Path, builds: &[PathBuf]) -> Result<Vec<Row>> {
    let (whole, picture) = frame(&builds[0], script, subject.precision)?;
    let mut rows = Vec::new();
    for (part, build) in PARTS.iter().zip(&builds[1..]) {
        if (part.is_used)(&subject.scene) {
            let run = Command::new(build).arg(script).args(["1", subject.precision]).output()?;
            ensure!(
                run.status.code() == Some(LEFT_OUT),
                "{}, without {}: {}, where it must be refused",
                subject.name,
                part.feature,
                run.status
            );
            continue;
        }
        let (less, same) = frame(build, script, subject.precision)?;
        ensure!(picture == same, "{}: another picture without {}", subject.name, part.feature);
        rows.push(Row { subject: subject.name, without: part.feature, whole, less });
    }
    Ok(rows)
}

/// Instructions of one frame, and the digest of some.
fn frame(program: &Path, script: &Path, precision: &str) -> Result<(u64, String)> {
    let (one, _) = count(program, script, "1", precision)?;
    let (three, digest) = count(program, script, "3", precision)?;
    Ok(((three - one) / 2, digest))
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

/// The most that any of the rows is beyond what its scene needs.
fn worst<'a>(rows: impl Iterator<Item = &'a Row>) -> Option<&'a Row> {
    rows.max_by(|a, b| a.beyond().total_cmp(&b.beyond()))
}

fn report(rows: &[Row]) -> Result<String> {
    let beyond: Vec<_> = rows.iter().filter(|row| row.is_beyond()).map(Row::told).collect();
    let verdict = if beyond.is_empty() {
        let most = worst(rows.iter()).context("nothing counted")?;
        format!("All {} pairs hold; the most is {}.", rows.len(), most.told())
    } else {
        format!("**This run failed** for {} of {} pairs: {}.", beyond.len(), rows.len(), beyond.join("; "))
    };
    let mut text = format!(
        "# Only what a scene needs\n\n\
         Written by `cargo run -p rayfold-bench -- needs`; `.ci/run` runs it with `--check`. Instructions of a frame, \
         preparations included, on one thread and the AVX2 path, counted by `valgrind --tool=callgrind`: by the whole \
         tracer, and by one that was built without a part that the scene does not use. *Beyond* is what the whole one \
         executes more; the run fails where it is over {MOST} %. Every pair draws the same picture bit for bit, and a \
         scene that uses what a build leaves out is refused by it.\n\n\
         {verdict}\n\n\
         | built without | scenes | most beyond | of |\n| --- | --- | --- | --- |\n"
    );
    for part in &PARTS {
        let of = || rows.iter().filter(|row| row.without == part.feature);
        let most = worst(of()).context("a part without scenes")?;
        let (feature, count, beyond, subject) = (part.feature, of().count(), most.beyond(), most.subject);
        writeln!(text, "| {feature} | {count} | {beyond:+.2} % | {subject} |")?;
    }
    text += "\n| built without | scene | instructions, whole | without the part | beyond |\n\
             | --- | --- | --- | --- | --- |\n";
    for row in rows {
        writeln!(
            text,
            "| {} | {} | {} | {} | {:+.2} % |",
            row.without,
            row.subject,
            row.whole,
            row.less,
            row.beyond()
        )?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(whole: u64) -> Vec<Row> {
        let row =
            |part: &Part| Row { subject: "balls", without: part.feature, whole: 100_000, less: 100_000 };
        let mut rows: Vec<_> = PARTS.iter().map(row).collect();
        rows[2].whole = whole;
        rows
    }

    #[test]
    fn a_report_tells_that_all_hold() {
        let report = report(&rows(100_500)).expect("rows of each part");
        assert!(
            report.contains("All 7 pairs hold; the most is balls without mirrors (+0.50 %)."),
            "{report}"
        );
        assert!(!report.contains("failed"), "{report}");
    }

    #[test]
    fn a_report_tells_which_pairs_failed() {
        let report = report(&rows(100_600)).expect("rows of each part");
        let told = "**This run failed** for 1 of 7 pairs: balls without mirrors (+0.60 %).";
        assert!(report.contains(told), "{report}");
        assert!(!report.contains("hold"), "{report}");
    }
}
