//! A bucket of S3, or of another server with S3's API.
//!
//! AWS's types are used only in this module: callers see the [`Store`] trait and the pipeline's errors. Credentials and
//! endpoint are taken from the standard AWS environment (variables, profile, the function's role). Whenever an endpoint
//! is set, buckets are addressed by path, as MinIO requires.
//!
//! The client sends a request up to three times, with exponential backoff and jitter, if the store is busy (503, 429),
//! fails (500) or does not reply. So a conditional put whose reply was lost may fail because of its own success, with
//! [`Error::PreconditionFailed`]. After 409 and 412 no request is repeated here, because the caller decides what to
//! write next.
//!
//! ```no_run
//! use rayfold_pipeline::store::{ListRequest, S3Store, Store};
//! # async fn example() -> rayfold_pipeline::Result<()> {
//! let store = S3Store::from_environment("my-bucket").await?;
//! let page = store.list(ListRequest::level("scripts/")).await?;
//! # Ok(()) }
//! ```

mod admin;
mod answers;
mod session;
mod upload;

use std::ops::Range;
use std::time::Duration;

use aws_config::{BehaviorVersion, Region};
use aws_sdk_s3::Client;
use aws_sdk_s3::config::retry::RetryConfig;
use aws_sdk_s3::config::timeout::TimeoutConfig;
use aws_sdk_s3::config::{
    Credentials, RequestChecksumCalculation, ResponseChecksumValidation, SharedHttpClient,
};
use aws_sdk_s3::primitives::{ByteStream, ByteStreamError, DateTime};
use aws_sdk_s3::types::EncodingType;
use aws_smithy_http_client::Builder as HttpBuilder;
use aws_smithy_http_client::tls::{Provider, rustls_provider::CryptoMode};
use aws_types::service_config::ServiceConfigKey;
use bytes::{Bytes, BytesMut};

use super::{
    ETag, ListPage, ListRequest, Listed, Object, ObjectInfo, PAGE, PutOptions, Store, UnfinishedUpload,
};
use crate::clock::Timestamp;
use crate::{Error, Result};

pub use admin::Notification;
pub use upload::S3Upload;

use answers::{decoded, error_of, status};
use upload::headers;

/// The timeout of one request, not counting repetitions: longer than any object of the pipeline takes.
const READ_TIMEOUT: Duration = Duration::from_secs(30);

/// The first try and its repetitions.
const ATTEMPTS: u32 = 3;

/// A bucket. Clones share the connections.
#[derive(Debug, Clone)]
pub struct S3Store {
    client: Client,
    bucket: String,
}

/// The credentials and the endpoint, if the environment does not name them.
#[derive(Clone)]
pub struct Connection {
    /// The URL with its scheme: `http://127.0.0.1:9000`.
    pub endpoint: String,
    /// The region for which requests are signed.
    pub region: String,
    /// The access key's id.
    pub access_key: String,
    /// The secret key that belongs to the access key.
    pub secret_key: String,
    /// The session token of a temporary key.
    pub session_token: Option<String>,
}

impl S3Store {
    /// Connects to a bucket by the standard AWS environment.
    ///
    /// # Errors
    /// [`Error::NoRegion`]. Missing or wrong credentials are reported by the first request.
    pub async fn from_environment(bucket: &str) -> Result<Self> {
        let http = https_client();
        let sdk = aws_config::defaults(BehaviorVersion::latest()).http_client(http).load().await;
        if sdk.region().is_none() {
            return Err(Error::NoRegion);
        }
        let of_s3 = ServiceConfigKey::builder()
            .service_id("S3")
            .env("AWS_ENDPOINT_URL")
            .profile("endpoint_url")
            .build()
            .ok()
            .and_then(|key| sdk.service_config()?.load_config(key));
        let endpoint = of_s3.or_else(|| sdk.endpoint_url().map(str::to_owned));
        Ok(Self::new(aws_sdk_s3::config::Builder::from(&sdk), endpoint.as_deref(), bucket))
    }

    /// Connects to a bucket at an endpoint, by the standard AWS environment. Without a region there it uses us-east-1.
    pub async fn from_environment_at(endpoint: &str, bucket: &str) -> Self {
        let loader = aws_config::defaults(BehaviorVersion::latest()).http_client(https_client());
        let sdk = loader.load().await;
        let mut config = aws_sdk_s3::config::Builder::from(&sdk).endpoint_url(endpoint);
        if sdk.region().is_none() {
            config = config.region(Region::from_static("us-east-1"));
        }
        Self::new(config, Some(endpoint), bucket)
    }

    /// Connects to a bucket at an endpoint, with these credentials.
    pub fn at(connection: &Connection, bucket: &str) -> Self {
        let Connection { endpoint, region, access_key, secret_key, session_token } = connection;
        let config = aws_sdk_s3::Config::builder()
            .behavior_version(BehaviorVersion::latest())
            .region(Region::new(region.clone()))
            .credentials_provider(Credentials::new(
                access_key,
                secret_key,
                session_token.clone(),
                None,
                "rayfold",
            ))
            .http_client(https_client())
            .endpoint_url(endpoint);
        Self::new(config, Some(endpoint), bucket)
    }

    fn new(mut config: aws_sdk_s3::config::Builder, endpoint: Option<&str>, bucket: &str) -> Self {
        if let Some(endpoint) = endpoint {
            config = config.force_path_style(true);
            if endpoint.starts_with("http://") {
                // Without the certificates, whose loading is the larger part of a cold start.
                config = config.http_client(HttpBuilder::new().build_http());
            }
        }
        let config = config
            .retry_config(RetryConfig::standard().with_max_attempts(ATTEMPTS))
            .timeout_config(
                TimeoutConfig::builder()
                    .connect_timeout(Duration::from_secs(3))
                    .read_timeout(READ_TIMEOUT)
                    .build(),
            )
            // Bodies are signed by their SHA-256 already; parts of an upload need no second checksum at its end.
            .request_checksum_calculation(RequestChecksumCalculation::WhenRequired)
            .response_checksum_validation(ResponseChecksumValidation::WhenRequired)
            .build();
        Self { client: Client::from_conf(config), bucket: bucket.to_owned() }
    }

    /// The region that requests are signed for.
    pub fn region(&self) -> Option<&str> {
        self.client.config().region().map(Region::as_ref)
    }

    /// Returns the bucket's name.
    pub fn bucket(&self) -> &str {
        &self.bucket
    }

    async fn read(&self, key: &str, range: Option<Range<u64>>) -> Result<Object> {
        let header = range.as_ref().map(|range| format!("bytes={}-{}", range.start, range.end.max(1) - 1));
        let request = self.client.get_object().bucket(&self.bucket).key(key).set_range(header);
        let answer = match request.send().await {
            Err(error) if range.is_some_and(|range| range.start == 0) && status(&error) == Some(416) => {
                // An empty object has no range at all.
                return Box::pin(self.read(key, None)).await;
            }
            answer => answer.map_err(|error| error_of(key, error))?,
        };
        let whole = answer.content_range().and_then(|range| range.rsplit_once('/')?.1.parse().ok());
        let size = whole.unwrap_or_else(|| length(answer.content_length()));
        let info = ObjectInfo {
            etag: ETag::new(answer.e_tag().unwrap_or_default()),
            size,
            modified: timestamp(answer.last_modified()),
            metadata: answer.metadata().cloned().unwrap_or_default().into_iter().collect(),
        };
        // Into one piece from the start: a large object must not be held twice.
        let length = usize::try_from(length(answer.content_length())).unwrap_or(0);
        let mut body = BytesMut::with_capacity(length);
        let mut pieces = answer.body;
        while let Some(piece) = pieces.next().await {
            let lost =
                |error: ByteStreamError| Error::Ambiguous { key: key.to_owned(), source: error.into() };
            body.extend_from_slice(&piece.map_err(lost)?);
        }
        Ok(Object { info, body: body.freeze() })
    }
}

impl Store for S3Store {
    type Upload = S3Upload;

    async fn get(&self, key: &str) -> Result<Object> {
        self.read(key, None).await
    }

    async fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
        if range.is_empty() {
            let info = self.head(key).await?;
            return Ok(Object { info, body: Bytes::new() });
        }
        self.read(key, Some(range)).await
    }

    async fn head(&self, key: &str) -> Result<ObjectInfo> {
        let answer = self.client.head_object().bucket(&self.bucket).key(key).send().await;
        let answer = answer.map_err(|error| error_of(key, error))?;
        Ok(ObjectInfo {
            etag: ETag::new(answer.e_tag().unwrap_or_default()),
            size: length(answer.content_length()),
            modified: timestamp(answer.last_modified()),
            metadata: answer.metadata().cloned().unwrap_or_default().into_iter().collect(),
        })
    }

    async fn put(&self, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
        let (if_none_match, if_match) = headers(&options.condition);
        let answer = self
            .client
            .put_object()
            .bucket(&self.bucket)
            .key(key)
            .set_if_none_match(if_none_match)
            .set_if_match(if_match)
            .content_type(options.content_type)
            .set_metadata(Some(options.metadata.into_iter().collect()))
            .body(ByteStream::from(body))
            .send()
            .await
            .map_err(|error| error_of(key, error))?;
        Ok(ETag::new(answer.e_tag().unwrap_or_default()))
    }

    async fn delete(&self, key: &str) -> Result<()> {
        let answer = self.client.delete_object().bucket(&self.bucket).key(key).send().await;
        answer.map(drop).map_err(|error| error_of(key, error))
    }

    async fn list(&self, request: ListRequest) -> Result<ListPage> {
        let answer = self
            .client
            .list_objects_v2()
            .bucket(&self.bucket)
            .prefix(&request.prefix)
            .set_delimiter(request.delimiter.then(|| "/".to_owned()))
            .set_start_after(request.start_after)
            .set_continuation_token(request.continuation)
            // Keys may hold characters that XML cannot.
            .encoding_type(EncodingType::Url)
            .max_keys(PAGE as i32)
            .send()
            .await
            .map_err(|error| error_of(&request.prefix, error))?;
        let objects = answer.contents().iter().map(|object| Listed {
            key: decoded(object.key().unwrap_or_default()),
            etag: ETag::new(object.e_tag().unwrap_or_default()),
            size: length(object.size()),
            modified: timestamp(object.last_modified()),
        });
        let prefixes = answer.common_prefixes().iter();
        Ok(ListPage {
            objects: objects.collect(),
            prefixes: prefixes.map(|prefix| decoded(prefix.prefix().unwrap_or_default())).collect(),
            next: answer.next_continuation_token().map(str::to_owned),
        })
    }

    async fn upload(&self, key: &str, options: PutOptions) -> Result<Self::Upload> {
        Ok(S3Upload::new(self.clone(), key, options, UnfinishedUpload::default()))
    }

    fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Self::Upload {
        S3Upload::new(self.clone(), key, options, unfinished)
    }
}

fn https_client() -> SharedHttpClient {
    HttpBuilder::new().tls_provider(Provider::Rustls(CryptoMode::Ring)).build_https()
}

fn length(bytes: Option<i64>) -> u64 {
    bytes.and_then(|bytes| u64::try_from(bytes).ok()).unwrap_or_default()
}

fn timestamp(at: Option<&DateTime>) -> Timestamp {
    let ms = at.and_then(|at| at.to_millis().ok()).and_then(|ms| u64::try_from(ms).ok());
    Timestamp(ms.unwrap_or_default())
}
