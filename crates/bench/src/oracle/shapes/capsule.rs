//! Capsules: the side of a cylinder and two half spheres.

use glam::DVec3;
use rayfold_scene::Capsule;

use super::Shape;
use super::cone::Round;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

impl Shape for Capsule {
    fn extent(&self) -> f64 {
        let [a, b] = self.ends();
        a.abs().max(b.abs()).max_element() + self.radius()
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let [a, b] = self.ends();
        let ends = [in_ball(line, a, self.radius()), in_ball(line, b, self.radius())];
        let hits: Vec<Real> = if a == b {
            ends[0].clone()
        } else {
            let round = Round::new([self.radius(); 2], [a, b]);
            let side = round.side(line).into_iter().filter(|t| round.is_between_the_ends(&line.at(t)));
            let hair = Real::from(1.0).shifted(-400);
            let [below, above] = ends;
            let below = below.into_iter().filter(|t| round.height(&line.at(t)) <= hair);
            let above = above.into_iter().filter(|t| round.height(&line.at(t)) >= &Real::from(1.0) - &hair);
            side.chain(below).chain(above).collect()
        };
        hits.into_iter().filter(|t| t > start).reduce(|a, b| if b < a { b } else { a })
    }

    fn outward(&self, line: &Line, t: &Real) -> Vector {
        let [a, b] = self.ends();
        let point = line.at(t);
        let from_a = point.minus(&a.into());
        if a == b {
            return from_a.unit();
        }
        let round = Round::new([self.radius(); 2], [a, b]);
        let height = round.height(&point);
        if height <= Real::zero() {
            from_a.unit()
        } else if height >= Real::from(1.0) {
            point.minus(&b.into()).unit()
        } else {
            from_a.plus(&-&height, &Vector::from(b).minus(&a.into())).unit()
        }
    }

    fn face(&self, _: &Line, _: &Real) -> Option<(usize, f64)> {
        None
    }
}

/// Returns where a line enters and leaves a ball.
fn in_ball(line: &Line, center: DVec3, radius: f64) -> Vec<Real> {
    let from_center = line.origin.minus(&center.into());
    let radius = Real::from(radius);
    let a = line.direction.dot(&line.direction);
    let b = from_center.dot(&line.direction);
    let c = &from_center.dot(&from_center) - &(&radius * &radius);
    Real::roots(&a, &b, &c)
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::oracle::nearest;

    #[test]
    fn a_capsule_has_a_side_and_two_round_ends() {
        let ends = [DVec3::ZERO, DVec3::new(0.0, 0.0, 4.0)];
        let pill = Object::Capsule(Capsule::new(5.0, ends, Material::default()).unwrap());
        let hit = |origin: [f64; 3], direction: [f64; 3]| {
            nearest(std::slice::from_ref(&pill), origin.into(), direction.into())
                .map(|hit| (hit.t.to_f64(), hit.normal.to_dvec3()))
        };
        assert_eq!(hit([9.0, 0.0, 2.0], [-1.0, 0.0, 0.0]), Some((4.0, DVec3::X)));
        assert_eq!(hit([0.0, 0.0, 12.0], [0.0, 0.0, -1.0]), Some((3.0, DVec3::Z)));
        assert_eq!(hit([0.0, 3.0, -9.0], [0.0, 0.0, 1.0]), Some((5.0, DVec3::new(0.0, 0.6, -0.8))));
        assert_eq!(hit([0.0, 0.0, 2.0], [0.0, 0.0, 1.0]), Some((7.0, DVec3::NEG_Z)), "from within");
        assert_eq!(hit([5.0, 9.0, 1.0], [0.0, -1.0, 0.0]), Some((9.0, DVec3::X)), "a tangent");
        assert_eq!(hit([5.0 + 1e-15, 9.0, 1.0], [0.0, -1.0, 0.0]), None);
        let ball = Object::Capsule(Capsule::new(5.0, [DVec3::X; 2], Material::default()).unwrap());
        let found = nearest(&[ball], DVec3::new(1.0, 9.0, 0.0), DVec3::NEG_Y).unwrap();
        assert_eq!((found.t.to_f64(), found.normal.to_dvec3()), (4.0, DVec3::Y));
    }
}
