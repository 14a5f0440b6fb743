//! How far a long run has come: a bar on a terminal, a plain line now and then elsewhere.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::console::Console;

/// Between two plain lines.
const LINES_APART: Duration = Duration::from_secs(5);

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
                let left = if done == 0 {
                    String::new()
                } else {
                    format!(", {:.1} s left", (self.total - done) as f64 / rate)
                };
                console.note(format_args!("{done} of {} {} ({rate:.1} a second{left})", self.total, self.of));
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
    let template = if color {
        "{bar:40.cyan/dim} {pos}/{len} {msg}  {per_sec}  {eta} left"
    } else {
        "{bar:40} {pos}/{len} {msg}  {per_sec}  {eta} left"
    };
    let style = ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("━╸─");
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr()).with_style(style);
    bar.set_message(of);
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}
