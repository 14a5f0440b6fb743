//! Shapes that have their own coordinate axes: planes, discs, cylinders, cones, tori, capsules, boxes with
//! round edges, and rotated boxes; triangles with holes; and models of many triangles.
//!
//! Each shape has its own file, with its intersection and its surface in the shape's coordinates. The common parts are
//! here: the transformation into these coordinates and back, the offset of new rays, and the search. None of it is part
//! of the code, the masks, the lists or the trees for spheres, boxes and triangles, so scenes without bodies execute
//! nothing for them. Bodies have a tree of their own. Planes have no bounding box and are kept outside it.
//!
//! Scenes with bodies are drawn in `f64`. Lengths are at most about 1, and all errors here are a few roundoffs of that.
//! A point in the coordinates of a body has one roundoff from the subtraction of the centre, and three from the product
//! with an axis. The tests add the errors given in their files, at most 32 roundoffs of the body's size and position.
//! New rays start off a surface by twice that ([`Solid::offset`]).

mod body_culler;
mod capsule;
mod cone;
mod cuboid;
mod cutout;
mod disc;
mod model;
mod plane;
mod roundbox;
mod solid;
mod torus;

use std::sync::Arc;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::Object;

use self::body_culler::BodyCuller;
use self::capsule::{Capsule, CapsuleForm};
use self::cone::{Cone, ConeForm};
use self::cuboid::{Cuboid, CuboidForm};
use self::cutout::{Cutout, CutoutForm};
pub(super) use self::cutout::{Holes, cutout};
use self::disc::{Disc, DiscForm};
pub(super) use self::model::ModelFaces;
use self::model::{ModelForm, SharedModel};
use self::plane::PlaneForm;
use self::roundbox::{Roundbox, RoundboxForm};
use self::solid::{Form, Frame, Place};
pub(super) use self::solid::{Solid, body, reach};
use self::torus::{Torus, TorusForm};
use super::shapes::Shape as PlacedShape;
use crate::fast::acceleration::descent::{nearest_in, nearest_past};
use crate::fast::acceleration::hollow::Hollows;
use crate::fast::acceleration::tree::{Copies, Tree, group};
use crate::fast::arithmetic::real::{Fused, Lanes, Mask, Real, Vec3, constant, splat};
use crate::fast::rays::packet::{Nearest, Ray, Surface};
use crate::meshes::mesh;
use crate::parts::BUILT;

/// A packet of rays in the coordinates of a body.
#[derive(Clone, Copy)]
struct Local<S: Simd, E: Real> {
    origin: Vec3<S, E>,
    direction: Vec3<S, E>,
}

/// The hits of a packet on a body, in its coordinates or those of the scene: the point, moved onto the surface; the
/// unit normal on the side that the ray came from; and whether that side is the inside.
struct BodyHit<S: Simd, E: Real> {
    point: Vec3<S, E>,
    normal: Vec3<S, E>,
    within: Mask<S, E>,
}

/// The shape of a body along its axes, in `f64`.
#[derive(Clone, Copy, Debug)]
enum AnyForm {
    Plane(PlaneForm),
    Disc(DiscForm),
    Cone(ConeForm),
    Torus(TorusForm),
    Capsule(CapsuleForm),
    Roundbox(RoundboxForm),
    Cuboid(CuboidForm),
    Cutout(CutoutForm),
    Model(ModelForm),
}

impl AnyForm {
    /// Returns the shape of an object and its coordinate frame, or `None` if the object is no body. A box of a group is one
    /// that is [turned](super::shapes::instance::turned).
    fn new(object: &Object, place: Place) -> Option<(Frame, Self)> {
        fn of<F>(form: fn(F) -> AnyForm) -> impl Fn((Frame, F)) -> (Frame, AnyForm) {
            move |(frame, own)| (frame, form(own))
        }
        Some(match object {
            Object::Plane(o) => of(Self::Plane)(PlaneForm::new(o, place)),
            Object::Disc(o) => of(Self::Disc)(DiscForm::new(o, place)),
            Object::Cylinder(o) => of(Self::Cone)(ConeForm::new([o.radius(); 2], o.ends(), place)),
            Object::Cone(o) => of(Self::Cone)(ConeForm::new(o.radii(), o.ends(), place)),
            Object::Torus(o) => of(Self::Torus)(TorusForm::new(o, place)),
            Object::Capsule(o) => of(Self::Capsule)(CapsuleForm::new(o, place)),
            Object::Roundbox(o) => of(Self::Roundbox)(RoundboxForm::new(o, None, place)),
            Object::Mesh(o) => of(Self::Model)(ModelForm::new(o.model(), None, place)),
            Object::Instance(o) => {
                let placement = o.placement();
                match o.object() {
                    Object::Mesh(o) => of(Self::Model)(ModelForm::new(o.model(), Some(placement), place)),
                    Object::Cuboid(o) => of(Self::Cuboid)(CuboidForm::new(o, placement, place)),
                    Object::Roundbox(o) => of(Self::Roundbox)(RoundboxForm::new(o, Some(placement), place)),
                    _ => return None,
                }
            }
            _ => return None,
        })
    }

    fn form(&self) -> &dyn Form {
        match self {
            Self::Plane(form) => form,
            Self::Disc(form) => form,
            Self::Cone(form) => form,
            Self::Torus(form) => form,
            Self::Capsule(form) => form,
            Self::Roundbox(form) => form,
            Self::Cuboid(form) => form,
            Self::Cutout(form) => form,
            Self::Model(form) => form,
        }
    }
}

/// A shape in its own coordinates, as the kernels use it.
#[derive(Debug)]
enum Shape<E> {
    Plane,
    Disc(Disc<E>),
    /// A cone, and the centre of its end b.
    Cone(Cone<E>, [E; 3]),
    Torus(Torus<E>),
    Capsule(Capsule<E>),
    Roundbox(Roundbox<E>),
    Cuboid(Cuboid<E>),
    /// A triangle with holes, in the coordinates of the scene.
    Cutout(Box<Cutout<E>>),
    Model(Box<SharedModel<E>>),
}

impl<E> Shape<E> {
    /// Returns whether this build intersects the shape.
    #[inline(always)]
    fn is_built(&self) -> bool {
        match self {
            Self::Plane => BUILT.planes,
            Self::Disc(_) => BUILT.discs,
            Self::Cone(..) => BUILT.cones,
            Self::Torus(_) => BUILT.tori,
            Self::Capsule(_) => BUILT.capsules,
            Self::Roundbox(_) => BUILT.roundboxes,
            Self::Cuboid(_) => BUILT.turned_boxes,
            Self::Cutout(_) => BUILT.pictures && BUILT.meshes,
            Self::Model(_) => BUILT.meshes,
        }
    }
}

/// A body as the kernels use it.
#[derive(Debug)]
pub(super) struct Body<E> {
    /// Orthonormal axes. The last is the axis of symmetry of round shapes.
    axes: [[E; 3]; 3],
    /// Whether the axes are those of the scene.
    is_straight: bool,
    /// The origin of the axes.
    center: [E; 3],
    /// The offset of a new ray from the surface, without the part that depends on the hit point.
    offset: E,
    order: E,
    /// The number of objects that the body stands for: the looks of a model, whose orders follow each other.
    looks: usize,
    shape: Shape<E>,
}

impl<E: Real> Body<E> {
    /// Makes a body of one of the `objects`. `holes` are the holes of triangles.
    fn new(solid: &Solid, objects: &[Object], holes: Option<&Arc<Holes>>) -> Self {
        let mut looks = 1;
        let shape = match solid.form {
            AnyForm::Plane(_) => Shape::Plane,
            AnyForm::Disc(DiscForm { radius }) => Shape::Disc(Disc::new(radius)),
            AnyForm::Cone(ConeForm { radii, height, end }) => {
                Shape::Cone(Cone::new(radii, height), end.to_array().map(E::narrow))
            }
            AnyForm::Torus(TorusForm { radius, thickness }) => Shape::Torus(Torus::new(radius, thickness)),
            AnyForm::Capsule(CapsuleForm { radius, height, .. }) => {
                Shape::Capsule(Capsule::new(radius, height))
            }
            AnyForm::Roundbox(RoundboxForm { half, radius }) => {
                Shape::Roundbox(Roundbox::new(half, radius, solid.frame.center.abs().max_element()))
            }
            AnyForm::Cuboid(CuboidForm { half }) => Shape::Cuboid(Cuboid::new(half)),
            AnyForm::Cutout(form) => match holes {
                Some(holes) => Shape::Cutout(Box::new(Cutout::new(form, solid.order, holes.clone()))),
                None => unreachable!("triangles are bodies for their holes alone"),
            },
            AnyForm::Model(form) => match mesh(&objects[solid.order as usize]) {
                Some(mesh) => {
                    looks = mesh.model().looks().len();
                    Shape::Model(Box::new(SharedModel::new(form, mesh.model())))
                }
                None => unreachable!("models are those of meshes"),
            },
        };
        Self {
            axes: solid.frame.axes.map(|axis| axis.to_array().map(E::narrow)),
            is_straight: solid.frame.axes == DVec3::AXES,
            center: solid.frame.center.to_array().map(E::narrow),
            offset: E::narrow(OFFSET * E::ROUNDOFF * solid.extent()),
            order: E::narrow(f64::from(solid.order)),
            looks,
            shape,
        }
    }

    #[inline(always)]
    fn local<S: Simd>(&self, simd: S, ray: Ray<S, E>) -> Local<S, E> {
        let origin = ray.origin.sub(Vec3::splat(simd, self.center));
        if self.is_straight {
            return Local { origin, direction: ray.direction };
        }
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

    /// Converts a hit from the body's coordinates to those of the scene.
    #[inline(always)]
    fn in_scene<S: Simd>(&self, simd: S, BodyHit { point, normal, within }: BodyHit<S, E>) -> BodyHit<S, E> {
        let center = Vec3::splat(simd, self.center);
        let point = self.turned_back(simd, point).scale_add(constant::<S, E>(simd, 1.0), center);
        BodyHit { point, normal: self.turned_back(simd, normal), within }
    }

    /// Returns the height of the ray origins above the end b, as exactly as above the end a. So a cap in the plane of a
    /// face is hit at the face's distance.
    #[inline(always)]
    fn over<S: Simd>(&self, simd: S, end: [E; 3], ray: Ray<S, E>) -> Lanes<S, E> {
        Vec3::splat(simd, self.axes[2]).dot(ray.origin.sub(Vec3::splat(simd, end)))
    }

    /// Offers the hits of the rays with the body, which is in the tree. Planes are intersected separately.
    // Out of line, so that all searches for bodies share one piece of code.
    #[inline(never)]
    fn intersect<S: Simd>(&self, simd: S, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        if !self.shape.is_built() {
            return;
        }
        // A separate branch, because discs need none of the stack that the long tests of the other shapes need.
        if let Shape::Disc(disc) = &self.shape {
            simd.vectorize(
                #[inline(always)]
                || {
                    let (hit, distance) = disc.intersect(simd, self.local(simd, ray));
                    nearest.offer(simd, hit, distance, self.order);
                },
            );
        } else {
            simd.vectorize(
                #[inline(always)]
                || {
                    let local = self.local(simd, ray);
                    let (hit, distance) = match &self.shape {
                        Shape::Cone(cone, end) => cone.intersect(simd, local, self.over(simd, *end, ray)),
                        Shape::Torus(torus) => torus.intersect(simd, local, nearest.distance),
                        Shape::Capsule(capsule) => capsule.intersect(simd, local),
                        Shape::Roundbox(roundbox) => roundbox.intersect(simd, local, nearest.distance),
                        Shape::Cuboid(cuboid) => cuboid.intersect(simd, local),
                        Shape::Cutout(cutout) => return cutout.intersect(simd, ray, nearest),
                        Shape::Model(model) => return model.intersect(simd, local, self.order, nearest),
                        Shape::Plane | Shape::Disc(_) => return,
                    };
                    nearest.offer(simd, hit, distance, self.order);
                },
            );
        }
    }

    /// Offers the hits of the rays with the body, which is a plane, if any of the `open` rays hits it.
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

    /// Returns the surface at the hits of the rays with the body that have this order.
    #[inline(never)]
    pub(super) fn surface<S: Simd>(
        &self,
        simd: S,
        order: E,
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
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
                    Shape::Capsule(capsule) => {
                        self.in_scene(simd, capsule.surface(simd, self.local(simd, ray), distance))
                    }
                    Shape::Roundbox(roundbox) => {
                        self.in_scene(simd, roundbox.surface(simd, self.local(simd, ray), distance))
                    }
                    Shape::Torus(torus) => {
                        self.in_scene(simd, torus.surface(simd, self.local(simd, ray), distance))
                    }
                    Shape::Cuboid(cuboid) => {
                        self.in_scene(simd, cuboid.surface(simd, self.local(simd, ray), distance))
                    }
                    Shape::Cutout(cutout) => return cutout.surface(simd, ray, distance),
                    Shape::Model(model) => {
                        let at = model.surface(simd, order, self.local(simd, ray), distance);
                        self.in_scene(simd, at)
                    }
                };
                let BodyHit { point, normal, within } = met;
                let size = point.x.abs() + point.y.abs() + point.z.abs();
                let offset = size.fused_mul_add(
                    constant::<S, E>(simd, OFFSET * E::ROUNDOFF),
                    splat::<S, E>(simd, self.offset),
                );
                Surface { start: normal.scale_add(offset, point), normal, offset, within }
            },
        )
    }
}

/// The offset of a new ray from the surface, in roundoffs of the hit point and of the body.
const OFFSET: f64 = 64.0;

/// All bodies of a scene.
#[derive(Debug)]
pub(super) struct Bodies<E> {
    /// The planes first, then the other bodies in the order of the tree's leaves.
    bodies: Vec<Body<E>>,
    planes: usize,
    /// The planes that shadow rays test first: all, or the opaque ones, which come first, if glass is tested
    /// separately.
    first_planes: usize,
    way: Way<E>,
    /// The bounding volumes of the bodies of the tree, if a mask has enough bits.
    few: Option<BodyCuller<E>>,
    /// Balls without surfaces in the tree, if many bodies lie around one another.
    hollows: Option<Hollows<E>>,
}

/// The mask of all bodies, for any number of them.
pub(super) const ANY: u64 = u64::MAX;

/// The structures that are searched for bodies. A single match decides, so a scene that has only a tree does not check
/// for planes.
#[derive(Debug)]
enum Way<E> {
    Tree(Tree<E>),
    Planes,
    Both(Tree<E>),
}

impl<E: Real> Bodies<E> {
    /// Makes the bodies of some `objects`. `holes` are the holes of triangles.
    pub(super) fn new(solids: &[Solid], objects: &[Object], holes: Option<&Arc<Holes>>) -> Self {
        let (mut planes, mut bounded): (Vec<Solid>, Vec<Solid>) =
            solids.iter().copied().partition(|solid| solid.bounds().is_none());
        let branches = group(&mut bounded, Some(true), Copies::Kept);
        let count = planes.len();
        let tree = branches.map(|branches| Tree::new(&branches, &bounded, |place| (count + place) as u32));
        let few = BodyCuller::new(&bounded);
        let many = tree.as_ref().filter(|_| few.is_none());
        let hollows = many.and_then(|tree| Hollows::new(tree, |at| bounded[at - count].hollow()));
        planes.append(&mut bounded);
        let way = match tree {
            Some(tree) if count == 0 => Way::Tree(tree),
            Some(tree) => Way::Both(tree),
            None => Way::Planes,
        };
        let bodies = planes.iter().map(|solid| Body::new(solid, objects, holes)).collect();
        Self { bodies, planes: count, first_planes: count, way, few, hollows }
    }

    /// Makes shadow rays test glass separately from opaque bodies. Returns the bodies of glass as bits, or `None` if
    /// there are too many bodies for a mask, or if some are only partly of glass.
    pub(super) fn part_glass(&mut self, is_glass: impl Fn(E) -> bool) -> Option<u64> {
        if self.few.is_none() && self.bodies.len() > self.planes {
            return None;
        }
        if self.bodies.iter().any(|body| {
            let first = body.order.to_index();
            let mut looks = (first..first + body.looks).map(|order| E::narrow(order as f64));
            body.looks > 1 && looks.any(&is_glass)
        }) {
            return None;
        }
        // Glass comes last.
        let (planes, bounded) = self.bodies.split_at(self.planes);
        self.first_planes = planes.partition_point(|plane| !is_glass(plane.order));
        let bits = bounded.iter().enumerate().map(|(bit, body)| u64::from(is_glass(body.order)) << bit);
        Some(bits.sum())
    }

    /// Returns, for each object that is a body, its order in the script and the body's index here.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, usize)> {
        self.bodies.iter().enumerate().flat_map(|(at, body)| {
            let first = body.order.to_index();
            (first..first + body.looks).map(move |order| (order, at))
        })
    }

    /// Returns the bounding boxes of the bodies that have one, in the order of their bits in a mask, or `None` if there
    /// are too many for a mask.
    pub(super) fn boxes(&self) -> Option<&[PlacedShape]> {
        self.few.as_ref().map(|few| &few.boxes[..])
    }

    /// Offers the hits of the rays that are no farther than the nearest hits so far, with planes and with the bodies of
    /// the mask `bits`.
    #[inline(always)]
    pub(super) fn intersect<S: Simd>(&self, simd: S, bits: u64, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        match &self.way {
            Way::Tree(tree) => self.meet_bounded(simd, (tree, bits), ray, nearest),
            Way::Planes => self.meet_planes(simd, ray, nearest),
            Way::Both(tree) => {
                self.meet_planes(simd, ray, nearest);
                self.meet_bounded(simd, (tree, bits), ray, nearest);
            }
        }
    }

    /// Returns whether any body is a plane.
    pub(super) fn has_planes(&self) -> bool {
        BUILT.planes && self.planes > 0
    }

    /// Returns the tree of the bodies that have bounding boxes.
    pub(super) fn tree(&self) -> Option<&Tree<E>> {
        match &self.way {
            Way::Tree(tree) | Way::Both(tree) => Some(tree),
            Way::Planes => None,
        }
    }

    /// Offers the hits of the rays with the bodies of the tree. If the bodies have bits, only those of the mask `bits`
    /// are tested.
    #[inline(always)]
    pub(super) fn meet_bounded<S: Simd>(
        &self,
        simd: S,
        (tree, bits): (&Tree<E>, u64),
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        match &self.few {
            Some(few) if bits != ANY || few.is_short => {
                self.meet_few(simd, (few, bits & few.all), ray, nearest)
            }
            Some(_) | None => self.meet_in_tree(simd, tree, ray, nearest),
        }
    }

    #[inline(always)]
    fn meet_few<S: Simd>(
        &self,
        simd: S,
        (few, mut bits): (&BodyCuller<E>, u64),
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        let zero = constant::<S, E>(simd, 0.0);
        // A callee that is not inlined needs its argument in memory. This copy is there, so that `nearest` can stay in
        // registers.
        let mut with = *nearest;
        while bits != 0 {
            let bit = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let open = with.distance.simd_gt(zero);
            if (open & few.are_near(simd, bit, ray, with.distance)).any_true() {
                self.bodies[self.planes + bit].intersect(simd, ray, &mut with);
            }
        }
        *nearest = with;
    }

    /// Returns the rays of `lit` that hit none of the bodies of the mask `bits` nearer than `far`. A ray that has hit
    /// one tests no more bodies.
    #[inline(always)]
    fn unoccluded_by_few<S: Simd>(
        &self,
        simd: S,
        (few, mut bits): (&BodyCuller<E>, u64),
        ray: Ray<S, E>,
        far: Lanes<S, E>,
        mut lit: Mask<S, E>,
    ) -> Mask<S, E> {
        if bits == 0 {
            return lit;
        }
        while bits != 0 {
            let bit = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            if (lit & few.are_near(simd, bit, ray, far)).any_true() {
                let (mut nearest, limit) = shadow_limit(simd, far, lit);
                self.bodies[self.planes + bit].intersect(simd, ray, &mut nearest);
                lit &= !nearest.distance.simd_lt(limit);
                if !lit.any_true() {
                    break;
                }
            }
        }
        lit
    }

    #[inline(always)]
    fn meet_in_tree<S: Simd>(&self, simd: S, tree: &Tree<E>, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        if let Some(hollows) = &self.hollows {
            let mut with = *nearest;
            self.meet_around(simd, (tree, hollows), ray, &mut with);
            *nearest = with;
            return;
        }
        *nearest = nearest_in(
            simd,
            tree,
            ray,
            *nearest,
            #[inline(always)]
            |_, items, nearest| {
                for body in &self.bodies[items] {
                    body.intersect(simd, ray, nearest);
                }
            },
        );
    }

    // Out of line, so that scenes whose boxes separate bodies keep their registers.
    #[inline(never)]
    fn meet_around<S: Simd>(
        &self,
        simd: S,
        (tree, hollows): (&Tree<E>, &Hollows<E>),
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                *nearest = nearest_past(
                    simd,
                    tree,
                    ray,
                    *nearest,
                    #[inline(always)]
                    |at, distance| hollows.hold(simd, at, ray, distance),
                    #[inline(always)]
                    |_, items, nearest| {
                        for body in &self.bodies[items] {
                            body.intersect(simd, ray, nearest);
                        }
                        true
                    },
                );
            },
        );
    }

    /// Returns the rays of `lit` that hit none of the bodies of the tree nearer than `far`. A ray that has hit one is not
    /// followed further.
    // Out of line, as the search for the nearest is.
    #[inline(never)]
    fn unoccluded_around<S: Simd>(
        &self,
        simd: S,
        (tree, hollows): (&Tree<E>, &Hollows<E>),
        ray: Ray<S, E>,
        far: Lanes<S, E>,
        lit: Mask<S, E>,
    ) -> Mask<S, E> {
        simd.vectorize(
            #[inline(always)]
            || {
                let (nearest, limit) = shadow_limit(simd, far, lit);
                let zero = constant::<S, E>(simd, 0.0);
                let reached = nearest_past(
                    simd,
                    tree,
                    ray,
                    nearest,
                    #[inline(always)]
                    |at, distance| hollows.hold(simd, at, ray, distance),
                    #[inline(always)]
                    |_, items, nearest| {
                        for body in &self.bodies[items] {
                            body.intersect(simd, ray, nearest);
                        }
                        let is_hit = nearest.distance.simd_lt(limit);
                        nearest.distance = is_hit.select(constant::<S, E>(simd, -1.0), nearest.distance);
                        nearest.distance.simd_ge(zero).any_true()
                    },
                );
                lit & reached.distance.simd_ge(limit)
            },
        )
    }

    /// Offers the hits of the rays with the planes. A plane needs only one axis.
    #[inline(always)]
    pub(super) fn meet_planes<S: Simd>(&self, simd: S, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        // A callee that is not inlined needs its argument in memory. This copy is there, so that `nearest` can stay in
        // registers.
        let mut with = *nearest;
        self.meet_planes_out_of_line(simd, &self.bodies[..self.planes], ray, &mut with);
        *nearest = with;
    }

    // Out of line, so that scenes without planes set up nothing for them.
    #[inline(never)]
    fn meet_planes_out_of_line<S: Simd>(
        &self,
        simd: S,
        planes: &[Body<E>],
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        if !BUILT.planes {
            return;
        }
        simd.vectorize(
            #[inline(always)]
            || {
                let zero = constant::<S, E>(simd, 0.0);
                let open = nearest.distance.simd_gt(zero);
                for plane in planes {
                    plane.meet_plane(simd, ray, open, nearest);
                }
            },
        );
    }

    /// Offers the hits of the rays with one of the bodies.
    pub(super) fn meet_one<S: Simd>(&self, simd: S, at: usize, ray: Ray<S, E>, nearest: &mut Nearest<S, E>) {
        let body = &self.bodies[at];
        if at < self.planes {
            let all = nearest.distance.simd_gt(constant::<S, E>(simd, 0.0));
            body.meet_plane(simd, ray, all, nearest);
        } else {
            body.intersect(simd, ray, nearest);
        }
    }

    /// Offers the hits of shadow rays with the planes of glass and with the bodies of the mask `bits`, if glass is
    /// tested separately.
    #[inline(always)]
    pub(super) fn meet_glass<S: Simd>(
        &self,
        simd: S,
        bits: u64,
        ray: Ray<S, E>,
        nearest: &mut Nearest<S, E>,
    ) {
        if self.has_planes_of_glass() {
            let planes = &self.bodies[self.first_planes..self.planes];
            self.meet_planes_out_of_line(simd, planes, ray, nearest);
        }
        if let Some(few) = &self.few
            && bits != 0
        {
            self.meet_few(simd, (few, bits), ray, nearest);
        }
    }

    /// Returns whether shadow rays test planes of glass separately.
    pub(super) fn has_planes_of_glass(&self) -> bool {
        BUILT.planes && self.first_planes < self.planes
    }

    /// Returns the rays of `lit` that hit no plane and no body of the mask `bits` nearer than `far`. If glass is tested
    /// separately, only opaque planes count.
    #[inline(always)]
    pub(super) fn unoccluded<S: Simd>(
        &self,
        simd: S,
        bits: u64,
        ray: Ray<S, E>,
        far: Lanes<S, E>,
        lit: Mask<S, E>,
    ) -> Mask<S, E> {
        // Apart, so that scenes without planes keep the search of the tree in registers.
        let has_planes = BUILT.planes && self.first_planes > 0;
        let lit = if has_planes { self.unoccluded_by_planes(simd, ray, far, lit) } else { lit };
        let Some(tree) = self.tree() else { return lit };
        if let Some(few) = &self.few
            && (bits != ANY || few.is_short)
        {
            return self.unoccluded_by_few(simd, (few, bits & few.all), ray, far, lit);
        }
        if let Some(hollows) = &self.hollows {
            return self.unoccluded_around(simd, (tree, hollows), ray, far, lit);
        }
        let (mut nearest, limit) = shadow_limit(simd, far, lit);
        self.meet_in_tree(simd, tree, ray, &mut nearest);
        lit & !nearest.distance.simd_lt(limit)
    }

    /// Returns the rays of `lit` that hit no plane nearer than `far`.
    #[inline(never)]
    fn unoccluded_by_planes<S: Simd>(
        &self,
        simd: S,
        ray: Ray<S, E>,
        far: Lanes<S, E>,
        lit: Mask<S, E>,
    ) -> Mask<S, E> {
        let (mut nearest, limit) = shadow_limit(simd, far, lit);
        self.meet_planes_out_of_line(simd, &self.bodies[..self.first_planes], ray, &mut nearest);
        lit & !nearest.distance.simd_lt(limit)
    }

    /// Returns the surface of one of the bodies at the hits that have this order.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(
        &self,
        simd: S,
        (at, order): (usize, E),
        ray: Ray<S, E>,
        distance: Lanes<S, E>,
    ) -> Surface<S, E> {
        self.bodies[at].surface(simd, order, ray, distance)
    }
}

/// Returns the initial hits of a search by shadow rays, and the distances at which they are still lit. Lanes in the
/// dark get a negative distance, so that nothing is searched for them.
#[inline(always)]
fn shadow_limit<S: Simd, E: Real>(
    simd: S,
    far: Lanes<S, E>,
    lit: Mask<S, E>,
) -> (Nearest<S, E>, Lanes<S, E>) {
    let distance = lit.select(far, constant::<S, E>(simd, -1.0));
    (Nearest { distance, ..Nearest::none(simd) }, distance)
}
