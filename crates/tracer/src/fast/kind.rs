//! The kinds of shapes, and what is kept for each of them.
//!
//! A new kind is a variant and a field here; the compiler then names every place that has to know it.

/// What a shape is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Sphere,
    Cuboid,
    Triangle,
}

impl Kind {
    /// How many bits hold [`Kind::number`].
    pub(super) const BITS: u32 = 3;

    /// Counts the kinds from 0, in the order in which they stand one after another.
    #[inline(always)]
    pub(super) const fn number(self) -> u32 {
        match self {
            Self::Sphere => 0,
            Self::Cuboid => 1,
            Self::Triangle => 2,
        }
    }

    /// The kind of a [`Kind::number`].
    #[inline(always)]
    pub(super) const fn numbered(number: u32) -> Self {
        match number {
            0 => Self::Sphere,
            1 => Self::Cuboid,
            2 => Self::Triangle,
            _ => unreachable!(),
        }
    }

    /// Calls `of` with each kind, in order.
    #[inline(always)]
    pub(super) fn each(mut of: impl FnMut(Self)) {
        of(Self::Sphere);
        of(Self::Cuboid);
        of(Self::Triangle);
    }
}

/// Something for each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ByKind<T> {
    pub(super) spheres: T,
    pub(super) cuboids: T,
    pub(super) triangles: T,
}

impl<T> ByKind<T> {
    #[inline(always)]
    pub(super) fn new(mut of: impl FnMut(Kind) -> T) -> Self {
        Self { spheres: of(Kind::Sphere), cuboids: of(Kind::Cuboid), triangles: of(Kind::Triangle) }
    }

    #[inline(always)]
    pub(super) const fn of(&self, kind: Kind) -> &T {
        match kind {
            Kind::Sphere => &self.spheres,
            Kind::Cuboid => &self.cuboids,
            Kind::Triangle => &self.triangles,
        }
    }

    #[inline(always)]
    pub(super) const fn of_mut(&mut self, kind: Kind) -> &mut T {
        match kind {
            Kind::Sphere => &mut self.spheres,
            Kind::Cuboid => &mut self.cuboids,
            Kind::Triangle => &mut self.triangles,
        }
    }
}

impl ByKind<bool> {
    /// Whether it holds of any kind.
    #[inline(always)]
    pub(super) fn any(self) -> bool {
        let mut any = false;
        Kind::each(
            #[inline(always)]
            |kind| any |= *self.of(kind),
        );
        any
    }

    /// Whether it holds of a kind here or there.
    #[inline(always)]
    pub(super) fn or(self, other: Self) -> Self {
        Self::new(
            #[inline(always)]
            |kind| *self.of(kind) || *other.of(kind),
        )
    }
}

/// How objects of all kinds stand in one row, kind after kind: where each kind begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row(ByKind<u32>);

impl Row {
    /// `counts` are how many there are of each kind.
    pub(super) fn new(counts: ByKind<usize>) -> Self {
        let mut begin = 0;
        Self(ByKind::new(|kind| {
            let here = begin;
            begin += *counts.of(kind) as u32;
            here
        }))
    }

    /// Where a kind begins.
    #[inline(always)]
    pub(super) fn begin(&self, kind: Kind) -> u32 {
        *self.0.of(kind)
    }

    /// The kind of what stands at a place of the row, and its position among its kind.
    #[inline(always)]
    pub(super) fn find(&self, place: u32) -> (Kind, u32) {
        // The last kind that begins no later; those that have none begin where the next one does.
        let mut found = (Kind::Sphere, place);
        Kind::each(
            #[inline(always)]
            |kind| {
                if place >= self.begin(kind) {
                    found = (kind, place - self.begin(kind));
                }
            },
        );
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_name_the_kinds_in_order() {
        let mut next = 0;
        Kind::each(|kind| {
            assert_eq!((kind.number(), Kind::numbered(next)), (next, kind));
            next += 1;
        });
        assert!(next <= 1 << Kind::BITS);
    }

    #[test]
    fn what_stands_in_a_row_is_found_by_its_kind() {
        for counts in [(2, 0, 3), (0, 1, 0), (0, 0, 2), (1, 2, 3)] {
            let counts = ByKind { spheres: counts.0, cuboids: counts.1, triangles: counts.2 };
            let row = Row::new(counts);
            let mut place = 0;
            Kind::each(|kind| {
                for at in 0..*counts.of(kind) as u32 {
                    assert_eq!(row.find(place), (kind, at), "{counts:?}");
                    place += 1;
                }
            });
        }
    }
}
