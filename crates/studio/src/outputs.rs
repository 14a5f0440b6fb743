//! The animation that the server renders, on a thread of its own, and the frames that it sends while they are drawn.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use axum::body::Body;
use rayfold_movie::Container;

use crate::error::Error;
use crate::output::{Job, frame_file, frame_png};
use crate::pipe::zip_of;
use crate::project::Project;
use crate::protocol::{MovieFormat, OutputState};

/// A file with an animation.
pub(crate) type File = (Container, Arc<Vec<u8>>);

/// The file that was rendered last, and the rendering in progress.
#[derive(Debug, Default)]
pub(crate) struct Outputs {
    file: Mutex<Option<File>>,
    running: Mutex<Option<Arc<AtomicBool>>>,
}

impl Outputs {
    /// Starts rendering the animation unless a rendering is in progress. Reports the progress to `report`.
    pub(crate) fn start(
        self: &Arc<Self>,
        project: &Project,
        format: MovieFormat,
        report: impl Fn(OutputState) + Send + 'static,
    ) {
        let container = Container::from(format);
        let job = Job::of(project, container);
        let cancel = Arc::new(AtomicBool::new(false));
        {
            let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
            if running.is_some() {
                return;
            }
            *running = Some(Arc::clone(&cancel));
        }
        let own = Arc::clone(self);
        let spawned = thread::Builder::new().name("output".into()).spawn(move || {
            let made = job.and_then(|job| job.run(&cancel, &report));
            *own.running.lock().unwrap_or_else(PoisonError::into_inner) = None;
            report(match made {
                _ if cancel.load(Ordering::Relaxed) => OutputState::Cancelled,
                Err(error) => OutputState::Failed { why: error.to_string() },
                Ok(file) => {
                    let bytes = file.len();
                    *own.file.lock().unwrap_or_else(PoisonError::into_inner) =
                        Some((container, Arc::new(file)));
                    OutputState::Done { bytes, format }
                }
            });
        });
        if spawned.is_err() {
            *self.running.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
    }

    /// Cancels the rendering in progress.
    pub(crate) fn cancel(&self) {
        if let Some(cancel) = &*self.running.lock().unwrap_or_else(PoisonError::into_inner) {
            cancel.store(true, Ordering::Relaxed);
        }
    }

    /// Returns the file that was rendered last.
    pub(crate) fn file(&self) -> Option<File> {
        self.file.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Renders all frames at their scripts' own sizes to a zip file of PNGs, which is sent while they are rendered. If
/// the reader stops, the rendering stops and releases its `permit`.
///
/// # Errors
/// Fails if a script has errors, or if the system cannot start a thread.
pub(crate) fn frames_zip(project: &Project, permit: impl Send + 'static) -> Result<Body, Error> {
    let job = Job::of(project, Container::Gif)?;
    let of: usize = job.scripts.iter().map(|script| script.frame_count()).sum();
    let made = zip_of(move |zip| {
        let _permit = permit;
        let frames =
            job.scripts.iter().flat_map(|script| (0..script.frame_count()).map(move |k| (script, k)));
        for ((script, k), number) in frames.zip(1..) {
            if let Some(png) = frame_png(script, k).map_err(io::Error::other)? {
                zip.add(&frame_file(number, of as u64), &png)?;
            }
        }
        Ok(())
    });
    made.map_err(|error| Error::Output(format!("cannot make the zip file: {error}")))
}
