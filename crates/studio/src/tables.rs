//! The commands of the language for the page, from the parser's tables. A new command appears in the palette and in
//! the inspector without further code.

use rayfold_scene::{Command, Field, Kind, Parameter, Presence, Values};
use serde::Serialize;

/// The role of a command on the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Role {
    /// The command adds a visible object.
    Object,
    /// The command adds a light.
    Light,
    /// The command draws a group.
    Use,
    /// The command begins a group.
    Group,
    /// The command defines a material.
    Material,
    /// The command sets the camera.
    Camera,
    /// The command has any other role.
    Setting,
}

/// The table of a command.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CommandTable {
    /// The name in scripts.
    pub(crate) name: &'static str,
    /// The role on the page.
    pub(crate) role: Role,
    /// The parameters of the command.
    pub(crate) fields: Vec<FieldTable>,
}

/// The table of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct FieldTable {
    /// The name of the parameter, such as `radius`.
    pub(crate) label: String,
    /// The names of its numbers.
    pub(crate) names: &'static [&'static str],
    /// The measured quantity, such as `length`.
    pub(crate) kind: String,
    /// The unit, such as `world units`.
    pub(crate) unit: String,
    /// The allowed values, such as `greater than 0`.
    pub(crate) values: String,
    /// The least value, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) minimum: Option<f64>,
    /// Whether the least value itself is excluded.
    #[serde(rename = "aboveMinimum")]
    pub(crate) above_minimum: bool,
    /// The greatest value, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) maximum: Option<f64>,
    /// Whether only whole numbers are allowed.
    pub(crate) whole: bool,
    /// The words that it can be, if it is no number.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[cfg_attr(test, ts(as = "Option<_>", optional))]
    pub(crate) words: Vec<String>,
    /// Whether the parameter is optional.
    pub(crate) optional: bool,
    /// The position of its first number among those of the command.
    pub(crate) first: usize,
    /// Whether it is never a curve, in a command whose other parameters may be.
    pub(crate) fixed: bool,
}

/// Returns all commands, in the order of the documentation.
pub(crate) fn commands() -> Vec<CommandTable> {
    Command::ALL
        .iter()
        .map(|&command| CommandTable {
            name: title(command),
            role: role(command),
            fields: command_fields(command),
        })
        .collect()
}

/// Returns the tables of a command's parameters.
pub(crate) fn command_fields(command: Command) -> Vec<FieldTable> {
    let form = command.form();
    let table = |(first, field)| FieldTable {
        fixed: form.curves && !form.takes_curve(first),
        ..FieldTable::new(first, field)
    };
    fields(command).map(table).collect()
}

/// Returns the name of a command on the page. For one of the two commands named `Sky` it includes the word that the
/// command takes.
pub(crate) fn title(command: Command) -> &'static str {
    match command {
        Command::SkyPicture => "Sky \"FILE\"",
        _ => command.name(),
    }
}

/// Returns the role of a command, which follows from its parameters.
pub(crate) fn role(command: Command) -> Role {
    let has = |parameter| command.form().fields.iter().any(|field| field.parameter == parameter);
    if command == Command::Use {
        Role::Use
    } else if command == Command::Group {
        Role::Group
    } else if command == Command::Material {
        Role::Material
    } else if has(Parameter::Diffuse) {
        Role::Object
    } else if has(Parameter::LightColor) {
        Role::Light
    } else if has(Parameter::Eye) || command == Command::Orthocamera {
        Role::Camera
    } else {
        Role::Setting
    }
}

/// Returns the parameters of a command, each with the position of its first number.
pub(crate) fn fields(command: Command) -> impl Iterator<Item = (usize, &'static Field)> {
    command.form().fields.iter().scan(0, |next, field| {
        let first = *next;
        *next += field.names.len();
        Some((first, field))
    })
}

/// Returns the positions of the first numbers of a kind's parameters.
pub(crate) fn of_kind(command: Command, kind: Kind) -> impl Iterator<Item = usize> {
    fields(command).filter(move |(_, field)| field.kind == kind).map(|(first, _)| first)
}

impl FieldTable {
    /// Makes the table of a parameter whose first number is `first`.
    pub(crate) fn new(first: usize, field: &Field) -> Self {
        let label = field.parameter.to_string();
        let (minimum, above_minimum, maximum, whole) = match field.values {
            Values::Any | Values::Clamped | Values::NotZero | Values::OneOf(_) => (None, false, None, false),
            Values::Positive => (Some(0.0), true, None, false),
            Values::NotNegative => (Some(0.0), false, None, false),
            Values::AtLeastOne => (Some(1.0), false, None, false),
            Values::Share => (Some(0.0), false, Some(1.0), false),
            Values::HalfTurn => (Some(0.0), false, Some(180.0), false),
            Values::FieldOfView => (Some(0.0), true, Some(180.0), false),
            Values::Whole(least, most) => (Some(least.into()), false, Some(most.into()), true),
        };
        Self {
            label: label.strip_prefix("the ").or(label.strip_prefix("a ")).unwrap_or(&label).to_owned(),
            names: field.names,
            kind: field.kind.to_string(),
            unit: field.kind.unit().to_string(),
            values: field.values.to_string(),
            minimum,
            above_minimum,
            maximum,
            whole,
            words: match field.values {
                Values::OneOf(words) => words.iter().map(|&word| word.to_owned()).collect(),
                _ => Vec::new(),
            },
            optional: field.presence != Presence::Required,
            first,
            fixed: false,
        }
    }

    /// Makes the table of a name, which is one of these.
    pub(crate) fn of_names(label: &str, first: usize, names: Vec<String>) -> Self {
        Self {
            label: label.to_owned(),
            names: &["name"],
            kind: "name".to_owned(),
            unit: String::new(),
            values: String::new(),
            minimum: None,
            above_minimum: false,
            maximum: None,
            whole: false,
            words: names,
            optional: false,
            first,
            fixed: false,
        }
    }
}

/// Returns the command with this name on the page.
pub(crate) fn by_title(name: &str) -> Option<Command> {
    let (name, word) = name.split_once(' ').map_or((name, None), |(name, word)| (name, Some(word)));
    Some(Command::from_name(name)?.with_first_word(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_its_role_and_its_numbers() {
        let named = |name: &str| role(Command::from_name(name).unwrap());
        assert_eq!(["Sphere", "Box", "Triangle"].map(named), [Role::Object; 3]);
        assert_eq!(named("Ilight"), Role::Light);
        assert_eq!(["Use", "Group", "Material"].map(named), [Role::Use, Role::Group, Role::Material]);
        assert_eq!(["Camera", "Orthocamera"].map(named), [Role::Camera; 2]);
        assert_eq!(["Screen", "Background", "Clear", "Trace"].map(named), [Role::Setting; 4]);
        for table in commands() {
            let names: Vec<_> = table.fields.iter().flat_map(|field| field.names).collect();
            let all: Vec<_> = by_title(table.name).unwrap().form().numbers().map(|(n, _)| n).collect();
            assert!(names.into_iter().eq(all.iter()), "{}", table.name);
        }
    }
}
