//! Objects of groups, placed into the world.
//!
//! A box that is rotated by right angles stays a box along the axes. Rotated otherwise it has axes of its own, and is a
//! [body](crate::fast::bodies). Every other shape keeps its kind. A triangle has an area if it has one in its group,
//! regardless of rounding.

use glam::DVec3;
use rayfold_scene::{Cuboid, Instance, Object};

use crate::parts::BUILT;
use crate::reference::{triangle_normal, turns_axes_to_axes};

/// Returns the group's box, if it is rotated in the world by other than right angles.
pub(in crate::fast) fn turned_box(instance: &Instance) -> Option<&Cuboid> {
    if !BUILT.groups {
        return None;
    }
    match instance.object() {
        Object::Cuboid(cuboid) if !turns_axes_to_axes(instance.placement()) => Some(cuboid),
        _ => None,
    }
}

/// Returns the object as one of the world, or `None` for a [`turned_box`] and for an object that can never be hit.
pub(in crate::fast) fn in_world(instance: &Instance) -> Option<Object> {
    if !BUILT.groups {
        return None;
    }
    let is_left_out = match instance.object() {
        Object::Triangle(triangle) => triangle_normal(triangle.vertices()) == DVec3::ZERO,
        _ => turned_box(instance).is_some(),
    };
    if is_left_out {
        return None;
    }
    // An object that is too small or too far away for its numbers is invisible.
    instance.object().moved(instance.placement(), instance.material().clone()).ok()
}
