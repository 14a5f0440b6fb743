//! A tile of the image: rays, their hits, the light at the hits, and the rays that mirrors reflect.
//!
//! A tile is drawn bounce by bounce: first the tile's pixels, then the rays that were reflected at the hits before,
//! compacted so that packets stay full. All hits of a bounce are found first. The region that they fill then decides
//! which objects can occlude each sun.
//!
//! Each step is one function, compiled with the instruction set's features (`vectorize`) and never inlined. So its
//! registers are its own, and its code does not depend on the rest of a build. This file chooses the steps of a tile,
//! and their variants ([`fitted!`]).

use std::sync::atomic::AtomicBool;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rayfold_scene::Tone;

use crate::fast::acceleration::candidates::{Candidates, Picked};
use crate::fast::arithmetic::real::{Lanes, Real};
use crate::fast::bodies::ANY;
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::{Anything, BUILT, Kernel, Variant, fitted};
use crate::fast::build::prepare::Prepared;
use crate::fast::film::band::{Band, Tile, fill, rays_of, write_encoded, write_lit, write_pixels};
use crate::fast::film::cover::{cover_hits, let_through};
use crate::fast::film::trace::{
    aim_along_axis, trace_bodies, trace_primary, trace_queue, trace_queue_of_glass,
};
use crate::fast::film::watch::Watch;
use crate::fast::materials::sky::{show_panorama, show_sky};
use crate::fast::rays::bounce::{Column, Columns, Hits, PIXELS, RayBatch, columns};
use crate::fast::rays::kind::{ByKind, Kind};
use crate::fast::rays::pixels::Rays;
use crate::fast::transport::light::{Occluders, add_all_lights, add_sun_light, show_light};
use crate::fast::transport::paths::{PathNumbers, spawn_paths};
use crate::fast::transport::ray_queue::RayQueues;
use crate::fast::transport::scatter::spawn_rays;
use crate::fast::transport::soft_light::{SoftLight, light_up_softly};
use crate::fast::transport::surfaces::{ambient, reflect, surfaces};
use crate::parts;

/// The buffers of a worker, reused for each of its tiles. Their contents do not carry over.
pub(crate) struct Scratch<'a, E> {
    pub(crate) queue: RayBatch<E>,
    pub(crate) hits: Hits<E>,
    /// The rays that mirrors reflect.
    pub(crate) next: RayBatch<E>,
    /// The rays that mirrors and glass spawn, in scenes with glass.
    pub(crate) waiting: RayQueues<'a, E>,
    /// The sum of the contributions of the bounces to each pixel.
    pixels: Columns<E>,
    /// The cover of each pixel, in scenes without background.
    pub(crate) cover: Column<E>,
    pub(crate) occluders: Occluders,
    pub(crate) sights: Picked,
}

impl<'a, E: Real> Scratch<'a, E> {
    /// Makes the buffers. If there is much glass, a tile stops halfway once `cancel` is set.
    pub(crate) fn new(cancel: Option<&'a AtomicBool>) -> Self {
        Self {
            queue: RayBatch::new(),
            hits: Hits::new(),
            next: RayBatch::new(),
            waiting: RayQueues::new(cancel),
            pixels: columns(),
            cover: Column::new(),
            occluders: Occluders::default(),
            sights: Picked::default(),
        }
    }
}

#[inline(always)]
pub(crate) fn draw<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    scene: &Prepared<E>,
    tile: Tile,
    scratch: &mut Scratch<E>,
    band: &mut Band,
) {
    if tile.candidates == 0 && scene.shows_nothing(tile.bodies) {
        return fill(tile, band);
    }
    let Scratch { queue, hits, next, waiting, pixels: _, cover, occluders, sights } = &mut *scratch;
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
                trace_primary::<S, E, Variant<N::By, C, T, D>>(simd, scene, image, rays, candidates, queue, hits)
            });
            let count = rays_of::<S, E>((tile.width, tile.height));
            let next = Some(&mut *next);
            let bodies = tile.bodies;
            let met = HitBatch {
                kinds: seen,
                bodies,
                background,
                queue,
                count,
                next,
                waiting,
                soft: None,
                is_first: true,
                paths: None,
            };
            shade::<S, E, N, true>(simd, scene, met, hits, occluders);
        }
        Rays::Parallel(rays) => {
            aim_along_axis::<S, E>(simd, (tile, band), rays, queue);
            fitted!(N, seen, tree, C T D => {
                trace_queue::<S, E, Variant<N::By, C, T, D>, false>(simd, scene, candidates, background, queue, hits)
            });
            let count = queue.count;
            let next = Some(&mut *next);
            let bodies = tile.bodies;
            let met = HitBatch {
                kinds: seen,
                bodies,
                background,
                queue,
                count,
                next,
                waiting,
                soft: None,
                is_first: true,
                paths: None,
            };
            shade::<S, E, N, false>(simd, scene, met, hits, occluders);
        }
    }
    if scene.is_clear() {
        cover_hits(hits, rays_of::<S, E>((tile.width, tile.height)), Lanes::<S, E>::LEN, cover);
    }
    scratch.follow::<S, N>(simd, scene, tile.bounces, (None, None), None);
    let hits = &scratch.hits;
    if scene.is_clear() {
        return write_lit::<S, E>(tile, &hits.color, &scratch.cover, band);
    }
    match band.tone {
        Tone::Plain => write_pixels::<S, E>(simd, tile, &hits.color, band),
        Tone::Srgb if parts::BUILT.srgb => write_encoded::<S, E>(tile, &hits.color, band),
        Tone::Srgb => unreachable!("such scenes are refused"),
    }
}

impl<E: Real> Scratch<'_, E> {
    /// Traces the rays that mirrors and glass have spawned, and adds their colours to those of the previous hits. In
    /// scenes without glass it records which rays come near the watched boxes.
    #[inline(always)]
    pub(crate) fn follow<S: Simd, N: Kernel<E>>(
        &mut self,
        simd: S,
        scene: &Prepared<E>,
        bounces: u32,
        (soft, paths): (Option<SoftLight<E>>, Option<PathNumbers>),
        mut watch: Option<(&Watch<E>, &mut [bool; PIXELS])>,
    ) {
        if let Some(numbers) = paths.filter(|_| parts::BUILT.paths) {
            return follow_paths::<S, E, N>(simd, scene, (soft, numbers), self);
        }
        if scene.has_glass() {
            return follow_through_glass::<S, E, N>(simd, scene, soft, self);
        }
        let Self { queue, hits, next, waiting, pixels, occluders, cover: _, sights: _ } = self;
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
                trace_queue::<S, E, Variant<N::By, C, T, D>, false>(simd, scene, all, scene.background, queue, hits)
            });
            let (kinds, background, count) = (all.kinds, scene.background, queue.count);
            let met = HitBatch {
                kinds,
                bodies: ANY,
                background,
                queue,
                count,
                next: after,
                waiting,
                soft,
                is_first: false,
                paths: None,
            };
            shade::<S, E, N, false>(simd, scene, met, hits, occluders);
            if let Some((watch, is_near)) = &mut watch {
                watch.note::<S, false>(simd, queue, hits, is_near);
            }
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

/// Traces the queued rays until none is left, in scenes with glass.
#[inline(never)]
fn follow_through_glass<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    scene: &Prepared<E>,
    soft: Option<SoftLight<E>>,
    scratch: &mut Scratch<E>,
) {
    follow_queued::<S, E, N>(simd, scene, (soft, None), scratch);
}

/// Traces the rays of paths until none is left, in scenes in which light goes round.
#[inline(never)]
fn follow_paths<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    scene: &Prepared<E>,
    (soft, numbers): (Option<SoftLight<E>>, PathNumbers),
    scratch: &mut Scratch<E>,
) {
    follow_queued::<S, E, N>(simd, scene, (soft, Some(numbers)), scratch);
}

/// Traces the queued rays until none is left. If `numbers` are given, these are the rays of paths.
#[inline(always)]
fn follow_queued<S: Simd, E: Real, N: Kernel<E>>(
    simd: S,
    scene: &Prepared<E>,
    (soft, paths): (Option<SoftLight<E>>, Option<PathNumbers>),
    scratch: &mut Scratch<E>,
) {
    let Scratch { queue, hits, waiting, pixels, cover, occluders, .. } = scratch;
    let tree = BUILT.tree && scene.tree.is_some();
    core::mem::swap(&mut hits.color, pixels);
    while if paths.is_some() { waiting.take_paths(queue) } else { waiting.take(queue) } {
        hits.packets.clear();
        queue.fill_up(Lanes::<S, E>::LEN);
        let (near, bodies) = met_by::<S, E>(simd, scene, queue);
        let (kinds, background, count) = (near.kinds, scene.background, queue.count);
        if scene.has_enclosures() && paths.is_none() {
            fitted!(N, kinds, C T => {
                trace_queue_of_glass::<S, E, Variant<N::By, C, T, false>>(simd, scene, near, background, queue, hits)
            });
        } else {
            fitted!(N, kinds, tree, C T D => {
                trace_queue::<S, E, Variant<N::By, C, T, D>, false>(simd, scene, near, background, queue, hits)
            });
        }
        let met = HitBatch {
            kinds,
            bodies,
            background,
            queue,
            count,
            next: None,
            waiting: &mut *waiting,
            soft,
            is_first: false,
            paths,
        };
        shade_more::<S, E, N, false>(simd, scene, met, hits, occluders);
        if scene.is_clear() {
            let_through(waiting, queue, hits, Lanes::<S, E>::LEN);
        }
        waiting.add(queue, hits);
    }
    waiting.sum_up(pixels);
    if scene.is_clear() {
        waiting.uncover(cover, PIXELS);
    }
    core::mem::swap(&mut hits.color, pixels);
}

/// Returns the candidates of the rays of a queue.
#[inline(never)]
fn met_by<S: Simd, E: Real>(simd: S, scene: &Prepared<E>, queue: &RayBatch<E>) -> (Candidates<'static>, u64) {
    simd.vectorize(
        #[inline(always)]
        || scene.met_by(simd, queue),
    )
}

/// The hits of a queue of rays, and the inputs for shading them.
pub(crate) struct HitBatch<'a, 'b, E> {
    /// The kinds that the rays can have hit.
    pub(crate) kinds: ByKind<bool>,
    /// The candidate bodies, as bits.
    pub(crate) bodies: u64,
    pub(crate) background: [E; 3],
    pub(crate) queue: &'a RayBatch<E>,
    /// The number of rays.
    pub(crate) count: usize,
    /// The queue for the rays that mirrors reflect, if any are traced.
    pub(crate) next: Option<&'a mut RayBatch<E>>,
    /// The queues for spawned rays, in scenes with glass.
    pub(crate) waiting: &'a mut RayQueues<'b, E>,
    /// The lights for which each ray samples its own point.
    pub(crate) soft: Option<SoftLight<'a, E>>,
    /// Whether the rays are those of the camera.
    pub(crate) is_first: bool,
    /// The random numbers of paths, if light goes round.
    pub(crate) paths: Option<PathNumbers<'a>>,
}

/// Shades hits: surfaces, their light, and the rays that mirrors spawn.
#[inline(always)]
pub(crate) fn shade<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    met: HitBatch<E>,
    hits: &mut Hits<E>,
    occluders: &mut Occluders,
) {
    if scene.is_plain() && met.soft.is_none() {
        shade_plain::<S, E, N, EYE>(simd, scene, met, hits, occluders);
    } else {
        shade_more::<S, E, N, EYE>(simd, scene, met, hits, occluders);
    }
}

/// Shades hits in scenes that use more than version 1 of the language.
// Out of line, so that tiles of all other scenes set up nothing for it.
#[inline(never)]
fn shade_more<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    met: HitBatch<E>,
    hits: &mut Hits<E>,
    occluders: &mut Occluders,
) {
    let (queue, count, is_first) = (met.queue, met.count, met.is_first);
    match (&scene.beyond, met.soft.filter(|_| parts::BUILT.extents)) {
        (beyond, Some(soft)) => {
            let way = (beyond.as_ref(), soft);
            shade_softly::<S, E, N, EYE>(simd, scene, way, met, hits, occluders);
        }
        (Some(beyond), None) => shade_beyond::<S, E, N, EYE>(simd, scene, beyond, met, hits, occluders),
        (None, None) => {
            settle_shared::<S, E, N, EYE>(simd, scene, queue, hits);
            shade_plain::<S, E, N, EYE>(simd, scene, met, hits, occluders);
        }
    }
    if is_first && scene.is_clear() {
        return;
    }
    if let Some(panorama) = scene.panorama() {
        show_panorama::<E, EYE>(panorama, (count, Lanes::<S, E>::LEN), queue, hits);
    }
    if let Some(sky) = scene.sky() {
        show_sky::<S, E, EYE>(simd, sky, count, queue, hits);
    }
}

/// Shades hits in scenes with more than spheres, boxes, triangles and suns.
#[inline(always)]
fn shade_beyond<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    beyond: &Extensions<E>,
    met: HitBatch<E>,
    hits: &mut Hits<E>,
    occluders: &mut Occluders,
) {
    let queue = met.queue;
    if let Some(bodies) = beyond.bodies() {
        trace_bodies::<S, E, EYE>(simd, (bodies, met.bodies), met.count, queue, hits);
    }
    if hits.packets.is_empty() {
        return;
    }
    settle_shared::<S, E, N, EYE>(simd, scene, queue, hits);
    surfaces_of_all::<S, E, N, EYE>(simd, scene, met.background, queue, hits);
    let is_painted = paint::<S, E, EYE>(beyond, queue, hits);
    shade_faces::<S, E, EYE>(simd, scene, Some(beyond), queue, hits);
    glow::<S, E, EYE>(Some(beyond), queue, hits);
    // Bare glass shows no light.
    let is_lit = beyond.glass().is_none() || beyond.glossy().is_some() || show_light::<S, E>(simd, hits);
    if is_lit {
        occluders.find(simd, scene, hits);
        if beyond.bodies().is_some() {
            occluders.find_bodies(simd, scene, hits);
        }
    }
    if beyond.glass().is_none() {
        add_all_lights::<S, E, Anything<N::By>, EYE, false>(simd, scene, beyond, queue, hits, occluders);
    } else if is_lit {
        add_all_lights::<S, E, Anything<N::By>, EYE, true>(simd, scene, beyond, queue, hits, occluders);
    }
    let is_painted = dim::<S, E, EYE>(scene, is_painted, queue, hits);
    go_on::<S, E, N, EYE>(simd, scene, is_painted, met, hits);
}

/// Replaces the nearest hits by those that win, if objects share surfaces.
#[inline(always)]
fn settle_shared<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    if let Some(shared) = &scene.shared {
        shared.settle_all::<S, E, Anything<N::By>, EYE>(simd, scene, queue, hits);
    }
}

/// Moves the starts of spawned rays off all objects that share the surface of their hit.
#[inline(always)]
fn lift_shared<S: Simd, E: Real>(scene: &Prepared<E>, hits: &mut Hits<E>) {
    if let Some(shared) = &scene.shared {
        shared.lift(hits, Lanes::<S, E>::LEN);
    }
}

/// Computes the surfaces for all features that a scene can have.
#[inline(always)]
fn surfaces_of_all<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    background: [E; 3],
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    let is_shaded = scene.beyond.as_ref().is_some_and(|beyond| beyond.shaded().is_some());
    if scene.has_glass() || is_shaded {
        surfaces::<S, E, Anything<N::By>, EYE, true, true, true>(simd, scene, background, queue, hits);
    } else {
        surfaces::<S, E, Anything<N::By>, EYE, true, true, false>(simd, scene, background, queue, hits);
    }
    lift_shared::<S, E>(scene, hits);
}

/// Shades hits in pictures whose lights have an extent.
#[inline(always)]
fn shade_softly<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    (beyond, soft): (Option<&Extensions<E>>, SoftLight<E>),
    met: HitBatch<E>,
    hits: &mut Hits<E>,
    occluders: &mut Occluders,
) {
    let queue = met.queue;
    if let Some(bodies) = beyond.and_then(Extensions::bodies) {
        trace_bodies::<S, E, EYE>(simd, (bodies, met.bodies), met.count, queue, hits);
    }
    if hits.packets.is_empty() {
        return;
    }
    settle_shared::<S, E, N, EYE>(simd, scene, queue, hits);
    surfaces_of_all::<S, E, N, EYE>(simd, scene, met.background, queue, hits);
    let is_painted = beyond.is_some_and(|beyond| paint::<S, E, EYE>(beyond, queue, hits));
    shade_faces::<S, E, EYE>(simd, scene, beyond, queue, hits);
    glow::<S, E, EYE>(beyond, queue, hits);
    occluders.find(simd, scene, hits);
    if beyond.is_some_and(|beyond| beyond.bodies().is_some()) {
        occluders.find_bodies(simd, scene, hits);
    }
    light_up_softly::<S, E, Anything<N::By>, EYE>(simd, scene, soft, queue, hits, occluders);
    let is_painted = dim::<S, E, EYE>(scene, is_painted, queue, hits);
    go_on::<S, E, N, EYE>(simd, scene, is_painted, met, hits);
}

/// Gives hits the coefficients of patterns. Returns whether there are any patterns.
#[inline(always)]
fn paint<S: Simd, E: Real, const EYE: bool>(
    beyond: &Extensions<E>,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) -> bool {
    let painted = beyond.patterned();
    if let Some(finishes) = painted {
        finishes.paint::<E, EYE>(queue, hits, Lanes::<S, E>::LEN);
    }
    painted.is_some()
}

/// Gives hits the normals and colours of the faces of meshes.
#[inline(always)]
fn shade_faces<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    beyond: Option<&Extensions<E>>,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    match beyond.and_then(Extensions::shaded) {
        Some(faces) => faces.shade::<S, EYE>(
            simd,
            #[inline(always)]
            |order| {
                let entry = &scene.entries[order];
                let is_triangle = !entry.is_body && entry.kind == Kind::Triangle;
                is_triangle.then(|| scene.shapes.triangle(entry.index as usize))
            },
            queue,
            hits,
        ),
        None if parts::BUILT.meshes => hits.forget_faces(),
        None => {}
    }
}

/// Adds the glow of objects to the colours of hits.
#[inline(always)]
fn glow<S: Simd, E: Real, const EYE: bool>(
    beyond: Option<&Extensions<E>>,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) {
    if let Some(finishes) = beyond.and_then(Extensions::glowing) {
        finishes.glow::<E, EYE>(queue, hits, Lanes::<S, E>::LEN);
    }
}

/// Mixes fog into the colours of hits. Returns whether the mirror coefficients are stored with the hits: after patterns
/// (`is_painted`) and in fog.
#[inline(always)]
fn dim<S: Simd, E: Real, const EYE: bool>(
    scene: &Prepared<E>,
    is_painted: bool,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
) -> bool {
    let Some(fog) = scene.fog() else { return is_painted };
    let mirror = |order: usize| scene.entries[order].mirror;
    fog.dim::<E, EYE>(mirror, queue, hits, (Lanes::<S, E>::LEN, is_painted));
    true
}

/// Spawns the rays of mirrors and glass.
#[inline(always)]
fn go_on<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    is_painted: bool,
    HitBatch { queue, next, waiting, paths, .. }: HitBatch<E>,
    hits: &mut Hits<E>,
) {
    if let Some(numbers) = paths
        && let Some(paths) = scene.beyond.as_ref().and_then(Extensions::paths)
    {
        return spawn_paths::<S, E>(simd, (scene, paths), numbers, (queue, hits), is_painted, waiting);
    }
    hits.leave_faces();
    if let Some(glass) = scene.beyond.as_ref().and_then(Extensions::glass) {
        if !waiting.is_last_bounce() {
            let spawn_rays =
                if is_painted { spawn_rays::<S, E, EYE, true> } else { spawn_rays::<S, E, EYE, false> };
            spawn_rays(simd, scene, glass, queue, hits, waiting);
        }
        return;
    }
    match next {
        Some(next) if is_painted => reflect::<S, E, EYE, true>(simd, scene, queue, hits, next),
        Some(next) => reflect::<S, E, EYE, false>(simd, scene, queue, hits, next),
        None => {}
    }
}

/// Shades hits in scenes that use nothing beyond version 1 of the language.
#[inline(always)]
fn shade_plain<S: Simd, E: Real, N: Kernel<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    HitBatch { kinds, background, queue, next, .. }: HitBatch<E>,
    hits: &mut Hits<E>,
    occluders: &mut Occluders,
) {
    if hits.packets.is_empty() {
        return;
    }
    let mirrors = BUILT.mirrors && scene.needs.mirrors;
    if !scene.suns.is_empty() {
        // Surfaces are computed in the same way with and without a tree.
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
            let kinds = occluders.find(simd, scene, hits);
            let tree = BUILT.tree && scene.tree.is_some();
            fitted!(N, kinds, tree, C T D => {
                add_sun_light::<S, E, Variant<N::By, C, T, D>, true>(simd, scene, hits, occluders)
            });
        } else {
            add_sun_light::<S, E, Variant<N::By, false, false, false>, false>(simd, scene, hits, occluders);
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
