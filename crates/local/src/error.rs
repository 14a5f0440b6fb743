//! What can go wrong around the functions; what goes wrong inside them is an outcome of theirs.

use std::io;
use std::path::PathBuf;

/// Why MinIO or the invoker could not be set up.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Neither MinIO nor what builds it is on this machine.
    #[error(
        "needs MinIO: put `minio` on the PATH, name it in RAYFOLD_MINIO, or install Go 1.25 or later ({0})"
    )]
    NoMinio(String),
    /// RAYFOLD_MINIO names nothing.
    #[error("RAYFOLD_MINIO names {0}, which is no file")]
    NamedMinioMissing(PathBuf),
    /// `go install` ran and failed.
    #[error("installing MinIO from source failed: {0}")]
    Install(String),
    /// MinIO ended or stayed unreachable while starting.
    #[error("MinIO did not start: {reason}; its log is {}", log.display())]
    MinioStart {
        /// What was seen.
        reason: String,
        /// Where MinIO wrote what it had to say.
        log: PathBuf,
    },
    /// Another process holds the folder.
    #[error("{} is in use by another rayfold", .0.display())]
    DataInUse(PathBuf),
    /// A file or folder could not be used.
    #[error("{}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A loopback port could not be had.
    #[error("cannot listen on {address}")]
    Listen {
        /// Where.
        address: String,
        /// Why.
        source: io::Error,
    },
    /// A function's binary is not where it is looked for.
    #[error("the function {} is missing: build it with `cargo build -p rayfold-lambda`", .0.display())]
    NoFunction(PathBuf),
    /// The function binaries could not be built.
    #[error("building the functions failed: {0}")]
    Build(String),
    /// A program could not be started.
    #[error("cannot start {}", program.display())]
    Spawn {
        /// Which.
        program: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The bucket could not be set up.
    #[error("cannot set up the bucket {bucket}")]
    Bucket {
        /// Its name.
        bucket: String,
        /// Why.
        source: rayfold_pipeline::Error,
    },
    /// The system gave no random bytes for the credentials.
    #[error("no random bytes from the system: {0}")]
    Random(getrandom::Error),
}

impl Error {
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}

/// The crate's results.
pub type Result<T, E = Error> = std::result::Result<T, E>;
