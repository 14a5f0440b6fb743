//! Lights.

use glam::DVec3;

use super::invalid::{self, InvalidValue, Parameter, finite};

/// Something that lights the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A light at infinity.
    Directional(DirectionalLight),
}

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
