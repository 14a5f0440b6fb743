//! The assembler makes the bucket agree with itself, whichever claim woke it.
//!
//! Each round reads the manifest, the GIF's version and generation, and lists, in this order; then it does what is due:
//! commits the manifest where it differs (without a claim: the assembler is here already), builds the GIF of a set
//! that is done and settled, removes the GIF of a set that can have none. It ends only on a round that wrote nothing,
//! so that no GIF from an older listing stays, and no set that became whole while it worked is left. Whoever waits or builds
//! holds the animation's lease; another assembler that finds it taken leaves the GIF to its holder.
//!
//! Memory does not grow with the number of frames: they are fetched a few ahead of the encoder, and what it writes goes
//! out piece by piece.

use std::future::Future;
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream::{self, StreamExt};
use rayfold_scene::AnimationSettings;

use crate::invocation::{Invocation, Known, Mutation};
use crate::keys::{Animation, Generation, Key, Receipt, Tag};
use crate::manifest::{Frame, FrameState, Head, Manifest, Reason, Status};
use crate::observe::Observation;
use crate::store::{Condition, ObjectInfo, PutOptions, Store, Upload};
use crate::wakings::Wakings;
use crate::{Clock, Error, Result, Timestamp};

/// The name of the GIF's metadata that holds its generation.
pub const GENERATION: &str = "generation";

/// What encodes. The assemble function brings a GIF encoder, the simulation something smaller.
pub trait Animator: Send + Sync {
    /// An animation being encoded.
    type Encoding: Encoding;

    /// Starts an animation; the reason when it cannot be.
    fn begin(&self, settings: &AnimationSettings) -> Result<Self::Encoding, Reason>;
}

/// An animation being encoded: frames in, pieces of the file out.
pub trait Encoding: Send {
    /// Adds the next frame, a PNG, and gives what of the file is ready.
    ///
    /// # Errors
    ///
    /// What is wrong with this frame, or with all of them together.
    fn push(&mut self, frame: Bytes) -> impl Future<Output = Result<Bytes, Unfit>> + Send;

    /// Gives the rest of the file.
    ///
    /// # Errors
    ///
    /// The reason why these frames make no animation; it would be the same next time.
    fn finish(self) -> impl Future<Output = Result<Bytes, Reason>> + Send;
}

/// Why a frame cannot be added to an animation.
#[derive(Debug, Clone, PartialEq)]
pub enum Unfit {
    /// The frame is none: someone has put something else in its place. Drawn again it may be one.
    Corrupt(Reason),
    /// The frame does not go with the others; it would be the same next time.
    Unlike(Reason),
}

/// What an invocation of the assembler did.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembled {
    /// The animation.
    pub animation: Animation,
    /// Where it stood in the last round.
    pub status: Status,
    /// Its generation in the last round.
    pub generation: Generation,
    /// Rounds, the last of which wrote nothing.
    pub rounds: u32,
    /// GIFs written.
    pub built: u32,
    /// Frames of the last GIF that was written.
    pub frames: u64,
    /// Waiting for uploads to settle.
    pub waited: Duration,
    /// Building GIFs.
    pub building: Duration,
}

/// Works on one claim, given its key.
///
/// # Errors
///
/// [`Error::Key`] for a key that is no claim: nothing was done, and a retry would not help. Others are the store's:
/// the platform should try again.
pub async fn assemble<S: Store, C: Clock, A: Animator>(
    invocation: &Invocation<'_, S, C>,
    animator: &A,
    key: &str,
) -> Result<Assembled> {
    match key.parse()? {
        Key::Claim { animation, .. } => invocation.assemble(animator, &animation).await,
        _ => Err(Error::key(key, "this key is no claim")),
    }
}

/// What is to be done about the GIF of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Due {
    /// It is as it should be, or more is to come.
    Nothing,
    /// It is to be built.
    Gif,
    /// It is to go.
    NoGif,
}

/// What is to be done about the GIF of a set that the manifest's head stands for.
pub(crate) fn due(head: &Head, gif: Option<&ObjectInfo>) -> Due {
    match head.status {
        Status::Done if generation_of(gif) != Some(head.generation.as_str()) => Due::Gif,
        Status::Empty | Status::Failed | Status::Refused if gif.is_some() => Due::NoGif,
        Status::Done | Status::Empty | Status::Failed | Status::Refused => Due::Nothing,
        // While more is to come the last GIF stays.
        Status::Waiting | Status::Rendering => Due::Nothing,
    }
}

/// How a build ended.
enum Built<'a> {
    /// The GIF is put.
    Put,
    /// A frame is gone, or someone else's GIF came first: look again.
    Stale,
    /// This frame cannot be read.
    Corrupt(&'a Frame, Reason),
    /// These frames make no GIF.
    Refused(Reason),
}

/// How a round ended.
enum Next {
    /// Something was written or waited for: look again.
    Round,
    /// There is nothing to do, or another assembler does it.
    End,
    /// The set does not settle in this invocation's time: wake the next one.
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
#[derive(Default)]
struct Quiet {
    since: Option<Timestamp>,
    waited: Duration,
}

/// What the rounds of an invocation have come to.
struct Tally {
    began: Timestamp,
    quiet: Quiet,
    rounds: u32,
    built: u32,
    frames: u64,
    waited: Duration,
    building: Duration,
    holds_lease: bool,
}

impl Quiet {
    /// How long to wait until the last change is a quiet period old. The clock that dated it may run ahead of this one,
    /// so a period that was slept through counts as well.
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
        Tally { began, quiet, rounds: 0, built: 0, frames: 0, waited, building, holds_lease: false }
    }

    fn of(self, head: &Head) -> Assembled {
        let Tally { rounds, built, frames, waited, building, .. } = self;
        let (animation, status, generation) = (head.animation.clone(), head.status, head.generation.clone());
        Assembled { animation, status, generation, rounds, built, frames, waited, building }
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    async fn assemble<A: Animator>(&self, animator: &A, animation: &Animation) -> Result<Assembled> {
        let mut tally = Tally::new(self.clock.now());
        loop {
            tally.rounds += 1;
            let known = self.manifest(animation).await?;
            let gif = self.head(&animation.gif()).await?;
            let observation = self.observe(animation, known.as_ref()).await?;
            let observed = &observation.manifest;
            let (known, agrees) = match known {
                Some(known) if known.manifest.agrees_with(observed) => (known, true),
                known => match self.commit(animation, known.as_ref(), observed.clone()).await? {
                    Some(known) => (known, false),
                    None => continue,
                },
            };
            let leaves_early = self.breaks(Mutation::AssemblerLeavesEarly) && !observed.head.is_terminal();
            let next = match due(&observed.head, gif.as_ref()) {
                Due::Nothing if agrees || leaves_early => Next::End,
                Due::Nothing => Next::Round,
                Due::NoGif => self.delete(&animation.gif()).await.map(|()| Next::Round)?,
                Due::Gif => self.make_gif(animator, &observation, &known, gif, &mut tally).await?,
            };
            match next {
                Next::Round => {}
                Next::End if tally.holds_lease || self.left_lease(&observation).await? => {
                    tally.holds_lease = false;
                    self.release_lease(animation).await?;
                    // Whoever found the lease taken was woken for a manifest that was written before.
                    let now = self.head(&animation.manifest()).await?;
                    let is_blind = self.breaks(Mutation::AssemblerDoesNotLookAgain);
                    if is_blind || now.is_some_and(|now| now.etag == known.etag) {
                        return Ok(tally.of(&observed.head));
                    }
                }
                Next::End => return Ok(tally.of(&observed.head)),
                Next::HandOver => {
                    self.release_lease(animation).await?;
                    self.claim(&known.manifest).await?;
                    return Ok(tally.of(&observed.head));
                }
            }
        }
    }

    /// Whether an earlier attempt at the same event died with the lease.
    async fn left_lease(&self, observation: &Observation) -> Result<bool> {
        Ok(observation.has_lease && self.holds_lease(&observation.manifest.head.animation).await?)
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
        tally.holds_lease = tally.holds_lease || self.take_lease(&observed.head.animation).await?;
        if !tally.holds_lease {
            return Ok(Next::End);
        }
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
        let built = self.build(animator, observed, gif, tally.began).await?;
        tally.building += self.clock.now().since(start);
        match built {
            Built::Put => {
                tally.built += 1;
                tally.frames = observed.head.total;
                if self.breaks(Mutation::AssemblerDoesNotLookAgain) {
                    return Ok(Next::End);
                }
            }
            Built::Stale => {}
            Built::Corrupt(frame, reason) => self.draw_anew(observation, frame, &reason).await?,
            Built::Refused(reason) => self.refuse(observed, &reason).await?,
        }
        Ok(Next::Round)
    }

    /// Writes the GIF of a manifest that is done over the version that was there, or fails to.
    async fn build<'m, A: Animator>(
        &self,
        animator: &A,
        manifest: &'m Manifest,
        gif: Option<ObjectInfo>,
        began: Timestamp,
    ) -> Result<Built<'m>> {
        let head = &manifest.head;
        let animation = &head.animation;
        let mut encoding = match animator.begin(&head.settings.value.unwrap_or_default()) {
            Ok(encoding) => encoding,
            Err(reason) => return Ok(Built::Refused(reason)),
        };
        let condition = match gif {
            _ if self.breaks(Mutation::DropGifCondition) => Condition::Always,
            None => Condition::IfAbsent,
            Some(gif) => Condition::IfMatch(gif.etag),
        };
        let options = PutOptions { condition, ..PutOptions::always() }
            .content_type("image/gif")
            .metadata(GENERATION, head.generation.as_str());
        let mut upload = self.store.upload(&animation.gif(), options).await?;
        let rest = match self.encode(&mut encoding, manifest, &mut upload, began).await {
            Ok(None) => encoding.finish().await,
            Ok(Some(Built::Refused(reason))) => Err(reason),
            Ok(Some(ended)) => {
                upload.abort().await?;
                return Ok(ended);
            }
            Err(error) => {
                upload.abort().await?;
                return Err(error);
            }
        };
        match rest {
            Err(reason) => {
                upload.abort().await?;
                Ok(Built::Refused(reason))
            }
            Ok(rest) => {
                upload.write(rest).await?;
                match upload.finish().await {
                    Ok(_) => Ok(Built::Put),
                    Err(error) if error.is_conflict() || error.is_not_found() || error.is_retryable() => {
                        Ok(Built::Stale)
                    }
                    Err(error) => Err(error),
                }
            }
        }
    }

    /// Fetches the frames, a few ahead of the encoder, and sends what it writes; says why, if it does not come to the
    /// end.
    async fn encode<'m, E: Encoding, U: Upload>(
        &self,
        encoding: &mut E,
        manifest: &'m Manifest,
        upload: &mut U,
        began: Timestamp,
    ) -> Result<Option<Built<'m>>> {
        let animation = &manifest.head.animation;
        let keys = manifest.frames.iter().filter_map(|frame| Some((frame, frame_key(animation, frame)?)));
        let fetches: Vec<_> =
            keys.map(|(frame, key)| async move { Ok::<_, Error>((frame, self.get(&key).await?)) }).collect();
        let mut images = stream::iter(fetches).buffered(self.policy.prefetch);
        let start = self.clock.now();
        let mut pushed = 0_u64;
        while let Some(image) = images.next().await {
            let (frame, Some(image)) = image? else { return Ok(Some(Built::Stale)) };
            match encoding.push(image.body).await {
                Ok(piece) if piece.is_empty() => {}
                Ok(piece) => upload.write(piece).await?,
                Err(Unfit::Corrupt(reason)) => return Ok(Some(Built::Corrupt(frame, reason))),
                Err(Unfit::Unlike(reason)) => return Ok(Some(Built::Refused(reason))),
            }
            pushed += 1;
            if self.is_out_of_time() {
                let (before, building) = (start.since(began), self.clock.now().since(start));
                return out_of_time(&manifest.head, pushed, before, building)
                    .map(|reason| Some(Built::Refused(reason)));
            }
        }
        Ok(None)
    }

    fn is_out_of_time(&self) -> bool {
        self.is_out_of_time_in(Duration::ZERO)
    }

    /// Whether no time will be left to go on after `wait`.
    fn is_out_of_time_in(&self, wait: Duration) -> bool {
        let then = self.clock.now().after(wait).after(self.policy.margin);
        self.deadline.is_some_and(|deadline| then >= deadline)
    }

    /// Has a frame drawn again that cannot be read; after a bounded number of attempts it gets an error receipt.
    async fn draw_anew(&self, observation: &Observation, frame: &Frame, reason: &Reason) -> Result<()> {
        let animation = &observation.manifest.head.animation;
        let Some(key) = frame_key(animation, frame) else { return Ok(()) };
        let wakings = self.wakings(animation, observation).await?;
        let subject = (frame.script.clone(), frame.version.clone(), frame.part);
        let Wakings { attempts, begun, .. } = wakings.get(&subject).copied().unwrap_or_default();
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

/// The key of a frame that is drawn.
pub fn frame_key(animation: &Animation, frame: &Frame) -> Option<String> {
    let FrameState::Done { pixels } = frame.state else { return None };
    let (name, version) = (frame.script.clone(), frame.version.clone());
    Some(animation.receipt(&Receipt::Frame { name, tag: Tag { version, pixels }, part: frame.part }))
}

/// The generation that a GIF was made of.
pub fn generation_of(gif: Option<&ObjectInfo>) -> Option<&str> {
    gif?.metadata.get(GENERATION).map(String::as_str)
}

/// What a build that has come to the end of its time means. A set that cannot be assembled in the function's time is
/// refused, but only by an invocation that had most of its time for that; one that spent more `before`, waiting and
/// building other sets, leaves it to its next attempt.
fn out_of_time(head: &Head, pushed: u64, before: Duration, building: Duration) -> Result<Reason> {
    if before > building {
        let what = format!("{} became whole too late to assemble it", head.animation);
        return Err(Error::OutOfTime { what });
    }
    let (total, seconds) = (head.total, building.as_secs());
    Ok(Reason::new(format!(
        "{pushed} of {total} frames were assembled in the {seconds} s that the assemble function had: give it more \
         time or memory and retry, or fetch the frames and assemble them locally"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::Settings;
    use crate::reconcile::{Results, Scripts, reconcile};
    use crate::store::{ETag, Metadata};

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

    #[test]
    fn quiet_is_waited_for_once_whatever_the_clocks_say() {
        let (period, mut quiet) = (Duration::from_secs(5), Quiet::default());
        let second = |seconds: u64| Timestamp(seconds * 1_000);
        assert_eq!(quiet.left(period, second(10), second(12)), Duration::from_secs(3));
        // The store's clock runs ahead of this one's: what was slept through counts.
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

    #[test]
    fn only_whoever_had_most_of_its_time_for_a_set_refuses_it() {
        let head = head(Status::Done);
        let (short, long) = (Duration::from_secs(10), Duration::from_secs(20));
        assert!(matches!(out_of_time(&head, 3, long, short), Err(Error::OutOfTime { .. })));
        let reason = out_of_time(&head, 3, short, long).unwrap();
        assert!(reason.message.starts_with("3 of 9 frames were assembled in the 20 s"), "{}", reason.message);
        assert!(out_of_time(&head, 3, short, short).is_ok());
    }
}
