//! The render step: one event, one frame.
//!
//! An event only says where to look. The invocation reads the script as it is now, so a superseded event counts as
//! one for the current version. If that version has no result yet, the invocation draws it and puts the result under
//! a key that names script and version, only if absent. Then it folds. A frame that is too big for one invocation is
//! drawn in bands (`bands`).

use std::collections::BTreeSet;
use std::future::Future;
use std::num::NonZeroU64;
use std::pin::pin;
use std::time::Duration;

use bytes::Bytes;
use futures_util::future::{Either, select};
use futures_util::stream::{self, StreamExt, TryStreamExt};

use crate::fold::{Age, Folded};
use crate::invocation::{Invocation, ManifestPrefix};
use crate::keys::{Animation, Band, Key, Part, Receipt, ScriptName, Tag, Uploaded};
use crate::manifest::{Fact, Reason};
use crate::observe::{VersionResult, version_result};
use crate::reconcile::ReceiptFound;
use crate::store::{ETag, ListRequest, Object, Store};
use crate::{Clock, Error, Result, Timestamp};

pub(crate) mod bands;
mod source;

use bands::{Bands, Woken};

pub use bands::BandJoiner;
pub use source::{File, Files, Source};

/// A renderer of scripts. The render function provides a ray tracer, the simulation something smaller.
pub trait Renderer: Send + Sync {
    /// A frame that is joined from its bands.
    type BandJoiner: BandJoiner;

    /// Returns the largest size of a script in bytes. Of a larger script only these bytes and one more are read.
    fn most_bytes(&self) -> u64;

    /// Returns the largest size of a file in bytes. Of a larger file only these bytes and one more are read.
    fn most_file_bytes(&self) -> u64;

    /// Returns the names of the files that the drawing of a script reads, as far as these `files` show it; an absent
    /// file is `None`. The caller repeats the call with more files until there are no new names. The last result
    /// depends only on the script and on the contents of the files, because it is a part of the script's version.
    ///
    /// # Errors
    ///
    /// Errors after which another attempt may succeed.
    fn needed(
        &self,
        name: &ScriptName,
        script: Bytes,
        files: Files,
    ) -> impl Future<Output = Result<Vec<String>>> + Send;

    /// Returns a file that was read before, by its key. It may have changed since.
    fn kept(&self, _key: &str) -> Option<File> {
        None
    }

    /// Keeps a file, so that the next drawing need not read it. Without a file, drops the one that is kept for the key.
    fn keep(&self, _key: &str, _file: Option<&File>) {}

    /// Draws the script's only frame (`part` is `None`) or one of several. Or returns that it is too big, because
    /// drawing takes most of the time that is `left`, or more memory than there is.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfTime`] if it was stopped before the deadline. A fault of the script is no error but a
    /// [`Drawing::Fault`].
    fn draw(&self, source: Source, left: Option<Duration>) -> impl Future<Output = Result<Drawing>> + Send;

    /// Draws a band of a frame that was found too big, as a file that [`BandJoiner`] reads. Returns the reason if that
    /// is impossible.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfTime`] if it was stopped before the deadline.
    fn draw_band(
        &self,
        source: Source,
        band: Band,
    ) -> impl Future<Output = Result<Result<Bytes, Reason>>> + Send;

    /// Begins to join the bands of a frame; returns the reason if there is no such frame.
    ///
    /// # Errors
    ///
    /// Errors after which another attempt may succeed.
    fn join(
        &self,
        source: Source,
        count: NonZeroU64,
    ) -> impl Future<Output = Result<Result<Self::BandJoiner, Reason>>> + Send;
}

/// The result of drawing a script.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawing {
    /// The frame, as PNG.
    Frame(Bytes),
    /// The script has this many frames, two or more. Only if no part was requested.
    Split(NonZeroU64),
    /// The frame is too big for one invocation. It must be drawn in this many bands, two or more.
    Cut(NonZeroU64),
    /// There is no frame before files arrive that the script names. Only if no part was requested.
    Waits(Reason),
    /// There is no frame and never will be.
    Fault(Reason),
}

/// The result of an invocation of the render function.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// The animation of the script.
    pub animation: Animation,
    /// The script; `None` for an event of `animation.json` or of a file that is no script.
    pub script: Option<ScriptName>,
    /// The result of the event.
    pub outcome: Outcome,
    /// The end of the fold.
    pub folded: Folded,
    /// The time that each stage took.
    pub stages: Stages,
}

/// The result of an event.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The script is gone.
    Gone,
    /// The event was about settings.
    Settings,
    /// The event was about an object that is not read, because of this fault in its name.
    NearMiss(&'static str),
    /// The event was about a part of a version that is no longer current. Another event draws the current one.
    Superseded,
    /// The result was there already.
    Present,
    /// The frame was drawn.
    Drawn,
    /// The script was split into this many parts.
    Split(NonZeroU64),
    /// The frame is drawn in this many bands, for which invocations were triggered.
    Cut(NonZeroU64),
    /// This band of the frame exists; others are to come.
    Band(Band),
    /// The script gives no frame before the files arrive that it names. The receipt now says so.
    Waits(Reason),
    /// The script gives no frame. The receipt now says so.
    Faulty(Reason),
    /// The event was about a file that a script names. The scripts that must be drawn with it were triggered.
    File,
    /// The event was about a file that no script names.
    NoFile,
    /// Nothing was drawn, because the animation has more frames than allowed.
    TooMany,
}

/// The times of the stages of an invocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stages {
    /// Reading the script and looking for a result.
    pub read: Duration,
    /// The time spent on drawing.
    pub draw: Duration,
    /// The time spent on writing the result.
    pub put: Duration,
    /// The time spent on folding.
    pub fold: Duration,
}

/// Works on one event of the render function, given the key that it is about.
///
/// # Errors
///
/// [`Error::Key`] for a key that triggers no rendering: nothing was done, and a retry would not help. All other errors
/// are the store's and the renderer's, and the platform should try again.
pub async fn render_frame<S: Store, C: Clock, R: Renderer>(
    invocation: &Invocation<'_, S, C>,
    renderer: &R,
    key: &str,
) -> Result<Rendered> {
    match Uploaded::of(key, 0) {
        Uploaded::NearMiss(animation, problem) => {
            return invocation.follow_near_miss(animation, problem).await;
        }
        Uploaded::File(animation, name) => return invocation.follow_file(animation, &name).await,
        _ => {}
    }
    match key.parse()? {
        Key::Settings { animation } => invocation.follow_settings(animation).await,
        other => match Subject::of(other) {
            Some(subject) => invocation.render(renderer, subject).await,
            None => Err(Error::key(key, "this key wakes no rendering")),
        },
    }
}

/// The frame that an event is about.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Subject {
    pub(crate) animation: Animation,
    pub(crate) name: ScriptName,
    pub(crate) part: Part,
    /// The rows to draw, if these are not all rows of the frame.
    woken: Option<Woken>,
    /// The version of a part or a band. If another version is current, there is nothing to draw.
    only: Option<ETag>,
    /// The retry that triggered the invocation, and the version that it was for.
    pub(crate) retry: Option<(NonZeroU64, ETag)>,
}

/// The current script, with its files.
#[derive(Debug, PartialEq)]
pub(crate) struct Script {
    pub(crate) version: ETag,
    pub(crate) uploaded: Timestamp,
    pub(crate) body: Bytes,
    pub(crate) files: Files,
}

impl Script {
    /// Returns the inputs for drawing a frame.
    pub(crate) fn source(&self, subject: &Subject) -> Source {
        let (script, files) = (self.body.clone(), self.files.clone());
        Source { name: subject.name.clone(), script, files, part: subject.part }
    }
}

/// The work that remains for a script.
#[derive(Debug, PartialEq)]
enum Due {
    /// There is nothing to draw; only the manifest must show this fact.
    Nothing(Outcome, Fact),
    /// A result of this version must be made, unless there is one.
    Version(Script),
}

impl Subject {
    /// Returns `None` for a key that is about no script.
    fn of(key: Key) -> Option<Self> {
        match key {
            Key::Script { animation, name } => {
                Some(Subject { animation, name, part: None, woken: None, only: None, retry: None })
            }
            Key::Retry { animation, name, tag, part, attempt } => {
                let only = part.map(|_| tag.version.clone());
                let retry = Some((attempt, tag.version));
                Some(Subject { animation, name, part, woken: None, only, retry })
            }
            Key::Part { animation, name, tag, number } => {
                let only = Some(tag.version);
                Some(Subject { animation, name, part: Some(number), woken: None, only, retry: None })
            }
            Key::Band { animation, name, tag, part, band, attempt } => {
                let woken = Some(Woken { band, pixels: tag.pixels, attempt });
                Some(Subject { animation, name, part, woken, only: Some(tag.version), retry: None })
            }
            Key::Wake { animation, name, .. } => {
                Some(Subject { animation, name, part: None, woken: None, only: None, retry: None })
            }
            Key::Settings { .. }
            | Key::Receipt { .. }
            | Key::Lease { .. }
            | Key::SweepLease { .. }
            | Key::Manifest { .. }
            | Key::SetAside { .. }
            | Key::Claim { .. }
            | Key::Checkpoint { .. }
            | Key::Output { .. }
            | Key::OutputMark { .. } => None,
        }
    }

    fn due(&self, script: Option<Object>) -> Due {
        let name = || self.name.clone();
        let Some(Object { info, body }) = script else {
            return Due::Nothing(Outcome::Gone, Fact::Absent(name()));
        };
        if self.only.as_ref().is_some_and(|only| only.script() != info.etag.as_str()) {
            return Due::Nothing(Outcome::Superseded, Fact::Version(name(), info.etag));
        }
        let files = Files::default();
        Due::Version(Script { version: info.etag, uploaded: info.modified, body, files })
    }
}

impl Outcome {
    /// Returns the age of the fact behind the outcome.
    fn age(&self) -> Age {
        match self {
            Outcome::Drawn | Outcome::Split(_) | Outcome::Waits(_) | Outcome::Faulty(_) => Age::New,
            Outcome::Gone
            | Outcome::Settings
            | Outcome::NearMiss(_)
            | Outcome::Superseded
            | Outcome::Present
            | Outcome::Cut(_)
            | Outcome::Band(_)
            | Outcome::File
            | Outcome::NoFile
            | Outcome::TooMany => Age::Old,
        }
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    async fn follow_settings(&self, animation: Animation) -> Result<Rendered> {
        let start = self.clock.now();
        let version = self.head(&animation.settings()).await?.map(|info| info.etag);
        let read = self.clock.now();
        let folded = self.fold(&animation, &Fact::Settings(version), Age::Old).await?;
        let stages =
            Stages { read: read.since(start), fold: self.clock.now().since(read), ..Stages::default() };
        Ok(Rendered { animation, script: None, outcome: Outcome::Settings, folded, stages })
    }

    /// Folds, so that the manifest contains a warning of the object at once, or drops it.
    async fn follow_near_miss(&self, animation: Animation, problem: &'static str) -> Result<Rendered> {
        let start = self.clock.now();
        let folded = self.fold(&animation, &Fact::Fold, Age::Old).await?;
        let stages = Stages { fold: self.clock.now().since(start), ..Stages::default() };
        Ok(Rendered { animation, script: None, outcome: Outcome::NearMiss(problem), folded, stages })
    }

    /// Triggers the scripts that must be drawn again because a file was added, changed or removed.
    async fn follow_file(&self, animation: Animation, name: &str) -> Result<Rendered> {
        let start = self.clock.now();
        let is_named = self.wake_for_file(&animation, name).await?;
        let read = self.clock.now();
        let (outcome, folded) = match is_named {
            true => (Outcome::File, self.fold(&animation, &Fact::Fold, Age::Old).await?),
            false => (Outcome::NoFile, Folded::Untouched),
        };
        let stages =
            Stages { read: read.since(start), fold: self.clock.now().since(read), ..Stages::default() };
        Ok(Rendered { animation, script: None, outcome, folded, stages })
    }

    async fn render<R: Renderer>(&self, renderer: &R, subject: Subject) -> Result<Rendered> {
        let mut stages = Stages::default();
        let start = self.clock.now();
        let key = subject.animation.script(&subject.name);
        let script = self.get_start(&key, renderer.most_bytes()).await?;
        let (outcome, fact) = match subject.due(script) {
            Due::Nothing(outcome, fact) => (outcome, Some(fact)),
            Due::Version(script) => {
                let (animation, name, part) = (&subject.animation, &subject.name, &subject.part);
                let (script, receipts) = self.with_files(renderer, &subject, script).await?;
                if subject.only.as_ref().is_some_and(|only| *only != script.version) {
                    (Outcome::Superseded, Some(Fact::Version(name.clone(), script.version)))
                } else {
                    match version_result(&receipts, *part) {
                        Some(VersionResult::Split { tag, count }) => {
                            stages.read = self.clock.now().since(start);
                            return self.follow_split(subject, tag, count, script.uploaded, stages).await;
                        }
                        Some(standing) => {
                            (Outcome::Present, Some(standing.fact(name.clone(), script.version, *part)))
                        }
                        None if self.has_too_many(animation).await? => {
                            (Outcome::TooMany, Some(Fact::Version(name.clone(), script.version)))
                        }
                        None => {
                            let bands = Bands::of(&receipts, *part, self.policy.pixels);
                            self.work_on(renderer, &subject, script, bands, &mut stages).await?
                        }
                    }
                }
            }
        };
        let before_fold = self.clock.now();
        stages.read = before_fold.since(start).saturating_sub(stages.draw + stages.put);
        let folded = match fact {
            Some(fact) => self.fold(&subject.animation, &fact, outcome.age()).await?,
            None => Folded::Untouched,
        };
        stages.fold = self.clock.now().since(before_fold);
        Ok(Rendered { animation: subject.animation, script: Some(subject.name), outcome, folded, stages })
    }

    /// Determines the version of a script with its files, and returns the receipts of that version. The files are read
    /// only if there is no result.
    async fn with_files<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        mut script: Script,
    ) -> Result<(Script, Vec<ReceiptFound>)> {
        let Subject { animation, name, part, only, .. } = subject;
        let of_version = |mut receipts: Vec<ReceiptFound>, version: &ETag| {
            receipts.retain(|found| found.receipt.is_of(name, version));
            receipts
        };
        let etag = script.version.clone();
        let (mut receipts, agreed) = match only {
            Some(only) => {
                let receipts = self.receipts_of(animation, name, only, *part).await?;
                (receipts, Some(only.clone()))
            }
            None => {
                let receipts = self.receipts_of_all_versions(animation, name, &etag).await?;
                let agreed = self.agreed_version(animation, name, &etag, &receipts).await?;
                let (agreed, since) = agreed.unzip();
                script.uploaded = script.uploaded.max(since.unwrap_or_default());
                (receipts, agreed)
            }
        };
        let version = agreed.clone().unwrap_or_else(|| etag.clone());
        let of_agreed = of_version(receipts.clone(), &version);
        if version_result(&of_agreed, *part).is_some() || only.is_some() && !version.has_files() {
            script.version = version;
            return Ok((script, of_agreed));
        }
        let (read, files) = self
            .read_files(renderer, animation, name, &etag, &script.body, (agreed.as_ref(), only.is_some()))
            .await?;
        (script.version, script.files) = (read, files);
        receipts = of_version(receipts, &script.version);
        if only.is_none() && script.version.has_files() && version_result(&receipts, *part).is_none() {
            self.take_version(animation, name, &script.version).await?;
        }
        Ok((script, receipts))
    }

    /// Returns whether the manifest says that the animation has more frames than allowed.
    async fn has_too_many(&self, animation: &Animation) -> Result<bool> {
        if self.policy.most_frames.is_none() {
            return Ok(false);
        }
        Ok(self.read_prefix(animation).await?.head().is_some_and(|head| head.excess.is_some()))
    }

    /// Works on a frame without a result: on the band that the event is about, or on the whole frame. If a renderer of
    /// another pixel version triggered the invocation for a band, it decides about the frame again.
    async fn work_on<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        script: Script,
        bands: Bands,
        stages: &mut Stages,
    ) -> Result<(Outcome, Option<Fact>)> {
        let woken = subject.woken.filter(|woken| woken.pixels == self.policy.pixels);
        match (woken, bands.cut()) {
            (Some(woken), _) => self.work_on_band(renderer, subject, script, (woken, bands), stages).await,
            (None, Some(count)) => self.follow_cut(renderer, subject, script, (bands, count), stages).await,
            (None, None) => {
                let (outcome, fact) = self.draw_and_put(renderer, subject, script, stages).await?;
                Ok((outcome, Some(fact)))
            }
        }
    }

    async fn draw_and_put<R: Renderer>(
        &self,
        renderer: &R,
        subject: &Subject,
        script: Script,
        stages: &mut Stages,
    ) -> Result<(Outcome, Fact)> {
        if let Some((attempt, _)) = subject.retry.as_ref().filter(|(_, meant)| *meant == script.version) {
            self.put_begun(subject, &script.version, *attempt).await?;
        }
        let before = self.clock.now();
        let drawing = self.draw(renderer, script.source(subject)).await?;
        let drawn = self.clock.now();
        stages.draw = drawn.since(before);
        let put = self.put_drawing(subject, script.version, script.uploaded, drawing).await?;
        stages.put = self.clock.now().since(drawn);
        Ok(put)
    }

    /// Records that the attempt has begun. The sweep counts only such attempts, because others may still wait to be
    /// tried.
    pub(crate) async fn put_begun(
        &self,
        subject: &Subject,
        version: &ETag,
        attempt: NonZeroU64,
    ) -> Result<()> {
        let Subject { animation, name, part, .. } = subject;
        let tag = Tag { version: version.clone(), pixels: self.policy.pixels };
        let begun = Receipt::Begun { name: name.clone(), tag, part: *part, attempt };
        self.put_receipt(&animation.receipt(&begun), Bytes::new(), "text/plain").await.map(drop)
    }

    async fn draw<R: Renderer>(&self, renderer: &R, source: Source) -> Result<Drawing> {
        let name = source.name.clone();
        let drawing = renderer.draw(source, self.time_to_draw());
        self.in_time(drawing, || format!("{name} is not drawn")).await
    }

    /// Returns the time that a drawing may take from now on, if there is a deadline.
    fn time_to_draw(&self) -> Option<Duration> {
        let deadline = self.deadline?;
        Some(deadline.since(self.clock.now()).saturating_sub(self.policy.draw_margin))
    }

    /// Runs work, but not beyond the deadline, because a killed invocation cannot report a reason.
    pub(crate) async fn in_time<T>(
        &self,
        work: impl Future<Output = Result<T>>,
        late: impl FnOnce() -> String,
    ) -> Result<T> {
        let Some(left) = self.time_to_draw() else { return work.await };
        let work = pin!(work);
        let alarm = pin!(self.clock.sleep(left));
        match select(work, alarm).await {
            Either::Left((done, _)) => done,
            Either::Right(_) => {
                let milliseconds = left.as_millis();
                Err(Error::OutOfTime { what: format!("{} after {milliseconds} ms", late()) })
            }
        }
    }

    async fn put_drawing(
        &self,
        subject: &Subject,
        version: ETag,
        uploaded: Timestamp,
        drawing: Drawing,
    ) -> Result<(Outcome, Fact)> {
        let Subject { animation, name, part, .. } = subject;
        let (name, part) = (name.clone(), *part);
        let tag = Tag { version: version.clone(), pixels: self.policy.pixels };
        Ok(match drawing {
            Drawing::Frame(image) => {
                let receipt = Receipt::Frame { name: name.clone(), tag, part };
                self.put_receipt(&animation.receipt(&receipt), image, "image/png").await?;
                (Outcome::Drawn, Fact::Drawn(name, version, part, self.policy.pixels))
            }
            Drawing::Split(count) if self.policy.most_frames.is_some_and(|most| count.get() > most) => {
                let most = self.policy.most_frames.unwrap_or_default();
                let reason = Reason::new(format!(
                    "{name}.txt has {count} frames: expected at most {most}, the limit of this bucket for an animation"
                ));
                return self.put_drawing_fault(subject, version, &tag, reason).await;
            }
            Drawing::Split(count) => {
                self.put_parts(animation, &name, &tag, count, uploaded).await?;
                let receipt = Receipt::Split { name: name.clone(), tag, count };
                self.put_receipt(&animation.receipt(&receipt), Bytes::new(), "text/plain").await?;
                (Outcome::Split(count), Fact::Split(name, version))
            }
            Drawing::Cut(count) => {
                self.cut(subject, &tag, count).await?;
                (Outcome::Cut(count), Fact::Version(name, version))
            }
            Drawing::Waits(reason) if part.is_none() => {
                let key = animation.receipt(&Receipt::Waits { name: name.clone(), tag });
                let put = self.put_receipt(&key, reason_body(&key, &reason)?, "application/json").await?;
                let fact = put.map_or(Fact::Fold, |receipt| Fact::Faulty(name, version, None, receipt));
                (Outcome::Waits(reason), fact)
            }
            Drawing::Waits(reason) | Drawing::Fault(reason) => {
                return self.put_drawing_fault(subject, version, &tag, reason).await;
            }
        })
    }

    pub(crate) async fn put_drawing_fault(
        &self,
        subject: &Subject,
        version: ETag,
        tag: &Tag,
        reason: Reason,
    ) -> Result<(Outcome, Fact)> {
        let Subject { animation, name, part, .. } = subject;
        let fact = match self.put_fault(animation, name, tag, *part, &reason).await? {
            Some(receipt) => Fact::Faulty(name.clone(), version, *part, receipt),
            None => Fact::Fold,
        };
        Ok((Outcome::Faulty(reason), fact))
    }

    /// Puts an error receipt. Returns `None` if it exists already.
    pub(crate) async fn put_fault(
        &self,
        animation: &Animation,
        name: &ScriptName,
        tag: &Tag,
        part: Part,
        reason: &Reason,
    ) -> Result<Option<ETag>> {
        let receipt = Receipt::Fault { name: name.clone(), tag: tag.clone(), part };
        let key = animation.receipt(&receipt);
        self.put_receipt(&key, reason_body(&key, reason)?, "application/json").await
    }

    /// Triggers an invocation for each part. Parts that were put after the upload of the script have had their event.
    /// The event of an older part may have come while another version was current.
    async fn put_parts(
        &self,
        animation: &Animation,
        name: &ScriptName,
        tag: &Tag,
        count: NonZeroU64,
        uploaded: Timestamp,
    ) -> Result<()> {
        let numbers = (1..=count.get()).filter_map(NonZeroU64::new);
        let parts = numbers.map(|number| async move {
            let (key, body) = part_object(animation, name, tag, number, count);
            if self.put_receipt(&key, body.clone(), "application/json").await?.is_none()
                && self.head(&key).await?.is_none_or(|part| part.modified <= uploaded)
            {
                self.put(&key, body).await?;
            }
            Ok(())
        });
        let concurrency = self.policy.concurrency;
        stream::iter(parts).map(Ok).try_for_each_concurrent(concurrency, |part| part).await
    }

    /// Handles a script that is split already. Parts whose events came while another version was current have drawn
    /// nothing. So those that were put before this upload, and have no result, are triggered again.
    async fn follow_split(
        &self,
        subject: Subject,
        tag: Tag,
        count: NonZeroU64,
        uploaded: Timestamp,
        mut stages: Stages,
    ) -> Result<Rendered> {
        let Subject { animation, name, .. } = subject;
        let start = self.clock.now();
        let known = self.manifest(&animation).await?;
        let look = self.clock.now().since(start);
        let pending = known.as_ref().and_then(|known| known.manifest.pending_parts(&name, &tag.version));
        if !pending.is_some_and(|pending| pending.is_empty()) {
            self.wake_lost_parts(&animation, &name, &tag, count, uploaded).await?;
        }
        let fact = Fact::Split(name.clone(), tag.version);
        let folded = self.fold_from(&animation, &fact, Age::Old, (ManifestPrefix::from(known), look)).await?;
        stages.fold = self.clock.now().since(start);
        Ok(Rendered { animation, script: Some(name), outcome: Outcome::Present, folded, stages })
    }

    async fn wake_lost_parts(
        &self,
        animation: &Animation,
        name: &ScriptName,
        tag: &Tag,
        count: NonZeroU64,
        uploaded: Timestamp,
    ) -> Result<()> {
        let prefix = format!("{}{name}@{tag}/", animation.parts());
        let mut old = self.list_ranges(ListRequest::all(prefix), Vec::new()).await?;
        old.retain(|part| part.modified <= uploaded);
        if old.is_empty() {
            return Ok(());
        }
        let old: BTreeSet<String> = old.into_iter().map(|part| part.key).collect();
        let missing = self.missing_parts(animation, name, &tag.version, count).await?;
        let parts = missing.into_iter().map(|number| part_object(animation, name, tag, number, count));
        let lost: Vec<_> = parts.filter(|(key, _)| old.contains(key)).collect();
        let puts = lost.into_iter().map(|(key, body)| async move { self.put(&key, body).await.map(drop) });
        let concurrency = self.policy.concurrency;
        stream::iter(puts).map(Ok).try_for_each_concurrent(concurrency, |put| put).await
    }
}

fn reason_body(key: &str, reason: &Reason) -> Result<Bytes> {
    let malformed =
        |source: serde_json::Error| Error::Malformed { key: key.to_owned(), source: source.into() };
    serde_json::to_vec(reason).map(Bytes::from).map_err(malformed)
}

/// Returns the object that triggers an invocation for a part.
fn part_object(
    animation: &Animation,
    name: &ScriptName,
    tag: &Tag,
    number: NonZeroU64,
    of: NonZeroU64,
) -> (String, Bytes) {
    let (script, version) = (animation.script(name), &tag.version);
    let body = serde_json::json!({ "script": script, "version": version, "trace": number, "of": of });
    let (animation, name, tag) = (animation.clone(), name.clone(), tag.clone());
    (Key::Part { animation, name, tag, number }.to_string(), body.to_string().into())
}

impl VersionResult {
    pub(crate) fn fact(self, name: ScriptName, version: ETag, part: Part) -> Fact {
        match self {
            VersionResult::Split { .. } => Fact::Split(name, version),
            VersionResult::Drawn(pixels) => Fact::Drawn(name, version, part, pixels),
            VersionResult::Faulty(receipt) | VersionResult::Waits(receipt) => {
                Fact::Faulty(name, version, part, receipt)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{Metadata, ObjectInfo};

    fn subject(key: &str) -> Option<Subject> {
        Subject::of(key.parse().unwrap())
    }

    fn script(version: &str) -> Object {
        let (etag, modified) = (ETag::new(version), Timestamp(7));
        Object { info: ObjectInfo { etag, size: 1, modified, metadata: Metadata::new() }, body: "x".into() }
    }

    #[test]
    fn events_are_about_scripts_and_parts_of_one_version() {
        let of = |key: &str| {
            let Subject { name, part, only, .. } = subject(key)?;
            Some((name.to_string(), part.map(NonZeroU64::get), only.map(|only| only.to_string())))
        };
        let one = || "1".to_owned();
        assert_eq!(of("scripts/a/1.txt"), Some((one(), None, None)));
        assert_eq!(of("retries/a/1@v-p1/2"), Some((one(), None, None)));
        assert_eq!(of("retries/a/1@v-p1/3/2"), Some((one(), Some(3), Some("v".into()))));
        assert_eq!(of("parts/a/1@v-p1/3.json"), Some((one(), Some(3), Some("v".into()))));
        assert_eq!(of("parts/a/1@v-p1/2-of-5.band-0.json"), Some((one(), None, Some("v".into()))));
        assert_eq!(of("parts/a/1@v-p1/3/2-of-5.band-0.json"), Some((one(), Some(3), Some("v".into()))));
        assert_eq!(of("frames/a/1@v-p1.png"), None);
        assert_eq!(of("manifests/a.json"), None);
    }

    #[test]
    fn a_script_as_it_is_now_decides_what_is_due() {
        let name = || ScriptName::new("1").unwrap();
        let whole = subject("scripts/a/1.txt").unwrap();
        let part = subject("parts/a/1@v-p1/3.json").unwrap();
        for subject in [&whole, &part] {
            assert_eq!(subject.due(None), Due::Nothing(Outcome::Gone, Fact::Absent(name())));
            assert!(matches!(subject.due(Some(script("v"))), Due::Version(Script { uploaded, .. })
                if uploaded == Timestamp(7)));
        }
        // An event about an older version is an event for the current one; a part is of one version alone.
        assert!(matches!(whole.due(Some(script("w"))), Due::Version(Script { version, .. })
            if version == ETag::new("w")));
        let superseded = Due::Nothing(Outcome::Superseded, Fact::Version(name(), ETag::new("w")));
        assert_eq!(part.due(Some(script("w"))), superseded);
    }
}
