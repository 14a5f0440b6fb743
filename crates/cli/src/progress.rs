//! How far a long run has come: a bar on a terminal, a plain line now and then elsewhere.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::console::Console;

/// Between two plain lines.
const LINES_APART: Duration = Duration::from_secs(5);

/// Columns of a terminal that does not say how many it has.
const USUAL_COLUMNS: usize = 80;

/// Columns of the bar where there is room, and the fewest that show anything.
const BAR: usize = 40;
const SHORTEST_BAR: usize = 8;

/// Counts things of one kind, of which the total is known.
#[derive(Debug)]
pub(crate) struct Progress {
    of: &'static str,
    total: u64,
    done: u64,
    start: Instant,
    shown: Shown,
}

#[derive(Debug)]
enum Shown {
    Bar(ProgressBar),
    Lines { last: Instant },
    Nothing,
}

impl Progress {
    /// Of `total` things that are called `of`, in the plural.
    pub(crate) fn start(console: &Console, of: &'static str, total: u64) -> Self {
        let start = Instant::now();
        let shown = if console.quiet {
            Shown::Nothing
        } else if console.animate {
            Shown::Bar(bar(of, total, console.color))
        } else {
            Shown::Lines { last: start }
        };
        Self { of, total, done: 0, start, shown }
    }

    /// There turn out to be more, or fewer.
    #[cfg(feature = "network")]
    pub(crate) fn resize(&mut self, total: u64) {
        self.total = total;
        if let Shown::Bar(bar) = &self.shown {
            bar.set_length(total);
        }
    }

    /// Sets how many are done.
    pub(crate) fn set(&mut self, console: &Console, done: u64) {
        self.done = done;
        match &mut self.shown {
            Shown::Bar(bar) => bar.set_position(done),
            Shown::Lines { last } if last.elapsed() >= LINES_APART && done < self.total => {
                *last = Instant::now();
                let rate = done as f64 / self.start.elapsed().as_secs_f64();
                let left = Duration::try_from_secs_f64((self.total - done) as f64 / rate).unwrap_or_default();
                console.note(words(self.of, done, self.total, pace(rate, left)));
            }
            Shown::Lines { .. } | Shown::Nothing => {}
        }
    }

    /// Takes the bar away and returns how long it took.
    pub(crate) fn finish(self) -> Duration {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
        self.start.elapsed()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Shown::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
    }
}

fn bar(of: &'static str, total: u64, color: bool) -> ProgressBar {
    let draw = move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        let columns = terminal_size::terminal_size_of(std::io::stderr());
        let columns = columns.map_or(USUAL_COLUMNS, |(columns, _)| columns.0.into());
        let (done, total) = (state.pos(), state.len().unwrap_or(total));
        let _ = out.write_str(&line(columns, of, done, total, pace(state.per_sec(), state.eta()), color));
    };
    let style = ProgressStyle::with_template("{line}").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr())
        .with_style(style.with_key("line", draw));
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// How fast it goes, in things a second, and what is left.
type Pace = Option<(f64, Duration)>;

/// `None` as long as nothing is done.
fn pace(rate: f64, left: Duration) -> Pace {
    (rate.is_finite() && rate > 0.0).then_some((rate, left))
}

/// What there is room for on one line of so many columns: the counts, what is left, how fast it goes, and a bar.
fn line(columns: usize, of: &str, done: u64, total: u64, pace: Pace, color: bool) -> String {
    // In the last column some terminals wrap already.
    let room = columns.saturating_sub(1);
    let pace = pace.filter(|_| done > 0 && done < total);
    let left = pace.map_or(String::new(), |(_, left)| remaining(left));
    let candidates = [
        words(of, done, total, pace),
        format!("{done} of {total} {of}{left}"),
        format!("{done} of {total} {of}"),
        format!("{done}/{total}"),
    ];
    let Some(text) = candidates.into_iter().find(|text| text.len() <= room) else { return String::new() };
    let bar = room.saturating_sub(text.len() + 2).min(BAR);
    if bar < SHORTEST_BAR {
        return text;
    }
    let filled = (bar as u64 * done.min(total)).checked_div(total).unwrap_or(0) as usize;
    let (full, rest) = ("━".repeat(filled), "─".repeat(bar - filled));
    if color {
        format!("\x1b[36m{full}\x1b[0;2m{rest}\x1b[0m  {text}")
    } else {
        format!("{full}{rest}  {text}")
    }
}

/// `12 of 30 frames, 8.7 a second, 3 s left`.
fn words(of: &str, done: u64, total: u64, pace: Pace) -> String {
    let mut text = format!("{done} of {total} {of}");
    if let Some((rate, left)) = pace {
        let (rate, unit) = if rate >= 1.0 { (rate, "second") } else { (60.0 * rate, "minute") };
        let places = usize::from(rate < 10.0);
        // Writing to a String cannot fail.
        let _ = write!(text, ", {rate:.places$} a {unit}{}", remaining(left));
    }
    text
}

fn remaining(left: Duration) -> String {
    // Rounded up: as long as there is something to do, something is left.
    match left.as_secs_f64().ceil() as u64 {
        seconds @ 0..60 => format!(", {seconds} s left"),
        seconds @ 60..3600 => format!(", {} min left", seconds.div_ceil(60)),
        seconds => format!(", {} h {} min left", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Some((86.7842, Duration::from_secs(3)));

    #[test]
    fn progress_never_wraps() {
        for columns in 1..=200 {
            for of in ["frames", "scripts uploaded"] {
                for (done, total) in [(0, 30), (12, 30), (30, 30), (99_999, 100_000)] {
                    let shown = line(columns, of, done, total, PACE, false);
                    assert!(shown.chars().count() < columns, "{columns}: {shown}");
                }
            }
        }
        assert_eq!(line(40, "frames", 12, 30, PACE, false), "12 of 30 frames, 87 a second, 3 s left");
        assert_eq!(line(40, "scripts uploaded", 12, 30, PACE, false), "12 of 30 scripts uploaded, 3 s left");
        assert_eq!(
            line(80, "frames", 12, 30, PACE, false),
            format!("{}{}  12 of 30 frames, 87 a second, 3 s left", "━".repeat(15), "─".repeat(24))
        );
    }

    #[test]
    fn nothing_is_said_of_a_pace_before_there_is_one() {
        let shown = line(80, "frames", 0, 30, pace(0.0, Duration::ZERO), false);
        assert_eq!(shown, format!("{}  0 of 30 frames", "─".repeat(40)));
        assert_eq!(pace(f64::NAN, Duration::ZERO), None);
        assert!(line(80, "frames", 30, 30, PACE, false).ends_with("━  30 of 30 frames"));
    }

    #[test]
    fn paces_are_rounded() {
        let told = |rate, left| words("frames", 1, 2, pace(rate, Duration::from_secs(left)));
        assert_eq!(
            words("frames", 1, 2, pace(20.0, Duration::from_millis(2))),
            "1 of 2 frames, 20 a second, 1 s left"
        );
        assert_eq!(told(8.66, 59), "1 of 2 frames, 8.7 a second, 59 s left");
        assert_eq!(told(0.05, 61), "1 of 2 frames, 3.0 a minute, 2 min left");
        assert_eq!(told(12.5, 7_265), "1 of 2 frames, 12 a second, 2 h 1 min left");
    }
}
