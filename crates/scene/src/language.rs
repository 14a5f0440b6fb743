//! The table of the language: every command, clause and mode, with what each number is, counts by and may be.
//!
//! What the parser reads by, as data for editors: `rayfold check --format json` gives it out, and `docs/language.md` is
//! tested against it. Knows no text.
//!
//! ```
//! let table = rayfold_scene::language();
//! let sphere = table.commands.iter().find(|command| command.name == "Sphere").unwrap();
//! assert_eq!(sphere.usage, "Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]");
//! assert_eq!(sphere.parameters[0].range, "greater than 0");
//! ```

use serde::Serialize;

use crate::command::Command;
use crate::curve::{CYCLE, Mode};
use crate::form::{Field, Form, Names, Presence, Subject, Values};
use crate::model::Clause;

/// The version of the language.
const VERSION: u32 = 2;

/// The whole language.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Language {
    /// Its version.
    pub version: u32,
    /// In the order of the documentation.
    pub commands: Vec<CommandEntry>,
    /// What a `Material` can say.
    pub clauses: Vec<CommandEntry>,
    /// The words that a curve may start with.
    pub curve_modes: Vec<ModeEntry>,
}

/// A command, or a clause of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommandEntry {
    /// In the letter case of the documentation; any will do.
    pub name: &'static str,
    /// How it is written.
    pub usage: String,
    /// What it is for.
    pub about: &'static str,
    /// A name that stands before the numbers: what it does (`defines` or `refers`) and to what (`material` or `group`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subject: Option<SubjectEntry>,
    /// Its numbers, parameter by parameter.
    pub parameters: Vec<ParameterEntry>,
    /// What several of them must keep together, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub together: Vec<String>,
    /// Whether its numbers may be curves.
    pub curves: bool,
    /// The number in whose place, and that of all that follow, the name of a material may stand.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material_instead_from: Option<&'static str>,
    /// What a name behind the numbers is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ends_with: Option<&'static str>,
}

/// A name that stands before the numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubjectEntry {
    /// `defines` or `refers`.
    pub role: &'static str,
    /// `material` or `group`.
    pub of: &'static str,
}

/// A parameter: a number or the components of a vector.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterEntry {
    /// Of its numbers.
    pub names: &'static [&'static str],
    /// What it is.
    pub meaning: String,
    /// What it measures.
    pub kind: String,
    /// What it counts by.
    pub unit: String,
    /// Which values it may have, in words.
    pub range: String,
    /// The least value, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum: Option<f64>,
    /// Whether the least value itself is excluded.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub above_minimum: bool,
    /// The greatest value, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum: Option<f64>,
    /// Whether the greatest value itself is excluded.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub below_maximum: bool,
    /// Whether only whole numbers will do.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub whole: bool,
    /// The words that will do, for one that is no number.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub words: &'static [&'static str],
    /// `required`, `optional` (whole or not at all) or `from the end` (number by number).
    pub presence: &'static str,
    /// What holds where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<&'static str>,
}

/// A word that a curve may start with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeEntry {
    /// In the letter case of the documentation; any will do.
    pub name: &'static str,
    /// What it does.
    pub about: &'static str,
}

/// The whole language as data.
pub fn language() -> Language {
    let modes = Mode::ALL.iter().map(|mode| ModeEntry { name: mode.name(), about: mode.summary() });
    let cycle = ModeEntry { name: CYCLE, about: "It starts again at its last key; beside another mode." };
    Language {
        version: VERSION,
        commands: Command::ALL.iter().map(|c| entry(c.form(), c.summary())).collect(),
        clauses: Clause::ALL.iter().map(|c| entry(c.form(), c.summary())).collect(),
        curve_modes: modes.chain([cycle]).collect(),
    }
}

fn entry(form: &'static Form, about: &'static str) -> CommandEntry {
    let subject = form.subject.map(|subject| match subject {
        Subject::Defines(names) => SubjectEntry { role: "defines", of: names.noun() },
        Subject::Refers(names) => SubjectEntry { role: "refers", of: names.noun() },
    });
    CommandEntry {
        name: form.name,
        usage: form.to_string(),
        about,
        subject,
        parameters: form.fields.iter().map(parameter).collect(),
        together: form.constraints.iter().map(|constraint| constraint.describe(form)).collect(),
        curves: form.curves && !form.fields.is_empty(),
        material_instead_from: form.surface().map(|i| form.number(i).0),
        ends_with: form.ends_with.map(Names::noun),
    }
}

fn parameter(field: &'static Field) -> ParameterEntry {
    let presence = match field.presence {
        Presence::Required => "required",
        Presence::Optional(_) => "optional",
        Presence::FromTheEnd(_) => "from the end",
    };
    let (minimum, above_minimum, maximum, below_maximum) = match field.values {
        Values::Any | Values::Clamped | Values::NotZero | Values::OneOf(_) => (None, false, None, false),
        Values::Positive => (Some(0.0), true, None, false),
        Values::NotNegative => (Some(0.0), false, None, false),
        Values::AtLeastOne => (Some(1.0), false, None, false),
        Values::Share => (Some(0.0), false, Some(1.0), false),
        Values::HalfTurn => (Some(0.0), false, Some(180.0), true),
        Values::FieldOfView => (Some(0.0), true, Some(180.0), true),
        Values::Whole(least, most) => (Some(least.into()), false, Some(most.into()), false),
    };
    ParameterEntry {
        names: field.names,
        meaning: field.parameter.to_string(),
        kind: field.kind.to_string(),
        unit: field.kind.unit().to_string(),
        range: field.values.to_string(),
        minimum,
        above_minimum,
        maximum,
        below_maximum,
        whole: matches!(field.values, Values::Whole(..)),
        words: match field.values {
            Values::OneOf(words) => words,
            _ => &[],
        },
        presence,
        default: field.presence.default(),
    }
}
