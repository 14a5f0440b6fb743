//! `animation.json`: the settings of a folder's animation.
//!
//! ```
//! use rayfold_scene::parse_settings;
//!
//! let parsed = parse_settings("animation.json", br#"{"fps": 25}"#);
//! let settings = parsed.settings.unwrap();
//! assert_eq!((settings.frames(), settings.fps(), settings.loops()), (None, 25.0, 0));
//! ```

use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;

use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::container::Container;
use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::model::{InvalidValue, Parameter};
use crate::report::{BYTE_ORDER_MARK, Fault, Line, Report};
use crate::shown::quoted;

/// The fields of an `animation.json`.
pub const SETTINGS_FIELDS: [&str; 6] = ["frames", "fps", "loop", "bounce", "durations", "outputs"];

/// The settings of an animation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Fields", into = "Fields")]
pub struct AnimationSettings {
    frames: Option<u64>,
    fps: f64,
    loops: u16,
    bounce: bool,
    durations: BTreeMap<u64, f64>,
    outputs: Vec<Container>,
}

/// The fields in the JSON file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Fields {
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<u64>,
    #[serde(deserialize_with = "any_rate")]
    fps: f64,
    #[serde(rename = "loop")]
    loops: u16,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    bounce: bool,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    durations: BTreeMap<u64, f64>,
    #[serde(skip_serializing_if = "is_default")]
    outputs: Vec<Container>,
}

fn is_default(outputs: &Vec<Container>) -> bool {
    outputs == AnimationSettings::DEFAULT_OUTPUTS
}

/// Reads a number, or a fraction such as `"30000/1001"`.
fn any_rate<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Rate {
        Number(f64),
        Fraction(String),
    }
    match Rate::deserialize(deserializer)? {
        Rate::Number(fps) => Ok(fps),
        Rate::Fraction(text) => fraction(&text).ok_or_else(|| serde::de::Error::custom("this is no rate")),
    }
}

/// Returns the value of a fraction of whole numbers, such as `30000/1001`.
pub fn fraction(text: &str) -> Option<f64> {
    let (above, below) = text.split_once('/')?;
    let whole = |text: &str| text.parse::<u32>().ok().filter(|number| *number > 0).map(f64::from);
    Some(whole(above)? / whole(below)?)
}

impl AnimationSettings {
    /// The default frame rate per second.
    pub const DEFAULT_FPS: f64 = 10.0;
    /// The allowed frame rates. A frame of a hundred seconds is a slide, and no animation format can time a
    /// thousandth of a second.
    pub const FPS: RangeInclusive<f64> = 0.01..=1000.0;

    /// The allowed times of a frame in seconds. Players slow down a shorter one, and a GIF can hold no longer one.
    pub const DURATION: RangeInclusive<f64> = 0.02..=655.35;

    /// The files that a bucket makes of an animation by default.
    pub const DEFAULT_OUTPUTS: &[Container] = &[Container::Gif];

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
        Ok(Self { frames, fps, loops, ..Self::default() })
    }

    /// Sets the expected number of frames.
    ///
    /// # Errors
    /// Fails if it is 0.
    pub fn with_frames(self, frames: Option<u64>) -> Result<Self, InvalidValue> {
        Self::new(frames, self.fps, self.loops).map(|of| Self { frames: of.frames, ..self })
    }

    /// Fills in the existing number of frames.
    #[must_use]
    pub fn of_frames(self, frames: u64) -> Self {
        Self { frames: Some(frames).filter(|frames| *frames > 0), ..self }
    }

    /// Sets the frame rate.
    ///
    /// # Errors
    /// Fails if it is outside of [`AnimationSettings::FPS`].
    pub fn with_fps(self, fps: f64) -> Result<Self, InvalidValue> {
        Self::new(self.frames, fps, self.loops).map(|of| Self { fps: of.fps, ..self })
    }

    /// Sets whether the animation runs back after its last frame.
    #[must_use]
    pub fn bouncing(self, bounce: bool) -> Self {
        Self { bounce, ..self }
    }

    /// Sets times of frames in seconds, by frame from 1. The others are shown as the frame rate says.
    ///
    /// # Errors
    /// Fails if a frame is 0 or a time is outside of [`AnimationSettings::DURATION`].
    pub fn with_durations(self, durations: BTreeMap<u64, f64>) -> Result<Self, InvalidValue> {
        if durations.contains_key(&0) {
            return Err(InvalidValue::Zero(Parameter::FrameOfDuration));
        }
        if !durations.values().all(|seconds| Self::DURATION.contains(seconds)) {
            let (least, most) = Self::DURATION.into_inner();
            return Err(InvalidValue::OutOfRange(Parameter::Duration, least, most));
        }
        Ok(Self { durations, ..self })
    }

    /// Sets the files that a bucket makes of the animation, in this order.
    ///
    /// # Errors
    /// Fails if there is none, or if one is named twice.
    pub fn with_outputs(self, outputs: Vec<Container>) -> Result<Self, InvalidValue> {
        let is_twice = |(place, output): (usize, &Container)| outputs[..place].contains(output);
        if outputs.is_empty() || outputs.iter().enumerate().any(is_twice) {
            return Err(InvalidValue::Outputs);
        }
        Ok(Self { outputs, ..self })
    }

    /// Returns the files that a bucket makes of the animation, in this order.
    pub fn outputs(&self) -> &[Container] {
        &self.outputs
    }

    /// Returns whether the animation runs back after its last frame.
    pub fn bounces(&self) -> bool {
        self.bounce
    }

    /// Returns the times of frames in seconds, by frame from 1.
    pub fn durations(&self) -> &BTreeMap<u64, f64> {
        &self.durations
    }

    /// Returns the frames in the order in which they are shown: there, and back if the animation
    /// [bounces](Self::bounces), without showing the two ends twice.
    pub fn shown<'f, T>(&self, frames: &'f [T]) -> impl Iterator<Item = &'f T> + Clone + use<'f, T> {
        let inner = match frames {
            [_, inner @ .., _] if self.bounce => inner,
            _ => &[],
        };
        frames.iter().chain(inner.iter().rev())
    }

    /// Returns the number of frames that are [shown](Self::shown) of `frames`.
    pub fn shown_count(&self, frames: u64) -> u64 {
        frames + if self.bounce { frames.saturating_sub(2) } else { 0 }
    }

    /// Returns the times in seconds by the place of the frame among those that are [shown](Self::shown) of `frames`,
    /// from 0.
    pub fn shown_durations(&self, frames: u64) -> BTreeMap<u64, f64> {
        let places = |frame: u64| {
            let there = frame - 1;
            let is_inner = self.bounce && there > 0 && frame < frames;
            [Some(there), is_inner.then(|| 2 * (frames - 1) - there)]
        };
        let known = self.durations.iter().filter(|(frame, _)| **frame <= frames);
        known
            .flat_map(|(frame, seconds)| places(*frame).into_iter().flatten().map(|place| (place, *seconds)))
            .collect()
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
        Self {
            frames: None,
            fps: Self::DEFAULT_FPS,
            loops: 0,
            bounce: false,
            durations: BTreeMap::new(),
            outputs: Self::DEFAULT_OUTPUTS.to_vec(),
        }
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
        Self::new(fields.frames, fields.fps, fields.loops)?
            .bouncing(fields.bounce)
            .with_durations(fields.durations)?
            .with_outputs(fields.outputs)
    }
}

impl From<AnimationSettings> for Fields {
    fn from(settings: AnimationSettings) -> Self {
        let AnimationSettings { frames, fps, loops, bounce, durations, outputs } = settings;
        Self { frames, fps, loops, bounce, durations, outputs }
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
            "bounce" => serde_json::from_str(value.get())
                .map(|bounce| fields.bounce = bounce)
                .map_err(|_| "expected true or false".to_string()),
            "durations" => durations(text, value, report).map(|durations| fields.durations = durations),
            "outputs" => outputs(text, value, report).map(|outputs| fields.outputs = outputs),
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
    let number = serde_json::from_str(value.get())
        .ok()
        .or_else(|| fraction(&serde_json::from_str::<String>(value.get()).ok()?))
        .filter(|fps| AnimationSettings::FPS.contains(fps));
    let (least, most) = AnimationSettings::FPS.into_inner();
    number.ok_or_else(|| {
        format!("expected a number from {least} to {most}, or a fraction such as \"30000/1001\"")
    })
}

/// Returns the times of frames in `value`, or a description of what is expected. Reports wrong frames and times.
fn durations(text: &str, value: &RawValue, report: &mut Report<'_>) -> Result<BTreeMap<u64, f64>, String> {
    let expected = "expected seconds by frame, such as {\"5\": 0.5}";
    let entries = serde_json::from_str::<Entries<'_>>(value.get()).map_err(|_| expected)?;
    let mut durations = BTreeMap::new();
    for (key, value) in entries.0 {
        let name: String = serde_json::from_str(key.get()).unwrap_or_default();
        // As the keys of a map are read, without a sign or zeros in front.
        let Some(frame) = serde_json::from_str::<u64>(&name).ok().filter(|frame| *frame > 0) else {
            tell(text, key, report, || {
                Fault::new(Code::InvalidField, format!("{} is no frame", quoted(&name)))
                    .expected("expected the number of a frame, from \"1\"")
            });
            continue;
        };
        let seconds = serde_json::from_str::<f64>(value.get()).ok();
        let Some(seconds) = seconds.filter(|seconds| AnimationSettings::DURATION.contains(seconds)) else {
            let (least, most) = AnimationSettings::DURATION.into_inner();
            tell(text, value, report, || {
                let value = value.get().lines().next().unwrap_or_default();
                Fault::new(Code::InvalidField, format!("frame {frame} cannot be shown for {}", quoted(value)))
                    .expected(format!("expected seconds from {least} to {most}"))
            });
            continue;
        };
        if durations.insert(frame, seconds).is_some() {
            tell(text, key, report, || {
                Fault::new(Code::DuplicateField, format!("frame {frame} has two times"))
                    .expected("expected each frame at most once")
            });
        }
    }
    Ok(durations)
}

/// Returns the files in `value`, or a description of what is expected. Reports wrong names.
fn outputs(text: &str, value: &RawValue, report: &mut Report<'_>) -> Result<Vec<Container>, String> {
    let expected = || "expected a list of files to make, such as [\"gif\", \"webp\"]".to_string();
    let entries = serde_json::from_str::<Vec<&RawValue>>(value.get()).map_err(|_| expected())?;
    if entries.is_empty() {
        return Err(expected());
    }
    let mut outputs: Vec<Container> = Vec::new();
    for entry in entries {
        let Ok(output) = serde_json::from_str(entry.get()) else {
            tell(text, entry, report, || {
                let entry = entry.get().lines().next().unwrap_or_default();
                let endings = Container::ALL.map(Container::ending).join("\", \"");
                Fault::new(Code::InvalidField, format!("{} is no file of an animation", quoted(entry)))
                    .expected(format!("expected one of \"{endings}\""))
            });
            continue;
        };
        if outputs.contains(&output) {
            tell(text, entry, report, || {
                Fault::new(Code::DuplicateField, format!("`{}` is there twice", output.ending()))
                    .expected("expected each file at most once")
            });
        }
        outputs.push(output);
    }
    Ok(outputs)
}

fn unknown(name: &str) -> Fault {
    let near = |field: &&&str| name.len() < 40 && strsim::osa_distance(&name.to_lowercase(), field) <= 2;
    let help = match SETTINGS_FIELDS.iter().find(near) {
        Some(field) => format!("did you mean `{field}`?"),
        None => format!("the fields are `{}`", SETTINGS_FIELDS.join("`, `")),
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
    fn rates_are_numbers_or_fractions() {
        check(r#"{"fps": "30000/1001"}"#, settings(None, 30_000.0 / 1_001.0, 0));
        check(r#"{"fps": "25/1"}"#, settings(None, 25.0, 0));
        for text in ["25", "25/", "/1", "0/1", "1/0", "-25/1", "2.5/1", "1/1000", "9999/1", "a/b"] {
            check(&format!(r#"{{"fps": "{text}"}}"#), None);
        }
    }

    #[test]
    fn frames_have_times() {
        let timed = |durations: &[(u64, f64)]| {
            AnimationSettings::default().with_durations(durations.iter().copied().collect()).ok()
        };
        check(r#"{"durations": {"5": 0.5, "1": 2}}"#, timed(&[(1, 2.0), (5, 0.5)]));
        check(r#"{"durations": {}}"#, timed(&[]));
        check(r#"{"bounce": true}"#, Some(AnimationSettings::default().bouncing(true)));
        for value in ["1", "null", "[1]", r#"{"0": 1}"#, r#"{"+5": 1}"#, r#"{"05": 1}"#, r#"{"x": 1}"#] {
            check(&format!(r#"{{"durations": {value}}}"#), None);
        }
        for seconds in ["0", "0.019", "655.36", "-1", "\"1\"", "null"] {
            check(&format!(r#"{{"durations": {{"5": {seconds}}}}}"#), None);
        }
        for bounce in ["1", "\"yes\"", "null"] {
            check(&format!(r#"{{"bounce": {bounce}}}"#), None);
        }
        let parsed = parse_settings("a", br#"{"durations": {"5": 1, "5": 2}}"#);
        assert!(parsed.settings.is_none());
    }

    #[test]
    fn files_to_make_are_a_list_of_endings() {
        let made = |outputs: &[Container]| AnimationSettings::default().with_outputs(outputs.to_vec()).ok();
        assert_eq!(AnimationSettings::default().outputs(), [Container::Gif]);
        check(r#"{"outputs": ["gif"]}"#, settings(None, 10.0, 0));
        check(r#"{"outputs": ["webp", "gif"]}"#, made(&[Container::Webp, Container::Gif]));
        check(r#"{"outputs": ["y4m", "apng"]}"#, made(&[Container::Y4m, Container::Apng]));
        for value in ["[]", "null", "\"gif\"", "[\"mp4\"]", "[1]", "{}", "[\"gif\", \"gif\"]", "[\"GIF\"]"] {
            check(&format!(r#"{{"outputs": {value}}}"#), None);
        }
        assert!(made(&[]).is_none() && made(&[Container::Gif, Container::Gif]).is_none());
    }

    #[test]
    fn there_and_back_shows_the_ends_once() {
        let settings = AnimationSettings::default().bouncing(true);
        let settings = settings.with_durations([(1, 1.0), (2, 2.0), (4, 4.0), (9, 9.0)].into()).unwrap();
        for (count, expect) in [(0, vec![]), (1, vec![1]), (2, vec![1, 2]), (4, vec![1, 2, 3, 4, 3, 2])] {
            let frames: Vec<u64> = (1..=count).collect();
            let shown: Vec<u64> = settings.shown(&frames).copied().collect();
            assert_eq!(shown, expect);
            assert_eq!(settings.shown_count(count), expect.len() as u64);
            let timed = settings.shown_durations(count);
            for (place, frame) in expect.iter().enumerate() {
                let seconds = settings.durations().get(frame);
                assert_eq!(timed.get(&(place as u64)), seconds, "{count} frames, place {place}");
            }
            assert!(timed.keys().all(|place| *place < expect.len() as u64));
        }
        assert_eq!(AnimationSettings::default().shown(&[1, 2, 3]).count(), 3);
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
        let made = settings(None, 5.0, 0).unwrap().with_outputs(vec![Container::Apng]).unwrap();
        for settings in
            [settings(None, 0.1, 3), settings(Some(7), 1000.0 / 3.0, 0), Some(made)].into_iter().flatten()
        {
            let text = serde_json::to_string(&settings).unwrap();
            check(&text, Some(settings));
        }
    }
}
