//! The roles' policies, enforced by the store: every operation on a key of every kind, by every role. Operations that
//! the protocol needs are allowed, all others are denied. The end-to-end tests, which use the same documents, show that
//! the allowed operations suffice.

#![allow(clippy::print_stderr, reason = "says what a test that failed was doing")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

mod stage;

use std::collections::BTreeSet;

use bytes::Bytes;
use rayfold_local::{S3Server, StoreKind, any_port};
use rayfold_pipeline::store::{ListRequest, PutOptions, S3Store, Store, Upload};
use rayfold_pipeline::{Error, Result};

use stage::role::assume;
use stage::stores::on_every_store_with_roles;

const BUCKET: &str = "films";

/// One key of each kind, and some keys outside the pipeline.
const KEYS: [&str; 31] = [
    "scripts/a/1.txt",
    "scripts/a/animation.json",
    "parts/a/1@v-p1/2.json",
    "frames/a/1@v-p1.png",
    "frames/a/1@v-p1/2.png",
    "frames/a/1@v-p1.error.json",
    "frames/a/1@v-p1/2.error.json",
    "frames/a/1@v-p1.split-3",
    "frames/a/1@v-p1.files-1-of-1-0123456789-",
    "frames/a/1@v-p1.taken",
    "frames/a/1@v-p1.waits.json",
    "parts/a/1@v-p1/2-of-3.band-0.json",
    "frames/a/1@v-p1.cut-3",
    "frames/a/1@v-p1.2-of-3.band",
    "frames/a/1@v-p1/2.cut-3",
    "frames/a/1@v-p1/2.2-of-3.band",
    "frames/a/1@v-p1.begun-2",
    "frames/a/1@v-p1/2.begun-2",
    "frames/a/@assembler.json",
    "frames/a/@sweep.json",
    "frames/a/@output.webp",
    "manifests/a.json",
    "manifests/a.json~0123456789abcdef",
    "assemblies/a/1-g.json",
    "retries/a/1@v-p1/1",
    "checkpoints/a.state",
    "animations/a.gif",
    "animations/a.webp",
    "films/a.gif",
    "frames.json",
    "animation.json",
];

const PREFIXES: [&str; 11] = [
    "scripts/",
    "scripts/a/",
    "parts/a/",
    "frames/a/",
    "manifests/",
    "assemblies/a/",
    "retries/a/",
    "checkpoints/",
    "animations/",
    "films/",
    "frames",
];

/// The functions, and the kinds of users.
const ROLES: [&str; 5] = ["render", "assemble", "viewer", "uploader", "operator"];

/// Returns the permissions of a role by operation. All others must be denied.
fn allowed(role: &str) -> Vec<(&'static str, Vec<&'static str>)> {
    let keys = |starts: &[&str]| -> Vec<&'static str> {
        KEYS.into_iter()
            .chain(PREFIXES)
            .filter(|key| starts.iter().any(|start| key.starts_with(start)))
            .collect()
    };
    let errors = ["frames/a/1@v-p1.error.json", "frames/a/1@v-p1/2.error.json"];
    let receipts = || keys(&["frames/"]).into_iter().filter(|key| !key.ends_with('/'));
    // All except the assembler's own.
    let own = ["frames/a/@assembler.json", "frames/a/@sweep.json", "frames/a/@output.webp"];
    let results: Vec<&str> = receipts().filter(|key| !own.contains(key)).collect();
    let frames: Vec<&str> = receipts().filter(|key| key.ends_with(".png")).collect();
    let bands = ["frames/a/1@v-p1.2-of-3.band", "frames/a/1@v-p1/2.2-of-3.band"];
    match role {
        "render" => vec![
            ("list", keys(&["scripts/", "parts/", "frames/"])),
            ("read", [keys(&["scripts/", "parts/", "manifests/"]), errors.to_vec(), bands.to_vec()].concat()),
            ("put", [keys(&["parts/", "manifests/", "assemblies/"]), results.clone()].concat()),
            ("upload", [keys(&["parts/", "manifests/", "assemblies/"]), results].concat()),
            ("delete", vec![]),
        ],
        "assemble" => {
            let written = keys(&["manifests/", "animations/", "retries/", "assemblies/", "checkpoints/"]);
            let written = [written, errors.to_vec(), own.to_vec()].concat();
            vec![
                ("list", keys(&["scripts/", "parts/", "frames/", "manifests/", "retries/"])),
                ("read", keys(&["scripts/", "frames/", "manifests/", "checkpoints/", "animations/"])),
                ("put", written.clone()),
                ("upload", written),
                ("delete", keys(&["parts/", "frames/", "manifests/a.json~", "checkpoints/", "animations/"])),
            ]
        }
        "viewer" => vec![
            ("list", keys(&["scripts/", "manifests/"])),
            ("read", [keys(&["manifests/", "animations/"]), frames].concat()),
            ("put", vec![]),
            ("upload", vec![]),
            ("delete", vec![]),
        ],
        "uploader" => vec![
            ("list", keys(&["scripts/", "manifests/"])),
            ("read", [keys(&["scripts/", "manifests/", "animations/"]), frames].concat()),
            ("put", keys(&["scripts/"])),
            ("upload", keys(&["scripts/"])),
            ("delete", keys(&["scripts/"])),
        ],
        "operator" => {
            let written = keys(&["scripts/", "retries/", "manifests/", "assemblies/"]);
            let made =
                ["parts/", "frames/", "manifests/", "assemblies/", "retries/", "checkpoints/", "animations/"];
            let ours = [&["scripts/"], &made[..]].concat();
            vec![
                ("list", PREFIXES.to_vec()),
                ("read", keys(&["scripts/", "frames/", "manifests/", "animations/"])),
                ("put", written.clone()),
                ("upload", written),
                ("delete", keys(&ours)),
            ]
        }
        other => panic!("no role {other}"),
    }
}

async fn attempt(store: &S3Store, operation: &str, key: &str) -> Result<()> {
    match operation {
        "list" => store.list(ListRequest::all(key)).await.map(drop),
        "read" => {
            let read = store.get(key).await.map(drop);
            let head = store.head(key).await.map(drop);
            assert_eq!(
                read.is_ok(),
                head.is_ok(),
                "{key}: reading and asking for the size need the same right"
            );
            read
        }
        "put" => store.put(key, Bytes::from_static(b"new"), PutOptions::always()).await.map(drop),
        "upload" => {
            let mut upload = store.upload(key, PutOptions::always()).await?;
            upload.write(Bytes::from(vec![7; 20 << 20])).await?;
            upload.finish(None).await.map(drop)
        }
        "delete" => store.delete(key).await,
        other => panic!("no operation {other}"),
    }
}

async fn started(store: StoreKind) -> (S3Server, tempfile::TempDir) {
    let data = tempfile::tempdir().unwrap();
    let mut say = |line: &str| eprintln!("{line}");
    let server = S3Server::start(store, data.path(), any_port(), None, &mut say).await.unwrap();
    (server, data)
}

async fn filled(server: &S3Server, bucket: &str) -> S3Store {
    let owner = S3Store::at(&server.connection(), bucket);
    owner.create_bucket().await.unwrap();
    for key in KEYS {
        owner.put(key, Bytes::from_static(b"old"), PutOptions::always()).await.unwrap();
    }
    owner
}

#[tokio::test]
async fn a_role_may_do_what_it_needs_and_nothing_else() {
    on_every_store_with_roles(async |store| {
        let (server, _data) = started(store).await;
        let owner = filled(&server, BUCKET).await;
        for role in ROLES {
            let of_role = S3Store::at(&assume(&server, role, BUCKET).await, BUCKET);
            for (operation, keys) in allowed(role) {
                let keys: BTreeSet<&str> = keys.into_iter().collect();
                let tried: &[&str] = if operation == "list" { &PREFIXES } else { &KEYS };
                for key in tried {
                    let outcome = attempt(&of_role, operation, key).await;
                    match outcome {
                        Ok(()) => assert!(keys.contains(key), "{role} may {operation} {key}"),
                        Err(error) => {
                            assert!(is_denial(&error), "{role}, {operation} {key}: {error:?}");
                            assert!(!keys.contains(key), "{role} may not {operation} {key}");
                        }
                    }
                    let body = if operation == "list" {
                        Ok("old".into())
                    } else {
                        owner.get(key).await.map(|o| o.body)
                    };
                    let is_old = body.is_ok_and(|body| body == "old");
                    let writes = matches!(operation, "put" | "upload" | "delete");
                    assert_eq!(
                        is_old,
                        !(writes && keys.contains(key)),
                        "{role}, {operation} {key}: what is there now"
                    );
                    if !is_old {
                        owner.put(key, Bytes::from_static(b"old"), PutOptions::always()).await.unwrap();
                    }
                }
            }
        }
    })
    .await;
}

#[tokio::test]
async fn a_role_ends_at_its_bucket() {
    on_every_store_with_roles(async |store| {
        let (server, _data) = started(store).await;
        filled(&server, BUCKET).await;
        let other = filled(&server, "films-of-others").await;
        for role in ROLES {
            let of_role = S3Store::at(&assume(&server, role, BUCKET).await, "films-of-others");
            for operation in ["list", "read", "put", "upload", "delete"] {
                let tried: &[&str] = if operation == "list" { &PREFIXES } else { &KEYS };
                for key in tried {
                    let error = attempt(&of_role, operation, key).await.expect_err(key);
                    assert!(is_denial(&error), "{role}, {operation} {key}: {error:?}");
                }
            }
        }
        for key in KEYS {
            assert_eq!(other.get(key).await.unwrap().body, "old");
        }
    })
    .await;
}

/// A function that got "forbidden" for an absent key would treat each first manifest as a failure.
#[tokio::test]
async fn what_is_not_there_is_said_to_be_absent() {
    on_every_store_with_roles(async |store| {
        let (server, _data) = started(store).await;
        filled(&server, BUCKET).await;
        for (role, keys) in [
            ("render", ["scripts/b/1.txt", "scripts/b/animation.json", "manifests/b.json"]),
            ("assemble", ["animations/b.gif", "scripts/b/animation.json", "manifests/b.json"]),
            ("viewer", ["animations/b.gif", "frames/b/1@v-p1.png", "manifests/b.json"]),
            ("uploader", ["animations/b.gif", "scripts/b/1.txt", "manifests/b.json"]),
            ("operator", ["animations/b.gif", "scripts/b/1.txt", "manifests/b.json"]),
        ] {
            let of_role = S3Store::at(&assume(&server, role, BUCKET).await, BUCKET);
            for key in keys {
                let error = of_role.get(key).await.expect_err(key);
                assert!(error.is_not_found(), "{role}, {key}: {error:?}");
                let error = of_role.head(key).await.expect_err(key);
                assert!(error.is_not_found(), "{role}, {key}: {error:?}");
            }
        }
    })
    .await;
}

fn is_denial(error: &Error) -> bool {
    let source = std::error::Error::source(error).map(ToString::to_string).unwrap_or_default();
    // A reply to HEAD has no body that could contain the code.
    matches!(error, Error::Refused { .. }) && (source.contains("AccessDenied") || source.contains("403"))
}
