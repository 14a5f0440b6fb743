//! Tori: all that is as far as r from a circle of radius R.
//!
//! With ρ the distance from the axis, the surface is where s = (ρ - R)² + z² - r² is 0. Squared, that is a quartic along
//! the ray with the sign of s; from the place nearest to the middle, where its cubic term is 0, its derivative over 4 is
//! t³ + p·t + v. Between two roots of that the quartic goes one way and has one root at most. So roots are bracketed: by
//! those of the cubic, which are bracketed by where it turns itself. The quartic is never computed: where s has another
//! sign at both ends of such a stretch, there is the hit. s errs by some roundoffs of the torus's size, far less than what
//! a new ray starts off the surface by.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::{Local, Met};
use crate::fast::real::{Lanes, Mask, Real, Vec3, constant, splat};

/// A bracket is narrowed so often at most: every third time it is halved, so that it ends at the last bit also where a ray
/// grazes the torus and secants help little.
const STEPS: u32 = 3 * f64::MANTISSA_DIGITS;

/// Around the origin, square to z; lengths are in units of the torus.
#[derive(Clone, Copy, Debug)]
pub(super) struct Torus<E> {
    /// R and r.
    ring: E,
    tube: E,
}

/// The part of a ray that is near the torus.
#[derive(Clone, Copy)]
struct Chord<S: Simd, E: Real> {
    /// The place nearest to the middle.
    place: Vec3<S, E>,
    direction: Vec3<S, E>,
    ring: Lanes<S, E>,
    /// r²
    square: Lanes<S, E>,
}

impl<S: Simd, E: Real> Chord<S, E> {
    /// Negative within the tube.
    #[inline(always)]
    fn outside(&self, t: Lanes<S, E>) -> Lanes<S, E> {
        let Vec3 { x, y, z } = self.direction.scale_add(t, self.place);
        let over = x.mul_add(x, y * y).sqrt() - self.ring;
        over.mul_add(over, z * z) - self.square
    }
}

impl<E: Real> Torus<E> {
    pub(super) fn new(radius: f64, thickness: f64) -> Self {
        Self { ring: E::narrow(radius), tube: E::narrow(thickness) }
    }

    #[inline(always)]
    pub(super) fn meet<S: Simd>(
        &self,
        simd: S,
        ray: Local<S, E>,
        limit: Lanes<S, E>,
    ) -> (Mask<S, E>, Lanes<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let Local { origin, direction } = ray;
        let (ring, tube) = (splat::<S, E>(simd, self.ring), splat::<S, E>(simd, self.tube));
        let middle = zero - origin.dot(direction);
        let place = direction.scale_add(middle, origin);
        let outer = (ring + tube) * constant::<S, E>(simd, 1.0 + 8.0 * E::ROUNDOFF);
        let near = place.dot(place);
        let half_chord = outer.mul_sub(outer, near).max(zero).sqrt();
        // Where the ray is between the planes that touch the torus from above and below.
        let inverse = constant::<S, E>(simd, 1.0) / direction.z;
        let wide = tube * constant::<S, E>(simd, 1.0 + 8.0 * E::ROUNDOFF);
        let (a, b) = ((zero - wide - place.z) * inverse, (wide - place.z) * inverse);
        let is_along = direction.z.simd_eq(zero);
        let between = is_along & place.z.abs().simd_le(wide);
        let far = constant::<S, E>(simd, E::FAR);
        let low = is_along.select(between.select(zero - far, far), a.min(b));
        let high = is_along.select(between.select(far, zero - far), a.max(b));
        let begin = (zero - middle).max(zero - half_chord).max(low);
        let end = half_chord.min(high).min(limit - middle);
        let mut open = begin.simd_lt(end) & near.simd_lt(outer * outer);
        let none = open & !open;
        if !open.any_true() {
            return (none, zero);
        }
        let chord = Chord { place, direction, ring, square: tube * tube };
        // The cubic over 4: t³ + p·t + v.
        let error = outer * constant::<S, E>(simd, 2.0 * E::ROUNDOFF);
        let twice = (ring + ring) * ring * direction.z;
        let p = twice.mul_add(direction.z, near - ring.mul_add(ring, tube * tube));
        let v = twice * place.z;
        let cubic = Cubic::<S, E> { p, v };
        let turn = (zero - p * constant::<S, E>(simd, 1.0 / 3.0)).max(zero).sqrt();
        let least = begin.min(zero - turn);
        let most = end.max(turn);
        // The roots of the cubic in order; where a stretch has none, its end.
        let turns = [
            cubic_root::<S, E>(simd, cubic, (least, zero - turn), error),
            cubic_root::<S, E>(simd, cubic, (zero - turn, turn), error),
            cubic_root::<S, E>(simd, cubic, (turn, most), error),
            end,
        ];
        // What begins before the torus does is outside; what begins on it goes one way up to the first turn.
        let is_ahead = begin.simd_gt(zero - middle);
        let mut side = is_ahead.select(constant::<S, E>(simd, 1.0), chord.outside(begin));
        let (mut from, mut to, mut at_end, mut found) = (begin, begin, zero, none);
        for turn in turns {
            let here = turn.max(from).min(end);
            let outside = chord.outside(here);
            let enters = side.simd_gt(zero) & outside.simd_le(zero);
            let leaves = side.simd_lt(zero) & outside.simd_ge(zero);
            let crossed = open & (enters | leaves);
            to = crossed.select(here, to);
            at_end = crossed.select(outside, at_end);
            found |= crossed;
            open &= !crossed;
            let goes_on = open & here.simd_gt(from);
            from = goes_on.select(here, from);
            side = goes_on.select(outside, side);
        }
        if !found.any_true() {
            return (none, zero);
        }
        // Where it only touches, the turn is known better than the root.
        let touches = at_end.simd_eq(zero);
        let sign = side.simd_lt(zero).select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0));
        let root = bracketed::<S, E>(
            simd,
            from,
            to,
            (found & !touches, error),
            #[inline(always)]
            |t| chord.outside(t) * sign,
        );
        let distance = touches.select(to, root) + middle;
        (found & distance.simd_gt(zero), distance)
    }

    /// From within what is met first is the inside; from without it is the outside.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Local<S, E>, distance: Lanes<S, E>) -> Met<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let (ring, tube) = (splat::<S, E>(simd, self.ring), splat::<S, E>(simd, self.tube));
        let place = ray.direction.scale_add(distance, ray.origin);
        let apart = place.x.mul_add(place.x, place.y * place.y).sqrt();
        let part = ring / apart;
        let circle = Vec3::<S, E>::new(place.x * part, place.y * part, zero);
        let outward = place.sub(circle).normalize(simd);
        let start = Chord { place: ray.origin, direction: ray.direction, ring, square: tube * tube };
        let outside = start.outside(zero);
        // From the surface itself what goes inwards is within.
        let inwards = outside.simd_eq(zero) & outward.dot(ray.direction).simd_gt(zero);
        let within = outside.simd_lt(zero) | inwards;
        let side = within.select(zero - one, one);
        Met { point: outward.scale_add(tube, circle), normal: outward.scale(side), within }
    }
}

/// t³ + p·t + v
#[derive(Clone, Copy)]
struct Cubic<S: Simd, E: Real> {
    p: Lanes<S, E>,
    v: Lanes<S, E>,
}

impl<S: Simd, E: Real> Cubic<S, E> {
    #[inline(always)]
    fn at(&self, t: Lanes<S, E>) -> Lanes<S, E> {
        t.mul_add(t, self.p).mul_add(t, self.v)
    }
}

/// Where the cubic is 0 between two places, between which it goes one way; the second place where it is not 0.
#[inline(always)]
fn cubic_root<S: Simd, E: Real>(
    simd: S,
    cubic: Cubic<S, E>,
    (from, to): (Lanes<S, E>, Lanes<S, E>),
    error: Lanes<S, E>,
) -> Lanes<S, E> {
    let zero = constant::<S, E>(simd, 0.0);
    let (first, last) = (cubic.at(from), cubic.at(to));
    let changes = (first * last).simd_lt(zero) & from.simd_lt(to);
    if !changes.any_true() {
        return to;
    }
    let sign = first.simd_lt(zero).select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0));
    let root = bracketed::<S, E>(
        simd,
        from,
        to,
        (changes, error),
        #[inline(always)]
        |t| cubic.at(t) * sign,
    );
    changes.select(root, to)
}

/// Where a function is 0, to within an `error`, that is not negative at `from` and negative, or 0, at `to`. Only the
/// `wanted` lanes need be right.
///
/// Regula falsi with the weights of Illinois (Dowell and Jarratt 1971) and bisection in turns. Each lane goes its own way,
/// whatever the others do.
#[inline(always)]
fn bracketed<S: Simd, E: Real>(
    simd: S,
    from: Lanes<S, E>,
    to: Lanes<S, E>,
    (wanted, error): (Mask<S, E>, Lanes<S, E>),
    value: impl Fn(Lanes<S, E>) -> Lanes<S, E>,
) -> Lanes<S, E> {
    let (zero, half) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 0.5));
    let (mut low, mut high) = (from, to);
    let (mut at_low, mut at_high) = (value(low).max(zero), value(high).min(zero));
    let mut open = wanted;
    for step in 0..STEPS {
        let middle = half.mul_add(low, half * high);
        let secant = low + (high - low) * (at_low / (at_low - at_high));
        let is_between = secant.simd_gt(low) & secant.simd_lt(high);
        let place = if step % 3 == 2 { middle } else { is_between.select(secant, middle) };
        open &= (high - low).simd_gt(error) & middle.simd_gt(low) & middle.simd_lt(high);
        if !open.any_true() {
            break;
        }
        let here = value(place);
        let is_before = here.simd_gt(zero);
        let (before, after) = (open & is_before, open & !is_before);
        low = before.select(place, low);
        at_high = before.select(at_high * half, at_high);
        at_low = before.select(here, at_low);
        high = after.select(place, high);
        at_low = after.select(at_low * half, at_low);
        at_high = after.select(here, at_high);
        // A root that is hit is the end.
        low = (open & here.simd_eq(zero)).select(place, low);
    }
    half.mul_add(low, half * high)
}
