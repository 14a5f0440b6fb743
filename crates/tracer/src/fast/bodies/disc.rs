//! Discs: what is within their radius of a plane, the rim with it.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::{Local, plane};
use crate::fast::real::{Lanes, Mask, Real, constant, splat};

/// How much farther than the radius the rim may be met, in roundoffs of the square: the place has one of each of two
/// products and sums along the ray, and so has its square.
const RIM: f64 = 8.0;

/// A disc around the origin, square to z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc<E> {
    /// r², with room for the rim.
    square: E,
}

impl<E: Real> Disc<E> {
    pub(super) fn new(radius: f64) -> Self {
        Self { square: E::narrow(radius * radius * (1.0 + RIM * E::ROUNDOFF)) }
    }

    #[inline(always)]
    pub(super) fn meet<S: Simd>(&self, simd: S, ray: Local<S, E>) -> (Mask<S, E>, Lanes<S, E>) {
        let (hit, distance) = plane::along(simd, ray);
        let distance = hit.select(distance, constant::<S, E>(simd, 0.0));
        let place = ray.direction.scale_add(distance, ray.origin);
        let apart = place.x.mul_add(place.x, place.y * place.y);
        (hit & apart.simd_le(splat::<S, E>(simd, self.square)), distance)
    }
}
