//! The update map of a frame: for each pixel, whether it is drawn.
//!
//! A frame is compared with the canvas that a viewer will see before it. Both frames can be processed at once,
//! because the canvas is estimated before the previous frame is drawn. A pixel that the previous frame leaves shows
//! what was seen before. A pixel that it draws is assumed to show the palette's nearest entry. A pixel that it may
//! leave counts as left. If another index was chosen, the next comparison finds it. Before a frame is drawn itself,
//! the canvas is known, and pixels that would be left too far off are [drawn](UpdateMap::draw_what_is_off).
//!
//! The frame is divided into tiles. A tile whose changes are small is left as a whole. In each tile, the worst of the
//! static pixels that are seen wrong are refined, that is, redrawn with a better colour. Tiles away from all changes
//! are refined only if together they are worth the larger block.

use rayon::prelude::*;

use crate::block::Area;
use crate::colour::{self, LocalMetric};
use crate::histogram::Histogram;
use crate::nearest::Nearest;
use crate::refine_budget::StaticPixels;

/// The width and height of a tile. A tile is drawn or left as a whole: single pixels drawn among others that are left
/// cost as many bytes as if all were drawn.
const TILE: usize = 8;
/// A tile is left if its mean [level error](colour::level_error), beyond that of a drawn pixel, is at most this.
pub(crate) const SKIP_ERROR: f32 = 20.0;
/// The same limit if the palette has all colours of the frame: an error is seen more easily there.
pub(crate) const EXACT_SKIP_ERROR: f32 = 6.0;
/// A tile is always redrawn if one of its pixels has a larger level error; this is almost three levels.
pub(crate) const MAX_SKIPPED_ERROR: f32 = 50.0;
/// The level error up to which a pixel that changes may be left in a tile that is drawn.
const SEEN_RIGHT: f32 = 2.0;
/// The same limit for a pixel that could be left in the frame before: one level in each channel.
pub(crate) const SEEN_RIGHT_AGAIN: f32 = 6.0;
/// The squared error (see [`colour`]) above which a static pixel needs a better colour.
const SEEN_WRONG: f32 = 1.5;
/// Pixels are refined from this part of the tile's mean error on: only the worst of a tile are worth the flicker.
const AMONG_WORST: f32 = 0.8;
/// The number of pixels by which the area of a frame may grow per pixel refined. Even pixels that are left cost
/// bytes, because LZW learns the lengths of their runs one by one.
const GROWN_BY: usize = 6;

/// The update of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PixelUpdate {
    /// The pixel is left as it is seen.
    Keep,
    /// The pixel is left or drawn; the choice makes the file smaller.
    Either,
    /// The pixel is static but seen wrong: it is drawn with a colour that is much better, else left.
    Refine,
    /// The pixel is drawn.
    Draw,
}

impl PixelUpdate {
    /// Returns whether the pixel may use a colour of the palette that is made for the frame.
    pub(crate) fn may_draw(self) -> bool {
        matches!(self, PixelUpdate::Draw | PixelUpdate::Refine)
    }

    /// Encodes the update for a suspended animation.
    pub(crate) fn to_byte(self) -> u8 {
        match self {
            PixelUpdate::Keep => 0,
            PixelUpdate::Either => 1,
            PixelUpdate::Refine => 2,
            PixelUpdate::Draw => 3,
        }
    }

    pub(crate) fn of_byte(byte: u8) -> Option<Self> {
        [PixelUpdate::Keep, PixelUpdate::Either, PixelUpdate::Refine, PixelUpdate::Draw]
            .get(usize::from(byte))
            .copied()
    }
}

/// The previous frame, which is about to be drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Previous<'a> {
    pub(crate) frame: &'a [[u8; 3]],
    pub(crate) updates: &'a [PixelUpdate],
    /// The canvas before the previous frame is drawn.
    pub(crate) seen: &'a [[u8; 3]],
    /// The mean level error of the pixels that it draws.
    pub(crate) error: f32,
    /// [`SKIP_ERROR`] or [`EXACT_SKIP_ERROR`].
    pub(crate) skip_error: f32,
    /// Its colours, and the nearest palette entry of each; `None` if it is drawn without error.
    pub(crate) nearest: Option<(&'a Histogram, &'a [Nearest])>,
}

/// The updates of all pixels, row by row.
#[derive(Debug, Default)]
pub(crate) struct UpdateMap {
    width: usize,
    pub(crate) pixels: Vec<PixelUpdate>,
    tiles: Vec<TileUpdate>,
}

/// The update of a tile.
#[derive(Debug, Clone, Copy, Default)]
struct TileUpdate {
    /// A pixel of the tile is drawn because it changes.
    changes: bool,
    /// The number of pixels to refine; `error` is the mean of their squared errors.
    wrong: u32,
    error: f32,
}

impl UpdateMap {
    /// Makes the map of a suspended animation. Its updates are final, so [`count`](Self::count) counts them unchanged.
    pub(crate) fn decided(width: usize, pixels: Vec<PixelUpdate>) -> Self {
        let tiles = width.div_ceil(TILE) * pixels.len().div_ceil(TILE * width);
        let as_it_is = TileUpdate { changes: false, wrong: 0, error: f32::INFINITY };
        Self { width, pixels, tiles: vec![as_it_is; tiles] }
    }

    /// Marks all pixels of a frame as drawn.
    pub(crate) fn draw_all(&mut self, width: usize, pixels: usize) {
        self.width = width;
        self.pixels.clear();
        self.pixels.resize(pixels, PixelUpdate::Draw);
        self.tiles.clear();
    }

    /// Compares a frame with the one before it. `refining`: static pixels may be refined. Returns the static pixels.
    pub(crate) fn compare(
        &mut self,
        pixels: &[[u8; 3]],
        width: usize,
        previous: Previous<'_>,
        refining: bool,
    ) -> StaticPixels {
        self.width = width;
        self.pixels.resize(pixels.len(), PixelUpdate::Draw);
        self.tiles.resize(width.div_ceil(TILE) * pixels.len().div_ceil(TILE * width), TileUpdate::default());
        let metric = refining.then(LocalMetric::new);
        let bands =
            self.pixels.par_chunks_mut(TILE * width).zip(self.tiles.par_chunks_mut(width.div_ceil(TILE)));
        let compared = bands.enumerate().fold(StaticPixels::none, |mut still, (number, (updates, tiles))| {
            let start = number * TILE * width;
            let part = &pixels[start..start + updates.len()];
            compare_band(
                part,
                width,
                previous.part(start, updates.len()),
                metric,
                updates,
                tiles,
                &mut still,
            );
            still
        });
        compared.reduce(StaticPixels::none, StaticPixels::join)
    }

    /// Drops refinements outside of the area that changes, unless they are worth the pixels by which the area grows.
    /// They are worth more with each frame that they have waited.
    ///
    /// `least`: the error from which a tile may be refined. `waited`: the number of frames in a row that refined
    /// nothing outside, plus one. Returns the new `waited`.
    pub(crate) fn confine(&mut self, least: f32, waited: usize) -> usize {
        let columns = self.width.div_ceil(TILE);
        let Some(inside) = Area::around(&self.tiles, columns, |tile| tile.changes) else { return waited };
        let (mut all, mut outside) = (inside, 0);
        for (at, tile) in self.tiles.iter().enumerate() {
            let (x, y) = (at % columns, at / columns);
            if tile.wrong > 0 && tile.error >= least && !inside.contains(x, y) {
                outside += tile.wrong as usize;
                all = all.with(x, y);
            }
        }
        let added = (all.size() - inside.size()) * TILE * TILE;
        if outside == 0 {
            return waited;
        }
        if outside * waited * GROWN_BY >= added {
            return 1;
        }
        for (at, tile) in self.tiles.iter_mut().enumerate() {
            if !inside.contains(at % columns, at / columns) {
                tile.error = f32::NEG_INFINITY;
            }
        }
        waited + 1
    }

    /// Marks the pixels as drawn that would be left further off than `bound`, now that the canvas is known. Returns
    /// whether there are any.
    pub(crate) fn draw_what_is_off(&mut self, pixels: &[[u8; 3]], seen: &[[u8; 3]], bound: u8) -> bool {
        let part = pixels.len().div_ceil(rayon::current_num_threads());
        let parts = self.pixels.par_chunks_mut(part).zip(pixels.par_chunks(part)).zip(seen.par_chunks(part));
        let found = parts.map(|((updates, pixels), seen)| {
            let mut found = false;
            for ((update, now), seen) in updates.iter_mut().zip(pixels).zip(seen) {
                if colour::levels_off(*now, *seen) > bound
                    && matches!(update, PixelUpdate::Keep | PixelUpdate::Either)
                {
                    *update = PixelUpdate::Draw;
                    found = true;
                }
            }
            found
        });
        found.reduce(|| false, |a, b| a || b)
    }

    /// Counts the colours of the pixels that are drawn or refined into `all`. Each of `others` counts a part of the
    /// frame in parallel. Pixels of tiles with an error below `least` are kept instead of refined. Returns the number
    /// of pixels that are drawn.
    pub(crate) fn count(
        &mut self,
        pixels: &[[u8; 3]],
        least: f32,
        all: &mut Histogram,
        others: &mut [Histogram],
    ) -> u64 {
        let part = pixels.len().div_ceil(1 + others.len());
        let (width, columns, tiles) = (self.width, self.width.div_ceil(TILE), &self.tiles);
        let mut histograms = std::iter::once(&mut *all).chain(&mut *others).collect::<Vec<_>>();
        let parts = histograms.par_iter_mut().zip(self.pixels.par_chunks_mut(part)).enumerate();
        let changed = parts.map(|(number, (histogram, updates))| {
            histogram.clear();
            let mut changed = 0;
            let (mut last, mut run) = ([0; 3], 0);
            for (at, update) in (number * part..).zip(updates) {
                match update {
                    PixelUpdate::Keep | PixelUpdate::Either => continue,
                    PixelUpdate::Refine
                        if tiles[at / width / TILE * columns + at % width / TILE].error < least =>
                    {
                        *update = PixelUpdate::Keep;
                        continue;
                    }
                    PixelUpdate::Refine => (),
                    PixelUpdate::Draw => changed += 1,
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

impl<'a> Previous<'a> {
    /// Returns the squared error with which a colour will be drawn.
    fn error_of(&self, rgb: [u8; 3]) -> f32 {
        let entry = self.nearest.and_then(|(histogram, nearest)| nearest.get(histogram.find(rgb)?));
        entry.map_or(0.0, |entry| entry.error)
    }

    fn part(self, start: usize, count: usize) -> Self {
        let range = start..start + count;
        Self {
            frame: &self.frame[range.clone()],
            updates: &self.updates[range.clone()],
            seen: &self.seen[range],
            error: self.error,
            skip_error: self.skip_error,
            nearest: self.nearest,
        }
    }
}

/// Compares a row of tiles.
fn compare_band(
    pixels: &[[u8; 3]],
    width: usize,
    previous: Previous<'_>,
    refine: Option<LocalMetric>,
    updates: &mut [PixelUpdate],
    tiles: &mut [TileUpdate],
    still: &mut StaticPixels,
) {
    if refine.is_none() && pixels == previous.frame {
        updates.fill(PixelUpdate::Keep);
        tiles.fill(TileUpdate::default());
        still.count(updates.len());
        return;
    }
    for (left, needed) in (0..width).step_by(TILE).zip(tiles) {
        let count = TILE.min(width - left);
        let mut tile = Tile::new(refine);
        let rows = (left..updates.len()).step_by(width);
        for (row, start) in rows.clone().enumerate() {
            let part = start..start + count;
            tile.compare(row, &pixels[part.clone()], previous.part(start, count), &mut updates[part], still);
        }
        *needed = tile.updates();
        if tile.wrong > 0 {
            for (row, start) in rows.clone().enumerate() {
                tile.keep_the_rest(row, &mut updates[start..start + count], still);
            }
            still.count_wrong(u64::from(needed.wrong), needed.error);
        }
        if tile.may_be_left(previous.skip_error) {
            needed.changes = false;
            for start in rows {
                for update in &mut updates[start..start + count] {
                    if matches!(update, PixelUpdate::Draw | PixelUpdate::Either) {
                        *update = PixelUpdate::Keep;
                    }
                }
            }
        }
    }
}

/// The comparison of a tile's pixels.
#[derive(Debug)]
struct Tile {
    /// The metric, if static pixels may be refined.
    refine: Option<LocalMetric>,
    pixels: usize,
    /// The sum of the level errors of the changed pixels beyond that of a drawn pixel; `worst` is the largest
    /// level error of one.
    excess: f32,
    worst: f32,
    /// The number of static pixels that are seen wrong, the sum of their squared errors, and each of these.
    wrong: u32,
    sum_wrong: f32,
    errors: [f32; TILE * TILE],
}

impl Tile {
    fn new(refine: Option<LocalMetric>) -> Self {
        Self {
            refine,
            pixels: 0,
            excess: 0.0,
            worst: 0.0,
            wrong: 0,
            sum_wrong: 0.0,
            errors: [0.0; TILE * TILE],
        }
    }

    /// Decides the updates of the pixels of a row.
    fn compare(
        &mut self,
        row: usize,
        pixels: &[[u8; 3]],
        previous: Previous<'_>,
        updates: &mut [PixelUpdate],
        still: &mut StaticPixels,
    ) {
        self.pixels += pixels.len();
        if self.refine.is_none() && pixels == previous.frame {
            updates.fill(PixelUpdate::Keep);
            still.count(updates.len());
            return;
        }
        // By index: five zipped iterators are not always inlined, which costs a tenth of the encoder's time.
        let count = pixels.len();
        let (frame, shown, drawn) =
            (&previous.frame[..count], &previous.seen[..count], &previous.updates[..count]);
        for (k, update) in updates[..count].iter_mut().enumerate() {
            let (now, was, seen) = (pixels[k], frame[k], shown[k]);
            // Pixels that may be left mostly are. If they counted as drawn, one small change after the
            // other would be left.
            let left = matches!(drawn[k], PixelUpdate::Keep | PixelUpdate::Either);
            *update = if now == was {
                let error = match self.refine {
                    Some(metric) if left && now != seen => metric.error(now, seen),
                    Some(_) if !left => previous.error_of(now),
                    _ => 0.0,
                };
                if error > SEEN_WRONG {
                    self.wrong += 1;
                    self.sum_wrong += error;
                    self.errors[row * TILE + k] = error;
                    PixelUpdate::Refine
                } else {
                    still.count(1);
                    PixelUpdate::Keep
                }
            } else {
                let error = colour::level_error(now, if left { seen } else { was }) as f32;
                if left {
                    self.excess += (error - previous.error).max(0.0);
                } else {
                    self.excess += error;
                }
                let right = if drawn[k] == PixelUpdate::Either { SEEN_RIGHT_AGAIN } else { SEEN_RIGHT };
                self.worst = self.worst.max(error);
                match error {
                    0.0 => PixelUpdate::Keep,
                    error if error > right => PixelUpdate::Draw,
                    _ => PixelUpdate::Either,
                }
            };
        }
    }

    /// Returns the error from which a static pixel is among the worst.
    fn least_wrong(&self) -> f32 {
        AMONG_WORST * self.sum_wrong / self.wrong.max(1) as f32
    }

    fn updates(&self) -> TileUpdate {
        let changes = self.worst > SEEN_RIGHT;
        if self.wrong == 0 {
            return TileUpdate { changes, wrong: 0, error: 0.0 };
        }
        let least = self.least_wrong();
        let worst = self.errors.iter().filter(|&&error| error > 0.0 && error >= least);
        let (wrong, sum) = worst.fold((0, 0.0), |(wrong, sum), error| (wrong + 1, sum + error));
        TileUpdate { changes, wrong, error: sum / wrong as f32 }
    }

    /// Keeps the pixels of a row that are not among the worst.
    fn keep_the_rest(&self, row: usize, updates: &mut [PixelUpdate], still: &mut StaticPixels) {
        let least = self.least_wrong();
        for (update, &error) in updates.iter_mut().zip(&self.errors[row * TILE..]) {
            if *update == PixelUpdate::Refine && error < least {
                *update = PixelUpdate::Keep;
                still.count(1);
            }
        }
    }

    fn may_be_left(&self, skip_error: f32) -> bool {
        self.excess <= skip_error * self.pixels as f32 && self.worst <= MAX_SKIPPED_ERROR
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map of 20 x 20 tiles. The first changes, and those given are to be refined.
    fn updates(wrong: &[(usize, usize)]) -> UpdateMap {
        let mut tiles = vec![TileUpdate::default(); 400];
        tiles[0].changes = true;
        for &(x, y) in wrong {
            tiles[y * 20 + x] = TileUpdate { changes: false, wrong: 30, error: 9.0 };
        }
        UpdateMap { width: 160, pixels: Vec::new(), tiles }
    }

    #[test]
    fn a_little_far_from_all_changes_waits_and_much_does_not() {
        let mut waited = 1;
        let waits = std::iter::from_fn(|| {
            let mut few = updates(&[(19, 19), (10, 3)]);
            waited = few.confine(2.0, waited);
            (few.tiles[399].error < 2.0).then_some(())
        });
        // 25,536 pixels for 60.
        assert_eq!(waits.count(), 25_536 / (60 * GROWN_BY));
        assert_eq!(waited, 1);
        let all = (0..400).map(|at| (at % 20, at / 20)).collect::<Vec<_>>();
        let mut many = updates(&all);
        assert_eq!(many.confine(2.0, 1), 1);
        assert!(many.tiles.iter().all(|tile| tile.error >= 2.0 || tile.changes));
    }

    #[test]
    fn what_lies_among_changes_does_not_wait() {
        let mut beside = updates(&[(0, 0), (19, 19)]);
        beside.tiles[0].changes = true;
        assert_eq!(beside.confine(2.0, 3), 4);
        assert!(beside.tiles[0].error >= 2.0 && beside.tiles[399].error < 2.0);
        // There is nothing to refine, or its error is too small.
        assert_eq!(updates(&[]).confine(2.0, 3), 3);
        assert_eq!(updates(&[(19, 19)]).confine(10.0, 3), 3);
    }

    #[test]
    fn the_worst_of_a_tile_are_refined() {
        let pixels = [[100; 3]; 64];
        let mut seen = pixels;
        // Half of the tile is a little wrong, the other half much.
        seen[..32].fill([103, 100, 100]);
        seen[32..].fill([112, 100, 100]);
        let updates = [PixelUpdate::Keep; 64];
        let previous = Previous {
            frame: &pixels,
            updates: &updates,
            seen: &seen,
            error: 0.0,
            skip_error: SKIP_ERROR,
            nearest: None,
        };
        let mut found = UpdateMap::default();
        let _ = found.compare(&pixels, 8, previous, true);
        assert!(found.pixels[..32].iter().all(|&update| update == PixelUpdate::Keep));
        assert!(found.pixels[32..].iter().all(|&update| update == PixelUpdate::Refine));
        let [tile] = found.tiles[..] else { panic!("{:?}", found.tiles) };
        assert_eq!((tile.changes, tile.wrong), (false, 32));
        let error = LocalMetric::new().error(pixels[0], seen[63]);
        assert!((tile.error - error).abs() < 0.001 * error, "{} for {error}", tile.error);
    }
}
