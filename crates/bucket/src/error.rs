//! Why the store cannot be started. What goes wrong in a request is answered there.

use std::io::{self, Write};
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
    /// A file is damaged, or missing beside others. Nothing was changed.
    #[error(
        "{} is damaged{}: {what}. Nothing was changed. `rayfold-bucket check --data {}` lists what is damaged, and with \
         `--repair` sets it aside and keeps the rest",
        file.display(), at(*offset), folder.display()
    )]
    Damaged {
        /// The folder of the store.
        folder: PathBuf,
        /// The damaged file.
        file: PathBuf,
        /// The first damaged byte, where one is known.
        offset: Option<u64>,
        /// What is wrong with it.
        what: String,
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

/// " at byte N".
fn at(offset: Option<u64>) -> String {
    offset.map_or_else(String::new, |offset| format!(" at byte {offset}"))
}

/// Writes a line about damage that was noticed while the store runs to standard error.
pub(crate) fn report(damage: &dyn std::fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "rayfold-bucket: {damage}");
}

/// The crate's results.
pub type Result<T, E = Error> = std::result::Result<T, E>;
