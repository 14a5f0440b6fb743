//! Everything that Terraform sets up on AWS, on one machine: bucket, notifications, functions, schedule.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use rayfold_pipeline::store::{Connection, Notification, S3Store};
use tokio::sync::mpsc::UnboundedSender;

use crate::functions::Functions;
use crate::http::listen;
use crate::invoker::{Invoker, Settings};
use crate::minio::{Minio, QUEUE_ARN, REGION, Webhook, any_port, find_or_install, token};
use crate::observation::Observation;
use crate::routes::Routes;
use crate::{Error, Result};

/// What a platform is made of.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Where MinIO keeps its objects.
    pub data: PathBuf,
    /// Where S3 is to listen; port 0 stands for any.
    pub address: SocketAddr,
    /// The bucket's name.
    pub bucket: String,
    /// The function binaries.
    pub functions: Functions,
}

/// MinIO with a bucket whose events reach an invoker.
pub struct Platform {
    invoker: Option<Invoker>,
    minio: Minio,
    store: S3Store,
    settings: Settings,
}

impl Platform {
    /// Starts MinIO (found, or installed from source) and sets the bucket up; the invoker is started apart.
    ///
    /// `change` may alter the invoker's settings; `say` hears what takes time.
    ///
    /// # Errors
    /// Whatever keeps MinIO from starting or the bucket from being set up.
    pub async fn start(
        plan: &Plan,
        change: impl FnOnce(&mut Settings),
        say: &mut (dyn FnMut(&str) + Send),
    ) -> Result<Self> {
        plan.functions.check()?;
        let binary = find_or_install(say)?;
        // The port is kept for the invoker, which may come and go while MinIO runs.
        let (listener, webhook) = listen(any_port()).await?;
        drop(listener);
        let secret = token(16)?;
        let hook = Webhook { url: format!("http://{webhook}/events"), token: secret.clone() };
        let minio = Minio::start(&binary, &plan.data, plan.address, Some(&hook)).await?;
        let store = S3Store::at(&connection(&minio), &plan.bucket);
        let failed = |source| Error::Bucket { bucket: plan.bucket.clone(), source };
        store.create_bucket().await.map_err(failed)?;
        let notifications: Vec<Notification> = Routes::shared()
            .iter()
            .map(|route| Notification {
                prefix: route.prefix.clone(),
                events: route.events.clone(),
                queue_arn: QUEUE_ARN.to_owned(),
            })
            .collect();
        store.notify(&notifications).await.map_err(failed)?;
        let mut settings = Settings::new(plan.functions.clone(), minio.address(), webhook, secret);
        settings.environment = minio.environment();
        settings.environment.push(("RAYFOLD_BUCKET".into(), plan.bucket.clone()));
        change(&mut settings);
        Ok(Self { invoker: None, minio, store, settings })
    }

    /// Starts the invoker, which sweeps up what happened while there was none.
    ///
    /// # Errors
    /// As [`Invoker::start`].
    pub async fn start_invoker(
        &mut self,
        observer: Option<UnboundedSender<Observation>>,
    ) -> Result<&Invoker> {
        self.invoker = None;
        let invoker = Invoker::start(self.settings.clone(), observer).await?;
        Ok(self.invoker.insert(invoker))
    }

    /// Stops the invoker and its processes; MinIO goes on.
    pub fn stop_invoker(&mut self) {
        self.invoker = None;
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
    pub fn minio(&self) -> &Minio {
        &self.minio
    }
}

/// How to reach MinIO as its owner.
pub fn connection(minio: &Minio) -> Connection {
    Connection {
        endpoint: minio.endpoint(),
        region: REGION.to_owned(),
        access_key: minio.credentials().access_key.clone(),
        secret_key: minio.credentials().secret_key.clone(),
    }
}

impl Plan {
    /// A bucket named `rayfold` with its data in `data`.
    pub fn new(data: &Path, functions: Functions) -> Self {
        Self { data: data.to_owned(), address: any_port(), bucket: "rayfold".into(), functions }
    }
}
