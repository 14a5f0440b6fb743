//! A tile of the image: rays, what they see, its light, and what its mirrors see.
//!
//! Generation by generation: the first holds the tile's pixels, each further one the mirrored rays of the one before,
//! closed up so that packets stay full. In a generation all hits are found first; the region that they fill then decides
//! which objects can stand in the way of each light. Each of the steps is one function, compiled with the instruction
//! set's features (`vectorize`) and never inlined: kernels that do a step alike share it, a step's registers are its own,
//! and it is the same code whatever else a build has.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::band::{Band, Tile, develop, fill};
use super::features::{Features, Spheres};
use super::generation::{Columns, Hits, Queue, columns, lanes, packet_shape, weigh};
use super::intersect::Ray;
use super::light::{Obstacles, light_up};
use super::lists::Picked;
use super::prepare::{Prepared, Rays};
use super::real::{Lanes, Real, Vec3, constant, splat};
use super::search::{Candidates, Masks, nearest};
use super::surfaces::{ambient, reflect, surfaces};

/// Memory of a worker, used again for each of its tiles; what is in it does not matter.
pub(super) struct Scratch<E> {
    queue: Queue<E>,
    hits: Hits<E>,
    /// The rays that mirrors send on.
    next: Queue<E>,
    /// The sum of what the generations add to each pixel.
    pixels: Columns<E>,
    obstacles: Obstacles,
    sights: Picked,
}

impl<E: Real> Scratch<E> {
    pub(super) fn new() -> Self {
        Self {
            queue: Queue::new(),
            hits: Hits::new(),
            next: Queue::new(),
            pixels: columns(),
            obstacles: Obstacles::default(),
            sights: Picked::default(),
        }
    }
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
    let Scratch { queue, hits, next, pixels, obstacles, sights } = scratch;
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
