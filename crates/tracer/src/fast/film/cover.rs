//! The cover of pixels, in scenes without background: one step after the hits of camera rays are known, and one after
//! those of rays through glass.

use crate::fast::arithmetic::real::Real;
use crate::fast::rays::bounce::{Column, Hits, RayBatch};
use crate::fast::transport::ray_queue::RayQueues;

/// Gives the first `count` pixels the cover of their camera rays: 1 if the ray hits anything. A packet has `lanes`
/// lanes.
#[inline(never)]
pub(crate) fn cover_hits<E: Real>(hits: &Hits<E>, count: usize, lanes: usize, cover: &mut Column<E>) {
    cover.0[..count].fill(E::narrow(1.0));
    each_miss(hits, count, lanes, |ray| cover.0[ray] = E::narrow(0.0));
}

/// Counts the rays of a batch that have passed only through glass and hit nothing, and makes them black.
#[inline(never)]
pub(crate) fn let_through<E: Real>(
    waiting: &mut RayQueues<E>,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
    lanes: usize,
) {
    let mut missed = vec![];
    each_miss(hits, queue.count, lanes, |ray| missed.push(ray));
    for ray in missed {
        if waiting.lets_through(ray, queue.pixel.0[ray].to_index()) {
            hits.color.iter_mut().for_each(|channel| channel.0[ray] = E::narrow(0.0));
        }
    }
}

/// Calls `each` with the first `count` rays of a batch that hit nothing.
#[inline(always)]
fn each_miss<E: Real>(hits: &Hits<E>, count: usize, lanes: usize, mut each: impl FnMut(usize)) {
    let mut packets = hits.packets.iter().map(|&(at, _)| at).peekable();
    for at in (0..count).step_by(lanes) {
        let has_hits = packets.next_if_eq(&at).is_some();
        (at..(at + lanes).min(count)).filter(|&ray| !(has_hits && hits.is_hit(ray))).for_each(&mut each);
    }
}
