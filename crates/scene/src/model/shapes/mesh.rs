//! Meshes: the triangles of a model in a file, and of letters.

use std::fmt;
use std::sync::Arc;

use glam::DVec3;
use rayfold_assets::{Align, Lettering, Model, Smoothing};

use super::Motion;
use crate::form::{Field, Form, Kind, Line, Numbers, Quotes, Subject, Values, quoted_word, write_number};
use crate::model::invalid::{Faults, InvalidValue, Parameter, not_negative, positive};
use crate::model::material::{Coefficients, Finish, Material};
use crate::model::surface;

/// The command that draws a model.
pub(crate) const MESH: Form = Form::new("Mesh", &[surface::AMBIENT, surface::DIFFUSE, surface::MIRROR])
    .with_subject(Subject::Quotes(Quotes::File))
    .with_optional_surface()
    .with_options(&[SMOOTH, FLAT])
    .with_usage("Mesh \"FILE\" [M] [smooth a or flat]");

/// The words before the angle and in place of it.
pub(crate) const SMOOTH: &str = "smooth";
pub(crate) const FLAT: &str = "flat";

const SIZE: Field = Field::new(Parameter::LetterSize, &["SIZE"], Kind::Length, Values::Positive);
const DEPTH: Field = Field::new(Parameter::LetterDepth, &["DEPTH"], Kind::Length, Values::NotNegative);

/// The command that draws letters.
pub(crate) const TEXT: Form =
    Form::new("Text", &[SIZE, DEPTH, surface::AMBIENT, surface::DIFFUSE, surface::MIRROR])
        .with_subject(Subject::Quotes(Quotes::Words))
        .with_optional_surface()
        .with_options(&["left", "centre", "right", FONT])
        .fixed_first(2)
        .with_usage("Text \"TEXT\" SIZE DEPTH [M] [left or centre or right] [font \"FILE\"]");

/// The word before the file of a font.
pub(crate) const FONT: &str = "font";

/// Returns the alignment of lines for a word.
pub(crate) fn align_from_word(word: &str) -> Option<Align> {
    let all = [Align::Left, Align::Center, Align::Right];
    all.into_iter().find(|align| align_word(*align).eq_ignore_ascii_case(word))
}

fn align_word(align: Align) -> &'static str {
    match align {
        Align::Left => "left",
        Align::Center => "centre",
        Align::Right => "right",
    }
}

/// Reads the size and the depth of letters.
pub(crate) fn letter_plate(numbers: &mut Numbers<'_>) -> Result<(f64, f64), Faults> {
    let size = positive(Parameter::LetterSize, numbers.number());
    let depth = not_negative(Parameter::LetterDepth, numbers.number());
    match (size, depth) {
        (Ok(size), Ok(depth)) => Ok((size, depth)),
        (size, depth) => Err(Faults(size.err().into_iter().chain(depth.err()).collect())),
    }
}

/// Reads the numbers behind those of [`letter_plate`].
pub(crate) fn letter_surface(numbers: &mut Numbers<'_>) -> Result<Material, Faults> {
    numbers.pair();
    mesh_surface(numbers)
}

/// Reads the numbers after the name of the file.
pub(crate) fn mesh_surface(numbers: &mut Numbers<'_>) -> Result<Material, Faults> {
    Ok(Material::read(numbers)?)
}

/// The origin of triangles.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The model in a file.
    File {
        /// The name of the file.
        name: Arc<str>,
        /// The normals with which the triangles are shaded.
        smoothing: Smoothing,
    },
    /// Letters cut out of a plate.
    Text(Arc<Lettering>),
}

/// The triangles of a model, as one object.
#[derive(Clone, Debug)]
pub struct Mesh {
    source: Source,
    model: Arc<Model>,
    material: Material,
    has_material: bool,
}

impl Mesh {
    /// Makes a mesh. Without a material it has the colours of its file; letters have the colour .8.
    pub fn new(source: Source, model: Arc<Model>, material: Option<Material>) -> Self {
        let has_material = material.is_some();
        let material = material.unwrap_or_else(of_file);
        Self { source, model, material, has_material }
    }

    /// Returns the origin of the triangles.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Returns the name of the file of a model; `None` for letters.
    pub fn file(&self) -> Option<&str> {
        match &self.source {
            Source::File { name, .. } => Some(name),
            Source::Text(_) => None,
        }
    }

    /// Returns the triangles.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Returns the material of the surface. If it has the colours of the file, its own colours are factors of them.
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
    /// Fails if a number overflows.
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

    /// Writes a line of a script. The function `surface` writes the surface, with a space before it.
    pub(crate) fn write_with<'b>(
        &self,
        f: &mut fmt::Formatter<'b>,
        surface: impl FnOnce(&mut fmt::Formatter<'b>) -> fmt::Result,
    ) -> fmt::Result {
        match &self.source {
            Source::File { name, smoothing } => {
                write!(f, "{} {}", MESH.name, quoted_word(name))?;
                surface(f)?;
                match smoothing {
                    Smoothing::OfFile => {}
                    Smoothing::Flat => write!(f, " {FLAT}")?,
                    Smoothing::Within(degrees) => {
                        write!(f, " {SMOOTH} ")?;
                        write_number(f, *degrees)?;
                    }
                }
            }
            Source::Text(lettering) => {
                let Lettering { text, size, depth, align, font } = &**lettering;
                write!(f, "{} {}", TEXT.name, quoted_word(text))?;
                for number in [*size, *depth] {
                    f.write_str(" ")?;
                    write_number(f, number)?;
                }
                surface(f)?;
                if *align != Align::Left {
                    write!(f, " {}", align_word(*align))?;
                }
                if let Some(font) = font {
                    write!(f, " {FONT} {}", quoted_word(font))?;
                }
            }
        }
        f.write_str("\n")
    }
}

/// Two meshes are equal if they are of the same model in memory.
impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        self.source == other.source
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
