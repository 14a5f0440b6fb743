//! At most one assembler an animation waits or builds at a time: an object that says which, and until when.
//!
//! The holder deletes it when there is nothing left to do, and then looks at the manifest and the GIF once more: whoever has
//! found the lease taken, and left, was woken for a manifest that was written before, and may have deleted the GIF before. A
//! holder that dies leaves it to the platform's next attempt at its event, which has the same request id, or for anyone to
//! take over once its time is up. A holder whose GIF is not finished in its time leaves it to whoever comes next, and says so
//! in it.

use std::time::Duration;

use bytes::Bytes;
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
    /// Whether an unfinished GIF is written down.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    checkpoint: bool,
}

/// The lease in the hands of an invocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Held {
    /// Whether an unfinished GIF is written down.
    pub(crate) has_checkpoint: bool,
}

/// What stands for the holder of a lease that was handed over and not yet taken.
const NOBODY: &str = "";

impl Lease {
    /// One that anyone may take, with the GIF that is written down.
    fn of_nobody() -> Self {
        Lease { assembler: NOBODY.to_owned(), until: Timestamp(0), checkpoint: true }
    }

    /// Whether its time is not up.
    fn stands(&self, now: Timestamp) -> bool {
        self.until > now && self.until <= now.after(LONGEST)
    }
}

fn encode(key: &str, lease: &Lease) -> Result<Bytes> {
    let body = serde_json::to_vec(lease)
        .map_err(|source| Error::Malformed { key: key.to_owned(), source: source.into() })?;
    Ok(body.into())
}

/// Whose lease it is; one that cannot be read is nobody's.
fn holder(body: &[u8]) -> Option<Lease> {
    serde_json::from_slice(body).ok()
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Takes the animation's lease, if no other invocation has it.
    ///
    /// # Errors
    ///
    /// Those of the store, and [`Error::Conflict`] for a lease that comes and goes.
    pub(crate) async fn take_lease(&self, animation: &Animation) -> Result<Option<Held>> {
        let key = Key::Lease { animation: animation.clone() }.to_string();
        for _ in 0..ATTEMPTS {
            let body = encode(&key, &self.own_lease(Held::default()))?;
            if self.put_receipt(&key, body, "application/json").await?.is_some() {
                return Ok(Some(Held::default()));
            }
            let Some(there) = self.get(&key).await? else { continue };
            let holder = holder(&there.body);
            let is_own = self.is_held(holder.as_ref());
            let held = Held { has_checkpoint: holder.as_ref().is_some_and(|holder| holder.checkpoint) };
            if holder.is_some_and(|holder| !is_own && holder.stands(self.clock.now())) {
                return Ok(None);
            }
            // An own one need not be renewed.
            if self.replace_lease(&key, &self.own_lease(held), there.info.etag).await? || is_own {
                return Ok(Some(held));
            }
        }
        Err(Error::Conflict { key })
    }

    fn own_lease(&self, held: Held) -> Lease {
        let until = self.deadline.unwrap_or_else(|| self.clock.now().after(self.policy.stuck_after));
        Lease { assembler: self.request_id().to_owned(), until, checkpoint: held.has_checkpoint }
    }

    /// Whether it is this event's, perhaps from an earlier attempt at it.
    fn is_held(&self, holder: Option<&Lease>) -> bool {
        holder.is_some_and(|holder| holder.assembler == self.request_id())
    }

    /// Whether another invocation holds the lease. It looks at the manifest once more when it has given it back, so whoever
    /// is woken for a manifest that was written before need not look.
    pub(crate) async fn is_held_by_another(&self, animation: &Animation) -> Result<bool> {
        let there = self.get(&Key::Lease { animation: animation.clone() }.to_string()).await?;
        let holder = there.and_then(|there| holder(&there.body));
        Ok(holder.is_some_and(|holder| !self.is_held(Some(&holder)) && holder.stands(self.clock.now())))
    }

    /// Frees the lease of an event that the platform has given up.
    pub(crate) async fn free_lease_of(&self, animation: &Animation, request_id: &str) -> Result<()> {
        self.free_lease(animation, |holder| holder.assembler == request_id).await
    }

    /// Frees the lease of whoever began before this invocation, to which the platform gives as much time.
    pub(crate) async fn free_lease_from_before(&self, animation: &Animation) -> Result<()> {
        let own = self.own_lease(Held::default());
        self.free_lease(animation, |holder| holder.until < own.until).await
    }

    /// Leaves the lease of a dead holder to whoever comes next, with what it has written down.
    async fn free_lease(&self, animation: &Animation, is_dead: impl Fn(&Lease) -> bool) -> Result<()> {
        let key = Key::Lease { animation: animation.clone() }.to_string();
        let Some(there) = self.get(&key).await? else { return Ok(()) };
        let Some(holder) = holder(&there.body) else { return Ok(()) };
        if holder.assembler != NOBODY && is_dead(&holder) {
            let free = Lease { checkpoint: holder.checkpoint, ..Lease::of_nobody() };
            // If that fails, the lease is another's by now, or stands until its time is up.
            self.replace_lease(&key, &free, there.info.etag).await?;
        }
        Ok(())
    }

    async fn replace_lease(&self, key: &str, lease: &Lease, etag: ETag) -> Result<bool> {
        let options = PutOptions::if_match(etag).content_type("application/json");
        match self.store.put(key, encode(key, lease)?, options).await {
            Ok(_) => Ok(true),
            Err(error) if error.is_conflict() || error.is_not_found() || error.is_retryable() => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Takes the lease of an earlier attempt at this event, or one that was handed over and not taken.
    pub(crate) async fn take_left_lease(&self, animation: &Animation) -> Result<Option<Held>> {
        let key = Key::Lease { animation: animation.clone() }.to_string();
        // Again where the answer was lost: it may be ours by then.
        for _ in 0..ATTEMPTS {
            let Some(there) = self.get(&key).await? else { return Ok(None) };
            let Some(holder) = holder(&there.body) else { return Ok(None) };
            let held = Held { has_checkpoint: holder.checkpoint };
            if self.is_held(Some(&holder)) {
                return Ok(Some(held));
            }
            if holder.assembler != NOBODY {
                return Ok(None);
            }
            if self.replace_lease(&key, &self.own_lease(held), there.info.etag).await? {
                return Ok(Some(held));
            }
        }
        Err(Error::Conflict { key })
    }

    /// Leaves the lease to whoever comes next, with the GIF that is written down.
    ///
    /// # Errors
    ///
    /// Those of the store, and [`Error::Conflict`] for a lease that comes and goes.
    pub(crate) async fn hand_over_lease(&self, animation: &Animation, held: &Held) -> Result<()> {
        if !held.has_checkpoint {
            return self.release_lease(animation).await;
        }
        let key = Key::Lease { animation: animation.clone() }.to_string();
        for _ in 0..ATTEMPTS {
            let there = self.get(&key).await?;
            let Some(there) = there.filter(|there| self.is_held(holder(&there.body).as_ref())) else {
                // Taken over already, by somebody for whom its time was up.
                return Ok(());
            };
            if self.replace_lease(&key, &Lease::of_nobody(), there.info.etag).await? {
                return Ok(());
            }
        }
        Err(Error::Conflict { key })
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

    async fn with<T>(
        store: &MemoryStore<SystemClock>,
        request_id: &str,
        step: impl AsyncFnOnce(&Invocation<'_, MemoryStore<SystemClock>, SystemClock>, &Animation) -> Result<T>,
    ) -> T {
        let (random, policy) = (Randomness::seeded(1), Policy::new(1));
        let deadline = SystemClock.now().after(Duration::from_secs(900));
        let invocation = Invocation::new(store, &SystemClock, &random, &policy, request_id).until(deadline);
        step(&invocation, &Animation::new("film").unwrap()).await.unwrap()
    }

    async fn held(store: &MemoryStore<SystemClock>, request_id: &str) -> Option<Held> {
        with(store, request_id, async |invocation, animation| invocation.take_lease(animation).await).await
    }

    async fn takes(store: &MemoryStore<SystemClock>, request_id: &str) -> bool {
        held(store, request_id).await.is_some()
    }

    async fn left(store: &MemoryStore<SystemClock>, request_id: &str) -> Option<Held> {
        with(store, request_id, async |invocation, animation| invocation.take_left_lease(animation).await)
            .await
    }

    async fn hands_over(store: &MemoryStore<SystemClock>, request_id: &str, has_checkpoint: bool) {
        let held = Held { has_checkpoint };
        with(store, request_id, async |invocation, animation| {
            invocation.hand_over_lease(animation, &held).await
        })
        .await;
    }

    async fn says(store: &MemoryStore<SystemClock>, body: &str) {
        let body = body.to_owned().into();
        store.put("frames/film/@assembler.json", body, PutOptions::always()).await.unwrap();
    }

    #[test]
    fn a_lease_stands_to_the_moment_and_for_no_longer_than_an_invocation_may_run() {
        let now = Timestamp(1_000_000);
        let stands = |until: u64| {
            Lease { assembler: "a".to_owned(), until: Timestamp(until), checkpoint: false }.stands(now)
        };
        assert!(!stands(0) && !stands(1_000_000) && stands(1_000_001));
        assert!(stands(1_000_000 + 20 * 60_000) && !stands(1_000_001 + 20 * 60_000));
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

    /// Whoever takes the lease over knows of the unfinished GIF, also when its holder has died.
    #[tokio::test]
    async fn a_lease_that_is_handed_over_tells_of_what_is_unfinished() {
        let store = MemoryStore::new(SystemClock);
        let (with, without) = (Some(Held { has_checkpoint: true }), Some(Held { has_checkpoint: false }));
        assert_eq!(held(&store, "a").await, without);
        hands_over(&store, "a", true).await;
        assert_eq!(held(&store, "b").await, with);
        assert_eq!(held(&store, "a").await, None, "b holds it");
        assert_eq!(held(&store, "b").await, with, "the next attempt at b");
        hands_over(&store, "a", true).await;
        assert_eq!(held(&store, "a").await, None, "a had nothing to hand over");
        hands_over(&store, "b", false).await;
        assert_eq!(held(&store, "a").await, without);
    }

    #[tokio::test]
    async fn a_lease_of_nobody_is_taken_by_who_has_nothing_to_build() {
        let store = MemoryStore::new(SystemClock);
        assert_eq!(left(&store, "a").await, None);
        assert!(takes(&store, "a").await);
        assert_eq!(left(&store, "b").await, None, "a holds it");
        assert_eq!(left(&store, "a").await, Some(Held::default()));
        hands_over(&store, "a", true).await;
        assert_eq!(left(&store, "b").await, Some(Held { has_checkpoint: true }));
        assert_eq!(left(&store, "a").await, None, "b has taken it");
    }
}
