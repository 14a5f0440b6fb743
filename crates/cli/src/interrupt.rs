//! Stops a run on a signal (Ctrl-C, SIGTERM, SIGHUP): in order at the first one, at once at the second. A run that
//! has not stopped in order after [`GRACE`] is ended at once, too, unless it has asked for [`patience`].
//!
//! *In order* means that long work polls [`flag`] (or calls [`stopping`]), returns early, and drops its temporary
//! files. *At once* means that only those files are removed. A call that may block without end (on a terminal, a pipe)
//! is made by [`wait_for`], which returns at the first signal. Signals that were ignored when the program started stay
//! ignored: `nohup`, and `&` in a script, ask for that.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::console::Console;

static STOPPING: AtomicBool = AtomicBool::new(false);
static SIGNAL: AtomicI32 = AtomicI32::new(0);
static FOLDERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The time limit for an orderly stop: a user should wait for less than a second.
const GRACE: Duration = Duration::from_millis(700);

static PATIENT: AtomicBool = AtomicBool::new(false);

/// The time between two checks for a signal.
const LOOK: Duration = Duration::from_millis(20);

/// Starts listening. A write beyond a file size limit becomes an error instead of the program's death.
///
/// # Errors
/// Fails if the system refuses a handler.
#[cfg(unix)]
pub(crate) fn listen(console: &Console) -> std::io::Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let wanted =
        [SIGHUP, SIGINT, SIGTERM, SIGXFSZ].into_iter().filter(|signal| !is_ignored(*signal, &status));
    let mut signals = signal_hook::iterator::Signals::new(wanted)?;
    let console = *console;
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        for signal in signals.forever().filter(|signal| *signal != SIGXFSZ) {
            if SIGNAL.swap(signal, Ordering::SeqCst) != 0 {
                end_at_once();
            }
            stop();
            if !PATIENT.load(Ordering::SeqCst) {
                // If there is no thread for it, a second signal is needed.
                let _ = std::thread::Builder::new().name("grace".into()).spawn(move || {
                    std::thread::sleep(GRACE);
                    console.note("interrupted");
                    end_at_once();
                });
            }
        }
    })?;
    Ok(())
}

/// Ends the program without waiting for any work. Files that are not complete are removed.
fn end_at_once() -> ! {
    rayfold_files::remove_unfinished();
    for folder in &*folders() {
        let _ = std::fs::remove_dir_all(folder);
    }
    std::process::exit(exit_code());
}

/// Lets the run take its time to stop in order, because it must stop other programs or answer their requests.
#[cfg(feature = "network")]
pub(crate) fn patience() {
    PATIENT.store(true, Ordering::SeqCst);
}

/// On other systems Ctrl-C keeps its default effect, which ends the program at once.
#[cfg(not(unix))]
pub(crate) fn listen(_: &Console) -> std::io::Result<()> {
    Ok(())
}

/// Returns whether a signal was ignored at the start, from Linux's `/proc/self/status`: bits counted from 1, in
/// hexadecimal. A system without that file gives SIGHUP its default, so that `nohup` works.
#[cfg(unix)]
fn is_ignored(signal: i32, status: &str) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    match mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()) {
        Some(mask) => mask >> (signal - 1) & 1 == 1,
        None => signal == signal_hook::consts::SIGHUP,
    }
}

/// Makes all work return early, because the run has failed.
pub(crate) fn stop() {
    STOPPING.store(true, Ordering::SeqCst);
}

/// Lets work begin again after a failure was reported, but not after a signal.
pub(crate) fn go_on() {
    STOPPING.store(false, Ordering::SeqCst);
    if signalled() {
        stop();
    }
}

/// Returns whether work should return early, because of a signal or of a failure elsewhere.
pub(crate) fn stopping() -> bool {
    STOPPING.load(Ordering::SeqCst)
}

/// Returns the flag behind [`stopping`], for callers that poll one.
pub(crate) fn flag() -> &'static AtomicBool {
    &STOPPING
}

/// A signal asked the run to stop.
pub(crate) fn signalled() -> bool {
    SIGNAL.load(Ordering::SeqCst) != 0
}

/// Returns the exit code as shells count it: 128 plus the signal's number.
pub(crate) fn exit_code() -> i32 {
    128 + SIGNAL.load(Ordering::SeqCst)
}

/// A folder that must not outlive the run, until this guard is dropped.
#[derive(Debug)]
#[cfg(all(unix, feature = "network"))]
pub(crate) struct Protected(PathBuf);

/// Makes a second signal remove `folder`.
#[cfg(all(unix, feature = "network"))]
pub(crate) fn protect(folder: &std::path::Path) -> Protected {
    folders().push(folder.to_path_buf());
    Protected(folder.to_path_buf())
}

fn folders() -> MutexGuard<'static, Vec<PathBuf>> {
    FOLDERS.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(all(unix, feature = "network"))]
impl Drop for Protected {
    fn drop(&mut self) {
        folders().retain(|folder| *folder != self.0);
    }
}

/// Runs work that may wait for another program or a user on a separate thread. At a signal that thread is abandoned,
/// because nothing else can end a read from a terminal.
///
/// # Errors
/// Fails if a signal came first, or the system refuses a thread.
pub(crate) fn wait_for<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> anyhow::Result<T> {
    let (sender, receiver) = mpsc::channel();
    std::thread::Builder::new().name("waiting".into()).spawn(move || {
        let _ = sender.send(work());
    })?;
    loop {
        match receiver.recv_timeout(LOOK) {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Timeout) if !signalled() => {}
            Err(_) => anyhow::bail!("interrupted"),
        }
    }
}

/// Runs work that polls a flag. The flag is set at a signal, and when the time is over.
pub(crate) fn within<T>(time: Duration, work: impl FnOnce(&AtomicBool) -> T) -> T {
    let is_over = AtomicBool::new(false);
    let (done, watched) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        let is_over = &is_over;
        scope.spawn(move || {
            let end = Instant::now() + time;
            while watched.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                is_over.store(stopping() || Instant::now() >= end, Ordering::SeqCst);
            }
        });
        let result = work(is_over);
        drop(done);
        result
    })
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn work_ends_when_its_time_is_over() {
        let wait = |flag: &AtomicBool| while !flag.load(Ordering::SeqCst) {};
        within(Duration::ZERO, wait);
        assert_eq!(within(Duration::from_secs(3600), |_| 7), 7);
    }

    #[test]
    fn ignored_signals_are_those_of_the_mask() {
        let status = "Name:\trayfold\nSigBlk:\t0000000000000000\nSigIgn:\t0000000000001001\nSigCgt:\t0\n";
        let ignored: Vec<i32> = (1..=64).filter(|signal| is_ignored(*signal, status)).collect();
        assert_eq!(ignored, [1, 13]);
        assert!(is_ignored(1, "") && !is_ignored(2, "") && !is_ignored(15, ""));
    }

    #[test]
    fn work_that_is_done_is_handed_back() {
        assert_eq!(wait_for(|| 7).unwrap(), 7);
    }
}
