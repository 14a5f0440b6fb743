//! The answers of operations: S3's errors in S3's wording, and times in S3's format.

use hyper::StatusCode;
use redb::StorageError;
use s3s::dto::Timestamp;
use s3s::{S3Error, S3ErrorCode, StdError, s3_error};

use crate::checksum::Algorithm;
use crate::error::report;
use crate::records::Moment;
use crate::storage::Unavailable;

/// The result of a request: its output, or S3's error.
pub(crate) type Answer<T> = Result<T, S3Error>;

pub(crate) fn time(moment: Moment) -> Timestamp {
    moment.system_time().into()
}

pub(crate) fn no_such_bucket() -> S3Error {
    s3_error!(NoSuchBucket, "The specified bucket does not exist")
}

pub(crate) fn no_such_key() -> S3Error {
    s3_error!(NoSuchKey, "The specified key does not exist.")
}

pub(crate) fn no_such_upload() -> S3Error {
    s3_error!(
        NoSuchUpload,
        "The specified upload does not exist. The upload ID may be invalid, or the upload may have been aborted or completed."
    )
}

pub(crate) fn precondition_failed() -> S3Error {
    s3_error!(PreconditionFailed, "At least one of the pre-conditions you specified did not hold")
}

pub(crate) fn invalid_argument(message: impl Into<String>) -> S3Error {
    S3Error::with_message(S3ErrorCode::InvalidArgument, message.into())
}

pub(crate) fn invalid_request(message: impl Into<String>) -> S3Error {
    S3Error::with_message(S3ErrorCode::InvalidRequest, message.into())
}

pub(crate) fn not_implemented(what: &str) -> S3Error {
    S3Error::with_message(S3ErrorCode::NotImplemented, format!("{what} is not implemented"))
}

/// Refuses a header, parameter or element that occurs twice but is allowed once.
pub(crate) fn twice(name: &str) -> S3Error {
    invalid_argument(format!("{name} occurs more than once"))
}

pub(crate) fn wrong_md5() -> S3Error {
    s3_error!(BadDigest, "The Content-MD5 you specified did not match what we received.")
}

pub(crate) fn wrong_checksum(algorithm: Algorithm) -> S3Error {
    let name = algorithm.name();
    s3_error!(BadDigest, "The {name} you specified did not match the calculated checksum.")
}

/// Refuses an access list other than the owner's. A bucket of this store has none, like an S3 bucket whose owner
/// did not enable them.
pub(crate) fn no_lists() -> S3Error {
    coded("AccessControlListNotSupported", StatusCode::BAD_REQUEST, "The bucket does not allow ACLs")
}

/// Makes an error with a code that s3s does not know.
pub(crate) fn coded(code: &'static str, status: StatusCode, message: impl Into<String>) -> S3Error {
    let mut error = S3Error::with_message(S3ErrorCode::Custom(code.into()), message.into());
    error.set_status_code(status);
    error
}

/// Maps a failure of the storage to S3's error. A full disk has a code of its own, because a retry is useless.
pub(crate) fn unavailable(reason: &Unavailable) -> S3Error {
    match reason {
        Unavailable::Full => disk_full(),
        Unavailable::Failed(_) => S3Error::with_message(S3ErrorCode::InternalError, reason.to_string()),
        Unavailable::Ending => S3Error::with_message(S3ErrorCode::ServiceUnavailable, reason.to_string()),
    }
}

pub(crate) fn disk_full() -> S3Error {
    coded("InsufficientStorage", StatusCode::INSUFFICIENT_STORAGE, "the disk is full")
}

/// Maps a failure of a body's file to S3's error.
pub(crate) fn file_failed(error: std::io::Error) -> S3Error {
    use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    match error.kind() {
        StorageFull | QuotaExceeded | FileTooLarge => disk_full(),
        _ => s3_error!(error, InternalError, "a file of the store failed"),
    }
}

/// Reports that a snapshot could not be read.
pub(crate) fn unreadable(error: StorageError) -> S3Error {
    let message = format!("the store could not be read: {error}");
    s3_error!(error, InternalError, "{message}")
}

/// The error that a stored body differs from the one that was put.
#[derive(Debug, thiserror::Error)]
#[error("the body of {object} is damaged: {what}")]
pub(super) struct BodyDamaged {
    /// The bucket and the key.
    pub(super) object: String,
    /// The damage and its position.
    pub(super) what: String,
}

impl BodyDamaged {
    /// Reports the damage, and makes the error for a request that has sent nothing yet.
    pub(super) fn refuse(self) -> S3Error {
        report(&self);
        let message = self.to_string();
        s3_error!(self, InternalError, "{message}")
    }
}

/// Maps an error of a request's body to S3's error. s3s describes such an error by text alone.
pub(crate) fn body_failed(error: &StdError) -> S3Error {
    let text = error.to_string();
    if error.is::<BodyDamaged>() {
        // The damaged body is the source of a copy.
        return S3Error::with_message(S3ErrorCode::InternalError, text);
    }
    if text.contains("Sha256Mismatch") {
        coded(
            "XAmzContentSHA256Mismatch",
            StatusCode::BAD_REQUEST,
            "The provided 'x-amz-content-sha256' header does not match what was computed.",
        )
    } else if text.contains("SignatureMismatch") {
        s3_error!(SignatureDoesNotMatch, "The signature of a chunk does not match what was computed.")
    } else if text.contains("FormatError") || text.contains("TooLarge") || text.contains("TooMany") {
        invalid_request("The chunks of the body are not well formed.")
    } else {
        s3_error!(IncompleteBody, "The body ended before the number of bytes that Content-Length says.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_that_broke_off_says_how() {
        for (text, code) in [
            ("AwsChunkedStreamError: SignatureMismatch", "SignatureDoesNotMatch"),
            ("AwsChunkedStreamError: FormatError", "InvalidRequest"),
            ("AwsChunkedStreamError: ChunkMetaTooLarge", "InvalidRequest"),
            ("AwsChunkedStreamError: TooManyTrailerHeaders", "InvalidRequest"),
            ("Sha256Mismatch", "XAmzContentSHA256Mismatch"),
            ("connection reset", "IncompleteBody"),
        ] {
            assert_eq!(body_failed(&text.into()).code().as_str(), code, "{text}");
        }
    }
}
