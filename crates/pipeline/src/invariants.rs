//! The invariants of a manifest, checked before each write of one. A broken rule is a bug here, not bad input: the
//! write is refused, the invocation fails, and the bucket stays as it was.

use std::collections::BTreeSet;

use crate::manifest::{Fault, FrameState, Manifest, SCHEMA, Status};
use crate::{Error, Result};

/// The name of a rule, and a function that returns whether a manifest satisfies it, given its predecessor.
type Rule = (&'static str, fn(&Manifest, Option<&Manifest>) -> bool);

const RULES: &[Rule] = &[
    ("the revision is the predecessor's plus one", revision_follows),
    ("the animation is the predecessor's", same_animation),
    ("the writer is named", writer_is_named),
    ("the counts are those of the frames", counts_are_true),
    ("no frame comes twice", frames_are_unique),
    ("a split script's parts are all there, in order", parts_are_whole),
    ("the status follows from the frames", status_follows),
    ("whatever is failed for good has its reason", reasons_are_there),
    ("settings have either a value or a fault", settings_are_either),
    ("the schema is the current one", schema_is_current),
];

/// Checks all rules for a manifest that is about to replace `before`.
///
/// # Errors
///
/// [`Error::Invariant`] with the first rule that does not hold.
pub fn check(next: &Manifest, before: Option<&Manifest>) -> Result<()> {
    match RULES.iter().find(|(_, holds)| !holds(next, before)) {
        None => Ok(()),
        Some((rule, _)) => Err(Error::Invariant { animation: next.head.animation.to_string(), rule }),
    }
}

fn revision_follows(next: &Manifest, before: Option<&Manifest>) -> bool {
    next.head.revision == before.map_or(0, |manifest| manifest.head.revision) + 1
}

fn same_animation(next: &Manifest, before: Option<&Manifest>) -> bool {
    before.is_none_or(|before| before.head.animation == next.head.animation)
}

fn writer_is_named(next: &Manifest, _: Option<&Manifest>) -> bool {
    !next.head.writer.is_empty()
}

fn schema_is_current(next: &Manifest, _: Option<&Manifest>) -> bool {
    next.head.schema == SCHEMA
}

fn counts_are_true(next: &Manifest, _: Option<&Manifest>) -> bool {
    let count =
        |wanted: fn(&FrameState) -> bool| next.frames.iter().filter(|f| wanted(&f.state)).count() as u64;
    let scripts: BTreeSet<_> = next.frames.iter().map(|frame| &frame.script).collect();
    let head = &next.head;
    head.total == next.frames.len() as u64
        && head.done == count(|state| matches!(state, FrameState::Done { .. }))
        && head.pending == count(|state| matches!(state, FrameState::Pending))
        && head.waiting == count(|state| matches!(state, FrameState::Waiting(_)))
        && head.failed == count(|state| matches!(state, FrameState::Failed(_)))
        && head.scripts == scripts.len() as u64
}

fn frames_are_unique(next: &Manifest, _: Option<&Manifest>) -> bool {
    let mut seen = BTreeSet::new();
    next.frames.iter().all(|frame| seen.insert((&frame.script, frame.part)))
}

/// Each script has one frame without a number, or frames that are numbered from 1 without a gap.
fn parts_are_whole(next: &Manifest, _: Option<&Manifest>) -> bool {
    next.frames.iter().enumerate().all(|(place, frame)| {
        let before = place.checked_sub(1).map(|place| &next.frames[place]);
        let follows = before.filter(|before| before.script == frame.script);
        match (frame.part, follows) {
            (None, follows) => follows.is_none(),
            (Some(number), None) => number.get() == 1,
            (Some(number), Some(before)) => {
                before.version == frame.version
                    && before.part.is_some_and(|part| part.get() + 1 == number.get())
            }
        }
    })
}

fn status_follows(next: &Manifest, _: Option<&Manifest>) -> bool {
    let head = &next.head;
    let expected = head.settings.value.as_ref().and_then(|settings| settings.frames()).unwrap_or(0);
    let sound = head.failed == 0 && head.settings.value.is_some() && head.rejected.is_empty();
    let complete = head.total > 0 && head.pending == 0 && head.waiting == 0 && head.total >= expected;
    if head.excess.is_some() {
        return head.status == Status::Failed && head.total > 0;
    }
    match head.status {
        Status::Empty => head.total == 0 && head.rejected.is_empty(),
        Status::Waiting => head.total < expected || head.pending == 0 && head.waiting > 0,
        Status::Rendering => head.pending > 0,
        Status::Failed => head.pending == 0 && head.waiting == 0 && head.total >= expected && !sound,
        Status::Refused => complete && sound && head.refusal.is_some(),
        Status::Done => complete && sound && head.refusal.is_none(),
    }
}

fn reasons_are_there(next: &Manifest, _: Option<&Manifest>) -> bool {
    let has_reason = |fault: &Fault| fault.reason.is_some();
    let frames = next.frames.iter().all(|frame| match &frame.state {
        FrameState::Failed(fault) => has_reason(fault),
        _ => true,
    });
    !next.head.is_terminal() || (frames && next.head.refusal.as_ref().is_none_or(has_reason))
}

fn settings_are_either(next: &Manifest, _: Option<&Manifest>) -> bool {
    next.head.settings.value.is_some() != next.head.settings.fault.is_some()
}

#[cfg(test)]
mod tests;
