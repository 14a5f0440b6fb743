//! Finds the pixels whose rays, or the rays that continue from them, come near some boxes, whatever they hit.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::placement::geometry::Geometry;
use crate::fast::rays::bounce::{Hits, PIXELS, RayBatch};
use crate::fast::rays::bounds::{Bounds, Crossing, padded};
use crate::fast::rays::packet::{Ray, no_lane};
use crate::fast::shapes::Shape;
use crate::fast::transport::hulls::{Hulls, Region};

/// Boxes, and the directions of shadow rays.
#[derive(Debug)]
pub(crate) struct Watch<E> {
    boxes: Vec<Padded<E>>,
    hulls: Hulls,
    /// The directions towards suns, and the sines of half their angles.
    suns: Vec<([E; 3], E)>,
    /// The middles and radii of lamps.
    lamps: Vec<(DVec3, f64)>,
}

/// A box in the form in which packets are tested against it, with a ball around it.
#[derive(Debug)]
struct Padded<E> {
    low: [E; 3],
    high: [E; 3],
    middle: [E; 3],
    radius: E,
}

impl<E: Real> Padded<E> {
    fn new(bounds: Bounds) -> Self {
        let (low, high) = padded(bounds);
        let middle = (0.5 * (bounds.0 + bounds.1)).to_array().map(E::narrow);
        Self { low, high, middle, radius: E::narrow(0.5 * bounds.0.distance(bounds.1)) }
    }

    /// Returns the rays from these points that can come near. The directions differ from a given one by at most an
    /// angle with this sine.
    #[inline(always)]
    fn near<S: Simd>(&self, simd: S, crossing: &Crossing<S, E>, start: Vec3<S, E>, sine: E) -> Mask<S, E> {
        let way = Vec3::splat(simd, self.middle).sub(start);
        // A ray is not farther from the middle one than this times the sine, wherever it is in the box.
        let most = way.dot(way).sqrt() + splat::<S, E>(simd, self.radius);
        let wider = most * splat::<S, E>(simd, sine);
        crossing.comes_near(simd, (self.low, self.high), wider)
    }
}

impl<E: Real> Watch<E> {
    /// Makes the watch for at most 64 boxes, given in the lengths of the scene.
    pub(crate) fn new(geometry: &Geometry, boxes: &[Bounds]) -> Self {
        let place = |at: DVec3| (at - geometry.center) * geometry.scale;
        let boxes: Vec<Bounds> = boxes.iter().map(|(low, high)| (place(*low), place(*high))).collect();
        let shapes: Vec<Shape> = boxes.iter().map(|&bounds| Shape::of_box(bounds)).collect();
        Self {
            boxes: boxes.into_iter().map(Padded::new).collect(),
            hulls: Hulls::new::<E>(shapes.iter()),
            suns: geometry
                .suns
                .iter()
                .map(|sun| {
                    let cosine = 1.0 - sun.spread;
                    // Wider by the rounding of its rays.
                    let sine = (1.0 - cosine * cosine).max(0.0).sqrt() + 64.0 * E::ROUNDOFF;
                    (sun.towards.to_array().map(E::narrow), E::narrow(sine))
                })
                .collect(),
            lamps: geometry.lamps.iter().map(|lamp| (lamp.position, lamp.radius)).collect(),
        }
    }

    /// Records for each ray of a queue whether it, or a shadow ray of its hit, comes near a box. With `EYE` the rays
    /// are those of the camera, and start at the origin; others belong to a pixel of the queue.
    #[inline(never)]
    pub(crate) fn note<S: Simd, const EYE: bool>(
        &self,
        simd: S,
        queue: &RayBatch<E>,
        hits: &Hits<E>,
        is_near: &mut [bool; PIXELS],
    ) {
        // Shadow rays start elsewhere then.
        if !hits.place[0].is_empty() || !hits.under[0].is_empty() {
            return is_near.fill(true);
        }
        simd.vectorize(
            #[inline(always)]
            || {
                let mut note = |at: usize, near: Mask<S, E>| {
                    let mut bits = near.to_bitmask();
                    while bits != 0 {
                        let lane = at + bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        // Lanes that only repeat another have no pixel.
                        let pixel = queue.pixel.0[lane];
                        if pixel.widen() >= 0.0
                            && let Some(is_near) = is_near.get_mut(pixel.to_index())
                        {
                            *is_near = true;
                        }
                    }
                };
                let far = constant::<S, E>(simd, E::FAR);
                for at in (0..queue.count).step_by(Lanes::<S, E>::LEN) {
                    let origin = if EYE { Vec3::zero(simd) } else { Vec3::load(simd, &queue.origin, at) };
                    let ray = Ray { origin, direction: Vec3::load(simd, &queue.direction, at) };
                    let crossing = Crossing::new(simd, ray);
                    let mut near = no_lane::<S, E>(simd);
                    for of in &self.boxes {
                        near |= crossing.intersects(simd, of.low, of.high, far);
                    }
                    note(at, near);
                }
                for &(at, _) in &hits.packets {
                    let start = Vec3::<S, E>::load(simd, &hits.start, at);
                    let mut near = no_lane::<S, E>(simd);
                    for &(towards, sine) in &self.suns {
                        let ray = Ray { origin: start, direction: Vec3::splat(simd, towards) };
                        let crossing = Crossing::new(simd, ray);
                        for of in &self.boxes {
                            near |= of.near(simd, &crossing, start, sine);
                        }
                    }
                    if !self.lamps.is_empty() {
                        let Vec3 { x, y, z } = start;
                        let low = [x.reduce_min(), y.reduce_min(), z.reduce_min()];
                        let high = [x.reduce_max(), y.reduce_max(), z.reduce_max()];
                        let region = Region::new(low, high);
                        let between =
                            |&(lamp, radius): &(DVec3, f64)| self.hulls.between(&region, lamp, radius) != 0;
                        if self.lamps.iter().any(between) {
                            near = !no_lane::<S, E>(simd);
                        }
                    }
                    note(at, near);
                }
            },
        );
    }
}
