//! The unrounded numbers of shapes and the unrounded rays of pixels, for tests that rounding leaves undecided.
//!
//! In `f32` a secondary ray starts off its surface, by much more than the error of a pixel's ray. So for the few
//! secondary rays that pass an edge too closely to decide, the exact ray is computed again. It follows from the pixel's
//! ray and from the surface at which the secondary ray starts. This is done for rays in the first mirror and towards
//! suns. It is also done for rays towards suns from the points that the first mirror shows, if few planes are mirrors.
//! The start of the ray determines its pixel.

use std::cell::Cell;
use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::model::unit;

use super::{Shape, Solid, Sorted};
use crate::fast::arithmetic::exact::{Edge, passes};
use crate::fast::arithmetic::real::Real;
use crate::fast::arithmetic::rounding::{GONE_ON, TURNED};
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::kind::Kind;
use crate::fast::rays::pixels::Pixels;
use crate::fast::rays::predicate::{Beside, Corners};
use crate::fast::shapes::triangle;

/// The solids with unrounded numbers.
#[derive(Debug)]
pub(super) struct Exact<E> {
    solids: Arc<Vec<Solid>>,
    sorted: Sorted,
    /// The tree of solids, if there are many.
    tree: Option<Arc<dyn Neighbours>>,
    seen: Seen,
    number: PhantomData<E>,
}

/// An index of shapes by their boxes. This interface makes shapes independent of the tree.
pub(in crate::fast) trait Neighbours: Debug + Send + Sync {
    /// Returns whether `is` holds for the shapes of any group whose box contains `bounds`. The shapes of a group are of
    /// one kind, and are given by their indices among those of that kind.
    fn any_around(&self, bounds: Bounds, is: &dyn Fn(Kind, Range<usize>) -> bool) -> bool;
}

/// The pixels, suns and mirrors of a scene.
#[derive(Debug)]
pub(in crate::fast) struct Seen {
    /// The pixels, if each is a single ray from the eye.
    pub(in crate::fast) pixels: Option<Pixels>,
    /// The unit vectors towards the suns.
    pub(in crate::fast) suns: Vec<DVec3>,
    /// The normals and heights of the planes of mirrors, if they are few.
    pub(in crate::fast) mirrors: Vec<(DVec3, f64)>,
}

/// The intersection of an exact ray with a surface, and the normal on the ray's side.
#[derive(Clone, Copy)]
struct Met {
    distance: f64,
    normal: DVec3,
}

type Exactly = (DVec3, DVec3);

impl Met {
    /// Returns a point that is off the surface by more than the errors of `f64`.
    fn start(&self, (origin, direction): Exactly) -> DVec3 {
        let place = origin + self.distance * direction;
        place + self.normal * (64.0 * <f64 as Real>::ROUNDOFF * place.abs().element_sum())
    }

    /// Returns the reflected ray.
    fn mirrored(&self, ray: Exactly) -> Exactly {
        (self.start(ray), unit(ray.1 - 2.0 * ray.1.dot(self.normal) * self.normal))
    }
}

impl<E: Real> Corners for Exact<E> {
    fn of(&self, at: usize) -> [DVec3; 3] {
        match self.solids[self.sorted.triangles[at] as usize].shape {
            Shape::Triangle(triangle) => triangle.vertices,
            Shape::Sphere(_) | Shape::Cuboid(_) => unreachable!("the places are those of triangles"),
        }
    }

    // Neighbours are looked up only for the few rays that need them: to find them all would have a cost for every mesh.
    fn any_across(&self, at: usize, [p, q]: Edge, is: &dyn Fn(DVec3) -> bool) -> bool {
        let is_across = |other: usize| {
            let corners = self.of(other);
            let apex = corners.iter().find(|corner| **corner != p && **corner != q);
            other != at && corners.contains(&p) && corners.contains(&q) && apex.is_some_and(|apex| is(*apex))
        };
        match &self.tree {
            Some(tree) => tree.any_around((p.min(q), p.max(q)), &|kind, mut items| {
                kind == Kind::Triangle && items.any(is_across)
            }),
            None => (0..self.sorted.triangles.len()).any(is_across),
        }
    }

    fn unrounded(&self, direction: DVec3) -> Option<DVec3> {
        self.seen.pixels?.unrounded::<E>(direction, TURNED)
    }

    fn gone_on(&self, origin: DVec3, direction: DVec3, beside: Beside) -> Option<Exactly> {
        // The errors of `f64` are not visible.
        if E::ROUNDOFF < f64::EPSILON {
            return None;
        }
        match beside {
            Beside::Eye => None,
            Beside::Anywhere => {
                let ray = self.through(origin, GONE_ON)?;
                // The mirror's normal is off by the rounding of both directions.
                let turned = direction - ray.1;
                let is_mirror = |normal: DVec3| normal.cross(turned).length() <= GONE_ON * E::ROUNDOFF;
                Some(self.first_at(origin, ray, &is_mirror)?.mirrored(ray))
            }
            Beside::Light => {
                let sun =
                    self.seen.suns.iter().find(|sun| sun.distance(direction) < GONE_ON * E::ROUNDOFF)?;
                let met = |ray: Exactly| Some(self.first_at(origin, ray, &|_| true)?.start(ray));
                let seen = || self.through(origin, GONE_ON).and_then(met);
                let mirrored = || self.seen.mirrors.iter().find_map(|mirror| met(self.by(*mirror, origin)?));
                Some((seen().or_else(mirrored)?, *sun))
            }
        }
    }
}

impl<E: Real> Exact<E> {
    pub(super) fn new(
        solids: Arc<Vec<Solid>>,
        sorted: Sorted,
        tree: Option<Arc<dyn Neighbours>>,
        seen: Seen,
    ) -> Self {
        Self { solids, sorted, tree, seen, number: PhantomData }
    }

    /// Returns the ray from the eye for the pixel that shows a point, if it passes the point within `off` roundoffs.
    fn through(&self, place: DVec3, off: f64) -> Option<Exactly> {
        Some((DVec3::ZERO, self.seen.pixels?.unrounded::<E>(unit(place), off)?))
    }

    /// Returns the ray of the pixel that shows a point in a mirror, reflected at the mirror's plane.
    fn by(&self, (normal, height): (DVec3, f64), place: DVec3) -> Option<Exactly> {
        let image = place - 2.0 * (normal.dot(place) - height) * normal;
        // The mirror's ray starts off the mirror, too.
        let ray = self.through(image, 2.0 * GONE_ON)?;
        let at = ray.1 * (height / normal.dot(ray.1));
        let is_it = |other: DVec3| other.cross(normal).length() <= E::ROUNDOFF;
        Some(self.first_at(at, ray, &is_it)?.mirrored(ray))
    }

    /// Returns the nearest intersection of a ray near a point, with a surface whose normal satisfies `is`.
    fn first_at(&self, place: DVec3, ray: Exactly, is: &dyn Fn(DVec3) -> bool) -> Option<Met> {
        let slack = 2.0 * GONE_ON * E::ROUNDOFF * place.abs().element_sum();
        let first: Cell<Option<Met>> = Cell::new(None);
        let look = |kind: Kind, at: usize| {
            let Some(met) = intersect(&self.solids[self.sorted.of(kind)[at] as usize].shape, ray) else {
                return;
            };
            let apart = met.normal.dot(ray.0 + met.distance * ray.1 - place).abs();
            let is_before = first.get().is_none_or(|known| met.distance < known.distance);
            if is_before && met.distance > 0.0 && apart <= slack && is(met.normal) {
                first.set(Some(met));
            }
        };
        match &self.tree {
            // Boxes that overlap the one around the point.
            Some(tree) => {
                tree.any_around((place + slack, place - slack), &|kind, items| {
                    items.for_each(|at| look(kind, at));
                    false
                });
            }
            None => Kind::each(|kind| (0..self.sorted.of(kind).len()).for_each(|at| look(kind, at))),
        }
        first.get()
    }
}

/// Returns the first intersection of a ray with a shape; for boxes and spheres only from outside.
fn intersect(shape: &Shape, (origin, direction): Exactly) -> Option<Met> {
    match *shape {
        Shape::Triangle(triangle::RenderSpaceTriangle { vertices, normal, height }) => {
            let slope = normal.dot(direction);
            let distance = (height - normal.dot(origin)) / slope;
            let met = passes(vertices, origin, direction, |_| -1.0, |_| true);
            met.then_some(Met { distance, normal: -slope.signum() * normal })
        }
        Shape::Cuboid(cuboid) => {
            let (a, b) = ((cuboid.min - origin) / direction, (cuboid.max - origin) / direction);
            let (enter, leave) = (a.min(b), a.max(b).min_element());
            let distance = enter.max_element();
            let axis = (0..3).find(|&axis| enter[axis] == distance)?;
            let normal = -direction[axis].signum() * DVec3::AXES[axis];
            (distance <= leave).then_some(Met { distance, normal })
        }
        Shape::Sphere(sphere) => {
            let to_center = sphere.center - origin;
            let middle = to_center.dot(direction);
            let rest = sphere.radius * sphere.radius - (middle * direction - to_center).length_squared();
            let distance = middle - (rest >= 0.0).then(|| rest.sqrt())?;
            Some(Met { distance, normal: unit(distance * direction - to_center) })
        }
    }
}
