//! Indices of rows of pixels, chosen as LZW reads them.
//!
//! LZW writes a string of indices that it has met before as one code. So where the best index would end such a string
//! and another one, nearly as good, would not, the other is taken. What is amiss then, and what the palette has no colour
//! for, the pixels to the right and below make good in part: the more, the farther off the palette's colours are, and
//! only where the surroundings are smooth enough for the mean to be seen. Mostly that only tips the choice of what
//! continues a string; a colour that is not the nearest begins a new one only when that saves much. So gradients are mixed
//! for few bytes, and errors do not add up. Where much changes, and more so in rough surroundings, the palette's own error
//! is the measure of what is nearly as good. Frames are worked on in stripes of rows side by side, each a part of the
//! image's data of its own.

use rayon::prelude::*;

use crate::allowance::Redrawn;
use crate::block::{self, Area, Block};
use crate::colour::{self, Near};
use crate::histogram::Histogram;
use crate::ink::Ink;
use crate::look::Need;
use crate::lzw::{Part, Writer};
use crate::palette::Palette;

/// How much more squared error (see [`colour`](crate::colour)) an index may have that makes the file smaller.
const LENIENCE: f32 = 6.0;
/// The same where much changes, if that is more: so much for each unit of the palette's mean error. What is soon drawn
/// anew needs no better colours than the palette has.
const LENIENCE_BY_ERROR: f32 = 1.4;
/// More of it there, where the surroundings are not smooth.
const LENIENCE_IF_ROUGH: f32 = 10.0;
/// A pixel that stays is drawn anew only if its squared error becomes so many times smaller: less gained would not be worth
/// the flicker.
const MUCH_BETTER: f32 = 2.0;
/// The level error against the pixels to the left and above, together, up to which the surroundings are smooth; more by
/// `SMOOTH_BY_ERROR` for each unit of the nearest colour's squared error.
const SMOOTH: f32 = 24.0;
const SMOOTH_BY_ERROR: f32 = 0.6;
/// The squared error of the nearest colour up to which a pixel makes nothing good.
const SMALL: f32 = 6.0;
/// The part of what is amiss that a pixel makes good, for each unit of error beyond that, and at most.
const MADE_GOOD: f32 = 0.022;
const MOST_MADE_GOOD: f32 = 0.8;
/// The part of a frame that is drawn because it changed from which on all that holds in full. Below, proportionally less
/// is made good, down to a least part of it.
const MUCH_CHANGED: f64 = 0.4;
const LEAST_PART: f32 = 0.4;
/// The part that is handed on, half of it to the right, half down; and how many levels at most.
const HANDED_ON: f32 = 0.8;
const MOST_AMISS: f32 = 24.0;
/// How much squared error a colour that is not the nearest must save to begin a new string.
const FRESH: f32 = 40.0;
/// How much more squared error than it has by itself the nearest colour may have, with what is amiss, to be taken without
/// a look at others if it continues the string.
const AT_ONCE: f32 = 3.0;
/// Pixels of a stripe, at most. Fewer cost size: each stripe begins with an empty book.
const STRIPE: usize = 160_000;
/// Smaller ones are not worth a thread.
const LEAST_STRIPE: usize = 30_000;

/// What a frame is drawn with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inks<'a> {
    pub(crate) palette: &'a Palette,
    pub(crate) of_bins: &'a [Ink],
    pub(crate) histogram: &'a Histogram,
    /// The index that leaves a pixel as it is.
    pub(crate) clear: Option<u8>,
    /// The part of the frame that is drawn because it changed.
    pub(crate) changed: f64,
    /// Mean squared error of what is drawn.
    pub(crate) error: f32,
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
    /// The least number of stripes, as far as each is worth a thread.
    pub(crate) stripes: usize,
}

/// Runs `draw` on stripes of whole rows of a sheet, side by side: with a writer, the first row and what is seen from it
/// on. Gives the block and the results.
pub(crate) fn in_stripes<R: Send>(
    sheet: Sheet<'_>,
    seen: &mut [[u8; 3]],
    draw: impl Fn(&mut Writer, usize, &mut [[u8; 3]]) -> R + Sync,
) -> (Block, Vec<R>) {
    let Sheet { area, width, colours, clear, delay_cs, stripes } = sheet;
    let bits = block::bits(colours.len() + usize::from(clear.is_some()));
    let height = area.bottom - area.top;
    let pixels = (area.right - area.left) * height;
    // By size alone, an odd one out would be drawn while other threads wait.
    let count = match pixels.div_ceil(STRIPE) {
        1 => stripes.min((pixels / LEAST_STRIPE).max(1)),
        many => many.next_multiple_of(2).max(stripes),
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
    /// The part of what is amiss that a pixel makes good, for each unit of error.
    made_good: f32,
    /// Where the surroundings are smooth, and where not.
    leniences: [f32; 2],
    /// What the pixels above hand down to each of the row.
    handed_down: Vec<[f32; 3]>,
}

/// Part of a row: what is meant, what it needs, and what a viewer sees.
pub(crate) struct Row<'a> {
    pub(crate) pixels: &'a [[u8; 3]],
    /// What is meant in the row above.
    pub(crate) above: &'a [[u8; 3]],
    pub(crate) needs: &'a [Need],
    pub(crate) seen: &'a mut [[u8; 3]],
}

impl<'a> Stripe<'a> {
    pub(crate) fn new(inks: Inks<'a>, writer: &'a mut Writer) -> Self {
        let part = (inks.changed / MUCH_CHANGED).min(1.0) as f32;
        // A viewer may see the first frame for long.
        let soon_gone = if inks.clear.is_some() { part } else { 0.0 };
        let lenience = LENIENCE.max(LENIENCE_BY_ERROR * inks.error * soon_gone);
        Self {
            inks,
            writer,
            redrawn: Redrawn::default(),
            near: Near::new(),
            made_good: MADE_GOOD * part.max(LEAST_PART),
            leniences: [lenience, lenience + LENIENCE_IF_ROUGH * soon_gone],
            handed_down: Vec::new(),
        }
    }

    /// What all rows together drew anew.
    pub(crate) fn redrawn(self) -> Redrawn {
        self.redrawn
    }

    pub(crate) fn draw(&mut self, row: Row<'_>) {
        let clear = self.inks.clear;
        let mut previous = None;
        let mut last = ([0; 3], None);
        self.handed_down.resize(row.pixels.len(), [0.0; 3]);
        let mut handed_on = [0.0; 3];
        for k in 0..row.pixels.len() {
            let (now, need, seen) = (row.pixels[k], row.needs[k], row.seen[k]);
            let above = self.handed_down[k];
            let amiss = [handed_on[0] + above[0], handed_on[1] + above[1], handed_on[2] + above[2]];
            handed_on = [0.0; 3];
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
                        last = (now, Some(self.inks.of_bins[bin]));
                    }
                    let Some(ink) = last.1 else { continue };
                    let levels = colour::levels(now);
                    if ink.error > SMALL && row.is_smooth(k, ink.error) {
                        let part = ((ink.error - SMALL) * self.made_good).min(MOST_MADE_GOOD);
                        let target = [
                            levels[0] + part * amiss[0],
                            levels[1] + part * amiss[1],
                            levels[2] + part * amiss[2],
                        ];
                        let index = self.drawn(&row, k, target, ink, FRESH);
                        let shown = if Some(index) == clear { seen } else { self.colour(index) };
                        handed_on = hand_on(amiss, levels, colour::levels(shown));
                        index
                    } else {
                        self.drawn(&row, k, levels, ink, f32::INFINITY)
                    }
                }
            };
            self.handed_down[k] = handed_on;
            previous = Some(index);
            if Some(index) != clear {
                let colour = self.colour(index);
                if need == Need::Better {
                    self.redrawn.count(self.near.error(seen, colour), colour::levels_apart(seen, colour));
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
                if self.writer.continues(index)
                    && self.near.error(now, self.colour(index)) <= self.near.error(now, seen) =>
            {
                index
            }
            _ => clear,
        };
        self.writer.put(index);
        index
    }

    /// How much more error than of the best index is taken for the sake of the file's size.
    fn lenience(&self, row: &Row<'_>, k: usize, ink: Ink) -> f32 {
        let [smooth, rough] = self.leniences;
        if rough > smooth && !row.is_smooth(k, ink.error) { rough } else { smooth }
    }

    /// The index for a pixel. `target` is what is meant with what is amiss around it; a colour that is not the nearest
    /// begins a string only when that saves more error than `fresh`.
    fn drawn(&mut self, row: &Row<'_>, k: usize, target: [f32; 3], ink: Ink, fresh: f32) -> u8 {
        let (now, need, seen) = (row.pixels[k], row.needs[k], row.seen[k]);
        // As good as can be, for nothing. What is seen right may be left, too.
        if ink.error == 0.0 && (self.inks.clear.is_none() || now != seen) && self.writer.extend(ink.index) {
            return ink.index;
        }
        let form = self.near.around(now);
        let nearest = form.error(target, colour::levels(self.colour(ink.index)));
        if let Some(clear) = self.inks.clear {
            let shown = form.error(target, colour::levels(seen));
            let bound = if need == Need::Better { MUCH_BETTER * nearest } else { nearest };
            if bound >= shown {
                self.writer.put(clear);
                return clear;
            }
            if need != Need::Better
                && shown <= nearest + self.leniences[1]
                && shown <= nearest + self.lenience(row, k, ink)
                && self.writer.extend(clear)
            {
                return clear;
            }
        }
        let at_once = nearest <= ink.error + AT_ONCE;
        if at_once && self.writer.extend(ink.index) {
            return ink.index;
        }
        if nearest <= fresh && !self.writer.is_known() {
            self.writer.put(ink.index);
            return ink.index;
        }
        let around = &self.inks.palette.around[usize::from(ink.index)];
        let error = |at: usize| form.error(target, around.levels[at]);
        let mut best = (ink.index, nearest);
        if nearest > fresh {
            for (at, &index) in around.indices.iter().enumerate() {
                let error = error(at);
                if error < best.1 {
                    best = (index, error);
                }
            }
            if nearest - best.1 < fresh {
                best = (ink.index, nearest);
            }
        }
        let tried = |index: u8| at_once && index == ink.index;
        if !tried(best.0) && self.writer.extend(best.0) {
            return best.0;
        }
        let mut candidates = self.writer.may_continue(&around.indices);
        let mut found = best;
        if candidates != 0 || best.0 != ink.index {
            found.1 += self.lenience(row, k, ink);
            if !at_once && best.0 != ink.index && nearest < found.1 && self.writer.continues(ink.index) {
                found = (ink.index, nearest);
            }
        }
        while candidates != 0 {
            let at = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            let error = error(at);
            if error < found.1 && self.writer.continues(around.indices[at]) {
                found = (around.indices[at], error);
            }
        }
        self.writer.put(found.0);
        found.0
    }

    fn colour(&self, index: u8) -> [u8; 3] {
        self.inks.palette.colours[usize::from(index)]
    }
}

impl Row<'_> {
    /// Whether a pixel whose nearest colour has an error is so much like those around that their mean is seen.
    fn is_smooth(&self, k: usize, error: f32) -> bool {
        let (now, left) = (self.pixels[k], self.pixels[k.saturating_sub(1)]);
        let step = colour::level_error(now, left) + colour::level_error(now, self.above[k]);
        step as f32 <= SMOOTH + SMOOTH_BY_ERROR * error
    }
}

/// What each of two pixels is handed by one with what was amiss before, what is meant and what is shown.
fn hand_on(amiss: [f32; 3], meant: [f32; 3], shown: [f32; 3]) -> [f32; 3] {
    let channel =
        |k: usize| (amiss[k] + meant[k] - shown[k]).clamp(-MOST_AMISS, MOST_AMISS) * (0.5 * HANDED_ON);
    [channel(0), channel(1), channel(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::histogram::MOST_BINS;

    const SIDE: usize = 64;

    /// What is seen of a square of one colour.
    fn drawn(rgb: [u8; 3], colours: &[[u8; 3]]) -> Vec<[u8; 3]> {
        let mut histogram = Histogram::new(MOST_BINS);
        histogram.add(rgb, 1);
        let palette = Palette::new(colours.to_vec());
        let point = colour::point_of(rgb);
        let index = palette.nearest(&point, 0);
        let error = colour::error(&point, &palette.points[usize::from(index)]);
        let of_bins = [Ink { index, error }];
        let inks = Inks {
            palette: &palette,
            of_bins: &of_bins,
            histogram: &histogram,
            clear: None,
            changed: 1.0,
            error,
        };
        let mut writer = Writer::new(8);
        let mut stripe = Stripe::new(inks, &mut writer);
        let mut seen = vec![[0; 3]; SIDE * SIDE];
        for seen in seen.chunks_mut(SIDE) {
            let (pixels, needs) = ([rgb; SIDE], [Need::Draw; SIDE]);
            stripe.draw(Row { pixels: &pixels, above: &pixels, needs: &needs, seen });
        }
        seen
    }

    fn mean(seen: &[[u8; 3]]) -> [f32; 3] {
        [0, 1, 2].map(|c| seen.iter().map(|rgb| f32::from(rgb[c])).sum::<f32>() / seen.len() as f32)
    }

    #[test]
    fn half_way_is_mixed_and_near_a_colour_is_not() {
        let colours = [[100; 3], [120; 3]];
        for (level, least, most) in
            [(100, 100.0, 100.0), (101, 100.0, 100.0), (110, 108.0, 112.0), (120, 120.0, 120.0)]
        {
            let [r, g, b] = mean(&drawn([level; 3], &colours));
            assert!(r == g && g == b && (least..=most).contains(&r), "{level}: {r}");
        }
    }

    #[test]
    fn three_colours_mend_the_mean() {
        let target = [109, 109, 100];
        let found = mean(&drawn(target, &[[100, 100, 100], [130, 100, 100], [100, 130, 100]]));
        assert!((0..3).all(|c| (found[c] - f32::from(target[c])).abs() < 4.0), "{found:?}");
    }
}
