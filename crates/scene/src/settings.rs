//! `animation.json`: what a folder of scripts says about its animation as a whole.
//!
//! ```
//! use rayfold_scene::parse_settings;
//!
//! let parsed = parse_settings("animation.json", br#"{"fps": 25}"#);
//! let settings = parsed.settings.unwrap();
//! assert_eq!((settings.frames(), settings.fps(), settings.loops()), (None, 25.0, 0));
//! ```

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::diagnostic::{Code, Diagnostic, Excerpt, Severity};
use crate::model::{InvalidValue, Parameter};

/// How the frames of a folder become an animation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, try_from = "Fields", into = "Fields")]
pub struct AnimationSettings {
    frames: Option<u64>,
    fps: f64,
    loops: u16,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Fields {
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<u64>,
    fps: f64,
    #[serde(rename = "loop")]
    loops: u16,
}

impl AnimationSettings {
    /// Frames a second unless something else is asked for.
    pub const DEFAULT_FPS: f64 = 10.0;
    /// A frame of a hundred seconds is a slide; a thousandth of one is beyond what any animation format can time.
    pub const FPS: RangeInclusive<f64> = 0.01..=1000.0;

    /// `frames` is how many frames to wait for, `None` for those that are there; `fps` frames a second; `loops` how
    /// often the animation is repeated, 0 for ever.
    ///
    /// # Errors
    /// When `frames` is 0 or `fps` lies outside [`AnimationSettings::FPS`].
    pub fn new(frames: Option<u64>, fps: f64, loops: u16) -> Result<Self, InvalidValue> {
        if frames == Some(0) {
            return Err(InvalidValue::Zero(Parameter::FrameCount));
        }
        if !Self::FPS.contains(&fps) {
            return Err(InvalidValue::OutOfRange(Parameter::FrameRate, *Self::FPS.start(), *Self::FPS.end()));
        }
        Ok(Self { frames, fps, loops })
    }

    /// How many frames to wait for; `None` for those that are there.
    pub fn frames(&self) -> Option<u64> {
        self.frames
    }

    /// Frames a second.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// How often the animation is repeated, 0 for ever.
    pub fn loops(&self) -> u16 {
        self.loops
    }
}

impl Default for AnimationSettings {
    fn default() -> Self {
        Self { frames: None, fps: Self::DEFAULT_FPS, loops: 0 }
    }
}

impl Default for Fields {
    fn default() -> Self {
        AnimationSettings::default().into()
    }
}

impl TryFrom<Fields> for AnimationSettings {
    type Error = InvalidValue;

    fn try_from(fields: Fields) -> Result<Self, InvalidValue> {
        Self::new(fields.frames, fields.fps, fields.loops)
    }
}

impl From<AnimationSettings> for Fields {
    fn from(settings: AnimationSettings) -> Self {
        Self { frames: settings.frames, fps: settings.fps, loops: settings.loops }
    }
}

/// What the text of settings turned out to be.
#[derive(Clone, Debug)]
pub struct ParsedSettings {
    /// The settings; `None` exactly when there is an error.
    pub settings: Option<AnimationSettings>,
    /// All errors in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
}

/// Parses the text of an `animation.json`; `name` is what diagnostics call it.
pub fn parse_settings(name: &str, bytes: &[u8]) -> ParsedSettings {
    match serde_json::from_slice::<AnimationSettings>(bytes) {
        Ok(settings) => ParsedSettings { settings: Some(settings), diagnostics: Vec::new() },
        Err(error) => ParsedSettings {
            settings: None,
            diagnostics: vec![Diagnostic {
                severity: Severity::Error,
                code: Code::MalformedSettings,
                file: name.to_string(),
                line: error.line(),
                column: error.column(),
                span: 0..0,
                message: error.to_string(),
                expected: None,
                help: None,
                excerpt: Excerpt::default(),
            }],
        },
    }
}
