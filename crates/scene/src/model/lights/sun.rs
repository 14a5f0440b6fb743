//! Suns: lights at infinity.

use std::fmt;

use glam::DVec3;

use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{self, Faults, InvalidValue, Parameter, finite};

/// A directional light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionalLight {
    color: DVec3,
    direction: DVec3,
    angle: f64,
}

impl DirectionalLight {
    /// Makes a light. `direction` is that in which the light travels, of any length but zero.
    ///
    /// # Errors
    /// Fails if the direction is zero or a number is not finite.
    pub fn new(color: DVec3, direction: DVec3) -> Result<Self, InvalidValue> {
        finite(Parameter::LightColor, color)?;
        invalid::direction(Parameter::LightDirection, direction)?;
        Ok(Self { color, direction, angle: 0.0 })
    }

    /// Sets the apparent diameter in degrees; 0 for a point.
    ///
    /// # Errors
    /// Fails if the angle is not from 0 to below 180.
    pub fn spanning(self, angle: f64) -> Result<Self, InvalidValue> {
        if (0.0..180.0).contains(&angle) {
            Ok(Self { angle, ..self })
        } else {
            Err(InvalidValue::OutOfRange(Parameter::SunAngle, 0.0, 180.0))
        }
    }

    /// Returns the apparent diameter in degrees, from 0 to below 180. The light comes from all directions of a cone
    /// with half that angle.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Returns the colour; any finite numbers.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// Returns the direction in which the light travels, of any length but zero.
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
            Field::new(Parameter::SunAngle, &["angle"], Kind::Angle, Values::HalfTurn).optional("0"),
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(numbers.vector(), numbers.vector())?.spanning(numbers.number())?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.color)?;
        line.vector(self.direction)?;
        if self.angle == 0.0 { Ok(()) } else { line.number(self.angle) }
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
