//! Traces single rays with the kernels that draw pictures, and computes fingerprints of pictures.
//!
//! Hard cases need rays that no camera sends. Here they can be traced one by one, with any kernel.

use std::sync::Arc;

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd};
use glam::DVec3;
use rayfold_scene::{Scene, Script};

use super::bodies::ANY;
use super::has_kernels;
use crate::fast::arithmetic::dispatch::on;
use crate::fast::arithmetic::real::{Lanes, Real, Vec3};
use crate::fast::arithmetic::rounding::MARGIN;
use crate::fast::build::extensions::Extensions;
use crate::fast::build::features::{Anything, Everything};
use crate::fast::build::precision::resolve;
use crate::fast::build::prepare::Prepared;
use crate::fast::build::ties::Ranked;
use crate::fast::placement::geometry::Geometry;
use crate::fast::placement::window::Grid;
use crate::fast::rays::packet::Ray;
use crate::fast::shapes::shape::Robust;
use crate::fast::transport::search::nearest;
use crate::fast::transport::surfaces::surface;
use crate::meshes::{Faces, Shared};
use crate::{Precision, RenderError, RenderOptions, picture_of_frame};

/// The start value of a fingerprint, and the factor of each step.
///
/// Source: Fowler, Noll and Vo, FNV-1a with 64 bits.
const FNV: (u64, u64) = (0xcbf2_9ce4_8422_2325, 0x0100_0000_01b3);

/// Returns a fingerprint of the pictures of the first and of the middle frame of a script. It is the same on every
/// machine, as the pictures are.
///
/// # Errors
/// The errors of [`crate::render`].
pub fn fingerprint(script: &Script, options: &RenderOptions) -> Result<u64, RenderError> {
    let pictures = [0, script.frame_count() / 2]
        .into_iter()
        .filter_map(|frame| picture_of_frame(script, frame, options))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(hash(pictures.iter().flat_map(|picture| picture.as_bytes().iter().copied())))
}

/// Returns a fingerprint of bytes. It is the same on every machine.
pub fn hash(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(FNV.0, |number, byte| (number ^ u64::from(byte)).wrapping_mul(FNV.1))
}

/// The first hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Position of the object in the script, from 0.
    pub object: usize,
    /// Distance from the ray's origin in world units.
    pub distance: f64,
    /// Unit normal on the side that the ray came from.
    pub normal: DVec3,
}

/// Returns the nearest hit of each ray, `(origin, direction)` with a direction of length 1.
///
/// Rays whose origin is the camera's eye are traced as camera rays of a picture are.
///
/// # Errors
/// The errors of [`crate::render`].
pub fn nearest_hits(
    scene: &Scene,
    rays: &[(DVec3, DVec3)],
    options: &RenderOptions,
) -> Result<Vec<Option<Found>>, RenderError> {
    let one_by_one =
        || rays.iter().map(|&(origin, direction)| one_by_one(scene, origin, direction)).collect();
    let ranked = &Ranked::new(scene, Shared::by(options));
    let geometry = Geometry::with_faces(&ranked.scene, ranked.faces.as_ref(), options.tree)?;
    match resolve(options, &geometry, &ranked.scene) {
        Some(Precision::F64) => {
            let geometry = geometry.with_shared_planes(&ranked.scene).with_shared_surfaces(&ranked.scene);
            probe::<f64>(ranked, &geometry, rays, options, in_double)
        }
        Some(_) => {
            let geometry = geometry.with_shared_surfaces_if_single(&ranked.scene, options);
            probe::<f32>(ranked, &geometry, rays, options, |batch, level, out| {
                on!(level, simd => batch.nearest(simd, out));
            })
        }
        None => Ok(one_by_one()),
    }
}

/// The kernels in double precision. They are compiled in this module alone.
fn in_double(batch: &Batch<f64>, level: Level, out: &mut Vec<Option<Found>>) {
    on!(level, simd => batch.nearest(simd, out));
}

/// Finds the first objects along rays, for many rays, in double precision.
pub(crate) struct Finder<'a> {
    ranked: Ranked<'a>,
    geometry: Geometry,
    prepared: Prepared<f64>,
    level: Level,
}

impl<'a> Finder<'a> {
    /// Prepares a scene. Returns `None` if no kernel can hold its numbers.
    ///
    /// # Errors
    /// The errors of [`crate::render`].
    pub(crate) fn new(scene: &'a Scene, options: &RenderOptions<'a>) -> Result<Option<Self>, RenderError> {
        let ranked = Ranked::new(scene, Shared::NONE);
        let geometry = || Geometry::with_faces(&ranked.scene, ranked.faces.as_ref(), options.tree).ok();
        let geometry = if has_kernels(options) { geometry() } else { None };
        let in_double = RenderOptions { precision: Precision::F64, ..*options };
        let can_hold = |geometry: &Geometry| resolve(&in_double, geometry, &ranked.scene).is_some();
        let Some(geometry) = geometry.filter(can_hold) else { return Ok(None) };
        let geometry = geometry.with_shared_planes(&ranked.scene).with_shared_surfaces(&ranked.scene);
        let prepared = Prepared::new(&ranked.scene, &geometry, options.tree, &GRID)?;
        Ok(Some(Self { ranked, geometry, prepared, level: options.level.unwrap_or_else(Level::new) }))
    }

    /// Returns the scene without meshes, in the order of its objects, and the faces of meshes among its triangles.
    pub(crate) fn scene(&self) -> (&Scene, Option<Arc<Faces>>) {
        (&self.ranked.scene, self.ranked.faces.clone())
    }

    /// Returns the position in the script of the object at `order`.
    pub(crate) fn in_script(&self, order: usize) -> usize {
        self.ranked.in_script(order)
    }

    /// Replaces `found` by the first hit of each ray, `(origin, direction)` with a direction of length 1.
    pub(crate) fn nearest(&self, rays: &[(DVec3, DVec3)], found: &mut Vec<Option<Found>>) {
        found.clear();
        in_double(&Batch { scene: &self.prepared, geometry: &self.geometry, rays }, self.level, found);
    }
}

/// Traces the rays as pictures are traced whose features or numbers no kernel supports.
fn one_by_one(scene: &Scene, origin: DVec3, direction: DVec3) -> Option<Found> {
    let hit = crate::reference::nearest(&scene.objects, origin, direction)?;
    Some(Found { object: hit.object, distance: hit.distance, normal: hit.surface.normal })
}

/// The tiles of rays that belong to no image.
const GRID: Grid = Grid { size: (16, 16), side: (16, 16), margin: MARGIN, lens: None };

struct Batch<'a, E> {
    scene: &'a Prepared<E>,
    geometry: &'a Geometry,
    rays: &'a [(DVec3, DVec3)],
}

fn probe<E: Real>(
    ranked: &Ranked,
    geometry: &Geometry,
    rays: &[(DVec3, DVec3)],
    options: &RenderOptions,
    run: impl Fn(&Batch<E>, Level, &mut Vec<Option<Found>>),
) -> Result<Vec<Option<Found>>, RenderError> {
    let prepared = Prepared::<E>::new(&ranked.scene, geometry, options.tree, &GRID)?;
    let mut out = Vec::with_capacity(rays.len());
    run(&Batch { scene: &prepared, geometry, rays }, options.level.unwrap_or_else(Level::new), &mut out);
    for found in out.iter_mut().flatten() {
        found.object = ranked.in_script(found.object);
    }
    Ok(out)
}

impl<E: Real> Batch<'_, E> {
    #[inline(always)]
    fn packets<S: Simd>(&self, simd: S, mut each: impl FnMut(Ray<S, E>, bool, usize)) {
        for rays in self.rays.chunks(Lanes::<S, E>::LEN) {
            let (mut origins, mut directions) = ([[E::narrow(0.0); 16]; 3], [[E::narrow(0.0); 16]; 3]);
            for lane in 0..Lanes::<S, E>::LEN {
                let (origin, direction) = rays[lane.min(rays.len() - 1)];
                let origin = (origin - self.geometry.center) * self.geometry.scale;
                for axis in 0..3 {
                    origins[axis][lane] = E::narrow(origin[axis]);
                    directions[axis][lane] = E::narrow(direction[axis]);
                }
            }
            let ray = Ray {
                origin: Vec3::<S, E>::load(simd, &origins, 0),
                direction: Vec3::<S, E>::load(simd, &directions, 0),
            };
            let from_eye = rays.iter().all(|(origin, _)| *origin == self.geometry.center);
            each(ray, from_eye, rays.len());
        }
    }

    #[inline(always)]
    fn nearest<S: Simd>(&self, simd: S, out: &mut Vec<Option<Found>>) {
        self.packets(
            simd,
            #[inline(always)]
            |ray, from_eye, count| {
                let mut found = if from_eye {
                    nearest::<S, E, Everything<Robust>, true>(simd, self.scene, ray, self.scene.all())
                } else {
                    nearest::<S, E, Everything<Robust>, false>(simd, self.scene, ray, self.scene.all())
                };
                if let Some(bodies) = self.scene.beyond.as_ref().and_then(Extensions::bodies) {
                    bodies.intersect(simd, ANY, ray, &mut found);
                }
                match &self.scene.shared {
                    Some(shared) if from_eye => {
                        shared.settle::<S, E, Anything<Robust>, true>(simd, self.scene, ray, &mut found);
                    }
                    Some(shared) => {
                        shared.settle::<S, E, Anything<Robust>, false>(simd, self.scene, ray, &mut found);
                    }
                    None => {}
                }
                let hit = found.hit(simd).to_bitmask();
                let mut normals = [DVec3::ZERO; 16];
                let mut remaining = hit;
                while remaining != 0 {
                    let order = found.order[remaining.trailing_zeros() as usize];
                    let object = (&self.scene.entries[order.to_index()], order);
                    let normal = if from_eye {
                        surface::<S, E, Anything<Robust>, true>(simd, self.scene, object, ray, found.distance)
                            .normal
                    } else {
                        surface::<S, E, Anything<Robust>, false>(
                            simd,
                            self.scene,
                            object,
                            ray,
                            found.distance,
                        )
                        .normal
                    };
                    for (lane, known) in normals.iter_mut().enumerate().take(Lanes::<S, E>::LEN) {
                        if found.order[lane] == order {
                            *known = DVec3::new(
                                normal.x[lane].widen(),
                                normal.y[lane].widen(),
                                normal.z[lane].widen(),
                            );
                            remaining &= !(1 << lane);
                        }
                    }
                }
                for (lane, normal) in normals.into_iter().enumerate().take(count) {
                    out.push((hit >> lane & 1 != 0).then(|| Found {
                        object: found.order[lane].to_index(),
                        distance: found.distance[lane].widen() / self.geometry.scale,
                        normal,
                    }));
                }
            },
        );
    }
}
