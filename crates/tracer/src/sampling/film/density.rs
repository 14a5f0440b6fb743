//! How much of what is around a pixel varies.
//!
//! The error that is asked for is that of the whole image. Where few pixels vary, on edges, each of them may have several times
//! that error; where all do, on a patterned floor, none may. And where many of a pixel's neighbours vary, a pixel whose
//! first samples are alike has been lucky rather than even.

use super::bits::{Bits, WORD};
use super::chain::SPARED;
use super::floors::Floors;

/// Columns that are looked at together: a quarter of a word of bits.
pub(super) const COLUMNS: usize = 16;

/// So many of them in a word, and the bits of one.
const PARTS: usize = WORD / COLUMNS;
const ALL: u64 = (1 << COLUMNS) - 1;

/// Rows above and below a pixel that count as around it.
pub(super) const ROWS: usize = 8;

/// From which share of the pixels on it is dense, and densest: so many of so many.
const SHARES: [(u32, u32); STEPS] = [(1, 3), (2, 3)];

/// The samples that a pixel gets at least where it is so dense.
const FLOORS: [u32; STEPS] = [4, 8];

const STEPS: usize = SPARED.len() - 1;

/// Where it is dense, and where densest: the pixels of each set are in those before it.
#[derive(Debug)]
pub(super) struct Density {
    sets: [Bits; STEPS],
}

impl Density {
    /// From the pixels that vary, and sets of those that may; `None` where there is no memory for it.
    pub(super) fn of(mut varying: Bits, floors: &Floors) -> Option<Self> {
        floors.above(0).for_each(|bits| varying.add(bits));
        let mut sets = [varying.empty()?, varying.empty()?];
        let (rows, stride) = (varying.rows(), varying.stride);
        let mut counts = vec![0u32; PARTS * stride];
        let parts_of = |row: usize| {
            varying.row(row).iter().flat_map(|&word| (0..PARTS).map(move |k| word >> (k * COLUMNS) & ALL))
        };
        for row in 0..rows + ROWS {
            if row < rows {
                counts.iter_mut().zip(parts_of(row)).for_each(|(count, part)| *count += part.count_ones());
            }
            if let Some(past) = row.checked_sub(2 * ROWS + 1) {
                counts.iter_mut().zip(parts_of(past)).for_each(|(count, part)| *count -= part.count_ones());
            }
            let Some(middle) = row.checked_sub(ROWS) else { continue };
            let height = (row.min(rows - 1) + 1 - (row + 1).saturating_sub(2 * ROWS + 1)) as u32;
            for (place, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
                let inside = varying.columns.saturating_sub(place * COLUMNS).min(COLUMNS) as u32;
                for (set, (part, whole)) in sets.iter_mut().zip(SHARES) {
                    if count * whole >= part * inside * height {
                        let bits = (u64::MAX >> (u64::BITS - inside)) << (place % PARTS * COLUMNS);
                        set.words[middle * stride + place / PARTS] |= bits;
                    }
                }
            }
        }
        Some(Self { sets })
    }

    /// From 0, where little varies around a pixel, to [`STEPS`].
    #[inline(always)]
    pub(super) fn at(&self, column: usize, row: usize) -> usize {
        self.sets.iter().filter(|set| set.has(column, row)).count()
    }

    /// The pixels around which much varies.
    pub(super) fn dense(&self) -> &Bits {
        &self.sets[0]
    }

    /// The sets whose pixels go on from so many samples.
    pub(super) fn above(&self, count: u32) -> impl Iterator<Item = &Bits> {
        self.sets.iter().zip(FLOORS).filter(move |(_, floor)| *floor > count).map(|(bits, _)| bits)
    }
}
