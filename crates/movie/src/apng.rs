//! APNG: a lossless animation for browsers. Only the changed rectangle of each frame is written.

use std::io::{self, Write};

use image::DynamicImage;
use png::{BitDepth, ColorType, Compression, EncodingError};
use rayfold_gif::{Plays, Thinning};

use crate::rate::fraction;
use crate::state::{Counts, DAMAGED, State};
use crate::{Error, Movie};

/// The unit in which a frame's duration is counted if a second is no whole number of frames: milliseconds, or
/// hundredths if milliseconds do not fit the format's 16 bits.
const PARTS: [u16; 2] = [1_000, 100];

/// The maximum frame rate of browsers: they show a frame of 10 ms or less for 100 ms, and round down to whole
/// milliseconds. At a higher rate frames are dropped, as in a GIF.
pub const MAX_FPS: f64 = 90.0;

/// The first bytes of a PNG.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// An encoder of frames.
pub(crate) struct Apng<W: Write> {
    out: W,
    movie: Movie,
    thinning: Thinning,
    /// The number of frames that the file will have, and the number so far.
    frames: u64,
    written: u64,
    pushed: u64,
    /// The sequence number of the next chunk that has one: the description of a frame, or the data of any frame but the
    /// first.
    next: u32,
    last: Option<DynamicImage>,
}

impl<W: Write> Apng<W> {
    /// # Errors
    /// Fails if the writer does, or if the animation exceeds the limits of the format.
    pub(crate) fn new(out: W, movie: Movie) -> io::Result<Self> {
        let mut apng = Self::after(out, movie, Thinning::new(movie.fps, MAX_FPS))?;
        let count = u32::try_from(apng.frames).map_err(io::Error::other)?;
        let (width, height) = movie.size;
        apng.out.write_all(SIGNATURE)?;
        let kind = if movie.alpha { ColorType::Rgba } else { ColorType::Rgb };
        let form = [8, kind as u8, 0, 0, 0];
        apng.chunk(*b"IHDR", &[&width.to_be_bytes()[..], &height.to_be_bytes(), &form].concat())?;
        apng.chunk(*b"acTL", &[count.to_be_bytes(), plays(movie.plays).to_be_bytes()].concat())?;
        Ok(apng)
    }

    fn after(out: W, movie: Movie, thinning: Thinning) -> io::Result<Self> {
        let known = movie.frames.ok_or_else(|| {
            io::Error::other("an .apng begins with the number of its frames, which a video does not say: make a .gif or .webp of it")
        })?;
        let frames = thinning.left_of(known);
        Ok(Self { out, movie, thinning, frames, written: 0, pushed: 0, next: 0, last: None })
    }

    /// Returns the state after the frames so far.
    pub(crate) fn suspend(self) -> State {
        let Self { thinning, written, pushed, next, last, .. } = self;
        let held = thinning.held().cloned().collect();
        let counts = Counts { pushed, written, counted: next.into(), chunk: None };
        State { counts, last, held, picture: Vec::new() }
    }

    /// Continues a file.
    ///
    /// # Errors
    /// A state that there cannot be.
    pub(crate) fn resume(out: W, movie: Movie, state: State) -> Result<Self, Error> {
        let State { counts: Counts { pushed, written, counted, .. }, last, held, picture } = state;
        let thinning = Thinning::new(movie.fps, MAX_FPS).after(pushed, held).ok_or(DAMAGED)?;
        let apng = Self::after(out, movie, thinning)?;
        let next = u32::try_from(counted).map_err(|_| DAMAGED)?;
        if last.is_some() != (written > 0) || written > pushed.min(apng.frames) || !picture.is_empty() {
            return Err(DAMAGED);
        }
        Ok(Self { written, pushed, next, last, ..apng })
    }

    /// Takes the next frame, of the same size as the others, and its duration in seconds if that differs from theirs.
    ///
    /// # Errors
    /// The writer's.
    pub(crate) fn push(&mut self, frame: DynamicImage, seconds: Option<f64>) -> io::Result<()> {
        if seconds.is_some() && self.movie.fps > MAX_FPS {
            let message =
                format!("where frames have times of their own, at most {MAX_FPS} a second are possible");
            return Err(io::Error::other(message));
        }
        self.pushed += 1;
        self.thinning.push(frame).map_or(Ok(()), |frame| self.write(frame, seconds))
    }

    fn write(&mut self, frame: DynamicImage, seconds: Option<f64>) -> io::Result<()> {
        let (number, whole) = (self.written, (0, 0, frame.width(), frame.height()));
        self.written += 1;
        if self.written > self.frames {
            return Err(io::Error::other(format!(
                "there are more frames than the {} announced",
                self.frames
            )));
        }
        let (left, top, width, height) = self.last.as_ref().map_or(whole, |last| changed(last, &frame));
        let (time, parts) = match self.movie.last_delay_cs {
            Some(hundredths) if self.written == self.frames => (hundredths, 100),
            _ => seconds.map_or_else(|| delay(self.thinning.fps(), number), in_parts),
        };
        let numbers = [self.number()?, width, height, left, top].map(u32::to_be_bytes).concat();
        let times = [time, parts].map(u16::to_be_bytes).concat();
        // The frame stays when the next one comes, and replaces what is below it.
        self.chunk(*b"fcTL", &[&numbers[..], &times, &[0, 0]].concat())?;
        let part = frame.crop_imm(left, top, width, height);
        for data in compressed(&part)? {
            match number {
                0 => self.chunk(*b"IDAT", &data)?,
                _ => {
                    let number = self.number()?.to_be_bytes();
                    self.chunk(*b"fdAT", &[&number[..], &data].concat())?;
                }
            }
        }
        self.last = Some(frame);
        Ok(())
    }

    fn number(&mut self) -> io::Result<u32> {
        let number = self.next;
        self.next =
            number.checked_add(1).ok_or_else(|| io::Error::other("an APNG has no room for more frames"))?;
        Ok(number)
    }

    /// Writes a chunk: its length, its kind, its data and their checksum.
    fn chunk(&mut self, kind: [u8; 4], data: &[u8]) -> io::Result<()> {
        let length = u32::try_from(data.len()).map_err(io::Error::other)?;
        let mut checksum = crc32fast::Hasher::new();
        checksum.update(&kind);
        checksum.update(data);
        self.out.write_all(&length.to_be_bytes())?;
        self.out.write_all(&kind)?;
        self.out.write_all(data)?;
        self.out.write_all(&checksum.finalize().to_be_bytes())
    }

    /// Returns how many frames were left out.
    ///
    /// # Errors
    /// Fails if the writer does, or if there are fewer frames than announced.
    pub(crate) fn finish(mut self) -> io::Result<u64> {
        if let Some(last) = self.thinning.finish() {
            self.write(last, None)?;
        }
        if self.written < self.frames {
            let message = format!("there are {} frames, not the {} announced", self.written, self.frames);
            return Err(io::Error::other(message));
        }
        self.chunk(*b"IEND", &[])?;
        self.out.flush()?;
        Ok(self.movie.frames.unwrap_or_default() - self.frames)
    }
}

/// Compresses the pixels of a picture as a PNG does. Returns the data of its `IDAT` chunks.
fn compressed(picture: &DynamicImage) -> io::Result<Vec<Vec<u8>>> {
    let mut bytes = Vec::new();
    let mut file = png::Encoder::new(&mut bytes, picture.width(), picture.height());
    file.set_color(if picture.color().has_alpha() { ColorType::Rgba } else { ColorType::Rgb });
    file.set_depth(BitDepth::Eight);
    file.set_compression(Compression::Balanced);
    let mut file = file.write_header().map_err(into_io)?;
    file.write_image_data(picture.as_bytes()).map_err(into_io)?;
    file.finish().map_err(into_io)?;
    let (mut data, mut rest) = (Vec::new(), &bytes[SIGNATURE.len()..]);
    while let Some((head, after)) = rest.split_first_chunk::<8>() {
        let [a, b, c, d, kind @ ..] = *head;
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        if kind == *b"IDAT" {
            data.push(after[..length].to_vec());
        }
        rest = &after[length + 4..];
    }
    Ok(data)
}

/// Returns the number of times that the animation is shown, as the format counts: 0 for ever.
fn plays(plays: Plays) -> u32 {
    match plays {
        Plays::Endless => 0,
        Plays::Once => 1,
        Plays::Repeated(times) => u32::from(times.get()) + 1,
    }
}

/// Returns the duration of frame `k`, counted from 0, as a fraction of a second. Rounding errors do not add up.
fn delay(fps: f64, number: u64) -> (u16, u16) {
    if let (frames @ 1..=65_535, seconds @ 1..=65_535) = fraction(fps) {
        return (seconds as u16, frames as u16);
    }
    let fits = |parts: &&u16| f64::from(**parts) / fps < f64::from(u16::MAX);
    let parts = *PARTS.iter().find(fits).unwrap_or(&PARTS[1]);
    let start = |number: u64| (number as f64 * f64::from(parts) / fps).round();
    ((start(number + 1) - start(number)) as u16, parts)
}

/// Returns a time as a fraction of a second: numerator and denominator.
fn in_parts(seconds: f64) -> (u16, u16) {
    let ms = seconds * 1_000.0;
    if (ms - ms.round()).abs() > 1e-9 * ms
        && let (time @ 1..=65_535, parts @ 1..=65_535) = fraction(seconds)
    {
        return (time as u16, parts as u16);
    }
    let parts = if ms <= 65_535.0 { 1_000 } else { 100 };
    ((seconds * f64::from(parts)).round() as u16, parts)
}

/// Returns column, row, width and height of the area that differs. It is a single pixel if nothing differs, because a
/// frame must have one.
pub(crate) fn changed(last: &DynamicImage, frame: &DynamicImage) -> (u32, u32, u32, u32) {
    let (width, height) = (frame.width(), frame.height());
    let (each, bytes) =
        (usize::from(frame.color().bytes_per_pixel()), [last, frame].map(DynamicImage::as_bytes));
    let differs = |x: u32, y: u32| {
        let at = (y as usize * width as usize + x as usize) * each;
        bytes[0][at..at + each] != bytes[1][at..at + each]
    };
    let rows: Vec<u32> = (0..height).filter(|&y| (0..width).any(|x| differs(x, y))).collect();
    let (Some(&top), Some(&bottom)) = (rows.first(), rows.last()) else { return (0, 0, 1, 1) };
    let is_in = |x: &u32| rows.iter().any(|&y| differs(*x, y));
    let left = (0..width).find(is_in).unwrap_or(0);
    let right = (0..width).rfind(is_in).unwrap_or(left);
    (left, top, right + 1 - left, bottom + 1 - top)
}

fn into_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(source) => source,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};

    #[test]
    fn what_has_changed_is_a_rectangle() {
        let blank = RgbImage::new(9, 7);
        let between = |a: &RgbImage, b: &RgbImage| changed(&a.clone().into(), &b.clone().into());
        assert_eq!(between(&blank, &blank), (0, 0, 1, 1));
        let mut frame = blank.clone();
        frame.put_pixel(2, 6, Rgb([0, 0, 1]));
        assert_eq!(between(&blank, &frame), (2, 6, 1, 1));
        frame.put_pixel(8, 3, Rgb([9, 0, 0]));
        assert_eq!(between(&blank, &frame), (2, 3, 7, 4));
        let mut clear = image::RgbaImage::new(9, 7);
        clear.put_pixel(4, 5, image::Rgba([0, 0, 0, 1]));
        assert_eq!(changed(&image::RgbaImage::new(9, 7).into(), &clear.into()), (4, 5, 1, 1));
    }

    #[test]
    fn times_never_drift() {
        for fps in [0.01, 0.7, 12.5, 23.976, 25.0, 29.97, 999.5] {
            let mut at = 0.0;
            for number in 0..1_000 {
                assert!((at - number as f64 / fps).abs() <= 0.0051, "{fps} fps, frame {number}: {at}");
                let (time, parts) = delay(fps, number);
                at += f64::from(time) / f64::from(parts);
            }
        }
    }
}
