//! The assembler makes the bucket agree with itself, whichever claim woke it.
//!
//! Each round reads the manifest, the GIF's version and generation, and lists, in this order; then it does what is due:
//! commits the manifest where it differs (without a claim: the assembler is here already), builds the GIF of a set
//! that is done and settled, removes the GIF of a set that can have none. It ends only on a round that wrote nothing,
//! so that no GIF from an older listing stays, and no set that became whole while it worked is left.
//!
//! Memory does not grow with the number of frames: they are fetched a few ahead of the encoder, and what it writes goes
//! out piece by piece.

use std::future::Future;
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream::{self, StreamExt};
use rayfold_scene::AnimationSettings;

use crate::invocation::{Invocation, Mutation};
use crate::keys::{Animation, Generation, Key, Receipt, Tag};
use crate::manifest::{Frame, FrameState, Manifest, Reason, Status};
use crate::observe::Observation;
use crate::store::{Condition, ObjectInfo, PutOptions, Store, Upload};
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
    /// The reason why these frames make no animation; it would be the same next time.
    fn push(&mut self, frame: Bytes) -> impl Future<Output = Result<Bytes, Reason>> + Send;

    /// Gives the rest of the file.
    ///
    /// # Errors
    ///
    /// As for [`push`](Encoding::push).
    fn finish(self) -> impl Future<Output = Result<Bytes, Reason>> + Send;
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

/// How a build ended.
enum Built {
    /// The GIF is put.
    Put,
    /// A frame is gone, or someone else's GIF came first: look again.
    Stale,
    /// These frames make no GIF.
    Refused(Reason),
}

/// Quiet that has been waited for.
#[derive(Default)]
struct Quiet {
    newest: Option<Timestamp>,
    waited: Duration,
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    async fn assemble<A: Animator>(&self, animator: &A, animation: &Animation) -> Result<Assembled> {
        let mut quiet = Quiet::default();
        let (mut rounds, mut built, mut frames) = (0, 0, 0);
        let (mut waited, mut building) = (Duration::ZERO, Duration::ZERO);
        let began = self.clock.now();
        loop {
            rounds += 1;
            let known = self.manifest(animation).await?;
            let gif = self.head(&animation.gif()).await?;
            let observation = self.observe(animation, known.as_ref()).await?;
            let observed = &observation.manifest;
            let mut wrote = false;
            if !known.as_ref().is_some_and(|known| known.manifest.agrees_with(observed)) {
                wrote = true;
                if self.commit(animation, known.as_ref(), observed.clone()).await?.is_none() {
                    continue;
                }
            }
            let head = &observed.head;
            match head.status {
                Status::Done if generation_of(gif.as_ref()) != Some(head.generation.as_str()) => {
                    wrote = true;
                    let wait = self.unsettled(&observation, &mut quiet);
                    if wait > Duration::ZERO {
                        self.clock.sleep(wait).await;
                        waited += wait;
                        continue;
                    }
                    let start = self.clock.now();
                    match self.build(animator, observed, gif, began).await? {
                        Built::Put => {
                            built += 1;
                            frames = head.total;
                            wrote = !self.breaks(Mutation::AssemblerDoesNotLookAgain);
                        }
                        Built::Stale => {}
                        Built::Refused(reason) => self.refuse(observed, &reason).await?,
                    }
                    building += self.clock.now().since(start);
                }
                Status::Empty | Status::Failed | Status::Refused if gif.is_some() => {
                    self.delete(&animation.gif()).await?;
                    wrote = true;
                }
                Status::Waiting | Status::Rendering if self.breaks(Mutation::AssemblerLeavesEarly) => {
                    wrote = false;
                }
                _ => {}
            }
            if !wrote {
                let (status, generation) = (head.status, head.generation.clone());
                let animation = animation.clone();
                return Ok(Assembled {
                    animation,
                    status,
                    generation,
                    rounds,
                    built,
                    frames,
                    waited,
                    building,
                });
            }
        }
    }

    /// How long to wait until the newest script is a quiet period old; zero when it is, or when `animation.json` says
    /// how many frames to wait for.
    ///
    /// A store's clock may run ahead of this one's, so a period that was slept through counts as well.
    fn unsettled(&self, observation: &Observation, quiet: &mut Quiet) -> Duration {
        let expects =
            observation.manifest.head.settings.value.as_ref().and_then(|settings| settings.frames());
        let Some(newest) = observation.newest_script().filter(|_| expects.is_none()) else {
            return Duration::ZERO;
        };
        if quiet.newest != Some(newest) {
            *quiet = Quiet { newest: Some(newest), waited: Duration::ZERO };
        }
        let wait = self.policy.quiet.saturating_sub(self.clock.now().since(newest).max(quiet.waited));
        quiet.waited += wait;
        wait
    }

    /// Writes the GIF of a manifest that is done over the version that was there, or fails to.
    ///
    /// A set that cannot be assembled in the function's time is refused, but only by an invocation that had most of its
    /// time for that; one that `began` long before, and has waited and built other sets since, leaves it to its next
    /// attempt.
    async fn build<A: Animator>(
        &self,
        animator: &A,
        manifest: &Manifest,
        gif: Option<ObjectInfo>,
        began: Timestamp,
    ) -> Result<Built> {
        let head = &manifest.head;
        let animation = &head.animation;
        let settings = head.settings.value.unwrap_or_default();
        let mut encoding = match animator.begin(&settings) {
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
        let keys: Vec<String> =
            manifest.frames.iter().filter_map(|frame| frame_key(animation, frame)).collect();
        let fetches = keys.into_iter().map(|key| async move { self.get(&key).await });
        let mut images = stream::iter(fetches).buffered(self.policy.prefetch);
        let start = self.clock.now();
        let mut pushed = 0_u64;
        let refusal = loop {
            let Some(image) = images.next().await else { break None };
            let image = match image {
                Ok(Some(image)) => image,
                Ok(None) => {
                    upload.abort().await?;
                    return Ok(Built::Stale);
                }
                Err(error) => {
                    upload.abort().await?;
                    return Err(error);
                }
            };
            match encoding.push(image.body).await {
                Ok(piece) if piece.is_empty() => {}
                Ok(piece) => upload.write(piece).await?,
                Err(reason) => break Some(reason),
            }
            pushed += 1;
            if self.is_out_of_time() {
                if start.since(began) > self.clock.now().since(start) {
                    upload.abort().await?;
                    return Err(Error::OutOfTime {
                        what: format!("{animation} became whole too late to assemble it"),
                    });
                }
                break Some(out_of_time(pushed, head.total, self.clock.now().since(start)));
            }
        };
        let rest = match refusal {
            None => encoding.finish().await,
            Some(reason) => Err(reason),
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

    fn is_out_of_time(&self) -> bool {
        self.deadline.is_some_and(|deadline| self.clock.now().after(self.policy.margin) >= deadline)
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

fn out_of_time(pushed: u64, total: u64, taken: Duration) -> Reason {
    let seconds = taken.as_secs();
    Reason::new(format!(
        "{pushed} of {total} frames were assembled in the {seconds} s that the assemble function had: give it more \
         time or memory and retry, or fetch the frames and assemble them locally"
    ))
}
