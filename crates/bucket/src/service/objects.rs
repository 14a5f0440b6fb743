//! An object as rows: storing it, removing it, and its events.

use redb::StorageError;
use s3s::dto::Timestamp;

use super::conditions::WriteConditions;
use super::ingest::Content;
use super::{Caller, ChangeError};
use crate::answer::{Answer, invalid_request, no_such_bucket};
use crate::records::{self, Body, Bucket, Event, Headers, Moment, Object, find, key, release, set};
use crate::storage::{Batch, Bodies, Table, View};

/// The longest key in bytes of UTF-8.
pub(crate) const LONGEST_KEY: usize = 1024;

/// The largest user metadata in bytes, names and values together.
const MAX_METADATA: usize = 2 * 1024;

/// The largest number of events that wait for the listener. A change that would exceed it is refused, so that
/// no event is lost.
const MAX_WAITING: u64 = 1_000_000;

/// The destination of an object, with the conditions of the write.
pub(crate) struct Destination {
    pub(crate) bucket: String,
    pub(crate) key: String,
    pub(crate) conditions: WriteConditions,
    pub(crate) caller: Caller,
}

/// Returns the bucket as seen by the change.
pub(crate) fn bucket(batch: &Batch<'_>, name: &str) -> Result<Bucket, ChangeError> {
    find(batch, Table::Buckets, name.as_bytes())?.ok_or_else(|| no_such_bucket().into())
}

/// Checks everything that may refuse an object at its destination. Returns the bucket and the existing object.
pub(crate) fn admit(batch: &Batch<'_>, to: &Destination) -> Result<(Bucket, Option<Object>), ChangeError> {
    let bucket = bucket(batch, &to.bucket)?;
    let existing = find(batch, Table::Objects, &key::object(&to.bucket, to.key.as_bytes()))?;
    to.conditions.check(existing.as_ref())?;
    if !bucket.notifications.is_empty() && is_full(batch.count(Table::Outbox)?) {
        return Err(s3s::s3_error!(SlowDown, "too many events wait for their listener").into());
    }
    Ok((bucket, existing))
}

/// Stores a body. Returns its location.
pub(crate) fn keep(batch: &mut Batch<'_>, ids: &Bodies, content: Content) -> Result<Body, StorageError> {
    match content {
        Content::Row(bytes) => {
            let id = ids.id();
            batch.put(Table::Bodies, &id.key(), &bytes)?;
            Ok(Body::Row(id))
        }
        Content::File(file) => {
            let id = file.id();
            batch.put(Table::Files, &id.key(), &[])?;
            batch.adopt(file);
            Ok(Body::File(id))
        }
    }
}

/// Puts an object in place of an existing one, and writes the event.
pub(crate) fn place(
    batch: &mut Batch<'_>,
    ids: &Bodies,
    to: &Destination,
    (bucket, existing): (Bucket, Option<Object>),
    object: &Object,
    event: &str,
) -> Result<(), StorageError> {
    if let Some(existing) = existing {
        release(batch, existing.body)?;
    }
    set(batch, Table::Objects, &key::object(&to.bucket, to.key.as_bytes()), object)?;
    tell(batch, ids, (&to.bucket, &bucket), &to.key, event, Some(object), &to.caller)
}

/// Writes the event of a change, if a rule of the bucket selects it.
pub(crate) fn tell(
    batch: &mut Batch<'_>,
    ids: &Bodies,
    (name, bucket): (&str, &Bucket),
    key: &str,
    event: &str,
    object: Option<&Object>,
    caller: &Caller,
) -> Result<(), StorageError> {
    for rule in bucket.notifications.iter().filter(|rule| rule.wants(event, key)) {
        let event = Event {
            bucket: name.to_owned(),
            key: key.to_owned(),
            name: event.to_owned(),
            time: Moment::now(),
            configuration: rule.id.clone(),
            size: object.map(|object| object.size),
            etag: object.map(|object| object.etag.clone()),
            principal: caller.principal.clone(),
            request: caller.origin.request.clone(),
            source: caller.origin.source.clone(),
        };
        set(batch, Table::Outbox, &ids.id().key(), &event)?;
    }
    Ok(())
}

/// Returns whether the limit of waiting events is reached.
fn is_full(waiting: u64) -> bool {
    waiting >= MAX_WAITING
}

impl records::Notification {
    fn wants(&self, event: &str, key: &str) -> bool {
        let named = |pattern: &String| {
            let pattern = pattern.strip_prefix("s3:").unwrap_or(pattern);
            match pattern.strip_suffix('*') {
                Some(start) => event.starts_with(start),
                None => event == pattern,
            }
        };
        key.starts_with(&self.prefix) && key.ends_with(&self.suffix) && self.events.iter().any(named)
    }
}

/// Checks that a key is valid.
pub(crate) fn check_key(key: &str) -> Answer<()> {
    if key.is_empty() {
        return Err(invalid_request("The key is empty."));
    }
    if key.len() > LONGEST_KEY {
        return Err(s3s::s3_error!(KeyTooLongError, "Your key is too long"));
    }
    Ok(())
}

/// Checks that the metadata of a new object is within S3's limit.
pub(crate) fn check_metadata(headers: &Headers) -> Answer<()> {
    let size: usize = headers.metadata.iter().map(|(name, value)| name.len() + value.len()).sum();
    if size > MAX_METADATA {
        return Err(s3s::s3_error!(
            MetadataTooLarge,
            "Your metadata headers exceed the maximum allowed metadata size ({MAX_METADATA} bytes)"
        ));
    }
    Ok(())
}

/// Formats the date of an `Expires` header for storing.
pub(crate) fn expires(date: Option<&Timestamp>) -> Option<String> {
    let mut text = Vec::new();
    date?.format(s3s::dto::TimestampFormat::HttpDate, &mut text).ok()?;
    String::from_utf8(text).ok()
}

#[cfg(test)]
mod tests {
    use super::is_full;
    use crate::records::Notification;

    #[test]
    fn a_million_events_wait_and_no_more() {
        assert!(!is_full(999_999) && is_full(1_000_000));
    }

    #[test]
    fn rules_want_by_event_prefix_and_suffix() {
        let rule = Notification {
            id: "1".into(),
            queue: "arn".into(),
            events: vec!["s3:ObjectCreated:*".into(), "s3:ObjectRemoved:Delete".into()],
            prefix: "scripts/".into(),
            suffix: ".txt".into(),
        };
        assert!(rule.wants("ObjectCreated:Put", "scripts/a.txt"));
        assert!(rule.wants("ObjectCreated:CompleteMultipartUpload", "scripts/a.txt"));
        assert!(rule.wants("ObjectRemoved:Delete", "scripts/a.txt"));
        assert!(!rule.wants("ObjectRemoved:DeleteMarkerCreated", "scripts/a.txt"));
        assert!(!rule.wants("ObjectCreated:Put", "frames/a.txt"));
        assert!(!rule.wants("ObjectCreated:Put", "scripts/a.json"));
    }
}
