//! The origins and directions of the rays of pixels, in packets: [`View`] with rounded numbers.
//!
//! Columns count from the left and rows from the bottom, both from the view's [anchor](Rays::anchor). Both may be
//! fractions.

use fearless_simd::Simd;
use glam::DVec3;
use rayfold_scene::model::unit;

use crate::camera::Axis;
use crate::fast::arithmetic::real::{Fused, Lanes, Real, Vec3, splat};
use crate::fast::rays::view::View;

/// The rays of a view.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rays<E> {
    Pinhole(FromEye<E>),
    Parallel(AlongAxis<E>),
}

/// Rays from the origin along `x·right + y·up + ahead`. The column and row on the window give `x` and `y`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FromEye<E> {
    right: [E; 3],
    up: [E; 3],
    ahead: [E; 3],
    x: Steps<E>,
    y: Steps<E>,
}

/// An [`Axis`] with rounded numbers.
#[derive(Clone, Copy, Debug)]
struct Steps<E> {
    anchor: f64,
    at_anchor: E,
    step: E,
    rest: E,
}

/// Rays from `corner + (i·pixel, j·pixel, 0)` along `(0, 0, -1)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlongAxis<E> {
    corner: [E; 3],
    pixel: E,
}

impl<E: Real> Rays<E> {
    pub(crate) fn new(view: &View) -> Self {
        let narrow = |v: DVec3| v.to_array().map(E::narrow);
        match *view {
            View::Parallel { corner, pixel } => {
                Self::Parallel(AlongAxis { corner: narrow(corner), pixel: E::narrow(pixel) })
            }
            View::Pinhole { right, up, back, x, y } => Self::Pinhole(FromEye {
                right: narrow(right),
                up: narrow(up),
                ahead: narrow(-back),
                x: Steps::new(x),
                y: Steps::new(y),
            }),
        }
    }
}

/// The rays of an image's pixels from the eye, unrounded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pixels {
    right: DVec3,
    up: DVec3,
    back: DVec3,
    x: Axis,
    y: Axis,
}

impl Pixels {
    pub(crate) fn of(view: &View) -> Option<Self> {
        match *view {
            View::Pinhole { right, up, back, x, y } => Some(Self { right, up, back, x, y }),
            View::Parallel { .. } => None,
        }
    }

    /// Returns the exact direction of the pixel's ray from which this unit direction differs by at most `off` roundoffs, or
    /// `None` if it belongs to no pixel.
    pub(crate) fn unrounded<E: Real>(&self, direction: DVec3, off: f64) -> Option<DVec3> {
        let ahead = -direction.dot(self.back);
        let nearest =
            |axis: Axis, at: f64| axis.at(if axis.step == 0.0 { 0.0 } else { axis.index(at).round() });
        let x = nearest(self.x, direction.dot(self.right) / ahead);
        let y = nearest(self.y, direction.dot(self.up) / ahead);
        let exact = unit(x * self.right + (y * self.up - self.back));
        (ahead > 0.0 && exact.cross(direction).length() <= off * E::ROUNDOFF).then_some(exact)
    }
}

impl<E> Rays<E> {
    /// Returns the column and the row that the others are counted from.
    pub(crate) fn anchor(&self) -> (f64, f64) {
        match self {
            Self::Pinhole(rays) => rays.anchor(),
            Self::Parallel(_) => (0.0, 0.0),
        }
    }
}

impl<E> FromEye<E> {
    /// Returns the column and the row that the others are counted from.
    #[inline(always)]
    pub(crate) fn anchor(&self) -> (f64, f64) {
        (self.x.anchor, self.y.anchor)
    }
}

impl<E: Real> Steps<E> {
    fn new(Axis { anchor, at_anchor, step, rest }: Axis) -> Self {
        let rounded = E::narrow(step);
        let rest = E::narrow(step - rounded.widen() + rest);
        Self { anchor, at_anchor: E::narrow(at_anchor), step: rounded, rest }
    }

    /// Returns the coordinates of samples, whose indices are counted from the anchor.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, index: Lanes<S, E>) -> Lanes<S, E> {
        let rest = index.fused_mul_add(splat::<S, E>(simd, self.rest), splat::<S, E>(simd, self.at_anchor));
        index.fused_mul_add(splat::<S, E>(simd, self.step), rest)
    }
}

impl<E: Real> FromEye<E> {
    /// Returns the direction of the rays of columns `i` and rows `j`.
    #[inline(always)]
    pub(crate) fn direction<S: Simd>(&self, simd: S, i: Lanes<S, E>, j: Lanes<S, E>) -> Vec3<S, E> {
        self.along(simd, i, j).normalize(simd)
    }

    /// Returns the direction scaled so that its component along the view direction is 1.
    #[inline(always)]
    pub(crate) fn along<S: Simd>(&self, simd: S, i: Lanes<S, E>, j: Lanes<S, E>) -> Vec3<S, E> {
        // The row first, because it is the same for all packets in a row.
        let row = Vec3::splat(simd, self.up).scale_add(self.y.at(simd, j), Vec3::splat(simd, self.ahead));
        Vec3::splat(simd, self.right).scale_add(self.x.at(simd, i), row)
    }
}

impl<E: Real> AlongAxis<E> {
    /// Returns the direction of all rays.
    #[inline(always)]
    pub(crate) fn direction<S: Simd>(&self, simd: S) -> Vec3<S, E> {
        let zero = E::narrow(0.0);
        Vec3::splat(simd, [zero, zero, E::narrow(-1.0)])
    }

    /// Returns the origins of the rays of columns `i` and rows `j`.
    #[inline(always)]
    pub(crate) fn origin<S: Simd>(&self, simd: S, i: Lanes<S, E>, j: Lanes<S, E>) -> Vec3<S, E> {
        let pixel = splat::<S, E>(simd, self.pixel);
        let corner = Vec3::<S, E>::splat(simd, self.corner);
        Vec3::<S, E>::new(i.fused_mul_add(pixel, corner.x), j.fused_mul_add(pixel, corner.y), corner.z)
    }
}
