//! A bit for each pixel of an image, row by row in words of 64.

use core::ops::Range;

/// Pixels in a word.
pub(super) const WORD: usize = 64;

/// Returns zeros, which take no memory before they are written to, or `None` if there is not enough memory.
pub(super) fn zeroed<T: Clone + Default>(count: usize) -> Option<Vec<T>> {
    Vec::<T>::new().try_reserve_exact(count).ok()?;
    Some(vec![T::default(); count])
}

/// A set of pixels; bits beyond a row's last column are never set.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bits {
    pub(super) words: Vec<u64>,
    /// The number of words per row.
    pub(super) stride: usize,
    pub(super) columns: usize,
}

impl Bits {
    /// Returns an empty set for an image of this size, or `None` if there is not enough memory.
    pub(super) fn none((columns, rows): (usize, usize)) -> Option<Self> {
        let stride = columns.div_ceil(WORD);
        let words = zeroed(stride.checked_mul(rows)?)?;
        Some(Self { words, stride, columns })
    }

    /// Returns an empty set for an image of the same size.
    pub(super) fn empty(&self) -> Option<Self> {
        Some(Self { words: zeroed(self.words.len())?, ..*self })
    }

    pub(crate) fn rows(&self) -> usize {
        self.words.len() / self.stride
    }

    /// Returns the pixels of a word of a row that lie in the image.
    #[inline(always)]
    pub(super) fn inside(&self, word: usize) -> u64 {
        u64::MAX >> (WORD - (self.columns - word * WORD).min(WORD))
    }

    pub(super) fn fill(&mut self) {
        for word in 0..self.stride {
            let inside = self.inside(word);
            self.words.iter_mut().skip(word).step_by(self.stride).for_each(|word| *word = inside);
        }
    }

    pub(super) fn clear(&mut self) {
        self.words.fill(0);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.words.iter().all(|&word| word == 0)
    }

    /// Returns the number of the set's pixels in some rows.
    pub(crate) fn count(&self, rows: Range<usize>) -> u64 {
        let words = &self.words[rows.start * self.stride..rows.end * self.stride];
        words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    pub(super) fn add(&mut self, other: &Self) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word |= other;
        }
    }

    /// Adds a pixel.
    pub(super) fn put(&mut self, column: usize, row: usize) {
        self.words[row * self.stride + column / WORD] |= 1 << (column % WORD);
    }

    /// Removes all pixels that are not in `others`.
    pub(super) fn keep(&mut self, others: &Self) {
        self.words.iter_mut().zip(&others.words).for_each(|(word, others)| *word &= others);
    }

    /// Adds all neighbours of the pixels in the set.
    pub(super) fn widen(&mut self) {
        let rows = self.rows();
        let mut wide = self.clone();
        for (row, words) in wide.words.chunks_exact_mut(self.stride).enumerate() {
            for (word, into) in words.iter_mut().enumerate() {
                let near =
                    (row.saturating_sub(1)..(row + 2).min(rows)).map(|row| widened(self.row(row), word));
                *into = near.fold(0, |all, bits| all | bits) & self.inside(word);
            }
        }
        *self = wide;
    }

    /// Returns whether the set has all of some columns of a row.
    #[inline(always)]
    pub(crate) fn has_all(&self, columns: Range<usize>, row: usize) -> bool {
        columns.clone().step_by(32).all(|column| {
            let count = (columns.end - column).min(32);
            self.run(column, row) | (u32::MAX << (count - 1) << 1) == u32::MAX
        })
    }

    /// Returns the set in bands of `rows` rows.
    pub(super) fn bands(&mut self, rows: usize) -> impl Iterator<Item = BitRows<'_>> {
        let stride = self.stride;
        self.words.chunks_mut(rows * stride).map(move |words| BitRows { words, stride })
    }

    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> &[u64] {
        &self.words[row * self.stride..(row + 1) * self.stride]
    }

    /// Returns whether the set has the pixel of a column and a row.
    #[inline(always)]
    pub(crate) fn has(&self, column: usize, row: usize) -> bool {
        self.words[row * self.stride + column / WORD] >> (column % WORD) & 1 != 0
    }

    /// Returns, as bits, which of up to 32 pixels of a row are in the set, from `column` on.
    #[inline(always)]
    pub(crate) fn run(&self, column: usize, row: usize) -> u32 {
        let (word, shift) = (column / WORD, column % WORD);
        let row = self.row(row);
        let after = row.get(word + 1).map_or(0, |after| after << 1 << (WORD - 1 - shift));
        (row[word] >> shift | after) as u32
    }

    /// Returns whether the set has any pixel of a rectangle.
    #[inline(always)]
    pub(crate) fn has_any(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        let (first, last) = (columns.start / WORD, (columns.end - 1) / WORD);
        rows.clone().any(|row| {
            let row = self.row(row);
            (first..=last).any(|word| {
                let mut bits = row[word];
                if word == first {
                    bits &= u64::MAX << (columns.start % WORD);
                }
                if word == last {
                    bits &= u64::MAX >> (WORD - 1 - (columns.end - 1) % WORD);
                }
                bits != 0
            })
        })
    }
}

/// Some rows of a set of pixels.
#[derive(Debug)]
pub(crate) struct BitRows<'a> {
    words: &'a mut [u64],
    stride: usize,
}

impl BitRows<'_> {
    /// Adds or removes a pixel.
    #[inline(always)]
    pub(crate) fn set(&mut self, column: usize, row: usize, is_in: bool) {
        let (word, bit) = (&mut self.words[row * self.stride + column / WORD], column % WORD);
        *word = *word & !(1 << bit) | u64::from(is_in) << bit;
    }
}

/// Returns the bits of a row and their neighbours to the left and right.
#[inline(always)]
pub(super) fn widened(row: &[u64], word: usize) -> u64 {
    let at = row[word];
    let before = if word > 0 { row[word - 1] >> (WORD - 1) } else { 0 };
    let after = row.get(word + 1).map_or(0, |after| after << (WORD - 1));
    at | at << 1 | at >> 1 | before | after
}

/// Returns the bits that have two set neighbours on opposite sides, in three rows.
#[inline(always)]
pub(super) fn between([above, at, below]: [&Vec<u64>; 3], word: usize) -> u64 {
    let left = |row: &[u64]| row[word] << 1 | if word > 0 { row[word - 1] >> (WORD - 1) } else { 0 };
    let right = |row: &[u64]| row[word] >> 1 | row.get(word + 1).map_or(0, |after| after << (WORD - 1));
    left(at) & right(at) | above[word] & below[word] | left(above) & right(below) | right(above) & left(below)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the columns of the bits of a word of a row.
    fn columns(word: usize, mut bits: u64) -> impl Iterator<Item = usize> {
        core::iter::from_fn(move || {
            let column = word * WORD + bits.trailing_zeros() as usize;
            let more = bits != 0;
            bits &= bits.wrapping_sub(1);
            more.then_some(column)
        })
    }

    #[test]
    fn pixels_are_found_where_they_were_put_and_beside_it() {
        for columns_in_all in [1, 63, 64, 65, 150] {
            let mut all = Bits::none((columns_in_all, 3)).unwrap();
            all.fill();
            let mut dice = fastrand::Rng::with_seed(columns_in_all as u64);
            for _ in 0..200 {
                let mut bits = Bits::none((columns_in_all, 3)).unwrap();
                let (column, row) = (dice.usize(..columns_in_all), dice.usize(..3));
                bits.words[row * bits.stride + column / WORD] |= 1 << (column % WORD);
                let left = dice.usize(..columns_in_all);
                let right = dice.usize(left + 1..=columns_in_all);
                let within = (left..right).contains(&column);
                assert_eq!(bits.has_any(left..right, 0..3), within, "{column} in {left}..{right}");
                assert!(!bits.has_any(left..right, row + 1..3) && all.has_any(left..right, 1..2));
                let near: Vec<usize> = (0..bits.stride)
                    .flat_map(|word| columns(word, widened(bits.row(row), word) & bits.inside(word)))
                    .collect();
                let expected: Vec<usize> =
                    (column.saturating_sub(1)..(column + 2).min(columns_in_all)).collect();
                assert_eq!(near, expected);
                let mut wide = bits.clone();
                wide.widen();
                let in_rows = (row.saturating_sub(1)..(row + 2).min(3)).len();
                assert_eq!(wide.count(0..3) as usize, expected.len() * in_rows);
                let (from, to) = (expected[0], expected[expected.len() - 1] + 1);
                assert!(wide.has_all(from..to, row) && all.has_all(left..right, row));
                assert!(bits.has_all(from..to, row) == (from + 1 == to));
                wide.keep(&bits);
                assert_eq!(wide, bits);
                assert!(
                    (0..columns_in_all).all(|at| bits.has(at, row) == (at == column) && all.has(at, row))
                );
            }
            let set: u32 = all.words.iter().map(|word| word.count_ones()).sum();
            assert_eq!(set as usize, 3 * columns_in_all);
        }
    }
}
