//! The numbers of a line at a moment, and the writing of a changed number: as a number, or as a key of a curve.
//!
//! Knows commands only by the forms of their parameters. Invariant: an unchanged number keeps its notation.

use glam::DVec3;
use rayfold_scene::{Command, Constraint, Curve, Field, Key, Kind, Mode, Parameter, Presence, parse_curve};

use crate::line::{Line, Words, written};
use crate::tables::{fields, of_kind};

/// The precision to which a curve is moved as a whole, as the inverse of the step.
const DECIMALS: f64 = 1e9;

/// The numbers of a line at a moment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Values {
    /// The command of the line.
    pub(crate) command: Command,
    /// The written numbers; `None` for a word that is no number.
    numbers: Vec<Option<f64>>,
}

/// The moment of a change, and whether the change is for that moment alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Keying {
    /// The frame that is shown.
    pub(crate) time: f64,
    /// The first frame, at which a number that was constant keeps its value.
    pub(crate) first: f64,
    /// Whether constant numbers become curves.
    pub(crate) auto: bool,
    /// Whether curves move as a whole instead of getting a key.
    pub(crate) whole: bool,
}

impl Keying {
    /// The keying that changes all moments.
    pub(crate) const ALWAYS: Self = Self { time: 1.0, first: 1.0, auto: false, whole: true };
}

impl Values {
    /// Returns `None` for a line without a command.
    pub(crate) fn of(line: &Line, time: f64) -> Option<Self> {
        let (command, words) = (line.command()?, line.words()?);
        let number =
            |at: usize| line.parameter(&words, at).or_else(|| Some(curve(line, &words, at)?.at(time)));
        Some(Self { command, numbers: (0..words.parameters.len()).map(number).collect() })
    }

    /// Returns a number of the line. For an omitted one, returns the default, if that is a plain number.
    pub(crate) fn number(&self, at: usize) -> Option<f64> {
        match self.numbers.get(at) {
            Some(number) => *number,
            None => default(self.command, at),
        }
    }

    /// Returns the written numbers; `None` for a word that is no number.
    pub(crate) fn written(&self) -> &[Option<f64>] {
        &self.numbers
    }

    /// Returns whether an object is hidden, because its radii are 0.
    pub(crate) fn hides(&self) -> bool {
        let numbers: Vec<f64> = self.numbers.iter().map_while(|number| *number).collect();
        self.command.form().hides(&numbers)
    }

    /// Returns three numbers of the line as a vector.
    pub(crate) fn vector(&self, first: usize) -> Option<DVec3> {
        Some(DVec3::new(self.number(first)?, self.number(first + 1)?, self.number(first + 2)?))
    }

    /// Returns the positions of the line, each with the index of its first number.
    pub(crate) fn positions(&self) -> impl Iterator<Item = (usize, DVec3)> {
        of_kind(self.command, Kind::Position).filter_map(|first| Some((first, self.vector(first)?)))
    }

    /// Returns the largest value of number `first` that the other numbers allow: the radius of a box with round edges
    /// has a bound.
    pub(crate) fn most(&self, first: usize) -> f64 {
        let starts: Vec<usize> = fields(self.command).map(|(start, _)| start).collect();
        let of = |constraint: &Constraint| match *constraint {
            Constraint::FitsTwice(number, u, v) if starts[number] == first => {
                let side = (self.vector(starts[v])? - self.vector(starts[u])?).abs();
                Some(0.5 * side.min_element())
            }
            _ => None,
        };
        self.command.form().constraints.iter().filter_map(of).fold(f64::INFINITY, f64::min)
    }

    /// Returns the largest of the line's lengths.
    pub(crate) fn reach(&self) -> f64 {
        of_kind(self.command, Kind::Length).filter_map(|first| self.number(first)).fold(0.0, f64::max)
    }
}

/// Returns the curve of a parameter.
pub(crate) fn curve(line: &Line, words: &Words, at: usize) -> Option<Curve> {
    parse_curve(line.word(words.parameters.get(at)?))
}

/// Returns the default of an omitted number.
fn default(command: Command, at: usize) -> Option<f64> {
    let (_, field) = field_of(command, at)?;
    // What has no colour in a model's file, and letters.
    if command.form().is_of_optional_surface(at) && field.presence == Presence::Required {
        return Some(if field.parameter == Parameter::Ambient { 0.08 } else { 0.72 });
    }
    field.presence.default()?.parse().ok()
}

fn field_of(command: Command, at: usize) -> Option<(usize, &'static Field)> {
    fields(command).find(|(first, field)| (*first..first + field.names.len()).contains(&at))
}

/// Returns the line with other values for its numbers from `first` on. An omitted parameter is written completely.
/// Returns `None` if a name replaces them.
pub(crate) fn changed(line: &Line, first: usize, to: &[f64], keying: Keying) -> Option<Line> {
    let (command, words) = (line.command()?, line.words()?);
    let count = words.parameters.len();
    if to.is_empty() {
        return Some(line.clone());
    }
    if let ([word], Some(known)) = (&words.parameters[..], command.form().word)
        && line.word(word).eq_ignore_ascii_case(known)
    {
        // The numbers come in place of the word.
        return changed(&line.cut(0)?, first, to, keying);
    }
    let mut end = first + to.len();
    // Includes the omitted numbers before it, and the rest of its parameter.
    let start = if count < end { count.min(first) } else { first };
    if count < end
        && let Some((first, field)) = field_of(command, end - 1)
    {
        end = end.max(first + field.names.len());
    }
    // A surface of numbers in place of that of the file is written whole.
    if command.form().is_bare(count) && count < end {
        end = end.max(command.form().required());
    }
    let mut changes = Vec::new();
    for at in start..end {
        let value = at.checked_sub(first).and_then(|i| to.get(i)).copied();
        match words.parameters.get(at) {
            Some(_) => {
                let Some(value) = value else { continue };
                if let Some(old) = line.parameter(&words, at) {
                    if old != value {
                        // A colour such as `#ff8000` holds no curves.
                        let keying = if line.is_level(&words, at) { Keying::ALWAYS } else { keying };
                        changes.push((at, begun(command, at, value, old, keying)));
                    }
                } else {
                    let curve = curve(line, &words, at)?;
                    if curve.at(keying.time) != value {
                        changes.push((at, moved(&curve, value, keying)?.to_string()));
                    }
                }
            }
            None => {
                let old = default(command, at).unwrap_or(0.0);
                changes.push((at, begun(command, at, value.unwrap_or(old), old, keying)));
            }
        }
    }
    line.with_words(&changes)
}

/// Returns the text of constant number `at` with another value.
fn begun(command: Command, at: usize, to: f64, old: f64, keying: Keying) -> String {
    let key = |frame, value| Key { frame, value };
    let is_kept = old == to || !keying.auto || keying.whole || keying.time == keying.first;
    if is_kept || !command.form().takes_curve(at) {
        return written(to);
    }
    let keys = vec![key(keying.first, old), key(keying.time, to)];
    Curve::through(Mode::Smooth, false, keys).map_or_else(|| written(to), |curve| curve.to_string())
}

/// Returns a curve with another value at the moment.
fn moved(curve: &Curve, to: f64, keying: Keying) -> Option<Curve> {
    if !keying.whole {
        return curve.with_key(keying.time, to);
    }
    let by = to - curve.at(keying.time);
    let keys = curve.keys().iter().map(|key| Key { value: tidy(key.value + by), ..*key });
    Curve::through(curve.mode(), curve.is_cycle(), keys.collect())
}

/// Rounds away the noise of the last bits.
pub(crate) fn tidy(x: f64) -> f64 {
    let rounded = (x * DECIMALS).round() / DECIMALS;
    if rounded.is_finite() { rounded } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AUTO: Keying = Keying { time: 25.0, first: 1.0, auto: true, whole: false };

    fn after(text: &str, first: usize, to: &[f64], keying: Keying) -> String {
        changed(&Line::new(text), first, to, keying).unwrap().text()
    }

    #[test]
    fn letters_have_a_surface_behind_numbers_that_are_no_curves() {
        let text = "Text \"a b\" 1 .2 centre # sign";
        let values = Values::of(&Line::new(text), 1.0).unwrap();
        assert_eq!(
            (values.number(0), values.number(2), values.number(7)),
            (Some(1.0), Some(0.08), Some(0.72))
        );
        assert_eq!(after(text, 0, &[2.0], AUTO), "Text \"a b\" 2 .2 centre # sign");
        let numbers = "Text \"a b\" 1 .2 0.08 0.08 0.08 0.5 0.72 0.72 centre # sign";
        assert_eq!(after(text, 5, &[0.5], Keying::ALWAYS), numbers);
        let keyed = "Text \"a b\" 1 .2 0.08 0.08 0.08 (smooth 1:0.5 25:0.7) 0.72 0.72 centre # sign";
        assert_eq!(after(numbers, 5, &[0.7], AUTO), keyed);
    }

    #[test]
    fn the_surface_of_a_mesh_is_written_whole() {
        let mesh = "Mesh \"a.obj\" smooth 40 # pot";
        let values = Values::of(&Line::new(mesh), 1.0).unwrap();
        assert_eq!(
            (values.number(0), values.number(3), values.number(6)),
            (Some(0.08), Some(0.72), Some(0.0))
        );
        let numbers = "Mesh \"a.obj\" 0.08 0.08 0.08 0.5 0.72 0.72 smooth 40 # pot";
        assert_eq!(after(mesh, 3, &[0.5], Keying::ALWAYS), numbers);
        assert_eq!(
            after("Mesh \"a.obj\"", 6, &[0.1], Keying::ALWAYS),
            "Mesh \"a.obj\" 0.08 0.08 0.08 0.72 0.72 0.72 0.1 0 0"
        );
    }

    #[test]
    fn a_changed_number_becomes_a_curve_and_all_else_stays() {
        let ball = "\tSphere  1.50, 0 1e0 0  red # ball";
        assert_eq!(
            after(ball, 1, &[2.0, 1.0, 0.0], AUTO),
            "\tSphere  1.50, (smooth 1:0 25:2) 1e0 0  red # ball"
        );
        let still = Keying { auto: false, ..AUTO };
        assert_eq!(after(ball, 1, &[2.0, 1.0, 0.0], still), "\tSphere  1.50, 2 1e0 0  red # ball");
        let at_the_first = Keying { time: 1.0, ..AUTO };
        assert_eq!(after(ball, 0, &[2.0], at_the_first), "\tSphere  2, 0 1e0 0  red # ball");
    }

    #[test]
    fn a_curve_gets_a_key_or_moves_as_a_whole() {
        let ball = "Sphere 1 (1:0.0 25:1 49:.5) 0 0 red";
        let set = |to, keying| after(ball, 1, &[to], keying);
        assert_eq!(set(2.0, AUTO), "Sphere 1 (1:0 25:2 49:0.5) 0 0 red");
        assert_eq!(set(0.5, Keying { time: 13.0, ..AUTO }), ball, "that is its value there");
        assert_eq!(set(3.0, Keying { time: 13.0, ..AUTO }), "Sphere 1 (1:0 13:3 25:1 49:0.5) 0 0 red");
        assert_eq!(set(1.3, Keying { whole: true, ..AUTO }), "Sphere 1 (1:0.3 25:1.3 49:0.8) 0 0 red");
    }

    #[test]
    fn what_was_left_out_comes_with_what_held() {
        let plain = Keying { auto: false, ..AUTO };
        assert_eq!(after("Use tie # a", 6, &[2.0], plain), "Use tie 0 0 0 0 0 0 2 # a");
        assert_eq!(after("Use tie 1 2 3", 4, &[90.0], plain), "Use tie 1 2 3 0 90 0");
        assert_eq!(after("Use tie", 6, &[2.0], AUTO), "Use tie 0 0 0 0 0 0 (smooth 1:1 25:2)");
        assert_eq!(changed(&Line::new("Sphere 1 0 0 0 red"), 4, &[1.0], plain), None, "a name is no number");
        assert_eq!(after("Screen 4 3", 0, &[8.0], AUTO), "Screen 8 3", "it takes no curves");
        assert_eq!(after("Fog none # a", 0, &[1.0, 0.5, 0.0, 9.0], plain), "Fog 1 0.5 0 9 # a");
        assert_eq!(after("Background none # a", 0, &[1.0, 0.5, 0.0], plain), "Background 1 0.5 0 # a");
        let red = "Sphere 1 0 0 0 #ff0000 1 1 1";
        assert_eq!(after(red, 5, &[1.0], AUTO), "Sphere 1 0 0 0 #ffff00 1 1 1", "a colour holds no curves");
    }

    #[test]
    fn values_are_those_of_the_moment() {
        let line = Line::new("Sphere (1:1 3:2) 0 (smooth 5:4) x red");
        let values = Values::of(&line, 2.0).unwrap();
        assert_eq!(values.written(), [Some(1.5), Some(0.0), Some(4.0), None, None]);
        let used = Values::of(&Line::new("Use tie"), 1.0).unwrap();
        assert_eq!(
            (used.number(5), used.number(6), used.vector(0)),
            (Some(0.0), Some(1.0), Some(DVec3::ZERO))
        );
    }
}
