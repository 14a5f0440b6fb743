//! The folder of a store: its format, and the lock by which only one process uses it.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::bodies::sync_folder;
use super::medium::{Files, Medium, SystemFiles};
use crate::{Error, Result, private};

/// The newest format, which is also the one written. Format 1 had no sums beside the database, and a
/// journal without a header.
const FORMAT: u32 = 2;

/// The file that marks a folder as a store, with its format.
const MARKER: &str = "rayfold-bucket";

/// The marker while it is written.
const NEW_MARKER: &str = "rayfold-bucket.new";

const LOCK: &str = "lock";

/// The names that a new folder may contain: its lock, the marker of a start that was killed, and files that the owner
/// or the file system keeps there.
const HARMLESS: [&str; 4] = [LOCK, NEW_MARKER, "credentials.json", "lost+found"];

/// The places where MinIO keeps its own data in its folder.
const MINIO: [&str; 2] = [".minio.sys", "objects/.minio.sys"];

/// A folder that this process has locked until it is dropped.
#[derive(Debug)]
pub(super) struct Folder {
    path: PathBuf,
    files: Arc<dyn Files>,
    format: u32,
    _lock: File,
}

impl Folder {
    /// Takes the folder, which is created if missing, and removes the access of other users.
    ///
    /// # Errors
    /// [`Error::DataInUse`], [`Error::NotOurs`], [`Error::Newer`], [`Error::File`].
    pub(super) fn take(path: &Path) -> Result<Self> {
        Self::take_with(path, Arc::new(SystemFiles))
    }

    /// Takes a folder that a store has used before.
    ///
    /// # Errors
    /// The errors of [`Folder::take`], and [`Error::NotOurs`] for a folder without a store.
    pub(super) fn take_existing(path: &Path) -> Result<Self> {
        if recognise(path)? == Found::Nothing {
            return Err(Error::NotOurs { path: path.to_owned(), what: "nothing of a store".to_owned() });
        }
        Self::take(path)
    }

    /// Takes the folder with another implementation of the files of rows.
    pub(super) fn take_with(path: &Path, files: Arc<dyn Files>) -> Result<Self> {
        let found = recognise(path)?;
        private::make(path).map_err(Error::file(path))?;
        let lock_path = path.join(LOCK);
        let lock = File::options()
            .write(true)
            .create(true)
            .truncate(false)
            .open(&lock_path)
            .map_err(Error::file(&lock_path))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(Error::DataInUse(path.to_owned())),
            Err(TryLockError::Error(source)) => return Err(Error::File { path: lock_path, source }),
        }
        private::close(path);
        let format = match found {
            Found::Nothing => FORMAT,
            Found::Ours(format) => format,
        };
        let folder = Self { path: path.to_owned(), files, format, _lock: lock };
        let bodies = folder.bodies();
        fs::create_dir_all(&bodies).map_err(Error::file(&bodies))?;
        if found == Found::Nothing {
            folder.mark()?;
        }
        Ok(folder)
    }

    /// Writes the marker with the current format.
    fn mark(&self) -> Result<()> {
        let (marker, new) = (self.path.join(MARKER), self.path.join(NEW_MARKER));
        fs::write(&new, format!("format {FORMAT}\n"))
            .and_then(|()| File::open(&new)?.sync_all())
            .and_then(|()| fs::rename(&new, &marker))
            .and_then(|()| sync_folder(&self.path))
            .map_err(Error::file(&marker))
    }

    /// Returns whether an earlier version wrote the folder and it was not upgraded yet.
    pub(super) fn is_of_format_1(&self) -> bool {
        self.format == 1
    }

    /// Marks the folder as upgraded to the current format.
    pub(super) fn upgraded(&mut self) -> Result<()> {
        self.mark()?;
        self.format = FORMAT;
        Ok(())
    }

    /// Makes the error that a file of the folder is damaged.
    pub(super) fn damaged(&self, file: &Path, offset: Option<u64>, what: impl Into<String>) -> Error {
        Error::Damaged { folder: self.path.clone(), file: file.to_owned(), offset, what: what.into() }
    }

    /// Opens a file of rows, which is created if missing.
    pub(super) fn open(&self, file: &Path) -> io::Result<Arc<dyn Medium>> {
        self.files.open(file)
    }

    /// Renames a file of rows, replacing an existing one. It is on disk on return.
    pub(super) fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.files.rename(from, to)
    }

    /// Removes a file of rows if it exists.
    pub(super) fn remove(&self, file: &Path) -> io::Result<()> {
        self.files.remove(file)
    }

    /// Returns whether a file of rows exists.
    pub(super) fn has(&self, file: &Path) -> bool {
        self.files.exists(file)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn database(&self) -> PathBuf {
        self.path.join("database")
    }

    /// Returns the path of a new database that is to replace the current one.
    pub(super) fn new_database(&self) -> PathBuf {
        self.path.join("database.new")
    }

    /// Returns the path of the sums of the new database.
    pub(super) fn new_sums(&self) -> PathBuf {
        self.path.join("database.new.sums")
    }

    pub(super) fn sums(&self) -> PathBuf {
        self.path.join("database.sums")
    }

    pub(super) fn journal(&self) -> PathBuf {
        self.path.join("journal")
    }

    pub(super) fn bodies(&self) -> PathBuf {
        self.path.join("bodies")
    }
}

#[derive(PartialEq, Eq)]
enum Found {
    Nothing,
    /// A store of this format.
    Ours(u32),
}

/// Examines the folder without changing anything.
fn recognise(path: &Path) -> Result<Found> {
    let not_ours = |what: &str| Err(Error::NotOurs { path: path.to_owned(), what: what.to_owned() });
    let marker = path.join(MARKER);
    match fs::read_to_string(&marker) {
        Ok(text) => {
            return match text.strip_prefix("format ").and_then(|number| number.trim_end().parse().ok()) {
                Some(found) if found > FORMAT => {
                    Err(Error::Newer { path: path.to_owned(), found, known: FORMAT })
                }
                Some(found) => Ok(Found::Ours(found)),
                // A kill during the very first start leaves the file empty.
                None if text.is_empty() => Ok(Found::Nothing),
                None => not_ours(&format!("a file {MARKER} of another kind")),
            };
        }
        Err(missing) if missing.kind() == io::ErrorKind::NotFound => {}
        Err(source) if source.kind() == io::ErrorKind::InvalidData => {
            return not_ours(&format!("a file {MARKER} of another kind"));
        }
        Err(source) => return Err(Error::File { path: marker, source }),
    }
    if MINIO.iter().any(|folder| path.join(folder).exists()) {
        return not_ours("MinIO's data");
    }
    let entries = match fs::read_dir(path) {
        Ok(entries) => entries,
        Err(missing) if missing.kind() == io::ErrorKind::NotFound => return Ok(Found::Nothing),
        Err(source) => return Err(Error::File { path: path.to_owned(), source }),
    };
    for entry in entries {
        let name = entry.map_err(Error::file(path))?.file_name();
        let shown = name.to_string_lossy();
        // A start that was killed before it wrote the marker leaves this.
        let ours =
            shown == "bodies" && fs::read_dir(path.join("bodies")).is_ok_and(|mut all| all.next().is_none());
        if !ours && !HARMLESS.contains(&shown.as_ref()) {
            return not_ours(&format!("`{shown}`"));
        }
    }
    Ok(Found::Nothing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_taken_once() {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("new/data");
        let taken = Folder::take(&data).unwrap();
        assert!(matches!(Folder::take(&data), Err(Error::DataInUse(path)) if path == data));
        drop(taken);
        Folder::take(&data).unwrap();
    }

    #[test]
    fn other_users_do_not_look_into_a_folder_that_is_taken() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o777;
        let set = |path: &Path| fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
        let data = folder.path().join("new");
        drop(Folder::take(&data).unwrap());
        assert_eq!(mode(&data), 0o700);
        // An earlier version created the folder like this.
        set(&data);
        drop(Folder::take(&data).unwrap());
        assert_eq!(mode(&data), 0o700);

        set(folder.path());
        assert!(matches!(Folder::take(folder.path()), Err(Error::NotOurs { .. })));
        assert_eq!(mode(folder.path()), 0o755);
    }

    #[test]
    fn what_is_not_ours_is_named_and_left_alone() {
        for (entry, named) in
            [("objects/.minio.sys", "MinIO's data"), (".minio.sys", "MinIO's data"), ("letters", "`letters`")]
        {
            let folder = tempfile::tempdir().unwrap();
            fs::create_dir_all(folder.path().join(entry)).unwrap();
            let Err(Error::NotOurs { what, .. }) = Folder::take(folder.path()) else {
                panic!("{entry} was taken")
            };
            assert_eq!(what, named);
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something was written");
        }
    }

    #[test]
    fn a_later_format_is_not_touched() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(MARKER), "format 3\n").unwrap();
        assert!(matches!(Folder::take(folder.path()), Err(Error::Newer { found: 3, known: 2, .. })));
        for letter in [&b"a letter\n"[..], &[0xff]] {
            fs::write(folder.path().join(MARKER), letter).unwrap();
            assert!(matches!(Folder::take(folder.path()), Err(Error::NotOurs { .. })));
        }
    }

    #[test]
    fn what_cannot_be_looked_at_is_an_error_with_its_path() {
        let folder = tempfile::tempdir().unwrap();
        let marker = folder.path().join(MARKER);
        fs::create_dir(&marker).unwrap();
        assert!(matches!(Folder::take(folder.path()), Err(Error::File { path, .. }) if path == marker));
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(matches!(Folder::take(&file), Err(Error::File { .. })));
    }

    #[test]
    fn bodies_without_a_marker_are_somebodys() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("bodies")).unwrap();
        fs::write(folder.path().join("bodies/letter"), "").unwrap();
        assert!(
            matches!(Folder::take(folder.path()), Err(Error::NotOurs { what, .. }) if what == "`bodies`")
        );
    }

    #[test]
    fn a_start_that_was_killed_is_begun_anew() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(LOCK), "").unwrap();
        fs::create_dir(folder.path().join("bodies")).unwrap();
        drop(Folder::take(folder.path()).unwrap());
        fs::write(folder.path().join(MARKER), "").unwrap();
        drop(Folder::take(folder.path()).unwrap());
        assert_eq!(fs::read_to_string(folder.path().join(MARKER)).unwrap(), "format 2\n");
    }
}
