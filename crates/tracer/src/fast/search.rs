//! Packets of rays against all objects of a scene: by masks of candidates, or down a tree.
//!
//! Which candidates are looked at, in which order and in which company changes what is skipped, never what is found.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::intersect::{
    Moment, Nearest, Ray, Slopes, cuboid, cuboid_shades, facing, sphere, sphere_from_eye, sphere_shades,
    triangle, triangle_from_eye, triangle_shades,
};
use super::prepare::{Item, Kind, Light, Prepared};
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};
use super::tree::{Node, Tree};

/// What a scene has; what it has not is not compiled into the loops that draw it.
pub(super) trait Features: 'static {
    const CUBOIDS: bool;
    const TRIANGLES: bool;
    const MIRRORS: bool;
    const TREE: bool;
}

/// The objects to look at.
#[derive(Clone, Copy, Debug)]
pub(super) enum Candidates<'a> {
    /// By bits: spheres first, then boxes, then triangles, each in the order of its array.
    Masked(u64),
    Listed(&'a [Item]),
    /// All of them, down the tree where there is one.
    All,
}

impl Candidates<'_> {
    /// Whether it is certain that there are none.
    #[inline(always)]
    pub(super) fn are_none(self) -> bool {
        match self {
            Self::Masked(bits) => bits == 0,
            Self::Listed(items) => items.is_empty(),
            Self::All => false,
        }
    }

    #[inline(always)]
    fn bits(self) -> u64 {
        match self {
            Self::Masked(bits) => bits,
            Self::Listed(_) | Self::All => u64::MAX,
        }
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
    (bits >> from) & (u64::MAX >> (64 - count))
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
        if EYE && let Candidates::Listed(items) = candidates {
            return nearest_of_list(simd, scene, items, ray.direction);
        }
        return nearest_in_tree::<S, E, EYE>(simd, scene, tree, ray);
    }
    let candidates = candidates.bits();
    let mut nearest = Nearest::none(simd);
    let (spheres, cuboids, triangles) = (scene.spheres.len(), scene.cuboids.len(), scene.triangles.len());
    for at in Positions(of_kind(candidates, 0, spheres)) {
        if EYE {
            sphere_from_eye(simd, &scene.spheres[at], ray.direction, &mut nearest);
        } else {
            sphere(simd, &scene.spheres[at], ray, &mut nearest);
        }
    }
    if F::CUBOIDS {
        let bits = of_kind(candidates, spheres, cuboids);
        if bits != 0 {
            let slopes = Slopes::new(simd, ray.direction);
            for at in Positions(bits) {
                cuboid(simd, &scene.cuboids[at], ray, slopes, &mut nearest);
            }
        }
    }
    if F::TRIANGLES {
        let bits = of_kind(candidates, spheres + cuboids, triangles);
        if EYE {
            for at in Positions(bits) {
                triangle_from_eye(simd, &scene.triangles[at], ray.direction, &mut nearest);
            }
        } else if bits != 0 {
            let moment = Moment::new(ray);
            for at in Positions(bits) {
                triangle(simd, &scene.triangles[at], ray, moment, &mut nearest);
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
        if let Candidates::Listed(items) = candidates {
            return unshaded_by_list(simd, scene, items, light, point, lit);
        }
        return unshaded_in_tree(simd, scene, tree, light, point, lit);
    }
    let candidates = candidates.bits();
    let (spheres, cuboids, triangles) = (scene.spheres.len(), scene.cuboids.len(), scene.triangles.len());
    let bits = of_kind(candidates, 0, spheres);
    if bits != 0 {
        let faced = facing(simd, light, point);
        for at in Positions(bits) {
            lit &= !sphere_shades(simd, &light.spheres[at], faced);
        }
    }
    if F::CUBOIDS {
        for at in Positions(of_kind(candidates, spheres, cuboids)) {
            lit &= !cuboid_shades(simd, &scene.cuboids[at], light, point);
        }
    }
    if F::TRIANGLES {
        for at in Positions(of_kind(candidates, spheres + cuboids, triangles)) {
            lit &= !triangle_shades(simd, &light.shades[at], point);
        }
    }
    lit
}

/// The nearest hits of rays from the eye.
#[inline(always)]
fn nearest_of_list<S: Simd, E: Real>(
    simd: S,
    scene: &Prepared<E>,
    items: &[Item],
    direction: Vec3<S, E>,
) -> Nearest<S, E> {
    let mut nearest = Nearest::none(simd);
    let ray = Ray { origin: Vec3::zero(simd), direction };
    let slopes = Slopes::new(simd, direction);
    for &(kind, index) in items {
        let index = index as usize;
        match kind {
            Kind::Sphere => sphere_from_eye(simd, &scene.spheres[index], direction, &mut nearest),
            Kind::Cuboid => cuboid(simd, &scene.cuboids[index], ray, slopes, &mut nearest),
            Kind::Triangle => triangle_from_eye(simd, &scene.triangles[index], direction, &mut nearest),
        }
    }
    nearest
}

#[inline(always)]
fn unshaded_by_list<S: Simd, E: Real>(
    simd: S,
    scene: &Prepared<E>,
    items: &[Item],
    light: &Light<E>,
    point: Vec3<S, E>,
    mut lit: Mask<S, E>,
) -> Mask<S, E> {
    let faced = facing(simd, light, point);
    for &(kind, index) in items {
        let index = index as usize;
        lit &= !match kind {
            Kind::Sphere => sphere_shades(simd, &light.spheres[index], faced),
            Kind::Cuboid => cuboid_shades(simd, &scene.cuboids[index], light, point),
            Kind::Triangle => triangle_shades(simd, &light.shades[index], point),
        };
    }
    lit
}

/// Nodes that wait on the way down a tree of 2³⁰ objects, with room for a lopsided one.
const WAITING: usize = 128;

/// Visits the leaves whose boxes `meets` some lane, nearer children first by the direction of the first lane.
#[inline(always)]
fn descend<E: Real>(
    tree: &Tree<E>,
    backwards: [bool; 3],
    mut meets: impl FnMut(&Node<E>) -> bool,
    mut visit: impl FnMut(Kind, usize) -> bool,
) {
    let mut waiting = [0u32; WAITING];
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
        if node.count > 0 {
            for &(kind, index) in &tree.items[node.first as usize..(node.first + node.count) as usize] {
                if !visit(kind, index as usize) {
                    return;
                }
            }
            continue;
        }
        let [first, second] = [node.first, node.first + 1];
        let far_first =
            second_is_nearer(&tree.nodes[first as usize], &tree.nodes[second as usize], backwards);
        let (near, far) = if far_first { (second, first) } else { (first, second) };
        if count + 2 > WAITING {
            spilled.extend_from_slice(&waiting[..count]);
            count = 0;
        }
        waiting[count] = far;
        waiting[count + 1] = near;
        count += 2;
    }
}

/// Along the axis on which the two boxes lie farthest apart.
#[inline(always)]
fn second_is_nearer<E: Real>(first: &Node<E>, second: &Node<E>, backwards: [bool; 3]) -> bool {
    let mut widest = E::narrow(0.0);
    let mut nearer = false;
    for (axis, backwards) in backwards.into_iter().enumerate() {
        let apart = second.low[axis] + second.high[axis] - (first.low[axis] + first.high[axis]);
        let size = if apart < E::narrow(0.0) { E::narrow(0.0) - apart } else { apart };
        if size > widest {
            widest = size;
            nearer = (apart < E::narrow(0.0)) != backwards;
        }
    }
    nearer
}

/// The tree's part of a packet of rays.
#[derive(Clone, Copy)]
struct Descent<S: Simd, E: Real> {
    inverse: Vec3<S, E>,
    /// -origin / direction
    shift: Vec3<S, E>,
    backwards: [bool; 3],
}

impl<S: Simd, E: Real> Descent<S, E> {
    #[inline(always)]
    fn new(simd: S, origin: Vec3<S, E>, direction: Vec3<S, E>) -> Self {
        let inverse = Slopes::new(simd, direction).inverse;
        let shift = Vec3::zero(simd).sub(origin.mul(inverse));
        let zero = E::narrow(0.0);
        let backwards = [direction.x[0] < zero, direction.y[0] < zero, direction.z[0] < zero];
        Self { inverse, shift, backwards }
    }

    /// Which lanes meet the node's box nearer than `limit`.
    #[inline(always)]
    fn meets(&self, simd: S, node: &Node<E>, limit: Lanes<S, E>) -> Mask<S, E> {
        let low = Vec3::splat(simd, node.low);
        let high = Vec3::splat(simd, node.high);
        let (inverse, shift) = (self.inverse, self.shift);
        let (ax, bx) = (low.x.mul_add(inverse.x, shift.x), high.x.mul_add(inverse.x, shift.x));
        let (ay, by) = (low.y.mul_add(inverse.y, shift.y), high.y.mul_add(inverse.y, shift.y));
        let (az, bz) = (low.z.mul_add(inverse.z, shift.z), high.z.mul_add(inverse.z, shift.z));
        let enter = ax.min(bx).max(ay.min(by)).max(az.min(bz)).max(constant::<S, E>(simd, 0.0));
        let leave = ax.max(bx).min(ay.max(by)).min(az.max(bz)).min(limit);
        enter.simd_le(leave * constant::<S, E>(simd, 1.0 + 64.0 * E::ROUNDOFF))
    }
}

#[inline(always)]
fn nearest_in_tree<S: Simd, E: Real, const EYE: bool>(
    simd: S,
    scene: &Prepared<E>,
    tree: &Tree<E>,
    ray: Ray<S, E>,
) -> Nearest<S, E> {
    let found = core::cell::Cell::new(Nearest::none(simd));
    let descent = Descent::new(simd, ray.origin, ray.direction);
    let slopes = Slopes::new(simd, ray.direction);
    let moment = Moment::new(ray);
    descend(
        tree,
        descent.backwards,
        #[inline(always)]
        |node| descent.meets(simd, node, found.get().distance).any_true(),
        #[inline(always)]
        |kind, index| {
            let mut nearest = found.get();
            match kind {
                Kind::Sphere if EYE => {
                    sphere_from_eye(simd, &scene.spheres[index], ray.direction, &mut nearest);
                }
                Kind::Sphere => sphere(simd, &scene.spheres[index], ray, &mut nearest),
                Kind::Cuboid => cuboid(simd, &scene.cuboids[index], ray, slopes, &mut nearest),
                Kind::Triangle if EYE => {
                    triangle_from_eye(simd, &scene.triangles[index], ray.direction, &mut nearest);
                }
                Kind::Triangle => triangle(simd, &scene.triangles[index], ray, moment, &mut nearest),
            }
            found.set(nearest);
            true
        },
    );
    found.get()
}

#[inline(always)]
fn unshaded_in_tree<S: Simd, E: Real>(
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
        |kind, index| {
            let dark = match kind {
                Kind::Sphere => sphere_shades(simd, &light.spheres[index], faced),
                Kind::Cuboid => cuboid_shades(simd, &scene.cuboids[index], light, point),
                Kind::Triangle => triangle_shades(simd, &light.shades[index], point),
            };
            limit.set(dark.select(splat::<S, E>(simd, E::narrow(-1.0)), limit.get()));
            limit.get().simd_gt(zero).any_true()
        },
    );
    limit.get().simd_gt(zero)
}
