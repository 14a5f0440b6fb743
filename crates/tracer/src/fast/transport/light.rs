//! The direct light at a tile's hits: its possible occluders, and its contribution.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::acceleration::candidates::{CandidateSet, Candidates, Masks, Picked};
use crate::fast::acceleration::light_buffer::{LightBuffer, Seen};
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant};
use crate::fast::bodies::ANY;
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::{BUILT, Features};
use crate::fast::build::prepare::Prepared;
use crate::fast::lights::lamp::Rays;
use crate::fast::materials::finish::{Finishes, Gloss, Lit};
use crate::fast::rays::bounce::{Columns, Hits, RayBatch};
use crate::fast::rays::kind::ByKind;
use crate::fast::rays::packet::{Ray, no_lane};
use crate::fast::transport::search::{nearest, unoccluded};
use crate::fast::transport::transmittance::{IncidentLight, Panes, Shadow};

/// The possible occluders of each sun.
#[derive(Default)]
pub(crate) struct Occluders {
    pub(crate) of: Vec<Obstacles>,
    seen: Seen,
}

#[derive(Default)]
pub(crate) struct Obstacles {
    /// The masks, in a scene without a tree.
    masks: Masks,
    /// The list, in a scene with a tree, if it is not too long.
    list: Picked,
    is_listed: bool,
    /// The bodies, as bits, if there are few.
    pub(crate) bodies: u64,
    /// The objects of glass, as bits of the row of all objects and of the bodies, if shadow rays test glass separately.
    pub(crate) through: [u64; 2],
}

impl Obstacles {
    /// Returns the candidates, without the spheres whose bits are not among the `others`.
    #[inline(always)]
    pub(crate) fn candidates(&self, others: u64, kinds: ByKind<bool>) -> Candidates<'_> {
        let list = self.is_listed.then_some(&self.list);
        Candidates { masks: self.masks.and_spheres(others), list, kinds }
    }
}

impl Occluders {
    /// Finds the possible occluders between the hits, of which there is at least one, and each sun. Returns their
    /// kinds.
    #[inline(never)]
    pub(crate) fn find<S: Simd, E: Real>(
        &mut self,
        simd: S,
        scene: &Prepared<E>,
        hits: &Hits<E>,
    ) -> ByKind<bool> {
        self.of.resize_with(scene.suns.len(), Obstacles::default);
        let mut kinds = ByKind::default();
        simd.vectorize(
            #[inline(always)]
            || {
                let (low, high) = region(simd, hits);
                for (light, of) in scene.suns.iter().zip(&mut self.of) {
                    let beam = light.sun.beam(low, high);
                    if BUILT.tree && scene.tree.is_some() {
                        let Obstacles { list, is_listed, .. } = of;
                        let gather = |buffer: &LightBuffer| buffer.gather(&beam, &mut self.seen, list);
                        *is_listed = light.buffer.as_ref().is_some_and(gather);
                        kinds = kinds.or(if *is_listed { list.kinds() } else { scene.needs.kinds });
                    } else {
                        let [first, _] = scene.asked_first();
                        of.masks = scene.masks(light.outlines.occluders(simd, beam) & first);
                        kinds = kinds.or(of.masks.kinds());
                        if scene.glass_apart().is_some() {
                            let (low, high) = widened(low, high);
                            of.through[0] = light.outlines.occluders(simd, light.sun.beam(low, high));
                        }
                    }
                }
            },
        );
        kinds
    }

    /// Finds the bodies that can occlude, after [`Self::find`], in a scene that has bodies.
    #[inline(never)]
    pub(crate) fn find_bodies<S: Simd, E: Real>(&mut self, simd: S, scene: &Prepared<E>, hits: &Hits<E>) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (low, high) = region(simd, hits);
                for (light, of) in scene.suns.iter().zip(&mut self.of) {
                    of.bodies = match &light.bodies {
                        Some(outlines) => {
                            let [_, first] = scene.asked_first();
                            outlines.occluders(simd, light.sun.beam(low, high)) & first
                        }
                        None => ANY,
                    };
                    if let Some(outlines) = &light.bodies
                        && scene.glass_apart().is_some()
                    {
                        let (low, high) = widened(low, high);
                        of.through[1] = outlines.occluders(simd, light.sun.beam(low, high));
                    }
                }
            },
        );
    }
}

/// Adds the light of the suns that reaches the hits. Without `SHADOWS` all of it reaches them.
#[inline(never)]
pub(crate) fn add_sun_light<S: Simd, E: Real, F: Features<E>, const SHADOWS: bool>(
    simd: S,
    scene: &Prepared<E>,
    hits: &mut Hits<E>,
    obstacles: &Occluders,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = constant::<S, E>(simd, 0.0);
            for &(at, others) in &hits.packets {
                let normal = Vec3::load(simd, &hits.normal, at);
                let mut sum = Vec3::zero(simd);
                for (index, light) in scene.suns.iter().enumerate() {
                    let cosine = normal.dot(light.sun.towards(simd));
                    let mut lit = cosine.simd_gt(zero);
                    if !lit.any_true() {
                        continue;
                    }
                    if SHADOWS {
                        let obstacles = &obstacles.of[index];
                        let candidates = obstacles.candidates(others, F::KINDS);
                        let start = Vec3::load(simd, &hits.start, at);
                        lit = unoccluded::<S, E, F>(simd, scene, light, start, lit, candidates);
                    }
                    sum = Vec3::splat(simd, light.sun.color).scale_add(lit.select(cosine, zero), sum);
                }
                let diffuse = Vec3::load(simd, &hits.diffuse, at);
                let color = Vec3::load(simd, &hits.color, at);
                let lit = Vec3::<S, E>::new(
                    diffuse.x.fused_mul_add(sum.x, color.x),
                    diffuse.y.fused_mul_add(sum.y, color.y),
                    diffuse.z.fused_mul_add(sum.z, color.z),
                );
                lit.store(&mut hits.color, at);
            }
        },
    );
}

/// Adds the light of suns and lamps that reaches the hits past objects and bodies; with `GLASS` also the light that
/// passes through glass.
#[inline(never)]
pub(crate) fn add_all_lights<S: Simd, E: Real, F: Features<E>, const EYE: bool, const GLASS: bool>(
    simd: S,
    scene: &Prepared<E>,
    beyond: &Extensions<E>,
    queue: &RayBatch<E>,
    hits: &mut Hits<E>,
    obstacles: &Occluders,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = constant::<S, E>(simd, 0.0);
            let far = constant::<S, E>(simd, E::FAR);
            // Checked once here, not for each packet.
            let (bodies, lamps) = (beyond.bodies(), beyond.lamps());
            let (glossy, glass) = (beyond.glossy(), beyond.glass().filter(|_| GLASS));
            let rough = beyond.rough();
            let is_apart = GLASS && scene.glass_apart().is_some();
            // What shadow rays to lamps ask for first.
            let (to_lamps, bodies_to_lamps) = match scene.asked_first() {
                [shapes, bodies] if is_apart => (Candidates::masked(scene.masks(shapes)), bodies),
                _ => (scene.all(), ANY),
            };
            for &(at, others) in &hits.packets {
                if GLASS && glossy.is_none() && !scatters(simd, hits, at).any_true() {
                    continue;
                }
                let normal = Vec3::load(simd, &hits.normal, at);
                let start = Vec3::load(simd, &hits.start, at);
                let orders = &hits.order.0[at..at + Lanes::<S, E>::LEN];
                let seen = Ray { origin: start, direction: Vec3::load(simd, &queue.direction, at) };
                let mut gloss = glossy.map(Finishes::gloss);
                let mut sum = Vec3::zero(simd);
                for (light, obstacles) in scene.suns.iter().zip(&obstacles.of) {
                    let towards = light.sun.towards(simd);
                    let cosine = normal.dot(towards);
                    let mut facing = cosine.simd_gt(zero);
                    let mut shines = facing;
                    if glass.is_some() {
                        let scatters;
                        (scatters, shines) = shows(simd, hits, at, glossy, (normal, towards, seen.direction));
                        facing &= scatters | shines;
                    }
                    let mut lit = facing;
                    if GLASS && !is_apart {
                        // Glass is around a ray that comes from within it.
                        lit &= !hits.are_within(simd, at);
                    }
                    let start = hits.shadow_start(simd, at, towards);
                    if lit.any_true() {
                        let candidates = obstacles.candidates(others, F::KINDS);
                        lit = unoccluded::<S, E, F>(simd, scene, light, start, lit, candidates);
                    }
                    let ray = Ray { origin: start, direction: towards };
                    if let Some(bodies) = bodies
                        && lit.any_true()
                    {
                        lit = bodies.unoccluded(simd, obstacles.bodies, ray, far, lit);
                    }
                    let mut color = Vec3::splat(simd, light.sun.color);
                    if let Some(glass) = glass {
                        let glass = (scene, beyond, glass);
                        let panes = Panes::new(scene, obstacles.through);
                        let arriving = IncidentLight { color, lit };
                        let shadow = Shadow { ray, far };
                        let through = arriving.past_glass::<F>(simd, glass, (facing, panes), shadow);
                        (color, lit) = (through.color, through.lit);
                    }
                    sum = color.scale_add(lit.select(cosine, zero), sum);
                    if let Some(gloss) = &mut gloss {
                        let lit = Lit { lanes: lit & shines, towards, color };
                        gloss.add(lit, (seen, normal), orders);
                        if let Some(paths) = rough {
                            gloss.add_rough(paths, lit, (seen, normal), (orders, &hits.mirror, at));
                        }
                    }
                }
                for lamp in lamps {
                    let Rays { ray, far, part } = lamp.rays(simd, hits.places(simd, at));
                    let (towards, cosine) = (ray.direction, normal.dot(ray.direction));
                    let (ray, far) = match hits.place[0].is_empty() {
                        true => (ray, far),
                        false => {
                            let start = hits.shadow_start(simd, at, towards);
                            let Rays { ray, far, .. } = lamp.rays(simd, start);
                            (ray, far)
                        }
                    };
                    let mut facing = cosine.simd_gt(zero);
                    let mut shines = facing;
                    if glass.is_some() {
                        let scatters;
                        (scatters, shines) = shows(simd, hits, at, glossy, (normal, towards, seen.direction));
                        facing &= scatters | shines;
                    }
                    let mut lit = facing;
                    if let Some(bodies) = bodies
                        && lit.any_true()
                    {
                        lit = bodies.unoccluded(simd, bodies_to_lamps, ray, far, lit);
                    }
                    if lit.any_true() {
                        let met = nearest::<S, E, F, false>(simd, scene, ray, to_lamps);
                        lit &= !met.distance.simd_lt(far);
                    }
                    let mut color = Vec3::splat(simd, lamp.color);
                    if let Some(glass) = glass {
                        let glass = (scene, beyond, glass);
                        let panes = Panes::new(scene, [u64::MAX; 2]);
                        let arriving = IncidentLight { color, lit };
                        let shadow = Shadow { ray, far };
                        let through = arriving.past_glass::<F>(simd, glass, (facing, panes), shadow);
                        (color, lit) = (through.color, through.lit);
                    }
                    sum = color.scale_add(lit.select(cosine * part, zero), sum);
                    if let Some(gloss) = &mut gloss {
                        let lit = Lit { lanes: lit & shines, towards, color: color.scale(part) };
                        gloss.add(lit, (seen, normal), orders);
                        if let Some(paths) = rough {
                            gloss.add_rough(paths, lit, (seen, normal), (orders, &hits.mirror, at));
                        }
                    }
                }
                let colors = (&hits.diffuse, &mut hits.color);
                add_light::<S, E, EYE>(simd, queue, at, colors, (sum, gloss, rough.is_some()));
            }
        },
    );
}

/// Returns the hits of a packet that scatter light, and those that may show a highlight of what reaches them from a direction. Most
/// glass does neither and needs no shadow rays.
#[inline(always)]
pub(crate) fn shows<S: Simd, E: Real>(
    simd: S,
    hits: &Hits<E>,
    at: usize,
    glossy: Option<&Finishes>,
    (normal, towards, direction): (Vec3<S, E>, Vec3<S, E>, Vec3<S, E>),
) -> (Mask<S, E>, Mask<S, E>) {
    let shines = match glossy {
        Some(finishes) => {
            let orders = &hits.order.0[at..at + Lanes::<S, E>::LEN];
            finishes.shines(simd, orders, normal, (towards, direction))
        }
        None => no_lane::<S, E>(simd),
    };
    (scatters(simd, hits, at), shines)
}

/// Returns whether any hit scatters light.
#[inline(never)]
pub(crate) fn show_light<S: Simd, E: Real>(simd: S, hits: &Hits<E>) -> bool {
    simd.vectorize(
        #[inline(always)]
        || {
            for &(at, _) in &hits.packets {
                if scatters(simd, hits, at).any_true() {
                    return true;
                }
            }
            false
        },
    )
}

/// Returns the hits of a packet that scatter light.
#[inline(always)]
fn scatters<S: Simd, E: Real>(simd: S, hits: &Hits<E>, at: usize) -> Mask<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    let diffuse = Vec3::<S, E>::load(simd, &hits.diffuse, at);
    diffuse.x.simd_ne(zero) | diffuse.y.simd_ne(zero) | diffuse.z.simd_ne(zero)
}

/// Adds the `sum` of the lights that reach a packet's hits, and their highlights, to the colours of the hits.
#[inline(always)]
pub(crate) fn add_light<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    queue: &RayBatch<E>,
    at: usize,
    (diffuse, colors): (&Columns<E>, &mut Columns<E>),
    (sum, gloss, is_rough): (Vec3<S, E>, Option<Gloss>, bool),
) {
    let diffuse = Vec3::load(simd, diffuse, at);
    let color = Vec3::load(simd, colors, at);
    let lit = Vec3::<S, E>::new(
        diffuse.x.fused_mul_add(sum.x, color.x),
        diffuse.y.fused_mul_add(sum.y, color.y),
        diffuse.z.fused_mul_add(sum.z, color.z),
    );
    let lit = match gloss {
        Some(gloss) if gloss.is_seen => {
            let one = constant::<S, E>(simd, 1.0);
            let sum = gloss.sum::<S, E>(simd);
            let lit = if is_rough { gloss.sum_of_mirrors::<S, E>(simd).scale_add(one, lit) } else { lit };
            if EYE {
                sum.scale_add(one, lit)
            } else {
                sum.mul(Vec3::load(simd, &queue.weight, at)).scale_add(one, lit)
            }
        }
        Some(_) | None => lit,
    };
    lit.store(colors, at);
}

/// The distance by which shadow rays may move aside on their way through glass, in roundoffs of 1 and of their coordinates: at each
/// surface twice the offset of a start, which is at most 256 roundoffs of them; there are at most 512 surfaces.
const MOVED: f64 = 16_777_216.0;

/// Returns a box of starts with room for where rays start again behind glass.
#[inline(always)]
pub(crate) fn widened<E: Real>(low: [E; 3], high: [E; 3]) -> ([E; 3], [E; 3]) {
    let largest = low.iter().chain(&high).fold(1.0, |largest: f64, x| largest.max(x.widen().abs()));
    let room = MOVED * E::ROUNDOFF * largest;
    (low.map(|x| E::narrow(x.widen() - room)), high.map(|x| E::narrow(x.widen() + room)))
}

/// Returns the bounding box of the hits that need light. There is at least one.
#[inline(always)]
pub(crate) fn region<S: Simd, E: Real>(simd: S, hits: &Hits<E>) -> ([E; 3], [E; 3]) {
    let far = constant::<S, E>(simd, E::FAR);
    let near = constant::<S, E>(simd, -E::FAR);
    let mut low = Vec3::<S, E>::new(far, far, far);
    let mut high = Vec3::<S, E>::new(near, near, near);
    for &(at, _) in &hits.packets {
        let Vec3 { x, y, z } = Vec3::<S, E>::load(simd, &hits.start, at);
        low = Vec3::<S, E>::new(low.x.min(x), low.y.min(y), low.z.min(z));
        high = Vec3::<S, E>::new(high.x.max(x), high.y.max(y), high.z.max(z));
        if !hits.under[0].is_empty() {
            let minus = constant::<S, E>(simd, -1.0);
            let under = Vec3::<S, E>::load(simd, &hits.under, at).scale(minus);
            let Vec3 { x, y, z } = Vec3::<S, E>::load(simd, &hits.start, at).sub(under);
            low = Vec3::<S, E>::new(low.x.min(x), low.y.min(y), low.z.min(z));
            high = Vec3::<S, E>::new(high.x.max(x), high.y.max(y), high.z.max(z));
        }
    }
    (
        [low.x.reduce_min(), low.y.reduce_min(), low.z.reduce_min()],
        [high.x.reduce_max(), high.y.reduce_max(), high.z.reduce_max()],
    )
}
