//! Pixels with a least number of samples that does not depend on their first samples.

use super::bits::{Bits, WORD};
use super::first::First;
use crate::parallel::CHANNELS;

/// The largest difference, a sixteenth of a level, between channels of first samples that count as equal.
const SAME: u16 = 16;

/// Sets of pixels, each with the least number of samples of its pixels.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Floors {
    pub(super) sets: Vec<(u32, Bits)>,
}

/// A difference between two pictures at a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Difference {
    /// The object of this number is seen in one picture only.
    Object(u16),
    /// The same object is seen in another colour.
    Color,
}

impl Floors {
    /// Makes empty sets for pictures of this size. Returns `None` if there is not enough memory.
    pub(crate) fn new(size: (u32, u32), floors: &[u32]) -> Option<Self> {
        let size = (size.0 as usize, size.1 as usize);
        let sets = floors.iter().map(|&floor| Some((floor, Bits::none(size)?)));
        Some(Self { sets: sets.collect::<Option<_>>()? })
    }

    /// Adds the pixels in which two pictures differ, or only those among `some`, to the sets that `choose` selects.
    pub(crate) fn add(
        &mut self,
        (a, b): (&First, &First),
        some: Option<&Bits>,
        choose: impl Fn(Difference) -> Option<usize>,
    ) {
        let Some((stride, columns)) = self.sets.first().map(|(_, bits)| (bits.stride, bits.columns)) else {
            return;
        };
        for at in 0..self.sets[0].1.words.len() {
            let (row, word) = (at / stride, at % stride);
            let mut bits = some.map_or(self.sets[0].1.inside(word), |some| some.words[at]);
            while bits != 0 {
                let column = word * WORD + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let place = row * columns + column;
                let difference = if a.objects[place] != b.objects[place] {
                    Difference::Object(b.objects[place])
                } else if (0..CHANNELS).any(|k| a.colors[k][place].abs_diff(b.colors[k][place]) > SAME) {
                    Difference::Color
                } else {
                    continue;
                };
                if let Some(set) = choose(difference) {
                    self.sets[set].1.put(column, row);
                }
            }
        }
    }

    /// Adds the sets of others.
    pub(super) fn add_all(&mut self, others: Self) {
        self.sets.extend(others.sets);
    }

    /// Returns the sets whose pixels need more than `count` samples.
    pub(super) fn above(&self, count: u32) -> impl Iterator<Item = &Bits> {
        self.sets.iter().filter(move |(floor, _)| *floor > count).map(|(_, bits)| bits)
    }
}
