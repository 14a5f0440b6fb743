//! Files that are not on disk: meshes and pictures that were passed as arrays.
//!
//! Such a file is named by the hash of its content. So equal arrays in two frames are one file on disk, in a bucket and
//! in memory, where it is decoded once. A script finds these files like those in its folder, by the same trait. Its
//! picture is the same before and after the files are written beside it.
//!
//! Invariants: a file is in memory while a scene or a material uses it. The latest few, within a bound, stay longer.
//! The content of a name never changes.

use std::collections::{BTreeMap, VecDeque};
use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayfold_client::{Content as Sent, File};
use rayfold_files::{OutputFile, files_beside};
use rayfold_scene::assets::{FileInfo, Files, Library, file_name};
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::error::{guarded, os_error};
use crate::place::quoted;

/// The latest files, which stay although nothing uses them: a frame may be drawn and discarded before the next one is
/// made.
const LATEST: usize = 8;
const LATEST_BYTES: usize = 64 << 20;

/// The number of bytes of a hash in a name.
const BYTES_OF_HASH: usize = 10;

/// The number of bytes that are hashed in one piece. Another number would give other names.
const PIECE: usize = 1 << 20;

/// A file that was made of arrays.
#[pyclass(frozen, from_py_object, module = "rayfold._rayfold")]
#[derive(Clone, Debug)]
pub(crate) struct Given(Arc<Content>);

/// The files of a script, by their names.
pub(crate) type Givens = BTreeMap<String, Given>;

#[derive(Debug)]
struct Content {
    name: String,
    bytes: Vec<u8>,
}

#[derive(Default)]
struct Known {
    all: BTreeMap<String, Weak<Content>>,
    latest: VecDeque<Arc<Content>>,
    /// The names of files that are gone. Libraries drop them at the next request for a library. They do not do so when
    /// the last owner of a file is dropped, because that may be a library at work.
    gone: Vec<String>,
}

static KNOWN: Mutex<Known> =
    Mutex::new(Known { all: BTreeMap::new(), latest: VecDeque::new(), gone: Vec::new() });

/// The libraries of scripts with such files, by their folders.
static LIBRARIES: Mutex<BTreeMap<PathBuf, Arc<Library>>> = Mutex::new(BTreeMap::new());

fn known() -> MutexGuard<'static, Known> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Content {
    fn drop(&mut self) {
        let mut known = known();
        // Another of this name may have come meanwhile.
        if known.all.get(&self.name).is_some_and(|other| other.strong_count() == 0) {
            known.all.remove(&self.name);
            known.gone.push(std::mem::take(&mut self.name));
        }
    }
}

impl Given {
    /// Makes a file, or returns an existing one with this content. `kind` begins its name, `ending` ends it.
    pub(crate) fn new(kind: &str, ending: &str, bytes: Vec<u8>) -> Self {
        let name = format!("{kind}-{}{ending}", hash(&bytes));
        Self::of(name, bytes)
    }

    fn of(name: String, bytes: Vec<u8>) -> Self {
        let mut known = known();
        let there = known.all.get(&name).and_then(Weak::upgrade);
        let content = there.unwrap_or_else(|| {
            let content = Arc::new(Content { name: name.clone(), bytes });
            known.all.insert(name, Arc::downgrade(&content));
            content
        });
        known.latest.retain(|other| !Arc::ptr_eq(other, &content));
        known.latest.push_back(content.clone());
        let mut dropped = Vec::new();
        while known.latest.len() > LATEST || known.latest.len() > 1 && bytes_of(&known.latest) > LATEST_BYTES
        {
            dropped.extend(known.latest.pop_front());
        }
        // Their end takes the lock.
        drop(known);
        drop(dropped);
        Self(content)
    }

    pub(crate) fn name_of(&self) -> &str {
        &self.0.name
    }

    /// Returns the file in the form that the client uploads.
    pub(crate) fn file(&self) -> Result<File, rayfold_client::Error> {
        File::new(Sent::Bytes(self.0.bytes.clone().into()))
    }

    /// Returns the files that a script names and that are in memory, but not in its folder.
    pub(crate) fn in_text(text: &str, script: &Path) -> Givens {
        let folder = script.parent().unwrap_or(Path::new(""));
        let mut found = Givens::new();
        for word in text.split('"').filter(|word| word.contains('-') && word.len() < 80) {
            let there = known().all.get(word).and_then(Weak::upgrade);
            if let Some(content) = there
                && !folder.join(word).exists()
            {
                found.insert(word.to_owned(), Self(content));
            }
        }
        found
    }
}

/// Returns the digits of a content's hash for its name. It is the hash of the hashes of its pieces, which are computed
/// in parallel.
fn hash(bytes: &[u8]) -> String {
    let pieces: Vec<_> = bytes.par_chunks(PIECE).map(Sha256::digest).collect();
    let mut whole = Sha256::new();
    pieces.iter().for_each(|piece| whole.update(piece));
    let mut digits = String::with_capacity(2 * BYTES_OF_HASH);
    for byte in &whole.finalize()[..BYTES_OF_HASH] {
        let _ = write!(digits, "{byte:02x}");
    }
    digits
}

fn bytes_of(all: &VecDeque<Arc<Content>>) -> usize {
    all.iter().map(|content| content.bytes.len()).sum()
}

#[pymethods]
impl Given {
    /// Makes the file of a name and its content, which another process had.
    #[new]
    fn again(name: String, bytes: &Bound<'_, PyBytes>) -> PyResult<Self> {
        let bytes = bytes.as_bytes().to_vec();
        let digits = hash(&bytes);
        let is_its_name = name.split(['-', '.']).nth(1) == Some(&digits) && file_name(&name).is_ok();
        if !is_its_name {
            let message = format!("the file {} has another content than its name says", quoted(&name));
            return Err(PyValueError::new_err(message));
        }
        Ok(Self::of(name, bytes))
    }

    #[getter]
    fn name(&self) -> &str {
        self.name_of()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyAny>, (String, Bound<'py, PyBytes>)) {
        (py.get_type::<Self>().into_any(), (self.0.name.clone(), PyBytes::new(py, &self.0.bytes)))
    }

    /// Writes the file into a folder, if it is not there already.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| {
            guarded(|| {
                let path = folder.join(&self.0.name);
                if std::fs::read(&path).is_ok_and(|bytes| bytes == self.0.bytes) {
                    return Ok(());
                }
                OutputFile::write(path, &self.0.bytes, false).map_err(os_error)
            })
        })?
    }
}

/// A source that looks for files in memory first, and then in a folder.
struct Both<F> {
    folder: F,
}

impl<F: Files> Files for Both<F> {
    fn names(&self) -> Vec<String> {
        self.folder.names()
    }

    fn look(&self, name: &str) -> Result<Option<FileInfo>, String> {
        let Some(content) = content(name) else { return self.folder.look(name) };
        // The content of a name never changes.
        let mut tag = DefaultHasher::new();
        name.hash(&mut tag);
        Ok(Some(FileInfo { bytes: content.bytes.len() as u64, tag: tag.finish() }))
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        content(name).map_or_else(|| self.folder.read(name), |content| Ok(content.bytes.clone()))
    }
}

fn content(name: &str) -> Option<Arc<Content>> {
    known().all.get(name)?.upgrade()
}

/// Returns the library for a script with such files.
pub(crate) fn library_with_given(script: &Path) -> Arc<Library> {
    let folder = script.parent().unwrap_or(Path::new("")).to_path_buf();
    let gone = std::mem::take(&mut known().gone);
    let mut all = LIBRARIES.lock().unwrap_or_else(PoisonError::into_inner);
    let new = || Arc::new(Library::new(Both { folder: files_beside(script) }));
    let library = all.entry(folder).or_insert_with(new).clone();
    for name in gone {
        all.values().for_each(|library| library.forget(&name));
    }
    library
}
