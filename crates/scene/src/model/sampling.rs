//! What light in a pixel is: how it is sampled in the pixel, the lens and time, and how it is shown.

use super::invalid::{InvalidValue, Parameter, not_negative};

/// How many rays a pixel gets at most, and to which error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Samples {
    most: u32,
    error: f64,
}

impl Samples {
    /// `most` rays a pixel, fewer where the image's error is estimated to be below `error`, the root mean square in
    /// levels (0..255); with an error of 0 always as many. One ray is version 1's: through the pixel's middle.
    ///
    /// # Errors
    /// When there is no ray, or the error is negative or not finite.
    pub fn new(most: u32, error: f64) -> Result<Self, InvalidValue> {
        if most == 0 {
            return Err(InvalidValue::Zero(Parameter::Samples));
        }
        not_negative(Parameter::SamplingError, error)?;
        Ok(Self { most, error })
    }

    /// Rays a pixel, at least 1.
    pub fn most(self) -> u32 {
        self.most
    }

    /// In levels.
    pub fn error(self) -> f64 {
        self.error
    }
}

/// One ray a pixel.
impl Default for Samples {
    fn default() -> Self {
        Self { most: 1, error: 1.0 }
    }
}

/// What share of a frame's time the shutter is open, from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shutter(f64);

impl Shutter {
    /// # Errors
    /// When it is not from 0 to 1.
    pub fn new(open: f64) -> Result<Self, InvalidValue> {
        if (0.0..=1.0).contains(&open) {
            Ok(Self(open))
        } else {
            Err(InvalidValue::OutOfRange(Parameter::Shutter, 0.0, 1.0))
        }
    }

    /// From 0 to 1.
    pub fn open(self) -> f64 {
        self.0
    }
}

/// From a colour to the levels of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Colours are display values.
    #[default]
    Plain,
    /// Colours are linear light, which the sRGB curve encodes.
    Srgb,
}

/// How many mirrorings and refractions are followed, from 0 to 16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Depth(u32);

impl Depth {
    /// The most that can be asked for.
    pub const MOST: u32 = 16;

    /// # Errors
    /// When it is more than [`Self::MOST`].
    pub fn new(bounces: u32) -> Result<Self, InvalidValue> {
        if bounces <= Self::MOST {
            Ok(Self(bounces))
        } else {
            Err(InvalidValue::NotWhole(Parameter::Depth, 0, Self::MOST))
        }
    }

    /// How many.
    pub fn bounces(self) -> u32 {
        self.0
    }
}

/// As in version 1.
impl Default for Depth {
    fn default() -> Self {
        Self(5)
    }
}

/// The lens of a camera that has an eye.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lens {
    radius: f64,
    distance: Option<f64>,
}

impl Lens {
    /// A disc of that `radius` around the eye, square to the gaze, sharp at that `distance` along the gaze; if it is not
    /// given, at the camera's own ([`super::Camera`]).
    ///
    /// # Errors
    /// When the radius is negative, the distance is not positive, or a number is not finite.
    pub fn new(radius: f64, distance: Option<f64>) -> Result<Self, InvalidValue> {
        not_negative(Parameter::LensRadius, radius)?;
        if let Some(distance) = distance {
            super::invalid::positive(Parameter::FocusDistance, distance)?;
        }
        Ok(Self { radius, distance })
    }

    /// 0 for a point.
    pub fn radius(self) -> f64 {
        self.radius
    }

    /// Where it is sharp, along the gaze; `None` for the camera's own distance.
    pub fn distance(self) -> Option<f64> {
        self.distance
    }
}
