//! Stopping when told to (Ctrl-C, SIGTERM): the first time in order, the second time at once.
//!
//! In order means that long work polls [`flag`] (or asks [`stopping`]), comes back early, and drops its temporary files
//! on the way out. At once means that only the files [`protect`]ed at that moment are removed.
//! SIGHUP keeps its default, so that `nohup` works.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

static STOPPING: AtomicBool = AtomicBool::new(false);
static SIGNAL: AtomicI32 = AtomicI32::new(0);
static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Starts listening. A write beyond a file size limit becomes an error instead of the program's death.
///
/// # Errors
/// When the system refuses a handler.
#[cfg(unix)]
pub(crate) fn listen() -> std::io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGXFSZ])?;
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        for signal in signals.forever().filter(|signal| *signal != SIGXFSZ) {
            if SIGNAL.swap(signal, Ordering::SeqCst) != 0 {
                for path in &*temporary() {
                    let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir_all(path));
                }
                std::process::exit(exit_code());
            }
            stop();
        }
    })?;
    Ok(())
}

/// Elsewhere Ctrl-C keeps its default, which ends the program at once.
#[cfg(not(unix))]
pub(crate) fn listen() -> std::io::Result<()> {
    Ok(())
}

/// Has all work come back early: the run has failed.
pub(crate) fn stop() {
    STOPPING.store(true, Ordering::SeqCst);
}

/// Lets work begin again after a failure that was told; not after a signal.
pub(crate) fn go_on() {
    STOPPING.store(false, Ordering::SeqCst);
    if signalled() {
        stop();
    }
}

/// Work is to come back early, because of a signal or of a failure elsewhere.
pub(crate) fn stopping() -> bool {
    STOPPING.load(Ordering::SeqCst)
}

/// The same for those who take a flag to poll.
pub(crate) fn flag() -> &'static AtomicBool {
    &STOPPING
}

/// A signal told the run to stop.
pub(crate) fn signalled() -> bool {
    SIGNAL.load(Ordering::SeqCst) != 0
}

/// As shells count: 128 and the signal's number.
pub(crate) fn exit_code() -> i32 {
    128 + SIGNAL.load(Ordering::SeqCst)
}

/// A file or a folder that must not outlive the run, until this guard is dropped.
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
