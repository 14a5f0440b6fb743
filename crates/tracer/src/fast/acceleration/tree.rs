//! A bounding volume hierarchy for scenes of many objects.
//!
//! `obvhs` groups the objects, and their overlap [clusters](crate::fast::acceleration::overlap). Very many objects
//! without such clusters, and the triangles of a large model, are [split by planes](crate::fast::acceleration::binned),
//! which is faster. The bounding boxes are computed here, in the kernels' precision and wide enough for every rounding
//! error of their tests ([`padded`]). So the tree never hides an object that a test of all objects would hit.

use std::cmp::Ordering;
use std::ops::Range;

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;

use crate::fast::acceleration::binned::{Grown, Item as Boxed, Twig};
use crate::fast::acceleration::candidates::MASKED;
use crate::fast::acceleration::overlap::OverlapClusters;
use crate::fast::arithmetic::real::Real;
use crate::fast::rays::bounds::{Bounds, NOTHING, join, padded};
use crate::fast::rays::kind::Kind;
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::shapes::{Neighbours, Solid};
use crate::parallel::map;

/// The largest number of objects in a leaf.
const LEAF: u32 = 4;

/// The number of objects from which they are split by planes.
pub(crate) const VERY_MANY: usize = 4096;

/// A node: its bounding box and its contents.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node<E> {
    pub(crate) low: [E; 3],
    pub(crate) high: [E; 3],
    /// The first child, followed by the second, or the index of the leaf's first object in the array of its kind.
    first: u32,
    /// The number of a leaf's objects, above [`Kind::BITS`] bits with the number of their kind. For an inner node:
    /// zero, above the axis along which the first child comes first.
    content: u32,
}

/// The contents of a node.
pub(crate) enum Content {
    /// Objects of a kind, by their indices in its array.
    Leaf(Kind, Range<usize>),
    /// The first child, followed by the second, and the axis along which it comes first.
    Children(u32, usize),
}

impl<E> Node<E> {
    #[inline(always)]
    pub(crate) fn content(&self) -> Content {
        let first = self.first as usize;
        let (count, low) = (self.content >> Kind::BITS, self.content & ((1 << Kind::BITS) - 1));
        if count == 0 {
            return Content::Children(self.first, low as usize);
        }
        Content::Leaf(Kind::numbered(low), first..first + count as usize)
    }
}

#[derive(Debug)]
pub(crate) struct Tree<E> {
    /// The nodes, the root first.
    pub(crate) nodes: Vec<Node<E>>,
}

/// The topology of a tree. Children come after their parents.
#[derive(Clone, Debug)]
pub(crate) struct Branches(Vec<Branch>);

/// A node before it is rounded.
#[derive(Clone, Copy, Debug)]
struct Branch {
    /// The first child, followed by the second, or the first solid.
    first: u32,
    /// The number of solids, which are of one kind; 0 for a node with children.
    count: u32,
    /// The bounding box of its contents.
    bounds: Bounds,
}

/// The contents of a branch.
pub(crate) enum Part {
    Solids(Range<usize>),
    Children(usize, usize),
}

impl Branches {
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn part(&self, at: usize) -> Part {
        let Branch { first, count, .. } = self.0[at];
        let first = first as usize;
        if count == 0 {
            Part::Children(first, first + 1)
        } else {
            Part::Solids(first..first + count as usize)
        }
    }

    pub(crate) fn bounds(&self, at: usize) -> Bounds {
        self.0[at].bounds
    }
}

struct Item(Aabb);

impl Boundable for Item {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// The treatment of solids in a cluster that are equal to one before them in the script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Copies {
    Kept,
    /// The copies are dropped, because the first hides them.
    Dropped,
}

/// An object that a tree can group.
pub(crate) trait Grouped: Copy + Send + Sync {
    fn bounds(&self) -> Bounds;

    /// Returns the number of its kind. All solids of a leaf have the same number.
    fn number(&self) -> u32;

    /// Returns its position in the script.
    fn order(&self) -> u32;

    /// Compares it with another of its kind, in an order in which only identical ones are equal.
    fn compare(&self, other: &Self) -> Ordering;
}

impl Grouped for Solid {
    fn bounds(&self) -> Bounds {
        self.shape.bounds()
    }

    fn number(&self) -> u32 {
        self.shape.kind().number()
    }

    fn order(&self) -> u32 {
        self.order
    }

    fn compare(&self, other: &Self) -> Ordering {
        let pairs = self.shape.numbers().into_iter().zip(other.shape.numbers());
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    }
}

/// Sorts solids into the order of a tree's leaves and returns the tree's topology, if there are more than a mask has
/// bits or `tree` asks for it.
pub(crate) fn group<T: Grouped>(solids: &mut Vec<T>, tree: Option<bool>, copies: Copies) -> Option<Branches> {
    let is_needed = solids.len() > MASKED || tree == Some(true) && !solids.is_empty();
    is_needed.then(|| plant(solids, copies))
}

/// Returns the solids with one leaf per kind.
pub(crate) fn stump(solids: &[Solid]) -> (Vec<Solid>, Branches) {
    let mut solids = solids.to_vec();
    solids.sort_by_key(|solid| solid.number());
    let mut branches = vec![Branch::EMPTY];
    leaf(&mut branches, 0, &solids, 0);
    let branches = Branches::bounded(branches, &solids);
    (solids, branches)
}

fn plant<T: Grouped>(solids: &mut Vec<T>, copies: Copies) -> Branches {
    let boxes = map(solids, |solid| {
        let (min, max) = solid.bounds();
        Aabb { min: Vec3A::from(min.as_vec3()), max: Vec3A::from(max.as_vec3()) }
    });
    let clusters = Clusters::new(solids, &boxes, copies);
    if matches!(clusters, Clusters::Single(VERY_MANY..)) && are_of_one_kind(solids) {
        return plant_many(solids, &boxes);
    }
    let items: Vec<Item> = (0..clusters.len()).map(|at| Item(clusters.bounds(&boxes, at))).collect();
    let grown = grown(&items);
    // Depth first, children next to each other and after their parent.
    let mut branches = Vec::with_capacity(grown.nodes.len());
    branches.push(Branch::EMPTY);
    let mut order: Vec<T> = Vec::with_capacity(solids.len());
    let mut pending = vec![(0usize, 0usize)];
    while let Some((node, at)) = pending.pop() {
        let node = &grown.nodes[node];
        let first = node.first_index as usize;
        if node.prim_count == 0 {
            let children = branches.len();
            branches[at].first = children as u32;
            branches.extend([Branch::EMPTY; 2]);
            pending.extend([(first + 1, children + 1), (first, children)]);
        } else {
            let from = order.len();
            let items = &grown.primitive_indices[first..first + node.prim_count as usize];
            items.iter().for_each(|&item| clusters.add(solids, item as usize, &mut order));
            halve(&mut branches, at, &mut order[from..], from);
        }
    }
    *solids = order;
    Branches::bounded(branches, solids)
}

/// Groups items. `obvhs` has a function of these steps, but it also reads a clock, and a browser's module has none.
fn grown(items: &[Item]) -> Bvh2 {
    let params = BvhBuildParams::fast_build();
    let indices = (0..items.len() as u32).collect();
    let mut grown = PlocBuilder::with_capacity(items.len()).build(
        params.ploc_search_distance,
        items,
        indices,
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut grown, params.reinsertion_batch_ratio, None);
    collapse(&mut grown, LEAF, params.collapse_traversal_cost);
    grown
}

fn are_of_one_kind<T: Grouped>(solids: &[T]) -> bool {
    solids.iter().all(|solid| solid.number() == solids[0].number())
}

/// Sorts very many solids of one kind into the order of a tree's leaves, and returns its topology.
fn plant_many<T: Grouped>(solids: &mut Vec<T>, boxes: &[Aabb]) -> Branches {
    let Grown { nodes, order } = Grown::new(boxes, LEAF as usize);
    *solids = map(&order, |&at| solids[at as usize]);
    let branch = |&Twig { first, count }: &Twig| Branch { first, count, ..Branch::EMPTY };
    Branches::bounded(map(&nodes, branch), solids)
}

/// The items that a tree is built of: single solids, and clusters.
enum Clusters {
    Single(usize),
    Crowded {
        /// The indices of the solids.
        order: Vec<u32>,
        /// The start of each cluster, and the end of the last.
        starts: Vec<usize>,
    },
}

impl Clusters {
    fn new<T: Grouped>(solids: &[T], boxes: &[Aabb], copies: Copies) -> Self {
        let Some(crowds) = OverlapClusters::find(boxes) else { return Self::Single(solids.len()) };
        let mut starts = Vec::new();
        let mut order = Vec::with_capacity(solids.len());
        let mut done = 0;
        let single = |to: usize, done: &mut usize, order: &mut Vec<u32>, starts: &mut Vec<usize>| {
            while *done < to {
                starts.push(order.len());
                order.push(crowds.order[*done]);
                *done += 1;
            }
        };
        for crowd in &crowds.ranges {
            single(crowd.start, &mut done, &mut order, &mut starts);
            starts.push(order.len());
            let crowded = &crowds.order[crowd.clone()];
            match copies {
                Copies::Kept => order.extend(crowded),
                Copies::Dropped => order.extend(without_copies(solids, crowded)),
            }
            done = crowd.end;
        }
        single(crowds.order.len(), &mut done, &mut order, &mut starts);
        starts.push(order.len());
        Self::Crowded { order, starts }
    }

    fn len(&self) -> usize {
        match self {
            Self::Single(count) => *count,
            Self::Crowded { starts, .. } => starts.len() - 1,
        }
    }

    fn bounds(&self, boxes: &[Aabb], at: usize) -> Aabb {
        match self {
            Self::Single(_) => boxes[at],
            Self::Crowded { order, starts } => order[starts[at]..starts[at + 1]]
                .iter()
                .fold(Aabb::empty(), |whole, &solid| whole.union(&boxes[solid as usize])),
        }
    }

    /// Adds the solids of one item.
    fn add<T: Grouped>(&self, solids: &[T], at: usize, to: &mut Vec<T>) {
        match self {
            Self::Single(_) => to.push(solids[at]),
            Self::Crowded { order, starts } => {
                to.extend(order[starts[at]..starts[at + 1]].iter().map(|&solid| solids[solid as usize]));
            }
        }
    }
}

/// Returns the solids of a cluster that are not equal to one before them in the script.
fn without_copies<T: Grouped>(solids: &[T], crowd: &[u32]) -> Vec<u32> {
    let solid = |at: u32| &solids[at as usize];
    let compare = |a: u32, b: u32| {
        let (a, b) = (solid(a), solid(b));
        a.number().cmp(&b.number()).then_with(|| a.compare(b))
    };
    let mut sorted: Vec<usize> = (0..crowd.len()).collect();
    sorted.sort_by(|&a, &b| {
        let order = || solid(crowd[a]).order().cmp(&solid(crowd[b]).order());
        compare(crowd[a], crowd[b]).then_with(order)
    });
    let mut firsts: Vec<usize> =
        sorted.chunk_by(|&a, &b| compare(crowd[a], crowd[b]).is_eq()).map(|same| same[0]).collect();
    firsts.sort_unstable();
    firsts.into_iter().map(|at| crowd[at]).collect()
}

/// Makes leaves of solids. Halves them as long as they are more than a leaf holds.
fn halve<T: Grouped>(branches: &mut Vec<Branch>, at: usize, solids: &mut [T], from: usize) {
    if solids.len() <= LEAF as usize {
        solids.sort_by_key(Grouped::number);
        return leaf(branches, at, solids, from);
    }
    let children = branches.len();
    branches[at].first = children as u32;
    branches.extend([Branch::EMPTY; 2]);
    let middle = solids.len() / 2;
    let (first, second) = solids.split_at_mut(middle);
    halve(branches, children, first, from);
    halve(branches, children + 1, second, from + middle);
}

impl Branch {
    const EMPTY: Self = Self { first: 0, count: 0, bounds: NOTHING };
}

impl Branches {
    /// Computes the bounding boxes of the branches.
    fn bounded<T: Grouped>(mut branches: Vec<Branch>, solids: &[T]) -> Self {
        let of_leaf = |branch: &mut Branch| {
            let first = branch.first as usize;
            let solids = &solids[first..first + branch.count as usize];
            branch.bounds = solids.iter().map(Grouped::bounds).fold(branch.bounds, join);
        };
        if branches.len() < VERY_MANY {
            branches.iter_mut().filter(|branch| branch.count > 0).for_each(of_leaf);
        } else {
            branches.par_iter_mut().filter(|branch| branch.count > 0).for_each(of_leaf);
        }
        for at in (0..branches.len()).rev() {
            let Branch { first, count, bounds } = branches[at];
            let first = first as usize;
            if count == 0 {
                let children = [branches[first].bounds, branches[first + 1].bounds];
                branches[at].bounds = children.into_iter().fold(bounds, join);
            }
        }
        Self(branches)
    }
}

/// Makes a leaf of solids that are sorted by kind, and several if they are of several kinds. `from` is the index of the
/// first.
fn leaf<T: Grouped>(branches: &mut Vec<Branch>, at: usize, solids: &[T], from: usize) {
    let number = solids[0].number();
    let alike = solids.partition_point(|solid| solid.number() == number);
    if alike == solids.len() {
        branches[at] = Branch { first: from as u32, count: alike as u32, ..Branch::EMPTY };
        return;
    }
    let children = branches.len();
    branches[at].first = children as u32;
    let these = Branch { first: from as u32, count: alike as u32, ..Branch::EMPTY };
    branches.extend([these, Branch::EMPTY]);
    leaf(branches, children + 1, &solids[alike..], from + alike);
}

impl<E: Real> Tree<E> {
    /// Makes a tree. `solids` are in the order of [`group`]; `index` maps the index of each in that order to its index
    /// in the array of its kind.
    pub(crate) fn new<T: Grouped>(
        branches: &Branches,
        solids: &[T],
        index: impl Fn(usize) -> u32 + Send + Sync,
    ) -> Self {
        let branches = &branches.0;
        // Children are swapped so that the first comes first along the axis on which their centres are farthest apart.
        let mut place: Vec<u32> = (0..branches.len() as u32).collect();
        let mut axes = vec![0; branches.len()];
        for (at, &Branch { first, count, .. }) in branches.iter().enumerate() {
            if count == 0 {
                let first = first as usize;
                let middle = |branch: Branch| branch.bounds.0 + branch.bounds.1;
                let apart = middle(branches[first + 1]) - middle(branches[first]);
                axes[at] = apart.abs().max_position() as u32;
                if apart[axes[at] as usize] < 0.0 {
                    place.swap(first, first + 1);
                }
            }
        }
        let node = |&from: &u32| {
            let Branch { first, count, bounds } = branches[from as usize];
            let (first, content) = if count == 0 {
                (first, axes[from as usize])
            } else {
                let solid = &solids[first as usize];
                (index(first as usize), count << Kind::BITS | solid.number())
            };
            let (low, high) = padded(bounds);
            Node { low, high, first, content }
        };
        Self { nodes: map(&place, node) }
    }

    /// Makes a tree of very many boxes of one kind, at least one. Returns it with the indices of the boxes in the order of its
    /// leaves. `bounds` returns the exact bounds of a box; the boxes themselves only decide which are together.
    pub(crate) fn of_many(
        kind: Kind,
        boxes: Vec<Boxed>,
        bounds: impl Fn(u32) -> Bounds + Send + Sync,
    ) -> (Self, Vec<u32>) {
        let Grown { nodes, order } = Grown::of(boxes, LEAF as usize);
        let node = |&Twig { first, count }: &Twig| {
            let items = &order[first as usize..][..count as usize];
            let (low, high) = padded(items.iter().map(|&at| bounds(at)).fold(NOTHING, join));
            Node { low, high, first, content: count << Kind::BITS | kind.number() }
        };
        let mut nodes: Vec<Node<E>> = map(&nodes, node);
        // Children come after their parents.
        for at in (0..nodes.len()).rev() {
            let Node { first, content, .. } = nodes[at];
            if content >> Kind::BITS > 0 {
                continue;
            }
            let first = first as usize;
            let (one, other) = (nodes[first], nodes[first + 1]);
            let middle = |of: &Node<E>| {
                let [low, high] = [of.low, of.high].map(|corner| DVec3::from(corner.map(E::widen)));
                low + high
            };
            let apart = middle(&other) - middle(&one);
            let axis = apart.abs().max_position();
            // The first child comes first along the axis on which their centres are farthest apart.
            if apart[axis] < 0.0 {
                nodes.swap(first, first + 1);
            }
            let node = &mut nodes[at];
            node.content = axis as u32;
            for k in 0..3 {
                node.low[k] = if other.low[k] < one.low[k] { other.low[k] } else { one.low[k] };
                node.high[k] = if other.high[k] > one.high[k] { other.high[k] } else { one.high[k] };
            }
        }
        (Self { nodes }, order)
    }
}

impl<E: Real> Neighbours for Tree<E> {
    fn any_around(&self, (min, max): Bounds, is: &dyn Fn(Kind, Range<usize>) -> bool) -> bool {
        let mut pending = vec![0];
        while let Some(at) = pending.pop() {
            let node: &Node<E> = &self.nodes[at];
            let is_around = (0..3)
                .all(|axis| node.low[axis].widen() <= min[axis] && max[axis] <= node.high[axis].widen());
            match node.content() {
                _ if !is_around => {}
                Content::Leaf(kind, items) => {
                    if is(kind, items) {
                        return true;
                    }
                }
                Content::Children(first, _) => pending.extend([first as usize, first as usize + 1]),
            }
        }
        false
    }
}
