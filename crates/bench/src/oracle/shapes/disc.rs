//! Discs.

use rayfold_scene::Disc;

use super::plane::crossing;
use super::{Shape, is_at_most};
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

impl Shape for Disc {
    fn extent(&self) -> f64 {
        self.center().abs().max_element() + self.radius()
    }

    fn has_inside(&self) -> bool {
        false
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let center = self.center().into();
        let t = crossing(line, &center, &self.normal().into())?;
        let aside = line.at(&t).minus(&center);
        let radius = Real::from(self.radius());
        (t > *start && is_at_most(&aside.dot(&aside), &(&radius * &radius))).then_some(t)
    }

    fn outward(&self, _: &Line, _: &Real) -> Vector {
        Vector::from(self.normal()).unit()
    }

    fn face(&self, _: &Line, _: &Real) -> Option<(usize, f64)> {
        super::axis_of(self.normal()).map(|axis| (axis, self.center()[axis]))
    }
}
