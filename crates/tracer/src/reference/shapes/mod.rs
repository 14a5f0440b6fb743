//! The intersection of a ray with an object, and the surface at the hit.
//!
//! Each shape has a file. Bounds on rounding errors are multiples of the unit roundoff and of the largest number in the
//! computation.

mod capsule;
mod cone;
mod cuboid;
mod cylinder;
mod disc;
mod double_double;
mod frustum;
mod instance;
mod plane;
mod roundbox;
mod sphere;
mod torus;
mod triangle;

use glam::DVec3;
use rayfold_scene::Object;

pub(crate) use double_double::Place;
pub(super) use instance::seen_from;
pub(crate) use instance::{in_world, turns_axes_to_axes};
pub(crate) use sphere::power;
pub(crate) use triangle::{normal_and_width, triangle_normal};

use crate::camera::Ray;
use crate::scale::below_inverse;

/// The largest relative error of one rounding.
const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// The surface at a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The hit point, moved back onto the object.
    pub point: DVec3,
    /// The unit normal, on the side that the ray came from.
    pub normal: DVec3,
    /// The offset of new rays: `point + offset * normal` is certainly outside the object, whatever the rounding.
    pub offset: f64,
    /// Whether it is a face, a cap or a flat object.
    pub flat: bool,
    /// Whether the ray came from within the object. Always false for an object that has no inside.
    pub within: bool,
}

/// The interface of a shape.
trait Shape {
    /// Returns the largest of the numbers in the computations for rays from `origin`.
    fn extent(&self, origin: DVec3) -> f64;

    /// Returns the distance to the nearest hit in front of the origin. A value that is NaN, or not greater than zero,
    /// is no hit.
    fn distance(&self, ray: Ray) -> Option<f64>;

    /// Returns the surface that the ray hits at `distance`.
    fn surface(&self, ray: Ray, distance: f64) -> Surface;

    /// Returns the side of each of its surfaces on which a point lies, as signs; 0 in a surface.
    fn sides(&self, place: Place) -> Sides;

    /// Returns whether it has an inside, which glass fills.
    fn has_inside(&self) -> bool {
        true
    }

    /// Returns whether the surface with this unit normal is flat: a face or a cap.
    fn is_flat_at(&self, _normal: DVec3) -> bool {
        false
    }

    /// Returns the axis to which the flat part with this normal at `place` is perpendicular, and its coordinate on that
    /// axis in the script. Returns `None` for a part that is perpendicular to no axis.
    fn face(&self, _place: DVec3, _normal: DVec3) -> Option<(usize, f64)> {
        None
    }
}

/// The signs of a point for up to six surfaces.
type Sides = [f64; 6];

/// Returns 0 or the sign.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// Returns an object's shape. This is the only place that dispatches on the kind of an object.
fn shape(object: &Object) -> &dyn Shape {
    match object {
        Object::Sphere(sphere) => sphere,
        Object::Triangle(triangle) => triangle,
        Object::Cuboid(cuboid) => cuboid,
        Object::Plane(plane) => plane,
        Object::Disc(disc) => disc,
        Object::Cylinder(cylinder) => cylinder,
        Object::Cone(cone) => cone,
        Object::Torus(torus) => torus,
        Object::Capsule(capsule) => capsule,
        Object::Roundbox(roundbox) => roundbox,
        Object::Instance(instance) => instance,
        Object::Mesh(_) => unreachable!("meshes are expanded to their triangles"),
    }
}

/// Returns the distance to the nearest hit in front of the origin.
pub(super) fn distance(object: &Object, ray: Ray) -> Option<f64> {
    let scale = scale(object, ray);
    let distance = if scale == 1.0 {
        shape(object).distance(ray)?
    } else {
        let (object, ray) = scaled(object, ray, scale)?;
        shape(&object).distance(ray)? / scale
    };
    (distance > 0.0 && distance.is_finite()).then_some(distance)
}

/// Returns the surface of an object that the ray hits at `distance`.
///
/// # Panics
/// The ray does not hit the object.
pub(super) fn surface(object: &Object, ray: Ray, distance: f64) -> Surface {
    let scale = scale(object, ray);
    if scale == 1.0 {
        return shape(object).surface(ray, distance);
    }
    let Some((object, ray)) = scaled(object, ray, scale) else {
        unreachable!("the ray hits the object at {distance}")
    };
    let surface = shape(&object).surface(ray, distance * scale);
    Surface { point: surface.point / scale, offset: surface.offset / scale, ..surface }
}

/// Returns the largest number in the intersection of a ray with an object.
pub(super) fn extent(object: &Object, ray: Ray) -> f64 {
    shape(object).extent(ray.origin)
}

/// The largest exponent of two whose fourth power leaves room for sums of products.
const ORDINARY: i32 = 200;

/// Returns the power of two that scales world units so that no product overflows or underflows; 1 for most objects.
fn scale(object: &Object, ray: Ray) -> f64 {
    let extent = shape(object).extent(ray.origin);
    let ordinary = extent == 0.0 || (2f64.powi(-ORDINARY)..=2f64.powi(ORDINARY)).contains(&extent);
    if ordinary { 1.0 } else { below_inverse(extent) }
}

/// Returns the object and the ray in units of 1 / scale, or `None` if the object is too small to be visible in the
/// ray's units.
fn scaled(object: &Object, ray: Ray, scale: f64) -> Option<(Object, Ray)> {
    let object = object.placed(scale, |position| position * scale).ok()?;
    Some((object, Ray { origin: ray.origin * scale, ..ray }))
}

/// Returns whether an object that is not an instance has an inside.
pub(crate) fn has_inside(object: &Object) -> bool {
    shape(object).has_inside()
}

/// Returns whether an object that is not an instance is flat where it has this unit normal: a face or a cap.
pub(crate) fn is_flat_at(object: &Object, normal: DVec3) -> bool {
    shape(object).is_flat_at(normal)
}

/// Returns the axis to which a flat part of an object is perpendicular, and its coordinate on that axis in the script.
pub(super) fn face(object: &Object, place: DVec3, normal: DVec3) -> Option<(usize, f64)> {
    shape(object).face(place, normal)
}

/// Returns the one of two coordinates on an axis that is nearer to a point.
fn nearer(axis: usize, place: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let (a, b) = (a[axis], b[axis]);
    if (place[axis] - a).abs() <= (place[axis] - b).abs() { a } else { b }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Cuboid, Material, Sphere, Triangle};

    use super::*;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn sphere(radius: f64, center: [f64; 3]) -> Object {
        Sphere::new(radius, center.into(), Material::default()).unwrap().into()
    }

    fn cuboid(u: [f64; 3], v: [f64; 3]) -> Object {
        Cuboid::new([u.into(), v.into()], Material::default()).unwrap().into()
    }

    fn triangle(u: [f64; 3], v: [f64; 3], w: [f64; 3]) -> Object {
        Triangle::new([u.into(), v.into(), w.into()], Material::default()).unwrap().into()
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
}
