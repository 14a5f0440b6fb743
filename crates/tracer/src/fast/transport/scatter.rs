//! Scattering at mirrors and glass, in scenes that have glass: this step replaces `reflect` there.
//!
//! Glass splits a ray into two. The two are added one after the other, and those of a packet in the order of its lanes,
//! so that no sum depends on which rays share a packet.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::build::prepare::Prepared;
use crate::fast::materials::glass::{Glass, Refraction};
use crate::fast::rays::bounce::{Hits, RayBatch, count_from};
use crate::fast::rays::packet::{Ray, Surface, no_lane};
use crate::fast::transport::ray_queue::{RayQueues, SpawnedRays};
use crate::fast::transport::surfaces::{HitPacket, mirrored};

/// Adds the rays that mirrors and glass spawn to the queues. With `PAINTED` the mirror coefficients are stored with the
/// hits, and in fog they are.
#[inline(never)]
pub(crate) fn spawn_rays<S: Simd, E: Real, const EYE: bool, const PAINTED: bool>(
    simd: S,
    scene: &Prepared<E>,
    glass: &Glass<E>,
    queue: &RayBatch<E>,
    hits: &Hits<E>,
    waiting: &mut RayQueues<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = Vec3::zero(simd);
            let one = constant::<S, E>(simd, 1.0);
            let is_foggy = scene.fog().is_some();
            let has_covers = scene.is_clear();
            for &(at, bits) in &hits.mirrors {
                let met = HitPacket::<S, E>::new(simd, at, &hits.distance, &hits.order);
                let origin = if EYE { zero } else { Vec3::load(simd, &queue.origin, at) };
                let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                let weight =
                    if EYE { Vec3::<S, E>::new(one, one, one) } else { Vec3::load(simd, &queue.weight, at) };
                let weight = if is_foggy {
                    let lanes = at..at + Lanes::<S, E>::LEN;
                    weight.scale(Lanes::<S, E>::from_slice(simd, &hits.clearness[lanes]))
                } else {
                    weight
                };
                let normal = Vec3::load(simd, &hits.normal, at);
                let start = Vec3::load(simd, &hits.start, at);
                let lanes = at..at + Lanes::<S, E>::LEN;
                let [offset, within] = &hits.sides;
                let offset = Lanes::<S, E>::from_slice(simd, &offset.0[lanes.clone()]);
                let within = Lanes::<S, E>::from_slice(simd, &within.0[lanes.clone()]);
                let surface = Surface { start, normal, offset, within: within.simd_ne(zero.x) };
                // Rays that go through a face start behind the face itself.
                let face = match hits.face[0].is_empty() {
                    true => surface,
                    false => Surface { normal: Vec3::load(simd, &hits.face, at), ..surface },
                };
                // The weights of the reflected and of the refracted ray.
                let mut mirror = if PAINTED { Vec3::load(simd, &hits.mirror, at) } else { zero };
                let (mut through, mut bent) = (zero, zero);
                let mut of_glass = no_lane::<S, E>(simd);
                let mut clear = zero.x;
                let mut rest = bits;
                while rest != 0 {
                    let lane = rest.trailing_zeros();
                    let (entry, same) = met.object(simd, scene, lane);
                    rest &= !same.to_bitmask();
                    if !PAINTED {
                        mirror = Vec3::select(same, Vec3::splat(simd, entry.mirror).mul(weight), mirror);
                    }
                    let Some(pane) = glass.of(met.orders[lane as usize]) else { continue };
                    of_glass |= same;
                    let Refraction { mirrored, direction } = pane.refract(simd, ray.direction, surface);
                    let share = Vec3::splat(simd, pane.color).scale(one - mirrored).mul(weight);
                    mirror = Vec3::select(same, weight.scale_add(mirrored, mirror), mirror);
                    through = Vec3::select(same, share, through);
                    bent = Vec3::select(same, direction, bent);
                    if has_covers {
                        let share = (one - mirrored) * pane.clearness();
                        clear = same.select(share * waiting.clear(simd, at), clear);
                    }
                }
                let mut sent = Mask::<S, E>::from_bitmask(simd, bits);
                let pixel = if EYE {
                    count_from::<S, E>(simd, at)
                } else {
                    let pixel = Lanes::<S, E>::from_slice(simd, &queue.pixel.0[lanes]);
                    // Lanes that repeat another lane spawn no rays.
                    sent &= pixel.simd_ge(zero.x);
                    pixel
                };
                let have_met_glass = of_glass | waiting.have_met_glass(simd, at);
                let own = met.found.order + one;
                let (inwards, outwards) = (of_glass & surface.within, of_glass & !surface.within);
                let mirrored = SpawnedRays {
                    origin: start,
                    direction: mirrored(simd, ray.direction, normal),
                    weight: mirror,
                    inside: inwards.select(own, zero.x),
                    lanes: sent & glass.followed(simd, mirror, have_met_glass),
                };
                let refracted = SpawnedRays {
                    origin: face.beyond(simd),
                    direction: bent,
                    weight: through,
                    inside: outwards.select(own, zero.x),
                    lanes: sent & of_glass & glass.followed(simd, through, have_met_glass),
                };
                let met = have_met_glass.select(one, zero.x);
                let marks = if has_covers {
                    [zero.x - met, clear.simd_gt(zero.x).select(clear, zero.x - one)]
                } else {
                    [met; 2]
                };
                waiting.push(pixel, marks, [mirrored, refracted]);
            }
        },
    );
}
