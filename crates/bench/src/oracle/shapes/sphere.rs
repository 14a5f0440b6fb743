//! Spheres.

use glam::DVec3;
use rayfold_scene::Sphere;

use super::Shape;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

impl Shape for Sphere {
    fn extent(&self) -> f64 {
        self.center().abs().max_element() + self.radius()
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let (a, b, discriminant) = quadratic(self, line);
        if discriminant.sign() < 0 {
            return None;
        }
        if power(self, line).sign() == 0 {
            // From a point of the sphere itself one root is zero, which the other formula would round.
            return Some((-&b.shifted(1)).over(&a)).filter(|t| t > start);
        }
        let root = discriminant.root();
        let near = (&-&b - &root).over(&a);
        if near > *start { Some(near) } else { Some((&-&b + &root).over(&a)).filter(|far| far > start) }
    }

    fn outward(&self, line: &Line, t: &Real) -> Vector {
        line.origin.minus(&self.center().into()).plus(t, &line.direction).unit()
    }

    fn face(&self, _: &Line, _: &Real) -> Option<(usize, f64)> {
        None
    }
}

/// Returns `|o-c|² - r²`.
fn power(sphere: &Sphere, line: &Line) -> Real {
    let m = line.origin.minus(&sphere.center().into());
    let radius = Real::from(sphere.radius());
    &m.dot(&m) - &(&radius * &radius)
}

/// Returns a, b and b² - a·c of `a·t² + 2·b·t + c = 0`.
fn quadratic(sphere: &Sphere, line: &Line) -> (Real, Real, Real) {
    let m = line.origin.minus(&sphere.center().into());
    let a = line.direction.dot(&line.direction);
    let b = m.dot(&line.direction);
    let discriminant = &(&b * &b) - &(&a * &power(sphere, line));
    (a, b, discriminant)
}

/// Returns the distance at which the line passes outside the sphere, in world units. It is negative if the line hits
/// the sphere.
pub fn sphere_clearance(sphere: &Sphere, origin: DVec3, direction: DVec3) -> f64 {
    let line = Line { origin: origin.into(), direction: direction.into() };
    let (a, _, discriminant) = quadratic(sphere, &line);
    // The distance q of the line from the centre has q² = r² - discriminant / a.
    let radius = Real::from(sphere.radius());
    let closest = (&(&radius * &radius) - &discriminant.over(&a)).root();
    (&closest - &radius).to_f64()
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::oracle::nearest;

    fn t(object: &Object, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        nearest(std::slice::from_ref(object), origin.into(), direction.into()).map(|hit| hit.t.to_f64())
    }

    fn sphere(radius: f64, center: [f64; 3]) -> Sphere {
        Sphere::new(radius, center.into(), Material::default()).unwrap()
    }

    #[test]
    fn a_sphere_gives_the_root_in_front() {
        let ball = Object::from(sphere(5.0, [0.0; 3]));
        assert_eq!(t(&ball, [0.0, 0.0, 9.0], [0.0, 0.0, -2.0]), Some(2.0));
        assert_eq!(t(&ball, [0.0, 0.0, 9.0], [0.0, 0.0, 2.0]), None);
        assert_eq!(t(&ball, [0.0; 3], [0.0, 1.0, 0.0]), Some(5.0));
        assert_eq!(t(&ball, [3.0, 4.0, 0.0], [3.0, 4.0, 0.0]), None);
        assert_eq!(t(&ball, [3.0, 4.0, 0.0], [-3.0, -4.0, 0.0]), Some(2.0));
        assert_eq!(t(&ball, [3.0, 4.0, 0.0], [0.0, 0.0, 1.0]), None);
        assert_eq!(t(&ball, [5.0, 0.0, 9.0], [0.0, 0.0, -1.0]), Some(9.0), "a tangent touches");
        assert_eq!(t(&ball, [5.0 + 1e-15, 0.0, 9.0], [0.0, 0.0, -1.0]), None);
    }

    #[test]
    fn a_sphere_where_f64_loses_every_digit() {
        let far = sphere(1.0, [0.0, 0.0, -1e15]);
        assert_eq!(t(&far.clone().into(), [0.0; 3], [0.0, 0.0, -1.0]), Some(1e15 - 1.0));
        let gap = sphere_clearance(&far, DVec3::new(1.5, 0.0, 0.0), DVec3::NEG_Z);
        assert_eq!(gap, 0.5);
    }
}
