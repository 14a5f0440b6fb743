//! The errors of setting up the bucket and the invoker. Errors inside functions are outcomes of their invocations.

use std::io;
use std::path::PathBuf;

use crate::program::Program;

/// An error of setting up the bucket or the invoker.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages show what the fields hold")]
pub enum Error {
    /// Neither the S3 server nor the tools to build it are on this machine.
    #[error(
        "there is no {program}: put `{}` on the PATH, name it in {}, or build it with `cargo run -p rayfold-local \
         --example stores {}` ({reason})", program.binary, program.variable, program.name.to_lowercase()
    )]
    NoServer {
        program: &'static Program,
        /// The missing programs, and the places that were searched.
        reason: String,
    },
    /// The path in the variable that names the S3 server does not exist.
    #[error("{variable} names {}, which is no file", path.display())]
    NamedServerMissing {
        /// The environment variable with the path.
        variable: &'static str,
        /// The path in that variable.
        path: PathBuf,
    },
    /// The Go compiler failed.
    #[error(
        "{program} could not be built from source ({reason}): put `{}` on the PATH, or name it in {}",
        program.binary, program.variable
    )]
    Install {
        program: &'static Program,
        /// The last lines that Go wrote.
        reason: String,
    },
    /// The folder is MinIO's own.
    #[error(
        "{} is the data folder of a MinIO and stays as it is: choose another folder", .0.display()
    )]
    MinioFolder(PathBuf),
    /// The store gave no temporary credentials.
    #[error("the store gives no temporary credentials: {reason}")]
    NoSession {
        /// The store's answer.
        reason: String,
    },
    /// The folder has no page.
    #[error("{} is not the studio's static page: `cargo xtask site` builds it ({reason})", folder.display())]
    NoPage {
        folder: PathBuf,
        /// The missing part.
        reason: String,
    },
    /// The built-in store did not start.
    #[error(transparent)]
    Store(rayfold_bucket::Error),
    /// Files of the built-in store are damaged or missing.
    #[error("{0}. `cargo install --path crates/bucket` in rayfold's sources installs `rayfold-bucket`")]
    StoreDamaged(#[source] rayfold_bucket::Error),
    /// The S3 server ended or stayed unreachable during its start.
    #[error("{program} did not start: {reason}; its log is {}", log.display())]
    ServerStart {
        program: &'static Program,
        /// The symptom that was observed.
        reason: String,
        /// The server's log file.
        log: PathBuf,
    },
    /// Another process uses the folder.
    #[error("{} is in use by another rayfold", .0.display())]
    DataInUse(PathBuf),
    /// A file or folder could not be accessed.
    #[error("{}", path.display())]
    File {
        /// The path of the file or folder.
        path: PathBuf,
        source: io::Error,
    },
    /// A loopback port was not available.
    #[error("cannot listen on {address}")]
    Listen { address: String, source: io::Error },
    /// A function's binary is missing from its folder.
    #[error(
        "the function {function} is not in {}: build it with `cargo build -p rayfold-lambda`, or name the folder that \
         has it in RAYFOLD_FUNCTIONS", folder.display()
    )]
    NoFunction {
        /// The name of its binary.
        function: &'static str,
        /// The folder that should contain it.
        folder: PathBuf,
    },
    /// A function's binary is neither in the program's folder nor on the PATH.
    #[error(
        "the function {function} is neither in {} nor on the PATH: install it with `cargo install --path \
         crates/lambda` in rayfold's sources, or name the folder that has it in RAYFOLD_FUNCTIONS", folder.display()
    )]
    FunctionNowhere {
        /// The name of its binary.
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
        /// The path of the program.
        program: PathBuf,
        source: io::Error,
    },
    /// The bucket could not be set up.
    #[error("cannot set up the bucket {bucket}")]
    Bucket {
        /// The name of the bucket.
        bucket: String,
        source: rayfold_pipeline::Error,
    },
    /// The S3 server does not answer.
    #[error("cannot reach {endpoint}")]
    Unreachable { endpoint: String, source: rayfold_pipeline::Error },
    /// The S3 server has no such bucket.
    #[error(
        "there is no bucket {bucket} at {endpoint}: create it with `aws s3 mb s3://{bucket} --endpoint-url {endpoint}`"
    )]
    NoBucket { endpoint: String, bucket: String },
    /// The S3 server refuses access to the bucket.
    #[error(
        "{endpoint} refuses access to the bucket {bucket}: credentials come from AWS_ACCESS_KEY_ID and \
         AWS_SECRET_ACCESS_KEY, or AWS_PROFILE"
    )]
    Refused { endpoint: String, bucket: String, source: rayfold_pipeline::Error },
    /// The S3 server lacks conditional puts.
    #[error(
        "{endpoint} cannot hold animations: {problem}. Conditional puts (If-None-Match, If-Match) are needed"
    )]
    NoConditions {
        endpoint: String,
        /// The behaviour that was observed.
        problem: &'static str,
    },
    /// The system returned no random bytes for the credentials.
    #[error("no random bytes from the system: {0}")]
    Random(getrandom::Error),
}

impl Error {
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}

/// The result type of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;
