//! A bucket in memory, for tests and examples.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::{Bytes, BytesMut};

use super::{
    Bucket, ETag, ListPage, ListRequest, Object, ObjectInfo, Patch, PutOptions, Store, UnfinishedUpload,
    Upload,
};
use crate::clock::Clock;
use crate::{Error, Result};

/// A bucket in memory. Clones share their contents.
#[derive(Debug, Clone)]
pub struct MemoryStore<C> {
    bucket: Arc<Mutex<Bucket>>,
    clock: C,
}

impl<C: Clock> MemoryStore<C> {
    /// Makes an empty bucket. `clock` dates its objects.
    pub fn new(clock: C) -> Self {
        MemoryStore { bucket: Arc::default(), clock }
    }

    fn bucket(&self) -> MutexGuard<'_, Bucket> {
        self.bucket.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<C: Clock + Clone + 'static> Store for MemoryStore<C> {
    type Upload = MemoryUpload<C>;

    async fn get(&self, key: &str) -> Result<Object> {
        self.bucket().get(key)
    }

    async fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
        self.bucket().get_range(key, range)
    }

    async fn head(&self, key: &str) -> Result<ObjectInfo> {
        self.bucket().head(key)
    }

    async fn put(&self, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
        if key.is_empty() || key.len() > 1024 {
            let source = "a key has 1 to 1,024 bytes".into();
            return Err(Error::Refused { key: key.to_owned(), source });
        }
        self.bucket().put(self.clock.now(), key, body, options)
    }

    async fn delete(&self, key: &str) -> Result<()> {
        self.bucket().delete(key);
        Ok(())
    }

    async fn list(&self, request: ListRequest) -> Result<ListPage> {
        Ok(self.bucket().list(&request))
    }

    async fn upload(&self, key: &str, options: PutOptions) -> Result<Self::Upload> {
        Ok(self.take_up(key, options, UnfinishedUpload::default()))
    }

    fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Self::Upload {
        let UnfinishedUpload { id, parts, tail, .. } = unfinished;
        let id = id.and_then(|id| id.parse().ok());
        MemoryUpload { store: self.clone(), key: key.to_owned(), options, id, parts, gathered: tail.into() }
    }
}

/// The number of bytes of a part.
const PART: usize = 1 << 20;

/// An object being written to a [`MemoryStore`].
#[derive(Debug)]
pub struct MemoryUpload<C> {
    store: MemoryStore<C>,
    key: String,
    options: PutOptions,
    id: Option<u64>,
    parts: Vec<ETag>,
    gathered: BytesMut,
}

impl<C: Clock + Clone + 'static> Upload for MemoryUpload<C> {
    async fn write(&mut self, bytes: Bytes) -> Result<()> {
        self.gathered.extend_from_slice(&bytes);
        // A start that may change is sent at the end; here with all the rest.
        while self.gathered.len() >= PART && !self.options.is_start_last {
            let part = self.gathered.split_to(PART).freeze();
            let mut bucket = self.store.bucket();
            let id = *self.id.get_or_insert_with(|| bucket.begin_upload());
            self.parts.push(bucket.put_part(&self.key, id, self.parts.len() + 1, part)?);
        }
        Ok(())
    }

    async fn finish(mut self, patch: Option<Patch>) -> Result<ETag> {
        patch.iter().for_each(|patch| patch.apply(&mut self.gathered));
        let Some(id) = self.id else {
            return self.store.put(&self.key, self.gathered.freeze(), self.options).await;
        };
        let now = self.store.clock.now();
        self.store.bucket().complete_upload(now, &self.key, id, (&self.parts, &self.gathered), self.options)
    }

    async fn abort(self) -> Result<()> {
        if let Some(id) = self.id {
            self.store.bucket().abort_upload(id);
        }
        Ok(())
    }

    fn leave(self) -> UnfinishedUpload {
        let id = self.id.map(|id| id.to_string());
        UnfinishedUpload { id, parts: self.parts, start: Bytes::new(), tail: self.gathered.freeze() }
    }
}

#[cfg(test)]
mod tests {
    use crate::store::{Condition, MemoryStore, PutOptions, Store};

    #[test]
    fn options_keep_what_they_are_given() {
        let options = PutOptions::if_absent().content_type("image/gif").metadata("generation", "g");
        assert_eq!((options.content_type, options.condition), ("image/gif", Condition::IfAbsent));
        assert_eq!(options.metadata.get("generation").map(String::as_str), Some("g"));
    }

    #[tokio::test]
    async fn keys_are_as_long_as_those_of_s3() {
        let store = MemoryStore::new(crate::SystemClock);
        for (length, is_fine) in [(0, false), (1, true), (1_023, true), (1_024, true), (1_025, false)] {
            let put = store.put(&"k".repeat(length), "body".into(), PutOptions::always()).await;
            assert_eq!(put.is_ok(), is_fine, "{length}");
        }
    }
}
