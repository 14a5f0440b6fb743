//! The open animation as a GIF, APNG or WebP, rendered on a thread of its own. Its bytes equal those of `rayfold
//! render` for the files.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use axum::body::Body;
use image::{DynamicImage, ImageFormat};
use rayfold_movie::{Container, Encoding, Movie, Plays};
use rayfold_scene::{AnimationSettings, Camera, Scene, Screen, Script};
use rayfold_tracer::{Exposure, RenderOptions, picture_of_frame, render_picture};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::error::Error;
use crate::pipe::{frame_file, zip_of};
use crate::project::Project;
use crate::protocol::{MovieFormat, OutputState};

/// The largest file in bytes that is kept in memory.
const LARGEST: usize = 512 << 20;

/// The longer side of a small picture, in pixels.
const THUMBNAIL: f64 = 96.0;

/// A file with an animation.
pub(crate) type File = (Container, Arc<Vec<u8>>);

/// The file that was rendered last, and the rendering in progress.
#[derive(Debug, Default)]
pub(crate) struct Outputs {
    file: Mutex<Option<File>>,
    running: Mutex<Option<Arc<AtomicBool>>>,
}

/// The input of a rendering: scripts in order, the settings, and the kind of file.
#[derive(Debug)]
struct Job {
    container: Container,
    scripts: Vec<Arc<Script>>,
    settings: AnimationSettings,
}

impl Job {
    fn of(project: &Project, container: Container) -> Result<Self, Error> {
        if let Some(file) = project.files.iter().find(|file| !file.is_sound()) {
            return Err(Error::Output(format!("{} has errors; mend them first", file.name)));
        }
        let scripts: Vec<_> = project.files.iter().filter_map(|file| file.script.clone()).collect();
        let frames: usize = scripts.iter().map(|script| script.frame_count()).sum();
        match project.settings().frames() {
            Some(expected) if (frames as u64) < expected => Err(Error::Output(format!(
                "animation.json says {expected} frames, but the scripts give {frames}"
            ))),
            _ => Ok(Self { container, scripts, settings: project.settings() }),
        }
    }

    fn run(&self, cancel: &AtomicBool, report: &impl Fn(OutputState)) -> Result<Vec<u8>, Error> {
        let frames: Vec<_> = self
            .scripts
            .iter()
            .flat_map(|script| (0..script.frame_count()).map(move |k| (script, k)))
            .collect();
        let of = self.settings.shown(&frames).count();
        let ending = self.container.ending();
        let failed =
            |error: &dyn std::error::Error| Error::Output(format!("cannot make the .{ending}: {error}"));
        let durations = self.settings.shown_durations(frames.len() as u64);
        let mut file = Bounded(Vec::new());
        let mut encoding: Option<Encoding<&mut Bounded>> = None;
        let mut out = Some(&mut file);
        let options = RenderOptions { cancel: Some(cancel), ..RenderOptions::default() };
        report(OutputState::Running { done: 0, of });
        for (done, &(script, k)) in self.settings.shown(&frames).enumerate() {
            let Some(frame) = picture_of_frame(script, k, &options) else { break };
            let frame = frame.map_err(|error| failed(&error))?;
            if let Some(out) = out.take() {
                let movie = Movie {
                    size: (frame.width(), frame.height()),
                    frames: Some(of as u64),
                    fps: self.settings.fps(),
                    plays: Plays::repeated(self.settings.loops()),
                    last_delay_cs: None,
                    exact: false,
                    alpha: self.scripts.iter().any(|script| script.shots().any(|shot| shot.is_clear)),
                };
                encoding = Some(Encoding::begin(out, self.container, movie).map_err(|error| failed(&error))?);
            }
            if let Some(encoding) = &mut encoding {
                let seconds = durations.get(&(done as u64)).copied();
                encoding.push(frame, seconds).map_err(|error| failed(&error))?;
            }
            report(OutputState::Running { done: done + 1, of });
        }
        let encoding = encoding.ok_or_else(|| Error::Output("there is no frame to draw".into()))?;
        encoding.finish().map_err(|error| failed(&error))?.complete(&mut file.0);
        Ok(file.0)
    }
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

/// Renders a frame at the script's own size, as PNG. Returns `None` if there is nothing to draw.
///
/// # Errors
/// Fails if the frame cannot be rendered.
pub(crate) fn frame_png(script: &Script, frame: usize) -> Result<Option<Vec<u8>>, Error> {
    let Some(image) = picture_of_frame(script, frame, &RenderOptions::default()) else { return Ok(None) };
    png(&image.map_err(|error| no_picture(&error))?).map(Some)
}

/// Renders a small picture of a scene as PNG. Returns `None` if the scene has pixels of the world's units, which
/// cannot be small.
///
/// # Errors
/// Fails if the scene cannot be rendered.
pub(crate) fn thumbnail(mut scene: Scene) -> Result<Option<Vec<u8>>, Error> {
    if matches!(scene.camera, Camera::Orthographic) {
        return Ok(None);
    }
    let (width, height) = (f64::from(scene.screen.width()), f64::from(scene.screen.height()));
    let scale = (THUMBNAIL / width.max(height)).min(1.0);
    let side = |side: f64| (side * scale).round().max(1.0) as u32;
    scene.screen = Screen::new(side(width), side(height)).map_err(|error| no_picture(&error))?;
    let image = render_picture(Exposure::still(&scene), &RenderOptions::default())
        .map_err(|error| no_picture(&error))?;
    png(&image).map(Some)
}

/// Encodes a picture as PNG.
///
/// # Errors
/// Fails if the picture is beyond the limits of the format.
pub(crate) fn png(image: &DynamicImage) -> Result<Vec<u8>, Error> {
    let mut file = io::Cursor::new(Vec::new());
    image.write_to(&mut file, ImageFormat::Png).map_err(|error| no_picture(&error))?;
    Ok(file.into_inner())
}

fn no_picture(error: &dyn std::error::Error) -> Error {
    Error::Output(format!("cannot make the picture: {error}"))
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

/// Returns all scripts, as they are on the page, as a zip file.
///
/// # Errors
/// Fails if the file is beyond the limits of the format.
pub(crate) fn scripts_zip(project: &Project) -> Result<Vec<u8>, Error> {
    let mut zip = ZipWriter::new(io::Cursor::new(Vec::new()));
    let failed = |error: &dyn std::error::Error| Error::Output(format!("cannot make the zip file: {error}"));
    for file in &project.files {
        zip.start_file(&file.name, SimpleFileOptions::default()).map_err(|error| failed(&error))?;
        zip.write_all(&file.document.bytes()).map_err(|error| failed(&error))?;
    }
    Ok(zip.finish().map_err(|error| failed(&error))?.into_inner())
}

/// A buffer with a size limit.
struct Bounded(Vec<u8>);

impl Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.len() + bytes.len() > LARGEST {
            return Err(io::Error::other(format!(
                "it is larger than {LARGEST} bytes; `rayfold render` writes it to a file"
            )));
        }
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use rayfold_scene::{Limits, parse};

    use super::*;

    #[test]
    fn an_animation_runs_back_and_shows_frames_for_times_of_their_own() {
        let ball = "Sphere 2  (1:-2 3:2) 0 -9  1 .5 0  0 0 0";
        for background in ["", "Background none\n"] {
            run_back(&format!("Screen 16 12\n{background}Frames 3\n{ball}\nTrace\n"), !background.is_empty());
        }
    }

    fn run_back(text: &str, alpha: bool) {
        let script = Arc::new(parse("a.txt", text.as_bytes(), &Limits::default()).script.unwrap());
        let settings = AnimationSettings::new(None, 10.0, 0).unwrap().bouncing(true);
        let settings = settings.with_durations(BTreeMap::from([(2, 0.5)])).unwrap();
        let movie = Movie {
            size: (16, 12),
            frames: Some(4),
            fps: 10.0,
            plays: Plays::Endless,
            last_delay_cs: None,
            exact: false,
            alpha,
        };
        for container in [Container::Gif, Container::Apng, Container::Webp] {
            let job = Job { container, scripts: vec![Arc::clone(&script)], settings: settings.clone() };
            let file = job.run(&AtomicBool::new(false), &|_| {}).unwrap();
            // The second frame is shown twice: there, and back.
            let mut expected = Vec::new();
            let mut encoding = Encoding::begin(&mut expected, container, movie).unwrap();
            for (frame, seconds) in [(0, None), (1, Some(0.5)), (2, None), (1, Some(0.5))] {
                let image = picture_of_frame(&script, frame, &RenderOptions::default()).unwrap().unwrap();
                assert_eq!(image.color().has_alpha(), alpha);
                encoding.push(image, seconds).unwrap();
            }
            encoding.finish().unwrap().complete(&mut expected);
            assert!(file == expected, "{container:?}: {} and {} bytes", file.len(), expected.len());
        }
    }
}
