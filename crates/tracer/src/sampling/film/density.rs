//! The density around a pixel: the share of the pixels there that vary.
//!
//! The requested error is that of the whole image. If few pixels vary, as at edges, each of them may have several times
//! that error. If all vary, as on a patterned floor, none may. If many of a pixel's neighbours vary but its own first
//! samples are alike, this is more likely chance than evenness.

use super::bits::{Bits, WORD};
use super::chain::SPARED;
use super::floors::Floors;

/// The number of columns that are counted together: a quarter of a word of bits.
pub(super) const COLUMNS: usize = 16;

/// The number of these parts in a word, and the bits of one part.
const PARTS: usize = WORD / COLUMNS;
const ALL: u64 = (1 << COLUMNS) - 1;

/// The number of rows above and below a pixel that count as around it.
pub(super) const ROWS: usize = 8;

/// The shares of varying pixels from which on a place is dense and very dense, as fractions.
const SHARES: [(u32, u32); STEPS] = [(1, 3), (2, 3)];

/// The least number of samples of a pixel in each of these places.
const FLOORS: [u32; STEPS] = [4, 8];

const STEPS: usize = SPARED.len() - 1;

/// The dense pixels, and the very dense ones. Each set contains the next.
#[derive(Debug)]
pub(super) struct Density {
    sets: [Bits; STEPS],
}

impl Density {
    /// Computes the sets from the pixels that vary, and from sets of those that may. Returns `None` if there is not
    /// enough memory.
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

    /// Returns the density at a pixel: from 0, if little varies around it, to [`STEPS`].
    #[inline(always)]
    pub(super) fn at(&self, column: usize, row: usize) -> usize {
        self.sets.iter().filter(|set| set.has(column, row)).count()
    }

    /// Returns the pixels around which much varies.
    pub(super) fn dense(&self) -> &Bits {
        &self.sets[0]
    }

    /// Returns the sets whose pixels need more than `count` samples.
    pub(super) fn above(&self, count: u32) -> impl Iterator<Item = &Bits> {
        self.sets.iter().zip(FLOORS).filter(move |(_, floor)| *floor > count).map(|(bits, _)| bits)
    }
}
