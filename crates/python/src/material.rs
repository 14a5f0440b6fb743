//! Materials: the clauses of a surface, defined in a scene where it is used first.

use std::collections::HashMap;
use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use rayfold_scene::{Clause, is_name, quoted_word};

use crate::arrays::picture_of;
use crate::given::Given;
use crate::place::{Place, color_text, flag_of, quoted, shown};
use crate::signature::{CLAUSES, Keyword};
use crate::value::{Numbers, check_alone, refused};

/// A surface, made of clauses.
#[pyclass(frozen, module = "rayfold")]
pub(crate) struct Material(pub(crate) Arc<Surface>);

/// The name and the clauses of a material.
#[derive(Debug)]
pub(crate) struct Surface {
    name: Option<String>,
    clauses: Clauses,
}

/// The clauses of a material, as in a script.
#[derive(Debug, Default)]
struct Clauses {
    /// All words, without the name of another material.
    text: String,
    /// The other material of a pattern, and the place of its name in the text.
    other: Option<(usize, Other)>,
    /// Whether the material may be the other one of a pattern.
    is_plain: bool,
    /// The picture that was passed as an array.
    given: Option<Given>,
}

/// The other material of a pattern.
#[derive(Debug)]
enum Other {
    /// The name, and the keyword for which it was given.
    Named(String, &'static str),
    Surface(Arc<Surface>),
}

/// A keyword of a call, by its index in [`CLAUSES`], and its value.
pub(crate) type Value<'py> = (usize, Bound<'py, PyAny>);

impl Surface {
    /// Returns the picture of its pattern, if it was passed as an array. The other material of a pattern has none.
    pub(crate) fn given(&self) -> Option<&Given> {
        self.clauses.given.as_ref()
    }
}

#[pymethods]
impl Material {
    #[new]
    #[pyo3(signature = (*, name = None, **clauses))]
    fn new(name: Option<&Bound<'_, PyAny>>, clauses: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let place = Place { method: "Material", parameter: "name" };
        let name = name.map(|name| name_from(name, place)).transpose()?;
        let mut given = Vec::with_capacity(clauses.map_or(0, |clauses| clauses.len()));
        for (keyword, value) in clauses.into_iter().flatten() {
            let index = clause_of("Material", keyword.cast::<PyString>()?)?;
            if !value.is_none() {
                given.push((index, value));
            }
        }
        surface_of("Material", name, given).map(Self)
    }

    /// The name in scripts, if the material has one of its own.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.0.name.as_deref()
    }

    fn __repr__(&self) -> String {
        let words: Vec<&str> =
            self.name().into_iter().chain(self.0.clauses.text.split_whitespace()).collect();
        format!("<rayfold.Material {}>", words.join(" "))
    }
}

/// The materials that a script defines.
#[derive(Clone, Debug, Default)]
pub(crate) struct Materials {
    defined: HashMap<Arc<str>, Defined>,
    /// The generated names of materials without a name of their own, by their clauses.
    unnamed: HashMap<Arc<str>, Arc<str>>,
    /// The material that was used last, and its name.
    last: Option<(Arc<Surface>, Arc<str>)>,
    count: usize,
}

/// A material that a script defines.
#[derive(Clone, Debug)]
struct Defined {
    /// The clauses, if they are known.
    text: Option<Arc<str>>,
    /// Whether it may be the other material of a pattern, as far as is known.
    is_plain: bool,
}

impl Materials {
    /// Records the name of a material whose clauses are not known.
    pub(crate) fn note(&mut self, name: &str) {
        self.defined.insert(name.into(), Defined { text: None, is_plain: true });
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.defined.contains_key(name)
    }

    /// Adds the name of a material to `line`. Adds the lines that define it, and the material of its pattern, to
    /// `definitions`, if they are not there yet.
    ///
    /// # Errors
    /// Fails if its name is that of another material, or if its pattern names a material that is missing or unsuitable.
    pub(crate) fn define(
        &mut self,
        method: &str,
        surface: &Arc<Surface>,
        line: &mut String,
        definitions: &mut String,
    ) -> PyResult<()> {
        if let Some((last, name)) = &self.last
            && Arc::ptr_eq(last, surface)
        {
            *line += name;
            return Ok(());
        }
        let Clauses { text, other, is_plain, .. } = &surface.clauses;
        let whole;
        let text = match other {
            None if text.is_empty() => " diffuse 0 0 0",
            None => text.as_str(),
            Some((place, other)) => {
                let (before, after) = text.split_at(*place);
                let mut written = format!("{before} ");
                self.define_other(method, other, &mut written, definitions)?;
                written += after;
                whole = written;
                whole.as_str()
            }
        };
        let name = match &surface.name {
            Some(name) => {
                let name: Arc<str> = name.as_str().into();
                match self.defined.get(&name) {
                    Some(Defined { text: Some(clauses), .. }) if **clauses == *text => {}
                    Some(_) => {
                        return Err(PyValueError::new_err(format!(
                            "{method}(): material: the scene has another material with the name {name:?}"
                        )));
                    }
                    None => self.add(name.clone(), text.into(), *is_plain, definitions),
                }
                name
            }
            None => match self.unnamed.get(text) {
                Some(name) => name.clone(),
                None => {
                    let name = self.free_name();
                    let text: Arc<str> = text.into();
                    self.unnamed.insert(text.clone(), name.clone());
                    self.add(name.clone(), text, *is_plain, definitions);
                    name
                }
            },
        };
        *line += &name;
        self.last = Some((surface.clone(), name));
        Ok(())
    }

    fn define_other(
        &mut self,
        method: &str,
        other: &Other,
        line: &mut String,
        definitions: &mut String,
    ) -> PyResult<()> {
        match other {
            Other::Surface(surface) => self.define(method, surface, line, definitions),
            Other::Named(name, parameter) => {
                let place = Place { method, parameter };
                let name = self.known(place, name)?;
                if !self.defined.get(name).is_none_or(|defined| defined.is_plain) {
                    return Err(unfit(place, name));
                }
                *line += name;
                Ok(())
            }
        }
    }

    /// Returns the name of a material that is defined.
    ///
    /// # Errors
    /// Fails if there is none.
    pub(crate) fn known<'n>(&self, place: Place<'_>, name: &'n str) -> PyResult<&'n str> {
        if self.has(name) {
            return Ok(name);
        }
        Err(PyValueError::new_err(format!(
            "{place}: no material has the name {} yet: define it by material(\"...\", diffuse=...) before",
            quoted(name)
        )))
    }

    fn add(&mut self, name: Arc<str>, text: Arc<str>, is_plain: bool, definitions: &mut String) {
        *definitions += "Material ";
        *definitions += &name;
        *definitions += &text;
        definitions.push('\n');
        self.defined.insert(name, Defined { text: Some(text), is_plain });
    }

    fn free_name(&mut self) -> Arc<str> {
        loop {
            self.count += 1;
            let name = format!("m{}", self.count);
            if !self.has(&name) {
                return name.into();
            }
        }
    }
}

/// Makes a surface of the clauses of a call.
///
/// # Errors
/// Fails for a value that its clause does not take.
pub(crate) fn surface_of(
    method: &str,
    name: Option<String>,
    given: Vec<Value<'_>>,
) -> PyResult<Arc<Surface>> {
    Ok(Arc::new(Surface { name, clauses: read_clauses(method, given)? }))
}

/// Makes a surface of one diffuse colour, that of a `parameter`.
///
/// # Errors
/// Fails if `color` is none.
pub(crate) fn surface_of_color(color: &Bound<'_, PyString>, place: Place<'_>) -> PyResult<Arc<Surface>> {
    let color = color_text(color, place)?;
    let clauses = Clauses { text: format!(" diffuse {color}"), other: None, is_plain: true, given: None };
    Ok(Arc::new(Surface { name: None, clauses }))
}

/// Returns the index of the clause that a keyword gives.
///
/// # Errors
/// Fails if there is no such clause.
pub(crate) fn clause_of(method: &str, keyword: &Bound<'_, PyString>) -> PyResult<usize> {
    let keyword = keyword.to_string_lossy();
    CLAUSES.iter().position(|clause| clause.name == keyword).ok_or_else(|| {
        let names: Vec<&str> = CLAUSES.iter().map(|clause| clause.name.as_str()).collect();
        PyTypeError::new_err(format!(
            "{method}() has no parameter {keyword:?}; the clauses of a material are {}",
            names.join(", ")
        ))
    })
}

/// Returns the name of a material or a group.
///
/// # Errors
/// Fails for a name that no script can hold.
pub(crate) fn name_from(value: &Bound<'_, PyAny>, place: Place<'_>) -> PyResult<String> {
    let name = value
        .cast::<PyString>()
        .map_err(|_| PyTypeError::new_err(format!("{place} is a str, not {}", shown(value))))?;
    let name = name.to_string_lossy();
    if is_name(&name) {
        return Ok(name.into_owned());
    }
    Err(PyValueError::new_err(format!(
        "{place}: a name is made of letters, digits, _ and -, and begins with a letter or _, not {}",
        shown(value)
    )))
}

fn read_clauses(method: &str, mut given: Vec<Value<'_>>) -> PyResult<Clauses> {
    given.sort_unstable_by_key(|(index, _)| *index);
    let mut clauses = Clauses { text: String::with_capacity(64), other: None, is_plain: true, given: None };
    let mut pattern: Option<&Keyword> = None;
    for (index, value) in &given {
        let keyword = &CLAUSES[*index];
        let is_pattern = keyword.clause.form().ends_with.is_some() || keyword.clause == Clause::Image;
        if let (Some(first), true) = (pattern, is_pattern) {
            return Err(PyTypeError::new_err(format!(
                "{method}(): a material has one pattern, not {} and {}",
                first.name, keyword.name
            )));
        }
        if is_pattern {
            pattern = Some(keyword);
        }
        clauses.is_plain &= matches!(keyword.clause, Clause::Ambient | Clause::Diffuse | Clause::Mirror);
        if let Some(other) = read_clause(method, keyword, value, &mut clauses)? {
            clauses.other = Some((clauses.text.len(), other));
        }
    }
    Ok(clauses)
}

/// Adds a clause to the text of the others. Returns the other material of a pattern.
fn read_clause(
    method: &str,
    keyword: &'static Keyword,
    value: &Bound<'_, PyAny>,
    clauses: &mut Clauses,
) -> PyResult<Option<Other>> {
    let Clauses { text, given, .. } = clauses;
    let form = keyword.clause.form();
    let place = Place { method, parameter: &keyword.name };
    // One without numbers is there or left out.
    if keyword.entries.is_empty() && !flag_of(value, place)? {
        return Ok(None);
    }
    text.push(' ');
    *text += form.name;
    let mut numbers = Numbers::new();
    let mut other = None;
    let mut entry = |i: usize, value: &Bound<'_, PyAny>| match form.fields.get(i) {
        Some(field) => numbers.field(text, value, form, field, place),
        None => read_other(value, place, &keyword.name).map(|found| other = Some(found)),
    };
    match keyword.entries.len() {
        _ if keyword.clause == Clause::Image => *given = read_image(value, text, &mut numbers, place)?,
        0 => {}
        1 => entry(0, value)?,
        count => {
            let tuple = value.cast::<PyTuple>().ok().filter(|tuple| tuple.len() == count);
            let tuple = tuple.ok_or_else(|| {
                let entries = keyword.entries.join(", ");
                PyTypeError::new_err(format!("{place} takes a tuple ({entries}), not {}", shown(value)))
            })?;
            for (i, value) in tuple.iter_borrowed().enumerate() {
                entry(i, &value)?;
            }
        }
    }
    let names = || keyword.entries.iter().map(String::as_str).collect::<Vec<_>>();
    let whole = || format!("{method}({}=...)", keyword.name);
    if numbers.moves {
        check_alone(&whole(), form, &names(), numbers.values())?;
    } else if let Some(fault) = keyword.clause.check(numbers.values()).into_iter().next() {
        return Err(refused(&whole(), form, &names(), numbers.values(), fault));
    }
    Ok(other)
}

/// Adds a picture to `text`: its file, its mapping, and the width and axes of a flat one. Returns the file if it was
/// made of an array.
fn read_image(
    value: &Bound<'_, PyAny>,
    text: &mut String,
    numbers: &mut Numbers,
    place: Place<'_>,
) -> PyResult<Option<Given>> {
    let wrong = || {
        let forms = "(file, \"uv\"), (file, \"ball\") or (file, \"flat\", size, \"xy\", \"xz\" or \"zy\"), the file by its \
                     name or as an array";
        PyTypeError::new_err(format!("{place} takes a tuple {forms}, not {}", shown(value)))
    };
    let tuple = value.cast::<PyTuple>().map_err(|_| wrong())?;
    let word = |i: usize| {
        let item = tuple.get_item(i).ok()?;
        Some(item.cast::<PyString>().ok()?.to_string_lossy().into_owned())
    };
    let Some(map) = word(1) else { return Err(wrong()) };
    let (file, given) = match word(0) {
        Some(file) => (file, None),
        None => {
            let given = picture_of(&tuple.get_item(0)?, place, "picture")?.ok_or_else(wrong)?;
            (given.name_of().to_owned(), Some(given))
        }
    };
    text.push(' ');
    *text += &quoted_word(&file);
    text.push(' ');
    *text += &map;
    match (map.as_str(), tuple.len()) {
        ("uv" | "ball", 2) => Ok(given),
        ("flat", 3 | 4) => {
            let form = Clause::Image.form();
            numbers.field(text, &tuple.get_item(2)?, form, &form.fields[0], place)?;
            if tuple.len() == 4 {
                let axes =
                    word(3).filter(|axes| ["xy", "xz", "zy"].contains(&axes.as_str())).ok_or_else(wrong)?;
                text.push(' ');
                *text += &axes;
            }
            Ok(given)
        }
        _ => Err(wrong()),
    }
}

fn read_other(value: &Bound<'_, PyAny>, place: Place<'_>, keyword: &'static str) -> PyResult<Other> {
    if let Ok(material) = value.cast::<Material>() {
        let surface = &material.get().0;
        if !surface.clauses.is_plain {
            return Err(unfit(place, surface.name.as_deref().unwrap_or("the other material")));
        }
        return Ok(Other::Surface(surface.clone()));
    }
    match value.cast::<PyString>() {
        Ok(name) if name.to_string_lossy().starts_with('#') => {
            Ok(Other::Surface(surface_of_color(name, place)?))
        }
        Ok(name) => Ok(Other::Named(name.to_string_lossy().into_owned(), keyword)),
        Err(_) => {
            let message =
                format!("{place}: the other material is a Material or a name, not {}", shown(value));
            Err(PyTypeError::new_err(message))
        }
    }
}

/// Returns the error of a material that no pattern can hold.
fn unfit(place: Place<'_>, name: &str) -> PyErr {
    PyValueError::new_err(format!(
        "{place}: {name} cannot be part of a pattern: expected a material of ambient, diffuse and mirror only"
    ))
}
