//! The faces of meshes: normals at vertices, colours at vertices, and the inside of closed glass.
//!
//! Normals are mixed in lanes. The weights of a hit come from the edges that the tests of its triangle use, so a hit
//! needs only its triangle and the three normals. Hits on a model with a tree of its own are converted to the model's
//! coordinates for this, and the normals are converted back. Colours, like patterns, are computed lane by lane, with
//! the functions of the reference tracer.

use std::ops::Range;
use std::sync::Arc;

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayfold_scene::{Material, Scene};
use rayon::prelude::*;

use crate::fast::arithmetic::real::{Lanes, Mask, Real, Vec3, constant};
use crate::fast::bodies::ModelFaces;
use crate::fast::materials::face_pictures::Looked;
use crate::fast::placement::geometry::Geometry;
use crate::fast::rays::bounce::{Hits, ROOM, RayBatch};
use crate::fast::shapes::triangle::{Facet, Triangle};
use crate::meshes::{FaceHit, Faces, Run, hit_face};
use crate::pictures::FacePicture;

/// The faces of a scene, if at least one of them has data beyond its triangle.
#[derive(Debug)]
pub(crate) struct ShadedFaces<E> {
    faces: Arc<Faces>,
    /// The runs of faces that have data beyond their triangles.
    runs: Vec<ShadedRun<E>>,
    /// Whether any are drawn from the trees of their models.
    has_models: bool,
    /// Whether any of those have a picture and nothing else that colours their faces.
    has_pictures: bool,
    /// The scene, for its materials.
    scene: Scene,
    center: DVec3,
    scale: f64,
}

/// The faces of one mesh.
#[derive(Debug)]
struct ShadedRun<E> {
    /// The positions of its faces among all objects.
    orders: Range<usize>,
    /// The index among all runs of faces.
    index: usize,
    /// The faces in their model, if they are drawn from its tree. In that case the normals are stored there.
    model: Option<ModelFaces<E>>,
    /// The unit normals at the corners of each face; zeros for a flat one. Empty if all are flat.
    normals: Vec<[[E; 3]; 3]>,
    /// Whether colours vary within faces.
    is_colored: bool,
    /// The picture of the faces of a model that is drawn from its tree, if nothing else colours them.
    picture: Option<FacePicture>,
    /// The index of refraction of glass, or 0. Then 1 for a closed body of glass, or 0.
    ior: E,
    is_filled: E,
}

/// The data of the faces that a packet hits, lane by lane.
struct Gathered<E> {
    /// The edges opposite to the corners: their directions and moments.
    edges: [[[E; 16]; 3]; 3],
    moments: [[[E; 16]; 3]; 3],
    normals: [[[E; 16]; 3]; 3],
    /// 1 for lanes that hit such a face, else 0.
    is_face: [E; 16],
    /// For lanes that hit glass: its index of refraction, and 1 if it is the inside of a closed body. 0 for all others.
    ior: [E; 16],
    is_filled: [E; 16],
    /// The lanes whose faces have more than normals: the lane, the index of the run in this list, and whether only the
    /// functions of the reference tracer shade the face, because it has holes.
    more: [(usize, usize, bool); 16],
    more_count: usize,
}

impl<E: Real> ShadedFaces<E> {
    /// Returns `None` if there are none.
    pub(crate) fn new(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        let faces = geometry.faces.clone()?;
        let (scene, center, scale) = (scene.clone(), geometry.center, geometry.scale);
        let runs = faces.runs().iter().enumerate().filter(|(_, run)| run.is_shaded());
        let runs = runs.map(|(index, run)| ShadedRun::new(index, run, &scene, (center, scale)));
        let runs: Vec<_> = runs.collect();
        let has_models = runs.iter().any(|run| run.model.is_some());
        let has_pictures = runs.iter().any(|run| run.picture.is_some());
        Some(Self { faces, runs, has_models, has_pictures, scene, center, scale })
    }

    /// Gives hits the normals and colours of their faces. Rays that continue from them start as from triangles. With
    /// `EYE` the rays start at the eye and have a weight of 1. `triangle` returns the triangle of an object, unless the
    /// object is a body.
    #[inline(never)]
    pub(crate) fn shade<'t, S: Simd, const EYE: bool>(
        &self,
        simd: S,
        triangle: impl Fn(usize) -> Option<&'t Triangle<E>>,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
    ) {
        let columns = [&mut hits.face, &mut hits.place, &mut hits.under, &mut hits.onward];
        columns.into_iter().flatten().for_each(|column| column.resize(ROOM, E::narrow(0.0)));
        simd.vectorize(
            #[inline(always)]
            || {
                if self.has_models {
                    self.fetch::<S>(hits);
                }
                let mut gathered = Gathered::new();
                let mut looked = self.has_pictures.then(Looked::new);
                for packet in 0..hits.packets.len() {
                    let (at, _) = hits.packets[packet];
                    let lanes = at..at + Lanes::<S, E>::LEN;
                    Vec3::<S, E>::load(simd, &hits.normal, at).store(&mut hits.face, at);
                    Vec3::<S, E>::load(simd, &hits.start, at).store(&mut hits.place, at);
                    Vec3::<S, E>::load(simd, &hits.normal, at).store(&mut hits.onward, at);
                    Vec3::<S, E>::zero(simd).store(&mut hits.under, at);
                    // The faces of one model at a time.
                    let mut open = lanes
                        .clone()
                        .filter(|lane| hits.is_hit(*lane))
                        .fold(0u32, |all, lane| all | 1 << (lane - at));
                    while open != 0 {
                        let model = self.gather(&triangle, hits, lanes.clone(), &mut open, &mut gathered);
                        let weights = gathered.mix(simd, model, queue, hits, at);
                        let more = gathered.more[..gathered.more_count].first();
                        if let Some(&(_, run, false)) = more
                            && let ShadedRun { picture: Some(picture), model: Some(model), .. } =
                                &self.runs[run]
                            && let Some(looked) = &mut looked
                        {
                            gathered.multiply(simd, (picture, looked), model, hits, (at, weights));
                        } else if more.is_some() {
                            self.add_more::<S, EYE>(simd, queue, hits, (at, &gathered, weights));
                        }
                    }
                }
            },
        );
    }

    /// Returns the index here of the run of an object.
    #[inline(always)]
    fn run_of(&self, order: usize) -> Option<usize> {
        let at = match &self.runs[..] {
            [_] => 0,
            runs => runs.partition_point(|run| run.orders.start <= order).checked_sub(1)?,
        };
        self.runs[at].orders.contains(&order).then_some(at)
    }

    /// Touches the normals of all hits on models with trees of their own, independently of each other, so that their
    /// memory accesses overlap.
    #[inline(always)]
    fn fetch<S: Simd>(&self, hits: &Hits<E>) {
        let mut sum = 0;
        let mut last = 0;
        for &(at, _) in &hits.packets {
            for lane in (at..at + Lanes::<S, E>::LEN).filter(|lane| hits.is_hit(*lane)) {
                let hit = hits.order.0[lane];
                let order = hit.to_index();
                if !self.runs[last].orders.contains(&order) {
                    let Some(run) = self.run_of(order) else { continue };
                    last = run;
                }
                if let Some(model) = &self.runs[last].model {
                    sum ^= model.fetch(hit_face(hit.widen()));
                }
            }
        }
        std::hint::black_box(sum);
    }

    /// Gathers the faces of open lanes, and clears their bits. The faces are those of one model that is drawn from its
    /// tree, which is returned, or those of all other objects.
    #[inline(always)]
    fn gather<'t>(
        &self,
        triangle: impl Fn(usize) -> Option<&'t Triangle<E>>,
        hits: &Hits<E>,
        lanes: Range<usize>,
        open: &mut u32,
        into: &mut Gathered<E>,
    ) -> Option<&ModelFaces<E>>
    where
        E: 't,
    {
        into.more_count = 0;
        into.is_face = [E::narrow(0.0); 16];
        into.ior = [E::narrow(0.0); 16];
        let mut first: Option<usize> = None;
        let (mut rest, mut left) = (*open, 0);
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let hit = hits.order.0[lanes.start + lane];
            let order = hit.to_index();
            // Neighbours mostly hit the same model.
            let is_same = |run: &usize| self.runs[*run].orders.contains(&order);
            let Some(run) = first.filter(is_same).or_else(|| self.run_of(order)) else { continue };
            let ShadedRun { orders, normals, model, is_colored, ior, is_filled, .. } = &self.runs[run];
            if first
                .is_some_and(|first| first != run && (model.is_some() || self.runs[first].model.is_some()))
            {
                left |= 1 << lane;
                continue;
            }
            first = Some(run);
            let triangle = if model.is_some() { None } else { triangle(order) };
            let has_holes = triangle.is_none() && model.is_none();
            if *is_colored || has_holes {
                into.more[into.more_count] = (lane, run, has_holes);
                into.more_count += 1;
            }
            if let Some(model) = model {
                let (facet, normals) = model.face(hit_face(hit.widen()));
                into.put(lane, facet, normals);
            } else if let Some(Triangle { facet, .. }) = triangle {
                let normals = normals.get(order - orders.start).copied();
                into.put(lane, facet, normals.unwrap_or([[E::narrow(0.0); 3]; 3]));
            } else {
                continue;
            }
            (into.ior[lane], into.is_filled[lane]) = (*ior, *is_filled);
        }
        *open = left;
        first.and_then(|run| self.runs[run].model.as_ref())
    }

    /// Adds the colours of faces. A face with holes is shaded only by the functions of the reference tracer.
    #[inline(never)]
    fn add_more<S: Simd, const EYE: bool>(
        &self,
        simd: S,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
        (at, gathered, weights): (usize, &Gathered<E>, [Lanes<S, E>; 3]),
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut corners = [[E::narrow(0.0); 16]; 3];
                for (into, weights) in corners.iter_mut().zip(weights) {
                    weights.store_slice(&mut into[..Lanes::<S, E>::LEN]);
                }
                let mut colors = [[E::narrow(1.0); 16]; 3];
                let mut glows = [[E::narrow(0.0); 16]; 3];
                for &(of_packet, run, has_holes) in &gathered.more[..gathered.more_count] {
                    let face_order = hits.order.0[at + of_packet].widen();
                    let order = face_order as usize;
                    let material = self.scene.objects[order].material();
                    let ShadedRun { orders, index, model, .. } = &self.runs[run];
                    let [color, glow] = if has_holes {
                        self.shade_with_holes(queue, hits, at + of_packet, material)
                    } else {
                        let run = &self.faces.runs()[*index];
                        let (k, of_face) = match model {
                            Some(model) => (hit_face(face_order), model.face_corners(hit_face(face_order))),
                            None => (order - orders.start, run.face_corners(order - orders.start)),
                        };
                        let lane = of_packet % 16;
                        let weights = [0, 1, 2].map(|k: usize| corners[k][lane].widen());
                        run.colors(k, of_face, weights, material)
                    };
                    for axis in 0..3 {
                        colors[axis][of_packet] = E::narrow(color[axis]);
                        glows[axis][of_packet] = E::narrow(glow[axis]);
                    }
                }
                for axis in 0..3 {
                    let lanes = at..at + Lanes::<S, E>::LEN;
                    let load = |from: &[E]| Lanes::<S, E>::from_slice(simd, from);
                    let factor = load(&colors[axis][..Lanes::<S, E>::LEN]);
                    let glow = load(&glows[axis][..Lanes::<S, E>::LEN]);
                    let glow = if EYE { glow } else { load(&queue.weight[axis].0[lanes.clone()]) * glow };
                    let (color, diffuse) = (&mut hits.color[axis].0, &mut hits.diffuse[axis].0);
                    (load(&color[lanes.clone()]) * factor + glow).store_slice(&mut color[lanes.clone()]);
                    (load(&diffuse[lanes.clone()]) * factor).store_slice(&mut diffuse[lanes]);
                }
            },
        );
    }

    /// Shades a face with holes, and returns its colour and its glow.
    #[inline(never)]
    fn shade_with_holes(
        &self,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
        lane: usize,
        material: &Material,
    ) -> [DVec3; 2] {
        let (direction, face) = (read(&queue.direction, lane), read(&hits.face, lane));
        let (start, offset) = (read(&hits.start, lane), hits.sides[0].0[lane].widen());
        let point = start - offset * face;
        let hit = FaceHit { point, center: self.center, scale: self.scale, direction, face };
        let Some(shading) = self.faces.shading(hits.order.0[lane].widen(), material, hit) else {
            return [DVec3::ONE, DVec3::ZERO];
        };
        write(&mut hits.normal, lane, shading.normal);
        write(&mut hits.onward, lane, shading.onward);
        write(&mut hits.start, lane, start + shading.lift);
        let hides = shading.lift.dot(face) > offset;
        let under = if hides { DVec3::ZERO } else { -2.0 * offset * face };
        write(&mut hits.under, lane, under);
        if shading.within {
            hits.sides[1].0[lane] = E::narrow(1.0);
        }
        [shading.color, shading.glow]
    }
}

impl<E: Real> ShadedRun<E> {
    fn new(index: usize, run: &Run, scene: &Scene, place: (DVec3, f64)) -> Self {
        let orders = run.orders();
        let row = |k: usize| {
            let normals = run.normals(k).unwrap_or_default();
            normals.map(|normal| normal.to_array().map(E::narrow))
        };
        let model = run.shared_model().map(|(model, placement)| ModelFaces::new(model, placement, place));
        let normals = if run.has_normals() && model.is_none() {
            (0..orders.len()).into_par_iter().with_min_len(1024).map(row).collect()
        } else {
            vec![]
        };
        let glass = scene.objects[orders.start].material().finish().and_then(|finish| finish.glass);
        let ior = E::narrow(glass.map_or(0.0, |glass| glass.ior()));
        let is_filled = E::narrow(if run.is_filled() { 1.0 } else { 0.0 });
        let picture = run.only_picture(scene.objects[orders.start].material());
        let picture = picture.filter(|_| model.is_some());
        Self { orders, index, model, normals, is_colored: run.is_colored(), picture, ior, is_filled }
    }
}

impl<E: Real> Gathered<E> {
    fn new() -> Self {
        let nothing = [[[E::narrow(0.0); 16]; 3]; 3];
        Self {
            edges: nothing,
            moments: nothing,
            normals: nothing,
            is_face: [E::narrow(0.0); 16],
            ior: [E::narrow(0.0); 16],
            is_filled: [E::narrow(0.0); 16],
            more: [(0, 0, false); 16],
            more_count: 0,
        }
    }

    /// Stores the face that a lane hits: its edges, and the normals at its corners.
    #[inline(always)]
    #[allow(
        clippy::needless_range_loop,
        reason = "the same numbers index several arrays, and iterators are not unrolled"
    )]
    fn put(&mut self, lane: usize, facet: &Facet<E>, normals: [[E; 3]; 3]) {
        let lane = lane % 16;
        self.is_face[lane] = E::narrow(1.0);
        for corner in 0..3 {
            let edge = &facet.edges[corner];
            for axis in 0..3 {
                self.edges[corner][axis][lane] = edge.direction[axis];
                self.moments[corner][axis][lane] = edge.moment[axis];
                self.normals[corner][axis][lane] = normals[corner][axis];
            }
        }
    }

    /// Multiplies colours by the only picture of a model, where its faces are hit.
    #[inline(always)]
    fn multiply<S: Simd>(
        &self,
        simd: S,
        (picture, looked): (&FacePicture, &mut Looked<E>),
        model: &ModelFaces<E>,
        hits: &mut Hits<E>,
        (at, weights): (usize, [Lanes<S, E>; 3]),
    ) {
        let (mut bits, one) = (0, constant::<S, E>(simd, 1.0));
        for &(lane, ..) in &self.more[..self.more_count] {
            bits |= 1 << lane;
            looked.put(lane, model.uvs(hit_face(hits.order.0[at + lane].widen())));
        }
        let factors = looked.factors(simd, picture, weights, bits);
        let is_face = Lanes::<S, E>::from_slice(simd, &self.is_face[..Lanes::<S, E>::LEN]);
        let is_face = is_face.simd_gt(constant::<S, E>(simd, 0.0));
        let factors = Vec3::select(is_face, factors, Vec3::new(one, one, one));
        factors.mul(Vec3::load(simd, &hits.color, at)).store(&mut hits.color, at);
        factors.mul(Vec3::load(simd, &hits.diffuse, at)).store(&mut hits.diffuse, at);
    }

    /// Interpolates the normals of the gathered faces, in the coordinates of their `model` if they have one, and lifts
    /// the starts of their shadow rays. Returns the weights of the corners.
    #[inline(always)]
    fn mix<S: Simd>(
        &self,
        simd: S,
        model: Option<&ModelFaces<E>>,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
        at: usize,
    ) -> [Lanes<S, E>; 3] {
        let zero = constant::<S, E>(simd, 0.0);
        let one = constant::<S, E>(simd, 1.0);
        let minus = constant::<S, E>(simd, -1.0);
        let lanes = at..at + Lanes::<S, E>::LEN;
        let is_face = Lanes::<S, E>::from_slice(simd, &self.is_face[..Lanes::<S, E>::LEN]).simd_gt(zero);
        if !is_face.any_true() {
            return [one, zero, zero];
        }
        let (start, face) = (Vec3::load(simd, &hits.start, at), Vec3::<S, E>::load(simd, &hits.face, at));
        let direction = Vec3::<S, E>::load(simd, &queue.direction, at);
        let offset = Lanes::<S, E>::from_slice(simd, &hits.sides[0].0[lanes.clone()]);
        let point = start.sub(face.scale(offset));
        let (point, own_face) = match model {
            Some(model) => model.enter(simd, (point, face)),
            None => (point, face),
        };
        let edges: [Vec3<S, E>; 3] = loaded(simd, &self.edges);
        let moments: [Vec3<S, E>; 3] = loaded(simd, &self.moments);
        let [mut a, mut b, mut c] = [zero; 3];
        for (area, k) in [&mut a, &mut b, &mut c].into_iter().zip(0..) {
            *area = own_face.dot(edges[k].cross(point)) + own_face.dot(moments[k]);
        }
        // The face may be seen from its other side.
        let side = (a + b + c).simd_lt(zero).select(minus, one);
        let [a, b, c] = [(a * side).max(zero), (b * side).max(zero), (c * side).max(zero)];
        let sum = a + b + c;
        let is_within = sum.simd_gt(zero);
        let share = one / is_within.select(sum, one);
        let weights = [is_within.select(a * share, one), b * share, c * share];
        let normals: [Vec3<S, E>; 3] = loaded(simd, &self.normals);
        let mixed = normals[0].scale(weights[0]);
        let mixed = normals[2].scale_add(weights[2], normals[1].scale_add(weights[1], mixed));
        let length = mixed.dot(mixed).sqrt();
        let is_any = length.simd_gt(zero);
        let mixed = towards(simd, mixed.scale(one / is_any.select(length, one)), own_face);
        let mut lift = Vec3::<S, E>::zero(simd);
        for (corner, next, last) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            // The way from the hit to the corner.
            let way = edges[next].scale(weights[last]).sub(edges[last].scale(weights[next]));
            let normal = towards(simd, normals[corner], own_face);
            let above = normal.dot(way).max(zero);
            lift = normal.scale_add(above * weights[corner], lift);
        }
        let (mixed, lift) = match model {
            Some(model) => model.leave(simd, (mixed, lift)),
            None => (mixed, lift),
        };
        let is_mixed: Mask<S, E> = is_face & is_any & mixed.dot(direction).simd_lt(zero);
        let normal = Vec3::select(is_mixed, mixed, face);
        // A face that the start is lifted off can hide a light; a face that it starts on cannot.
        let is_low = is_face & lift.dot(face).simd_le(offset);
        let under = face.scale(offset * constant::<S, E>(simd, -2.0));
        Vec3::select(is_low, under, Vec3::load(simd, &hits.under, at)).store(&mut hits.under, at);
        Vec3::select(is_face, normal, Vec3::load(simd, &hits.normal, at)).store(&mut hits.normal, at);
        Vec3::select(is_face, lift.scale_add(one, start), start).store(&mut hits.start, at);
        let towards = direction.dot(normal).min(zero);
        let mirrored = normal.scale_add(towards * constant::<S, E>(simd, -2.0), direction);
        let mut goes_on = mirrored.dot(face).simd_gt(zero);
        let ior = Lanes::<S, E>::from_slice(simd, &self.ior[..Lanes::<S, E>::LEN]);
        let is_glass = ior.simd_gt(zero);
        if is_glass.any_true() {
            let is_filled =
                Lanes::<S, E>::from_slice(simd, &self.is_filled[..Lanes::<S, E>::LEN]).simd_gt(zero);
            // No model that is drawn from its tree is of glass.
            let outwards = normals_of_faces(simd, &edges);
            let within = is_glass & is_filled & outwards.dot(direction).simd_gt(zero);
            let is_within = Lanes::<S, E>::from_slice(simd, &hits.sides[1].0[lanes.clone()]);
            within.select(one, is_within).store_slice(&mut hits.sides[1].0[lanes]);
            // A pane without an inside bends nothing.
            let ior = is_glass.select(ior, one);
            let (before, behind) = (within.select(ior, one), within.select(one, ior));
            let cosine = zero - direction.dot(normal);
            let aside = normal.scale_add(cosine, direction);
            let ratio = (before / behind).min(constant::<S, E>(simd, f64::MAX));
            let sine = aside.dot(aside).sqrt() * ratio;
            let is_total = cosine.simd_le(zero) | sine.simd_ge(one);
            let cosine_behind = ((one - sine) * (one + sine)).max(zero).sqrt();
            let bent = aside.scale(ratio).sub(normal.scale(cosine_behind));
            let is_above = bent.dot(face).simd_ge(zero) & !is_total;
            goes_on &= !(is_glass & is_filled & is_above);
        }
        let onward = Vec3::select(goes_on, normal, face);
        Vec3::select(is_face, onward, Vec3::load(simd, &hits.onward, at)).store(&mut hits.onward, at);
        weights
    }
}

impl<E: Real> Hits<E> {
    /// Records that no hit is on a face of a mesh, in a scene without meshes.
    pub(crate) fn forget_faces(&mut self) {
        if !self.face[0].is_empty() {
            let columns = [&mut self.face, &mut self.place, &mut self.under, &mut self.onward];
            columns.into_iter().flatten().for_each(Vec::clear);
        }
    }

    /// Sets the origins and normals for rays that continue from the hits, after all lights were added: those of the
    /// faces.
    pub(crate) fn leave_faces(&mut self) {
        if self.place[0].is_empty() {
            return;
        }
        for axis in 0..3 {
            self.start[axis].0.copy_from_slice(&self.place[axis]);
            self.normal[axis].0.copy_from_slice(&self.onward[axis]);
        }
    }
}

/// Loads three vectors. It exists because `map` of arrays is not inlined.
#[inline(always)]
fn loaded<S: Simd, E: Real>(simd: S, columns: &[[[E; 16]; 3]; 3]) -> [Vec3<S, E>; 3] {
    let [a, b, c] = columns;
    [Vec3::load(simd, a, 0), Vec3::load(simd, b, 0), Vec3::load(simd, c, 0)]
}

/// Returns vectors on the same side as others: each itself or its opposite.
#[inline(always)]
fn towards<S: Simd, E: Real>(simd: S, v: Vec3<S, E>, side: Vec3<S, E>) -> Vec3<S, E> {
    let is_away = v.dot(side).simd_lt(constant::<S, E>(simd, 0.0));
    v.scale(is_away.select(constant::<S, E>(simd, -1.0), constant::<S, E>(simd, 1.0)))
}

/// Returns normals of triangles, on the sides from which their corners appear counterclockwise.
#[inline(always)]
fn normals_of_faces<S: Simd, E: Real>(_: S, edges: &[Vec3<S, E>; 3]) -> Vec3<S, E> {
    edges[1].cross(edges[2])
}

fn read<E: Real>(columns: &[impl AsRef<[E]>; 3], lane: usize) -> DVec3 {
    DVec3::from_array(columns.each_ref().map(|column| column.as_ref()[lane].widen()))
}

fn write<E: Real>(columns: &mut [impl AsMut<[E]>; 3], lane: usize, v: DVec3) {
    for (column, value) in columns.iter_mut().zip(v.to_array()) {
        column.as_mut()[lane] = E::narrow(value);
    }
}
