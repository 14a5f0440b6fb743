//! Temporary files: their names, and the removal of those that a killed run left behind.
//!
//! A run keeps a lock on its temporary file while it writes. The system releases the lock when the run ends, however
//! it ends. Only files with a name of this crate's pattern are removed.
//!
//! Some network drives do not pass locks on to other machines. So a name begins with a mark of the running system, and
//! a file of another system must be old to count as left behind.

use std::collections::HashSet;
use std::fs::{File, TryLockError};
use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, SystemTime};

const BEFORE: &str = ".rayfold-";
const AFTER: &str = ".part";
const DIGITS: usize = 12;

/// The digits of the system's mark; the others are random.
const MARK_DIGITS: usize = 4;

/// The time since the last write after which an unlocked temporary file of another system counts as left behind.
const AGE: Duration = Duration::from_secs(60 * 60);

/// The age on file systems without locks. A run may still be writing there, but no frame takes days.
const AGE_WITHOUT_LOCKS: Duration = Duration::from_secs(7 * 24 * 60 * 60);

/// Returns a name that no other run uses, short enough for every file system.
pub(crate) fn temporary_name() -> String {
    let random = RandomState::new().hash_one(std::process::id());
    let (mark, digits) = (mark().unwrap_or(random >> 16), DIGITS - MARK_DIGITS);
    format!("{BEFORE}{:0MARK_DIGITS$x}{:0digits$x}{AFTER}", mark >> 48, random >> (64 - 4 * digits))
}

/// Returns a mark of the running system, from its start to its end, or `None` if the system has no such name.
fn mark() -> Option<u64> {
    static MARK: OnceLock<Option<u64>> = OnceLock::new();
    *MARK.get_or_init(|| {
        let name = std::fs::read("/proc/sys/kernel/random/boot_id").ok()?;
        // FNV-1a, which is the same in every run.
        Some(name.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3)
        }))
    })
}

/// Returns whether a temporary file was made on the running system.
fn is_of_this_system(name: &str) -> bool {
    let digits = name.strip_prefix(BEFORE).and_then(|rest| rest.get(..MARK_DIGITS));
    digits.zip(mark()).is_some_and(|(digits, mark)| digits == format!("{:0MARK_DIGITS$x}", mark >> 48))
}

fn is_temporary(name: &str) -> bool {
    let random = name.strip_prefix(BEFORE).and_then(|rest| rest.strip_suffix(AFTER));
    let is_digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
    random.is_some_and(|random| random.len() == DIGITS && random.bytes().all(is_digit))
}

/// Removes the files that killed runs left in a folder. Checks a folder once per run. A file that
/// cannot be removed stays.
pub(crate) fn remove_leftovers(folder: &Path) {
    static SEEN: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);
    let mut seen = SEEN.lock().unwrap_or_else(PoisonError::into_inner);
    if seen.get_or_insert_default().insert(folder.to_path_buf()) {
        drop(seen);
        remove_older(folder, SystemTime::now());
    }
}

fn remove_older(folder: &Path, now: SystemTime) {
    let Ok(entries) = folder.read_dir() else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str().filter(|name| is_temporary(name)) else { continue };
        // For a link with such a name, the type of the link itself counts.
        if entry.file_type().is_ok_and(|of| of.is_file()) {
            let age = if is_of_this_system(name) { Duration::ZERO } else { AGE };
            remove_if_abandoned(&entry.path(), now, age);
        }
    }
}

fn remove_if_abandoned(path: &Path, now: SystemTime, least: Duration) {
    let Ok(modified) = path.metadata().and_then(|metadata| metadata.modified()) else { return };
    let age = now.duration_since(modified).unwrap_or_default();
    if age < least {
        return;
    }
    let file = File::open(path);
    let is_abandoned = match file.as_ref().map(File::try_lock) {
        Ok(Ok(())) => true,
        Ok(Err(TryLockError::WouldBlock)) => false,
        // A mode of 0200 denies this process to read the file, but its writer may still be running.
        Ok(Err(TryLockError::Error(_))) | Err(_) => age >= AGE_WITHOUT_LOCKS,
    };
    if is_abandoned {
        // The lock is held until the file is gone, so that a run that has just made it notices.
        let _ = std::fs::remove_file(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(folder: &Path, name: &str, age: Duration) -> File {
        let file = File::create(folder.join(name)).unwrap();
        file.set_modified(SystemTime::now() - age).unwrap();
        file
    }

    #[test]
    fn names_are_short_ours_and_never_the_same() {
        let names: HashSet<String> = (0..1_000).map(|_| temporary_name()).collect();
        assert_eq!(names.len(), 1_000);
        assert!(names.iter().all(|name| is_temporary(name) && name.len() < 30), "{names:?}");
        for other in
            [".rayfold-.part", ".rayfold-0123456789ab", "rayfold-0123456789ab.part", ".a.gif.1-1.part"]
        {
            assert!(!is_temporary(other), "{other}");
        }
    }

    #[test]
    fn what_a_killed_run_left_goes_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let (old, young) = (AGE + Duration::from_secs(9), AGE - Duration::from_secs(9));
        drop(made(path, ".rayfold-000000000001.part", old));
        drop(made(path, ".rayfold-000000000002.part", young));
        let running = made(path, ".rayfold-000000000003.part", old * 1_000);
        running.try_lock().unwrap();
        drop(made(path, ".rayfold-theirs.part", old));
        drop(made(path, ".p.gif.1-1.part", old));
        std::fs::create_dir(path.join(".rayfold-000000000004.part")).unwrap();
        remove_older(path, SystemTime::now());
        let mut names: Vec<_> =
            path.read_dir().unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        assert_eq!(
            names,
            [
                ".p.gif.1-1.part",
                ".rayfold-000000000002.part",
                ".rayfold-000000000003.part",
                ".rayfold-000000000004.part",
                ".rayfold-theirs.part",
            ]
        );
        drop(running);
        remove_older(path, SystemTime::now());
        assert!(!path.join(".rayfold-000000000003.part").exists(), "its run has ended");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_run_on_this_system_left_goes_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let (left, written) = (temporary_name(), temporary_name());
        drop(made(path, &left, Duration::ZERO));
        let running = made(path, &written, Duration::ZERO);
        running.try_lock().unwrap();
        remove_older(path, SystemTime::now());
        assert!(!path.join(left).exists() && path.join(written).exists());
    }
}
