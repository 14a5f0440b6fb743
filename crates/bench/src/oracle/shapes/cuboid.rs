//! Axis-aligned boxes.

use glam::DVec3;
use rayfold_scene::Cuboid;

use super::Shape;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

impl Shape for Cuboid {
    fn extent(&self) -> f64 {
        self.corners().iter().map(|v| v.abs().max_element()).fold(0.0, f64::max)
    }

    fn has_inside(&self) -> bool {
        (0..3).all(|axis| self.min()[axis] < self.max()[axis])
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let [enter, leave] = slabs(self, line)?.map(|(at, _)| at.value());
        if enter > *start { Some(enter) } else { (leave > *start).then_some(leave) }
    }

    /// On an edge the normal is that of the first axis whose face leads to the edge. A rectangle always has its own
    /// normal.
    fn outward(&self, line: &Line, t: &Real) -> Vector {
        let Some((axis, entering)) = met(self, line, t) else { return DVec3::ZERO.into() };
        let upwards = (line.direction.0[axis].sign() > 0) != entering;
        if upwards { DVec3::AXES[axis].into() } else { (-DVec3::AXES[axis]).into() }
    }

    fn face(&self, line: &Line, t: &Real) -> Option<(usize, f64)> {
        let (axis, entering) = met(self, line, t)?;
        let upwards = (line.direction.0[axis].sign() > 0) != entering;
        Some((axis, if upwards { self.max()[axis] } else { self.min()[axis] }))
    }
}

/// Returns the axis of the face that is hit at `t`, and whether the line enters there.
fn met(cuboid: &Cuboid, line: &Line, t: &Real) -> Option<(usize, bool)> {
    let [(enter, first), (_, last)] = slabs(cuboid, line)?;
    let mut flat = (0..3).filter(|&axis| cuboid.min()[axis] == cuboid.max()[axis]);
    let rectangle = flat.next().filter(|_| flat.next().is_none());
    let first = rectangle.filter(|&axis| line.direction.0[axis].sign() != 0).unwrap_or(first);
    Some(if (&enter.value() - t).sign() == 0 { (first, true) } else { (last, false) })
}

/// A quotient that is compared without a division. The divisor is positive.
#[derive(Clone)]
struct Fraction {
    over: Real,
    under: Real,
}

impl Fraction {
    fn new(over: Real, under: &Real) -> Self {
        if under.sign() < 0 {
            Self { over: -&over, under: -under }
        } else {
            Self { over, under: under.clone() }
        }
    }

    fn exceeds(&self, other: &Self) -> bool {
        &self.over * &other.under > &other.over * &self.under
    }

    fn value(&self) -> Real {
        self.over.over(&self.under)
    }
}

/// Returns the distances at which the line enters and leaves the closed box, each with its axis.
fn slabs(cuboid: &Cuboid, line: &Line) -> Option<[(Fraction, usize); 2]> {
    let mut enter: Option<(Fraction, usize)> = None;
    let mut leave: Option<(Fraction, usize)> = None;
    for axis in 0..3 {
        let (o, d) = (&line.origin.0[axis], &line.direction.0[axis]);
        let (min, max) = (Real::from(cuboid.min()[axis]), Real::from(cuboid.max()[axis]));
        if d.sign() == 0 {
            if *o < min || *o > max {
                return None;
            }
            continue;
        }
        let (near, far) = if d.sign() > 0 { (&min, &max) } else { (&max, &min) };
        let (near, far) = (Fraction::new(near - o, d), Fraction::new(far - o, d));
        if enter.as_ref().is_none_or(|(at, _)| near.exceeds(at)) {
            enter = Some((near, axis));
        }
        if leave.as_ref().is_none_or(|(at, _)| at.exceeds(&far)) {
            leave = Some((far, axis));
        }
    }
    let (enter, leave) = (enter?, leave?);
    (!enter.0.exceeds(&leave.0)).then_some([enter, leave])
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::oracle::nearest;

    fn t(object: &Object, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        nearest(std::slice::from_ref(object), origin.into(), direction.into()).map(|hit| hit.t.to_f64())
    }

    #[test]
    fn a_box_owns_its_faces_edges_and_corners() {
        let corners = [DVec3::splat(-1.0), DVec3::splat(1.0)];
        let object = Object::Cuboid(Cuboid::new(corners, Material::default()).unwrap());
        assert_eq!(t(&object, [1.0, 0.0, 4.0], [-0.0, 0.0, -1.0]), Some(3.0));
        assert_eq!(t(&object, [3.0, 3.0, 3.0], [-1.0, -1.0, -1.0]), Some(2.0));
        assert_eq!(t(&object, [1.0 + 1e-15, 0.0, 4.0], [0.0, 0.0, -1.0]), None);
        assert_eq!(t(&object, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]), Some(2.0), "from a face inwards");
        assert_eq!(t(&object, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), None, "from a face outwards");
        // An edge at a third, which is no binary fraction.
        assert!(t(&object, [2.0, 2.0 - 3.0, 0.1], [-1.0, 2.0, 0.0]).is_some());
    }
}
