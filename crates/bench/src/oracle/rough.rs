//! Rough mirrors and rough glass, by other formulas than the tracer's.
//!
//! Normals of microfacets are drawn with the density of GGX times the cosine to the surface, and weighed by how visible
//! they are. The numbers have the precision of `f64`: the random parts have larger errors.

use std::cell::RefCell;
use std::f64::consts::TAU;

use fastrand::Rng;
use glam::DVec3;

/// The steps along each of two axes with which `E` is integrated.
const STEPS: u32 = 160;

/// A microfacet.
pub(super) struct Facet {
    pub(super) normal: DVec3,
    /// The density of visible normals, divided by that with which it was drawn.
    pub(super) weight: f64,
}

/// Returns Smith's masking of GGX, by the cosine of a direction to the normal; 0 for one below the surface.
pub(super) fn masking(alpha: f64, cosine: f64) -> f64 {
    if cosine <= 0.0 {
        return 0.0;
    }
    let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    2.0 / (1.0 + (alpha * tangent).hypot(1.0))
}

/// Returns the density of GGX by the cosine of a microfacet's normal to that of the surface.
fn density(alpha: f64, cosine: f64) -> f64 {
    let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    let slope = tangent / alpha;
    1.0 / (std::f64::consts::PI * alpha * alpha * cosine.powi(4) * (1.0 + slope * slope).powi(2))
}

/// Returns the microfacet for two numbers from 0 to 1, around the normal (0, 0, 1). `view` points back along the ray.
fn facet(alpha: f64, view: DVec3, (u, v): (f64, f64)) -> Facet {
    let (angle, turn) = ((alpha * (u / (1.0 - u)).sqrt()).atan(), TAU * v);
    let normal = DVec3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos());
    let weight = masking(alpha, view.z) * view.dot(normal).max(0.0) / (view.z * normal.z);
    Facet { normal, weight }
}

fn mirrored(view: DVec3, normal: DVec3) -> DVec3 {
    2.0 * view.dot(normal) * normal - view
}

/// Returns a random microfacet of a surface with this normal.
pub(super) fn random_facet(alpha: f64, view: DVec3, normal: DVec3, dice: &RefCell<Rng>) -> Facet {
    let (x, y) = normal.any_orthonormal_pair();
    let local = DVec3::new(view.dot(x), view.dot(y), view.dot(normal));
    let numbers = {
        let mut dice = dice.borrow_mut();
        (dice.f64(), dice.f64())
    };
    let Facet { normal: n, weight } = facet(alpha, local, numbers);
    Facet { normal: (n.x * x + n.y * y + n.z * normal).normalize(), weight }
}

/// Returns the mean of the masking of mirrored directions over the visible normals, by the cosine of the view.
pub(super) fn energy(alpha: f64, cosine: f64) -> f64 {
    let view = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let (mut sum, mut weights) = (0.0, 0.0);
    for k in 0..STEPS * STEPS {
        // Fine steps in the tail, which is at the end of the first number.
        let part = (f64::from(k % STEPS) + 0.5) / f64::from(STEPS);
        let u = 1.0 - (1.0 - part).powi(3);
        let v = (f64::from(k / STEPS) + 0.5) / f64::from(STEPS);
        let Facet { normal, weight } = facet(alpha, view, (u, v));
        let weight = weight * (1.0 - part).powi(2);
        sum += weight * masking(alpha, mirrored(view, normal).z);
        weights += weight;
    }
    sum / weights
}

/// Returns the factor of light times mirror in the highlight of a light.
pub(super) fn highlight(alpha: f64, normal: DVec3, view: DVec3, towards: DVec3) -> f64 {
    let halfway = (view + towards).normalize();
    let (seen, lit) = (normal.dot(view), normal.dot(towards));
    let shown = density(alpha, normal.dot(halfway)) * masking(alpha, seen) * masking(alpha, lit);
    std::f64::consts::PI * shown / (4.0 * seen * energy(alpha, seen))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visible_normals_are_all_there_are() {
        let dice = RefCell::new(Rng::with_seed(3));
        for (alpha, cosine) in [(0.1, 1.0), (0.3, 0.5), (0.6, 0.8), (1.0, 0.9)] {
            let view = DVec3::new((1.0f64 - cosine * cosine).sqrt(), 0.0, cosine);
            let count = 100_000;
            let sum: f64 = (0..count).map(|_| random_facet(alpha, view, DVec3::Z, &dice).weight).sum();
            assert!((sum / f64::from(count) - 1.0).abs() < 0.02, "{alpha} {cosine}: {sum}");
            let shown: f64 = (0..count)
                .map(|_| random_facet(alpha, view, DVec3::Z, &dice))
                .map(|facet| facet.weight * masking(alpha, mirrored(view, facet.normal).z))
                .sum();
            assert!((shown / f64::from(count) - energy(alpha, cosine)).abs() < 0.02, "{alpha} {cosine}");
        }
    }
}
