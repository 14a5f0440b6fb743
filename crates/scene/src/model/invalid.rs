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
    /// A number that must not be negative is.
    #[error("{0} must not be negative")]
    Negative(Parameter),
    /// A number is below the least that it may be.
    #[error("{0} must be at least {1}")]
    TooSmall(Parameter, f64),
    /// The ends of an axis are the same.
    #[error("the ends of the axis must differ")]
    NoAxis,
    /// A cone has no radius at either end.
    #[error("the radii must not both be zero")]
    NoRadius,
    /// The tube of a torus is as thick as its circle is wide.
    #[error("the thickness r must be less than the radius R")]
    ThickTorus,
    /// A camera looks at the place where it is.
    #[error("the eye and the target must differ")]
    NoGaze,
    /// The last frame comes before the first.
    #[error("the first frame must not be behind the last")]
    FramesBackwards,
    /// A gradient has no width.
    #[error("the ends of the gradient must differ")]
    EmptyGradient,
}

impl InvalidValue {
    /// Whether it is about the number `name` of a parameter.
    pub(crate) fn is_about(self, parameter: Parameter, name: &str) -> bool {
        match self {
            Self::NotFinite(about)
            | Self::NotPositive(about)
            | Self::ZeroDirection(about)
            | Self::Negative(about)
            | Self::TooSmall(about, _)
            | Self::Zero(about)
            | Self::NotWhole(about, ..)
            | Self::OutOfRange(about, ..) => about == parameter,
            Self::GazeParallelToUp => matches!(parameter, Parameter::Gaze | Parameter::Up),
            Self::EmptyWindowWidth => matches!(name, "au" | "bu"),
            Self::EmptyWindowHeight => matches!(name, "av" | "bv"),
            Self::NoAxis => parameter == Parameter::AxisEnd,
            Self::NoRadius => matches!(parameter, Parameter::RadiusA | Parameter::RadiusB),
            Self::ThickTorus => parameter == Parameter::Thickness,
            Self::NoGaze => parameter == Parameter::Target,
            Self::FramesBackwards => matches!(parameter, Parameter::FirstFrame | Parameter::LastFrame),
            Self::EmptyGradient => matches!(parameter, Parameter::GradientStart | Parameter::GradientEnd),
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
pub(crate) enum Lint {
    /// A triangle without area is never hit.
    DegenerateTriangle,
}

impl Lint {
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
    /// Where a camera looks.
    Target,
    /// A camera's vertical angle of view.
    FieldOfView,
    /// Radius of a lens.
    LensRadius,
    /// The distance at which a lens is sharp.
    FocusDistance,
    /// Rays a pixel.
    Samples,
    /// The error that a picture may have.
    SamplingError,
    /// How long the shutter is open.
    Shutter,
    /// Bounces that are followed.
    Depth,
    /// A point of a plane.
    PlanePoint,
    /// What a flat or round thing is square to.
    Normal,
    /// An end of an axis.
    AxisEnd,
    /// Radius of a cone at a.
    RadiusA,
    /// Radius of a cone at b.
    RadiusB,
    /// Radius of a torus's tube.
    Thickness,
    /// Where a group is drawn.
    Translation,
    /// How a group is turned.
    Rotation,
    /// How a group is scaled.
    Scale,
    /// The angle that a sun spans.
    SunAngle,
    /// Where a lamp is.
    LampPosition,
    /// Radius of a lamp.
    LampRadius,
    /// The distance at which a lamp's colour arrives.
    Reach,
    /// Colour of a highlight.
    Shine,
    /// How sharp a highlight is.
    ShineExponent,
    /// What glass lets through.
    Glass,
    /// Index of refraction.
    Ior,
    /// Size of a pattern's cells.
    CellSize,
    /// Where a gradient starts.
    GradientStart,
    /// Where a gradient ends.
    GradientEnd,
    /// From a colour to the levels of a pixel.
    Tone,
    /// The number of the first frame.
    FirstFrame,
    /// The number of the last frame.
    LastFrame,
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
            Self::Target => "the target",
            Self::FieldOfView => "the field of view",
            Self::LensRadius => "the lens's radius",
            Self::FocusDistance => "the lens's distance",
            Self::Samples => "the number of samples",
            Self::SamplingError => "the error e",
            Self::Shutter => "the shutter",
            Self::Depth => "the depth",
            Self::PlanePoint => "the point",
            Self::Normal => "the normal",
            Self::AxisEnd => "the axis's end",
            Self::RadiusA => "the radius Ra",
            Self::RadiusB => "the radius Rb",
            Self::Thickness => "the thickness r",
            Self::Translation => "the translation",
            Self::Rotation => "the rotation",
            Self::Scale => "the scale",
            Self::SunAngle => "the sun's angle",
            Self::LampPosition => "the lamp's position",
            Self::LampRadius => "the lamp's radius",
            Self::Reach => "the lamp's reach",
            Self::Shine => "the shine",
            Self::ShineExponent => "the exponent n",
            Self::Glass => "the glass coefficient",
            Self::Ior => "the index of refraction",
            Self::CellSize => "the size s",
            Self::GradientStart => "the start a",
            Self::GradientEnd => "the end b",
            Self::Tone => "the tone",
            Self::FirstFrame => "the first frame a",
            Self::LastFrame => "the last frame b",
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

pub(super) fn not_negative(name: Parameter, x: f64) -> Result<f64, InvalidValue> {
    if !x.is_finite() {
        Err(InvalidValue::NotFinite(name))
    } else if x >= 0.0 {
        Ok(x)
    } else {
        Err(InvalidValue::Negative(name))
    }
}

pub(super) fn direction(name: Parameter, v: DVec3) -> Result<DVec3, InvalidValue> {
    finite(name, v)?;
    if v == DVec3::ZERO { Err(InvalidValue::ZeroDirection(name)) } else { Ok(v) }
}
