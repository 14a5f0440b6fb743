//! Opens the journal and the database on disk, and checks that they belong together.
//!
//! The remains of an interrupted start or write are completed or removed. A file that is damaged, missing or
//! older than another is an error, and nothing is changed: bodies that a damaged file no longer names must not
//! be taken for garbage.

use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;

use super::bodies::sync_folder;
use super::compaction;
use super::database::{Disk, Open, is_full};
use super::folder::Folder;
use super::journal::{self, Contents, Journal};
use super::medium::Medium;
use super::sums::Sums;
use super::table::Batch;
use crate::{Error, Result};

/// Opens database and journal.
///
/// # Errors
/// [`Error::Damaged`], [`Error::File`] and [`Error::Storage`].
pub(super) fn open(folder: &mut Folder) -> Result<(Open, Journal)> {
    let format_1 = folder.is_of_format_1();
    let (journal_file, contents) = journal_of(folder)?;
    compaction::recover(folder)?;
    let disk = disk_of(folder)?;
    let (database, journal) = (folder.database(), folder.journal());
    let failed = |error: redb::Error| match disk.damage() {
        Some(offset) => folder.damaged(&database, Some(offset), "this block does not match its checksum"),
        None if is_damage(&error) => folder.damaged(&database, None, error.to_string()),
        None => Error::Storage { path: folder.path().to_owned(), source: error.into() },
    };
    disk.hold().map_err(Error::file(&database))?;
    let (open, applied) = Open::at(disk.clone(), format_1).map_err(&failed)?;
    if let Some(what) = contents.mismatch(applied) {
        return Err(folder.damaged(&journal, None, what));
    }
    let transaction = open.begin().map_err(&failed)?;
    let mut batch = Batch::of(&transaction).map_err(&failed)?;
    for (_, changes) in contents.entries().filter(|(number, _)| *number > applied) {
        batch.replay(changes).map_err(|error| failed(error.into()))?;
    }
    drop(batch.end());
    if format_1 {
        open.commit_durably(transaction, contents.last(applied)).map_err(&failed)?;
    } else {
        open.commit(transaction).map_err(&failed)?;
    }
    match disk.release() {
        // The store runs without space, but an upgrade of the format needs it.
        Err(error) if format_1 || !is_full(&error) => return Err(Error::file(&database)(error)),
        _ => {}
    }
    let resumed = contents.resume(journal_file, applied).map_err(Error::file(&journal))?;
    if format_1 {
        folder.upgraded()?;
    }
    Ok((open, resumed))
}

/// Returns the undamaged journal. Creates it on the first start.
fn journal_of(folder: &Folder) -> Result<(Arc<dyn Medium>, Contents)> {
    let path = folder.journal();
    let is_new = !folder.has(&path);
    let is_first_start = !has_rows(folder)? && !has_bodies(folder)?;
    if is_new && !is_first_start {
        return Err(folder.damaged(&path, None, "it is missing beside a database or bodies"));
    }
    let failed = |source| Error::File { path: path.clone(), source };
    let file = folder.open(&path).map_err(failed)?;
    let read = || journal::read(&*file, folder.is_of_format_1());
    let mut contents = read().map_err(failed)?;
    // The first start writes the journal before anything else, and may have been killed meanwhile.
    if is_first_start && contents.is_unfinished() && (is_new || !folder.is_of_format_1()) {
        Journal::create(file.clone(), 0).and_then(|_| sync_folder(folder.path())).map_err(failed)?;
        contents = read().map_err(failed)?;
    }
    match contents.faults.first() {
        Some(fault) => Err(folder.damaged(&path, Some(fault.offset), fault.what.clone())),
        None if is_first_start && (contents.base.is_none() || contents.last(0) > 0) => {
            let what = "it is missing or empty beside a journal that belongs to it";
            Err(folder.damaged(&folder.database(), None, what))
        }
        None => Ok((file, contents)),
    }
}

/// Returns the database's file with its sums.
fn disk_of(folder: &Folder) -> Result<Arc<Disk>> {
    let (database, path) = (folder.database(), folder.sums());
    if !has_rows(folder)? {
        if has_bodies(folder)? {
            return Err(folder.damaged(
                &database,
                None,
                "it is missing or empty beside bodies that belong to it",
            ));
        }
        // It is complete before it gets its name: the remains after a kill are no damage.
        drop(compaction::begin(folder)?);
        compaction::replace(folder)?;
    }
    if has_rows(folder)? && !folder.is_of_format_1() && !folder.has(&path) {
        return Err(folder.damaged(&path, None, "it is missing, and with it the checksums of the database"));
    }
    let open = || {
        let file = folder.open(&path)?;
        let rows = folder.open(&database)?;
        let sums = match folder.is_of_format_1() {
            true => Sums::compute(file, &*rows)?,
            false => Sums::open(file, &*rows)?,
        };
        Ok(Disk::new(rows, sums))
    };
    open().map_err(Error::file(&database))
}

/// Returns whether the error is about the content of the database's file, not about the disk.
fn is_damage(error: &redb::Error) -> bool {
    match error {
        redb::Error::Corrupted(_) | redb::Error::UpgradeRequired(_) => true,
        redb::Error::Io(error) => {
            matches!(error.kind(), io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof)
        }
        _ => false,
    }
}

/// Returns whether there is a database that is not empty.
fn has_rows(folder: &Folder) -> Result<bool> {
    let path = folder.database();
    let length = || if folder.has(&path) { folder.open(&path)?.len() } else { Ok(0) };
    Ok(length().map_err(Error::file(&path))? > 0)
}

/// Returns whether there are large bodies.
fn has_bodies(folder: &Folder) -> Result<bool> {
    let bodies = folder.bodies();
    let any = |path: &Path| -> io::Result<bool> {
        for folder in fs::read_dir(path)? {
            if fs::read_dir(folder?.path())?.next().is_some() {
                return Ok(true);
            }
        }
        Ok(false)
    };
    any(&bodies).map_err(Error::file(&bodies))
}
