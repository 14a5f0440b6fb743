//! Suns: lights at infinity.

use std::fmt;

use glam::DVec3;

use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{self, Faults, InvalidValue, Parameter, finite};

/// A light at infinity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    color: DVec3,
    direction: DVec3,
}

impl DirectionalLight {
    /// `direction` is the one in which the light travels, of any length but zero.
    ///
    /// # Errors
    /// When the direction is zero or a number is not finite.
    pub fn new(color: DVec3, direction: DVec3) -> Result<Self, InvalidValue> {
        finite(Parameter::LightColor, color)?;
        invalid::direction(Parameter::LightDirection, direction)?;
        Ok(Self { color, direction })
    }

    /// Its colour, any finite numbers.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// The direction in which it travels, of any length but zero.
    pub fn direction(&self) -> DVec3 {
        self.direction
    }
}

impl Scripted for DirectionalLight {
    const FORM: Form = Form::new(
        "Ilight",
        &[
            Field::new(Parameter::LightColor, &["lr", "lg", "lb"], Kind::Color, Values::Any),
            Field::new(Parameter::LightDirection, &["dx", "dy", "dz"], Kind::Direction, Values::NotZero),
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(numbers.vector(), numbers.vector())?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.color)?;
        line.vector(self.direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_travels_somewhere() {
        let light = |d| DirectionalLight::new(DVec3::splat(-2.0), d);
        assert_eq!(light(-DVec3::ZERO), Err(InvalidValue::ZeroDirection(Parameter::LightDirection)));
        assert_eq!(light(DVec3::NAN), Err(InvalidValue::NotFinite(Parameter::LightDirection)));
        assert_eq!(light(DVec3::X * 5e-324).unwrap().direction().x, 5e-324);
        let fault = DirectionalLight::new(DVec3::INFINITY, DVec3::X);
        assert_eq!(fault, Err(InvalidValue::NotFinite(Parameter::LightColor)));
    }
}
