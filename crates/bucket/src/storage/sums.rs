//! A checksum for each block of the database's file, in a file beside it.
//!
//! The database checks its own checksums only when it repairs itself. A flipped bit would otherwise be returned as a
//! row, or hide rows. With these sums, every block is checked at every read.
//!
//! The first block, the database's header, is overwritten in place. It has two sums: one of the header on disk, and
//! one of the header that is being written.
//!
//! ```text
//! sums of the header (8 bytes each)     as it is on the disk, as it was written last
//! sums of all blocks (8 bytes each)     the first one is not used
//! ```
//!
//! The sums of a commit are on disk before the header of the commit. After a kill, blocks to which no durable state
//! refers may have sums of earlier contents. They are written before they are read.

use std::collections::BTreeSet;
use std::io;
use std::sync::Arc;

use s3s::crypto::{Checksum, Crc64Nvme};

use super::medium::Medium;

/// The size of a block, which is a page of the database, in bytes.
pub(super) const BLOCK_BYTES: usize = 4096;

/// The size of a sum in bytes.
const SUM: usize = 8;

/// The size of the header's sums in bytes.
const HEADER: usize = 2 * SUM;

/// The number of bytes that are written at a time.
const PIECE: usize = 4096;

/// The number of blocks that are read at a time when all sums are computed.
const SCAN_BLOCKS: usize = 256;

/// The sums of a database, see the module.
#[derive(Debug)]
pub(super) struct Sums {
    file: Arc<dyn Medium>,
    /// The sums by block; 0 means a block of zeros.
    sums: Vec<u64>,
    /// The sums of the header on disk and of the header that was written last.
    header: [u64; 2],
    header_changed: bool,
    /// The pieces of the file that differ from `sums`.
    changed: BTreeSet<usize>,
    length_changed: bool,
}

impl Sums {
    /// Reads the sums of a database.
    pub(super) fn open(file: Arc<dyn Medium>, database: &dyn Medium) -> io::Result<Self> {
        let bytes = file.read_all()?;
        let (header, blocks) = bytes.split_at(HEADER.min(bytes.len()));
        let sums_of = |bytes: &[u8]| -> Vec<u64> {
            bytes.as_chunks::<SUM>().0.iter().map(|sum| u64::from_le_bytes(*sum)).collect()
        };
        let header = sums_of(header).try_into().unwrap_or_default();
        let mut opened = Self::of(file, sums_of(blocks));
        opened.header = header;
        let mut first = vec![0; BLOCK_BYTES];
        database.read_padded(&mut first, 0)?;
        // Find out which of the two headers it is.
        if opened.matches(0, &first) {
            opened.header = [sum(0, &first); 2];
        }
        opened.resize(database.len()?);
        Ok(opened)
    }

    fn of(file: Arc<dyn Medium>, sums: Vec<u64>) -> Self {
        let (header, changed) = ([0; 2], BTreeSet::new());
        Self { file, sums, header, header_changed: false, changed, length_changed: false }
    }

    /// Computes the sums of the current database, and writes them.
    pub(super) fn compute(file: Arc<dyn Medium>, database: &dyn Medium) -> io::Result<Self> {
        let length = database.len()?;
        let mut computed = Self::of(file, Vec::new());
        computed.length_changed = true;
        computed.resize(length);
        let mut bytes = vec![0; SCAN_BLOCKS * BLOCK_BYTES];
        for start in (0..computed.sums.len()).step_by(SCAN_BLOCKS) {
            database.read_padded(&mut bytes, (start * BLOCK_BYTES) as u64)?;
            for (block, bytes) in (start..computed.sums.len()).zip(bytes.chunks(BLOCK_BYTES)) {
                computed.set(block, bytes);
            }
        }
        computed.header_synced();
        computed.save()?;
        Ok(computed)
    }

    /// Returns whether a block has the expected content.
    pub(super) fn matches(&self, block: usize, bytes: &[u8]) -> bool {
        let found = sum(block, bytes);
        match block {
            0 => self.header.contains(&found),
            _ => self.sums.get(block).is_some_and(|expected| *expected == found),
        }
    }

    /// Records the new bytes of a block. For the header, the sum must be on disk before the header is written.
    pub(super) fn set(&mut self, block: usize, bytes: &[u8]) {
        if block == 0 {
            self.header[1] = sum(block, bytes);
            self.header_changed = true;
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

    /// Returns whether the header that was written last is on disk.
    pub(super) fn is_header_synced(&self) -> bool {
        self.header[0] == self.header[1]
    }

    /// Records that the header that was written last is on disk.
    pub(super) fn header_synced(&mut self) {
        self.header[0] = self.header[1];
    }

    /// Records the new length of the database.
    pub(super) fn resize(&mut self, database_bytes: u64) {
        let blocks = usize::try_from(database_bytes.div_ceil(BLOCK_BYTES as u64)).unwrap_or(usize::MAX);
        if blocks == self.sums.len() {
            return;
        }
        self.length_changed = true;
        self.sums.resize(blocks, 0);
        // The last piece may have held sums of removed blocks.
        self.changed.retain(|piece| piece * PIECE < blocks * SUM);
        if let Some(last) = blocks.checked_sub(1) {
            self.changed.insert(last * SUM / PIECE);
        }
    }

    /// Syncs the changed sums to disk.
    pub(super) fn save(&mut self) -> io::Result<()> {
        if self.changed.is_empty() && !self.length_changed && !self.header_changed {
            return Ok(());
        }
        if self.length_changed {
            self.file.set_len((HEADER + self.sums.len() * SUM) as u64)?;
        }
        if self.header_changed {
            self.file.write_all_at(&self.header.map(u64::to_le_bytes).concat(), 0)?;
        }
        for piece in &self.changed {
            let of_piece = piece * PIECE / SUM..self.sums.len().min((piece + 1) * PIECE / SUM);
            let bytes: Vec<u8> = self.sums[of_piece].iter().flat_map(|sum| sum.to_le_bytes()).collect();
            self.file.write_all_at(&bytes, (HEADER + piece * PIECE) as u64)?;
        }
        self.file.sync()?;
        self.changed.clear();
        (self.length_changed, self.header_changed) = (false, false);
        Ok(())
    }
}

/// Computes the sum of a block's number and bytes, so that a block in a wrong place is noticed.
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
        let mut sums = Sums::open(open("sums"), &*database).unwrap();
        assert_eq!(sums.sums.len(), 1500);
        assert!(sums.matches(0, &block(0)) && !sums.matches(0, &block(1)));
        for number in 1..1500 {
            assert!(sums.matches(number, &block(number)), "block {number}");
        }
        assert!(!sums.matches(252, &block(253)) && !sums.matches(1500, &block(0)));
        // Block 251 consists of zeros; 502 is another block with the same bytes as 753.
        assert!(!sums.matches(251, &block(252)) && sums.matches(753, &block(502)));
        sums.set(700, &block(1));
        sums.save().unwrap();
        sums.resize(600 * BLOCK_BYTES as u64);
        sums.resize(800 * BLOCK_BYTES as u64);
        sums.set(799, &block(9));
        sums.save().unwrap();
        database.set_len(800 * BLOCK_BYTES as u64).unwrap();
        let mut sums = Sums::open(open("sums"), &*database).unwrap();
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
        // While the header is written, both the old and the new one are right.
        sums.set(0, &block(1));
        sums.save().unwrap();
        for (header, other) in [(1, 2), (0, 1)] {
            database.write_all_at(&block(header), 0).unwrap();
            let mut sums = Sums::open(open("sums"), &*database).unwrap();
            assert!(
                sums.is_header_synced() && sums.matches(0, &block(header)) && !sums.matches(0, &block(other))
            );
            sums.set(0, &block(2));
            assert!(
                !sums.is_header_synced() && sums.matches(0, &block(header)) && sums.matches(0, &block(2))
            );
        }
    }
}
