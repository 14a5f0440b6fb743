//! Headers: those that an operation allows, and the values that request only what holds anyway.

use hyper::HeaderMap;
use hyper::header::{AUTHORIZATION, DATE, HeaderName, HeaderValue};
use s3s::dto::{Timestamp, TimestampFormat};
use s3s::{S3Error, S3Result, s3_error};

use super::operations::{Operation, Payload};
use crate::answer::{invalid_argument, invalid_request, no_lists, not_implemented, twice};
use crate::checksum::Algorithm;
use crate::options::OWNER;

/// The MD5 of zero bytes.
const MD5_OF_NOTHING: &str = "1B2M2Y8AsgTpgAmY7PhCfg==";

/// The headers that every operation allows.
const COMMON: [&str; 6] = [
    "x-amz-content-sha256",
    "x-amz-date",
    "x-amz-expected-bucket-owner",
    "x-amz-request-payer",
    "x-amz-security-token",
    "x-amz-user-agent",
];

/// The HTTP headers that change the meaning of a request.
const OF_HTTP: [&str; 7] = [
    "if-match",
    "if-none-match",
    "if-modified-since",
    "if-unmodified-since",
    "if-range",
    "range",
    "content-range",
];

/// Returns whether a header may change the meaning of a request.
pub(super) fn matters(name: &str) -> bool {
    name.starts_with("x-amz-") || OF_HTTP.contains(&name)
}

/// Checks that an operation allows every header, and that each occurs once with a valid value.
pub(super) fn check(operation: &Operation, headers: &HeaderMap) -> S3Result<()> {
    for name in headers.keys().map(HeaderName::as_str).filter(|name| matters(name) || *name == "content-md5")
    {
        let mut values = headers.get_all(name).iter().map(|value| value.to_str().unwrap_or_default());
        let value = values.next().unwrap_or_default();
        if name.starts_with("x-amz-grant-") && operation.headers.contains(&"x-amz-acl") {
            return Err(no_lists());
        }
        if !is_known(operation, name) {
            return Err(not_implemented(&format!("the header {name} of {}", operation.name)));
        }
        let is_list = name.starts_with("x-amz-meta-") || name == "x-amz-object-attributes";
        if !is_list && values.next().is_some() {
            return Err(twice(name));
        }
        check_value(operation, name, value.trim())?;
    }
    check_digests(operation, headers)
}

/// Checks that the digests of a body can be compared. A trailer needs a body in chunks, and the name of an
/// algorithm needs its checksum.
fn check_digests(operation: &Operation, headers: &HeaderMap) -> S3Result<()> {
    let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok()).map(str::trim);
    let in_chunks = text("x-amz-content-sha256").is_some_and(|hash| hash.starts_with("STREAMING-"));
    let of_chunks =
        ["x-amz-trailer", "x-amz-decoded-content-length"].into_iter().find(|name| text(name).is_some());
    if let Some(name) = of_chunks.filter(|_| !in_chunks) {
        return Err(invalid_request(format!(
            "{name} is for a body in chunks, which x-amz-content-sha256 has to say: STREAMING-UNSIGNED-PAYLOAD-TRAILER, for one"
        )));
    }
    // MinIO's clients name an algorithm with or without a checksum, so that the store computes one.
    let named = text("x-amz-checksum-algorithm").filter(|_| operation.payload == Payload::Bytes);
    if let Some(algorithm) = named.and_then(Algorithm::of_name) {
        let trailer = text("x-amz-trailer").map(str::to_ascii_lowercase);
        let in_header =
            Algorithm::ALL.into_iter().map(Algorithm::header).find(|name| headers.contains_key(*name));
        let given = in_header.or(trailer.as_deref());
        if given.is_some_and(|given| given != algorithm.header()) {
            return Err(invalid_request(format!(
                "x-amz-checksum-algorithm says {}, and {} is another one",
                algorithm.name(),
                given.unwrap_or_default()
            )));
        }
    }
    Ok(())
}

fn is_known(operation: &Operation, name: &str) -> bool {
    let listed = |list: &[&str]| list.contains(&name);
    // Clients for Java send the checksum of zero bytes with a Get.
    let has_digest = operation.payload != Payload::Form;
    name == "content-md5"
        || listed(&COMMON)
        || listed(operation.headers)
        || listed(operation.chosen_by)
        || (name.starts_with("x-amz-meta-") && operation.headers.contains(&"x-amz-meta-"))
        || (has_digest && (name == "x-amz-sdk-checksum-algorithm" || is_checksum(name)))
        || (operation.payload == Payload::Bytes
            && matches!(
                name,
                "x-amz-decoded-content-length"
                    | "x-amz-trailer"
                    | "x-amz-checksum-algorithm"
                    | "x-amz-checksum-type"
            ))
}

fn is_checksum(name: &str) -> bool {
    Algorithm::ALL.iter().any(|algorithm| algorithm.header() == name)
}

/// Checks the value of a header, or of the form field with its name.
pub(super) fn check_value(operation: &Operation, name: &str, value: &str) -> S3Result<()> {
    let is_there = match name {
        "x-amz-acl" => {
            if !matches!(value, "private" | "bucket-owner-full-control") {
                return Err(no_lists());
            }
            true
        }
        "x-amz-expected-bucket-owner" | "x-amz-source-expected-bucket-owner" => {
            if value != OWNER {
                return Err(s3_error!(AccessDenied, "the bucket belongs to {OWNER}"));
            }
            true
        }
        "content-md5" => {
            if operation.payload == Payload::None && value != MD5_OF_NOTHING {
                return Err(s3_error!(BadDigest, "The Content-MD5 is not that of a request without a body."));
            }
            true
        }
        _ if operation.payload == Payload::None && is_checksum(name) => {
            if !Algorithm::ALL.iter().any(|sum| sum.header() == name && sum.of(b"") == value) {
                return Err(s3_error!(BadDigest, "{name} is not that of a request without a body."));
            }
            true
        }
        // The checksum type of a body in one piece.
        "x-amz-checksum-type" if operation.payload == Payload::Bytes => value == "FULL_OBJECT",
        "x-amz-storage-class" => value == "STANDARD",
        "x-amz-server-side-encryption" => value == "AES256",
        "x-amz-server-side-encryption-bucket-key-enabled" => value == "false",
        "x-amz-bucket-object-lock-enabled" => value.eq_ignore_ascii_case("false"),
        "x-amz-tagging" => value.is_empty(),
        "x-amz-tagging-directive" => matches!(value, "COPY" | "REPLACE"),
        "x-amz-object-ownership" => value == "BucketOwnerEnforced",
        "x-amz-trailer" => is_checksum(&value.to_ascii_lowercase()),
        "x-amz-checksum-algorithm" | "x-amz-sdk-checksum-algorithm" => Algorithm::of_name(value).is_some(),
        "x-amz-content-sha256" => operation.payload == Payload::Bytes || !value.starts_with("STREAMING-"),
        _ => true,
    };
    if is_there { Ok(()) } else { Err(not_implemented(&format!("{name}: {value}"))) }
}

/// Converts an HTTP date (or the short form) to the format of `x-amz-date`.
pub(crate) fn amz_date(date: &str) -> Option<String> {
    if date.len() == 16 && date.ends_with('Z') && date.as_bytes().get(8) == Some(&b'T') {
        return Some(date.to_owned());
    }
    let time = Timestamp::parse(TimestampFormat::HttpDate, date).ok()?;
    let mut text = Vec::new();
    time.format(TimestampFormat::DateTime, &mut text).ok()?;
    // The format is 2026-11-25T01:02:03.000Z here.
    let text: String = String::from_utf8(text).ok()?.chars().filter(|c| !matches!(c, '-' | ':')).collect();
    let seconds = text.split(['.', 'Z']).next()?;
    Some(format!("{seconds}Z"))
}

/// Copies the `Date` of a request signed by version 4 to `x-amz-date` if that is missing.
pub(super) fn take_date(headers: &mut HeaderMap) {
    let is_v4 = headers.get(AUTHORIZATION).is_some_and(|value| value.as_bytes().starts_with(b"AWS4-"));
    if !is_v4 || headers.contains_key("x-amz-date") {
        return;
    }
    let date = headers.get(DATE).and_then(|date| date.to_str().ok()).and_then(amz_date);
    if let Some(date) = date.and_then(|date| HeaderValue::try_from(date).ok()) {
        headers.insert("x-amz-date", date);
    }
}

/// Returns the algorithm and the value of the checksum in a body's headers.
///
/// # Errors
/// `InvalidRequest` if there are several checksums, or an algorithm without its checksum.
pub(crate) fn checksum_header(headers: &HeaderMap) -> S3Result<Option<(Algorithm, String)>> {
    let mut named = Algorithm::ALL.into_iter().filter_map(|algorithm| {
        let value = headers.get(algorithm.header())?.to_str().unwrap_or_default();
        Some((algorithm, value.trim().to_owned()))
    });
    let first = named.next();
    if named.next().is_some() {
        return Err(invalid_request(
            "Expecting a single x-amz-checksum- header. Multiple checksum Types are not allowed.",
        ));
    }
    Ok(first)
}

/// Refuses an unknown field of a form.
pub(super) fn unknown_field(name: &str) -> S3Error {
    match name {
        "" => invalid_argument("a field of the form has no name"),
        _ => not_implemented(&format!("the field {name} of a form")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::operations::OPERATIONS;
    use super::*;

    fn code(operation: &str, name: &'static str, value: &'static str) -> String {
        let operation = OPERATIONS.iter().find(|known| known.name == operation).unwrap();
        let headers =
            HeaderMap::from_iter([(HeaderName::from_static(name), HeaderValue::from_static(value))]);
        match check(operation, &headers) {
            Ok(()) => "ok".to_owned(),
            Err(error) => error.code().as_str().to_owned(),
        }
    }

    #[test]
    fn what_would_change_the_meaning_is_refused() {
        for (name, value) in [
            ("x-amz-server-side-encryption", "aws:kms"),
            ("x-amz-server-side-encryption-customer-key", "key"),
            ("x-amz-server-side-encryption-bucket-key-enabled", "true"),
            ("x-amz-object-lock-mode", "GOVERNANCE"),
            ("x-amz-storage-class", "GLACIER"),
            ("x-amz-tagging", "a=b"),
            ("x-amz-website-redirect-location", "/b"),
            ("x-amz-object-ownership", "ObjectWriter"),
            ("x-amz-checksum-sha512", "AAAA"),
            ("x-amz-checksum-xxhash3", "AAAA"),
            ("x-amz-trailer", "x-amz-checksum-md5"),
            ("x-amz-trailer", "x-amz-checksum-crc32, x-amz-checksum-sha1"),
            ("x-amz-sdk-checksum-algorithm", "XXHASH64"),
            ("x-amz-checksum-algorithm", "SHA512"),
            ("x-amz-unheard-of", "1"),
            ("if-modified-since", "Wed, 18 May 2033 03:33:20 GMT"),
            ("content-range", "bytes 0-1/2"),
        ] {
            assert_eq!(code("PutObject", name, value), "NotImplemented", "{name}: {value}");
        }
        assert_eq!(code("PutObject", "x-amz-expected-bucket-owner", "111122223333"), "AccessDenied");
        for list in ["public-read", "bucket-owner-read", "authenticated-read", "", "log-delivery-write"] {
            assert_eq!(code("PutObject", "x-amz-acl", list), "AccessControlListNotSupported", "{list}");
        }
        assert_eq!(code("PutBucketAcl", "x-amz-grant-read", "id=1"), "AccessControlListNotSupported");
        assert_eq!(code("DeleteObject", "content-md5", "CY9rzUYh03PK3k6DJie09g=="), "BadDigest");
        assert_eq!(
            code("DeleteObjects", "x-amz-content-sha256", "STREAMING-UNSIGNED-PAYLOAD-TRAILER"),
            "NotImplemented"
        );
    }

    #[test]
    fn what_holds_anyway_may_be_said() {
        for (name, value) in [
            ("x-amz-acl", "private"),
            ("x-amz-acl", "bucket-owner-full-control"),
            ("x-amz-storage-class", "STANDARD"),
            ("x-amz-meta-colour", "red"),
            ("x-amz-server-side-encryption", "AES256"),
            ("x-amz-expected-bucket-owner", OWNER),
            ("x-amz-request-payer", "requester"),
            ("content-md5", "CY9rzUYh03PK3k6DJie09g=="),
            ("x-custom", "1"),
        ] {
            assert_eq!(code("PutObject", name, value), "ok", "{name}: {value}");
        }
        assert_eq!(code("DeleteObject", "x-amz-bypass-governance-retention", "true"), "ok");
        assert_eq!(code("CreateMultipartUpload", "content-md5", MD5_OF_NOTHING), "ok");
        assert_eq!(code("GetObject", "x-amz-checksum-crc32", "AAAAAA=="), "ok");
        assert_eq!(code("GetObject", "x-amz-checksum-crc32", "AAAAAQ=="), "BadDigest");
        assert_eq!(code("PostObject", "x-amz-checksum-crc32", "AAAAAA=="), "NotImplemented");
    }

    #[test]
    fn a_trailer_needs_a_body_in_chunks() {
        let operation = OPERATIONS.iter().find(|known| known.name == "PutObject").unwrap();
        let trailer = ("x-amz-trailer", "x-amz-checksum-CRC32");
        let length = ("x-amz-decoded-content-length", "5");
        for hash in ["STREAMING-UNSIGNED-PAYLOAD-TRAILER", "UNSIGNED-PAYLOAD", ""] {
            for header in [trailer, length] {
                let given = [header, ("x-amz-content-sha256", hash)];
                let headers = given
                    .into_iter()
                    .map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_static(value)));
                let is_fine = check(operation, &headers.collect()).is_ok();
                assert_eq!(is_fine, hash.starts_with("STREAMING"), "{given:?}");
            }
        }
    }

    #[test]
    fn an_algorithm_is_named_with_its_checksum_or_alone() {
        let operation = OPERATIONS.iter().find(|known| known.name == "UploadPart").unwrap();
        let named = ("x-amz-checksum-algorithm", "CRC32C");
        for (others, is_fine) in [
            (vec![("x-amz-checksum-crc32c", "4waSgw==")], true),
            (vec![("x-amz-trailer", "X-Amz-Checksum-Crc32c"), ("x-amz-content-sha256", "STREAMING-x")], true),
            (vec![("x-amz-checksum-crc32", "AAAAAA==")], false),
            (vec![("x-amz-trailer", "x-amz-checksum-sha1"), ("x-amz-content-sha256", "STREAMING-x")], false),
            (vec![("x-amz-checksum-type", "FULL_OBJECT")], true),
            (vec![("x-amz-checksum-type", "COMPOSITE")], false),
            (vec![], true),
        ] {
            let headers = others
                .iter()
                .chain([&named])
                .map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_static(value)));
            assert_eq!(check(operation, &headers.collect()).is_ok(), is_fine, "{others:?}");
        }
    }

    #[test]
    fn a_header_that_is_there_twice_is_refused() {
        let operation = OPERATIONS.iter().find(|known| known.name == "PutObject").unwrap();
        let mut headers = HeaderMap::new();
        for value in ["private", "public-read"] {
            headers.append("x-amz-acl", HeaderValue::from_static(value));
        }
        assert_eq!(check(operation, &headers).unwrap_err().code().as_str(), "InvalidArgument");
    }

    #[test]
    fn dates_are_read_as_http_has_them() {
        assert_eq!(amz_date("Wed, 25 Nov 2026 01:02:03 GMT").as_deref(), Some("20261125T010203Z"));
        assert_eq!(amz_date("20261125T010203Z").as_deref(), Some("20261125T010203Z"));
        for wrong in ["", "yesterday", "2026-11-25"] {
            assert_eq!(amz_date(wrong), None, "{wrong}");
        }
    }
}
