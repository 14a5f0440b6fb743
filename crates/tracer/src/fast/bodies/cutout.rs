//! Triangles with holes: faces of models whose alpha is below a cutoff in some places, where they have no hits.
//!
//! Rays hit them by the same test as all triangles. In each lane with a hit the alpha is looked up, with the function
//! of the reference tracer. They are bodies, so they are found separately from triangles without holes, whose code is
//! the same with and without them.

use std::sync::Arc;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use super::solid::{Form, Frame, Solid};
use super::{AnyForm, OFFSET};
use crate::fast::arithmetic::exact::Edge;
use crate::fast::arithmetic::real::{Lanes, Real, constant};
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::packet::{Nearest, Ray, Surface};
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::rays::predicate::{Beside, Corners};
use crate::fast::shapes::shape::{Precalculations, Robust, Tests};
use crate::fast::shapes::triangle::{RenderSpaceTriangle, Triangle};
use crate::fast::shared::surface::{self, Flat, Plain};
use crate::meshes::Faces;

/// The holes of the faces of a scene, in the kernels' coordinates.
#[derive(Debug)]
pub(in crate::fast) struct Holes {
    pub(in crate::fast) faces: Arc<Faces>,
    /// A point p of the scene is at `(p - center) * scale`.
    pub(in crate::fast) center: DVec3,
    pub(in crate::fast) scale: f64,
}

/// A triangle with holes, as the kernels use it.
#[derive(Debug)]
pub(super) struct Cutout<E> {
    triangle: Triangle<E>,
    corners: Alone,
    order: usize,
    holes: Arc<Holes>,
}

/// The corners of a triangle whose neighbours are not known. A ray that passes beside it within the rounding errors
/// hits it, so that there is no gap to any neighbour.
#[derive(Debug)]
struct Alone([DVec3; 3]);

impl Corners for Alone {
    fn of(&self, _: usize) -> [DVec3; 3] {
        self.0
    }

    fn any_across(&self, _: usize, _: Edge, _: &dyn Fn(DVec3) -> bool) -> bool {
        false
    }

    fn unrounded(&self, _: DVec3) -> Option<DVec3> {
        None
    }

    fn gone_on(&self, _: DVec3, _: DVec3, _: Beside) -> Option<(DVec3, DVec3)> {
        None
    }
}

impl<E: Real> Cutout<E> {
    pub(super) fn new(form: CutoutForm, order: u32, holes: Arc<Holes>) -> Self {
        let triangle = Triangle::new(&form.triangle, order);
        Self { triangle, corners: Alone(form.triangle.vertices), order: order as usize, holes }
    }

    /// Offers the hits of the rays outside of its holes.
    #[inline(never)]
    pub(super) fn intersect<S: Simd>(&self, simd: S, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut found = Nearest::none(simd);
                let aimed = <Triangle<E> as Precalculations<E>>::aim(simd, ray);
                let place = (&self.corners as &dyn Corners, 0);
                <Robust as Tests<Triangle<E>, E>>::intersect::<S, false>(
                    simd,
                    &self.triangle,
                    place,
                    ray,
                    aimed,
                    &mut found,
                );
                let hit = found.hit(simd) & found.distance.simd_le(nearest.distance);
                let mut rest = hit.to_bitmask();
                if rest == 0 {
                    return;
                }
                let point = ray.direction.scale_add(found.distance, ray.origin);
                let mut seen = [E::narrow(0.0); 16];
                while rest != 0 {
                    let lane = rest.trailing_zeros() as usize;
                    rest &= rest - 1;
                    let point =
                        DVec3::new(point.x[lane].widen(), point.y[lane].widen(), point.z[lane].widen());
                    let Holes { faces, center, scale } = &*self.holes;
                    if !faces.is_hole(self.order, point, (*center, *scale)) {
                        seen[lane] = E::narrow(1.0);
                    }
                }
                let seen = Lanes::<S, E>::from_slice(simd, &seen[..Lanes::<S, E>::LEN]);
                let seen = hit & seen.simd_gt(constant::<S, E>(simd, 0.0));
                nearest.offer(simd, seen, found.distance, self.triangle.facet.order);
            },
        );
    }

    /// Returns the surface at the hits of the rays.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Ray<S, E>, distance: Lanes<S, E>) -> Surface<S, E> {
        <Robust as Tests<Triangle<E>, E>>::surface::<S, false>(simd, &self.triangle, ray, distance)
    }
}

/// A triangle with holes in its frame, whose last axis is its normal and whose centre is the middle of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct CutoutForm {
    pub(super) triangle: RenderSpaceTriangle,
    radius: f64,
}

/// Returns a triangle with holes. `order` is its position in the script.
pub(in crate::fast) fn cutout(triangle: RenderSpaceTriangle, order: u32) -> Solid {
    let [a, b, c] = triangle.vertices;
    let center = (a + b + c) / 3.0;
    let radius = triangle.vertices.iter().map(|v| v.distance(center)).fold(0.0, f64::max);
    let frame = Frame::round_about(triangle.normal, center);
    Solid::new(frame, AnyForm::Cutout(CutoutForm { triangle, radius }), order)
}

impl Form for CutoutForm {
    fn size(&self) -> f64 {
        self.radius
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(surface::Surface)) {
        let RenderSpaceTriangle { normal, height, .. } = self.triangle;
        let plain = Plain::Triangle;
        each(surface::Surface::Flat(Flat {
            normal,
            height,
            center: frame.center,
            radius: self.radius,
            plain,
        }));
    }

    fn is_near(&self, place: DVec3, near: f64, is_slanted: bool) -> bool {
        is_slanted && place.z.abs() <= near && libm::hypot(place.x, place.y) <= self.radius + near
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (frame.center, self.radius * (1.0 + OFFSET * f64::EPSILON))
    }

    fn bounds(&self, _: &Frame) -> Option<Bounds> {
        Some(self.triangle.bounds())
    }
}
