//! Lambda's Runtime API for one process, as its documentation describes it.
//!
//! `GET …/invocation/next` waits for an invocation; `POST …/invocation/{id}/response` and `…/error` end it; `POST
//! …/init/error` reports that the process cannot start. A process handles one invocation at a time.
//!
//! On AWS only the process itself can reach its Runtime API. A port of this machine can be reached by all of its users
//! and by the pages in their browsers. So each path here begins with a token that only the process gets, and requests
//! from a page are rejected.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use bytes::Bytes;
use http_body_util::BodyExt;
use hyper::body::Incoming;
use hyper::header::{HOST, ORIGIN};
use hyper::{Method, Request, Response, StatusCode};
use serde_json::json;
use tokio::sync::mpsc;

use crate::credentials::token;
use crate::error::Result;
use crate::http::{Body, Server, any_port, full, json, listen};

/// The path after the token.
const BASE: &str = "/2018-06-01/runtime/";

/// An invocation that `next` hands out.
#[derive(Clone, Debug)]
pub(crate) struct Handout {
    pub(crate) request_id: String,
    pub(crate) payload: Bytes,
    pub(crate) timeout: Duration,
    pub(crate) function_arn: String,
    pub(crate) trace_id: String,
}

/// An action of the process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    /// The process requested the next invocation.
    Next,
    /// The process received the invocation: its time starts.
    Taken,
    Response(String),
    Error(String),
    InitError(String),
}

/// The API's server for one process.
#[derive(Debug)]
pub(crate) struct RuntimeApi {
    pub(crate) address: SocketAddr,
    token: String,
    handouts: mpsc::UnboundedSender<Handout>,
    calls: mpsc::UnboundedReceiver<Call>,
    _server: Server,
}

struct Shared {
    /// The address of the API, as requests name it.
    host: String,
    /// The beginning of each request's path.
    base: String,
    handouts: tokio::sync::Mutex<mpsc::UnboundedReceiver<Handout>>,
    calls: mpsc::UnboundedSender<Call>,
    in_hand: Mutex<Option<String>>,
}

impl RuntimeApi {
    pub(crate) async fn start() -> Result<Self> {
        let (listener, address) = listen(any_port()).await?;
        let (handouts, to_hand_out) = mpsc::unbounded_channel();
        let (to_caller, calls) = mpsc::unbounded_channel();
        let token = token(20)?;
        let shared = Arc::new(Shared {
            host: address.to_string(),
            base: format!("/{token}{BASE}"),
            handouts: tokio::sync::Mutex::new(to_hand_out),
            calls: to_caller,
            in_hand: Mutex::default(),
        });
        let server = Server::start(listener, move |request| {
            let shared = shared.clone();
            async move { Some(shared.answer(request).await) }
        });
        Ok(Self { address, token, handouts, calls, _server: server })
    }

    /// Returns the endpoint for the process, with the token.
    pub(crate) fn endpoint(&self) -> String {
        format!("http://{}/{}", self.address, self.token)
    }

    pub(crate) fn hand_out(&self, handout: Handout) {
        // The server holds the other end as long as we do.
        let _ = self.handouts.send(handout);
    }

    /// Returns the next action of the process; never ends.
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
        let Some(rest) = path.strip_prefix(&self.base).filter(|_| !self.is_strange(&request)) else {
            return json(
                StatusCode::FORBIDDEN,
                &json!({ "errorType": "Forbidden", "errorMessage": "not yours" }),
            );
        };
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

    /// Returns whether a browser sent the request, for a page, or for a host name that resolves to our address.
    fn is_strange(&self, request: &Request<Incoming>) -> bool {
        let headers = request.headers();
        headers.get(HOST).is_none_or(|host| host.as_bytes() != self.host.as_bytes())
            || headers.keys().any(|name| *name == ORIGIN || name.as_str().starts_with("sec-fetch-"))
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

    async fn send(api: &RuntimeApi, head: &str, body: &str) -> String {
        let (method, path) = head.split_once(' ').unwrap();
        let line = format!("{method} /{}/2018-06-01/{path}", api.token);
        raw(api.address, &line, &format!("Host: {}\r\n", api.address), body).await
    }

    async fn raw(address: SocketAddr, line: &str, headers: &str, body: &str) -> String {
        let mut stream = tokio::net::TcpStream::connect(address).await.unwrap();
        let request = format!(
            "{line} HTTP/1.1\r\n{headers}Connection: close\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        answer
    }

    fn handout() -> Handout {
        Handout {
            request_id: "id-1".into(),
            payload: Bytes::from_static(b"{\"a\":1}"),
            timeout: Duration::from_secs(3),
            function_arn: "arn:aws:lambda:us-east-1:000000000000:function:f".into(),
            trace_id: "Root=1-2-3".into(),
        }
    }

    #[tokio::test]
    async fn an_invocation_is_handed_out_once_and_ended_by_its_own_id() {
        let mut api = RuntimeApi::start().await.unwrap();
        api.hand_out(handout());
        let next = send(&api, "GET runtime/invocation/next", "").await;
        assert!(next.starts_with("HTTP/1.1 200"), "{next}");
        assert!(next.to_lowercase().contains("lambda-runtime-aws-request-id: id-1"), "{next}");
        for header in ["deadline-ms: 1", "invoked-function-arn: arn:aws", "trace-id: root="] {
            assert!(next.to_lowercase().contains(&format!("lambda-runtime-{header}")), "{header} in {next}");
        }
        assert!(next.ends_with("{\"a\":1}"));
        let wrong = send(&api, "POST runtime/invocation/id-2/response", "1").await;
        assert!(wrong.starts_with("HTTP/1.1 400"), "{wrong}");
        let right = send(&api, "POST runtime/invocation/id-1/response", "1").await;
        assert!(right.starts_with("HTTP/1.1 202"), "{right}");
        let again = send(&api, "POST runtime/invocation/id-1/error", "1").await;
        assert!(again.starts_with("HTTP/1.1 400"), "{again}");
        let elsewhere = send(&api, "GET runtime/elsewhere", "").await;
        assert!(elsewhere.starts_with("HTTP/1.1 404"), "{elsewhere}");
        for call in [Call::Next, Call::Taken, Call::Response("1".into())] {
            assert_eq!(api.call().await, call);
        }
    }

    #[tokio::test]
    async fn a_process_that_cannot_start_says_so() {
        let mut api = RuntimeApi::start().await.unwrap();
        let answer = send(&api, "POST runtime/init/error", "{}").await;
        assert!(answer.starts_with("HTTP/1.1 202"), "{answer}");
        assert_eq!(api.call().await, Call::InitError("{}".into()));
    }

    #[tokio::test]
    async fn nobody_but_the_process_takes_an_invocation() {
        let mut api = RuntimeApi::start().await.unwrap();
        api.hand_out(handout());
        let host = format!("Host: {}\r\n", api.address);
        let (next, error) = ("2018-06-01/runtime/invocation/next", "2018-06-01/runtime/init/error");
        let guess = "0".repeat(api.token.len());
        // Without the token: another user of the machine.
        for line in [
            format!("GET /{next}"),
            format!("GET /{guess}/{next}"),
            format!("GET //{next}"),
            format!("POST /{error}"),
            format!("GET /{}", api.token),
        ] {
            let answer = raw(api.address, &line, &host, "").await;
            assert!(answer.starts_with("HTTP/1.1 403"), "{line}: {answer}");
        }
        // With it: a page that has found it out, also one of a name that leads here.
        let port = api.address.port();
        for headers in [
            format!("{host}Origin: http://{}\r\n", api.address),
            format!("{host}Origin: null\r\n"),
            format!("{host}Sec-Fetch-Mode: no-cors\r\n"),
            format!("Host: page.example:{port}\r\n"),
            format!("Host: localhost:{port}\r\n"),
            "Host: 127.0.0.1\r\n".to_owned(),
            String::new(),
        ] {
            let answer = raw(api.address, &format!("GET /{}/{next}", api.token), &headers, "").await;
            assert!(answer.starts_with("HTTP/1.1 403"), "{headers}: {answer}");
        }
        assert!(api.calls.try_recv().is_err(), "one of them was heard");
        let answer = send(&api, "GET runtime/invocation/next", "").await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
        assert_eq!([api.call().await, api.call().await], [Call::Next, Call::Taken]);
    }
}
