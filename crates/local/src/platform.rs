//! The local counterpart of the Terraform stack: bucket, notifications, functions, schedule.

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
use crate::invoker::{Invoker, Listing, Settings};
use crate::observation::Observation;
use crate::routes::Routes;
use crate::s3_server::{S3Server, StoreKind};

/// The time limit for MinIO to know its webhook.
const QUEUE_TIMEOUT: Duration = Duration::from_secs(20);

/// The built-in store connects to the webhook at its start. It delivers kept events as soon as the invoker listens.
const KEPT_AT_START: Duration = Duration::from_millis(20);

/// If there was no listener for a while, the store retries after at most a second.
const KEPT_AFTER_A_PAUSE: Duration = Duration::from_millis(1200);

/// The parts of a platform.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The S3 server that holds the bucket.
    pub store: StoreKind,
    /// The folder of the bucket's objects.
    pub data: PathBuf,
    /// The address for S3; port 0 stands for any.
    pub address: SocketAddr,
    /// The name of the bucket.
    pub bucket: String,
    /// The paths of the function binaries.
    pub functions: Functions,
}

/// An S3 server with a bucket whose events reach an invoker.
pub struct Platform {
    invoker: Option<Invoker>,
    /// The listener until the first invoker takes it. It reserves the port that the server was configured with.
    listener: Option<TcpListener>,
    server: S3Server,
    store: S3Store,
    settings: Settings,
}

impl Platform {
    /// Starts the S3 server and sets up the bucket. The invoker is started separately.
    ///
    /// `change` may alter the invoker's settings. `say` gets a line before each step that takes time.
    ///
    /// # Errors
    /// Fails if the server cannot be started or the bucket cannot be set up.
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
        if let Some(queue) = server.queue_arn() {
            notify(&store, &Routes::shared().notifications(queue)).await.map_err(failed)?;
        }
        let mut settings = Settings::new(plan.functions.clone(), Some(server.address()), webhook, secret);
        if server.queue_arn().is_none() {
            // The name is fixed: the next invoker on this bucket takes the place of the one before.
            settings.listing = Some(Listing::new(store.clone(), "local"));
        }
        settings.environment = server.environment();
        settings.environment.push(("RAYFOLD_BUCKET".into(), plan.bucket.clone()));
        change(&mut settings);
        Ok(Self { invoker: None, listener: Some(listener), server, store, settings })
    }

    /// Starts the invoker, which sweeps to catch up on changes while there was none.
    ///
    /// # Errors
    /// The errors of [`Invoker::start`].
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
            StoreKind::Minio | StoreKind::SeaweedFs => None,
        };
        let invoker = Invoker::start_on(listener, self.settings.clone(), observer)?;
        Ok(self.invoker.insert(invoker))
    }

    /// Listens on the same port, which an outgoing connection of another program may use for a moment.
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

    /// Stops the invoker and its processes. The S3 server continues.
    pub async fn stop_invoker(&mut self) {
        if let Some(invoker) = self.invoker.take() {
            invoker.stop().await;
        }
    }

    /// Returns the invoker, if it is running.
    pub fn invoker(&self) -> Option<&Invoker> {
        self.invoker.as_ref()
    }

    /// Returns the settings of the next invoker.
    pub fn settings_mut(&mut self) -> &mut Settings {
        &mut self.settings
    }

    /// Returns the bucket, with its owner's credentials.
    pub fn store(&self) -> &S3Store {
        &self.store
    }

    /// Returns the S3 server.
    pub fn server(&self) -> &S3Server {
        &self.server
    }

    /// Stops everything. Returns when the data may be used again.
    pub async fn stop(mut self) {
        self.stop_invoker().await;
        self.server.stop().await;
    }
}

/// Configures the bucket's notifications. MinIO reports that it is ready some moments before it knows its webhooks, and
/// rejects their queues until then, so this waits.
///
/// # Errors
/// Fails if the store does.
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
    /// Returns the plan of a bucket named `rayfold` with its data in `data`.
    pub fn new(store: StoreKind, data: &Path, functions: Functions) -> Self {
        Self { store, data: data.to_owned(), address: any_port(), bucket: "rayfold".into(), functions }
    }
}
