//! Bodies in the forms that clients send: in chunks without a length, in browser forms, with digests that are right,
//! wrong, missing, or of an unsupported algorithm.

use std::time::{Duration, SystemTime};

use aws_sdk_s3::primitives::{DateTime, DateTimeFormat};

use crate::signed::{Answer, Signed, md5, send, send_signed};
use crate::stage::{BUCKET, Stage, raw, stage};

const CHUNKED: Signed = Signed::As("STREAMING-UNSIGNED-PAYLOAD-TRAILER");

/// Returns the body in HTTP chunks, whose boundaries are unrelated to the chunks of the body.
fn in_pieces(body: &str, piece: usize) -> Vec<u8> {
    let mut sent = String::new();
    for piece in body.as_bytes().chunks(piece) {
        sent += &format!("{:x}\r\n{}\r\n", piece.len(), std::str::from_utf8(piece).unwrap());
    }
    (sent + "0\r\n\r\n").into_bytes()
}

/// Returns the body in S3 chunks, followed by its CRC-32.
fn in_chunks(body: &str, trailer: &str) -> String {
    let mut sent = String::new();
    for chunk in body.as_bytes().chunks(8192) {
        sent += &format!("{:x}\r\n{}\r\n", chunk.len(), std::str::from_utf8(chunk).unwrap());
    }
    format!("{sent}0\r\n{trailer}\r\n\r\n")
}

async fn put_in_chunks(stage: &Stage, target: &str, body: &str, crc: &str, piece: usize) -> Answer {
    let length = body.len().to_string();
    let headers = [
        ("content-encoding", "aws-chunked"),
        ("transfer-encoding", "chunked"),
        ("x-amz-decoded-content-length", length.as_str()),
        ("x-amz-trailer", "x-amz-checksum-crc32"),
    ];
    let sent = in_pieces(&in_chunks(body, &format!("x-amz-checksum-crc32:{crc}")), piece);
    send_signed(stage, "PUT", target, &headers, &sent, CHUNKED).await
}

/// The JavaScript client sends a stream without a `Content-Length`.
#[tokio::test]
async fn a_stream_has_no_length_but_that_of_its_bytes() {
    let stage = stage().await;
    for (body, crc) in [("123456789", "y/Q5Jg=="), ("", "AAAAAA==")] {
        for piece in [1, 7, 10_000] {
            let answer = put_in_chunks(&stage, "/films/a", body, crc, piece).await;
            assert_eq!(answer.status, 200, "{body:?} in pieces of {piece}: {answer:?}");
            assert_eq!(stage.get("a").await, body.as_bytes());
        }
        assert_eq!(
            put_in_chunks(&stage, "/films/a", body, "AAAAAQ==", 7).await.failure(),
            (400, "BadDigest")
        );
    }
    let upload = send(&stage, "POST", "/films/a?uploads", &[], b"").await;
    let target = format!("/films/a?partNumber=1&uploadId={}", upload.element("UploadId"));
    let part = put_in_chunks(&stage, &target, "123456789", "y/Q5Jg==", 5).await;
    assert_eq!((part.status, part.header("x-amz-checksum-crc32")), (200, "y/q5jg=="), "{part:?}");
    // The declared length must be that of the bytes.
    for length in ["8", "10", "", "-1"] {
        let headers = [
            ("transfer-encoding", "chunked"),
            ("x-amz-decoded-content-length", length),
            ("x-amz-trailer", "x-amz-checksum-crc32"),
        ];
        let sent = in_pieces(&in_chunks("123456789", "x-amz-checksum-crc32:y/Q5Jg=="), 7);
        let answer = send_signed(&stage, "PUT", "/films/b", &headers, &sent, CHUNKED).await;
        assert!((400..500).contains(&answer.status), "{length}: {answer:?}");
    }
    // A body that is not in S3 chunks must have a length.
    let headers = [("transfer-encoding", "chunked")];
    let sent = in_pieces("hello", 2);
    let answer =
        send_signed(&stage, "PUT", "/films/b", &headers, &sent, Signed::As("UNSIGNED-PAYLOAD")).await;
    assert_eq!(answer.failure(), (411, "MissingContentLength"));
    assert_eq!(stage.client.list_objects_v2().bucket(BUCKET).send().await.unwrap().key_count, Some(1));
}

fn iso(time: SystemTime) -> String {
    DateTime::from(time).fmt(DateTimeFormat::DateTime).unwrap()
}

/// Posts a form with a file, signed like for a web page.
async fn post(stage: &Stage, extra: &[(&str, &str)], conditions: &str, age: Duration, file: &[u8]) -> Answer {
    let signed = SystemTime::now() - age;
    let date: String = iso(signed).chars().filter(|c| !matches!(c, '-' | ':')).collect();
    let date = format!("{}Z", date.split(['.', 'Z']).next().unwrap());
    let credential = format!("root/{}/us-east-1/s3/aws4_request", &date[..8]);
    let named = extra.iter().map(|(name, value)| format!(",{{\"{name}\":\"{value}\"}}")).collect::<String>();
    let policy = format!(
        "{{\"expiration\":\"{}\",\"conditions\":[{{\"bucket\":\"films\"}},[\"starts-with\",\"$key\",\"up/\"],\
         {{\"x-amz-algorithm\":\"AWS4-HMAC-SHA256\"}},{{\"x-amz-credential\":\"{credential}\"}},\
         {{\"x-amz-date\":\"{date}\"}}{named}{conditions}]}}",
        iso(signed + Duration::from_secs(3600))
    );
    let policy = base64_simd::STANDARD.encode_to_string(policy);
    let time = signed;
    let key = aws_sigv4::sign::v4::generate_signing_key("secret-key", time, "us-east-1", "s3");
    let signature = aws_sigv4::sign::v4::calculate_signature(key, policy.as_bytes());
    let mut body = String::new();
    let fields = [
        ("key", "up/film.txt"),
        ("x-amz-algorithm", "AWS4-HMAC-SHA256"),
        ("x-amz-credential", &credential),
        ("x-amz-date", &date),
        ("policy", &policy),
        ("x-amz-signature", &signature),
    ];
    for (name, value) in fields.iter().chain(extra) {
        body += &format!("--edge\r\nContent-Disposition: form-data; name=\"{name}\"\r\n\r\n{value}\r\n");
    }
    body += "--edge\r\nContent-Disposition: form-data; name=\"file\"; filename=\"film.txt\"\r\n\
             Content-Type: text/plain\r\n\r\n";
    let body = [body.as_bytes(), file, b"\r\n--edge--\r\n"].concat();
    let head = format!(
        "POST /films HTTP/1.1\r\nHost: {}\r\nContent-Type: multipart/form-data; boundary=edge\r\n\
         Content-Length: {}\r\nConnection: close\r\n\r\n",
        stage.server.address(),
        body.len()
    );
    Answer::parse(&raw(stage.server.address(), &[head.as_bytes(), &body].concat()).await)
}

#[tokio::test]
async fn a_page_uploads_a_file_by_a_signed_form() {
    let stage = stage().await;
    let now = Duration::ZERO;
    let large = vec![b'x'; 3_000_000];
    for file in [&b"hello"[..], b"", &large] {
        let answer = post(&stage, &[("x-amz-meta-colour", "red"), ("acl", "private")], "", now, file).await;
        assert_eq!(answer.status, 204, "{} bytes: {answer:?}", file.len());
        assert!(stage.get("up/film.txt").await == file);
        let head = stage.client.head_object().bucket(BUCKET).key("up/film.txt").send().await.unwrap();
        assert_eq!(head.metadata().unwrap()["colour"], "red");
    }
    let answer = post(&stage, &[("success_action_status", "201")], "", now, b"hello").await;
    assert_eq!((answer.status, answer.element("Key")), (201, "up/film.txt"), "{answer:?}");
    // The form is valid until its policy expires, not for a quarter of an hour.
    assert_eq!(post(&stage, &[], "", Duration::from_secs(3000), b"hello").await.status, 204);
    let late = post(&stage, &[], "", Duration::from_secs(3700), b"hello").await;
    assert_eq!(late.failure(), (403, "AccessDenied"));

    let range = ",[\"content-length-range\",1,4]";
    assert_eq!(post(&stage, &[], range, now, b"hello").await.failure(), (400, "EntityTooLarge"));
    assert_eq!(post(&stage, &[], range, now, b"").await.failure(), (400, "EntityTooSmall"));
    let sum = |value| [("x-amz-checksum-crc32", value)];
    assert_eq!(post(&stage, &sum("y/Q5Jg=="), "", now, b"123456789").await.status, 204);
    assert_eq!(post(&stage, &sum("AAAAAA=="), "", now, b"123456789").await.failure(), (400, "BadDigest"));
    for (field, code) in [
        (("acl", "public-read"), (400, "AccessControlListNotSupported")),
        (("tagging", "<Tagging/>"), (501, "NotImplemented")),
        (("x-amz-storage-class", "GLACIER"), (501, "NotImplemented")),
        (("x-amz-server-side-encryption-customer-algorithm", "AES256"), (501, "NotImplemented")),
        (("x-amz-checksum-sha512", "AAAA"), (501, "NotImplemented")),
        (("annex", "1"), (501, "NotImplemented")),
    ] {
        assert_eq!(post(&stage, &[field], "", now, b"other").await.failure(), code, "{field:?}");
    }
    assert_eq!(stage.get("up/film.txt").await, b"123456789");
}

fn crc32(body: &[u8]) -> String {
    use s3s::crypto::{Checksum as _, Crc32};
    base64_simd::STANDARD.encode_to_string(Crc32::checksum(body))
}

#[tokio::test]
async fn a_digest_of_an_xml_body_is_compared() {
    let stage = stage().await;
    let deletes = b"<Delete><Object><Key>a</Key></Object></Delete>";
    let cors =
        b"<CORSConfiguration><CORSRule><AllowedMethod>GET</AllowedMethod><AllowedOrigin>*</AllowedOrigin>\
                 </CORSRule></CORSConfiguration>";
    let upload = send(&stage, "POST", "/films/b?uploads", &[], b"").await;
    let id = upload.element("UploadId").to_owned();
    let part = send(&stage, "PUT", &format!("/films/b?partNumber=1&uploadId={id}"), &[], b"hello").await;
    let complete = format!(
        "<CompleteMultipartUpload><Part><PartNumber>1</PartNumber><ETag>{}</ETag></Part></CompleteMultipartUpload>",
        part.header("etag")
    );
    let complete_at = format!("/films/b?uploadId={id}");
    let nothing = b"<NotificationConfiguration/>";
    let place = b"<CreateBucketConfiguration><LocationConstraint>us-east-1</LocationConstraint></CreateBucketConfiguration>";
    for (method, target, body, must) in [
        ("POST", "/films?delete", &deletes[..], true),
        ("PUT", "/films?cors", cors, true),
        ("PUT", "/films?notification", nothing, false),
        ("PUT", "/others", place, false),
        ("PUT", "/films?acl", b"", false),
        ("POST", &complete_at, complete.as_bytes(), false),
    ] {
        stage.put("a", "precious").await;
        let ask = async |headers: &[(&str, &str)]| {
            let acl = ("x-amz-acl", "private");
            let headers: Vec<_> =
                headers.iter().copied().chain((target == "/films?acl").then_some(acl)).collect();
            let answer = send(&stage, method, target, &headers, body).await;
            let is_there = stage.client.head_object().bucket(BUCKET).key("a").send().await.is_ok();
            assert!(answer.status < 300 || is_there, "{target} {headers:?} was refused and done");
            (answer.status, answer.element("Code").to_owned(), answer.element("Message").is_empty())
        };
        let wrong = md5(b"other");
        assert_eq!(ask(&[("content-md5", &wrong)]).await, (400, "BadDigest".into(), false), "{target}");
        assert_eq!(ask(&[("content-md5", "short")]).await, (400, "InvalidDigest".into(), false), "{target}");
        let is_of_object = target == complete_at;
        if !is_of_object {
            let crc = crc32(b"other");
            let answer = ask(&[("x-amz-checksum-crc32", &crc)]).await;
            assert_eq!(answer, (400, "BadDigest".into(), false), "{target}");
            let both = [("content-md5", &*md5(body)), ("x-amz-checksum-crc32", &*crc)];
            assert_eq!(ask(&both).await.1, "BadDigest", "{target}");
        }
        for unknown in ["sha512", "md5", "xxhash64", "xxhash3", "xxhash128"] {
            let header = format!("x-amz-checksum-{unknown}");
            assert_eq!(ask(&[(&header, "AAAA")]).await.0, 501, "{target} {unknown}");
        }
        if must {
            assert_eq!(ask(&[]).await, (400, "InvalidRequest".into(), false), "{target}");
        }
        let (right, crc) = (md5(body), crc32(body));
        if is_of_object {
            assert_eq!(ask(&[("content-md5", &right)]).await.0, 200, "{target}");
        } else {
            let done = ask(&[("content-md5", &right), ("x-amz-checksum-crc32", &crc)]).await;
            assert!(done.0 < 300, "{target}: {done:?}");
        }
    }
    assert_eq!(stage.get("b").await, b"hello");
}

#[tokio::test]
async fn a_checksum_of_an_algorithm_that_is_not_there_is_not_passed_over() {
    let stage = stage().await;
    for name in ["SHA512", "MD5", "XXHASH64", "XXHASH3", "XXHASH128"] {
        let header = format!("x-amz-checksum-{}", name.to_lowercase());
        for headers in [
            vec![(header.as_str(), "AAAA")],
            vec![("x-amz-sdk-checksum-algorithm", name)],
            vec![("x-amz-trailer", header.as_str())],
            vec![("x-amz-checksum-algorithm", name)],
        ] {
            let put = send(&stage, "PUT", "/films/a", &headers, b"hello").await;
            assert_eq!(put.failure(), (501, "NotImplemented"), "{headers:?}");
        }
        let create = [("x-amz-checksum-algorithm", name)];
        let create = send(&stage, "POST", "/films/a?uploads", &create, b"").await;
        assert_eq!(create.failure(), (501, "NotImplemented"), "{name}");
        let upload = send(&stage, "POST", "/films/a?uploads", &[], b"").await;
        let target = format!("/films/a?uploadId={}", upload.element("UploadId"));
        let part =
            send(&stage, "PUT", &format!("{target}&partNumber=1"), &[(&header, "AAAA")], b"hello").await;
        assert_eq!(part.failure(), (501, "NotImplemented"), "{name}");
        let list = format!(
            "<CompleteMultipartUpload><Part><PartNumber>1</PartNumber><Checksum{name}>AAAA</Checksum{name}></Part>\
             </CompleteMultipartUpload>"
        );
        let whole = send(&stage, "POST", &target, &[], list.as_bytes()).await;
        assert_eq!(whole.failure(), (501, "NotImplemented"), "{name}");
    }
    assert_eq!(stage.client.list_objects_v2().bucket(BUCKET).send().await.unwrap().key_count, Some(0));
}

/// MinIO's clients name only the algorithm.
#[tokio::test]
async fn an_algorithm_that_is_named_alone_is_what_the_checksum_is_made_by() {
    let stage = stage().await;
    let headers = [("x-amz-checksum-algorithm", "SHA256"), ("x-amz-checksum-type", "FULL_OBJECT")];
    let put = send(&stage, "PUT", "/films/a", &headers, b"123456789").await;
    assert_eq!(put.status, 200, "{put:?}");
    let sum = "feKw08M4keuw8e9gnsQZQgwg4yDOlMZfvIwzEkSOsiU=".to_lowercase();
    assert_eq!(put.header("x-amz-checksum-sha256"), sum);
    let other = [("x-amz-checksum-algorithm", "SHA256"), ("x-amz-checksum-crc32", "y/Q5Jg==")];
    let other = send(&stage, "PUT", "/films/a", &other, b"123456789").await;
    assert_eq!(other.failure(), (400, "InvalidRequest"));
}

/// The checksum would not be compared, so the request is rejected.
#[tokio::test]
async fn a_trailer_of_a_body_that_is_not_in_chunks_is_refused() {
    let stage = stage().await;
    for header in [("x-amz-trailer", "x-amz-checksum-crc32"), ("x-amz-decoded-content-length", "5")] {
        let put = send(&stage, "PUT", "/films/a", &[header], b"hello").await;
        assert_eq!(put.failure(), (400, "InvalidRequest"), "{header:?}");
    }
    // A header that requests more in the reply may be ignored. A request without a body has a checksum too: that of no
    // bytes.
    stage.put("a", "hello").await;
    for (crc, status) in [("AAAAAA==", 200), ("AAAAAQ==", 400)] {
        let headers = [("x-amz-checksum-crc32", crc), ("x-amz-sdk-checksum-algorithm", "CRC32")];
        assert_eq!(send(&stage, "GET", "/films/a", &headers, b"").await.status, status, "{crc}");
    }
    assert_eq!(send(&stage, "GET", "/films/a", &[("x-amz-te", "append-md5")], b"").await.body, "hello");
    assert_eq!(send(&stage, "GET", "/films?list-type=2&metadata=true", &[], b"").await.status, 200);
}
