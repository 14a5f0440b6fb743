//! SeaweedFS: an object store with S3's conditional writes, and without notifications that S3's clients can set.
//!
//! Master, volume server, filer and S3 gateway run in one process, each with two ports on loopback.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::net::SocketAddr;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use serde_json::json;

use crate::credentials::Credentials;
use crate::error::{Error, Result};
use crate::process::{Command, ServerProcess};
use crate::program::SEAWEEDFS;

/// The name of SeaweedFS's file of identities, in the data folder.
pub(crate) const CONFIG: &str = "seaweedfs.json";

/// The services whose ports only the process itself uses.
const INNER_PORTS: [&str; 7] = [
    "master.port",
    "master.port.grpc",
    "volume.port",
    "volume.port.grpc",
    "filer.port",
    "filer.port.grpc",
    "s3.port.grpc",
];

/// Starts `binary` on the folder `objects` within the data folder.
///
/// # Errors
/// The errors of [`ServerProcess::start`].
pub(crate) async fn start(
    binary: &Path,
    objects: &Path,
    log: &Path,
    address: SocketAddr,
    credentials: &Credentials,
    lock: &File,
) -> Result<ServerProcess> {
    let config = objects.with_file_name(CONFIG);
    write_identity(&config, credentials).map_err(Error::file(&config))?;
    let environment = Vec::new();
    let command =
        Command { program: &SEAWEEDFS, binary, environment, log, ready: "/healthz", credentials, lock };
    ServerProcess::start(command, address, |address| arguments(address, objects, &config)).await
}

fn write_identity(path: &Path, credentials: &Credentials) -> std::io::Result<()> {
    let keys = json!({ "accessKey": credentials.access_key, "secretKey": credentials.secret_key });
    let identity = json!({ "name": "rayfold", "credentials": [keys], "actions": ["Admin"] });
    let mut file = OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(path)?;
    file.write_all(json!({ "identities": [identity] }).to_string().as_bytes())
}

fn arguments(address: SocketAddr, objects: &Path, config: &Path) -> Result<Vec<String>> {
    let ip = address.ip();
    let mut arguments = vec![
        // The output of glog goes to the log alone.
        "-logtostderr=true".to_owned(),
        "server".to_owned(),
        "-filer".to_owned(),
        "-s3".to_owned(),
        format!("-ip={ip}"),
        format!("-ip.bind={ip}"),
        format!("-dir={}", objects.display()),
        format!("-s3.port={}", address.port()),
        format!("-s3.config={}", config.display()),
        // Catalogues for other protocols, on ports of their own.
        "-s3.port.iceberg=0".to_owned(),
        "-s3.port.lance=0".to_owned(),
        // Otherwise a put makes the bucket that a user has misspelled.
        "-s3.autoCreateBucket=false".to_owned(),
        "-master.telemetry=false".to_owned(),
        // Each bucket takes volumes of its own, several at once.
        "-volume.max=1000".to_owned(),
        "-master.volumeSizeLimitMB=1024".to_owned(),
        "-volume.preStopSeconds=0".to_owned(),
        format!("-filer.localSocket={}", objects.join("filer.sock").display()),
        format!("-s3.localSocket={}", objects.join("s3.sock").display()),
    ];
    // All at once, so that no two are the same.
    let mut taken = Vec::new();
    for flag in INNER_PORTS {
        let listener = std::net::TcpListener::bind((ip, 0))
            .map_err(|source| Error::Listen { address: ip.to_string(), source })?;
        let port =
            listener.local_addr().map_err(|source| Error::Listen { address: ip.to_string(), source })?;
        arguments.push(format!("-{flag}={}", port.port()));
        taken.push(listener);
    }
    Ok(arguments)
}
