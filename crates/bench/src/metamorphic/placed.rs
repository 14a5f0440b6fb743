//! Objects that are moved, turned by right angles and scaled, with numbers that are computed here. Groups are compared
//! with them.
//!
//! This module does not know how the tracer expands groups.

use anyhow::{Result, ensure};
use glam::{DMat3, DVec3};
use rayfold_scene::{Motion, Object, Placement};

/// The rotations of a cube.
pub(super) fn right_turns() -> Vec<DMat3> {
    let mut turns = Vec::new();
    for x in signed_axes() {
        for y in signed_axes() {
            if x.dot(y) == 0.0 {
                turns.push(DMat3::from_cols(x, y, x.cross(y)));
            }
        }
    }
    turns
}

fn signed_axes() -> [DVec3; 6] {
    [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z]
}

/// Returns t + s·R·p.
pub(super) fn place(placement: &Placement, p: DVec3) -> DVec3 {
    placement.translation() + placement.scale() * turn(placement, p)
}

/// R·p.
pub(super) fn turn(placement: &Placement, p: DVec3) -> DVec3 {
    let rotation = placement.rotation();
    // No sum rounds: each has one term that is not 0.
    rotation.x_axis * p.x + rotation.y_axis * p.y + rotation.z_axis * p.z
}

/// Returns an object after a placement by right angles.
///
/// # Errors
/// Fails for an instance, or if a number leaves its range.
pub(super) fn written_out(object: &Object, by: &Placement) -> Result<Object> {
    ensure!(!matches!(object, Object::Instance(_)), "an object of a group");
    Ok(object.moved(&WrittenOut(by), object.material().clone())?)
}

/// A placement by right angles that is applied to the numbers of an object.
struct WrittenOut<'a>(&'a Placement);

impl Motion for WrittenOut<'_> {
    fn point(&self, position: DVec3) -> DVec3 {
        place(self.0, position)
    }

    fn direction(&self, direction: DVec3) -> DVec3 {
        turn(self.0, direction)
    }

    fn length(&self, length: f64) -> f64 {
        self.0.scale() * length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_has_24_rotations() {
        let turns = right_turns();
        assert_eq!(turns.len(), 24);
        assert!(turns.iter().all(|turn| turn.determinant() == 1.0));
        assert!(turns.iter().enumerate().all(|(k, turn)| !turns[..k].contains(turn)));
    }
}
