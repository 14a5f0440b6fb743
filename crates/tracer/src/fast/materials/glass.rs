//! Glass: the share of a ray that a surface reflects, and the direction of the refracted rest.
//!
//! A surface has an inside and an outside, and is independent of all others: a ray leaves or enters it by the side that
//! it comes from. [`crate::fast::transport::scatter`] spawns the secondary rays, and [`crate::fast::transport::transmittance`] attenuates shadow rays.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rayfold_scene::{Object, Scene, Tone};

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::packet::Surface;
use crate::meshes::Faces;
use crate::reference;

/// The glass of a scene.
#[derive(Debug)]
pub(crate) struct Glass<E> {
    /// The panes, by the order of the objects.
    panes: Vec<Option<Pane<E>>>,
    /// The largest number of glass surfaces that a straight line hits.
    pub(crate) surfaces: usize,
    /// After a path has met glass, a ray whose weight is below this in every channel is not followed. A power of two.
    faint: f64,
}

/// The objects of glass, as bits, in scenes whose shadow rays test opaque objects first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GlassBits {
    /// The bits of the row of all objects.
    pub(crate) shapes: u64,
    /// The bits of the bodies that have bounding boxes.
    pub(crate) bodies: u64,
}

/// The transmission of an object of glass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pane<E> {
    /// The transmitted share, per channel.
    pub(crate) color: [E; 3],
    /// The mean of the channels, clamped to 0..=1: the share of the background that stays clear.
    clearness: E,
    /// The index of refraction of the inside divided by that of the outside.
    ior: E,
    /// Whether it has no inside, so that rays go straight on.
    is_flat: bool,
}

/// The reflection and refraction of a packet of rays at glass.
pub(crate) struct Refraction<S: Simd, E: Real> {
    /// The reflected share, from 0 to 1.
    pub(crate) mirrored: Lanes<S, E>,
    /// The direction of the refracted ray; without meaning in total reflection.
    pub(crate) direction: Vec3<S, E>,
}

/// The largest number of times that a straight line hits one surface: the torus has the most.
pub(crate) const SURFACES_OF_ONE: usize = 4;

impl<E: Real> Glass<E> {
    /// Returns `None` if there is no glass.
    pub(crate) fn new(scene: &Scene, faces: Option<&Faces>) -> Option<Self> {
        let is_filled = |order| faces.is_some_and(|faces| faces.is_filled(order));
        let panes: Vec<_> =
            scene.objects.iter().enumerate().map(|(order, o)| Pane::new(o, is_filled(order))).collect();
        let count = panes.iter().flatten().count();
        let faint = match scene.tone {
            Tone::Plain => reference::FAINT,
            Tone::Srgb => reference::FAINT_LINEAR,
        };
        (count > 0).then_some(Self { panes, surfaces: SURFACES_OF_ONE * count, faint })
    }

    /// Returns the pane of the object with this order, or `None` if it is opaque.
    #[inline(always)]
    pub(crate) fn of(&self, order: E) -> Option<&Pane<E>> {
        self.panes[order.to_index()].as_ref()
    }

    /// Returns whether the object with this order is of glass and has an inside.
    pub(crate) fn has_inside(&self, order: E) -> bool {
        self.of(order).is_some_and(|pane| !pane.is_flat)
    }

    /// Returns the lanes whose rays, of this weight, are followed.
    #[inline(always)]
    pub(crate) fn followed<S: Simd>(
        &self,
        simd: S,
        weight: Vec3<S, E>,
        have_met_glass: Mask<S, E>,
    ) -> Mask<S, E> {
        let (zero, faint) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, self.faint));
        let counts = |weight: Lanes<S, E>| {
            let weight = weight.abs();
            (have_met_glass & weight.simd_ge(faint)) | (!have_met_glass & weight.simd_gt(zero))
        };
        counts(weight.x) | counts(weight.y) | counts(weight.z)
    }
}

impl<E: Real> Pane<E> {
    /// `is_filled` is whether the object is a face of a closed body.
    fn new(object: &Object, is_filled: bool) -> Option<Self> {
        let glass = object.material().finish()?.glass?;
        let shape = match object {
            Object::Instance(instance) => instance.object(),
            shape => shape,
        };
        Some(Self {
            color: glass.color().to_array().map(E::narrow),
            clearness: E::narrow((glass.color().element_sum() / 3.0).clamp(0.0, 1.0)),
            ior: E::narrow(glass.ior()),
            is_flat: !is_filled && !reference::has_inside(shape),
        })
    }

    /// Returns the share of the background that stays clear if nothing is reflected.
    #[inline(always)]
    pub(crate) fn clearness(&self) -> E {
        self.clearness
    }

    /// Refracts rays by Snell's law, and splits them by Fresnel's equations for unpolarised light, as the reference
    /// tracer does.
    #[inline(always)]
    pub(crate) fn refract<S: Simd>(
        &self,
        simd: S,
        direction: Vec3<S, E>,
        surface: Surface<S, E>,
    ) -> Refraction<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let Surface { normal, within, .. } = surface;
        let cosine = zero - direction.dot(normal);
        let ior = splat::<S, E>(simd, self.ior);
        let outside = if self.is_flat { zero.simd_eq(zero) } else { !within };
        let (before, behind) = (outside.select(one, ior), outside.select(ior, one));
        let aside = normal.scale_add(cosine, direction);
        // The ratio may be infinite without this limit, because the larger index has no upper bound.
        let ratio = (before / behind).min(constant::<S, E>(simd, f64::MAX));
        let sine = aside.dot(aside).sqrt() * ratio;
        let is_total = cosine.simd_le(zero) | sine.simd_ge(one);
        let cosine_behind = ((one - sine) * (one + sine)).max(zero).sqrt();
        let across = part(before * cosine, behind * cosine_behind);
        let along = part(behind * cosine, before * cosine_behind);
        let mirrored = (across + along) * constant::<S, E>(simd, 0.5);
        let bent = aside.scale(ratio).sub(normal.scale(cosine_behind)).normalize(simd);
        Refraction {
            mirrored: is_total.select(one, mirrored),
            direction: if self.is_flat { direction } else { bent },
        }
    }
}

/// Returns ((a - b)/(a + b))².
#[inline(always)]
fn part<L>(a: L, b: L) -> L
where
    L: Copy
        + core::ops::Add<Output = L>
        + core::ops::Sub<Output = L>
        + core::ops::Mul<Output = L>
        + core::ops::Div<Output = L>,
{
    let root = (a - b) / (a + b);
    root * root
}
