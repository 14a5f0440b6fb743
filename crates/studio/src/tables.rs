//! The commands of the language for the page, from the parser's own tables: a command that is added there appears in the
//! palette and in the inspector without a form of its own.

use rayfold_scene::{Command, Field, Kind, Parameter, Presence};
use serde::Serialize;

/// What a command is to the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Role {
    /// It can be seen.
    Object,
    /// It lights what can be seen.
    Light,
    /// It draws a group.
    Use,
    /// It begins a group.
    Group,
    /// It says how surfaces answer light.
    Material,
    /// It is what is looked through.
    Camera,
    /// All else.
    Setting,
}

/// A command.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct CommandTable {
    /// As scripts write it.
    pub(crate) name: &'static str,
    /// What it is to the page.
    pub(crate) role: Role,
    /// Its parameters.
    pub(crate) fields: Vec<FieldTable>,
}

/// A parameter of a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct FieldTable {
    /// What it is, such as `radius`.
    pub(crate) label: String,
    /// The names of its numbers.
    pub(crate) names: &'static [&'static str],
    /// What they measure, such as `length`.
    pub(crate) kind: String,
    /// What they count by, such as `world units`.
    pub(crate) unit: String,
    /// Which values they may have, such as `greater than 0`.
    pub(crate) values: String,
    /// Whether it may be left out.
    pub(crate) optional: bool,
    /// The position of its first number among those of the command.
    pub(crate) first: usize,
}

/// All commands, in the order of the documentation.
pub(crate) fn commands() -> Vec<CommandTable> {
    Command::ALL
        .iter()
        .map(|&command| CommandTable {
            name: command.name(),
            role: role(command),
            fields: fields(command).map(|(first, field)| FieldTable::new(first, field)).collect(),
        })
        .collect()
}

/// What a command is to the page; its parameters tell.
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

/// The parameters of a command, each with the position of its first number.
pub(crate) fn fields(command: Command) -> impl Iterator<Item = (usize, &'static Field)> {
    command.form().fields.iter().scan(0, |next, field| {
        let first = *next;
        *next += field.names.len();
        Some((first, field))
    })
}

/// Where the triples of a kind begin among the numbers of a command.
pub(crate) fn of_kind(command: Command, kind: Kind) -> impl Iterator<Item = usize> {
    fields(command).filter(move |(_, field)| field.kind == kind).map(|(first, _)| first)
}

impl FieldTable {
    /// Of a parameter whose first number is `first`.
    pub(crate) fn new(first: usize, field: &Field) -> Self {
        let label = field.parameter.to_string();
        Self {
            label: label.strip_prefix("the ").or(label.strip_prefix("a ")).unwrap_or(&label).to_owned(),
            names: field.names,
            kind: field.kind.to_string(),
            unit: field.kind.unit().to_string(),
            values: field.values.to_string(),
            optional: field.presence != Presence::Required,
            first,
        }
    }
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
            let all: Vec<_> =
                Command::from_name(table.name).unwrap().form().numbers().map(|(n, _)| n).collect();
            assert!(names.into_iter().eq(all.iter()), "{}", table.name);
        }
    }
}
