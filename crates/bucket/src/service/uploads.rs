//! Uploads in parts. A part is a body of its own. Completing an upload writes the list of its
//! parts, and copies nothing.

use hyper::StatusCode;
use hyper::header::HOST;
use hyper::http::uri::Authority;
use s3s::dto::*;
use s3s::{S3Request, s3_error};

use super::conditions::{ReadConditions, WriteConditions};
use super::copies::source;
use super::ingest::{ExpectedBody, Ingested, etag, ingest, is_too_large};
use super::objects::{Destination, admit, bucket, check_key, check_metadata, expires, keep, place};
use super::writes::{of, stored_encoding};
use super::{Caller, ChangeError, Service};
use crate::answer::{Answer, coded, invalid_argument, invalid_request, no_such_upload, time, unreadable};
use crate::checksum::{self, Algorithm};
use crate::records::{
    self, Body, Headers, Layout, LayoutPart, Moment, abandon, all, decode, find, key, release, set,
};
use crate::storage::{Batch, Kind, Table, View};

/// S3's largest part number. The first is 1.
const MAX_PARTS: i32 = 10_000;

/// S3's limit on the size of every part but the last.
const SMALLEST_PART: u64 = 5 * 1024 * 1024;

/// The number of random bytes in an upload's id.
const ID_BYTES: usize = 16;

impl Service {
    pub(super) async fn handle_create_multipart_upload(
        &self,
        req: S3Request<CreateMultipartUploadInput>,
    ) -> Answer<CreateMultipartUploadOutput> {
        let input = req.input;
        check_key(&input.key)?;
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
        let asked = input.checksum_algorithm.is_some();
        let algorithm = match &input.checksum_algorithm {
            Some(name) => Algorithm::of_name(name.as_str())
                .ok_or_else(|| invalid_request("Checksum algorithm provided is unsupported."))?,
            None => Algorithm::Crc64nvme,
        };
        let kind = match input.checksum_type.as_ref().map(ChecksumType::as_str) {
            None => algorithm.default_kind(),
            Some(_) if !asked => {
                return Err(invalid_request(
                    "The x-amz-checksum-type header can only be used with the x-amz-checksum-algorithm header.",
                ));
            }
            Some(ChecksumType::FULL_OBJECT) => checksum::Kind::FullObject,
            Some(ChecksumType::COMPOSITE) => checksum::Kind::Composite,
            Some(_) => return Err(invalid_request("Value for x-amz-checksum-type header is invalid.")),
        };
        if !algorithm.allows(kind) {
            return Err(invalid_request(format!(
                "The {} checksum type cannot be used with the {} checksum algorithm.",
                kind.name(),
                algorithm.name()
            )));
        }
        let mut random = [0; ID_BYTES];
        getrandom::fill(&mut random).map_err(|error| s3_error!(error, InternalError, "no random bytes"))?;
        let id: String = random.iter().map(|byte| format!("{byte:02x}")).collect();
        let record = records::Upload { initiated: Moment::now(), headers, algorithm, kind, asked };
        let (name, object_key, upload) = (input.bucket.clone(), input.key.clone(), id.clone());
        let create = self.change(Kind::Grows, move |batch| {
            bucket(batch, &name)?;
            Ok(set(batch, Table::Uploads, &key::upload(&name, &object_key, &upload), &record)?)
        });
        create.await?;
        Ok(CreateMultipartUploadOutput {
            bucket: Some(input.bucket),
            key: Some(input.key),
            upload_id: Some(id),
            checksum_algorithm: asked.then(|| ChecksumAlgorithm::from_static(algorithm.name())),
            checksum_type: asked.then(|| ChecksumType::from_static(kind.name())),
            ..CreateMultipartUploadOutput::default()
        })
    }

    /// Returns the upload, or `NoSuchUpload`.
    pub(super) fn upload(&self, bucket: &str, object_key: &str, id: &str) -> Answer<records::Upload> {
        let snapshot = self.snapshot()?;
        self.bucket(&snapshot, bucket)?;
        find(&snapshot, Table::Uploads, &key::upload(bucket, object_key, id))
            .map_err(unreadable)?
            .ok_or_else(no_such_upload)
    }

    pub(super) async fn handle_upload_part(
        &self,
        req: S3Request<UploadPartInput>,
    ) -> Answer<UploadPartOutput> {
        let input = req.input;
        let number = part_number(input.part_number)?;
        let upload = self.upload(&input.bucket, &input.key, &input.upload_id)?;
        let text = |name: &str| req.headers.get(name).and_then(|value| value.to_str().ok()).map(str::trim);
        let named = Algorithm::ALL.into_iter().find(|algorithm| {
            req.headers.contains_key(algorithm.header())
                || text("x-amz-trailer").is_some_and(|name| name.eq_ignore_ascii_case(algorithm.header()))
                || text("x-amz-checksum-algorithm").and_then(Algorithm::of_name) == Some(*algorithm)
        });
        if upload.asked && named.is_some_and(|named| named != upload.algorithm) {
            return Err(invalid_request(format!(
                "Checksum Type mismatch occurred, expected checksum Type: {}, actual checksum Type: {}",
                upload.algorithm.name().to_ascii_lowercase(),
                named.map_or("null", Algorithm::name).to_ascii_lowercase()
            )));
        }
        // A client that named no algorithm may check its parts by another one. They are then digested
        // again at the end.
        let expected =
            ExpectedBody::of_request(&req.headers, req.trailing_headers.clone(), upload.algorithm)?;
        let body = input.body.ok_or_else(|| s3_error!(IncompleteBody, "a body is missing"))?;
        let ingested = ingest(&self.storage, expected, body).await?;
        let part = self.part_kept(input.bucket, input.key, input.upload_id, number, ingested).await?;
        let sum = Some(&part.checksum);
        Ok(UploadPartOutput {
            checksum_crc32: of(sum, Algorithm::Crc32),
            checksum_crc32c: of(sum, Algorithm::Crc32c),
            checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
            checksum_sha1: of(sum, Algorithm::Sha1),
            checksum_sha256: of(sum, Algorithm::Sha256),
            e_tag: Some(ETag::Strong(part.etag)),
            ..UploadPartOutput::default()
        })
    }

    pub(super) async fn handle_upload_part_copy(
        &self,
        req: S3Request<UploadPartCopyInput>,
    ) -> Answer<UploadPartCopyOutput> {
        let input = req.input;
        let number = part_number(input.part_number)?;
        let upload = self.upload(&input.bucket, &input.key, &input.upload_id)?;
        let (from_bucket, from_key) = source(&input.copy_source)?;
        let held = self.held(&from_bucket, &from_key)?;
        let conditions = ReadConditions {
            if_match: input.copy_source_if_match,
            if_none_match: input.copy_source_if_none_match,
            if_modified_since: input.copy_source_if_modified_since,
            if_unmodified_since: input.copy_source_if_unmodified_since,
        };
        conditions.check_source(&held.object)?;
        let size = held.object.size;
        let range = match input.copy_source_range.as_deref() {
            None => 0..size,
            Some(range) => copied_range(range, size)?,
        };
        let length = range.end - range.start;
        if is_too_large(length) {
            return Err(s3_error!(EntityTooLarge, "Your proposed upload exceeds the maximum allowed size"));
        }
        let bytes = held.bytes(&self.storage, range)?;
        let ingested = ingest(&self.storage, ExpectedBody::none(upload.algorithm), bytes).await?;
        if ingested.size != length {
            return Err(s3_error!(InternalError, "the source's body is shorter than it should be"));
        }
        let part = self.part_kept(input.bucket, input.key, input.upload_id, number, ingested).await?;
        let sum = Some(&part.checksum).filter(|_| upload.asked);
        let result = CopyPartResult {
            checksum_crc32: of(sum, Algorithm::Crc32),
            checksum_crc32c: of(sum, Algorithm::Crc32c),
            checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
            checksum_sha1: of(sum, Algorithm::Sha1),
            checksum_sha256: of(sum, Algorithm::Sha256),
            e_tag: Some(ETag::Strong(part.etag)),
            last_modified: Some(time(part.modified)),
        };
        Ok(UploadPartCopyOutput { copy_part_result: Some(result), ..UploadPartCopyOutput::default() })
    }

    /// Stores a part, in place of an earlier one with its number.
    async fn part_kept(
        &self,
        bucket: String,
        object_key: String,
        id: String,
        number: u16,
        ingested: Ingested,
    ) -> Answer<records::Part> {
        let (size, etag, checksum) = (ingested.size, etag(ingested.md5), ingested.checksum);
        let ids = self.storage.bodies().clone();
        let keep = self.change(Kind::Grows, move |batch| {
            if batch.get(Table::Uploads, &key::upload(&bucket, &object_key, &id))?.is_none() {
                return Err(no_such_upload().into());
            }
            let row = key::part(&id, number);
            if let Some(earlier) = find::<records::Part>(batch, Table::Parts, &row)? {
                release(batch, earlier.body)?;
            }
            let body = keep(batch, &ids, ingested.content)?;
            let part = records::Part { size, etag, modified: Moment::now(), body, checksum };
            set(batch, Table::Parts, &row, &part)?;
            Ok(part)
        });
        keep.await
    }

    pub(super) async fn handle_complete_multipart_upload(
        &self,
        req: S3Request<CompleteMultipartUploadInput>,
    ) -> Answer<CompleteMultipartUploadOutput> {
        let caller = Caller::of(&req);
        let location = location(&req);
        let input = req.input;
        let conditions = WriteConditions { if_match: input.if_match, if_none_match: input.if_none_match };
        conditions.check_form()?;
        let listed = input.multipart_upload.and_then(|upload| upload.parts).unwrap_or_default();
        let wanted = wanted(listed)?;
        let expected = [
            (Algorithm::Crc32, input.checksum_crc32),
            (Algorithm::Crc32c, input.checksum_crc32c),
            (Algorithm::Crc64nvme, input.checksum_crc64nvme),
            (Algorithm::Sha1, input.checksum_sha1),
            (Algorithm::Sha256, input.checksum_sha256),
        ];
        let claim = Claim {
            kind: input.checksum_type.map(|kind| kind.as_str().to_owned()),
            value: expected.into_iter().find_map(|(algorithm, value)| value.map(|value| (algorithm, value))),
            size: input.mpu_object_size.map(|size| u64::try_from(size).unwrap_or_default()),
        };
        let (bucket, object_key) = (input.bucket.clone(), input.key.clone());
        let to = Destination { bucket: input.bucket, key: input.key, conditions, caller };
        let id = input.upload_id;
        let ids = self.storage.bodies().clone();
        let complete = self.change(Kind::Grows, move |batch| {
            let there = admit(batch, &to)?;
            let row = key::upload(&to.bucket, &to.key, &id);
            let Some(upload) = find::<records::Upload>(batch, Table::Uploads, &row)? else {
                // The upload was completed before and the object is still there: the response may have been lost.
                let existing = there.1;
                return existing
                    .filter(|object| object.upload.as_ref() == Some(&id))
                    .ok_or_else(|| no_such_upload().into());
            };
            let Chosen { layout, size, etag, checksum } = choose(batch, &id, &upload, &wanted, &claim)?;

            let body = ids.id();
            set(batch, Table::Layouts, &body.key(), &layout)?;
            for (part_row, value) in all(batch, Table::Parts, &[id.as_bytes(), b"\0"].concat())? {
                let number = key::of_part(&part_row);
                if !layout.parts.iter().any(|part| part.number == number) {
                    release(batch, decode::<records::Part>(&value)?.body)?;
                }
                batch.remove(Table::Parts, &part_row)?;
            }
            batch.remove(Table::Uploads, &row)?;
            let object = records::Object {
                size,
                etag,
                modified: Moment::now(),
                headers: upload.headers,
                checksum,
                body: Body::Parts(body),
                upload: Some(id.clone()),
            };
            place(batch, &ids, &to, there, &object, "ObjectCreated:CompleteMultipartUpload")?;
            Ok(object)
        });
        let object = complete.await?;
        let sum = object.checksum.as_ref();
        Ok(CompleteMultipartUploadOutput {
            bucket: Some(bucket),
            key: Some(object_key),
            location: Some(location),
            e_tag: Some(ETag::Strong(object.etag)),
            checksum_crc32: of(sum, Algorithm::Crc32),
            checksum_crc32c: of(sum, Algorithm::Crc32c),
            checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
            checksum_sha1: of(sum, Algorithm::Sha1),
            checksum_sha256: of(sum, Algorithm::Sha256),
            checksum_type: sum.map(|sum| ChecksumType::from_static(sum.kind.name())),
            ..CompleteMultipartUploadOutput::default()
        })
    }

    pub(super) async fn handle_abort_multipart_upload(
        &self,
        input: AbortMultipartUploadInput,
    ) -> Answer<AbortMultipartUploadOutput> {
        let abort = self.change(Kind::Shrinks, move |batch| {
            bucket(batch, &input.bucket)?;
            let row = key::upload(&input.bucket, &input.key, &input.upload_id);
            if batch.get(Table::Uploads, &row)?.is_none() {
                return Err(no_such_upload().into());
            }
            Ok(abandon(batch, &row)?)
        });
        abort.await?;
        Ok(AbortMultipartUploadOutput::default())
    }
}

/// A part in the client's list.
struct Wanted {
    number: u16,
    etag: String,
    checksum: Option<(Algorithm, String)>,
}

/// The client's data about the whole object.
struct Claim {
    kind: Option<String>,
    value: Option<(Algorithm, String)>,
    size: Option<u64>,
}

/// An object composed of parts.
struct Chosen {
    layout: Layout,
    size: u64,
    etag: String,
    checksum: Option<checksum::Checksum>,
}

/// Parses the client's list: at least one part, in ascending order.
fn wanted(listed: Vec<CompletedPart>) -> Answer<Vec<Wanted>> {
    if listed.is_empty() || listed.len() > usize::try_from(MAX_PARTS).unwrap_or_default() {
        return Err(s3_error!(MalformedXML, "You must specify between 1 and {MAX_PARTS} parts"));
    }
    let mut wanted: Vec<Wanted> = Vec::with_capacity(listed.len());
    for part in listed {
        let number = part.part_number.ok_or_else(|| s3_error!(MalformedXML, "a part has no number"))?;
        let number = part_number(number)?;
        if wanted.last().is_some_and(|before| before.number >= number) {
            return Err(s3_error!(
                InvalidPartOrder,
                "The list of parts was not in ascending order. Parts must be ordered by part number."
            ));
        }
        let etag = part.e_tag.ok_or_else(|| s3_error!(MalformedXML, "part {number} has no ETag"))?;
        let checksums = [
            (Algorithm::Crc32, part.checksum_crc32),
            (Algorithm::Crc32c, part.checksum_crc32c),
            (Algorithm::Crc64nvme, part.checksum_crc64nvme),
            (Algorithm::Sha1, part.checksum_sha1),
            (Algorithm::Sha256, part.checksum_sha256),
        ];
        let checksum =
            checksums.into_iter().find_map(|(algorithm, value)| value.map(|value| (algorithm, value)));
        wanted.push(Wanted { number, etag: etag.into_value(), checksum });
    }
    Ok(wanted)
}

/// Finds the parts in the client's list, and checks the client's data about them.
fn choose(
    batch: &Batch<'_>,
    id: &str,
    upload: &records::Upload,
    wanted: &[Wanted],
    claim: &Claim,
) -> Result<Chosen, ChangeError> {
    let mut parts = Vec::with_capacity(wanted.len());
    let mut md5s = Vec::with_capacity(wanted.len());
    let last = wanted.last().map_or(0, |part| part.number);
    for listed in wanted {
        let part: Option<records::Part> = find(batch, Table::Parts, &key::part(id, listed.number))?;
        let sum_matches = |part: &records::Part| {
            listed.checksum.as_ref().is_none_or(|(algorithm, value)| {
                *algorithm != part.checksum.algorithm || *value == part.checksum.value
            })
        };
        let Some(part) = part.filter(|part| part.etag == listed.etag && sum_matches(part)) else {
            return Err(s3_error!(
                InvalidPart,
                "One or more of the specified parts could not be found. The part may not have been uploaded, or the specified entity tag may not match the part's entity tag."
            )
            .into());
        };
        if part.size < SMALLEST_PART && listed.number != last {
            return Err(s3_error!(
                EntityTooSmall,
                "Your proposed upload is smaller than the minimum allowed size: part {} has {} bytes",
                listed.number,
                part.size
            )
            .into());
        }
        md5s.push(part.etag.clone());
        parts.push(LayoutPart {
            number: listed.number,
            size: part.size,
            body: part.body,
            checksum: Some(part.checksum),
        });
    }
    let size = parts.iter().map(|part| part.size).sum();
    if claim.size.is_some_and(|claimed| claimed != size) {
        return Err(invalid_request(format!(
            "The provided 'x-amz-mp-object-size' header value {} does not match what was computed: {size}",
            claim.size.unwrap_or_default()
        ))
        .into());
    }
    let sums: Vec<_> = parts.iter().filter_map(|part| Some((part.size, part.checksum.as_ref()?))).collect();
    let checksum = checksum::of_parts(upload.algorithm, upload.kind, &sums);
    if claim.kind.as_deref().is_some_and(|kind| upload.asked && kind != upload.kind.name()) {
        return Err(invalid_request(format!(
            "The upload was created using the {} checksum type. The complete request must use the same checksum type.",
            upload.kind.name()
        ))
        .into());
    }
    if let Some((algorithm, claimed)) = &claim.value {
        let matches = checksum.as_ref().is_some_and(|sum| {
            let value = sum.value.split_once('-').map_or(&*sum.value, |(value, _)| value);
            sum.algorithm == *algorithm && (sum.value == *claimed || value == claimed)
        });
        if !matches {
            let name = algorithm.name();
            return Err(s3_error!(
                BadDigest,
                "The {name} you specified did not match the calculated checksum."
            )
            .into());
        }
    }
    let etag = combined(&md5s);
    Ok(Chosen { layout: Layout { parts }, size, etag, checksum })
}

/// Computes S3's ETag of parts: the MD5 of their MD5s, and their number.
fn combined(md5s: &[String]) -> String {
    use s3s::crypto::{Checksum as _, Md5};
    let digit = |byte: u8| {
        char::from(byte).to_digit(16).and_then(|digit| u8::try_from(digit).ok()).unwrap_or_default()
    };
    let mut whole = Md5::new();
    for md5 in md5s {
        let bytes: Vec<u8> =
            md5.as_bytes().chunks(2).map(|pair| digit(pair[0]) << 4 | digit(pair[pair.len() - 1])).collect();
        whole.update(&bytes);
    }
    format!("{}-{}", etag(whole.finalize()), md5s.len())
}

fn part_number(number: i32) -> Answer<u16> {
    u16::try_from(number).ok().filter(|_| (1..=MAX_PARTS).contains(&number)).ok_or_else(|| {
        invalid_argument(format!("Part number must be an integer between 1 and {MAX_PARTS}, inclusive"))
    })
}

/// Parses `bytes=first-last`. Both must be given and lie within the source.
fn copied_range(range: &str, size: u64) -> Answer<std::ops::Range<u64>> {
    let malformed = || {
        invalid_argument(
            "The x-amz-copy-source-range value must be of the form bytes=first-last where first and last are the zero-based offsets of the first and last bytes to copy",
        )
    };
    let (first, last) =
        range.strip_prefix("bytes=").and_then(|range| range.split_once('-')).ok_or_else(malformed)?;
    let (first, last): (u64, u64) = first
        .parse()
        .ok()
        .zip(last.parse().ok())
        .filter(|(first, last)| first <= last)
        .ok_or_else(malformed)?;
    if last >= size {
        let message = format!("Range specified is not valid for source object of size: {size}");
        return Err(coded("InvalidArgument", StatusCode::BAD_REQUEST, message));
    }
    Ok(first..last + 1)
}

/// Returns the URL of the request's object, with the host that the client used.
fn location(req: &S3Request<CompleteMultipartUploadInput>) -> String {
    let named = req.headers.get(HOST).and_then(|host| host.to_str().ok());
    let host = named.or(req.uri.authority().map(Authority::as_str)).unwrap_or_default();
    format!("http://{host}{}", req.uri.path())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_etag_of_parts_is_as_s3_makes_it() {
        // The MD5s of "a" and "b"; the result was computed with Python's hashlib.
        let parts =
            ["0cc175b9c0f1b6a831c399e269772661", "92eb5ffee6ae2fec3ad71c777531578f"].map(str::to_owned);
        assert_eq!(combined(&parts), "96e024ba2074fe77e8e965ba43a704be-2");
    }

    #[test]
    fn a_list_has_at_most_10_000_parts() {
        let part = |number| CompletedPart {
            part_number: Some(number),
            e_tag: Some(ETag::Strong("0".to_owned())),
            ..CompletedPart::default()
        };
        let count = |last| wanted((1..=last).map(part).collect()).map(|parts| parts.len());
        assert_eq!(count(10_000).unwrap(), 10_000);
        for wrong in [wanted(Vec::new()), wanted((0..=10_000).map(part).collect())] {
            assert_eq!(
                wrong.err().map(|error| error.code().as_str().to_owned()).as_deref(),
                Some("MalformedXML")
            );
        }
    }

    #[test]
    fn ranges_of_a_source_lie_within_it() {
        assert_eq!(copied_range("bytes=0-9", 10).unwrap(), 0..10);
        assert_eq!(copied_range("bytes=3-3", 10).unwrap(), 3..4);
        for wrong in ["bytes=0-10", "bytes=5-4", "bytes=-5", "bytes=5-", "0-5", "bytes=a-b"] {
            assert!(copied_range(wrong, 10).is_err(), "{wrong}");
        }
    }
}
