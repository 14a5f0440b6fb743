//! Encoders: images in order to a file or to memory, as GIF, APNG or WebP.

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayfold_files::OutputFile;
use rayfold_movie::{Container, Encoding, Finished, Movie, Plays};

use crate::drawing::{Image, Pixels};
use crate::error::{guarded, os_error};

/// The number of bytes that are collected before they are written.
const BUFFER: usize = 1 << 20;

/// An animation that is being written. A file appears when it is complete.
#[pyclass(module = "rayfold._rayfold")]
pub(crate) struct Encoder {
    encoding: Option<Encoding<BufWriter<Sink>>>,
    sink: Sink,
}

/// The destination of the bytes, which the encoder and its owner share.
#[derive(Clone)]
struct Sink(Arc<Mutex<Destination>>);

enum Destination {
    File(OutputFile),
    Memory(Vec<u8>),
    /// The file is complete, or lost.
    Closed,
}

#[pymethods]
impl Encoder {
    /// Makes an encoder of a `format` (`"gif"`, `"apng"`, `"webp"`). `frames` is the number of frames that will be pushed,
    /// which an APNG needs, and `alpha` says whether any has alpha. `loops` is the number of repetitions, 0 for endless, or -1 to show it once.
    #[new]
    #[pyo3(signature = (path, format, size, frames, fps, loops, last_seconds, exact, alpha = false))]
    #[expect(clippy::too_many_arguments, reason = "the properties of an animation, which Python names")]
    fn new(
        path: Option<PathBuf>,
        format: &str,
        size: (u32, u32),
        frames: Option<u64>,
        fps: f64,
        loops: i32,
        last_seconds: Option<f64>,
        exact: bool,
        alpha: bool,
    ) -> PyResult<Self> {
        let destination = match path {
            Some(path) => Destination::File(OutputFile::create(path).map_err(os_error)?),
            None => Destination::Memory(Vec::new()),
        };
        let sink = Sink(Arc::new(Mutex::new(destination)));
        let plays = match u16::try_from(loops) {
            Ok(times) => Plays::repeated(times),
            Err(_) if loops == -1 => Plays::Once,
            Err(_) => {
                return Err(PyValueError::new_err("the number of repetitions is from 0 to 65535, or -1"));
            }
        };
        // The conversion saturates.
        let last_delay_cs = last_seconds.map(|seconds| (100.0 * seconds).round() as u16);
        let movie = Movie { size, frames, fps, plays, last_delay_cs, exact, alpha };
        let out = BufWriter::with_capacity(BUFFER, sink.clone());
        let container: Container =
            format.parse().map_err(|_| PyValueError::new_err(format!("there is no format {format:?}")))?;
        let encoding = Encoding::begin(out, container, movie).map_err(movie_error)?;
        Ok(Self { encoding: Some(encoding), sink })
    }

    /// Adds the next frame. It is shown for this number of seconds if one is given, otherwise as long as the others.
    #[pyo3(signature = (image, seconds = None))]
    fn push(&mut self, py: Python<'_>, image: &Bound<'_, Image>, seconds: Option<f64>) -> PyResult<()> {
        let Pixels::Levels(image) = &image.get().pixels else {
            return Err(PyValueError::new_err("an animation holds levels, not light"));
        };
        let Some(mut encoding) = self.encoding.take() else {
            return Err(PyRuntimeError::new_err("the animation is complete, or lost after an error"));
        };
        let encoded = py.detach(|| guarded(|| encoding.push(image.clone(), seconds).map(|()| encoding)))?;
        self.encoding = Some(encoded.map_err(movie_error)?);
        Ok(())
    }

    /// Writes the rest. Returns the bytes, if there is no file, and how many frames were left out.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<(Option<Bound<'py, PyBytes>>, u64)> {
        let Some(encoding) = self.encoding.take() else {
            return Err(PyRuntimeError::new_err("the animation is complete, or lost after an error"));
        };
        let sink = self.sink.clone();
        let (bytes, dropped) = py.detach(|| {
            guarded(|| {
                let finished = encoding.finish().map_err(movie_error)?;
                let dropped = finished.dropped;
                let mut destination = sink.lock();
                destination.complete(finished).map_err(io_error)?;
                match std::mem::replace(&mut *destination, Destination::Closed) {
                    Destination::File(file) => file.finish(true).map(|()| (None, dropped)).map_err(os_error),
                    Destination::Memory(bytes) => Ok((Some(bytes), dropped)),
                    Destination::Closed => Err(PyRuntimeError::new_err("the animation is complete")),
                }
            })
        })??;
        Ok((bytes.map(|bytes| PyBytes::new(py, &bytes)), dropped))
    }
}

impl Sink {
    fn lock(&self) -> MutexGuard<'_, Destination> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut *self.lock() {
            Destination::File(file) => file.write(bytes),
            Destination::Memory(memory) => memory.write(bytes),
            Destination::Closed => Err(io::Error::other("the file is closed")),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut *self.lock() {
            Destination::File(file) => file.flush(),
            Destination::Memory(_) | Destination::Closed => Ok(()),
        }
    }
}

impl Destination {
    /// Writes the bytes that belong to the start of the file.
    fn complete(&mut self, finished: Finished) -> io::Result<()> {
        match (self, finished.length) {
            (Self::File(file), Some((at, length))) => file.overwrite(at, &length)?,
            (Self::Memory(memory), _) => finished.complete(memory),
            _ => {}
        }
        Ok(())
    }
}

/// Writes a file, which appears when it is complete.
#[pyfunction]
pub(crate) fn write_file(py: Python<'_>, path: PathBuf, content: &Bound<'_, PyBytes>) -> PyResult<()> {
    let content = content.as_bytes();
    py.detach(|| OutputFile::write(path, content, false)).map_err(os_error)
}

fn movie_error(error: rayfold_movie::Error) -> PyErr {
    match error {
        rayfold_movie::Error::Write(source) => io_error(source),
        other => PyValueError::new_err(other.to_string()),
    }
}

/// An error of the format becomes a `ValueError`; all others are errors of the system.
fn io_error(error: io::Error) -> PyErr {
    if error.kind() == io::ErrorKind::Other { PyValueError::new_err(error.to_string()) } else { error.into() }
}
