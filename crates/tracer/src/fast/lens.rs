//! The lens of a camera: where rays start that do not all start at the eye.

use fearless_simd::Simd;
use glam::DVec3;
use rayfold_scene::{Camera, Scene};

use super::placed::Placed;
use super::real::{Lanes, Real, Vec3, splat};
use super::shapes::Shape;
use crate::sampling::has_lens;

/// A disc around the eye, square to the gaze. A ray goes from one of its points to where the eye's own ray is in focus.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    pub(super) radius: f64,
    /// Where it is in focus, along the gaze.
    pub(super) distance: f64,
}

impl Lens {
    /// The lens of a scene that is drawn with several samples a pixel, in the scene's lengths.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let given = scene.lens.distance();
        let distance = match &scene.camera {
            Camera::Orthographic => return None,
            Camera::Pinhole(pinhole) => given.unwrap_or(pinhole.distance()),
            Camera::Look(look) => given.unwrap_or_else(|| look.distance()),
        };
        (scene.samples.most() > 1 && has_lens(scene))
            .then_some(Self { radius: scene.lens.radius(), distance })
    }

    pub(super) fn scaled(self, scale: f64) -> Self {
        Self { radius: self.radius * scale, distance: self.distance * scale }
    }

    /// How far square to the gaze (`ahead`) a ray can be from the eye's own, at most, where a shape is: at a depth of z it is
    /// radius · |1 - z / distance|.
    pub(super) fn astray(&self, shape: &Shape, ahead: DVec3) -> f64 {
        let (near, far) = (-shape.support(-ahead), shape.support(ahead));
        let at = |depth: f64| (1.0 - depth / self.distance).abs();
        // Behind the lens nothing is seen.
        self.radius * at(near.max(0.0)).max(at(far.max(0.0))) * (1.0 + 1e-6)
    }
}

/// A lens as the kernels read it.
#[derive(Debug)]
pub(super) struct Aperture<E> {
    pub(super) radius: f64,
    right: [E; 3],
    up: [E; 3],
    /// 1 / distance.
    power: E,
}

impl<E: Real> Aperture<E> {
    /// `right` and `up` are unit vectors, square to the gaze.
    pub(super) fn new(lens: Lens, right: DVec3, up: DVec3) -> Self {
        let narrow = |v: DVec3| v.to_array().map(E::narrow);
        let power = E::narrow(1.0 / lens.distance);
        Self { radius: lens.radius, right: narrow(right), up: narrow(up), power }
    }

    /// The rays from points of the lens, and their directions of any length; `along` are the eye's own, which go as far as 1
    /// along the gaze, `x` and `y` the points.
    #[inline(always)]
    pub(super) fn ray<S: Simd>(
        &self,
        simd: S,
        along: Vec3<S, E>,
        x: Lanes<S, E>,
        y: Lanes<S, E>,
    ) -> (Vec3<S, E>, Vec3<S, E>) {
        let origin = Vec3::splat(simd, self.right).scale(x);
        let origin = Vec3::splat(simd, self.up).scale_add(y, origin);
        (origin, along.sub(origin.scale(splat::<S, E>(simd, self.power))))
    }
}
