//! Buckets: creating, finding, listing and deleting them, and requests for configurations that they cannot have.

use s3s::dto::*;
use s3s::{S3Error, S3ErrorCode, S3Response, S3Result, s3_error};

use super::Service;
use super::objects::bucket;
use crate::answer::{Answer, invalid_argument, no_lists, not_implemented, time, unreadable};
use crate::options::OWNER;
use crate::records::{self, Moment, abandon, all, decode, find, key, set};
use crate::storage::{Kind, Table, View};

/// The default number of buckets on a page.
const PAGE: usize = 10_000;

impl Service {
    pub(super) fn handle_list_buckets(&self, input: &ListBucketsInput) -> Answer<ListBucketsOutput> {
        let most = match input.max_buckets {
            None => PAGE,
            Some(most @ 1..=10_000) => usize::try_from(most).unwrap_or(PAGE),
            Some(_) => return Err(invalid_argument("max-buckets is between 1 and 10000")),
        };
        let prefix = input.prefix.as_deref().unwrap_or_default();
        let elsewhere = input.bucket_region.as_deref().is_some_and(|region| region != &*self.region);
        let mut buckets = Vec::new();
        let mut next = None;
        // The token is the name of the last bucket listed.
        let after = input.continuation_token.as_deref().unwrap_or_default();
        let rows = all(&self.snapshot()?, Table::Buckets, prefix.as_bytes()).map_err(unreadable)?;
        for (name, value) in rows {
            let name = String::from_utf8_lossy(&name).into_owned();
            if elsewhere || *name <= *after {
                continue;
            }
            if buckets.len() == most {
                next = buckets.last().and_then(|last: &Bucket| last.name.clone());
                break;
            }
            let record: records::Bucket = decode(&value).map_err(unreadable)?;
            buckets.push(Bucket {
                name: Some(name),
                creation_date: Some(time(record.created)),
                bucket_region: Some(self.region.to_string()),
            });
        }
        Ok(ListBucketsOutput {
            buckets: Some(buckets),
            continuation_token: next,
            owner: Some(owner()),
            prefix: input.prefix.clone(),
        })
    }

    pub(super) async fn handle_create_bucket(&self, input: CreateBucketInput) -> Answer<CreateBucketOutput> {
        if input.object_lock_enabled_for_bucket == Some(true) {
            return Err(not_implemented("object lock"));
        }
        let configuration = input.create_bucket_configuration.unwrap_or_default();
        if configuration.bucket.is_some() || configuration.location.is_some() {
            return Err(not_implemented("a directory bucket"));
        }
        let place = configuration.location_constraint.as_ref().map(BucketLocationConstraint::as_str);
        if place.is_some_and(|place| !place.is_empty() && place != &*self.region) {
            return Err(s3_error!(
                IllegalLocationConstraintException,
                "The buckets of this store are in {}.",
                self.region
            ));
        }
        let name = input.bucket;
        if !can_be_new(&name) {
            return Err(s3_error!(InvalidBucketName, "The specified bucket is not valid."));
        }
        let location = format!("/{name}");
        // As in S3's first region, which answers the owner as if the bucket were new.
        let again_is_fine = &*self.region == "us-east-1";
        let create = self.change(Kind::Grows, move |batch| {
            if batch.get(Table::Buckets, name.as_bytes())?.is_some() {
                if again_is_fine {
                    return Ok(());
                }
                return Err(S3Error::with_message(
                    S3ErrorCode::BucketAlreadyOwnedByYou,
                    "Your previous request to create the named bucket succeeded and you already own it.",
                )
                .into());
            }
            let record =
                records::Bucket { created: Moment::now(), notifications: Vec::new(), cors: Vec::new() };
            Ok(set(batch, Table::Buckets, name.as_bytes(), &record)?)
        });
        create.await?;
        Ok(CreateBucketOutput { location: Some(location) })
    }

    pub(super) fn bucket_exists(&self, name: &str) -> Answer<()> {
        self.bucket(&self.snapshot()?, name).map(drop)
    }

    pub(super) fn handle_head_bucket(&self, input: &HeadBucketInput) -> Answer<HeadBucketOutput> {
        self.bucket_exists(&input.bucket)?;
        Ok(HeadBucketOutput { bucket_region: Some(self.region.to_string()), ..HeadBucketOutput::default() })
    }

    /// Returns the region. An empty location means us-east-1, as in S3.
    pub(super) fn handle_get_bucket_location(
        &self,
        input: &GetBucketLocationInput,
    ) -> Answer<GetBucketLocationOutput> {
        self.bucket_exists(&input.bucket)?;
        let elsewhere = &*self.region != "us-east-1";
        let location_constraint = elsewhere.then(|| self.region.to_string().into());
        Ok(GetBucketLocationOutput { location_constraint })
    }

    /// Deletes an empty bucket, with its unfinished uploads.
    pub(super) async fn handle_delete_bucket(&self, input: DeleteBucketInput) -> Answer<DeleteBucketOutput> {
        let name = input.bucket;
        let delete = self.change(Kind::Shrinks, move |batch| {
            bucket(batch, &name)?;
            let inside = key::object(&name, b"");
            if batch.beginning_with(Table::Objects, &inside)?.next().transpose()?.is_some() {
                return Err(s3_error!(BucketNotEmpty, "The bucket you tried to delete is not empty").into());
            }
            for (row, _) in all(batch, Table::Uploads, &inside)? {
                abandon(batch, &row)?;
            }
            batch.remove(Table::Buckets, name.as_bytes())?;
            Ok(())
        });
        delete.await?;
        Ok(DeleteBucketOutput {})
    }

    /// Refuses a request for a configuration that a bucket of this store cannot have.
    pub(super) fn no_configuration<O>(&self, bucket: &str, code: S3ErrorCode) -> S3Result<S3Response<O>> {
        let _: records::Bucket = find(&self.snapshot()?, Table::Buckets, bucket.as_bytes())
            .map_err(unreadable)?
            .ok_or_else(crate::answer::no_such_bucket)?;
        Err(S3Error::with_message(code, "The bucket has no such configuration"))
    }
}

/// Checks S3's rules for the name of a new bucket beyond those that `s3s` checks.
fn can_be_new(name: &str) -> bool {
    let kept = ["sthree-", "amzn-s3-demo-"].iter().any(|start| name.starts_with(start))
        || ["-s3alias", "--ol-s3", ".mrap", "--x-s3", "--table-s3"].iter().any(|end| name.ends_with(end));
    !kept && !name.contains(".-") && !name.contains("-.")
}

/// Checks that an access list only repeats the fixed rights: the owner may do everything. Canned
/// lists were checked before.
pub(super) fn check_list(is_canned: bool, list: Option<AccessControlPolicy>) -> Answer<()> {
    let Some(list) = list else {
        return if is_canned { Ok(()) } else { Err(s3_error!(MissingSecurityHeader, "An ACL is missing.")) };
    };
    let is_owners = |grant: &Grant| {
        grant.grantee.as_ref().is_some_and(|grantee| grantee.id.as_deref() == Some(OWNER))
            && grant.permission.as_ref().is_some_and(|may| may.as_str() == Permission::FULL_CONTROL)
    };
    let grants = list.grants.unwrap_or_default();
    if is_canned || grants.is_empty() || !grants.iter().all(is_owners) {
        return Err(no_lists());
    }
    Ok(())
}

pub(super) fn owner() -> Owner {
    Owner { display_name: Some("owner".to_owned()), id: Some(OWNER.to_owned()) }
}

/// Returns the access list of every bucket and object.
pub(super) fn owners_alone() -> GetBucketAclOutput {
    let grantee = Grantee {
        display_name: Some("owner".to_owned()),
        email_address: None,
        id: Some(OWNER.to_owned()),
        type_: Type::from_static(Type::CANONICAL_USER),
        uri: None,
    };
    let grant =
        Grant { grantee: Some(grantee), permission: Some(Permission::from_static(Permission::FULL_CONTROL)) };
    GetBucketAclOutput { grants: Some(vec![grant]), owner: Some(owner()) }
}

#[cfg(test)]
mod tests {
    use super::can_be_new;

    #[test]
    fn names_that_s3_keeps_or_refuses_are_refused() {
        assert!(can_be_new("films") && can_be_new("my.films-2"));
        for name in ["a.-b", "a-.b", "sthree-a", "amzn-s3-demo-a", "a-s3alias", "a--x-s3", "a.mrap"] {
            assert!(!can_be_new(name), "{name}");
        }
    }
}
