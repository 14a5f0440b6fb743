//! Whether single precision is enough for a scene.
//!
//! Bounds on the rounding errors of the `f32` kernels are set against the size of a pixel: what moves an outline or a
//! shadow by less than a small part of a pixel cannot be seen. Triangles and boxes need no bound of their own: their
//! errors are relative to the distance of what is seen, as those of the directions are.

use super::geometry::{Geometry, Shape, Solid, View};
use super::real::Real;
use crate::Precision;

/// Rounding errors that add up in a ray's direction, in roundoffs.
const DIRECTION: f64 = 3.0;

/// Rounding errors that add up in a point on a sphere, in roundoffs of its distance and radius.
const POINT: f64 = 2.0;

/// The part of a pixel that nothing may move by.
const INVISIBLE: f64 = 0.05;

/// The part of a pixel that shadows and mirrored outlines may move by.
const HARDLY_VISIBLE: f64 = 0.2;

/// The error of a normal, as a sine, that stays below a quarter of a level.
const SHADE: f64 = 1e-3;

/// A sphere this much smaller than the scene has a square that single precision cannot hold.
const SMALLEST: f64 = 1e-15;

pub(super) fn choose(geometry: &Geometry, size: (u32, u32)) -> Precision {
    let roundoff = <f32 as Real>::ROUNDOFF;
    // Pixels per unit: an angle from the eye, a length in parallel projection.
    let pixel = match geometry.view {
        View::Parallel { pixel, .. } => pixel,
        View::Pinhole { x, y, .. } => {
            let widest = |(start, step): (f64, f64), samples: u32| {
                let end = start + step * f64::from(samples - 1);
                start.abs().max(end.abs())
            };
            let (across, along) = (widest(x, size.0), widest(y, size.1));
            let farthest = 1.0 + across * across + along * along;
            let steps = [x.1, y.1].map(f64::abs).into_iter().filter(|step| *step > 0.0);
            // Pixels at the window's corners are the smallest from the eye.
            steps.fold(f64::INFINITY, f64::min) / farthest
        }
    };
    let parallel = matches!(geometry.view, View::Parallel { .. });
    if !parallel && DIRECTION * roundoff > INVISIBLE * pixel {
        return Precision::F64;
    }
    let is_fine = |solid: &Solid| match solid.shape {
        Shape::Sphere { center, radius } => {
            let away = center.length();
            let error = POINT * roundoff * (away + radius);
            let nearest = if parallel { 1.0 } else { (away - radius).abs() };
            let seen = parallel || radius > 0.5 * pixel * away;
            radius > SMALLEST
                && error <= HARDLY_VISIBLE * pixel * nearest
                && !(seen && error > SHADE * radius)
        }
        // Seen in parallel, what is far away is as large as what is near.
        _ => !parallel || POINT * roundoff * solid.magnitude() <= INVISIBLE * pixel,
    };
    if geometry.solids.iter().all(is_fine) { Precision::F32 } else { Precision::F64 }
}
