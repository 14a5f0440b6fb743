//! Places of values in calls, and values as messages show them.

use std::fmt::{self, Display, Formatter};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyString;

/// The place of a value, for messages: `sphere(): radius`.
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
    let text = name.to_string_lossy();
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6);
    let level = |at: usize| {
        let two = digits.and_then(|digits| digits.get(at..at + 2));
        two.filter(|two| two.bytes().all(|b| b.is_ascii_hexdigit()))
            .and_then(|two| u8::from_str_radix(two, 16).ok())
    };
    match [level(0), level(2), level(4)] {
        [Some(r), Some(g), Some(b)] => Ok([r, g, b].map(|level| f64::from(level) / 255.0)),
        _ => Err(PyValueError::new_err(format!(
            "{place} is a colour such as \"#c04020\" or (0.75, 0.25, 0.1), not {}",
            shown(name)
        ))),
    }
}

/// Returns a value as Python shows it, cut if it is long.
pub(crate) fn shown(value: &Bound<'_, PyAny>) -> String {
    let text = value.repr().map(|text| text.to_string_lossy().into_owned()).unwrap_or_default();
    if text.chars().count() <= 60 { text } else { text.chars().take(60).chain("...".chars()).collect() }
}
