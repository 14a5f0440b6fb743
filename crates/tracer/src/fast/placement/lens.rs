//! The lens of a camera, for rays that do not all start at the eye.

use fearless_simd::Simd;
use glam::DVec3;
use rayfold_scene::{Camera, Scene};

use crate::fast::arithmetic::real::{Lanes, Real, Vec3, splat};
use crate::fast::rays::placed::RenderSpaceShape;
use crate::fast::shapes::Shape;
use crate::sampling::has_lens;

/// A disc around the eye, perpendicular to the view direction. A ray goes from one of its points to the point where the
/// eye's own ray crosses the plane of focus.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    pub(crate) radius: f64,
    /// The distance of the plane of focus, along the view direction.
    pub(crate) distance: f64,
}

impl Lens {
    /// Returns the lens of a scene that is drawn with several samples per pixel, in the scene's lengths.
    pub(crate) fn of(scene: &Scene) -> Option<Self> {
        let given = scene.lens.distance();
        let distance = match &scene.camera {
            Camera::Orthographic => return None,
            Camera::Pinhole(pinhole) => given.unwrap_or(pinhole.distance()),
            Camera::Look(look) => given.unwrap_or_else(|| look.distance()),
        };
        (scene.samples.most() > 1 && has_lens(scene))
            .then_some(Self { radius: scene.lens.radius(), distance })
    }

    pub(crate) fn scaled(self, scale: f64) -> Self {
        Self { radius: self.radius * scale, distance: self.distance * scale }
    }

    /// Returns the largest radius of the circle of confusion over the depths of a shape along the view direction
    /// `ahead`: the largest distance between a ray and the eye's own, measured perpendicular to `ahead`. At depth z it
    /// is radius · |1 - z / distance|.
    pub(crate) fn circle_of_confusion(&self, shape: &Shape, ahead: DVec3) -> f64 {
        let (near, far) = (-shape.support(-ahead), shape.support(ahead));
        let at = |depth: f64| (1.0 - depth / self.distance).abs();
        // Points behind the lens are not visible.
        self.radius * at(near.max(0.0)).max(at(far.max(0.0))) * (1.0 + 1e-6)
    }
}

/// A lens as the kernels use it.
#[derive(Debug)]
pub(crate) struct Aperture<E> {
    pub(crate) radius: f64,
    right: [E; 3],
    up: [E; 3],
    /// The reciprocal of the focal distance.
    power: E,
}

impl<E: Real> Aperture<E> {
    /// Makes the aperture. `right` and `up` are unit vectors perpendicular to the view direction.
    pub(crate) fn new(lens: Lens, right: DVec3, up: DVec3) -> Self {
        let narrow = |v: DVec3| v.to_array().map(E::narrow);
        let power = E::narrow(1.0 / lens.distance);
        Self { radius: lens.radius, right: narrow(right), up: narrow(up), power }
    }

    /// Returns the origins and the unnormalised directions of the rays from points `x`, `y` of the lens. `along` are
    /// the directions of the eye's own rays, with a component of 1 along the view direction.
    #[inline(always)]
    pub(crate) fn ray<S: Simd>(
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
