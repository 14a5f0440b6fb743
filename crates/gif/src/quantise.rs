//! A frame and what a viewer sees before it, to the block that turns the one into the other.
//!
//! Tiles whose pixels are seen about as well as they could be drawn are left alone, and so are pixels that are as in the
//! frame before, unless they are seen wrong and the [allowance](crate::allowance) has room. For the others a palette is
//! made, and each colour has its [ink](crate::ink); the [stripes](crate::stripe) choose the indices.

use image::RgbImage;
use rayon::prelude::*;

use crate::allowance::{Allowance, Still};
use crate::block::{Area, Block};
use crate::colour::{self, Near};
use crate::exact;
use crate::histogram::{Histogram, MOST_BINS};
use crate::ink::{self, Ink};
use crate::palette::Palette;
use crate::stripe::{self, Inks, Need, Row, Stripe};

/// Parts of a frame whose colours are counted side by side.
const PARTS: usize = 2;
/// Width and height of what is drawn or left as a whole: single pixels drawn among others that are left cost as much
/// as if all were drawn.
const TILE: usize = 8;
/// [Level error](colour::level_error) beyond that of a drawn pixel, in the mean of a tile, up to which the tile is left.
const TOLERATED: f32 = 12.0;
/// The level error of a pixel above which its tile is drawn in any case: almost three levels.
const GLARING: f32 = 50.0;
/// The level error up to which a pixel that changes may be left in a tile that is drawn.
const SEEN_RIGHT: f32 = 2.0;
/// The squared error (see [`colour`]) above which a pixel that stays asks for a better colour.
const SEEN_WRONG: f32 = 2.0;

/// Turns frames into blocks, one after the other.
#[derive(Debug)]
pub(crate) struct Quantiser {
    last: Option<Last>,
    histograms: Vec<Histogram>,
    needs: Vec<Need>,
    /// Of the pixels of each tile that stay and are seen wrong.
    tile_errors: Vec<f32>,
    allowance: Allowance,
    /// Mean level error of what the last palette drew.
    drawn_error: f32,
}

#[derive(Debug)]
struct Last {
    /// The frame before.
    frame: RgbImage,
    /// What a viewer sees of it.
    seen: RgbImage,
}

impl Quantiser {
    pub(crate) fn new() -> Self {
        let histograms = (0..PARTS).map(|_| Histogram::new(MOST_BINS)).collect();
        Self {
            last: None,
            histograms,
            needs: Vec::new(),
            tile_errors: Vec::new(),
            allowance: Allowance::new(),
            drawn_error: 0.0,
        }
    }

    /// The block that shows `frame` after all those given before.
    pub(crate) fn quantise(&mut self, frame: RgbImage, delay_cs: u16) -> Block {
        let width = frame.width() as usize;
        let pixels = frame.as_raw().as_chunks::<3>().0;
        let (before, mut seen) = match self.last.take() {
            Some(Last { frame, seen }) => (Some(frame), seen),
            None => (None, RgbImage::new(frame.width(), frame.height())),
        };
        let canvas = seen.as_chunks_mut::<3>().0;
        let block = match exact::few_colours(pixels) {
            Some(colours) => exact::draw(pixels, width, before.is_none(), canvas, colours, delay_cs),
            None => {
                let before = before.as_ref().map(|frame| frame.as_raw().as_chunks::<3>().0);
                self.draw(pixels, before, canvas, width, delay_cs)
            }
        };
        self.last = Some(Last { frame, seen });
        block
    }

    fn draw(
        &mut self,
        pixels: &[[u8; 3]],
        before: Option<&[[u8; 3]]>,
        seen: &mut [[u8; 3]],
        width: usize,
        delay_cs: u16,
    ) -> Block {
        let still = self.look(pixels, before, seen, width);
        let least = self.allowance.least_error(&still);
        let changed = self.count(pixels, width, least);
        let Some(area) = Area::around(&self.needs, width, |need| matches!(need, Need::Draw | Need::Better))
        else {
            return Block::nothing(delay_cs);
        };
        let histogram = &self.histograms[0];
        let palette = Palette::of_bins(histogram, if before.is_some() { 255 } else { 256 });
        let of_bins = Ink::of_bins(histogram, &palette);
        self.drawn_error = ink::mean_level_error(histogram, &of_bins, &palette);
        let clear = before.map(|_| palette.colours.len() as u8);
        let inks = Inks { palette: &palette, of_bins: &of_bins, histogram, clear };
        let needs = &self.needs;
        let (block, redrawn) =
            stripe::in_stripes(area, width, seen, &palette.colours, clear, delay_cs, |writer, top, seen| {
                let mut stripe = Stripe::new(inks, writer);
                for (y, seen) in (top..).zip(seen.chunks_exact_mut(width)) {
                    let part = y * width + area.left..y * width + area.right;
                    stripe.draw(Row {
                        columns: area.left..area.right,
                        y,
                        pixels: &pixels[part.clone()],
                        above: &pixels
                            [if y == 0 { part.clone() } else { part.start - width..part.end - width }],
                        needs: &needs[part],
                        seen: &mut seen[area.left..area.right],
                    });
                }
                stripe.redrawn()
            });
        self.allowance.pay(&still, &redrawn, changed as f64 / pixels.len() as f64);
        block
    }

    /// Notes what each pixel needs.
    fn look(
        &mut self,
        pixels: &[[u8; 3]],
        before: Option<&[[u8; 3]]>,
        seen: &[[u8; 3]],
        width: usize,
    ) -> Still {
        self.needs.resize(pixels.len(), Need::Draw);
        let Some(before) = before else { return Still::none() };
        let refining = self.allowance.is_left();
        let drawn_error = self.drawn_error;
        let near = Near::new();
        self.tile_errors.resize(width.div_ceil(TILE) * pixels.len().div_ceil(TILE * width), 0.0);
        let rows = self
            .needs
            .par_chunks_mut(TILE * width)
            .zip(self.tile_errors.par_chunks_mut(width.div_ceil(TILE)));
        let rows = rows.enumerate();
        let looked = rows.fold(Still::none, |mut still, (number, (needs, errors))| {
            let part = number * TILE * width..number * TILE * width + needs.len();
            let [pixels, before, seen] = [pixels, before, seen].map(|frame| &frame[part.clone()]);
            if !refining && pixels == before {
                needs.fill(Need::Nothing);
                still.count(needs.len());
                return still;
            }
            for left in (0..width).step_by(TILE) {
                let columns = left..(left + TILE).min(width);
                let mut tile = Tile::new(refining.then_some(near), drawn_error);
                for y in 0..needs.len() / width {
                    let row = y * width + columns.start..y * width + columns.end;
                    let frames = [pixels, before, seen].map(|frame| &frame[row.clone()]);
                    tile.look(frames, &mut needs[row], &mut still);
                }
                still.count_wrong(tile.wrong, tile.wrong_error());
                errors[left / TILE] = tile.wrong_error();
                if tile.may_be_left() {
                    for y in 0..needs.len() / width {
                        for need in &mut needs[y * width + columns.start..y * width + columns.end] {
                            if matches!(need, Need::Draw | Need::Free) {
                                *need = Need::Nothing;
                            }
                        }
                    }
                }
            }
            still
        });
        looked.reduce(Still::none, Still::join)
    }

    /// Counts the colours that are to be drawn, those of still pixels only from an error of their tile on. Gives the number of pixels
    /// that are to be drawn because they changed.
    fn count(&mut self, pixels: &[[u8; 3]], width: usize, least: f32) -> u64 {
        let part = pixels.len().div_ceil(PARTS);
        let (columns, tile_errors) = (width.div_ceil(TILE), &self.tile_errors);
        let parts = self.histograms.par_iter_mut().zip(self.needs.par_chunks_mut(part)).enumerate();
        let changed = parts.map(|(number, (histogram, needs))| {
            histogram.clear();
            let mut changed = 0;
            let (mut last, mut run) = ([0; 3], 0);
            for (at, need) in (number * part..).zip(needs) {
                match need {
                    Need::Nothing | Need::Free => continue,
                    Need::Better if tile_errors[at / width / TILE * columns + at % width / TILE] < least => {
                        *need = Need::Nothing;
                        continue;
                    }
                    Need::Better => (),
                    Need::Draw => changed += 1,
                }
                if pixels[at] != last {
                    histogram.add(last, run);
                    (last, run) = (pixels[at], 0);
                }
                run += 1;
            }
            histogram.add(last, run);
            changed
        });
        let changed = changed.sum();
        if let [all, others @ ..] = &mut self.histograms[..] {
            // Small frames have fewer parts.
            for other in &others[..pixels.len().div_ceil(part) - 1] {
                all.absorb(other);
            }
            all.sort();
        }
        changed
    }
}

/// What is known of a tile's pixels.
#[derive(Debug)]
struct Tile {
    /// Given where pixels that stay may be drawn better.
    refine: Option<Near>,
    drawn_error: f32,
    pixels: usize,
    /// Level error beyond that of a drawn pixel, of all that changed, and the largest level error of one.
    excess: f32,
    worst: f32,
    /// Pixels that stay and are seen wrong, and their errors.
    wrong: u64,
    sum_wrong: f32,
}

impl Tile {
    fn new(refine: Option<Near>, drawn_error: f32) -> Self {
        Self { refine, drawn_error, pixels: 0, excess: 0.0, worst: 0.0, wrong: 0, sum_wrong: 0.0 }
    }

    /// Notes what the pixels of a row need: `frames` are the frame, that before it and what is seen.
    fn look(&mut self, frames: [&[[u8; 3]]; 3], needs: &mut [Need], still: &mut Still) {
        let [pixels, before, seen] = frames;
        self.pixels += pixels.len();
        if self.refine.is_none() && pixels == before {
            needs.fill(Need::Nothing);
            still.count(needs.len());
            return;
        }
        for (((&now, &before), &seen), need) in pixels.iter().zip(before).zip(seen).zip(needs) {
            *need = if now == before {
                let error =
                    if now == seen { 0.0 } else { self.refine.map_or(0.0, |near| near.error(now, seen)) };
                if error > SEEN_WRONG {
                    self.wrong += 1;
                    self.sum_wrong += error;
                    Need::Better
                } else {
                    still.count(1);
                    Need::Nothing
                }
            } else {
                let error = colour::level_error(now, seen) as f32;
                self.excess += (error - self.drawn_error).max(0.0);
                self.worst = self.worst.max(error);
                match error {
                    0.0 => Need::Nothing,
                    error if error > SEEN_RIGHT => Need::Draw,
                    _ => Need::Free,
                }
            };
        }
    }

    /// The mean error of pixels that stay and are seen wrong.
    fn wrong_error(&self) -> f32 {
        self.sum_wrong / self.wrong.max(1) as f32
    }

    fn may_be_left(&self) -> bool {
        self.excess <= TOLERATED * self.pixels as f32 && self.worst <= GLARING
    }
}
