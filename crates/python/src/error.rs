//! Errors: diagnostics as `SceneError`, and bugs as an ordinary exception.

use std::error::Error as _;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::exceptions::{PyOSError, PyRuntimeError};
use pyo3::prelude::*;
use rayfold_scene::{Code, Diagnostic as SceneDiagnostic, Severity};

pyo3::import_exception!(rayfold._errors, SceneError);

/// An error or a warning about a script, with its place.
#[pyclass(frozen, module = "rayfold")]
pub(crate) struct Diagnostic(pub(crate) SceneDiagnostic);

#[pymethods]
impl Diagnostic {
    /// `"error"` or `"warning"`.
    #[getter]
    fn severity(&self) -> &'static str {
        match self.0.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }

    /// The kind of the fault, such as `"invalid-value"`. Unlike the message, it is stable.
    #[getter]
    fn code(&self) -> String {
        kebab(self.0.code)
    }

    /// The name of the script.
    #[getter]
    fn file(&self) -> &str {
        &self.0.file
    }

    /// The line, from 1.
    #[getter]
    fn line(&self) -> usize {
        self.0.line
    }

    /// The column of the first character, from 1.
    #[getter]
    fn column(&self) -> usize {
        self.0.column
    }

    /// The first byte and the end in the script's UTF-8 text.
    #[getter]
    fn span(&self) -> (usize, usize) {
        (self.0.span.start, self.0.span.end)
    }

    /// The description of the problem.
    #[getter]
    fn message(&self) -> &str {
        &self.0.message
    }

    /// The correct text in its place, if it is known.
    #[getter]
    fn expected(&self) -> Option<&str> {
        self.0.expected.as_deref()
    }

    /// Advice for a correction, if there is one.
    #[getter]
    fn help(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    fn __str__(&self) -> String {
        self.0.render(false)
    }

    fn __repr__(&self) -> String {
        let SceneDiagnostic { file, line, column, message, .. } = &self.0;
        format!("<rayfold.Diagnostic {file}:{line}:{column}: {message}>")
    }
}

/// Returns a code in the spelling of `rayfold check --format json`.
fn kebab(code: Code) -> String {
    let mut name = String::new();
    for c in format!("{code:?}").chars() {
        if c.is_ascii_uppercase() && !name.is_empty() {
            name.push('-');
        }
        name.push(c.to_ascii_lowercase());
    }
    name
}

/// Makes the exception of faulty scripts.
pub(crate) fn scene_error(py: Python<'_>, diagnostics: Vec<SceneDiagnostic>) -> PyErr {
    let diagnostics: PyResult<Vec<_>> = diagnostics
        .into_iter()
        .map(|diagnostic| Bound::new(py, Diagnostic(diagnostic)).map(Bound::unbind))
        .collect();
    match diagnostics {
        Ok(diagnostics) => SceneError::new_err((diagnostics,)),
        Err(error) => error,
    }
}

/// Makes the exception of a file that cannot be written.
pub(crate) fn os_error(error: rayfold_files::Error) -> PyErr {
    let source = error.source().map(|source| format!(": {source}")).unwrap_or_default();
    PyOSError::new_err(format!("{error}{source}"))
}

/// Runs `work`, and makes an exception of a panic, which is a bug of this package.
///
/// # Errors
/// Fails if there was a panic.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|_| bug())
}

/// Returns the exception of a bug.
pub(crate) fn bug() -> PyErr {
    PyRuntimeError::new_err("rayfold ran into a bug of its own; the lines above say where")
}
