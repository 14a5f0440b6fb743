//! Corrections of responses in which `s3s` differs from S3: control characters in XML as references, a message in
//! every error, and the entity tag of GetObjectAttributes without quotes.

use bytes::Bytes;
use http_body_util::BodyExt;
use hyper::Response;
use hyper::header::{CONTENT_LENGTH, CONTENT_TYPE};
use s3s::{Body, HttpError};

/// Rewrites the response of an operation if it is XML written by the store. The body of an object is not changed.
pub(crate) async fn written(operation: &str, response: Response<Body>) -> Result<Response<Body>, HttpError> {
    let is_xml = response.headers().get(CONTENT_TYPE).is_some_and(|kind| kind == "application/xml");
    let is_object = matches!(operation, "GetObject" | "HeadObject") && response.status().is_success();
    if !is_xml || is_object {
        return Ok(response);
    }
    let (mut parts, body) = response.into_parts();
    let bytes = body.collect().await.map_err(HttpError::new)?.to_bytes();
    let Ok(text) = std::str::from_utf8(&bytes) else {
        return Ok(Response::from_parts(parts, Body::from(bytes)));
    };
    let mut text = with_references(text);
    if operation == "GetObjectAttributes" {
        text = text.replace("<ETag>\"", "<ETag>").replace("\"</ETag>", "</ETag>");
    }
    if !parts.status.is_success() {
        text = with_message(text);
    }
    parts.headers.remove(CONTENT_LENGTH);
    Ok(Response::from_parts(parts, Body::from(Bytes::from(text))))
}

/// Replaces control characters by references: a parser reads a bare carriage return as a line feed, and trims white
/// space. `s3s` writes none between elements.
fn with_references(text: &str) -> String {
    let (declaration, rest) = match text.find("?>") {
        Some(end) if text.starts_with("<?xml") => text.split_at(end + 2),
        _ => ("", text),
    };
    let mut written = String::with_capacity(text.len());
    written.push_str(declaration);
    for character in rest.chars() {
        match character {
            '\0'..='\x1f' | '\x7f' | '\u{fffe}' | '\u{ffff}' => {
                written.push_str(&format!("&#{};", u32::from(character)));
            }
            _ => written.push(character),
        }
    }
    written
}

/// Adds a message to an error that has none.
fn with_message(text: String) -> String {
    let Some((before, rest)) = text.split_once("<Code>") else { return text };
    let Some((code, after)) = rest.split_once("</Code>") else { return text };
    let has_message = after.split_once("<Message>").is_some_and(|(_, message)| !message.starts_with("</"));
    if has_message {
        return text;
    }
    let after = after.replacen("<Message></Message>", "", 1).replacen("<Message/>", "", 1);
    format!("{before}<Code>{code}</Code><Message>{}</Message>{after}", message(code))
}

/// Returns S3's message for an error code.
fn message(code: &str) -> &'static str {
    match code {
        "AccessDenied" => "Access Denied",
        "IncompleteBody" => {
            "You did not provide the number of bytes specified by the Content-Length HTTP header."
        }
        "InternalError" => "We encountered an internal error. Please try again.",
        "InvalidAccessKeyId" => "The AWS Access Key Id you provided does not exist in our records.",
        "InvalidBucketName" => "The specified bucket is not valid.",
        "InvalidPolicyDocument" => {
            "The content of the form does not meet the conditions specified in the policy document."
        }
        "InvalidURI" => "Couldn't parse the specified URI.",
        "KeyTooLongError" => "Your key is too long",
        "MalformedPOSTRequest" => "The body of your POST request is not well-formed multipart/form-data.",
        "MalformedXML" => {
            "The XML you provided was not well-formed or did not validate against our published schema"
        }
        "MaxMessageLengthExceeded" => "Your request was too big.",
        "MethodNotAllowed" => "The specified method is not allowed against this resource.",
        "MissingContentLength" => "You must provide the Content-Length HTTP header.",
        "MissingRequestBodyError" => "Request body is empty.",
        "NotImplemented" => "A header or query you provided implies functionality that is not implemented.",
        "SignatureDoesNotMatch" => {
            "The request signature we calculated does not match the signature you provided. Check your key and signing method."
        }
        _ => "The request could not be served; the code says why.",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DECLARATION: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>";

    #[test]
    fn control_characters_are_references() {
        let text = format!("{DECLARATION}<Key>a\rb\u{1}c\n\td é😀</Key>");
        assert_eq!(with_references(&text), format!("{DECLARATION}<Key>a&#13;b&#1;c&#10;&#9;d é😀</Key>"));
    }

    #[test]
    fn every_error_has_a_message() {
        let bare = "<Error><Code>InvalidURI</Code></Error>".to_owned();
        let with_text =
            "<Error><Code>InvalidURI</Code><Message>Couldn't parse the specified URI.</Message></Error>";
        assert_eq!(with_message(bare), with_text);
        assert_eq!(with_message(with_text.to_owned()), with_text);
        let empty = "<Error><Code>Odd</Code><Message></Message></Error>".to_owned();
        assert!(with_message(empty).contains("<Message>The request could not be served"));
    }

    /// An object that is XML belongs to the user, and is not rewritten.
    #[tokio::test]
    async fn bodies_of_objects_stay() {
        let body = "<a>\r\n</a>";
        let answer = || {
            let response = Response::builder().header(CONTENT_TYPE, "application/xml");
            response.body(Body::from(body.to_owned())).unwrap()
        };
        for (operation, expected) in [("GetObject", body), ("ListObjects", "<a>&#13;&#10;</a>")] {
            let bytes =
                written(operation, answer()).await.unwrap().into_body().collect().await.unwrap().to_bytes();
            assert_eq!(bytes, expected, "{operation}");
        }
    }
}
