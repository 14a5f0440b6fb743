//! The headers that a signature of version 4 must cover, beyond the check of `s3s` that it is right.
//!
//! A signature covers only the headers that it lists, so the holder of a presigned URL may add some. A header that
//! begins with `x-amz-` changes the request: the source of a copy turns a write of one object into a read of another.

use hyper::HeaderMap;
use hyper::header::{AUTHORIZATION, DATE, HeaderName};
use s3s::{S3Error, S3ErrorCode, S3Result, s3_error};

use crate::gate::amz_date;

/// The longest time that a presigned URL may be valid in seconds, as on AWS.
const LONGEST_EXPIRY: u64 = 604_800;

const ALGORITHM: &str = "AWS4-HMAC-SHA256 ";

/// A signature of version 4: its credential and the headers that it covers.
struct Signature<'a> {
    /// The credential, as `KEY/DATE/REGION/SERVICE/aws4_request`.
    credential: &'a str,
    headers: &'a str,
    is_in_url: bool,
}

impl<'a> Signature<'a> {
    /// Finds the signature as `s3s` does: in the URL first. Returns `None` for a request signed by version 2, whose
    /// signature covers all headers that begin with `x-amz-`.
    fn of(headers: &'a HeaderMap, query: &'a [(String, String)]) -> S3Result<Option<Self>> {
        if parameter(query, "X-Amz-Signature")?.is_some() {
            let part = |name| Ok::<_, S3Error>(parameter(query, name)?.unwrap_or_default());
            let (credential, headers) = (part("X-Amz-Credential")?, part("X-Amz-SignedHeaders")?);
            return Ok(Some(Self { credential, headers, is_in_url: true }));
        }
        let Some(text) = headers.get(AUTHORIZATION) else { return Ok(None) };
        let text = text.to_str().unwrap_or_default();
        if text.starts_with("AWS ") && !text.contains("SignedHeaders=") {
            return Ok(None);
        }
        // `s3s` accepts any word as the algorithm, also one that looks like a list of headers.
        let parts = || {
            let credential = text.strip_prefix(ALGORITHM)?.trim_start().strip_prefix("Credential=")?;
            let (credential, rest) = credential.split_once(',')?;
            let (headers, _) = rest.trim_start().strip_prefix("SignedHeaders=")?.split_once(',')?;
            Some(Self { credential, headers, is_in_url: false })
        };
        let malformed = || s3_error!(AuthorizationHeaderMalformed, "The authorization header is malformed");
        parts().ok_or_else(malformed).map(Some)
    }

    fn covers(&self, header: &str) -> bool {
        self.headers.split(';').any(|listed| listed == header)
    }

    fn service(&self) -> &'a str {
        self.credential.rsplit('/').nth(1).unwrap_or_default()
    }

    fn malformed(&self, message: String) -> S3Error {
        let code = if self.is_in_url {
            S3ErrorCode::AuthorizationQueryParametersError
        } else {
            S3ErrorCode::AuthorizationHeaderMalformed
        };
        S3Error::with_message(code, message)
    }
}

/// Checks a request to S3 whose signature is right. Not for a form, which contains its signature and the
/// fields that it covers.
///
/// # Errors
/// `AccessDenied` for a header that must be signed and is not; AWS's codes for a signature of another service and for
/// a URL that is valid for too long.
pub(super) fn check(headers: &HeaderMap, query: &[(String, String)]) -> S3Result<()> {
    let Some(signature) = Signature::of(headers, query)? else { return Ok(()) };
    let service = signature.service();
    if service != "s3" {
        return Err(signature.malformed(format!("incorrect service \"{service}\": this is \"s3\"")));
    }
    if let Some(expires) = parameter(query, "X-Amz-Expires")?.filter(|_| signature.is_in_url)
        && !expires.parse().is_ok_and(|seconds: u64| seconds <= LONGEST_EXPIRY)
    {
        return Err(signature.malformed("X-Amz-Expires must be less than a week (in seconds)".to_owned()));
    }
    // The hash of the body is part of the signed text, or is checked against the body.
    let is_free = |name: &str| !name.starts_with("x-amz-") || name == "x-amz-content-sha256";
    // The signature covers the whole query of a URL, and a parameter of it may stand for a header (`gate`).
    let in_query = |name: &str| {
        signature.is_in_url
            && query.iter().any(|(given, value)| {
                given.eq_ignore_ascii_case(name) && headers.get(name).is_some_and(|header| header == value)
            })
    };
    let is_date = |name: &str| {
        let date = headers.get(DATE).filter(|_| name == "x-amz-date" && signature.covers("date"));
        date.and_then(|date| amz_date(date.to_str().ok()?))
            .is_some_and(|date| headers.get(name).is_some_and(|given| given == &date))
    };
    let mut names = headers.keys().map(HeaderName::as_str).filter(|name| !is_free(name)).chain(["host"]);
    match names.find(|name| !signature.covers(name) && !in_query(name) && !is_date(name)) {
        None => Ok(()),
        Some(name) => Err(s3_error!(
            AccessDenied,
            "There were headers present in the request which were not signed: {name}"
        )),
    }
}

/// Returns a parameter that may occur once. With two, one would be checked and the other used.
pub(super) fn parameter<'a>(query: &'a [(String, String)], name: &str) -> S3Result<Option<&'a str>> {
    let mut found = query.iter().filter(|(other, _)| other == name).map(|(_, value)| value.as_str());
    let first = found.next();
    if found.next().is_some() {
        return Err(s3_error!(InvalidArgument, "{name} occurs more than once"));
    }
    Ok(first)
}

#[cfg(test)]
mod tests {
    use hyper::header::HeaderValue;

    use super::*;

    fn outcome(headers: &[(&'static str, &str)], query: &[(&str, &str)]) -> String {
        let headers = headers
            .iter()
            .map(|(name, value)| (HeaderName::from_static(name), HeaderValue::from_str(value).unwrap()));
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).into(), (*value).into())).collect();
        match check(&headers.collect(), &query) {
            Ok(()) => "ok".to_owned(),
            Err(error) => error.code().as_str().to_owned(),
        }
    }

    const SCOPE: &str = "key/20261124/us-east-1/s3/aws4_request";

    #[test]
    fn every_header_that_changes_what_is_asked_for_is_signed() {
        let url = |listed: &'static str| {
            [("X-Amz-Signature", "0"), ("X-Amz-Credential", SCOPE), ("X-Amz-SignedHeaders", listed)]
        };
        let [copy, hash, free] =
            [("x-amz-copy-source", "/a/b"), ("x-amz-content-sha256", "0"), ("content-type", "a/b")];
        assert_eq!(outcome(&[hash, free], &url("host")), "ok");
        assert_eq!(outcome(&[hash, copy], &url("host")), "AccessDenied");
        assert_eq!(outcome(&[hash, copy], &url("host;x-amz-copy-source")), "ok");
        assert_eq!(outcome(&[copy], &url("host;x-amz-copy-source-range")), "AccessDenied");
        assert_eq!(outcome(&[copy], &url("host;X-Amz-Copy-Source")), "AccessDenied", "`s3s` found none");
        assert_eq!(outcome(&[], &url("content-type")), "AccessDenied");

        let of =
            |listed: &str| format!("AWS4-HMAC-SHA256 Credential={SCOPE},SignedHeaders={listed}, Signature=0");
        let (plain, whole) = (of("host"), of("host;x-amz-copy-source"));
        assert_eq!(outcome(&[("authorization", &plain), hash, free], &[]), "ok");
        assert_eq!(outcome(&[("authorization", &plain), copy], &[]), "AccessDenied");
        assert_eq!(outcome(&[("authorization", &whole), copy], &[]), "ok");
        assert_eq!(outcome(&[("authorization", &of("x-amz-date"))], &[]), "AccessDenied");
        let twice = format!("SignedHeaders=host;x-amz-copy-source,{plain}");
        for disguised in [plain.replacen("AWS4-HMAC-SHA256", "AWS", 1), twice.clone(), format!("AWS {twice}")]
        {
            let answer = outcome(&[("authorization", &disguised), copy], &[]);
            assert_eq!(answer, "AuthorizationHeaderMalformed", "{disguised}");
        }
        // The signature that was checked applies.
        assert_eq!(outcome(&[("authorization", &whole), copy], &url("host")), "AccessDenied");
        let listed = ("X-Amz-SignedHeaders", "host;x-amz-copy-source");
        assert_eq!(outcome(&[("authorization", &plain), copy], &[listed]), "AccessDenied");
    }

    #[test]
    fn a_signed_date_or_parameter_covers_the_header_that_it_stands_for() {
        let plain = format!("AWS4-HMAC-SHA256 Credential={SCOPE},SignedHeaders=date;host, Signature=0");
        let signed = ("authorization", &*plain);
        let (date, same) = (("date", "Wed, 25 Nov 2026 01:02:03 GMT"), ("x-amz-date", "20261125T010203Z"));
        assert_eq!(outcome(&[signed, date, same], &[]), "ok");
        assert_eq!(outcome(&[signed, date, ("x-amz-date", "20261125T010204Z")], &[]), "AccessDenied");
        assert_eq!(outcome(&[signed, same], &[]), "AccessDenied");
        let url = |parameter| {
            [
                ("X-Amz-Signature", "0"),
                ("X-Amz-Credential", SCOPE),
                ("X-Amz-SignedHeaders", "host"),
                parameter,
            ]
        };
        let acl = ("x-amz-acl", "private");
        assert_eq!(outcome(&[acl], &url(("X-Amz-Acl", "private"))), "ok");
        assert_eq!(outcome(&[acl], &url(("X-Amz-Acl", "public-read"))), "AccessDenied");
        assert_eq!(outcome(&[signed, date, acl], &[("X-Amz-Acl", "private")]), "AccessDenied");
    }

    #[test]
    fn version_2_signs_all_that_matters_by_itself() {
        let copy = ("x-amz-copy-source", "/a/b");
        assert_eq!(outcome(&[("authorization", "AWS key:signature"), copy], &[]), "ok");
        assert_eq!(outcome(&[copy], &[("AWSAccessKeyId", "key"), ("Signature", "0")]), "ok");
    }

    #[test]
    fn a_url_is_valid_for_a_week_at_most() {
        let valid_for = |seconds| {
            let signed = [("X-Amz-Signature", "0"), ("X-Amz-Credential", SCOPE)];
            outcome(&[], &[signed[0], signed[1], ("X-Amz-SignedHeaders", "host"), ("X-Amz-Expires", seconds)])
        };
        assert_eq!(valid_for("604800"), "ok");
        for seconds in ["604801", "4294967295", "-1", ""] {
            assert_eq!(valid_for(seconds), "AuthorizationQueryParametersError", "{seconds}");
        }
    }

    #[test]
    fn what_was_signed_for_another_service_is_nothing_to_s3() {
        let scope = SCOPE.replace("/s3/", "/sts/");
        let url = [("X-Amz-Signature", "0"), ("X-Amz-Credential", &*scope), ("X-Amz-SignedHeaders", "host")];
        assert_eq!(outcome(&[], &url), "AuthorizationQueryParametersError");
        let header = format!("AWS4-HMAC-SHA256 Credential={scope}, SignedHeaders=host, Signature=0");
        assert_eq!(outcome(&[("authorization", &header)], &[]), "AuthorizationHeaderMalformed");
    }
}
