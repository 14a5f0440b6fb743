//! Requests that clients do not send by themselves: unsigned requests, expired URLs, hosts, headers for unsupported
//! features.

use std::time::Duration;

use aws_sdk_s3::presigning::PresigningConfig;
use aws_sdk_s3::primitives::{DateTime, DateTimeFormat};
use rayfold_bucket::{Error, Server};

use crate::stage::{BUCKET, Stage, failure, options, path, raw, stage};

fn host(stage: &Stage) -> String {
    stage.server.address().to_string()
}

#[tokio::test]
async fn presigned_urls_work_until_they_expire() {
    let stage = stage().await;
    let put =
        stage.client.put_object().bucket(BUCKET).key("a b").presigned(stage.presigning()).await.unwrap();
    let request = format!(
        "PUT {} HTTP/1.1\r\nHost: {}\r\nContent-Length: 5\r\nConnection: close\r\n\r\nhello",
        path(put.uri()),
        host(&stage)
    );
    assert!(stage.raw(&request).await.starts_with("HTTP/1.1 200"));
    assert_eq!(stage.get("a b").await, b"hello");
    let get = |url: String| {
        let request =
            format!("GET {} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", path(&url), host(&stage));
        let address = stage.server.address();
        async move { raw(address, request.as_bytes()).await }
    };
    let signed = |seconds| {
        let expiry = PresigningConfig::expires_in(Duration::from_secs(seconds)).unwrap();
        stage.client.get_object().bucket(BUCKET).key("a b").presigned(expiry)
    };
    let answer = get(signed(60).await.unwrap().uri().to_owned()).await;
    assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with("hello"), "{answer}");
    let tampered = signed(60).await.unwrap().uri().replace("a%20b", "a%20c");
    assert!(get(tampered).await.starts_with("HTTP/1.1 403"));
    let short = signed(1).await.unwrap().uri().to_owned();
    tokio::time::sleep(Duration::from_millis(2100)).await;
    let answer = get(short).await;
    assert!(answer.starts_with("HTTP/1.1 403") && answer.contains("AccessDenied"), "{answer}");
}

/// The recipient of a URL could otherwise use it to read other data that its signer may read.
#[tokio::test]
async fn a_presigned_url_takes_no_header_that_was_not_signed() {
    let stage = stage().await;
    stage.put("secret", "for its owner alone").await;
    let upload = stage.client.create_multipart_upload().bucket(BUCKET).key("a").send().await.unwrap();
    let put = stage.client.put_object().bucket(BUCKET).key("a").presigned(stage.presigning()).await.unwrap();
    let part = stage.client.upload_part().bucket(BUCKET).key("a").part_number(1);
    let part = part.upload_id(upload.upload_id().unwrap()).presigned(stage.presigning()).await.unwrap();
    let send = async |url: &str, header: &str| {
        let line = format!("PUT {} HTTP/1.1\r\nHost: {}\r\n", path(url), host(&stage));
        stage.raw(&format!("{line}{header}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")).await
    };
    for url in [put.uri(), part.uri()] {
        for header in ["x-amz-copy-source: /films/secret", "X-Amz-Meta-Kind: other"] {
            let answer = send(url, header).await;
            assert!(answer.starts_with("HTTP/1.1 403") && answer.contains("were not signed"), "{answer}");
        }
        let answer = send(url, "Content-Type: text/plain").await;
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
    assert_eq!(stage.get("a").await, b"");
    // The headers that were signed must be sent.
    let named = stage.client.put_object().bucket(BUCKET).key("named").metadata("kind", "film");
    let named = named.presigned(stage.presigning()).await.unwrap();
    let headers: Vec<String> = named.headers().map(|(name, value)| format!("{name}: {value}")).collect();
    assert!(headers.contains(&"x-amz-meta-kind: film".to_owned()), "{headers:?}");
    let answer = send(named.uri(), &headers.join("\r\n")).await;
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
}

#[tokio::test]
async fn every_answer_has_the_time_in_it() {
    let stage = stage().await;
    let request = format!("GET / HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", host(&stage));
    let before = std::time::SystemTime::now();
    let answer = stage.raw(&request).await;
    let dates: Vec<&str> = answer.lines().filter_map(|line| line.strip_prefix("date: ")).collect();
    let [date] = dates[..] else { panic!("{answer}") };
    let date = DateTime::from_str(date, DateTimeFormat::HttpDate);
    let lag = date.unwrap().secs() - DateTime::from(before).secs();
    assert!((0..=5).contains(&lag), "{lag} s: {answer}");
}

#[tokio::test]
async fn unsigned_requests_are_denied() {
    let stage = stage().await;
    stage.put("a", "secret").await;
    for line in ["GET /", "GET /films", "GET /films/a", "PUT /films/b", "DELETE /films/a", "HEAD /films/a"] {
        let request = format!(
            "{line} HTTP/1.1\r\nHost: {}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n",
            host(&stage)
        );
        let answer = stage.raw(&request).await;
        assert!(answer.starts_with("HTTP/1.1 403"), "{line}: {answer}");
        assert!(answer.contains("x-amz-request-id"), "{answer}");
    }
}

/// Found by fuzzing: `s3s` 0.14 subtracts before it has checked that there is a digit. If overflow is checked, the
/// subtraction panics.
#[tokio::test]
async fn a_credential_of_no_date_is_refused_and_the_store_goes_on() {
    let stage = stage().await;
    let request = format!(
        "GET /films HTTP/1.1\r\nHost: {}\r\nx-amz-content-sha256: UNSIGNED-PAYLOAD\r\nx-amz-date: 20261123T000000Z\r\n\
         Authorization: AWS4-HMAC-SHA256 Credential=root/20260)01/us-east-1/s3/aws4_request, SignedHeaders=host, \
         Signature={}\r\nConnection: close\r\n\r\n",
        host(&stage),
        "0".repeat(64)
    );
    let answer = stage.raw(&request).await;
    let is_refused = answer.starts_with("HTTP/1.1 4") || answer.starts_with("HTTP/1.1 500");
    assert!(is_refused && answer.contains("<Error>") && answer.contains("x-amz-request-id"), "{answer}");
    stage.put("a", "1").await;
}

#[tokio::test]
async fn a_bucket_may_stand_in_the_host() {
    let stage = stage().await;
    stage.put("dir/a", "hello").await;
    for base in ["localhost", "s3.localhost"] {
        // A client that uses virtual-hosted addressing signs the path without the bucket.
        let config = stage.client.config().to_builder().force_path_style(false);
        let port = stage.server.address().port();
        let config = config.endpoint_url(format!("http://{base}:{port}")).build();
        let client = aws_sdk_s3::Client::from_conf(config);
        let url =
            client.get_object().bucket(BUCKET).key("dir/a").presigned(stage.presigning()).await.unwrap();
        assert!(url.uri().starts_with(&format!("http://{BUCKET}.{base}:{port}/dir/a")), "{}", url.uri());
        let request = format!(
            "GET {} HTTP/1.1\r\nHost: {BUCKET}.{base}:{port}\r\nConnection: close\r\n\r\n",
            path(url.uri())
        );
        let answer = stage.raw(&request).await;
        assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with("hello"), "{answer}");
    }
}

#[tokio::test]
async fn what_is_not_there_is_not_implemented() {
    use aws_sdk_s3::types::{ServerSideEncryption, StorageClass, Tag, Tagging, VersioningConfiguration};
    let stage = stage().await;
    let put = || stage.client.put_object().bucket(BUCKET).key("a").body(b"1".to_vec().into());
    let not_implemented = (501, "NotImplemented".to_owned());
    assert_eq!(failure(put().tagging("a=b").send().await), not_implemented);
    assert_eq!(failure(put().storage_class(StorageClass::Glacier).send().await), not_implemented);
    let encrypted = put().server_side_encryption(ServerSideEncryption::AwsKms);
    assert_eq!(failure(encrypted.send().await), not_implemented);
    assert_eq!(failure(put().sse_customer_algorithm("AES256").send().await), not_implemented);
    assert_eq!(failure(put().website_redirect_location("/b").send().await), not_implemented);
    put().send().await.unwrap();
    let versioned = stage.client.get_object().bucket(BUCKET).key("a").version_id("3sL4kqtJlcpXroDTDmJ");
    assert_eq!(failure(versioned.send().await), (400, "InvalidArgument".into()));
    let tags =
        Tagging::builder().tag_set(Tag::builder().key("a").value("b").build().unwrap()).build().unwrap();
    let tagged = stage.client.put_object_tagging().bucket(BUCKET).key("a").tagging(tags);
    assert_eq!(failure(tagged.send().await), not_implemented);
    let versions = VersioningConfiguration::builder().status("Enabled".into()).build();
    let versions = stage.client.put_bucket_versioning().bucket(BUCKET).versioning_configuration(versions);
    assert_eq!(failure(versions.send().await), not_implemented);
    let status = stage.client.get_bucket_versioning().bucket(BUCKET).send().await.unwrap().status;
    assert_eq!(status, None);
    let policy = stage.client.get_bucket_policy().bucket(BUCKET).send().await;
    assert_eq!(failure(policy), (404, "NoSuchBucketPolicy".into()));
}

#[tokio::test]
async fn a_body_that_is_not_what_its_headers_say_is_not_kept() {
    let stage = stage().await;
    let url = stage.client.put_object().bucket(BUCKET).key("a").presigned(stage.presigning()).await.unwrap();
    let zero = "0".repeat(64);
    let request = format!(
        "PUT {} HTTP/1.1\r\nHost: {}\r\nx-amz-content-sha256: {zero}\r\nContent-Length: 5\r\nConnection: close\r\n\r\nhello",
        path(url.uri()),
        host(&stage)
    );
    let answer = stage.raw(&request).await;
    assert!(answer.starts_with("HTTP/1.1 400") && answer.contains("XAmzContentSHA256Mismatch"), "{answer}");
    // A client that disconnects in the middle of a large body.
    let request = format!(
        "PUT {} HTTP/1.1\r\nHost: {}\r\nContent-Length: 9000000\r\nConnection: close\r\n\r\n",
        path(url.uri()),
        host(&stage)
    );
    let mut stream = tokio::net::TcpStream::connect(stage.server.address()).await.unwrap();
    tokio::io::AsyncWriteExt::write_all(&mut stream, request.as_bytes()).await.unwrap();
    tokio::io::AsyncWriteExt::write_all(&mut stream, &vec![0; 3_000_000]).await.unwrap();
    drop(stream);
    for _ in 0..200 {
        tokio::time::sleep(Duration::from_millis(10)).await;
        if stage.files() == 0 {
            break;
        }
    }
    assert_eq!(stage.files(), 0, "half a body is still there");
    let got = stage.client.get_object().bucket(BUCKET).key("a").send().await;
    assert_eq!(failure(got), (404, "NoSuchKey".into()));
}

#[tokio::test]
async fn one_store_at_a_time_uses_a_folder_and_all_comes_back() {
    let stage = stage().await;
    stage.put("small", "1").await;
    stage.put("large", vec![7; 2_000_000]).await;
    let second = Server::start(options(stage.folder.path(), None)).await;
    assert!(matches!(second, Err(Error::DataInUse(_))), "{second:?}");
    stage.server.stop().await;
    let server = Server::start(options(stage.folder.path(), None)).await.unwrap();
    let client = crate::stage::client(server.address());
    for (key, size) in [("small", 1), ("large", 2_000_000)] {
        let got = client.get_object().bucket(BUCKET).key(key).send().await.unwrap();
        assert_eq!(got.body.collect().await.unwrap().to_vec().len(), size);
    }
    server.stop().await;
}

/// The checksum after a body is compared with the body, like one in a header.
#[tokio::test]
async fn a_checksum_behind_the_body_is_compared() {
    use aws_sigv4::http_request::{
        PayloadChecksumKind, SignableBody, SignableRequest, SigningSettings, sign,
    };
    let stage = stage().await;
    let put = async |key: &str, sum: &str| {
        let identity = aws_sdk_s3::config::Credentials::new("root", "secret-key", None, None, "test").into();
        let mut settings = SigningSettings::default();
        settings.payload_checksum_kind = PayloadChecksumKind::XAmzSha256;
        let signing = aws_sigv4::sign::v4::SigningParams::builder()
            .identity(&identity)
            .region("us-east-1")
            .name("s3")
            .time(std::time::SystemTime::now())
            .settings(settings)
            .build()
            .unwrap()
            .into();
        let body = format!("5\r\nhello\r\n0\r\nx-amz-checksum-crc32:{sum}\r\n\r\n");
        let (uri, host, length) =
            (format!("http://{}/{BUCKET}/{key}", host(&stage)), host(&stage), body.len().to_string());
        let headers = [
            ("host", host.as_str()),
            ("content-length", length.as_str()),
            ("content-encoding", "aws-chunked"),
            ("x-amz-decoded-content-length", "5"),
            ("x-amz-trailer", "x-amz-checksum-crc32"),
        ];
        let payload = SignableBody::StreamingUnsignedPayloadTrailer;
        let request = SignableRequest::new("PUT", &uri, headers.into_iter(), payload).unwrap();
        let (instructions, _) = sign(request, &signing).unwrap().into_parts();
        let signed: String =
            instructions.headers().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        let named: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        let head = format!("PUT /{BUCKET}/{key} HTTP/1.1\r\n{named}{signed}Connection: close\r\n\r\n");
        stage.raw(&format!("{head}{body}")).await
    };
    let good = put("good", "NhCmhg==").await;
    assert!(good.starts_with("HTTP/1.1 200"), "{good}");
    assert_eq!(stage.get("good").await, b"hello");
    for (sum, code) in [("AAAAAA==", "BadDigest"), ("AAAA", "InvalidRequest")] {
        let wrong = put("wrong", sum).await;
        assert!(wrong.starts_with("HTTP/1.1 400") && wrong.contains(code), "{wrong}");
    }
    let absent = stage.client.get_object().bucket(BUCKET).key("wrong").send().await;
    assert_eq!(failure(absent), (404, "NoSuchKey".into()));
}
