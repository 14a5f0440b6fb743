//! The writer, the only thread that changes rows. It commits all waiting changes as one batch with one sync.
//!
//! Changes are functions on the tables that run one after the other. Each sees the effects of those before it, so a
//! condition that it checks holds when it writes. A batch reaches the journal as a whole or not at all, and nothing
//! is acknowledged before. If the disk fails, the batch is lost, and the database is reopened from disk and journal.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::sync::{Arc, RwLock};
use std::time::{Duration, Instant};

use nix::sys::statvfs::statvfs;
use redb::StorageError;
use tokio::sync::oneshot;

use super::bodies::{Bodies, sync_names};
use super::compaction;
use super::database::{Open, is_full};
use super::folder::Folder;
use super::journal::Journal;
use super::opening::open;
use super::table::{Applied, Batch};
use crate::Error;

/// The largest number of changes in a batch: enough to share a sync, few enough that no change waits long.
const BATCH_JOBS: usize = 1000;

/// The largest size of the changed rows in a batch.
const BATCH_BYTES: usize = 8 * 1024 * 1024;

/// The idle time after which the database catches up with the journal.
const IDLE: Duration = Duration::from_millis(500);

/// The pause after a disk failure.
const RECOVERY_PAUSE: Duration = Duration::from_millis(200);

/// The free bytes reserved for changes that free space, and for the journal and the database while they catch up.
pub(super) const RESERVE: u64 = 64 * 1024 * 1024;

/// The reason why nothing was changed, or why that is not certain.
#[derive(Clone, Debug, thiserror::Error)]
pub(crate) enum Unavailable {
    /// There is no space on the disk.
    #[error("the disk is full")]
    Full,
    /// The disk failed, or the database is damaged.
    #[error("the storage failed: {0}")]
    Failed(Arc<str>),
    /// The store is shutting down.
    #[error("the store is ending")]
    Ending,
}

/// The effect of a change on the disk space, and whether a caller waits for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The change needs disk space.
    Grows,
    /// The change frees disk space, so it also runs when the disk is nearly full.
    Shrinks,
    /// No caller waits for it, and a kill may undo it.
    Lazy,
}

/// A change that waits for its batch.
pub(super) trait Job: Send {
    fn kind(&self) -> Kind;
    fn run(&mut self, batch: &mut Batch<'_>) -> Result<(), StorageError>;
    fn answer(self: Box<Self>, outcome: Result<(), Unavailable>);
}

/// A message to the writing thread.
pub(super) enum Message {
    Change(Box<dyn Job>),
    /// Reopen the database if it has damage, then drop the sender.
    Reopen(Sender<()>),
    /// Finish the earlier messages, then end.
    End,
}

/// A function on the tables, and the receiver of its result.
pub(super) struct Change<F, T> {
    pub(super) kind: Kind,
    pub(super) function: Option<F>,
    pub(super) value: Option<T>,
    pub(super) answer: oneshot::Sender<Result<T, Unavailable>>,
}

impl<F, T> Job for Change<F, T>
where
    F: FnOnce(&mut Batch<'_>) -> Result<T, StorageError> + Send,
    T: Send,
{
    fn kind(&self) -> Kind {
        self.kind
    }

    fn run(&mut self, batch: &mut Batch<'_>) -> Result<(), StorageError> {
        if let Some(function) = self.function.take() {
            self.value = Some(function(batch)?);
        }
        Ok(())
    }

    fn answer(self: Box<Self>, outcome: Result<(), Unavailable>) {
        let Self { value, answer, .. } = *self;
        // The caller may have gone.
        let _ = answer.send(outcome.and_then(|()| value.ok_or(Unavailable::Ending)));
    }
}

/// The database that readers use.
pub(super) type Current = Arc<RwLock<Result<Arc<Open>, Unavailable>>>;

/// The state of the writing thread, see the module.
pub(super) struct Writer {
    pub(super) folder: Folder,
    pub(super) bodies: Arc<Bodies>,
    pub(super) current: Current,
    pub(super) journal: Journal,
    /// The size of the rows removed or replaced since the last check for compaction.
    pub(super) removed_bytes: u64,
    /// The number of bytes that must stay free.
    pub(super) reserve: u64,
    pub(super) on_commit: Box<dyn Fn() + Send>,
}

impl Writer {
    /// Handles messages until the end. Leaves a database that has caught up.
    pub(super) fn work(mut self, messages: &Receiver<Message>) {
        let mut ending = false;
        while !ending {
            let first = match messages.recv_timeout(IDLE) {
                Ok(Message::Change(first)) => first,
                Ok(Message::Reopen(_asked)) => {
                    self.reopen_damaged();
                    continue;
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.catch_up_when(!self.journal.is_empty());
                    self.compact_when_sparse();
                    continue;
                }
                Ok(Message::End) | Err(RecvTimeoutError::Disconnected) => break,
            };
            let mut reopening = Vec::new();
            let more = std::iter::from_fn(|| match messages.try_recv() {
                Ok(Message::Change(job)) => Some(job),
                Ok(Message::Reopen(asked)) => {
                    reopening.push(asked);
                    None
                }
                Ok(Message::End) => {
                    ending = true;
                    None
                }
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => None,
            });
            self.batch(std::iter::once(first).chain(more).take(BATCH_JOBS));
            if !reopening.is_empty() {
                self.reopen_damaged();
            }
            self.catch_up_when(self.journal.is_long());
        }
        self.catch_up_when(!self.journal.is_empty());
    }

    fn batch(&mut self, jobs: impl Iterator<Item = Box<dyn Job>>) {
        let full = self.is_nearly_full();
        let mut run = Vec::new();
        let outcome = self.try_batch(jobs, full, &mut run);
        let outcome = outcome.map_err(|failed| match failed {
            Failure::Refused(reason) => reason,
            Failure::Database(error) => {
                let reason = reason(&error);
                self.open_anew();
                reason
            }
        });
        if outcome.is_ok() {
            (self.on_commit)();
        }
        for job in run {
            job.answer(outcome.clone());
        }
    }

    fn try_batch(
        &mut self,
        jobs: impl Iterator<Item = Box<dyn Job>>,
        full: bool,
        run: &mut Vec<Box<dyn Job>>,
    ) -> Result<(), Failure> {
        let opened = self.opened();
        let prepared = opened.and_then(|open| Ok((open.begin().map_err(Failure::Database)?, open)));
        let (transaction, open) = match prepared {
            Ok(prepared) => prepared,
            Err(failed) => {
                run.extend(jobs);
                return Err(failed);
            }
        };
        let full = full || !open.has_room();
        let mut batch = Batch::of(&transaction).map_err(Failure::Database)?;
        for mut job in jobs {
            if full && job.kind() == Kind::Grows {
                job.answer(Err(Unavailable::Full));
                continue;
            }
            let done = catch_unwind(AssertUnwindSafe(|| job.run(&mut batch)));
            run.push(job);
            match done {
                Ok(done) => done.map_err(|error| Failure::Database(error.into()))?,
                Err(_) => return Err(Failure::Refused(Unavailable::Failed("a change panicked".into()))),
            }
            if batch.changed_bytes() >= BATCH_BYTES {
                break;
            }
        }
        let Applied { changes, mut adopted, discarded, removed_bytes } = batch.end();
        if !open.has_room() {
            transaction.abort().map_err(|error| Failure::Database(error.into()))?;
            return Err(Failure::Refused(Unavailable::Full));
        }
        if changes.is_empty() {
            return transaction.abort().map_err(|error| Failure::Database(error.into()));
        }
        let is_awaited = is_awaited(run.iter().map(|job| job.kind()));
        let written = if is_awaited {
            sync_names(&adopted).and_then(|()| self.journal.append(&changes))
        } else {
            self.journal.defer(&changes);
            Ok(())
        };
        if let Err(failed) = written {
            transaction.abort().map_err(|error| Failure::Database(error.into()))?;
            return Err(Failure::Refused(reason(&failed.into())));
        }
        adopted.iter_mut().for_each(super::bodies::NewBody::keep);
        open.commit(transaction).map_err(Failure::Database)?;
        self.removed_bytes += removed_bytes;
        for id in discarded {
            self.bodies.remove(id);
        }
        Ok(())
    }

    /// Returns the open database. Tries to open it if the last attempt failed.
    fn opened(&mut self) -> Result<Arc<Open>, Failure> {
        let current = read(&self.current).clone();
        match current {
            Ok(open) => Ok(open),
            Err(_) => {
                std::thread::sleep(RECOVERY_PAUSE);
                self.open_anew();
                read(&self.current).clone().map_err(Failure::Refused)
            }
        }
    }

    /// Opens the database from its durable state and the journal on disk.
    fn open_anew(&mut self) {
        if let Ok(open) = read(&self.current).as_ref() {
            open.kill();
        }
        let opened = open(&mut self.folder).map(|(open, journal)| {
            self.journal = journal;
            Arc::new(open)
        });
        let mut current = self.current.write().unwrap_or_else(std::sync::PoisonError::into_inner);
        *current = opened.map_err(|error| match &error {
            Error::Storage { source, .. } => reason(source),
            Error::File { source, .. } if is_full(source) => Unavailable::Full,
            _ => Unavailable::Failed(error.to_string().into()),
        });
    }

    /// Compacts the database if it has shrunk by half.
    fn compact_when_sparse(&mut self) {
        let Ok(open) = read(&self.current).clone() else { return };
        let due = |bytes: u64| bytes >= compaction::SMALLEST && self.removed_bytes >= bytes / 2;
        if !self.journal.is_empty() || !open.file_bytes().is_ok_and(due) {
            return;
        }
        // If it fails, for example for lack of space, it is tried again after as much has been removed once more.
        self.removed_bytes = 0;
        if !open.is_sparse().unwrap_or_default() {
            return;
        }
        let Ok(rows) = open.snapshot() else { return };
        match compaction::compact(&self.folder, &rows, self.journal.last()) {
            Ok(compacted) => {
                let mut current = self.current.write().unwrap_or_else(std::sync::PoisonError::into_inner);
                *current = Ok(Arc::new(compacted));
            }
            // The new database may have replaced the open one.
            Err(_) => self.open_anew(),
        }
    }

    fn reopen_damaged(&mut self) {
        if read(&self.current).as_ref().is_ok_and(|open| open.damage().is_some()) {
            self.open_anew();
        }
    }

    fn catch_up_when(&mut self, due: bool) {
        if !due {
            return;
        }
        let Ok(open) = self.opened() else { return };
        if !open.has_room() {
            return;
        }
        let started = Instant::now();
        let done = open.begin().and_then(|transaction| open.commit_durably(transaction, self.journal.last()));
        match done {
            // If the journal cannot be cleared, its entries are skipped at the next start.
            Ok(()) if open.has_room() => drop(self.journal.clear()),
            Ok(()) => {}
            Err(_) => {
                self.open_anew();
                std::thread::sleep(RECOVERY_PAUSE.saturating_sub(started.elapsed()));
            }
        }
    }

    #[allow(clippy::useless_conversion, reason = "the width differs between systems")]
    fn is_nearly_full(&self) -> bool {
        statvfs(self.folder.path()).is_ok_and(|disk| {
            let free = u64::from(disk.blocks_available()).saturating_mul(disk.fragment_size());
            free < self.reserve
        })
    }
}

/// Returns whether a caller waits until these changes are on disk.
fn is_awaited(mut kinds: impl Iterator<Item = Kind>) -> bool {
    kinds.any(|kind| kind != Kind::Lazy)
}

enum Failure {
    /// The change was refused, and nothing was changed.
    Refused(Unavailable),
    /// The database must be reopened.
    Database(redb::Error),
}

fn reason(error: &redb::Error) -> Unavailable {
    if matches!(error, redb::Error::Io(failed) if is_full(failed)) {
        return Unavailable::Full;
    }
    Unavailable::Failed(error.to_string().into())
}

pub(super) fn read(current: &Current) -> std::sync::RwLockReadGuard<'_, Result<Arc<Open>, Unavailable>> {
    current.read().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_is_synced_if_anyone_waits_for_it() {
        use Kind::{Grows, Lazy, Shrinks};
        for (kinds, awaited) in [
            (vec![Lazy, Lazy], false),
            (vec![Lazy, Grows, Lazy], true),
            (vec![Shrinks], true),
            (vec![], false),
        ] {
            assert_eq!(is_awaited(kinds.iter().copied()), awaited, "{kinds:?}");
        }
    }
}
