//! Where a ray meets a sphere, a triangle or a box, and what it finds there.
//!
//! Bounds on rounding errors are multiples of the unit roundoff and of the largest number that took part.

use glam::{DVec2, DVec3, Vec3Swizzles};
use rayfold_scene::model::unit;
use rayfold_scene::{Cuboid, Object, Sphere, Triangle};

use crate::camera::Ray;
use crate::scale::below_inverse;

/// The largest relative error of one rounding.
const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// The surface at a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The hit, brought back onto the object.
    pub point: DVec3,
    /// Unit normal, on the side that the ray came from.
    pub normal: DVec3,
    /// `point + offset * normal` lies outside the object for certain, whatever the rounding.
    pub offset: f64,
}

/// Distance to the nearest hit in front of the origin.
pub(super) fn distance(object: &Object, ray: Ray) -> Option<f64> {
    let (object, ray, scale) = ordinary(object, ray)?;
    // What is not a number hits nothing.
    let distance = match &object {
        Object::Sphere(sphere) => to_sphere(sphere, ray),
        Object::Triangle(triangle) => to_triangle(triangle, ray),
        Object::Cuboid(cuboid) => to_cuboid(cuboid, ray),
    }? / scale;
    (distance > 0.0 && distance.is_finite()).then_some(distance)
}

/// The surface of an object that the ray hits at `distance`.
///
/// # Panics
/// When the ray does not hit the object.
pub(super) fn surface(object: &Object, ray: Ray, distance: f64) -> Surface {
    let Some((object, ray, scale)) = ordinary(object, ray) else {
        unreachable!("the ray hits the object at {distance}")
    };
    let surface = match &object {
        Object::Sphere(sphere) => of_sphere(sphere, ray, distance * scale),
        Object::Triangle(triangle) => of_triangle(triangle, ray, distance * scale),
        Object::Cuboid(cuboid) => of_cuboid(cuboid, ray, distance * scale),
    };
    Surface { point: surface.point / scale, offset: surface.offset / scale, ..surface }
}

/// The largest exponent whose fourth power leaves room for sums of products.
const ORDINARY: i32 = 200;

/// Object and ray in units in which no product overflows or vanishes: the power of two that scales world units to
/// them, 1 for most. `None` for an object that is too small to be seen in the ray's units.
fn ordinary(object: &Object, ray: Ray) -> Option<(Object, Ray, f64)> {
    let extent = match object {
        Object::Sphere(sphere) => (sphere.center() - ray.origin).abs().max_element().max(sphere.radius()),
        Object::Triangle(triangle) => {
            triangle.vertices().iter().fold(ray.origin.abs(), |m, v| m.max(v.abs())).max_element()
        }
        Object::Cuboid(cuboid) => {
            cuboid.corners().iter().fold(ray.origin.abs(), |m, v| m.max(v.abs())).max_element()
        }
    };
    if extent == 0.0 || (2f64.powi(-ORDINARY)..=2f64.powi(ORDINARY)).contains(&extent) {
        return Some((*object, ray, 1.0));
    }
    let scale = below_inverse(extent);
    let material = *object.material();
    let object = match object {
        Object::Sphere(s) => {
            Object::Sphere(Sphere::new(s.radius() * scale, s.center() * scale, material).ok()?)
        }
        Object::Triangle(t) => {
            Object::Triangle(Triangle::new(t.vertices().map(|v| v * scale), material).ok()?)
        }
        Object::Cuboid(c) => Object::Cuboid(Cuboid::new(c.corners().map(|v| v * scale), material).ok()?),
    };
    Some((object, Ray { origin: ray.origin * scale, ..ray }, scale))
}

/// Haines, Günther, Akenine-Möller, "Precision improvements for ray/sphere intersection", Ray Tracing Gems ch. 7.
fn to_sphere(sphere: &Sphere, ray: Ray) -> Option<f64> {
    let radius = sphere.radius();
    let from_center = ray.origin - sphere.center();
    let middle = -from_center.dot(ray.direction);
    let closest = (from_center + middle * ray.direction).length();
    if closest > radius {
        return None;
    }
    let half_chord = ((radius - closest) * (radius + closest)).sqrt();
    // The two solutions are `far` and `power / far`; neither subtracts numbers of the same sign.
    let far = middle + half_chord.copysign(middle);
    let power = power(ray.origin, sphere, 1.0);
    if power > 0.0 {
        (middle > 0.0).then(|| power / far)
    } else if middle > 0.0 {
        Some(far)
    } else {
        (far != 0.0).then(|| power / far)
    }
}

/// `|point - center|² - radius²` of a sphere in units of 1 / scale, a power of two: positive outside, negative inside,
/// right to a part in 10^30 of the squares, so that it is known on which side a point of the surface lies.
///
/// By sums and products with their errors (Dekker, "A floating-point technique for extending the available precision",
/// 1971).
pub(crate) fn power(point: DVec3, sphere: &Sphere, scale: f64) -> f64 {
    let product = |a: f64| (a * a, a.mul_add(a, -(a * a)));
    let sum = |a: f64, b: f64| {
        let s = a + b;
        let part = s - a;
        (s, (a - (s - part)) + (b - part))
    };
    let (mut power, mut rest) = product(sphere.radius() * scale);
    (power, rest) = (-power, -rest);
    for axis in 0..3 {
        let (apart, error) = sum(point[axis] * scale, -sphere.center()[axis] * scale);
        let (square, less) = product(apart);
        let (total, lost) = sum(power, square);
        power = total;
        rest += lost + less + 2.0 * apart * error;
    }
    power + rest
}

fn of_sphere(sphere: &Sphere, ray: Ray, distance: f64) -> Surface {
    let outward = (ray.origin - sphere.center() + distance * ray.direction).normalize();
    let normal = if power(ray.origin, sphere, 1.0) > 0.0 { outward } else { -outward };
    let largest = sphere.center().abs().max_element() + sphere.radius();
    let point = sphere.center() + sphere.radius() * outward;
    Surface { point, normal, offset: 16.0 * ROUNDOFF * largest }
}

/// Woop, Benthin, Wald, "Watertight ray/triangle intersection", JCGT 2(1), 2013, says whether; the distance is that of
/// the plane, so that a triangle in the plane of a box's face is met where the face is.
fn to_triangle(triangle: &Triangle, ray: Ray) -> Option<f64> {
    let edges = sheared(triangle, ray);
    let outside = edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0);
    if outside || edges == [0.0; 3] {
        return None;
    }
    let normal = triangle_normal(triangle.vertices());
    let [a, b, c] = triangle.vertices().map(|vertex| vertex - ray.origin);
    let nearest = [b, c].into_iter().fold(a, |n, v| if v.length() < n.length() { v } else { n });
    Some(nearest.dot(normal) / ray.direction.dot(normal))
}

/// In coordinates where the ray runs from the origin along z: the signed areas opposite the vertices.
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

/// `a·b - c·d` with the products' rounding errors put back: its sign is right, and swapping the products negates it
/// exactly, so that two triangles see their common edge alike.
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (ab, cd) = (a * b, c * d);
    (ab - cd) + (a.mul_add(b, -ab) - c.mul_add(d, -cd))
}

/// Unit normal of a triangle; zero where the area is nothing but rounding error.
pub(crate) fn triangle_normal(vertices: &[DVec3; 3]) -> DVec3 {
    normal_and_width(vertices).0
}

/// [`triangle_normal`], and about how wide the triangle is for its length.
///
/// The normal is right to a few roundoffs also for a needle: the rounding errors of its edges, which are large beside
/// its width, are put back.
pub(crate) fn normal_and_width(vertices: &[DVec3; 3]) -> (DVec3, f64) {
    let largest = vertices.iter().fold(DVec3::ZERO, |m, v| m.max(v.abs())).max_element();
    let scale = below_inverse(largest);
    let [a, b, c] = vertices.map(|v| v * scale);
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

/// Below this sine of the angle between its edges, their rounding errors count.
const SLIM: f64 = 0.25;

/// The rounding error of `a - b` (Knuth).
fn rest(a: DVec3, b: DVec3) -> DVec3 {
    let difference = a - b;
    let of_b = difference - a;
    (a - (difference - of_b)) - (b + of_b)
}

fn of_triangle(triangle: &Triangle, ray: Ray, distance: f64) -> Surface {
    let normal = triangle_normal(triangle.vertices());
    let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
    let corner = triangle.vertices()[0];
    let near = ray.origin + distance * ray.direction;
    let point = near - (near - corner).dot(normal) * normal;
    let largest = triangle.vertices().iter().fold(ray.origin.abs(), |m, v| m.max(v.abs())).max_element();
    Surface { point, normal, offset: 32.0 * ROUNDOFF * largest }
}

/// Distances at which the ray enters and leaves the box, each with its axis: Kay and Kajiya's slabs, where the planes
/// of a slab belong to it and a ray along them is inside for its whole length.
///
/// Leaving is put later by the rounding error of the divisions (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013), so
/// that edges and corners belong to the box.
fn slabs(cuboid: &Cuboid, ray: Ray) -> Option<((f64, usize), (f64, usize))> {
    let (min, max) = (cuboid.min(), cuboid.max());
    let mut enter = (f64::NEG_INFINITY, 0);
    let mut leave = (f64::INFINITY, 0);
    for axis in 0..3 {
        let (o, d) = (ray.origin[axis], ray.direction[axis]);
        if d == 0.0 {
            if o < min[axis] || o > max[axis] {
                return None;
            }
            continue;
        }
        let (a, b) = ((min[axis] - o) / d, (max[axis] - o) / d);
        let (near, far) = (a.min(b), a.max(b));
        if near > enter.0 {
            enter = (near, axis);
        }
        if far < leave.0 {
            leave = (far, axis);
        }
    }
    let slack = 8.0 * ROUNDOFF * leave.0.abs();
    (enter.0 <= leave.0 + slack).then_some((enter, leave))
}

fn to_cuboid(cuboid: &Cuboid, ray: Ray) -> Option<f64> {
    let (enter, leave) = slabs(cuboid, ray)?;
    Some(if enter.0 > 0.0 { enter.0 } else { leave.0 })
}

fn of_cuboid(cuboid: &Cuboid, ray: Ray, distance: f64) -> Surface {
    let (min, max) = (cuboid.min(), cuboid.max());
    let (axis, entering) = match slabs(cuboid, ray) {
        Some(((near, axis), _)) if near > 0.0 => (axis, true),
        Some((_, (_, axis))) => (axis, false),
        None => unreachable!("the ray hits the box at {distance}"),
    };
    let forwards = ray.direction[axis] > 0.0;
    let mut point = (ray.origin + distance * ray.direction).clamp(min, max);
    point[axis] = if forwards == entering { min[axis] } else { max[axis] };
    let normal = if forwards { -DVec3::AXES[axis] } else { DVec3::AXES[axis] };
    let largest = min.abs().max(max.abs()).max_element();
    Surface { point, normal, offset: 16.0 * ROUNDOFF * largest }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::Material;

    use super::*;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn sphere(radius: f64, center: [f64; 3]) -> Object {
        Object::Sphere(Sphere::new(radius, center.into(), Material::default()).unwrap())
    }

    fn cuboid(u: [f64; 3], v: [f64; 3]) -> Object {
        Object::Cuboid(Cuboid::new([u.into(), v.into()], Material::default()).unwrap())
    }

    fn triangle(u: [f64; 3], v: [f64; 3], w: [f64; 3]) -> Object {
        Object::Triangle(Triangle::new([u.into(), v.into(), w.into()], Material::default()).unwrap())
    }

    #[test]
    fn a_sphere_gives_the_root_in_front() {
        let unit = sphere(1.0, [0.0; 3]);
        assert_eq!(distance(&unit, ray([0.0, 0.0, 3.0], [0.0, 0.0, -1.0])), Some(2.0));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 3.0], [0.0, 0.0, 1.0])), None);
        assert_eq!(distance(&unit, ray([0.0; 3], [0.0, 0.0, 1.0])), Some(1.0));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 0.5], [0.0, 0.0, -1.0])), Some(1.5));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 0.5], [0.0, 0.0, 1.0])), Some(0.5));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 1.0], [0.0, 0.0, -1.0])), Some(2.0));
        assert_eq!(distance(&unit, ray([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])), None);
        assert_eq!(distance(&unit, ray([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])), None);
    }

    #[test]
    fn the_side_of_a_point_on_the_surface_is_known() {
        // 0.6² + 0.8² = 1 - 1.7e-17 for the numbers that are nearest to these decimals, ...
        let Object::Sphere(unit) = sphere(1.0, [0.0; 3]) else { panic!("a sphere") };
        let just_inside = power(DVec3::new(0.6, 0.8, 0.0), &unit, 1.0);
        // ... by integers, as 2^-106 is what their squares are multiples of.
        let square = |x: f64| ((x * 2f64.powi(53)) as i128).pow(2);
        let exact = square(0.6) + square(0.8) - square(1.0);
        assert_eq!(just_inside, exact as f64 * 2f64.powi(-106));
        assert_eq!(
            power(DVec3::new(3.0, 4.0, 0.0), &Sphere::new(5.0, DVec3::ZERO, *unit.material()).unwrap(), 1.0),
            0.0
        );
    }

    #[test]
    fn normals_face_the_ray_from_inside_too() {
        for object in [sphere(2.0, [0.0; 3]), cuboid([-2.0; 3], [2.0; 3])] {
            for z in [0.0, 5.0] {
                let r = ray([0.5, 0.25, z], [0.0, 0.0, -1.0]);
                let t = distance(&object, r).unwrap();
                assert!(surface(&object, r, t).normal.z > 0.0);
            }
        }
    }

    #[test]
    fn a_ray_leaves_its_surface() {
        for object in [sphere(2.0, [1e3, 7.0, 0.1]), cuboid([1e3, 0.0, 0.3], [1001.0, 9.0, -3.0])] {
            let r = ray([1000.3, 5.0, 9.0], [0.0, 0.1, -1.0]);
            let s = surface(&object, r, distance(&object, r).unwrap());
            let origin = s.point + s.offset * s.normal;
            assert_eq!(distance(&object, Ray { origin, direction: s.normal }), None);
        }
    }

    #[test]
    fn the_faces_edges_and_corners_belong_to_a_box() {
        let unit = cuboid([1.0; 3], [-1.0; 3]);
        for zero in [0.0, -0.0] {
            assert_eq!(distance(&unit, ray([1.0, 0.0, 4.0], [zero, zero, -1.0])), Some(3.0));
            assert_eq!(distance(&unit, ray([1.0, -1.0, 4.0], [zero, zero, -1.0])), Some(3.0));
            assert_eq!(distance(&unit, ray([1.0 + 1e-15, 0.0, 4.0], [zero, zero, -1.0])), None);
        }
        assert!(distance(&unit, ray([3.0, 3.0, 3.0], [-1.0, -1.0, -1.0])).is_some());
        assert!(distance(&unit, ray([0.0, 0.0, 6.0], [1.0, 1.0, -5.0])).is_some());
    }

    #[test]
    fn a_flat_box_is_a_rectangle() {
        let flat = cuboid([-1.0, -1.0, 0.0], [1.0, 1.0, 0.0]);
        assert_eq!(distance(&flat, ray([0.5, 0.5, 2.0], [0.0, 0.0, -1.0])), Some(2.0));
        assert_eq!(distance(&flat, ray([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0])), Some(2.0));
        assert_eq!(distance(&flat, ray([3.0, 0.0, 1e-300], [-1.0, 0.0, 0.0])), None);
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
    fn objects_of_any_size_are_hit_alike() {
        let origin = DVec3::new(0.3, 0.2, 3.0);
        for exponent in [-1000, -500, 500, 1000] {
            let scale = 2f64.powi(exponent);
            let [p, q, r] =
                [[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.5]].map(|v| v.map(|x| scale * x));
            for object in [sphere(scale, [0.0; 3]), cuboid(p, [scale; 3]), triangle(p, q, r)] {
                let r = Ray { origin: scale * origin, direction: DVec3::NEG_Z };
                let t = distance(&object, r).unwrap();
                let s = surface(&object, r, t);
                assert!((1.0..4.0).contains(&(t / scale)), "{t:e} at 2^{exponent}");
                assert!((s.point.z - (r.origin.z - t)).abs() <= 1e-14 * scale);
                assert!((s.normal.length() - 1.0).abs() < 1e-14 && s.normal.z > 0.0);
            }
        }
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
