//! The map from a frame to lines of its script: the line of each of the tracer's objects, of the lights,
//! and of the settings.
//!
//! A used group is as many of the tracer's objects as it draws, but one line: that of its `Use`.

use std::collections::HashMap;
use std::ops::RangeInclusive;

use rayfold_scene::Command;

use crate::line::Line;
use crate::tables::{Role, role};
use crate::values::Values;

/// The index of the scale of a `Use`; the scale 0 hides the group.
const SCALE: usize = 6;

/// The lines of a frame, from 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct SourceMap {
    /// The lines of its objects and of the groups that it uses, in the tracer's order.
    pub(crate) objects: Vec<usize>,
    /// For each of these lines, the number of the tracer's objects up to and including it.
    drawn: Vec<usize>,
    /// The lines of its lights.
    pub(crate) lights: Vec<usize>,
    /// The line of its camera; `None` if it has the default camera.
    pub(crate) camera: Option<usize>,
    /// The lines of its settings.
    settings: HashMap<Command, usize>,
    /// The line of the `Clear` with which it begins.
    cleared: Option<usize>,
    /// The line of its `Trace`. If it is missing, new lines go to the end.
    pub(crate) trace: Option<usize>,
    /// The groups up to its `Trace`, each from `Group` to `End`.
    groups: Vec<RangeInclusive<usize>>,
}

/// The groups read so far.
#[derive(Default)]
struct Groups {
    /// The number of objects that each group draws.
    drawn: HashMap<String, usize>,
    open: Option<(usize, String, usize)>,
}

/// The settings of the scene's surroundings, which a `Clear` removes.
pub(crate) const AROUND: [Command; 3] = [Command::Background, Command::Sky, Command::SkyPicture];

impl SourceMap {
    /// Makes the map of frame `frame` of a script, counted from 0, at a time. Beyond the last `Trace` it is the
    /// state at the end.
    pub(crate) fn of(lines: &[Line], frame: usize, time: f64) -> Self {
        let mut source_map = Self::default();
        let mut groups = Groups::default();
        let (mut before, mut count) = (0usize, 1usize);
        for (number, line) in lines.iter().enumerate() {
            let Some(command) = line.command() else { continue };
            match (command, role(command)) {
                (Command::Clear, _) => {
                    source_map.objects.clear();
                    source_map.drawn.clear();
                    source_map.lights.clear();
                    for command in AROUND {
                        source_map.settings.remove(&command);
                    }
                    source_map.cleared = Some(number);
                }
                (Command::Trace, _) => {
                    if frame < before.saturating_add(count) {
                        source_map.trace = Some(number);
                        break;
                    }
                    before = before.saturating_add(count);
                }
                (Command::Frames, _) => {
                    source_map.settings.insert(command, number);
                    count = frames(line).unwrap_or(1);
                }
                (Command::Group, _) => {
                    groups.open = Some((number, line.subject().unwrap_or_default().to_owned(), 0));
                }
                (Command::End, _) => {
                    if let Some((start, name, drawn)) = groups.open.take() {
                        groups.drawn.insert(name, drawn);
                        source_map.groups.push(start..=number);
                    }
                }
                (Command::Use, _) => {
                    let hides = Values::of(line, time).and_then(|values| values.number(SCALE)) == Some(0.0);
                    let drawn = line.subject().and_then(|name| groups.drawn.get(name)).copied().unwrap_or(0);
                    source_map.draw(&mut groups, number, if hides { 0 } else { drawn });
                }
                (_, Role::Object) => {
                    let hides = Values::of(line, time).is_some_and(|values| values.hides());
                    source_map.draw(&mut groups, number, usize::from(!hides));
                }
                (_, Role::Light) => source_map.lights.push(number),
                (_, Role::Camera) => source_map.camera = Some(number),
                (_, Role::Setting) => {
                    source_map.settings.insert(command, number);
                }
                (_, Role::Use | Role::Material | Role::Group) => {}
            }
        }
        source_map
    }

    /// Adds an object or a used group, to the open group or to the picture.
    fn draw(&mut self, groups: &mut Groups, line: usize, count: usize) {
        match &mut groups.open {
            Some((_, _, drawn)) => *drawn = drawn.saturating_add(count),
            None => {
                self.objects.push(line);
                self.drawn.push(self.object_count().saturating_add(count));
            }
        }
    }

    /// Returns the number of the tracer's objects.
    pub(crate) fn object_count(&self) -> usize {
        self.drawn.last().copied().unwrap_or(0)
    }

    /// Returns the line of a setting; `None` if it has its default.
    pub(crate) fn setting(&self, command: Command) -> Option<usize> {
        self.settings.get(&command).copied()
    }

    /// Returns the line for a new setting: after the size, and after commands that remove settings.
    pub(crate) fn start(&self) -> usize {
        self.setting(Command::Screen).max(self.cleared).map_or(0, |at| at + 1)
    }

    /// Returns the line of one of the tracer's objects.
    pub(crate) fn line_of(&self, object: usize) -> Option<usize> {
        self.objects.get(self.drawn.partition_point(|&end| end <= object)).copied()
    }

    /// Returns whether a line is in the definition of a group.
    pub(crate) fn is_in_group(&self, line: usize) -> bool {
        let at = self.groups.partition_point(|group| *group.end() < line);
        self.groups.get(at).is_some_and(|group| group.contains(&line))
    }

    /// Returns the line for a new object or light of this frame: after its existing ones and before its `Trace`.
    pub(crate) fn end(&self, lines: &[Line]) -> usize {
        let groups = self.groups.last().map(|group| group.end());
        let screen = self.settings.get(&Command::Screen);
        let around = AROUND.iter().filter_map(|of| self.settings.get(of));
        let set = self.camera.iter().chain(screen).chain(around).chain(&self.cleared);
        let last = self.objects.iter().chain(&self.lights).chain(set).chain(groups).max();
        match (last, self.trace) {
            (Some(last), _) => last + 1,
            (None, Some(trace)) => trace,
            (None, None) => lines.len(),
        }
    }
}

/// Returns the number of frames of a `Trace` after a `Frames` line.
fn frames(line: &Line) -> Option<usize> {
    let values = Values::of(line, 1.0)?;
    let whole =
        |at: usize| values.written().get(at).copied().flatten().filter(|n| n.fract() == 0.0 && *n >= 1.0);
    let (first, last) = match (whole(0), whole(1)) {
        (Some(first), Some(last)) => (first, last),
        (Some(last), None) => (1.0, last),
        (None, _) => return None,
    };
    (first <= last).then_some(((last - first) as usize).saturating_add(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_have_the_numbers_that_the_tracer_gives_them() {
        let text = "Screen 2 2\nSphere 1 0 0 0 0 0 0 0 0 0\n# Box\nIlight 1 1 1 1 0 0\nTrace\n\
                    box 0 0 0 1 1 1 0 0 0 0 0 0\nTrace\nClear\nOrthocamera\nSphere 1 0 0 0 0 0 0 0 0 0\nTrace\nTrace";
        let lines = Line::split(text.as_bytes());
        let script = rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap();
        let expected: [&[usize]; 4] = [&[1], &[1, 5], &[9], &[9]];
        for (frame, objects) in expected.into_iter().enumerate() {
            let source_map = SourceMap::of(&lines, frame, 1.0);
            assert_eq!(source_map.objects, objects);
            assert_eq!(script.frame(frame).unwrap().objects.len(), objects.len());
        }
        let last = SourceMap::of(&lines, 3, 1.0);
        assert_eq!(
            (last.camera, last.setting(Command::Screen), last.lights.len(), last.trace),
            (Some(8), Some(0), 0, Some(11))
        );
        assert_eq!(last.end(&lines), 10);
        let lines = Line::split(b"Screen 2 2\nTrace\nClear\nTrace");
        assert_eq!(SourceMap::of(&lines, 1, 1.0).end(&lines), 3, "what stands before a `Clear` is gone");
    }

    #[test]
    fn a_count_of_frames_beyond_all_numbers_is_no_overflow() {
        let lines = Line::split(b"Frames 1 1e300\nTrace\nFrames 1 1e300\nTrace\nTrace");
        assert_eq!(lines.iter().filter_map(frames).collect::<Vec<_>>(), [usize::MAX; 2]);
    }

    #[test]
    fn frames_and_groups_are_counted_as_the_parser_counts_them() {
        let text = "Screen 2 2\nGroup a\nSphere 1 0 0 0 1 1 1 0 0 0\nBox 0 0 0 1 1 1 1 1 1 0 0 0\nEnd\n\
                    Group b\nUse a\nUse a 1 0 0  0 0 0 (1:0 3:2)\nDisc 1 0 0 0 0 1 0 1 1 1 0 0 0\nEnd\n\
                    Sphere 1 0 0 0 1 1 1 0 0 0\nUse b\nUse a 1 2 3\nFrames 3\nTrace\nFrames 2 5\nUse a\nTrace";
        let lines = Line::split(text.as_bytes());
        let script = rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap();
        assert_eq!(script.frame_count(), 7);
        for frame in 0..7 {
            let time = script.frame_number(frame).unwrap();
            let source_map = SourceMap::of(&lines, frame, time);
            assert_eq!(source_map.object_count(), script.frame(frame).unwrap().objects.len(), "{frame}");
            assert_eq!(source_map.trace, Some(if frame < 3 { 14 } else { 17 }));
            assert_eq!(source_map.setting(Command::Frames), Some(if frame < 3 { 13 } else { 15 }));
        }
        let source_map = SourceMap::of(&lines, 0, 1.0);
        let seen: Vec<_> =
            (0..source_map.object_count()).map(|object| source_map.line_of(object).unwrap()).collect();
        assert_eq!(seen, [10, 11, 11, 11, 12, 12]);
        assert_eq!(source_map.line_of(6), None);
        let inside: Vec<_> = (0..lines.len()).filter(|&line| source_map.is_in_group(line)).collect();
        assert_eq!(inside, (1..10).collect::<Vec<_>>());
    }
}
