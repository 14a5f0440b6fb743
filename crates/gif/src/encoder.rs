//! Frames in, bytes out: checks each frame, gives it its delay, and writes the blocks in order.

use std::io::{self, Write};
use std::num::NonZeroU16;

use gif::{DisposalMethod, Repeat};
use image::RgbImage;

use crate::block::Block;
use crate::error::{Error, LONGEST_SIDE};
use crate::quantise::Quantiser;
use crate::timeline::Timeline;

/// How to write the animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Frames a second: above 0, at least 100 / 65,535. Above 50, frames are dropped.
    pub fps: f64,
    /// How often the animation is shown.
    pub plays: Plays,
    /// How long the last frame is shown, in hundredths of a second; as long as `fps` says if not given.
    pub last_delay_cs: Option<u16>,
}

/// How often an animation is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Plays {
    /// For ever.
    #[default]
    Endless,
    /// Once; then the last frame stays.
    Once,
    /// Once, and then so many times again.
    Repeated(NonZeroU16),
}

impl Plays {
    /// As a GIF counts: repetitions, of which 0 stands for ever.
    pub fn repeated(times: u16) -> Self {
        NonZeroU16::new(times).map_or(Self::Endless, Self::Repeated)
    }
}

impl Settings {
    /// So many frames a second, repeated so many times (0: for ever).
    pub fn new(fps: f64, repetitions: u16) -> Self {
        Self { fps, plays: Plays::repeated(repetitions), last_delay_cs: None }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::new(10.0, 0)
    }
}

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// Frames in the file.
    pub frames: u64,
    /// Frames left out because they would have been shown for less than two hundredths of a second.
    pub dropped: u64,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Time from the first frame to the end of the last, in hundredths of a second.
    pub duration_cs: u64,
    /// Length of the file.
    pub bytes: u64,
}

/// Writes an animation frame by frame.
///
/// See the [crate's documentation](crate) for what holds and for an example.
pub struct Encoder<W: Write> {
    settings: Settings,
    timeline: Timeline,
    pushed: u64,
    written: u64,
    duration_cs: u64,
    stage: Stage<W>,
}

enum Stage<W: Write> {
    Empty(W),
    Running(Box<Running<W>>),
    Failed,
}

struct Running<W: Write> {
    size: (u32, u32),
    file: gif::Encoder<Counting<W>>,
    quantiser: Quantiser,
}

impl<W: Write> Encoder<W> {
    /// Nothing is written before the first frame.
    ///
    /// # Errors
    ///
    /// [`Error::FrameRate`].
    pub fn new(writer: W, settings: Settings) -> Result<Self, Error> {
        let timeline = Timeline::new(settings.fps)?;
        Ok(Self { settings, timeline, pushed: 0, written: 0, duration_cs: 0, stage: Stage::Empty(writer) })
    }

    /// Adds the next frame, and writes the one before it.
    ///
    /// # Errors
    ///
    /// [`Error::Size`], [`Error::UnlikeSize`]: the frame is refused, and the next one may be pushed in its place.
    /// [`Error::Write`]: the animation is lost; so says every later call.
    pub fn push(&mut self, frame: RgbImage) -> Result<(), Error> {
        let number = self.pushed + 1;
        let found = frame.dimensions();
        if found.0.min(found.1) == 0 || found.0.max(found.1) > LONGEST_SIDE {
            return Err(Error::Size { frame: number, found });
        }
        if let Stage::Running(running) = &self.stage
            && running.size != found
        {
            return Err(Error::UnlikeSize { frame: number, found, expected: running.size });
        }
        let delay = self.timeline.advance();
        self.pushed = number;
        let Some(delay_cs) = delay else { return Ok(()) };

        let mut running = match std::mem::replace(&mut self.stage, Stage::Failed) {
            Stage::Empty(writer) => {
                let file = begin(writer, found, self.settings.plays)
                    .map_err(|source| Error::Write { frame: number, source })?;
                Box::new(Running { size: found, file, quantiser: Quantiser::new() })
            }
            Stage::Running(running) => running,
            Stage::Failed => return Err(self.failed_before()),
        };
        if let Some(block) = running.quantiser.push(frame, delay_cs) {
            self.write(&mut running.file, block)?;
        }
        self.stage = Stage::Running(running);
        Ok(())
    }

    /// Writes what is left and flushes the writer.
    ///
    /// # Errors
    ///
    /// [`Error::NoFrames`], [`Error::Write`].
    pub fn finish(mut self) -> Result<Summary, Error> {
        let Running { size, mut file, mut quantiser } =
            match std::mem::replace(&mut self.stage, Stage::Failed) {
                Stage::Empty(_) => return Err(Error::NoFrames),
                Stage::Running(running) => *running,
                Stage::Failed => return Err(self.failed_before()),
            };
        if let Some(mut block) = quantiser.finish() {
            block.delay_cs = self.settings.last_delay_cs.unwrap_or(block.delay_cs);
            self.write(&mut file, block)?;
        }
        let end = || {
            let mut counting = file.into_inner().map_err(into_io)?;
            counting.inner.flush()?;
            Ok(counting.bytes)
        };
        let Self { pushed, written, duration_cs, .. } = self;
        let bytes = end().map_err(|source| Error::Write { frame: written, source })?;
        Ok(Summary { frames: written, dropped: pushed - written, size, duration_cs, bytes })
    }

    fn write(&mut self, file: &mut gif::Encoder<Counting<W>>, block: Block) -> Result<(), Error> {
        let delay_cs = block.delay_cs;
        write(file, block).map_err(|source| Error::Write { frame: self.written + 1, source })?;
        self.written += 1;
        self.duration_cs += u64::from(delay_cs);
        Ok(())
    }

    fn failed_before(&self) -> Error {
        Error::Write { frame: self.written + 1, source: io::Error::other("writing has failed before") }
    }
}

fn begin<W: Write>(writer: W, size: (u32, u32), plays: Plays) -> io::Result<gif::Encoder<Counting<W>>> {
    let mut file = gif::Encoder::new(Counting { inner: writer, bytes: 0 }, size.0 as u16, size.1 as u16, &[])
        .map_err(into_io)?;
    let repeat = match plays {
        Plays::Endless => Some(Repeat::Infinite),
        // Without a word on repetitions a GIF is shown once.
        Plays::Once => None,
        Plays::Repeated(times) => Some(Repeat::Finite(times.get())),
    };
    repeat.map_or(Ok(()), |repeat| file.set_repeat(repeat)).map_err(into_io)?;
    Ok(file)
}

fn write<W: Write>(file: &mut gif::Encoder<Counting<W>>, block: Block) -> io::Result<()> {
    let Block { area, palette, transparent, delay_cs, data } = block;
    let frame = gif::Frame {
        delay: delay_cs,
        dispose: DisposalMethod::Keep,
        transparent,
        left: area.left as u16,
        top: area.top as u16,
        width: (area.right - area.left) as u16,
        height: (area.bottom - area.top) as u16,
        palette: Some(palette),
        buffer: data.into(),
        ..gif::Frame::default()
    };
    file.write_lzw_pre_encoded_frame(&frame).map_err(into_io)
}

fn into_io(error: gif::EncodingError) -> io::Error {
    match error {
        gif::EncodingError::Io(source) => source,
        other => io::Error::other(other),
    }
}

struct Counting<W> {
    inner: W,
    bytes: u64,
}

impl<W: Write> Write for Counting<W> {
    fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(buf)?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
