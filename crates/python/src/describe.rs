//! Docstrings and the type stub, from the table of the language.
//!
//! `__init__.pyi` is the text of [`stub`]; a test compares the two. What does not come from the table stands in `stub.pyi`.

use std::fmt::Write;

use rayfold_scene::{Clause, Command, Curve, Field, Form, Kind, Mode, Names, Quotes, Subject, Unit, Values};

use crate::signature::{CLAUSES, Keyword, METHODS, Parameter, Role, Signature, aligns, is_color};

/// The handwritten parts of the stub, with placeholder lines for the parts from the table.
const TEMPLATE: &str = include_str!("stub.pyi");

/// Returns the text of `__init__.pyi`.
pub(crate) fn stub() -> String {
    let mut text = String::new();
    for line in TEMPLATE.lines() {
        match line.trim() {
            "# commands" => METHODS.iter().for_each(|method| write_method(&mut text, method)),
            "# settings" => settings().for_each(|method| {
                let Signature { method, .. } = method;
                text += &format!("        {method}: Any = ...,\n");
            }),
            "# clauses" => CLAUSES.iter().for_each(|keyword| {
                text += &format!("        {}: {} | None = None,\n", keyword.name, keyword_type(keyword));
            }),
            "# modes" => text += &format!("Mode: TypeAlias = Literal[{}]\n", quoted(modes())),
            _ => text += &format!("{line}\n"),
        }
    }
    text
}

/// Returns the commands that may be keywords of `Scene`: those that take arguments, but neither a name nor a material.
pub(crate) fn settings() -> impl Iterator<Item = &'static Signature> {
    METHODS.iter().filter(|method| {
        let form = method.command.form();
        !method.parameters.is_empty()
            && form.subject.is_none()
            && form.surface().is_none()
            && method.method != "screen"
    })
}

/// Returns the docstring of a method.
pub(crate) fn method_doc(method: &Signature) -> String {
    let form = method.command.form();
    let mut text = format!("{}\n\nIn a script: `{form}`.\n", method.command.summary());
    if !method.parameters.is_empty() || method.has_clauses() {
        text += "\nParameters\n----------\n";
    }
    for parameter in &method.parameters {
        let type_name = parameter_type(form, parameter);
        let default = if parameter.is_required { "" } else { ", optional" };
        let _ = writeln!(text, "{} : {type_name}{default}", parameter.name);
        let about = match parameter.role {
            Role::Name(Subject::Defines(names)) => format!("the name of the new {}", names.noun()),
            Role::Name(Subject::Refers(names)) => format!("the name of a {}", names.noun()),
            Role::Name(Subject::Quotes(Quotes::File)) => {
                let file = "the name of a file in the script's folder; of a scene that has none, in the current folder";
                let array = "; or an array of pixels, of height x width, with 1, 3 or 4 channels: `uint8` or `uint16` are \
                             levels, floats are light from 0";
                format!("{file}{}", if takes_pixels(form) { array } else { "" })
            }
            Role::Name(Subject::Quotes(Quotes::Words)) => {
                "the words; a line feed begins a line".to_owned()
            }
            Role::Align => {
                "the end of the lines that is at x = 0: they begin there, have their middles there or end there; by default \
                 \"left\""
                    .to_owned()
            }
            Role::Font => {
                "the name of a TrueType or OpenType file, as that of a model; by default Noto Sans Bold, which comes with \
                 rayfold"
                    .to_owned()
            }
            Role::Smooth => "faces that meet at less than this angle in degrees, 0 to 180, look smooth".to_owned(),
            Role::Flat => "whether the normals of the file are left out".to_owned(),
            Role::Field(i) => field_doc(&form.fields[i]),
            Role::Material(_) if form.subject == Some(Subject::Quotes(Quotes::Words)) => {
                "the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. By \
                 default .8 grey"
                    .to_owned()
            }
            Role::Material(_) if form.takes(0) => {
                "the surface: a `Material`, the name of one, or a colour for `diffuse`; in its place the clauses below. By \
                 default that of the file"
                    .to_owned()
            }
            Role::Material(_) => {
                "the surface: a `Material`, the name of one, or a colour for `diffuse`; in its \
                                  place the clauses below. Black by default"
                    .to_owned()
            }
        };
        let _ = writeln!(text, "    {about}.");
    }
    if method.has_clauses() {
        let names: Vec<&str> = CLAUSES.iter().map(|keyword| keyword.name.as_str()).collect();
        let _ =
            writeln!(text, "{}\n    the clauses of a material, as those of `Material`.", names.join(", "));
    }
    if method.command == Command::Mesh {
        text += OF_ARRAYS_DOC;
    }
    if let Some(word) = form.word {
        let _ = writeln!(text, "\n`{}({word:?})` in place of all arguments.", method.method);
    }
    let together: Vec<String> = form.constraints.iter().map(|constraint| constraint.describe(form)).collect();
    if !together.is_empty() {
        let _ = writeln!(text, "\nIn the names of the script, {}.", together.join("; "));
    }
    text
}

/// Returns the docstring of `Material`.
pub(crate) fn material_doc() -> String {
    let mut text = "A surface, of the clauses that are given.\n\nA scene defines it where it is used first. Without a \
                    name it gets one there.\n\nParameters\n----------\nname : str, optional\n    its name in scripts.\n"
        .to_owned();
    for keyword in &*CLAUSES {
        let form = keyword.clause.form();
        let _ = writeln!(text, "{} : {}, optional", keyword.name, keyword_type(keyword));
        let _ = writeln!(text, "    {}", keyword.clause.summary());
        if keyword.clause == Clause::Image {
            text += "    the name of the file, or an array of levels (height x width, with 1, 3 or 4 channels of `uint8`, \
                     `uint16` or floats from 0 to 1), then \"uv\", \"ball\", or \"flat\", its width and the axes along which it goes right \
                     and up.\n";
            continue;
        }
        for (entry, field) in keyword.entries.iter().zip(form.fields) {
            let of = if keyword.entries.len() > 1 { format!("{entry}: ") } else { String::new() };
            let _ = writeln!(text, "    {of}{}.", field_doc(field));
        }
        if form.ends_with.is_some() {
            text += "    other: the other material, a `Material` or a name.\n";
        }
    }
    text
}

/// Returns the words with which a curve may start, in the order of the documentation.
pub(crate) fn modes() -> impl Iterator<Item = &'static str> {
    Mode::ALL.iter().map(|mode| mode.name())
}

/// Returns the docstring of `keys`.
pub(crate) fn keys_doc() -> String {
    let example =
        rayfold_scene::parse_curve("(smooth 1:0 50:3)").as_ref().map(Curve::to_string).unwrap_or_default();
    let modes: String = rayfold_scene::language()
        .curve_modes
        .iter()
        .map(|mode| format!("    {} : {}\n", mode.name, mode.about))
        .collect();
    format!(
        "A number, or several, that change from frame to frame.\n\nIn a script: `{example}`.\n\nParameters\n----------\n\
         keys : dict\n    values by the numbers of frames. A value is a number, or a vector or colour: then the result \
         is a tuple of curves.\nmode : str or tuple\n    the interpolation between two keys. A tuple is \
         `(\"bezier\", a, b, c, d)`.\ncycle : bool\n    whether the curve restarts at its last key.\n\nModes\n-----\n{modes}"
    )
}

/// The documentation of a mesh from arrays.
const OF_ARRAYS_DOC: &str = "
From arrays: `mesh(vertices, faces, normals, colors, uv, material, smooth, flat)`, of which the first two are needed. NumPy's \
arrays are taken, and what NumPy makes arrays of, such as lists of rows. The scene names them as a file, which is written \
where the script is saved.

Parameters
----------
vertices : Array
    (n, 3) places, of `float32`, `float64` or integers.
faces : Array
    (m, 3) triangles or (m, 4) convex quadrilaterals: the indices of their vertices from 0, counterclockwise seen from
    outside.
normals : Array, optional
    (n, 3) directions at the vertices, with which the mesh looks smooth.
colors : Array, optional
    (n, 3) or opaque (n, 4) levels of the vertices: `uint8` from 0 to 255, `uint16` or floats from 0 to 1. Under \
`tone(\"srgb\")` they are decoded, as `\"#c04020\"` is.
uv : Array, optional
    (n, 2) texture coordinates of the vertices. (0, 0) is the lower left corner of a picture.
material, smooth, flat and the clauses
    as those of a file.
";

/// Returns whether the file of a command may be an array of pixels.
fn takes_pixels(form: &Form) -> bool {
    form.subject == Some(Subject::Quotes(Quotes::File)) && form.surface().is_none()
}

fn field_doc(field: &Field) -> String {
    let unit = match (field.kind, field.kind.unit()) {
        (Kind::Word, _) | (_, Unit::One) => String::new(),
        (_, unit) => format!(" in {unit}"),
    };
    let range = match field.values {
        Values::Any => String::new(),
        values => format!(", {values}"),
    };
    let default =
        field.presence.default().map(|default| format!("; by default {default}")).unwrap_or_default();
    format!("{} (`{}`): {}{unit}{range}{default}", field.parameter, field.names.join(" "), field.kind)
}

fn write_method(text: &mut String, method: &Signature) {
    if method.command == Command::Mesh {
        text.push_str("    @overload\n");
        write_signature(text, method, &[]);
        text.push_str("    @overload\n");
        write_signature(text, method, &OF_ARRAYS);
    } else {
        write_signature(text, method, &[]);
    }
}

/// The parameters of a mesh from arrays, in place of its file.
const OF_ARRAYS: [&str; 5] = [
    "vertices: Array",
    "faces: Array",
    "normals: Array | None = None",
    "colors: Array | None = None",
    "uv: Array | None = None",
];

/// Writes a signature with its documentation. `others` are parameters in place of the file.
fn write_signature(text: &mut String, method: &Signature, others: &[&str]) {
    let form = method.command.form();
    let mut parameters = vec!["self".to_owned()];
    parameters.extend(others.iter().map(|parameter| (*parameter).to_owned()));
    let mut is_optional = false;
    let replaced = usize::from(!others.is_empty());
    for parameter in &method.parameters[replaced..] {
        let type_name = parameter_type(form, parameter);
        let type_name = match form.word.filter(|_| parameters.len() == 1) {
            Some(word) => format!("{type_name} | Literal[\"{word}\"]"),
            None => type_name,
        };
        is_optional |= !parameter.is_required || form.word.is_some() && parameters.len() > 1;
        parameters.push(if is_optional {
            format!("{}: {type_name} | None = None", parameter.name)
        } else {
            format!("{}: {type_name}", parameter.name)
        });
    }
    if method.has_clauses() {
        parameters.push("*".to_owned());
        let clause = |keyword: &Keyword| format!("{}: {} | None = None", keyword.name, keyword_type(keyword));
        parameters.extend(CLAUSES.iter().map(clause));
    }
    let result = match form.subject {
        Some(Subject::Defines(Names::Materials)) => "Material",
        Some(Subject::Defines(Names::Groups)) => "AbstractContextManager[Scene]",
        _ => "None",
    };
    let _ = writeln!(text, "    def {}(", method.method);
    for parameter in parameters {
        let _ = writeln!(text, "        {parameter},");
    }
    let _ = writeln!(text, "    ) -> {result}:");
    let doc = method_doc(method);
    let lines = doc.trim_end().lines().collect::<Vec<_>>().join("\n        ");
    let lines = lines.replace("\n        \n", "\n\n");
    let _ = writeln!(text, "        \"\"\"{lines}\n        \"\"\"");
}

fn parameter_type(form: &Form, parameter: &Parameter) -> String {
    match parameter.role {
        Role::Name(_) if takes_pixels(form) => "str | Pixels".to_owned(),
        Role::Name(_) => "str".to_owned(),
        Role::Field(i) => field_type(form, i),
        Role::Material(_) => "Material | str".to_owned(),
        Role::Smooth => "FixedNumber".to_owned(),
        Role::Flat => "bool".to_owned(),
        Role::Align => format!("Literal[{}]", quoted(aligns(form).iter().copied())),
        Role::Font => "str".to_owned(),
    }
}

fn field_type(form: &Form, place: usize) -> String {
    let field = &form.fields[place];
    let first = form.fields[..place].iter().map(|field| field.names.len()).sum();
    match field.values {
        Values::OneOf(words) => return format!("Literal[{}]", quoted(words.iter().copied())),
        Values::Whole(..) => return "int".to_owned(),
        _ => {}
    }
    let name = match (field.names.len(), is_color(field)) {
        (_, true) => "Color",
        (1, _) => "Number",
        _ => "Vector",
    };
    if form.takes_curve(first) { name.to_owned() } else { format!("Fixed{name}") }
}

/// Returns the type of a clause's value.
fn keyword_type(keyword: &Keyword) -> String {
    let form: &Form = Clause::form(keyword.clause);
    if keyword.clause == Clause::Image {
        let flat = "tuple[str | Pixels, Literal[\"flat\"], Number";
        return format!(
            "tuple[str | Pixels, Literal[\"uv\", \"ball\"]] | {flat}] | {flat}, Literal[\"xy\", \"xz\", \"zy\"]]"
        );
    }
    let mut types: Vec<String> = (0..form.fields.len()).map(|i| field_type(form, i)).collect();
    types.extend(form.ends_with.map(|_| "Material | str".to_owned()));
    match types.as_slice() {
        [] => "bool".to_owned(),
        [one] => one.clone(),
        several => format!("tuple[{}]", several.join(", ")),
    }
}

fn quoted(words: impl Iterator<Item = &'static str>) -> String {
    words.map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}
