//! Which colours a frame has, and how often.
//!
//! Colours are counted in a hash table, exactly while they are few, in cells of 2, 4 or 8 levels a channel when there
//! are more than [`MOST_BINS`]: a frame with so many has them far apart in its palette, too.

/// The most bins that a histogram grows to.
pub(crate) const MOST_BINS: usize = 1 << 14;
const EMPTY: u32 = u32::MAX;

/// Counts of colours.
#[derive(Debug)]
pub(crate) struct Histogram {
    shift: u32,
    slots: Vec<Slot>,
    most_bins: usize,
    bins: Vec<Bin>,
}

#[derive(Debug, Clone, Copy)]
struct Slot {
    key: u32,
    bin: u32,
}

/// A colour, or a cell of neighbouring ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Bin {
    key: u32,
    /// Pixels counted.
    pub(crate) count: u32,
    /// Sum of their levels.
    pub(crate) sum: [u64; 3],
}

impl Bin {
    /// Mean levels.
    pub(crate) fn mean(&self) -> [f32; 3] {
        let mean = |k: usize| (self.sum[k] as f64 / f64::from(self.count)) as f32;
        [mean(0), mean(1), mean(2)]
    }
}

impl Histogram {
    /// For at most 2^16 bins, a power of two.
    pub(crate) fn new(most_bins: usize) -> Self {
        Self {
            shift: 0,
            slots: vec![Slot { key: EMPTY, bin: 0 }; most_bins * 2],
            most_bins,
            bins: Vec::new(),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.shift = 0;
        self.slots.fill(Slot { key: EMPTY, bin: 0 });
        self.bins.clear();
    }

    /// The bins in order of first appearance, or of colour after [`sort`](Self::sort).
    pub(crate) fn bins(&self) -> &[Bin] {
        &self.bins
    }

    /// Whether each bin is one colour.
    pub(crate) fn is_exact(&self) -> bool {
        self.shift == 0
    }

    /// Adds what another one counted.
    pub(crate) fn absorb(&mut self, other: &Self) {
        while self.shift < other.shift {
            self.coarsen();
        }
        for bin in &other.bins {
            let [_, r, g, b] = bin.key.to_be_bytes();
            self.merge(Bin { key: self.key([r, g, b]), ..*bin });
        }
    }

    /// Puts the bins in order of colour, so that the order of counting leaves no trace.
    pub(crate) fn sort(&mut self) {
        self.bins.sort_unstable_by_key(|bin| bin.key);
        for number in 0..self.bins.len() {
            let at = self.slot(self.bins[number].key);
            self.slots[at].bin = number as u32;
        }
    }

    /// Counts pixels of one colour.
    pub(crate) fn add(&mut self, rgb: [u8; 3], count: u32) {
        if count == 0 {
            return;
        }
        let sum = |k: usize| u64::from(rgb[k]) * u64::from(count);
        self.merge(Bin { key: self.key(rgb), count, sum: [sum(0), sum(1), sum(2)] });
    }

    /// The bin that holds a colour that was counted.
    pub(crate) fn find(&self, rgb: [u8; 3]) -> Option<usize> {
        let key = self.key(rgb);
        let slot = self.slots[self.slot(key)];
        (slot.key == key).then_some(slot.bin as usize)
    }

    fn key(&self, rgb: [u8; 3]) -> u32 {
        let key = u32::from(rgb[0]) << 16 | u32::from(rgb[1]) << 8 | u32::from(rgb[2]);
        let low = 0xFF >> (8 - self.shift);
        key & !(low << 16 | low << 8 | low)
    }

    /// Where a key is, or would be put.
    fn slot(&self, key: u32) -> usize {
        let last = self.slots.len() - 1;
        let mut at = (key.wrapping_mul(0x9E37_79B1) >> 15) as usize & last;
        while self.slots[at].key != key && self.slots[at].key != EMPTY {
            at = (at + 1) & last;
        }
        at
    }

    fn merge(&mut self, bin: Bin) {
        let at = self.slot(bin.key);
        if self.slots[at].key == bin.key {
            let known = &mut self.bins[self.slots[at].bin as usize];
            known.count += bin.count;
            for (sum, more) in known.sum.iter_mut().zip(bin.sum) {
                *sum += more;
            }
            return;
        }
        self.slots[at] = Slot { key: bin.key, bin: self.bins.len() as u32 };
        self.bins.push(bin);
        if self.bins.len() > self.most_bins {
            self.coarsen();
        }
    }

    fn coarsen(&mut self) {
        self.shift += 1;
        self.slots.fill(Slot { key: EMPTY, bin: 0 });
        for bin in std::mem::take(&mut self.bins) {
            let [_, r, g, b] = bin.key.to_be_bytes();
            self.merge(Bin { key: self.key([r, g, b]), ..bin });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_exact() {
        let mut histogram = Histogram::new(MOST_BINS);
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
        let mut histogram = Histogram::new(MOST_BINS);
        for k in 0..200_000_u32 {
            let [a, b, c, _] = k.wrapping_mul(2_654_435_761).to_le_bytes();
            histogram.add([a, b, c], 1);
        }
        assert!(!histogram.is_exact());
        assert!(histogram.bins().len() <= MOST_BINS);
        assert_eq!(histogram.bins().iter().map(|bin| bin.count).sum::<u32>(), 200_000);
    }
}
