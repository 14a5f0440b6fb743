//! A checksum for each block of the database's file, in a file beside it.
//!
//! The database compares its own checksums only when it repairs itself: a flipped bit would otherwise be served as a row, or
//! hide rows. Here every block is compared whenever it is read. The first block is left out: it is overwritten in place, and
//! the database protects what counts there.
//!
//! The sums of a commit are on the disk before the commit's header is. Blocks that no durable state refers to may have sums
//! of earlier contents after a kill; nothing reads them before it has written them.

use std::collections::BTreeSet;
use std::io;
use std::sync::Arc;

use s3s::crypto::{Checksum, Crc64Nvme};

use super::medium::Medium;

/// Bytes that have a sum together: a page of the database.
pub(super) const BLOCK_BYTES: usize = 4096;

/// Bytes of a sum.
const SUM: usize = 8;

/// What is written at a time.
const PIECE: usize = 4096;

/// What is read at a time when all sums are computed.
const SCAN_BLOCKS: usize = 256;

/// See the module.
#[derive(Debug)]
pub(super) struct Sums {
    file: Arc<dyn Medium>,
    /// By block; 0 stands for a block of zeros.
    sums: Vec<u64>,
    /// Pieces of the file that differ from `sums`.
    changed: BTreeSet<usize>,
    length_changed: bool,
}

impl Sums {
    /// Reads the sums of a database of so many bytes.
    pub(super) fn open(file: Arc<dyn Medium>, database_bytes: u64) -> io::Result<Self> {
        let bytes = file.read_all()?;
        let sums = bytes.as_chunks::<SUM>().0.iter().map(|sum| u64::from_le_bytes(*sum)).collect();
        let mut opened = Self { file, sums, changed: BTreeSet::new(), length_changed: false };
        opened.resize(database_bytes);
        Ok(opened)
    }

    /// Computes the sums of a database as it is, and writes them.
    pub(super) fn compute(file: Arc<dyn Medium>, database: &dyn Medium) -> io::Result<Self> {
        let length = database.len()?;
        let mut computed = Self { file, sums: Vec::new(), changed: BTreeSet::new(), length_changed: true };
        computed.resize(length);
        let mut bytes = vec![0; SCAN_BLOCKS * BLOCK_BYTES];
        for start in (0..computed.sums.len()).step_by(SCAN_BLOCKS) {
            database.read_padded(&mut bytes, (start * BLOCK_BYTES) as u64)?;
            for (block, bytes) in (start..computed.sums.len()).zip(bytes.chunks(BLOCK_BYTES)) {
                computed.set(block, bytes);
            }
        }
        computed.save()?;
        Ok(computed)
    }

    /// Whether this is what a block should hold.
    pub(super) fn matches(&self, block: usize, bytes: &[u8]) -> bool {
        block == 0 || self.sums.get(block).is_some_and(|expected| *expected == sum(block, bytes))
    }

    /// A block now holds these bytes.
    pub(super) fn set(&mut self, block: usize, bytes: &[u8]) {
        if block == 0 {
            return;
        }
        let sum = sum(block, bytes);
        if self.sums.len() <= block {
            self.resize((block as u64 + 1) * BLOCK_BYTES as u64);
        }
        if self.sums[block] != sum {
            self.sums[block] = sum;
            self.changed.insert(block * SUM / PIECE);
        }
    }

    /// The database now has this length.
    pub(super) fn resize(&mut self, database_bytes: u64) {
        let blocks = usize::try_from(database_bytes.div_ceil(BLOCK_BYTES as u64)).unwrap_or(usize::MAX);
        if blocks == self.sums.len() {
            return;
        }
        self.length_changed = true;
        self.sums.resize(blocks, 0);
        // The last piece may have held sums of blocks that are gone.
        self.changed.retain(|piece| piece * PIECE < blocks * SUM);
        if let Some(last) = blocks.checked_sub(1) {
            self.changed.insert(last * SUM / PIECE);
        }
    }

    /// Brings what changed to the disk.
    pub(super) fn save(&mut self) -> io::Result<()> {
        if self.changed.is_empty() && !self.length_changed {
            return Ok(());
        }
        if self.length_changed {
            self.file.set_len((self.sums.len() * SUM) as u64)?;
        }
        for piece in &self.changed {
            let of_piece = piece * PIECE / SUM..self.sums.len().min((piece + 1) * PIECE / SUM);
            let bytes: Vec<u8> = self.sums[of_piece].iter().flat_map(|sum| sum.to_le_bytes()).collect();
            self.file.write_all_at(&bytes, (piece * PIECE) as u64)?;
        }
        self.file.sync()?;
        self.changed.clear();
        self.length_changed = false;
        Ok(())
    }
}

/// Of a block's number and bytes, so that a block in another's place is noticed.
fn sum(block: usize, bytes: &[u8]) -> u64 {
    if bytes.iter().all(|byte| *byte == 0) {
        return 0;
    }
    let mut sum = Crc64Nvme::new();
    sum.update(&(block as u64).to_le_bytes());
    sum.update(bytes);
    u64::from_be_bytes(sum.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::medium::{Files, SystemFiles};

    #[test]
    fn sums_come_back_and_notice_each_change() {
        let folder = tempfile::tempdir().unwrap();
        let open = |name: &str| SystemFiles.open(&folder.path().join(name)).unwrap();
        let block = |number: usize| vec![u8::try_from(number % 251).unwrap(); BLOCK_BYTES];
        let database = open("database");
        for number in 0..1500 {
            database.write_all_at(&block(number), (number * BLOCK_BYTES) as u64).unwrap();
        }
        Sums::compute(open("sums"), &*database).unwrap();
        let mut sums = Sums::open(open("sums"), database.len().unwrap()).unwrap();
        assert_eq!(sums.sums.len(), 1500);
        for number in 0..1500 {
            assert!(sums.matches(number, &block(number)), "block {number}");
        }
        assert!(!sums.matches(252, &block(253)) && !sums.matches(1500, &block(0)));
        // 251 is a block of zeros; 502 another one with the same bytes as 753.
        assert!(!sums.matches(251, &block(252)) && sums.matches(753, &block(502)));
        sums.set(700, &block(1));
        sums.save().unwrap();
        sums.resize(600 * BLOCK_BYTES as u64);
        sums.resize(800 * BLOCK_BYTES as u64);
        sums.set(799, &block(9));
        sums.save().unwrap();
        let sums = Sums::open(open("sums"), 800 * BLOCK_BYTES as u64).unwrap();
        assert!(sums.matches(599, &block(599)) && sums.matches(799, &block(9)));
        assert!(
            sums.matches(700, &block(0)) && !sums.matches(700, &block(1)),
            "it was cut off, and is zeros"
        );
        let mut flipped = block(42);
        for bit in [0, 4095 * 8 + 7] {
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(!sums.matches(42, &flipped));
        }
    }
}
