//! Arrangements of several lines: alignment, and lines that are pasted as text.

use glam::DVec3;
use rayfold_scene::Command;

use crate::document::Splice;
use crate::edits::{moved, set};
use crate::line::Line;
use crate::materials;
use crate::protocol::Alignment;
use crate::source_map::SourceMap;
use crate::tables::{Role, role};
use crate::values::Keying;
use crate::view::Bounds;

/// Moves lines along an axis so that they are aligned. `boxes` are the lines with their bounds.
pub(crate) fn align(
    lines: &[Line],
    boxes: &[(usize, Bounds)],
    axis: usize,
    how: Alignment,
    keying: Keying,
) -> Vec<Splice> {
    let Some(all) = boxes.iter().map(|(_, bounds)| *bounds).reduce(Bounds::with) else { return Vec::new() };
    let center = |bounds: &Bounds| bounds.center()[axis];
    let mut sorted: Vec<_> = boxes.iter().collect();
    sorted.sort_by(|(_, a), (_, b)| center(a).total_cmp(&center(b)));
    let (first, last) = match (sorted.first(), sorted.last()) {
        (Some((_, first)), Some((_, last))) => (center(first), center(last)),
        _ => return Vec::new(),
    };
    let gap = (last - first) / (sorted.len().max(2) - 1) as f64;
    let to = |place: usize, bounds: &Bounds| match how {
        Alignment::Least => all.low[axis] - bounds.low[axis],
        Alignment::Middle => center(&all) - center(bounds),
        Alignment::Most => all.high[axis] - bounds.high[axis],
        Alignment::Distribute => first + gap * place as f64 - center(bounds),
    };
    let change = |(place, (at, bounds)): (usize, &&(usize, Bounds))| {
        Some(set(*at, moved(lines.get(*at)?, to(place, bounds) * DVec3::AXES[axis], keying)?))
    };
    sorted.iter().enumerate().filter_map(change).collect()
}

/// Adds lines of a text to a frame: objects, groups and lights after the existing ones, and materials and groups with
/// new names before them. Returns the changes, and the new lines of the drawn items.
pub(crate) fn paste(lines: &[Line], source_map: &SourceMap, text: &str) -> (Vec<Splice>, Vec<usize>) {
    let defines = |line: &Line, command: Command, name: Option<&str>| {
        line.command() == Some(command) && line.subject() == name
    };
    let (mut before, mut drawn) = (Vec::new(), Vec::new());
    // The group whose lines follow, and whether it is new.
    let mut open: Option<bool> = None;
    for line in Line::split(text.as_bytes()).iter().map(|line| line.with_end(b"")) {
        let Some(command) = line.command() else { continue };
        let is_known = || lines.iter().any(|other| defines(other, command, line.subject()));
        match (role(command), open) {
            (_, Some(is_new)) => {
                if command == Command::End {
                    open = None;
                }
                if is_new {
                    before.push(line);
                }
            }
            (Role::Group, None) => {
                let is_new = !is_known();
                open = Some(is_new);
                if is_new {
                    before.push(line);
                }
            }
            (Role::Material, None) if !is_known() => before.push(line),
            (Role::Object | Role::Light | Role::Use, None) => drawn.push(line),
            (Role::Material | Role::Camera | Role::Setting, None) => {}
        }
    }
    if open == Some(true) {
        before.push(Line::new(Command::End.name()));
    }
    let (at, start) = (source_map.end(lines), materials::start(lines));
    let first = at + before.len();
    let places = (first..first + drawn.len()).collect();
    let splices = [(at, drawn), (start.min(at), before)]
        .into_iter()
        .filter(|(_, inserted)| !inserted.is_empty())
        .map(|(at, inserted)| Splice { at, removed: 0, inserted });
    (splices.collect(), places)
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

    const TEXT: &str =
        "Screen 4 3\nMaterial red diffuse 1 0 0\nSphere 1  0 0 0  red\nSphere 2  5 3 0  red # b\nTrace\n";

    #[test]
    fn what_is_pasted_brings_its_names_and_is_drawn() {
        let lines = Line::split(TEXT.as_bytes());
        let source_map = SourceMap::of(&lines, 0, 1.0);
        let pasted = "Material red diffuse 0 0 1\nMaterial blue diffuse 0 0 1\r\nGroup g\nSphere 1 0 0 0 blue\nEnd\n\
                      Use g 1 2 3\nTrace\nScreen 9 9\nIlight 1 1 1 0 -1 0 # sun\n";
        let (splices, places) = paste(&lines, &source_map, pasted);
        let text = after(TEXT, splices);
        let now = Line::split(text.as_bytes());
        let drawn: Vec<_> = places.iter().map(|&at| now[at].text()).collect();
        assert_eq!(drawn, ["Use g 1 2 3", "Ilight 1 1 1 0 -1 0 # sun"]);
        assert!(rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.is_some(), "{text}");
        assert_eq!(text.matches("Material red").count(), 1);
        assert_eq!(text.matches("Screen").count(), 1);
        assert_eq!(paste(&lines, &source_map, "what is this\n\n# Sphere\nTrace").0, []);
    }

    #[test]
    fn boxes_are_aligned_at_their_ends_and_middles() {
        let lines = Line::split(TEXT.as_bytes());
        let ball = |at: f64, radius: f64| Bounds::of([(DVec3::new(at, 0.0, 0.0), radius)]).unwrap();
        let boxes = [(2, ball(0.0, 1.0)), (3, ball(5.0, 2.0))];
        let x = |how| {
            let text = after(TEXT, align(&lines, &boxes, 0, how, Keying::ALWAYS));
            let number =
                |line: usize| text.lines().nth(line).unwrap().split_whitespace().nth(2).unwrap().to_owned();
            (number(2), number(3))
        };
        let texts = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        assert_eq!(x(Alignment::Least), texts("0", "1"));
        assert_eq!(x(Alignment::Middle), texts("3", "3"));
        assert_eq!(x(Alignment::Most), texts("6", "5"));
        assert_eq!(x(Alignment::Distribute), texts("0", "5"), "two are at equal distances already");
    }
}
