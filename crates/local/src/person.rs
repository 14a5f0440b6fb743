//! People who sign in: temporary credentials with the rights of a person, as Cognito and the stack's role give them on AWS.

use aws_sdk_sts::config::{BehaviorVersion, Credentials, Region};
use aws_sdk_sts::error::DisplayErrorContext;
use aws_smithy_http_client::Builder;
use rayfold_pipeline::store::Connection;

use crate::error::{Error, Result};

/// What a person may do, as Terraform reads it.
const RIGHTS: &str = include_str!("../../../infra/terraform/policies/person.json.tftpl");

/// The seconds for which the credentials are of use, as on AWS.
const SECONDS: i32 = 3600;

/// Returns credentials of a person for a bucket, by the store's owner. On AWS, IAM puts the identity into the policy at each
/// request; here it is there before. An identity is that of a Cognito identity pool, or one like it.
///
/// # Errors
/// [`Error::NoSession`] if the store gives no temporary credentials, as SeaweedFS.
pub async fn sign_in(owner: &Connection, identity: &str, bucket: &str) -> Result<Connection> {
    let failed = |reason: String| Error::NoSession { reason };
    // What a policy gives a meaning would be more than a name.
    if !identity.chars().all(|c| c.is_ascii_alphanumeric() || ":-.".contains(c)) {
        return Err(failed(format!("{identity:?} is no identity")));
    }
    let config = aws_sdk_sts::Config::builder()
        .behavior_version(BehaviorVersion::latest())
        .region(Region::new(owner.region.clone()))
        .endpoint_url(&owner.endpoint)
        .credentials_provider(Credentials::new(&owner.access_key, &owner.secret_key, None, None, "owner"))
        .http_client(Builder::new().build_http())
        .build();
    let answer = aws_sdk_sts::Client::from_conf(config)
        .assume_role()
        .role_arn("arn:aws:iam::000000000000:role/rayfold-person")
        .role_session_name("person")
        .duration_seconds(SECONDS)
        .policy(rights(identity, bucket))
        .send()
        .await
        .map_err(|error| failed(DisplayErrorContext(error).to_string()))?;
    let given = answer.credentials().ok_or_else(|| failed("the answer is empty".into()))?;
    Ok(Connection {
        access_key: given.access_key_id().to_owned(),
        secret_key: given.secret_access_key().to_owned(),
        session_token: Some(given.session_token().to_owned()),
        ..owner.clone()
    })
}

/// The document of a person's rights. STS takes at most 2,048 characters, hence without spaces.
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
