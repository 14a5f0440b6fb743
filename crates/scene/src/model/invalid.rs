//! Why a value cannot be built, and the checks that say so.

use std::fmt;

use glam::DVec3;

/// Why a value cannot be part of a scene or of an animation's settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidValue {
    /// A component is infinite or not a number.
    #[error("{0} must be finite")]
    NotFinite(Parameter),
    /// A length that must be positive is zero or negative.
    #[error("{0} must be greater than zero")]
    NotPositive(Parameter),
    /// A direction has no length.
    #[error("{0} must not be zero")]
    ZeroDirection(Parameter),
    /// Gaze and view-up span no plane.
    #[error("the gaze and the view-up must not be parallel")]
    GazeParallelToUp,
    /// The window has no width: au equals bu.
    #[error("the window must not be empty: au equals bu")]
    EmptyWindowWidth,
    /// The window has no height: av equals bv.
    #[error("the window must not be empty: av equals bv")]
    EmptyWindowHeight,
    /// A count is zero.
    #[error("{0} must be at least 1")]
    Zero(Parameter),
    /// A number is not one of the whole numbers of a range.
    #[error("{0} must be a whole number from {1} to {2}")]
    NotWhole(Parameter, u32, u32),
    /// A number lies outside the range that makes sense for it.
    #[error("{0} must be from {1} to {2}")]
    OutOfRange(Parameter, f64, f64),
    /// A triangle or a box was given a mirror coefficient, which the language has for spheres only.
    #[error("only a sphere can have a mirror coefficient")]
    MirrorOnFlat,
}

impl InvalidValue {
    /// Whether it is about the number `name` of a parameter.
    pub(crate) fn is_about(self, parameter: Parameter, name: &str) -> bool {
        match self {
            Self::NotFinite(about)
            | Self::NotPositive(about)
            | Self::ZeroDirection(about)
            | Self::Zero(about)
            | Self::NotWhole(about, ..)
            | Self::OutOfRange(about, ..) => about == parameter,
            Self::GazeParallelToUp => matches!(parameter, Parameter::Gaze | Parameter::Up),
            Self::EmptyWindowWidth => matches!(name, "au" | "bu"),
            Self::EmptyWindowHeight => matches!(name, "av" | "bv"),
            Self::MirrorOnFlat => parameter == Parameter::Mirror,
        }
    }
}

/// All that is wrong with the numbers of a line.
#[derive(Debug, PartialEq)]
pub(crate) struct Faults(pub(crate) Vec<InvalidValue>);

impl From<InvalidValue> for Faults {
    fn from(fault: InvalidValue) -> Self {
        Self(vec![fault])
    }
}

/// What is allowed, but hardly meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Doubt {
    /// A triangle without area is never hit.
    DegenerateTriangle,
}

impl Doubt {
    /// What it is about.
    pub(crate) fn parameter(self) -> Parameter {
        match self {
            Self::DegenerateTriangle => Parameter::Vertex,
        }
    }
}

/// What an [`InvalidValue`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// nx of `Screen`.
    ScreenWidth,
    /// ny of `Screen`.
    ScreenHeight,
    /// Colour of a ray that hits nothing.
    Background,
    /// Where the rays of a pinhole camera start.
    Eye,
    /// Direction of the camera's gaze.
    Gaze,
    /// The camera's view-up.
    Up,
    /// Distance of the camera's window from the eye.
    WindowDistance,
    /// Corner (au, av) or (bu, bv) of the camera's window.
    WindowCorner,
    /// Radius of a sphere.
    Radius,
    /// Centre of a sphere.
    Center,
    /// A corner of a triangle.
    Vertex,
    /// A corner of a box.
    Corner,
    /// What a surface shows without light.
    Ambient,
    /// What a surface scatters.
    Diffuse,
    /// What a surface mirrors.
    Mirror,
    /// Colour of a light.
    LightColor,
    /// The direction in which a light travels.
    LightDirection,
    /// How many frames an animation waits for.
    FrameCount,
    /// Frames a second.
    FrameRate,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ScreenWidth => "the width nx",
            Self::ScreenHeight => "the height ny",
            Self::Background => "the background",
            Self::Eye => "the eye",
            Self::Gaze => "the gaze",
            Self::Up => "the view-up",
            Self::WindowDistance => "the window's distance s",
            Self::WindowCorner => "the window's corner",
            Self::Radius => "the radius",
            Self::Center => "the centre",
            Self::Vertex => "the vertex",
            Self::Corner => "the corner",
            Self::Ambient => "the ambient coefficient",
            Self::Diffuse => "the diffuse coefficient",
            Self::Mirror => "the mirror coefficient",
            Self::LightColor => "the light's colour",
            Self::LightDirection => "the light's direction",
            Self::FrameCount => "`frames`",
            Self::FrameRate => "`fps`",
        })
    }
}

pub(super) fn finite(name: Parameter, v: DVec3) -> Result<DVec3, InvalidValue> {
    if v.is_finite() { Ok(v) } else { Err(InvalidValue::NotFinite(name)) }
}

pub(super) fn positive(name: Parameter, x: f64) -> Result<f64, InvalidValue> {
    if !x.is_finite() {
        Err(InvalidValue::NotFinite(name))
    } else if x > 0.0 {
        Ok(x)
    } else {
        Err(InvalidValue::NotPositive(name))
    }
}

pub(super) fn direction(name: Parameter, v: DVec3) -> Result<DVec3, InvalidValue> {
    finite(name, v)?;
    if v == DVec3::ZERO { Err(InvalidValue::ZeroDirection(name)) } else { Ok(v) }
}
