//! The data about runs for the page, computed from manifests. Contains values only.

use rayfold_client::{Watch, obstacles};
use rayfold_pipeline::Clock;
use rayfold_pipeline::keys::{Part, ScriptName};
use rayfold_pipeline::manifest::{Frame, FrameState, Manifest, Reason};
use rayfold_pipeline::store::Store;
use rayfold_scene::{Container, Diagnostic};
use serde::Serialize;

use super::sending::UploadProgress;

/// The largest number of errors that are listed.
const FAULTS: usize = 100;

/// A run in a list.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct Summary {
    /// The name of the run, which is its address.
    pub(crate) run: String,
    /// A word: the status of the manifest, or the reason why there is none.
    pub(crate) status: String,
    /// The number of rendered frames.
    pub(crate) done: u64,
    /// The number of frames that failed.
    pub(crate) failed: u64,
    /// The number of all frames.
    pub(crate) total: u64,
    /// There are scripts that the functions have not seen.
    pub(crate) behind: bool,
    /// Nothing more will happen unless a script changes.
    pub(crate) settled: bool,
    /// The existing files, in the order in which the settings ask for them.
    pub(crate) files: Vec<RunFile>,
}

/// A file in the bucket that was made of an animation.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct RunFile {
    /// The ending of its name, without a dot.
    pub(crate) ending: String,
    /// The name of its format.
    pub(crate) format: String,
    /// The size of the file.
    pub(crate) bytes: u64,
    /// The version, so that another file has another address.
    pub(crate) version: String,
    /// The file shows the newest scripts.
    pub(crate) current: bool,
}

/// An update of a run. Contains only the frames that changed since the last update.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct RunUpdate {
    #[serde(flatten)]
    pub(crate) state: RunState,
    /// All frames, in the first update.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) frames: Option<Vec<FrameUpdate>>,
    /// The changed frames with their indices from 0.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(test, ts(as = "Option<_>", optional))]
    pub(crate) changed: Vec<(usize, FrameUpdate)>,
}

/// The state of a run without its frames.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct RunState {
    #[serde(flatten)]
    pub(crate) summary: Summary,
    /// The errors that keep it from being done.
    pub(crate) faults: Vec<FaultInfo>,
    /// The number of errors that are not listed.
    pub(crate) more_faults: usize,
    /// The progress of the upload, if this program uploads it.
    pub(crate) sending: Option<UploadProgress>,
    /// The reason why nothing newer is known.
    pub(crate) problem: Option<String>,
}

/// The state of a frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct FrameUpdate {
    /// The name of its script.
    #[cfg_attr(test, ts(as = "String"))]
    pub(crate) script: ScriptName,
    /// The version of the script.
    pub(crate) version: String,
    /// The number of the frame within the script.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(as = "Option<u32>", optional))]
    pub(crate) part: Part,
    /// The status of the frame.
    pub(crate) state: FrameStatus,
    /// The pixel version of the renderer, if the frame is rendered.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) pixels: Option<u32>,
}

/// The status of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FrameStatus {
    /// The frame is awaited.
    Pending,
    /// The frame is rendered.
    Done,
    /// The frame cannot be rendered.
    Failed,
}

/// An error that keeps a run from being done.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct FaultInfo {
    /// The faulty object, for messages.
    pub(crate) what: String,
    /// The script, if the object is a frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(as = "Option<String>", optional))]
    pub(crate) script: Option<ScriptName>,
    /// The number of the frame within the script.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(as = "Option<u32>", optional))]
    pub(crate) part: Part,
    /// Line and column from 1, if a line has an error.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) place: Option<(usize, usize)>,
    /// The description of the problem.
    pub(crate) message: String,
    /// The correction that would help.
    pub(crate) help: String,
}

/// Returns the summary of a run as of the last poll.
pub(crate) fn summary<S: Store, C: Clock>(watch: &Watch<'_, S, C>) -> Summary {
    let file = |output: &Container| {
        let file = watch.file(*output)?;
        Some(RunFile {
            ending: output.ending().to_owned(),
            format: output.name().to_owned(),
            bytes: file.size,
            version: file.etag.to_string(),
            current: watch.has_current(*output),
        })
    };
    let files = watch.outputs().iter().filter_map(file).collect();
    let mut summary = Summary {
        run: watch.animation().to_string(),
        status: if watch.is_unreadable() { "unreadable" } else { "new" }.to_owned(),
        done: 0,
        failed: 0,
        total: 0,
        behind: watch.is_behind(),
        settled: watch.is_settled(),
        files,
    };
    if let Some(manifest) = watch.manifest() {
        let head = &manifest.head;
        summary.status = head.status.to_string();
        (summary.done, summary.failed) = (head.done, head.failed);
        // Frames of scripts that have not been uploaded yet are awaited, too.
        summary.total = head.total + head.not_uploaded();
    }
    summary
}

/// Returns the listed errors that keep a run from being done, and the number of the others.
pub(crate) fn faults(manifest: &Manifest) -> (Vec<FaultInfo>, usize) {
    let mut all: Vec<FaultInfo> = manifest
        .head
        .rejected
        .iter()
        .map(|rejected| FaultInfo::of_nothing_drawn(rejected.key.clone(), rejected.problem.clone()))
        .collect();
    let failed = manifest.frames.iter().filter_map(|frame| match &frame.state {
        FrameState::Failed(fault) | FrameState::Waiting(fault) => Some((frame, fault.reason.as_ref())),
        FrameState::Pending | FrameState::Done { .. } => None,
    });
    let mut failed: std::collections::VecDeque<_> = failed.collect();
    for obstacle in obstacles(manifest) {
        // The frames among the obstacles are in order.
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
    let of_diagnostic = |diagnostic: &Diagnostic| {
        let Diagnostic { line, column, message, expected, help, .. } = diagnostic;
        FaultInfo {
            place: Some((*line, *column)),
            help: help.clone().or_else(|| expected.clone()).unwrap_or_default(),
            ..about(what.clone(), message.clone())
        }
    };
    let mut faults: Vec<_> = reason.diagnostics.iter().map(of_diagnostic).collect();
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
    pub(crate) fn of(frame: &Frame) -> Self {
        let (state, pixels) = match frame.state {
            FrameState::Pending | FrameState::Waiting(_) => (FrameStatus::Pending, None),
            FrameState::Done { pixels } => (FrameStatus::Done, Some(pixels)),
            FrameState::Failed(_) => (FrameStatus::Failed, None),
        };
        let version = frame.version.to_string();
        Self { script: frame.script.clone(), version, part: frame.part, state, pixels }
    }
}

impl RunUpdate {
    /// Returns the changes since the last update, or `None` if there are none.
    pub(crate) fn since(
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
    use rayfold_client::Client;
    use rayfold_pipeline::SystemClock;
    use rayfold_pipeline::assemble::frame_key;
    use rayfold_pipeline::keys::Animation;
    use rayfold_pipeline::store::{MemoryStore, PutOptions};
    use serde_json::{Value, json};

    use super::*;

    /// The page without a program is tested with the same cases (`web/tests/site-standing.mjs`).
    #[tokio::test]
    async fn what_the_page_without_a_program_computes_is_the_same() {
        let cases: Vec<Value> = serde_json::from_str(include_str!("standing.json")).unwrap();
        for case in cases {
            assert_eq!(computed(&case).await, case["expected"], "{}", case["title"]);
        }
    }

    async fn computed(case: &Value) -> Value {
        let (store, animation) = (MemoryStore::new(SystemClock), Animation::new("film").unwrap());
        let put = async |key: String, text: &str, generation: Option<&str>| {
            let options = PutOptions::always();
            let options = match generation {
                Some(generation) => options.metadata("generation", generation),
                None => options,
            };
            store.put(&key, text.to_owned().into(), options).await.unwrap();
        };
        for (name, text) in case["scripts"].as_object().unwrap() {
            put(format!("scripts/film/{name}"), text.as_str().unwrap(), None).await;
        }
        for receipt in case["receipts"].as_array().into_iter().flatten() {
            put(format!("frames/film/{}", receipt.as_str().unwrap()), "", None).await;
        }
        for (ending, file) in case["files"].as_object().unwrap() {
            let text = file["text"].as_str().unwrap();
            put(format!("animations/film.{ending}"), text, file["generation"].as_str()).await;
        }
        match &case["manifest"] {
            Value::Null => {}
            Value::Object(manifest) => {
                let mut head = manifest.clone();
                let frames = head.remove("frames").unwrap();
                let head = Value::from(head).to_string();
                let (head, frames) =
                    (head.strip_suffix('}').unwrap(), frames.to_string().replacen('[', "[\n", 1));
                put(animation.manifest(), &format!("{head},\n\"frames\":{frames}}}\n"), None).await;
            }
            other => put(animation.manifest(), other.as_str().unwrap(), None).await,
        }
        let mut watch = Watch::new(Client::new(&store, &SystemClock), animation.clone());
        watch.poll().await.unwrap();
        watch.compare().await.unwrap();
        let (faults, more_faults) = watch.manifest().map_or_else(Default::default, faults);
        let frames = watch.manifest().map_or(&[][..], |manifest| &manifest.frames);
        json!({
            "summary": summary(&watch),
            "faults": faults,
            "moreFaults": more_faults,
            "frames": frames.iter().map(FrameUpdate::of).collect::<Vec<_>>(),
            "keys": frames.iter().filter_map(|frame| frame_key(&animation, frame)).collect::<Vec<_>>(),
        })
    }

    fn state(done: u64) -> RunState {
        let summary = Summary {
            run: "film".into(),
            status: "rendering".into(),
            done,
            failed: 0,
            total: 3,
            behind: false,
            settled: false,
            files: Vec::new(),
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
