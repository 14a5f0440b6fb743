//! Memory and disk: memory does not grow with an object, and a full disk causes an error and no damage.
//!
//! `RAYFOLD_BUCKET_MIB=4096 cargo test -p rayfold-bucket --test bucket room::` streams more.

use std::io::Write;

use super::process::Process;
use super::stage::{BUCKET, client, failure};
use aws_sdk_s3::primitives::ByteStream;

const MIB: usize = 1024 * 1024;

/// Much less than the object, much more than a store needs besides it.
const MEMORY: u64 = 64 * 1024 * 1024;

#[tokio::test]
async fn memory_does_not_grow_with_an_object() {
    let mib = std::env::var("RAYFOLD_BUCKET_MIB").map_or(200, |mib| mib.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let process = Process::start(&folder.path().join("data"), None, None);
    let client = client(process.address());
    client.create_bucket().bucket(BUCKET).send().await.unwrap();
    let path = folder.path().join("body");
    let mut file = std::fs::File::create(&path).unwrap();
    for number in 0..mib {
        file.write_all(&vec![u8::try_from(number % 256).unwrap(); MIB]).unwrap();
    }
    let before = process.peak_memory();
    let body = ByteStream::from_path(&path).await.unwrap();
    client.put_object().bucket(BUCKET).key("large").body(body).send().await.unwrap();
    let copy = client.copy_object().bucket(BUCKET).key("copy").copy_source(format!("{BUCKET}/large"));
    copy.send().await.unwrap();
    let mut got = client.get_object().bucket(BUCKET).key("copy").send().await.unwrap().body;
    let mut length = 0;
    while let Some(bytes) = got.next().await {
        let bytes = bytes.unwrap();
        assert!(usize::from(bytes[0]) == length / MIB % 256);
        length += bytes.len();
    }
    assert_eq!(length, mib * MIB);
    let grown = process.peak_memory() - before;
    println!("{mib} MiB put, copied and got: {} MiB of memory more than before", grown / MIB as u64);
    assert!(grown < MEMORY, "{grown} bytes");
}

#[tokio::test]
async fn a_full_disk_is_an_error_and_no_damage() {
    let folder = tempfile::tempdir().unwrap();
    // No file can exceed 6 MiB. The database, the journal and large bodies all reach this limit.
    let process = Process::start(folder.path(), None, Some(6 * 1024));
    let store = client(process.address());
    store.create_bucket().bucket(BUCKET).send().await.unwrap();
    let mut kept = Vec::new();
    let mut refused = 0;
    let put = |key: String, size: usize| {
        let first = key.as_bytes()[0];
        store.put_object().bucket(BUCKET).key(key).body(vec![first; size].into()).send()
    };
    let large = put("large".into(), 8 * MIB).await;
    assert_eq!(failure(large), (507, "InsufficientStorage".into()));
    for number in 0..120 {
        let key = format!("{number:03}");
        match put(key.clone(), 100_000).await {
            Ok(_) => kept.push(key),
            full @ Err(_) => {
                assert_eq!(failure(full), (507, "InsufficientStorage".into()), "{key}");
                refused += 1;
            }
        }
    }
    assert!(refused > 0 && !kept.is_empty(), "{refused} refused, {} kept", kept.len());
    for key in &kept {
        let got = store.get_object().bucket(BUCKET).key(key).send().await.unwrap();
        assert!(got.body.collect().await.unwrap().to_vec() == vec![key.as_bytes()[0]; 100_000], "{key}");
    }
    process.kill();

    // With free space, every acknowledged object exists, and writes succeed.
    let process = Process::start(folder.path(), None, None);
    let store = client(process.address());
    let listed = store.list_objects_v2().bucket(BUCKET).send().await.unwrap();
    let keys: Vec<_> = listed.contents().iter().map(|object| object.key().unwrap().to_owned()).collect();
    assert!(kept.iter().all(|key| keys.contains(key)), "{} of {} are there", keys.len(), kept.len());
    for key in &keys {
        let got = store.get_object().bucket(BUCKET).key(key).send().await.unwrap();
        assert_eq!(got.body.collect().await.unwrap().to_vec().len(), 100_000, "{key}");
    }
    let put = store.put_object().bucket(BUCKET).key("after").body(vec![1; 8 * MIB].into());
    put.send().await.unwrap();
}
