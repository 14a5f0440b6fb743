//! The manifest: the summary of the bucket's listing, for people, the command line and the protocol.
//!
//! `docs/manifest.md` describes the document field by field. The type knows no store: [`mod@crate::fold`] decides when
//! a manifest is written, [`crate::reconcile()`] computes it, and [`crate::invariants`] checks it.
//!
//! Its first line is the [`Head`], whose size does not grow with the number of frames. The frames follow, one per line,
//! and the head of a large manifest has their positions.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::num::NonZeroU64;

use rayfold_scene::{AnimationSettings, Container, Diagnostic, SETTINGS_FILE, parse_settings};
use serde::{Deserialize, Serialize};

use crate::Timestamp;
use crate::keys::{Animation, Generation, Part, ScriptName};
use crate::store::ETag;

mod document;

pub(crate) use document::{Beginning, frames_of};

/// The version of the document's format. Readers refuse a later one.
pub const SCHEMA: u32 = 1;

/// The number of diagnostics of a script that the manifest repeats; the receipt has more.
pub const DIAGNOSTICS_SHOWN: usize = 3;

/// The largest `animation.json` that is read: thousands of times the size that its fields need.
pub const MAX_SETTINGS_BYTES: u64 = 64 * 1024;

/// The manifest of an animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// All data but the frames.
    pub head: Head,
    /// The frames in the order of the animation.
    pub frames: Vec<Frame>,
}

/// The summary of a manifest, which is its first line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Head {
    /// The version of the format: [`SCHEMA`].
    pub schema: u32,
    /// The animation whose frames the manifest lists.
    pub animation: Animation,
    /// The number of this revision, from 1. It grows by one with each write.
    pub revision: u64,
    /// The request id of the invocation that wrote this revision.
    pub writer: String,
    /// The progress of the animation.
    pub status: Status,
    /// The identity of this set of frames and settings; a file of the same generation is current.
    pub generation: Generation,
    /// The number of scripts in the folder.
    pub scripts: u64,
    /// The number of known frames; a script that has not been read yet counts as one.
    pub total: u64,
    /// The number of frames that are drawn.
    pub done: u64,
    /// The number of pending frames.
    pub pending: u64,
    /// The number of frames that wait for files that their scripts name.
    #[serde(default, skip_serializing_if = "is_none")]
    pub waiting: u64,
    /// The number of frames that cannot be drawn.
    pub failed: u64,
    /// The settings in `animation.json`.
    pub settings: Settings,
    /// Objects that are meant as scripts but have a key that the pipeline cannot use.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rejected: Vec<Rejected>,
    /// Objects that are not read because their names only resemble those of scripts and settings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Rejected>,
    /// The reason why one of the files cannot be made of this generation, although all of its frames are drawn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refusal: Option<Fault>,
    /// The reason if there are more frames than an animation may have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub excess: Option<Reason>,
    /// The time when a script was last found to be gone, by the clock of the function that found it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removed_at: Option<Timestamp>,
    /// The last GIF that an assembler has found or written. If another GIF has the metadata of this generation, it does
    /// not count as current.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gif: Option<Made>,
    /// The other files, likewise.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub outputs: BTreeMap<Container, Made>,
    /// The name of every 1,000th script, at which listings in ranges start.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marks: Vec<ScriptName>,
}

/// A file that was made of an animation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Made {
    /// The set that it was made of.
    pub generation: Generation,
    /// The entity tag of the file.
    pub version: ETag,
}

/// The progress of an animation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// There is no script, and there will be no GIF.
    Empty,
    /// There are fewer frames than `animation.json` says, or some wait for files that their scripts name.
    Waiting,
    /// Frames are being drawn.
    Rendering,
    /// Everything has been tried, and something cannot be drawn or read. There will be no GIF.
    Failed,
    /// All frames are drawn, but one of the files cannot be made of them, so there will be none.
    Refused,
    /// All frames are drawn. The files of this generation exist, or will soon.
    Done,
}

/// Returns its word in the manifest.
impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Empty => "empty",
            Self::Waiting => "waiting",
            Self::Rendering => "rendering",
            Self::Failed => "failed",
            Self::Refused => "refused",
            Self::Done => "done",
        })
    }
}

/// A frame of the animation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "FrameLine", into = "FrameLine")]
pub struct Frame {
    /// The script that draws it.
    pub script: ScriptName,
    /// The entity tag of the script of the frame. If the script names files and has been read, it is followed by a hash
    /// of them.
    pub version: ETag,
    /// The frame's number in its script; `None` if the script is one frame, or has not been read yet.
    pub part: Part,
    /// The result of drawing the frame.
    pub state: FrameState,
}

/// The result of drawing a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameState {
    /// There is no result yet.
    Pending,
    /// The frame is drawn.
    Done {
        /// The renderer's pixel version that is used.
        pixels: u32,
    },
    /// The frame cannot be drawn before files arrive that the script names.
    Waiting(Fault),
    /// The frame cannot be drawn.
    Failed(Fault),
}

/// The reason why there is no result, and the receipt that contains it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// The entity tag of the receipt.
    pub receipt: ETag,
    /// The content of the receipt. Always present in a manifest that is not rendering or waiting.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<Reason>,
}

/// A reason for people, with the diagnostics behind it: the body of an error receipt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reason {
    /// One line. For a script's first error it is `<file>:<line>:<column>: <message>`.
    pub message: String,
    /// The script's diagnostics, or the first of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub diagnostics: Vec<Diagnostic>,
    /// The number of diagnostics that are omitted.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub omitted: usize,
}

/// An object that is meant as a script but cannot be one, or is not named like one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rejected {
    /// The key of the object.
    pub key: String,
    /// The reason for which it is rejected.
    pub problem: String,
}

/// The animation's settings as they were found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The version of `animation.json`; `None` if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<ETag>,
    /// The settings; `None` if and only if `fault` is set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<AnimationSettings>,
    /// The error in `animation.json`, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<Reason>,
}

/// A fact that the manifest must show before an invocation may stop.
#[derive(Debug, Clone, PartialEq)]
pub enum Fact {
    /// No particular fact: fold in any case.
    Fold,
    /// There is no such script.
    Absent(ScriptName),
    /// The script is known in this version.
    Version(ScriptName, ETag),
    /// The manifest shows this version of `animation.json`.
    Settings(Option<ETag>),
    /// The script's frame, or this part of it, is drawn with this pixel version or a newer one.
    Drawn(ScriptName, ETag, Part, u32),
    /// The script's frame, or this part of it, cannot be drawn, or not yet, according to this receipt.
    Faulty(ScriptName, ETag, Part, ETag),
    /// The script has several frames.
    Split(ScriptName, ETag),
}

impl Head {
    /// Returns whether every expected frame is done or failed, so that nothing more happens unless the user changes
    /// something.
    pub fn is_terminal(&self) -> bool {
        !matches!(self.status, Status::Waiting | Status::Rendering)
    }

    /// Returns the files that are made of the animation.
    pub fn outputs(&self) -> &[Container] {
        self.settings.outputs()
    }

    /// Returns the settings of the animation, with the current number of frames.
    pub(crate) fn counted_settings(&self) -> AnimationSettings {
        self.settings.value.clone().unwrap_or_default().of_frames(self.total)
    }

    /// Returns the version of a file of this generation, if an assembler has found it.
    pub fn version_of(&self, output: Container) -> Option<&ETag> {
        let made = if output == Container::Gif { self.gif.as_ref() } else { self.outputs.get(&output) };
        made.filter(|made| made.generation == self.generation).map(|made| &made.version)
    }

    /// Records the version of a file of this generation.
    pub(crate) fn record(&mut self, output: Container, version: ETag) {
        let made = Made { generation: self.generation.clone(), version };
        if output == Container::Gif {
            self.gif = Some(made);
        } else {
            self.outputs.insert(output, made);
        }
    }

    /// Copies the recorded files of another head, because no listing shows them.
    pub(crate) fn with_files_of(mut self, other: Option<&Head>) -> Self {
        self.gif = other.and_then(|other| other.gif.clone());
        self.outputs = other.map(|other| other.outputs.clone()).unwrap_or_default();
        self
    }

    /// Returns the number of frames that are expected and not drawn yet.
    pub fn missing(&self) -> u64 {
        self.pending + self.waiting + self.not_uploaded()
    }

    /// Returns the number of frames that are expected and whose scripts are not uploaded, or not read yet.
    pub fn not_uploaded(&self) -> u64 {
        let expected = self.settings.value.as_ref().and_then(AnimationSettings::frames).unwrap_or(0);
        expected.saturating_sub(self.total)
    }
}

impl Manifest {
    /// Returns whether both manifests say the same, regardless of their writers and of the reasons that they repeat.
    pub fn agrees_with(&self, other: &Manifest) -> bool {
        let (a, b) = (&self.head, &other.head);
        let receipt = |fault: &Option<Fault>| fault.as_ref().map(|fault| fault.receipt.clone());
        a.status == b.status
            && a.generation == b.generation
            && a.settings == b.settings
            && a.rejected == b.rejected
            && a.warnings == b.warnings
            && a.excess == b.excess
            && receipt(&a.refusal) == receipt(&b.refusal)
            && self.frames.len() == other.frames.len()
            && self.frames.iter().zip(&other.frames).all(|(a, b)| a.agrees_with(b))
    }

    /// Returns the parts of a split script's version that are still to come, or `None` if the manifest does not show
    /// the split.
    pub fn pending_parts(&self, name: &ScriptName, version: &ETag) -> Option<Vec<NonZeroU64>> {
        let frames = self.frames.iter().filter(|frame| frame.script == *name && frame.version == *version);
        let mut parts = frames.filter_map(|frame| Some((frame.part?, &frame.state))).peekable();
        parts.peek()?;
        Some(parts.filter(|(_, state)| **state == FrameState::Pending).map(|(part, _)| part).collect())
    }

    /// Applies a limit on the number of frames. An animation with more is failed, and no invocation waits for anything.
    pub(crate) fn bounded(mut self, most: Option<u64>) -> Self {
        let total = self.head.total;
        if let Some(most) = most.filter(|most| total > *most) {
            let message = format!(
                "the animation has {total} frames: expected at most {most}, the limit of this bucket"
            );
            self.head.excess = Some(Reason::new(message));
            self.head.refusal = None;
            self.head.status = Status::Failed;
        }
        self
    }

    /// Returns the time when a script was last found to be gone, if this manifest is written `now` over `before`.
    pub(crate) fn removed_at(&self, before: Option<&Manifest>, now: Timestamp) -> Option<Timestamp> {
        let before = before?;
        let left: BTreeSet<&ScriptName> = self.frames.iter().map(|frame| &frame.script).collect();
        let is_gone = before.frames.iter().any(|frame| !left.contains(&frame.script));
        if is_gone { Some(now) } else { before.head.removed_at }
    }

    /// Returns whether the manifest shows the fact.
    pub fn shows(&self, fact: &Fact) -> bool {
        fact.is_shown_by(&self.head, &self.frames)
    }
}

impl Fact {
    /// Returns the script, or the part of it, that the fact is about; `None` if the head is enough to decide.
    pub(crate) fn subject(&self) -> Option<(&ScriptName, Part)> {
        match self {
            Fact::Fold | Fact::Settings(_) => None,
            Fact::Absent(name) | Fact::Version(name, _) | Fact::Split(name, _) => Some((name, None)),
            Fact::Drawn(name, _, part, _) | Fact::Faulty(name, _, part, _) => Some((name, *part)),
        }
    }

    /// Returns whether a manifest shows the fact, given its head and at least the frames of the fact's subject.
    pub(crate) fn is_shown_by(&self, head: &Head, frames: &[Frame]) -> bool {
        let of = |name: &ScriptName, version: &ETag| {
            let (name, version) = (name.clone(), version.clone());
            frames.iter().filter(move |frame| frame.script == name && frame.version == version)
        };
        match self {
            Fact::Fold => false,
            Fact::Absent(name) => frames.iter().all(|frame| frame.script != *name),
            Fact::Version(name, version) => of(name, version).next().is_some(),
            Fact::Settings(version) => head.settings.version == *version,
            Fact::Drawn(name, version, part, pixels) => of(name, version).any(|frame| {
                frame.part == *part
                    && matches!(frame.state, FrameState::Done { pixels: used } if used >= *pixels)
            }),
            Fact::Faulty(name, version, part, receipt) => of(name, version).any(|frame| {
                frame.part == *part
                    && match &frame.state {
                        FrameState::Pending => false,
                        FrameState::Done { .. } => true,
                        FrameState::Failed(fault) | FrameState::Waiting(fault) => fault.receipt == *receipt,
                    }
            }),
            Fact::Split(name, version) => of(name, version).any(|frame| frame.part.is_some()),
        }
    }
}

impl Frame {
    fn agrees_with(&self, other: &Frame) -> bool {
        let same_state = match (&self.state, &other.state) {
            (FrameState::Failed(a), FrameState::Failed(b))
            | (FrameState::Waiting(a), FrameState::Waiting(b)) => a.receipt == b.receipt,
            (a, b) => a == b,
        };
        same_state && self.script == other.script && self.version == other.version && self.part == other.part
    }
}

impl Settings {
    /// Returns the files that are made of the animation. For faulty settings these are the default ones.
    pub(crate) fn outputs(&self) -> &[Container] {
        self.value.as_ref().map_or(AnimationSettings::DEFAULT_OUTPUTS, AnimationSettings::outputs)
    }

    /// Returns the settings of an animation without `animation.json`.
    pub fn absent() -> Self {
        Settings { version: None, value: Some(AnimationSettings::default()), fault: None }
    }

    /// Returns the settings for an `animation.json` that is too large to be one.
    pub fn too_large(version: ETag, size: u64) -> Self {
        let message = format!("{SETTINGS_FILE} has {size} bytes: expected at most {MAX_SETTINGS_BYTES}");
        Settings { version: Some(version), value: None, fault: Some(Reason::new(message)) }
    }

    /// Parses the body of `animation.json`.
    pub fn parse(version: ETag, body: &[u8]) -> Self {
        let parsed = parse_settings(SETTINGS_FILE, body);
        let fault = match &parsed.settings {
            Some(_) => None,
            None => Some(Reason::from_diagnostics(parsed.diagnostics).shortened()),
        };
        Settings { version: Some(version), value: parsed.settings, fault }
    }
}

impl Reason {
    /// The text for an error receipt that cannot be read. The sweep deletes the receipt, and has the frame drawn again.
    pub const UNREADABLE: &str =
        "the error receipt cannot be read: the frame is drawn again at the next sweep";

    /// Returns the reason in an error receipt.
    pub(crate) fn of_receipt(body: &[u8]) -> Self {
        serde_json::from_slice(body).unwrap_or_else(|_| Reason::new(Reason::UNREADABLE))
    }

    /// A reason without diagnostics.
    pub fn new(message: impl Into<String>) -> Self {
        Reason { message: message.into(), diagnostics: Vec::new(), omitted: 0 }
    }

    /// The errors among a script's diagnostics, up to 100 of them.
    pub fn from_diagnostics(diagnostics: Vec<Diagnostic>) -> Self {
        let mut errors: Vec<_> = diagnostics.into_iter().filter(Diagnostic::is_error).collect();
        let message = match errors.first() {
            Some(first) => {
                let Diagnostic { file, line, column, message, .. } = first;
                format!("{file}:{line}:{column}: {message}")
            }
            None => "the script cannot be read".to_owned(),
        };
        let omitted = errors.len().saturating_sub(100);
        errors.truncate(100);
        Reason { message, diagnostics: errors, omitted }
    }

    /// Returns the reason in the short form of the manifest.
    pub fn shortened(mut self) -> Self {
        self.omitted += self.diagnostics.len().saturating_sub(DIAGNOSTICS_SHOWN);
        self.diagnostics.truncate(DIAGNOSTICS_SHOWN);
        self
    }
}

/// A frame in the form of its line in the document.
#[derive(Serialize, Deserialize)]
struct FrameLine {
    script: ScriptName,
    version: ETag,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    part: Part,
    state: Word,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pixels: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    receipt: Option<ETag>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reason: Option<Reason>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Word {
    Pending,
    Done,
    Waiting,
    Failed,
}

impl From<Frame> for FrameLine {
    fn from(frame: Frame) -> Self {
        let Frame { script, version, part, state } = frame;
        let (state, pixels, receipt, reason) = match state {
            FrameState::Pending => (Word::Pending, None, None, None),
            FrameState::Done { pixels } => (Word::Done, Some(pixels), None, None),
            FrameState::Waiting(fault) => (Word::Waiting, None, Some(fault.receipt), fault.reason),
            FrameState::Failed(fault) => (Word::Failed, None, Some(fault.receipt), fault.reason),
        };
        FrameLine { script, version, part, state, pixels, receipt, reason }
    }
}

impl From<FrameLine> for Frame {
    fn from(line: FrameLine) -> Self {
        let fault = Fault { receipt: line.receipt.unwrap_or_else(|| ETag::new("")), reason: line.reason };
        let state = match line.state {
            Word::Pending => FrameState::Pending,
            Word::Done => FrameState::Done { pixels: line.pixels.unwrap_or(0) },
            Word::Waiting => FrameState::Waiting(fault),
            Word::Failed => FrameState::Failed(fault),
        };
        Frame { script: line.script, version: line.version, part: line.part, state }
    }
}

/// The number of a part, for frames counted from 1.
pub fn part(number: u64) -> Part {
    NonZeroU64::new(number)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_none(number: &u64) -> bool {
    *number == 0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_zero(number: &usize) -> bool {
    *number == 0
}

#[cfg(test)]
mod tests;
