//! A database whose rows have mostly gone is written anew, into a smaller file.
//!
//! The copy is complete and on the disk before it takes the place of the database; its sums follow. Whoever reads the database
//! at that time goes on reading the old file.

use std::io;

use super::bodies::sync_folder;
use super::database::{Disk, Open};
use super::folder::Folder;
use super::sums::Sums;
use super::table::{Batch, Snapshot, Table, View};
use crate::{Error, Result};

/// Smaller databases are left alone.
pub(super) const SMALLEST: u64 = 4 * 1024 * 1024;

/// Bytes of rows in one transaction of the copy.
const BATCH_BYTES: usize = 8 * 1024 * 1024;

/// Copies the rows into a fresh database that holds the changes up to entry `applied`, and puts it in the place of the old one.
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
            // It may hold much of the room that is missing.
            discard(folder).map_err(Error::file(folder.new_database()))?;
            Err(error)
        }
    }
}

/// A fresh database beside the old one.
pub(super) fn begin(folder: &Folder) -> Result<Open> {
    let path = folder.new_database();
    let failed =
        |source: redb::Error| Error::Storage { path: folder.path().to_owned(), source: source.into() };
    let disk = || {
        discard(folder)?;
        // In this order: sums without a new database are those of one that took its place.
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

/// Puts the new database in the place of the old one.
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

/// Removes the new database. Its sums go first: without it they would be taken for those of one that took its place.
pub(super) fn discard(folder: &Folder) -> io::Result<()> {
    folder.remove(&folder.new_sums())?;
    folder.remove(&folder.new_database())
}
