//! Objects of groups. A ray is transformed into the coordinates of the group.
//!
//! An object that can be moved into the world without any rounding is moved there ([`in_world`]). So a group gives the
//! same picture as its objects written out, bit for bit.

use std::borrow::Cow;
use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::{Instance, Motion, Object, Placement};

use super::double_double::Place;
use super::{ROUNDOFF, Shape, Sides, Surface};
use crate::camera::Ray;

impl Shape for Instance {
    fn extent(&self, origin: DVec3) -> f64 {
        self.placement().translation().abs().max(origin.abs()).max_element()
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        let distance = super::distance(self.object(), local(self, ray))?;
        Some(distance * self.placement().scale())
    }

    /// The transformation into the world adds to the shape's rounding errors those of a product with a matrix, of the
    /// scale and of a sum.
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

    fn sides(&self, place: Place) -> Sides {
        super::shape(self.object()).sides(place)
    }
}

/// Returns the object in coordinates whose origin is the eye. Returns `None` if that is impossible, or if rounding
/// would move the eye to another side of it.
pub(in crate::reference) fn seen_from(object: &Object, eye: DVec3) -> Option<Object> {
    match object {
        Object::Instance(instance) => of_group(instance, eye),
        // Rounding would give it an area.
        Object::Triangle(triangle) if triangle.is_degenerate() => Some(object.clone()),
        _ => {
            let placed = object.placed(1.0, |place| place - eye).ok()?;
            let same =
                super::shape(object).sides(eye.into()) == super::shape(&placed).sides(DVec3::ZERO.into());
            same.then_some(placed)
        }
    }
}

/// Implements [`seen_from`] for an object of a group. If rounding would put the eye on another side of the surface, the
/// object gets the group's own numbers relative to the eye. Its lengths are then increased or decreased by units of
/// their last bit until the eye is on the right side.
fn of_group(instance: &Instance, eye: DVec3) -> Option<Object> {
    let placement = instance.placement();
    let object = instance.object();
    let exact = Place::in_group(eye, placement);
    let sides = super::shape(object).sides(exact);
    let drawn = Object::from(instance.clone()).placed(1.0, |place| place - eye).ok()?;
    let Object::Instance(moved) = &drawn else { unreachable!("an instance stays one") };
    let is_right = |object: &Object, place: DVec3| super::shape(object).sides(place.into()) == sides;
    if is_right(object, moved.placement().local_point(DVec3::ZERO)) {
        return Some(drawn);
    }
    let own = Placement::new(DVec3::ZERO, placement.rotation(), placement.scale()).ok()?;
    let near = object.placed(1.0, |place| exact.towards(place)).ok()?;
    let candidates: Vec<Object> = [0, 1, -1, 2, -2, 4, -4]
        .into_iter()
        .filter_map(|bits| near.moved(&Grown(bits), near.material().clone()).ok())
        .collect();
    // An eye that cannot be in the surface, and is no farther from it than the errors of twofold numbers, is outside.
    let is_near = |object: &Object| {
        let found = super::shape(object).sides(DVec3::ZERO.into());
        found.iter().zip(sides).all(|(found, side)| *found == side || side == 0.0 && *found > 0.0)
    };
    let found = candidates.iter().find(|object| is_right(object, DVec3::ZERO));
    let found = found.or_else(|| candidates.iter().find(|object| is_near(object))).cloned();
    Some(found.map_or(drawn, |object| Instance::new(&vec![object].into(), 0, &Arc::new(own)).into()))
}

/// Increases all lengths by `steps` units of their last bit.
struct Grown(i64);

impl Motion for Grown {
    fn point(&self, position: DVec3) -> DVec3 {
        position
    }

    fn direction(&self, direction: DVec3) -> DVec3 {
        direction
    }

    fn length(&self, length: f64) -> f64 {
        match length {
            0.0 => 0.0,
            _ => f64::from_bits(length.to_bits().saturating_add_signed(self.0)),
        }
    }
}

/// The ray in the coordinates of the group. Its direction remains a unit vector.
fn local(instance: &Instance, ray: Ray) -> Ray {
    let placement = instance.placement();
    Ray {
        origin: placement.local_point(ray.origin),
        direction: placement.rotation().transpose() * ray.direction,
    }
}

/// Returns an object of a group as one of the world, if that needs no rounding: rotated only by right angles, or not at
/// all.
pub(crate) fn in_world(object: &Object) -> Cow<'_, Object> {
    let Object::Instance(instance) = object else { return Cow::Borrowed(object) };
    moved(instance).map_or(Cow::Borrowed(object), Cow::Owned)
}

fn moved(instance: &Instance) -> Option<Object> {
    let placement = instance.placement();
    if !turns_axes_to_axes(placement) {
        return None;
    }
    instance.object().moved(&Exactly(placement), instance.material().clone()).ok()
}

/// A placement that maps axes to axes without any rounding. A result that would need rounding is NaN.
struct Exactly<'a>(&'a Placement);

impl Motion for Exactly<'_> {
    fn point(&self, position: DVec3) -> DVec3 {
        exactly_placed(self.0, position).unwrap_or(DVec3::NAN)
    }

    fn direction(&self, direction: DVec3) -> DVec3 {
        self.0.direction(direction)
    }

    fn length(&self, length: f64) -> f64 {
        exact_product(self.0.scale(), length).unwrap_or(f64::NAN)
    }
}

/// Whether each axis becomes an axis.
pub(crate) fn turns_axes_to_axes(placement: &Placement) -> bool {
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
    use rayfold_scene::{Cuboid, Cylinder, Material, Sphere};

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

    /// Numbers for which the rounded eye is on another side than the exact one. They were found with fractions.
    #[test]
    fn an_eye_in_the_last_bit_of_a_surface_of_a_group_is_on_the_right_side() {
        let tube =
            || Object::from(Cylinder::new(2.0, [DVec3::NEG_Y, DVec3::Y], Material::default()).unwrap());
        let ball = || {
            let center = DVec3::new(0.3, 0.1, 0.2);
            Object::from(Sphere::new(1.0, center, Material::default()).unwrap())
        };
        for (object, translation, scale, eye, is_inside) in [
            (
                tube(),
                [-1.1120170754802343, -2.0006859019904732, -1.2342085990515996],
                0.9726122251548087,
                DVec3::new(0.05511759470553601, -1.5143797894130688, 0.32197096119609436),
                true,
            ),
            (
                ball(),
                [-2.1050663766475184, -1.0518912582746451, 0.1902983644345193],
                2.928646873193012,
                DVec3::new(0.5307158092261925, -0.7590265709553439, 3.1189452376275315),
                true,
            ),
            (
                ball(),
                [2.196265407243488, -3.2304437656319864, -3.058903089313224],
                0.2832888118321436,
                DVec3::new(2.4512253378924176, -3.202114884448772, -2.7756142774810804),
                false,
            ),
        ] {
            let Object::Instance(instance) = instance(object, translation, DMat3::IDENTITY, scale) else {
                unreachable!("an instance")
            };
            let drawn = of_group(&instance, eye).unwrap();
            let outwards = Ray { origin: DVec3::ZERO, direction: DVec3::new(0.6, 0.0, 0.8) };
            assert_eq!(distance(&drawn, outwards).is_some(), is_inside, "{eye}");
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
