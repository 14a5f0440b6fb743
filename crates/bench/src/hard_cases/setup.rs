//! Shared parts of the hard cases: random numbers, scenes for given rays, and the true hit of a ray.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Camera, Object, Scene, Screen};

use super::SEED;
use crate::backends::{Backend, Hit, Ray};
use crate::oracle;
use crate::scenes::{looking_at, single};

/// Returns the random number generator of a case.
pub(super) fn random(case: u64) -> fastrand::Rng {
    fastrand::Rng::with_seed(SEED.wrapping_mul(1000) + case)
}

/// Returns a point of the unit sphere.
pub(super) fn direction(rng: &mut fastrand::Rng) -> DVec3 {
    loop {
        let v = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        if (0.01..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// Returns a scene of objects alone, for given rays.
pub(super) fn objects_only(objects: Vec<Object>) -> Result<Scene> {
    let mut scene = Scene::new(Screen::new(1, 1)?, Camera::Orthographic);
    scene.objects = objects.into();
    Ok(scene)
}

/// Returns the nearest hits of rays on an object. A camera stands at the origin of each ray, so that the rays are
/// camera rays.
pub(super) fn from_eyes(backend: &Backend, object: Object, rays: &[Ray]) -> Result<Vec<Option<Hit>>> {
    let mut hits = Vec::new();
    for rays in rays.chunk_by(|a, b| a.origin == b.origin) {
        let eye = rays[0].origin;
        let scene = objects_seen(vec![object.clone()], eye, eye + DVec3::new(0.3, 0.2, -1.0), 1.0)?;
        hits.extend(backend.nearest(&scene, rays)?);
    }
    Ok(hits)
}

/// Returns a scene of objects, for given rays. The camera at `eye` sees `width` per unit of distance; it matters
/// because the choice of the precision depends on the entire scene.
pub(super) fn objects_seen(objects: Vec<Object>, eye: DVec3, target: DVec3, width: f64) -> Result<Scene> {
    let mut scene = objects_only(objects)?;
    scene.screen = Screen::new(1000, 1000)?;
    scene.camera = looking_at(eye, target, width, scene.screen)?;
    Ok(scene)
}

/// Returns a ray from `origin` towards `target`, rounded to `f32`, approximately of unit length.
pub(super) fn aimed(origin: DVec3, target: DVec3) -> Ray {
    let origin = single(origin);
    Ray { origin, direction: single((target - origin).normalize()) }
}

/// The true hit of a ray: its distance in units of the length of the direction, and its normal.
pub(super) struct Truth {
    pub(super) t: f64,
    pub(super) normal: DVec3,
}

pub(super) fn truths(objects: &[Object], rays: &[Ray]) -> Vec<Option<Truth>> {
    rays.iter()
        .map(|ray| {
            let hit = oracle::nearest(objects, ray.origin, ray.direction)?;
            Some(Truth { t: hit.t.to_f64(), normal: hit.normal.to_dvec3() })
        })
        .collect()
}
