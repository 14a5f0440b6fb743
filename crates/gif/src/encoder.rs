//! The encoder: takes frames, checks them, gives them their delays, and writes the blocks in order.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::num::NonZeroU16;

use gif::{DisposalMethod, Repeat};
use image::{DynamicImage, RgbImage, RgbaImage};

use crate::alone::{self, Alone};
use crate::block::Block;
use crate::error::{Error, LONGEST_SIDE};
use crate::exact::{self, FewColours};
use crate::quantise::Quantiser;
use crate::state::{StateReader, StateWriter, damaged};
use crate::thinning::{Thinning, read_size};
use crate::timeline::{MAX_FPS, Timeline};

/// The settings of an animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Frames per second: above 0, at least 100 / 65,535. Above 50, frames are dropped, but never the last.
    pub fps: f64,
    /// The number of times that the animation is shown.
    pub plays: Plays,
    /// The time that the last frame is shown, in hundredths of a second. Default: as `fps` says.
    pub last_delay_cs: Option<u16>,
    /// The times that frames are shown, in hundredths of a second, by the number of the frame as it is pushed, from 0.
    /// Default: as `fps` says, which is then at most 50.
    pub delays_cs: BTreeMap<u64, u16>,
    /// Keeps frames of at most 256 colours exact also in slow fades of large pictures. There the file may
    /// become several times larger.
    pub exact: bool,
}

/// The number of times that an animation is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Plays {
    /// The animation repeats without end.
    #[default]
    Endless,
    /// The animation is shown once, then the last frame stays.
    Once,
    /// The animation is shown once, and then repeated this many times.
    Repeated(NonZeroU16),
}

impl Plays {
    /// Converts a number of repetitions as a GIF stores it: 0 means endless.
    pub fn repeated(times: u16) -> Self {
        NonZeroU16::new(times).map_or(Self::Endless, Self::Repeated)
    }
}

impl Settings {
    /// Makes settings with a frame rate and a number of repetitions (0: endless).
    pub fn new(fps: f64, repetitions: u16) -> Self {
        let plays = Plays::repeated(repetitions);
        Self { fps, plays, last_delay_cs: None, delays_cs: BTreeMap::new(), exact: false }
    }

    /// Sets the times that frames are shown, in seconds, by the number of the frame as it is pushed, from 0.
    #[must_use]
    pub fn timed(self, seconds: &BTreeMap<u64, f64>) -> Self {
        // The conversion saturates.
        let delay_cs = |seconds: f64| (100.0 * seconds).round() as u16;
        Self {
            delays_cs: seconds.iter().map(|(frame, seconds)| (*frame, delay_cs(*seconds))).collect(),
            ..self
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::new(10.0, 0)
    }
}

/// The size and length of a finished animation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// The number of frames in the file.
    pub frames: u64,
    /// The number of frames left out because they would be shown for less than two hundredths of a second.
    pub dropped: u64,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Time from the first frame to the end of the last, in hundredths of a second.
    pub duration_cs: u64,
    /// The length of the file in bytes.
    pub bytes: u64,
}

/// An encoder that writes an animation frame by frame.
///
/// See the [crate's documentation](crate) for its guarantees and an example.
pub struct Encoder<W: Write> {
    settings: Settings,
    thinning: Thinning,
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
    /// The encoder that replaces the quantiser from the first frame with clear pixels on.
    alone: Option<Alone>,
}

/// A frame as it is drawn.
enum Frame {
    /// All of the frame is covered.
    Opaque(RgbImage),
    /// Some of the frame is clear.
    Clear(RgbaImage),
}

impl Frame {
    fn new(frame: DynamicImage) -> Self {
        match frame {
            DynamicImage::ImageRgba8(frame) if !alone::is_opaque(&frame) => Self::Clear(frame),
            other => Self::Opaque(other.into_rgb8()),
        }
    }
}

impl<W: Write> Running<W> {
    /// Takes the next frame, and returns the block of the one before it.
    fn push(&mut self, frame: Frame, delay_cs: u16) -> Option<Block> {
        if self.alone.is_none() && matches!(frame, Frame::Clear(_)) {
            // What was drawn so far can be cleared only as a whole.
            let before = self.quantiser.take_back();
            let mut alone = Alone::default();
            if let Some((frame, delay_cs)) = before {
                alone.push(DynamicImage::ImageRgb8(frame).into_rgba8(), delay_cs);
            }
            self.alone = Some(alone);
        }
        match (&mut self.alone, frame) {
            (Some(alone), Frame::Clear(frame)) => alone.push(frame, delay_cs),
            (Some(alone), Frame::Opaque(frame)) => {
                alone.push(DynamicImage::ImageRgb8(frame).into_rgba8(), delay_cs)
            }
            // No frame has clear pixels yet.
            (None, Frame::Opaque(frame)) => self.quantiser.push(frame, delay_cs),
            (None, Frame::Clear(_)) => None,
        }
    }
}

impl<W: Write> Encoder<W> {
    /// Makes an encoder. Writes nothing before the first frame.
    ///
    /// # Errors
    ///
    /// Returns [`Error::FrameRate`] if the format cannot hold the rate.
    pub fn new(writer: W, settings: Settings) -> Result<Self, Error> {
        let timeline = Timeline::new(settings.fps)?;
        if settings.fps > MAX_FPS && !settings.delays_cs.is_empty() {
            return Err(Error::TooFastForDelays { fps: settings.fps });
        }
        let thinning = Thinning::new(settings.fps, MAX_FPS);
        let stage = Stage::Empty(writer);
        Ok(Self { settings, thinning, timeline, pushed: 0, written: 0, duration_cs: 0, stage })
    }

    /// Adds the next frame, and writes the one before it. The frame has eight bits per channel, with or without alpha; others are
    /// converted.
    ///
    /// # Errors
    ///
    /// [`Error::Size`] and [`Error::UnlikeSize`]: the frame is refused, and another may be pushed in its place.
    /// [`Error::Write`]: the animation is lost, and every later call returns the same error.
    pub fn push(&mut self, frame: impl Into<DynamicImage>) -> Result<(), Error> {
        let number = self.pushed + 1;
        let frame: DynamicImage = frame.into();
        let frame = match frame {
            DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => frame,
            other if other.color().has_alpha() => other.into_rgba8().into(),
            other => other.into_rgb8().into(),
        };
        let found = (frame.width(), frame.height());
        if found.0.min(found.1) == 0 || found.0.max(found.1) > LONGEST_SIDE {
            return Err(Error::Size { frame: number, found });
        }
        let size = match &self.stage {
            Stage::Running(running) => Some(running.size),
            Stage::Empty(_) | Stage::Failed => self.thinning.size(),
        };
        if let Some(expected) = size.filter(|&size| size != found) {
            return Err(Error::UnlikeSize { frame: number, found, expected });
        }
        self.pushed = number;
        self.thinning.push(frame).map_or(Ok(()), |frame| self.encode(frame))
    }

    /// Adds the next frame as [`push`](Self::push) does, shown for `delay_cs` hundredths of a second.
    ///
    /// # Errors
    ///
    /// The errors of [`push`](Self::push), and [`Error::TooFastForDelays`].
    pub fn push_for(&mut self, frame: impl Into<DynamicImage>, delay_cs: u16) -> Result<(), Error> {
        if self.settings.fps > MAX_FPS {
            return Err(Error::TooFastForDelays { fps: self.settings.fps });
        }
        let place = self.timeline.handed_out();
        self.settings.delays_cs.insert(place, delay_cs);
        let pushed = self.push(frame);
        // Only what is to come matters.
        self.settings.delays_cs.remove(&place);
        pushed
    }

    /// Encodes a frame that is not dropped.
    fn encode(&mut self, frame: DynamicImage) -> Result<(), Error> {
        let (number, size) = (self.pushed, (frame.width(), frame.height()));
        let frame = Frame::new(frame);
        let place = self.timeline.handed_out();
        let by_rate = self.timeline.advance();
        let delay_cs = self.settings.delays_cs.get(&place).copied().unwrap_or(by_rate);
        let mut running = match std::mem::replace(&mut self.stage, Stage::Failed) {
            Stage::Empty(writer) => {
                let writer = Counting { inner: Some(writer), bytes: 0 };
                let of_file = match &frame {
                    Frame::Opaque(frame) => exact::palette_of_file(frame.as_raw().as_chunks().0),
                    Frame::Clear(_) => None,
                };
                let file = begin(writer, size, self.settings.plays, of_file.as_ref())
                    .map_err(|source| Error::Write { frame: number, source })?;
                let quantiser = Quantiser::new(self.settings.exact, of_file);
                Box::new(Running { size, file, quantiser, alone: None })
            }
            Stage::Running(running) => running,
            Stage::Failed => return Err(self.failed_before()),
        };
        if let Some(block) = running.push(frame, delay_cs) {
            self.write(&mut running.file, block)?;
        }
        self.stage = Stage::Running(running);
        Ok(())
    }

    /// Writes the remaining frames and flushes the writer.
    ///
    /// # Errors
    ///
    /// Returns [`Error::NoFrames`] if no frame was pushed, and [`Error::Write`] if the writer fails.
    pub fn finish(mut self) -> Result<Summary, Error> {
        if let Some(last) = self.thinning.finish() {
            self.encode(last)?;
        }
        let Running { size, mut file, mut quantiser, alone } =
            match std::mem::replace(&mut self.stage, Stage::Failed) {
                Stage::Empty(_) => return Err(Error::NoFrames),
                Stage::Running(running) => *running,
                Stage::Failed => return Err(self.failed_before()),
            };
        let last = match alone {
            Some(mut alone) => alone.finish(),
            None => quantiser.finish(),
        };
        if let Some(mut block) = last {
            block.delay_cs = self.settings.last_delay_cs.unwrap_or(block.delay_cs);
            self.write(&mut file, block)?;
        }
        let end = || {
            let mut counting = file.into_inner().map_err(into_io)?;
            counting.flush()?;
            Ok(counting.bytes)
        };
        let Self { pushed, written, duration_cs, .. } = self;
        let bytes = end().map_err(|source| Error::Write { frame: written, source })?;
        Ok(Summary { frames: written, dropped: pushed - written, size, duration_cs, bytes })
    }

    /// Returns the state of the animation. [`resume`](Self::resume) continues from it, also in another process.
    ///
    /// Keep everything that the writer has received so far. The state is compressed: mostly 2 to 4 bytes per pixel of
    /// a frame, at most about 7. Above 50 frames per second it takes up to 6 bytes per pixel more.
    ///
    /// # Errors
    ///
    /// Returns [`Error::Write`] if writing has failed before.
    pub fn suspend(self) -> Result<Vec<u8>, Error> {
        if matches!(self.stage, Stage::Failed) {
            return Err(self.failed_before());
        }
        let Self { settings, thinning, timeline, pushed, written, duration_cs, stage } = self;
        let write = |stage: Stage<W>| {
            let mut state = StateWriter::new();
            state.f64(settings.fps)?;
            let (plays, times) = match settings.plays {
                Plays::Endless => (ENDLESS, 0),
                Plays::Once => (ONCE, 0),
                Plays::Repeated(times) => (REPEATED, times.get()),
            };
            state.bytes(&[plays, u8::from(settings.last_delay_cs.is_some()), u8::from(settings.exact)])?;
            state.u16(times)?;
            state.u16(settings.last_delay_cs.unwrap_or_default())?;
            state.u64(settings.delays_cs.len() as u64)?;
            for (frame, delay_cs) in &settings.delays_cs {
                state.u64(*frame)?;
                state.u16(*delay_cs)?;
            }
            for count in [pushed, written, duration_cs, timeline.handed_out()] {
                state.u64(count)?;
            }
            thinning.write(&mut state)?;
            match stage {
                Stage::Empty(_) | Stage::Failed => state.bytes(&[EMPTY])?,
                Stage::Running(running) => {
                    let Running { size, mut file, quantiser, alone } = *running;
                    // The file is not finished, so its trailer must not be written.
                    file.get_mut().inner = None;
                    state.bytes(&[RUNNING])?;
                    for number in [size.0.into(), size.1.into(), file.get_ref().bytes] {
                        state.u64(number)?;
                    }
                    let of_file = quantiser.of_file().map_or(&[][..], |of_file| &of_file.colours);
                    state.u16(of_file.len() as u16)?;
                    state.bytes(of_file.as_flattened())?;
                    state.bytes(&[u8::from(alone.is_some())])?;
                    match alone {
                        Some(alone) => alone.write(&mut state)?,
                        None => quantiser.write(&mut state)?,
                    }
                }
            }
            state.finish()
        };
        write(stage).map_err(|source| Error::Write { frame: written + 1, source })
    }

    /// Continues an animation that was [suspended](Self::suspend). The bytes that it writes
    /// follow those written before.
    ///
    /// # Errors
    ///
    /// [`Error::StateVersion`] and [`Error::State`]: encode the animation from its beginning.
    pub fn resume(writer: W, state: &[u8]) -> Result<Self, Error> {
        let mut state = StateReader::new(state)?;
        let (fps, plays, has_last_delay, exact) =
            (state.f64()?, state.u8()?, state.u8()? != 0, state.u8()? != 0);
        let (times, last_delay_cs) = (state.u16()?, state.u16()?);
        let plays = match (plays, NonZeroU16::new(times)) {
            (ENDLESS, _) => Plays::Endless,
            (ONCE, _) => Plays::Once,
            (REPEATED, Some(times)) => Plays::Repeated(times),
            _ => return Err(damaged("it says not how often it is shown")),
        };
        let mut delays_cs = BTreeMap::new();
        for _ in 0..state.u64()? {
            delays_cs.insert(state.u64()?, state.u16()?);
        }
        let last_delay_cs = has_last_delay.then_some(last_delay_cs);
        let settings = Settings { fps, plays, last_delay_cs, delays_cs, exact };
        let (pushed, written, duration_cs, timed) = (state.u64()?, state.u64()?, state.u64()?, state.u64()?);
        if written > timed || timed > pushed || pushed > MAX_COUNTED || duration_cs > MAX_COUNTED {
            return Err(damaged("it has frames that there cannot be"));
        }
        let timeline = Timeline::new(fps).map_err(|_| damaged("its frame rate is wrong"))?.after(timed);
        let thinning = Thinning::new(fps, MAX_FPS).read(&mut state, pushed)?;
        let stage = match state.u8()? {
            EMPTY => Stage::Empty(writer),
            RUNNING => {
                let size = read_size(&mut state)?;
                if thinning.size().is_some_and(|held| held != size) {
                    return Err(damaged("a frame that it holds has another size"));
                }
                let bytes = state.u64()?;
                if bytes > MAX_COUNTED {
                    return Err(damaged("it is longer than there can be"));
                }
                let count = usize::from(state.u16()?);
                let colours = state.bytes(3 * count)?;
                let of_file = exact::palette_of_file(colours.as_chunks().0).filter(|_| count > 0);
                if of_file.as_ref().map_or(0, |of_file| of_file.colours.len()) != count {
                    return Err(damaged("its palette has a colour twice"));
                }
                // The beginning of the file is written already.
                let nowhere = Counting { inner: None, bytes: 0 };
                let mut file = begin(nowhere, size, plays, of_file.as_ref())
                    .map_err(|source| Error::State { source })?;
                let (quantiser, alone) = if state.u8()? == 0 {
                    (Quantiser::read(&mut state, size, exact, of_file)?, None)
                } else {
                    (Quantiser::new(exact, of_file), Some(Alone::read(&mut state, size)?))
                };
                *file.get_mut() = Counting { inner: Some(writer), bytes };
                Stage::Running(Box::new(Running { size, file, quantiser, alone }))
            }
            _ => return Err(damaged("it is neither begun nor not")),
        };
        state.finish()?;
        Ok(Self { settings, thinning, timeline, pushed, written, duration_cs, stage })
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

/// Tags of a suspended animation: the number of times it is shown, then whether it has a frame.
const ENDLESS: u8 = 0;
const ONCE: u8 = 1;
const REPEATED: u8 = 2;
const EMPTY: u8 = 0;
const RUNNING: u8 = 1;

/// A limit on the frames, hundredths of a second and bytes in a state. No animation reaches it, and below it no count
/// overflows after a resume.
const MAX_COUNTED: u64 = 1 << 52;

fn begin<W: Write>(
    writer: Counting<W>,
    size: (u32, u32),
    plays: Plays,
    of_file: Option<&FewColours>,
) -> io::Result<gif::Encoder<Counting<W>>> {
    // The index behind the colours is transparent.
    let filler = of_file.map(|_| [0; 3]);
    let colours = of_file.into_iter().flat_map(|of_file| &of_file.colours).chain(&filler);
    let palette: Vec<u8> = colours.flatten().copied().collect();
    let mut file = gif::Encoder::new(writer, size.0 as u16, size.1 as u16, &palette).map_err(into_io)?;
    let repeat = match plays {
        Plays::Endless => Some(Repeat::Infinite),
        // A GIF without a repeat count is shown once.
        Plays::Once => None,
        Plays::Repeated(times) => Some(Repeat::Finite(times.get())),
    };
    repeat.map_or(Ok(()), |repeat| file.set_repeat(repeat)).map_err(into_io)?;
    Ok(file)
}

fn write<W: Write>(file: &mut gif::Encoder<Counting<W>>, block: Block) -> io::Result<()> {
    let Block { area, palette, is_of_file, transparent, delay_cs, clears, data } = block;
    let frame = gif::Frame {
        delay: delay_cs,
        dispose: if clears { DisposalMethod::Background } else { DisposalMethod::Keep },
        transparent,
        left: area.left as u16,
        top: area.top as u16,
        width: (area.right - area.left) as u16,
        height: (area.bottom - area.top) as u16,
        palette: (!is_of_file).then_some(palette),
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
    /// `None` if the output of the file's encoder is to be discarded, as at the file's beginning and end.
    inner: Option<W>,
    bytes: u64,
}

impl<W: Write> Write for Counting<W> {
    fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
        let written = self.inner.as_mut().map_or(Ok(buf.len()), |inner| inner.write(buf))?;
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.as_mut().map_or(Ok(()), Write::flush)
    }
}
