//! Surfaces that all but coincide.
//!
//! Where two surfaces of different colours lie nearer behind each other than `f32` tells apart, over more than a pixel,
//! rounding decides which of them is seen. Pairs of such surfaces are looked for here, in `f64`: faces of triangles and
//! boxes in almost one plane, and spheres of almost one centre and radius. Those that coincide in `f64`, too, are meant
//! to, and are not counted.

use std::ops::Range;

use glam::DVec3;
use rayfold_scene::{Material, Object, Scene};

use super::bounds::Bounds;
use super::geometry::{Geometry, View};
use super::placed::{Face, Placed};
use super::real::Real;
use super::shapes::{Shape, Solid};
use super::tree::{Branches, Part};

/// Surfaces nearer than this to each other, in roundoffs of their coordinates, may be met at one distance.
const ONE_SURFACE: f64 = 6.0;

/// Surfaces nearer than this to each other, relative to their coordinates, are meant to be one.
const MEANT: f64 = 1e-13;

/// Pairs of boxes that are looked at, for each object, before the search is given up.
const PAIRS: usize = 400;

/// Whether there are two surfaces whose order cannot be told in single precision, where it can be seen. `pixel` is the
/// size of a pixel: an angle from the eye, or a length in parallel projection.
pub(super) fn surfaces_blur(geometry: &Geometry, scene: &Scene, pixel: f64) -> bool {
    let first = scene.objects.first().map(Object::material);
    if scene.objects.iter().all(|object| Some(object.material()) == first) {
        return false;
    }
    let material = |solid: &Solid| scene.objects[solid.order as usize].material();
    let search = Search {
        solids: &geometry.solids,
        objects: &scene.objects,
        pixel,
        parallel: matches!(geometry.view, View::Parallel { .. }),
        mirrored: geometry.solids.iter().any(|solid| material(solid).mirror() != DVec3::ZERO),
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
    mirrored: bool,
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
        let materials = self.materials(branches);
        let mut left = PAIRS * self.solids.len();
        let mut pending = vec![(0, 0)];
        while let Some((a, b)) = pending.pop() {
            if materials[a].is_some() && materials[a] == materials[b] {
                continue;
            }
            left -= 1;
            if left == 0 {
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
                    pending.extend([(first, first), (second, second), (first, second)]);
                }
                (Part::Solids(of), Part::Solids(others)) => {
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

    /// The material of each node, if all in it have one: most meshes have, and need not be looked into.
    fn materials(&self, branches: &Branches) -> Vec<Option<&Material>> {
        let mut materials = vec![None; branches.len()];
        for at in (0..materials.len()).rev() {
            materials[at] = match branches.part(at) {
                Part::Solids(of) => {
                    let first = self.material(&self.solids[of.start]);
                    self.solids[of].iter().all(|solid| self.material(solid) == first).then_some(first)
                }
                Part::Children(first, second) => {
                    materials[first].filter(|_| materials[first] == materials[second])
                }
            };
        }
        materials
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
        (low - high).max_element() <= self.slack(low.abs().max(high.abs()).element_sum())
    }

    /// How near surfaces that reach so far from the origin may be met at one distance.
    fn slack(&self, reach: f64) -> f64 {
        // A mirrored ray starts anywhere in the scene, which has the size of 1.
        ONE_SURFACE * <f32 as Real>::ROUNDOFF * if self.mirrored { 1.0 } else { reach }
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
        let are_balls = || match (one.shape.ball(), other.shape.ball()) {
            (Some(one), Some(other)) => spheres_blur(one, other, &region),
            (Some(_), None) | (None, Some(_)) | (None, None) => false,
        };
        let is_near = are_balls()
            || faces(&one.shape).any(|a| {
                let slack = self.slack(a.normal.abs().dot(region.reach));
                faces(&other.shape).any(|b| faces_blur(&a, &b, slack, region.pixel))
            });
        is_near && self.material(one) != self.material(other)
    }
}

/// The distance between two spheres' surfaces along a direction is that of their radii and the part of that of their
/// centres: within the slack it is on a strip around both.
fn spheres_blur(
    (center, radius): (DVec3, f64),
    (c, r): (DVec3, f64),
    &Region { slack, pixel, .. }: &Region,
) -> bool {
    let (apart, thicker) = ((center - c).length(), (radius - r).abs());
    let is_one = apart + thicker <= MEANT * (center.abs().max_element() + radius);
    let strip = 2.0 * slack * radius;
    !is_one && thicker <= apart + slack && strip >= pixel * apart && 2.0 * radius > pixel
}

fn faces(shape: &Shape) -> impl Iterator<Item = Face> {
    shape.faces().map(|number| shape.face(number))
}

impl Face {
    /// For each edge a point of it, and a vector in the plane that points inwards, as long as the edge.
    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        (0..4).filter_map(move |k| {
            let (from, to) = (self.corners[k], self.corners[(k + 1) % 4]);
            (from != to).then(|| (from, self.normal.cross(to - from)))
        })
    }

    /// Whether no edge parts the two but for less than `depth`.
    fn may_cover(&self, other: &Self, depth: f64) -> bool {
        self.edges().all(|(from, inwards)| {
            let within = |corner: DVec3| inwards.dot(corner - from);
            let deepest = other.corners.map(within).into_iter().fold(0.0, f64::max);
            deepest * deepest > depth * depth * inwards.length_squared()
        })
    }
}

/// Whether two faces are within the slack of each other over more than a pixel.
fn faces_blur(a: &Face, b: &Face, slack: f64, pixel: f64) -> bool {
    // Around the line where their planes meet lies a strip as narrow as the angle is wide.
    if 4.0 * slack * slack < pixel * pixel * a.normal.cross(b.normal).length_squared() {
        return false;
    }
    let height = |corner: DVec3| a.normal.dot(corner - a.corners[0]);
    let span = |corners: &[DVec3]| {
        corners
            .iter()
            .map(|corner| height(*corner))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| {
                (low.min(height), high.max(height))
            })
    };
    let is_near = |(low, high): (f64, f64)| {
        let largest = a.corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
        low <= slack && high >= -slack && high.max(-low) > MEANT * largest
    };
    if !is_near(span(&b.corners)) || !a.may_cover(b, pixel) || !b.may_cover(a, pixel) {
        return false;
    }
    // What of one lies over the other (Sutherland and Hodgman).
    let mut over = b.corners.to_vec();
    for (from, inwards) in a.edges() {
        let depth = |corner: DVec3| inwards.dot(corner - from);
        let mut within = Vec::new();
        for (at, &corner) in over.iter().enumerate() {
            let before = over[(at + over.len() - 1) % over.len()];
            let (d, e) = (depth(before), depth(corner));
            if (d < 0.0) != (e < 0.0) {
                within.push(before.lerp(corner, d / (d - e)));
            }
            if e >= 0.0 {
                within.push(corner);
            }
        }
        over = within;
    }
    !over.is_empty() && is_near(span(&over))
}
