//! Rare cases for S3 clients: odd keys in XML, error messages, dates, connections, access lists.

use std::time::{Duration, SystemTime};

use aws_sdk_s3::primitives::{DateTime, DateTimeFormat};
use aws_sdk_s3::types::{
    BucketCannedAcl, Delete, ObjectAttributes, ObjectCannedAcl, ObjectIdentifier, ServerSideEncryption,
    StorageClass,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::signed::{Answer, md5, send};
use crate::stage::{BUCKET, failure, path, raw, stage};

/// macOS has a file `Icon\r`. An XML parser reads a bare carriage return as a line feed.
#[tokio::test]
async fn keys_with_control_characters_come_back_from_every_listing() {
    let stage = stage().await;
    let keys = ["a\rb.txt", "Icon\r", "c\nd\te", "\u{1}\u{1f}", "f\u{7f}", " g ", "<&\"'>", "h\r\n"];
    for key in keys {
        stage.put(key, "1").await;
    }
    let listed = send(&stage, "GET", "/films", &[], b"").await;
    assert!(listed.body.contains("<Key>a&#13;b.txt</Key>"), "{}", listed.body);
    assert!(listed.body.contains("<Key>&#1;&#31;</Key>"), "{}", listed.body);
    assert!(!listed.body.contains(|c: char| c.is_control()), "{:?}", listed.body);
    let versions = send(&stage, "GET", "/films?versions&prefix=a%0D", &[], b"").await;
    assert!(versions.body.contains("<Prefix>a&#13;</Prefix>"), "{}", versions.body);
    let upload = send(&stage, "POST", "/films/a%0Db?uploads", &[], b"").await;
    assert!(upload.body.contains("<Key>a&#13;b</Key>"), "{}", upload.body);
    let mut sorted: Vec<_> = keys.iter().filter(|key| !key.contains(['\u{1}', '\u{1f}'])).collect();
    sorted.sort();
    for key in &sorted {
        let object = ObjectIdentifier::builder().key(**key).build().unwrap();
        let one = Delete::builder().objects(object).build().unwrap();
        let deleted = stage.client.delete_objects().bucket(BUCKET).delete(one).send().await.unwrap();
        assert_eq!(deleted.deleted()[0].key(), Some(**key));
    }
    let left = stage.client.list_objects_v2().bucket(BUCKET).send().await.unwrap();
    assert_eq!(left.key_count, Some(1), "{left:?}");
}

/// This includes errors for which `s3s` sets only a code.
#[tokio::test]
async fn every_error_has_a_message() {
    let stage = stage().await;
    stage.put("a", "1").await;
    let sum = md5(b"<Delete>");
    for (method, target, headers, body) in [
        ("GET", "/UPPER", vec![], &b""[..]),
        ("GET", "/films/none", vec![], b""),
        ("GET", "/nowhere", vec![], b""),
        ("GET", "/films/%FF", vec![], b""),
        ("PUT", "/films?annex", vec![], b""),
        ("PATCH", "/films", vec![], b""),
        ("POST", "/films?delete", vec![("content-md5", sum.as_str())], b"<Delete>"),
        ("POST", "/films?delete", vec![("content-md5", "1B2M2Y8AsgTpgAmY7PhCfg==")], b""),
        ("GET", "/films/a?partNumber=x", vec![], b""),
        ("GET", "/films?max-keys=x", vec![], b""),
        ("PUT", "/films/a", vec![("x-amz-copy-source", "nonsense")], b""),
        ("GET", "/films?policy", vec![], b""),
    ] {
        let answer = send(&stage, method, target, &headers, body).await;
        let has_reason = !answer.element("Code").is_empty() && !answer.element("Message").is_empty();
        assert!(answer.status >= 400 && has_reason, "{method} {target}: {answer:?}");
    }
    let long = format!("/films/{}", "k".repeat(1025));
    assert!(!send(&stage, "GET", &long, &[], b"").await.element("Message").is_empty());
    let unsigned = "GET /films HTTP/1.1\r\nHost: h\r\nConnection: close\r\n";
    for authorization in ["", "AWS4-HMAC-SHA256 nonsense", "AWS nobody:x", "Bearer x"] {
        let request = format!("{unsigned}Authorization: {authorization}\r\n\r\n");
        let answer = Answer::parse(&stage.raw(&request).await);
        assert!(answer.status >= 400 && !answer.element("Message").is_empty(), "{authorization}: {answer:?}");
    }
}

/// Botocore sends `Expect` also with an empty body, and waits for ever on a connection that stays open after a
/// rejection.
#[tokio::test]
async fn a_refusal_ends_the_connection_of_a_client_that_waits_to_send() {
    let stage = stage().await;
    stage.put("a", "1").await;
    let put = stage.client.put_object().bucket(BUCKET).key("a");
    for (url, status) in [
        (put.presigned(stage.presigning()).await.unwrap().uri().to_owned(), "412"),
        (format!("http://h/{BUCKET}/a?annex"), "501"),
    ] {
        let request = format!(
            "PUT {} HTTP/1.1\r\nHost: {}\r\nIf-None-Match: *\r\nExpect: 100-continue\r\nContent-Length: 0\r\n\r\n",
            path(&url),
            stage.server.address()
        );
        let mut stream = tokio::net::TcpStream::connect(stage.server.address()).await.unwrap();
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        let read = tokio::time::timeout(Duration::from_secs(5), stream.read_to_string(&mut answer)).await;
        assert!(read.is_ok(), "the connection stays open");
        assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{answer}");
        assert!(answer.to_lowercase().contains("connection: close"), "{answer}");
    }
}

#[tokio::test]
async fn a_request_may_be_dated_by_date_alone() {
    use aws_sigv4::sign::v4::{calculate_signature, generate_signing_key};

    let stage = stage().await;
    stage.put("a", "hello").await;
    let ask = async |date: String, skew: u64| {
        let now = SystemTime::now() - Duration::from_secs(skew);
        let short: String = DateTime::from(now)
            .fmt(DateTimeFormat::DateTime)
            .unwrap()
            .chars()
            .filter(|c| !matches!(c, '-' | ':'))
            .collect();
        let short = format!("{}Z", short.split(['.', 'Z']).next().unwrap());
        let date = if date.is_empty() { short.clone() } else { date };
        let host = stage.server.address();
        let canonical = format!(
            "GET\n/films/a\n\ndate:{date}\nhost:{host}\nx-amz-content-sha256:UNSIGNED-PAYLOAD\n\n\
             date;host;x-amz-content-sha256\nUNSIGNED-PAYLOAD"
        );
        use s3s::crypto::{Checksum as _, Sha256};
        let hash: String =
            Sha256::checksum(canonical.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect();
        let scope = format!("{}/us-east-1/s3/aws4_request", &short[..8]);
        let text = format!("AWS4-HMAC-SHA256\n{short}\n{scope}\n{hash}");
        let key = generate_signing_key("secret-key", now, "us-east-1", "s3");
        let signature = calculate_signature(key, text.as_bytes());
        let request = format!(
            "GET /films/a HTTP/1.1\r\nHost: {host}\r\nDate: {date}\r\nx-amz-content-sha256: UNSIGNED-PAYLOAD\r\n\
             Authorization: AWS4-HMAC-SHA256 Credential=root/{scope}, \
             SignedHeaders=date;host;x-amz-content-sha256, Signature={signature}\r\nConnection: close\r\n\r\n"
        );
        Answer::parse(&raw(host, request.as_bytes()).await)
    };
    let http = |skew| {
        let time = SystemTime::now() - Duration::from_secs(skew);
        DateTime::from_secs(time.duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs() as i64)
            .fmt(DateTimeFormat::HttpDate)
            .unwrap()
    };
    // The second may change between two reads of the clock.
    let mut answers = Vec::new();
    for _ in 0..3 {
        answers.push(ask(http(0), 0).await.status);
    }
    assert!(answers.contains(&200), "{answers:?}");
    assert_eq!(ask(String::new(), 0).await.body, "hello");
    assert_eq!(ask(http(3600), 3600).await.failure().0, 403, "an hour is too long ago");
}

#[tokio::test]
async fn what_holds_anyway_may_be_said_and_other_lists_are_not_there() {
    let stage = stage().await;
    let put = || stage.client.put_object().bucket(BUCKET).key("a").body(b"1".to_vec().into());
    put().server_side_encryption(ServerSideEncryption::Aes256).send().await.unwrap();
    for list in [ObjectCannedAcl::Private, ObjectCannedAcl::BucketOwnerFullControl] {
        put().acl(list.clone()).send().await.unwrap();
        stage.client.put_object_acl().bucket(BUCKET).key("a").acl(list).send().await.unwrap();
    }
    stage.client.put_bucket_acl().bucket(BUCKET).acl(BucketCannedAcl::Private).send().await.unwrap();
    let not_supported = (400, "AccessControlListNotSupported".to_owned());
    for list in [
        ObjectCannedAcl::PublicRead,
        ObjectCannedAcl::PublicReadWrite,
        ObjectCannedAcl::AuthenticatedRead,
        ObjectCannedAcl::AwsExecRead,
        ObjectCannedAcl::BucketOwnerRead,
    ] {
        assert_eq!(failure(put().acl(list.clone()).send().await), not_supported, "{list:?}");
        let set = stage.client.put_object_acl().bucket(BUCKET).key("a").acl(list);
        assert_eq!(failure(set.send().await), not_supported);
    }
    assert_eq!(failure(put().grant_read("id=1").send().await), not_supported);
    let public = stage.client.put_bucket_acl().bucket(BUCKET).acl(BucketCannedAcl::PublicRead);
    assert_eq!(failure(public.send().await), not_supported);
    let list = |id: &str| {
        format!(
            "<AccessControlPolicy><AccessControlList><Grant><Grantee xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
             xsi:type=\"CanonicalUser\"><ID>{id}</ID></Grantee><Permission>FULL_CONTROL</Permission></Grant>\
             </AccessControlList><Owner><ID>000000000000</ID></Owner></AccessControlPolicy>"
        )
    };
    for (id, status) in [("000000000000", 200), ("111122223333", 400)] {
        let body = list(id);
        let sum = md5(body.as_bytes());
        let set = send(&stage, "PUT", "/films/a?acl", &[("content-md5", &sum)], body.as_bytes()).await;
        assert_eq!(set.status, status, "{set:?}");
    }
}

#[tokio::test]
async fn a_copy_onto_itself_may_say_how_it_is_kept() {
    let stage = stage().await;
    stage.put("a", "hello").await;
    let copy = || stage.client.copy_object().bucket(BUCKET).key("a").copy_source(format!("{BUCKET}/a"));
    copy().storage_class(StorageClass::Standard).send().await.unwrap();
    copy().server_side_encryption(ServerSideEncryption::Aes256).send().await.unwrap();
    assert_eq!(failure(copy().send().await), (400, "InvalidRequest".into()));
    assert_eq!(failure(copy().storage_class(StorageClass::Glacier).send().await).0, 501);
    assert_eq!(stage.get("a").await, b"hello");
}

#[tokio::test]
async fn buckets_have_names_as_with_s3_and_are_made_again_in_its_first_region() {
    let stage = stage().await;
    stage.put("a", "1").await;
    stage.client.create_bucket().bucket(BUCKET).send().await.unwrap();
    assert_eq!(stage.get("a").await, b"1");
    for name in ["a.-b", "a-.b", "films.-", "sthree-films", "films--x-s3", "films-s3alias"] {
        let made = send(&stage, "PUT", &format!("/{name}"), &[], b"").await;
        assert_eq!(made.failure(), (400, "InvalidBucketName"), "{name}");
    }
    let folder = tempfile::tempdir().unwrap();
    let options =
        rayfold_bucket::Options { region: "eu-west-1".into(), ..crate::stage::options(folder.path(), None) };
    let server = rayfold_bucket::Server::start(options).await.unwrap();
    let config = crate::stage::client(server.address()).config().to_builder();
    let config = config.region(aws_sdk_s3::config::Region::new("eu-west-1"));
    let client = aws_sdk_s3::Client::from_conf(config.build());
    client.create_bucket().bucket(BUCKET).send().await.unwrap();
    let again = client.create_bucket().bucket(BUCKET).send().await;
    assert_eq!(failure(again), (409, "BucketAlreadyOwnedByYou".into()));
}

#[tokio::test]
async fn an_entity_tag_among_attributes_has_no_quotes() {
    let stage = stage().await;
    stage.put("a", "123456789").await;
    let attributes = stage.client.get_object_attributes().bucket(BUCKET).key("a");
    let attributes = attributes.object_attributes(ObjectAttributes::Etag).send().await.unwrap();
    assert_eq!(attributes.e_tag(), Some("25f9e794323b453885f5181f1b624d0b"));
}

#[tokio::test]
async fn a_head_may_override_headers_and_a_range_may_be_on_a_condition() {
    let stage = stage().await;
    let etag = stage.put("a", "hello").await;
    let head = stage.client.head_object().bucket(BUCKET).key("a").response_content_type("text/plain");
    assert_eq!(head.send().await.unwrap().content_type(), Some("text/plain"));
    let range = async |condition: &str| {
        let headers = [("range", "bytes=1-2"), ("if-range", condition)];
        let answer = send(&stage, "GET", "/films/a", &headers, b"").await;
        (answer.status, answer.body)
    };
    assert_eq!(range(&etag).await, (206, "el".into()));
    assert_eq!(range("\"0\"").await, (200, "hello".into()));
}
