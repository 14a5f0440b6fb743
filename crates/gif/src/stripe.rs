//! A frame's indices, chosen as LZW will read them.
//!
//! LZW writes a string of indices that it has met before as one code. So where the best index would end such a string
//! and another one, nearly as good, would not, the other is taken. Frames are worked on in stripes of rows side by side,
//! each with a book of its own.

use crate::allowance::Redrawn;
use crate::colour;
use crate::histogram::Histogram;
use crate::ink::Ink;
use crate::lzw::Book;
use crate::palette::Palette;

/// How much more squared error (see [`colour`]) an index may have that makes the file smaller. The error of a good
/// palette is about as large.
const LENIENCE: f32 = 4.0;
/// A still pixel is drawn anew when that leaves at most this part of its squared error.
const WORTHWHILE: f32 = 0.5;
/// How many of a colour's nearest others are tried.
const TRIED: usize = 8;

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

/// What a frame is drawn with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inks<'a> {
    pub(crate) palette: &'a Palette,
    pub(crate) of_bins: &'a [Ink],
    pub(crate) histogram: &'a Histogram,
    /// The index that leaves a pixel as it is.
    pub(crate) clear: Option<u8>,
}

/// Chooses indices row by row.
#[derive(Debug)]
pub(crate) struct Stripe<'a> {
    inks: Inks<'a>,
    book: Book,
    string: Option<u16>,
    redrawn: Redrawn,
}

/// Part of a row: what is meant, what it needs, and what comes of it.
pub(crate) struct Row<'a> {
    pub(crate) left: usize,
    pub(crate) y: usize,
    pub(crate) pixels: &'a [[u8; 3]],
    pub(crate) needs: &'a [Need],
    pub(crate) indices: &'a mut [u8],
    pub(crate) seen: &'a mut [[u8; 3]],
}

impl<'a> Stripe<'a> {
    pub(crate) fn new(inks: Inks<'a>) -> Self {
        Self { inks, book: Book::new(8), string: None, redrawn: Redrawn::default() }
    }

    /// What all rows together drew anew.
    pub(crate) fn redrawn(self) -> Redrawn {
        self.redrawn
    }

    pub(crate) fn draw(&mut self, row: Row<'_>) {
        let mut previous = None;
        for (x, (&now, &need)) in row.pixels.iter().zip(row.needs).enumerate() {
            let index = match need {
                Need::Nothing => self.inks.clear.unwrap_or(0),
                Need::Free => self.free(now, row.seen[x], previous),
                Need::Better | Need::Draw => self.drawn(now, need, row.seen[x], row.left + x, row.y),
            };
            self.follow(index);
            previous = Some(index);
            row.indices[x] = index;
            if Some(index) != self.inks.clear {
                let colour = self.inks.palette.colours[usize::from(index)];
                if need == Need::Better {
                    self.redrawn.count(row.seen[x], colour);
                }
                row.seen[x] = colour;
            }
        }
    }

    /// The index before, if that is at least as good as nothing and nothing would end the string.
    fn free(&self, now: [u8; 3], seen: [u8; 3], previous: Option<u8>) -> u8 {
        let clear = self.inks.clear.unwrap_or(0);
        match previous.filter(|&index| index != clear) {
            Some(index)
                if self.continues(index)
                    && !self.continues(clear)
                    && self.error(now, index) <= colour::near_error(now, seen) =>
            {
                index
            }
            _ => clear,
        }
    }

    fn drawn(&self, now: [u8; 3], need: Need, seen: [u8; 3], x: usize, y: usize) -> u8 {
        let ink = &self.inks.of_bins[self.inks.histogram.find(now).unwrap_or(0)];
        let best = ink.at(x, y);
        let least = self.error(now, best);
        if let Some(clear) = self.inks.clear {
            let part = if need == Need::Better { WORTHWHILE } else { 1.0 };
            if least >= colour::near_error(now, seen) * part {
                return clear;
            }
        }
        if self.continues(best) {
            return best;
        }
        let near = self.inks.palette.neighbours(ink.plain).iter().take(TRIED).map(|n| n.index);
        let mut found = (best, least + LENIENCE);
        for other in std::iter::once(ink.plain).chain(near) {
            if self.continues(other) {
                let error = self.error(now, other);
                if error < found.1 {
                    found = (other, error);
                }
            }
        }
        found.0
    }

    fn error(&self, now: [u8; 3], index: u8) -> f32 {
        colour::near_error(now, self.inks.palette.colours[usize::from(index)])
    }

    /// Whether LZW knows the string it is in with this index after it.
    fn continues(&self, index: u8) -> bool {
        self.string.is_none_or(|string| self.book.get(string, index).is_some())
    }

    fn follow(&mut self, index: u8) {
        let longer = self.string.and_then(|string| {
            let longer = self.book.get(string, index);
            if longer.is_none() {
                self.book.insert(string, index);
                if self.book.is_full() {
                    self.book.clear();
                }
            }
            longer
        });
        self.string = Some(longer.unwrap_or_else(|| u16::from(index)));
    }
}
