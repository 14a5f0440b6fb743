//! Frames that come faster than players show them are left out.

use std::io;

use image::RgbImage;

use crate::error::{Error, LONGEST_SIDE};
use crate::state::{StateReader, StateWriter, damaged};

/// Frames a second where there are too many: every player shows one for two hundredths of a second.
const THINNED_FPS: f64 = 50.0;

/// Leaves out frames of an animation that has more of them a second than players show.
///
/// Of each fiftieth of a second the first frame stays, but of the last one the last: an animation ends with its last
/// frame.
#[derive(Debug)]
pub struct Thinning {
    fps: f64,
    /// Whether frames are left out.
    thins: bool,
    pushed: u64,
    held: Option<Held>,
}

/// The frames of the current fiftieth of a second.
#[derive(Debug)]
struct Held {
    first: RgbImage,
    /// The newest, if it is another one.
    last: Option<RgbImage>,
}

impl Thinning {
    /// For an animation of `fps` frames a second, of which players show at most `most_fps`.
    #[must_use]
    pub fn new(fps: f64, most_fps: f64) -> Self {
        Self { fps, thins: fps > most_fps, pushed: 0, held: None }
    }

    /// Frames a second that are left.
    #[must_use]
    pub fn fps(&self) -> f64 {
        if self.thins { THINNED_FPS } else { self.fps }
    }

    /// How many of so many frames are left.
    #[must_use]
    pub fn left_of(&self, frames: u64) -> u64 {
        match frames.checked_sub(1) {
            Some(last) if self.thins => self.slot(last) + 1,
            _ => frames,
        }
    }

    /// The number of the fiftieth of a second in which a frame begins.
    fn slot(&self, frame: u64) -> u64 {
        (frame as f64 * THINNED_FPS / self.fps).floor() as u64
    }

    /// Takes the next frame, and returns the next one that is left, if that is known already.
    pub fn push(&mut self, frame: RgbImage) -> Option<RgbImage> {
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

    /// The last frame, unless it was returned before.
    pub fn finish(&mut self) -> Option<RgbImage> {
        self.held.take().map(|held| held.last.unwrap_or(held.first))
    }
}

impl Thinning {
    /// Columns and rows of the frames that are held.
    pub(crate) fn size(&self) -> Option<(u32, u32)> {
        self.held.as_ref().map(|held| held.first.dimensions())
    }

    /// Writes down what is held.
    pub(crate) fn write(&self, state: &mut StateWriter) -> io::Result<()> {
        let Some(Held { first, last }) = &self.held else { return state.bytes(&[0]) };
        state.bytes(&[1 + u8::from(last.is_some())])?;
        state.u64(first.width().into())?;
        state.u64(first.height().into())?;
        state.bytes(first.as_raw())?;
        last.as_ref().map_or(Ok(()), |last| state.bytes(last.as_raw()))
    }

    /// Reads what was written after so many frames.
    pub(crate) fn read(self, state: &mut StateReader<'_>, pushed: u64) -> Result<Self, Error> {
        let count = state.u8()?;
        if count > 2 || count > 0 && !self.thins {
            return Err(damaged("it holds frames that there cannot be"));
        }
        let mut held = None;
        if count > 0 {
            let (width, height) = read_size(state)?;
            let mut image = || {
                let levels = state.bytes(width as usize * height as usize * 3)?;
                RgbImage::from_raw(width, height, levels).ok_or_else(|| damaged("its size is wrong"))
            };
            let first = image()?;
            held = Some(Held { first, last: if count > 1 { Some(image()?) } else { None } });
        }
        Ok(Self { pushed, held, ..self })
    }
}

/// Columns and rows that a frame can have.
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

    /// The numbers of the frames that are left of `count`.
    fn left(fps: f64, count: u32) -> Vec<u8> {
        let mut thinning = Thinning::new(fps, 50.0);
        let expected = thinning.left_of(count.into());
        let numbered = |k: u32| RgbImage::from_pixel(1, 1, image::Rgb([k as u8; 3]));
        let mut left = (0..count).filter_map(|k| thinning.push(numbered(k))).collect::<Vec<_>>();
        left.extend(thinning.finish());
        assert_eq!(left.len() as u64, expected, "{fps} frames a second, {count} frames");
        left.iter().map(|frame| frame[(0, 0)].0[0]).collect()
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
