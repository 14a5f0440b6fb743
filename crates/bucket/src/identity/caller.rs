//! The caller of a request, by its key and token.

use std::sync::Arc;
use std::time::SystemTime;

use s3s::auth::{S3Auth, SecretKey};
use s3s::{S3Error, S3ErrorCode, S3Result, s3_error};

use super::session::{Session, Sessions};
use crate::options::Credentials;

/// The owner and all sessions. Clones share them.
#[derive(Clone)]
pub(crate) struct Identities {
    owner: Arc<Credentials>,
    pub(super) sessions: Arc<Sessions>,
}

/// The identity whose key signed a request.
#[derive(Clone)]
pub(crate) enum Caller {
    /// The owner of the store.
    Owner,
    /// A session that has not expired.
    Session(Arc<Session>),
}

impl Identities {
    pub(crate) fn new(owner: Credentials, sessions: Sessions) -> Self {
        Self { owner: Arc::new(owner), sessions: Arc::new(sessions) }
    }

    /// Returns the secret of an access key.
    ///
    /// # Errors
    /// `InvalidAccessKeyId` for an unknown key, `ExpiredToken` for one of an expired session.
    fn secret(&self, access_key: &str, now: SystemTime) -> S3Result<SecretKey> {
        if access_key == self.owner.access_key {
            return Ok(self.owner.secret_key.as_str().into());
        }
        let session = self.session(access_key, now)?;
        Ok(session.secret_key.as_str().into())
    }

    /// Returns the identity with this key and this token.
    ///
    /// # Errors
    /// As [`Self::secret`]; `InvalidToken` for a token that does not belong to the key.
    pub(crate) fn caller(&self, access_key: &str, token: Option<&str>, now: SystemTime) -> S3Result<Caller> {
        let invalid = || s3_error!(InvalidToken, "The provided token is malformed or otherwise invalid.");
        if access_key == self.owner.access_key {
            return if token.is_none() { Ok(Caller::Owner) } else { Err(invalid()) };
        }
        let session = self.session(access_key, now)?;
        match token {
            Some(token) if session.has_token(token) => Ok(Caller::Session(session)),
            Some(_) => Err(invalid()),
            // S3 answers likewise: a temporary key without its token is unknown.
            None => Err(unknown_key()),
        }
    }

    fn session(&self, access_key: &str, now: SystemTime) -> S3Result<Arc<Session>> {
        let session = self.sessions.get(access_key).ok_or_else(unknown_key)?;
        if session.is_over(now) {
            return Err(s3_error!(ExpiredToken, "The provided token has expired."));
        }
        Ok(session)
    }
}

fn unknown_key() -> S3Error {
    let message = "The AWS Access Key Id you provided does not exist in our records.";
    S3Error::with_message(S3ErrorCode::InvalidAccessKeyId, message)
}

#[async_trait::async_trait]
impl S3Auth for Identities {
    async fn get_secret_key(&self, access_key: &str) -> S3Result<SecretKey> {
        self.secret(access_key, SystemTime::now())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::storage::Storage;

    fn owner() -> Credentials {
        Credentials { access_key: "owner".into(), secret_key: "secret".into() }
    }

    fn code<T>(result: S3Result<T>) -> String {
        result.err().map_or("none".to_owned(), |error| error.code().as_str().to_owned())
    }

    #[tokio::test]
    async fn a_session_is_known_by_key_and_token_until_it_is_over() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let now = SystemTime::now();
        let identities = Identities::new(owner(), Sessions::open(storage, now).unwrap());
        let session = Session::example("KEY", now + Duration::from_secs(900));
        let token = session.token.clone();
        identities.sessions.add("KEY", session, now).await.unwrap();
        let later = now + Duration::from_secs(899);
        assert!(matches!(identities.caller("KEY", Some(&token), later), Ok(Caller::Session(_))));
        assert_eq!(code(identities.caller("KEY", Some("guess"), later)), "InvalidToken");
        assert_eq!(code(identities.caller("KEY", None, later)), "InvalidAccessKeyId");
        assert_eq!(code(identities.caller("OTHER", Some(&token), later)), "InvalidAccessKeyId");
        let over = now + Duration::from_secs(900);
        assert_eq!(code(identities.caller("KEY", Some(&token), over)), "ExpiredToken");
        assert_eq!(code(identities.secret("KEY", over)), "ExpiredToken");
        assert!(matches!(identities.caller("owner", None, over), Ok(Caller::Owner)));
        assert_eq!(code(identities.caller("owner", Some(&token), now)), "InvalidToken");
        drop(identities);
        writing.end();
    }
}
