//! Sessions: made once, looked up for each request, and kept in the database for the next start.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use redb::StorageError;
use serde::{Deserialize, Serialize};

use crate::policy::Policy;
use crate::storage::{Kind, Storage, Table, Unavailable, View};

/// A session made by `AssumeRole`, and its holder.
pub(crate) struct Session {
    pub(crate) secret_key: String,
    pub(crate) token: String,
    pub(crate) policy: Policy,
    /// The ARN of the session: `arn:aws:sts::000000000000:assumed-role/role/session`.
    pub(crate) arn: String,
    pub(crate) expires: SystemTime,
    /// The policy document as it was received.
    document: String,
}

impl Session {
    /// Parses the policy document.
    ///
    /// # Errors
    /// The error in the policy.
    pub(crate) fn new(
        secret_key: String,
        token: String,
        document: &str,
        arn: String,
        expires: SystemTime,
    ) -> Result<Self, serde_json::Error> {
        let policy = document.parse()?;
        Ok(Self { secret_key, token, policy, arn, expires, document: document.to_owned() })
    }

    pub(crate) fn is_over(&self, now: SystemTime) -> bool {
        now >= self.expires
    }

    /// Compares the token in constant time, which reveals nothing about the position of a difference.
    pub(crate) fn has_token(&self, token: &str) -> bool {
        let (ours, theirs) = (self.token.as_bytes(), token.as_bytes());
        ours.len() == theirs.len() && ours.iter().zip(theirs).fold(0, |diff, (a, b)| diff | (a ^ b)) == 0
    }
}

impl fmt::Debug for Session {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session")
            .field("arn", &self.arn)
            .field("expires", &self.expires)
            .finish_non_exhaustive()
    }
}

/// The form of a session in the database.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept {
    secret_key: String,
    token: String,
    policy: String,
    arn: String,
    /// The expiry in milliseconds since 1970.
    expires_ms: u64,
}

/// All sessions that have not expired.
pub(crate) struct Sessions {
    storage: Storage,
    by_key: RwLock<BTreeMap<String, Arc<Session>>>,
}

impl Sessions {
    /// Loads the sessions of earlier runs that have not expired.
    ///
    /// # Errors
    /// Returns an error if the storage cannot be read.
    pub(crate) fn open(storage: Storage, now: SystemTime) -> Result<Self, Unavailable> {
        let failed = |error: StorageError| Unavailable::Failed(error.to_string().into());
        let mut by_key = BTreeMap::new();
        for row in storage.snapshot()?.from(Table::Sessions, b"").map_err(failed)? {
            let (key, kept) = row.map_err(failed)?;
            if let (Ok(key), Some(session)) = (String::from_utf8(key), read(&kept)) {
                by_key.insert(key, Arc::new(session));
            }
        }
        by_key.retain(|_, session| !session.is_over(now));
        Ok(Self { storage, by_key: RwLock::new(by_key) })
    }

    pub(crate) fn get(&self, access_key: &str) -> Option<Arc<Session>> {
        self.by_key.read().unwrap_or_else(PoisonError::into_inner).get(access_key).cloned()
    }

    /// Stores a session. It is known from the return on, also after a crash. Removes the expired ones.
    ///
    /// # Errors
    /// Returns an error if the storage cannot be written.
    pub(crate) async fn add(
        &self,
        access_key: &str,
        session: Session,
        now: SystemTime,
    ) -> Result<(), Unavailable> {
        let expires = session.expires.duration_since(UNIX_EPOCH).unwrap_or_default().as_millis();
        let kept = Kept {
            secret_key: session.secret_key.clone(),
            token: session.token.clone(),
            policy: session.document.clone(),
            arn: session.arn.clone(),
            expires_ms: u64::try_from(expires).unwrap_or(u64::MAX),
        };
        let kept =
            serde_json::to_vec(&kept).map_err(|error| Unavailable::Failed(error.to_string().into()))?;
        let key = access_key.as_bytes().to_vec();
        let change = self.storage.change(Kind::Grows, move |batch| {
            let mut over = Vec::new();
            for row in batch.from(Table::Sessions, b"")? {
                let (key, kept) = row?;
                if read(&kept).is_none_or(|session| session.is_over(now)) {
                    over.push(key);
                }
            }
            for key in over {
                batch.remove(Table::Sessions, &key)?;
            }
            batch.put(Table::Sessions, &key, &kept)
        });
        change.await?;
        let mut by_key = self.by_key.write().unwrap_or_else(PoisonError::into_inner);
        by_key.retain(|_, session| !session.is_over(now));
        by_key.insert(access_key.to_owned(), Arc::new(session));
        Ok(())
    }
}

/// Reads a session. One that this version cannot read, for example because of its policy, has no rights.
fn read(kept: &[u8]) -> Option<Session> {
    let kept: Kept = serde_json::from_slice(kept).ok()?;
    let expires = UNIX_EPOCH.checked_add(Duration::from_millis(kept.expires_ms))?;
    Session::new(kept.secret_key, kept.token, &kept.policy, kept.arn, expires).ok()
}

#[cfg(test)]
impl Session {
    pub(crate) fn example(name: &str, expires: SystemTime) -> Self {
        let policy = r#"{"Version":"2012-10-17","Statement":{"Effect":"Allow","Action":"*","Resource":"*"}}"#;
        let arn = format!("arn:aws:sts::000000000000:assumed-role/role/{name}");
        Self::new(format!("secret of {name}"), format!("token of {name}"), policy, arn, expires).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_very_token_is_a_sessions() {
        let session = Session::example("abc", UNIX_EPOCH);
        assert!(session.has_token("token of abc"));
        // One letter differs, two differ in the same bit, the end is missing, something follows,
        // and the case differs.
        for other in ["token of abd", "token of `cc", "token of ab", "", "token of abc ", "TOKEN OF ABC"] {
            assert!(!session.has_token(other), "{other}");
        }
    }

    #[test]
    fn a_session_is_shown_without_its_secrets() {
        let shown = format!("{:?}", Session::example("abc", UNIX_EPOCH));
        assert!(shown.contains("assumed-role/role/abc"), "{shown}");
        assert!(!shown.contains("secret of") && !shown.contains("token of"), "{shown}");
    }

    #[tokio::test]
    async fn sessions_survive_until_they_are_over_and_are_then_forgotten() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let now = UNIX_EPOCH + Duration::from_secs(1_000_000);
        let after = |seconds| now + Duration::from_secs(seconds);
        let sessions = Sessions::open(storage, now).unwrap();
        sessions.add("short", Session::example("short", after(10)), now).await.unwrap();
        sessions.add("long", Session::example("long", after(20)), now).await.unwrap();
        drop(sessions);
        writing.end();

        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let again = Sessions::open(storage.clone(), after(9)).unwrap();
        let (short, long) = (again.get("short").unwrap(), again.get("long").unwrap());
        assert!(long.has_token("token of long") && !long.has_token("token of short"));
        assert_eq!((short.secret_key.as_str(), short.expires), ("secret of short", after(10)));
        assert_eq!(short.policy, long.policy);

        let last = Sessions::open(storage.clone(), after(10)).unwrap();
        assert!(last.get("short").is_none() && last.get("long").is_some());
        last.add("new", Session::example("new", after(30)), after(10)).await.unwrap();
        let snapshot = storage.snapshot().unwrap();
        let keys: Vec<Vec<u8>> =
            snapshot.from(Table::Sessions, b"").unwrap().map(|row| row.unwrap().0).collect();
        assert_eq!(keys, [&b"long"[..], b"new"]);
        drop((again, last, storage));
        writing.end();
    }
}
