//! Multipart uploads. They take the memory of one part, however long the object is.
//!
//! An object shorter than a part is put in one request at the end.

use aws_sdk_s3::primitives::ByteStream;
use aws_sdk_s3::types::{CompletedMultipartUpload, CompletedPart};
use bytes::{Bytes, BytesMut};

use super::S3Store;
use super::answers::error_of;
use crate::store::{Condition, ETag, Patch, PutOptions, Store, UnfinishedUpload, Upload};
use crate::{Error, Result};

/// The size of all parts but the last, in bytes. S3 allows 10,000 parts of at least 5 MiB; with this size an object may
/// have 78 GiB.
const PART: usize = 8 << 20;

/// The most parts of an upload.
const MAX_PARTS: usize = 10_000;

/// An object being written to an [`S3Store`].
#[derive(Debug)]
pub struct S3Upload {
    store: S3Store,
    key: String,
    options: PutOptions,
    gathered: BytesMut,
    id: Option<String>,
    /// The first part if it is sent last and is complete. Its number is reserved.
    start: Option<BytesMut>,
    parts: Vec<CompletedPart>,
}

impl S3Upload {
    /// The first part as far as it has been received.
    pub(super) fn new(store: S3Store, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Self {
        let UnfinishedUpload { id, parts, start, tail } = unfinished;
        let start = Some(BytesMut::from(start)).filter(|start| !start.is_empty());
        let first = 1 + i32::from(start.is_some());
        let parts = (first..).zip(parts).map(|(number, etag)| part(number, Some(etag.as_str().to_owned())));
        let (key, parts) = (key.to_owned(), parts.collect());
        Self { store, key, options, gathered: tail.into(), id, start, parts }
    }

    async fn begun(&mut self) -> Result<String> {
        if let Some(id) = &self.id {
            return Ok(id.clone());
        }
        let answer = self
            .store
            .client
            .create_multipart_upload()
            .bucket(&self.store.bucket)
            .key(&self.key)
            .content_type(self.options.content_type)
            .set_metadata(Some(self.options.metadata.clone().into_iter().collect()))
            .send()
            .await
            .map_err(|error| error_of(&self.key, error))?;
        let id = answer.upload_id().unwrap_or_default().to_owned();
        self.id = Some(id.clone());
        Ok(id)
    }

    async fn send_next(&mut self, body: Bytes) -> Result<()> {
        let number = self.parts.len() + 1 + usize::from(self.start.is_some());
        if number > MAX_PARTS {
            let limit_gb = (MAX_PARTS * PART / 1_000_000_000) as u64;
            return Err(Error::TooLarge { key: self.key.clone(), limit_gb });
        }
        let sent = self.send_part(i32::try_from(number).unwrap_or(i32::MAX), body).await?;
        self.parts.push(sent);
        Ok(())
    }

    async fn send_part(&mut self, number: i32, body: Bytes) -> Result<CompletedPart> {
        let id = self.begun().await?;
        let answer = self
            .store
            .client
            .upload_part()
            .bucket(&self.store.bucket)
            .key(&self.key)
            .upload_id(id)
            .part_number(number)
            .body(ByteStream::from(body))
            .send()
            .await
            .map_err(|error| error_of(&self.key, error))?;
        Ok(part(number, answer.e_tag))
    }

    /// Sends the rest: the last part, and the first one if it is sent last.
    async fn send_rest(&mut self, patch: Option<Patch>) -> Result<()> {
        let last = self.gathered.split().freeze();
        if !last.is_empty() {
            self.send_next(last).await?;
        }
        if let Some(mut start) = self.start.take() {
            patch.iter().for_each(|patch| patch.apply(&mut start));
            let sent = self.send_part(1, start.freeze()).await?;
            self.parts.insert(0, sent);
        }
        Ok(())
    }

    async fn complete(&self, id: &str) -> Result<ETag> {
        let (if_none_match, if_match) = headers(&self.options.condition);
        let parts = CompletedMultipartUpload::builder().set_parts(Some(self.parts.clone())).build();
        let answer = self
            .store
            .client
            .complete_multipart_upload()
            .bucket(&self.store.bucket)
            .key(&self.key)
            .upload_id(id)
            .multipart_upload(parts)
            .set_if_none_match(if_none_match)
            .set_if_match(if_match)
            .send()
            .await;
        match answer {
            Ok(answer) => Ok(ETag::new(answer.e_tag().unwrap_or_default())),
            Err(error) => {
                let is_gone = error.as_service_error().is_some_and(|error| {
                    aws_sdk_s3::error::ProvideErrorMetadata::code(error) == Some("NoSuchUpload")
                });
                if is_gone {
                    // Completed by an earlier try whose answer was lost, or aborted by another process.
                    let source = "the upload is not there any more".into();
                    return Err(Error::Ambiguous { key: self.key.clone(), source });
                }
                Err(error_of(&self.key, error))
            }
        }
    }

    async fn give_up(&self, id: &str) -> Result<()> {
        let request = self.store.client.abort_multipart_upload();
        let answer = request.bucket(&self.store.bucket).key(&self.key).upload_id(id).send().await;
        match answer.map_err(|error| error_of(&self.key, error)) {
            Err(error) if !error.is_not_found() => Err(error),
            _ => Ok(()),
        }
    }
}

impl Upload for S3Upload {
    async fn write(&mut self, mut bytes: Bytes) -> Result<()> {
        while self.gathered.len() + bytes.len() >= PART {
            let fitting = bytes.split_to(PART - self.gathered.len());
            self.gathered.extend_from_slice(&fitting);
            let part = self.gathered.split();
            if self.options.is_start_last && self.start.is_none() {
                self.start = Some(part);
            } else {
                self.send_next(part.freeze()).await?;
            }
        }
        self.gathered.extend_from_slice(&bytes);
        Ok(())
    }

    async fn finish(mut self, patch: Option<Patch>) -> Result<ETag> {
        if self.id.is_none() && self.start.is_none() {
            patch.iter().for_each(|patch| patch.apply(&mut self.gathered));
            return self.store.put(&self.key, self.gathered.freeze(), self.options).await;
        }
        let sent = self.send_rest(patch).await;
        let id = self.begun().await?;
        let finished = match sent {
            Ok(()) => self.complete(&id).await,
            Err(error) => Err(error),
        };
        if finished.is_err() {
            // If the upload cannot be aborted either, it is left to the bucket's rule for unfinished uploads.
            let _ = self.give_up(&id).await;
        }
        finished
    }

    async fn abort(self) -> Result<()> {
        match &self.id {
            Some(id) => self.give_up(id).await,
            None => Ok(()),
        }
    }

    fn leave(self) -> UnfinishedUpload {
        let etags = self.parts.iter().map(|part| ETag::new(part.e_tag().unwrap_or_default()));
        let start = self.start.map(BytesMut::freeze).unwrap_or_default();
        UnfinishedUpload { id: self.id, parts: etags.collect(), start, tail: self.gathered.freeze() }
    }
}

fn part(number: i32, etag: Option<String>) -> CompletedPart {
    CompletedPart::builder().part_number(number).set_e_tag(etag).build()
}

/// Returns the values of `If-None-Match` and `If-Match`.
pub(super) fn headers(condition: &Condition) -> (Option<String>, Option<String>) {
    match condition {
        Condition::Always => (None, None),
        Condition::IfAbsent => (Some("*".to_owned()), None),
        Condition::IfMatch(etag) => (None, Some(format!("\"{etag}\""))),
    }
}
