//! The gate, which refuses requests for unsupported features before any other code sees them.
//!
//! S3 grows by new sub-resources and headers. A server that ignores unknown ones mistakes the request for another:
//! `PUT key?annotation` for a put of the key. So the table of [`operations`] lists everything supported. Any other
//! method, query parameter, header that begins with `x-amz-`, form field or element of an XML body is answered with
//! `NotImplemented`. The access check also compares [`Gate::operation`] with the routing of `s3s`, so that no other
//! operation runs than the one found here.
//!
//! Knows no storage and no identities: it refuses the same requests for every caller.

mod body;
mod form;
mod operations;
mod queries;
mod values;
mod xml;

use hyper::header::CONTENT_TYPE;
use hyper::{HeaderMap, Method, Request};
use s3s::{Body, S3Error, S3Result};

use crate::answer::not_implemented;
use crate::host::in_host;
use body::{Guard, Verdict};
use operations::{OPERATIONS, On, Operation, Payload};

pub(crate) use values::{amz_date, checksum_header};

/// The result of the gate for a request.
#[derive(Clone)]
pub(crate) struct Gate {
    /// The operation, or `None` if the request is refused.
    operation: Option<&'static Operation>,
    verdict: Verdict,
}

impl Gate {
    /// Checks a request. Converts the query parameters that stand for headers into headers. The body is checked
    /// while it is read.
    ///
    /// Errors in a presigned URL are reported by [`Gate::check_route`] after its signature was checked. So a URL that
    /// was altered gets the error about its signature.
    ///
    /// # Errors
    /// `NotImplemented` for anything that is not in the table, and S3's code for a known header
    /// with an invalid value.
    pub(crate) fn admit(request: &mut Request<Body>) -> S3Result<Self> {
        let query = queries::parse(request.uri())?;
        let verdict = Verdict::default();
        match judge(request, &query, &verdict) {
            Ok(operation) => Ok(Self { operation: Some(operation), verdict }),
            Err(error) if queries::is_presigned(&query) => {
                verdict.set(error);
                Ok(Self { operation: None, verdict })
            }
            Err(error) => Err(error),
        }
    }

    /// Returns the operation's name in S3's API.
    pub(crate) fn operation(&self) -> &'static str {
        self.operation.map_or("", |operation| operation.name)
    }

    /// Returns the reason why the body was refused, if it was.
    pub(crate) fn refusal(&self) -> Option<S3Error> {
        self.operation.and_then(|_| self.verdict.take())
    }

    /// Refuses a request that was not admitted, or that is routed to another operation than the admitted one.
    pub(crate) fn check_route(&self, routed: &str) -> S3Result<()> {
        match self.operation {
            Some(operation) if operation.name == routed => Ok(()),
            Some(_) => Err(not_implemented("a request that could be read in two ways")),
            None => Err(self.verdict.take().unwrap_or_else(|| not_implemented("the request"))),
        }
    }
}

/// Finds the operation, and checks the whole request against it.
fn judge(
    request: &mut Request<Body>,
    query: &[(String, String)],
    verdict: &Verdict,
) -> S3Result<&'static Operation> {
    queries::hoist(query, request.headers_mut())?;
    values::take_date(request.headers_mut());
    let on = target(request.headers(), request.uri().path());
    let operation = find(request.method(), on, query, request.headers())?;
    queries::check(operation, query)?;
    values::check(operation, request.headers())?;
    if let Some(guard) = Guard::new(operation, request.headers(), verdict.clone())? {
        let body = std::mem::take(request.body_mut());
        *request.body_mut() = guard.around(body);
    }
    Ok(operation)
}

/// Returns the kind of resource that the request is about. Does not check names.
fn target(headers: &HeaderMap, path: &str) -> On {
    let decoded = percent_encoding::percent_decode_str(path).decode_utf8_lossy();
    let rest = decoded.strip_prefix('/').unwrap_or(&decoded);
    if in_host(headers).is_some() {
        return if rest.is_empty() { On::Bucket } else { On::Object };
    }
    match rest.split_once('/') {
        None if rest.is_empty() => On::Root,
        None | Some((_, "")) => On::Bucket,
        Some(_) => On::Object,
    }
}

/// Returns the operation that matches the most parameters.
fn find(
    method: &Method,
    on: On,
    query: &[(String, String)],
    headers: &HeaderMap,
) -> S3Result<&'static Operation> {
    if is_form(method, headers) {
        return OPERATIONS
            .iter()
            .find(|operation| operation.payload == Payload::Form && operation.on == on)
            .ok_or_else(|| not_implemented("a form that is not posted to a bucket"));
    }
    let is_there = |name: &&str| match name.starts_with("x-amz-") {
        true => headers.contains_key(*name),
        false => query.iter().any(|(given, _)| given == name),
    };
    OPERATIONS
        .iter()
        .filter(|operation| operation.method == method.as_str() && operation.on == on)
        .filter(|operation| operation.payload != Payload::Form && operation.chosen_by.iter().all(is_there))
        .max_by_key(|operation| operation.chosen_by.len())
        .ok_or_else(|| not_implemented(&format!("{method} of {}", on.name())))
}

/// Returns whether `s3s` treats the request as a browser's form, whatever else it contains.
fn is_form(method: &Method, headers: &HeaderMap) -> bool {
    let kind = headers.get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
    let kind = kind.split(';').next().unwrap_or_default().trim();
    method == Method::POST && kind.eq_ignore_ascii_case("multipart/form-data")
}

#[cfg(test)]
mod tests {
    use hyper::header::HOST;

    use super::*;

    fn admit(method: &str, uri: &str, headers: &[(&'static str, &str)]) -> Result<&'static str, String> {
        let mut request = Request::builder().method(method).uri(uri).header("host", "127.0.0.1:9000");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let mut request = request.body(Body::empty()).unwrap();
        match Gate::admit(&mut request) {
            Ok(gate) => Ok(gate.operation()),
            Err(error) => Err(error.code().as_str().to_owned()),
        }
    }

    #[test]
    fn requests_are_the_operations_of_the_reference() {
        let copy = ("x-amz-copy-source", "/films/a");
        for (method, uri, headers, operation) in [
            ("GET", "/", &[][..], "ListBuckets"),
            ("GET", "/films", &[], "ListObjects"),
            ("GET", "/films/", &[], "ListObjects"),
            ("GET", "/films?list-type=2&prefix=a", &[], "ListObjectsV2"),
            ("GET", "/films?versions", &[], "ListObjectVersions"),
            ("GET", "/films?location=", &[], "GetBucketLocation"),
            ("GET", "/films/a%2Fb?x-id=GetObject&partNumber=1", &[], "GetObject"),
            ("GET", "/films/a?uploadId=1", &[], "ListParts"),
            ("PUT", "/films/a?x-id=PutObject", &[], "PutObject"),
            ("PUT", "/films/a", &[copy], "CopyObject"),
            ("PUT", "/films/a?partNumber=1&uploadId=2", &[], "UploadPart"),
            ("PUT", "/films/a?partNumber=1&uploadId=2", &[copy], "UploadPartCopy"),
            ("POST", "/films/a?uploads", &[], "CreateMultipartUpload"),
            ("POST", "/films?delete", &[("content-md5", "1B2M2Y8AsgTpgAmY7PhCfg==")], "DeleteObjects"),
            ("POST", "/films", &[("content-type", "multipart/form-data; boundary=b")], "PostObject"),
            ("DELETE", "/films/a?uploadId=1", &[], "AbortMultipartUpload"),
            ("DELETE", "/films/a?versionId=null", &[], "DeleteObject"),
        ] {
            assert_eq!(admit(method, uri, headers).as_deref(), Ok(operation), "{method} {uri}");
        }
    }

    #[test]
    fn a_parameter_of_another_operation_is_refused() {
        for (method, uri) in [
            ("PUT", "/films/a?annotation&annotationName=n"),
            ("DELETE", "/films/a?annotation"),
            ("PUT", "/films/a?encryption"),
            ("PUT", "/films/a?partNumber=1"),
            ("PUT", "/films/a?uploadId=1"),
            ("DELETE", "/films/a?uploads"),
            ("GET", "/films?uploads&versions"),
            ("GET", "/films?list-type=3"),
            ("GET", "/films/a?prefix=b"),
            ("GET", "/?prefix=a&delimiter=/"),
            ("PUT", "/"),
            ("PATCH", "/films/a"),
            ("PUT", "/films/a?x-id=PutObjectAnnotation"),
            ("PUT", "/films/a?%61nnotation"),
            ("PUT", "/films/a?x-amz-acl=private"),
        ] {
            assert_eq!(admit(method, uri, &[]), Err("NotImplemented".into()), "{method} {uri}");
        }
        let post = ("content-type", "multipart/form-data; boundary=b");
        for uri in ["/films?delete", "/films/a?uploadId=1", "/"] {
            assert_eq!(admit("POST", uri, &[post]), Err("NotImplemented".into()), "{uri}");
        }
        for uri in ["/films/a?uploadId=1&uploadId=2", "/films/a?versionId=3sL4kqtJlcpXroDTDmJ"] {
            assert_eq!(admit("DELETE", uri, &[]), Err("InvalidArgument".into()), "{uri}");
        }
    }

    #[test]
    fn the_host_may_name_the_bucket() {
        let on =
            |host: &str, path: &str| target(&HeaderMap::from_iter([(HOST, host.parse().unwrap())]), path);
        assert_eq!(on("films.localhost:9000", "/"), On::Bucket);
        assert_eq!(on("films.s3.localhost", "/a"), On::Object);
        assert_eq!(on("localhost:9000", "/a"), On::Bucket);
        assert_eq!(on("127.0.0.1", "/"), On::Root);
        assert_eq!(on("localhost", "/films//"), On::Object);
        assert_eq!(on("localhost", "/films%2Fa"), On::Object);
    }
}
