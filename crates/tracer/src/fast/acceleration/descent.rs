//! The traversal of a tree by a packet of rays.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::acceleration::tree::{Content, Node, Tree};
use crate::fast::arithmetic::real::{Fused, Lanes, Real, Vec3, constant};
use crate::fast::arithmetic::rounding::distance_error;
use crate::fast::rays::bounds::Crossing;
use crate::fast::rays::kind::Kind;
use crate::fast::rays::packet::{Nearest, Ray};

/// The number of nodes on the stack: enough for a tree of 2³⁰ objects, with room for an unbalanced one.
const WAITING: usize = 128;

/// The stack of the traversal. It is aligned like the widest registers, so that the compiler aligns the call stack, and
/// with it the registers that are spilled there. Unaligned, each of those would span two cache lines.
#[repr(align(64))]
struct RayQueues([u32; WAITING]);

/// Visits the leaves for whose boxes `intersects` returns true. Nearer children come first, by the direction of the first
/// lane.
#[inline(always)]
pub(crate) fn descend<E: Real>(
    tree: &Tree<E>,
    backwards: [bool; 3],
    mut intersects: impl FnMut(usize, &Node<E>) -> bool,
    mut visit: impl FnMut(Kind, core::ops::Range<usize>) -> bool,
) {
    let RayQueues(waiting) = &mut RayQueues([0; WAITING]);
    let mut spilled = Vec::new();
    let mut count = 1;
    loop {
        if count == 0 {
            match spilled.pop() {
                Some(node) => {
                    waiting[0] = node;
                    count = 1;
                }
                None => return,
            }
        }
        count -= 1;
        let at = waiting[count] as usize;
        let node = &tree.nodes[at];
        if !intersects(at, node) {
            continue;
        }
        match node.content() {
            Content::Leaf(kind, items) => {
                if !visit(kind, items) {
                    return;
                }
            }
            Content::Children(first, axis) => {
                // The first child is the one that comes first along the axis.
                let far_first = u32::from(backwards[axis]);
                if count + 2 > WAITING {
                    spilled.extend_from_slice(&waiting[..count]);
                    count = 0;
                }
                waiting[count] = first + 1 - far_first;
                waiting[count + 1] = first + far_first;
                count += 2;
            }
        }
    }
}

/// Returns whether the first lane goes backwards along each axis.
#[inline(always)]
pub(crate) fn backwards<S: Simd, E: Real>(direction: Vec3<S, E>) -> [bool; 3] {
    let zero = E::narrow(0.0);
    [direction.x[0] < zero, direction.y[0] < zero, direction.z[0] < zero]
}

/// Visits the leaves that rays can hit no farther than their nearest hits so far, and returns the nearest hits. `visit` offers
/// the hits with the objects of a leaf.
#[inline(always)]
pub(crate) fn nearest_in<S: Simd, E: Real>(
    simd: S,
    tree: &Tree<E>,
    ray: Ray<S, E>,
    nearest: Nearest<S, E>,
    mut visit: impl FnMut(Kind, core::ops::Range<usize>, &mut Nearest<S, E>),
) -> Nearest<S, E> {
    nearest_past(
        simd,
        tree,
        ray,
        nearest,
        #[inline(always)]
        |_, _| false,
        #[inline(always)]
        |kind, items, nearest| {
            visit(kind, items, nearest);
            true
        },
    )
}

/// Works as [`nearest_in`], but skips a node if `is_missed` returns that no ray hits anything in it, given its number
/// and how far the rays are followed. Ends once `visit` returns false.
#[inline(always)]
pub(crate) fn nearest_past<S: Simd, E: Real>(
    simd: S,
    tree: &Tree<E>,
    ray: Ray<S, E>,
    nearest: Nearest<S, E>,
    is_missed: impl Fn(usize, Lanes<S, E>) -> bool,
    mut visit: impl FnMut(Kind, core::ops::Range<usize>, &mut Nearest<S, E>) -> bool,
) -> Nearest<S, E> {
    let found = core::cell::Cell::new(nearest);
    // A computed distance is below that of the box around its object by no more than this error.
    let slack = constant::<S, E>(simd, distance_error::<E>());
    let limit = core::cell::Cell::new(nearest.distance.fused_mul_add(slack, nearest.distance + slack));
    let crossing = Crossing::new(simd, ray);
    descend(
        tree,
        backwards(ray.direction),
        #[inline(always)]
        |at, node| {
            crossing.intersects(simd, node.low, node.high, limit.get()).any_true()
                && !is_missed(at, limit.get())
        },
        #[inline(always)]
        |kind, items| {
            let mut nearest = found.get();
            let goes_on = visit(kind, items, &mut nearest);
            found.set(nearest);
            limit.set(nearest.distance.fused_mul_add(slack, nearest.distance + slack));
            goes_on
        },
    );
    found.get()
}
