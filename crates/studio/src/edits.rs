//! Edits of a script that are more than one number: new objects, copies, what is hidden, what falls down. Lines in,
//! splices out.

use glam::DVec3;
use rayfold_scene::{Command, Kind, Parameter, Presence, Scene};
use rayfold_tracer::RenderOptions;
use rayfold_tracer::probe::nearest_hits;

use crate::document::Splice;
use crate::handles::Values;
use crate::line::{Line, written};
use crate::stage::Stage;
use crate::tables::{Role, fields, role};
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

/// What a script needs before anything of it can be seen.
const SCREEN: &str = "Screen 960 540";
const CAMERA: &str = "Camera 0 3 9  0 -0.28 -1  0 1 0  1  -0.8 -0.45  0.8 0.45";
const BACKGROUND: &str = "Background 0.86 0.9 0.95";
const SUN: &str = "Ilight 0.8 0.8 0.8  0.6 -1 -0.5   # sun";

/// One line in place of another.
pub(crate) fn set(line: usize, to: Line) -> Splice {
    Splice { at: line, removed: 1, inserted: vec![to] }
}

/// A new line of a command: an object of about `size` that stands on `ground`, the `count`th in its script.
pub(crate) fn new_line(command: Command, ground: DVec3, size: f64, count: usize) -> Line {
    let decimals = (2.0 - size.log10().floor()).clamp(0.0, 12.0) as usize;
    let round = |x: f64| format!("{x:.decimals$}").parse::<f64>().unwrap_or(x);
    let all = || fields(command).map(|(_, field)| field).filter(|field| field.presence == Presence::Required);
    let places = all().filter(|field| field.kind == Kind::Position).count();
    let is_round = all().any(|field| field.kind == Kind::Length) && places == 1;
    let color = COLORS[count % COLORS.len()];
    let (mut place, mut length) = (0, 0);
    let mut text = command.name().to_owned();
    for field in all() {
        let values: Vec<f64> = match field.kind {
            Kind::Position => {
                let off = match (places, place) {
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
                vec![round(if length == 1 { size } else { 0.35 * size })]
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

/// Adds a line of a frame, with all that is missing to see it; what is done, and where the line is then.
pub(crate) fn add(lines: &[Line], stage: &Stage, line: Line) -> (Vec<Splice>, usize) {
    let mut before = Vec::new();
    if stage.screen.is_none() {
        before.push(Line::new(SCREEN));
    }
    if stage.camera.is_none() && stage.objects.is_empty() && stage.trace.is_none() {
        before.push(Line::new(CAMERA));
        if stage.background.is_none() {
            before.push(Line::new(BACKGROUND));
        }
    }
    let is_light = line.command().is_some_and(|command| role(command) == Role::Light);
    if stage.lights.is_empty() && stage.objects.is_empty() && stage.trace.is_none() && !is_light {
        before.push(Line::new(SUN));
    }
    let at = stage.end(lines);
    let place = at + before.len();
    let mut inserted = before;
    inserted.push(line);
    if stage.trace.is_none() {
        inserted.push(Line::new(Command::Trace.name()));
    }
    // A new line behind a last one without an end begins where that one gets its end.
    (vec![Splice { at, removed: 0, inserted }], place)
}

/// Lines go; from the last to the first.
pub(crate) fn remove(lines: &[usize]) -> Vec<Splice> {
    let mut lines = lines.to_vec();
    lines.sort_unstable();
    lines.dedup();
    lines.into_iter().rev().map(|at| Splice { at, removed: 1, inserted: Vec::new() }).collect()
}

/// Lines again, each behind itself and a little aside; the lines of the copies.
pub(crate) fn duplicate(lines: &[Line], which: &[usize], aside: f64) -> (Vec<Splice>, Vec<usize>) {
    let mut which: Vec<_> = which.iter().copied().filter(|&line| line < lines.len()).collect();
    which.sort_unstable();
    which.dedup();
    let copies = which.iter().enumerate().map(|(i, line)| line + 1 + i).collect();
    let copy = |at: usize| {
        let line = moved(&lines[at], DVec3::new(aside, 0.0, 0.0)).unwrap_or_else(|| lines[at].clone());
        let name = line.name().map(|name| format!("{name} copy"));
        let line = name.and_then(|name| line.named(&name)).unwrap_or(line);
        Splice { at: at + 1, removed: 0, inserted: vec![line] }
    };
    (which.iter().rev().map(|&at| copy(at)).collect(), copies)
}

/// A line with all its positions moved; those numbers that stay are not touched.
pub(crate) fn moved(line: &Line, by: DVec3) -> Option<Line> {
    let values = Values::of(line)?;
    values.positions().try_fold(line.clone(), |line, (first, position)| {
        let to = position + by;
        let tidy = |axis: usize| {
            if by[axis] == 0.0 { position[axis] } else { (to[axis] * 1e9).round() / 1e9 }
        };
        line.with_numbers(first, &[tidy(0), tidy(1), tidy(2)])
    })
}

/// The command that a comment hides; its line without the sign.
pub(crate) fn hidden(line: &Line) -> Option<Line> {
    let text = line.text();
    let inner = text.trim_start().strip_prefix('#')?;
    let inner = line.with_text(inner.strip_prefix(' ').unwrap_or(inner));
    let command = inner.command()?;
    let words = inner.words()?;
    let is_meant = role(command) != Role::Setting
        && command.form().takes(words.parameters.len())
        && words.parameters.iter().all(|word| inner.number(word).is_some());
    is_meant.then_some(inner)
}

/// Lines become comments; if all of them are hidden, commands again.
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

/// A line changes places with the neighbour of its kind.
pub(crate) fn reorder(
    lines: &[Line],
    stage: &Stage,
    line: usize,
    down: bool,
) -> Option<(Vec<Splice>, usize)> {
    let row = [&stage.objects, &stage.lights].into_iter().find(|row| row.contains(&line))?;
    let at = row.iter().position(|&other| other == line)?;
    let other = *if down { row.get(at + 1)? } else { row.get(at.checked_sub(1)?)? };
    let (first, second) = (line.min(other), line.max(other));
    let mut inserted: Vec<Line> = lines[first..=second].to_vec();
    let last = inserted.len() - 1;
    inserted.swap(0, last);
    Some((vec![Splice { at: first, removed: last + 1, inserted }], other))
}

/// Where the objects and lamps of some lines are.
pub(crate) fn bounds<'a>(lines: impl IntoIterator<Item = &'a Line>) -> Option<Bounds> {
    let values = lines.into_iter().filter_map(Values::of);
    Bounds::of(values.filter(|values| role(values.command) != Role::Camera).flat_map(|values| {
        let reach = values.reach();
        values.positions().map(|(_, position)| (position, reach)).collect::<Vec<_>>()
    }))
}

/// Objects fall together until one of them rests on what is below, or on the height 0 where nothing is.
pub(crate) fn drop_down(lines: &[Line], stage: &Stage, scene: &Scene, which: &[usize]) -> Vec<Splice> {
    let chosen = || which.iter().filter_map(|&at| Some((at, lines.get(at)?)));
    let others = stage.objects.iter().zip(scene.objects.iter()).filter(|(line, _)| !which.contains(line));
    let others: Vec<_> = others.map(|(_, object)| object).cloned().collect();
    let mut below = scene.clone();
    below.objects = others.into();
    let falls = chosen().filter_map(|(_, line)| {
        let bounds = bounds([line])?;
        // From its middle: what it lies on is not below its lowest point.
        let from = bounds.center();
        let hit = nearest_hits(&below, &[(from, DVec3::NEG_Y)], &RenderOptions::default()).ok()?;
        let height = from.y - bounds.low.y;
        Some(
            hit.into_iter().next().flatten().map_or(bounds.low.y, |found| (found.distance - height).max(0.0)),
        )
    });
    let Some(fall) = falls.reduce(f64::min) else { return Vec::new() };
    let fall = (fall * 1e9).round() / 1e9;
    chosen().filter_map(|(at, line)| Some(set(at, moved(line, DVec3::NEG_Y * fall)?))).collect()
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

    fn sound(text: &str) -> Scene {
        let parsed = rayfold_scene::parse("a", text.as_bytes(), &Default::default());
        assert!(parsed.diagnostics.is_empty(), "{text}\n{:?}", parsed.diagnostics);
        parsed.script.unwrap().frame(0).unwrap()
    }

    #[test]
    fn every_object_and_light_can_be_added_to_nothing() {
        for &command in Command::ALL {
            if !matches!(role(command), Role::Object | Role::Light) {
                continue;
            }
            for text in ["", "# mine", "Screen 4 3\r\nTrace\r\n", "Screen 4 3\nTrace"] {
                let lines = Line::split(text.as_bytes());
                let line = new_line(command, DVec3::new(1.0, 0.0, -2.0), 0.7, 3);
                let (splices, at) = add(&lines, &Stage::of(&lines, 0), line);
                let text = after(text, splices);
                sound(&text);
                assert_eq!(Line::split(text.as_bytes())[at].command(), Some(command), "{text}");
            }
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
    }

    #[test]
    fn an_object_falls_onto_what_is_below() {
        let lines = Line::split(TEXT.as_bytes());
        let fallen = after(TEXT, drop_down(&lines, &Stage::of(&lines, 0), &sound(TEXT), &[1]));
        assert_eq!(fallen, TEXT.replace("0 5 0", "0 1.5 0"));
        let lines = Line::split(fallen.as_bytes());
        let again = drop_down(&lines, &Stage::of(&lines, 0), &sound(&fallen), &[1]);
        assert_eq!(after(&fallen, again), fallen, "it lies");
        let raised = TEXT.replace("-2 0 -2  2 .5 2", "-2 2 -2  2 2.5 2");
        let lines = Line::split(raised.as_bytes());
        let fallen = after(&raised, drop_down(&lines, &Stage::of(&lines, 0), &sound(&raised), &[3]));
        assert_eq!(fallen, raised.replace("-2 2 -2  2 2.5 2", "-2 0 -2  2 0.5 2"), "the ground is at 0");
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
        let (splices, at) = reorder(&lines, &Stage::of(&lines, 0), 1, true).unwrap();
        let text = after(TEXT, splices);
        assert_eq!((at, Line::split(text.as_bytes())[3].command()), (3, Some(Command::Sphere)));
        assert!(reorder(&lines, &Stage::of(&lines, 0), 1, false).is_none());
    }
}
