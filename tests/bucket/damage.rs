//! Damaged files of the object store: the store detects damage, reports its position, and loses nothing else.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::process::Process;
use super::stage::{BUCKET, Stage, client, failure, options, stage};
use aws_sdk_s3::Client;
use aws_sdk_s3::types::{ChecksumAlgorithm, CompletedMultipartUpload, CompletedPart};
use rayfold_bucket::{Error, Server, check};

/// Larger bodies are files.
const LARGE: usize = 200_000;

fn body(number: usize) -> Vec<u8> {
    let mut bytes = vec![0; if number.is_multiple_of(2) { LARGE } else { 1000 }];
    fastrand::Rng::with_seed(u64::try_from(number).unwrap()).fill(&mut bytes);
    bytes
}

async fn put(client: &Client, number: usize) {
    let put = client.put_object().bucket(BUCKET).key(format!("{number:02}"));
    put.body(body(number).into()).send().await.unwrap();
}

/// Returns a folder with 40 objects whose store was killed.
async fn killed() -> tempfile::TempDir {
    loop {
        let folder = killed_once().await;
        // On a busy machine the database may have received the entries already.
        if fs::metadata(folder.path().join("journal")).unwrap().len() > 20_000 {
            return folder;
        }
    }
}

async fn killed_once() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let process = Process::start(folder.path(), None, None);
    let client = client(process.address());
    client.create_bucket().bucket(BUCKET).send().await.unwrap();
    for number in 0..40 {
        put(&client, number).await;
    }
    process.kill();
    folder
}

/// Returns every file of a folder except the lock, with its bytes.
fn tree(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(tree(&path));
        } else if path.file_name().unwrap() != "lock" {
            files.push((path.clone(), fs::read(path).unwrap()));
        }
    }
    files.sort();
    files
}

fn flip(file: &Path, at: usize) {
    let mut bytes = fs::read(file).unwrap();
    bytes[at] ^= 1;
    fs::write(file, bytes).unwrap();
}

/// Returns the files of large bodies, in the order of their creation.
fn body_files(folder: &Path) -> Vec<PathBuf> {
    tree(&folder.join("bodies")).into_iter().map(|(path, _)| path).collect()
}

async fn refused(folder: &Path) -> (PathBuf, Option<u64>, String) {
    let before = tree(folder);
    let started = Server::start(options(folder, None)).await;
    let Err(error @ Error::Damaged { .. }) = started else { panic!("it started: {started:?}") };
    assert!(tree(folder) == before, "something was changed");
    assert!(error.to_string().contains("rayfold-bucket check --data"), "{error}");
    let shown = error.to_string();
    let Error::Damaged { file, offset, .. } = error else { unreachable!("it is one") };
    (file, offset, shown)
}

fn checked(folder: &Path, repair: bool) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfold-bucket"));
    command.arg("check").arg("--data").arg(folder);
    if repair {
        command.arg("--repair");
    }
    command.output().unwrap()
}

/// Returns the numbers of the objects that exist. Asserts that each is complete.
async fn there(client: &Client) -> BTreeSet<usize> {
    let listed = client.list_objects_v2().bucket(BUCKET).send().await.unwrap();
    let mut there = BTreeSet::new();
    for object in listed.contents() {
        let number = object.key().unwrap().parse().unwrap();
        let got = client.get_object().bucket(BUCKET).key(object.key().unwrap()).send().await.unwrap();
        assert!(got.body.collect().await.unwrap().to_vec() == body(number), "object {number} is not whole");
        there.insert(number);
    }
    there
}

#[tokio::test]
async fn a_flipped_bit_in_the_journal_refuses_the_start_and_deletes_nothing() {
    let folder = killed().await;
    let journal = folder.path().join("journal");
    let length = fs::metadata(&journal).unwrap().len() as usize;
    for at in [5_000, length - 100] {
        flip(&journal, at);
        let (file, offset, shown) = refused(folder.path()).await;
        assert_eq!(file, journal);
        assert!(offset.is_some_and(|offset| offset as usize <= at), "{shown}");
        assert!(shown.contains("entry "), "{shown}");
        flip(&journal, at);
    }
    let kept = fs::read(&journal).unwrap();
    fs::remove_file(&journal).unwrap();
    let (file, _, shown) = refused(folder.path()).await;
    assert!(file == journal && shown.contains("it is missing beside a database or bodies"), "{shown}");
    fs::write(&journal, &kept).unwrap();
    let database = folder.path().join("database");
    let rows = fs::read(&database).unwrap();
    fs::remove_file(&database).unwrap();
    assert_eq!(refused(folder.path()).await.0, database);
    fs::write(&database, rows).unwrap();

    let process = Process::start(folder.path(), None, None);
    assert_eq!(there(&client(process.address())).await.len(), 40);
}

#[tokio::test]
async fn a_damaged_journal_is_repaired_to_all_that_can_be_read() {
    let folder = killed().await;
    let journal = folder.path().join("journal");
    flip(&journal, 5_000);
    let mut start = Command::new(env!("CARGO_BIN_EXE_rayfold-bucket"));
    start
        .env("AWS_ACCESS_KEY_ID", "root")
        .env("AWS_SECRET_ACCESS_KEY", "secret-key")
        .env("RUST_BACKTRACE", "1");
    let refused = start.arg("--data").arg(folder.path()).output().unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!((refused.status.code(), said.lines().count()), (Some(1), 1), "{said}");
    let listed = checked(folder.path(), false);
    let text = String::from_utf8(listed.stdout).unwrap();
    assert_eq!(listed.status.code(), Some(1), "{text}");
    assert!(text.contains("journal: at byte ") && text.contains("entry "), "{text}");
    let damaged = fs::read(&journal).unwrap();
    let large = body_files(folder.path());
    let repaired = checked(folder.path(), true);
    assert!(repaired.status.success(), "{repaired:?}");
    let aside = folder.path().join("set-aside-1");
    assert!(fs::read(aside.join("journal")).unwrap() == damaged);
    assert!(fs::read_to_string(aside.join("list.txt")).unwrap().contains("journal: at byte "));
    // No body is lost: each is in its place or set aside.
    for file in large {
        assert!(file.exists() || aside.join(file.file_name().unwrap()).exists(), "{file:?}");
    }
    let process = Process::start(folder.path(), None, None);
    let client = client(process.address());
    // One batch is lost, here of one object.
    assert_eq!(there(&client).await.len(), 39);
    put(&client, 40).await;
    process.kill();
    let whole = checked(folder.path(), false);
    assert!(whole.status.success(), "{whole:?}");
    assert!(String::from_utf8(whole.stdout).unwrap().starts_with("40 objects"));
}

#[tokio::test]
async fn a_damaged_body_is_never_served_as_whole() {
    let Stage { server, client, folder } = stage().await;
    let sizes = [150_000, 700_000, 3_000_000];
    let sums = [None, Some(ChecksumAlgorithm::Sha256), Some(ChecksumAlgorithm::Crc32)];
    for (size, sum) in sizes.into_iter().zip(sums) {
        let put = client.put_object().bucket(BUCKET).key(size.to_string()).set_checksum_algorithm(sum);
        put.body(vec![7; size].into()).send().await.unwrap();
    }
    // An object in parts. The second part will be damaged.
    let upload = client.create_multipart_upload().bucket(BUCKET).key("parts").send().await.unwrap();
    let mut parts = Vec::new();
    for (number, size) in [(1, 5 * 1024 * 1024), (2, 300_000)] {
        let part = client.upload_part().bucket(BUCKET).key("parts").upload_id(upload.upload_id().unwrap());
        let part = part.part_number(number).body(vec![9; size].into()).send().await.unwrap();
        parts.push(CompletedPart::builder().part_number(number).set_e_tag(part.e_tag).build());
    }
    let list = CompletedMultipartUpload::builder().set_parts(Some(parts)).build();
    let complete = client.complete_multipart_upload().bucket(BUCKET).key("parts").multipart_upload(list);
    complete.upload_id(upload.upload_id().unwrap()).send().await.unwrap();

    let files = body_files(folder.path());
    let whole: Vec<_> = files.iter().map(|file| fs::read(file).unwrap()).collect();
    let read = async |key: &str| {
        let got = client.get_object().bucket(BUCKET).key(key).send().await;
        match got {
            // The error occurred before anything was sent.
            Err(error) if error.raw_response().is_some() => Err(failure::<(), _>(Err(error)).1),
            Err(_) => Err("broke off".to_owned()),
            Ok(got) => {
                got.body.collect().await.map(|bytes| bytes.to_vec().len()).map_err(|_| "broke off".to_owned())
            }
        }
    };
    let of_key = [("150000", 0), ("700000", 1), ("3000000", 2), ("parts", 4)];
    for (key, file) in of_key {
        let bytes = &whole[file];
        for at in [0, bytes.len() / 2, bytes.len() - 1] {
            flip(&files[file], at);
            assert_eq!(read(key).await, Err("broke off".to_owned()), "{key}, byte {at}");
            flip(&files[file], at);
        }
        for changed in [&bytes[..bytes.len() - 1], &[&bytes[..], b"x"].concat()] {
            fs::write(&files[file], changed).unwrap();
            let broken = read(key).await;
            assert!(broken.is_err(), "{key} with {} bytes: {broken:?}", changed.len());
        }
        fs::remove_file(&files[file]).unwrap();
        let missing = read(key).await;
        assert_eq!(
            missing,
            Err(if key == "parts" { "broke off" } else { "InternalError" }.to_owned()),
            "{key}"
        );
        // It cannot be copied either.
        let copy = client.copy_object().bucket(BUCKET).key("copy").copy_source(format!("{BUCKET}/{key}"));
        assert_eq!(failure(copy.send().await), (500, "InternalError".into()), "{key}");
        fs::write(&files[file], bytes).unwrap();
        assert!(read(key).await.is_ok(), "{key}");
    }
    flip(&files[1], 5);
    // A range is not verified, but a part that is requested as a whole is.
    let part = client.get_object().bucket(BUCKET).key("parts").part_number(2).send().await.unwrap();
    assert_eq!(part.body.collect().await.unwrap().to_vec().len(), 300_000);
    flip(&files[4], 5);
    // The connection may end before the client has read the head.
    if let Ok(part) = client.get_object().bucket(BUCKET).key("parts").part_number(2).send().await {
        part.body.collect().await.unwrap_err();
    }
    server.stop().await;

    let report = check(folder.path(), false).unwrap();
    let places: Vec<_> = report.damages.iter().map(|damage| damage.place.as_str()).collect();
    assert_eq!(places, ["films/700000", "films/parts"], "{report:?}");
    assert!(report.damages[1].what.starts_with("part 2: "), "{report:?}");
    let report = check(folder.path(), true).unwrap();
    let aside = report.set_aside.unwrap();
    // Both parts: the object is lost.
    for file in [1, 3, 4] {
        assert!(
            !files[file].exists() && aside.join(files[file].file_name().unwrap()).exists(),
            "file {file}"
        );
    }
    let server = Server::start(options(folder.path(), None)).await.unwrap();
    let listed =
        super::stage::client(server.address()).list_objects_v2().bucket(BUCKET).send().await.unwrap();
    let keys: Vec<_> = listed.contents().iter().map(|object| object.key().unwrap()).collect();
    assert_eq!(keys, ["150000", "3000000"]);
    server.stop().await;
}

/// Any bits of the database flip: a request gets a correct reply or a clear error, and a repair keeps the rest.
#[tokio::test]
async fn thirty_flipped_bits_in_the_database_end_in_clear_errors() {
    let folder = killed().await;
    // The database has all entries, the journal none.
    let server = Server::start(options(folder.path(), None)).await.unwrap();
    server.stop().await;
    let undamaged = tree(folder.path());
    let seed = fastrand::u64(..);
    println!("seed {seed}");
    let mut rng = fastrand::Rng::with_seed(seed);
    let database = folder.path().join("database");
    for round in 0..4 {
        let mut bytes = fs::read(&database).unwrap();
        for _ in 0..if round == 0 { 30 } else { 2 } {
            let at = rng.usize(0..bytes.len());
            bytes[at] ^= 1 << rng.u8(0..8);
        }
        fs::write(&database, &bytes).unwrap();
        match Server::start(options(folder.path(), None)).await {
            Err(error) => assert!(error.to_string().contains("database is damaged"), "{error}"),
            Ok(server) => {
                let client = client(server.address());
                let mut missing = 0;
                for number in 0..40 {
                    match client.get_object().bucket(BUCKET).key(format!("{number:02}")).send().await {
                        Ok(got) => {
                            assert!(got.body.collect().await.unwrap().to_vec() == body(number), "{number}")
                        }
                        Err(error) => {
                            missing += 1;
                            let error = failure::<(), _>(Err(error));
                            assert_eq!(error, (500, "InternalError".into()), "object {number}");
                        }
                    }
                }
                println!("{missing} objects could not be read");
                server.stop().await;
            }
        }
        let report = check(folder.path(), true).unwrap();
        println!("{} damages, {} objects left", report.damages.len(), report.objects);
        if report.set_aside.is_some() {
            let server = Server::start(options(folder.path(), None)).await.unwrap();
            // The bucket may be among the lost entries.
            let _ = client(server.address()).create_bucket().bucket(BUCKET).send().await;
            assert_eq!(there(&client(server.address())).await.len() as u64, report.objects);
            server.stop().await;
            assert_eq!(check(folder.path(), false).unwrap().damages, []);
        }
        // Restores the original state.
        for entry in fs::read_dir(folder.path()).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { fs::remove_dir_all(path).unwrap() } else { fs::remove_file(path).unwrap() }
        }
        for (path, bytes) in &undamaged {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }
}

/// A large store needs little space after its objects were deleted.
#[tokio::test]
async fn a_database_that_has_shrunk_by_half_is_compacted() {
    let Stage { server, client, folder } = stage().await;
    let puts = (0..120).map(|number| {
        let put = client.put_object().bucket(BUCKET).key(format!("{number:03}"));
        put.body(vec![u8::try_from(number).unwrap(); 100_000].into()).send()
    });
    for put in futures_util::future::join_all(puts).await {
        put.unwrap();
    }
    let bytes = || fs::metadata(folder.path().join("database")).unwrap().len();
    let wait = async |below: u64| {
        for _ in 0..500 {
            if bytes() < below {
                return;
            }
            tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        }
        panic!("{} bytes", bytes());
    };
    tokio::time::sleep(std::time::Duration::from_millis(1500)).await;
    let full = bytes();
    assert!(full > 12_000_000, "{full} bytes");
    let held = client.get_object().bucket(BUCKET).key("007").send().await.unwrap();
    for number in 0..110 {
        client.delete_object().bucket(BUCKET).key(format!("{number:03}")).send().await.unwrap();
    }
    wait(full / 4).await;
    println!("{full} bytes before, {} after", bytes());
    assert!(held.body.collect().await.unwrap().to_vec() == vec![7; 100_000], "who reads goes on reading");
    let read = async |client: &Client| {
        for number in 110..120 {
            let got = client.get_object().bucket(BUCKET).key(format!("{number:03}")).send().await.unwrap();
            assert!(
                got.body.collect().await.unwrap().to_vec() == vec![u8::try_from(number).unwrap(); 100_000]
            );
        }
    };
    read(&client).await;
    server.stop().await;
    let server = Server::start(options(folder.path(), None)).await.unwrap();
    read(&super::stage::client(server.address())).await;
    server.stop().await;
    assert_eq!(check(folder.path(), false).unwrap().damages, []);
}
