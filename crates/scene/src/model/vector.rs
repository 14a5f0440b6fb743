//! Directions and scales of vectors of any length, without overflow and without loss of precision.

use glam::DVec3;

/// Returns `v / |v|` for any finite non-zero vector, even if `|v|²` would overflow or underflow.
pub fn unit(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    // Powers of two, so that a scaled vector has the same direction bit for bit.
    let scaled = if largest > 2f64.powi(500) {
        v * 2f64.powi(-600)
    } else if largest < 2f64.powi(-500) {
        v * 2f64.powi(600)
    } else {
        v
    };
    scaled / scaled.length()
}

/// Returns the power of two that scales a positive `largest` to 1..2, or 1 for zero.
pub(super) fn to_unit_scale(largest: f64) -> f64 {
    if largest == 0.0 {
        return 1.0;
    }
    let exponent = ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    2f64.powi(-exponent)
}

/// The largest sine of the angle between directions that count as parallel. Directions that are parallel on paper are
/// only nearly so after programs have computed them in floats.
pub(crate) const PARALLEL: f64 = 1.0 / (1u64 << 40) as f64;

pub(super) fn is_parallel(a: DVec3, b: DVec3) -> bool {
    let (a, b) = (level(a), level(b));
    cross(a, b).length() <= PARALLEL * a.length() * b.length()
}

/// Scales the vector by a power of two to a length of about 1.
pub(super) fn level(v: DVec3) -> DVec3 {
    v * to_unit_scale(v.abs().max_element())
}

/// Returns the cross product to within 1.5 units in the last place of each component, also for nearly parallel
/// vectors (Kahan's difference of products; Jeannerod, Louvet, Muller 2013, "Further analysis of Kahan's algorithm").
pub(super) fn cross(a: DVec3, b: DVec3) -> DVec3 {
    let difference = |a: f64, b: f64, c: f64, d: f64| {
        let cd = c * d;
        let error = (-c).mul_add(d, cd);
        a.mul_add(b, -cd) + error
    };
    DVec3::new(difference(a.y, b.z, a.z, b.y), difference(a.z, b.x, a.x, b.z), difference(a.x, b.y, a.y, b.x))
}

/// Returns the maximum of p·`direction` over some points.
pub(super) fn furthest(points: &[DVec3], direction: DVec3) -> f64 {
    points.iter().map(|p| p.dot(direction)).fold(f64::NEG_INFINITY, f64::max)
}

/// Returns the maximum of p·`direction` over a disc of radius 1 around the origin, perpendicular to `axis`.
pub(super) fn across(axis: DVec3, direction: DVec3) -> f64 {
    let axis = axis.normalize_or_zero();
    (direction - direction.dot(axis) * axis).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_vectors_of_any_length() {
        let check = |v: DVec3, expect: DVec3| assert!(unit(v).distance(expect) < 1e-15, "{v}");
        let diagonal = DVec3::ONE / 3f64.sqrt();
        for length in [5e-324, 1e-310, 1e-200, 1.0, 1e200, f64::MAX] {
            check(DVec3::NEG_Y * length, DVec3::NEG_Y);
            check(DVec3::ONE * length, diagonal);
        }
        check(DVec3::new(f64::MAX, 0.0, f64::MIN_POSITIVE), DVec3::X);
    }

    #[test]
    fn a_power_of_two_does_not_turn_a_vector() {
        let v = DVec3::new(0.1, -0.7, 0.3);
        for exponent in [-1000, -501, -499, -1, 1, 499, 501, 1000] {
            assert_eq!(unit(v * 2f64.powi(exponent)), unit(v), "2^{exponent}");
        }
    }
}
