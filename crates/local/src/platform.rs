//! Everything that Terraform sets up on AWS, on one machine: bucket, notifications, functions, schedule.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rayfold_bucket::Webhook;
use rayfold_pipeline::store::{Notification, S3Store};
use tokio::net::TcpListener;
use tokio::sync::mpsc::UnboundedSender;

use crate::credentials::token;
use crate::error::{Error, Result};
use crate::functions::Functions;
use crate::http::{any_port, listen};
use crate::invoker::{Invoker, Settings};
use crate::observation::Observation;
use crate::routes::Routes;
use crate::s3_server::{S3Server, StoreKind};

/// How long MinIO may take to know its webhook.
const QUEUE_TIMEOUT: Duration = Duration::from_secs(20);

/// The store built in connects to the webhook when it starts: what it has kept comes as soon as the invoker listens.
const KEPT_AT_START: Duration = Duration::from_millis(20);

/// It tries again after at most a second, when nobody has listened for a while.
const KEPT_AFTER_A_PAUSE: Duration = Duration::from_millis(1200);

/// What a platform is made of.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Which S3 server holds the bucket.
    pub store: StoreKind,
    /// Where it keeps its objects.
    pub data: PathBuf,
    /// Where S3 is to listen; port 0 stands for any.
    pub address: SocketAddr,
    /// The bucket's name.
    pub bucket: String,
    /// The function binaries.
    pub functions: Functions,
}

/// An S3 server with a bucket whose events reach an invoker.
pub struct Platform {
    invoker: Option<Invoker>,
    /// Until the first invoker takes it, so that nobody else gets the port that the server was told.
    listener: Option<TcpListener>,
    server: S3Server,
    store: S3Store,
    settings: Settings,
}

impl Platform {
    /// Starts the S3 server and sets the bucket up; the invoker is started apart.
    ///
    /// `change` may alter the invoker's settings; `say` hears what takes time.
    ///
    /// # Errors
    /// Whatever keeps the server from starting or the bucket from being set up.
    pub async fn start(
        plan: &Plan,
        change: impl FnOnce(&mut Settings),
        say: &mut (dyn FnMut(&str) + Send),
    ) -> Result<Self> {
        plan.functions.check()?;
        let (listener, webhook) = listen(any_port()).await?;
        let secret = token(16)?;
        let hook = Webhook { url: format!("http://{webhook}/events"), token: secret.clone() };
        let server = S3Server::start(plan.store, &plan.data, plan.address, Some(hook), say).await?;
        let store = S3Store::at(&server.connection(), &plan.bucket);
        let failed = |source| Error::Bucket { bucket: plan.bucket.clone(), source };
        store.create_bucket().await.map_err(failed)?;
        let notifications = Routes::shared().notifications(server.queue_arn());
        notify(&store, &notifications).await.map_err(failed)?;
        let mut settings = Settings::new(plan.functions.clone(), server.address(), webhook, secret);
        settings.environment = server.environment();
        settings.environment.push(("RAYFOLD_BUCKET".into(), plan.bucket.clone()));
        change(&mut settings);
        Ok(Self { invoker: None, listener: Some(listener), server, store, settings })
    }

    /// Starts the invoker, which sweeps up what happened while there was none.
    ///
    /// # Errors
    /// As [`Invoker::start`].
    pub async fn start_invoker(
        &mut self,
        observer: Option<UnboundedSender<Observation>>,
    ) -> Result<&Invoker> {
        self.stop_invoker().await;
        let (listener, soon) = match self.listener.take() {
            Some(listener) => (listener, KEPT_AT_START),
            None => (self.listen_again().await?, KEPT_AFTER_A_PAUSE),
        };
        self.settings.kept_events = match self.server.kind() {
            StoreKind::BuiltIn => Some(soon),
            StoreKind::Minio => None,
        };
        let invoker = Invoker::start_on(listener, self.settings.clone(), observer)?;
        Ok(self.invoker.insert(invoker))
    }

    /// On the same port, which an outgoing connection of anybody may have for a moment.
    async fn listen_again(&self) -> Result<TcpListener> {
        let start = Instant::now();
        loop {
            match listen(self.settings.webhook).await {
                Ok((listener, _)) => return Ok(listener),
                Err(error) if start.elapsed() > QUEUE_TIMEOUT => return Err(error),
                Err(_) => tokio::time::sleep(Duration::from_millis(50)).await,
            }
        }
    }

    /// Stops the invoker and its processes; the S3 server goes on.
    pub async fn stop_invoker(&mut self) {
        if let Some(invoker) = self.invoker.take() {
            invoker.stop().await;
        }
    }

    /// The invoker, while there is one.
    pub fn invoker(&self) -> Option<&Invoker> {
        self.invoker.as_ref()
    }

    /// The settings of the next invoker.
    pub fn settings_mut(&mut self) -> &mut Settings {
        &mut self.settings
    }

    /// The bucket, with its owner's credentials.
    pub fn store(&self) -> &S3Store {
        &self.store
    }

    /// The S3 server.
    pub fn server(&self) -> &S3Server {
        &self.server
    }

    /// Stops everything, and returns when the data may be used again.
    pub async fn stop(mut self) {
        self.stop_invoker().await;
        self.server.stop().await;
    }
}

/// Has a bucket's changes told. MinIO says that it is ready some moments before it knows its webhooks, and refuses their queues
/// until then: that is waited for.
///
/// # Errors
/// The store's.
pub async fn notify(store: &S3Store, notifications: &[Notification]) -> rayfold_pipeline::Result<()> {
    let start = Instant::now();
    loop {
        match store.notify(notifications).await {
            Err(rayfold_pipeline::Error::Refused { source, .. })
                if source.to_string().contains("ARN") && start.elapsed() < QUEUE_TIMEOUT =>
            {
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
            answer => return answer,
        }
    }
}

impl Plan {
    /// A bucket named `rayfold` with its data in `data`.
    pub fn new(store: StoreKind, data: &Path, functions: Functions) -> Self {
        Self { store, data: data.to_owned(), address: any_port(), bucket: "rayfold".into(), functions }
    }
}
