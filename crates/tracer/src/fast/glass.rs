//! Glass: how much of a ray a surface mirrors, and where the rest goes.
//!
//! A surface knows its own inside and outside and nothing of what else is there: a ray leaves or enters it by the side
//! that it comes from. Which rays are sent on is [`super::onwards`]' business, what shadow rays lose that of
//! [`super::dimming`].

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rayfold_scene::{Object, Scene, Tone};

use super::packet::Surface;
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::reference;

/// The glass of a scene.
#[derive(Debug)]
pub(super) struct Glass<E> {
    /// By the order of the objects.
    panes: Vec<Option<Pane<E>>>,
    /// Surfaces of glass that a straight line meets at most.
    pub(super) surfaces: usize,
    /// Once a path has met glass, a ray that counts for less than this in every channel is not followed. A power of two.
    faint: f64,
}

/// What an object of glass lets through.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pane<E> {
    /// A channel each.
    pub(super) color: [E; 3],
    /// The index of refraction of the inside over that of the outside.
    ior: E,
    /// Whether it has no inside: rays go straight on.
    is_flat: bool,
}

/// What a packet of rays finds at glass.
pub(super) struct Refraction<S: Simd, E: Real> {
    /// The share that is mirrored, from 0 to 1.
    pub(super) mirrored: Lanes<S, E>,
    /// Where the rest goes; of no meaning where all is mirrored.
    pub(super) direction: Vec3<S, E>,
}

/// A straight line meets no surface more often than that of a torus.
pub(super) const SURFACES_OF_ONE: usize = 4;

impl<E: Real> Glass<E> {
    /// None if there is no glass.
    pub(super) fn new(scene: &Scene) -> Option<Self> {
        let panes: Vec<_> = scene.objects.iter().map(Pane::new).collect();
        let count = panes.iter().flatten().count();
        let faint = match scene.tone {
            Tone::Plain => reference::FAINT,
            Tone::Srgb => reference::FAINT_LINEAR,
        };
        (count > 0).then_some(Self { panes, surfaces: SURFACES_OF_ONE * count, faint })
    }

    /// Of the object with this order; none if it is opaque.
    #[inline(always)]
    pub(super) fn of(&self, order: E) -> Option<&Pane<E>> {
        self.panes[order.to_index()].as_ref()
    }

    /// Which rays are followed that count for `weight`.
    #[inline(always)]
    pub(super) fn followed<S: Simd>(
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
    fn new(object: &Object) -> Option<Self> {
        let glass = object.material().finish()?.glass?;
        let shape = match object {
            Object::Instance(instance) => instance.object(),
            shape => shape,
        };
        Some(Self {
            color: glass.color().to_array().map(E::narrow),
            ior: E::narrow(glass.ior()),
            is_flat: reference::is_flat(shape),
        })
    }

    /// Snell's law, and Fresnel's for light without polarisation, as the plain tracer has them.
    #[inline(always)]
    pub(super) fn refract<S: Simd>(
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
        // The larger of two numbers may be of any size.
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

/// ((a - b)/(a + b))²
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
