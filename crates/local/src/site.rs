//! The studio's static page beside the bucket: the local counterpart of CloudFront and Cognito in the stack.
//!
//! The page gets the same policies and the same file beside it (`rayfold.json`) as on AWS. There is one person, who need not sign
//! in: the page asks for that person's credentials. Everything is on the loopback interface.

use std::net::SocketAddr;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use bytes::Bytes;
use hyper::body::Incoming;
use hyper::header::{HOST, HeaderName, HeaderValue, ORIGIN};
use hyper::{Method, Request, Response, StatusCode};
use percent_encoding::percent_decode_str;
use rayfold_pipeline::store::{Connection, S3Store};
use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::http::{Body, Server, full, json as json_answer, listen};
use crate::person::sign_in;

/// The one person, as an identity pool would name people.
const PERSON: &str = "local:00000000-0000-0000-0000-000000000000";

/// The page of the studio, and the file that says whether a stack serves it.
const PAGE: &str = "studio.html";
const CONFIG: &str = "rayfold.json";

/// The path at which the page asks for credentials.
const CREDENTIALS: &str = "/credentials";

/// The beginning of the page's content security policy, and its part with the hosts that the page may contact.
const POLICY: &str = "default-src 'none';";
const TALKS_TO: &str = "connect-src 'self'";

/// The media types of the page's files.
const TYPES: [(&str, &str); 10] = [
    ("css", "text/css; charset=utf-8"),
    ("gif", "image/gif"),
    ("html", "text/html; charset=utf-8"),
    ("js", "text/javascript; charset=utf-8"),
    ("json", "application/json"),
    ("png", "image/png"),
    ("svg", "image/svg+xml"),
    ("ttf", "font/ttf"),
    ("wasm", "application/wasm"),
    ("zip", "application/zip"),
];

/// A server of the page; dropping it ends it.
#[derive(Debug)]
pub struct Site {
    address: SocketAddr,
    _server: Server,
}

impl Site {
    /// Serves the page of a folder, which `cargo xtask site` has built, and lets it use a bucket. `owner` may do everything with
    /// the bucket; the page may do what a person may.
    ///
    /// # Errors
    /// [`Error::NoPage`], [`Error::NoSession`], [`Error::Listen`], and [`Error::Bucket`] if the bucket refuses the page.
    pub async fn start(folder: &Path, address: SocketAddr, owner: Connection, bucket: &str) -> Result<Self> {
        let no_page = |reason: &dyn std::fmt::Display| Error::NoPage {
            folder: folder.to_owned(),
            reason: format!("{PAGE}: {reason}"),
        };
        let page = std::fs::read_to_string(folder.join(PAGE)).map_err(|error| no_page(&error))?;
        let policy = page.find(POLICY).and_then(|from| page[from..].split('"').next());
        let policy = policy.ok_or_else(|| no_page(&"it has no content policy"))?;
        // A store without people says so now, and not on the page.
        sign_in(&owner, PERSON, bucket).await?;
        let (listener, address) = listen(address).await?;
        let origin = format!("http://{address}");
        let allowed = S3Store::at(&owner, bucket).allow_page(&origin).await;
        allowed.map_err(|source| Error::Bucket { bucket: bucket.to_owned(), source })?;
        let talks_to = format!("{TALKS_TO} {}", owner.endpoint);
        let desk = Arc::new(Desk {
            config: json!({
                "bucket": bucket,
                "region": owner.region,
                "endpoint": format!("{}/{bucket}", owner.endpoint),
                "credentials": CREDENTIALS,
            }),
            policy: format!("{}; frame-ancestors 'none'", policy.replacen(TALKS_TO, &talks_to, 1)),
            page: page.replacen(TALKS_TO, &talks_to, 1),
            folder: folder.to_owned(),
            bucket: bucket.to_owned(),
            owner,
            origin,
        });
        let server = Server::start(listener, move |request| {
            let desk = Arc::clone(&desk);
            async move { Some(desk.answer(&request).await) }
        });
        Ok(Self { address, _server: server })
    }

    /// Returns the address of the page.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }
}

/// The files and the settings that the server serves.
struct Desk {
    folder: PathBuf,
    /// The content of `rayfold.json`.
    config: Value,
    /// The page, which may contact the store.
    page: String,
    policy: String,
    origin: String,
    owner: Connection,
    bucket: String,
}

impl Desk {
    async fn answer(&self, request: &Request<Incoming>) -> Response<Body> {
        let header = |name: HeaderName| request.headers().get(name).and_then(|value| value.to_str().ok());
        // Another name leads here only from the page of another site.
        let host = header(HOST).map(|host| format!("http://{host}"));
        if host.as_deref() != Some(&self.origin) {
            return refused(StatusCode::MISDIRECTED_REQUEST);
        }
        let mut answer = match (request.method(), request.uri().path()) {
            // Browsers name the origin of each request of this method: other pages get nothing.
            (&Method::POST, CREDENTIALS) if header(ORIGIN) == Some(&self.origin) => self.credentials().await,
            (&Method::GET | &Method::HEAD, path) => self.file(path),
            _ => refused(StatusCode::FORBIDDEN),
        };
        for (name, value) in [
            ("cache-control", "no-cache"),
            ("content-security-policy", &self.policy),
            ("cross-origin-opener-policy", "same-origin"),
            ("cross-origin-resource-policy", "same-origin"),
            ("referrer-policy", "no-referrer"),
            ("x-content-type-options", "nosniff"),
            ("x-frame-options", "DENY"),
        ] {
            if let Ok(value) = HeaderValue::from_str(value) {
                answer.headers_mut().insert(HeaderName::from_static(name), value);
            }
        }
        answer
    }

    async fn credentials(&self) -> Response<Body> {
        match sign_in(&self.owner, PERSON, &self.bucket).await {
            Ok(given) => {
                let answer = json!({
                    "identity": PERSON,
                    "accessKey": given.access_key,
                    "secretKey": given.secret_key,
                    "sessionToken": given.session_token,
                });
                json_answer(StatusCode::OK, &answer)
            }
            Err(error) => json_answer(StatusCode::BAD_GATEWAY, &json!({"why": error.to_string()})),
        }
    }

    fn file(&self, path: &str) -> Response<Body> {
        let name = match path.trim_start_matches('/') {
            "" => "index.html",
            CONFIG => return json_answer(StatusCode::OK, &self.config),
            name => name,
        };
        let Some(name) = plain(name) else { return refused(StatusCode::NOT_FOUND) };
        let content = if name == Path::new(PAGE) {
            Ok(self.page.clone().into_bytes())
        } else {
            std::fs::read(self.folder.join(&name))
        };
        let Ok(content) = content else { return refused(StatusCode::NOT_FOUND) };
        let ending = name.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let kind = TYPES.iter().find(|(known, _)| *known == ending);
        let mut answer = Response::new(full(content));
        let kind = HeaderValue::from_static(kind.map_or("application/octet-stream", |(_, kind)| kind));
        answer.headers_mut().insert(hyper::header::CONTENT_TYPE, kind);
        answer
    }
}

fn refused(status: StatusCode) -> Response<Body> {
    let mut answer = Response::new(full(Bytes::new()));
    *answer.status_mut() = status;
    answer
}

/// Returns the path of a file below a folder, or `None` if it would lead out of it.
fn plain(name: &str) -> Option<PathBuf> {
    let name = PathBuf::from(percent_decode_str(name).decode_utf8().ok()?.into_owned());
    name.components().all(|part| matches!(part, Component::Normal(_))).then_some(name)
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpStream;

    use super::*;
    use crate::{S3Server, StoreKind, any_port};

    const STUDIO: &str = "<meta content=\"default-src 'none'; connect-src 'self'; base-uri 'none'\" />";

    /// Sends a request, and returns the answer as text.
    async fn asked(site: &Site, line: &str, headers: &str) -> String {
        let mut stream = TcpStream::connect(site.address).await.unwrap();
        let host =
            if headers.contains("host:") { String::new() } else { format!("host: {}\r\n", site.address) };
        let request = format!("{line} HTTP/1.1\r\n{host}{headers}connection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        answer
    }

    async fn stage() -> (Site, S3Server, tempfile::TempDir) {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join("page");
        std::fs::create_dir_all(page.join("examples")).unwrap();
        for (name, text) in [
            ("studio.html", STUDIO),
            ("index.html", "start"),
            ("examples/a.zip", "zip"),
            ("rayfold.json", "{}"),
        ] {
            std::fs::write(page.join(name), text).unwrap();
        }
        std::fs::write(folder.path().join("secret"), "secret").unwrap();
        let data = folder.path().join("data");
        let server = S3Server::start(StoreKind::BuiltIn, &data, any_port(), None, &mut |_| {}).await.unwrap();
        S3Store::at(&server.connection(), "films").create_bucket().await.unwrap();
        let site = Site::start(&page, any_port(), server.connection(), "films").await.unwrap();
        (site, server, folder)
    }

    #[tokio::test]
    async fn it_serves_the_page_with_the_policies_of_the_stack() {
        let (site, server, _folder) = stage().await;
        let studio = asked(&site, "GET /studio.html", "").await;
        let talks_to = format!("connect-src 'self' {};", server.endpoint());
        assert_eq!(studio.matches(&talks_to).count(), 2, "in the header and in the page: {studio}");
        for header in ["frame-ancestors 'none'", "x-content-type-options: nosniff", "text/html"] {
            assert!(studio.contains(header), "{studio}");
        }
        assert!(asked(&site, "GET /", "").await.ends_with("start"));
        assert!(asked(&site, "GET /examples/a.zip", "").await.contains("application/zip"));
        let config = asked(&site, "GET /rayfold.json", "").await;
        assert!(config.contains(&format!("\"endpoint\":\"{}/films\"", server.endpoint())), "{config}");
    }

    #[tokio::test]
    async fn it_serves_nothing_beside_the_folder() {
        let (site, _server, _folder) = stage().await;
        for path in [
            "/../secret",
            "/%2e%2e/secret",
            "/..%2fsecret",
            "//etc/passwd",
            "/examples/../../secret",
            "/none",
        ] {
            let answer = asked(&site, &format!("GET {path}"), "").await;
            assert!(answer.starts_with("HTTP/1.1 404"), "{path}: {answer}");
        }
    }

    #[tokio::test]
    async fn only_its_own_page_gets_credentials_and_they_are_those_of_a_person() {
        let (site, server, _folder) = stage().await;
        let own = format!("origin: http://{}\r\n", site.address);
        for (line, headers) in [
            ("GET /credentials", own.as_str()),
            ("POST /credentials", ""),
            ("POST /credentials", "origin: https://example.com\r\n"),
            ("POST /credentials", "host: example.com\r\norigin: http://example.com\r\n"),
        ] {
            let answer = asked(&site, line, headers).await;
            assert!(
                !answer.contains("secretKey") && !answer.starts_with("HTTP/1.1 200"),
                "{line} {headers}: {answer}"
            );
        }
        let answer = asked(&site, "POST /credentials", &own).await;
        let given: Value = serde_json::from_str(&answer[answer.find('{').unwrap()..]).unwrap();
        let text = |name: &str| given[name].as_str().unwrap().to_owned();
        assert_ne!(text("secretKey"), server.credentials().secret_key);
        let person = Connection {
            access_key: text("accessKey"),
            secret_key: text("secretKey"),
            session_token: Some(text("sessionToken")),
            ..server.connection()
        };
        let store = S3Store::at(&person, "films");
        use rayfold_pipeline::store::{PutOptions, Store};
        let put = async |key: &str| store.put(key, Bytes::from_static(b"x"), PutOptions::always()).await;
        put(&format!("scripts/{PERSON}/a/1.txt")).await.unwrap();
        put("scripts/a/1.txt").await.unwrap_err();
    }

    #[tokio::test]
    async fn a_folder_without_the_page_is_named() {
        let (_site, server, folder) = stage().await;
        let error = Site::start(folder.path(), any_port(), server.connection(), "films").await.unwrap_err();
        assert!(error.to_string().contains("`cargo xtask site` builds it"), "{error}");
    }
}
