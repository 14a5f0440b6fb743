//! A tile of the image: rays, what they see, its light, and what its mirrors see.
//!
//! Generation by generation: the first holds the tile's pixels, each further one the mirrored rays of the one before,
//! closed up so that packets stay full. In a generation all hits are found first; the region that they fill then decides
//! which objects can stand in the way of each light. Each of the steps is compiled as one function with the instruction
//! set's features (`vectorize`); all in one would take the compiler much longer.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::features::Features;
use super::intersect::{Ray, Slopes, Surface};
use super::lists::{Beam, Picked, Seen};
use super::prepare::{Entry, Kind, Light, OFFSET, Outlines, Prepared, Rays};
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};
use super::search::{Candidates, Masks, nearest, unshaded};
use crate::parallel::CHANNELS;

/// Pixels of a tile at most.
pub(super) const PIXELS: usize = 256;

/// A tile's pixels and room for a packet that begins at the last of them.
const ROOM: usize = PIXELS + 16;

/// A number for each ray of a tile.
#[derive(Clone)]
#[repr(align(64))]
struct Column<E>([E; ROOM]);

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

type Columns<E> = [Column<E>; 3];

/// Rays that wait to be traced.
struct Queue<E> {
    origin: Columns<E>,
    direction: Columns<E>,
    /// What their colour counts for in the pixel's.
    weight: Columns<E>,
    pixel: Column<E>,
    count: usize,
}

/// Hits that wait for their light.
struct Hits<E> {
    start: Columns<E>,
    normal: Columns<E>,
    /// Diffuse coefficient times the ray's weight.
    diffuse: Columns<E>,
    color: Columns<E>,
    /// For each packet with hits: where it begins, and the object that cannot be in its way, as a bit.
    packets: Vec<(usize, u64)>,
}

/// Memory of a worker, used again for each of its tiles.
pub(super) struct Scratch<E> {
    queues: [Queue<E>; 2],
    hits: Hits<E>,
    pixels: Columns<E>,
    obstacles: Obstacles,
    sights: Picked,
}

/// What can stand in the way of each light.
#[derive(Default)]
struct Obstacles {
    of: Vec<InTheWay>,
    seen: Seen,
}

#[derive(Default)]
struct InTheWay {
    /// In a scene without a tree.
    masks: Masks,
    /// In one with a tree, if it is not too long.
    list: Picked,
    is_listed: bool,
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
            queues: [queue(), queue()],
            hits: Hits {
                start: columns(),
                normal: columns(),
                diffuse: columns(),
                color: columns(),
                packets: Vec::with_capacity(PIXELS),
            },
            pixels: columns(),
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
    let Scratch { queues: [queue, next], hits, pixels, obstacles, sights } = scratch;
    next.count = 0;
    let candidates = match &scene.sights {
        Some(all) if F::TREE && all.gather(tile.place.0, tile.place.1, sights) => {
            if sights.len() == 0 {
                return fill(tile, band);
            }
            Candidates { masks: Masks::default(), list: Some(sights) }
        }
        _ => Candidates { masks: Masks::split(tile.candidates, scene), list: None },
    };
    first_generation::<S, E, F>(simd, scene, tile, candidates, band, hits, (&mut *queue, &mut *next));
    light_up::<S, E, F::Mirroring>(simd, scene, hits, obstacles);
    if F::MIRRORS && next.count > 0 {
        core::mem::swap(&mut hits.color, pixels);
        let (mut queue, mut next) = (queue, next);
        let all = Candidates::all(scene);
        for bounce in 1..=tile.bounces {
            core::mem::swap(&mut queue, &mut next);
            next.count = 0;
            let after = (bounce < tile.bounces).then_some(&mut *next);
            later_generation::<S, E, F>(simd, scene, all, scene.background, hits, queue, after);
            light_up::<S, E, F::Mirroring>(simd, scene, hits, obstacles);
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

/// The rays of the tile's pixels.
#[inline(always)]
fn first_generation<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    tile: Tile,
    candidates: Candidates,
    band: &Band,
    hits: &mut Hits<E>,
    (queue, next): (&mut Queue<E>, &mut Queue<E>),
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let (width, height) = packet_shape::<S, E>();
            let columns = lanes::<S, E>(simd, 0, width);
            let rows = (lanes::<S, E>(simd, 0, usize::MAX) - columns) * E::narrow(1.0 / width as f64);
            let right = constant::<S, E>(simd, f64::from(tile.left + tile.width - 1));
            let bottom = constant::<S, E>(simd, f64::from(tile.top + tile.height - 1));
            let last_row = constant::<S, E>(simd, f64::from(band.size.1 - 1));
            let background = band.background.map(|level| E::narrow(f64::from(level) / 255.0));
            hits.packets.clear();
            let mut at = 0;
            for top in (0..tile.height as usize).step_by(height) {
                for left in (0..tile.width as usize).step_by(width) {
                    // Lanes beyond the edge draw the pixel on the edge again.
                    let i = (columns + E::narrow((tile.left as usize + left) as f64)).min(right);
                    let row = (rows + E::narrow((tile.top as usize + top) as f64)).min(bottom);
                    let j = last_row - row;
                    match scene.rays {
                        Rays::Pinhole { corner, right, up } => {
                            let along = Vec3::splat(simd, right).scale_add(i, Vec3::splat(simd, corner));
                            let direction = Vec3::splat(simd, up).scale_add(j, along).normalize(simd);
                            let ray = Ray { origin: Vec3::zero(simd), direction };
                            let next = (None, Some(&mut *next));
                            trace::<S, E, F, true>(simd, scene, ray, candidates, background, at, hits, next);
                        }
                        Rays::Parallel { corner, pixel } => {
                            let pixel = splat::<S, E>(simd, pixel);
                            let corner = Vec3::<S, E>::splat(simd, corner);
                            Vec3::<S, E>::new(
                                i.mul_add(pixel, corner.x),
                                j.mul_add(pixel, corner.y),
                                corner.z,
                            )
                            .store(&mut queue.origin, at);
                            let (zero, one) = (E::narrow(0.0), E::narrow(1.0));
                            Vec3::<S, E>::splat(simd, [zero, zero, E::narrow(-1.0)])
                                .store(&mut queue.direction, at);
                            Vec3::<S, E>::splat(simd, [one; 3]).store(&mut queue.weight, at);
                            lanes::<S, E>(simd, at, usize::MAX)
                                .store_slice(&mut queue.pixel.0[at..at + Lanes::<S, E>::LEN]);
                            queue.count = at + Lanes::<S, E>::LEN;
                        }
                    }
                    at += Lanes::<S, E>::LEN;
                }
            }
            if let Rays::Parallel { .. } = scene.rays {
                later_generation::<S, E, F>(simd, scene, candidates, background, hits, queue, Some(next));
            }
        },
    );
}

/// The rays of a queue: those that the generation before sent on.
#[inline(always)]
fn later_generation<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    candidates: Candidates,
    background: [E; 3],
    hits: &mut Hits<E>,
    queue: &mut Queue<E>,
    mut next: Option<&mut Queue<E>>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            // Lanes beyond the last ray trace it again.
            let (last, end) = (queue.count - 1, queue.count.next_multiple_of(Lanes::<S, E>::LEN));
            for columns in [&mut queue.origin, &mut queue.direction, &mut queue.weight] {
                for column in columns {
                    let value = column.0[last];
                    column.0[last + 1..end].fill(value);
                }
            }
            queue.pixel.0[last + 1..end].fill(E::narrow(-1.0));
            hits.packets.clear();
            for at in (0..queue.count).step_by(Lanes::<S, E>::LEN) {
                let ray = Ray {
                    origin: Vec3::load(simd, &queue.origin, at),
                    direction: Vec3::load(simd, &queue.direction, at),
                };
                let queues = (Some(&*queue), next.as_deref_mut());
                trace::<S, E, F, false>(simd, scene, ray, candidates, background, at, hits, queues);
            }
        },
    );
}

/// Finds what a packet of rays sees: stores hits that wait for light, their colour without it, and mirrored rays.
///
/// `queues` are the one that the packet comes from, if it is not of the first generation, and the next.
#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "inlined into its two callers; a struct of them would have no other use"
)]
fn trace<S: Simd, E: Real, F: Features, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    candidates: Candidates,
    background: [E; 3],
    at: usize,
    hits: &mut Hits<E>,
    (queue, next): (Option<&Queue<E>>, Option<&mut Queue<E>>),
) {
    let weight = match queue {
        Some(queue) => Vec3::load(simd, &queue.weight, at),
        None => Vec3::splat(simd, [E::narrow(1.0); 3]),
    };
    let found = nearest::<S, E, F, EYE>(simd, scene, ray, candidates);
    let hit = found.hit(simd);
    let background = weigh::<S, E, EYE>(Vec3::splat(simd, background), weight);
    let mut remaining = hit.to_bitmask();
    if remaining == 0 {
        return background.store(&mut hits.color, at);
    }
    let zero = Vec3::zero(simd);
    let mut start = zero;
    let mut normal = zero;
    let mut diffuse = zero;
    let mut color = background;
    let mut mirror_bits = 0;
    let mut alone = u64::MAX;
    // Without lights only mirrors need to know where and how a surface lies.
    let is_lit = !scene.lights.is_empty();
    while remaining != 0 {
        let order = found.order[remaining.trailing_zeros() as usize];
        let entry = &scene.entries[order.to_index()];
        let same = hit & found.order.simd_eq(splat::<S, E>(simd, order));
        let bits = same.to_bitmask();
        let is_mirror = F::MIRRORS && entry.mirrors;
        if is_mirror || is_lit {
            let surface = surface::<S, E, F, EYE>(simd, scene, entry, ray, found.distance);
            start = Vec3::select(same, surface.start, start);
            normal = Vec3::select(same, surface.normal, normal);
            diffuse = Vec3::select(same, Vec3::splat(simd, entry.diffuse), diffuse);
        }
        color = Vec3::select(same, weigh::<S, E, EYE>(Vec3::splat(simd, entry.ambient), weight), color);
        if is_mirror {
            mirror_bits |= bits;
        }
        if is_lit {
            alone &= if bits == hit.to_bitmask() { own_shadow::<E, EYE>(scene, entry) } else { u64::MAX };
        }
        remaining &= !bits;
    }
    if F::SHADOWS && scene.needs.shadows {
        // Lanes without a hit start where the first hit does, and leave the region as it is.
        let mut all = start;
        if hit.any_false() {
            let first = hit.to_bitmask().trailing_zeros() as usize;
            let known = Vec3::splat(simd, [start.x[first], start.y[first], start.z[first]]);
            all = Vec3::select(hit, start, known);
        }
        all.store(&mut hits.start, at);
    }
    color.store(&mut hits.color, at);
    if is_lit {
        normal.store(&mut hits.normal, at);
        weigh::<S, E, EYE>(diffuse, weight).store(&mut hits.diffuse, at);
        hits.packets.push((at, alone));
    }
    if !F::MIRRORS || mirror_bits == 0 {
        return;
    }
    let Some(next) = next else { return };
    let mut mirror = zero;
    let mut mirrors = hit & !hit;
    while mirror_bits != 0 {
        let order = found.order[mirror_bits.trailing_zeros() as usize];
        let same = hit & found.order.simd_eq(splat::<S, E>(simd, order));
        mirrors |= same;
        mirror = Vec3::select(same, Vec3::splat(simd, scene.entries[order.to_index()].mirror), mirror);
        mirror_bits &= !same.to_bitmask();
    }
    // The normal faces the ray; where rounding says otherwise, the ray grazes.
    let towards = ray.direction.dot(normal).min(constant::<S, E>(simd, 0.0));
    let direction = normal.scale_add(towards * constant::<S, E>(simd, -2.0), ray.direction);
    // A step of Newton's method keeps its length at 1.
    let stretch = direction.dot(direction).mul_add(constant::<S, E>(simd, -0.5), constant::<S, E>(simd, 1.5));
    let pixel = match queue {
        Some(queue) => Lanes::<S, E>::from_slice(simd, &queue.pixel.0[at..at + Lanes::<S, E>::LEN]),
        None => lanes::<S, E>(simd, at, usize::MAX),
    };
    // Lanes that only repeat another send nothing on.
    let mirrors = if EYE { mirrors } else { mirrors & pixel.simd_ge(constant::<S, E>(simd, 0.0)) };
    let end = next.count;
    compress(start, mirrors, &mut next.origin, end);
    compress(direction.scale(stretch), mirrors, &mut next.direction, end);
    compress(weigh::<S, E, EYE>(mirror, weight), mirrors, &mut next.weight, end);
    pixel.compress(mirrors).store_slice(&mut next.pixel.0[end..end + Lanes::<S, E>::LEN]);
    next.count += mirrors.to_bitmask().count_ones() as usize;
}

/// A colour times the ray's weight, which is 1 for rays from the eye.
#[inline(always)]
fn weigh<S: Simd, E: Real, const EYE: bool>(color: Vec3<S, E>, weight: Vec3<S, E>) -> Vec3<S, E> {
    if EYE { color } else { color.mul(weight) }
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

/// Adds the light that reaches the hits.
#[inline(always)]
fn light_up<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    hits: &mut Hits<E>,
    obstacles: &mut Obstacles,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            if hits.packets.is_empty() {
                return;
            }
            let Obstacles { of, seen } = obstacles;
            of.resize_with(scene.lights.len(), InTheWay::default);
            if F::SHADOWS && scene.needs.shadows {
                let (low, high) = region(simd, hits);
                for (light, of) in scene.lights.iter().zip(of.iter_mut()) {
                    let beam = beam(light, low, high);
                    if F::TREE && scene.tree.is_some() {
                        let InTheWay { list, is_listed, .. } = of;
                        *is_listed =
                            light.buffer.as_ref().is_some_and(|buffer| buffer.gather(&beam, seen, list));
                    } else {
                        of.masks = Masks::split(in_the_way(simd, &light.outlines, beam), scene);
                    }
                }
            }
            let zero = constant::<S, E>(simd, 0.0);
            for &(at, others) in &hits.packets {
                let normal = Vec3::load(simd, &hits.normal, at);
                let start = Vec3::load(simd, &hits.start, at);
                let mut sum = Vec3::zero(simd);
                for (light, obstacles) in scene.lights.iter().zip(of.iter()) {
                    let cosine = normal.dot(Vec3::splat(simd, light.axes[2]));
                    let mut lit = cosine.simd_gt(zero);
                    if !lit.any_true() {
                        continue;
                    }
                    if F::SHADOWS && scene.needs.shadows {
                        let candidates = Candidates {
                            masks: obstacles.masks.and_spheres(others),
                            list: obstacles.is_listed.then_some(&obstacles.list),
                        };
                        lit = unshaded::<S, E, F>(simd, scene, light, start, lit, candidates);
                    }
                    sum = Vec3::splat(simd, light.color).scale_add(lit.select(cosine, zero), sum);
                }
                let diffuse = Vec3::load(simd, &hits.diffuse, at);
                let color = Vec3::load(simd, &hits.color, at);
                let lit = Vec3::<S, E>::new(
                    diffuse.x.mul_add(sum.x, color.x),
                    diffuse.y.mul_add(sum.y, color.y),
                    diffuse.z.mul_add(sum.z, color.z),
                );
                lit.store(&mut hits.color, at);
            }
        },
    );
}

/// The box of the points that wait for light; there is at least one.
#[inline(always)]
fn region<S: Simd, E: Real>(simd: S, hits: &Hits<E>) -> ([E; 3], [E; 3]) {
    let far = constant::<S, E>(simd, E::FAR);
    let near = constant::<S, E>(simd, -E::FAR);
    let mut low = Vec3::<S, E>::new(far, far, far);
    let mut high = Vec3::<S, E>::new(near, near, near);
    for &(at, _) in &hits.packets {
        let Vec3 { x, y, z } = Vec3::<S, E>::load(simd, &hits.start, at);
        low = Vec3::<S, E>::new(low.x.min(x), low.y.min(y), low.z.min(z));
        high = Vec3::<S, E>::new(high.x.max(x), high.y.max(y), high.z.max(z));
    }
    (
        [low.x.reduce_min(), low.y.reduce_min(), low.z.reduce_min()],
        [high.x.reduce_max(), high.y.reduce_max(), high.z.reduce_max()],
    )
}

/// The shadow rays that start in a box, wider by the rounding errors.
#[inline(always)]
fn beam<E: Real>(light: &Light<E>, low: [E; 3], high: [E; 3]) -> Beam {
    let mut spans = [(0.0, 0.0); 3];
    let mut starts = [0.0; 3];
    for ((axis, (from, to)), nearest) in light.axes.iter().zip(&mut spans).zip(0..3) {
        let mut slack = 0.0;
        for ((direction, low), high) in axis.iter().zip(low).zip(high) {
            let (a, b) = (direction.widen() * low.widen(), direction.widen() * high.widen());
            *from += a.min(b);
            *to += a.max(b);
            slack += a.abs().max(b.abs());
        }
        *from -= 16.0 * E::ROUNDOFF * slack;
        *to += 16.0 * E::ROUNDOFF * slack;
        let backwards = light.axes[2][nearest] < E::narrow(0.0);
        starts[nearest] = if backwards { -high[nearest].widen() } else { low[nearest].widen() };
    }
    let [x, y, z] = spans;
    Beam { low: [x.0, y.0], high: [x.1, y.1], height: z.0, starts }
}

/// The objects that can stand in a beam's way, by bits.
#[inline(always)]
fn in_the_way<S: Simd, E: Real>(simd: S, outlines: &Outlines<E>, beam: Beam) -> u64 {
    let (left, right) = (constant::<S, E>(simd, beam.low[0]), constant::<S, E>(simd, beam.high[0]));
    let (bottom, top) = (constant::<S, E>(simd, beam.low[1]), constant::<S, E>(simd, beam.high[1]));
    let near = constant::<S, E>(simd, beam.height);
    let [x, y, z] = beam.starts;
    let starts = Vec3::<S, E>::splat(simd, [E::narrow(x), E::narrow(y), E::narrow(z)]);
    let mut candidates = 0;
    let count = outlines.top.len();
    for at in (0..count).step_by(Lanes::<S, E>::LEN) {
        let overlap = load::<S, E>(simd, at, &outlines.low[0]).simd_le(right)
            & load::<S, E>(simd, at, &outlines.high[0]).simd_ge(left)
            & load::<S, E>(simd, at, &outlines.low[1]).simd_le(top)
            & load::<S, E>(simd, at, &outlines.high[1]).simd_ge(bottom)
            & load::<S, E>(simd, at, &outlines.top).simd_ge(near)
            & load::<S, E>(simd, at, &outlines.exits[0]).simd_ge(starts.x)
            & load::<S, E>(simd, at, &outlines.exits[1]).simd_ge(starts.y)
            & load::<S, E>(simd, at, &outlines.exits[2]).simd_ge(starts.z);
        candidates |= overlap.to_bitmask() << at;
    }
    candidates
}

#[inline(always)]
fn load<S: Simd, E: Real>(simd: S, at: usize, from: &[E]) -> Lanes<S, E> {
    Lanes::<S, E>::from_slice(simd, &from[at..at + Lanes::<S, E>::LEN])
}

/// Colours to the bytes of the image.
#[inline(always)]
fn develop<S: Simd, E: Real>(simd: S, tile: Tile, colors: &Columns<E>, band: &mut Band) {
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
            for (row, pixels) in
                (top..(top + height).min(tile.height as usize)).zip(packed.chunks_exact(width))
            {
                let from = row * stride + (tile.left as usize + left) * CHANNELS;
                let columns = width.min(tile.width as usize - left);
                let bytes = &mut band.bytes[from..from + columns * CHANNELS];
                for (bytes, pixel) in bytes.as_chunks_mut::<CHANNELS>().0.iter_mut().zip(pixels) {
                    let [r, g, b, _] = pixel.to_le_bytes();
                    *bytes = [r, g, b];
                }
            }
            at += Lanes::<S, E>::LEN;
        }
    }
}

/// A level and a half a level, so that cutting off the fraction rounds; what is not a number is black.
#[inline(always)]
fn level<S: Simd, E: Real>(simd: S, channel: Lanes<S, E>) -> Lanes<S, E> {
    let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
    let known = channel.simd_eq(channel).select(channel, zero);
    known.max(zero).min(one).mul_add(constant::<S, E>(simd, 255.0), constant::<S, E>(simd, 0.5))
}
