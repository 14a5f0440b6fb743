//! The topology of a tree of very many boxes, in a fraction of a second.
//!
//! From the top down, boxes are split at the best of a few planes across each axis, by the surface areas of both sides
//! (Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007). All work is done in one array, which
//! is sorted in place. Each subtree depends only on its own boxes, so the tree is the same for any number of threads.

use glam::{Vec3A, Vec4, Vec4Swizzles};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

/// The number of slices along an axis.
const SLICES: usize = 16;

/// The number of boxes below which they count as few, and the number of slices that few boxes have. They are split
/// across the axis along which their middles are farthest apart.
const FEW: usize = 32;
const FEW_SLICES: usize = 8;

/// The level from which boxes are split into equal halves, so that no tree is deep.
const DEEP: usize = 40;

/// The number of boxes up to which one thread makes a subtree.
const ALONE: usize = 8192;

/// The number of boxes from which several threads count the slices, and the number that one thread counts at a time.
const COUNTED_TOGETHER: usize = 65_536;
const CHUNK: usize = 16_384;

/// A node. For children, the index of the first one; the second follows it. For a leaf, the place of its first box in
/// [`Grown::order`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Twig {
    pub(super) first: u32,
    /// The number of boxes of a leaf; 0 for a node with children.
    pub(super) count: u32,
}

/// The nodes of a tree, the root first and children after their parents.
pub(super) struct Grown {
    pub(super) nodes: Vec<Twig>,
    /// The indices of the boxes in the order of the leaves.
    pub(super) order: Vec<u32>,
}

/// The bits that are combined with an index to make a normal floating-point number. Subnormal numbers are slow.
const MARK: u32 = 0x4000_0000;

/// A box. The last lane of `low` holds the bits of its index.
#[derive(Clone, Copy)]
pub(crate) struct Item {
    low: Vec4,
    high: Vec4,
}

impl Item {
    /// Returns the box with an index, from its smallest to its largest corner.
    pub(crate) fn new(index: u32, low: Vec3A, high: Vec3A) -> Self {
        Self { low: low.extend(f32::from_bits(index | MARK)), high: high.extend(0.0) }
    }

    /// Returns twice its centre.
    fn middle(&self) -> Vec4 {
        self.low + self.high
    }

    fn index(&self) -> u32 {
        self.low.w.to_bits() ^ MARK
    }
}

/// The smallest and the largest corner of a box. The last lanes have no meaning.
#[derive(Clone, Copy)]
struct Span {
    low: Vec4,
    high: Vec4,
}

impl Span {
    const EMPTY: Self = Self { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };

    fn join(&mut self, other: Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    fn add(&mut self, point: Vec4) {
        self.low = self.low.min(point);
        self.high = self.high.max(point);
    }

    fn half_area(&self) -> f32 {
        let size = (self.high - self.low).xyz();
        size.x * (size.y + size.z) + size.y * size.z
    }
}

/// The boxes in a slice.
#[derive(Clone, Copy)]
struct Slice {
    span: Span,
    count: u32,
}

impl Slice {
    const EMPTY: Self = Self { span: Span::EMPTY, count: 0 };

    fn add(&mut self, item: &Item) {
        self.join(&Self { span: Span { low: item.low, high: item.high }, count: 1 });
    }

    /// Returns its area times the number of its boxes.
    fn cost(&self) -> f32 {
        self.span.half_area() * self.count as f32
    }

    fn join(&mut self, other: &Self) {
        self.span.join(other.span);
        self.count += other.count;
    }
}

type Slices<const N: usize> = [[Slice; N]; 3];

/// Assigns boxes to slices between the least and the greatest of their middles.
#[derive(Clone, Copy)]
struct Ruler<const N: usize> {
    from: Vec4,
    scale: Vec4,
}

/// The number that rounds another number to a whole one if it is added, and leaves that in the last bits.
const WHOLE: f32 = 12_582_912.0;

impl<const N: usize> Ruler<N> {
    fn new(middles: Span) -> Self {
        const { assert!(N.is_power_of_two()) };
        let size = middles.high - middles.low;
        // Along an axis without an extent all are in the first slice.
        let scale = |size: f32| {
            let scale = N as f32 * 0.999_99 / size;
            if size > 0.0 && scale.is_finite() { scale } else { 0.0 }
        };
        Self { from: middles.low, scale: size.map(scale) }
    }

    /// Returns the slices of a middle, along each axis.
    fn of(&self, middle: Vec4) -> [usize; 3] {
        let place = (middle - self.from) * self.scale - 0.5 + WHOLE;
        [place.x, place.y, place.z].map(|x| x.to_bits() as usize % N)
    }

    /// Returns the slice of a middle along one axis.
    fn along(&self, axis: usize, middle: Vec4) -> usize {
        let place = (middle[axis] - self.from[axis]) * self.scale[axis] - 0.5 + WHOLE;
        place.to_bits() as usize % N
    }

    fn count(&self, items: &[Item]) -> Slices<N> {
        let mut all = [[Slice::EMPTY; N]; 3];
        for item in items {
            let places = self.of(item.middle());
            for (slices, place) in all.iter_mut().zip(places) {
                slices[place].add(item);
            }
        }
        all
    }

    fn count_along(&self, axis: usize, items: &[Item]) -> [Slice; N] {
        let mut slices = [Slice::EMPTY; N];
        for item in items {
            slices[self.along(axis, item.middle())].add(item);
        }
        slices
    }

    fn count_together(&self, items: &[Item]) -> Slices<N> {
        let join = |mut one: Slices<N>, other: Slices<N>| {
            for (slice, other) in one.as_flattened_mut().iter_mut().zip(other.as_flattened()) {
                slice.join(other);
            }
            one
        };
        let counts = items.par_chunks(CHUNK).map(|items| self.count(items));
        counts.reduce(|| [[Slice::EMPTY; N]; 3], join)
    }

    /// Moves the items before a slice to the front. Returns their number, and the range of middles on both sides.
    fn part(&self, items: &mut [Item], (axis, slice): (usize, usize)) -> (usize, [Span; 2]) {
        let mut sides = [Span::EMPTY; 2];
        let (mut first, mut end) = (0, items.len());
        while first < end {
            let middle = items[first].middle();
            if self.along(axis, middle) < slice {
                sides[0].add(middle);
                first += 1;
            } else {
                end -= 1;
                sides[1].add(middle);
                items.swap(first, end);
            }
        }
        (first, sides)
    }
}

/// A subtree: made by one thread, with the root first, or joined from two.
enum Subtree {
    Nodes(Vec<Twig>),
    Pair(Box<[Subtree; 2]>),
}

impl Grown {
    /// Makes a tree of at least one box. A leaf has at most `most` boxes.
    pub(super) fn new(boxes: &[Aabb], most: usize) -> Self {
        let item = |(index, of): (usize, &Aabb)| Item::new(index as u32, of.min, of.max);
        Self::of(boxes.par_iter().enumerate().map(item).collect(), most)
    }

    /// Makes a tree of boxes as [`new`](Self::new) does.
    pub(super) fn of(mut items: Vec<Item>, most: usize) -> Self {
        let middle = |mut span: Span, item: &Item| {
            span.add(item.middle());
            span
        };
        let join = |mut one: Span, other: Span| {
            one.join(other);
            one
        };
        let middles = items.par_chunks(CHUNK).map(|items| items.iter().fold(Span::EMPTY, middle));
        let middles = middles.reduce(|| Span::EMPTY, join);
        let subtree = grow((&mut items, 0), middles, most, 0);
        let mut nodes = Vec::with_capacity(items.len());
        nodes.push(Twig::default());
        subtree.flatten(0, &mut nodes);
        Self { nodes, order: items.par_iter().map(Item::index).collect() }
    }
}

impl Subtree {
    /// Appends the nodes to `all`. The root is at `at`.
    fn flatten(self, at: usize, all: &mut Vec<Twig>) {
        let first = all.len() as u32;
        match self {
            Self::Nodes(mut nodes) => {
                for twig in nodes.iter_mut().filter(|twig| twig.count == 0) {
                    twig.first = twig.first - 1 + first;
                }
                all[at] = nodes[0];
                all.extend_from_slice(&nodes[1..]);
            }
            Self::Pair(pair) => {
                all[at] = Twig { first, count: 0 };
                all.extend([Twig::default(); 2]);
                let [one, other] = *pair;
                one.flatten(first as usize, all);
                other.flatten(first as usize + 1, all);
            }
        }
    }
}

/// Makes the subtree of items at a level. Their middles are within `middles`, and `from` is the place of the first
/// item.
fn grow((items, from): (&mut [Item], usize), middles: Span, most: usize, level: usize) -> Subtree {
    if items.len() <= ALONE.max(most) {
        let mut nodes = Vec::with_capacity(items.len());
        nodes.push(Twig::default());
        grow_alone((&mut nodes, 0), (items, from), middles, most, level);
        return Subtree::Nodes(nodes);
    }
    let (middle, [one, other]) = part(items, middles, level);
    let (first, second) = items.split_at_mut(middle);
    let (first, second) = rayon::join(
        || grow((first, from), one, most, level + 1),
        || grow((second, from + middle), other, most, level + 1),
    );
    Subtree::Pair(Box::new([first, second]))
}

fn grow_alone(
    (nodes, at): (&mut Vec<Twig>, usize),
    (items, from): (&mut [Item], usize),
    middles: Span,
    most: usize,
    level: usize,
) {
    if items.len() <= most {
        nodes[at] = Twig { first: from as u32, count: items.len() as u32 };
        return;
    }
    let (middle, [one, other]) = part(items, middles, level);
    let children = nodes.len();
    nodes[at] = Twig { first: children as u32, count: 0 };
    nodes.extend([Twig::default(); 2]);
    let (first, second) = items.split_at_mut(middle);
    grow_alone((nodes, children), (first, from), one, most, level + 1);
    grow_alone((nodes, children + 1), (second, from + middle), other, most, level + 1);
}

/// Splits items into two sets. Returns the number of the first ones, and the range of middles of both.
fn part(items: &mut [Item], middles: Span, level: usize) -> (usize, [Span; 2]) {
    if level >= DEEP {
        return halve(items, middles);
    }
    let parted = if items.len() < FEW { part_few(items, middles) } else { part_many(items, middles) };
    // All are in one place.
    parted.unwrap_or((items.len() / 2, [middles; 2]))
}

/// Splits items into halves across the axis along which their middles are farthest apart.
fn halve(items: &mut [Item], middles: Span) -> (usize, [Span; 2]) {
    let axis = (middles.high - middles.low).xyz().max_position();
    let half = items.len() / 2;
    let place = |item: &Item| (item.middle()[axis], item.index());
    items.select_nth_unstable_by(half, |a, b| {
        let (a, b) = (place(a), place(b));
        a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
    });
    let span = |items: &[Item]| {
        items.iter().fold(Span::EMPTY, |mut span, item| {
            span.add(item.middle());
            span
        })
    };
    (half, [span(&items[..half]), span(&items[half..])])
}

// Out of line, so that the slices are not on the stack of each level.
#[inline(never)]
fn part_few(items: &mut [Item], middles: Span) -> Option<(usize, [Span; 2])> {
    let ruler = Ruler::<FEW_SLICES>::new(middles);
    let axis = (middles.high - middles.low).xyz().max_position();
    let (_, slice) = best(&ruler.count_along(axis, items))?;
    Some(ruler.part(items, (axis, slice)))
}

#[inline(never)]
fn part_many(items: &mut [Item], middles: Span) -> Option<(usize, [Span; 2])> {
    let ruler = Ruler::<SLICES>::new(middles);
    let slices =
        if items.len() > COUNTED_TOGETHER { ruler.count_together(items) } else { ruler.count(items) };
    let bests = (0..3).filter_map(|axis| best(&slices[axis]).map(|(cost, slice)| (cost, (axis, slice))));
    let (_, place) = bests.reduce(|one, other| if other.0 < one.0 { other } else { one })?;
    Some(ruler.part(items, place))
}

/// Returns the first slice of the second side for which the sum of both sides' areas, each times the number of its
/// boxes, is smallest. That sum comes first. Returns `None` if all boxes are in one slice.
fn best<const N: usize>(slices: &[Slice; N]) -> Option<(f32, usize)> {
    let mut behind = [None; N];
    let mut side = Slice::EMPTY;
    for at in (1..N).rev() {
        side.join(&slices[at]);
        behind[at] = (side.count > 0).then(|| side.cost());
    }
    let mut best: Option<(f32, usize)> = None;
    let mut side = Slice::EMPTY;
    for at in 1..N {
        side.join(&slices[at - 1]);
        let Some(behind) = behind[at].filter(|_| side.count > 0) else { continue };
        let cost = side.cost() + behind;
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, at));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(middle: Vec3A, half: f32) -> Aabb {
        Aabb { min: middle - half, max: middle + half }
    }

    /// Checks that each box is in one leaf, and returns the depth of the tree.
    fn check(grown: &Grown, count: usize, most: usize) -> usize {
        let mut order = grown.order.clone();
        order.sort_unstable();
        assert!(order.into_iter().eq(0..count as u32), "each once");
        let (mut next, mut depth) = (0, 0);
        let mut pending = vec![(0, 1)];
        while let Some((at, level)) = pending.pop() {
            depth = depth.max(level);
            let Twig { first, count } = grown.nodes[at];
            if count == 0 {
                assert!(first as usize > at, "children come after their parents");
                pending.extend([(first as usize + 1, level + 1), (first as usize, level + 1)]);
            } else {
                assert!(count as usize <= most);
                assert_eq!(first, next, "leaves stand side by side");
                next += count;
            }
        }
        assert_eq!(next as usize, count);
        depth
    }

    #[test]
    fn every_box_is_in_one_leaf_whatever_the_boxes_and_the_threads() {
        let mut rng = fastrand::Rng::with_seed(5);
        let mut place = || Vec3A::new(rng.f32(), rng.f32(), rng.f32());
        let scattered: Vec<Aabb> = (0..100_000).map(|_| around(place(), 0.001)).collect();
        let equal = vec![around(Vec3A::ONE, 0.5); 30_000];
        let line: Vec<Aabb> = (0..30_000).map(|k| around(Vec3A::X * (1.0 + k as f32).recip(), 0.0)).collect();
        for (what, boxes) in [("scattered", &scattered[..]), ("equal", &equal), ("line", &line)] {
            for most in [1, 4] {
                let mut trees = [1, 2, 3].map(|threads| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    pool.install(|| Grown::new(boxes, most))
                });
                let depth = check(&trees[0], boxes.len(), most);
                assert!(depth < 64, "{what}: {depth}");
                let places = |tree: &Grown| tree.nodes.iter().map(|t| (t.first, t.count)).collect::<Vec<_>>();
                let first = places(&trees[0]);
                assert!(trees.iter().all(|tree| places(tree) == first), "{what}");
                let order = core::mem::take(&mut trees[0].order);
                assert!(trees[1..].iter().all(|tree| tree.order == order), "{what}");
            }
        }
        check(&Grown::new(&scattered[..1], 4), 1, 4);
    }

    #[test]
    fn boxes_are_parted_where_the_sides_are_small() {
        // Two heaps, of which the one has most of the boxes.
        let heap = |count: u32, at: f32| {
            (0..count).map(move |k| around(Vec3A::new(at, k as f32 / 1e4, (k % 7) as f32 / 1e4), 1e-5))
        };
        let boxes: Vec<Aabb> = heap(900, 0.0).chain(heap(100, 1.0)).collect();
        let grown = Grown::new(&boxes, 4);
        let count = |mut at: usize| {
            let mut sum = 0;
            let mut pending = vec![at];
            while let Some(next) = pending.pop() {
                at = next;
                let Twig { first, count } = grown.nodes[at];
                sum += count;
                if count == 0 {
                    pending.extend([first as usize, first as usize + 1]);
                }
            }
            sum
        };
        let first = grown.nodes[0].first as usize;
        assert_eq!([first, first + 1].map(count), [900, 100]);
    }
}
