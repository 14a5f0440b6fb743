//! The commands and clauses in their Python form: methods, parameters and keywords, from the table of the language.
//!
//! Knows no Python object. A new command of the table appears here by itself, with names derived from the table.
//! [`chosen`] holds only better names.
//!
//! Invariants: the names of a signature are unique, and none is a keyword of Python.

use std::sync::LazyLock;

use rayfold_scene::{
    Clause, Command, Field, Form, Kind, Names, Parameter as Meaning, Presence, Quotes, Subject,
};

/// A method of `Scene`.
#[derive(Debug)]
pub(crate) struct Signature {
    pub(crate) command: Command,
    /// The name of the method.
    pub(crate) method: String,
    pub(crate) parameters: Vec<Parameter>,
}

/// A clause of a material: a keyword of `Material` and of each shape.
#[derive(Debug)]
pub(crate) struct Keyword {
    pub(crate) clause: Clause,
    pub(crate) name: String,
    /// The names of the entries of the value, one per field, then that of another material.
    pub(crate) entries: Vec<String>,
}

/// A parameter of a method.
#[derive(Debug)]
pub(crate) struct Parameter {
    pub(crate) name: String,
    pub(crate) role: Role,
    pub(crate) is_required: bool,
}

/// The position of a parameter in a line of a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// The name that the line defines or refers to.
    Name(Subject),
    /// The numbers of the field with this index.
    Field(usize),
    /// The material of an object, in place of all fields from this index on.
    Material(usize),
    /// The angle up to which the faces of a mesh are smooth.
    Smooth,
    /// Whether a mesh is flat.
    Flat,
    /// The alignment of the lines of a text.
    Align,
    /// The file of the font of a text.
    Font,
}

/// All methods, in the order of the documentation.
pub(crate) static METHODS: LazyLock<Vec<Signature>> =
    LazyLock::new(|| Command::ALL.iter().map(|command| Signature::new(*command)).collect());

/// All clauses, in the order of the documentation.
pub(crate) static CLAUSES: LazyLock<Vec<Keyword>> =
    LazyLock::new(|| Clause::ALL.iter().map(|clause| Keyword::new(*clause)).collect());

impl Signature {
    fn new(command: Command) -> Self {
        let form = command.form();
        let mut parameters = Vec::new();
        if let Some(subject) = form.subject {
            let is_required = true;
            let name = match subject {
                Subject::Quotes(Quotes::File) => "file",
                Subject::Quotes(Quotes::Words) => "text",
                Subject::Defines(_) | Subject::Refers(_) => "name",
            };
            parameters.push(Parameter { name: name.to_owned(), role: Role::Name(subject), is_required });
        }
        let own = own_fields(form);
        for (name, i) in field_names(form).into_iter().zip(0..own) {
            let is_required = form.fields[i].presence == Presence::Required;
            parameters.push(Parameter { name, role: Role::Field(i), is_required });
        }
        if form.surface().is_some() {
            let (name, role) = ("material".to_owned(), Role::Material(own));
            parameters.push(Parameter { name, role, is_required: false });
        }
        let option = |name: &str, role| Parameter { name: name.to_owned(), role, is_required: false };
        match command {
            Command::Mesh => parameters.extend([option("smooth", Role::Smooth), option("flat", Role::Flat)]),
            Command::Text => parameters.extend([option("align", Role::Align), option("font", Role::Font)]),
            _ => {}
        }
        // Two commands are named `Sky`.
        let method = match command {
            Command::SkyPicture => "sky_picture".to_owned(),
            _ => identifier(command.name()),
        };
        let mut signature = Self { command, method, parameters };
        signature.make_unique();
        signature
    }

    /// Returns whether each clause of a material is a keyword.
    pub(crate) fn has_clauses(&self) -> bool {
        let form = self.command.form();
        form.surface().is_some() || form.subject == Some(Subject::Defines(Names::Materials))
    }

    fn make_unique(&mut self) {
        let mut taken: Vec<String> = if self.has_clauses() {
            Clause::ALL.iter().map(|clause| identifier(clause.name())).collect()
        } else {
            Vec::new()
        };
        for parameter in &mut self.parameters {
            let first = parameter.name.clone();
            let mut number = 2;
            while taken.contains(&parameter.name) {
                parameter.name = format!("{first}{number}");
                number += 1;
            }
            taken.push(parameter.name.clone());
        }
    }
}

impl Keyword {
    fn new(clause: Clause) -> Self {
        let form = clause.form();
        let mut entries = field_names(form);
        entries.extend(form.ends_with.map(|_| "other".to_owned()));
        Self { clause, name: identifier(clause.name()), entries }
    }
}

/// Returns the number of fields that are not those of the surface.
pub(crate) fn own_fields(form: &Form) -> usize {
    let Some(surface) = form.surface() else { return form.fields.len() };
    let mut numbers = 0;
    form.fields
        .iter()
        .position(|field| {
            numbers += field.names.len();
            numbers > surface
        })
        .unwrap_or(form.fields.len())
}

/// Returns whether a field is a colour: three numbers that may also be one grey, or a text such as `"#c04020"`.
pub(crate) fn is_color(field: &Field) -> bool {
    field.names.len() == 3 && matches!(field.kind, Kind::Color | Kind::Coefficients)
}

fn field_names(form: &Form) -> Vec<String> {
    form.fields.iter().map(|field| field_name(form, field)).collect()
}

fn field_name(form: &Form, field: &Field) -> String {
    if let Some(name) = chosen(field) {
        return name.to_owned();
    }
    let is_shared = form.fields.iter().filter(|other| other.parameter == field.parameter).count() > 1;
    match field.names {
        [name] if name.len() > 1 => identifier(name),
        [name, ..] if is_shared && name.len() > 1 => identifier(&name[..1]),
        _ => identifier(&described(field.parameter)),
    }
}

/// Returns the better name of a parameter, if it has one besides the table's.
fn chosen(field: &Field) -> Option<&'static str> {
    Some(match field.parameter {
        Meaning::ScreenWidth => "width",
        Meaning::ScreenHeight => "height",
        Meaning::Background if field.names[0] == "R" => "top",
        Meaning::SkyTop => "top",
        Meaning::Background
        | Meaning::Sky
        | Meaning::LightColor
        | Meaning::FogColor
        | Meaning::Shine
        | Meaning::Glass
        | Meaning::Glow => "color",
        Meaning::Center => "center",
        Meaning::Target => "at",
        Meaning::Up => "up",
        Meaning::WindowDistance | Meaning::FogDistance => "distance",
        Meaning::WindowCorner if field.names[0] == "au" => "lower_left",
        Meaning::WindowCorner => "upper_right",
        Meaning::LightDirection => "direction",
        Meaning::LampPosition => "position",
        Meaning::Samples => "n",
        Meaning::SamplingError => "error",
        Meaning::Shutter => "open",
        Meaning::Depth | Meaning::Indirect => "bounces",
        Meaning::RadiusA => "radius_a",
        Meaning::RadiusB => "radius_b",
        Meaning::Thickness => "thickness",
        Meaning::ShineExponent => "exponent",
        Meaning::Roughness => "roughness",
        Meaning::CellSize | Meaning::PictureWidth => "size",
        Meaning::GradientStart => "start",
        Meaning::GradientEnd => "end",
        Meaning::FirstFrame => "a",
        Meaning::LastFrame => "b",
        _ => return None,
    })
}

/// Returns the words for the alignment of the lines of a text: those that stand alone after its surface.
pub(crate) fn aligns(form: &Form) -> &'static [&'static str] {
    form.options.split_last().map_or(&[], |(_font, words)| words)
}

/// Returns the table's words for a parameter, without the article and the letter after it.
fn described(meaning: Meaning) -> String {
    let words = meaning.to_string();
    let words = words.strip_prefix("the ").unwrap_or(&words).replace("'s", "");
    let mut words: Vec<&str> = words.split(' ').collect();
    if words.len() > 1 && words.last().is_some_and(|last| last.len() <= 2) {
        words.pop();
    }
    words.join("_")
}

/// Returns a name that Python accepts.
fn identifier(words: &str) -> String {
    let letters = words.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' });
    let mut name: String = letters.collect();
    if name.starts_with(|c: char| c.is_ascii_digit()) {
        name.insert(0, '_');
    }
    if KEYWORDS.contains(&name.as_str()) {
        name.push('_');
    }
    name
}

/// The keywords of Python in lower case.
const KEYWORDS: [&str; 32] = [
    "and", "as", "assert", "async", "await", "break", "class", "continue", "def", "del", "elif", "else",
    "except", "finally", "for", "from", "global", "if", "import", "in", "is", "lambda", "nonlocal", "not",
    "or", "pass", "raise", "return", "try", "while", "with", "yield",
];
