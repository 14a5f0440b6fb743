//! Tori: the points at distance r from a circle of radius R.
//!
//! With ρ the distance from the axis, the surface is where s = (ρ - R)² + z² - r² is 0. Multiplied by its conjugate, s
//! becomes a quartic along the ray with the same sign. If t counts from the point nearest to the centre, the quartic's
//! cubic term is 0, and a quarter of its derivative is the cubic t³ + p·t + v. Between two roots of the cubic the
//! quartic is monotonic and has at most one root. So the roots of the cubic bracket the hits. Newton's method finds
//! them from starting points where it cannot overshoot. The quartic itself is never computed: if s has different signs
//! at the ends of an interval, the hit is in it. The error of s is a few roundoffs of the torus's size, far less than
//! the offset of a new ray from the surface.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::model::unit;

use super::solid::{Form, Frame, Place, Span};
use super::{BodyHit, Local};
use crate::fast::acceleration::hollow::Hollow;
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::bounds::Bounds;
use crate::fast::shared::{Ring, Surface};

/// The number of steps in which Newton's method alone finds most roots.
const FAST: u32 = 6;

/// The largest number of steps that narrow a bracket. After the fast steps every third one is a bisection, so that the
/// search ends at the last bit even if a ray grazes the torus and tangents help little.
const STEPS: u32 = FAST + 3 * f64::MANTISSA_DIGITS;

/// The largest number of steps to a root of the cubic. Each step is at most half as long as the one before; towards a
/// double root it is just half.
const TURN_STEPS: u32 = f64::MANTISSA_DIGITS;

/// The tolerance of a root of the cubic, relative to the torus. There, s is accurate to the square of it, and to the
/// cube at a double root.
const NEAR_TURN: f64 = 1e-6;

/// The margin within which rays through the hole are not taken to miss, relative to the torus and to its square.
const HOLE: f64 = 1e-9;

/// A torus centred at the origin, perpendicular to z. Lengths are in units of the torus.
#[derive(Clone, Copy, Debug)]
pub(super) struct Torus<E> {
    /// The radius R of the circle and the radius r of the tube.
    ring: E,
    tube: E,
}

/// The part of a ray that is near the torus.
#[derive(Clone, Copy)]
struct Chord<S: Simd, E: Real> {
    /// The point of the ray nearest to the centre.
    place: Vec3<S, E>,
    direction: Vec3<S, E>,
    ring: Lanes<S, E>,
    /// The square of the tube's radius, r².
    square: Lanes<S, E>,
}

impl<S: Simd, E: Real> Chord<S, E> {
    /// Returns s, which is negative within the tube.
    #[inline(always)]
    fn outside(&self, t: Lanes<S, E>) -> Lanes<S, E> {
        let Vec3 { x, y, z } = self.direction.scale_add(t, self.place);
        let over = x.fused_mul_add(x, y * y).sqrt() - self.ring;
        over.fused_mul_add(over, z * z) - self.square
    }

    /// Returns s and its derivative along the ray, which may be NaN on the axis.
    #[inline(always)]
    fn outside_and_slope(&self, t: Lanes<S, E>) -> (Lanes<S, E>, Lanes<S, E>) {
        let Vec3 { x, y, z } = self.direction.scale_add(t, self.place);
        let apart = x.fused_mul_add(x, y * y).sqrt();
        let over = apart - self.ring;
        let outwards = x.fused_mul_add(self.direction.x, y * self.direction.y) / apart;
        let half_slope = over.fused_mul_add(outwards, z * self.direction.z);
        (over.fused_mul_add(over, z * z) - self.square, half_slope + half_slope)
    }
}

impl<E: Real> Torus<E> {
    pub(super) fn new(radius: f64, thickness: f64) -> Self {
        Self { ring: E::narrow(radius), tube: E::narrow(thickness) }
    }

    #[inline(always)]
    pub(super) fn intersect<S: Simd>(
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
        let half_chord = outer.fused_mul_sub(outer, near).max(zero).sqrt();
        // The interval in which the ray is between the planes that touch the torus from above and below.
        let inverse = constant::<S, E>(simd, 1.0) / direction.z;
        let wide = tube * constant::<S, E>(simd, 1.0 + 8.0 * E::ROUNDOFF);
        let (a, b) = ((zero - wide - place.z) * inverse, (wide - place.z) * inverse);
        let is_along = direction.z.simd_eq(zero);
        let between = is_along & place.z.abs().simd_le(wide);
        let far = constant::<S, E>(simd, E::FAR);
        let low = is_along.select(between.select(zero - far, far), a.min(b));
        let high = is_along.select(between.select(far, zero - far), a.max(b));
        let begin = (zero - middle).max(zero - half_chord).max(low);
        let end = half_chord.min(high);
        // The nearest hit so far may end the search, but must not change the interval in which a root is bracketed: the
        // root's last bits would depend on it. The rounding error of the sum is far less than this slack.
        let slack = (outer + middle.abs() + limit.abs()) * constant::<S, E>(simd, 8.0 * E::ROUNDOFF);
        let limit = limit - middle + slack;
        // Between two points whose distances from the axis are less than that of the tube, all are less: the ray goes
        // through the hole. The margin is far more than the rounding errors of s.
        let inner = (ring - tube) * constant::<S, E>(simd, 1.0 - HOLE);
        let hole = inner * inner - outer * outer * constant::<S, E>(simd, HOLE);
        let apart = |t: Lanes<S, E>| {
            let (x, y) = (direction.x.fused_mul_add(t, place.x), direction.y.fused_mul_add(t, place.y));
            x.fused_mul_add(x, y * y)
        };
        let goes_through = inner.simd_gt(zero) & apart(begin).max(apart(end)).simd_lt(hole);
        let mut open =
            begin.simd_lt(end) & begin.simd_le(limit) & near.simd_lt(outer * outer) & !goes_through;
        let none = open & !open;
        if !open.any_true() {
            return (none, zero);
        }
        let chord = Chord { place, direction, ring, square: tube * tube };
        // A quarter of the quartic's derivative: t³ + p·t + v.
        let near_turn = outer * constant::<S, E>(simd, NEAR_TURN);
        let twice = (ring + ring) * ring * direction.z;
        let p = twice.fused_mul_add(direction.z, near - ring.fused_mul_add(ring, tube * tube));
        let v = twice * place.z;
        let cubic = Cubic::<S, E> { p, v };
        let turn = (zero - p * constant::<S, E>(simd, 1.0 / 3.0)).max(zero).sqrt();
        let least = begin.min(zero - turn);
        let most = end.max(turn);
        // The roots of the cubic in order. For an interval without a root it is the interval's end.
        let turns = [
            cubic_root::<S, E>(simd, cubic, (least, zero - turn), least, near_turn),
            cubic_root::<S, E>(simd, cubic, (zero - turn, turn), zero, near_turn),
            cubic_root::<S, E>(simd, cubic, (turn, most), most, near_turn),
            end,
        ];
        // An interval that begins before the torus begins outside. One that begins on the surface is monotonic up to
        // the first turn.
        let is_ahead = begin.simd_gt(zero - middle);
        let mut at_from = chord.outside(begin);
        let mut side = is_ahead.select(constant::<S, E>(simd, 1.0), at_from);
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
            at_from = goes_on.select(outside, at_from);
        }
        found &= from.simd_le(limit);
        if !found.any_true() {
            return (none, zero);
        }
        // If the ray only touches the surface, the turn is more accurate than the root.
        let touches = at_end.simd_eq(zero);
        let sign = side.simd_lt(zero).select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0));
        let error = outer * constant::<S, E>(simd, 2.0 * E::ROUNDOFF);
        let root = bracketed::<S, E>(
            simd,
            (from, at_from * sign),
            (to, at_end * sign),
            (found & !touches, error),
            #[inline(always)]
            |t| {
                let (outside, slope) = chord.outside_and_slope(t);
                (outside * sign, slope * sign)
            },
        );
        let distance = touches.select(to, root) + middle;
        (found & distance.simd_gt(zero), distance)
    }

    /// Returns the hit of each ray. A ray that starts within the torus hits the inside, any other the outside.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Local<S, E>, distance: Lanes<S, E>) -> BodyHit<S, E> {
        let (zero, one) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 1.0));
        let (ring, tube) = (splat::<S, E>(simd, self.ring), splat::<S, E>(simd, self.tube));
        let place = ray.direction.scale_add(distance, ray.origin);
        let apart = place.x.fused_mul_add(place.x, place.y * place.y).sqrt();
        let part = ring / apart;
        let circle = Vec3::<S, E>::new(place.x * part, place.y * part, zero);
        let outward = place.sub(circle).normalize(simd);
        let start = Chord { place: ray.origin, direction: ray.direction, ring, square: tube * tube };
        let outside = start.outside(zero);
        // A ray from the surface itself that goes inwards is within.
        let inwards = outside.simd_eq(zero) & outward.dot(ray.direction).simd_gt(zero);
        let within = outside.simd_lt(zero) | inwards;
        let side = within.select(zero - one, one);
        BodyHit { point: outward.scale_add(tube, circle), normal: outward.scale(side), within }
    }
}

/// The cubic t³ + p·t + v.
#[derive(Clone, Copy)]
struct Cubic<S: Simd, E: Real> {
    p: Lanes<S, E>,
    v: Lanes<S, E>,
}

impl<S: Simd, E: Real> Cubic<S, E> {
    #[inline(always)]
    fn at(&self, t: Lanes<S, E>) -> Lanes<S, E> {
        t.fused_mul_add(t, self.p).fused_mul_add(t, self.v)
    }
}

/// Returns the root of the cubic between two points, between which it is monotonic, or the second point if it has no
/// root there. On the way from `start` to the root the cubic bends away from 0, so that no tangent overshoots the root.
#[inline(always)]
fn cubic_root<S: Simd, E: Real>(
    simd: S,
    cubic: Cubic<S, E>,
    (from, to): (Lanes<S, E>, Lanes<S, E>),
    start: Lanes<S, E>,
    near: Lanes<S, E>,
) -> Lanes<S, E> {
    let (zero, three) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 3.0));
    let (first, last) = (cubic.at(from), cubic.at(to));
    let changes = (first * last).simd_lt(zero) & from.simd_lt(to);
    let (mut open, mut root) = (changes, start);
    for _ in 0..TURN_STEPS {
        if !open.any_true() {
            break;
        }
        let here = cubic.at(root);
        let step = here / (three * root).fused_mul_add(root, cubic.p);
        let next = (root - step).max(from).min(to);
        let moves = here.simd_ne(zero) & (next - root).abs().simd_gt(near);
        root = (open & here.simd_ne(zero)).select(next, root);
        open &= moves;
    }
    changes.select(root, to)
}

/// Returns a root of a function, to within `error`. The function is not negative at the first of two points, and
/// negative or 0 at the second. Both points come with their values; `value` returns a value and its slope. Only the
/// `wanted` lanes need be right.
///
/// Uses Newton's method within a bracket, and bisection where a step would leave the bracket or convergence is slow.
/// Each lane is independent of the others.
#[inline(always)]
fn bracketed<S: Simd, E: Real>(
    simd: S,
    (mut low, at_low): (Lanes<S, E>, Lanes<S, E>),
    (mut high, at_high): (Lanes<S, E>, Lanes<S, E>),
    (wanted, error): (Mask<S, E>, Lanes<S, E>),
    value: impl Fn(Lanes<S, E>) -> (Lanes<S, E>, Lanes<S, E>),
) -> Lanes<S, E> {
    let (zero, half) = (constant::<S, E>(simd, 0.0), constant::<S, E>(simd, 0.5));
    let middle = half.fused_mul_add(low, half * high);
    let secant = low + (high - low) * (at_low / (at_low - at_high));
    let mut place = (secant.simd_gt(low) & secant.simd_lt(high)).select(secant, middle);
    let (mut root, mut open) = (place, wanted);
    for step in 0..STEPS {
        open &= (high - low).simd_gt(error) & place.simd_gt(low) & place.simd_lt(high);
        if !open.any_true() {
            break;
        }
        let (here, slope) = value(place);
        let is_before = here.simd_gt(zero);
        low = (open & is_before).select(place, low);
        high = (open & !is_before).select(place, high);
        let middle = half.fused_mul_add(low, half * high);
        let tangent = place - here / slope;
        let is_between = tangent.simd_gt(low) & tangent.simd_lt(high);
        let stays = (tangent - place).abs().simd_le(error);
        let ends = here.simd_eq(zero) | stays;
        let end = here.simd_eq(zero).select(place, tangent);
        let halves = step >= FAST && step % 3 == 2;
        let next = if halves { middle } else { is_between.select(tangent, middle) };
        root = open.select(ends.select(end, middle), root);
        place = open.select(next, place);
        open &= !ends;
    }
    root
}

/// A torus in its frame, perpendicular to the last axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct TorusForm {
    pub(super) radius: f64,
    pub(super) thickness: f64,
}

impl TorusForm {
    pub(super) fn new(torus: &rayfold_scene::Torus, place: Place) -> (Frame, Self) {
        let frame = Frame::round_about(unit(torus.normal()), place.point(torus.center()));
        (frame, Self { radius: place.scale * torus.radius(), thickness: place.scale * torus.thickness() })
    }
}

impl Form for TorusForm {
    fn size(&self) -> f64 {
        self.radius + self.thickness
    }

    fn each_surface(&self, frame: &Frame, each: &mut dyn FnMut(Surface)) {
        let &Frame { axes: [.., axis], center } = frame;
        each(Surface::Ring(Ring { center, axis, radius: self.radius, thickness: self.thickness }));
    }

    fn is_near(&self, place: DVec3, near: f64, _: bool) -> bool {
        let aside = libm::hypot(place.x, place.y);
        (libm::hypot(aside - self.radius, place.z) - self.thickness).abs() <= near
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (frame.center, self.size())
    }

    fn bounds(&self, frame: &Frame) -> Option<Bounds> {
        let reach = self.radius * frame.circle() + self.thickness;
        Some((frame.center - reach, frame.center + reach))
    }

    fn slab(&self, frame: &Frame) -> Option<Span> {
        Some(Span::across(frame, self.thickness, (self.radius - self.thickness).max(0.0)))
    }

    fn hollow(&self, frame: &Frame) -> Option<Hollow> {
        Some((frame.center, self.radius - self.thickness))
    }
}
