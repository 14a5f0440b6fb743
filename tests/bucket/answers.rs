//! Fields of replies beyond the requested data, and requests that are rejected: field by field, like S3.

use std::time::{Duration, SystemTime};

use aws_sdk_s3::primitives::DateTime;
use aws_sdk_s3::types::{
    BucketInfo, BucketLocationConstraint, BucketType, ChecksumAlgorithm, ChecksumMode, ChecksumType,
    CompletedMultipartUpload, CompletedPart, CreateBucketConfiguration, DataRedundancy, Delete, Event,
    LambdaFunctionConfiguration, LocationInfo, LocationType, NotificationConfiguration, ObjectAttributes,
    ObjectIdentifier, QueueConfiguration, TopicConfiguration,
};
use rayfold_bucket::{QUEUE_ARN, Server};

use crate::stage::{BUCKET, Stage, client, failure, options, path, stage};

const PART: usize = 5 * 1024 * 1024;

/// Returns whether the time is within a minute of now.
fn is_recent(moment: &DateTime) -> bool {
    let moment = SystemTime::try_from(*moment).unwrap();
    let now = SystemTime::now();
    now.duration_since(moment).or_else(|_| moment.duration_since(now)).unwrap() < Duration::from_secs(60)
}

#[tokio::test]
async fn buckets_are_listed_with_their_owner_a_page_at_a_time() {
    let stage = stage().await;
    for name in ["albums", "series"] {
        stage.client.create_bucket().bucket(name).send().await.unwrap();
    }
    let first = stage.client.list_buckets().max_buckets(2).send().await.unwrap();
    assert_eq!(
        first.buckets().iter().map(|bucket| bucket.name().unwrap()).collect::<Vec<_>>(),
        ["albums", BUCKET]
    );
    for bucket in first.buckets() {
        assert_eq!(bucket.bucket_region(), Some("us-east-1"));
        assert!(is_recent(bucket.creation_date().unwrap()));
    }
    let owner = first.owner().unwrap();
    assert_eq!((owner.display_name(), owner.id()), (Some("owner"), Some("000000000000")));
    let token = first.continuation_token().unwrap();
    let second = stage.client.list_buckets().max_buckets(2).continuation_token(token).send().await.unwrap();
    assert_eq!(second.buckets().iter().map(|bucket| bucket.name().unwrap()).collect::<Vec<_>>(), ["series"]);
    assert_eq!(second.continuation_token(), None);
    let of = async |prefix: &str, region: &str| {
        let listed = stage.client.list_buckets().prefix(prefix).bucket_region(region).send().await.unwrap();
        (listed.prefix().map(str::to_owned), listed.buckets().len())
    };
    assert_eq!(of("s", "us-east-1").await, (Some("s".into()), 1));
    assert_eq!(of("", "eu-west-1").await.1, 0);
    for wrong in [0, 10_001] {
        let listed = stage.client.list_buckets().max_buckets(wrong).send().await;
        assert_eq!(failure(listed), (400, "InvalidArgument".into()));
    }
}

#[tokio::test]
async fn a_bucket_is_where_the_store_is_and_the_owners_alone() {
    let stage = stage().await;
    let create = |configuration| {
        stage.client.create_bucket().bucket("other").create_bucket_configuration(configuration).send()
    };
    let configuration = CreateBucketConfiguration::builder;
    let abroad = configuration().location_constraint(BucketLocationConstraint::EuWest1).build();
    assert_eq!(failure(create(abroad).await), (400, "IllegalLocationConstraintException".into()));
    let place = LocationInfo::builder().r#type(LocationType::AvailabilityZone).name("az1").build();
    let info = BucketInfo::builder()
        .data_redundancy(DataRedundancy::SingleAvailabilityZone)
        .r#type(BucketType::Directory)
        .build();
    for directory in [configuration().location(place).build(), configuration().bucket(info).build()] {
        assert_eq!(failure(create(directory).await), (501, "NotImplemented".into()));
    }
    create(configuration().location_constraint("us-east-1".into()).build()).await.unwrap();

    let head = stage.client.head_bucket().bucket(BUCKET).send().await.unwrap();
    assert_eq!(head.bucket_region(), Some("us-east-1"));
    let list = stage.client.get_bucket_acl().bucket(BUCKET).send().await.unwrap();
    assert_eq!(list.owner().unwrap().id(), Some("000000000000"));
    let [grant] = list.grants() else { panic!("{:?}", list.grants()) };
    assert_eq!(grant.grantee().unwrap().id(), Some("000000000000"));
    assert_eq!(grant.permission().unwrap().as_str(), "FULL_CONTROL");
}

/// For historical reasons an empty location stands for us-east-1.
#[tokio::test]
async fn a_buckets_location_is_the_region_unless_it_is_the_first_one() {
    for (region, expected) in [("us-east-1", ""), ("eu-central-1", "eu-central-1")] {
        let folder = tempfile::tempdir().unwrap();
        let options = rayfold_bucket::Options { region: region.into(), ..options(folder.path(), None) };
        let server = Server::start(options).await.unwrap();
        let config = client(server.address()).config().to_builder();
        let client =
            aws_sdk_s3::Client::from_conf(config.region(aws_sdk_s3::config::Region::new(region)).build());
        client.create_bucket().bucket(BUCKET).send().await.unwrap();
        let location = client.get_bucket_location().bucket(BUCKET).send().await.unwrap().location_constraint;
        assert_eq!(location.map(|place| place.as_str().to_owned()).unwrap_or_default(), expected);
    }
}

#[tokio::test]
async fn a_read_on_the_very_second_of_a_change_sees_it() {
    let stage = stage().await;
    stage.put("a", "1").await;
    let head = || stage.client.head_object().bucket(BUCKET).key("a");
    let modified = head().send().await.unwrap().last_modified.unwrap();
    assert!(is_recent(&modified));
    head().if_unmodified_since(modified).send().await.unwrap();
    assert_eq!(failure(head().if_modified_since(modified).send().await).0, 304);
    let before = DateTime::from_secs(modified.secs() - 1);
    assert_eq!(failure(head().if_unmodified_since(before).send().await).0, 412);
    // A 304 contains the version, a 412 does not.
    let get = async |name: &str, value: &str| {
        let url =
            stage.client.get_object().bucket(BUCKET).key("a").presigned(stage.presigning()).await.unwrap();
        let request = format!(
            "GET {} HTTP/1.1\r\nHost: {}\r\n{name}: {value}\r\nConnection: close\r\n\r\n",
            path(url.uri()),
            stage.server.address()
        );
        stage.raw(&request).await.to_ascii_lowercase()
    };
    let etag = "\"c4ca4238a0b923820dcc509a6f75849b\"";
    let same = get("If-None-Match", etag).await;
    assert!(same.starts_with("http/1.1 304") && same.contains(&format!("etag: {etag}")), "{same}");
    assert!(same.contains("last-modified: "), "{same}");
    let other = get("If-Match", "\"0\"").await;
    assert!(other.starts_with("http/1.1 412") && !other.contains("etag: "), "{other}");
}

#[tokio::test]
async fn the_headers_of_a_body_are_returned() {
    let stage = stage().await;
    let date = DateTime::from_secs(2_000_000_000);
    let text = "Wed, 18 May 2033 03:33:20 GMT";
    stage.client.put_object().bucket(BUCKET).key("put").expires(date).send().await.unwrap();
    let source = format!("{BUCKET}/put");
    stage.client.copy_object().bucket(BUCKET).key("copied").copy_source(source).send().await.unwrap();
    for key in ["put", "copied"] {
        let head = stage.client.head_object().bucket(BUCKET).key(key).send().await.unwrap();
        assert_eq!(head.expires_string.as_deref(), Some(text), "{key}");
        let got = stage.client.get_object().bucket(BUCKET).key(key).send().await.unwrap();
        assert_eq!(got.expires_string.as_deref(), Some(text), "{key}");
    }
    // Without a media type, which every client of AWS sends.
    let url =
        stage.client.put_object().bucket(BUCKET).key("raw").presigned(stage.presigning()).await.unwrap();
    let request = format!(
        "PUT {} HTTP/1.1\r\nHost: {}\r\nContent-Length: 2\r\nConnection: close\r\n\r\nhi",
        path(url.uri()),
        stage.server.address()
    );
    assert!(stage.raw(&request).await.starts_with("HTTP/1.1 200"));
    let got = stage.client.get_object().bucket(BUCKET).key("raw").send().await.unwrap();
    assert_eq!((got.content_type.as_deref(), got.expires_string), (Some("binary/octet-stream"), None));
}

#[tokio::test]
async fn deletes_of_many_are_refused_whole_where_they_ask_for_what_is_not_there() {
    let stage = stage().await;
    stage.put("a", "1").await;
    let object = || ObjectIdentifier::builder().key("a");
    let delete = async |objects: Vec<ObjectIdentifier>| {
        let all = Delete::builder().set_objects(Some(objects)).build().unwrap();
        stage.client.delete_objects().bucket(BUCKET).delete(all).send().await
    };
    let sized = object().size(1).build().unwrap();
    let dated = object().last_modified_time(DateTime::from_secs(1)).build().unwrap();
    for on_condition in [sized, dated] {
        assert_eq!(failure(delete(vec![on_condition]).await), (501, "NotImplemented".into()));
    }
    let of_version = object().version_id("3sL4kqtJlcpXroDTDmJ").build().unwrap();
    assert_eq!(failure(delete(vec![of_version]).await), (400, "InvalidRequest".into()));
    assert_eq!(failure(delete(Vec::new()).await), (400, "MalformedXML".into()));
    let too_many = (0..1001).map(|n| ObjectIdentifier::builder().key(format!("{n}")).build().unwrap());
    assert_eq!(failure(delete(too_many.collect()).await), (400, "MalformedXML".into()));
    let copied = stage.client.copy_object().bucket(BUCKET).key("b");
    let of_version = copied.copy_source(format!("{BUCKET}/a?versionId=3sL4kqtJlcpXroDTDmJ"));
    assert_eq!(failure(of_version.send().await), (400, "InvalidArgument".into()));
    assert_eq!(stage.get("a").await, b"1");
    let the_only = object().version_id("null").build().unwrap();
    assert_eq!(delete(vec![the_only]).await.unwrap().deleted()[0].key(), Some("a"));
}

#[tokio::test]
async fn listings_repeat_what_was_asked_and_name_the_next_marker_as_s3_does() {
    let stage = stage().await;
    for key in ["a", "b", "c"] {
        stage.put(key, "1").await;
    }
    for (delimiter, expected) in [("/", Some("/")), ("", None)] {
        let second = stage.client.list_objects_v2().bucket(BUCKET).delimiter(delimiter).send().await.unwrap();
        assert_eq!(second.delimiter(), expected);
        let first = stage.client.list_objects().bucket(BUCKET).delimiter(delimiter).send().await.unwrap();
        assert_eq!((first.delimiter(), first.next_marker()), (expected, None));
    }
    let cut = stage.client.list_objects().bucket(BUCKET).max_keys(2);
    assert_eq!(cut.clone().delimiter("/").send().await.unwrap().next_marker(), Some("b"));
    assert_eq!(cut.send().await.unwrap().next_marker(), None);
    let page = stage.client.list_objects_v2().bucket(BUCKET).start_after("").send().await.unwrap();
    assert_eq!(page.contents().len(), 3);
}

#[tokio::test]
async fn notifications_that_cannot_be_are_refused() {
    let stage = stage().await;
    let set = async |all: NotificationConfiguration| {
        let set = stage.client.put_bucket_notification_configuration().bucket(BUCKET);
        set.notification_configuration(all).send().await
    };
    let created = || Event::from("s3:ObjectCreated:*");
    let topic = TopicConfiguration::builder().topic_arn("arn:aws:sns:us-east-1:1:t").events(created());
    let topic = NotificationConfiguration::builder().topic_configurations(topic.build().unwrap()).build();
    let function = LambdaFunctionConfiguration::builder()
        .lambda_function_arn("arn:aws:lambda:us-east-1:1:function:f")
        .events(created());
    let function = function.build().unwrap();
    let function = NotificationConfiguration::builder().lambda_function_configurations(function).build();
    for elsewhere in [topic, function] {
        assert_eq!(failure(set(elsewhere).await), (501, "NotImplemented".into()));
    }
    let rules = |count| {
        let rule = QueueConfiguration::builder().queue_arn(QUEUE_ARN).events(created()).build().unwrap();
        NotificationConfiguration::builder().set_queue_configurations(Some(vec![rule; count])).build()
    };
    assert_eq!(failure(set(rules(101)).await), (400, "InvalidArgument".into()));
    set(rules(100)).await.unwrap();
}

#[tokio::test]
async fn a_part_of_what_has_none_is_the_whole() {
    let stage = stage().await;
    stage.put("a", "hello").await;
    stage.put("empty", "").await;
    let part = |key: &str, number| stage.client.head_object().bucket(BUCKET).key(key).part_number(number);
    let first = part("a", 1).send().await.unwrap();
    assert_eq!((first.content_length, first.content_range.as_deref()), (Some(5), Some("bytes 0-4/5")));
    assert_eq!(part("empty", 1).send().await.unwrap().content_range, None);
    assert_eq!(failure(part("a", 2).send().await).0, 416);
    assert_eq!(failure(part("a", 10_001).send().await).0, 400);
}

#[tokio::test]
async fn attributes_are_those_that_were_asked_for() {
    let stage = stage().await;
    let key = "film";
    let begun = stage.client.create_multipart_upload().bucket(BUCKET).key(key).send().await.unwrap();
    let id = begun.upload_id.unwrap();
    let parts = upload(&stage, key, &id, &[vec![1; PART], vec![2; PART], b"the end".to_vec()], None).await;
    complete(&stage, key, &id, parts).await;
    let ask =
        |attribute| stage.client.get_object_attributes().bucket(BUCKET).key(key).object_attributes(attribute);
    let etag = ask(ObjectAttributes::Etag).send().await.unwrap();
    assert!(etag.e_tag().unwrap().trim_matches('"').ends_with("-3"), "{etag:?}");
    assert!(is_recent(etag.last_modified().unwrap()));
    assert_eq!((etag.object_size(), etag.storage_class(), etag.object_parts()), (None, None, None));
    let class = ask(ObjectAttributes::StorageClass).send().await.unwrap();
    assert_eq!((class.storage_class().unwrap().as_str(), class.e_tag()), ("STANDARD", None));
    let size = ask(ObjectAttributes::ObjectSize).send().await.unwrap();
    assert_eq!(size.object_size(), i64::try_from(2 * PART + 7).ok());
    let page = ask(ObjectAttributes::ObjectParts).max_parts(1).part_number_marker("1").send().await.unwrap();
    let page = page.object_parts.unwrap();
    assert_eq!(page.parts().iter().map(|part| part.part_number.unwrap()).collect::<Vec<_>>(), [2]);
    assert_eq!((page.is_truncated, page.next_part_number_marker.as_deref()), (Some(true), Some("2")));
    let last = ask(ObjectAttributes::ObjectParts).part_number_marker("2").send().await.unwrap();
    let last = last.object_parts.unwrap();
    assert_eq!(last.parts().iter().map(|part| part.size.unwrap()).collect::<Vec<_>>(), [7]);
    assert_eq!(last.is_truncated, Some(false));
}

/// Uploads parts in order.
async fn upload(
    stage: &Stage,
    key: &str,
    id: &str,
    bodies: &[Vec<u8>],
    algorithm: Option<ChecksumAlgorithm>,
) -> Vec<CompletedPart> {
    let mut parts = Vec::new();
    for (number, body) in (1..).zip(bodies) {
        let part = stage.client.upload_part().bucket(BUCKET).key(key).upload_id(id).part_number(number);
        let part = part.set_checksum_algorithm(algorithm.clone()).body(body.clone().into());
        let uploaded = part.send().await.unwrap();
        parts.push(
            CompletedPart::builder()
                .part_number(number)
                .set_e_tag(uploaded.e_tag)
                .set_checksum_crc32(uploaded.checksum_crc32)
                .set_checksum_crc32_c(uploaded.checksum_crc32_c)
                .set_checksum_crc64_nvme(uploaded.checksum_crc64_nvme)
                .set_checksum_sha1(uploaded.checksum_sha1)
                .set_checksum_sha256(uploaded.checksum_sha256)
                .build(),
        );
    }
    parts
}

async fn complete(
    stage: &Stage,
    key: &str,
    id: &str,
    parts: Vec<CompletedPart>,
) -> aws_sdk_s3::operation::complete_multipart_upload::CompleteMultipartUploadOutput {
    let parts = CompletedMultipartUpload::builder().set_parts(Some(parts)).build();
    let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key(key).upload_id(id);
    complete.multipart_upload(parts).send().await.unwrap()
}

const ALGORITHMS: [ChecksumAlgorithm; 5] = [
    ChecksumAlgorithm::Crc32,
    ChecksumAlgorithm::Crc32C,
    ChecksumAlgorithm::Crc64Nvme,
    ChecksumAlgorithm::Sha1,
    ChecksumAlgorithm::Sha256,
];

/// Returns the values of a reply by name, in this order.
macro_rules! sums {
    ($answer:expr) => {{
        let answer = &$answer;
        [
            answer.checksum_crc32.clone(),
            answer.checksum_crc32_c.clone(),
            answer.checksum_crc64_nvme.clone(),
            answer.checksum_sha1.clone(),
            answer.checksum_sha256.clone(),
        ]
    }};
}

#[tokio::test]
async fn every_step_of_an_upload_tells_its_checksum_under_its_own_name() {
    let stage = stage().await;
    stage.put("source", "hello").await;
    for (place, algorithm) in ALGORITHMS.into_iter().enumerate() {
        let only = |sums: &[Option<String>; 5], what: &str| {
            let named: Vec<_> = sums.iter().map(Option::is_some).collect();
            let expected: Vec<_> = (0..5).map(|number| number == place).collect();
            assert_eq!(named, expected, "{what} of {algorithm:?}");
        };
        let key = algorithm.as_str();
        let begun = stage.client.create_multipart_upload().bucket(BUCKET).key(key);
        let begun = begun.checksum_algorithm(algorithm.clone()).send().await.unwrap();
        assert_eq!((begun.bucket(), begun.key()), (Some(BUCKET), Some(key)));
        assert_eq!(begun.checksum_algorithm(), Some(&algorithm));
        let kind = begun.checksum_type.clone().unwrap();
        let expected = if place == 2 { ChecksumType::FullObject } else { ChecksumType::Composite };
        assert_eq!(kind, expected, "{algorithm:?}");
        let id = begun.upload_id.unwrap();
        let mut parts = upload(&stage, key, &id, &[vec![1; PART]], Some(algorithm.clone())).await;
        only(&sums!(parts[0]), "a part");
        let copied = stage.client.upload_part_copy().bucket(BUCKET).key(key).upload_id(&id).part_number(2);
        let copied = copied.copy_source(format!("{BUCKET}/source")).send().await.unwrap();
        let copied = copied.copy_part_result.unwrap();
        only(&sums!(copied), "a copied part");
        assert!(is_recent(&copied.last_modified.unwrap()));
        parts.push(CompletedPart::builder().part_number(2).set_e_tag(copied.e_tag).build());
        let listed = stage.client.list_parts().bucket(BUCKET).key(key).upload_id(&id).send().await.unwrap();
        assert_eq!((listed.checksum_algorithm(), listed.checksum_type()), (Some(&algorithm), Some(&kind)));
        assert_eq!(
            (listed.bucket(), listed.key(), listed.upload_id()),
            (Some(BUCKET), Some(key), Some(&*id))
        );
        assert_eq!((listed.max_parts(), listed.part_number_marker()), (Some(1000), Some("0")));
        assert_eq!(listed.storage_class().unwrap().as_str(), "STANDARD");
        let owners = (listed.owner().unwrap().id(), listed.initiator().unwrap().id());
        assert_eq!(owners, (Some("000000000000"), Some("000000000000")));
        for part in listed.parts() {
            only(&sums!(part), "a listed part");
            assert!(is_recent(part.last_modified().unwrap()));
        }
        let uploads = stage.client.list_multipart_uploads().bucket(BUCKET).send().await.unwrap();
        let [under_way] = uploads.uploads() else { panic!("{uploads:?}") };
        assert_eq!(
            (under_way.checksum_algorithm(), under_way.checksum_type()),
            (Some(&algorithm), Some(&kind))
        );
        assert!(is_recent(under_way.initiated().unwrap()));
        let completed = complete(&stage, key, &id, parts).await;
        only(&sums!(completed), "the whole");
        assert_eq!((completed.bucket(), completed.key()), (Some(BUCKET), Some(key)));
        assert_eq!(completed.checksum_type(), Some(&kind));
        let head = stage.client.head_object().bucket(BUCKET).key(key).checksum_mode(ChecksumMode::Enabled);
        let head = head.send().await.unwrap();
        assert_eq!((sums!(head), head.checksum_type()), (sums!(completed), Some(&kind)));
        let copied =
            stage.client.copy_object().bucket(BUCKET).key("copy").copy_source(format!("{BUCKET}/{key}"));
        let copied = copied.send().await.unwrap().copy_object_result.unwrap();
        only(&sums!(copied), "a copy");
        assert!(is_recent(&copied.last_modified.unwrap()));
        assert_eq!(copied.checksum_type, Some(ChecksumType::FullObject));
        let attributes = stage.client.get_object_attributes().bucket(BUCKET).key(key);
        let attributes = attributes
            .object_attributes(ObjectAttributes::Checksum)
            .object_attributes(ObjectAttributes::ObjectParts);
        let attributes = attributes.send().await.unwrap();
        let sum = attributes.checksum.unwrap();
        assert_eq!((sums!(sum), sum.checksum_type()), (sums!(completed), Some(&kind)));
        let parts = attributes.object_parts.unwrap();
        only(&sums!(parts.parts()[0]), "an attribute's part");
    }
}

#[tokio::test]
async fn uploads_refuse_checksums_that_do_not_fit_together() {
    let stage = stage().await;
    let begin = || stage.client.create_multipart_upload().bucket(BUCKET).key("film");
    let kind_alone = begin().checksum_type(ChecksumType::FullObject);
    assert_eq!(failure(kind_alone.send().await), (400, "InvalidRequest".into()));
    let whole_sha =
        begin().checksum_algorithm(ChecksumAlgorithm::Sha1).checksum_type(ChecksumType::FullObject);
    assert_eq!(failure(whole_sha.send().await), (400, "InvalidRequest".into()));
    let begun = begin().checksum_algorithm(ChecksumAlgorithm::Sha1).send().await.unwrap();
    let id = begun.upload_id.unwrap();
    let part = |algorithm| {
        let part = stage.client.upload_part().bucket(BUCKET).key("film").upload_id(&id).part_number(1);
        part.checksum_algorithm(algorithm).body(b"hello".to_vec().into())
    };
    assert_eq!(failure(part(ChecksumAlgorithm::Sha256).send().await), (400, "InvalidRequest".into()));
    let kept = part(ChecksumAlgorithm::Sha1).send().await.unwrap();

    // The sums at the end are verified too.
    let listed = || CompletedPart::builder().part_number(1).set_e_tag(kept.e_tag.clone());
    let complete = |part: CompletedPart| {
        let parts = CompletedMultipartUpload::builder().parts(part).build();
        let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
        complete.multipart_upload(parts)
    };
    let other = "AAAAAAAAAAAAAAAAAAAAAAAAAAA=";
    let wrong_part = complete(listed().checksum_sha1(other).build());
    assert_eq!(failure(wrong_part.send().await), (400, "InvalidPart".into()));
    let wrong_size = complete(listed().build()).mpu_object_size(6);
    assert_eq!(failure(wrong_size.send().await), (400, "InvalidRequest".into()));
    let wrong_kind = complete(listed().build()).checksum_type(ChecksumType::FullObject);
    assert_eq!(failure(wrong_kind.send().await), (400, "InvalidRequest".into()));
    for wrong in [
        complete(listed().build()).checksum_sha1(other),
        complete(listed().build()).checksum_crc32("AAAAAA=="),
    ] {
        assert_eq!(failure(wrong.send().await), (400, "BadDigest".into()));
    }
    // The SHA-1 of the SHA-1 of "hello", computed by Python's hashlib, with and without the number of parts.
    let whole = "a0+JpU4tJ+zX6NoFtKuP2dHYsRk=";
    let right = complete(listed().set_checksum_sha1(kept.checksum_sha1.clone()).build());
    let right = right.checksum_type(ChecksumType::Composite).mpu_object_size(5).checksum_sha1(whole);
    let completed = right.send().await.unwrap();
    assert_eq!(completed.checksum_sha1, Some(format!("{whole}-1")));
}

/// An upload without its own algorithm accepts parts with any. At the end the client may state the parts' checksums and
/// their type, or omit them.
#[tokio::test]
async fn an_upload_without_an_algorithm_takes_any() {
    let stage = stage().await;
    let begun = stage.client.create_multipart_upload().bucket(BUCKET).key("film").send().await.unwrap();
    let id = begun.upload_id.unwrap();
    let parts = upload(&stage, "film", &id, &[b"hello".to_vec()], Some(ChecksumAlgorithm::Sha256)).await;
    let parts = CompletedMultipartUpload::builder().set_parts(Some(parts)).build();
    let complete = stage.client.complete_multipart_upload().bucket(BUCKET).key("film").upload_id(&id);
    let complete = complete.multipart_upload(parts).checksum_type(ChecksumType::FullObject);
    assert_eq!(complete.send().await.unwrap().key(), Some("film"));
    assert_eq!(stage.get("film").await, b"hello");
}

#[tokio::test]
async fn a_puts_checksum_is_returned_by_its_name_and_kind() {
    let stage = stage().await;
    for (place, algorithm) in ALGORITHMS.into_iter().enumerate() {
        let put = stage.client.put_object().bucket(BUCKET).key("a").checksum_algorithm(algorithm);
        let put = put.send().await.unwrap();
        let named: Vec<_> = sums!(put).iter().map(Option::is_some).collect();
        assert_eq!(named, (0..5).map(|number| number == place).collect::<Vec<_>>());
        assert_eq!(put.checksum_type(), Some(&ChecksumType::FullObject));
    }
}

/// Bodies in parts are several files. The later ones are opened late.
#[tokio::test]
async fn a_body_in_parts_is_read_to_its_end_while_it_is_deleted() {
    let stage = stage().await;
    let begun = stage.client.create_multipart_upload().bucket(BUCKET).key("film").send().await.unwrap();
    let id = begun.upload_id.unwrap();
    let bodies: Vec<_> = (1..=4).map(|byte| vec![byte; PART]).collect();
    let parts = upload(&stage, "film", &id, &bodies, None).await;
    complete(&stage, "film", &id, parts).await;
    let got = stage.client.get_object().bucket(BUCKET).key("film").send().await.unwrap();
    stage.client.delete_object().bucket(BUCKET).key("film").send().await.unwrap();
    assert!(got.body.collect().await.unwrap().to_vec() == bodies.concat());
    for _ in 0..200 {
        if stage.files() == 0 {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("parts that were read are still there");
}

/// Names of body files begin with the number of the server's start, so no later run overwrites a file of an earlier
/// one.
#[tokio::test]
async fn what_a_later_run_keeps_is_not_in_the_place_of_what_an_earlier_one_kept() {
    let folder = tempfile::tempdir().unwrap();
    for run in 0_u8..3 {
        let server = Server::start(options(folder.path(), None)).await.unwrap();
        let client = client(server.address());
        if run == 0 {
            client.create_bucket().bucket(BUCKET).send().await.unwrap();
        }
        for size in [10, 500_000] {
            let put = client.put_object().bucket(BUCKET).key(format!("{run}/{size}"));
            put.body(vec![run; size].into()).send().await.unwrap();
        }
        for earlier in 0..=run {
            for size in [10, 500_000] {
                let got = client.get_object().bucket(BUCKET).key(format!("{earlier}/{size}"));
                let body = got.send().await.unwrap().body.collect().await.unwrap().to_vec();
                assert!(body == vec![earlier; size], "{earlier}/{size} in run {run}");
            }
        }
        server.stop().await;
    }
}

#[tokio::test]
async fn a_server_that_is_dropped_answers_no_more() {
    let stage = stage().await;
    let address = stage.server.address();
    drop(stage.server);
    for _ in 0..500 {
        if tokio::net::TcpStream::connect(address).await.is_err() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("it still takes connections");
}
