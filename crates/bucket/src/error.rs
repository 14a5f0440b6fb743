//! Why the store cannot be started. What goes wrong in a request is answered there.

use std::io;
use std::path::PathBuf;

/// Why the store cannot be started.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Another process has the folder.
    #[error("{} is in use by another process", .0.display())]
    DataInUse(PathBuf),
    /// The folder holds something else, which stays as it is.
    #[error("{} holds {what}, not a bucket's data: choose another folder or move that away", path.display())]
    NotOurs {
        /// The folder.
        path: PathBuf,
        /// What was found there.
        what: String,
    },
    /// The folder was written by a later version.
    #[error("{} was written by a later version (format {found}; this one reads {known})", path.display())]
    Newer {
        /// The folder.
        path: PathBuf,
        /// Its format.
        found: u32,
        /// The newest that is known here.
        known: u32,
    },
    /// A file or folder could not be used.
    #[error("{}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The address could not be had.
    #[error("cannot listen on {address}")]
    Listen {
        /// Where.
        address: String,
        /// Why.
        source: io::Error,
    },
    /// The webhook's address is of no use.
    #[error("events cannot be sent to {url}: {reason}")]
    Webhook {
        /// As it was given.
        url: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A part of the program failed while starting.
    #[error("the store did not start: {0}")]
    Start(String),
    /// The database could not be read or written.
    #[error("the database in {}", path.display())]
    Storage {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: Box<redb::Error>,
    },
}

impl Error {
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}

/// The crate's results.
pub type Result<T, E = Error> = std::result::Result<T, E>;
