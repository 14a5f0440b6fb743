//! Models of many triangles, each drawn from one tree in the coordinates of the model.
//!
//! The tree stays with the model: it is made once, however often the model is drawn, and in how many frames. A ray is moved
//! to just before it enters the model's bounding sphere, so that no number there is greater than about 2. The triangles of one
//! model are tested with the same numbers for a ray, so that no ray passes between them, and with the bounds on errors of all
//! triangles ([`Robust`]). The moved origin has an error of a few roundoffs of the model's position and size, and so has the
//! distance: within the bound of bodies.

use std::sync::Arc;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3};
use rayfold_scene::Placement;
use rayfold_scene::assets::Model;
use rayon::prelude::*;

use super::solid::{Form, Frame, Place};
use super::{BodyHit, Local};
use crate::fast::acceleration::descent::nearest_in;
use crate::fast::acceleration::tree::{Copies, Tree, group};
use crate::fast::arithmetic::real::{Fused, Lanes, Real, constant, splat};
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::kind::{ByKind, Kind};
use crate::fast::rays::packet::{Nearest, Ray, no_lane};
use crate::fast::shapes::shape::Robust;
use crate::fast::shapes::triangle::RenderSpaceTriangle;
use crate::fast::shapes::{RayPrecalculations, Seen, Shape, Shapes, Solid, Sorted};
use crate::fast::shared::Surface;
use crate::meshes::{ONE_FACE, hit_face};
use crate::scale::below_inverse;

/// The number of triangles that one thread makes at a time.
const ALONE: usize = 4096;

/// The distance from the middle at which rays begin, in radii of the bounding sphere: what touches the sphere is ahead of them.
const FAR_ENOUGH: f64 = 1.125;

/// The triangles of a model, in coordinates in which it is in a cube from -1 to 1.
#[derive(Debug)]
struct ModelTree<E> {
    /// The middle of the model's bounding box is the origin here, and 1 in its file is `scale` here.
    center: DVec3,
    scale: f64,
    /// Half of the lengths of its bounding box.
    half: DVec3,
    /// The radius of its bounding sphere about the origin.
    radius: f64,
    shapes: Shapes<E>,
    /// `None` if no triangle has an area.
    tree: Option<Arc<Tree<E>>>,
    /// The index among `shapes` of each triangle of the file that has an area.
    index: Vec<u32>,
    /// The look of each triangle; empty if all have the first.
    looks: Vec<u32>,
}

impl<E: Real> ModelTree<E> {
    fn of(model: &Model) -> Arc<Self> {
        model.derived(|| Self::new(model))
    }

    fn new(model: &Model) -> Self {
        let count = model.triangle_count();
        let [low, high] = model.bounds();
        let center = low + 0.5 * (high - low);
        let scale = below_inverse((high - center).max(center - low).max_element());
        let place = |p: DVec3| (p - center) * scale;
        let half = place(high).max(-place(low));
        let all = || (0..count).into_par_iter().with_min_len(ALONE);
        let reach = |k: usize| model.corners(k).into_iter().map(|p| place(p).length()).fold(0.0, f64::max);
        let radius = all().map(reach).reduce(|| 0.0, f64::max);
        let solids = all().filter_map(|k| {
            let triangle = RenderSpaceTriangle::new(&model.corners(k), center, scale)?;
            Some(Solid { shape: Shape::Triangle(triangle), order: k as u32 })
        });
        let mut solids: Vec<Solid> = solids.collect();
        let branches = group(&mut solids, Some(true), Copies::Kept);
        let solids = Arc::new(solids);
        let tree = branches.map(|branches| Arc::new(Tree::new(&branches, &solids, |place| place as u32)));
        let mut index = vec![0; count];
        for (solid, at) in solids.iter().zip(0..) {
            index[solid.order as usize] = at;
        }
        let sorted = Sorted { triangles: (0..solids.len() as u32).collect(), ..ByKind::default() };
        let seen = Seen { pixels: None, suns: vec![], mirrors: vec![] };
        let shapes = Shapes::new(&solids, sorted, tree.clone().map(|tree| tree as _), seen);
        let has_looks = model.looks().len() > 1;
        let looks = (0..count).filter(|_| has_looks).map(|k| model.look(k) as u32).collect();
        Self { center, scale, half, radius, shapes, tree, index, looks }
    }
}

/// A model in its frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct ModelForm {
    /// Half of the lengths of its bounding box.
    half: DVec3,
    /// The radius of its bounding sphere.
    radius: f64,
    /// The length here of 1 in the coordinates of its tree.
    size: f64,
}

impl ModelForm {
    /// Makes the form of a model that is placed in the world, or has the world's coordinates.
    pub(super) fn new(model: &Model, placement: Option<&Placement>, place: Place) -> (Frame, Self) {
        let tree = ModelTree::<f64>::of(model);
        let (rotation, scale) = placement.map_or((DMat3::IDENTITY, 1.0), |p| (p.rotation(), p.scale()));
        let center = place.point(placement.map_or(tree.center, |p| p.point(tree.center)));
        let size = scale * place.scale / tree.scale;
        let frame = Frame { axes: [rotation.x_axis, rotation.y_axis, rotation.z_axis], center };
        (frame, Self { half: tree.half * size, radius: tree.radius * size, size })
    }
}

impl Form for ModelForm {
    fn size(&self) -> f64 {
        self.half.element_sum()
    }

    // Surfaces that it shares with other objects are not looked for.
    fn each_surface(&self, _: &Frame, _: &mut dyn FnMut(Surface)) {}

    fn is_near(&self, _: DVec3, _: f64, _: bool) -> bool {
        false
    }

    fn ball(&self, frame: &Frame) -> (DVec3, f64) {
        (frame.center, self.radius)
    }

    fn bounds(&self, frame: &Frame) -> Option<Bounds> {
        let ([x, y, z], half) = (frame.axes, self.half);
        let reach = x.abs() * half.x + y.abs() * half.y + z.abs() * half.z;
        let reach = reach.min(DVec3::splat(self.radius));
        Some((frame.center - reach, frame.center + reach))
    }
}

/// A model as the kernels draw it.
#[derive(Debug)]
pub(super) struct SharedModel<E> {
    tree: Arc<ModelTree<E>>,
    /// The radius of a sphere around it, at which rays begin.
    radius: E,
    /// The length in the scene of 1 in the coordinates of the tree, and its inverse.
    size: E,
    inverse: E,
}

/// Rays in the coordinates of a tree.
struct Entering<S: Simd, E: Real> {
    ray: Ray<S, E>,
    /// The distance in the scene at which they start.
    start: Lanes<S, E>,
}

impl<E: Real> SharedModel<E> {
    pub(super) fn new(form: ModelForm, model: &Model) -> Self {
        Self {
            tree: ModelTree::of(model),
            radius: E::narrow(FAR_ENOUGH * form.radius),
            size: E::narrow(form.size),
            inverse: E::narrow(1.0 / form.size),
        }
    }

    /// Moves rays to before they enter the bounding sphere.
    #[inline(always)]
    fn entering<S: Simd>(&self, simd: S, Local { origin, direction }: Local<S, E>) -> Entering<S, E> {
        let zero = constant::<S, E>(simd, 0.0);
        let nearest = zero - origin.dot(direction);
        let start = (nearest - splat::<S, E>(simd, self.radius)).max(zero);
        let origin = direction.scale_add(start, origin).scale(splat::<S, E>(simd, self.inverse));
        Entering { ray: Ray { origin, direction }, start }
    }

    /// Offers the hits of the rays. `order` is that of the first look.
    #[inline(never)]
    pub(super) fn intersect<S: Simd>(
        &self,
        simd: S,
        local: Local<S, E>,
        order: E,
        nearest: &mut Nearest<S, E>,
    ) {
        let Some(tree) = &self.tree.tree else { return };
        simd.vectorize(
            #[inline(always)]
            || {
                let far = constant::<S, E>(simd, E::FAR);
                let Entering { ray, start } = self.entering(simd, local);
                let distance = (nearest.distance - start) * splat::<S, E>(simd, self.inverse);
                let aimed = RayPrecalculations::new(simd, ray);
                let Nearest { distance, order: face } = nearest_in(
                    simd,
                    tree,
                    ray,
                    Nearest { distance, order: far },
                    #[inline(always)]
                    |_, items, nearest| {
                        let leaf = (Kind::Triangle, items);
                        self.tree.shapes.intersect::<S, Robust, false>(simd, leaf, ray, Some(aimed), nearest);
                    },
                );
                let hit = face.simd_lt(far);
                if !hit.any_true() {
                    return;
                }
                let distance = distance.fused_mul_add(splat::<S, E>(simd, self.size), start);
                let mut orders =
                    face.fused_mul_add(constant::<S, E>(simd, ONE_FACE), splat::<S, E>(simd, order));
                if !self.tree.looks.is_empty() {
                    orders = self.with_looks(simd, hit.to_bitmask(), face, orders);
                }
                let first = distance.simd_eq(nearest.distance) & orders.simd_lt(nearest.order);
                let take = hit & (distance.simd_lt(nearest.distance) | first);
                nearest.distance = take.select(distance, nearest.distance);
                nearest.order = take.select(orders, nearest.order);
            },
        );
    }

    /// Returns the orders of hits on these faces, with those of their looks.
    #[inline(always)]
    fn with_looks<S: Simd>(
        &self,
        simd: S,
        mut hit: u64,
        face: Lanes<S, E>,
        orders: Lanes<S, E>,
    ) -> Lanes<S, E> {
        let mut looks = [E::narrow(0.0); 16];
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            looks[lane] = E::narrow(f64::from(self.tree.looks[face[lane].to_index()]));
        }
        orders + Lanes::<S, E>::from_slice(simd, &looks[..Lanes::<S, E>::LEN])
    }

    /// Returns the hits of the rays that have this order.
    #[inline(always)]
    pub(super) fn surface<S: Simd>(
        &self,
        simd: S,
        order: E,
        local: Local<S, E>,
        distance: Lanes<S, E>,
    ) -> BodyHit<S, E> {
        let Entering { ray, start } = self.entering(simd, local);
        let distance = (distance - start) * splat::<S, E>(simd, self.inverse);
        let at = self.tree.index[hit_face(order.widen())] as usize;
        let surface = self.tree.shapes.surface::<S, Robust, false>(simd, (Kind::Triangle, at), ray, distance);
        let on_face = surface.normal.scale_add(constant::<S, E>(simd, 0.0) - surface.offset, surface.start);
        BodyHit {
            point: on_face.scale(splat::<S, E>(simd, self.size)),
            normal: surface.normal,
            within: no_lane::<S, E>(simd),
        }
    }
}
