//! Indirect light: light from one surface to another.

use std::fmt;

use super::invalid::{Faults, InvalidValue, Parameter};
use super::screen::whole;
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Unit, Values};

/// The largest number of diffuse reflections of a ray, from 0 to 16. It takes effect in pictures of several rays per
/// pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Indirect(u32);

impl Indirect {
    /// The largest number that is allowed.
    pub const MOST: u32 = 16;

    /// Makes a setting.
    ///
    /// # Errors
    /// Fails if it is more than [`Self::MOST`].
    pub fn new(bounces: u32) -> Result<Self, InvalidValue> {
        if bounces <= Self::MOST {
            Ok(Self(bounces))
        } else {
            Err(InvalidValue::NotWhole(Parameter::Indirect, 0, Self::MOST))
        }
    }

    /// Returns the number of diffuse reflections.
    pub fn bounces(self) -> u32 {
        self.0
    }
}

impl Scripted for Indirect {
    const FORM: Form = Form::new(
        "Indirect",
        &[Field::new(Parameter::Indirect, &["n"], Kind::Count(Unit::Bounces), Values::Whole(0, Self::MOST))],
    )
    .fixed();

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(whole(Parameter::Indirect, 0, Self::MOST, numbers.number())?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.0.into())
    }
}
