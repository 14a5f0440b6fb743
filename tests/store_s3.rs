//! The S3 store against S3 servers other than AWS: the built-in one, and MinIO if it is installed.

#![allow(clippy::print_stderr, reason = "says what a test that failed was doing")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

#[path = "stage/stores.rs"]
mod stores;

use std::time::Duration;

use aws_sdk_s3::config::{BehaviorVersion, Credentials, Region};
use aws_smithy_http_client::Builder as HttpBuilder;
use bytes::{Bytes, BytesMut};
use rayfold_local::{S3Server, StoreKind, any_port};
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::store::{Connection, ListRequest, Patch, PutOptions, S3Store, Store, Upload};
use rayfold_pipeline::{
    Animator, Clock, Encoding, Error, Invocation, Policy, Randomness, SystemClock, Unfit, assemble,
};
use rayfold_scene::{AnimationSettings, Container};
use rayfold_simulation::conformance;
use stores::on_every_store;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

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

/// A joiner of frames that are parts of an upload by themselves.
struct Joiner;

struct Joined(BytesMut);

impl Animator for Joiner {
    type Encoding = Joined;

    fn begin(&self, _: &AnimationSettings, _: Container, _: bool) -> Result<Joined, Reason> {
        Ok(Joined(BytesMut::new()))
    }

    async fn resume(&self, _: &AnimationSettings, _: Container, state: Bytes) -> Result<Joined, Reason> {
        Ok(Joined(state.into()))
    }
}

impl Encoding for Joined {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        Ok(std::mem::replace(&mut self.0, frame.into()).freeze())
    }

    async fn finish(self) -> Result<(Bytes, Option<Patch>), Reason> {
        Ok((self.0.freeze(), None))
    }

    async fn suspend(self) -> Result<Bytes, Reason> {
        Ok(self.0.freeze())
    }
}

/// The invocations that send the parts of one upload run one after the other, each with its own client.
#[tokio::test]
async fn an_animation_of_many_parts_is_assembled_by_several_invocations() {
    on_every_store(async |store| {
        let (server, _data) = started(store).await;
        let store = || S3Store::at(&server.connection(), "pieces");
        store().create_bucket().await.unwrap();
        let frames: Vec<Bytes> = (1..=6_u8).map(|number| vec![number; 5_000_000].into()).collect();
        let settings = Bytes::from(format!(r#"{{"frames": {}}}"#, frames.len()));
        store().put("scripts/film/animation.json", settings, PutOptions::always()).await.unwrap();
        for (number, frame) in (1..).zip(&frames) {
            let script = format!("scripts/film/{number}.txt");
            let version = store().put(&script, script.clone().into(), PutOptions::always()).await.unwrap();
            let key = format!("frames/film/{number}@{version}-p1.png");
            store().put(&key, frame.clone(), PutOptions::always()).await.unwrap();
        }
        let (random, policy) = (Randomness::seeded(1), Policy { spare_frames: 1_000_000, ..Policy::new(1) });
        let claim = format!("assemblies/film/1-{}.json", "0".repeat(32));
        let mut left = Vec::new();
        loop {
            let (store, id) = (store(), format!("invocation {}", left.len()));
            let deadline = SystemClock.now().after(Duration::from_secs(900));
            let invocation = Invocation::new(&store, &SystemClock, &random, &policy, &id).until(deadline);
            match assemble(&invocation, &Joiner, &claim).await.unwrap().unwrap().left_after {
                Some(frames) => left.push(frames),
                None => break,
            }
        }
        assert_eq!(left, [1, 2, 3, 4, 5]);
        assert!(
            store().get("animations/film.gif").await.unwrap().body == frames.concat(),
            "the parts in their order"
        );
        assert_eq!(unfinished(&server, "pieces", "animations/film.gif").await, 0);
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
            assert!(upload.finish(None).await.unwrap_err().is_conflict(), "{options:?}");
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

/// Returns the number of uploads of a key that were begun and neither completed nor aborted.
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
async fn refusals_differ_from_trouble() {
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

/// A full disk was reported as "no answer from the store".
#[tokio::test]
async fn a_store_without_room_says_so() {
    let listener = tokio::net::TcpListener::bind(any_port()).await.unwrap();
    let endpoint = format!("http://{}", listener.local_addr().unwrap());
    let server = tokio::spawn(async move {
        loop {
            let (mut stream, _) = listener.accept().await.unwrap();
            let mut request = [0; 4096];
            let _ = stream.read(&mut request).await.unwrap();
            let body = "<Error><Code>InsufficientStorage</Code><Message>the disk is full</Message></Error>";
            let head =
                "HTTP/1.1 507 Insufficient Storage\r\nConnection: close\r\nContent-Type: application/xml";
            let answer = format!("{head}\r\nContent-Length: {}\r\n\r\n{body}", body.len());
            stream.write_all(answer.as_bytes()).await.unwrap();
        }
    });
    let (access_key, secret_key) = ("key".to_owned(), "secret".to_owned());
    let region = "us-east-1".to_owned();
    let connection = Connection { endpoint, region, access_key, secret_key, session_token: None };
    let store = S3Store::at(&connection, "films");
    let error = store.put("scripts/film/1.txt", "x".into(), PutOptions::always()).await.unwrap_err();
    assert!(matches!(error, Error::Full { .. }) && error.is_retryable(), "{error:?}");
    assert_eq!(error.to_string(), "the store has no room: scripts/film/1.txt");
    let source = std::error::Error::source(&error).unwrap().to_string();
    assert_eq!(source, "InsufficientStorage: the disk is full");
    server.abort();
}
