//! The rays that mirrors and glass send on, in scenes that have glass: the step that takes the place of `reflect` there.
//!
//! Glass makes two rays of one. Those of a ray are added one after the other, and those of a packet in the order of its
//! lanes, so that no sum depends on which rays share a packet.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::bounce::{Hits, Queue};
use super::features::Features;
use super::glass::{Glass, Refraction};
use super::packet::Ray;
use super::prepare::Prepared;
use super::real::{Real, Vec3, constant};
use super::surfaces::{Met, mirrored, surface};
use super::waiting::{OneRay, Waiting};

/// A packet of rays, lane by lane.
struct Lane<E>([[E; 16]; 3]);

impl<E: Real> Lane<E> {
    #[inline(always)]
    fn of<S: Simd>(v: Vec3<S, E>) -> Self {
        let mut columns = [[E::narrow(0.0); 16]; 3];
        v.store(&mut columns, 0);
        Self(columns)
    }

    #[inline(always)]
    fn at(&self, lane: usize) -> [E; 3] {
        let Self([x, y, z]) = self;
        [x[lane], y[lane], z[lane]]
    }
}

/// Adds the rays that mirrors and glass send on to those that wait; `PAINTED` says that the mirror coefficients are among
/// the hits.
#[inline(never)]
pub(super) fn send_on<S: Simd, E: Real, F: Features<E>, const EYE: bool, const PAINTED: bool>(
    simd: S,
    scene: &Prepared<E>,
    glass: &Glass<E>,
    queue: &Queue<E>,
    hits: &Hits<E>,
    waiting: &mut Waiting<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = Vec3::zero(simd);
            let one = constant::<S, E>(simd, 1.0);
            for &(at, bits) in &hits.mirrors {
                let met = Met::<S, E>::new(simd, at, &hits.distance, &hits.order);
                let origin = if EYE { zero } else { Vec3::load(simd, &queue.origin, at) };
                let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                let weight =
                    if EYE { Vec3::<S, E>::new(one, one, one) } else { Vec3::load(simd, &queue.weight, at) };
                // What the mirrored ray counts for, and the refracted one.
                let mut mirror = if PAINTED { Vec3::load(simd, &hits.mirror, at) } else { zero };
                let (mut through, mut beyond, mut bent) = (zero, zero, zero);
                let mut of_glass = 0;
                let mut rest = bits;
                while rest != 0 {
                    let lane = rest.trailing_zeros();
                    let (entry, same) = met.object(simd, scene, lane);
                    rest &= !same.to_bitmask();
                    if !PAINTED {
                        mirror = Vec3::select(same, Vec3::splat(simd, entry.mirror).mul(weight), mirror);
                    }
                    let Some(pane) = glass.of(met.orders[lane as usize]) else { continue };
                    of_glass |= same.to_bitmask();
                    let surface = surface::<S, E, F, EYE>(simd, scene, entry, ray, met.found.distance);
                    let Refraction { mirrored, direction } = pane.refract(simd, ray.direction, surface);
                    let share = Vec3::splat(simd, pane.color).scale(one - mirrored).mul(weight);
                    mirror = Vec3::select(same, weight.scale_add(mirrored, mirror), mirror);
                    through = Vec3::select(same, share, through);
                    beyond = Vec3::select(same, surface.beyond(simd), beyond);
                    bent = Vec3::select(same, direction, bent);
                }
                let normal = Vec3::load(simd, &hits.normal, at);
                let [start, away] =
                    [Vec3::load(simd, &hits.start, at), mirrored(simd, ray.direction, normal)];
                let [mirror, start, away] = [mirror, start, away].map(Lane::of);
                let [through, beyond, bent] = [through, beyond, bent].map(Lane::of);
                let mut rest = bits;
                while rest != 0 {
                    let lane = rest.trailing_zeros() as usize;
                    rest &= rest - 1;
                    let slot = at + lane;
                    let pixel = if EYE { E::narrow(slot as f64) } else { queue.pixel.0[slot] };
                    // Lanes that only repeat another send nothing on.
                    if pixel < E::narrow(0.0) {
                        continue;
                    }
                    let is_glass = of_glass >> lane & 1 != 0;
                    let has_met_glass = is_glass || waiting.has_met_glass(slot);
                    let weight = mirror.at(lane);
                    if glass.is_followed(weight, has_met_glass) {
                        let (origin, direction) = (start.at(lane), away.at(lane));
                        waiting.push(OneRay { origin, direction, weight, pixel, has_met_glass });
                    }
                    let weight = through.at(lane);
                    if is_glass && glass.is_followed(weight, has_met_glass) {
                        let (origin, direction) = (beyond.at(lane), bent.at(lane));
                        waiting.push(OneRay { origin, direction, weight, pixel, has_met_glass });
                    }
                }
            }
        },
    );
}
