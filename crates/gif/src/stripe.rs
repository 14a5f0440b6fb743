//! Indices of rows of pixels, chosen as LZW reads them.
//!
//! LZW writes a string of indices that it has met before as one code. So where the best index would end such a string
//! and another one, nearly as good, would not, the other is taken. Frames are worked on in stripes of rows side by side,
//! each a part of the image's data of its own.

use std::ops::Range;

use rayon::prelude::*;

use crate::allowance::Redrawn;
use crate::block::{self, Area, Block};
use crate::colour::{self, Near};
use crate::histogram::Histogram;
use crate::ink::{Dye, Ink};
use crate::look::Need;
use crate::lzw::{Part, Writer};
use crate::palette::Palette;

/// How much more squared error (see [`colour`](crate::colour)) an index may have that makes the file smaller.
const LENIENCE: f32 = 6.0;
/// The level error against the pixels to the left and above, together, up to which the surroundings are smooth, so that
/// a pattern is seen as its mean.
const SMOOTH: u32 = 24;
/// How many of a colour's nearest others are tried.
const TRIED: usize = 8;
/// Pixels of a stripe, at most. Fewer cost size: each stripe begins with an empty book.
const STRIPE: usize = 160_000;
/// Smaller ones are not worth a thread.
const LEAST_STRIPE: usize = 30_000;
/// From how many colours on a book is soon full, so that two or four stripes cost nothing.
const SOME_COLOURS: usize = 1024;
const MANY_COLOURS: usize = 4096;

/// What a frame is drawn with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inks<'a> {
    pub(crate) palette: &'a Palette,
    pub(crate) of_bins: &'a [Ink],
    pub(crate) histogram: &'a Histogram,
    /// The index that leaves a pixel as it is.
    pub(crate) clear: Option<u8>,
}

/// What a block is drawn on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sheet<'a> {
    pub(crate) area: Area,
    /// Of the whole frame.
    pub(crate) width: usize,
    /// The palette, and the index that leaves a pixel as it is.
    pub(crate) colours: &'a [[u8; 3]],
    pub(crate) clear: Option<u8>,
    pub(crate) delay_cs: u16,
    /// Of how many colours the pixels are before they are drawn.
    pub(crate) meant: usize,
}

/// Runs `draw` on stripes of whole rows of a sheet, side by side: with a writer, the first row and what is seen from it
/// on. Gives the block and the results.
pub(crate) fn in_stripes<R: Send>(
    sheet: Sheet<'_>,
    seen: &mut [[u8; 3]],
    draw: impl Fn(&mut Writer, usize, &mut [[u8; 3]]) -> R + Sync,
) -> (Block, Vec<R>) {
    let Sheet { area, width, colours, clear, delay_cs, meant } = sheet;
    let bits = block::bits(colours.len() + usize::from(clear.is_some()));
    let height = area.bottom - area.top;
    let pixels = (area.right - area.left) * height;
    let least = match meant {
        0..SOME_COLOURS => 1,
        SOME_COLOURS..MANY_COLOURS => 2,
        _ => 4,
    };
    // An odd one out would be drawn while other threads wait.
    let count = match pixels.div_ceil(STRIPE) {
        1 => least.min((pixels / LEAST_STRIPE).max(1)),
        many => many.next_multiple_of(2).max(least),
    };
    let rows = height.div_ceil(count);
    let stripes = seen[area.top * width..area.bottom * width].par_chunks_mut(rows * width).enumerate();
    let drawn = stripes.map(|(number, seen)| {
        let mut writer = Writer::new(bits);
        let result = draw(&mut writer, area.top + number * rows, seen);
        (writer.finish((number + 1) * rows >= height), result)
    });
    let (parts, results): (Vec<Part>, Vec<R>) = drawn.unzip();
    (Block::new(area, colours, clear, delay_cs, &parts), results)
}

/// Chooses indices row by row.
#[derive(Debug)]
pub(crate) struct Stripe<'a> {
    inks: Inks<'a>,
    writer: &'a mut Writer,
    redrawn: Redrawn,
    near: Near,
}

/// Part of a row: what is meant, what it needs, and what a viewer sees.
pub(crate) struct Row<'a> {
    pub(crate) columns: Range<usize>,
    pub(crate) y: usize,
    pub(crate) pixels: &'a [[u8; 3]],
    /// What is meant in the row above.
    pub(crate) above: &'a [[u8; 3]],
    pub(crate) needs: &'a [Need],
    pub(crate) seen: &'a mut [[u8; 3]],
}

impl<'a> Stripe<'a> {
    pub(crate) fn new(inks: Inks<'a>, writer: &'a mut Writer) -> Self {
        Self { inks, writer, redrawn: Redrawn::default(), near: Near::new() }
    }

    /// What all rows together drew anew.
    pub(crate) fn redrawn(self) -> Redrawn {
        self.redrawn
    }

    pub(crate) fn draw(&mut self, row: Row<'_>) {
        let clear = self.inks.clear;
        let mut previous = None;
        let mut last = ([0; 3], None);
        for (k, x) in row.columns.enumerate() {
            let (now, need) = (row.pixels[k], row.needs[k]);
            let seen = row.seen[k];
            let index = match need {
                Need::Nothing => {
                    let clear = clear.unwrap_or(0);
                    self.writer.put(clear);
                    clear
                }
                Need::Free => self.free(now, seen, previous),
                Need::Better | Need::Draw => {
                    if last.0 != now || last.1.is_none() {
                        let bin = self.inks.histogram.find(now).unwrap_or(0);
                        last = (now, Some(&self.inks.of_bins[bin]));
                    }
                    let Some(ink) = last.1 else { continue };
                    let smooth = colour::level_error(now, row.pixels[k.saturating_sub(1)])
                        + colour::level_error(now, row.above[k])
                        <= SMOOTH;
                    let best = if smooth { ink.at(x, row.y) } else { ink.plain };
                    self.drawn(now, need, seen, ink, best)
                }
            };
            previous = Some(index);
            if Some(index) != clear {
                let colour = self.inks.palette.colours[usize::from(index)];
                if need == Need::Better {
                    self.redrawn.count(self.near.error(seen, colour));
                }
                row.seen[k] = colour;
            }
        }
    }

    /// The index before, if that is at least as good as nothing and nothing would end the string.
    fn free(&mut self, now: [u8; 3], seen: [u8; 3], previous: Option<u8>) -> u8 {
        let clear = self.inks.clear.unwrap_or(0);
        if self.writer.extend(clear) {
            return clear;
        }
        let index = match previous.filter(|&index| index != clear) {
            Some(index)
                if self.writer.continues(index) && self.error(now, index) <= self.near.error(now, seen) =>
            {
                index
            }
            _ => clear,
        };
        self.writer.put(index);
        index
    }

    fn drawn(&mut self, now: [u8; 3], need: Need, seen: [u8; 3], ink: &Ink, best: Dye) -> u8 {
        let Dye { index: best, error: least } = best;
        if let Some(clear) = self.inks.clear {
            let lenience = if need == Need::Better { least } else { LENIENCE };
            // Levels alone are part of the error, and often enough to say.
            let shown = match colour::levels_apart(now, seen) as f32 {
                levels if levels > least + lenience => levels,
                _ => self.near.error(now, seen),
            };
            if least >= shown || shown <= least + lenience && self.writer.extend(clear) {
                if least >= shown {
                    self.writer.put(clear);
                }
                return clear;
            }
        }
        if self.writer.extend(best) {
            return best;
        }
        if !self.writer.is_known() {
            self.writer.put(best);
            return best;
        }
        let mut found = (best, least + LENIENCE);
        let reach = ink.reach(found.1);
        if best != ink.plain.index {
            self.consider(now, ink.plain.index, &mut found);
        }
        for neighbour in self.inks.palette.neighbours(ink.plain.index).iter().take(TRIED) {
            if neighbour.apart > reach {
                break;
            }
            self.consider(now, neighbour.index, &mut found);
        }
        self.writer.put(found.0);
        found.0
    }

    /// Prefers an index that the string goes on with if its error is less.
    fn consider(&self, now: [u8; 3], index: u8, found: &mut (u8, f32)) {
        if self.writer.continues(index) {
            let error = self.error(now, index);
            if error < found.1 {
                *found = (index, error);
            }
        }
    }

    fn error(&self, now: [u8; 3], index: u8) -> f32 {
        self.near.error(now, self.inks.palette.colours[usize::from(index)])
    }
}
