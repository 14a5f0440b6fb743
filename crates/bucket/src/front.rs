//! What stands before S3's protocol: each request gets an id and is told where it came from, and every answer names the id
//! and the time.
//!
//! A panic is answered, too: bytes from strangers pass through code that is not ours.

use std::net::IpAddr;
use std::panic::AssertUnwindSafe;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

use futures_util::FutureExt;
use hyper::body::Incoming;
use hyper::header::{DATE, HeaderName, HeaderValue};
use hyper::service::Service;
use hyper::{Request, Response};
use s3s::dto::{Timestamp, TimestampFormat};
use s3s::service::S3Service;
use s3s::{Body, HttpError, s3_error};

use crate::identity::{in_sts_shape, is_for_sts};

const REQUEST_ID: HeaderName = HeaderName::from_static("x-amz-request-id");

static NEXT: AtomicU64 = AtomicU64::new(1);

/// Where a request came from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origin {
    /// The client's address.
    pub(crate) source: String,
    /// The request's id.
    pub(crate) request: String,
}

/// The service of one connection.
#[derive(Clone)]
pub(crate) struct Front {
    pub(crate) service: S3Service,
    pub(crate) peer: IpAddr,
}

impl Service<Request<Incoming>> for Front {
    type Response = Response<Body>;
    type Error = HttpError;
    type Future = std::pin::Pin<Box<dyn Future<Output = Result<Self::Response, Self::Error>> + Send>>;

    fn call(&self, mut request: Request<Incoming>) -> Self::Future {
        let id = format!("{:016X}", NEXT.fetch_add(1, Ordering::Relaxed));
        let header = HeaderValue::from_str(&id);
        request.extensions_mut().insert(Origin { source: self.peer.to_string(), request: id });
        let for_sts = is_for_sts(request.method(), request.uri(), request.headers());
        let service = self.service.clone();
        Box::pin(async move {
            let answer = AssertUnwindSafe(service.call(request.map(Body::from))).catch_unwind();
            let mut response = match answer.await {
                Ok(response) => response?,
                Err(_) => {
                    let error = s3_error!(InternalError, "the store failed; its standard error says how");
                    error.to_http_response().map_err(|error| HttpError::new(Box::new(error)))?
                }
            };
            if for_sts {
                response = in_sts_shape(response).await?;
            }
            if let Ok(header) = header {
                response.headers_mut().insert(REQUEST_ID, header);
            }
            // Hyper's own stands still when the clock is set back, and clients set theirs by it to sign.
            if let Some(now) = date(SystemTime::now()) {
                response.headers_mut().insert(DATE, now);
            }
            Ok(response)
        })
    }
}

/// As a header has it.
fn date(time: SystemTime) -> Option<HeaderValue> {
    let mut text = Vec::new();
    Timestamp::from(time).format(TimestampFormat::HttpDate, &mut text).ok()?;
    HeaderValue::from_bytes(&text).ok()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_date_goes_back_with_the_clock() {
        let at = |seconds| date(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)).unwrap();
        assert_eq!(at(1_795_494_907), "Tue, 24 Nov 2026 04:35:07 GMT");
        assert_eq!(at(1_795_494_906), "Tue, 24 Nov 2026 04:35:06 GMT");
        assert_eq!(at(784_887_151), "Tue, 15 Nov 1994 08:12:31 GMT");
    }
}
