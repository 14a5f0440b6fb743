//! Packets of rays against all objects of a scene: by masks of candidates, or down a tree.
//!
//! Which candidates are looked at, in which order and in which company changes what is skipped, never what is found.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::doubt::distance_error;
use super::features::Features;
use super::intersect::{
    Moment, Nearest, Ray, Slopes, cuboid_shades, facing, sphere_shades, triangle_shades,
    unshaded_by_triangles,
};
use super::lists::Picked;
use super::prepare::{Kind, Light, Prepared};
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};
use super::tree::{Content, Node, Tree};

/// Objects by bits, a word a kind, each in the order of its array.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Masks {
    spheres: u64,
    cuboids: u64,
    triangles: u64,
}

impl Masks {
    /// Of a word with all: spheres first, then boxes, then triangles.
    #[inline(always)]
    pub(super) fn split<E: Real>(bits: u64, scene: &Prepared<E>) -> Self {
        let (spheres, cuboids) = (scene.spheres.len(), scene.cuboids.len());
        Self {
            spheres: of_kind(bits, 0, spheres),
            cuboids: of_kind(bits, spheres, cuboids),
            triangles: of_kind(bits, spheres + cuboids, scene.triangles.len()),
        }
    }

    /// Without the spheres whose bits are not set.
    #[inline(always)]
    pub(super) fn and_spheres(self, bits: u64) -> Self {
        Self { spheres: self.spheres & bits, ..self }
    }
}

/// The objects to look at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidates<'a> {
    /// In a scene without a tree.
    pub(super) masks: Masks,
    /// In one with a tree: instead of all that is in it.
    pub(super) list: Option<&'a Picked>,
}

impl Candidates<'_> {
    #[inline(always)]
    pub(super) fn all<E: Real>(scene: &Prepared<E>) -> Self {
        Self { masks: Masks::split(u64::MAX, scene), list: None }
    }
}

/// The positions of the bits that are set.
struct Positions(u64);

impl Iterator for Positions {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let position = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(position)
    }
}

/// The bits of a kind whose array begins at `from` and has `count` items, moved to the front.
#[inline(always)]
fn of_kind(bits: u64, from: usize, count: usize) -> u64 {
    if from >= 64 || count == 0 {
        return 0;
    }
    (bits >> from) & (u64::MAX >> 64usize.saturating_sub(count))
}

/// The nearest hits; `EYE` says that the rays start at the origin of the coordinates.
#[inline(always)]
pub(super) fn nearest<S: Simd, E: Real, F: Features, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    ray: Ray<S, E>,
    candidates: Candidates,
) -> Nearest<S, E> {
    if F::TREE
        && let Some(tree) = &scene.tree
    {
        if EYE && let Some(list) = candidates.list {
            return nearest_of_list::<S, E, F>(simd, scene, list, ray.direction);
        }
        return nearest_in_tree::<S, E, F, EYE>(simd, scene, tree, ray);
    }
    let masks = candidates.masks;
    let mut nearest = Nearest::none(simd);
    for at in Positions(masks.spheres) {
        if EYE {
            F::sphere_from_eye(simd, &scene.spheres[at], ray.direction, &mut nearest);
        } else {
            F::sphere(simd, &scene.spheres[at], ray, &mut nearest);
        }
    }
    if F::CUBOIDS && masks.cuboids != 0 {
        let slopes = Slopes::new(simd, ray.direction);
        for at in Positions(masks.cuboids) {
            F::cuboid(simd, &scene.cuboids[at], ray, slopes, &mut nearest);
        }
    }
    if F::TRIANGLES && masks.triangles != 0 {
        let moment = Moment::new(ray);
        for at in Positions(masks.triangles) {
            let (triangle, place) = (&scene.triangles[at], (&scene.corners, at));
            if EYE {
                F::triangle_from_eye(simd, triangle, place, ray.direction, &mut nearest);
            } else {
                F::triangle(simd, triangle, place, ray, moment, &mut nearest);
            }
        }
    }
    nearest
}

/// Which of the points a light does not reach, of those that `lit` names.
#[inline(always)]
pub(super) fn unshaded<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    light: &Light<E>,
    point: Vec3<S, E>,
    mut lit: Mask<S, E>,
    candidates: Candidates,
) -> Mask<S, E> {
    if F::TREE
        && let Some(tree) = &scene.tree
    {
        if let Some(list) = candidates.list {
            return unshaded_by_list::<S, E, F>(simd, scene, list, light, point, lit);
        }
        return unshaded_in_tree::<S, E, F>(simd, scene, tree, light, point, lit);
    }
    let masks = candidates.masks;
    if masks.spheres != 0 {
        let faced = facing(simd, light, point);
        for at in Positions(masks.spheres) {
            lit &= !sphere_shades(simd, &light.spheres[at], faced);
        }
    }
    if F::CUBOIDS {
        for at in Positions(masks.cuboids) {
            lit &= !cuboid_shades(simd, &scene.cuboids[at], light, point);
        }
    }
    if F::TRIANGLES && masks.triangles != 0 {
        let mut shaded = constant::<S, E>(simd, -1.0);
        for at in Positions(masks.triangles) {
            shaded = shaded.max(triangle_shades(simd, &light.shades[at], point));
        }
        let all = Positions(masks.triangles);
        lit = unshaded_by_triangles(simd, scene, light, (point, lit), shaded, all);
    }
    lit
}

/// The nearest hits of rays from the eye.
#[inline(always)]
fn nearest_of_list<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    list: &Picked,
    direction: Vec3<S, E>,
) -> Nearest<S, E> {
    let mut nearest = Nearest::none(simd);
    for &at in &list.spheres {
        F::sphere_from_eye(simd, &scene.spheres[at as usize], direction, &mut nearest);
    }
    if F::CUBOIDS && !list.cuboids.is_empty() {
        let ray = Ray { origin: Vec3::zero(simd), direction };
        let slopes = Slopes::new(simd, direction);
        for &at in &list.cuboids {
            F::cuboid(simd, &scene.cuboids[at as usize], ray, slopes, &mut nearest);
        }
    }
    if F::TRIANGLES {
        for &at in &list.triangles {
            let at = at as usize;
            F::triangle_from_eye(simd, &scene.triangles[at], (&scene.corners, at), direction, &mut nearest);
        }
    }
    nearest
}

#[inline(always)]
fn unshaded_by_list<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    list: &Picked,
    light: &Light<E>,
    point: Vec3<S, E>,
    mut lit: Mask<S, E>,
) -> Mask<S, E> {
    if !list.spheres.is_empty() {
        let faced = facing(simd, light, point);
        for &at in &list.spheres {
            lit &= !sphere_shades(simd, &light.spheres[at as usize], faced);
        }
    }
    if F::CUBOIDS {
        for &at in &list.cuboids {
            lit &= !cuboid_shades(simd, &scene.cuboids[at as usize], light, point);
        }
    }
    if F::TRIANGLES && !list.triangles.is_empty() {
        let mut shaded = constant::<S, E>(simd, -1.0);
        for &at in &list.triangles {
            shaded = shaded.max(triangle_shades(simd, &light.shades[at as usize], point));
        }
        let all = list.triangles.iter().map(|&at| at as usize);
        lit = unshaded_by_triangles(simd, scene, light, (point, lit), shaded, all);
    }
    lit
}

/// Nodes that wait on the way down a tree of 2³⁰ objects, with room for a lopsided one.
const WAITING: usize = 128;

/// Aligned as the widest registers are, so that the compiler aligns the stack, and with it the registers that it keeps
/// there: unaligned, each of them lies in two cache lines.
#[repr(align(64))]
struct Waiting([u32; WAITING]);

/// Visits the leaves whose boxes `meets` some lane, nearer children first by the direction of the first lane.
#[inline(always)]
fn descend<E: Real>(
    tree: &Tree<E>,
    backwards: [bool; 3],
    mut meets: impl FnMut(&Node<E>) -> bool,
    mut visit: impl FnMut(Kind, core::ops::Range<usize>) -> bool,
) {
    let Waiting(waiting) = &mut Waiting([0; WAITING]);
    let mut spilled = Vec::new();
    let mut count = 1;
    loop {
        if count == 0 {
            match spilled.pop() {
                Some(node) => {
                    waiting[0] = node;
                    count = 1;
                }
                None => return,
            }
        }
        count -= 1;
        let node = &tree.nodes[waiting[count] as usize];
        if !meets(node) {
            continue;
        }
        match node.content() {
            Content::Leaf(kind, items) => {
                if !visit(kind, items) {
                    return;
                }
            }
            Content::Children(first, axis) => {
                // The first child is the one that comes first along the axis.
                let far_first = u32::from(backwards[axis]);
                if count + 2 > WAITING {
                    spilled.extend_from_slice(&waiting[..count]);
                    count = 0;
                }
                waiting[count] = first + 1 - far_first;
                waiting[count + 1] = first + far_first;
                count += 2;
            }
        }
    }
}

/// The tree's part of a packet of rays.
#[derive(Clone, Copy)]
pub(super) struct Descent<S: Simd, E: Real> {
    inverse: Vec3<S, E>,
    /// -origin / direction
    shift: Vec3<S, E>,
    backwards: [bool; 3],
}

impl<S: Simd, E: Real> Descent<S, E> {
    #[inline(always)]
    pub(super) fn new(simd: S, origin: Vec3<S, E>, direction: Vec3<S, E>) -> Self {
        let inverse = Slopes::new(simd, direction).inverse;
        let shift = Vec3::zero(simd).sub(origin.mul(inverse));
        let zero = E::narrow(0.0);
        let backwards = [direction.x[0] < zero, direction.y[0] < zero, direction.z[0] < zero];
        Self { inverse, shift, backwards }
    }

    /// Which lanes meet the node's box nearer than `limit`.
    #[inline(always)]
    fn meets(&self, simd: S, node: &Node<E>, limit: Lanes<S, E>) -> Mask<S, E> {
        let (enter, leave) = self.span(simd, node.low, node.high);
        enter.simd_le(leave.min(limit))
    }

    /// Where the rays enter a box and where they leave it, at the latest. A box within another has a span within its
    /// span: rounding keeps order.
    #[inline(always)]
    pub(super) fn span(&self, simd: S, low: [E; 3], high: [E; 3]) -> (Lanes<S, E>, Lanes<S, E>) {
        let (low, high) = (Vec3::splat(simd, low), Vec3::splat(simd, high));
        let (inverse, shift) = (self.inverse, self.shift);
        let (ax, bx) = (low.x.mul_add(inverse.x, shift.x), high.x.mul_add(inverse.x, shift.x));
        let (ay, by) = (low.y.mul_add(inverse.y, shift.y), high.y.mul_add(inverse.y, shift.y));
        let (az, bz) = (low.z.mul_add(inverse.z, shift.z), high.z.mul_add(inverse.z, shift.z));
        let enter = ax.min(bx).max(ay.min(by)).max(az.min(bz)).max(constant::<S, E>(simd, 0.0));
        let leave = ax.max(bx).min(ay.max(by)).min(az.max(bz));
        (enter, leave * constant::<S, E>(simd, 1.0 + 64.0 * E::ROUNDOFF))
    }
}

#[inline(always)]
fn nearest_in_tree<S: Simd, E: Real, F: Features, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    tree: &Tree<E>,
    ray: Ray<S, E>,
) -> Nearest<S, E> {
    let found = core::cell::Cell::new(Nearest::none(simd));
    // Computed distances are no nearer than this to those of boxes beyond them.
    let slack = constant::<S, E>(simd, distance_error::<E>());
    let limit = core::cell::Cell::new(found.get().distance);
    let descent = Descent::new(simd, ray.origin, ray.direction);
    let slopes = Slopes::new(simd, ray.direction);
    let moment = Moment::new(ray);
    descend(
        tree,
        descent.backwards,
        #[inline(always)]
        |node| descent.meets(simd, node, limit.get()).any_true(),
        #[inline(always)]
        |kind, items| {
            let mut nearest = found.get();
            if F::TRIANGLES && kind == Kind::Triangle {
                for (at, of) in items.clone().zip(&scene.triangles[items]) {
                    let place = (&scene.corners, at);
                    if EYE {
                        F::triangle_from_eye(simd, of, place, ray.direction, &mut nearest);
                    } else {
                        F::triangle(simd, of, place, ray, moment, &mut nearest);
                    }
                }
            } else if F::CUBOIDS && kind == Kind::Cuboid {
                for of in &scene.cuboids[items] {
                    F::cuboid(simd, of, ray, slopes, &mut nearest);
                }
            } else {
                for of in &scene.spheres[items] {
                    if EYE {
                        F::sphere_from_eye(simd, of, ray.direction, &mut nearest);
                    } else {
                        F::sphere(simd, of, ray, &mut nearest);
                    }
                }
            }
            found.set(nearest);
            limit.set(nearest.distance.mul_add(slack, nearest.distance + slack));
            true
        },
    );
    found.get()
}

#[inline(always)]
fn unshaded_in_tree<S: Simd, E: Real, F: Features>(
    simd: S,
    scene: &Prepared<E>,
    tree: &Tree<E>,
    light: &Light<E>,
    point: Vec3<S, E>,
    lit: Mask<S, E>,
) -> Mask<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    let far = constant::<S, E>(simd, E::FAR);
    let descent = Descent::new(simd, point, Vec3::splat(simd, light.axes[2]));
    let faced = facing(simd, light, point);
    // Lanes in the dark meet no box: their limit lies behind them.
    let limit = core::cell::Cell::new(lit.select(far, splat::<S, E>(simd, E::narrow(-1.0))));
    descend(
        tree,
        descent.backwards,
        #[inline(always)]
        |node| descent.meets(simd, node, limit.get()).any_true(),
        #[inline(always)]
        |kind, items| {
            let mut lit = limit.get().simd_gt(zero);
            if F::TRIANGLES && kind == Kind::Triangle {
                let mut shaded = constant::<S, E>(simd, -1.0);
                for of in &light.shades[items.clone()] {
                    shaded = shaded.max(triangle_shades(simd, of, point));
                }
                lit = unshaded_by_triangles(simd, scene, light, (point, lit), shaded, items);
            } else if F::CUBOIDS && kind == Kind::Cuboid {
                for of in &scene.cuboids[items] {
                    lit &= !cuboid_shades(simd, of, light, point);
                }
            } else {
                for of in &light.spheres[items] {
                    lit &= !sphere_shades(simd, of, faced);
                }
            }
            limit.set(lit.select(limit.get(), splat::<S, E>(simd, E::narrow(-1.0))));
            lit.any_true()
        },
    );
    limit.get().simd_gt(zero)
}
