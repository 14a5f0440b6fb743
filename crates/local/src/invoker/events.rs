//! Sends events from the store's webhook, or from listings of the bucket, to the queues of the functions, by the shared
//! routes.
//!
//! Events are forwarded as the store writes them; the functions read AWS's shape and MinIO's. This module injects the
//! faults of events: an event may be lost, duplicated or late, or be delivered in a group in the wrong order.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use http_body_util::BodyExt;
use hyper::body::Incoming;
use hyper::header::AUTHORIZATION;
use hyper::{Method, Request, Response, StatusCode};
use percent_encoding::{NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use rayfold_pipeline::store::ETag;
use serde_json::{Value, json};
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::timeout;

use super::chaos::Dice;
use super::queue::{Job, Pending, Pool};
use crate::http::{Body, Server, json};
use crate::observation::{Observer, Seen};
use crate::region::REGION;
use crate::routes::{Function, Routes};

/// The pools by function.
#[derive(Clone)]
pub(crate) struct Pools {
    pub(crate) render: Pool,
    pub(crate) assemble: Pool,
}

impl Pools {
    pub(crate) fn of(&self, function: Function) -> &Pool {
        match function {
            Function::Render => &self.render,
            Function::Assemble => &self.assemble,
        }
    }
}

struct Event {
    function: Function,
    payload: Bytes,
}

/// The way of an event from the store to the functions' queues.
#[derive(Clone)]
pub(crate) struct Delivery {
    sender: mpsc::UnboundedSender<Event>,
    routes: Arc<Routes>,
    observer: Observer,
    pending: Pending,
}

impl Delivery {
    pub(crate) fn start(
        pools: Pools,
        dice: Arc<Dice>,
        observer: Observer,
        pending: Pending,
        tasks: &mut JoinSet<()>,
    ) -> Self {
        let (sender, events) = mpsc::unbounded_channel();
        tasks.spawn(deliver(events, pools, dice, pending.clone()));
        Self { sender, routes: Arc::new(Routes::shared()), observer, pending }
    }

    /// Handles the event of this name on an object.
    pub(crate) fn take(&self, name: &str, key: &str, payload: Bytes) {
        let function = self.routes.function(key, name);
        self.observer.see(Seen::Event { function, name: name.to_owned(), key: key.to_owned() });
        if let Some(function) = function {
            self.pending.add();
            if self.sender.send(Event { function, payload }).is_err() {
                self.pending.remove();
            }
        }
    }
}

/// Receives events on `listener` if they carry `token`: their names, keys and payloads.
pub(crate) fn receive(
    listener: TcpListener,
    token: &str,
    hear: impl Fn(&str, &str, Bytes) + Clone + Send + Sync + 'static,
) -> Server {
    let expected: Arc<str> = format!("Bearer {token}").into();
    Server::start(listener, move |request| {
        let (expected, hear) = (expected.clone(), hear.clone());
        async move { Some(take(request, &expected, &hear).await) }
    })
}

async fn take(
    request: Request<Incoming>,
    expected: &str,
    hear: &impl Fn(&str, &str, Bytes),
) -> Response<Body> {
    let known =
        request.headers().get(AUTHORIZATION).is_some_and(|sent| sent.as_bytes() == expected.as_bytes());
    if !known {
        return json(StatusCode::UNAUTHORIZED, &json!({}));
    }
    if *request.method() != Method::POST {
        return json(StatusCode::OK, &json!({}));
    }
    let Ok(body) = request.into_body().collect().await else {
        return json(StatusCode::BAD_REQUEST, &json!({}));
    };
    let payload = body.to_bytes();
    // The stores write one record an event; the first one names the function.
    if let Some((name, key)) = described(&payload) {
        hear(&name, &key, payload);
    }
    json(StatusCode::OK, &json!({}))
}

/// Returns an event in AWS's shape, for a store that sends none. If the object was put, the event has its entity tag,
/// which tells the version if the event fails.
pub(crate) fn written(bucket: &str, name: &str, key: &str, etag: Option<&ETag>) -> Bytes {
    let key = utf8_percent_encode(key, NON_ALPHANUMERIC).to_string();
    let mut object = json!({ "key": key });
    if let Some(etag) = etag {
        object["eTag"] = etag.as_str().into();
    }
    let record = json!({
        "eventVersion": "2.1",
        "eventSource": "aws:s3",
        "awsRegion": REGION,
        "eventTime": "1970-01-01T00:00:00.000Z",
        "eventName": name,
        "userIdentity": {},
        "requestParameters": {},
        "responseElements": {},
        "s3": { "bucket": { "name": bucket }, "object": object },
    });
    json!({ "Records": [record] }).to_string().into()
}

/// Returns the event's name and the object's decoded key.
fn described(payload: &[u8]) -> Option<(String, String)> {
    let event: Value = serde_json::from_slice(payload).ok()?;
    let record = &event["Records"][0];
    let key = record["s3"]["object"]["key"].as_str()?.replace('+', " ");
    let key = percent_decode_str(&key).decode_utf8().ok()?.into_owned();
    Some((record["eventName"].as_str()?.to_owned(), key))
}

async fn deliver(
    mut events: mpsc::UnboundedReceiver<Event>,
    pools: Pools,
    dice: Arc<Dice>,
    pending: Pending,
) {
    let mut late = JoinSet::new();
    while let Some(first) = events.recv().await {
        let mut bunch = vec![first];
        if let Some(quiet) = dice.reverse_after() {
            while let Ok(Some(next)) = timeout(quiet, events.recv()).await {
                bunch.push(next);
            }
            bunch.reverse();
        }
        while late.try_join_next().is_some() {}
        for event in bunch {
            for pause in dice.deliveries() {
                let (pool, payload) = (pools.of(event.function).clone(), event.payload.clone());
                if pause == Duration::ZERO {
                    pool.submit(Job::event(payload));
                } else {
                    let pending = pending.clone();
                    pending.add();
                    late.spawn(async move {
                        tokio::time::sleep(pause).await;
                        pool.submit(Job::event(payload));
                        pending.remove();
                    });
                }
            }
            pending.remove();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_form_decoded() {
        let payload = json!({ "Records": [{
            "eventName": "s3:ObjectCreated:Put",
            "s3": { "object": { "key": "scripts%2Fa+b%2B%C3%BC%2F1.txt" } },
        }] });
        let (name, key) = described(payload.to_string().as_bytes()).unwrap();
        assert_eq!((name.as_str(), key.as_str()), ("s3:ObjectCreated:Put", "scripts/a b+ü/1.txt"));
        assert!(described(b"{}").is_none());
    }

    #[test]
    fn a_written_event_is_read_back() {
        let key = "scripts/a b+ü/1%.txt";
        let payload = written("bucket", "ObjectRemoved:Delete", key, None);
        assert_eq!(described(&payload), Some(("ObjectRemoved:Delete".into(), key.into())));
    }
}
