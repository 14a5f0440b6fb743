//! Meshes as the tracers use them: every face is a triangle, and a table has the further data of faces.
//!
//! A mesh is expanded before a scene is prepared, to the very triangles that a script could write out. So a flat mesh has
//! the pixels of its triangles, bit for bit. A mesh in a group is expanded once, however often the group is drawn.
//! Normals, colours at vertices, pictures and the inside of closed glass are looked up by the position of a triangle among all
//! objects ([`Faces`]), when a ray has hit it.
//!
//! The kernels draw meshes of many triangles from one tree in the coordinates of their model, which is stored with the
//! model ([`can_be_shared`]). Then each look of the mesh is one object, in place of its triangles. The order of a hit
//! is that of the object, and its fraction is the number of the triangle ([`hit_face`]).

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3};
use rayfold_scene::assets::{Closure, Look, Model, Slot, Texture};
use rayfold_scene::{
    Coefficients, Finish, ImageMap, Instance, Material, Mesh, Object, Placement, Scene, SharedSlice, Tone,
    Triangle,
};
use rayon::prelude::*;

use crate::RenderOptions;
use crate::parts;
use crate::pictures::{FacePicture, alpha_at, factor_at, level_at};
use crate::reference::onward_normal;

/// A scene without meshes, and the faces that its triangles were.
#[derive(Debug)]
pub(crate) struct Expanded<'a> {
    pub(crate) scene: Cow<'a, Scene>,
    pub(crate) faces: Option<Arc<Faces>>,
}

/// The faces of meshes, by their positions among all objects.
#[derive(Debug, Default)]
pub(crate) struct Faces {
    /// The meshes, in the order of the objects.
    runs: Vec<Run>,
}

/// The number of triangles, of all meshes of a model, from which on its tree is shared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shared(usize);

impl Shared {
    /// No tree is shared: all triangles are written out.
    pub(crate) const NONE: Self = Self(usize::MAX);

    /// Returns what the options ask for.
    pub(crate) fn by(options: &RenderOptions) -> Self {
        match options.models {
            None => Self(100_000),
            Some(true) => Self(0),
            Some(false) => Self::NONE,
        }
    }

    /// Returns the models among objects whose trees are shared, by their places in memory.
    fn among(self, objects: &[Object]) -> HashSet<*const Model> {
        let mut counts: HashMap<*const Model, usize> = HashMap::new();
        for mesh in objects.iter().filter_map(mesh).filter(|mesh| can_be_shared(mesh)) {
            *counts.entry(Arc::as_ptr(mesh.model())).or_default() += mesh.model().triangle_count();
        }
        counts.into_iter().filter(|(_, count)| *count >= self.0).map(|(model, _)| model).collect()
    }
}

/// The part of an order that counts the triangles of a model. There are fewer triangles than its inverse, and fewer objects
/// than 2²⁸, so that an order is exact in `f64`.
pub(crate) const ONE_FACE: f64 = 1.0 / (1 << 24) as f64;

/// The faces of one mesh in one place of the scene.
#[derive(Debug)]
pub(crate) struct Run {
    /// The position of the first face and the number of faces. If the tree of the mesh is shared, these are the
    /// positions of its looks.
    first: usize,
    count: usize,
    /// Whether the tree of the model is shared.
    is_shared: bool,
    /// The position of the mesh before it was expanded.
    object: usize,
    model: Arc<Model>,
    placement: Option<Arc<Placement>>,
    /// Whether colours are linear light.
    is_linear: bool,
    /// Whether colours of its file that vary within faces, by vertices or pictures, multiply its coefficients.
    has_colors: bool,
    /// Whether it also glows with the light of its file, if that light is no part of its materials.
    glows: bool,
    /// Whether it has a picture by texture coordinates.
    has_image: bool,
    /// Whether it is a closed body of glass.
    is_filled: bool,
    /// Whether faces can have holes, in which they are not hit.
    has_holes: bool,
}

/// The normals and colours that a face adds to the surface of a hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shading {
    /// The unit normal that light and highlights see. It faces the ray.
    pub(crate) normal: DVec3,
    /// The unit normal at which rays are reflected and refracted. It faces the ray.
    pub(crate) onward: DVec3,
    /// The vector from the hit to the start of shadow rays, without the offset from the surface.
    pub(crate) lift: DVec3,
    /// The factor of ambient and diffuse coefficients.
    pub(crate) color: DVec3,
    /// The colour that is added.
    pub(crate) glow: DVec3,
    /// Whether the ray comes from within a closed body of glass.
    pub(crate) within: bool,
}

/// The data at the corners of a face from which its colours are computed, as its model stores them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceCorners {
    /// Texture coordinates.
    pub(crate) uvs: Option<[Vec2; 3]>,
    /// Factors of the colour.
    pub(crate) colors: Option<[Vec3; 3]>,
}

/// A hit on a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FaceHit {
    /// The point, in coordinates in which the world's point p has the coordinates `(p - center) * scale`.
    pub(crate) point: DVec3,
    pub(crate) center: DVec3,
    pub(crate) scale: f64,
    /// The direction of the ray.
    pub(crate) direction: DVec3,
    /// The unit normal of the face, which faces the ray.
    pub(crate) face: DVec3,
}

/// The number of triangles that one thread makes at a time.
const ALONE: usize = 4096;

impl<'a> Expanded<'a> {
    pub(crate) fn new(scene: Cow<'a, Scene>, shared: Shared) -> Self {
        if !scene.objects.iter().any(|object| mesh(object).is_some()) {
            return Self { scene, faces: None };
        }
        let (objects, faces) = expanded(&scene.objects, Colors::of(&scene), shared);
        Self {
            scene: Cow::Owned(Scene { objects: objects.into(), ..scene.into_owned() }),
            faces: Some(Arc::new(faces)),
        }
    }
}

/// Returns the number of objects after meshes are expanded.
pub(crate) fn expanded_count(objects: &[Object]) -> usize {
    objects.iter().map(|object| mesh(object).map_or(1, |mesh| mesh.model().triangle_count())).sum()
}

/// Returns the mesh of an object, also in a group, if the object is one.
pub(crate) fn mesh(object: &Object) -> Option<&Mesh> {
    match object {
        Object::Mesh(mesh) => Some(mesh),
        Object::Instance(instance) => match instance.object() {
            Object::Mesh(mesh) => Some(mesh),
            _ => None,
        },
        _ => None,
    }
}

/// The rules for the colours of models.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Colors {
    /// Whether they are linear light.
    is_linear: bool,
    /// Whether surfaces light each other. If so, a colour of a file is diffuse, and none of it is ambient.
    is_indirect: bool,
}

impl Colors {
    fn of(scene: &Scene) -> Self {
        Self { is_linear: scene.tone == Tone::Srgb, is_indirect: scene.indirect_bounces() > 0 }
    }
}

/// Expands the meshes among objects.
pub(crate) fn expanded(objects: &[Object], colors: Colors, shared: Shared) -> (Vec<Object>, Faces) {
    let shared = shared.among(objects);
    let mut all = Vec::new();
    let mut faces = Faces::default();
    // The objects that the mesh of a group becomes, by its place in memory.
    let mut of_groups: HashMap<*const Mesh, SharedSlice<Object>> = HashMap::new();
    for (place, object) in objects.iter().enumerate() {
        let Some(mesh) = mesh(object) else {
            all.push(object.clone());
            continue;
        };
        let first = all.len();
        let is_shared = can_be_shared(mesh) && shared.contains(&Arc::as_ptr(mesh.model()));
        let placement = match object {
            Object::Instance(instance) => {
                let parts = of_groups
                    .entry(std::ptr::from_ref(mesh))
                    .or_insert_with(|| parts(mesh, colors, is_shared).into());
                let placement = instance.shared_placement();
                all.extend((0..parts.len()).map(|k| Object::from(Instance::new(parts, k, placement))));
                Some(placement.clone())
            }
            _ => {
                let mut parts = parts(mesh, colors, is_shared);
                // A mesh alone is not copied.
                if all.is_empty() {
                    all = parts;
                } else {
                    all.append(&mut parts);
                }
                None
            }
        };
        let model = mesh.model();
        let finish = mesh.material().finish();
        let looks = || 0..model.looks().len();
        let is_own = finish.is_some_and(|finish| finish.own);
        faces.runs.push(Run {
            first,
            count: all.len() - first,
            is_shared,
            object: place,
            model: model.clone(),
            placement,
            is_linear: colors.is_linear,
            has_colors: is_own && looks().any(|look| model.is_varied(look)),
            glows: is_own && !mesh.has_material() && looks().any(|look| glows_apart(model, look)),
            has_image: finish
                .is_some_and(|finish| finish.image.as_ref().is_some_and(|image| image.map() == ImageMap::Uv)),
            is_filled: finish.is_some_and(|finish| finish.glass.is_some())
                && *model.closure() == Closure::Closed,
            has_holes: model.has_holes(),
        });
    }
    (all, faces)
}

/// Returns whether a mesh can be drawn from the tree of its model. It must have no holes, must not be of glass, and its
/// coefficients must not depend on the place.
fn can_be_shared(mesh: &Mesh) -> bool {
    let is_simple = |finish: &Finish| {
        finish.glass.is_none()
            && finish.pattern.is_none()
            && finish.image.as_ref().is_none_or(|image| image.map() == ImageMap::Uv)
    };
    !mesh.model().has_holes() && mesh.material().finish().is_none_or(is_simple)
}

/// Returns the objects that a mesh becomes: its triangles, or one object for each look.
fn parts(mesh: &Mesh, colors: Colors, is_shared: bool) -> Vec<Object> {
    if !is_shared {
        return triangles(mesh, colors);
    }
    let looks = 0..mesh.model().looks().len();
    looks.map(|look| mesh.with_material(material(mesh, look, colors)).into()).collect()
}

/// Returns whether the glow of the faces of a look is computed at each hit, because the glow or the colour varies.
fn glows_apart(model: &Model, look: usize) -> bool {
    let Look { glow, glow_texture, .. } = &model.looks()[look];
    *glow != DVec3::ZERO && (glow_texture.is_some() || model.is_varied(look))
}

/// Returns the triangles of a mesh. A triangle has the colour of its file if that is the same all over it.
fn triangles(mesh: &Mesh, colors: Colors) -> Vec<Object> {
    let model = mesh.model();
    let materials: Vec<Material> =
        (0..model.looks().len()).map(|look| material(mesh, look, colors)).collect();
    let triangle = |k: usize| {
        let triangle = Triangle::new(model.corners(k), materials[model.look(k)].clone());
        triangle.unwrap_or_else(|_| unreachable!("positions of a model are finite")).into()
    };
    (0..model.triangle_count()).into_par_iter().with_min_len(ALONE).map(triangle).collect()
}

/// Returns the material of the faces of a look.
fn material(mesh: &Mesh, look: usize, colors: Colors) -> Material {
    let Colors { is_linear, is_indirect } = colors;
    let material = mesh.material();
    let Some(finish) = material.finish().filter(|finish| finish.own) else { return material.clone() };
    let model = mesh.model();
    let Look { unlit, .. } = model.looks()[look];
    // Colours that vary are looked up where they are hit.
    let color = if model.is_varied(look) { DVec3::ONE } else { model.look_color(look, is_linear) };
    let tinted = |own: Coefficients| {
        let made = Coefficients::new(own.ambient() * color, own.diffuse() * color, own.mirror());
        made.unwrap_or(own)
    };
    let own = material.coefficients();
    let mut coefficients = tinted(match is_indirect && !mesh.has_material() {
        true => Coefficients::new(DVec3::ZERO, DVec3::ONE, own.mirror()).unwrap_or(own),
        false => own,
    });
    if !mesh.has_material() {
        let glow = match glows_apart(model, look) {
            true => DVec3::ZERO,
            false => model.glow(look, DVec3::ONE, is_linear),
        };
        let made = if unlit {
            Coefficients::new(color, DVec3::ZERO, DVec3::ZERO)
        } else {
            Coefficients::new(coefficients.ambient() + glow, coefficients.diffuse(), coefficients.mirror())
        };
        coefficients = made.unwrap_or(coefficients);
    }
    let pattern =
        finish.pattern.map(|pattern| rayfold_scene::Pattern { other: tinted(pattern.other), ..pattern });
    Material::finished(coefficients, Finish { own: false, pattern, ..finish.clone() })
}

impl Faces {
    /// Returns whether a face has more than a triangle: normals, colours at its vertices, or an inside.
    pub(crate) fn are_shaded(&self) -> bool {
        self.runs.iter().any(Run::is_shaded)
    }

    /// Returns whether the colour of any face varies. If so, equal materials do not imply equal colours.
    pub(crate) fn have_colors(&self) -> bool {
        self.runs.iter().any(|run| run.has_colors || run.glows || run.has_image)
    }

    /// Returns the positions of objects that together have all materials and all kinds of shapes, out of `count`
    /// objects. Of the faces of a mesh that look alike it returns only one.
    pub(crate) fn examples(&self, count: usize) -> Vec<u32> {
        let (mut examples, mut next) = (Vec::new(), 0);
        for run in &self.runs {
            examples.extend((next..run.first).map(|order| order as u32));
            if run.is_shared {
                next = run.first;
                continue;
            }
            let mut is_known = vec![false; run.model.looks().len()];
            let mut is_new = |k: &usize| !core::mem::replace(&mut is_known[run.model.look(*k)], true);
            let faces = if run.model.looks().len() == 1 { 0..1 } else { 0..run.count };
            examples.extend(faces.filter(|k| is_new(k)).map(|k| (run.first + k) as u32));
            next = run.first + run.count;
        }
        examples.extend((next..count).map(|order| order as u32));
        examples
    }

    /// Returns the position before meshes were expanded of the object at `order`.
    pub(crate) fn origin(&self, order: usize) -> usize {
        match self.runs[..self.runs.partition_point(|run| run.first <= order)].last() {
            None => order,
            Some(run) if order < run.first + run.count => run.object,
            Some(run) => order - (run.first + run.count) + run.object + 1,
        }
    }

    /// Returns whether any face can have holes.
    pub(crate) fn have_holes(&self) -> bool {
        parts::BUILT.pictures && self.runs.iter().any(|run| run.has_holes)
    }

    /// Returns whether the object at `order` is a face that can have holes.
    pub(crate) fn can_have_holes(&self, order: usize) -> bool {
        let run = self.run_of(order).filter(|run| run.has_holes);
        run.is_some_and(|run| run.model.looks()[run.model.look(order - run.first)].cutoff.is_some())
    }

    /// Returns whether the object at `order` has a hole at a point. The point is in coordinates in which the world's
    /// point p has the coordinates `(p - center) * scale`.
    pub(crate) fn is_hole(&self, order: usize, point: DVec3, (center, scale): (DVec3, f64)) -> bool {
        let Some(run) = self.run_of(order).filter(|run| run.has_holes) else { return false };
        let (model, k) = (&run.model, order - run.first);
        let look = &model.looks()[model.look(k)];
        let Some(cutoff) = look.cutoff else { return false };
        let weights = weights(run.corners(k, center, scale), point);
        let of_vertices: f64 = model.vertex_alphas(k).iter().zip(weights).map(|(alpha, b)| alpha * b).sum();
        let of_picture = match &look.texture {
            Some(texture) => {
                alpha_at(texture, run.place_on(texture, k, run.face_corners(k), weights, Slot::Color))
            }
            None => 1.0,
        };
        look.alpha * of_picture * of_vertices < cutoff
    }

    /// Returns whether any mesh is a closed body of glass.
    pub(crate) fn have_inside(&self) -> bool {
        self.runs.iter().any(|run| run.is_filled)
    }

    /// Returns whether the object at `order` is a face of a closed body of glass.
    pub(crate) fn is_filled(&self, order: usize) -> bool {
        self.run_of(order).is_some_and(|run| run.is_filled)
    }

    /// Returns an upper bound of the angle by which normals turn, as a sine, if a hit is moved by a roundoff of its
    /// distance. The bound is in roundoffs. The world's point p has the coordinates `(p - center) * scale`, and no hit
    /// is nearer to the eye than `nearest`.
    pub(crate) fn steepest(&self, (center, scale): (DVec3, f64), nearest: f64) -> f64 {
        let of_run = |run: &Run| {
            let of_face = |k: usize| {
                let Some(normals) = run.normals(k) else { return 0.0 };
                let corners = run.corners(k, center, scale);
                let farthest = corners.into_iter().map(DVec3::length).fold(nearest, f64::max);
                farthest * bend(corners, normals)
            };
            let faces = (0..run.count).into_par_iter().with_min_len(1024).map(of_face);
            faces.reduce(|| 0.0, f64::max)
        };
        self.runs.iter().filter(|run| run.has_normals() && !run.is_shared).map(of_run).fold(0.0, f64::max)
    }

    /// Returns the runs of faces, in the order of the objects.
    pub(crate) fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Returns whether the appearance of the object at `order` varies with the place of a hit on it.
    pub(crate) fn is_varied(&self, order: usize) -> bool {
        self.run_of(order).is_some_and(|run| run.has_normals() || run.is_colored())
    }

    fn run_of(&self, order: usize) -> Option<&Run> {
        let run = self.runs[..self.runs.partition_point(|run| run.first <= order)].last()?;
        (order < run.first + run.count).then_some(run)
    }

    /// Returns whether the object at `order` is a further look of a mesh whose tree is shared: it is drawn with the first.
    pub(crate) fn is_further_look(&self, order: usize) -> bool {
        self.run_of(order).is_some_and(|run| run.is_shared && order > run.first)
    }

    /// Returns what the face with the `order` of a hit adds to the surface there, or `None` if it is only a triangle.
    /// `material` is that of the object.
    pub(crate) fn shading(&self, order: f64, material: &Material, hit: FaceHit) -> Option<Shading> {
        let object = order as usize;
        let run = self.run_of(object).filter(|run| run.is_shaded())?;
        let k = if run.is_shared { hit_face(order) } else { object - run.first };
        let FaceHit { point, center, scale, direction, face } = hit;
        let corners = run.corners(k, center, scale);
        let weights = weights(corners, point);
        let outwards = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let within = run.is_filled && outwards.dot(direction) > 0.0;
        let (mut normal, mut lift) = (face, DVec3::ZERO);
        if let Some(normals) = run.normals(k) {
            let mixed: DVec3 = normals.iter().zip(weights).map(|(n, b)| *n * b).sum();
            let mixed = if mixed.dot(face) < 0.0 { -mixed } else { mixed }.normalize_or_zero();
            if mixed.dot(direction) < 0.0 {
                normal = mixed;
            }
            for ((n, corner), b) in normals.into_iter().zip(corners).zip(weights) {
                let n = if n.dot(face) < 0.0 { -n } else { n };
                lift += b * n.dot(corner - point).max(0.0) * n;
            }
        }
        let [color, glow] = run.colors(k, run.face_corners(k), weights, material);
        let glass = material.finish().and_then(|finish| finish.glass);
        let glass = glass.map(|glass| (glass, within, !run.is_filled));
        let onward = onward_normal(direction, normal, face, glass);
        Some(Shading { normal, onward, lift, color, glow, within })
    }
}

impl Run {
    pub(crate) fn is_shaded(&self) -> bool {
        self.model.has_normals() || self.is_colored() || self.is_filled
    }

    /// Returns whether colours vary within its faces.
    pub(crate) fn is_colored(&self) -> bool {
        self.has_colors || self.glows || self.has_image
    }

    /// Returns whether its faces can have normals of their own.
    pub(crate) fn has_normals(&self) -> bool {
        self.model.has_normals()
    }

    /// Returns whether it is a closed body of glass.
    pub(crate) fn is_filled(&self) -> bool {
        self.is_filled
    }

    /// Returns its model and its placement, if the tree of the model is shared. Then its looks are the objects, in
    /// place of its faces.
    pub(crate) fn shared_model(&self) -> Option<(&Model, Option<&Placement>)> {
        self.is_shared.then(|| (&*self.model, self.placement.as_deref()))
    }

    /// Returns the positions of its faces among all objects.
    pub(crate) fn orders(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Returns the normals at the corners of a face, or `None` if it is flat.
    pub(crate) fn normals(&self, k: usize) -> Option<[DVec3; 3]> {
        let normals = self.model.normals(k)?;
        Some(match &self.placement {
            Some(placement) => normals.map(|n| placement.rotation() * n),
            None => normals,
        })
    }

    /// Returns the data at the corners of a face that its colours need.
    pub(crate) fn face_corners(&self, k: usize) -> FaceCorners {
        FaceCorners { uvs: self.model.uvs(k), colors: self.model.vertex_colors(k) }
    }

    /// Returns the factor of the ambient and diffuse coefficients of a face at a place, given by its barycentric weights, and
    /// the colour that is added.
    #[inline(always)]
    pub(crate) fn colors(
        &self,
        k: usize,
        corners: FaceCorners,
        weights: [f64; 3],
        material: &Material,
    ) -> [DVec3; 2] {
        let (mut color, mut glow) = (DVec3::ONE, DVec3::ZERO);
        let look = || self.model.look(k);
        if self.has_colors && self.model.is_varied(look()) {
            let level = self.level(k, corners, weights, Slot::Color);
            color = self.model.color(look(), corners.colors, weights, level, self.is_linear);
        }
        if self.has_image
            && let Some(image) = material.finish().and_then(|finish| finish.image.as_ref())
            && let Some(uvs) = corners.uvs
        {
            let place = self.place_from_top(mixed(uvs, weights)).into();
            color *= factor_at(image.file().picture(), place, true, self.is_linear);
        }
        if self.glows && glows_apart(&self.model, look()) {
            let level = self.level(k, corners, weights, Slot::Glow);
            glow = self.model.glow(look(), level, self.is_linear);
        }
        [color, glow]
    }

    /// Returns the picture of the faces, if their colours depend on it and on their texture coordinates alone. `material` is that
    /// of all of them.
    pub(crate) fn only_picture(&self, material: &Material) -> Option<FacePicture> {
        let model = &self.model;
        if self.glows || !model.has_uvs() {
            return None;
        }
        if !self.has_colors {
            let image = material.finish()?.image.as_ref().filter(|_| self.has_image)?;
            let picture = image.file().picture();
            return Some(FacePicture::of_material(picture, model.has_uvs_from_top(), self.is_linear));
        }
        let [look] = model.looks() else { return None };
        let is_product = model.is_varied(0) && !model.has_vertex_colors() && model.is_product(self.is_linear);
        let texture = look.texture(Slot::Color).filter(|_| is_product && !self.has_image)?;
        (!texture.has_own_uvs() && !texture.has_transform()).then(|| FacePicture {
            picture: texture.picture().clone(),
            wraps: texture.wraps(),
            is_from_top: model.has_uvs_from_top(),
            is_linear: model.decodes_pictures(self.is_linear),
            tint: Some(model.look_factor(0, self.is_linear)),
        })
    }

    /// Returns the corners of a face, in coordinates in which the world's point p has the coordinates `(p - center) *
    /// scale`.
    pub(crate) fn corners(&self, k: usize, center: DVec3, scale: f64) -> [DVec3; 3] {
        self.model.corners(k).map(|p| match &self.placement {
            Some(placement) => (placement.point(p) - center) * scale,
            None => (p - center) * scale,
        })
    }

    /// Returns the level of a face's picture at a place; 1 without one.
    #[inline(always)]
    fn level(&self, k: usize, corners: FaceCorners, weights: [f64; 3], slot: Slot) -> DVec3 {
        let model = &self.model;
        let texture = model.looks()[model.look(k)].texture(slot);
        let Some(texture) = texture.filter(|_| parts::BUILT.pictures) else { return DVec3::ONE };
        let place = self.place_on(texture, k, corners, weights, slot);
        level_at(texture, place, model.decodes_pictures(self.is_linear))
    }

    /// Returns the position on its picture of a point of a face, from the upper left corner.
    #[inline(always)]
    fn place_on(
        &self,
        texture: &Texture,
        k: usize,
        corners: FaceCorners,
        weights: [f64; 3],
        slot: Slot,
    ) -> DVec2 {
        let uvs = match texture.has_own_uvs() {
            true => self.model.own_uvs(k, slot),
            false => corners.uvs.unwrap_or_default(),
        };
        self.place_from_top(texture.transformed(mixed(uvs, weights)))
    }

    /// Returns the position of texture coordinates, from the upper left corner of a picture.
    #[inline(always)]
    fn place_from_top(&self, DVec2 { x, y }: DVec2) -> DVec2 {
        DVec2::new(x, if self.model.has_uvs_from_top() { y } else { 1.0 - y })
    }
}

/// Returns the texture coordinates at a point of a triangle, given by its barycentric weights.
#[inline(always)]
fn mixed([a, b, c]: [Vec2; 3], weights: [f64; 3]) -> DVec2 {
    weights[0] * a.as_dvec2() + weights[1] * b.as_dvec2() + weights[2] * c.as_dvec2()
}

/// Returns the number of the triangle in the order of a hit on a shared model.
pub(crate) fn hit_face(order: f64) -> usize {
    (order.fract() / ONE_FACE) as usize
}

/// Returns how fast the normal changes across a face: the largest ratio of the angle that it turns to the length.
fn bend([a, b, c]: [DVec3; 3], normals: [DVec3; 3]) -> f64 {
    let (p, q) = (b - a, c - a);
    let length = p.length();
    let along = p / length;
    let beside = q - q.dot(along) * along;
    let of_p = (normals[1] - normals[0]) / length;
    let of_q = (normals[2] - normals[0] - q.dot(along) * of_p) / beside.length();
    let bend = of_p.length() + of_q.length();
    if bend.is_nan() { f64::INFINITY } else { bend }
}

/// Returns the barycentric weights of a point of a triangle, none below 0.
fn weights([a, b, c]: [DVec3; 3], point: DVec3) -> [f64; 3] {
    let across = (b - a).cross(c - a);
    let [a, b, c] = [a, b, c].map(|corner| corner - point);
    let areas = [b.cross(c), c.cross(a), a.cross(b)].map(|area| area.dot(across).max(0.0));
    let sum: f64 = areas.iter().sum();
    if sum > 0.0 { areas.map(|area| area / sum) } else { [1.0, 0.0, 0.0] }
}
