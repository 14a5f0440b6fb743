//! `--durations`: how long frames are shown.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use rayfold_scene::{SETTINGS_FIELDS, parse_settings};
use serde_json::{Map, Value};

use crate::console::Console;

/// The field of an animation.json that is read here.
const DURATIONS: &str = "durations";

/// Reads the times of frames in seconds, by frame from 1: a JSON object of them, or the `durations` of an animation.json, whose
/// other fields are reported as not read.
///
/// # Errors
/// Fails if the file cannot be read, or does not contain times.
pub(super) fn read(path: &Path, console: &Console) -> anyhow::Result<BTreeMap<u64, f64>> {
    let name = path.display().to_string();
    let mut text = String::new();
    rayfold_files::open(path)
        .and_then(|mut file| file.read_to_string(&mut text))
        .with_context(|| format!("cannot read {name}"))?;
    let fields = match serde_json::from_str(&text) {
        Ok(Value::Object(fields)) => fields,
        _ => Map::new(),
    };
    let (own, others): (Vec<&str>, Vec<&str>) = fields
        .keys()
        .map(String::as_str)
        .filter(|key| SETTINGS_FIELDS.contains(key))
        .partition(|key| *key == DURATIONS);
    let is_settings = !own.is_empty();
    if !is_settings && !others.is_empty() {
        bail!("{name} has no \"{DURATIONS}\": expected seconds by frame, such as {{\"5\": 0.5}}");
    }
    if !others.is_empty() {
        console.note(format_args!("of {name} only \"{DURATIONS}\" is read, not {}", others.join(", ")));
    }
    if !is_settings {
        text = format!("{{\"durations\":\n{text}}}");
    }
    let parsed = parse_settings(&name, text.as_bytes());
    if let Some(settings) = parsed.settings {
        return Ok(settings.durations().clone());
    }
    let Some(fault) = parsed.diagnostics.first() else { bail!("cannot read {name}") };
    let line = if is_settings { fault.line } else { fault.line.saturating_sub(1) };
    let expected = fault.expected.as_deref().unwrap_or("expected seconds by frame, such as {\"5\": 0.5}");
    bail!("{name}:{line}: {}: {expected}", fault.message)
}
