//! Planes.

use std::fmt;

use glam::DVec3;

use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{self, Faults, InvalidValue, Parameter, finite};
use crate::model::material::Material;
use crate::model::surface;

/// A plane without end, seen from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    point: DVec3,
    normal: DVec3,
    material: Material,
}

impl Plane {
    /// Through `point`, square to `normal`, which has any length but zero.
    ///
    /// # Errors
    /// When the normal is zero or a number is not finite.
    pub fn new(point: DVec3, normal: DVec3, material: Material) -> Result<Self, InvalidValue> {
        finite(Parameter::PlanePoint, point)?;
        invalid::direction(Parameter::Normal, normal)?;
        Ok(Self { point, normal, material })
    }

    /// A point of it.
    pub fn point(&self) -> DVec3 {
        self.point
    }

    /// Square to it, of any length but zero.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// How its surface answers light.
    pub fn material(&self) -> &Material {
        &self.material
    }

    pub(super) fn placed(&self, place: impl Fn(DVec3) -> DVec3) -> Result<Self, InvalidValue> {
        Self::new(place(self.point), self.normal, self.material.clone())
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
