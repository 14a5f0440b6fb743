//! `animation.json`: the settings of a folder's animation.
//!
//! ```
//! use rayfold_scene::parse_settings;
//!
//! let parsed = parse_settings("animation.json", br#"{"fps": 25}"#);
//! let settings = parsed.settings.unwrap();
//! assert_eq!((settings.frames(), settings.fps(), settings.loops()), (None, 25.0, 0));
//! ```

use std::fmt;
use std::ops::RangeInclusive;

use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::model::{InvalidValue, Parameter};
use crate::report::{BYTE_ORDER_MARK, Fault, Line, Report};
use crate::shown::quoted;

const FIELDS: [&str; 3] = ["frames", "fps", "loop"];

/// The settings of an animation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Fields", into = "Fields")]
pub struct AnimationSettings {
    frames: Option<u64>,
    fps: f64,
    loops: u16,
}

/// The fields in the JSON file.
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
    /// The default frame rate per second.
    pub const DEFAULT_FPS: f64 = 10.0;
    /// The allowed frame rates. A frame of a hundred seconds is a slide, and no animation format can time a
    /// thousandth of a second.
    pub const FPS: RangeInclusive<f64> = 0.01..=1000.0;

    /// Makes settings. `frames` is the expected number of frames, or `None` for the existing ones. `fps` is the frame
    /// rate. `loops` is the number of repetitions, 0 for endless.
    ///
    /// # Errors
    /// Fails if `frames` is 0 or `fps` is outside of [`AnimationSettings::FPS`].
    pub fn new(frames: Option<u64>, fps: f64, loops: u16) -> Result<Self, InvalidValue> {
        if frames == Some(0) {
            return Err(InvalidValue::Zero(Parameter::FrameCount));
        }
        if !Self::FPS.contains(&fps) {
            return Err(InvalidValue::OutOfRange(Parameter::FrameRate, *Self::FPS.start(), *Self::FPS.end()));
        }
        Ok(Self { frames, fps, loops })
    }

    /// Returns the expected number of frames, or `None` for the existing ones.
    pub fn frames(&self) -> Option<u64> {
        self.frames
    }

    /// Returns the number of frames per second.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// Returns the number of repetitions, 0 for endless.
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

/// The result of parsing settings.
#[derive(Clone, Debug)]
pub struct ParsedSettings {
    /// The settings; `None` if and only if there is an error.
    pub settings: Option<AnimationSettings>,
    /// All errors in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
}

/// Parses the text of an `animation.json`. `name` is its name in diagnostics.
pub fn parse_settings(name: &str, bytes: &[u8]) -> ParsedSettings {
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let mut report = Report::new(name, Limits::DESCRIBED);
    let settings = match std::str::from_utf8(text) {
        Ok(text) => settings(text, &mut report),
        Err(error) => {
            let (line, start) = Line::around(text, error.valid_up_to());
            let end = error.error_len().map_or(line.bytes.len(), |length| start + length);
            report.error(line, start..end, || Fault::not_utf8(line, start..end, "settings"));
            None
        }
    };
    let mut diagnostics = report.finish();
    let skipped = bytes.len() - text.len();
    for Diagnostic { span, .. } in &mut diagnostics {
        *span = span.start + skipped..span.end + skipped;
    }
    ParsedSettings { settings, diagnostics }
}

fn settings(text: &str, report: &mut Report<'_>) -> Option<AnimationSettings> {
    let entries = match serde_json::from_str::<Entries<'_>>(text) {
        Ok(entries) => entries.0,
        Err(error) => {
            malformed(text, &error, report);
            return None;
        }
    };
    let mut fields = Fields::default();
    let mut seen: Vec<String> = Vec::new();
    for (key, value) in entries {
        let name: String = serde_json::from_str(key.get()).unwrap_or_default();
        if seen.contains(&name) {
            tell(text, key, report, || {
                Fault::new(Code::DuplicateField, format!("{} is set twice", quoted(&name)))
                    .expected("expected each field at most once")
            });
            continue;
        }
        let fault = match name.as_str() {
            "frames" => whole(value, 1..=u64::MAX).map(|frames| fields.frames = Some(frames)),
            "loop" => whole(value, 0..=u16::MAX.into()).map(|loops| fields.loops = loops as u16),
            "fps" => rate(value).map(|fps| fields.fps = fps),
            _ => {
                tell(text, key, report, || unknown(&name));
                Ok(())
            }
        };
        if let Err(expected) = fault {
            tell(text, value, report, || {
                let value = value.get().lines().next().unwrap_or_default();
                Fault::new(Code::InvalidField, format!("`{name}` cannot be {}", quoted(value)))
                    .expected(expected)
            });
        }
        seen.push(name);
    }
    if report.has_errors() { None } else { fields.try_into().ok() }
}

/// Returns the whole number in `value`, or a description of the allowed ones.
fn whole(value: &RawValue, range: RangeInclusive<u64>) -> Result<u64, String> {
    let number = serde_json::from_str(value.get()).ok().filter(|number| range.contains(number));
    number.ok_or_else(|| match range.into_inner() {
        (least, u64::MAX) => format!("expected a whole number from {least}"),
        (least, most) => format!("expected a whole number from {least} to {most}"),
    })
}

/// Returns the frame rate in `value`, or a description of the allowed ones.
fn rate(value: &RawValue) -> Result<f64, String> {
    let number = serde_json::from_str(value.get()).ok().filter(|fps| AnimationSettings::FPS.contains(fps));
    let (least, most) = AnimationSettings::FPS.into_inner();
    number.ok_or_else(|| format!("expected a number from {least} to {most}"))
}

fn unknown(name: &str) -> Fault {
    let near = |field: &&&str| name.len() < 40 && strsim::osa_distance(&name.to_lowercase(), field) <= 2;
    let help = match FIELDS.iter().find(near) {
        Some(field) => format!("did you mean `{field}`?"),
        None => format!("the fields are `{}`", FIELDS.join("`, `")),
    };
    Fault::new(Code::UnknownField, format!("unknown field {}", quoted(name)))
        .expected("expected a field's name")
        .help(help)
}

/// Reports a fault about `part` of `text`.
fn tell(text: &str, part: &RawValue, report: &mut Report<'_>, fault: impl FnOnce() -> Fault) {
    let offset = part.get().as_ptr().addr() - text.as_ptr().addr();
    let (line, start) = Line::around(text.as_bytes(), offset);
    let end = (start + part.get().len()).min(line.bytes.len());
    report.error(line, start..end, fault);
}

fn malformed(text: &str, error: &serde_json::Error, report: &mut Report<'_>) {
    let offset = if error.is_eof() {
        text.len()
    } else {
        let line_start: usize =
            text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
        text.floor_char_boundary(line_start + error.column().saturating_sub(1))
    };
    let (line, start) = Line::around(text.as_bytes(), offset);
    let length = text[offset..].chars().next().filter(|c| *c != '\n').map_or(0, char::len_utf8);
    report.error(line, start..start + length, || {
        let message = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        let message = message.strip_suffix(&place).unwrap_or(&message);
        Fault::new(Code::MalformedSettings, format!("this is not a JSON object: {message}"))
            .expected("expected settings such as {\"fps\": 25}")
    });
}

/// The fields of a JSON object in the order of the text, with their places.
struct Entries<'a>(Vec<(&'a RawValue, &'a RawValue)>);

impl<'de> Deserialize<'de> for Entries<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Object;

        impl<'de> Visitor<'de> for Object {
            type Value = Entries<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries<'de>, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Entries(entries))
            }
        }

        deserializer.deserialize_map(Object)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expect: Option<AnimationSettings>) {
        let parsed = parse_settings("animation.json", text.as_bytes());
        assert_eq!(parsed.settings, expect, "{text}");
        assert_eq!(parsed.diagnostics.is_empty(), expect.is_some(), "{text}: {:?}", parsed.diagnostics);
        if expect.is_some() {
            assert_eq!(serde_json::from_str(text).ok(), expect, "{text} means the same without diagnostics");
        }
    }

    fn settings(frames: Option<u64>, fps: f64, loops: u16) -> Option<AnimationSettings> {
        Some(AnimationSettings::new(frames, fps, loops).unwrap())
    }

    #[test]
    fn fields_have_defaults() {
        check("{}", settings(None, 10.0, 0));
        check(r#"{"loop": 65535, "fps": 12.5, "frames": 50}"#, settings(Some(50), 12.5, 65535));
        check(r#"{"\u0066ps": 1e1}"#, settings(None, 10.0, 0));
    }

    #[test]
    fn bounds_of_fields() {
        check(r#"{"frames": 1}"#, settings(Some(1), 10.0, 0));
        check(r#"{"frames": 18446744073709551615}"#, settings(Some(u64::MAX), 10.0, 0));
        check(r#"{"fps": 0.01}"#, settings(None, 0.01, 0));
        check(r#"{"fps": 1000}"#, settings(None, 1000.0, 0));
        for value in ["0", "-1", "1.0", "18446744073709551616", "\"1\"", "true", "null", "[1]"] {
            check(&format!(r#"{{"frames": {value}}}"#), None);
        }
        for value in ["65536", "-1", "0.5", "true", "null", "\"for ever\""] {
            check(&format!(r#"{{"loop": {value}}}"#), None);
        }
        for value in ["0", "-10", "0.0099", "1000.1", "1e999", "\"10\"", "null", "NaN", "{}"] {
            check(&format!(r#"{{"fps": {value}}}"#), None);
        }
    }

    #[test]
    fn what_is_no_object_of_known_fields_is_an_error() {
        for text in [
            "",
            "[]",
            "null",
            "10",
            "{",
            "{}}",
            r#"{"fps": 10,}"#,
            r#"{"fbs": 1}"#,
            r#"{"fps": 1, "fps": 1}"#,
        ] {
            check(text, None);
        }
    }

    #[test]
    fn a_byte_order_mark_is_skipped() {
        let parsed = parse_settings("animation.json", "\u{feff}{\"fps\": 25}".as_bytes());
        assert_eq!(parsed.settings, settings(None, 25.0, 0));
    }

    #[test]
    fn a_byte_order_mark_is_no_column() {
        let parsed = parse_settings("animation.json", "\u{feff}}".as_bytes());
        let places: Vec<_> = parsed.diagnostics.iter().map(|d| (d.line, d.column, d.span.clone())).collect();
        assert_eq!(places, [(1, 1, 3..4)]);
    }

    #[test]
    fn what_is_written_reads_back() {
        for settings in [settings(None, 0.1, 3), settings(Some(7), 1000.0 / 3.0, 0)].into_iter().flatten() {
            let text = serde_json::to_string(&settings).unwrap();
            check(&text, Some(settings));
        }
    }
}
