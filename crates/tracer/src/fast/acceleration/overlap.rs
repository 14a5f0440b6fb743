//! Clusters of objects whose bounding boxes overlap so much that they do not separate them.
//!
//! Builders of trees compare neighbours and choose by the surface area of their boxes. Among thousands of boxes that
//! nearly cover each other no choice is better than another, and the search for one takes time proportional to the
//! square of their number. This module finds such clusters in `n log n`: it sorts objects along a curve through their
//! centres (Morton, 1966). If the boxes of neighbours on it cover the same region many times, they are a cluster. The
//! tree is built of clusters as of single objects, and a cluster is halved along the curve.

use std::ops::Range;

use glam::{DVec3, UVec3, Vec3A};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

/// The number of objects below which comparing all pairs takes hardly any time.
const FEW: usize = 4096;

/// The number of neighbours on the curve that are examined together.
const NEIGHBOURS: usize = 64;

/// The smallest number of times that neighbours in a cluster cover their region. Neighbours in a mesh cover it a few
/// times.
const COVERED: f32 = 16.0;

/// The sampling interval: one object in this many is sorted to decide whether there may be a cluster.
const SAMPLED: u32 = 16;

/// The bits of a place on the curve along each axis.
const BITS: u32 = 10;

/// The bits of an object's index, below those of its place.
const INDEX: u32 = 32;

/// The objects in the order of the curve, and the ranges of that order that are clusters.
pub(crate) struct OverlapClusters {
    pub(crate) order: Vec<u32>,
    pub(crate) ranges: Vec<Range<usize>>,
}

impl OverlapClusters {
    /// Returns `None` if there are no clusters, or only few objects.
    pub(crate) fn find(boxes: &[Aabb]) -> Option<Self> {
        if boxes.len() < FEW {
            return None;
        }
        let place = |at: u32| {
            let of = &boxes[at as usize];
            0.5 * of.min + 0.5 * of.max
        };
        if !may_have_crowds(boxes, &place) {
            return None;
        }
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        sort(&place, &mut order, FEW);
        let mut ranges: Vec<Range<usize>> = Vec::new();
        for from in (0..order.len()).step_by(NEIGHBOURS) {
            let end = (from + NEIGHBOURS).min(order.len());
            if Together::of(order[from..end].iter().map(|&at| &boxes[at as usize])).covers(COVERED) {
                match ranges.last_mut() {
                    Some(last) if last.end == from => last.end = end,
                    Some(_) | None => ranges.push(from..end),
                }
            }
        }
        let crowded: usize = ranges.iter().map(Range::len).sum();
        (crowded >= FEW).then_some(Self { order, ranges })
    }
}

/// Returns whether some objects, picked regardless of their order, are so close that all objects near them may be a
/// cluster. Along a line, the distance between neighbouring picked objects grows at most with the number of objects
/// between them.
fn may_have_crowds(boxes: &[Aabb], place: &(impl Fn(u32) -> Vec3A + Sync)) -> bool {
    // Fibonacci hashing (Knuth, The Art of Computer Programming, 6.4).
    let is_picked = |at: &u32| at.wrapping_mul(0x9e37_79b9) < u32::MAX / SAMPLED;
    let mut picked: Vec<u32> = (0..boxes.len() as u32).filter(is_picked).collect();
    sort(place, &mut picked, FEW / SAMPLED as usize);
    let least = COVERED / SAMPLED as f32;
    picked.chunks(NEIGHBOURS).any(|chunk| {
        let chunk = Together::of(chunk.iter().map(|&at| &boxes[at as usize]));
        chunk.covers(least) || chunk.is_long()
    })
}

/// A group of boxes.
struct Together {
    whole: Aabb,
    area: f32,
    length: f32,
}

impl Together {
    fn of<'a>(boxes: impl Iterator<Item = &'a Aabb>) -> Self {
        let nothing = Self { whole: Aabb::empty(), area: 0.0, length: 0.0 };
        boxes.fold(nothing, |sum, of| Self {
            whole: sum.whole.union(of),
            area: sum.area + of.half_area(),
            length: sum.length + length(of),
        })
    }

    /// Returns whether the boxes cover their region this many times.
    fn covers(&self, times: f32) -> bool {
        let place = self.whole.half_area();
        // Boxes along a line have no area.
        if place > 0.0 { self.area >= times * place } else { self.length >= times * length(&self.whole) }
    }

    /// Returns whether the boxes are together many times as long as their region, or have no size at all. Boxes without
    /// an area cover nothing.
    fn is_long(&self) -> bool {
        self.length == 0.0 || self.length >= COVERED * length(&self.whole)
    }
}

/// Returns the sum of a box's lengths along the axes.
fn length(of: &Aabb) -> f32 {
    of.diagonal().element_sum()
}

/// Sorts objects along the curve. Objects in one place of it are sorted along a finer one, unless they are `few`.
fn sort(place: &(impl Fn(u32) -> Vec3A + Sync), order: &mut [u32], few: usize) {
    let (low, high) = order.iter().fold((Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(low, high), &at| {
        (low.min(place(at)), high.max(place(at)))
    });
    let size = f64::from((high - low).max_element());
    // The size may also be NaN.
    if !(size > 0.0 && size.is_finite()) {
        return;
    }
    let cells = f64::from((1u32 << BITS) - 1) / size;
    let mut places: Vec<u64> = order
        .par_iter()
        .map(|&at| {
            let cell: DVec3 = (place(at).as_dvec3() - low.as_dvec3()) * cells;
            along_curve(cell.as_uvec3()) << INDEX | u64::from(at)
        })
        .collect();
    places.par_sort_unstable();
    for (at, place) in order.iter_mut().zip(&places) {
        *at = (place & ((1 << INDEX) - 1)) as u32;
    }
    let mut from = 0;
    for same in places.chunk_by(|a, b| a >> INDEX == b >> INDEX) {
        if same.len() >= few {
            sort(place, &mut order[from..from + same.len()], few);
        }
        from += same.len();
    }
}

/// Interleaves the bits of three numbers.
fn along_curve(cell: UVec3) -> u64 {
    let spread = |x: u32| {
        let x = u64::from(x);
        let x = (x | x << 16) & 0xff_0000_ff00_00ff;
        let x = (x | x << 8) & 0xf00f_00f0_0f00_f00f;
        let x = (x | x << 4) & 0x30c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(middle: Vec3A, half: Vec3A) -> Aabb {
        Aabb { min: middle - half, max: middle + half }
    }

    fn place(rng: &mut fastrand::Rng) -> Vec3A {
        Vec3A::new(rng.f32(), rng.f32(), rng.f32())
    }

    #[test]
    fn a_crowd_is_found_wherever_it_stands_and_scattered_boxes_are_none() {
        let mut rng = fastrand::Rng::with_seed(1);
        let mut boxes: Vec<Aabb> = (0..20_000).map(|_| around(place(&mut rng), Vec3A::splat(0.01))).collect();
        assert!(OverlapClusters::find(&boxes).is_none(), "scattered");
        // In one ten-thousandth of the scene, in no order.
        for half in [Vec3A::splat(1e-5), Vec3A::new(1e-5, 0.0, 0.0), Vec3A::ZERO] {
            let mut mixed = boxes.clone();
            mixed.extend((0..20_000).map(|_| around(Vec3A::splat(0.3) + 1e-7 * place(&mut rng), half)));
            rng.shuffle(&mut mixed);
            let found = OverlapClusters::find(&mixed).expect("a crowd");
            let crowded: usize = found.ranges.iter().map(Range::len).sum();
            // Most of the cluster is found. At the ends of the chunks, boxes without a size are in several places.
            assert!((15_000..22_000).contains(&crowded), "{crowded} of 20000, {half}");
            let mut order = found.order.clone();
            order.sort_unstable();
            assert!(order.into_iter().eq(0..40_000), "each once");
        }
        boxes.truncate(FEW - 1);
        let first = boxes[0];
        boxes.fill(first);
        assert!(OverlapClusters::find(&boxes).is_none(), "few");
    }

    #[test]
    fn neighbours_on_the_curve_share_their_first_bits() {
        assert_eq!(along_curve(UVec3::new(1, 0, 0)), 1);
        assert_eq!(along_curve(UVec3::new(0, 1, 0)), 2);
        assert_eq!(along_curve(UVec3::new(2, 0, 1)), 12);
        assert_eq!(along_curve(UVec3::splat((1 << BITS) - 1)), (1 << (3 * BITS)) - 1);
    }
}
