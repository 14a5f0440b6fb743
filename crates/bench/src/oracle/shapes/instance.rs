//! Objects of groups. In the group's coordinates the line has the same distances.

use rayfold_scene::Instance;

use super::Shape;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

impl Shape for Instance {
    fn extent(&self) -> f64 {
        let placement = self.placement();
        placement.translation().abs().max_element()
            + 3.0 * placement.scale() * super::shape(self.object()).extent()
    }

    fn has_inside(&self) -> bool {
        super::has_inside(self.object())
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        super::shape(self.object()).first(&self.local(line), start)
    }

    fn outward(&self, line: &Line, t: &Real) -> Vector {
        let local = super::shape(self.object()).outward(&self.local(line), t);
        let columns =
            self.placement().rotation().to_cols_array_2d().map(|column| Vector(column.map(Real::from)));
        let nowhere = Vector::from(glam::DVec3::ZERO);
        let [x, y, z] = &local.0;
        nowhere.plus(x, &columns[0]).plus(y, &columns[1]).plus(z, &columns[2]).unit()
    }

    fn face(&self, line: &Line, t: &Real) -> Option<(usize, f64)> {
        super::shape(self.object()).face(&self.local(line), t)
    }

    fn local(&self, line: &Line) -> Line {
        let placement = self.placement();
        let columns = placement.rotation().to_cols_array_2d().map(|column| Vector(column.map(Real::from)));
        let scale = Real::from(placement.scale());
        let turned = |v: &Vector| Vector([0, 1, 2].map(|axis: usize| columns[axis].dot(v).over(&scale)));
        let from = line.origin.minus(&placement.translation().into());
        Line { origin: turned(&from), direction: turned(&line.direction) }
    }
}
