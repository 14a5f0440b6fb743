//! Lamps: lights with a position.

use std::fmt;

use glam::DVec3;

use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative};

/// A light with a position: a point, or a luminous ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    color: DVec3,
    position: DVec3,
    radius: f64,
    reach: f64,
}

impl Lamp {
    /// Makes a ball of the given `radius` around `position`; a radius of 0 makes a point. With a `reach` above 0,
    /// brightness falls with the square of the distance, and `color` is the brightness at the distance `reach`. With
    /// 0 there is no falloff.
    ///
    /// # Errors
    /// Fails if the radius or the reach is negative, or a number is not finite.
    pub fn new(color: DVec3, position: DVec3, radius: f64, reach: f64) -> Result<Self, InvalidValue> {
        finite(Parameter::LightColor, color)?;
        finite(Parameter::LampPosition, position)?;
        not_negative(Parameter::LampRadius, radius)?;
        not_negative(Parameter::Reach, reach)?;
        Ok(Self { color, position, radius, reach })
    }

    /// Returns the colour; any finite numbers.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// Returns the centre of the ball.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns the radius of the ball, which is 0 for a point.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the distance at which the light has its given colour, or 0 without falloff.
    pub fn reach(&self) -> f64 {
        self.reach
    }
}

impl Scripted for Lamp {
    const FORM: Form = Form::new(
        "Plight",
        &[
            Field::new(Parameter::LightColor, &["lr", "lg", "lb"], Kind::Color, Values::Any),
            Field::new(Parameter::LampPosition, &["x", "y", "z"], Kind::Position, Values::Any),
            Field::new(Parameter::LampRadius, &["radius"], Kind::Length, Values::NotNegative).optional("0"),
            Field::new(Parameter::Reach, &["reach"], Kind::Length, Values::NotNegative).optional("0"),
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(numbers.vector(), numbers.vector(), numbers.number(), numbers.number())?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.color)?;
        line.vector(self.position)?;
        match (self.radius, self.reach) {
            (0.0, 0.0) => Ok(()),
            (radius, 0.0) => line.number(radius),
            (radius, reach) => line.number(radius).and_then(|()| line.number(reach)),
        }
    }
}
