//! From the store's webhook to the functions' queues, by the shared routes.
//!
//! Events are forwarded as the store writes them; the functions read AWS's shape and MinIO's. Chaos lives here: an event may
//! be lost, doubled, late, or one of a bunch that is delivered newest first.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use http_body_util::BodyExt;
use hyper::body::Incoming;
use hyper::header::AUTHORIZATION;
use hyper::{Method, Request, Response, StatusCode};
use percent_encoding::percent_decode_str;
use serde_json::{Value, json};
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio::time::timeout;

use super::chaos::Dice;
use super::queue::{Job, Pending, Pool};
use crate::http::{Body, Server, json};
use crate::observation::{Observer, Seen};
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

/// Hears events that carry `token` on `listener`, and delivers them.
pub(crate) fn receive(
    listener: TcpListener,
    token: &str,
    pools: Pools,
    dice: Arc<Dice>,
    observer: Observer,
    pending: Pending,
    tasks: &mut JoinSet<()>,
) -> Server {
    let (sender, events) = mpsc::unbounded_channel();
    tasks.spawn(deliver(events, pools, dice, pending.clone()));
    let routes = Arc::new(Routes::shared());
    let expected: Arc<str> = format!("Bearer {token}").into();
    Server::start(listener, move |request| {
        let (sender, observer, pending) = (sender.clone(), observer.clone(), pending.clone());
        let (routes, expected) = (routes.clone(), expected.clone());
        async move { Some(take(request, &expected, &routes, &observer, &pending, &sender).await) }
    })
}

async fn take(
    request: Request<Incoming>,
    expected: &str,
    routes: &Routes,
    observer: &Observer,
    pending: &Pending,
    sender: &mpsc::UnboundedSender<Event>,
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
        let function = routes.function(&key, &name);
        observer.see(Seen::Event { function, name, key });
        if let Some(function) = function {
            pending.add();
            if sender.send(Event { function, payload }).is_err() {
                pending.remove();
            }
        }
    }
    json(StatusCode::OK, &json!({}))
}

/// The event's name and the object's key, decoded.
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
}
