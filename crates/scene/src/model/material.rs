//! How a surface answers light.

use std::fmt;

use glam::DVec3;

use super::invalid::{InvalidValue, Parameter, finite};
use crate::form::{Field, Kind, Line, Numbers, Values};

/// Of an object's parameters.
pub(super) const AMBIENT: Field =
    Field::new(Parameter::Ambient, &["ar", "ag", "ab"], Kind::Color, Values::Any);
/// Of an object's parameters.
pub(super) const DIFFUSE: Field =
    Field::new(Parameter::Diffuse, &["rr", "rg", "rb"], Kind::Coefficients, Values::Any);
/// Of an object's parameters.
pub(super) const MIRROR: Field =
    Field::new(Parameter::Mirror, &["sr", "sg", "sb"], Kind::Coefficients, Values::Any);

/// Coefficients of a surface, a channel each; any finite numbers.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Material {
    ambient: DVec3,
    diffuse: DVec3,
    mirror: DVec3,
}

impl Material {
    /// # Errors
    /// When a number is not finite.
    pub fn new(ambient: DVec3, diffuse: DVec3, mirror: DVec3) -> Result<Self, InvalidValue> {
        finite(Parameter::Ambient, ambient)?;
        finite(Parameter::Diffuse, diffuse)?;
        finite(Parameter::Mirror, mirror)?;
        Ok(Self { ambient, diffuse, mirror })
    }

    /// The colour that needs no light.
    pub fn ambient(&self) -> DVec3 {
        self.ambient
    }

    /// What is scattered of the light that arrives (Lambert).
    pub fn diffuse(&self) -> DVec3 {
        self.diffuse
    }

    /// What is mirrored of the colour along the reflected ray.
    pub fn mirror(&self) -> DVec3 {
        self.mirror
    }

    /// [`AMBIENT`], [`DIFFUSE`] and [`MIRROR`].
    pub(super) fn read(numbers: &mut Numbers<'_>) -> Result<Self, InvalidValue> {
        Self::new(numbers.vector(), numbers.vector(), numbers.vector())
    }

    /// [`AMBIENT`] and [`DIFFUSE`].
    pub(super) fn read_matte(numbers: &mut Numbers<'_>) -> Result<Self, InvalidValue> {
        Self::new(numbers.vector(), numbers.vector(), DVec3::ZERO)
    }

    pub(super) fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        self.write_matte(line)?;
        // A mirror of -0 is written, so that it reads back as that.
        if self.mirror.to_array().map(f64::to_bits) == [0; 3] { Ok(()) } else { line.vector(self.mirror) }
    }

    pub(super) fn write_matte(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.ambient)?;
        line.vector(self.diffuse)
    }

    /// # Errors
    /// When it mirrors.
    pub(super) fn must_be_matte(&self) -> Result<(), InvalidValue> {
        if self.mirror == DVec3::ZERO { Ok(()) } else { Err(InvalidValue::MirrorOnFlat) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_coefficient_is_finite() {
        for bad in [DVec3::NAN, DVec3::INFINITY] {
            let fault = |parameter| Err(InvalidValue::NotFinite(parameter));
            assert_eq!(Material::new(bad, DVec3::X, DVec3::X), fault(Parameter::Ambient));
            assert_eq!(Material::new(DVec3::X, bad, DVec3::X), fault(Parameter::Diffuse));
            assert_eq!(Material::new(DVec3::X, DVec3::X, bad), fault(Parameter::Mirror));
        }
    }
}
