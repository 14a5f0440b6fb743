//! Where a line meets an object: textbook formulas, decided exactly. A shape is a file.

mod cuboid;
mod sphere;
mod triangle;

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

    /// The unit normal at `t`, on either side.
    fn normal(&self, line: &Line, t: &Real) -> Vector;
}

/// The one place that tells shapes apart.
fn shape(object: &Object) -> &dyn Shape {
    match object {
        Object::Sphere(sphere) => sphere,
        Object::Triangle(triangle) => triangle,
        Object::Cuboid(cuboid) => cuboid,
        Object::Plane(_)
        | Object::Disc(_)
        | Object::Cylinder(_)
        | Object::Cone(_)
        | Object::Torus(_)
        | Object::Instance(_) => unreachable!("the oracle is not asked about {object:?}"),
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

/// The unit normal at `t`, facing the ray.
pub(super) fn normal(object: &Object, line: &Line, t: &Real) -> Vector {
    let normal = shape(object).normal(line, t);
    if line.direction.dot(&normal).sign() > 0 { normal.opposite() } else { normal }
}
