//! Errors that grow with each reflection.

use anyhow::Result;
use glam::DVec3;
use rayfold_scene::{Material, Object, Sphere};

use super::figures::{Figures, Size, worse};
use super::setup::{objects_only, random};
use crate::backends::{Backend, Ray};
use crate::oracle::{self, Real, Vector};
use crate::scenes::single;

/// The number of reflections that are traced.
const BOUNCES: usize = 5;

/// Returns the direction after the last bounce, without rounding errors.
fn exact(objects: &[Object], origin: &Vector, direction: &Vector) -> Option<Vector> {
    let (mut origin, mut direction) = (origin.clone(), direction.unit());
    for _ in 0..BOUNCES {
        let hit = oracle::nearest_beyond(objects, &origin, &direction, &Real::from(1e-60))?;
        origin = origin.plus(&hit.t, &direction);
        direction = oracle::reflected(&direction, &hit.normal).unit();
    }
    Some(direction)
}

/// Measures rays nearly along the axis between a sphere and one a hundred times larger. The error of the last direction
/// is divided by the growth of a small change of the first direction or position.
pub(super) fn face_to_face(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let surface = Material::new(DVec3::ZERO, DVec3::ZERO, DVec3::ONE)?;
    let objects = [
        Object::Sphere(Sphere::new(100.0, DVec3::new(0.0, 0.0, -101.0), surface.clone())?),
        Object::Sphere(Sphere::new(1.0, DVec3::new(0.0, 0.0, 2.0), surface)?),
    ];
    let scene = objects_only(objects.to_vec())?;
    let mut rng = random(23);
    let mut starts = Vec::new();
    for _ in 0..size.pick(20, 1000) {
        let mut small = || (rng.f64() - 0.5) * 2e-3;
        let origin = single(DVec3::new(small(), small(), 0.0));
        let direction = single(DVec3::new(small(), small(), -1.0));
        let (from, towards) = (Vector::from(origin), Vector::from(direction));
        let Some(last) = exact(&objects, &from, &towards) else { continue };
        let nudge = 2f64.powi(-100);
        let mut growth = 0f64;
        for axis in [DVec3::X, DVec3::Y] {
            let step = Vector::from(axis);
            let nudged = [
                exact(&objects, &from.plus(&Real::from(nudge), &step), &towards),
                exact(&objects, &from, &towards.plus(&Real::from(nudge), &step)),
            ];
            for other in nudged.into_iter().flatten() {
                growth = growth.max(other.minus(&last).to_dvec3().length() / nudge);
            }
        }
        starts.push((Ray { origin, direction }, last.to_dvec3(), growth));
    }
    anyhow::ensure!(starts.len() >= size.pick(15, 500), "rays leave the mirrors early");
    for backend in backends {
        let mut worst = 0f64;
        for (start, last, growth) in &starts {
            let mut ray = *start;
            for _ in 0..BOUNCES {
                let Some(hit) = backend.nearest(&scene, &[ray])?[0] else {
                    ray.direction = DVec3::NAN;
                    break;
                };
                let point = ray.origin + hit.t * ray.direction;
                let mirrored = ray.direction - 2.0 * ray.direction.dot(hit.normal) * hit.normal;
                // Starts away from the surface by the uncertainty of the hit.
                let origin = point + 4.0 * backend.ulp(100.0) * hit.normal;
                ray = Ray { origin, direction: mirrored.normalize() };
            }
            worst = worse(worst, (ray.direction - last).length() / growth);
        }
        let grown = starts.iter().map(|(_, _, growth)| *growth).fold(0.0, f64::max);
        figures.add(
            backend,
            format!("direction after {BOUNCES} bounces, over its growth of {grown:.0}"),
            starts.len(),
            worst,
            1e-4,
        );
    }
    Ok(())
}
