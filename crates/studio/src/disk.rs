//! The files of a project on disk. Links that lead out of its folder are not followed.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::UNIX_EPOCH;

use rayfold_files::{OutputFile, library_beside};
use rayfold_scene::SETTINGS_FILE;
use rayfold_scene::assets::{FileInfo, Library};

use crate::error::Error;
use crate::storage::{Storage, TEXT};

/// The problem of a link that is not followed.
pub(crate) const LINK: &str = "expected a file of this folder, found a link to another place";

/// The folder of the scripts.
#[derive(Debug)]
pub(crate) struct Disk {
    folder: PathBuf,
    /// The path of each opened script without links, so that a link keeps pointing to the file that is written.
    paths: Mutex<BTreeMap<String, PathBuf>>,
}

impl Disk {
    pub(crate) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), paths: Mutex::default() }
    }

    /// Makes the folder of one script, which is known by this name.
    pub(crate) fn of_script(name: &str, path: &Path) -> Self {
        let real = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let paths = Mutex::new(BTreeMap::from([(name.to_owned(), real)]));
        Self { folder: path.parent().unwrap_or(Path::new("")).to_path_buf(), paths }
    }

    fn path(&self, name: &str) -> PathBuf {
        let path = self.folder.join(name);
        if name == SETTINGS_FILE {
            return path;
        }
        let mut paths = self.paths.lock().unwrap_or_else(PoisonError::into_inner);
        paths.entry(name.into()).or_insert_with(|| path.canonicalize().unwrap_or(path)).clone()
    }
}

impl Storage for Disk {
    fn names(&self) -> Vec<String> {
        let folder = if self.folder == Path::new("") { Path::new(".") } else { &self.folder };
        let names = folder.read_dir().into_iter().flatten();
        names.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect()
    }

    fn look(&self, name: &str) -> Option<FileInfo> {
        let metadata = self.folder.join(name).metadata().ok()?;
        let modified = metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        Some(FileInfo { bytes: metadata.len(), tag: modified.as_nanos() as u64 })
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>, Error> {
        let path = self.path(name);
        if name == SETTINGS_FILE {
            if leads_out(&self.folder, &path) {
                return Err(Error::Settings(format!("{SETTINGS_FILE}: {LINK}")));
            }
        } else if path.is_symlink() {
            // It was without links when it was opened, so a link is that of another program.
            return Err(Error::Read { path, source: io::Error::other(LINK) });
        }
        read(&path)
    }

    fn write(&self, name: &str, content: &[u8]) -> Result<(), Error> {
        Ok(OutputFile::write(self.path(name), content, true)?)
    }

    fn create(&self, name: &str, content: &[u8]) -> Result<bool, Error> {
        match OutputFile::write_new(self.folder.join(name), content) {
            Ok(()) => Ok(true),
            Err(error) if error.is_taken() => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    fn library(&self) -> Arc<Library> {
        library_beside(&self.folder.join("script.txt"))
    }
}

/// Returns whether a path is a link to a file outside of a folder, or to nothing.
pub(crate) fn leads_out(folder: &Path, path: &Path) -> bool {
    let inside = folder.canonicalize();
    let is_inside = |target: PathBuf| inside.as_ref().is_ok_and(|inside| target.starts_with(inside));
    path.is_symlink() && !path.canonicalize().is_ok_and(is_inside)
}

/// Returns the bytes of a file, or `None` if it does not exist.
fn read(path: &Path) -> Result<Option<Vec<u8>>, Error> {
    let failed = |source| Error::Read { path: path.to_path_buf(), source };
    let file = match rayfold_files::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
    };
    let mut text = Vec::new();
    file.take(TEXT + 1).read_to_end(&mut text).map_err(failed)?;
    if text.len() as u64 > TEXT {
        return Err(Error::TooLarge { path: path.to_path_buf(), limit: TEXT });
    }
    Ok(Some(text))
}
