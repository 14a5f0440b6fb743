//! Sampling and display: the samples over a pixel, the lens and the exposure time, and the conversion to levels.

use std::fmt;

use super::invalid::{Faults, InvalidValue, Parameter, not_negative};
use super::screen::whole;
use crate::form::{Constraint, Field, Form, Kind, Line, Numbers, Scripted, Unit, Values};

/// The largest number of rays per pixel, and the error at which sampling stops earlier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Samples {
    most: u32,
    error: f64,
}

impl Samples {
    /// Makes a setting of at most `most` rays per pixel. Fewer are used where the image's error is estimated to be
    /// below `error`, the root mean square in levels (0..255). With an error of 0, all rays are used. With one ray, it
    /// goes through the pixel's centre, as in language version 1.
    ///
    /// # Errors
    /// Fails if there is no ray, or the error is negative or not finite.
    pub fn new(most: u32, error: f64) -> Result<Self, InvalidValue> {
        if most == 0 {
            return Err(InvalidValue::Zero(Parameter::Samples));
        }
        not_negative(Parameter::SamplingError, error)?;
        Ok(Self { most, error })
    }

    /// Returns the largest number of rays per pixel, at least 1.
    pub fn most(self) -> u32 {
        self.most
    }

    /// Returns the error in levels.
    pub fn error(self) -> f64 {
        self.error
    }
}

impl Scripted for Samples {
    const FORM: Form = Form::new(
        "Samples",
        &[
            Field::new(Parameter::Samples, &["n"], Kind::Count(Unit::Rays), Values::Whole(1, u32::MAX)),
            Field::new(Parameter::SamplingError, &["e"], Kind::Error, Values::NotNegative).optional("1"),
        ],
    )
    .fixed();

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let most = whole(Parameter::Samples, 1, u32::MAX, numbers.number());
        let error = numbers.optional_number().unwrap_or(Self::default().error);
        match (most, not_negative(Parameter::SamplingError, error)) {
            (Ok(most), Ok(error)) => Ok(Self::new(most, error)?),
            (most, error) => Err(Faults(most.err().into_iter().chain(error.err()).collect())),
        }
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.most.into())?;
        if *self == (Self { most: self.most, ..Self::default() }) { Ok(()) } else { line.number(self.error) }
    }
}

/// The default is one ray per pixel.
impl Default for Samples {
    fn default() -> Self {
        Self { most: 1, error: 1.0 }
    }
}

/// The share of a frame's time that the shutter is open, from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shutter(f64);

impl Shutter {
    /// Makes a shutter setting.
    ///
    /// # Errors
    /// Fails if the share is not from 0 to 1.
    pub fn new(open: f64) -> Result<Self, InvalidValue> {
        if (0.0..=1.0).contains(&open) {
            Ok(Self(open))
        } else {
            Err(InvalidValue::OutOfRange(Parameter::Shutter, 0.0, 1.0))
        }
    }

    /// Returns the share, from 0 to 1.
    pub fn open(self) -> f64 {
        self.0
    }
}

impl Scripted for Shutter {
    const FORM: Form =
        Form::new("Shutter", &[Field::new(Parameter::Shutter, &["f"], Kind::Plain, Values::Share)]).fixed();

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(numbers.number())?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.0)
    }
}

/// The conversion of a colour to the levels of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Colours are display values.
    #[default]
    Plain,
    /// Colours are linear light, which the sRGB curve encodes.
    Srgb,
}

impl Tone {
    /// The words of the tones, in the order of the numbers that represent them.
    const WORDS: &[&str] = &["plain", "srgb"];

    /// Returns the channel of a colour that becomes this level of a pixel, in 0..=1: a share of 255, and with
    /// [`Self::Srgb`] linear light (IEC 61966-2-1).
    pub fn light(self, level: u8) -> f64 {
        let share = f64::from(level) / 255.0;
        match self {
            Self::Plain => share,
            Self::Srgb if share <= 0.040_45 => share / 12.92,
            Self::Srgb => libm::pow((share + 0.055) / 1.055, 2.4),
        }
    }

    /// Returns the share of the highest level that shows light from 0 to 1. It is the inverse of [`Self::light`].
    pub fn encoded(self, light: f64) -> f64 {
        match self {
            Self::Plain => light,
            Self::Srgb if light <= 0.003_130_8 => 12.92 * light,
            Self::Srgb => 1.055 * libm::pow(light, 1.0 / 2.4) - 0.055,
        }
    }
}

impl Scripted for Tone {
    const FORM: Form =
        Form::new("Tone", &[Field::new(Parameter::Tone, &["tone"], Kind::Word, Values::OneOf(Self::WORDS))])
            .fixed();

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(if numbers.number() == 0.0 { Self::Plain } else { Self::Srgb })
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.word(match self {
            Self::Plain => Self::WORDS[0],
            Self::Srgb => Self::WORDS[1],
        })
    }
}

/// The largest number of reflections and refractions of a ray, from 0 to 64.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Depth(u32);

impl Depth {
    /// The largest depth that is allowed.
    pub const MOST: u32 = 64;

    /// Makes a depth.
    ///
    /// # Errors
    /// Fails if it is more than [`Self::MOST`].
    pub fn new(bounces: u32) -> Result<Self, InvalidValue> {
        if bounces <= Self::MOST {
            Ok(Self(bounces))
        } else {
            Err(InvalidValue::NotWhole(Parameter::Depth, 0, Self::MOST))
        }
    }

    /// Returns the number of bounces.
    pub fn bounces(self) -> u32 {
        self.0
    }
}

impl Scripted for Depth {
    const FORM: Form = Form::new(
        "Depth",
        &[Field::new(Parameter::Depth, &["n"], Kind::Count(Unit::Bounces), Values::Whole(0, Self::MOST))],
    )
    .fixed();

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        Ok(Self::new(whole(Parameter::Depth, 0, Self::MOST, numbers.number())?)?)
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.0.into())
    }
}

/// The default is that of language version 1.
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
    /// Makes a lens: a disc of this `radius` around the eye, perpendicular to the view direction. It is in focus at
    /// this `distance` along the view direction. Default: the camera's own distance ([`super::Camera`]).
    ///
    /// # Errors
    /// Fails if the radius is negative, the distance is not positive, or a number is not finite.
    pub fn new(radius: f64, distance: Option<f64>) -> Result<Self, InvalidValue> {
        not_negative(Parameter::LensRadius, radius)?;
        if let Some(distance) = distance {
            super::invalid::positive(Parameter::FocusDistance, distance)?;
        }
        Ok(Self { radius, distance })
    }

    /// Returns the radius, which is 0 for a pinhole.
    pub fn radius(self) -> f64 {
        self.radius
    }

    /// Returns the focus distance along the view direction, or `None` for the camera's own distance.
    pub fn distance(self) -> Option<f64> {
        self.distance
    }
}

impl Scripted for Lens {
    const FORM: Form = Form::new(
        "Lens",
        &[
            Field::new(Parameter::LensRadius, &["radius"], Kind::Length, Values::NotNegative),
            Field::new(Parameter::FocusDistance, &["distance"], Kind::Length, Values::Positive)
                .optional("the target's, or the window's"),
        ],
    );

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let (radius, distance) = (numbers.number(), numbers.optional_number());
        let faults = [
            not_negative(Parameter::LensRadius, radius).err(),
            distance.and_then(|x| super::invalid::positive(Parameter::FocusDistance, x).err()),
        ];
        let faults: Vec<_> = faults.into_iter().flatten().collect();
        if faults.is_empty() { Ok(Self { radius, distance }) } else { Err(Faults(faults)) }
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        line.number(self.radius)?;
        self.distance.map_or(Ok(()), |distance| line.number(distance))
    }
}

/// The frame numbers of a `Trace`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FrameNumbers {
    pub(crate) first: u32,
    pub(crate) last: u32,
}

impl FrameNumbers {
    /// Returns the number of frames.
    pub(crate) fn count(self) -> u64 {
        u64::from(self.last - self.first) + 1
    }
}

impl Scripted for FrameNumbers {
    const FORM: Form = Form::new(
        "Frames",
        &[
            Field::new(Parameter::FirstFrame, &["a"], Kind::Count(Unit::Frames), Values::Whole(1, u32::MAX)),
            Field::new(Parameter::LastFrame, &["b"], Kind::Count(Unit::Frames), Values::Whole(1, u32::MAX))
                .optional("1 to a"),
        ],
    )
    .with(&[Constraint::InOrder(0, 1)])
    .fixed();

    fn read(numbers: &mut Numbers<'_>) -> Result<Self, Faults> {
        let first = whole(Parameter::FirstFrame, 1, u32::MAX, numbers.number());
        let last = numbers.optional_number().map(|x| whole(Parameter::LastFrame, 1, u32::MAX, x));
        match (first, last) {
            (Ok(count), None) => Ok(Self { first: 1, last: count }),
            (Ok(first), Some(Ok(last))) if first <= last => Ok(Self { first, last }),
            (Ok(_), Some(Ok(_))) => Err(InvalidValue::FramesBackwards.into()),
            (first, last) => Err(Faults(first.err().into_iter().chain(last.and_then(Result::err)).collect())),
        }
    }

    fn write(&self, line: &mut Line<'_, '_>) -> fmt::Result {
        if self.first > 1 {
            line.number(self.first.into())?;
        }
        line.number(self.last.into())
    }
}

impl Default for FrameNumbers {
    fn default() -> Self {
        Self { first: 1, last: 1 }
    }
}
