//! The sweep repairs what events cannot: lost events, retries that ran out, and writes that took effect after their
//! writer was killed.
//!
//! It visits every animation that has a script or a manifest, finished or not, and compares the manifest and the GIF
//! with a listing. If nothing has happened in an animation for a while, it triggers the pending frames by objects below
//! `retries/`. After a limited number of triggers it gives a frame up with an error receipt. It writes a claim if
//! manifest or GIF differ from the listing. It deletes objects that were superseded or set aside long ago. It never
//! writes below `scripts/`.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroU64;

use futures_util::stream::{self, StreamExt, TryStreamExt};

use crate::invocation::{Invocation, Known};
use crate::keys::{Animation, Key, MANIFESTS, Part, Receipt, SCRIPTS, ScriptName, Tag, Uploaded};
use crate::lease::SweepLease;
use crate::manifest::{Fault, Frame, FrameState, Manifest, Reason, Status};
use crate::observe::Observation;
use crate::outputs::{Due, Outputs, needed};
use crate::reconcile::ReceiptFound;
use crate::store::{ETag, ListRequest, Store};
use crate::wake_count::WakeCount;
use crate::{Clock, Result, Timestamp};

/// The number of animations that are visited in parallel.
const VISITS: usize = 8;

/// The result of a sweep.
#[derive(Debug, Default)]
pub struct Swept {
    /// Each animation with the result of its visit, in the order of the visits.
    pub visits: Vec<(Animation, Result<Visit>)>,
    /// Keys below `scripts/` that are meant as scripts but belong to no animation, with the reason.
    pub rejected: Vec<(String, &'static str)>,
    /// The number of deleted manifests that had been set aside because they could not be read.
    pub cleared: u64,
    /// The number of animations for which there was no time left.
    pub unvisited: usize,
}

/// The result of a sweep for one animation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Visit {
    /// The number of frames that were triggered.
    pub woken: u64,
    /// The number of frames that were given up.
    pub given_up: u64,
    /// A claim was put.
    pub claimed: bool,
    /// The number of superseded objects that were deleted.
    pub deleted: u64,
}

/// The maximum number of times that the pause between triggers doubles.
const MAX_DOUBLINGS: u64 = 6;

/// Visits each animation in the bucket.
///
/// # Errors
///
/// Fails if the animations cannot be listed. An error of one animation is in its visit, and the others are still
/// visited.
pub async fn sweep<S: Store, C: Clock>(invocation: &Invocation<'_, S, C>) -> Result<Swept> {
    invocation.sweep().await
}

/// Visits a single animation.
///
/// # Errors
///
/// The errors of the store.
pub async fn visit<S: Store, C: Clock>(
    invocation: &Invocation<'_, S, C>,
    animation: &Animation,
) -> Result<Visit> {
    invocation.visit(animation).await
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    async fn sweep(&self) -> Result<Swept> {
        let mut swept = Swept::default();
        let mut animations = BTreeSet::new();
        let mut set_aside = Vec::new();
        for prefix in [SCRIPTS, MANIFESTS] {
            for listed in self.list_ranges(ListRequest::all(prefix), Vec::new()).await? {
                match listed.key.parse() {
                    Ok(Key::Manifest { animation }) => {
                        animations.insert(animation);
                        continue;
                    }
                    Ok(Key::SetAside { .. }) if self.is_old(listed.modified) => {
                        set_aside.push(listed.key);
                        continue;
                    }
                    _ => {}
                }
                match Uploaded::of(&listed.key, listed.size) {
                    Uploaded::Misplaced(problem) => swept.rejected.push((listed.key, problem)),
                    uploaded => animations.extend(uploaded.animation()),
                }
            }
        }
        let deletions: Vec<_> = set_aside.iter().map(|key| self.delete(key)).collect();
        swept.cleared = deletions.len() as u64;
        stream::iter(deletions).buffer_unordered(self.policy.concurrency).try_collect::<Vec<()>>().await?;
        let mut animations: Vec<Animation> = animations.into_iter().collect();
        // If the time is too short for all, it is not always the same ones that wait.
        let start = self.random.below(animations.len() as u64);
        animations.rotate_left(usize::try_from(start).unwrap_or(0));
        let visits = animations.into_iter().map(|animation| async move {
            if self.deadline.is_some_and(|deadline| self.clock.now().after(self.policy.margin) >= deadline) {
                return None;
            }
            let visit = self.visit(&animation).await;
            Some((animation, visit))
        });
        let mut visits = stream::iter(visits).buffered(VISITS);
        while let Some(visit) = visits.next().await {
            match visit {
                Some(visit) => swept.visits.push(visit),
                None => swept.unvisited += 1,
            }
        }
        Ok(swept)
    }

    async fn visit(&self, animation: &Animation) -> Result<Visit> {
        let known = self.manifest(animation).await?;
        let mut outputs = Outputs::default();
        self.look_at_outputs(animation, &needed(known.as_ref(), None), &mut outputs).await?;
        let mut observation = self.observe(animation, known.as_ref()).await?;
        let mut visit = Visit::default();
        let mut lease = None;
        if observation.has_sweep_lease {
            lease = Some(self.take_sweep_lease(animation).await?);
            // Its holder may have deleted more since the listing.
            observation = self.observe(animation, known.as_ref()).await?;
        }
        self.look_at_outputs(animation, &needed(None, Some(&observation)), &mut outputs).await?;
        if self.policy.is_fresh_start && observation.has_lease {
            self.release_stale_lease(animation).await?;
        }
        self.wake(animation, &observation, lease, &mut visit).await?;
        let is_healed = self.heal_receipts(animation, &observation, &mut lease, &mut visit).await?;
        let head = &observation.manifest.head;
        let stands = known.as_ref().filter(|known| known.manifest.agrees_with(&observation.manifest));
        // A file that no manifest has named could be cut off unnoticed.
        let is_right = stands
            .map(|known| &known.manifest.head)
            .is_some_and(|head| outputs.due(head) == Due::Nothing && outputs.unrecorded(head).is_empty());
        let is_empty = head.status == Status::Empty && head.warnings.is_empty();
        let nothing_at_all = known.is_none() && is_empty && outputs.existing().next().is_none();
        if (!is_right || is_healed || visit.given_up > 0) && !nothing_at_all {
            self.claim(&claimable(&observation.manifest, known.as_ref())).await?;
            visit.claimed = true;
        }
        self.tidy(animation, &observation, &mut lease, &mut visit).await?;
        if lease.is_some_and(|lease| lease != SweepLease::Anothers) {
            self.release_sweep_lease(animation).await?;
        }
        Ok(visit)
    }

    /// Returns whether this sweep may delete results that may have to be drawn again, which it may only while it has
    /// the lease.
    async fn may_delete(&self, animation: &Animation, lease: &mut Option<SweepLease>) -> Result<bool> {
        if lease.is_none() {
            *lease = Some(match self.take_sweep_lease(animation).await? {
                // The deletions of a dead sweep were not looked for: the lease stays, and the next visit finds them.
                SweepLease::Left(_) => SweepLease::Anothers,
                taken => taken,
            });
        }
        Ok(*lease != Some(SweepLease::Anothers))
    }

    /// Returns whether an object that is no longer needed is old enough to go.
    fn is_old(&self, modified: Timestamp) -> bool {
        self.clock.now().since(modified) >= self.policy.superseded_after
    }

    /// Triggers pending frames, or gives them up. A frame that a dead sweep may have deleted is triggered however new
    /// its script is.
    async fn wake(
        &self,
        animation: &Animation,
        observation: &Observation,
        lease: Option<SweepLease>,
        visit: &mut Visit,
    ) -> Result<()> {
        let frames = || observation.manifest.frames.iter();
        let pending: Vec<&Frame> = frames().filter(|frame| frame.state == FrameState::Pending).collect();
        let now = self.clock.now();
        let is_quiet = now.since(self.last_progress(observation)) >= self.policy.stuck_after;
        // No invocation is left to wait for. But files may come as late as ever.
        let is_stuck = is_quiet || self.policy.is_fresh_start;
        let swept = match lease {
            Some(SweepLease::Left(since)) => Some(since),
            Some(SweepLease::New | SweepLease::Anothers) | None => None,
        };
        let is_hopeless = observation.manifest.head.excess.is_some();
        if is_quiet && !is_hopeless {
            for (frame, fault) in frames().filter_map(|frame| match &frame.state {
                FrameState::Waiting(fault) => Some((frame, fault)),
                _ => None,
            }) {
                self.give_up_waiting(animation, frame, fault).await?;
                visit.given_up += 1;
            }
        }
        if pending.is_empty() || is_hopeless || !is_stuck && swept.is_none() {
            return Ok(());
        }
        if self.policy.is_fresh_start {
            self.forget_attempts(animation, observation, &pending).await?;
        }
        let wakings = self.wakings(animation, observation).await?;
        let steps = pending.into_iter().map(|frame| {
            let waking = wakings.get(&(frame.script.clone(), frame.version.clone(), frame.part)).copied();
            let waking = waking.unwrap_or_default();
            // A sweep that died has deleted something, and no frame has been woken for it since.
            let is_swept = swept.is_some_and(|since| waking.last <= since);
            async move {
                match is_swept || is_stuck {
                    true => self.wake_frame(animation, frame, waking, (now, is_swept)).await,
                    false => Ok(Step::Patient),
                }
            }
        });
        let steps: Vec<_> = steps.collect();
        let mut steps = stream::iter(steps).buffer_unordered(self.policy.concurrency);
        while let Some(step) = steps.try_next().await? {
            visit.woken += u64::from(step == Step::Woken);
            visit.given_up += u64::from(step == Step::GivenUp);
        }
        Ok(())
    }

    /// Fails a frame whose files have not arrived.
    async fn give_up_waiting(&self, animation: &Animation, frame: &Frame, fault: &Fault) -> Result<()> {
        let unknown = || Reason::new(format!("{}.txt names a file that has not come", frame.script));
        let reason = fault.reason.clone().unwrap_or_else(unknown);
        let tag = Tag { version: frame.version.clone(), pixels: self.policy.pixels };
        self.put_fault(animation, &frame.script, &tag, frame.part, &reason).await.map(drop)
    }

    /// Deletes the receipts of begun attempts at these frames.
    async fn forget_attempts(
        &self,
        animation: &Animation,
        observation: &Observation,
        pending: &[&Frame],
    ) -> Result<()> {
        let pending: BTreeSet<_> =
            pending.iter().map(|frame| (&frame.script, &frame.version, frame.part)).collect();
        let begun = observation.results.receipts.iter().filter(|found| match &found.receipt {
            Receipt::Begun { name, tag, part, .. } => pending.contains(&(name, &tag.version, *part)),
            _ => false,
        });
        let begun: Vec<String> = begun.map(|found| animation.receipt(&found.receipt)).collect();
        let deletions: Vec<_> = begun.iter().map(|key| self.delete(key)).collect();
        stream::iter(deletions).buffer_unordered(self.policy.concurrency).try_collect().await
    }

    /// Returns the time when a script was last uploaded or a result last written. While that continues, frames are not
    /// stuck, only queued.
    fn last_progress(&self, observation: &Observation) -> Timestamp {
        let results = observation.results.receipts.iter().map(|found| found.modified).max();
        observation.newest_script().max(results).unwrap_or_default()
    }

    async fn wake_frame(
        &self,
        animation: &Animation,
        frame: &Frame,
        waking: WakeCount,
        (now, is_swept): (Timestamp, bool),
    ) -> Result<Step> {
        let WakeCount { attempts, last, begun } = waking;
        let doublings = attempts.saturating_sub(1).min(MAX_DOUBLINGS) as u32;
        let patience = self.policy.stuck_after.saturating_mul(2_u32.saturating_pow(doublings));
        let is_at_once = is_swept || self.policy.is_fresh_start;
        if attempts > 0 && now.since(last) < patience && !is_at_once {
            return Ok(Step::Patient);
        }
        let tag = Tag { version: frame.version.clone(), pixels: self.policy.pixels };
        if begun >= self.policy.attempts && !is_at_once {
            let reason = Reason::new(format!("no result in each of {begun} attempts"));
            self.put_fault(animation, &frame.script, &tag, frame.part, &reason).await?;
            return Ok(Step::GivenUp);
        }
        self.put_retry(animation, &frame.script, tag, frame.part, attempts + 1).await?;
        Ok(Step::Woken)
    }

    /// Deletes error receipts that cannot be read, and has their frames drawn again. Returns whether there were any.
    async fn heal_receipts(
        &self,
        animation: &Animation,
        observation: &Observation,
        lease: &mut Option<SweepLease>,
        visit: &mut Visit,
    ) -> Result<bool> {
        let manifest = &observation.manifest;
        let is_unreadable =
            |fault: &Fault| fault.reason.as_ref().is_some_and(|reason| reason.message == Reason::UNREADABLE);
        let faults = manifest.frames.iter().filter_map(|frame| match &frame.state {
            FrameState::Failed(fault) if is_unreadable(fault) => Some((Some(frame), fault)),
            FrameState::Failed(_)
            | FrameState::Waiting(_)
            | FrameState::Pending
            | FrameState::Done { .. } => None,
        });
        let refusal = manifest.head.refusal.iter().filter(|fault| is_unreadable(fault));
        let faults: Vec<_> = faults.chain(refusal.map(|fault| (None, fault))).collect();
        if faults.is_empty() || !self.may_delete(animation, lease).await? {
            return Ok(false);
        }
        for (frame, fault) in &faults {
            let is_it = |found: &&ReceiptFound| match (&found.receipt, frame) {
                (Receipt::Fault { name, tag, part }, Some(frame)) => {
                    (name, &tag.version, part) == (&frame.script, &frame.version, &frame.part)
                }
                (Receipt::Refusal { generation, .. }, None) => *generation == manifest.head.generation,
                _ => false,
            };
            let receipts = observation.results.receipts.iter().filter(is_it);
            for found in receipts.filter(|found| found.etag == fault.receipt) {
                self.delete(&animation.receipt(&found.receipt)).await?;
                visit.deleted += 1;
            }
            if let Some(frame) = frame {
                let tag = Tag { version: frame.version.clone(), pixels: self.policy.pixels };
                self.put_retry(animation, &frame.script, tag, frame.part, 1).await?;
                visit.woken += 1;
            }
        }
        Ok(true)
    }

    /// Triggers an invocation for a frame.
    pub(crate) async fn put_retry(
        &self,
        animation: &Animation,
        name: &ScriptName,
        tag: Tag,
        part: Part,
        attempt: u64,
    ) -> Result<()> {
        let (animation, name) = (animation.clone(), name.clone());
        let attempt = NonZeroU64::new(attempt).unwrap_or(NonZeroU64::MIN);
        let key = Key::Retry { animation, name, tag, part, attempt }.to_string();
        let body = serde_json::json!({ "woken_by": self.request_id() });
        self.put(&key, body.to_string().into()).await.map(drop)
    }

    /// Deletes old results of versions that are no longer current, and the parts that led to them.
    async fn tidy(
        &self,
        animation: &Animation,
        observation: &Observation,
        lease: &mut Option<SweepLease>,
        visit: &mut Visit,
    ) -> Result<()> {
        let current: BTreeMap<&ScriptName, &ETag> =
            observation.scripts.found.iter().map(|script| (&script.name, &script.version)).collect();
        let used = used_pixels(&observation.manifest);
        // If no set of files agrees with the listing, each may again.
        let is_current = |name: &ScriptName, version: &ETag| {
            current
                .get(name)
                .is_some_and(|current| *current == version || current.as_str() == version.script())
        };
        let superseded = |found: &&ReceiptFound| match &found.receipt {
            Receipt::Refusal { generation, .. } => *generation != observation.manifest.head.generation,
            Receipt::Frame { name, tag, part } => match used.get(&(name, *part)) {
                _ if !is_current(name, &tag.version) => true,
                Some(used) => tag.pixels < *used,
                None => false,
            },
            other => other.subject().is_some_and(|(name, version)| !is_current(name, version)),
        };
        let old = |modified: Timestamp| self.is_old(modified);
        let mut doomed: Vec<Key> = Vec::new();
        let mut split_before = false;
        // Bands are no longer needed once their frame is there.
        let is_used_up = |found: &&ReceiptFound| {
            banded_frame(found).is_some_and(|(name, version, part)| {
                current.get(name) == Some(&version) && used.contains_key(&(name, part))
            })
        };
        let receipts = || observation.results.receipts.iter();
        let gone = receipts().filter(superseded).filter(|found| old(found.modified));
        let used_up: BTreeSet<_> = receipts().filter(is_used_up).filter_map(banded_frame).collect();
        for found in gone.chain(receipts().filter(is_used_up)) {
            let key = Key::Receipt { animation: animation.clone(), receipt: found.receipt.clone() };
            split_before |= tells_of_parts(&key);
            doomed.push(key);
        }
        if split_before {
            let parts = self.list_ranges(ListRequest::all(animation.parts()), Vec::new()).await?;
            let frames = self.list_ranges(ListRequest::all(animation.frames()), Vec::new()).await?;
            let mut young = BTreeSet::new();
            for listed in parts.into_iter().chain(frames) {
                let Ok(key) = listed.key.parse::<Key>() else { continue };
                if key.animation() != animation {
                    continue;
                }
                let is_superseded = part_of(&key).is_some_and(|(name, version)| !is_current(name, version));
                let has_woken = matches!(&key, Key::Band { name, tag, part, .. }
                    if used_up.contains(&(name, &tag.version, *part)));
                if is_superseded && !old(listed.modified) {
                    young.extend(version_of(&key).map(|(name, version)| (name.clone(), version.clone())));
                } else if is_superseded || has_woken {
                    doomed.push(key);
                }
            }
            // The frames of a split script come after it was split: without the object that says that it is, no sweep
            // would look for them.
            doomed.retain(|key| {
                version_of(key)
                    .is_none_or(|(name, version)| !young.contains(&(name.clone(), version.clone())))
            });
            doomed.sort();
            doomed.dedup();
        }
        let gone: BTreeSet<_> = doomed.iter().filter_map(version_of).collect();
        let gone: BTreeSet<_> =
            gone.into_iter().filter(|(name, version)| !is_current(name, version)).collect();
        if !gone.is_empty() && !self.may_delete(animation, lease).await? {
            return Ok(());
        }
        visit.deleted += doomed.len() as u64;
        // For the same reason that goes last, when the rest has gone.
        let (last, first): (Vec<&Key>, Vec<&Key>) = doomed.iter().partition(|key| tells_of_parts(key));
        for keys in [first, last] {
            let deletions: Vec<_> =
                keys.into_iter().map(|key| async { self.delete(&key.to_string()).await }).collect();
            stream::iter(deletions)
                .buffer_unordered(self.policy.concurrency)
                .try_collect::<Vec<()>>()
                .await?;
        }
        self.wake_returned(animation, &gone, visit).await
    }

    /// Triggers each frame that is current again. A script may have returned to a version while the results of that
    /// version were being deleted, and its event may have found the result before it was deleted.
    async fn wake_returned(
        &self,
        animation: &Animation,
        gone: &BTreeSet<(&ScriptName, &ETag)>,
        visit: &mut Visit,
    ) -> Result<()> {
        if gone.is_empty() {
            return Ok(());
        }
        let (mut scripts, _) = self.list_scripts(animation, &[]).await?;
        if gone.iter().any(|(_, version)| version.has_files()) {
            scripts.resolve(&self.list_results(animation).await?);
        }
        // The set that the files agree with again may be among what was deleted.
        let is_gone = |name: &ScriptName, now: &ETag| {
            gone.iter().any(|(of, version)| {
                *of == name && (*version == now || !now.has_files() && version.script() == now.as_str())
            })
        };
        for script in scripts.found.iter().filter(|found| is_gone(&found.name, &found.version)) {
            let tag = Tag { version: script.version.clone(), pixels: self.policy.pixels };
            self.put_retry(animation, &script.name, tag, None, 1).await?;
            visit.woken += 1;
        }
        Ok(())
    }
}

#[derive(PartialEq, Eq)]
enum Step {
    Patient,
    Woken,
    GivenUp,
}

/// The pixel version that each drawn frame uses.
fn used_pixels(manifest: &Manifest) -> BTreeMap<(&ScriptName, Part), u32> {
    let drawn = manifest.frames.iter().filter_map(|frame| match frame.state {
        FrameState::Done { pixels } => Some(((&frame.script, frame.part), pixels)),
        _ => None,
    });
    drawn.collect()
}

/// Returns the script and version of a part, or of a part's receipt.
fn part_of(key: &Key) -> Option<(&ScriptName, &ETag)> {
    match key {
        Key::Part { name, tag, .. } | Key::Band { name, tag, .. } | Key::Wake { name, tag, .. } => {
            Some((name, &tag.version))
        }
        Key::Receipt {
            receipt:
                Receipt::Frame { name, tag, part: Some(_) }
                | Receipt::Fault { name, tag, part: Some(_) }
                | Receipt::Begun { name, tag, part: Some(_), .. }
                | Receipt::Cut { name, tag, part: Some(_), .. }
                | Receipt::Band { name, tag, part: Some(_), .. },
            ..
        } => Some((name, &tag.version)),
        _ => None,
    }
}

/// Returns the script and version of a key that the sweep may delete.
fn version_of(key: &Key) -> Option<(&ScriptName, &ETag)> {
    match key {
        Key::Receipt {
            receipt:
                Receipt::Frame { name, tag, part: None }
                | Receipt::Fault { name, tag, part: None }
                | Receipt::Begun { name, tag, part: None, .. }
                | Receipt::Cut { name, tag, part: None, .. }
                | Receipt::Band { name, tag, part: None, .. }
                | Receipt::Split { name, tag, .. }
                | Receipt::Files { name, tag, .. }
                | Receipt::Taken { name, tag }
                | Receipt::Waits { name, tag },
            ..
        } => Some((name, &tag.version)),
        key => part_of(key),
    }
}

/// Returns whether the key means that there are objects below a script's version, or below `parts/`, that a listing of
/// the results does not show.
fn tells_of_parts(key: &Key) -> bool {
    use Receipt::{Cut, Files, Split};
    matches!(key, Key::Receipt { receipt: Split { .. } | Cut { .. } | Files { .. }, .. })
}

/// Returns the frame of a cut or a band.
fn banded_frame(found: &ReceiptFound) -> Option<(&ScriptName, &ETag, Part)> {
    match &found.receipt {
        Receipt::Cut { name, tag, part, .. } | Receipt::Band { name, tag, part, .. } => {
            Some((name, &tag.version, *part))
        }
        _ => None,
    }
}

/// Returns the manifest that a claim names if no invocation commits: the current revision, with the generation that it
/// should have.
fn claimable(observed: &Manifest, known: Option<&Known>) -> Manifest {
    let mut head = observed.head.clone();
    head.revision = known.map_or(0, |known| known.manifest.head.revision);
    Manifest { head, frames: Vec::new() }
}
