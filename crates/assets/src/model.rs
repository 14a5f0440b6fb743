//! A model: triangles with normals and colours, whatever the format of its file.

use std::any::Any;
use std::fmt;
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec2, Vec3};

use crate::closure::{Closure, closure};
use crate::error::Fault;
use crate::limits;
use crate::normals::smoothed;
use crate::srgb::{decoded, encoded};
use crate::texture::{Slot, Texture};

/// An estimate of the bytes per triangle of the data that a renderer derives from a model.
const DERIVED_BYTES: usize = 512;

/// The index of a normal or of texture coordinates that a corner does not have.
pub(crate) const NONE: u32 = u32::MAX;

/// The normals with which a model is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Smoothing {
    /// The vertex normals of the file; a face without them is flat.
    #[default]
    OfFile,
    /// The normals of the faces alone.
    Flat,
    /// Normals averaged over edges at which two faces meet at less than this angle in degrees, from 0 to 180.
    Within(f64),
}

/// The meaning of the factors of a model's colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colors {
    /// Linear light (glTF).
    Linear,
    /// Levels of a picture, encoded as sRGB (OBJ, PLY).
    #[default]
    Levels,
}

/// The colour of faces.
#[derive(Clone, Debug)]
pub struct Look {
    /// The factor of the colour; `None` for faces to which the file gives no colour.
    pub factor: Option<DVec3>,
    /// The picture that multiplies the colour.
    pub texture: Option<Texture>,
    /// Whether the faces have the neutral colour because a file with their colour is missing.
    pub is_missing: bool,
    /// The light that the faces give off, linear.
    pub glow: DVec3,
    /// The picture that multiplies that light.
    pub glow_texture: Option<Texture>,
    /// Whether the faces show their colour whatever the light (`KHR_materials_unlit`).
    pub unlit: bool,
    /// The factor of alpha.
    pub alpha: f64,
    /// The alpha below which the faces have no hits, if they have holes.
    pub cutoff: Option<f64>,
}

impl Look {
    /// The look of faces to which the file gives no colour.
    pub(crate) const PLAIN: Self = Self {
        factor: None,
        texture: None,
        is_missing: false,
        glow: DVec3::ZERO,
        glow_texture: None,
        unlit: false,
        alpha: 1.0,
        cutoff: None,
    };

    /// Returns whether alpha does not vary within the faces. `of_positions` are the alphas of the model's positions.
    fn has_one_alpha(&self, of_positions: &[f32]) -> bool {
        of_positions.is_empty() && self.texture.as_ref().is_none_or(|texture| texture.picture.is_opaque())
    }

    /// Returns the picture that the faces have for a use.
    pub fn texture(&self, slot: Slot) -> Option<&Texture> {
        match slot {
            Slot::Color => self.texture.as_ref(),
            Slot::Glow => self.glow_texture.as_ref(),
        }
    }
}

/// The colour of faces that have none of their own.
const NEUTRAL: DVec3 = DVec3::splat(0.8);

/// Triangles with normals and colours. Every index is in range, and every number finite.
#[derive(Debug, Default)]
pub struct Model {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    /// The normals of each triangle's corners; empty if there are none.
    normal_of: Vec<[u32; 3]>,
    uvs: Vec<Vec2>,
    uv_of: Vec<[u32; 3]>,
    /// Texture coordinates at the positions for pictures that have their own, by their use; empty if there are none.
    own_uvs: [Vec<Vec2>; 2],
    /// The colour factors of the positions; empty if there are none.
    colors: Vec<Vec3>,
    /// The factors of alpha of the positions; empty if all are 1.
    alphas: Vec<f32>,
    space: Colors,
    looks: Vec<Look>,
    /// The look of each triangle; empty if all have the first.
    look_of: Vec<u32>,
    warnings: Vec<String>,
    closure: OnceLock<Closure>,
    bounds: OnceLock<[DVec3; 2]>,
    derived: Derived,
}

/// Data that a renderer has made of a model.
#[derive(Default)]
struct Derived(OnceLock<Arc<dyn Any + Send + Sync>>);

impl fmt::Debug for Derived {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.get().is_some() { "Derived" } else { "None" })
    }
}

/// A model as a decoder gives it, not checked yet.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) normals: Vec<Vec3>,
    /// Empty, or one for each triangle.
    pub(crate) normal_of: Vec<[u32; 3]>,
    pub(crate) uvs: Vec<Vec2>,
    /// Empty, or one for each triangle.
    pub(crate) uv_of: Vec<[u32; 3]>,
    /// The texture coordinates by the use of a picture: empty, or one for each position.
    pub(crate) own_uvs: [Vec<Vec2>; 2],
    /// Empty, or one for each position.
    pub(crate) colors: Vec<Vec3>,
    /// Empty, or one for each position.
    pub(crate) alphas: Vec<f32>,
    pub(crate) space: Colors,
    pub(crate) looks: Vec<Look>,
    /// Empty, or one for each triangle.
    pub(crate) look_of: Vec<u32>,
    pub(crate) warnings: Vec<String>,
}

impl Model {
    /// Checks a model, and leaves out faces without area. Returns `None` if none is left.
    ///
    /// # Errors
    /// If a number is not finite, an index is out of range, or there are too many triangles.
    pub(crate) fn new(mut parts: Parts) -> Result<Option<Self>, Fault> {
        let Parts { positions, triangles, normals, normal_of, uvs, uv_of, colors, looks, look_of, .. } =
            &parts;
        if triangles.len() > limits::TRIANGLES {
            return Err(too_many_triangles());
        }
        if positions.iter().any(|p| !p.is_finite()) {
            return Err(Fault::new("a position is not a finite number"));
        }
        if normals.iter().any(|n| !n.is_finite()) {
            return Err(Fault::new("a normal is not a finite number"));
        }
        let mut all_uvs = uvs.iter().chain(parts.own_uvs.iter().flatten());
        let are_colors = colors.iter().all(|c| c.is_finite()) && parts.alphas.iter().all(|a| a.is_finite());
        if all_uvs.any(|uv| !uv.is_finite()) || !are_colors {
            return Err(Fault::new("a texture coordinate or a colour is not a finite number"));
        }
        let within = |all: &[[u32; 3]], count: usize, optional: bool| {
            let is_beyond = |i: &&u32| (**i as usize) >= count && !(optional && **i == NONE);
            match all.as_flattened().iter().find(is_beyond) {
                Some(beyond) => {
                    Err(Fault::new(format!("an index is out of range: {beyond} of {count}, from 0")))
                }
                None => Ok(()),
            }
        };
        within(triangles, positions.len(), false)?;
        within(normal_of, normals.len(), true)?;
        within(uv_of, uvs.len(), true)?;
        let are_own = parts.own_uvs.iter().all(|uvs| uvs.is_empty() || uvs.len() == positions.len());
        if !are_own || look_of.iter().any(|look| (*look as usize) >= looks.len().max(1)) {
            return Err(Fault::new("an index is out of range"));
        }
        let kept: Vec<bool> = triangles.iter().map(|triangle| has_area(positions, *triangle)).collect();
        if kept.iter().any(|kept| !kept) {
            retain(&mut parts.triangles, &kept);
            retain(&mut parts.normal_of, &kept);
            retain(&mut parts.uv_of, &kept);
            retain(&mut parts.look_of, &kept);
        }
        if parts.triangles.is_empty() {
            return Ok(None);
        }
        if parts.uv_of.iter().flatten().all(|i| *i == NONE) {
            (parts.uvs, parts.uv_of) = (Vec::new(), Vec::new());
        }
        let Parts { positions, triangles, normals, normal_of, uvs, uv_of, own_uvs, colors, space, .. } =
            parts;
        let (mut looks, mut look_of, warnings) = (parts.looks, parts.look_of, parts.warnings);
        if looks.is_empty() {
            looks.push(Look::PLAIN);
        }
        // Most models have one look, beside others that no face has.
        if let Some(&only) = look_of.first()
            && look_of.iter().all(|look| *look == only)
        {
            looks = vec![looks.swap_remove(only as usize)];
            look_of = Vec::new();
        }
        // Where nothing varies there are no holes, or the whole face is one.
        for look in &mut looks {
            let is_full = look.has_one_alpha(&parts.alphas);
            look.cutoff = look.cutoff.filter(|cutoff| !is_full || look.alpha < *cutoff);
        }
        let normals = normals.into_iter().map(unit).collect();
        let (closure, bounds, derived) = (OnceLock::new(), OnceLock::new(), Derived::default());
        Ok(Some(Self {
            positions,
            triangles,
            normals,
            normal_of,
            uvs,
            uv_of,
            own_uvs,
            colors,
            alphas: parts.alphas,
            space,
            looks,
            look_of,
            warnings,
            closure,
            bounds,
            derived,
        }))
    }

    /// Returns the same triangles with other normals.
    pub(crate) fn with(&self, smoothing: Smoothing) -> Self {
        let (normals, normal_of) = match smoothing {
            Smoothing::OfFile => (self.normals.clone(), self.normal_of.clone()),
            Smoothing::Flat => (Vec::new(), Vec::new()),
            Smoothing::Within(degrees) => smoothed(&self.positions, &self.triangles, degrees),
        };
        Self {
            positions: self.positions.clone(),
            triangles: self.triangles.clone(),
            normals,
            normal_of,
            uvs: self.uvs.clone(),
            uv_of: self.uv_of.clone(),
            own_uvs: self.own_uvs.clone(),
            colors: self.colors.clone(),
            alphas: self.alphas.clone(),
            space: self.space,
            looks: self.looks.clone(),
            look_of: self.look_of.clone(),
            warnings: self.warnings.clone(),
            closure: self.closure.clone(),
            bounds: self.bounds.clone(),
            derived: Derived::default(),
        }
    }

    /// Returns the lowest and the highest corner of the box around the triangles.
    pub fn bounds(&self) -> [DVec3; 2] {
        *self.bounds.get_or_init(|| {
            let corners = self.triangles.iter().flatten().map(|i| self.positions[*i as usize]);
            corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
        })
    }

    /// Returns data that a renderer makes of this model, such as a tree of its triangles. The data is kept, and dropped
    /// with the model. Concurrent calls may each make the data; the result of the call that ends first is kept. If the
    /// model holds data of another type, the data is made again and not kept.
    pub fn derived<T: Any + Send + Sync>(&self, make: impl Fn() -> T) -> Arc<T> {
        let kept = match self.derived.0.get() {
            Some(kept) => kept.clone(),
            None => {
                // Nothing is locked meanwhile: a thread that waits for others in `make` may take up work that calls this.
                let made: Arc<dyn Any + Send + Sync> = Arc::new(make());
                self.derived.0.get_or_init(|| made).clone()
            }
        };
        kept.downcast().unwrap_or_else(|_| Arc::new(make()))
    }

    /// Returns the model with every position moved by `point` and every normal turned by `direction`, or `None` if a number
    /// overflows.
    pub fn moved(&self, point: impl Fn(DVec3) -> DVec3, direction: impl Fn(DVec3) -> DVec3) -> Option<Self> {
        let mut moved = self.with(Smoothing::OfFile);
        moved.positions.iter_mut().for_each(|p| *p = point(*p));
        moved.normals.iter_mut().for_each(|n| *n = direction(n.as_dvec3()).as_vec3());
        (moved.closure, moved.bounds) = (OnceLock::new(), OnceLock::new());
        moved.positions.iter().all(|p| p.is_finite()).then_some(moved)
    }

    /// Returns the number of triangles, at least 1.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Returns the corners of a triangle, counterclockwise seen from its outer side.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        let [a, b, c] = self.triangles[triangle];
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }

    /// Returns the positions, some of which may belong to no triangle.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Returns the indices of the positions of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the normals at the corners of a triangle, each a unit vector or 0, or `None` if the triangle is flat.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn normals(&self, triangle: usize) -> Option<[DVec3; 3]> {
        let indices = self.normal_of.get(triangle)?;
        if indices.contains(&NONE) {
            return None;
        }
        // Of single precision, so that they are made unit again.
        Some(indices.map(|i| self.normals[i as usize].as_dvec3().normalize_or_zero()))
    }

    /// Returns the [normals](Self::normals) at the corners of a triangle as they are kept, of unit length but for the rounding
    /// to single precision.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn rounded_normals(&self, triangle: usize) -> Option<[Vec3; 3]> {
        let indices = self.normal_of.get(triangle)?;
        (!indices.contains(&NONE)).then(|| indices.map(|i| self.normals[i as usize]))
    }

    /// Returns whether any triangle has normals of its own.
    pub fn has_normals(&self) -> bool {
        !self.normal_of.is_empty()
    }

    /// Returns whether corners have texture coordinates.
    pub fn has_uvs(&self) -> bool {
        !self.uv_of.is_empty()
    }

    /// Returns whether (0, 0) of the texture coordinates is the upper left corner of a picture, as in glTF, and not the
    /// lower left one.
    pub fn has_uvs_from_top(&self) -> bool {
        self.space == Colors::Linear
    }

    /// Returns the texture coordinates at the corners of a triangle, as they stand in the file.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn uvs(&self, triangle: usize) -> Option<[Vec2; 3]> {
        let indices = self.uv_of.get(triangle)?;
        Some(indices.map(|i| self.uvs.get(i as usize).copied().unwrap_or_default()))
    }

    /// Returns the texture coordinates at the corners of a triangle for a picture that has its own, before the picture's
    /// transform.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn own_uvs(&self, triangle: usize, slot: Slot) -> [Vec2; 3] {
        let own = &self.own_uvs[slot as usize];
        self.triangles[triangle].map(|i| own.get(i as usize).copied().unwrap_or_default())
    }

    /// Returns the texture coordinates at the corners of a triangle for its picture, before the picture's transform.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn picture_uvs(&self, triangle: usize, slot: Slot) -> [Vec2; 3] {
        let texture = self.looks[self.look(triangle)].texture(slot);
        match texture.is_some_and(|texture| texture.has_own_uvs) {
            true => self.own_uvs(triangle, slot),
            false => self.uvs(triangle).unwrap_or_default(),
        }
    }

    /// Returns the colour factors at the corners of a triangle, if the positions have some.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn vertex_colors(&self, triangle: usize) -> Option<[Vec3; 3]> {
        let corners = self.triangles[triangle];
        (!self.colors.is_empty()).then(|| corners.map(|i| self.colors[i as usize]))
    }

    /// Returns whether positions have colour factors.
    pub fn has_vertex_colors(&self) -> bool {
        !self.colors.is_empty()
    }

    /// Returns the factors of alpha at the corners of a triangle.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn vertex_alphas(&self, triangle: usize) -> [f64; 3] {
        self.triangles[triangle].map(|i| self.alphas.get(i as usize).map_or(1.0, |alpha| f64::from(*alpha)))
    }

    /// Returns whether any face may have holes.
    pub fn has_holes(&self) -> bool {
        self.looks.iter().any(|look| look.cutoff.is_some())
    }

    /// Returns the meaning of the factors of colours.
    pub fn colors(&self) -> Colors {
        self.space
    }

    /// Returns the looks of the faces, at least one.
    pub fn looks(&self) -> &[Look] {
        &self.looks
    }

    /// Returns the index of a triangle's look.
    pub fn look(&self, triangle: usize) -> usize {
        self.look_of.get(triangle).map_or(0, |look| *look as usize)
    }

    /// Returns whether the colour of faces of a look varies within them.
    ///
    /// # Panics
    /// Panics if there is no such look.
    pub fn is_varied(&self, look: usize) -> bool {
        let look = &self.looks[look];
        !look.is_missing && (!self.colors.is_empty() || look.texture.is_some())
    }

    /// Returns whether any look has a picture.
    pub fn has_pictures(&self) -> bool {
        self.looks.iter().any(|look| look.texture.is_some() || look.glow_texture.is_some())
    }

    /// Returns whether the levels of the pictures are decoded to linear light. `linear` is whether the picture that is drawn
    /// is computed in linear light.
    pub fn decodes_pictures(&self, linear: bool) -> bool {
        linear || self.space == Colors::Linear
    }

    /// Returns the colour of a triangle of a look at a place, given by its barycentric weights, from 0 to 1 per channel.
    /// `corners` are its colour factors, `level` is the level of its picture there, and 1 without one; `linear` is whether the
    /// picture that is drawn is computed in linear light.
    ///
    /// # Panics
    /// Panics if there is no such look.
    pub fn color(
        &self,
        look: usize,
        corners: Option<[Vec3; 3]>,
        weights: [f64; 3],
        level: DVec3,
        linear: bool,
    ) -> DVec3 {
        let mixed = corners.map(|corners| {
            let corners = corners.map(|color| self.read(color.as_dvec3(), linear));
            corners.into_iter().zip(weights).map(|(color, weight)| color * weight).sum::<DVec3>()
        });
        self.product(look, mixed, level, linear)
    }

    /// Returns the colour of a look whose faces have neither colours at their vertices nor a picture, from 0 to 1 per channel.
    ///
    /// # Panics
    /// Panics if there is no such look.
    pub fn look_color(&self, look: usize, linear: bool) -> DVec3 {
        self.product(look, None, DVec3::ONE, linear)
    }

    /// Returns the factor of a look's colour, or 1 for one without.
    ///
    /// # Panics
    /// Panics if there is no such look.
    pub fn look_factor(&self, look: usize, linear: bool) -> DVec3 {
        self.looks[look].factor.map_or(DVec3::ONE, |factor| self.read(factor, linear))
    }

    /// Returns whether the factors of a colour can be multiplied directly as numbers of the drawn picture. `linear` is
    /// whether that is computed in linear light.
    pub fn is_product(&self, linear: bool) -> bool {
        linear || self.space == Colors::Levels
    }

    /// Returns the light that the faces of a look give off, where their picture of it has this `level`; it is 1 without one.
    ///
    /// # Panics
    /// Panics if there is no such look.
    pub fn glow(&self, look: usize, level: DVec3, linear: bool) -> DVec3 {
        let glow = self.looks[look].glow * level;
        // Above 1 the curve goes on as a power, so that bright light stays bright.
        if linear { glow } else { glow.map(|x| encoded(x.max(0.0))) }
    }

    /// Returns a factor of a colour in the numbers in which factors are multiplied. Above 1 the curve goes on.
    fn read(&self, factor: DVec3, linear: bool) -> DVec3 {
        if linear && self.space == Colors::Levels { factor.map(decoded) } else { factor }
    }

    /// Returns the product of factors as the picture's numbers. `mixed` are colours at vertices, already read.
    fn product(&self, look: usize, mixed: Option<DVec3>, level: DVec3, linear: bool) -> DVec3 {
        let Look { factor, texture, is_missing, .. } = &self.looks[look];
        if *is_missing || factor.is_none() && texture.is_none() && mixed.is_none() {
            return NEUTRAL;
        }
        let factor = self.look_factor(look, linear);
        let product = (factor * level * mixed.unwrap_or(DVec3::ONE)).clamp(DVec3::ZERO, DVec3::ONE);
        if self.is_product(linear) { product } else { product.map(encoded) }
    }

    /// Returns whether the model is a closed body, which glass fills.
    pub fn closure(&self) -> &Closure {
        self.closure.get_or_init(|| closure(&self.positions, &self.triangles))
    }

    /// Returns descriptions of parts of the file that are not drawn as its author may expect.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Returns the memory that the model takes, in bytes.
    pub(crate) fn bytes(&self) -> usize {
        24 * self.positions.len()
            + 12 * (self.triangles.len() + self.normals.len() + self.normal_of.len() + self.uv_of.len())
            + 8 * (self.uvs.len() + self.own_uvs.iter().map(Vec::len).sum::<usize>())
            + 12 * self.colors.len()
            + 4 * self.alphas.len()
            + 4 * self.look_of.len()
            + self.derived.0.get().map_or(0, |_| DERIVED_BYTES * self.triangles.len())
    }
}

/// Describes that there are more triangles than the limit.
pub(crate) fn too_many_triangles() -> Fault {
    Fault::new(format!("it has more than {} triangles", limits::TRIANGLES))
}

fn retain<T>(all: &mut Vec<T>, kept: &[bool]) {
    let mut kept = kept.iter();
    all.retain(|_| kept.next().is_some_and(|kept| *kept));
}

/// Returns whether a triangle has an area, decided without overflow and, for triangles that are not needles, exactly.
fn has_area(positions: &[DVec3], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|i| positions[i as usize]);
    if a == b || b == c || c == a {
        return false;
    }
    let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
    // Most triangles are neither needles nor of odd sizes. The bound is four times the one below, at most.
    let (p, q) = (b - a, c - a);
    let product = p.abs().max_element() * q.abs().max_element();
    if largest < 1e100 && product > 1e-200 && p.cross(q).abs().max_element() > 16.0 * f64::EPSILON * product {
        return true;
    }
    // Powers of two round nothing.
    let scale = power_below_inverse(largest);
    let [a, b, c] = [a, b, c].map(|p| p * scale);
    let (p, q) = (b - a, c - a);
    let (p, q) =
        (p * power_below_inverse(p.abs().max_element()), q * power_below_inverse(q.abs().max_element()));
    p.cross(q).abs().max_element() > 4.0 * f64::EPSILON
}

/// Returns the largest power of two of at most 1/x, within the range of exponents.
fn power_below_inverse(x: f64) -> f64 {
    if x == 0.0 {
        return 1.0;
    }
    libm::ldexp(1.0, -libm::ilogb(x).clamp(-1000, 1000) - 1)
}

/// Returns the unit vector, or 0 for 0.
pub(crate) fn unit(v: Vec3) -> Vec3 {
    v.as_dvec3().normalize_or_zero().as_vec3()
}
