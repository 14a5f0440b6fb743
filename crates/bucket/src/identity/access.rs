//! What a request asks for, and whether its caller may do it.
//!
//! Everything but a copy's source and the keys of a multi-delete is known before the operation's input is read.

use std::sync::Arc;
use std::time::SystemTime;

use s3s::access::{S3Access, S3AccessContext};
use s3s::dto::{CopyObjectInput, CopySource, DeleteObjectsInput, UploadPartCopyInput};
use s3s::path::S3Path;
use s3s::{S3Error, S3ErrorCode, S3Request, S3Result, s3_error};

use super::caller::{Caller, Identities};
use super::session::Session;
use crate::policy::{self, Scope, Verdict, needed};

/// Where a session's token is, unless it is in the URL.
const TOKEN: &str = "x-amz-security-token";

/// Asks the identities at each request.
pub(crate) struct Access(pub(crate) Identities);

/// The keys of a multi-delete that the caller may not delete; they were taken out of the request.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeniedKeys(pub(crate) Vec<String>);

/// What to answer where there is no object: whoever may not list the bucket is not told that it is absent.
pub(crate) fn absent(extensions: &hyper::http::Extensions, bucket: &str) -> S3Error {
    let may_list = extensions.get::<Arc<Session>>().is_none_or(|session| {
        let resource = arn(bucket, None);
        let list =
            policy::Access { action: "s3:ListBucket", resource: &resource, prefix: None, delimiter: None };
        session.policy.verdict(&list) == Verdict::Allowed
    });
    if may_list {
        s3_error!(NoSuchKey, "The specified key does not exist.")
    } else {
        s3_error!(AccessDenied, "Access Denied")
    }
}

#[async_trait::async_trait]
impl S3Access for Access {
    async fn check(&self, cx: &mut S3AccessContext<'_>) -> S3Result<()> {
        let Some(credentials) = cx.credentials() else {
            return Err(s3_error!(AccessDenied, "Access Denied: requests must be signed"));
        };
        let query = cx.uri().query().unwrap_or_default();
        let query: Vec<(String, String)> =
            serde_urlencoded::from_str(query).map_err(|e| s3_error!(e, InvalidURI))?;
        let token = match cx.headers().get(TOKEN) {
            Some(token) => Some(token.to_str().map_err(|e| s3_error!(e, InvalidToken))?),
            None => parameter(&query, "X-Amz-Security-Token")?,
        };
        let session = match self.0.caller(&credentials.access_key, token, SystemTime::now())? {
            Caller::Owner => return Ok(()),
            Caller::Session(session) => session,
        };
        let operation = cx.s3_op().name();
        // Key by key, when they are known.
        if operation != "DeleteObjects" {
            let Some((scope, actions)) = needed(operation) else {
                return Err(denied(&session, operation, "no policy can allow it"));
            };
            let lists = matches!(operation, "ListObjects" | "ListObjectsV2" | "ListObjectVersions");
            let listed = |name| if lists { parameter(&query, name) } else { Ok(None) };
            let (prefix, delimiter) = (listed("prefix")?, listed("delimiter")?);
            let resource = resource(scope, cx.s3_path())?;
            for action in actions {
                ask(&session, &policy::Access { action, resource: &resource, prefix, delimiter })?;
            }
            // A canned list of who may do what is a right of its own.
            if cx.headers().contains_key("x-amz-acl") && scope == Scope::Object {
                ask(&session, &on_object("s3:PutObjectAcl", &resource))?;
            }
        }
        cx.extensions_mut().insert(session);
        Ok(())
    }

    async fn copy_object(&self, req: &mut S3Request<CopyObjectInput>) -> S3Result<()> {
        may_read(&req.extensions, &req.input.copy_source)
    }

    async fn upload_part_copy(&self, req: &mut S3Request<UploadPartCopyInput>) -> S3Result<()> {
        may_read(&req.extensions, &req.input.copy_source)
    }

    async fn delete_objects(&self, req: &mut S3Request<DeleteObjectsInput>) -> S3Result<()> {
        let Some(session) = req.extensions.get::<Arc<Session>>().cloned() else { return Ok(()) };
        let mut denied = DeniedKeys::default();
        let bucket = req.input.bucket.clone();
        req.input.delete.objects.retain(|object| {
            let resource = arn(&bucket, Some(&object.key));
            let may = session.policy.verdict(&on_object("s3:DeleteObject", &resource)) == Verdict::Allowed;
            if !may {
                denied.0.push(object.key.clone());
            }
            may
        });
        req.extensions.insert(denied);
        Ok(())
    }
}

fn may_read(extensions: &hyper::http::Extensions, source: &CopySource) -> S3Result<()> {
    let Some(session) = extensions.get::<Arc<Session>>() else { return Ok(()) };
    match source {
        CopySource::Bucket { bucket, key, .. } => {
            ask(session, &on_object("s3:GetObject", &arn(bucket, Some(key))))
        }
        _ => Err(denied(session, "s3:GetObject", "its source is no bucket of this store")),
    }
}

fn ask(session: &Session, access: &policy::Access<'_>) -> S3Result<()> {
    match session.policy.verdict(access) {
        Verdict::Allowed => Ok(()),
        Verdict::Denied => Err(denied(session, access.action, "its policy denies it")),
        Verdict::NotAllowed => Err(denied(session, access.action, "its policy does not allow it")),
    }
}

fn denied(session: &Session, action: &str, why: &str) -> S3Error {
    let message = format!("{} is not authorized to perform {action}: {why}", session.arn);
    S3Error::with_message(S3ErrorCode::AccessDenied, message)
}

fn on_object<'a>(action: &'a str, resource: &'a str) -> policy::Access<'a> {
    policy::Access { action, resource, prefix: None, delimiter: None }
}

fn resource(scope: Scope, path: &S3Path) -> S3Result<String> {
    let bucket = path.get_bucket_name();
    match (scope, bucket, path.get_object_key()) {
        (Scope::Account, ..) => Ok(arn("*", None)),
        (Scope::Bucket, Some(bucket), _) => Ok(arn(bucket, None)),
        (Scope::Object, Some(bucket), Some(key)) => Ok(arn(bucket, Some(key))),
        (Scope::Bucket | Scope::Object, ..) => Err(s3_error!(AccessDenied, "Access Denied")),
    }
}

fn arn(bucket: &str, key: Option<&str>) -> String {
    match key {
        Some(key) => format!("arn:aws:s3:::{bucket}/{key}"),
        None => format!("arn:aws:s3:::{bucket}"),
    }
}

/// A parameter that may stand there once: with two, one would be judged and the other be used.
fn parameter<'a>(query: &'a [(String, String)], name: &str) -> S3Result<Option<&'a str>> {
    let mut found = query.iter().filter(|(other, _)| other == name).map(|(_, value)| value.as_str());
    let first = found.next();
    if found.next().is_some() {
        return Err(s3_error!(InvalidArgument, "{name} stands there twice"));
    }
    Ok(first)
}
