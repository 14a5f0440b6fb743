//! What the steps of a kernel ask of a kind of shape: the interface, on a page.
//!
//! A step knows no shape. It is handed some [`Items`] of a kind and asks the kind which of them its rays meet first
//! ([`Tests`]), or which of its points they keep a sun's light from ([`Obstructs`]). All tests take what is on an edge, or
//! within the rounding error of it, for a hit, as closed sets do. Everything is `inline(always)`: see docs/tracer.md.

use std::ops::Range;

use fearless_simd::Simd;

use super::lights::sun::Sun;
use super::packet::{Nearest, Ray, Surface};
use super::predicate::Place;
use super::real::{Lanes, Mask, Real, Vec3};

/// Where rays meet shapes `P`, and the surface there.
pub(super) trait Tests<P: Aim<E>, E: Real> {
    /// Offers where the rays meet the shape; `EYE` says that they start at the origin of the coordinates.
    fn meet<S: Simd, const EYE: bool>(
        simd: S,
        shape: &P,
        place: Place,
        ray: Ray<S, E>,
        aimed: P::Aimed<S>,
        nearest: &mut Nearest<S, E>,
    );

    /// The surface where the rays meet the shape.
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        shape: &P,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E>;
}

/// Tests whose errors are bounded: those that pictures are made with.
pub(super) struct Robust;

/// What the tests of a kind have in common for a packet of rays.
pub(super) trait Aim<E: Real> {
    type Aimed<S: Simd>: Copy;

    fn aim<S: Simd>(simd: S, ray: Ray<S, E>) -> Self::Aimed<S>;
}

/// A kind of shape in the light of a sun.
pub(super) trait Obstructs<E: Real>: Sized {
    /// The shape as an obstacle to one sun.
    type Obstacle;

    /// What the tests of the kind have in common for a packet of points.
    type Faced<S: Simd>: Copy;

    fn face<S: Simd>(simd: S, sun: &Sun<E>, point: Vec3<S, E>) -> Self::Faced<S>;

    /// Which of the points that `lit` names stay lit behind some of the `obstacles`.
    fn unoccluded<S: Simd>(
        simd: S,
        obstacles: Obstacles<Self::Obstacle>,
        items: impl Items,
        sun: &Sun<E>,
        points: (Vec3<S, E>, Self::Faced<S>),
        lit: Mask<S, E>,
    ) -> Mask<S, E>;
}

/// All obstacles of a kind, and their corners before rounding.
pub(super) type Obstacles<'a, T> = (&'a [T], &'a dyn super::predicate::Corners);

/// Some objects of a kind, by their positions in its array.
pub(super) trait Items: Clone {
    fn is_empty(&self) -> bool;

    /// Each, with what is there for it.
    fn of<T>(self, all: &[T]) -> impl Iterator<Item = (usize, &T)>;
}

/// Those whose bits are set.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bits(pub(super) u64);

impl Iterator for Bits {
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

impl Items for Bits {
    #[inline(always)]
    fn is_empty(&self) -> bool {
        self.0 == 0
    }

    #[inline(always)]
    fn of<T>(self, all: &[T]) -> impl Iterator<Item = (usize, &T)> {
        self.map(
            #[inline(always)]
            |at| (at, &all[at]),
        )
    }
}

/// Those on a list.
impl Items for &[u32] {
    #[inline(always)]
    fn is_empty(&self) -> bool {
        (*self).is_empty()
    }

    #[inline(always)]
    fn of<T>(self, all: &[T]) -> impl Iterator<Item = (usize, &T)> {
        self.iter().map(
            #[inline(always)]
            |&at| (at as usize, &all[at as usize]),
        )
    }
}

/// Those of a leaf.
impl Items for Range<usize> {
    #[inline(always)]
    fn is_empty(&self) -> bool {
        Range::is_empty(self)
    }

    #[inline(always)]
    fn of<T>(self, all: &[T]) -> impl Iterator<Item = (usize, &T)> {
        self.clone().zip(&all[self])
    }
}
