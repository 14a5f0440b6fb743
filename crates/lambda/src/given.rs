//! The files beside a script in the bucket, as the parser asks for them.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayfold_pipeline::render::{File, Files};
use rayfold_scene::assets::{self, FileInfo, Library};

/// The bytes of files that a process keeps for the next drawing.
const KEPT_BYTES: usize = 512 << 20;

/// A library over the files of a drawing. It keeps the models of earlier drawings whose files are the same.
pub(crate) struct GivenLibrary {
    pub(crate) library: Library,
    given: Arc<Mutex<Given>>,
}

#[derive(Default)]
struct Given {
    files: Files,
    /// The names that were asked for and not given.
    missing: BTreeSet<String>,
}

impl GivenLibrary {
    fn new() -> Self {
        let given = Arc::new(Mutex::new(Given::default()));
        GivenLibrary { library: Library::new(Shared(given.clone())), given }
    }

    /// Returns the names that were asked for and not given, since the last call.
    pub(crate) fn take_missing(&self) -> Vec<String> {
        std::mem::take(&mut lock(&self.given).missing).into_iter().collect()
    }
}

struct Shared(Arc<Mutex<Given>>);

impl assets::Files for Shared {
    fn names(&self) -> Vec<String> {
        let given = lock(&self.0);
        given.files.iter().filter(|(_, file)| file.is_some()).map(|(name, _)| name.clone()).collect()
    }

    fn look(&self, name: &str) -> Result<Option<FileInfo>, String> {
        let mut given = lock(&self.0);
        let Some(file) = given.files.get(name).cloned() else {
            given.missing.insert(name.to_owned());
            return Ok(None);
        };
        Ok(file.map(|File { version, body }| {
            let mut tag = DefaultHasher::new();
            version.as_str().hash(&mut tag);
            FileInfo { bytes: body.len() as u64, tag: tag.finish() }
        }))
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        let file = lock(&self.0).files.get(name).cloned().flatten();
        file.map(|file| file.body.to_vec()).ok_or_else(|| "it is gone".to_owned())
    }
}

/// What a process keeps from one drawing to the next.
#[derive(Clone, Default)]
pub(crate) struct Kept(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    /// By their keys.
    files: BTreeMap<String, File>,
    /// The library of the last drawing. A drawing takes it, so that another one at the same time makes its own.
    library: Option<GivenLibrary>,
}

impl std::fmt::Debug for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Kept").finish_non_exhaustive()
    }
}

impl Kept {
    /// Passes a library over these files to `then`.
    pub(crate) fn with<T>(&self, files: Files, then: impl FnOnce(&GivenLibrary) -> T) -> T {
        let library = lock(&self.0).library.take().unwrap_or_else(GivenLibrary::new);
        lock(&library.given).files = files;
        let result = then(&library);
        lock(&library.given).files = Files::default();
        lock(&self.0).library = Some(library);
        result
    }

    pub(crate) fn file(&self, key: &str) -> Option<File> {
        lock(&self.0).files.get(key).cloned()
    }

    /// Keeps a file. If the files are too large together, the others are dropped.
    pub(crate) fn keep(&self, key: &str, file: &File) {
        let mut state = lock(&self.0);
        state.files.insert(key.to_owned(), file.clone());
        if state.files.values().map(|file| file.body.len()).sum::<usize>() > KEPT_BYTES {
            state.files.retain(|kept, _| kept == key);
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
