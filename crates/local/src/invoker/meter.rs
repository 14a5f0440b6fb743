//! A proxy between one process and the store that counts its requests and can inject faults.
//!
//! Bytes pass unchanged, the Host header too, so that signatures stay valid. Every process has its own meter and
//! handles one invocation at a time, so each request belongs to the current invocation.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};

use http_body_util::BodyExt;
use hyper::body::Incoming;
use hyper::header::HeaderValue;
use hyper::{Method, Request, Response, StatusCode, Uri};
use hyper_util::client::legacy::Client;
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioExecutor;
use percent_encoding::percent_decode_str;
use tokio::sync::Notify;

use super::chaos::{Fate, Fates};
use crate::error::Result;
use crate::http::{Body, Server, any_port, full, listen};
use crate::observation::{Attempt, Observer, RequestKind, Requests, Seen, StoreRequest};

/// A proxy between one process and the store.
pub(crate) struct Meter {
    address: SocketAddr,
    shared: Arc<Shared>,
    _server: Server,
}

struct Shared {
    upstream: SocketAddr,
    client: Client<HttpConnector, Incoming>,
    current: Mutex<Current>,
    fates: Option<Fates>,
    observer: Observer,
    kill: Notify,
}

#[derive(Default)]
struct Current {
    attempt: Option<Attempt>,
    requests: Requests,
}

impl Meter {
    pub(crate) async fn start(
        upstream: SocketAddr,
        fates: Option<Fates>,
        observer: Observer,
    ) -> Result<Self> {
        let (listener, address) = listen(any_port()).await?;
        let mut connector = HttpConnector::new();
        connector.set_nodelay(true);
        let shared = Arc::new(Shared {
            upstream,
            client: Client::builder(TokioExecutor::new()).build(connector),
            current: Mutex::default(),
            fates,
            observer,
            kill: Notify::new(),
        });
        let handler = shared.clone();
        let server = Server::start(listener, move |request| handler.clone().pass(request));
        Ok(Self { address, shared, _server: server })
    }

    /// Returns the endpoint that the process uses as the store.
    pub(crate) fn endpoint(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Counts from now on for `attempt`.
    pub(crate) fn begin(&self, attempt: Attempt) {
        *self.shared.current() = Current { attempt: Some(attempt), requests: Requests::default() };
    }

    /// Returns the requests sent since [`Self::begin`].
    pub(crate) fn requests(&self) -> Requests {
        self.shared.current().requests
    }

    /// Returns when fate wants the process dead.
    pub(crate) async fn killed(&self) {
        self.shared.kill.notified().await;
    }
}

impl Shared {
    fn current(&self) -> std::sync::MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn pass(self: Arc<Self>, mut request: Request<Incoming>) -> Option<Response<Body>> {
        let seen = classify(request.method(), request.uri());
        let attempt = {
            let mut current = self.current();
            current.requests.count(seen.kind);
            current.attempt.clone()
        };
        let mut fate = Fate::Pass;
        if let Some(attempt) = attempt {
            fate = self.fates.as_ref().map_or(Fate::Pass, |fates| fates(&attempt, &seen));
            self.observer.see(Seen::Requested { attempt, request: seen });
        }
        match fate {
            Fate::KillBefore => {
                self.kill.notify_one();
                return std::future::pending().await;
            }
            Fate::SlowDown => return Some(slow_down()),
            Fate::Pass | Fate::KillAfter | Fate::LoseAnswer => {}
        }
        let path = request.uri().path_and_query().map_or("/", |path| path.as_str());
        *request.uri_mut() = format!("http://{}{path}", self.upstream).parse().ok()?;
        // A store that cannot be reached looks to the process like one: the connection closes.
        let answer = self.client.request(request).await.ok()?;
        match fate {
            Fate::KillAfter => {
                self.kill.notify_one();
                std::future::pending().await
            }
            Fate::LoseAnswer => None,
            Fate::Pass | Fate::KillBefore | Fate::SlowDown => Some(answer.map(BodyExt::boxed)),
        }
    }
}

fn slow_down() -> Response<Body> {
    let mut answer = Response::new(full(
        "<Error><Code>SlowDown</Code><Message>reduce your request rate</Message></Error>",
    ));
    *answer.status_mut() = StatusCode::SERVICE_UNAVAILABLE;
    answer.headers_mut().insert("content-type", HeaderValue::from_static("application/xml"));
    answer
}

/// Returns the class in which S3 bills a request.
fn classify(method: &Method, uri: &Uri) -> StoreRequest {
    let decoded = |text: &str| percent_decode_str(text).decode_utf8_lossy().into_owned();
    let path = uri.path().trim_start_matches('/');
    let key = path.split_once('/').map_or("", |(_bucket, key)| key);
    let query = uri.query().unwrap_or_default();
    let listed = query.split('&').any(|pair| pair.starts_with("list-type=") || pair == "versions");
    let kind = match *method {
        Method::GET if listed => RequestKind::List,
        Method::GET | Method::HEAD => RequestKind::Get,
        Method::DELETE => RequestKind::Delete,
        _ => RequestKind::Put,
    };
    let key = match query.split('&').find_map(|pair| pair.strip_prefix("prefix=")) {
        Some(prefix) if listed => decoded(prefix),
        _ => decoded(key),
    };
    StoreRequest { kind, key }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_classified_as_they_are_billed() {
        let kind = |method: Method, uri: &str| {
            let seen = classify(&method, &uri.parse().unwrap());
            (seen.kind, seen.key)
        };
        assert_eq!(
            kind(Method::GET, "/b?list-type=2&prefix=scripts%2Fa%20b%2F&delimiter=%2F"),
            (RequestKind::List, "scripts/a b/".into())
        );
        assert_eq!(
            kind(Method::GET, "/b/scripts/a%2Bb/%C3%BC.txt"),
            (RequestKind::Get, "scripts/a+b/ü.txt".into())
        );
        assert_eq!(
            kind(Method::PUT, "/b/frames/x?partNumber=1&uploadId=2"),
            (RequestKind::Put, "frames/x".into())
        );
        assert_eq!(kind(Method::DELETE, "/b/k"), (RequestKind::Delete, "k".into()));
    }
}
