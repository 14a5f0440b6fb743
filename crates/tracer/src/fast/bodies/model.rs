//! Models of many triangles, each drawn from one tree in the coordinates of the model.
//!
//! The tree stays with the model: it is made once, however often the model is drawn, and in how many frames. A ray is moved
//! to just before it enters the model's bounding sphere, so that no number there is greater than about 2. The triangles of one
//! model are tested with the same numbers for a ray, so that no ray passes between them, and with the bounds on errors of all
//! triangles ([`Robust`]). The moved origin has an error of a few roundoffs of the model's position and size, and so has the
//! distance: within the bound of bodies.

use std::cmp::Ordering;
use std::sync::Arc;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{DMat3, DVec3, Vec2, Vec3 as Color};
use rayfold_scene::Placement;
use rayfold_scene::assets::Model;
use rayon::prelude::*;

use super::solid::{Form, Frame, Place};
use super::{BodyHit, Local};
use crate::fast::acceleration::binned::Item as Boxed;
use crate::fast::acceleration::descent::nearest_in;
use crate::fast::acceleration::tree::{Copies, Grouped, Tree, VERY_MANY, group};
use crate::fast::arithmetic::exact::Edge;
use crate::fast::arithmetic::real::{Fused, Lanes, Real, Vec3, constant, splat};
use crate::fast::rays::bounds::Bounds;
use crate::fast::rays::kind::Kind;
use crate::fast::rays::packet::{Nearest, Ray, no_lane};
use crate::fast::rays::predicate::{Beside, Corners};
use crate::fast::shapes::Neighbours;
use crate::fast::shapes::shape::{Items, Precalculations};
use crate::fast::shapes::triangle::{Facet, RenderSpaceTriangle};
use crate::fast::shared::Surface;
use crate::meshes::{FaceCorners, ONE_FACE, hit_face};
use crate::parallel::map;
use crate::scale::below_inverse;

/// The number of triangles that one thread makes at a time.
const ALONE: usize = 4096;

/// The distance from the middle at which rays begin, in radii of the bounding sphere, so that any surface that touches
/// the sphere is ahead of them.
const FAR_ENOUGH: f64 = 1.125;

/// The triangles of a model, in coordinates in which it is in a cube from -1 to 1. Those of one leaf are contiguous.
#[derive(Debug)]
struct ModelTree<E> {
    /// The middle of the model's bounding box, which is the origin of these coordinates. A length of 1 in its file is
    /// `scale` in them.
    center: DVec3,
    scale: f64,
    /// Half of the lengths of its bounding box.
    half: DVec3,
    /// The radius of its bounding sphere about the origin.
    radius: f64,
    tree: Tree<E>,
    /// The triangles, with their numbers in the file as orders.
    facets: Vec<Facet<E>>,
    /// The normals at their corners, zeros for a flat one; empty if all are flat. They are as exact as in the file.
    normals: Vec<[[f32; 3]; 3]>,
    /// The texture coordinates and the colour factors at their corners; empty if there are none.
    uvs: Vec<[Vec2; 3]>,
    colors: Vec<[Color; 3]>,
    /// The corners of the triangles, as indices among the positions of the model, which are unrounded.
    corners: Vec<[u32; 3]>,
    positions: Vec<DVec3>,
    /// The index here of each triangle of the file.
    index: Vec<u32>,
    /// The look of each triangle of the file; empty if all have the first.
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
        let positions = map(model.positions(), |p| place(*p));
        let triangles = model.triangles();
        let corners = |k: usize| {
            let [a, b, c] = triangles[k];
            [positions[a as usize], positions[b as usize], positions[c as usize]]
        };
        let reach = |k: usize| corners(k).into_iter().map(DVec3::length_squared).fold(0.0, f64::max);
        let all = || (0..count).into_par_iter().with_min_len(ALONE);
        let radius = all().map(reach).reduce(|| 0.0, f64::max).sqrt();
        let bounds = |k: u32| {
            let [a, b, c] = corners(k as usize);
            (a.min(b).min(c), a.max(b).max(c))
        };
        let (tree, order) = if count < VERY_MANY {
            let mut faces: Vec<Face> =
                (0..count as u32).map(|k| Face { order: k, bounds: bounds(k) }).collect();
            let Some(branches) = group(&mut faces, Some(true), Copies::Kept) else {
                unreachable!("a model has a triangle")
            };
            let tree = Tree::new(&branches, &faces, |place| place as u32);
            (tree, faces.iter().map(|face| face.order).collect())
        } else {
            let boxed = |k: usize| {
                let (low, high) = bounds(k as u32);
                Boxed::new(k as u32, low.as_vec3a(), high.as_vec3a())
            };
            Tree::of_many(Kind::Triangle, all().map(boxed).collect(), bounds)
        };
        let facet = |&k: &u32| {
            let triangle = RenderSpaceTriangle::new(&model.corners(k as usize), center, scale);
            triangle.map_or_else(|| Facet::nothing(k), |triangle| Facet::new(&triangle, k))
        };
        let normals =
            |&k: &u32| model.rounded_normals(k as usize).unwrap_or_default().map(|normal| normal.to_array());
        let index = || {
            let mut index = vec![0; count];
            for (&k, at) in order.iter().zip(0..) {
                index[k as usize] = at;
            }
            index
        };
        let (facets, index) = rayon::join(|| map(&order, facet), index);
        let normals = if model.has_normals() { map(&order, normals) } else { vec![] };
        let uvs = |&k: &u32| model.uvs(k as usize).unwrap_or_default();
        let uvs = if model.has_uvs() { map(&order, uvs) } else { vec![] };
        let colors = |&k: &u32| model.vertex_colors(k as usize).unwrap_or_default();
        let colors = if model.has_vertex_colors() { map(&order, colors) } else { vec![] };
        let corners = map(&order, |&k| triangles[k as usize]);
        let has_looks = model.looks().len() > 1;
        let looks = (0..count).filter(|_| has_looks).map(|k| model.look(k) as u32).collect();
        Self {
            center,
            scale,
            half,
            radius,
            tree,
            facets,
            normals,
            uvs,
            colors,
            corners,
            positions,
            index,
            looks,
        }
    }
}

impl<E: Real> ModelTree<E> {
    /// Returns the triangle with this number in the file, and its index here.
    #[inline(always)]
    fn facet(&self, face: usize) -> (&Facet<E>, usize) {
        let at = self.index[face] as usize;
        (&self.facets[at], at)
    }
}

/// The box around a triangle of a model, to be grouped.
#[derive(Clone, Copy)]
struct Face {
    order: u32,
    bounds: Bounds,
}

impl Grouped for Face {
    fn bounds(&self) -> Bounds {
        self.bounds
    }

    fn number(&self) -> u32 {
        Kind::Triangle.number()
    }

    fn order(&self) -> u32 {
        self.order
    }

    fn compare(&self, other: &Self) -> Ordering {
        self.order.cmp(&other.order)
    }
}

impl<E: Real> Corners for ModelTree<E> {
    fn of(&self, at: usize) -> [DVec3; 3] {
        self.corners[at].map(|i| self.positions[i as usize])
    }

    fn any_across(&self, at: usize, [p, q]: Edge, is: &dyn Fn(DVec3) -> bool) -> bool {
        let is_across = |other: usize| {
            let corners = Corners::of(self, other);
            let apex = corners.iter().find(|corner| **corner != p && **corner != q);
            let has_edge = other != at && corners.contains(&p) && corners.contains(&q);
            has_edge && apex.is_some_and(|apex| is(*apex)) && !self.facets[other].is_nothing()
        };
        self.tree.any_around((p.min(q), p.max(q)), &|_, mut items| items.any(is_across))
    }

    // Rays in the coordinates of a model are those of no pixel, and the errors of `f64` are not visible.
    fn unrounded(&self, _: DVec3) -> Option<DVec3> {
        None
    }

    fn gone_on(&self, _: DVec3, _: DVec3, _: Beside) -> Option<(DVec3, DVec3)> {
        None
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
    /// Makes the form of a model that is placed in the world, or that already has the world's coordinates.
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

    /// Moves rays back to before they enter the bounding sphere.
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
        simd.vectorize(
            #[inline(always)]
            || {
                let far = constant::<S, E>(simd, E::FAR);
                let Entering { ray, start } = self.entering(simd, local);
                let distance = (nearest.distance - start) * splat::<S, E>(simd, self.inverse);
                let aimed = Facet::aim(simd, ray);
                let ModelTree { tree, facets, .. } = &*self.tree;
                let Nearest { distance, order: face } = nearest_in(
                    simd,
                    tree,
                    ray,
                    Nearest { distance, order: far },
                    #[inline(always)]
                    |_, items, nearest| {
                        for (at, facet) in items.of(facets) {
                            facet.meet_from_anywhere(simd, (&*self.tree, at), ray, aimed, nearest);
                        }
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

    /// Returns the orders of hits on these faces: those of the looks of the faces.
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
        let (facet, _) = self.tree.facet(hit_face(order.widen()));
        let surface = facet.surface(simd, ray, distance);
        let on_face = surface.normal.scale_add(constant::<S, E>(simd, 0.0) - surface.offset, surface.start);
        BodyHit {
            point: on_face.scale(splat::<S, E>(simd, self.size)),
            normal: surface.normal,
            within: no_lane::<S, E>(simd),
        }
    }
}

/// The faces of a model that is drawn from its tree, to be shaded.
#[derive(Debug)]
pub(in crate::fast) struct ModelFaces<E> {
    tree: Arc<ModelTree<E>>,
    /// The axes of the model in the scene, unless they are those of the scene.
    axes: Option<[[E; 3]; 3]>,
    /// The middle of the model in the scene.
    center: [E; 3],
    /// The length in the scene of 1 in the coordinates of the tree, and its inverse.
    size: E,
    inverse: E,
}

impl<E: Real> ModelFaces<E> {
    /// Makes the faces of a model with a placement, in coordinates in which a point p of the world is at
    /// `(p - center) * scale`.
    pub(in crate::fast) fn new(
        model: &Model,
        placement: Option<&Placement>,
        (center, scale): (DVec3, f64),
    ) -> Self {
        let (Frame { axes, center }, form) = ModelForm::new(model, placement, Place { center, scale });
        Self {
            tree: ModelTree::of(model),
            axes: (axes != DVec3::AXES).then(|| axes.map(|axis| axis.to_array().map(E::narrow))),
            center: center.to_array().map(E::narrow),
            size: E::narrow(form.size),
            inverse: E::narrow(1.0 / form.size),
        }
    }

    /// Returns the triangle with the number of a hit, and the normals at its corners.
    #[inline(always)]
    pub(in crate::fast) fn face(&self, number: usize) -> (&Facet<E>, [[E; 3]; 3]) {
        let (facet, at) = self.tree.facet(number);
        let mut normals = [[E::narrow(0.0); 3]; 3];
        if let Some(of_file) = self.tree.normals.get(at) {
            for corner in 0..3 {
                for axis in 0..3 {
                    normals[corner][axis] = E::narrow(f64::from(of_file[corner][axis]));
                }
            }
        }
        (facet, normals)
    }

    /// Returns the data at the corners of a triangle that its colours need.
    #[inline(always)]
    pub(in crate::fast) fn face_corners(&self, number: usize) -> FaceCorners {
        let ModelTree { index, uvs, colors, .. } = &*self.tree;
        let at = index[number] as usize;
        FaceCorners { uvs: uvs.get(at).copied(), colors: colors.get(at).copied() }
    }

    /// Returns the texture coordinates at the corners of a triangle.
    #[inline(always)]
    pub(in crate::fast) fn uvs(&self, number: usize) -> [Vec2; 3] {
        self.tree.uvs.get(self.tree.index[number] as usize).copied().unwrap_or_default()
    }

    /// Reads from the data at the corners of a triangle, and returns any of the bits.
    #[inline(always)]
    pub(in crate::fast) fn fetch(&self, number: usize) -> u32 {
        let ModelTree { index, normals, uvs, colors, .. } = &*self.tree;
        let at = index[number] as usize;
        let of_normals = normals.get(at).map_or(0, |[first, _, last]| first[0].to_bits() ^ last[2].to_bits());
        let of_uvs = uvs.get(at).map_or(0, |[first, _, last]| first.x.to_bits() ^ last.y.to_bits());
        let of_colors = colors.get(at).map_or(0, |[first, _, last]| first.x.to_bits() ^ last.z.to_bits());
        of_normals ^ of_uvs ^ of_colors
    }

    /// Converts a point of the scene and a direction to the coordinates of the triangles.
    #[inline(always)]
    pub(in crate::fast) fn enter<S: Simd>(
        &self,
        simd: S,
        (point, direction): (Vec3<S, E>, Vec3<S, E>),
    ) -> (Vec3<S, E>, Vec3<S, E>) {
        let point = point.sub(Vec3::splat(simd, self.center)).scale(splat::<S, E>(simd, self.inverse));
        let Some(axes) = self.axes else { return (point, direction) };
        let [x, y, z] = axes.map(|axis| Vec3::<S, E>::splat(simd, axis));
        let turned = |v: Vec3<S, E>| Vec3::<S, E>::new(x.dot(v), y.dot(v), z.dot(v));
        (turned(point), turned(direction))
    }

    /// Converts a direction and an offset from the coordinates of the triangles to those of the scene.
    #[inline(always)]
    pub(in crate::fast) fn leave<S: Simd>(
        &self,
        simd: S,
        (direction, way): (Vec3<S, E>, Vec3<S, E>),
    ) -> (Vec3<S, E>, Vec3<S, E>) {
        let way = way.scale(splat::<S, E>(simd, self.size));
        let Some(axes) = self.axes else { return (direction, way) };
        let [x, y, z] = axes.map(|axis| Vec3::<S, E>::splat(simd, axis));
        let back = |v: Vec3<S, E>| z.scale_add(v.z, y.scale_add(v.y, x.scale(v.x)));
        (back(direction), back(way))
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use rayfold_scene::assets::{Library, MemoryFiles, Smoothing};

    use super::*;
    use crate::fast::acceleration::tree::Content;

    /// Makes a wavy sheet with normals, of squares of two triangles each.
    fn sheet(side: usize) -> Arc<Model> {
        let mut text = String::new();
        for (x, z) in (0..=side).flat_map(|x| (0..=side).map(move |z| (x, z))) {
            let (x, z) = (x as f64 / side as f64, z as f64 / side as f64);
            writeln!(text, "v {x} {} {z}\nvn {} 1 {}", (9.0 * x * z).sin(), -x, -z).unwrap();
        }
        for (x, z) in (0..side).flat_map(|x| (0..side).map(move |z| (x, z))) {
            let [a, b] = [x, x + 1].map(|x| x * (side + 1) + z + 1);
            writeln!(text, "f {a}//{a} {0}//{0} {b}//{b}", a + 1).unwrap();
            writeln!(text, "f {0}//{0} {1}//{1} {b}//{b}", a + 1, b + 1).unwrap();
        }
        let library = Library::new(MemoryFiles::from([("a.obj", text.into_bytes())]));
        library.model("a.obj", Smoothing::OfFile).unwrap()
    }

    #[test]
    fn each_triangle_is_in_one_leaf_and_its_box_few_or_many() {
        for side in [3, 60] {
            let model = sheet(side);
            let tree = ModelTree::<f64>::new(&model);
            assert_eq!(model.triangle_count() >= VERY_MANY, side == 60);
            let mut next = 0;
            let mut pending = vec![0];
            while let Some(at) = pending.pop() {
                let node = &tree.tree.nodes[at as usize];
                let within = |point: DVec3| {
                    point.cmpge(DVec3::from(node.low)).all() && point.cmple(DVec3::from(node.high)).all()
                };
                match node.content() {
                    Content::Leaf(_, items) => {
                        next += items.len();
                        assert!(
                            items.clone().all(|k| Corners::of(&tree, k).into_iter().all(within)),
                            "{side}"
                        );
                    }
                    Content::Children(first, axis) => {
                        let middle = [first, first + 1]
                            .map(|at| tree.tree.nodes[at as usize])
                            .map(|n| n.low[axis] + n.high[axis]);
                        assert!(middle[0] <= middle[1], "the first comes first");
                        pending.extend([first, first + 1]);
                    }
                }
            }
            assert_eq!(next, model.triangle_count());
            for k in 0..model.triangle_count() {
                let (facet, at) = tree.facet(k);
                assert_eq!(facet.order, k as f64);
                assert_eq!(tree.normals[at], model.rounded_normals(k).unwrap().map(|n| n.to_array()));
                let place = |p: DVec3| (p - tree.center) * tree.scale;
                assert_eq!(Corners::of(&tree, at), model.corners(k).map(place));
            }
        }
    }
}
