//! The assembler, which makes the outputs of a bucket agree with its listing, whatever claim invoked it.
//!
//! Each round reads the manifest and the versions and generations of the files (`outputs.rs`), and lists, in this
//! order. Then it does what is due. If the manifest differs, it commits it, without a claim, because the assembler is
//! already running. If a set is done and settled, it builds a file of it. If a set can have no file, it removes the
//! file. The assembler ends only after a round that wrote nothing. So no file from an older listing remains, and a set
//! that became complete meanwhile is not missed. An assembler that waits or builds holds the animation's lease. Another
//! assembler that finds the lease taken exits, and leaves the work to the holder.
//!
//! If a file does not fit the time of one invocation, the next invocation continues it (`build`).

use std::collections::BTreeSet;
use std::time::Duration;

use bytes::Bytes;
use rayfold_scene::{AnimationSettings, Container};

use crate::animator::Animator;
use crate::build::Built;
use crate::invocation::{Invocation, Known, Mutation};
use crate::keys::{Animation, Generation, Key, Receipt, Tag};
use crate::lease::HeldLease;
use crate::manifest::{Frame, Head, Manifest, Reason, Status};
use crate::observe::Observation;
use crate::outputs::{Due, Outputs, needed};
use crate::store::{ObjectInfo, Store};
use crate::wake_count::WakeCount;
use crate::{Clock, Error, Result, Timestamp};

pub use crate::build::{GENERATION, MAX_PIECES, frame_key, generation_of, is_current};

/// The result of an invocation of the assembler.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembled {
    /// The animation that the claim names.
    pub animation: Animation,
    /// The animation's status in the last round.
    pub status: Status,
    /// The generation of the set in the last round.
    pub generation: Generation,
    /// The number of rounds. The last one wrote nothing.
    pub rounds: u32,
    /// The number of files that were written.
    pub built: u32,
    /// The number of frames of the last file that was written.
    pub frames: u64,
    /// The number of frames in a file that was left unfinished to the next invocation.
    pub left_after: Option<u64>,
    /// The time spent waiting for uploads to settle.
    pub waited: Duration,
    /// The time spent on building files.
    pub building: Duration,
}

/// Works on one claim, given its key. Returns `None` if another assembler works on the animation; that one looks at it
/// once more.
///
/// # Errors
///
/// [`Error::Key`] for a key that is no claim: nothing was done, and a retry would not help. All other errors are the
/// store's, and the platform should try again.
pub async fn assemble<S: Store, C: Clock, A: Animator>(
    invocation: &Invocation<'_, S, C>,
    animator: &A,
    key: &str,
) -> Result<Option<Assembled>> {
    match key.parse()? {
        Key::Claim { animation, .. } => invocation.assemble(animator, &animation).await,
        _ => Err(Error::key(key, "this key is no claim")),
    }
}

/// The end of a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    /// The round wrote or waited, so another round follows.
    Round,
    /// There is nothing to do.
    End,
    /// Another assembler does the work. This one does not touch its lease.
    Leave,
    /// The set does not settle in this invocation's time, or its GIF is not finished: invoke the next assembler.
    HandOver,
}

/// Returns the time of the last change of the set of scripts. Returns `None` if the set is settled because there are
/// exactly as many frames as `animation.json` says.
fn last_change(
    head: &Head,
    newest_script: Option<Timestamp>,
    removed_at: Option<Timestamp>,
) -> Option<Timestamp> {
    let expected = head.settings.value.as_ref().and_then(AnimationSettings::frames);
    newest_script.max(removed_at).filter(|_| expected != Some(head.total))
}

/// The quiet time that was waited for.
#[derive(Debug, Default)]
struct Quiet {
    since: Option<Timestamp>,
    waited: Duration,
}

/// The sums of all rounds of an invocation.
struct Tally {
    began: Timestamp,
    quiet: Quiet,
    rounds: u32,
    built: u32,
    frames: u64,
    left_after: Option<u64>,
    waited: Duration,
    building: Duration,
    /// The animation's lease, while this invocation holds it.
    lease: Option<HeldLease>,
    /// Files that an earlier round examined.
    looked_at: BTreeSet<Container>,
}

impl Quiet {
    /// Returns the time until the last change is a quiet period old. The clock that dated the change may run ahead of
    /// this one, so a period that was slept through counts as well.
    fn left(&mut self, period: Duration, changed: Timestamp, now: Timestamp) -> Duration {
        if self.since != Some(changed) {
            *self = Quiet { since: Some(changed), waited: Duration::ZERO };
        }
        let wait = period.saturating_sub(now.since(changed).max(self.waited));
        self.waited += wait;
        wait
    }
}

impl Tally {
    fn new(began: Timestamp) -> Self {
        let (waited, building) = (Duration::ZERO, Duration::ZERO);
        let quiet = Quiet::default();
        let (left_after, lease, looked_at) = (None, None, BTreeSet::new());
        Tally { began, quiet, rounds: 0, built: 0, frames: 0, left_after, waited, building, lease, looked_at }
    }

    fn of(self, head: &Head) -> Assembled {
        let Tally { rounds, built, frames, left_after, waited, building, .. } = self;
        let (animation, status, generation) = (head.animation.clone(), head.status, head.generation.clone());
        Assembled { animation, status, generation, rounds, built, frames, left_after, waited, building }
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    async fn assemble<A: Animator>(&self, animator: &A, animation: &Animation) -> Result<Option<Assembled>> {
        if self.is_held_by_another(animation).await? {
            return Ok(None);
        }
        self.assemble_all(animator, animation).await.map(Some)
    }

    async fn assemble_all<A: Animator>(&self, animator: &A, animation: &Animation) -> Result<Assembled> {
        let mut tally = Tally::new(self.clock.now());
        loop {
            tally.rounds += 1;
            self.forget_history_before(&(&tally.quiet, tally.lease, &tally.looked_at));
            let known = self.manifest(animation).await?;
            let mut files = Outputs::default();
            let wanted = needed(known.as_ref(), None)
                .into_iter()
                .chain(std::mem::take(&mut tally.looked_at))
                .collect();
            self.look_at_outputs(animation, &wanted, &mut files).await?;
            tally.looked_at = wanted;
            let observation = self.observe(animation, known.as_ref()).await?;
            let observed = &observation.manifest;
            self.forget_history_before(&(
                &tally.quiet,
                tally.lease,
                &tally.looked_at,
                &known,
                &files,
                &observation,
            ));
            let needed = needed(None, Some(&observation));
            if !files.covers(&needed) {
                // What replaces a file is to be made of a listing after the file was looked at.
                tally.looked_at.extend(needed);
                continue;
            }
            if known.is_none() && observation.is_of_nothing() {
                if self.clear(animation, &files, &observation, &mut tally).await? {
                    continue;
                }
                return Ok(tally.of(&observed.head));
            }
            let (known, agrees) = match known {
                Some(known) if known.manifest.agrees_with(observed) => (known, true),
                known => match self.commit(animation, known.as_ref(), observed.clone()).await? {
                    Some(known) => (known, false),
                    None => continue,
                },
            };
            let new = files.unrecorded(&known.manifest.head);
            let Some(known) = self.record_files(&known, new).await? else { continue };
            let leaves_early = self.breaks(Mutation::AssemblerLeavesEarly) && !observed.head.is_terminal();
            let next = match files.due(&known.manifest.head) {
                Due::Nothing if agrees || leaves_early => Next::End,
                Due::Nothing => Next::Round,
                Due::NoFile(output) => self.delete(&animation.output(output)).await.map(|()| Next::Round)?,
                Due::File(output) => {
                    let file = (output, files.get(output));
                    self.make(animator, &observation, &known, file, &mut tally).await?
                }
            };
            if next == Next::End && tally.lease.is_none() && observation.has_lease {
                // An earlier attempt at the same event died with it, or no attempt has resumed it.
                tally.lease = self.reclaim_lease(animation).await?;
                if tally.lease.is_some_and(|held| held.has_checkpoint) {
                    // The GIF may have been another one when it was handed over, since this round looked.
                    continue;
                }
            }
            match next {
                Next::Round => {}
                Next::Leave => return Ok(tally.of(&observed.head)),
                Next::End => {
                    let Some(mut held) = tally.lease.take() else { return Ok(tally.of(&observed.head)) };
                    self.give_up_lease(&observed.head, &mut held).await?;
                    if self.breaks(Mutation::AssemblerDoesNotLookAgain) {
                        return Ok(tally.of(&observed.head));
                    }
                    // The assembler that found the lease taken was woken for a manifest that was written before, and
                    // may have deleted the GIF before, which was there when this round looked.
                    let manifest = self.head(&animation.manifest()).await?.map(|info| info.etag);
                    if manifest == Some(known.etag) {
                        let mut now = Outputs::default();
                        self.look_at_outputs(animation, &files.looked_at(), &mut now).await?;
                        if now.are(&files) {
                            return Ok(tally.of(&observed.head));
                        }
                    }
                }
                Next::HandOver => {
                    if let Some(held) = tally.lease.take() {
                        self.hand_over_lease(animation, &held).await?;
                    }
                    self.claim(&known.manifest).await?;
                    return Ok(tally.of(&observed.head));
                }
            }
        }
    }

    /// Deletes everything that is left of an animation that is gone, including the manifest, and writes nothing.
    /// Returns whether anything was left.
    async fn clear(
        &self,
        animation: &Animation,
        files: &Outputs,
        observation: &Observation,
        tally: &mut Tally,
    ) -> Result<bool> {
        for output in files.existing() {
            self.delete(&animation.output(output)).await?;
        }
        let had_files = files.existing().next().is_some();
        if tally.lease.is_none() && observation.has_lease {
            tally.lease = self.reclaim_lease(animation).await?;
        }
        let Some(mut held) = tally.lease.take() else { return Ok(had_files) };
        self.give_up_lease(&observation.manifest.head, &mut held).await?;
        Ok(true)
    }

    /// Releases the lease, and deletes the unfinished file that no assembler will continue.
    async fn give_up_lease(&self, head: &Head, held: &mut HeldLease) -> Result<()> {
        self.abandon_checkpoint(head, held).await?;
        self.release_lease(&head.animation).await
    }

    /// Waits until the set is settled, or builds a file of it, unless another assembler does.
    async fn make<A: Animator>(
        &self,
        animator: &A,
        observation: &Observation,
        known: &Known,
        (output, there): (Container, Option<&ObjectInfo>),
        tally: &mut Tally,
    ) -> Result<Next> {
        let observed = &observation.manifest;
        if tally.lease.is_none() {
            tally.lease = self.take_lease(&observed.head.animation).await?;
        }
        let Some(held) = &mut tally.lease else { return Ok(Next::Leave) };
        let changed =
            last_change(&observed.head, observation.newest_script(), known.manifest.head.removed_at);
        let wait = changed
            .map_or(Duration::ZERO, |changed| tally.quiet.left(self.policy.quiet, changed, self.clock.now()));
        if wait > Duration::ZERO {
            if self.is_out_of_time_in(wait) {
                return Ok(Next::HandOver);
            }
            self.clock.sleep(wait).await;
            tally.waited += wait;
            return Ok(Next::Round);
        }
        // Another file is begun only with as much time as the others took: it may need most of an invocation.
        if tally.built > 0 && self.is_out_of_time_in(self.clock.now().since(tally.began)) {
            return Ok(Next::HandOver);
        }
        if output != Container::Gif && !observation.marked.contains(&output) {
            let mark = Key::OutputMark { animation: observed.head.animation.clone(), output };
            self.put_receipt(&mark.to_string(), Bytes::from_static(b"{}"), "application/json").await?;
        }
        let start = self.clock.now();
        let built = self.build(animator, observed, (output, there), tally.began, held).await?;
        tally.building += self.clock.now().since(start);
        match built {
            Built::Put(version) => {
                // If this fails, the next round writes it down.
                self.record_files(known, vec![(output, version)]).await?;
                tally.built += 1;
                tally.frames = observed.head.total;
                if self.breaks(Mutation::AssemblerDoesNotLookAgain) {
                    return Ok(Next::End);
                }
            }
            Built::Left(frames) => {
                tally.left_after = Some(frames);
                return Ok(Next::HandOver);
            }
            Built::Stale => {}
            Built::Corrupt(frame, reason) => self.draw_anew(observation, frame, &reason).await?,
            Built::Refused(reason) => self.refuse(observed, output, &reason).await?,
        }
        Ok(Next::Round)
    }

    /// Triggers the drawing of a frame that cannot be read. After a limited number of attempts the frame gets an error
    /// receipt.
    async fn draw_anew(&self, observation: &Observation, frame: &Frame, reason: &Reason) -> Result<()> {
        let animation = &observation.manifest.head.animation;
        let Some(key) = frame_key(animation, frame) else { return Ok(()) };
        let wakings = self.wakings(animation, observation).await?;
        let subject = (frame.script.clone(), frame.version.clone(), frame.part);
        let WakeCount { attempts, begun, .. } = wakings.get(&subject).copied().unwrap_or_default();
        self.delete(&key).await?;
        let tag = Tag { version: frame.version.clone(), pixels: self.policy.pixels };
        if begun >= self.policy.attempts {
            let why =
                Reason::new(format!("{key} is no frame, though drawn {begun} times: {}", reason.message));
            return self.put_fault(animation, &frame.script, &tag, frame.part, &why).await.map(drop);
        }
        self.put_retry(animation, &frame.script, tag, frame.part, attempts + 1).await
    }

    /// Records that this generation gives no such file.
    pub(crate) async fn refuse(&self, manifest: &Manifest, output: Container, reason: &Reason) -> Result<()> {
        let generation = manifest.head.generation.clone();
        let key = manifest.head.animation.receipt(&Receipt::Refusal { generation, output });
        let mut reason = reason.clone();
        if manifest.head.outputs() != [Container::Gif] {
            reason.message = format!("{}: {}", output.name(), reason.message);
        }
        let body = serde_json::to_vec(&reason)
            .map_err(|source| Error::Malformed { key: key.clone(), source: source.into() })?;
        self.put_receipt(&key, body.into(), "application/json").await.map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::Settings;
    use crate::reconcile::{Results, Scripts, reconcile};

    fn head(status: Status) -> Head {
        let animation = Animation::new("film").unwrap();
        let manifest = reconcile(&animation, &Scripts::default(), &Results::default(), &Settings::absent());
        Head { status, total: 9, ..manifest.head }
    }

    #[test]
    fn quiet_is_waited_for_once_whatever_the_clocks_say() {
        let (period, mut quiet) = (Duration::from_secs(5), Quiet::default());
        let second = |seconds: u64| Timestamp(seconds * 1_000);
        assert_eq!(quiet.left(period, second(10), second(12)), Duration::from_secs(3));
        // The store's clock runs ahead of this one's: the time that was slept through counts.
        assert_eq!(quiet.left(period, second(10), second(9)), Duration::from_secs(2));
        assert_eq!(quiet.left(period, second(10), second(9)), Duration::ZERO);
        // A newer script: all over again.
        assert_eq!(quiet.left(period, second(14), second(15)), Duration::from_secs(4));
        assert_eq!(Quiet::default().left(period, second(10), second(15)), Duration::ZERO);
    }

    #[test]
    fn a_set_is_settled_when_it_is_just_what_was_announced_or_quiet() {
        let (script, removal) = (Some(Timestamp(7)), Some(Timestamp(8)));
        let changed = |frames: Option<u64>, removed_at| {
            let value = AnimationSettings::new(frames, 10.0, 0).ok();
            let settings = Settings { version: None, value, fault: None };
            last_change(&Head { settings, ..head(Status::Done) }, script, removed_at)
        };
        assert_eq!(changed(None, None), script);
        assert_eq!(changed(None, removal), removal);
        assert_eq!(changed(None, Some(Timestamp(6))), script);
        assert_eq!(changed(Some(9), removal), None, "nine frames are announced, and there");
        assert_eq!(changed(Some(8), None), script);
        assert_eq!(changed(Some(8), removal), removal);
    }
}
