//! Animated lossless WebP, as browsers show it. Each frame contains only the rectangle that has changed.
//!
//! `image-webp` encodes the pictures. The container is that of RFC 9649: the canvas (VP8X), the number of repetitions
//! (ANIM), and a chunk for each frame (ANMF). The first chunk contains the length of the file, so that is written last.

use std::io::{self, Write};

use image::DynamicImage;
use image_webp::{ColorType, WebPEncoder};
use rayfold_gif::{Plays, Thinning};

use crate::apng::{MAX_FPS, changed};
use crate::state::{Counts, DAMAGED, State};
use crate::{Error, Movie};

/// The largest side of a picture in pixels.
const LONGEST_SIDE: u32 = 16_384;

/// The offset of the field with the length of the rest of the file.
const LENGTH_AT: u64 = 4;

/// Flags of the canvas and of a frame.
const ANIMATED: u8 = 1 << 1;
const ALPHA: u8 = 1 << 4;
const OVERWRITES: u8 = 1 << 1;

/// An encoder of frames.
pub(crate) struct WebP<W: Write> {
    out: W,
    movie: Movie,
    thinning: Thinning,
    pushed: u64,
    written: u64,
    bytes: u64,
    /// The previous frame and its chunk, whose duration is known when the next frame comes.
    last: Option<(DynamicImage, Chunk)>,
}

/// A picture, with its place on the canvas and its duration.
struct Chunk {
    place: (u32, u32),
    size: (u32, u32),
    ms: u32,
    picture: Vec<u8>,
}

/// The bytes that are to be written last, with their offset in the file.
pub type Length = (u64, [u8; 4]);

impl<W: Write> WebP<W> {
    /// # Errors
    /// The writer's errors, and one when the animation exceeds the limits of the format.
    pub(crate) fn new(out: W, movie: Movie) -> io::Result<Self> {
        let (width, height) = movie.size;
        if width.max(height) > LONGEST_SIDE {
            let message =
                format!("a WebP has {LONGEST_SIDE} pixels on a side at most, not {width} x {height}");
            return Err(io::Error::other(message));
        }
        let thinning = Thinning::new(movie.fps, MAX_FPS);
        let mut webp = Self { out, movie, thinning, pushed: 0, written: 0, bytes: 0, last: None };
        webp.write(b"RIFF\0\0\0\0WEBP")?;
        webp.write(b"VP8X\x0a\0\0\0")?;
        webp.write(&[if movie.alpha { ANIMATED | ALPHA } else { ANIMATED }, 0, 0, 0])?;
        webp.write(&[u24(width - 1), u24(height - 1)].concat())?;
        webp.write(b"ANIM\x06\0\0\0\0\0\0\0")?;
        let times: u16 = match movie.plays {
            Plays::Endless => 0,
            Plays::Once => 1,
            Plays::Repeated(times) => times.get().saturating_add(1),
        };
        webp.write(&times.to_le_bytes())?;
        Ok(webp)
    }

    /// Returns the state after the frames so far.
    pub(crate) fn suspend(self) -> State {
        let Self { thinning, pushed, written, bytes, last, .. } = self;
        let held = thinning.held().cloned().collect();
        let (last, chunk) = last.unzip();
        let place = |chunk: &Chunk| [chunk.place.0, chunk.place.1, chunk.size.0, chunk.size.1, chunk.ms];
        let counts = Counts { pushed, written, counted: bytes, chunk: chunk.as_ref().map(place) };
        State { counts, last, held, picture: chunk.map(|chunk| chunk.picture).unwrap_or_default() }
    }

    /// Continues a file.
    ///
    /// # Errors
    /// A state that there cannot be.
    pub(crate) fn resume(out: W, movie: Movie, state: State) -> Result<Self, Error> {
        let State { counts: Counts { pushed, written, counted, chunk }, last, held, picture } = state;
        let thinning = Thinning::new(movie.fps, MAX_FPS).after(pushed, held).ok_or(DAMAGED)?;
        let chunk = chunk.map(|[left, top, width, height, ms]| Chunk {
            place: (left, top),
            size: (width, height),
            ms,
            picture,
        });
        if last.is_some() != chunk.is_some()
            || written > pushed
            || chunk.as_ref().is_some_and(|chunk| chunk.picture.is_empty())
        {
            return Err(DAMAGED);
        }
        Ok(Self { out, movie, thinning, pushed, written, bytes: counted, last: last.zip(chunk) })
    }

    /// Takes the next frame, of the same size as the others, and its duration in seconds if that differs from theirs.
    ///
    /// # Errors
    /// The writer's errors.
    pub(crate) fn push(&mut self, frame: DynamicImage, seconds: Option<f64>) -> io::Result<()> {
        if seconds.is_some() && self.movie.fps > MAX_FPS {
            let message =
                format!("where frames have times of their own, at most {MAX_FPS} a second are possible");
            return Err(io::Error::other(message));
        }
        self.pushed += 1;
        self.thinning.push(frame).map_or(Ok(()), |frame| self.add(frame, seconds))
    }

    fn add(&mut self, frame: DynamicImage, seconds: Option<f64>) -> io::Result<()> {
        let start = |number: u64| (number as f64 * 1_000.0 / self.thinning.fps()).round();
        let ms = seconds.map_or_else(|| start(self.written + 1) - start(self.written), |s| 1_000.0 * s);
        let last = self.last.take();
        let (left, top, width, height) = match &last {
            None => (0, 0, frame.width(), frame.height()),
            Some((last, _)) => {
                let (left, top, width, height) = changed(last, &frame);
                // The coordinates of a place are even.
                (left & !1, top & !1, width + left % 2, height + top % 2)
            }
        };
        let mut file = Vec::new();
        let part = frame.crop_imm(left, top, width, height);
        let color = if self.movie.alpha { ColorType::Rgba8 } else { ColorType::Rgb8 };
        WebPEncoder::new(&mut file)
            .encode(part.as_bytes(), width, height, color)
            .map_err(io::Error::other)?;
        // The only chunk starts after the header of the file.
        let picture = file.split_off(12);
        if let Some((_, chunk)) = last {
            self.write_chunk(&chunk)?;
        }
        self.written += 1;
        let chunk = Chunk { place: (left, top), size: (width, height), ms: ms.round() as u32, picture };
        self.last = Some((frame, chunk));
        Ok(())
    }

    /// Returns the number of frames that were left out, and the length field, which must be written at the start of the
    /// file.
    ///
    /// # Errors
    /// The writer's errors, and one when the file is longer than the format allows.
    pub(crate) fn finish(mut self) -> io::Result<(u64, Length)> {
        if let Some(last) = self.thinning.finish() {
            self.add(last, None)?;
        }
        if let Some((_, mut chunk)) = self.last.take() {
            chunk.ms = self.movie.last_delay_cs.map_or(chunk.ms, |hundredths| 10 * u32::from(hundredths));
            self.write_chunk(&chunk)?;
        }
        self.out.flush()?;
        let length =
            u32::try_from(self.bytes - 8).map_err(|_| io::Error::other("a WebP has at most 4 GB"))?;
        Ok((self.pushed - self.written, (LENGTH_AT, length.to_le_bytes())))
    }

    fn write_chunk(&mut self, chunk: &Chunk) -> io::Result<()> {
        let Chunk { place: (left, top), size: (width, height), ms, picture } = chunk;
        let numbers = [left / 2, top / 2, width - 1, height - 1, *ms].map(u24).concat();
        let length = (numbers.len() + 1 + picture.len()) as u32;
        self.write(b"ANMF")?;
        self.write(&length.to_le_bytes())?;
        self.write(&numbers)?;
        self.write(&[OVERWRITES])?;
        self.write(picture)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.bytes += bytes.len() as u64;
        self.out.write_all(bytes)
    }
}

/// Encodes a number in three bytes, the lowest first.
fn u24(number: u32) -> [u8; 3] {
    let [a, b, c, _] = number.to_le_bytes();
    [a, b, c]
}
