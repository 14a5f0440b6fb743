//! Encodes ordered frames into one file of an animation: GIF, APNG, WebP or YUV4MPEG2.
//!
//! An [`Encoding`] takes the frames one by one and writes as it goes, so that memory does not grow with their number.
//! [`Encoding::suspend`] stops between two frames, and [`Encoding::resume`] continues in another process, with the same
//! bytes (`state`). `rayfold-gif` encodes GIFs; the other containers are the modules `apng`, `webp` and `y4m`. Every
//! program that writes animations uses this crate, so that the same frames give the same bytes everywhere.

mod apng;
mod rate;
mod state;
mod webp;
mod y4m;

use std::io::{self, Write};

use image::{DynamicImage, RgbImage};
pub use rayfold_gif::Plays;
use rayfold_gif::{Encoder, Settings};
pub use rayfold_scene::{Container, UnknownContainer};

use apng::Apng;
pub use apng::MAX_FPS;
use state::State;
pub use webp::Length;
use webp::WebP;
use y4m::Y4m;

/// The properties of an animation that are known before its first frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movie {
    /// The columns and rows.
    pub size: (u32, u32),
    /// The number of frames, each counted as often as it is shown; `None` for a video that is read, where it is not
    /// known.
    pub frames: Option<u64>,
    /// The frames per second.
    pub fps: f64,
    /// The number of times that it is shown.
    pub plays: Plays,
    /// The duration of the last frame in hundredths of a second, if it differs from that of the others.
    pub last_delay_cs: Option<u16>,
    /// Whether a GIF keeps frames of at most 256 colours exactly, whatever that takes.
    pub exact: bool,
    /// Whether frames may have alpha. An APNG or a WebP then has alpha in all frames.
    pub alpha: bool,
}

/// The error of an [`Encoding`].
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The writer failed, or the frames exceed the limits of the container.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// The GIF encoder's error, other than the writer's.
    #[error(transparent)]
    Gif(rayfold_gif::Error),
    /// A frame is not as large as the animation.
    #[error("the frame is {} x {} pixels, the frames before it are {} x {}", found.0, found.1, expected.0, expected.1)]
    Size {
        /// The columns and rows of the frame.
        found: (u32, u32),
        /// The columns and rows of the animation.
        expected: (u32, u32),
    },
    /// The state of an unfinished file cannot be read.
    #[error("the state of the unfinished file cannot be used: {0}")]
    State(&'static str),
}

impl From<rayfold_gif::Error> for Error {
    fn from(error: rayfold_gif::Error) -> Self {
        match error {
            rayfold_gif::Error::Write { source, .. } => Self::Write(source),
            other => Self::Gif(other),
        }
    }
}

/// The end of an [`Encoding`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finished {
    /// The number of frames that were left out because players of the container have no time for them.
    pub dropped: u64,
    /// The bytes that are still to be written over others at the start of the file; only a WebP has them.
    pub length: Option<Length>,
}

/// Frames on their way into a file.
pub struct Encoding<W: Write> {
    kind: Kind<W>,
    size: (u32, u32),
    alpha: bool,
}

enum Kind<W: Write> {
    Gif(Box<Encoder<W>>),
    Apng(Box<Apng<W>>),
    Webp(Box<WebP<W>>),
    Y4m(Y4m<W>),
}

impl<W: Write> std::fmt::Debug for Encoding<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Encoding").finish_non_exhaustive()
    }
}

impl<W: Write> Encoding<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// Fails if the writer does, or if the animation is beyond the limits of the container.
    pub fn begin(out: W, container: Container, movie: Movie) -> Result<Self, Error> {
        let Movie { size, fps, plays, last_delay_cs, exact, alpha, .. } = movie;
        let settings = Settings { fps, plays, last_delay_cs, exact, ..Settings::default() };
        let kind = match container {
            Container::Gif => Kind::Gif(Box::new(Encoder::new(out, settings)?)),
            Container::Apng => Kind::Apng(Box::new(Apng::new(out, movie)?)),
            Container::Webp => Kind::Webp(Box::new(WebP::new(out, movie)?)),
            Container::Y4m => Kind::Y4m(Y4m::new(out, size, fps)?),
        };
        Ok(Self { kind, size, alpha })
    }

    /// Returns the state of the unfinished file. [`resume`](Self::resume) continues from it, also in another process. Keep
    /// everything that the writer has received.
    ///
    /// # Errors
    /// Fails if writing has failed before.
    pub fn suspend(self) -> Result<Vec<u8>, Error> {
        match self.kind {
            Kind::Gif(encoder) => Ok(encoder.suspend()?),
            Kind::Apng(encoder) => Ok(encoder.suspend().encode()),
            Kind::Webp(encoder) => Ok(encoder.suspend().encode()),
            Kind::Y4m(_) => Ok(State::default().encode()),
        }
    }

    /// Continues a file that was [suspended](Self::suspend), with the container and the properties that it began with. The
    /// bytes that it writes follow those written before.
    ///
    /// # Errors
    /// Fails if the state is damaged, or of another version of the encoder: encode the animation from its beginning.
    pub fn resume(out: W, container: Container, movie: Movie, state: &[u8]) -> Result<Self, Error> {
        let Movie { size, alpha, .. } = movie;
        let kind = match container {
            Container::Gif => Kind::Gif(Box::new(Encoder::resume(out, state)?)),
            Container::Apng => {
                Kind::Apng(Box::new(Apng::resume(out, movie, State::decode(state, movie.size)?)?))
            }
            Container::Webp => {
                Kind::Webp(Box::new(WebP::resume(out, movie, State::decode(state, movie.size)?)?))
            }
            Container::Y4m => {
                State::decode(state, movie.size)?;
                Kind::Y4m(Y4m::resume(out))
            }
        };
        Ok(Self { kind, size, alpha })
    }

    /// Takes the next frame, and its duration in seconds if that differs from that of the others. A [`Container::Y4m`]
    /// has no durations and ignores them. Alpha that the file cannot hold, or that was not [announced](Movie::alpha), is put
    /// [over black](over).
    ///
    /// # Errors
    /// Fails if the writer does, if the frame is not as large as the animation, or if it is beyond the limits of the container.
    pub fn push(&mut self, frame: impl Into<DynamicImage>, seconds: Option<f64>) -> Result<(), Error> {
        let frame: DynamicImage = frame.into();
        let found = (frame.width(), frame.height());
        // The encoder of GIFs says which frame it is.
        if found != self.size && !matches!(self.kind, Kind::Gif(_)) {
            return Err(Error::Size { found, expected: self.size });
        }
        let frame = match (frame.color().has_alpha(), &self.kind) {
            (true, Kind::Gif(_)) if self.alpha => frame.into_rgba8().into(),
            (has_alpha, Kind::Apng(_) | Kind::Webp(_)) if self.alpha => match has_alpha {
                true => frame.into_rgba8().into(),
                false => opaque(frame.into_rgb8()),
            },
            _ => over(frame, [0; 3]).into(),
        };
        match (&mut self.kind, seconds) {
            (Kind::Gif(encoder), None) => Ok(encoder.push(frame)?),
            // The conversion saturates.
            (Kind::Gif(encoder), Some(seconds)) => {
                Ok(encoder.push_for(frame, (100.0 * seconds).round() as u16)?)
            }
            (Kind::Apng(encoder), seconds) => Ok(encoder.push(frame, seconds)?),
            (Kind::Webp(encoder), seconds) => Ok(encoder.push(frame, seconds)?),
            (Kind::Y4m(encoder), _) => Ok(encoder.push(&frame.into_rgb8())?),
        }
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Fails if the writer does, or if the file is beyond the limits of the container.
    pub fn finish(self) -> Result<Finished, Error> {
        let (dropped, length) = match self.kind {
            Kind::Gif(encoder) => (encoder.finish()?.dropped, None),
            Kind::Apng(encoder) => (encoder.finish()?, None),
            Kind::Webp(encoder) => {
                let (dropped, length) = encoder.finish()?;
                (dropped, Some(length))
            }
            Kind::Y4m(encoder) => (encoder.finish().map(|()| 0)?, None),
        };
        Ok(Finished { dropped, length })
    }
}

/// Puts a picture over a colour, by its encoded levels. A picture without alpha stays unchanged.
#[must_use]
pub fn over(picture: DynamicImage, matte: [u8; 3]) -> RgbImage {
    if !picture.color().has_alpha() {
        return picture.into_rgb8();
    }
    let picture = picture.into_rgba8();
    RgbImage::from_fn(picture.width(), picture.height(), |x, y| {
        let [red, green, blue, alpha] = picture.get_pixel(x, y).0.map(u32::from);
        let channels = [red, green, blue];
        let mixed = |k: usize| (channels[k] * alpha + u32::from(matte[k]) * (255 - alpha) + 127) / 255;
        image::Rgb([0, 1, 2].map(|k| mixed(k) as u8))
    })
}

/// Adds the alpha of a picture that is covered everywhere.
fn opaque(picture: RgbImage) -> DynamicImage {
    DynamicImage::ImageRgba8(DynamicImage::ImageRgb8(picture).into_rgba8())
}

impl Finished {
    /// Writes the bytes that belong to the start of the file into a file in memory.
    pub fn complete(&self, file: &mut [u8]) {
        if let Some((at, length)) = self.length {
            file[at as usize..][..length.len()].copy_from_slice(&length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_container_is_whole_in_memory() {
        let frames = (0..3).map(|k| (RgbImage::from_pixel(6, 4, image::Rgb([40 * k, 9, 200])), None));
        let movie = Movie {
            size: (6, 4),
            frames: Some(3),
            fps: 10.0,
            plays: Plays::Endless,
            last_delay_cs: None,
            exact: false,
            alpha: false,
        };
        for container in Container::ALL {
            let mut bytes = Vec::new();
            let mut encoding = Encoding::begin(&mut bytes, container, movie).unwrap();
            for (frame, seconds) in frames.clone() {
                encoding.push(frame, seconds).unwrap();
            }
            encoding.finish().unwrap().complete(&mut bytes);
            let start: &[u8] = match container {
                Container::Gif => b"GIF89a",
                Container::Apng => b"\x89PNG",
                Container::Webp => b"RIFF",
                Container::Y4m => b"YUV4MPEG2",
            };
            assert!(bytes.starts_with(start), "{container:?}");
            if container == Container::Webp {
                let length = u32::from_le_bytes(bytes[4..8].try_into().unwrap());
                assert_eq!(length as usize + 8, bytes.len());
            }
        }
    }

    /// The file is the same after a suspension at any frame, also when frames are dropped, and with alpha.
    #[test]
    fn a_file_in_two_pieces_is_the_file_in_one() {
        let frames: Vec<DynamicImage> = (0..7)
            .map(|k| {
                let (mut frame, at) = (image::RgbaImage::new(6, 4), k % 6);
                frame.put_pixel(at, k % 4, image::Rgba([40 * k as u8, 9, 200, 255 - 30 * k as u8]));
                frame.into()
            })
            .collect();
        let seconds = |number: usize, fps: f64| (fps < 50.0 && number == 2).then_some(0.5);
        for (container, fps, alpha) in Container::ALL
            .into_iter()
            .flat_map(|container| [10.0, 100.0].map(|fps| (container, fps)))
            .flat_map(|(container, fps)| [false, true].map(|alpha| (container, fps, alpha)))
        {
            let plays = Plays::Endless;
            let movie = Movie {
                size: (6, 4),
                frames: Some(7),
                fps,
                plays,
                last_delay_cs: Some(90),
                exact: false,
                alpha,
            };
            let mut whole = Vec::new();
            let mut encoding = Encoding::begin(&mut whole, container, movie).unwrap();
            for (number, frame) in frames.iter().enumerate() {
                encoding.push(frame.clone(), seconds(number, fps)).unwrap();
            }
            let finished = encoding.finish().unwrap();
            for left_after in 0..=7 {
                let mut bytes = Vec::new();
                let mut encoding = Encoding::begin(&mut bytes, container, movie).unwrap();
                for (number, frame) in frames.iter().enumerate().take(left_after) {
                    encoding.push(frame.clone(), seconds(number, fps)).unwrap();
                }
                let state = encoding.suspend().unwrap();
                let mut encoding = Encoding::resume(&mut bytes, container, movie, &state).unwrap();
                for (number, frame) in frames.iter().enumerate().skip(left_after) {
                    encoding.push(frame.clone(), seconds(number, fps)).unwrap();
                }
                assert_eq!(encoding.finish().unwrap(), finished, "{container:?} {fps} {left_after}");
                assert!(
                    bytes == whole,
                    "{container:?} at {fps} frames a second, alpha {alpha}, left after {left_after}"
                );
                for end in 0..state.len() {
                    let cut = Encoding::resume(io::sink(), container, movie, &state[..end]);
                    assert!(cut.is_err(), "{container:?}: {end} of {} bytes", state.len());
                }
            }
        }
    }
}
