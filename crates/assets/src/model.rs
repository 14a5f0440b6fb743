//! A model: triangles with normals and colours, whatever the format of its file.

use std::sync::OnceLock;

use glam::{DVec3, Vec2, Vec3};

use crate::closure::{Closure, closure};
use crate::error::Fault;
use crate::limits;
use crate::normals::smoothed;
use crate::srgb::{decoded, encoded};

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
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The factor of the colour; `None` for faces to which the file gives no colour.
    pub factor: Option<DVec3>,
    /// The light that the faces give off, linear.
    pub glow: DVec3,
    /// Whether the faces show their colour whatever the light (`KHR_materials_unlit`).
    pub unlit: bool,
}

impl Look {
    /// The look of faces to which the file gives no colour.
    pub(crate) const PLAIN: Self = Self { factor: None, glow: DVec3::ZERO, unlit: false };
}

/// The colour of what has none of its own.
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
    /// The colour factors of the positions; empty if there are none.
    colors: Vec<Vec3>,
    space: Colors,
    looks: Vec<Look>,
    /// The look of each triangle; empty if all have the first.
    look_of: Vec<u32>,
    warnings: Vec<String>,
    closure: OnceLock<Closure>,
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
    /// Empty, or one for each position.
    pub(crate) colors: Vec<Vec3>,
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
        if uvs.iter().any(|uv| !uv.is_finite()) || colors.iter().any(|color| !color.is_finite()) {
            return Err(Fault::new("a texture coordinate or a colour is not a finite number"));
        }
        let within = |all: &[[u32; 3]], count: usize, optional: bool| {
            all.iter().flatten().all(|i| (*i as usize) < count || optional && *i == NONE)
        };
        let is_good = within(triangles, positions.len(), false)
            && within(normal_of, normals.len(), true)
            && within(uv_of, uvs.len(), true)
            && look_of.iter().all(|look| (*look as usize) < looks.len().max(1));
        if !is_good {
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
        let Parts { positions, triangles, normals, normal_of, uvs, uv_of, colors, space, .. } = parts;
        let Parts { mut looks, look_of, warnings, .. } = Parts {
            looks: parts.looks,
            look_of: parts.look_of,
            warnings: parts.warnings,
            ..Parts::default()
        };
        if looks.is_empty() {
            looks.push(Look::PLAIN);
        }
        let normals = normals.into_iter().map(unit).collect();
        let closure = OnceLock::new();
        Ok(Some(Self {
            positions,
            triangles,
            normals,
            normal_of,
            uvs,
            uv_of,
            colors,
            space,
            looks,
            look_of,
            warnings,
            closure,
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
            colors: self.colors.clone(),
            space: self.space,
            looks: self.looks.clone(),
            look_of: self.look_of.clone(),
            warnings: self.warnings.clone(),
            closure: self.closure.clone(),
        }
    }

    /// Returns the model with every position moved by `point` and every normal turned by `direction`, or `None` if a number
    /// overflows.
    pub fn moved(&self, point: impl Fn(DVec3) -> DVec3, direction: impl Fn(DVec3) -> DVec3) -> Option<Self> {
        let mut moved = self.with(Smoothing::OfFile);
        moved.positions.iter_mut().for_each(|p| *p = point(*p));
        moved.normals.iter_mut().for_each(|n| *n = direction(n.as_dvec3()).as_vec3());
        moved.closure = OnceLock::new();
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
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
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

    /// Returns whether the colour varies within triangles.
    pub fn has_vertex_colors(&self) -> bool {
        !self.colors.is_empty()
    }

    /// Returns the looks of the faces, at least one.
    pub fn looks(&self) -> &[Look] {
        &self.looks
    }

    /// Returns the index of a triangle's look.
    pub fn look(&self, triangle: usize) -> usize {
        self.look_of.get(triangle).map_or(0, |look| *look as usize)
    }

    /// Returns the colour of a triangle at a place, given by its barycentric weights, from 0 to 1 per channel. `linear` is
    /// whether the picture is computed in linear light.
    ///
    /// # Panics
    /// Panics if there is no such triangle.
    pub fn color(&self, triangle: usize, weights: [f64; 3], linear: bool) -> DVec3 {
        let factor = self.looks[self.look(triangle)].factor;
        if self.colors.is_empty() {
            return self.look_color(self.look(triangle), linear);
        }
        let into = |color: DVec3| {
            if self.decodes(linear) { color.map(|x| decoded(x.clamp(0.0, 1.0))) } else { color }
        };
        let corners = self.triangles[triangle].map(|i| into(self.colors[i as usize].as_dvec3()));
        let mixed = corners.iter().zip(weights).map(|(color, weight)| *color * weight).sum::<DVec3>();
        self.shown(mixed * factor.map_or(DVec3::ONE, into), linear)
    }

    /// Returns the colour of a look whose faces have no colours at their vertices, from 0 to 1 per channel.
    ///
    /// # Panics
    /// Panics if there is no such look.
    pub fn look_color(&self, look: usize, linear: bool) -> DVec3 {
        let Some(factor) = self.looks[look].factor else { return NEUTRAL };
        let factor = if self.decodes(linear) { factor.map(|x| decoded(x.clamp(0.0, 1.0))) } else { factor };
        self.shown(factor, linear)
    }

    /// Returns the light that the faces of a look give off. An unlit one gives off its colour.
    ///
    /// # Panics
    /// Panics if there is no such look.
    pub fn glow(&self, look: usize, linear: bool) -> DVec3 {
        let glow = self.looks[look].glow;
        // Above 1 the curve goes on as a power, so that bright light stays bright.
        if linear { glow } else { glow.map(|x| encoded(x.max(0.0))) }
    }

    fn decodes(&self, linear: bool) -> bool {
        linear && self.space == Colors::Levels
    }

    /// Returns the product of factors as the picture's numbers.
    fn shown(&self, product: DVec3, linear: bool) -> DVec3 {
        let product = product.clamp(DVec3::ZERO, DVec3::ONE);
        if !linear && self.space == Colors::Linear { product.map(encoded) } else { product }
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
            + 8 * self.uvs.len()
            + 12 * self.colors.len()
            + 4 * self.look_of.len()
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
