//! The way of a packet of rays down a tree.

use fearless_simd::Simd;

use super::kind::Kind;
use super::real::{Real, Vec3};
use super::tree::{Content, Node, Tree};

/// Nodes that wait on the way down a tree of 2³⁰ objects, with room for a lopsided one.
const WAITING: usize = 128;

/// Aligned as the widest registers are, so that the compiler aligns the stack, and with it the registers that it keeps
/// there: unaligned, each of them lies in two cache lines.
#[repr(align(64))]
struct Waiting([u32; WAITING]);

/// Visits the leaves whose boxes `meets` some lane, nearer children first by the direction of the first lane.
#[inline(always)]
pub(super) fn descend<E: Real>(
    tree: &Tree<E>,
    backwards: [bool; 3],
    mut meets: impl FnMut(&Node<E>) -> bool,
    mut visit: impl FnMut(Kind, core::ops::Range<usize>) -> bool,
) {
    let Waiting(waiting) = &mut Waiting([0; WAITING]);
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
        let node = &tree.nodes[waiting[count] as usize];
        if !meets(node) {
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

/// Whether the first lane goes backwards along each axis.
#[inline(always)]
pub(super) fn backwards<S: Simd, E: Real>(direction: Vec3<S, E>) -> [bool; 3] {
    let zero = E::narrow(0.0);
    [direction.x[0] < zero, direction.y[0] < zero, direction.z[0] < zero]
}
