//! Invocations in progress: the queued ones with their callers, the number of unfinished ones, and those that failed
//! for good.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use bytes::Bytes;
use tokio::sync::{Notify, mpsc, oneshot};

use crate::observation::Outcome;
use crate::routes::Function;

/// An invocation on its way.
pub(crate) struct Job {
    pub(crate) request_id: String,
    pub(crate) payload: Bytes,
    pub(crate) attempt: u32,
    pub(crate) caller: Caller,
}

/// The receiver of the outcome.
pub(crate) enum Caller {
    /// The receiver of the result. Without one, a failed event is tried again, and finally delivered to the failure
    /// queue.
    Event,
    /// The caller that waits for the result, and decides about further attempts.
    Waiting(oneshot::Sender<Outcome>),
}

impl Job {
    pub(crate) fn event(payload: impl Into<Bytes>) -> Self {
        Self { request_id: random_id(), payload: payload.into(), attempt: 1, caller: Caller::Event }
    }
}

/// A handle to a pool. The pool's tasks end when the last handle is dropped and the invoker's tasks are aborted.
#[derive(Clone)]
pub(crate) struct Pool {
    jobs: mpsc::UnboundedSender<Job>,
    pending: Pending,
}

impl Pool {
    pub(crate) fn new(jobs: mpsc::UnboundedSender<Job>, pending: Pending) -> Self {
        Self { jobs, pending }
    }

    pub(crate) fn submit(&self, job: Job) {
        self.pending.add();
        if self.jobs.send(job).is_err() {
            self.pending.remove();
        }
    }
}

/// The number of invocations that are queued, running, or waiting for another attempt, over all pools.
#[derive(Clone, Default)]
pub(crate) struct Pending(Arc<(AtomicUsize, Notify)>);

impl Pending {
    pub(crate) fn add(&self) {
        self.0.0.fetch_add(1, Ordering::SeqCst);
    }

    pub(crate) fn remove(&self) {
        if self.0.0.fetch_sub(1, Ordering::SeqCst) == 1 {
            self.0.1.notify_waiters();
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.0.0.load(Ordering::SeqCst)
    }

    /// Returns when there are none.
    pub(crate) async fn none(&self) {
        loop {
            let changed = self.0.1.notified();
            if self.count() == 0 {
                return;
            }
            tokio::select! {
                () = changed => {}
                () = tokio::time::sleep(Duration::from_millis(50)) => {}
            }
        }
    }
}

/// An event that failed in every try.
pub(crate) struct Failure {
    pub(crate) function: Function,
    pub(crate) request_id: String,
    pub(crate) payload: Bytes,
    pub(crate) attempts: u32,
    pub(crate) outcome: Outcome,
}

/// An identifier in the shape of a version-4 UUID.
pub(crate) fn random_id() -> String {
    let bits = fastrand::u128(..) & !(0xf000 << 64) & !(0xc << 60) | (0x4000 << 64) | (0x8 << 60);
    let hex = format!("{bits:032x}");
    [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]].join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_version_4_uuids() {
        let id = random_id();
        let parts: Vec<&str> = id.split('-').collect();
        assert_eq!(parts.iter().map(|part| part.len()).collect::<Vec<_>>(), [8, 4, 4, 4, 12]);
        assert!(parts[2].starts_with('4') && parts[3].starts_with(['8', '9', 'a', 'b']), "{id}");
        assert_ne!(id, random_id());
    }
}
