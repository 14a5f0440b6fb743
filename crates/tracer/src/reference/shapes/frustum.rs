//! Frusta: cylinders and cones, rotationally symmetric about an axis, with straight sides, closed by caps.
//!
//! Let z be the height above the end a, ρ the vector from the axis, and r(z) = Ra + k·z the radius there. The side is
//! the surface f = |ρ|² - r² = 0. The body is convex, so a ray has one interval in it. Lengths are in units of the
//! body, scaled by a power of two. A distant origin is first moved near the body along the ray. So each decision about
//! a ray has errors of some roundoffs of the body's size.

use glam::DVec3;
use rayfold_scene::model::unit;

use super::double_double::{DoubleDouble, Place, between, cross, dot};
use super::{ROUNDOFF, Sides, Surface, nearer, plane, sign};
use crate::camera::Ray;
use crate::scale::below_inverse;

/// A frustum: the radii at the ends of an axis.
pub(super) struct Frustum {
    pub(super) radii: [f64; 2],
    pub(super) ends: [DVec3; 2],
}

/// A part of the surface. On a rim it is the side.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Side,
    /// The cap at the end a or b.
    Cap(usize),
}

/// The interval of a ray in the body: the distances at which it enters and leaves, in world units.
struct Stretch {
    enter: (f64, Part),
    leave: (f64, Part),
}

/// The distance, in sizes of the body, beyond which an origin is moved near it.
const FAR: f64 = 8.0;

/// The rounding error of a hit on the side or a cap, in roundoffs of the body's size and of the distance. Edges belong
/// to the body.
const EDGE: f64 = 8.0;

/// The cosine of the angle to the axis above which a normal is that of a cap. A normal of the side has a larger angle.
pub(super) const CAP: f64 = 1.0 - 1e-12;

impl Frustum {
    /// Returns whether a unit normal is that of a cap.
    pub(super) fn is_cap(&self, normal: DVec3) -> bool {
        let [a, b] = self.ends;
        unit(b - a).dot(normal).abs() > CAP
    }

    /// Returns the axis of the coordinates that is parallel to the body's axis, and the coordinate of the cap that is
    /// nearer to a point. Returns `None` if the body is parallel to no axis.
    pub(super) fn cap(&self, place: DVec3) -> Option<(usize, f64)> {
        let [a, b] = self.ends;
        let mut differing = (0..3).filter(|&axis| a[axis] != b[axis]);
        let axis = differing.next()?;
        differing.next().is_none().then(|| (axis, nearer(axis, place, self.ends)))
    }

    pub(super) fn extent(&self, origin: DVec3) -> f64 {
        let [a, b] = self.ends;
        let largest = a.abs().max(b.abs()).max(origin.abs()).max_element();
        largest.max(self.radii[0]).max(self.radii[1])
    }

    pub(super) fn distance(&self, ray: Ray) -> Option<f64> {
        let Stretch { enter, leave } = self.stretch(ray)?;
        Some(if enter.0 > 0.0 { enter.0 } else { leave.0 })
    }

    /// Returns the surface. The point has the rounding errors of its height, of its vector from the axis, both no
    /// larger than the body, and of the sum with a: fewer than 16 roundoffs of the largest number.
    pub(super) fn surface(&self, ray: Ray, distance: f64) -> Surface {
        let Some(Stretch { enter, leave }) = self.stretch(ray) else {
            unreachable!("the ray hits the body at {distance}")
        };
        let within = enter.0 <= 0.0;
        let part = if within { leave.1 } else { enter.1 };
        let [a, b] = self.ends;
        let axis = unit(b - a);
        let (point, outward) = match part {
            Part::Side => self.side_at(ray, distance),
            Part::Cap(end) => {
                let from_end = (ray.origin - self.ends[end]) + distance * ray.direction;
                let aside = from_end - from_end.dot(axis) * axis;
                let least = self.radii[end] / aside.length();
                let aside = if least < 1.0 { aside * least } else { aside };
                (self.ends[end] + aside, if end == 0 { -axis } else { axis })
            }
        };
        let largest = a.abs().max(b.abs()).max_element().max(self.radii[0]).max(self.radii[1]);
        Surface {
            point,
            normal: if within { -outward } else { outward },
            offset: 64.0 * ROUNDOFF * largest,
            flat: part != Part::Side,
            within,
        }
    }

    /// Returns the point of the side that is nearest to a point of the ray, and the normal there.
    fn side_at(&self, ray: Ray, distance: f64) -> (DVec3, DVec3) {
        let [a, b] = self.ends;
        let axis = unit(b - a);
        let scale = self.size();
        let length = ((b - a) * scale).length() / scale;
        let slope = (self.radii[1] - self.radii[0]) / length;
        let from_a = (ray.origin - a) + distance * ray.direction;
        let height = from_a.dot(axis).clamp(0.0, length);
        let aside = from_a - height * axis;
        let aside = aside - aside.dot(axis) * axis;
        // A tip has no normal. It gets one that points back along the ray.
        let aside = if aside == DVec3::ZERO { ray.direction.dot(axis) * axis - ray.direction } else { aside };
        let away = if aside == DVec3::ZERO { DVec3::ZERO } else { unit(aside) };
        let radius = self.radii[0] + slope * height;
        (a + height * axis + radius * away, unit(away - slope * axis))
    }

    /// Returns the sides on which a point is, for the infinite cone and for the ends.
    pub(super) fn sides(&self, place: Place) -> Sides {
        let size = self.size();
        let Exact { outside, heights } = self.exact(place, size);
        [outside, heights[0], heights[1], 0.0, 0.0, 0.0].map(sign)
    }

    /// Returns the scale that brings the body's size near 1.
    fn size(&self) -> f64 {
        let [a, b] = self.ends;
        below_inverse((b - a).abs().max_element().max(self.radii[0]).max(self.radii[1]))
    }

    /// Computes the side with twice the precision, because the point may be on the surface.
    fn exact(&self, place: impl Into<Place>, scale: f64) -> Exact {
        let [a, b] = self.ends;
        let (axis, from_a) = (between(b, a, scale), between(place, a, scale));
        let (square, along) = (dot(axis, axis), dot(from_a, axis));
        let aside = cross(from_a, axis);
        let [low, high] = self.radii.map(|radius| DoubleDouble::from(radius * scale));
        // |ρ|²·h² and r²·h⁴ for the height h of the body.
        let radius = low * square + (high - low) * along;
        let (far, near) = (dot(aside, aside) * square, radius * radius);
        let (length, apart) = (square.value().sqrt(), dot(from_a, from_a).value());
        let largest = apart * square.value() * square.value() + near.value();
        let outside = (far - near).beside(largest) / (square.value() * square.value());
        let over = |height: DoubleDouble| height.beside(apart.sqrt() * length + square.value()) / length;
        Exact { outside, heights: [over(along), over(along - square)] }
    }

    fn stretch(&self, ray: Ray) -> Option<Stretch> {
        let [a, b] = self.ends;
        let scale = self.size();
        let axis = unit(b - a);
        let height = ((b - a) * scale).length();
        let [low, high] = self.radii.map(|radius| radius * scale);
        let slope = (high - low) / height;
        let direction = ray.direction;

        let middle = 0.5 * (b - a) - (ray.origin - a);
        let is_far = middle.abs().max_element() * scale > FAR;
        let near = if is_far { middle.dot(direction) } else { 0.0 };
        let from_a = ((ray.origin - a) + near * direction) * scale;
        let rise = direction.dot(axis);
        let aside = from_a - from_a.dot(axis) * axis;
        let spread = direction - rise * axis;

        // f along the ray is A·t² + 2·B·t + C, and B² - A·C is (n - x)·(n + x).
        let radius = low + slope * from_a.dot(axis);
        let (outside, heights) = if is_far {
            let at = from_a.dot(axis);
            let apart = aside.length();
            ((apart - radius) * (apart + radius), [at, at - height])
        } else {
            let Exact { outside, heights } = self.exact(ray.origin, scale);
            (outside, heights)
        };
        let square = (spread.length() - slope * rise) * (spread.length() + slope * rise);
        let (square, half) = if slope == 0.0 {
            (spread.length_squared(), aside.dot(spread))
        } else {
            (square, aside.dot(spread) - radius * slope * rise)
        };
        let n = (radius * spread - slope * rise * aside).length();
        let x = aside.cross(spread).length();
        let side = inside([square, half, outside], (n - x) * (n + x), slope * rise)?;

        let mut enter = (side.0, Part::Side);
        let mut leave = (side.1, Part::Side);
        // A ray along a line of the side enters and leaves at its rims.
        let along_side = square == 0.0 && half == 0.0 && outside == 0.0;
        let cap = |end| if along_side { Part::Side } else { Part::Cap(end) };
        if rise == 0.0 {
            if heights[0] < 0.0 || heights[1] > 0.0 {
                return None;
            }
        } else {
            let [at_a, at_b] = heights.map(|over| -over / rise);
            let (first, last) = if rise > 0.0 { ((at_a, 0), (at_b, 1)) } else { ((at_b, 1), (at_a, 0)) };
            if first.0 > enter.0 {
                enter = (first.0, cap(first.1));
            }
            if last.0 < leave.0 {
                leave = (last.0, cap(last.1));
            }
        }
        let slack = EDGE * ROUNDOFF * (leave.0.abs() + height.max(low).max(high));
        // A cap is hit at the same distance as any other flat shape in its plane.
        let world = |(at, part): (f64, Part)| match part {
            Part::Side => (near + at / scale, part),
            Part::Cap(end) => (plane::along(ray, self.ends[end], b - a), part),
        };
        (enter.0 <= leave.0 + slack).then(|| Stretch { enter: world(enter), leave: world(leave) })
    }
}

/// The value of f at a point, and its heights above the ends, in units of 1 / scale. It is exactly 0 on the surface.
struct Exact {
    outside: f64,
    heights: [f64; 2],
}

/// Returns the interval in which A·t² + 2·B·t + C is not positive, on the half of a double cone whose radius is not
/// negative. The radius changes by `growth` per length of the ray. The interval may be on the other half alone, which
/// the caps remove.
fn inside([a, b, c]: [f64; 3], discriminant: f64, growth: f64) -> Option<(f64, f64)> {
    const ALL: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
    if a == 0.0 {
        return if b == 0.0 {
            (c <= 0.0).then_some(ALL)
        } else {
            let root = -c / (2.0 * b);
            Some(if b > 0.0 { (ALL.0, root) } else { (root, ALL.1) })
        };
    }
    if a > 0.0 && discriminant < 0.0 {
        return None;
    }
    // Neither root subtracts numbers of the same sign.
    let q = -(b + discriminant.max(0.0).sqrt().copysign(b));
    let (one, other) = (q / a, if q == 0.0 { 0.0 } else { c / q });
    let (first, last) = (one.min(other), one.max(other));
    Some(if a > 0.0 {
        (first, last)
    } else if growth > 0.0 {
        (last, ALL.1)
    } else {
        (ALL.0, first)
    })
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Cone, Cuboid, Cylinder, Disc, Material, Object, Plane};

    use super::*;
    use crate::reference::shapes::{distance, surface};

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from(direction).normalize() }
    }

    fn can() -> Object {
        let ends = [DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 3.0, 0.0)];
        Cylinder::new(2.0, ends, Material::default()).unwrap().into()
    }

    fn tip() -> Object {
        let ends = [DVec3::ZERO, DVec3::new(0.0, 2.0, 0.0)];
        Cone::new([1.0, 0.0], ends, Material::default()).unwrap().into()
    }

    fn hit(object: &Object, origin: [f64; 3], direction: [f64; 3]) -> Option<(f64, DVec3)> {
        let ray = ray(origin, direction);
        distance(object, ray).map(|t| (t, surface(object, ray, t).normal))
    }

    #[test]
    fn a_cylinder_has_a_side_two_caps_and_rims() {
        let can = can();
        let t = |origin, direction| hit(&can, origin, direction).map(|hit| hit.0);
        assert_eq!(hit(&can, [5.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some((3.0, DVec3::X)));
        assert_eq!(hit(&can, [1.0, 8.0, 1.0], [0.0, -1.0, 0.0]), Some((5.0, DVec3::Y)));
        assert_eq!(hit(&can, [0.5, 0.0, 0.0], [0.0, -1.0, 0.0]), Some((1.0, DVec3::Y)), "from within");
        assert_eq!(hit(&can, [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]), Some((1.5, DVec3::NEG_X)), "from within");
        assert_eq!(hit(&can, [2.0, 8.0, 0.0], [0.0, -1.0, 0.0]), Some((5.0, DVec3::X)), "along the side");
        assert_eq!(hit(&can, [5.0, 3.0, 0.0], [-1.0, 0.0, 0.0]), Some((3.0, DVec3::X)), "in a cap's plane");
        assert_eq!(t([2.000_000_000_000_1, 8.0, 0.0], [0.0, -1.0, 0.0]), None);
        assert_eq!(t([5.0, 3.000_000_000_000_1, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(t([2.0, 0.0, 5.0], [0.0, 0.0, -1.0]), Some(5.0), "a tangent");
        assert_eq!(t([2.000_000_000_000_1, 0.0, 5.0], [0.0, 0.0, -1.0]), None);
        assert_eq!(t([2.0, 0.0, 0.0], [1.0, 0.0, 0.0]), None, "from the side");
        assert_eq!(t([2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some(4.0), "from the side inwards");
        assert_eq!(t([1.0, 3.0, 0.0], [0.0, 1.0, 0.0]), None, "from a cap");
        assert_eq!(t([1.0, 3.0, 0.0], [0.0, -1.0, 0.0]), Some(4.0), "from a cap inwards");
        // On the side, by numbers that are rounded.
        assert_eq!(t([1.2, 0.0, 1.6], [0.6, 0.0, 0.8]), None);
    }

    #[test]
    fn a_cone_has_one_half_and_a_tip() {
        let tip = tip();
        let t = |origin, direction| hit(&tip, origin, direction).map(|hit| hit.0);
        assert_eq!(t([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]), Some(3.0), "the tip from above");
        assert_eq!(t([5.0, 2.0, 0.0], [-1.0, 0.0, 0.0]), Some(5.0), "the tip aside");
        assert_eq!(t([5.0, 2.5, 0.0], [-1.0, 0.0, 0.0]), None, "the other half");
        assert_eq!(t([5.0, 1.0, 0.0], [-1.0, 0.0, 0.0]), Some(4.5));
        assert_eq!(t([0.5, -5.0, 0.0], [0.0, 1.0, 0.0]), Some(5.0), "the cap");
        assert_eq!(t([0.25, 1.0, 0.0], [0.0, 1.0, 0.0]), Some(0.5), "from within");
        let (at, normal) = hit(&tip, [5.0, 1.0, 0.0], [-1.0, 0.0, 0.0]).unwrap();
        assert_eq!(at, 4.5);
        assert!((normal - unit(DVec3::new(2.0, 1.0, 0.0))).length() < 1e-15);
        // Along a line of the side, to its rim and to the tip.
        let found = [t([2.0, -2.0, 0.0], [-1.0, 2.0, 0.0]), t([-1.0, 4.0, 0.0], [1.0, -2.0, 0.0])];
        for at in found {
            assert!(at.is_some_and(|at| (at - 5f64.sqrt()).abs() < 1e-14), "{at:?}");
        }
    }

    #[test]
    fn a_cap_is_as_far_as_a_plane_a_disc_and_a_box_there() {
        let (surface, height) = (Material::default, 0.3);
        let top = DVec3::Y * height;
        let objects: [Object; 5] = [
            Cylinder::new(2.0, [DVec3::NEG_Y, top], surface()).unwrap().into(),
            Cone::new([3.0, 0.7], [top, DVec3::Y], surface()).unwrap().into(),
            Plane::new(top, DVec3::new(0.0, -2.7, 0.0), surface()).unwrap().into(),
            Disc::new(2.0, top, DVec3::new(0.0, 0.1, 0.0), surface()).unwrap().into(),
            Cuboid::new([DVec3::new(-3.0, 0.0, -3.0), DVec3::new(3.0, height, 3.0)], surface())
                .unwrap()
                .into(),
        ];
        let mut rng = fastrand::Rng::with_seed(20);
        for _ in 0..1000 {
            let origin = DVec3::new(rng.f64(), 7.0 + rng.f64(), rng.f64());
            let direction = (DVec3::new(rng.f64(), height, rng.f64()) - origin).normalize();
            let cone =
                Ray { origin: origin - DVec3::Y * 14.0, direction: direction * DVec3::new(1.0, -1.0, 1.0) };
            let met = |k: usize, r: Ray| distance(&objects[k], r);
            let r = Ray { origin, direction };
            assert_eq!([met(0, r), met(2, r), met(3, r)], [met(4, r); 3]);
            assert_eq!(met(1, cone), met(2, cone));
        }
    }

    #[test]
    fn a_far_eye_and_a_power_of_two_change_nothing() {
        let near = ray([2.5, 6.0, 1.5], [-2.25, -5.25, -1.375]);
        for object in [can(), tip()] {
            let expected = distance(&object, near).unwrap();
            for exponent in [-700, -90, -1, 1, 90, 700] {
                let scale = 2f64.powi(exponent);
                let placed = object.placed(scale, |p| scale * p).unwrap();
                let r = Ray { origin: near.origin * scale, ..near };
                assert_eq!(distance(&placed, r), Some(expected * scale), "2^{exponent}");
            }
            for far in [1e3, 1e9, 1e15] {
                let r = Ray { origin: near.origin - far * near.direction, ..near };
                let t = distance(&object, r).unwrap() - far;
                assert!((t - expected).abs() <= 4.0 * f64::EPSILON * far, "{t} from {far:e}");
            }
        }
    }

    #[test]
    fn what_leaves_the_surface_does_not_meet_it_again() {
        let mut rng = fastrand::Rng::with_seed(20);
        let mut random = || DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 2.0 - 1.0;
        for round in 0..20_000 {
            let ends = [10.0 * random(), 10.0 * random()];
            let radii = if round % 2 == 0 { [2.0, 0.0] } else { [3.0, 3.0] };
            let object = Cone::new(radii, ends, Material::default()).unwrap().into();
            let origin = 20.0 * random();
            let target = ends[0].lerp(ends[1], 0.5) + random();
            let r = Ray { origin, direction: (target - origin).normalize() };
            let Some(t) = distance(&object, r) else { continue };
            let s = surface(&object, r, t);
            assert!(s.normal.dot(r.direction) < 1e-9);
            let start = s.point + s.offset * s.normal;
            let aside = s.normal.cross(r.direction);
            for direction in [s.normal, s.normal.cross(aside)] {
                let again = distance(&object, Ray { origin: start, direction: direction.normalize() });
                if !s.within && aside.length() > 1e-3 {
                    assert_eq!(again, None, "round {round}");
                }
            }
            let within = s.point - s.offset * s.normal;
            if !s.within {
                let through = distance(&object, Ray { origin: within, direction: r.direction });
                assert!(through.is_some(), "round {round}");
            }
        }
    }
}
