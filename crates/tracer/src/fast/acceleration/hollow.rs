//! Balls without surfaces, for trees of bodies that lie around one another.
//!
//! The boxes of such bodies overlap and separate nothing: from a place within them all, every ray would test every
//! body. But a ray whose search begins and ends in a ball without surfaces has no hit there, because a ball is convex.
//! The ball of a node lies within the balls of all bodies below it, if these have a common part.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::acceleration::tree::{Content, Tree};
use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant, splat};
use crate::fast::rays::packet::Ray;

/// The margin of a ball, in roundoffs of its numbers. Hits have errors of at most 32 roundoffs across a surface.
const NARROWER: f64 = 1024.0;

/// A ball without surfaces: its centre and radius.
pub(crate) type Hollow = (DVec3, f64);

/// The balls of a tree's nodes.
#[derive(Debug)]
pub(crate) struct Hollows<E> {
    /// For each node the centre and the square of the radius, which is 0 if it has no ball.
    balls: Vec<([E; 3], E)>,
}

impl<E: Real> Hollows<E> {
    /// Makes the balls of the nodes of a tree. `of_item` returns the ball of an object, by its index. Returns `None` if
    /// fewer than half of the nodes with children have one, because bodies beside each other have no common ball.
    pub(crate) fn new(tree: &Tree<E>, of_item: impl Fn(usize) -> Option<Hollow>) -> Option<Self> {
        let mut balls: Vec<Option<Hollow>> = vec![None; tree.nodes.len()];
        // Children come after their parents.
        for (at, node) in tree.nodes.iter().enumerate().rev() {
            balls[at] = match node.content() {
                Content::Leaf(_, items) => items.map(&of_item).reduce(within_both).flatten(),
                Content::Children(first, _) => within_both(balls[first as usize], balls[first as usize + 1]),
            };
        }
        let (mut parents, mut common) = (0, 0);
        for (node, ball) in tree.nodes.iter().zip(&balls) {
            let is_parent = matches!(node.content(), Content::Children(..));
            parents += usize::from(is_parent);
            common += usize::from(is_parent && ball.is_some());
        }
        let has_many = common > 0 && 2 * common >= parents;
        let ball = |ball: Option<Hollow>| {
            let (center, radius) = ball.unwrap_or((DVec3::ZERO, 0.0));
            let numbers = center.abs().element_sum() + radius;
            let radius = (radius - NARROWER * E::ROUNDOFF * (1.0 + numbers)).max(0.0);
            (center.to_array().map(E::narrow), E::narrow(radius * radius))
        };
        has_many.then(|| Self { balls: balls.into_iter().map(ball).collect() })
    }

    /// Returns whether all rays begin and end in a node's ball. Rays with a negative distance are not followed, and
    /// always count.
    #[inline(always)]
    pub(crate) fn hold<S: Simd>(&self, simd: S, at: usize, ray: Ray<S, E>, distance: Lanes<S, E>) -> bool {
        let (center, square) = self.balls[at];
        let zero = constant::<S, E>(simd, 0.0);
        let square = splat::<S, E>(simd, square);
        let begin = ray.origin.sub(Vec3::splat(simd, center));
        let end = ray.direction.scale_add(distance, begin);
        let held = begin.dot(begin).simd_lt(square) & end.dot(end).simd_lt(square);
        (held | distance.simd_lt(zero)).all_true()
    }
}

/// Returns the largest ball within two.
fn within_both(one: Option<Hollow>, other: Option<Hollow>) -> Option<Hollow> {
    let ((a, r), (b, s)) = (one?, other?);
    let apart = (b - a).length();
    if apart + r <= s {
        return one;
    }
    if apart + s <= r {
        return other;
    }
    // They overlap from the near side of the second to the far side of the first.
    let (from, to) = (apart - s, r);
    (from < to).then(|| (a + (b - a) * (0.5 * (from + to) / apart), 0.5 * (to - from)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_within_two_is_the_smaller_one_or_touches_both() {
        let ball = |x: f64, r: f64| Some((DVec3::new(x, 0.5, 0.0), r));
        assert_eq!(within_both(ball(1.0, 2.0), ball(1.5, 1.0)), ball(1.5, 1.0));
        assert_eq!(within_both(ball(1.5, 1.0), ball(1.0, 2.0)), ball(1.5, 1.0));
        assert_eq!(within_both(ball(0.0, 2.0), ball(3.0, 2.0)), ball(1.5, 0.5));
        assert_eq!(within_both(ball(0.0, 1.0), ball(3.0, 2.0)), None);
        assert_eq!(within_both(ball(0.0, 1.0), None), None);
    }
}
