//! A path: what a packet meets, what lights it, and the rays that go on from there.
//!
//! In: a queue of rays and a prepared scene. Out: the colours that the rays bring. Read [`surfaces`] first.

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
