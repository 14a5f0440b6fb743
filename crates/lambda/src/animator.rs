//! The assemble function's animator: encodes PNG frames to a file with `rayfold-movie`, piece by piece.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use image::DynamicImage;
use rayfold_movie::{Movie, Plays};
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::store::Patch;
use rayfold_pipeline::{Animator, Encoding, Unfit};
use rayfold_scene::{AnimationSettings, Container, Limits};

use crate::{png, pool};

/// An impossible number of frames.
const MANY_FRAMES: u64 = 1 << 40;

/// The bytes of a state before that of the encoder: columns, rows, the number of frames, and whether there is alpha.
const HEAD: usize = 4 + 4 + 8 + 1;

/// An animator that makes files of all [containers](Container).
#[derive(Debug, Clone, Copy)]
pub struct MovieAnimator {
    /// The largest number of pixels of a frame. A file that claims more was not drawn by rayfold.
    pub most_pixels: u64,
}

impl Default for MovieAnimator {
    fn default() -> Self {
        Self { most_pixels: Limits::PIXELS }
    }
}

impl MovieAnimator {
    fn encoding(&self, settings: &AnimationSettings, output: Container, alpha: bool) -> MovieEncoding {
        let frames = settings.frames();
        let movie = Movie {
            size: (0, 0),
            frames: frames.map(|frames| settings.shown_count(frames)),
            fps: settings.fps(),
            plays: Plays::repeated(settings.loops()),
            last_delay_cs: None,
            exact: false,
            // Each frame of a GIF tells for itself.
            alpha: alpha || output == Container::Gif,
        };
        // Durations of an animation that bounces need the number of frames, which the assembler fills in.
        let durations = settings.shown_durations(frames.unwrap_or(MANY_FRAMES));
        let work = Work { output, movie, durations, pushed: 0, encoding: None, ready: Shelf::default() };
        MovieEncoding { work: Some(work), most_pixels: self.most_pixels }
    }
}

impl Animator for MovieAnimator {
    type Encoding = MovieEncoding;

    fn begin(
        &self,
        settings: &AnimationSettings,
        output: Container,
        alpha: bool,
    ) -> Result<MovieEncoding, Reason> {
        Ok(self.encoding(settings, output, alpha))
    }

    async fn resume(
        &self,
        settings: &AnimationSettings,
        output: Container,
        state: Bytes,
    ) -> Result<MovieEncoding, Reason> {
        let mut encoding = self.encoding(settings, output, false);
        let mut work = encoding.work.take().ok_or_else(failed_before)?;
        let resume = move || work.resume(&state).map(|()| work).map_err(reason);
        encoding.work = Some(pool::run(resume).await.unwrap_or_else(|| Err(failed_before()))?);
        Ok(encoding)
    }
}

/// A file that is being encoded.
pub struct MovieEncoding {
    /// `None` while a frame is being encoded, and after a failure.
    work: Option<Work>,
    most_pixels: u64,
}

/// The encoder, and the data that it needs.
struct Work {
    output: Container,
    /// The size of the animation is that of the first frame.
    movie: Movie,
    /// The frames by their index, from 0.
    durations: BTreeMap<u64, f64>,
    pushed: u64,
    /// `None` before the first frame.
    encoding: Option<rayfold_movie::Encoding<Shelf>>,
    ready: Shelf,
}

impl Encoding for MovieEncoding {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        let failed = || Unfit::Unlike(failed_before());
        let mut work = self.work.take().ok_or_else(failed)?;
        let most_pixels = self.most_pixels;
        let push = move || {
            let image = png::decode(&frame, most_pixels).map_err(|error| Unfit::Corrupt(reason(error)))?;
            work.push(image)?;
            Ok(work)
        };
        let work = self.work.insert(pool::run(push).await.unwrap_or_else(|| Err(failed()))?);
        Ok(work.ready.take())
    }

    async fn finish(mut self) -> Result<(Bytes, Option<Patch>), Reason> {
        let work = self.work.take().ok_or_else(failed_before)?;
        let ready = work.ready.clone();
        let finish = move || work.finish();
        let patch = pool::run(finish).await.unwrap_or_else(|| Err(failed_before()))?;
        Ok((ready.take(), patch))
    }

    async fn suspend(mut self) -> Result<Bytes, Reason> {
        let work = self.work.take().ok_or_else(failed_before)?;
        let suspend = move || work.suspend().map(Bytes::from).map_err(reason);
        pool::run(suspend).await.unwrap_or_else(|| Err(failed_before()))
    }
}

impl Work {
    fn push(&mut self, image: DynamicImage) -> Result<(), Unfit> {
        let unfit = |error| Unfit::Unlike(reason(error));
        let size = (image.width(), image.height());
        let needs_alpha = matches!(self.output, Container::Apng | Container::Webp);
        if image.color().has_alpha() && needs_alpha && !self.movie.alpha {
            return Err(Unfit::Alpha);
        }
        let encoding = match &mut self.encoding {
            Some(encoding) if self.output == Container::Gif || size == self.movie.size => encoding,
            Some(_) => {
                let ((width, height), (first_width, first_height)) = (size, self.movie.size);
                let message = format!(
                    "frame {} has {width} x {height} pixels, the first frame has {first_width} x {first_height}",
                    self.pushed + 1
                );
                return Err(Unfit::Unlike(Reason::new(message)));
            }
            none => {
                self.movie.size = size;
                let begun = rayfold_movie::Encoding::begin(self.ready.clone(), self.output, self.movie);
                none.insert(begun.map_err(unfit)?)
            }
        };
        let seconds = self.durations.get(&self.pushed).copied();
        self.pushed += 1;
        encoding.push(image, seconds).map_err(unfit)
    }

    fn finish(self) -> Result<Option<Patch>, Reason> {
        let encoding = self.encoding.ok_or_else(|| Reason::new("there are no frames"))?;
        let length = encoding.finish().map_err(reason)?.length;
        Ok(length.map(|(at, length)| Patch { at: at as usize, bytes: Bytes::copy_from_slice(&length) }))
    }

    fn suspend(self) -> Result<Vec<u8>, rayfold_movie::Error> {
        let (width, height) = self.movie.size;
        let head = [&width.to_le_bytes()[..], &height.to_le_bytes(), &self.pushed.to_le_bytes()];
        let mut state = head.concat();
        state.push(u8::from(self.movie.alpha));
        if let Some(encoding) = self.encoding {
            state.extend(encoding.suspend()?);
        }
        Ok(state)
    }

    fn resume(&mut self, state: &[u8]) -> Result<(), rayfold_movie::Error> {
        let damaged = rayfold_movie::Error::State("it is damaged");
        let Some((head, state)) = state.split_first_chunk::<HEAD>() else { return Err(damaged) };
        let number = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        self.movie.size = (number(0), number(4));
        self.pushed = u64::from(number(8)) | u64::from(number(12)) << 32;
        self.movie.alpha = head[16] != 0;
        if !state.is_empty() {
            let ready = self.ready.clone();
            self.encoding = Some(rayfold_movie::Encoding::resume(ready, self.output, self.movie, state)?);
        }
        Ok(())
    }
}

fn reason(error: impl std::error::Error) -> Reason {
    let mut message = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        message = format!("{message}: {error}");
        source = error.source();
    }
    Reason::new(message)
}

fn failed_before() -> Reason {
    Reason::new("the encoder failed on an earlier frame")
}

/// A buffer in which the encoder leaves its output until it is fetched.
#[derive(Debug, Clone, Default)]
struct Shelf(Arc<Mutex<Vec<u8>>>);

impl Shelf {
    fn take(&self) -> Bytes {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).into()
    }
}

impl Write for Shelf {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use image::{Rgba, RgbaImage};

    use super::*;

    /// Frames that differ in one pixel; the second one may be transparent.
    fn frames(is_clear: bool) -> Vec<Bytes> {
        let frame = |k: u32| {
            let mut frame = RgbaImage::from_pixel(9, 7, Rgba([90, 20, 60, 255]));
            frame.put_pixel(k, k, Rgba([200, 10 * k as u8, 9, if is_clear { 80 } else { 255 }]));
            let frame = DynamicImage::from(frame);
            png::encode(&if is_clear && k == 1 { frame } else { frame.into_rgb8().into() }).unwrap()
        };
        (0..4).map(frame).collect()
    }

    fn settings() -> AnimationSettings {
        let settings = AnimationSettings::new(Some(4), 25.0, 2).unwrap().bouncing(true);
        settings.with_durations([(2, 0.5)].into()).unwrap()
    }

    /// Returns the file that `rayfold render` writes of these frames, in the order in which they are shown.
    fn expected(output: Container, frames: &[Bytes], alpha: bool) -> Vec<u8> {
        let movie = Movie {
            size: (9, 7),
            frames: Some(6),
            fps: 25.0,
            plays: Plays::repeated(2),
            last_delay_cs: None,
            exact: false,
            alpha,
        };
        let mut file = Vec::new();
        let mut encoding = rayfold_movie::Encoding::begin(&mut file, output, movie).unwrap();
        for (place, frame) in frames.iter().enumerate() {
            let seconds = settings().shown_durations(4).get(&(place as u64)).copied();
            encoding.push(png::decode(frame, 1_000).unwrap(), seconds).unwrap();
        }
        encoding.finish().unwrap().complete(&mut file);
        file
    }

    /// Encodes in one piece, and with a suspension after each frame.
    #[tokio::test]
    async fn every_file_is_that_of_the_command_in_one_piece_or_in_many() {
        let animator = MovieAnimator::default();
        for (output, is_clear, is_cut) in Container::ALL
            .into_iter()
            .flat_map(|output| [false, true].map(|is_clear| (output, is_clear)))
            .flat_map(|(output, is_clear)| [false, true].map(|is_cut| (output, is_clear, is_cut)))
        {
            let (settings, frames) = (settings(), frames(is_clear));
            let shown: Vec<Bytes> = settings.shown(&frames).cloned().collect();
            let mut file = Vec::new();
            let mut encoding = animator.begin(&settings, output, is_clear).unwrap();
            for frame in &shown {
                if is_cut {
                    let state = encoding.suspend().await.unwrap();
                    encoding = animator.resume(&settings, output, state).await.unwrap();
                }
                file.extend_from_slice(&encoding.push(frame.clone()).await.unwrap());
            }
            let (rest, patch) = encoding.finish().await.unwrap();
            file.extend_from_slice(&rest);
            assert_eq!(patch.is_some(), output == Container::Webp);
            patch.iter().for_each(|patch| patch.apply(&mut file));
            assert!(file == expected(output, &shown, is_clear), "{output:?}, clear {is_clear}, cut {is_cut}");
        }
    }

    #[tokio::test]
    async fn a_frame_of_another_size_and_one_with_alpha_do_not_fit() {
        let animator = MovieAnimator::default();
        let other = png::encode(&DynamicImage::new_rgb8(3, 3)).unwrap();
        for output in Container::ALL {
            let mut encoding = animator.begin(&settings(), output, false).unwrap();
            let frames = frames(true);
            encoding.push(frames[0].clone()).await.unwrap();
            let clear = encoding.push(frames[1].clone()).await;
            let is_held = matches!(output, Container::Apng | Container::Webp);
            assert_eq!(matches!(clear, Err(Unfit::Alpha)), is_held, "{output:?}");
            let mut encoding = animator.begin(&settings(), output, false).unwrap();
            encoding.push(frames[0].clone()).await.unwrap();
            let Err(Unfit::Unlike(reason)) = encoding.push(other.clone()).await else { panic!("{output:?}") };
            assert!(reason.message.contains("3 x 3"), "{}", reason.message);
        }
    }
}
