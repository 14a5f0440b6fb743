//! An animation as a whole: frames in order, into the container that was asked for, to a file or to standard output.

use std::io::{self, BufWriter, IsTerminal, Write};
use std::time::Duration;

use image::DynamicImage;
use rayfold_files::OutputFile;
use rayfold_movie::{Container, Encoding, Finished, MAX_FPS, Movie};

use super::target::Place;
use crate::console::Console;
use crate::interrupt;
use crate::outcome::Usage;
use crate::wording::{Size, number};

/// The number of bytes that are collected before they are written.
const BUFFER: usize = 1 << 20;

/// The reason why an animation could not be written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MovieError {
    /// The reader of standard output has closed it.
    #[error("the reader of standard output has closed it")]
    Closed,
    #[error("cannot write to standard output: it is closed, or /dev/null that is open for reading too")]
    NoStandardOutput,
    #[error("cannot write to standard output")]
    StandardOutput(#[source] io::Error),
    #[error(transparent)]
    Output(#[from] rayfold_files::Error),
    #[error(transparent)]
    Gif(rayfold_gif::Error),
    /// A frame of another size.
    #[error(transparent)]
    Size(rayfold_movie::Error),
    /// The file has reached its size limit.
    #[error("the file is too large")]
    Full,
    /// The frames cannot be stored until a quality fits.
    #[error("{0:#}")]
    Store(anyhow::Error),
}

/// The reason why a sink takes no more.
#[derive(Debug, thiserror::Error)]
#[error("too large")]
struct TooLarge;

/// A description of the animation that was written.
#[derive(Debug)]
pub(crate) struct Written {
    pub(crate) frames: u64,
    pub(crate) container: Container,
    /// The number of frames that are left out because they are too short for viewers of the container.
    pub(crate) dropped: u64,
    pub(crate) size: (u32, u32),
    pub(crate) bytes: u64,
}

/// Takes the next frame, and its duration in seconds if it differs from that of the others.
pub(crate) type Push<'a> = &'a mut (dyn FnMut(DynamicImage, Option<f64>) -> Result<(), MovieError> + Send);

/// Writes an animation of the frames that `fill` pushes, in their order. A file appears once it is whole.
///
/// # Errors
/// The errors of `fill`, and [`MovieError`].
pub(crate) fn write(
    place: &Place,
    container: Container,
    movie: Movie,
    fill: impl FnOnce(Push<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<Written> {
    Ok(encode(place, container, movie, None, fill)?.keep(place)?)
}

/// An animation that is complete, but has not yet replaced the output file.
pub(super) struct Encoded {
    written: Written,
    sink: Sink,
}

impl Encoded {
    /// Moves the file to its destination.
    ///
    /// # Errors
    /// The errors of the system.
    pub(super) fn keep(self, place: &Place) -> Result<Written, MovieError> {
        self.sink.finish(place)?;
        Ok(self.written)
    }
}

/// Encodes an animation as [`write`] does, but does not move it to its destination. It fails with [`MovieError::Full`]
/// if it has more than `limit` bytes.
///
/// # Errors
/// The errors of [`write`].
pub(super) fn encode(
    place: &Place,
    container: Container,
    movie: Movie,
    limit: Option<u64>,
    fill: impl FnOnce(Push<'_>) -> anyhow::Result<()>,
) -> anyhow::Result<Encoded> {
    let failed = |source| error_at(place, source);
    let mut out = BufWriter::with_capacity(BUFFER, Sink::open(place, container, limit)?);
    let mut frames = 0;
    let finished = {
        let mut encoding = Encoding::begin(&mut out, container, movie).map_err(|error| at(place, error))?;
        fill(&mut |frame, seconds| {
            frames += 1;
            encoding.push(frame, seconds).map_err(|error| at(place, error))
        })?;
        encoding.finish().map_err(|error| at(place, error))?
    };
    let mut sink = out.into_inner().map_err(|error| failed(error.into_error()))?;
    let bytes = sink.bytes;
    sink.complete(finished).map_err(failed)?;
    let dropped = finished.dropped;
    let written = Written { frames: frames - dropped, container, dropped, size: movie.size, bytes };
    Ok(Encoded { written, sink })
}

/// Reports the file that was written.
pub(crate) fn tell(place: &Place, written: &Written, fps: f64, took: Duration, console: &Console) {
    let name = match place {
        Place::File(path) => path.display().to_string(),
        Place::StandardOutput => "standard output".into(),
    };
    console.note(format_args!(
        "{name}: {} of {} x {}, {}, in {:.2} s",
        number(written.frames, "frame"),
        written.size.0,
        written.size.1,
        Size(written.bytes),
        took.as_secs_f64()
    ));
    if written.dropped > 0 {
        let most = match written.container {
            Container::Apng => format!("browsers show at most {MAX_FPS} frames of an APNG a second"),
            Container::Webp => format!("browsers show at most {MAX_FPS} frames of a WebP a second"),
            Container::Gif | Container::Y4m => "a GIF shows at most 50 frames a second".into(),
        };
        console.note(format_args!("{} left out: {most}, not {fps}", number(written.dropped, "frame")));
    }
}

fn at(place: &Place, error: rayfold_movie::Error) -> MovieError {
    match error {
        rayfold_movie::Error::Write(source) => error_at(place, source),
        rayfold_movie::Error::Gif(error) => MovieError::Gif(error),
        error @ rayfold_movie::Error::Size { .. } => MovieError::Size(error),
        error @ rayfold_movie::Error::State(_) => error_at(place, io::Error::other(error)),
    }
}

fn error_at(place: &Place, source: io::Error) -> MovieError {
    match place {
        _ if source.get_ref().is_some_and(|error| error.is::<TooLarge>()) => MovieError::Full,
        Place::File(path) => rayfold_files::Error::Io { path: path.clone(), source }.into(),
        Place::StandardOutput if source.kind() == io::ErrorKind::BrokenPipe => MovieError::Closed,
        Place::StandardOutput => MovieError::StandardOutput(source),
    }
}

/// Counts the bytes that go to a file or to standard output.
struct Sink {
    to: To,
    bytes: u64,
    limit: u64,
}

enum To {
    File(OutputFile),
    StandardOutput,
    /// Standard output gets all bytes at the end, because the beginning is known last.
    Memory(Vec<u8>),
}

impl Sink {
    fn open(place: &Place, container: Container, limit: Option<u64>) -> anyhow::Result<Self> {
        let to = match place {
            Place::File(path) => To::File(OutputFile::create(path)?),
            Place::StandardOutput if io::stdout().is_terminal() => {
                let message = "an animation is nothing for a terminal: pipe it to a program, or write a file";
                return Err(Usage(message.into()).into());
            }
            Place::StandardOutput if is_closed() => return Err(MovieError::NoStandardOutput.into()),
            Place::StandardOutput if container == Container::Webp || limit.is_some() => {
                To::Memory(Vec::new())
            }
            Place::StandardOutput => To::StandardOutput,
        };
        Ok(Self { to, bytes: 0, limit: limit.unwrap_or(u64::MAX) })
    }

    /// Writes the bytes that belong to the start of the file.
    fn complete(&mut self, finished: Finished) -> io::Result<()> {
        match (&mut self.to, finished.length) {
            (To::File(file), Some((at, length))) => file.overwrite(at, &length)?,
            (To::Memory(bytes), _) => finished.complete(bytes),
            _ => {}
        }
        Ok(())
    }

    fn finish(self, place: &Place) -> Result<(), MovieError> {
        match self.to {
            To::File(file) => Ok(file.finish(true)?),
            To::StandardOutput => Ok(()),
            To::Memory(bytes) => print(bytes).map_err(|source| error_at(place, source)),
        }
    }
}

/// Writes to standard output, whose reader may block without end.
fn print(bytes: Vec<u8>) -> io::Result<()> {
    let mut out = io::stdout();
    interrupt::wait_for(move || out.write_all(&bytes).and_then(|()| out.flush())).map_err(io::Error::other)?
}

/// Returns whether the program was started without a standard output, as by `>&-`. The language's runtime then puts
/// `/dev/null` in its place, open for reading and writing; a shell's `> /dev/null` is open for writing alone.
#[cfg(target_os = "linux")]
fn is_closed() -> bool {
    use std::os::unix::fs::MetadataExt;
    let device = |path: &str| std::fs::metadata(path).ok().map(|metadata| metadata.rdev());
    let is_null =
        device("/dev/null").is_some_and(|null| null != 0 && device("/proc/self/fd/1") == Some(null));
    let info = std::fs::read_to_string("/proc/self/fdinfo/1").unwrap_or_default();
    let flags = info.lines().find_map(|line| line.strip_prefix("flags:"));
    let flags = flags.and_then(|flags| u32::from_str_radix(flags.trim(), 8).ok());
    is_null && flags.is_some_and(|flags| flags & 0o3 == 0o2)
}

/// On other systems this cannot be detected.
#[cfg(not(target_os = "linux"))]
fn is_closed() -> bool {
    false
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.bytes.saturating_add(bytes.len() as u64) > self.limit {
            return Err(io::Error::other(TooLarge));
        }
        let written = match &mut self.to {
            To::File(file) => file.write(bytes)?,
            To::StandardOutput => {
                print(bytes.to_vec())?;
                bytes.len()
            }
            To::Memory(collected) => collected.write(bytes)?,
        };
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            To::File(file) => file.flush(),
            To::StandardOutput | To::Memory(_) => Ok(()),
        }
    }
}
