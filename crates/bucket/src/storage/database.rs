//! The database's file, what it does on a full disk, and how it is opened again after the disk failed.
//!
//! After one failed write redb answers nothing more, not even reads. So a disk that is only full is kept from it: what
//! finds no room stays in memory ([`Overlay`]), and whoever writes asks ([`Open::has_room`]) before it acknowledges
//! anything. After another failure the file as it is on the disk is sound, and is opened once more: [`Disk`] takes no lock
//! (the folder's does), and the old handle is dead before the new one reads.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use redb::{Builder, Database, Durability, StorageBackend};

use super::table::{Batch, Snapshot, Table, View};
use crate::private;

/// Pages kept in memory. Most of a store of a hundred thousand objects.
const CACHE_BYTES: usize = 64 * 1024 * 1024;

/// The row of the last journal entry that the database holds durably.
const APPLIED: &[u8] = b"applied";

/// The open database.
pub(super) struct Open {
    database: Database,
    disk: Arc<Disk>,
}

impl Open {
    /// Opens or makes the database; gives the number of the journal's last entry that it holds.
    pub(super) fn at(path: &Path) -> Result<(Self, u64), redb::Error> {
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false).mode(private::FILE);
        let disk = Disk::new(options.open(path)?);
        let database =
            Builder::new().set_cache_size(CACHE_BYTES).create_with_backend(Handle(disk.clone()))?;
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

    /// The rows as they are now.
    pub(super) fn snapshot(&self) -> Result<Snapshot, redb::Error> {
        use redb::ReadableDatabase;
        Snapshot::of(&self.database.begin_read()?)
    }

    pub(super) fn begin(&self) -> Result<redb::WriteTransaction, redb::Error> {
        Ok(self.database.begin_write()?)
    }

    /// Makes a transaction visible; it is on the disk when the journal says so.
    pub(super) fn commit(&self, mut transaction: redb::WriteTransaction) -> Result<(), redb::Error> {
        transaction.set_durability(Durability::None)?;
        Ok(transaction.commit()?)
    }

    /// Brings everything to the disk, in a state that opens at once; it is there if [`Open::has_room`].
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

    /// Whether all that was written found room, now at the latest.
    pub(super) fn has_room(&self) -> bool {
        self.disk.settle().is_ok()
    }

    /// From now on nothing reaches the file through this handle.
    pub(super) fn kill(&self) {
        self.disk.dead.store(true, Ordering::Release);
    }
}

#[derive(Debug)]
struct Disk {
    file: File,
    dead: AtomicBool,
    overlay: Mutex<Overlay>,
}

/// What found no room on the disk: pages that hide those of the file, and the length that the file should have.
#[derive(Debug, Default)]
struct Overlay {
    length: Option<u64>,
    pages: BTreeMap<u64, Box<[u8]>>,
}

/// Of the overlay.
const PAGE_BYTES: u64 = 4096;

impl Overlay {
    fn is_empty(&self) -> bool {
        self.length.is_none() && self.pages.is_empty()
    }
}

impl Disk {
    fn new(file: File) -> Arc<Self> {
        Arc::new(Self { file, dead: AtomicBool::new(false), overlay: Mutex::default() })
    }

    fn overlay(&self) -> MutexGuard<'_, Overlay> {
        self.overlay.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes what found no room, if there is some now. The first page says which of the others count: it comes last.
    fn settle(&self) -> io::Result<()> {
        let mut overlay = self.overlay();
        if overlay.is_empty() {
            return Ok(());
        }
        if let Some(length) = overlay.length {
            self.file.set_len(length)?;
        }
        for (page, bytes) in overlay.pages.iter().filter(|(page, _)| **page > 0) {
            self.file.write_all_at(bytes, page * PAGE_BYTES)?;
        }
        self.file.sync_data()?;
        if let Some(bytes) = overlay.pages.get(&0) {
            self.file.write_all_at(bytes, 0)?;
            self.file.sync_data()?;
        }
        *overlay = Overlay::default();
        Ok(())
    }

    /// A page as the file has it; zeros beyond its end.
    fn page(&self, page: u64) -> io::Result<Box<[u8]>> {
        let mut bytes = vec![0; PAGE_BYTES as usize].into_boxed_slice();
        read_padded(&self.file, &mut bytes, page * PAGE_BYTES)?;
        Ok(bytes)
    }
}

#[derive(Debug)]
struct Handle(Arc<Disk>);

impl Handle {
    fn file(&self) -> io::Result<&File> {
        if self.0.dead.load(Ordering::Acquire) {
            return Err(io::Error::other("the database was opened anew"));
        }
        Ok(&self.0.file)
    }
}

impl StorageBackend for Handle {
    fn len(&self) -> io::Result<u64> {
        let file = self.file()?;
        self.0.overlay().length.map_or_else(|| Ok(file.metadata()?.len()), Ok)
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let file = self.file()?;
        let overlay = self.0.overlay();
        if overlay.is_empty() {
            drop(overlay);
            return file.read_exact_at(out, offset);
        }
        read_padded(file, out, offset)?;
        for (page, within, of_page) in pages(offset, out.len()) {
            if let Some(bytes) = overlay.pages.get(&page) {
                out[within].copy_from_slice(&bytes[of_page]);
            }
        }
        Ok(())
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        let file = self.file()?;
        let mut overlay = self.0.overlay();
        let done = if overlay.is_empty() { file.set_len(len) } else { Err(full()) };
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
        match self.0.settle() {
            // The disk keeps its older state, which is whole, and the journal what came after it.
            Err(failed) if is_full(&failed) => Ok(()),
            settled => settled.and_then(|()| file.sync_data()),
        }
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        let file = self.file()?;
        let mut overlay = self.0.overlay();
        let done = if overlay.is_empty() { file.write_all_at(data, offset) } else { Err(full()) };
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
                Ok(())
            }
            done => done,
        }
    }
}

/// The pages that a range of bytes touches: each with its bytes in the range, and those of the page.
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

/// Reads; what lies beyond the file's end is zeros.
fn read_padded(file: &File, out: &mut [u8], offset: u64) -> io::Result<()> {
    let mut done = 0;
    while done < out.len() {
        match file.read_at(&mut out[done..], offset + done as u64) {
            Ok(0) => break,
            Ok(read) => done += read,
            Err(again) if again.kind() == io::ErrorKind::Interrupted => {}
            Err(failed) => return Err(failed),
        }
    }
    out[done..].fill(0);
    Ok(())
}

/// Whether there was no room.
pub(super) fn is_full(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}

fn full() -> io::Error {
    io::ErrorKind::StorageFull.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_finds_no_room_is_read_back_and_written_later() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let file = File::options().read(true).write(true).create(true).truncate(false).open(&path).unwrap();
        let disk = Disk::new(file);
        let handle = Handle(disk.clone());
        handle.set_len(8192).unwrap();
        handle.write(0, &[1; 4096]).unwrap();
        handle.write(4096, &[4; 4096]).unwrap();
        // From here on as on a full disk.
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
        let file = File::create_new(folder.path().join("file")).unwrap();
        let disk = Disk::new(file);
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

    /// A full disk is waited for; any other fault of it is told at once.
    #[test]
    fn faults_other_than_a_full_disk_are_told() {
        assert!(is_full(&full()) && !is_full(&io::Error::other("a fault")));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, [0; 8192]).unwrap();
        let file = File::open(&path).unwrap();
        let disk = Disk::new(file);
        let handle = Handle(disk.clone());
        assert!(handle.write(0, &[1; 10]).is_err(), "the file is open for reading alone");
        assert!(handle.set_len(10).is_err());
        disk.overlay().length = Some(10);
        assert!(handle.sync_data().is_err());
    }
}
