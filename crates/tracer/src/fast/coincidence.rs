//! Surfaces that all but coincide.
//!
//! Where two surfaces of different colours lie nearer behind each other than `f32` tells apart, over more than a pixel,
//! rounding decides which of them is seen. Pairs of such surfaces are looked for here, in `f64`: faces of triangles and
//! boxes in almost one plane, spheres that touch from within, and spheres that touch a face. Those that coincide in `f64`,
//! too, are meant to; they are not counted if their numbers are the same in `f32`, so that rays meet both at the same distance
//! bit for bit. Of a sphere and a face the colours do not matter: what lies so near a sphere is
//! in the shadow of its rounding.
//!
//! What is found does not depend on the order of the objects.

mod touching;

use std::ops::Range;

use glam::DVec3;
use rayfold_scene::{Material, Object, Scene};

use self::touching::{MEANT, faces_blur, ring_on_plane, ring_on_sphere};
use super::bounds::{Bounds, join};
use super::geometry::Geometry;
use super::placed::{Face, Placed};
use super::real::Real;
use super::shapes::{Shape, Solid};
use super::tree::{Branches, Part};
use super::view::View;

/// Surfaces nearer than this to each other, in roundoffs of their coordinates, may be met at one distance.
const ONE_SURFACE: f64 = 6.0;

/// Surfaces nearer than this to a sphere's, in roundoffs of its centre's distance and its radius, may be met on the wrong
/// side of it.
///
/// Half of what a ray starts off by; what is farther off is met where it is.
const ON_SPHERE: f64 = 16.0;

/// Pairs of boxes that are looked at, for each object, before the search is given up.
const PAIRS: usize = 64;

/// So many pairs are always looked at.
const FEW_PAIRS: usize = 1 << 20;

/// Whether there are two surfaces whose order cannot be told in single precision, where it can be seen. `pixel` is the
/// size of a pixel: an angle from the eye, or a length in parallel projection.
pub(super) fn surfaces_blur(geometry: &Geometry, scene: &Scene, pixel: f64) -> bool {
    let first = scene.objects.first().map(Object::material);
    let has = |kind: fn(&Solid) -> bool| geometry.solids.iter().any(kind);
    let touching = has(is_ball) && has(|solid| !is_ball(solid));
    if !touching && scene.objects.iter().all(|object| Some(object.material()) == first) {
        return false;
    }
    let is_mirror = |solid: &&Solid| scene.objects[solid.order as usize].material().mirror() != DVec3::ZERO;
    let balls = geometry.solids.iter().filter_map(|solid| solid.shape.ball());
    let search = Search {
        solids: &geometry.solids,
        objects: &scene.objects,
        pixel,
        parallel: matches!(geometry.view, View::Parallel { .. }),
        mirrors: geometry.solids.iter().filter(is_mirror).map(|solid| solid.shape.bounds()).reduce(join),
        largest_ball: balls.map(on_sphere).fold(0.0, f64::max),
    };
    match &geometry.branches {
        None => search.within(0..geometry.solids.len()),
        Some(branches) => search.down(branches),
    }
}

struct Search<'a> {
    solids: &'a [Solid],
    objects: &'a [Object],
    pixel: f64,
    parallel: bool,
    /// The box around all mirrors, if there are any.
    mirrors: Option<Bounds>,
    /// The largest [`on_sphere`].
    largest_ball: f64,
}

fn is_ball(solid: &Solid) -> bool {
    solid.shape.ball().is_some()
}

/// How near a sphere's surface others may be met on the wrong side of it.
fn on_sphere((center, radius): (DVec3, f64)) -> f64 {
    ON_SPHERE * <f32 as Real>::ROUNDOFF * (center.length() + radius)
}

/// What two boxes have in common, or all but.
struct Region {
    /// Its largest coordinates.
    reach: DVec3,
    /// How near surfaces in it may be met at one distance, whatever their direction.
    slack: f64,
    /// The size of a pixel where it is nearest.
    pixel: f64,
}

impl Region {
    /// The square of the sine of an angle beyond which surfaces are that near along less than a pixel.
    fn steepest(&self) -> f64 {
        (2.0 * self.slack / self.pixel).powi(2)
    }
}

impl Search<'_> {
    /// Both orders of a pair are looked at once: nodes are compared with themselves and with those after them.
    fn down(&self, branches: &Branches) -> bool {
        let materials = self.contents(branches);
        let mut left = (PAIRS * self.solids.len()).max(FEW_PAIRS) as isize;
        let mut pending = vec![(0, 0)];
        while let Some((a, b)) = pending.pop() {
            if materials[a].cannot_blur(&materials[b]) {
                continue;
            }
            left -= 1;
            if left < 0 {
                // So many boxes in one place cannot be told apart in time: more precision is never wrong.
                return true;
            }
            if a != b && !self.touch(branches.bounds(a), branches.bounds(b)) {
                continue;
            }
            match (branches.part(a), branches.part(b)) {
                (Part::Solids(of), _) if a == b => {
                    if self.within(of) {
                        return true;
                    }
                }
                (Part::Children(first, second), _) if a == b => {
                    // What is nearest to each other is taken first: in a crowd it is found at once.
                    pending.extend([(first, second), (second, second), (first, first)]);
                }
                (Part::Solids(of), Part::Solids(others)) => {
                    left -= (of.len() * others.len() / 4) as isize;
                    let steepest = self.region(branches.bounds(a), branches.bounds(b)).steepest();
                    let others = &self.solids[others];
                    let is_blurred = |one: &Solid| others.iter().any(|other| self.blur(one, other, steepest));
                    if self.solids[of].iter().any(is_blurred) {
                        return true;
                    }
                }
                (Part::Children(first, second), Part::Solids(_)) => pending.extend([(first, b), (second, b)]),
                (Part::Solids(_), Part::Children(first, second)) => pending.extend([(a, first), (a, second)]),
                (Part::Children(first, second), Part::Children(third, fourth)) => {
                    pending.extend([(first, third), (first, fourth), (second, third), (second, fourth)]);
                }
            }
        }
        false
    }

    /// What is in each node.
    fn contents(&self, branches: &Branches) -> Vec<Content<'_>> {
        let nothing = Content { material: None, balls: false, faces: false };
        let mut contents = vec![nothing; branches.len()];
        for at in (0..contents.len()).rev() {
            contents[at] = match branches.part(at) {
                Part::Solids(of) => {
                    let solids = &self.solids[of];
                    let first = self.material(&solids[0]);
                    let balls = is_ball(&solids[0]);
                    let is_one = solids.iter().all(|solid| self.material(solid) == first);
                    Content { material: is_one.then_some(first), balls, faces: !balls }
                }
                Part::Children(first, second) => {
                    let (a, b) = (&contents[first], &contents[second]);
                    Content {
                        material: a.material.filter(|_| a.material == b.material),
                        balls: a.balls || b.balls,
                        faces: a.faces || b.faces,
                    }
                }
            };
        }
        contents
    }

    fn material(&self, solid: &Solid) -> &Material {
        self.objects[solid.order as usize].material()
    }

    fn within(&self, solids: Range<usize>) -> bool {
        let solids = &self.solids[solids];
        solids
            .iter()
            .enumerate()
            .any(|(at, one)| solids[at + 1..].iter().any(|other| self.blur(one, other, f64::INFINITY)))
    }

    /// Whether two boxes all but overlap.
    fn touch(&self, a: Bounds, b: Bounds) -> bool {
        let (low, high) = (a.0.max(b.0), a.1.min(b.1));
        let slack = self.slack(low.abs().max(high.abs()).element_sum());
        (low - high).max_element() <= slack.max(self.largest_ball)
    }

    /// How near surfaces that reach so far from the origin may be met at one distance.
    fn slack(&self, reach: f64) -> f64 {
        // A mirrored ray starts anywhere in the scene, which has the size of 1.
        ONE_SURFACE * <f32 as Real>::ROUNDOFF * if self.mirrors.is_some() { 1.0 } else { reach }
    }

    fn region(&self, a: Bounds, b: Bounds) -> Region {
        let (low, high) = (a.0.max(b.0), a.1.min(b.1));
        let reach = low.abs().max(high.abs());
        let nearest = || DVec3::ZERO.clamp(low.min(high), high.max(low)).length();
        let pixel = if self.parallel { self.pixel } else { self.pixel * nearest() };
        Region { reach, slack: self.slack(reach.element_sum()), pixel }
    }

    /// Whether two solids blur; flat ones do not if the square of the sine between them is over `steepest`.
    fn blur(&self, one: &Solid, other: &Solid, steepest: f64) -> bool {
        if let (Some(normal), Some(n)) = (one.shape.plane(), other.shape.plane())
            && normal.cross(n).length_squared() > steepest
        {
            return false;
        }
        let bounds = (one.shape.bounds(), other.shape.bounds());
        if !self.touch(bounds.0, bounds.1) {
            return false;
        }
        let region = self.region(bounds.0, bounds.1);
        match (one.shape.ball(), other.shape.ball()) {
            (Some(ball), Some(b)) => {
                let are_one = || one.shape.is_one_in_single(&other.shape);
                self.spheres_blur(ball, b, &region, are_one) && self.differ(one, other)
            }
            (Some(ball), None) => self.sphere_blurs(ball, &other.shape, &region),
            (None, Some(ball)) => self.sphere_blurs(ball, &one.shape, &region),
            (None, None) => {
                let is_near = faces(&one.shape).any(|a| {
                    let slack = self.slack(a.normal.abs().dot(region.reach));
                    faces(&other.shape).any(|b| faces_blur(&a, &b, slack, region.pixel))
                });
                is_near && self.differ(one, other)
            }
        }
    }

    fn differ(&self, one: &Solid, other: &Solid) -> bool {
        self.material(one) != self.material(other)
    }

    /// Whether two spheres are within the slack of each other on a strip as wide as a pixel. Those that touch from without
    /// are seen apart from everywhere but within. Those that are meant to be one do if they are not in single precision.
    fn spheres_blur(
        &self,
        one: (DVec3, f64),
        other: (DVec3, f64),
        region: &Region,
        are_one: impl Fn() -> bool,
    ) -> bool {
        let ((center, radius), (c, r)) = if one.1 >= other.1 { (one, other) } else { (other, one) };
        let apart = (center - c).length();
        let largest = center.abs().max(c.abs()).max_element() + radius;
        let is_one = apart + (radius - r) <= MEANT * largest;
        let without = apart * apart > radius * radius + r * r;
        let contains_eye = || !self.parallel && (center.length() < radius || c.length() < r);
        if 2.0 * r <= region.pixel || without && !contains_eye() {
            return false;
        }
        if is_one {
            return !are_one();
        }
        let slack = region.slack.max(on_sphere(one).max(on_sphere(other)) / 2.0);
        ring_on_sphere(radius, r, apart, slack) >= region.pixel
    }

    /// Whether a sphere is within the slack of a face on a strip as wide as a pixel, and that can be seen.
    fn sphere_blurs(&self, ball: (DVec3, f64), other: &Shape, region: &Region) -> bool {
        let (center, radius) = ball;
        let slack = region.slack.max(on_sphere(ball));
        let (min, max) = other.bounds();
        let middle = (min + max) / 2.0;
        2.0 * radius > region.pixel
            && faces(other).any(|face| {
                let side = face.normal.dot(center - face.corners[0]);
                // A ball on a box is in front of it, or the box in front of the ball.
                let within = face.normal.dot(middle - face.corners[0]);
                let is_outside = within * side < 0.0 && within.abs() > slack;
                !is_outside
                    && !self.are_viewers_beside(&face, side, slack)
                    && ring_on_plane(&face, center, radius, slack) >= region.pixel
            })
    }

    /// Whether all rays that are followed come from the side of a face on which a ball's centre lies, at the height `side`: the
    /// ball is in front of the face.
    fn are_viewers_beside(&self, face: &Face, side: f64, slack: f64) -> bool {
        let (normal, height) =
            (face.normal * side.signum(), -face.normal.dot(face.corners[0]) * side.signum());
        let is_eye_beside = if self.parallel { normal.z > 0.0 } else { height > 0.0 };
        let lowest = |(min, max): Bounds| (normal * min).min(normal * max).element_sum() + height;
        is_eye_beside && self.mirrors.is_none_or(|mirrors| lowest(mirrors) >= -slack)
    }
}

/// What is in a node.
#[derive(Clone, Copy)]
struct Content<'a> {
    /// The material of all, if it is one: most meshes have one, and need not be looked into.
    material: Option<&'a Material>,
    balls: bool,
    faces: bool,
}

impl Content<'_> {
    fn cannot_blur(&self, other: &Self) -> bool {
        let is_one = self.material.is_some() && self.material == other.material;
        is_one && !(self.balls && other.faces || self.faces && other.balls)
    }
}

fn faces(shape: &Shape) -> impl Iterator<Item = Face> {
    shape.faces().map(|number| shape.face(number))
}
