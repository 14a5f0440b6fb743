//! Counts of the colours of a frame.
//!
//! Colours are counted in a hash table. Each has a bin of its own while there are at most [`MAX_BINS`]. With more,
//! neighbouring colours share cells of 2, 4 or 8 levels per channel. The palette of a frame with so many colours is
//! coarser than these cells.

use rayon::prelude::*;

/// The largest number of bins of a histogram.
pub(crate) const MAX_BINS: usize = 1 << 14;
const EMPTY: u32 = u32::MAX;

/// Counts of the colours of pixels.
#[derive(Debug)]
pub(crate) struct Histogram {
    /// The number of low bits of a level that are ignored.
    shift: u32,
    /// The hash table. Its length is a power of two, at least twice the number of bins.
    slots: Vec<Slot>,
    most_bins: usize,
    bins: Vec<Bin>,
}

/// The first length of the hash table: small enough to stay in the cache.
const FIRST_SLOTS: usize = 1 << 12;

#[derive(Debug, Clone, Copy)]
struct Slot {
    key: u32,
    bin: u32,
}

const FREE: Slot = Slot { key: EMPTY, bin: 0 };

/// A colour, or a cell of neighbouring colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Bin {
    /// The darkest colour of the cell, which identifies it.
    key: u32,
    /// The number of pixels counted.
    pub(crate) count: u32,
    /// For each channel, the sum over all pixels of the level above that of `key`.
    above: [u64; 3],
}

impl Bin {
    /// Returns the mean levels of the pixels.
    pub(crate) fn mean(&self) -> [f32; 3] {
        let [_, r, g, b] = self.key.to_be_bytes();
        let mean = |level: u8, above: u64| match above {
            0 => f32::from(level),
            above => (f64::from(level) + above as f64 / f64::from(self.count)) as f32,
        };
        [mean(r, self.above[0]), mean(g, self.above[1]), mean(b, self.above[2])]
    }

    /// Returns the colour of a bin that holds only one.
    pub(crate) fn colour(&self) -> [u8; 3] {
        let [_, r, g, b] = self.key.to_be_bytes();
        [r, g, b]
    }

    /// Returns the pixels as a bin of the cell with another key.
    fn moved(mut self, key: u32) -> Self {
        let (from, to) = (self.key.to_be_bytes(), key.to_be_bytes());
        for k in 0..3 {
            self.above[k] += u64::from(from[k + 1] - to[k + 1]) * u64::from(self.count);
        }
        self.key = key;
        self
    }
}

impl Histogram {
    /// Makes an empty histogram. `most_bins` is a power of two, at most 2^16.
    pub(crate) fn new(most_bins: usize) -> Self {
        Self { shift: 0, slots: vec![FREE; FIRST_SLOTS], most_bins, bins: Vec::new() }
    }

    pub(crate) fn clear(&mut self) {
        self.shift = 0;
        self.slots.truncate(FIRST_SLOTS);
        self.slots.fill(FREE);
        self.bins.clear();
    }

    /// Returns the bins in order of first appearance.
    pub(crate) fn bins(&self) -> &[Bin] {
        &self.bins
    }

    /// Returns the number of pixels counted.
    pub(crate) fn pixels(&self) -> u64 {
        self.bins.iter().map(|bin| u64::from(bin.count)).sum()
    }

    /// Returns whether each bin is a single colour.
    pub(crate) fn is_exact(&self) -> bool {
        self.shift == 0
    }

    /// Counts the colours of pixels. Each of `others` counts a part of them in parallel.
    pub(crate) fn count(&mut self, pixels: &[[u8; 3]], others: &mut [Self]) {
        let part = pixels.len().div_ceil(1 + others.len());
        let histograms = std::iter::once(&mut *self).chain(&mut *others).collect::<Vec<_>>();
        histograms.into_par_iter().zip(pixels.par_chunks(part)).for_each(|(histogram, pixels)| {
            histogram.clear();
            for run in pixels.chunk_by(|a, b| a == b) {
                histogram.add(run[0], run.len() as u32);
            }
        });
        for other in &others[..pixels.len().div_ceil(part) - 1] {
            self.absorb(other);
        }
    }

    /// Adds the counts of another histogram.
    pub(crate) fn absorb(&mut self, other: &Self) {
        while self.shift < other.shift {
            self.coarsen();
        }
        for bin in &other.bins {
            self.merge(*bin);
        }
    }

    /// Counts pixels of one colour.
    #[inline]
    pub(crate) fn add(&mut self, rgb: [u8; 3], count: u32) {
        let key = key(rgb);
        if self.shift == 0 {
            let slot = self.slots[self.slot(key)];
            if slot.key == key {
                self.bins[slot.bin as usize].count += count;
                return;
            }
        }
        if count > 0 {
            self.merge(Bin { key, count, above: [0; 3] });
        }
    }

    /// Returns the bin of a colour that was counted.
    #[inline]
    pub(crate) fn find(&self, rgb: [u8; 3]) -> Option<usize> {
        let key = self.cell(key(rgb));
        let slot = self.slots[self.slot(key)];
        (slot.key == key).then_some(slot.bin as usize)
    }

    /// Returns the key of the cell that holds a colour.
    fn cell(&self, key: u32) -> u32 {
        let low = 0xFF >> (8 - self.shift);
        key & !(low << 16 | low << 8 | low)
    }

    /// Returns the slot of a cell's key, or the empty one where it belongs.
    fn slot(&self, key: u32) -> usize {
        let last = self.slots.len() - 1;
        let mut at = (key.wrapping_mul(0x9E37_79B1) >> 15) as usize & last;
        while self.slots[at].key != key && self.slots[at].key != EMPTY {
            at = (at + 1) & last;
        }
        at
    }

    fn merge(&mut self, bin: Bin) {
        let bin = bin.moved(self.cell(bin.key));
        let at = self.slot(bin.key);
        if self.slots[at].key == bin.key {
            let known = &mut self.bins[self.slots[at].bin as usize];
            known.count += bin.count;
            for (sum, more) in known.above.iter_mut().zip(bin.above) {
                *sum += more;
            }
            return;
        }
        self.slots[at] = Slot { key: bin.key, bin: self.bins.len() as u32 };
        self.bins.push(bin);
        if self.bins.len() > self.most_bins {
            self.coarsen();
        } else if self.bins.len() * 2 > self.slots.len() {
            self.enlarge();
        }
    }

    fn coarsen(&mut self) {
        self.shift += 1;
        self.slots.fill(FREE);
        for bin in std::mem::take(&mut self.bins) {
            self.merge(bin);
        }
    }

    fn enlarge(&mut self) {
        let slots = (self.slots.len() * 4).min(self.most_bins * 2);
        self.slots.fill(FREE);
        self.slots.resize(slots, FREE);
        for (number, bin) in (0..).zip(&self.bins) {
            let at = self.slot(bin.key);
            self.slots[at] = Slot { key: bin.key, bin: number };
        }
    }
}

fn key([r, g, b]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, r, g, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_exact() {
        let mut histogram = Histogram::new(MAX_BINS);
        for k in 0..100_u8 {
            histogram.add([k, 0, 255 - k], 1 + u32::from(k));
        }
        assert!(histogram.is_exact());
        assert_eq!(histogram.bins().len(), 100);
        let bin = histogram.bins()[histogram.find([7, 0, 248]).unwrap()];
        assert_eq!((bin.count, bin.mean()), (8, [7.0, 0.0, 248.0]));
        assert_eq!(histogram.find([7, 0, 249]), None);
    }

    #[test]
    fn many_colours_share_bins_and_none_is_lost() {
        let mut histogram = Histogram::new(MAX_BINS);
        for k in 0..200_000_u32 {
            let [a, b, c, _] = k.wrapping_mul(2_654_435_761).to_le_bytes();
            histogram.add([a, b, c], 1);
        }
        assert!(!histogram.is_exact());
        assert!(histogram.bins().len() <= MAX_BINS);
        assert_eq!(histogram.bins().iter().map(|bin| bin.count).sum::<u32>(), 200_000);
    }
}
