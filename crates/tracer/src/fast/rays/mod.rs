//! Rays: what a packet of them is, how it waits, and what it is compared with before any shape is.
//!
//! In: the camera's axes. Out: packets of rays, queues of them, and boxes and cones that miss them for certain. Read
//! [`packet`] first.

pub(crate) mod bounce;
pub(crate) mod bounding_cone;
pub(crate) mod bounds;
pub(crate) mod kind;
pub(crate) mod packet;
pub(crate) mod pixels;
pub(crate) mod placed;
pub(crate) mod predicate;
pub(crate) mod view;
