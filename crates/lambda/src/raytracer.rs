//! The render function's renderer: scripts to PNG images by `rayfold-scene` and `rayfold-tracer`.
//!
//! A drawing that nobody waits for any more is cancelled.

use std::num::NonZeroU64;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bytes::Bytes;
use rayfold_pipeline::keys::{Part, ScriptName};
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::{Drawing, Error, Renderer, Result};
use rayfold_scene::Limits;
use rayfold_tracer::{RenderError, RenderOptions};

use crate::{png, pool};

/// Draws scripts.
///
/// ```
/// use rayfold_lambda::raytracer::RayTracer;
/// use rayfold_pipeline::{Drawing, Renderer, keys::ScriptName};
/// # #[tokio::main(flavor = "current_thread")] async fn main() -> rayfold_pipeline::Result<()> {
/// let script = "Screen 4 3\nSphere 1 0 0 -5 1 0 0 0 0 0\nTrace";
/// let drawing = RayTracer::default().draw(&ScriptName::new("red")?, script.into(), None).await?;
/// assert!(matches!(drawing, Drawing::Frame(png) if png.starts_with(b"\x89PNG")));
/// # Ok(()) }
/// ```
#[derive(Debug, Clone, Default)]
pub struct RayTracer {
    /// What a script may ask for.
    pub limits: Limits,
}

impl Renderer for RayTracer {
    fn most_bytes(&self) -> u64 {
        self.limits.max_script_bytes as u64
    }

    async fn draw(&self, name: &ScriptName, script: Bytes, part: Part) -> Result<Drawing> {
        let cancelled = CancelOnDrop::default();
        let (flag, limits, file) = (cancelled.0.clone(), self.limits, format!("{name}.txt"));
        pool::run(move || draw(&file, &script, part, &limits, &flag))
            .await
            .unwrap_or_else(|| Err(Error::OutOfTime { what: format!("drawing {name} was given up") }))
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
    let options = RenderOptions { cancel: Some(cancel), ..Default::default() };
    let Some(drawn) = rayfold_tracer::render_frame(&script, place, &options) else {
        return Ok(Drawing::Fault(Reason::new(format!("{file} has {count} frames, no frame {number}"))));
    };
    match drawn {
        Ok(image) => match png::encode(&image) {
            Ok(frame) => Ok(Drawing::Frame(frame)),
            Err(source) => Err(Error::Malformed { key: "the drawn frame".to_owned(), source: source.into() }),
        },
        Err(RenderError::Cancelled) => {
            Err(Error::OutOfTime { what: format!("drawing {file} was cancelled") })
        }
        Err(error) => Ok(Drawing::Fault(Reason::new(format!("{file}: {error}")))),
    }
}

#[derive(Default)]
struct CancelOnDrop(Arc<AtomicBool>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
