//! Objects moved, turned by right angles and scaled, their numbers worked out here: what groups are compared with.
//!
//! It knows nothing of how the tracer writes groups out.

use anyhow::{Result, bail};
use glam::{DMat3, DVec3};
use rayfold_scene::{
    Cone, Cuboid, Cylinder, Disc, Material, Object, Placement, Plane, Sphere, Torus, Triangle,
};

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

/// t + s·R·p, written out.
pub(super) fn place(placement: &Placement, p: DVec3) -> DVec3 {
    placement.translation() + placement.scale() * turn(placement, p)
}

/// R·p.
pub(super) fn turn(placement: &Placement, p: DVec3) -> DVec3 {
    let rotation = placement.rotation();
    // No sum rounds: each has one term that is not 0.
    rotation.x_axis * p.x + rotation.y_axis * p.y + rotation.z_axis * p.z
}

/// The object where a placement by right angles puts it.
///
/// # Errors
/// When it is an instance, or a number leaves its range.
pub(super) fn written_out(object: &Object, by: &Placement) -> Result<Object> {
    let scale = by.scale();
    let at = |p: DVec3| place(by, p);
    let to = |v: DVec3| turn(by, v);
    let material: Material = object.material().clone();
    Ok(match object {
        Object::Sphere(o) => Sphere::new(scale * o.radius(), at(o.center()), material)?.into(),
        Object::Triangle(o) => Triangle::new(o.vertices().map(at), material)?.into(),
        Object::Cuboid(o) => Cuboid::new(o.corners().map(at), material)?.into(),
        Object::Plane(o) => Plane::new(at(o.point()), to(o.normal()), material)?.into(),
        Object::Disc(o) => Disc::new(scale * o.radius(), at(o.center()), to(o.normal()), material)?.into(),
        Object::Cylinder(o) => Cylinder::new(scale * o.radius(), o.ends().map(at), material)?.into(),
        Object::Cone(o) => Cone::new(o.radii().map(|r| scale * r), o.ends().map(at), material)?.into(),
        Object::Torus(o) => {
            let (radius, thickness) = (scale * o.radius(), scale * o.thickness());
            Torus::new(radius, thickness, at(o.center()), to(o.normal()), material)?.into()
        }
        Object::Instance(_) => bail!("an object of a group"),
    })
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
