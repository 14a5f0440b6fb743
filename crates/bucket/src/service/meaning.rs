//! What a request asks for that is not there: answered `NotImplemented`, never passed over in silence.
//!
//! S3 has many headers that change what is stored or who may see it. Those that do nothing on a store with one owner and
//! without versions are let through; all others are named here.

use hyper::{HeaderMap, Uri};

use super::answer::{Answer, invalid_argument, not_implemented};
use s3s::{S3Request, s3_error};

/// Whose everything is.
pub(crate) const OWNER: &str = "000000000000";

/// Headers (and their start) that would change the meaning.
const UNSUPPORTED: [&str; 11] = [
    "x-amz-server-side-encryption",
    "x-amz-copy-source-server-side-encryption",
    "x-amz-object-lock-",
    "x-amz-bucket-object-lock-enabled",
    "x-amz-website-redirect-location",
    "x-amz-grant-",
    "x-amz-write-offset-bytes",
    "x-amz-mfa",
    "x-amz-rename-source",
    "x-amz-if-match-",
    "x-amz-optional-object-attributes",
];

/// Access lists that say what holds anyway.
const OWNERS_ALONE: [&str; 3] = ["private", "bucket-owner-full-control", "bucket-owner-read"];

/// Refuses a request that asks for what is not implemented.
pub(crate) fn check<T>(request: &S3Request<T>) -> Answer<()> {
    check_parts(&request.headers, &request.uri)
}

fn check_parts(headers: &HeaderMap, uri: &Uri) -> Answer<()> {
    for (name, value) in headers {
        let value = value.to_str().unwrap_or_default();
        check_one(name.as_str(), value)?;
    }
    for (name, value) in
        uri.query().unwrap_or_default().split('&').map(|pair| pair.split_once('=').unwrap_or((pair, "")))
    {
        if name.get(..6).is_some_and(|start| start.eq_ignore_ascii_case("x-amz-")) {
            // What a presigned URL carries in place of headers.
            check_one(&name.to_ascii_lowercase(), value)?;
        } else if name == "versionId" && !matches!(value, "" | "null") {
            return Err(invalid_argument("Invalid version id specified: buckets here have no versions"));
        }
    }
    Ok(())
}

fn check_one(name: &str, value: &str) -> Answer<()> {
    let refused = match name {
        "x-amz-acl" => !OWNERS_ALONE.contains(&value),
        "x-amz-storage-class" => value != "STANDARD",
        "x-amz-tagging" => !value.is_empty(),
        "x-amz-object-ownership" => value != "BucketOwnerEnforced",
        "x-amz-expected-bucket-owner" | "x-amz-source-expected-bucket-owner" => {
            if value != OWNER {
                return Err(s3_error!(AccessDenied, "the bucket belongs to {OWNER}"));
            }
            false
        }
        _ => UNSUPPORTED.iter().any(|start| name.starts_with(start)),
    };
    if refused { Err(not_implemented(&format!("{name}: {value}"))) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use hyper::header::{HeaderName, HeaderValue};
    use s3s::S3ErrorCode;

    use super::*;

    fn code(name: &'static str, value: &'static str) -> Option<S3ErrorCode> {
        let headers =
            HeaderMap::from_iter([(HeaderName::from_static(name), HeaderValue::from_static(value))]);
        check_parts(&headers, &Uri::from_static("/films/a")).err().map(|error| error.code().clone())
    }

    #[test]
    fn what_would_change_the_meaning_is_refused() {
        for (name, value) in [
            ("x-amz-server-side-encryption", "AES256"),
            ("x-amz-server-side-encryption-customer-key", "key"),
            ("x-amz-object-lock-mode", "GOVERNANCE"),
            ("x-amz-acl", "public-read"),
            ("x-amz-storage-class", "GLACIER"),
            ("x-amz-tagging", "a=b"),
            ("x-amz-grant-read", "id=1"),
            ("x-amz-website-redirect-location", "/b"),
            ("x-amz-object-ownership", "ObjectWriter"),
        ] {
            assert_eq!(code(name, value), Some(S3ErrorCode::NotImplemented), "{name}: {value}");
        }
        assert_eq!(code("x-amz-expected-bucket-owner", "111122223333"), Some(S3ErrorCode::AccessDenied));
        for (name, value) in [
            ("x-amz-acl", "private"),
            ("x-amz-storage-class", "STANDARD"),
            ("x-amz-meta-colour", "red"),
            ("x-amz-expected-bucket-owner", OWNER),
            ("x-amz-object-ownership", "BucketOwnerEnforced"),
            ("x-amz-request-payer", "requester"),
            // Nothing is under retention here.
            ("x-amz-bypass-governance-retention", "true"),
        ] {
            assert_eq!(code(name, value), None, "{name}: {value}");
        }
    }

    #[test]
    fn urls_are_looked_at_as_well() {
        let refused = |uri| check_parts(&HeaderMap::new(), &Uri::from_static(uri)).is_err();
        assert!(refused("/films/a?versionId=3sL4kqtJlcpXroDTDmJ"));
        assert!(refused("/films/a?X-Amz-Acl=public-read&X-Amz-Signature=1"));
        assert!(!refused("/films/a?versionId=null&X-Amz-Signature=1&partNumber=2"));
    }
}
