//! What a ray sees that hits nothing.

use std::fmt;

use glam::DVec3;

use super::invalid::{Faults, InvalidValue, Parameter, finite};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};

/// A colour, each channel in 0..=1; black unless it is set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Background(DVec3);

impl Background {
    /// Each channel is clamped to 0..=1, and a zero is without a sign.
    ///
    /// # Errors
    /// When a channel is not finite.
    pub(crate) fn new(color: DVec3) -> Result<Self, InvalidValue> {
        let color = finite(Parameter::Background, color)?;
        Ok(Self(color.clamp(DVec3::ZERO, DVec3::ONE) + 0.0))
    }

    pub(crate) fn color(self) -> DVec3 {
        self.0
    }
}

impl Scripted for Background {
    const FORM: Form = Form::new(
        "Background",
        &[Field::new(Parameter::Background, &["r", "g", "b"], Kind::Color, Values::Clamped)],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(numbers.vector())?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.0)
    }
}
