//! The object store is killed while it works. Acknowledged objects exist completely, and their events are delivered.
//!
//! `RAYFOLD_BUCKET_PUTS=10000 cargo test -p rayfold-bucket --test bucket kill::` puts more objects.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::process::Process;
use super::stage::{BUCKET, client, listener, notify};
use aws_sdk_s3::types::{CompletedMultipartUpload, CompletedPart};
use fastrand::Rng;

/// The number of concurrent requests.
const WRITERS: usize = 32;

/// Sizes of both kinds of bodies: rows and files.
const SIZES: [usize; 4] = [0, 100, 20_000, 200_000];

fn puts() -> usize {
    std::env::var("RAYFOLD_BUCKET_PUTS").map_or(600, |puts| puts.parse().unwrap())
}

fn body(number: usize) -> Vec<u8> {
    let size = SIZES[number % SIZES.len()];
    Rng::with_seed(u64::try_from(number).unwrap()).fill_vec(size)
}

trait Fill {
    fn fill_vec(self, size: usize) -> Vec<u8>;
}

impl Fill for Rng {
    fn fill_vec(mut self, size: usize) -> Vec<u8> {
        let mut bytes = vec![0; size];
        self.fill(&mut bytes);
        bytes
    }
}

/// Puts objects until the store is killed. Returns the acknowledged ones.
async fn put_until_killed(process: Process, puts: usize) -> Vec<usize> {
    let client = client(process.address());
    let next = Arc::new(AtomicUsize::new(0));
    let acknowledged = Arc::new(Mutex::new(Vec::new()));
    let writers: Vec<_> = (0..WRITERS)
        .map(|_| {
            let (client, next, acknowledged) = (client.clone(), next.clone(), acknowledged.clone());
            tokio::spawn(async move {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= puts {
                        return;
                    }
                    let put = client.put_object().bucket(BUCKET).key(format!("{number:05}"));
                    if put.body(body(number).into()).send().await.is_err() {
                        return;
                    }
                    acknowledged.lock().unwrap().push(number);
                }
            })
        })
        .collect();
    while acknowledged.lock().unwrap().len() < puts / 2 {
        assert!(!writers.iter().all(|writer| writer.is_finished()), "the writers ended early");
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    process.kill();
    for writer in writers {
        writer.await.unwrap();
    }
    let acknowledged = acknowledged.lock().unwrap().clone();
    assert!(acknowledged.len() < puts, "the kill came too late to be in the middle");
    acknowledged
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_acknowledged_is_there_whole_and_sends_events() {
    let puts = puts();
    let folder = tempfile::tempdir().unwrap();
    let (webhook, heard) = listener(0).await;
    let process = Process::start(folder.path(), Some(&webhook), None);
    let first = client(process.address());
    first.create_bucket().bucket(BUCKET).send().await.unwrap();
    notify(&first).await;
    let acknowledged = put_until_killed(process, puts).await;

    let process = Process::start(folder.path(), Some(&webhook), None);
    let client = client(process.address());
    // An object that was not acknowledged may exist. Then it is complete too.
    let mut there = BTreeMap::new();
    let mut pages = client.list_objects_v2().bucket(BUCKET).into_paginator().send();
    while let Some(page) = pages.next().await {
        for object in page.unwrap().contents() {
            there.insert(object.key().unwrap().to_owned(), object.size().unwrap());
        }
    }
    for number in &acknowledged {
        assert!(
            there.contains_key(&format!("{number:05}")),
            "object {number} was acknowledged and is not there"
        );
    }
    let keys: Vec<_> = there.keys().cloned().collect();
    for some in keys.chunks(WRITERS) {
        let whole = some.iter().map(|key| {
            let get = client.get_object().bucket(BUCKET).key(key);
            async move {
                let got = get.send().await.unwrap().body.collect().await.unwrap().to_vec();
                assert!(got == body(key.parse().unwrap()), "object {key} is not whole");
            }
        });
        futures_util::future::join_all(whole).await;
    }
    for _ in 0..1000 {
        let sent: std::collections::BTreeSet<_> = heard.all().into_iter().map(|(_, key)| key).collect();
        if there.keys().all(|key| sent.contains(key)) {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let sent: std::collections::BTreeSet<_> = heard.all().into_iter().map(|(_, key)| key).collect();
    let unsent: Vec<_> = there.keys().filter(|key| !sent.contains(*key)).collect();
    assert!(unsent.is_empty(), "never sent: {unsent:?}");

    // The files are exactly those of the large objects.
    let large = there.values().filter(|size| **size > 131_072).count();
    let files = || -> usize {
        let folders = std::fs::read_dir(folder.path().join("bodies")).unwrap();
        folders.map(|folder| std::fs::read_dir(folder.unwrap().path()).unwrap().count()).sum()
    };
    for _ in 0..200 {
        if files() == large {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(files(), large, "orphans, or objects without a file");
    println!(
        "{} acknowledged, {} there, {} with an event, of {puts} puts",
        acknowledged.len(),
        there.len(),
        sent.len()
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_kill_while_uploads_complete_leaves_each_done_or_not_begun() {
    let folder = tempfile::tempdir().unwrap();
    let process = Process::start(folder.path(), None, None);
    let first = client(process.address());
    first.create_bucket().bucket(BUCKET).send().await.unwrap();
    let bodies = [vec![1; 5 * 1024 * 1024], b"the end".to_vec()];
    let mut uploads = Vec::new();
    for number in 0..12 {
        let key = format!("film-{number}");
        let begun = first.create_multipart_upload().bucket(BUCKET).key(&key).send().await.unwrap();
        let id = begun.upload_id.unwrap();
        let mut parts = Vec::new();
        for (part, body) in (1..).zip(bodies.clone()) {
            let part_upload = first.upload_part().bucket(BUCKET).key(&key).upload_id(&id).part_number(part);
            let etag = part_upload.body(body.into()).send().await.unwrap().e_tag;
            parts.push(CompletedPart::builder().part_number(part).set_e_tag(etag).build());
        }
        let list = CompletedMultipartUpload::builder().set_parts(Some(parts)).build();
        uploads.push((key, id, list));
    }
    let completing: Vec<_> = uploads
        .iter()
        .map(|(key, id, list)| {
            let complete = first.complete_multipart_upload().bucket(BUCKET).key(key).upload_id(id);
            tokio::spawn(complete.multipart_upload(list.clone()).send())
        })
        .collect();
    tokio::time::sleep(Duration::from_millis(5)).await;
    process.kill();
    let mut acknowledged = Vec::new();
    for (completed, (key, ..)) in completing.into_iter().zip(&uploads) {
        if completed.await.unwrap().is_ok() {
            acknowledged.push(key.clone());
        }
    }
    let process = Process::start(folder.path(), None, None);
    let client = client(process.address());
    for (key, id, list) in uploads {
        let got = client.get_object().bucket(BUCKET).key(&key).send().await;
        if got.is_err() {
            assert!(!acknowledged.contains(&key), "{key} was acknowledged");
            let complete = client.complete_multipart_upload().bucket(BUCKET).key(&key).upload_id(id);
            complete.multipart_upload(list).send().await.unwrap();
        }
        let got = client.get_object().bucket(BUCKET).key(&key).send().await.unwrap();
        assert!(got.body.collect().await.unwrap().to_vec() == bodies.concat(), "{key} is not whole");
    }
}
