//! Curves: numbers that change from frame to frame.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use rayfold_scene::{Curve as SceneCurve, Key, Mode};

use crate::describe::modes;
use crate::place::{Place, color_of, items_of, shown};

/// A number that changes from frame to frame, made by `keys`.
#[pyclass(frozen, module = "rayfold")]
pub(crate) struct Curve {
    pub(crate) curve: SceneCurve,
}

#[pymethods]
impl Curve {
    /// Returns the value at a frame, which may be fractional.
    fn at(&self, frame: &Bound<'_, PyAny>) -> PyResult<f64> {
        let number = frame.extract::<f64>();
        let number = number
            .map_err(|_| PyTypeError::new_err(format!("at(): frame is a number, not {}", shown(frame))))?;
        if number.is_finite() {
            return Ok(self.curve.at(number));
        }
        Err(PyValueError::new_err(format!("at(): frame must be finite, not {number}")))
    }

    fn __str__(&self) -> String {
        self.curve.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<rayfold.Curve {}>", self.curve)
    }
}

/// Makes a curve, or a tuple of curves for values of several numbers.
#[pyfunction]
#[pyo3(signature = (keys, mode = None, cycle = false))]
pub(crate) fn keys<'py>(
    keys: &Bound<'py, PyDict>,
    mode: Option<&Bound<'py, PyAny>>,
    cycle: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let py = keys.py();
    let mode = mode.map_or(Ok(Mode::Linear), read_mode)?;
    let mut rows: Vec<(f64, Vec<f64>)> = Vec::with_capacity(keys.len());
    let mut is_number = true;
    for (frame, value) in keys.iter() {
        let wrong = || PyTypeError::new_err(format!("keys(): a frame is a number, not {}", shown(&frame)));
        let values = if let Ok(number) = value.extract::<f64>() {
            vec![number]
        } else if let Ok(name) = value.cast::<PyString>() {
            is_number = false;
            color_of(name, Place { method: "keys", parameter: "a value" })?.to_vec()
        } else {
            is_number = false;
            let wrong = || {
                PyTypeError::new_err(format!(
                    "keys(): a value is a number, a vector or a colour, not {}",
                    shown(&value)
                ))
            };
            let items = items_of(&value).ok_or_else(wrong)?;
            items.map(|item| item?.extract::<f64>().map_err(|_| wrong())).collect::<PyResult<_>>()?
        };
        rows.push((frame.extract::<f64>().map_err(|_| wrong())?, values));
    }
    let lengths = || rows.iter().map(|(_, values)| values.len());
    let (Some(length), true) = (lengths().next(), lengths().max() == lengths().min()) else {
        let message = "keys(): expected at least one key, and as many numbers in each";
        return Err(PyValueError::new_err(message));
    };
    // Frames may come in any order, as the keys of a dictionary do.
    rows.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let curves = (0..length).map(|i| {
        let keys = rows.iter().map(|(frame, values)| Key { frame: *frame, value: values[i] }).collect();
        let curve = SceneCurve::through(mode, cycle, keys).ok_or_else(|| {
            PyValueError::new_err(if cycle && rows.len() < 2 {
                "keys(): a cycle has at least two keys"
            } else {
                "keys(): frames and values must be finite, and not so large that a value between two keys overflows"
            })
        })?;
        Bound::new(py, Curve { curve })
    });
    let mut curves = curves.collect::<PyResult<Vec<_>>>()?;
    if is_number && let Some(curve) = curves.pop() {
        return Ok(curve.into_any());
    }
    Ok(PyTuple::new(py, curves)?.into_any())
}

fn read_mode(mode: &Bound<'_, PyAny>) -> PyResult<Mode> {
    let wrong = || {
        let names: Vec<String> = modes().map(|name| format!("{name:?}")).collect();
        let names = names.join(", ");
        PyValueError::new_err(format!(
            "keys(): mode is one of {names}, or (\"bezier\", a, b, c, d) with a and c from 0 to 1, not {}",
            shown(mode)
        ))
    };
    if let Ok((name, a, b, c, d)) = mode.extract::<(String, f64, f64, f64, f64)>() {
        let is_share = |x: f64| (0.0..=1.0).contains(&x);
        let fits = name.eq_ignore_ascii_case("bezier")
            && is_share(a)
            && is_share(c)
            && b.is_finite()
            && d.is_finite();
        return if fits { Ok(Mode::Bezier([a, b, c, d])) } else { Err(wrong()) };
    }
    let name = mode.extract::<String>().map_err(|_| wrong())?;
    Mode::ALL.iter().copied().find(|mode| mode.name().eq_ignore_ascii_case(&name)).ok_or_else(wrong)
}
