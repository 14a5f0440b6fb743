//! The invoker's observations, for display, statistics and tests.

use std::time::{Duration, Instant};

use serde::Serialize;
use tokio::sync::mpsc::UnboundedSender;

use crate::routes::Function;

/// An observation and its time.
#[derive(Clone, Debug)]
pub struct Observation {
    /// The time of the machine's monotonic clock.
    pub at: Instant,
    /// The kind of observation.
    pub seen: Seen,
}

/// A kind of observation.
#[derive(Clone, Debug)]
pub enum Seen {
    /// The store sent an event for a change of an object.
    Event {
        /// The function that the event invokes, if any.
        function: Option<Function>,
        /// S3's name of the event.
        name: String,
        /// The key of the changed object.
        key: String,
    },
    /// An invocation was assigned to a process.
    Started(Attempt),
    /// A process is about to send a request to the store.
    Requested {
        /// The attempt that sends it.
        attempt: Attempt,
        /// The class of the request.
        request: StoreRequest,
    },
    /// An invocation ended.
    Finished {
        /// The attempt that ended.
        attempt: Attempt,
        /// The outcome of the attempt.
        outcome: Outcome,
        /// The time from the assignment to the end.
        took: Duration,
        /// The time from the process's start to its first call of `next`, for a cold start.
        init: Option<Duration>,
        /// The requests sent to the store in between.
        requests: Requests,
    },
    /// A process wrote a line.
    Log {
        /// The function of the process.
        function: Function,
        /// The line without its line break.
        line: String,
    },
    /// Another invoker has come, with which the events of the bucket are shared.
    Joined {
        /// The name of that invoker.
        invoker: String,
    },
    /// Another invoker has gone.
    Lost {
        /// The name of that invoker.
        invoker: String,
    },
    /// A message of the failure queue was given up.
    DeadLetter {
        /// The body of the message.
        body: String,
    },
}

/// An attempt at an invocation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attempt {
    /// The function that was invoked.
    pub function: Function,
    /// The request id, which is the same for all attempts at an event.
    pub request_id: String,
    /// The number of the attempt, from 1.
    pub number: u32,
    /// The id of the process.
    pub pid: u32,
}

/// The outcome of an attempt.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The function returned this response.
    Succeeded(String),
    /// The function reported this error.
    Failed(String),
    /// The process ended without a report.
    Crashed(String),
    /// The attempt reached its deadline.
    TimedOut,
}

impl Outcome {
    /// Returns whether the function succeeded.
    pub fn is_success(&self) -> bool {
        matches!(self, Self::Succeeded(_))
    }
}

/// A request to the store, as S3 bills it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoreRequest {
    /// The kind of request.
    pub kind: RequestKind,
    /// The decoded key without the bucket; the prefix for a listing.
    pub key: String,
}

/// A kind of request that is counted separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequestKind {
    /// GET and HEAD of an object.
    Get,
    /// PUT, and the parts and the completion of a multipart upload.
    Put,
    /// A page of a listing.
    List,
    /// DELETE, which is free of charge.
    Delete,
}

/// The number of requests of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Requests {
    /// The number of [`RequestKind::Get`].
    pub get: u64,
    /// The number of [`RequestKind::Put`].
    pub put: u64,
    /// The number of [`RequestKind::List`].
    pub list: u64,
    /// The number of [`RequestKind::Delete`].
    pub delete: u64,
}

impl Requests {
    /// Returns the number of requests that S3 bills.
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

/// The receiver of observations, if there is one.
#[derive(Clone, Debug)]
pub(crate) struct Observer(pub(crate) Option<UnboundedSender<Observation>>);

impl Observer {
    pub(crate) fn see(&self, seen: Seen) {
        if let Some(listener) = &self.0 {
            // The receiver may have been dropped.
            let _ = listener.send(Observation { at: Instant::now(), seen });
        }
    }
}
