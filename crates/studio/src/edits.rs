//! Edits of a script that affect more than one number: new objects, copies, hidden lines. Lines in, splices out.

use glam::DVec3;
use rayfold_scene::{
    Command, Field, Kind, Object, Parameter, Presence, Quotes, Subject, Values as Range, color_levels,
    parse_curve, quoted_word,
};

use crate::document::Splice;
use crate::extent;
use crate::line::{Line, written};
use crate::source_map::{AROUND, SourceMap};
use crate::tables::{Role, fields, role};
use crate::values::{Keying, Values, changed, tidy};
use crate::view::Bounds;

/// The colours of new objects, in turn: diffuse coefficients.
const COLORS: [[f64; 3]; 6] = [
    [0.85, 0.3, 0.25],
    [0.2, 0.5, 0.85],
    [0.95, 0.75, 0.2],
    [0.3, 0.65, 0.4],
    [0.6, 0.4, 0.75],
    [0.75, 0.75, 0.75],
];

/// The colour of a new plane, on which those of objects stand out.
const FLOOR: [f64; 3] = [0.72, 0.7, 0.67];

/// The words of a new text.
const WORDS: &str = "Text";

/// The number of places that are tried for a new object.
const PLACES: i32 = 200;

/// The lines that a script needs before an object is visible.
const SCREEN: &str = "Screen 960 540";
const CAMERA: &str = "Camera 0 3 9  0 -0.28 -1  0 1 0  1  -0.8 -0.45  0.8 0.45";
const BACKGROUND: &str = "Background 0.86 0.9 0.95";
const SUN: &str = "Ilight 0.8 0.8 0.8  0.6 -1 -0.5   # sun";

/// Replaces one line by another.
pub(crate) fn set(line: usize, to: Line) -> Splice {
    Splice { at: line, removed: 1, inserted: vec![to] }
}

/// Makes the line for a new object or light of about `size`, which stands on `ground` and is the
/// `count`th in its script.
pub(crate) fn new_line(command: Command, ground: DVec3, size: f64, count: usize) -> Line {
    let decimals = (2.0 - size.log10().floor()).clamp(0.0, 12.0) as usize;
    let round = |x: f64| format!("{x:.decimals$}").parse::<f64>().unwrap_or(x);
    let all = || fields(command).map(|(_, field)| field).filter(|field| field.presence == Presence::Required);
    let places = all().filter(|field| field.kind == Kind::Position).count();
    let has_length = all().any(|field| field.kind == Kind::Length);
    let is_round = has_length && places == 1;
    let is_box = all().any(|field| field.parameter == Parameter::Corner);
    let color = if command == Command::Plane { FLOOR } else { COLORS[count % COLORS.len()] };
    let (mut place, mut length) = (0u8, 0);
    let mut text = command.name().to_owned();
    if command.form().subject == Some(Subject::Quotes(Quotes::Words)) {
        text = format!("{text} {}", quoted_word(WORDS));
    }
    for field in all() {
        let values: Vec<f64> = match field.kind {
            Kind::Position => {
                let off = match (places, place) {
                    (2, _) if has_length && !is_box => DVec3::Y * (1.6 * f64::from(place)),
                    (1, _) => DVec3::Y * if is_round { 1.0 } else { 0.0 },
                    (2, 0) => DVec3::new(-0.8, 0.0, -0.8),
                    (2, _) => DVec3::new(0.8, 1.6, 0.8),
                    (_, 0) => DVec3::NEG_X,
                    (_, 1) => DVec3::X,
                    _ => DVec3::Y * 1.7,
                };
                place += 1;
                (ground + size * off).to_array().map(round).into()
            }
            Kind::Length => {
                length += 1;
                let share = if is_box { 0.2 } else { 0.35 };
                vec![round(if length == 1 && !is_box { size } else { share * size })]
            }
            Kind::Direction if role(command) == Role::Light => vec![0.5, -1.0, -0.4],
            Kind::Direction => vec![0.0, 1.0, 0.0],
            Kind::Coefficients => color.into(),
            Kind::Color if field.parameter == Parameter::Ambient => {
                color.map(|c| (c * 15.0).round() / 100.0).into()
            }
            Kind::Color => vec![0.6; 3],
            _ => vec![1.0; field.names.len()],
        };
        text.push_str(if text.ends_with(char::is_alphabetic) { " " } else { "  " });
        let words: Vec<_> = values.iter().take(field.names.len()).map(|value| written(*value)).collect();
        text.push_str(&words.join(" "));
    }
    text.push_str(&format!("   # {} {}", command.name().to_lowercase(), count + 1));
    Line::new(&text)
}

/// Makes the line of a setting with values that make its effect visible.
pub(crate) fn new_setting(command: Command) -> Line {
    let required =
        fields(command).map(|(_, field)| field).filter(|field| field.presence == Presence::Required);
    let value = |field: &Field| match (field.parameter, field.values) {
        (_, Range::OneOf(words)) => words.last().copied().unwrap_or_default().to_owned(),
        (Parameter::Samples, _) => "16".to_owned(),
        (Parameter::Depth, _) => "8".to_owned(),
        (Parameter::Indirect, _) => "2".to_owned(),
        (Parameter::FogDistance, _) => "20".to_owned(),
        (_, Range::Whole(least, _)) => least.max(1).to_string(),
        (_, Range::Share) => "0.5".to_owned(),
        _ if field.kind == Kind::Color => "0.86 0.9 0.95".to_owned(),
        _ => vec!["0.1"; field.names.len()].join(" "),
    };
    let words: Vec<_> = required.map(value).collect();
    Line::new(&format!("{} {}", command.name(), words.join("  ")))
}

/// Returns the place nearest to `ground`, at its height, where a new object of this size is within no other object.
pub(crate) fn free_place(objects: &[Object], ground: DVec3, size: f64) -> DVec3 {
    let boxes: Vec<_> = objects.iter().filter_map(|object| extent::bounds([object])).collect();
    let room = DVec3::new(1.1, 1.0, 1.1) * size;
    let is_free = |at: DVec3| {
        let center = at + DVec3::Y * size;
        !boxes
            .iter()
            .any(|other| (center - room).cmplt(other.high).all() && (center + room).cmpgt(other.low).all())
    };
    // A spiral on the ground, in steps of half an object.
    let places = (0..PLACES).map(|turn| {
        let angle = f64::from(turn).sqrt() * 3.6;
        ground + 0.35 * size * angle * DVec3::new(angle.cos(), 0.0, angle.sin())
    });
    places.into_iter().find(|&at| is_free(at)).unwrap_or(ground)
}

/// Adds a line to a frame, and all missing lines without which it would be invisible. Returns the changes, and the new
/// index of the line.
pub(crate) fn add(lines: &[Line], source_map: &SourceMap, line: Line) -> (Vec<Splice>, usize) {
    let mut before = Vec::new();
    if source_map.setting(Command::Screen).is_none() {
        before.push(Line::new(SCREEN));
    }
    if source_map.camera.is_none() && source_map.objects.is_empty() && source_map.trace.is_none() {
        before.push(Line::new(CAMERA));
        if AROUND.iter().all(|around| source_map.setting(*around).is_none()) {
            before.push(Line::new(BACKGROUND));
        }
    }
    let is_light = line.command().is_some_and(|command| role(command) == Role::Light);
    if source_map.lights.is_empty()
        && source_map.objects.is_empty()
        && source_map.trace.is_none()
        && !is_light
    {
        before.push(Line::new(SUN));
    }
    let at = source_map.end(lines);
    let place = at + before.len();
    let mut inserted = before;
    inserted.push(line);
    if source_map.trace.is_none() {
        inserted.push(Line::new(Command::Trace.name()));
    }
    // A new line after a last line without an end starts where that one gets its end.
    (vec![Splice { at, removed: 0, inserted }], place)
}

/// Removes lines, from the last to the first.
pub(crate) fn remove(lines: &[usize]) -> Vec<Splice> {
    let mut lines = lines.to_vec();
    lines.sort_unstable();
    lines.dedup();
    lines.into_iter().rev().map(|at| Splice { at, removed: 1, inserted: Vec::new() }).collect()
}

/// Copies lines, each after itself and a little aside. Returns the changes and the lines of the copies.
pub(crate) fn duplicate(lines: &[Line], which: &[usize], aside: f64) -> (Vec<Splice>, Vec<usize>) {
    let mut which: Vec<_> = which.iter().copied().filter(|&line| line < lines.len()).collect();
    which.sort_unstable();
    which.dedup();
    let copies = which.iter().enumerate().map(|(i, line)| line + 1 + i).collect();
    let copy = |at: usize| {
        let line = moved(&lines[at], DVec3::new(aside, 0.0, 0.0), Keying::ALWAYS)
            .unwrap_or_else(|| lines[at].clone());
        let name = line.name().map(|name| format!("{name} copy"));
        let line = name.and_then(|name| line.named(&name)).unwrap_or(line);
        Splice { at: at + 1, removed: 0, inserted: vec![line] }
    };
    (which.iter().rev().map(|&at| copy(at)).collect(), copies)
}

/// Moves all positions of a line, or returns `None` if it has none. Numbers that do not change are not rewritten.
pub(crate) fn moved(line: &Line, by: DVec3, keying: Keying) -> Option<Line> {
    let values = Values::of(line, keying.time)?;
    values.positions().next()?;
    values.positions().try_fold(line.clone(), |line, (first, position)| {
        let to = [0, 1, 2]
            .map(|axis| if by[axis] == 0.0 { position[axis] } else { tidy(position[axis] + by[axis]) });
        changed(&line, first, &to, keying)
    })
}

/// Returns the command line that is hidden in a comment.
pub(crate) fn hidden(line: &Line) -> Option<Line> {
    let text = line.text();
    let inner = text.trim_start().strip_prefix('#')?;
    let inner = line.with_text(inner.strip_prefix(' ').unwrap_or(inner));
    let command = inner.command()?;
    let words = inner.words()?;
    let form = command.form();
    let is_number = |word| {
        let text = inner.word(word);
        inner.number(word).is_some() || parse_curve(text).is_some() || color_levels(text.as_bytes()).is_some()
    };
    let is_named = form.surface().is_some_and(|at| {
        words.parameters.len() == at + 1 && words.parameters.last().is_some_and(|word| !is_number(word))
    });
    let numbers = words.parameters.len() - usize::from(is_named);
    let is_meant = match role(command) {
        Role::Object | Role::Light | Role::Camera | Role::Use => {
            (is_named || form.takes(numbers))
                && words.parameters.iter().take(numbers).all(is_number)
                && form.subject.is_some() == words.subject.is_some()
        }
        Role::Group | Role::Material | Role::Setting => false,
    };
    is_meant.then_some(inner)
}

/// Turns lines into comments. If all of them are hidden, turns them back into commands.
pub(crate) fn hide(lines: &[Line], which: &[usize]) -> Vec<Splice> {
    let which = || which.iter().filter_map(|&at| Some((at, lines.get(at)?)));
    let back: Vec<_> = which().filter_map(|(at, line)| Some(set(at, hidden(line)?))).collect();
    if back.len() == which().count() {
        return back;
    }
    which()
        .filter(|(_, line)| line.command().is_some())
        .map(|(at, line)| set(at, line.with_text(&format!("# {}", line.text()))))
        .collect()
}

/// Exchanges a line with its neighbour of the same kind.
pub(crate) fn reorder(
    lines: &[Line],
    source_map: &SourceMap,
    line: usize,
    down: bool,
) -> Option<(Vec<Splice>, usize)> {
    let row = [&source_map.objects, &source_map.lights].into_iter().find(|row| row.contains(&line))?;
    let at = row.iter().position(|&other| other == line)?;
    let other = *if down { row.get(at + 1)? } else { row.get(at.checked_sub(1)?)? };
    let (first, second) = (line.min(other), line.max(other));
    let mut inserted: Vec<Line> = lines[first..=second].to_vec();
    let last = inserted.len() - 1;
    inserted.swap(0, last);
    Some((vec![Splice { at: first, removed: last + 1, inserted }], other))
}

/// Sets the number of frames of a frame's `Trace`.
pub(crate) fn set_frames(lines: &[Line], source_map: &SourceMap, count: u32) -> Vec<Splice> {
    let number = |count: u32| f64::from(count);
    let old = source_map.setting(Command::Frames).and_then(|at| Some((at, lines.get(at)?)));
    if let Some((at, line)) = old {
        let words = line.words().map_or(0, |words| words.parameters.len());
        let changed = match Values::of(line, 1.0).and_then(|values| values.number(0)) {
            Some(first) if words > 1 => line.with_numbers(1, &[first - 1.0 + number(count)]),
            _ => line.with_numbers(0, &[number(count)]),
        };
        return changed.map(|line| set(at, line)).into_iter().collect();
    }
    let frames = |count: u32| Line::new(&format!("{} {count}", Command::Frames.name()));
    let Some(trace) = source_map.trace else {
        let inserted = vec![frames(count)];
        return vec![Splice { at: lines.len(), removed: 0, inserted }];
    };
    // Later traces keep their frames.
    let follows = lines[trace + 1..].iter().any(|line| line.command() == Some(Command::Trace));
    let behind = Splice { at: trace + 1, removed: 0, inserted: vec![frames(1)] };
    let before = Splice { at: trace, removed: 0, inserted: vec![frames(count)] };
    if follows { vec![behind, before] } else { vec![before] }
}

/// Returns the bounds of the positions of some lines' lamps and groups.
pub(crate) fn places<'a>(lines: impl IntoIterator<Item = &'a Line>, time: f64) -> Option<Bounds> {
    let values = lines.into_iter().filter_map(|line| Values::of(line, time));
    Bounds::of(values.filter(|values| role(values.command) != Role::Camera).flat_map(|values| {
        let reach = values.reach();
        values.positions().map(|(_, position)| (position, reach)).collect::<Vec<_>>()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;

    fn after(text: &str, splices: Vec<Splice>) -> String {
        let mut document = Document::new(text.as_bytes());
        for splice in splices {
            document.apply(splice, None);
        }
        String::from_utf8(document.bytes()).unwrap()
    }

    fn check(text: &str) {
        let parsed = rayfold_scene::parse("a", text.as_bytes(), &Default::default());
        // What is added first has no light yet.
        let is_meant = |d: &rayfold_scene::Diagnostic| d.code == rayfold_scene::Code::NoLight;
        assert!(parsed.diagnostics.iter().all(is_meant), "{text}\n{:?}", parsed.diagnostics);
    }

    #[test]
    fn every_object_and_light_can_be_added_to_nothing() {
        for &command in Command::ALL {
            // A mesh needs a file.
            if !matches!(role(command), Role::Object | Role::Light) || command == Command::Mesh {
                continue;
            }
            for text in ["", "# mine", "Screen 4 3\r\nTrace\r\n", "Screen 4 3\nTrace"] {
                let lines = Line::split(text.as_bytes());
                let line = new_line(command, DVec3::new(1.0, 0.0, -2.0), 0.7, 3);
                let (splices, at) = add(&lines, &SourceMap::of(&lines, 0, 1.0), line);
                let text = after(text, splices);
                check(&text);
                assert_eq!(Line::split(text.as_bytes())[at].command(), Some(command), "{text}");
            }
        }
    }

    #[test]
    fn every_setting_can_be_added() {
        let text =
            "Screen 4 3\nLook 0 0 9 0 0 0 40\nIlight 1 1 1 0 -1 -1\nSphere 1 0 0 0 0 0 0 1 1 1\nTrace\n";
        for &command in Command::ALL {
            if role(command) != Role::Setting
                || command.form().fields.is_empty()
                || command == Command::Screen
                // It needs a file beside the script.
                || command == Command::SkyPicture
            {
                continue;
            }
            let lines = Line::split(text.as_bytes());
            let at = SourceMap::of(&lines, 0, 1.0).start();
            let text = after(text, vec![Splice { at, removed: 0, inserted: vec![new_setting(command)] }]);
            let parsed = rayfold_scene::parse("a", text.as_bytes(), &Default::default());
            assert!(parsed.script.is_some(), "{text}\n{:?}", parsed.diagnostics);
            assert_eq!(
                SourceMap::of(&Line::split(text.as_bytes()), 0, 1.0).setting(command),
                Some(at),
                "{text}"
            );
        }
    }

    #[test]
    fn a_new_sphere_stands_on_the_ground() {
        let line = new_line(Command::Sphere, DVec3::new(1.0, 0.25, -2.0), 0.5, 0);
        assert_eq!(line.text(), "Sphere 0.5  1 0.75 -2  0.13 0.05 0.04  0.85 0.3 0.25   # sphere 1");
    }

    const TEXT: &str = "Screen 4 3\nSphere 1  0 5 0  0 0 0  1 1 1 # a\n# Box 0 0 0 1 1 1 0 0 0 1 1 1\n\
                        Box -2 0 -2  2 .5 2  0 0 0  1 1 1\n# Box of tricks\nTrace\n";

    #[test]
    fn what_is_hidden_comes_back_as_it_was() {
        let lines = Line::split(TEXT.as_bytes());
        let gone = after(TEXT, hide(&lines, &[1, 3]));
        assert!(gone.contains("\n# Sphere 1  0 5 0  0 0 0  1 1 1 # a\n"));
        let lines = Line::split(gone.as_bytes());
        assert_eq!(after(&gone, hide(&lines, &[1, 3])), TEXT);
        assert!(hidden(&lines[2]).is_some() && hidden(&lines[4]).is_none());
        let is_hidden = |text: &str| hidden(&Line::new(text)).is_some();
        assert!(is_hidden("# Sphere (1:1 9:2) 0 0 0 red") && is_hidden("#Use table 1 2 3"));
        assert!(!is_hidden("# Use of tools") && !is_hidden("# Sphere of influence"));
    }

    #[test]
    fn a_trace_becomes_so_many_frames() {
        let set = |text: &str, frame, count| {
            let lines = Line::split(text.as_bytes());
            after(text, set_frames(&lines, &SourceMap::of(&lines, frame, 1.0), count))
        };
        assert_eq!(set("Screen 4 3\nTrace\n", 0, 50), "Screen 4 3\nFrames 50\nTrace\n");
        assert_eq!(set("Screen 4 3\nFrames 9 # all\nTrace\n", 4, 50), "Screen 4 3\nFrames 50 # all\nTrace\n");
        assert_eq!(set("Screen 4 3\nFrames 11 20\nTrace\n", 4, 5), "Screen 4 3\nFrames 11 15\nTrace\n");
        let two = "Screen 4 3\nTrace\nClear\nTrace";
        assert_eq!(set(two, 0, 5), "Screen 4 3\nFrames 5\nTrace\nFrames 1\nClear\nTrace");
        assert_eq!(set(two, 1, 5), "Screen 4 3\nTrace\nClear\nFrames 5\nTrace");
        assert_eq!(set("", 0, 5), "Frames 5\n");
    }

    #[test]
    fn a_new_object_of_each_shape_is_valid() {
        for &command in Command::ALL {
            if role(command) != Role::Object || command.form().subject == Some(Subject::Quotes(Quotes::File))
            {
                continue;
            }
            for size in [1e-6, 1.0, 300.0] {
                let line = new_line(command, DVec3::new(1.0, 0.0, -2.0), size, 0);
                let text = format!("Screen 4 3\n{}\nTrace", line.text());
                let parsed = rayfold_scene::parse("a.txt", text.as_bytes(), &Default::default());
                assert!(parsed.script.is_some(), "{text}: {:?}", parsed.diagnostics);
            }
        }
    }

    #[test]
    fn copies_stand_behind_and_neighbours_change_places() {
        let lines = Line::split(TEXT.as_bytes());
        let (splices, copies) = duplicate(&lines, &[3, 1], 0.5);
        let text = after(TEXT, splices);
        assert!(text.contains("1 # a\nSphere 1  0.5 5 0  0 0 0  1 1 1 # a copy\n"), "{text}");
        let lines = Line::split(text.as_bytes());
        assert_eq!(
            copies.iter().map(|&at| lines[at].command()).collect::<Vec<_>>(),
            [Some(Command::Sphere), Some(Command::Cuboid)]
        );
        let lines = Line::split(TEXT.as_bytes());
        let (splices, at) = reorder(&lines, &SourceMap::of(&lines, 0, 1.0), 1, true).unwrap();
        let text = after(TEXT, splices);
        assert_eq!((at, Line::split(text.as_bytes())[3].command()), (3, Some(Command::Sphere)));
        assert!(reorder(&lines, &SourceMap::of(&lines, 0, 1.0), 1, false).is_none());
    }
}
