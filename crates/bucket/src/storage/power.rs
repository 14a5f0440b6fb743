//! Power cuts at any moment on a disk that keeps any part of the unsynced data: everything acknowledged is there.
//!
//! `RAYFOLD_BUCKET_POWER_CUTS=20000 cargo test -p rayfold-bucket --lib storage::power` runs the long version.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use fastrand::Rng;

use super::folder::Folder;
use super::medium::{Files, Medium};
use super::*;

/// The unit that a disk writes as a whole, in bytes.
const SECTOR: usize = 512;

/// Files that lose unsynced data when the power is cut.
#[derive(Debug, Default)]
struct Disk {
    files: Mutex<BTreeMap<PathBuf, Arc<LossyFile>>>,
    /// The number of operations until the power is cut.
    fuse: Arc<AtomicU64>,
    /// There is no space for the database.
    full: Arc<AtomicBool>,
    syncs: Arc<AtomicU64>,
}

#[derive(Debug)]
struct LossyFile {
    content: Mutex<Content>,
    fuse: Arc<AtomicU64>,
    full: Option<Arc<AtomicBool>>,
    syncs: Arc<AtomicU64>,
}

#[derive(Debug, Default)]
struct Content {
    now: Vec<u8>,
    durable: Vec<u8>,
    unsynced: Vec<Operation>,
}

#[derive(Clone, Debug)]
enum Operation {
    Write(usize, Vec<u8>),
    Length(usize),
}

impl Operation {
    fn apply(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Write(at, written) => {
                let end = at + written.len();
                if bytes.len() < end {
                    bytes.resize(end, 0);
                }
                bytes[*at..end].copy_from_slice(written);
            }
            Self::Length(length) => bytes.resize(*length, 0),
        }
    }

    /// Returns the sectors of a write, each of which may be lost alone.
    fn sectors(self) -> Vec<Self> {
        let Self::Write(at, written) = self else { return vec![self] };
        let mut sectors = Vec::new();
        let mut start = 0;
        while start < written.len() {
            let end = written.len().min((at + start) / SECTOR * SECTOR + SECTOR - at);
            sectors.push(Self::Write(at + start, written[start..end].to_vec()));
            start = end;
        }
        sectors
    }
}

impl LossyFile {
    fn operate(&self) -> io::Result<()> {
        let burn = |left: u64| left.checked_sub(1);
        match self.fuse.fetch_update(Ordering::SeqCst, Ordering::SeqCst, burn) {
            Ok(_) => Ok(()),
            Err(_) => Err(io::Error::other("the power is cut")),
        }
    }

    fn apply(&self, operation: Operation) -> io::Result<()> {
        self.operate()?;
        if self.full.as_ref().is_some_and(|full| full.load(Ordering::SeqCst)) {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let mut content = self.content.lock().unwrap();
        operation.apply(&mut content.now);
        content.unsynced.push(operation);
        Ok(())
    }
}

impl Medium for LossyFile {
    fn len(&self) -> io::Result<u64> {
        Ok(self.content.lock().unwrap().now.len() as u64)
    }

    fn read_at(&self, out: &mut [u8], offset: u64) -> io::Result<usize> {
        let content = self.content.lock().unwrap();
        let rest = content.now.get(offset as usize..).unwrap_or_default();
        let length = rest.len().min(out.len());
        out[..length].copy_from_slice(&rest[..length]);
        Ok(length)
    }

    fn write_all_at(&self, bytes: &[u8], offset: u64) -> io::Result<()> {
        self.apply(Operation::Write(offset as usize, bytes.to_vec()))
    }

    fn set_len(&self, length: u64) -> io::Result<()> {
        self.apply(Operation::Length(length as usize))
    }

    fn sync(&self) -> io::Result<()> {
        self.operate()?;
        self.syncs.fetch_add(1, Ordering::SeqCst);
        let mut content = self.content.lock().unwrap();
        content.unsynced.clear();
        content.durable = content.now.clone();
        Ok(())
    }
}

impl Files for Disk {
    fn open(&self, path: &Path) -> io::Result<Arc<dyn Medium>> {
        let mut files = self.files.lock().unwrap();
        let file = files.entry(path.to_owned()).or_insert_with(|| self.file(path, Content::default()));
        Ok(file.clone())
    }

    fn exists(&self, path: &Path) -> bool {
        self.files.lock().unwrap().contains_key(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut files = self.files.lock().unwrap();
        let file = files.get(from).ok_or(io::ErrorKind::NotFound)?.clone();
        file.operate()?;
        files.remove(from);
        files.insert(to.to_owned(), file);
        Ok(())
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        self.files.lock().unwrap().remove(path);
        Ok(())
    }
}

impl Disk {
    fn new(fuse: u64) -> Arc<Self> {
        Arc::new(Self { fuse: Arc::new(AtomicU64::new(fuse)), ..Self::default() })
    }

    fn file(&self, path: &Path, content: Content) -> Arc<LossyFile> {
        let (fuse, syncs) = (self.fuse.clone(), self.syncs.clone());
        let full = path.file_name().is_some_and(|name| name != "journal").then(|| self.full.clone());
        Arc::new(LossyFile { content: Mutex::new(content), fuse, full, syncs })
    }

    /// Returns the disk after a power cut: each unsynced sector and each unsynced length is there or not.
    fn after_a_cut(&self, rng: &mut Rng) -> Arc<Self> {
        let after = Self::new(u64::MAX);
        for (path, file) in &*self.files.lock().unwrap() {
            let content = file.content.lock().unwrap();
            let mut durable = content.durable.clone();
            let kept = [0, 50, 90, 100][rng.usize(0..4)];
            for operation in content.unsynced.iter().cloned().flat_map(Operation::sectors) {
                if rng.u8(0..100) < kept {
                    operation.apply(&mut durable);
                }
            }
            let content = Content { now: durable.clone(), durable, unsynced: Vec::new() };
            after.files.lock().unwrap().insert(path.clone(), after.file(path, content));
        }
        after
    }

    /// Returns the disk after a kill: everything written is there.
    fn after_a_kill(&self) -> Arc<Self> {
        let after = Self::new(u64::MAX);
        for (path, file) in &*self.files.lock().unwrap() {
            let now = file.content.lock().unwrap().now.clone();
            let content = Content { durable: now.clone(), now, unsynced: Vec::new() };
            after.files.lock().unwrap().insert(path.clone(), after.file(path, content));
        }
        after
    }
}

fn start(folder: &Path, disk: &Arc<Disk>) -> crate::Result<(Storage, Writing)> {
    Storage::of_folder(Folder::take_with(folder, disk.clone())?, 0)
}

type Model = BTreeMap<Vec<u8>, Option<Vec<u8>>>;

/// Changes rows until the power is cut. Returns the last change if it was not acknowledged.
async fn work(
    rng: &mut Rng,
    folder: &Path,
    disk: &Arc<Disk>,
    model: &mut Model,
) -> Option<(Vec<u8>, Option<Vec<u8>>)> {
    loop {
        let (storage, writing) = start(folder, disk).ok()?;
        for _ in 0..rng.usize(1..12) {
            let key = vec![b'k', rng.u8(0..20)];
            let largest = if rng.u8(0..4) == 0 { 12_000 } else { 300 };
            let value = (rng.u8(0..4) > 0)
                .then(|| (0..rng.usize(0..largest)).map(|_| rng.u8(..)).collect::<Vec<u8>>());
            let (row, written) = (key.clone(), value.clone());
            let changed = storage.change(Kind::Grows, move |batch| match &written {
                Some(value) => batch.put(Table::Objects, &row, value),
                None => batch.remove(Table::Objects, &row).map(drop),
            });
            if changed.await.is_err() {
                writing.end();
                return Some((key, value));
            }
            model.insert(key, value);
            if rng.bool() {
                let lazy = [rng.u8(..)];
                let change =
                    storage.change(Kind::Lazy, move |batch| batch.put(Table::Outbox, &lazy, b"sent"));
                let _ = change.await;
            }
        }
        writing.end();
    }
}

#[tokio::test]
async fn a_power_cut_at_any_moment_loses_nothing_that_was_acknowledged() {
    let runs = std::env::var("RAYFOLD_BUCKET_POWER_CUTS").map_or(60, |runs| runs.parse().unwrap());
    let seed =
        std::env::var("RAYFOLD_BUCKET_SEED").map_or_else(|_| fastrand::u64(..), |seed| seed.parse().unwrap());
    println!("seed {seed}");
    let mut rng = Rng::with_seed(seed);
    for run in 0..runs {
        let folder = tempfile::tempdir().unwrap();
        let mut disk = Disk::new(0);
        let mut model = Model::new();
        // Three cuts, one after the other.
        for cut in 0..3 {
            disk.fuse.store(rng.u64(0..400), Ordering::SeqCst);
            let doubtful = work(&mut rng, folder.path(), &disk, &mut model).await;
            disk = disk.after_a_cut(&mut rng);
            let (storage, writing) =
                start(folder.path(), &disk).unwrap_or_else(|error| panic!("run {run}, cut {cut}: {error}"));
            for key in (0..20).map(|number| vec![b'k', number]) {
                let found = storage.snapshot().unwrap().get(Table::Objects, &key).unwrap();
                let expected = model.get(&key).cloned().flatten();
                let may_be =
                    doubtful.as_ref().is_some_and(|(changed, value)| *changed == key && *value == found);
                assert!(found == expected || may_be, "run {run}, cut {cut}: row {key:?}");
                model.insert(key, found);
            }
            writing.end();
        }
    }
}

/// Each batch has exactly one sync.
#[tokio::test]
async fn each_awaited_change_is_synced_once() {
    let folder = tempfile::tempdir().unwrap();
    let disk = Disk::new(u64::MAX);
    let (storage, writing) = start(folder.path(), &disk).unwrap();
    let before = disk.syncs.load(Ordering::SeqCst);
    for number in 0..10 {
        storage.change(Kind::Grows, move |batch| batch.put(Table::Objects, &[number], b"1")).await.unwrap();
        assert_eq!(disk.syncs.load(Ordering::SeqCst), before + u64::from(number) + 1);
        storage.change(Kind::Lazy, move |batch| batch.put(Table::Outbox, &[number], b"1")).await.unwrap();
    }
    assert_eq!(disk.syncs.load(Ordering::SeqCst), before + 10);
    writing.end();
}

/// The journal keeps the changes for which the database has no space.
#[tokio::test]
async fn a_journal_is_not_cleared_while_the_database_finds_no_room() {
    let folder = tempfile::tempdir().unwrap();
    let disk = Disk::new(u64::MAX);
    let (storage, writing) = start(folder.path(), &disk).unwrap();
    storage.change(Kind::Grows, |batch| batch.put(Table::Objects, b"a", &[1; 100_000])).await.unwrap();
    disk.full.store(true, Ordering::SeqCst);
    // The database tries to catch up and cannot.
    writing.end();
    let (storage, writing) = start(folder.path(), &disk.after_a_kill()).unwrap();
    let found = storage.snapshot().unwrap().get(Table::Objects, b"a").unwrap();
    assert!(found.is_some_and(|value| value == [1; 100_000]));
    writing.end();
}
