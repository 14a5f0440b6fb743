//! Frames with clear pixels. Each is drawn alone, on a canvas that the block before it has left clear.
//!
//! A GIF has no cover between 0 and 1: a pixel is drawn or clear. Which pixels are drawn is decided by an ordered
//! pattern of thresholds, so that half of the pixels of half cover are drawn. The pattern does not move, so static
//! parts do not flicker.

use std::io;

use image::RgbaImage;

use crate::block::{Area, Block};
use crate::bound;
use crate::error::Error;
use crate::exact::{self, FewColours};
use crate::histogram::{Histogram, MAX_BINS};
use crate::palette::Sample;
use crate::quantise;
use crate::quantised::Quantised;
use crate::state::{StateReader, StateWriter, damaged};
use crate::stripe::{self, Colours, Layout};
use crate::update_map::{PixelUpdate, UpdateMap};

/// The side of the pattern of thresholds, a power of two.
const SIDE: u32 = 8;

/// The largest palette of a frame with clear pixels: an index is left for those.
const MOST: usize = 255;

/// The number of parts of a frame whose colours are counted in parallel.
const PARTS: usize = 2;

/// The frame of an animation that is written next.
#[derive(Debug, Default)]
pub(crate) struct Alone {
    waiting: Option<(RgbaImage, u16)>,
}

impl Alone {
    /// Takes the next frame, and returns the block of the one before it.
    pub(crate) fn push(&mut self, frame: RgbaImage, delay_cs: u16) -> Option<Block> {
        let before = self.waiting.replace((frame, delay_cs));
        before.map(|(frame, delay_cs)| block(&frame, delay_cs))
    }

    /// Returns the block of the last frame.
    pub(crate) fn finish(&mut self) -> Option<Block> {
        self.waiting.take().map(|(frame, delay_cs)| block(&frame, delay_cs))
    }

    /// Writes the state on which later blocks depend.
    pub(crate) fn write(&self, state: &mut StateWriter) -> io::Result<()> {
        let Some((frame, delay_cs)) = &self.waiting else { return state.bytes(&[0]) };
        state.bytes(&[1])?;
        state.u16(*delay_cs)?;
        state.bytes(frame.as_raw())
    }

    /// Reads the state that was written for frames of a size.
    pub(crate) fn read(state: &mut StateReader<'_>, (width, height): (u32, u32)) -> Result<Self, Error> {
        if state.u8()? == 0 {
            return Ok(Self::default());
        }
        let delay_cs = state.u16()?;
        let levels = state.bytes(width as usize * height as usize * 4)?;
        let frame = RgbaImage::from_raw(width, height, levels).ok_or_else(|| damaged("its size is wrong"))?;
        Ok(Self { waiting: Some((frame, delay_cs)) })
    }
}

/// Returns whether all of a frame is covered.
pub(crate) fn is_opaque(frame: &RgbaImage) -> bool {
    frame.pixels().all(|pixel| pixel[3] == u8::MAX)
}

/// Returns whether a pixel of this cover is drawn at a place.
fn is_drawn(x: u32, y: u32, cover: u8) -> bool {
    // The ordered pattern of Bayer: the bits of y and of x ^ y, interleaved from the lowest.
    let (mut threshold, mut bit) = (0, SIDE / 2);
    let mut place = 1;
    while bit > 0 {
        threshold += place * (2 * u32::from((x ^ y) & bit != 0) + u32::from(y & bit != 0));
        place *= 4;
        bit /= 2;
    }
    // Between 0 and 255, neither of which is reached.
    2 * SIDE * SIDE * u32::from(cover) > 255 * (2 * threshold + 1)
}

/// Makes the block of a frame on a clear canvas, which it leaves clear.
pub(crate) fn block(frame: &RgbaImage, delay_cs: u16) -> Block {
    // The whole step runs in the pool. Otherwise each part of it would have to wait for a thread.
    rayon::scope(|_| draw(frame, delay_cs)).clearing()
}

fn draw(frame: &RgbaImage, delay_cs: u16) -> Block {
    let width = frame.width() as usize;
    let updates: Vec<PixelUpdate> = frame
        .enumerate_pixels()
        .map(|(x, y, pixel)| if is_drawn(x, y, pixel[3]) { PixelUpdate::Draw } else { PixelUpdate::Keep })
        .collect();
    let pixels: Vec<[u8; 3]> = frame.pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let Some(area) = Area::around(&updates, width, |&update| update == PixelUpdate::Draw) else {
        return Block::nothing(delay_cs);
    };
    let drawn: Vec<[u8; 3]> = pixels
        .iter()
        .zip(&updates)
        .filter(|(_, update)| **update == PixelUpdate::Draw)
        .map(|(pixel, _)| *pixel)
        .collect();
    // Where all is drawn no index is needed for clear pixels.
    let most = if drawn.len() == pixels.len() { MOST + 1 } else { MOST };
    match exact::few_colours(&drawn).filter(|few| few.colours.len() <= most) {
        Some(few) => draw_exactly((&pixels, &updates), width, area, &few, delay_cs),
        None => draw_nearly(&pixels, updates, width, area, delay_cs),
    }
}

/// Draws pixels of few colours.
fn draw_exactly(
    (pixels, updates): (&[[u8; 3]], &[PixelUpdate]),
    width: usize,
    area: Area,
    few: &FewColours,
    delay_cs: u16,
) -> Block {
    let transparent = u8::try_from(few.colours.len()).ok();
    let clear = transparent.unwrap_or_default();
    let layout = Layout { area, width, colours: &few.colours, transparent, delay_cs, stripes: 1 };
    let mut canvas = vec![[0; 3]; pixels.len()];
    let (block, _) = stripe::in_stripes(layout, &mut canvas, |writer, top, rows| {
        for y in top..top + rows.len() / width {
            for at in y * width + area.left..y * width + area.right {
                let index = match updates[at] {
                    PixelUpdate::Draw => few.find(pixels[at]).unwrap_or(clear),
                    PixelUpdate::Keep | PixelUpdate::Either | PixelUpdate::Refine => clear,
                };
                writer.put(index);
            }
        }
    });
    block
}

/// Draws pixels with the palette that suits them best.
fn draw_nearly(
    pixels: &[[u8; 3]],
    updates: Vec<PixelUpdate>,
    width: usize,
    area: Area,
    delay_cs: u16,
) -> Block {
    let mut updates = UpdateMap::decided(width, updates);
    let mut histogram = Histogram::new(MAX_BINS);
    let mut parts: Vec<Histogram> = (1..PARTS).map(|_| Histogram::new(MAX_BINS)).collect();
    updates.count(pixels, 0.0, &mut histogram, &mut parts);
    let bins = Sample::of_bins(&histogram);
    let quantised = Quantised::new(&histogram, &bins, MOST);
    let Quantised { palette, nearest, error } = &quantised;
    let colours = Colours {
        palette,
        nearest,
        histogram: &histogram,
        transparent: Some(palette.colours.len() as u8),
        is_alone: true,
        changed: 1.0,
        error: *error,
        bound: bound::NONE,
    };
    let mut canvas = vec![[0; 3]; pixels.len()];
    quantise::draw((pixels, None), width, area, &updates.pixels, &mut canvas, colours, delay_cs).0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_pixels_are_drawn_as_are_covered() {
        let drawn = |cover: u8| (0..64).filter(|k| is_drawn(k % 8, k / 8, cover)).count();
        assert_eq!([0, 1, 64, 128, 191, 254, 255].map(drawn), [0, 0, 16, 32, 48, 64, 64]);
        // Half of the pixels are every second one.
        assert!((0..64).all(|k| is_drawn(k % 8, k / 8, 128) == ((k % 8 + k / 8) % 2 == 0)));
        let counts: Vec<usize> = (0..=255).map(drawn).collect();
        assert!(counts.is_sorted());
    }

    #[test]
    fn a_frame_of_nothing_is_a_clear_pixel() {
        let block = block(&RgbaImage::new(9, 7), 5);
        assert_eq!((block.area.size(), block.transparent, block.clears), (1, Some(0), true));
    }

    #[test]
    fn only_what_is_drawn_is_in_the_block_and_in_the_palette() {
        let mut frame = RgbaImage::new(9, 7);
        frame.put_pixel(3, 2, image::Rgba([1, 2, 3, 255]));
        frame.put_pixel(5, 4, image::Rgba([9, 8, 7, 255]));
        frame.put_pixel(8, 6, image::Rgba([50, 50, 50, 0]));
        let block = block(&frame, 5);
        assert_eq!(block.area, Area { left: 3, top: 2, right: 6, bottom: 5 });
        assert_eq!((block.palette, block.transparent), (vec![1, 2, 3, 9, 8, 7, 0, 0, 0], Some(2)));
    }
}
