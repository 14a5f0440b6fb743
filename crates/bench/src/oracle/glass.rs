//! Mirrors and glass: where light goes, and how much of it.

use super::real::{Real, Vector};

/// The direction mirrored at a surface of this unit normal.
pub fn reflected(direction: &Vector, normal: &Vector) -> Vector {
    let twice = direction.dot(normal).shifted(1);
    direction.plus(&-&twice, normal)
}

/// The share of light that is mirrored, and where the rest goes, for a unit direction, a unit normal that faces it and
/// the index of what lies behind over that of what lies before.
///
/// With c the cosine and g² = index² - 1 + c², Fresnel's mean of both polarisations is
/// ½·((g - c)/(g + c))²·(1 + ((c·(g + c) - 1)/(c·(g - c) + 1))²), and all of it where g is not real.
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
