//! The table of the language: every command, clause and mode, with the meaning, unit and range of each number.
//!
//! This is the parser's table as data for editors. `rayfold check --format json` prints it, and a test compares
//! `docs/language.md` with it. Knows no text.
//!
//! ```
//! let table = rayfold_scene::language();
//! let sphere = table.commands.iter().find(|command| command.name == "Sphere").unwrap();
//! assert_eq!(sphere.usage, "Sphere R cx cy cz ar ag ab rr rg rb [sr sg sb]");
//! assert_eq!(sphere.parameters[0].range, "at least 0");
//! ```

use serde::Serialize;

use crate::command::Command;
use crate::curve::{CYCLE, Mode};
use crate::form::{Field, Form, Kind, Names, Presence, Quotes, Subject, Values};
use crate::model::Clause;

/// The version of the language.
const VERSION: u32 = 2;

/// The table of the whole language.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Language {
    /// The version of the language.
    pub version: u32,
    /// The commands in the order of the documentation.
    pub commands: Vec<CommandEntry>,
    /// The clauses of a `Material`.
    pub clauses: Vec<CommandEntry>,
    /// The words with which a curve may start.
    pub curve_modes: Vec<ModeEntry>,
}

/// A command, or a clause of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommandEntry {
    /// The name in the letter case of the documentation. Any case is accepted.
    pub name: &'static str,
    /// The syntax, such as `Sphere R cx cy cz …`.
    pub usage: String,
    /// A one-line summary.
    pub about: &'static str,
    /// The name before the numbers: its role (`defines`, `refers` or `quotes`) and its kind (`material`, `group`,
    /// `file` or `words`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subject: Option<SubjectEntry>,
    /// The numbers, parameter by parameter.
    pub parameters: Vec<ParameterEntry>,
    /// The constraints on several numbers, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub together: Vec<String>,
    /// Whether the numbers may be curves.
    pub curves: bool,
    /// The first number that the name of a material may replace, together with all that follow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material_instead_from: Option<&'static str>,
    /// A word that may stand in place of all numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub word_instead: Option<&'static str>,
    /// The kind of the name after the numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ends_with: Option<&'static str>,
}

/// A name before the numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SubjectEntry {
    /// The role, `defines`, `refers` or `quotes`: a word in quotes.
    pub role: &'static str,
    /// The kind, `material`, `group`, `file` or `words`.
    pub of: &'static str,
}

/// A parameter: a number or the components of a vector.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterEntry {
    /// The names of its numbers.
    pub names: &'static [&'static str],
    /// The meaning of the parameter.
    pub meaning: String,
    /// The measured quantity.
    pub kind: String,
    /// The unit of the numbers.
    pub unit: String,
    /// The allowed values, in words.
    pub range: String,
    /// The least value, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minimum: Option<f64>,
    /// Whether the least value itself is excluded.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub above_minimum: bool,
    /// The greatest value, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub maximum: Option<f64>,
    /// Whether the greatest value itself is excluded.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub below_maximum: bool,
    /// Whether only whole numbers are allowed.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub whole: bool,
    /// The allowed words, for a parameter that is no number.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub words: &'static [&'static str],
    /// The presence: `required`, `optional` (whole or not at all) or `from the end` (number by number).
    pub presence: &'static str,
    /// The default of an omitted parameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<&'static str>,
    /// Whether the parameter is never a curve, in a command whose other parameters may be.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub fixed: bool,
}

/// A word with which a curve may start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeEntry {
    /// The name in the letter case of the documentation. Any case is accepted.
    pub name: &'static str,
    /// A one-line summary.
    pub about: &'static str,
}

/// Returns the table of the whole language.
pub fn language() -> Language {
    let modes = Mode::ALL.iter().map(|mode| ModeEntry { name: mode.name(), about: mode.summary() });
    let cycle = ModeEntry {
        name: CYCLE,
        about: "The curve restarts at its last key; can be combined with another mode.",
    };
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
        Subject::Quotes(Quotes::File) => SubjectEntry { role: "quotes", of: "file" },
        Subject::Quotes(Quotes::Words) => SubjectEntry { role: "quotes", of: "words" },
    });
    CommandEntry {
        name: form.name,
        usage: form.to_string(),
        about,
        subject,
        parameters: form
            .parameters()
            .scan(0, |next, field| {
                let first = *next;
                *next += if field.kind == Kind::Word { 0 } else { field.names.len() };
                Some(parameter(form, field, first))
            })
            .collect(),
        together: form.constraints.iter().map(|constraint| constraint.describe(form)).collect(),
        curves: form.curves && !form.fields.is_empty(),
        material_instead_from: form.surface().map(|i| form.number(i).0),
        word_instead: form.word,
        ends_with: form.ends_with.map(Names::noun),
    }
}

/// Returns the entry of a parameter that comes after this many numbers.
fn parameter(form: &Form, field: &Field, first: usize) -> ParameterEntry {
    let presence = match field.presence {
        // Ambient and diffuse stand or are omitted together.
        Presence::Required if form.is_of_optional_surface(first) => "optional",
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
        default: field.presence.default().or_else(|| form.surface_default(field)),
        fixed: form.curves && (field.kind == Kind::Word || !form.takes_curve(first)),
    }
}
