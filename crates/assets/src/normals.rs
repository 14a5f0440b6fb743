//! Normals averaged over the faces around a point.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use crate::closure::joined;

/// Returns normals, and their indices at the corners of each triangle. A normal at a corner is the sum of the unit
/// normals of faces, each times the face's angle there. These are the faces that are reached from the corner's own face
/// around the point, over edges where two faces meet at less than an angle in degrees. Equal normals at one point are
/// shared.
pub(crate) fn smoothed(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    degrees: f64,
) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let joined = joined(positions);
    let points: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|i| joined[i as usize])).collect();
    let faces: Vec<DVec3> = triangles.iter().map(|t| face_normal(t.map(|i| positions[i as usize]))).collect();
    // The two faces of each edge; `None` as the second one if a third was found.
    let mut edges: HashMap<(u32, u32), (u32, Option<u32>, u32)> = HashMap::with_capacity(2 * points.len());
    for (face, [a, b, c]) in (0u32..).zip(&points) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let edge = edges.entry(((*from).min(*to), (*from).max(*to))).or_insert((face, None, 0));
            edge.2 += 1;
            if edge.2 == 2 {
                edge.1 = Some(face);
            }
        }
    }
    let least = if degrees >= 180.0 { -2.0 } else { libm::cos(degrees.to_radians()) };
    // Corners at one point are joined over smooth edges: a forest over all corners.
    let mut parent: Vec<u32> = (0..3 * points.len() as u32).collect();
    let corner = |face: u32, point: u32| {
        let at = points[face as usize].iter().position(|p| *p == point).unwrap_or_default();
        3 * face + at as u32
    };
    for ((from, to), (first, second, count)) in &edges {
        let (Some(second), 2) = (second, *count) else { continue };
        let cosine = faces[*first as usize].dot(faces[*second as usize]);
        if cosine <= least {
            continue;
        }
        for point in [from, to] {
            let (a, b) =
                (root(&mut parent, corner(*first, *point)), root(&mut parent, corner(*second, *point)));
            // The lower one stays the root, so that the result does not depend on the order of the edges.
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let mut sums: HashMap<u32, DVec3> = HashMap::new();
    for face in 0..points.len() {
        let corners = triangles[face].map(|i| positions[i as usize]);
        for at in 0..3 {
            let angle = angle(corners[at], corners[(at + 1) % 3], corners[(at + 2) % 3]);
            let root = root(&mut parent, (3 * face + at) as u32);
            *sums.entry(root).or_default() += angle * faces[face];
        }
    }
    let (mut normals, mut places) = (Vec::with_capacity(sums.len()), HashMap::with_capacity(sums.len()));
    let normal_of = (0..points.len())
        .map(|face| {
            [0, 1, 2].map(|at| {
                let root = root(&mut parent, (3 * face + at) as u32);
                *places.entry(root).or_insert_with(|| {
                    normals.push(sums[&root].normalize_or_zero().as_vec3());
                    normals.len() as u32 - 1
                })
            })
        })
        .collect();
    (normals, normal_of)
}

fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        let above = parent[parent[at as usize] as usize];
        parent[at as usize] = above;
        at = above;
    }
    at
}

/// Returns the unit normal of a triangle, towards the side from which its corners go round counterclockwise.
pub(crate) fn face_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    scaled(b - a).cross(scaled(c - a)).normalize_or_zero()
}

/// Returns the angle at `p` between the directions to two other points.
fn angle(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (a, b) = (scaled(a - p), scaled(b - p));
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// Returns a vector of about unit length, so that its products neither overflow nor vanish.
fn scaled(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    if largest > 0.0 { v / largest } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two squares that meet at an edge along z, at 90 degrees.
    fn corner() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let positions = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 1], [0, -1, 0], [0, -1, 1]];
        let positions = positions.map(|p: [i32; 3]| DVec3::from(p.map(f64::from))).to_vec();
        (positions, vec![[0, 1, 3], [0, 3, 2], [1, 0, 4], [1, 4, 5]])
    }

    #[test]
    fn faces_are_averaged_where_they_meet_at_less_than_the_angle() {
        let (positions, triangles) = corner();
        let at = |degrees, face: usize, corner: usize| {
            let (normals, normal_of) = smoothed(&positions, &triangles, degrees);
            normals[normal_of[face][corner] as usize].as_dvec3()
        };
        assert!((at(89.0, 0, 0) - DVec3::Y).length() < 1e-7, "an edge");
        let half = DVec3::new(-1.0, 1.0, 0.0).normalize();
        assert!((at(91.0, 0, 0) - half).length() < 1e-6, "{}: weighted by angles", at(91.0, 0, 0));
        assert!((at(180.0, 0, 0) - half).length() < 1e-6);
        assert!((at(91.0, 0, 2) - DVec3::Y).length() < 1e-7, "away from the edge");
        assert_eq!(smoothed(&positions, &triangles, 0.0).0.len(), 3 * 4, "nothing is below 0 degrees");
    }

    #[test]
    fn a_point_that_fans_share_has_a_normal_in_each() {
        // Two pairs of faces that share a point alone.
        let positions: Vec<DVec3> =
            [[0, 0, 0], [1, 0, 0], [1, 0, -1], [0, 0, -1], [-1, 0, 0], [-1, 1, 0], [0, 1, 0]]
                .map(|p: [i32; 3]| DVec3::from(p.map(f64::from)))
                .to_vec();
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 6, 5], [0, 5, 4]];
        let (normals, normal_of) = smoothed(&positions, &triangles, 180.0);
        let of = |face: usize| normals[normal_of[face][0] as usize];
        assert_eq!((of(0), of(2)), (Vec3::Y, Vec3::Z));
    }
}
