//! The kinds of shapes, and containers with a value for each of them.
//!
//! To add a kind, add a variant and a field here. The compiler then reports every place that must handle it.

/// The kind of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Sphere,
    Cuboid,
    Triangle,
}

impl Kind {
    /// The number of bits that hold [`Kind::number`].
    pub(crate) const BITS: u32 = 3;

    /// Returns the number of the kind, from 0, in the order in which kinds are stored.
    #[inline(always)]
    pub(crate) const fn number(self) -> u32 {
        match self {
            Self::Sphere => 0,
            Self::Cuboid => 1,
            Self::Triangle => 2,
        }
    }

    /// Returns the kind of a [`Kind::number`].
    #[inline(always)]
    pub(crate) const fn numbered(number: u32) -> Self {
        match number {
            0 => Self::Sphere,
            1 => Self::Cuboid,
            2 => Self::Triangle,
            _ => unreachable!(),
        }
    }

    /// Calls `of` with each kind, in order.
    #[inline(always)]
    pub(crate) fn each(mut of: impl FnMut(Self)) {
        of(Self::Sphere);
        of(Self::Cuboid);
        of(Self::Triangle);
    }
}

/// A value for each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ByKind<T> {
    pub(crate) spheres: T,
    pub(crate) cuboids: T,
    pub(crate) triangles: T,
}

impl<T> ByKind<T> {
    #[inline(always)]
    pub(crate) fn new(mut of: impl FnMut(Kind) -> T) -> Self {
        Self { spheres: of(Kind::Sphere), cuboids: of(Kind::Cuboid), triangles: of(Kind::Triangle) }
    }

    #[inline(always)]
    pub(crate) const fn of(&self, kind: Kind) -> &T {
        match kind {
            Kind::Sphere => &self.spheres,
            Kind::Cuboid => &self.cuboids,
            Kind::Triangle => &self.triangles,
        }
    }

    #[inline(always)]
    pub(crate) const fn of_mut(&mut self, kind: Kind) -> &mut T {
        match kind {
            Kind::Sphere => &mut self.spheres,
            Kind::Cuboid => &mut self.cuboids,
            Kind::Triangle => &mut self.triangles,
        }
    }
}

impl ByKind<bool> {
    /// Returns whether the value of any kind is true.
    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        let mut any = false;
        Kind::each(
            #[inline(always)]
            |kind| any |= *self.of(kind),
        );
        any
    }

    /// Returns, for each kind, whether either value is true.
    #[inline(always)]
    pub(crate) fn or(self, other: Self) -> Self {
        Self::new(
            #[inline(always)]
            |kind| *self.of(kind) || *other.of(kind),
        )
    }
}

/// The start of each kind in a row of objects of all kinds, kind after kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row(ByKind<u32>);

impl Row {
    /// Makes a row from the number of objects of each kind.
    pub(crate) fn new(counts: ByKind<usize>) -> Self {
        let mut begin = 0;
        Self(ByKind::new(|kind| {
            let here = begin;
            begin += *counts.of(kind) as u32;
            here
        }))
    }

    /// Returns the index at which a kind begins.
    #[inline(always)]
    pub(crate) fn begin(&self, kind: Kind) -> u32 {
        *self.0.of(kind)
    }

    /// Returns the kind of the object at an index of the row, and its index within that kind.
    #[inline(always)]
    pub(crate) fn find(&self, place: u32) -> (Kind, u32) {
        // The last kind that begins at or before the index. A kind without objects begins at the same index as the next
        // one.
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
