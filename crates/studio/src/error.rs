//! The errors of the studio.

use std::io;
use std::path::PathBuf;

/// An error of the studio.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The path of the file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A file cannot be written.
    #[cfg(feature = "server")]
    #[error(transparent)]
    Write(#[from] rayfold_files::Error),
    /// The folder in which something should be written does not exist.
    #[error("the folder {} does not exist", path.display())]
    NoFolder {
        /// The path of the folder.
        path: PathBuf,
    },
    /// The files are larger than the studio holds in memory.
    #[error("{} and what is opened with it are larger than {limit} bytes, which is more than the studio holds", path.display())]
    TooLarge {
        /// The file that exceeded the limit.
        path: PathBuf,
        /// The limit in bytes.
        limit: u64,
    },
    /// A new script cannot have this name.
    #[error("{name}: {problem}")]
    Name {
        /// The name, or its beginning.
        name: String,
        /// The problem, and a correction.
        problem: &'static str,
    },
    /// The content of `animation.json` is invalid.
    #[error("{0}")]
    Settings(String),
    /// There is no free port, or the system has no randomness.
    #[error("cannot start the server of the page")]
    Server(#[source] io::Error),
    /// The animation cannot be rendered.
    #[error("{0}")]
    Output(String),
}

/// Formats an error with its causes, for messages. A store's error about credentials says that they are missing or
/// wrong, but does not contain them.
pub(crate) fn words(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        let words = error.to_string();
        if !text.contains(&words) {
            text.push_str(": ");
            text.push_str(&words);
        }
        source = error.source();
    }
    text
}

#[cfg(feature = "server")]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_chain_of_an_error_is_told_once() {
        let refused = rayfold_pipeline::Error::Refused {
            key: "scripts/".into(),
            source: std::io::Error::other("no such bucket").into(),
        };
        let text = words(&rayfold_client::Error::Store(refused));
        assert_eq!(text, "the store refuses scripts/: no such bucket");
    }
}
