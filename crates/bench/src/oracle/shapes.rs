//! Where a line meets a sphere, a triangle or a box: textbook formulas, decided exactly.

use glam::DVec3;
use rayfold_scene::{Cuboid, Object, Sphere, Triangle};

use super::{Line, Real, Vector};

/// The first hit beyond `start`, in lengths of the line's direction.
pub(super) fn first(object: &Object, line: &Line, start: &Real) -> Option<Real> {
    match object {
        Object::Sphere(sphere) => to_sphere(sphere, line, start),
        Object::Triangle(triangle) => to_triangle(triangle, line).filter(|t| t > start),
        Object::Cuboid(cuboid) => to_cuboid(cuboid, line, start),
    }
}

/// The unit normal at `t`, facing the ray.
pub(super) fn normal(object: &Object, line: &Line, t: &Real) -> Vector {
    let normal = match object {
        Object::Sphere(sphere) => line.origin.minus(&sphere.center().into()).plus(t, &line.direction).unit(),
        Object::Triangle(triangle) => area(triangle).unit(),
        Object::Cuboid(cuboid) => of_cuboid(cuboid, line, t).into(),
    };
    if line.direction.dot(&normal).sign() > 0 { normal.opposite() } else { normal }
}

fn to_sphere(sphere: &Sphere, line: &Line, start: &Real) -> Option<Real> {
    let (a, b, discriminant) = quadratic(sphere, line);
    if discriminant.sign() < 0 {
        return None;
    }
    if power(sphere, line).sign() == 0 {
        // From a point of the sphere itself one root is zero, which the other formula would round.
        return Some((-&b.shifted(1)).over(&a)).filter(|t| t > start);
    }
    let root = discriminant.root();
    let near = (&-&b - &root).over(&a);
    if near > *start { Some(near) } else { Some((&-&b + &root).over(&a)).filter(|far| far > start) }
}

/// `|o-c|² - r²`.
fn power(sphere: &Sphere, line: &Line) -> Real {
    let m = line.origin.minus(&sphere.center().into());
    let radius = Real::from(sphere.radius());
    &m.dot(&m) - &(&radius * &radius)
}

/// a, b and b² - a·c of `a·t² + 2·b·t + c = 0`.
fn quadratic(sphere: &Sphere, line: &Line) -> (Real, Real, Real) {
    let m = line.origin.minus(&sphere.center().into());
    let a = line.direction.dot(&line.direction);
    let b = m.dot(&line.direction);
    let discriminant = &(&b * &b) - &(&a * &power(sphere, line));
    (a, b, discriminant)
}

/// How far the line passes outside the sphere, in world units; negative when it meets the sphere.
pub fn sphere_clearance(sphere: &Sphere, origin: DVec3, direction: DVec3) -> f64 {
    let line = Line { origin: origin.into(), direction: direction.into() };
    let (a, _, discriminant) = quadratic(sphere, &line);
    // The distance q of the line from the centre has q² = r² - discriminant / a.
    let radius = Real::from(sphere.radius());
    let closest = (&(&radius * &radius) - &discriminant.over(&a)).root();
    (&closest - &radius).to_f64()
}

/// Twice the area along the normal.
fn area(triangle: &Triangle) -> Vector {
    let [u, v, w] = triangle.vertices().map(Vector::from);
    v.minus(&u).cross(&w.minus(&u))
}

fn to_triangle(triangle: &Triangle, line: &Line) -> Option<Real> {
    let [u, v, w] = triangle.vertices().map(|vertex| Vector::from(vertex).minus(&line.origin));
    let area = area(triangle);
    let towards = area.dot(&line.direction);
    if towards.sign() == 0 {
        return None;
    }
    let sides = [(&u, &v), (&v, &w), (&w, &u)].map(|(p, q)| line.direction.dot(&p.cross(q)).sign());
    if sides.contains(&-1) && sides.contains(&1) {
        return None;
    }
    Some(area.dot(&u).over(&towards))
}

/// How far from the triangle's outline the line pierces its plane, in world units; `None` for a line in the plane.
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

/// A quotient that is compared without being computed; the divisor is positive.
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

/// Where the line enters and leaves the closed box, each with its axis.
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

fn to_cuboid(cuboid: &Cuboid, line: &Line, start: &Real) -> Option<Real> {
    let [enter, leave] = slabs(cuboid, line)?.map(|(at, _)| at.value());
    if enter > *start { Some(enter) } else { (leave > *start).then_some(leave) }
}

fn of_cuboid(cuboid: &Cuboid, line: &Line, t: &Real) -> DVec3 {
    let axis = slabs(cuboid, line).map(
        |[(enter, first), (_, last)]| {
            if (&enter.value() - t).sign() == 0 { first } else { last }
        },
    );
    axis.map_or(DVec3::ZERO, |axis| DVec3::AXES[axis])
}

#[cfg(test)]
mod tests {
    use rayfold_scene::Material;

    use super::*;
    use crate::oracle::nearest;

    fn t(object: Object, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        nearest(&[object], origin.into(), direction.into()).map(|hit| hit.t.to_f64())
    }

    fn sphere(radius: f64, center: [f64; 3]) -> Object {
        Object::Sphere(Sphere::new(radius, center.into(), Material::default()).unwrap())
    }

    #[test]
    fn a_sphere_gives_the_root_in_front() {
        let ball = sphere(5.0, [0.0; 3]);
        assert_eq!(t(ball, [0.0, 0.0, 9.0], [0.0, 0.0, -2.0]), Some(2.0));
        assert_eq!(t(ball, [0.0, 0.0, 9.0], [0.0, 0.0, 2.0]), None);
        assert_eq!(t(ball, [0.0; 3], [0.0, 1.0, 0.0]), Some(5.0));
        assert_eq!(t(ball, [3.0, 4.0, 0.0], [3.0, 4.0, 0.0]), None);
        assert_eq!(t(ball, [3.0, 4.0, 0.0], [-3.0, -4.0, 0.0]), Some(2.0));
        assert_eq!(t(ball, [3.0, 4.0, 0.0], [0.0, 0.0, 1.0]), None);
        assert_eq!(t(ball, [5.0, 0.0, 9.0], [0.0, 0.0, -1.0]), Some(9.0), "a tangent touches");
        assert_eq!(t(ball, [5.0 + 1e-15, 0.0, 9.0], [0.0, 0.0, -1.0]), None);
    }

    #[test]
    fn a_sphere_where_f64_loses_every_digit() {
        let far = sphere(1.0, [0.0, 0.0, -1e15]);
        assert_eq!(t(far, [0.0; 3], [0.0, 0.0, -1.0]), Some(1e15 - 1.0));
        let Object::Sphere(ball) = far else { panic!("a sphere") };
        let gap = sphere_clearance(&ball, DVec3::new(1.5, 0.0, 0.0), DVec3::NEG_Z);
        assert_eq!(gap, 0.5);
    }

    #[test]
    fn a_triangle_is_closed_and_flat() {
        let vertices = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(DVec3::from);
        let triangle = Triangle::new(vertices, Material::default()).unwrap();
        let object = Object::Triangle(triangle);
        for [x, y] in [[1.0, 1.0], [2.0, 2.0], [0.0, 0.0], [0.0, 3.0], [4.0, 0.0]] {
            assert_eq!(t(object, [x, y, 6.0], [0.0, 0.0, -2.0]), Some(3.0), "at {x}, {y}");
        }
        assert_eq!(t(object, [2.0, 2.0 + 1e-15, 6.0], [0.0, 0.0, -2.0]), None);
        assert_eq!(t(object, [-1.0, 1.0, 0.0], [1.0, 0.0, 0.0]), None);
        let gap = edge_clearance(&triangle, DVec3::new(1.0, 0.25, 6.0), DVec3::NEG_Z);
        assert_eq!(gap, Some(0.25));
    }

    #[test]
    fn a_box_owns_its_faces_edges_and_corners() {
        let corners = [DVec3::splat(-1.0), DVec3::splat(1.0)];
        let object = Object::Cuboid(Cuboid::new(corners, Material::default()).unwrap());
        assert_eq!(t(object, [1.0, 0.0, 4.0], [-0.0, 0.0, -1.0]), Some(3.0));
        assert_eq!(t(object, [3.0, 3.0, 3.0], [-1.0, -1.0, -1.0]), Some(2.0));
        assert_eq!(t(object, [1.0 + 1e-15, 0.0, 4.0], [0.0, 0.0, -1.0]), None);
        assert_eq!(t(object, [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]), Some(2.0), "from a face inwards");
        assert_eq!(t(object, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), None, "from a face outwards");
        // An edge at a third, which no binary fraction is.
        assert!(t(object, [2.0, 2.0 - 3.0, 0.1], [-1.0, 2.0, 0.0]).is_some());
    }
}
