//! What few surfaces have beyond coefficients: highlights, and patterns of other coefficients.
//!
//! Both are worked out lane by lane, with the functions of the plain tracer: they are powers and lattices of few pixels,
//! which must be the same bytes everywhere. Patterns are read off the numbers of the script, so that a hit is taken back
//! to where the script has it.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Coefficients, Object, Scene};

use super::bounce::{Column, Hits, Queue, ROOM};
use super::geometry::Geometry;
use super::packet::Ray;
use super::real::{Lanes, Mask, Real, Vec3, constant};
use crate::reference::{self, coefficients, highlight};

/// The surfaces of a scene that has some of these.
#[derive(Debug)]
pub(super) struct Finishes {
    scene: Scene,
    center: DVec3,
    scale: f64,
    pub(super) has_patterns: bool,
    pub(super) has_highlights: bool,
}

/// The highlights of a packet of hits.
pub(super) struct Gloss<'a> {
    finishes: &'a Finishes,
    sum: [DVec3; 16],
    /// Whether any light adds something.
    pub(super) is_seen: bool,
}

/// A cap's normal is the axis; those of a side are farther from it than this.
const CAP: f64 = 1.0 - 1e-12;

impl Finishes {
    /// None if no object has any.
    pub(super) fn new(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        let finishes = || scene.objects.iter().filter_map(|object| object.material().finish());
        finishes().next()?;
        let has_patterns = finishes().any(|finish| finish.pattern.is_some());
        let has_highlights = finishes().any(|finish| finish.shine.is_some());
        let (center, scale) = (geometry.center, geometry.scale);
        Some(Self { scene: scene.clone(), center, scale, has_patterns, has_highlights })
    }

    /// Mixes the coefficients of patterns into the colours and diffuse coefficients of the hits, and notes the mirror
    /// coefficients of all; `EYE` says that the rays count for 1.
    #[inline(never)]
    pub(super) fn paint<E: Real, const EYE: bool>(&self, queue: &Queue<E>, hits: &mut Hits<E>, lanes: usize) {
        for column in &mut hits.mirror {
            column.resize(ROOM, E::narrow(0.0));
        }
        for &(at, _) in &hits.packets {
            for lane in at..at + lanes {
                if hits.distance.0[lane].widen() >= E::narrow(E::FAR).widen() {
                    continue;
                }
                let order = hits.order.0[lane].to_index();
                let read = |columns: &[Column<E>; 3]| {
                    DVec3::new(
                        columns[0].0[lane].widen(),
                        columns[1].0[lane].widen(),
                        columns[2].0[lane].widen(),
                    )
                };
                let weight = if EYE { DVec3::ONE } else { read(&queue.weight) };
                let material = self.scene.objects[order].material();
                let is_painted = material.finish().is_some_and(|finish| finish.pattern.is_some());
                let seen = if is_painted {
                    let origin = if EYE { DVec3::ZERO } else { read(&queue.origin) };
                    let ray = (origin, read(&queue.direction));
                    self.coefficients_at(order, ray, (read(&hits.start), read(&hits.normal)))
                } else {
                    material.coefficients()
                };
                if is_painted {
                    write(&mut hits.color, lane, seen.ambient() * weight);
                    write(&mut hits.diffuse, lane, seen.diffuse() * weight);
                }
                write(&mut hits.mirror, lane, seen.mirror() * weight);
            }
        }
    }

    /// Along an axis to which the ray is square a hit lies where the ray starts, so that walls between cells are met where
    /// they are.
    fn coefficients_at(
        &self,
        order: usize,
        (origin, direction): (DVec3, DVec3),
        (start, normal): (DVec3, DVec3),
    ) -> Coefficients {
        let place = DVec3::select(direction.cmpeq(DVec3::ZERO), origin, start);
        let world = place / self.scale + self.center;
        let (object, place, normal) = match &self.scene.objects[order] {
            Object::Instance(instance) => {
                let placement = instance.placement();
                let normal = placement.rotation().transpose() * normal;
                (instance.object(), placement.local_point(world), normal)
            }
            object => (object, world, normal),
        };
        let flat = is_flat(object, normal);
        let surface = reference::Surface { point: world, normal, offset: 0.0, flat, within: false };
        coefficients(object, place, normal, &surface)
    }

    /// Which lanes meet a surface with highlights; `orders` are those of what they meet.
    #[inline(always)]
    pub(super) fn shines<S: Simd, E: Real>(&self, simd: S, orders: &[E]) -> Mask<S, E> {
        let mut shines = [E::narrow(0.0); 16];
        for (lane, order) in orders.iter().enumerate() {
            let object = self.scene.objects.get(order.to_index());
            let finish = object.and_then(|object| object.material().finish());
            if finish.is_some_and(|finish| finish.shine.is_some()) {
                shines[lane] = E::narrow(1.0);
            }
        }
        let shines = Lanes::<S, E>::from_slice(simd, &shines[..Lanes::<S, E>::LEN]);
        shines.simd_gt(constant::<S, E>(simd, 0.0))
    }

    pub(super) fn gloss(&self) -> Gloss<'_> {
        Gloss { finishes: self, sum: [DVec3::ZERO; 16], is_seen: false }
    }
}

fn write<E: Real>(columns: &mut [impl AsMut<[E]>; 3], lane: usize, color: DVec3) {
    for (column, value) in columns.iter_mut().zip(color.to_array()) {
        column.as_mut()[lane] = E::narrow(value);
    }
}

/// Whether a place of the surface with this normal lies on a face or a cap.
fn is_flat(object: &Object, normal: DVec3) -> bool {
    match object {
        Object::Sphere(_) | Object::Torus(_) | Object::Instance(_) => false,
        Object::Triangle(_) | Object::Cuboid(_) | Object::Plane(_) | Object::Disc(_) => true,
        Object::Cylinder(o) => is_cap(o.ends(), normal),
        Object::Cone(o) => is_cap(o.ends(), normal),
    }
}

fn is_cap([a, b]: [DVec3; 2], normal: DVec3) -> bool {
    unit(b - a).dot(normal).abs() > CAP
}

/// A surface in a light.
#[derive(Clone, Copy)]
pub(super) struct Lit<S: Simd, E: Real> {
    /// Which lanes it reaches.
    pub(super) lanes: Mask<S, E>,
    /// The unit vector towards it.
    pub(super) towards: Vec3<S, E>,
    /// What arrives of its colour.
    pub(super) color: Vec3<S, E>,
}

impl Gloss<'_> {
    /// Adds the highlights of a light; `ray` are the rays that see them, `orders` what they meet.
    #[inline(never)]
    pub(super) fn add<S: Simd, E: Real>(
        &mut self,
        Lit { lanes, towards, color }: Lit<S, E>,
        (ray, normal): (Ray<S, E>, Vec3<S, E>),
        orders: &[E],
    ) {
        let mut bits = lanes.to_bitmask();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let material = self.finishes.scene.objects[orders[lane].to_index()].material();
            let Some(shine) = material.finish().and_then(|finish| finish.shine) else { continue };
            let at = |v: Vec3<S, E>| DVec3::new(v.x[lane].widen(), v.y[lane].widen(), v.z[lane].widen());
            let seen = highlight(&shine, at(normal), at(towards), -at(ray.direction));
            self.sum[lane] += at(color) * shine.color() * seen;
            self.is_seen = true;
        }
    }

    /// The sum of all highlights.
    #[inline(always)]
    pub(super) fn sum<S: Simd, E: Real>(&self, simd: S) -> Vec3<S, E> {
        let mut columns = [[E::narrow(0.0); 16]; 3];
        for (lane, color) in self.sum.iter().enumerate() {
            for (column, channel) in columns.iter_mut().zip(color.to_array()) {
                column[lane] = E::narrow(channel);
            }
        }
        Vec3::load(simd, &columns, 0)
    }
}
