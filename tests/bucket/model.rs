//! Every operation and parameter of S3's service model, sent unchanged. The store rejects unsupported ones before it
//! changes anything. `service-model.py` writes `service-model.txt` from botocore's model.

use std::fmt::Write as _;

use crate::signed::{md5, send};
use crate::stage::{BUCKET, Stage, stage};

const MODEL: &str = include_str!("service-model.txt");

/// The supported operations, with the parameters that they obey or that have no effect here. (ListDirectoryBuckets is
/// the same request as ListBuckets, to another host.) All others are rejected.
const KNOWN: &str = "
    ListBuckets max-buckets continuation-token prefix bucket-region
    ListDirectoryBuckets continuation-token
    CreateBucket x-amz-acl x-amz-bucket-object-lock-enabled x-amz-object-ownership LocationConstraint
    HeadBucket
    DeleteBucket
    GetBucketLocation
    GetBucketVersioning
    GetBucketAcl
    PutBucketAcl x-amz-acl AccessControlList AccessControlList/Grant AccessControlList/Grant/Grantee
        AccessControlList/Grant/Grantee/DisplayName AccessControlList/Grant/Grantee/EmailAddress
        AccessControlList/Grant/Grantee/ID AccessControlList/Grant/Grantee/URI AccessControlList/Grant/Permission
        Owner Owner/DisplayName Owner/ID
    GetBucketPolicy
    GetBucketCors
    PutBucketCors CORSRule CORSRule/ID CORSRule/AllowedHeader CORSRule/AllowedMethod CORSRule/AllowedOrigin
        CORSRule/ExposeHeader CORSRule/MaxAgeSeconds
    DeleteBucketCors
    GetBucketLifecycle
    GetBucketLifecycleConfiguration
    GetBucketTagging
    GetBucketEncryption
    GetObjectLockConfiguration
    GetBucketWebsite
    GetBucketNotification
    GetBucketNotificationConfiguration
    PutBucketNotification QueueConfiguration QueueConfiguration/Id QueueConfiguration/Event QueueConfiguration/Queue
    PutBucketNotificationConfiguration x-amz-skip-destination-validation QueueConfiguration QueueConfiguration/Id
        QueueConfiguration/Queue QueueConfiguration/Event QueueConfiguration/Filter QueueConfiguration/Filter/S3Key
        QueueConfiguration/Filter/S3Key/FilterRule QueueConfiguration/Filter/S3Key/FilterRule/Name
        QueueConfiguration/Filter/S3Key/FilterRule/Value
    ListObjects delimiter encoding-type marker max-keys prefix
    ListObjectsV2 delimiter encoding-type max-keys prefix continuation-token fetch-owner start-after
    ListObjectVersions delimiter encoding-type key-marker max-keys prefix version-id-marker
    ListMultipartUploads delimiter encoding-type key-marker max-uploads prefix upload-id-marker
    DeleteObjects x-amz-bypass-governance-retention Object Object/Key Object/VersionId Object/ETag Quiet
    GetObject response-cache-control response-content-disposition response-content-encoding response-content-language
        response-content-type response-expires versionId partNumber if-match if-modified-since if-none-match
        if-unmodified-since range x-amz-checksum-mode
    HeadObject response-cache-control response-content-disposition response-content-encoding response-content-language
        response-content-type response-expires versionId partNumber if-match if-modified-since if-none-match
        if-unmodified-since range x-amz-checksum-mode
    GetObjectAttributes versionId x-amz-max-parts x-amz-part-number-marker x-amz-object-attributes
    GetObjectAcl versionId
    PutObjectAcl versionId x-amz-acl AccessControlList AccessControlList/Grant AccessControlList/Grant/Grantee
        AccessControlList/Grant/Grantee/DisplayName AccessControlList/Grant/Grantee/EmailAddress
        AccessControlList/Grant/Grantee/ID AccessControlList/Grant/Grantee/URI AccessControlList/Grant/Permission
        Owner Owner/DisplayName Owner/ID
    GetObjectTagging versionId
    PutObject x-amz-acl if-match if-none-match x-amz-meta- x-amz-server-side-encryption x-amz-storage-class
        x-amz-server-side-encryption-bucket-key-enabled x-amz-tagging
    CopyObject x-amz-acl x-amz-checksum-algorithm x-amz-copy-source x-amz-copy-source-if-match
        x-amz-copy-source-if-modified-since x-amz-copy-source-if-none-match x-amz-copy-source-if-unmodified-since
        if-match if-none-match x-amz-meta- x-amz-metadata-directive x-amz-tagging-directive
        x-amz-server-side-encryption x-amz-server-side-encryption-bucket-key-enabled x-amz-storage-class
        x-amz-tagging x-amz-source-expected-bucket-owner
    DeleteObject versionId x-amz-bypass-governance-retention if-match
    CreateMultipartUpload x-amz-acl x-amz-meta- x-amz-server-side-encryption
        x-amz-server-side-encryption-bucket-key-enabled x-amz-storage-class x-amz-tagging x-amz-checksum-algorithm
        x-amz-checksum-type
    UploadPart partNumber uploadId
    UploadPartCopy partNumber uploadId x-amz-copy-source x-amz-copy-source-if-match
        x-amz-copy-source-if-modified-since x-amz-copy-source-if-none-match x-amz-copy-source-if-unmodified-since
        x-amz-copy-source-range x-amz-source-expected-bucket-owner
    CompleteMultipartUpload uploadId x-amz-checksum-type x-amz-mp-object-size if-match if-none-match
        Part Part/ETag Part/PartNumber
    AbortMultipartUpload uploadId
    ListParts max-parts part-number-marker uploadId
";

/// Parameters that are stored with an object or compared with its body, on the operations that write or complete an
/// object. For an operation with an XML body they are compared with that body.
const OF_A_BODY: [&str; 11] = [
    "cache-control",
    "content-disposition",
    "content-encoding",
    "content-language",
    "content-length",
    "content-type",
    "expires",
    "content-md5",
    "x-amz-sdk-checksum-algorithm",
    "x-amz-request-payer",
    "x-amz-expected-bucket-owner",
];

const CHECKSUMS: [&str; 5] = ["crc32", "crc32c", "crc64nvme", "sha1", "sha256"];

#[derive(Debug)]
struct Operation {
    name: &'static str,
    method: &'static str,
    uri: &'static str,
    root: Option<&'static str>,
    has_bytes: bool,
    parameters: Vec<Parameter>,
}

#[derive(Clone, Debug)]
struct Parameter {
    kind: &'static str,
    name: &'static str,
    is_required: bool,
}

fn operations() -> Vec<Operation> {
    let mut all: Vec<Operation> = Vec::new();
    for line in MODEL.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        if !line.starts_with(' ') {
            let [name, method, uri] = words[..] else { panic!("{line}") };
            all.push(Operation { name, method, uri, root: None, has_bytes: false, parameters: Vec::new() });
            continue;
        }
        let operation = all.last_mut().unwrap();
        match words[..] {
            ["digest"] => {}
            ["bytes"] => operation.has_bytes = true,
            ["root", root] => operation.root = Some(root),
            [kind, name, ref rest @ ..] => {
                operation.parameters.push(Parameter { kind, name, is_required: !rest.is_empty() });
            }
            _ => panic!("{line}"),
        }
    }
    all
}

/// Returns whether the store supports it, by the table above.
fn is_known(operation: &str, parameter: Option<&str>) -> bool {
    let mut current = "";
    for line in KNOWN.lines() {
        let mut words = line.split_whitespace().peekable();
        if line.starts_with("    ") && !line.starts_with("     ") {
            current = words.next().unwrap_or_default();
            if current == operation && parameter.is_none() {
                return true;
            }
        }
        if current == operation
            && parameter.is_some_and(|name| words.any(|word| word.eq_ignore_ascii_case(name)))
        {
            return true;
        }
    }
    parameter.is_some_and(|name| {
        let name = name.to_ascii_lowercase();
        let is_checksum = CHECKSUMS.iter().any(|sum| name == format!("x-amz-checksum-{sum}"))
            || CHECKSUMS.iter().any(|sum| name == format!("part/checksum{sum}"));
        OF_A_BODY.contains(&name.as_str()) || is_checksum
    })
}

/// Sends a request of an operation with some of its parameters.
async fn ask(stage: &Stage, operation: &Operation, with: &[&Parameter]) -> (u16, String) {
    let mut target = operation.uri.replace("{Bucket}", BUCKET).replace("{Key+}", "a");
    let mut headers: Vec<(String, String)> = Vec::new();
    let mut elements = String::new();
    for Parameter { kind, name, .. } in with {
        match *kind {
            "query" => {
                let sign = if target.contains('?') { '&' } else { '?' };
                write!(target, "{sign}{name}=1").unwrap();
            }
            "header" | "headers" => {
                let value = match *name {
                    "x-amz-copy-source" => "/films/a",
                    name if name.ends_with("-since") || name.ends_with("-time") => {
                        "Wed, 18 May 2033 03:33:20 GMT"
                    }
                    _ => "1",
                };
                let suffix = if *kind == "headers" { "k" } else { "" };
                headers.push((format!("{name}{suffix}").to_lowercase(), value.to_owned()));
            }
            "element" => {
                let open = name.split('/').map(|name| format!("<{name}>"));
                let close = name.rsplit('/').map(|name| format!("</{name}>"));
                elements = open.chain(["1".to_owned()]).chain(close).collect();
            }
            other => panic!("{other}"),
        }
    }
    let body = match (operation.root, operation.has_bytes) {
        (Some(root), _) => {
            format!("<{root} xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">{elements}</{root}>")
        }
        (None, true) => "note".to_owned(),
        (None, false) => String::new(),
    };
    let given = |name: &str| headers.iter().any(|(given, _)| given == name);
    if operation.root.is_some() && !given("content-md5") {
        headers.push(("content-md5".into(), md5(body.as_bytes())));
    }
    headers.retain(|(name, _)| name != "content-length");
    let headers: Vec<_> = headers.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
    let answer = send(stage, operation.method, &target, &headers, body.as_bytes()).await;
    let code = if operation.method == "HEAD" && answer.status == 501 {
        "NotImplemented"
    } else {
        answer.element("Code")
    };
    (answer.status, code.to_owned())
}

/// Returns all contents of the store with their times.
async fn state(stage: &Stage) -> String {
    let client = &stage.client;
    let mut text = String::new();
    for bucket in client.list_buckets().send().await.unwrap().buckets() {
        writeln!(text, "{bucket:?}").unwrap();
        let name = bucket.name().unwrap();
        for object in client.list_objects_v2().bucket(name).send().await.unwrap().contents() {
            writeln!(text, "{object:?}").unwrap();
            let head = client.head_object().bucket(name).key(object.key().unwrap()).send().await.unwrap();
            writeln!(text, "{:?} {:?}", head.metadata(), head.content_type()).unwrap();
        }
        let uploads = client.list_multipart_uploads().bucket(name).send().await.unwrap();
        writeln!(text, "{:?}", uploads.uploads()).unwrap();
        let notifications = client.get_bucket_notification_configuration().bucket(name).send().await.unwrap();
        writeln!(text, "{:?}", notifications.queue_configurations()).unwrap();
        let cors = send(stage, "GET", &format!("/{name}?cors"), &[], b"").await;
        writeln!(text, "{}", cors.body).unwrap();
    }
    text
}

#[tokio::test]
async fn what_the_store_does_not_know_of_the_service_model_is_refused_and_changes_nothing() {
    let stage = stage().await;
    stage.put("a", "precious").await;
    let before = state(&stage).await;
    let mut wrong = String::new();
    let (mut operations_refused, mut parameters_refused) = (0, 0);
    for operation in operations() {
        let required: Vec<&Parameter> =
            operation.parameters.iter().filter(|p| p.is_required && p.kind != "element").collect();
        let mut asked: Vec<(Option<&str>, Vec<&Parameter>)> = Vec::new();
        if !is_known(operation.name, None) {
            asked.push((None, required.clone()));
        }
        for parameter in &operation.parameters {
            if !is_known(operation.name, None) || !is_known(operation.name, Some(parameter.name)) {
                let others = required.iter().copied().filter(|other| other.name != parameter.name);
                asked.push((Some(parameter.name), others.chain([parameter]).collect()));
            }
        }
        for (parameter, with) in asked {
            let (status, code) = ask(&stage, &operation, &with).await;
            let of_a_list = parameter.is_some_and(|name| name.starts_with("x-amz-grant-"))
                && is_known(operation.name, None);
            let expected =
                if of_a_list { (400, "AccessControlListNotSupported") } else { (501, "NotImplemented") };
            match parameter {
                None => operations_refused += 1,
                Some(_) => parameters_refused += 1,
            }
            if (status, code.as_str()) != expected {
                writeln!(wrong, "{} {}: {status} {code}", operation.name, parameter.unwrap_or_default())
                    .unwrap();
            }
        }
        let now = state(&stage).await;
        assert!(now == before, "{wrong}{} changed something:\n{before}{now}", operation.name);
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert_eq!(stage.get("a").await, b"precious");
    assert!(
        operations_refused >= 70 && parameters_refused >= 300,
        "{operations_refused} {parameters_refused}"
    );
}

/// A request like those of a later version of S3, with words that are in no model.
#[tokio::test]
async fn a_word_that_nobody_knows_is_refused_wherever_it_stands() {
    let stage = stage().await;
    stage.put("a", "precious").await;
    let before = state(&stage).await;
    let object = ["GET", "HEAD", "PUT", "POST", "DELETE"].map(|method| (method, "/films/a"));
    let bucket = ["GET", "HEAD", "PUT", "POST", "DELETE"].map(|method| (method, "/films"));
    let root = ["GET", "HEAD", "PUT", "POST", "DELETE"].map(|method| (method, "/"));
    let queries = [
        "?annex",
        "?annex=",
        "?%61nnex=1",
        "?x-annex=1",
        "?versionID=null",
        "?Acl",
        "?uploads&annex",
        "?uploadId=1&annex",
        "?x-id=PutAnnex",
        "?list-type=3",
        "?partNumber=1&annex",
        "?partNumber=1&partNumber=1&uploadId=1",
        "?uploadId=1&uploadId=1",
        "?X-Amz-Copy-Source=/films/a",
        "?x-amz-acl=private",
        "?events=s3:ObjectCreated:*",
    ];
    for (method, path) in object.into_iter().chain(bucket).chain(root) {
        for query in queries {
            let answer = send(&stage, method, &format!("{path}{query}"), &[], b"").await;
            let is_refused = answer.status == 501 || answer.failure() == (400, "InvalidArgument");
            let is_refused = is_refused || (method == "HEAD" && answer.status == 400);
            assert!(is_refused, "{method} {path}{query}: {answer:?}");
        }
        for header in [
            ("x-amz-annex", "1"),
            ("x-amz-checksum-sha3", "AAAA"),
            ("x-amz-trailer", "x-amz-checksum-sha3"),
            ("x-amz-write-offset-bytes", "0"),
            ("x-amz-rename-source", "/films/a"),
            ("content-range", "bytes 0-1/9"),
            ("x-amz-server-side-encryption-customer-algorithm", "AES256"),
        ] {
            let answer = send(&stage, method, path, &[header], b"").await;
            assert_eq!(answer.status, 501, "{method} {path} {header:?}: {answer:?}");
        }
    }
    for method in ["PATCH", "COPY", "MOVE", "LOCK", "TRACE", "annex"] {
        for path in ["/", "/films", "/films/a"] {
            let answer = send(&stage, method, path, &[], b"").await;
            assert_eq!(answer.failure(), (501, "NotImplemented"), "{method} {path}");
        }
    }
    assert_eq!(state(&stage).await, before);
    assert_eq!(stage.get("a").await, b"precious");
}
