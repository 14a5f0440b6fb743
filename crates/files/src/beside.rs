//! The files beside scripts, which scripts name.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::UNIX_EPOCH;

use rayfold_scene::assets::{FileInfo, Files, Library, limits};

use crate::open;

/// The files of a folder, by their names.
#[derive(Clone, Debug)]
struct Beside {
    folder: PathBuf,
    /// The names that were asked for.
    asked: Arc<Mutex<BTreeSet<String>>>,
}

/// The libraries of this process, by their folders.
type Libraries = BTreeMap<PathBuf, (Arc<Library>, Beside)>;

static LIBRARIES: OnceLock<Mutex<Libraries>> = OnceLock::new();

fn libraries() -> std::sync::MutexGuard<'static, Libraries> {
    let all = LIBRARIES.get_or_init(Mutex::default);
    all.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the models in the folder of a script, each decoded once in a process until its file changes.
pub fn library_beside(script: &Path) -> Arc<Library> {
    let folder = folder_of(script);
    let mut all = libraries();
    let (library, _) = all.entry(folder.clone()).or_insert_with(|| {
        let files = Beside { folder, asked: Arc::default() };
        (Arc::new(Library::new(files.clone())), files)
    });
    library.clone()
}

/// Returns the files in the folder of a script, for a library that also has others. [`named_by_scripts`] does not
/// record requests to them.
pub fn files_beside(script: &Path) -> impl Files + use<> {
    Beside { folder: folder_of(script), asked: Arc::default() }
}

fn folder_of(script: &Path) -> PathBuf {
    match script.parent() {
        Some(folder) if folder != Path::new("") => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Returns the paths of all files that scripts have named in this process, whether they are there or not.
pub fn named_by_scripts() -> BTreeSet<PathBuf> {
    let all = libraries();
    let of = |(_, files): &(Arc<Library>, Beside)| {
        let asked = files.asked.lock().unwrap_or_else(PoisonError::into_inner);
        asked.iter().map(|name| files.folder.join(name)).collect::<Vec<_>>()
    };
    all.values().flat_map(of).collect()
}

impl Beside {
    fn path(&self, name: &str) -> PathBuf {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner).insert(name.into());
        self.folder.join(name)
    }
}

impl Files for Beside {
    fn names(&self) -> Vec<String> {
        let entries = self.folder.read_dir().into_iter().flatten();
        entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect()
    }

    fn look(&self, name: &str) -> Result<Option<FileInfo>, String> {
        let path = self.path(name);
        let metadata = match path.metadata() {
            Ok(metadata) => metadata,
            // No file has a name that is too long.
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::InvalidFilename) => {
                return Ok(None);
            }
            Err(error) => return Err(error.to_string()),
        };
        // Some systems find a file by its name in another letter case.
        let is_other = || {
            let real = path.canonicalize().ok();
            !path.is_symlink() && real.is_some_and(|real| real.file_name().is_none_or(|real| real != name))
        };
        if metadata.is_dir() || is_other() {
            return Ok(None);
        }
        let modified = metadata.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let tag = modified.map_or(0, |time| time.as_nanos() as u64);
        Ok(Some(FileInfo { bytes: metadata.len(), tag }))
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        open(&self.path(name))
            .and_then(|file| file.take(limits::FILE_BYTES + 1).read_to_end(&mut bytes))
            .map_err(|error| error.to_string())?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::assets::Smoothing;

    use super::*;

    #[test]
    fn files_are_those_beside_the_script() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        std::fs::create_dir(folder.path().join("b.obj")).unwrap();
        let library = library_beside(&folder.path().join("1.txt"));
        assert!(Arc::ptr_eq(&library, &library_beside(&folder.path().join("2.txt"))));
        let model = library.model("a.obj", Smoothing::OfFile).unwrap();
        assert!(Arc::ptr_eq(&model, &library.model("a.obj", Smoothing::OfFile).unwrap()));
        let error = |name| library.model(name, Smoothing::OfFile).map(|_| ()).unwrap_err().to_string();
        assert_eq!(error("b.obj"), "there is no file `b.obj` in the script's folder", "a folder");
        assert!(error("c.obj").contains("there is no file"));
        let named = named_by_scripts();
        assert!(["a.obj", "b.obj", "c.obj"].iter().all(|name| named.contains(&folder.path().join(name))));
    }
}
