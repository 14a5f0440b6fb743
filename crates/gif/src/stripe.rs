//! Chooses the palette index of each pixel while LZW compresses the indices.
//!
//! LZW writes a string of indices that is in its code table as one code. So if the best index would end the string, an
//! index that is nearly as good and continues it is used instead. Strings of pixels that are drawn are [sought
//! ahead](crate::ahead). If the next frame changes the pixel, an index may be worse, because its error is seen only
//! once.
//!
//! Error diffusion spreads the palette's error: the residual of a pixel, its intended minus its shown colour, is
//! divided between the pixels to the right and below. Three rules keep the file small:
//!
//! - A pixel corrects a part of the residual that reaches it. The part grows with the distance of its nearest palette
//!   entry. It is corrected only in smooth surroundings, where the eye sees the mean of neighbouring pixels.
//! - Mostly this only decides between indices that continue the string. An index other than the nearest begins a new
//!   string only if that saves much error.
//! - If much of the frame changes, the tolerance grows with the palette's own error, and more in rough surroundings.
//!
//! A block is divided into stripes of rows, which are processed in parallel. Each is a part of the image data with
//! its own code table.

use rayon::prelude::*;

use crate::ahead::{Ahead, Choices};
use crate::block::{self, Area, Block};
use crate::colour::{self, LocalMetric};
use crate::histogram::Histogram;
use crate::lzw::{Part, Writer};
use crate::nearest::Nearest;
use crate::palette::Palette;
use crate::refine_budget::Redrawn;
use crate::update_map::{PixelUpdate, SEEN_RIGHT_AGAIN};

/// The additional squared error (see [`colour`]) that an index may have if it makes the file smaller.
const TOLERANCE: f32 = 4.0;
/// The least tolerances of a pixel that the next frame changes, in smooth and in other surroundings: its error is seen
/// for one frame only, and more in smooth ones.
const TOLERANCES_IF_SOON_GONE: [f32; 2] = [6.0, 14.0];
/// The tolerance if no pixel may be off by more than `FEW_LEVELS`: there a larger error is not seen either.
const TOLERANCE_IF_FEW_LEVELS: f32 = 9.0;
const FEW_LEVELS: u8 = 2;
/// The tolerance per unit of the palette's mean error if much of the frame changes. The larger of both tolerances
/// holds. Such pixels are soon redrawn, and need no better colours than the palette has.
const TOLERANCE_BY_ERROR: f32 = 1.36;
/// The addition to that tolerance in surroundings that are not smooth.
const TOLERANCE_IF_ROUGH: f32 = 10.0;
/// A static pixel is redrawn only if its squared error shrinks by this factor: a smaller gain is
/// not worth the flicker.
const MUCH_BETTER: f32 = 2.0;
/// The surroundings of a pixel are smooth if the sum of its level errors against the pixels to the left and above is
/// at most this. `SMOOTH_BY_ERROR` is added per unit of the squared error of its nearest entry.
const SMOOTH: f32 = 24.0;
const SMOOTH_BY_ERROR: f32 = 0.6;
/// A pixel corrects nothing up to this squared error of the nearest entry.
const SMALL: f32 = 6.0;
/// The part of the residual that a pixel corrects per unit of error above `SMALL`, and the largest part.
const CORRECTED: f32 = 0.022;
const MAX_CORRECTED: f32 = 0.8;
/// If this part of the frame or more is drawn because it changed, a pixel corrects the full amount. Below, it
/// corrects proportionally less, but at least `LEAST_PART` of it.
const MUCH_CHANGED: f64 = 0.4;
const LEAST_PART: f32 = 0.4;
/// The part of a residual that is diffused: half of it to the right and half down.
const DIFFUSED: f32 = 0.8;
/// The largest residual of a channel, in levels.
const MAX_RESIDUAL: f32 = 24.0;
/// The squared error that an index other than the nearest must save to begin a new string.
const NEW_STRING: f32 = 40.0;
/// The nearest entry is used without comparing others if it continues the string and the residual adds at most this
/// to its squared error.
const AT_ONCE: f32 = 3.0;
/// The largest number of pixels of a stripe. Smaller stripes make the file larger, because each begins with
/// an empty code table.
const STRIPE: usize = 160_000;
/// The smallest stripe that is worth a thread.
const LEAST_STRIPE: usize = 30_000;

/// The colours with which a frame is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Colours<'a> {
    pub(crate) palette: &'a Palette,
    /// The nearest entry of each bin of the histogram.
    pub(crate) nearest: &'a [Nearest],
    pub(crate) histogram: &'a Histogram,
    /// The index that leaves a pixel as it is.
    pub(crate) transparent: Option<u8>,
    /// Nothing is seen where the frame leaves a pixel as it is.
    pub(crate) is_alone: bool,
    /// The part of the frame that is drawn because it changed.
    pub(crate) changed: f64,
    /// The mean squared error of the pixels drawn.
    pub(crate) error: f32,
    /// The largest error of a pixel in levels. The nearest entries are within it.
    pub(crate) bound: u8,
}

impl Colours<'_> {
    /// Returns the index that leaves a pixel as it is seen, unless nothing is seen there.
    fn over(&self) -> Option<u8> {
        self.transparent.filter(|_| !self.is_alone)
    }
}

/// The position of a block, and its division into stripes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layout<'a> {
    pub(crate) area: Area,
    /// The width of the whole frame.
    pub(crate) width: usize,
    /// The palette. `transparent` is the index that leaves a pixel as it is.
    pub(crate) colours: &'a [[u8; 3]],
    pub(crate) transparent: Option<u8>,
    pub(crate) delay_cs: u16,
    /// The least number of stripes, unless they would be too small to be worth a thread.
    pub(crate) stripes: usize,
}

/// Runs `draw` in parallel on stripes of whole rows of the layout's area. Its arguments are a writer, the first row
/// of the stripe, and the canvas in whole rows of the frame from that row on. Returns the block and the results.
pub(crate) fn in_stripes<R: Send>(
    layout: Layout<'_>,
    seen: &mut [[u8; 3]],
    draw: impl Fn(&mut Writer, usize, &mut [[u8; 3]]) -> R + Sync,
) -> (Block, Vec<R>) {
    let Layout { area, width, colours, transparent, delay_cs, stripes } = layout;
    let bits = block::bits(colours.len() + usize::from(transparent.is_some()));
    let height = area.bottom - area.top;
    let pixels = (area.right - area.left) * height;
    // An even number. With an odd one, one of two threads would wait for the last stripe.
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
    (Block::new(area, colours, transparent, delay_cs, &parts), results)
}

/// The choice of indices in a stripe, row by row.
#[derive(Debug)]
pub(crate) struct Stripe<'a> {
    colours: Colours<'a>,
    writer: &'a mut Writer,
    redrawn: Redrawn,
    metric: LocalMetric,
    /// The part of the residual that a pixel corrects per unit of error.
    corrected: f32,
    tolerance: f32,
    /// The tolerances of a pixel that the next frame changes, in smooth and in other surroundings.
    if_soon_gone: [f32; 2],
    /// The residual that each pixel of the row above diffuses down.
    from_above: Vec<[f32; 3]>,
    /// The string that is being written.
    ahead: Ahead,
}

/// A part of a row of a frame: its pixels, their updates, and the canvas.
pub(crate) struct Row<'a> {
    pub(crate) pixels: &'a [[u8; 3]],
    /// The pixels of the frame in the row above.
    pub(crate) above: &'a [[u8; 3]],
    /// The pixels of the frame after it.
    pub(crate) next: Option<&'a [[u8; 3]]>,
    pub(crate) updates: &'a [PixelUpdate],
    pub(crate) seen: &'a mut [[u8; 3]],
}

impl<'a> Stripe<'a> {
    pub(crate) fn new(colours: Colours<'a>, writer: &'a mut Writer) -> Self {
        let part = (colours.changed / MUCH_CHANGED).min(1.0) as f32;
        // A viewer may see the first frame for a long time.
        let soon_gone = if colours.over().is_some() { part } else { 0.0 };
        let least = if colours.bound <= FEW_LEVELS { TOLERANCE_IF_FEW_LEVELS } else { TOLERANCE };
        let tolerance = least.max(TOLERANCE_BY_ERROR * colours.error * soon_gone);
        let [smooth, rough] = TOLERANCES_IF_SOON_GONE;
        Self {
            colours,
            writer,
            redrawn: Redrawn::default(),
            metric: LocalMetric::new(),
            corrected: CORRECTED * part.max(LEAST_PART),
            tolerance,
            if_soon_gone: [smooth.max(tolerance), rough.max(tolerance + TOLERANCE_IF_ROUGH * soon_gone)],
            from_above: Vec::new(),
            ahead: Ahead::default(),
        }
    }

    /// Returns the pixels that all rows together redrew.
    pub(crate) fn redrawn(self) -> Redrawn {
        self.redrawn
    }

    pub(crate) fn draw(&mut self, row: Row<'_>) {
        let transparent = self.colours.transparent;
        let mut previous = None;
        self.from_above.resize(row.pixels.len(), [0.0; 3]);
        let mut diffused = [0.0; 3];
        self.ahead.start_row();
        for k in 0..row.pixels.len() {
            let (now, update, seen) = (row.pixels[k], row.updates[k], row.seen[k]);
            let above = self.from_above[k];
            let residual = [diffused[0] + above[0], diffused[1] + above[1], diffused[2] + above[2]];
            diffused = [0.0; 3];
            let (planned, entry) = self.planned(&row, k).unzip();
            let index = match update {
                PixelUpdate::Keep => {
                    let transparent = transparent.unwrap_or(0);
                    self.writer.put(transparent);
                    transparent
                }
                PixelUpdate::Either => self.kept_or_repeated(now, seen, previous),
                PixelUpdate::Refine | PixelUpdate::Draw => {
                    let entry = entry.flatten().unwrap_or_else(|| self.nearest(now));
                    let levels = colour::levels(now);
                    if entry.error > SMALL && row.is_smooth(k, entry.error) {
                        let part = ((entry.error - SMALL) * self.corrected).min(MAX_CORRECTED);
                        let target = [
                            levels[0] + part * residual[0],
                            levels[1] + part * residual[1],
                            levels[2] + part * residual[2],
                        ];
                        let index = match planned.filter(|&index| self.suits(&row, k, target, entry, index)) {
                            Some(index) => self.put(index),
                            None => {
                                self.ahead.drop_plan();
                                self.drawn(&row, k, target, entry, NEW_STRING)
                            }
                        };
                        let shown = if Some(index) == transparent { seen } else { self.colour(index) };
                        diffused = diffuse(residual, levels, colour::levels(shown));
                        index
                    } else if let Some(index) = planned {
                        self.put(index)
                    } else {
                        self.drawn(&row, k, levels, entry, f32::INFINITY)
                    }
                }
            };
            self.from_above[k] = diffused;
            previous = Some(index);
            if Some(index) != transparent {
                let colour = self.colour(index);
                if update == PixelUpdate::Refine {
                    self.redrawn.count(self.metric.error(seen, colour), colour::levels_apart(seen, colour));
                }
                row.seen[k] = colour;
            }
        }
    }

    /// Returns the index of a pixel that may be drawn or left. It is transparent, unless that would end the string
    /// and the index of the pixel before continues it and is no worse.
    fn kept_or_repeated(&mut self, now: [u8; 3], seen: [u8; 3], previous: Option<u8>) -> u8 {
        let transparent = self.colours.transparent.unwrap_or(0);
        if self.writer.extend(transparent) {
            return transparent;
        }
        let index = match previous.filter(|&index| index != transparent) {
            Some(index)
                if self.writer.continues(index)
                    && self.metric.error(now, self.colour(index)) <= self.metric.error(now, seen)
                    && self.is_within(now, self.colour(index)) =>
            {
                index
            }
            _ => transparent,
        };
        self.writer.put(index);
        index
    }

    /// Returns the index of a pixel in the string that costs least.
    fn planned(&mut self, row: &Row<'_>, k: usize) -> Option<(u8, Option<Nearest>)> {
        if !self.ahead.is_planned() && row.updates[k] == PixelUpdate::Draw {
            let mut ahead = std::mem::take(&mut self.ahead);
            ahead.plan(self.writer, k, row.pixels.len(), |k| self.choices(row, k));
            self.ahead = ahead;
        }
        self.ahead.take(k)
    }

    /// Returns the indices that a pixel may have.
    fn choices(&self, row: &Row<'_>, k: usize) -> Choices {
        let (now, seen, mut choices) = (row.pixels[k], row.seen[k], Choices::default());
        let over = self.colours.over();
        match row.updates[k] {
            PixelUpdate::Keep | PixelUpdate::Either => {
                choices.add(self.colours.transparent.unwrap_or(0), 0.0)
            }
            PixelUpdate::Refine => {}
            PixelUpdate::Draw => {
                let (entry, form, levels) = (self.nearest(now), self.metric.around(now), colour::levels(now));
                let tolerance = self.tolerance(row, k, entry);
                let nearest = form.error(levels, colour::levels(self.colour(entry.index)));
                choices.nearest = Some(entry);
                choices.add(entry.index, 0.0);
                let mut add = |index: u8, shown: [u8; 3], levels_shown: [f32; 3]| {
                    let more = form.error(levels, levels_shown) - nearest;
                    if more <= tolerance && self.is_within(now, shown) {
                        choices.add(index, more.max(0.0) / tolerance);
                    }
                };
                let others = &self.colours.palette.alternatives[usize::from(entry.index)];
                // By the triangle inequality, those after it are too far off.
                let apart = entry.error.sqrt() + (nearest + tolerance).sqrt();
                let count = others.apart.iter().take_while(|&&other| other <= apart * apart).count();
                for (&index, &levels) in others.indices[..count].iter().zip(&others.levels) {
                    add(index, self.colour(index), levels);
                }
                if let Some(transparent) = over {
                    add(transparent, seen, colour::levels(seen));
                }
            }
        }
        choices
    }

    /// Returns whether a planned index suits a pixel whose target is not its own colour.
    fn suits(&self, row: &Row<'_>, k: usize, target: [f32; 3], entry: Nearest, index: u8) -> bool {
        let form = self.metric.around(row.pixels[k]);
        let nearest = form.error(target, colour::levels(self.colour(entry.index)));
        let shown = if Some(index) == self.colours.over() { row.seen[k] } else { self.colour(index) };
        nearest <= NEW_STRING
            && form.error(target, colour::levels(shown)) <= nearest + self.tolerance(row, k, entry)
    }

    fn put(&mut self, index: u8) -> u8 {
        self.writer.put(index);
        index
    }

    /// Returns the error above that of the best index that is accepted to make the file smaller.
    fn tolerance(&self, row: &Row<'_>, k: usize, entry: Nearest) -> f32 {
        let change = row.next.map_or(0, |next| colour::level_error(row.pixels[k], next[k]));
        if change as f32 <= SEEN_RIGHT_AGAIN {
            return self.tolerance;
        }
        self.if_soon_gone[usize::from(!row.is_smooth(k, entry.error))]
    }

    /// Writes the index of a pixel that is drawn, and returns it.
    ///
    /// `target`: the levels of the pixel plus the corrected part of the residual. `entry`: the palette entry nearest
    /// to the pixel itself. `new_string`: the error that another index must save to begin a new string.
    fn drawn(&mut self, row: &Row<'_>, k: usize, target: [f32; 3], entry: Nearest, new_string: f32) -> u8 {
        let (now, update, seen) = (row.pixels[k], row.updates[k], row.seen[k]);
        // No error and no bytes. A pixel that is seen right may also be left, which is tried below.
        if entry.error == 0.0
            && (self.colours.over().is_none() || now != seen)
            && self.writer.extend(entry.index)
        {
            return entry.index;
        }
        let form = self.metric.around(now);
        let nearest = form.error(target, colour::levels(self.colour(entry.index)));
        if let Some(transparent) = self.colours.over()
            && self.is_within(now, seen)
        {
            let shown = form.error(target, colour::levels(seen));
            let bound = if update == PixelUpdate::Refine { MUCH_BETTER * nearest } else { nearest };
            if bound >= shown {
                self.writer.put(transparent);
                return transparent;
            }
            if update != PixelUpdate::Refine
                && shown <= nearest + self.tolerance(row, k, entry)
                && self.writer.extend(transparent)
            {
                return transparent;
            }
        }
        let at_once = nearest <= entry.error + AT_ONCE;
        if at_once && self.writer.extend(entry.index) {
            return entry.index;
        }
        if nearest <= new_string && !self.writer.is_known() {
            self.writer.put(entry.index);
            return entry.index;
        }
        let others = &self.colours.palette.alternatives[usize::from(entry.index)];
        let error = |at: usize| form.error(target, others.levels[at]);
        // The index that may begin a new string.
        let mut best = (entry.index, nearest);
        if nearest > new_string {
            for (at, &index) in others.indices.iter().enumerate() {
                let error = error(at);
                if error < best.1 && self.is_within(now, self.colour(index)) {
                    best = (index, error);
                }
            }
            if nearest - best.1 < new_string {
                best = (entry.index, nearest);
            }
        }
        let tried = |index: u8| at_once && index == entry.index;
        if !tried(best.0) && self.writer.extend(best.0) {
            return best.0;
        }
        // Of the indices that continue the string, the one with the least error within the tolerance.
        let mut candidates = self.writer.may_continue(&others.indices);
        let mut found = best;
        if candidates != 0 || best.0 != entry.index {
            found.1 += self.tolerance(row, k, entry);
            if !at_once && best.0 != entry.index && nearest < found.1 && self.writer.continues(entry.index) {
                found = (entry.index, nearest);
            }
        }
        while candidates != 0 {
            let at = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            let error = error(at);
            if error < found.1
                && self.writer.continues(others.indices[at])
                && self.is_within(now, self.colour(others.indices[at]))
            {
                found = (others.indices[at], error);
            }
        }
        self.writer.put(found.0);
        found.0
    }

    /// Returns the palette entry nearest to a colour, or the closest in levels if that one is too far off.
    fn nearest(&self, now: [u8; 3]) -> Nearest {
        let bin = self.colours.histogram.find(now).unwrap_or(0);
        let entry = self.colours.nearest[bin];
        if self.is_within(now, self.colour(entry.index)) {
            return entry;
        }
        let (index, _) = colour::closest(&self.colours.palette.colours, now);
        Nearest { index, error: self.metric.error(now, self.colour(index)) }
    }

    fn is_within(&self, now: [u8; 3], shown: [u8; 3]) -> bool {
        colour::levels_off(now, shown) <= self.colours.bound
    }

    fn colour(&self, index: u8) -> [u8; 3] {
        self.colours.palette.colours[usize::from(index)]
    }
}

impl Row<'_> {
    /// Returns whether the surroundings of a pixel are smooth. `error`: the error of its nearest palette entry.
    fn is_smooth(&self, k: usize, error: f32) -> bool {
        let (now, left) = (self.pixels[k], self.pixels[k.saturating_sub(1)]);
        let step = colour::level_error(now, left) + colour::level_error(now, self.above[k]);
        step as f32 <= SMOOTH + SMOOTH_BY_ERROR * error
    }
}

/// Returns the residual that a pixel passes to each of two others: half of the diffused part of its own residual. That
/// is the residual that reached the pixel, plus its intended minus its shown colour.
fn diffuse(residual: [f32; 3], meant: [f32; 3], shown: [f32; 3]) -> [f32; 3] {
    let channel =
        |k: usize| (residual[k] + meant[k] - shown[k]).clamp(-MAX_RESIDUAL, MAX_RESIDUAL) * (0.5 * DIFFUSED);
    [channel(0), channel(1), channel(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::histogram::MAX_BINS;

    const SIDE: usize = 64;

    /// Returns the canvas after a square of one colour was drawn.
    fn drawn(rgb: [u8; 3], colours: &[[u8; 3]]) -> Vec<[u8; 3]> {
        let mut histogram = Histogram::new(MAX_BINS);
        histogram.add(rgb, 1);
        let palette = Palette::new(colours.to_vec());
        let point = colour::point_of(rgb);
        let index = palette.nearest(&point, 0);
        let error = colour::error(&point, &palette.points[usize::from(index)]);
        let nearest = [Nearest { index, error }];
        let colours = Colours {
            palette: &palette,
            nearest: &nearest,
            histogram: &histogram,
            transparent: None,
            is_alone: false,
            changed: 1.0,
            error,
            bound: u8::MAX,
        };
        let mut writer = Writer::new(8);
        let mut stripe = Stripe::new(colours, &mut writer);
        let mut seen = vec![[0; 3]; SIDE * SIDE];
        for seen in seen.chunks_mut(SIDE) {
            let (pixels, updates) = ([rgb; SIDE], [PixelUpdate::Draw; SIDE]);
            stripe.draw(Row { pixels: &pixels, above: &pixels, next: None, updates: &updates, seen });
        }
        seen
    }

    fn mean(seen: &[[u8; 3]]) -> [f32; 3] {
        [0, 1, 2].map(|c| seen.iter().map(|rgb| f32::from(rgb[c])).sum::<f32>() / seen.len() as f32)
    }

    #[test]
    fn a_residual_is_halved_and_bounded() {
        let half = 0.5 * DIFFUSED;
        assert_eq!(
            diffuse([1.0, -2.0, 0.0], [100.0; 3], [98.0, 104.0, 100.0]),
            [3.0 * half, -6.0 * half, 0.0]
        );
        let most = MAX_RESIDUAL * half;
        assert_eq!(diffuse([0.0; 3], [255.0, 0.0, 10.0], [0.0, 255.0, 0.0]), [most, -most, 10.0 * half]);
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
