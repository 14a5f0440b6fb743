//! The shapes that there are: a kind is a file, and an arm in each `match` here.
//!
//! This is the one place that leads from a kind to its file. A kind that somewhere lacks its arm does not compile.

pub(super) mod cuboid;
pub(super) mod instance;
pub(super) mod sphere;
pub(super) mod triangle;

use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use fearless_simd::Simd;
use glam::{DMat3, DVec3};
use rayfold_scene::Object;

use self::cuboid::Cuboid;
use self::sphere::{Circle, Sphere};
use self::triangle::{Prism, Triangle};
use super::bounds::Bounds;
use super::exact::Edge;
use super::kind::{ByKind, Kind};
use super::lights::sun::Sun;
use super::packet::{Nearest, Ray, Surface};
use super::placed::{Face, Placed, Sight};
use super::predicate::Corners;
use super::rays::Pixels;
use super::real::{Lanes, Mask, Real, Vec3};
use super::shape::{Aim, Items, Obstructs, Tests};
use crate::parallel::map;

/// A shape in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Sphere(sphere::Placed),
    Cuboid(cuboid::Placed),
    Triangle(triangle::Placed),
}

/// An object and its position in the script.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    pub(super) shape: Shape,
    pub(super) order: u32,
}

/// Evaluates an expression for a shape, whatever it is.
macro_rules! whatever {
    ($of:expr, $shape:ident => $value:expr) => {
        match $of {
            Shape::Sphere($shape) => $value,
            Shape::Cuboid($shape) => $value,
            Shape::Triangle($shape) => $value,
        }
    };
}

impl Shape {
    pub(super) fn kind(&self) -> Kind {
        match self {
            Self::Sphere(_) => Kind::Sphere,
            Self::Cuboid(_) => Kind::Cuboid,
            Self::Triangle(_) => Kind::Triangle,
        }
    }

    /// What tells it from others of its kind.
    pub(super) fn numbers(&self) -> [f64; 9] {
        let mut numbers = [0.0; 9];
        let parts = match self {
            Self::Sphere(sphere) => [sphere.center, DVec3::splat(sphere.radius), DVec3::splat(sphere.power)],
            Self::Cuboid(cuboid) => [cuboid.min, cuboid.max, DVec3::ZERO],
            Self::Triangle(triangle) => triangle.vertices,
        };
        for (three, part) in numbers.chunks_exact_mut(3).zip(parts) {
            three.copy_from_slice(&part.to_array());
        }
        numbers
    }

    /// Whether rays meet both at the same distance bit for bit in single precision: their numbers are rounded to the same ones.
    pub(super) fn is_one_in_single(&self, other: &Self) -> bool {
        let square = |of: &Self| of.ball().map(|(_, radius)| (radius * radius) as f32);
        let (numbers, others) = (self.numbers(), other.numbers());
        numbers.map(|x| x as f32) == others.map(|x| x as f32) && square(self) == square(other)
    }

    /// A box of this size.
    pub(super) fn of_box((min, max): Bounds) -> Self {
        Self::Cuboid(cuboid::Placed { min, max })
    }

    /// An object of the scene in the kernels' coordinates: moved so that `center` is the origin, then scaled. None if it
    /// can never be hit, or is a [body](super::bodies).
    pub(super) fn new(object: &Object, center: DVec3, scale: f64) -> Option<Self> {
        match object {
            Object::Sphere(sphere) => Some(Self::Sphere(sphere::Placed::new(sphere, center, scale))),
            Object::Cuboid(cuboid) => Some(Self::Cuboid(cuboid::Placed::new(cuboid, center, scale))),
            Object::Triangle(triangle) => triangle::Placed::new(triangle, center, scale).map(Self::Triangle),
            Object::Instance(instance) => Self::new(&instance::in_world(instance)?, center, scale),
            Object::Plane(_) | Object::Disc(_) | Object::Cylinder(_) | Object::Cone(_) | Object::Torus(_) => {
                None
            }
        }
    }
}

/// The largest distance along an axis from `center` to a point of the object.
pub(super) fn reach(object: &Object, center: DVec3) -> f64 {
    match object {
        Object::Sphere(sphere) => sphere::reach(sphere, center),
        Object::Cuboid(cuboid) => cuboid::reach(cuboid, center),
        Object::Triangle(triangle) => triangle::reach(triangle, center),
        Object::Instance(instance) => {
            instance::in_world(instance).map_or(0.0, |object| reach(&object, center))
        }
        Object::Plane(_) | Object::Disc(_) | Object::Cylinder(_) | Object::Cone(_) | Object::Torus(_) => 0.0,
    }
}

impl Placed for Shape {
    fn bounds(&self) -> Bounds {
        whatever!(self, shape => shape.bounds())
    }

    fn support(&self, direction: DVec3) -> f64 {
        whatever!(self, shape => shape.support(direction))
    }

    fn across(&self, axis: DVec3, back: DVec3, slack: f64) -> Option<(f64, f64)> {
        whatever!(self, shape => shape.across(axis, back, slack))
    }

    fn is_its_box(&self) -> bool {
        whatever!(self, shape => shape.is_its_box())
    }

    fn ball(&self) -> Option<(DVec3, f64)> {
        whatever!(self, shape => shape.ball())
    }

    fn faces(&self) -> Range<usize> {
        whatever!(self, shape => shape.faces())
    }

    fn face(&self, number: usize) -> Face {
        whatever!(self, shape => shape.face(number))
    }

    fn plane(&self) -> Option<DVec3> {
        whatever!(self, shape => shape.plane())
    }

    fn nearest(&self) -> f64 {
        whatever!(self, shape => shape.nearest())
    }

    fn shadow_nearest(&self, x: DVec3, y: DVec3) -> f64 {
        whatever!(self, shape => shape.shadow_nearest(x, y))
    }

    fn is_fine(&self, sight: &Sight) -> bool {
        whatever!(self, shape => shape.is_fine(sight))
    }
}

/// Tests of every kind of shape.
pub(super) trait Formulas<E: Real>:
    Tests<Sphere<E>, E> + Tests<Cuboid<E>, E> + Tests<Triangle<E>, E> + 'static
{
}

impl<E: Real, By> Formulas<E> for By where
    By: Tests<Sphere<E>, E> + Tests<Cuboid<E>, E> + Tests<Triangle<E>, E> + 'static
{
}

/// All shapes as the kernels read them, by kind.
#[derive(Debug)]
pub(super) struct Shapes<E> {
    spheres: Vec<Sphere<E>>,
    cuboids: Vec<Cuboid<E>>,
    triangles: Vec<Triangle<E>>,
    exact: Exact<E>,
}

/// Solids by kind, each by its place among all.
pub(super) type Sorted = ByKind<Vec<u32>>;

/// The solids before their numbers were rounded.
#[derive(Debug)]
struct Exact<E> {
    solids: Arc<Vec<Solid>>,
    triangles: Vec<u32>,
    /// Where triangles are, if they are many.
    tree: Option<Arc<dyn Neighbours>>,
    /// If they are single rays from the eye.
    pixels: Option<Pixels>,
    number: PhantomData<E>,
}

/// A place to look shapes up by their boxes: the tree, of which shapes know no more.
pub(super) trait Neighbours: Debug + Send + Sync {
    /// Whether `is` holds of the shapes of any group whose box has this one within it; they are of one kind, by their places
    /// among those of that kind.
    fn any_around(&self, bounds: Bounds, is: &dyn Fn(Kind, Range<usize>) -> bool) -> bool;
}

impl<E: Real> Corners for Exact<E> {
    fn of(&self, at: usize) -> [DVec3; 3] {
        match self.solids[self.triangles[at] as usize].shape {
            Shape::Triangle(triangle) => triangle.vertices,
            Shape::Sphere(_) | Shape::Cuboid(_) => unreachable!("the places are those of triangles"),
        }
    }

    // Neighbours are looked up for the few rays that need them: to know them all would cost every mesh.
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
            None => (0..self.triangles.len()).any(is_across),
        }
    }

    fn unrounded(&self, direction: DVec3) -> Option<DVec3> {
        self.pixels?.unrounded::<E>(direction)
    }
}

/// What each of the sorted solids of a kind becomes, on all cores.
macro_rules! each {
    ($solids:expr, $places:expr, $kind:ident($shape:ident), $order:ident => $made:expr) => {
        map($places, |&place| {
            let Solid { shape, order: $order } = &$solids[place as usize];
            let Shape::$kind($shape) = shape else { unreachable!("solids are sorted by kind") };
            $made
        })
    };
}

impl<E: Real> Shapes<E> {
    pub(super) fn new(
        solids: &Arc<Vec<Solid>>,
        sorted: Sorted,
        tree: Option<Arc<dyn Neighbours>>,
        pixels: Option<Pixels>,
    ) -> Self {
        Self {
            spheres: each!(solids, &sorted.spheres, Sphere(sphere), order => Sphere::new(sphere, *order)),
            cuboids: each!(solids, &sorted.cuboids, Cuboid(cuboid), order => Cuboid::new(cuboid, *order)),
            triangles: each!(solids, &sorted.triangles, Triangle(triangle), order => {
                Triangle::new(triangle, *order)
            }),
            exact: Exact {
                solids: solids.clone(),
                triangles: sorted.triangles,
                tree,
                pixels,
                number: PhantomData,
            },
        }
    }
}

/// All shapes as obstacles to one sun, but for those that are the same to all.
#[derive(Clone, Debug)]
pub(super) struct Obstacles<E> {
    spheres: Vec<Circle<E>>,
    triangles: Vec<Prism<E>>,
}

impl<E: Real> Obstacles<E> {
    /// `axes` are the sun's [rounded](Sun::rounded) ones.
    pub(super) fn new(solids: &[Solid], sorted: &Sorted, axes: DMat3) -> Self {
        Self {
            spheres: each!(solids, &sorted.spheres, Sphere(sphere), _order => Circle::new(sphere, axes)),
            triangles: each!(solids, &sorted.triangles, Triangle(triangle), _order => {
                Prism::new(triangle, axes)
            }),
        }
    }
}

/// What the tests of each kind have in common for a packet of rays.
#[derive(Clone, Copy)]
pub(super) struct Aimed<S: Simd, E: Real> {
    cuboids: <Cuboid<E> as Aim<E>>::Aimed<S>,
    triangles: <Triangle<E> as Aim<E>>::Aimed<S>,
}

impl<S: Simd, E: Real> Aimed<S, E> {
    #[inline(always)]
    pub(super) fn new(simd: S, ray: Ray<S, E>) -> Self {
        Self { cuboids: Cuboid::aim(simd, ray), triangles: Triangle::aim(simd, ray) }
    }
}

impl<E: Real> Shapes<E> {
    /// Offers where rays meet some of the shapes of a kind. What the kind's tests have in common is worked out here unless
    /// it is known.
    #[inline(always)]
    pub(super) fn meet<S: Simd, By: Formulas<E>, const EYE: bool>(
        &self,
        simd: S,
        (kind, items): (Kind, impl Items),
        ray: Ray<S, E>,
        aimed: Option<Aimed<S, E>>,
        nearest: &mut Nearest<S, E>,
    ) {
        match kind {
            Kind::Sphere => self.meet_each::<_, _, By, EYE>(simd, &self.spheres, items, ray, (), nearest),
            Kind::Cuboid => {
                let aimed = match aimed {
                    Some(aimed) => aimed.cuboids,
                    None => Cuboid::aim(simd, ray),
                };
                self.meet_each::<_, _, By, EYE>(simd, &self.cuboids, items, ray, aimed, nearest);
            }
            Kind::Triangle => {
                let aimed = match aimed {
                    Some(aimed) => aimed.triangles,
                    None => Triangle::aim(simd, ray),
                };
                self.meet_each::<_, _, By, EYE>(simd, &self.triangles, items, ray, aimed, nearest);
            }
        }
    }

    #[inline(always)]
    fn meet_each<S: Simd, P: Aim<E>, By: Tests<P, E>, const EYE: bool>(
        &self,
        simd: S,
        all: &[P],
        items: impl Items,
        ray: Ray<S, E>,
        aimed: P::Aimed<S>,
        nearest: &mut Nearest<S, E>,
    ) {
        for (at, shape) in items.of(all) {
            By::meet::<S, EYE>(simd, shape, (&self.exact, at), ray, aimed, nearest);
        }
    }

    /// Whether the eye lies outside a convex shape: what rays from there see of it is not in its own shadow.
    #[inline(always)]
    pub(super) fn is_seen_from_outside(&self, kind: Kind, at: usize) -> bool {
        match kind {
            Kind::Sphere => self.spheres[at].is_outside_the_eye(),
            Kind::Cuboid | Kind::Triangle => false,
        }
    }

    /// The surface of a shape where rays meet it.
    #[inline(always)]
    pub(super) fn surface<S: Simd, By: Formulas<E>, const EYE: bool>(
        &self,
        simd: S,
        (kind, at): (Kind, usize),
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        match kind {
            Kind::Sphere => By::surface::<S, EYE>(simd, &self.spheres[at], ray, distance),
            Kind::Cuboid => By::surface::<S, EYE>(simd, &self.cuboids[at], ray, distance),
            Kind::Triangle => By::surface::<S, EYE>(simd, &self.triangles[at], ray, distance),
        }
    }
}

/// What the tests of each kind have in common for a packet of points in the light of a sun.
#[derive(Clone, Copy)]
pub(super) struct Faced<S: Simd, E: Real> {
    spheres: <Sphere<E> as Obstructs<E>>::Faced<S>,
}

impl<S: Simd, E: Real> Faced<S, E> {
    #[inline(always)]
    pub(super) fn new(simd: S, sun: &Sun<E>, point: Vec3<S, E>) -> Self {
        Self { spheres: Sphere::face(simd, sun, point) }
    }
}

/// All shapes in the light of a sun.
pub(super) struct InLight<'a, E> {
    pub(super) shapes: &'a Shapes<E>,
    pub(super) sun: &'a Sun<E>,
    pub(super) obstacles: &'a Obstacles<E>,
}

impl<E: Real> InLight<'_, E> {
    /// Which of the points that `lit` names stay lit behind some of the shapes of a kind. What the kind's tests have in
    /// common is worked out here unless it is known.
    #[inline(always)]
    pub(super) fn unoccluded<S: Simd>(
        &self,
        simd: S,
        (kind, items): (Kind, impl Items),
        point: Vec3<S, E>,
        faced: Option<Faced<S, E>>,
        lit: Mask<S, E>,
    ) -> Mask<S, E> {
        let &Self { shapes, sun, obstacles } = self;
        let exact = &shapes.exact;
        match kind {
            Kind::Sphere => {
                let faced = match faced {
                    Some(faced) => faced.spheres,
                    None => Sphere::face(simd, sun, point),
                };
                let all = (&obstacles.spheres[..], exact as _);
                Sphere::unoccluded(simd, all, items, sun, (point, faced), lit)
            }
            Kind::Cuboid => {
                let all = (&shapes.cuboids[..], exact as _);
                Cuboid::unoccluded(simd, all, items, sun, (point, ()), lit)
            }
            Kind::Triangle => {
                let all = (&obstacles.triangles[..], exact as _);
                Triangle::unoccluded(simd, all, items, sun, (point, ()), lit)
            }
        }
    }
}
