//! Triangles.

use glam::DVec3;
use rayfold_scene::Triangle;

use super::Shape;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

impl Shape for Triangle {
    fn extent(&self) -> f64 {
        self.vertices().iter().map(|v| v.abs().max_element()).fold(0.0, f64::max)
    }

    fn has_inside(&self) -> bool {
        false
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let [u, v, w] = self.vertices().map(|vertex| Vector::from(vertex).minus(&line.origin));
        let area = area(self);
        let towards = area.dot(&line.direction);
        if towards.sign() == 0 {
            return None;
        }
        let sides = [(&u, &v), (&v, &w), (&w, &u)].map(|(p, q)| line.direction.dot(&p.cross(q)).sign());
        if sides.contains(&-1) && sides.contains(&1) {
            return None;
        }
        Some(area.dot(&u).over(&towards)).filter(|t| t > start)
    }

    fn outward(&self, _: &Line, _: &Real) -> Vector {
        area(self).unit()
    }

    fn face(&self, _: &Line, _: &Real) -> Option<(usize, f64)> {
        let [u, v, w] = self.vertices();
        let axis = (0..3).find(|&axis| u[axis] == v[axis] && u[axis] == w[axis])?;
        Some((axis, u[axis]))
    }
}

/// Returns twice the area as a vector along the normal.
fn area(triangle: &Triangle) -> Vector {
    let [u, v, w] = triangle.vertices().map(Vector::from);
    v.minus(&u).cross(&w.minus(&u))
}

/// Returns the distance between the triangle's outline and the point where the line crosses its plane, in world units.
/// Returns `None` for a line in the plane.
pub fn edge_clearance(triangle: &Triangle, origin: DVec3, direction: DVec3) -> Option<f64> {
    let line = Line { origin: origin.into(), direction: direction.into() };
    let area = area(triangle);
    let towards = area.dot(&line.direction);
    if towards.sign() == 0 {
        return None;
    }
    let vertices = triangle.vertices().map(Vector::from);
    let t = area.dot(&vertices[0].minus(&line.origin)).over(&towards);
    let pierced = line.origin.plus(&t, &line.direction);
    (0..3)
        .map(|k| {
            let (from, edge) = (&vertices[k], vertices[(k + 1) % 3].minus(&vertices[k]));
            let to_point = pierced.minus(from);
            let part = to_point.dot(&edge).over(&edge.dot(&edge));
            let part = if part.sign() < 0 { Real::zero() } else { part };
            let part = if part > Real::from(1.0) { Real::from(1.0) } else { part };
            let apart = to_point.plus(&-&part, &edge);
            apart.dot(&apart).root().to_f64()
        })
        .min_by(f64::total_cmp)
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
    fn a_triangle_is_closed_and_flat() {
        let vertices = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(DVec3::from);
        let triangle = Triangle::new(vertices, Material::default()).unwrap();
        let object = Object::Triangle(triangle.clone());
        for [x, y] in [[1.0, 1.0], [2.0, 2.0], [0.0, 0.0], [0.0, 3.0], [4.0, 0.0]] {
            assert_eq!(t(&object, [x, y, 6.0], [0.0, 0.0, -2.0]), Some(3.0), "at {x}, {y}");
        }
        assert_eq!(t(&object, [2.0, 2.0 + 1e-15, 6.0], [0.0, 0.0, -2.0]), None);
        assert_eq!(t(&object, [-1.0, 1.0, 0.0], [1.0, 0.0, 0.0]), None);
        let gap = edge_clearance(&triangle, DVec3::new(1.0, 0.25, 6.0), DVec3::NEG_Z);
        assert_eq!(gap, Some(0.25));
    }
}
