//! The light of a tile's hits: which objects can stand in its way, and what it adds.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::bounce::Hits;
use super::candidates::{Candidates, Found, Masks, Picked};
use super::features::{BUILT, Features};
use super::kind::ByKind;
use super::lights::buffer::{LightBuffer, Seen};
use super::prepare::Prepared;
use super::real::{Real, Vec3, constant};
use super::search::unoccluded;

/// What can stand in the way of each sun.
#[derive(Default)]
pub(super) struct InTheWay {
    of: Vec<Obstacles>,
    seen: Seen,
}

#[derive(Default)]
struct Obstacles {
    /// In a scene without a tree.
    masks: Masks,
    /// In one with a tree, if it is not too long.
    list: Picked,
    is_listed: bool,
}

impl InTheWay {
    /// Finds what can stand between the hits, of which there is at least one, and each sun; gives the kinds of it.
    #[inline(never)]
    pub(super) fn find<S: Simd, E: Real>(
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
                        of.masks = scene.masks(light.outlines.in_the_way(simd, beam));
                        kinds = kinds.or(of.masks.kinds());
                    }
                }
            },
        );
        kinds
    }
}

/// Adds the light of the suns that reaches the hits, which without `SHADOWS` is all that shines on them.
#[inline(never)]
pub(super) fn light_up<S: Simd, E: Real, F: Features<E>, const SHADOWS: bool>(
    simd: S,
    scene: &Prepared<E>,
    hits: &mut Hits<E>,
    obstacles: &InTheWay,
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
                        let candidates = Candidates {
                            masks: obstacles.masks.and_spheres(others),
                            list: obstacles.is_listed.then_some(&obstacles.list),
                            kinds: F::KINDS,
                        };
                        let start = Vec3::load(simd, &hits.start, at);
                        lit = unoccluded::<S, E, F>(simd, scene, light, start, lit, candidates);
                    }
                    sum = Vec3::splat(simd, light.sun.color).scale_add(lit.select(cosine, zero), sum);
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
