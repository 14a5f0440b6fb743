//! Few bodies, by the bits of a word: a tile asks for those alone that its rays can meet, or that can stand in their light.
//!
//! Beside them only balls around them are looked at, packet by packet: that takes no division.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::Solid;
use crate::fast::candidates::MASKED;
use crate::fast::packet::Ray;
use crate::fast::real::{Mask, Real, Vec3, constant, splat};
use crate::fast::shapes::Shape;

/// How much wider the square of a ball's radius is than computed: the squares of lengths of about 1 that are compared with it
/// err by some roundoffs.
const WIDER: f64 = 64.0;

/// What is known to hold each of the bodies, in the order of the bits.
#[derive(Debug)]
pub(super) struct Few<E> {
    pub(super) boxes: Vec<Shape>,
    balls: Vec<Ball<E>>,
}

#[derive(Clone, Copy, Debug)]
struct Ball<E> {
    center: [E; 3],
    square: E,
}

impl<E: Real> Few<E> {
    /// None where there are too many of them, or none at all.
    pub(super) fn new(solids: &[Solid]) -> Option<Self> {
        if solids.is_empty() || solids.len() > MASKED {
            return None;
        }
        let boxes: Option<Vec<Shape>> =
            solids.iter().map(|solid| solid.bounds().map(Shape::of_box)).collect();
        let balls = solids.iter().map(|solid| Ball::around(solid.ball())).collect();
        Some(Self { boxes: boxes?, balls })
    }

    /// Which rays come near the body of this bit.
    #[inline(always)]
    pub(super) fn are_near<S: Simd>(&self, simd: S, bit: usize, ray: Ray<S, E>) -> Mask<S, E> {
        let Ball { center, square } = self.balls[bit];
        let to = Vec3::splat(simd, center).sub(ray.origin);
        let along = to.dot(ray.direction);
        let apart = to.dot(to) - along * along;
        apart.simd_le(splat::<S, E>(simd, square) + to.dot(to) * constant::<S, E>(simd, WIDER * E::ROUNDOFF))
    }
}

impl<E: Real> Ball<E> {
    fn around((center, radius): (DVec3, f64)) -> Self {
        let square = radius * radius * (1.0 + WIDER * E::ROUNDOFF);
        // What is rounded of its middle.
        let shift = WIDER * E::ROUNDOFF * (center.length() * (radius + center.length()));
        Self { center: center.to_array().map(E::narrow), square: E::narrow(square + shift) }
    }
}
