//! Rays: packets of them, their queues, and bounds that are tested before shapes.
//!
//! In: the camera's axes. Out: packets of rays, queues of rays, and boxes and cones that show which rays certainly
//! miss. Read [`packet`] first.

pub(crate) mod bounce;
pub(crate) mod bounding_cone;
pub(crate) mod bounds;
pub(crate) mod kind;
pub(crate) mod packet;
pub(crate) mod pixels;
pub(crate) mod placed;
pub(crate) mod predicate;
pub(crate) mod view;
