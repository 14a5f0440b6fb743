//! The reasons why a value cannot be built, and the checks that return them.

use std::fmt;

use glam::DVec3;

/// The reason why a value cannot be part of a scene or of an animation's settings.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidValue {
    /// A component is infinite or not a number.
    #[error("{0} must be finite")]
    NotFinite(Parameter),
    /// A number that must be positive is zero or negative.
    #[error("{0} must be greater than zero")]
    NotPositive(Parameter),
    /// A direction has no length.
    #[error("{0} must not be zero")]
    ZeroDirection(Parameter),
    /// Gaze and view-up are parallel.
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
    /// A number is not a whole number in the allowed range.
    #[error("{0} must be a whole number from {1} to {2}")]
    NotWhole(Parameter, u32, u32),
    /// A number is outside of its allowed range.
    #[error("{0} must be from {1} to {2}")]
    OutOfRange(Parameter, f64, f64),
    /// A number that must not be negative is negative.
    #[error("{0} must not be negative")]
    Negative(Parameter),
    /// A number is below its minimum.
    #[error("{0} must be at least {1}")]
    TooSmall(Parameter, f64),
    /// The ends of an axis are the same.
    #[error("the ends of the axis must differ")]
    NoAxis,
    /// No file is to be made of an animation, or one twice.
    #[error("the outputs must be one file or more, each once")]
    Outputs,
    /// A cone has radius zero at both ends.
    #[error("the radii must not both be zero")]
    NoRadius,
    /// The tube of a torus is at least as thick as its circle is wide.
    #[error("the thickness r must be less than the radius R")]
    ThickTorus,
    /// The edges of a box are rounded by more than half of its shortest side, which is given.
    #[error("the radius r must be at most half of the shortest side, {0}")]
    TooRound(f64),
    /// Eye and target of a camera are the same.
    #[error("the eye and the target must differ")]
    NoGaze,
    /// The last frame comes before the first.
    #[error("the first frame must not be greater than the last")]
    FramesBackwards,
    /// A gradient has no width.
    #[error("the ends of the gradient must differ")]
    EmptyGradient,
}

impl InvalidValue {
    /// Returns whether it is about the number `name` of a parameter.
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
            // About no parameter of a script.
            Self::Outputs => false,
            Self::NoAxis => parameter == Parameter::AxisEnd,
            Self::NoRadius => matches!(parameter, Parameter::RadiusA | Parameter::RadiusB),
            Self::ThickTorus => parameter == Parameter::Thickness,
            Self::TooRound(_) => parameter == Parameter::Radius,
            Self::NoGaze => parameter == Parameter::Target,
            Self::FramesBackwards => matches!(parameter, Parameter::FirstFrame | Parameter::LastFrame),
            Self::EmptyGradient => matches!(parameter, Parameter::GradientStart | Parameter::GradientEnd),
        }
    }
}

/// All errors in the numbers of a line.
#[derive(Debug, PartialEq)]
pub(crate) struct Faults(pub(crate) Vec<InvalidValue>);

impl From<InvalidValue> for Faults {
    fn from(fault: InvalidValue) -> Self {
        Self(vec![fault])
    }
}

/// A valid value that is probably a mistake; reported as a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lint {
    /// A triangle has no area, so it is never hit.
    DegenerateTriangle,
    /// An object has the radius 0, so it is hidden.
    NoRadius,
}

impl Lint {
    /// Returns whether the lint is about the parameter.
    pub(crate) fn is_about(self, parameter: Parameter) -> bool {
        match self {
            Self::DegenerateTriangle => parameter == Parameter::Vertex,
            Self::NoRadius => {
                matches!(parameter, Parameter::Radius | Parameter::RadiusA | Parameter::RadiusB)
            }
        }
    }
}

/// The parameter that an [`InvalidValue`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// The number nx of `Screen`.
    ScreenWidth,
    /// The number ny of `Screen`.
    ScreenHeight,
    /// The colour of a ray that hits nothing.
    Background,
    /// The light of a sky. If the sky has two colours, the one that is seen straight down.
    Sky,
    /// The light of a sky that is seen straight up.
    SkyTop,
    /// The factor of a sky's picture.
    SkyStrength,
    /// The angle by which a sky's picture is turned.
    SkyTurn,
    /// The origin of a pinhole camera's rays.
    Eye,
    /// The view direction of the camera.
    Gaze,
    /// The camera's view-up direction.
    Up,
    /// The distance of the camera's window from the eye.
    WindowDistance,
    /// The corner (au, av) or (bu, bv) of the camera's window.
    WindowCorner,
    /// The radius of a sphere.
    Radius,
    /// The centre of a sphere.
    Center,
    /// A corner of a triangle.
    Vertex,
    /// A corner of a box.
    Corner,
    /// The colour of a surface without light.
    Ambient,
    /// The diffuse reflectance of a surface.
    Diffuse,
    /// The specular reflectance of a surface.
    Mirror,
    /// The colour of a light.
    LightColor,
    /// The direction in which a light travels.
    LightDirection,
    /// The point that a camera looks at.
    Target,
    /// A camera's vertical angle of view.
    FieldOfView,
    /// The radius of a lens.
    LensRadius,
    /// The distance at which a lens is in focus.
    FocusDistance,
    /// The colour of fog.
    FogColor,
    /// The distance that fog takes to hide most of what is behind it.
    FogDistance,
    /// The number of rays per pixel.
    Samples,
    /// The error that a picture may have.
    SamplingError,
    /// The time that the shutter is open.
    Shutter,
    /// The largest number of bounces.
    Depth,
    /// The largest number of diffuse reflections.
    Indirect,
    /// A point of a plane.
    PlanePoint,
    /// The normal of a flat or round shape.
    Normal,
    /// An end of an axis.
    AxisEnd,
    /// The radius of a cone at a.
    RadiusA,
    /// The radius of a cone at b.
    RadiusB,
    /// The radius of a torus's tube.
    Thickness,
    /// The translation of a group.
    Translation,
    /// The rotation of a group.
    Rotation,
    /// The scale of a group.
    Scale,
    /// The apparent diameter of a sun.
    SunAngle,
    /// The position of a lamp.
    LampPosition,
    /// The radius of a lamp.
    LampRadius,
    /// The distance at which a lamp has its given colour.
    Reach,
    /// The colour of a highlight.
    Shine,
    /// The exponent of a highlight.
    ShineExponent,
    /// The transmittance of glass.
    Glass,
    /// The index of refraction.
    Ior,
    /// The light that a surface gives off.
    Glow,
    /// The roughness of a mirror or of glass.
    Roughness,
    /// The size of a pattern's cells.
    CellSize,
    /// The mapping of a picture onto a surface.
    PictureMap,
    /// The width of a picture on a surface.
    PictureWidth,
    /// The axes of a picture on a surface.
    PictureAxes,
    /// The start of a gradient.
    GradientStart,
    /// The end of a gradient.
    GradientEnd,
    /// The conversion of a colour to the levels of a pixel.
    Tone,
    /// The number of the first frame.
    FirstFrame,
    /// The number of the last frame.
    LastFrame,
    /// The em of letters.
    LetterSize,
    /// The thickness of letters.
    LetterDepth,
    /// The number of frames that an animation waits for.
    FrameCount,
    /// The number of frames per second.
    FrameRate,
    /// A frame of `durations`, in the settings.
    FrameOfDuration,
    /// A time of `durations`, in the settings.
    Duration,
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ScreenWidth => "the width nx",
            Self::ScreenHeight => "the height ny",
            Self::Background => "the background",
            Self::Sky => "the sky",
            Self::SkyTop => "the sky above",
            Self::SkyStrength => "the sky's strength",
            Self::SkyTurn => "the sky's turn",
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
            Self::FogColor => "the fog",
            Self::FogDistance => "the fog's distance d",
            Self::Samples => "the number of samples",
            Self::SamplingError => "the error e",
            Self::Shutter => "the shutter",
            Self::Depth => "the depth",
            Self::Indirect => "the number of diffuse reflections",
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
            Self::Glow => "the glow",
            Self::Roughness => "the roughness a",
            Self::CellSize => "the size s",
            Self::PictureMap => "the mapping",
            Self::PictureWidth => "the width s",
            Self::PictureAxes => "the axes",
            Self::GradientStart => "the start a",
            Self::GradientEnd => "the end b",
            Self::Tone => "the tone",
            Self::FirstFrame => "the first frame a",
            Self::LastFrame => "the last frame b",
            Self::LetterSize => "the size of the letters",
            Self::LetterDepth => "the depth of the letters",
            Self::FrameCount => "`frames`",
            Self::FrameRate => "`fps`",
            Self::FrameOfDuration => "a frame of `durations`",
            Self::Duration => "a time of `durations`",
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
