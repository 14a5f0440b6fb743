//! The decision of a finisher, from one page of a listing with all receipts of an animation. It may stop because a
//! frame is still to come, or commit a manifest.
//!
//! A finisher stops for a frame under two conditions. The page, listed after its own result was put, contains no result
//! of that frame. And a further request shows that the frame's script still has that version. The page serves twice: if
//! the finisher writes the manifest, the page is half of the necessary listing. A finisher that finds no manifest stops
//! for any script without a result, because a missing manifest covers nothing. The more results there are, the more
//! likely it stops, so that few finishers write a first manifest.
//!
//! Invariant: a manifest is written from a page only if the page was listed after the manifest that it replaces was
//! read. The writer of a manifest stops for a frame only if the page was listed after that manifest was put.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::invocation::{Invocation, Known, ManifestPrefix, Mutation};
use crate::keys::{Animation, Part, Receipt, ScriptName};
use crate::manifest::{Fact, Frame, FrameState};
use crate::observe::{Observation, Receipts, is_result_of};
use crate::reconcile::ReceiptFound;
use crate::store::{ETag, PAGE, Store};
use crate::{Clock, Result};

/// The number of results missing from the manifest above which a finisher pauses, so that one listing serves many
/// finishers.
const CROWD: usize = 8;

/// The number of frames above which a finisher pauses before it writes the first manifest, so that more frames are
/// drawn meanwhile. A finisher that finds a frame to come in this manifest stops.
const MANY: u64 = 300;

/// One page of a listing, with all receipts of an animation.
#[derive(Debug)]
pub(crate) struct Page {
    receipts: Receipts,
    /// Whether the page was listed after the manifest was last read.
    is_new: bool,
}

/// The next step of a finisher.
#[derive(Debug)]
pub(crate) enum Next {
    /// The finisher stops, because another frame is to come.
    Leave,
    /// The finisher waits, reads the manifest again, and lists.
    Wait,
    /// The finisher commits the manifest of its listing.
    Write(Box<Observation>),
}

impl Page {
    /// Returns the page with `is_new` cleared, after the manifest was read again.
    pub(crate) fn aged(self) -> Self {
        Page { is_new: false, ..self }
    }

    fn has_result(&self, (script, version, part): (&ScriptName, &ETag, Part)) -> bool {
        self.receipts.found.iter().any(|found| is_result_of(found, script, version, part))
    }

    /// Counts the frames and errors of the page that the manifest does not show.
    fn not_shown_by(&self, known: Option<&Known>) -> usize {
        let frames = known.map_or(&[][..], |known| &known.manifest.frames);
        let shown: BTreeSet<_> =
            frames.iter().filter(|frame| frame.state != FrameState::Pending).map(subject).collect();
        let results = self.receipts.found.iter().filter_map(|ReceiptFound { receipt, .. }| match receipt {
            Receipt::Frame { name, tag, part } | Receipt::Fault { name, tag, part } => {
                Some((name, &tag.version, *part))
            }
            Receipt::Waits { name, tag } => Some((name, &tag.version, None)),
            _ => None,
        });
        results.filter(|result| !shown.contains(result)).count()
    }
}

fn subject(frame: &Frame) -> (&ScriptName, &ETag, Part) {
    (&frame.script, &frame.version, frame.part)
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Returns the next step of a finisher that has read `glimpse` of the manifest. `page` is the page of an earlier
    /// call, and is kept for a later one.
    pub(crate) async fn survey(
        &self,
        animation: &Animation,
        fact: &Fact,
        glimpse: &ManifestPrefix,
        page: &mut Option<Page>,
    ) -> Result<Next> {
        let is_due = self.is_due(glimpse, fact);
        let known = match glimpse {
            ManifestPrefix::Nothing => None,
            ManifestPrefix::Whole(known) => Some(known),
            ManifestPrefix::Unreadable(_) | ManifestPrefix::Start { .. } => {
                return self.survey_one(animation, fact, glimpse, is_due).await;
            }
        };
        if !matches!(fact, Fact::Drawn(..) | Fact::Faulty(..)) {
            return Ok(Next::Wait);
        }
        // Others leave because of this invocation's own manifest: it lists their results before it leaves itself.
        let is_own = known.is_some_and(|known| self.is_own(&known.manifest.head));
        if page.as_ref().is_none_or(|page| is_own && !page.is_new) {
            *page = self.page(animation, known).await?;
        }
        let Some(there) = page else { return self.survey_one(animation, fact, glimpse, is_due).await };
        let may_leave = match known {
            Some(known) => {
                let frame = self.drawn_by_lot(fact, glimpse.revision(), &known.manifest.frames);
                let frame = frame.filter(|frame| {
                    !is_due && (self.breaks(Mutation::LeaveForAnyFrame) || !there.has_result(subject(frame)))
                });
                match frame {
                    Some(frame) => self.is_current(animation, frame).await?,
                    None => false,
                }
            }
            None => {
                !self.lot(0).is_multiple_of(there.not_shown_by(None).max(1) as u64)
                    && self.is_any_awaited(animation, fact, there).await?
            }
        };
        if may_leave {
            return Ok(Next::Leave);
        }
        if !there.is_new {
            *page = self.page(animation, known).await?;
        }
        match page {
            Some(page) if known.is_none() || page.not_shown_by(known) <= CROWD => {
                let observation = self.observe_with(animation, known, &page.receipts).await?;
                let is_worth_it =
                    |observed: &Observation| known.is_some() || observed.manifest.head.total <= MANY;
                Ok(observation
                    .filter(is_worth_it)
                    .map_or(Next::Wait, |observation| Next::Write(Box::new(observation))))
            }
            _ => Ok(Next::Wait),
        }
    }

    async fn survey_one(
        &self,
        animation: &Animation,
        fact: &Fact,
        glimpse: &ManifestPrefix,
        is_due: bool,
    ) -> Result<Next> {
        let (revision, frames) = (glimpse.revision(), glimpse.frames());
        let frame = self.drawn_by_lot(fact, revision, frames).filter(|_| !is_due);
        let Some(frame) = frame else { return Ok(Next::Wait) };
        let leaves = self.is_awaited(animation, frame).await?
            || self.is_awaited_by_a_crowd(animation, fact, glimpse).await?;
        Ok(if leaves { Next::Leave } else { Next::Wait })
    }

    /// Returns whether a frame in the beginning of a manifest is to come. It is for the case that very many finishers
    /// found another frame drawn, so that few of them write the manifest.
    async fn is_awaited_by_a_crowd(
        &self,
        animation: &Animation,
        fact: &Fact,
        glimpse: &ManifestPrefix,
    ) -> Result<bool> {
        let Some(head) = glimpse.head().filter(|head| head.total <= PAGE as u64) else { return Ok(false) };
        let Some(page) = self.page(animation, None).await? else { return Ok(false) };
        let shown = usize::try_from(head.done + head.failed).unwrap_or(usize::MAX);
        let not_shown = page.not_shown_by(None).saturating_sub(shown);
        let lot = self.lot(head.revision).rotate_left(32).checked_rem(not_shown as u64).unwrap_or(0);
        if lot < CROWD as u64 {
            return Ok(false);
        }
        let is_to_come = |frame: &&Frame| frame.part.is_none() && !page.has_result(subject(frame));
        let frames: Vec<Frame> = glimpse.frames().iter().filter(is_to_come).cloned().collect();
        match self.drawn_by_lot(fact, head.revision, &frames) {
            Some(frame) => self.is_current(animation, frame).await,
            None => Ok(false),
        }
    }

    /// Returns the next step after a manifest was committed. Every finisher that relies on the writer of this manifest
    /// has put its result before the commit.
    pub(crate) async fn survey_again(
        &self,
        animation: &Animation,
        fact: &Fact,
        committed: &Known,
    ) -> Result<Next> {
        let (revision, frames) = (committed.manifest.head.revision, &committed.manifest.frames);
        let Some(page) = self.page(animation, Some(committed)).await? else {
            return Ok(match self.drawn_by_lot(fact, revision, frames) {
                Some(frame) if self.is_awaited(animation, frame).await? => Next::Leave,
                _ => Next::Wait,
            });
        };
        let is_to_come = |frame: &&Frame| !page.has_result(subject(frame));
        let frames: Vec<Frame> = frames.iter().filter(is_to_come).cloned().collect();
        if let Some(frame) = self.drawn_by_lot(fact, revision, &frames)
            && self.is_current(animation, frame).await?
        {
            return Ok(Next::Leave);
        }
        let observation = self.observe_with(animation, Some(committed), &page.receipts).await?;
        Ok(observation.map_or(Next::Wait, |observation| Next::Write(Box::new(observation))))
    }

    /// Lists all receipts of an animation. Returns `None` if they exceed a page.
    async fn page(&self, animation: &Animation, known: Option<&Known>) -> Result<Option<Page>> {
        let has_parts =
            known.is_some_and(|known| known.manifest.frames.iter().any(|frame| frame.part.is_some()));
        let receipts = self.receipts_on_a_page(animation, has_parts).await?;
        Ok(receipts.map(|receipts| Page { receipts, is_new: true }))
    }

    /// Selects at random one of the frames that the manifest shows as pending, other than that of the fact.
    fn drawn_by_lot<'f>(&self, fact: &Fact, revision: u64, frames: &'f [Frame]) -> Option<&'f Frame> {
        let is_other = |frame: &&Frame| {
            frame.state == FrameState::Pending && fact.subject() != Some((&frame.script, frame.part))
        };
        let others: Vec<&Frame> = frames.iter().filter(is_other).collect();
        let place = self.lot(revision).checked_rem(others.len() as u64)?;
        others.get(usize::try_from(place).ok()?).copied()
    }

    /// Returns whether a frame is still to come.
    async fn is_awaited(&self, animation: &Animation, frame: &Frame) -> Result<bool> {
        if self.breaks(Mutation::LeaveForAnyFrame) {
            return Ok(true);
        }
        // One request after the other: most frames that are not awaited have a result, and their scripts need no
        // request.
        let has_result = self.has_result(animation, &frame.script, &frame.version, frame.part).await?;
        Ok(!has_result && self.is_current(animation, frame).await?)
    }

    /// Returns a number that differs for each event and revision.
    fn lot(&self, revision: u64) -> u64 {
        let mut lot = DefaultHasher::new();
        (self.request_id(), revision).hash(&mut lot);
        lot.finish()
    }

    /// Returns whether a frame's script still has the frame's version.
    async fn is_current(&self, animation: &Animation, frame: &Frame) -> Result<bool> {
        if self.breaks(Mutation::LeaveForAnyFrame) {
            return Ok(true);
        }
        let script = self.head(&animation.script(&frame.script)).await?;
        Ok(script.is_some_and(|script| script.etag.as_str() == frame.version.script()))
    }

    /// Returns whether a script other than that of the fact has no result in the page.
    async fn is_any_awaited(&self, animation: &Animation, fact: &Fact, page: &Page) -> Result<bool> {
        let scripts = self.scripts_on_a_page(animation).await?;
        let own = fact.subject().map(|(name, _)| name);
        Ok(scripts.iter().any(|(name, version)| Some(name) != own && !page.has_result((name, version, None))))
    }
}
