//! The S3 server that holds the bucket: the built-in store in this process, or MinIO or SeaweedFS as a child process.
//!
//! A folder can hold the data of all three servers, each in its own subfolder. They share the owner's credentials, so
//! variables that a terminal has exported stay valid. This module does not access buckets or objects: the S3 store does
//! (`rayfold_pipeline::store`), in the same way for all servers and for AWS.
//!
//! Invariants: the server ends with this process, however that ends. Two processes never share a data folder. A folder
//! that MinIO itself uses for its data is refused and not changed.

use std::fmt;
use std::fs::{self, File};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rayfold_bucket::{Options, Webhook, private};
use rayfold_pipeline::store::Connection;

use crate::credentials::Credentials;
use crate::error::{Error, Result};
use crate::process::ServerProcess;
use crate::program::{MINIO, Program, SEAWEEDFS};
use crate::region::REGION;
use crate::{minio, seaweedfs};

/// The folder at the top of MinIO's data.
const MINIO_MARK: &str = ".minio.sys";

/// The time between two attempts to lock a data folder.
const LOOK: Duration = Duration::from_millis(50);

/// The time after which a server that does not stop is killed: five seconds.
const ATTEMPTS: u32 = 140;

/// The names of everything that may be in a data folder.
const OURS: [&str; 8] = [
    "lock",
    "credentials.json",
    "minio.log",
    "bucket",
    "objects",
    "seaweedfs",
    "seaweedfs.log",
    seaweedfs::CONFIG,
];

/// The kind of S3 server.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum StoreKind {
    /// The built-in store, which needs no installation.
    #[default]
    BuiltIn,
    /// MinIO, which must be installed, or built from its source.
    Minio,
    /// SeaweedFS, which sends no events: the invoker lists the bucket.
    SeaweedFs,
}

impl StoreKind {
    /// All kinds, the built-in store first.
    pub const ALL: [Self; 3] = [Self::BuiltIn, Self::Minio, Self::SeaweedFs];

    /// Returns the name of the kind, as flags use it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::BuiltIn => "built-in",
            Self::Minio => "minio",
            Self::SeaweedFs => "seaweedfs",
        }
    }

    /// Returns the program that must be installed.
    pub fn program(self) -> Option<&'static Program> {
        match self {
            Self::BuiltIn => None,
            Self::Minio => Some(&MINIO),
            Self::SeaweedFs => Some(&SEAWEEDFS),
        }
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Returns the path of its objects in a data folder.
    pub fn objects(self, data: &Path) -> PathBuf {
        data.join(match self {
            Self::BuiltIn => "bucket",
            Self::Minio => "objects",
            Self::SeaweedFs => "seaweedfs",
        })
    }
}

impl fmt::Display for StoreKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.program().map_or("the built-in store", |program| program.name))
    }
}

/// A running server; dropping it stops it.
pub struct S3Server {
    kind: StoreKind,
    running: Running,
    data: PathBuf,
    credentials: Credentials,
    /// The lock of the data folder, held until the server has ended.
    _lock: File,
}

enum Running {
    BuiltIn(rayfold_bucket::Server),
    Beside(ServerProcess),
}

impl S3Server {
    /// Starts a server on the folder `data`, which is created if missing. The server is ready on return.
    ///
    /// MinIO and SeaweedFS are found, or installed from source; `say` gets a line before each step that takes time.
    ///
    /// # Errors
    /// [`Error::DataInUse`], [`Error::MinioFolder`], and any error that keeps the server from starting.
    pub async fn start(
        kind: StoreKind,
        data: &Path,
        address: SocketAddr,
        webhook: Option<Webhook>,
        say: &mut (dyn FnMut(&str) + Send),
    ) -> Result<Self> {
        if data.join(MINIO_MARK).exists() {
            return Err(Error::MinioFolder(data.to_owned()));
        }
        let objects = kind.objects(data);
        private::make(data).map_err(Error::file(data))?;
        private::make(&objects).map_err(Error::file(&objects))?;
        let lock_path = data.join("lock");
        let lock = File::create(&lock_path).map_err(Error::file(&lock_path))?;
        take(&lock, data, say).await?;
        if holds_nothing_else(data).map_err(Error::file(data))? {
            private::close(data);
        }
        // The store built in looks after its own.
        if objects.join(MINIO_MARK).exists() {
            private::close(&objects);
        }
        let credentials = Credentials::kept(data)?;
        let running = match kind {
            StoreKind::BuiltIn => {
                let root = rayfold_bucket::Credentials {
                    access_key: credentials.access_key.clone(),
                    secret_key: credentials.secret_key.clone(),
                };
                let options = Options { data: objects, address, root, region: REGION.into(), webhook };
                let server = rayfold_bucket::Server::start(options).await.map_err(|error| match error {
                    rayfold_bucket::Error::Damaged { .. } => Error::StoreDamaged(error),
                    other => Error::Store(other),
                })?;
                Running::BuiltIn(server)
            }
            StoreKind::Minio => {
                let binary = MINIO.find_or_install(say)?;
                let log = data.join("minio.log");
                let server =
                    minio::start(&binary, &objects, &log, address, &credentials, webhook.as_ref(), &lock);
                Running::Beside(server.await?)
            }
            StoreKind::SeaweedFs => {
                let binary = SEAWEEDFS.find_or_install(say)?;
                let log = data.join("seaweedfs.log");
                let server = seaweedfs::start(&binary, &objects, &log, address, &credentials, &lock);
                Running::Beside(server.await?)
            }
        };
        Ok(Self { kind, running, data: data.to_owned(), credentials, _lock: lock })
    }

    /// Returns the kind of server.
    pub fn kind(&self) -> StoreKind {
        self.kind
    }

    /// Returns the address of the S3 endpoint.
    pub fn address(&self) -> SocketAddr {
        match &self.running {
            Running::BuiltIn(server) => server.address(),
            Running::Beside(server) => server.address(),
        }
    }

    /// Returns the id of the server's process, if it is not this one.
    pub fn pid(&self) -> Option<u32> {
        match &self.running {
            Running::BuiltIn(_) => None,
            Running::Beside(server) => Some(server.pid()),
        }
    }

    /// Returns the URL of the S3 endpoint.
    pub fn endpoint(&self) -> String {
        format!("http://{}", self.address())
    }

    /// The folder with everything of it.
    pub fn data(&self) -> &Path {
        &self.data
    }

    /// Returns the owner's credentials.
    pub fn credentials(&self) -> &Credentials {
        &self.credentials
    }

    /// Returns the queue that bucket notifications must name to reach the webhook; `None` if the server has no
    /// notifications.
    pub fn queue_arn(&self) -> Option<&'static str> {
        match self.kind {
            StoreKind::BuiltIn => Some(rayfold_bucket::QUEUE_ARN),
            StoreKind::Minio => Some(minio::QUEUE_ARN),
            StoreKind::SeaweedFs => None,
        }
    }

    /// Returns when the server has ended by itself, with its exit status. The built-in store ends only with this
    /// process.
    pub async fn ended(&self) -> std::process::ExitStatus {
        match &self.running {
            Running::BuiltIn(_) => std::future::pending().await,
            Running::Beside(server) => server.ended().await,
        }
    }

    /// Stops the server. Returns when its data may be used again.
    pub async fn stop(self) {
        match self.running {
            Running::BuiltIn(server) => server.stop().await,
            Running::Beside(server) => drop(server),
        }
    }

    /// Returns the variables of the standard AWS environment that select this S3 server.
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

    /// Returns the owner's connection to it.
    pub fn connection(&self) -> Connection {
        self.credentials.connection(self.address())
    }
}

/// Locks the data folder. The server of a process that was killed holds it until it has stopped.
async fn take(lock: &File, data: &Path, say: &mut (dyn FnMut(&str) + Send)) -> Result<()> {
    for attempt in 0..ATTEMPTS {
        if lock.try_lock().is_ok() {
            return Ok(());
        }
        if attempt == 0 {
            say(&format!("waiting for the rayfold that uses {} to stop", data.display()));
        }
        tokio::time::sleep(LOOK).await;
    }
    Err(Error::DataInUse(data.to_owned()))
}

/// Returns whether everything in the folder is ours. If not, a user's folder keeps its access rights.
fn holds_nothing_else(data: &Path) -> std::io::Result<bool> {
    for entry in fs::read_dir(data)? {
        if !OURS.iter().any(|ours| entry.as_ref().is_ok_and(|entry| entry.file_name() == *ours)) {
            return Ok(false);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;
    use crate::http::any_port;

    async fn started(data: &Path) -> Result<S3Server> {
        S3Server::start(StoreKind::BuiltIn, data, any_port(), None, &mut |_| {}).await
    }

    async fn answers(address: SocketAddr) -> bool {
        tokio::net::TcpStream::connect(address).await.is_ok()
    }

    #[tokio::test]
    async fn it_starts_keeps_its_credentials_and_is_gone_afterwards() {
        let data = tempfile::tempdir().unwrap();
        let server = started(data.path()).await.unwrap();
        let (address, credentials) = (server.address(), server.credentials().clone());
        assert!(answers(address).await);
        assert!(matches!(started(data.path()).await, Err(Error::DataInUse(_))));
        server.stop().await;
        assert!(!answers(address).await);
        assert_eq!(*started(data.path()).await.unwrap().credentials(), credentials);
    }

    #[tokio::test]
    async fn a_damaged_store_says_what_to_do() {
        let data = tempfile::tempdir().unwrap();
        started(data.path()).await.unwrap().stop().await;
        let objects = StoreKind::BuiltIn.objects(data.path());
        fs::remove_file(objects.join("journal")).unwrap();
        let Err(error @ Error::StoreDamaged(_)) = started(data.path()).await else { panic!("it started") };
        let shown = error.to_string();
        let command = format!("`rayfold-bucket check --data {}`", objects.display());
        for part in
            ["it is missing beside a database or bodies", &command, "cargo install --path crates/bucket"]
        {
            assert!(shown.contains(part), "{shown}");
        }
    }

    #[tokio::test]
    async fn other_users_read_neither_scripts_nor_keys() {
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o777;
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        started(&data).await.unwrap().stop().await;
        let inner = StoreKind::BuiltIn.objects(&data);
        assert_eq!((mode(&data), mode(&inner)), (0o700, 0o700));
        for file in ["bucket/database", "bucket/journal", "credentials.json"] {
            assert_eq!(mode(&data.join(file)), 0o600, "{file}");
        }
        // As an earlier version made them.
        for folder in [&data, &inner] {
            fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
        }
        started(&data).await.unwrap().stop().await;
        assert_eq!((mode(&data), mode(&inner)), (0o700, 0o700));
        // A folder with something else in it is not ours alone.
        fs::set_permissions(&data, fs::Permissions::from_mode(0o755)).unwrap();
        fs::write(data.join("scene.txt"), "").unwrap();
        started(&data).await.unwrap().stop().await;
        assert_eq!((mode(&data), mode(&inner)), (0o755, 0o700));
    }

    #[tokio::test]
    async fn a_folder_of_a_minio_of_its_own_stays_as_it_is() {
        let data = tempfile::tempdir().unwrap();
        fs::create_dir(data.path().join(MINIO_MARK)).unwrap();
        let error = started(data.path()).await.err().unwrap();
        assert!(error.to_string().contains("MinIO"), "{error}");
        assert_eq!(fs::read_dir(data.path()).unwrap().count(), 1);
    }

    /// The data that `rayfold dev` kept in MinIO before there was another store.
    #[tokio::test]
    async fn the_data_of_minio_beside_it_stays_as_it_is() {
        let data = tempfile::tempdir().unwrap();
        let old = StoreKind::Minio.objects(data.path());
        fs::create_dir_all(old.join(MINIO_MARK)).unwrap();
        fs::write(old.join(MINIO_MARK).join("format.json"), "{}").unwrap();
        started(data.path()).await.unwrap().stop().await;
        assert_eq!(fs::read_dir(&old).unwrap().count(), 1);
        assert_eq!(fs::read_to_string(old.join(MINIO_MARK).join("format.json")).unwrap(), "{}");
    }
}
