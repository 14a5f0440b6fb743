//! The place where the files of a project are kept, by their plain names: a folder on disk (`disk`), or the memory of a
//! page that saves them in the browser ([`Memory`]).

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayfold_scene::assets::{FileInfo, Files, Library};

use crate::error::Error;

/// The largest size in bytes of all files of a project together.
pub(crate) const TEXT: u64 = 256 << 20;

/// The files of a project.
pub(crate) trait Storage: Debug + Send + Sync {
    /// Returns the names of all files beside the scripts, in any order.
    fn names(&self) -> Vec<String>;

    /// Returns the size and the tag of a file, or `None` if there is no file of this name.
    fn look(&self, name: &str) -> Option<FileInfo>;

    /// Returns the content of a script or of the settings, or `None` if there is no file of this name.
    ///
    /// # Errors
    /// Fails if the file cannot be read.
    fn read(&self, name: &str) -> Result<Option<Vec<u8>>, Error>;

    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    fn write(&self, name: &str, content: &[u8]) -> Result<(), Error>;

    /// Writes a new file. Returns `false` if there is a file of this name.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    fn create(&self, name: &str, content: &[u8]) -> Result<bool, Error>;

    /// Returns the models and pictures that scripts may name.
    fn library(&self) -> Arc<Library>;
}

/// Files in memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory(Arc<Mutex<Kept>>);

#[derive(Debug, Default)]
struct Kept {
    files: BTreeMap<String, (u64, Arc<Vec<u8>>)>,
    /// The number of writes so far, which is the tag of a file.
    writes: u64,
    /// The names of the files that were written since they were last asked for.
    written: BTreeSet<String>,
    library: Option<Arc<Library>>,
}

impl Memory {
    /// Stores a file from outside.
    pub(crate) fn insert(&self, name: &str, content: Vec<u8>) {
        let mut kept = self.kept();
        kept.writes += 1;
        let tag = kept.writes;
        kept.files.insert(name.into(), (tag, Arc::new(content)));
    }

    /// Returns the files that the project has written since the last call, each with its content.
    pub(crate) fn take_written(&self) -> Vec<(String, Arc<Vec<u8>>)> {
        let mut kept = self.kept();
        let written = std::mem::take(&mut kept.written);
        let file = |name: String| kept.files.get(&name).map(|(_, content)| (name, Arc::clone(content)));
        written.into_iter().filter_map(file).collect()
    }

    /// Returns all files, each with its tag and its content.
    pub(crate) fn all(&self) -> Vec<(String, u64, Arc<Vec<u8>>)> {
        let kept = self.kept();
        kept.files.iter().map(|(name, (tag, content))| (name.clone(), *tag, Arc::clone(content))).collect()
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Storage for Memory {
    fn names(&self) -> Vec<String> {
        self.kept().files.keys().cloned().collect()
    }

    fn look(&self, name: &str) -> Option<FileInfo> {
        let kept = self.kept();
        kept.files.get(name).map(|(tag, content)| FileInfo { bytes: content.len() as u64, tag: *tag })
    }

    fn read(&self, name: &str) -> Result<Option<Vec<u8>>, Error> {
        Ok(self.kept().files.get(name).map(|(_, content)| content.to_vec()))
    }

    fn write(&self, name: &str, content: &[u8]) -> Result<(), Error> {
        self.insert(name, content.into());
        self.kept().written.insert(name.into());
        Ok(())
    }

    fn create(&self, name: &str, content: &[u8]) -> Result<bool, Error> {
        let is_new = Storage::look(self, name).is_none();
        if is_new {
            self.write(name, content)?;
        }
        Ok(is_new)
    }

    fn library(&self) -> Arc<Library> {
        let own = self.clone();
        Arc::clone(self.kept().library.get_or_insert_with(|| Arc::new(Library::new(own))))
    }
}

impl Files for Memory {
    fn names(&self) -> Vec<String> {
        Storage::names(self)
    }

    fn look(&self, name: &str) -> Result<Option<FileInfo>, String> {
        Ok(Storage::look(self, name))
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        let kept = self.kept();
        kept.files.get(name).map(|(_, content)| content.to_vec()).ok_or_else(|| format!("there is no {name}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_told_once_and_nothing_is_created_twice() {
        let memory = Memory::default();
        memory.insert("a.txt", b"old".into());
        assert_eq!(memory.take_written(), [], "what comes from outside is there already");
        let before = Storage::look(&memory, "a.txt");
        memory.write("a.txt", b"new").unwrap();
        assert_ne!(Storage::look(&memory, "a.txt"), before, "the same size, and another tag");
        assert!(!memory.create("a.txt", b"other").unwrap());
        assert_eq!(memory.take_written(), [("a.txt".to_owned(), Arc::new(b"new".to_vec()))]);
        assert_eq!(memory.take_written(), []);
    }
}
