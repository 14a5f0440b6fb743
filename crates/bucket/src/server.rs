//! The listener: accepts connections, passes requests to the service, and shuts down in order.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use s3s::service::{S3Service, S3ServiceBuilder};
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::timeout;

use crate::connection_service::{ConnectionService, Rules};
use crate::delivery::Delivery;
use crate::expiry::{INTERVAL, expire_uploads};
use crate::host::Hosts;
use crate::identity::{Access, AssumeRole, Identities, Sessions};
use crate::limits::Limits;
use crate::options::Options;
use crate::records::Moment;
use crate::service::Service;
use crate::storage::{Storage, Writing};
use crate::{Error, Result};

/// The time that running requests get at the end.
const GRACE: Duration = Duration::from_secs(5);

/// The pause after a failed `accept`, for example for lack of file descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(20);

/// A running store. Dropping it closes the listener and every connection. [`Server::stop`] lets
/// running requests end first.
pub struct Server {
    address: SocketAddr,
    ending: Option<oneshot::Sender<()>>,
    accepting: JoinHandle<()>,
    delivering: Option<JoinHandle<()>>,
    expiring: JoinHandle<()>,
    writing: Option<Writing>,
}

impl Server {
    /// Opens the folder and serves requests on the current tokio runtime.
    ///
    /// # Errors
    /// [`Error::DataInUse`], [`Error::NotOurs`], [`Error::Newer`], [`Error::Listen`], [`Error::Webhook`],
    /// [`Error::File`], [`Error::Damaged`] and [`Error::Storage`].
    pub async fn start(options: Options) -> Result<Self> {
        let failed = |source| Error::Listen { address: options.address.to_string(), source };
        let listener = TcpListener::bind(options.address).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let data = options.data;
        let opened = tokio::task::spawn_blocking(move || Storage::open(&data)).await;
        let (storage, writing) = opened.map_err(|panicked| Error::Start(panicked.to_string()))??;
        let delivery = options.webhook.as_ref();
        let delivery = delivery.map(|webhook| Delivery::new(storage.clone(), &options.region, webhook));
        let delivering = delivery.transpose()?.map(|delivery| tokio::spawn(delivery.run()));
        let collected = storage.clone();
        // Files that a killed run left behind use disk space, but block no request.
        tokio::task::spawn_blocking(move || drop(collected.collect_orphans()));
        let expiring = tokio::spawn(expire(storage.clone()));
        let sessions = Sessions::open(storage.clone(), SystemTime::now());
        let identities =
            Identities::new(options.root, sessions.map_err(|why| Error::Start(why.to_string()))?);
        let store = Service::new(storage, &options.region);
        let mut builder = S3ServiceBuilder::new(store.clone());
        let rules: Rules = Arc::new(move |name: &str| store.cors_rules(name));
        builder.set_config(Arc::new(Limits::new()));
        builder.set_host(Hosts);
        builder.set_auth(identities.clone());
        builder.set_access(Access(identities.clone()));
        builder.set_route(AssumeRole(identities));
        let (ending, end) = oneshot::channel();
        let accepting = tokio::spawn(accept(listener, (builder.build(), rules), end));
        Ok(Self { address, ending: Some(ending), accepting, delivering, expiring, writing: Some(writing) })
    }

    /// Returns the address on which the server listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Accepts no more requests, waits for the running ones (up to 5 s), and closes the folder.
    pub async fn stop(mut self) {
        if let Some(ending) = self.ending.take() {
            let _ = ending.send(());
        }
        let _ = (&mut self.accepting).await;
        if let Some(delivering) = self.delivering.take() {
            delivering.abort();
        }
        self.expiring.abort();
        if let Some(writing) = self.writing.take() {
            let _ = tokio::task::spawn_blocking(|| writing.end()).await;
        }
    }
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server").field("address", &self.address).finish_non_exhaustive()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.accepting.abort();
        self.expiring.abort();
        if let Some(delivering) = &self.delivering {
            delivering.abort();
        }
    }
}

/// Removes expired uploads until it is aborted.
async fn expire(storage: Storage) {
    loop {
        // If the removal fails, it is repeated an hour later.
        let _ = expire_uploads(&storage, Moment::now()).await;
        tokio::time::sleep(INTERVAL).await;
    }
}

async fn accept(listener: TcpListener, (service, rules): (S3Service, Rules), mut end: oneshot::Receiver<()>) {
    let mut connections = JoinSet::new();
    let graceful = GracefulShutdown::new();
    loop {
        while connections.try_join_next().is_some() {}
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = &mut end => break,
        };
        let Ok((stream, peer)) = accepted else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let _ = stream.set_nodelay(true);
        let connection_service =
            ConnectionService { service: service.clone(), rules: rules.clone(), peer: peer.ip() };
        let connection = hyper::server::conn::http1::Builder::new()
            .timer(TokioTimer::new())
            .serve_connection(TokioIo::new(stream), connection_service);
        let connection = graceful.watch(connection);
        // A client that disconnects early ends only its own connection.
        connections.spawn(async move { drop(connection.await) });
    }
    drop(listener);
    let _ = timeout(GRACE, graceful.shutdown()).await;
}
