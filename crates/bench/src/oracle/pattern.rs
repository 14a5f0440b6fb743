//! The coefficients of a patterned surface.

use rayfold_scene::model::Weight;
use rayfold_scene::{Coefficients, Material};

use super::noise::noise;
use super::real::{Real, Vector};

/// Returns the ambient, diffuse and mirror coefficients at a point, which is in the coordinates of the object's
/// numbers. `face` is the axis that a flat part is perpendicular to, and its exact coordinate on that axis.
pub(super) fn coefficients(material: &Material, place: &Vector, face: Option<(usize, f64)>) -> [Vector; 3] {
    let each = |c: Coefficients| [c.ambient(), c.diffuse(), c.mirror()].map(Vector::from);
    let own = each(material.coefficients());
    let Some(pattern) = material.finish().and_then(|finish| finish.pattern) else { return own };
    let w = weight(pattern.weight, place, face);
    let rest = &Real::from(1.0) - &w;
    let other = each(pattern.other);
    [0, 1, 2]
        .map(|k| Vector([0, 1, 2].map(|axis: usize| &(&rest * &own[k].0[axis]) + &(&w * &other[k].0[axis]))))
}

fn weight(weight: Weight, place: &Vector, face: Option<(usize, f64)>) -> Real {
    let place = Vector([0, 1, 2].map(|axis| match face {
        Some((square, number)) if square == axis => Real::from(number),
        _ => place.0[axis].clone(),
    }));
    let is_odd = |axis: usize, size: f64| {
        let mut x = place.0[axis].over(&Real::from(size));
        if face.is_some_and(|(square, _)| square == axis) {
            let whole = x.to_f64().round();
            let apart = (&x - &Real::from(whole)).magnitude();
            let one = Real::from(1.0);
            let beside = if x.magnitude() > one { x.magnitude() } else { one };
            if apart <= beside.shifted(-40) {
                x = Real::from(whole);
            }
        }
        (x.ceiling() - 1.0).rem_euclid(2.0) == 1.0
    };
    let of = |odd: bool| Real::from(if odd { 1.0 } else { 0.0 });
    match weight {
        Weight::Checker(size) => of((0..3).filter(|&axis| is_odd(axis, size)).count() % 2 == 1),
        Weight::Stripes(size) => of(is_odd(0, size)),
        Weight::Noise(size) => {
            let cells = [0, 1, 2].map(|axis: usize| place.0[axis].over(&Real::from(size)).to_f64());
            Real::from((0.5 + 0.5 * noise(cells)).clamp(0.0, 1.0))
        }
        Weight::Gradient(start, end) => {
            let part = (&place.0[1] - &Real::from(start)).over(&(&Real::from(end) - &Real::from(start)));
            let one = Real::from(1.0);
            if part.sign() < 0 {
                Real::zero()
            } else if part > one {
                one
            } else {
                part
            }
        }
    }
}
