//! Spheres, with intersection tests that avoid cancellation.

use std::ops::Range;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};

use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::arithmetic::rounding::OFFSET;
use crate::fast::lights::sun::Sun;
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::packet::{Nearest, Ray, Surface, no_lane};
use crate::fast::rays::placed;
use crate::fast::rays::placed::{Face, Sight};
use crate::fast::rays::predicate::Place;
use crate::fast::shapes::shape::{Items, Obstacles, Obstructs, Precalculations, Robust, Tests};
use crate::reference::power;

/// A sphere in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct RenderSpaceSphere {
    pub(in crate::fast) center: DVec3,
    pub(in crate::fast) radius: f64,
    /// The power of the eye: |center|² - radius², correctly rounded.
    pub(in crate::fast) power: f64,
}

impl RenderSpaceSphere {
    /// Makes a sphere that is moved so that `center` is the origin, and is then scaled.
    pub(in crate::fast) fn new(sphere: &rayfold_scene::Sphere, center: DVec3, scale: f64) -> Self {
        Self {
            center: (sphere.center() - center) * scale,
            radius: sphere.radius() * scale,
            power: power(center, sphere, scale),
        }
    }
}

/// Returns the largest distance along an axis from `center` to a point of the sphere.
pub(in crate::fast) fn reach(sphere: &rayfold_scene::Sphere, center: DVec3) -> f64 {
    (sphere.center() - center).abs().max_element() + sphere.radius()
}

impl placed::RenderSpaceShape for RenderSpaceSphere {
    fn bounds(&self) -> Bounds {
        (self.center - self.radius, self.center + self.radius)
    }

    fn support(&self, direction: DVec3) -> f64 {
        direction.dot(self.center) + self.radius * direction.length()
    }

    fn across(&self, axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)> {
        let (x, depth) = (self.center.dot(axis), -self.center.dot(back));
        let radius = self.radius + 2.0 * slack;
        (depth > radius).then(|| {
            let (angle, half) = (libm::atan2(x, depth), libm::asin(radius / libm::hypot(x, depth)));
            // A generous bound for the rounding errors of the three functions.
            (libm::tan(angle - half) * (1.0 + 1e-12) - 1e-12, libm::tan(angle + half) * (1.0 + 1e-12) + 1e-12)
        })
    }

    fn ball(&self) -> Option<(DVec3, f64)> {
        Some((self.center, self.radius))
    }

    fn faces(&self) -> Range<usize> {
        0..0
    }

    fn face(&self, _: usize) -> Face {
        unreachable!("a sphere has no faces")
    }

    /// Returns the difference of the two lengths. `power` is the difference of their squares without cancellation.
    fn nearest(&self) -> f64 {
        self.power.abs() / (self.center.length() + self.radius)
    }

    fn shadow_nearest(&self, x: DVec3, y: DVec3) -> f64 {
        (libm::hypot(self.center.dot(x), self.center.dot(y)) - self.radius).abs()
    }

    /// Returns whether errors are invisible. The error of an outline is that of a point on it. The error of a shadow on
    /// the sphere, or of a reflection in it, is that of the start of a ray. The error of a normal is that of the point
    /// divided by the radius.
    fn is_fine(&self, sight: &Sight) -> bool {
        let &Self { center, radius, .. } = self;
        let (away, size) = (center.length(), center.length() + radius);
        let seen = sight.parallel || radius > 0.5 * sight.pixel * away;
        let bent = sight.point * sight.roundoff * size > sight.normal * radius;
        sight.is_invisible(sight.start * size, self.nearest()) && !(seen && bent)
    }
}

/// A sphere as the kernels use it.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Sphere<E> {
    pub(in crate::fast) center: [E; 3],
    /// The square of the radius, r².
    pub(in crate::fast) square: E,
    /// The position in the script.
    pub(in crate::fast) order: E,
    /// The power of the eye, |c|² - r² without cancellation, for rays from the eye.
    pub(in crate::fast) power: E,
    /// The distances from the centre at which rays start on its outside and its inside.
    pub(in crate::fast) outer: E,
    inner: E,
}

impl<E: Real> Sphere<E> {
    pub(in crate::fast) fn new(
        &RenderSpaceSphere { center, radius, power }: &RenderSpaceSphere,
        order: u32,
    ) -> Self {
        let offset = OFFSET * E::ROUNDOFF * (center.abs().max_element() + radius);
        Self {
            center: center.to_array().map(E::narrow),
            square: E::narrow(radius * radius),
            order: E::narrow(f64::from(order)),
            power: E::narrow(power),
            outer: E::narrow(radius + offset),
            inner: E::narrow(radius - offset),
        }
    }

    /// Returns whether the eye is outside. If so, rays from the eye hit it from outside, and the points that they hit
    /// are not in its own shadow.
    #[inline(always)]
    pub(in crate::fast) fn is_outside_the_eye(&self) -> bool {
        self.power > E::narrow(0.0)
    }

    /// Intersects rays from any origin (Haines, Günther, Akenine-Möller, "Precision improvements for ray/sphere
    /// intersection", Ray Tracing Gems ch. 7).
    ///
    /// The remaining subtraction adds no more error than the rounding of the origin.
    #[inline(always)]
    fn meet_from_anywhere<S: Simd>(&self, simd: S, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let to_center = Vec3::splat(simd, self.center).sub(ray.origin);
        let middle = to_center.dot(ray.direction);
        let closest = ray.direction.scale_sub(middle, to_center);
        let rest = splat::<S, E>(simd, self.square) - closest.dot(closest);
        let meets = rest.simd_ge(zero);
        if meets.any_true() {
            let half_chord = rest.sqrt();
            let near = middle - half_chord;
            let distance = near.simd_gt(zero).select(near, middle + half_chord);
            nearest.offer(simd, meets & distance.simd_gt(zero), distance, self.order);
        }
    }

    /// Intersects rays from the eye. The second root comes from the power of the eye, so that a sphere next to the eye
    /// is as exact as one far away.
    #[inline(always)]
    fn meet_from_eye<S: Simd>(&self, simd: S, direction: Vec3<S, E>, nearest: &mut Nearest<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let center = Vec3::splat(simd, self.center);
        let middle = center.dot(direction);
        let ahead = middle.simd_gt(zero);
        let power = splat::<S, E>(simd, self.power);
        if self.is_outside_the_eye() {
            let closest = direction.scale_sub(middle, center);
            let rest = splat::<S, E>(simd, self.square) - closest.dot(closest);
            let hit = rest.simd_ge(zero) & ahead;
            if hit.any_true() {
                nearest.offer(simd, hit, power / (middle + rest.sqrt()), self.order);
            }
        } else {
            // A sum without cancellation: every ray from within hits the sphere, also a grazing ray from its surface.
            let half_chord = middle.fused_mul_add(middle, -power).sqrt();
            let far = ahead.select(middle + half_chord, middle - half_chord);
            let distance = ahead.select(far, power / far);
            nearest.offer(simd, distance.simd_gt(zero), distance, self.order);
        }
    }
}

impl<E: Real> Precalculations<E> for Sphere<E> {
    type RayPrecalculations<S: Simd> = ();

    #[inline(always)]
    fn aim<S: Simd>(_: S, _: Ray<S, E>) {}
}

impl<E: Real> Tests<Sphere<E>, E> for Robust {
    #[inline(always)]
    fn intersect<S: Simd, const EYE: bool>(
        simd: S,
        sphere: &Sphere<E>,
        _: Place,
        ray: Ray<S, E>,
        (): (),
        nearest: &mut Nearest<S, E>,
    ) {
        if EYE {
            sphere.meet_from_eye(simd, ray.direction, nearest);
        } else {
            sphere.meet_from_anywhere(simd, ray, nearest);
        }
    }

    /// Returns the surface. The point is computed from the centre and the normal. So its distance from the sphere has
    /// the rounding errors of these alone, without that of the ray's distance.
    #[inline(always)]
    fn surface<S: Simd, const EYE: bool>(
        simd: S,
        sphere: &Sphere<E>,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        let center = Vec3::splat(simd, sphere.center);
        let to_center = if EYE { center } else { center.sub(ray.origin) };
        let outward = ray.direction.scale_sub(distance, to_center).normalize(simd);
        let offset = splat::<S, E>(simd, (sphere.outer - sphere.inner) * E::narrow(0.5));
        let outside = Surface {
            start: outward.scale_add(splat::<S, E>(simd, sphere.outer), center),
            normal: outward,
            offset,
            within: no_lane::<S, E>(simd),
        };
        if EYE && sphere.is_outside_the_eye() {
            return outside;
        }
        let inside = if EYE {
            let zero = constant::<S, E>(simd, 0.0);
            zero.simd_eq(zero)
        } else {
            // A ray that starts on the surface and hits the sphere goes through it.
            to_center.dot(to_center).simd_le(splat::<S, E>(simd, sphere.square))
        };
        if !EYE && !inside.any_true() {
            return outside;
        }
        let away = inside.select(splat::<S, E>(simd, sphere.inner), splat::<S, E>(simd, sphere.outer));
        let side = inside.select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0));
        let start = outward.scale_add(away, center);
        Surface { start, normal: outward.scale(side), offset, within: inside }
    }
}

/// A sphere on a sun's screen.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Circle<E> {
    /// The centre along the sun's axes.
    center: [E; 3],
    /// The square of the radius, r².
    square: E,
}

impl<E: Real> Circle<E> {
    /// Makes a circle. `axes` are the sun's [rounded](Sun::rounded) axes.
    pub(in crate::fast) fn new(sphere: &RenderSpaceSphere, axes: DMat3) -> Self {
        Self {
            center: (axes * sphere.center).to_array().map(E::narrow),
            square: E::narrow(sphere.radius * sphere.radius),
        }
    }

    /// Returns the points that the sphere occludes. They are given in the sun's axes.
    ///
    /// `rest` is the square of half the chord. The far end of the chord is ahead if `z + √rest > 0`, which for
    /// `rest >= 0` is `z·|z| > -rest`.
    #[inline(always)]
    fn occludes<S: Simd>(&self, simd: S, point: Vec3<S, E>) -> Mask<S, E> {
        let Vec3 { x, y, z } = Vec3::splat(simd, self.center).sub(point);
        let rest = splat::<S, E>(simd, self.square) - x.fused_mul_add(x, y * y);
        let ahead = z.fused_mul_add(z.abs(), rest);
        let zero = constant::<S, E>(simd, 0.0);
        rest.simd_ge(zero) & ahead.simd_gt(zero)
    }
}

impl<E: Real> Obstructs<E> for Sphere<E> {
    type Obstacle = Circle<E>;
    type SunPrecalculations<S: Simd> = Vec3<S, E>;

    #[inline(always)]
    fn face<S: Simd>(simd: S, sun: &Sun<E>, point: Vec3<S, E>) -> Vec3<S, E> {
        sun.facing(simd, point)
    }

    #[inline(always)]
    fn unoccluded<S: Simd>(
        simd: S,
        (circles, _): Obstacles<Circle<E>>,
        items: impl Items,
        _: &Sun<E>,
        (_, faced): (Vec3<S, E>, Vec3<S, E>),
        mut lit: Mask<S, E>,
    ) -> Mask<S, E> {
        for (_, circle) in items.of(circles) {
            lit &= !circle.occludes(simd, faced);
        }
        lit
    }
}
