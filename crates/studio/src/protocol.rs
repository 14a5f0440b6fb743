//! What page and server say to each other over the WebSocket: JSON both ways, and pictures (`pictures`) to the page.
//!
//! Points of the picture are in its pixels; lines count from 0.

use serde::{Deserialize, Serialize};

use crate::handles::{DragOptions, Handle, HandleKind};
use crate::project::Saved;
use crate::tables::{CommandTable, FieldTable, Role};
use crate::tracks::{KeyPlace, Tracks};

/// What the page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", rename_all_fields = "kebab-case", tag = "ask")]
pub(crate) enum ClientMessage {
    /// The viewport has this size, in pixels of the screen.
    Size { width: u32, height: u32 },
    /// A picture has been shown.
    Shown,
    /// Show a frame, counted from 0; `moving` while it is played or scrubbed.
    Frame { frame: usize, moving: bool },
    /// Select lines.
    Select { lines: Vec<usize> },
    /// What is under the pointer?
    Hover { x: f64, y: f64 },
    /// The pointer goes down: on a handle, on an object, or on nothing, which turns the camera.
    Press { x: f64, y: f64, extend: bool, grip: Option<HandleKind>, line: Option<usize> },
    /// It moves.
    Drag {
        x: f64,
        y: f64,
        #[serde(flatten)]
        options: DragOptions,
    },
    /// It goes up.
    Release,
    /// Turn, move or approach; in heights of the picture.
    Navigate { how: Navigation, x: f64, y: f64 },
    /// Look through a camera.
    Look { at: ViewPreset },
    /// What is looked through becomes the script's camera.
    KeepCamera,
    /// Numbers of a line, from number `first` on; those of one `gesture` are one step.
    Set { line: usize, first: usize, values: Vec<f64>, gesture: Option<u64> },
    /// The text of a line, or of several in its place.
    Text { line: usize, text: String },
    /// A new line in front of line `at`.
    Insert { at: usize, text: String },
    /// Lines go.
    Remove { lines: Vec<usize> },
    /// Lines again, behind themselves.
    Duplicate { lines: Vec<usize> },
    /// A line goes up or down by one object.
    Reorder { line: usize, down: bool },
    /// A name: the comment at the end of a line.
    Rename { line: usize, name: String },
    /// Lines become comments, or commands again.
    Hide { lines: Vec<usize> },
    /// Objects fall onto what is below them.
    Drop { lines: Vec<usize> },
    /// Objects stand on the height 0.
    Ground { lines: Vec<usize> },
    /// Lines cannot be taken hold of in the picture, or can again.
    Lock { lines: Vec<usize> },
    /// Lines become a group.
    Group { lines: Vec<usize> },
    /// The lines of its group take the place of a `Use`.
    Ungroup { line: usize },
    /// Objects get a material of the script.
    Surface { lines: Vec<usize>, material: String },
    /// Objects get a material to begin with.
    Preset { lines: Vec<usize>, preset: String },
    /// What concerns keys and frames.
    Time { wish: TimelineEdit },
    /// Objects move by so many steps along the axes.
    Nudge { lines: Vec<usize>, by: [f64; 3] },
    /// A new object or light; at a point of the picture, or in the middle.
    Add { command: String, at: Option<[f64; 2]> },
    /// Take back.
    Undo,
    /// Make again.
    Redo,
    /// End a conflict with what others wrote.
    Resolve { keep_mine: bool },
    /// A whole text, in place of the one that is shown, or as a new script of this name.
    Load { from: Source, new: Option<String> },
    /// Make the GIF.
    Render,
    /// Stop making it.
    Cancel,
}

/// Where a whole text comes from.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "what")]
pub(crate) enum Source {
    /// Nothing is in it.
    Empty,
    /// An example.
    Example { name: String },
    /// The page sends it.
    Text { text: String },
    /// What is shown.
    Shown,
}

/// What is wished of keys and frames.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", rename_all_fields = "kebab-case", tag = "do")]
pub(crate) enum TimelineEdit {
    /// Turns something on or off.
    Switch { what: Switch, on: bool },
    /// Keys at the frame that is shown for the main numbers of lines; where all have one there, they go.
    Key { lines: Vec<usize> },
    /// The same, for some numbers of a line.
    Toggle { line: usize, numbers: Vec<usize> },
    /// Takes hold of keys.
    Grab { keys: Vec<KeyPlace> },
    /// Those that are held go so many frames from where they were.
    Move { by: f64 },
    /// Keys go.
    Remove { keys: Vec<KeyPlace> },
    /// Keys are remembered.
    Copy { keys: Vec<KeyPlace> },
    /// What was copied, from the frame that is shown on.
    Paste,
    /// What happens between the keys of their tracks.
    Ease { keys: Vec<KeyPlace>, mode: String, cycle: bool },
    /// How many frames a second are shown.
    Pace { fps: f64 },
    /// How many frames the `Trace` is that is shown.
    Frames { count: u32 },
}

/// What is on or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Switch {
    /// Still numbers that are changed become curves.
    AutoKey,
    /// The way of what is selected.
    Path,
    /// What is selected at other frames.
    Onion,
}

/// A way to move the free camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Navigation {
    /// Around what is looked at.
    Turn,
    /// Sideways.
    Pan,
    /// Nearer (y below 0) or farther.
    Zoom,
}

/// Where to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ViewPreset {
    /// The script's camera.
    Script,
    /// A free one, from where one looks now.
    Free,
    /// From the front (along -z).
    Front,
    /// From the right (along -x).
    Side,
    /// From above.
    Top,
    /// At what is selected.
    Selection,
}

/// What the page is told; what is left out has not changed.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct ServerMessage {
    /// Once, at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tables: Option<Vec<CommandTable>>,
    /// The names of the examples, once, at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) examples: Option<Vec<&'static str>>,
    /// Whether scripts can be added, once, at the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) can_create: Option<bool>,
    /// Once, at the start: the names of materials to begin with.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) presets: Vec<&'static str>,
    /// All files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) files: Option<Vec<FileState>>,
    /// All lines of the file that is shown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) lines: Option<Vec<LineState>>,
    /// Changes of these lines, in their order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) splices: Vec<LinesChanged>,
    /// How everything stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) state: Option<State>,
    /// What is under the pointer: its line, if it is an object.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) hovered: Option<Option<usize>>,
    /// The outline of what is selected, as the path of an SVG.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) outline: Option<String>,
    /// The outline of what is under the pointer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) hover_outline: Option<String>,
    /// What is selected, at other frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) ghosts: Option<Vec<Ghost>>,
    /// The numbers that change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tracks: Option<Tracks>,
    /// How the GIF stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) output: Option<OutputState>,
    /// For people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) notice: Option<String>,
}

/// A file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct FileState {
    /// Its name.
    pub(crate) name: String,
    /// Its frames.
    pub(crate) frames: usize,
    /// Whether it has an error.
    pub(crate) faulty: bool,
}

/// A line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct LineState {
    /// Without its end.
    pub(crate) text: String,
    /// Its command's name; also of a command that is hidden in a comment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) command: Option<&'static str>,
    /// What the command is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) role: Option<Role>,
    /// The comment at its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) name: Option<String>,
    /// The name of a group or material that stands before its numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) subject: Option<String>,
    /// It is a comment now.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(crate) hidden: bool,
}

/// Some lines in place of others.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct LinesChanged {
    /// The first.
    pub(crate) at: usize,
    /// How many went.
    pub(crate) removed: usize,
    /// Those that came.
    pub(crate) lines: Vec<LineState>,
}

/// How everything stands.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct State {
    /// How many wishes were heard when it stood so.
    pub(crate) asked: u32,
    /// The animation's name.
    pub(crate) title: String,
    /// Frames a second.
    pub(crate) fps: f64,
    /// The frame that is shown, from 0.
    pub(crate) frame: usize,
    /// How many there are.
    pub(crate) frames: usize,
    /// Its file, an index of `files`.
    pub(crate) file: usize,
    /// Whether the file holds what is shown.
    pub(crate) saved: Saved,
    /// Why it cannot be written; empty where it can.
    pub(crate) failure: String,
    /// Whether there is something to undo.
    pub(crate) can_undo: bool,
    /// Whether there is something to redo.
    pub(crate) can_redo: bool,
    /// The selected lines, the main one last.
    pub(crate) selection: Vec<usize>,
    /// The main one's parameters.
    pub(crate) inspected: Option<Inspected>,
    /// Faults of the file.
    pub(crate) faults: Vec<FaultState>,
    /// What can be dragged.
    pub(crate) handles: Vec<Handle>,
    /// The ground's grid, as the path of an SVG.
    pub(crate) grid: String,
    /// The way of what is selected, as the path of an SVG.
    pub(crate) way: String,
    /// Where its keys are, as dots of the path of an SVG.
    pub(crate) marks: String,
    /// Lines that cannot be taken hold of in the picture.
    pub(crate) locked: Vec<usize>,
    /// Frames and keys.
    pub(crate) time: TimeState,
    /// Whether one looks through a free camera.
    pub(crate) free: bool,
    /// The picture that was ordered last: its number, width and height; none where there is nothing to draw.
    pub(crate) picture: Option<(u32, u32, u32)>,
}

/// A line's parameters.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Inspected {
    /// The line.
    pub(crate) line: usize,
    /// Its command.
    pub(crate) command: &'static str,
    /// Its words as they are now; those that are no numbers are `null` here.
    pub(crate) values: Vec<Option<f64>>,
    /// Which of them change.
    pub(crate) curves: Vec<usize>,
    /// Which of these have a key just here.
    pub(crate) keyed: Vec<usize>,
    /// Whether they may change.
    pub(crate) can_key: bool,
    /// The name that stands in the place of coefficients.
    pub(crate) material: Option<String>,
    /// The name that stands before the numbers.
    pub(crate) subject: String,
    /// The parameters of a material, which each has others of.
    pub(crate) fields: Vec<FieldTable>,
}

/// Frames and keys.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TimeState {
    /// The number of the frame that is shown: the time at which curves are read.
    pub(crate) number: f64,
    /// The first number of its `Trace`.
    pub(crate) first: u32,
    /// The last.
    pub(crate) last: u32,
    /// Which of all frames has the first number, from 0.
    pub(crate) start: usize,
    /// Whether still numbers that are changed become curves.
    pub(crate) auto_key: bool,
    /// Whether the way of what is selected is shown.
    pub(crate) path: bool,
    /// Whether it is shown at other frames.
    pub(crate) onion: bool,
    /// How many keys were copied.
    pub(crate) copied: usize,
}

/// The outline of what is selected at another frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Ghost {
    /// As the path of an SVG.
    pub(crate) path: String,
    /// How many steps later, or, below 0, before.
    pub(crate) after: i32,
}

/// What is wrong with a line.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct FaultState {
    /// The line.
    pub(crate) line: usize,
    /// Its first character, from 0.
    pub(crate) column: usize,
    /// How many characters.
    pub(crate) length: usize,
    /// Whether nothing is rendered for it.
    pub(crate) error: bool,
    /// What is wrong.
    pub(crate) message: String,
    /// What would be right.
    pub(crate) help: String,
}

/// How the GIF stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "is")]
pub(crate) enum OutputState {
    /// Being made.
    Running {
        /// Frames that are drawn.
        done: usize,
        /// Of so many.
        of: usize,
    },
    /// It can be fetched.
    Done {
        /// Its size.
        bytes: usize,
    },
    /// It was cancelled.
    Cancelled,
    /// It cannot be made.
    Failed {
        /// Why.
        why: String,
    },
}
