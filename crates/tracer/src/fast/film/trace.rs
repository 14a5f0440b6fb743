//! The first step: the camera rays of a tile's pixels, or the secondary rays of a queue, and their hits.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::acceleration::candidates::Candidates;
use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant};
use crate::fast::bodies::Bodies;
use crate::fast::build::features::Features;
use crate::fast::build::prepare::Prepared;
use crate::fast::film::band::{Band, Tile};
use crate::fast::rays::bounce::{Hits, RayBatch, count_from, lanes_modulo, packet_shape, weigh};
use crate::fast::rays::packet::{Nearest, Ray};
use crate::fast::rays::pixels::{AlongAxis, FromEye};
use crate::fast::transport::search::{nearest, nearest_from_inside};

/// Calls `each` with the column and the row numbers of the tile's pixels, packet by packet. Columns count from an
/// `anchor` to the right, and rows upwards. The numbers are whole or halves.
#[inline(always)]
fn each_packet<S: Simd, E: Real>(
    simd: S,
    (tile, band): (Tile, &Band),
    anchor: (f64, f64),
    mut each: impl FnMut(usize, Lanes<S, E>, Lanes<S, E>),
) {
    let (width, height) = packet_shape::<S, E>();
    let columns = lanes_modulo::<S, E>(simd, width);
    let rows = (count_from::<S, E>(simd, 0) - columns) * E::narrow(1.0 / width as f64);
    let first = f64::from(tile.left) - anchor.0;
    let right = constant::<S, E>(simd, first + f64::from(tile.width - 1));
    let bottom = constant::<S, E>(simd, f64::from(tile.top + tile.height - 1));
    let last_row = constant::<S, E>(simd, f64::from(band.size.1 - 1) - anchor.1);
    let mut at = 0;
    for top in (0..tile.height as usize).step_by(height) {
        for left in (0..tile.width as usize).step_by(width) {
            // Lanes beyond the edge repeat the pixel on the edge.
            let i = (columns + E::narrow(first + left as f64)).min(right);
            let row = (rows + E::narrow((tile.top as usize + top) as f64)).min(bottom);
            each(at, i, last_row - row);
            at += Lanes::<S, E>::LEN;
        }
    }
}

/// Traces the rays of the tile's pixels from an eye.
#[inline(never)]
pub(crate) fn trace_primary<S: Simd, E: Real, F: Features<E>>(
    simd: S,
    scene: &Prepared<E>,
    (tile, band): (Tile, &Band),
    rays: FromEye<E>,
    candidates: Candidates,
    queue: &mut RayBatch<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let background: [E; 3] = band.background();
            each_packet::<S, E>(
                simd,
                (tile, band),
                rays.anchor(),
                #[inline(always)]
                |at, i, j| {
                    let direction = rays.direction(simd, i, j);
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

/// Makes the rays of the tile's pixels along the axis.
#[inline(never)]
pub(crate) fn aim_along_axis<S: Simd, E: Real>(
    simd: S,
    (tile, band): (Tile, &Band),
    rays: AlongAxis<E>,
    queue: &mut RayBatch<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let one = E::narrow(1.0);
            each_packet::<S, E>(
                simd,
                (tile, band),
                (0.0, 0.0),
                #[inline(always)]
                |at, i, j| {
                    let end = at + Lanes::<S, E>::LEN;
                    rays.origin(simd, i, j).store(&mut queue.origin, at);
                    rays.direction(simd).store(&mut queue.direction, at);
                    Vec3::<S, E>::splat(simd, [one; 3]).store(&mut queue.weight, at);
                    count_from::<S, E>(simd, at).store_slice(&mut queue.pixel.0[at..end]);
                    queue.count = end;
                },
            );
        },
    );
}

/// Traces the rays of a queue. With `EYE` they start at the origin of the coordinates and have a weight of 1.
#[inline(never)]
pub(crate) fn trace_queue<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    candidates: Candidates,
    background: [E; 3],
    queue: &mut RayBatch<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            queue.fill_up(Lanes::<S, E>::LEN);
            for at in (0..queue.count).step_by(Lanes::<S, E>::LEN) {
                let origin = if EYE { Vec3::zero(simd) } else { Vec3::load(simd, &queue.origin, at) };
                let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                let found = nearest::<S, E, F, EYE>(simd, scene, ray, candidates);
                hits.add(
                    simd,
                    at,
                    found,
                    #[inline(always)]
                    || weigh::<S, E, EYE>(simd, background, queue, at),
                );
            }
        },
    );
}

/// Traces the rays of a queue in a scene with glass and few objects, in which the possible hits within objects of glass
/// are known.
#[inline(never)]
pub(crate) fn trace_queue_of_glass<S: Simd, E: Real, F: Features<E>>(
    simd: S,
    scene: &Prepared<E>,
    candidates: Candidates,
    background: [E; 3],
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for at in (0..queue.count).step_by(Lanes::<S, E>::LEN) {
                let origin = Vec3::load(simd, &queue.origin, at);
                let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                let inside = Lanes::<S, E>::from_slice(simd, &queue.inside.0[at..at + Lanes::<S, E>::LEN]);
                let found = nearest_from_inside::<S, E, F>(simd, scene, ray, inside, candidates);
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

/// Intersects the first `count` rays of a queue with the planes and with the bodies of the mask `bits`, nearer than
/// their hits so far. With `EYE` they start at the origin of the coordinates.
#[inline(always)]
pub(crate) fn trace_bodies<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    (bodies, bits): (&Bodies<E>, u64),
    count: usize,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    if bodies.has_planes() {
        trace_some_bodies::<S, E, EYE>(
            simd,
            #[inline(always)]
            |ray, nearest| bodies.meet_planes(simd, ray, nearest),
            count,
            queue,
            hits,
        );
    }
    if let Some(tree) = bodies.tree()
        && bits != 0
    {
        trace_some_bodies::<S, E, EYE>(
            simd,
            #[inline(always)]
            |ray, nearest| bodies.meet_bounded(simd, (tree, bits), ray, nearest),
            count,
            queue,
            hits,
        );
    }
}

/// Intersects the first `count` rays of a queue with the hits that `intersect` offers.
#[inline(never)]
fn trace_some_bodies<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    intersect: impl Fn(Ray<S, E>, &mut Nearest<S, E>),
    count: usize,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            // The packets that have hits, as bits.
            let mut met = [0u64; 8];
            for &(at, _) in &hits.packets {
                met[at / Lanes::<S, E>::LEN / 64] |= 1 << (at / Lanes::<S, E>::LEN % 64);
            }
            hits.packets.clear();
            for at in (0..count).step_by(Lanes::<S, E>::LEN) {
                let end = at + Lanes::<S, E>::LEN;
                let packet = at / Lanes::<S, E>::LEN;
                let mut nearest = if met[packet / 64] >> (packet % 64) & 1 == 0 {
                    Nearest::none(simd)
                } else {
                    Nearest {
                        distance: Lanes::<S, E>::from_slice(simd, &hits.distance.0[at..end]),
                        order: Lanes::<S, E>::from_slice(simd, &hits.order.0[at..end]),
                    }
                };
                let origin = if EYE { Vec3::zero(simd) } else { Vec3::load(simd, &queue.origin, at) };
                let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                intersect(ray, &mut nearest);
                if nearest.hit(simd).any_true() {
                    nearest.distance.store_slice(&mut hits.distance.0[at..end]);
                    nearest.order.store_slice(&mut hits.order.0[at..end]);
                    hits.packets.push((at, u64::MAX));
                }
            }
        },
    );
}
