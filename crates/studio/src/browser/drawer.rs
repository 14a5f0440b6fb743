//! A worker that draws: rows of pictures of the viewport, and small pictures.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use image::RgbaImage;
use rayfold_scene::{Limits, Samples, Scene, Screen, Script, parse_with_files};
use rayfold_tracer::{Drawing, Exposure, RenderOptions};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::line::Line;
use crate::materials;
use crate::output::{frame_png, thumbnail};
use crate::storage::{Memory, Storage};
use crate::view::Orbit;
use crate::wanted::{Motion, ViewSettings};

/// A task of a drawer, as JSON.
#[derive(Debug, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Task {
    /// Rows of a picture of the viewport: four bytes per pixel.
    Rows(Rows),
    /// A small picture of a script's first frame.
    Thumbnail { script: String },
    /// A sphere of the material of a line.
    Material { script: String, line: usize, frame: u32 },
    /// A sphere of a starter material.
    Preset { name: String },
    /// A frame in the script's own size.
    Frame { script: String, frame: usize },
}

/// Rows of a picture of the viewport.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct Rows {
    pub(super) script: String,
    pub(super) frame: usize,
    pub(super) view: View,
    /// The picture is a sketch.
    pub(super) sketch: Option<Sketch>,
    /// The first row from the top, and the end of the rows.
    pub(super) rows: (u32, u32),
}

/// A picture of fewer pixels and rays.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub(super) struct Sketch {
    pub(super) size: (u32, u32),
    pub(super) samples: u32,
    pub(super) bounces: Option<u32>,
}

/// The view of the viewport, with numbers that JSON keeps exactly.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub(super) struct View {
    size: (u32, u32),
    free: Option<[u64; 7]>,
    is_draft: bool,
}

impl From<ViewSettings> for View {
    fn from(view: ViewSettings) -> Self {
        let free = view.free.map(|orbit| {
            let [x, y, z] = orbit.target.to_array();
            [x, y, z, orbit.distance, orbit.yaw, orbit.pitch, orbit.half_fov].map(f64::to_bits)
        });
        Self { size: view.size, free, is_draft: view.is_draft }
    }
}

impl From<View> for ViewSettings {
    fn from(view: View) -> Self {
        let free = view.free.map(|numbers| {
            let [x, y, z, distance, yaw, pitch, half_fov] = numbers.map(f64::from_bits);
            Orbit { target: DVec3::new(x, y, z), distance, yaw, pitch, half_fov }
        });
        Self { size: view.size, free, is_draft: view.is_draft }
    }
}

/// A worker that draws.
#[derive(Debug, Default)]
pub struct Drawer {
    files: Memory,
    /// The scripts that were parsed, each with the tag of its text.
    scripts: BTreeMap<String, (u64, Arc<Script>)>,
}

impl Drawer {
    /// Stores a file, in place of an older one.
    pub fn put(&self, name: &str, content: Vec<u8>) {
        self.files.insert(name, content);
    }

    /// Executes a task. Returns nothing for a picture that cannot be drawn.
    ///
    /// # Errors
    /// Fails if the task cannot be read, or if the tracer refuses the picture.
    pub fn draw(&mut self, task: &str) -> Result<Vec<u8>, Error> {
        let task = serde_json::from_str(task).map_err(|error| Error::Output(error.to_string()))?;
        let drawn = match task {
            Task::Rows(rows) => self.rows(&rows)?,
            Task::Thumbnail { script } => match self.script(&script).and_then(|script| script.frame(0)) {
                Some(scene) => thumbnail(scene)?,
                None => None,
            },
            Task::Material { script, line, frame } => {
                let text = self.files.read(&script)?.unwrap_or_default();
                materials::sphere(&Line::split(&text), line, frame, &self.files.library())?
            }
            Task::Preset { name } => materials::preset_sphere(&name)?,
            Task::Frame { script, frame } => match self.script(&script) {
                Some(script) => frame_png(&script, frame)?,
                None => None,
            },
        };
        Ok(drawn.unwrap_or_default())
    }

    fn script(&mut self, name: &str) -> Option<Arc<Script>> {
        let tag = self.files.look(name)?.tag;
        if let Some((known, script)) = self.scripts.get(name)
            && *known == tag
        {
            return Some(Arc::clone(script));
        }
        let text = self.files.read(name).ok()??;
        let limits = Limits { max_described: 0, ..Limits::default() };
        let script = Arc::new(parse_with_files(name, &text, &limits, &self.files.library()).script?);
        self.scripts.insert(name.into(), (tag, Arc::clone(&script)));
        Some(script)
    }

    fn rows(&mut self, rows: &Rows) -> Result<Option<Vec<u8>>, Error> {
        let view = ViewSettings::from(rows.view);
        let Some(script) = self.script(&rows.script) else { return Ok(None) };
        let Some(scene) = script.frame(rows.frame).and_then(|scene| view.of(scene)) else { return Ok(None) };
        let refused = |error: &dyn std::error::Error| Error::Output(error.to_string());
        let (scene, motion, bounces) = match rows.sketch {
            Some(Sketch { size: (width, height), samples, bounces }) => {
                let screen = Screen::new(width, height).map_err(|error| refused(&error))?;
                let samples = Samples::new(samples, 0.0).unwrap_or_default();
                (Scene { screen, samples, ..scene }, None, bounces)
            }
            None => {
                let motion = Motion { script, frame: rows.frame, is_free: view.free.is_some() };
                let motion = (scene.shutter.open() > 0.0).then_some(motion);
                (scene, motion, None)
            }
        };
        let after = |frames| match &motion {
            Some(motion) => motion.after(&scene, frames),
            None => scene.clone(),
        };
        let exposure =
            if motion.is_some() { Exposure::moving(&scene, &after) } else { Exposure::still(&scene) };
        let options = RenderOptions { bounces, ..RenderOptions::default() };
        let drawing = Drawing::exposed(exposure, &options).map_err(|error| refused(&error))?;
        let image = drawing.draw_picture_rows(rows.rows.0..rows.rows.1).map_err(|error| refused(&error))?;
        Ok(Some(RgbaImage::into_raw(image.into_rgba8())))
    }
}
