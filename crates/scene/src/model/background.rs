//! The background: the colour of rays that hit nothing.

use std::fmt;

use glam::DVec3;

use super::invalid::{Faults, InvalidValue, Parameter, finite};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Values};

/// One colour, a gradient between two by the height of the ray direction, or none. Each channel is
/// in 0..=1. Default: black.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Background {
    low: DVec3,
    high: Option<DVec3>,
    is_none: bool,
}

impl Background {
    /// No background: the picture is transparent where camera rays hit nothing, directly or through glass. All other
    /// rays see the sky, or black without one.
    pub const NONE: Self = Self { low: DVec3::ZERO, high: None, is_none: true };

    /// Makes a background of one colour. Clamps each channel to 0..=1, and makes zeros positive.
    ///
    /// # Errors
    /// Fails if a channel is not finite.
    pub fn new(color: DVec3) -> Result<Self, InvalidValue> {
        Ok(Self { low: clamped(color)?, high: None, is_none: false })
    }

    /// Makes a background of a fog's colour, whose channels may be any finite numbers.
    pub(super) fn of_fog(color: DVec3) -> Self {
        Self { low: color, high: None, is_none: false }
    }

    /// Makes a background of a sky's light, whose channels are at least 0.
    pub(super) fn of_light(low: DVec3, high: Option<DVec3>) -> Self {
        Self { low, high, is_none: false }
    }

    /// Makes a gradient from one colour, seen straight down, to another, seen straight up.
    ///
    /// # Errors
    /// Fails if a channel is not finite.
    pub fn sky(low: DVec3, high: DVec3) -> Result<Self, InvalidValue> {
        Ok(Self { low: clamped(low)?, high: Some(clamped(high)?), is_none: false })
    }

    /// Returns whether there is none ([`Self::NONE`]).
    pub fn is_none(self) -> bool {
        self.is_none
    }

    /// Returns the colour of all rays, or `None` if it depends on their height.
    pub fn color(self) -> Option<DVec3> {
        if self.high.is_none() { Some(self.low) } else { None }
    }

    /// Returns the first colour and, if there is one, the second.
    pub fn colors(self) -> (DVec3, Option<DVec3>) {
        (self.low, self.high)
    }

    /// Returns the colour in this unit direction: first + (second - first)·(½ + ½·y).
    pub fn along(self, direction: DVec3) -> DVec3 {
        match self.high {
            Some(high) => self.low + (high - self.low) * (0.5 + 0.5 * direction.y),
            None => self.low,
        }
    }
}

/// Clamps each channel to 0..=1, and makes zeros positive.
fn clamped(color: DVec3) -> Result<DVec3, InvalidValue> {
    Ok(finite(Parameter::Background, color)?.clamp(DVec3::ZERO, DVec3::ONE) + 0.0)
}

impl Scripted for Background {
    const FORM: Form = Form::new(
        "Background",
        &[
            Field::new(Parameter::Background, &["r", "g", "b"], Kind::Color, Values::Clamped),
            Field::new(Parameter::Background, &["R", "G", "B"], Kind::Color, Values::Clamped)
                .optional("the first colour"),
        ],
    )
    .or_word("none");

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        if numbers.is_word() {
            return Ok(Self::NONE);
        }
        let low = numbers.vector();
        Ok(match numbers.optional_vector() {
            Some(high) => Self::sky(low, high)?,
            None => Self::new(low)?,
        })
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        if self.is_none {
            return line.word("none");
        }
        line.vector(self.low)?;
        self.high.map_or(Ok(()), |high| line.vector(high))
    }
}

#[cfg(test)]
mod tests {
    use crate::{Limits, parse};

    #[test]
    fn none_lasts_until_a_colour_or_a_clear() {
        let text = "Screen 4 3\nBackground none\nTrace\nBackground .1 .2 .3\nTrace\nBackground NONE\nTrace\nClear\nTrace\n";
        let script = parse("a.txt", text.as_bytes(), &Limits::default()).script.unwrap();
        let clear: Vec<bool> = (0..4).map(|k| script.frame(k).unwrap().background.is_none()).collect();
        assert_eq!(clear, [true, false, true, false]);
        let shots: Vec<bool> = script.shots().map(|shot| shot.is_clear).collect();
        assert_eq!(shots, clear);
        assert_eq!(parse("a.txt", script.to_string().as_bytes(), &Limits::default()).script, Some(script));
        let wrong = parse("a.txt", b"Screen 4 3\nBackground nothing\nTrace\n", &Limits::default());
        assert!(wrong.script.is_none());
    }
}
