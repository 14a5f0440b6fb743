//! Finds the region where two surfaces are within a slack of each other, and its width.
//!
//! This module is geometry alone. It does not consider visibility or intersection tests.

use glam::DVec3;

use crate::fast::rays::placed::Face;

/// The distance, relative to their coordinates, below which two surfaces are treated as coincident.
pub(crate) const MEANT: f64 = 1e-13;

/// Returns the width of the strip on the sphere of `radius` along which a smaller sphere of radius `r`, with its centre
/// `apart` from the first, is within the slack.
///
/// A point of the sphere at the angle θ from the axis through both centres has a distance q from the centre of the
/// other, with `q² = (radius - apart)² + 4·radius·apart·sin²(θ/2)`.
pub(crate) fn ring_on_sphere(radius: f64, r: f64, apart: f64, slack: f64) -> f64 {
    let angle = |q: f64| {
        let near = radius - apart;
        let square = (q - near) * (q + near) / (4.0 * radius * apart).max(f64::MIN_POSITIVE);
        2.0 * libm::asin(square.clamp(0.0, 1.0).sqrt())
    };
    radius * (angle(r + slack) - angle((r - slack).max(0.0)))
}

/// Returns the width of the ring on a face that is within the slack of a sphere.
pub(crate) fn ring_on_plane(face: &Face, center: DVec3, radius: f64, slack: f64) -> f64 {
    let height = face.normal.dot(center - face.corners[0]).abs();
    let ring = |height: f64| ((radius - height) * (radius + height)).max(0.0).sqrt();
    let (inner, outer) = (ring(height + slack), ring((height - slack).max(0.0)));
    let foot = |corner: DVec3| ((corner - center).length_squared() - height * height).max(0.0).sqrt();
    let farthest = face.corners.map(foot).into_iter().fold(0.0, f64::max);
    let beside = face.edges().map(|(from, inwards)| inwards.dot(from - center) / inwards.length());
    let nearest = beside.fold(0.0, f64::max);
    if nearest <= outer && farthest >= inner { outer - inner } else { 0.0 }
}

impl Face {
    /// Returns, for each edge, a point of it, and a vector in the plane that points inwards and is as long as the edge.
    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        (0..4).filter_map(move |k| {
            let (from, to) = (self.corners[k], self.corners[(k + 1) % 4]);
            (from != to).then(|| (from, self.normal.cross(to - from)))
        })
    }

    /// Returns whether the faces may overlap by more than `depth`: no edge of this face separates them to within
    /// `depth`.
    fn may_cover(&self, other: &Self, depth: f64) -> bool {
        self.edges().all(|(from, inwards)| {
            let within = |corner: DVec3| inwards.dot(corner - from);
            let deepest = other.corners.map(within).into_iter().fold(0.0, f64::max);
            deepest * deepest > depth * depth * inwards.length_squared()
        })
    }
}

/// Returns whether two faces are within the slack of each other over more than a pixel.
pub(crate) fn faces_z_fight(a: &Face, b: &Face, slack: f64, pixel: f64) -> bool {
    is_within(a, b, slack, pixel) || is_within(b, a, slack, pixel)
}

/// Returns whether a part of `b` that is wider than a pixel is over `a` within the slack of its plane.
fn is_within(a: &Face, b: &Face, slack: f64, pixel: f64) -> bool {
    // Faces at an angle are near each other only in a strip around the intersection of their planes, which is narrower
    // the larger the angle.
    if 4.0 * slack * slack < pixel * pixel * a.normal.cross(b.normal).length_squared() {
        return false;
    }
    let height = |corner: DVec3| a.normal.dot(corner - a.corners[0]);
    let span = |corners: &[DVec3]| {
        corners
            .iter()
            .map(|corner| height(*corner))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| {
                (low.min(height), high.max(height))
            })
    };
    let is_near = |(low, high): (f64, f64)| {
        let largest = a.corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
        // Surfaces that are meant to coincide are hit at the same distance if they round to the same numbers in single
        // precision.
        let is_apart = high.max(-low) > MEANT * largest;
        low <= slack && high >= -slack && (is_apart || !a.is_one_in_single(b))
    };
    if !is_near(span(&b.corners)) || !a.may_cover(b, pixel) || !b.may_cover(a, pixel) {
        return false;
    }
    // The part of one face that is over the other (Sutherland and Hodgman).
    let mut over = b.corners.to_vec();
    for (from, inwards) in a.edges() {
        let depth = |corner: DVec3| inwards.dot(corner - from);
        let mut within = Vec::new();
        for (at, &corner) in over.iter().enumerate() {
            let before = over[(at + over.len() - 1) % over.len()];
            let (d, e) = (depth(before), depth(corner));
            if (d < 0.0) != (e < 0.0) {
                within.push(before.lerp(corner, d / (d - e)));
            }
            if e >= 0.0 {
                within.push(corner);
            }
        }
        over = within;
    }
    !over.is_empty() && is_near(span(&over))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(from: f64, to: f64) -> Face {
        let corner = |x: f64, z: f64| DVec3::new(x, 1.0, z);
        let corners = [corner(from, from), corner(from, to), corner(to, to), corner(to, from)];
        Face { corners, normal: DVec3::Y, height: 1.0 }
    }

    #[test]
    fn a_sphere_lies_near_a_face_along_a_ring_or_around_where_it_touches() {
        let ring = |face: &Face, height: f64, slack: f64| {
            ring_on_plane(face, DVec3::new(0.0, 1.0 + height, 0.0), 5.0, slack)
        };
        let wide = square(-9.0, 9.0);
        // A ring of radius 4, which the slack widens by height / radius to both sides.
        assert!((ring(&wide, 3.0, 1e-6) / 1.5e-6 - 1.0).abs() < 1e-5);
        assert_eq!(ring(&wide, 3.0, 1e-6), ring(&wide, -3.0, 1e-6));
        for gap in [-1e-6f64, 0.0, 0.5e-6] {
            let expected = (10.0 * (1e-6 - gap)).sqrt() - (10.0 * (-1e-6 - gap)).max(0.0).sqrt();
            assert!((ring(&wide, 5.0 + gap, 1e-6) / expected - 1.0).abs() < 1e-5, "{gap}");
        }
        assert_eq!(ring(&wide, 5.0 + 2e-6, 1e-6), 0.0, "above it");
        assert_eq!(ring(&square(-2.0, 2.0), 3.0, 1e-6), 0.0, "within the ring");
        assert_eq!(ring(&square(5.0, 9.0), 3.0, 1e-6), 0.0, "beside the ring");
    }

    #[test]
    fn the_strip_between_spheres_is_as_wide_as_one_sees_by_walking_along_it() {
        for (radius, r, apart) in
            [(2.0, 1.0, 1.0), (2.0, 1.0, 1.2), (3.0, 2.9, 0.3), (2.0, 2.0, 1e-3), (1.0, 1.0, 0.0)]
        {
            for slack in [1e-3, 1e-2] {
                let steps = 1_000_000;
                let step = std::f64::consts::PI / f64::from(steps);
                let near = |k: &u32| {
                    let angle = (f64::from(*k) + 0.5) * step;
                    let (x, y) = (radius * angle.cos() - apart, radius * angle.sin());
                    (x.hypot(y) - r).abs() <= slack
                };
                let walked = (0..steps).filter(near).count() as f64 * step * radius;
                let strip = ring_on_sphere(radius, r, apart, slack);
                assert!((strip - walked).abs() < 1e-5, "{radius} {r} {apart} {slack}: {strip}, {walked}");
            }
        }
    }
}
