//! Triangles, with a watertight intersection test.

use glam::{DVec2, DVec3, Vec3Swizzles};
use rayfold_scene::Triangle;
use rayfold_scene::model::unit;

use super::double_double::Place;
use super::{ROUNDOFF, Shape, Sides, Surface};
use crate::camera::Ray;
use crate::scale::below_inverse;

impl Shape for Triangle {
    fn extent(&self, origin: DVec3) -> f64 {
        self.vertices().iter().fold(origin.abs(), |m, v| m.max(v.abs())).max_element()
    }

    /// Returns the distance to the plane, so that a triangle in the plane of a box's face is hit at the face's
    /// distance. The hit test is that of Woop, Benthin, Wald, "Watertight ray/triangle intersection", JCGT 2(1), 2013.
    fn distance(&self, ray: Ray) -> Option<f64> {
        let edges = sheared(self, ray);
        let outside = edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0);
        if outside || edges == [0.0; 3] {
            return None;
        }
        let normal = triangle_normal(self.vertices());
        let [a, b, c] = self.vertices().map(|vertex| vertex - ray.origin);
        let nearest = [b, c].into_iter().fold(a, |n, v| if v.length() < n.length() { v } else { n });
        Some(nearest.dot(normal) / ray.direction.dot(normal))
    }

    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let normal = triangle_normal(self.vertices());
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let corner = self.vertices()[0];
        let near = ray.origin + distance * ray.direction;
        let point = near - (near - corner).dot(normal) * normal;
        // The extent of the triangle along its plane adds no error. So a coordinate does not count if its axis is
        // parallel to the plane.
        let across = DVec3::select(normal.cmpeq(DVec3::ZERO), DVec3::ZERO, DVec3::ONE);
        let here = ray.origin.abs().max(point.abs());
        let largest = self.vertices().iter().fold(here, |m, v| m.max(v.abs() * across)).max_element();
        Surface { point, normal, offset: 32.0 * ROUNDOFF * largest, flat: true, within: false }
    }

    fn sides(&self, _: Place) -> Sides {
        [0.0; 6]
    }

    fn has_inside(&self) -> bool {
        false
    }

    fn is_flat_at(&self, _: DVec3) -> bool {
        true
    }

    fn face(&self, _: DVec3, _: DVec3) -> Option<(usize, f64)> {
        let [u, v, w] = self.vertices();
        let axis = (0..3).find(|&axis| u[axis] == v[axis] && v[axis] == w[axis])?;
        Some((axis, u[axis]))
    }
}

/// Returns the signed areas opposite the vertices, in coordinates where the ray runs from the origin along z.
fn sheared(triangle: &Triangle, ray: Ray) -> [f64; 3] {
    let d = ray.direction;
    let to_ray = |v: DVec3| {
        if d.z.abs() >= d.x.abs() && d.z.abs() >= d.y.abs() {
            v
        } else if d.y.abs() >= d.x.abs() {
            v.zxy()
        } else {
            v.yzx()
        }
    };
    let d = to_ray(d);
    let [a, b, c] = triangle.vertices().map(|vertex| {
        let v = to_ray(vertex - ray.origin);
        DVec2::new(v.x - d.x / d.z * v.z, v.y - d.y / d.z * v.z)
    });
    let area = |p: DVec2, q: DVec2| difference_of_products(p.x, q.y, p.y, q.x);
    [area(b, c), area(c, a), area(a, b)]
}

/// Returns `a·b - c·d` with the products' rounding errors added back. Its sign is right, and swapping the products
/// negates it exactly, so that two triangles evaluate their common edge alike.
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (ab, cd) = (a * b, c * d);
    (ab - cd) + (a.mul_add(b, -ab) - c.mul_add(d, -cd))
}

/// Returns the unit normal of a triangle; zero if the area is only rounding error.
pub(crate) fn triangle_normal(vertices: &[DVec3; 3]) -> DVec3 {
    normal_and_width(vertices).0
}

/// Returns [`triangle_normal`], and the approximate ratio of the triangle's width to its length.
///
/// The normal is accurate to a few roundoffs, even for a needle. The rounding errors of the needle's edges, which are
/// large relative to its width, are added back.
pub(crate) fn normal_and_width(vertices: &[DVec3; 3]) -> (DVec3, f64) {
    let largest = vertices.iter().fold(DVec3::ZERO, |m, v| m.max(v.abs())).max_element();
    let scale = below_inverse(largest);
    let (a, b, c) = (vertices[0] * scale, vertices[1] * scale, vertices[2] * scale);
    let (p, q) = (b - a, c - a);
    let (p_scale, q_scale) = (below_inverse(p.abs().max_element()), below_inverse(q.abs().max_element()));
    let (p, q) = (p * p_scale, q * q_scale);
    let mut normal = DVec3::new(
        difference_of_products(p.y, q.z, p.z, q.y),
        difference_of_products(p.z, q.x, p.x, q.z),
        difference_of_products(p.x, q.y, p.y, q.x),
    );
    let edges = p.length() * q.length();
    if normal.length() < SLIM * edges {
        normal += p.cross(rest(c, a) * q_scale) + (rest(b, a) * p_scale).cross(q);
    }
    let sine = normal.length() / edges;
    let width = sine * (q_scale / p_scale).min(p_scale / q_scale);
    (if sine > 8.0 * ROUNDOFF { unit(normal) } else { DVec3::ZERO }, width)
}

/// The sine of the angle between the edges below which their rounding errors matter.
const SLIM: f64 = 0.25;

/// Returns the rounding error of `a - b` (Knuth).
fn rest(a: DVec3, b: DVec3) -> DVec3 {
    let difference = a - b;
    let of_b = difference - a;
    (a - (difference - of_b)) - (b + of_b)
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::reference::shapes::distance;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn triangle(u: [f64; 3], v: [f64; 3], w: [f64; 3]) -> Object {
        Triangle::new([u.into(), v.into(), w.into()], Material::default()).unwrap().into()
    }

    #[test]
    fn triangles_that_share_an_edge_leave_no_gap() {
        let (p, q) = ([-0.3, -1.7, 0.1], [0.9, 2.3, -0.4]);
        let halves = [triangle(p, q, [-5.0, 1.0, 0.0]), triangle(q, p, [4.0, 0.5, 0.3])];
        for k in 1..1000 {
            let f = f64::from(k) / 1000.0;
            let target = DVec3::from(p).lerp(q.into(), f);
            let eye = DVec3::new(0.3, f, 7.0);
            let r = Ray { origin: eye, direction: (target - eye).normalize() };
            assert!(halves.iter().any(|half| distance(half, r).is_some()), "at {f}");
        }
    }

    #[test]
    fn a_triangle_is_two_sided_and_missed_along_its_plane() {
        let t = triangle([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert_eq!(distance(&t, ray([0.25, 0.25, 1.0], [0.0, 0.0, -1.0])), Some(1.0));
        assert_eq!(distance(&t, ray([0.25, 0.25, -1.0], [0.0, 0.0, 1.0])), Some(1.0));
        assert_eq!(distance(&t, ray([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0])), None);
        assert_eq!(distance(&t, ray([0.75, 0.75, 1.0], [0.0, 0.0, -1.0])), None);
    }

    #[test]
    fn a_triangle_far_from_the_origin_has_its_area() {
        for offset in [0.0, 1e6, 1e12, -1e15] {
            let place = |x: f64, y: f64| [x + offset, y, 3.0 * offset];
            let t = triangle(place(0.0, 0.0), place(1.0, 0.0), place(0.0, 1.0));
            let origin = DVec3::new(0.25 + offset, 0.25, 3.0 * offset + 7.0);
            assert_eq!(distance(&t, Ray { origin, direction: DVec3::NEG_Z }), Some(7.0), "at {offset:e}");
        }
    }

    #[test]
    fn a_triangle_without_area_is_never_hit() {
        let flat = triangle([0.1; 3], [0.2; 3], [0.3; 3]);
        for z in 0..100 {
            let origin = DVec3::new(f64::from(z), -1.0, 5.0);
            let direction = (DVec3::splat(0.15) - origin).normalize();
            assert_eq!(distance(&flat, Ray { origin, direction }), None);
        }
    }
}
