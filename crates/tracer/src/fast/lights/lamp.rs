//! A lamp: light from a place. Its shadow rays end there.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;

use crate::fast::packet::Ray;
use crate::fast::real::{Lanes, Real, Vec3, constant, splat};
use crate::scale::below_inverse;

/// A lamp in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Place {
    pub(in crate::fast) position: DVec3,
    color: DVec3,
    /// Of its ball.
    pub(in crate::fast) radius: f64,
    /// The distance at which its colour arrives; 0 where it does at all.
    reach: f64,
}

impl Place {
    /// Moved so that `center` is the origin, and then scaled.
    pub(in crate::fast) fn new(lamp: &rayfold_scene::Lamp, center: DVec3, scale: f64) -> Self {
        let position = (lamp.position() - center) * scale;
        let (color, reach) = balanced(lamp.color(), lamp.reach() * scale);
        Self { position, color, radius: lamp.radius() * scale, reach }
    }
}

/// Reaches whose squares are as large as numbers of the kernels may be, and as small.
const REACHES: core::ops::Range<f64> = 1e-60..1e60;

/// A colour and a reach that light alike, such that the square of the reach is not beyond all numbers: by a power of two, without
/// rounding.
fn balanced(color: DVec3, reach: f64) -> (DVec3, f64) {
    if reach == 0.0 || REACHES.contains(&reach) {
        return (color, reach);
    }
    let part = below_inverse(reach);
    // In two steps: the square of the part may be beyond all numbers itself.
    let color = (color / part / part).clamp(DVec3::splat(-BRIGHTEST), DVec3::splat(BRIGHTEST));
    (color, reach * part)
}

/// Whatever is brighter is as bright; products of it with what arrives are numbers.
const BRIGHTEST: f64 = 1e120;

/// How near the lamp, in roundoffs of its distance, a surface is taken for one that it lies in, which does not hide it.
///
/// The distance to a surface errs by some roundoffs over the sine of the angle at which the ray meets it; a surface in
/// which the lamp lies is met at angles down to 2⁻¹⁴ and less.
const AT_THE_LAMP: f64 = 1048576.0;

/// A lamp as the kernels read it.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Lamp<E> {
    position: [E; 3],
    pub(in crate::fast) color: [E; 3],
    /// Its square.
    reach: Option<E>,
}

/// Shadow rays to a lamp.
#[derive(Clone, Copy)]
pub(in crate::fast) struct Rays<S: Simd, E: Real> {
    pub(in crate::fast) ray: Ray<S, E>,
    /// What is met nearer than this hides the lamp.
    pub(in crate::fast) far: Lanes<S, E>,
    /// What arrives of each channel's light.
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

    /// From where rays leave a surface to the lamp. From the lamp's own place they lead back into the surface.
    #[inline(always)]
    pub(in crate::fast) fn rays<S: Simd>(&self, simd: S, start: Vec3<S, E>) -> Rays<S, E> {
        let middle = Vec3::splat(simd, self.position);
        self.rays_to(simd, start, middle)
    }

    /// The same to points of its ball, one for each ray; how much arrives depends on the distance of its middle.
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
