//! Which pixels get how many samples in the next pass.
//!
//! The numbers of samples that a pixel can have are a chain. A pixel goes on to the next of them if its error is estimated to
//! be too large, if that of a neighbour with at least as many samples is, or if a neighbour is two or more ahead on the chain.
//! Slivers thinner than a pixel, of which some pixels see nothing at first, are found along their length in this way, and the
//! bias of asking a pixel about itself shrinks to that of asking many.

use rayfold_scene::{Samples, Tone};
use rayon::prelude::*;

use super::bits::{Bits, columns, widened};
use super::first::First;
use super::pixel::{ONE, Sums};

/// Samples a pixel that are looked at before any decision, and where variances begin to say something.
const FIRST: u32 = 1;
const SECOND: u32 = 4;

/// So many times the error that is asked for, two neighbours with a sample each may differ by.
pub(super) const CONTRAST: f64 = 1.5;

/// The error of a mean of n samples is taken for their deviation times n to this power: steeper than the -1/2 of independent
/// samples, and less steep than what edges and penumbrae have (docs/reports/sampling.md).
pub(super) const SLOPE: f64 = -0.65;

/// So many times the error that is asked for a pixel may have: most others have less.
pub(super) const SPARED: f64 = 3.0;

/// Moments of the first samples.
const FEW_MOMENTS: u32 = 16;

/// How often it is decided who goes on, at most, so that no pixel depends on one that is farther away, and a band can be drawn
/// by itself. The example scenes take up to 34 of them (docs/decisions/frames-in-bands.md).
pub(super) const MOST_ROUNDS: u32 = 128;

/// Rows that are looked at together.
const BAND: usize = 16;

/// What a pass gives to whom.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    plan: &'a Plan,
    /// Who gets something.
    pub(crate) pixels: &'a Bits,
    /// Whether it is the first sample of pixels that may get no other.
    pub(crate) is_first_look: bool,
}

impl Wanted<'_> {
    /// How many samples a pixel that has so many, and gets something in this pass, shall have after it.
    #[inline(always)]
    pub(crate) fn goal(&self, count: u32) -> u32 {
        self.plan.goal(count)
    }

    /// How many of so many moments, a power of two, a sample is one of: the first samples are of few, so that those of a tile
    /// that are of one moment are many.
    #[inline(always)]
    pub(crate) fn moments(&self, sample: u32, all: u32) -> u32 {
        self.plan.moments(sample, all)
    }
}

#[derive(Debug)]
pub(super) struct Plan {
    samples: Samples,
    /// No pass adds more samples to a pixel.
    step: u32,
    /// Whose error is too large.
    unsettled: Bits,
    /// Those that have at least the second number of the chain, the third, and so on.
    at_least: Vec<Bits>,
    /// Those that go on to the second number of the chain, the third, and so on, until all have come there.
    going: Vec<Bits>,
    /// Passes of this going on that are done.
    done: u32,
    /// How often it was decided who goes on.
    rounds: u32,
    /// Those that get something in this pass.
    wanted: Bits,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Begins,
    /// To the first number of the chain, which is that of all pixels if there is no error to be reached.
    First,
    Later,
}

impl Plan {
    /// `None` where there is no memory for it.
    pub(super) fn new(size: (usize, usize), samples: Samples, step: u32) -> Option<Self> {
        let none = || Bits::none(size);
        Some(Self {
            samples,
            step,
            unsettled: none()?,
            at_least: vec![],
            going: vec![],
            done: 0,
            rounds: 0,
            wanted: none()?,
            stage: Stage::Begins,
        })
    }

    /// Of the chain.
    fn number(&self, at: usize) -> u32 {
        let most = self.samples.most();
        match at {
            _ if self.samples.error() == 0.0 => most,
            0 => FIRST,
            _ => u32::try_from(u64::from(SECOND) << (at - 1).min(32)).unwrap_or(u32::MAX).min(most),
        }
    }

    /// Where a pixel that has so many samples, and gets something in this pass, stands after it.
    #[inline(always)]
    pub(super) fn goal(&self, count: u32) -> u32 {
        let most = self.samples.most();
        let next = if self.samples.error() == 0.0 {
            most
        } else if count < SECOND {
            if count < FIRST { FIRST } else { SECOND }
        } else {
            count.checked_add(1).and_then(u32::checked_next_power_of_two).unwrap_or(most)
        };
        next.min(most).min(count.saturating_add(self.step))
    }

    /// How many of so many moments a sample is one of.
    #[inline(always)]
    pub(super) fn moments(&self, sample: u32, all: u32) -> u32 {
        if self.samples.error() == 0.0 {
            all
        } else {
            sample.saturating_add(1).checked_next_power_of_two().unwrap_or(all).max(FEW_MOMENTS).min(all)
        }
    }

    /// Whether a pixel has the second number of the chain.
    #[inline(always)]
    pub(super) fn has_many(&self, column: usize, row: usize) -> bool {
        self.at_least.first().is_some_and(|many| many.has(column, row))
    }

    /// Before each pass and after the last.
    pub(super) fn wanted(&self) -> Wanted<'_> {
        let is_first_look = self.stage == Stage::First && self.samples.error() > 0.0;
        Wanted { plan: self, pixels: &self.wanted, is_first_look }
    }

    /// The numbers of samples from and to which pixels of a place of the chain go in this pass, if they do.
    fn part(&self, (from, to): (u32, u32)) -> Option<(u32, u32)> {
        let from = u64::from(from) + u64::from(self.done) * u64::from(self.step);
        let from = u32::try_from(from).ok().filter(|from| *from < to)?;
        Some((from, from.saturating_add(self.step).min(to)))
    }

    /// Goes on to the next pass of what was planned; `None` if all have what was planned for them.
    pub(super) fn goes_on(&mut self) -> Option<(u32, u32)> {
        match self.stage {
            Stage::Begins => None,
            Stage::First => {
                self.done += 1;
                self.part((0, self.number(0)))
            }
            Stage::Later => {
                self.done += 1;
                self.want()
            }
        }
    }

    /// Gathers those that get something in this pass.
    fn want(&mut self) -> Option<(u32, u32)> {
        self.wanted.clear();
        let (mut first, mut end) = (u32::MAX, 0);
        for (at, going) in self.going.iter().enumerate().filter(|(_, going)| !going.is_empty()) {
            if let Some((from, to)) = self.part((self.number(at), self.number(at + 1))) {
                self.wanted.add(going);
                first = first.min(from);
                end = end.max(to);
            }
        }
        (end > 0).then_some((first, end))
    }

    /// Plans what comes after all have what was planned for them; `None` once they need no more.
    pub(super) fn next(&mut self, first: Option<&First>, sums: &Sums, tone: Tone) -> Option<(u32, u32)> {
        self.done = 0;
        if self.stage == Stage::Begins {
            self.stage = Stage::First;
            self.wanted.fill();
            return self.part((0, self.number(0)));
        }
        let first = first?;
        if self.stage == Stage::First {
            self.judge_first(first, tone);
        } else {
            self.judge(sums, tone)?;
        }
        self.stage = Stage::Later;
        if self.rounds == MOST_ROUNDS {
            return None;
        }
        self.rounds += 1;
        self.plan()?;
        self.want()
    }

    /// Finds out who differs from a neighbour.
    fn judge_first(&mut self, first: &First, tone: Tone) {
        let limit = (CONTRAST * self.samples.error() / 255.0 * ONE).min(ONE) as u16;
        let (width, height, stride) = (self.unsettled.columns, self.unsettled.rows(), self.unsettled.stride);
        self.unsettled.words.par_chunks_mut(stride * BAND).enumerate().for_each(|(band, words)| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            first.contrasts(width, rows, (limit, tone), words);
        });
    }

    /// Finds out whose errors are too large, of those that have gone on, and counts those as gone on.
    fn judge(&mut self, sums: &Sums, tone: Tone) -> Option<()> {
        for (at, going) in self.going.iter().enumerate().filter(|(_, going)| !going.is_empty()) {
            if at == self.at_least.len() {
                self.at_least.push(going.empty()?);
            }
            self.at_least[at].add(going);
        }
        let most = self.samples.most();
        // How much the samples may vary.
        let limit = |count: u32| {
            let limit = SPARED * self.samples.error() * libm::pow(f64::from(count), -SLOPE);
            limit * limit
        };
        let limits: Vec<f64> = (0..=self.going.len()).map(|at| limit(self.number(at))).collect();
        let (going, stride) = (&self.going, self.unsettled.stride);
        self.unsettled.words.par_chunks_mut(stride).enumerate().for_each(|(row, words)| {
            for (at, going) in going.iter().enumerate() {
                for (word, (unsettled, &gone)) in words.iter_mut().zip(going.row(row)).enumerate() {
                    *unsettled &= !gone;
                    for column in columns(word, gone) {
                        let pixel = sums.pixel(column, row);
                        let is_unsettled = pixel.count() < most && pixel.variance(tone) > limits[at + 1];
                        *unsettled |= u64::from(is_unsettled) << (column % u64::BITS as usize);
                    }
                }
            }
        });
        Some(())
    }

    /// Finds out who goes on; `None` where there is no memory for it.
    fn plan(&mut self) -> Option<()> {
        for at in 0..=self.at_least.len() {
            if at == self.going.len() {
                self.going.push(self.wanted.empty()?);
            }
            let ends = self.number(at) == self.samples.most();
            let (unsettled, at_least) = (&self.unsettled, &self.at_least);
            let have = at.checked_sub(1).map(|before| &at_least[before]);
            let (further, ahead) = (at_least.get(at), at_least.get(at + 1));
            let stride = unsettled.stride;
            self.going[at].words.par_chunks_mut(stride * BAND).enumerate().for_each(|(band, words)| {
                if ends {
                    words.fill(0);
                    return;
                }
                let mut near = vec![0; stride];
                for (row, words) in (band * BAND..).zip(words.chunks_exact_mut(stride)) {
                    near.fill(0);
                    // Whoever may make others go on.
                    for other in row.saturating_sub(1)..(row + 2).min(unsettled.rows()) {
                        for (word, near) in near.iter_mut().enumerate() {
                            let have = have.map_or(u64::MAX, |have| have.row(other)[word]);
                            let ahead = ahead.map_or(0, |ahead| ahead.row(other)[word]);
                            *near |= unsettled.row(other)[word] & have | ahead;
                        }
                    }
                    for (word, going) in words.iter_mut().enumerate() {
                        let have = have.map_or(unsettled.inside(word), |have| have.row(row)[word]);
                        let further = further.map_or(0, |further| further.row(row)[word]);
                        *going = widened(&near, word) & have & !further;
                    }
                }
            });
        }
        Some(())
    }
}
