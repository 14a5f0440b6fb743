//! If-Match, If-None-Match, If-Modified-Since and If-Unmodified-Since, evaluated as S3 does.

use std::time::SystemTime;

use s3s::dto::{ETagCondition, Timestamp};
use s3s::{S3Error, S3ErrorCode};

use crate::answer::{Answer, no_such_key, not_implemented, precondition_failed};
use crate::records::Object;

/// The conditions of a change.
#[derive(Clone, Debug, Default)]
pub(crate) struct WriteConditions {
    pub(crate) if_match: Option<ETagCondition>,
    pub(crate) if_none_match: Option<ETagCondition>,
}

impl WriteConditions {
    pub(crate) fn check_form(&self) -> Answer<()> {
        match &self.if_none_match {
            Some(ETagCondition::ETag(_)) => Err(not_implemented("If-None-Match with an ETag on a write")),
            Some(ETagCondition::Any) | None => Ok(()),
        }
    }

    /// Compares with the current object: 412 if the condition fails, 404 if the object is missing.
    pub(crate) fn check(&self, now: Option<&Object>) -> Answer<()> {
        if let Some(condition) = &self.if_match {
            let object = now.ok_or_else(no_such_key)?;
            if !matches(condition, &object.etag) {
                return Err(precondition_failed());
            }
        }
        if self.if_none_match.is_some() && now.is_some() {
            return Err(precondition_failed());
        }
        Ok(())
    }
}

/// The conditions of a read, or of the source of a copy.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReadConditions {
    pub(crate) if_match: Option<ETagCondition>,
    pub(crate) if_none_match: Option<ETagCondition>,
    pub(crate) if_modified_since: Option<Timestamp>,
    pub(crate) if_unmodified_since: Option<Timestamp>,
}

/// The reason why the object is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unmet {
    /// The answer is 412.
    Failed,
    /// The answer is 304, or 412 for the source of a copy.
    NotModified,
}

impl ReadConditions {
    /// Returns the first condition that fails. An entity tag takes precedence over the corresponding
    /// date (RFC 9110, 13.2.2).
    pub(crate) fn unmet(&self, object: &Object) -> Option<Unmet> {
        let modified = Timestamp::from(object.modified.whole_seconds());
        let now = Timestamp::from(SystemTime::now());
        match (&self.if_match, &self.if_unmodified_since) {
            (Some(condition), _) if !matches(condition, &object.etag) => return Some(Unmet::Failed),
            (None, Some(since)) if modified > *since => return Some(Unmet::Failed),
            _ => {}
        }
        match (&self.if_none_match, &self.if_modified_since) {
            (Some(condition), _) if matches(condition, &object.etag) => Some(Unmet::NotModified),
            // A date in the future is ignored (RFC 9110, 13.1.3).
            (None, Some(since)) if *since <= now && modified <= *since => Some(Unmet::NotModified),
            _ => None,
        }
    }

    /// Checks the conditions of a read.
    pub(crate) fn check(&self, object: &Object) -> Answer<()> {
        match self.unmet(object) {
            None => Ok(()),
            Some(Unmet::Failed) => Err(precondition_failed()),
            Some(Unmet::NotModified) => Err(S3Error::new(S3ErrorCode::NotModified)),
        }
    }

    /// Checks the conditions of a copy's source.
    pub(crate) fn check_source(&self, object: &Object) -> Answer<()> {
        self.unmet(object).map_or(Ok(()), |_| Err(precondition_failed()))
    }
}

fn matches(condition: &ETagCondition, etag: &str) -> bool {
    match condition {
        ETagCondition::Any => true,
        ETagCondition::ETag(given) => given.value() == etag,
    }
}
