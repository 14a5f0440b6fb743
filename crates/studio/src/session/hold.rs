//! The object that the pointer holds, from its press to its release.

use glam::DVec2;

use super::held_keys::HeldKeys;
use super::viewport::lines_path;
use super::{Change, Session};
use crate::edits;
use crate::handles::{Drag, DragOptions, Dragged, HandleKind};
use crate::line::Line;
use crate::project::Project;
use crate::protocol::{Navigation, ServerMessage};
use crate::snap_to_boxes::Neighbours;
use crate::values::Keying;
use crate::view::{Bounds, Projection};

/// The pixels by which the pointer moves in a click.
const CLICK: f64 = 4.0;

/// The object that the pointer holds.
#[derive(Debug)]
pub(super) enum Held {
    /// Lines, with the point where the drag started.
    Drag(Drag, DVec2),
    /// The free camera, with the last position of the pointer, and the selection if this is a click.
    Turn(DVec2, Option<Vec<usize>>),
    /// Keys of the timeline.
    Keys(HeldKeys),
}

impl Session {
    pub(super) fn press(
        &mut self,
        project: &Project,
        at: DVec2,
        extend: bool,
        handle: Option<(HandleKind, usize)>,
    ) {
        self.gestures += 1;
        let around = self.around(project);
        let (grip, grabbed) = match handle {
            Some((grip, line)) => {
                if !self.selection.contains(&line) {
                    self.select(project, vec![line]);
                }
                (grip, None)
            }
            None => {
                let picked = self.pick(project, at.x, at.y);
                let Some((line, point)) = picked.filter(|&(line, _)| !self.is_endless(project, line)) else {
                    // The background and a floor turn the view. A click selects.
                    let clicked = match picked {
                        Some((line, _)) if extend => Some([&self.selection[..], &[line]].concat()),
                        Some((line, _)) => Some(vec![line]),
                        None => (!extend).then(Vec::new),
                    };
                    self.held = Some(Held::Turn(at, clicked));
                    return;
                };
                let mut selection = if extend || self.selection.contains(&line) {
                    self.selection.clone()
                } else {
                    Vec::new()
                };
                selection.push(line);
                self.select(project, selection);
                (HandleKind::Body, Some(point))
            }
        };
        let all = matches!(grip, HandleKind::Body | HandleKind::Axis { .. } | HandleKind::Plane { .. });
        let main = self.selection.last().copied();
        let lines = self.selection.iter().rev().copied().filter(|&line| all || Some(line) == main);
        let shown = self.shown(project);
        let lines =
            lines.filter(|&line| !shown.source_map.is_in_group(line) && !self.is_locked(project, line));
        let lines: Vec<_> =
            lines.filter_map(|line| Some((line, self.line(project, line)?.clone()))).collect();
        let neighbours = all.then(|| self.neighbours(project, &lines)).flatten();
        let keying = match (grip, self.keying(project)) {
            (HandleKind::Key { frame }, keying) => Keying { time: frame.into(), auto: true, ..keying },
            (_, keying) => keying,
        };
        self.held =
            Drag::new(grip, lines, grabbed, around, keying, neighbours).map(|drag| Held::Drag(drag, at));
    }

    /// Returns the boxes of some lines, and those of the objects with which they can be aligned.
    fn neighbours(&self, project: &Project, lines: &[(usize, Line)]) -> Option<Neighbours> {
        let chosen = self.chosen();
        let own = self.boxes(project, |line| lines.iter().any(|&(own, _)| own == line));
        let own = own.into_iter().map(|(_, bounds)| bounds).reduce(Bounds::with)?;
        let others = self.boxes(project, |line| !chosen.contains(&line));
        Some(Neighbours { own, others: others.into_iter().map(|(_, bounds)| bounds).collect() })
    }

    pub(super) fn release(&mut self, project: &Project, tell: &mut ServerMessage) {
        tell.guides = Some(String::new());
        if let Some(Held::Turn(_, Some(clicked))) = self.held.take() {
            self.select(project, clicked);
        }
    }

    pub(super) fn drag(
        &mut self,
        project: &mut Project,
        at: DVec2,
        options: DragOptions,
        tell: &mut ServerMessage,
    ) -> Change {
        let Some(scene) = self.scene(project) else { return Change::Nothing };
        match &mut self.held {
            None | Some(Held::Keys(_)) => Change::Nothing,
            Some(Held::Turn(last, clicked)) => {
                if clicked.is_some() && at.distance(*last) < CLICK {
                    return Change::Nothing;
                }
                *clicked = None;
                let moved = (at - *last) / f64::from(scene.screen.height());
                *last = at;
                self.navigate(project, Navigation::Turn, moved);
                tell.outline = Some(String::new());
                Change::Moving
            }
            Some(Held::Drag(drag, start)) => {
                let projection = Projection::new(&scene);
                let Dragged { lines, guides } = drag.to(&projection, *start, at, options);
                tell.guides = Some(lines_path(&projection, &guides));
                let gesture = self.gestures << 1;
                let splices = lines
                    .into_iter()
                    .filter(|(line, text)| self.line(project, *line).is_some_and(|old| old != text))
                    .map(|(line, text)| edits::set(line, text))
                    .collect();
                self.edit(project, splices, Some(gesture), tell);
                tell.outline = Some(String::new());
                Change::Moving
            }
        }
    }
}
