//! Delivery of events from the outbox to the webhook: every event at least once, those of one object in order.
//!
//! Events of several objects are sent at the same time. An event leaves the outbox after the listener has answered
//! 200. After any other answer all events wait a little and are tried again, without limit. Events that a kill leaves
//! in the outbox are delivered after the next start, some for the second time.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use bytes::Bytes;
use http_body_util::Full;
use hyper::header::{AUTHORIZATION, CONTENT_TYPE, HeaderValue};
use hyper::{Request, StatusCode, Uri};
use hyper_util::client::legacy::Client;
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioExecutor;
use redb::StorageError;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep_until, timeout};

use crate::events::message;
use crate::options::Webhook;
use crate::records::{Event, decode};
use crate::storage::{Kind, Storage, Table, View};
use crate::{Error, Result};

/// The number of events that are sent at the same time.
const IN_FLIGHT: usize = 32;

/// The number of events in memory. The others wait in the outbox.
const WINDOW: usize = 1024;

/// The pause after a failure. It doubles with each further failure, up to the longest.
const FIRST_PAUSE: Duration = Duration::from_millis(20);
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// The time limit of a delivery: longer than a listener takes to store an event.
const DELIVERY_TIMEOUT: Duration = Duration::from_secs(10);

/// A worker that delivers events, see the module.
pub(crate) struct Delivery {
    storage: Storage,
    region: String,
    courier: Courier,
    /// The events read from the outbox, in order.
    waiting: VecDeque<Letter>,
    /// The row that was read last.
    read: Vec<u8>,
    /// The objects with an event on its way.
    busy: BTreeSet<(String, String)>,
}

#[derive(Clone)]
struct Courier {
    client: Client<HttpConnector, Full<Bytes>>,
    uri: Uri,
    authorization: HeaderValue,
}

struct Letter {
    row: Vec<u8>,
    event: Event,
}

impl Letter {
    fn object(&self) -> (String, String) {
        (self.event.bucket.clone(), self.event.key.clone())
    }
}

impl Delivery {
    /// # Errors
    /// [`Error::Webhook`] if the URL or the token cannot be used.
    pub(crate) fn new(storage: Storage, region: &str, webhook: &Webhook) -> Result<Self> {
        let wrong = |reason: &str| Error::Webhook { url: webhook.url.clone(), reason: reason.to_owned() };
        let uri: Uri = webhook.url.parse().map_err(|_| wrong("it is not a URL"))?;
        if uri.scheme_str() != Some("http") || uri.host().is_none() {
            return Err(wrong("it does not begin with http:// and a host"));
        }
        let mut authorization = HeaderValue::from_str(&format!("Bearer {}", webhook.token))
            .map_err(|_| wrong("its token has a character that is not allowed in a header"))?;
        authorization.set_sensitive(true);
        let mut connector = HttpConnector::new();
        connector.set_nodelay(true);
        let client = Client::builder(TokioExecutor::new()).build(connector);
        let courier = Courier { client, uri, authorization };
        let (waiting, read, busy) = (VecDeque::new(), Vec::new(), BTreeSet::new());
        Ok(Self { storage, region: region.to_owned(), courier, waiting, read, busy })
    }

    /// Delivers events until it is dropped.
    pub(crate) async fn run(mut self) {
        let mut on_the_way: JoinSet<(Letter, bool)> = JoinSet::new();
        let mut pause = FIRST_PAUSE;
        let mut resume: Option<Instant> = None;
        loop {
            if resume.is_none() {
                self.read_on().await;
                while on_the_way.len() < IN_FLIGHT
                    && let Some(letter) = self.next()
                {
                    self.busy.insert(letter.object());
                    on_the_way.spawn(carry(self.courier.clone(), letter, self.region.clone()));
                }
            }
            tokio::select! {
                Some(carried) = on_the_way.join_next() => {
                    let mut delivered = Vec::new();
                    let mut next = Some(carried);
                    while let Some(carried) = next {
                        // A courier does not panic and is not cancelled.
                        if let Ok((letter, arrived)) = carried {
                            self.busy.remove(&letter.object());
                            if arrived {
                                delivered.push(letter.row);
                                pause = FIRST_PAUSE;
                            } else {
                                self.waiting.push_front(letter);
                                resume = Some(Instant::now() + pause);
                            }
                        }
                        next = on_the_way.try_join_next();
                    }
                    if resume.is_some() {
                        pause = (pause * 2).min(LONGEST_PAUSE);
                    }
                    self.forget(delivered);
                }
                () = self.storage.changed() => {}
                () = until(resume) => resume = None,
            }
        }
    }

    /// Reads rows until the window is full. If a read fails, it is repeated after the next change.
    async fn read_on(&mut self) {
        if self.waiting.len() > WINDOW / 2 {
            return;
        }
        let (storage, from, room) = (self.storage.clone(), self.read.clone(), WINDOW - self.waiting.len());
        let read = tokio::task::spawn_blocking(move || letters(&storage, &from, room)).await;
        if let Ok(Some(letters)) = read {
            if let Some(last) = letters.last() {
                self.read.clone_from(&last.row);
            }
            self.waiting.extend(letters);
        }
    }

    /// Removes and returns the first event whose object has no other on its way.
    fn next(&mut self) -> Option<Letter> {
        let at = self.waiting.iter().position(|letter| !self.busy.contains(&letter.object()))?;
        self.waiting.remove(at)
    }

    /// Removes delivered events from the outbox, together with the next other write.
    fn forget(&self, rows: Vec<Vec<u8>>) {
        if rows.is_empty() {
            return;
        }
        let storage = self.storage.clone();
        tokio::spawn(async move {
            let forgotten = storage.change(Kind::Lazy, move |batch| {
                rows.iter().try_for_each(|row| batch.remove(Table::Outbox, row).map(drop))
            });
            // If this fails, the event stays and is delivered once more after the next start.
            let _ = forgotten.await;
        });
    }
}

fn letters(storage: &Storage, after: &[u8], room: usize) -> Option<Vec<Letter>> {
    let snapshot = storage.snapshot().ok()?;
    let letters: std::result::Result<Vec<Letter>, StorageError> = snapshot
        .from(Table::Outbox, after)
        .ok()?
        .filter(|row| row.as_ref().map_or(true, |(key, _)| key != after))
        .take(room)
        .map(|row| row.and_then(|(row, value)| Ok(Letter { row, event: decode(&value)? })))
        .collect();
    letters.ok()
}

/// Sends an event to the listener. Returns whether it was delivered.
async fn carry(courier: Courier, letter: Letter, region: String) -> (Letter, bool) {
    let sequencer = letter.row.as_slice().try_into().map_or(0, u64::from_be_bytes);
    let body = message(&letter.event, sequencer, &region).to_string();
    let request = Request::post(courier.uri)
        .header(AUTHORIZATION, courier.authorization)
        .header(CONTENT_TYPE, "application/json")
        .body(Full::new(Bytes::from(body)));
    let arrived = match request {
        Ok(request) => {
            let answer = timeout(DELIVERY_TIMEOUT, courier.client.request(request)).await;
            matches!(answer, Ok(Ok(response)) if response.status() == StatusCode::OK)
        }
        Err(_) => false,
    };
    (letter, arrived)
}

async fn until(moment: Option<Instant>) {
    match moment {
        Some(moment) => sleep_until(moment).await,
        None => std::future::pending().await,
    }
}
