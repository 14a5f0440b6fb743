//! At most one assembler an animation waits or builds at a time: an object that says which, and until when.
//!
//! The holder deletes it when there is nothing left to do, and then looks at the manifest once more: whoever has found the
//! lease taken, and left, was woken for a manifest that was written before. A holder that dies leaves it to the platform's
//! next attempt at its event, which has the same request id, or for anyone to take over once its time is up.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::invocation::Invocation;
use crate::keys::{Animation, Key};
use crate::store::{ETag, PutOptions, Store};
use crate::{Clock, Error, Result, Timestamp};

/// How often a lease that comes and goes is asked for.
const ATTEMPTS: u32 = 3;

/// The longest time that a lease can still have: Lambda's 15 minutes, and clocks that disagree by a few. One that says more
/// was written by a clock that was wrong, and would hold others off for as long as that was ahead.
const LONGEST: Duration = Duration::from_secs(20 * 60);

/// What the object says.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Lease {
    /// The holder's request id.
    assembler: String,
    /// When the platform will have ended the holder.
    until: Timestamp,
}

impl Lease {
    /// Whether its time is not up.
    fn stands(&self, now: Timestamp) -> bool {
        self.until > now && self.until <= now.after(LONGEST)
    }
}

/// Whose lease it is; one that cannot be read is nobody's.
fn holder(body: &[u8]) -> Option<Lease> {
    serde_json::from_slice(body).ok()
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Takes the animation's lease; says whether this invocation holds it. If not, another one does.
    ///
    /// # Errors
    ///
    /// Those of the store, and [`Error::Conflict`] for a lease that comes and goes.
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
            let holder = holder(&there.body);
            let is_own = holder.as_ref().is_some_and(|holder| holder.assembler == self.request_id());
            if holder.is_some_and(|holder| !is_own && holder.stands(self.clock.now())) {
                return Ok(false);
            }
            // An own one need not be renewed.
            if self.replace_lease(&key, body.clone(), there.info.etag).await? || is_own {
                return Ok(true);
            }
        }
        Err(Error::Conflict { key })
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
        let holder = there.and_then(|there| holder(&there.body));
        Ok(holder.is_some_and(|holder| holder.assembler == self.request_id()))
    }

    /// Gives the animation's lease back.
    pub(crate) async fn release_lease(&self, animation: &Animation) -> Result<()> {
        self.delete(&Key::Lease { animation: animation.clone() }.to_string()).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::MemoryStore;
    use crate::{Policy, Randomness, SystemClock};

    async fn takes(store: &MemoryStore<SystemClock>, request_id: &str) -> bool {
        let (random, policy) = (Randomness::seeded(1), Policy::new(1));
        let deadline = SystemClock.now().after(Duration::from_secs(900));
        let invocation = Invocation::new(store, &SystemClock, &random, &policy, request_id).until(deadline);
        invocation.take_lease(&Animation::new("film").unwrap()).await.unwrap()
    }

    async fn says(store: &MemoryStore<SystemClock>, body: &str) {
        let body = body.to_owned().into();
        store.put("frames/film/@assembler.json", body, PutOptions::always()).await.unwrap();
    }

    #[tokio::test]
    async fn a_lease_is_its_holders_until_its_time_is_up() {
        let store = MemoryStore::new(SystemClock);
        assert!(takes(&store, "a").await && !takes(&store, "b").await);
        assert!(takes(&store, "a").await, "by the next attempt at the same event");
        says(&store, r#"{"assembler":"a","until":1000}"#).await;
        assert!(takes(&store, "b").await && !takes(&store, "a").await);
        says(&store, "garbage").await;
        assert!(takes(&store, "a").await && !takes(&store, "b").await);
    }

    /// The holder's clock was an hour ahead, the holder died, and nobody would have built for an hour.
    #[tokio::test]
    async fn a_lease_of_a_clock_that_ran_ahead_holds_nobody_off() {
        let store = MemoryStore::new(SystemClock);
        let until = SystemClock.now().after(Duration::from_secs(3_600));
        says(&store, &format!(r#"{{"assembler":"a","until":{}}}"#, until.0)).await;
        assert!(takes(&store, "b").await && !takes(&store, "a").await);
    }
}
