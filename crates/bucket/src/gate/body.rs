//! A body that is checked while it is read. The body of an XML operation is checked against its digests and elements,
//! and a form by its fields. An error ends the body, so that the operation never runs.

use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, ready};

use bytes::Bytes;
use hyper::HeaderMap;
use hyper::body::{Frame, SizeHint};
use s3s::{Body, S3Error, S3Result, StdError, s3_error};

use super::form::Fields;
use super::operations::{Operation, Payload};
use super::values::checksum_header;
use super::xml;
use crate::answer::{invalid_request, wrong_checksum, wrong_md5};
use crate::checksum::{Algorithm, Digests, bytes_of};

/// The reason why a body was refused, for the response. `s3s` reports a body's error in its own words.
#[derive(Clone, Default)]
pub(super) struct Verdict(Arc<Mutex<Option<S3Error>>>);

impl Verdict {
    pub(super) fn take(&self) -> Option<S3Error> {
        self.0.lock().ok()?.take()
    }

    pub(super) fn set(&self, error: S3Error) {
        if let Ok(mut place) = self.0.lock() {
            *place = Some(error);
        }
    }
}

/// The check of a body.
enum Check {
    Xml {
        known: &'static [&'static str],
        md5: Option<Vec<u8>>,
        checksum: Option<(Algorithm, String)>,
        bytes: Vec<u8>,
    },
    Form(Fields),
}

/// The check of an operation's body, see the module.
pub(super) struct Guard {
    operation: &'static Operation,
    check: Check,
    verdict: Verdict,
}

impl Guard {
    /// Returns the guard of an operation's body if it needs one.
    ///
    /// # Errors
    /// `InvalidDigest` and `InvalidRequest` for digests that are invalid, or missing although S3 requires one.
    pub(super) fn new(
        operation: &'static Operation,
        headers: &HeaderMap,
        verdict: Verdict,
    ) -> S3Result<Option<Self>> {
        let check = match operation.payload {
            Payload::None | Payload::Bytes => return Ok(None),
            Payload::Form => Check::Form(Fields::default()),
            Payload::Xml(known) => {
                let md5 = match headers
                    .get("content-md5")
                    .map(|md5| bytes_of(md5.to_str().unwrap_or_default()))
                {
                    None => None,
                    Some(Some(md5)) if md5.len() == 16 => Some(md5),
                    Some(_) => {
                        return Err(s3_error!(InvalidDigest, "The Content-MD5 you specified is not valid."));
                    }
                };
                let checksum = checksum_header(headers)?;
                if operation.needs_digest && md5.is_none() && checksum.is_none() {
                    return Err(invalid_request(
                        "Missing required header for this request: Content-MD5 OR x-amz-checksum-*",
                    ));
                }
                // The checksum headers of a completion are those of the object.
                let checksum = checksum.filter(|_| operation.name != "CompleteMultipartUpload");
                Check::Xml { known, md5, checksum, bytes: Vec::new() }
            }
        };
        Ok(Some(Self { operation, check, verdict }))
    }

    /// Returns the body with the check.
    pub(super) fn around(self, body: Body) -> Body {
        Body::http_body_unsync(Guarded { body, guard: Some(self) })
    }

    fn take(&mut self, bytes: &Bytes) -> S3Result<()> {
        match &mut self.check {
            Check::Form(fields) => fields.take(self.operation, bytes),
            Check::Xml { bytes: all, .. } => {
                all.extend_from_slice(bytes);
                Ok(())
            }
        }
    }

    fn end(self) -> S3Result<()> {
        let Check::Xml { known, md5, checksum, bytes } = self.check else { return Ok(()) };
        let algorithm = checksum.as_ref().map_or(Algorithm::Crc32, |(algorithm, _)| *algorithm);
        let mut digests = Digests::new(algorithm);
        digests.update(&bytes);
        let (found, sum) = digests.finish();
        if md5.is_some_and(|md5| md5 != found) {
            return Err(wrong_md5());
        }
        if checksum.is_some_and(|(_, claimed)| claimed != sum.value) {
            return Err(wrong_checksum(algorithm));
        }
        xml::check(self.operation, known, &bytes)
    }
}

/// A body with its guard, until it has ended.
struct Guarded {
    body: Body,
    guard: Option<Guard>,
}

impl hyper::body::Body for Guarded {
    type Data = Bytes;
    type Error = StdError;

    fn poll_frame(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, StdError>>> {
        let this = self.get_mut();
        let frame = ready!(Pin::new(&mut this.body).poll_frame(context));
        let Some(mut guard) = this.guard.take() else { return Poll::Ready(frame) };
        let verdict = guard.verdict.clone();
        let checked = match &frame {
            Some(Ok(frame)) => {
                let checked = frame.data_ref().map_or(Ok(()), |bytes| guard.take(bytes));
                this.guard = Some(guard);
                checked
            }
            Some(Err(_)) => Ok(()),
            None => guard.end(),
        };
        match checked {
            Ok(()) => Poll::Ready(frame),
            Err(error) => {
                this.body = Body::empty();
                this.guard = None;
                verdict.set(error);
                Poll::Ready(Some(Err("the body was refused".into())))
            }
        }
    }

    /// Returns `false` until the end has been checked.
    fn is_end_stream(&self) -> bool {
        self.guard.is_none() && self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
