//! The service of a connection, which wraps S3's protocol. Each request gets an id and its origin. `gate` refuses
//! requests for unsupported features, and `cors` answers preflights. Every response carries the id and the time.
//!
//! A panic is answered, too, because the bytes of unknown clients pass through third-party code.

use std::net::IpAddr;
use std::panic::AssertUnwindSafe;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use futures_util::FutureExt;
use http_body_util::BodyExt;
use hyper::body::Incoming;
use hyper::header::{CONNECTION, DATE, EXPECT, HeaderName, HeaderValue};
use hyper::service::Service;
use hyper::{Method, Request, Response};
use s3s::dto::{Timestamp, TimestampFormat};
use s3s::service::S3Service;
use s3s::{Body, HttpError, S3Error, s3_error};
use tokio::time::timeout;

use crate::gate::Gate;
use crate::host::bucket_of;
use crate::identity::{in_sts_shape, is_for_sts};
use crate::records::CorsRule;
use crate::{cors, limits, replies};

const REQUEST_ID: HeaderName = HeaderName::from_static("x-amz-request-id");

/// The time and the number of bytes for which a refused body is still read.
const DRAIN: Duration = Duration::from_secs(1);
const MAX_DRAINED: usize = 1024 * 1024;

static NEXT: AtomicU64 = AtomicU64::new(1);

/// The origin of a request.
#[derive(Clone, Debug, Default)]
pub(crate) struct Origin {
    /// The IP address of the client.
    pub(crate) source: String,
    /// The id of the request.
    pub(crate) request: String,
}

/// A function that returns the CORS rules of a bucket, given its name.
pub(crate) type Rules = Arc<dyn Fn(&str) -> Vec<CorsRule> + Send + Sync>;

/// The service of one connection.
#[derive(Clone)]
pub(crate) struct ConnectionService {
    pub(crate) service: S3Service,
    /// Returns a bucket's rules for pages of other sites.
    pub(crate) rules: Rules,
    pub(crate) peer: IpAddr,
}

impl Service<Request<Incoming>> for ConnectionService {
    type Response = Response<Body>;
    type Error = HttpError;
    type Future = std::pin::Pin<Box<dyn Future<Output = Result<Self::Response, Self::Error>> + Send>>;

    fn call(&self, mut request: Request<Incoming>) -> Self::Future {
        let id = format!("{:016X}", NEXT.fetch_add(1, Ordering::Relaxed));
        let header = HeaderValue::from_str(&id);
        request.extensions_mut().insert(Origin { source: self.peer.to_string(), request: id });
        // A client that sent `Expect` may or may not keep the connection after a refusal.
        let waits = request.headers().contains_key(EXPECT);
        let this = self.clone();
        Box::pin(async move {
            let answer = AssertUnwindSafe(this.answer(request.map(Body::from))).catch_unwind();
            let mut response = match answer.await {
                Ok(response) => response?,
                Err(_) => refusal(s3_error!(InternalError, "the store failed; its standard error says how"))?,
            };
            if waits && !response.status().is_success() {
                response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
            }
            if let Ok(header) = header {
                response.headers_mut().insert(REQUEST_ID, header);
            }
            // Hyper's own date stops if the clock is set back, and clients set theirs by it to sign.
            if let Some(now) = date(SystemTime::now()) {
                response.headers_mut().insert(DATE, now);
            }
            Ok(response)
        })
    }
}

impl ConnectionService {
    /// Returns the response of S3's protocol, or of a check before it.
    async fn answer(&self, mut request: Request<Body>) -> Result<Response<Body>, HttpError> {
        if is_for_sts(request.method(), request.uri(), request.headers()) {
            return in_sts_shape(self.service.call(request).await?).await;
        }
        if request.method() == Method::OPTIONS {
            let bucket = bucket_of(request.headers(), request.uri().path());
            return cors::preflight(&self.rules(bucket), request.headers()).or_else(refusal);
        }
        let origin = cors::Origin::of(request.method(), request.headers());
        let rules_of = origin.as_ref().and_then(|_| bucket_of(request.headers(), request.uri().path()));
        let is_head = request.method() == Method::HEAD;
        let mut response = match Gate::admit(&mut request) {
            Err(error) => {
                drain(request).await;
                refusal(error)?
            }
            Ok(gate) => {
                request.extensions_mut().insert(gate.clone());
                let response = match gate.operation() {
                    "PostObject" => limits::of_form(self.service.call(request)).await?,
                    _ => self.service.call(request).await?,
                };
                let response = match gate.refusal() {
                    Some(error) => refusal(error)?,
                    None => response,
                };
                replies::written(gate.operation(), response).await?
            }
        };
        if is_head && !response.status().is_success() {
            *response.body_mut() = Body::empty();
        }
        if let Some(origin) = origin {
            origin.allow(&self.rules(rules_of), response.headers_mut());
        }
        Ok(response)
    }

    /// Returns a bucket's rules for pages of other sites.
    fn rules(&self, bucket: Option<String>) -> Vec<CorsRule> {
        bucket.map(|name| (self.rules)(&name)).unwrap_or_default()
    }
}

/// Turns an error into a response.
fn refusal(error: S3Error) -> Result<Response<Body>, HttpError> {
    error.to_http_response().map_err(|error| HttpError::new(Box::new(error)))
}

/// Reads a short body and discards it, so that its sender gets to read the response.
async fn drain(request: Request<Body>) {
    if !request.headers().contains_key(EXPECT) {
        let _ =
            timeout(DRAIN, http_body_util::Limited::new(request.into_body(), MAX_DRAINED).collect()).await;
    }
}

/// Formats a time for a header.
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
