//! Requests that no client sends, signed as the owner's: any method, target, headers and body.

use std::time::{Duration, SystemTime};

use aws_sdk_s3::config::Credentials;
use aws_sigv4::http_request::{
    PayloadChecksumKind, PercentEncodingMode, SignableBody, SignableRequest, SignatureLocation,
    SigningInstructions, SigningSettings, UriPathNormalizationMode, sign,
};
use aws_sigv4::sign::v4::SigningParams;

use crate::stage::{Stage, raw};

/// A reply as text.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: u16,
    /// The headers with their names in lower case.
    pub(crate) head: String,
    pub(crate) body: String,
}

impl Answer {
    pub(crate) fn parse(text: &str) -> Self {
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((text, ""));
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or_default();
        Self { status, head: head.to_lowercase(), body: body.to_owned() }
    }

    /// Returns the text of the first element with a name.
    pub(crate) fn element(&self, name: &str) -> &str {
        let start = self.body.split_once(&format!("<{name}>")).map_or("", |(_, rest)| rest);
        start.split_once("</").map_or("", |(text, _)| text)
    }

    pub(crate) fn header(&self, name: &str) -> &str {
        let line = self.head.lines().find(|line| line.starts_with(&format!("{name}: ")));
        line.and_then(|line| line.split_once(": ")).map_or("", |(_, value)| value)
    }

    /// Returns the status and S3's error code.
    pub(crate) fn failure(&self) -> (u16, &str) {
        (self.status, self.element("Code"))
    }
}

/// The part of a body that a signature covers.
#[derive(Clone, Copy)]
pub(crate) enum Signed {
    /// The hash of the body.
    Hash,
    /// Nothing. This is the value of `x-amz-content-sha256`.
    As(&'static str),
}

/// Sends a request. Adds a `Content-Length` for the body unless the headers define the transfer.
pub(crate) async fn send(
    stage: &Stage,
    method: &str,
    target: &str,
    headers: &[(&str, &str)],
    body: &[u8],
) -> Answer {
    send_signed(stage, method, target, headers, body, Signed::Hash).await
}

/// Returns a presigned target, valid for a minute.
pub(crate) fn presigned(stage: &Stage, method: &str, target: &str) -> String {
    let mut settings = settings();
    settings.signature_location = SignatureLocation::QueryParams;
    settings.payload_checksum_kind = PayloadChecksumKind::NoHeader;
    settings.expires_in = Some(Duration::from_secs(60));
    let host = stage.server.address().to_string();
    let uri = format!("http://{host}{target}");
    let headers = [("host", host.as_str())];
    let body = SignableBody::UnsignedPayload;
    let request = SignableRequest::new(method, &uri, headers.into_iter(), body).unwrap();
    let instructions = signed_as(settings, request);
    let mut signed = target.to_owned();
    for (name, value) in instructions.params() {
        let between = if signed.contains('?') { '&' } else { '?' };
        let value = percent_encoding::utf8_percent_encode(value, percent_encoding::NON_ALPHANUMERIC);
        signed += &format!("{between}{name}={value}");
    }
    signed
}

fn settings() -> SigningSettings {
    let mut settings = SigningSettings::default();
    settings.percent_encoding_mode = PercentEncodingMode::Single;
    settings.uri_path_normalization_mode = UriPathNormalizationMode::Disabled;
    settings.payload_checksum_kind = PayloadChecksumKind::XAmzSha256;
    settings
}

/// Signs as the owner with AWS's own signer.
fn signed_as(settings: SigningSettings, request: SignableRequest<'_>) -> SigningInstructions {
    let identity = Credentials::new("root", "secret-key", None, None, "test").into();
    let params = SigningParams::builder()
        .identity(&identity)
        .region("us-east-1")
        .name("s3")
        .time(SystemTime::now())
        .settings(settings)
        .build()
        .unwrap()
        .into();
    sign(request, &params).unwrap().into_parts().0
}

pub(crate) async fn send_signed(
    stage: &Stage,
    method: &str,
    target: &str,
    headers: &[(&str, &str)],
    body: &[u8],
    signed: Signed,
) -> Answer {
    let host = stage.server.address().to_string();
    let uri = format!("http://{host}{target}");
    let with_host = [("host", host.as_str())].into_iter().chain(headers.iter().copied());
    let payload = match signed {
        Signed::Hash => SignableBody::Bytes(body),
        Signed::As(name) => SignableBody::Precomputed(name.to_owned()),
    };
    let request = SignableRequest::new(method, &uri, with_host.clone(), payload).unwrap();
    let instructions = signed_as(settings(), request);
    let lines = with_host.chain(instructions.headers()).map(|(name, value)| format!("{name}: {value}\r\n"));
    let mut head =
        format!("{method} {target} HTTP/1.1\r\nConnection: close\r\n{}", lines.collect::<String>());
    if !headers.iter().any(|(name, _)| name.eq_ignore_ascii_case("transfer-encoding")) {
        head.push_str(&format!("Content-Length: {}\r\n", body.len()));
    }
    let request = [head.as_bytes(), b"\r\n", body].concat();
    Answer::parse(&raw(stage.server.address(), &request).await)
}

/// Returns the MD5 of a body in the form of `Content-MD5`.
pub(crate) fn md5(body: &[u8]) -> String {
    use s3s::crypto::{Checksum as _, Md5};
    base64_simd::STANDARD.encode_to_string(Md5::checksum(body))
}
