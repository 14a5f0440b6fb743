//! The listener: connections in, requests to the service, an end in order.

use std::net::SocketAddr;
use std::time::Duration;

use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use s3s::auth::SimpleAuth;
use s3s::service::{S3Service, S3ServiceBuilder};
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::timeout;

use crate::host::Hosts;
use crate::options::Options;
use crate::service::Service;
use crate::{Error, Result};

/// How long requests that are under way at the end may take.
const GRACE: Duration = Duration::from_secs(5);

/// How long after a failed `accept` (no more file descriptors, for one) the next one waits.
const ACCEPT_PAUSE: Duration = Duration::from_millis(20);

/// A running store. Dropping it closes the listener and every connection; [`Server::stop`] lets requests end first.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    ending: Option<oneshot::Sender<()>>,
    accepting: JoinHandle<()>,
}

impl Server {
    /// Opens the folder and answers requests, on the current tokio runtime.
    ///
    /// # Errors
    /// [`Error::DataInUse`], [`Error::NotOurs`], [`Error::Newer`], [`Error::Listen`], [`Error::Webhook`],
    /// [`Error::File`] and [`Error::Storage`].
    pub async fn start(options: Options) -> Result<Self> {
        let failed = |source| Error::Listen { address: options.address.to_string(), source };
        let listener = TcpListener::bind(options.address).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let mut builder = S3ServiceBuilder::new(Service::new());
        builder.set_host(Hosts);
        builder.set_auth(SimpleAuth::from_single(options.root.access_key, options.root.secret_key));
        let (ending, end) = oneshot::channel();
        let accepting = tokio::spawn(accept(listener, builder.build(), end));
        Ok(Self { address, ending: Some(ending), accepting })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Takes no more requests, waits for those under way (up to 5 s), and closes the folder.
    pub async fn stop(mut self) {
        if let Some(ending) = self.ending.take() {
            let _ = ending.send(());
        }
        let _ = (&mut self.accepting).await;
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

async fn accept(listener: TcpListener, service: S3Service, mut end: oneshot::Receiver<()>) {
    let mut connections = JoinSet::new();
    let graceful = GracefulShutdown::new();
    loop {
        while connections.try_join_next().is_some() {}
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = &mut end => break,
        };
        let Ok((stream, _)) = accepted else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let _ = stream.set_nodelay(true);
        let connection = hyper::server::conn::http1::Builder::new()
            .timer(TokioTimer::new())
            .serve_connection(TokioIo::new(stream), service.clone());
        let connection = graceful.watch(connection);
        // A client that goes away in the middle is that client's end.
        connections.spawn(async move { drop(connection.await) });
    }
    drop(listener);
    let _ = timeout(GRACE, graceful.shutdown()).await;
}
