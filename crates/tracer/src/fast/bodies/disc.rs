//! Discs: the points of a plane within a radius. The rim belongs to the disc.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::model::unit;

use super::Local;
use super::solid::{Form, Frame, Place, Span, flat};
use crate::fast::acceleration::hollow::Hollow;
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, constant, splat};
use crate::fast::bodies::plane;
use crate::fast::rays::bounds::Bounds;
use crate::fast::shared::{Plain, Surface};

/// The tolerance of the squared radius at the rim, in roundoffs of the square. The hit point has one roundoff of each
/// of two products and sums along the ray, and so has its square.
const RIM: f64 = 8.0;

/// A disc centred at the origin, perpendicular to z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc<E> {
    /// r², widened by the tolerance of the rim.
    square: E,
}

impl<E: Real> Disc<E> {
    pub(super) fn new(radius: f64) -> Self {
        Self { square: E::narrow(radius * radius * (1.0 + RIM * E::ROUNDOFF)) }
    }

    #[inline(always)]
    pub(super) fn intersect<S: Simd>(&self, simd: S, ray: Local<S, E>) -> (Mask<S, E>, Lanes<S, E>) {
        let (hit, distance) = plane::along(simd, ray);
        let distance = hit.select(distance, constant::<S, E>(simd, 0.0));
        let place = ray.direction.scale_add(distance, ray.origin);
        let apart = place.x.fused_mul_add(place.x, place.y * place.y);
        (hit & apart.simd_le(splat::<S, E>(simd, self.square)), distance)
    }
}

/// A disc in its frame, perpendicular to the last axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct DiscForm {
    pub(super) radius: f64,
}

impl DiscForm {
    pub(super) fn new(disc: &rayfold_scene::Disc, place: Place) -> (Frame, Self) {
        let frame = Frame::round_about(unit(disc.normal()), place.point(disc.center()));
        (frame, Self { radius: place.scale * disc.radius() })
    }
}

/// The radius of the ball above a disc, as a part of the distance of the eye from its plane.
const OVER_DISC: f64 = 1.5;

impl Form for DiscForm {
    fn size(&self) -> f64 {
        self.radius
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface)) {
        each(flat(frame.axes[2], frame.center, self.radius, Plain::ByAxis));
    }

    fn is_near(&self, place: DVec3, near: f64, is_slanted: bool) -> bool {
        is_slanted && place.z.abs() <= near && libm::hypot(place.x, place.y) <= self.radius + near
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (frame.center, self.radius)
    }

    fn bounds(&self, frame: &Frame) -> Option<Bounds> {
        let reach = self.radius * frame.circle();
        Some((frame.center - reach, frame.center + reach))
    }

    fn slab(&self, frame: &Frame) -> Option<Span> {
        Some(Span::across(frame, 0.0, 0.0))
    }

    fn hollow(&self, &Frame { axes: [.., axis], center }: &Frame) -> Option<Hollow> {
        // Above the side that the eye sees, and not much larger than needed to hold it, so that balls of many discs
        // have much in common.
        let radius = OVER_DISC * axis.dot(center).abs();
        let up = if axis.dot(center) > 0.0 { -axis } else { axis };
        Some((center + radius * up, radius))
    }
}
