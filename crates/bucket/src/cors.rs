//! CORS by a bucket's rules: the web pages of other sites that may send requests, and the response
//! headers that they see.
//! <https://docs.aws.amazon.com/AmazonS3/latest/userguide/cors.html>
//! The browser enforces the rules. They grant no rights: every request must be signed as without them.

use hyper::header::{
    ACCESS_CONTROL_ALLOW_CREDENTIALS, ACCESS_CONTROL_ALLOW_HEADERS, ACCESS_CONTROL_ALLOW_METHODS,
    ACCESS_CONTROL_ALLOW_ORIGIN, ACCESS_CONTROL_EXPOSE_HEADERS, ACCESS_CONTROL_MAX_AGE,
    ACCESS_CONTROL_REQUEST_HEADERS, ACCESS_CONTROL_REQUEST_METHOD, HeaderMap, HeaderName, HeaderValue,
    ORIGIN, VARY,
};
use hyper::{Method, Response, StatusCode};
use s3s::{Body, S3Result};

use crate::answer::coded;
use crate::records::CorsRule;

/// The request that a page wants to make, from a preflight or from the request itself.
struct Asked<'a> {
    origin: &'a str,
    method: &'a str,
    headers: Vec<String>,
}

/// The origin and the method of a request from a page of another site.
pub(crate) struct Origin {
    origin: String,
    method: String,
}

impl Origin {
    /// Reads the headers of a request that is no preflight. Returns `None` if it has no origin.
    pub(crate) fn of(method: &Method, headers: &HeaderMap) -> Option<Self> {
        let origin = headers.get(ORIGIN)?.to_str().ok()?.to_owned();
        Some(Self { origin, method: method.as_str().to_owned() })
    }

    /// Adds the headers to a response that allow the page to read it.
    pub(crate) fn allow(&self, rules: &[CorsRule], headers: &mut HeaderMap) {
        let asked = Asked { origin: &self.origin, method: &self.method, headers: Vec::new() };
        if let Some(rule) = rules.iter().find(|rule| matches(rule, &asked)) {
            headers.extend(allowed(rule, &asked));
        }
    }
}

/// Returns the response to a preflight.
///
/// # Errors
/// `BadRequest` for a preflight without method or origin, `AccessForbidden` if no rule allows it.
pub(crate) fn preflight(rules: &[CorsRule], headers: &HeaderMap) -> S3Result<Response<Body>> {
    let text = |name: HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
    let missing = |what: &str| {
        coded("BadRequest", StatusCode::BAD_REQUEST, format!("Insufficient information. {what} needed."))
    };
    let origin = text(ORIGIN).ok_or_else(|| missing("Origin request header"))?;
    let method =
        text(ACCESS_CONTROL_REQUEST_METHOD).ok_or_else(|| missing("Access-Control-Request-Method"))?;
    let named = text(ACCESS_CONTROL_REQUEST_HEADERS).unwrap_or_default().split(',').map(str::trim);
    let named = named.filter(|name| !name.is_empty()).map(str::to_ascii_lowercase).collect();
    let asked = Asked { origin, method, headers: named };
    let refused = |why: &str| coded("AccessForbidden", StatusCode::FORBIDDEN, format!("CORSResponse: {why}"));
    if rules.is_empty() {
        return Err(refused("CORS is not enabled for this bucket."));
    }
    let rule = rules.iter().find(|rule| matches(rule, &asked)).ok_or_else(|| {
        refused("This CORS request is not allowed: no rule of the bucket has its origin, method and headers.")
    })?;
    let mut response = Response::new(Body::empty());
    response.headers_mut().extend(allowed(rule, &asked));
    Ok(response)
}

fn matches(rule: &CorsRule, asked: &Asked<'_>) -> bool {
    rule.origins.iter().any(|pattern| is_like(pattern, asked.origin))
        && rule.methods.iter().any(|method| method == asked.method)
        && asked
            .headers
            .iter()
            .all(|name| rule.headers.iter().any(|pattern| is_like(&pattern.to_ascii_lowercase(), name)))
}

/// Returns whether a text matches a pattern, in which one `*` may stand for any text.
fn is_like(pattern: &str, text: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == text,
        Some((start, end)) => {
            text.len() >= start.len() + end.len() && text.starts_with(start) && text.ends_with(end)
        }
    }
}

fn allowed(rule: &CorsRule, asked: &Asked<'_>) -> HeaderMap {
    let any =
        rule.origins.iter().find(|pattern| is_like(pattern, asked.origin)).is_some_and(|one| one == "*");
    let origin = if any { "*" } else { asked.origin };
    let age = rule.max_age_seconds.map(|age| age.to_string()).unwrap_or_default();
    let mut all = HeaderMap::new();
    for (name, value) in [
        (ACCESS_CONTROL_ALLOW_ORIGIN, origin),
        (ACCESS_CONTROL_ALLOW_METHODS, &rule.methods.join(", ")),
        (ACCESS_CONTROL_ALLOW_HEADERS, &asked.headers.join(", ")),
        (ACCESS_CONTROL_EXPOSE_HEADERS, &rule.exposed.join(", ")),
        (ACCESS_CONTROL_MAX_AGE, &age),
        (ACCESS_CONTROL_ALLOW_CREDENTIALS, if any { "" } else { "true" }),
        (VARY, "Origin, Access-Control-Request-Headers, Access-Control-Request-Method"),
    ] {
        if let Ok(value) = HeaderValue::try_from(value)
            && !value.is_empty()
        {
            all.insert(name, value);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(origin: &str, methods: &[&str], headers: &[&str]) -> CorsRule {
        let all = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect();
        CorsRule {
            origins: all(&[origin]),
            methods: all(methods),
            headers: all(headers),
            exposed: all(&["ETag"]),
            max_age_seconds: Some(60),
            id: None,
        }
    }

    fn ask(rules: &[CorsRule], origin: &str, method: &str, headers: &str) -> Result<HeaderMap, String> {
        let given = [
            (ORIGIN, origin),
            (ACCESS_CONTROL_REQUEST_METHOD, method),
            (ACCESS_CONTROL_REQUEST_HEADERS, headers),
        ];
        let given = given.into_iter().filter(|(_, value)| !value.is_empty());
        let given = given.map(|(name, value)| (name, HeaderValue::from_str(value).unwrap())).collect();
        match preflight(rules, &given) {
            Ok(response) => Ok(response.headers().clone()),
            Err(error) => Err(error.code().as_str().to_owned()),
        }
    }

    #[test]
    fn a_preflight_is_allowed_by_the_first_rule_that_has_all_of_it() {
        let rules = [
            rule("https://*.example.com", &["PUT", "GET"], &["x-amz-*", "Content-Type"]),
            rule("*", &["GET"], &[]),
        ];
        let allowed = ask(&rules, "https://a.example.com", "PUT", "content-type, X-Amz-Meta-A").unwrap();
        assert_eq!(allowed[ACCESS_CONTROL_ALLOW_ORIGIN], "https://a.example.com");
        assert_eq!(allowed[ACCESS_CONTROL_ALLOW_METHODS], "PUT, GET");
        assert_eq!(allowed[ACCESS_CONTROL_ALLOW_HEADERS], "content-type, x-amz-meta-a");
        assert_eq!(allowed[ACCESS_CONTROL_MAX_AGE], "60");
        assert_eq!(allowed[ACCESS_CONTROL_ALLOW_CREDENTIALS], "true");
        let any = ask(&rules, "https://elsewhere.test", "GET", "").unwrap();
        assert_eq!(any[ACCESS_CONTROL_ALLOW_ORIGIN], "*");
        assert!(!any.contains_key(ACCESS_CONTROL_ALLOW_CREDENTIALS));
        for (origin, method, headers) in [
            ("https://elsewhere.test", "PUT", ""),
            ("https://elsewhere.test", "GET", "range"),
            ("https://a.example.com", "DELETE", ""),
            ("https://a.example.com", "PUT", "authorization"),
            ("http://a.example.com", "PUT", ""),
            ("https://.example.co", "PUT", ""),
        ] {
            let answer = ask(&rules, origin, method, headers).map(drop);
            assert_eq!(answer, Err("AccessForbidden".into()), "{origin} {method} {headers}");
        }
        assert_eq!(ask(&[], "https://a.example.com", "GET", "").map(drop), Err("AccessForbidden".into()));
        assert_eq!(ask(&rules, "", "GET", "").map(drop), Err("BadRequest".into()));
        assert_eq!(ask(&rules, "https://a.example.com", "", "").map(drop), Err("BadRequest".into()));
    }

    #[test]
    fn a_star_stands_for_anything_once() {
        assert!(is_like("*", "a") && is_like("a*c", "abc") && is_like("a*c", "ac"));
        assert!(!is_like("ab*bc", "abc") && !is_like("a", "ab"));
    }
}
