//! Packets of rays against all objects of a scene: by masks of candidates, on lists, or down a tree.
//!
//! Which candidates are looked at, in which order and in which company changes what is skipped, never what is found.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::bounds::Crossing;
use super::candidates::{Candidates, Found};
use super::descent::{backwards, descend};
use super::features::Features;
use super::kind::Kind;
use super::packet::{Nearest, Ray};
use super::prepare::{Prepared, Sunlight};
use super::real::{Mask, Real, Vec3, constant, splat};
use super::rounding::distance_error;
use super::shape::Items;
use super::shapes::{Aimed, Faced, InLight};
use super::tree::Tree;

/// The nearest hits; `EYE` says that the rays start at the origin of the coordinates.
#[inline(always)]
pub(super) fn nearest<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
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

#[inline(always)]
fn nearest_of<S: Simd, E: Real, F: Features<E>, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    found: impl Found,
) -> Nearest<S, E> {
    let mut nearest = Nearest::none(simd);
    Kind::each(
        #[inline(always)]
        |kind| {
            let items = found.of(kind);
            if *F::KINDS.of(kind) && !items.is_empty() {
                scene.shapes.meet::<S, F::By, EYE>(simd, (kind, items), ray, None, &mut nearest);
            }
        },
    );
    nearest
}

/// Which of the points a sun's light reaches, of those that `lit` names.
#[inline(always)]
pub(super) fn unoccluded<S: Simd, E: Real, F: Features<E>>(
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
    found: impl Found,
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
    let found = core::cell::Cell::new(Nearest::none(simd));
    // Computed distances are no nearer than this to those of boxes beyond them.
    let slack = constant::<S, E>(simd, distance_error::<E>());
    let limit = core::cell::Cell::new(found.get().distance);
    let crossing = Crossing::new(simd, ray);
    let aimed = Aimed::new(simd, ray);
    descend(
        tree,
        backwards(ray.direction),
        #[inline(always)]
        |node| crossing.meets(simd, node.low, node.high, limit.get()).any_true(),
        #[inline(always)]
        |kind, items| {
            let mut nearest = found.get();
            let leaf = (F::one_of_these(kind), items);
            scene.shapes.meet::<S, F::By, EYE>(simd, leaf, ray, Some(aimed), &mut nearest);
            found.set(nearest);
            limit.set(nearest.distance.mul_add(slack, nearest.distance + slack));
            true
        },
    );
    found.get()
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
    let faced = Faced::new(simd, in_light.sun, point);
    // Lanes in the dark meet no box: their limit lies behind them.
    let limit = core::cell::Cell::new(lit.select(far, splat::<S, E>(simd, E::narrow(-1.0))));
    descend(
        tree,
        backwards(direction),
        #[inline(always)]
        |node| crossing.meets(simd, node.low, node.high, limit.get()).any_true(),
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
