//! The widths of objects in pixels, as the eye and the lights see them.

use glam::{DMat3, DVec2, DVec3};
use rayfold_scene::model::unit;
use rayfold_scene::{Light, Object, Outline, Scene, Shine};

use crate::fast::placement::lens::Lens;
use crate::fast::rays::view::{View, view};
use crate::fast::shapes::instance::in_world;
use crate::sampling::lights;

/// The size of pixels in the scene, and the lights.
#[derive(Debug)]
pub(super) struct Gauge {
    /// `None` if rays are parallel.
    eye: Option<Eye>,
    lens: Option<Lens>,
    lights: Vec<Light>,
}

#[derive(Clone, Copy, Debug)]
struct Eye {
    at: DVec3,
    right: DVec3,
    up: DVec3,
    back: DVec3,
    /// The size of a pixel at a distance of 1: the larger of its width and height.
    pixel: f64,
}

/// The width of an object in pixels, at its narrowest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Width {
    /// The width as seen from the eye.
    pub(super) seen: f64,
    /// The smallest width as seen from the eye or from a light.
    pub(super) least: f64,
}

impl Width {
    pub(super) const UNKNOWN: Self = Self { seen: f64::INFINITY, least: f64::INFINITY };
}

/// Points whose convex hull contains an object, and the object's thickness if it is long.
pub(super) struct Hull {
    pub(super) points: Vec<DVec3>,
    pub(super) girth: f64,
    /// Whether the object is invisible from its side.
    pub(super) is_flat: bool,
}

/// The width in pixels below which a flat object has no visible effect.
const VANISHING: f64 = 1e-3;

impl Gauge {
    pub(super) fn new(scene: &Scene) -> Self {
        let eye = match (view(scene, 1.0), &scene.camera) {
            (View::Pinhole { right, up, back, x, y }, camera) => {
                let at = match camera {
                    rayfold_scene::Camera::Pinhole(pinhole) => pinhole.eye(),
                    rayfold_scene::Camera::Look(look) => look.eye(),
                    rayfold_scene::Camera::Orthographic => DVec3::ZERO,
                };
                Some(Eye { at, right, up, back, pixel: x.step.abs().max(y.step.abs()) })
            }
            (View::Parallel { .. }, _) => None,
        };
        Self { eye, lens: Lens::of(scene), lights: scene.lights.to_vec() }
    }

    /// Returns the size of a pixel at a place.
    pub(super) fn pixel(&self, at: DVec3) -> f64 {
        self.eye.map_or(1.0, |eye| eye.pixel * at.distance(eye.at))
    }

    /// Returns the length of `pixels` pixels at a place, plus the blur of the lens there.
    pub(super) fn length(&self, at: DVec3, pixels: f64) -> f64 {
        let blur = match (self.eye, self.lens) {
            (Some(eye), Some(lens)) => {
                2.0 * lens.radius * (1.0 - (eye.at - at).dot(eye.back) / lens.distance).abs()
            }
            _ => 0.0,
        };
        pixels * self.pixel(at) + blur
    }

    pub(super) fn width(&self, hull: &Hull) -> Width {
        let Hull { points, girth, is_flat } = hull;
        let seen = match &self.eye {
            None => across(points.iter().map(|p| p.truncate())).min(*girth),
            Some(eye) => {
                let ahead = |p: &DVec3| (eye.at - *p).dot(eye.back);
                let far =
                    points.iter().filter(|p| ahead(p) > 0.0).map(|p| p.distance(eye.at)).fold(0.0, f64::max);
                let of_girth = if far > 0.0 { girth / (far * eye.pixel) } else { f64::INFINITY };
                // What reaches behind the eye has no outline of few points.
                let is_ahead = points.iter().all(|p| ahead(p) > 1e-6 * p.distance(eye.at));
                if is_ahead {
                    across(points.iter().map(|p| self.on_screen(*p))).min(of_girth)
                } else {
                    of_girth
                }
            }
        };
        let counts = |width: f64| if *is_flat && width < VANISHING { f64::INFINITY } else { width };
        let seen = counts(seen);
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        let lit = self.lights.iter().map(|light| {
            let towards = lights::shape(light).towards(middle);
            let (x, y) =
                if towards == DVec3::ZERO { (DVec3::X, DVec3::Y) } else { towards.any_orthonormal_pair() };
            let flat = points.iter().map(|p| DVec2::new((*p - middle).dot(x), (*p - middle).dot(y)));
            counts(across(flat) / self.pixel(middle))
        });
        Width { seen, least: lit.fold(seen, f64::min) }
    }

    /// Returns the position in the image at which a point is seen, in pixels.
    fn on_screen(&self, p: DVec3) -> DVec2 {
        let Some(eye) = self.eye else { return p.truncate() };
        let way = p - eye.at;
        DVec2::new(way.dot(eye.right), way.dot(eye.up)) / (-way.dot(eye.back) * eye.pixel)
    }

    /// Returns the largest number of pixels by which an object moves between here and another moment. Values that are
    /// not finite count as 0.
    pub(super) fn drift(&self, hull: &Hull, other: &Self, later: &Hull) -> f64 {
        let pairs = hull.points.iter().zip(&later.points);
        let drifts = pairs.map(|(p, q)| self.on_screen(*p).distance(other.on_screen(*q)));
        drifts.filter(|drift| drift.is_finite()).fold(0.0, f64::max)
    }

    /// Returns the width of a highlight on a curved object.
    pub(super) fn gleam(&self, object: &Object, shine: &Shine) -> Option<f64> {
        let (radius, at) = curvature(object)?;
        // Where it is half as bright as at its brightest, seen from the middle of the curve.
        let angle = (2.0 * core::f64::consts::LN_2 / shine.exponent()).sqrt();
        Some(2.0 * radius * angle / self.pixel(at))
    }
}

/// Returns the extent of points perpendicular to the line between the two that are farthest apart.
fn across(points: impl Iterator<Item = DVec2> + Clone) -> f64 {
    // As exact as it need be: from some point to the farthest, and from that to the farthest.
    let farthest = |from: DVec2| {
        points.clone().max_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)))
    };
    let a = points.clone().next().and_then(farthest);
    let Some((a, b)) = a.and_then(|a| Some((a, farthest(a)?))) else { return f64::INFINITY };
    let along = (b - a).normalize_or_zero();
    let (low, high) = points
        .map(|p| along.perp_dot(p - a))
        .fold((0.0, 0.0), |(low, high): (f64, f64), x| (low.min(x), high.max(x)));
    high - low
}

/// Returns the smallest radius of a curved object and its centre.
fn curvature(object: &Object) -> Option<(f64, DVec3)> {
    let Object::Instance(o) = object else { return object.outline()?.curvature() };
    match in_world(o) {
        Some(object) => curvature(&object),
        None => {
            let (radius, at) = curvature(o.object())?;
            Some((o.placement().scale() * radius, o.placement().point(at)))
        }
    }
}

/// The points of a ring.
fn ring(center: DVec3, normal: DVec3, radius: f64) -> impl Iterator<Item = DVec3> {
    let (x, y) = unit(normal).any_orthonormal_pair();
    (0..8).map(move |k| {
        let (sin, cos) = libm::sincos(core::f64::consts::FRAC_PI_4 * f64::from(k));
        center + radius * (cos * x + sin * y)
    })
}

/// Returns the corners of a box, and its edge of middle length if the longest one is much longer.
fn of_box(ends: [DVec3; 2], place: impl Fn(DVec3) -> DVec3, scale: f64) -> Hull {
    let corner = |k: usize| DVec3::new(ends[k & 1].x, ends[k >> 1 & 1].y, ends[k >> 2].z);
    let mut edges = (ends[1] - ends[0]).to_array();
    edges.sort_by(f64::total_cmp);
    let girth = if 4.0 * edges[1] < edges[2] { scale * edges[1] } else { f64::INFINITY };
    Hull { points: (0..8).map(|k| place(corner(k))).collect(), girth, is_flat: false }
}

/// Returns points whose convex hull contains an object, or `None` if the object is infinite.
pub(super) fn hull(object: &Object) -> Option<Hull> {
    if let Object::Instance(o) = object {
        return match (in_world(o), o.object().outline()) {
            (Some(object), _) => hull(&object),
            (None, Some(Outline::Box { corners, .. })) => {
                Some(of_box(corners, |p| o.placement().point(p), o.placement().scale()))
            }
            (None, _) => None,
        };
    }
    Some(match object.outline()? {
        Outline::Ball { center, radius } => {
            let points = DMat3::from_diagonal(DVec3::splat(radius));
            let points =
                [0, 1, 2].map(|axis| points.col(axis)).into_iter().flat_map(|r| [center + r, center - r]);
            Hull { points: points.collect(), girth: 2.0 * radius, is_flat: false }
        }
        Outline::Triangle(corners) => {
            Hull { points: corners.to_vec(), girth: height(&corners), is_flat: true }
        }
        Outline::Box { corners, .. } => of_box(corners, |p| p, 1.0),
        Outline::Plane(_) => return None,
        Outline::Disc { center, normal, radius } => {
            Hull { points: ring(center, normal, radius).collect(), girth: f64::INFINITY, is_flat: true }
        }
        Outline::Ring { radius, thickness, center, normal } => {
            let n = thickness * unit(normal);
            let rings = [center + n, center - n];
            let points = rings.into_iter().flat_map(|c| ring(c, normal, radius + thickness)).collect();
            Hull { points, girth: 2.0 * thickness, is_flat: false }
        }
        Outline::Rod { radii, ends, is_round } => {
            let mut round = round(radii, ends);
            if is_round {
                round.points.extend(tips(radii[0], ends));
            }
            round
        }
    })
}

/// Returns the outermost points of a rod with round ends.
pub(super) fn tips(radius: f64, [a, b]: [DVec3; 2]) -> [DVec3; 2] {
    let reach = radius * along(a, b);
    [a - reach, b + reach]
}

/// Returns the unit vector from one point to another, or any unit vector if they are equal.
fn along(a: DVec3, b: DVec3) -> DVec3 {
    if a == b { DVec3::Z } else { unit(b - a) }
}

fn round(radii: [f64; 2], [a, b]: [DVec3; 2]) -> Hull {
    let axis = along(a, b);
    let points = ring(a, axis, radii[0]).chain(ring(b, axis, radii[1])).collect();
    let thick = 2.0 * radii[0].max(radii[1]);
    let girth = if 4.0 * thick < a.distance(b) { thick } else { f64::INFINITY };
    Hull { points, girth, is_flat: false }
}

/// Returns the height of a triangle over its longest edge.
fn height(&[a, b, c]: &[DVec3; 3]) -> f64 {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let twice = (b - a).cross(c - a).length();
    if 4.0 * twice < longest * longest { twice / longest } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, parse};

    use super::*;

    /// Returns the width of the first object of a scene.
    fn width(lines: &str) -> Width {
        // A pixel is .01 at a distance of 1.
        let camera = "Screen 200 200\nCamera 0 0 0  0 0 -1  0 1 0  1  -.995 -.995 .995 .995\nSamples 16\n";
        let parsed = parse("a.txt", format!("{camera}{lines}\nTrace\n").as_bytes(), &Limits::default());
        let scene = parsed.script.unwrap().frame(0).unwrap();
        Gauge::new(&scene).width(&hull(&scene.objects[0]).unwrap())
    }

    #[test]
    fn objects_are_as_wide_as_they_are_seen() {
        let paint = "1 1 1 0 0 0";
        for (object, expected) in [
            ("Sphere .05 0 0 -10", 1.0),
            ("Cylinder .05 -5 0 -10 5 0 -10", 1.0),
            ("Cone .05 .02 -5 0 -10 5 0 -10", 1.0),
            ("Torus 3 .05 0 0 -10 0 0 1", 1.0),
            ("Capsule .05 -5 0 -10 5 0 -10", 1.0),
            ("Capsule .05 0 0 -10 0 0 -10", 1.0),
            ("Roundbox -5 -.05 -10.1 5 .05 -10 .04", 1.0),
            ("Box -5 -.05 -10.1 5 .05 -10", 1.0),
            ("Triangle -5 0 -10 5 0 -10 5 .1 -10", 1.0),
            ("Disc 1 0 0 -10 0 1 .05", 1.0),
            ("Disc 1 0 0 -10 0 0 1", 20.0),
            // As wide as where it is farthest.
            ("Cylinder .05 0 -1 5 0 -1 -40", 0.25),
        ] {
            let Width { seen, least } = width(&format!("{object} {paint}"));
            assert!((0.85..1.2).contains(&(seen / expected)) && least == seen, "{object}: {seen} {least}");
        }
    }

    #[test]
    fn what_a_light_sees_from_its_edge_is_narrow() {
        let disc = |light: &str| width(&format!("{light}\nDisc 1 0 0 -10 0 0 1 1 1 1 0 0 0"));
        for light in ["Ilight 1 1 1 0 -1 -.05", "Plight 1 1 1 0 20 -9"] {
            let Width { seen, least } = disc(light);
            assert!(seen > 15.0 && (0.5..2.0).contains(&least), "{light}: {seen} {least}");
        }
        // What is quite flat throws no shadow then.
        assert!(disc("Ilight 1 1 1 0 -1 0").least > 15.0);
    }
}
