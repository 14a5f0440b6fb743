//! The S3 store against S3 servers that are none of AWS's: the one built in, and MinIO where there is one.

#![allow(clippy::print_stderr, reason = "says what a test that failed was doing")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

#[path = "stage/stores.rs"]
mod stores;

use aws_sdk_s3::config::{BehaviorVersion, Credentials, Region};
use aws_smithy_http_client::Builder as HttpBuilder;
use bytes::Bytes;
use rayfold_local::{S3Server, StoreKind, any_port};
use rayfold_pipeline::Error;
use rayfold_pipeline::store::{Connection, ListRequest, PutOptions, S3Store, Store, Upload, conformance};
use stores::on_every_store;

async fn started(store: StoreKind) -> (S3Server, tempfile::TempDir) {
    let data = tempfile::tempdir().unwrap();
    let mut say = |line: &str| eprintln!("{line}");
    let server = S3Server::start(store, data.path(), any_port(), None, &mut say).await.unwrap();
    (server, data)
}

#[tokio::test]
async fn the_s3_store_conforms() {
    on_every_store(async |store| {
        let (server, _data) = started(store).await;
        let store = S3Store::at(&server.connection(), "suite");
        store.create_bucket().await.unwrap();
        store.create_bucket().await.expect("a bucket that is there and ours is fine");
        store.check().await.unwrap();
        conformance::check(&store, "suite").await;
    })
    .await;
}

#[tokio::test]
async fn an_upload_that_may_not_finish_leaves_no_parts() {
    on_every_store(async |store| {
        let (server, _data) = started(store).await;
        let store = S3Store::at(&server.connection(), "uploads");
        store.create_bucket().await.unwrap();
        let first = store.put("gif", Bytes::from_static(b"first"), PutOptions::always()).await.unwrap();
        for options in [PutOptions::if_absent(), PutOptions::if_match(first.clone())] {
            let mut upload = store.upload("gif", options.clone()).await.unwrap();
            upload.write(Bytes::from(vec![1; 20 << 20])).await.unwrap();
            store.put("gif", Bytes::from_static(b"second"), PutOptions::always()).await.unwrap();
            assert!(upload.finish().await.unwrap_err().is_conflict(), "{options:?}");
            assert_eq!(store.get("gif").await.unwrap().body, "second");
        }
        assert_eq!(unfinished(&server, "uploads", "gif").await, 0);
        let mut dropped = store.upload("gif", PutOptions::always()).await.unwrap();
        dropped.write(Bytes::from(vec![1; 20 << 20])).await.unwrap();
        drop(dropped);
        assert_eq!(
            unfinished(&server, "uploads", "gif").await,
            1,
            "the test sees what is left when an upload is not aborted"
        );
    })
    .await;
}

/// Uploads of a key that were begun and neither finished nor given up.
async fn unfinished(server: &S3Server, bucket: &str, key: &str) -> usize {
    let owner = server.connection();
    let config = aws_sdk_s3::Config::builder()
        .behavior_version(BehaviorVersion::latest())
        .region(Region::new(owner.region))
        .endpoint_url(&owner.endpoint)
        .force_path_style(true)
        .credentials_provider(Credentials::new(owner.access_key, owner.secret_key, None, None, "owner"))
        .http_client(HttpBuilder::new().build_http())
        .build();
    let list = aws_sdk_s3::Client::from_conf(config).list_multipart_uploads().bucket(bucket).prefix(key);
    list.send().await.unwrap().uploads().len()
}

#[tokio::test]
async fn refusals_are_told_apart_from_trouble() {
    on_every_store(async |store| {
        let (server, _data) = started(store).await;
        let right = server.connection();
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
    })
    .await;
}
