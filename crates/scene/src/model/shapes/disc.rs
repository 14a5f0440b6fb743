//! Discs.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{self, Faults, InvalidValue, Parameter, finite, not_negative, positive};
use crate::model::material::Material;
use crate::model::surface;
use crate::model::vector::across;

/// A flat, round, two-sided disc, including its rim.
#[derive(Clone, Debug, PartialEq)]
pub struct Disc {
    radius: f64,
    center: DVec3,
    normal: DVec3,
    material: Material,
}

impl Disc {
    /// Makes a disc around `center`, perpendicular to `normal`, which has any length but zero.
    ///
    /// # Errors
    /// Fails if the radius is not positive, the normal is zero, or a number is not finite.
    pub fn new(radius: f64, center: DVec3, normal: DVec3, material: Material) -> Result<Self, InvalidValue> {
        positive(Parameter::Radius, radius)?;
        finite(Parameter::Center, center)?;
        invalid::direction(Parameter::Normal, normal)?;
        Ok(Self { radius, center, normal, material })
    }

    /// Returns the radius, greater than 0.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the centre of the disc.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Returns the normal, of any length but zero.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Disc {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        let (center, normal) = (motion.point(self.center), motion.direction(self.normal));
        Self::new(motion.length(self.radius), center, normal, material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        Some(self.center.dot(direction) + self.radius * across(self.normal, direction))
    }

    fn outline(&self) -> Outline {
        Outline::Disc { center: self.center, normal: self.normal, radius: self.radius }
    }
}

impl Scripted for Disc {
    const FORM: Form = Form::new(
        "Disc",
        &[
            Field::new(Parameter::Radius, &["R"], Kind::Length, Values::NotNegative),
            Field::new(Parameter::Center, &["cx", "cy", "cz"], Kind::Position, Values::Any),
            Field::new(Parameter::Normal, &["nx", "ny", "nz"], Kind::Direction, Values::NotZero),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    )
    .hidden_by(&[0]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let (radius, center, normal) = (numbers.number(), numbers.vector(), numbers.vector());
        not_negative(Parameter::Radius, radius)?;
        Ok(Self::new(radius, center, normal, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.radius)?;
        line.vector(self.center)?;
        line.vector(self.normal)?;
        self.material.write(line)
    }
}
