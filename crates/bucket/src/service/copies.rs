//! CopyObject: a body is read and written again, so that a copy has its own ETag and checksum.

use s3s::dto::*;
use s3s::{S3Request, s3_error};

use super::conditions::{ReadConditions, WriteConditions};
use super::ingest::{ExpectedBody, etag, ingest, is_too_large};
use super::objects::{Destination, admit, check_key, check_metadata, expires, keep, place};
use super::writes::{of, stored_encoding};
use super::{Caller, Service};
use crate::answer::{Answer, invalid_argument, invalid_request, not_implemented, time};
use crate::checksum::Algorithm;
use crate::records::{self, Headers, Moment};
use crate::storage::Kind;

impl Service {
    pub(super) async fn handle_copy_object(
        &self,
        req: S3Request<CopyObjectInput>,
    ) -> Answer<CopyObjectOutput> {
        let caller = Caller::of(&req);
        // The input of `s3s` has no conditions on the destination yet.
        let header = |name: &str| {
            req.headers.get(name).map(|value| ETagCondition::parse_http_header(value.as_bytes()))
        };
        let condition =
            |name: &str| header(name).transpose().map_err(|_| invalid_argument(format!("invalid {name}")));
        let conditions =
            WriteConditions { if_match: condition("if-match")?, if_none_match: condition("if-none-match")? };
        conditions.check_form()?;
        let input = req.input;
        check_key(&input.key)?;
        let (bucket, key) = source(&input.copy_source)?;
        let replace = directive(input.metadata_directive.as_ref())?;
        let to_itself = bucket == input.bucket && key == input.key;
        let says_how_it_is_kept = input.storage_class.is_some() || input.server_side_encryption.is_some();
        if to_itself && !replace && !says_how_it_is_kept {
            return Err(invalid_request(
                "This copy request is illegal because it is trying to copy an object to itself without changing the object's metadata, storage class, website redirect location or encryption attributes.",
            ));
        }
        let held = self.held(&bucket, &key)?;
        let from = held.object.clone();
        let conditions_of_source = ReadConditions {
            if_match: input.copy_source_if_match,
            if_none_match: input.copy_source_if_none_match,
            if_modified_since: input.copy_source_if_modified_since,
            if_unmodified_since: input.copy_source_if_unmodified_since,
        };
        conditions_of_source.check_source(&from)?;
        if is_too_large(from.size) {
            return Err(invalid_request(
                "The specified copy source is larger than the maximum allowable size for a copy source: 5368709120",
            ));
        }
        let headers = if replace {
            Headers {
                content_type: input.content_type,
                cache_control: input.cache_control,
                content_disposition: input.content_disposition,
                content_encoding: stored_encoding(input.content_encoding),
                content_language: input.content_language,
                expires: expires(input.expires.as_ref()),
                metadata: input.metadata.unwrap_or_default().into_iter().collect(),
            }
        } else {
            from.headers
        };
        check_metadata(&headers)?;
        let algorithm = match &input.checksum_algorithm {
            Some(name) => Algorithm::of_name(name.as_str())
                .ok_or_else(|| invalid_request("Checksum algorithm provided is unsupported."))?,
            None => from.checksum.map_or(Algorithm::Crc64nvme, |sum| sum.algorithm),
        };
        self.bucket_exists(&input.bucket)?;
        let bytes = held.bytes(&self.storage, 0..from.size)?;
        let ingested = ingest(&self.storage, ExpectedBody::none(algorithm), bytes).await?;
        if ingested.size != from.size {
            return Err(s3_error!(InternalError, "the source's body is shorter than it should be"));
        }

        let (size, etag, checksum) = (ingested.size, etag(ingested.md5), ingested.checksum);
        let to = Destination { bucket: input.bucket, key: input.key, conditions, caller };
        let ids = self.storage.bodies().clone();
        let copy = self.change(Kind::Grows, move |batch| {
            let there = admit(batch, &to)?;
            let body = keep(batch, &ids, ingested.content)?;
            let checksum = Some(checksum);
            let object = records::Object {
                size,
                etag,
                modified: Moment::now(),
                headers,
                checksum,
                body,
                upload: None,
            };
            place(batch, &ids, &to, there, &object, "ObjectCreated:Copy")?;
            Ok(object)
        });
        let object = copy.await?;
        let sum = object.checksum.as_ref();
        let result = CopyObjectResult {
            checksum_crc32: of(sum, Algorithm::Crc32),
            checksum_crc32c: of(sum, Algorithm::Crc32c),
            checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
            checksum_sha1: of(sum, Algorithm::Sha1),
            checksum_sha256: of(sum, Algorithm::Sha256),
            checksum_type: sum.map(|sum| ChecksumType::from_static(sum.kind.name())),
            e_tag: Some(ETag::Strong(object.etag)),
            last_modified: Some(time(object.modified)),
        };
        Ok(CopyObjectOutput { copy_object_result: Some(result), ..CopyObjectOutput::default() })
    }
}

/// Returns bucket and key of a copy's source.
pub(super) fn source(source: &CopySource) -> Answer<(String, String)> {
    match source {
        CopySource::Bucket { bucket, key, version_id } => {
            if version_id.as_deref().is_some_and(|version| !matches!(version, "" | "null")) {
                return Err(invalid_argument("Invalid version id specified: buckets here have no versions"));
            }
            Ok((bucket.to_string(), key.to_string()))
        }
        CopySource::AccessPoint { .. } | CopySource::Outpost { .. } => {
            Err(not_implemented("a copy from an access point or an outpost"))
        }
    }
}

/// Returns whether the headers of the request replace those of the source.
fn directive(directive: Option<&MetadataDirective>) -> Answer<bool> {
    match directive.map(MetadataDirective::as_str) {
        None | Some(MetadataDirective::COPY) => Ok(false),
        Some(MetadataDirective::REPLACE) => Ok(true),
        Some(_) => Err(invalid_argument("Unknown metadata directive.")),
    }
}
