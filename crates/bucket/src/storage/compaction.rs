//! Compaction: a database from which most rows were removed is copied to a smaller file.
//!
//! The copy is complete and on disk before it replaces the database; its sums follow. A reader of the database
//! continues to read the old file.

use std::io;

use super::bodies::sync_folder;
use super::database::{Disk, Open};
use super::folder::Folder;
use super::sums::Sums;
use super::table::{Batch, Snapshot, Table, View};
use crate::{Error, Result};

/// The size up to which a database is not compacted.
pub(super) const SMALLEST: u64 = 4 * 1024 * 1024;

/// The size of the rows in one transaction of the copy.
const BATCH_BYTES: usize = 8 * 1024 * 1024;

/// Copies the rows to a new database, which holds the changes up to entry `applied`, and replaces the old one by it.
pub(super) fn compact(folder: &Folder, rows: &Snapshot, applied: u64) -> Result<Open> {
    let failed =
        |source: redb::Error| Error::Storage { path: folder.path().to_owned(), source: source.into() };
    let copied = begin(folder).and_then(|fresh| {
        copy(rows, &fresh, applied).map_err(failed)?;
        match fresh.has_room() {
            true => Ok(fresh),
            false => Err(Error::file(folder.new_database())(io::ErrorKind::StorageFull.into())),
        }
    });
    match copied {
        Ok(fresh) => replace(folder).map(|()| fresh),
        Err(error) => {
            // The copy may take much of the missing space.
            discard(folder).map_err(Error::file(folder.new_database()))?;
            Err(error)
        }
    }
}

/// Creates a new database beside the old one.
pub(super) fn begin(folder: &Folder) -> Result<Open> {
    let path = folder.new_database();
    let failed =
        |source: redb::Error| Error::Storage { path: folder.path().to_owned(), source: source.into() };
    let disk = || {
        discard(folder)?;
        // The order matters: sums without a new database mean that the database has already replaced the old one.
        let rows = folder.open(&path)?;
        sync_folder(folder.path())?;
        let sums = Sums::open(folder.open(&folder.new_sums())?, &*rows)?;
        Ok(Disk::new(rows, sums))
    };
    Ok(Open::at(disk().map_err(Error::file(&path))?, false).map_err(failed)?.0)
}

fn copy(from: &Snapshot, to: &Open, applied: u64) -> Result<(), redb::Error> {
    let mut transaction = to.begin()?;
    for table in Table::ALL {
        let mut batch = Batch::of(&transaction)?;
        for row in from.from(table, &[])? {
            let (key, value) = row?;
            batch.put(table, &key, &value)?;
            if batch.changed_bytes() >= BATCH_BYTES {
                drop(batch.end());
                to.commit(transaction)?;
                transaction = to.begin()?;
                batch = Batch::of(&transaction)?;
            }
        }
        drop(batch.end());
    }
    to.commit_durably(transaction, applied)
}

/// Replaces the old database by the new one.
pub(super) fn replace(folder: &Folder) -> Result<()> {
    let swap = || {
        folder.rename(&folder.new_database(), &folder.database())?;
        folder.rename(&folder.new_sums(), &folder.sums())
    };
    swap().map_err(Error::file(folder.database()))
}

/// Completes or undoes a compaction that a kill interrupted.
pub(super) fn recover(folder: &Folder) -> Result<()> {
    let settle = || {
        if folder.has(&folder.new_sums()) && !folder.has(&folder.new_database()) {
            return folder.rename(&folder.new_sums(), &folder.sums());
        }
        discard(folder)
    };
    settle().map_err(Error::file(folder.new_database()))
}

/// Removes the new database. Its sums go first: alone, they would mean that the database has already
/// replaced the old one.
pub(super) fn discard(folder: &Folder) -> io::Result<()> {
    folder.remove(&folder.new_sums())?;
    folder.remove(&folder.new_database())
}
