//! The size of an image.

use std::fmt;

use super::invalid::{Faults, InvalidValue, Parameter};
use crate::form::{Field, Form, Kind, Line, Numbers, Scripted, Unit, Values};

/// The size of an image in pixels, at least 1 x 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Screen {
    width: u32,
    height: u32,
}

impl Screen {
    /// Makes a size.
    ///
    /// # Errors
    /// Fails if a side is zero.
    pub fn new(width: u32, height: u32) -> Result<Self, InvalidValue> {
        if width == 0 {
            return Err(InvalidValue::Zero(Parameter::ScreenWidth));
        }
        if height == 0 {
            return Err(InvalidValue::Zero(Parameter::ScreenHeight));
        }
        Ok(Self { width, height })
    }

    /// Returns the number of columns.
    pub fn width(self) -> u32 {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(self) -> u32 {
        self.height
    }

    /// Returns the number of pixels.
    pub fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

impl Scripted for Screen {
    const FORM: Form = Form::new(
        "Screen",
        &[
            Field::new(
                Parameter::ScreenWidth,
                &["nx"],
                Kind::Count(Unit::Pixels),
                Values::Whole(1, u32::MAX),
            ),
            Field::new(
                Parameter::ScreenHeight,
                &["ny"],
                Kind::Count(Unit::Pixels),
                Values::Whole(1, u32::MAX),
            ),
        ],
    )
    .fixed();

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let [width, height] = [Parameter::ScreenWidth, Parameter::ScreenHeight]
            .map(|side| whole(side, 1, u32::MAX, numbers.number()));
        match (width, height) {
            (Ok(width), Ok(height)) => Ok(Self::new(width, height)?),
            (width, height) => Err(Faults([width, height].into_iter().filter_map(Result::err).collect())),
        }
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.width.into())?;
        line.number(self.height.into())
    }
}

/// Returns the whole number `x` if it is in a range.
pub(super) fn whole(name: Parameter, least: u32, most: u32, x: f64) -> Result<u32, InvalidValue> {
    let fits = x.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&x);
    if fits { Ok(x as u32) } else { Err(InvalidValue::NotWhole(name, least, most)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screen_has_pixels() {
        assert_eq!(Screen::new(0, 1), Err(InvalidValue::Zero(Parameter::ScreenWidth)));
        assert_eq!(Screen::new(1, 0), Err(InvalidValue::Zero(Parameter::ScreenHeight)));
        assert_eq!(Screen::new(u32::MAX, u32::MAX).unwrap().pixels(), 0xffff_fffe_0000_0001);
    }
}
