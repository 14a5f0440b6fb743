//! An invoker on a bucket of any S3 server. Several invokers on one bucket share the work: a cluster without AWS.
//!
//! The functions use the same standard AWS environment as this process to reach the server. Events come from listings
//! ([`Listing`]); a webhook of the server only makes the next listing come sooner.

use std::env;

use rayfold_pipeline::Error as StoreError;
use rayfold_pipeline::store::{ETag, PutOptions, S3Store, Store};

use crate::credentials::token;
use crate::error::{Error, Result};
use crate::functions::Functions;
use crate::http::any_port;
use crate::invoker::{Listing, Settings};
use crate::region::REGION;

/// The prefix of objects that are put to find out what the server supports.
const CHECKS: &str = "checks/";

/// The environment variables that the functions need besides those of AWS.
const PASSED_ON: [&str; 4] = ["HOME", "PATH", "SSL_CERT_FILE", "SSL_CERT_DIR"];

/// The variables that name an endpoint; all of them are set to the server's.
const ENDPOINTS: [&str; 2] = ["AWS_ENDPOINT_URL", "AWS_ENDPOINT_URL_S3"];

/// A bucket that can hold animations.
pub struct Bucket {
    endpoint: String,
    store: S3Store,
}

impl Bucket {
    /// Checks that the bucket exists, and that the server supports conditional puts.
    ///
    /// # Errors
    /// [`Error::Unreachable`], [`Error::NoBucket`], [`Error::Refused`], [`Error::NoConditions`].
    pub async fn open(endpoint: &str, bucket: &str) -> Result<Self> {
        let endpoint = endpoint.trim_end_matches('/').to_owned();
        let store = S3Store::from_environment_at(&endpoint, bucket).await;
        let failed = |error: StoreError| match &error {
            StoreError::Refused { source, .. } if source.to_string().contains("NoSuchBucket") => {
                Error::NoBucket { endpoint: endpoint.clone(), bucket: bucket.to_owned() }
            }
            StoreError::Refused { .. } => {
                Error::Refused { endpoint: endpoint.clone(), bucket: bucket.to_owned(), source: error }
            }
            _ => Error::Unreachable { endpoint: endpoint.clone(), source: error },
        };
        store.check().await.map_err(failed)?;
        let key = format!("{CHECKS}{}", token(8)?);
        let checked = conditions(&store, &key).await;
        let cleared = store.delete(&key).await;
        match checked {
            Ok(()) => cleared.map_err(failed)?,
            Err(Unfit::Store(error)) => return Err(failed(error)),
            Err(Unfit::Problem(problem)) => return Err(Error::NoConditions { endpoint, problem }),
        }
        Ok(Self { endpoint, store })
    }

    /// Returns the store of the bucket.
    pub fn store(&self) -> &S3Store {
        &self.store
    }

    /// Returns the settings of an invoker on this bucket.
    ///
    /// # Errors
    /// [`Error::Random`] if the system has no random bytes.
    pub fn settings(&self, functions: Functions) -> Result<Settings> {
        let mut settings = Settings::new(functions, None, any_port(), token(16)?);
        settings.listing = Some(Listing::new(self.store.clone(), &token(8)?));
        let passed_on = |name: &str| {
            (name.starts_with("AWS_") && !ENDPOINTS.contains(&name)) || PASSED_ON.contains(&name)
        };
        settings.environment = env::vars().filter(|(name, _)| passed_on(name)).collect();
        let endpoints = ENDPOINTS.map(|name| (name, self.endpoint.as_str()));
        let region = self.store.region().unwrap_or(REGION);
        for (name, value) in
            endpoints.into_iter().chain([("AWS_REGION", region), ("RAYFOLD_BUCKET", self.store.bucket())])
        {
            settings.environment.push((name.to_owned(), value.to_owned()));
        }
        Ok(settings)
    }
}

#[derive(Debug)]
enum Unfit {
    Store(StoreError),
    Problem(&'static str),
}

/// Checks all conditions by puts of one object, which stays in the bucket.
async fn conditions(store: &impl Store, key: &str) -> Result<(), Unfit> {
    let put = |body: &'static str, options| store.put(key, body.into(), options);
    let absent = || put("absent", PutOptions::if_absent());
    let (a, b, c, d) = tokio::join!(absent(), absent(), absent(), absent());
    let mut winners = 0;
    for answer in [a, b, c, d] {
        winners += usize::from(took_effect(answer)?);
    }
    match winners {
        // With 0, all answers may have been lost and the put repeated.
        0 | 1 => {}
        _ => return Err(Unfit::Problem("several puts with If-None-Match: * of one key took effect")),
    }
    let first = store.head(key).await.map_err(Unfit::Store)?.etag;
    if took_effect(put("other", PutOptions::if_match(ETag::new(&"0".repeat(32)))).await)? {
        return Err(Unfit::Problem("a put with If-Match took effect on another version"));
    }
    if !took_effect(put("second", PutOptions::if_match(first.clone())).await)? {
        return Err(Unfit::Problem("a put with If-Match had no effect on its version"));
    }
    store.delete(key).await.map_err(Unfit::Store)?;
    if took_effect(put("third", PutOptions::if_match(first)).await)? {
        return Err(Unfit::Problem("a put with If-Match took effect without an object"));
    }
    Ok(())
}

fn took_effect(answer: Result<ETag, StoreError>) -> Result<bool, Unfit> {
    match answer {
        Ok(_) => Ok(true),
        Err(error) if error.is_conflict() || error.is_not_found() => Ok(false),
        Err(error) => Err(Unfit::Store(error)),
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use rayfold_pipeline::store::{
        ListPage, ListRequest, MemoryStore, MemoryUpload, Object, ObjectInfo, UnfinishedUpload,
    };
    use rayfold_pipeline::{Result as StoreResult, SystemClock};

    use super::*;

    /// A store that supports all conditions, only those of one kind, or none.
    struct Careless {
        store: MemoryStore<SystemClock>,
        absent: bool,
        matching: bool,
    }

    impl Store for Careless {
        type Upload = MemoryUpload<SystemClock>;

        async fn get(&self, key: &str) -> StoreResult<Object> {
            self.store.get(key).await
        }

        async fn get_range(&self, key: &str, range: std::ops::Range<u64>) -> StoreResult<Object> {
            self.store.get_range(key, range).await
        }

        async fn head(&self, key: &str) -> StoreResult<ObjectInfo> {
            self.store.head(key).await
        }

        async fn put(&self, key: &str, body: Bytes, mut options: PutOptions) -> StoreResult<ETag> {
            use rayfold_pipeline::store::Condition;
            match options.condition {
                Condition::IfAbsent if self.absent => {}
                Condition::IfMatch(_) if self.matching => {}
                _ => options.condition = Condition::Always,
            }
            self.store.put(key, body, options).await
        }

        async fn delete(&self, key: &str) -> StoreResult<()> {
            self.store.delete(key).await
        }

        async fn list(&self, request: ListRequest) -> StoreResult<ListPage> {
            self.store.list(request).await
        }

        async fn upload(&self, key: &str, options: PutOptions) -> StoreResult<Self::Upload> {
            self.store.upload(key, options).await
        }

        fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Self::Upload {
            self.store.take_up(key, options, unfinished)
        }
    }

    #[tokio::test]
    async fn a_store_without_conditional_puts_is_found_out() {
        for (absent, matching, expected) in
            [(true, true, None), (false, true, Some("If-None-Match")), (true, false, Some("If-Match"))]
        {
            let store = Careless { store: MemoryStore::new(SystemClock), absent, matching };
            match (conditions(&store, "checks/1").await, expected) {
                (Ok(()), None) => {}
                (Err(Unfit::Problem(problem)), Some(header)) if problem.contains(header) => {}
                (found, _) => panic!("{absent} {matching}: {found:?}"),
            }
        }
    }
}
