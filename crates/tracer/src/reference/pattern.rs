//! The coefficients of a surface at a point: patterns.
//!
//! Patterns are evaluated in the coordinates of the script, not of the world. So a hit in the coordinates of the eye is
//! transformed back to them.

use glam::DVec3;
use rayfold_scene::model::Weight;
use rayfold_scene::{Coefficients, Object};

use super::noise::noise;
use super::shapes::{Surface, face};
use super::whole::{ceil, is_odd};
use crate::pictures::factor;

/// The distance from a wall between cells below which a number of the script is on it, relative to the larger of 1 and
/// the number.
const WALL: f64 = 1.0 / (1u64 << 40) as f64;

/// Returns the coefficients of an object's surface.
///
/// `place` is the hit point and `normal` its normal, in the coordinates of the object's numbers. `object` is not an
/// instance. `is_linear` is whether colours are linear light.
pub(crate) fn coefficients(
    object: &Object,
    place: DVec3,
    normal: DVec3,
    surface: &Surface,
    is_linear: bool,
) -> Coefficients {
    let material = object.material();
    let own = material.coefficients();
    let Some(finish) = material.finish() else { return own };
    if let Some(image) = &finish.image {
        let factor = factor(image, object, place, is_linear);
        return Coefficients::new(own.ambient() * factor, own.diffuse() * factor, own.mirror())
            .unwrap_or(own);
    }
    let Some(pattern) = finish.pattern else { return own };
    let face = if surface.flat { face(object, place, normal) } else { None };
    own.mixed(&pattern.other, weight(pattern.weight, place, face))
}

/// Returns the share of the other coefficients. A `face` is perpendicular to an axis, at a coordinate of the script.
fn weight(weight: Weight, place: DVec3, face: Option<(usize, f64)>) -> f64 {
    let odd = |is_odd: bool| if is_odd { 1.0 } else { 0.0 };
    let cell = |axis: usize, size: f64| match face {
        Some((square, number)) if square == axis => cell_of_number(number / size),
        _ => ceil(place[axis] / size) - 1.0,
    };
    let place = match face {
        Some((axis, number)) => {
            let mut place = place;
            place[axis] = number;
            place
        }
        None => place,
    };
    match weight {
        // The parity of each number, because the sum of large numbers is rounded.
        Weight::Checker(size) => {
            let [x, y, z] = [0, 1, 2].map(|axis| is_odd(cell(axis, size)));
            odd(x ^ y ^ z)
        }
        Weight::Stripes(size) => odd(is_odd(cell(0, size))),
        Weight::Noise(size) => (0.5 + 0.5 * noise(place / size)).clamp(0.0, 1.0),
        Weight::Gradient(start, end) => {
            // Halves, so that the difference is finite.
            ((0.5 * place.y - 0.5 * start) / (0.5 * end - 0.5 * start)).clamp(0.0, 1.0)
        }
    }
}

/// Returns the cell of a number of the script, in units of cells. A number near a wall counts as on it.
fn cell_of_number(x: f64) -> f64 {
    let whole = x.round();
    let x = if (x - whole).abs() <= WALL * x.abs().max(1.0) { whole } else { x };
    ceil(x) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_end_at_whole_numbers() {
        let stripe = |x: f64| weight(Weight::Stripes(0.5), DVec3::new(x, 0.0, 0.0), None);
        for (x, expected) in
            [(-0.2, 1.0), (0.0, 1.0), (0.1, 0.0), (0.5, 0.0), (0.6, 1.0), (1.0, 1.0), (1.1, 0.0)]
        {
            assert_eq!(stripe(x), expected, "at {x}");
        }
        let checker = |x, y, z| weight(Weight::Checker(1.0), DVec3::new(x, y, z), None);
        assert_eq!((checker(0.5, 0.5, 0.5), checker(1.5, 0.5, 0.5)), (0.0, 1.0));
        assert_eq!((checker(-0.5, 0.5, 0.5), checker(-0.5, -0.5, -0.5)), (1.0, 1.0));
    }

    #[test]
    fn a_face_all_but_on_a_wall_is_on_it() {
        // 0.3 / 0.1 is 2.9999999999999996, and 0.7 / 0.1 is 6.999999999999999.
        assert_eq!([0.3 / 0.1, 0.7 / 0.1, 0.1 * 3.0 / 0.1].map(cell_of_number), [2.0, 6.0, 2.0]);
        assert_eq!([3.0 + 1e-11, 3.0 - 1e-11, 3.0 + 1e-13].map(cell_of_number), [3.0, 2.0, 2.0]);
        assert_eq!([0.0, -0.0, 1e-13, 1e-11, -1e-11].map(cell_of_number), [-1.0, -1.0, -1.0, 0.0, -1.0]);
        let on_a_face = |y| weight(Weight::Checker(0.1), DVec3::new(0.05, 0.31, 0.05), Some((1, y)));
        assert_eq!((on_a_face(0.3), on_a_face(0.35)), (0.0, 1.0));
    }

    #[test]
    fn gradients_are_clamped_and_may_fall() {
        let at = |y, start, end| weight(Weight::Gradient(start, end), DVec3::new(0.0, y, 0.0), None);
        assert_eq!(
            [at(1.0, 0.0, 4.0), at(-1.0, 0.0, 4.0), at(9.0, 0.0, 4.0), at(1.0, 4.0, 0.0)],
            [0.25, 0.0, 1.0, 0.75]
        );
        assert_eq!(at(0.0, -1e308, 1e308), 0.5);
    }
}
