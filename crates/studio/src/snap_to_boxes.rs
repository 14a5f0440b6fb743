//! Snapping of dragged objects to the faces and middles of other objects.
//!
//! All objects count by their boxes. Each axis is aligned alone.

use glam::DVec3;

use crate::view::Bounds;

/// The boxes of the dragged objects, and of those that they can be aligned with.
#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    /// The box around the dragged objects at the start.
    pub(crate) own: Bounds,
    /// The boxes of the others.
    pub(crate) others: Vec<Bounds>,
}

/// An alignment along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Snap {
    /// The index of the axis.
    pub(crate) axis: usize,
    /// The way along the axis from the start of the drag to the alignment.
    pub(crate) way: f64,
    /// The points of the two boxes that are at the same coordinate of the axis.
    pub(crate) guide: [DVec3; 2],
}

/// The lower face, the middle and the upper face of a box.
fn levels(of: &Bounds, axis: usize) -> [f64; 3] {
    [of.low[axis], of.center()[axis], of.high[axis]]
}

/// The levels of two boxes that are aligned: like with like, and face to face.
const PAIRS: [[usize; 2]; 5] = [[1, 1], [0, 0], [2, 2], [0, 2], [2, 0]];

impl Neighbours {
    /// Returns the nearest alignment along each of the `axes`, if there is one within `reach` of the drag by `by`.
    /// Of equal ones, that with the nearest box counts.
    pub(crate) fn snap(&self, by: DVec3, axes: [bool; 3], reach: f64) -> Vec<Snap> {
        let moved = self.own.center() + by;
        let nearest = |axis: usize| {
            let own = levels(&self.own, axis);
            let all = self.others.iter().flat_map(|other| {
                let levels = levels(other, axis);
                PAIRS.map(|[at, to]| (levels[to] - own[at], levels[to], other))
            });
            let off = |way: f64| (way - by[axis]).abs();
            // An alignment that there was at the start would hold the objects back.
            let within = all.filter(|&(way, ..)| off(way) <= reach && way.abs() > 1e-9 * reach);
            let (way, level, other) = within.min_by(|(a, _, one), (b, _, two)| {
                let far = |of: &Bounds| of.center().distance_squared(moved);
                // Alignments that differ by rounding alone are equal.
                let order = if (off(*a) - off(*b)).abs() <= 1e-9 * reach {
                    std::cmp::Ordering::Equal
                } else {
                    off(*a).total_cmp(&off(*b))
                };
                order.then(far(one).total_cmp(&far(two)))
            })?;
            let at = |mut point: DVec3| {
                point[axis] = level;
                point
            };
            Some(Snap { axis, way, guide: [at(moved), at(other.center())] })
        };
        (0..3).filter(|&axis| axes[axis]).filter_map(nearest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(x: f64, y: f64, radius: f64) -> Bounds {
        Bounds::of([(DVec3::new(x, y, 0.0), radius)]).unwrap()
    }

    fn ways(by: DVec3, others: Vec<Bounds>) -> Vec<(usize, f64)> {
        let neighbours = Neighbours { own: ball(0.0, 0.0, 1.0), others };
        neighbours.snap(by, [true, true, false], 0.25).iter().map(|snap| (snap.axis, snap.way)).collect()
    }

    #[test]
    fn faces_and_middles_are_aligned_within_reach() {
        let by = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let other = || vec![ball(5.0, 7.0, 0.5)];
        assert_eq!(ways(by(4.9, 3.0), other()), [(0, 5.0)], "middle to middle");
        assert_eq!(ways(by(5.6, 3.0), other()), [(0, 5.5)], "face to the face of the same side");
        assert_eq!(ways(by(3.4, 3.0), other()), [(0, 3.5)], "side by side");
        assert_eq!(
            ways(by(6.45, 6.9), other()),
            [(0, 6.5), (1, 7.0)],
            "both axes, the third is free to move"
        );
        assert_eq!(ways(by(4.0, 3.0), other()), [], "neither is near enough");
        assert_eq!(ways(by(4.9, 3.0), vec![]), []);
        assert_eq!(ways(by(0.1, 3.0), vec![ball(0.0, 7.0, 1.0)]), [], "it was aligned at the start");
    }

    #[test]
    fn the_guide_joins_the_nearest_of_equal_boxes() {
        let neighbours = Neighbours {
            own: ball(0.0, 0.0, 1.0),
            others: vec![ball(5.0, 70.0, 1.0), ball(5.0, 7.0, 1.0), ball(5.0, -9.0, 1.0)],
        };
        let snaps = neighbours.snap(DVec3::new(5.1, 0.0, 0.0), [true, false, false], 0.25);
        let guide = [DVec3::new(5.0, 0.0, 0.0), DVec3::new(5.0, 7.0, 0.0)];
        assert_eq!(snaps, [Snap { axis: 0, way: 5.0, guide }]);
    }
}
