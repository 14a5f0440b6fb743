//! The replies to the page: the state, and the changed lines.

use rayfold_scene::{Code, Command, Scene};

use super::hold::Held;
use super::viewport::{frustum_path, grid_path};
use super::{Answer, Change, Session};
use crate::document::Splice;
use crate::edits;
use crate::handles::handles;
use crate::line::Line;
use crate::project::Project;
use crate::protocol::{FaultState, FileState, LineState, LinesChanged, ServerMessage, State};
use crate::tables::role;
use crate::values::Values;
use crate::view::Projection;
use crate::wanted::Wanted;

impl Session {
    pub(super) fn answer(&mut self, project: &Project, mut tell: ServerMessage, change: Change) -> Answer {
        // An outline belongs to a picture. With another picture it is recomputed, or removed while the picture moves.
        match change {
            Change::Still if tell.outline.is_none() => self.outline(project, &mut tell),
            Change::Moving if tell.outline.is_none() => tell.outline = Some(String::new()),
            Change::Still | Change::Moving | Change::Nothing => {}
        }
        let files: Vec<_> = project
            .files
            .iter()
            .map(|file| FileState {
                name: file.name.clone(),
                frames: file.frame_count(),
                faulty: !file.is_sound(),
            })
            .collect();
        if files != self.files {
            tell.files = Some(files.clone());
            self.files = files;
        }
        let scene = self.scene(project);
        let picture = match (change, &scene) {
            (Change::Nothing, _) | (_, None) => None,
            (change, Some(scene)) => {
                self.pictures = self.pictures.wrapping_add(1);
                let moving = change == Change::Moving;
                let motion = self.motion(project, scene);
                let (place, view) = (self.place(project), self.view());
                Some(Wanted { scene: scene.clone(), motion, moving, number: self.pictures, place, view })
            }
        };
        if change != Change::Nothing {
            // The outline of the object under the pointer may have changed.
            self.hovered = None;
        }
        if tell.lines.is_some() || !tell.splices.is_empty() {
            tell.text = Some(self.text_state(project));
        }
        tell.tracks = self.new_tracks(project);
        tell.state = Some(self.state(project, scene.as_ref()));
        Answer { tell, picture, shown: false, output: None }
    }

    pub(super) fn state(&self, project: &Project, scene: Option<&Scene>) -> State {
        let place = self.place(project);
        let file = &project.files[place.file];
        let lines = file.document.lines();
        let mut shown = Vec::new();
        let (mut grid, mut frustum) = (String::new(), String::new());
        let mut axes = [[0.0; 2]; 3];
        let (mut way, mut marks) = (String::new(), String::new());
        let now = self.shown(project);
        if let Some(scene) = scene {
            let projection = Projection::new(scene);
            let around = self.around(project);
            if !matches!(self.held, Some(Held::Turn(..)))
                && let Some(&line) = self.selection.last()
                && let Some(values) = lines.get(line).and_then(|text| Values::of(text, now.time))
                && !now.source_map.is_in_group(line)
                && !self.is_locked(project, line)
            {
                let size = self.drawn_size(project, line);
                shown = handles(line, &values, &projection, around, size);
            }
            let (right, up, _) = projection.axes();
            axes = [0, 1, 2].map(|axis| [right[axis], -up[axis]]);
            let keys;
            (way, marks, keys) = self.motion_path(project, &projection, &now.source_map);
            shown.extend(keys.into_iter().filter(|handle| !self.is_locked(project, handle.line)));
            if self.free.is_some() {
                let bounds = self.bounds(project);
                grid = grid_path(&projection, bounds);
                frustum =
                    now.scene.as_ref().map_or_else(String::new, |of| frustum_path(&projection, of, bounds));
            }
        }
        let settings = Command::ALL.iter().filter_map(|&command| now.source_map.setting(command));
        let settings = settings.filter_map(|line| self.inspected(project, line)).collect();
        let inspected = self.selection.last().and_then(|&line| self.inspected(project, line));
        let faults = file
            .diagnostics
            .iter()
            .map(|fault| FaultState {
                line: fault.line - 1,
                column: fault.column - 1,
                length: fault.excerpt.text.get(fault.excerpt.marked.clone()).map_or(0, |t| t.chars().count()),
                error: fault.is_error(),
                needs_samples: fault.code == Code::NeedsSamples,
                message: fault.message.clone(),
                help: fault.help.clone().or_else(|| fault.expected.clone()).unwrap_or_default(),
            })
            .collect();
        State {
            asked: self.asked,
            title: project.name.clone(),
            fps: project.settings().fps(),
            frame: self.frame.min(project.frame_count() - 1),
            frames: project.frame_count(),
            file: place.file,
            saved: file.saved(),
            failure: file.failure().to_owned(),
            can_undo: file.document.can_undo(),
            can_redo: file.document.can_redo(),
            selection: self.selection.clone(),
            inspected,
            settings,
            axes,
            camera: now.source_map.camera,
            frustum,
            faults,
            handles: shown,
            grid,
            way,
            marks,
            locked: self.locked_lines(project),
            time: self.time_state(project),
            free: self.free.is_some(),
            draft: now.scene.as_ref().filter(|scene| scene.indirect_bounces() > 0).map(|_| self.is_draft),
            picture: scene.map(|scene| (self.pictures, scene.screen.width(), scene.screen.height())),
        }
    }

    pub(super) fn lines(&self, project: &Project) -> Vec<LineState> {
        self.file_lines(project).iter().map(line_state).collect()
    }

    /// Adds changes of the shown lines to the reply, which the page's editor has not made.
    pub(super) fn send_splices(&mut self, splices: Vec<Splice>, tell: &mut ServerMessage) {
        if !splices.is_empty() {
            self.text_changed(self.shown_file);
        }
        self.follow(self.shown_file, splices, tell);
    }

    /// Moves the selection, the locks and the copied keys along with their lines. Adds the changes to the reply if the
    /// file is shown.
    pub(super) fn follow(&mut self, file: usize, splices: Vec<Splice>, tell: &mut ServerMessage) {
        let is_shown = file == self.shown_file;
        if splices.iter().any(|splice| splice.removed != splice.inserted.len())
            && !matches!(self.held, Some(Held::Turn(..)))
        {
            // The held object may have another line now.
            self.held = None;
        }
        for splice in &splices {
            if !is_shown {
                self.locked.retain_mut(|(of, line)| {
                    let moved = if *of == file { after(splice, *line) } else { Some(*line) };
                    moved.map(|moved| *line = moved).is_some()
                });
                continue;
            }
            self.selection = self.selection.iter().filter_map(|&line| after(splice, line)).collect();
            let locked = self
                .locked
                .iter()
                .filter_map(|&(of, line)| Some((of, if of == file { after(splice, line)? } else { line })));
            self.locked = locked.collect();
            self.copied.retain_mut(|copied| match after(splice, copied.place.line) {
                Some(line) => {
                    copied.place.line = line;
                    true
                }
                None => false,
            });
        }
        if !is_shown {
            return;
        }
        tell.splices.extend(splices.into_iter().map(|splice| LinesChanged {
            at: splice.at,
            removed: splice.removed,
            lines: splice.inserted.iter().map(line_state).collect(),
        }));
    }
}

/// Returns the index of a line after a change, or `None` if it was removed.
fn after(splice: &Splice, line: usize) -> Option<usize> {
    let (end, inserted) = (splice.at + splice.removed, splice.inserted.len());
    if line < splice.at || line < end && inserted == splice.removed {
        return Some(line);
    }
    (line >= end).then(|| line + inserted - splice.removed)
}

fn line_state(line: &Line) -> LineState {
    let text = line.text();
    let hidden = if text.trim_start().starts_with('#') { edits::hidden(line) } else { None };
    let of = hidden.as_ref().unwrap_or(line);
    let command = of.command();
    LineState {
        text,
        command: command.map(Command::name),
        role: command.map(role),
        name: of.name(),
        subject: of.subject().map(str::to_owned),
        hidden: hidden.is_some(),
    }
}
