//! What of a frame needs to be drawn.
//!
//! A frame is looked at before the one before it is drawn, so that both can be worked on at once. Where that one is left
//! alone, what a viewer will see is known; where it is drawn, that each colour will be drawn with the palette's nearest
//! is assumed, and the next look finds what was not.

use rayon::prelude::*;

use crate::allowance::Still;
use crate::colour::{self, Near};
use crate::histogram::Histogram;
use crate::ink::Ink;

/// Width and height of what is drawn or left as a whole: single pixels drawn among others that are left cost as much
/// as if all were drawn.
const TILE: usize = 8;
/// [Level error](colour::level_error) beyond that of a drawn pixel, in the mean of a tile, up to which the tile is left.
pub(crate) const TOLERATED: f32 = 20.0;
/// The same where the palette has all colours: there an error is seen more easily.
pub(crate) const TOLERATED_IF_EXACT: f32 = 6.0;
/// The level error of a pixel above which its tile is drawn in any case: almost three levels.
pub(crate) const GLARING: f32 = 50.0;
/// The level error up to which a pixel that changes may be left in a tile that is drawn.
const SEEN_RIGHT: f32 = 2.0;
/// The squared error (see [`colour`]) above which a pixel that stays asks for a better colour.
const SEEN_WRONG: f32 = 1.5;

/// What a pixel asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// To be left alone.
    Nothing,
    /// Nothing, but may be drawn if that is no worse.
    Free,
    /// It stays as it was but is seen wrong: to be drawn if that is much better.
    Better,
    /// To be drawn.
    Draw,
}

/// The frame before, which is about to be drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Before<'a> {
    pub(crate) frame: &'a [[u8; 3]],
    pub(crate) needs: &'a [Need],
    /// What a viewer sees until then.
    pub(crate) seen: &'a [[u8; 3]],
    /// Mean level error of what will be drawn.
    pub(crate) error: f32,
    /// [Level error](colour::level_error) beyond that, in the mean of a tile, up to which the tile is left.
    pub(crate) tolerated: f32,
    /// What will be drawn with which squared error; `None`: all of it with none.
    pub(crate) inks: Option<(&'a Histogram, &'a [Ink])>,
}

/// What pixels need, row by row.
#[derive(Debug, Default)]
pub(crate) struct Needs {
    width: usize,
    pub(crate) pixels: Vec<Need>,
    /// Of the pixels of each tile that stay and are seen wrong.
    tile_errors: Vec<f32>,
}

impl Needs {
    /// All of a frame is to be drawn.
    pub(crate) fn want_all(&mut self, width: usize, pixels: usize) {
        self.width = width;
        self.pixels.clear();
        self.pixels.resize(pixels, Need::Draw);
        self.tile_errors.clear();
    }

    /// Looks at a frame; `refining`: whether pixels that stay may be drawn better.
    pub(crate) fn look(
        &mut self,
        pixels: &[[u8; 3]],
        width: usize,
        before: Before<'_>,
        refining: bool,
    ) -> Still {
        self.width = width;
        self.pixels.resize(pixels.len(), Need::Draw);
        self.tile_errors.resize(width.div_ceil(TILE) * pixels.len().div_ceil(TILE * width), 0.0);
        let refine = refining.then(Near::new);
        let bands = self
            .pixels
            .par_chunks_mut(TILE * width)
            .zip(self.tile_errors.par_chunks_mut(width.div_ceil(TILE)));
        let looked = bands.enumerate().fold(Still::none, |mut still, (number, (needs, errors))| {
            let start = number * TILE * width;
            let part = &pixels[start..start + needs.len()];
            look_at_band(part, width, before.part(start, needs.len()), refine, needs, errors, &mut still);
            still
        });
        looked.reduce(Still::none, Still::join)
    }

    /// Counts the colours that are to be drawn, those of pixels that stay only from an error of their tile on. Gives the
    /// number of pixels that are drawn because they changed.
    pub(crate) fn count(
        &mut self,
        pixels: &[[u8; 3]],
        least: f32,
        all: &mut Histogram,
        others: &mut [Histogram],
    ) -> u64 {
        let part = pixels.len().div_ceil(1 + others.len());
        let (width, columns, tile_errors) = (self.width, self.width.div_ceil(TILE), &self.tile_errors);
        let mut histograms = std::iter::once(&mut *all).chain(&mut *others).collect::<Vec<_>>();
        let parts = histograms.par_iter_mut().zip(self.pixels.par_chunks_mut(part)).enumerate();
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
        // Small frames have fewer parts.
        for other in &others[..pixels.len().div_ceil(part) - 1] {
            all.absorb(other);
        }
        changed
    }
}

impl<'a> Before<'a> {
    /// The squared error with which a colour will be drawn.
    fn error_of(&self, rgb: [u8; 3]) -> f32 {
        let ink = self.inks.and_then(|(histogram, inks)| inks.get(histogram.find(rgb)?));
        ink.map_or(0.0, |ink| ink.error)
    }

    fn part(self, start: usize, count: usize) -> Self {
        let range = start..start + count;
        Self {
            frame: &self.frame[range.clone()],
            needs: &self.needs[range.clone()],
            seen: &self.seen[range],
            error: self.error,
            tolerated: self.tolerated,
            inks: self.inks,
        }
    }
}

/// Looks at a row of tiles.
fn look_at_band(
    pixels: &[[u8; 3]],
    width: usize,
    before: Before<'_>,
    refine: Option<Near>,
    needs: &mut [Need],
    errors: &mut [f32],
    still: &mut Still,
) {
    if refine.is_none() && pixels == before.frame {
        needs.fill(Need::Nothing);
        still.count(needs.len());
        return;
    }
    for (left, error) in (0..width).step_by(TILE).zip(errors) {
        let count = TILE.min(width - left);
        let mut tile = Tile::new(refine);
        let rows = (left..needs.len()).step_by(width);
        for start in rows.clone() {
            let part = start..start + count;
            tile.look(&pixels[part.clone()], before.part(start, count), &mut needs[part], still);
        }
        still.count_wrong(tile.wrong, tile.wrong_error());
        *error = tile.wrong_error();
        if tile.may_be_left(before.tolerated) {
            for start in rows {
                for need in &mut needs[start..start + count] {
                    if matches!(need, Need::Draw | Need::Free) {
                        *need = Need::Nothing;
                    }
                }
            }
        }
    }
}

/// What is known of a tile's pixels.
#[derive(Debug)]
struct Tile {
    /// Given where pixels that stay may be drawn better.
    refine: Option<Near>,
    pixels: usize,
    /// Level error beyond that of a drawn pixel, of all that changed, and the largest level error of one.
    excess: f32,
    worst: f32,
    /// Pixels that stay and are seen wrong, and their errors.
    wrong: u64,
    sum_wrong: f32,
}

impl Tile {
    fn new(refine: Option<Near>) -> Self {
        Self { refine, pixels: 0, excess: 0.0, worst: 0.0, wrong: 0, sum_wrong: 0.0 }
    }

    /// Notes what the pixels of a row need.
    fn look(&mut self, pixels: &[[u8; 3]], before: Before<'_>, needs: &mut [Need], still: &mut Still) {
        self.pixels += pixels.len();
        if self.refine.is_none() && pixels == before.frame {
            needs.fill(Need::Nothing);
            still.count(needs.len());
            return;
        }
        // By number: five iterators in one are not always inlined, which costs a tenth of the encoder's time.
        let count = pixels.len();
        let (frame, shown, drawn) = (&before.frame[..count], &before.seen[..count], &before.needs[..count]);
        for (k, need) in needs[..count].iter_mut().enumerate() {
            let (now, was, seen) = (pixels[k], frame[k], shown[k]);
            let left = drawn[k] == Need::Nothing;
            *need = if now == was {
                let error = match self.refine {
                    Some(near) if left && now != seen => near.error(now, seen),
                    Some(_) if !left => before.error_of(now),
                    _ => 0.0,
                };
                if error > SEEN_WRONG {
                    self.wrong += 1;
                    self.sum_wrong += error;
                    Need::Better
                } else {
                    still.count(1);
                    Need::Nothing
                }
            } else {
                let error = colour::level_error(now, if left { seen } else { was }) as f32;
                if left {
                    self.excess += (error - before.error).max(0.0);
                } else {
                    self.excess += error;
                }
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

    fn may_be_left(&self, tolerated: f32) -> bool {
        self.excess <= tolerated * self.pixels as f32 && self.worst <= GLARING
    }
}
