//! Objects that rays may meet: by the bits of a word, or on a list.

use super::kind::{ByKind, Kind, Row};
use super::shape::{Bits, Items};

/// Objects up to this many are told apart by the bits of a word; more are found by lists, or by a tree.
pub(super) const MASKED: usize = 64;

/// Objects by bits, a word a kind, each in the order of its array.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Masks(ByKind<Bits>);

impl Masks {
    /// Of a word in which all objects stand in a row.
    #[inline(always)]
    pub(super) fn split(bits: u64, row: Row, counts: ByKind<usize>) -> Self {
        Self(ByKind::new(
            #[inline(always)]
            |kind| Bits(of_kind(bits, row.begin(kind) as usize, *counts.of(kind))),
        ))
    }

    /// Without the spheres whose bits are not set.
    #[inline(always)]
    pub(super) fn and_spheres(self, bits: u64) -> Self {
        Self(ByKind { spheres: Bits(self.0.spheres.0 & bits), ..self.0 })
    }
}

/// The bits of a kind whose array begins at `from` and has `count` items, moved to the front.
#[inline(always)]
fn of_kind(bits: u64, from: usize, count: usize) -> u64 {
    if from >= MASKED || count == 0 {
        return 0;
    }
    (bits >> from) & (u64::MAX >> MASKED.saturating_sub(count))
}

/// Objects by lists of their positions in the arrays of each kind.
#[derive(Clone, Debug, Default)]
pub(super) struct Picked(ByKind<Vec<u32>>);

impl Picked {
    pub(super) fn is_empty(&self) -> bool {
        !self.kinds().any()
    }

    pub(super) fn clear(&mut self) {
        Kind::each(|kind| self.0.of_mut(kind).clear());
    }

    /// An object by its place in a row of all.
    #[inline(always)]
    pub(super) fn push(&mut self, place: u32, row: Row) {
        let (kind, at) = row.find(place);
        self.0.of_mut(kind).push(at);
    }
}

/// Objects of all kinds.
pub(super) trait Found: Copy {
    /// Those of a kind.
    fn of(self, kind: Kind) -> impl Items;

    /// Which kinds there are.
    #[inline(always)]
    fn kinds(self) -> ByKind<bool> {
        ByKind::new(
            #[inline(always)]
            |kind| !self.of(kind).is_empty(),
        )
    }
}

impl Found for Masks {
    #[inline(always)]
    fn of(self, kind: Kind) -> impl Items {
        *self.0.of(kind)
    }
}

impl Found for &Picked {
    #[inline(always)]
    fn of(self, kind: Kind) -> impl Items {
        &self.0.of(kind)[..]
    }
}

/// Where to look for what a tile's rays meet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidates<'a> {
    /// In a scene without a tree.
    pub(super) masks: Masks,
    /// In one with a tree: instead of all that is in it.
    pub(super) list: Option<&'a Picked>,
    /// The kinds that there can be among them.
    pub(super) kinds: ByKind<bool>,
}

impl<'a> Candidates<'a> {
    #[inline(always)]
    pub(super) fn masked(masks: Masks) -> Self {
        Self { masks, list: None, kinds: masks.kinds() }
    }

    #[inline(always)]
    pub(super) fn listed(list: &'a Picked) -> Self {
        Self { masks: Masks::default(), list: Some(list), kinds: list.kinds() }
    }
}
