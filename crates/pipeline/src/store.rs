//! A bucket as the protocol needs it: objects under keys, conditional puts, listings.
//!
//! The trait has the operations of S3 that the protocol needs, and no more; it knows nothing of animations. Every call
//! is one request (an [`Upload`] is several). An invocation may be killed at every `await` of one.
//!
//! Every store guarantees the following, and the suite `conformance` of `crates/simulation` checks it:
//!
//! - A read or listing that starts after a put was answered sees that put, or a later one.
//! - An object appears whole or not at all.
//! - [`Condition::IfAbsent`] and [`Condition::IfMatch`] are atomic: if two writers have the same condition, one wins.
//! - Listings come in the byte order of the keys.
//!
//! A store may repeat a request whose reply was lost. A conditional put may then fail because of its own success, with
//! [`Error::PreconditionFailed`](crate::Error::PreconditionFailed). Callers must handle that.
//!
//! ```
//! use rayfold_pipeline::store::{MemoryStore, PutOptions, Store};
//! # #[tokio::main(flavor = "current_thread")] async fn main() -> rayfold_pipeline::Result<()> {
//! let store = MemoryStore::new(rayfold_pipeline::SystemClock);
//! store.put("a/b", "first".into(), PutOptions::if_absent()).await?;
//! let again = store.put("a/b", "second".into(), PutOptions::if_absent()).await;
//! assert!(again.unwrap_err().is_conflict());
//! assert_eq!(store.get("a/b").await?.body, "first");
//! # Ok(()) }
//! ```

use std::collections::BTreeMap;
use std::fmt;
use std::future::Future;
use std::ops::Range;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::Result;
use crate::clock::Timestamp;

mod bucket;
mod listing;
mod memory;
#[cfg(feature = "s3")]
mod s3;

pub use bucket::Bucket;
pub use listing::Listing;
pub use memory::{MemoryStore, MemoryUpload};
#[cfg(feature = "s3")]
pub use s3::{Connection, Notification, S3Store, S3Upload};

/// The most names that a store returns in one page of a listing.
pub const PAGE: usize = 1000;

/// An object's entity tag, without the quotes. It is opaque: equal tags of one key mean equal bodies, and nothing else.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ETag(String);

impl ETag {
    /// Makes a tag from the store's text, with or without quotes.
    pub fn new(text: &str) -> Self {
        ETag(text.trim_matches('"').to_owned())
    }

    /// The tag without quotes.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for ETag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// User metadata of an object: lower-case ASCII names without prefix, ASCII values, 2 KB together.
pub type Metadata = BTreeMap<String, String>;

/// The properties of an object without its body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectInfo {
    /// The entity tag, which identifies the body.
    pub etag: ETag,
    /// The number of bytes of the whole body, also if only a range of it was read.
    pub size: u64,
    /// The time of the put, by the store's clock (whole seconds on S3).
    pub modified: Timestamp,
    /// The metadata as it was put.
    pub metadata: Metadata,
}

/// An object, or a range of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Object {
    /// All data but the body.
    pub info: ObjectInfo,
    /// The bytes that were asked for.
    pub body: Bytes,
}

/// The condition under which a put takes effect.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Condition {
    /// The put always takes effect, and replaces an existing object.
    #[default]
    Always,
    /// The put takes effect only while there is no such object (`If-None-Match: *`). Otherwise it fails with
    /// `PreconditionFailed`.
    IfAbsent,
    /// The put takes effect only while the object has this tag (`If-Match`). Otherwise it fails with
    /// `PreconditionFailed`, or with `NotFound` if the object is gone.
    IfMatch(ETag),
}

/// The options of a write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PutOptions {
    /// The condition for the write.
    pub condition: Condition,
    /// The media type of the body.
    pub content_type: &'static str,
    /// The user metadata of the object.
    pub metadata: Metadata,
    /// Whether an upload holds back the start of the object until its end, when it may be [changed](Upload::finish).
    pub is_start_last: bool,
}

impl PutOptions {
    /// Puts in any case.
    pub fn always() -> Self {
        PutOptions {
            condition: Condition::Always,
            content_type: "application/octet-stream",
            metadata: Metadata::new(),
            is_start_last: false,
        }
    }

    /// Puts the object only if it is absent.
    pub fn if_absent() -> Self {
        PutOptions { condition: Condition::IfAbsent, ..Self::always() }
    }

    /// Replaces only this version.
    pub fn if_match(etag: ETag) -> Self {
        PutOptions { condition: Condition::IfMatch(etag), ..Self::always() }
    }

    /// Sets the media type of the body.
    pub fn content_type(self, content_type: &'static str) -> Self {
        PutOptions { content_type, ..self }
    }

    /// Holds back the start of an upload until its end.
    pub fn start_last(self) -> Self {
        PutOptions { is_start_last: true, ..self }
    }

    /// Adds an entry to the metadata.
    pub fn metadata(mut self, name: &str, value: &str) -> Self {
        self.metadata.insert(name.to_owned(), value.to_owned());
        self
    }
}

/// The parameters of a listing, or of its continuation.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ListRequest {
    /// Only keys that begin with this are listed.
    pub prefix: String,
    /// Keys with a further `/` after the prefix are rolled up into one entry of `prefixes`.
    pub delimiter: bool,
    /// Only keys after this one, in byte order, are listed.
    pub start_after: Option<String>,
    /// The [`ListPage::next`] of the previous page.
    pub continuation: Option<String>,
}

impl ListRequest {
    /// Lists all keys below a prefix.
    pub fn all(prefix: impl Into<String>) -> Self {
        ListRequest { prefix: prefix.into(), ..Self::default() }
    }

    /// Lists the keys and the folders directly below a prefix.
    pub fn level(prefix: impl Into<String>) -> Self {
        ListRequest { delimiter: true, ..Self::all(prefix) }
    }
}

/// An object in a listing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// The whole key of the object.
    pub key: String,
    /// The entity tag, which identifies its body.
    pub etag: ETag,
    /// The number of bytes of its body.
    pub size: u64,
    /// The time of the put, by the store's clock.
    pub modified: Timestamp,
}

/// Up to [`PAGE`] entries of a listing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ListPage {
    /// Objects, in the byte order of their keys.
    pub objects: Vec<Listed>,
    /// Rolled-up prefixes with their closing `/`, in byte order.
    pub prefixes: Vec<String>,
    /// The position at which the listing continues; `None` at its end.
    pub next: Option<String>,
}

/// An unfinished upload with its progress, for the invocation that resumes it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct UnfinishedUpload {
    /// The store's name for the upload; `None` before the first part.
    pub id: Option<String>,
    /// The entity tags of the parts that the store has, in order.
    pub parts: Vec<ETag>,
    /// The first part if it is sent last. It is empty while it is shorter than a part.
    #[serde(skip)]
    pub start: Bytes,
    /// The bytes after the last part: fewer than a part has.
    #[serde(skip)]
    pub tail: Bytes,
}

/// Bytes that replace others at the start of an object, within its first 4 KiB.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Patch {
    /// The offset of the first byte.
    pub at: usize,
    /// The new bytes.
    pub bytes: Bytes,
}

impl Patch {
    /// Changes the start of an object.
    pub fn apply(&self, start: &mut [u8]) {
        if let Some(old) = start.get_mut(self.at..self.at + self.bytes.len()) {
            old.copy_from_slice(&self.bytes);
        }
    }
}

/// A bucket. See the [module](self) for its guarantees.
pub trait Store: Send + Sync {
    /// An object being written piece by piece.
    type Upload: Upload;

    /// Reads a whole object.
    fn get(&self, key: &str) -> impl Future<Output = Result<Object>> + Send;

    /// Reads the bytes `range` of an object, or fewer if the object ends before. The range starts inside the object or
    /// at 0.
    fn get_range(&self, key: &str, range: Range<u64>) -> impl Future<Output = Result<Object>> + Send;

    /// Reads all but the body.
    fn head(&self, key: &str) -> impl Future<Output = Result<ObjectInfo>> + Send;

    /// Writes an object whole.
    fn put(&self, key: &str, body: Bytes, options: PutOptions) -> impl Future<Output = Result<ETag>> + Send;

    /// Removes an object. It is no error if there is none.
    fn delete(&self, key: &str) -> impl Future<Output = Result<()>> + Send;

    /// Reads one page of a listing.
    fn list(&self, request: ListRequest) -> impl Future<Output = Result<ListPage>> + Send;

    /// Begins an object that is too large to hold in memory. Nothing is visible before [`Upload::finish`], where
    /// the condition is checked.
    fn upload(&self, key: &str, options: PutOptions) -> impl Future<Output = Result<Self::Upload>> + Send;

    /// Continues an object that this process or another one has [left](Upload::leave). `options` are those that it
    /// began with. It sends no request, so only the next request shows whether the upload still exists. If another
    /// process has finished or aborted it, sending a part fails with `NotFound`, and finishing fails with `NotFound` or
    /// `Ambiguous`.
    ///
    /// It does no harm if the same upload is resumed twice with the same bytes.
    fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Self::Upload;
}

/// An object being written piece by piece, with memory that does not grow with its size.
///
/// It ends with [`finish`](Upload::finish) or [`abort`](Upload::abort), or is [left](Upload::leave) to be resumed
/// later. An upload that is merely dropped, as by a killed process, leaves nothing visible, only parts that the
/// bucket's lifecycle rule deletes.
pub trait Upload: Send {
    /// Adds any number of bytes. The store collects them into parts of its own size.
    fn write(&mut self, bytes: Bytes) -> impl Future<Output = Result<()>> + Send;

    /// Makes the object visible, under the condition that the upload began with. If the condition does not hold, the
    /// upload is aborted, and the error is that of a conditional put. `patch` changes the start of the object, in
    /// uploads that [hold it back](PutOptions::start_last).
    fn finish(self, patch: Option<Patch>) -> impl Future<Output = Result<ETag>> + Send;

    /// Aborts the upload. Nothing becomes visible.
    fn abort(self) -> impl Future<Output = Result<()>> + Send;

    /// Stops here, without a request. [`Store::take_up`] continues the upload.
    fn leave(self) -> UnfinishedUpload;
}
