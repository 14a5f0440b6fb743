//! Mirrors and glass: the directions and the shares of light.

use super::real::{Real, Vector};

/// Returns the direction reflected at a surface with this unit normal.
pub fn reflected(direction: &Vector, normal: &Vector) -> Vector {
    let twice = direction.dot(normal).shifted(1);
    direction.plus(&-&twice, normal)
}

/// Returns the reflected share of light, and the direction of the transmitted rest. The direction and the normal have
/// unit length, and the normal faces the direction. `index` is the refractive index behind the surface divided by that
/// before it.
///
/// With c the cosine and g² = index² - 1 + c², the share is Fresnel's mean of both polarisations: ½·((g - c)/(g +
/// c))²·(1 + ((c·(g + c) - 1)/(c·(g - c) + 1))²). It is 1 if g is not real.
pub(super) fn refracted(direction: &Vector, normal: &Vector, index: &Real) -> (Real, Option<Vector>) {
    let one = Real::from(1.0);
    let c = -&direction.dot(normal);
    let square = &(&(index * index) - &one) + &(&c * &c);
    if c.sign() <= 0 || square.sign() <= 0 {
        return (one, None);
    }
    let g = square.root();
    let (sum, gap) = (&g + &c, &g - &c);
    let first = gap.over(&sum);
    let second = (&(&c * &sum) - &one).over(&(&(&c * &gap) + &one));
    let share = &(&first * &first) * &(&one + &(&second * &second)).shifted(-1);
    (share, Some(direction.plus(&-&gap, normal).unit()))
}
