//! The messages between page and server over the WebSocket: JSON both ways, and pictures (`pictures`) to the page.
//!
//! Points of the picture are in its pixels. Lines are counted from 0.

use std::collections::BTreeMap;

use rayfold_movie::Container;
use rayfold_scene::Language;
use serde::{Deserialize, Serialize};

use crate::handles::{DragOptions, Handle, HandleKind};
use crate::project::Saved;
use crate::tables::{CommandTable, FieldTable, Role};
use crate::text_edit::TextChange;
use crate::tracks::{KeyPlace, Tracks};

/// A message of the page.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case", rename_all_fields = "kebab-case", tag = "ask")]
pub(crate) enum ClientMessage {
    /// Set the size of the viewport, in pixels of the screen.
    Size { width: u32, height: u32 },
    /// Confirm that a picture has been shown.
    Shown,
    /// Show a frame, counted from 0; `moving` while it is played or scrubbed.
    Frame { frame: usize, moving: bool },
    /// Select lines.
    Select { lines: Vec<usize> },
    /// Report the object under the pointer.
    Hover { x: f64, y: f64 },
    /// Press the pointer: on a handle, on an object, or on the background, which turns the camera.
    Press { x: f64, y: f64, extend: bool, grip: Option<HandleKind>, line: Option<usize> },
    /// Move the pressed pointer.
    Drag {
        x: f64,
        y: f64,
        #[serde(flatten)]
        options: DragOptions,
    },
    /// Release the pointer.
    Release,
    /// Turn, pan or zoom the free camera; the distance is in heights of the picture.
    Navigate { how: Navigation, x: f64, y: f64 },
    /// Look through a camera.
    Look { at: ViewPreset },
    /// Leave out indirect light in the viewport, or draw it again.
    Draft { on: bool },
    /// Write the current view into the script as its camera.
    KeepCamera,
    /// Set the numbers of a line from number `first` on. All changes with the same `gesture` are one step.
    Set { line: usize, first: usize, values: Vec<f64>, gesture: Option<u64> },
    /// Take back the changes of a gesture, or of what the pointer holds, and hold it no longer.
    GiveUp { gesture: Option<u64> },
    /// Change the text of a file as the page's editor did, if this is the version of the text that it had.
    Edit { file: usize, version: u32, changes: Vec<TextChange> },
    /// Remove these lines from the file.
    Remove { lines: Vec<usize> },
    /// Copy lines, each after itself.
    Duplicate { lines: Vec<usize> },
    /// Move a line up or down by one object.
    Reorder { line: usize, down: bool },
    /// Set a name, which is the comment at the end of a line.
    Rename { line: usize, name: String },
    /// Turn lines into comments, or comments back into commands.
    Hide { lines: Vec<usize> },
    /// Drop objects onto the objects below them.
    Drop { lines: Vec<usize> },
    /// Put objects on the height 0.
    Ground { lines: Vec<usize> },
    /// Lock lines against dragging in the picture, or unlock them.
    Lock { lines: Vec<usize> },
    /// Add the objects of a text of the language, with the materials and groups that they name.
    Paste { text: String },
    /// Align lines along an axis: 0 is x.
    Align { lines: Vec<usize>, axis: usize, how: Alignment },
    /// Select the objects whose middles are in a rectangle of the picture.
    Box { from: [f64; 2], to: [f64; 2], extend: bool },
    /// Make a group of lines.
    Group { lines: Vec<usize> },
    /// Replace a `Use` by the lines of its group.
    Ungroup { line: usize },
    /// Give objects a material of the script, or coefficients of their own if its name is empty.
    Surface { lines: Vec<usize>, material: String },
    /// Give objects a starter material.
    Preset { lines: Vec<usize>, preset: String },
    /// Give the object at a point of the picture a material of the script, or a starter material.
    Paint { at: [f64; 2], material: String, preset: bool },
    /// Add a clause to a material, or remove it.
    Clause { line: usize, clause: String },
    /// Set the words of a text.
    Words { line: usize, text: String },
    /// Set a word of a line, which is one of the table's words or a name.
    Word { line: usize, number: usize, word: String },
    /// Make the script's camera one of another kind, with the same view.
    Camera { command: String },
    /// Edit keys and frames.
    Time { wish: TimelineEdit },
    /// Move objects by this many steps along the axes.
    Nudge { lines: Vec<usize>, by: [f64; 3] },
    /// Add an object or a light at a point of the picture, or in the middle; a setting, a material, or the `Use` of a
    /// group, whose name follows the command.
    Add { command: String, at: Option<[f64; 2]> },
    /// Undo the last step.
    Undo,
    /// Redo the last undone step.
    Redo,
    /// Resolve a conflict with the file on disk.
    Resolve { keep_mine: bool },
    /// Load a whole text, in place of the shown one or as a new script of this name.
    Load { from: Source, new: Option<String> },
    /// Start rendering the animation.
    Render { format: MovieFormat },
    /// Stop rendering the animation.
    Cancel,
}

/// The file format of a rendered animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum MovieFormat {
    Gif,
    Apng,
    Webp,
}

impl From<MovieFormat> for Container {
    fn from(format: MovieFormat) -> Self {
        match format {
            MovieFormat::Gif => Self::Gif,
            MovieFormat::Apng => Self::Apng,
            MovieFormat::Webp => Self::Webp,
        }
    }
}

/// The source of a whole text.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case", tag = "what")]
pub(crate) enum Source {
    /// An empty text.
    Empty,
    /// An example scene.
    Example { name: String },
    /// A text sent by the page.
    Text { text: String },
    /// The text that is shown.
    Shown,
}

/// An edit of the timeline.
#[derive(Clone, Debug, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case", rename_all_fields = "kebab-case", tag = "do")]
pub(crate) enum TimelineEdit {
    /// Turn an option on or off.
    Switch { what: Switch, on: bool },
    /// Set keys at the shown frame for the main numbers of lines. If all have a key there, remove them.
    Key { lines: Vec<usize> },
    /// Set or remove keys in the same way for some numbers of a line.
    Toggle { line: usize, numbers: Vec<usize> },
    /// Start dragging these keys.
    Grab { keys: Vec<KeyPlace> },
    /// Move the dragged keys by this many frames, and by this value, from their start.
    Move { by: f64, value: f64 },
    /// Remove these keys from their curves.
    Remove { keys: Vec<KeyPlace> },
    /// Copy these keys to the clipboard.
    Copy { keys: Vec<KeyPlace> },
    /// Paste the copied keys, the first at the shown frame.
    Paste,
    /// Set the interpolation of the tracks of these keys, given as in a script.
    Ease { keys: Vec<KeyPlace>, mode: String, cycle: bool },
    /// Set the number of frames per second.
    Pace { fps: f64 },
    /// Set the number of frames of the shown `Trace`.
    Frames { count: u32 },
}

/// An option of the timeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Switch {
    /// Changing a constant number makes it a curve.
    AutoKey,
    /// The motion path of the selection is shown.
    Path,
    /// The selection is outlined at other frames.
    Onion,
}

/// A way to move the free camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Navigation {
    /// Rotate around the target.
    Turn,
    /// Move the camera sideways.
    Pan,
    /// Approach (y below 0) or recede.
    Zoom,
}

/// The parts of objects that are aligned along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Alignment {
    /// The least coordinates.
    Least,
    /// The middles.
    Middle,
    /// The greatest coordinates.
    Most,
    /// The middles, at equal distances.
    Distribute,
}

/// A camera to look through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ViewPreset {
    /// The camera of the script.
    Script,
    /// A free camera, starting at the current view.
    Free,
    /// The view from the front (along -z).
    Front,
    /// The view from the right (along -x).
    Side,
    /// The view from above.
    Top,
    /// The view from the opposite side.
    Opposite,
    /// The view of the selection.
    Selection,
}

/// A message to the page. Omitted fields have not changed.
#[derive(Clone, Debug, Default, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct ServerMessage {
    /// The table of the language, sent once at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    #[cfg_attr(test, ts(as = "Option<typescript::Language>"))]
    pub(crate) language: Option<Language>,
    /// The tables of the commands, sent once at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) tables: Option<Vec<CommandTable>>,
    /// The names of the examples, sent once at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) examples: Option<Vec<&'static str>>,
    /// Whether scripts can be added, sent once at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) can_create: Option<bool>,
    /// Whether there is a bucket to submit to, sent once at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) can_submit: Option<bool>,
    /// The names of the starter materials, sent once at the start.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(test, ts(as = "Option<_>", optional))]
    pub(crate) presets: Vec<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) files: Option<Vec<FileState>>,
    /// All lines of the shown file.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) lines: Option<Vec<LineState>>,
    /// The changes of these lines, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(test, ts(as = "Option<_>", optional))]
    pub(crate) splices: Vec<LinesChanged>,
    /// The version of the shown text, with every change of its lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) text: Option<TextState>,
    /// Whether an edit of the page's text was applied.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) accepted: Option<bool>,
    /// The state of the whole page.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) state: Option<State>,
    /// The line of the object under the pointer, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) hovered: Option<Option<usize>>,
    /// The outline of the selection, as an SVG path.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) outline: Option<String>,
    /// The outline of the object under the pointer.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) hover_outline: Option<String>,
    /// A text for the clipboard.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) clipboard: Option<String>,
    /// The lines to the objects that a drag is aligned with, as an SVG path.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) guides: Option<String>,
    /// The outlines of the selection at other frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) ghosts: Option<Vec<Ghost>>,
    /// The numbers that change.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) tracks: Option<Tracks>,
    /// The state of the rendered animation.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) output: Option<OutputState>,
    /// A message for the user.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) notice: Option<String>,
}

/// The state of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct FileState {
    pub(crate) name: String,
    /// The number of its frames.
    pub(crate) frames: usize,
    /// Whether the file has an error.
    pub(crate) faulty: bool,
}

/// The state of a line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct LineState {
    /// The text without the line end.
    pub(crate) text: String,
    /// The name of the command, also of one that is hidden in a comment.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) command: Option<&'static str>,
    /// The role of the command.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) role: Option<Role>,
    /// The comment at the end of the line.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) name: Option<String>,
    /// The name of a group or material before the numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) subject: Option<String>,
    /// The command is hidden in a comment.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[cfg_attr(test, ts(as = "Option<_>", optional))]
    pub(crate) hidden: bool,
}

/// The version of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct TextState {
    /// The index of the file.
    pub(crate) file: usize,
    /// A number that changes with the text, except by the edits of the page's own editor.
    pub(crate) version: u32,
    /// Whether the last line has a line end.
    pub(crate) ends: bool,
}

/// A replacement of some lines by others.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct LinesChanged {
    /// The index of the first line.
    pub(crate) at: usize,
    /// The number of removed lines.
    pub(crate) removed: usize,
    /// The inserted lines.
    pub(crate) lines: Vec<LineState>,
}

/// The state of the page.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct State {
    /// The number of messages that had been received.
    pub(crate) asked: u32,
    /// The name of the animation.
    pub(crate) title: String,
    /// The number of frames per second.
    pub(crate) fps: f64,
    /// The index of the shown frame, from 0.
    pub(crate) frame: usize,
    /// The number of frames.
    pub(crate) frames: usize,
    /// The file of the frame, as an index of `files`.
    pub(crate) file: usize,
    /// Whether the file on disk has the shown content.
    pub(crate) saved: Saved,
    /// The reason why the file cannot be written; empty if it can.
    pub(crate) failure: String,
    pub(crate) can_undo: bool,
    pub(crate) can_redo: bool,
    /// The selected lines, the main one last.
    pub(crate) selection: Vec<usize>,
    /// The parameters of the main selected line.
    pub(crate) inspected: Option<Inspected>,
    /// The parameters of the frame's settings, of those that have a line.
    pub(crate) settings: Vec<Inspected>,
    /// The directions of x, y and z in the picture.
    pub(crate) axes: [[f64; 2]; 3],
    /// The line of the frame's camera.
    pub(crate) camera: Option<usize>,
    /// The script's camera as the free camera sees it, as an SVG path.
    pub(crate) frustum: String,
    /// The errors and warnings of the file.
    pub(crate) faults: Vec<FaultState>,
    /// The handles that can be dragged.
    pub(crate) handles: Vec<Handle>,
    /// The grid on the ground, as an SVG path.
    pub(crate) grid: String,
    /// The motion path of the selection, as an SVG path.
    pub(crate) way: String,
    /// The keys on the motion path, as dots of an SVG path.
    pub(crate) marks: String,
    /// The lines that cannot be dragged in the picture.
    pub(crate) locked: Vec<usize>,
    /// The state of frames and keys.
    pub(crate) time: TimeState,
    /// Whether the view is that of a free camera.
    pub(crate) free: bool,
    /// Whether the viewport leaves out indirect light, or `null` if the scene has none.
    pub(crate) draft: Option<bool>,
    /// Number, width and height of the picture that was requested last; `None` if there is nothing to draw.
    pub(crate) picture: Option<(u32, u32, u32)>,
}

/// The parameters of a line.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct Inspected {
    pub(crate) line: usize,
    /// The name of the command.
    pub(crate) command: &'static str,
    /// The current numbers of the parameters; `null` for a word that is no number.
    pub(crate) values: Vec<Option<f64>>,
    /// The words that are neither numbers nor curves, by their positions.
    pub(crate) words: BTreeMap<usize, String>,
    /// The parameters that are curves.
    pub(crate) curves: Vec<usize>,
    /// The curves that have a key at the shown frame.
    pub(crate) keyed: Vec<usize>,
    /// Whether the parameters may be curves.
    pub(crate) can_key: bool,
    /// The name of a material in place of coefficients.
    pub(crate) material: Option<String>,
    /// The name before the numbers.
    pub(crate) subject: String,
    /// The words of a text, without quotes.
    pub(crate) text: Option<String>,
    /// The parameters of a material, which depend on its clauses.
    pub(crate) fields: Vec<FieldTable>,
}

/// The state of frames and keys.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct TimeState {
    /// The number of the shown frame, at which curves are evaluated.
    pub(crate) number: f64,
    /// The first frame number of its `Trace`.
    pub(crate) first: u32,
    /// The last frame number of its `Trace`.
    pub(crate) last: u32,
    /// The index of the first number among all frames, from 0.
    pub(crate) start: usize,
    /// Whether changing a constant number makes it a curve.
    pub(crate) auto_key: bool,
    /// Whether the motion path of the selection is shown.
    pub(crate) path: bool,
    /// Whether the selection is outlined at other frames.
    pub(crate) onion: bool,
    /// The number of copied keys.
    pub(crate) copied: usize,
}

/// The outline of the selection at another frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct Ghost {
    /// The outline as an SVG path.
    pub(crate) path: String,
    /// The number of steps after the shown frame, or, below 0, before it.
    pub(crate) after: i32,
}

/// An error or a warning of a line.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct FaultState {
    /// The index of the line.
    pub(crate) line: usize,
    /// The first character, from 0.
    pub(crate) column: usize,
    /// The number of characters.
    pub(crate) length: usize,
    /// Whether it prevents rendering.
    pub(crate) error: bool,
    /// Whether several rays per pixel are the remedy.
    pub(crate) needs_samples: bool,
    /// The description of the problem.
    pub(crate) message: String,
    /// The correction that would help.
    pub(crate) help: String,
}

/// The state of the GIF.
#[cfg_attr(
    not(any(test, feature = "server")),
    expect(dead_code, reason = "the scripts of a page without a program make it")
)]
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case", tag = "is")]
pub(crate) enum OutputState {
    /// The animation is being rendered.
    Running {
        /// The number of rendered frames.
        done: usize,
        /// The number of all frames.
        of: usize,
    },
    /// The file can be downloaded.
    Done {
        /// The size of the file.
        bytes: usize,
        format: MovieFormat,
    },
    /// The rendering was cancelled.
    Cancelled,
    /// The GIF cannot be rendered.
    Failed {
        /// The reason of the failure.
        why: String,
    },
}

#[cfg(test)]
mod typescript;
