//! A background of two colours, or a picture all around: a separate step for the rays that hit nothing.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::Background;

use crate::fast::arithmetic::real::{Fused, Lanes, Real, Vec3, constant};
use crate::fast::rays::bounce::{Column, Hits, RayBatch};
use crate::pictures::Panorama;

/// The colour `low + rise · (½ + ½·y)` for a ray direction of height y.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sky<E> {
    low: [E; 3],
    rise: [E; 3],
}

impl<E: Real> Sky<E> {
    /// Returns `None` if the background has one colour.
    pub(crate) fn new(background: Background) -> Option<Self> {
        let (low, high) = background.colors();
        let rise = high? - low;
        Some(Self { low: low.to_array().map(E::narrow), rise: rise.to_array().map(E::narrow) })
    }
}

/// Gives the first `count` rays of a queue that hit nothing the light of a picture, ray by ray. A packet has `lanes`
/// lanes. With `EYE` they all have a weight of 1.
#[inline(never)]
pub(crate) fn show_panorama<E: Real, const EYE: bool>(
    panorama: &Panorama,
    (count, lanes): (usize, usize),
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    let read = |columns: &[Column<E>; 3], ray: usize| {
        DVec3::from_array([0, 1, 2].map(|axis: usize| columns[axis].0[ray].widen()))
    };
    let mut packet = 0;
    for at in (0..count).step_by(lanes) {
        let has_hits = hits.packets.get(packet).is_some_and(|&(first, _)| first == at);
        packet += usize::from(has_hits);
        for ray in at..(at + lanes).min(count) {
            if has_hits && hits.is_hit(ray) {
                continue;
            }
            let light = panorama.along(read(&queue.direction, ray));
            let light = if EYE { light } else { light * read(&queue.weight, ray) };
            for (column, channel) in hits.color.iter_mut().zip(light.to_array()) {
                column.0[ray] = E::narrow(channel);
            }
        }
    }
}

/// Gives the first `count` rays of a queue that hit nothing the colour of the sky. With `EYE` they all have a weight of
/// 1.
#[inline(never)]
pub(crate) fn show_sky<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    sky: &Sky<E>,
    count: usize,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let half = constant::<S, E>(simd, 0.5);
            let far = constant::<S, E>(simd, E::FAR);
            let mut packets = hits.packets.iter().map(|&(at, _)| at).peekable();
            for at in (0..count).step_by(Lanes::<S, E>::LEN) {
                let height = Vec3::<S, E>::load(simd, &queue.direction, at).y.fused_mul_add(half, half);
                let seen = Vec3::splat(simd, sky.rise).scale_add(height, Vec3::splat(simd, sky.low));
                let seen = if EYE { seen } else { seen.mul(Vec3::load(simd, &queue.weight, at)) };
                let color = if packets.next_if_eq(&at).is_some() {
                    let end = at + Lanes::<S, E>::LEN;
                    let distance = Lanes::<S, E>::from_slice(simd, &hits.distance.0[at..end]);
                    Vec3::select(distance.simd_lt(far), Vec3::load(simd, &hits.color, at), seen)
                } else {
                    seen
                };
                color.store(&mut hits.color, at);
            }
        },
    );
}
