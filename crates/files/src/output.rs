//! Writing: a temporary file that replaces its target when it is complete.

use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::input::kind;
use crate::leftover::{remove_leftovers, temporary_name};

/// The largest number of links in a chain, which is the limit of the Linux kernel.
const MAX_LINKS: usize = 40;

/// The largest number of random names that are tried. Even a second try is unlikely.
const MAX_NAMES: usize = 16;

/// An error in writing a file.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The target folder does not exist.
    #[error("cannot write {}: the folder {} does not exist", path.display(), folder.display())]
    NoFolder {
        /// The path of the file.
        path: PathBuf,
        /// The path of the folder.
        folder: PathBuf,
    },
    /// The parent of the target is no folder.
    #[error("cannot write {}: {} is no folder", path.display(), folder.display())]
    NotAFolder {
        /// The path of the file.
        path: PathBuf,
        /// The path that is no folder.
        folder: PathBuf,
    },
    /// The target exists and must not be replaced by a file.
    #[error("cannot write {}: it is {what}", path.display())]
    Taken {
        /// The path of the file.
        path: PathBuf,
        /// The kind of the existing target.
        what: &'static str,
    },
    /// The system reports an error.
    #[error("cannot write {}", path.display())]
    Io {
        /// The path of the file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
}

impl Error {
    /// Replaces the path by that of another file, for which this one was a stand-in.
    #[must_use]
    pub fn about(mut self, file: PathBuf) -> Self {
        match &mut self {
            Self::NoFolder { path, .. }
            | Self::NotAFolder { path, .. }
            | Self::Taken { path, .. }
            | Self::Io { path, .. } => *path = file,
        }
        self
    }

    /// Returns whether the file exists already and [`OutputFile::write_new`] refused to replace it.
    pub fn is_taken(&self) -> bool {
        matches!(self, Self::Io { source, .. } if source.kind() == io::ErrorKind::AlreadyExists)
    }
}

/// A file that is being written. If it is dropped unfinished, the data written is removed.
#[derive(Debug)]
pub struct OutputFile {
    /// The path as the user gave it, for messages.
    path: PathBuf,
    place: PathBuf,
    temporary: Temporary,
    file: File,
}

/// The name of a temporary file. Dropping it removes the file from the folder.
#[derive(Debug)]
struct Temporary(PathBuf);

static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

impl OutputFile {
    /// Begins to write `path`. An existing file stays unchanged until [`finish`](Self::finish), and its mode and
    /// owner are kept. A symbolic link is followed, also to a file that does not exist yet.
    ///
    /// # Errors
    /// Fails if the folder is missing or not writable, or if `path` is a folder, a device or a read-only file.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let taken = |what| Error::Taken { path: path.to_path_buf(), what };
        let failed = |source| Error::Io { path: path.to_path_buf(), source };
        let existing = path.metadata().ok();
        if let Some(existing) = &existing {
            match kind(existing.file_type()) {
                Some("a folder") => return Err(taken("a folder")),
                Some(_) => return Err(taken("not a regular file")),
                None => {}
            }
        }
        let place = follow_links(path).map_err(failed)?;
        if place.file_name().is_none() {
            return Err(taken("not the name of a file"));
        }
        let folder = folder_of(&place);
        if !folder.is_dir() && folder.symlink_metadata().is_ok() {
            return Err(Error::NotAFolder { path: path.to_path_buf(), folder: folder.to_path_buf() });
        }
        if !folder.is_dir() {
            return Err(Error::NoFolder { path: path.to_path_buf(), folder: folder.to_path_buf() });
        }
        match place.symlink_metadata() {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
            _ => {}
        }
        if let Some(existing) = &existing {
            // A rename would replace it nevertheless.
            if existing.permissions().readonly() {
                return Err(taken("read-only"));
            }
            OpenOptions::new().write(true).open(&place).map_err(failed)?;
        }
        remove_leftovers(folder);
        let (temporary, file) = Temporary::create(folder, existing.as_ref()).map_err(failed)?;
        Ok(Self { path: path.to_path_buf(), place, temporary, file })
    }

    /// Replaces bytes that were written before. Nothing can be written behind the end after that.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub fn overwrite(&mut self, at: u64, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(at))?;
        self.file.write_all(bytes)
    }

    /// Moves the file to its target. `durable`: syncs it to disk first, which takes milliseconds per file.
    ///
    /// # Errors
    /// Fails if the last bytes cannot be written or the file cannot be renamed.
    pub fn finish(self, durable: bool) -> Result<(), Error> {
        self.settle(durable, |temporary, place| std::fs::rename(temporary, place))
    }

    fn settle(self, durable: bool, put: impl Fn(&Path, &Path) -> io::Result<()>) -> Result<(), Error> {
        let Self { path, place, temporary, file } = self;
        let synced = if durable { file.sync_all() } else { Ok(()) };
        // The lock is held until the file has its name. Some systems cannot rename open files.
        let file = if cfg!(unix) { Some(file) } else { None };
        let put = synced.and_then(|()| put(&temporary.0, &place));
        drop(file);
        put.map_err(|source| Error::Io { path, source })
    }

    /// Writes a whole file.
    ///
    /// # Errors
    /// See [`create`](Self::create) and [`finish`](Self::finish).
    pub fn write(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>, durable: bool) -> Result<(), Error> {
        Self::with(path.as_ref(), bytes.as_ref())?.finish(durable)
    }

    /// Writes a whole file that does not exist yet. Never replaces another file.
    ///
    /// # Errors
    /// See [`write`](Self::write). [`Error::is_taken`] holds if the file exists.
    pub fn write_new(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), Error> {
        let path = path.as_ref();
        if path.symlink_metadata().is_ok() {
            return Err(Error::Io { path: path.to_path_buf(), source: io::ErrorKind::AlreadyExists.into() });
        }
        Self::with(path, bytes)?.settle(true, |temporary, place| {
            // Unlike a rename, it refuses an existing name. Some file systems have no hard links.
            match std::fs::hard_link(temporary, place) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists && !place.exists() => {
                    std::fs::rename(temporary, place)
                }
                linked => linked,
            }
        })
    }

    fn with(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let mut out = Self::create(path)?;
        out.write_all(bytes).map_err(|source| Error::Io { path: path.to_path_buf(), source })?;
        Ok(out)
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Temporary {
    /// Creates a file in a folder. It has the mode and owner of `existing` if given, else those of any new file.
    fn create(folder: &Path, existing: Option<&Metadata>) -> io::Result<(Self, File)> {
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        if existing.is_some() {
            use std::os::unix::fs::OpenOptionsExt;
            // No other user may read it before it has the mode of the file that it replaces.
            options.mode(0o600);
        }
        let mut tries = 0;
        let (temporary, file) = loop {
            let path = folder.join(temporary_name());
            tries += 1;
            match options.open(&path) {
                Ok(file) => {
                    unfinished().push(path.clone());
                    let temporary = Self(path);
                    // On a file system without locks, only the age identifies leftovers.
                    let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
                    // Before the lock, another run may have removed the file as a leftover.
                    if !is_taken && temporary.0.exists() || tries >= MAX_NAMES {
                        break (temporary, file);
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && tries < MAX_NAMES => {}
                Err(error) => return Err(error),
            }
        };
        if let Some(existing) = existing {
            #[cfg(unix)]
            {
                use std::os::unix::fs::{MetadataExt, fchown};
                let ours = file.metadata()?;
                if (ours.uid(), ours.gid()) != (existing.uid(), existing.gid()) {
                    // Only root may change the owner of a file.
                    let _ = fchown(&file, Some(existing.uid()), Some(existing.gid()));
                }
            }
            file.set_permissions(existing.permissions())?;
        }
        Ok((temporary, file))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // After a rename the file does not exist, and no other run uses its name.
        let _ = std::fs::remove_file(&self.0);
        unfinished().retain(|path| *path != self.0);
    }
}

/// Reports now the error that [`OutputFile::create`] would report later, so that no work is done in vain.
///
/// # Errors
/// Fails if no file can be written at `path`.
pub fn probe(path: &Path) -> Result<(), Error> {
    OutputFile::create(path).map(drop)
}

/// Removes the temporary files of this program, which is about to exit without dropping anything.
pub fn remove_unfinished() {
    for path in &*unfinished() {
        let _ = std::fs::remove_file(path);
    }
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the path that a symbolic link leads to, whether or not the file exists.
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    if let Ok(place) = path.canonicalize() {
        return Ok(place);
    }
    let mut place = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        match place.read_link() {
            Ok(target) => place = folder_of(&place).join(target),
            Err(_) => return Ok(place),
        }
    }
    Err(io::Error::other("its links lead in a circle"))
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests;
