//! Objects of groups, placed into the world.
//!
//! A box, with sharp or round edges, that is rotated by right angles is still aligned with the axes. With any other
//! rotation it has axes of its own, and is a [body](crate::fast::bodies). Every other shape keeps its kind. A triangle
//! has an area if it has one in its group, regardless of rounding.

use glam::DVec3;
use rayfold_scene::{Instance, Object, Outline};

use crate::parts::BUILT;
use crate::reference::{triangle_normal, turns_axes_to_axes};

/// Returns the group's box, with sharp or round edges, if its rotation in the world is not by right angles.
pub(in crate::fast) fn turned(instance: &Instance) -> Option<&Object> {
    let object = instance.object();
    let is_turned = BUILT.groups
        && matches!(object.outline(), Some(Outline::Box { .. }))
        && !turns_axes_to_axes(instance.placement());
    is_turned.then_some(object)
}

/// Returns the object as one of the world, or `None` for a box that is [`turned`] and for an object that can never be hit.
pub(in crate::fast) fn in_world(instance: &Instance) -> Option<Object> {
    if !BUILT.groups {
        return None;
    }
    let is_left_out = match instance.object() {
        Object::Triangle(triangle) => triangle_normal(triangle.vertices()) == DVec3::ZERO,
        _ => turned(instance).is_some(),
    };
    if is_left_out {
        return None;
    }
    // An object that is too small or too far away for its numbers is invisible.
    instance.object().moved(instance.placement(), instance.material().clone()).ok()
}
