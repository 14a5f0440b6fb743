//! A sun: a directional light.
//!
//! This file has the parts that only suns need: axes of its own, along which a sphere is a circle; the outlines of
//! objects on its screen; and the beam of shadow rays that start in a region, with the outlines that it hits.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};

use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant};
use crate::fast::arithmetic::rounding::{BEAM, BOUNDS};
use crate::fast::rays::placed::RenderSpaceShape;

/// A sun in the kernels' coordinates: the unit vector towards its centre, its colour, and its extent.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Direction {
    pub(in crate::fast) towards: DVec3,
    pub(in crate::fast) color: DVec3,
    /// 1 - cos of half of its angular diameter.
    pub(in crate::fast) spread: f64,
}

/// A sun as the kernels use it.
#[derive(Clone, Debug)]
pub(in crate::fast) struct Sun<E> {
    /// Orthonormal axes. The last points towards the light.
    pub(in crate::fast) axes: [[E; 3]; 3],
    pub(in crate::fast) color: [E; 3],
    /// The reciprocals of the direction's coordinates that are not zero.
    pub(in crate::fast) inverse: [Option<E>; 3],
}

impl<E: Real> Sun<E> {
    pub(in crate::fast) fn new(sun: &Direction) -> Self {
        let (x, y) = sun.towards.any_orthonormal_pair();
        Self {
            axes: [x, y, sun.towards].map(|axis| axis.to_array().map(E::narrow)),
            color: sun.color.to_array().map(E::narrow),
            inverse: sun.towards.to_array().map(|d| (d != 0.0).then(|| E::narrow(1.0 / d))),
        }
    }

    /// Returns the axes as rounded for the kernels, one per row. So both sides of a test use the same map.
    pub(in crate::fast) fn rounded(&self) -> DMat3 {
        DMat3::from_cols_array_2d(&self.axes.map(|axis| axis.map(Real::widen))).transpose()
    }

    /// Returns the unit vector towards it.
    #[inline(always)]
    pub(in crate::fast) fn towards<S: Simd>(&self, simd: S) -> Vec3<S, E> {
        Vec3::splat(simd, self.axes[2])
    }

    /// Returns a point in the sun's own axes.
    #[inline(always)]
    pub(in crate::fast) fn facing<S: Simd>(&self, simd: S, point: Vec3<S, E>) -> Vec3<S, E> {
        let [x, y, z] = self.axes;
        Vec3::<S, E>::new(
            Vec3::splat(simd, x).dot(point),
            Vec3::splat(simd, y).dot(point),
            Vec3::splat(simd, z).dot(point),
        )
    }

    /// Returns the shadow rays that start in a box, widened by the rounding errors.
    #[inline(always)]
    pub(in crate::fast) fn beam(&self, low: [E; 3], high: [E; 3]) -> Beam {
        let mut spans = [(0.0, 0.0); 3];
        let mut starts = [0.0; 3];
        for ((axis, (from, to)), nearest) in self.axes.iter().zip(&mut spans).zip(0..3) {
            let mut slack = 0.0;
            for ((direction, low), high) in axis.iter().zip(low).zip(high) {
                let (a, b) = (direction.widen() * low.widen(), direction.widen() * high.widen());
                *from += a.min(b);
                *to += a.max(b);
                // The sum over all coordinates, because the sun's axes are perpendicular only up to rounding.
                slack += low.widen().abs().max(high.widen().abs());
            }
            *from -= BEAM * E::ROUNDOFF * slack;
            *to += BEAM * E::ROUNDOFF * slack;
            let backwards = self.axes[2][nearest] < E::narrow(0.0);
            starts[nearest] = if backwards { -high[nearest].widen() } else { low[nearest].widen() };
        }
        let [x, y, z] = spans;
        Beam { low: [x.0, y.0], high: [x.1, y.1], height: z.0, starts }
    }
}

/// The shadow rays of a region: the rectangle and the smallest height on a sun's screen, and the smallest start along
/// each axis of the scene, times the sign of the direction towards the sun.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Beam {
    pub(in crate::fast) low: [f64; 2],
    pub(in crate::fast) high: [f64; 2],
    pub(in crate::fast) height: f64,
    pub(in crate::fast) starts: [f64; 3],
}

/// An object as seen from a sun: a rectangle on its screen, the height up to which it reaches towards the light, and
/// the farthest point along each axis of the scene in the light's direction, times the sign of that direction.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Outline {
    pub(in crate::fast) low: [f64; 2],
    pub(in crate::fast) high: [f64; 2],
    pub(in crate::fast) top: f64,
    pub(in crate::fast) exits: [f64; 3],
}

impl Outline {
    /// Makes an outline. `axes` are the sun's [rounded](Sun::rounded) axes.
    pub(in crate::fast) fn new<E: Real>(shape: &impl RenderSpaceShape, axes: DMat3) -> Self {
        let slack = BOUNDS * E::ROUNDOFF * shape.magnitude();
        let reach = |axis: DVec3| shape.support(axis) + 2.0 * slack;
        let [x, y] = [axes.row(0), axes.row(1)];
        let (min, max) = shape.bounds();
        // A face along the axes is exact. A ray that starts beyond it, if only by its offset, is beyond it.
        let is_exact = shape.is_its_box();
        let rounded = |x: f64| if is_exact { E::narrow(x).widen() } else { x + slack };
        let mut exits = [0.0; 3];
        for (axis, limit) in exits.iter_mut().enumerate() {
            let towards = axes.row(2)[axis];
            // A sun along one of the other two axes also shines past both sides of the object.
            let exit = if towards > 0.0 {
                max[axis]
            } else if towards < 0.0 {
                -min[axis]
            } else {
                E::FAR
            };
            *limit = rounded(exit);
        }
        Self { low: [-reach(-x), -reach(-y)], high: [reach(x), reach(y)], top: reach(axes.row(2)), exits }
    }
}

/// The outlines of few objects, as a structure of arrays, so that a packet of them is compared at once.
///
/// The columns are padded to a multiple of every packet's width. The padding overlaps no beam.
#[derive(Clone, Debug, Default)]
pub(in crate::fast) struct Outlines<E> {
    low: [Vec<E>; 2],
    high: [Vec<E>; 2],
    exits: [Vec<E>; 3],
    top: Vec<E>,
}

impl<E: Real> Outlines<E> {
    /// Makes columns of `room` rows.
    pub(in crate::fast) fn new(of: &[Outline], room: usize) -> Self {
        let column = |value: &dyn Fn(&Outline) -> f64, never: f64| {
            let mut column: Vec<E> = of.iter().map(|outline| E::narrow(value(outline))).collect();
            column.resize(room, E::narrow(never));
            column
        };
        Self {
            low: [0, 1].map(|axis| column(&|o| o.low[axis], E::FAR)),
            high: [0, 1].map(|axis| column(&|o| o.high[axis], -E::FAR)),
            exits: [0, 1, 2].map(|axis| column(&|o| o.exits[axis], -E::FAR)),
            top: column(&|o| o.top, -E::FAR),
        }
    }

    /// Returns the possible occluders of a beam, as bits.
    #[inline(always)]
    pub(in crate::fast) fn occluders<S: Simd>(&self, simd: S, beam: Beam) -> u64 {
        let (left, right) = (constant::<S, E>(simd, beam.low[0]), constant::<S, E>(simd, beam.high[0]));
        let (bottom, top) = (constant::<S, E>(simd, beam.low[1]), constant::<S, E>(simd, beam.high[1]));
        let near = constant::<S, E>(simd, beam.height);
        let [x, y, z] = beam.starts;
        let starts = Vec3::<S, E>::splat(simd, [E::narrow(x), E::narrow(y), E::narrow(z)]);
        let mut candidates = 0;
        let count = self.top.len();
        for at in (0..count).step_by(Lanes::<S, E>::LEN) {
            let overlap = load::<S, E>(simd, at, &self.low[0]).simd_le(right)
                & load::<S, E>(simd, at, &self.high[0]).simd_ge(left)
                & load::<S, E>(simd, at, &self.low[1]).simd_le(top)
                & load::<S, E>(simd, at, &self.high[1]).simd_ge(bottom)
                & load::<S, E>(simd, at, &self.top).simd_ge(near)
                & load::<S, E>(simd, at, &self.exits[0]).simd_ge(starts.x)
                & load::<S, E>(simd, at, &self.exits[1]).simd_ge(starts.y)
                & load::<S, E>(simd, at, &self.exits[2]).simd_ge(starts.z);
            candidates |= overlap.to_bitmask() << at;
        }
        candidates
    }
}

#[inline(always)]
fn load<S: Simd, E: Real>(simd: S, at: usize, from: &[E]) -> Lanes<S, E> {
    Lanes::<S, E>::from_slice(simd, &from[at..at + Lanes::<S, E>::LEN])
}
