//! If-Match and If-None-Match, alone and combined.

use std::time::{Duration, SystemTime};

use aws_sdk_s3::primitives::DateTime;

use crate::stage::{BUCKET, failure, stage};

#[tokio::test]
async fn a_write_on_a_condition_is_made_or_refused_as_s3_does() {
    let stage = stage().await;
    let put = || stage.client.put_object().bucket(BUCKET).key("a").body(b"1".to_vec().into());
    let other = "\"00000000000000000000000000000000\"";
    assert_eq!(failure(put().if_match(other).send().await), (404, "NoSuchKey".into()));
    let etag = put().if_none_match("*").send().await.unwrap().e_tag.unwrap();
    assert_eq!(failure(put().if_none_match("*").send().await), (412, "PreconditionFailed".into()));
    assert_eq!(failure(put().if_match(other).send().await), (412, "PreconditionFailed".into()));
    assert_eq!(failure(put().if_none_match(other).send().await), (501, "NotImplemented".into()));
    put().if_match(&etag).send().await.unwrap();
    put().if_match(etag.trim_matches('"')).send().await.unwrap();
}

#[tokio::test]
async fn a_read_on_a_condition_is_answered_304_or_412() {
    let stage = stage().await;
    let etag = stage.put("a", "1").await;
    let other = "\"00000000000000000000000000000000\"";
    let at = |seconds: i64| {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs();
        DateTime::from_secs(i64::try_from(now).unwrap() + seconds)
    };
    tokio::time::sleep(Duration::from_millis(1100)).await;
    let get = || stage.client.get_object().bucket(BUCKET).key("a");
    get().if_match(&etag).send().await.unwrap();
    get().if_none_match(other).send().await.unwrap();
    get().if_modified_since(at(-60)).send().await.unwrap();
    get().if_unmodified_since(at(0)).send().await.unwrap();
    assert_eq!(failure(get().if_match(other).send().await), (412, "PreconditionFailed".into()));
    assert_eq!(failure(get().if_unmodified_since(at(-60)).send().await).0, 412);
    assert_eq!(failure(get().if_none_match(&etag).send().await).0, 304);
    assert_eq!(failure(get().if_modified_since(at(0)).send().await).0, 304);
    // An ETag condition overrides the date condition of the same kind.
    get().if_match(&etag).if_unmodified_since(at(-60)).send().await.unwrap();
    get().if_none_match(other).if_modified_since(at(0)).send().await.unwrap();
    let head = || stage.client.head_object().bucket(BUCKET).key("a");
    assert_eq!(failure(head().if_match(other).send().await).0, 412);
    assert_eq!(failure(head().if_none_match(&etag).send().await).0, 304);
}

/// `RAYFOLD_BUCKET_ROUNDS=200 cargo test -p rayfold-bucket --test bucket writers` runs more rounds.
#[tokio::test(flavor = "multi_thread")]
async fn of_200_writers_one_wins_each_round() {
    let rounds = std::env::var("RAYFOLD_BUCKET_ROUNDS").map_or(5, |rounds| rounds.parse().unwrap());
    let stage = stage().await;
    let mut etag = stage.put("register", "start").await;
    for round in 0..rounds {
        let writers = (0..200).map(|writer| {
            let put = stage.client.put_object().bucket(BUCKET).key("register").if_match(&etag);
            let put = put.body(format!("round {round} writer {writer}").into_bytes().into());
            tokio::spawn(put.send())
        });
        let mut winners = Vec::new();
        for writer in writers.collect::<Vec<_>>() {
            match writer.await.unwrap() {
                Ok(put) => winners.push(put.e_tag.unwrap()),
                lost @ Err(_) => assert_eq!(failure(lost), (412, "PreconditionFailed".into())),
            }
        }
        assert_eq!(winners.len(), 1, "round {round}");
        etag = winners.remove(0);
        let now = stage.client.head_object().bucket(BUCKET).key("register").send().await.unwrap();
        assert_eq!(now.e_tag.as_deref(), Some(etag.as_str()));
    }
    let creators = (0..200).map(|_| {
        let put = stage.client.put_object().bucket(BUCKET).key("fresh").if_none_match("*");
        tokio::spawn(put.send())
    });
    let mut made = 0;
    for creator in creators.collect::<Vec<_>>() {
        made += usize::from(creator.await.unwrap().is_ok());
    }
    assert_eq!(made, 1);
}
