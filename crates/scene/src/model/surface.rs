//! The syntax of an object's surface: coefficients, or the name of a material.

use std::fmt;

use super::invalid::{InvalidValue, Parameter};
use super::material::Material;
use crate::form::{Field, Kind, Line, Numbers, Values};

/// The ambient colour, a parameter of every object.
pub(in crate::model) const AMBIENT: Field =
    Field::new(Parameter::Ambient, &["ar", "ag", "ab"], Kind::Color, Values::Any);
/// The diffuse coefficients, a parameter of every object.
pub(in crate::model) const DIFFUSE: Field =
    Field::new(Parameter::Diffuse, &["rr", "rg", "rb"], Kind::Coefficients, Values::Any);
/// The mirror coefficients, a parameter of every object.
pub(in crate::model) const MIRROR: Field =
    Field::new(Parameter::Mirror, &["sr", "sg", "sb"], Kind::Coefficients, Values::Any).omittable("0");

impl Material {
    /// Reads [`AMBIENT`], [`DIFFUSE`] and [`MIRROR`], or the material that was named in their place.
    pub(in crate::model) fn read(numbers: &mut Numbers<'_>) -> Result<Self, InvalidValue> {
        match numbers.surface() {
            Some(material) => Ok(material.clone()),
            None => Self::new(numbers.vector(), numbers.vector(), numbers.vector()),
        }
    }

    pub(in crate::model) fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        if let Some(name) = line.surface() {
            return line.word(name);
        }
        line.vector(self.ambient())?;
        line.vector(self.diffuse())?;
        let mirror = self.mirror();
        // A mirror of -0 is written, so that it reads back as -0.
        if mirror.to_array().map(f64::to_bits) == [0; 3] { Ok(()) } else { line.vector(mirror) }
    }
}
