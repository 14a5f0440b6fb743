//! DeleteObject and DeleteObjects. Deleting a missing object succeeds.

use s3s::dto::*;
use s3s::{S3Request, s3_error};

use super::objects::{bucket, tell};
use super::{Caller, ChangeError, Service};
use crate::answer::{Answer, invalid_request, not_implemented, precondition_failed, unavailable};
use crate::identity::DeniedKeys;
use crate::records::{self, find, key, release};
use crate::storage::{Batch, Bodies, Kind, Table};

/// S3's limit on the keys of a request.
const MAX_KEYS: usize = 1000;

impl Service {
    pub(super) async fn handle_delete_object(
        &self,
        req: S3Request<DeleteObjectInput>,
    ) -> Answer<DeleteObjectOutput> {
        let caller = Caller::of(&req);
        let input = req.input;
        let ids = self.storage.bodies().clone();
        let delete = self.change(Kind::Shrinks, move |batch| {
            let here = bucket(batch, &input.bucket)?;
            remove(batch, &ids, (&input.bucket, &here), &input.key, input.if_match.as_ref(), &caller)
        });
        delete.await?;
        Ok(DeleteObjectOutput::default())
    }

    pub(super) async fn handle_delete_objects(
        &self,
        req: S3Request<DeleteObjectsInput>,
    ) -> Answer<DeleteObjectsOutput> {
        let caller = Caller::of(&req);
        let S3Request { input: DeleteObjectsInput { bucket: name, delete, .. }, extensions, .. } = req;
        let denied = extensions.get::<DeniedKeys>().cloned().unwrap_or_default();
        if delete.objects.is_empty() || delete.objects.len() > MAX_KEYS {
            return Err(s3_error!(
                MalformedXML,
                "The request must name between 1 and {MAX_KEYS} objects to delete"
            ));
        }
        for object in &delete.objects {
            if object.last_modified_time.is_some() || object.size.is_some() {
                return Err(not_implemented("a delete on a condition of size or date"));
            }
            if object.version_id.as_deref().is_some_and(|version| !matches!(version, "" | "null")) {
                return Err(invalid_request("Invalid version id specified: buckets here have no versions"));
            }
        }
        let ids = self.storage.bodies().clone();
        let quiet = delete.quiet.unwrap_or_default();
        let delete = self.storage.change(Kind::Shrinks, move |batch| {
            let here = match bucket(batch, &name) {
                Ok(here) => here,
                Err(ChangeError::Refused(refused)) => return Ok(Err(*refused)),
                Err(ChangeError::Storage(error)) => return Err(error),
            };
            let mut output = (Vec::new(), Vec::new());
            for object in delete.objects {
                if denied.0.contains(&object.key) {
                    output.1.push((object.key, s3_error!(AccessDenied, "Access Denied")));
                    continue;
                }
                let condition = object.e_tag.map(ETagCondition::ETag);
                match remove(batch, &ids, (&name, &here), &object.key, condition.as_ref(), &caller) {
                    Ok(()) => output.0.push(object.key),
                    Err(ChangeError::Refused(refused)) => output.1.push((object.key, *refused)),
                    Err(ChangeError::Storage(error)) => return Err(error),
                }
            }
            Ok(Ok(output))
        });
        let (deleted, refused) = delete.await.map_err(|reason| unavailable(&reason))??;
        let deleted =
            deleted.into_iter().map(|key| DeletedObject { key: Some(key), ..DeletedObject::default() });
        let errors = refused.into_iter().map(|(key, error)| Error {
            code: Some(error.code().as_str().to_owned()),
            key: Some(key),
            message: error.message().map(str::to_owned),
            version_id: None,
        });
        Ok(DeleteObjectsOutput {
            deleted: (!quiet).then(|| deleted.collect()),
            errors: Some(errors.collect()),
            request_charged: None,
        })
    }
}

/// Removes an object under its condition, and writes an event if it existed.
fn remove(
    batch: &mut Batch<'_>,
    ids: &Bodies,
    (name, here): (&str, &records::Bucket),
    object_key: &str,
    if_match: Option<&ETagCondition>,
    caller: &Caller,
) -> Result<(), ChangeError> {
    let row = key::object(name, object_key.as_bytes());
    let existing: Option<records::Object> = find(batch, Table::Objects, &row)?;
    if let Some(condition) = if_match {
        let matches = match (condition, &existing) {
            (_, None) => return Err(crate::answer::no_such_key().into()),
            (ETagCondition::Any, Some(_)) => true,
            (ETagCondition::ETag(given), Some(object)) => given.value() == object.etag,
        };
        if !matches {
            return Err(precondition_failed().into());
        }
    }
    if let Some(existing) = existing {
        release(batch, existing.body)?;
        batch.remove(Table::Objects, &row)?;
        tell(batch, ids, (name, here), object_key, "ObjectRemoved:Delete", None, caller)?;
    }
    Ok(())
}
