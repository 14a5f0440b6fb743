//! What can go wrong around the functions; what goes wrong inside them is an outcome of theirs.

use std::io;
use std::path::PathBuf;

/// Why the bucket or the invoker could not be set up.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Neither MinIO nor what builds it is on this machine.
    #[error("there is no MinIO: put `minio` on the PATH, or name it in RAYFOLD_MINIO ({0})")]
    NoMinio(String),
    /// RAYFOLD_MINIO names nothing.
    #[error("RAYFOLD_MINIO names {0}, which is no file")]
    NamedMinioMissing(PathBuf),
    /// `go install` ran and failed.
    #[error(
        "MinIO could not be installed from source ({0}): put `minio` on the PATH, or name it in RAYFOLD_MINIO; its \
         project is archived, and module proxies have begun to refuse it"
    )]
    Install(String),
    /// The folder is MinIO's own.
    #[error(
        "{} is the data folder of a MinIO and stays as it is: choose another folder", .0.display()
    )]
    MinioFolder(PathBuf),
    /// The store built in did not start.
    #[error(transparent)]
    Store(rayfold_bucket::Error),
    /// Files of the store built in are damaged, or missing.
    #[error("{0}. `cargo install --path crates/bucket` in rayfold's sources installs `rayfold-bucket`")]
    StoreDamaged(#[source] rayfold_bucket::Error),
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
    #[error(
        "the function {function} is not in {}: build it with `cargo build -p rayfold-lambda`, or name the folder that \
         has it in RAYFOLD_FUNCTIONS", folder.display()
    )]
    NoFunction {
        /// Its binary's name.
        function: &'static str,
        /// Where it was looked for.
        folder: PathBuf,
    },
    /// A function's binary is nowhere.
    #[error(
        "the function {function} is neither in {} nor on the PATH: install it with `cargo install --path \
         crates/lambda` in rayfold's sources, or name the folder that has it in RAYFOLD_FUNCTIONS", folder.display()
    )]
    FunctionNowhere {
        /// Its binary's name.
        function: &'static str,
        /// The folder of the running program.
        folder: PathBuf,
    },
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
