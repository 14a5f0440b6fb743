//! Folders of scripts: reading one as an animation, and the text of its settings.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use rayfold_files::Folder;
use rayfold_scene::{AnimationSettings, UnknownContainer, parse_settings};

use crate::error::{guarded, scene_error};

/// The settings of an animation: frames, rate, repetitions, whether it runs back, and times of frames.
type Playback = (Option<u64>, f64, u16, bool, BTreeMap<u64, f64>);

/// Reads a folder, or a script alone. Returns the names and texts of the scripts in order, the settings, and the files that
/// are not read although they look like scripts.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "what the caller takes apart at once")]
pub(crate) fn read_folder(
    py: Python<'_>,
    path: PathBuf,
) -> PyResult<(Vec<(String, String)>, Playback, Vec<String>)> {
    let mut settings = AnimationSettings::default();
    let (scripts, not_read) = if path.is_dir() {
        let folder = Folder::list(&path)
            .map_err(|error| PyOSError::new_err(format!("cannot read {}: {error}", path.display())))?;
        if let Some(file) = &folder.settings {
            let parsed = parse_settings(&file.display().to_string(), &read(file)?);
            settings = parsed.settings.ok_or_else(|| scene_error(py, parsed.diagnostics))?;
        }
        let not_read =
            folder.not_read.iter().map(|file| format!("{}: {file}", file.path.display())).collect();
        (folder.scripts.into_iter().map(|(_, path)| path).collect(), not_read)
    } else {
        (vec![path.clone()], Vec::new())
    };
    if scripts.is_empty() {
        return Err(PyValueError::new_err(format!("{} holds no scripts (*.txt)", path.display())));
    }
    let scripts: PyResult<Vec<_>> = py.detach(|| {
        guarded(|| {
            let text = |path: &PathBuf| {
                let name = path.display().to_string();
                let text = String::from_utf8(read(path)?);
                Ok((
                    name.clone(),
                    text.map_err(|_| PyValueError::new_err(format!("{name} is not UTF-8 text")))?,
                ))
            };
            scripts.iter().map(text).collect()
        })
    })?;
    let playback = (
        settings.frames(),
        settings.fps(),
        settings.loops(),
        settings.bounces(),
        settings.durations().clone(),
    );
    Ok((scripts?, playback, not_read))
}

/// Returns the text of `animation.json`.
#[pyfunction]
pub(crate) fn settings_text(
    frames: Option<u64>,
    fps: f64,
    loops: u16,
    bounce: bool,
    durations: BTreeMap<u64, f64>,
    output: &str,
) -> PyResult<String> {
    let output =
        output.parse().map_err(|error: UnknownContainer| PyValueError::new_err(error.to_string()))?;
    let settings = AnimationSettings::new(frames, fps, loops)
        .and_then(|settings| settings.bouncing(bounce).with_durations(durations))
        .and_then(|settings| settings.with_outputs(vec![output]))
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    serde_json::to_string_pretty(&settings)
        .map(|text| text + "\n")
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

fn read(path: &Path) -> PyResult<Vec<u8>> {
    let mut text = Vec::new();
    let read = rayfold_files::open(path).and_then(|mut file| file.read_to_end(&mut text));
    read.map_err(|error| PyOSError::new_err(format!("cannot read {}: {error}", path.display())))?;
    Ok(text)
}
