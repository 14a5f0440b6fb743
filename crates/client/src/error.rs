//! The errors of the client.

use std::io;
use std::path::PathBuf;

use rayfold_pipeline::keys::Animation;

/// An error of the client. Each names the object's key, the file or the animation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error of the store or of a key.
    #[error(transparent)]
    Store(#[from] rayfold_pipeline::Error),
    /// Nothing in the bucket shows that the animation exists.
    #[error("there is no animation {0}")]
    NoAnimation(Animation),
    /// A file to submit cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The path of the file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// A file has changed since the submission was made.
    #[error("{key} has changed while it was being submitted")]
    FileChanged {
        /// The key under which it was to be uploaded.
        key: String,
    },
    /// The bucket's folder holds scripts that the submission lacks and may not delete. Nothing was changed.
    #[error("in the bucket, but not in the submission: {}", keys.join(", "))]
    WouldDelete {
        /// The keys of these scripts.
        keys: Vec<String>,
    },
    /// The scripts in the bucket are no longer those that were submitted.
    #[error("{key} is no longer what was submitted: someone has replaced it")]
    ChangedMeanwhile {
        /// The key of one that differs.
        key: String,
    },
    /// An object was replaced during every attempt to read it.
    #[error("{key} was replaced during every attempt to read it")]
    Restless {
        /// The key of the object.
        key: String,
    },
    /// A frame of the manifest does not exist any more.
    #[error("{key} does not exist any more: read the manifest again")]
    FrameGone {
        /// The key of the frame.
        key: String,
    },
    /// The caller failed to process the bytes.
    #[error(transparent)]
    Output(io::Error),
    /// The file of a download cannot be written.
    #[error(transparent)]
    Write(rayfold_files::Error),
    /// The animation's settings cannot hold this number of frames.
    #[error("animation.json cannot be written")]
    Settings(#[source] rayfold_pipeline::Cause),
}

/// The result of the client's functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;
