//! What the page is told of runs, made of manifests: values only.

use rayfold_client::{Watch, obstacles};
use rayfold_pipeline::Clock;
use rayfold_pipeline::keys::{Part, ScriptName};
use rayfold_pipeline::manifest::{Frame, FrameState, Manifest, Reason};
use rayfold_pipeline::store::Store;
use rayfold_scene::Diagnostic;
use serde::Serialize;

use super::sending::SendingTell;

/// Faults that are told one by one.
const FAULTS: usize = 100;

/// A run in a list.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Summary {
    /// Its name, which is its address.
    pub(super) run: String,
    /// A word: that of the manifest, or why there is none.
    pub(super) status: String,
    /// Frames drawn.
    pub(super) done: u64,
    /// Frames that cannot be drawn.
    pub(super) failed: u64,
    /// Of so many.
    pub(super) total: u64,
    /// There are scripts that the functions have not seen.
    pub(super) behind: bool,
    /// Nothing more will happen by itself.
    pub(super) settled: bool,
    /// The GIF that there is.
    pub(super) gif: Option<GifInfo>,
}

/// A GIF in the bucket.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct GifInfo {
    /// Its size.
    pub(super) bytes: u64,
    /// What it is, so that another is another address.
    pub(super) version: String,
    /// It shows the newest scripts.
    pub(super) current: bool,
}

/// A run as a whole; of the frames only what has changed since the last time.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct RunUpdate {
    #[serde(flatten)]
    pub(super) state: RunState,
    /// All frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) frames: Option<Vec<FrameUpdate>>,
    /// Frames that are other than they were, with their places from 0.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) changed: Vec<(usize, FrameUpdate)>,
}

/// How a run stands, without its frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct RunState {
    #[serde(flatten)]
    pub(super) summary: Summary,
    /// What keeps it from being done.
    pub(super) faults: Vec<FaultInfo>,
    /// Faults that are not told.
    pub(super) more_faults: usize,
    /// How far its upload is, if this program sends it.
    pub(super) sending: Option<SendingTell>,
    /// Why nothing newer is known.
    pub(super) problem: Option<String>,
}

/// A frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct FrameUpdate {
    /// Its script.
    pub(super) script: ScriptName,
    /// The script's version.
    pub(super) version: String,
    /// Which of the script's frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) part: Part,
    /// Where it stands.
    pub(super) state: FrameStatus,
    /// The renderer's version, of one that is drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) pixels: Option<u32>,
}

/// Where a frame stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum FrameStatus {
    /// It is awaited.
    Pending,
    /// It is drawn.
    Done,
    /// It cannot be drawn.
    Failed,
}

/// Something that keeps a run from being done.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct FaultInfo {
    /// What is faulty, for people.
    pub(super) what: String,
    /// Its script, if it is a frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) script: Option<ScriptName>,
    /// Which of the script's frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) part: Part,
    /// Line and column from 1, where a line is at fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) place: Option<(usize, usize)>,
    /// What is wrong.
    pub(super) message: String,
    /// What would be right.
    pub(super) help: String,
}

/// A run as it was seen last.
pub(super) fn summary<S: Store, C: Clock>(watch: &Watch<'_, S, C>) -> Summary {
    let gif = watch.gif().map(|gif| GifInfo {
        bytes: gif.size,
        version: gif.etag.to_string(),
        current: watch.is_current(),
    });
    let mut summary = Summary {
        run: watch.animation().to_string(),
        status: if watch.is_unreadable() { "unreadable" } else { "new" }.to_owned(),
        done: 0,
        failed: 0,
        total: 0,
        behind: watch.is_behind(),
        settled: watch.is_settled(),
        gif,
    };
    if let Some(manifest) = watch.manifest() {
        let head = &manifest.head;
        summary.status = head.status.to_string();
        (summary.done, summary.failed) = (head.done, head.failed);
        // Frames of scripts that have not been uploaded yet are awaited too.
        summary.total = head.total + head.missing() - head.pending;
    }
    summary
}

/// Everything that keeps it from being done, as far as it is told, and how much is not.
pub(super) fn faults(manifest: &Manifest) -> (Vec<FaultInfo>, usize) {
    let mut all: Vec<FaultInfo> = manifest
        .head
        .rejected
        .iter()
        .map(|rejected| FaultInfo::of_nothing_drawn(rejected.key.clone(), rejected.problem.clone()))
        .collect();
    let failed = manifest.frames.iter().filter_map(|frame| match &frame.state {
        FrameState::Failed(fault) => Some((frame, fault.reason.as_ref())),
        FrameState::Pending | FrameState::Done { .. } => None,
    });
    let mut failed: std::collections::VecDeque<_> = failed.collect();
    for obstacle in obstacles(manifest) {
        // The frames among the obstacles come in their order.
        let frame = failed
            .front()
            .filter(|(frame, _)| rayfold_client::frame_name(frame) == obstacle.what)
            .map(|(frame, _)| *frame);
        if frame.is_some() {
            failed.pop_front();
        }
        all.extend(of_reason(obstacle.what, frame, obstacle.reason));
    }
    let more = all.len().saturating_sub(FAULTS);
    all.truncate(FAULTS);
    (all, more)
}

fn of_reason(what: String, frame: Option<&Frame>, reason: Option<&Reason>) -> Vec<FaultInfo> {
    let about = |what: String, message: String| FaultInfo {
        script: frame.map(|frame| frame.script.clone()),
        part: frame.and_then(|frame| frame.part),
        ..FaultInfo::of_nothing_drawn(what, message)
    };
    let Some(reason) = reason else { return vec![about(what, "no reason is known yet".into())] };
    if reason.diagnostics.is_empty() {
        return vec![about(what, reason.message.clone())];
    }
    let told = |diagnostic: &Diagnostic| {
        let Diagnostic { line, column, message, expected, help, .. } = diagnostic;
        FaultInfo {
            place: Some((*line, *column)),
            help: help.clone().or_else(|| expected.clone()).unwrap_or_default(),
            ..about(what.clone(), message.clone())
        }
    };
    let mut faults: Vec<_> = reason.diagnostics.iter().map(told).collect();
    if reason.omitted > 0 {
        faults.push(about(what.clone(), format!("and {} more", reason.omitted)));
    }
    faults
}

impl FaultInfo {
    fn of_nothing_drawn(what: String, message: String) -> Self {
        Self { what, script: None, part: None, place: None, message, help: String::new() }
    }
}

impl FrameUpdate {
    pub(super) fn of(frame: &Frame) -> Self {
        let (state, pixels) = match frame.state {
            FrameState::Pending => (FrameStatus::Pending, None),
            FrameState::Done { pixels } => (FrameStatus::Done, Some(pixels)),
            FrameState::Failed(_) => (FrameStatus::Failed, None),
        };
        let version = frame.version.to_string();
        Self { script: frame.script.clone(), version, part: frame.part, state, pixels }
    }
}

impl RunUpdate {
    /// What is new since the last time; `None` where nothing is.
    pub(super) fn since(
        last: &mut Option<(RunState, Vec<FrameUpdate>)>,
        state: RunState,
        frames: Vec<FrameUpdate>,
    ) -> Option<Self> {
        let tell = match last {
            Some((old, known)) if known.len() == frames.len() => {
                let places = known.iter().zip(&frames).enumerate();
                let changed: Vec<_> =
                    places.filter(|(_, (a, b))| a != b).map(|(at, (_, b))| (at, b.clone())).collect();
                if changed.is_empty() && *old == state {
                    return None;
                }
                Self { state: state.clone(), frames: None, changed }
            }
            _ => Self { state: state.clone(), frames: Some(frames.clone()), changed: Vec::new() },
        };
        *last = Some((state, frames));
        Some(tell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(done: u64) -> RunState {
        let summary = Summary {
            run: "film".into(),
            status: "rendering".into(),
            done,
            failed: 0,
            total: 3,
            behind: false,
            settled: false,
            gif: None,
        };
        RunState { summary, faults: vec![], more_faults: 0, sending: None, problem: None }
    }

    fn frames(drawn: &[bool]) -> Vec<FrameUpdate> {
        let frame = |(at, drawn): (usize, &bool)| FrameUpdate {
            script: ScriptName::new(&format!("{at}")).unwrap(),
            version: "v".into(),
            part: None,
            state: if *drawn { FrameStatus::Done } else { FrameStatus::Pending },
            pixels: drawn.then_some(1),
        };
        drawn.iter().enumerate().map(frame).collect()
    }

    #[test]
    fn only_what_changes_is_told_again() {
        let mut last = None;
        let mut tell = |done, drawn: &[bool]| RunUpdate::since(&mut last, state(done), frames(drawn));
        let first = tell(0, &[false; 3]).unwrap();
        assert_eq!((first.frames.map(|frames| frames.len()), first.changed.len()), (Some(3), 0));
        assert!(tell(0, &[false; 3]).is_none());
        let second = tell(1, &[false, true, false]).unwrap();
        assert!(second.frames.is_none());
        assert_eq!(second.changed.iter().map(|(at, _)| *at).collect::<Vec<_>>(), [1]);
        let third = tell(1, &[true; 4]).unwrap();
        assert_eq!(third.frames.unwrap().len(), 4, "another number of frames: all of them");
    }
}
