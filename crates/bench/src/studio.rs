//! `rayfold-bench studio`: the studio's page in a real browser. Measures the time to the first picture, the pictures
//! per second while an object is dragged, their sizes, the latency from the pointer to the canvas, and the time to the
//! final picture when the hand rests. `crates/studio/web/tests/bench.mjs` drives the browser; this program makes the
//! report from its figures.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::plot::{Labels, Series, shares};
use crate::report_folder::ReportFolder;

/// The width and height of the picture.
const SIZE: (u32, u32) = (960, 540);

/// A scene that is measured.
struct Subject {
    name: &'static str,
    /// The script of its first frame, below `scenes`.
    script: &'static str,
    /// The place of the dragged object, in shares of the picture's width and height.
    grab: [f64; 2],
    /// The object that is dragged.
    object: &'static str,
    /// Whether the page is the static one.
    is_static: bool,
}

/// The measured scenes.
const SUBJECTS: [Subject; 4] = [
    HELLO,
    Subject {
        name: "clockwork",
        script: "clockwork/clockwork.txt",
        grab: [0.36, 0.52],
        object: "the brass wheel",
        is_static: false,
    },
    Subject {
        name: "glass",
        script: "glass/glass.txt",
        grab: [0.5, 0.43],
        object: "the table with all that stands on it",
        is_static: false,
    },
    Subject { name: "hello, static page", is_static: true, ..HELLO },
];

const HELLO: Subject = Subject {
    name: "hello",
    script: "hello/frame01.txt",
    grab: [0.59, 0.67],
    object: "a sphere",
    is_static: false,
};

/// The maximum milliseconds from the pointer to the canvas for 95 % of the moves.
const LATE: f64 = 25.0;

/// The goals of the program's page.
const GOALS: Goals =
    Goals { rate: 55.0, late: Some(LATE), first: 1000.0, least: Some(0.25), rested: Some(1000.0) };

/// The goals of the static page. Its first picture comes from an empty cache.
const STATIC_GOALS: Goals = Goals { rate: 55.0, late: None, first: 2000.0, least: None, rested: None };

impl Subject {
    fn goals(&self) -> &'static Goals {
        if self.is_static { &STATIC_GOALS } else { &GOALS }
    }
}

/// Limits of what is measured.
struct Goals {
    /// The least number of pictures per second.
    rate: f64,
    /// The maximum milliseconds from the pointer to the canvas for 95 % of the moves.
    late: Option<f64>,
    /// The most milliseconds to the first picture.
    first: f64,
    /// The least share of the picture's width and height that is drawn while something moves.
    least: Option<f64>,
    /// The most milliseconds from the last move to the final picture.
    rested: Option<f64>,
}

/// The end of the plot, in milliseconds.
const LONGEST_SHOWN_MS: f64 = 60.0;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    output: ReportFolder,
    /// Measure this rayfold program [default: the one beside this program]
    #[arg(long)]
    program: Option<PathBuf>,
    /// Measure the static page in this folder, which `cargo xtask site` has made, beside the program
    #[arg(long)]
    site: Option<PathBuf>,
    /// Use this browser
    #[arg(long, default_value = "chromium")]
    browser: PathBuf,
    /// Measure each scene this often; of each the run with the least other load counts
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Drag an object for this many seconds in each run
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
}

/// The results of a run, from the browser's driver.
#[derive(Debug, Deserialize)]
struct Run {
    scene: String,
    run: u32,
    /// The time from opening the page to its first picture, in milliseconds: by a browser that has just started, and again.
    cold: f64,
    first: f64,
    seconds: f64,
    /// The share of all processors that other programs used.
    others: f64,
    /// The processor time of the studio and the browser, in milliseconds.
    #[serde(rename = "processorMs")]
    processor_ms: f64,
    pictures: u32,
    /// The number of pictures of each size.
    sizes: BTreeMap<String, u32>,
    /// The latencies from the pointer to the canvas, in milliseconds.
    waits: Vec<f64>,
    /// The milliseconds from the last move to the final picture while the button stays down; `None` if it does not come.
    rested: Option<f64>,
    /// The milliseconds from the release of the button to the final picture.
    released: Option<f64>,
}

impl Run {
    fn subject(&self) -> &'static Subject {
        SUBJECTS.iter().find(|subject| subject.name == self.scene).unwrap_or(&HELLO)
    }

    /// Returns the time to the first picture: that of the static page comes from an empty cache.
    fn first(&self) -> f64 {
        if self.subject().is_static { self.cold } else { self.first }
    }

    fn rate(&self) -> f64 {
        f64::from(self.pictures) / self.seconds
    }

    /// Returns the latency below which this share of all latencies is.
    fn quantile(&self, share: f64) -> f64 {
        let mut waits = self.waits.clone();
        waits.sort_by(f64::total_cmp);
        let at = (share * waits.len() as f64).ceil() as usize;
        waits.get(at.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    }

    /// Returns the processor time of the studio and the browser per picture.
    fn work(&self) -> f64 {
        self.processor_ms / f64::from(self.pictures.max(1))
    }

    /// Returns the share of pictures of full size.
    fn whole(&self) -> f64 {
        let whole = self.sizes.get(&format!("{}x{}", SIZE.0, SIZE.1)).copied().unwrap_or(0);
        f64::from(whole) / f64::from(self.pictures.max(1))
    }

    /// Returns the least and the median size of the pictures, as shares of the width or of the height: the lesser of the two.
    fn shares(&self) -> (f64, f64) {
        let share = |size: &String| {
            let (width, height) = size.split_once('x')?;
            let (width, height): (f64, f64) = (width.parse().ok()?, height.parse().ok()?);
            Some((width / f64::from(SIZE.0)).min(height / f64::from(SIZE.1)))
        };
        let mut shares: Vec<f64> = Vec::new();
        for (size, count) in &self.sizes {
            shares.extend(std::iter::repeat_n(share(size).unwrap_or(f64::NAN), *count as usize));
        }
        shares.sort_by(f64::total_cmp);
        let at = |at: usize| shares.get(at).copied().unwrap_or(f64::NAN);
        (at(0), at(shares.len() / 2))
    }
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if the program, Node or the browser cannot be run, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    args.output.prepare()?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir()?;
    let mut scenes = Vec::new();
    let is_measured = |subject: &&Subject| args.site.is_some() || !subject.is_static;
    let subjects: Vec<_> = SUBJECTS.iter().filter(is_measured).collect();
    for subject in &subjects {
        let text = std::fs::read_to_string(root.join("scenes").join(subject.script))?;
        let script = folder.path().join(subject.name).with_extension("txt");
        std::fs::write(&script, widened(&text)?)?;
        scenes.push(serde_json::json!({
            "name": subject.name, "script": script, "grab": subject.grab, "isStatic": subject.is_static
        }));
    }
    let program = match &args.program {
        Some(program) => program.canonicalize().with_context(|| program.display().to_string())?,
        None => std::env::current_exe()?.with_file_name("rayfold"),
    };
    let driver = root.join("crates/studio/web/tests/bench.mjs");
    let output = Command::new("node")
        .arg(&driver)
        .args([args.runs, args.seconds].map(|number| number.to_string()))
        .arg(serde_json::Value::from(scenes).to_string())
        .env("RAYFOLD", &program)
        .env("CHROMIUM", &args.browser)
        .envs(args.site.as_ref().map(|site| ("SITE", site)))
        .stderr(Stdio::inherit())
        .output()
        .context("node cannot be run")?;
    ensure!(output.status.success(), "{} has failed", driver.display());
    let text = String::from_utf8(output.stdout)?;
    let runs: Vec<Run> =
        text.lines().map(serde_json::from_str).collect::<Result<_, _>>().context("the driver's figures")?;
    let quietest = quietest(&runs, &subjects)?;
    for run in &quietest {
        ensure!(run.waits.len() > 10, "the browser has shown next to nothing of {}", run.scene);
    }
    args.output.write("studio.md", report(&runs, &quietest))?;
    write_csv(&args.output.path("studio.csv"), &runs)?;
    plot(&args.output.path("studio.svg"), &quietest)
}

/// Returns the run with the least other load of each scene.
fn quietest<'a>(runs: &'a [Run], subjects: &[&Subject]) -> Result<Vec<&'a Run>> {
    let of = |subject: &&Subject| {
        let runs = runs.iter().filter(|run| run.scene == subject.name);
        let least = runs.min_by(|a, b| a.others.total_cmp(&b.others));
        least.with_context(|| format!("no run of {} was measured", subject.name))
    };
    subjects.iter().map(of).collect()
}

/// Returns the scene in another size. The width of a window changes in proportion to that of its picture.
fn widened(text: &str) -> Result<String> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let screen = lines.iter_mut().find(|line| line.starts_with("Screen ")).context("no Screen")?;
    let sides: Vec<f64> = screen.split_whitespace().skip(1).map(str::parse).collect::<Result<_, _>>()?;
    ensure!(sides.len() == 2, "a Screen with two sides");
    *screen = format!("Screen {} {}", SIZE.0, SIZE.1);
    let wider = f64::from(SIZE.0) / f64::from(SIZE.1) * sides[1] / sides[0];
    // The angle of `Look` is that of the height.
    if let Some(camera) = lines.iter_mut().find(|line| line.starts_with("Camera ")) {
        let mut words: Vec<String> = camera.split_whitespace().map(str::to_owned).collect();
        for at in [words.len() - 4, words.len() - 2] {
            words[at] = (words[at].parse::<f64>()? * wider).to_string();
        }
        *camera = words.join(" ");
    }
    Ok(lines.join("\n") + "\n")
}

fn report(runs: &[Run], quietest: &[&Run]) -> String {
    let word = |is_met: bool| if is_met { "met" } else { "missed" };
    let objects: Vec<_> = SUBJECTS
        .iter()
        .filter(|subject| !subject.is_static)
        .map(|subject| format!("{} of `scenes/{}`", subject.object, subject.name))
        .collect();
    let mut text = format!(
        "# The studio\n\n\
         Written by `rayfold-bench studio`; all figures are in [studio.csv](studio.csv). The measurement uses the \
         first frames of three scenes at {} x {}, in headless Chromium on the machine that draws. In each scene an \
         object is dragged on a circle, with 125 pointer moves per second: {}. The studio sends only the part of a \
         picture that differs from the previous picture. Moving the view changes the whole picture and is not measured \
         here. The *static page* is the page of `--site`, which needs no studio server. The driver uses the browser's \
         debugging protocol without the Network domain, which would copy every picture.\n\n\
         - *Pointer to canvas* is the time from a pointer event to the end of `putImageData` of the first picture that \
         was requested with the event or after it. The time in which the browser shows its canvas is excluded.\n\
         - *Least size* and *median size* are sizes of the pictures while the object moves. A size is the smaller of \
         two shares, that of the full width and that of the full height. A smaller picture is stretched. If even the \
         smallest picture takes too long, its rays follow fewer reflections and refractions. In `clockwork` and \
         `glass` nearly all surfaces are mirrors or glass. A change can therefore reach every pixel, and the whole \
         picture is drawn.\n\
         - *Final after a rest* is the time from the last move to the final picture while the button stays down. The \
         final picture is that of `rayfold render`. *Final after a release* is the time from the release of the button \
         to the final picture, if the object was moving.\n\
         - *First picture* is the time from opening the page in a running browser. The static page is loaded over \
         loopback with an empty cache.\n\
         - *Others* is the share of all processors that programs outside the measurement use. *Processor ms* is the \
         processor time of the studio and the browser.\n\n\
         Each scene is measured in {} runs. The run with the least other load counts.\n\n\
         | scene | | measured | goal | |\n\
         | --- | --- | --: | --: | --- |\n",
        SIZE.0,
        SIZE.1,
        objects.join(", "),
        runs.iter().filter(|run| run.scene == quietest[0].scene).count(),
    );
    // Writing to a String cannot fail.
    for run in quietest {
        let (least, median) = run.shares();
        let late = run.quantile(0.95);
        let Goals { rate, late: latest, first, least: smallest, rested } = run.subject().goals();
        let ms = |goal: f64| format!("{goal:.0}");
        let mut row = |what: &str, measured: String, goal: Option<String>, is_met: bool| {
            let verdict = goal.as_ref().map_or("", |_| word(is_met));
            let goal = goal.unwrap_or_default();
            let _ = writeln!(text, "| {} | {what} | {measured} | {goal} | {verdict} |", run.scene);
        };
        let is_soon = |ms: Option<f64>| ms.zip(*rested).is_some_and(|(ms, most)| ms <= most);
        row(
            "pictures per second",
            format!("{:.1}", run.rate()),
            Some(format!("{rate}")),
            run.rate() >= *rate,
        );
        let is_met = latest.is_some_and(|most| late <= most);
        row("pointer to canvas, 95 % within, ms", format!("{late:.1}"), latest.map(ms), is_met);
        let is_met = smallest.is_some_and(|goal| least >= goal);
        row("least size", percent(least), smallest.map(percent), is_met);
        row("final after a rest, ms", whole(run.rested), rested.map(ms), is_soon(run.rested));
        row("final after a release, ms", whole(run.released), rested.map(ms), is_soon(run.released));
        row("first picture, ms", format!("{:.0}", run.first()), Some(ms(*first)), run.first() <= *first);
        row("median size", percent(median), None, false);
    }
    text.push_str(
        "\n![The share of moves that are on the canvas by milliseconds](studio.svg)\n\n\
         ## All runs\n\n\
         | scene | run | others | pictures per second | least size | median | at whole size | processor ms per picture \
         | pointer to canvas: half within, ms | 95 % | 99 % | final after a rest, ms | after a release | first picture, \
         ms |\n\
         | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    for run in runs {
        let (least, median) = run.shares();
        let _ = writeln!(
            text,
            "| {} | {} | {:.0} % | {:.1} | {} | {} | {} | {:.1} | {:.1} | {:.1} | {:.1} | {} | {} | {:.0} |",
            run.scene,
            run.run,
            100.0 * run.others,
            run.rate(),
            percent(least),
            percent(median),
            percent(run.whole()),
            run.work(),
            run.quantile(0.5),
            run.quantile(0.95),
            run.quantile(0.99),
            whole(run.rested),
            whole(run.released),
            run.first(),
        );
    }
    text
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Returns a time in whole milliseconds.
fn whole(ms: Option<f64>) -> String {
    ms.map_or_else(|| "never".into(), |ms| format!("{ms:.0}"))
}

fn write_csv(path: &Path, runs: &[Run]) -> Result<()> {
    let mut csv = csv::Writer::from_path(path).with_context(|| path.display().to_string())?;
    let columns = [
        "scene",
        "run",
        "others",
        "seconds",
        "pictures",
        "pictures_a_second",
        "least_size",
        "median_size",
        "at_whole_size",
        "processor_ms_a_picture",
        "p50_ms",
        "p95_ms",
        "p99_ms",
        "rested_ms",
        "released_ms",
        "first_ms",
    ];
    csv.write_record(columns)?;
    for run in runs {
        let (least, median) = run.shares();
        let figures = [
            run.others,
            run.seconds,
            f64::from(run.pictures),
            run.rate(),
            least,
            median,
            run.whole(),
            run.work(),
            run.quantile(0.5),
            run.quantile(0.95),
            run.quantile(0.99),
            run.rested.unwrap_or(f64::NAN),
            run.released.unwrap_or(f64::NAN),
            run.first(),
        ];
        let figures = figures.map(|figure| format!("{:.3}", figure));
        csv.write_record([run.scene.clone(), run.run.to_string()].into_iter().chain(figures))?;
    }
    Ok(csv.flush()?)
}

fn plot(path: &Path, quietest: &[&Run]) -> Result<()> {
    let course = |run: &Run| {
        let mut waits = run.waits.clone();
        waits.sort_by(f64::total_cmp);
        let of = waits.len() as f64;
        waits.iter().enumerate().map(|(at, wait)| (*wait, 100.0 * (at + 1) as f64 / of)).collect()
    };
    let series: Vec<_> = quietest
        .iter()
        .map(|run| Series {
            name: format!("{}, run {}, others {:.0} %", run.scene, run.run, 100.0 * run.others),
            points: course(run),
            joined: true,
        })
        .collect();
    let labels = Labels {
        title: "From the pointer to the canvas",
        x: "milliseconds",
        y: "share of the pointer's moves that are on the canvas, %",
    };
    shares(path, &labels, LONGEST_SHOWN_MS, &[(LATE, 95.0)], &series)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(waits: Vec<f64>) -> Run {
        let sizes = BTreeMap::from([("960x540".to_owned(), 90), ("480x270".to_owned(), 30)]);
        Run {
            scene: "hello".into(),
            run: 3,
            cold: 1500.0,
            first: 400.0,
            seconds: 2.0,
            others: 0.1,
            processor_ms: 1200.0,
            pictures: 120,
            sizes,
            waits,
            rested: Some(300.0),
            released: None,
        }
    }

    #[test]
    fn quantiles_are_of_the_sorted_waits() {
        let run = measured((1..=100).rev().map(f64::from).collect());
        assert_eq!([0.5, 0.95, 1.0].map(|share| run.quantile(share)), [50.0, 95.0, 100.0]);
        assert_eq!((run.rate(), run.whole()), (60.0, 0.75));
    }

    #[test]
    fn sizes_are_those_of_the_pictures() {
        assert_eq!(measured(vec![]).shares(), (0.5, 1.0));
        let sizes = BTreeMap::from([("960x540".to_owned(), 1), ("120x68".to_owned(), 5)]);
        assert_eq!(Run { sizes, ..measured(vec![]) }.shares(), (0.125, 0.125));
    }

    #[test]
    fn a_goal_that_is_missed_is_called_so() {
        let run = measured(vec![30.0; 100]);
        let text = report(std::slice::from_ref(&run), &[&run]);
        assert!(text.contains("| hello | pictures per second | 60.0 | 55 | met |"), "{text}");
        assert!(text.contains("| 30.0 | 25 | missed |"), "{text}");
        assert!(text.contains("| hello | least size | 50 % | 25 % | met |"), "{text}");
        assert!(text.contains("| final after a rest, ms | 300 | 1000 | met |"), "{text}");
        assert!(text.contains("| final after a release, ms | never | 1000 | missed |"), "{text}");
    }

    #[test]
    fn the_quietest_run_of_each_scene_counts() {
        let of = |subject: &Subject, run, others| Run {
            scene: subject.name.into(),
            run,
            others,
            ..measured(vec![])
        };
        let subjects = [&SUBJECTS[0], &SUBJECTS[1], &SUBJECTS[2]];
        let runs: Vec<_> =
            subjects.iter().flat_map(|subject| [of(subject, 1, 0.2), of(subject, 2, 0.1)]).collect();
        let found: Vec<_> =
            quietest(&runs, &subjects).unwrap().iter().map(|run| (&run.scene[..], run.run)).collect();
        assert_eq!(found, [("hello", 2), ("clockwork", 2), ("glass", 2)]);
        assert!(quietest(&runs[..4], &subjects).is_err(), "one scene is missing");
    }

    #[test]
    fn a_wider_scene_is_not_squashed() {
        let text = "# a\nScreen 512 512\nCamera 0 5 12  0 -4 -12  0 1 0  1  -0.4 -0.4  0.4 0.4\nTrace";
        let wide = widened(text).unwrap();
        let parsed = rayfold_scene::parse("a", wide.as_bytes(), &Default::default());
        assert!(parsed.script.is_some() && parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
        assert!(wide.contains("Screen 960 540\n") && wide.contains(" -0.4 0.7"), "{wide}");
    }

    #[test]
    fn a_view_with_an_angle_is_wider_by_its_screen() {
        let text = "Screen 320 240\nLook 0 4 6  0 0 0  36\nTrace";
        assert_eq!(widened(text).unwrap(), text.replace("320 240", "960 540") + "\n");
    }
}
