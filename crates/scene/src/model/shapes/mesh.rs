//! Meshes: the triangles of a model in a file.

use std::fmt;
use std::sync::Arc;

use glam::DVec3;
use rayfold_assets::{Model, Smoothing};

use super::Motion;
use crate::form::{Form, Line, Numbers, Quotes, Subject, quoted_word, write_number};
use crate::model::invalid::{Faults, InvalidValue, Parameter};
use crate::model::material::{Coefficients, Finish, Material};
use crate::model::surface;

/// The command that draws a model.
pub(crate) const MESH: Form = Form::new("Mesh", &[surface::AMBIENT, surface::DIFFUSE, surface::MIRROR])
    .with_subject(Subject::Quotes(Quotes::File))
    .with_optional_surface()
    .with_usage("Mesh \"FILE\" [M] [smooth a or flat]");

/// The words before and in place of the angle.
pub(crate) const SMOOTH: &str = "smooth";
pub(crate) const FLAT: &str = "flat";

/// Reads the numbers behind the name of the file.
pub(crate) fn mesh_surface(numbers: &mut Numbers<'_>) -> Result<Material, Faults> {
    Ok(Material::read(numbers)?)
}

/// The triangles of a model, as one object.
#[derive(Clone, Debug)]
pub struct Mesh {
    file: Arc<str>,
    smoothing: Smoothing,
    model: Arc<Model>,
    material: Material,
    has_material: bool,
}

impl Mesh {
    /// Makes a mesh. Without a material it has the colours of its file.
    pub fn new(file: &str, smoothing: Smoothing, model: Arc<Model>, material: Option<Material>) -> Self {
        let has_material = material.is_some();
        let material = material.unwrap_or_else(of_file);
        Self { file: file.into(), smoothing, model, material, has_material }
    }

    /// Returns the name of the file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Returns the triangles.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Returns the normals with which the triangles are shaded.
    pub fn smoothing(&self) -> Smoothing {
        self.smoothing
    }

    /// Returns the material of the surface. Where it has the colours of the file, its own are factors of them.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Returns whether the mesh has a material of the script.
    pub fn has_material(&self) -> bool {
        self.has_material
    }

    /// Returns the mesh with a material of the script.
    #[must_use]
    pub fn with_material(&self, material: Material) -> Self {
        Self { material, has_material: true, ..self.clone() }
    }

    /// Moves the mesh, by moving every position of its model, and gives it a material.
    ///
    /// # Errors
    /// If a number overflows.
    pub(super) fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        let model = self.model.moved(|p| motion.point(p), |n| motion.direction(n));
        let model = model.ok_or(InvalidValue::NotFinite(Parameter::Vertex))?;
        Ok(Self { model: Arc::new(model), material, ..self.clone() })
    }

    pub(super) fn support(&self, direction: DVec3) -> Option<f64> {
        let positions = self.model.positions();
        let corners = self.model.triangles().iter().flatten();
        Some(corners.map(|i| positions[*i as usize].dot(direction)).fold(f64::NEG_INFINITY, f64::max))
    }

    /// Writes a line of a script. `surface` is the name of its material, if it has one.
    pub(crate) fn write(&self, f: &mut fmt::Formatter<'_>, surface: Option<&str>) -> fmt::Result {
        self.write_with(f, |f| match surface {
            None if !self.has_material() => Ok(()),
            _ => self.material.write(&mut Line::new(f, surface)),
        })
    }

    /// Writes a line of a script whose surface `surface` writes, with a space before it.
    pub(crate) fn write_with<'b>(
        &self,
        f: &mut fmt::Formatter<'b>,
        surface: impl FnOnce(&mut fmt::Formatter<'b>) -> fmt::Result,
    ) -> fmt::Result {
        f.write_str(MESH.name)?;
        f.write_str(" ")?;
        f.write_str(&quoted_word(&self.file))?;
        surface(f)?;
        match self.smoothing {
            Smoothing::OfFile => {}
            Smoothing::Flat => write!(f, " {FLAT}")?,
            Smoothing::Within(degrees) => {
                write!(f, " {SMOOTH} ")?;
                write_number(f, degrees)?;
            }
        }
        f.write_str("\n")
    }
}

/// Two meshes are equal if they are of the same model in memory.
impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        self.file == other.file
            && self.smoothing == other.smoothing
            && self.material == other.material
            && self.has_material == other.has_material
            && Arc::ptr_eq(&self.model, &other.model)
    }
}

/// Returns the material of a mesh without one: .9 of the file's colour is diffuse, and .1 ambient.
fn of_file() -> Material {
    let [ambient, diffuse] = [0.1, 0.9].map(DVec3::splat);
    let coefficients = Coefficients::new(ambient, diffuse, DVec3::ZERO);
    let coefficients = coefficients.unwrap_or_else(|_| unreachable!("the numbers are finite"));
    Material::finished(coefficients, Finish { own: true, ..Finish::default() })
}
