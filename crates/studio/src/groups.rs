//! Grouping: several lines become a group, and a `Use` takes their place. The picture stays the same, and they move
//! and turn as one. Ungrouping reverses that.

use std::collections::HashSet;
use std::ops::Range;

use glam::DVec3;
use rayfold_scene::{Command, Object, Scene};

use crate::document::Splice;
use crate::edits::moved;
use crate::extent::bounds;
use crate::line::{Line, written};
use crate::source_map::SourceMap;
use crate::values::{Keying, Values, tidy};

/// The reason why some lines cannot be grouped or ungrouped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// None of the lines is drawn on its own.
    NothingDrawn,
    /// A `Trace` or a `Clear` is between the lines.
    SeveralFrames,
    /// The lines cannot express the rotation or scale of the group.
    Turned,
}

impl Refusal {
    /// Returns the message for the user.
    pub(crate) fn message(self) -> &'static str {
        match self {
            Self::NothingDrawn => "Only objects and groups of the picture can be grouped: select some first.",
            Self::SeveralFrames => {
                "These cannot be a group: a `Trace` or a `Clear` is between them in the script."
            }
            Self::Turned => {
                "Only a `Use` of a group that is neither turned nor sized, and whose place has no keys, can be taken apart."
            }
        }
    }
}

/// Makes a group of lines. Returns the changes, and the new index of the line of its `Use`. The origin of the group is
/// at the foot of the middle of its objects, about which it turns. If a pattern would shift, the origin stays that of
/// the world.
///
/// # Errors
/// Returns the reason if they cannot be a group.
pub(crate) fn group(
    lines: &[Line],
    source_map: &SourceMap,
    scene: &Scene,
    which: &[usize],
) -> Result<(Vec<Splice>, usize), Refusal> {
    let chosen: Vec<usize> = source_map.objects.iter().copied().filter(|line| which.contains(line)).collect();
    let (Some(&first), Some(&last)) = (chosen.iter().min(), chosen.iter().max()) else {
        return Err(Refusal::NothingDrawn);
    };
    let ends = |line: &Line| matches!(line.command(), Some(Command::Trace | Command::Clear));
    if lines[first..=last].iter().any(ends) {
        return Err(Refusal::SeveralFrames);
    }
    let pivot = pivot(source_map, scene, &chosen);
    let name = free_name(lines);
    let mut inserted: Vec<Line> =
        (first..=last).filter(|at| !chosen.contains(at)).map(|at| lines[at].clone()).collect();
    inserted.push(Line::new(&format!("{} {name}", Command::Group.name())));
    for &at in &chosen {
        let line = &lines[at];
        inserted.push(moved(line, -pivot, Keying::ALWAYS).unwrap_or_else(|| line.clone()));
    }
    inserted.push(Line::new(Command::End.name()));
    let [x, y, z] = pivot.to_array().map(written);
    inserted.push(Line::new(&format!("{} {name}  {x} {y} {z}", Command::Use.name())));
    let place = first + inserted.len() - 1;
    Ok((vec![Splice { at: first, removed: last + 1 - first, inserted }], place))
}

/// Makes the line that draws a group at a place.
pub(crate) fn use_line(name: &str, place: DVec3) -> Line {
    let [x, y, z] = place.to_array().map(|x| written(tidy(x)));
    Line::new(&format!("{} {name}  {x} {y} {z}", Command::Use.name()))
}

/// Takes a `Use` apart: the lines of its group replace it, moved to its position. Removes the group if no other line
/// uses it. Returns the changes, and the new lines.
///
/// # Errors
/// Returns the reason if the lines alone cannot express the group's placement.
pub(crate) fn ungroup(lines: &[Line], at: usize) -> Result<(Vec<Splice>, Range<usize>), Refusal> {
    let found = lines.get(at).filter(|line| line.command() == Some(Command::Use));
    let (Some(line), Some(name)) = (found, found.and_then(Line::subject)) else {
        return Err(Refusal::NothingDrawn);
    };
    let values = Values::of(line, 1.0).ok_or(Refusal::Turned)?;
    let is_plain = (3..7).all(|number| values.number(number) == Some(if number == 6 { 1.0 } else { 0.0 }));
    if !is_plain || line.bytes().contains(&b'(') {
        return Err(Refusal::Turned);
    }
    let is = |line: &Line, command: Command| line.command() == Some(command) && line.subject() == Some(name);
    let start = lines[..at].iter().rposition(|line| is(line, Command::Group)).ok_or(Refusal::NothingDrawn)?;
    let end = lines[start..at].iter().position(|line| line.command() == Some(Command::End));
    let end = start + end.ok_or(Refusal::NothingDrawn)?;
    let by = values.vector(0).unwrap_or_default();
    let inserted: Vec<_> = lines[start + 1..end]
        .iter()
        .map(|line| moved(line, by, Keying::ALWAYS).unwrap_or_else(|| line.clone()))
        .collect();
    let is_needed = lines.iter().enumerate().any(|(other, line)| other != at && is(line, Command::Use));
    let gone = if is_needed { 0 } else { end + 1 - start };
    let place = at - gone..at - gone + inserted.len();
    let mut splices = vec![Splice { at, removed: 1, inserted }];
    if gone > 0 {
        splices.push(Splice { at: start, removed: gone, inserted: Vec::new() });
    }
    Ok((splices, place))
}

/// Returns the origin of a new group.
fn pivot(source_map: &SourceMap, scene: &Scene, chosen: &[usize]) -> DVec3 {
    let own = || {
        let of_line = |at: usize| source_map.line_of(at).is_some_and(|line| chosen.contains(&line));
        scene.objects.iter().enumerate().filter(move |(at, _)| of_line(*at)).map(|(_, object)| object)
    };
    let slides = |object: &Object| match object {
        Object::Instance(_) => false,
        _ => object.material().finish().is_some_and(|finish| finish.pattern.is_some()),
    };
    let Some(around) = bounds(own()).filter(|_| !own().any(slides)) else { return DVec3::ZERO };
    let step = 10f64.powf(around.radius().log10().floor() - 2.0);
    let middle = around.center().with_y(around.low.y);
    let round = |x: f64| {
        let decimals = (-step.log10().round()).clamp(0.0, 12.0) as usize;
        format!("{:.decimals$}", (x / step).round() * step).parse().unwrap_or(x)
    };
    let pivot = DVec3::from(middle.to_array().map(round));
    if pivot.is_finite() { pivot + 0.0 } else { DVec3::ZERO }
}

/// Returns a name that no group has.
fn free_name(lines: &[Line]) -> String {
    let is_group = |line: &&Line| line.command() == Some(Command::Group);
    let taken: HashSet<&str> = lines.iter().filter(is_group).filter_map(Line::subject).collect();
    let mut names = (1..).map(|number| format!("group{number}"));
    names.find(|name| !taken.contains(name.as_str())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use rayfold_tracer::{RenderOptions, render};

    use super::*;
    use crate::document::Document;

    fn scene(text: &str) -> Scene {
        let parsed = rayfold_scene::parse("a", text.as_bytes(), &Default::default());
        assert!(parsed.diagnostics.iter().all(|fault| !fault.is_error()), "{:?}\n{text}", parsed.diagnostics);
        parsed.script.unwrap().frame(0).unwrap()
    }

    fn grouped(text: &str, which: &[usize]) -> Result<(String, usize), Refusal> {
        let lines = Line::split(text.as_bytes());
        let (splices, at) = group(&lines, &SourceMap::of(&lines, 0, 1.0), &scene(text), which)?;
        let mut document = Document::new(text.as_bytes());
        for splice in splices {
            document.apply(splice, None);
        }
        Ok((String::from_utf8(document.bytes()).unwrap(), at))
    }

    const HEAD: &str = "Screen 64 48\nLook 0 2 9  0 1 0  40\nIlight 1 1 1  0.5 -1 -0.7\n";

    #[test]
    fn a_group_looks_as_its_lines_did() {
        let text = format!(
            "{HEAD}Sphere 1  (1:-2 9:3) 1 0  .1 .1 .1 .8 .2 .2 # a\n# between\nDisc 9  0 0 0  0 1 0  .1 .1 .1 .5 .5 .5\n\
             Box 1 0 0  2 1 1  0 0 .2 .2 .2 .8\nFrames 9\nTrace"
        );
        let (now, at) = grouped(&text, &[3, 6]).unwrap();
        let lines = Line::split(now.as_bytes());
        assert_eq!(lines[at].command(), Some(Command::Use), "{now}");
        assert!(now.contains("\nGroup group1\nSphere 1  (1:-1.5 9:3.5) 1 0 "), "{now}");
        assert!(now.contains("\nEnd\nUse group1  -0.5 0 0\nFrames 9\nTrace"), "{now}");
        assert!(now.contains("Ilight 1 1 1  0.5 -1 -0.7\n# between\nDisc"), "{now}");
        let options = RenderOptions::default();
        let off = |a: u8, b: u8| a.abs_diff(b) > 1;
        let (a, b) = (render(&scene(&text), &options).unwrap(), render(&scene(&now), &options).unwrap());
        let differ = a.as_raw().iter().zip(b.as_raw()).filter(|(a, b)| off(**a, **b)).count();
        assert!(differ < 12, "{differ} levels at edges may round otherwise");
        let (again, _) = grouped(&now, &[at]).unwrap();
        assert!(again.contains("\nGroup group2\nUse group1  0 0 0\nEnd\nUse group2  -0.5 0 0\n"), "{again}");
    }

    #[test]
    fn what_cannot_be_a_group_is_told() {
        let text = format!("{HEAD}Sphere 1 0 0 0 1 1 1 0 0 0\nTrace\nSphere 2 0 0 0 1 1 1 0 0 0\nTrace\n");
        assert_eq!(grouped(&text, &[0, 2]), Err(Refusal::NothingDrawn));
        let lines = Line::split(text.as_bytes());
        let last = rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap();
        let found = group(&lines, &SourceMap::of(&lines, 1, 1.0), &last.frame(1).unwrap(), &[3, 5]);
        assert_eq!(found, Err(Refusal::SeveralFrames));
    }

    #[test]
    fn a_group_that_is_taken_apart_is_as_it_was() {
        let body = "Sphere 1  -2 1.5 0  .1 .1 .1 .8 .2 .2 # a\nBox 1 0 0  2 1 1  0 0 .2 .2 .2 .8\n";
        let text = format!("{HEAD}{body}Trace\n");
        let (now, at) = grouped(&text, &[3, 4]).unwrap();
        let apart = |text: &str, at| {
            let (splices, place) = ungroup(&Line::split(text.as_bytes()), at)?;
            let mut document = Document::new(text.as_bytes());
            for splice in splices {
                document.apply(splice, None);
            }
            Ok::<_, Refusal>((String::from_utf8(document.bytes()).unwrap(), place))
        };
        let (again, place) = apart(&now, at).unwrap();
        assert_eq!((again.as_str(), place), (text.as_str(), 3..5));
        let twice = now.replace("Trace", "Use group1 0 0 1\nTrace");
        let (again, place) = apart(&twice, at).unwrap();
        assert!(again.contains("Group group1\n") && again.contains("Use group1 0 0 1\n"), "{again}");
        assert!(
            Line::split(again.as_bytes())[place.start].text().starts_with("Sphere 1  -2 1.5 0 "),
            "{again}"
        );
        let turned = now.replace("Use group1  -0.5 0 0", "Use group1  -0.5 0 0  0 9 0");
        assert_ne!(turned, now);
        assert_eq!(apart(&turned, at), Err(Refusal::Turned));
        assert_eq!(apart(&now, 0), Err(Refusal::NothingDrawn));
    }

    #[test]
    fn a_pattern_stays_where_it_is() {
        let text = format!(
            "{HEAD}Material b diffuse 0 0 0\nMaterial a diffuse 1 1 1 checker 0.3 b\nSphere 1  2 1 0  a\nTrace\n"
        );
        let (now, _) = grouped(&text, &[5]).unwrap();
        assert!(now.contains("Group group1\nSphere 1  2 1 0  a\nEnd\nUse group1  0 0 0\n"), "{now}");
    }
}
