//! Objects of groups: a ray is taken into the coordinates of the group.
//!
//! Where the object can be moved into the world without any rounding it is ([`in_world`]), so that a group shows what its
//! copy written out shows, bit for bit.

use std::borrow::Cow;

use glam::DVec3;
use rayfold_scene::{
    Cone, Cuboid, Cylinder, Disc, Instance, Object, Placement, Plane, Sphere, Torus, Triangle,
};

use super::{ROUNDOFF, Shape, Surface};
use crate::camera::Ray;

impl Shape for Instance {
    fn extent(&self, origin: DVec3) -> f64 {
        self.placement().translation().abs().max(origin.abs()).max_element()
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        let distance = super::distance(self.object(), local(self, ray))?;
        Some(distance * self.placement().scale())
    }

    /// To what the shape says the way into the world adds the roundings of a product with a matrix, of the scale and of a sum.
    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let placement = self.placement();
        let surface = super::surface(self.object(), local(self, ray), distance / placement.scale());
        let point = placement.point(surface.point);
        let moved = placement.scale() * surface.point.abs().max_element();
        let largest = placement.translation().abs().max_element() + moved;
        Surface {
            point,
            normal: placement.rotation() * surface.normal,
            offset: placement.scale() * surface.offset + 32.0 * ROUNDOFF * largest,
            ..surface
        }
    }

    fn seen_from(&self, eye: DVec3) -> Option<Object> {
        Object::from(self.clone()).placed(1.0, |place| place - eye).ok()
    }
}

/// The ray in the coordinates of the group; its direction stays of unit length.
fn local(instance: &Instance, ray: Ray) -> Ray {
    let placement = instance.placement();
    Ray {
        origin: placement.local_point(ray.origin),
        direction: placement.rotation().transpose() * ray.direction,
    }
}

/// An object of a group as one of the world, if that needs no rounding: turned by right angles alone, or not at all.
pub(crate) fn in_world(object: &Object) -> Cow<'_, Object> {
    let Object::Instance(instance) = object else { return Cow::Borrowed(object) };
    moved(instance).map_or(Cow::Borrowed(object), Cow::Owned)
}

fn moved(instance: &Instance) -> Option<Object> {
    let placement = instance.placement();
    if !turns_axes_to_axes(placement) {
        return None;
    }
    let material = instance.material().clone();
    let place = |point| exactly_placed(placement, point);
    let length = |length| exact_product(placement.scale(), length);
    let turned = |direction| placement.rotation() * direction;
    match instance.object() {
        Object::Sphere(o) => {
            Sphere::new(length(o.radius())?, place(o.center())?, material).ok().map(Object::from)
        }
        Object::Triangle(o) => {
            let [u, v, w] = *o.vertices();
            Triangle::new([place(u)?, place(v)?, place(w)?], material).ok().map(Object::from)
        }
        Object::Cuboid(o) => {
            let [u, v] = *o.corners();
            Cuboid::new([place(u)?, place(v)?], material).ok().map(Object::from)
        }
        Object::Plane(o) => {
            Plane::new(place(o.point())?, turned(o.normal()), material).ok().map(Object::from)
        }
        Object::Disc(o) => {
            let (radius, center) = (length(o.radius())?, place(o.center())?);
            Disc::new(radius, center, turned(o.normal()), material).ok().map(Object::from)
        }
        Object::Cylinder(o) => {
            let [a, b] = o.ends();
            Cylinder::new(length(o.radius())?, [place(a)?, place(b)?], material).ok().map(Object::from)
        }
        Object::Cone(o) => {
            let ([a, b], [low, high]) = (o.ends(), o.radii());
            Cone::new([length(low)?, length(high)?], [place(a)?, place(b)?], material).ok().map(Object::from)
        }
        Object::Torus(o) => {
            let (radius, thickness) = (length(o.radius())?, length(o.thickness())?);
            let (center, normal) = (place(o.center())?, turned(o.normal()));
            Torus::new(radius, thickness, center, normal, material).ok().map(Object::from)
        }
        Object::Instance(_) => None,
    }
}

/// Whether each axis becomes an axis.
fn turns_axes_to_axes(placement: &Placement) -> bool {
    placement.rotation().to_cols_array().iter().all(|x| *x == 0.0 || x.abs() == 1.0)
}

fn exactly_placed(placement: &Placement, point: DVec3) -> Option<DVec3> {
    let turned = placement.rotation() * point;
    let translation = placement.translation();
    let mut placed = [0.0; 3];
    for axis in 0..3 {
        placed[axis] = exact_sum(translation[axis], exact_product(placement.scale(), turned[axis])?)?;
    }
    Some(placed.into())
}

fn exact_product(a: f64, b: f64) -> Option<f64> {
    let product = a * b;
    let is_exact = a.mul_add(b, -product) == 0.0 && (product != 0.0 || b == 0.0);
    (is_exact && product.is_finite()).then_some(product)
}

fn exact_sum(a: f64, b: f64) -> Option<f64> {
    let sum = a + b;
    let of_b = sum - a;
    let lost = (a - (sum - of_b)) + (b - of_b);
    (lost == 0.0).then_some(sum)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DMat3;
    use rayfold_scene::Material;

    use super::*;
    use crate::reference::shapes::{distance, surface};

    fn instance(object: Object, translation: [f64; 3], rotation: DMat3, scale: f64) -> Object {
        let placement = Placement::new(translation.into(), rotation, scale).unwrap();
        Instance::new(&vec![object].into(), 0, &Arc::new(placement)).into()
    }

    fn brick() -> Object {
        Cuboid::new([DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)], Material::default()).unwrap().into()
    }

    const QUARTER: DMat3 = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);

    #[test]
    fn what_is_exact_is_moved() {
        let moved = instance(brick(), [0.5, 0.25, 0.0], QUARTER, 4.0);
        let expected =
            Cuboid::new([DVec3::new(0.5, 0.25, 0.0), DVec3::new(-7.5, 4.25, 12.0)], Material::default());
        assert_eq!(in_world(&moved).into_owned(), expected.unwrap().into());
        for inexact in [
            instance(brick(), [0.1, 1e-17, 0.0], QUARTER, 4.0),
            instance(brick(), [0.0; 3], DMat3::from_rotation_x(1.0), 1.0),
            instance(
                Sphere::new(0.1, DVec3::ZERO, Material::default()).unwrap().into(),
                [0.0; 3],
                QUARTER,
                0.1,
            ),
        ] {
            assert!(matches!(in_world(&inexact).into_owned(), Object::Instance(_)));
        }
    }

    #[test]
    fn a_turned_box_is_hit_where_it_stands() {
        let turn = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_4);
        let turned = instance(brick(), [10.0, 0.0, 0.0], turn, 2.0);
        let r = Ray { origin: DVec3::new(10.0, -5.0, 1.0), direction: DVec3::Y };
        let t = distance(&turned, r).unwrap();
        assert!((t - 5.0).abs() < 1e-14, "{t}");
        let r = Ray { origin: DVec3::new(10.5, -5.0, 1.0), direction: DVec3::Y };
        let (t, half) = (distance(&turned, r).unwrap(), 0.5f64.sqrt());
        let s = surface(&turned, r, t);
        assert!((t - 5.5).abs() < 1e-14 && s.flat && !s.within);
        assert!((s.normal - DVec3::new(half, -half, 0.0)).length() < 1e-15, "{}", s.normal);
        assert!((s.point - DVec3::new(10.5, 0.5, 1.0)).length() < 1e-13);
    }
}
