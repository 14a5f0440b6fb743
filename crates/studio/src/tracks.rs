//! The numbers of a script that change, each a track of keys, and the edits of keys.
//!
//! Lines in, lines out: an edit of keys rewrites the words of the affected curves. `scene` evaluates and
//! writes curves. Invariants: a curve that is left with one key becomes a number. An edit of keys that do
//! not exist changes nothing.

use std::collections::BTreeMap;

use rayfold_scene::{Command, Curve, Field, Key, Kind, Mode, parse_curve};
use serde::{Deserialize, Serialize};

use crate::clauses;
use crate::line::{Line, written};
use crate::tables::{Role, fields, role};
use crate::values::{curve, tidy};

/// The largest number of tracks that are sent to the page.
const TRACKS: usize = 300;

/// The largest number of keys of all these tracks.
const KEYS: usize = 20_000;

/// The number of keys up to which all curves are drawn with [`LINES`].
const FINE_KEYS: usize = 1000;

/// The number of straight pieces between two keys of a curve that is no cubic.
const LINES: u32 = 32;

/// A number that changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Track {
    /// The index of its line, from 0.
    pub(crate) line: usize,
    /// The index among the line's parameters, from 0.
    pub(crate) number: usize,
    /// The name of the parameter, such as `centre: cx`.
    pub(crate) label: String,
    /// The interpolation as in a script: a word, and after `bezier` its four numbers.
    pub(crate) mode: String,
    /// Whether the curve restarts at its last key.
    pub(crate) cycle: bool,
    /// Frames and values of the keys.
    pub(crate) keys: Vec<(f64, f64)>,
    /// The curve as a path of SVG, in frames and values.
    pub(crate) path: String,
}

/// All tracks of a script, up to the limit of the page.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "camelCase")]
pub(crate) struct Tracks {
    /// The tracks in the order of the text.
    pub(crate) tracks: Vec<Track>,
    /// Whether there are more.
    pub(crate) more: bool,
}

/// The position of a key.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct KeyPlace {
    /// The index of its line, from 0.
    pub(crate) line: usize,
    /// The index among the line's parameters, from 0.
    pub(crate) number: usize,
    /// The frame of the key.
    pub(crate) frame: f64,
}

/// A key that was copied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Copied {
    /// The command of the original line.
    pub(crate) command: Command,
    /// The position of the original key.
    pub(crate) place: KeyPlace,
    /// The value of the key.
    pub(crate) value: f64,
    /// The interpolation of its track.
    mode: Mode,
}

/// A number of a line with its parameter.
pub(crate) struct Slot {
    /// The index among the line's parameters.
    pub(crate) number: usize,
    /// The index of the first number of its parameter.
    pub(crate) first: usize,
    /// The name of the number.
    pub(crate) name: &'static str,
    /// The parameter to which it belongs.
    pub(crate) field: &'static Field,
}

/// Returns the numbers of a line, including those of a material's clauses.
pub(crate) fn slots(line: &Line) -> Vec<Slot> {
    let (Some(command), Some(words)) = (line.command(), line.words()) else { return Vec::new() };
    let of = |first: usize, field: &'static Field| {
        let names = field.names.iter().enumerate();
        names.map(move |(i, name)| Slot { number: first + i, first, name, field })
    };
    if command != Command::Material {
        return fields(command).flat_map(|(first, field)| of(first, field)).collect();
    }
    let mut slots: Vec<_> =
        clauses::numbers(line).into_iter().flat_map(|(first, field)| of(first, field)).collect();
    slots.retain(|slot| slot.number < words.parameters.len());
    slots
}

/// Returns all tracks of some lines.
pub(crate) fn tracks(lines: &[Line]) -> Tracks {
    let mut found = Tracks::default();
    let mut keys = 0;
    // Most lines have no curve, which this test finds quickly.
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| line.bytes().contains(&b'(')) {
        let Some(words) = line.words() else { continue };
        for slot in slots(line) {
            let Some(curve) = curve(line, &words, slot.number) else { continue };
            keys += curve.keys().len();
            if found.tracks.len() == TRACKS || keys > KEYS {
                found.more = true;
                return found;
            }
            found.tracks.push(Track {
                line: at,
                number: slot.number,
                label: label(&slot),
                mode: curve.mode().to_string(),
                cycle: curve.is_cycle(),
                keys: curve.keys().iter().map(|key| (key.frame, key.value)).collect(),
                path: path(&curve, keys <= FINE_KEYS),
            });
        }
    }
    found
}

/// Returns the mode with this name, or with these words of a script.
fn mode_of(words: &str) -> Option<Mode> {
    let by_name = Mode::ALL.iter().copied().find(|mode| mode.name() == words);
    by_name.or_else(|| parse_curve(&format!("({words} 1:0 2:1)")).map(|curve| curve.mode()))
}

/// Returns a curve as a path of SVG, in frames and values. Its pieces are lines and cubics, which are exact. Modes with
/// other functions are drawn with [`LINES`] lines, or with a single one unless `fine`.
fn path(curve: &Curve, fine: bool) -> String {
    let keys = curve.keys();
    let mut path = format!("M{:e} {:e}", keys[0].frame, keys[0].value);
    for (from, to) in keys.iter().zip(&keys[1..]) {
        let (long, high) = (to.frame - from.frame, to.value - from.value);
        let cubic = match curve.mode() {
            // The cubic through its values at the thirds.
            Mode::Smooth => {
                let [first, second] = [1.0, 2.0].map(|third| curve.at(from.frame + long * third / 3.0));
                let control = |near: f64, first: f64, second: f64, far: f64| {
                    (-5.0 * near + 18.0 * first - 9.0 * second + 2.0 * far) / 6.0
                };
                let begin = control(from.value, first, second, to.value);
                Some([1.0 / 3.0, begin, 2.0 / 3.0, control(to.value, second, first, from.value)])
            }
            Mode::Bezier([a, b, c, d]) => Some([a, from.value + b * high, c, from.value + d * high]),
            _ => None,
        };
        let (x, y) = (to.frame, to.value);
        match (cubic, curve.mode()) {
            (Some([a, b, c, d]), _) => {
                let at = |share: f64| tidy(from.frame + share * long);
                path += &format!("C{:e} {:e} {:e} {:e} {x:e} {y:e}", at(a), tidy(b), at(c), tidy(d));
            }
            (None, Mode::Step) => path += &format!("H{x:e}V{y:e}"),
            (None, mode) => {
                let lines = if fine && mode != Mode::Linear { LINES } else { 1 };
                for k in 1..lines {
                    let frame = from.frame + long * f64::from(k) / f64::from(lines);
                    path += &format!("L{:e} {:e}", tidy(frame), tidy(curve.at(frame)));
                }
                path += &format!("L{x:e} {y:e}");
            }
        }
    }
    path
}

fn label(slot: &Slot) -> String {
    let field = slot.field.parameter.to_string();
    let field = field.strip_prefix("the ").or(field.strip_prefix("a ")).unwrap_or(&field);
    if slot.field.names.len() > 1 { format!("{field}: {}", slot.name) } else { field.to_owned() }
}

/// Returns the numbers of a line for which a key is set by default: those that are curves already, else its position
/// and rotation, else its direction.
pub(crate) fn main_numbers(line: &Line) -> Vec<usize> {
    let (Some(command), Some(words)) = (line.command(), line.words()) else { return Vec::new() };
    if !command.form().curves {
        return Vec::new();
    }
    let all = slots(line);
    let changing: Vec<_> =
        all.iter().map(|slot| slot.number).filter(|&at| curve(line, &words, at).is_some()).collect();
    if !changing.is_empty() {
        return changing;
    }
    let of = |kinds: &[Kind]| -> Vec<usize> {
        all.iter().filter(|slot| kinds.contains(&slot.field.kind)).map(|slot| slot.number).collect()
    };
    let places = of(&[Kind::Position, Kind::Rotation]);
    match role(command) {
        Role::Object | Role::Light | Role::Camera | Role::Use if places.is_empty() => of(&[Kind::Direction]),
        Role::Object | Role::Light | Role::Camera | Role::Use => places,
        Role::Group | Role::Material | Role::Setting => Vec::new(),
    }
}

/// Returns a line with keys at a frame, with the values of its numbers there. If all of them have a key there,
/// the keys are removed.
pub(crate) fn toggled(line: &Line, numbers: &[usize], frame: f64) -> Option<Line> {
    let (command, words) = (line.command()?, line.words()?);
    let mut numbers = numbers.to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.retain(|at| command == Command::Material || command.form().takes_curve(*at));
    let curves_there = |at: usize| curve(line, &words, at);
    if numbers.is_empty() || !(command.form().curves || command == Command::Material) {
        return None;
    }
    let has_key = |&at: &usize| curves_there(at).is_some_and(|curve| curve.key_at(frame).is_some());
    if numbers.iter().all(has_key) {
        let keys =
            numbers.iter().filter_map(|&at| curves_there(at)?.key_at(frame).map(|key| (at, key.frame)));
        return without(line, &keys.collect::<Vec<_>>());
    }
    // An omitted number has no place for a key. It is written with its default first.
    let values = crate::values::Values::of(line, frame)?;
    let mut line = line.clone();
    for at in numbers.iter().copied().filter(|&at| at >= words.parameters.len()) {
        let value = values.number(at)?;
        line = crate::values::changed(&line, at, &[value], crate::values::Keying::ALWAYS)?;
    }
    let words = line.words()?;
    let mut changes = Vec::new();
    for at in numbers {
        let keyed = match (curve(&line, &words, at), words.parameters.get(at).and_then(|w| line.number(w))) {
            (Some(curve), _) => curve.with_key(frame, curve.at(frame))?,
            (None, Some(value)) => Curve::through(Mode::Smooth, false, vec![Key { frame, value }])?,
            (None, None) => return None,
        };
        changes.push((at, keyed.to_string()));
    }
    line.with_words(&changes)
}

/// Returns the lines that change if some keys move by `by` frames. Keys at their new positions are replaced.
pub(crate) fn moved(lines: &[Line], keys: &[KeyPlace], by: f64, value: f64) -> Vec<(usize, Line)> {
    each(lines, keys, |curve, frames| {
        if by == 0.0 && value == 0.0 {
            return None;
        }
        let is_held = |key: &&Key| frames.contains(&key.frame);
        let held: Vec<_> = curve.keys().iter().filter(is_held).collect();
        let gone: Vec<_> = held
            .iter()
            .map(|key| Key {
                frame: key.frame + by,
                value: if value == 0.0 { key.value } else { tidy(key.value + value) },
            })
            .collect();
        let stay = curve.keys().iter().filter(|key| !is_held(key));
        let stay = stay.filter(|key| gone.iter().all(|moved| moved.frame != key.frame));
        let mut all: Vec<_> = stay.copied().chain(gone.iter().copied()).collect();
        all.sort_by(|a, b| a.frame.total_cmp(&b.frame));
        rewritten(curve, all)
    })
}

/// Returns the lines that change if some keys are removed.
pub(crate) fn removed(lines: &[Line], keys: &[KeyPlace]) -> Vec<(usize, Line)> {
    each(lines, keys, |curve, frames| {
        let stay = curve.keys().iter().filter(|key| !frames.contains(&key.frame));
        rewritten(curve, stay.copied().collect())
    })
}

/// Returns the lines that change if the tracks of some keys get another interpolation.
pub(crate) fn eased(lines: &[Line], keys: &[KeyPlace], mode: &str, cycle: bool) -> Vec<(usize, Line)> {
    let Some(mode) = mode_of(mode) else { return Vec::new() };
    each(lines, keys, |curve, _| {
        // A cycle needs two keys.
        let cycle = cycle && curve.keys().len() > 1;
        Curve::through(mode, cycle, curve.keys().to_vec()).map(|curve| curve.to_string())
    })
}

/// Returns the values of some keys.
pub(crate) fn copied(lines: &[Line], keys: &[KeyPlace]) -> Vec<Copied> {
    let one = |place: &KeyPlace| {
        let line = lines.get(place.line)?;
        let curve = curve(line, &line.words()?, place.number)?;
        let key = curve.keys().iter().find(|key| key.frame == place.frame)?;
        Some(Copied { command: line.command()?, place: *place, value: key.value, mode: curve.mode() })
    };
    keys.iter().filter_map(one).collect()
}

/// Returns copied keys as text: for each number a line such as `Sphere cx (smooth 1:0 9:3)   # number 2 of line 5`.
pub(crate) fn text_of_keys(lines: &[Line], copied: &[Copied]) -> String {
    let mut by_track: BTreeMap<(usize, usize), Vec<&Copied>> = BTreeMap::new();
    for copied in copied {
        by_track.entry((copied.place.line, copied.place.number)).or_default().push(copied);
    }
    let text = |((at, number), keys): ((usize, usize), Vec<&Copied>)| {
        let name = slots(lines.get(at)?).into_iter().find(|slot| slot.number == number)?.name;
        let (command, mode) = keys.first().map(|copied| (copied.command, copied.mode))?;
        let mut keys: Vec<_> =
            keys.iter().map(|copied| Key { frame: copied.place.frame, value: copied.value }).collect();
        keys.sort_by(|a, b| a.frame.total_cmp(&b.frame));
        let curve = Curve::through(mode, false, keys)?;
        Some(format!("{} {name} {curve}   # number {} of line {}\n", command.name(), number + 1, at + 1))
    };
    by_track.into_iter().filter_map(text).collect()
}

/// Returns the keys of a text that [`text_of_keys`] returned, or `None` for another text.
pub(crate) fn keys_of_text(text: &str) -> Option<Vec<Copied>> {
    let mut keys = Vec::new();
    for line in text.lines().filter(|line| !line.trim().is_empty()) {
        let (track, place) = line.split_once('#')?;
        let ["number", number, "of", "line", line] = place.split_whitespace().collect::<Vec<_>>()[..] else {
            return None;
        };
        let from_1 = |word: &str| word.parse::<usize>().ok()?.checked_sub(1);
        let (number, line) = (from_1(number)?, from_1(line)?);
        let command = Line::new(track).command()?;
        let curve = parse_curve(track.get(track.find('(')?..)?.trim())?;
        let mode = curve.mode();
        keys.extend(curve.keys().iter().map(|key| {
            let place = KeyPlace { line, number, frame: key.frame };
            Copied { command, place, value: key.value, mode }
        }));
    }
    (!keys.is_empty()).then_some(keys)
}

/// Returns the lines that change if copied keys are pasted, the first of them at a frame. They go to their original
/// tracks, or to those of another line of the same command, `onto`. A key whose line has another command now is left
/// out.
pub(crate) fn pasted(
    lines: &[Line],
    copied: &[Copied],
    frame: f64,
    onto: Option<usize>,
) -> Vec<(usize, Line)> {
    let first = copied.iter().map(|copied| copied.place.frame).fold(f64::INFINITY, f64::min);
    let source = copied.first().map(|copied| (copied.place.line, copied.command));
    let is_one = copied.iter().all(|copied| source.is_some_and(|(line, _)| copied.place.line == line));
    let command = |at: usize| lines.get(at).and_then(Line::command);
    let onto = onto.filter(|&onto| is_one && source.is_some_and(|(_, of)| Some(of) == command(onto)));
    let mut by_track: BTreeMap<(usize, usize), Vec<Copied>> = BTreeMap::new();
    for copied in copied {
        let line = onto.unwrap_or(copied.place.line);
        if command(line) != Some(copied.command) {
            continue;
        }
        by_track.entry((line, copied.place.number)).or_default().push(*copied);
    }
    let mut changed: BTreeMap<usize, Line> = BTreeMap::new();
    for ((at, number), mut keys) in by_track {
        keys.sort_by(|a, b| a.place.frame.total_cmp(&b.place.frame));
        let Some(line) = changed.get(&at).or(lines.get(at)).cloned() else { continue };
        let Some(words) = line.words() else { continue };
        let to =
            keys.iter().map(|copied| Key { frame: copied.place.frame - first + frame, value: copied.value });
        let curve = curve(&line, &words, number).map_or_else(
            || {
                let still = words.parameters.get(number).and_then(|word| line.number(word));
                let mode = keys.first().map_or(Mode::Smooth, |copied| copied.mode);
                still.and_then(|_| Curve::through(mode, false, to.clone().collect()))
            },
            |curve| to.clone().try_fold(curve, |curve, key| curve.with_key(key.frame, key.value)),
        );
        if let Some(line) = curve.and_then(|curve| line.with_words(&[(number, curve.to_string())])) {
            changed.insert(at, line);
        }
    }
    changed.into_iter().collect()
}

/// Returns a line without some keys, each given as a parameter and a frame.
fn without(line: &Line, keys: &[(usize, f64)]) -> Option<Line> {
    let place = |&(number, frame): &(usize, f64)| KeyPlace { line: 0, number, frame };
    let keys: Vec<_> = keys.iter().map(place).collect();
    removed(std::slice::from_ref(line), &keys).into_iter().next().map(|(_, line)| line)
}

/// Returns the lines with the result of `change` for the curves of some keys, given the frames of these
/// keys in any order.
fn each(
    lines: &[Line],
    keys: &[KeyPlace],
    change: impl Fn(&Curve, &[f64]) -> Option<String>,
) -> Vec<(usize, Line)> {
    let mut by_line: BTreeMap<usize, BTreeMap<usize, Vec<f64>>> = BTreeMap::new();
    for key in keys {
        by_line.entry(key.line).or_default().entry(key.number).or_default().push(key.frame);
    }
    let one = |at: usize, tracks: &BTreeMap<usize, Vec<f64>>| {
        let line = lines.get(at)?;
        let words = line.words()?;
        let changes: Vec<_> = tracks
            .iter()
            .filter_map(|(&number, frames)| {
                let curve = curve(line, &words, number)?;
                Some((number, change(&curve, frames)?))
            })
            .collect();
        (!changes.is_empty()).then(|| line.with_words(&changes)).flatten()
    };
    by_line.iter().filter_map(|(&at, tracks)| Some((at, one(at, tracks)?))).collect()
}

/// Returns the text of a curve with other keys: a number if one is left or none. Returns `None` if nothing changes.
fn rewritten(curve: &Curve, keys: Vec<Key>) -> Option<String> {
    if keys == curve.keys() {
        return None;
    }
    match keys[..] {
        [] => Some(written(curve.keys()[0].value)),
        [key] if curve.keys().len() > 1 => Some(written(key.value)),
        [_] => Curve::through(curve.mode(), false, keys).map(|curve| curve.to_string()),
        _ => Curve::through(curve.mode(), curve.is_cycle(), keys).map(|curve| curve.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<Line> {
        Line::split(text.as_bytes())
    }

    fn key(line: usize, number: usize, frame: f64) -> KeyPlace {
        KeyPlace { line, number, frame }
    }

    fn one(changed: Vec<(usize, Line)>) -> String {
        assert_eq!(changed.len(), 1);
        changed[0].1.text()
    }

    const TEXT: &str = "Sphere 1  (1:0 9:2) 0 (smooth cycle 1:0 5:1 9:0)  red # ball\n\
                        Material red  shine (1:1 3:2) 1 1 8  checker (step 1:1 2:3) blue diffuse 1 0 (1:0 9:1)\n\
                        Sphere 1  0 0 0  red\nUse tie";

    #[test]
    fn tracks_are_told_by_what_they_are() {
        let found = tracks(&lines(TEXT));
        let labels: Vec<_> = found
            .tracks
            .iter()
            .map(|t| (t.line, t.number, t.label.as_str(), t.mode.as_str(), t.cycle))
            .collect();
        assert_eq!(
            labels,
            [
                (0, 1, "centre: cx", "linear", false),
                (0, 3, "centre: cz", "smooth", true),
                (1, 1, "shine: r", "linear", false),
                (1, 6, "size s", "step", false),
                (1, 11, "diffuse coefficient: rb", "linear", false),
            ]
        );
        assert_eq!(found.tracks[0].keys, [(1.0, 0.0), (9.0, 2.0)]);
        let many = lines(&"Sphere (1:1 2:2) (1:1 2:2) (1:1 2:2) (1:1 2:2) red\n".repeat(100));
        assert!(tracks(&many).more && tracks(&many).tracks.len() == TRACKS);
    }

    #[test]
    fn keys_move_and_go_and_one_that_is_left_is_a_number() {
        let lines = lines(TEXT);
        let x = |keys: &[KeyPlace], by| one(moved(&lines, keys, by, 0.0));
        assert_eq!(x(&[key(0, 1, 9.0)], 3.0), TEXT.lines().next().unwrap().replace("9:2", "12:2"));
        assert_eq!(
            x(&[key(0, 1, 9.0), key(0, 3, 5.0)], -1.0),
            "Sphere 1  (1:0 8:2) 0 (smooth cycle 1:0 4:1 9:0)  red # ball"
        );
        assert_eq!(x(&[key(0, 3, 5.0)], 4.0), "Sphere 1  (1:0 9:2) 0 (smooth cycle 1:0 9:1)  red # ball");
        assert_eq!(x(&[key(0, 1, 9.0)], -8.0), "Sphere 1  2 0 (smooth cycle 1:0 5:1 9:0)  red # ball");
        assert!(moved(&lines, &[key(0, 1, 9.0)], 0.0, 0.0).is_empty());
        assert!(moved(&lines, &[key(0, 2, 9.0), key(9, 1, 1.0), key(2, 9, 1.0)], 1.0, 0.0).is_empty());
        let gone = one(removed(&lines, &[key(0, 1, 1.0)]));
        assert_eq!(gone, "Sphere 1  2 0 (smooth cycle 1:0 5:1 9:0)  red # ball");
        let gone = one(removed(&lines, &[key(0, 1, 1.0), key(0, 1, 9.0)]));
        assert_eq!(gone, "Sphere 1  0 0 (smooth cycle 1:0 5:1 9:0)  red # ball");
    }

    #[test]
    fn easing_is_that_of_the_track() {
        let lines = lines(TEXT);
        let keys = [key(0, 1, 1.0), key(0, 1, 9.0)];
        let with = |mode| one(eased(&lines, &keys, mode, true));
        assert_eq!(with("step"), "Sphere 1  (step cycle 1:0 9:2) 0 (smooth cycle 1:0 5:1 9:0)  red # ball");
        assert_eq!(
            with("bezier .5 -1 1 2"),
            "Sphere 1  (bezier 0.5 -1 1 2 cycle 1:0 9:2) 0 (smooth cycle 1:0 5:1 9:0)  red # ball"
        );
        for wrong in ["no", "bezier 1", "bezier 2 0 0 0", "bezier 0 0 0 x", "smooth) (step", "cycle 1:0"] {
            assert_eq!(eased(&lines, &keys, wrong, false), [], "{wrong}");
        }
    }

    #[test]
    fn paths_go_through_their_keys_as_the_curve_does() {
        let of = |curve: &str| path(&parse_curve(curve).unwrap(), true);
        assert_eq!(of("(1:0 4:3 7:3)"), "M1e0 0e0L4e0 3e0L7e0 3e0");
        assert_eq!(of("(step 1:0 4:3)"), "M1e0 0e0H4e0V3e0");
        assert_eq!(of("(bezier .25 .1 .5 2 1:0 5:10)"), "M1e0 0e0C2e0 1e0 3e0 2e1 5e0 1e1");
        // The slope at the middle key is the harmonic mean of 2 and 1, 4/3.
        let smooth = "M1e0 0e0C2e0 0e0 3e0 4.666666667e0 4e0 6e0C5e0 7.333333333e0 6e0 9e0 7e0 9e0";
        assert_eq!(of("(smooth 1:0 4:6 7:9)"), smooth);
        for mode in ["in", "out", "inout", "back", "elastic", "bounce cycle"] {
            let curve = parse_curve(&format!("({mode} 3:-1 11:4)")).unwrap();
            let path = of(&curve.to_string());
            let points: Vec<(f64, f64)> = path[1..]
                .split('L')
                .map(|point| {
                    point.split_once(' ').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).unwrap()
                })
                .collect();
            assert_eq!((points.len(), points[0], points[32]), (33, (3.0, -1.0), (11.0, 4.0)), "{mode}");
            for &(frame, value) in &points[..32] {
                assert!((curve.at(frame) - value).abs() < 1e-6, "{mode} at {frame}: {value}");
            }
        }
        assert_eq!(path(&parse_curve("(bounce 1:0 4:3)").unwrap(), false), "M1e0 0e0L4e0 3e0");
    }

    #[test]
    fn keys_are_copied_to_another_time_and_another_line() {
        let lines = lines(TEXT);
        let held = copied(&lines, &[key(0, 1, 9.0), key(0, 3, 5.0)]);
        assert_eq!(held.len(), 2);
        assert_eq!(
            one(pasted(&lines, &held, 20.0, None)),
            "Sphere 1  (1:0 9:2 24:2) 0 (smooth cycle 1:0 4:1 5:1 9:0)  red # ball",
            "in a cycle 20 is 4"
        );
        assert_eq!(one(pasted(&lines, &held, 2.0, Some(2))), "Sphere 1  (6:2) 0 (smooth 2:1)  red");
        let backwards = copied(&lines, &[key(0, 1, 9.0), key(0, 1, 1.0)]);
        assert_eq!(one(pasted(&lines, &backwards, 2.0, Some(2))), "Sphere 1  (2:0 10:2) 0 0  red");
        let elsewhere = pasted(&lines, &held, 20.0, Some(1));
        assert_eq!(elsewhere[0].0, 0, "another command has other numbers");
    }

    #[test]
    fn copied_keys_are_text_and_the_text_is_the_keys() {
        let lines = lines(TEXT);
        let held = copied(&lines, &[key(0, 1, 9.0), key(0, 1, 1.0), key(0, 3, 5.0)]);
        let text = text_of_keys(&lines, &held);
        assert_eq!(
            text,
            "Sphere cx (1:0 9:2)   # number 2 of line 1\nSphere cz (smooth 5:1)   # number 4 of line 1\n"
        );
        let read = keys_of_text(&text).unwrap();
        assert_eq!(pasted(&lines, &read, 2.0, Some(2)), pasted(&lines, &held, 2.0, Some(2)));
        assert_eq!(pasted(&lines[1..], &read, 2.0, None), [], "that line is no sphere in another script");
        for other in
            ["", "Sphere 1 0 0 0 red # ball", "Sphere cx (1:0) # number 0 of line 1", "# number 1 of line 1"]
        {
            assert_eq!(keys_of_text(other), None, "{other}");
        }
    }

    #[test]
    fn a_key_by_button_comes_and_goes() {
        let ball = Line::new("Sphere 1  0 0 0  red");
        let numbers = main_numbers(&ball);
        assert_eq!(numbers, [1, 2, 3]);
        let keyed = toggled(&ball, &numbers, 1.0).unwrap();
        assert_eq!(keyed.text(), "Sphere 1  (smooth 1:0) (smooth 1:0) (smooth 1:0)  red");
        assert_eq!(toggled(&keyed, &numbers, 1.0).unwrap().text(), ball.text());
        let again = toggled(&keyed, &[1], 9.0).unwrap();
        assert_eq!(again.text(), "Sphere 1  (smooth 1:0 9:0) (smooth 1:0) (smooth 1:0)  red");
        let used = Line::new("Use tie");
        assert_eq!(main_numbers(&used), [0, 1, 2, 3, 4, 5]);
        assert_eq!(
            toggled(&ball, &[2, 1, 2], 1.0).unwrap().text(),
            "Sphere 1  (smooth 1:0) (smooth 1:0) 0  red"
        );
        let keyed = toggled(&used, &[0], 3.0).unwrap();
        assert_eq!(keyed.text(), "Use tie (smooth 3:0) 0 0");
        assert!(main_numbers(&Line::new("Screen 4 3")).is_empty());
        assert_eq!(main_numbers(&Line::new("Ilight 1 1 1 0 -1 0")), [3, 4, 5]);
    }
}
