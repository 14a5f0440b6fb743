//! The light of a tile's hits: which objects can stand in its way, and what it adds.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::features::{BUILT, Features};
use super::generation::Hits;
use super::lists::{Beam, LightBuffer, Picked, Seen};
use super::prepare::{Light, Outlines, Prepared};
use super::real::{Lanes, Real, Vec3, constant};
use super::search::{Candidates, Masks, unshaded};

/// What can stand in the way of each light.
#[derive(Default)]
pub(super) struct Obstacles {
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

impl Obstacles {
    /// Finds what can stand between the hits, of which there is at least one, and each light.
    #[inline(never)]
    pub(super) fn find<S: Simd, E: Real>(&mut self, simd: S, scene: &Prepared<E>, hits: &Hits<E>) {
        self.of.resize_with(scene.lights.len(), InTheWay::default);
        simd.vectorize(
            #[inline(always)]
            || {
                let (low, high) = region(simd, hits);
                for (light, of) in scene.lights.iter().zip(&mut self.of) {
                    let beam = beam(light, low, high);
                    if BUILT.tree && scene.tree.is_some() {
                        let InTheWay { list, is_listed, .. } = of;
                        let gather = |buffer: &LightBuffer| buffer.gather(&beam, &mut self.seen, list);
                        *is_listed = light.buffer.as_ref().is_some_and(gather);
                    } else {
                        of.masks = Masks::split(in_the_way(simd, &light.outlines, beam), scene);
                    }
                }
            },
        );
    }
}

/// Adds the light that reaches the hits, which without `SHADOWS` is all that shines on them.
#[inline(never)]
pub(super) fn light_up<S: Simd, E: Real, F: Features, const SHADOWS: bool>(
    simd: S,
    scene: &Prepared<E>,
    hits: &mut Hits<E>,
    obstacles: &Obstacles,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = constant::<S, E>(simd, 0.0);
            for &(at, others) in &hits.packets {
                let normal = Vec3::load(simd, &hits.normal, at);
                let mut sum = Vec3::zero(simd);
                for (index, light) in scene.lights.iter().enumerate() {
                    let cosine = normal.dot(Vec3::splat(simd, light.axes[2]));
                    let mut lit = cosine.simd_gt(zero);
                    if !lit.any_true() {
                        continue;
                    }
                    if SHADOWS {
                        let obstacles = &obstacles.of[index];
                        let candidates = Candidates {
                            masks: obstacles.masks.and_spheres(others),
                            list: obstacles.is_listed.then_some(&obstacles.list),
                        };
                        let start = Vec3::load(simd, &hits.start, at);
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
            // Of all coordinates: the light's axes are square to each other but for rounding.
            slack += low.widen().abs().max(high.widen().abs());
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
