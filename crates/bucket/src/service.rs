//! S3's operations on the storage.
//!
//! There is a module per family: `buckets`, `reads`, `writes`, `copies`, `deletes`, `lists`, `versions`, `uploads`
//! (in parts), `notifications`, `cross_origin` (CORS rules). `conditions` evaluates conditions, `ingest` receives a
//! body, and `body_stream` sends one. `gate` has checked before that the request asks for nothing unsupported.

mod body_stream;
mod buckets;
mod conditions;
mod copies;
mod cross_origin;
mod deletes;
mod ingest;
mod lists;
mod notifications;
mod objects;
mod reads;
mod uploads;
mod uploads_listed;
mod versions;
mod writes;

use std::sync::Arc;

use redb::StorageError;
use s3s::dto::*;
use s3s::{S3, S3Error, S3Request, S3Response, S3Result};

use crate::answer::{Answer, no_such_bucket, no_such_key, unavailable, unreadable};
use crate::connection_service::Origin;
use crate::identity::hide_missing_key;
use crate::records::{self, key};
use crate::storage::{Batch, Kind, Snapshot, Storage, Table};

/// The operations of S3, see the module.
#[derive(Clone)]
pub(crate) struct Service {
    storage: Storage,
    region: Arc<str>,
}

/// The caller of an operation, as recorded in events.
#[derive(Clone, Debug)]
pub(crate) struct Caller {
    principal: String,
    origin: Origin,
}

impl Caller {
    /// Extracts the caller from a request.
    fn of<T>(request: &S3Request<T>) -> Self {
        let principal = request.credentials.as_ref().map(|c| c.access_key.clone()).unwrap_or_default();
        let origin = request.extensions.get::<Origin>().cloned().unwrap_or_default();
        Self { principal, origin }
    }
}

/// The reason why a change was not made.
pub(crate) enum ChangeError {
    /// The request was refused. Nothing was changed.
    Refused(Box<S3Error>),
    Storage(StorageError),
}

impl From<S3Error> for ChangeError {
    fn from(error: S3Error) -> Self {
        Self::Refused(Box::new(error))
    }
}

impl From<StorageError> for ChangeError {
    fn from(error: StorageError) -> Self {
        Self::Storage(error)
    }
}

impl Service {
    pub(crate) fn new(storage: Storage, region: &str) -> Self {
        Self { storage, region: region.into() }
    }

    fn snapshot(&self) -> Answer<Snapshot> {
        self.storage.snapshot().map_err(|reason| unavailable(&reason))
    }

    /// Runs a change. The change must not refuse after its first write.
    async fn change<T, F>(&self, kind: Kind, function: F) -> Answer<T>
    where
        T: Send + 'static,
        F: FnOnce(&mut Batch<'_>) -> Result<T, ChangeError> + Send + 'static,
    {
        let settled = self.storage.change(kind, |batch| match function(batch) {
            Ok(value) => Ok(Ok(value)),
            Err(ChangeError::Refused(error)) => Ok(Err(*error)),
            Err(ChangeError::Storage(error)) => Err(error),
        });
        settled.await.map_err(|reason| unavailable(&reason))?
    }

    /// Returns the bucket, or `NoSuchBucket`.
    fn bucket(&self, snapshot: &Snapshot, name: &str) -> Answer<records::Bucket> {
        records::find(snapshot, Table::Buckets, name.as_bytes())
            .map_err(unreadable)?
            .ok_or_else(no_such_bucket)
    }

    /// Returns the object, or `NoSuchBucket` or `NoSuchKey`.
    fn object(&self, snapshot: &Snapshot, bucket: &str, key: &str) -> Answer<records::Object> {
        self.bucket(snapshot, bucket)?;
        let row = key::object(bucket, key.as_bytes());
        records::find(snapshot, Table::Objects, &row).map_err(unreadable)?.ok_or_else(no_such_key)
    }
}

/// Each operation calls its handler in the module of its family.
#[async_trait::async_trait]
impl S3 for Service {
    async fn list_buckets(
        &self,
        req: S3Request<ListBucketsInput>,
    ) -> S3Result<S3Response<ListBucketsOutput>> {
        self.handle_list_buckets(&req.input).map(S3Response::new)
    }

    async fn create_bucket(
        &self,
        req: S3Request<CreateBucketInput>,
    ) -> S3Result<S3Response<CreateBucketOutput>> {
        self.handle_create_bucket(req.input).await.map(S3Response::new)
    }

    async fn head_bucket(&self, req: S3Request<HeadBucketInput>) -> S3Result<S3Response<HeadBucketOutput>> {
        self.handle_head_bucket(&req.input).map(S3Response::new)
    }

    async fn delete_bucket(
        &self,
        req: S3Request<DeleteBucketInput>,
    ) -> S3Result<S3Response<DeleteBucketOutput>> {
        self.handle_delete_bucket(req.input).await.map(S3Response::new)
    }

    async fn get_bucket_location(
        &self,
        req: S3Request<GetBucketLocationInput>,
    ) -> S3Result<S3Response<GetBucketLocationOutput>> {
        self.handle_get_bucket_location(&req.input).map(S3Response::new)
    }

    async fn get_bucket_versioning(
        &self,
        req: S3Request<GetBucketVersioningInput>,
    ) -> S3Result<S3Response<GetBucketVersioningOutput>> {
        self.bucket_exists(&req.input.bucket)?;
        Ok(S3Response::new(GetBucketVersioningOutput::default()))
    }

    async fn get_bucket_acl(
        &self,
        req: S3Request<GetBucketAclInput>,
    ) -> S3Result<S3Response<GetBucketAclOutput>> {
        self.bucket_exists(&req.input.bucket)?;
        Ok(S3Response::new(buckets::owners_alone()))
    }

    async fn get_bucket_policy(
        &self,
        req: S3Request<GetBucketPolicyInput>,
    ) -> S3Result<S3Response<GetBucketPolicyOutput>> {
        self.no_configuration(&req.input.bucket, s3s::S3ErrorCode::NoSuchBucketPolicy)
    }

    async fn get_bucket_cors(
        &self,
        req: S3Request<GetBucketCorsInput>,
    ) -> S3Result<S3Response<GetBucketCorsOutput>> {
        self.handle_get_bucket_cors(&req.input.bucket).map(S3Response::new)
    }

    async fn put_bucket_cors(
        &self,
        req: S3Request<PutBucketCorsInput>,
    ) -> S3Result<S3Response<PutBucketCorsOutput>> {
        self.handle_put_bucket_cors(req.input.bucket, req.input.cors_configuration.cors_rules).await?;
        Ok(S3Response::new(PutBucketCorsOutput {}))
    }

    async fn delete_bucket_cors(
        &self,
        req: S3Request<DeleteBucketCorsInput>,
    ) -> S3Result<S3Response<DeleteBucketCorsOutput>> {
        self.handle_delete_bucket_cors(req.input.bucket).await?;
        Ok(S3Response::new(DeleteBucketCorsOutput {}))
    }

    async fn put_bucket_acl(
        &self,
        req: S3Request<PutBucketAclInput>,
    ) -> S3Result<S3Response<PutBucketAclOutput>> {
        self.bucket_exists(&req.input.bucket)?;
        buckets::check_list(req.input.acl.is_some(), req.input.access_control_policy)?;
        Ok(S3Response::new(PutBucketAclOutput {}))
    }

    async fn put_object_acl(
        &self,
        req: S3Request<PutObjectAclInput>,
    ) -> S3Result<S3Response<PutObjectAclOutput>> {
        self.object(&self.snapshot()?, &req.input.bucket, &req.input.key)?;
        buckets::check_list(req.input.acl.is_some(), req.input.access_control_policy)?;
        Ok(S3Response::new(PutObjectAclOutput::default()))
    }

    async fn get_bucket_lifecycle_configuration(
        &self,
        req: S3Request<GetBucketLifecycleConfigurationInput>,
    ) -> S3Result<S3Response<GetBucketLifecycleConfigurationOutput>> {
        self.no_configuration(&req.input.bucket, s3s::S3ErrorCode::NoSuchLifecycleConfiguration)
    }

    async fn get_bucket_tagging(
        &self,
        req: S3Request<GetBucketTaggingInput>,
    ) -> S3Result<S3Response<GetBucketTaggingOutput>> {
        self.no_configuration(&req.input.bucket, s3s::S3ErrorCode::NoSuchTagSet)
    }

    async fn get_bucket_encryption(
        &self,
        req: S3Request<GetBucketEncryptionInput>,
    ) -> S3Result<S3Response<GetBucketEncryptionOutput>> {
        let code = s3s::S3ErrorCode::ServerSideEncryptionConfigurationNotFoundError;
        self.no_configuration(&req.input.bucket, code)
    }

    async fn get_object_lock_configuration(
        &self,
        req: S3Request<GetObjectLockConfigurationInput>,
    ) -> S3Result<S3Response<GetObjectLockConfigurationOutput>> {
        let code = s3s::S3ErrorCode::ObjectLockConfigurationNotFoundError;
        self.no_configuration(&req.input.bucket, code)
    }

    async fn get_bucket_website(
        &self,
        req: S3Request<GetBucketWebsiteInput>,
    ) -> S3Result<S3Response<GetBucketWebsiteOutput>> {
        self.no_configuration(&req.input.bucket, s3s::S3ErrorCode::NoSuchWebsiteConfiguration)
    }

    async fn put_bucket_notification_configuration(
        &self,
        req: S3Request<PutBucketNotificationConfigurationInput>,
    ) -> S3Result<S3Response<PutBucketNotificationConfigurationOutput>> {
        self.handle_put_bucket_notification(req.input).await.map(S3Response::new)
    }

    async fn get_bucket_notification_configuration(
        &self,
        req: S3Request<GetBucketNotificationConfigurationInput>,
    ) -> S3Result<S3Response<GetBucketNotificationConfigurationOutput>> {
        self.handle_get_bucket_notification(&req.input).map(S3Response::new)
    }

    async fn list_objects(
        &self,
        req: S3Request<ListObjectsInput>,
    ) -> S3Result<S3Response<ListObjectsOutput>> {
        self.handle_list_objects(req.input).await.map(S3Response::new)
    }

    async fn list_objects_v2(
        &self,
        req: S3Request<ListObjectsV2Input>,
    ) -> S3Result<S3Response<ListObjectsV2Output>> {
        self.handle_list_objects_v2(req.input).await.map(S3Response::new)
    }

    async fn list_object_versions(
        &self,
        req: S3Request<ListObjectVersionsInput>,
    ) -> S3Result<S3Response<ListObjectVersionsOutput>> {
        self.handle_list_object_versions(req.input).await.map(S3Response::new)
    }

    async fn get_object(&self, req: S3Request<GetObjectInput>) -> S3Result<S3Response<GetObjectOutput>> {
        let hide = hide_missing_key(&req.extensions);
        self.handle_get_object(req).await.map_err(hide)
    }

    async fn head_object(&self, req: S3Request<HeadObjectInput>) -> S3Result<S3Response<HeadObjectOutput>> {
        self.handle_head_object(&req).map_err(hide_missing_key(&req.extensions))
    }

    async fn get_object_attributes(
        &self,
        req: S3Request<GetObjectAttributesInput>,
    ) -> S3Result<S3Response<GetObjectAttributesOutput>> {
        let attributes = self.handle_get_object_attributes(&req.input).map(S3Response::new);
        attributes.map_err(hide_missing_key(&req.extensions))
    }

    async fn get_object_acl(
        &self,
        req: S3Request<GetObjectAclInput>,
    ) -> S3Result<S3Response<GetObjectAclOutput>> {
        self.object(&self.snapshot()?, &req.input.bucket, &req.input.key)?;
        let GetBucketAclOutput { grants, owner } = buckets::owners_alone();
        Ok(S3Response::new(GetObjectAclOutput { grants, owner, request_charged: None }))
    }

    async fn get_object_tagging(
        &self,
        req: S3Request<GetObjectTaggingInput>,
    ) -> S3Result<S3Response<GetObjectTaggingOutput>> {
        self.object(&self.snapshot()?, &req.input.bucket, &req.input.key)?;
        Ok(S3Response::new(GetObjectTaggingOutput { tag_set: Vec::new(), version_id: None }))
    }

    async fn put_object(&self, req: S3Request<PutObjectInput>) -> S3Result<S3Response<PutObjectOutput>> {
        self.handle_put_object(req).await.map(S3Response::new)
    }

    async fn copy_object(&self, req: S3Request<CopyObjectInput>) -> S3Result<S3Response<CopyObjectOutput>> {
        let hide = hide_missing_key(&req.extensions);
        self.handle_copy_object(req).await.map(S3Response::new).map_err(hide)
    }

    async fn delete_object(
        &self,
        req: S3Request<DeleteObjectInput>,
    ) -> S3Result<S3Response<DeleteObjectOutput>> {
        self.handle_delete_object(req).await.map(S3Response::new)
    }

    async fn delete_objects(
        &self,
        req: S3Request<DeleteObjectsInput>,
    ) -> S3Result<S3Response<DeleteObjectsOutput>> {
        self.handle_delete_objects(req).await.map(S3Response::new)
    }

    async fn create_multipart_upload(
        &self,
        req: S3Request<CreateMultipartUploadInput>,
    ) -> S3Result<S3Response<CreateMultipartUploadOutput>> {
        self.handle_create_multipart_upload(req).await.map(S3Response::new)
    }

    async fn upload_part(&self, req: S3Request<UploadPartInput>) -> S3Result<S3Response<UploadPartOutput>> {
        self.handle_upload_part(req).await.map(S3Response::new)
    }

    async fn upload_part_copy(
        &self,
        req: S3Request<UploadPartCopyInput>,
    ) -> S3Result<S3Response<UploadPartCopyOutput>> {
        let hide = hide_missing_key(&req.extensions);
        self.handle_upload_part_copy(req).await.map(S3Response::new).map_err(hide)
    }

    async fn complete_multipart_upload(
        &self,
        req: S3Request<CompleteMultipartUploadInput>,
    ) -> S3Result<S3Response<CompleteMultipartUploadOutput>> {
        self.handle_complete_multipart_upload(req).await.map(S3Response::new)
    }

    async fn abort_multipart_upload(
        &self,
        req: S3Request<AbortMultipartUploadInput>,
    ) -> S3Result<S3Response<AbortMultipartUploadOutput>> {
        self.handle_abort_multipart_upload(req.input).await.map(S3Response::new)
    }

    async fn list_parts(&self, req: S3Request<ListPartsInput>) -> S3Result<S3Response<ListPartsOutput>> {
        self.handle_list_parts(&req.input).map(S3Response::new)
    }

    async fn list_multipart_uploads(
        &self,
        req: S3Request<ListMultipartUploadsInput>,
    ) -> S3Result<S3Response<ListMultipartUploadsOutput>> {
        self.handle_list_multipart_uploads(&req.input).map(S3Response::new)
    }
}
