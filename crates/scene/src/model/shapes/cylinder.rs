//! Cylinders.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Constraint, Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative, positive};
use crate::model::material::Material;
use crate::model::surface;
use crate::model::vector::{across, furthest};

/// A round cylinder, closed at both ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    radius: f64,
    ends: [DVec3; 2],
    material: Material,
}

impl Cylinder {
    /// Makes a cylinder from one end of its axis to the other.
    ///
    /// # Errors
    /// Fails if the radius is not positive, the ends are the same, or a number is not finite.
    pub fn new(radius: f64, ends: [DVec3; 2], material: Material) -> Result<Self, InvalidValue> {
        positive(Parameter::Radius, radius)?;
        finite(Parameter::AxisEnd, ends[0])?;
        finite(Parameter::AxisEnd, ends[1])?;
        if ends[0] == ends[1] {
            return Err(InvalidValue::NoAxis);
        }
        Ok(Self { radius, ends, material })
    }

    /// Returns the radius, greater than 0.
    pub fn radius(&self) -> f64 {
        self.radius
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

impl Shape for Cylinder {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        Self::new(motion.length(self.radius), self.ends.map(|end| motion.point(end)), material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        let [a, b] = self.ends;
        Some(furthest(&self.ends, direction) + self.radius * across(b - a, direction))
    }

    fn outline(&self) -> Outline {
        Outline::Rod { radii: [self.radius; 2], ends: self.ends, is_round: false }
    }
}

impl Scripted for Cylinder {
    const FORM: Form = Form::new(
        "Cylinder",
        &[
            Field::new(Parameter::Radius, &["R"], Kind::Length, Values::NotNegative),
            Field::new(Parameter::AxisEnd, &["ax", "ay", "az"], Kind::Position, Values::Any),
            Field::new(Parameter::AxisEnd, &["bx", "by", "bz"], Kind::Position, Values::Any),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    )
    .with(&[Constraint::Differ(1, 2)])
    .hidden_by(&[0]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let (radius, ends) = (numbers.number(), [numbers.vector(), numbers.vector()]);
        not_negative(Parameter::Radius, radius)?;
        Ok(Self::new(radius, ends, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.radius)?;
        self.ends.iter().try_for_each(|end| line.vector(*end))?;
        self.material.write(line)
    }
}
