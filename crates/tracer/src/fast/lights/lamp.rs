//! A lamp: a point light, whose shadow rays end at it.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::arithmetic::real::{Lanes, Real, Vec3, constant, splat};
use crate::fast::rays::packet::Ray;
use crate::scale::below_inverse;

/// A lamp in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Place {
    pub(in crate::fast) position: DVec3,
    color: DVec3,
    /// The radius of its sphere.
    pub(in crate::fast) radius: f64,
    /// The distance at which its intensity equals its colour; 0 if the light does not fall off.
    reach: f64,
}

impl Place {
    /// Makes a lamp, moved so that `center` is the origin, and then scaled.
    pub(in crate::fast) fn new(lamp: &rayfold_scene::Lamp, center: DVec3, scale: f64) -> Self {
        let position = (lamp.position() - center) * scale;
        let (color, reach) = balanced(lamp.color(), lamp.reach() * scale);
        Self { position, color, radius: lamp.radius() * scale, reach }
    }
}

/// The reaches whose squares neither overflow nor underflow in the kernels.
const REACHES: core::ops::Range<f64> = 1e-60..1e60;

/// Returns a colour and a reach that give the same light and whose squared reach does not overflow or underflow. Scales
/// by a power of two, without rounding.
fn balanced(color: DVec3, reach: f64) -> (DVec3, f64) {
    if reach == 0.0 || REACHES.contains(&reach) {
        return (color, reach);
    }
    let part = below_inverse(reach);
    // In two steps, because the square of the factor may itself overflow.
    let color = (color / part / part).clamp(DVec3::splat(-BRIGHTEST), DVec3::splat(BRIGHTEST));
    (color, reach * part)
}

/// The largest brightness of a colour; brighter ones are clamped to it. Products with the arriving share stay finite.
const BRIGHTEST: f64 = 1e120;

/// The distance from the lamp, in roundoffs of the ray's length, below which a surface does not hide the lamp: the lamp
/// may be in that surface.
///
/// The distance to a surface has an error of some roundoffs divided by the sine of the angle between the ray and the
/// surface. A surface that contains the lamp is hit at angles down to 2⁻¹⁴ and less.
const AT_THE_LAMP: f64 = 1048576.0;

/// A lamp as the kernels use it.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Lamp<E> {
    position: [E; 3],
    pub(in crate::fast) color: [E; 3],
    /// The square of the reach.
    reach: Option<E>,
}

/// Shadow rays to a lamp.
#[derive(Clone, Copy)]
pub(in crate::fast) struct Rays<S: Simd, E: Real> {
    pub(in crate::fast) ray: Ray<S, E>,
    /// The distance to the lamp: a hit nearer than this hides it.
    pub(in crate::fast) far: Lanes<S, E>,
    /// The share of the light that arrives, the same in each channel.
    pub(in crate::fast) part: Lanes<S, E>,
}

impl<E: Real> Lamp<E> {
    pub(in crate::fast) fn new(place: &Place) -> Self {
        Self {
            position: place.position.to_array().map(E::narrow),
            color: place.color.to_array().map(E::narrow),
            reach: (place.reach > 0.0).then(|| E::narrow(place.reach * place.reach)),
        }
    }

    /// Returns the shadow rays from points off a surface to the lamp. If a point is at the lamp's own position, its ray
    /// goes back into the surface.
    #[inline(always)]
    pub(in crate::fast) fn rays<S: Simd>(&self, simd: S, start: Vec3<S, E>) -> Rays<S, E> {
        let middle = Vec3::splat(simd, self.position);
        self.rays_to(simd, start, middle)
    }

    /// Returns the shadow rays to points of the lamp's sphere, one for each ray. The share that arrives depends on the
    /// distance of the sphere's centre.
    #[inline(always)]
    pub(in crate::fast) fn rays_to<S: Simd>(
        &self,
        simd: S,
        start: Vec3<S, E>,
        point: Vec3<S, E>,
    ) -> Rays<S, E> {
        let one = constant::<S, E>(simd, 1.0);
        let to = point.sub(start);
        let square = to.dot(to);
        let distance = square.sqrt();
        let direction = to.scale(one / distance);
        let far = distance * constant::<S, E>(simd, 1.0 - AT_THE_LAMP * E::ROUNDOFF);
        let part = match self.reach {
            Some(reach) => {
                let to_middle = Vec3::splat(simd, self.position).sub(start);
                let square = to_middle.dot(to_middle);
                (splat::<S, E>(simd, reach) / square).min(constant::<S, E>(simd, E::FAR))
            }
            None => one,
        };
        Rays { ray: Ray { origin: start, direction }, far, part }
    }
}
