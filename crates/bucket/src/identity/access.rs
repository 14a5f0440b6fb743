//! The access check of a request: the rights that it needs, and whether its caller has them.
//!
//! All rights except those for a copy's source and for the keys of a multi-delete are known before the
//! operation's input is read.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::SystemTime;

use hyper::http::Extensions;
use s3s::access::{S3Access, S3AccessContext};
use s3s::dto::{CopyObjectInput, CopySource, DeleteObjectsInput, UploadPartCopyInput};
use s3s::path::S3Path;
use s3s::{S3Error, S3ErrorCode, S3Request, S3Result, s3_error};

use super::caller::{Caller, Identities};
use super::session::Session;
use super::signed::{self, parameter};
use crate::gate::Gate;
use crate::policy::{self, Scope, Verdict, needed};

/// The header with a session's token, unless the token is in the URL.
const TOKEN: &str = "x-amz-security-token";

/// The access check, which runs for each request.
pub(crate) struct Access(pub(crate) Identities);

/// The keys of a multi-delete that the caller may not delete.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeniedKeys(pub(crate) HashSet<String>);

/// A mark that the caller may not list the bucket from which it reads.
#[derive(Clone, Copy)]
struct MayNotList;

/// Replaces `NoSuchKey` by `AccessDenied` for callers who may not list the bucket, as S3 does.
pub(crate) fn hide_missing_key(extensions: &Extensions) -> impl Fn(S3Error) -> S3Error + use<> {
    let may_list = extensions.get::<MayNotList>().is_none();
    move |error| {
        if may_list || *error.code() != S3ErrorCode::NoSuchKey {
            error
        } else {
            s3_error!(AccessDenied, "Access Denied")
        }
    }
}

#[async_trait::async_trait]
impl S3Access for Access {
    async fn check(&self, cx: &mut S3AccessContext<'_>) -> S3Result<()> {
        let Some(access_key) = cx.credentials().map(|credentials| credentials.access_key.clone()) else {
            return Err(s3_error!(AccessDenied, "Access Denied: requests must be signed"));
        };
        let query = cx.uri().query().unwrap_or_default();
        let query: Vec<(String, String)> =
            serde_urlencoded::from_str(query).map_err(|e| s3_error!(e, InvalidURI))?;
        if cx.s3_op().name() != "PostObject" {
            signed::check(cx.headers(), &query)?;
        }
        let routed = cx.s3_op().name().to_owned();
        match cx.extensions_mut().get::<Gate>() {
            Some(gate) => gate.check_route(&routed)?,
            None => return Err(s3_error!(InternalError, "a request passed by the table of operations")),
        }
        let token = match cx.headers().get(TOKEN) {
            Some(token) => Some(token.to_str().map_err(|e| s3_error!(e, InvalidToken))?),
            None => parameter(&query, "X-Amz-Security-Token")?,
        };
        let session = match self.0.caller(&access_key, token, SystemTime::now())? {
            Caller::Owner => return Ok(()),
            Caller::Session(session) => session,
        };
        let operation = cx.s3_op().name();
        // For `DeleteObjects`, each key is checked once the keys are known.
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
            // Setting a canned access list needs a right of its own.
            if cx.headers().contains_key("x-amz-acl") && scope == Scope::Object {
                ask(&session, &plainly("s3:PutObjectAcl", &resource))?;
            }
        }
        if let Some(bucket) = cx.s3_path().get_bucket_name().map(str::to_owned) {
            note_listing(&session, &bucket, cx.extensions_mut());
        }
        cx.extensions_mut().insert(session);
        Ok(())
    }

    async fn copy_object(&self, req: &mut S3Request<CopyObjectInput>) -> S3Result<()> {
        may_read(&mut req.extensions, &req.input.copy_source)
    }

    async fn upload_part_copy(&self, req: &mut S3Request<UploadPartCopyInput>) -> S3Result<()> {
        may_read(&mut req.extensions, &req.input.copy_source)
    }

    async fn delete_objects(&self, req: &mut S3Request<DeleteObjectsInput>) -> S3Result<()> {
        let Some(session) = req.extensions.get::<Arc<Session>>().cloned() else { return Ok(()) };
        let is_denied = |key: &&str| {
            let resource = arn(&req.input.bucket, Some(key));
            session.policy.verdict(&plainly("s3:DeleteObject", &resource)) != Verdict::Allowed
        };
        let keys = req.input.delete.objects.iter().map(|object| object.key.as_str());
        let denied = DeniedKeys(keys.filter(is_denied).map(str::to_owned).collect());
        req.extensions.insert(denied);
        Ok(())
    }
}

fn may_read(extensions: &mut Extensions, source: &CopySource) -> S3Result<()> {
    let Some(session) = extensions.get::<Arc<Session>>().cloned() else { return Ok(()) };
    match source {
        CopySource::Bucket { bucket, key, .. } => {
            note_listing(&session, bucket, extensions);
            ask(&session, &plainly("s3:GetObject", &arn(bucket, Some(key))))
        }
        _ => Err(denied(&session, "s3:GetObject", "its source is no bucket of this store")),
    }
}

/// Records for [`hide_missing_key`] whether the caller may list the bucket.
fn note_listing(session: &Session, bucket: &str, extensions: &mut Extensions) {
    let resource = arn(bucket, None);
    match session.policy.verdict(&plainly("s3:ListBucket", &resource)) {
        Verdict::Allowed => drop(extensions.remove::<MayNotList>()),
        Verdict::Denied | Verdict::NotAllowed => drop(extensions.insert(MayNotList)),
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

/// Makes an access without the fields of a listing.
fn plainly<'a>(action: &'a str, resource: &'a str) -> policy::Access<'a> {
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
