//! Access control of all servers here: on loopback, for clients that know the token in the address.
//!
//! Every request must contain the right host and the token. If the browser sends the origin of a page, it must be
//! this server. So other machines, programs of other users without the address, and other pages in the same browser
//! are rejected.

use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;

use crate::error::Error;

/// The largest number of open connections: a page has fewer than ten.
pub(crate) const CONNECTIONS: usize = 64;

/// The time in which a connection must send the header of a request.
const HEADER: Duration = Duration::from_secs(3);

/// The pause after a connection that could not be accepted.
const REST: Duration = Duration::from_millis(100);

/// The length of the token in bytes of the system's randomness.
pub(crate) const TOKEN: usize = 16;

/// Allows only content of this server: no other script or style, and no frame around it.
const POLICY: &str = "default-src 'self'; connect-src 'self'; img-src 'self' data: blob:; object-src 'none'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The token and the host that each request must name.
#[derive(Debug)]
pub(crate) struct Door {
    token: String,
    host: String,
}

impl Door {
    /// Listens on this port, or on any free one if it is 0.
    ///
    /// # Errors
    /// Fails if the port is taken or the system has no randomness.
    pub(crate) async fn open(port: u16) -> Result<(TcpListener, Self), Error> {
        let mut random = [0; TOKEN];
        getrandom::fill(&mut random).map_err(|error| Error::Server(io::Error::other(error)))?;
        let token: String = random.iter().map(|byte| format!("{byte:02x}")).collect();
        let listener =
            TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port))).await.map_err(Error::Server)?;
        let host = listener.local_addr().map_err(Error::Server)?.to_string();
        Ok((listener, Self { token, host }))
    }

    /// Returns the URL of the page, with the token.
    pub(crate) fn address(&self) -> String {
        format!("http://{}/{}/", self.host, self.token)
    }

    fn is_allowed(&self, request: &Request) -> bool {
        let header = |name| request.headers().get(name).map(HeaderValue::as_bytes);
        let token = request.uri().path().split('/').nth(1).unwrap_or_default();
        let origin = format!("http://{}", self.host);
        let must_say = header(header::UPGRADE).is_some() || request.method() != Method::GET;
        let known_origin = match header(header::ORIGIN) {
            Some(from) => from == origin.as_bytes(),
            // Browsers always send the origin when a socket is opened or data is sent.
            None => !must_say,
        };
        header(header::HOST) == Some(self.host.as_bytes()) && known_origin && same(token, &self.token)
    }
}

/// Compares in constant time, which reveals nothing about the position of a difference.
fn same(given: &str, token: &str) -> bool {
    given.len() == token.len() && given.bytes().zip(token.bytes()).fold(0, |off, (a, b)| off | (a ^ b)) == 0
}

/// Rejects requests that are not allowed, and adds security headers to all responses.
pub(crate) async fn guard(State(door): State<Arc<Door>>, request: Request, next: Next) -> Response {
    let mut response = if door.is_allowed(&request) {
        next.run(request).await
    } else {
        (StatusCode::FORBIDDEN, "open the address that `rayfold studio` has printed\n").into_response()
    };
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-store"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Serves connections, of which at most [`CONNECTIONS`] are open. One that does not send its request is closed.
pub(crate) async fn serve(listener: TcpListener, router: Router) {
    let room = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let Ok(permit) = Arc::clone(&room).acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            // The system has no descriptors for now.
            tokio::time::sleep(REST).await;
            continue;
        };
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let connection = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(HEADER)
                .serve_connection(TokioIo::new(stream), service)
                .with_upgrades();
            // Its errors are those of the other side.
            let _ = connection.await;
            drop(permit);
        });
    }
}
