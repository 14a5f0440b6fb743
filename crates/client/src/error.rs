//! What can go wrong between a user and a bucket.

use std::io;
use std::path::PathBuf;

use rayfold_pipeline::keys::Animation;

/// The client's errors. Each names the object's key, the file or the animation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The store's, and those of keys.
    #[error(transparent)]
    Store(#[from] rayfold_pipeline::Error),
    /// Nothing in the bucket shows that there is such an animation.
    #[error("there is no animation {0}")]
    NoAnimation(Animation),
    /// A file to submit cannot be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file is not what it was when the submission was made.
    #[error("{key} has changed while it was being submitted")]
    FileChanged {
        /// Where it was to go.
        key: String,
    },
    /// The bucket's folder holds scripts that a submission lacks and was not told to delete; nothing was changed.
    #[error("in the bucket, but not in the submission: {}", keys.join(", "))]
    WouldDelete {
        /// Their keys.
        keys: Vec<String>,
    },
    /// The scripts in the bucket are no longer those that were submitted.
    #[error("somebody else has changed {key} meanwhile")]
    ChangedMeanwhile {
        /// One of those that differ.
        key: String,
    },
    /// An object was replaced each time that it was being read.
    #[error("{key} is replaced faster than it can be read")]
    Restless {
        /// The object's key.
        key: String,
    },
    /// A manifest's frame that is not there.
    #[error("{key} is gone: look at the manifest again")]
    FrameGone {
        /// The frame's key.
        key: String,
    },
    /// What the caller does with the bytes failed.
    #[error(transparent)]
    Output(io::Error),
    /// The animation's settings cannot say so many frames.
    #[error("animation.json cannot be written")]
    Settings(#[source] rayfold_pipeline::Cause),
}

/// What the client's functions return.
pub type Result<T, E = Error> = std::result::Result<T, E>;
