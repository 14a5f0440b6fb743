//! The shapes. Each kind has a file, and an arm in each `match` here.
//!
//! Only this module dispatches from a kind to its file. A kind that lacks one of its arms does not compile.

pub(super) mod cuboid;
pub(super) mod instance;
#[cfg(feature = "accuracy")]
pub(super) mod naive;
pub(super) mod shape;
pub(super) mod sphere;
pub(super) mod triangle;
mod unrounded;

use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

use fearless_simd::Simd;
use glam::{DMat3, DVec3};
use rayfold_scene::{Instance, Object, Placement};

use self::cuboid::Cuboid;
use self::sphere::{Circle, Sphere};
use self::triangle::{Prism, Triangle};
use self::unrounded::Exact;
pub(super) use self::unrounded::{Neighbours, Seen};
use super::lights::sun::Sun;
use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3};
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::kind::{ByKind, Kind};
use crate::fast::rays::packet::{Nearest, Ray, Surface};
use crate::fast::rays::placed::{Face, RenderSpaceShape, Sight};
use crate::fast::shapes::shape::{Items, Obstructs, Precalculations, Tests};
use crate::parallel::map;
use crate::reference::{Place, power};
use crate::scale::below_inverse;

/// A shape in the kernels' coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    Sphere(sphere::RenderSpaceSphere),
    Cuboid(cuboid::RenderSpaceCuboid),
    Triangle(triangle::RenderSpaceTriangle),
}

/// An object and its position in the script.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    pub(super) shape: Shape,
    pub(super) order: u32,
}

/// Evaluates an expression for a shape of any kind.
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

    /// Returns the numbers that distinguish the shape from others of its kind.
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

    /// Returns whether rays hit both shapes at the same distance bit for bit in single precision, because their numbers
    /// round to the same numbers.
    pub(super) fn is_one_in_single(&self, other: &Self) -> bool {
        let square = |of: &Self| of.ball().map(|(_, radius)| (radius * radius) as f32);
        let (numbers, others) = (self.numbers(), other.numbers());
        numbers.map(|x| x as f32) == others.map(|x| x as f32) && square(self) == square(other)
    }

    /// Makes a box of this size.
    pub(super) fn of_box((min, max): Bounds) -> Self {
        Self::Cuboid(cuboid::RenderSpaceCuboid { min, max })
    }

    /// Returns an object of the scene in the kernels' coordinates: moved so that `center` is the origin, then scaled.
    /// Returns `None` if it can never be hit, or is a [body](super::bodies).
    pub(super) fn new(object: &Object, center: DVec3, scale: f64) -> Option<Self> {
        match object {
            Object::Sphere(sphere) => {
                Some(Self::Sphere(sphere::RenderSpaceSphere::new(sphere, center, scale)))
            }
            Object::Cuboid(cuboid) => {
                Some(Self::Cuboid(cuboid::RenderSpaceCuboid::new(cuboid, center, scale)))
            }
            Object::Triangle(triangle) => {
                triangle::RenderSpaceTriangle::new(triangle.vertices(), center, scale).map(Self::Triangle)
            }
            Object::Instance(instance) => match Self::new(&instance::in_world(instance)?, center, scale) {
                Some(placed) if !placed.is_lost(center * scale) => {
                    Some(placed.on_the_side_of(instance, center, scale))
                }
                placed => Self::at_the_eye(instance, center, scale).or(placed),
            },
            _ => None,
        }
    }
}

/// A visible part of an object's size.
const VISIBLE: f64 = 1e-3;

/// Returns corners of a group as seen from the eye. The eye is transformed into the group, so that tiny objects near
/// the eye keep their size wherever the group is.
fn from_eye<const N: usize>(corners: &[DVec3; N], placement: &Placement, eye: DVec3) -> [DVec3; N] {
    let local = Place::in_group(eye, placement);
    corners.map(|corner| placement.rotation() * local.towards(corner) * placement.scale())
}

impl Shape {
    /// Returns an object of a group as seen from the eye.
    fn at_the_eye(instance: &Instance, eye: DVec3, scale: f64) -> Option<Self> {
        let placement = instance.placement();
        match instance.object() {
            Object::Sphere(sphere) => {
                let [center] = from_eye(&[sphere.center()], placement, eye);
                let radius = placement.scale() * sphere.radius();
                let moved = rayfold_scene::Sphere::new(radius, center, sphere.material().clone()).ok()?;
                Some(Self::Sphere(sphere::RenderSpaceSphere::new(&moved, DVec3::ZERO, scale)))
            }
            Object::Cuboid(cuboid) => {
                let [a, b] = from_eye(cuboid.corners(), placement, eye).map(|corner| corner * scale);
                Some(Self::of_box((a.min(b), a.max(b))))
            }
            Object::Triangle(triangle) => {
                let corners = from_eye(triangle.vertices(), placement, eye);
                triangle::RenderSpaceTriangle::new(&corners, DVec3::ZERO, scale).map(Self::Triangle)
            }
            _ => None,
        }
    }

    /// Returns whether rounding at the place of the group may have moved its numbers by a visible part of its size, for
    /// an eye in these coordinates.
    fn is_lost(&self, eye: DVec3) -> bool {
        let (low, high) = self.bounds();
        let largest = eye.abs().max(low.abs()).max(high.abs()).max_element();
        f64::EPSILON * largest > VISIBLE * (high - low).max_element()
    }

    /// Returns an object of a group with the eye on the right side of its surface, even if rounding changed the side.
    fn on_the_side_of(self, instance: &Instance, eye: DVec3, scale: f64) -> Self {
        let placement = instance.placement();
        match (self, instance.object()) {
            (Self::Sphere(placed), Object::Sphere(sphere)) => {
                let scale = placement.scale() * scale;
                let rough = below_inverse(1.0 / scale);
                let power = power(Place::in_group(eye, placement), sphere, rough) * (scale / rough).powi(2);
                let is_other = power.partial_cmp(&0.0) != placed.power.partial_cmp(&0.0);
                Self::Sphere(if is_other { sphere::RenderSpaceSphere { power, ..placed } } else { placed })
            }
            (Self::Cuboid(placed), Object::Cuboid(cuboid)) => {
                let [a, b] = from_eye(cuboid.corners(), placement, eye).map(|corner| corner * scale);
                let exact = cuboid::RenderSpaceCuboid { min: a.min(b), max: a.max(b) };
                let sides = |of: cuboid::RenderSpaceCuboid| {
                    [of.min, of.max].map(|corner| corner.to_array().map(|x| x.partial_cmp(&0.0)))
                };
                Self::Cuboid(if sides(exact) == sides(placed) { placed } else { exact })
            }
            _ => self,
        }
    }
}

/// Returns the largest distance along an axis from `center` to a point of the object.
pub(super) fn reach(object: &Object, center: DVec3) -> f64 {
    match object {
        Object::Sphere(sphere) => sphere::reach(sphere, center),
        Object::Cuboid(cuboid) => cuboid::reach(cuboid, center),
        Object::Triangle(triangle) => triangle::reach(triangle, center),
        Object::Instance(instance) => {
            instance::in_world(instance).map_or(0.0, |object| reach(&object, center))
        }
        _ => 0.0,
    }
}

impl RenderSpaceShape for Shape {
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

/// All shapes as the kernels use them, by kind.
#[derive(Debug)]
pub(super) struct Shapes<E> {
    spheres: Vec<Sphere<E>>,
    cuboids: Vec<Cuboid<E>>,
    triangles: Vec<Triangle<E>>,
    exact: Exact<E>,
}

/// The solids of each kind, by their indices among all.
pub(super) type Sorted = ByKind<Vec<u32>>;

/// Converts each of the sorted solids of a kind, on all cores.
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
        seen: Seen,
    ) -> Self {
        Self {
            spheres: each!(solids, &sorted.spheres, Sphere(sphere), order => Sphere::new(sphere, *order)),
            cuboids: each!(solids, &sorted.cuboids, Cuboid(cuboid), order => Cuboid::new(cuboid, *order)),
            triangles: each!(solids, &sorted.triangles, Triangle(triangle), order => {
                Triangle::new(triangle, *order)
            }),
            exact: Exact::new(solids.clone(), sorted, tree, seen),
        }
    }
}

/// All shapes as occluders of one sun, except those whose data does not depend on the sun.
#[derive(Clone, Debug)]
pub(super) struct Obstacles<E> {
    spheres: Vec<Circle<E>>,
    triangles: Vec<Prism<E>>,
}

impl<E: Real> Obstacles<E> {
    /// Makes the occluders. `axes` are the sun's [rounded](Sun::rounded) axes.
    pub(super) fn new(solids: &[Solid], sorted: &Sorted, axes: DMat3) -> Self {
        Self {
            spheres: each!(solids, &sorted.spheres, Sphere(sphere), _order => Circle::new(sphere, axes)),
            triangles: each!(solids, &sorted.triangles, Triangle(triangle), _order => {
                Prism::new(triangle, axes)
            }),
        }
    }
}

/// The per-ray constants that the tests of each kind share.
#[derive(Clone, Copy)]
pub(super) struct RayPrecalculations<S: Simd, E: Real> {
    cuboids: <Cuboid<E> as Precalculations<E>>::RayPrecalculations<S>,
    triangles: <Triangle<E> as Precalculations<E>>::RayPrecalculations<S>,
}

impl<S: Simd, E: Real> RayPrecalculations<S, E> {
    #[inline(always)]
    pub(super) fn new(simd: S, ray: Ray<S, E>) -> Self {
        Self { cuboids: Cuboid::aim(simd, ray), triangles: Triangle::aim(simd, ray) }
    }
}

impl<E: Real> Shapes<E> {
    /// Offers the hits of rays with some of the shapes of a kind. Computes the constants of the kind's tests if `aimed`
    /// is `None`.
    #[inline(always)]
    pub(super) fn intersect<S: Simd, By: Formulas<E>, const EYE: bool>(
        &self,
        simd: S,
        (kind, items): (Kind, impl Items),
        ray: Ray<S, E>,
        aimed: Option<RayPrecalculations<S, E>>,
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
    fn meet_each<S: Simd, P: Precalculations<E>, By: Tests<P, E>, const EYE: bool>(
        &self,
        simd: S,
        all: &[P],
        items: impl Items,
        ray: Ray<S, E>,
        aimed: P::RayPrecalculations<S>,
        nearest: &mut Nearest<S, E>,
    ) {
        for (at, shape) in items.of(all) {
            By::intersect::<S, EYE>(simd, shape, (&self.exact, at), ray, aimed, nearest);
        }
    }

    /// Returns the triangle at an index.
    #[inline(always)]
    pub(super) fn triangle(&self, at: usize) -> &Triangle<E> {
        &self.triangles[at]
    }

    /// Returns whether the eye is outside a convex shape. If so, the part that is visible from the eye is not in the
    /// shape's own shadow.
    #[inline(always)]
    pub(super) fn is_seen_from_outside(&self, kind: Kind, at: usize) -> bool {
        match kind {
            Kind::Sphere => self.spheres[at].is_outside_the_eye(),
            Kind::Cuboid | Kind::Triangle => false,
        }
    }

    /// Returns the surface at the hits of rays with a shape.
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

/// The per-point constants that the tests of each kind share in the light of a sun.
#[derive(Clone, Copy)]
pub(super) struct SunPrecalculations<S: Simd, E: Real> {
    spheres: <Sphere<E> as Obstructs<E>>::SunPrecalculations<S>,
}

impl<S: Simd, E: Real> SunPrecalculations<S, E> {
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
    /// Returns the points of `lit` that none of the given shapes of a kind occludes. Computes the constants of the
    /// kind's tests if `faced` is `None`.
    #[inline(always)]
    pub(super) fn unoccluded<S: Simd>(
        &self,
        simd: S,
        (kind, items): (Kind, impl Items),
        point: Vec3<S, E>,
        faced: Option<SunPrecalculations<S, E>>,
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
