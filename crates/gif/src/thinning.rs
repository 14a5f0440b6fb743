//! Drops frames that come faster than players show them.

use std::io;

use image::{DynamicImage, GenericImageView as _, RgbImage, RgbaImage};

use crate::error::{Error, LONGEST_SIDE};
use crate::state::{StateReader, StateWriter, damaged};

/// The frame rate after thinning: every player shows a frame for two hundredths of a second.
const THINNED_FPS: f64 = 50.0;

/// A filter that drops frames of an animation with more frames per second than players show.
///
/// In each fiftieth of a second the first frame is kept. In the last fiftieth the last frame is kept, so that an
/// animation ends with its last frame.
#[derive(Debug)]
pub struct Thinning {
    fps: f64,
    /// Frames are dropped.
    thins: bool,
    pushed: u64,
    held: Option<Held>,
}

/// The frames of the current fiftieth of a second.
#[derive(Debug)]
struct Held {
    first: DynamicImage,
    /// The newest frame, unless it is `first`.
    last: Option<DynamicImage>,
}

impl Thinning {
    /// Makes a filter for an animation of `fps` frames per second, of which players show at most `most_fps`.
    #[must_use]
    pub fn new(fps: f64, most_fps: f64) -> Self {
        Self { fps, thins: fps > most_fps, pushed: 0, held: None }
    }

    /// Returns the frame rate after thinning.
    #[must_use]
    pub fn fps(&self) -> f64 {
        if self.thins { THINNED_FPS } else { self.fps }
    }

    /// Returns how many of this many frames remain.
    #[must_use]
    pub fn left_of(&self, frames: u64) -> u64 {
        match frames.checked_sub(1) {
            Some(last) if self.thins => self.slot(last) + 1,
            _ => frames,
        }
    }

    /// Returns the number of the fiftieth of a second in which a frame begins.
    fn slot(&self, frame: u64) -> u64 {
        (frame as f64 * THINNED_FPS / self.fps).floor() as u64
    }

    /// Takes the next frame. Returns the next frame that remains, if that is known already.
    pub fn push(&mut self, frame: impl Into<DynamicImage>) -> Option<DynamicImage> {
        let frame = frame.into();
        let number = self.pushed;
        self.pushed += 1;
        if !self.thins {
            return Some(frame);
        }
        let same = number > 0 && self.slot(number) == self.slot(number - 1);
        match &mut self.held {
            Some(held) if same => {
                held.last = Some(frame);
                None
            }
            held => held.replace(Held { first: frame, last: None }).map(|held| held.first),
        }
    }

    /// Returns the frames that are held back: at most two, the first and the newest of the current fiftieth of a second.
    pub fn held(&self) -> impl Iterator<Item = &DynamicImage> {
        self.held.iter().flat_map(|held| std::iter::once(&held.first).chain(&held.last))
    }

    /// Continues after `pushed` frames, with the frames that were [held](Self::held) then. Returns `None` if it cannot
    /// have held so many.
    #[must_use]
    pub fn after(self, pushed: u64, held: Vec<DynamicImage>) -> Option<Self> {
        let most = if self.thins { pushed.min(2) } else { 0 };
        if held.len() as u64 > most {
            return None;
        }
        let mut held = held.into_iter();
        let held = held.next().map(|first| Held { first, last: held.next() });
        Some(Self { pushed, held, ..self })
    }

    /// Returns the last frame, unless it was returned before.
    pub fn finish(&mut self) -> Option<DynamicImage> {
        self.held.take().map(|held| held.last.unwrap_or(held.first))
    }
}

impl Thinning {
    /// Returns columns and rows of the frames that are held.
    pub(crate) fn size(&self) -> Option<(u32, u32)> {
        self.held.as_ref().map(|held| held.first.dimensions())
    }

    /// Writes the frames that are held.
    pub(crate) fn write(&self, state: &mut StateWriter) -> io::Result<()> {
        let Some(Held { first, last }) = &self.held else { return state.bytes(&[0]) };
        state.bytes(&[1 + u8::from(last.is_some())])?;
        state.u64(first.width().into())?;
        state.u64(first.height().into())?;
        for frame in [Some(first), last.as_ref()].into_iter().flatten() {
            state.bytes(&[frame.color().channel_count()])?;
            state.bytes(frame.as_bytes())?;
        }
        Ok(())
    }

    /// Reads the state that was written after `pushed` frames.
    pub(crate) fn read(self, state: &mut StateReader<'_>, pushed: u64) -> Result<Self, Error> {
        let count = state.u8()?;
        if count > 2 || count > 0 && !self.thins {
            return Err(damaged("it holds frames that there cannot be"));
        }
        let mut held = None;
        if count > 0 {
            let (width, height) = read_size(state)?;
            let mut image = || {
                let channels = state.u8()?;
                if !(3..=4).contains(&channels) {
                    return Err(damaged("a frame that it holds has channels that there cannot be"));
                }
                let levels = state.bytes(width as usize * height as usize * usize::from(channels))?;
                let frame = match channels {
                    3 => RgbImage::from_raw(width, height, levels).map(DynamicImage::ImageRgb8),
                    _ => RgbaImage::from_raw(width, height, levels).map(DynamicImage::ImageRgba8),
                };
                frame.ok_or_else(|| damaged("its size is wrong"))
            };
            let first = image()?;
            held = Some(Held { first, last: if count > 1 { Some(image()?) } else { None } });
        }
        Ok(Self { pushed, held, ..self })
    }
}

/// Reads the columns and rows of a frame, and checks that the format can hold them.
pub(crate) fn read_size(state: &mut StateReader<'_>) -> Result<(u32, u32), Error> {
    let sides = (state.u64()?, state.u64()?);
    let side = |side: u64| u32::try_from(side).ok().filter(|side| (1..=LONGEST_SIDE).contains(side));
    let (Some(width), Some(height)) = (side(sides.0), side(sides.1)) else {
        return Err(damaged("its size is wrong"));
    };
    Ok((width, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the numbers of the frames that remain of `count`.
    fn left(fps: f64, count: u32) -> Vec<u8> {
        let mut thinning = Thinning::new(fps, 50.0);
        let expected = thinning.left_of(count.into());
        let numbered = |k: u32| RgbImage::from_pixel(1, 1, image::Rgb([k as u8; 3]));
        let mut left = (0..count).filter_map(|k| thinning.push(numbered(k))).collect::<Vec<_>>();
        left.extend(thinning.finish());
        assert_eq!(left.len() as u64, expected, "{fps} frames a second, {count} frames");
        left.iter().map(|frame| frame.as_bytes()[0]).collect()
    }

    #[test]
    fn at_most_so_many_a_second_all_are_left() {
        assert_eq!(left(50.0, 5), [0, 1, 2, 3, 4]);
        assert_eq!(left(50.0, 0), []);
    }

    #[test]
    fn the_first_of_each_fiftieth_is_left_and_the_last_of_all() {
        assert_eq!(left(100.0, 12), [0, 2, 4, 6, 8, 11]);
        assert_eq!(left(100.0, 11), [0, 2, 4, 6, 8, 10]);
        assert_eq!(left(80.0, 9), [0, 2, 4, 5, 7, 8]);
        assert_eq!(left(1_000.0, 12), [11]);
        assert_eq!(left(1_000.0, 21), [0, 20]);
        for fps in [50.5, 60.0, 75.0, 90.0, 120.0, 144.0, 999.0] {
            for count in 1..200 {
                assert_eq!(left(fps, count).last(), Some(&(count as u8 - 1)), "{fps}, {count}");
            }
        }
    }
}
