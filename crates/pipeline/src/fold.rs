//! The fold: an invocation that has put a result sees to it that the manifest shows it, and claims for the revision
//! that it commits.
//!
//! 1. Read the manifest, of a large one the beginning; leave if it covers the fact and is someone else's.
//! 2. Pause, the longer the more frames are to come, and look again, until a pause has passed in which no one wrote: with
//!    many finishers one listing serves all. A large animation's listing is many requests, so of those who have seen no one
//!    write few list, by lot; the others pause anew, and are the likelier to list the longer that goes on (`chance`).
//! 3. List, reconcile, and where the manifest differs put it on the condition that it is still the one that was read.
//! 4. **List again**, and commit again until a listing agrees with what was committed: the first listing may be older
//!    than a quick change and change back.
//!    Where there is neither a manifest nor anything uploaded, nothing is put: an animation that was removed stays so.
//! 5. If nothing is left to come, put the claim of that revision, whose name is new because only its writer claims.
//!
//! A manifest covers a fact if it shows it, or if it is at least the second revision after one that was read when the
//! fact held already: each revision is put on the condition that its predecessor is still there, and its listing starts
//! after the predecessor was read. So the listing of the second one started after the first was put, hence after the
//! fact; it has seen the fact, or what came later.
//!
//! Invariant: whoever finds its own commit, as after a crash or a lost answer, still owes the claim and does not leave.

use crate::invocation::{Glimpse, Invocation, Known, Mutation};
use crate::keys::{Animation, Key};
use crate::manifest::{Fact, Gif, Head, Manifest};
use crate::store::{ETag, PAGE, PutOptions, Store};
use crate::{Clock, Error, Result, invariants};

/// How a fold ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Folded {
    /// Nothing has come that a manifest shows: it was not looked at.
    Untouched,
    /// The manifest, someone else's, showed the fact: nothing was listed.
    Covered,
    /// The manifest agreed with the listing.
    Agreed,
    /// This invocation's revision is the manifest, and frames are still to come.
    Committed,
    /// This invocation's revision is the manifest, and its claim is put.
    Claimed,
}

/// How often an invocation commits, one listing after the other, before it lets others do so.
const MOST_COMMITS: u32 = 16;

/// How much likelier whoever has seen no one write lists after each further pause.
const LIKELIER: u64 = 4;

/// Of how many frames on one in one more lists: a quarter of a listing's page.
const FRAMES_A_LOT: u64 = PAGE as u64 / 4;

/// One in how many lists, of those who have seen no one write in `quiet` pauses before this one: of a small animation
/// everyone; of a large one at first one in four times as many as its listing has pages, or as frames are to come.
fn chance(head: Option<&Head>, quiet: u32) -> u64 {
    let Some(head) = head else { return 1 };
    let lots = head.total / FRAMES_A_LOT;
    lots.min(head.missing()).checked_div(LIKELIER.saturating_pow(quiet)).unwrap_or(0).max(1)
}

/// How long a fact has held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Age {
    /// This invocation has just put what makes it hold: hardly anyone can have listed it.
    New,
    /// For a while, perhaps.
    Old,
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Sees to it that the manifest shows `fact`. What an invocation does after it depends on nothing from before it.
    pub(crate) async fn fold(&self, animation: &Animation, fact: &Fact, age: Age) -> Result<Folded> {
        self.goes_on_with(&(animation, fact, age));
        let glimpse = self.glimpse(animation).await?;
        self.fold_from(animation, fact, age, glimpse).await
    }

    /// The same from a look at the manifest that was taken when the fact held already.
    pub(crate) async fn fold_from(
        &self,
        animation: &Animation,
        fact: &Fact,
        age: Age,
        mut glimpse: Glimpse,
    ) -> Result<Folded> {
        let first = glimpse.revision();
        // Of a large manifest that would be one more request, mostly in vain.
        let is_worth_it = age == Age::Old || !matches!(glimpse, Glimpse::Start { .. });
        if is_worth_it && self.may_leave(&glimpse) && self.shows(animation, &glimpse, fact).await? {
            return Ok(Folded::Covered);
        }
        let mut quiet = 0;
        loop {
            self.goes_on_with(&(animation, fact, first, quiet, &glimpse));
            let before = glimpse.revision();
            self.pause(glimpse.head()).await;
            glimpse = self.glimpse(animation).await?;
            if glimpse.revision() != before && self.may_leave(&glimpse) {
                if self.is_covered(animation, &glimpse, fact, first).await? {
                    return Ok(Folded::Covered);
                }
                // Whoever wrote this lists once more, and will see what it has missed.
                quiet = 0;
                continue;
            }
            let chance = chance(glimpse.head(), quiet);
            if chance > 1 && !self.random.one_in(chance) {
                quiet += 1;
                continue;
            }
            let mut known = match glimpse {
                Glimpse::Nothing => None,
                Glimpse::Unreadable(known) | Glimpse::Whole(known) => Some(known),
                Glimpse::Start { .. } => self.manifest(animation).await?,
            };
            self.goes_on_with(&(animation, fact, first, quiet, &known));
            if let Some(folded) = self.commit_until_agreed(animation, &mut known).await? {
                return Ok(folded);
            }
            glimpse = known.into();
        }
    }

    /// Whether whoever wrote the manifest will see to its claim: this invocation and earlier attempts at its event have
    /// not, or it would not be here.
    fn may_leave(&self, glimpse: &Glimpse) -> bool {
        glimpse.head().is_some_and(|head| !self.is_own(head) || self.breaks(Mutation::LeaveOwnCommit))
    }

    /// Whether the manifest shows the fact, or follows late enough on the revision that was read when it held.
    async fn is_covered(
        &self,
        animation: &Animation,
        glimpse: &Glimpse,
        fact: &Fact,
        first: u64,
    ) -> Result<bool> {
        if *fact != Fact::Fold && glimpse.revision() >= first + 2 {
            return Ok(true);
        }
        self.shows(animation, glimpse, fact).await
    }

    /// Lists and commits until a listing agrees; `None` when someone else's commit came first, or when frames come as fast as
    /// they are written down and it is others' turn to do that.
    async fn commit_until_agreed(
        &self,
        animation: &Animation,
        known: &mut Option<Known>,
    ) -> Result<Option<Folded>> {
        for _ in 0..MOST_COMMITS {
            let observation = self.observe(animation, known.as_ref()).await?;
            if known.is_none() && observation.is_of_nothing() {
                return Ok(Some(Folded::Agreed));
            }
            let observed = observation.manifest;
            if let Some(known) = known.as_ref().filter(|known| known.manifest.agrees_with(&observed)) {
                return self.end(known).await.map(Some);
            }
            if self.breaks(Mutation::ClaimBeforeCommit) && observed.head.is_terminal() {
                self.claim(&observed).await?;
            }
            match self.commit(animation, known.as_ref(), observed).await? {
                Some(committed) if self.breaks(Mutation::SkipSecondListing) => {
                    return self.end(&committed).await.map(Some);
                }
                Some(committed) => *known = Some(committed),
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Claims for what this invocation has committed, if nothing is left to come.
    async fn end(&self, known: &Known) -> Result<Folded> {
        if !self.is_own(&known.manifest.head) {
            return Ok(Folded::Agreed);
        }
        let claimed_before = self.breaks(Mutation::ClaimBeforeCommit) || self.breaks(Mutation::NeverClaim);
        if !known.manifest.head.is_terminal() || claimed_before {
            return Ok(Folded::Committed);
        }
        self.claim(&known.manifest).await?;
        Ok(Folded::Claimed)
    }

    /// Puts the next revision; `None` when the manifest is no longer, or perhaps not, the one that was known.
    pub(crate) async fn commit(
        &self,
        animation: &Animation,
        known: Option<&Known>,
        mut next: Manifest,
    ) -> Result<Option<Known>> {
        let before = known.map(|known| &known.manifest);
        next.head.revision = before.map_or(0, |manifest| manifest.head.revision) + 1;
        next.head.writer = self.request_id().to_owned();
        next.head.removed_at = next.removed_at(before, self.clock.now());
        next.head.gif = before.and_then(|before| before.head.gif.clone());
        invariants::check(&next, before)?;
        let options = match known {
            _ if self.breaks(Mutation::DropIfMatch) => PutOptions::always(),
            None => PutOptions::if_absent(),
            Some(known) => PutOptions::if_match(known.etag.clone()),
        };
        let options = options.content_type("application/json");
        if let Some(Known { etag, unreadable: Some(body), .. }) = known {
            let key = Key::SetAside { animation: animation.clone(), version: etag.clone() };
            self.put_receipt(&key.to_string(), body.clone(), "application/octet-stream").await?;
        }
        self.put_manifest(next, options).await
    }

    /// Writes down which GIF is this generation's; `None` as of a commit. It is no revision: whatever else the manifest says
    /// was listed before it.
    pub(crate) async fn record_gif(&self, known: &Known, version: ETag) -> Result<Option<Known>> {
        if known.manifest.head.gif_version() == Some(&version) {
            return Ok(Some(known.clone()));
        }
        let mut next = known.manifest.clone();
        next.head.gif = Some(Gif { generation: next.head.generation.clone(), version });
        let options = PutOptions::if_match(known.etag.clone()).content_type("application/json");
        self.put_manifest(next, options).await
    }

    async fn put_manifest(&self, manifest: Manifest, options: PutOptions) -> Result<Option<Known>> {
        let (key, body) = (manifest.head.animation.manifest(), manifest.encode(self.policy.glimpse)?);
        match self.store.put(&key, body, options).await {
            Ok(etag) => Ok(Some(Known { manifest, etag, unreadable: None })),
            Err(error) if error.is_conflict() || error.is_retryable() || error.is_not_found() => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Wakes the assembler.
    pub(crate) async fn claim(&self, manifest: &Manifest) -> Result<()> {
        let head = &manifest.head;
        let key = Key::Claim {
            animation: head.animation.clone(),
            revision: head.revision,
            generation: head.generation.clone(),
        };
        let body = serde_json::json!({ "claimed_by": self.request_id() });
        self.put(&key.to_string(), body.to_string().into()).await.map(drop)
    }
}

/// Folds in any case: what a command does after it has changed results behind the functions' back.
///
/// # Errors
///
/// Those of the store, and [`Error::Malformed`] when an object of the pipeline's cannot be read.
pub async fn fold<S: Store, C: Clock>(
    invocation: &Invocation<'_, S, C>,
    animation: &Animation,
) -> Result<Folded, Error> {
    invocation.fold(animation, &Fact::Fold, Age::Old).await
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::Settings;
    use crate::reconcile::{Results, Scripts, reconcile};

    fn head(total: u64, pending: u64) -> Head {
        let animation = Animation::new("film").unwrap();
        let manifest = reconcile(&animation, &Scripts::default(), &Results::default(), &Settings::absent());
        Head { total, pending, ..manifest.head }
    }

    #[test]
    fn everyone_lists_what_is_small_and_few_what_is_large_until_nobody_writes() {
        let lots = |head: &Head| (0..7).map(|quiet| chance(Some(head), quiet)).collect::<Vec<_>>();
        assert_eq!(chance(None, 0), 1, "whoever finds no manifest lists");
        assert_eq!(lots(&head(499, 400)), [1; 7]);
        assert_eq!(lots(&head(100_000, 50_000)), [400, 100, 25, 6, 1, 1, 1]);
        // Those who could list, too, are no more than the frames to come: the last one never waits for others.
        assert_eq!(lots(&head(100_000, 20)), [20, 5, 1, 1, 1, 1, 1]);
        assert_eq!(lots(&head(100_000, 1)), [1; 7]);
        assert_eq!(lots(&head(100_000, 0)), [1; 7]);
    }
}
