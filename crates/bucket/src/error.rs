//! The errors that keep the store from starting. Errors of requests are reported in their responses.

use std::io::{self, Write};
use std::path::PathBuf;

/// The reason why the store cannot be started.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Another process uses the folder.
    #[error("{} is in use by another process", .0.display())]
    DataInUse(PathBuf),
    /// The folder holds something else. It is left unchanged.
    #[error("{} holds {what}, not a bucket's data: choose another folder or move that away", path.display())]
    NotOurs {
        /// The path of the folder.
        path: PathBuf,
        /// A description of its content.
        what: String,
    },
    /// A later version has written the folder.
    #[error("{} was written by a later version (format {found}; this one reads {known})", path.display())]
    Newer {
        /// The path of the folder.
        path: PathBuf,
        /// The format of the folder.
        found: u32,
        /// The newest format that this version can read.
        known: u32,
    },
    /// A file or folder could not be used.
    #[error("cannot access {}", path.display())]
    File {
        /// The path of the file or folder.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A file is damaged, or missing while others are there. Nothing was changed.
    #[error(
        "{} is damaged{}: {what}. Nothing was changed. `rayfold-bucket check --data {}` lists what is damaged, and with \
         `--repair` sets it aside and keeps the rest",
        file.display(), at(*offset), folder.display()
    )]
    Damaged {
        /// The path of the store's folder.
        folder: PathBuf,
        /// The path of the damaged file.
        file: PathBuf,
        /// The position of the first damaged byte, if it is known.
        offset: Option<u64>,
        /// A description of the damage.
        what: String,
    },
    /// The server cannot listen on the address.
    #[error("cannot listen on {address}")]
    Listen {
        /// The address that was requested.
        address: String,
        /// The error of the system.
        source: io::Error,
    },
    /// The URL of the webhook is invalid.
    #[error("events cannot be sent to {url}: {reason}")]
    Webhook {
        /// The URL as it was given.
        url: String,
        /// The problem with it.
        reason: String,
    },
    /// A part of the program failed during the start.
    #[error("the store did not start: {0}")]
    Start(String),
    /// The database could not be read or written.
    #[error("the database in {}", path.display())]
    Storage {
        /// The path of the folder.
        path: PathBuf,
        /// The error of the database.
        source: Box<redb::Error>,
    },
}

impl Error {
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}

/// Returns " at byte N", or nothing without a position.
fn at(offset: Option<u64>) -> String {
    offset.map_or_else(String::new, |offset| format!(" at byte {offset}"))
}

/// Reports damage that was noticed while the store runs, as a line on standard error.
pub(crate) fn report(damage: &dyn std::fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "rayfold-bucket: {damage}");
}

/// The result of the crate's functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;
