//! Sessions from the client's side: AWS's own STS and S3 clients against the store. The unit tests of `policy` check
//! the meaning of policies. Here every request must check the policy, and the replies are verified.

use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

use aws_sdk_s3::config::{BehaviorVersion, Credentials, Region};
use aws_sdk_s3::error::{ProvideErrorMetadata, SdkError};
use aws_sdk_s3::presigning::PresigningConfig;
use aws_sdk_s3::primitives::ByteStream;
use aws_sdk_s3::types::{CompletedMultipartUpload, Delete, ObjectCannedAcl, ObjectIdentifier};
use aws_smithy_http_client::Builder as HttpBuilder;
use rayfold_bucket::{Options, Server};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

const BUCKET: &str = "films";

async fn server(data: &Path) -> Server {
    let root = rayfold_bucket::Credentials { access_key: "owner".into(), secret_key: "the owner's".into() };
    let address = SocketAddr::from(([127, 0, 0, 1], 0));
    let region = "us-east-1".into();
    Server::start(Options { data: data.into(), address, root, region, webhook: None }).await.unwrap()
}

fn owner() -> Credentials {
    Credentials::new("owner", "the owner's", None, None, "test")
}

fn s3(server: &Server, credentials: Credentials) -> aws_sdk_s3::Client {
    let config = aws_sdk_s3::Config::builder()
        .behavior_version(BehaviorVersion::latest())
        .region(Region::new("us-east-1"))
        .endpoint_url(format!("http://{}", server.address()))
        .force_path_style(true)
        .credentials_provider(credentials)
        .http_client(HttpBuilder::new().build_http());
    aws_sdk_s3::Client::from_conf(config.build())
}

fn sts(server: &Server, credentials: Credentials) -> aws_sdk_sts::Client {
    let config = aws_sdk_sts::Config::builder()
        .behavior_version(aws_sdk_sts::config::BehaviorVersion::latest())
        .region(aws_sdk_sts::config::Region::new("us-east-1"))
        .endpoint_url(format!("http://{}", server.address()))
        .credentials_provider(credentials)
        .http_client(HttpBuilder::new().build_http());
    aws_sdk_sts::Client::from_conf(config.build())
}

/// Returns the keys of a session with these policy statements.
async fn assume(server: &Server, statements: &str) -> Credentials {
    let policy = format!(r#"{{"Version":"2012-10-17","Statement":[{statements}]}}"#);
    let share = policy.chars().count() * 100 / 2_048;
    let answer = sts(server, owner())
        .assume_role()
        .role_arn("arn:aws:iam::000000000000:role/tester")
        .role_session_name("test")
        .policy(policy)
        .send()
        .await
        .unwrap();
    #[expect(deprecated, reason = "AWS still answers it, and so do we")]
    let percent = answer.packed_policy_size();
    assert_eq!(percent, Some(share as i32), "percent of what a policy may be long");
    let given = answer.credentials().unwrap();
    let left =
        given.expiration().secs() - std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs() as i64;
    assert!((3590..=3600).contains(&left), "an hour is usual: {left}");
    let user = answer.assumed_role_user().unwrap().arn();
    assert_eq!(user, "arn:aws:sts::000000000000:assumed-role/tester/test");
    let token = given.session_token().to_owned();
    Credentials::new(given.access_key_id(), given.secret_access_key(), Some(token), None, "test")
}

async fn filled(server: &Server) -> aws_sdk_s3::Client {
    let client = s3(server, owner());
    client.create_bucket().bucket(BUCKET).send().await.unwrap();
    for key in ["open/a", "open/b", "shut/a"] {
        put(&client, key).await.unwrap();
    }
    client
}

/// Returns the status and the code, or "ok".
fn outcome<T, E: ProvideErrorMetadata>(
    result: Result<T, SdkError<E, aws_sdk_s3::config::http::HttpResponse>>,
) -> String {
    match result {
        Ok(_) => "ok".to_owned(),
        Err(error) => {
            let status = error.raw_response().map_or(0, |response| response.status().as_u16());
            format!("{status} {}", error.code().unwrap_or("-"))
        }
    }
}

async fn put(
    client: &aws_sdk_s3::Client,
    key: &str,
) -> Result<
    aws_sdk_s3::operation::put_object::PutObjectOutput,
    SdkError<aws_sdk_s3::operation::put_object::PutObjectError>,
> {
    client.put_object().bucket(BUCKET).key(key).body(ByteStream::from_static(b"body")).send().await
}

async fn get(client: &aws_sdk_s3::Client, key: &str) -> String {
    outcome(client.get_object().bucket(BUCKET).key(key).send().await)
}

async fn head(client: &aws_sdk_s3::Client, key: &str) -> String {
    outcome(client.head_object().bucket(BUCKET).key(key).send().await)
}

const READ: &str = r#"{"Effect":"Allow","Action":"s3:GetObject","Resource":"arn:aws:s3:::films/open/*"}"#;
const LIST: &str = r#"{"Effect":"Allow","Action":"s3:ListBucket","Resource":"arn:aws:s3:::films",
    "Condition":{"Null":{"s3:prefix":"true"}}}"#;
const WRITE: &str = r#"{"Effect":"Allow","Action":["s3:PutObject","s3:DeleteObject"],"Resource":"arn:aws:s3:::films/open/*"}"#;

#[tokio::test]
async fn a_session_outlives_the_server_and_needs_its_token() {
    let data = tempfile::tempdir().unwrap();
    let first = server(data.path()).await;
    filled(&first).await;
    let keys = assume(&first, READ).await;
    assert_eq!(get(&s3(&first, keys.clone()), "open/a").await, "ok");
    first.stop().await;

    let again = server(data.path()).await;
    assert_eq!(get(&s3(&again, keys.clone()), "open/a").await, "ok");
    assert_eq!(get(&s3(&again, keys.clone()), "shut/a").await, "403 AccessDenied");
    let (id, secret) = (keys.access_key_id(), keys.secret_access_key());
    let with = |token: Option<&str>| Credentials::new(id, secret, token.map(str::to_owned), None, "test");
    assert_eq!(get(&s3(&again, with(None)), "open/a").await, "403 InvalidAccessKeyId");
    assert_eq!(get(&s3(&again, with(Some("guess"))), "open/a").await, "400 InvalidToken");
    let wrong = Credentials::new(id, "guess", keys.session_token().map(str::to_owned), None, "test");
    assert_eq!(get(&s3(&again, wrong), "open/a").await, "403 SignatureDoesNotMatch");
    let owners = Credentials::new("owner", "the owner's", Some("token".into()), None, "test");
    assert_eq!(get(&s3(&again, owners), "open/a").await, "400 InvalidToken");

    // In a URL that includes the token, for any holder of the URL.
    let presigned = s3(&again, keys)
        .get_object()
        .bucket(BUCKET)
        .key("open/a")
        .presigned(PresigningConfig::expires_in(Duration::from_secs(60)).unwrap())
        .await
        .unwrap();
    let path = presigned.uri().split_once("//").unwrap().1.split_once('/').unwrap().1;
    assert!(raw(&again, &format!("GET /{path}"), "", "").await.starts_with("HTTP/1.1 200"));
    let cut = path.replace("X-Amz-Security-Token", "X-Amz-Other");
    assert!(raw(&again, &format!("GET /{cut}"), "", "").await.starts_with("HTTP/1.1 403"));
    let unsigned = raw(&again, "GET /films/open/a", "", "").await;
    assert!(unsigned.starts_with("HTTP/1.1 403") && unsigned.contains("AccessDenied"), "{unsigned}");
    again.stop().await;
}

#[tokio::test]
async fn absence_is_shown_to_callers_that_may_list() {
    let data = tempfile::tempdir().unwrap();
    let server = server(data.path()).await;
    filled(&server).await;
    let discreet = s3(&server, assume(&server, READ).await);
    let lister = s3(&server, assume(&server, &format!("{READ},{LIST}")).await);
    assert_eq!(get(&discreet, "open/none").await, "403 AccessDenied");
    assert!(head(&discreet, "open/none").await.starts_with("403"));
    assert_eq!(get(&lister, "open/none").await, "404 NoSuchKey");
    assert!(head(&lister, "open/none").await.starts_with("404"));
    for client in [&discreet, &lister] {
        assert_eq!(get(client, "open/a").await, "ok");
        assert_eq!(get(client, "shut/none").await, "403 AccessDenied");
    }
    server.stop().await;
}

#[tokio::test]
async fn copies_need_the_source_and_deletes_each_of_their_keys() {
    let data = tempfile::tempdir().unwrap();
    let server = server(data.path()).await;
    let all = filled(&server).await;
    let client = s3(&server, assume(&server, &format!("{READ},{WRITE}")).await);
    let copy = async |from: &str, to: &str| {
        let source = format!("{BUCKET}/{from}");
        outcome(client.copy_object().bucket(BUCKET).key(to).copy_source(source).send().await)
    };
    assert_eq!(copy("open/a", "open/copy").await, "ok");
    assert_eq!(copy("shut/a", "open/stolen").await, "403 AccessDenied");
    assert_eq!(copy("open/a", "shut/planted").await, "403 AccessDenied");
    assert_eq!(copy("open/none", "open/copy").await, "403 AccessDenied", "it may not list");

    let upload = client.create_multipart_upload().bucket(BUCKET).key("open/parts").send().await.unwrap();
    let id = upload.upload_id().unwrap();
    let part = async |source: &str| {
        let part = client.upload_part_copy().bucket(BUCKET).key("open/parts").upload_id(id).part_number(1);
        outcome(part.copy_source(format!("{BUCKET}/{source}")).send().await)
    };
    assert_eq!(part("shut/a").await, "403 AccessDenied");
    assert_eq!(part("open/a").await, "ok");
    let parts = client.list_parts().bucket(BUCKET).key("open/parts").upload_id(id);
    assert_eq!(outcome(parts.send().await), "403 AccessDenied", "that is a right of its own");
    let abort = client.abort_multipart_upload().bucket(BUCKET).key("open/parts").upload_id(id);
    assert_eq!(outcome(abort.send().await), "403 AccessDenied", "and so is that");
    let complete = client.complete_multipart_upload().bucket(BUCKET).key("shut/a").upload_id(id);
    let complete = complete.multipart_upload(CompletedMultipartUpload::builder().build());
    assert_eq!(outcome(complete.send().await), "403 AccessDenied");

    let identifiers =
        ["open/a", "shut/a", "open/none"].map(|key| ObjectIdentifier::builder().key(key).build().unwrap());
    let delete = Delete::builder().set_objects(Some(identifiers.to_vec())).build().unwrap();
    let answer = client.delete_objects().bucket(BUCKET).delete(delete).send().await.unwrap();
    let deleted: Vec<&str> = answer.deleted().iter().filter_map(|object| object.key()).collect();
    assert_eq!(deleted, ["open/a", "open/none"]);
    let [error] = answer.errors() else { panic!("{:?}", answer.errors()) };
    assert_eq!((error.key(), error.code()), (Some("shut/a"), Some("AccessDenied")));
    assert_eq!(get(&all, "shut/a").await, "ok");
    assert_eq!(get(&all, "open/a").await, "404 NoSuchKey");
    server.stop().await;
}

#[tokio::test]
async fn what_no_statement_names_is_denied() {
    let data = tempfile::tempdir().unwrap();
    let server = server(data.path()).await;
    filled(&server).await;
    let client = s3(&server, assume(&server, &format!("{READ},{LIST},{WRITE}")).await);
    let denied = "403 AccessDenied";
    assert_eq!(outcome(client.list_buckets().send().await), denied);
    assert_eq!(outcome(client.create_bucket().bucket("mine").send().await), denied);
    assert_eq!(outcome(client.delete_bucket().bucket(BUCKET).send().await), denied);
    assert_eq!(outcome(client.list_multipart_uploads().bucket(BUCKET).send().await), denied);
    assert_eq!(outcome(client.get_bucket_location().bucket(BUCKET).send().await), denied);
    let notifications = client.get_bucket_notification_configuration().bucket(BUCKET);
    assert_eq!(outcome(notifications.send().await), denied);
    assert_eq!(outcome(client.get_bucket_policy().bucket(BUCKET).send().await), denied);
    assert_eq!(outcome(client.list_objects_v2().bucket(BUCKET).send().await), "ok");
    assert_eq!(outcome(client.list_objects().bucket(BUCKET).send().await), "ok");
    for prefix in ["", "open/"] {
        assert_eq!(outcome(client.list_objects_v2().bucket(BUCKET).prefix(prefix).send().await), denied);
        assert_eq!(outcome(client.list_objects().bucket(BUCKET).prefix(prefix).send().await), denied);
    }
    assert!(outcome(client.head_bucket().bucket(BUCKET).send().await) == "ok");
    // Changing who may read an object needs a permission of its own.
    const SHARE: &str =
        r#"{"Effect":"Allow","Action":"s3:PutObjectAcl","Resource":"arn:aws:s3:::films/open/*"}"#;
    let sharer = s3(&server, assume(&server, &format!("{WRITE},{SHARE}")).await);
    for (client, expected) in [(&client, denied), (&sharer, "ok")] {
        let put = client.put_object().bucket(BUCKET).key("open/shared").acl(ObjectCannedAcl::Private);
        assert_eq!(outcome(put.body(ByteStream::from_static(b"body")).send().await), expected);
    }
    assert_eq!(outcome(client.list_objects_v2().bucket("others").send().await), denied);
    server.stop().await;
}

#[tokio::test]
async fn a_caller_that_may_not_assume_a_role_learns_why() {
    let data = tempfile::tempdir().unwrap();
    let server = server(data.path()).await;
    let policy = format!(r#"{{"Version":"2012-10-17","Statement":[{READ}]}}"#);
    let refused = async |credentials: Credentials, policy: Option<&str>, seconds: i32| {
        let wish = sts(&server, credentials)
            .assume_role()
            .role_arn("arn:aws:iam::000000000000:role/tester")
            .role_session_name("test")
            .set_policy(policy.map(str::to_owned))
            .duration_seconds(seconds);
        let error = wish.send().await.expect_err("it is refused");
        let message = error.message().unwrap_or_default().to_owned();
        (outcome::<(), _>(Err(error)), message)
    };
    let wrong = Credentials::new("owner", "guess", None, None, "test");
    assert_eq!(refused(wrong, Some(&policy), 900).await.0, "403 SignatureDoesNotMatch");
    let nobody = Credentials::new("nobody", "guess", None, None, "test");
    assert_eq!(refused(nobody, Some(&policy), 900).await.0, "403 InvalidClientTokenId");
    let session = assume(&server, r#"{"Effect":"Allow","Action":"*","Resource":"*"}"#).await;
    assert_eq!(refused(session, Some(&policy), 900).await.0, "403 AccessDenied");
    let (code, message) = refused(owner(), None, 900).await;
    assert!(code == "400 ValidationError" && message.contains("Policy is missing"), "{code} {message}");
    let (code, message) = refused(owner(), Some(&policy), 899).await;
    assert!(code == "400 ValidationError" && message.contains("900 to 43200"), "{code} {message}");
    let other = policy.replace("Action", "NotAction");
    let (code, message) = refused(owner(), Some(&other), 900).await;
    assert!(code == "400 MalformedPolicyDocument" && message.contains("NotAction"), "{code} {message}");

    // Without a signature.
    let form = "Action=AssumeRole&Version=2011-06-15";
    let answer = raw(&server, "POST /", "Content-Type: application/x-www-form-urlencoded\r\n", form).await;
    assert!(answer.starts_with("HTTP/1.1 403") && answer.contains("MissingAuthenticationToken"), "{answer}");
    server.stop().await;
}

/// Uses AWS's own signer to sign requests that its clients would not send.
#[tokio::test]
async fn a_request_to_sts_is_signed_for_sts_and_with_its_body() {
    use aws_sigv4::http_request::{
        PayloadChecksumKind, SignableBody, SignableRequest, SigningSettings, sign,
    };

    let data = tempfile::tempdir().unwrap();
    let server = server(data.path()).await;
    let policy = "%7B%22Version%22%3A%222012-10-17%22%2C%22Statement%22%3A%7B%22Effect%22%3A%22Allow%22%2C\
                  %22Action%22%3A%22%2A%22%2C%22Resource%22%3A%22%2A%22%7D%7D";
    let form = format!(
        "Action=AssumeRole&Version=2011-06-15&RoleArn=arn%3Aaws%3Aiam%3A%3A000000000000%3Arole%2Ftester\
         &RoleSessionName=test&Policy={policy}"
    );
    let answer = async |service: &str, body: SignableBody<'_>| {
        let identity = owner().into();
        let mut settings = SigningSettings::default();
        settings.payload_checksum_kind = PayloadChecksumKind::XAmzSha256;
        let signing = aws_sigv4::sign::v4::SigningParams::builder()
            .identity(&identity)
            .region("us-east-1")
            .name(service)
            .time(std::time::SystemTime::now())
            .settings(settings)
            .build()
            .unwrap()
            .into();
        let (uri, host) = (format!("http://{}/", server.address()), server.address().to_string());
        let kind = ("content-type", "application/x-www-form-urlencoded");
        let headers = [kind, ("host", host.as_str())];
        let request = SignableRequest::new("POST", &uri, headers.into_iter(), body).unwrap();
        let (instructions, _) = sign(request, &signing).unwrap().into_parts();
        let signed = instructions.headers().map(|(name, value)| format!("{name}: {value}\r\n"));
        let headers = format!("{}: {}\r\n{}", kind.0, kind.1, signed.collect::<String>());
        raw(&server, "POST /", &headers, &form).await
    };
    let good = answer("sts", SignableBody::Bytes(form.as_bytes())).await;
    assert!(good.starts_with("HTTP/1.1 200") && good.contains("<SessionToken>"), "{good}");
    let unsigned = answer("sts", SignableBody::UnsignedPayload).await;
    assert!(
        unsigned.starts_with("HTTP/1.1 403") && unsigned.contains("the body must be signed"),
        "{unsigned}"
    );
    let elsewhere = answer("s3", SignableBody::Bytes(form.as_bytes())).await;
    assert!(elsewhere.starts_with("HTTP/1.1 403") && elsewhere.contains("another service"), "{elsewhere}");
    server.stop().await;
}

/// Sends a request unchanged.
async fn raw(server: &Server, line: &str, headers: &str, body: &str) -> String {
    let mut stream = tokio::net::TcpStream::connect(server.address()).await.unwrap();
    let request = format!(
        "{line} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{headers}Content-Length: {}\r\n\r\n{body}",
        server.address(),
        body.len()
    );
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    answer
}
