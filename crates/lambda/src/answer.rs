//! The answer of a function: an outcome per record, or a failure that makes the platform retry.
//!
//! An error that would be the same at the next try (a bad script, a key of no interest, an unreadable event) is
//! recorded and is no failure. Only a transient error is a failure, and then the whole batch comes again. Records that
//! are already done then cost a few requests and no work.

use rayfold_pipeline::Error;
use serde::Serialize;

/// The answer to a call that the platform need not repeat.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Answer {
    /// The outcomes in the order of the records.
    pub outcomes: Vec<Outcome>,
    /// The messages of the failure queue that must come again.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub batch_item_failures: Vec<BatchItem>,
}

/// The outcome of a record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// The key, or the animation that was swept.
    pub of: String,
    /// The result in a word or a sentence.
    pub what: String,
}

/// A message that must come again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct BatchItem {
    /// The id of the message.
    pub item_identifier: String,
}

/// A failure: at least one record could not be processed for now.
#[derive(Debug, thiserror::Error)]
#[error("{}", .0.iter().map(|(key, error)| format!("{}: {key}", chain(error))).collect::<Vec<_>>().join("; "))]
pub struct Failed(pub Vec<(String, Error)>);

/// Formats an error with its causes. Starts with the error's own message, because the platform passes it on to the
/// record of the failure.
pub(crate) fn chain(error: &Error) -> String {
    let mut text = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(cause) = source {
        text.push_str(": ");
        text.push_str(&cause.to_string());
        source = cause.source();
    }
    text
}

/// Returns whether another try could succeed.
pub(crate) fn is_transient(error: &Error) -> bool {
    !matches!(error, Error::Key { .. })
}

impl From<Failed> for lambda_runtime::Diagnostic {
    fn from(failed: Failed) -> Self {
        Self { error_type: "Rayfold.TryAgain".into(), error_message: failed.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_starts_with_the_words_of_its_first_error() {
        let late = Error::OutOfTime { what: "drawing f".into() };
        let busy = Error::Throttled { key: "k".into(), source: "SlowDown".into() };
        let failed = Failed(vec![("scripts/a/f.txt".into(), late), ("scripts/a/g.txt".into(), busy)]);
        assert_eq!(
            failed.to_string(),
            "out of time: drawing f: scripts/a/f.txt; the store is busy: k: SlowDown: scripts/a/g.txt"
        );
    }
}
