//! The timeline: edits of keys, the shown frame, and the selection at other frames.

use std::fmt::Write;

use rayfold_scene::{Quotes, Subject, unquoted_word};

use super::fields::subject_word;
use super::held_keys::HeldKeys;
use super::hold::Held;
use super::viewport::picture_of;
use super::{Change, Session};
use crate::edits;
use crate::error::words;
use crate::frame::Frame;
use crate::handles::{Handle, HandleKind};
use crate::line::Line;
use crate::project::Project;
use crate::protocol::{Ghost, Inspected, ServerMessage, Switch, TimeState, TimelineEdit};
use crate::silhouette::View;
use crate::source_map::SourceMap;
use crate::tables::title;
use crate::tracks::{self, Copied, Tracks};
use crate::values::{Keying, Values, curve};
use crate::view::Projection;

/// The largest number of frames that the page may set.
const FRAMES: u32 = 1_000_000;

/// The largest number of points of a motion path.
const PLACES: usize = 400;

/// The number of ghosts before the shown frame, and after it.
const GHOSTS: i64 = 2;

/// The number of parts into which ghosts divide the frames.
const PARTS: i64 = 12;

impl Session {
    /// Returns the time of the shown frame.
    pub(super) fn time(&self, project: &Project) -> f64 {
        self.shown(project).time
    }

    /// Returns the way in which a change at the shown frame is written.
    pub(super) fn keying(&self, project: &Project) -> Keying {
        let (first, _) = self.range(project);
        Keying { time: self.time(project), first: first.into(), auto: self.auto_key, whole: false }
    }

    /// Returns the frames of the shown `Trace`.
    fn range(&self, project: &Project) -> (u32, u32) {
        let place = self.place(project);
        let script = project.files[place.file].script.as_ref();
        script.and_then(|script| script.frame_numbers(place.frame)).unwrap_or((1, 1))
    }

    pub(super) fn edit_timeline(
        &mut self,
        project: &mut Project,
        wish: TimelineEdit,
        tell: &mut ServerMessage,
    ) -> Change {
        let time = self.time(project);
        let lines = self.file_lines(project);
        let set = |changed: Vec<(usize, Line)>| {
            changed.into_iter().map(|(at, line)| edits::set(at, line)).collect::<Vec<_>>()
        };
        let mut gesture = None;
        let splices = match wish {
            TimelineEdit::Switch { what, on } => {
                match what {
                    Switch::AutoKey => self.auto_key = on,
                    Switch::Path => self.path = on,
                    Switch::Onion => self.onion = on,
                }
                self.outline(project, tell);
                return Change::Nothing;
            }
            TimelineEdit::Key { lines: which } => set(which
                .iter()
                .filter_map(|&at| {
                    let line = lines.get(at)?;
                    Some((at, tracks::toggled(line, &tracks::main_numbers(line), time)?))
                })
                .collect()),
            TimelineEdit::Toggle { line, numbers } => {
                let changed = lines.get(line).and_then(|text| tracks::toggled(text, &numbers, time));
                set(changed.map(|text| (line, text)).into_iter().collect())
            }
            TimelineEdit::Grab { keys } => {
                let gesture = self.next_gesture();
                self.held = Some(Held::Keys(HeldKeys::new(self.file_lines(project), &keys, gesture)));
                return Change::Nothing;
            }
            TimelineEdit::Move { by, value } => {
                let Some(Held::Keys(held)) = &self.held else { return Change::Nothing };
                if !(by.is_finite() && value.is_finite()) {
                    return Change::Nothing;
                }
                let (splices, gesture) = (held.moved(by.round(), value), held.gesture);
                self.edit(project, splices, Some(gesture), tell);
                tell.outline = Some(String::new());
                return Change::Moving;
            }
            TimelineEdit::Remove { keys } => set(tracks::removed(lines, &keys)),
            TimelineEdit::Copy { keys } => {
                let copied = tracks::copied(lines, &keys);
                self.copied_text = tracks::text_of_keys(lines, &copied);
                tell.clipboard = Some(self.copied_text.clone());
                self.copied = copied;
                return Change::Nothing;
            }
            TimelineEdit::Paste => {
                let keys = self.copied.clone();
                return self.paste_keys(project, &keys, tell);
            }
            TimelineEdit::Ease { keys, mode, cycle } => {
                // While a tangent is dragged, all is one step.
                if let Some(Held::Keys(held)) = &self.held {
                    gesture = Some(held.gesture);
                }
                set(tracks::eased(lines, &keys, &mode, cycle))
            }
            TimelineEdit::Pace { fps } => {
                let file = self.place(project).file;
                if let Err(error) = project.set_fps(file, fps) {
                    tell.notice = Some(words(&error));
                }
                return Change::Nothing;
            }
            TimelineEdit::Frames { count } => {
                edits::set_frames(lines, &self.shown(project).source_map, count.clamp(1, FRAMES))
            }
        };
        self.edit(project, splices, gesture, tell);
        // There may be fewer frames now.
        self.show(project, self.frame, tell);
        self.outline(project, tell);
        if gesture.is_some() { Change::Moving } else { Change::Still }
    }

    /// Pastes the keys of a text. If it is the text of the keys that were copied last, those keys are pasted, because
    /// their lines may have moved since.
    pub(super) fn paste_keys_of_text(
        &mut self,
        project: &mut Project,
        text: &str,
        keys: &[Copied],
        tell: &mut ServerMessage,
    ) -> Change {
        let copied = (text == self.copied_text).then(|| self.copied.clone());
        self.paste_keys(project, copied.as_deref().unwrap_or(keys), tell)
    }

    /// Pastes keys, the first at the shown frame.
    fn paste_keys(&mut self, project: &mut Project, keys: &[Copied], tell: &mut ServerMessage) -> Change {
        let time = self.time(project);
        let lines = self.file_lines(project);
        let changed = tracks::pasted(lines, keys, time, self.selection.last().copied());
        if changed.is_empty() {
            let name = keys.first().map_or("", |key| key.command.name());
            tell.notice = Some(format!("No line takes these keys: select a {name} first."));
            return Change::Nothing;
        }
        let splices = changed.into_iter().map(|(at, line)| edits::set(at, line)).collect();
        self.edit(project, splices, None, tell);
        self.outline(project, tell);
        Change::Still
    }

    pub(super) fn time_state(&self, project: &Project) -> TimeState {
        let (first, last) = self.range(project);
        let number = self.time(project);
        let before = (number - f64::from(first)).max(0.0) as usize;
        TimeState {
            number,
            first,
            last,
            start: self.frame.saturating_sub(before),
            auto_key: self.auto_key,
            path: self.path,
            onion: self.onion,
            copied: self.copied.len(),
        }
    }

    /// Returns the tracks if they have changed since they were sent.
    pub(super) fn new_tracks(&mut self, project: &Project) -> Option<Tracks> {
        let tracks = project.files[self.place(project).file].tracks();
        if self.tracks.as_ref() == Some(tracks) {
            return None;
        }
        self.tracks = Some(tracks.clone());
        self.tracks.clone()
    }

    /// Returns the current parameters of a line.
    pub(super) fn inspected(&self, project: &Project, at: usize) -> Option<Inspected> {
        let line = self.line(project, at)?;
        let time = self.time(project);
        let (values, words) = (Values::of(line, time)?, line.words()?);
        let curves: Vec<_> = (0..words.parameters.len())
            .filter_map(|number| Some((number, curve(line, &words, number)?)))
            .collect();
        let has_key = |curve: &rayfold_scene::Curve| curve.key_at(time).is_some();
        let keyed = curves.iter().filter(|(_, curve)| has_key(curve)).map(|(number, _)| *number).collect();
        let curves: Vec<_> = curves.into_iter().map(|(number, _)| number).collect();
        let form = values.command.form();
        let is_named = |at: usize| {
            words.parameters.len() == at + 1 && values.written().get(at).copied().flatten().is_none()
        };
        let surface = form.surface().filter(|&at| is_named(at) && !curves.contains(&at));
        Some(Inspected {
            line: at,
            command: title(values.command),
            values: values.written().to_vec(),
            keyed,
            can_key: form.curves,
            material: surface.map(|at| line.word(&words.parameters[at]).to_owned()),
            subject: line.subject().unwrap_or_default().to_owned(),
            text: line
                .subject()
                .filter(|_| form.subject == Some(Subject::Quotes(Quotes::Words)))
                .and_then(unquoted_word),
            fields: self.own_fields(project, at),
            words: words
                .parameters
                .iter()
                .enumerate()
                .filter(|(number, _)| line.parameter(&words, *number).is_none() && !curves.contains(number))
                .map(|(number, word)| (number, line.word(word).to_owned()))
                .chain(subject_word(line))
                .collect(),
            curves,
        })
    }

    /// Returns the motion path of the selection and its keys, as SVG paths.
    pub(super) fn motion_path(
        &self,
        project: &Project,
        projection: &Projection,
        source_map: &SourceMap,
    ) -> (String, String, Vec<Handle>) {
        let nothing = (String::new(), String::new(), Vec::new());
        let Some(&at) = self.selection.last().filter(|line| self.path && !source_map.is_in_group(**line))
        else {
            return nothing;
        };
        let Some(line) = self.line(project, at).filter(|line| line.bytes().contains(&b'(')) else {
            return nothing;
        };
        let place = |time: f64| {
            let values = Values::of(line, time)?;
            let places: Vec<_> = values.positions().map(|(_, place)| place).collect();
            (!places.is_empty()).then(|| places.iter().sum::<glam::DVec3>() / places.len() as f64)
        };
        let (first, last) = self.range(project);
        let count = ((last - first) as usize + 1).clamp(2, PLACES);
        let share = |i: usize| f64::from(first) + f64::from(last - first) * i as f64 / (count - 1) as f64;
        let places: Vec<_> = (0..count).map(|i| place(share(i))).collect();
        if places.windows(2).all(|pair| pair[0] == pair[1]) {
            return nothing;
        }
        let (mut way, mut marks) = (String::new(), String::new());
        let mut is_open = false;
        for place in places {
            let seen = place.and_then(|place| projection.point(place));
            if let Some(at) = seen {
                // Writing to a string cannot fail.
                let _ = write!(way, "{}{:.1} {:.1}", if is_open { 'L' } else { 'M' }, at.x, at.y);
            }
            is_open = seen.is_some();
        }
        let of_line = tracks::tracks(std::slice::from_ref(line));
        let mut frames: Vec<f64> =
            of_line.tracks.iter().flat_map(|track| &track.keys).map(|key| key.0).collect();
        frames.sort_by(f64::total_cmp);
        frames.dedup();
        let mut handles = Vec::new();
        for frame in frames.into_iter().take(PLACES) {
            let Some(seen) = place(frame).and_then(|place| projection.point(place)) else { continue };
            let _ = write!(marks, "M{:.1} {:.1}h0", seen.x, seen.y);
            // The object itself is at the shown frame.
            if frame.fract() == 0.0 && frame != self.time(project) {
                let (grip, label) =
                    (HandleKind::Key { frame: frame as u32 }, format!("place at frame {frame}"));
                let (seen, way) = (seen.into(), String::new());
                handles.push(Handle { grip, line: at, label, at: seen, from: seen, way });
            }
        }
        (way, marks, handles)
    }

    /// Returns outlines of the selection at other frames, in the current view.
    pub(super) fn ghosts(&self, project: &Project) -> Vec<Ghost> {
        let place = self.place(project);
        let file = &project.files[place.file];
        let (Some(script), Some(now), true) =
            (&file.script, self.scene(project), self.onion && file.is_sound())
        else {
            return Vec::new();
        };
        let (first, last) = self.range(project);
        let step = (i64::from(last - first) / PARTS).max(1);
        let number = self.time(project) as i64;
        let (lines, chosen) = (file.document.lines(), self.chosen());
        let one = |after: i64| {
            let time = number + after * step;
            if !(i64::from(first)..=i64::from(last)).contains(&time) {
                return None;
            }
            let frame = usize::try_from(place.frame as i64 + after * step).ok()?;
            let then = Frame::new(Some(script), lines, frame);
            if !then.source_map.objects.iter().any(|line| chosen.contains(line)) {
                return None;
            }
            let scene = picture_of(then.scene.clone()?, &now);
            let view = View { scene: &scene, boxes: then.boxes() };
            let is_in = |object| then.source_map.line_of(object).is_some_and(|line| chosen.contains(&line));
            let path = view.ghost(is_in).ok()?;
            (!path.is_empty()).then_some(Ghost { path, after: after as i32 })
        };
        (-GHOSTS..=GHOSTS).filter(|after| *after != 0).filter_map(one).collect()
    }
}
