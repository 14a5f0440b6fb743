//! The coefficients of a surface at a place: patterns.
//!
//! Patterns are read off the numbers of the script, not off the world: what is seen from the eye is taken back to where the
//! script has it.

use glam::DVec3;
use rayfold_scene::model::Weight;
use rayfold_scene::{Coefficients, Object};

use super::noise::noise;
use super::shapes::Surface;
use super::whole::{ceil, is_odd};

/// A number this near to a wall between cells, beside 1 and itself, is on it, if it is a number of the script.
const WALL: f64 = 1.0 / (1u64 << 40) as f64;

/// The coefficients of an object's surface.
///
/// `place` is where it is hit and `normal` its normal, in the coordinates of the object's numbers; `object` is not an
/// instance.
pub(crate) fn coefficients(object: &Object, place: DVec3, normal: DVec3, surface: &Surface) -> Coefficients {
    let material = object.material();
    let own = material.coefficients();
    let Some(pattern) = material.finish().and_then(|finish| finish.pattern) else { return own };
    let face = if surface.flat { face(object, place, normal) } else { None };
    own.mixed(&pattern.other, weight(pattern.weight, place, face))
}

/// How much there is of the other coefficients. A `face` is square to an axis, at a number of the script.
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
        // The parity of each, as a sum of large numbers is rounded.
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

/// The cell of a number of the script, in cells: numbers all but on a wall are on it.
fn cell_of_number(x: f64) -> f64 {
    let whole = x.round();
    let x = if (x - whole).abs() <= WALL * x.abs().max(1.0) { whole } else { x };
    ceil(x) - 1.0
}

/// The axis that a flat part is square to, and its number on that axis in the script.
fn face(object: &Object, place: DVec3, normal: DVec3) -> Option<(usize, f64)> {
    let nearest = |axis: usize, a: DVec3, b: DVec3| {
        let (a, b) = (a[axis], b[axis]);
        if (place[axis] - a).abs() <= (place[axis] - b).abs() { a } else { b }
    };
    match object {
        Object::Cuboid(cuboid) => {
            let axis = largest(normal);
            Some((axis, nearest(axis, cuboid.min(), cuboid.max())))
        }
        Object::Triangle(triangle) => {
            let [u, v, w] = triangle.vertices();
            let axis = (0..3).find(|&axis| u[axis] == v[axis] && v[axis] == w[axis])?;
            Some((axis, u[axis]))
        }
        Object::Plane(plane) => along_an_axis(plane.normal()).map(|axis| (axis, plane.point()[axis])),
        Object::Disc(disc) => along_an_axis(disc.normal()).map(|axis| (axis, disc.center()[axis])),
        Object::Cylinder(cylinder) => cap(cylinder.ends(), nearest),
        Object::Cone(cone) => cap(cone.ends(), nearest),
        Object::Sphere(_) | Object::Torus(_) | Object::Instance(_) => None,
    }
}

fn cap([a, b]: [DVec3; 2], nearest: impl Fn(usize, DVec3, DVec3) -> f64) -> Option<(usize, f64)> {
    let mut differing = (0..3).filter(|&axis| a[axis] != b[axis]);
    let axis = differing.next()?;
    differing.next().is_none().then(|| (axis, nearest(axis, a, b)))
}

/// The axis along which a direction runs exactly.
fn along_an_axis(direction: DVec3) -> Option<usize> {
    let mut other = (0..3).filter(|&axis| direction[axis] != 0.0);
    let axis = other.next()?;
    other.next().is_none().then_some(axis)
}

fn largest(v: DVec3) -> usize {
    let v = v.abs();
    if v.x >= v.y && v.x >= v.z {
        0
    } else if v.y >= v.z {
        1
    } else {
        2
    }
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
