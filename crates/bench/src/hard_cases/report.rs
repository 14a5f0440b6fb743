//! The report on the hard cases: a file with all figures for each case, and a page that summarises them.
//!
//! The page is made from the files alone, so a case can be measured again without the others.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use super::figures::{Figure, Size};
use super::{CASES, Case, SEED};

/// The figures of all cases that were measured.
#[derive(Debug, Default)]
pub struct Report {
    runs: Vec<Run>,
    /// The figures of each run.
    figures: Vec<Vec<Figure>>,
}

/// The circumstances in which a case was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The number of the case.
    pub case: String,
    /// The size.
    pub size: Size,
    /// The elapsed time in seconds, all backends together.
    pub seconds: f64,
    /// The revision of the project.
    pub revision: String,
    /// The date of the revision.
    pub date: String,
}

impl Report {
    /// Reads the files of `folder`. Returns an empty report if the folder does not exist.
    ///
    /// # Errors
    /// Fails if a file cannot be read or is malformed.
    pub fn read(folder: &Path) -> Result<Self> {
        let mut report = Self::default();
        if runs_file(folder).exists() {
            report.runs = rows(&runs_file(folder))?;
        }
        for run in &report.runs {
            report.figures.push(rows(&case_file(folder, &run.case))?);
        }
        Ok(report)
    }

    /// Adds a case that was measured, and replaces its former figures.
    pub fn add(&mut self, run: Run, figures: Vec<Figure>) {
        if let Some(k) = self.runs.iter().position(|old| old.case == run.case) {
            self.runs.remove(k);
            self.figures.remove(k);
        }
        let place = |number: &str| CASES.iter().position(|case| case.number == number);
        let k = self.runs.iter().take_while(|old| place(&old.case) < place(&run.case)).count();
        self.runs.insert(k, run);
        self.figures.insert(k, figures);
    }

    /// Writes the files to `folder`.
    ///
    /// # Errors
    /// Fails if a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        write_rows(&runs_file(folder), &self.runs)?;
        for (run, figures) in self.runs.iter().zip(&self.figures) {
            write_rows(&case_file(folder, &run.case), figures)?;
        }
        Ok(())
    }

    /// Returns the page. `naive` is the name of the naive backend, which is there for comparison.
    ///
    /// # Errors
    /// Cannot fail: writing to a `String` always succeeds.
    pub fn page(&self, naive: &str) -> Result<String> {
        let mut table = String::from(
            "| case | requirement | within bound | largest figure | naive: within bound | naive: largest figure |\n\
             | --- | --- | --: | --: | --: | --: |\n",
        );
        let mut failing = String::new();
        let (mut ours, mut theirs) = (Tally::default(), Tally::default());
        for case in CASES {
            let title = format!("| {} | **{}**: {}", case.number, case.title, case.asked);
            let Some(k) = self.runs.iter().position(|run| run.case == case.number) else {
                writeln!(table, "{title} | not measured | | | |")?;
                continue;
            };
            let (naives, others): (Vec<Figure>, Vec<Figure>) =
                self.figures[k].iter().cloned().partition(|figure| figure.backend == naive);
            let naives: Vec<Figure> = naives.into_iter().map(|figure| bounded(figure, &others)).collect();
            let (other, by_naive) = (Tally::of(&others), Tally::of(&naives));
            writeln!(table, "{title} | {} | {} | {} | {} |", other, other.worst, by_naive, by_naive.worst)?;
            ours.add(&other);
            theirs.add(&by_naive);
            for figure in others.iter().filter(|figure| !figure.passes()) {
                writeln!(
                    failing,
                    "| {} {} | {} | {} | {:.2e} | {:.1e} | {} |",
                    case.number,
                    case.title,
                    figure.what,
                    figure.backend,
                    figure.measured,
                    figure.bound.unwrap_or(f64::INFINITY),
                    figure.samples
                )?;
            }
        }
        let failing = if failing.is_empty() {
            "Nothing.\n".to_owned()
        } else {
            format!(
                "| case | figure | backend | measured | bound | of |\n| --- | --- | --- | --: | --: | --: |\n{failing}"
            )
        };
        Ok(format!(
            "# Hard cases\n\n\
             This page measures inputs that are known to be difficult for ray tracers. Of {} figures with a bound, {} \
             are within the bound. Of the naive tracer's {} figures, {} are within the bound.\n\n\
             Written by `cargo run --release -p rayfold-bench -- accuracy --hard-cases`, which measures every backend: \
             the plain `f64` tracer (`reference`), and packets in each precision and vector width, with a tree and in \
             other tiles. `{naive}` is a tracer with textbook formulas and an absolute epsilon, for comparison. The \
             bounds of the others apply to it, even those that are not promised for single precision. An oracle that \
             computes with 640 bits defines the right results. `tests/hard_cases.rs` checks every backend except the \
             naive one against the same bounds at quick sizes, with the seed {SEED}. All figures, including those \
             without a bound, are in [hard-cases/](hard-cases/), one file per case.\n\n\
             {}## Requirements and results\n\n\
             A figure is the worst of its samples, or a count. The largest figure of a case is shown as a share of its \
             bound, or as a count if the bound is 0.\n\n\
             {table}\n\
             ## Figures beyond their bounds\n\n\
             {failing}",
            ours.bounded,
            ours.hold,
            theirs.bounded,
            theirs.hold,
            self.measured()?
        ))
    }

    /// Returns a paragraph per revision with the cases that were measured at it.
    fn measured(&self) -> Result<String> {
        let mut text = String::new();
        let mut runs: &[Run] = &self.runs;
        while let Some(first) = runs.first() {
            let key = |run: &Run| (run.revision.clone(), run.date.clone(), run.size);
            let alike = runs.iter().take_while(|run| key(run) == key(first)).count();
            let (these, rest) = runs.split_at(alike);
            runs = rest;
            let cases = match these {
                _ if alike == CASES.len() => "All".to_owned(),
                [one] => format!("Case {}", one.case),
                [one, .., last] => format!("Cases {} to {}", one.case, last.case),
                [] => unreachable!("the first is like itself"),
            };
            writeln!(
                text,
                "{cases}: measured at {} size at revision {} of {}, in {:.0} s of elapsed time.\n",
                first.size,
                first.revision,
                first.date,
                these.iter().map(|run| run.seconds).sum::<f64>()
            )?;
        }
        Ok(text)
    }
}

impl Run {
    /// Describes a run of a case that was just measured, with the revision according to git.
    pub fn now(case: &Case, size: Size, seconds: f64) -> Self {
        let git = |args: &[&str]| {
            let output = std::process::Command::new("git").args(args).output().ok()?;
            let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
            (output.status.success() && !text.is_empty()).then_some(text)
        };
        let told = |text: Option<String>| text.unwrap_or_else(|| "unknown".to_owned());
        Self {
            case: case.number.to_owned(),
            size,
            seconds: (10.0 * seconds).round() / 10.0,
            revision: told(git(&["describe", "--always", "--dirty"])),
            date: told(git(&["log", "-1", "--format=%cs"])),
        }
    }
}

/// The number of figures with a bound, the number of those within it, and the worst of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tally {
    bounded: usize,
    hold: usize,
    worst: Worst,
}

/// The figure that exceeds its bound most, or is nearest to it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Worst {
    /// The largest of the figures with a bound above 0, divided by its bound.
    share: Option<f64>,
    /// The largest of the figures whose bound is 0.
    count: Option<f64>,
}

impl Tally {
    fn of(figures: &[Figure]) -> Self {
        let mut tally = Self::default();
        for figure in figures {
            let Some(bound) = figure.bound else { continue };
            tally.bounded += 1;
            tally.hold += usize::from(figure.passes());
            // NaN exceeds every bound.
            let measured = if figure.measured.is_nan() { f64::INFINITY } else { figure.measured };
            let (worst, reached) = if bound > 0.0 {
                (&mut tally.worst.share, measured / bound)
            } else {
                (&mut tally.worst.count, measured)
            };
            *worst = Some(worst.map_or(reached, |worst| worst.max(reached)));
        }
        tally
    }

    fn add(&mut self, other: &Self) {
        self.bounded += other.bounded;
        self.hold += other.hold;
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { bounded, hold, .. } = self;
        if *bounded == 0 {
            f.write_str("–")
        } else if hold == bounded {
            write!(f, "all {bounded}")
        } else {
            write!(f, "**{hold} of {bounded}**")
        }
    }
}

impl std::fmt::Display for Worst {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let share = self.share.map(|share| match share {
            0.0..100.0 => format!("{share:.2}"),
            share => format!("{share:.1e}"),
        });
        let count =
            self.count.map(|count| if count == 0.0 { "none".to_owned() } else { format!("{count} found") });
        let both: Vec<String> = share.into_iter().chain(count).collect();
        f.write_str(&if both.is_empty() { "–".to_owned() } else { both.join("; ") })
    }
}

/// Returns a figure with the bound of other figures of the same quantity if it has none.
fn bounded(figure: Figure, others: &[Figure]) -> Figure {
    // The text ends with the seeds at which a backend failed.
    let same = |what: &str| what.split(", seeds").next().map(str::to_owned);
    let alike = others.iter().filter(|other| same(&other.what) == same(&figure.what));
    let bound = figure.bound.or_else(|| alike.filter_map(|other| other.bound).reduce(f64::max));
    Figure { bound, ..figure }
}

fn runs_file(folder: &Path) -> PathBuf {
    folder.join("runs.csv")
}

fn case_file(folder: &Path, number: &str) -> PathBuf {
    folder.join(format!("case-{number}.csv"))
}

fn rows<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Vec<T>> {
    let shown = || path.display().to_string();
    let mut reader = csv::Reader::from_path(path).with_context(shown)?;
    reader.deserialize().collect::<Result<_, _>>().with_context(shown)
}

fn write_rows<T: Serialize>(path: &Path, rows: &[T]) -> Result<()> {
    let shown = || path.display().to_string();
    let mut writer = csv::Writer::from_path(path).with_context(shown)?;
    for row in rows {
        writer.serialize(row).with_context(shown)?;
    }
    writer.flush().with_context(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(backend: &str, what: &str, measured: f64, bound: Option<f64>) -> Figure {
        Figure { backend: backend.into(), what: what.into(), samples: 7, measured, bound }
    }

    fn run(case: &str, size: Size) -> Run {
        Run { case: case.into(), size, seconds: 1.5, revision: "abc".into(), date: "2026-01-02".into() }
    }

    #[test]
    fn a_page_counts_what_holds_and_names_what_does_not() {
        let mut report = Report::default();
        let figures = vec![
            figure("reference", "t, ulp", 2.0, Some(16.0)),
            figure("f64", "t, ulp", 32.0, Some(16.0)),
            figure("f32", "t, ulp", 1e9, None),
            figure("f32", "cracks", f64::NAN, Some(0.0)),
            figure("textbook", "cracks", 12.0, Some(0.0)),
            figure("textbook", "t, ulp, seeds 1 2", 1.6, None),
        ];
        report.add(run("12", Size::Full), figures);
        report.add(run("4", Size::Full), vec![figure("f64", "NaN", 0.0, Some(0.0))]);
        let page = report.page("textbook").unwrap();
        assert!(
            page.contains(
                "Of 4 figures with a bound, 2 are within the bound. \
                 Of the naive tracer's 2 figures, 1 are within the bound."
            ),
            "{page}"
        );
        let row =
            |number: &str| page.lines().find(|line| line.starts_with(&format!("| {number} | **"))).unwrap();
        assert!(
            row("12").ends_with("| **1 of 3** | 2.00; inf found | **1 of 2** | 0.10; 12 found |"),
            "{page}"
        );
        assert!(row("4").ends_with("| all 1 | none | – | – |"), "{page}");
        assert!(row("10").ends_with("| not measured | | | |"), "{page}");
        assert!(
            page.contains("| 12 a needle triangle 1e6 : 1 | t, ulp | f64 | 3.20e1 | 1.6e1 | 7 |"),
            "{page}"
        );
        assert!(page.contains("| 12 a needle triangle 1e6 : 1 | cracks | f32 | NaN | 0.0e0 | 7 |"), "{page}");
        assert!(
            page.contains("Cases 4 to 12: measured at full size at revision abc of 2026-01-02, in 3 s"),
            "{page}"
        );
    }

    #[test]
    fn what_is_written_reads_back_and_a_case_measured_anew_takes_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let mut report = Report::read(&folder.path().join("none")).unwrap();
        let odd = figure("f32 robust", "at [1, -2], \"wrong\"\nor not, ulp", 0.1 + 0.2, None);
        report.add(run("10", Size::Full), vec![odd, figure("f64", "NaN", f64::NAN, Some(1e-300))]);
        report.add(run("9", Size::Quick), vec![]);
        report.write(folder.path()).unwrap();
        let mut again = Report::read(folder.path()).unwrap();
        assert_eq!(format!("{again:?}"), format!("{report:?}"));
        assert_eq!(again.runs.iter().map(|run| run.case.as_str()).collect::<Vec<_>>(), ["9", "10"]);
        again.add(run("10", Size::Quick), vec![]);
        assert_eq!((again.runs.len(), again.runs[1].size, again.figures[1].len()), (2, Size::Quick, 0));
    }

    #[test]
    fn the_page_in_the_documentation_is_that_of_its_files() {
        let reports = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reports");
        let page = std::fs::read_to_string(reports.join("hard-cases.md")).unwrap();
        let report = Report::read(&reports.join("hard-cases")).unwrap();
        assert_eq!(report.runs.len(), CASES.len(), "a case was not measured");
        assert_eq!(report.page(crate::accuracy::NAIVE).unwrap(), page);
    }
}
