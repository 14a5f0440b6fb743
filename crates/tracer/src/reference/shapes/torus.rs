//! Tori, in coordinates of their own.
//!
//! Let ρ be the distance from the axis, and z the height above the circle's plane. The surface is the set where the
//! signed distance s = √((ρ - R)² + z²) - r is 0. Squaring twice gives q, a quartic along the ray, with the sign of s.
//! Between two roots of its derivative, a cubic, q has at most one root. So the roots of the cubic bracket the hits,
//! and the roots of the cubic's derivative bracket those of the cubic. The quartic q itself is never computed. If s has
//! different signs at the ends of an interval, there is a hit in it.
//!
//! The error of s is a few roundoffs of the torus's size. The error of a root of the cubic enters s only by its square.
//! Rays that touch the torus within such an error may miss it. Lengths are in units of the torus, scaled by a power of
//! two.

use std::cmp::Ordering;

use glam::DVec3;
use rayfold_scene::Torus;
use rayfold_scene::model::unit;

use super::double_double::{DoubleDouble, Place, between, dot};
use super::{ROUNDOFF, Shape, Sides, Surface};
use crate::camera::Ray;
use crate::scale::below_inverse;

/// The distance, in sizes of the torus, beyond which an origin is certainly outside.
const FAR: f64 = 4.0;

/// The largest number of steps that narrow a bracket. Each of the last half of them is a bisection.
const STEPS: u32 = 120;

impl Shape for Torus {
    fn extent(&self, origin: DVec3) -> f64 {
        self.center().abs().max(origin.abs()).max_element().max(self.radius() + self.thickness())
    }

    fn distance(&self, ray: Ray) -> Option<f64> {
        intersect(self, ray).map(|(distance, _)| distance)
    }

    /// Returns the surface. The point has the rounding errors of the vector from the centre to the circle and on to the
    /// surface, and of the sum with the centre: fewer than 16 roundoffs of the largest number.
    fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let Some((_, within)) = intersect(self, ray) else {
            unreachable!("the ray hits the torus at {distance}")
        };
        let axis = unit(self.normal());
        let from_center = (ray.origin - self.center()) + distance * ray.direction;
        let aside = from_center - from_center.dot(axis) * axis;
        let circle = self.radius() * unit(aside);
        let outward = unit(from_center - circle);
        let largest = self.center().abs().max_element() + self.radius() + self.thickness();
        Surface {
            point: self.center() + (circle + self.thickness() * outward),
            normal: if within { -outward } else { outward },
            offset: 64.0 * ROUNDOFF * largest,
            flat: false,
            within,
        }
    }

    fn sides(&self, place: Place) -> Sides {
        [f64::from(side(self, place) as i8), 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

/// Returns whether a point is outside (greater), inside (less) or on the surface (equal). It is computed with twice the
/// precision.
fn side(torus: &Torus, place: impl Into<Place>) -> Ordering {
    let scale = below_inverse(torus.radius() + torus.thickness());
    let from_center = between(place, torus.center(), scale);
    let normal = torus.normal() * below_inverse(torus.normal().abs().max_element());
    let normal = normal.to_array().map(DoubleDouble::from);
    let square = |x: DoubleDouble| x * x;
    let [ring, tube] = [torus.radius(), torus.thickness()].map(|r| square(DoubleDouble::from(r * scale)));
    let (apart, along, of_normal) =
        (dot(from_center, from_center), dot(from_center, normal), dot(normal, normal));
    // (|p|² + R² - r²)²·n² - 4R²·(|p|²·n² - (p·n)²)
    let far = square(apart + ring - tube) * of_normal;
    let near = DoubleDouble::from(4.0) * ring * (apart * of_normal - square(along));
    let largest = (apart.value() + ring.value()).powi(2) * of_normal.value();
    let side = (far - near).beside(largest);
    side.partial_cmp(&0.0).unwrap_or(Ordering::Greater)
}

/// Returns the first hit in front of the origin, and whether the ray comes from within.
fn intersect(torus: &Torus, ray: Ray) -> Option<(f64, bool)> {
    let scale = below_inverse(torus.radius() + torus.thickness());
    let (ring, tube) = (torus.radius() * scale, torus.thickness() * scale);
    let axis = unit(torus.normal());
    let from_center = ray.origin - torus.center();
    // The point of the ray nearest to the centre. The origin is at `-middle` from it.
    let middle = -from_center.dot(ray.direction);
    let near = (from_center + middle * ray.direction) * scale;
    let middle = middle * scale;
    let outer = (ring + tube) * (1.0 + FAR * ROUNDOFF);
    let half_chord = outer * outer - near.length_squared();
    if half_chord.is_nan() || half_chord < 0.0 {
        return None;
    }
    let half_chord = half_chord.sqrt();
    let begin = -middle;
    if begin >= half_chord {
        return None;
    }
    let starts = if begin < -half_chord { Ordering::Greater } else { side(torus, ray.origin) };
    let begin = begin.max(-half_chord);

    let (height, rise) = (near.dot(axis), ray.direction.dot(axis));
    let apart = |u: f64| {
        let place = near + u * ray.direction;
        let z = height + u * rise;
        let aside = (place - place.dot(axis) * axis).length();
        libm::hypot(aside - ring, z) - tube
    };
    // A quarter of the derivative of q: u³ + p·u + v.
    let p = near.length_squared() - ring * ring - tube * tube + 2.0 * ring * ring * rise * rise;
    let v = 2.0 * ring * ring * height * rise;
    let mut ends = [half_chord; 4];
    for (end, turn) in ends.iter_mut().zip(turns(p, v, half_chord)) {
        *end = turn;
    }

    let mut from = (begin, starts);
    for end in ends {
        if end <= from.0 {
            continue;
        }
        let to = if end == half_chord { Ordering::Greater } else { sign(apart(end)) };
        let crossed = match from.1 {
            Ordering::Greater => to != Ordering::Greater,
            Ordering::Less => to != Ordering::Less,
            // From the surface: q is monotonic up to the end.
            Ordering::Equal => false,
        };
        if crossed {
            let within = from.1 == Ordering::Less;
            // If the ray only touches the surface, the turn is more accurate than the root.
            let touches = to == Ordering::Equal;
            let place = if touches { end } else { bracketed(apart, [from.0, end], within) };
            let distance = (place + middle) / scale;
            return (distance > 0.0).then_some((distance, within));
        }
        from = (end, to);
    }
    None
}

fn sign(x: f64) -> Ordering {
    x.partial_cmp(&0.0).unwrap_or(Ordering::Greater)
}

/// Returns the roots of u³ + p·u + v between `-most` and `most`, in order.
fn turns(p: f64, v: f64, most: f64) -> impl Iterator<Item = f64> {
    let cubic = move |u: f64| (u * u + p) * u + v;
    // The cubic's own extrema are at ± this point, if it has any.
    let turn = (-p / 3.0).max(0.0).sqrt().min(most);
    [[-most, -turn], [-turn, turn], [turn, most]].into_iter().filter_map(move |[from, to]| {
        let (first, last) = (cubic(from), cubic(to));
        if from < to && first * last <= 0.0 { Some(bracketed(cubic, [from, to], first < 0.0)) } else { None }
    })
}

/// Returns a root of a function that has one between two points. The function is negative before the root if `rises`.
///
/// Uses regula falsi with the weights of the Illinois variant (Dowell and Jarratt 1971), then bisection.
fn bracketed(f: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2], rises: bool) -> f64 {
    let signed = |x: f64| if rises { f(x) } else { -f(x) };
    // At the ends the signs are known, whatever the rounding.
    let (mut at_low, mut at_high) = (signed(low).min(0.0), signed(high).max(0.0));
    for step in 0..STEPS {
        let middle = 0.5 * low + 0.5 * high;
        if middle <= low || middle >= high {
            break;
        }
        let secant = low - at_low * ((high - low) / (at_high - at_low));
        let place = if step < STEPS / 2 && secant > low && secant < high { secant } else { middle };
        let value = signed(place);
        if value < 0.0 {
            (low, at_low) = (place, value);
            at_high *= 0.5;
        } else if value > 0.0 {
            (high, at_high) = (place, value);
            at_low *= 0.5;
        } else {
            return place;
        }
    }
    0.5 * low + 0.5 * high
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::reference::shapes::{distance, surface};

    fn ring() -> Object {
        Torus::new(3.0, 1.0, DVec3::ZERO, DVec3::new(0.0, 2.0, 0.0), Material::default()).unwrap().into()
    }

    fn t(origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let ray = Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() };
        distance(&ring(), ray)
    }

    fn near(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|t| (t - expected).abs() <= 1e-14 * expected.abs().max(1.0))
    }

    #[test]
    fn a_ray_meets_a_torus_up_to_four_times() {
        assert!(near(t([9.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 5.0));
        assert!(near(t([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 1.0), "from within the tube");
        assert!(near(t([0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 2.0), "from the hole");
        assert!(near(t([-3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 1.0));
        assert_eq!(t([-5.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(t([0.0, 9.0, 0.0], [0.0, -1.0, 0.0]), None, "through the hole");
        assert!(near(t([3.0, 9.0, 0.0], [0.0, -1.0, 0.0]), 8.0));
    }

    #[test]
    fn a_torus_is_not_met_from_its_own_surface() {
        assert_eq!(t([4.0, 0.0, 0.0], [1.0, 0.0, 0.0]), None);
        assert!(near(t([4.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 2.0), "through the tube");
        assert!(near(t([2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), 4.0), "over the hole");
        assert!(near(t([2.0, 0.0, 0.0], [1.0, 0.0, 0.0]), 2.0));
        assert_eq!(t([3.0, 1.0, 0.0], [0.0, 1.0, 0.0]), None);
    }

    #[test]
    fn tangents_touch() {
        assert!(near(t([9.0, 1.0, 0.0], [-1.0, 0.0, 0.0]), 6.0), "on the top circle");
        assert_eq!(t([9.0, 1.000_000_000_000_01, 0.0], [-1.0, 0.0, 0.0]), None);
        assert!(near(t([4.0, 0.0, 9.0], [0.0, 0.0, -1.0]), 9.0), "at the outer equator");
        assert_eq!(t([4.000_000_000_000_01, 0.0, 9.0], [0.0, 0.0, -1.0]), None);
        assert!(near(t([2.0, 9.0, 0.0], [0.0, -1.0, 0.0]), 9.0), "at the inner equator");
        assert_eq!(t([1.999_999_999_999_99, 9.0, 0.0], [0.0, -1.0, 0.0]), None);
    }

    #[test]
    fn a_far_eye_and_a_power_of_two_change_nothing() {
        let near =
            Ray { origin: DVec3::new(5.0, 6.0, 1.5), direction: DVec3::new(-0.3, -1.0, 0.1).normalize() };
        let expected = distance(&ring(), near).unwrap();
        for exponent in [-700, -90, -1, 1, 90, 700] {
            let scale = 2f64.powi(exponent);
            let placed = ring().placed(scale, |p| scale * p).unwrap();
            let r = Ray { origin: near.origin * scale, ..near };
            assert_eq!(distance(&placed, r), Some(expected * scale), "2^{exponent}");
        }
        for far in [1e3, 1e9, 1e15] {
            let r = Ray { origin: near.origin - far * near.direction, ..near };
            let t = distance(&ring(), r).unwrap() - far;
            assert!((t - expected).abs() <= 8.0 * f64::EPSILON * far, "{t} from {far:e}");
        }
    }

    #[test]
    fn what_is_hit_lies_on_the_surface_and_is_left() {
        let mut rng = fastrand::Rng::with_seed(20);
        let mut random = || DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        let mut hits = 0;
        for round in 0..20_000 {
            let thickness = [0.999, 0.3, 1e-3][round % 3];
            let (center, normal) = (5.0 * random(), random());
            let object = Torus::new(1.0, thickness, center, normal, Material::default()).unwrap().into();
            let origin = center + 3.0 * random();
            let target = center + 1.5 * random();
            let r = Ray { origin, direction: (target - origin).normalize() };
            let Some(t) = distance(&object, r) else { continue };
            hits += 1;
            let s = surface(&object, r, t);
            let along = (origin + t * r.direction).distance(s.point);
            assert!(along < 1e-14 / thickness, "{along} aside in round {round}");
            assert!(s.normal.dot(r.direction) < 1e-7, "round {round}");
            let start = s.point + s.offset * s.normal;
            let again = distance(&object, Ray { origin: start, direction: s.normal });
            assert!(again.is_none_or(|t| t > 1e-3 * thickness), "round {round}: {again:?}");
        }
        assert!(hits > 2000);
    }
}
