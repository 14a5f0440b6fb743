//! A frame and what a viewer sees before it, to the block that turns the one into the other.
//!
//! Pixels that are seen right are left alone, and so are pixels that are as in the frame before, unless they are seen
//! wrong and the [allowance](crate::allowance) has room. For the others a palette is made, and each colour has its
//! [ink](crate::ink); the [stripes](crate::stripe) choose the indices.

use image::RgbImage;
use rayon::prelude::*;

use crate::allowance::{Allowance, Redrawn, Still};
use crate::block::Block;
use crate::histogram::Histogram;
use crate::ink::Ink;
use crate::palette::Palette;
use crate::stripe::{Inks, Need, Row, Stripe};
use crate::{colour, exact};

/// Pixels of a stripe, about.
const STRIPE: usize = 20_000;
/// Parts of a frame whose colours are counted side by side.
const PARTS: usize = 4;
/// The squared error (see [`colour`]) up to which a pixel that changes may be left as it is seen.
const SEEN_RIGHT: f32 = 2.0;
/// The squared error above which a pixel that stays asks for a better colour.
const SEEN_WRONG: f32 = 2.0;

/// Turns frames into blocks, one after the other.
#[derive(Debug)]
pub(crate) struct Quantiser {
    last: Option<Last>,
    histograms: Vec<Histogram>,
    needs: Vec<Need>,
    allowance: Allowance,
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
        let histograms = (0..PARTS).map(|_| Histogram::new()).collect();
        Self { last: None, histograms, needs: Vec::new(), allowance: Allowance::new() }
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
        let still = self.look(pixels, before, seen);
        let least = self.allowance.least_error(&still);
        self.count(pixels, seen, least);
        let histogram = &self.histograms[0];
        if histogram.bins().is_empty() {
            return Block::nothing(delay_cs);
        }
        let palette = Palette::of_bins(histogram, if before.is_some() { 255 } else { 256 });
        let of_bins = Ink::of_bins(histogram, &palette);
        let clear = before.map(|_| palette.colours.len() as u8);
        let inks = Inks { palette: &palette, of_bins: &of_bins, histogram, clear };
        let (indices, redrawn) = indices(inks, pixels, &self.needs, seen, width);
        self.allowance.pay(&still, &redrawn);
        Block::cut(indices, width, &palette.colours, clear, delay_cs)
    }

    /// Notes what each pixel needs.
    fn look(&mut self, pixels: &[[u8; 3]], before: Option<&[[u8; 3]]>, seen: &[[u8; 3]]) -> Still {
        self.needs.resize(pixels.len(), Need::Draw);
        let Some(before) = before else { return Still::none() };
        let part = pixels.len().div_ceil(PARTS);
        let parts = self.needs.par_chunks_mut(part).enumerate().map(|(number, needs)| {
            let mut still = Still::none();
            for (at, need) in (number * part..).zip(needs) {
                *need = need_of(pixels[at], before[at], seen[at], &mut still);
            }
            still
        });
        parts.reduce(Still::none, Still::join)
    }

    /// Counts the colours that are to be drawn, those of still pixels only from an error on.
    fn count(&mut self, pixels: &[[u8; 3]], seen: &[[u8; 3]], least: f32) {
        let part = pixels.len().div_ceil(PARTS);
        let parts = self.histograms.par_iter_mut().zip(self.needs.par_chunks_mut(part)).enumerate();
        parts.for_each(|(number, (histogram, needs))| {
            histogram.clear();
            for (at, need) in (number * part..).zip(needs) {
                if *need == Need::Better && colour::near_error(pixels[at], seen[at]) < least {
                    *need = Need::Nothing;
                }
                if matches!(need, Need::Draw | Need::Better) {
                    histogram.add(pixels[at], 1);
                }
            }
        });
        if let [all, others @ ..] = &mut self.histograms[..] {
            // Small frames have fewer parts.
            for other in &others[..pixels.len().div_ceil(part) - 1] {
                all.absorb(other);
            }
            all.sort();
        }
    }
}

fn need_of(now: [u8; 3], before: [u8; 3], seen: [u8; 3], still: &mut Still) -> Need {
    let error = if now == seen { 0.0 } else { colour::near_error(now, seen) };
    if now == before {
        if error > SEEN_WRONG {
            still.count_wrong(error);
            return Need::Better;
        }
        still.count();
        return Need::Nothing;
    }
    match error {
        _ if now == seen => Need::Nothing,
        error if error > SEEN_RIGHT => Need::Draw,
        _ => Need::Free,
    }
}

/// An index for each pixel; what is seen is brought up to date.
fn indices(
    inks: Inks<'_>,
    pixels: &[[u8; 3]],
    needs: &[Need],
    seen: &mut [[u8; 3]],
    width: usize,
) -> (Vec<u8>, Vec<Redrawn>) {
    let (left, right) = span(needs, width);
    let mut indices = vec![inks.clear.unwrap_or(0); pixels.len()];
    let rows = STRIPE.div_ceil(width);
    let stripes = indices.par_chunks_mut(rows * width).zip(seen.par_chunks_mut(rows * width)).enumerate();
    let redrawn = stripes.map(|(number, (indices, seen))| {
        let mut stripe = Stripe::new(inks);
        let lines = indices.chunks_mut(width).zip(seen.chunks_mut(width));
        for (y, (indices, seen)) in (number * rows..).zip(lines) {
            let part = y * width + left..y * width + right;
            stripe.draw(Row {
                left,
                y,
                pixels: &pixels[part.clone()],
                needs: &needs[part],
                indices: &mut indices[left..right],
                seen: &mut seen[left..right],
            });
        }
        stripe.redrawn()
    });
    let redrawn = redrawn.collect();
    (indices, redrawn)
}

/// The columns in which a pixel may be drawn.
fn span(needs: &[Need], width: usize) -> (usize, usize) {
    let (mut left, mut right) = (width, 0);
    for row in needs.chunks_exact(width) {
        if let Some(first) = row.iter().position(|need| *need != Need::Nothing) {
            left = left.min(first);
            right = right.max(row.iter().rposition(|need| *need != Need::Nothing).unwrap_or(first) + 1);
        }
    }
    (left, right)
}
