//! The assemble function's animator: encodes PNG frames to a GIF with `rayfold-gif`, piece by piece.

use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use rayfold_gif::Encoder;
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::{Animator, Encoding, Unfit};
use rayfold_scene::{AnimationSettings, Limits};

use crate::{png, pool};

/// More frames than there can be.
const MANY_FRAMES: u64 = 1 << 40;

/// An animator that makes GIFs.
#[derive(Debug, Clone, Copy)]
pub struct GifAnimator {
    /// The largest number of pixels of a frame. A file that claims more was not drawn by rayfold.
    pub most_pixels: u64,
}

impl Default for GifAnimator {
    fn default() -> Self {
        Self { most_pixels: Limits::PIXELS }
    }
}

impl Animator for GifAnimator {
    type Encoding = GifEncoding;

    fn begin(&self, settings: &AnimationSettings) -> Result<GifEncoding, Reason> {
        let ready = Shelf::default();
        // Durations of an animation that bounces need the number of frames, which the assembler fills in.
        let durations = settings.shown_durations(settings.frames().unwrap_or(MANY_FRAMES));
        let settings = rayfold_gif::Settings::new(settings.fps(), settings.loops()).timed(&durations);
        let encoder = Encoder::new(ready.clone(), settings).map_err(reason)?;
        Ok(GifEncoding { encoder: Some(encoder), ready, most_pixels: self.most_pixels })
    }

    async fn resume(&self, state: Bytes) -> Result<GifEncoding, Reason> {
        let ready = Shelf::default();
        let shelf = ready.clone();
        let work = move || Encoder::resume(shelf, &state).map_err(reason);
        let encoder = pool::run(work).await.unwrap_or_else(|| Err(failed_before()))?;
        Ok(GifEncoding { encoder: Some(encoder), ready, most_pixels: self.most_pixels })
    }
}

/// A GIF that is being encoded.
pub struct GifEncoding {
    /// `None` while a frame is being encoded, and after a failure.
    encoder: Option<Encoder<Shelf>>,
    ready: Shelf,
    most_pixels: u64,
}

impl Encoding for GifEncoding {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        let failed = || Unfit::Unlike(failed_before());
        let mut encoder = self.encoder.take().ok_or_else(failed)?;
        let most_pixels = self.most_pixels;
        let work = move || {
            let image = png::decode(&frame, most_pixels).map_err(|error| Unfit::Corrupt(reason(error)))?;
            encoder.push(image).map_err(|error| Unfit::Unlike(reason(error)))?;
            Ok(encoder)
        };
        self.encoder = Some(pool::run(work).await.unwrap_or_else(|| Err(failed()))?);
        Ok(self.ready.take())
    }

    async fn finish(mut self) -> Result<Bytes, Reason> {
        let encoder = self.encoder.take().ok_or_else(failed_before)?;
        let work = move || encoder.finish().map_err(reason);
        pool::run(work).await.unwrap_or_else(|| Err(failed_before()))?;
        Ok(self.ready.take())
    }

    async fn suspend(mut self) -> Result<Bytes, Reason> {
        let encoder = self.encoder.take().ok_or_else(failed_before)?;
        let work = move || encoder.suspend().map(Bytes::from).map_err(reason);
        pool::run(work).await.unwrap_or_else(|| Err(failed_before()))
    }
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

/// A buffer in which the encoder leaves its output until it is fetched.
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
