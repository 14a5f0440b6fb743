//! A tile of the image: rays, what they meet, its light, and what its mirrors see.
//!
//! Bounce by bounce: first the tile's pixels, then the mirrored rays of what was met before, closed up so that packets
//! stay full. All hits of a bounce are found first; the region that they fill then decides which objects can stand in
//! the way of each sun. Each of the steps is one function, compiled with the instruction set's features (`vectorize`) and
//! never inlined: its registers are its own, and it is the same code whatever else a build has. Here it is decided which
//! steps a tile takes, and in which variants ([`fitted!`]).

use std::sync::atomic::AtomicBool;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rayfold_scene::Tone;

use super::band::{Band, Tile, fill, rays_of, write_encoded, write_pixels};
use super::beyond::Beyond;
use super::bodies::ANY;
use super::bounce::{Columns, Hits, Queue, columns};
use super::candidates::{Candidates, Picked};
use super::features::{Anything, BUILT, Kernel, Variant, fitted};
use super::kind::ByKind;
use super::light::{InTheWay, light_up, light_up_beyond};
use super::look::{aim_along_axis, look, look_at_bodies, look_from_eye};
use super::onwards::send_on;
use super::parts;
use super::prepare::Prepared;
use super::rays::Rays;
use super::real::{Lanes, Real};
use super::sampled::light::{SoftLight, light_up_softly};
use super::sky::show_sky;
use super::surfaces::{ambient, reflect, surfaces};
use super::waiting::Waiting;

/// Memory of a worker, used again for each of its tiles; what is in it does not matter.
pub(super) struct Scratch<'a, E> {
    pub(super) queue: Queue<E>,
    pub(super) hits: Hits<E>,
    /// The rays that mirrors send on.
    pub(super) next: Queue<E>,
    /// The rays that mirrors and glass send on, in scenes with glass.
    pub(super) waiting: Waiting<'a, E>,
    /// The sum of what the bounces add to each pixel.
    pixels: Columns<E>,
    pub(super) in_the_way: InTheWay,
    pub(super) sights: Picked,
}

impl<'a, E: Real> Scratch<'a, E> {
    /// Where there is much glass a tile is given up halfway once `cancel` is raised.
    pub(super) fn new(cancel: Option<&'a AtomicBool>) -> Self {
        Self {
            queue: Queue::new(),
            hits: Hits::new(),
            next: Queue::new(),
            waiting: Waiting::new(cancel),
            pixels: columns(),
            in_the_way: InTheWay::default(),
            sights: Picked::default(),
        }
    }
}

/// Draws a tile.
#[inline(always)]
pub(super) fn draw<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    scene: &Prepared<E>,
    tile: Tile,
    scratch: &mut Scratch<E>,
    band: &mut Band,
) {
    if tile.candidates == 0 && scene.shows_nothing(tile.bodies) {
        return fill(tile, band);
    }
    let Scratch { queue, hits, next, waiting, pixels: _, in_the_way, sights } = &mut *scratch;
    let tree = BUILT.tree && scene.tree.is_some();
    let candidates = match &scene.sights {
        Some(all) if BUILT.tree && all.gather(tile.place.0, tile.place.1, sights) => {
            if sights.is_empty() && scene.shows_nothing(tile.bodies) {
                return fill(tile, band);
            }
            Candidates::listed(sights)
        }
        _ if tree => scene.all(),
        _ => Candidates::masked(scene.masks(tile.candidates)),
    };
    let background = band.background();
    next.count = 0;
    hits.packets.clear();
    if scene.has_glass() {
        waiting.begin(tile.bounces);
    }
    let seen = candidates.kinds;
    match scene.rays {
        Rays::Pinhole(rays) => {
            let image = (tile, &*band);
            fitted!(N, seen, tree, C T D => {
                look_from_eye::<S, E, Variant<N::By, C, T, D>>(simd, scene, image, rays, candidates, queue, hits)
            });
            let count = rays_of::<S, E>((tile.width, tile.height));
            let next = Some(&mut *next);
            let bodies = tile.bodies;
            let met = Met { kinds: seen, bodies, background, queue, count, next, waiting, soft: None };
            shade::<S, E, N, true>(simd, scene, met, hits, in_the_way);
        }
        Rays::Parallel(rays) => {
            aim_along_axis::<S, E>(simd, (tile, band), rays, queue);
            fitted!(N, seen, tree, C T D => {
                look::<S, E, Variant<N::By, C, T, D>, false>(simd, scene, candidates, background, queue, hits)
            });
            let count = queue.count;
            let next = Some(&mut *next);
            let bodies = tile.bodies;
            let met = Met { kinds: seen, bodies, background, queue, count, next, waiting, soft: None };
            shade::<S, E, N, false>(simd, scene, met, hits, in_the_way);
        }
    }
    scratch.follow::<S, N>(simd, scene, tile.bounces, None);
    let hits = &scratch.hits;
    match band.tone {
        Tone::Plain => write_pixels::<S, E>(simd, tile, &hits.color, band),
        Tone::Srgb if parts::BUILT.srgb => write_encoded::<S, E>(tile, &hits.color, band),
        Tone::Srgb => unreachable!("such scenes are refused"),
    }
}

impl<E: Real> Scratch<'_, E> {
    /// Follows the rays that mirrors and glass have sent on, and adds what they see to the colours of the hits before.
    #[inline(always)]
    pub(super) fn follow<S: Simd, N: Kernel<E>>(
        &mut self,
        simd: S,
        scene: &Prepared<E>,
        bounces: u32,
        soft: Option<SoftLight<E>>,
    ) {
        if scene.has_glass() {
            return follow_through_glass::<S, E, N>(simd, scene, soft, self);
        }
        let Self { queue, hits, next, waiting, pixels, in_the_way, sights: _ } = self;
        if !BUILT.mirrors || next.count == 0 {
            return;
        }
        let (all, tree) = (scene.all(), BUILT.tree && scene.tree.is_some());
        core::mem::swap(&mut hits.color, pixels);
        let (mut queue, mut next) = (queue, next);
        for bounce in 1..=bounces {
            core::mem::swap(&mut queue, &mut next);
            next.count = 0;
            let after = (bounce < bounces).then_some(&mut *next);
            hits.packets.clear();
            fitted!(N, all.kinds, tree, C T D => {
                look::<S, E, Variant<N::By, C, T, D>, false>(simd, scene, all, scene.background, queue, hits)
            });
            let (kinds, background, count) = (all.kinds, scene.background, queue.count);
            let met = Met { kinds, bodies: ANY, background, queue, count, next: after, waiting, soft };
            shade::<S, E, N, false>(simd, scene, met, hits, in_the_way);
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
}

/// The same in scenes with glass: the rays that wait are traced until none is left.
#[inline(never)]
fn follow_through_glass<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    scene: &Prepared<E>,
    soft: Option<SoftLight<E>>,
    scratch: &mut Scratch<E>,
) {
    let Scratch { queue, hits, waiting, pixels, in_the_way, .. } = scratch;
    let tree = BUILT.tree && scene.tree.is_some();
    core::mem::swap(&mut hits.color, pixels);
    while waiting.take(queue) {
        hits.packets.clear();
        queue.fill_up(Lanes::<S, E>::LEN);
        let (near, bodies) = met_by::<S, E>(simd, scene, queue);
        let (kinds, background, count) = (near.kinds, scene.background, queue.count);
        fitted!(N, kinds, tree, C T D => {
            look::<S, E, Variant<N::By, C, T, D>, false>(simd, scene, near, background, queue, hits)
        });
        let waiting = &mut *waiting;
        let met = Met { kinds, bodies, background, queue, count, next: None, waiting, soft };
        shade_more::<S, E, N, false>(simd, scene, met, hits, in_the_way);
        waiting.add(queue, hits);
    }
    waiting.sum_up(pixels);
    core::mem::swap(&mut hits.color, pixels);
}

/// What the rays of a queue can meet.
#[inline(never)]
fn met_by<S: Simd, E: Real>(simd: S, scene: &Prepared<E>, queue: &Queue<E>) -> (Candidates<'static>, u64) {
    simd.vectorize(
        #[inline(always)]
        || scene.met_by(simd, queue),
    )
}

/// Rays that have met something.
pub(super) struct Met<'a, 'b, E> {
    /// The kinds of what they can have met.
    pub(super) kinds: ByKind<bool>,
    /// Of bodies, which, by bits.
    pub(super) bodies: u64,
    pub(super) background: [E; 3],
    pub(super) queue: &'a Queue<E>,
    /// How many there are.
    pub(super) count: usize,
    /// Where mirrors send them on to, if they do.
    pub(super) next: Option<&'a mut Queue<E>>,
    /// The same in scenes with glass.
    pub(super) waiting: &'a mut Waiting<'b, E>,
    /// Lights of which each ray has a point of its own.
    pub(super) soft: Option<SoftLight<'a, E>>,
}

/// Draws what rays have met: surfaces, their light, and the rays that mirrors send on.
#[inline(always)]
pub(super) fn shade<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    met: Met<E>,
    hits: &mut Hits<E>,
    in_the_way: &mut InTheWay,
) {
    if scene.is_plain() && met.soft.is_none() {
        shade_plain::<S, E, N, EYE>(simd, scene, met, hits, in_the_way);
    } else {
        shade_more::<S, E, N, EYE>(simd, scene, met, hits, in_the_way);
    }
}

/// In scenes that have more than version 1 of the language.
// Out of line, so that tiles of all others are not prepared for it.
#[inline(never)]
fn shade_more<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    met: Met<E>,
    hits: &mut Hits<E>,
    in_the_way: &mut InTheWay,
) {
    let (queue, count) = (met.queue, met.count);
    match (&scene.beyond, met.soft.filter(|_| parts::BUILT.extents)) {
        (beyond, Some(soft)) => {
            let way = (beyond.as_ref(), soft);
            shade_softly::<S, E, N, EYE>(simd, scene, way, met, hits, in_the_way);
        }
        (Some(beyond), None) => shade_beyond::<S, E, N, EYE>(simd, scene, beyond, met, hits, in_the_way),
        (None, None) => {
            settle_shared::<S, E, N, EYE>(simd, scene, queue, hits);
            shade_plain::<S, E, N, EYE>(simd, scene, met, hits, in_the_way);
        }
    }
    if let Some(sky) = scene.sky() {
        show_sky::<S, E, EYE>(simd, sky, count, queue, hits);
    }
}

/// In scenes with more than spheres, boxes, triangles and suns.
#[inline(always)]
fn shade_beyond<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    beyond: &Beyond<E>,
    met: Met<E>,
    hits: &mut Hits<E>,
    in_the_way: &mut InTheWay,
) {
    let queue = met.queue;
    if let Some(bodies) = beyond.bodies() {
        look_at_bodies::<S, E, EYE>(simd, (bodies, met.bodies), met.count, queue, hits);
    }
    if hits.packets.is_empty() {
        return;
    }
    settle_shared::<S, E, N, EYE>(simd, scene, queue, hits);
    surfaces_of_all::<S, E, N, EYE>(simd, scene, met.background, queue, hits);
    let is_painted = paint::<S, E, EYE>(beyond, queue, hits);
    in_the_way.find(simd, scene, hits);
    if beyond.bodies().is_some() {
        in_the_way.find_bodies(simd, scene, hits);
    }
    if beyond.glass().is_some() {
        light_up_beyond::<S, E, Anything<N::By>, EYE, true>(simd, scene, beyond, queue, hits, in_the_way);
    } else {
        light_up_beyond::<S, E, Anything<N::By>, EYE, false>(simd, scene, beyond, queue, hits, in_the_way);
    }
    go_on::<S, E, N, EYE>(simd, scene, is_painted, met, hits);
}

/// Makes of the nearest hits those that count, where objects share surfaces.
#[inline(always)]
fn settle_shared<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    queue: &Queue<E>,
    hits: &mut Hits<E>,
) {
    if let Some(shared) = &scene.shared {
        shared.settle_all::<S, E, Anything<N::By>, EYE>(simd, scene, queue, hits);
    }
}

/// Lets rays that go on start off all that shares the surface of their hit.
#[inline(always)]
fn lift_shared<S: Simd, E: Real>(scene: &Prepared<E>, hits: &mut Hits<E>) {
    if let Some(shared) = &scene.shared {
        shared.lift(hits, Lanes::<S, E>::LEN);
    }
}

/// The surfaces of whatever a scene can have.
#[inline(always)]
fn surfaces_of_all<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    background: [E; 3],
    queue: &Queue<E>,
    hits: &mut Hits<E>,
) {
    if scene.has_glass() {
        surfaces::<S, E, Anything<N::By>, EYE, true, true, true>(simd, scene, background, queue, hits);
    } else {
        surfaces::<S, E, Anything<N::By>, EYE, true, true, false>(simd, scene, background, queue, hits);
    }
    lift_shared::<S, E>(scene, hits);
}

/// In pictures whose lights have an extent.
#[inline(always)]
fn shade_softly<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    (beyond, soft): (Option<&Beyond<E>>, SoftLight<E>),
    met: Met<E>,
    hits: &mut Hits<E>,
    in_the_way: &mut InTheWay,
) {
    let queue = met.queue;
    if let Some(bodies) = beyond.and_then(Beyond::bodies) {
        look_at_bodies::<S, E, EYE>(simd, (bodies, met.bodies), met.count, queue, hits);
    }
    if hits.packets.is_empty() {
        return;
    }
    settle_shared::<S, E, N, EYE>(simd, scene, queue, hits);
    surfaces_of_all::<S, E, N, EYE>(simd, scene, met.background, queue, hits);
    let is_painted = beyond.is_some_and(|beyond| paint::<S, E, EYE>(beyond, queue, hits));
    in_the_way.find(simd, scene, hits);
    if beyond.is_some_and(|beyond| beyond.bodies().is_some()) {
        in_the_way.find_bodies(simd, scene, hits);
    }
    light_up_softly::<S, E, Anything<N::By>, EYE>(simd, scene, soft, queue, hits, in_the_way);
    go_on::<S, E, N, EYE>(simd, scene, is_painted, met, hits);
}

/// Gives hits the coefficients of patterns; whether there are any.
#[inline(always)]
fn paint<S: Simd, E: Real, const EYE: bool>(
    beyond: &Beyond<E>,
    queue: &Queue<E>,
    hits: &mut Hits<E>,
) -> bool {
    let painted = beyond.patterned();
    if let Some(finishes) = painted {
        finishes.paint::<E, EYE>(queue, hits, Lanes::<S, E>::LEN);
    }
    painted.is_some()
}

/// Sends on what mirrors and glass do.
#[inline(always)]
fn go_on<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    is_painted: bool,
    Met { queue, next, waiting, .. }: Met<E>,
    hits: &mut Hits<E>,
) {
    if let Some(glass) = scene.beyond.as_ref().and_then(Beyond::glass) {
        if !waiting.is_at_the_end() {
            let send_on = if is_painted { send_on::<S, E, EYE, true> } else { send_on::<S, E, EYE, false> };
            send_on(simd, scene, glass, queue, hits, waiting);
        }
        return;
    }
    match next {
        Some(next) if is_painted => reflect::<S, E, EYE, true>(simd, scene, queue, hits, next),
        Some(next) => reflect::<S, E, EYE, false>(simd, scene, queue, hits, next),
        None => {}
    }
}

/// In those that have nothing else.
#[inline(always)]
fn shade_plain<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    Met { kinds, background, queue, next, .. }: Met<E>,
    hits: &mut Hits<E>,
    in_the_way: &mut InTheWay,
) {
    if hits.packets.is_empty() {
        return;
    }
    let mirrors = BUILT.mirrors && scene.needs.mirrors;
    if !scene.suns.is_empty() {
        // Whether objects are found down a tree makes no difference to surfaces.
        if mirrors {
            fitted!(N, kinds, C T => {
                surfaces::<S, E, Variant<N::By, C, T, false>, EYE, true, true, false>(simd, scene, background, queue, hits)
            });
        } else {
            fitted!(N, kinds, C T => {
                surfaces::<S, E, Variant<N::By, C, T, false>, EYE, true, false, false>(simd, scene, background, queue, hits)
            });
        }
        lift_shared::<S, E>(scene, hits);
        if BUILT.shadows && scene.needs.shadows {
            let kinds = in_the_way.find(simd, scene, hits);
            let tree = BUILT.tree && scene.tree.is_some();
            fitted!(N, kinds, tree, C T D => {
                light_up::<S, E, Variant<N::By, C, T, D>, true>(simd, scene, hits, in_the_way)
            });
        } else {
            light_up::<S, E, Variant<N::By, false, false, false>, false>(simd, scene, hits, in_the_way);
        }
    } else if mirrors {
        fitted!(N, kinds, C T => {
            surfaces::<S, E, Variant<N::By, C, T, false>, EYE, false, true, false>(simd, scene, background, queue, hits)
        });
        lift_shared::<S, E>(scene, hits);
    } else {
        ambient::<S, E, EYE>(simd, scene, background, queue, hits);
    }
    if mirrors && let Some(next) = next {
        reflect::<S, E, EYE, false>(simd, scene, queue, hits, next);
    }
}
