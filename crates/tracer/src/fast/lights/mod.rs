//! The lights of a scene: a kind of light is a file.
//!
//! A sun's rays all have one direction, so its tests against shapes are worked out for that direction once, and what can
//! stand in its way is found on its screen. A light that has a place shares none of that: a shadow ray of its own is a
//! [`Ray`](super::packet::Ray) like a mirrored one, and what it meets before its end is in its way.

pub(super) mod buffer;
pub(super) mod lamp;
pub(super) mod sun;
