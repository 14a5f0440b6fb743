//! The real renderer and the real animator: `rayfold-scene`, `rayfold-tracer` and `rayfold-gif` behind the traits that
//! the steps ask for.
//!
//! Work runs on the rayon pool, so that the runtime stays free for requests. A drawing that nobody waits for any more
//! is cancelled.

use std::io::{self, Cursor, Write};
use std::num::NonZeroU64;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageFormat, RgbImage};
use rayfold_gif::Encoder;
use rayfold_scene::{AnimationSettings, Limits};
use rayfold_tracer::{RenderError, RenderOptions};
use tokio::sync::oneshot;

use crate::assemble::{Animator, Encoding};
use crate::keys::{Part, ScriptName};
use crate::manifest::Reason;
use crate::render::{Drawing, Renderer};
use crate::{Error, Result};

/// Draws scripts and assembles frames.
///
/// ```
/// use rayfold_pipeline::{Drawing, Renderer, keys::ScriptName, studio::Studio};
/// # #[tokio::main(flavor = "current_thread")] async fn main() -> rayfold_pipeline::Result<()> {
/// let script = "Screen 4 3\nSphere 1 0 0 -5 1 0 0 0 0 0\nTrace";
/// let drawing = Studio::default().draw(&ScriptName::new("red")?, script.into(), None).await?;
/// assert!(matches!(drawing, Drawing::Frame(png) if png.starts_with(b"\x89PNG")));
/// # Ok(()) }
/// ```
#[derive(Debug, Clone, Default)]
pub struct Studio {
    /// What a script may ask for.
    pub limits: Limits,
}

impl Renderer for Studio {
    async fn draw(&self, name: &ScriptName, script: Bytes, part: Part) -> Result<Drawing> {
        let cancelled = CancelOnDrop::default();
        let (flag, limits, file) = (cancelled.0.clone(), self.limits, format!("{name}.txt"));
        on_the_pool(move || draw(&file, &script, part, &limits, &flag))
            .await
            .unwrap_or_else(|| Err(Error::OutOfTime { what: format!("drawing {name} was given up") }))
    }
}

impl Animator for Studio {
    type Encoding = GifEncoding;

    fn begin(&self, settings: &AnimationSettings) -> Result<GifEncoding, Reason> {
        let ready = Shelf::default();
        let settings = rayfold_gif::Settings { fps: settings.fps(), loops: settings.loops() };
        let encoder = Encoder::new(ready.clone(), settings).map_err(reason)?;
        Ok(GifEncoding { encoder: Some(encoder), ready })
    }
}

/// A GIF being encoded.
pub struct GifEncoding {
    /// `None` while a frame is worked on, and after a failure.
    encoder: Option<Encoder<Shelf>>,
    ready: Shelf,
}

impl Encoding for GifEncoding {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Reason> {
        let mut encoder = self.encoder.take().ok_or_else(failed_before)?;
        let work = move || {
            let image = decode(&frame).map_err(reason)?;
            encoder.push(image).map_err(reason)?;
            Ok(encoder)
        };
        self.encoder = Some(on_the_pool(work).await.unwrap_or_else(|| Err(failed_before()))?);
        Ok(self.ready.take())
    }

    async fn finish(mut self) -> Result<Bytes, Reason> {
        let encoder = self.encoder.take().ok_or_else(failed_before)?;
        let work = move || encoder.finish().map_err(reason);
        on_the_pool(work).await.unwrap_or_else(|| Err(failed_before()))?;
        Ok(self.ready.take())
    }
}

fn draw(file: &str, script: &[u8], part: Part, limits: &Limits, cancel: &AtomicBool) -> Result<Drawing> {
    let parsed = rayfold_scene::parse(file, script, limits);
    let Some(script) = parsed.script else {
        return Ok(Drawing::Fault(Reason::from_diagnostics(parsed.diagnostics)));
    };
    let count = script.frame_count() as u64;
    let number = match (part, NonZeroU64::new(count)) {
        (None, Some(count)) if count.get() > 1 => return Ok(Drawing::Split(count)),
        (part, _) => part.map_or(1, NonZeroU64::get),
    };
    let place = usize::try_from(number - 1).unwrap_or(usize::MAX);
    let Some(scene) = script.frame(place) else {
        return Ok(Drawing::Fault(Reason::new(format!("{file} has {count} frames, no frame {number}"))));
    };
    match rayfold_tracer::render(&scene, &RenderOptions { cancel: Some(cancel), ..Default::default() }) {
        Ok(image) => Ok(Drawing::Frame(encode(&image)?)),
        Err(RenderError::Cancelled) => {
            Err(Error::OutOfTime { what: format!("drawing {file} was cancelled") })
        }
        Err(error) => Ok(Drawing::Fault(Reason::new(format!("{file}: {error}")))),
    }
}

/// An image as a PNG of exactly its RGB pixels.
///
/// # Errors
///
/// When the image cannot be held as PNG, which one with pixels always can.
pub fn encode(image: &RgbImage) -> Result<Bytes> {
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Adaptive)
        .write_image(image.as_raw(), image.width(), image.height(), ExtendedColorType::Rgb8)
        .map_err(|source| Error::Malformed { key: "the drawn frame".to_owned(), source: source.into() })?;
    Ok(png.into())
}

/// The RGB pixels of a PNG.
///
/// # Errors
///
/// What is wrong with the file.
pub fn decode(png: &[u8]) -> Result<RgbImage> {
    let mut reader = image::ImageReader::with_format(Cursor::new(png), ImageFormat::Png);
    // The frames are the pipeline's own; their size is limited where they are drawn.
    reader.no_limits();
    let image = reader.decode();
    let image =
        image.map_err(|source| Error::Malformed { key: "a frame".to_owned(), source: source.into() })?;
    Ok(image.into_rgb8())
}

/// Runs work on the rayon pool; `None` when it panicked.
async fn on_the_pool<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    let (send, receive) = oneshot::channel();
    rayon::spawn(move || {
        let work = std::panic::AssertUnwindSafe(work);
        if let Ok(value) = std::panic::catch_unwind(work) {
            // Nobody waits any more: the invocation was stopped.
            let _ = send.send(value);
        }
    });
    receive.await.ok()
}

fn reason(error: impl std::error::Error) -> Reason {
    let mut message = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        message = format!("{message}: {error}");
        source = error.source();
    }
    Reason::new(message)
}

fn failed_before() -> Reason {
    Reason::new("the encoder failed on an earlier frame")
}

#[derive(Default)]
struct CancelOnDrop(Arc<AtomicBool>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Where the encoder leaves what it has written until it is fetched.
#[derive(Debug, Clone, Default)]
struct Shelf(Arc<Mutex<Vec<u8>>>);

impl Shelf {
    fn take(&self) -> Bytes {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).into()
    }
}

impl Write for Shelf {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
