// The messages between page and server. Made of the server's types by
// `SNAPSHOTS=overwrite cargo test -p rayfold-studio typescript`.
//
// Points are in pixels of the picture. Lines count from 0.

/** A message of the page. */
export type ClientMessage = { "ask": "size", width: number, height: number, } | { "ask": "shown" } | { "ask": "frame", frame: number, moving: boolean, } | { "ask": "select", lines: ReadonlyArray<number>, } | { "ask": "hover", x: number, y: number, } | { "ask": "press", x: number, y: number, extend: boolean, grip: HandleKind | null, line: number | null, } | { "ask": "drag", x: number, y: number, 
/** Move up and down instead of along the ground. */
upright: boolean, 
/** Align with other objects, else move in steps of a grid. */
snap: boolean, 
/** Move curves as a whole, in all frames. */
whole: boolean, } | { "ask": "release" } | { "ask": "navigate", how: Navigation, x: number, y: number, } | { "ask": "look", at: ViewPreset, } | { "ask": "draft", on: boolean, } | { "ask": "keep-camera" } | { "ask": "set", line: number, first: number, values: ReadonlyArray<number>, gesture: number | null, } | { "ask": "give-up", gesture: number | null, } | { "ask": "edit", file: number, version: number, changes: ReadonlyArray<TextChange>, } | { "ask": "remove", lines: ReadonlyArray<number>, } | { "ask": "duplicate", lines: ReadonlyArray<number>, } | { "ask": "reorder", line: number, down: boolean, } | { "ask": "rename", line: number, name: string, } | { "ask": "hide", lines: ReadonlyArray<number>, } | { "ask": "drop", lines: ReadonlyArray<number>, } | { "ask": "ground", lines: ReadonlyArray<number>, } | { "ask": "lock", lines: ReadonlyArray<number>, } | { "ask": "paste", text: string, } | { "ask": "align", lines: ReadonlyArray<number>, axis: number, how: Alignment, } | { "ask": "box", from: readonly [number, number], to: readonly [number, number], extend: boolean, } | { "ask": "group", lines: ReadonlyArray<number>, } | { "ask": "ungroup", line: number, } | { "ask": "surface", lines: ReadonlyArray<number>, material: string, } | { "ask": "preset", lines: ReadonlyArray<number>, preset: string, } | { "ask": "paint", at: readonly [number, number], material: string, preset: boolean, } | { "ask": "clause", line: number, clause: string, } | { "ask": "words", line: number, text: string, } | { "ask": "word", line: number, number: number, word: string, } | { "ask": "camera", command: string, } | { "ask": "time", wish: TimelineEdit, } | { "ask": "nudge", lines: ReadonlyArray<number>, by: readonly [number, number, number], } | { "ask": "add", command: string, at: readonly [number, number] | null, } | { "ask": "undo" } | { "ask": "redo" } | { "ask": "resolve", "keep-mine": boolean, } | { "ask": "load", from: Source, new: string | null, } | { "ask": "render", format: MovieFormat, } | { "ask": "cancel" };

/** The source of a whole text. */
export type Source = { "what": "empty" } | { "what": "example", name: string, } | { "what": "text", text: string, } | { "what": "shown" };

/** An edit of the timeline. */
export type TimelineEdit = { "do": "switch", what: Switch, on: boolean, } | { "do": "key", lines: ReadonlyArray<number>, } | { "do": "toggle", line: number, numbers: ReadonlyArray<number>, } | { "do": "grab", keys: ReadonlyArray<KeyPlace>, } | { "do": "move", by: number, value: number, } | { "do": "remove", keys: ReadonlyArray<KeyPlace>, } | { "do": "copy", keys: ReadonlyArray<KeyPlace>, } | { "do": "paste" } | { "do": "ease", keys: ReadonlyArray<KeyPlace>, mode: string, cycle: boolean, } | { "do": "pace", fps: number, } | { "do": "frames", count: number, };

/** An option of the timeline. */
export type Switch = "auto-key" | "path" | "onion";

/** A way to move the free camera. */
export type Navigation = "turn" | "pan" | "zoom";

/** A camera to look through. */
export type ViewPreset = "script" | "free" | "front" | "side" | "top" | "opposite" | "selection";

/** The modifiers of a drag. */
export type DragOptions = { 
/** Move up and down instead of along the ground. */
upright: boolean, 
/** Align with other objects, else move in steps of a grid. */
snap: boolean, 
/** Move curves as a whole, in all frames. */
whole: boolean, };

/** A replacement of some lines of an editor by others. */
export type TextChange = { 
/** The index of the first line, from 0. */
at: number, 
/** The number of removed lines, at least 1. */
removed: number, 
/** The texts of the inserted lines, at least one. */
lines: ReadonlyArray<string>, };

/** The position of a key. */
export type KeyPlace = { 
/** The index of its line, from 0. */
line: number, 
/** The index among the line's parameters, from 0. */
number: number, 
/** The frame of the key. */
frame: number, };

/** A message to the page. Omitted fields have not changed. */
export type ServerMessage = { 
/** The table of the language, sent once at the start. */
language?: Language, 
/** The tables of the commands, sent once at the start. */
tables?: ReadonlyArray<CommandTable>, 
/** The names of the examples, sent once at the start. */
examples?: ReadonlyArray<string>, 
/** Whether scripts can be added, sent once at the start. */
canCreate?: boolean, 
/** Whether there is a bucket to submit to, sent once at the start. */
canSubmit?: boolean, 
/** The names of the starter materials, sent once at the start. */
presets?: ReadonlyArray<string>, files?: ReadonlyArray<FileState>, 
/** All lines of the shown file. */
lines?: ReadonlyArray<LineState>, 
/** The changes of these lines, in order. */
splices?: ReadonlyArray<LinesChanged>, 
/** The version of the shown text, with every change of its lines. */
text?: TextState, 
/** Whether an edit of the page's text was applied. */
accepted?: boolean, 
/** The state of the whole page. */
state?: State, 
/** The line of the object under the pointer, if there is one. */
hovered?: number | null, 
/** The outline of the selection, as an SVG path. */
outline?: string, 
/** The outline of the object under the pointer. */
hoverOutline?: string, 
/** A text for the clipboard. */
clipboard?: string, 
/** The lines to the objects that a drag is aligned with, as an SVG path. */
guides?: string, 
/** The outlines of the selection at other frames. */
ghosts?: ReadonlyArray<Ghost>, 
/** The numbers that change. */
tracks?: Tracks, 
/** The state of the rendered animation. */
output?: OutputState, 
/** A message for the user. */
notice?: string, };

/** The state of a file. */
export type FileState = { name: string, 
/** The number of its frames. */
frames: number, 
/** Whether the file has an error. */
faulty: boolean, };

/** The state of a line. */
export type LineState = { 
/** The text without the line end. */
text: string, 
/** The name of the command, also of one that is hidden in a comment. */
command?: string, 
/** The role of the command. */
role?: Role, 
/** The comment at the end of the line. */
name?: string, 
/** The name of a group or material before the numbers. */
subject?: string, 
/** The command is hidden in a comment. */
hidden?: boolean, };

/** The version of a text. */
export type TextState = { 
/** The index of the file. */
file: number, 
/** A number that changes with the text, except by the edits of the page's own editor. */
version: number, 
/** Whether the last line has a line end. */
ends: boolean, };

/** A replacement of some lines by others. */
export type LinesChanged = { 
/** The index of the first line. */
at: number, 
/** The number of removed lines. */
removed: number, 
/** The inserted lines. */
lines: ReadonlyArray<LineState>, };

/** The state of the page. */
export type State = { 
/** The number of messages that had been received. */
asked: number, 
/** The name of the animation. */
title: string, 
/** The number of frames per second. */
fps: number, 
/** The index of the shown frame, from 0. */
frame: number, 
/** The number of frames. */
frames: number, 
/** The file of the frame, as an index of `files`. */
file: number, 
/** Whether the file on disk has the shown content. */
saved: Saved, 
/** The reason why the file cannot be written; empty if it can. */
failure: string, canUndo: boolean, canRedo: boolean, 
/** The selected lines, the main one last. */
selection: ReadonlyArray<number>, 
/** The parameters of the main selected line. */
inspected: Inspected | null, 
/** The parameters of the frame's settings, of those that have a line. */
settings: ReadonlyArray<Inspected>, 
/** The directions of x, y and z in the picture. */
axes: readonly [[number, number], [number, number], [number, number]], 
/** The line of the frame's camera. */
camera: number | null, 
/** The script's camera as the free camera sees it, as an SVG path. */
frustum: string, 
/** The errors and warnings of the file. */
faults: ReadonlyArray<FaultState>, 
/** The handles that can be dragged. */
handles: ReadonlyArray<Handle>, 
/** The grid on the ground, as an SVG path. */
grid: string, 
/** The motion path of the selection, as an SVG path. */
way: string, 
/** The keys on the motion path, as dots of an SVG path. */
marks: string, 
/** The lines that cannot be dragged in the picture. */
locked: ReadonlyArray<number>, 
/** The state of frames and keys. */
time: TimeState, 
/** Whether the view is that of a free camera. */
free: boolean, 
/** Whether the viewport leaves out indirect light, or `null` if the scene has none. */
draft: boolean | null, 
/** Number, width and height of the picture that was requested last; `None` if there is nothing to draw. */
picture: readonly [number, number, number] | null, };

/** The parameters of a line. */
export type Inspected = { line: number, 
/** The name of the command. */
command: string, 
/** The current numbers of the parameters; `null` for a word that is no number. */
values: ReadonlyArray<number | null>, 
/** The words that are neither numbers nor curves, by their positions. */
words: { [key in number]: string }, 
/** The parameters that are curves. */
curves: ReadonlyArray<number>, 
/** The curves that have a key at the shown frame. */
keyed: ReadonlyArray<number>, 
/** Whether the parameters may be curves. */
canKey: boolean, 
/** The name of a material in place of coefficients. */
material: string | null, 
/** The name before the numbers. */
subject: string, 
/** The words of a text, without quotes. */
text: string | null, 
/** The parameters of a material, which depend on its clauses. */
fields: ReadonlyArray<FieldTable>, };

/** The state of frames and keys. */
export type TimeState = { 
/** The number of the shown frame, at which curves are evaluated. */
number: number, 
/** The first frame number of its `Trace`. */
first: number, 
/** The last frame number of its `Trace`. */
last: number, 
/** The index of the first number among all frames, from 0. */
start: number, 
/** Whether changing a constant number makes it a curve. */
autoKey: boolean, 
/** Whether the motion path of the selection is shown. */
path: boolean, 
/** Whether the selection is outlined at other frames. */
onion: boolean, 
/** The number of copied keys. */
copied: number, };

/** The outline of the selection at another frame. */
export type Ghost = { 
/** The outline as an SVG path. */
path: string, 
/** The number of steps after the shown frame, or, below 0, before it. */
after: number, };

/** An error or a warning of a line. */
export type FaultState = { 
/** The index of the line. */
line: number, 
/** The first character, from 0. */
column: number, 
/** The number of characters. */
length: number, 
/** Whether it prevents rendering. */
error: boolean, 
/** Whether several rays per pixel are the remedy. */
needsSamples: boolean, 
/** The description of the problem. */
message: string, 
/** The correction that would help. */
help: string, };

/** The state of the GIF. */
export type OutputState = { "is": "running", 
/** The number of rendered frames. */
done: number, 
/** The number of all frames. */
of: number, } | { "is": "done", 
/** The size of the file. */
bytes: number, format: MovieFormat, } | { "is": "cancelled" } | { "is": "failed", 
/** The reason of the failure. */
why: string, };

/** The file format of a rendered animation. */
export type MovieFormat = "gif" | "apng" | "webp";

/** Whether a file on disk has the shown content. */
export type Saved = "yes" | "soon" | "conflict" | "failed";

/** The parts of objects that are aligned along an axis. */
export type Alignment = "least" | "middle" | "most" | "distribute";

/** The kind of a handle. */
export type HandleKind = { "what": "body" } | { "what": "axis", 
/** The index of the axis. */
axis: number, } | { "what": "plane", 
/** The index of the axis across the plane. */
axis: number, } | { "what": "point", 
/** The index in the line's numbers, from 0. */
first: number, } | { "what": "length", 
/** The index in the line's numbers, from 0. */
first: number, } | { "what": "direction", 
/** The index in the line's numbers, from 0. */
first: number, } | { "what": "turn", 
/** The index in the line's numbers, from 0. */
first: number, 
/** The axis of the angle: 0 is x. */
axis: number, } | { "what": "key", 
/** The frame of the key. */
frame: number, } | { "what": "scale", 
/** The index in the line's numbers, from 0. */
first: number, } | { "what": "size" };

/** A handle in the picture. */
export type Handle = { 
/** The kind of the handle. */
grip: HandleKind, 
/** The index of its line in the script, from 0. */
line: number, 
/** A description for screen readers. */
label: string, 
/** The position in pixels. */
at: readonly [number, number], 
/** The start of the line to the handle, in pixels. */
from: readonly [number, number], 
/** The path along which the handle moves, as an SVG path. */
way?: string, };

/** The role of a command on the page. */
export type Role = "object" | "light" | "use" | "group" | "material" | "camera" | "setting";

/** The table of a command. */
export type CommandTable = { 
/** The name in scripts. */
name: string, 
/** The role on the page. */
role: Role, 
/** The parameters of the command. */
fields: ReadonlyArray<FieldTable>, };

/** The table of a parameter. */
export type FieldTable = { 
/** The name of the parameter, such as `radius`. */
label: string, 
/** The names of its numbers. */
names: ReadonlyArray<string>, 
/** The measured quantity, such as `length`. */
kind: string, 
/** The unit, such as `world units`. */
unit: string, 
/** The allowed values, such as `greater than 0`. */
values: string, 
/** The least value, if there is one. */
minimum?: number, 
/** Whether the least value itself is excluded. */
aboveMinimum: boolean, 
/** The greatest value, if there is one. */
maximum?: number, 
/** Whether only whole numbers are allowed. */
whole: boolean, 
/** The words that it can be, if it is no number. */
words?: ReadonlyArray<string>, 
/** Whether the parameter is optional. */
optional: boolean, 
/** The position of its first number among those of the command. */
first: number, 
/** Whether it is never a curve, in a command whose other parameters may be. */
fixed: boolean, };

/** A number that changes. */
export type Track = { 
/** The index of its line, from 0. */
line: number, 
/** The index among the line's parameters, from 0. */
number: number, 
/** The name of the parameter, such as `centre: cx`. */
label: string, 
/** The interpolation as in a script: a word, and after `bezier` its four numbers. */
mode: string, 
/** Whether the curve restarts at its last key. */
cycle: boolean, 
/** Frames and values of the keys. */
keys: ReadonlyArray<[number, number]>, 
/** The curve as a path of SVG, in frames and values. */
path: string, };

/** All tracks of a script, up to the limit of the page. */
export type Tracks = { 
/** The tracks in the order of the text. */
tracks: ReadonlyArray<Track>, 
/** Whether there are more. */
more: boolean, };

export type Language = { version: number, commands: ReadonlyArray<LanguageEntry>, clauses: ReadonlyArray<LanguageEntry>, curve_modes: ReadonlyArray<CurveMode>, };

export type LanguageEntry = { name: string, usage: string, about: string, subject?: LanguageSubject, parameters: ReadonlyArray<LanguageParameter>, together?: ReadonlyArray<string>, curves: boolean, material_instead_from?: string, word_instead?: string, ends_with?: string, };

export type LanguageSubject = { role: string, of: string, };

export type LanguageParameter = { names: ReadonlyArray<string>, meaning: string, kind: string, unit: string, range: string, minimum?: number, above_minimum?: boolean, maximum?: number, below_maximum?: boolean, whole?: boolean, words?: ReadonlyArray<string>, presence: string, default?: string, fixed?: boolean, };

export type CurveMode = { name: string, about: string, };

/** A run in a list. */
export type Summary = { 
/** The name of the run, which is its address. */
run: string, 
/** A word: the status of the manifest, or the reason why there is none. */
status: string, 
/** The number of rendered frames. */
done: number, 
/** The number of frames that failed. */
failed: number, 
/** The number of all frames. */
total: number, 
/** There are scripts that the functions have not seen. */
behind: boolean, 
/** Nothing more will happen unless a script changes. */
settled: boolean, 
/** The existing files, in the order in which the settings ask for them. */
files: ReadonlyArray<RunFile>, };

/** A file in the bucket that was made of an animation. */
export type RunFile = { 
/** The ending of its name, without a dot. */
ending: string, 
/** The name of its format. */
format: string, 
/** The size of the file. */
bytes: number, 
/** The version, so that another file has another address. */
version: string, 
/** The file shows the newest scripts. */
current: boolean, };

/** An update of a run. Contains only the frames that changed since the last update. */
export type RunUpdate = { 
/** All frames, in the first update. */
frames?: ReadonlyArray<FrameUpdate>, 
/** The changed frames with their indices from 0. */
changed?: ReadonlyArray<[number, FrameUpdate]>, 
/** The errors that keep it from being done. */
faults: ReadonlyArray<FaultInfo>, 
/** The number of errors that are not listed. */
moreFaults: number, 
/** The progress of the upload, if this program uploads it. */
sending: UploadProgress | null, 
/** The reason why nothing newer is known. */
problem: string | null, 
/** The name of the run, which is its address. */
run: string, 
/** A word: the status of the manifest, or the reason why there is none. */
status: string, 
/** The number of rendered frames. */
done: number, 
/** The number of frames that failed. */
failed: number, 
/** The number of all frames. */
total: number, 
/** There are scripts that the functions have not seen. */
behind: boolean, 
/** Nothing more will happen unless a script changes. */
settled: boolean, 
/** The existing files, in the order in which the settings ask for them. */
files: ReadonlyArray<RunFile>, };

/** The state of a run without its frames. */
export type RunState = { 
/** The errors that keep it from being done. */
faults: ReadonlyArray<FaultInfo>, 
/** The number of errors that are not listed. */
moreFaults: number, 
/** The progress of the upload, if this program uploads it. */
sending: UploadProgress | null, 
/** The reason why nothing newer is known. */
problem: string | null, 
/** The name of the run, which is its address. */
run: string, 
/** A word: the status of the manifest, or the reason why there is none. */
status: string, 
/** The number of rendered frames. */
done: number, 
/** The number of frames that failed. */
failed: number, 
/** The number of all frames. */
total: number, 
/** There are scripts that the functions have not seen. */
behind: boolean, 
/** Nothing more will happen unless a script changes. */
settled: boolean, 
/** The existing files, in the order in which the settings ask for them. */
files: ReadonlyArray<RunFile>, };

/** The state of a frame. */
export type FrameUpdate = { 
/** The name of its script. */
script: string, 
/** The version of the script. */
version: string, 
/** The number of the frame within the script. */
part?: number, 
/** The status of the frame. */
state: FrameStatus, 
/** The pixel version of the renderer, if the frame is rendered. */
pixels?: number, };

/** The status of a frame. */
export type FrameStatus = "pending" | "done" | "failed";

/** An error that keeps a run from being done. */
export type FaultInfo = { 
/** The faulty object, for messages. */
what: string, 
/** The script, if the object is a frame. */
script?: string, 
/** The number of the frame within the script. */
part?: number, 
/** Line and column from 1, if a line has an error. */
place?: readonly [number, number], 
/** The description of the problem. */
message: string, 
/** The correction that would help. */
help: string, };

/** The progress of an upload. */
export type UploadProgress = { "is": "uploading", 
/** The number of uploaded scripts. */
done: number, 
/** The number of scripts to upload. */
total: number, } | { "is": "failed", 
/** The reason of the failure. */
why: string, };

/**
 * Bytes before the pixels of a picture: number, width, height, microseconds, 1 if it is final or 2 if it is simplified;
 * then left, top, width and height of the part that differs from the previous picture, whose pixels follow;
 * little-endian.
 */
export const PICTURE_HEADER = 36;
