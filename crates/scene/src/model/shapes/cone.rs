//! Cones and truncated cones.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Constraint, Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative};
use crate::model::material::Material;
use crate::model::surface;
use crate::model::vector::across;

/// A round cone or truncated cone, closed at both ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Cone {
    radii: [f64; 2],
    ends: [DVec3; 2],
    material: Material,
}

impl Cone {
    /// Makes a cone with a radius at each end of its axis.
    ///
    /// # Errors
    /// Fails if a radius is negative, both are zero, the ends are the same, or a number is not finite.
    pub fn new(radii: [f64; 2], ends: [DVec3; 2], material: Material) -> Result<Self, InvalidValue> {
        not_negative(Parameter::RadiusA, radii[0])?;
        not_negative(Parameter::RadiusB, radii[1])?;
        if radii == [0.0; 2] {
            return Err(InvalidValue::NoRadius);
        }
        finite(Parameter::AxisEnd, ends[0])?;
        finite(Parameter::AxisEnd, ends[1])?;
        if ends[0] == ends[1] {
            return Err(InvalidValue::NoAxis);
        }
        Ok(Self { radii, ends, material })
    }

    /// Returns the radii at a and b, not negative and not both zero.
    pub fn radii(&self) -> [f64; 2] {
        self.radii
    }

    /// Returns the ends a and b of the axis, which differ.
    pub fn ends(&self) -> [DVec3; 2] {
        self.ends
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Cone {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        let radii = self.radii.map(|radius| motion.length(radius));
        Self::new(radii, self.ends.map(|end| motion.point(end)), material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        let ([a, b], [radius_a, radius_b]) = (self.ends, self.radii);
        let across = across(b - a, direction);
        Some((a.dot(direction) + radius_a * across).max(b.dot(direction) + radius_b * across))
    }

    fn outline(&self) -> Outline {
        Outline::Rod { radii: self.radii, ends: self.ends, is_round: false }
    }
}

impl Scripted for Cone {
    const FORM: Form = Form::new(
        "Cone",
        &[
            Field::new(Parameter::RadiusA, &["Ra"], Kind::Length, Values::NotNegative),
            Field::new(Parameter::RadiusB, &["Rb"], Kind::Length, Values::NotNegative),
            Field::new(Parameter::AxisEnd, &["ax", "ay", "az"], Kind::Position, Values::Any),
            Field::new(Parameter::AxisEnd, &["bx", "by", "bz"], Kind::Position, Values::Any),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    )
    .with(&[Constraint::Differ(2, 3)])
    .hidden_by(&[0, 1]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let radii = [numbers.number(), numbers.number()];
        let ends = [numbers.vector(), numbers.vector()];
        Ok(Self::new(radii, ends, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        self.radii.iter().try_for_each(|radius| line.number(*radius))?;
        self.ends.iter().try_for_each(|end| line.vector(*end))?;
        self.material.write(line)
    }
}
