//! Fog: the colour that rays take on over their length.

use std::fmt;

use glam::DVec3;

use super::invalid::{Faults, InvalidValue, Parameter, finite, positive};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};

/// Fog that fills the whole space, or none. Default: none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fog(Option<(DVec3, f64)>);

impl Fog {
    /// Makes fog of a colour. At the `distance`, in world units, the fog's colour makes up 1 - 1/e of a ray's colour.
    ///
    /// # Errors
    /// Fails if the distance is not positive or a number is not finite.
    pub fn new(color: DVec3, distance: f64) -> Result<Self, InvalidValue> {
        finite(Parameter::FogColor, color)?;
        positive(Parameter::FogDistance, distance)?;
        Ok(Self(Some((color, distance))))
    }

    /// Returns the colour, any finite numbers, and the distance in world units, if there is fog.
    pub fn get(self) -> Option<(DVec3, f64)> {
        self.0
    }
}

impl Scripted for Fog {
    const FORM: Form = Form::new(
        "Fog",
        &[
            Field::new(Parameter::FogColor, &["r", "g", "b"], Kind::Color, Values::Any),
            Field::new(Parameter::FogDistance, &["d"], Kind::Length, Values::Positive),
        ],
    )
    .or_word("none");

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        if numbers.is_word() {
            return Ok(Self(None));
        }
        Ok(Self::new(numbers.vector(), numbers.number())?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        match self.0 {
            Some((color, distance)) => {
                line.vector(color)?;
                line.number(distance)
            }
            None => line.word("none"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fog_has_a_finite_colour_and_a_distance() {
        assert_eq!(Fog::new(DVec3::NAN, 1.0), Err(InvalidValue::NotFinite(Parameter::FogColor)));
        for none in [0.0, -1.0] {
            assert_eq!(Fog::new(DVec3::ONE, none), Err(InvalidValue::NotPositive(Parameter::FogDistance)));
        }
        assert_eq!(Fog::new(DVec3::splat(-2.0), 3.0).unwrap().get(), Some((DVec3::splat(-2.0), 3.0)));
    }
}
