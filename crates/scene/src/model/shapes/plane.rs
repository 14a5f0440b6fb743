//! Planes.

use std::fmt;

use glam::DVec3;

use super::{Motion, Outline, Shape};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{self, Faults, InvalidValue, Parameter, finite};
use crate::model::material::Material;
use crate::model::surface;

/// An infinite, two-sided plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    point: DVec3,
    normal: DVec3,
    material: Material,
}

impl Plane {
    /// Makes a plane through `point`, perpendicular to `normal`, which has any length but zero.
    ///
    /// # Errors
    /// Fails if the normal is zero or a number is not finite.
    pub fn new(point: DVec3, normal: DVec3, material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::PlanePoint, point)?;
        invalid::direction(Parameter::Normal, normal)?;
        Ok(Self { point, normal, material })
    }

    /// Returns a point of the plane.
    pub fn point(&self) -> DVec3 {
        self.point
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

impl Shape for Plane {
    fn moved(&self, motion: &impl Motion, material: Material) -> Result<Self, InvalidValue> {
        Self::new(motion.point(self.point), motion.direction(self.normal), material)
    }

    fn support(&self, _: DVec3) -> Option<f64> {
        None
    }

    fn outline(&self) -> Outline {
        Outline::Plane(self.point)
    }
}

impl Scripted for Plane {
    const FORM: Form = Form::new(
        "Plane",
        &[
            Field::new(Parameter::PlanePoint, &["px", "py", "pz"], Kind::Position, Values::Any),
            Field::new(Parameter::Normal, &["nx", "ny", "nz"], Kind::Direction, Values::NotZero),
            surface::AMBIENT,
            surface::DIFFUSE,
            surface::MIRROR,
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(numbers.vector(), numbers.vector(), Material::read(numbers)?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.point)?;
        line.vector(self.normal)?;
        self.material.write(line)
    }
}
