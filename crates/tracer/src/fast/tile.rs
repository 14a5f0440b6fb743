//! A tile of the image: rays, what they see, its light, and what its mirrors see.
//!
//! Generation by generation: the first holds the tile's pixels, each further one the mirrored rays of the one before,
//! closed up so that packets stay full. In a generation all hits are found first; the region that they fill then decides
//! which objects can stand in the way of each light. Each of the steps is one function, compiled with the instruction
//! set's features (`vectorize`) and never inlined: kernels that do a step alike share it, a step's registers are its own,
//! and it is the same code whatever else a build has.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::features::{Features, Spheres};
use super::intersect::{Nearest, Ray, Slopes, Surface};
use super::light::{Obstacles, light_up};
use super::lists::Picked;
use super::prepare::{Entry, Kind, OFFSET, Prepared, Rays};
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};
use super::search::{Candidates, Masks, nearest};
use crate::parallel::CHANNELS;

/// Pixels of a tile at most.
pub(super) const PIXELS: usize = 256;

/// A tile's pixels and room for a packet that begins at the last of them.
const ROOM: usize = PIXELS + 16;

/// A number for each ray of a tile.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Column<E>([E; ROOM]);

impl<E> AsRef<[E]> for Column<E> {
    #[inline(always)]
    fn as_ref(&self) -> &[E] {
        &self.0
    }
}

impl<E> AsMut<[E]> for Column<E> {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut [E] {
        &mut self.0
    }
}

pub(super) type Columns<E> = [Column<E>; 3];

/// Rays that wait to be traced.
struct Queue<E> {
    origin: Columns<E>,
    direction: Columns<E>,
    /// What their colour counts for in the pixel's.
    weight: Columns<E>,
    pixel: Column<E>,
    count: usize,
}

/// What a generation's rays meet.
pub(super) struct Hits<E> {
    /// How far they go.
    distance: Column<E>,
    /// The object's position in the script.
    order: Column<E>,
    pub(super) start: Columns<E>,
    pub(super) normal: Columns<E>,
    /// Diffuse coefficient times the ray's weight.
    pub(super) diffuse: Columns<E>,
    pub(super) color: Columns<E>,
    /// For each packet with hits: where it begins, and the objects that can be in its way, as bits.
    pub(super) packets: Vec<(usize, u64)>,
    /// For each packet with mirrors: where it begins, and the lanes that meet them, as bits.
    mirrors: Vec<(usize, u64)>,
}

/// What mirrors send on.
struct Mirrored<E> {
    queue: Queue<E>,
    /// The sum of what the generations add to each pixel.
    pixels: Columns<E>,
}

/// Memory of a worker, used again for each of its tiles; what is in it does not matter.
pub(super) struct Scratch<E> {
    queue: Queue<E>,
    hits: Hits<E>,
    mirrored: Mirrored<E>,
    obstacles: Obstacles,
    sights: Picked,
}

impl<E: Real> Scratch<E> {
    pub(super) fn new() -> Self {
        let column = || Column([E::narrow(0.0); ROOM]);
        let columns = || [column(), column(), column()];
        let queue = || Queue {
            origin: columns(),
            direction: columns(),
            weight: columns(),
            pixel: column(),
            count: 0,
        };
        Self {
            queue: queue(),
            mirrored: Mirrored { queue: queue(), pixels: columns() },
            hits: Hits {
                distance: column(),
                order: column(),
                start: columns(),
                normal: columns(),
                diffuse: columns(),
                color: columns(),
                packets: Vec::with_capacity(PIXELS),
                mirrors: Vec::new(),
            },
            obstacles: Obstacles::default(),
            sights: Picked::default(),
        }
    }
}

/// A rectangle of the image, counted from its upper left corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    pub(super) left: u32,
    pub(super) top: u32,
    pub(super) width: u32,
    pub(super) height: u32,
    /// What it can show, by bits; with a tree, whether it can show anything.
    pub(super) candidates: u64,
    /// Columns and rows of tiles before it.
    pub(super) place: (usize, usize),
    /// Mirrorings that are followed.
    pub(super) bounces: u32,
}

/// Where a tile's pixels go: the bytes of its rows, from the image's left edge.
pub(super) struct Band<'a> {
    pub(super) bytes: &'a mut [u8],
    /// Columns and rows of the whole image.
    pub(super) size: (u32, u32),
    /// Level of each channel of a pixel that shows nothing.
    pub(super) background: [u8; CHANNELS],
}

impl Band<'_> {
    /// The colour of what shows nothing.
    #[inline(always)]
    fn background<E: Real>(&self) -> [E; 3] {
        self.background.map(|level| E::narrow(f64::from(level) / 255.0))
    }
}

/// Columns and rows of a packet's pixels.
#[inline(always)]
fn packet_shape<S: Simd, E: Real>() -> (usize, usize) {
    match Lanes::<S, E>::LEN {
        16 => (4, 4),
        8 => (4, 2),
        4 => (2, 2),
        n => (n, 1),
    }
}

/// `from` and on, a number a lane, the lanes counted modulo `modulus`.
#[inline(always)]
fn lanes<S: Simd, E: Real>(simd: S, from: usize, modulus: usize) -> Lanes<S, E> {
    let mut numbers = [E::narrow(0.0); 16];
    for (lane, number) in numbers.iter_mut().enumerate() {
        *number = E::narrow((from + lane % modulus) as f64);
    }
    Lanes::<S, E>::from_slice(simd, &numbers[..Lanes::<S, E>::LEN])
}

/// Draws a tile.
#[inline(always)]
pub(super) fn draw<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    tile: Tile,
    scratch: &mut Scratch<E>,
    band: &mut Band,
) {
    if tile.candidates == 0 {
        return fill(tile, band);
    }
    let Scratch { queue, hits, mirrored, obstacles, sights } = scratch;
    let candidates = match &scene.sights {
        Some(all) if F::TREE && all.gather(tile.place.0, tile.place.1, sights) => {
            if sights.len() == 0 {
                return fill(tile, band);
            }
            Candidates { masks: Masks::default(), list: Some(sights) }
        }
        _ => Candidates { masks: Masks::split(tile.candidates, scene), list: None },
    };
    let background = band.background();
    let Mirrored { queue: next, pixels } = mirrored;
    next.count = 0;
    hits.packets.clear();
    match scene.rays {
        Rays::Pinhole { corner, right, up } => {
            let aim = [corner, right, up];
            look_from_eye::<S, E, F::WithMirrors>(simd, scene, (tile, band), aim, candidates, queue, hits);
            shade::<S, E, F, true>(simd, scene, background, (queue, Some(&mut *next)), hits, obstacles);
        }
        Rays::Parallel { corner, pixel } => {
            aim_along_axis::<S, E>(simd, (tile, band), (corner, pixel), queue);
            look::<S, E, F::WithMirrors>(simd, scene, candidates, background, queue, hits);
            shade::<S, E, F, false>(simd, scene, background, (queue, Some(&mut *next)), hits, obstacles);
        }
    }
    if F::MIRRORS && next.count > 0 {
        core::mem::swap(&mut hits.color, pixels);
        let (mut queue, mut next) = (queue, next);
        let all = Candidates::all(scene);
        for bounce in 1..=tile.bounces {
            core::mem::swap(&mut queue, &mut next);
            next.count = 0;
            let after = (bounce < tile.bounces).then_some(&mut *next);
            hits.packets.clear();
            look::<S, E, F::WithMirrors>(simd, scene, all, scene.background, queue, hits);
            shade::<S, E, F, false>(simd, scene, scene.background, (queue, after), hits, obstacles);
            for ray in 0..queue.count {
                let pixel = queue.pixel.0[ray].to_index();
                for (sum, color) in pixels.iter_mut().zip(&hits.color) {
                    sum.0[pixel] += color.0[ray];
                }
            }
            if next.count == 0 {
                break;
            }
        }
        core::mem::swap(&mut hits.color, pixels);
    }
    develop::<S, E>(simd, tile, &hits.color, band);
}

/// Nothing but background.
fn fill(tile: Tile, band: &mut Band) {
    let stride = band.size.0 as usize * CHANNELS;
    let (from, to) = (tile.left as usize * CHANNELS, (tile.left + tile.width) as usize * CHANNELS);
    for row in band.bytes.chunks_exact_mut(stride) {
        row[from..to].as_chunks_mut().0.fill(band.background);
    }
}

/// The numbers of the column and the row of each pixel of the tile, packet by packet; rows count from the bottom.
#[inline(always)]
fn each_packet<S: Simd, E: Real>(
    simd: S,
    (tile, band): (Tile, &Band),
    mut each: impl FnMut(usize, Lanes<S, E>, Lanes<S, E>),
) {
    let (width, height) = packet_shape::<S, E>();
    let columns = lanes::<S, E>(simd, 0, width);
    let rows = (lanes::<S, E>(simd, 0, usize::MAX) - columns) * E::narrow(1.0 / width as f64);
    let right = constant::<S, E>(simd, f64::from(tile.left + tile.width - 1));
    let bottom = constant::<S, E>(simd, f64::from(tile.top + tile.height - 1));
    let last_row = constant::<S, E>(simd, f64::from(band.size.1 - 1));
    let mut at = 0;
    for top in (0..tile.height as usize).step_by(height) {
        for left in (0..tile.width as usize).step_by(width) {
            // Lanes beyond the edge draw the pixel on the edge again.
            let i = (columns + E::narrow((tile.left as usize + left) as f64)).min(right);
            let row = (rows + E::narrow((tile.top as usize + top) as f64)).min(bottom);
            each(at, i, last_row - row);
            at += Lanes::<S, E>::LEN;
        }
    }
}

/// The rays of the tile's pixels from an eye, and what they meet.
#[inline(never)]
fn look_from_eye<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    (tile, band): (Tile, &Band),
    [corner, right, up]: [[E; 3]; 3],
    candidates: Candidates,
    queue: &mut Queue<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let background: [E; 3] = band.background();
            each_packet::<S, E>(
                simd,
                (tile, band),
                #[inline(always)]
                |at, i, j| {
                    let along = Vec3::splat(simd, right).scale_add(i, Vec3::splat(simd, corner));
                    let direction = Vec3::splat(simd, up).scale_add(j, along).normalize(simd);
                    direction.store(&mut queue.direction, at);
                    let ray = Ray { origin: Vec3::zero(simd), direction };
                    let found = nearest::<S, E, F, true>(simd, scene, ray, candidates);
                    hits.add(
                        simd,
                        at,
                        found,
                        #[inline(always)]
                        || Vec3::splat(simd, background),
                    );
                },
            );
        },
    );
}

/// The rays of the tile's pixels along the axis.
#[inline(never)]
fn aim_along_axis<S: Simd, E: Real>(
    simd: S,
    (tile, band): (Tile, &Band),
    (corner, pixel): ([E; 3], E),
    queue: &mut Queue<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let pixel = splat::<S, E>(simd, pixel);
            let corner = Vec3::<S, E>::splat(simd, corner);
            let (zero, one) = (E::narrow(0.0), E::narrow(1.0));
            each_packet::<S, E>(
                simd,
                (tile, band),
                #[inline(always)]
                |at, i, j| {
                    let end = at + Lanes::<S, E>::LEN;
                    Vec3::<S, E>::new(i.mul_add(pixel, corner.x), j.mul_add(pixel, corner.y), corner.z)
                        .store(&mut queue.origin, at);
                    Vec3::<S, E>::splat(simd, [zero, zero, E::narrow(-1.0)]).store(&mut queue.direction, at);
                    Vec3::<S, E>::splat(simd, [one; 3]).store(&mut queue.weight, at);
                    lanes::<S, E>(simd, at, usize::MAX).store_slice(&mut queue.pixel.0[at..end]);
                    queue.count = end;
                },
            );
        },
    );
}

/// What the rays of a queue meet.
#[inline(never)]
fn look<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    candidates: Candidates,
    background: [E; 3],
    queue: &mut Queue<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            // The last packet is filled up with the last ray.
            let last = queue.count - 1;
            let end = queue.count.next_multiple_of(Lanes::<S, E>::LEN);
            for columns in [&mut queue.origin, &mut queue.direction, &mut queue.weight] {
                for column in columns {
                    let value = column.0[last];
                    column.0[last + 1..end].fill(value);
                }
            }
            queue.pixel.0[last + 1..end].fill(E::narrow(-1.0));
            for at in (0..queue.count).step_by(Lanes::<S, E>::LEN) {
                let ray = Ray {
                    origin: Vec3::load(simd, &queue.origin, at),
                    direction: Vec3::load(simd, &queue.direction, at),
                };
                let found = nearest::<S, E, F, false>(simd, scene, ray, candidates);
                hits.add(
                    simd,
                    at,
                    found,
                    #[inline(always)]
                    || weigh::<S, E, false>(simd, background, queue, at),
                );
            }
        },
    );
}

impl<E: Real> Hits<E> {
    /// Notes what a packet of rays meets; where that is nothing, the background is their colour.
    #[inline(always)]
    fn add<S: Simd>(
        &mut self,
        simd: S,
        at: usize,
        found: Nearest<S, E>,
        background: impl FnOnce() -> Vec3<S, E>,
    ) {
        if !found.hit(simd).any_true() {
            return background().store(&mut self.color, at);
        }
        let end = at + Lanes::<S, E>::LEN;
        found.distance.store_slice(&mut self.distance.0[at..end]);
        found.order.store_slice(&mut self.order.0[at..end]);
        // There is room for all packets of a tile; said, so that the loop holds no code to make more.
        assert!(self.packets.len() < self.packets.capacity());
        self.packets.push((at, u64::MAX));
    }
}

/// Draws what a generation has met: surfaces, their light, and the rays that mirrors send on to the `next`.
#[inline(always)]
fn shade<S: Simd, E: Real, F: Features, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    background: [E; 3],
    (queue, next): (&Queue<E>, Option<&mut Queue<E>>),
    hits: &mut Hits<E>,
    obstacles: &mut Obstacles,
) {
    if hits.packets.is_empty() {
        return;
    }
    let mirrors = F::MIRRORS && scene.needs.mirrors;
    if !scene.lights.is_empty() {
        surfaces::<S, E, F::WithTree, EYE, true>(simd, scene, background, queue, hits);
        if F::SHADOWS && scene.needs.shadows {
            obstacles.find(simd, scene, hits);
            light_up::<S, E, F::WithMirrors, true>(simd, scene, hits, obstacles);
        } else {
            light_up::<S, E, Spheres, false>(simd, scene, hits, obstacles);
        }
    } else if mirrors {
        surfaces::<S, E, F::WithTree, EYE, false>(simd, scene, background, queue, hits);
    } else {
        ambient::<S, E, EYE>(simd, scene, background, queue, hits);
    }
    if mirrors && let Some(next) = next {
        reflect::<S, E, EYE>(simd, scene, queue, hits, next);
    }
}

/// The colour of hits that neither light nor mirrors change.
#[inline(never)]
fn ambient<S: Simd, E: Real, const EYE: bool>(
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
struct Met<'a, S: Simd, E: Real> {
    found: Nearest<S, E>,
    /// The same orders, for one lane at a time.
    orders: &'a [E],
    hit: Mask<S, E>,
}

impl<'a, S: Simd, E: Real> Met<'a, S, E> {
    #[inline(always)]
    fn new(simd: S, at: usize, distance: &Column<E>, order: &'a Column<E>) -> Self {
        let lanes = at..at + Lanes::<S, E>::LEN;
        let orders = &order.0[lanes.clone()];
        let distance = Lanes::<S, E>::from_slice(simd, &distance.0[lanes]);
        let found = Nearest { distance, order: Lanes::<S, E>::from_slice(simd, orders) };
        Self { found, orders, hit: found.hit(simd) }
    }

    /// The object that a lane meets, and the lanes that meet it.
    #[inline(always)]
    fn object<'s>(&self, simd: S, scene: &'s Prepared<E>, lane: u32) -> (&'s Entry<E>, Mask<S, E>) {
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
}

/// The colour of hits without light, and for light (if `LIT`) and mirrors how their surfaces lie.
#[inline(never)]
fn surfaces<S: Simd, E: Real, F: Features, const EYE: bool, const LIT: bool>(
    simd: S,
    scene: &Prepared<E>,
    background: [E; 3],
    queue: &Queue<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Hits { distance, order, start, normal, diffuse, color, packets, mirrors } = hits;
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
                        if F::MIRRORS && entry.mirrors {
                            mirror_bits |= bits;
                        } else if !LIT {
                            return;
                        }
                        let origin = if EYE { zero } else { Vec3::load(simd, &queue.origin, at) };
                        let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                        let surface = surface::<S, E, F, EYE>(simd, scene, entry, ray, met.found.distance);
                        share.put(simd, surface.normal, zero, normal);
                        if LIT {
                            share.put(
                                simd,
                                weigh::<S, E, EYE>(simd, entry.diffuse, queue, at),
                                zero,
                                diffuse,
                            );
                            let is_alone = is_first && bits == met.hit.to_bitmask();
                            *others = if is_alone { own_shadow::<E, EYE>(scene, entry) } else { u64::MAX };
                        }
                        let Vec3 { x, y, z } = surface.start;
                        // Lanes without a hit start where the first hit does, and widen no region.
                        let lane = bits.trailing_zeros() as usize;
                        share.put(simd, surface.start, Vec3::splat(simd, [x[lane], y[lane], z[lane]]), start);
                    },
                );
                if F::MIRRORS && mirror_bits != 0 {
                    mirrors.push((at, mirror_bits));
                }
            }
        },
    );
}

/// The rays that mirrors send on.
#[inline(never)]
fn reflect<S: Simd, E: Real, const EYE: bool>(
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
                let normal = Vec3::<S, E>::load(simd, &hits.normal, at);
                let incoming = Vec3::load(simd, &queue.direction, at);
                // The normal faces the ray; where rounding says otherwise, the ray grazes.
                let towards = incoming.dot(normal).min(constant::<S, E>(simd, 0.0));
                let direction = normal.scale_add(towards * constant::<S, E>(simd, -2.0), incoming);
                // A step of Newton's method keeps its length at 1.
                let stretch = direction
                    .dot(direction)
                    .mul_add(constant::<S, E>(simd, -0.5), constant::<S, E>(simd, 1.5));
                let pixel = if EYE {
                    lanes::<S, E>(simd, at, usize::MAX)
                } else {
                    Lanes::<S, E>::from_slice(simd, &queue.pixel.0[at..at + Lanes::<S, E>::LEN])
                };
                // Lanes that only repeat another send nothing on.
                let mirrors =
                    if EYE { mirrors } else { mirrors & pixel.simd_ge(constant::<S, E>(simd, 0.0)) };
                let end = next.count;
                compress(Vec3::load(simd, &hits.start, at), mirrors, &mut next.origin, end);
                compress(direction.scale(stretch), mirrors, &mut next.direction, end);
                compress(mirror, mirrors, &mut next.weight, end);
                pixel.compress(mirrors).store_slice(&mut next.pixel.0[end..end + Lanes::<S, E>::LEN]);
                next.count += mirrors.to_bitmask().count_ones() as usize;
            }
        },
    );
}

/// A colour times the weights of a packet's rays, which are 1 for rays from the eye.
#[inline(always)]
fn weigh<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    color: [E; 3],
    queue: &Queue<E>,
    at: usize,
) -> Vec3<S, E> {
    let color = Vec3::splat(simd, color);
    if EYE { color } else { color.mul(Vec3::load(simd, &queue.weight, at)) }
}

#[inline(always)]
fn compress<S: Simd, E: Real>(v: Vec3<S, E>, lanes: Mask<S, E>, into: &mut Columns<E>, at: usize) {
    Vec3::<S, E>::new(v.x.compress(lanes), v.y.compress(lanes), v.z.compress(lanes)).store(into, at);
}

/// All candidates but the object itself, where it cannot be in its own light: a convex one, seen from outside.
#[inline(always)]
fn own_shadow<E: Real, const EYE: bool>(scene: &Prepared<E>, entry: &Entry<E>) -> u64 {
    let outside =
        EYE && entry.kind == Kind::Sphere && scene.spheres[entry.index as usize].power > E::narrow(0.0);
    if outside && scene.tree.is_none() { !(1 << entry.index) } else { u64::MAX }
}

/// An object's surface where the rays meet it.
#[inline(always)]
pub(super) fn surface<S: Simd, E: Real, F: Features, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    entry: &Entry<E>,
    ray: Ray<S, E>,
    distance: Lanes<S, E>,
) -> Surface<S, E> {
    let at = entry.index as usize;
    if F::CUBOIDS && entry.kind == Kind::Cuboid {
        let slopes = Slopes::new(simd, ray.direction);
        return F::cuboid_surface(simd, &scene.cuboids[at], ray, slopes, distance, OFFSET);
    }
    if F::TRIANGLES && entry.kind == Kind::Triangle {
        return F::triangle_surface(simd, &scene.triangles[at], ray, distance, OFFSET);
    }
    F::sphere_surface::<S, E, EYE>(simd, &scene.spheres[at], ray, distance)
}

/// Colours to the bytes of the image.
#[inline(never)]
fn develop<S: Simd, E: Real>(simd: S, tile: Tile, colors: &Columns<E>, band: &mut Band) {
    simd.vectorize(
        #[inline(always)]
        || {
            let (width, height) = packet_shape::<S, E>();
            let stride = band.size.0 as usize * CHANNELS;
            let mut at = 0;
            for top in (0..tile.height as usize).step_by(height) {
                for left in (0..tile.width as usize).step_by(width) {
                    let mut packed = [0; 16];
                    let Vec3 { x, y, z } = Vec3::<S, E>::load(simd, colors, at);
                    #[cfg(feature = "accuracy")]
                    for channel in [x, y, z] {
                        crate::nans::add(channel.simd_ne(channel).to_bitmask().count_ones());
                    }
                    E::pack::<S>(
                        [level::<S, E>(simd, x), level::<S, E>(simd, y), level::<S, E>(simd, z)],
                        &mut packed,
                    );
                    let rows = top..(top + height).min(tile.height as usize);
                    for (row, pixels) in rows.zip(packed.chunks_exact(width)) {
                        let from = row * stride + (tile.left as usize + left) * CHANNELS;
                        let columns = tile.width as usize - left;
                        if columns >= width {
                            write(pixels, &mut band.bytes[from..from + width * CHANNELS]);
                        } else {
                            write(&pixels[..columns], &mut band.bytes[from..from + columns * CHANNELS]);
                        }
                    }
                    at += Lanes::<S, E>::LEN;
                }
            }
        },
    );
}

/// The three bytes of each pixel, two pixels at a time.
#[inline(always)]
fn write(pixels: &[u32], bytes: &mut [u8]) {
    let (pairs, last) = pixels.as_chunks();
    let (two, one) = bytes.as_chunks_mut::<{ 2 * CHANNELS }>();
    for (bytes, &[first, second]) in two.iter_mut().zip(pairs) {
        let both = (u64::from(first) | u64::from(second) << 24).to_le_bytes();
        bytes.copy_from_slice(&both[..2 * CHANNELS]);
    }
    if let [last] = last {
        one.copy_from_slice(&last.to_le_bytes()[..CHANNELS]);
    }
}

/// A level and a half a level, so that cutting off the fraction rounds; what is not a number is black.
#[inline(always)]
fn level<S: Simd, E: Real>(simd: S, channel: Lanes<S, E>) -> Lanes<S, E> {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let known = channel.simd_eq(channel).select(channel, zero);
    known.max(zero).min(one).mul_add(constant::<S, E>(simd, 255.0), constant::<S, E>(simd, 0.5))
}
