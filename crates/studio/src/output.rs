//! The open animation as a GIF, APNG or WebP, and its scripts and frames as files. The bytes of an animation equal those
//! of `rayfold render` for the files.

use std::collections::BTreeMap;
use std::io::{self, Write};
#[cfg(feature = "server")]
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use image::{DynamicImage, ImageFormat};
use rayfold_movie::{Container, Encoding, Movie, Plays};
use rayfold_scene::{AnimationSettings, Camera, Samples, Scene, Screen, Script};
use rayfold_tracer::{Exposure, RenderOptions, picture_of_frame, render_picture};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::error::Error;
use crate::project::Project;
#[cfg(feature = "server")]
use crate::protocol::OutputState;

/// The largest file in bytes that is kept in memory.
const LARGEST: usize = 512 << 20;

/// The longer side of a small picture, in pixels: as wide as a card of the start page.
const THUMBNAIL: f64 = 192.0;

/// The factor by which the error of a pixel may be larger in a small picture.
const NOISE: u32 = 2;

/// The input of a rendering: scripts in order, the settings, and the kind of file.
#[derive(Debug)]
pub(crate) struct Job {
    container: Container,
    pub(crate) scripts: Vec<Arc<Script>>,
    settings: AnimationSettings,
}

/// An encoder of an animation to a file in memory.
#[derive(Debug)]
pub(crate) struct Film {
    job: Job,
    /// The script and the index of each frame, in the order in which they are shown.
    frames: Vec<(Arc<Script>, usize)>,
    /// The durations, in seconds, of the frames that have their own duration.
    durations: BTreeMap<u64, f64>,
    file: Bounded,
    encoding: Option<Encoding<Bounded>>,
    pushed: usize,
}

impl Job {
    /// Takes the input from a project.
    ///
    /// # Errors
    /// Fails if a script has errors, or if there are fewer frames than the settings say.
    pub(crate) fn of(project: &Project, container: Container) -> Result<Self, Error> {
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

    /// Renders the animation, and reports each frame.
    ///
    /// # Errors
    /// Fails if a frame cannot be rendered, or if the file is beyond the limits.
    #[cfg(feature = "server")]
    pub(crate) fn run(self, cancel: &AtomicBool, report: &impl Fn(OutputState)) -> Result<Vec<u8>, Error> {
        let options = RenderOptions { cancel: Some(cancel), ..RenderOptions::default() };
        let mut film = Film::new(self);
        let of = film.count();
        report(OutputState::Running { done: 0, of });
        for done in 0..of {
            film.push(film.draw(done, &options)?)?;
            report(OutputState::Running { done: done + 1, of });
        }
        film.finish()
    }
}

impl Film {
    pub(crate) fn new(job: Job) -> Self {
        let frames: Vec<_> = job
            .scripts
            .iter()
            .flat_map(|script| (0..script.frame_count()).map(move |k| (Arc::clone(script), k)))
            .collect();
        let durations = job.settings.shown_durations(frames.len() as u64);
        let frames = job.settings.shown(&frames).cloned().collect();
        Self { job, frames, durations, file: Bounded::default(), encoding: None, pushed: 0 }
    }

    /// Makes a video that shows each frame once, whatever the settings say.
    pub(crate) fn of_all_frames(mut job: Job) -> Self {
        job.settings = AnimationSettings::default();
        Self::new(job)
    }

    /// Returns the number of frames, each counted as often as it is shown.
    pub(crate) fn count(&self) -> usize {
        self.frames.len()
    }

    /// Renders a frame, counted from 0 in the order in which they are shown.
    ///
    /// # Errors
    /// Fails if there is no such frame, or if it cannot be rendered.
    pub(crate) fn draw(&self, number: usize, options: &RenderOptions) -> Result<DynamicImage, Error> {
        let frame = self.frames.get(number).and_then(|(script, k)| picture_of_frame(script, *k, options));
        frame.ok_or_else(nothing)?.map_err(|error| self.failed(&error))
    }

    /// Adds the next frame to the file.
    ///
    /// # Errors
    /// Fails if the file is beyond the limits.
    pub(crate) fn push(&mut self, frame: DynamicImage) -> Result<(), Error> {
        if self.encoding.is_none() {
            let movie = Movie {
                size: (frame.width(), frame.height()),
                frames: Some(self.count() as u64),
                fps: self.job.settings.fps(),
                plays: Plays::repeated(self.job.settings.loops()),
                last_delay_cs: None,
                exact: false,
                alpha: self.job.scripts.iter().any(|script| script.shots().any(|shot| shot.is_clear)),
            };
            let begun = Encoding::begin(self.file.clone(), self.job.container, movie);
            self.encoding = Some(begun.map_err(|error| self.failed(&error))?);
        }
        let seconds = self.durations.get(&(self.pushed as u64)).copied();
        self.pushed += 1;
        let pushed = self.encoding.as_mut().map_or(Ok(()), |encoding| encoding.push(frame, seconds));
        pushed.map_err(|error| self.failed(&error))
    }

    /// Returns the file with all frames that were added.
    ///
    /// # Errors
    /// Fails if there was no frame, or if the file is beyond the limits.
    pub(crate) fn finish(mut self) -> Result<Vec<u8>, Error> {
        let encoding = self.encoding.take().ok_or_else(nothing)?;
        let finished = encoding.finish().map_err(|error| self.failed(&error))?;
        let mut file = std::mem::take(&mut *self.file.bytes());
        finished.complete(&mut file);
        Ok(file)
    }

    fn failed(&self, error: &dyn std::error::Error) -> Error {
        Error::Output(format!("cannot make the .{}: {error}", self.job.container.ending()))
    }
}

fn nothing() -> Error {
    Error::Output("there is no frame to draw".into())
}

/// Renders a frame at the script's own size, as PNG. Returns `None` if there is nothing to draw.
///
/// # Errors
/// Fails if the frame cannot be rendered.
pub(crate) fn frame_png(script: &Script, frame: usize) -> Result<Option<Vec<u8>>, Error> {
    let Some(image) = picture_of_frame(script, frame, &RenderOptions::default()) else { return Ok(None) };
    png(&image.map_err(|error| no_picture(&error))?).map(Some)
}

/// Renders a small picture of a scene as PNG. Returns `None` if a pixel is a unit of the world, because such a picture
/// cannot be smaller.
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
    // A pixel of a small picture may be noisier than one of the whole.
    let samples = scene.samples;
    let fewer = Samples::new(samples.most().div_ceil(NOISE * NOISE), f64::from(NOISE) * samples.error());
    scene.samples = fewer.unwrap_or(samples);
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

/// Returns the name of a frame's file in a zip file of `of` frames. Its number is padded so that all programs
/// sort the files correctly.
pub(crate) fn frame_file(number: u64, of: u64) -> String {
    let digits = of.max(1).to_string().len();
    format!("frame{number:0digits$}.png")
}

/// A buffer with a size limit. Its clones are the same buffer.
#[derive(Clone, Debug, Default)]
struct Bounded(Arc<Mutex<Vec<u8>>>);

impl Bounded {
    fn bytes(&self) -> MutexGuard<'_, Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut file = self.bytes();
        if file.len() + bytes.len() > LARGEST {
            return Err(io::Error::other(format!(
                "it is larger than {LARGEST} bytes; `rayfold render` writes it to a file"
            )));
        }
        file.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(feature = "server")]
#[cfg(test)]
mod tests {

    use rayfold_scene::{Limits, parse};

    use super::*;

    #[test]
    fn programs_sort_the_files_of_frames() {
        assert_eq!((frame_file(7, 50), frame_file(7, 9)), ("frame07.png".into(), "frame7.png".into()));
    }

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
