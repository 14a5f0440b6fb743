//! The errors of the pipeline, sorted by the action that the caller may take.

use std::error::Error as StdError;

/// A cause from outside the crate: a store's client, or a decoder.
pub type Cause = Box<dyn StdError + Send + Sync + 'static>;

/// The pipeline's errors. Each names the object's key if there is one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages show what the fields hold")]
pub enum Error {
    /// There is no such object (404). A conditional put fails with it if the object that it should replace is gone.
    #[error("{key} does not exist")]
    NotFound { key: String },
    /// The condition of a put does not hold (412), because another write was first. That may be an earlier write of the
    /// same caller whose reply was lost.
    #[error("{key} is not as the write expected it")]
    PreconditionFailed { key: String },
    /// Another write to the same object is in progress (409). Nothing was written; try again.
    #[error("{key} is being written by someone else")]
    Conflict { key: String },
    /// The store is overloaded (503, 429). Nothing was done.
    #[error("the store is busy: {key}")]
    Throttled {
        /// The object's key or the listing's prefix.
        key: String,
        /// The error of the store.
        source: Cause,
    },
    /// The store has no space for the object (507). Nothing was done.
    #[error("the store has no room: {key}")]
    Full {
        /// The object's key.
        key: String,
        /// The error of the store.
        source: Cause,
    },
    /// The reply was lost (timeout, broken connection, 500). The request may or may not have taken effect.
    #[error("no answer from the store: {key}")]
    Ambiguous {
        /// The object's key or the listing's prefix.
        key: String,
        /// The error of the client.
        source: Cause,
    },
    /// The store refuses permanently: permissions, a missing bucket, a malformed request.
    #[error("the store refuses {key}")]
    Refused {
        /// The object's key or the listing's prefix.
        key: String,
        /// The error of the store.
        source: Cause,
    },
    /// An upload has more parts than the store accepts.
    #[error("{key} would be larger than {limit_gb} GB, the most that can be uploaded in parts")]
    TooLarge { key: String, limit_gb: u64 },
    /// The environment does not name the region of the bucket. No request was sent.
    #[error("found no AWS region: set AWS_REGION, or a region in the AWS profile")]
    NoRegion,
    /// A key that is not one of the pipeline's.
    #[error("{key}: {problem}")]
    Key {
        /// The key as it came.
        key: String,
        /// The rule that the value breaks.
        problem: &'static str,
    },
    /// An object of the pipeline that cannot be read back.
    #[error("{key} cannot be read")]
    Malformed {
        key: String,
        /// The error of the decoder.
        source: Cause,
    },
    /// A manifest that breaks its own rules was about to be written. It was not written.
    #[error("the manifest of {animation} would break the rule {rule}")]
    Invariant {
        animation: String,
        /// The name of the rule in [`crate::invariants`].
        rule: &'static str,
    },
    /// The work was stopped before the invocation's deadline.
    #[error("out of time: {what}")]
    OutOfTime {
        /// The action that failed.
        what: String,
    },
}

impl Error {
    /// Returns whether another write was first, so that the caller must read and decide again.
    pub fn is_conflict(&self) -> bool {
        matches!(self, Error::PreconditionFailed { .. } | Error::Conflict { .. })
    }

    /// There is no such object.
    pub fn is_not_found(&self) -> bool {
        matches!(self, Error::NotFound { .. })
    }

    /// Returns whether the same request may succeed later.
    pub fn is_retryable(&self) -> bool {
        use Error::{Ambiguous, Conflict, Full, Throttled};
        matches!(self, Conflict { .. } | Throttled { .. } | Full { .. } | Ambiguous { .. })
    }

    /// Returns whether it is unknown if the request took effect.
    pub fn is_ambiguous(&self) -> bool {
        matches!(self, Error::Ambiguous { .. })
    }

    /// The work was stopped before the invocation's deadline.
    pub fn is_out_of_time(&self) -> bool {
        matches!(self, Error::OutOfTime { .. })
    }

    pub(crate) fn key(key: &str, problem: &'static str) -> Self {
        Error::Key { key: key.to_owned(), problem }
    }
}

/// The result of the pipeline's functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Returns the answer, or `None` if the object does not exist.
///
/// # Errors
///
/// All errors but [`Error::NotFound`].
pub fn found<T>(answer: Result<T>) -> Result<Option<T>> {
    match answer {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.is_not_found() => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_error_says_what_may_be_done_about_it() {
        let (key, cause) = (|| "k".to_owned(), || Cause::from("why"));
        // A conflict, not found, retryable, ambiguous, out of time.
        for (error, expected) in [
            (Error::NotFound { key: key() }, [false, true, false, false, false]),
            (Error::PreconditionFailed { key: key() }, [true, false, false, false, false]),
            (Error::Conflict { key: key() }, [true, false, true, false, false]),
            (Error::Throttled { key: key(), source: cause() }, [false, false, true, false, false]),
            (Error::Full { key: key(), source: cause() }, [false, false, true, false, false]),
            (Error::Ambiguous { key: key(), source: cause() }, [false, false, true, true, false]),
            (Error::Refused { key: key(), source: cause() }, [false; 5]),
            (Error::NoRegion, [false; 5]),
            (Error::key("k", "p"), [false; 5]),
            (Error::Malformed { key: key(), source: cause() }, [false; 5]),
            (Error::Invariant { animation: key(), rule: "r" }, [false; 5]),
            (Error::OutOfTime { what: key() }, [false, false, false, false, true]),
        ] {
            let says = [
                error.is_conflict(),
                error.is_not_found(),
                error.is_retryable(),
                error.is_ambiguous(),
                error.is_out_of_time(),
            ];
            assert_eq!(says, expected, "{error:?}");
        }
    }

    #[test]
    fn what_is_not_there_is_no_error() {
        assert_eq!(found(Ok(1)).unwrap(), Some(1));
        assert_eq!(found::<()>(Err(Error::NotFound { key: "k".to_owned() })).unwrap(), None);
        assert!(matches!(found::<()>(Err(Error::NoRegion)), Err(Error::NoRegion)));
    }
}
