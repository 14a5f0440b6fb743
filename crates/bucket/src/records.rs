//! The records in the rows: buckets, objects, uploads, parts and waiting events, as JSON under ordered keys.
//!
//! JSON, because a row to which a later version adds a field can still be read. Knows no protocol.

use std::collections::BTreeMap;
use std::time::{Duration, SystemTime};

use redb::StorageError;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::checksum::Checksum;
use crate::storage::{Batch, BodyId, Row, Table, View};

/// A time in milliseconds since 1970.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Moment(pub(crate) u64);

impl Moment {
    pub(crate) fn now() -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        Self(u64::try_from(since.as_millis()).unwrap_or(u64::MAX))
    }

    pub(crate) fn system_time(self) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_millis(self.0)
    }

    /// Returns the time in the precision of HTTP dates.
    pub(crate) fn whole_seconds(self) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_secs(self.0 / 1000)
    }
}

/// The record of a bucket.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Bucket {
    pub(crate) created: Moment,
    /// The rules that select the changes with events.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) notifications: Vec<Notification>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) cors: Vec<CorsRule>,
}

/// A CORS rule: the requests that pages of some origins may send, and the headers that they see.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CorsRule {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) id: Option<String>,
    /// The allowed origins. One `*` may stand for any text, here and in `headers`.
    pub(crate) origins: Vec<String>,
    pub(crate) methods: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) headers: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) exposed: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) max_age_seconds: Option<i32>,
}

/// A rule that selects the changes with events.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Notification {
    pub(crate) id: String,
    pub(crate) queue: String,
    /// S3's names of events. A `*` at the end stands for any text.
    pub(crate) events: Vec<String>,
    pub(crate) prefix: String,
    pub(crate) suffix: String,
}

/// The headers of an object that describe its content.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Headers {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) content_type: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) cache_control: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) content_disposition: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) content_encoding: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) content_language: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) expires: Option<String>,
    /// The metadata set by the user.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) metadata: BTreeMap<String, String>,
}

/// The location of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Body {
    /// The body is stored in a row.
    Row(BodyId),
    /// The body is stored in a file.
    File(BodyId),
    /// The body consists of the parts in which it was uploaded.
    Parts(BodyId),
}

/// The record of an object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Object {
    pub(crate) size: u64,
    /// The entity tag without quotes.
    pub(crate) etag: String,
    pub(crate) modified: Moment,
    pub(crate) headers: Headers,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) checksum: Option<Checksum>,
    pub(crate) body: Body,
    /// The upload in parts that made the object, so that a completion whose response was lost can be repeated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) upload: Option<String>,
}

/// One of the parts in which an object was uploaded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LayoutPart {
    pub(crate) number: u16,
    pub(crate) size: u64,
    pub(crate) body: Body,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) checksum: Option<Checksum>,
}

/// The parts of an object, in order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Layout {
    pub(crate) parts: Vec<LayoutPart>,
}

/// The record of an unfinished upload.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Upload {
    pub(crate) initiated: Moment,
    pub(crate) headers: Headers,
    /// The algorithm for each part and for the whole object.
    pub(crate) algorithm: crate::checksum::Algorithm,
    pub(crate) kind: crate::checksum::Kind,
    /// Whether the client named the algorithm.
    pub(crate) asked: bool,
}

/// The record of an uploaded part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Part {
    pub(crate) size: u64,
    pub(crate) etag: String,
    pub(crate) modified: Moment,
    pub(crate) body: Body,
    pub(crate) checksum: Checksum,
}

/// A change whose event is not delivered yet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Event {
    pub(crate) bucket: String,
    pub(crate) key: String,
    /// The name of the event, such as `ObjectCreated:Put`.
    pub(crate) name: String,
    pub(crate) time: Moment,
    /// The id of the rule that selected the event.
    pub(crate) configuration: String,
    /// The size of the object that was created.
    pub(crate) size: Option<u64>,
    pub(crate) etag: Option<String>,
    /// The access key that made the change.
    pub(crate) principal: String,
    pub(crate) request: String,
    pub(crate) source: String,
}

/// The keys of rows.
pub(crate) mod key {
    /// Returns the key of an object's row. With an empty `key`, returns the start of a bucket's objects.
    pub(crate) fn object(bucket: &str, key: &[u8]) -> Vec<u8> {
        [bucket.as_bytes(), b"\0", key].concat()
    }

    /// Returns the key of an upload's row. The id has no zero byte, so uploads are ordered by key and id.
    pub(crate) fn upload(bucket: &str, key: &str, id: &str) -> Vec<u8> {
        [bucket.as_bytes(), b"\0", key.as_bytes(), b"\0", id.as_bytes()].concat()
    }

    /// Returns the key of a part's row.
    pub(crate) fn part(upload: &str, number: u16) -> Vec<u8> {
        [upload.as_bytes(), b"\0", &number.to_be_bytes()].concat()
    }

    /// Extracts the object's key from the key of its row.
    pub(crate) fn of_object<'a>(row: &'a [u8], bucket: &str) -> &'a [u8] {
        row.get(bucket.len() + 1..).unwrap_or_default()
    }

    /// Extracts key and id from the key of an upload's row.
    pub(crate) fn of_upload<'a>(row: &'a [u8], bucket: &str) -> (&'a [u8], &'a [u8]) {
        let rest = of_object(row, bucket);
        let end = rest.iter().rposition(|byte| *byte == 0).unwrap_or(rest.len());
        (&rest[..end], rest.get(end + 1..).unwrap_or_default())
    }

    /// Extracts the part number from the key of its row.
    pub(crate) fn of_part(row: &[u8]) -> u16 {
        row.last_chunk().map_or(0, |bytes| u16::from_be_bytes(*bytes))
    }
}

/// Encodes the value of a row.
pub(crate) fn encode<T: Serialize>(record: &T) -> Result<Vec<u8>, StorageError> {
    serde_json::to_vec(record).map_err(|error| StorageError::Corrupted(error.to_string()))
}

/// Decodes the value of a row.
pub(crate) fn decode<T: DeserializeOwned>(value: &[u8]) -> Result<T, StorageError> {
    serde_json::from_slice(value)
        .map_err(|error| StorageError::Corrupted(format!("a row is damaged: {error}")))
}

/// Returns the record at a key.
pub(crate) fn find<T: DeserializeOwned>(
    view: &impl View,
    table: Table,
    key: &[u8],
) -> Result<Option<T>, StorageError> {
    view.get(table, key)?.map(|value| decode(&value)).transpose()
}

/// Writes the record at a key.
pub(crate) fn set<T: Serialize>(
    batch: &mut Batch<'_>,
    table: Table,
    key: &[u8],
    record: &T,
) -> Result<(), StorageError> {
    batch.put(table, key, &encode(record)?)
}

/// Returns all rows whose keys begin with a prefix, in memory. Their number must be bounded.
pub(crate) fn all(view: &impl View, table: Table, prefix: &[u8]) -> Result<Vec<Row>, StorageError> {
    view.beginning_with(table, prefix)?.collect()
}

/// Removes a body that its record no longer refers to, in row, file or parts.
pub(crate) fn release(batch: &mut Batch<'_>, body: Body) -> Result<(), StorageError> {
    match body {
        Body::Row(id) => drop(batch.remove(Table::Bodies, &id.key())?),
        Body::File(id) => {
            batch.remove(Table::Files, &id.key())?;
            batch.discard(id);
        }
        Body::Parts(id) => {
            let layout: Option<Layout> = find(batch, Table::Layouts, &id.key())?;
            batch.remove(Table::Layouts, &id.key())?;
            for part in layout.into_iter().flat_map(|layout| layout.parts) {
                release(batch, part.body)?;
            }
        }
    }
    Ok(())
}

/// Removes an unfinished upload with its parts, given the key of its row.
pub(crate) fn abandon(batch: &mut Batch<'_>, upload: &[u8]) -> Result<(), StorageError> {
    let id = upload.rsplit(|byte| *byte == 0).next().unwrap_or_default();
    for (part, value) in all(batch, Table::Parts, &[id, b"\0"].concat())? {
        release(batch, decode::<Part>(&value)?.body)?;
        batch.remove(Table::Parts, &part)?;
    }
    batch.remove(Table::Uploads, upload).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_taken_apart_again() {
        let row = key::object("films", "a/ü".as_bytes());
        assert_eq!(key::of_object(&row, "films"), "a/ü".as_bytes());
        let row = key::upload("films", "a\0b", "0123");
        assert_eq!(key::of_upload(&row, "films"), (&b"a\0b"[..], &b"0123"[..]));
        assert_eq!(key::of_part(&key::part("0123", 10_000)), 10_000);
        assert!(key::part("0123", 9) < key::part("0123", 10), "parts are in order of their numbers");
        assert!(key::object("film", b"~") < key::object("films", b"a"), "a bucket's objects are together");
    }
}
