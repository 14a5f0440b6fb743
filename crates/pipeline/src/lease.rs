//! At most one assembler an animation waits or builds at a time: an object that says which, and until when.
//!
//! The holder deletes it when there is nothing left to do, and then looks at the manifest once more: whoever has found the
//! lease taken, and left, was woken for a manifest that was written before. A holder that dies leaves it to the platform's
//! next attempt at its event, which has the same request id, or for anyone to take over once its time is up.

use serde::{Deserialize, Serialize};

use crate::invocation::Invocation;
use crate::keys::{Animation, Key};
use crate::store::{ETag, PutOptions, Store};
use crate::{Clock, Error, Result, Timestamp};

/// How often a lease that comes and goes is asked for.
const ATTEMPTS: u32 = 3;

/// What the object says.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Lease {
    /// The holder's request id.
    assembler: String,
    /// When the platform will have ended the holder.
    until: Timestamp,
}

/// Whether somebody else may take a lease that says this.
fn may_be_taken(body: &[u8], request_id: &str, now: Timestamp) -> bool {
    // One that cannot be read is nobody's.
    let lease: Option<Lease> = serde_json::from_slice(body).ok();
    lease.is_none_or(|lease| lease.assembler == request_id || lease.until <= now)
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Takes the animation's lease; says whether this invocation holds it.
    pub(crate) async fn take_lease(&self, animation: &Animation) -> Result<bool> {
        let key = Key::Lease { animation: animation.clone() }.to_string();
        let until = self.deadline.unwrap_or_else(|| self.clock.now().after(self.policy.stuck_after));
        let lease = Lease { assembler: self.request_id().to_owned(), until };
        let body = serde_json::to_vec(&lease)
            .map_err(|source| Error::Malformed { key: key.clone(), source: source.into() })?;
        for _ in 0..ATTEMPTS {
            if self.put_receipt(&key, body.clone().into(), "application/json").await?.is_some() {
                return Ok(true);
            }
            let Some(there) = self.get(&key).await? else { continue };
            if !may_be_taken(&there.body, self.request_id(), self.clock.now()) {
                return Ok(false);
            }
            if there.body == body || self.replace_lease(&key, body.clone(), there.info.etag).await? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    async fn replace_lease(&self, key: &str, body: Vec<u8>, etag: ETag) -> Result<bool> {
        let options = PutOptions::if_match(etag).content_type("application/json");
        match self.store.put(key, body.into(), options).await {
            Ok(_) => Ok(true),
            Err(error) if error.is_conflict() || error.is_not_found() || error.is_retryable() => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Whether the animation's lease is this event's, perhaps from an earlier attempt at it.
    pub(crate) async fn holds_lease(&self, animation: &Animation) -> Result<bool> {
        let there = self.get(&Key::Lease { animation: animation.clone() }.to_string()).await?;
        let lease: Option<Lease> = there.and_then(|there| serde_json::from_slice(&there.body).ok());
        Ok(lease.is_some_and(|lease| lease.assembler == self.request_id()))
    }

    /// Gives the animation's lease back.
    pub(crate) async fn release_lease(&self, animation: &Animation) -> Result<()> {
        self.delete(&Key::Lease { animation: animation.clone() }.to_string()).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lease_is_its_holders_until_its_time_is_up() {
        let body = br#"{"assembler":"a","until":1000}"#;
        assert!(may_be_taken(body, "a", Timestamp(0)), "by the next attempt at the same event");
        assert!(!may_be_taken(body, "b", Timestamp(999)));
        assert!(may_be_taken(body, "b", Timestamp(1_000)));
        assert!(may_be_taken(b"garbage", "b", Timestamp(0)));
    }
}
