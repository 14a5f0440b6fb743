//! Python's values as the words of a line: numbers, curves, vectors, colours and names.
//!
//! A wrong value is an error in Python's terms, with the method and the parameter: a `TypeError` for a value of the wrong
//! kind, a `ValueError` for one out of range.

use std::fmt::Write;
use std::ops::Range;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyList, PyString, PyTuple};
use rayfold_scene::{Curve as SceneCurve, Field, Form, InvalidValue, Presence, Values};

use crate::curve::Curve;
use crate::place::{Place, color_of, items_of, shown};
use crate::signature::is_color;

/// The largest count of numbers of a line: more than any command takes.
const MOST: usize = 64;

/// The numbers of a line: their text, and their values as long as none is a curve.
pub(crate) struct Numbers {
    values: [f64; MOST],
    count: usize,
    pub(crate) moves: bool,
    /// Whether the last number belongs to a colour that is written as `#rrggbb`.
    is_behind_color: bool,
}

impl Numbers {
    pub(crate) fn new() -> Self {
        Self { values: [0.0; MOST], count: 0, moves: false, is_behind_color: false }
    }

    /// Returns the numbers so far; that of a curve is its first value.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values[..self.count]
    }

    fn push(&mut self, value: f64) {
        self.values[self.count] = value;
        self.count += 1;
    }

    /// Adds the value of a field.
    ///
    /// # Errors
    /// Fails if the value is not of the field's kind.
    pub(crate) fn field(
        &mut self,
        text: &mut String,
        value: &Bound<'_, PyAny>,
        form: &Form,
        field: &Field,
        place: Place<'_>,
    ) -> PyResult<()> {
        if let Values::OneOf(words) = field.values {
            return self.word(text, value, words, place);
        }
        let length = field.names.len();
        if length == 1 {
            let number = number_of(value).ok_or_else(|| wrong_kind(value, field, form, place))?;
            return self.number(text, number, form, place);
        }
        self.vector(text, value, form, field, place)
    }

    /// Adds the numbers of an omitted field, of which a later one is given.
    ///
    /// # Errors
    /// Fails if the default is no number.
    pub(crate) fn default(
        &mut self,
        text: &mut String,
        field: &Field,
        place: Place<'_>,
        later: &str,
    ) -> PyResult<()> {
        let default = field.presence.default().and_then(|default| default.parse::<f64>().ok());
        let Some(default) = default else {
            return Err(PyTypeError::new_err(format!("{place} must be given where {later} is")));
        };
        for _ in field.names {
            text.push(' ');
            write_number(text, default);
            self.push(default);
        }
        Ok(())
    }

    fn word(
        &mut self,
        text: &mut String,
        value: &Bound<'_, PyAny>,
        words: &[&str],
        place: Place<'_>,
    ) -> PyResult<()> {
        let given = value.extract::<String>().unwrap_or_default();
        let Some(index) = words.iter().position(|word| word.eq_ignore_ascii_case(&given)) else {
            let words: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
            let message = format!("{place} is {}, not {}", words.join(" or "), shown(value));
            return Err(if value.is_instance_of::<PyString>() {
                PyValueError::new_err(message)
            } else {
                PyTypeError::new_err(message)
            });
        };
        text.push(' ');
        text.push_str(words[index]);
        self.push(index as f64);
        Ok(())
    }

    fn vector(
        &mut self,
        text: &mut String,
        value: &Bound<'_, PyAny>,
        form: &Form,
        field: &Field,
        place: Place<'_>,
    ) -> PyResult<()> {
        let length = field.names.len();
        let wrong = || wrong_kind(value, field, form, place);
        if is_color(field) {
            if let Ok(name) = value.cast::<PyString>() {
                return self.color(text, name, form, place);
            }
            // A sequence is asked first: Python makes an exception of each value that is no number.
            let is_sequence = value.is_instance_of::<PyTuple>() || value.is_instance_of::<PyList>();
            if let Some(number) = Some(value).filter(|_| !is_sequence).and_then(number_of) {
                let start = text.len();
                self.number(text, number, form, place)?;
                let (end, channel) = (text.len(), self.values[self.count - 1]);
                for _ in 1..length {
                    text.extend_from_within(start..end);
                    self.push(channel);
                }
                return Ok(());
            }
        }
        let before = self.count;
        let mut add = |item: &Bound<'_, PyAny>| -> PyResult<()> {
            let number = number_of(item).filter(|_| self.count < before + length).ok_or_else(wrong)?;
            self.number(text, number, form, place)
        };
        if let Ok(tuple) = value.cast::<PyTuple>() {
            for item in tuple.iter_borrowed() {
                add(&item)?;
            }
        } else if let Ok(list) = value.cast::<PyList>() {
            for item in list.iter() {
                add(&item)?;
            }
        } else {
            for item in items_of(value).ok_or_else(wrong)? {
                add(&item?)?;
            }
        }
        if self.count == before + length { Ok(()) } else { Err(wrong()) }
    }

    /// Adds a colour as it is written, because its meaning may depend on the tone of the picture.
    fn color(
        &mut self,
        text: &mut String,
        name: &Bound<'_, PyString>,
        form: &Form,
        place: Place<'_>,
    ) -> PyResult<()> {
        if !form.takes_color(self.count, self.is_behind_color) {
            return Err(PyValueError::new_err(format!(
                "{place} may be a text such as {} only behind another colour that is: give both as texts, or both as numbers",
                shown(name)
            )));
        }
        let channels = color_of(name, place)?;
        text.push(' ');
        *text += &name.to_string_lossy();
        for channel in channels {
            self.push(channel);
        }
        self.is_behind_color = true;
        Ok(())
    }

    fn number(&mut self, text: &mut String, number: Number, form: &Form, place: Place<'_>) -> PyResult<()> {
        text.push(' ');
        self.is_behind_color = false;
        match number {
            Number::Constant(value) if !value.is_finite() => {
                return Err(PyValueError::new_err(format!("{place} must be finite, not {value}")));
            }
            Number::Constant(value) => {
                write_number(text, value);
                self.push(value);
            }
            Number::Moving(curve) if form.takes_curve(self.count) => {
                let _ = write!(text, "{curve}");
                self.push(curve.keys()[0].value);
                self.moves = true;
            }
            Number::Moving(_) => {
                return Err(PyTypeError::new_err(format!(
                    "{place} is the same in all frames: it takes no curve"
                )));
            }
        }
        Ok(())
    }
}

#[derive(Clone)]
enum Number {
    Constant(f64),
    Moving(SceneCurve),
}

fn number_of(value: &Bound<'_, PyAny>) -> Option<Number> {
    if let Ok(number) = value.cast_exact::<PyFloat>() {
        return Some(Number::Constant(number.value()));
    }
    if value.is_instance_of::<PyString>() {
        return None;
    }
    if let Ok(number) = value.extract::<f64>() {
        return Some(Number::Constant(number));
    }
    value.cast::<Curve>().ok().map(|curve| Number::Moving(curve.get().curve.clone()))
}

/// Adds the shortest decimal that reads back as `x`, as scripts are written.
pub(crate) fn write_number(text: &mut String, x: f64) {
    if write_short(text, x) {
        return;
    }
    let _ =
        if x == 0.0 || (1e-5..1e16).contains(&x.abs()) { write!(text, "{x}") } else { write!(text, "{x:e}") };
}

/// Adds a number with few decimals, such as people write. It is faster and gives the same digits. Returns `false` for
/// other numbers.
fn write_short(text: &mut String, x: f64) -> bool {
    const PLACES: usize = 6;
    const SCALE: f64 = 1e6;
    let size = x.abs();
    // A negative zero keeps its sign. Below 1e-5 scripts have exponents; below 1e9 all digits are known exactly.
    if !(x == 0.0 && x.is_sign_positive() || (1e-5..1e9).contains(&size)) {
        return false;
    }
    let scaled = (size * SCALE).round();
    // The quotient is the number nearest to that decimal, which has at most 15 digits: no other such decimal reads so.
    if scaled / SCALE != size {
        return false;
    }
    let (whole, mut part) = (scaled as u64 / SCALE as u64, scaled as u64 % SCALE as u64);
    let mut digits = [b'0'; 24];
    let (mut start, mut end) = (digits.len() - PLACES, digits.len());
    for digit in digits[start..].iter_mut().rev() {
        *digit += (part % 10) as u8;
        part /= 10;
    }
    while end > start && digits[end - 1] == b'0' {
        end -= 1;
    }
    if end > start {
        start -= 1;
        digits[start] = b'.';
    } else {
        // No point follows.
        end = start;
    }
    let mut left = whole;
    loop {
        start -= 1;
        digits[start] = b'0' + (left % 10) as u8;
        left /= 10;
        if left == 0 {
            break;
        }
    }
    if x < 0.0 {
        text.push('-');
    }
    text.extend(digits[start..end].iter().map(|digit| char::from(*digit)));
    true
}

/// Returns the error of numbers that a command or clause refuses. `names` are those of the fields, in Python.
pub(crate) fn refused(
    method: &str,
    form: &Form,
    names: &[&str],
    values: &[f64],
    (fault, place): (InvalidValue, Range<usize>),
) -> PyErr {
    let mut end = 0;
    let mut about = Vec::new();
    let mut range = None;
    for (field, name) in form.fields.iter().zip(names) {
        let start = end;
        end += field.names.len();
        if start < place.end && place.start < end && start < values.len() {
            let given = &values[start..end.min(values.len())];
            // The table's range says more than the fault of the model, which knows nothing of hidden objects.
            if given.iter().any(|value| value.is_finite() && !field.values.take(*value, *value)) {
                range = Some(format!("{} must be {}", field.parameter, field.values));
            }
            let given: Vec<String> = given.iter().map(f64::to_string).collect();
            let given = if given.len() == 1 { given[0].clone() } else { format!("({})", given.join(", ")) };
            about.push(format!("{name}={given}"));
        }
    }
    let reason = range.unwrap_or_else(|| fault.to_string());
    PyValueError::new_err(format!("{method}({}): {reason}", about.join(", ")))
}

/// Checks the constant numbers and the keys of a line with curves. Values between keys are checked with the frames.
///
/// # Errors
/// Fails for a number that its field never allows.
pub(crate) fn check_alone(method: &str, form: &Form, names: &[&str], values: &[f64]) -> PyResult<()> {
    let mut end = 0;
    for (field, name) in form.fields.iter().zip(names) {
        let start = end;
        end += field.names.len();
        for value in values.get(start..end.min(values.len())).unwrap_or_default() {
            if !value.is_finite() || !field.values.take(*value, *value) {
                let range = if value.is_finite() { field.values.to_string() } else { "finite".to_owned() };
                return Err(PyValueError::new_err(format!(
                    "{method}({name}={value}): {} must be {range}",
                    field.parameter
                )));
            }
        }
    }
    Ok(())
}

fn wrong_kind(value: &Bound<'_, PyAny>, field: &Field, form: &Form, place: Place<'_>) -> PyErr {
    let expected = match field.names.len() {
        1 if form.curves && form.options.is_empty() => "a number or a curve".to_owned(),
        1 => "a number".to_owned(),
        3 if is_color(field) => "three numbers, a number, or a colour such as \"#c04020\"".to_owned(),
        count => format!("{count} numbers"),
    };
    let range = match field.values {
        Values::Any | Values::Clamped | Values::NotZero => String::new(),
        values => format!(", {values}"),
    };
    if value.is_instance_of::<PyInt>() && (field.names.len() == 1 || is_color(field)) {
        let message = format!("{place} is a number of at most {:e}, not {}", f64::MAX, shown(value));
        return PyValueError::new_err(message);
    }
    let optional = if field.presence == Presence::Required { "" } else { " or None" };
    PyTypeError::new_err(format!("{place} takes {expected}{range}{optional}, not {}", shown(value)))
}
