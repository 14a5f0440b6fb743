//! Culls up to 64 bodies by a bit mask: a tile tests only the bodies that its rays or shadow rays can hit.
//!
//! Each packet first tests only the bounding spheres of these bodies, and the slabs of flat ones, which takes no division.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::Solid;
use crate::fast::acceleration::candidates::MASKED;
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::packet::Ray;
use crate::fast::shapes::Shape;

/// The tolerance of a bounding sphere's squared radius, in roundoffs. The squares of lengths of about 1 that are
/// compared with it have errors of some roundoffs.
const WIDER: f64 = 64.0;

/// The bounding volumes of the bodies, in the order of the bits.
#[derive(Debug)]
pub(super) struct BodyCuller<E> {
    pub(super) boxes: Vec<Shape>,
    balls: Vec<Ball<E>>,
    /// The slabs of those that are flat: few of the rays that come near the sphere of one come near it.
    slabs: Vec<Option<Slab<E>>>,
}

/// The thickness, in diameters of the bounding sphere, below which a body is flat.
const FLAT: f64 = 0.4;

/// The space between two parallel planes around a body.
#[derive(Clone, Copy, Debug)]
struct Slab<E> {
    axis: [E; 3],
    /// Half of the thickness, with the errors of heights.
    half: E,
}

#[derive(Clone, Copy, Debug)]
struct Ball<E> {
    center: [E; 3],
    square: E,
    /// The radius, with the errors of distances along a ray.
    radius: E,
}

impl<E: Real> BodyCuller<E> {
    /// Returns `None` if there are no bodies, or more than a mask has bits.
    pub(super) fn new(solids: &[Solid]) -> Option<Self> {
        if solids.is_empty() || solids.len() > MASKED {
            return None;
        }
        let boxes: Option<Vec<Shape>> =
            solids.iter().map(|solid| solid.bounds().map(Shape::of_box)).collect();
        let balls = solids.iter().map(|solid| Ball::around(solid.ball())).collect();
        let slabs = solids.iter().map(Slab::around).collect();
        Some(Self { boxes: boxes?, balls, slabs })
    }

    /// Returns the rays that come near the body of this bit before a distance.
    #[inline(always)]
    pub(super) fn are_near<S: Simd>(
        &self,
        simd: S,
        bit: usize,
        ray: Ray<S, E>,
        before: Lanes<S, E>,
    ) -> Mask<S, E> {
        let Ball { center, square, radius } = self.balls[bit];
        let to = Vec3::splat(simd, center).sub(ray.origin);
        let along = to.dot(ray.direction);
        let apart = to.dot(to) - along * along;
        let slack = to.dot(to) * constant::<S, E>(simd, WIDER * E::ROUNDOFF);
        let square = splat::<S, E>(simd, square) + slack;
        let near = apart.simd_le(square) & (along - splat::<S, E>(simd, radius)).simd_le(before);
        let Some(Slab { axis, half }) = self.slabs[bit] else { return near };
        // The heights of the ray above the middle of the slab: where it starts, and where it is nearest to the centre. On its
        // chord of the sphere it rises or falls by at most slope · √(square - apart) from there.
        let zero = constant::<S, E>(simd, 0.0);
        let axis = Vec3::splat(simd, axis);
        let (start, slope) = (zero - axis.dot(to), axis.dot(ray.direction));
        let half = splat::<S, E>(simd, half) + slack;
        let goes_away = start.abs().simd_gt(half) & (start * slope).simd_ge(zero);
        let above = (slope.mul_add(along, start).abs() - half).max(zero);
        let passes = (above * above).simd_gt(slope * slope * (square - apart) * constant::<S, E>(simd, PASSES));
        near & !goes_away & !passes
    }
}

/// A little more than 1, for the rounding errors of the squares that are compared.
const PASSES: f64 = 1.0 + 1e-6;

impl<E: Real> Slab<E> {
    /// Returns the slab of a body that is flat.
    fn around(solid: &Solid) -> Option<Self> {
        let (axis, half) = solid.slab()?;
        let (center, radius) = solid.ball();
        let slack = WIDER * E::ROUNDOFF * (1.0 + solid.extent() + center.length());
        (half < FLAT * radius)
            .then(|| Self { axis: axis.to_array().map(E::narrow), half: E::narrow(half + 2.0 * slack) })
    }
}

impl<E: Real> Ball<E> {
    fn around((center, radius): (DVec3, f64)) -> Self {
        let square = radius * radius * (1.0 + WIDER * E::ROUNDOFF);
        // The effect of the centre's rounding error.
        let shift = WIDER * E::ROUNDOFF * (center.length() * (radius + center.length()));
        let along = WIDER * E::ROUNDOFF * (1.0 + radius + center.length());
        Self {
            center: center.to_array().map(E::narrow),
            square: E::narrow(square + shift),
            radius: E::narrow(radius + along),
        }
    }
}
