//! The results of a hard case: figures with their bounds.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::backends::{Arithmetic, Backend};

/// The amount that is measured of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Size {
    /// Takes seconds for all cases together.
    Quick,
    /// The size for the report.
    Full,
}

impl Size {
    pub(super) fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Quick => "quick",
            Self::Full => "full",
        })
    }
}

/// A measurement.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Figure {
    /// The backend that was measured.
    pub backend: String,
    /// The measured quantity, with its unit.
    pub what: String,
    /// The number of rays, pixels or inputs that were measured.
    pub samples: usize,
    /// The worst error or the count; NaN is a failure.
    pub measured: f64,
    /// The largest allowed value; `None` if nothing is promised.
    pub bound: Option<f64>,
}

impl Figure {
    /// Returns whether the value is within the bound.
    pub fn passes(&self) -> bool {
        self.bound.is_none_or(|bound| self.measured <= bound)
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.passes() { "ok  " } else { "FAIL" };
        write!(f, "{verdict} {:24} {}: {:.3e}", self.backend, self.what, self.measured)?;
        match self.bound {
            Some(bound) => write!(f, " <= {bound:.1e}")?,
            None => write!(f, " (no bound)")?,
        }
        write!(f, " of {}", self.samples)
    }
}

/// Collects the figures of a case.
#[derive(Debug, Default)]
pub(super) struct Figures(pub(super) Vec<Figure>);

impl Figures {
    pub(super) fn add(
        &mut self,
        backend: &Backend,
        what: impl Into<String>,
        samples: usize,
        measured: f64,
        bound: impl Into<Option<f64>>,
    ) {
        let (backend, what, bound) = (backend.name.clone(), what.into(), bound.into());
        self.0.push(Figure { backend, what, samples, measured, bound });
    }
}

/// Returns the larger number, NaN if either is NaN.
pub(super) fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Returns the bound for backends that choose their arithmetic or use `f64`. Backends forced to `f32` have none: their
/// figures are only shown.
pub(super) fn unless_single(backend: &Backend, bound: f64) -> Option<f64> {
    (backend.arithmetic != Arithmetic::Single).then_some(bound)
}
