//! A bucket in memory, for tests and examples.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::{Bytes, BytesMut};

use super::{Bucket, ETag, ListPage, ListRequest, Object, ObjectInfo, PutOptions, Store, Upload};
use crate::clock::Clock;
use crate::{Error, Result};

/// A bucket in memory. Clones share their contents.
#[derive(Debug, Clone)]
pub struct MemoryStore<C> {
    bucket: Arc<Mutex<Bucket>>,
    clock: C,
}

impl<C: Clock> MemoryStore<C> {
    /// An empty bucket whose objects are dated by `clock`.
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
        Ok(MemoryUpload { store: self.clone(), key: key.to_owned(), options, body: BytesMut::new() })
    }
}

/// An object being written to a [`MemoryStore`].
#[derive(Debug)]
pub struct MemoryUpload<C> {
    store: MemoryStore<C>,
    key: String,
    options: PutOptions,
    body: BytesMut,
}

impl<C: Clock + Clone + 'static> Upload for MemoryUpload<C> {
    async fn write(&mut self, bytes: Bytes) -> Result<()> {
        self.body.extend_from_slice(&bytes);
        Ok(())
    }

    async fn finish(self) -> Result<ETag> {
        self.store.put(&self.key, self.body.freeze(), self.options).await
    }

    async fn abort(self) -> Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::store::{MemoryStore, conformance};

    #[tokio::test]
    async fn the_memory_store_conforms() {
        conformance::check(&MemoryStore::new(crate::SystemClock), "suite").await;
    }
}
