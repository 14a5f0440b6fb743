//! The rays that go on from hits in scenes in which surfaces light each other. This step replaces `reflect` and
//! `spawn_rays` there.
//!
//! It works lane by lane, with the functions of the reference tracer. Only the directions of scattered rays and of
//! those towards light are drawn in packets, by the same functions.

use fearless_simd::{Simd, SimdBase};
use glam::DVec3;
use rayfold_scene::Glass;

use crate::fast::arithmetic::real::{Lanes, Real};
use crate::fast::build::prepare::Prepared;
use crate::fast::materials::paths::Paths;
use crate::fast::rays::bounce::{Column, Hits, ROOM, RayBatch};
use crate::fast::transport::path_queue::{BLOCK, Drawn, PathQueues, PathRay, Turns};
use crate::fast::transport::ray_queue::RayQueues;
use crate::reference::{Refraction, refract};
use crate::sampling::guide::{Guide, Scattering};
use crate::sampling::paths::{Way, choice, direction_dimension, scattered};
use crate::sampling::{BATCH, Dimensions, Points};

/// The random numbers of a tile's paths.
#[derive(Clone, Copy)]
pub(crate) struct PathNumbers<'a> {
    pub(crate) points: &'a Points,
    pub(crate) dimensions: &'a Dimensions,
    /// The seed and the sample of each pixel of the batch of camera rays.
    pub(crate) seeds: &'a [u32],
    pub(crate) samples: &'a [u32],
    /// The largest number of mirrorings and refractions.
    pub(crate) bounces: u32,
    /// The largest number of diffuse reflections.
    pub(crate) indirect: u32,
}

impl PathNumbers<'_> {
    /// Returns the numbers of the direction in which a path goes on.
    #[inline(always)]
    fn direction(&self, slot: usize, hits: u32) -> (f64, f64) {
        let first = direction_dimension(self.dimensions, hits);
        let of = |dimension| self.points.coordinate(dimension, self.seeds[slot], self.samples[slot]);
        (of(first), of(first + 1))
    }
}

/// Draws the directions by the cosine at the hits of a batch, and the numbers that they are drawn with. Returns the end of the lanes
/// that have them.
#[inline(never)]
fn draw_by_cosine<S: Simd, E: Real>(
    simd: S,
    numbers: PathNumbers,
    (queue, hits): (&RayBatch<E>, &Hits<E>),
    paths: &mut PathQueues<E>,
) -> usize {
    let drawn = &mut paths.drawn;
    let end = hits.packets.iter().map(|&(at, _)| at + Lanes::<S, E>::LEN).max().unwrap_or(0);
    drawn.is_scattered.fill(false);
    // Others take the numbers of some sample, which are of no use.
    let (mut seeds, mut samples) = ([numbers.seeds[0]; ROOM], [numbers.samples[0]; ROOM]);
    let mut before = 0;
    for lane in hits.packets.iter().flat_map(|&(at, _)| at..at + Lanes::<S, E>::LEN) {
        let turns = paths.turns[lane];
        let pixel = queue.pixel.0[lane];
        if hits.is_hit(lane) && pixel.widen() >= 0.0 && u32::from(turns.scattered) < numbers.indirect {
            drawn.is_scattered[lane] = true;
            let slot = pixel.to_index();
            (seeds[lane], samples[lane]) = (numbers.seeds[slot], numbers.samples[slot]);
            // All rays of a batch have as many hits before.
            before = turns.hits();
        }
    }
    let first = direction_dimension(numbers.dimensions, before);
    simd.vectorize(
        #[inline(always)]
        || {
            for (dimension, column) in (first..).zip(&mut drawn.numbers) {
                let pixels = seeds[..end].chunks(BATCH).zip(samples[..end].chunks(BATCH));
                for ((seeds, samples), into) in pixels.zip(column.0[..end].chunks_mut(BATCH)) {
                    numbers.points.coordinates(dimension, seeds, samples, into);
                }
            }
        },
    );
    let faces = if hits.face[0].is_empty() { None } else { Some(&hits.face) };
    simd.vectorize(
        #[inline(always)]
        || {
            let [u, v] = drawn.numbers.each_ref().map(|column| &column.0[..end]);
            let [nx, ny, nz] = hits.normal.each_ref().map(|column| &column.0[..end]);
            let [fx, fy, fz] = match faces {
                Some(faces) => faces.each_ref().map(|column| &column[..end]),
                None => [nx, ny, nz],
            };
            let [x, y, z] = drawn.by_cosine.each_mut().map(|column| &mut column.0[..end]);
            for k in 0..end {
                let normal = DVec3::new(nx[k].widen(), ny[k].widen(), nz[k].widen());
                let face = DVec3::new(fx[k].widen(), fy[k].widen(), fz[k].widen());
                let direction = scattered((u[k], v[k]), normal, face);
                (x[k], y[k], z[k]) = (direction.x, direction.y, direction.z);
            }
        },
    );
    end
}

/// Draws the rays towards light at the hits in the lanes before `end`, beside those by the cosine.
#[inline(never)]
fn aim<S: Simd, E: Real>(
    simd: S,
    (guide, scene): (&Guide, &Paths),
    (hits, end): (&Hits<E>, usize),
    drawn: &mut Drawn,
) {
    for first in (0..end).step_by(BLOCK) {
        let lanes = first..first + BLOCK;
        if !drawn.is_scattered[lanes.clone()].contains(&true) {
            continue;
        }
        let (mut place, mut normal, mut face) = ([[0.0; BLOCK]; 3], [[0.0; BLOCK]; 3], [[0.0; BLOCK]; 3]);
        for (k, lane) in lanes.clone().enumerate() {
            let (start, face_of, normal_of) = start(hits, lane);
            for (columns, vector) in
                [(&mut place, scene.in_scene(start)), (&mut normal, normal_of), (&mut face, face_of)]
            {
                for (column, part) in columns.iter_mut().zip(vector.to_array()) {
                    column[k] = part;
                }
            }
        }
        let block = |column: &Column<f64>| core::array::from_fn(|k| column.0[first + k]);
        let at = Scattering::<BLOCK> {
            is_hit: core::array::from_fn(|k| drawn.is_scattered[first + k]),
            numbers: drawn.numbers.each_ref().map(|column| block(column)),
            by_cosine: drawn.by_cosine.each_ref().map(|column| block(column)),
            place,
            normal,
            face,
        };
        let seen = &mut drawn.seen;
        let aimed = simd.vectorize(
            #[inline(always)]
            || guide.scattered(&at, seen),
        );
        for (to, from) in drawn.aimed.iter_mut().zip(&aimed.directions) {
            to.0[lanes.clone()].copy_from_slice(from);
        }
        for (to, from) in drawn.factors.iter_mut().zip(&aimed.factors) {
            to.0[lanes.clone()].copy_from_slice(from);
        }
    }
}

/// Adds the rays that go on from the hits of a batch to the queues. `is_painted` is whether the hits have their mirror
/// coefficients, as in patterns and fog.
#[inline(never)]
pub(crate) fn spawn_paths<S: Simd, E: Real>(
    simd: S,
    (scene, paths): (&Prepared<E>, &Paths),
    numbers: PathNumbers,
    (queue, hits): (&RayBatch<E>, &Hits<E>),
    is_painted: bool,
    waiting: &mut RayQueues<E>,
) {
    let lanes = Lanes::<S, E>::LEN;
    if numbers.indirect > 0 {
        let end = draw_by_cosine(simd, numbers, (queue, hits), &mut waiting.paths);
        if let Some(guide) = paths.guide() {
            aim(simd, (guide, paths), (hits, end), &mut waiting.paths.drawn);
        }
    }
    let is_foggy = scene.fog().is_some();
    for &(at, _) in &hits.packets {
        for lane in at..at + lanes {
            let pixel = queue.pixel.0[lane];
            // Lanes that repeat another lane spawn no rays.
            if !hits.is_hit(lane) || pixel.widen() < 0.0 {
                continue;
            }
            let turns = waiting.paths.turns(lane);
            let from = Origin { slot: pixel.to_index(), pixel, turns, numbers };
            let (start, face, normal) = start(hits, lane);
            if u32::from(turns.scattered) < numbers.indirect {
                let mut weight = read(&hits.diffuse, lane);
                if is_foggy {
                    weight *= hits.clearness[lane].widen();
                }
                let drawn = &waiting.paths.drawn;
                let of = |columns: &[Box<Column<f64>>; 3]| {
                    DVec3::from_array(columns.each_ref().map(|column| column.0[lane]))
                };
                let by_cosine = of(&drawn.by_cosine);
                if paths.guide().is_none() {
                    from.send(waiting, Way::Scattered, weight, -1.0, [(start, by_cosine, 1.0)]);
                } else {
                    let [first, second] = drawn.factors.each_ref().map(|column| column.0[lane]);
                    let rays = [(start, by_cosine, first), (start, of(&drawn.aimed), second)];
                    from.send(waiting, Way::Scattered, weight, -1.0, rays);
                }
            }
            let order = hits.order.0[lane].to_index();
            let entry = &scene.entries[order];
            if !entry.mirrors || u32::from(turns.bounced) >= numbers.bounces {
                continue;
            }
            send_onward(
                (scene, paths),
                from,
                (queue, hits),
                (lane, order, is_painted),
                (start, face, normal),
                waiting,
            );
        }
    }
}

/// Sends the mirrored and refracted rays of one hit, at `start` with these normals of its face and of its shading.
// Out of line, so that paths between surfaces without mirrors pay nothing for it.
#[inline(never)]
fn send_onward<E: Real>(
    (scene, paths): (&Prepared<E>, &Paths),
    from: Origin<E>,
    (queue, hits): (&RayBatch<E>, &Hits<E>),
    (lane, order, is_painted): (usize, usize, bool),
    (start, face, normal): (DVec3, DVec3, DVec3),
    waiting: &mut RayQueues<E>,
) {
    let entry = &scene.entries[order];
    let turns = from.turns;
    let is_foggy = scene.fog().is_some();
    let has_faces = !hits.face[0].is_empty();
    let direction = read(&queue.direction, lane);
    let mut weight = read(&queue.weight, lane);
    let mut mirror = if is_painted {
        read_of(&hits.mirror, lane)
    } else {
        DVec3::from_array(entry.mirror.map(E::widen)) * weight
    };
    if is_foggy {
        weight *= hits.clearness[lane].widen();
    }
    let clear = waiting.clear_share(lane, turns.hits());
    let glass = paths.glass(order);
    let [offset, within] = hits.sides.each_ref().map(|side| side.0[lane].widen());
    let mean = |glass: Glass| (glass.color().element_sum() / 3.0).clamp(0.0, 1.0);
    if let Some(facets) = paths.microfacets(order) {
        let cosine = -direction.dot(normal);
        let facet = facets.normal(-direction, normal, from.numbers());
        let towards = reflected(direction, facet);
        let shown = if towards.dot(face) > 0.0 { facets.masking(towards.dot(normal)) } else { 0.0 };
        mirror /= facets.energy(cosine);
        if let Some((glass, is_flat)) = glass {
            let Refraction { mirrored, direction: bent } =
                refract(glass, direction, facet, within != 0.0, is_flat);
            mirror += mirrored * weight;
            let bent = if is_flat { towards - 2.0 * towards.dot(normal) * normal } else { bent };
            let left = if bent.dot(face) < 0.0 { facets.masking(-bent.dot(normal)) } else { 0.0 };
            let left = left * (1.0 - mirrored);
            let clear = if clear > 0.0 { clear * left * mean(glass) } else { -1.0 };
            let weight = weight * glass.color() * left;
            from.send(waiting, Way::Refracted, weight, clear, [(start - 2.0 * offset * face, bent, 1.0)]);
        }
        from.send(waiting, Way::Mirrored, mirror * shown, -1.0, [(start, towards, 1.0)]);
        return;
    }
    let normal = if has_faces { read_of(&hits.onward, lane) } else { normal };
    if let Some((glass, is_flat)) = glass {
        let Refraction { mirrored, direction: bent } =
            refract(glass, direction, normal, within != 0.0, is_flat);
        mirror += mirrored * weight;
        let clear = if clear > 0.0 { clear * (1.0 - mirrored) * mean(glass) } else { -1.0 };
        let weight = weight * glass.color() * (1.0 - mirrored);
        from.send(waiting, Way::Refracted, weight, clear, [(start - 2.0 * offset * face, bent, 1.0)]);
    }
    from.send(waiting, Way::Mirrored, mirror, -1.0, [(start, reflected(direction, normal), 1.0)]);
}

/// The hit from which rays go on.
struct Origin<'a, E> {
    slot: usize,
    pixel: E,
    turns: Turns,
    numbers: PathNumbers<'a>,
}

impl<E: Real> Origin<'_, E> {
    /// Returns the random numbers of a direction.
    #[inline(always)]
    fn numbers(&self) -> (f64, f64) {
        self.numbers.direction(self.slot, self.turns.hits())
    }

    /// Adds the rays of this weight that are followed. `rays` has their starts, their directions and further factors.
    /// These factors do not affect whether a ray is followed: a ray that is aimed at bright light has a small one.
    #[inline(always)]
    fn send<const COUNT: usize>(
        &self,
        waiting: &mut RayQueues<E>,
        way: Way,
        weight: DVec3,
        clear: f64,
        rays: [(DVec3, DVec3, f64); COUNT],
    ) {
        let Self { slot, pixel, turns, numbers } = *self;
        let chance = way.chance(weight);
        let (seed, sample) = (numbers.seeds[slot], numbers.samples[slot]);
        if chance < 1.0 && choice(seed, sample, turns.hits(), way) >= chance {
            return;
        }
        let narrow = |v: DVec3| v.to_array().map(E::narrow);
        let turns = match way {
            Way::Scattered => Turns { scattered: turns.scattered + 1, ..turns },
            Way::Mirrored | Way::Refracted => Turns { bounced: turns.bounced + 1, ..turns },
        };
        for (origin, direction, share) in rays {
            if share == 0.0 {
                continue;
            }
            let ray = PathRay {
                origin: narrow(origin),
                direction: narrow(direction),
                weight: narrow(weight / chance * share),
                pixel,
                clear: E::narrow(clear),
                turns,
            };
            waiting.paths.push(way, ray);
        }
    }
}

/// Returns where the rays from a hit start, and the normals of its face and of its shading.
#[inline(always)]
fn start<E: Real>(hits: &Hits<E>, lane: usize) -> (DVec3, DVec3, DVec3) {
    let normal = read(&hits.normal, lane);
    if hits.face[0].is_empty() {
        (read(&hits.start, lane), normal, normal)
    } else {
        (read_of(&hits.place, lane), read_of(&hits.face, lane), normal)
    }
}

/// Returns the direction of a mirrored ray. The normal faces the ray; if rounding has changed the sign, the ray grazes.
#[inline(always)]
fn reflected(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction - 2.0 * direction.dot(normal).min(0.0) * normal).normalize()
}

#[inline(always)]
fn read<E: Real>(columns: &[Column<E>; 3], lane: usize) -> DVec3 {
    DVec3::new(columns[0].0[lane].widen(), columns[1].0[lane].widen(), columns[2].0[lane].widen())
}

#[inline(always)]
fn read_of<E: Real>(columns: &[Vec<E>; 3], lane: usize) -> DVec3 {
    DVec3::new(columns[0][lane].widen(), columns[1][lane].widen(), columns[2][lane].widen())
}
