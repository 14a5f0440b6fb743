//! The file of the database, its behaviour on a full disk, and reopening it after a disk failure.
//!
//! After one failed write redb answers nothing more, not even reads. So a full disk is hidden from it: data without
//! space stays in memory ([`Overlay`]), and a writer checks [`Open::has_room`] before it acknowledges anything. After
//! another failure the file on disk is consistent, and is opened again. [`Disk`] takes no lock (the folder has one),
//! and the old handle is dead before the new one reads.
//!
//! Each block that is read is compared with its checksum ([`Sums`]). If it differs, the read fails, and the
//! database must be reopened.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use redb::{Builder, Database, Durability, StorageBackend};

use super::medium::Medium;
use super::sums::{BLOCK_BYTES, Sums};
use super::table::{Batch, Snapshot, Table, View};
use crate::error::report;

/// The size of the page cache in bytes. It holds most of a store of a hundred thousand objects.
const CACHE_BYTES: usize = 64 * 1024 * 1024;

/// The row with the number of the last journal entry that the database holds durably.
const APPLIED: &[u8] = b"applied";

pub(super) struct Open {
    database: Database,
    disk: Arc<Disk>,
}

impl Open {
    /// Opens or creates the database. Returns the number of the last journal entry that it holds. `verify` reads the
    /// whole file and compares the database's own checksums.
    pub(super) fn at(disk: Arc<Disk>, verify: bool) -> Result<(Self, u64), redb::Error> {
        Self::with_cache(disk, verify, CACHE_BYTES)
    }

    /// Opens the database with a page cache of this many bytes.
    pub(super) fn with_cache(
        disk: Arc<Disk>,
        verify: bool,
        cache: usize,
    ) -> Result<(Self, u64), redb::Error> {
        let mut builder = Builder::new();
        builder.set_cache_size(cache).set_check_integrity_on_open(verify);
        let database = builder.create_with_backend(Handle(disk.clone()))?;
        let open = Self { database, disk };
        let fresh = !open.has_tables()?;
        if fresh {
            let transaction = open.begin()?;
            drop(Batch::of(&transaction)?);
            open.commit_durably(transaction, 0)?;
        }
        let applied = open.snapshot()?.get(Table::Settings, APPLIED)?;
        let applied = applied.and_then(|bytes| bytes.try_into().ok()).map_or(0, u64::from_be_bytes);
        Ok((open, applied))
    }

    fn has_tables(&self) -> Result<bool, redb::Error> {
        use redb::ReadableDatabase;
        Ok(self.database.begin_read()?.list_tables()?.next().is_some())
    }

    /// Returns the current rows.
    pub(super) fn snapshot(&self) -> Result<Snapshot, redb::Error> {
        use redb::ReadableDatabase;
        Snapshot::of(&self.database.begin_read()?)
    }

    pub(super) fn begin(&self) -> Result<redb::WriteTransaction, redb::Error> {
        Ok(self.database.begin_write()?)
    }

    /// Makes a transaction visible. The journal makes it durable.
    pub(super) fn commit(&self, mut transaction: redb::WriteTransaction) -> Result<(), redb::Error> {
        transaction.set_durability(Durability::None)?;
        Ok(transaction.commit()?)
    }

    /// Returns the current rows. They stay readable also if the store reopens the database.
    pub(super) fn kept_snapshot(self: Arc<Self>) -> Result<Snapshot, redb::Error> {
        Ok(self.snapshot()?.keeping(self))
    }

    /// Syncs everything to disk in a state that opens at once. It is on disk only if [`Open::has_room`].
    pub(super) fn commit_durably(
        &self,
        mut transaction: redb::WriteTransaction,
        applied: u64,
    ) -> Result<(), redb::Error> {
        let mut batch = Batch::of(&transaction)?;
        batch.put(Table::Settings, APPLIED, &applied.to_be_bytes())?;
        drop(batch.end());
        transaction.set_quick_repair(true);
        Ok(transaction.commit()?)
    }

    /// Returns whether less than half of the file is in use. Reads the whole tree.
    pub(super) fn is_sparse(&self) -> Result<bool, redb::Error> {
        let transaction = self.begin()?;
        let stats = transaction.stats()?;
        transaction.abort()?;
        let used = stats.allocated_pages().saturating_mul(stats.page_size() as u64);
        Ok(used.saturating_mul(2) < self.file_bytes()?)
    }

    /// Returns the length of the file.
    pub(super) fn file_bytes(&self) -> Result<u64, redb::Error> {
        Ok(self.disk.file.len()?)
    }

    /// Writes the data that had no space so far, and returns whether everything is written.
    pub(super) fn has_room(&self) -> bool {
        self.disk.settle().is_ok()
    }

    /// Stops all writes to the file through this handle.
    pub(super) fn kill(&self) {
        self.disk.dead.store(true, Ordering::Release);
    }

    /// Returns the position of a block that did not match its checksum. If there is one, this
    /// handle answers nothing more.
    pub(super) fn damage(&self) -> Option<u64> {
        self.disk.damage()
    }
}

/// The file of the database and its sums.
#[derive(Debug)]
pub(super) struct Disk {
    file: Arc<dyn Medium>,
    sums: Mutex<Sums>,
    dead: AtomicBool,
    overlay: Mutex<Overlay>,
    damage: Mutex<Option<u64>>,
    lenient: AtomicBool,
    held: AtomicBool,
}

/// The data without space on disk: pages that replace those of the file, and the length that the file should have.
#[derive(Debug, Default)]
struct Overlay {
    length: Option<u64>,
    pages: BTreeMap<u64, Box<[u8]>>,
}

/// The size of a page of the overlay.
const PAGE_BYTES: u64 = BLOCK_BYTES as u64;

impl Overlay {
    fn is_empty(&self) -> bool {
        self.length.is_none() && self.pages.is_empty()
    }
}

impl Disk {
    pub(super) fn new(file: Arc<dyn Medium>, sums: Sums) -> Arc<Self> {
        let [dead, lenient, held] = [(); 3].map(|()| AtomicBool::new(false));
        let (overlay, damage) = (Mutex::default(), Mutex::default());
        Arc::new(Self { file, sums: Mutex::new(sums), dead, overlay, damage, lenient, held })
    }

    /// Keeps writes in memory until [`Disk::release`], so that a refused start changes nothing.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub(super) fn hold(&self) -> io::Result<()> {
        self.overlay().length = Some(self.file.len()?);
        self.held.store(true, Ordering::Release);
        Ok(())
    }

    /// Writes the held data, now or, on a full disk, once there is space.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub(super) fn release(&self) -> io::Result<()> {
        self.held.store(false, Ordering::Release);
        self.settle()
    }

    /// Sets whether damaged blocks are returned as they are.
    pub(super) fn set_lenient(&self, lenient: bool) {
        self.lenient.store(lenient, Ordering::Release);
    }

    fn overlay(&self) -> MutexGuard<'_, Overlay> {
        self.overlay.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn sums(&self) -> MutexGuard<'_, Sums> {
        self.sums.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the position of a block that did not match its checksum.
    pub(super) fn damage(&self) -> Option<u64> {
        *self.damage.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Compares the whole blocks that were read.
    fn compare(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        if self.lenient.load(Ordering::Acquire) {
            return Ok(());
        }
        let sums = self.sums();
        for (block, bytes) in blocks(offset, bytes) {
            if !sums.matches(block, bytes) {
                let at = (block * BLOCK_BYTES) as u64;
                let what =
                    format!("the database is damaged: the block at byte {at} does not match its checksum");
                if self.damage.lock().unwrap_or_else(PoisonError::into_inner).replace(at).is_none() {
                    report(&what);
                }
                return Err(io::Error::new(io::ErrorKind::InvalidData, what));
            }
        }
        Ok(())
    }

    /// Writes the data that had no space, if there is some now. The first page refers to the others, so it is written last.
    fn settle(&self) -> io::Result<()> {
        let mut overlay = self.overlay();
        if overlay.is_empty() {
            return Ok(());
        }
        if self.held.load(Ordering::Acquire) {
            return Err(full());
        }
        if let Some(length) = overlay.length
            && length != self.file.len()?
        {
            self.file.set_len(length)?;
        }
        for (page, bytes) in overlay.pages.iter().filter(|(page, _)| **page > 0) {
            self.file.write_all_at(bytes, page * PAGE_BYTES)?;
        }
        self.sums().save()?;
        self.file.sync()?;
        if let Some(bytes) = overlay.pages.get(&0) {
            self.file.write_all_at(bytes, 0)?;
            self.file.sync()?;
            self.sums().header_synced();
        }
        *overlay = Overlay::default();
        Ok(())
    }

    /// Syncs the written data to disk.
    fn sync(&self) -> io::Result<()> {
        self.file.sync()?;
        self.sums().header_synced();
        Ok(())
    }

    /// Syncs the sum of a header to disk before the header is written.
    fn announce(&self, header: &[u8]) -> io::Result<()> {
        // Otherwise there would be three headers that may be on disk, for two sums.
        let synced = self.sums().is_header_synced();
        if !synced {
            self.sync()?;
        }
        let mut sums = self.sums();
        sums.set(0, header);
        sums.save()
    }

    /// Returns a page as it is in the file, with zeros beyond the end.
    fn page(&self, page: u64) -> io::Result<Box<[u8]>> {
        let mut bytes = vec![0; PAGE_BYTES as usize].into_boxed_slice();
        self.file.read_padded(&mut bytes, page * PAGE_BYTES)?;
        Ok(bytes)
    }
}

#[derive(Debug)]
struct Handle(Arc<Disk>);

impl Handle {
    fn file(&self) -> io::Result<&dyn Medium> {
        if self.0.dead.load(Ordering::Acquire) {
            return Err(io::Error::other("the database was opened anew"));
        }
        Ok(&*self.0.file)
    }

    /// Returns the first block, which holds the header.
    fn first(&self) -> io::Result<Vec<u8>> {
        let mut first = vec![0; BLOCK_BYTES];
        let length = self.len()?.min(PAGE_BYTES) as usize;
        self.view(0, &mut first[..length])?;
        Ok(first)
    }

    /// Reads the written data, from disk or memory.
    fn view(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let file = self.file()?;
        let end = offset + out.len() as u64;
        let overlay = self.0.overlay();
        let length = overlay.length.map_or_else(|| file.len(), Ok)?;
        if end > length && overlay.is_empty() {
            let what = format!("the database ends before byte {end}, which it refers to");
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, what));
        }
        file.read_padded(out, offset)?;
        for (page, within, of_page) in pages(offset, out.len()) {
            if let Some(bytes) = overlay.pages.get(&page) {
                out[within].copy_from_slice(&bytes[of_page]);
            }
        }
        Ok(())
    }
}

impl StorageBackend for Handle {
    fn len(&self) -> io::Result<u64> {
        let file = self.file()?;
        self.0.overlay().length.map_or_else(|| file.len(), Ok)
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.view(offset, out)?;
        if offset < PAGE_BYTES && out.len() < BLOCK_BYTES {
            self.0.compare(0, &self.first()?)?;
        }
        self.0.compare(offset, out)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        let file = self.file()?;
        let mut overlay = self.0.overlay();
        let done = if overlay.is_empty() { file.set_len(len) } else { Err(full()) };
        self.0.sums().resize(len);
        match done {
            Err(failed) if is_full(&failed) => {
                overlay.length = Some(len);
                overlay.pages.retain(|page, _| page * PAGE_BYTES < len);
                Ok(())
            }
            done => done,
        }
    }

    fn sync_data(&self) -> io::Result<()> {
        let file = self.file()?;
        let saved = self.0.settle().and_then(|()| self.0.sums().save());
        match saved {
            // The disk keeps its older, consistent state, and the journal the later changes. If only the sums had no
            // space, further writes must wait for them.
            Err(failed) if is_full(&failed) => {
                let mut overlay = self.0.overlay();
                if overlay.length.is_none() {
                    overlay.length = Some(file.len()?);
                }
                Ok(())
            }
            saved => saved.and_then(|()| self.0.sync()),
        }
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        let file = self.file()?;
        let header = match offset {
            0..PAGE_BYTES => {
                let mut first = self.first()?;
                let start = offset as usize;
                let length = data.len().min(BLOCK_BYTES - start);
                first[start..start + length].copy_from_slice(&data[..length]);
                Some(first)
            }
            _ => None,
        };
        let mut overlay = self.0.overlay();
        let announced = match &header {
            Some(header) if overlay.is_empty() => self.0.announce(header),
            Some(header) => {
                self.0.sums().set(0, header);
                Ok(())
            }
            None => Ok(()),
        };
        let written = |()| if overlay.is_empty() { file.write_all_at(data, offset) } else { Err(full()) };
        let done = announced.and_then(written);
        match done {
            Err(failed) if is_full(&failed) => {
                for (page, within, of_page) in pages(offset, data.len()) {
                    let mut bytes = match overlay.pages.remove(&page) {
                        Some(bytes) => bytes,
                        None => self.0.page(page)?,
                    };
                    bytes[of_page].copy_from_slice(&data[within]);
                    overlay.pages.insert(page, bytes);
                }
            }
            done => done?,
        }
        drop(overlay);
        // The database writes whole blocks, except for its header.
        let mut partial = vec![0; BLOCK_BYTES];
        for (page, within, of_page) in pages(offset, data.len()) {
            let block = usize::try_from(page).map_err(io::Error::other)?;
            if block > 0 && of_page.len() == BLOCK_BYTES {
                self.0.sums().set(block, &data[within]);
            } else if block > 0 {
                partial.fill(0);
                let length = self.len()?.saturating_sub(page * PAGE_BYTES).min(PAGE_BYTES) as usize;
                self.view(page * PAGE_BYTES, &mut partial[..length])?;
                self.0.sums().set(block, &partial);
            }
        }
        Ok(())
    }
}

/// Splits a range of bytes into whole blocks. The database reads only those, except for its header in the first.
fn blocks(offset: u64, bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let first = usize::try_from(offset.div_ceil(BLOCK_BYTES as u64)).unwrap_or(usize::MAX);
    let skipped = (first as u64 * BLOCK_BYTES as u64 - offset) as usize;
    (first..).zip(bytes.get(skipped..).unwrap_or_default().chunks_exact(BLOCK_BYTES))
}

/// Returns the pages that a range of bytes touches, each with its bytes within the range and within the page.
fn pages(offset: u64, length: usize) -> impl Iterator<Item = (u64, Range<usize>, Range<usize>)> {
    let end = offset + length as u64;
    (offset / PAGE_BYTES..end.div_ceil(PAGE_BYTES)).map(move |page| {
        let start = offset.max(page * PAGE_BYTES);
        let stop = end.min((page + 1) * PAGE_BYTES);
        let in_range = (start - offset) as usize..(stop - offset) as usize;
        let in_page = (start - page * PAGE_BYTES) as usize..(stop - page * PAGE_BYTES) as usize;
        (page, in_range, in_page)
    })
}

/// Returns whether the error means that there was no space.
pub(super) fn is_full(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}

fn full() -> io::Error {
    io::ErrorKind::StorageFull.into()
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::path::Path;

    use super::super::medium::{Files, SystemFiles};
    use super::*;

    fn disk(path: &Path) -> Arc<Disk> {
        let sums = SystemFiles.open(&path.with_extension("sums")).unwrap();
        let file = SystemFiles.open(path).unwrap();
        Disk::new(file.clone(), Sums::compute(sums, &*file).unwrap())
    }

    #[test]
    fn what_finds_no_room_is_read_back_and_written_later() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let disk = disk(&path);
        let handle = Handle(disk.clone());
        handle.set_len(8192).unwrap();
        handle.write(0, &[1; 4096]).unwrap();
        handle.write(4096, &[4; 4096]).unwrap();
        // From here on it behaves as on a full disk.
        disk.overlay().length = Some(8192);
        handle.set_len(20_000).unwrap();
        handle.write(4000, &[2; 200]).unwrap();
        handle.write(12_288, &[3; 4096]).unwrap();
        let expected: Vec<u8> =
            [vec![1; 4000], vec![2; 200], vec![4; 3992], vec![0; 4096], vec![3; 4096]].concat();
        let mut found = vec![9; expected.len()];
        handle.read(0, &mut found).unwrap();
        assert!(found == expected);
        let mut middle = vec![9; 300];
        handle.read(3950, &mut middle).unwrap();
        assert!(middle == expected[3950..4250]);
        assert_eq!(handle.len().unwrap(), 20_000);
        assert_eq!(std::fs::metadata(&path).unwrap().len(), 8192);
        handle.sync_data().unwrap();
        let mut written = std::fs::read(&path).unwrap();
        assert_eq!(written.len(), 20_000);
        written.truncate(expected.len());
        assert!(written == expected && disk.overlay().is_empty());
    }

    #[test]
    fn what_was_cut_off_on_a_full_disk_does_not_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let disk = disk(&folder.path().join("file"));
        disk.overlay().length = Some(0);
        let handle = Handle(disk);
        handle.set_len(3 * PAGE_BYTES).unwrap();
        handle.write(0, &[7; 3 * PAGE_BYTES as usize]).unwrap();
        handle.set_len(PAGE_BYTES).unwrap();
        handle.set_len(3 * PAGE_BYTES).unwrap();
        let mut found = vec![9; 3 * PAGE_BYTES as usize];
        handle.read(0, &mut found).unwrap();
        let (kept, cut) = found.split_at(PAGE_BYTES as usize);
        assert!(kept.iter().all(|byte| *byte == 7) && cut.iter().all(|byte| *byte == 0));
    }

    /// Only a full disk is waited for. Any other error is reported at once.
    #[test]
    fn faults_other_than_a_full_disk_are_reported() {
        assert!(is_full(&full()) && !is_full(&io::Error::other("a fault")));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, [0; 8192]).unwrap();
        let sums = SystemFiles.open(&folder.path().join("sums")).unwrap();
        let file = File::open(&path).unwrap();
        let sums = Sums::open(sums, &file).unwrap();
        let disk = Disk::new(Arc::new(file), sums);
        let handle = Handle(disk.clone());
        assert!(handle.write(0, &[1; 10]).is_err(), "the file is open for reading alone");
        assert!(handle.set_len(10).is_err());
        disk.overlay().length = Some(10);
        assert!(handle.sync_data().is_err());
    }
}
