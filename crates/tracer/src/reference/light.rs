//! The incident light at a surface.

use glam::DVec3;
use rayfold_scene::model::unit;
use rayfold_scene::{Lamp, Light, Shine};

use super::shapes::{self, Surface};
use super::world::{World, glass};
use crate::camera::Ray;
use crate::scale::below_inverse;

/// The rounding error of a lamp's position relative to that of a surface, in roundoffs.
const LAMP: f64 = 8.0 * f64::EPSILON;

/// The incident light from one light, at a hit.
pub(super) struct IncidentLight {
    /// The unit vector towards the light.
    pub(super) towards: DVec3,
    /// The colour of the light if nothing occludes it.
    pub(super) color: DVec3,
    /// The position of the lamp; `None` for a directional light.
    lamp: Option<DVec3>,
}

/// Returns the light from a `point` of a light: for a sun a unit vector towards it, for a lamp a position. Returns
/// `None` for a lamp at the hit itself.
pub(super) fn arriving(light: &Light, point: DVec3, surface: &Surface) -> Option<IncidentLight> {
    match light {
        Light::Directional(sun) => Some(IncidentLight { towards: point, color: sun.color(), lamp: None }),
        Light::Lamp(lamp) => from_lamp(lamp, point, surface),
    }
}

/// Returns the light from a `place` in the lamp's sphere.
fn from_lamp(lamp: &Lamp, place: DVec3, surface: &Surface) -> Option<IncidentLight> {
    let towards = place - surface.point;
    if length(towards) <= surface.offset {
        return None;
    }
    let color = if lamp.reach() > 0.0 {
        let distance = length(lamp.position() - surface.point);
        if distance <= surface.offset {
            return None;
        }
        let part = lamp.reach() / distance;
        held(lamp.color() * (part * part).min(f64::MAX))
    } else {
        lamp.color()
    };
    Some(IncidentLight { towards: unit(towards), color, lamp: Some(place) })
}

/// Returns the length of a vector whose square may overflow.
fn length(v: DVec3) -> f64 {
    let scale = below_inverse(v.abs().max_element());
    (v * scale).length() / scale
}

impl IncidentLight {
    /// Returns the transmittance between the light and `start`, which is off the surface, or `None` if an opaque object
    /// occludes the light.
    pub(super) fn let_through(&self, world: &World, start: DVec3) -> Option<DVec3> {
        if !world.has_glass {
            let hidden =
                (0..world.objects.len()).any(|index| self.is_hidden_by(world, index, self.ray(start)));
            return (!hidden).then_some(DVec3::ONE);
        }
        let mut left = DVec3::ONE;
        let mut ray = self.ray(start);
        while let Some(hit) = world.nearest(ray) {
            let object = &world.objects[hit.object];
            if !self.is_before(ray, hit.distance, &hit.surface) {
                break;
            }
            left = held(left * glass(object)?.color());
            // The ray passes all surfaces at the same distance at once.
            let Surface { point, normal, offset, .. } = hit.surface;
            ray.origin = point - offset * normal;
        }
        Some(left)
    }

    fn ray(&self, start: DVec3) -> Ray {
        Ray { origin: start, direction: self.lamp.map_or(self.towards, |lamp| unit(lamp - start)) }
    }

    fn is_hidden_by(&self, world: &World, index: usize, ray: Ray) -> bool {
        world.distance(index, ray).is_some_and(|distance| {
            let surface = || shapes::surface(&world.objects[index], ray, distance);
            self.lamp.is_none() || self.is_before(ray, distance, &surface())
        })
    }

    /// Returns whether a surface is in front of the light. A surface at the position of a lamp is not.
    fn is_before(&self, ray: Ray, distance: f64, surface: &Surface) -> bool {
        let Some(lamp) = self.lamp else { return true };
        let apart = (lamp - surface.point).dot(surface.normal).abs();
        distance < length(lamp - ray.origin) && apart > 2.0 * surface.offset + LAMP * lamp.abs().max_element()
    }
}

/// Returns the highlight of light from `towards` as seen from `towards_eye`, both unit vectors: max(0, N·h)ⁿ with the
/// vector h halfway between them.
pub(crate) fn highlight(shine: &Shine, normal: DVec3, towards: DVec3, towards_eye: DVec3) -> f64 {
    let sum = towards + towards_eye;
    if sum == DVec3::ZERO {
        return 0.0;
    }
    let halfway = unit(sum);
    let cosine = normal.dot(halfway);
    if cosine <= 0.0 {
        0.0
    } else if cosine < STEEP {
        power(cosine, shine.exponent())
    } else {
        // From the sine, which is small and therefore more accurate: cosⁿ = (1 - sin²)^(n/2).
        let sine = normal.cross(halfway).length_squared().min(1.0);
        let half = 0.5 * shine.exponent();
        if half <= SMALL { power(1.0 - sine, half) } else { libm::exp(half * libm::log1p(-sine)) }
    }
}

/// Returns `x`, from 0 to 1, to a power that is not negative. Whole exponents, which most scripts have, and their
/// halves take few products.
fn power(x: f64, exponent: f64) -> f64 {
    let whole = exponent as u32;
    let left = exponent - f64::from(whole);
    if exponent > SMALL || left != 0.0 && left != 0.5 {
        return libm::pow(x, exponent);
    }
    let first = if left == 0.5 { x.sqrt() } else { 1.0 };
    let (mut product, mut square, mut rest) = (first, x, whole);
    while rest != 0 {
        if rest % 2 == 1 {
            product *= square;
        }
        square *= square;
        rest /= 2;
    }
    product
}

/// Replaces infinities by the largest finite number. Infinities cannot be subtracted from each other.
pub(super) fn held(color: DVec3) -> DVec3 {
    color.clamp(DVec3::MIN, DVec3::MAX)
}

/// The largest exponent for which powers are computed by products. Together their rounding errors are less than this
/// many roundoffs, which is invisible.
const SMALL: f64 = 1024.0;

/// The cosine above which the sine is more accurate.
const STEEP: f64 = 0.9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_highlight_is_sharp_however_large_its_exponent() {
        let at = |exponent: f64, angle: f64| {
            let shine = Shine::new(DVec3::ONE, exponent).unwrap();
            let towards = DVec3::new(libm::sin(angle), libm::cos(angle), 0.0);
            highlight(&shine, DVec3::Y, towards, towards)
        };
        assert!((at(2.0, 1.0) - libm::cos(1.0).powi(2)).abs() < 1e-15);
        assert!((at(3.0, 0.1) - libm::cos(0.1).powi(3)).abs() < 1e-15);
        for exponent in [1.0, 2.0, 3.0, 7.0, 60.0, 99.0, 1023.0, 1024.0, 1.5, 60.25, 1025.0] {
            for angle in [0.01, 0.1, 0.4, 0.5, 1.0] {
                let (seen, exact) = (at(exponent, angle), libm::pow(libm::cos(angle), exponent));
                assert!(
                    (seen - exact).abs() <= 1e-12 * exact,
                    "cos({angle})^{exponent}: {seen} is not {exact}"
                );
            }
        }
        assert_eq!((at(1e300, 0.0), at(1e300, 1e-9), at(5.0, 2.0)), (1.0, 0.0, 0.0));
        // cosⁿ(1e-6) for n = 1e12 is e^(-1/2).
        assert!((at(1e12, 1e-6) - libm::exp(-0.5)).abs() < 1e-9);
    }
}
