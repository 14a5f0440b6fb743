//! The environment of a step: the store, the clock, randomness, its request id, and its policy.
//!
//! All requests go through this module, so a busy store and a lost reply are handled in one place. A request that can
//! be repeated without harm is repeated a few times, with growing random pauses. Conditional writes of the manifest and
//! the GIF are not repeated: after a lost reply, the steps read the object.

use std::future::Future;
use std::time::Duration;

use bytes::Bytes;

use crate::keys::{Animation, Generation};
use crate::manifest::{Beginning, Fact, Frame, Head, Manifest, Settings, frames_of};
use crate::reconcile::{Results, Scripts, reconcile};
use crate::store::{ETag, ListPage, ListRequest, Object, ObjectInfo, PutOptions, Store};
use crate::{Clock, Error, Randomness, Result, Timestamp, found};

/// The constants of the protocol. Each default has its reason; tests and the local invoker shorten some.
#[derive(Debug, Clone, PartialEq)]
pub struct Policy {
    /// The renderer's pixel version, for the tags of frames that are drawn and triggered.
    pub pixels: u32,
    /// The age that the newest script must have before a GIF is made, if `animation.json` does not say how many frames
    /// to wait for. 5 s: longer than the gaps of an upload, and short enough to wait for.
    pub quiet: Duration,
    /// The longest pause before a listing, as a multiple of the time that a read of the manifest takes. With many
    /// finishers at once, one listing then serves them all, and where requests are fast the listing comes soon.
    pub pause_looks: u32,
    /// The longest pause, however long a read takes. With it the last finisher still claims within a second.
    pub pause_cap: Duration,
    /// The age of a manifest with one page of frames at which it is written again only to show people the progress.
    pub fresh: Duration,
    /// The number of bytes of a manifest that are read to see whether it covers a result. 32 KiB hold all of it up to
    /// some 300 frames.
    pub glimpse: u64,
    /// The maximum number of frames of an animation; `None` means any number. An animation with more frames is failed,
    /// and no more of them are drawn. This bounds the cost that a user who may upload can cause for others.
    pub most_frames: Option<u64>,
    /// The time without any progress after which the sweep triggers pending frames; it doubles with each attempt. 15
    /// min: as long as an invocation may run.
    pub stuck_after: Duration,
    /// The number of triggers after which a pending frame is given up.
    pub attempts: u64,
    /// Whether the functions have just been restarted. Then pending frames are triggered at once, interrupted attempts
    /// do not count, and an earlier lease has no holder.
    pub is_fresh_start: bool,
    /// The age of a superseded frame at which the sweep deletes it. A week: a script that is changed back
    /// finds its old frame.
    pub superseded_after: Duration,
    /// The number of times that a harmless request is sent before the step fails.
    pub request_attempts: u32,
    /// The first pause before a request is repeated; doubles each time.
    pub request_pause: Duration,
    /// The number of concurrent requests of one kind.
    pub concurrency: usize,
    /// The number of frames that are fetched ahead of the encoder.
    pub prefetch: usize,
    /// The time before its deadline at which the assembler stops.
    pub margin: Duration,
    /// The time before the margin that the assembler keeps free for one more frame and for writing a checkpoint, as a
    /// multiple of the longest time that a frame has taken. A checkpoint takes about as long as 5 to 10 frames.
    pub spare_frames: u32,
    /// The time before its deadline at which a drawing is stopped: enough to report the failure.
    pub draw_margin: Duration,
}

impl Policy {
    /// Returns the default constants, for a renderer of this pixel version.
    pub fn new(pixels: u32) -> Self {
        Policy {
            pixels,
            quiet: Duration::from_secs(5),
            pause_looks: 8,
            pause_cap: Duration::from_millis(500),
            fresh: Duration::from_secs(10),
            glimpse: 32 * 1024,
            most_frames: None,
            stuck_after: Duration::from_secs(15 * 60),
            attempts: 3,
            is_fresh_start: false,
            superseded_after: Duration::from_secs(7 * 24 * 3600),
            request_attempts: 5,
            request_pause: Duration::from_millis(50),
            concurrency: 64,
            prefetch: 8,
            margin: Duration::from_secs(5),
            spare_frames: 12,
            draw_margin: Duration::from_millis(500),
        }
    }
}

/// One invocation of a function, or of a command that takes part in the protocol.
#[derive(Debug)]
pub struct Invocation<'a, S, C> {
    pub(crate) store: &'a S,
    pub(crate) clock: &'a C,
    pub(crate) random: &'a Randomness,
    pub(crate) policy: &'a Policy,
    request_id: &'a str,
    pub(crate) deadline: Option<Timestamp>,
    #[cfg(any(test, feature = "simulation"))]
    mutation: Option<Mutation>,
    #[cfg(any(test, feature = "simulation"))]
    replay_state: Option<&'a ReplayState>,
}

/// The latest declaration of an invocation about the values on which its remaining steps depend. The search of small
/// worlds reads it.
#[cfg(any(test, feature = "simulation"))]
#[derive(Debug, Default)]
pub struct ReplayState(std::sync::Mutex<Option<String>>);

#[cfg(any(test, feature = "simulation"))]
impl ReplayState {
    /// Takes the text reported since the last call.
    pub fn take(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take()
    }
}

/// A rule of the protocol that the simulation breaks on purpose, to check that its predicates detect it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mutation {
    /// The fold does not list again after its commit.
    SkipSecondListing,
    /// The claim is put before the commit to which it belongs.
    ClaimBeforeCommit,
    /// The manifest is put without its condition.
    DropIfMatch,
    /// An invocation stops when the manifest is covered by its own unfinished commit.
    LeaveOwnCommit,
    /// Each invocation that finds the set complete leaves the claim to another one, even the writer of the revision.
    NeverClaim,
    /// The assembler ends as soon as a frame is pending, although it has just written.
    AssemblerLeavesEarly,
    /// The assembler does not check again after it has put the GIF, nor after it has released the lease.
    AssemblerDoesNotLookAgain,
    /// The GIF is put without its condition.
    DropGifCondition,
    /// A frame is joined although one of its bands is missing.
    JoinTooEarly,
    /// An unfinished GIF is continued, whatever set it belongs to.
    TakeUpAnyCheckpoint,
    /// A finisher stops for any frame that the manifest shows as pending, without a check whether it is still to come.
    LeaveForAnyFrame,
    /// The files that a script names are not checked again after their versions were put.
    FilesNotLookedAtAgain,
}

impl Mutation {
    /// All mutations, in the order of their definition.
    pub const ALL: [Mutation; 12] = [
        Mutation::SkipSecondListing,
        Mutation::ClaimBeforeCommit,
        Mutation::DropIfMatch,
        Mutation::LeaveOwnCommit,
        Mutation::NeverClaim,
        Mutation::AssemblerLeavesEarly,
        Mutation::AssemblerDoesNotLookAgain,
        Mutation::DropGifCondition,
        Mutation::JoinTooEarly,
        Mutation::TakeUpAnyCheckpoint,
        Mutation::LeaveForAnyFrame,
        Mutation::FilesNotLookedAtAgain,
    ];
}

/// A manifest as it was read or written.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    /// The manifest; an empty one if it cannot be read, which agrees with no listing.
    pub(crate) manifest: Manifest,
    pub(crate) etag: ETag,
    /// The time when it was written.
    pub(crate) modified: Timestamp,
    /// The document if it cannot be read. It is set aside when a new one is written.
    pub(crate) unreadable: Option<Bytes>,
}

impl Known {
    fn of(animation: &Animation, object: Object) -> Self {
        let Object { info: ObjectInfo { etag, modified, .. }, body } = object;
        match Manifest::decode(animation, &body) {
            Ok(manifest) => Known { manifest, etag, modified, unreadable: None },
            Err(_) => Known { manifest: blank(animation), etag, modified, unreadable: Some(body) },
        }
    }
}

/// Returns the stand-in for a manifest that cannot be read.
fn blank(animation: &Animation) -> Manifest {
    let nothing = (&Scripts::default(), &Results::default());
    let mut manifest = reconcile(animation, nothing.0, nothing.1, &Settings::absent());
    // No set has this hash.
    manifest.head.generation = Generation::of_hash("0".repeat(32));
    manifest
}

/// The part of a manifest that one small request shows.
#[derive(Debug)]
pub(crate) enum ManifestPrefix {
    /// There is no manifest.
    Nothing,
    /// The manifest cannot be read.
    Unreadable(Known),
    /// The request has read the whole manifest.
    Whole(Known),
    /// The beginning of a larger manifest.
    Start { beginning: Beginning, info: ObjectInfo },
}

impl From<Option<Known>> for ManifestPrefix {
    fn from(known: Option<Known>) -> Self {
        match known {
            None => ManifestPrefix::Nothing,
            Some(known) if known.unreadable.is_some() => ManifestPrefix::Unreadable(known),
            Some(known) => ManifestPrefix::Whole(known),
        }
    }
}

impl ManifestPrefix {
    pub(crate) fn head(&self) -> Option<&Head> {
        match self {
            ManifestPrefix::Nothing | ManifestPrefix::Unreadable(_) => None,
            ManifestPrefix::Whole(known) => Some(&known.manifest.head),
            ManifestPrefix::Start { beginning, .. } => Some(&beginning.head),
        }
    }

    /// The manifest's frames, or some of the pending ones.
    pub(crate) fn frames(&self) -> &[Frame] {
        match self {
            ManifestPrefix::Nothing | ManifestPrefix::Unreadable(_) => &[],
            ManifestPrefix::Whole(known) => &known.manifest.frames,
            ManifestPrefix::Start { beginning, .. } => &beginning.awaited,
        }
    }

    /// When the manifest was written.
    pub(crate) fn modified(&self) -> Timestamp {
        match self {
            ManifestPrefix::Nothing => Timestamp::default(),
            ManifestPrefix::Unreadable(known) | ManifestPrefix::Whole(known) => known.modified,
            ManifestPrefix::Start { info, .. } => info.modified,
        }
    }

    /// 0 if there is none that can be read.
    pub(crate) fn revision(&self) -> u64 {
        self.head().map_or(0, |head| head.revision)
    }
}

impl<'a, S, C> Invocation<'a, S, C> {
    /// `request_id` identifies the event; the platform's retries of an event share it. `random` spreads invocations
    /// that would collide.
    pub fn new(
        store: &'a S,
        clock: &'a C,
        random: &'a Randomness,
        policy: &'a Policy,
        request_id: &'a str,
    ) -> Self {
        Invocation {
            store,
            clock,
            random,
            policy,
            request_id,
            deadline: None,
            #[cfg(any(test, feature = "simulation"))]
            mutation: None,
            #[cfg(any(test, feature = "simulation"))]
            replay_state: None,
        }
    }

    /// The event that is worked on.
    pub fn request_id(&self) -> &str {
        self.request_id
    }

    /// Sets the deadline at which the platform kills the invocation.
    pub fn until(self, deadline: Timestamp) -> Self {
        Invocation { deadline: Some(deadline), ..self }
    }

    /// Makes the invocation break a rule.
    #[cfg(any(test, feature = "simulation"))]
    pub fn breaking(self, mutation: Option<Mutation>) -> Self {
        Invocation { mutation, ..self }
    }

    /// Makes the invocation store its replay state there.
    #[cfg(any(test, feature = "simulation"))]
    pub fn leaving(self, replay_state: &'a ReplayState) -> Self {
        Invocation { replay_state: Some(replay_state), ..self }
    }

    /// Declares that the remaining steps of this invocation depend only on these values, besides its event and the
    /// replies to come. The search of small worlds drops the invocation's earlier history.
    #[cfg(any(test, feature = "simulation"))]
    pub(crate) fn forget_history_before(&self, what: &dyn std::fmt::Debug) {
        if let Some(ReplayState(replay_state)) = self.replay_state {
            *replay_state.lock().unwrap_or_else(std::sync::PoisonError::into_inner) =
                Some(format!("{what:?}"));
        }
    }

    #[cfg(not(any(test, feature = "simulation")))]
    #[expect(clippy::unused_self, reason = "without the search nobody asks")]
    pub(crate) fn forget_history_before(&self, _: &dyn std::fmt::Debug) {}

    /// Returns whether this rule is to be broken.
    #[cfg(any(test, feature = "simulation"))]
    pub(crate) fn breaks(&self, rule: Mutation) -> bool {
        self.mutation == Some(rule)
    }

    #[cfg(not(any(test, feature = "simulation")))]
    #[expect(clippy::unused_self, reason = "without the simulation no rule is broken")]
    pub(crate) fn breaks(&self, _: Mutation) -> bool {
        false
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Reads an object. Returns `None` if there is none.
    pub(crate) async fn get(&self, key: &str) -> Result<Option<Object>> {
        found(self.persist(|| self.store.get(key)).await)
    }

    /// Reads an object's first bytes, at least one more than `most` if there are more. Returns `None` if there is no
    /// object.
    pub(crate) async fn get_start(&self, key: &str, most: u64) -> Result<Option<Object>> {
        let range = 0..most.saturating_add(1);
        found(self.persist(|| self.store.get_range(key, range.clone())).await)
    }

    /// Reads the object's data except its body. Returns `None` if there is no such object.
    pub(crate) async fn head(&self, key: &str) -> Result<Option<ObjectInfo>> {
        found(self.persist(|| self.store.head(key)).await)
    }

    /// Puts an object, which may be put twice without harm.
    pub(crate) async fn put(&self, key: &str, body: Bytes) -> Result<ETag> {
        let options = || PutOptions::always().content_type("application/json");
        self.persist(|| self.store.put(key, body.clone(), options())).await
    }

    /// Puts an image in place of one that cannot be read.
    pub(crate) async fn put_image(&self, key: &str, body: Bytes) -> Result<()> {
        let options = || PutOptions::always().content_type("image/png");
        self.persist(|| self.store.put(key, body.clone(), options())).await.map(drop)
    }

    /// Puts a receipt. Returns `None` if it exists already.
    pub(crate) async fn put_receipt(
        &self,
        key: &str,
        body: Bytes,
        content_type: &'static str,
    ) -> Result<Option<ETag>> {
        let options = || PutOptions::if_absent().content_type(content_type);
        match self.persist(|| self.store.put(key, body.clone(), options())).await {
            Ok(etag) => Ok(Some(etag)),
            Err(Error::PreconditionFailed { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    pub(crate) async fn delete(&self, key: &str) -> Result<()> {
        self.persist(|| self.store.delete(key)).await
    }

    /// Reads a page of a listing.
    pub(crate) async fn list(&self, request: ListRequest) -> Result<ListPage> {
        self.persist(|| self.store.list(request.clone())).await
    }

    pub(crate) async fn manifest(&self, animation: &Animation) -> Result<Option<Known>> {
        Ok(self.get(&animation.manifest()).await?.map(|object| Known::of(animation, object)))
    }

    /// Reads the manifest's beginning, or all of it if it is small.
    pub(crate) async fn read_prefix(&self, animation: &Animation) -> Result<ManifestPrefix> {
        let key = animation.manifest();
        let read = self.persist(|| self.store.get_range(&key, 0..self.policy.glimpse)).await;
        let Some(object) = found(read)? else { return Ok(ManifestPrefix::Nothing) };
        if object.info.size == object.body.len() as u64 {
            return Ok(Some(Known::of(animation, object)).into());
        }
        match Beginning::decode(animation, &object.body) {
            Ok(Some(beginning)) => Ok(ManifestPrefix::Start { beginning, info: object.info }),
            Ok(None) | Err(_) => Ok(self.manifest(animation).await?.into()),
        }
    }

    /// Returns whether the manifest shows the fact. If the manifest is large, the lines about the fact are read. If it
    /// was replaced meanwhile, it does not show the fact.
    pub(crate) async fn shows(
        &self,
        animation: &Animation,
        glimpse: &ManifestPrefix,
        fact: &Fact,
    ) -> Result<bool> {
        let (beginning, info) = match glimpse {
            ManifestPrefix::Nothing | ManifestPrefix::Unreadable(_) => return Ok(false),
            ManifestPrefix::Whole(known) => return Ok(known.manifest.shows(fact)),
            ManifestPrefix::Start { beginning, info } => (beginning, info),
        };
        let Some((name, part)) = fact.subject() else {
            return Ok(fact.is_shown_by(&beginning.head, &[]));
        };
        let (key, range) = (animation.manifest(), beginning.lines_of(name, part, info.size));
        let Some(lines) = found(self.persist(|| self.store.get_range(&key, range.clone())).await)? else {
            return Ok(false);
        };
        // Lines that cannot be read show nothing.
        let frames = frames_of(animation, &lines.body).unwrap_or_default();
        Ok(lines.info.etag == info.etag && fact.is_shown_by(&beginning.head, &frames))
    }

    /// Returns whether this invocation, or an earlier attempt at the same event, wrote the manifest.
    pub(crate) fn is_own(&self, head: &Head) -> bool {
        head.writer == self.request_id
    }

    /// Waits for a random time, which grows with the time that a read of the manifest takes.
    pub(crate) async fn pause(&self, look: Duration) {
        let most = look.saturating_mul(self.policy.pause_looks).min(self.policy.pause_cap);
        self.clock.sleep(self.random.up_to(most)).await;
    }

    /// Sends a request until it gets a final reply, or its attempts are used up.
    async fn persist<T, F>(&self, request: impl Fn() -> F) -> Result<T>
    where
        F: Future<Output = Result<T>>,
    {
        let mut pause = self.policy.request_pause;
        for _ in 1..self.policy.request_attempts {
            match request().await {
                Err(error) if error.is_retryable() => {
                    self.clock.sleep(self.random.up_to(pause)).await;
                    pause = pause.saturating_mul(2);
                }
                answer => return answer,
            }
        }
        request().await
    }
}
