//! Boxes with round edges: six faces, twelve quarters of cylinders and eight eighths of spheres, each tried alone.

use rayfold_scene::Roundbox;

use super::Shape;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

/// A part of the surface: for each axis -1 or 1 where it is beyond the core, and 0 where it is within.
type Part = [i32; 3];

/// A coordinate of the line beyond a face of the core, counted outwards, and how it grows along the line.
struct Beyond {
    place: Real,
    direction: Real,
}

impl Shape for Roundbox {
    fn extent(&self) -> f64 {
        self.corners().iter().map(|v| v.abs().max_element()).fold(0.0, f64::max)
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let hits = parts().flat_map(|part| roots(self, line, part).into_iter().map(move |t| (t, part)));
        let met = hits.filter(|(t, part)| t > start && part_at(self, line, t, *part));
        met.map(|(t, _)| t).reduce(|a, b| if b < a { b } else { a })
    }

    fn outward(&self, line: &Line, t: &Real) -> Vector {
        let point = line.at(t);
        Vector([0, 1, 2].map(|axis| {
            let (middle, half) = core(self, axis);
            let over = &point.0[axis] - &middle;
            if over > half {
                &over - &half
            } else if over < -&half {
                &over + &half
            } else {
                Real::zero()
            }
        }))
        .unit()
    }

    fn face(&self, line: &Line, t: &Real) -> Option<(usize, f64)> {
        let outward = self.outward(line, t);
        let beyond: Vec<usize> = (0..3).filter(|&axis| outward.0[axis].sign() != 0).collect();
        let [axis] = beyond[..] else { return None };
        let is_high = outward.0[axis].sign() > 0;
        Some((axis, if is_high { self.max()[axis] } else { self.min()[axis] }))
    }
}

fn parts() -> impl Iterator<Item = Part> {
    (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]).filter(|part| *part != [0; 3])
}

/// Returns the middle of the core along an axis, and half of its length.
fn core(roundbox: &Roundbox, axis: usize) -> (Real, Real) {
    let (low, high) = (Real::from(roundbox.min()[axis]), Real::from(roundbox.max()[axis]));
    let half = &(&high - &low).shifted(-1) - &Real::from(roundbox.radius());
    ((&low + &high).shifted(-1), if half.sign() < 0 { Real::zero() } else { half })
}

/// Returns the distances at which the line is as far from the part's faces of the core as the radius.
fn roots(roundbox: &Roundbox, line: &Line, part: Part) -> Vec<Real> {
    let beyond: Vec<Beyond> = (0..3)
        .filter(|&axis| part[axis] != 0)
        .map(|axis| {
            let (middle, half) = core(roundbox, axis);
            let (place, direction) = (&line.origin.0[axis] - &middle, line.direction.0[axis].clone());
            if part[axis] > 0 {
                Beyond { place: &place - &half, direction }
            } else {
                Beyond { place: &-&place - &half, direction: -&direction }
            }
        })
        .collect();
    let sum = |of: &dyn Fn(&Beyond) -> Real| beyond.iter().fold(Real::zero(), |sum, b| &sum + &of(b));
    let radius = Real::from(roundbox.radius());
    let a = sum(&|b| &b.direction * &b.direction);
    let b = sum(&|b| &b.place * &b.direction);
    let c = &sum(&|b| &b.place * &b.place) - &(&radius * &radius);
    if a.sign() == 0 {
        return Vec::new();
    }
    Real::roots(&a, &b, &c)
}

/// Returns whether the point at `t` is on the same sides of the core as the part. A seam belongs to the parts on both
/// sides.
fn part_at(roundbox: &Roundbox, line: &Line, t: &Real, part: Part) -> bool {
    let point = line.at(t);
    (0..3).all(|axis| {
        let (middle, half) = core(roundbox, axis);
        let hair = (&Real::from(roundbox.radius()) + &half).shifted(-400);
        let over = &point.0[axis] - &middle;
        match part[axis] {
            0 => over <= &half + &hair && over >= -&(&half + &hair),
            side if side > 0 => over >= &half - &hair,
            _ => over <= &hair - &half,
        }
    })
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object, Sphere};

    use glam::DVec3;

    use super::*;
    use crate::oracle::nearest;

    fn hit(object: &Object, origin: [f64; 3], direction: [f64; 3]) -> Option<(f64, DVec3)> {
        nearest(std::slice::from_ref(object), origin.into(), direction.into())
            .map(|hit| (hit.t.to_f64(), hit.normal.to_dvec3()))
    }

    fn roundbox(half: [f64; 3], radius: f64) -> Object {
        let half = DVec3::from(half);
        Roundbox::new([half, -half], radius, Material::default()).unwrap().into()
    }

    #[test]
    fn a_round_box_has_faces_edges_and_corners() {
        let soap = roundbox([4.0, 3.0, 7.0], 2.0);
        assert_eq!(hit(&soap, [9.0, 1.0, 5.0], [-1.0, 0.0, 0.0]), Some((5.0, DVec3::X)), "at a seam");
        assert_eq!(hit(&soap, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), Some((7.0, DVec3::NEG_Z)), "from within");
        // 1.2² + 1.6² = 2².
        assert_eq!(hit(&soap, [9.0, 2.2, 0.0], [-1.0, 0.0, 0.0]).map(|hit| hit.0), Some(5.4), "an edge");
        assert_eq!(hit(&soap, [9.0, 3.0, 0.0], [-1.0, 0.0, 0.0]), Some((7.0, DVec3::Y)), "a tangent");
        assert_eq!(hit(&soap, [9.0, 3.0 + 1e-15, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(hit(&soap, [9.0, 2.9, 6.9], [-1.0, 0.0, 0.0]), None, "past a corner");
    }

    #[test]
    fn a_cube_with_half_of_its_side_is_a_ball() {
        let ball = Object::from(Sphere::new(2.0, DVec3::ZERO, Material::default()).unwrap());
        let (round, mut rng) = (roundbox([2.0; 3], 2.0), fastrand::Rng::with_seed(41));
        for _ in 0..200 {
            let mut random = || [rng.f64() * 2.0 - 1.0, rng.f64() * 2.0 - 1.0, rng.f64() * 2.0 - 1.0];
            let (origin, direction) = (random().map(|x| 4.0 * x), random());
            assert_eq!(hit(&round, origin, direction), hit(&ball, origin, direction));
        }
    }
}
