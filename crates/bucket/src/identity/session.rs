//! Sessions: made once, looked up at each request, kept in the database for the next start.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition};
use serde::{Deserialize, Serialize};

use crate::policy::Policy;

/// From the access key to the session as JSON.
const TABLE: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("sessions");

/// What `AssumeRole` gave, and to whom.
pub(crate) struct Session {
    pub(crate) secret_key: String,
    pub(crate) token: String,
    pub(crate) policy: Policy,
    /// `arn:aws:sts::000000000000:assumed-role/role/session`
    pub(crate) arn: String,
    pub(crate) expires: SystemTime,
    /// The policy as it came.
    document: String,
}

impl Session {
    /// # Errors
    /// What is wrong with the policy.
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

    /// In a time that does not tell how much of it is right.
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

/// A session in the database.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept {
    secret_key: String,
    token: String,
    policy: String,
    arn: String,
    /// Milliseconds since 1970.
    expires_ms: u64,
}

/// All sessions that are not over.
pub(crate) struct Sessions {
    database: Arc<Database>,
    by_key: RwLock<BTreeMap<String, Arc<Session>>>,
}

impl Sessions {
    /// Those of the earlier runs that are not over yet; the others are forgotten.
    ///
    /// # Errors
    /// When the database cannot be read or written.
    pub(crate) fn open(database: Arc<Database>, now: SystemTime) -> Result<Self, redb::Error> {
        let mut by_key = BTreeMap::new();
        let reading = database.begin_read()?;
        match reading.open_table(TABLE) {
            Ok(table) => {
                for entry in table.iter()? {
                    let (key, kept) = entry?;
                    if let Some(session) = read(kept.value()) {
                        by_key.insert(key.value().to_owned(), Arc::new(session));
                    }
                }
            }
            Err(redb::TableError::TableDoesNotExist(_)) => {}
            Err(error) => return Err(error.into()),
        }
        by_key.retain(|_, session| !session.is_over(now));
        Ok(Self { database, by_key: RwLock::new(by_key) })
    }

    pub(crate) fn get(&self, access_key: &str) -> Option<Arc<Session>> {
        self.by_key.read().unwrap_or_else(PoisonError::into_inner).get(access_key).cloned()
    }

    /// Keeps a session, which is known from when this returns, also after a crash. Blocks on the disk.
    ///
    /// # Errors
    /// When the database cannot be written.
    pub(crate) fn add(&self, access_key: &str, session: Session, now: SystemTime) -> Result<(), redb::Error> {
        let expires = session.expires.duration_since(UNIX_EPOCH).unwrap_or_default().as_millis();
        let kept = Kept {
            secret_key: session.secret_key.clone(),
            token: session.token.clone(),
            policy: session.document.clone(),
            arn: session.arn.clone(),
            expires_ms: u64::try_from(expires).unwrap_or(u64::MAX),
        };
        let kept = serde_json::to_vec(&kept).map_err(std::io::Error::from)?;
        let writing = self.database.begin_write()?;
        {
            let mut table = writing.open_table(TABLE)?;
            table.retain(|_, kept| read(kept).is_some_and(|session| !session.is_over(now)))?;
            table.insert(access_key, kept.as_slice())?;
        }
        writing.commit()?;
        let mut by_key = self.by_key.write().unwrap_or_else(PoisonError::into_inner);
        by_key.retain(|_, session| !session.is_over(now));
        by_key.insert(access_key.to_owned(), Arc::new(session));
        Ok(())
    }
}

/// One that this version cannot read, for its policy say, allows nothing.
fn read(kept: &[u8]) -> Option<Session> {
    let kept: Kept = serde_json::from_slice(kept).ok()?;
    let expires = UNIX_EPOCH.checked_add(Duration::from_millis(kept.expires_ms))?;
    Session::new(kept.secret_key, kept.token, &kept.policy, kept.arn, expires).ok()
}

#[cfg(test)]
pub(crate) fn in_memory() -> Database {
    Database::builder().create_with_backend(redb::backends::InMemoryBackend::new()).unwrap()
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
    fn sessions_survive_until_they_are_over_and_are_then_forgotten() {
        let database = Arc::new(in_memory());
        let now = UNIX_EPOCH + Duration::from_secs(1_000_000);
        let after = |seconds| now + Duration::from_secs(seconds);
        let sessions = Sessions::open(database.clone(), now).unwrap();
        sessions.add("short", Session::example("short", after(10)), now).unwrap();
        sessions.add("long", Session::example("long", after(20)), now).unwrap();
        drop(sessions);

        let again = Sessions::open(database.clone(), after(9)).unwrap();
        let (short, long) = (again.get("short").unwrap(), again.get("long").unwrap());
        assert!(long.has_token("token of long") && !long.has_token("token of short"));
        assert_eq!((short.secret_key.as_str(), short.expires), ("secret of short", after(10)));
        assert_eq!(short.policy, long.policy);
        drop(again);

        let last = Sessions::open(database.clone(), after(10)).unwrap();
        assert!(last.get("short").is_none() && last.get("long").is_some());
        last.add("new", Session::example("new", after(30)), after(10)).unwrap();
        let reading = database.begin_read().unwrap();
        let keys: Vec<String> = reading
            .open_table(TABLE)
            .unwrap()
            .iter()
            .unwrap()
            .map(|entry| entry.unwrap().0.value().to_owned())
            .collect();
        assert_eq!(keys, ["long", "new"]);
    }
}
