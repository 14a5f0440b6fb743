//! At most one assembler per animation waits or builds at a time. An object, the lease, names it, and the time until
//! which it holds the lease.
//!
//! The holder deletes the lease when there is nothing left to do, and then reads the manifest and the GIF once more. An
//! invocation that found the lease taken, and stopped, was invoked for an earlier manifest, and may have deleted the
//! GIF before. If a holder dies, the platform's next attempt at its event, which has the same request id, takes the
//! lease. After the lease has expired, any invocation may take it. A holder that does not finish its GIF in its time
//! hands the lease over to the next invocation, and records that in the lease.

use std::time::Duration;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::invocation::Invocation;
use crate::keys::{Animation, Key};
use crate::store::{ETag, PutOptions, Store};
use crate::{Clock, Error, Result, Timestamp};

/// The number of attempts to take a lease that is released and taken again meanwhile.
const ATTEMPTS: u32 = 3;

/// The maximum time until a lease can expire: Lambda's 15 minutes, and a few minutes for clocks that disagree. A lease
/// with more time left was written by a clock that was ahead, and would make others wait that long.
const LONGEST: Duration = Duration::from_secs(20 * 60);

/// The largest difference between two clocks.
const SLACK: Duration = Duration::from_secs(2 * 60);

/// The content of the lease object.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Lease {
    /// The holder's request id.
    assembler: String,
    /// The time at which the platform has ended the holder at the latest.
    until: Timestamp,
    /// Whether there is a checkpoint of an unfinished GIF.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    checkpoint: bool,
}

/// The owner of the lease for the sweep that deletes results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SweepLease {
    /// The lease is another sweep's.
    Anothers,
    /// This sweep. There was no lease before.
    New,
    /// This sweep, after a dead sweep (perhaps an earlier attempt at this one) that held the lease since this time.
    Left(Timestamp),
}

/// A lease that this invocation holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct HeldLease {
    /// Whether there is a checkpoint of an unfinished GIF.
    pub(crate) has_checkpoint: bool,
}

/// The `assembler` of a lease that was handed over and not yet taken.
const NOBODY: &str = "";

/// The outcome of an attempt to take a lease.
enum Taken {
    /// Another invocation holds it.
    Anothers,
    /// There was no lease.
    New,
    /// A dead holder or an earlier attempt at this event left the lease. Holds its content, and the time since which it
    /// was held.
    Left(Option<Lease>, Timestamp),
}

impl Lease {
    /// Returns a lease that any invocation may take, with a checkpoint of the GIF.
    fn of_nobody() -> Self {
        Lease { assembler: NOBODY.to_owned(), until: Timestamp(0), checkpoint: true }
    }

    /// Returns whether the lease has not expired.
    fn stands(&self, now: Timestamp) -> bool {
        self.until > now && self.until <= now.after(LONGEST)
    }
}

fn encode(key: &str, lease: &Lease) -> Result<Bytes> {
    let body = serde_json::to_vec(lease)
        .map_err(|source| Error::Malformed { key: key.to_owned(), source: source.into() })?;
    Ok(body.into())
}

/// Decodes a lease. An unreadable lease counts as one without holder.
fn holder(body: &[u8]) -> Option<Lease> {
    serde_json::from_slice(body).ok()
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Takes the animation's lease if no other invocation holds it.
    ///
    /// # Errors
    ///
    /// The errors of the store, and [`Error::Conflict`] for a lease that is released and taken again and again.
    pub(crate) async fn take_lease(&self, animation: &Animation) -> Result<Option<HeldLease>> {
        let key = Key::Lease { animation: animation.clone() };
        Ok(match self.take(&key, |holder| holder.stands(self.clock.now())).await? {
            Taken::Anothers => None,
            Taken::New => Some(HeldLease::default()),
            Taken::Left(holder, _) => {
                Some(HeldLease { has_checkpoint: holder.is_some_and(|holder| holder.checkpoint) })
            }
        })
    }

    async fn take(&self, key: &Key, stands: impl Fn(&Lease) -> bool) -> Result<Taken> {
        let key = key.to_string();
        for _ in 0..ATTEMPTS {
            let body = encode(&key, &self.own_lease(HeldLease::default()))?;
            if self.put_receipt(&key, body, "application/json").await?.is_some() {
                return Ok(Taken::New);
            }
            let Some(there) = self.get(&key).await? else { continue };
            let holder = holder(&there.body);
            let is_own = self.is_held(holder.as_ref());
            if holder.as_ref().is_some_and(|holder| !is_own && stands(holder)) {
                return Ok(Taken::Anothers);
            }
            let held = HeldLease { has_checkpoint: holder.as_ref().is_some_and(|holder| holder.checkpoint) };
            // A lease of its own need not be renewed.
            if self.replace_lease(&key, &self.own_lease(held), there.info.etag).await? || is_own {
                return Ok(Taken::Left(holder, there.info.modified));
            }
        }
        Err(Error::Conflict { key })
    }

    /// Takes the lease for the sweep that deletes results. If a dead sweep held it, returns the time since when.
    ///
    /// # Errors
    ///
    /// The errors of [`Invocation::take_lease`].
    pub(crate) async fn take_sweep_lease(&self, animation: &Animation) -> Result<SweepLease> {
        let key = Key::SweepLease { animation: animation.clone() };
        // The holder does not check that it still has the lease, so the lease stays another's for a while after it has
        // expired.
        let stands = |holder: &Lease| {
            let until = holder.until.after(SLACK);
            !self.policy.is_fresh_start && Lease { until, ..holder.clone() }.stands(self.clock.now())
        };
        Ok(match self.take(&key, stands).await? {
            Taken::Anothers => SweepLease::Anothers,
            Taken::New => SweepLease::New,
            Taken::Left(_, since) => SweepLease::Left(since),
        })
    }

    /// Releases the lease for the sweep.
    pub(crate) async fn release_sweep_lease(&self, animation: &Animation) -> Result<()> {
        self.delete(&Key::SweepLease { animation: animation.clone() }.to_string()).await
    }

    fn own_lease(&self, held: HeldLease) -> Lease {
        let until = self.deadline.unwrap_or_else(|| self.clock.now().after(self.policy.stuck_after));
        Lease { assembler: self.request_id().to_owned(), until, checkpoint: held.has_checkpoint }
    }

    /// Returns whether this event holds the lease, perhaps through an earlier attempt.
    fn is_held(&self, holder: Option<&Lease>) -> bool {
        holder.is_some_and(|holder| holder.assembler == self.request_id())
    }

    /// Returns whether another invocation holds the lease. The holder reads the manifest again after it has released
    /// the lease, so an invocation that was invoked for an earlier manifest need not.
    pub(crate) async fn is_held_by_another(&self, animation: &Animation) -> Result<bool> {
        let there = self.get(&Key::Lease { animation: animation.clone() }.to_string()).await?;
        let holder = there.and_then(|there| holder(&there.body));
        Ok(holder.is_some_and(|holder| !self.is_held(Some(&holder)) && holder.stands(self.clock.now())))
    }

    /// Releases the lease of an event that the platform has given up.
    pub(crate) async fn free_lease_of(&self, animation: &Animation, request_id: &str) -> Result<()> {
        self.free_lease(animation, |holder| holder.assembler == request_id).await
    }

    /// Releases a lease that expires before a lease that is taken now. Its holder started earlier, and has the same
    /// time limit.
    pub(crate) async fn release_stale_lease(&self, animation: &Animation) -> Result<()> {
        let own = self.own_lease(HeldLease::default());
        self.free_lease(animation, |holder| holder.until < own.until).await
    }

    /// Leaves the lease of a dead holder to the next invocation, with its checkpoint.
    async fn free_lease(&self, animation: &Animation, is_dead: impl Fn(&Lease) -> bool) -> Result<()> {
        let key = Key::Lease { animation: animation.clone() }.to_string();
        let Some(there) = self.get(&key).await? else { return Ok(()) };
        let Some(holder) = holder(&there.body) else { return Ok(()) };
        if holder.assembler != NOBODY && is_dead(&holder) {
            let free = Lease { checkpoint: holder.checkpoint, ..Lease::of_nobody() };
            // If this fails, another invocation has the lease by now, or it stays until it expires.
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
    pub(crate) async fn reclaim_lease(&self, animation: &Animation) -> Result<Option<HeldLease>> {
        let key = Key::Lease { animation: animation.clone() }.to_string();
        // Tried again after a lost answer: the lease may be this event's by then.
        for _ in 0..ATTEMPTS {
            let Some(there) = self.get(&key).await? else { return Ok(None) };
            let Some(holder) = holder(&there.body) else { return Ok(None) };
            let held = HeldLease { has_checkpoint: holder.checkpoint };
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

    /// Leaves the lease to the next invocation, with the checkpoint of the GIF.
    ///
    /// # Errors
    ///
    /// The errors of the store, and [`Error::Conflict`] for a lease that is released and taken again and again.
    pub(crate) async fn hand_over_lease(&self, animation: &Animation, held: &HeldLease) -> Result<()> {
        if !held.has_checkpoint {
            return self.release_lease(animation).await;
        }
        let key = Key::Lease { animation: animation.clone() }.to_string();
        for _ in 0..ATTEMPTS {
            let there = self.get(&key).await?;
            let Some(there) = there.filter(|there| self.is_held(holder(&there.body).as_ref())) else {
                // Another invocation has taken it over already, because it had expired.
                return Ok(());
            };
            if self.replace_lease(&key, &Lease::of_nobody(), there.info.etag).await? {
                return Ok(());
            }
        }
        Err(Error::Conflict { key })
    }

    /// Releases the animation's lease.
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

    async fn held(store: &MemoryStore<SystemClock>, request_id: &str) -> Option<HeldLease> {
        with(store, request_id, async |invocation, animation| invocation.take_lease(animation).await).await
    }

    async fn takes(store: &MemoryStore<SystemClock>, request_id: &str) -> bool {
        held(store, request_id).await.is_some()
    }

    async fn left(store: &MemoryStore<SystemClock>, request_id: &str) -> Option<HeldLease> {
        with(store, request_id, async |invocation, animation| invocation.reclaim_lease(animation).await).await
    }

    async fn hands_over(store: &MemoryStore<SystemClock>, request_id: &str, has_checkpoint: bool) {
        let held = HeldLease { has_checkpoint };
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

    /// The holder's clock was an hour ahead, and the holder died. For an hour no invocation would have built the GIF.
    #[tokio::test]
    async fn a_lease_of_a_clock_that_ran_ahead_holds_nobody_off() {
        let store = MemoryStore::new(SystemClock);
        let until = SystemClock.now().after(Duration::from_secs(3_600));
        says(&store, &format!(r#"{{"assembler":"a","until":{}}}"#, until.0)).await;
        assert!(takes(&store, "b").await && !takes(&store, "a").await);
    }

    /// An invocation that takes the lease over learns of the checkpoint, also when the holder has died.
    #[tokio::test]
    async fn a_lease_that_is_handed_over_tells_of_what_is_unfinished() {
        let store = MemoryStore::new(SystemClock);
        let (with, without) =
            (Some(HeldLease { has_checkpoint: true }), Some(HeldLease { has_checkpoint: false }));
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
        assert_eq!(left(&store, "a").await, Some(HeldLease::default()));
        hands_over(&store, "a", true).await;
        assert_eq!(left(&store, "b").await, Some(HeldLease { has_checkpoint: true }));
        assert_eq!(left(&store, "a").await, None, "b has taken it");
    }
}
