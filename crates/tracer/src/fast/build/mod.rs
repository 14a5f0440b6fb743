//! Before the first pixel: the precision of a scene, the kernel that fits it, and its tables.
//!
//! In: a scene as [`super::placement`] gives it. Out: a `Prepared` scene. Read [`prepare`] first.

pub(crate) mod enclosures;
pub(crate) mod extensions;
pub(crate) mod features;
pub(crate) mod precision;
pub(crate) mod prepare;
pub(crate) mod ties;
