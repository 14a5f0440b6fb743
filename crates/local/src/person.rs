//! People who sign in: temporary credentials with the rights of a person, as Cognito and the stack's role give them on AWS.

use rayfold_pipeline::store::Connection;

use crate::error::{Error, Result};

/// The rights of a person, as Terraform reads them.
const RIGHTS: &str = include_str!("../../../infra/terraform/policies/person.json.tftpl");

/// The lifetime of the credentials in seconds, as on AWS.
const SECONDS: i32 = 3600;

/// Returns credentials of a person for a bucket, issued by the store's owner. On AWS, IAM inserts the identity into the
/// policy at each request; here the policy already contains it. The identity is one of a Cognito identity pool, or of
/// the same form.
///
/// # Errors
/// [`Error::NoSession`] if the store gives no temporary credentials, as SeaweedFS.
pub async fn sign_in(owner: &Connection, identity: &str, bucket: &str) -> Result<Connection> {
    let failed = |reason: String| Error::NoSession { reason };
    // What a policy gives a meaning would be more than a name.
    if !identity.chars().all(|c| c.is_ascii_alphanumeric() || ":-.".contains(c)) {
        return Err(failed(format!("{identity:?} is no identity")));
    }
    let given = owner.session("rayfold-person", &rights(identity, bucket), SECONDS).await;
    given.map_err(|error| {
        let source = std::error::Error::source(&error).map(ToString::to_string);
        failed(source.unwrap_or_else(|| error.to_string()))
    })
}

/// The policy document with a person's rights. It has no spaces, because STS takes at most 2,048 characters.
fn rights(identity: &str, bucket: &str) -> String {
    let arn = format!("arn:aws:s3:::{bucket}");
    let filled = RIGHTS.replace("${bucket_arn}", &arn).replace("${person}", identity);
    filled.split_whitespace().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_names_fit() {
        let rights = rights("ap-southeast-2:11111111-2222-3333-4444-555555555555", &"b".repeat(63));
        assert!(rights.len() <= 2048, "{}", rights.len());
        assert!(!rights.contains("${"), "{rights}");
        assert!(serde_json::from_str::<serde_json::Value>(&rights).is_ok(), "{rights}");
    }
}
