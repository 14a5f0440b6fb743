//! What a hard case finds out: figures with their bounds.

use std::fmt;

use crate::backends::{Arithmetic, Backend};

/// How much of a case is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Seconds for all cases together.
    Quick,
    /// What the report shows.
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

/// One measurement.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The backend that was measured.
    pub backend: String,
    /// What was measured, with its unit.
    pub what: String,
    /// How many rays, pixels or inputs the figure stands for.
    pub samples: usize,
    /// The worst or the count found; not a number is a failure.
    pub measured: f64,
    /// What it may be at most; `None` where nothing is promised.
    pub bound: Option<f64>,
}

impl Figure {
    /// Whether the bound is kept.
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

/// The larger; not a number wins.
pub(super) fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// A bound for those that choose their arithmetic or use `f64`; `f32` by force is only shown.
pub(super) fn unless_single(backend: &Backend, bound: f64) -> Option<f64> {
    (backend.arithmetic != Arithmetic::Single).then_some(bound)
}
