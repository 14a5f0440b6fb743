//! The fold: an invocation that has put a result sees to it that the manifest shows it, and claims for the revision
//! that it commits.
//!
//! 1. Read the manifest, of a large one the beginning; leave if it covers the fact and is someone else's.
//! 2. Whoever has put a result takes a frame by lot that the manifest shows to come, and leaves if it still is: its script
//!    has that version, and there is no result. Whoever draws that one folds later (below).
//! 3. Pause a few times as long as a look at the manifest takes, and look again, until a pause has passed in which no one
//!    wrote: with many finishers at once one listing serves all.
//! 4. List, reconcile, and where the manifest differs put it on the condition that it is still the one that was read.
//! 5. Leave as in 2, or **list again**, and commit again until a listing agrees with what was committed: the first listing
//!    may be older than a quick change and change back.
//!    Where there is neither a manifest nor anything uploaded, nothing is put: an animation that was removed stays so.
//! 6. If nothing is left to come, put the claim of that revision, whose name is new because only its writer claims.
//!
//! Who leaves for a frame to come is covered: when that frame's result comes, or its script changes, the manifest does not
//! show that, whichever it is by then; so the invocation of that event lists, and then it sees both, or leaves for a frame
//! that is still to come after it. The last one finds none and lists. As most frames that a fresh manifest shows to come
//! are, few list; the older the manifest, the more do.
//!
//! A manifest covers a fact if it shows it, or if it is at least the second revision after one that was read when the
//! fact held already: each revision is put on the condition that its predecessor is still there, and its listing starts
//! after the predecessor was read. So the listing of the second one started after the first was put, hence after the
//! fact; it has seen the fact, or what came later.
//!
//! Invariant: whoever finds its own commit, as after a crash or a lost answer, still owes the claim, and leaves only for a
//! frame to come.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::Duration;

use futures_util::future::try_join;

use crate::invocation::{Glimpse, Invocation, Known, Mutation};
use crate::keys::{Animation, Key};
use crate::manifest::{Fact, Frame, FrameState, Gif, Manifest};
use crate::store::{ETag, PAGE, PutOptions, Store};
use crate::{Clock, Error, Result, invariants};

/// How a fold ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Folded {
    /// Nothing has come that a manifest shows: it was not looked at.
    Untouched,
    /// The manifest, someone else's, showed the fact: nothing was listed.
    Covered,
    /// Another frame is to come, and whoever draws it folds: nothing was listed.
    Awaited,
    /// The manifest agreed with the listing.
    Agreed,
    /// This invocation's revision is the manifest, and frames are still to come.
    Committed,
    /// This invocation's revision is the manifest, and its claim is put.
    Claimed,
}

/// How often an invocation commits, one listing after the other, before it lets others do so.
const MOST_COMMITS: u32 = 16;

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
        let start = self.clock.now();
        let glimpse = self.glimpse(animation).await?;
        self.fold_from(animation, fact, age, (glimpse, self.clock.now().since(start))).await
    }

    /// The same from a look at the manifest that was taken when the fact held already, and took so long.
    pub(crate) async fn fold_from(
        &self,
        animation: &Animation,
        fact: &Fact,
        age: Age,
        (mut glimpse, look): (Glimpse, Duration),
    ) -> Result<Folded> {
        let first = glimpse.revision();
        // Of a large manifest that would be one more request, mostly in vain.
        let is_worth_it = age == Age::Old || !matches!(glimpse, Glimpse::Start { .. });
        if is_worth_it && self.may_leave(&glimpse) && self.shows(animation, &glimpse, fact).await? {
            return Ok(Folded::Covered);
        }
        loop {
            self.goes_on_with(&(animation, fact, first, look, &glimpse));
            let is_due = self.is_due(&glimpse, fact);
            if !is_due
                && self.is_another_awaited(animation, fact, glimpse.revision(), glimpse.frames()).await?
            {
                return Ok(Folded::Awaited);
            }
            let before = glimpse.revision();
            self.goes_on_with(&(animation, fact, first, look, before));
            self.pause(look).await;
            glimpse = self.glimpse(animation).await?;
            if glimpse.revision() != before {
                if self.is_covered(animation, &glimpse, fact, first).await? {
                    return Ok(Folded::Covered);
                }
                continue;
            }
            let mut known = match glimpse {
                Glimpse::Nothing => None,
                Glimpse::Unreadable(known) | Glimpse::Whole(known) => Some(known),
                Glimpse::Start { .. } => self.manifest(animation).await?,
            };
            self.goes_on_with(&(animation, fact, first, look, &known));
            if let Some(folded) = self.commit_until_agreed(animation, fact, &mut known).await? {
                return Ok(folded);
            }
            self.goes_on_with(&(animation, fact, first, look));
            glimpse = self.glimpse(animation).await?;
            if self.is_covered(animation, &glimpse, fact, first).await? {
                return Ok(Folded::Covered);
            }
        }
    }

    /// Whether the manifest is to be written in any case: to show what is no frame's result, or because people have waited
    /// for long to see how far it is, the longer the dearer a listing is.
    fn is_due(&self, glimpse: &Glimpse, fact: &Fact) -> bool {
        let Some(head) = glimpse.head() else { return true };
        let pages = u32::try_from(head.total / PAGE as u64).unwrap_or(u32::MAX).saturating_add(1);
        let age = self.clock.now().since(glimpse.modified());
        head.is_terminal()
            || !matches!(fact, Fact::Drawn(..) | Fact::Faulty(..))
            || age >= self.policy.fresh.saturating_mul(pages)
    }

    /// Whether one of the frames, another than the fact's, is still to come: one that is taken by lot of those that the
    /// manifest shows pending.
    async fn is_another_awaited(
        &self,
        animation: &Animation,
        fact: &Fact,
        revision: u64,
        frames: &[Frame],
    ) -> Result<bool> {
        let is_other = |frame: &&Frame| {
            frame.state == FrameState::Pending && fact.subject() != Some((&frame.script, frame.part))
        };
        let others: Vec<&Frame> = frames.iter().filter(is_other).collect();
        let mut lot = DefaultHasher::new();
        (self.request_id(), revision).hash(&mut lot);
        let place =
            lot.finish().checked_rem(others.len() as u64).and_then(|place| usize::try_from(place).ok());
        let Some(frame) = place.and_then(|place| others.get(place)) else { return Ok(false) };
        if self.breaks(Mutation::LeaveForAnyFrame) {
            return Ok(true);
        }
        let key = animation.script(&frame.script);
        let result = self.has_result(animation, &frame.script, &frame.version, frame.part);
        let (script, has_result) = try_join(self.head(&key), result).await?;
        Ok(!has_result && script.is_some_and(|script| script.etag == frame.version))
    }

    /// Whether whoever wrote the manifest will see to its claim: this invocation and earlier attempts at its event have
    /// not, or it would not be here.
    fn may_leave(&self, glimpse: &Glimpse) -> bool {
        glimpse.head().is_some_and(|head| !self.is_own(head) || self.breaks(Mutation::LeaveOwnCommit))
    }

    /// Whether someone else's manifest shows the fact, or follows late enough on the revision that was read when it held.
    async fn is_covered(
        &self,
        animation: &Animation,
        glimpse: &Glimpse,
        fact: &Fact,
        first: u64,
    ) -> Result<bool> {
        if !self.may_leave(glimpse) {
            return Ok(false);
        }
        if *fact != Fact::Fold && glimpse.revision() >= first + 2 {
            return Ok(true);
        }
        // Of a large manifest the lines are one more request, in vain while most frames are to come.
        let is_worth_it = match glimpse {
            Glimpse::Start { beginning, .. } => beginning.head.done > beginning.head.pending,
            _ => true,
        };
        Ok(is_worth_it && self.shows(animation, glimpse, fact).await?)
    }

    /// Lists and commits until a listing agrees, or until whoever draws a frame to come will list; `None` when someone
    /// else's commit came first, or when frames come as fast as they are written down and it is others' turn to do that.
    async fn commit_until_agreed(
        &self,
        animation: &Animation,
        fact: &Fact,
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
                Some(committed) => {
                    let Manifest { head, frames } = &committed.manifest;
                    let may_leave = !head.is_terminal() && *fact != Fact::Fold;
                    if may_leave && self.is_another_awaited(animation, fact, head.revision, frames).await? {
                        return Ok(Some(Folded::Committed));
                    }
                    *known = Some(committed);
                }
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
            Ok(etag) => Ok(Some(Known { manifest, etag, modified: self.clock.now(), unreadable: None })),
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
