//! Temporary credentials of a server that speaks STS, with fewer rights than their owner has.

use aws_sdk_sts::config::{BehaviorVersion, Credentials, Region};
use aws_smithy_http_client::Builder;

use super::Connection;
use crate::{Error, Result};

impl Connection {
    /// Returns credentials that are valid for some seconds, with the rights of a policy, for a role of this name.
    ///
    /// # Errors
    /// [`Error::Refused`] if the server gives none.
    pub async fn session(&self, role: &str, policy: &str, seconds: i32) -> Result<Self> {
        let refused = |source| Error::Refused { key: role.to_owned(), source };
        let config = aws_sdk_sts::Config::builder()
            .behavior_version(BehaviorVersion::latest())
            .region(Region::new(self.region.clone()))
            .endpoint_url(&self.endpoint)
            .credentials_provider(Credentials::new(&self.access_key, &self.secret_key, None, None, "owner"))
            .http_client(Builder::new().build_http())
            .build();
        let answer = aws_sdk_sts::Client::from_conf(config)
            .assume_role()
            .role_arn(format!("arn:aws:iam::000000000000:role/{role}"))
            .role_session_name(role)
            .duration_seconds(seconds)
            .policy(policy)
            .send()
            .await
            .map_err(|error| refused(error.into_service_error().into()))?;
        let given = answer.credentials().ok_or_else(|| refused("the answer is empty".into()))?;
        Ok(Self {
            access_key: given.access_key_id().to_owned(),
            secret_key: given.secret_access_key().to_owned(),
            session_token: Some(given.session_token().to_owned()),
            ..self.clone()
        })
    }
}
