//! Materials: the clauses of a surface, defined in a scene where it is used first.

use std::collections::HashMap;
use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use rayfold_scene::is_name;

use crate::place::{Place, shown};
use crate::signature::{CLAUSES, Keyword};
use crate::value::{Numbers, check_alone, refused};

/// A surface, made of clauses.
#[pyclass(frozen, module = "rayfold")]
pub(crate) struct Material(pub(crate) Arc<Surface>);

/// The name and the clauses of a material.
#[derive(Debug)]
pub(crate) struct Surface {
    name: Option<String>,
    clauses: Vec<ClauseText>,
}

#[derive(Debug)]
struct ClauseText {
    /// The clause as in a script, without another material's name.
    text: String,
    other: Option<Other>,
}

/// The other material of a pattern.
#[derive(Debug)]
enum Other {
    Named(String),
    Surface(Arc<Surface>),
}

#[pymethods]
impl Material {
    #[new]
    #[pyo3(signature = (*, name = None, **clauses))]
    fn new(name: Option<String>, clauses: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        if let Some(name) = &name {
            check_name("Material", name)?;
        }
        let clauses = clauses.map_or(Ok(Vec::new()), |clauses| read_clauses("Material", clauses))?;
        Ok(Self(Arc::new(Surface { name, clauses })))
    }

    /// The name in scripts, if the material has one of its own.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.0.name.as_deref()
    }

    fn __repr__(&self) -> String {
        let clauses: Vec<&str> = self.0.clauses.iter().map(|clause| clause.text.as_str()).collect();
        format!("<rayfold.Material {}{}>", self.0.name.as_deref().unwrap_or_default(), clauses.concat())
    }
}

/// The materials that a script defines.
#[derive(Clone, Debug, Default)]
pub(crate) struct Materials {
    /// The names of all, and the clauses of each, if they are known.
    defined: HashMap<String, Option<String>>,
    /// The names of those without one of their own, by their clauses.
    unnamed: HashMap<String, String>,
    /// The last one that was used, and its name.
    last: Option<(Arc<Surface>, String)>,
    count: usize,
}

impl Materials {
    /// Notes the name of a material whose clauses are not known.
    pub(crate) fn note(&mut self, name: &str) {
        self.defined.insert(name.to_owned(), None);
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.defined.contains_key(name)
    }

    /// Returns the name of a material. Adds the lines that define it, and the materials of its patterns, to `lines`, if
    /// they are not there yet.
    ///
    /// # Errors
    /// Fails if its name is that of another material.
    pub(crate) fn define(&mut self, surface: &Arc<Surface>, lines: &mut String) -> PyResult<String> {
        if let Some((last, name)) = &self.last
            && Arc::ptr_eq(last, surface)
        {
            return Ok(name.clone());
        }
        let mut text = String::new();
        for clause in &surface.clauses {
            text += &clause.text;
            if let Some(other) = &clause.other {
                let name = match other {
                    Other::Named(name) => self.known("Material", name)?.to_owned(),
                    Other::Surface(other) => self.define(other, lines)?,
                };
                text.push(' ');
                text += &name;
            }
        }
        if text.is_empty() {
            text += " diffuse 0 0 0";
        }
        let name = match &surface.name {
            Some(name) => match self.defined.get(name) {
                Some(Some(clauses)) if *clauses == text => name.clone(),
                Some(_) => {
                    return Err(PyValueError::new_err(format!(
                        "the scene has another material with the name {name:?}"
                    )));
                }
                None => self.add(name.clone(), text, lines),
            },
            None => match self.unnamed.get(&text) {
                Some(name) => name.clone(),
                None => {
                    let name = self.free_name();
                    self.unnamed.insert(text.clone(), name.clone());
                    self.add(name, text, lines)
                }
            },
        };
        self.last = Some((surface.clone(), name.clone()));
        Ok(name)
    }

    /// Returns the name of a material that is defined.
    ///
    /// # Errors
    /// Fails if there is none.
    pub(crate) fn known<'n>(&self, method: &str, name: &'n str) -> PyResult<&'n str> {
        if self.has(name) {
            return Ok(name);
        }
        Err(PyValueError::new_err(format!(
            "{method}(): no material has the name {name:?} yet: define it by material({name:?}, diffuse=...) before"
        )))
    }

    fn add(&mut self, name: String, text: String, lines: &mut String) -> String {
        *lines += "Material ";
        *lines += &name;
        *lines += &text;
        lines.push('\n');
        self.defined.insert(name.clone(), Some(text));
        name
    }

    fn free_name(&mut self) -> String {
        loop {
            self.count += 1;
            let name = format!("m{}", self.count);
            if !self.has(&name) {
                return name;
            }
        }
    }
}

/// Makes a surface without a name from the clauses of a call.
///
/// # Errors
/// Fails for an unknown clause, and for a value that it does not take.
pub(crate) fn surface_of(
    method: &str,
    name: Option<String>,
    clauses: &Bound<'_, PyDict>,
) -> PyResult<Arc<Surface>> {
    Ok(Arc::new(Surface { name, clauses: read_clauses(method, clauses)? }))
}

/// Makes a surface of one diffuse colour.
///
/// # Errors
/// Fails if `color` is none.
pub(crate) fn surface_of_color(method: &str, color: &Bound<'_, PyString>) -> PyResult<Arc<Surface>> {
    let clauses = PyDict::new(color.py());
    clauses.set_item("diffuse", color)?;
    surface_of(method, None, &clauses)
}

/// Checks the name of a material or a group.
///
/// # Errors
/// Fails for a name that no script can hold.
pub(crate) fn check_name(method: &str, name: &str) -> PyResult<()> {
    if is_name(name) {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{method}(): a name is made of letters, digits, _ and -, and begins with a letter or _, not {name:?}"
    )))
}

fn read_clauses(method: &str, clauses: &Bound<'_, PyDict>) -> PyResult<Vec<ClauseText>> {
    let mut read: Vec<(usize, ClauseText)> = Vec::with_capacity(clauses.len());
    for (name, value) in clauses.iter() {
        let name = name.cast_into::<PyString>()?;
        let name = name.to_str()?;
        let Some(index) = CLAUSES.iter().position(|keyword| keyword.name == name) else {
            let names: Vec<&str> = CLAUSES.iter().map(|keyword| keyword.name.as_str()).collect();
            return Err(PyTypeError::new_err(format!(
                "{method}() has no parameter {name:?}; the clauses of a material are {}",
                names.join(", ")
            )));
        };
        if !value.is_none() {
            read.push((index, read_clause(method, &CLAUSES[index], &value)?));
        }
    }
    read.sort_unstable_by_key(|(index, _)| *index);
    let patterns = read.iter().map(|(index, _)| &CLAUSES[*index]);
    let patterns: Vec<&str> = patterns
        .filter(|keyword| keyword.clause.form().ends_with.is_some())
        .map(|keyword| keyword.name.as_str())
        .collect();
    if let [first, second, ..] = patterns[..] {
        return Err(PyTypeError::new_err(format!(
            "{method}(): a material has one pattern, not {first} and {second}"
        )));
    }
    Ok(read.into_iter().map(|(_, clause)| clause).collect())
}

fn read_clause(method: &str, keyword: &Keyword, value: &Bound<'_, PyAny>) -> PyResult<ClauseText> {
    let form = keyword.clause.form();
    let place = Place { method, parameter: &keyword.name };
    let mut text = format!(" {}", form.name);
    let mut numbers = Numbers::new();
    let mut other = None;
    let wrong = || {
        let entries = keyword.entries.join(", ");
        PyTypeError::new_err(format!("{place} takes a tuple ({entries}), not {}", shown(value)))
    };
    let values: Vec<Bound<'_, PyAny>> = match keyword.entries.len() {
        0 if value.is_truthy()? => Vec::new(),
        0 => return Err(PyTypeError::new_err(format!("{place} is True or left out, not {}", shown(value)))),
        1 => vec![value.clone()],
        count => {
            let tuple = value.cast::<PyTuple>().map_err(|_| wrong())?;
            let values: Vec<_> = tuple.iter().collect();
            if values.len() != count {
                return Err(wrong());
            }
            values
        }
    };
    let names: Vec<&str> = keyword.entries.iter().map(String::as_str).collect();
    for (i, value) in values.iter().enumerate() {
        match form.fields.get(i) {
            Some(field) => numbers.field(&mut text, value, form, field, place)?,
            None => other = Some(read_other(value, place)?),
        }
    }
    let whole = format!("{method}({}=...)", keyword.name);
    if numbers.moves {
        check_alone(&whole, form, &names, numbers.values())?;
    } else if let Some(fault) = keyword.clause.check(numbers.values()).into_iter().next() {
        return Err(refused(&whole, form, &names, numbers.values(), fault));
    }
    Ok(ClauseText { text, other })
}

fn read_other(value: &Bound<'_, PyAny>, place: Place<'_>) -> PyResult<Other> {
    if let Ok(material) = value.cast::<Material>() {
        return Ok(Other::Surface(material.get().0.clone()));
    }
    match value.cast::<PyString>() {
        Ok(name) if name.to_string_lossy().starts_with('#') => {
            Ok(Other::Surface(surface_of_color(place.method, name)?))
        }
        Ok(name) => Ok(Other::Named(name.to_string_lossy().into_owned())),
        Err(_) => {
            let message =
                format!("{place}: the other material is a Material or a name, not {}", shown(value));
            Err(PyTypeError::new_err(message))
        }
    }
}
