//! Drawing: frames on the pool of threads, without Python's lock.
//!
//! The caller waits for a frame and checks for Ctrl-C meanwhile. `Ahead` draws frames before they are requested, as
//! many as fit into reserved memory, and returns them in order.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{DynamicImage, ImageEncoder, RgbImage, RgbaImage};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};
use rayfold_scene::Script as Parsed;
use rayfold_tracer::{RenderError, RenderOptions};

use crate::error::{bug, guarded};
use crate::script::Script;

/// The time between two looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(30);

/// The memory in bytes for frames ahead, as in `rayfold render`.
const AHEAD: u64 = 192 << 20;

/// The number of bytes per pixel while a frame is drawn, and per object.
const OF_PIXEL: u64 = 48;
const OF_OBJECT: u64 = 400;

/// The minimum number of frames at once: one is drawn while another is encoded.
const FEWEST: usize = 2;

/// A drawn frame.
#[pyclass(frozen, module = "rayfold._rayfold")]
pub(crate) struct Image {
    pub(crate) pixels: Pixels,
}

/// The pixels of a frame, row by row from the top.
pub(crate) enum Pixels {
    /// Eight bits per channel: three, or four with alpha.
    Levels(DynamicImage),
    /// Light before it is converted to levels: three channels per pixel, or four with its cover.
    Light((u32, u32), Vec<f32>),
}

#[pymethods]
impl Image {
    /// Makes an image of three bytes for each pixel, or of four with alpha, row by row from the top.
    #[new]
    fn new(width: u32, height: u32, levels: &Bound<'_, PyBytes>) -> PyResult<Self> {
        let bytes = levels.as_bytes().to_vec();
        let has_alpha = bytes.len() as u64 == 4 * u64::from(width) * u64::from(height);
        let image: Option<DynamicImage> = if has_alpha {
            RgbaImage::from_raw(width, height, bytes).map(Into::into)
        } else {
            // The length need not be exact for the crate.
            let is_whole = bytes.len() as u64 == 3 * u64::from(width) * u64::from(height);
            RgbImage::from_raw(width, height, bytes).filter(|_| is_whole).map(Into::into)
        };
        let image = image.ok_or_else(|| PyValueError::new_err("the bytes are not those of such an image"))?;
        Ok(Self { pixels: Pixels::Levels(image) })
    }

    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        match &self.pixels {
            Pixels::Levels(image) => (image.width(), image.height()),
            Pixels::Light(size, _) => *size,
        }
    }

    /// The channels of each pixel: 3, or 4 if there is alpha.
    #[getter]
    fn channels(&self) -> usize {
        match &self.pixels {
            Pixels::Levels(image) => image.color().channel_count().into(),
            Pixels::Light((width, height), light) => {
                light.len() / (*width as usize * *height as usize).max(1)
            }
        }
    }

    /// The bytes of the pixels: levels, or floats of 32 bits in the machine's order.
    fn data<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        match &self.pixels {
            Pixels::Levels(image) => PyByteArray::new(py, image.as_bytes()),
            Pixels::Light(_, light) => {
                let bytes: Vec<u8> = light.iter().flat_map(|channel| channel.to_ne_bytes()).collect();
                PyByteArray::new(py, &bytes)
            }
        }
    }

    /// The image as a PNG file, as `rayfold render` writes it.
    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let Pixels::Levels(image) = &self.pixels else {
            return Err(PyValueError::new_err("a PNG holds levels, not light"));
        };
        let encode = || {
            let mut file = Vec::new();
            PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive)
                .write_image(image.as_bytes(), image.width(), image.height(), image.color().into())
                .map(|()| file)
        };
        let file = py.detach(|| guarded(encode))?;
        let file = file.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(PyBytes::new(py, &file))
    }
}

type Drawn = Result<Pixels, RenderError>;
/// The index of a frame and its picture; `None` after a panic.
type Message = (usize, Option<Drawn>);

/// Frames that are drawn ahead, in order.
#[pyclass(module = "rayfold._rayfold")]
pub(crate) struct Ahead {
    cancel: Arc<AtomicBool>,
    sender: Sender<Message>,
    receiver: Mutex<Receiver<Message>>,
    waiting: BTreeMap<usize, Option<Drawn>>,
    started: usize,
    taken: usize,
    /// The most frames at once.
    window: usize,
}

#[pymethods]
impl Ahead {
    #[new]
    fn new() -> Self {
        let (sender, receiver) = mpsc::channel();
        Self {
            cancel: Arc::default(),
            sender,
            receiver: Mutex::new(receiver),
            waiting: BTreeMap::new(),
            started: 0,
            taken: 0,
            window: 4 * rayon::current_num_threads(),
        }
    }

    /// Begins to draw a frame of a scene, counted from 0.
    #[pyo3(signature = (scene, frame, linear = false))]
    fn start(
        &mut self,
        py: Python<'_>,
        scene: &Bound<'_, Script>,
        frame: usize,
        linear: bool,
    ) -> PyResult<()> {
        let script = scene.borrow_mut().parsed(py)?;
        let Some(shot) = shot_of(&script, frame) else {
            return Err(PyIndexError::new_err(format!("the scene has {} frames", script.frame_count())));
        };
        let bytes = OF_PIXEL * shot.screen.pixels() + OF_OBJECT * shot.objects as u64;
        let most = usize::try_from(AHEAD / bytes.max(1)).unwrap_or(usize::MAX);
        self.window = self.window.min(most.max(FEWEST));
        let (cancel, sender, index) = (self.cancel.clone(), self.sender.clone(), self.started);
        self.started += 1;
        rayon::spawn(move || {
            let draw = || draw(&script, frame, linear, &cancel);
            let drawn = catch_unwind(AssertUnwindSafe(draw)).ok();
            // Nobody listens any more after an error or Ctrl-C.
            let _ = sender.send((index, drawn));
        });
        Ok(())
    }

    /// Whether the next frame must be taken before another begins.
    #[getter]
    fn is_full(&self) -> bool {
        self.started - self.taken >= self.window
    }

    /// Whether all frames that were begun have been taken.
    #[getter]
    fn is_empty(&self) -> bool {
        self.started == self.taken
    }

    /// Waits for the next frame in order.
    fn take(&mut self, py: Python<'_>) -> PyResult<Image> {
        if self.is_empty() {
            return Err(PyRuntimeError::new_err("no frame was begun"));
        }
        while !self.waiting.contains_key(&self.taken) {
            let receiver = &self.receiver;
            let receive = || receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(LOOK);
            match py.detach(receive) {
                Ok((index, drawn)) => _ = self.waiting.insert(index, drawn),
                Err(RecvTimeoutError::Timeout) => py.check_signals().inspect_err(|_| self.stop())?,
                Err(RecvTimeoutError::Disconnected) => return Err(bug()),
            }
        }
        let drawn = self.waiting.remove(&self.taken).flatten();
        self.taken += 1;
        match drawn {
            Some(Ok(pixels)) => Ok(Image { pixels }),
            Some(Err(error)) => Err(PyRuntimeError::new_err(error.to_string())),
            None => Err(bug()),
        }
    }

    /// Stops what is being drawn.
    fn stop(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl Drop for Ahead {
    fn drop(&mut self) {
        self.stop();
    }
}

fn draw(script: &Parsed, frame: usize, linear: bool, cancel: &AtomicBool) -> Drawn {
    let options = RenderOptions { cancel: Some(cancel), ..RenderOptions::default() };
    let missing = || RenderError::Cancelled;
    if linear {
        let light = rayfold_tracer::light_of_frame(script, frame, &options).ok_or_else(missing)??;
        let screen = script.frame(frame).ok_or_else(missing)?.screen;
        return Ok(Pixels::Light((screen.width(), screen.height()), light));
    }
    rayfold_tracer::picture_of_frame(script, frame, &options).ok_or_else(missing)?.map(Pixels::Levels)
}

/// Returns the summary of the `Trace` that draws a frame, counted from 0.
fn shot_of(script: &Parsed, frame: usize) -> Option<rayfold_scene::ShotSummary> {
    let mut before = 0;
    script.shots().find(|shot| {
        before += shot.frame_count;
        frame < before
    })
}
