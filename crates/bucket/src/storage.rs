//! The content of the folder: rows in one transactional database, and large bodies as files beside it.
//!
//! A read sees a snapshot ([`Storage::snapshot`]). Changes are functions ([`Storage::change`]) that run one after the
//! other. A result is returned once the change is on disk. Knows no protocol and no record.
//!
//! ```text
//! marker, lock    whose the folder is, and that one process uses it
//! database        rows: their durable state of some moment
//! database.sums   a checksum of each block of the database
//! journal         what changed since then
//! bodies/         bodies that are too large for a row, a file each
//! ```

mod bodies;
mod compaction;
#[cfg(test)]
mod damage;
mod database;
mod folder;
mod journal;
mod medium;
mod opening;
#[cfg(test)]
mod power;
mod salvage;
mod sums;
mod table;
mod writer;

use std::path::Path;
use std::sync::mpsc::{self, Sender};
use std::sync::{Arc, RwLock};
use std::thread::JoinHandle;
use std::time::Duration;

use redb::StorageError;
use tokio::sync::{Notify, oneshot};

use crate::{Error, Result};

pub(crate) use bodies::{Bodies, BodyId, NewBody, Pins};
pub use salvage::Damage;
pub(crate) use salvage::Salvage;
pub(crate) use table::{Batch, Row, Snapshot, Table, View};
pub(crate) use writer::{Kind, Unavailable};

use folder::Folder;
use opening::open;
use writer::{Change, Current, Message, RESERVE, Writer, read};

/// The time that a reader waits until a database with damage is open again.
const REOPENING: Duration = Duration::from_secs(2);

/// The row that counts the starts.
const RUN: &[u8] = b"run";

/// The storage of a folder, see the module. Clones share it.
#[derive(Clone)]
pub(crate) struct Storage {
    current: Current,
    bodies: Arc<Bodies>,
    messages: Sender<Message>,
    committed: Arc<Notify>,
}

/// The thread that writes.
pub(crate) struct Writing {
    thread: JoinHandle<()>,
    messages: Sender<Message>,
}

impl Storage {
    /// Opens the folder, which is created if missing.
    ///
    /// # Errors
    /// [`Error::DataInUse`], [`Error::NotOurs`], [`Error::Newer`], [`Error::File`], [`Error::Storage`].
    pub(crate) fn open(path: &Path) -> Result<(Self, Writing)> {
        Self::with_reserve(path, RESERVE)
    }

    /// Opens the folder, and leaves this many bytes of the disk free.
    fn with_reserve(path: &Path, reserve: u64) -> Result<(Self, Writing)> {
        Self::of_folder(Folder::take(path)?, reserve)
    }

    fn of_folder(mut folder: Folder, reserve: u64) -> Result<(Self, Writing)> {
        let path = folder.path().to_owned();
        let failed = |source: redb::Error| Error::Storage { path: path.clone(), source: source.into() };
        let (opened, mut journal) = open(&mut folder)?;
        let run = next_run(&opened, &mut journal).map_err(failed)?;
        let bodies = Arc::new(Bodies::new(folder.bodies(), run));
        let current: Current = Arc::new(RwLock::new(Ok(Arc::new(opened))));
        let committed = Arc::new(Notify::new());
        let (messages, waiting) = mpsc::channel();
        let ending = messages.clone();
        let writer = Writer {
            folder,
            bodies: bodies.clone(),
            current: current.clone(),
            journal,
            // The number is unknown, so compaction is checked at once.
            removed_bytes: u64::MAX / 2,
            reserve,
            on_commit: Box::new({
                let committed = committed.clone();
                move || committed.notify_one()
            }),
        };
        let thread = std::thread::Builder::new()
            .name("bucket-writer".to_owned())
            .spawn(move || writer.work(&waiting))
            .map_err(Error::file(&path))?;
        Ok((Self { current, bodies, messages, committed }, Writing { thread, messages: ending }))
    }

    /// Returns the current rows.
    ///
    /// # Errors
    /// Returns [`Unavailable::Failed`] if the database cannot be read.
    pub(crate) fn snapshot(&self) -> Result<Snapshot, Unavailable> {
        let mut open = read(&self.current).clone()?;
        if open.damage().is_some() {
            // The handle that read a damaged block answers nothing more. A new one can read the other blocks.
            let (reopened, wait) = mpsc::channel();
            self.messages.send(Message::Reopen(reopened)).map_err(|_| Unavailable::Ending)?;
            let _ = wait.recv_timeout(REOPENING);
            open = read(&self.current).clone()?;
        }
        open.kept_snapshot().map_err(|error| Unavailable::Failed(error.to_string().into()))
    }

    /// Runs a function on the tables, alone. When it returns, its changes are on disk. The function's value may
    /// say that it changed nothing, for example because a condition failed. If the function fails, everything in
    /// its batch is undone.
    ///
    /// # Errors
    /// [`Unavailable`]: nothing was changed. After a disk failure during the write, that is not certain.
    pub(crate) async fn change<T, F>(&self, kind: Kind, function: F) -> Result<T, Unavailable>
    where
        T: Send + 'static,
        F: FnOnce(&mut Batch<'_>) -> Result<T, StorageError> + Send + 'static,
    {
        let (answer, answered) = oneshot::channel();
        let change = Change { kind, function: Some(function), value: None, answer };
        self.messages.send(Message::Change(Box::new(change))).map_err(|_| Unavailable::Ending)?;
        answered.await.unwrap_or(Err(Unavailable::Ending))
    }

    /// Returns the store of large bodies.
    pub(crate) fn bodies(&self) -> &Arc<Bodies> {
        &self.bodies
    }

    /// Waits until something has changed since the last call.
    pub(crate) async fn changed(&self) {
        self.committed.notified().await;
    }

    /// Removes the bodies of killed runs to which no row refers. Returns their number.
    ///
    /// # Errors
    /// Returns [`Unavailable`] if the storage cannot be read.
    pub(crate) fn collect_orphans(&self) -> Result<u64, Unavailable> {
        let snapshot = self.snapshot()?;
        let collected = self.bodies.collect(|id| {
            snapshot.get(Table::Files, &id.key()).map(|row| row.is_some()).map_err(std::io::Error::other)
        });
        collected.map_err(|error| Unavailable::Failed(error.to_string().into()))
    }
}

impl Writing {
    /// Ends the changes. Returns when all earlier changes are on disk and the folder is free.
    pub(crate) fn end(self) {
        let _ = self.messages.send(Message::End);
        let _ = self.thread.join();
    }
}

/// Counts this start, durably: the ids of its bodies begin with the number.
fn next_run(open: &database::Open, journal: &mut journal::Journal) -> Result<u64, redb::Error> {
    let last = open.snapshot()?.get(Table::Settings, RUN)?;
    let run = last.and_then(|bytes| bytes.try_into().ok()).map_or(0, u64::from_be_bytes) + 1;
    let transaction = open.begin()?;
    let mut batch = Batch::of(&transaction)?;
    batch.put(Table::Settings, RUN, &run.to_be_bytes())?;
    let applied = batch.end();
    journal.append(&applied.changes)?;
    open.commit(transaction)?;
    Ok(run)
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    fn set(batch: &mut Batch<'_>, key: &str, value: &str) -> Result<(), StorageError> {
        batch.put(Table::Objects, key.as_bytes(), value.as_bytes())
    }

    fn value(storage: &Storage, key: &str) -> Option<String> {
        let value = storage.snapshot().unwrap().get(Table::Objects, key.as_bytes()).unwrap();
        value.map(|bytes| String::from_utf8(bytes).unwrap())
    }

    #[tokio::test]
    async fn what_was_changed_is_there_after_a_stop_and_after_a_kill() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        storage.change(Kind::Grows, |batch| set(batch, "stopped", "1")).await.unwrap();
        writing.end();
        assert!(matches!(storage.change(Kind::Grows, |_| Ok(())).await, Err(Unavailable::Ending)));

        let (storage, writing) = Storage::open(folder.path()).unwrap();
        storage.change(Kind::Grows, |batch| set(batch, "killed", "2")).await.unwrap();
        // A copy of the folder equals what a kill leaves: the thread has not caught up.
        let copy = tempfile::tempdir().unwrap();
        for name in ["rayfold-bucket", "database", "database.sums", "journal"] {
            std::fs::copy(folder.path().join(name), copy.path().join(name)).unwrap();
        }
        let (killed, ending) = Storage::open(copy.path()).unwrap();
        assert_eq!(value(&killed, "stopped").as_deref(), Some("1"));
        assert_eq!(value(&killed, "killed").as_deref(), Some("2"));
        ending.end();
        writing.end();
    }

    /// Returns the size of the journal's entries in bytes.
    fn journal(folder: &Path) -> u64 {
        std::fs::metadata(folder.join("journal")).unwrap().len() - 80
    }

    #[tokio::test]
    async fn the_journal_is_cleared_when_nothing_is_to_be_done_and_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let start = Instant::now();
        storage.change(Kind::Grows, |batch| set(batch, "a", "1")).await.unwrap();
        while journal(folder.path()) > 0 {
            assert!(start.elapsed() < Duration::from_secs(20), "it never catches up");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        // On a busy machine it may be later, but not sooner.
        assert!(start.elapsed() > Duration::from_millis(500), "it catches up while there may be more to do");
        storage.change(Kind::Grows, |batch| set(batch, "b", "2")).await.unwrap();
        writing.end();
        assert_eq!(journal(folder.path()), 0);
    }

    /// Under constant load the journal must not grow without limit.
    #[tokio::test]
    async fn a_journal_that_is_long_is_cleared_under_load() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let big = "x".repeat(1_000_000);
        for _ in 0..40 {
            let big = big.clone();
            storage.change(Kind::Grows, move |batch| set(batch, "same", &big)).await.unwrap();
            let length = journal(folder.path());
            assert!(length < 10_000_000, "{length} bytes");
        }
        writing.end();
    }

    #[tokio::test]
    async fn a_disk_that_is_nearly_full_takes_what_makes_room_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let put = async |storage: &Storage, key: &'static str| {
            storage.change(Kind::Grows, move |batch| set(batch, key, "1")).await
        };
        let remove = async |storage: &Storage, key: &'static str| {
            storage.change(Kind::Shrinks, move |batch| batch.remove(Table::Objects, key.as_bytes())).await
        };
        let (storage, writing) = Storage::with_reserve(folder.path(), 0).unwrap();
        put(&storage, "kept").await.unwrap();
        put(&storage, "deleted").await.unwrap();
        writing.end();

        let (storage, writing) = Storage::with_reserve(folder.path(), u64::MAX).unwrap();
        assert!(matches!(put(&storage, "new").await, Err(Unavailable::Full)));
        let (deleted, refused) = tokio::join!(remove(&storage, "deleted"), put(&storage, "new"));
        assert!(deleted.unwrap() && matches!(refused, Err(Unavailable::Full)));
        let values = ["kept", "deleted", "new"].map(|key| value(&storage, key));
        assert_eq!(values, [Some("1".to_owned()), None, None]);
        writing.end();

        let (storage, writing) = Storage::with_reserve(folder.path(), 0).unwrap();
        put(&storage, "new").await.unwrap();
        let values = ["kept", "deleted", "new"].map(|key| value(&storage, key));
        assert_eq!(values, [Some("1".to_owned()), None, Some("1".to_owned())]);
        writing.end();
    }

    #[tokio::test]
    async fn rows_and_changed_bytes_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let counts = storage.change(Kind::Grows, |batch| {
            let mut counts = vec![(batch.count(Table::Objects)?, batch.changed_bytes())];
            for key in ["a", "b", "c"] {
                set(batch, key, &"x".repeat(1_000))?;
                counts.push((batch.count(Table::Objects)?, batch.changed_bytes()));
            }
            Ok(counts)
        });
        let counts = counts.await.unwrap();
        assert_eq!(counts.iter().map(|(rows, _)| *rows).collect::<Vec<_>>(), [0, 1, 2, 3]);
        assert!(counts[0].1 == 0 && (3_000..3_200).contains(&counts[3].1), "{counts:?}");
        writing.end();
    }

    #[tokio::test]
    async fn a_change_sees_those_before_it_and_a_panic_undoes_only_its_batch() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let changes = (0..200).map(|_| {
            storage.change(Kind::Grows, |batch| {
                let last = batch.get(Table::Objects, b"count")?.map_or(0, |b| u64::from(b[0]));
                batch.put(Table::Objects, b"count", &[u8::try_from(last + 1).unwrap_or(0)])?;
                Ok(last)
            })
        });
        let seen = futures_util::future::join_all(changes).await;
        let mut seen: Vec<u64> = seen.into_iter().map(Result::unwrap).collect();
        seen.sort_unstable();
        assert_eq!(seen, (0..200).collect::<Vec<_>>());
        let panicked = storage.change(Kind::Grows, |batch| {
            set(batch, "half", "done")?;
            panic!("as meant by the test")
        });
        let panicked: Result<(), _> = panicked.await;
        assert!(matches!(panicked, Err(Unavailable::Failed(_))));
        storage.change(Kind::Grows, |batch| set(batch, "after", "1")).await.unwrap();
        assert_eq!((value(&storage, "half"), value(&storage, "after").as_deref()), (None, Some("1")));
        writing.end();
    }

    #[tokio::test]
    async fn a_database_that_failed_is_opened_anew_with_all_that_was_acknowledged() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        for round in 0..3 {
            let key = format!("kept-{round}");
            storage.change(Kind::Grows, move |batch| set(batch, &key, "1")).await.unwrap();
            // As after a failed write: nothing is written through this handle any more.
            read(&storage.current).as_ref().unwrap().kill();
            // A change that reaches the journal may or may not be acknowledged. An acknowledged one must be there.
            let key = format!("doubtful-{round}");
            let big = "x".repeat(100_000);
            let answer = storage
                .change(Kind::Grows, move |batch| {
                    for number in 0..600 {
                        set(batch, &format!("{key}-{number}"), &big)?;
                    }
                    Ok(())
                })
                .await;
            let doubtful = value(&storage, &format!("doubtful-{round}-599"));
            assert!(answer.is_err() || doubtful.is_some());
            storage.change(Kind::Grows, |batch| set(batch, "after", "1")).await.unwrap();
            for earlier in 0..=round {
                assert_eq!(value(&storage, &format!("kept-{earlier}")).as_deref(), Some("1"));
            }
        }
        writing.end();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        assert_eq!(value(&storage, "kept-2").as_deref(), Some("1"));
        writing.end();
    }

    #[tokio::test]
    async fn a_folder_of_format_1_goes_on_and_has_checksums_from_then_on() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        storage.change(Kind::Grows, |batch| set(batch, "database", "1")).await.unwrap();
        writing.end();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        storage.change(Kind::Grows, |batch| set(batch, "journal", "2")).await.unwrap();
        let earlier = tempfile::tempdir().unwrap();
        let path = |name: &str| earlier.path().join(name);
        std::fs::copy(folder.path().join("database"), path("database")).unwrap();
        let entries = journal::of_format_1(&folder.path().join("journal"));
        writing.end();
        std::fs::write(path("rayfold-bucket"), "format 1\n").unwrap();
        for damage in [true, false] {
            let mut bytes = entries.clone();
            if damage {
                // The bit is in the first of two entries.
                bytes[30] ^= 1;
            }
            std::fs::write(path("journal"), bytes).unwrap();
            let opened = Storage::open(earlier.path());
            if damage {
                assert!(matches!(opened, Err(Error::Damaged { offset: Some(0), .. })));
                assert!(!path("database.sums").exists());
                continue;
            }
            let (storage, writing) = opened.unwrap();
            let values = ["database", "journal"].map(|key| value(&storage, key));
            assert_eq!(values, [Some("1".to_owned()), Some("2".to_owned())]);
            writing.end();
        }
        assert_eq!(std::fs::read_to_string(path("rayfold-bucket")).unwrap(), "format 2\n");
        let (storage, writing) = Storage::open(earlier.path()).unwrap();
        assert_eq!(value(&storage, "journal").as_deref(), Some("2"));
        writing.end();
        std::fs::remove_file(path("database.sums")).unwrap();
        assert!(matches!(Storage::open(earlier.path()), Err(Error::Damaged { .. })));
        std::fs::remove_file(path("journal")).unwrap();
        assert!(matches!(Storage::open(earlier.path()), Err(Error::Damaged { .. })));
    }
}
