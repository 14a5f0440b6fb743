//! The intersection of packets of rays with all objects of a scene: by masks of candidates, by lists, or by a tree.
//!
//! The choice, order and grouping of candidates change the work that is skipped, never the result.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use crate::fast::acceleration::candidates::{CandidateSet, Candidates};
use crate::fast::acceleration::descent::{backwards, descend, nearest_in};
use crate::fast::acceleration::tree::Tree;
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::build::enclosures::Enclosure;
use crate::fast::build::features::Features;
use crate::fast::build::prepare::{Prepared, Sunlight};
use crate::fast::rays::bounds::Crossing;
use crate::fast::rays::kind::Kind;
use crate::fast::rays::packet::{Nearest, Ray};
use crate::fast::shapes::shape::Items;
use crate::fast::shapes::{InLight, RayPrecalculations, SunPrecalculations};

/// Returns the nearest hits. With `EYE` the rays start at the origin of the coordinates.
#[inline(always)]
pub(crate) fn nearest<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    candidates: Candidates,
) -> Nearest<S, E> {
    if F::TREE
        && let Some(tree) = &scene.tree
    {
        return match candidates.list {
            Some(list) => nearest_of::<S, E, F, EYE>(simd, scene, ray, list),
            None => nearest_in_tree::<S, E, F, EYE>(simd, scene, tree, ray),
        };
    }
    nearest_of::<S, E, F, EYE>(simd, scene, ray, candidates.masks)
}

/// Returns the nearest hits. `inside` is what the rays are within ([`RayBatch::inside`]).
#[inline(always)]
pub(crate) fn nearest_from_inside<S: Simd, E: Real, F: Features<E>>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    inside: Lanes<S, E>,
    candidates: Candidates,
) -> Nearest<S, E> {
    let own = inside[0];
    if own > E::narrow(0.0)
        && inside.simd_eq(splat::<S, E>(simd, own)).all_true()
        && let Some(&Enclosure { kind, index, others }) = scene.enclosure(own.to_index() - 1)
        && *F::KINDS.of(kind)
    {
        let mut nearest = Nearest::none(simd);
        let only = (F::one_of_these(kind), index as usize..index as usize + 1);
        scene.shapes.intersect::<S, F::By, false>(simd, only, ray, None, &mut nearest);
        if nearest.hit(simd).all_true() {
            offer_of::<S, E, F, false>(simd, scene, ray, others, &mut nearest);
            return nearest;
        }
    }
    nearest_of::<S, E, F, false>(simd, scene, ray, candidates.masks)
}

#[inline(always)]
fn nearest_of<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    found: impl CandidateSet,
) -> Nearest<S, E> {
    let mut nearest = Nearest::none(simd);
    offer_of::<S, E, F, EYE>(simd, scene, ray, found, &mut nearest);
    nearest
}

/// Offers the hits of the rays with some objects.
#[inline(always)]
fn offer_of<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    found: impl CandidateSet,
    nearest: &mut Nearest<S, E>,
) {
    Kind::each(
        #[inline(always)]
        |kind| {
            let items = found.of(kind);
            if *F::KINDS.of(kind) && !items.is_empty() {
                scene.shapes.intersect::<S, F::By, EYE>(simd, (kind, items), ray, None, nearest);
            }
        },
    );
}

/// Returns the points of `lit` that a sun's light reaches.
#[inline(always)]
pub(crate) fn unoccluded<S: Simd, E: Real, F: Features<E>>(
    simd: S,
    scene: &Prepared<E>,
    light: &Sunlight<E>,
    point: Vec3<S, E>,
    lit: Mask<S, E>,
    candidates: Candidates,
) -> Mask<S, E> {
    let in_light = InLight { shapes: &scene.shapes, sun: &light.sun, obstacles: &light.obstacles };
    if F::TREE
        && let Some(tree) = &scene.tree
    {
        return match candidates.list {
            Some(list) => unoccluded_by::<S, E, F>(simd, in_light, point, lit, list),
            None => unoccluded_in_tree::<S, E, F>(simd, in_light, tree, point, lit),
        };
    }
    unoccluded_by::<S, E, F>(simd, in_light, point, lit, candidates.masks)
}

#[inline(always)]
fn unoccluded_by<S: Simd, E: Real, F: Features<E>>(
    simd: S,
    in_light: InLight<E>,
    point: Vec3<S, E>,
    mut lit: Mask<S, E>,
    found: impl CandidateSet,
) -> Mask<S, E> {
    Kind::each(
        #[inline(always)]
        |kind| {
            let items = found.of(kind);
            if *F::KINDS.of(kind) && !items.is_empty() {
                lit = in_light.unoccluded(simd, (kind, items), point, None, lit);
            }
        },
    );
    lit
}

#[inline(always)]
fn nearest_in_tree<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    tree: &Tree<E>,
    ray: Ray<S, E>,
) -> Nearest<S, E> {
    let aimed = RayPrecalculations::new(simd, ray);
    nearest_in(
        simd,
        tree,
        ray,
        Nearest::none(simd),
        #[inline(always)]
        |kind, items, nearest| {
            let leaf = (F::one_of_these(kind), items);
            scene.shapes.intersect::<S, F::By, EYE>(simd, leaf, ray, Some(aimed), nearest);
        },
    )
}

#[inline(always)]
fn unoccluded_in_tree<S: Simd, E: Real, F: Features<E>>(
    simd: S,
    in_light: InLight<E>,
    tree: &Tree<E>,
    point: Vec3<S, E>,
    lit: Mask<S, E>,
) -> Mask<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    let far = constant::<S, E>(simd, E::FAR);
    let direction = in_light.sun.towards(simd);
    let crossing = Crossing::new(simd, Ray { origin: point, direction });
    let faced = SunPrecalculations::new(simd, in_light.sun, point);
    // Lanes in the dark hit no box, because their limit is negative.
    let limit = core::cell::Cell::new(lit.select(far, splat::<S, E>(simd, E::narrow(-1.0))));
    descend(
        tree,
        backwards(direction),
        #[inline(always)]
        |_, node| crossing.intersects(simd, node.low, node.high, limit.get()).any_true(),
        #[inline(always)]
        |kind, items| {
            let lit = limit.get().simd_gt(zero);
            let leaf = (F::one_of_these(kind), items);
            let lit = in_light.unoccluded(simd, leaf, point, Some(faced), lit);
            limit.set(lit.select(limit.get(), splat::<S, E>(simd, E::narrow(-1.0))));
            lit.any_true()
        },
    );
    limit.get().simd_gt(zero)
}
