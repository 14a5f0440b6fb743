//! Decides in `f64` whether a ray passes a triangle near enough, and which of two triangles at an edge is behind the
//! other, whatever precision the kernels use.
//!
//! The side on which a ray passes an edge is the sign of a volume. It is computed with a bound on the error. If that
//! leaves the sign open, it is computed as a sum of numbers that do not overlap, which is exact (Shewchuk, "Adaptive
//! precision floating-point arithmetic and fast robust geometric predicates", 1997). Products must not underflow; the
//! numbers that kernels hold are far from it.

use glam::DVec3;

use crate::fast::arithmetic::real::Real;

/// The rounding error of a volume of three edges or a direction in `f64`, as a part of the product of their magnitudes.
/// It is generous: two roundings of the differences, and six of the sums and products.
const NOISE: f64 = 8.0 * f64::EPSILON;

/// The ends of an edge.
pub(crate) type Edge = [DVec3; 2];

/// The distance from an edge, in roundoffs of the distance along the ray, within which a ray aimed at the edge may
/// pass, because the direction itself is rounded.
const ON_EDGE: f64 = 16.0 * <f64 as Real>::ROUNDOFF;

/// Returns whether the ray from `origin` along `direction` hits a triangle: it meets the plane ahead, and passes within
/// the triangle, on an edge, or within `reach` of an edge for which `is_wide` holds. `reach` depends on the distance
/// along the ray.
pub(crate) fn passes(
    corners: [DVec3; 3],
    origin: DVec3,
    direction: DVec3,
    reach: impl Fn(f64) -> f64,
    is_wide: impl Fn(Edge) -> bool,
) -> bool {
    let [a, b, c] = corners;
    let facing = volume([direction, b - a, c - a], || {
        exact(&[(1.0, [direction, b, c]), (-1.0, [direction, b, a]), (-1.0, [direction, a, c])])
    });
    if facing * orientation(corners, origin) <= 0 {
        return false;
    }
    let edges = [[b, c], [c, a], [a, b]];
    let sides = edges.map(|[p, q]| {
        volume([direction, p - origin, q - origin], || {
            exact(&[(1.0, [direction, p, q]), (-1.0, [direction, p, origin]), (-1.0, [direction, origin, q])])
        })
    });
    sides.iter().all(|side| side * facing >= 0)
        || edges.into_iter().any(|edge| {
            is_beside(edge, origin, direction, &reach)
                && (is_beside(edge, origin, direction, |along| reach(along).min(ON_EDGE * along))
                    || is_wide(edge))
        })
}

/// Returns whether a ray passes within `reach` of an edge ahead. `reach` depends on the distance along the ray.
pub(crate) fn is_beside([p, q]: Edge, origin: DVec3, direction: DVec3, reach: impl Fn(f64) -> f64) -> bool {
    let (along, aside) = nearest_of_edge(p - origin, q - origin, direction);
    along >= 0.0 && aside <= reach(along)
}

/// Returns whether, of two triangles with a common edge, the one with the corner `apex` is behind the one with the
/// corner `other`, as seen along a ray from `origin` that passes the edge. Both are on one side of the ray, as at an
/// outline, and the plane of the other lies between.
pub(crate) fn is_behind([p, q]: Edge, apex: DVec3, other: DVec3, origin: DVec3) -> bool {
    let side = orientation([p, q, apex], origin);
    side != 0 && side == orientation([p, q, other], origin) && orientation([p, q, other], apex) == -side
}

/// Returns the side of a triangle's plane on which a point lies.
fn orientation(corners: [DVec3; 3], point: DVec3) -> i32 {
    let [a, b, c] = corners;
    volume(corners.map(|corner| corner - point), || {
        exact(&[(1.0, corners), (-1.0, [point, b, c]), (-1.0, [a, point, c]), (-1.0, [a, b, point])])
    })
}

/// Returns the point of an edge from `p` to `q` that is nearest to the line through zero along a direction of length 1:
/// its distance along the line, and its distance from the line.
fn nearest_of_edge(p: DVec3, q: DVec3, direction: DVec3) -> (f64, f64) {
    let across = |v: DVec3| v - v.dot(direction) / direction.length_squared() * direction;
    let (from, edge) = (across(p), across(q - p));
    let length = edge.length_squared();
    let part = if length > 0.0 { (-from.dot(edge) / length).clamp(0.0, 1.0) } else { 0.0 };
    let point = p + part * (q - p);
    (point.dot(direction), across(point).length())
}

/// Returns the sign of `u · (v × w)`. If rounding errors leave it open, `exactly` computes it.
fn volume([u, v, w]: [DVec3; 3], exactly: impl FnOnce() -> i32) -> i32 {
    let size = |v: DVec3| v.abs().element_sum();
    let volume = u.dot(v.cross(w));
    if volume.abs() > NOISE * size(u) * size(v) * size(w) { sign(volume) } else { exactly() }
}

fn sign(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

/// Returns the sign of a sum of volumes `u · (v × w)`, each with its own sign.
fn exact(volumes: &[(f64, [DVec3; 3])]) -> i32 {
    // From the smallest to the largest; none overlaps another.
    let mut sum: Vec<f64> = Vec::new();
    for &(sign, [u, v, w]) in volumes {
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            add_product(&mut sum, [sign * u[i], v[j], w[k]]);
            add_product(&mut sum, [-sign * u[i], v[k], w[j]]);
        }
    }
    sign(sum.last().copied().unwrap_or(0.0))
}

fn add_product(sum: &mut Vec<f64>, [x, y, z]: [f64; 3]) {
    let (high, low) = product(y, z);
    for part in [low, high] {
        let (high, low) = product(x, part);
        add(sum, low);
        add(sum, high);
    }
}

/// Adds a number to an expansion by Shewchuk's GROW-EXPANSION, and omits zeros.
fn add(sum: &mut Vec<f64>, term: f64) {
    let mut carried = term;
    let mut kept = 0;
    for at in 0..sum.len() {
        let part = sum[at];
        // Knuth's sum and its rounding error.
        let total = carried + part;
        let of_part = total - carried;
        let error = (carried - (total - of_part)) + (part - of_part);
        carried = total;
        if error != 0.0 {
            sum[kept] = error;
            kept += 1;
        }
    }
    sum.truncate(kept);
    if carried != 0.0 {
        sum.push(carried);
    }
}

/// A product and its rounding error.
fn product(x: f64, y: f64) -> (f64, f64) {
    let high = x * y;
    (high, x.mul_add(y, -high))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small whole number.
    fn whole(rng: &mut fastrand::Rng) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| f64::from(rng.i32(-3..4))))
    }

    fn intersects(corners: [DVec3; 3], origin: DVec3, direction: DVec3) -> bool {
        passes(corners, origin, direction, |_| -1.0, |_| true)
    }

    /// Computes `intersects` with whole numbers.
    fn truth(corners: [DVec3; 3], origin: DVec3, direction: DVec3) -> bool {
        let volume = |[u, v, w]: [DVec3; 3]| {
            let [u, v, w] = [u, v, w].map(|v| v.to_array().map(|x| x as i128));
            let cross = |i: usize, j: usize| v[i] * w[j] - v[j] * w[i];
            (u[0] * cross(1, 2) + u[1] * cross(2, 0) + u[2] * cross(0, 1)).signum()
        };
        let [a, b, c] = corners.map(|corner| corner - origin);
        let sides = [[direction, b, c], [direction, c, a], [direction, a, b]].map(volume);
        let facing: i128 = sides.iter().sum();
        !(sides.contains(&1) && sides.contains(&-1)) && facing * volume([a, b, c]) > 0
    }

    #[test]
    fn rays_through_edges_and_corners_meet_the_triangle_and_those_next_to_them_do_not() {
        let mut rng = fastrand::Rng::with_seed(1);
        let (mut met, mut touched) = (0, 0);
        for _ in 0..20_000 {
            // Far from the origin and in a unit that leaves the last bits of `f64` to what is looked at.
            let far = whole(&mut rng) * 2f64.powi(48);
            let corners = [(); 3].map(|()| far + whole(&mut rng));
            let origin = far + whole(&mut rng);
            let towards = match rng.u32(0..4) {
                0 => corners[0],
                1 => corners[0] + corners[1] - far,
                _ => far + whole(&mut rng),
            };
            let direction = towards - origin;
            let expected = truth(corners, origin, direction);
            let unit = 2f64.powi(-51);
            assert_eq!(
                intersects(corners.map(|corner| corner * unit), origin * unit, direction),
                expected,
                "{corners:?} from {origin} along {direction}"
            );
            met += usize::from(expected);
            touched += usize::from(expected && towards == corners[0]);
        }
        assert!(met > 2000 && touched > 1000, "{met} met, {touched} of them in a corner");
    }

    #[test]
    fn what_passes_a_needle_beyond_its_tip_passes_it_no_nearer_than_the_tip() {
        let needle = [DVec3::new(0.0, 0.0, -2.0), DVec3::new(1.0, 1e-9, -2.0), DVec3::new(1.0, -1e-9, -2.0)];
        let aimed = |x: f64, y: f64| DVec3::new(x, y, -2.0).normalize();
        let reach = |along: f64| 1e-6 * along;
        for (x, y, is_near) in [
            (0.5, 0.0, true),
            (0.5, 1e-6, true),
            (0.5, 1e-5, false),
            (-1e-6, 0.0, true),
            (-1e-5, 0.0, false),
            (1.0 + 1e-6, 0.0, true),
            (1.0 + 1e-5, 0.0, false),
        ] {
            assert_eq!(passes(needle, DVec3::ZERO, aimed(x, y), reach, |_| true), is_near, "towards {x} {y}");
            assert!(!passes(needle, DVec3::ZERO, -aimed(x, y), reach, |_| true), "away from {x} {y}");
        }
    }

    #[test]
    fn a_volume_far_below_its_rounding_errors_has_a_sign() {
        // The corners lie almost on a line through the ray: the volume is a few 1e-33.
        let along = DVec3::new(0.1, 0.7, 0.3);
        for lift in [-1.0, 0.0, 1.0] {
            let p = along + DVec3::new(lift * 2f64.powi(-54), 0.0, 0.0);
            let up = DVec3::new(0.0, 0.0, 2f64.powi(-55));
            let sum = exact(&[(1.0, [along, p, up])]);
            // u · (v × w) with w = (0, 0, w): w (u.x v.y - u.y v.x), and v.x - u.x is what the lift leaves of it.
            assert_eq!(sum, -sign(p.x - along.x), "{lift}");
        }
    }

    #[test]
    fn of_two_faces_at_an_outline_one_is_behind_the_other_whatever_their_orientation() {
        let mut rng = fastrand::Rng::with_seed(4);
        let mut decided = 0;
        for _ in 0..20_000 {
            // In the plane across an edge along z, with the eye at (0, -8) and the edge at (0, 0).
            let far = whole(&mut rng) * 2f64.powi(46);
            let [one, other] =
                [(); 2].map(|()| DVec3::new(f64::from(rng.i32(-3..4)), f64::from(rng.i32(-3..4)), 0.0));
            let eye = DVec3::new(0.0, -8.0, 0.0);
            let edge = [DVec3::NEG_Z, DVec3::Z];
            // Seen from the eye, by the angle from where the eye is.
            let angle = |v: DVec3| v.x.abs().atan2(-v.y);
            let expected = one.x * other.x > 0.0 && angle(one) > angle(other) + 1e-9;
            let place = |v: DVec3| (far + v) * 2f64.powi(-50);
            for [p, q] in [edge, [edge[1], edge[0]]] {
                let found = is_behind([place(p), place(q)], place(one), place(other), place(eye));
                assert_eq!(found, expected, "{one} behind {other}");
            }
            decided += usize::from(expected);
        }
        assert!(decided > 2000, "{decided}");
    }
}
