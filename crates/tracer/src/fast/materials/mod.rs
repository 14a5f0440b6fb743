//! Materials beyond ambient, diffuse and mirror: highlights, patterns, glass; and the sky.
//!
//! In: materials of the scene. Out: tables that the steps of [`super::transport`] read. Read [`finish`] first.

mod face_pictures;
pub(crate) mod faces;
pub(crate) mod finish;
pub(crate) mod fog;
pub(crate) mod glass;
pub(crate) mod paths;
pub(crate) mod sky;
