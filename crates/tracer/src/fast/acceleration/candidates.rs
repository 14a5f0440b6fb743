//! Candidates: the objects that rays may hit, as a bit mask or as a list.

use crate::fast::rays::kind::{ByKind, Kind, Row};
use crate::fast::shapes::shape::{Bits, Items};

/// The largest number of objects that a mask can hold. More are found by lists or by a tree.
pub(crate) const MASKED: usize = 64;

/// Masks of objects: one word per kind, with its bits in the order of that kind's array.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Masks(ByKind<Bits>);

impl Masks {
    /// Splits a word with the bits of all objects, kind after kind, into a mask per kind.
    #[inline(always)]
    pub(crate) fn split(bits: u64, row: Row, counts: ByKind<usize>) -> Self {
        Self(ByKind::new(
            #[inline(always)]
            |kind| Bits(of_kind(bits, row.begin(kind) as usize, *counts.of(kind))),
        ))
    }

    /// Returns the masks without the spheres whose bits are not set.
    #[inline(always)]
    pub(crate) fn and_spheres(self, bits: u64) -> Self {
        Self(ByKind { spheres: Bits(self.0.spheres.0 & bits), ..self.0 })
    }
}

/// Returns the bits of a kind, moved to the front. The array of the kind begins at `from` and has `count` items.
#[inline(always)]
fn of_kind(bits: u64, from: usize, count: usize) -> u64 {
    if from >= MASKED || count == 0 {
        return 0;
    }
    (bits >> from) & (u64::MAX >> MASKED.saturating_sub(count))
}

/// Lists of objects, as indices into the arrays of each kind.
#[derive(Clone, Debug, Default)]
pub(crate) struct Picked(ByKind<Vec<u32>>);

impl Picked {
    pub(crate) fn is_empty(&self) -> bool {
        !self.kinds().any()
    }

    pub(crate) fn clear(&mut self) {
        Kind::each(|kind| self.0.of_mut(kind).clear());
    }

    /// Adds an object by its index in the row of all objects.
    #[inline(always)]
    pub(crate) fn push(&mut self, place: u32, row: Row) {
        let (kind, at) = row.find(place);
        self.0.of_mut(kind).push(at);
    }
}

/// A set of objects of all kinds.
pub(crate) trait CandidateSet: Copy {
    /// Returns the objects of a kind.
    fn of(self, kind: Kind) -> impl Items;

    /// Returns the kinds that have objects.
    #[inline(always)]
    fn kinds(self) -> ByKind<bool> {
        ByKind::new(
            #[inline(always)]
            |kind| !self.of(kind).is_empty(),
        )
    }
}

impl CandidateSet for Masks {
    #[inline(always)]
    fn of(self, kind: Kind) -> impl Items {
        *self.0.of(kind)
    }
}

impl CandidateSet for &Picked {
    #[inline(always)]
    fn of(self, kind: Kind) -> impl Items {
        &self.0.of(kind)[..]
    }
}

/// The candidates of a tile's rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidates<'a> {
    /// The masks, in a scene without a tree.
    pub(crate) masks: Masks,
    /// The list, in a scene with a tree: replaces the search of the tree.
    pub(crate) list: Option<&'a Picked>,
    /// The kinds of the candidates.
    pub(crate) kinds: ByKind<bool>,
}

impl<'a> Candidates<'a> {
    #[inline(always)]
    pub(crate) fn masked(masks: Masks) -> Self {
        Self { masks, list: None, kinds: masks.kinds() }
    }

    #[inline(always)]
    pub(crate) fn listed(list: &'a Picked) -> Self {
        Self { masks: Masks::default(), list: Some(list), kinds: list.kinds() }
    }
}
