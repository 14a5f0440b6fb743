//! Salvage: reads the readable rows of a damaged folder into a new database beside it.
//!
//! Blocks of the database are compared as always, and rows in blocks that do not match are left out. A table is read
//! from its start and from its end. Rows between damaged places are searched by keys halfway.

use std::collections::VecDeque;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use redb::StorageError;

use super::bodies::{Bodies, BodyId, sync_folder};
use super::compaction;
use super::database::{Disk, Open};
use super::folder::Folder;
use super::journal::{self, Journal};
use super::sums::Sums;
use super::table::{Batch, Snapshot, Table, View};
use crate::{Error, Result};

/// The number of times that a table is bisected to find rows between damaged blocks: in total, and since the
/// last row was found.
const MAX_CUTS: usize = 200;
const MAX_VAIN_CUTS: usize = 30;

/// A finding of damage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// The file, or the object as `bucket/key`.
    pub place: String,
    /// A description of the damage.
    pub what: String,
}

/// A folder whose readable rows are in a new database beside the old one. Nothing else was changed.
pub(crate) struct Salvage {
    folder: Folder,
    fresh: Open,
    last: u64,
    bodies: Arc<Bodies>,
    /// The places that could not be read.
    pub(crate) damages: Vec<Damage>,
}

impl Salvage {
    /// Reads the folder of a stopped store.
    ///
    /// # Errors
    /// The errors of [`super::Storage::open`] except damage.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let folder = Folder::take_existing(path)?;
        let mut damages = Vec::new();
        let mut damage = |place: &Path, what: String| {
            damages.push(Damage { place: place.display().to_string(), what });
        };
        let (database, journal) = (folder.database(), folder.journal());
        let contents = match folder.has(&journal) {
            true => {
                let file = folder.open(&journal).map_err(Error::file(&journal))?;
                Some(journal::read(&*file, folder.is_of_format_1()).map_err(Error::file(&journal))?)
            }
            false => {
                damage(&journal, "it is missing".to_owned());
                None
            }
        };
        for fault in contents.iter().flat_map(|contents| &contents.faults) {
            damage(&journal, format!("at byte {}: {}", fault.offset, fault.what));
        }
        compaction::recover(&folder)?;
        let fresh = compaction::begin(&folder)?;
        if folder.has(&database) && !folder.has(&folder.sums()) && !folder.is_of_format_1() {
            damage(&folder.sums(), "it is missing".to_owned());
        }
        let failed =
            |source: redb::Error| Error::Storage { path: folder.path().to_owned(), source: source.into() };
        let applied = match Old::of(&folder) {
            Ok(mut old) => {
                for table in Table::ALL {
                    let lost = old.copy(table, &fresh).map_err(failed)?;
                    for (after, before) in lost {
                        damage(
                            &database,
                            format!("rows of {table:?} between {after} and {before} cannot be read"),
                        );
                    }
                }
                for at in &old.damaged {
                    damage(&database, format!("the block at byte {at} does not match its checksum"));
                }
                if old.damaged.is_empty()
                    && let Err(what) = old.copy.reopen(false)
                {
                    damage(&database, what);
                }
                old.applied
            }
            Err(what) => {
                damage(&database, what);
                0
            }
        };
        if let Some(what) = contents.as_ref().and_then(|contents| contents.mismatch(applied)) {
            damage(&journal, what);
        }
        let transaction = fresh.begin().map_err(failed)?;
        let mut batch = Batch::of(&transaction).map_err(failed)?;
        for (number, changes) in contents.iter().flat_map(|contents| contents.entries()) {
            if number > applied {
                batch.replay(changes).map_err(|error| failed(error.into()))?;
            }
        }
        let run = last_run(&batch, &folder).map_err(failed)?;
        if run > 0 && batch.get(Table::Settings, super::RUN).map_err(|error| failed(error.into()))?.is_none()
        {
            batch
                .put(Table::Settings, super::RUN, &run.to_be_bytes())
                .map_err(|error| failed(error.into()))?;
        }
        drop(batch.end());
        fresh.commit(transaction).map_err(failed)?;
        let last = contents.as_ref().map_or(applied, |contents| contents.last(applied));
        let bodies = Arc::new(Bodies::new(folder.bodies(), 0));
        Ok(Self { folder, fresh, last, bodies, damages })
    }

    /// Returns the readable rows.
    ///
    /// # Errors
    /// Returns [`Error::Storage`] if the new database cannot be read.
    pub(crate) fn rows(&self) -> Result<Snapshot> {
        self.fresh.snapshot().map_err(|source| self.failed(source))
    }

    /// Returns the store of large bodies.
    pub(crate) fn bodies(&self) -> &Arc<Bodies> {
        &self.bodies
    }

    /// Changes the rows that are kept.
    ///
    /// # Errors
    /// Returns [`Error::Storage`] if the new database cannot be written.
    pub(crate) fn change(
        &self,
        function: impl FnOnce(&mut Batch<'_>) -> Result<(), StorageError>,
    ) -> Result<()> {
        let change = || {
            let transaction = self.fresh.begin()?;
            let mut batch = Batch::of(&transaction)?;
            function(&mut batch)?;
            drop(batch.end());
            self.fresh.commit(transaction)
        };
        change().map_err(|source| self.failed(source))
    }

    /// Creates a new folder inside the store for damaged files.
    ///
    /// # Errors
    /// Returns [`Error::File`] if it cannot be created.
    pub(crate) fn aside(&self) -> Result<PathBuf> {
        let free = (1..)
            .map(|number| self.folder.path().join(format!("set-aside-{number}")))
            .find(|path| !path.exists());
        let path = free.unwrap_or_default();
        crate::private::make(&path).map_err(Error::file(&path))?;
        Ok(path)
    }

    /// Replaces the database and the journal, which are kept in `aside`, by the readable rows. After a kill in
    /// between, a repair can be started again.
    ///
    /// # Errors
    /// The errors [`Error::File`] and [`Error::Storage`].
    pub(crate) fn keep(mut self, aside: &Path) -> Result<()> {
        let transaction = self.fresh.begin().map_err(|source| self.failed(source))?;
        self.fresh.commit_durably(transaction, self.last).map_err(|source| self.failed(source))?;
        let link = || {
            for file in [self.folder.journal(), self.folder.database(), self.folder.sums()] {
                if let Some(name) = file.file_name().filter(|_| file.exists()) {
                    fs::hard_link(&file, aside.join(name))?;
                }
            }
            sync_folder(aside)
        };
        link().map_err(Error::file(aside))?;
        compaction::replace(&self.folder)?;
        let journal = self.folder.journal();
        let new = self.folder.path().join("journal.new");
        let create = || {
            Journal::create(self.folder.open(&new)?, self.last)?;
            self.folder.rename(&new, &journal)
        };
        create().map_err(Error::file(&journal))?;
        self.folder.upgraded()
    }

    /// Discards the new database and leaves everything unchanged.
    ///
    /// # Errors
    /// Returns [`Error::File`] if it cannot be removed.
    pub(crate) fn leave(self) -> Result<()> {
        drop(self.fresh);
        compaction::discard(&self.folder).map_err(Error::file(self.folder.new_database()))
    }

    fn failed(&self, source: redb::Error) -> Error {
        Error::Storage { path: self.folder.path().to_owned(), source: source.into() }
    }
}

/// Returns the last run that assigned an id which is still in use.
fn last_run(batch: &Batch<'_>, folder: &Folder) -> std::result::Result<u64, redb::Error> {
    let mut run = 0;
    for table in [Table::Bodies, Table::Files, Table::Layouts, Table::Outbox] {
        for row in batch.from(table, b"")? {
            run = run.max(BodyId::of_key(&row?.0).map_or(0, BodyId::run));
        }
    }
    let files = Bodies::new(folder.bodies(), 0).files()?;
    Ok(files.into_iter().filter_map(|(_, id)| id).map(BodyId::run).fold(run, u64::max))
}

/// A copy of a damaged database, which is reopened after each damaged block.
struct Old {
    // Its files are deleted with it.
    copy: Copy,
    disk: Arc<Disk>,
    rows: Snapshot,
    applied: u64,
    /// The damaged blocks that were found.
    damaged: Vec<u64>,
}

struct Copy {
    database: PathBuf,
    sums: PathBuf,
    format_1: bool,
}

impl Drop for Copy {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.database);
        let _ = fs::remove_file(&self.sums);
    }
}

/// The bounds of rows that cannot be read, for messages.
type Lost = (String, String);

impl Old {
    fn of(folder: &Folder) -> std::result::Result<Self, String> {
        let (database, sums) = (folder.database(), folder.sums());
        let copy = Copy {
            database: folder.path().join("check.database"),
            sums: folder.path().join("check.database.sums"),
            format_1: folder.is_of_format_1() || !sums.exists(),
        };
        let copied = fs::copy(&database, &copy.database).and_then(|_| match copy.format_1 {
            true => Ok(0),
            false => fs::copy(&sums, &copy.sums),
        });
        copied.map_err(|error| error.to_string())?;
        let (disk, rows, applied) = copy.open(folder)?;
        Ok(Self { copy, disk, rows, applied, damaged: Vec::new() })
    }

    /// Copies the readable rows of a table. Returns the bounds of the unreadable ones.
    fn copy(&mut self, table: Table, to: &Open) -> std::result::Result<Vec<Lost>, redb::Error> {
        let mut lost = Vec::new();
        let mut ranges = VecDeque::from([(Vec::new(), None::<Vec<u8>>)]);
        let (mut cuts, mut vain) = (0, 0);
        while let Some((mut from, mut before)) = ranges.pop_front() {
            let whole = (from.clone(), before.clone());
            if self.read(table, &mut from, &mut before, to, false)?
                || self.read(table, &mut from, &mut before, to, true)?
            {
                vain = 0;
                continue;
            }
            vain = if (&from, &before) == (&whole.0, &whole.1) { vain + 1 } else { 0 };
            let goes_on = cuts < MAX_CUTS && vain < MAX_VAIN_CUTS;
            match halfway(&from, before.as_deref()).filter(|_| goes_on) {
                Some(middle) => {
                    cuts += 1;
                    ranges.push_back((from, Some(middle.clone())));
                    ranges.push_back((middle, before));
                }
                None => lost.push((from, before)),
            }
        }
        lost.sort();
        // Adjacent gaps are merged.
        lost.dedup_by(|next, last| {
            let touches = last.1.as_ref() == Some(&next.0);
            if touches {
                last.1.clone_from(&next.1);
            }
            touches
        });
        let shown = |key: &[u8]| format!("`{}`", String::from_utf8_lossy(key).escape_debug());
        let end = |before: Option<Vec<u8>>| before.map_or_else(|| "the end".to_owned(), |key| shown(&key));
        Ok(lost.into_iter().map(|(from, before)| (shown(&from), end(before))).collect())
    }

    /// Copies rows from one end of a range up to a damaged block. Returns whether it reached the other end. The range
    /// shrinks to the rest.
    fn read(
        &mut self,
        table: Table,
        from: &mut Vec<u8>,
        before: &mut Option<Vec<u8>>,
        to: &Open,
        backwards: bool,
    ) -> std::result::Result<bool, redb::Error> {
        let transaction = to.begin()?;
        let mut batch = Batch::of(&transaction)?;
        let mut whole = false;
        {
            let opened = self.rows.opened(table);
            let range = match &before {
                Some(before) => opened.range::<&[u8]>(from.as_slice()..before.as_slice()),
                None => opened.range::<&[u8]>(from.as_slice()..),
            };
            if let Ok(mut range) = range {
                loop {
                    // A damaged block that was read when the database was opened may have corrupted its state.
                    let next = catch_unwind(AssertUnwindSafe(|| {
                        if backwards { range.next_back() } else { range.next() }
                    }));
                    let Ok(next) = next else { break };
                    match next {
                        None => whole = true,
                        Some(Ok((key, value))) => {
                            batch.put(table, key.value(), value.value())?;
                            match backwards {
                                true => *before = Some(key.value().to_vec()),
                                false => *from = [key.value(), b"\0"].concat(),
                            }
                            continue;
                        }
                        Some(Err(_)) => {}
                    }
                    break;
                }
            }
        }
        drop(batch.end());
        to.commit(transaction)?;
        if !whole {
            self.damaged.extend(self.disk.damage().filter(|at| !self.damaged.contains(at)));
            if let Ok((disk, rows, _)) = self.copy.reopen(true) {
                (self.disk, self.rows) = (disk, rows);
            }
        }
        Ok(whole)
    }
}

impl Copy {
    fn open(&self, folder: &Folder) -> std::result::Result<(Arc<Disk>, Snapshot, u64), String> {
        if self.format_1 {
            let compute = || {
                let sums = folder.open(&self.sums)?;
                Sums::compute(sums, &*folder.open(&self.database)?)
            };
            compute().map_err(|error| error.to_string())?;
        }
        self.reopen(true)
    }

    /// Opens the database. With `lenient`, its own records are not checked, only the rows.
    fn reopen(&self, lenient: bool) -> std::result::Result<(Arc<Disk>, Snapshot, u64), String> {
        use super::medium::{Files, SystemFiles};
        let open = || {
            let rows = SystemFiles.open(&self.database)?;
            let sums = Sums::open(SystemFiles.open(&self.sums)?, &*rows)?;
            let disk = Disk::new(rows, sums);
            disk.set_lenient(lenient);
            // There is no cache, so that each read is compared.
            let (open, applied) = Open::with_cache(disk.clone(), !lenient, 0)?;
            let rows = Arc::new(open).kept_snapshot()?;
            disk.set_lenient(false);
            Ok((disk, rows, applied))
        };
        let opened = catch_unwind(AssertUnwindSafe(open));
        let opened =
            opened.map_err(|_| "it cannot be opened: its records of itself are damaged".to_owned())?;
        opened.map_err(|error: redb::Error| format!("it cannot be opened: {error}"))
    }
}

/// Returns a key between two others, if there is one that is not too long.
fn halfway(from: &[u8], before: Option<&[u8]>) -> Option<Vec<u8>> {
    let length = from.len().max(before.map_or(0, <[u8]>::len)).min(1100) + 2;
    let digit = |key: &[u8], at: usize| u32::from(key.get(at).copied().unwrap_or_default());
    // Adds from the last digit on. A missing upper bound is 1 followed by zeros.
    let mut sum = vec![0; length];
    let mut carry = 0;
    for at in (0..length).rev() {
        let digits = digit(from, at) + before.map_or(0, |key| digit(key, at)) + carry;
        sum[at] = digits & 0xff;
        carry = digits >> 8;
    }
    carry += u32::from(before.is_none());
    let mut middle = Vec::with_capacity(length);
    for digit in sum {
        let halved = carry << 8 | digit;
        middle.push(u8::try_from(halved / 2).unwrap_or(u8::MAX));
        carry = halved % 2;
    }
    // The key is shortened, because short keys are easier to read.
    let differs = (0..length).find(|at| digit(&middle, *at) != digit(from, *at))?;
    middle.truncate(differs + 1);
    (middle.as_slice() > from && before.is_none_or(|before| middle.as_slice() < before)).then_some(middle)
}

#[cfg(test)]
mod tests {
    use super::halfway;

    #[test]
    fn a_key_halfway_lies_between_two() {
        assert_eq!(halfway(b"", None), Some(vec![0x80]));
        assert_eq!(halfway(b"a", Some(b"c")), Some(b"b".to_vec()));
        assert_eq!(halfway(b"a", Some(b"a\0")), None);
        let (mut from, before) = (b"films\0scripts/1".to_vec(), b"films\0scripts/2".to_vec());
        for _ in 0..12 {
            let middle = halfway(&from, Some(&before)).unwrap();
            assert!(middle > from && middle < before, "{middle:?}");
            from = middle;
        }
    }
}
