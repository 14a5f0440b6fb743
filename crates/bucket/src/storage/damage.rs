//! Random histories whose files are damaged at random. After a start either everything acknowledged is there, byte
//! for byte, or the start, or the read of a damaged row, is refused. Nothing is ever deleted.
//!
//! `RAYFOLD_BUCKET_DAMAGES=20000 cargo test -p rayfold-bucket --lib storage::damage` runs the long version.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use fastrand::Rng;

use super::*;
use crate::Error;

/// The number of damages per history.
const PER_HISTORY: usize = 40;

/// The files of a folder, by name.
type Files = BTreeMap<&'static str, Vec<u8>>;

type Model = BTreeMap<Vec<u8>, Vec<u8>>;

fn files(folder: &Path) -> Files {
    let names = ["rayfold-bucket", "database", "database.sums", "journal"];
    names.into_iter().map(|name| (name, fs::read(folder.join(name)).unwrap())).collect()
}

fn write(folder: &Path, files: &Files) {
    for (name, bytes) in files {
        fs::write(folder.join(name), bytes).unwrap();
    }
}

/// Returns the files that a kill leaves after random changes, and the rows that they must hold.
async fn history(rng: &mut Rng) -> (Files, Model) {
    let folder = tempfile::tempdir().unwrap();
    let mut model = Model::new();
    for _ in 0..rng.usize(0..3) {
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        changes(rng, &storage, &mut model).await;
        writing.end();
    }
    let (storage, writing) = Storage::open(folder.path()).unwrap();
    changes(rng, &storage, &mut model).await;
    let files = files(folder.path());
    writing.end();
    (files, model)
}

async fn changes(rng: &mut Rng, storage: &Storage, model: &mut Model) {
    for _ in 0..rng.usize(0..40) {
        let key = format!("films\0{:02}", rng.u8(0..60)).into_bytes();
        let largest = if rng.u8(0..5) == 0 { 20_000 } else { 500 };
        let value: Vec<u8> = (0..rng.usize(0..largest)).map(|_| rng.u8(..)).collect();
        if rng.u8(0..4) == 0 {
            model.remove(&key);
            storage.change(Kind::Shrinks, move |batch| batch.remove(Table::Objects, &key)).await.unwrap();
        } else {
            model.insert(key.clone(), value.clone());
            storage.change(Kind::Grows, move |batch| batch.put(Table::Objects, &key, &value)).await.unwrap();
        }
        if rng.u8(0..4) == 0 {
            let lazy = [rng.u8(..); 8];
            storage.change(Kind::Lazy, move |batch| batch.put(Table::Outbox, &lazy, b"sent")).await.unwrap();
        }
    }
}

/// Damages one file. Returns a description.
fn damage(rng: &mut Rng, files: &mut Files) -> String {
    let name = ["journal", "journal", "database", "database", "database.sums"][rng.usize(0..5)];
    let Some(bytes) = files.get_mut(name) else { return String::new() };
    let (at, length) = (rng.usize(0..bytes.len().max(1)), bytes.len());
    match rng.u8(0..10) {
        _ if length == 0 => "nothing: the file is empty".to_owned(),
        0..5 => {
            let bit = rng.u8(0..8);
            bytes[at] ^= 1 << bit;
            format!("{name}: bit {bit} of byte {at} flipped")
        }
        5 => {
            bytes.truncate(at);
            format!("{name}: cut at {at} of {length}")
        }
        6 => {
            let end = length.min(at + rng.usize(1..5000));
            bytes[at..end].fill(0);
            format!("{name}: zeros in {at}..{end}")
        }
        7 => {
            let end = length.min(at + rng.usize(1..5000));
            let copied = bytes[at..end].to_vec();
            bytes.splice(end..end, copied);
            format!("{name}: {at}..{end} twice")
        }
        8 => {
            let end = length.min(at + rng.usize(1..5000));
            bytes.drain(at..end);
            format!("{name}: {at}..{end} is missing")
        }
        _ => {
            files.remove(name);
            format!("{name}: missing")
        }
    }
}

/// Returns whether everything could be read. Everything that could must be right.
fn judge(storage: &Storage, model: &Model) -> bool {
    let mut whole = true;
    for number in 0..60 {
        let key = format!("films\0{number:02}").into_bytes();
        match storage.snapshot().map(|rows| rows.get(Table::Objects, &key)) {
            Ok(Ok(value)) => {
                assert!(value.as_ref() == model.get(&key), "row {number} is another one, or gone")
            }
            Ok(Err(_)) | Err(_) => whole = false,
        }
    }
    let Ok(rows) = storage.snapshot() else { return false };
    let Ok(listed) = rows.from(Table::Objects, b"") else { return false };
    match listed.collect::<Result<Model, _>>() {
        Ok(listed) => {
            assert!(listed == *model, "{} rows are listed instead of {}", listed.len(), model.len())
        }
        Err(_) => whole = false,
    }
    whole
}

#[tokio::test]
async fn damage_is_noticed_wherever_it_is_and_deletes_nothing() {
    let runs = std::env::var("RAYFOLD_BUCKET_DAMAGES").map_or(160, |runs| runs.parse().unwrap());
    let seed =
        std::env::var("RAYFOLD_BUCKET_SEED").map_or_else(|_| fastrand::u64(..), |seed| seed.parse().unwrap());
    println!("seed {seed}");
    let mut rng = Rng::with_seed(seed);
    let (mut refused, mut partly, mut whole) = (0, 0, 0);
    for _ in 0..runs / PER_HISTORY {
        let (undamaged, model) = history(&mut rng).await;
        for _ in 0..PER_HISTORY {
            let mut files = undamaged.clone();
            let how = damage(&mut rng, &mut files);
            let folder = tempfile::tempdir().unwrap();
            write(folder.path(), &files);
            println!("{how}");
            match Storage::open(folder.path()) {
                Err(Error::Damaged { what, .. }) => {
                    refused += 1;
                    for (name, bytes) in &files {
                        assert!(
                            fs::read(folder.path().join(name)).unwrap() == *bytes,
                            "{how}: {name} was changed"
                        );
                    }
                    // Nothing is lost: after the damaged file is restored, everything is there.
                    let name = how.split(':').next().unwrap();
                    fs::write(folder.path().join(name), &undamaged[name]).unwrap();
                    let opened = Storage::open(folder.path());
                    let (storage, writing) =
                        opened.unwrap_or_else(|error| panic!("{how}, {what}, then {error}"));
                    assert!(judge(&storage, &model), "{how}");
                    writing.end();
                }
                Err(other) => panic!("{how}: {other}"),
                Ok((storage, writing)) => {
                    match judge(&storage, &model) {
                        true => whole += 1,
                        false => partly += 1,
                    }
                    // Whatever the outcome, the writing thread must survive.
                    let change = storage
                        .change(Kind::Grows, |batch| batch.put(Table::Objects, b"films\099", b""))
                        .await;
                    assert!(!matches!(change, Err(Unavailable::Ending)), "{how}: {change:?}");
                    writing.end();
                }
            }
        }
    }
    println!("{refused} starts refused, {partly} with reads refused, {whole} whole");
    assert!(refused > 0 && whole > 0);
}

/// A database that mistook an older root for the newest would read pages that were reused.
#[tokio::test]
async fn no_flipped_bit_of_the_databases_header_hides_rows() {
    let every = std::env::var("RAYFOLD_BUCKET_DAMAGES").map_or(29, |_| 1);
    let mut rng = Rng::with_seed(7);
    let (mut undamaged, model) = loop {
        let (files, model) = history(&mut rng).await;
        if model.len() > 10 {
            break (files, model);
        }
    };
    // The second case is after a stop: the journal has nothing that the database lacks.
    for stopped in [false, true] {
        if stopped {
            let folder = tempfile::tempdir().unwrap();
            write(folder.path(), &undamaged);
            Storage::open(folder.path()).unwrap().1.end();
            undamaged = files(folder.path());
        }
        let (mut refused, mut opened) = (0, 0);
        for bit in (0..320 * 8).step_by(every) {
            let mut files = undamaged.clone();
            files.get_mut("database").unwrap()[bit / 8] ^= 1 << (bit % 8);
            let folder = tempfile::tempdir().unwrap();
            write(folder.path(), &files);
            match Storage::open(folder.path()) {
                Err(Error::Damaged { .. }) => refused += 1,
                Err(other) => panic!("bit {bit}: {other}"),
                Ok((storage, writing)) => {
                    opened += 1;
                    judge(&storage, &model);
                    writing.end();
                }
            }
        }
        println!("stopped: {stopped}; {refused} starts refused, {opened} not");
    }
}
