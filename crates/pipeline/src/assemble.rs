//! The assembler makes the bucket agree with itself, whichever claim woke it.
//!
//! Each round reads the manifest and the GIF's version and generation, and lists, in this order. Then it does what is
//! due: it commits the manifest where it differs (without a claim: the assembler is here already), builds the GIF of
//! a set that is done and settled, removes the GIF of a set that can have none. The assembler ends only on a round
//! that wrote nothing, so that no GIF from an older listing stays, and no set that became whole while it worked is
//! left. An assembler that waits or builds holds the animation's lease; another assembler that finds it taken leaves
//! all to its holder.
//!
//! If a GIF does not fit the time of one invocation, the next invocation continues it (`build`).

use std::time::Duration;

use rayfold_scene::AnimationSettings;

use crate::animator::Animator;
use crate::build::Built;
use crate::invocation::{Invocation, Known, Mutation};
use crate::keys::{Animation, Generation, Key, Receipt, Tag};
use crate::lease::HeldLease;
use crate::manifest::{Frame, Head, Manifest, Reason, Status};
use crate::observe::Observation;
use crate::store::{ETag, ObjectInfo, Store};
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
    /// Its generation in the last round.
    pub generation: Generation,
    /// Rounds, the last of which wrote nothing.
    pub rounds: u32,
    /// The number of GIFs that were written.
    pub built: u32,
    /// Frames of the last GIF that was written.
    pub frames: u64,
    /// Frames of a GIF that was left unfinished to the next invocation.
    pub left_after: Option<u64>,
    /// Waiting for uploads to settle.
    pub waited: Duration,
    /// The time spent on building GIFs.
    pub building: Duration,
}

/// Works on one claim, given its key; `None` if another assembler is at the animation, who will look at it once more.
///
/// # Errors
///
/// [`Error::Key`] for a key that is no claim: nothing was done, and a retry would not help. Others are the store's:
/// the platform should try again.
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

/// The action that is due for the GIF of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Due {
    /// It is as it should be, or more is to come.
    Nothing,
    /// It is to be built.
    Gif,
    /// It is to go.
    NoGif,
}

/// Returns the action that is due for the GIF of the set that the manifest's head stands for.
pub(crate) fn due(head: &Head, gif: Option<&ObjectInfo>) -> Due {
    match head.status {
        Status::Done if !is_current(head, gif) => Due::Gif,
        Status::Empty | Status::Failed | Status::Refused if gif.is_some() => Due::NoGif,
        Status::Done | Status::Empty | Status::Failed | Status::Refused => Due::Nothing,
        // While more is to come the last GIF stays.
        Status::Waiting | Status::Rendering => Due::Nothing,
    }
}

/// Returns the version of this set's GIF, if the manifest does not record it yet.
pub(crate) fn new_gif(head: &Head, gif: Option<&ObjectInfo>) -> Option<ETag> {
    let is_new = head.status == Status::Done && head.gif_version().is_none() && is_current(head, gif);
    gif.filter(|_| is_new).map(|gif| gif.etag.clone())
}

/// The end of a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    /// Something was written or waited for: look again.
    Round,
    /// There is nothing to do.
    End,
    /// Another assembler does it: this one has no say in its lease.
    Leave,
    /// The set does not settle in this invocation's time, or its GIF is not finished in it: wake the next one.
    HandOver,
}

/// When the set of scripts last changed; `None` when it is settled: when there are just as many frames as
/// `animation.json` says.
fn last_change(
    head: &Head,
    newest_script: Option<Timestamp>,
    removed_at: Option<Timestamp>,
) -> Option<Timestamp> {
    let expected = head.settings.value.as_ref().and_then(AnimationSettings::frames);
    newest_script.max(removed_at).filter(|_| expected != Some(head.total))
}

/// Quiet that has been waited for.
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
        let (left_after, lease) = (None, None);
        Tally { began, quiet, rounds: 0, built: 0, frames: 0, left_after, waited, building, lease }
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
            self.forget_history_before(&(&tally.quiet, tally.lease));
            let known = self.manifest(animation).await?;
            let gif = self.head(&animation.gif()).await?;
            let seen = gif.as_ref().map(|gif| gif.etag.clone());
            let observation = self.observe(animation, known.as_ref()).await?;
            let observed = &observation.manifest;
            self.forget_history_before(&(&tally.quiet, tally.lease, &known, &gif, &observation));
            if known.is_none() && observation.is_of_nothing() {
                if self.clear(animation, gif.is_some(), &observation, &mut tally).await? {
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
            let known = match new_gif(&known.manifest.head, gif.as_ref()) {
                Some(version) => match self.record_gif(&known, version).await? {
                    Some(known) => known,
                    None => continue,
                },
                None => known,
            };
            let leaves_early = self.breaks(Mutation::AssemblerLeavesEarly) && !observed.head.is_terminal();
            let next = match due(&known.manifest.head, gif.as_ref()) {
                Due::Nothing if agrees || leaves_early => Next::End,
                Due::Nothing => Next::Round,
                Due::NoGif => self.delete(&animation.gif()).await.map(|()| Next::Round)?,
                Due::Gif => self.make_gif(animator, &observation, &known, gif, &mut tally).await?,
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
                    let etag = |info: Option<ObjectInfo>| info.map(|info| info.etag);
                    let manifest = etag(self.head(&animation.manifest()).await?);
                    if manifest == Some(known.etag) && etag(self.head(&animation.gif()).await?) == seen {
                        return Ok(tally.of(&observed.head));
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

    /// Deletes what is left of an animation that is gone, manifest and all, and writes nothing. Returns
    /// whether anything was left.
    async fn clear(
        &self,
        animation: &Animation,
        has_gif: bool,
        observation: &Observation,
        tally: &mut Tally,
    ) -> Result<bool> {
        if has_gif {
            self.delete(&animation.gif()).await?;
        }
        if tally.lease.is_none() && observation.has_lease {
            tally.lease = self.reclaim_lease(animation).await?;
        }
        let Some(mut held) = tally.lease.take() else { return Ok(has_gif) };
        self.give_up_lease(&observation.manifest.head, &mut held).await?;
        Ok(true)
    }

    /// Gives the lease back, and with it the GIF that no assembler will go on with.
    async fn give_up_lease(&self, head: &Head, held: &mut HeldLease) -> Result<()> {
        self.abandon_checkpoint(head, held).await?;
        self.release_lease(&head.animation).await
    }

    /// Waits until the set is settled, or builds its GIF, unless another assembler does.
    async fn make_gif<A: Animator>(
        &self,
        animator: &A,
        observation: &Observation,
        known: &Known,
        gif: Option<ObjectInfo>,
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
        let start = self.clock.now();
        let built = self.build(animator, observed, gif, tally.began, held).await?;
        tally.building += self.clock.now().since(start);
        match built {
            Built::Put(version) => {
                // If this fails, the next round writes it down.
                self.record_gif(known, version).await?;
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
            Built::Refused(reason) => self.refuse(observed, &reason).await?,
        }
        Ok(Next::Round)
    }

    /// Has a frame drawn again that cannot be read; after a bounded number of attempts it gets an error receipt.
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

    /// Writes down that this generation gives no GIF.
    pub(crate) async fn refuse(&self, manifest: &Manifest, reason: &Reason) -> Result<()> {
        let generation = manifest.head.generation.clone();
        let key = manifest.head.animation.receipt(&Receipt::Refusal { generation });
        let body = serde_json::to_vec(reason)
            .map_err(|source| Error::Malformed { key: key.clone(), source: source.into() })?;
        self.put_receipt(&key, body.into(), "application/json").await.map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::Settings;
    use crate::reconcile::{Results, Scripts, reconcile};
    use crate::store::Metadata;

    fn head(status: Status) -> Head {
        let animation = Animation::new("film").unwrap();
        let manifest = reconcile(&animation, &Scripts::default(), &Results::default(), &Settings::absent());
        Head { status, total: 9, ..manifest.head }
    }

    fn gif(generation: Option<&str>) -> ObjectInfo {
        let metadata = generation.map(|generation| (GENERATION.to_owned(), generation.to_owned()));
        let metadata: Metadata = metadata.into_iter().collect();
        ObjectInfo { etag: ETag::new("e"), size: 1, modified: Timestamp(0), metadata }
    }

    #[test]
    fn what_is_due_follows_from_the_status_and_the_gifs_generation() {
        let current = gif(Some(head(Status::Done).generation.as_str()));
        let older = gif(Some("another"));
        let unknown = gif(None);
        let gifs = [None, Some(&current), Some(&older), Some(&unknown)];
        for (status, expected) in [
            (Status::Done, [Due::Gif, Due::Nothing, Due::Gif, Due::Gif]),
            (Status::Empty, [Due::Nothing, Due::NoGif, Due::NoGif, Due::NoGif]),
            (Status::Failed, [Due::Nothing, Due::NoGif, Due::NoGif, Due::NoGif]),
            (Status::Refused, [Due::Nothing, Due::NoGif, Due::NoGif, Due::NoGif]),
            (Status::Waiting, [Due::Nothing; 4]),
            (Status::Rendering, [Due::Nothing; 4]),
        ] {
            assert_eq!(gifs.map(|gif| due(&head(status), gif)), expected, "{status:?}");
        }
    }

    /// One of another set, or that was named already, or of a set that is not whole, is not.
    #[test]
    fn a_gif_is_new_that_is_of_this_set_and_not_written_down() {
        let generation = head(Status::Done).generation;
        let this = gif(Some(generation.as_str()));
        let named = |version: &str| {
            Some(crate::manifest::Gif { generation: generation.clone(), version: ETag::new(version) })
        };
        for (status, named, gif, expected) in [
            (Status::Done, None, Some(&this), Some(ETag::new("e"))),
            (Status::Done, None, None, None),
            (Status::Done, None, Some(&gif(Some("another"))), None),
            (Status::Done, named("e"), Some(&this), None),
            (Status::Done, named("f"), Some(&this), None),
            (Status::Rendering, None, Some(&this), None),
        ] {
            let head = Head { gif: named, ..head(status) };
            assert_eq!(new_gif(&head, gif), expected, "{status:?} {head:?}");
        }
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
