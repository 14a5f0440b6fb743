//! Listings against a model: a sorted map, and S3's rules in a few lines.

use std::collections::BTreeMap;

use aws_sdk_s3::types::EncodingType;
use fastrand::Rng;

use crate::stage::{BUCKET, Stage, failure, stage};

/// What a whole listing says.
#[derive(Debug, Default, PartialEq)]
struct Listing {
    keys: Vec<String>,
    prefixes: Vec<String>,
}

/// S3's rules, on all keys at once.
fn expected(keys: &BTreeMap<String, String>, prefix: &str, delimiter: &str, after: &str) -> Listing {
    let mut listing = Listing::default();
    for key in keys.keys().filter(|key| key.starts_with(prefix) && key.as_str() > after) {
        let end = (!delimiter.is_empty()).then(|| key[prefix.len()..].find(delimiter)).flatten();
        match end {
            Some(end) => {
                let common = &key[..prefix.len() + end + delimiter.len()];
                let told = listing.prefixes.last().is_some_and(|last| last == common);
                if !told && !after.starts_with(common) {
                    listing.prefixes.push(common.to_owned());
                }
            }
            None => listing.keys.push(key.clone()),
        }
    }
    listing
}

/// All pages of a listing, each checked by itself.
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

/// The same by the first version, whose marker is a name.
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

/// The same by versions, of which every object has the one that is called `null`.
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

/// `RAYFOLD_SEED` replays one; `RAYFOLD_BUCKET_ROUNDS` runs more.
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
