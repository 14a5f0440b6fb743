//! Tori.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Constraint, Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{self, Faults, InvalidValue, Parameter, finite, positive};
use crate::model::material::Material;
use crate::model::surface;
use crate::model::vector::across;

/// A ring: all points whose distance from a circle is at most its thickness.
#[derive(Clone, Debug, PartialEq)]
pub struct Torus {
    radius: f64,
    thickness: f64,
    center: DVec3,
    normal: DVec3,
    material: Material,
}

impl Torus {
    /// Makes a torus. The circle has the `radius` R around `center` and is perpendicular to `normal`, which has any
    /// length but zero. `thickness` r is the radius of the tube.
    ///
    /// # Errors
    /// Fails if not 0 < r < R, the normal is zero, or a number is not finite.
    pub fn new(
        radius: f64,
        thickness: f64,
        center: DVec3,
        normal: DVec3,
        material: Material,
    ) -> Result<Self, InvalidValue> {
        positive(Parameter::Radius, radius)?;
        positive(Parameter::Thickness, thickness)?;
        if thickness >= radius {
            return Err(InvalidValue::ThickTorus);
        }
        finite(Parameter::Center, center)?;
        invalid::direction(Parameter::Normal, normal)?;
        Ok(Self { radius, thickness, center, normal, material })
    }

    /// Returns the radius R of the circle.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the radius r of the tube around the circle: 0 < r < R.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Returns the centre of the circle.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Returns the normal of the circle, of any length but zero.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Returns the material of the surface.
    pub fn material(&self) -> &Material {
        &self.material
    }
}

impl Shape for Torus {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        let (radius, thickness) = (motion.length(self.radius), motion.length(self.thickness));
        let (center, normal) = (motion.point(self.center), motion.direction(self.normal));
        Self::new(radius, thickness, center, normal, material)
    }

    fn support(&self, direction: DVec3) -> Option<f64> {
        let ring = self.radius * across(self.normal, direction);
        Some(self.center.dot(direction) + ring + self.thickness * direction.length())
    }

    fn outline(&self) -> Outline {
        let &Self { radius, thickness, center, normal, .. } = self;
        Outline::Ring { radius, thickness, center, normal }
    }
}

impl Scripted for Torus {
    const FORM: Form = Form::new(
        "Torus",
        &[
            Field::new(Parameter::Radius, &["R"], Kind::Length, Values::Positive),
            Field::new(Parameter::Thickness, &["r"], Kind::Length, Values::Positive),
            Field::new(Parameter::Center, &["cx", "cy", "cz"], Kind::Position, Values::Any),
            Field::new(Parameter::Normal, &["nx", "ny", "nz"], Kind::Direction, Values::NotZero),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    )
    .with(&[Constraint::Greater(0, 1)]);

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let (radius, thickness) = (numbers.number(), numbers.number());
        let (center, normal) = (numbers.vector(), numbers.vector());
        Ok(Self::new(radius, thickness, center, normal, Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.radius)?;
        line.number(self.thickness)?;
        line.vector(self.center)?;
        line.vector(self.normal)?;
        self.material.write(line)
    }
}
