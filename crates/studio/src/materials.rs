//! Materials: the starter materials, assigning one to objects, and pictures of a small sphere of each,
//! drawn by the tracer.

use std::collections::HashSet;

use rayfold_scene::assets::Library;
use rayfold_scene::{Clause, Command, Limits, Parameter, parse_with_files, quoted_word};

use crate::clauses::{clauses, initial};
use crate::document::Splice;
use crate::edits::set;
use crate::error::Error;
use crate::line::Line;
use crate::output::frame_png;
use crate::tables::{Role, role};
use crate::tracks::slots;

/// A starter material: its name and the clauses of its `Material` line. The material to which its pattern refers comes
/// before it.
struct Preset {
    name: &'static str,
    says: &'static str,
    other: Option<(&'static str, &'static str)>,
}

const fn plain(name: &'static str, says: &'static str) -> Preset {
    Preset { name, says, other: None }
}

const PRESETS: &[Preset] = &[
    plain("chalk", "ambient 0.12 0.12 0.11   diffuse 0.8 0.79 0.75"),
    plain("clay", "ambient 0.1 0.05 0.03   diffuse 0.68 0.35 0.22"),
    plain("leaf", "ambient 0.04 0.08 0.03   diffuse 0.27 0.55 0.2"),
    plain("ocean", "ambient 0.02 0.06 0.1   diffuse 0.12 0.4 0.7   mirror 0.06 0.06 0.08"),
    plain("ruby", "ambient 0.08 0 0.01   diffuse 0.6 0.02 0.05   mirror 0.12 0.08 0.08   shine 1 1 1 200"),
    plain(
        "plastic",
        "ambient 0.1 0.07 0.01   diffuse 0.85 0.6 0.1   mirror 0.05 0.05 0.05   shine 0.6 0.6 0.6 60",
    ),
    plain("gold", "diffuse 0.3 0.17 0.03   mirror 0.55 0.4 0.15   shine 1 0.8 0.4 120"),
    plain(
        "steel",
        "ambient 0.02 0.02 0.025   diffuse 0.16 0.17 0.19   mirror 0.5 0.5 0.52   shine 0.9 0.9 0.9 120",
    ),
    plain("brushed-steel", "mirror 0.64 0.65 0.68   rough 0.25"),
    plain("mirror", "diffuse 0.03 0.03 0.03   mirror 0.88 0.88 0.88   shine 1 1 1 400"),
    plain("satin", "ambient 0.08 0.01 0.02   diffuse 0.4 0.04 0.08   mirror 0.22 0.1 0.12   rough 0.4"),
    plain("plaster", "ambient 0.16 0.15 0.13   diffuse 0.8 0.75 0.66   mirror 0.04 0.04 0.04   rough 0.5"),
    plain("neon", "glow 1 0.35 0.6"),
    plain("glass", "glass 0.97 0.985 0.98 1.5   shine 1 1 1 400"),
    plain("frosted-glass", "glass 0.92 0.96 0.95 1.5   rough 0.2"),
    Preset {
        name: "checks",
        says: "ambient 0.08 0.08 0.07   diffuse 0.75 0.72 0.66   checker 0.4 checks-dark",
        other: Some(("checks-dark", "diffuse 0.06 0.07 0.09")),
    },
    Preset {
        name: "wood",
        says: "ambient 0.03 0.015 0.005   diffuse 0.5 0.28 0.12   noise 0.12 wood-grain",
        other: Some(("wood-grain", "diffuse 0.24 0.1 0.04")),
    },
];

/// The reason why there is no picture of a material.
const NO_PICTURE: &str = "There is no picture (.png, .jpg, .webp) beside the script.";

/// The width and height of a sphere's picture in pixels.
pub(crate) const SIDE: u32 = 96;

/// The scene of a sphere. The names of its own materials cannot occur in a user's script.
const STUDIO: &str = "Samples 32 1.5\nLook 0 1.35 4.1  0 0.98 0  34\nBackground 0.9 0.9 0.88  0.5 0.6 0.72\n\
                      Ilight 0.8 0.8 0.77  -0.6 -1 -0.7\nIlight 0.25 0.27 0.3  0.8 -0.4 -0.6\n\
                      Material studio-dark-tile ambient 0.3 0.3 0.3 diffuse 0.2 0.2 0.2\n\
                      Material studio-tile ambient 0.4 0.4 0.4 diffuse 0.3 0.3 0.3 checker 0.5 studio-dark-tile\n\
                      Plane 0 0 0  0 1 0  studio-tile\n";

/// Returns the names of the starter materials.
pub(crate) fn presets() -> Vec<&'static str> {
    PRESETS.iter().map(|preset| preset.name).collect()
}

/// Renders a sphere of the material that a line defines, as of a frame, as PNG. Returns `None` if the line
/// defines no valid material.
///
/// # Errors
/// Fails if the sphere cannot be rendered.
pub(crate) fn sphere(
    lines: &[Line],
    at: usize,
    frame: u32,
    library: &Library,
) -> Result<Option<Vec<u8>>, Error> {
    let Some(name) = lines.get(at).filter(|line| is_material(line)).and_then(Line::subject) else {
        return Ok(None);
    };
    let tone = lines.iter().filter(|line| line.command() == Some(Command::Tone)).take(1);
    let before = lines[..=at].iter().filter(|line| is_material(line)).chain(tone);
    let texts: Vec<String> = before.map(Line::text).collect();
    drawn(&texts.join("\n"), name, frame, library)
}

/// Renders a sphere of a starter material.
///
/// # Errors
/// Fails if the sphere cannot be rendered.
pub(crate) fn preset_sphere(name: &str) -> Result<Option<Vec<u8>>, Error> {
    let Some(preset) = PRESETS.iter().find(|preset| preset.name == name) else { return Ok(None) };
    let lines: Vec<String> = definitions(preset).iter().map(|(_, line)| line.text()).collect();
    drawn(&lines.join("\n"), name, 1, &Library::none())
}

fn drawn(materials: &str, name: &str, frame: u32, library: &Library) -> Result<Option<Vec<u8>>, Error> {
    let frame = frame.max(1);
    let text = format!(
        "Screen {SIDE} {SIDE}\n{STUDIO}{materials}\nSphere 1  0 1 0  {name}\nFrames {frame} {frame}\nTrace\n"
    );
    let limits = Limits { max_described: 0, ..Limits::default() };
    match parse_with_files("sphere", text.as_bytes(), &limits, library).script {
        Some(script) => frame_png(&script, 0),
        None => Ok(None),
    }
}

/// Returns the line for a new material: before all lines that could use it.
pub(crate) fn start(lines: &[Line]) -> usize {
    let wears = |line: &Line| {
        line.command().is_some_and(|command| match role(command) {
            Role::Object | Role::Use | Role::Group | Role::Material => true,
            Role::Light | Role::Camera | Role::Setting => line.command() == Some(Command::Trace),
        })
    };
    lines.iter().position(wears).unwrap_or(lines.len())
}

/// Returns a name that no material has.
fn free_name(lines: &[Line]) -> String {
    let is_free = |name: &String| !lines.iter().any(|line| is_material(line) && line.subject() == Some(name));
    (1..).map(|number| format!("material-{number}")).find(is_free).unwrap_or_default()
}

/// Makes a blank material and gives it to lines. Returns the changes, and its line.
pub(crate) fn new(lines: &[Line], which: &[usize]) -> (Vec<Splice>, usize) {
    let (name, at) = (free_name(lines), start(lines));
    let mut splices: Vec<_> =
        which.iter().filter_map(|&at| Some(set(at, dressed(lines.get(at)?, &name)?))).collect();
    splices.push(Splice { at, removed: 0, inserted: vec![blank(&name, "0.7 0.7 0.7")] });
    (splices, at)
}

fn blank(name: &str, diffuse: &str) -> Line {
    Line::new(&format!("{} {name}   diffuse {diffuse}", Command::Material.name()))
}

/// Returns the materials before a line that a pattern can name: those of coefficients alone.
pub(crate) fn plain_names(lines: &[Line], at: usize) -> Vec<String> {
    let is_plain = |line: &&Line| {
        clauses(line)
            .iter()
            .all(|(clause, _)| matches!(clause, Clause::Ambient | Clause::Diffuse | Clause::Mirror))
    };
    let before = lines.iter().take(at).filter(|line| is_material(line)).filter(is_plain);
    before.filter_map(|line| line.subject().map(str::to_owned)).collect()
}

/// Adds a clause to a material, or removes it. A pattern replaces another one, and gets a second material if there is
/// none that it could name. `pictures` are the pictures beside the script that can be put on a surface.
///
/// # Errors
/// Returns the reason why the last clause must stay.
pub(crate) fn toggle(
    lines: &[Line],
    at: usize,
    clause: Clause,
    pictures: &[String],
) -> Result<Vec<Splice>, &'static str> {
    let Some(line) = lines.get(at).filter(|line| is_material(line)) else { return Ok(Vec::new()) };
    let all = clauses(line);
    let has = all.iter().any(|(other, _)| *other == clause);
    if has && all.len() == 1 {
        return Err("A material needs one clause at least.");
    }
    let names_other = |clause: Clause| clause.form().ends_with.is_some();
    let is_pattern = |clause: Clause| names_other(clause) || clause == Clause::Image;
    let goes = |other: Clause| other == clause || !has && is_pattern(clause) && is_pattern(other);
    let Some(words) = line.words() else { return Ok(Vec::new()) };
    let kept = all
        .iter()
        .filter(|(other, _)| !goes(*other))
        .flat_map(|(_, span)| words.parameters[span.clone()].iter());
    let mut last = None;
    // A colour such as `#ff8000` is three parameters, of which the first is written.
    let mut texts: Vec<_> = kept
        .map(|word| if last.replace(word) == Some(word) { String::new() } else { line.word(word).to_owned() })
        .collect();
    let mut splices = Vec::new();
    if !has {
        let mut other = plain_names(lines, at).pop();
        if names_other(clause) && other.is_none() {
            let name = free_name(lines);
            splices.push(Splice { at, removed: 0, inserted: vec![blank(&name, "0.1 0.1 0.1")] });
            other = Some(name);
        }
        texts.push(clause.name().to_owned());
        if clause == Clause::Image {
            texts.push(quoted_word(pictures.first().ok_or(NO_PICTURE)?));
        }
        texts.extend(initial(clause.form()));
        texts.extend(other.filter(|_| names_other(clause)));
    }
    let from =
        all.iter().find(|(other, _)| goes(*other)).map_or(words.parameters.len(), |(_, span)| span.start);
    let words = texts.into_iter().enumerate().skip(from);
    let words: Vec<_> = words.filter(|(_, text)| !text.is_empty()).collect();
    let changed = line.cut(from).and_then(|line| line.with_words(&words));
    // The line itself first: a new line before it would move it.
    splices.splice(0..0, changed.map(|line| set(at, line)));
    Ok(splices)
}

/// Replaces the names of materials by their coefficients.
pub(crate) fn take(lines: &[Line], which: &[usize]) -> Vec<Splice> {
    let bare = |&at: &usize| {
        let line = lines.get(at)?;
        let (first, words) = (line.command()?.form().surface()?, line.words()?);
        let name = words.parameters.get(first).filter(|_| words.parameters.len() == first + 1)?;
        let name = line.word(name);
        let of = lines.iter().find(|line| is_material(line) && line.subject() == Some(name))?;
        let mut numbers = [0.0; 9];
        for slot in slots(of) {
            let group = match slot.field.parameter {
                Parameter::Ambient => 0,
                Parameter::Diffuse => 3,
                Parameter::Mirror => 6,
                _ => continue,
            };
            let words = of.words()?;
            numbers[group + slot.number - slot.first] = of.parameter(&words, slot.number).unwrap_or(0.5);
        }
        let count = if numbers[6..] == [0.0; 3] { 6 } else { 9 };
        Some(set(at, line.cut(first)?.with_numbers(first, &numbers[..count])?))
    };
    which.iter().filter_map(bare).collect()
}

/// Assigns a material of the script to lines after its definition.
pub(crate) fn give(lines: &[Line], which: &[usize], name: &str) -> Vec<Splice> {
    let defined = lines.iter().position(|line| is_material(line) && line.subject() == Some(name));
    let Some(defined) = defined else { return Vec::new() };
    which
        .iter()
        .filter(|&&at| at > defined)
        .filter_map(|&at| Some(set(at, dressed(lines.get(at)?, name)?)))
        .collect()
}

/// Assigns a starter material to lines. Inserts its definition before all lines that could use it, unless it exists.
pub(crate) fn give_preset(lines: &[Line], which: &[usize], name: &str) -> Vec<Splice> {
    let Some(preset) = PRESETS.iter().find(|preset| preset.name == name) else { return Vec::new() };
    let at = start(lines);
    let taken: HashSet<&str> =
        lines.iter().filter(|line| is_material(line)).filter_map(Line::subject).collect();
    let missing: Vec<Line> = definitions(preset)
        .into_iter()
        .filter(|(name, _)| !taken.contains(name))
        .map(|(_, line)| line)
        .collect();
    let mut splices: Vec<_> =
        which.iter().filter_map(|&at| Some(set(at, dressed(lines.get(at)?, name)?))).collect();
    let is_before = taken.contains(name)
        && lines.iter().position(|line| is_material(line) && line.subject() == Some(name))
            > which.iter().min().copied();
    if splices.is_empty() || is_before {
        return Vec::new();
    }
    if !missing.is_empty() {
        splices.push(Splice { at, removed: 0, inserted: missing });
    }
    splices
}

fn definitions(preset: &Preset) -> Vec<(&'static str, Line)> {
    let own = (preset.name, preset.says);
    let line = |(name, says): (&'static str, &str)| {
        (name, Line::new(&format!("{} {name}   {says}", Command::Material.name())))
    };
    preset.other.into_iter().chain([own]).map(line).collect()
}

/// Returns a line with the name of a material in place of coefficients.
fn dressed(line: &Line, name: &str) -> Option<Line> {
    let at = line.command()?.form().surface()?;
    if line.words()?.parameters.len() < at {
        return None;
    }
    let bare = line.cut(at)?;
    bare.with_words(&[(at, format!(" {name}"))])
}

fn is_material(line: &Line) -> bool {
    line.command() == Some(Command::Material)
}

#[cfg(test)]
mod tests {
    use rayfold_scene::assets::MemoryFiles;
    use rayfold_scene::parse;

    use super::*;
    use crate::document::Document;

    fn after(text: &str, splices: Vec<Splice>) -> String {
        let mut document = Document::new(text.as_bytes());
        for splice in splices {
            document.apply(splice, None);
        }
        String::from_utf8(document.bytes()).unwrap()
    }

    #[test]
    fn every_preset_is_in_order_and_has_a_sphere_of_its_own() {
        let mut seen = HashSet::new();
        for name in presets() {
            let text = "Screen 4 3\nSamples 2\nSphere 1  0 0 -5  .1 .1 .1  1 1 1   # ball\nIlight 1 1 1  0 -1 0\nTrace\n";
            let lines = Line::split(text.as_bytes());
            let text = after(text, give_preset(&lines, &[2], name));
            let parsed = parse("a", text.as_bytes(), &Default::default());
            assert!(parsed.diagnostics.is_empty(), "{text}\n{:?}", parsed.diagnostics);
            assert!(text.contains(&format!("\nSphere 1  0 0 -5  {name}   # ball\n")), "{text}");
            let lines = Line::split(text.as_bytes());
            assert!(seen.insert(preset_sphere(name).unwrap().unwrap()), "{name} looks as another");
            let at = lines.iter().position(|line| line.subject() == Some(name)).unwrap();
            assert_eq!(sphere(&lines, at, 1, &Library::none()).unwrap(), preset_sphere(name).unwrap());
            assert_eq!(give_preset(&lines, &[at], name), [], "a material has none");
        }
    }

    #[test]
    fn a_material_is_given_where_it_is_known() {
        let text = "Screen 4 3\nSphere 1  0 0 -5  1 1 1  1 1 1  1 1 1\nMaterial red diffuse 1 0 (1:0 9:1)\n\
                    Disc 1  0 0 0  0 1 0  blue # d\nTrace";
        let lines = Line::split(text.as_bytes());
        let given = after(text, give(&lines, &[1, 3, 4], "red"));
        assert_eq!(given, text.replace("blue", "red"));
        assert!(give(&lines, &[3], "green").is_empty());
        let none = Library::none();
        assert_ne!(
            sphere(&lines, 2, 1, &none).unwrap().unwrap(),
            sphere(&lines, 2, 9, &none).unwrap().unwrap()
        );
        assert_eq!(sphere(&lines, 1, 1, &none).unwrap(), None);
        assert_eq!(sphere(&lines, 99, 1, &none).unwrap(), None);
    }

    #[test]
    fn a_blank_material_gets_each_clause_and_loses_it_again() {
        let text = "Screen 4 3\nLook 0 0 9 0 0 0 40\nIlight 1 1 1 0 -1 -1\nSphere 1  0 0 0  0 0 0  1 1 1   # ball\nTrace\n";
        let lines = Line::split(text.as_bytes());
        let (splices, at) = new(&lines, &[3]);
        let blank = after(text, splices);
        assert!(blank.contains("\nSphere 1  0 0 0  material-1   # ball\n"), "{blank}");
        let pictures = ["a b.png".to_owned()];
        let files = MemoryFiles::from([("a b.png", include_bytes!("../../scene/tests/pixel.png").to_vec())]);
        let library = Library::new(files);
        let parse = |text: &str| parse_with_files("a", text.as_bytes(), &Limits::default(), &library);
        let toggled = |text: &str, at: usize, clause| {
            toggle(&Line::split(text.as_bytes()), at, clause, &pictures).map(|splices| after(text, splices))
        };
        for &clause in Clause::ALL {
            let Ok(on) = toggled(&blank, at, clause) else {
                assert_eq!(clause, Clause::Diffuse, "the only clause stays");
                continue;
            };
            let parsed = parse(&on);
            // A ball has no colours of a file, and there is one ray per pixel.
            let is_meant = |d: &rayfold_scene::Diagnostic| {
                matches!(d.code, rayfold_scene::Code::NoEffect | rayfold_scene::Code::NeedsSamples)
            };
            assert!(parsed.diagnostics.iter().all(is_meant), "{on}\n{:?}", parsed.diagnostics);
            let at = on.lines().position(|line| line.contains(clause.name())).unwrap();
            let off = toggled(&on, at, clause).unwrap();
            assert!(off.contains("Material material-1   diffuse 0.7 0.7 0.7\n"), "{off}");
            for &other in Clause::ALL.iter().filter(|&&other| other != clause && other != Clause::Diffuse) {
                let both = toggled(&on, at, other).unwrap();
                assert!(parse(&both).script.is_some(), "{both}");
            }
        }
    }

    #[test]
    fn a_line_takes_the_colours_of_its_material() {
        let text = "Material red shine 1 1 1 9 diffuse 1 0 0 ambient .1 .2 .3\nSphere 1  0 0 0  red   # a\n";
        let lines = Line::split(text.as_bytes());
        let taken = after(text, take(&lines, &[0, 1, 9]));
        assert!(taken.ends_with("\nSphere 1  0 0 0 0.1 0.2 0.3 1 0 0   # a\n"), "{taken}");
    }
}
