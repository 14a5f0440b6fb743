//! The interface of a kind of shape to the steps of a kernel.
//!
//! A step is independent of the shapes. It gets some [`Items`] of a kind, and calls the kind's tests to find which of
//! them its rays hit first ([`Tests`]), or which of its points they occlude from a sun ([`Obstructs`]). All tests treat
//! points on an edge, or within the rounding error of it, as hits, like closed sets. Everything is `inline(always)`:
//! see docs/tracer.md.

use std::ops::Range;

use fearless_simd::Simd;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3};
use crate::fast::lights::sun::Sun;
use crate::fast::rays::packet::{Nearest, Ray, Surface};
use crate::fast::rays::predicate::Place;

/// The intersection of rays with shapes `P`, and the surface at the hits.
pub(crate) trait Tests<P: Precalculations<E>, E: Real> {
    /// Offers the hits of the rays with the shape. With `EYE` they start at the origin of the coordinates.
    fn intersect<S: Simd, const EYE: bool>(
        simd: S,
        shape: &P,
        place: Place,
        ray: Ray<S, E>,
        aimed: P::RayPrecalculations<S>,
        nearest: &mut Nearest<S, E>,
    );

    /// Returns the surface at the hits of the rays with the shape.
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        shape: &P,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E>;
}

/// The tests with bounded errors, which pictures are made with.
pub(crate) struct Robust;

/// The per-ray constants that the tests of a kind share.
pub(crate) trait Precalculations<E: Real> {
    type RayPrecalculations<S: Simd>: Copy;

    fn aim<S: Simd>(simd: S, ray: Ray<S, E>) -> Self::RayPrecalculations<S>;
}

/// A kind of shape in the light of a sun.
pub(crate) trait Obstructs<E: Real>: Sized {
    /// The shape as an occluder of one sun.
    type Obstacle;

    /// The per-point constants that the tests of the kind share.
    type SunPrecalculations<S: Simd>: Copy;

    fn face<S: Simd>(simd: S, sun: &Sun<E>, point: Vec3<S, E>) -> Self::SunPrecalculations<S>;

    /// Returns the points of `lit` that none of the given `obstacles` occludes.
    fn unoccluded<S: Simd>(
        simd: S,
        obstacles: Obstacles<Self::Obstacle>,
        items: impl Items,
        sun: &Sun<E>,
        points: (Vec3<S, E>, Self::SunPrecalculations<S>),
        lit: Mask<S, E>,
    ) -> Mask<S, E>;
}

/// All occluders of a kind, and their corners before rounding.
pub(crate) type Obstacles<'a, T> = (&'a [T], &'a dyn crate::fast::rays::predicate::Corners);

/// Some objects of a kind, by their indices in its array.
pub(crate) trait Items: Clone {
    fn is_empty(&self) -> bool;

    /// Returns the index of each object, with its element of `all`.
    fn of<T>(self, all: &[T]) -> impl Iterator<Item = (usize, &T)>;
}

/// The objects whose bits are set.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bits(pub(crate) u64);

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

/// The objects on a list.
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

/// The objects of a leaf.
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
