//! Numbers: the lanes of a machine, exact arithmetic, and bounds on rounding errors.
//!
//! In: numbers in `f32` or `f64`. Out: the same operations for all widths, signs of exact sums, and the bounds that the
//! other folders use. Read [`real`] first.

pub(crate) mod dispatch;
pub(crate) mod exact;
pub(crate) mod real;
pub(crate) mod rounding;
