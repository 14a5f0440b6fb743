//! The fields of a browser's form, parsed from the heads of its parts. `s3s` ignores fields that it does not know.

use s3s::{S3Error, S3Result};

use super::operations::Operation;
use super::values::{check_value, unknown_field};
use crate::answer::not_implemented;
use crate::checksum::Algorithm;

/// The largest number of bytes before the file.
const MAX_BYTES: usize = 1024 * 1024;

/// The fields that are stored or compared, or that belong to the form itself.
const KNOWN: [&str; 26] = [
    "bucket",
    "cache-control",
    "content-disposition",
    "content-encoding",
    "content-language",
    "content-md5",
    "content-type",
    "expires",
    "key",
    "policy",
    "redirect",
    "submit",
    "success_action_redirect",
    "success_action_status",
    "x-amz-acl",
    "x-amz-algorithm",
    "x-amz-credential",
    "x-amz-date",
    "x-amz-expected-bucket-owner",
    "x-amz-request-payer",
    "x-amz-sdk-checksum-algorithm",
    "x-amz-server-side-encryption",
    "x-amz-signature",
    "x-amz-storage-class",
    "x-amz-tagging",
    "acl",
];

/// The beginning of a form, before its file, as far as it has been received.
#[derive(Default)]
pub(super) struct Fields {
    bytes: Vec<u8>,
    is_done: bool,
}

impl Fields {
    /// Takes bytes. Checks the fields when the file begins.
    pub(super) fn take(&mut self, operation: &Operation, bytes: &[u8]) -> S3Result<()> {
        if self.is_done {
            return Ok(());
        }
        self.bytes.extend_from_slice(bytes);
        let text = String::from_utf8_lossy(&self.bytes);
        let Some(fields) = fields(&text) else {
            return if self.bytes.len() > MAX_BYTES { Err(too_long()) } else { Ok(()) };
        };
        for (name, value) in fields {
            check(operation, &name.to_ascii_lowercase(), value)?;
        }
        self.is_done = true;
        self.bytes = Vec::new();
        Ok(())
    }
}

fn too_long() -> S3Error {
    not_implemented("a form with more than 1 MiB before its file")
}

fn check(operation: &Operation, name: &str, value: &str) -> S3Result<()> {
    let is_checksum = Algorithm::ALL.iter().any(|algorithm| algorithm.header() == name);
    let is_free = name.starts_with("x-amz-meta-") || name.starts_with("x-ignore-");
    if !(KNOWN.contains(&name) || is_checksum || is_free) {
        return Err(unknown_field(name));
    }
    if name == "key" && value.contains("${filename}") {
        return Err(not_implemented("a key with ${filename}"));
    }
    // The short name of the header.
    let name = if name == "acl" { "x-amz-acl" } else { name };
    if name == "content-md5" { Ok(()) } else { check_value(operation, name, value) }
}

/// Returns the names and values of the fields before the file, or `None` until the file begins.
fn fields(text: &str) -> Option<Vec<(&str, &str)>> {
    let (boundary, _) = text.trim_start_matches("\r\n").split_once("\r\n")?;
    let mut fields = Vec::new();
    for part in text.split(boundary).skip(1) {
        let (head, value) = part.split_once("\r\n\r\n")?;
        let disposition = head.split("\r\n").find(|line| {
            line.get(..20).is_some_and(|start| start.eq_ignore_ascii_case("content-disposition:"))
        });
        let name = disposition.and_then(|line| parameter(line, "name")).unwrap_or_default();
        if name.eq_ignore_ascii_case("file") {
            return Some(fields);
        }
        fields.push((name, value.strip_suffix("\r\n").unwrap_or(value)));
    }
    None
}

/// Returns a parameter such as `name` of `form-data; name="key"; filename="a"`.
fn parameter<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let mut parts = line.split(';').map(str::trim).filter_map(|part| part.split_once('='));
    parts.find(|(given, _)| given.eq_ignore_ascii_case(name)).map(|(_, value)| value.trim_matches('"'))
}

#[cfg(test)]
mod tests {
    use super::super::operations::OPERATIONS;
    use super::*;

    fn code(fields: &[(&str, &str)], step: usize) -> String {
        let operation = OPERATIONS.iter().find(|known| known.name == "PostObject").unwrap();
        let mut body = String::new();
        for (name, value) in fields {
            body += &format!("--b\r\nContent-Disposition: form-data; name=\"{name}\"\r\n\r\n{value}\r\n");
        }
        body += "--b\r\nContent-Disposition: form-data; name=\"file\"; filename=\"x\"\r\n\
                 Content-Type: text/plain\r\n\r\nhello\r\n--b--\r\n";
        let mut form = Fields::default();
        for bytes in body.as_bytes().chunks(step) {
            if let Err(error) = form.take(operation, bytes) {
                return error.code().as_str().to_owned();
            }
        }
        if form.is_done { "ok".to_owned() } else { "the file was not found".to_owned() }
    }

    #[test]
    fn fields_that_are_not_known_are_refused() {
        for step in [1, 7, 10_000] {
            let key = ("key", "a");
            assert_eq!(code(&[key, ("Content-Type", "text/plain"), ("x-amz-meta-a", "b")], step), "ok");
            assert_eq!(code(&[key, ("acl", "private"), ("x-amz-checksum-crc32", "AAAAAA==")], step), "ok");
            assert_eq!(code(&[key, ("acl", "public-read")], step), "AccessControlListNotSupported");
            for field in ["tagging", "x-amz-website-redirect-location", "x-amz-checksum-sha512", "annex", ""]
            {
                let code = code(&[key, (field, "1")], step);
                assert!(code == "NotImplemented" || field.is_empty() && code == "InvalidArgument", "{field}");
            }
            assert_eq!(code(&[("key", "a/${filename}")], step), "NotImplemented");
        }
    }
}
