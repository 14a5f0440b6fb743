//! Spheres.

use std::ops::Range;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};

use crate::fast::bounds::Bounds;
use crate::fast::lights::sun::Sun;
use crate::fast::packet::{Nearest, Ray, Surface, no_lane};
use crate::fast::placed::{self, Face, Sight};
use crate::fast::predicate::Place;
use crate::fast::real::{Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rounding::OFFSET;
use crate::fast::shape::{Aim, Items, Obstacles, Obstructs, Robust, Tests};
use crate::reference::power;

/// A sphere in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Placed {
    pub(in crate::fast) center: DVec3,
    pub(in crate::fast) radius: f64,
    /// That of the eye: |center|² - radius², as exact as a number can be.
    pub(in crate::fast) power: f64,
}

impl Placed {
    /// Moved so that `center` is the origin, and then scaled.
    pub(in crate::fast) fn new(sphere: &rayfold_scene::Sphere, center: DVec3, scale: f64) -> Self {
        Self {
            center: (sphere.center() - center) * scale,
            radius: sphere.radius() * scale,
            power: power(center, sphere, scale),
        }
    }
}

/// The largest distance along an axis from `center` to a point of the sphere.
pub(in crate::fast) fn reach(sphere: &rayfold_scene::Sphere, center: DVec3) -> f64 {
    (sphere.center() - center).abs().max_element() + sphere.radius()
}

impl placed::Placed for Placed {
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
            let (angle, half) = (x.atan2(depth), (radius / x.hypot(depth)).asin());
            // The rounding errors of the three functions, generously.
            ((angle - half).tan() * (1.0 + 1e-12) - 1e-12, (angle + half).tan() * (1.0 + 1e-12) + 1e-12)
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

    /// `power` is the difference of two squares without cancellation.
    fn nearest(&self) -> f64 {
        self.power.abs() / (self.center.length() + self.radius)
    }

    fn shadow_nearest(&self, x: DVec3, y: DVec3) -> f64 {
        (self.center.dot(x).hypot(self.center.dot(y)) - self.radius).abs()
    }

    /// An outline is off by the errors of a point on it, and what touches the sphere or is mirrored in it by where rays
    /// start from it; a normal by the errors of the point for the radius.
    fn is_fine(&self, sight: &Sight) -> bool {
        let &Self { center, radius, .. } = self;
        let (away, size) = (center.length(), center.length() + radius);
        let seen = sight.parallel || radius > 0.5 * sight.pixel * away;
        let bent = sight.point * sight.roundoff * size > sight.normal * radius;
        sight.is_invisible(sight.start * size, self.nearest()) && !(seen && bent)
    }
}

/// A sphere as the kernels read it.
#[derive(Clone, Copy, Debug)]
pub(in crate::fast) struct Sphere<E> {
    pub(in crate::fast) center: [E; 3],
    /// r²
    pub(in crate::fast) square: E,
    /// Position in the script.
    pub(in crate::fast) order: E,
    /// |c|² - r² without cancellation: the power of the eye, for rays from there.
    pub(in crate::fast) power: E,
    /// Distance from the centre at which rays leave its outside and its inside.
    pub(in crate::fast) outer: E,
    inner: E,
}

impl<E: Real> Sphere<E> {
    pub(in crate::fast) fn new(&Placed { center, radius, power }: &Placed, order: u32) -> Self {
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

    /// Whether the eye lies outside: then rays from there see it from without, and it is not in its own light.
    #[inline(always)]
    pub(in crate::fast) fn is_outside_the_eye(&self) -> bool {
        self.power > E::narrow(0.0)
    }

    /// Haines, Günther, Akenine-Möller, "Precision improvements for ray/sphere intersection", Ray Tracing Gems ch. 7.
    ///
    /// The subtraction that is left costs no more than the origin's own rounding.
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

    /// The same with the second root from the eye's power, so that a sphere next to the eye is as exact as one far away.
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
            // A sum without cancellation: every ray from within meets the sphere, grazing ones from its surface too.
            let half_chord = middle.mul_add(middle, -power).sqrt();
            let far = ahead.select(middle + half_chord, middle - half_chord);
            let distance = ahead.select(far, power / far);
            nearest.offer(simd, distance.simd_gt(zero), distance, self.order);
        }
    }
}

impl<E: Real> Aim<E> for Sphere<E> {
    type Aimed<S: Simd> = ();

    #[inline(always)]
    fn aim<S: Simd>(_: S, _: Ray<S, E>) {}
}

impl<E: Real> Tests<Sphere<E>, E> for Robust {
    #[inline(always)]
    fn meet<S: Simd, const EYE: bool>(
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

    /// The point is worked out from the centre and the normal, so that it is off the sphere by the rounding of these
    /// alone, and not by that of the distance.
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
            // What starts on the surface and meets the sphere goes through it.
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
    /// r²
    square: E,
}

impl<E: Real> Circle<E> {
    /// `axes` are the sun's [rounded](Sun::rounded) ones.
    pub(in crate::fast) fn new(sphere: &Placed, axes: DMat3) -> Self {
        Self {
            center: (axes * sphere.center).to_array().map(E::narrow),
            square: E::narrow(sphere.radius * sphere.radius),
        }
    }

    /// Whether it keeps the light from points, which are in the sun's axes.
    ///
    /// `rest` is the square of half the chord; the far end of it is ahead when `z + √rest > 0`, which for `rest >= 0` is
    /// `z·|z| > -rest`.
    #[inline(always)]
    fn occludes<S: Simd>(&self, simd: S, point: Vec3<S, E>) -> Mask<S, E> {
        let Vec3 { x, y, z } = Vec3::splat(simd, self.center).sub(point);
        let rest = splat::<S, E>(simd, self.square) - x.mul_add(x, y * y);
        let ahead = z.mul_add(z.abs(), rest);
        let zero = constant::<S, E>(simd, 0.0);
        rest.simd_ge(zero) & ahead.simd_gt(zero)
    }
}

impl<E: Real> Obstructs<E> for Sphere<E> {
    type Obstacle = Circle<E>;
    type Faced<S: Simd> = Vec3<S, E>;

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
