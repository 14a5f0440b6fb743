//! The progress of a long run: a bar on a terminal, a plain line now and then elsewhere.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use rayfold_tracer::Progress as Drawn;

use crate::console::Console;

/// The time between two plain lines.
const LINES_APART: Duration = Duration::from_secs(5);

/// The rate is measured over this time, and over a minimum number of things. So a stall is soon forgotten, and one slow
/// frame does not determine the rate.
const RECENT: Duration = Duration::from_secs(15);
const RECENT_COUNT: u64 = 8;

/// The time between two moments that are recorded.
const MARKS_APART: Duration = Duration::from_millis(100);

/// The time between two looks at a frame that is being drawn.
const LOOKS_APART: Duration = Duration::from_millis(100);

/// The number of columns of a terminal that does not report it.
const USUAL_COLUMNS: usize = 80;

/// The number of columns of the bar if there is room, and the minimum that shows anything.
const BAR: usize = 40;
const SHORTEST_BAR: usize = 8;

/// The unit that is counted.
#[derive(Clone, Copy, Debug)]
enum Unit {
    /// Things with a name in the plural.
    Each(&'static str),
    /// The work of one frame, shown in percent.
    Frame,
}

/// Counts things of one kind, of which the total is known, or the work of a single frame.
#[derive(Debug)]
pub(crate) struct Progress {
    unit: Unit,
    total: AtomicU64,
    /// The work of the frame, if there is only one.
    drawn: Option<Drawn>,
    start: Instant,
    recent: Arc<Mutex<Recent>>,
    shown: Shown,
}

#[derive(Debug)]
enum Shown {
    Bar(ProgressBar),
    Lines { last: Mutex<Instant> },
    Nothing,
}

impl Progress {
    /// Starts the progress of `total` things that are called `of`, in the plural; 0 if the total is not known.
    pub(crate) fn start(console: &Console, of: &'static str, total: u64) -> Self {
        Self::new(console, Unit::Each(of), total, None)
    }

    /// Counts frames that are drawn here. Of a single frame, shows how much of it is drawn: see [`Self::watch`].
    pub(crate) fn of_frames(console: &Console, total: u64) -> Self {
        if total == 1 {
            Self::new(console, Unit::Frame, 0, Some(Drawn::default()))
        } else {
            Self::start(console, "frames", total)
        }
    }

    fn new(console: &Console, unit: Unit, total: u64, drawn: Option<Drawn>) -> Self {
        let start = Instant::now();
        let recent = Arc::new(Mutex::new(Recent::since(start)));
        let shown = if console.quiet {
            Shown::Nothing
        } else if console.animate {
            Shown::Bar(bar(unit, total, console.color, Arc::clone(&recent)))
        } else {
            Shown::Lines { last: Mutex::new(start) }
        };
        Self { unit, total: AtomicU64::new(total), drawn, start, recent, shown }
    }

    /// Sets another total.
    pub(crate) fn resize(&self, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        if let Shown::Bar(bar) = &self.shown {
            bar.set_length(total);
        }
    }

    /// Sets the number of things that are done. The work of a single frame is set by [`Self::watch`] alone.
    pub(crate) fn set(&self, console: &Console, done: u64) {
        if self.drawn.is_none() {
            self.show(console, done);
        }
    }

    /// Returns the counter of the work of a single frame, for the options of its drawing.
    pub(crate) fn drawn(&self) -> Option<&Drawn> {
        self.drawn.as_ref()
    }

    /// Runs `work`, and shows meanwhile how much of a single frame is drawn.
    pub(crate) fn watch<T>(&self, console: &Console, work: impl FnOnce() -> T) -> T {
        let Some(drawn) = self.drawn() else { return work() };
        let (working, ended) = mpsc::channel::<()>();
        thread::scope(|scope| {
            scope.spawn(move || {
                while ended.recv_timeout(LOOKS_APART) == Err(mpsc::RecvTimeoutError::Timeout) {
                    self.look(console, drawn);
                }
            });
            // Dropped after the work, and if it panics: then the other thread ends.
            let _working = working;
            work()
        })
    }

    fn look(&self, console: &Console, drawn: &Drawn) {
        let (done, total) = drawn.get();
        self.resize(total);
        self.show(console, done);
    }

    fn show(&self, console: &Console, done: u64) {
        let total = self.total.load(Ordering::Relaxed);
        let now = Instant::now();
        let rate = {
            let mut recent = lock(&self.recent);
            recent.add(now, done);
            recent.rate(now)
        };
        match &self.shown {
            Shown::Bar(bar) => bar.set_position(done),
            Shown::Lines { last } if done < total => {
                let mut last = lock(last);
                if last.elapsed() >= LINES_APART {
                    *last = now;
                    console.note(words(self.unit, done, total, pace(rate, total - done)));
                }
            }
            Shown::Lines { .. } | Shown::Nothing => {}
        }
    }

    /// Removes the bar and returns the time since the start.
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

/// The number of things that were done, and when.
#[derive(Debug)]
struct Recent(VecDeque<(Instant, u64)>);

impl Recent {
    fn since(start: Instant) -> Self {
        Self(VecDeque::from([(start, 0)]))
    }

    fn add(&mut self, now: Instant, done: u64) {
        let before_last = self.0.len().checked_sub(2).and_then(|i| self.0.get(i));
        if before_last.is_some_and(|(then, _)| now.duration_since(*then) < MARKS_APART) {
            self.0.pop_back();
        }
        self.0.push_back((now, done));
        let is_old = |(then, count): &(Instant, u64)| {
            now.duration_since(*then) >= RECENT && done.saturating_sub(*count) >= RECENT_COUNT
        };
        while self.0.get(1).is_some_and(is_old) {
            self.0.pop_front();
        }
    }

    /// Returns the rate in things per second.
    fn rate(&self, now: Instant) -> f64 {
        let (Some((then, before)), Some((_, done))) = (self.0.front(), self.0.back()) else { return 0.0 };
        done.saturating_sub(*before) as f64 / now.duration_since(*then).as_secs_f64()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn bar(unit: Unit, total: u64, color: bool, recent: Arc<Mutex<Recent>>) -> ProgressBar {
    let draw = move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        let columns = terminal_size::terminal_size_of(std::io::stderr());
        let columns = columns.map_or(USUAL_COLUMNS, |(columns, _)| columns.0.into());
        let (done, total) = (state.pos(), state.len().unwrap_or(total));
        let rate = lock(&recent).rate(Instant::now());
        let _ =
            out.write_str(&line(columns, unit, done, total, pace(rate, total.saturating_sub(done)), color));
    };
    let style = ProgressStyle::with_template("{line}").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr())
        .with_style(style.with_key("line", draw));
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// The rate, in things per second, and the remaining time.
type Pace = Option<(f64, Duration)>;

/// Returns `None` as long as nothing is done. `left` is the number of things that are not done.
fn pace(rate: f64, left: u64) -> Pace {
    let is_known = rate.is_finite() && rate > 0.0;
    is_known.then(|| (rate, Duration::try_from_secs_f64(left as f64 / rate).unwrap_or_default()))
}

/// Returns the parts that fit on one line of `columns` columns: the counts, what is left, the rate, and a bar.
fn line(columns: usize, unit: Unit, done: u64, total: u64, pace: Pace, color: bool) -> String {
    // In the last column some terminals wrap already.
    let room = columns.saturating_sub(1);
    let pace = pace.filter(|_| done > 0 && done < total);
    let left = pace.map_or(String::new(), |(_, left)| remaining(left));
    let candidates = [
        words(unit, done, total, pace),
        format!("{}{left}", count(unit, done, total)),
        count(unit, done, total),
        match unit {
            Unit::Each(_) => format!("{done}/{total}"),
            Unit::Frame => percent(done, total),
        },
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

/// Returns `12 of 30 frames`, or `40 % of the frame`; a total of 0 is unknown.
fn count(unit: Unit, done: u64, total: u64) -> String {
    match unit {
        Unit::Each(of) if total == 0 => format!("{done} {of}"),
        Unit::Each(of) => format!("{done} of {total} {of}"),
        Unit::Frame => format!("{} of the frame", percent(done, total)),
    }
}

/// Returns percent, rounded down: 100 % is the end.
fn percent(done: u64, total: u64) -> String {
    format!("{} %", (u128::from(done) * 100).checked_div(u128::from(total)).unwrap_or(0))
}

/// Returns `12 of 30 frames, 8.7 a second, 3 s left`, or `40 % of the frame, 3 s left`.
fn words(unit: Unit, done: u64, total: u64, pace: Pace) -> String {
    let mut text = count(unit, done, total);
    let Some((rate, left)) = pace else { return text };
    if matches!(unit, Unit::Each(_)) {
        let (rate, unit) = if rate >= 1.0 { (rate, "second") } else { (60.0 * rate, "minute") };
        let places = usize::from(rate < 10.0);
        // Writing to a String cannot fail.
        let _ = write!(text, ", {rate:.places$} a {unit}");
    }
    text + &remaining(left)
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

    const FRAMES: Unit = Unit::Each("frames");

    const PACE: Pace = Some((86.7842, Duration::from_secs(3)));

    #[test]
    fn progress_never_wraps() {
        for columns in 1..=200 {
            for unit in [Unit::Each("frames"), Unit::Each("scripts uploaded"), Unit::Frame] {
                for (done, total) in [(0, 30), (12, 30), (30, 30), (99_999, 100_000)] {
                    let shown = line(columns, unit, done, total, PACE, false);
                    assert!(shown.chars().count() < columns, "{columns}: {shown}");
                }
            }
        }
        assert_eq!(line(40, FRAMES, 12, 30, PACE, false), "12 of 30 frames, 87 a second, 3 s left");
        assert_eq!(
            line(40, Unit::Each("scripts uploaded"), 12, 30, PACE, false),
            "12 of 30 scripts uploaded, 3 s left"
        );
        assert_eq!(
            line(80, FRAMES, 12, 30, PACE, false),
            format!("{}{}  12 of 30 frames, 87 a second, 3 s left", "━".repeat(15), "─".repeat(24))
        );
    }

    #[test]
    fn nothing_is_said_of_a_pace_before_there_is_one() {
        let shown = line(80, FRAMES, 0, 30, pace(0.0, 30), false);
        assert_eq!(shown, format!("{}  0 of 30 frames", "─".repeat(40)));
        assert_eq!(pace(f64::NAN, 30), None);
        assert!(line(80, FRAMES, 30, 30, PACE, false).ends_with("━  30 of 30 frames"));
    }

    #[test]
    fn a_stall_is_forgotten() {
        let start = Instant::now();
        let at = |seconds: f64| start + Duration::from_secs_f64(seconds);
        let mut recent = Recent::since(start);
        (1..=100).for_each(|n| recent.add(at(n as f64), n));
        assert_eq!(recent.rate(at(100.0)), 1.0);
        // Asleep for an hour, then as fast as before.
        (101..=130).for_each(|n| recent.add(at(3_600.0 + n as f64), n));
        assert_eq!(recent.rate(at(3_730.0)), 1.0);
        assert!(recent.0.len() < 20, "{}", recent.0.len());
        // Slow things count by their number.
        (131..=140).for_each(|n| recent.add(at(3_730.0 + 60.0 * (n - 130) as f64), n));
        assert!((recent.rate(at(4_330.0)) - 1.0 / 60.0).abs() < 1e-9, "{}", recent.rate(at(4_330.0)));
    }

    #[test]
    fn paces_are_rounded() {
        let shown = |rate, left| words(FRAMES, 1, 2, Some((rate, Duration::from_secs(left))));
        assert_eq!(
            words(FRAMES, 1, 2, Some((20.0, Duration::from_millis(2)))),
            "1 of 2 frames, 20 a second, 1 s left"
        );
        assert_eq!(shown(8.66, 59), "1 of 2 frames, 8.7 a second, 59 s left");
        assert_eq!(shown(0.05, 61), "1 of 2 frames, 3.0 a minute, 2 min left");
        assert_eq!(shown(12.5, 7_265), "1 of 2 frames, 12 a second, 2 h 1 min left");
    }

    #[test]
    fn a_single_frame_is_shown_in_percent() {
        assert_eq!(words(Unit::Frame, 0, 0, None), "0 % of the frame");
        assert_eq!(words(Unit::Frame, 799, 800, PACE), "99 % of the frame, 3 s left");
        assert_eq!(count(Unit::Frame, u64::MAX, u64::MAX), "100 % of the frame");
        assert_eq!(line(9, Unit::Frame, 1, 4, PACE, false), "25 %");
    }

    #[test]
    fn the_work_of_a_single_frame_is_watched_while_it_is_drawn() {
        let console = Console { quiet: true, color: false, animate: false };
        let script = "Screen 64 64\nSamples 4096 0\nSphere 1 0 0 0 1 1 1 0 0 0\nTrace\n";
        let parsed = rayfold_scene::parse("a.txt", script.as_bytes(), &rayfold_scene::Limits::default());
        let scene = parsed.script.unwrap().frame(0).unwrap();
        let progress = Progress::of_frames(&console, 1);
        let options = rayfold_tracer::RenderOptions { progress: progress.drawn(), ..Default::default() };
        let seen = || progress.total.load(Ordering::Relaxed);
        progress.watch(&console, || {
            // The other thread looks at least once while this one works.
            while seen() == 0 {
                rayfold_tracer::render(&scene, &options).unwrap();
            }
        });
        assert_eq!(seen(), 4096 * 64 * 64);
        // The count of frames does not disturb the work.
        let counted = |progress: &Progress| lock(&progress.recent).0.back().map(|(_, done)| *done);
        let before = counted(&progress);
        progress.set(&console, 1);
        assert_eq!(counted(&progress), before);
        let many = Progress::of_frames(&console, 2);
        assert!(many.drawn().is_none());
        many.watch(&console, || many.set(&console, 1));
        assert_eq!(counted(&many), Some(1));
    }
}
