//! Why the studio could not do what it was asked.

use std::io;
use std::path::PathBuf;

/// Why the studio could not do what it was asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] rayfold_files::Error),
    /// A folder without a script.
    #[error("the folder {} holds no scene scripts (*.txt)", path.display())]
    NoScripts {
        /// Which.
        path: PathBuf,
    },
    /// More text than is held in memory.
    #[error("{} and what is opened with it are larger than {limit} bytes, which is more than the studio holds", path.display())]
    TooLarge {
        /// The file with which it became too much.
        path: PathBuf,
        /// How much is held.
        limit: u64,
    },
    /// A name that a new script cannot have.
    #[error("{name}: {problem}")]
    Name {
        /// The name, or its beginning.
        name: String,
        /// What is wrong with it, and what would be right.
        problem: &'static str,
    },
    /// What `animation.json` says is no settings.
    #[error("{0}")]
    Settings(String),
    /// No socket, no randomness.
    #[error("cannot start the server of the page")]
    Server(#[source] io::Error),
    /// There is no page to show.
    #[error("the page has not been built: {0}")]
    NoPage(String),
    /// The animation cannot be rendered.
    #[error("{0}")]
    Output(String),
}

/// An error with all that it rests on, for people. What stores say of credentials is that they are missing or wrong,
/// never which they are.
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
