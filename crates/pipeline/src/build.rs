//! Builds a file of an animation, in one piece or in several.
//!
//! Memory does not grow with the number of frames: they are fetched a few ahead of the encoder, and its output is sent
//! part by part. If the time of an invocation does not suffice for one more frame, the invocation writes a
//! [`checkpoint`](crate::checkpoint), and the next one continues the file. The bytes are those of a single invocation.
//! Each invocation takes at least one frame. A set is refused if not even one frame fits, or if it takes a day.

use std::time::Duration;

use futures_util::stream::{self, StreamExt};
use rayfold_scene::Container;

use crate::animator::{Animator, Encoding, Unfit};
use crate::checkpoint::{Checkpoint, CheckpointHead, ResumedUpload};
use crate::invocation::{Invocation, Mutation};
use crate::keys::{Animation, Receipt, Tag};
use crate::lease::HeldLease;
use crate::manifest::{Frame, FrameState, Head, Manifest, Reason};
use crate::store::{Condition, ETag, ObjectInfo, PutOptions, Store, Upload};
use crate::{Clock, Error, Result, Timestamp};

/// The name of the entry of a file's metadata that holds its generation.
pub const GENERATION: &str = "generation";

/// The maximum number of invocations that may build a file, one after the other. At 15 minutes each they take 22.5
/// hours. After a day the bucket's rules remove the unfinished upload, and the build would start again.
pub const MAX_PIECES: u32 = 90;

/// The end of a build.
pub(crate) enum Built<'a> {
    /// The file is put, as this version.
    Put(ETag),
    /// The file was suspended after this number of frames, for the next invocation.
    Left(u64),
    /// A frame is gone, or another assembler wrote its file first, so another round follows.
    Stale,
    /// This frame cannot be read.
    Corrupt(&'a Frame, Reason),
    /// These frames make no file of this kind.
    Refused(Reason),
}

/// The encoder's progress at its end.
enum Encoded<'a> {
    /// The encoder has taken all frames.
    All,
    /// The encoder has taken this number of frames, and there is no time for more.
    SoFar(u64),
    /// A frame has alpha, so the file must be started again.
    Alpha,
    /// This outcome ends the build.
    No(Built<'a>),
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Tries to write a file of a manifest that is done, in place of the version that was read. `held`: the lease.
    pub(crate) async fn build<'m, A: Animator>(
        &self,
        animator: &A,
        manifest: &'m Manifest,
        (output, there): (Container, Option<&ObjectInfo>),
        began: Timestamp,
        held: &mut HeldLease,
    ) -> Result<Built<'m>> {
        let head = &manifest.head;
        let replaces = there.map(|there| there.etag.clone());
        let condition = match &replaces {
            _ if self.breaks(Mutation::DropGifCondition) => Condition::Always,
            None => Condition::IfAbsent,
            Some(etag) => Condition::IfMatch(etag.clone()),
        };
        let options = PutOptions { condition, ..PutOptions::always() }
            .content_type(output.media_type())
            .metadata(GENERATION, head.generation.as_str());
        // A WebP begins with its length.
        let options = if output == Container::Webp { options.start_last() } else { options };
        let begin = async |alpha| match animator.begin(&head.counted_settings(), output, alpha) {
            Ok(encoding) => {
                let upload = self.store.upload(&head.animation.output(output), options.clone()).await?;
                Ok::<_, Error>(Ok(ResumedUpload { encoding, upload, frames: 0, pieces: 0 }))
            }
            Err(reason) => Ok(Err(Built::Refused(reason))),
        };
        let taken_up = self.take_up(animator, (head, output), replaces.as_ref(), &options, held).await?;
        let mut taken_up = match taken_up {
            Some(taken_up) => taken_up,
            None => match begin(false).await? {
                Ok(begun) => begun,
                Err(refused) => return Ok(refused),
            },
        };
        let mut encoded = self.encode(&mut taken_up, manifest, began).await;
        if let Ok(Encoded::Alpha) = encoded {
            taken_up.upload.abort().await?;
            self.drop_checkpoint(head, held).await?;
            taken_up = match begin(true).await? {
                Ok(begun) => begun,
                Err(refused) => return Ok(refused),
            };
            encoded = self.encode(&mut taken_up, manifest, began).await;
        }
        let ended = match encoded {
            Ok(Encoded::All) => return self.finish(taken_up, head, held).await,
            Ok(Encoded::SoFar(frames)) => {
                let ResumedUpload { encoding, upload, pieces, .. } = taken_up;
                let pieces = pieces + 1;
                if pieces == MAX_PIECES {
                    let reason = Reason::new(format!(
                        "{frames} of {} frames were assembled in {MAX_PIECES} invocations: give the assemble function \
                         more time or memory and retry, or fetch the frames and assemble them locally",
                        head.total
                    ));
                    return self.give_up(upload, head, held, Ok(Built::Refused(reason))).await;
                }
                let encoding = match encoding.suspend().await {
                    Ok(encoding) => encoding,
                    Err(reason) => return self.give_up(upload, head, held, Ok(Built::Refused(reason))).await,
                };
                let generation = head.generation.clone();
                let of = CheckpointHead { generation, output, replaces, frames, pieces };
                self.put_checkpoint(head, Checkpoint { head: of, upload: upload.leave(), encoding }).await?;
                held.has_checkpoint = true;
                return Ok(Built::Left(frames));
            }
            Ok(Encoded::No(ended)) => Ok(ended),
            Ok(Encoded::Alpha) => Ok(Built::Refused(Reason::new("the encoder takes no frames with alpha"))),
            // No attempt would come further.
            Err(error @ Error::TooLarge { .. }) => Ok(Built::Refused(Reason::new(error.to_string()))),
            // The checkpoint stands: the next attempt continues from there.
            Err(error) if held.has_checkpoint && (error.is_retryable() || error.is_out_of_time()) => {
                return Err(error);
            }
            // The upload that was taken up is gone.
            Err(error) if held.has_checkpoint && error.is_not_found() => Ok(Built::Stale),
            Err(error) => Err(error),
        };
        self.give_up(taken_up.upload, head, held, ended).await
    }

    async fn give_up<'m>(
        &self,
        upload: S::Upload,
        head: &Head,
        held: &mut HeldLease,
        ended: Result<Built<'m>>,
    ) -> Result<Built<'m>> {
        upload.abort().await?;
        self.drop_checkpoint(head, held).await?;
        ended
    }

    async fn finish<'m, E: Encoding>(
        &self,
        made: ResumedUpload<E, S::Upload>,
        head: &Head,
        held: &mut HeldLease,
    ) -> Result<Built<'m>> {
        let ResumedUpload { encoding, mut upload, .. } = made;
        let (rest, patch) = match encoding.finish().await {
            Ok(rest) => rest,
            Err(reason) => return self.give_up(upload, head, held, Ok(Built::Refused(reason))).await,
        };
        if let Err(error) = upload.write(rest).await {
            return match error {
                error @ Error::TooLarge { .. } => {
                    let refused = Built::Refused(Reason::new(error.to_string()));
                    self.give_up(upload, head, held, Ok(refused)).await
                }
                // The checkpoint stands.
                error if held.has_checkpoint && error.is_retryable() => Err(error),
                error if held.has_checkpoint && error.is_not_found() => {
                    self.give_up(upload, head, held, Ok(Built::Stale)).await
                }
                error => self.give_up(upload, head, held, Err(error)).await,
            };
        }
        let finished = upload.finish(patch).await;
        // Whatever the result was, no assembler goes on with this upload.
        self.drop_checkpoint(head, held).await?;
        match finished {
            Ok(etag) => Ok(Built::Put(etag)),
            Err(error) if error.is_conflict() || error.is_not_found() || error.is_retryable() => {
                Ok(Built::Stale)
            }
            Err(error) => Err(error),
        }
    }

    /// Fetches the frames that the encoder has not taken, a few ahead of it, and sends its output.
    async fn encode<'m, E: Encoding>(
        &self,
        made: &mut ResumedUpload<E, S::Upload>,
        manifest: &'m Manifest,
        began: Timestamp,
    ) -> Result<Encoded<'m>> {
        let ResumedUpload { encoding, upload, frames: before, .. } = made;
        let animation = &manifest.head.animation;
        let settings = manifest.head.counted_settings();
        let shown = settings.shown(&manifest.frames);
        let keys = shown.filter_map(|frame| Some((frame, frame_key(animation, frame)?)));
        let keys = keys.skip(usize::try_from(*before).unwrap_or(usize::MAX));
        // A request of the SDK takes 10 KB from the moment it is made: those that have not begun are small ones.
        let fetch = |(frame, key): (&'m Frame, String)| async move {
            Ok::<_, Error>((frame, Box::pin(self.get(&key)).await?))
        };
        let fetches: Vec<_> = keys.map(fetch).collect();
        let to_come = fetches.len() as u64;
        let mut images = stream::iter(fetches).buffered(self.policy.prefetch);
        let start = self.clock.now();
        let (mut pushed, mut last, mut longest) = (0_u64, start, Duration::ZERO);
        while let Some(image) = images.next().await {
            let (frame, Some(image)) = image? else { return Ok(Encoded::No(Built::Stale)) };
            match encoding.push(image.body).await {
                Ok(piece) if piece.is_empty() => {}
                Ok(piece) => upload.write(piece).await?,
                Err(Unfit::Corrupt(reason)) => return Ok(Encoded::No(Built::Corrupt(frame, reason))),
                Err(Unfit::Unlike(reason)) => return Ok(Encoded::No(Built::Refused(reason))),
                Err(Unfit::Alpha) => return Ok(Encoded::Alpha),
            }
            pushed += 1;
            let now = self.clock.now();
            (last, longest) = (now, longest.max(now.since(last)));
            let is_late = self.is_out_of_time_in(Duration::ZERO);
            if is_late && pushed == 1 {
                // The next invocation would come no further.
                let reason = out_of_time(&manifest.head, start.since(began), now.since(start))?;
                return Ok(Encoded::No(Built::Refused(reason)));
            }
            if is_late
                || pushed < to_come
                    && self.is_out_of_time_in(longest.saturating_mul(self.policy.spare_frames))
            {
                return Ok(Encoded::SoFar(*before + pushed));
            }
        }
        Ok(Encoded::All)
    }

    /// Returns whether no time will be left to continue after `wait`.
    pub(crate) fn is_out_of_time_in(&self, wait: Duration) -> bool {
        let then = self.clock.now().after(wait).after(self.policy.margin);
        self.deadline.is_some_and(|deadline| then >= deadline)
    }
}

/// Returns the reason to refuse a set, if an invocation has come to its end at the first frame. A set is refused if no
/// frame fits the function's time, but only by an invocation that had most of its time for that frame. An invocation
/// that spent more time `before`, waiting and building other sets, leaves the set to its next attempt.
fn out_of_time(head: &Head, before: Duration, building: Duration) -> Result<Reason> {
    if before > building {
        let what = format!("{} became whole too late to assemble it", head.animation);
        return Err(Error::OutOfTime { what });
    }
    let (total, seconds) = (head.total, building.as_secs());
    Ok(Reason::new(format!(
        "1 of {total} frames were assembled in the {seconds} s that the assemble function had: give it more \
         time or memory and retry, or fetch the frames and assemble them locally"
    )))
}

/// The key of a frame that is drawn.
pub fn frame_key(animation: &Animation, frame: &Frame) -> Option<String> {
    let FrameState::Done { pixels } = frame.state else { return None };
    let (name, version) = (frame.script.clone(), frame.version.clone());
    Some(animation.receipt(&Receipt::Frame { name, tag: Tag { version, pixels }, part: frame.part }))
}

/// Returns the generation that a file was made of.
pub fn generation_of(file: Option<&ObjectInfo>) -> Option<&str> {
    file?.metadata.get(GENERATION).map(String::as_str)
}

/// Returns whether a file was made of this set: it is of the set's generation, and no other file has replaced it with a
/// copy of its metadata.
pub fn is_current(head: &Head, output: Container, file: Option<&ObjectInfo>) -> bool {
    let is_built = |file: &ObjectInfo| head.version_of(output).is_none_or(|built| file.etag == *built);
    generation_of(file) == Some(head.generation.as_str()) && file.is_some_and(is_built)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::Settings;
    use crate::reconcile::{Results, Scripts, reconcile};

    #[test]
    fn only_an_assembler_that_had_most_of_its_time_for_a_set_refuses_it() {
        let animation = Animation::new("film").unwrap();
        let manifest = reconcile(&animation, &Scripts::default(), &Results::default(), &Settings::absent());
        let head = Head { total: 9, ..manifest.head };
        let (short, long) = (Duration::from_secs(10), Duration::from_secs(20));
        assert!(matches!(out_of_time(&head, long, short), Err(Error::OutOfTime { .. })));
        let reason = out_of_time(&head, short, long).unwrap();
        assert!(reason.message.starts_with("1 of 9 frames were assembled in the 20 s"), "{}", reason.message);
        assert!(out_of_time(&head, short, short).is_ok());
    }
}
