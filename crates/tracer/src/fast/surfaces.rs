//! What rays have met: colours without light, surfaces, and the rays that mirrors send on.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::beyond::Beyond;
use super::bounce::{Column, Columns, Hits, Queue, count_from, weigh};
use super::features::Features;
use super::packet::{Nearest, Ray, Surface};
use super::prepare::{Entry, Prepared};
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};

/// The colour of hits that neither light nor mirrors change.
#[inline(never)]
pub(super) fn ambient<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    background: [E; 3],
    queue: &Queue<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Hits { distance, order, color, packets, .. } = hits;
            for &(at, _) in &*packets {
                let met = Met::<S, E>::new(simd, at, distance, order);
                let mut sum = weigh::<S, E, EYE>(simd, background, queue, at);
                met.each_object(
                    simd,
                    scene,
                    #[inline(always)]
                    |entry, same, _| {
                        sum = Vec3::select(same, weigh::<S, E, EYE>(simd, entry.ambient, queue, at), sum);
                    },
                );
                sum.store(color, at);
            }
        },
    );
}

/// What a packet of rays meets that meet something.
#[derive(Clone, Copy)]
pub(super) struct Met<'a, S: Simd, E: Real> {
    pub(super) found: Nearest<S, E>,
    /// The same orders, for one lane at a time.
    pub(super) orders: &'a [E],
    pub(super) hit: Mask<S, E>,
}

impl<'a, S: Simd, E: Real> Met<'a, S, E> {
    #[inline(always)]
    pub(super) fn new(simd: S, at: usize, distance: &Column<E>, order: &'a Column<E>) -> Self {
        let lanes = at..at + Lanes::<S, E>::LEN;
        let orders = &order.0[lanes.clone()];
        let distance = Lanes::<S, E>::from_slice(simd, &distance.0[lanes]);
        let found = Nearest { distance, order: Lanes::<S, E>::from_slice(simd, orders) };
        Self { found, orders, hit: found.hit(simd) }
    }

    /// The object that a lane meets, and the lanes that meet it.
    #[inline(always)]
    pub(super) fn object<'s>(
        &self,
        simd: S,
        scene: &'s Prepared<E>,
        lane: u32,
    ) -> (&'s Entry<E>, Mask<S, E>) {
        let order = self.orders[lane as usize];
        let same = self.hit & self.found.order.simd_eq(splat::<S, E>(simd, order));
        (&scene.entries[order.to_index()], same)
    }

    /// The objects that it meets, each with the lanes that meet it, and whether it is the first.
    #[inline(always)]
    fn each_object(&self, simd: S, scene: &Prepared<E>, mut each: impl FnMut(&Entry<E>, Mask<S, E>, bool)) {
        let hit = self.hit.to_bitmask();
        let mut remaining = hit;
        while remaining != 0 {
            let (entry, same) = self.object(simd, scene, remaining.trailing_zeros());
            each(entry, same, remaining == hit);
            remaining &= !same.to_bitmask();
        }
    }
}

/// An object's lanes of a packet.
#[derive(Clone, Copy)]
struct Share<S: Simd, E: Real> {
    at: usize,
    lanes: Mask<S, E>,
    /// Whether it is the packet's first.
    is_first: bool,
}

impl<S: Simd, E: Real> Share<S, E> {
    /// Writes its lanes; the first object writes the `rest` too.
    #[inline(always)]
    fn put(self, simd: S, of: Vec3<S, E>, rest: Vec3<S, E>, into: &mut Columns<E>) {
        let rest = if self.is_first { rest } else { Vec3::load(simd, into, self.at) };
        Vec3::select(self.lanes, of, rest).store(into, self.at);
    }

    /// Writes its lanes of one number a ray.
    #[inline(always)]
    fn put_one(self, simd: S, of: Lanes<S, E>, into: &mut Column<E>) {
        let into = &mut into.0[self.at..self.at + Lanes::<S, E>::LEN];
        self.lanes.select(of, Lanes::<S, E>::from_slice(simd, into)).store_slice(into);
    }
}

/// The colour of hits without light, and how their surfaces lie: those of all, if light is to fall on them (`LIT`), or
/// those alone that send rays on. Which lanes do is noted if any can (`MIRRORS`), and of all on which side of its surface a
/// ray comes, if some may go through (`GLASS`).
#[inline(never)]
pub(super) fn surfaces<
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
    queue: &Queue<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Hits { distance, order, start, normal, sides, diffuse, color, packets, mirrors, mirror: _ } =
                hits;
            mirrors.clear();
            let zero = Vec3::zero(simd);
            for (at, others) in packets {
                let at = *at;
                let met = Met::<S, E>::new(simd, at, distance, order);
                let mut mirror_bits = 0;
                met.each_object(
                    simd,
                    scene,
                    #[inline(always)]
                    |entry, same, is_first| {
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
                        let surface = surface::<S, E, F, EYE>(simd, scene, entry, ray, met.found.distance);
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
                        // Lanes without a hit start where the first hit does, and widen no region.
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

/// The rays that mirrors send on; `PAINTED` says that their coefficients are among the hits.
#[inline(never)]
pub(super) fn reflect<S: Simd, E: Real, const EYE: bool, const PAINTED: bool>(
    simd: S,
    scene: &Prepared<E>,
    queue: &Queue<E>,
    hits: &Hits<E>,
    next: &mut Queue<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for &(at, mut bits) in &hits.mirrors {
                let met = Met::<S, E>::new(simd, at, &hits.distance, &hits.order);
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
                // Lanes that only repeat another send nothing on.
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

/// Where rays go that are mirrored.
#[inline(always)]
pub(super) fn mirrored<S: Simd, E: Real>(simd: S, incoming: Vec3<S, E>, normal: Vec3<S, E>) -> Vec3<S, E> {
    // The normal faces the ray; where rounding says otherwise, the ray grazes.
    let towards = incoming.dot(normal).min(constant::<S, E>(simd, 0.0));
    let direction = normal.scale_add(towards * constant::<S, E>(simd, -2.0), incoming);
    // A step of Newton's method keeps its length at 1.
    let stretch = direction.dot(direction).mul_add(constant::<S, E>(simd, -0.5), constant::<S, E>(simd, 1.5));
    direction.scale(stretch)
}

#[inline(always)]
fn compress<S: Simd, E: Real>(v: Vec3<S, E>, lanes: Mask<S, E>, into: &mut Columns<E>, at: usize) {
    Vec3::<S, E>::new(v.x.compress(lanes), v.y.compress(lanes), v.z.compress(lanes)).store(into, at);
}

/// All spheres but the object itself, where it is one that cannot be in its own light.
#[inline(always)]
fn own_shadow<E: Real, F: Features<E>, const EYE: bool>(scene: &Prepared<E>, entry: &Entry<E>) -> u64 {
    if F::BODIES && entry.is_body {
        return u64::MAX;
    }
    let outside = EYE && scene.shapes.is_seen_from_outside(entry.kind, entry.index as usize);
    if outside && scene.tree.is_none() { !(1 << entry.index) } else { u64::MAX }
}

/// An object's surface where the rays meet it.
#[inline(always)]
pub(super) fn surface<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    entry: &Entry<E>,
    ray: Ray<S, E>,
    distance: Lanes<S, E>,
) -> Surface<S, E> {
    if F::BODIES
        && entry.is_body
        && let Some(bodies) = scene.beyond.as_ref().and_then(Beyond::bodies)
    {
        return bodies.surface(simd, entry.index as usize, ray, distance);
    }
    let object = (F::one_of_these(entry.kind), entry.index as usize);
    scene.shapes.surface::<S, F::By, EYE>(simd, object, ray, distance)
}
