//! `rayfold-bench studio`: the studio's page in a real browser. Measures the time to the first picture, the pictures
//! per second while an object is dragged, and the latency from the pointer to the canvas.
//! `crates/studio/web/tests/bench.mjs` drives the browser; this program makes the report from its figures.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use rayfold_files::OutputFile;
use serde::Deserialize;

use crate::plot::{Labels, Series, shares};

/// The width and height of the picture.
const SIZE: (u32, u32) = (960, 540);

/// The goals: pictures per second, milliseconds from the pointer to the canvas for 95 % of the pictures, milliseconds
/// to the first picture.
const GOALS: (f64, f64, f64) = (55.0, 25.0, 1000.0);

/// The end of the plot, in milliseconds.
const LONGEST_SHOWN_MS: f64 = 60.0;

/// The options of the subcommand.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Write studio.md, studio.csv and studio.svg into this folder
    #[arg(long, default_value = "docs/reports")]
    output: PathBuf,
    /// Measure this rayfold program [default: the one beside this program]
    #[arg(long)]
    program: Option<PathBuf>,
    /// Use this browser
    #[arg(long, default_value = "chromium")]
    browser: PathBuf,
    /// Measure this often; the run with the least other load counts
    #[arg(long, default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Drag an object for this many seconds in each run
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
}

/// The results of a run, from the browser's driver.
#[derive(Debug, Deserialize)]
struct Run {
    run: u32,
    /// The time from opening the page to its first picture, in milliseconds.
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
}

impl Run {
    fn rate(&self) -> f64 {
        f64::from(self.pictures) / self.seconds
    }

    /// Returns the latency that this share of all latencies is below.
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
}

/// Measures and writes the report.
///
/// # Errors
/// Fails if the program, Node or the browser cannot be run, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir()?;
    let script = folder.path().join("hello.txt");
    let hello = std::fs::read_to_string(root.join("scenes/hello/frame01.txt"))?;
    std::fs::write(&script, widened(&hello)?)?;
    let program = match &args.program {
        Some(program) => program.canonicalize().with_context(|| program.display().to_string())?,
        None => std::env::current_exe()?.with_file_name("rayfold"),
    };
    let driver = root.join("crates/studio/web/tests/bench.mjs");
    let output = Command::new("node")
        .arg(&driver)
        .arg(&script)
        .args([args.runs, args.seconds].map(|number| number.to_string()))
        .env("RAYFOLD", &program)
        .env("CHROMIUM", &args.browser)
        .stderr(Stdio::inherit())
        .output()
        .context("node cannot be run")?;
    ensure!(output.status.success(), "{} has failed", driver.display());
    let text = String::from_utf8(output.stdout)?;
    let runs: Vec<Run> =
        text.lines().map(serde_json::from_str).collect::<Result<_, _>>().context("the driver's figures")?;
    let quietest = runs.iter().min_by(|a, b| a.others.total_cmp(&b.others)).context("no run was measured")?;
    ensure!(quietest.waits.len() > 10, "the browser has shown next to nothing");
    std::fs::create_dir_all(&args.output)?;
    OutputFile::write(args.output.join("studio.md"), report(&runs, quietest), false)?;
    write_csv(&args.output.join("studio.csv"), &runs)?;
    plot(&args.output.join("studio.svg"), &runs, quietest)
}

/// Returns the scene in another size. The width of its window changes in proportion to that of its picture.
fn widened(text: &str) -> Result<String> {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let screen = lines.iter_mut().find(|line| line.starts_with("Screen ")).context("no Screen")?;
    let sides: Vec<f64> = screen.split_whitespace().skip(1).map(str::parse).collect::<Result<_, _>>()?;
    ensure!(sides.len() == 2, "a Screen with two sides");
    *screen = format!("Screen {} {}", SIZE.0, SIZE.1);
    let wider = f64::from(SIZE.0) / f64::from(SIZE.1) * sides[1] / sides[0];
    let camera = lines.iter_mut().find(|line| line.starts_with("Camera ")).context("no Camera")?;
    let mut words: Vec<String> = camera.split_whitespace().map(str::to_owned).collect();
    for at in [words.len() - 4, words.len() - 2] {
        words[at] = (words[at].parse::<f64>()? * wider).to_string();
    }
    *camera = words.join(" ");
    Ok(lines.join("\n") + "\n")
}

fn report(runs: &[Run], quietest: &Run) -> String {
    let (rate, late, first) = GOALS;
    let word = |is_met: bool| if is_met { "met" } else { "missed" };
    let mut text = format!(
        "# The studio\n\n\
         Written by `rayfold-bench studio`; all figures are in [studio.csv](studio.csv). The first frame of \
         `scenes/hello` at {} x {}, in headless Chromium on the machine that draws; one of its spheres is dragged on a \
         circle, by 125 pointer moves per second. The studio sends only the part of a picture that differs from the \
         one before. Moving the view changes all of it, and is not measured here. The driver uses the browser's \
         debugging protocol without the Network domain, which would copy every picture.\n\n\
         *Pointer to canvas* is the time from the pointer's event to the end of `putImageData` of the first picture \
         that was requested with it or after it; it excludes the browser's time to show its canvas. *First picture* is \
         the time from opening the page in a running browser. *Others* is the share of all processors used by programs \
         outside the measurement, *processor ms* the time of the studio and the browser. Of {} runs the one with the \
         least other load counts, run {}.\n\n\
         | | measured | goal | |\n\
         | --- | --: | --: | --- |\n\
         | pictures per second | {:.1} | {rate} | {} |\n\
         | pointer to canvas, 95 % within, ms | {:.1} | {late} | {} |\n\
         | first picture, ms | {:.0} | {first} | {} |\n\n\
         ![The share of moves that are on the canvas by milliseconds](studio.svg)\n\n\
         ## All runs\n\n\
         | run | others | pictures per second | at whole size | processor ms per picture | pointer to canvas: half \
         within, ms | 95 % | 99 % | first picture, ms |\n\
         | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n",
        SIZE.0,
        SIZE.1,
        runs.len(),
        quietest.run,
        quietest.rate(),
        word(quietest.rate() >= rate),
        quietest.quantile(0.95),
        word(quietest.quantile(0.95) <= late),
        quietest.first,
        word(quietest.first <= first),
    );
    for run in runs {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "| {} | {:.0} % | {:.1} | {:.0} % | {:.1} | {:.1} | {:.1} | {:.1} | {:.0} |",
            run.run,
            100.0 * run.others,
            run.rate(),
            100.0 * run.whole(),
            run.work(),
            run.quantile(0.5),
            run.quantile(0.95),
            run.quantile(0.99),
            run.first,
        );
    }
    text
}

fn write_csv(path: &Path, runs: &[Run]) -> Result<()> {
    let mut csv = csv::Writer::from_path(path).with_context(|| path.display().to_string())?;
    let columns = [
        "run",
        "others",
        "seconds",
        "pictures",
        "pictures_a_second",
        "at_whole_size",
        "processor_ms_a_picture",
        "p50_ms",
        "p95_ms",
        "p99_ms",
        "first_ms",
    ];
    csv.write_record(columns)?;
    for run in runs {
        let figures = [
            run.others,
            run.seconds,
            f64::from(run.pictures),
            run.rate(),
            run.whole(),
            run.work(),
            run.quantile(0.5),
            run.quantile(0.95),
            run.quantile(0.99),
            run.first,
        ];
        let figures = figures.map(|figure| format!("{:.3}", figure));
        csv.write_record(std::iter::once(run.run.to_string()).chain(figures))?;
    }
    Ok(csv.flush()?)
}

fn plot(path: &Path, runs: &[Run], quietest: &Run) -> Result<()> {
    let course = |run: &Run| {
        let mut waits = run.waits.clone();
        waits.sort_by(f64::total_cmp);
        let of = waits.len() as f64;
        waits.iter().enumerate().map(|(at, wait)| (*wait, 100.0 * (at + 1) as f64 / of)).collect()
    };
    let series: Vec<_> = runs
        .iter()
        .map(|run| Series {
            name: format!(
                "run {}, others {:.0} %{}",
                run.run,
                100.0 * run.others,
                if run.run == quietest.run { ": the quietest" } else { "" }
            ),
            points: course(run),
            joined: true,
        })
        .collect();
    let labels = Labels {
        title: "From the pointer to the canvas",
        x: "milliseconds",
        y: "share of the pointer's moves that are on the canvas, %",
    };
    shares(path, &labels, LONGEST_SHOWN_MS, &[(GOALS.1, 95.0)], &series)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(waits: Vec<f64>) -> Run {
        let sizes = BTreeMap::from([("960x540".to_owned(), 90), ("480x270".to_owned(), 30)]);
        Run {
            run: 3,
            first: 400.0,
            seconds: 2.0,
            others: 0.1,
            processor_ms: 1200.0,
            pictures: 120,
            sizes,
            waits,
        }
    }

    #[test]
    fn quantiles_are_of_the_sorted_waits() {
        let run = measured((1..=100).rev().map(f64::from).collect());
        assert_eq!([0.5, 0.95, 1.0].map(|share| run.quantile(share)), [50.0, 95.0, 100.0]);
        assert_eq!((run.rate(), run.whole()), (60.0, 0.75));
    }

    #[test]
    fn a_goal_that_is_missed_is_called_so() {
        let run = measured(vec![30.0; 100]);
        let text = report(std::slice::from_ref(&run), &run);
        assert!(text.contains("| pictures per second | 60.0 | 55 | met |"), "{text}");
        assert!(text.contains("| 30.0 | 25 | missed |"), "{text}");
    }

    #[test]
    fn a_wider_scene_is_not_squashed() {
        let text = "# a\nScreen 512 512\nCamera 0 5 12  0 -4 -12  0 1 0  1  -0.4 -0.4  0.4 0.4\nTrace";
        let wide = widened(text).unwrap();
        let parsed = rayfold_scene::parse("a", wide.as_bytes(), &Default::default());
        assert!(parsed.script.is_some() && parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
        assert!(wide.contains("Screen 960 540\n") && wide.contains(" -0.4 0.7"), "{wide}");
    }
}
