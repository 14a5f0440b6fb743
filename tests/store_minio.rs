//! The S3 store against a real S3: MinIO.

#![allow(clippy::print_stderr, reason = "installing MinIO takes minutes and says so")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

use bytes::Bytes;
use rayfold_local::connection;
use rayfold_local::minio::{Minio, any_port, find_or_install};
use rayfold_pipeline::Error;
use rayfold_pipeline::store::{Connection, ListRequest, PutOptions, S3Store, Store, Upload, conformance};

async fn minio() -> (Minio, tempfile::TempDir) {
    let data = tempfile::tempdir().unwrap();
    let binary = find_or_install(&mut |line| eprintln!("{line}")).unwrap();
    (Minio::start(&binary, data.path(), any_port(), None).await.unwrap(), data)
}

#[tokio::test]
async fn the_s3_store_conforms_on_minio() {
    let (minio, _data) = minio().await;
    let store = S3Store::at(&connection(&minio), "suite");
    store.create_bucket().await.unwrap();
    store.create_bucket().await.expect("a bucket that is there and ours is fine");
    store.check().await.unwrap();
    conformance::check(&store, "suite").await;
}

#[tokio::test]
async fn an_upload_that_may_not_finish_leaves_no_parts() {
    let (minio, _data) = minio().await;
    let store = S3Store::at(&connection(&minio), "uploads");
    store.create_bucket().await.unwrap();
    let first = store.put("gif", Bytes::from_static(b"first"), PutOptions::always()).await.unwrap();
    for options in [PutOptions::if_absent(), PutOptions::if_match(first.clone())] {
        let mut upload = store.upload("gif", options.clone()).await.unwrap();
        upload.write(Bytes::from(vec![1; 20 << 20])).await.unwrap();
        store.put("gif", Bytes::from_static(b"second"), PutOptions::always()).await.unwrap();
        assert!(upload.finish().await.unwrap_err().is_conflict(), "{options:?}");
        assert_eq!(store.get("gif").await.unwrap().body, "second");
    }
    assert_eq!(unfinished(&minio), 0);
    let mut dropped = store.upload("gif", PutOptions::always()).await.unwrap();
    dropped.write(Bytes::from(vec![1; 20 << 20])).await.unwrap();
    drop(dropped);
    assert_eq!(unfinished(&minio), 1, "the test sees what is left when an upload is not aborted");
}

/// MinIO keeps each unfinished upload in a folder of its own.
fn unfinished(minio: &Minio) -> usize {
    let folder = minio.data().join("objects/.minio.sys/multipart");
    let Ok(keys) = std::fs::read_dir(folder) else { return 0 };
    keys.map(|key| std::fs::read_dir(key.unwrap().path()).unwrap().count()).sum()
}

#[tokio::test]
async fn refusals_are_told_apart_from_trouble() {
    let (minio, _data) = minio().await;
    let right = connection(&minio);
    let reason = |error: Error| {
        let source = std::error::Error::source(&error).map(ToString::to_string).unwrap_or_default();
        (matches!(error, Error::Refused { .. }), error.is_retryable(), source)
    };

    let missing = S3Store::at(&right, "missing");
    for error in [
        missing.get("key").await.unwrap_err(),
        missing.put("key", Bytes::new(), PutOptions::always()).await.unwrap_err(),
        missing.list(ListRequest::all("")).await.unwrap_err(),
        missing.check().await.unwrap_err(),
    ] {
        let (refused, _, source) = reason(error);
        assert!(refused && source.contains("NoSuchBucket"), "{source}");
    }

    let wrong = Connection { secret_key: "wrong".into(), ..right.clone() };
    let (refused, _, source) = reason(S3Store::at(&wrong, "any").check().await.unwrap_err());
    assert!(refused && source.contains("SignatureDoesNotMatch"), "{source}");

    let nowhere = Connection { endpoint: "http://127.0.0.1:9".into(), ..right };
    let (refused, retryable, source) = reason(S3Store::at(&nowhere, "any").check().await.unwrap_err());
    assert!(!refused && retryable, "{source}");
}
