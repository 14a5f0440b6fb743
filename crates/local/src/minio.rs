//! MinIO as a child process: an object store with S3's conditional writes and its event notifications.
//!
//! Knows how to start, wait for and stop it. Invariants: it listens on loopback alone; it ends with us, however we end.

mod install;

use std::fs;
use std::net::SocketAddr;
use std::path::Path;
use std::time::{Duration, Instant};

use rayfold_bucket::Webhook;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

pub use install::{SOURCE, find, find_or_install};

use crate::credentials::Credentials;
use crate::error::{Error, Result};
use crate::guard::Guarded;
use crate::region::REGION;

/// The queue that bucket notifications name: MinIO's webhook to the invoker.
pub(crate) const QUEUE_ARN: &str = "arn:minio:sqs:us-east-1:RAYFOLD:webhook";

/// Long enough for a loaded machine, short enough to fail a test by itself.
const START_TIMEOUT: Duration = Duration::from_secs(60);

/// A running MinIO; dropping it stops it.
#[derive(Debug)]
pub(crate) struct Minio {
    process: Guarded,
    address: SocketAddr,
}

impl Minio {
    /// Starts `binary` on the folder `objects` and waits until it answers.
    ///
    /// # Errors
    /// [`Error::Listen`] for a port that is taken, [`Error::MinioStart`] with the log's place, [`Error::File`].
    pub(crate) async fn start(
        binary: &Path,
        objects: &Path,
        log: &Path,
        mut address: SocketAddr,
        credentials: &Credentials,
        webhook: Option<&Webhook>,
    ) -> Result<Self> {
        let start = Instant::now();
        let may_choose = address.port() == 0;
        if !may_choose {
            // Not whatever else answers there, and not another port than the one that was asked for.
            free(address).await?;
        }
        loop {
            if address.port() == 0 {
                address = free(address).await?;
            }
            let process = Guarded::spawn(
                binary,
                &[
                    "server".into(),
                    "--quiet".into(),
                    "--address".into(),
                    address.to_string(),
                    objects.to_string_lossy().into_owned(),
                ],
                environment(credentials, webhook),
                log,
            )?;
            match wait_until_healthy(&process, address, start).await {
                Ok(()) => return Ok(Self { process, address }),
                Err(reason) if start.elapsed() >= START_TIMEOUT => {
                    return Err(Error::MinioStart { reason, log: log.to_owned() });
                }
                Err(reason)
                    if may_choose && fs::read_to_string(log).is_ok_and(|text| text.contains("in use")) =>
                {
                    // Someone took the free port in between.
                    fs::write(log, reason).map_err(Error::file(log))?;
                    address.set_port(0);
                }
                Err(reason) => return Err(Error::MinioStart { reason, log: log.to_owned() }),
            }
        }
    }

    /// Of the S3 endpoint.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns when it has ended, and how.
    pub(crate) async fn ended(&self) -> std::process::ExitStatus {
        loop {
            match self.process.exited() {
                Some(status) => return status,
                None => tokio::time::sleep(Duration::from_millis(200)).await,
            }
        }
    }
}

fn environment(credentials: &Credentials, webhook: Option<&Webhook>) -> Vec<(String, String)> {
    let mut env = vec![
        ("MINIO_ROOT_USER".to_owned(), credentials.access_key.clone()),
        ("MINIO_ROOT_PASSWORD".to_owned(), credentials.secret_key.clone()),
        ("MINIO_REGION".to_owned(), REGION.to_owned()),
        ("MINIO_BROWSER".to_owned(), "off".to_owned()),
        ("MINIO_UPDATE".to_owned(), "off".to_owned()),
    ];
    if let Some(webhook) = webhook {
        // Without a queue folder: with one, events are delivered on a poll of three seconds.
        env.push(("MINIO_NOTIFY_WEBHOOK_ENABLE_RAYFOLD".to_owned(), "on".to_owned()));
        env.push(("MINIO_NOTIFY_WEBHOOK_ENDPOINT_RAYFOLD".to_owned(), webhook.url.clone()));
        env.push(("MINIO_NOTIFY_WEBHOOK_AUTH_TOKEN_RAYFOLD".to_owned(), webhook.token.clone()));
    }
    env
}

/// The address, if nobody listens there; with port 0 one with a port that nobody listens on.
async fn free(address: SocketAddr) -> Result<SocketAddr> {
    let listener = tokio::net::TcpListener::bind(address)
        .await
        .map_err(|source| Error::Listen { address: address.to_string(), source })?;
    listener.local_addr().map_err(|source| Error::Listen { address: address.to_string(), source })
}

async fn wait_until_healthy(process: &Guarded, address: SocketAddr, start: Instant) -> Result<(), String> {
    loop {
        if let Some(status) = process.exited() {
            return Err(format!("it ended ({status})"));
        }
        if start.elapsed() >= START_TIMEOUT {
            return Err(format!("no answer on {address} within {} s", START_TIMEOUT.as_secs()));
        }
        if is_healthy(address).await {
            return Ok(());
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

async fn is_healthy(address: SocketAddr) -> bool {
    let ask = async {
        let mut stream = TcpStream::connect(address).await?;
        stream
            .write_all(b"GET /minio/health/ready HTTP/1.1\r\nHost: minio\r\nConnection: close\r\n\r\n")
            .await?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await?;
        std::io::Result::Ok(answer.starts_with("HTTP/1.1 200"))
    };
    matches!(tokio::time::timeout(Duration::from_secs(2), ask).await, Ok(Ok(true)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::any_port;

    #[tokio::test]
    async fn a_program_that_is_no_minio_is_told_with_its_log() {
        let data = tempfile::tempdir().unwrap();
        let (log, credentials) = (data.path().join("minio.log"), Credentials::random().unwrap());
        let start = Minio::start(Path::new("/bin/false"), data.path(), &log, any_port(), &credentials, None);
        let error = start.await.unwrap_err();
        assert!(error.to_string().contains("minio.log"), "{error}");
    }

    /// Another port was taken without a word.
    #[tokio::test]
    async fn a_port_that_was_asked_for_and_is_taken_is_named() {
        let data = tempfile::tempdir().unwrap();
        let (log, credentials) = (data.path().join("minio.log"), Credentials::random().unwrap());
        let taken = tokio::net::TcpListener::bind(any_port()).await.unwrap();
        let address = taken.local_addr().unwrap();
        let start = Minio::start(Path::new("/bin/false"), data.path(), &log, address, &credentials, None);
        let error = start.await.unwrap_err();
        assert!(
            matches!(&error, Error::Listen { address: named, .. } if *named == address.to_string()),
            "{error}"
        );
    }
}
