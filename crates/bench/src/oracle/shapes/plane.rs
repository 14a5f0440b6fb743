//! Planes.

use rayfold_scene::Plane;

use super::Shape;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

impl Shape for Plane {
    fn extent(&self) -> f64 {
        self.point().abs().max_element()
    }

    fn has_inside(&self) -> bool {
        false
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        crossing(line, &self.point().into(), &self.normal().into()).filter(|t| t > start)
    }

    fn outward(&self, _: &Line, _: &Real) -> Vector {
        Vector::from(self.normal()).unit()
    }

    fn face(&self, _: &Line, _: &Real) -> Option<(usize, f64)> {
        super::axis_of(self.normal()).map(|axis| (axis, self.point()[axis]))
    }
}

/// Returns the distance at which a line crosses a plane; `None` if it is parallel to the plane.
pub(super) fn crossing(line: &Line, point: &Vector, normal: &Vector) -> Option<Real> {
    let towards = line.direction.dot(normal);
    (towards.sign() != 0).then(|| point.minus(&line.origin).dot(normal).over(&towards))
}
