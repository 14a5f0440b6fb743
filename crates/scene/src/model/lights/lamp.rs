//! Lamps: lights at a place.

use std::fmt;

use glam::DVec3;

use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};
use crate::model::invalid::{Faults, InvalidValue, Parameter, finite, not_negative};

/// A light at a place: a point, or a ball whose points all shine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    color: DVec3,
    position: DVec3,
    radius: f64,
    reach: f64,
}

impl Lamp {
    /// A ball around `position` of the given `radius`, 0 for a point. With a `reach` greater than 0 the colour is what
    /// arrives at that distance, and the light falls off with the square of the distance; with 0 it does not.
    ///
    /// # Errors
    /// When the radius or the reach is negative, or a number is not finite.
    pub fn new(color: DVec3, position: DVec3, radius: f64, reach: f64) -> Result<Self, InvalidValue> {
        finite(Parameter::LightColor, color)?;
        finite(Parameter::LampPosition, position)?;
        not_negative(Parameter::LampRadius, radius)?;
        not_negative(Parameter::Reach, reach)?;
        Ok(Self { color, position, radius, reach })
    }

    /// Its colour, any finite numbers.
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// The middle of the ball.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Of the ball; 0 for a point.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The distance at which its colour arrives; 0 where it arrives at all distances alike.
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
