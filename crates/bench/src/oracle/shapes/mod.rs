//! Where a line meets an object: textbook formulas, decided exactly. A shape is a file.

mod cone;
mod cuboid;
mod disc;
mod instance;
mod plane;
mod sphere;
mod torus;
mod triangle;

use glam::DVec3;
use rayfold_scene::Object;

pub use sphere::sphere_clearance;
pub use triangle::edge_clearance;

use super::line::Line;
use super::real::{Real, Vector};

/// What the oracle asks of a shape.
trait Shape {
    /// The largest of its coordinates.
    fn extent(&self) -> f64;

    /// The first hit beyond `start`, in lengths of the line's direction.
    fn first(&self, line: &Line, start: &Real) -> Option<Real>;

    /// The unit normal at `t`, out of the inside; on either side of what has none.
    fn outward(&self, line: &Line, t: &Real) -> Vector;

    /// The axis that the part met at `t` is square to, if it is flat, and its number on that axis.
    fn face(&self, line: &Line, t: &Real) -> Option<(usize, f64)>;

    /// The line in the coordinates of the object's numbers.
    fn local(&self, line: &Line) -> Line {
        line.clone()
    }
}

/// The one place that tells shapes apart.
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
        Object::Instance(instance) => instance,
    }
}

/// The largest coordinate of all objects.
pub(super) fn extent(objects: &[Object]) -> f64 {
    objects.iter().map(|object| shape(object).extent()).fold(0.0, f64::max)
}

/// The first hit beyond `start`, in lengths of the line's direction.
pub(super) fn first(object: &Object, line: &Line, start: &Real) -> Option<Real> {
    shape(object).first(line, start)
}

/// The unit normal at `t`, facing the ray, and whether it comes from the side to which normals point inwards.
pub(super) fn normal(object: &Object, line: &Line, t: &Real) -> (Vector, bool) {
    let outward = shape(object).outward(line, t);
    if line.direction.dot(&outward).sign() > 0 { (outward.opposite(), true) } else { (outward, false) }
}

/// Where an object is met in the coordinates of its numbers, and the axis and number of a flat part that is square to one.
pub(super) fn place(object: &Object, line: &Line, t: &Real) -> (Vector, Option<(usize, f64)>) {
    let shape = shape(object);
    (shape.local(line).at(t), shape.face(line, t))
}

/// Whether an object, by its kind, has an inside.
pub(super) fn has_inside(object: &Object) -> bool {
    match object {
        Object::Sphere(_) | Object::Cylinder(_) | Object::Cone(_) | Object::Torus(_) => true,
        Object::Cuboid(cuboid) => (0..3).all(|axis| cuboid.min()[axis] < cuboid.max()[axis]),
        Object::Triangle(_) | Object::Plane(_) | Object::Disc(_) => false,
        Object::Instance(instance) => has_inside(instance.object()),
    }
}

/// `a <= b` of numbers that are rounded: rims belong to what they bound.
fn is_at_most(a: &Real, b: &Real) -> bool {
    *a <= b + &b.shifted(-400)
}

/// The axis along which a direction runs.
fn axis_of(direction: DVec3) -> Option<usize> {
    let along: Vec<usize> = (0..3).filter(|&axis| direction[axis] != 0.0).collect();
    (along.len() == 1).then(|| along[0])
}
