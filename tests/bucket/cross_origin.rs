//! Pages of other sites: a bucket's CORS rules, and the replies to browsers.

use aws_sdk_s3::types::{CorsConfiguration, CorsRule};

use crate::signed::{Answer, presigned, send};
use crate::stage::{BUCKET, Stage, failure, path, stage};

async fn set(stage: &Stage, rule: CorsRule) -> Result<(), (u16, String)> {
    let rules = CorsConfiguration::builder().cors_rules(rule).build().unwrap();
    let set = stage.client.put_bucket_cors().bucket(BUCKET).cors_configuration(rules).send().await;
    if set.is_ok() { Ok(()) } else { Err(failure(set)) }
}

fn rule(origin: &str, method: &str) -> CorsRule {
    let rule = CorsRule::builder().allowed_origins(origin).allowed_methods(method).allowed_headers("*");
    rule.expose_headers("ETag").max_age_seconds(600).id("pages").build().unwrap()
}

async fn raw(stage: &Stage, line: &str, headers: &str, body: &str) -> Answer {
    let host = stage.server.address();
    let length = body.len();
    let request = format!(
        "{line} HTTP/1.1\r\nHost: {host}\r\n{headers}Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
    );
    Answer::parse(&stage.raw(&request).await)
}

/// The requests of a browser for a page with a presigned URL.
#[tokio::test]
async fn a_page_uploads_by_a_presigned_url() {
    let stage = stage().await;
    let url =
        stage.client.put_object().bucket(BUCKET).key("a b").presigned(stage.presigning()).await.unwrap();
    let target = path(url.uri());
    let from = "Origin: https://page.example\r\n";
    let asks = format!(
        "{from}Access-Control-Request-Method: PUT\r\nAccess-Control-Request-Headers: content-type\r\n"
    );
    let none = raw(&stage, &format!("OPTIONS {target}"), &asks, "").await;
    assert_eq!(none.failure(), (403, "AccessForbidden"), "no rules");

    set(&stage, rule("https://*.example", "PUT")).await.unwrap();
    let answer = stage.client.get_bucket_cors().bucket(BUCKET).send().await.unwrap();
    let [kept] = answer.cors_rules() else { panic!("{answer:?}") };
    assert_eq!((kept.id(), kept.allowed_origins()), (Some("pages"), &["https://*.example".to_owned()][..]));

    let allowed = raw(&stage, &format!("OPTIONS {target}"), &asks, "").await;
    assert_eq!(allowed.status, 200, "{allowed:?}");
    assert_eq!(allowed.header("access-control-allow-origin"), "https://page.example");
    assert_eq!(allowed.header("access-control-allow-methods"), "put");
    assert_eq!(allowed.header("access-control-allow-headers"), "content-type");
    assert_eq!(allowed.header("access-control-max-age"), "600");
    assert!(allowed.header("vary").contains("origin"), "{allowed:?}");
    let put = raw(&stage, &format!("PUT {target}"), &format!("{from}Content-Type: a/b\r\n"), "hello").await;
    assert_eq!((put.status, put.header("access-control-allow-origin")), (200, "https://page.example"));
    assert_eq!(put.header("access-control-expose-headers"), "etag");
    assert_eq!(stage.get("a b").await, b"hello");

    // The page can read the error; another page can read nothing.
    let refused = raw(&stage, "PUT /films/c", from, "hello").await;
    assert_eq!(
        (refused.status, refused.header("access-control-allow-origin")),
        (403, "https://page.example")
    );
    for line in ["PUT /films/c?annex", "PUT /nowhere/c"] {
        assert!(raw(&stage, line, from, "").await.status >= 400, "{line}");
    }
    let elsewhere = "Origin: https://page.test\r\n";
    let other = raw(&stage, &format!("PUT {target}"), elsewhere, "hello").await;
    assert_eq!((other.status, other.header("access-control-allow-origin")), (200, ""));
    let asks = format!("{elsewhere}Access-Control-Request-Method: PUT\r\n");
    assert_eq!(raw(&stage, &format!("OPTIONS {target}"), &asks, "").await.status, 403);
    assert_eq!(raw(&stage, "OPTIONS /nowhere/a", &asks, "").await.status, 403);
    assert_eq!(raw(&stage, &format!("OPTIONS {target}"), elsewhere, "").await.failure(), (400, "BadRequest"));

    stage.client.delete_bucket_cors().bucket(BUCKET).send().await.unwrap();
    let gone = stage.client.get_bucket_cors().bucket(BUCKET).send().await;
    assert_eq!(failure(gone), (404, "NoSuchCORSConfiguration".into()));
    let put = raw(&stage, &format!("PUT {target}"), from, "hello").await;
    assert_eq!((put.status, put.header("access-control-allow-origin")), (200, ""));
}

#[tokio::test]
async fn rules_that_cannot_be_are_refused_and_others_are_kept() {
    let stage = stage().await;
    let wrong = |origin: &str, method: &str| rule(origin, method);
    assert_eq!(set(&stage, wrong("*", "PATCH")).await, Err((400, "InvalidRequest".into())));
    assert_eq!(set(&stage, wrong("*.*", "GET")).await, Err((400, "InvalidRequest".into())));
    let exposed = CorsRule::builder().allowed_origins("*").allowed_methods("GET").expose_headers("x-amz-*");
    assert_eq!(set(&stage, exposed.build().unwrap()).await, Err((400, "InvalidRequest".into())));
    let none = stage.client.put_bucket_cors().bucket(BUCKET);
    let none =
        none.cors_configuration(CorsConfiguration::builder().set_cors_rules(Some(vec![])).build().unwrap());
    assert_eq!(failure(none.send().await).0, 400);
    set(&stage, rule("*", "GET")).await.unwrap();
    // The rules belong to the bucket and persist across restarts.
    stage.server.stop().await;
    let server =
        rayfold_bucket::Server::start(crate::stage::options(stage.folder.path(), None)).await.unwrap();
    let client = crate::stage::client(server.address());
    assert_eq!(client.get_bucket_cors().bucket(BUCKET).send().await.unwrap().cors_rules().len(), 1);
}

/// A presigned URL may have parameters in place of headers, like in S3. No other request may.
#[tokio::test]
async fn what_a_presigned_url_says_in_place_of_headers_holds() {
    let stage = stage().await;
    stage.put("source", "from elsewhere").await;
    let put = async |parameters: &str, body: &str| {
        let target = presigned(&stage, "PUT", &format!("/films/a{parameters}"));
        raw(&stage, &format!("PUT {target}"), "", body).await
    };
    let meta = put("?X-Amz-Meta-Colour=red&x-amz-acl=private&x-id=PutObject", "hello").await;
    assert_eq!(meta.status, 200, "{meta:?}");
    let head = stage.client.head_object().bucket(BUCKET).key("a").send().await.unwrap();
    assert_eq!(head.metadata().unwrap()["colour"], "red");
    // JavaScript clients put the checksum of an empty body there before they know the body. Another checksum is that of
    // the body.
    let of_nothing = "?x-amz-checksum-crc32=AAAAAA%3D%3D&x-amz-sdk-checksum-algorithm=CRC32";
    assert_eq!(put(of_nothing, "hello, too").await.status, 200);
    assert_eq!(put("?x-amz-checksum-crc32=y%2FQ5Jg%3D%3D", "123456789").await.status, 200);
    for (parameters, failure) in [
        ("?x-amz-checksum-crc32=y%2FQ5Jg%3D%3D", (400, "BadDigest")),
        ("?X-Amz-Acl=public-read", (400, "AccessControlListNotSupported")),
        ("?X-Amz-Annex=1", (501, "NotImplemented")),
        ("?x-amz-checksum-sha512=AAAA", (501, "NotImplemented")),
        ("?annotation", (501, "NotImplemented")),
        ("?x-id=PutAnnex", (501, "NotImplemented")),
        ("?x-id=CopyObject", (501, "NotImplemented")),
    ] {
        assert_eq!(put(parameters, "other").await.failure(), failure, "{parameters}");
    }
    assert_eq!(stage.get("a").await, b"123456789");
    assert_eq!(put("?X-Amz-Copy-Source=%2Ffilms%2Fsource", "").await.status, 200);
    assert_eq!(stage.get("a").await, b"from elsewhere");
    // These are not part of the signed request.
    let target = presigned(&stage, "PUT", "/films/a");
    for more in ["x-amz-meta-a=b", "annotation", "X-Amz-Annex=1"] {
        let answer = raw(&stage, &format!("PUT {target}&{more}"), "", "other").await;
        assert_eq!(answer.failure(), (403, "SignatureDoesNotMatch"), "{more}");
    }
    let answer = send(&stage, "PUT", "/films/a?X-Amz-Meta-Colour=red", &[], b"hello").await;
    assert_eq!(answer.failure(), (501, "NotImplemented"), "the signature is in a header");
    assert_eq!(stage.get("a").await, b"from elsewhere");
}
