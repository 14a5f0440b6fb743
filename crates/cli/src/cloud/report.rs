//! The content of a manifest, as text for people.

use rayfold_client::{Obstacle, obstacles};
use rayfold_pipeline::manifest::{Manifest, Rejected};

use crate::console::Console;
use crate::wording::number;

/// Returns a text such as `48 of 50 frames, 2 failed`.
pub(crate) fn count(manifest: &Manifest) -> String {
    let head = &manifest.head;
    let mut text = format!("{} of {}", head.done, number(head.total + head.not_uploaded(), "frame"));
    if head.failed > 0 {
        text += &format!(", {} failed", head.failed);
    }
    if head.waiting > 0 {
        text += &format!(", {} waiting for files", head.waiting);
    }
    text
}

/// Shows everything that keeps the animation from being done, and the files that are not read because of their names.
pub(crate) fn show_faults(manifest: &Manifest, console: &Console) {
    for Rejected { key, problem } in &manifest.head.warnings {
        console.warn(format_args!("{key}: not read: {problem}"));
    }
    for rejected in &manifest.head.rejected {
        console.fault(&rejected.key, &rejected.problem);
    }
    for Obstacle { what, reason } in obstacles(manifest) {
        let Some(reason) = reason else {
            console.fault(&what, "no reason is known yet");
            continue;
        };
        if reason.diagnostics.is_empty() {
            console.fault(&what, &reason.message);
        }
        for diagnostic in &reason.diagnostics {
            console.say(format_args!("{}\n", diagnostic.render(console.color)));
        }
        if reason.omitted > 0 {
            console.fault(&what, &number(reason.omitted as u64, "more error"));
        }
    }
}
