//! Where the rays of pixels start and go, in packets: [`View`] with its numbers rounded.
//!
//! Columns count from the left and rows from the bottom, and both may be fractions.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::geometry::View;
use super::real::{Lanes, Real, Vec3, splat};

/// The rays of a view.
#[derive(Clone, Copy, Debug)]
pub(super) enum Rays<E> {
    Pinhole(FromEye<E>),
    Parallel(AlongAxis<E>),
}

/// Rays from the origin along `corner + i·right + j·up`.
#[derive(Clone, Copy, Debug)]
pub(super) struct FromEye<E> {
    corner: [E; 3],
    right: [E; 3],
    up: [E; 3],
}

/// Rays from `corner + (i·pixel, j·pixel, 0)` along `(0, 0, -1)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct AlongAxis<E> {
    corner: [E; 3],
    pixel: E,
}

impl<E: Real> Rays<E> {
    pub(super) fn new(view: &View) -> Self {
        let narrow = |v: DVec3| v.to_array().map(E::narrow);
        match *view {
            View::Parallel { corner, pixel } => {
                Self::Parallel(AlongAxis { corner: narrow(corner), pixel: E::narrow(pixel) })
            }
            View::Pinhole { right, up, back, x, y } => Self::Pinhole(FromEye {
                corner: narrow(x.start * right + y.start * up - back),
                right: narrow(x.step * right),
                up: narrow(y.step * up),
            }),
        }
    }
}

impl<E: Real> FromEye<E> {
    /// The direction of the rays of columns `i` and rows `j`.
    #[inline(always)]
    pub(super) fn direction<S: Simd>(&self, simd: S, i: Lanes<S, E>, j: Lanes<S, E>) -> Vec3<S, E> {
        self.along(simd, i, j).normalize(simd)
    }

    /// The same, so long that they go as far as 1 along the gaze.
    #[inline(always)]
    pub(super) fn along<S: Simd>(&self, simd: S, i: Lanes<S, E>, j: Lanes<S, E>) -> Vec3<S, E> {
        let along = Vec3::splat(simd, self.right).scale_add(i, Vec3::splat(simd, self.corner));
        Vec3::splat(simd, self.up).scale_add(j, along)
    }
}

impl<E: Real> AlongAxis<E> {
    /// That of all.
    #[inline(always)]
    pub(super) fn direction<S: Simd>(&self, simd: S) -> Vec3<S, E> {
        let zero = E::narrow(0.0);
        Vec3::splat(simd, [zero, zero, E::narrow(-1.0)])
    }

    /// Where the rays of columns `i` and rows `j` start.
    #[inline(always)]
    pub(super) fn origin<S: Simd>(&self, simd: S, i: Lanes<S, E>, j: Lanes<S, E>) -> Vec3<S, E> {
        let pixel = splat::<S, E>(simd, self.pixel);
        let corner = Vec3::<S, E>::splat(simd, self.corner);
        Vec3::<S, E>::new(i.mul_add(pixel, corner.x), j.mul_add(pixel, corner.y), corner.z)
    }
}
