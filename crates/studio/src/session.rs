//! The editor session of one page: view, selection, drag. Turns each message of the page into edits of the
//! project and a reply.
//!
//! Knows no socket and no thread, so tests need neither.

mod editing;
mod fields;
mod held_keys;
mod hold;
mod loading;
mod replies;
mod text;
mod time;
mod viewport;

use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayfold_scene::{Clause, Command, language};

use crate::arrange;
use crate::edits;
use crate::error::words;
use crate::examples;
use crate::frame::Frame;
use crate::line::Line;
use crate::materials;
use crate::names;
use crate::project::{Place, Project};
use crate::protocol::{ClientMessage, FileState, MovieFormat, ServerMessage};
use crate::snap_to_ground;
use crate::tables::{Role, commands, role};
use crate::tracks::{self, Copied, Tracks};
use crate::values::changed;
use crate::view::Orbit;
use crate::wanted::Wanted;
use editing::of_page;
use hold::Held;

/// The reply to a move of a line without a position.
const NO_POSITION: &str =
    "The selection has no position of its own. Models and words move in a group: Ctrl+G makes one.";

/// The largest text that the page may send for a line, in bytes.
const TEXT: usize = 1 << 20;

/// The editor session of a page.
#[derive(Debug)]
pub(crate) struct Session {
    size: (u32, u32),
    frame: usize,
    /// The free camera, if it is in use.
    free: Option<Orbit>,
    /// The viewport leaves out indirect light.
    is_draft: bool,
    selection: Vec<usize>,
    held: Option<Held>,
    /// The number of messages received.
    asked: u32,
    gestures: u64,
    /// The line that is being typed in, and its gesture.
    typing: Option<(usize, u64)>,
    pictures: u32,
    /// The lines that cannot be dragged in the picture, each with its file. They last as long as the page is open,
    /// because the script does not contain them.
    locked: Vec<(usize, usize)>,
    /// The line of the object under the pointer.
    hovered: Option<usize>,
    /// Changing a constant number makes it a curve.
    auto_key: bool,
    /// The motion path of the selection is shown.
    path: bool,
    /// The selection is outlined at other frames.
    onion: bool,
    copied: Vec<Copied>,
    /// The text of the copied keys.
    copied_text: String,
    /// The state that was sent to the page last.
    tracks: Option<Tracks>,
    files: Vec<FileState>,
    shown_file: usize,
    /// The version of each file's text, and the last version of any.
    versions: BTreeMap<usize, u32>,
    version: u32,
    /// The action that the server must take on the rendered animation.
    output: Option<Output>,
}

/// An action on the rendered animation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Output {
    /// Start rendering the animation.
    Render(MovieFormat),
    /// Stop rendering the animation.
    Cancel,
}

/// The result of a message.
#[derive(Debug, Default)]
pub(crate) struct Answer {
    /// The reply to the page.
    pub(crate) tell: ServerMessage,
    /// The picture that the page gets.
    pub(crate) picture: Option<Wanted>,
    /// The page has shown a picture.
    pub(crate) shown: bool,
    /// The action on the GIF.
    pub(crate) output: Option<Output>,
}

/// The effect of a message on the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    Nothing,
    /// The picture changes and soon will again.
    Moving,
    /// The picture changes.
    Still,
}

impl Session {
    /// Makes the session of a page that has just opened, and its first reply.
    pub(crate) fn open(project: &Project) -> (Self, Answer) {
        let mut session = Self {
            size: (960, 540),
            frame: 0,
            free: None,
            is_draft: false,
            selection: Vec::new(),
            held: None,
            asked: 0,
            gestures: 0,
            typing: None,
            pictures: 0,
            locked: Vec::new(),
            hovered: None,
            auto_key: false,
            path: true,
            onion: false,
            copied: Vec::new(),
            copied_text: String::new(),
            tracks: None,
            files: Vec::new(),
            shown_file: 0,
            versions: BTreeMap::new(),
            version: 0,
            output: None,
        };
        let tell = ServerMessage {
            language: Some(language()),
            tables: Some(commands()),
            examples: Some(examples::names()),
            can_create: Some(project.can_create()),
            presets: materials::presets(),
            lines: Some(session.lines(project)),
            notice: None,
            ..ServerMessage::default()
        };
        let answer = session.answer(project, tell, Change::Nothing);
        (session, answer)
    }

    /// Handles a message of the page.
    pub(crate) fn ask(&mut self, project: &mut Project, ask: ClientMessage) -> Answer {
        self.asked = self.asked.wrapping_add(1);
        let mut tell = ServerMessage::default();
        let change = self.run(project, ask, &mut tell);
        match change {
            None => Answer { shown: true, ..Answer::default() },
            Some(change) => {
                let output = self.output.take();
                Answer { output, ..self.answer(project, tell, change) }
            }
        }
    }

    /// Adopts changes that other programs made to the shown file, and writes pending changes.
    pub(crate) fn tick(&mut self, project: &mut Project) -> Option<Answer> {
        let saved = project.save(false);
        let place = self.place(project);
        let looked = if self.held.is_none() { project.files[place.file].look() } else { None };
        let pace = project.look_at_settings();
        if looked.is_none() && !saved && matches!(pace, Ok(false)) {
            return None;
        }
        let mut tell = ServerMessage::default();
        if let Err(error) = pace {
            tell.notice = Some(words(&error));
        }
        let change = match looked {
            Some(splices) if !splices.is_empty() => {
                tell.notice = Some(format!("{} was changed on the disk", project.files[place.file].name));
                self.send_splices(splices, &mut tell);
                self.keep_file(project);
                Change::Still
            }
            _ => Change::Nothing,
        };
        Some(self.answer(project, tell, change))
    }

    /// Handles a message. Returns `None` if there is nothing to reply.
    fn run(&mut self, project: &mut Project, ask: ClientMessage, tell: &mut ServerMessage) -> Option<Change> {
        if !matches!(
            ask,
            ClientMessage::Shown
                | ClientMessage::Size { .. }
                | ClientMessage::Hover { .. }
                | ClientMessage::Edit { .. }
        ) {
            self.typing = None;
        }
        Some(match ask {
            ClientMessage::Shown => return None,
            ClientMessage::Size { width, height } => {
                self.size = (width.max(1), height.max(1));
                Change::Still
            }
            ClientMessage::Frame { frame, moving } => {
                self.show(project, frame, tell);
                if moving {
                    (tell.outline, tell.ghosts) = (Some(String::new()), Some(Vec::new()));
                    return Some(Change::Moving);
                }
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Select { lines } => {
                self.select(project, lines);
                self.outline(project, tell);
                Change::Nothing
            }
            ClientMessage::Hover { x, y } => {
                self.hover(project, x, y, tell);
                Change::Nothing
            }
            ClientMessage::Press { x, y, extend, grip, line } => {
                self.press(project, DVec2::new(x, y), extend, grip.zip(line));
                self.outline(project, tell);
                Change::Nothing
            }
            ClientMessage::Drag { x, y, options } => self.drag(project, DVec2::new(x, y), options, tell),
            ClientMessage::Release => {
                self.release(project, tell);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Navigate { how, x, y } => {
                self.navigate(project, how, DVec2::new(x, y));
                tell.outline = Some(String::new());
                Change::Moving
            }
            ClientMessage::Look { at } => {
                self.look(project, at);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Draft { on } => {
                self.is_draft = on;
                Change::Still
            }
            ClientMessage::KeepCamera => self.keep_camera(project, None, tell),
            ClientMessage::Camera { command } => {
                let kind = Command::from_name(&command).filter(|&command| role(command) == Role::Camera);
                if kind.is_some() { self.keep_camera(project, kind, tell) } else { Change::Nothing }
            }
            ClientMessage::Set { line, first, values, gesture } => {
                let keying = self.keying(project);
                let to = self.line(project, line).and_then(|line| changed(line, first, &values, keying));
                let is_fit = values.iter().all(|value| value.is_finite()) && first + values.len() <= 64;
                match to {
                    Some(to) if is_fit => {
                        self.edit(project, vec![edits::set(line, to)], gesture.map(of_page), tell);
                        if gesture.is_some() { Change::Moving } else { Change::Still }
                    }
                    _ => Change::Nothing,
                }
            }
            ClientMessage::GiveUp { gesture } => {
                self.give_up(project, gesture, tell);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Edit { file, version, changes } => {
                self.edit_text(project, file, version, &changes, tell)
            }
            ClientMessage::Remove { lines } => {
                self.edit(project, edits::remove(&lines), None, tell);
                self.select(project, Vec::new());
                Change::Still
            }
            ClientMessage::Duplicate { lines } => {
                let size = self.step(project) * 40.0;
                let (splices, copies) = edits::duplicate(self.file_lines(project), &lines, size);
                self.edit(project, splices, None, tell);
                self.select(project, copies);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Reorder { line, down } => {
                let shown = self.shown(project);
                if let Some((splices, at)) =
                    edits::reorder(self.file_lines(project), &shown.source_map, line, down)
                {
                    self.edit(project, splices, None, tell);
                    self.select(project, vec![at]);
                }
                Change::Still
            }
            ClientMessage::Rename { line, name } => {
                match names::rename(self.file_lines(project), line, &name) {
                    Ok(splices) => self.edit(project, splices, None, tell),
                    Err(refusal) => tell.notice = Some(refusal),
                }
                Change::Still
            }
            ClientMessage::Words { line, text } => {
                let splice = names::set_words(self.file_lines(project), line, &text);
                self.edit(project, splice.into_iter().collect(), None, tell);
                Change::Still
            }
            ClientMessage::Hide { lines } => {
                let splices = edits::hide(self.file_lines(project), &lines);
                self.edit(project, splices, None, tell);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Drop { lines } => {
                let shown = self.shown(project);
                if let Some(scene) = self.sound_scene(project) {
                    let (of, keying) = (self.file_lines(project), self.keying(project));
                    let splices = snap_to_ground::drop_down(of, &shown.source_map, &scene, &lines, keying);
                    self.edit(project, splices, None, tell);
                    self.outline(project, tell);
                }
                Change::Still
            }
            ClientMessage::Ground { lines } => {
                let shown = self.shown(project);
                if let Some(scene) = self.sound_scene(project) {
                    let (of, keying) = (self.file_lines(project), self.keying(project));
                    let splices = snap_to_ground::to_ground(of, &shown.source_map, &scene, &lines, keying);
                    self.edit(project, splices, None, tell);
                    self.outline(project, tell);
                }
                Change::Still
            }
            ClientMessage::Lock { lines } => {
                self.lock(project, &lines);
                Change::Nothing
            }
            ClientMessage::Paste { text } => {
                if let Some(keys) = tracks::keys_of_text(&text) {
                    return Some(self.paste_keys_of_text(project, &text, &keys, tell));
                }
                let shown = self.shown(project);
                let (splices, places) = arrange::paste(self.file_lines(project), &shown.source_map, &text);
                self.edit(project, splices, None, tell);
                self.select(project, places);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Align { lines, axis, how } => {
                let boxes = self.boxes(project, |line| lines.contains(&line));
                let keying = self.keying(project);
                let splices = arrange::align(self.file_lines(project), &boxes, axis.min(2), how, keying);
                self.edit(project, splices, None, tell);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Box { from, to, extend } => {
                self.select_box(project, from.into(), to.into(), extend);
                self.outline(project, tell);
                Change::Nothing
            }
            ClientMessage::Group { lines } => {
                self.group(project, &lines, tell);
                Change::Still
            }
            ClientMessage::Ungroup { line } => {
                self.ungroup(project, line, tell);
                Change::Still
            }
            ClientMessage::Surface { lines, material } => {
                let of = self.file_lines(project);
                let splices = if material.is_empty() {
                    materials::take(of, &lines)
                } else {
                    materials::give(of, &lines, &material)
                };
                self.edit(project, splices, None, tell);
                Change::Still
            }
            ClientMessage::Paint { at: [x, y], material, preset } => {
                let under: Vec<_> = self.pick(project, x, y).into_iter().map(|(line, _)| line).collect();
                let give = if preset { materials::give_preset } else { materials::give };
                let splices = give(self.file_lines(project), &under, &material);
                self.edit(project, splices, None, tell);
                Change::Still
            }
            ClientMessage::Clause { line, clause } => {
                let lines = self.file_lines(project);
                let file = project.files.get(self.place(project).file);
                let pictures = file.map(|file| file.surface_pictures()).unwrap_or_default();
                let clause = Clause::from_name(&clause);
                match clause.map(|clause| materials::toggle(lines, line, clause, &pictures)) {
                    Some(Ok(splices)) => self.edit(project, splices, None, tell),
                    Some(Err(refusal)) => tell.notice = Some(refusal.into()),
                    None => {}
                }
                Change::Still
            }
            ClientMessage::Word { line, number, word } => {
                self.set_word(project, line, number, &word, tell);
                Change::Still
            }
            ClientMessage::Preset { lines, preset } => {
                let splices = materials::give_preset(self.file_lines(project), &lines, &preset);
                self.edit(project, splices, None, tell);
                Change::Still
            }
            ClientMessage::Time { wish } => self.edit_timeline(project, wish, tell),
            ClientMessage::Nudge { lines, by } => {
                let by = DVec3::from(by) * self.step(project) * 10.0;
                let keying = self.keying(project);
                let splices = lines
                    .iter()
                    .filter_map(|&at| {
                        Some(edits::set(at, edits::moved(self.line(project, at)?, by, keying)?))
                    })
                    .collect::<Vec<_>>();
                if splices.is_empty() && !lines.is_empty() {
                    tell.notice = Some(NO_POSITION.into());
                }
                self.edit(project, splices, None, tell);
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Add { command, at } => {
                self.add(project, &command, at.map(DVec2::from), tell);
                Change::Still
            }
            ClientMessage::Undo | ClientMessage::Redo => {
                let file = self.place(project).file;
                match project.step(file, matches!(ask, ClientMessage::Undo)) {
                    Ok(splices) => self.send_splices(splices, tell),
                    Err(error) => tell.notice = Some(words(&error)),
                }
                self.keep_file(project);
                self.select(project, self.selection.clone());
                self.outline(project, tell);
                Change::Still
            }
            ClientMessage::Resolve { keep_mine } => {
                let file = self.place(project).file;
                let splices = project.files[file].resolve(keep_mine);
                self.send_splices(splices, tell);
                Change::Still
            }
            ClientMessage::Load { from, new } => self.load(project, from, new.as_deref(), tell),
            ClientMessage::Render { format } => {
                self.output = Some(Output::Render(format));
                Change::Nothing
            }
            ClientMessage::Cancel => {
                self.output = Some(Output::Cancel);
                Change::Nothing
            }
        })
    }

    fn place(&self, project: &Project) -> Place {
        project.place(self.frame)
    }

    fn file_lines<'a>(&self, project: &'a Project) -> &'a [Line] {
        project.files[self.place(project).file].document.lines()
    }

    fn line<'a>(&self, project: &'a Project, at: usize) -> Option<&'a Line> {
        self.file_lines(project).get(at)
    }

    /// Returns the frame that is shown.
    fn shown(&self, project: &Project) -> Arc<Frame> {
        let place = self.place(project);
        project.files[place.file].frame(place.frame)
    }

    fn select(&mut self, project: &Project, lines: Vec<usize>) {
        let count = self.file_lines(project).len();
        // If a line is named twice, the last position counts.
        let mut named = HashSet::new();
        let last = |line: &usize| *line < count && named.insert(*line);
        self.selection = lines.into_iter().rev().filter(last).collect();
        self.selection.reverse();
    }

    /// Keeps the shown file when it has fewer frames than before.
    fn keep_file(&mut self, project: &Project) {
        if self.shown_file < project.files.len() && self.place(project).file != self.shown_file {
            let frames = project.files[self.shown_file].frame_count();
            self.frame = project.first_frame(self.shown_file) + frames - 1;
        }
    }

    fn show(&mut self, project: &Project, frame: usize, tell: &mut ServerMessage) {
        self.frame = frame.min(project.frame_count() - 1);
        let file = self.place(project).file;
        if file != self.shown_file {
            self.shown_file = file;
            tell.lines = Some(self.lines(project));
            let kept = self.selection.clone();
            self.select(project, kept);
        }
    }
}

#[cfg(test)]
#[path = "session/tests.rs"]
mod tests;

#[cfg(test)]
#[path = "session/random_tests.rs"]
mod random_tests;

#[cfg(test)]
#[path = "session/time_tests.rs"]
mod time_tests;
