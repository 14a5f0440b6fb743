//! Materials: the starter materials, assigning one to objects, and pictures of a small sphere of each,
//! drawn by the tracer.

use std::collections::HashSet;

use rayfold_scene::{Command, Limits, parse};

use crate::document::Splice;
use crate::edits::set;
use crate::error::Error;
use crate::line::Line;
use crate::output::frame_png;
use crate::tables::{Role, role};

/// A starter material: its name and the clauses of its `Material` line. The material that its pattern
/// names comes before it.
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
    plain("mirror", "diffuse 0.03 0.03 0.03   mirror 0.88 0.88 0.88   shine 1 1 1 400"),
    plain("glass", "glass 0.97 0.985 0.98 1.5   shine 1 1 1 400"),
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

/// The width and height of a sphere's picture in pixels.
pub(crate) const SIDE: u32 = 96;

/// The scene of a sphere. The names of its own materials cannot occur in a user's script.
const STUDIO: &str = "Samples 8 1.5\nLook 0 1.35 4.1  0 0.98 0  34\nBackground 0.9 0.9 0.88  0.5 0.6 0.72\n\
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
pub(crate) fn sphere(lines: &[Line], at: usize, frame: u32) -> Result<Option<Vec<u8>>, Error> {
    let Some(name) = lines.get(at).filter(|line| is_material(line)).and_then(Line::subject) else {
        return Ok(None);
    };
    let tone = lines.iter().filter(|line| line.command() == Some(Command::Tone)).take(1);
    let before = lines[..=at].iter().filter(|line| is_material(line)).chain(tone);
    let texts: Vec<String> = before.map(Line::text).collect();
    drawn(&texts.join("\n"), name, frame)
}

/// Renders a sphere of a starter material.
///
/// # Errors
/// Fails if the sphere cannot be rendered.
pub(crate) fn preset_sphere(name: &str) -> Result<Option<Vec<u8>>, Error> {
    let Some(preset) = PRESETS.iter().find(|preset| preset.name == name) else { return Ok(None) };
    let lines: Vec<String> = definitions(preset).iter().map(|(_, line)| line.text()).collect();
    drawn(&lines.join("\n"), name, 1)
}

fn drawn(materials: &str, name: &str, frame: u32) -> Result<Option<Vec<u8>>, Error> {
    let frame = frame.max(1);
    let text = format!(
        "Screen {SIDE} {SIDE}\n{STUDIO}{materials}\nSphere 1  0 1 0  {name}\nFrames {frame} {frame}\nTrace\n"
    );
    let limits = Limits { max_described: 0, ..Limits::default() };
    match parse("sphere", text.as_bytes(), &limits).script {
        Some(script) => frame_png(&script, 0),
        None => Ok(None),
    }
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
    let wears = |line: &Line| {
        line.command().is_some_and(|command| match role(command) {
            Role::Object | Role::Use | Role::Group | Role::Material => true,
            Role::Light | Role::Camera | Role::Setting => false,
        })
    };
    let at = lines.iter().position(wears).unwrap_or(lines.len());
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
            let text = "Screen 4 3\nSphere 1  0 0 -5  .1 .1 .1  1 1 1   # ball\nTrace\n";
            let lines = Line::split(text.as_bytes());
            let text = after(text, give_preset(&lines, &[1], name));
            let parsed = parse("a", text.as_bytes(), &Default::default());
            assert!(parsed.diagnostics.is_empty(), "{text}\n{:?}", parsed.diagnostics);
            assert!(text.contains(&format!("\nSphere 1  0 0 -5  {name}   # ball\n")), "{text}");
            let lines = Line::split(text.as_bytes());
            assert!(seen.insert(preset_sphere(name).unwrap().unwrap()), "{name} looks as another");
            let at = lines.iter().position(|line| line.subject() == Some(name)).unwrap();
            assert_eq!(sphere(&lines, at, 1).unwrap(), preset_sphere(name).unwrap());
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
        assert_ne!(sphere(&lines, 2, 1).unwrap().unwrap(), sphere(&lines, 2, 9).unwrap().unwrap());
        assert_eq!(sphere(&lines, 1, 1).unwrap(), None);
        assert_eq!(sphere(&lines, 99, 1).unwrap(), None);
    }
}
