//! Whether triangles close a body.

use std::collections::HashMap;

use glam::DVec3;

/// Whether the triangles of a model close a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Closure {
    /// Every edge occurs as often in one direction as in the other, and the triangles enclose a volume.
    Closed,
    /// An edge occurs more often in one direction than in the other; the points are its start and its end.
    Open([DVec3; 2]),
    /// The faces are seen clockwise from outside.
    InsideOut,
    /// The body is flat.
    NoVolume,
}

/// The share of its box that a body's volume exceeds: 2⁻⁴⁰.
const LEAST_VOLUME: f64 = 1.0 / (1u64 << 40) as f64;

/// Returns for each position the index of the first one that equals it. 0 and -0 are equal.
pub(crate) fn joined(positions: &[DVec3]) -> Vec<u32> {
    let mut first: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len());
    positions
        .iter()
        .zip(0u32..)
        .map(|(p, i)| *first.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert(i))
        .collect()
}

/// Returns whether triangles, all of which have an area, close a body.
pub(crate) fn closure(positions: &[DVec3], triangles: &[[u32; 3]]) -> Closure {
    let joined = joined(positions);
    let mut edges: HashMap<(u32, u32), i32> = HashMap::with_capacity(2 * triangles.len());
    for triangle in triangles {
        let [a, b, c] = triangle.map(|i| joined[i as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (key, step) = if from < to { ((from, to), 1) } else { ((to, from), -1) };
            *edges.entry(key).or_default() += step;
        }
    }
    // The least of the open edges, so that it is the same each time.
    let open = edges.iter().filter(|(_, balance)| **balance != 0).min_by_key(|(edge, _)| **edge);
    if let Some(((from, to), _)) = open {
        return Closure::Open([positions[*from as usize], positions[*to as usize]]);
    }
    let corners = || triangles.iter().map(|triangle| triangle.map(|i| positions[i as usize]));
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    for corner in corners().flatten() {
        (low, high) = (low.min(corner), high.max(corner));
    }
    // In units of the box, so that nothing overflows.
    let size = (0.5 * high - 0.5 * low).map(|x| if x > 0.0 { x } else { 1.0 });
    let middle = 0.5 * low + 0.5 * high;
    let own = |p: DVec3| (0.5 * p - 0.5 * middle) / (0.5 * size);
    let volume: f64 = corners().map(|t| t.map(own)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum();
    let share = volume / 8.0;
    if share > LEAST_VOLUME {
        Closure::Closed
    } else if share < -LEAST_VOLUME {
        Closure::InsideOut
    } else {
        Closure::NoVolume
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a tetrahedron, its faces seen counterclockwise from outside.
    fn tetrahedron(scale: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| scale * p).to_vec();
        (positions, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    }

    #[test]
    fn a_body_is_closed_whatever_its_size() {
        for scale in [1.0, 1e-150, 1e150, 1e300] {
            let (positions, mut triangles) = tetrahedron(scale);
            assert_eq!(closure(&positions, &triangles), Closure::Closed, "{scale:e}");
            triangles.iter_mut().for_each(|t| t.swap(0, 1));
            assert_eq!(closure(&positions, &triangles), Closure::InsideOut, "{scale:e}");
            triangles.pop();
            assert!(matches!(closure(&positions, &triangles), Closure::Open(_)));
        }
    }

    #[test]
    fn vertices_are_joined_where_they_are_equal() {
        let (positions, triangles) = tetrahedron(1.0);
        let soup: Vec<DVec3> = triangles.iter().flatten().map(|i| positions[*i as usize]).collect();
        let corners: Vec<[u32; 3]> = (0..4).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        assert_eq!(closure(&soup, &corners), Closure::Closed);
    }

    #[test]
    fn a_sheet_of_two_sides_has_no_volume() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(closure(&positions, &[[0, 1, 2], [0, 2, 1]]), Closure::NoVolume);
    }
}
