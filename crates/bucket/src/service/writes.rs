//! The operation PutObject: a new object in one request.

use hyper::header::{HeaderMap, HeaderValue};
use s3s::dto::*;
use s3s::{S3Request, s3_error};

use super::conditions::WriteConditions;
use super::ingest::{ExpectedBody, etag, ingest};
use super::objects::{Destination, admit, check_key, check_metadata, expires, keep, place};
use super::{Caller, Service};
use crate::answer::{Answer, invalid_argument};
use crate::checksum::{Algorithm, Checksum};
use crate::gate::Gate;
use crate::records::{Headers, Moment, Object};
use crate::storage::Kind;

impl Service {
    pub(super) async fn handle_put_object(&self, req: S3Request<PutObjectInput>) -> Answer<PutObjectOutput> {
        let is_form = req.extensions.get::<Gate>().is_some_and(|gate| gate.operation() == "PostObject");
        let expected = if is_form {
            ExpectedBody::of_request(&said_in_form(&req.input)?, None, Algorithm::Crc64nvme)?
        } else {
            ExpectedBody::of_request(&req.headers, req.trailing_headers.clone(), Algorithm::Crc64nvme)?
        };
        let caller = Caller::of(&req);
        let input = req.input;
        check_key(&input.key)?;
        let conditions = WriteConditions { if_match: input.if_match, if_none_match: input.if_none_match };
        conditions.check_form()?;
        let headers = Headers {
            content_type: input.content_type,
            cache_control: input.cache_control,
            content_disposition: input.content_disposition,
            content_encoding: stored_encoding(input.content_encoding),
            content_language: input.content_language,
            expires: expires(input.expires.as_ref()),
            metadata: input.metadata.unwrap_or_default().into_iter().collect(),
        };
        check_metadata(&headers)?;
        self.bucket_exists(&input.bucket)?;
        let body = input.body.ok_or_else(|| s3_error!(IncompleteBody, "a body is missing"))?;
        let ingested = ingest(&self.storage, expected, body).await?;

        let (size, etag, checksum) = (ingested.size, etag(ingested.md5), ingested.checksum);
        let to = Destination { bucket: input.bucket, key: input.key, conditions, caller };
        let ids = self.storage.bodies().clone();
        let put = self.change(Kind::Grows, move |batch| {
            let there = admit(batch, &to)?;
            let body = keep(batch, &ids, ingested.content)?;
            let checksum = Some(checksum);
            let object =
                Object { size, etag, modified: Moment::now(), headers, checksum, body, upload: None };
            place(batch, &ids, &to, there, &object, "ObjectCreated:Put")?;
            Ok(object)
        });
        let object = put.await?;
        let sum = object.checksum.as_ref();
        Ok(PutObjectOutput {
            e_tag: Some(ETag::Strong(object.etag)),
            checksum_crc32: of(sum, Algorithm::Crc32),
            checksum_crc32c: of(sum, Algorithm::Crc32c),
            checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
            checksum_sha1: of(sum, Algorithm::Sha1),
            checksum_sha256: of(sum, Algorithm::Sha256),
            checksum_type: sum.map(|sum| ChecksumType::from_static(sum.kind.name())),
            ..PutObjectOutput::default()
        })
    }
}

/// Converts the fields of a browser's form to the headers of a put.
fn said_in_form(input: &PutObjectInput) -> Answer<HeaderMap> {
    let length = input.content_length.unwrap_or_default().to_string();
    let algorithm = input.checksum_algorithm.as_ref().map(|name| name.as_str().to_owned());
    let mut said = HeaderMap::new();
    for (name, value) in [
        ("content-length", Some(&length)),
        ("content-md5", input.content_md5.as_ref()),
        ("x-amz-sdk-checksum-algorithm", algorithm.as_ref()),
        (Algorithm::Crc32.header(), input.checksum_crc32.as_ref()),
        (Algorithm::Crc32c.header(), input.checksum_crc32c.as_ref()),
        (Algorithm::Crc64nvme.header(), input.checksum_crc64nvme.as_ref()),
        (Algorithm::Sha1.header(), input.checksum_sha1.as_ref()),
        (Algorithm::Sha256.header(), input.checksum_sha256.as_ref()),
    ] {
        let Some(value) = value else { continue };
        let value = HeaderValue::try_from(value)
            .map_err(|_| invalid_argument(format!("{name} of the form cannot be read")))?;
        said.insert(name, value);
    }
    Ok(said)
}

/// Returns the encoding without `aws-chunked`, which describes the transfer and not the content.
pub(super) fn stored_encoding(encoding: Option<String>) -> Option<String> {
    let encoding = encoding?;
    let kept: Vec<&str> = encoding
        .split(',')
        .map(str::trim)
        .filter(|coding| !coding.is_empty() && !coding.eq_ignore_ascii_case("aws-chunked"))
        .collect();
    (!kept.is_empty()).then(|| kept.join(", "))
}

/// Returns the checksum's value if it has this algorithm.
pub(super) fn of(checksum: Option<&Checksum>, algorithm: Algorithm) -> Option<String> {
    checksum.filter(|checksum| checksum.algorithm == algorithm).map(|checksum| checksum.value.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_no_encoding_of_the_object() {
        let kept = |encoding: &str| stored_encoding(Some(encoding.to_owned()));
        assert_eq!(kept("aws-chunked"), None);
        assert_eq!(kept("gzip, aws-chunked").as_deref(), Some("gzip"));
        assert_eq!(kept("aws-chunked,gzip").as_deref(), Some("gzip"));
        assert_eq!(kept("aws-chunked, deflate, gzip").as_deref(), Some("deflate, gzip"));
        assert_eq!(kept("br").as_deref(), Some("br"));
        assert_eq!(stored_encoding(None), None);
    }
}
