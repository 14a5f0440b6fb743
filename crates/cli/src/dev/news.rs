//! The lines that `rayfold dev` prints while it runs: each event as it ends, and the progress of each animation.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rayfold_local::observation::{Observation, Outcome, Seen};
use rayfold_pipeline::keys::{Animation, Key};
use rayfold_pipeline::manifest::{FrameState, Manifest, Status};
use rayfold_pipeline::store::{S3Store, Store};
use rayfold_scene::SETTINGS_FILE;
use serde_json::Value;

use crate::console::Console;

/// The time between two looks at the manifests of animations in which something happened.
const APART: Duration = Duration::from_millis(500);

/// Prints the events of a run.
pub(crate) struct News<'a> {
    console: &'a Console,
    store: &'a S3Store,
    changed: BTreeSet<Animation>,
    reported: Vec<(Animation, String)>,
    next: Instant,
    /// Whether only problems are printed.
    is_brief: bool,
}

impl<'a> News<'a> {
    pub(crate) fn new(console: &'a Console, store: &'a S3Store) -> Self {
        let (changed, reported, next) = (BTreeSet::new(), Vec::new(), Instant::now());
        Self { console, store, changed, reported, next, is_brief: false }
    }

    /// Prints only problems: the progress of an animation is printed elsewhere.
    pub(crate) fn brief(console: &'a Console, store: &'a S3Store) -> Self {
        Self { is_brief: true, ..Self::new(console, store) }
    }

    /// Returns the time of the next look at the changed animations, or never if none has changed.
    pub(crate) async fn tick(&self) {
        if self.changed.is_empty() {
            std::future::pending::<()>().await;
        }
        tokio::time::sleep_until(self.next.into()).await;
    }

    /// Prints an observation.
    pub(crate) fn hear(&mut self, observation: &Observation) {
        match &observation.seen {
            Seen::Log { line, .. } => match serde_json::from_str(line) {
                Ok(line) => self.hear_log(&line),
                Err(_) => self.console.note(line),
            },
            Seen::Finished { attempt, outcome, .. } => match outcome {
                Outcome::Crashed(how) => self.console.note(format_args!(
                    "{}: process {} ended ({how}) in attempt {}",
                    attempt.function, attempt.pid, attempt.number
                )),
                Outcome::TimedOut => self.console.note(format_args!(
                    "{}: killed at its deadline in attempt {}",
                    attempt.function, attempt.number
                )),
                Outcome::Succeeded(_) | Outcome::Failed(_) => {}
            },
            Seen::DeadLetter { body } => self.console.note(format_args!("given up: {body}")),
            Seen::Joined { invoker } => {
                self.console.note(format_args!("invoker {invoker} shares the work"));
            }
            Seen::Lost { invoker } => {
                self.console.note(format_args!("invoker {invoker} has gone; its work is taken over"));
            }
            Seen::Event { .. } | Seen::Started(_) | Seen::Requested { .. } => {}
        }
    }

    fn hear_log(&mut self, line: &Value) {
        let text = |field: &str| line[field].as_str().unwrap_or_default();
        if let Ok(animation) = Animation::new(text("animation")) {
            if self.changed.is_empty() {
                self.next = Instant::now() + APART;
            }
            self.changed.insert(animation);
        }
        match text("message") {
            "rendered" | "assembled" if self.is_brief => {}
            "rendered" => self.console.note(rendered(line)),
            "assembled" if line["built"].as_u64() > Some(0) => self.console.note(format_args!(
                "{0}: {1} frames assembled in {2} ms: s3://{3}/animations/{0}.gif",
                text("animation"),
                line["frames"],
                line["building_ms"],
                self.store.bucket(),
            )),
            _ => {
                if let Some(trouble) = trouble(line) {
                    self.console.note(trouble);
                }
            }
        }
    }

    /// Prints the progress of the animations in which something happened.
    pub(crate) async fn look(&mut self) {
        for animation in std::mem::take(&mut self.changed) {
            let Ok(object) = self.store.get(&animation.manifest()).await else { continue };
            let Ok(manifest) = Manifest::decode(&animation, &object.body) else { continue };
            let text = state(&manifest);
            self.reported.retain(|(of, last)| *of != animation || *last == text);
            if !self.reported.iter().any(|(of, _)| *of == animation) {
                self.console.note(&text);
                self.reported.push((animation, text));
            }
        }
        self.next = Instant::now() + APART;
    }
}

/// Returns the text of an event of the render function: the frame that it was about, or the file.
fn rendered(line: &Value) -> String {
    let text = |field: &str| line[field].as_str().unwrap_or_default();
    let (animation, key, outcome) = (text("animation"), text("key"), text("outcome"));
    let part = match key.parse() {
        Ok(Key::Part { number, .. }) => Some(number),
        Ok(Key::Band { part, .. } | Key::Retry { part, .. }) => part,
        _ => None,
    };
    let name = match (text("frame"), part) {
        ("", _) => key.rsplit('/').next().unwrap_or_default().to_owned(),
        (script, Some(part)) => format!("{script}, frame {part}"),
        (script, None) => script.to_owned(),
    };
    let took = line["draw_ms"].as_u64().filter(|_| outcome == "drawn");
    let took = took.map(|ms| format!(" in {ms} ms")).unwrap_or_default();
    format!("{animation}/{name}: {outcome}{took}")
}

/// Returns the text of a warning or an error in a function's log, with its subject and its reason.
fn trouble(line: &Value) -> Option<String> {
    let text = |field: &str| line[field].as_str().unwrap_or_default();
    let (level, message) = (text("level"), text("message"));
    // The runtime repeats in Rust's words an error that the function has logged in its own.
    if !matches!(level, "ERROR" | "WARN") || message.starts_with("Failed([") {
        return None;
    }
    let about = format!("{} {}{}", level.to_lowercase(), text("animation"), text("key"));
    let parts = [about.trim_end(), message, text("problem"), text("error")];
    Some(parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": "))
}

fn state(manifest: &Manifest) -> String {
    let head = &manifest.head;
    let (name, done, total) = (&head.animation, head.done, head.total);
    match head.status {
        Status::Empty => format!("{name}: no scripts"),
        Status::Waiting => {
            let mut waits = manifest.frames.iter().filter_map(|frame| match &frame.state {
                FrameState::Waiting(fault) => fault.reason.as_ref(),
                _ => None,
            });
            if let Some(reason) = waits.next() {
                return format!("{name}: waiting ({done} of {total}): {}", reason.message);
            }
            let wanted = head.settings.value.as_ref().and_then(|settings| settings.frames());
            format!("{name}: waiting ({done} of {})", wanted.unwrap_or(total))
        }
        Status::Rendering => format!("{name}: {done} of {total} frames drawn"),
        Status::Done => format!("{name}: all {total} frames drawn"),
        Status::Refused => format!("{name}: cannot be assembled"),
        Status::Failed => {
            let mut text = format!("{name}: failed");
            if let Some(fault) = &head.settings.fault {
                text.push_str(&format!("\n  {SETTINGS_FILE}: {}", fault.message));
            }
            for frame in &manifest.frames {
                if let FrameState::Failed(fault) = &frame.state {
                    let why = fault.reason.as_ref().map_or("", |reason| reason.message.as_str());
                    text.push_str(&format!("\n  {}: {why}", frame.script));
                }
            }
            text
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// An event of a file that scripts name was reported as one of `animation.json`.
    #[test]
    fn events_name_the_file_or_the_frame_that_they_are_about() {
        for (key, frame, outcome, expected) in [
            ("scripts/film/ball.obj", None, "a file of scripts", "film/ball.obj: a file of scripts"),
            ("scripts/film/animation.json", None, "settings", "film/animation.json: settings"),
            ("scripts/film/1.txt", Some("1"), "drawn", "film/1: drawn in 7 ms"),
            ("parts/film/1@e-p1/12.json", Some("1"), "drawn", "film/1, frame 12: drawn in 7 ms"),
            ("parts/film/1@e-p1/2-of-3.band-0.json", Some("1"), "band 2-of-3", "film/1: band 2-of-3"),
            ("parts/film/1@e-p1/files.json", Some("1"), "split into 2", "film/1: split into 2"),
            ("retries/film/1@e-p1/1", Some("1"), "present", "film/1: present"),
            ("retries/film/1@e-p1/12/1", Some("1"), "present", "film/1, frame 12: present"),
        ] {
            let line = json!({
                "animation": "film", "key": key, "frame": frame, "outcome": outcome, "draw_ms": 7,
            });
            assert_eq!(rendered(&line), expected);
        }
    }

    #[test]
    fn faults_are_reported_once_and_in_words() {
        let rejected = json!({
            "level": "WARN", "message": "no script", "key": "scripts/../0.txt", "problem": "`..` is no name",
        });
        assert_eq!(trouble(&rejected).unwrap(), "warn scripts/../0.txt: no script: `..` is no name");
        let failed = json!({
            "level": "ERROR", "message": "failed", "key": "scripts/a/0.txt", "error": "timed out: reset",
        });
        assert_eq!(trouble(&failed).unwrap(), "error scripts/a/0.txt: failed: timed out: reset");
        let sweep = json!({ "level": "ERROR", "message": "sweep failed", "error": "timed out" });
        assert_eq!(trouble(&sweep).unwrap(), "error: sweep failed: timed out");
        let again = "Failed([(\"scripts/a/0.txt\", Ambiguous { key: \"k\", source: \"reset\" })])";
        assert_eq!(trouble(&json!({ "level": "ERROR", "message": again })), None);
        assert_eq!(trouble(&json!({ "level": "INFO", "message": "drawn" })), None);
    }
}
