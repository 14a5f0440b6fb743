//! The parameters of a URL: those that an operation allows, and those of a presigned URL that stand for headers.

use hyper::header::{HeaderName, HeaderValue};
use hyper::{HeaderMap, Uri};
use s3s::{S3Result, s3_error};

use super::operations::Operation;
use crate::answer::{invalid_argument, not_implemented, twice};
use crate::checksum::Algorithm;

/// The parameters that sign a URL, by version 4 and by version 2.
const SIGNING: [&str; 11] = [
    "X-Amz-Algorithm",
    "X-Amz-Credential",
    "X-Amz-Date",
    "X-Amz-Expires",
    "X-Amz-SignedHeaders",
    "X-Amz-Signature",
    "X-Amz-Security-Token",
    "X-Amz-Content-Sha256",
    "AWSAccessKeyId",
    "Signature",
    "Expires",
];

/// Parses the query as `s3s` does. A parameter must not occur twice: one value would be checked and the other used.
pub(super) fn parse(uri: &Uri) -> S3Result<Vec<(String, String)>> {
    let query: Vec<(String, String)> = serde_urlencoded::from_str(uri.query().unwrap_or_default())
        .map_err(|error| s3_error!(error, InvalidURI, "The query of the URL could not be read"))?;
    let mut names: Vec<&str> = query.iter().map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(twice(pair[0])),
        None => Ok(query),
    }
}

fn is_of_signature(name: &str) -> bool {
    SIGNING.contains(&name)
}

/// Returns whether a parameter of a presigned URL stands for a header.
fn is_hoisted(name: &str) -> bool {
    !is_of_signature(name) && name.get(..6).is_some_and(|start| start.eq_ignore_ascii_case("x-amz-"))
}

/// Returns whether a URL is signed by version 4.
pub(super) fn is_presigned(query: &[(String, String)]) -> bool {
    query.iter().any(|(name, _)| name == "X-Amz-Signature")
}

/// Converts the parameters of a URL presigned by version 4 into the headers that they stand for, as S3 does. The
/// signature covers the whole query.
///
/// A checksum of zero bytes is dropped: clients that presign a put compute it before there is a body.
pub(super) fn hoist(query: &[(String, String)], headers: &mut HeaderMap) -> S3Result<()> {
    if !is_presigned(query) {
        return Ok(());
    }
    let empty = |name: &str, value: &str| {
        Algorithm::ALL.iter().any(|sum| name.eq_ignore_ascii_case(sum.header()) && sum.of(b"") == *value)
    };
    let of_nothing = query.iter().any(|(name, value)| empty(name, value));
    for (name, value) in query.iter().filter(|(name, _)| is_hoisted(name)) {
        if empty(name, value) || (of_nothing && name.eq_ignore_ascii_case("x-amz-sdk-checksum-algorithm")) {
            continue;
        }
        let (Ok(header), Ok(value)) = (HeaderName::try_from(name), HeaderValue::try_from(value)) else {
            return Err(invalid_argument(format!("{name} cannot be a header")));
        };
        match headers.get(&header) {
            Some(given) if given != value => {
                return Err(invalid_argument(format!("{name} is one in the URL and another in the header")));
            }
            _ => drop(headers.insert(header, value)),
        }
    }
    Ok(())
}

/// Checks that an operation allows every parameter.
pub(super) fn check(operation: &Operation, query: &[(String, String)]) -> S3Result<()> {
    let presigned = is_presigned(query);
    for (name, value) in query {
        let name = name.as_str();
        let is_known = match name {
            "x-id" => value == operation.name,
            "list-type" => value == "2" && operation.chosen_by.contains(&name),
            _ if presigned && is_hoisted(name) => true,
            _ => {
                operation.chosen_by.contains(&name)
                    || operation.query.contains(&name)
                    || is_of_signature(name)
            }
        };
        if !is_known {
            return Err(not_implemented(&format!("the parameter {name} of {}", operation.name)));
        }
        if name == "versionId" && !matches!(value.as_str(), "" | "null") {
            return Err(invalid_argument("Invalid version id specified: buckets here have no versions"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hoisted(uri: &'static str, given: &[(&'static str, &'static str)]) -> Result<Vec<String>, String> {
        let mut headers: HeaderMap = given
            .iter()
            .map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_static(value)))
            .collect();
        let query = parse(&Uri::from_static(uri)).map_err(|error| error.code().as_str().to_owned())?;
        hoist(&query, &mut headers).map_err(|error| error.code().as_str().to_owned())?;
        let mut all: Vec<String> =
            headers.iter().map(|(name, value)| format!("{name}={}", value.to_str().unwrap())).collect();
        all.sort();
        Ok(all)
    }

    #[test]
    fn parameters_of_a_presigned_url_stand_for_headers() {
        let url = "/a/b?X-Amz-Acl=private&x-amz-meta-colour=red&X-Amz-Signature=1&X-Amz-Date=2";
        assert_eq!(hoisted(url, &[]).unwrap(), ["x-amz-acl=private", "x-amz-meta-colour=red"]);
        assert_eq!(hoisted("/a/b?X-Amz-Acl=private", &[]).unwrap(), [""; 0]);
        let other = ("x-amz-acl", "public-read");
        assert_eq!(hoisted(url, &[other]), Err("InvalidArgument".into()));
        assert_eq!(hoisted("/a/b?x=1&%78=2", &[]), Err("InvalidArgument".into()));
    }

    #[test]
    fn a_checksum_that_was_made_before_there_was_a_body_says_nothing() {
        let of_nothing =
            "/a/b?x-amz-checksum-crc32=AAAAAA%3D%3D&x-amz-sdk-checksum-algorithm=CRC32&X-Amz-Signature=1";
        assert_eq!(hoisted(of_nothing, &[]).unwrap(), [""; 0]);
        let of_something =
            "/a/b?x-amz-checksum-crc32=y/Q5Jg%3D%3D&x-amz-sdk-checksum-algorithm=CRC32&X-Amz-Signature=1";
        assert_eq!(hoisted(of_something, &[]).unwrap().len(), 2);
    }
}
