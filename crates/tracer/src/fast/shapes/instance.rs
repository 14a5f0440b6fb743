//! Objects of groups, placed into the world.
//!
//! Turned by right angles a box stays one along the axes; turned otherwise it has axes of its own, and is a
//! [body](crate::fast::bodies). Everything else stays what it is. A triangle has an area if it has one in its group,
//! whatever rounding makes of it.

use glam::DVec3;
use rayfold_scene::{
    Cone, Cuboid, Cylinder, Disc, Instance, Object, Placement, Plane, Sphere, Torus, Triangle,
};

use crate::fast::parts::BUILT;
use crate::reference::triangle_normal;

/// Whether the axes stay along axes.
fn turns_axes_to_axes(placement: &Placement) -> bool {
    placement.rotation().to_cols_array().iter().all(|x| *x == 0.0 || x.abs() == 1.0)
}

/// The group's box, if it stands askew in the world.
pub(in crate::fast) fn turned_box(instance: &Instance) -> Option<&Cuboid> {
    if !BUILT.groups {
        return None;
    }
    match instance.object() {
        Object::Cuboid(cuboid) if !turns_axes_to_axes(instance.placement()) => Some(cuboid),
        Object::Cuboid(_)
        | Object::Sphere(_)
        | Object::Triangle(_)
        | Object::Plane(_)
        | Object::Disc(_)
        | Object::Cylinder(_)
        | Object::Cone(_)
        | Object::Torus(_)
        | Object::Instance(_) => None,
    }
}

/// The object as one of the world; none for a [`turned_box`], and if it can never be hit.
pub(in crate::fast) fn in_world(instance: &Instance) -> Option<Object> {
    if !BUILT.groups {
        return None;
    }
    let placement = instance.placement();
    let material = instance.material().clone();
    let (scale, rotation) = (placement.scale(), placement.rotation());
    let place = |point| placement.point(point);
    let moved = match instance.object() {
        Object::Sphere(o) => Sphere::new(scale * o.radius(), place(o.center()), material).map(Object::from),
        Object::Triangle(o) => {
            if triangle_normal(o.vertices()) == DVec3::ZERO {
                return None;
            }
            Triangle::new(o.vertices().map(place), material).map(Object::from)
        }
        Object::Cuboid(o) => {
            if turned_box(instance).is_some() {
                return None;
            }
            Cuboid::new(o.corners().map(place), material).map(Object::from)
        }
        Object::Plane(o) => Plane::new(place(o.point()), rotation * o.normal(), material).map(Object::from),
        Object::Disc(o) => {
            let (radius, normal) = (scale * o.radius(), rotation * o.normal());
            Disc::new(radius, place(o.center()), normal, material).map(Object::from)
        }
        Object::Cylinder(o) => {
            Cylinder::new(scale * o.radius(), o.ends().map(place), material).map(Object::from)
        }
        Object::Cone(o) => {
            let radii = o.radii().map(|radius| scale * radius);
            Cone::new(radii, o.ends().map(place), material).map(Object::from)
        }
        Object::Torus(o) => {
            let (radius, thickness) = (scale * o.radius(), scale * o.thickness());
            Torus::new(radius, thickness, place(o.center()), rotation * o.normal(), material)
                .map(Object::from)
        }
        Object::Instance(_) => return None,
    };
    // What is too small or too far for any number is not seen.
    moved.ok()
}
