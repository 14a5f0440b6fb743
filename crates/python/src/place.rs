//! The position of a value in a call, for messages; values as messages show them; and functions that several kinds of
//! values share.

use std::borrow::Cow;
use std::fmt::{self, Display, Formatter};

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyDict, PyFrozenSet, PyIterator, PySet, PyString};
use rayfold_scene::color_levels;

/// The position of a value, for messages: `sphere(): radius`.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    pub(crate) method: &'a str,
    pub(crate) parameter: &'a str,
}

impl Display for Place<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}(): {}", self.method, self.parameter)
    }
}

/// Returns the channels of a text such as `#c04020`, from 0 to 1.
///
/// # Errors
/// Fails for other texts.
pub(crate) fn color_of(name: &Bound<'_, PyString>, place: Place<'_>) -> PyResult<[f64; 3]> {
    let text = color_text(name, place)?;
    let levels = color_levels(text.as_bytes()).unwrap_or_default();
    Ok(levels.map(|level| f64::from(level) / 255.0))
}

/// Returns a text such as `#c04020`.
///
/// # Errors
/// Fails for other texts.
pub(crate) fn color_text<'a>(name: &'a Bound<'_, PyString>, place: Place<'_>) -> PyResult<Cow<'a, str>> {
    let text = name.to_string_lossy();
    if text.len() == 7 && color_levels(text.as_bytes()).is_some() {
        return Ok(text);
    }
    Err(PyValueError::new_err(format!(
        "{place} is a colour such as \"#c04020\" or (0.75, 0.25, 0.1), not {}",
        shown(name)
    )))
}

/// Returns a value that is True or False.
///
/// # Errors
/// Fails for other values, even if Python treats them as true.
pub(crate) fn flag_of(value: &Bound<'_, PyAny>, place: Place<'_>) -> PyResult<bool> {
    value
        .extract::<bool>()
        .map_err(|_| PyTypeError::new_err(format!("{place} is True or False, not {}", shown(value))))
}

/// Returns the items of an array or an iterator, or `None` for a value that holds no numbers in order, although Python
/// can iterate over it.
pub(crate) fn items_of<'py>(value: &Bound<'py, PyAny>) -> Option<Bound<'py, PyIterator>> {
    let has_no_numbers = value.is_instance_of::<PyString>()
        || value.is_instance_of::<PyBytes>()
        || value.is_instance_of::<PyByteArray>()
        || value.is_instance_of::<PyDict>()
        || value.is_instance_of::<PySet>()
        || value.is_instance_of::<PyFrozenSet>();
    if has_no_numbers { None } else { value.try_iter().ok() }
}

/// Returns a value as Python shows it, cut if it is long.
pub(crate) fn shown(value: &Bound<'_, PyAny>) -> String {
    match value.repr() {
        Ok(text) => cut(text.to_string_lossy().into_owned()),
        // The object fails when it is shown.
        Err(_) => value.get_type().name().map_or_else(|_| "an object".to_owned(), |name| format!("a {name}")),
    }
}

/// Returns a name in quotes, cut if it is long.
pub(crate) fn quoted(name: &str) -> String {
    cut(format!("{name:?}"))
}

fn cut(text: String) -> String {
    if text.chars().count() <= 60 { text } else { text.chars().take(60).chain("...".chars()).collect() }
}
