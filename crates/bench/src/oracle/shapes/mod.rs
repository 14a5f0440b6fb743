//! Hits of a line with an object: textbook formulas, decided exactly. One file per shape.

mod capsule;
mod cone;
mod cuboid;
mod disc;
mod instance;
mod mesh;
mod plane;
mod roundbox;
mod sphere;
mod torus;
mod triangle;

use glam::DVec3;
use rayfold_scene::Object;

pub(super) use mesh::{is_of_file, shaded, texture};
pub use sphere::sphere_clearance;
pub use triangle::edge_clearance;

use super::line::Line;
use super::real::{Real, Vector};

/// The interface of a shape to the oracle.
trait Shape {
    /// Returns the largest absolute coordinate.
    fn extent(&self) -> f64;

    /// Returns the first hit beyond `start`, in units of the length of the line's direction.
    fn first(&self, line: &Line, start: &Real) -> Option<Real>;

    /// Returns the outward unit normal at `t`. A shape without an inside may return either of its normals.
    fn outward(&self, line: &Line, t: &Real) -> Vector;

    /// If the part hit at `t` is flat and perpendicular to an axis, returns the axis and the coordinate on it.
    fn face(&self, line: &Line, t: &Real) -> Option<(usize, f64)>;

    /// Returns whether the shape has an inside.
    fn has_inside(&self) -> bool {
        true
    }

    /// Returns the line in the coordinates of the object's numbers.
    fn local(&self, line: &Line) -> Line {
        line.clone()
    }
}

/// Returns the implementation of an object's shape. This is the only place that distinguishes shapes.
fn shape(object: &Object) -> &dyn Shape {
    match object {
        Object::Sphere(sphere) => sphere,
        Object::Triangle(triangle) => triangle,
        Object::Cuboid(cuboid) => cuboid,
        Object::Plane(plane) => plane,
        Object::Disc(disc) => disc,
        Object::Cylinder(cylinder) => cylinder,
        Object::Cone(cone) => cone,
        Object::Torus(torus) => torus,
        Object::Capsule(capsule) => capsule,
        Object::Roundbox(roundbox) => roundbox,
        Object::Instance(instance) => instance,
        Object::Mesh(mesh) => mesh,
    }
}

/// Returns the largest absolute coordinate of all objects.
pub(super) fn extent(objects: &[Object]) -> f64 {
    objects.iter().map(|object| shape(object).extent()).fold(0.0, f64::max)
}

/// Returns the first hit beyond `start`, in units of the length of the line's direction.
pub(super) fn first(object: &Object, line: &Line, start: &Real) -> Option<Real> {
    shape(object).first(line, start)
}

/// Returns the unit normal at `t`, facing the ray, and whether the outward normal had to be reversed for that.
pub(super) fn normal(object: &Object, line: &Line, t: &Real) -> (Vector, bool) {
    let outward = shape(object).outward(line, t);
    if line.direction.dot(&outward).sign() > 0 { (outward.opposite(), true) } else { (outward, false) }
}

/// Returns the hit point in the coordinates of the object's numbers. For a flat part that is perpendicular to an axis,
/// also returns the axis and the coordinate on it.
pub(super) fn place(object: &Object, line: &Line, t: &Real) -> (Vector, Option<(usize, f64)>) {
    let shape = shape(object);
    (shape.local(line).at(t), shape.face(line, t))
}

/// Returns whether an object has an inside.
pub(super) fn has_inside(object: &Object) -> bool {
    shape(object).has_inside()
}

/// Returns `a <= b` for rounded numbers. A rim belongs to the surface that it bounds.
fn is_at_most(a: &Real, b: &Real) -> bool {
    *a <= b + &b.shifted(-400)
}

/// Returns the axis that a direction is parallel to.
fn axis_of(direction: DVec3) -> Option<usize> {
    let along: Vec<usize> = (0..3).filter(|&axis| direction[axis] != 0.0).collect();
    (along.len() == 1).then(|| along[0])
}
