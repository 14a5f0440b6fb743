//! The parts of a picture: the pixels of a tile, and their levels.
//!
//! In: a prepared scene and the place of a tile. Out: pixels of a band. Read [`tile`] first.

pub(crate) mod band;
pub(crate) mod cover;
pub(crate) mod tile;
pub(crate) mod tone;
pub(crate) mod trace;
pub(crate) mod watch;
