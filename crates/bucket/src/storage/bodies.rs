//! Bodies in files: too large for the database, each under an id that is never used again.
//!
//! A body is written and synced before a row refers to it, and its file is deleted after the last row that did. A
//! kill in between leaves files without a row; [`Bodies::collect`] removes those of earlier runs. A reader pins a
//! body first: a pinned file outlives its row until the reader is done.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::private;

/// The bits of an id for the counter. The number of the run is above them.
const COUNTER_BITS: u32 = 40;

/// The bits of an id for the files of a folder: few enough to list at once, enough that a batch
/// seldom spans several folders.
const FOLDER_BITS: u32 = 12;

/// The id of a body, which is unique in the store for all time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct BodyId(u64);

impl BodyId {
    /// Returns the key of the body's row.
    pub(crate) fn key(self) -> [u8; 8] {
        self.0.to_be_bytes()
    }

    /// Returns the run that assigned the id.
    pub(super) fn run(self) -> u64 {
        self.0 >> COUNTER_BITS
    }

    /// Reads the id from the key of a row.
    pub(crate) fn of_key(key: &[u8]) -> Option<Self> {
        key.try_into().ok().map(|key| Self(u64::from_be_bytes(key)))
    }
}

/// The folder of the files, and the source of ids.
#[derive(Debug)]
pub(crate) struct Bodies {
    folder: PathBuf,
    run: u64,
    next: AtomicU64,
    pins: Mutex<BTreeMap<BodyId, Pinned>>,
}

/// The number of readers of a body, and whether its row is gone.
#[derive(Debug, Default)]
struct Pinned {
    readers: usize,
    doomed: bool,
}

/// A guard that keeps bodies until it is dropped.
#[derive(Debug)]
pub(crate) struct Pins {
    bodies: Arc<Bodies>,
    ids: Vec<BodyId>,
}

/// The file of a body without a row. Dropping it deletes the file.
#[derive(Debug)]
pub(crate) struct NewBody {
    id: BodyId,
    path: PathBuf,
    file: Option<File>,
    kept: bool,
}

impl Bodies {
    pub(super) fn new(folder: PathBuf, run: u64) -> Self {
        Self { folder, run, next: AtomicU64::new(0), pins: Mutex::default() }
    }

    /// Returns a new id.
    pub(crate) fn id(&self) -> BodyId {
        BodyId(self.run << COUNTER_BITS | self.next.fetch_add(1, Ordering::Relaxed))
    }

    /// Returns the path of a body's file.
    pub(crate) fn path(&self, id: BodyId) -> PathBuf {
        self.folder.join(format!("{:013x}", id.0 >> FOLDER_BITS)).join(format!("{:016x}", id.0))
    }

    /// Creates a new, empty file.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub(crate) fn create(&self) -> io::Result<NewBody> {
        let id = self.id();
        let path = self.path(id);
        let create = || File::options().write(true).create_new(true).mode(private::FILE).open(&path);
        let file = match create() {
            Err(missing) if missing.kind() == io::ErrorKind::NotFound => {
                match fs::create_dir(parent(&path)) {
                    Err(failed) if failed.kind() != io::ErrorKind::AlreadyExists => return Err(failed),
                    _ => sync_folder(&self.folder)?,
                }
                create()?
            }
            other => other?,
        };
        Ok(NewBody { id, path, file: Some(file), kept: false })
    }

    /// Keeps these files while the pins live, if they still exist. They do if a row that refers to them is
    /// read after this call.
    pub(crate) fn pin(self: &Arc<Self>, ids: Vec<BodyId>) -> Pins {
        let mut pins = self.pins();
        for id in &ids {
            pins.entry(*id).or_default().readers += 1;
        }
        drop(pins);
        Pins { bodies: self.clone(), ids }
    }

    fn pins(&self) -> MutexGuard<'_, BTreeMap<BodyId, Pinned>> {
        self.pins.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes a file to which no row refers, as soon as it has no reader. If the removal fails, the
    /// next start removes it.
    pub(super) fn remove(&self, id: BodyId) {
        if let Some(pinned) = self.pins().get_mut(&id) {
            pinned.doomed = true;
            return;
        }
        let _ = fs::remove_file(self.path(id));
    }

    /// Lists every file with its id, or `None` if its name is not that of a body.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub(crate) fn files(&self) -> io::Result<Vec<(PathBuf, Option<BodyId>)>> {
        let mut files = Vec::new();
        for folder in fs::read_dir(&self.folder)? {
            for file in fs::read_dir(folder?.path())? {
                let path = file?.path();
                let name = path.file_name().and_then(|name| name.to_str());
                let id = name.and_then(|name| u64::from_str_radix(name, 16).ok()).map(BodyId);
                files.push((path, id));
            }
        }
        files.sort();
        Ok(files)
    }

    /// Removes the files of earlier runs to which no row refers. Returns their number.
    ///
    /// # Errors
    /// Returns the error of the system, or of `belongs`.
    pub(super) fn collect<E: From<io::Error>>(
        &self,
        mut belongs: impl FnMut(BodyId) -> Result<bool, E>,
    ) -> Result<u64, E> {
        let mut removed = 0;
        for folder in fs::read_dir(&self.folder)? {
            let folder = folder?.path();
            let mut left = false;
            for file in fs::read_dir(&folder)? {
                let file = file?;
                let name = file.file_name();
                let id = name.to_str().and_then(|name| u64::from_str_radix(name, 16).ok());
                match id.map(BodyId) {
                    Some(id) if id.0 >> COUNTER_BITS < self.run && !belongs(id)? => {
                        fs::remove_file(file.path())?;
                        removed += 1;
                    }
                    _ => left = true,
                }
            }
            let of_earlier_run = folder
                .file_name()
                .and_then(|name| u64::from_str_radix(name.to_str()?, 16).ok())
                .is_some_and(|number| number >> (COUNTER_BITS - FOLDER_BITS) < self.run);
            if !left && of_earlier_run {
                // This fails if the folder is not empty after all, which is harmless.
                let _ = fs::remove_dir(&folder);
            }
        }
        Ok(removed)
    }
}

impl NewBody {
    pub(crate) fn id(&self) -> BodyId {
        self.id
    }

    /// Appends bytes to the body.
    ///
    /// # Errors
    /// Returns the error of the system, such as a full disk.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match &mut self.file {
            Some(file) => file.write_all(bytes),
            None => Err(io::Error::other("the body is finished")),
        }
    }

    /// Syncs the content to disk. The batch that adopts the body syncs its name.
    ///
    /// # Errors
    /// Returns the error of the system.
    pub(crate) fn finish(&mut self) -> io::Result<()> {
        self.file.take().map_or(Ok(()), |file| file.sync_all())
    }

    pub(super) fn keep(&mut self) {
        self.kept = true;
    }
}

impl Drop for Pins {
    fn drop(&mut self) {
        let mut pins = self.bodies.pins();
        for id in &self.ids {
            let Some(pinned) = pins.get_mut(id) else { continue };
            pinned.readers -= 1;
            if pinned.readers == 0 && pins.remove(id).is_some_and(|pinned| pinned.doomed) {
                let _ = fs::remove_file(self.bodies.path(*id));
            }
        }
    }
}

impl Drop for NewBody {
    fn drop(&mut self) {
        if !self.kept {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Syncs the names of these bodies to disk.
///
/// # Errors
/// Returns the error of the system.
pub(super) fn sync_names(bodies: &[NewBody]) -> io::Result<()> {
    let folders: BTreeSet<&Path> = bodies.iter().map(|body| parent(&body.path)).collect();
    folders.into_iter().try_for_each(sync_folder)
}

fn parent(path: &Path) -> &Path {
    path.parent().unwrap_or(path)
}

pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(bodies: &Bodies) -> BodyId {
        let mut body = bodies.create().unwrap();
        body.write(b"content").unwrap();
        body.finish().unwrap();
        body.keep();
        body.id()
    }

    #[test]
    fn a_body_that_nobody_adopts_goes() {
        let folder = tempfile::tempdir().unwrap();
        let bodies = Bodies::new(folder.path().to_owned(), 1);
        let body = bodies.create().unwrap();
        let path = bodies.path(body.id());
        assert!(path.exists());
        drop(body);
        assert!(!path.exists());
    }

    #[test]
    fn a_body_that_is_read_outlives_its_row() {
        let folder = tempfile::tempdir().unwrap();
        let bodies = Arc::new(Bodies::new(folder.path().to_owned(), 1));
        let id = written(&bodies);
        let (first, second) = (bodies.pin(vec![id]), bodies.pin(vec![id]));
        drop(first);
        bodies.remove(id);
        assert!(bodies.path(id).exists());
        drop(second);
        assert!(!bodies.path(id).exists());
        let kept = written(&bodies);
        drop(bodies.pin(vec![kept]));
        assert!(bodies.path(kept).exists());
    }

    #[test]
    fn orphans_of_earlier_runs_are_collected_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let first = Bodies::new(folder.path().to_owned(), 1);
        let (orphan, owned) = (written(&first), written(&first));
        let second = Bodies::new(folder.path().to_owned(), 2);
        let fresh = written(&second);
        // Another request is about to create a file in this folder.
        let empty = second.path(BodyId(second.id().0 + (1 << (COUNTER_BITS - FOLDER_BITS))));
        let empty = empty.parent().unwrap();
        fs::create_dir_all(empty).unwrap();
        let removed = second.collect(|id| Ok::<_, io::Error>(id == owned)).unwrap();
        assert_eq!(removed, 1);
        assert!(empty.exists(), "an empty folder of this run");
        assert!(!first.path(orphan).exists() && first.path(owned).exists() && second.path(fresh).exists());
        let removed = second.collect(|_| Ok::<_, io::Error>(false)).unwrap();
        assert_eq!(removed, 1);
        assert!(!first.path(owned).parent().unwrap().exists(), "the empty folder of an earlier run");
        assert!(second.path(fresh).exists());
    }
}
