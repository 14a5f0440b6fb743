//! Files that appear whole or not at all.
//!
//! A file is written beside its place under a hidden name and renamed when it is complete. Whatever ends the run
//! before that (an error, a full disk, a file size limit, Ctrl-C) leaves what was there before, and no litter.
//!
//! ```ignore
//! let mut out = OutputFile::create("hello.gif")?;
//! out.write_all(b"GIF89a")?;
//! out.finish()?; // hello.gif is there from now on
//! ```

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::interrupt::{Protected, protect};

/// Why a file could not be written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum OutputError {
    /// The folder that the file should lie in is not there.
    #[error("cannot write {}: the folder {} does not exist", path.display(), folder.display())]
    NoFolder { path: PathBuf, folder: PathBuf },
    /// Its place is taken by something that a file must not replace.
    #[error("cannot write {}: it is {what}", path.display())]
    Taken { path: PathBuf, what: &'static str },
    /// The system says no.
    #[error("cannot write {}", path.display())]
    Io { path: PathBuf, source: io::Error },
}

/// A file on its way; dropping it unfinished removes what was written.
#[derive(Debug)]
pub(crate) struct OutputFile {
    /// As the user named it, for messages.
    path: PathBuf,
    place: PathBuf,
    temporary: PathBuf,
    file: Option<File>,
    finished: bool,
    _protected: Protected,
}

impl OutputFile {
    /// Begins to write `path`. An existing file stays as it is until [`finish`](Self::finish); a symbolic link is
    /// followed.
    ///
    /// # Errors
    /// When the folder is missing or not writable, or `path` is a folder or a device.
    pub(crate) fn create(path: impl AsRef<Path>) -> Result<Self, OutputError> {
        let path = path.as_ref();
        let place = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let taken = |what| OutputError::Taken { path: path.to_path_buf(), what };
        if let Ok(metadata) = place.metadata() {
            if metadata.is_dir() {
                return Err(taken("a folder"));
            }
            if !metadata.is_file() {
                return Err(taken("not a regular file"));
            }
        }
        let Some(name) = place.file_name() else { return Err(taken("not the name of a file")) };
        let folder = folder_of(&place);
        if !folder.is_dir() {
            return Err(OutputError::NoFolder { path: path.to_path_buf(), folder: folder.to_path_buf() });
        }
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let temporary =
            folder.join(format!(".{}.{}-{number}.part", name.to_string_lossy(), std::process::id()));
        let protected = protect(&temporary);
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&temporary)
            .map_err(|source| OutputError::Io { path: path.to_path_buf(), source })?;
        Ok(Self {
            path: path.to_path_buf(),
            place,
            temporary,
            file: Some(file),
            finished: false,
            _protected: protected,
        })
    }

    /// Puts the file in its place. `durable`: only after the disk has it, which takes milliseconds a file.
    ///
    /// # Errors
    /// When the last bytes cannot be written or the file cannot be renamed.
    pub(crate) fn finish(mut self, durable: bool) -> Result<(), OutputError> {
        let file = self.file.take().expect("finished once, because it takes self");
        let synced = if durable { file.sync_all() } else { Ok(()) };
        drop(file);
        synced
            .and_then(|()| std::fs::rename(&self.temporary, &self.place))
            .map_err(|source| OutputError::Io { path: self.path.clone(), source })?;
        self.finished = true;
        Ok(())
    }

    /// Writes a whole small file.
    ///
    /// # Errors
    /// See [`create`](Self::create) and [`finish`](Self::finish).
    pub(crate) fn write(path: impl AsRef<Path>, bytes: &[u8], durable: bool) -> Result<(), OutputError> {
        let path = path.as_ref();
        let mut out = Self::create(path)?;
        out.write_all(bytes).map_err(|source| OutputError::Io { path: path.to_path_buf(), source })?;
        out.finish(durable)
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.as_mut().expect("open until it is finished").write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        if !self.finished {
            // Some systems do not remove open files.
            self.file = None;
            let _ = std::fs::remove_file(&self.temporary);
        }
    }
}

/// Says now what [`OutputFile::create`] would say later, so that no work is done in vain.
///
/// # Errors
/// When no file can be written at `path`.
pub(crate) fn probe(path: &Path) -> Result<(), OutputError> {
    OutputFile::create(path).map(drop)
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unfinished_file_leaves_the_old_one_and_no_litter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gif");
        std::fs::write(&path, "old").unwrap();
        let mut out = OutputFile::create(&path).unwrap();
        out.write_all(b"new").unwrap();
        drop(out);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_finished_file_is_the_only_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gif");
        OutputFile::write(&path, b"new", true).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real.gif"), folder.path().join("link.gif"));
        std::fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        OutputFile::write(&link, b"new", false).unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink());
        assert_eq!(std::fs::read_to_string(&real).unwrap(), "new");
    }

    #[test]
    fn folders_and_missing_folders_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let taken = OutputFile::create(folder.path()).unwrap_err();
        assert!(taken.to_string().ends_with("it is a folder"), "{taken}");
        let missing = OutputFile::create(folder.path().join("no/a.gif")).unwrap_err();
        assert!(
            matches!(&missing, OutputError::NoFolder { folder, .. } if folder.ends_with("no")),
            "{missing}"
        );
    }
}
