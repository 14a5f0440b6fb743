//! Selects the hit that counts among objects that share a surface, for rays that have hit one of them.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant, splat};
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::Features;
use crate::fast::build::prepare::{Entry, Prepared};
use crate::fast::rays::bounce::{Hits, RayBatch};
use crate::fast::rays::packet;
use crate::fast::rays::packet::{Nearest, Ray};
use crate::fast::shared::{EQUAL, Earlier, SharedSurfaces};
use crate::fast::transport::surfaces::surface;

impl SharedSurfaces {
    /// Replaces the nearest hits of a packet by the hits that count.
    #[inline(never)]
    pub(crate) fn settle<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
        &self,
        simd: S,
        scene: &Prepared<E>,
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let found = *nearest;
                let mut orders = [E::narrow(0.0); 16];
                found.order.store_slice(&mut orders[..Lanes::<S, E>::LEN]);
                let hit = found.hit(simd);
                let mut rest = hit.to_bitmask();
                while rest != 0 {
                    let order = orders[rest.trailing_zeros() as usize];
                    let mut open = hit & found.order.simd_eq(splat::<S, E>(simd, order));
                    rest &= !open.to_bitmask();
                    let earlier = self.earlier(order.to_index());
                    if earlier.is_empty() {
                        continue;
                    }
                    let object = (&scene.entries[order.to_index()], order);
                    let normal = surface::<S, E, F, EYE>(simd, scene, object, ray, found.distance).normal;
                    let climb = normal.dot(ray.direction).abs();
                    let along = found.distance * constant::<S, E>(simd, EQUAL * E::ROUNDOFF);
                    for Earlier { order, size } in earlier {
                        let mut met = Nearest::none(simd);
                        meet_one::<S, E, F, EYE>(simd, scene, &scene.entries[*order as usize], ray, &mut met);
                        let apart = (met.distance - found.distance).abs() * climb;
                        let slack = along + constant::<S, E>(simd, EQUAL * E::ROUNDOFF * size);
                        let equal = open & met.hit(simd) & apart.simd_le(slack);
                        nearest.distance = equal.select(met.distance, nearest.distance);
                        nearest.order = equal.select(met.order, nearest.order);
                        open &= !equal;
                        if !open.any_true() {
                            break;
                        }
                    }
                }
            },
        );
    }

    /// Replaces the nearest hits of a queue by the hits that count.
    #[inline(never)]
    pub(crate) fn settle_all<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
        &self,
        simd: S,
        scene: &Prepared<E>,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                for &(at, _) in &hits.packets {
                    let lanes = at..at + Lanes::<S, E>::LEN;
                    let origin = if EYE { Vec3::zero(simd) } else { Vec3::load(simd, &queue.origin, at) };
                    let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                    let mut nearest = Nearest {
                        distance: Lanes::<S, E>::from_slice(simd, &hits.distance.0[lanes.clone()]),
                        order: Lanes::<S, E>::from_slice(simd, &hits.order.0[lanes.clone()]),
                    };
                    self.settle::<S, E, F, EYE>(simd, scene, ray, &mut nearest);
                    nearest.distance.store_slice(&mut hits.distance.0[lanes.clone()]);
                    nearest.order.store_slice(&mut hits.order.0[lanes]);
                }
            },
        );
    }

    /// Moves the starts of the rays that go on from the hits of a queue off all objects that share the surface there.
    pub(crate) fn lift<E: Real>(&self, hits: &mut Hits<E>, lanes: usize) {
        for packet in 0..hits.packets.len() {
            let (at, _) = hits.packets[packet];
            for lane in at..at + lanes {
                if !hits.is_hit(lane) {
                    continue;
                }
                let offset = self.offset(hits.order.0[lane]);
                for axis in 0..3 {
                    hits.start[axis].0[lane] += hits.normal[axis].0[lane] * offset;
                }
                hits.sides[0].0[lane] += offset;
            }
        }
    }

    /// Does the same for a surface at hits of the object with this order.
    pub(crate) fn lifted<S: Simd, E: Real>(
        &self,
        simd: S,
        surface: packet::Surface<S, E>,
        order: E,
    ) -> packet::Surface<S, E> {
        let offset = splat::<S, E>(simd, self.offset(order));
        packet::Surface {
            start: surface.normal.scale_add(offset, surface.start),
            offset: surface.offset + offset,
            ..surface
        }
    }
}

/// Offers the hits of rays with one object.
#[inline(always)]
fn meet_one<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    entry: &Entry<E>,
    ray: Ray<S, E>,
    nearest: &mut Nearest<S, E>,
) {
    let index = entry.index as usize;
    if entry.is_body {
        if let Some(bodies) = scene.beyond.as_ref().and_then(Extensions::bodies) {
            bodies.meet_one(simd, index, ray, nearest);
        }
    } else {
        let only = (F::one_of_these(entry.kind), index..index + 1);
        scene.shapes.intersect::<S, F::By, EYE>(simd, only, ray, None, nearest);
    }
}
