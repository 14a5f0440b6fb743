//! The rights of a person who signs in on the studio's page, enforced by the store: each operation of S3 by which one person
//! could read, list, change or delete what belongs to another, or what belongs to the pipeline.

#![allow(clippy::print_stderr, reason = "says what a test that failed was doing")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

#[path = "stage/stores.rs"]
mod stores;

use std::fmt::Debug;

use aws_sdk_s3::Client;
use aws_sdk_s3::config::{BehaviorVersion, Credentials, Region};
use aws_sdk_s3::error::{ProvideErrorMetadata, SdkError};
use aws_sdk_s3::types::{CompletedMultipartUpload, CompletedPart, Delete, ObjectCannedAcl, ObjectIdentifier};
use aws_smithy_http_client::Builder as HttpBuilder;
use rayfold_local::{S3Server, StoreKind, any_port, sign_in};
use rayfold_pipeline::store::Connection;

use stores::on_every_store_with_roles;

const BUCKET: &str = "films";

/// Identities as Cognito gives them. The last two begin as the first one does.
const PERSON: &str = "eu-central-1:11111111-2222-3333-4444-555555555555";
const OTHERS: [&str; 3] = [
    "eu-central-1:99999999-2222-3333-4444-555555555555",
    "eu-central-1:11111111-2222-3333-4444-5555555555556",
    "eu-central-1:11111111-2222-3333-4444-555555555555.",
];

/// The keys of an animation below a folder, with the rights of the folder's owner: read, write, delete.
const KEYS: [(&str, [bool; 3]); 18] = [
    ("scripts/{}/hello/1.txt", [true, true, true]),
    ("scripts/{}/hello/animation.json", [true, true, true]),
    ("scripts/{}/hello/model.obj", [true, true, true]),
    ("manifests/{}/hello.json", [true, false, false]),
    ("animations/{}/hello.gif", [true, false, false]),
    ("frames/{}/hello/1@v-p1.png", [true, false, false]),
    ("frames/{}/hello/1@v-p1.error.json", [false, false, true]),
    ("frames/{}/hello/1@v-p1/2.error.json", [false, false, true]),
    ("frames/{}/hello/1@v-p1.begun-1", [false, false, true]),
    ("frames/{}/hello/1@v-p1.cut-2", [false, false, false]),
    ("frames/{}/hello/1@v-p1.1-of-2.band", [false, false, false]),
    ("frames/{}/hello/1@v-p1.taken", [false, false, false]),
    ("frames/{}/hello/@assembler.json", [false, false, false]),
    ("parts/{}/hello/1@v-p1/2.json", [false, false, false]),
    ("assemblies/{}/hello/1-g.json", [false, false, false]),
    ("retries/{}/hello/1@v-p1/1", [false, true, false]),
    ("retries/{}/hello/1@v-p1/2", [false, false, false]),
    ("checkpoints/{}/hello.state", [false, false, false]),
];

/// Objects that belong to nobody who signs in: animations of the stack's own people, and what is beside the folders.
const KEYS_OF_NOBODY: [&str; 5] = [
    "scripts/hello/1.txt",
    "manifests/hello.json",
    "animations/hello.gif",
    "frames/hello/1@v-p1.png",
    "manifests/eu-central-1:11111111-2222-3333-4444-555555555555.json",
];

fn key(of: &str, person: &str) -> String {
    of.replace("{}", person)
}

/// Returns each key that is not the person's, one of each kind of each other person first.
fn foreign() -> Vec<String> {
    let others = OTHERS.iter().flat_map(|other| KEYS.iter().map(|(of, _)| key(of, other)));
    others.chain(KEYS_OF_NOBODY.map(str::to_owned)).collect()
}

fn client(connection: &Connection) -> Client {
    let Connection { access_key, secret_key, session_token, region, endpoint } = connection.clone();
    let config = aws_sdk_s3::Config::builder()
        .behavior_version(BehaviorVersion::latest())
        .region(Region::new(region))
        .endpoint_url(endpoint)
        .force_path_style(true)
        .credentials_provider(Credentials::new(access_key, secret_key, session_token, None, "test"))
        .http_client(HttpBuilder::new().build_http())
        .build();
    Client::from_conf(config)
}

/// A store with objects of everybody, the owner's client, and that of the person.
struct Stage {
    owner: Client,
    person: Client,
    _server: S3Server,
    _data: tempfile::TempDir,
}

impl Stage {
    async fn new(store: StoreKind) -> Self {
        let data = tempfile::tempdir().unwrap();
        let mut say = |line: &str| eprintln!("{line}");
        let server = S3Server::start(store, data.path(), any_port(), None, &mut say).await.unwrap();
        let owner = client(&server.connection());
        owner.create_bucket().bucket(BUCKET).send().await.unwrap();
        let own = KEYS.iter().map(|(of, _)| key(of, PERSON));
        for key in own.chain(foreign()) {
            put(&owner, &key, "old").await.unwrap();
        }
        let person = client(&sign_in(&server.connection(), PERSON, BUCKET).await.unwrap());
        Self { owner, person, _server: server, _data: data }
    }

    /// Asserts that nothing of others has changed.
    async fn nothing_of_others_has_changed(&self, after: &str) {
        for key in foreign() {
            let found = read(&self.owner, &key).await;
            assert_eq!(found.as_deref(), Some("old"), "{key} after {after}");
        }
    }
}

async fn put(client: &Client, key: &str, text: &'static str) -> Result<(), String> {
    let body = text.as_bytes().to_vec().into();
    denied(client.put_object().bucket(BUCKET).key(key).body(body).send().await)
}

async fn read(client: &Client, key: &str) -> Option<String> {
    let found = client.get_object().bucket(BUCKET).key(key).send().await.ok()?;
    Some(String::from_utf8(found.body.collect().await.unwrap().to_vec()).unwrap())
}

/// Turns an answer into the code of the refusal. Anything but a denial is a failure of the test.
fn denied<T, E>(answer: Result<T, SdkError<E>>) -> Result<(), String>
where
    SdkError<E>: Debug + ProvideErrorMetadata,
{
    let Err(error) = answer else { return Ok(()) };
    let code = error.code().map(str::to_owned);
    let status = error.raw_response().map(|response| response.status().as_u16());
    // A reply to HEAD has no body that could contain the code.
    // What a store has not built in, nobody may do there.
    let known = ["AccessDenied", "NotImplemented"];
    assert!(code.as_deref().is_some_and(|code| known.contains(&code)) || status == Some(403), "{error:?}");
    Err(code.unwrap_or_default())
}

#[tokio::test]
async fn a_person_has_these_rights_in_the_own_folder_and_none_elsewhere() {
    on_every_store_with_roles(async |store| {
        let stage = Stage::new(store).await;
        let own = KEYS.iter().map(|(of, rights)| (key(of, PERSON), *rights));
        let foreign = foreign().into_iter().map(|key| (key, [false; 3]));
        for (key, [reads, writes, deletes]) in own.chain(foreign) {
            let of = |client: &Client| (client.clone(), key.clone());
            let (client, name) = of(&stage.person);
            let got = denied(client.get_object().bucket(BUCKET).key(&name).send().await);
            let head = denied(client.head_object().bucket(BUCKET).key(&name).send().await);
            assert_eq!((got.is_ok(), head.is_ok()), (reads, reads), "reading {key}");
            assert_eq!(put(&stage.person, &key, "new").await.is_ok(), writes, "writing {key}");
            let gone = denied(client.delete_object().bucket(BUCKET).key(&name).send().await);
            assert_eq!(gone.is_ok(), deletes, "deleting {key}");
        }
        stage.nothing_of_others_has_changed("reads, writes and deletions").await;
    })
    .await;
}

#[tokio::test]
async fn a_person_lists_the_own_folder_alone() {
    on_every_store_with_roles(async |store| {
        let stage = Stage::new(store).await;
        let list = async |prefix: Option<&str>, delimiter: Option<&str>| {
            let of = stage.person.list_objects_v2().bucket(BUCKET);
            let of = of.set_prefix(prefix.map(str::to_owned)).set_delimiter(delimiter.map(str::to_owned));
            let answer = of.send().await;
            let names = answer.as_ref().map(|found| {
                found
                    .contents()
                    .iter()
                    .filter_map(|object| object.key().map(str::to_owned))
                    .collect::<Vec<_>>()
            });
            let names = names.unwrap_or_default();
            denied(answer).map(|()| names)
        };
        for folder in ["scripts", "frames", "manifests"] {
            for rest in ["", "hello", "hello/"] {
                let prefix = format!("{folder}/{PERSON}/{rest}");
                let found = list(Some(&prefix), None).await.unwrap();
                assert!(found.iter().all(|key| key.starts_with(&prefix)), "{found:?}");
            }
            assert!(!list(Some(&format!("{folder}/{PERSON}/")), None).await.unwrap().is_empty());
        }
        let mut refused = vec![None, Some(String::new())];
        for folder in ["scripts", "manifests", "animations", "frames", "parts", "retries", "assemblies"] {
            refused.extend(
                [String::new(), "/".into(), format!("/{}", &PERSON[..8]), format!("/{PERSON}")]
                    .map(|rest| Some(format!("{folder}{rest}"))),
            );
            refused.extend(OTHERS.map(|other| Some(format!("{folder}/{other}/"))));
        }
        let others = ["animations", "parts", "retries", "assemblies"];
        refused.extend(others.map(|folder| Some(format!("{folder}/{PERSON}/"))));
        // Not a way up, for S3 has none; and neither are other spellings.
        refused.push(Some(format!("scripts/{PERSON}%2F")));
        refused.push(Some(format!("Scripts/{PERSON}/")));
        refused.push(Some(format!("scripts//{PERSON}/")));
        for prefix in refused {
            for delimiter in [None, Some("/")] {
                let answer = list(prefix.as_deref(), delimiter).await;
                assert!(answer.is_err(), "{prefix:?} {delimiter:?}: {answer:?}");
            }
        }
        let of = stage.person.list_objects().bucket(BUCKET);
        denied(of.prefix(format!("scripts/{}/", OTHERS[0])).send().await).unwrap_err();
        denied(stage.person.head_bucket().bucket(BUCKET).send().await).unwrap_err();
        denied(
            stage
                .person
                .list_object_versions()
                .bucket(BUCKET)
                .prefix(format!("scripts/{PERSON}/"))
                .send()
                .await,
        )
        .unwrap_err();
        denied(stage.person.list_multipart_uploads().bucket(BUCKET).send().await).unwrap_err();
    })
    .await;
}

#[tokio::test]
async fn a_person_cannot_copy_what_belongs_to_others() {
    on_every_store_with_roles(async |store| {
        let stage = Stage::new(store).await;
        let mine = format!("scripts/{PERSON}/stolen/1.txt");
        let upload = stage.person.create_multipart_upload().bucket(BUCKET).key(&mine).send().await.unwrap();
        let upload = upload.upload_id().unwrap();
        for key in foreign() {
            let source = format!("{BUCKET}/{key}");
            let copy = stage.person.copy_object().bucket(BUCKET).key(&mine).copy_source(&source);
            denied(copy.send().await).unwrap_err();
            let part = stage.person.upload_part_copy().bucket(BUCKET).key(&mine).copy_source(&source);
            denied(part.upload_id(upload).part_number(1).send().await).unwrap_err();
            // Nor put there what is one's own.
            let own = format!("{BUCKET}/scripts/{PERSON}/hello/1.txt");
            denied(stage.person.copy_object().bucket(BUCKET).key(&key).copy_source(own).send().await)
                .unwrap_err();
            denied(stage.person.create_multipart_upload().bucket(BUCKET).key(&key).send().await).unwrap_err();
        }
        assert_eq!(read(&stage.owner, &mine).await, None);
        stage.nothing_of_others_has_changed("copies").await;
    })
    .await;
}

#[tokio::test]
async fn a_person_cannot_use_an_upload_of_others() {
    on_every_store_with_roles(async |store| {
        let stage = Stage::new(store).await;
        let key = key(KEYS[0].0, OTHERS[0]);
        let begun = stage.owner.create_multipart_upload().bucket(BUCKET).key(&key).send().await.unwrap();
        let upload = begun.upload_id().unwrap();
        let part = stage.owner.upload_part().bucket(BUCKET).key(&key).upload_id(upload).part_number(1);
        let part = part.body(b"new".to_vec().into()).send().await.unwrap();
        let person = &stage.person;
        let write = person.upload_part().bucket(BUCKET).key(&key).upload_id(upload).part_number(2);
        denied(write.body(b"mine".to_vec().into()).send().await).unwrap_err();
        denied(person.list_parts().bucket(BUCKET).key(&key).upload_id(upload).send().await).unwrap_err();
        denied(person.abort_multipart_upload().bucket(BUCKET).key(&key).upload_id(upload).send().await)
            .unwrap_err();
        let parts = CompletedPart::builder().part_number(1).e_tag(part.e_tag().unwrap()).build();
        let parts = CompletedMultipartUpload::builder().parts(parts).build();
        let complete = person.complete_multipart_upload().bucket(BUCKET).key(&key).upload_id(upload);
        denied(complete.multipart_upload(parts).send().await).unwrap_err();
        stage.nothing_of_others_has_changed("uploads").await;
    })
    .await;
}

#[tokio::test]
async fn a_deletion_of_many_takes_the_own_alone() {
    on_every_store_with_roles(async |store| {
        let stage = Stage::new(store).await;
        let own = key(KEYS[0].0, PERSON);
        let keys: Vec<_> = foreign().into_iter().chain([own.clone()]).collect();
        let names = keys.iter().map(|key| ObjectIdentifier::builder().key(key).build().unwrap());
        let many = Delete::builder().set_objects(Some(names.collect())).build().unwrap();
        let answer = stage.person.delete_objects().bucket(BUCKET).delete(many).send().await;
        if let Ok(answer) = answer {
            assert_eq!(answer.errors().len(), keys.len() - 1, "{answer:?}");
            assert_eq!(read(&stage.owner, &own).await, None);
        }
        stage.nothing_of_others_has_changed("a deletion of many").await;
    })
    .await;
}

/// Neither tags, ACLs, versions and settings of others, nor those of one's own.
#[tokio::test]
async fn a_person_changes_no_tags_rights_and_settings() {
    on_every_store_with_roles(async |store| {
        let stage = Stage::new(store).await;
        let person = &stage.person;
        for key in [key(KEYS[0].0, OTHERS[0]), key(KEYS[0].0, PERSON)] {
            let refused = [
                ("tags", denied(person.get_object_tagging().bucket(BUCKET).key(&key).send().await)),
                ("no tags", denied(person.delete_object_tagging().bucket(BUCKET).key(&key).send().await)),
                ("ACL", denied(person.get_object_acl().bucket(BUCKET).key(&key).send().await)),
            ];
            for (what, answer) in refused {
                answer.expect_err(what);
            }
            let open = person.put_object_acl().bucket(BUCKET).key(&key).acl(ObjectCannedAcl::PublicRead);
            open.send().await.unwrap_err();
            let old = person.get_object().bucket(BUCKET).key(&key).version_id("null");
            if key.contains(OTHERS[0]) {
                old.send().await.unwrap_err();
            }
        }
        for answer in [
            denied(person.get_bucket_cors().bucket(BUCKET).send().await),
            denied(person.delete_bucket_cors().bucket(BUCKET).send().await),
            denied(person.get_bucket_notification_configuration().bucket(BUCKET).send().await),
            denied(person.delete_bucket().bucket(BUCKET).send().await),
            denied(person.create_bucket().bucket("mine").send().await),
            denied(person.list_buckets().send().await),
        ] {
            answer.unwrap_err();
        }
        stage.nothing_of_others_has_changed("changes of settings").await;
    })
    .await;
}

#[tokio::test]
async fn the_rights_end_at_the_bucket() {
    on_every_store_with_roles(async |store| {
        let stage = Stage::new(store).await;
        stage.owner.create_bucket().bucket("films-of-others").send().await.unwrap();
        let key = key(KEYS[0].0, PERSON);
        let put = stage.person.put_object().bucket("films-of-others").key(&key).body(b"x".to_vec().into());
        denied(put.send().await).unwrap_err();
        denied(stage.person.get_object().bucket("films-of-others").key(&key).send().await).unwrap_err();
    })
    .await;
}
