//! Events from listings, for a store that sends none: the objects that are new or gone since the listing before.
//!
//! An object is new if its entity tag or its time is new. Objects that exist at the start are left to the sweep. Only
//! this invoker's share of the events is delivered ([`Members`]).
//!
//! A store with times in whole seconds hides a second put of the same body within one second. The protocol tolerates
//! this: a script that is put again unchanged needs no work, and an object that triggers an invocation names its
//! writer.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::Duration;

use rayfold_pipeline::Timestamp;
use rayfold_pipeline::store::{ETag, ListRequest, Store};
use tokio::sync::{Notify, mpsc, oneshot};
use tokio::task::JoinSet;

use super::events::{Delivery, written};
use super::members::Members;
use super::queue::Pending;
use super::settings::Listing;
use crate::routes::Routes;

const CREATED: &str = "ObjectCreated:Put";
const REMOVED: &str = "ObjectRemoved:Delete";

/// The pause before a failed listing is tried again.
const AGAIN: Duration = Duration::from_millis(200);

type Version = (ETag, Timestamp);

/// A change between two listings. They are ordered by time.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Change {
    /// The time of the put; deletions have none, and come first.
    at: Timestamp,
    key: String,
    /// The name of the event.
    name: &'static str,
    /// The object's entity tag, unless it is gone.
    etag: Option<ETag>,
}

/// A handle to the task that lists.
pub(crate) struct Watcher {
    looks: mpsc::UnboundedSender<oneshot::Sender<()>>,
    hint: Arc<Notify>,
}

impl Watcher {
    /// Starts the task. `ready` is called after the first listing: later changes are events.
    pub(crate) fn start(
        listing: Listing,
        members: Arc<Members>,
        delivery: Delivery,
        pending: Pending,
        ready: impl FnOnce() + Send + 'static,
        tasks: &mut JoinSet<()>,
    ) -> Self {
        let (sender, looks) = mpsc::unbounded_channel();
        let hint = Arc::new(Notify::new());
        let hinted = hint.clone();
        pending.add();
        tasks.spawn(async move {
            let mut bucket = Contents::default();
            while bucket.update(&listing).await.is_err() {
                tokio::time::sleep(AGAIN).await;
            }
            ready();
            pending.remove();
            watch(&listing, &members, &delivery, bucket, looks, &hinted).await;
        });
        Self { looks: sender, hint }
    }

    /// Returns the notification that makes the task list at once.
    pub(crate) fn hint(&self) -> Arc<Notify> {
        self.hint.clone()
    }

    /// Waits for a listing that began after the call, until its events were delivered.
    pub(crate) async fn look(&self) {
        let (done, seen) = oneshot::channel();
        if self.looks.send(done).is_ok() {
            let _ = seen.await;
        }
    }
}

async fn watch(
    listing: &Listing,
    members: &Members,
    delivery: &Delivery,
    mut bucket: Contents,
    mut looks: mpsc::UnboundedReceiver<oneshot::Sender<()>>,
    hint: &Notify,
) {
    let (mut waiting, mut pause) = (Vec::new(), listing.every);
    loop {
        tokio::select! {
            () = tokio::time::sleep(pause) => {}
            () = hint.notified() => {}
            Some(look) = looks.recv() => waiting.push(look),
        }
        while let Ok(look) = looks.try_recv() {
            waiting.push(look);
        }
        let Ok(changes) = bucket.update(listing).await else {
            pause = AGAIN;
            continue;
        };
        pause = listing.every;
        for Change { key, name, etag, .. } in changes {
            if members.owns(&key) {
                delivery.take(name, &key, written(listing.store.bucket(), name, &key, etag.as_ref()));
            }
        }
        for look in waiting.drain(..) {
            let _ = look.send(());
        }
    }
}

/// The content of the last listing.
#[derive(Default)]
struct Contents {
    objects: BTreeMap<String, HashMap<String, Version>>,
}

impl Contents {
    /// Lists, and returns the changes, the oldest first.
    async fn update(&mut self, listing: &Listing) -> rayfold_pipeline::Result<Vec<Change>> {
        let mut changes = Vec::new();
        for route in Routes::shared().iter() {
            let found = list(listing, &route.prefix).await?;
            let known = self.objects.entry(route.prefix.clone()).or_default();
            changes.extend(changed(known, &found));
            *known = found;
        }
        changes.sort();
        Ok(changes)
    }
}

/// Returns the changes between two listings, in no order.
fn changed(known: &HashMap<String, Version>, found: &HashMap<String, Version>) -> Vec<Change> {
    let gone = known.keys().filter(|key| !found.contains_key(*key));
    let gone = gone.map(|key| Change { at: Timestamp(0), key: key.clone(), name: REMOVED, etag: None });
    let new = found.iter().filter(|(key, version)| known.get(*key) != Some(version));
    let new = new.map(|(key, (etag, at))| Change {
        at: *at,
        key: key.clone(),
        name: CREATED,
        etag: Some(etag.clone()),
    });
    gone.chain(new).collect()
}

async fn list(listing: &Listing, prefix: &str) -> rayfold_pipeline::Result<HashMap<String, Version>> {
    let (mut found, mut request) = (HashMap::new(), ListRequest::all(prefix));
    loop {
        let page = listing.store.list(request.clone()).await?;
        found.extend(page.objects.into_iter().map(|object| (object.key, (object.etag, object.modified))));
        match page.next {
            Some(next) => request.continuation = Some(next),
            None => return Ok(found),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listing(objects: &[(&str, &str, u64)]) -> HashMap<String, Version> {
        let version = |tag: &str, at| (ETag::new(tag), Timestamp(at));
        objects.iter().map(|(key, tag, at)| ((*key).to_owned(), version(tag, *at))).collect()
    }

    #[test]
    fn new_bodies_new_times_and_deletions_are_changes() {
        let before = listing(&[("same", "x", 1), ("body", "x", 1), ("time", "x", 1), ("gone", "x", 1)]);
        let after = listing(&[("same", "x", 1), ("body", "y", 1), ("time", "x", 2), ("new", "x", 3)]);
        let mut changes = changed(&before, &after);
        changes.sort();
        let expected = [
            (0, "gone", REMOVED, None),
            (1, "body", CREATED, Some("y")),
            (2, "time", CREATED, Some("x")),
            (3, "new", CREATED, Some("x")),
        ];
        let expected = expected.map(|(at, key, name, etag)| Change {
            at: Timestamp(at),
            key: key.to_owned(),
            name,
            etag: etag.map(ETag::new),
        });
        assert_eq!(changes, expected);
        assert!(changed(&after, &after).is_empty());
    }
}
