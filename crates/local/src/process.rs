//! An S3 server as a child process.
//!
//! Starts the server, waits for it and stops it. Invariants: the server listens on loopback only, and it ends with this
//! process, in every case.

use std::fs::{self, File};
use std::net::SocketAddr;
use std::path::Path;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use rayfold_pipeline::store::{S3Store, Store};

use crate::credentials::Credentials;
use crate::error::{Error, Result};
use crate::guard::Guarded;
use crate::program::Program;

/// The time limit of a start: long enough for a loaded machine, short enough to fail a test by itself.
const START_TIMEOUT: Duration = Duration::from_secs(120);

/// The server to start.
pub(crate) struct Command<'a> {
    pub(crate) program: &'static Program,
    pub(crate) binary: &'a Path,
    pub(crate) environment: Vec<(String, String)>,
    /// The file to which its output is appended.
    pub(crate) log: &'a Path,
    /// A path that returns 200 when the server is ready.
    pub(crate) ready: &'a str,
    /// The keys that it knows.
    pub(crate) credentials: &'a Credentials,
    /// A file that is locked until the server has ended.
    pub(crate) lock: &'a File,
}

/// A running server; dropping it stops it.
#[derive(Debug)]
pub(crate) struct ServerProcess {
    process: Guarded,
    address: SocketAddr,
}

impl ServerProcess {
    /// Starts the server with the arguments for the address of its S3 endpoint, and waits until it answers.
    ///
    /// # Errors
    /// [`Error::Listen`] for a port that is taken, [`Error::ServerStart`] with the path of the log, [`Error::File`].
    pub(crate) async fn start(
        command: Command<'_>,
        mut address: SocketAddr,
        arguments: impl Fn(SocketAddr) -> Result<Vec<String>>,
    ) -> Result<Self> {
        let Command { program, binary, environment, log, ready, credentials, lock } = command;
        let start = Instant::now();
        let may_choose = address.port() == 0;
        if !may_choose {
            // Another program may listen there, and only the port that was asked for will do.
            free(address)?;
        }
        loop {
            if address.port() == 0 {
                address = free(address)?;
            }
            let process = Guarded::spawn(binary, &arguments(address)?, environment.clone(), log, lock)?;
            match wait_until_ready(&process, address, ready, credentials, start).await {
                Ok(()) => return Ok(Self { process, address }),
                Err(reason) if start.elapsed() >= START_TIMEOUT => {
                    return Err(Error::ServerStart { program, reason, log: log.to_owned() });
                }
                Err(reason)
                    if may_choose && fs::read_to_string(log).is_ok_and(|text| text.contains("in use")) =>
                {
                    // Another process took the free port in the meantime.
                    fs::write(log, reason).map_err(Error::file(log))?;
                    address.set_port(0);
                }
                Err(reason) => return Err(Error::ServerStart { program, reason, log: log.to_owned() }),
            }
        }
    }

    /// Returns the address of the S3 endpoint.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the process id.
    pub(crate) fn pid(&self) -> u32 {
        self.process.pid()
    }

    /// Waits for the end of the process, and returns its exit status.
    pub(crate) async fn ended(&self) -> ExitStatus {
        loop {
            match self.process.exited() {
                Some(status) => return status,
                None => tokio::time::sleep(Duration::from_millis(200)).await,
            }
        }
    }
}

/// Returns the address if it is free; with port 0, one with a free port.
fn free(address: SocketAddr) -> Result<SocketAddr> {
    let failed = |source| Error::Listen { address: address.to_string(), source };
    std::net::TcpListener::bind(address).and_then(|listener| listener.local_addr()).map_err(failed)
}

async fn wait_until_ready(
    process: &Guarded,
    address: SocketAddr,
    path: &str,
    credentials: &Credentials,
    start: Instant,
) -> Result<(), String> {
    loop {
        if let Some(status) = process.exited() {
            return Err(format!("it ended ({status})"));
        }
        if start.elapsed() >= START_TIMEOUT {
            return Err(format!("no answer on {address} within {} s", START_TIMEOUT.as_secs()));
        }
        if is_ready(address, path).await && knows(address, credentials).await {
            return Ok(());
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

async fn is_ready(address: SocketAddr, path: &str) -> bool {
    let ask = async {
        let mut stream = TcpStream::connect(address).await?;
        let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
        stream.write_all(request.as_bytes()).await?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await?;
        std::io::Result::Ok(answer.starts_with("HTTP/1.1 200"))
    };
    matches!(tokio::time::timeout(Duration::from_secs(2), ask).await, Ok(Ok(true)))
}

/// Returns whether the server at the address accepts the keys. If another server took the port before ours listened,
/// ours ends.
async fn knows(address: SocketAddr, credentials: &Credentials) -> bool {
    match S3Store::at(&credentials.connection(address), "rayfold").get("ready").await {
        Err(rayfold_pipeline::Error::Refused { source, .. }) => {
            let code = source.to_string();
            !(code.starts_with("InvalidAccessKeyId") || code.starts_with("SignatureDoesNotMatch"))
        }
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::any_port;
    use crate::program::SEAWEEDFS;
    use crate::{S3Server, StoreKind};

    async fn started(folder: &Path, address: SocketAddr) -> Result<ServerProcess> {
        let log = folder.join("server.log");
        let (binary, lock) = (Path::new("/bin/false"), tempfile::tempfile().unwrap());
        let command = Command {
            program: &SEAWEEDFS,
            binary,
            environment: Vec::new(),
            log: &log,
            ready: "/healthz",
            credentials: &Credentials::kept(folder).unwrap(),
            lock: &lock,
        };
        ServerProcess::start(command, address, |_| Ok(Vec::new())).await
    }

    #[tokio::test]
    async fn a_program_that_does_not_start_is_named_with_its_log() {
        let folder = tempfile::tempdir().unwrap();
        let error = started(folder.path(), any_port()).await.unwrap_err().to_string();
        assert!(error.contains("SeaweedFS") && error.contains("server.log"), "{error}");
    }

    /// An earlier version used another port without a message.
    #[tokio::test]
    async fn a_port_that_was_asked_for_and_is_taken_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let taken = tokio::net::TcpListener::bind(any_port()).await.unwrap();
        let address = taken.local_addr().unwrap();
        let error = started(folder.path(), address).await.unwrap_err();
        assert!(
            matches!(&error, Error::Listen { address: named, .. } if *named == address.to_string()),
            "{error}"
        );
    }

    /// Two servers that were started at once got the same port: the client of the second was refused by the first.
    #[tokio::test]
    async fn a_server_with_other_keys_is_not_the_one_that_was_started() {
        let (ours, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let server =
            S3Server::start(StoreKind::BuiltIn, ours.path(), any_port(), None, &mut |_| {}).await.unwrap();
        assert!(knows(server.address(), server.credentials()).await);
        assert!(!knows(server.address(), &Credentials::kept(other.path()).unwrap()).await);
        let mut forged = server.credentials().clone();
        forged.secret_key.push('x');
        assert!(!knows(server.address(), &forged).await);
    }
}
