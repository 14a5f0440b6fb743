//! The meaning of S3's answers to the pipeline.

use aws_sdk_s3::config::http::HttpResponse;
use aws_sdk_s3::error::{ProvideErrorMetadata, SdkError};
use percent_encoding::percent_decode_str;

use crate::Error;

/// Returns the status of the reply, if there was one.
pub(super) fn status<E>(error: &SdkError<E, HttpResponse>) -> Option<u16> {
    error.raw_response().map(|response| response.status().as_u16())
}

/// Maps a failed request to the error that says what the caller may do.
pub(super) fn error_of<E>(key: &str, error: SdkError<E, HttpResponse>) -> Error
where
    E: ProvideErrorMetadata + std::error::Error + Send + Sync + 'static,
{
    let key = key.to_owned();
    let status = status(&error);
    let code = error.code().map(str::to_owned);
    let named = |name: &str| code.as_deref() == Some(name);
    match error {
        SdkError::ServiceError(_) if named("NoSuchBucket") => refused(key, error),
        SdkError::ServiceError(_) => match status {
            Some(404) => Error::NotFound { key },
            Some(412) => Error::PreconditionFailed { key },
            Some(409) => Error::Conflict { key },
            Some(429 | 503) => Error::Throttled { key, source: described(error) },
            Some(507) => Error::Full { key, source: described(error) },
            Some(500..) => Error::Ambiguous { key, source: described(error) },
            _ if named("SlowDown") || named("RequestTimeout") => {
                Error::Throttled { key, source: described(error) }
            }
            _ => refused(key, error),
        },
        SdkError::DispatchFailure(ref failure) if !failure.is_io() && !failure.is_timeout() => {
            // Nothing was sent: there are no credentials, or the configured endpoint cannot be connected to.
            refused(key, error)
        }
        SdkError::ConstructionFailure(_) => refused(key, error),
        error => Error::Ambiguous { key, source: described(error) },
    }
}

fn refused<E>(key: String, error: SdkError<E, HttpResponse>) -> Error
where
    E: ProvideErrorMetadata + std::error::Error + Send + Sync + 'static,
{
    Error::Refused { key, source: described(error) }
}

/// Returns the innermost message, which names the fault; the layers around it only name its place.
fn described<E>(error: SdkError<E, HttpResponse>) -> crate::Cause
where
    E: ProvideErrorMetadata + std::error::Error + Send + Sync + 'static,
{
    match (error.code(), error.message()) {
        (Some(code @ "XMinioInvalidObjectName"), _) => {
            format!("{code}: MinIO keeps objects as files, whose names have at most 255 bytes").into()
        }
        (Some(code), Some(message)) => format!("{code}: {message}").into(),
        (Some(code), None) => code.to_owned().into(),
        _ => {
            let mut cause: &dyn std::error::Error = &error;
            while let Some(inner) = cause.source() {
                cause = inner;
            }
            match status(&error) {
                Some(status) => format!("{cause} (HTTP {status})").into(),
                None => cause.to_string().into(),
            }
        }
    }
}

/// Decodes a name in a listing with `encoding-type=url`: form-encoded.
pub(super) fn decoded(text: &str) -> String {
    percent_decode_str(&text.replace('+', " ")).decode_utf8_lossy().into_owned()
}
