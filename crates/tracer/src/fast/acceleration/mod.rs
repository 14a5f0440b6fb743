//! The objects that a packet may meet: lists by tile and by light, and a tree for the others.
//!
//! In: bounds of placed shapes. Out: candidates, in an order that makes the first hit a near one. Read [`candidates`]
//! first.

pub(crate) mod binned;
pub(crate) mod candidates;
pub(crate) mod descent;
pub(crate) mod hollow;
pub(crate) mod light_buffer;
pub(crate) mod lists;
pub(crate) mod overlap;
pub(crate) mod tree;
