//! Plans the pixels of the next pass, and the number of samples of each.
//!
//! The possible numbers of samples of a pixel form a chain. A pixel goes on to the next number
//!
//! - if its error is estimated to be too large,
//! - if the error of a neighbour with at least as many samples is too large, and its own samples differ,
//! - if a neighbour with at least as many samples varies so much that all of the pixel's own samples may have missed a
//!   part of it,
//! - if it lies between two neighbours with at least as many samples, on opposite sides, whose errors are too large,
//! - if a neighbour is more than [`AHEAD`] numbers ahead on the chain.
//!
//! In a dense neighbourhood ([`Density`]) a pixel also goes on if a neighbour's error is too large, whatever its own
//! samples show, and if a neighbour is more than one number ahead. If samples are not clamped, it goes on if a
//! neighbour's error is far too large, or if a neighbour is more than one number ahead.
//!
//! In this way slivers thinner than a pixel are found along their length, although the first samples of some of their
//! pixels miss them. The bias of deciding by a pixel's own samples shrinks, because many pixels decide together.
//!
//! An object smaller than a pixel may be missed by the first samples of all pixels that show it. Such pixels are known
//! beforehand ([`Floors`]). They go on to a number that does not depend on their samples.

use rayfold_scene::Tone;
use rayon::prelude::*;

use super::bits::{BitRows, Bits, WORD, between, widened};
use super::chain::{SampleSchedule, Verdict};
use super::density::Density;
use super::first::First;
use super::floors::Floors;
use super::pixel::{ONE, Pixel};
use crate::parts;

/// The largest difference between two neighbours with one sample each, as a multiple of the requested error.
pub(super) const CONTRAST: f64 = 1.5;

/// A pixel goes on if a neighbour is more than this many numbers of the chain ahead: it has 16 times as many samples.
const AHEAD: usize = 3;

/// The largest number of decisions about which pixels go on. It limits the distance over which pixels depend on each
/// other, so that a band can be drawn by itself. The example scenes take up to 34 decisions
/// (docs/decisions/frames-in-bands.md).
pub(super) const MAX_ROUNDS: u32 = 128;

/// The number of rows that are processed together.
const BAND: usize = 16;

/// The pixels of a pass, and the number of samples of each.
#[derive(Clone, Copy)]
pub(crate) struct PassTargets<'a> {
    chain: &'a SampleSchedule,
    density: Option<&'a Density>,
    /// The pixels that get samples.
    pub(crate) pixels: &'a Bits,
    /// Whether the pass gives the first sample to pixels that may get no other.
    pub(crate) is_first_look: bool,
}

impl PassTargets<'_> {
    /// Returns the number of samples after the pass of a pixel that has `count` samples and gets some in the pass.
    #[inline(always)]
    pub(crate) fn goal(&self, count: u32) -> u32 {
        self.chain.goal(count)
    }

    /// Returns whether samples are not clamped. Then the first look takes no samples of the picture.
    #[inline(always)]
    pub(crate) fn is_unclamped(&self) -> bool {
        parts::BUILT.paths && self.chain.is_unclamped()
    }

    /// Returns the number of moments, out of `all`, from which a sample takes one. `all` is a power of two. The first
    /// samples use few moments, so that many samples of a tile share a moment.
    #[inline(always)]
    pub(crate) fn moments(&self, sample: u32, all: u32) -> u32 {
        self.chain.moments(sample, all)
    }

    /// Judges the pixel of a column and row after its samples of the pass. Between two numbers of the chain this has no
    /// effect.
    #[inline(always)]
    pub(crate) fn verdict(&self, pixel: &Pixel, (column, row): (usize, usize)) -> Verdict {
        self.chain.verdict(pixel, self.density.map_or(0, |density| density.at(column, row)))
    }
}

/// Numbers of samples, over all pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work {
    /// The samples of this pass.
    pub(crate) now: u64,
    /// The samples of this pass and of later ones, if all pixels that go on now take the largest number.
    pub(crate) ahead: u64,
}

/// The state of the pixels of some rows after their samples of the pass.
pub(crate) struct Judged<'a> {
    unsettled: BitRows<'a>,
    spreading: Vec<BitRows<'a>>,
    uneven: BitRows<'a>,
    /// Pixels that count as varying, until densities are computed.
    varying: Option<BitRows<'a>>,
}

impl Judged<'_> {
    /// Records the verdicts of a pixel and of its cover.
    #[inline(always)]
    pub(crate) fn set(&mut self, column: usize, row: usize, verdict: &Verdict, of_cover: Option<&Verdict>) {
        let any = |of: fn(&Verdict) -> bool| of(verdict) || of_cover.is_some_and(of);
        self.unsettled.set(column, row, any(|verdict| verdict.is_unsettled));
        let reach = of_cover.map_or(verdict.reach, |cover| verdict.reach.max(cover.reach));
        for (at, bits) in self.spreading.iter_mut().enumerate() {
            bits.set(column, row, at < reach);
        }
        self.uneven.set(column, row, any(|verdict| verdict.is_uneven));
        if let Some(varying) = &mut self.varying {
            varying.set(column, row, any(|verdict| verdict.is_varying));
        }
    }
}

#[derive(Debug)]
pub(super) struct Plan {
    chain: SampleSchedule,
    /// Pixels whose error is too large.
    unsettled: Bits,
    /// Pixels that vary so much that even neighbours may have missed a part of it: one set for each number of samples
    /// of those neighbours, from the second of the chain on.
    spreading: Vec<Bits>,
    /// Pixels whose samples differ.
    uneven: Bits,
    /// Pixels that count as varying. Empty once densities are computed.
    varying: Bits,
    /// Pixels with a least number of samples.
    pub(super) floors: Floors,
    /// The density around each pixel. It is computed once the pixels that differ from a neighbour have the second
    /// number of the chain.
    density: Option<Density>,
    /// Pixels that have at least the second number of the chain, the third, and so on.
    at_least: Vec<Bits>,
    /// Pixels that go on to the second number of the chain, the third, and so on, until all have reached it.
    going: Vec<Bits>,
    /// The number of passes done since the last decision.
    done: u32,
    /// The number of decisions so far.
    rounds: u32,
    /// Pixels that get samples in this pass.
    wanted: Bits,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Begins,
    /// Pixels go to the first number of the chain. It is the only one if no error is requested.
    First,
    Later,
}

impl Plan {
    /// Returns `None` if there is not enough memory.
    pub(super) fn new(size: (usize, usize), chain: SampleSchedule) -> Option<Self> {
        let none = || Bits::none(size);
        Some(Self {
            unsettled: none()?,
            spreading: (0..chain.reaches()).map(|_| none()).collect::<Option<_>>()?,
            uneven: none()?,
            varying: none()?,
            floors: Floors::default(),
            density: None,
            at_least: vec![],
            going: vec![],
            done: 0,
            rounds: 0,
            wanted: none()?,
            chain,
            stage: Stage::Begins,
        })
    }

    /// Sets a least number of samples for all pixels. Returns `None` if there is not enough memory.
    pub(super) fn raise(&mut self, count: u32) -> Option<()> {
        let mut all = self.wanted.empty()?;
        all.fill();
        self.floors.sets.push((count, all));
        Some(())
    }

    /// Takes the first samples at all moments, too.
    pub(super) fn take_all_moments(&mut self) {
        self.chain.has_few_moments = false;
    }

    /// Returns whether means are raised before they are displayed.
    pub(super) fn shows_raised(&self) -> bool {
        self.chain.tone() == Tone::Srgb && !self.chain.is_unclamped()
    }

    /// Returns whether a pixel has at least the second number of the chain.
    #[inline(always)]
    pub(super) fn has_many(&self, column: usize, row: usize) -> bool {
        self.at_least.first().is_some_and(|many| many.has(column, row))
    }

    /// Calls `each` with the columns of the pixels of a row that have at least the second number of the chain.
    #[inline(always)]
    pub(super) fn each_with_many(&self, row: usize, mut each: impl FnMut(usize)) {
        let words = self.at_least.first().map_or(&[][..], |many| many.row(row));
        for (word, &bits) in words.iter().enumerate() {
            let mut bits = bits;
            while bits != 0 {
                each(word * WORD + bits.trailing_zeros() as usize);
                bits &= bits - 1;
            }
        }
    }

    /// Returns the targets of the pass, and, in bands of `rows` rows, the states that it sets.
    pub(super) fn split(&mut self, rows: usize) -> (PassTargets<'_>, impl Iterator<Item = Judged<'_>>) {
        let is_first_look = self.stage == Stage::First && self.chain.has_error();
        let density = self.density.as_ref();
        let wanted = PassTargets { chain: &self.chain, density, pixels: &self.wanted, is_first_look };
        let mut varying = self.varying.bands(rows);
        let mut uneven = self.uneven.bands(rows);
        let mut spreading: Vec<_> = self.spreading.iter_mut().map(|bits| bits.bands(rows)).collect();
        let judged = move |unsettled| {
            let spreading = spreading.iter_mut().filter_map(Iterator::next).collect();
            Some(Judged { unsettled, spreading, uneven: uneven.next()?, varying: varying.next() })
        };
        (wanted, self.unsettled.bands(rows).map_while(judged))
    }

    /// Restricts a pass to some pixels.
    pub(super) fn want_only(&mut self, some: &Bits) {
        self.wanted.keep(some);
    }

    /// Returns the numbers of samples before and after this pass for pixels that go on from one number of the chain to
    /// the next, or `None` if they get none in it.
    fn part(&self, (from, to): (u32, u32)) -> Option<(u32, u32)> {
        let from = u64::from(from) + u64::from(self.done) * u64::from(self.chain.step);
        let from = u32::try_from(from).ok().filter(|from| *from < to)?;
        Some((from, from.saturating_add(self.chain.step).min(to)))
    }

    /// Continues with the next pass of the last decision. Returns `None` if all of its passes are done.
    pub(super) fn goes_on(&mut self) -> Option<(u32, u32)> {
        match self.stage {
            Stage::Begins => None,
            Stage::First => {
                self.done += 1;
                self.part((0, self.chain.number(0)))
            }
            Stage::Later => {
                self.done += 1;
                self.want()
            }
        }
    }

    /// Returns the work of this pass and of those after it.
    pub(super) fn work(&self) -> Work {
        let mut work = Work::default();
        let mut add = |pixels: &Bits, (from, to): (u32, u32)| {
            let count = pixels.count(0..pixels.rows());
            let (start, end) = self.part((from, to)).unwrap_or((to, to));
            work.now += count * u64::from(end - start);
            work.ahead += count * u64::from(self.chain.most() - start);
        };
        match self.stage {
            Stage::Begins => {}
            Stage::First => add(&self.wanted, (0, self.chain.number(0))),
            Stage::Later => {
                for (at, going) in self.going.iter().enumerate() {
                    add(going, (self.chain.number(at), self.chain.number(at + 1)));
                }
            }
        }
        work
    }

    /// Collects the pixels that get samples in this pass.
    fn want(&mut self) -> Option<(u32, u32)> {
        self.wanted.clear();
        let (mut first, mut end) = (u32::MAX, 0);
        for (at, going) in self.going.iter().enumerate().filter(|(_, going)| !going.is_empty()) {
            if let Some((from, to)) = self.part((self.chain.number(at), self.chain.number(at + 1))) {
                self.wanted.add(going);
                first = first.min(from);
                end = end.max(to);
            }
        }
        (end > 0).then_some((first, end))
    }

    /// Decides how to continue once all passes of the last decision are done. Returns `None` once no pixel needs more.
    /// `cover` has the first samples of the cover, if there is one.
    pub(super) fn next(&mut self, first: Option<&First>, cover: Option<&First>) -> Option<(u32, u32)> {
        self.done = 0;
        if self.stage == Stage::Begins {
            self.stage = Stage::First;
            self.wanted.fill();
            return self.part((0, self.chain.number(0)));
        }
        let first = first?;
        if self.stage == Stage::First {
            self.judge_first(first);
            if let Some(cover) = cover {
                self.judge_first(cover);
            }
        } else {
            self.count()?;
            if self.density.is_none() {
                let varying = core::mem::replace(&mut self.varying, Bits::none((1, 0))?);
                self.density = Some(Density::of(varying, &self.floors)?);
            }
        }
        self.stage = Stage::Later;
        if self.rounds == MAX_ROUNDS {
            return None;
        }
        self.rounds += 1;
        self.plan()?;
        self.want()
    }

    /// Marks pixels whose first sample differs from that of a neighbour, in addition to those marked before.
    fn judge_first(&mut self, first: &First) {
        let tone = self.chain.tone();
        let limit = (CONTRAST * self.chain.error() / 255.0 * ONE).min(ONE) as u16;
        let (width, height, stride) = (self.unsettled.columns, self.unsettled.rows(), self.unsettled.stride);
        self.unsettled.words.par_chunks_mut(stride * BAND).enumerate().for_each(|(band, words)| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            first.contrasts(width, rows, (limit, tone), words);
        });
    }

    /// Records that the pixels that went on have reached their numbers.
    fn count(&mut self) -> Option<()> {
        for (at, going) in self.going.iter().enumerate().filter(|(_, going)| !going.is_empty()) {
            if at == self.at_least.len() {
                self.at_least.push(going.empty()?);
            }
            self.at_least[at].add(going);
        }
        Some(())
    }

    /// Decides which pixels go on. Returns `None` if there is not enough memory.
    fn plan(&mut self) -> Option<()> {
        for at in 0..=self.at_least.len() {
            if at == self.going.len() {
                self.going.push(self.wanted.empty()?);
            }
            let number = self.chain.number(at);
            let ends = number == self.chain.most();
            let always: Vec<&Bits> =
                self.floors.above(number).chain(self.density.iter().flat_map(|d| d.above(number))).collect();
            let (unsettled, uneven) = (&self.unsettled, &self.uneven);
            let reach = if self.chain.is_unclamped() { 0 } else { at.saturating_sub(1) };
            let spreading = self.spreading.get(reach);
            let at_least = &self.at_least;
            let is_unclamped = self.chain.is_unclamped();
            let dense = self.density.as_ref().map(Density::dense);
            let have = at.checked_sub(1).map(|before| &at_least[before]);
            let further = at_least.get(at);
            let (soon, ahead) = (at_least.get(at + 1), at_least.get(at + AHEAD));
            let stride = unsettled.stride;
            self.going[at].words.par_chunks_mut(stride * BAND).enumerate().for_each(|(band, words)| {
                words.fill(0);
                if ends {
                    return;
                }
                // The unsettled pixels, and those that make any neighbour go on, in three rows.
                let mut open = [(); 3].map(|()| vec![0; stride]);
                let mut active = open.clone();
                let of =
                    |bits: Option<&Bits>, row: usize, word: usize| bits.map_or(0, |bits| bits.row(row)[word]);
                let look = |open: &mut [u64], active: &mut [u64], row: Option<usize>| {
                    let Some(row) = row.filter(|&row| row < unsettled.rows()) else {
                        open.fill(0);
                        return active.fill(0);
                    };
                    for (word, (open, active)) in open.iter_mut().zip(active).enumerate() {
                        let has = have.map_or(u64::MAX, |have| have.row(row)[word]);
                        *open = unsettled.row(row)[word] & has;
                        let dense = of(dense, row, word);
                        let soon = of(soon, row, word);
                        let close = if is_unclamped { soon } else { (*open | soon) & dense };
                        *active = of(spreading, row, word) & has | close | of(ahead, row, word);
                    }
                };
                let top = band * BAND;
                look(&mut open[1], &mut active[1], top.checked_sub(1));
                look(&mut open[2], &mut active[2], Some(top));
                for (row, words) in (top..).zip(words.chunks_exact_mut(stride)) {
                    open.rotate_left(1);
                    active.rotate_left(1);
                    look(&mut open[2], &mut active[2], Some(row + 1));
                    let is_any = |bits: &[u64]| bits.iter().any(|&word| word != 0);
                    if !open.iter().chain(&active).any(|bits| is_any(bits))
                        && !always.iter().any(|bits| is_any(bits.row(row)))
                    {
                        continue;
                    }
                    for (word, going) in words.iter_mut().enumerate() {
                        let have = have.map_or(unsettled.inside(word), |have| have.row(row)[word]);
                        let may = have & !of(further, row, word);
                        if may == 0 {
                            continue;
                        }
                        let around =
                            |rows: &[Vec<u64>; 3]| rows.iter().fold(0, |all, row| all | widened(row, word));
                        let differ = uneven.row(row)[word];
                        let always = always.iter().fold(0, |all, bits| all | bits.row(row)[word]);
                        let own = open[1][word] | always | between(open.each_ref(), word);
                        *going = (own | around(&active) | around(&open) & differ) & may;
                    }
                }
            });
        }
        Some(())
    }
}
