//! The sky: the light around the scene, as colours without an upper limit or as a picture.

use std::fmt;

use glam::DVec3;

use super::background::Background;
use super::invalid::{Faults, InvalidValue, Parameter, finite, not_negative};
use super::picture_file::PictureFile;
use crate::form::{Field, Form, Kind, Line, Numbers, Quotes, Scripted, Subject, Values};

/// The light that rays see if they hit nothing.
#[derive(Clone, Debug, PartialEq)]
pub enum Sky {
    /// One colour, or two.
    Colors(SkyColors),
    /// A picture all around.
    Picture(PictureFile, SkyTurn),
}

/// One colour, or a gradient between two by the height of the ray direction. Each channel is at least 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyColors {
    low: DVec3,
    high: Option<DVec3>,
}

/// The brightness of a sky's picture, and its rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyTurn {
    strength: f64,
    degrees: f64,
}

impl SkyColors {
    /// Makes a sky of one colour, or of one seen straight down and another seen straight up.
    ///
    /// # Errors
    /// Fails if a channel is negative or not finite.
    pub fn new(low: DVec3, high: Option<DVec3>) -> Result<Self, InvalidValue> {
        let high = high.map(|high| light(Parameter::SkyTop, high)).transpose()?;
        Ok(Self { low: light(Parameter::Sky, low)?, high })
    }

    /// Returns the first colour and, if there is one, the second.
    pub fn colors(self) -> (DVec3, Option<DVec3>) {
        (self.low, self.high)
    }

    /// Returns the colours as a background, which may exceed 1.
    pub(super) fn background(self) -> Background {
        Background::of_light(self.low, self.high)
    }
}

/// Checks the light of a sky, and makes zeros positive.
fn light(name: Parameter, color: DVec3) -> Result<DVec3, InvalidValue> {
    finite(name, color)?;
    for channel in color.to_array() {
        not_negative(name, channel)?;
    }
    Ok(color + 0.0)
}

impl SkyTurn {
    /// Makes it of a factor of the picture's levels, at least 0, and the degrees by which the picture is turned around the y
    /// axis, right-handed.
    ///
    /// # Errors
    /// Fails if the factor is negative, or a number is not finite.
    pub fn new(strength: f64, degrees: f64) -> Result<Self, InvalidValue> {
        not_negative(Parameter::SkyStrength, strength)?;
        if !degrees.is_finite() {
            return Err(InvalidValue::NotFinite(Parameter::SkyTurn));
        }
        Ok(Self { strength: strength + 0.0, degrees: degrees + 0.0 })
    }

    /// Returns the factor of the picture's levels, at least 0.
    pub fn strength(self) -> f64 {
        self.strength
    }

    /// Returns the degrees by which the picture is turned.
    pub fn degrees(self) -> f64 {
        self.degrees
    }
}

impl Scripted for SkyColors {
    const FORM: Form = Form::new(
        "Sky",
        &[
            Field::new(Parameter::Sky, &["r", "g", "b"], Kind::Color, Values::NotNegative),
            Field::new(Parameter::SkyTop, &["R", "G", "B"], Kind::Color, Values::NotNegative)
                .optional("the first colour"),
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(numbers.vector(), numbers.optional_vector())?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.vector(self.low)?;
        self.high.map_or(Ok(()), |high| line.vector(high))
    }
}

impl Scripted for SkyTurn {
    const FORM: Form = Form::new(
        "Sky",
        &[
            Field::new(Parameter::SkyStrength, &["strength"], Kind::Plain, Values::NotNegative).optional("1"),
            Field::new(Parameter::SkyTurn, &["turn"], Kind::Angle, Values::Any).optional("0"),
        ],
    )
    .with_subject(Subject::Quotes(Quotes::File))
    .with_usage("Sky \"FILE\" [strength [turn]]");

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let strength = numbers.optional_number().unwrap_or(1.0);
        Ok(Self::new(strength, numbers.optional_number().unwrap_or(0.0))?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        if (self.strength, self.degrees) != (1.0, 0.0) {
            line.number(self.strength)?;
        }
        if self.degrees != 0.0 { line.number(self.degrees) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_at_least_0_and_has_no_limit() {
        let color = DVec3::new(0.0, 1.0, 1e6);
        assert_eq!(SkyColors::new(color, None).unwrap().colors(), (color, None));
        let negative = SkyColors::new(DVec3::ONE, Some(DVec3::new(0.0, -1.0, 0.0)));
        assert_eq!(negative, Err(InvalidValue::Negative(Parameter::SkyTop)));
        assert_eq!(SkyTurn::new(-1.0, 0.0), Err(InvalidValue::Negative(Parameter::SkyStrength)));
        assert_eq!(SkyTurn::new(1.0, f64::INFINITY), Err(InvalidValue::NotFinite(Parameter::SkyTurn)));
    }
}
