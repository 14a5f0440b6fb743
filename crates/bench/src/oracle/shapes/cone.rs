//! Cones and cylinders: the quadric that contains the side, and two discs.

use glam::DVec3;
use rayfold_scene::{Cone, Cylinder};

use super::plane::crossing;
use super::{Shape, is_at_most};
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

/// A cone or a cylinder.
pub(super) struct Round {
    radii: [Real; 2],
    ends: [Vector; 2],
    /// The vector from one end to the other, followed by the square of its length.
    axis: Vector,
    square: Real,
}

impl Round {
    pub(super) fn new(radii: [f64; 2], ends: [DVec3; 2]) -> Self {
        let ends = ends.map(Vector::from);
        let axis = ends[1].minus(&ends[0]);
        let square = axis.dot(&axis);
        Self { radii: radii.map(Real::from), ends, axis, square }
    }

    /// Returns the increase of the radius from end to end.
    fn growth(&self) -> Real {
        &self.radii[1] - &self.radii[0]
    }

    /// Returns the height along the axis, from 0 at the first end to 1 at the second.
    pub(super) fn height(&self, point: &Vector) -> Real {
        point.minus(&self.ends[0]).dot(&self.axis).over(&self.square)
    }

    /// Returns the hits of the line with the quadric |(p - a) × v|²·v² = (Ra·v² + (Rb - Ra)·((p - a)·v))².
    pub(super) fn side(&self, line: &Line) -> Vec<Real> {
        let from = line.origin.minus(&self.ends[0]);
        let (turn, start) = (line.direction.cross(&self.axis), from.cross(&self.axis));
        let growth = self.growth();
        let widening = &growth * &line.direction.dot(&self.axis);
        let radius = &(&self.radii[0] * &self.square) + &(&growth * &from.dot(&self.axis));
        let a = &(&turn.dot(&turn) * &self.square) - &(&widening * &widening);
        let b = &(&start.dot(&turn) * &self.square) - &(&radius * &widening);
        let c = &(&start.dot(&start) * &self.square) - &(&radius * &radius);
        let mut roots = Vec::new();
        let discriminant = &(&b * &b) - &(&a * &c);
        if discriminant.sign() >= 0 {
            let root = discriminant.root();
            let q = if b.sign() < 0 { &root - &b } else { &(-&b) - &root };
            if a.sign() != 0 {
                roots.push(q.over(&a));
            }
            if q.sign() != 0 {
                roots.push(c.over(&q));
            }
        }
        roots
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let side = self.side(line).into_iter().filter(|t| self.is_between_the_ends(&line.at(t)));
        let caps = self.ends.iter().zip(&self.radii).filter_map(|(end, radius)| {
            let t = crossing(line, end, &self.axis)?;
            let aside = line.at(&t).minus(end);
            is_at_most(&aside.dot(&aside), &(radius * radius)).then_some(t)
        });
        side.chain(caps).filter(|t| t > start).reduce(|a, b| if b < a { b } else { a })
    }

    pub(super) fn is_between_the_ends(&self, point: &Vector) -> bool {
        let height = self.height(point);
        let hair = Real::from(1.0).shifted(-400);
        height >= -&hair && height <= &Real::from(1.0) + &hair
    }

    /// Returns the end whose cap contains the point, unless the point is on the side too.
    fn cap(&self, point: &Vector) -> Option<usize> {
        let height = self.height(point);
        let aside = point.minus(&self.ends[0]).plus(&-&height, &self.axis);
        let radius = &self.radii[0] + &(&height * &self.growth());
        let (far, near) = (aside.dot(&aside), &radius * &radius);
        let apart = (&far - &near).magnitude();
        let size = &(&near + &self.square) + &far;
        if apart < size.shifted(-280) {
            return None;
        }
        Some(usize::from(height > Real::from(0.5)))
    }

    fn outward(&self, line: &Line, t: &Real) -> Vector {
        let point = line.at(t);
        match self.cap(&point) {
            Some(0) => self.axis.unit().opposite(),
            Some(_) => self.axis.unit(),
            None => {
                // Perpendicular to the side: away from the axis, and against the growth of the radius.
                let height = self.height(&point);
                let aside = point.minus(&self.ends[0]).plus(&-&height, &self.axis);
                let length = aside.dot(&aside).root();
                let size = self.square.root();
                let away = if length < size.shifted(-280) {
                    // At a tip: opposite to the ray.
                    let along = line.direction.dot(&self.axis).over(&self.square);
                    let aside = line.direction.plus(&-&along, &self.axis).opposite();
                    if aside.dot(&aside) < line.direction.dot(&line.direction).shifted(-500) {
                        aside
                    } else {
                        aside.unit()
                    }
                } else {
                    aside.unit()
                };
                away.plus(&-&self.growth().over(&self.square), &self.axis).unit()
            }
        }
    }

    fn face(&self, line: &Line, t: &Real, ends: [DVec3; 2]) -> Option<(usize, f64)> {
        let end = self.cap(&line.at(t))?;
        let differ = ends[0].cmpne(ends[1]);
        let axis = (0..3).find(|&axis| differ.test(axis))?;
        (differ.bitmask().count_ones() == 1).then(|| (axis, ends[end][axis]))
    }
}

fn extent(radii: [f64; 2], ends: [DVec3; 2]) -> f64 {
    ends[0].abs().max(ends[1].abs()).max_element() + radii[0].max(radii[1])
}

macro_rules! round {
    ($shape:ident, $radii:expr) => {
        impl Shape for $shape {
            fn extent(&self) -> f64 {
                extent($radii(self), self.ends())
            }

            fn first(&self, line: &Line, start: &Real) -> Option<Real> {
                Round::new($radii(self), self.ends()).first(line, start)
            }

            fn outward(&self, line: &Line, t: &Real) -> Vector {
                Round::new($radii(self), self.ends()).outward(line, t)
            }

            fn face(&self, line: &Line, t: &Real) -> Option<(usize, f64)> {
                Round::new($radii(self), self.ends()).face(line, t, self.ends())
            }
        }
    };
}

round!(Cone, |cone: &Cone| cone.radii());
round!(Cylinder, |cylinder: &Cylinder| [cylinder.radius(); 2]);

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use crate::oracle::nearest;

    use super::*;

    #[test]
    fn a_cone_has_one_half_a_cap_and_a_tip() {
        let ends = [DVec3::ZERO, DVec3::new(0.0, 2.0, 0.0)];
        let cone = Object::Cone(Cone::new([1.0, 0.0], ends, Material::default()).unwrap());
        let hit = |origin: [f64; 3], direction: [f64; 3]| {
            nearest(std::slice::from_ref(&cone), origin.into(), direction.into())
                .map(|hit| (hit.t.to_f64(), hit.normal.to_dvec3()))
        };
        assert_eq!(hit([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]), Some((3.0, DVec3::Y)));
        assert_eq!(hit([0.5, -5.0, 0.0], [0.0, 1.0, 0.0]), Some((5.0, DVec3::NEG_Y)));
        assert_eq!(hit([5.0, 3.0, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(hit([5.0, 1.0, 0.0], [-1.0, 0.0, 0.0]).map(|hit| hit.0), Some(4.5));
        assert_eq!(hit([2.0, -2.0, 0.0], [-1.0, 2.0, 0.0]).map(|hit| hit.0), Some(1.0), "along its side");
    }

    #[test]
    fn a_rim_is_of_the_side_and_a_tangent_touches() {
        let ends = [DVec3::ZERO, DVec3::new(0.0, 0.0, 4.0)];
        let can = Object::Cylinder(Cylinder::new(5.0, ends, Material::default()).unwrap());
        let hit = |origin: [f64; 3], direction: [f64; 3]| {
            nearest(std::slice::from_ref(&can), origin.into(), direction.into())
                .map(|hit| (hit.t.to_f64(), hit.normal.to_dvec3()))
        };
        assert_eq!(hit([9.0, 0.0, 4.0], [-1.0, 0.0, 0.0]), Some((4.0, DVec3::X)), "in a cap's plane");
        assert_eq!(hit([5.0, 0.0, 9.0], [0.0, 0.0, -1.0]), Some((5.0, DVec3::X)), "along the side");
        assert_eq!(hit([5.0, 9.0, 1.0], [0.0, -1.0, 0.0]), Some((9.0, DVec3::X)), "a tangent");
        assert_eq!(hit([5.0 + 1e-15, 9.0, 1.0], [0.0, -1.0, 0.0]), None);
        assert_eq!(hit([3.0, 4.0, 9.0], [0.0, 0.0, -1.0]).map(|hit| hit.0), Some(5.0), "on a rim");
    }
}
