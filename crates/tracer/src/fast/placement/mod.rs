//! A scene as numbers of the kernels: recentred, scaled, and seen from the camera.
//!
//! In: a scene. Out: placed shapes, the window that each of them covers, and the pairs of surfaces that coincide. Read
//! [`geometry`] first.

pub(crate) mod coincidence;
pub(crate) mod geometry;
pub(crate) mod lens;
pub(crate) mod pairs;
pub(crate) mod planes;
pub(crate) mod tile_lists;
pub(crate) mod touching;
pub(crate) mod window;
