//! Compares listings with a model: a sorted map, and S3's rules in a few lines.

use std::collections::{BTreeMap, BTreeSet};

use aws_sdk_s3::types::EncodingType;
use fastrand::Rng;

use crate::stage::{BUCKET, Stage, failure, stage};

/// The contents of a complete listing.
#[derive(Debug, Default, PartialEq)]
struct Listing {
    keys: Vec<String>,
    prefixes: Vec<String>,
}

/// Applies S3's rules to all keys at once.
fn expected(keys: &BTreeMap<String, String>, prefix: &str, delimiter: &str, after: &str) -> Listing {
    let mut listing = Listing::default();
    for key in keys.keys().filter(|key| key.starts_with(prefix) && key.as_str() > after) {
        let end = (!delimiter.is_empty()).then(|| key[prefix.len()..].find(delimiter)).flatten();
        match end {
            Some(end) => {
                let common = &key[..prefix.len() + end + delimiter.len()];
                let is_listed = listing.prefixes.last().is_some_and(|last| last == common);
                if !is_listed && !after.starts_with(common) {
                    listing.prefixes.push(common.to_owned());
                }
            }
            None => listing.keys.push(key.clone()),
        }
    }
    listing
}

/// Returns all pages of a listing. Checks each page.
async fn listed(stage: &Stage, prefix: &str, delimiter: &str, after: &str, most: i32) -> Listing {
    let mut listing = Listing::default();
    let mut token = None;
    loop {
        let page = stage
            .client
            .list_objects_v2()
            .bucket(BUCKET)
            .prefix(prefix)
            .set_delimiter((!delimiter.is_empty()).then(|| delimiter.to_owned()))
            .set_start_after((!after.is_empty()).then(|| after.to_owned()))
            .set_continuation_token(token)
            .max_keys(most)
            .send()
            .await
            .unwrap();
        let count = page.contents().len() + page.common_prefixes().len();
        assert_eq!(page.key_count, Some(i32::try_from(count).unwrap()));
        listing.keys.extend(page.contents().iter().map(|object| object.key().unwrap().to_owned()));
        listing.prefixes.extend(page.common_prefixes().iter().map(|p| p.prefix().unwrap().to_owned()));
        token = page.next_continuation_token;
        if token.is_none() {
            assert_eq!(page.is_truncated, Some(false));
            return listing;
        }
        assert_eq!((page.is_truncated, count), (Some(true), usize::try_from(most).unwrap()));
    }
}

/// Returns all pages of a listing by version 1 of the operation, whose marker is a name.
async fn listed_v1(stage: &Stage, prefix: &str, delimiter: &str, most: i32) -> Listing {
    let mut listing = Listing::default();
    let mut marker = None;
    loop {
        let page = stage
            .client
            .list_objects()
            .bucket(BUCKET)
            .prefix(prefix)
            .set_delimiter((!delimiter.is_empty()).then(|| delimiter.to_owned()))
            .set_marker(marker)
            .max_keys(most)
            .send()
            .await
            .unwrap();
        listing.keys.extend(page.contents().iter().map(|object| object.key().unwrap().to_owned()));
        listing.prefixes.extend(page.common_prefixes().iter().map(|p| p.prefix().unwrap().to_owned()));
        if page.is_truncated != Some(true) {
            return listing;
        }
        let last = page.contents().last().map(|object| object.key().unwrap().to_owned());
        marker = page.next_marker.or(last);
        assert!(marker.is_some());
    }
}

/// Returns all pages of a listing of versions. Every object has the version `null`.
async fn versions_listed(stage: &Stage, prefix: &str, delimiter: &str, most: i32) -> Listing {
    let mut listing = Listing::default();
    let mut markers = (None, None);
    loop {
        let page = stage
            .client
            .list_object_versions()
            .bucket(BUCKET)
            .prefix(prefix)
            .set_delimiter((!delimiter.is_empty()).then(|| delimiter.to_owned()))
            .set_key_marker(markers.0)
            .set_version_id_marker(markers.1)
            .max_keys(most)
            .send()
            .await
            .unwrap();
        assert!(page.delete_markers().is_empty());
        for version in page.versions() {
            assert_eq!((version.version_id(), version.is_latest), (Some("null"), Some(true)));
            listing.keys.push(version.key().unwrap().to_owned());
        }
        listing.prefixes.extend(page.common_prefixes().iter().map(|p| p.prefix().unwrap().to_owned()));
        if page.is_truncated != Some(true) {
            assert_eq!((page.next_key_marker, page.next_version_id_marker), (None, None));
            return listing;
        }
        assert!(page.next_key_marker.is_some());
        markers = (page.next_key_marker, page.next_version_id_marker);
    }
}

fn name(random: &mut Rng) -> String {
    (0..random.usize(1..5))
        .map(|_| *random.choice(&["a", "b", "/", "//", "-", "ü", "c d", "z+"]).unwrap())
        .collect()
}

/// `RAYFOLD_SEED` replays one run; `RAYFOLD_BUCKET_ROUNDS` sets the number of rounds.
#[tokio::test]
async fn listings_are_as_the_model_says() {
    let seed = std::env::var("RAYFOLD_SEED").map_or_else(|_| fastrand::u64(..), |seed| seed.parse().unwrap());
    let rounds = std::env::var("RAYFOLD_BUCKET_ROUNDS").map_or(2, |rounds| rounds.parse().unwrap());
    println!("RAYFOLD_SEED={seed}");
    let mut random = Rng::with_seed(seed);
    let stage = stage().await;
    let mut model = BTreeMap::new();
    for _ in 0..rounds {
        for _ in 0..60 {
            let key = name(&mut random);
            if random.u8(..) < 80 {
                stage.client.delete_object().bucket(BUCKET).key(&key).send().await.unwrap();
                model.remove(&key);
            } else {
                let etag = stage.put(&key, key.clone()).await;
                model.insert(key, etag);
            }
        }
        for _ in 0..15 {
            let pick = |random: &mut Rng| if random.bool() { String::new() } else { name(random) };
            let (prefix, after) = (pick(&mut random), pick(&mut random));
            let delimiter = *random.choice(&["", "/", "//", "a", "-"]).unwrap();
            let most = random.i32(1..10);
            let shown = format!("prefix {prefix:?} delimiter {delimiter:?} after {after:?} pages of {most}");
            let found = listed(&stage, &prefix, delimiter, &after, most).await;
            assert_eq!(found, expected(&model, &prefix, delimiter, &after), "{shown}");
            let found = listed_v1(&stage, &prefix, delimiter, most).await;
            assert_eq!(found, expected(&model, &prefix, delimiter, ""), "version 1, {shown}");
            let found = versions_listed(&stage, &prefix, delimiter, most).await;
            assert_eq!(found, expected(&model, &prefix, delimiter, ""), "versions, {shown}");
        }
        for (key, etag) in &model {
            assert_eq!(stage.get(key).await, key.as_bytes(), "{key:?}");
            let head = stage.client.head_object().bucket(BUCKET).key(key).send().await.unwrap();
            assert_eq!(head.e_tag.as_ref(), Some(etag));
        }
    }
}

/// Returns all pages of a listing of uploads, as keys and ids. Checks each page.
async fn uploads_listed(
    stage: &Stage,
    prefix: &str,
    delimiter: &str,
    after: (&str, &str),
    most: i32,
) -> (Vec<(String, String)>, Vec<String>) {
    let (mut uploads, mut prefixes) = (Vec::new(), Vec::new());
    let mut markers = (after.0.to_owned(), after.1.to_owned());
    loop {
        let page = stage
            .client
            .list_multipart_uploads()
            .bucket(BUCKET)
            .prefix(prefix)
            .set_delimiter((!delimiter.is_empty()).then(|| delimiter.to_owned()))
            .key_marker(&markers.0)
            .upload_id_marker(&markers.1)
            .max_uploads(most)
            .send()
            .await
            .unwrap();
        assert_eq!(
            (page.bucket(), page.prefix(), page.max_uploads()),
            (Some(BUCKET), Some(prefix), Some(most))
        );
        assert_eq!(page.delimiter().unwrap_or_default(), delimiter);
        assert_eq!(page.key_marker(), Some(&*markers.0));
        // An id without a key has no effect.
        let id = if markers.0.is_empty() { "" } else { &markers.1 };
        assert_eq!(page.upload_id_marker(), Some(id));
        let count = page.uploads().len() + page.common_prefixes().len();
        for upload in page.uploads() {
            uploads.push((upload.key().unwrap().to_owned(), upload.upload_id().unwrap().to_owned()));
        }
        prefixes.extend(page.common_prefixes().iter().map(|p| p.prefix().unwrap().to_owned()));
        if page.is_truncated != Some(true) {
            assert_eq!((page.next_key_marker, page.next_upload_id_marker), (None, None));
            return (uploads, prefixes);
        }
        assert_eq!(count, usize::try_from(most).unwrap());
        markers = (page.next_key_marker.unwrap(), page.next_upload_id_marker.unwrap());
    }
}

#[tokio::test]
async fn listings_of_uploads_are_as_the_model_says() {
    let seed = std::env::var("RAYFOLD_SEED").map_or_else(|_| fastrand::u64(..), |seed| seed.parse().unwrap());
    println!("RAYFOLD_SEED={seed}");
    let mut random = Rng::with_seed(seed);
    let stage = stage().await;
    let mut model = BTreeSet::new();
    for _ in 0..40 {
        let key = name(&mut random);
        // Some keys have several.
        for _ in 0..random.usize(1..3) {
            let begun = stage.client.create_multipart_upload().bucket(BUCKET).key(&key).send().await.unwrap();
            model.insert((key.clone(), begun.upload_id.unwrap()));
        }
    }
    let keys: BTreeMap<_, _> = model.iter().map(|(key, _)| (key.clone(), String::new())).collect();
    for _ in 0..60 {
        let prefix = if random.bool() { String::new() } else { name(&mut random) };
        let delimiter = *random.choice(&["", "/", "//", "a", "-"]).unwrap();
        let most = random.i32(1..10);
        let (key, id) = random.choice(&model).unwrap();
        let after = match random.u8(0..4) {
            0 => (key.as_str(), id.as_str()),
            1 => (key.as_str(), ""),
            2 => ("", id.as_str()),
            _ => ("", ""),
        };
        let Listing { keys: alone, prefixes } = expected(&keys, &prefix, delimiter, after.0);
        let is_expected = |(key, id): &(String, String)| {
            let is_behind = key == after.0 && !after.1.is_empty() && id.as_str() > after.1;
            // A key below a common prefix is listed as that prefix.
            let is_alone = |rest: &str| delimiter.is_empty() || !rest.contains(delimiter);
            alone.contains(key) || (is_behind && key.strip_prefix(&prefix).is_some_and(is_alone))
        };
        let uploads: Vec<_> = model.iter().filter(|upload| is_expected(upload)).cloned().collect();
        let found = uploads_listed(&stage, &prefix, delimiter, after, most).await;
        let shown = format!("prefix {prefix:?} delimiter {delimiter:?} after {after:?} pages of {most}");
        assert_eq!(found, (uploads, prefixes), "{shown}");
    }
    let list = || stage.client.list_multipart_uploads().bucket(BUCKET);
    let none = list().max_uploads(0).send().await.unwrap();
    assert_eq!((none.is_truncated, none.uploads().len()), (Some(false), 0));
    let url = list().encoding_type(EncodingType::Url).prefix("ü c/").send().await.unwrap();
    assert_eq!((url.encoding_type(), url.prefix()), (Some(&EncodingType::Url), Some("%C3%BC%20c/")));
}

#[tokio::test]
async fn the_edges_of_a_page() {
    let stage = stage().await;
    for key in ["a/1", "a/2", "b", "c d+"] {
        stage.put(key, "1").await;
    }
    let list = || stage.client.list_objects_v2().bucket(BUCKET);
    let none = list().max_keys(0).send().await.unwrap();
    assert_eq!((none.key_count, none.is_truncated, none.contents().len()), (Some(0), Some(false), 0));
    assert_eq!(list().max_keys(5000).send().await.unwrap().max_keys, Some(1000));
    assert_eq!(failure(list().max_keys(-1).send().await), (400, "InvalidArgument".into()));
    assert_eq!(failure(list().continuation_token("nonsense!").send().await), (400, "InvalidArgument".into()));
    let url = list().encoding_type(EncodingType::Url).start_after("b").send().await.unwrap();
    assert_eq!(url.contents()[0].key(), Some("c%20d%2B"));
    assert!(list().send().await.unwrap().contents()[0].owner().is_none());
    assert!(list().fetch_owner(true).send().await.unwrap().contents()[0].owner().is_some());
    let exact = list().delimiter("/").max_keys(3).send().await.unwrap();
    assert_eq!((exact.is_truncated, exact.key_count), (Some(false), Some(3)));
    let versions = || stage.client.list_object_versions().bucket(BUCKET);
    let without_key = versions().version_id_marker("null").send().await;
    assert_eq!(failure(without_key), (400, "InvalidArgument".into()));
    // A page that ends with a common prefix contains no version marker.
    for (most, version) in [(1, None), (2, Some("null"))] {
        let page = versions().delimiter("/").max_keys(most).send().await.unwrap();
        assert_eq!((page.delimiter(), page.next_version_id_marker()), (Some("/"), version));
    }
    assert_eq!(versions().delimiter("").send().await.unwrap().delimiter(), None);
}

#[tokio::test]
async fn a_page_is_of_one_moment_and_what_comes_later_is_on_later_pages() {
    let stage = stage().await;
    for number in 0..20 {
        stage.put(&format!("{number:02}"), "1").await;
    }
    let page = stage.client.list_objects_v2().bucket(BUCKET).max_keys(10).send().await.unwrap();
    stage.put("03a", "before the next page").await;
    stage.put("15a", "behind it").await;
    stage.client.delete_object().bucket(BUCKET).key("10").send().await.unwrap();
    let rest = stage.client.list_objects_v2().bucket(BUCKET);
    let rest = rest.set_continuation_token(page.next_continuation_token).send().await.unwrap();
    let keys: Vec<_> = rest.contents().iter().map(|object| object.key().unwrap()).collect();
    assert_eq!(keys, ["11", "12", "13", "14", "15", "15a", "16", "17", "18", "19"]);
}
