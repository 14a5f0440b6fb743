//! The lights of a scene: each kind of light has a file.
//!
//! A sun's shadow rays all have one direction. So the constants of its tests are computed once for that direction, and
//! its possible occluders are found on its screen. A lamp shares none of that. Its shadow ray is a
//! [`Ray`](crate::fast::rays::packet::Ray) like a reflected one, and any hit before its end occludes.

pub(super) mod lamp;
pub(super) mod sun;
