//! Objects: put, get, ranges, copy and delete.

use aws_sdk_s3::types::{
    ChecksumAlgorithm, ChecksumMode, Delete, MetadataDirective, ObjectAttributes, ObjectIdentifier,
};

use crate::stage::{BUCKET, failure, stage};

#[tokio::test]
async fn a_body_comes_back_with_all_that_was_said_of_it() {
    let stage = stage().await;
    for size in [0, 1, 131_072, 131_073, 1_048_576, 1_048_577, 5_000_000] {
        let body: Vec<u8> = (0..size).map(|n| u8::try_from(n % 251).unwrap()).collect();
        let put = stage
            .client
            .put_object()
            .bucket(BUCKET)
            .key("a/ü +&.bin")
            .body(body.clone().into())
            .content_type("image/png")
            .cache_control("no-cache")
            .content_disposition("inline")
            .content_language("de")
            .content_encoding("br")
            .metadata("colour", "red")
            .checksum_algorithm(ChecksumAlgorithm::Sha256)
            .send()
            .await
            .unwrap();
        assert!(put.checksum_sha256.is_some());
        let got = stage
            .client
            .get_object()
            .bucket(BUCKET)
            .key("a/ü +&.bin")
            .checksum_mode(ChecksumMode::Enabled)
            .send()
            .await
            .unwrap();
        assert_eq!(got.e_tag, put.e_tag);
        assert_eq!(got.checksum_sha256, put.checksum_sha256);
        assert_eq!(got.content_type.as_deref(), Some("image/png"));
        assert_eq!(got.cache_control.as_deref(), Some("no-cache"));
        assert_eq!(got.content_disposition.as_deref(), Some("inline"));
        assert_eq!(got.content_language.as_deref(), Some("de"));
        assert_eq!(got.content_encoding.as_deref(), Some("br"));
        assert_eq!(got.metadata.as_ref().unwrap()["colour"], "red");
        assert_eq!(got.content_length, Some(size));
        assert!(got.body.collect().await.unwrap().to_vec() == body, "{size} bytes");
        let head = stage.client.head_object().bucket(BUCKET).key("a/ü +&.bin").send().await.unwrap();
        assert_eq!((head.e_tag, head.content_length), (put.e_tag, Some(size)));
    }
    assert_eq!(stage.files(), 1, "bodies that were overwritten are gone");
    stage.server.stop().await;
}

#[tokio::test]
async fn the_etag_of_a_body_is_its_md5() {
    let stage = stage().await;
    assert_eq!(stage.put("a", "123456789").await, "\"25f9e794323b453885f5181f1b624d0b\"");
    assert_eq!(stage.put("empty", "").await, "\"d41d8cd98f00b204e9800998ecf8427e\"");
}

#[tokio::test]
async fn every_checksum_is_kept_and_a_wrong_one_refused() {
    let stage = stage().await;
    let put = || stage.client.put_object().bucket(BUCKET).key("a").body(b"123456789".to_vec().into());
    for algorithm in [
        ChecksumAlgorithm::Crc32,
        ChecksumAlgorithm::Crc32C,
        ChecksumAlgorithm::Crc64Nvme,
        ChecksumAlgorithm::Sha1,
        ChecksumAlgorithm::Sha256,
    ] {
        put().checksum_algorithm(algorithm.clone()).send().await.unwrap();
        let asked = [ObjectAttributes::Checksum, ObjectAttributes::Etag, ObjectAttributes::ObjectSize];
        let attributes = stage.client.get_object_attributes().bucket(BUCKET).key("a");
        let attributes = attributes.set_object_attributes(Some(asked.to_vec())).send().await.unwrap();
        let sum = attributes.checksum.unwrap();
        let values = [
            sum.checksum_crc32,
            sum.checksum_crc32_c,
            sum.checksum_crc64_nvme,
            sum.checksum_sha1,
            sum.checksum_sha256,
        ];
        let expected = match algorithm {
            ChecksumAlgorithm::Crc32 => "y/Q5Jg==",
            ChecksumAlgorithm::Crc32C => "4waSgw==",
            ChecksumAlgorithm::Crc64Nvme => "rosUhgp5mIg=",
            ChecksumAlgorithm::Sha1 => "98O8HYCOBHMq32eZZczDTKeuNEE=",
            _ => "FeKw08M4keuw8e9gnsQZQgwg4yDOlMZfvIwzEkSOsiU=",
        };
        assert_eq!(values.iter().flatten().collect::<Vec<_>>(), [expected]);
        assert_eq!(attributes.object_size, Some(9));
    }
    assert_eq!(failure(put().checksum_crc32("AAAAAA==").send().await), (400, "BadDigest".into()));
    assert_eq!(failure(put().checksum_crc32("nonsense").send().await), (400, "InvalidRequest".into()));
    assert_eq!(
        failure(put().content_md5("AAAAAAAAAAAAAAAAAAAAAA==").send().await),
        (400, "BadDigest".into())
    );
    assert_eq!(failure(put().content_md5("short").send().await), (400, "InvalidDigest".into()));
}

#[tokio::test]
async fn ranges_are_what_was_asked_for() {
    let stage = stage().await;
    let body: Vec<u8> = (0..600_000_u32).flat_map(u32::to_le_bytes).collect();
    for (key, body) in [("small", &body[..1000]), ("large", &body[..])] {
        stage.put(key, body).await;
        let size = body.len();
        let middle = size / 2..size / 2 + 300;
        for (range, expected) in [
            ("bytes=0-0".to_owned(), 0..1),
            (format!("bytes={}-{}", middle.start, middle.end - 1), middle.clone()),
            (format!("bytes={}-", size - 7), size - 7..size),
            ("bytes=-9".to_owned(), size - 9..size),
            (format!("bytes=-{}", size * 2), 0..size),
            (format!("bytes=10-{}", size * 2), 10..size),
        ] {
            let get = stage.client.get_object().bucket(BUCKET).key(key).range(&range);
            let got = get.send().await.unwrap();
            let place = format!("bytes {}-{}/{size}", expected.start, expected.end - 1);
            assert_eq!(got.content_range.as_deref(), Some(place.as_str()), "{range}");
            assert!(got.body.collect().await.unwrap().to_vec() == body[expected], "{range} of {key}");
        }
        let beyond = stage.client.get_object().bucket(BUCKET).key(key).range(format!("bytes={size}-"));
        assert_eq!(failure(beyond.send().await), (416, "InvalidRange".into()));
    }
    stage.put("empty", "").await;
    for range in ["bytes=0-", "bytes=-5"] {
        let empty = stage.client.get_object().bucket(BUCKET).key("empty").range(range);
        assert_eq!(failure(empty.send().await), (416, "InvalidRange".into()), "{range}");
    }
}

#[tokio::test]
async fn a_copy_has_the_body_and_the_headers_that_were_asked_for() {
    let stage = stage().await;
    for body in [b"small".to_vec(), vec![7; 3_000_000]] {
        let put = stage.client.put_object().bucket(BUCKET).key("from ü").body(body.clone().into());
        let etag = put.metadata("colour", "red").content_type("image/png").send().await.unwrap().e_tag;
        let copy = |to: &str| {
            stage.client.copy_object().bucket(BUCKET).key(to).copy_source(format!("{BUCKET}/from%20%C3%BC"))
        };
        let copied = copy("to").send().await.unwrap().copy_object_result.unwrap();
        assert_eq!(copied.e_tag, etag);
        assert!(stage.get("to").await == body);
        let head = stage.client.head_object().bucket(BUCKET).key("to").send().await.unwrap();
        assert_eq!(head.content_type.as_deref(), Some("image/png"));
        assert_eq!(head.metadata.unwrap()["colour"], "red");
        let replaced = copy("to").metadata_directive(MetadataDirective::Replace).metadata("size", "large");
        replaced.send().await.unwrap();
        let head = stage.client.head_object().bucket(BUCKET).key("to").send().await.unwrap();
        let metadata = head.metadata.unwrap();
        assert_eq!((metadata.get("colour"), metadata["size"].as_str()), (None, "large"));

        assert_eq!(failure(copy("from ü").send().await), (400, "InvalidRequest".into()));
        let itself = copy("from ü").metadata_directive(MetadataDirective::Replace).metadata("size", "new");
        itself.send().await.unwrap();
        assert!(stage.get("from ü").await == body);

        let other = "\"00000000000000000000000000000000\"";
        assert_eq!(failure(copy("to").copy_source_if_match(other).send().await).0, 412);
        let etag = etag.unwrap();
        assert_eq!(failure(copy("to").copy_source_if_none_match(etag.as_str()).send().await).0, 412);
        copy("to").copy_source_if_match(etag).send().await.unwrap();
    }
    let none = stage.client.copy_object().bucket(BUCKET).key("to").copy_source(format!("{BUCKET}/none"));
    assert_eq!(failure(none.send().await), (404, "NoSuchKey".into()));
}

#[tokio::test]
async fn what_is_deleted_is_gone_and_what_is_not_there_is_deleted_as_well() {
    let stage = stage().await;
    stage.put("a", "1").await;
    stage.put("large", vec![0; 500_000]).await;
    assert_eq!(stage.files(), 1);
    for key in ["a", "a", "never", "large"] {
        stage.client.delete_object().bucket(BUCKET).key(key).send().await.unwrap();
    }
    assert_eq!(
        failure(stage.client.get_object().bucket(BUCKET).key("a").send().await),
        (404, "NoSuchKey".into())
    );
    assert_eq!(stage.files(), 0);

    let etag = stage.put("b", "1").await;
    let on_condition = |etag: &str| stage.client.delete_object().bucket(BUCKET).key("b").if_match(etag);
    assert_eq!(failure(on_condition("\"0\"").send().await), (412, "PreconditionFailed".into()));
    on_condition(&etag).send().await.unwrap();

    let keys: Vec<_> = (0..1000).map(|number| format!("many/{number}")).collect();
    for some in keys.chunks(50) {
        futures_util::future::join_all(some.iter().map(|key| stage.put(key, ""))).await;
    }
    let keys = |quiet| {
        let objects =
            (0..1000).map(|n| ObjectIdentifier::builder().key(format!("many/{n}")).build().unwrap());
        Delete::builder().set_objects(Some(objects.collect())).quiet(quiet).build().unwrap()
    };
    let delete = |quiet| stage.client.delete_objects().bucket(BUCKET).delete(keys(quiet));
    assert_eq!(delete(false).send().await.unwrap().deleted().len(), 1000);
    assert!(delete(true).send().await.unwrap().deleted().is_empty());
    let left = stage.client.list_objects_v2().bucket(BUCKET).send().await.unwrap();
    assert_eq!(left.key_count, Some(0));
}

#[tokio::test]
async fn buckets_come_and_go() {
    let stage = stage().await;
    for wrong in ["UPPER", "ab", "a_b", "192.168.0.1"] {
        let made = stage.client.create_bucket().bucket(wrong).send().await;
        assert_eq!(failure(made).1, "InvalidBucketName", "{wrong}");
    }
    stage.client.create_bucket().bucket("second.bucket").send().await.unwrap();
    let listed = stage.client.list_buckets().send().await.unwrap();
    let names: Vec<_> = listed.buckets().iter().map(|bucket| bucket.name().unwrap()).collect();
    assert_eq!(names, [BUCKET, "second.bucket"]);
    stage.put("a", "1").await;
    let full = stage.client.delete_bucket().bucket(BUCKET).send().await;
    assert_eq!(failure(full), (409, "BucketNotEmpty".into()));
    stage.client.delete_bucket().bucket("second.bucket").send().await.unwrap();
    let gone = stage.client.list_objects_v2().bucket("second.bucket").send().await;
    assert_eq!(failure(gone), (404, "NoSuchBucket".into()));
    assert_eq!(failure(stage.client.head_bucket().bucket("second.bucket").send().await).0, 404);
    let put = stage.client.put_object().bucket("second.bucket").key("a").send().await;
    assert_eq!(failure(put), (404, "NoSuchBucket".into()));
}

#[tokio::test]
async fn a_body_is_read_to_its_end_while_it_is_overwritten() {
    let stage = stage().await;
    let body = vec![1; 20_000_000];
    stage.put("a", body.clone()).await;
    let got = stage.client.get_object().bucket(BUCKET).key("a").send().await.unwrap();
    stage.put("a", vec![2; 5_000_000]).await;
    assert!(got.body.collect().await.unwrap().to_vec() == body);
    for _ in 0..100 {
        if stage.files() == 1 {
            return;
        }
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    panic!("the body that was read is still there");
}

#[tokio::test]
async fn keys_and_metadata_have_s3s_limits() {
    let stage = stage().await;
    stage.put(&"k".repeat(1024), "1").await;
    let put = |key: &str| stage.client.put_object().bucket(BUCKET).key(key);
    assert_eq!(failure(put(&"k".repeat(1025)).send().await), (400, "KeyTooLongError".into()));
    put("a").metadata("m", "v".repeat(2047)).send().await.unwrap();
    assert_eq!(
        failure(put("a").metadata("m", "v".repeat(2048)).send().await),
        (400, "MetadataTooLarge".into())
    );
}
