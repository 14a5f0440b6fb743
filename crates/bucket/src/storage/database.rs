//! The database's file, and how it is opened again after the disk failed.
//!
//! After one failed write redb answers nothing more. The file as it is on the disk is sound, so it is opened once more:
//! [`Disk`] takes no lock (the folder's does), and the old handle is dead before the new one reads.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use redb::{Builder, Database, Durability, StorageBackend};

use super::table::{Batch, Snapshot, Table, View};

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
        let file = File::options().read(true).write(true).create(true).truncate(false).open(path)?;
        let disk = Arc::new(Disk { file, dead: AtomicBool::new(false) });
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

    /// Brings everything to the disk, in a state that opens at once.
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

    /// From now on nothing reaches the file through this handle.
    pub(super) fn kill(&self) {
        self.disk.dead.store(true, Ordering::Release);
    }
}

#[derive(Debug)]
struct Disk {
    file: File,
    dead: AtomicBool,
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
        Ok(self.file()?.metadata()?.len())
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.file()?.read_exact_at(out, offset)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.file()?.set_len(len)
    }

    fn sync_data(&self) -> io::Result<()> {
        self.file()?.sync_data()
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.file()?.write_all_at(data, offset)
    }
}
