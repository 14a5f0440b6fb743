//! GetObject, HeadObject and GetObjectAttributes.

use std::ops::Range as Bytes;

use hyper::StatusCode;
use hyper::header::{
    CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_ENCODING, CONTENT_LANGUAGE, CONTENT_RANGE, CONTENT_TYPE,
    ETAG, EXPIRES, HeaderMap, HeaderValue, IF_RANGE, LAST_MODIFIED,
};
use s3s::dto::*;
use s3s::{S3Error, S3ErrorCode, S3Request, S3Response, S3Result, s3_error};

use super::Service;
use super::conditions::ReadConditions;
use super::objects::expires;
use super::writes::of;
use crate::answer::{Answer, coded, invalid_argument, invalid_request, time};
use crate::checksum::{Algorithm, Checksum as StoredChecksum};
use crate::records::{Layout, Object};

/// The part of an object that a request selects.
struct Selection {
    bytes: Bytes<u64>,
    /// The selection is not the whole object: the answer is 206 with a range.
    partial: bool,
    /// The index of the selected part.
    part: Option<usize>,
}

/// The data of an object for the headers of a response.
struct ReadInfo {
    object: Object,
    selection: Selection,
    checksum: Option<StoredChecksum>,
    /// The checksum kind of the whole object, also if `checksum` is that of a part.
    checksum_kind: Option<ChecksumType>,
    parts_count: Option<i32>,
}

impl ReadInfo {
    /// Selects the requested part of the object, and its checksum if that was requested too.
    fn new(
        object: &Object,
        layout: Option<&Layout>,
        range: Option<Range>,
        part_number: Option<i32>,
        mode: Option<&ChecksumMode>,
    ) -> Answer<Self> {
        let selection = select(object, layout, range, part_number)?;
        let whole = !selection.partial || selection.part.is_some();
        let wanted = whole && mode.is_some_and(|mode| mode.as_str() == ChecksumMode::ENABLED);
        let kind = object.checksum.as_ref().filter(|_| wanted).map(|sum| sum.kind.name());
        let checksum = match (selection.part, layout) {
            (Some(part), Some(layout)) => layout.parts[part].checksum.clone(),
            _ => object.checksum.clone(),
        };
        Ok(Self {
            object: object.clone(),
            selection,
            checksum: checksum.filter(|_| wanted),
            checksum_kind: kind.map(ChecksumType::from_static),
            parts_count: parts_count(part_number, layout),
        })
    }
}

/// Makes the response of a Get or a Head, which share these headers.
macro_rules! answer {
    ($output:ident, $info:expr $(, $field:ident: $value:expr)*) => {{
        let ReadInfo { object, selection, checksum, checksum_kind, parts_count } = $info;
        let sum = checksum.as_ref();
        $output {
            accept_ranges: Some("bytes".to_owned()),
            cache_control: object.headers.cache_control,
            checksum_crc32: of(sum, Algorithm::Crc32),
            checksum_crc32c: of(sum, Algorithm::Crc32c),
            checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
            checksum_sha1: of(sum, Algorithm::Sha1),
            checksum_sha256: of(sum, Algorithm::Sha256),
            checksum_type: checksum_kind,
            content_disposition: object.headers.content_disposition,
            content_encoding: object.headers.content_encoding,
            content_language: object.headers.content_language,
            content_length: i64::try_from(selection.bytes.end - selection.bytes.start).ok(),
            content_range: selection.partial.then(|| place(&selection.bytes, object.size)),
            content_type: Some(object.headers.content_type.unwrap_or_else(default_type)),
            e_tag: Some(ETag::Strong(object.etag)),
            expires: object.headers.expires.as_deref().and_then(date),
            last_modified: Some(object.modified.whole_seconds().into()),
            metadata: Some(object.headers.metadata.into_iter().collect()),
            parts_count,
            $($field: $value,)*
            ..$output::default()
        }
    }};
}

impl Service {
    pub(super) async fn handle_get_object(
        &self,
        req: S3Request<GetObjectInput>,
    ) -> S3Result<S3Response<GetObjectOutput>> {
        let range_holds = req.headers.get(IF_RANGE).cloned();
        let input = req.input;
        let conditions = ReadConditions {
            if_match: input.if_match,
            if_none_match: input.if_none_match,
            if_modified_since: input.if_modified_since,
            if_unmodified_since: input.if_unmodified_since,
        };
        let held = self.held(&input.bucket, &input.key)?;
        conditions.check(&held.object).map_err(|error| with_validators(error, &held.object))?;
        let mode = input.checksum_mode.as_ref();
        let range = input.range.filter(|_| is_of_range(range_holds.as_ref(), &held.object));
        let info = ReadInfo::new(&held.object, held.layout.as_ref(), range, input.part_number, mode)?;
        let body = StreamingBlob::new(held.bytes(&self.storage, info.selection.bytes.clone())?);
        Ok(S3Response::new(answer!(GetObjectOutput, info, body: Some(body))))
    }

    pub(super) fn handle_head_object(
        &self,
        req: &S3Request<HeadObjectInput>,
    ) -> S3Result<S3Response<HeadObjectOutput>> {
        let input = &req.input;
        let conditions = ReadConditions {
            if_match: input.if_match.clone(),
            if_none_match: input.if_none_match.clone(),
            if_modified_since: input.if_modified_since.clone(),
            if_unmodified_since: input.if_unmodified_since.clone(),
        };
        let snapshot = self.snapshot()?;
        let object = self.object(&snapshot, &input.bucket, &input.key)?;
        conditions.check(&object).map_err(|error| with_validators(error, &object))?;
        let layout = match input.part_number {
            Some(_) => self.layout(&snapshot, &object)?,
            None => None,
        };
        let mode = input.checksum_mode.as_ref();
        let range = input.range.filter(|_| is_of_range(req.headers.get(IF_RANGE), &object));
        let info = ReadInfo::new(&object, layout.as_ref(), range, input.part_number, mode)?;
        let partial = info.selection.partial;
        let mut response = S3Response::new(answer!(HeadObjectOutput, info));
        // For a Get, `s3s` adds these headers.
        let expires = input.response_expires.as_ref().and_then(|date| expires(Some(date)));
        for (name, value) in [
            (CACHE_CONTROL, input.response_cache_control.as_ref()),
            (CONTENT_DISPOSITION, input.response_content_disposition.as_ref()),
            (CONTENT_ENCODING, input.response_content_encoding.as_ref()),
            (CONTENT_LANGUAGE, input.response_content_language.as_ref()),
            (CONTENT_TYPE, input.response_content_type.as_ref()),
            (EXPIRES, expires.as_ref()),
        ] {
            let Some(value) = value else { continue };
            let value = HeaderValue::try_from(value.as_str())
                .map_err(|_| invalid_argument(format!("response-{name} cannot be a header")))?;
            response.headers.insert(name, value);
        }
        response.status = partial.then_some(StatusCode::PARTIAL_CONTENT);
        Ok(response)
    }

    pub(super) fn handle_get_object_attributes(
        &self,
        input: &GetObjectAttributesInput,
    ) -> Answer<GetObjectAttributesOutput> {
        let snapshot = self.snapshot()?;
        let object = self.object(&snapshot, &input.bucket, &input.key)?;
        let layout = self.layout(&snapshot, &object)?;
        // One header may name several attributes, separated by commas.
        let asked = |name: &str| {
            let mut named =
                input.object_attributes.iter().flat_map(|attribute| attribute.as_str().split(','));
            named.any(|attribute| attribute.trim() == name)
        };
        let sum = object.checksum.as_ref();
        let checksum = Checksum {
            checksum_crc32: of(sum, Algorithm::Crc32),
            checksum_crc32c: of(sum, Algorithm::Crc32c),
            checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
            checksum_sha1: of(sum, Algorithm::Sha1),
            checksum_sha256: of(sum, Algorithm::Sha256),
            checksum_type: sum.map(|sum| ChecksumType::from_static(sum.kind.name())),
        };
        let parts = match layout.filter(|_| asked(ObjectAttributes::OBJECT_PARTS)) {
            None => None,
            Some(layout) => Some(parts_page(&layout, input.max_parts, input.part_number_marker)?),
        };
        Ok(GetObjectAttributesOutput {
            checksum: asked(ObjectAttributes::CHECKSUM).then_some(checksum),
            e_tag: asked(ObjectAttributes::ETAG).then(|| ETag::Strong(object.etag.clone())),
            last_modified: Some(time(object.modified)),
            object_parts: parts,
            object_size: asked(ObjectAttributes::OBJECT_SIZE)
                .then(|| i64::try_from(object.size).unwrap_or(i64::MAX)),
            storage_class: asked(ObjectAttributes::STORAGE_CLASS)
                .then(|| StorageClass::from_static(StorageClass::STANDARD)),
            ..GetObjectAttributesOutput::default()
        })
    }
}

fn parts_page(layout: &Layout, most: Option<i32>, after: Option<i32>) -> Answer<GetObjectAttributesParts> {
    let most = usize::try_from(most.unwrap_or(1000))
        .map_err(|_| invalid_argument("max-parts is negative"))?
        .min(1000);
    let after = after.unwrap_or_default();
    let mut rest = layout.parts.iter().filter(|part| i32::from(part.number) > after);
    let parts: Vec<_> = rest
        .by_ref()
        .take(most)
        .map(|part| {
            let sum = part.checksum.as_ref();
            ObjectPart {
                checksum_crc32: of(sum, Algorithm::Crc32),
                checksum_crc32c: of(sum, Algorithm::Crc32c),
                checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
                checksum_sha1: of(sum, Algorithm::Sha1),
                checksum_sha256: of(sum, Algorithm::Sha256),
                part_number: Some(i32::from(part.number)),
                size: i64::try_from(part.size).ok(),
            }
        })
        .collect();
    Ok(GetObjectAttributesParts {
        is_truncated: Some(rest.next().is_some()),
        max_parts: i32::try_from(most).ok(),
        next_part_number_marker: Some(parts.last().and_then(|part| part.part_number).unwrap_or_default()),
        part_number_marker: Some(after),
        parts: Some(parts),
        total_parts_count: i32::try_from(layout.parts.len()).ok(),
    })
}

fn select(
    object: &Object,
    layout: Option<&Layout>,
    range: Option<Range>,
    part: Option<i32>,
) -> Answer<Selection> {
    match (range, part) {
        (None, None) => Ok(Selection { bytes: 0..object.size, partial: false, part: None }),
        (Some(_), Some(_)) => {
            Err(invalid_request("Cannot specify both Range header and partNumber query parameter."))
        }
        (Some(range), None) => {
            let bytes = range.check(object.size).ok().filter(|bytes| bytes.start < bytes.end);
            let bytes = bytes.ok_or_else(|| not_satisfiable(object.size))?;
            Ok(Selection { bytes, partial: true, part: None })
        }
        (None, Some(number)) => {
            if !(1..=10_000).contains(&number) {
                return Err(invalid_argument(
                    "Part number must be an integer between 1 and 10000, inclusive",
                ));
            }
            // The n-th of the object's parts, whatever numbers they were uploaded with.
            let part = usize::try_from(number - 1).unwrap_or_default();
            let Some(layout) = layout else {
                return match part {
                    0 => Ok(Selection { bytes: 0..object.size, partial: object.size > 0, part: Some(0) }),
                    _ => Err(no_such_part()),
                };
            };
            let size = layout.parts.get(part).ok_or_else(no_such_part)?.size;
            let start = layout.parts[..part].iter().map(|part| part.size).sum();
            Ok(Selection { bytes: start..start + size, partial: true, part: Some(part) })
        }
    }
}

/// Returns whether a range applies. `If-Range` names an entity tag or a date; if it differs, the
/// whole object is sent.
fn is_of_range(condition: Option<&HeaderValue>, object: &Object) -> bool {
    let Some(condition) = condition else { return true };
    let condition = condition.to_str().unwrap_or_default().trim();
    let same_date = || date(condition) == Some(object.modified.whole_seconds().into());
    condition == format!("\"{}\"", object.etag) || same_date()
}

fn no_such_part() -> S3Error {
    coded(
        "InvalidPartNumber",
        StatusCode::RANGE_NOT_SATISFIABLE,
        "The requested partnumber is not satisfiable",
    )
}

fn not_satisfiable(size: u64) -> S3Error {
    let mut error = s3_error!(InvalidRange, "The requested range is not satisfiable");
    if let Ok(value) = HeaderValue::from_str(&format!("bytes */{size}")) {
        error.set_headers(HeaderMap::from_iter([(CONTENT_RANGE, value)]));
    }
    error
}

/// Adds the headers of a 304.
fn with_validators(mut error: S3Error, object: &Object) -> S3Error {
    if *error.code() == S3ErrorCode::NotModified {
        let mut headers = HeaderMap::new();
        if let Ok(etag) = HeaderValue::from_str(&format!("\"{}\"", object.etag)) {
            headers.insert(ETAG, etag);
        }
        let mut date = Vec::new();
        let modified = Timestamp::from(object.modified.whole_seconds());
        if modified.format(TimestampFormat::HttpDate, &mut date).is_ok()
            && let Ok(date) = HeaderValue::from_bytes(&date)
        {
            headers.insert(LAST_MODIFIED, date);
        }
        error.set_headers(headers);
    }
    error
}

fn place(bytes: &Bytes<u64>, size: u64) -> String {
    format!("bytes {}-{}/{size}", bytes.start, bytes.end.saturating_sub(1))
}

fn parts_count(asked: Option<i32>, layout: Option<&Layout>) -> Option<i32> {
    asked?;
    layout.and_then(|layout| i32::try_from(layout.parts.len()).ok())
}

fn date(text: &str) -> Option<Timestamp> {
    Timestamp::parse(TimestampFormat::HttpDate, text).ok()
}

fn default_type() -> String {
    "binary/octet-stream".to_owned()
}
