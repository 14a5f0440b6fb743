//! What of a frame needs to be drawn.
//!
//! A frame is looked at before the one before it is drawn, so that both can be worked on at once. Where that one is left
//! alone, what a viewer will see is known; where it is drawn, that each colour will be drawn with the palette's nearest
//! is assumed, and the next look finds what was not.
//!
//! Of what stays and is seen wrong, the worst of a tile ask to be drawn better, and those far from all changes only
//! when together they are worth the larger block.

use rayon::prelude::*;

use crate::allowance::Still;
use crate::block::Area;
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

/// The same, in parts of the mean of those of its tile: the worst are worth their flicker.
const AMONG_WORST: f32 = 0.8;
/// How many pixels the area of a frame may grow by for each pixel that stays and is drawn better. Runs of pixels that are
/// left are not for nothing: LZW learns their lengths one by one.
const GROWN_BY: usize = 6;

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
    tiles: Vec<TileNeeds>,
}

/// What a tile needs.
#[derive(Debug, Clone, Copy, Default)]
struct TileNeeds {
    /// Whether any of it is to be drawn because it changes.
    changes: bool,
    /// How many pixels stay, are seen wrong and ask for a better colour, and the mean of their squared errors.
    wrong: u32,
    error: f32,
}

impl Needs {
    /// All of a frame is to be drawn.
    pub(crate) fn want_all(&mut self, width: usize, pixels: usize) {
        self.width = width;
        self.pixels.clear();
        self.pixels.resize(pixels, Need::Draw);
        self.tiles.clear();
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
        self.tiles.resize(width.div_ceil(TILE) * pixels.len().div_ceil(TILE * width), TileNeeds::default());
        let refine = refining.then(Near::new);
        let bands =
            self.pixels.par_chunks_mut(TILE * width).zip(self.tiles.par_chunks_mut(width.div_ceil(TILE)));
        let looked = bands.enumerate().fold(Still::none, |mut still, (number, (needs, tiles))| {
            let start = number * TILE * width;
            let part = &pixels[start..start + needs.len()];
            look_at_band(part, width, before.part(start, needs.len()), refine, needs, tiles, &mut still);
            still
        });
        looked.reduce(Still::none, Still::join)
    }

    /// Leaves what stays alone where it lies apart from what changes, unless it is much for the area that it adds, or has
    /// `waited` for so many frames. `least`: the error from which a tile may be drawn better. Gives how long it has waited.
    pub(crate) fn confine(&mut self, least: f32, waited: usize) -> usize {
        let columns = self.width.div_ceil(TILE);
        let Some(inside) = Area::around(&self.tiles, columns, |tile| tile.changes) else { return waited };
        let (mut all, mut apart) = (inside, 0);
        for (at, tile) in self.tiles.iter().enumerate() {
            let (x, y) = (at % columns, at / columns);
            if tile.wrong > 0 && tile.error >= least && !inside.contains(x, y) {
                apart += tile.wrong as usize;
                all = all.with(x, y);
            }
        }
        let added = (all.size() - inside.size()) * TILE * TILE;
        if apart == 0 {
            return waited;
        }
        if apart * waited * GROWN_BY >= added {
            return 1;
        }
        for (at, tile) in self.tiles.iter_mut().enumerate() {
            if !inside.contains(at % columns, at / columns) {
                tile.error = f32::NEG_INFINITY;
            }
        }
        waited + 1
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
        let (width, columns, tiles) = (self.width, self.width.div_ceil(TILE), &self.tiles);
        let mut histograms = std::iter::once(&mut *all).chain(&mut *others).collect::<Vec<_>>();
        let parts = histograms.par_iter_mut().zip(self.pixels.par_chunks_mut(part)).enumerate();
        let changed = parts.map(|(number, (histogram, needs))| {
            histogram.clear();
            let mut changed = 0;
            let (mut last, mut run) = ([0; 3], 0);
            for (at, need) in (number * part..).zip(needs) {
                match need {
                    Need::Nothing | Need::Free => continue,
                    Need::Better if tiles[at / width / TILE * columns + at % width / TILE].error < least => {
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
    tiles: &mut [TileNeeds],
    still: &mut Still,
) {
    if refine.is_none() && pixels == before.frame {
        needs.fill(Need::Nothing);
        tiles.fill(TileNeeds::default());
        still.count(needs.len());
        return;
    }
    for (left, needed) in (0..width).step_by(TILE).zip(tiles) {
        let count = TILE.min(width - left);
        let mut tile = Tile::new(refine);
        let rows = (left..needs.len()).step_by(width);
        for (row, start) in rows.clone().enumerate() {
            let part = start..start + count;
            tile.look(row, &pixels[part.clone()], before.part(start, count), &mut needs[part], still);
        }
        *needed = tile.needs();
        if tile.wrong > 0 {
            for (row, start) in rows.clone().enumerate() {
                tile.leave_the_rest(row, &mut needs[start..start + count], still);
            }
            still.count_wrong(u64::from(needed.wrong), needed.error);
        }
        if tile.may_be_left(before.tolerated) {
            needed.changes = false;
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
    /// Pixels that stay and are seen wrong, the sum of their squared errors, and each of these.
    wrong: u32,
    sum_wrong: f32,
    errors: [f32; TILE * TILE],
}

impl Tile {
    fn new(refine: Option<Near>) -> Self {
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

    /// Notes what the pixels of a row need.
    fn look(
        &mut self,
        row: usize,
        pixels: &[[u8; 3]],
        before: Before<'_>,
        needs: &mut [Need],
        still: &mut Still,
    ) {
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
                    self.errors[row * TILE + k] = error;
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

    /// The error from which on pixels that stay are among the worst.
    fn least_wrong(&self) -> f32 {
        AMONG_WORST * self.sum_wrong / self.wrong.max(1) as f32
    }

    fn needs(&self) -> TileNeeds {
        let changes = self.worst > SEEN_RIGHT;
        if self.wrong == 0 {
            return TileNeeds { changes, wrong: 0, error: 0.0 };
        }
        let least = self.least_wrong();
        let worst = self.errors.iter().filter(|&&error| error > 0.0 && error >= least);
        let (wrong, sum) = worst.fold((0, 0.0), |(wrong, sum), error| (wrong + 1, sum + error));
        TileNeeds { changes, wrong, error: sum / wrong as f32 }
    }

    /// Leaves those of a row alone that are not among the worst.
    fn leave_the_rest(&self, row: usize, needs: &mut [Need], still: &mut Still) {
        let least = self.least_wrong();
        for (need, &error) in needs.iter_mut().zip(&self.errors[row * TILE..]) {
            if *need == Need::Better && error < least {
                *need = Need::Nothing;
                still.count(1);
            }
        }
    }

    fn may_be_left(&self, tolerated: f32) -> bool {
        self.excess <= tolerated * self.pixels as f32 && self.worst <= GLARING
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 x 20 tiles, of which the first changes and those given ask for better colours.
    fn needs(wrong: &[(usize, usize)]) -> Needs {
        let mut tiles = vec![TileNeeds::default(); 400];
        tiles[0].changes = true;
        for &(x, y) in wrong {
            tiles[y * 20 + x] = TileNeeds { changes: false, wrong: 30, error: 9.0 };
        }
        Needs { width: 160, pixels: Vec::new(), tiles }
    }

    #[test]
    fn a_little_far_from_all_changes_waits_and_much_does_not() {
        let mut waited = 1;
        let waits = std::iter::from_fn(|| {
            let mut few = needs(&[(19, 19), (10, 3)]);
            waited = few.confine(2.0, waited);
            (few.tiles[399].error < 2.0).then_some(())
        });
        // 25,536 pixels for 60.
        assert_eq!(waits.count(), 25_536 / (60 * GROWN_BY));
        assert_eq!(waited, 1);
        let all = (0..400).map(|at| (at % 20, at / 20)).collect::<Vec<_>>();
        let mut many = needs(&all);
        assert_eq!(many.confine(2.0, 1), 1);
        assert!(many.tiles.iter().all(|tile| tile.error >= 2.0 || tile.changes));
    }

    #[test]
    fn what_lies_among_changes_does_not_wait() {
        let mut beside = needs(&[(0, 0), (19, 19)]);
        beside.tiles[0].changes = true;
        assert_eq!(beside.confine(2.0, 3), 4);
        assert!(beside.tiles[0].error >= 2.0 && beside.tiles[399].error < 2.0);
        // Nothing asks, or not enough.
        assert_eq!(needs(&[]).confine(2.0, 3), 3);
        assert_eq!(needs(&[(19, 19)]).confine(10.0, 3), 3);
    }

    #[test]
    fn the_worst_of_a_tile_are_drawn_better() {
        let pixels = [[100; 3]; 64];
        let mut seen = pixels;
        // Half of the tile is a little wrong, the other half much.
        seen[..32].fill([103, 100, 100]);
        seen[32..].fill([112, 100, 100]);
        let needs = [Need::Nothing; 64];
        let before = Before {
            frame: &pixels,
            needs: &needs,
            seen: &seen,
            error: 0.0,
            tolerated: TOLERATED,
            inks: None,
        };
        let mut found = Needs::default();
        let _ = found.look(&pixels, 8, before, true);
        assert!(found.pixels[..32].iter().all(|&need| need == Need::Nothing));
        assert!(found.pixels[32..].iter().all(|&need| need == Need::Better));
        let [tile] = found.tiles[..] else { panic!("{:?}", found.tiles) };
        assert_eq!((tile.changes, tile.wrong), (false, 32));
        let error = Near::new().error(pixels[0], seen[63]);
        assert!((tile.error - error).abs() < 0.001 * error, "{} for {error}", tile.error);
    }
}
