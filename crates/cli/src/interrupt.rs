//! Stopping when told to (Ctrl-C, SIGTERM, SIGHUP): the first time in order, the second time at once.
//!
//! In order means that long work looks at [`requested`] (or polls [`flag`]), comes back early, and drops its temporary
//! files on the way out. At once means that only the files [`protect`]ed at that moment are removed.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

static REQUESTED: AtomicBool = AtomicBool::new(false);
static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Starts listening.
///
/// # Errors
/// When the system refuses a handler.
pub(crate) fn listen() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            for path in &*temporary() {
                let _ = std::fs::remove_file(path);
            }
            std::process::exit(130);
        }
    })
}

/// The run was told to stop.
pub(crate) fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// Turns true when the run is told to stop, for those who take a flag to poll.
pub(crate) fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// A file that must not outlive the run, until this guard is dropped.
#[derive(Debug)]
pub(crate) struct Protected(PathBuf);

/// Has a second signal remove `path`.
pub(crate) fn protect(path: &Path) -> Protected {
    temporary().push(path.to_path_buf());
    Protected(path.to_path_buf())
}

impl Drop for Protected {
    fn drop(&mut self) {
        temporary().retain(|path| *path != self.0);
    }
}

fn temporary() -> MutexGuard<'static, Vec<PathBuf>> {
    TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner)
}
