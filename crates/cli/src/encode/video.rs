//! Frames of YUV4MPEG2, the format that `-o -` and ffmpeg write.

use std::fmt;
use std::io::{self, Read};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, bail, ensure};
use image::{Rgb, RgbImage};
use rayfold_scene::Limits;
use y4m::Colorspace;

/// The supported pixel formats, for messages.
const EXPECTED: &str = "expected 8 bits a sample, as by ffmpeg's -pix_fmt yuv444p";

/// The first bytes of a stream.
pub(super) const SIGNATURE: &[u8; 8] = b"YUV4MPEG";

/// A stream whose header has been read.
#[derive(Clone)]
pub(super) struct Video {
    pub(super) size: (u32, u32),
    /// The frames per second.
    pub(super) fps: f64,
    layout: Layout,
    /// The decoder, until the frames are read.
    frames: Arc<Mutex<Option<y4m::Decoder<Counting>>>>,
    /// The number of bytes read.
    count: Arc<AtomicU64>,
}

/// The layout of the samples of a stream.
#[derive(Clone, Copy, Debug)]
struct Layout {
    shared: Option<(usize, usize)>,
    /// Whether levels are from 0 to 255, instead of 16 to 235.
    is_full: bool,
}

impl Video {
    /// Reads the header.
    ///
    /// # Errors
    /// When the header is invalid, or of an unsupported kind.
    pub(super) fn read(from: Box<dyn Read + Send>) -> anyhow::Result<Self> {
        let limits = y4m::Limits { bytes: 8 * Limits::PIXELS as usize };
        let count = Arc::new(AtomicU64::new(0));
        let from = Counting { from, count: Arc::clone(&count) };
        let decoder = y4m::Decoder::new_with_limits(from, limits).map_err(described)?;
        let side = |side: usize| u32::try_from(side).ok().filter(|side| *side > 0);
        let size = side(decoder.get_width()).zip(side(decoder.get_height())).context("it has no pixels")?;
        let rate = decoder.get_framerate();
        ensure!(rate.num > 0 && rate.den > 0, "its header lacks the frames a second");
        let header = String::from_utf8_lossy(decoder.get_raw_params()).into_owned();
        let is_full = header.split(' ').any(|word| word == "XCOLORRANGE=FULL");
        let shared = match decoder.get_colorspace() {
            Colorspace::C420 | Colorspace::C420jpeg | Colorspace::C420paldv | Colorspace::C420mpeg2 => {
                Some((2, 2))
            }
            Colorspace::C422 => Some((2, 1)),
            Colorspace::C444 => Some((1, 1)),
            Colorspace::Cmono => None,
            other => {
                bail!("its pixels are {other:?}: {EXPECTED}")
            }
        };
        let layout = Layout { shared, is_full };
        let fps = rate.num as f64 / rate.den as f64;
        Ok(Self { size, fps, layout, frames: Arc::new(Mutex::new(Some(decoder))), count })
    }

    /// Decodes the frames in order. A stream is read only once.
    ///
    /// # Errors
    /// Fails if the stream is cut off, or if `take` fails.
    pub(super) fn each(&self, mut take: impl FnMut(RgbImage) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let decoder = self.frames.lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut decoder = decoder.context("it can be read only once")?;
        loop {
            let before = self.count.load(Ordering::Relaxed);
            let frame = match decoder.read_frame() {
                Ok(frame) => frame,
                // The decoder returns the same error at an end within a frame.
                Err(y4m::Error::EOF) if self.count.load(Ordering::Relaxed) == before => return Ok(()),
                Err(error) => return Err(described(error)),
            };
            let planes = [frame.get_y_plane(), frame.get_u_plane(), frame.get_v_plane()];
            take(self.layout.image(self.size, planes))?;
        }
    }
}

/// A reader that counts its bytes.
struct Counting {
    from: Box<dyn Read + Send>,
    count: Arc<AtomicU64>,
}

impl Read for Counting {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.from.read(buffer)?;
        self.count.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }
}

impl fmt::Debug for Video {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Video").field("size", &self.size).field("fps", &self.fps).finish_non_exhaustive()
    }
}

impl Layout {
    /// Converts a frame to RGB by ITU-R BT.601.
    fn image(self, (width, height): (u32, u32), [luma, blue, red]: [&[u8]; 3]) -> RgbImage {
        let (black, whole, chroma) = if self.is_full { (0.0, 255.0, 255.0) } else { (16.0, 219.0, 224.0) };
        RgbImage::from_fn(width, height, |x, y| {
            let (x, y, columns) = (x as usize, y as usize, width as usize);
            let y_level = (f32::from(luma[y * columns + x]) - black) / whole;
            let Some((across, down)) = self.shared else { return Rgb([level(y_level); 3]) };
            let at = y / down * columns.div_ceil(across) + x / across;
            let (pb, pr) = ((f32::from(blue[at]) - 128.0) / chroma, (f32::from(red[at]) - 128.0) / chroma);
            let (r, b) = (y_level + 1.402 * pr, y_level + 1.772 * pb);
            Rgb([r, (y_level - 0.299 * r - 0.114 * b) / 0.587, b].map(level))
        })
    }
}

fn level(share: f32) -> u8 {
    (255.0 * share).round() as u8
}

fn described(error: y4m::Error) -> anyhow::Error {
    match error {
        y4m::Error::EOF => anyhow::anyhow!("it is cut off"),
        y4m::Error::IoError(source) => source.into(),
        y4m::Error::OutOfMemory => anyhow::anyhow!("its frames are larger than {} pixels", Limits::PIXELS),
        y4m::Error::UnknownColorspace => anyhow::anyhow!("its pixels are of an unknown kind: {EXPECTED}"),
        other => anyhow::anyhow!("it is no YUV4MPEG2 stream: {other}"),
    }
}
