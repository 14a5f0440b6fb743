//! The fold: an invocation that has put a result commits manifests until one shows that result, and puts the claim
//! for the revision that it has committed.
//!
//! 1. Read the manifest, or the beginning of a large one. Stop if it covers the fact and another invocation wrote it.
//! 2. An invocation that has put a result selects at random a frame that the manifest shows as pending. It stops if
//!    that frame is still to come: its script has that version, and there is no result (`survey`). The invocation that
//!    draws that frame folds later (below).
//! 3. Pause for a few times as long as a read of the manifest takes, and read it again. Repeat this until no invocation
//!    has written it during a pause. So with many finishers at once, one listing serves all.
//! 4. List and reconcile. If the manifest differs, put it on the condition that the manifest is still the one that was
//!    read.
//! 5. Stop as in 2, or **list again**, and commit again until a listing agrees with the commit, because the first
//!    listing may be older than a quick change and change back. If there is neither a manifest nor an upload, nothing
//!    is put, so a removed animation stays removed.
//! 6. If no frame is to come, put the claim of that revision. Its name is new, because only the writer of a revision
//!    claims it.
//!
//! If an invocation stops for a frame to come, its own result is not lost. When that frame's result comes, or its
//! script changes, the manifest does not show that yet. So the invocation of that event lists and sees both results, or
//! it stops for a frame that comes even later. The last invocation finds no such frame and lists. Most frames that a
//! fresh manifest shows as pending are still to come, so few invocations list. The older the manifest, the more
//! invocations list.
//!
//! A manifest covers a fact if it shows the fact. It also does if it is at least the second revision after a revision
//! that was read when the fact already held. Each revision is put on the condition that its predecessor is still
//! current, and its listing starts after the predecessor was read. So the listing of the second revision started after
//! the first was put, hence after the fact.
//!
//! Invariant: an invocation that finds its own commit, as after a crash or a lost reply, must still put the claim. It
//! stops only for a frame to come.

use std::time::Duration;

use rayfold_scene::Container;

use crate::invocation::{Invocation, Known, ManifestPrefix, Mutation};
use crate::keys::{Animation, Key};
use crate::manifest::{Fact, Manifest};
use crate::observe::Observation;
use crate::store::{ETag, PAGE, PutOptions, Store};
use crate::survey::{Next, Page};
use crate::{Clock, Error, Result, invariants};

/// The outcome of a fold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Folded {
    /// The invocation changed nothing that a manifest shows, so it did not read the manifest.
    Untouched,
    /// The manifest, by another writer, showed the fact. Nothing was listed.
    Covered,
    /// Another frame is to come, and the invocation that draws it folds. Nothing was listed.
    Awaited,
    /// The manifest agreed with the listing.
    Agreed,
    /// This invocation's revision is the manifest, and frames are still to come.
    Committed,
    /// This invocation's revision is the manifest, and its claim is put.
    Claimed,
}

/// The largest number of commits of an invocation, one listing after the other, before it lets others commit.
const MAX_COMMITS: u32 = 16;

/// The age of a fact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Age {
    /// The invocation has just put the object that makes the fact true, so hardly any other listing can contain it.
    New,
    /// The fact may have held for a while.
    Old,
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Ensures that the manifest shows `fact`. The later steps of an invocation depend on nothing from before it.
    pub(crate) async fn fold(&self, animation: &Animation, fact: &Fact, age: Age) -> Result<Folded> {
        self.forget_history_before(&(animation, fact, age));
        let start = self.clock.now();
        let glimpse = self.read_prefix(animation).await?;
        self.fold_from(animation, fact, age, (glimpse, self.clock.now().since(start))).await
    }

    /// Folds as [`fold`](Self::fold) does, given a read of the manifest that was made when the fact already held, and
    /// the duration of that read.
    pub(crate) async fn fold_from(
        &self,
        animation: &Animation,
        fact: &Fact,
        age: Age,
        (mut glimpse, look): (ManifestPrefix, Duration),
    ) -> Result<Folded> {
        let first = glimpse.revision();
        // For a large manifest this would be one more request, mostly in vain.
        let is_worth_it = age == Age::Old || !matches!(glimpse, ManifestPrefix::Start { .. });
        if is_worth_it && self.may_leave(&glimpse) && self.shows(animation, &glimpse, fact).await? {
            return Ok(Folded::Covered);
        }
        let mut page: Option<Page> = None;
        loop {
            self.forget_history_before(&(animation, fact, first, look, &glimpse, &page));
            let listed = match self.survey(animation, fact, &glimpse, &mut page).await? {
                Next::Leave => return Ok(Folded::Awaited),
                Next::Write(observation) => Some(*observation),
                Next::Wait => None,
            };
            if listed.is_none() {
                let before = glimpse.revision();
                self.forget_history_before(&(animation, fact, first, look, before, &page));
                self.pause(look).await;
                glimpse = self.read_prefix(animation).await?;
                if glimpse.revision() != before {
                    if self.is_covered(animation, &glimpse, fact, first).await? {
                        return Ok(Folded::Covered);
                    }
                    page = page.map(Page::aged);
                    continue;
                }
            }
            let mut known = match glimpse {
                ManifestPrefix::Nothing => None,
                ManifestPrefix::Unreadable(known) | ManifestPrefix::Whole(known) => Some(known),
                ManifestPrefix::Start { .. } => self.manifest(animation).await?,
            };
            self.forget_history_before(&(animation, fact, first, look, &known, &listed, &page));
            if let Some(folded) = self.commit_until_agreed(animation, fact, &mut known, listed).await? {
                return Ok(folded);
            }
            page = page.map(Page::aged);
            self.forget_history_before(&(animation, fact, first, look, &page));
            glimpse = self.read_prefix(animation).await?;
            if self.is_covered(animation, &glimpse, fact, first).await? {
                return Ok(Folded::Covered);
            }
        }
    }

    /// Returns whether the manifest must be written in any case: to show a fact that is no frame's result, or because
    /// it has not shown progress for long. That time grows with the cost of a listing.
    pub(crate) fn is_due(&self, glimpse: &ManifestPrefix, fact: &Fact) -> bool {
        let Some(head) = glimpse.head() else { return true };
        let pages = u32::try_from(head.total / PAGE as u64).unwrap_or(u32::MAX).saturating_add(1);
        let age = self.clock.now().since(glimpse.modified());
        head.is_terminal()
            || !matches!(fact, Fact::Drawn(..) | Fact::Faulty(..))
            || age >= self.policy.fresh.saturating_mul(pages)
    }

    /// Returns whether the writer of the manifest will put its claim. Neither this invocation nor an earlier attempt at
    /// its event has put it.
    fn may_leave(&self, glimpse: &ManifestPrefix) -> bool {
        glimpse.head().is_some_and(|head| !self.is_own(head) || self.breaks(Mutation::LeaveOwnCommit))
    }

    /// Returns whether another invocation's manifest shows the fact, or is late enough after the revision that was read
    /// when the fact held.
    async fn is_covered(
        &self,
        animation: &Animation,
        glimpse: &ManifestPrefix,
        fact: &Fact,
        first: u64,
    ) -> Result<bool> {
        if !self.may_leave(glimpse) {
            return Ok(false);
        }
        if *fact != Fact::Fold && glimpse.revision() >= first + 2 {
            return Ok(true);
        }
        // For a large manifest the lines are one more request, in vain while most frames are to come.
        let is_worth_it = match glimpse {
            ManifestPrefix::Start { beginning, .. } => beginning.head.done > beginning.head.pending,
            _ => true,
        };
        Ok(is_worth_it && self.shows(animation, glimpse, fact).await?)
    }

    /// Lists and commits until a listing agrees, or until a frame is to come whose invocation will list. Returns `None`
    /// if another invocation's commit came first, or if frames come as fast as they are committed, so that others take
    /// their turn. `listed` is a listing that was made after the manifest was read.
    async fn commit_until_agreed(
        &self,
        animation: &Animation,
        fact: &Fact,
        known: &mut Option<Known>,
        mut listed: Option<Observation>,
    ) -> Result<Option<Folded>> {
        for _ in 0..MAX_COMMITS {
            let observation = match listed.take() {
                Some(listed) => listed,
                None => self.observe(animation, known.as_ref()).await?,
            };
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
                    if !committed.manifest.head.is_terminal() && *fact != Fact::Fold {
                        listed = match self.survey_again(animation, fact, &committed).await? {
                            Next::Leave => return Ok(Some(Folded::Committed)),
                            Next::Write(observation) => Some(*observation),
                            Next::Wait => None,
                        };
                    }
                    *known = Some(committed);
                }
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// Puts the claim for the revision that this invocation has committed, if no frame is to come.
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

    /// Puts the next revision. Returns `None` if the manifest is no longer, or possibly no longer, the one that was
    /// read.
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
        next.head = next.head.with_files_of(before.map(|before| &before.head));
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

    /// Records files of this generation in the manifest. Returns `None` in the same cases as a commit. This is no new
    /// revision, because everything else in the manifest was listed before.
    pub(crate) async fn record_files(
        &self,
        known: &Known,
        files: Vec<(Container, ETag)>,
    ) -> Result<Option<Known>> {
        let mut next = known.manifest.clone();
        for (output, version) in files {
            next.head.record(output, version);
        }
        if next.head == known.manifest.head {
            return Ok(Some(known.clone()));
        }
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

    /// Puts a claim, which invokes the assembler.
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

/// Folds in any case, for a command that has changed results itself.
///
/// # Errors
///
/// The errors of the store, and [`Error::Malformed`] if an object of the pipeline cannot be read.
pub async fn fold<S: Store, C: Clock>(
    invocation: &Invocation<'_, S, C>,
    animation: &Animation,
) -> Result<Folded, Error> {
    invocation.fold(animation, &Fact::Fold, Age::Old).await
}
