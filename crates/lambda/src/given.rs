//! The files beside a script in the bucket, as the parser requests them.

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
    /// Files of earlier drawings, by their names. They replace files that have not been fetched yet, so that their
    /// models are not dropped before it is known whether the files have changed.
    earlier: BTreeMap<String, File>,
    /// The names that were requested, whether the files are given or not.
    asked: BTreeSet<String>,
}

impl Given {
    fn get(&self, name: &str) -> Option<&File> {
        match self.files.get(name) {
            Some(file) => file.as_ref(),
            None => self.earlier.get(name),
        }
    }
}

impl GivenLibrary {
    fn new() -> Self {
        let given = Arc::new(Mutex::new(Given::default()));
        GivenLibrary { library: Library::new(Shared(given.clone())), given }
    }

    /// Returns the names that were requested since the last call.
    pub(crate) fn take_asked(&self) -> Vec<String> {
        std::mem::take(&mut lock(&self.given).asked).into_iter().collect()
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
        given.asked.insert(name.to_owned());
        Ok(given.get(name).map(|File { version, body }| {
            let mut tag = DefaultHasher::new();
            version.as_str().hash(&mut tag);
            FileInfo { bytes: body.len() as u64, tag: tag.finish() }
        }))
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        let file = lock(&self.0).get(name).cloned();
        file.map(|file| file.body.to_vec()).ok_or_else(|| "it is gone".to_owned())
    }
}

/// The files and models that a process keeps from one drawing to the next.
#[derive(Clone, Default)]
pub(crate) struct Kept(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    /// The kept files, by their keys.
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
        self.over(Given { files, ..Given::default() }, then)
    }

    /// Passes a library over these files, and over those of earlier drawings beside them, to `then`.
    pub(crate) fn with_earlier<T>(&self, files: Files, then: impl FnOnce(&GivenLibrary) -> T) -> T {
        let name = |key: &str| key.rsplit('/').next().unwrap_or_default().to_owned();
        let earlier = lock(&self.0).files.iter().map(|(key, file)| (name(key), file.clone())).collect();
        self.over(Given { files, earlier, ..Given::default() }, then)
    }

    fn over<T>(&self, given: Given, then: impl FnOnce(&GivenLibrary) -> T) -> T {
        let library = lock(&self.0).library.take().unwrap_or_else(GivenLibrary::new);
        *lock(&library.given) = given;
        let result = then(&library);
        *lock(&library.given) = Given::default();
        lock(&self.0).library = Some(library);
        result
    }

    pub(crate) fn file(&self, key: &str) -> Option<File> {
        lock(&self.0).files.get(key).cloned()
    }

    /// Keeps a file under its key, or records that there is none. If the files are too large together, the others are
    /// dropped.
    pub(crate) fn keep(&self, key: &str, file: Option<&File>) {
        let mut state = lock(&self.0);
        match file {
            Some(file) => state.files.insert(key.to_owned(), file.clone()),
            None => state.files.remove(key),
        };
        if state.files.values().map(|file| file.body.len()).sum::<usize>() > KEPT_BYTES {
            state.files.retain(|kept, _| kept == key);
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use rayfold_pipeline::store::ETag;
    use rayfold_scene::assets::Smoothing;

    use super::*;

    const CORNER: &str = "mtllib c.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn file(text: &str) -> Option<File> {
        Some(File { version: ETag::new(text), body: text.to_owned().into() })
    }

    /// Works as for a frame: first the names that are missing, then the drawing.
    fn model(kept: &Kept, model: &str) -> Arc<assets::Model> {
        let files = [("c.obj".to_owned(), file(model)), ("c.mtl".to_owned(), None)];
        let files: Files = Arc::new(files.into_iter().collect());
        let asked = kept.with_earlier(Files::default(), |given| {
            let _ = given.library.model("c.obj", Smoothing::OfFile);
            given.take_asked()
        });
        assert!(asked.contains(&"c.obj".to_owned()), "{asked:?}");
        kept.keep("scripts/film/c.obj", files["c.obj"].as_ref());
        kept.with(files, |given| {
            let model = given.library.model("c.obj", Smoothing::OfFile).unwrap();
            assert_eq!(given.take_asked(), ["c.mtl", "c.obj"]);
            model
        })
    }

    #[test]
    fn a_model_is_decoded_once_until_its_file_changes() {
        let kept = Kept::default();
        let first = model(&kept, CORNER);
        assert!(Arc::ptr_eq(&first, &model(&kept, CORNER)));
        let moved = CORNER.replace("v 1 0 0", "v 2 0 0");
        let second = model(&kept, &moved);
        assert!(!Arc::ptr_eq(&first, &second) && second.corners(0)[1].x == 2.0);
    }
}
