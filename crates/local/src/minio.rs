//! MinIO as a child process: an object store with S3's conditional writes and its event notifications.
//!
//! Knows how to start, wait for and stop it, and what to tell functions so that they reach it. Buckets and objects are
//! the S3 store's business (`rayfold_pipeline::store`), which speaks the same to MinIO and to AWS.
//!
//! Invariants: it listens on loopback alone; its credentials are random and stay with the data (`credentials.json`
//! beside it, readable by the owner); it ends with us, however we end; two processes never share a data folder.

mod install;

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::net::SocketAddr;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

pub use install::{SOURCE, minio as find_or_install};

use crate::guard::Guarded;
use crate::{Error, Result};

/// The region that MinIO says it is in.
pub const REGION: &str = "us-east-1";

/// The queue that bucket notifications name: MinIO's webhook to the invoker.
pub const QUEUE_ARN: &str = "arn:minio:sqs:us-east-1:RAYFOLD:webhook";

/// Long enough for a loaded machine, short enough to fail a test by itself.
const START_TIMEOUT: Duration = Duration::from_secs(60);

/// An access key and its secret.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Credentials {
    /// The access key's id.
    pub access_key: String,
    /// The secret.
    pub secret_key: String,
}

impl Credentials {
    /// Fresh ones, from the system's randomness.
    ///
    /// # Errors
    /// [`Error::Random`].
    pub fn random() -> Result<Self> {
        Ok(Self { access_key: format!("rayfold{}", token(6)?), secret_key: token(20)? })
    }

    /// Those of an earlier run beside `data`, or fresh ones, kept there.
    fn kept(data: &Path) -> Result<Self> {
        let path = data.join("credentials.json");
        if let Ok(text) = fs::read(&path)
            && let Ok(kept) = serde_json::from_slice(&text)
        {
            return Ok(kept);
        }
        let fresh = Self::random()?;
        let mut file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&path)
            .map_err(Error::file(&path))?;
        serde_json::to_writer(&mut file, &fresh)
            .map_err(std::io::Error::from)
            .and_then(|()| file.flush())
            .map_err(Error::file(&path))?;
        Ok(fresh)
    }
}

/// `bytes` random bytes in hexadecimal.
///
/// # Errors
/// [`Error::Random`].
pub(crate) fn token(bytes: usize) -> Result<String> {
    let mut random = vec![0; bytes];
    getrandom::fill(&mut random).map_err(Error::Random)?;
    Ok(random.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Where bucket events go.
#[derive(Clone, Debug)]
pub struct Webhook {
    /// Of the listener.
    pub url: String,
    /// Sent with each event, so that the listener knows MinIO.
    pub token: String,
}

/// A running MinIO; dropping it stops it.
#[derive(Debug)]
pub struct Minio {
    process: Guarded,
    address: SocketAddr,
    data: PathBuf,
    credentials: Credentials,
    _lock: File,
}

impl Minio {
    /// Starts `binary` on the folder `data` (made when missing) and waits until it answers.
    ///
    /// # Errors
    /// [`Error::DataInUse`], [`Error::MinioStart`] with the log's place, [`Error::File`].
    pub async fn start(
        binary: &Path,
        data: &Path,
        address: SocketAddr,
        webhook: Option<&Webhook>,
    ) -> Result<Self> {
        let objects = data.join("objects");
        fs::create_dir_all(&objects).map_err(Error::file(&objects))?;
        let lock_path = data.join("lock");
        let lock = File::create(&lock_path).map_err(Error::file(&lock_path))?;
        lock.try_lock().map_err(|_| Error::DataInUse(data.to_owned()))?;
        let credentials = Credentials::kept(data)?;
        let log = data.join("minio.log");
        let mut address = address;
        let start = Instant::now();
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
                environment(&credentials, webhook),
                &log,
            )?;
            match wait_until_healthy(&process, address, start).await {
                Ok(()) => {
                    return Ok(Self { process, address, data: data.to_owned(), credentials, _lock: lock });
                }
                Err(reason) if start.elapsed() >= START_TIMEOUT => {
                    return Err(Error::MinioStart { reason, log });
                }
                Err(reason) if fs::read_to_string(&log).is_ok_and(|text| text.contains("in use")) => {
                    // Someone took the free port in between.
                    fs::write(&log, reason).map_err(Error::file(&log))?;
                    address.set_port(0);
                }
                Err(reason) => return Err(Error::MinioStart { reason, log }),
            }
        }
    }

    /// Of the S3 endpoint.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The S3 endpoint.
    pub fn endpoint(&self) -> String {
        format!("http://{}", self.address)
    }

    /// The folder with everything of it.
    pub fn data(&self) -> &Path {
        &self.data
    }

    /// Of the owner.
    pub fn credentials(&self) -> &Credentials {
        &self.credentials
    }

    /// MinIO's own process id.
    pub fn pid(&self) -> u32 {
        self.process.pid()
    }

    /// Returns when it has ended, and how.
    pub async fn ended(&self) -> std::process::ExitStatus {
        loop {
            match self.process.exited() {
                Some(status) => return status,
                None => tokio::time::sleep(Duration::from_millis(200)).await,
            }
        }
    }

    /// What the standard AWS environment has to say so that S3 is this one.
    pub fn environment(&self) -> Vec<(String, String)> {
        [
            ("AWS_ENDPOINT_URL", self.endpoint().as_str()),
            ("AWS_REGION", REGION),
            ("AWS_ACCESS_KEY_ID", &self.credentials.access_key),
            ("AWS_SECRET_ACCESS_KEY", &self.credentials.secret_key),
        ]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .to_vec()
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

/// A port that nobody listens on, of the given address.
async fn free(mut address: SocketAddr) -> Result<SocketAddr> {
    address.set_port(0);
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

/// Where to listen when it does not matter.
pub fn any_port() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn started(data: &Path) -> Result<Minio> {
        let binary = find_or_install(&mut |line| eprintln!("{line}"))?;
        Minio::start(&binary, data, any_port(), None).await
    }

    #[tokio::test]
    async fn it_starts_keeps_its_credentials_and_is_gone_afterwards() {
        let data = tempfile::tempdir().unwrap();
        let minio = started(data.path()).await.unwrap();
        let (address, credentials) = (minio.address(), minio.credentials().clone());
        assert!(is_healthy(address).await);
        assert!(matches!(started(data.path()).await, Err(Error::DataInUse(_))));
        drop(minio);
        assert!(!is_healthy(address).await);
        assert_eq!(*started(data.path()).await.unwrap().credentials(), credentials);
    }

    #[tokio::test]
    async fn a_program_that_is_no_minio_is_told_with_its_log() {
        let data = tempfile::tempdir().unwrap();
        let error = Minio::start(Path::new("/bin/false"), data.path(), any_port(), None).await.unwrap_err();
        assert!(error.to_string().contains("minio.log"), "{error}");
    }
}
