//! `AssumeRole` of AWS's Security Token Service: temporary keys with the rights of a policy.
//!
//! The store has no roles with policies, so the request's `Policy` alone defines the rights of the session, and it is
//! required. Responses and errors have STS's format (the Query protocol of 2011-06-15). That includes requests with a
//! wrong signature, which are refused before they reach this module ([`in_sts_shape`]).

use std::time::{Duration, SystemTime};

use http_body_util::{BodyExt, Limited};
use hyper::header::{CONTENT_LENGTH, CONTENT_TYPE, HeaderValue};
use hyper::http::Extensions;
use hyper::{HeaderMap, Method, Response, StatusCode, Uri};
use s3s::dto::{Timestamp, TimestampFormat};
use s3s::route::S3Route;
use s3s::{Body, HttpError, S3Request, S3Response, S3Result};

use super::caller::{Caller, Identities};
use super::session::Session;

const FORM: &str = "application/x-www-form-urlencoded";
const NAMESPACE: &str = "https://sts.amazonaws.com/doc/2011-06-15/";

/// The largest request in bytes. The policy may have 2,048 characters, each of up to three bytes that take
/// three in the form.
const LONGEST_REQUEST: usize = 8 << 10;

/// The largest number of characters of a policy, as on AWS.
const LONGEST_POLICY: usize = 2048;

/// The allowed lifetime of a session in seconds, as on AWS. `USUAL_DURATION` is the default.
const DURATION: std::ops::RangeInclusive<u64> = 900..=43_200;
const USUAL_DURATION: u64 = 3600;

/// The route that answers `POST /` with a form.
pub(crate) struct AssumeRole(pub(crate) Identities);

/// The reason why there is no session: the error's code and a message.
#[derive(Debug, PartialEq, Eq)]
struct Refusal {
    status: StatusCode,
    code: String,
    message: String,
}

impl Refusal {
    fn new(status: StatusCode, code: &str, message: impl Into<String>) -> Self {
        Self { status, code: code.to_owned(), message: message.into() }
    }

    fn invalid(message: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, "ValidationError", message)
    }
}

/// The parameters of a request.
#[derive(Debug, PartialEq, Eq)]
struct Wish {
    role: String,
    session: String,
    policy: String,
    duration: Duration,
}

impl Wish {
    fn read(form: &[u8]) -> Result<Self, Refusal> {
        let pairs: Vec<(String, String)> = serde_urlencoded::from_bytes(form)
            .map_err(|error| Refusal::invalid(format!("the form cannot be read: {error}")))?;
        let (mut action, mut version) = (None, None);
        let (mut role, mut session, mut policy, mut duration) = (None, None, None, None);
        for (name, value) in pairs {
            let place = match name.as_str() {
                "Action" => &mut action,
                "Version" => &mut version,
                "RoleArn" => &mut role,
                "RoleSessionName" => &mut session,
                "Policy" => &mut policy,
                "DurationSeconds" => &mut duration,
                _ => return Err(Refusal::invalid(format!("the parameter {name} is not supported"))),
            };
            if place.replace(value).is_some() {
                return Err(Refusal::invalid(format!("{name} occurs more than once")));
            }
        }
        let action = action.unwrap_or_default();
        if action != "AssumeRole" || version.as_deref() != Some("2011-06-15") {
            let message = format!("`{action}` is not supported: expected AssumeRole of version 2011-06-15");
            return Err(Refusal::new(StatusCode::BAD_REQUEST, "InvalidAction", message));
        }
        let required = |value: Option<String>, name| {
            value
                .filter(|text| !text.is_empty())
                .ok_or_else(|| Refusal::invalid(format!("{name} is missing")))
        };
        let role = role_name(&required(role, "RoleArn")?)?;
        let session = required(session, "RoleSessionName")?;
        let is_name_character = |c: char| c.is_ascii_alphanumeric() || "_+=,.@-".contains(c);
        if !(2..=64).contains(&session.len()) || !session.chars().all(is_name_character) {
            let message = format!("RoleSessionName `{session}`: expected 2 to 64 letters, digits or _+=,.@-");
            return Err(Refusal::invalid(message));
        }
        let policy = policy.ok_or_else(|| {
            Refusal::invalid("Policy is missing: roles have no policies here, it alone says what is allowed")
        })?;
        if policy.chars().count() > LONGEST_POLICY {
            let message = format!("Policy has more than {LONGEST_POLICY} characters");
            return Err(Refusal::new(StatusCode::BAD_REQUEST, "PackedPolicyTooLarge", message));
        }
        let duration = match duration {
            None => USUAL_DURATION,
            Some(text) => {
                text.parse().ok().filter(|seconds| DURATION.contains(seconds)).ok_or_else(|| {
                    let (least, most) = (DURATION.start(), DURATION.end());
                    Refusal::invalid(format!("DurationSeconds `{text}`: expected {least} to {most}"))
                })?
            }
        };
        Ok(Self { role, session, policy, duration: Duration::from_secs(duration) })
    }
}

/// Returns the name in `arn:aws:iam::000000000000:role/path/name`.
fn role_name(arn: &str) -> Result<String, Refusal> {
    let parts: Vec<&str> = arn.splitn(6, ':').collect();
    if let ["arn", "aws", "iam", "", account, rest] = parts[..]
        && account.len() == 12
        && account.bytes().all(|b| b.is_ascii_digit())
        && let Some(path) = rest.strip_prefix("role/")
        && let Some(name) = path.rsplit('/').next()
        && !name.is_empty()
        && name.chars().all(|c| c.is_ascii_alphanumeric() || "_+=,.@-".contains(c))
    {
        return Ok(name.to_owned());
    }
    Err(Refusal::invalid(format!("RoleArn `{arn}`: expected arn:aws:iam::000000000000:role/NAME")))
}

impl AssumeRole {
    async fn answer(&self, req: S3Request<Body>) -> Result<String, Refusal> {
        let denied = |why: &str| Refusal::new(StatusCode::FORBIDDEN, "AccessDenied", why);
        let Some(credentials) = &req.credentials else {
            let code = "MissingAuthenticationToken";
            return Err(Refusal::new(StatusCode::FORBIDDEN, code, "the request is not signed"));
        };
        if req.service.as_deref() != Some("sts") {
            return Err(denied("the request is signed for another service than sts"));
        }
        // Without that header the signature covers the body, as STS requires.
        if req.headers.get("x-amz-content-sha256").is_some_and(|hash| hash.len() != 64) {
            return Err(denied("the body must be signed"));
        }
        let now = SystemTime::now();
        let token = req.headers.get("x-amz-security-token").and_then(|token| token.to_str().ok());
        match self.0.caller(&credentials.access_key, token, now) {
            Ok(Caller::Owner) => {}
            Ok(Caller::Session(session)) => {
                return Err(denied(&format!("{} is not authorized to perform sts:AssumeRole", session.arn)));
            }
            Err(error) => {
                let message = error.message().unwrap_or_default();
                return Err(Refusal::new(StatusCode::FORBIDDEN, code_of(error.code().as_str()), message));
            }
        }
        let form = Limited::new(req.input, LONGEST_REQUEST).collect().await;
        let form = form.map_err(|_| denied("the body is too long, or not what was signed"))?.to_bytes();
        self.assume(Wish::read(&form)?, now).await
    }

    async fn assume(&self, wish: Wish, now: SystemTime) -> Result<String, Refusal> {
        let broken = |why: String| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "InternalFailure", why);
        let random = |letters| random(letters).map_err(|error| broken(error.to_string()));
        let (id, key) = (random(16)?, random(16)?);
        let (access_key, secret_key, token) = (format!("ASIA{key}"), random(40)?, random(120)?);
        let expires = now + wish.duration;
        let arn = format!("arn:aws:sts::000000000000:assumed-role/{}/{}", wish.role, wish.session);
        let session = Session::new(secret_key.clone(), token.clone(), &wish.policy, arn.clone(), expires)
            .map_err(|error| {
                let message = format!("the policy is refused: {error}");
                Refusal::new(StatusCode::BAD_REQUEST, "MalformedPolicyDocument", message)
            })?;
        let kept = self.0.sessions.add(&access_key, session, now).await;
        kept.map_err(|error| broken(format!("the session cannot be kept: {error}")))?;
        let mut expiration = Vec::new();
        Timestamp::from(expires)
            .format(TimestampFormat::DateTime, &mut expiration)
            .map_err(|error| broken(error.to_string()))?;
        let expiration = String::from_utf8_lossy(&expiration);
        let share = wish.policy.chars().count() * 100 / LONGEST_POLICY;
        // Names and keys contain no characters with a meaning in XML.
        Ok(format!(
            "<AssumeRoleResponse xmlns=\"{NAMESPACE}\"><AssumeRoleResult>\
             <AssumedRoleUser><AssumedRoleId>AROA{id}:{}</AssumedRoleId><Arn>{arn}</Arn></AssumedRoleUser>\
             <Credentials><AccessKeyId>{access_key}</AccessKeyId><SecretAccessKey>{secret_key}</SecretAccessKey>\
             <SessionToken>{token}</SessionToken><Expiration>{expiration}</Expiration></Credentials>\
             <PackedPolicySize>{share}</PackedPolicySize></AssumeRoleResult>\
             <ResponseMetadata><RequestId>{id}</RequestId></ResponseMetadata></AssumeRoleResponse>",
            wish.session
        ))
    }
}

/// Returns random characters of the 32 that occur in AWS's keys.
fn random(characters: usize) -> Result<String, getrandom::Error> {
    const ALPHABET: &[u8; 32] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";
    let mut bytes = vec![0; characters];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.into_iter().map(|byte| char::from(ALPHABET[usize::from(byte % 32)])).collect())
}

#[async_trait::async_trait]
impl S3Route for AssumeRole {
    fn is_match(&self, method: &Method, uri: &Uri, headers: &HeaderMap, _: &mut Extensions) -> bool {
        is_for_sts(method, uri, headers)
    }

    async fn check_access(&self, _: &mut S3Request<Body>) -> S3Result<()> {
        // The rights are checked when the response is made, because its errors have another format than S3's.
        Ok(())
    }

    async fn call(&self, req: S3Request<Body>) -> S3Result<S3Response<Body>> {
        let (status, text) = match self.answer(req).await {
            Ok(text) => (StatusCode::OK, text),
            Err(refusal) => (refusal.status, shown(&refusal)),
        };
        let mut answer = S3Response::with_status(Body::from(text), status);
        answer.headers.insert(CONTENT_TYPE, HeaderValue::from_static("text/xml"));
        Ok(answer)
    }
}

/// Returns whether the request is a form for STS and not a request to S3.
pub(crate) fn is_for_sts(method: &Method, uri: &Uri, headers: &HeaderMap) -> bool {
    let is_form = |value: &HeaderValue| {
        value.to_str().is_ok_and(|text| text.split(';').next().is_some_and(|kind| kind.trim() == FORM))
    };
    method == Method::POST
        && uri.path() == "/"
        && uri.query().is_none()
        && headers.get(CONTENT_TYPE).is_some_and(is_form)
}

fn shown(refusal: &Refusal) -> String {
    error_text(refusal.status, &escaped(&refusal.code), &escaped(&refusal.message))
}

/// Formats code and message as XML.
fn error_text(status: StatusCode, code: &str, message: &str) -> String {
    let fault = if status.is_server_error() { "Receiver" } else { "Sender" };
    format!(
        "<ErrorResponse xmlns=\"{NAMESPACE}\"><Error><Type>{fault}</Type><Code>{code}</Code>\
         <Message>{message}</Message></Error><RequestId>0</RequestId></ErrorResponse>"
    )
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            // XML cannot represent most of them.
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// Returns STS's name for an error that S3 names differently.
fn code_of(of_s3: &str) -> &str {
    match of_s3 {
        "InvalidAccessKeyId" | "InvalidToken" => "InvalidClientTokenId",
        "ExpiredToken" => "ExpiredTokenException",
        other => other,
    }
}

/// Converts a refusal in S3's format to STS's format, for a request that is meant for STS.
/// Returns other responses unchanged.
///
/// # Errors
/// Returns an error if the response body cannot be read.
pub(crate) async fn in_sts_shape(answer: Response<Body>) -> Result<Response<Body>, HttpError> {
    if !answer.status().is_client_error() {
        return Ok(answer);
    }
    let (mut parts, body) = answer.into_parts();
    let text = body.collect().await.map_err(HttpError::new)?.to_bytes();
    let text = String::from_utf8_lossy(&text);
    if text.contains("<ErrorResponse") {
        return Ok(Response::from_parts(parts, Body::from(text.into_owned())));
    }
    let code = code_of(element(&text, "Code").unwrap_or("AccessDenied"));
    let message = element(&text, "Message").unwrap_or("the request is refused");
    parts.status = StatusCode::FORBIDDEN;
    parts.headers.remove(CONTENT_LENGTH);
    let text = error_text(parts.status, code, message);
    Ok(Response::from_parts(parts, Body::from(text)))
}

/// Returns the text of an element of an error that the S3 service wrote.
fn element<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let start = text.split_once(&format!("<{name}>"))?.1;
    Some(start.split_once(&format!("</{name}>"))?.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "Action=AssumeRole&Version=2011-06-15&RoleSessionName=render\
        &RoleArn=arn%3Aaws%3Aiam%3A%3A000000000000%3Arole%2Fteam%2Frayfold-render\
        &Policy=%7B%7D+&DurationSeconds=900";

    #[test]
    fn a_wish_is_read_from_the_form() {
        let wish = Wish::read(GOOD.as_bytes()).unwrap();
        assert_eq!((wish.role.as_str(), wish.session.as_str()), ("rayfold-render", "render"));
        assert_eq!((wish.policy.as_str(), wish.duration.as_secs()), ("{} ", 900));
        let usual = Wish::read(GOOD.replace("&DurationSeconds=900", "").as_bytes()).unwrap();
        assert_eq!(usual.duration.as_secs(), 3600);
    }

    #[test]
    fn what_is_wrong_with_a_wish_is_named() {
        let long = format!("Policy={}", "x".repeat(LONGEST_POLICY + 1));
        for (good, bad, code, named) in [
            ("Action=AssumeRole", "Action=GetCallerIdentity", "InvalidAction", "GetCallerIdentity"),
            ("2011-06-15", "2012-01-01", "InvalidAction", "2011-06-15"),
            ("RoleSessionName=render&", "", "ValidationError", "RoleSessionName"),
            ("RoleSessionName=render", "RoleSessionName=a%2Fb", "ValidationError", "a/b"),
            ("RoleSessionName=render", "RoleSessionName=x", "ValidationError", "`x`"),
            ("role%2F", "user%2F", "ValidationError", "user/"),
            ("000000000000", "0", "ValidationError", "RoleArn"),
            ("&Policy=%7B%7D+", "", "ValidationError", "Policy"),
            ("Policy=%7B%7D+", &long, "PackedPolicyTooLarge", "2048"),
            ("=900", "=899", "ValidationError", "899"),
            ("=900", "=43201", "ValidationError", "43201"),
            ("=900", "=x", "ValidationError", "900 to 43200"),
            ("&DurationSeconds=900", "&PolicyArns.member.1.arn=a", "ValidationError", "PolicyArns"),
            ("&DurationSeconds=900", "&Policy=x", "ValidationError", "more than once"),
        ] {
            assert!(GOOD.contains(good), "{good}");
            let refusal = Wish::read(GOOD.replacen(good, bad, 1).as_bytes()).unwrap_err();
            assert_eq!((refusal.code.as_str(), refusal.status.as_u16()), (code, 400), "{bad}");
            assert!(refusal.message.contains(named), "{bad}: {}", refusal.message);
        }
    }

    #[test]
    fn a_policy_may_be_as_long_as_awss() {
        let policy = "x".repeat(LONGEST_POLICY);
        let form = GOOD.replace("Policy=%7B%7D+", &format!("Policy={policy}"));
        assert_eq!(Wish::read(form.as_bytes()).unwrap().policy, policy);
    }

    #[test]
    fn only_a_form_that_is_posted_to_the_root_is_for_sts() {
        let is_for = |method: Method, uri: &str, kind: Option<&str>| {
            let kind = kind.map(|kind| (CONTENT_TYPE, HeaderValue::from_str(kind).unwrap()));
            is_for_sts(&method, &uri.parse().unwrap(), &kind.into_iter().collect())
        };
        assert!(is_for(Method::POST, "/", Some(FORM)));
        assert!(is_for(Method::POST, "/", Some(&format!("{FORM}; charset=utf-8"))));
        for (method, uri, kind) in [
            (Method::GET, "/", Some(FORM)),
            (Method::POST, "/bucket", Some(FORM)),
            (Method::POST, "/?delete", Some(FORM)),
            (Method::POST, "/", Some("text/plain")),
            (Method::POST, "/", None),
            (Method::PUT, "/bucket?acl", None),
        ] {
            assert!(!is_for(method.clone(), uri, kind), "{method} {uri} {kind:?}");
        }
    }

    #[test]
    fn keys_are_of_all_32_letters() {
        let letters: std::collections::BTreeSet<char> = random(10_000).unwrap().chars().collect();
        assert_eq!(letters.into_iter().collect::<String>(), "234567ABCDEFGHIJKLMNOPQRSTUVWXYZ");
    }

    #[test]
    fn errors_are_xml_whatever_they_say() {
        let text = shown(&Refusal::invalid("a < b & \u{1}c"));
        assert!(text.contains("<Message>a &lt; b &amp;  c</Message>"), "{text}");
        assert_eq!(element(&text, "Code"), Some("ValidationError"));
    }
}
