//! Surfaces that nearly coincide (z-fighting).
//!
//! If two surfaces of different colours are nearer to each other along a ray than `f32` resolves, over more than a
//! pixel, rounding decides which of them is visible. This module searches for such pairs in `f64`: faces of triangles
//! and boxes in almost one plane, spheres that touch from within, and spheres that touch a face. Surfaces that coincide
//! in `f64`, too, are meant to. They are not counted if their numbers are equal in `f32`, because then rays hit both at
//! the same distance bit for bit. For a sphere and a face the colours do not matter, because rounding errors can put a
//! surface so near a sphere into its shadow.
//!
//! The result does not depend on the order of the objects.

use std::ops::Range;
use std::sync::atomic::{AtomicIsize, Ordering};

use glam::DVec3;
use rayfold_scene::{Material, Object, Scene};
use rayon::prelude::*;

use crate::fast::acceleration::tree::{Branches, Part};
use crate::fast::arithmetic::real::Real;
use crate::fast::placement::geometry::Geometry;
use crate::fast::placement::touching::{MEANT, faces_z_fight, ring_on_plane, ring_on_sphere};
use crate::fast::rays::bounds::{Bounds, join};
use crate::fast::rays::placed::{Face, RenderSpaceShape};
use crate::fast::rays::view::View;
use crate::fast::shapes::{Shape, Solid};
use crate::meshes::Faces;
use crate::parallel::{all, map};

/// The distance below which two surfaces may be hit at the same distance, in roundoffs of their coordinates.
const ONE_SURFACE: f64 = 6.0;

/// The distance from a sphere's surface below which another surface may be hit on the wrong side of it, in roundoffs of
/// the distance of the sphere's centre plus its radius.
///
/// It is half the offset of new rays. A surface farther away is hit on the right side.
const ON_SPHERE: f64 = 16.0;

/// The number of pairs of boxes, per object, after which the search is given up.
const PAIRS: usize = 64;

/// The number of pairs that are always compared, however few objects there are.
const FEW_PAIRS: usize = 1 << 20;

/// The number of nodes from which several threads search the tree, and the number of pairs that they share.
const SHARED: usize = 1 << 16;
const SHARES: usize = 256;

/// Returns whether two surfaces cannot be ordered in single precision, and the difference is visible. `pixel` is the
/// size of a pixel: an angle from the eye, or a length in parallel projection.
pub(crate) fn surfaces_z_fight(geometry: &Geometry, scene: &Scene, pixel: f64) -> bool {
    let has_none = |kind: fn(&Solid) -> bool| all(&geometry.solids, |solid| !kind(solid));
    let has_balls = !has_none(is_ball);
    let touching = has_balls && !has_none(|solid| !is_ball(solid));
    let faces = geometry.faces.as_deref();
    if !touching && faces.is_none() && geometry.have_one_material(scene) {
        return false;
    }
    let is_mirror = |object: &Object| object.material().mirror() != DVec3::ZERO;
    let mirrors = geometry.examples(scene).any(is_mirror).then(|| {
        let is_mirror = |solid: &&Solid| is_mirror(&scene.objects[solid.order as usize]);
        geometry.solids.iter().filter(is_mirror).map(|solid| solid.shape.bounds()).reduce(join)
    });
    let balls = geometry.solids.iter().filter(|_| has_balls).filter_map(|solid| solid.shape.ball());
    let search = Search {
        solids: &geometry.solids,
        objects: &scene.objects,
        faces,
        pixel,
        parallel: matches!(geometry.view, View::Parallel { .. }),
        mirrors: mirrors.flatten(),
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
    /// The faces whose normals or colours vary, if there are any.
    faces: Option<&'a Faces>,
    pixel: f64,
    parallel: bool,
    /// The bounding box of all mirrors, if there are any.
    mirrors: Option<Bounds>,
    /// The largest [`on_sphere`] of the spheres.
    largest_ball: f64,
}

fn is_ball(solid: &Solid) -> bool {
    solid.shape.ball().is_some()
}

/// Returns the distance from a sphere's surface below which another surface may be hit on the wrong side of it.
fn on_sphere((center, radius): (DVec3, f64)) -> f64 {
    ON_SPHERE * <f32 as Real>::ROUNDOFF * (center.length() + radius)
}

/// The region that two boxes share, or nearly share.
struct Region {
    /// The largest coordinates in it.
    reach: DVec3,
    /// The distance below which two surfaces in it may be hit at the same distance, whatever their direction.
    slack: f64,
    /// The size of a pixel at its nearest point.
    pixel: f64,
}

impl Region {
    /// Returns the square of the sine of the angle beyond which two surfaces are within the slack over less than a
    /// pixel.
    fn steepest(&self) -> f64 {
        (2.0 * self.slack / self.pixel).powi(2)
    }

    /// Returns whether no two faces of two boxes are in almost one plane. Perpendicular ones are within the slack over less
    /// than a pixel.
    fn separates_boxes(&self, a: Bounds, b: Bounds) -> bool {
        let apart = |x: DVec3, y: DVec3| (x - y).abs();
        let nearest = apart(a.0, b.0).min(apart(a.0, b.1)).min(apart(a.1, b.0)).min(apart(a.1, b.1));
        2.0 * self.slack < self.pixel && nearest.min_element() > self.slack
    }
}

/// A search of a tree for a pair, by any number of threads.
struct Walk<'a> {
    search: &'a Search<'a>,
    branches: &'a Branches,
    contents: &'a [Content<'a>],
    /// The number of pairs that may still be compared. If there is no pair to be found, all threads together compare the same
    /// number, whatever the order.
    left: AtomicIsize,
}

impl Walk<'_> {
    /// Compares a pair of nodes, and adds the pairs within to the pending ones. Returns whether a pair of solids is
    /// found, or may be.
    fn step(&self, (a, b): (usize, usize), pending: &mut Vec<(usize, usize)>) -> bool {
        let Self { search, branches, contents, .. } = self;
        if contents[a].cannot_blur(&contents[b]) {
            return false;
        }
        // So many boxes in one place cannot be compared in time. Assuming that a pair exists is safe, because more precision
        // is never wrong.
        let is_too_much = |count: isize| self.left.fetch_sub(count, Ordering::Relaxed) < count;
        if is_too_much(1) {
            return true;
        }
        if a != b && !search.touch(branches.bounds(a), branches.bounds(b)) {
            return false;
        }
        match (branches.part(a), branches.part(b)) {
            (Part::Solids(of), _) if a == b => return search.within(of),
            (Part::Children(first, second), _) if a == b => {
                // Pairs that are nearest to each other come first, so that a cluster is found at once.
                pending.extend([(first, second), (second, second), (first, first)]);
            }
            (Part::Solids(of), Part::Solids(others)) => {
                let steepest = search.region(branches.bounds(a), branches.bounds(b)).steepest();
                let is_over = is_too_much((of.len() * others.len() / 4) as isize);
                let others = &search.solids[others];
                let is_blurred = |one: &Solid| others.iter().any(|other| search.blur(one, other, steepest));
                return is_over || search.solids[of].iter().any(is_blurred);
            }
            (Part::Children(first, second), Part::Solids(_)) => pending.extend([(first, b), (second, b)]),
            (Part::Solids(_), Part::Children(first, second)) => pending.extend([(a, first), (a, second)]),
            (Part::Children(first, second), Part::Children(third, fourth)) => {
                pending.extend([(first, third), (first, fourth), (second, third), (second, fourth)]);
            }
        }
        false
    }
}

impl Search<'_> {
    /// Searches the tree for a pair. Each unordered pair is visited once: a node is compared with itself and with the
    /// nodes after it.
    fn down(&self, branches: &Branches) -> bool {
        let contents = self.contents(branches);
        let most = (PAIRS * self.solids.len()).max(FEW_PAIRS);
        let left = AtomicIsize::new(most as isize);
        let walk = Walk { search: self, branches, contents: &contents, left };
        let mut pending = vec![(0, 0)];
        if branches.len() >= SHARED {
            // Level by level, until there is enough to share.
            while !pending.is_empty() && pending.len() < SHARES {
                let above = core::mem::take(&mut pending);
                if above.into_iter().any(|pair| walk.step(pair, &mut pending)) {
                    return true;
                }
            }
        }
        let finds_one = |pair: (usize, usize)| {
            let mut pending = vec![pair];
            while let Some(pair) = pending.pop() {
                if walk.step(pair, &mut pending) {
                    return true;
                }
            }
            false
        };
        if pending.len() < SHARES {
            pending.into_iter().rev().any(finds_one)
        } else {
            pending.into_par_iter().any(finds_one)
        }
    }

    /// Returns the contents of each node.
    fn contents(&self, branches: &Branches) -> Vec<Content<'_>> {
        let of_leaf = |at: &usize| match branches.part(*at) {
            Part::Children(..) => Content { material: None, balls: false, faces: false },
            Part::Solids(of) => {
                let solids = &self.solids[of];
                let balls = is_ball(&solids[0]);
                let is_varied = solids.iter().any(|solid| self.is_varied(solid));
                let first = (!is_varied).then(|| self.material(&solids[0]));
                let material =
                    first.filter(|first| solids.iter().all(|solid| self.material(solid) == *first));
                Content { material, balls, faces: !balls }
            }
        };
        let numbers: Vec<usize> = (0..branches.len()).collect();
        let mut contents = map(&numbers, of_leaf);
        for at in (0..contents.len()).rev() {
            if let Part::Children(first, second) = branches.part(at) {
                let (a, b) = (&contents[first], &contents[second]);
                contents[at] = Content {
                    material: a.material.filter(|_| a.material == b.material),
                    balls: a.balls || b.balls,
                    faces: a.faces || b.faces,
                };
            }
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

    /// Returns whether two boxes nearly overlap.
    fn touch(&self, a: Bounds, b: Bounds) -> bool {
        let (low, high) = (a.0.max(b.0), a.1.min(b.1));
        let slack = self.slack(low.abs().max(high.abs()).element_sum());
        (low - high).max_element() <= slack.max(self.largest_ball)
    }

    /// Returns the distance below which surfaces that reach `reach` from the origin may be hit at the same distance.
    fn slack(&self, reach: f64) -> f64 {
        // A reflected ray starts anywhere in the scene, which has a size of 1.
        ONE_SURFACE * <f32 as Real>::ROUNDOFF * if self.mirrors.is_some() { 1.0 } else { reach }
    }

    fn region(&self, a: Bounds, b: Bounds) -> Region {
        let (low, high) = (a.0.max(b.0), a.1.min(b.1));
        let reach = low.abs().max(high.abs());
        let nearest = || DVec3::ZERO.clamp(low.min(high), high.max(low)).length();
        let pixel = if self.parallel { self.pixel } else { self.pixel * nearest() };
        Region { reach, slack: self.slack(reach.element_sum()), pixel }
    }

    /// Returns whether two solids z-fight. Flat ones do not if the square of the sine between their normals is over
    /// `steepest`.
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
                self.spheres_z_fight(ball, b, &region, are_one) && self.differ(one, other)
            }
            (Some(ball), None) => self.sphere_blurs(ball, &other.shape, &region),
            (None, Some(ball)) => self.sphere_blurs(ball, &one.shape, &region),
            (None, None) => {
                if matches!((&one.shape, &other.shape), (Shape::Cuboid(_), Shape::Cuboid(_)))
                    && region.separates_boxes(bounds.0, bounds.1)
                {
                    return false;
                }
                let is_near = faces(&one.shape).any(|a| {
                    let slack = self.slack(a.normal.abs().dot(region.reach));
                    faces(&other.shape).any(|b| faces_z_fight(&a, &b, slack, region.pixel))
                });
                is_near && self.differ(one, other)
            }
        }
    }

    fn differ(&self, one: &Solid, other: &Solid) -> bool {
        self.material(one) != self.material(other) || self.is_varied(one) || self.is_varied(other)
    }

    /// Returns whether the normal or the colour of a solid varies, so that no other solid looks the same.
    fn is_varied(&self, solid: &Solid) -> bool {
        self.faces.is_some_and(|faces| faces.is_varied(solid.order as usize))
    }

    /// Returns whether two spheres z-fight: they are within the slack of each other on a strip as wide as a pixel.
    /// Spheres that touch from outside look separate from everywhere except from inside. Spheres that are meant to
    /// coincide count if their numbers differ in single precision.
    fn spheres_z_fight(
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

    /// Returns whether a sphere is visibly within the slack of a face, on a strip as wide as a pixel.
    fn sphere_blurs(&self, ball: (DVec3, f64), other: &Shape, region: &Region) -> bool {
        let (center, radius) = ball;
        let slack = region.slack.max(on_sphere(ball));
        let (min, max) = other.bounds();
        let middle = (min + max) / 2.0;
        2.0 * radius > region.pixel
            && faces(other).any(|face| {
                let side = face.normal.dot(center - face.corners[0]);
                // A sphere on the outside of a box is in front of the face for every viewer, or the box is in front of
                // the sphere.
                let within = face.normal.dot(middle - face.corners[0]);
                let is_outside = within * side < 0.0 && within.abs() > slack;
                !is_outside
                    && !self.are_viewers_beside(&face, side, slack)
                    && ring_on_plane(&face, center, radius, slack) >= region.pixel
            })
    }

    /// Returns whether all rays come from the side of a face on which a sphere's centre is, at the height `side`. Then
    /// the sphere is in front of the face.
    fn are_viewers_beside(&self, face: &Face, side: f64, slack: f64) -> bool {
        let (normal, height) =
            (face.normal * side.signum(), -face.normal.dot(face.corners[0]) * side.signum());
        let is_eye_beside = if self.parallel { normal.z > 0.0 } else { height > 0.0 };
        let lowest = |(min, max): Bounds| (normal * min).min(normal * max).element_sum() + height;
        is_eye_beside && self.mirrors.is_none_or(|mirrors| lowest(mirrors) >= -slack)
    }
}

/// The contents of a node.
#[derive(Clone, Copy)]
struct Content<'a> {
    /// The material of all objects, if there is only one. Most meshes have one, and their triangles need not be
    /// compared.
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
