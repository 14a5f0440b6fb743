//! A frame that is too big for one invocation is drawn in bands by several. The invocation that finds all bands joins
//! them.
//!
//! 1. An invocation that finds a frame too big records it in a receipt, `cut-<k>`, and triggers an invocation for each
//!    band by an object below `parts/`. An invocation that sees that receipt does not measure or cut again. If two cuts
//!    were made at once, the finer one counts.
//! 2. Each invocation puts its band below `frames/`, only if absent, and lists the receipts of the frame. If all bands
//!    of its cut exist, it joins them, and puts the frame as if it had been drawn in one piece. Later steps do not know
//!    of bands.
//! 3. An invocation that is triggered for the frame itself triggers the missing bands, or joins them if all exist.
//!
//! A band's key contains the script's version and the pixel version, so bands of different pictures are never joined. A
//! band is never cut. Only the renderer knows the rows and the contents of a band.
//!
//! Invariant: an invocation stops only after a listing that it started after its own band was put. So the last one to
//! put its band finds all bands.

use std::collections::BTreeSet;
use std::future::Future;
use std::num::NonZeroU64;

use bytes::Bytes;
use futures_util::stream::{self, StreamExt, TryStreamExt};

use super::{Outcome, Renderer, Script, Stages, Subject};
use crate::invocation::{Invocation, Mutation};
use crate::keys::{Band, Key, Part, Receipt, Tag};
use crate::manifest::{Fact, Reason};
use crate::observe::version_result;
use crate::reconcile::ReceiptFound;
use crate::store::Store;
use crate::{Clock, Error, Result};

/// Joins a frame: takes the bands from the top, and returns the frame's file.
pub trait BandJoiner: Send {
    /// Adds the next band, as it was drawn.
    ///
    /// # Errors
    ///
    /// Returns the reason if it is no such band; then nothing was added.
    fn push(&mut self, band: Bytes) -> impl Future<Output = Result<(), Reason>> + Send;

    /// Returns the frame's file: the same bytes as if it had been drawn in one piece.
    ///
    /// # Errors
    ///
    /// Returns the reason if there is none, which would be the same next time.
    fn finish(self) -> impl Future<Output = Result<Bytes, Reason>> + Send;
}

/// The rows that an event is about, and the retry that triggered it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Woken {
    pub(crate) band: Band,
    /// The pixel version of the renderer that cut the frame.
    pub(crate) pixels: u32,
    /// The number of the retry's attempt; 0 if the invocation that cut the frame triggered it.
    pub(crate) attempt: u64,
}

/// The bands of a frame, from its receipts.
#[derive(Debug, Default)]
pub(crate) struct Bands {
    cut: Option<NonZeroU64>,
    there: BTreeSet<Band>,
}

impl Bands {
    /// Returns the bands that were drawn with this pixel version.
    pub(crate) fn of(receipts: &[ReceiptFound], of_part: Part, pixels: u32) -> Self {
        let mut bands = Bands::default();
        for found in receipts {
            match &found.receipt {
                Receipt::Cut { tag, part, count, .. } if *part == of_part && tag.pixels == pixels => {
                    bands.cut = bands.cut.max(Some(*count));
                }
                Receipt::Band { tag, part, band, .. } if *part == of_part && tag.pixels == pixels => {
                    bands.there.insert(*band);
                }
                _ => {}
            }
        }
        bands
    }

    /// The number of bands into which the frame is cut.
    pub(crate) fn cut(&self) -> Option<NonZeroU64> {
        self.cut
    }

    fn missing(&self, count: NonZeroU64) -> Vec<Band> {
        Band::all(count).filter(|band| !self.there.contains(band)).collect()
    }
}

/// Returns the result of a band's event. As long as other bands are to come, there is nothing to fold.
type Came = (Outcome, Option<Fact>);

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Records that a frame is cut, and triggers an invocation for each band.
    pub(crate) async fn cut(&self, subject: &Subject, tag: &Tag, count: NonZeroU64) -> Result<()> {
        let Subject { animation, name, part, .. } = subject;
        let cut = Receipt::Cut { name: name.clone(), tag: tag.clone(), part: *part, count };
        self.put_receipt(&animation.receipt(&cut), Bytes::new(), "text/plain").await?;
        self.wake_bands(subject, tag, Band::all(count).collect(), 0).await
    }

    /// Works on an event of a frame that is cut already: triggers its missing bands, or joins it.
    pub(crate) async fn follow_cut<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        script: Script,
        (bands, count): (Bands, NonZeroU64),
        stages: &mut Stages,
    ) -> Result<Came> {
        let missing = bands.missing(count);
        let retry = subject.retry.as_ref().filter(|(_, meant)| *meant == script.version);
        if missing.is_empty() {
            if let Some((attempt, _)) = retry {
                self.put_begun(subject, &script.version, *attempt).await?;
            }
            return self.put_together(renderer, subject, script, count, stages).await;
        }
        let tag = Tag { version: script.version.clone(), pixels: self.policy.pixels };
        let fact = Fact::Version(subject.name.clone(), script.version);
        // An invocation that was woken for them may be drawing. But the one that cut the frame may also have died
        // while it put these objects, and a store need not send an event for an object whose put was never
        // acknowledged; and the bands may have come while another version was current.
        let attempt = retry.map_or(0, |(attempt, _)| attempt.get());
        self.wake_bands(subject, &tag, missing, attempt).await?;
        Ok((Outcome::Cut(count), Some(fact)))
    }

    /// Draws a band, unless it exists, and joins the frame if it was the last one.
    pub(crate) async fn work_on_band<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        script: Script,
        (woken, mut bands): (Woken, Bands),
        stages: &mut Stages,
    ) -> Result<Came> {
        let Woken { band, attempt, .. } = woken;
        let Subject { animation, name, part, .. } = subject;
        let version = &script.version;
        if !bands.there.contains(&band) {
            if let Some(attempt) = NonZeroU64::new(attempt) {
                self.put_begun(subject, version, attempt).await?;
            }
            let drawn = self.draw_band(renderer, subject, &script, band, stages).await?;
            let tag = Tag { version: version.clone(), pixels: self.policy.pixels };
            let image = match drawn {
                Ok(image) => image,
                Err(reason) => {
                    let version = script.version;
                    let (outcome, fact) = self.put_drawing_fault(subject, version, &tag, reason).await?;
                    return Ok((outcome, Some(fact)));
                }
            };
            let receipt = Receipt::Band { name: name.clone(), tag, part: *part, band };
            self.put_receipt(&animation.receipt(&receipt), image, "image/png").await?;
            let receipts = self.receipts_of(animation, name, version, *part).await?;
            if let Some(standing) = version_result(&receipts, *part) {
                let fact = standing.fact(name.clone(), script.version, *part);
                return Ok((Outcome::Present, Some(fact)));
            }
            bands = Bands::of(&receipts, *part, self.policy.pixels);
        }
        let missing = bands.missing(band.of()).len();
        if missing == 0 || missing == 1 && self.breaks(Mutation::JoinTooEarly) {
            return self.put_together(renderer, subject, script, band.of(), stages).await;
        }
        Ok((Outcome::Band(band), None))
    }

    async fn draw_band<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        script: &Script,
        band: Band,
        stages: &mut Stages,
    ) -> Result<Result<Bytes, Reason>> {
        let before = self.clock.now();
        let name = &subject.name;
        let drawing = renderer.draw_band(script.source(subject), band);
        let drawn = self.in_time(drawing, || format!("band {band} of {name} is not drawn")).await;
        stages.draw += self.clock.now().since(before);
        drawn
    }

    /// Joins the frame from all its bands. A band that cannot be read is drawn again here.
    async fn put_together<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        script: Script,
        count: NonZeroU64,
        stages: &mut Stages,
    ) -> Result<Came> {
        let Subject { animation, name, part, .. } = subject;
        self.forget_history_before(&(animation, name, part, &script.version, count));
        let tag = Tag { version: script.version.clone(), pixels: self.policy.pixels };
        let frame = match self.join(renderer, subject, &script, (&tag, count), stages).await? {
            Ok(frame) => frame,
            Err(reason) => {
                let version = script.version;
                let (outcome, fact) = self.put_drawing_fault(subject, version, &tag, reason).await?;
                return Ok((outcome, Some(fact)));
            }
        };
        let receipt = Receipt::Frame { name: name.clone(), tag, part: *part };
        let put = self.put_receipt(&animation.receipt(&receipt), frame, "image/png").await?;
        let fact = Fact::Drawn(name.clone(), script.version, *part, self.policy.pixels);
        // If two put the last bands at once, each may have found all of them.
        Ok((put.map_or(Outcome::Present, |_| Outcome::Drawn), Some(fact)))
    }

    async fn join<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        script: &Script,
        (tag, count): (&Tag, NonZeroU64),
        stages: &mut Stages,
    ) -> Result<Result<Bytes, Reason>> {
        let Subject { animation, name, part, .. } = subject;
        let late = || format!("{name} is not put together");
        let mut joining = match renderer.join(script.source(subject), count).await? {
            Ok(joining) => joining,
            Err(reason) => return Ok(Err(reason)),
        };
        for band in Band::all(count) {
            let receipt = Receipt::Band { name: name.clone(), tag: tag.clone(), part: *part, band };
            let key = animation.receipt(&receipt);
            let Some(object) = self.get(&key).await? else {
                if self.breaks(Mutation::JoinTooEarly) {
                    continue;
                }
                // It was deleted since: the frame is there, or is to be drawn again.
                return Err(Error::Conflict { key });
            };
            let pushed = self.in_time(async { Ok(joining.push(object.body).await) }, late).await?;
            if pushed.is_ok() {
                continue;
            }
            let image = match self.draw_band(renderer, subject, script, band, stages).await? {
                Ok(image) => image,
                Err(reason) => return Ok(Err(reason)),
            };
            self.put_image(&key, image.clone()).await?;
            if let Err(reason) = self.in_time(async { Ok(joining.push(image).await) }, late).await? {
                let message = format!("band {band} does not fit: {}", reason.message);
                return Ok(Err(Reason::new(message)));
            }
        }
        self.in_time(async { Ok(joining.finish().await) }, late).await
    }

    async fn wake_bands(&self, subject: &Subject, tag: &Tag, bands: Vec<Band>, attempt: u64) -> Result<()> {
        let wakings = bands.into_iter().map(|band| async move {
            let Subject { animation, name, part, .. } = subject;
            let (script, trace) = (animation.script(name), part.map_or(1, NonZeroU64::get));
            let body = serde_json::json!({ "script": script, "version": tag.version, "trace": trace });
            let (animation, name, tag) = (animation.clone(), name.clone(), tag.clone());
            let key = Key::Band { animation, name, tag, part: *part, band, attempt }.to_string();
            self.put(&key, body.to_string().into()).await.map(drop)
        });
        let concurrency = self.policy.concurrency;
        stream::iter(wakings).map(Ok).try_for_each_concurrent(concurrency, |waking| waking).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Timestamp;
    use crate::keys::ScriptName;
    use crate::store::ETag;

    #[test]
    fn the_bands_of_a_frame_are_those_of_its_part_and_pixels() {
        let number = |number: u64| NonZeroU64::new(number).unwrap();
        let name = || ScriptName::new("1").unwrap();
        let tag = |pixels: u32| Tag { version: ETag::new("v"), pixels };
        let cut = |pixels: u32, part, count: u64| Receipt::Cut {
            name: name(),
            tag: tag(pixels),
            part,
            count: number(count),
        };
        let band = |pixels: u32, part, band| Receipt::Band { name: name(), tag: tag(pixels), part, band };
        let [first, second, third] = [0, 1, 2].map(|k| Band::all(number(3)).nth(k).unwrap());
        let one = Some(number(1));
        let receipts = [
            cut(1, None, 9),
            cut(2, None, 3),
            cut(2, None, 2),
            cut(2, one, 8),
            band(1, None, first),
            band(2, None, second),
            band(2, one, third),
        ];
        let found =
            receipts.map(|receipt| ReceiptFound { receipt, etag: ETag::new("e"), modified: Timestamp(0) });
        let of = |part, pixels| {
            let bands = Bands::of(&found, part, pixels);
            (bands.cut().map(NonZeroU64::get), bands.missing(number(3)))
        };
        assert_eq!(of(None, 1), (Some(9), vec![second, third]));
        assert_eq!(of(None, 2), (Some(3), vec![first, third]));
        assert_eq!(of(one, 2), (Some(8), vec![first, second]));
        assert_eq!(of(one, 1), (None, vec![first, second, third]));
    }
}
