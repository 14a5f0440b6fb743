//! The hits of rays: their colours without light, their surfaces, and the rays that mirrors reflect.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::Features;
use crate::fast::build::prepare::{Entry, Prepared};
use crate::fast::rays::bounce::{Column, Columns, Hits, RayBatch, count_from, weigh};
use crate::fast::rays::packet::{Nearest, Ray, Surface};

/// Computes the colour of hits without lights and mirrors.
#[inline(never)]
pub(crate) fn ambient<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    background: [E; 3],
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Hits { distance, order, color, packets, .. } = hits;
            for &(at, _) in &*packets {
                let met = HitPacket::<S, E>::new(simd, at, distance, order);
                let mut sum = weigh::<S, E, EYE>(simd, background, queue, at);
                met.each_object(
                    simd,
                    scene,
                    #[inline(always)]
                    |(entry, _), same, _| {
                        sum = Vec3::select(same, weigh::<S, E, EYE>(simd, entry.ambient, queue, at), sum);
                    },
                );
                sum.store(color, at);
            }
        },
    );
}

/// The hits of a packet; `hit` marks the lanes that have one.
#[derive(Clone, Copy)]
pub(crate) struct HitPacket<'a, S: Simd, E: Real> {
    pub(crate) found: Nearest<S, E>,
    /// The orders of the hits, for access to single lanes.
    pub(crate) orders: &'a [E],
    pub(crate) hit: Mask<S, E>,
}

impl<'a, S: Simd, E: Real> HitPacket<'a, S, E> {
    #[inline(always)]
    pub(crate) fn new(simd: S, at: usize, distance: &Column<E>, order: &'a Column<E>) -> Self {
        let lanes = at..at + Lanes::<S, E>::LEN;
        let orders = &order.0[lanes.clone()];
        let distance = Lanes::<S, E>::from_slice(simd, &distance.0[lanes]);
        let found = Nearest { distance, order: Lanes::<S, E>::from_slice(simd, orders) };
        Self { found, orders, hit: found.hit(simd) }
    }

    /// Returns the object that a lane hits, and the lanes that hit it.
    #[inline(always)]
    pub(crate) fn object<'s>(
        &self,
        simd: S,
        scene: &'s Prepared<E>,
        lane: u32,
    ) -> (&'s Entry<E>, Mask<S, E>) {
        let order = self.orders[lane as usize];
        let same = self.hit & self.found.order.simd_eq(splat::<S, E>(simd, order));
        (&scene.entries[order.to_index()], same)
    }

    /// Calls `each` with each object of the packet and the order of its hits, the lanes that hit it, and whether it is the
    /// first.
    #[inline(always)]
    fn each_object(
        &self,
        simd: S,
        scene: &Prepared<E>,
        mut each: impl FnMut((&Entry<E>, E), Mask<S, E>, bool),
    ) {
        let hit = self.hit.to_bitmask();
        let mut remaining = hit;
        while remaining != 0 {
            let lane = remaining.trailing_zeros();
            let (entry, same) = self.object(simd, scene, lane);
            each((entry, self.orders[lane as usize]), same, remaining == hit);
            remaining &= !same.to_bitmask();
        }
    }
}

/// An object's lanes in a packet.
#[derive(Clone, Copy)]
struct Share<S: Simd, E: Real> {
    at: usize,
    lanes: Mask<S, E>,
    /// Whether it is the packet's first object.
    is_first: bool,
}

impl<S: Simd, E: Real> Share<S, E> {
    /// Writes its lanes. The first object also writes the `rest`.
    #[inline(always)]
    fn put(self, simd: S, of: Vec3<S, E>, rest: Vec3<S, E>, into: &mut Columns<E>) {
        let rest = if self.is_first { rest } else { Vec3::load(simd, into, self.at) };
        Vec3::select(self.lanes, of, rest).store(into, self.at);
    }

    /// Writes its lanes of a column with one number per ray.
    #[inline(always)]
    fn put_one(self, simd: S, of: Lanes<S, E>, into: &mut Column<E>) {
        let into = &mut into.0[self.at..self.at + Lanes::<S, E>::LEN];
        self.lanes.select(of, Lanes::<S, E>::from_slice(simd, into)).store_slice(into);
    }
}

/// Computes the colour of hits without light, and their surfaces: of all hits if lights can reach them (`LIT`),
/// otherwise only of those that spawn rays. Records the lanes that spawn rays if any can (`MIRRORS`), and the side of
/// the surface that each ray comes from if rays may pass through (`GLASS`).
#[inline(never)]
pub(crate) fn surfaces<
    S: Simd,
    E: Real,
    F: Features<E>,
    const EYE: bool,
    const LIT: bool,
    const MIRRORS: bool,
    const GLASS: bool,
>(
    simd: S,
    scene: &Prepared<E>,
    background: [E; 3],
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Hits { distance, order, start, normal, sides, diffuse, color, packets, mirrors, .. } = hits;
            mirrors.clear();
            let zero = Vec3::zero(simd);
            for (at, others) in packets {
                let at = *at;
                let met = HitPacket::<S, E>::new(simd, at, distance, order);
                let mut mirror_bits = 0;
                met.each_object(
                    simd,
                    scene,
                    #[inline(always)]
                    |(entry, order), same, is_first| {
                        let share = Share { at, lanes: same, is_first };
                        let bits = same.to_bitmask();
                        let behind = weigh::<S, E, EYE>(simd, background, queue, at);
                        share.put(simd, weigh::<S, E, EYE>(simd, entry.ambient, queue, at), behind, color);
                        if MIRRORS && entry.mirrors {
                            mirror_bits |= bits;
                        } else if !LIT {
                            return;
                        }
                        let origin = if EYE { zero } else { Vec3::load(simd, &queue.origin, at) };
                        let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                        let object = (entry, order);
                        let surface = surface::<S, E, F, EYE>(simd, scene, object, ray, met.found.distance);
                        share.put(simd, surface.normal, zero, normal);
                        if GLASS {
                            let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
                            let [offset, within] = &mut *sides;
                            share.put_one(simd, surface.offset, offset);
                            share.put_one(simd, surface.within.select(one, zero), within);
                        }
                        if LIT {
                            share.put(
                                simd,
                                weigh::<S, E, EYE>(simd, entry.diffuse, queue, at),
                                zero,
                                diffuse,
                            );
                            let is_alone = is_first && bits == met.hit.to_bitmask();
                            *others = if is_alone { own_shadow::<E, F, EYE>(scene, entry) } else { u64::MAX };
                        }
                        let Vec3 { x, y, z } = surface.start;
                        // Lanes without a hit start at the first hit, so that they widen no region.
                        let lane = bits.trailing_zeros() as usize;
                        share.put(simd, surface.start, Vec3::splat(simd, [x[lane], y[lane], z[lane]]), start);
                    },
                );
                if MIRRORS && mirror_bits != 0 {
                    mirrors.push((at, mirror_bits));
                }
            }
        },
    );
}

/// Adds the rays that mirrors reflect to the next queue. With `PAINTED` the mirror coefficients are stored with the
/// hits.
#[inline(never)]
pub(crate) fn reflect<S: Simd, E: Real, const EYE: bool, const PAINTED: bool>(
    simd: S,
    scene: &Prepared<E>,
    queue: &RayBatch<E>,
    hits: &Hits<E>,
    next: &mut RayBatch<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for &(at, mut bits) in &hits.mirrors {
                let met = HitPacket::<S, E>::new(simd, at, &hits.distance, &hits.order);
                let mut mirror = Vec3::<S, E>::zero(simd);
                let mut mirrors = met.hit & !met.hit;
                while bits != 0 {
                    let (entry, same) = met.object(simd, scene, bits.trailing_zeros());
                    mirrors |= same;
                    mirror = Vec3::select(same, weigh::<S, E, EYE>(simd, entry.mirror, queue, at), mirror);
                    bits &= !same.to_bitmask();
                }
                if PAINTED {
                    mirror = Vec3::load(simd, &hits.mirror, at);
                    let zero = constant::<S, E>(simd, 0.0);
                    mirrors &= mirror.x.simd_ne(zero) | mirror.y.simd_ne(zero) | mirror.z.simd_ne(zero);
                }
                let normal = Vec3::<S, E>::load(simd, &hits.normal, at);
                let incoming = Vec3::load(simd, &queue.direction, at);
                let pixel = if EYE {
                    count_from::<S, E>(simd, at)
                } else {
                    Lanes::<S, E>::from_slice(simd, &queue.pixel.0[at..at + Lanes::<S, E>::LEN])
                };
                // Lanes that repeat another lane spawn no rays.
                let mirrors =
                    if EYE { mirrors } else { mirrors & pixel.simd_ge(constant::<S, E>(simd, 0.0)) };
                let end = next.count;
                compress(Vec3::load(simd, &hits.start, at), mirrors, &mut next.origin, end);
                compress(mirrored(simd, incoming, normal), mirrors, &mut next.direction, end);
                compress(mirror, mirrors, &mut next.weight, end);
                pixel.compress(mirrors).store_slice(&mut next.pixel.0[end..end + Lanes::<S, E>::LEN]);
                next.count += mirrors.to_bitmask().count_ones() as usize;
            }
        },
    );
}

/// Returns the directions of the reflected rays.
#[inline(always)]
pub(crate) fn mirrored<S: Simd, E: Real>(simd: S, incoming: Vec3<S, E>, normal: Vec3<S, E>) -> Vec3<S, E> {
    // The normal faces the ray. If rounding has changed the sign, the ray grazes.
    let towards = incoming.dot(normal).min(constant::<S, E>(simd, 0.0));
    let direction = normal.scale_add(towards * constant::<S, E>(simd, -2.0), incoming);
    // A step of Newton's method keeps the length at 1.
    let stretch =
        direction.dot(direction).fused_mul_add(constant::<S, E>(simd, -0.5), constant::<S, E>(simd, 1.5));
    direction.scale(stretch)
}

#[inline(always)]
fn compress<S: Simd, E: Real>(v: Vec3<S, E>, lanes: Mask<S, E>, into: &mut Columns<E>, at: usize) {
    Vec3::<S, E>::new(v.x.compress(lanes), v.y.compress(lanes), v.z.compress(lanes)).store(into, at);
}

/// Returns the bits of all spheres, without the object itself if it cannot be in its own shadow.
#[inline(always)]
fn own_shadow<E: Real, F: Features<E>, const EYE: bool>(scene: &Prepared<E>, entry: &Entry<E>) -> u64 {
    if F::BODIES && entry.is_body {
        return u64::MAX;
    }
    let outside = EYE && scene.shapes.is_seen_from_outside(entry.kind, entry.index as usize);
    if outside && scene.tree.is_none() { !(1 << entry.index) } else { u64::MAX }
}

/// Returns an object's surface at the hits of the rays that have this order.
#[inline(always)]
pub(crate) fn surface<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    (entry, order): (&Entry<E>, E),
    ray: Ray<S, E>,
    distance: Lanes<S, E>,
) -> Surface<S, E> {
    if F::BODIES
        && entry.is_body
        && let Some(bodies) = scene.beyond.as_ref().and_then(Extensions::bodies)
    {
        return bodies.surface(simd, (entry.index as usize, order), ray, distance);
    }
    let object = (F::one_of_these(entry.kind), entry.index as usize);
    scene.shapes.surface::<S, F::By, EYE>(simd, object, ray, distance)
}
