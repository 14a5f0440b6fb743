//! A bounding volume hierarchy for scenes of many objects.
//!
//! `obvhs` groups the objects; the bounds are our own, of the kernels' precision and wide enough for every rounding
//! error of [`Tree`]'s tests, so that the tree never hides what testing all objects would hit (Ize, "Robust BVH ray
//! traversal", JCGT 2(2), 2013).

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use super::geometry::Solid;
use super::prepare::{BOUNDS, Entry, Kind};
use super::real::Real;
use crate::parallel::map;

/// Objects of a leaf at most.
const LEAF: u32 = 4;

/// A node's box, and what is in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<E> {
    pub(super) low: [E; 3],
    pub(super) high: [E; 3],
    /// The first child, next to which stands the second, or the first of the leaf's items.
    pub(super) first: u32,
    /// Items of a leaf; 0 for an inner node.
    pub(super) count: u32,
}

#[derive(Debug)]
pub(super) struct Tree<E> {
    /// The root comes first.
    pub(super) nodes: Vec<Node<E>>,
    /// Kind and position in the array of that kind, leaf by leaf.
    pub(super) items: Vec<(Kind, u32)>,
}

/// A tree's shape: for each node its first child or item and its number of items; children come after their parents.
pub(super) struct Branches(Vec<(u32, u32)>);

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// All solids in one leaf.
pub(super) fn stump(solids: &[Solid]) -> Branches {
    Branches(vec![(0, solids.len() as u32)])
}

/// Groups the solids: in the order of the leaves, and their shape. There is at least one.
pub(super) fn plant(solids: &[Solid]) -> (Vec<Solid>, Branches) {
    let bounds = map(solids, |solid| {
        let (min, max) = solid.bounds();
        Bounds(Aabb { min: Vec3A::from(min.as_vec3()), max: Vec3A::from(max.as_vec3()) })
    });
    let params = BvhBuildParams { max_prims_per_leaf: LEAF, ..BvhBuildParams::fast_build() };
    let grown = build_bvh2(&bounds, params, &mut Default::default());
    // Depth first, children side by side and after their parent.
    let mut branches = Vec::with_capacity(grown.nodes.len());
    branches.push((0, 0));
    let mut order = Vec::with_capacity(solids.len());
    let mut pending = vec![(0usize, 0usize)];
    while let Some((node, at)) = pending.pop() {
        let node = &grown.nodes[node];
        let first = node.first_index as usize;
        if node.prim_count == 0 {
            let children = branches.len();
            branches[at] = (children as u32, 0);
            branches.extend([(0, 0); 2]);
            pending.extend([(first + 1, children + 1), (first, children)]);
        } else {
            branches[at] = (order.len() as u32, node.prim_count);
            order.extend_from_slice(&grown.primitive_indices[first..first + node.prim_count as usize]);
        }
    }
    (map(&order, |&item| solids[item as usize]), Branches(branches))
}

impl<E: Real> Tree<E> {
    /// `solids` are in the order of [`plant`].
    pub(super) fn new(branches: &Branches, solids: &[Solid], entries: &[Entry<E>]) -> Self {
        let items = map(solids, |solid| {
            let entry = &entries[solid.order as usize];
            (entry.kind, entry.index)
        });
        let branches = &branches.0;
        let mut bounds = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); branches.len()];
        for (at, &(first, count)) in branches.iter().enumerate().rev() {
            let first = first as usize;
            let within = if count == 0 {
                [bounds[first], bounds[first + 1]].into_iter().fold(bounds[at], join)
            } else {
                solids[first..first + count as usize].iter().map(Solid::bounds).fold(bounds[at], join)
            };
            bounds[at] = within;
        }
        // A ray's origin is rounded relative to the scene's size, which is 1, wherever the node lies.
        let slack = BOUNDS * E::ROUNDOFF;
        let nodes = branches.iter().zip(&bounds).map(|(&(first, count), &(min, max))| Node {
            low: (min - slack).to_array().map(E::narrow),
            high: (max + slack).to_array().map(E::narrow),
            first,
            count,
        });
        Self { nodes: nodes.collect(), items }
    }
}

fn join(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}
