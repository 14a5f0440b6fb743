//! What the invoker saw, for those who show, count or test it.

use std::time::{Duration, Instant};

use serde::Serialize;
use tokio::sync::mpsc::UnboundedSender;

use crate::routes::Function;

/// Something that happened, and when.
#[derive(Clone, Debug)]
pub struct Observation {
    /// On the machine's steady clock.
    pub at: Instant,
    /// What.
    pub seen: Seen,
}

/// What can happen.
#[derive(Clone, Debug)]
pub enum Seen {
    /// The store reported a change of an object; `function` is whom it wakes, if any.
    Event {
        /// Whom it wakes.
        function: Option<Function>,
        /// S3's name of what happened.
        name: String,
        /// The object's key.
        key: String,
    },
    /// An invocation was handed to a process.
    Started(Attempt),
    /// A process is about to send a request to the store.
    Requested {
        /// For which invocation.
        attempt: Attempt,
        /// What for.
        request: StoreRequest,
    },
    /// An invocation came to its end.
    Finished {
        /// Which.
        attempt: Attempt,
        /// How.
        outcome: Outcome,
        /// From the handing out to the end.
        took: Duration,
        /// From the process's start to its first call of `next`, for a cold start.
        init: Option<Duration>,
        /// Sent to the store meanwhile.
        requests: Requests,
    },
    /// A process wrote a line.
    Log {
        /// Of which function.
        function: Function,
        /// Without its end.
        line: String,
    },
    /// A message of the failure queue was given up.
    DeadLetter {
        /// Its body.
        body: String,
    },
}

/// One try of one invocation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attempt {
    /// Of which function.
    pub function: Function,
    /// The same for all tries of an event.
    pub request_id: String,
    /// From 1.
    pub number: u32,
    /// Of the process.
    pub pid: u32,
}

/// How an attempt ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// With an answer.
    Succeeded(String),
    /// With an error that the function reported.
    Failed(String),
    /// Without a word: the process ended.
    Crashed(String),
    /// At the deadline.
    TimedOut,
}

impl Outcome {
    /// The function's answer was good.
    pub fn is_success(&self) -> bool {
        matches!(self, Self::Succeeded(_))
    }
}

/// A request to the store, as it is billed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoreRequest {
    /// What it is.
    pub kind: RequestKind,
    /// Decoded, without the bucket; the prefix for a listing.
    pub key: String,
}

/// The kinds of requests that are counted apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequestKind {
    /// GET and HEAD of an object.
    Get,
    /// PUT, and the parts and ends of a multipart upload.
    Put,
    /// A page of a listing.
    List,
    /// DELETE, which is free of charge.
    Delete,
}

/// How many of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Requests {
    /// Of [`RequestKind::Get`].
    pub get: u64,
    /// Of [`RequestKind::Put`].
    pub put: u64,
    /// Of [`RequestKind::List`].
    pub list: u64,
    /// Of [`RequestKind::Delete`].
    pub delete: u64,
}

impl Requests {
    /// Those that S3 bills.
    pub fn billed(&self) -> u64 {
        self.get + self.put + self.list
    }

    pub(crate) fn count(&mut self, kind: RequestKind) {
        *match kind {
            RequestKind::Get => &mut self.get,
            RequestKind::Put => &mut self.put,
            RequestKind::List => &mut self.list,
            RequestKind::Delete => &mut self.delete,
        } += 1;
    }
}

impl std::ops::AddAssign for Requests {
    fn add_assign(&mut self, other: Self) {
        self.get += other.get;
        self.put += other.put;
        self.list += other.list;
        self.delete += other.delete;
    }
}

/// Whoever listens, if anyone.
#[derive(Clone, Debug)]
pub(crate) struct Observer(pub(crate) Option<UnboundedSender<Observation>>);

impl Observer {
    pub(crate) fn see(&self, seen: Seen) {
        if let Some(listener) = &self.0 {
            // One who has stopped listening has no need to know.
            let _ = listener.send(Observation { at: Instant::now(), seen });
        }
    }
}
