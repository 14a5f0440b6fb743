//! The fold: an invocation that has put a result sees to it that the manifest shows it, and claims for the revision
//! that it commits.
//!
//! 1. Read the manifest; leave if it shows the fact and is someone else's.
//! 2. Pause, the longer the more frames are to come, and look again: with many finishers one listing serves all.
//! 3. List, reconcile, and where the manifest differs put it on the condition that it is still the one that was read.
//! 4. **List again**, and commit again until a listing agrees with what was committed: the first listing may be older
//!    than a quick change and change back.
//! 5. If nothing is left to come, put the claim of that revision, whose name is new because only its writer claims.
//!
//! Invariant: whoever finds its own commit, as after a crash or a lost answer, still owes the claim and does not leave.

use crate::invocation::{Invocation, Known, Mutation};
use crate::keys::{Animation, Key};
use crate::manifest::{Fact, Manifest};
use crate::store::{PutOptions, Store};
use crate::{Clock, Error, Result, invariants};

/// How a fold ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Folded {
    /// The manifest, someone else's, showed the fact: nothing was listed.
    Covered,
    /// The manifest agreed with the listing.
    Agreed,
    /// This invocation's revision is the manifest, and frames are still to come.
    Committed,
    /// This invocation's revision is the manifest, and its claim is put.
    Claimed,
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Sees to it that the manifest shows `fact`.
    pub(crate) async fn fold(&self, animation: &Animation, fact: &Fact) -> Result<Folded> {
        let known = self.manifest(animation).await?;
        self.fold_from(animation, fact, known).await
    }

    /// The same from a manifest that has just been read.
    pub(crate) async fn fold_from(
        &self,
        animation: &Animation,
        fact: &Fact,
        mut known: Option<Known>,
    ) -> Result<Folded> {
        if self.is_covered(known.as_ref(), fact) {
            return Ok(Folded::Covered);
        }
        loop {
            self.pause(known.as_ref()).await;
            known = self.manifest(animation).await?;
            if self.is_covered(known.as_ref(), fact) {
                return Ok(Folded::Covered);
            }
            if let Some(folded) = self.commit_until_agreed(animation, &mut known).await? {
                return Ok(folded);
            }
        }
    }

    /// Lists and commits until a listing agrees; `None` when someone else's commit came first.
    async fn commit_until_agreed(
        &self,
        animation: &Animation,
        known: &mut Option<Known>,
    ) -> Result<Option<Folded>> {
        loop {
            let observed = self.observe(animation, known.as_ref()).await?.manifest;
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
    }

    /// Claims for what this invocation has committed, if nothing is left to come.
    async fn end(&self, known: &Known) -> Result<Folded> {
        if !self.is_own(known) {
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
        invariants::check(&next, before)?;
        let options = match known {
            _ if self.breaks(Mutation::DropIfMatch) => PutOptions::always(),
            None => PutOptions::if_absent(),
            Some(known) => PutOptions::if_match(known.etag.clone()),
        };
        let options = options.content_type("application/json");
        match self.store.put(&animation.manifest(), next.encode()?, options).await {
            Ok(etag) => Ok(Some(Known { manifest: next, etag })),
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
    invocation.fold(animation, &Fact::Fold).await
}
