//! Shapes that have axes of their own: planes, discs, cylinders, cones, tori, and boxes that stand askew.
//!
//! A shape is a file here: where rays in its own coordinates meet it, and the surface there. What is common stands in this
//! one: the way into these coordinates and back, the offset of new rays, the search. None of it is part of the steps that
//! look for spheres, boxes and triangles, or of their masks, lists and trees: scenes without bodies execute nothing for
//! them. Bodies are found down a tree of their own; planes, which have no bounds, stand beside it.
//!
//! Scenes with bodies are drawn in `f64`. Lengths are at most about 1, and all errors here are some roundoffs of that: a
//! place in the coordinates of a body has one of the difference to its middle, and three of a product with an axis; the
//! tests add what their files say, at most 32 of the body's size and of where it lies. New rays start off a surface by
//! twice that ([`Solid::offset`]).

mod cone;
mod cuboid;
mod disc;
mod few;
mod placed;
mod plane;
mod torus;

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use self::cone::Cone;
use self::cuboid::Cuboid;
use self::disc::Disc;
use self::few::Few;
pub(super) use self::placed::{Form, Solid, body, reach};
use self::torus::Torus;
use super::bounds::Crossing;
use super::descent::{backwards, descend};
use super::packet::{Nearest, Ray, Surface};
use super::parts::BUILT;
use super::real::{Lanes, Mask, Real, Vec3, constant, splat};
use super::shapes::Shape as Placed;
use super::tree::{Copies, Tree, group};

/// A packet of rays in the coordinates of a body.
#[derive(Clone, Copy)]
struct Local<S: Simd, E: Real> {
    origin: Vec3<S, E>,
    direction: Vec3<S, E>,
}

/// Where rays meet a body, in its coordinates or those of the scene: the place brought onto it, the unit normal on the side
/// that they came from, and whether that is the inside.
struct Met<S: Simd, E: Real> {
    point: Vec3<S, E>,
    normal: Vec3<S, E>,
    within: Mask<S, E>,
}

/// A shape in its own coordinates.
#[derive(Clone, Copy, Debug)]
enum Shape<E> {
    Plane,
    Disc(Disc<E>),
    /// With the middle of the end b.
    Cone(Cone<E>, [E; 3]),
    Torus(Torus<E>),
    Cuboid(Cuboid<E>),
}

impl<E> Shape<E> {
    /// Whether this build looks for it.
    #[inline(always)]
    fn is_built(&self) -> bool {
        match self {
            Self::Plane => BUILT.planes,
            Self::Disc(_) => BUILT.discs,
            Self::Cone(..) => BUILT.cones,
            Self::Torus(_) => BUILT.tori,
            Self::Cuboid(_) => BUILT.turned_boxes,
        }
    }
}

/// A body as the kernels read it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body<E> {
    /// Orthonormal; the last is that of what is round.
    axes: [[E; 3]; 3],
    /// Where they start.
    center: [E; 3],
    /// How far off its surface a new ray starts, beside what depends on the place.
    offset: E,
    order: E,
    shape: Shape<E>,
}

impl<E: Real> Body<E> {
    fn new(solid: &Solid) -> Self {
        let shape = match solid.form {
            Form::Plane => Shape::Plane,
            Form::Disc { radius } => Shape::Disc(Disc::new(radius)),
            Form::Cone { radii, height, end } => {
                Shape::Cone(Cone::new(radii, height), end.to_array().map(E::narrow))
            }
            Form::Torus { radius, thickness } => Shape::Torus(Torus::new(radius, thickness)),
            Form::Cuboid { half } => Shape::Cuboid(Cuboid::new(half)),
        };
        Self {
            axes: solid.axes.map(|axis| axis.to_array().map(E::narrow)),
            center: solid.center.to_array().map(E::narrow),
            offset: E::narrow(OFFSET * E::ROUNDOFF * solid.extent()),
            order: E::narrow(f64::from(solid.order)),
            shape,
        }
    }

    #[inline(always)]
    fn local<S: Simd>(&self, simd: S, ray: Ray<S, E>) -> Local<S, E> {
        let origin = ray.origin.sub(Vec3::splat(simd, self.center));
        Local { origin: self.turned(simd, origin), direction: self.turned(simd, ray.direction) }
    }

    #[inline(always)]
    fn turned<S: Simd>(&self, simd: S, v: Vec3<S, E>) -> Vec3<S, E> {
        let [x, y, z] = self.axes;
        Vec3::<S, E>::new(
            Vec3::splat(simd, x).dot(v),
            Vec3::splat(simd, y).dot(v),
            Vec3::splat(simd, z).dot(v),
        )
    }

    #[inline(always)]
    fn turned_back<S: Simd>(&self, simd: S, v: Vec3<S, E>) -> Vec3<S, E> {
        let [x, y, z] = self.axes;
        let along = Vec3::splat(simd, x).scale(v.x);
        let along = Vec3::splat(simd, y).scale_add(v.y, along);
        Vec3::splat(simd, z).scale_add(v.z, along)
    }

    /// What its own coordinates say in those of the scene.
    #[inline(always)]
    fn in_scene<S: Simd>(&self, simd: S, Met { point, normal, within }: Met<S, E>) -> Met<S, E> {
        let center = Vec3::splat(simd, self.center);
        let point = self.turned_back(simd, point).scale_add(constant::<S, E>(simd, 1.0), center);
        Met { point, normal: self.turned_back(simd, normal), within }
    }

    /// How high over the end b rays start, as exactly as over the end a: caps in the plane of a face are met where that is.
    #[inline(always)]
    fn over<S: Simd>(&self, simd: S, end: [E; 3], ray: Ray<S, E>) -> Lanes<S, E> {
        Vec3::splat(simd, self.axes[2]).dot(ray.origin.sub(Vec3::splat(simd, end)))
    }

    /// Offers where the rays meet the body, one of the tree: planes are met by themselves.
    // Out of line, so that there is one piece of code for all that looks for bodies.
    #[inline(never)]
    fn meet<S: Simd>(&self, simd: S, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        if !self.shape.is_built() {
            return;
        }
        // Apart, as discs need none of the room that the long tests of the others do.
        if let Shape::Disc(disc) = &self.shape {
            simd.vectorize(
                #[inline(always)]
                || {
                    let (hit, distance) = disc.meet(simd, self.local(simd, ray));
                    nearest.offer(simd, hit, distance, self.order);
                },
            );
        } else {
            simd.vectorize(
                #[inline(always)]
                || {
                    let local = self.local(simd, ray);
                    let (hit, distance) = match &self.shape {
                        Shape::Cone(cone, end) => cone.meet(simd, local, self.over(simd, *end, ray)),
                        Shape::Torus(torus) => torus.meet(simd, local, nearest.distance),
                        Shape::Cuboid(cuboid) => cuboid.meet(simd, local),
                        Shape::Plane | Shape::Disc(_) => return,
                    };
                    nearest.offer(simd, hit, distance, self.order);
                },
            );
        }
    }

    /// Offers where the rays meet the body, a plane, if any of the `open` ones do.
    #[inline(always)]
    fn meet_plane<S: Simd>(&self, simd: S, ray: Ray<S, E>, open: Mask<S, E>, nearest: &mut Nearest<S, E>) {
        let zero = constant::<S, E>(simd, 0.0);
        let up = Vec3::<S, E>::splat(simd, self.axes[2]);
        let high = up.dot(ray.origin.sub(Vec3::splat(simd, self.center)));
        let climb = up.dot(ray.direction);
        let comes = (high.simd_gt(zero) & climb.simd_lt(zero)) | (high.simd_lt(zero) & climb.simd_gt(zero));
        if (open & comes).any_true() {
            let (hit, distance) = plane::across::<S, E>(simd, high, climb);
            nearest.offer(simd, hit, distance, self.order);
        }
    }

    /// The surface where the rays meet the body.
    #[inline(never)]
    pub(super) fn surface<S: Simd>(&self, simd: S, ray: Ray<S, E>, distance: Lanes<S, E>) -> Surface<S, E> {
        simd.vectorize(
            #[inline(always)]
            || {
                let center = Vec3::splat(simd, self.center);
                let met = match &self.shape {
                    Shape::Plane | Shape::Disc(_) => {
                        let up = Vec3::splat(simd, self.axes[2]);
                        plane::surface(simd, (up, center), ray, distance)
                    }
                    Shape::Cone(cone, end) => {
                        let local = self.local(simd, ray);
                        let over = self.over(simd, *end, ray);
                        self.in_scene(simd, cone.surface(simd, local, over, distance))
                    }
                    Shape::Torus(torus) => {
                        self.in_scene(simd, torus.surface(simd, self.local(simd, ray), distance))
                    }
                    Shape::Cuboid(cuboid) => {
                        self.in_scene(simd, cuboid.surface(simd, self.local(simd, ray), distance))
                    }
                };
                let Met { point, normal, within } = met;
                let size = point.x.abs() + point.y.abs() + point.z.abs();
                let offset = size
                    .mul_add(constant::<S, E>(simd, OFFSET * E::ROUNDOFF), splat::<S, E>(simd, self.offset));
                Surface { start: normal.scale_add(offset, point), normal, offset, within }
            },
        )
    }
}

/// How far off its surface a new ray starts, in roundoffs of the place and of the body.
const OFFSET: f64 = 64.0;

/// All bodies of a scene.
#[derive(Debug)]
pub(super) struct Bodies<E> {
    /// Planes first, then in the order of the tree's leaves.
    bodies: Vec<Body<E>>,
    planes: usize,
    way: Way<E>,
    /// Those of the tree, where they are few.
    few: Option<Few<E>>,
}

/// Any body, whether they are few or many.
pub(super) const ANY: u64 = u64::MAX;

/// How bodies are found: one question, so that those in a tree do not ask for planes.
#[derive(Debug)]
enum Way<E> {
    Tree(Tree<E>),
    Planes,
    Both(Tree<E>),
}

impl<E: Real> Bodies<E> {
    pub(super) fn new(solids: &[Solid]) -> Self {
        let (mut planes, mut bounded): (Vec<Solid>, Vec<Solid>) =
            solids.iter().copied().partition(|solid| solid.bounds().is_none());
        let branches = group(&mut bounded, Some(true), Copies::Kept);
        let count = planes.len();
        let tree = branches.map(|branches| Tree::new(&branches, &bounded, |place| (count + place) as u32));
        let few = Few::new(&bounded);
        planes.append(&mut bounded);
        let way = match tree {
            Some(tree) if count == 0 => Way::Tree(tree),
            Some(tree) => Way::Both(tree),
            None => Way::Planes,
        };
        Self { bodies: planes.iter().map(Body::new).collect(), planes: count, way, few }
    }

    /// Where each stands, by its order in the script.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        self.bodies.iter().enumerate().map(|(at, body)| (body.order.to_index(), at))
    }

    /// The boxes around those that have bounds, in the order of the bits that ask for them; none where they are too many for
    /// that.
    pub(super) fn boxes(&self) -> Option<&[Placed]> {
        self.few.as_ref().map(|few| &few.boxes[..])
    }

    /// Offers where the rays meet a body that is not farther than what they met before: a plane, or one that `bits` asks for.
    #[inline(always)]
    pub(super) fn meet<S: Simd>(&self, simd: S, bits: u64, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        match &self.way {
            Way::Tree(tree) => self.meet_bounded(simd, (tree, bits), ray, nearest),
            Way::Planes => self.meet_planes(simd, ray, nearest),
            Way::Both(tree) => {
                self.meet_planes(simd, ray, nearest);
                self.meet_bounded(simd, (tree, bits), ray, nearest);
            }
        }
    }

    /// Whether any body is a plane.
    pub(super) fn has_planes(&self) -> bool {
        BUILT.planes && self.planes > 0
    }

    /// The tree of those that have bounds.
    pub(super) fn tree(&self) -> Option<&Tree<E>> {
        match &self.way {
            Way::Tree(tree) | Way::Both(tree) => Some(tree),
            Way::Planes => None,
        }
    }

    /// Offers where the rays meet a body of the tree: one that `bits` asks for, if they are few.
    #[inline(always)]
    pub(super) fn meet_bounded<S: Simd>(
        &self,
        simd: S,
        (tree, bits): (&Tree<E>, u64),
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        match &self.few {
            Some(few) if bits != ANY => self.meet_few(simd, (few, bits), ray, nearest),
            Some(_) | None => self.meet_in_tree(simd, tree, ray, nearest),
        }
    }

    #[inline(always)]
    fn meet_few<S: Simd>(
        &self,
        simd: S,
        (few, mut bits): (&Few<E>, u64),
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let zero = constant::<S, E>(simd, 0.0);
        // What others may write to stands in memory: a copy does, and `nearest` need not.
        let mut with = *nearest;
        while bits != 0 {
            let bit = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let open = with.distance.simd_gt(zero);
            if (open & few.are_near(simd, bit, ray)).any_true() {
                self.bodies[self.planes + bit].meet(simd, ray, &mut with);
            }
        }
        *nearest = with;
    }

    #[inline(always)]
    fn meet_in_tree<S: Simd>(&self, simd: S, tree: &Tree<E>, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        // Computed distances are no nearer than this to those of boxes beyond them.
        let slack = constant::<S, E>(simd, super::rounding::distance_error::<E>());
        let crossing = Crossing::new(simd, ray);
        let found = core::cell::Cell::new(*nearest);
        descend(
            tree,
            backwards(ray.direction),
            #[inline(always)]
            |node| {
                let distance = found.get().distance;
                let limit = distance.mul_add(slack, distance + slack);
                crossing.meets(simd, node.low, node.high, limit).any_true()
            },
            #[inline(always)]
            |_, items| {
                let mut nearest = found.get();
                for body in &self.bodies[items] {
                    body.meet(simd, ray, &mut nearest);
                }
                found.set(nearest);
                true
            },
        );
        *nearest = found.get();
    }

    /// Offers where the rays meet the planes, of which no more than one axis is needed.
    #[inline(always)]
    pub(super) fn meet_planes<S: Simd>(&self, simd: S, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        // What others may write to stands in memory: a copy does, and `nearest` need not.
        let mut with = *nearest;
        self.meet_planes_out_of_line(simd, ray, &mut with);
        *nearest = with;
    }

    // So that scenes without planes are not prepared for them.
    #[inline(never)]
    fn meet_planes_out_of_line<S: Simd>(&self, simd: S, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        if !BUILT.planes {
            return;
        }
        simd.vectorize(
            #[inline(always)]
            || {
                let zero = constant::<S, E>(simd, 0.0);
                let open = nearest.distance.simd_gt(zero);
                for plane in &self.bodies[..self.planes] {
                    plane.meet_plane(simd, ray, open, nearest);
                }
            },
        );
    }

    /// Offers where the rays meet one of the bodies.
    pub(super) fn meet_one<S: Simd>(&self, simd: S, at: usize, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        let body = &self.bodies[at];
        if at < self.planes {
            let all = nearest.distance.simd_gt(constant::<S, E>(simd, 0.0));
            body.meet_plane(simd, ray, all, nearest);
        } else {
            body.meet(simd, ray, nearest);
        }
    }

    /// Which of the rays that `lit` names meet no plane and no body that `bits` asks for, nearer than `far`.
    #[inline(always)]
    pub(super) fn unoccluded<S: Simd>(
        &self,
        simd: S,
        bits: u64,
        ray: Ray<S, E>,
        far: Lanes<S, E>,
        lit: Mask<S, E>,
    ) -> Mask<S, E> {
        let mut nearest = Nearest::none(simd);
        // What is in the dark has no way to go.
        nearest.distance = lit.select(far, constant::<S, E>(simd, -1.0));
        let limit = nearest.distance;
        self.meet(simd, bits, ray, &mut nearest);
        lit & !nearest.distance.simd_lt(limit)
    }

    /// The surface of one of the bodies.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(
        &self,
        simd: S,
        at: usize,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        self.bodies[at].surface(simd, ray, distance)
    }
}
