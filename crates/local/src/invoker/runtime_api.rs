//! Lambda's Runtime API for one process, as its documentation describes it.
//!
//! `GET …/invocation/next` waits for an invocation; `POST …/invocation/{id}/response` and `…/error` end it; `POST
//! …/init/error` says that there will be none. A process handles one invocation at a time.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use bytes::Bytes;
use http_body_util::BodyExt;
use hyper::body::Incoming;
use hyper::{Method, Request, Response, StatusCode};
use serde_json::json;
use tokio::sync::mpsc;

use crate::error::Result;
use crate::http::{Body, Server, any_port, full, json, listen};

const BASE: &str = "/2018-06-01/runtime/";

/// What `next` hands out.
#[derive(Clone, Debug)]
pub(crate) struct Handout {
    pub(crate) request_id: String,
    pub(crate) payload: Bytes,
    pub(crate) timeout: Duration,
    pub(crate) function_arn: String,
    pub(crate) trace_id: String,
}

/// What the process did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    /// It asked for the next invocation.
    Next,
    /// It got it: the clock runs.
    Taken,
    Response(String),
    Error(String),
    InitError(String),
}

/// The API's server for one process.
#[derive(Debug)]
pub(crate) struct RuntimeApi {
    pub(crate) address: SocketAddr,
    handouts: mpsc::UnboundedSender<Handout>,
    calls: mpsc::UnboundedReceiver<Call>,
    _server: Server,
}

struct Shared {
    handouts: tokio::sync::Mutex<mpsc::UnboundedReceiver<Handout>>,
    calls: mpsc::UnboundedSender<Call>,
    in_hand: Mutex<Option<String>>,
}

impl RuntimeApi {
    pub(crate) async fn start() -> Result<Self> {
        let (listener, address) = listen(any_port()).await?;
        let (handouts, to_hand_out) = mpsc::unbounded_channel();
        let (to_caller, calls) = mpsc::unbounded_channel();
        let shared = Arc::new(Shared {
            handouts: tokio::sync::Mutex::new(to_hand_out),
            calls: to_caller,
            in_hand: Mutex::default(),
        });
        let server = Server::start(listener, move |request| {
            let shared = shared.clone();
            async move { Some(shared.answer(request).await) }
        });
        Ok(Self { address, handouts, calls, _server: server })
    }

    pub(crate) fn hand_out(&self, handout: Handout) {
        // The server holds the other end as long as we do.
        let _ = self.handouts.send(handout);
    }

    /// What the process does next; never ends.
    pub(crate) async fn call(&mut self) -> Call {
        match self.calls.recv().await {
            Some(call) => call,
            None => std::future::pending().await,
        }
    }
}

impl Shared {
    async fn answer(&self, request: Request<Incoming>) -> Response<Body> {
        let path = request.uri().path().to_owned();
        let Some(rest) = path.strip_prefix(BASE) else { return not_found() };
        let segments: Vec<&str> = rest.split('/').collect();
        match (request.method(), segments.as_slice()) {
            (&Method::GET, ["invocation", "next"]) => self.next().await,
            (&Method::POST, ["invocation", id, end @ ("response" | "error")]) => {
                let Some(body) = text(request).await else { return refused("InvalidRequest", "no body") };
                if self.in_hand().as_deref() != Some(*id) {
                    return refused("InvalidRequestID", "no such invocation in hand");
                }
                *self.in_hand() = None;
                self.tell(if *end == "response" { Call::Response(body) } else { Call::Error(body) })
            }
            (&Method::POST, ["init", "error"]) => match text(request).await {
                Some(body) => self.tell(Call::InitError(body)),
                None => refused("InvalidRequest", "no body"),
            },
            _ => not_found(),
        }
    }

    async fn next(&self) -> Response<Body> {
        let _ = self.calls.send(Call::Next);
        let handout = {
            let mut handouts = self.handouts.lock().await;
            let Some(handout) = handouts.recv().await else { return not_found() };
            handout
        };
        *self.in_hand() = Some(handout.request_id.clone());
        let _ = self.calls.send(Call::Taken);
        let deadline = SystemTime::now() + handout.timeout;
        let deadline_ms = deadline.duration_since(UNIX_EPOCH).unwrap_or_default().as_millis();
        Response::builder()
            .header("content-type", "application/json")
            .header("Lambda-Runtime-Aws-Request-Id", &handout.request_id)
            .header("Lambda-Runtime-Deadline-Ms", deadline_ms.to_string())
            .header("Lambda-Runtime-Invoked-Function-Arn", &handout.function_arn)
            .header("Lambda-Runtime-Trace-Id", &handout.trace_id)
            .body(full(handout.payload))
            .unwrap_or_else(|_| not_found())
    }

    fn tell(&self, call: Call) -> Response<Body> {
        let _ = self.calls.send(call);
        json(StatusCode::ACCEPTED, &json!({ "status": "OK" }))
    }

    fn in_hand(&self) -> std::sync::MutexGuard<'_, Option<String>> {
        self.in_hand.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

async fn text(request: Request<Incoming>) -> Option<String> {
    let body = request.into_body().collect().await.ok()?.to_bytes();
    Some(String::from_utf8_lossy(&body).into_owned())
}

fn refused(kind: &str, message: &str) -> Response<Body> {
    json(StatusCode::BAD_REQUEST, &json!({ "errorType": kind, "errorMessage": message }))
}

fn not_found() -> Response<Body> {
    json(StatusCode::NOT_FOUND, &json!({ "errorType": "NotFound", "errorMessage": "no such path" }))
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    async fn send(address: SocketAddr, head: &str, body: &str) -> String {
        let mut stream = tokio::net::TcpStream::connect(address).await.unwrap();
        let request = format!(
            "{head} HTTP/1.1\r\nHost: runtime\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        answer
    }

    #[tokio::test]
    async fn an_invocation_is_handed_out_once_and_ended_by_its_own_id() {
        let mut api = RuntimeApi::start().await.unwrap();
        api.hand_out(Handout {
            request_id: "id-1".into(),
            payload: Bytes::from_static(b"{\"a\":1}"),
            timeout: Duration::from_secs(3),
            function_arn: "arn:aws:lambda:us-east-1:000000000000:function:f".into(),
            trace_id: "Root=1-2-3".into(),
        });
        let next = send(api.address, "GET /2018-06-01/runtime/invocation/next", "").await;
        assert!(next.starts_with("HTTP/1.1 200"), "{next}");
        assert!(next.to_lowercase().contains("lambda-runtime-aws-request-id: id-1"), "{next}");
        for header in ["deadline-ms: 1", "invoked-function-arn: arn:aws", "trace-id: root="] {
            assert!(next.to_lowercase().contains(&format!("lambda-runtime-{header}")), "{header} in {next}");
        }
        assert!(next.ends_with("{\"a\":1}"));
        let wrong = send(api.address, "POST /2018-06-01/runtime/invocation/id-2/response", "1").await;
        assert!(wrong.starts_with("HTTP/1.1 400"), "{wrong}");
        let right = send(api.address, "POST /2018-06-01/runtime/invocation/id-1/response", "1").await;
        assert!(right.starts_with("HTTP/1.1 202"), "{right}");
        let again = send(api.address, "POST /2018-06-01/runtime/invocation/id-1/error", "1").await;
        assert!(again.starts_with("HTTP/1.1 400"), "{again}");
        let elsewhere = send(api.address, "GET /2018-06-01/elsewhere", "").await;
        assert!(elsewhere.starts_with("HTTP/1.1 404"), "{elsewhere}");
        for call in [Call::Next, Call::Taken, Call::Response("1".into())] {
            assert_eq!(api.call().await, call);
        }
    }

    #[tokio::test]
    async fn a_process_that_cannot_start_says_so() {
        let mut api = RuntimeApi::start().await.unwrap();
        let answer = send(api.address, "POST /2018-06-01/runtime/init/error", "{}").await;
        assert!(answer.starts_with("HTTP/1.1 202"), "{answer}");
        assert_eq!(api.call().await, Call::InitError("{}".into()));
    }
}
