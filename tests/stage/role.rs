//! Assumes a role by STS: a function's, as Lambda does, or that of a kind of user. The store then allows exactly the
//! operations in the role's policy.

use std::fmt::Display;
use std::path::Path;

use aws_sdk_sts::config::{BehaviorVersion, Credentials, Region};
use aws_smithy_http_client::Builder as HttpBuilder;
use rayfold_local::S3Server;
use rayfold_pipeline::store::Connection;

/// Returns the policy of a role for a bucket, as Terraform renders it. The role is that of a function, or `viewer`,
/// `uploader` or `operator`.
pub fn policy(role: impl Display, bucket: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../infra/terraform/policies");
    let template = std::fs::read_to_string(folder.join(format!("{role}.json.tftpl"))).unwrap();
    let document = template.replace("${bucket_arn}", &format!("arn:aws:s3:::{bucket}"));
    assert!(!document.contains("${"), "{role}: a variable that only Terraform knows");
    document
}

/// Returns temporary credentials with the role's policy.
pub async fn assume(server: &S3Server, role: impl Display, bucket: &str) -> Connection {
    let owner = server.connection();
    let document: serde_json::Value = serde_json::from_str(&policy(&role, bucket)).unwrap();
    let config = aws_sdk_sts::Config::builder()
        .behavior_version(BehaviorVersion::latest())
        .region(Region::new(owner.region.clone()))
        .endpoint_url(&owner.endpoint)
        .credentials_provider(Credentials::new(&owner.access_key, &owner.secret_key, None, None, "owner"))
        .http_client(HttpBuilder::new().build_http())
        .build();
    let answer = aws_sdk_sts::Client::from_conf(config)
        .assume_role()
        .role_arn(format!("arn:aws:iam::000000000000:role/rayfold-{role}"))
        .role_session_name(role.to_string())
        // STS accepts at most 2,048 characters, hence without spaces.
        .policy(document.to_string())
        .send()
        .await
        .unwrap();
    let given = answer.credentials().unwrap();
    Connection {
        access_key: given.access_key_id().to_owned(),
        secret_key: given.secret_access_key().to_owned(),
        session_token: Some(given.session_token().to_owned()),
        ..owner
    }
}

/// Returns the credentials for a process, in the variables that Lambda sets.
pub async fn environment(server: &S3Server, role: impl Display, bucket: &str) -> Vec<(String, String)> {
    let Connection { access_key, secret_key, session_token, .. } = assume(server, role, bucket).await;
    [
        ("AWS_ACCESS_KEY_ID", access_key),
        ("AWS_SECRET_ACCESS_KEY", secret_key),
        ("AWS_SESSION_TOKEN", session_token.unwrap()),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}
