//! A path: the first hits of a packet, the light there, and the rays that go on from there.
//!
//! In: a queue of rays and a prepared scene. Out: the colours of the rays. Read [`surfaces`] first.

pub(crate) mod hulls;
pub(crate) mod light;
pub(crate) mod path_queue;
pub(crate) mod paths;
pub(crate) mod ray_queue;
pub(crate) mod scatter;
pub(crate) mod search;
pub(crate) mod settle;
pub(crate) mod soft_light;
pub(crate) mod surfaces;
pub(crate) mod transmittance;
