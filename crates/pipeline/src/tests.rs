//! Steps on a memory store in which another client acts at the worst moment. There is one test for each rule that
//! matters only then.

mod assemblies;
mod bands;
mod builds;
mod failures;
mod files;
mod folds;
mod observations;
mod orders;
mod outputs;
mod pages;
mod refusals;
mod renders;
mod sweeps;

use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bytes::Bytes;
use rayfold_scene::{AnimationSettings, Container};

use crate::assemble::Assembled;
use crate::failure::{End, Failure, Recorded};
use crate::fakes::{InstantRenderer, Listed, picture};
use crate::keys::{Animation, Key, ScriptName};
use crate::manifest::{FrameState, Manifest, Reason, Status};
use crate::render::{Outcome, Rendered};
use crate::retry::{Scope, retry};
use crate::store::{
    Bucket, ETag, ListPage, ListRequest, Metadata, Object, ObjectInfo, Patch, PutOptions, Store,
    UnfinishedUpload, Upload,
};
use crate::sweep::{Visit, visit};
use crate::{
    Animator, Clock, Encoding, Error, Invocation, Policy, Randomness, Result, Timestamp, Unfit, assemble,
    record_failure, render_frame,
};

/// A clock that jumps to each time that a task waits for.
#[derive(Debug, Clone)]
struct JumpingClock(Arc<AtomicU64>);

impl Clock for JumpingClock {
    fn now(&self) -> Timestamp {
        Timestamp(self.0.load(Ordering::Relaxed))
    }

    async fn sleep(&self, duration: Duration) {
        self.0.fetch_add(duration.as_millis() as u64, Ordering::Relaxed);
    }
}

type Meddler = Box<dyn FnMut(&str, &mut Bucket, Timestamp) + Send>;

/// Answers a request with a name such as `put frames/…` with an error. The request has no effect.
type Refuser = Box<dyn FnMut(&str) -> Option<Error> + Send>;

/// A bucket in which another client acts before a request with a name such as `put frames/…`.
struct Meddled {
    bucket: Arc<Mutex<Bucket>>,
    clock: JumpingClock,
    meddler: Mutex<Option<Meddler>>,
    refuser: Arc<Mutex<Option<Refuser>>>,
}

fn asked(refuser: &Mutex<Option<Refuser>>, action: &str, key: &str) -> Result<()> {
    let refuse = |refuser: &mut Refuser| refuser(&format!("{action} {key}"));
    refuser.lock().unwrap().as_mut().and_then(refuse).map_or(Ok(()), Err)
}

impl Meddled {
    fn meet(&self, action: &str, key: &str) -> Result<std::sync::MutexGuard<'_, Bucket>> {
        asked(&self.refuser, action, key)?;
        let mut bucket = self.bucket.lock().unwrap();
        if let Some(meddler) = self.meddler.lock().unwrap().as_mut() {
            meddler(&format!("{action} {key}"), &mut bucket, self.clock.now());
        }
        Ok(bucket)
    }
}

impl Store for Meddled {
    type Upload = Pieces;

    async fn get(&self, key: &str) -> Result<Object> {
        self.meet("get", key)?.get(key)
    }

    async fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
        self.meet("get", key)?.get_range(key, range)
    }

    async fn head(&self, key: &str) -> Result<ObjectInfo> {
        self.meet("head", key)?.head(key)
    }

    async fn put(&self, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
        self.meet("put", key)?.put(self.clock.now(), key, body, options)
    }

    async fn delete(&self, key: &str) -> Result<()> {
        self.meet("delete", key)?.delete(key);
        Ok(())
    }

    async fn list(&self, request: ListRequest) -> Result<ListPage> {
        Ok(self.meet("list", &request.prefix)?.list(&request))
    }

    async fn upload(&self, key: &str, options: PutOptions) -> Result<Pieces> {
        Ok(self.take_up(key, options, UnfinishedUpload::default()))
    }

    fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Pieces {
        let (bucket, refuser) = (self.bucket.clone(), self.refuser.clone());
        Pieces { bucket, refuser, clock: self.clock.clone(), key: key.to_owned(), options, unfinished }
    }
}

/// The number of bytes of a part of an upload.
const PART: usize = 8;

/// An upload in pieces. Its requests are named `part`, `finish` and `abort`.
struct Pieces {
    bucket: Arc<Mutex<Bucket>>,
    refuser: Arc<Mutex<Option<Refuser>>>,
    clock: JumpingClock,
    key: String,
    options: PutOptions,
    unfinished: UnfinishedUpload,
}

impl Pieces {
    fn id(&self) -> Option<u64> {
        self.unfinished.id.as_ref().map(|id| id.parse().unwrap())
    }
}

impl Upload for Pieces {
    async fn write(&mut self, bytes: Bytes) -> Result<()> {
        let mut tail = [&self.unfinished.tail[..], &bytes].concat();
        while tail.len() >= PART && !self.options.is_start_last {
            asked(&self.refuser, "part", &self.key)?;
            let rest = tail.split_off(PART);
            let mut bucket = self.bucket.lock().unwrap();
            let id = self.id().unwrap_or_else(|| bucket.begin_upload());
            self.unfinished.id = Some(id.to_string());
            let part = bucket.put_part(&self.key, id, self.unfinished.parts.len() + 1, tail.into())?;
            self.unfinished.parts.push(part);
            tail = rest;
        }
        self.unfinished.tail = tail.into();
        Ok(())
    }

    async fn finish(mut self, patch: Option<Patch>) -> Result<ETag> {
        let mut tail = self.unfinished.tail.to_vec();
        patch.iter().for_each(|patch| patch.apply(&mut tail));
        self.unfinished.tail = tail.into();
        asked(&self.refuser, "finish", &self.key)?;
        let (now, id) = (self.clock.now(), self.id());
        let (mut bucket, UnfinishedUpload { parts, tail, .. }) =
            (self.bucket.lock().unwrap(), self.unfinished);
        match id {
            Some(id) => bucket.complete_upload(now, &self.key, id, (&parts, &tail), self.options),
            None => bucket.put(now, &self.key, tail, self.options),
        }
    }

    async fn abort(self) -> Result<()> {
        asked(&self.refuser, "abort", &self.key)?;
        if let Some(id) = self.id() {
            self.bucket.lock().unwrap().abort_upload(id);
        }
        Ok(())
    }

    fn leave(self) -> UnfinishedUpload {
        self.unfinished
    }
}

/// The bands of a frame that is too big.
const BANDS: NonZeroU64 = NonZeroU64::new(3).unwrap();

/// A renderer that lists frames, and takes time for it.
#[derive(Clone)]
struct Joiner {
    clock: JumpingClock,
    /// The time that each frame takes.
    takes: Duration,
    trouble: Option<Trouble>,
}

/// The step at which the encoder refuses a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trouble {
    Begin,
    /// The encoder refuses at the beginning of this kind of file.
    Output(Container),
    Suspend,
    Finish,
}

struct Joined {
    joiner: Joiner,
    listed: Listed,
    alpha: bool,
}

impl Joiner {
    fn meets(&self, trouble: Trouble) -> Result<(), Reason> {
        if self.trouble == Some(trouble) { Err(Reason::new(format!("{trouble:?}"))) } else { Ok(()) }
    }
}

impl Animator for Joiner {
    type Encoding = Joined;

    fn begin(&self, settings: &AnimationSettings, output: Container, alpha: bool) -> Result<Joined, Reason> {
        self.meets(Trouble::Begin)?;
        self.meets(Trouble::Output(output))?;
        Ok(Joined { joiner: self.clone(), listed: Listed::new(settings, output), alpha })
    }

    async fn resume(&self, _: &AnimationSettings, _: Container, state: Bytes) -> Result<Joined, Reason> {
        Ok(Joined { joiner: self.clone(), listed: Listed::resume(&state)?, alpha: false })
    }
}

impl Encoding for Joined {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        self.joiner.clock.sleep(self.joiner.takes).await;
        if frame == "garbled" {
            return Err(Unfit::Corrupt(Reason::new("no picture")));
        }
        if frame.ends_with(b"frame odd") {
            return Err(Unfit::Unlike(Reason::new("odd")));
        }
        if frame.ends_with(b"frame clear") && !self.alpha {
            return Err(Unfit::Alpha);
        }
        // One goes out when the next one comes.
        let before = self.listed.take();
        self.listed.push(&frame);
        Ok(before)
    }

    async fn finish(mut self) -> Result<(Bytes, Option<Patch>), Reason> {
        self.joiner.meets(Trouble::Finish)?;
        Ok(self.listed.finish())
    }

    async fn suspend(self) -> Result<Bytes, Reason> {
        self.joiner.meets(Trouble::Suspend)?;
        self.listed.suspend()
    }
}

struct World {
    store: Meddled,
    random: Randomness,
    policy: Policy,
    requests: AtomicU64,
    /// The time at which the platform ends the invocation.
    deadline: Option<Timestamp>,
}

impl World {
    fn new() -> Self {
        let clock = JumpingClock(Arc::new(AtomicU64::new(1_000_000)));
        let (bucket, refuser) = (Arc::default(), Arc::default());
        let store = Meddled { bucket, clock, meddler: Mutex::default(), refuser };
        World {
            store,
            random: Randomness::seeded(1),
            policy: Policy::new(1),
            requests: AtomicU64::new(0),
            deadline: None,
        }
    }

    fn film() -> Animation {
        Animation::new("film").unwrap()
    }

    fn put(&self, key: &str, text: &str) -> ETag {
        let body = Bytes::copy_from_slice(text.as_bytes());
        let mut bucket = self.store.bucket.lock().unwrap();
        bucket.put(self.store.clock.now(), key, body, PutOptions::always()).unwrap()
    }

    /// Puts a GIF with the generation of a set.
    fn put_gif(&self, generation: &str) {
        let metadata: Metadata = [("generation".to_owned(), generation.to_owned())].into();
        let options = PutOptions { metadata, ..PutOptions::always() };
        let mut bucket = self.store.bucket.lock().unwrap();
        bucket.put(self.store.clock.now(), "animations/film.gif", "GIF".into(), options).unwrap();
    }

    fn keys(&self, prefix: &str) -> Vec<String> {
        let bucket = self.store.bucket.lock().unwrap();
        bucket.keys().filter(|key| key.starts_with(prefix)).map(str::to_owned).collect()
    }

    fn meddle(&self, meddler: impl FnMut(&str, &mut Bucket, Timestamp) + Send + 'static) {
        *self.store.meddler.lock().unwrap() = Some(Box::new(meddler));
    }

    fn refuse(&self, refuser: impl FnMut(&str) -> Option<Error> + Send + 'static) {
        *self.store.refuser.lock().unwrap() = Some(Box::new(refuser));
    }

    async fn with<T>(&self, step: impl AsyncFnOnce(&Invocation<'_, Meddled, JumpingClock>) -> T) -> T {
        let id = format!("request-{}", self.requests.fetch_add(1, Ordering::Relaxed));
        let invocation = Invocation::new(&self.store, &self.store.clock, &self.random, &self.policy, &id);
        match self.deadline {
            Some(deadline) => step(&invocation.until(deadline)).await,
            None => step(&invocation).await,
        }
    }

    fn modified(&self, key: &str) -> Timestamp {
        self.store.bucket.lock().unwrap().head(key).unwrap().modified
    }

    async fn later(&self, by: Duration) {
        self.store.clock.sleep(by).await;
    }

    async fn render(&self, key: &str) -> Outcome {
        self.try_render(key).await.unwrap().outcome
    }

    async fn try_render(&self, key: &str) -> Result<Rendered> {
        self.with(async |invocation| render_frame(invocation, &InstantRenderer { bands: BANDS }, key).await)
            .await
    }

    /// Returns a joiner that takes no time and never fails.
    fn joiner(&self) -> Joiner {
        Joiner { clock: self.store.clock.clone(), takes: Duration::ZERO, trouble: None }
    }

    async fn assemble(&self, joiner: &Joiner, claim: &str) -> Result<Assembled> {
        let assembled = self.try_assemble(joiner, claim).await?;
        Ok(assembled.expect("nobody else is at it"))
    }

    /// Returns `None` if another assembler works on it.
    async fn try_assemble(&self, joiner: &Joiner, claim: &str) -> Result<Option<Assembled>> {
        self.with(async |invocation| assemble(invocation, joiner, claim).await).await
    }

    async fn upload(&self, file: &str, text: &str) -> Outcome {
        let key = format!("scripts/film/{file}");
        self.put(&key, text);
        self.render(&key).await
    }

    async fn visit(&self) -> Visit {
        self.with(async |invocation| visit(invocation, &World::film()).await.unwrap()).await
    }

    async fn record(&self, key: &str, version: Option<ETag>, end: End) -> Recorded {
        let request_id = "given-up".to_owned();
        let failure = Failure { key: key.to_owned(), version, attempts: 3, end, request_id };
        self.with(async |invocation| record_failure(invocation, &failure).await.unwrap()).await
    }

    fn manifest(&self) -> Manifest {
        let body = self.store.bucket.lock().unwrap().get("manifests/film.json").unwrap().body;
        Manifest::decode(&World::film(), &body).unwrap()
    }
}

#[tokio::test]
async fn a_gif_skips_no_frame_that_is_gone() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    world.upload("2.txt", "frame 2").await;
    let claim = world.keys("assemblies/").pop().unwrap();
    // Between the listing and the reading of a frame it goes; then it is not looked for again.
    world.meddle(|request, bucket, _| {
        if request.starts_with("get frames/film/1@") {
            let key = request.strip_prefix("get ").unwrap();
            bucket.delete(key);
        }
    });
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.built, assembled.status), (0, Status::Rendering));
}

/// Deletes all objects but this one.
fn delete_all_but(bucket: &mut Bucket, kept: &str) {
    let keys: Vec<String> = bucket.keys().filter(|key| *key != kept).map(str::to_owned).collect();
    for key in keys {
        bucket.delete(&key);
    }
}

#[tokio::test]
async fn what_comes_after_a_removal_brings_nothing_back() {
    let assemble_in =
        async |world: &World, claim: &str| world.assemble(&world.joiner(), claim).await.unwrap();
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    let claim = world.keys("assemblies/").pop().unwrap();
    // An assembler is at its second round, and holds the lease.
    let lease = Key::Lease { animation: World::film() }.to_string();
    let mut reads = 0;
    world.meddle(move |request, bucket, _| {
        reads += u32::from(request == "get manifests/film.json");
        if reads == 2 {
            assert!(bucket.head(&lease).is_ok());
            delete_all_but(bucket, &lease);
            reads += 1;
        }
    });
    assert_eq!(assemble_in(&world, &claim).await.built, 0);
    assert_eq!(world.keys(""), [""; 0], "the lease is given up");
    // Late events, of a script and of a set whose GIF came late, too.
    world.render("scripts/film/1.txt").await;
    assert_eq!(world.keys(""), [""; 0]);
    world.put("animations/film.gif", "GIF");
    assemble_in(&world, &claim).await;
    assert_eq!(world.keys(""), [""; 0]);
}

#[tokio::test]
async fn what_comes_back_while_its_results_are_tidied_away_is_woken() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    world.upload("1.txt", "frame 2").await;
    world.store.clock.sleep(Duration::from_secs(8 * 24 * 3600)).await;
    world.meddle(|request, bucket, now| {
        if request.starts_with("delete frames/film/1@") {
            bucket.put(now, "scripts/film/1.txt", "frame 1".into(), PutOptions::always()).unwrap();
        }
    });
    let visit = world.visit().await;
    assert_eq!((visit.deleted, visit.woken), (1, 1));
    let [retry] = &world.keys("retries/")[..] else { panic!("{:?}", world.keys("retries/")) };
    assert_eq!(world.render(retry).await, Outcome::Drawn);
}

#[tokio::test]
async fn a_time_out_is_blamed_on_no_other_version() {
    let world = World::new();
    let before = world.put("scripts/film/1.txt", "hang 1");
    let now = world.put("scripts/film/1.txt", "frame 1");
    for (end, why) in [(End::TimedOut, "timed out"), (End::Died, "died")] {
        let recorded = world.record("scripts/film/1.txt", Some(before.clone()), end.clone()).await;
        assert!(matches!(recorded, Recorded::Woken { .. }), "{why}: {recorded:?}");
        assert!(world.keys("frames/film/1@").is_empty(), "{why}");
    }
    let recorded = world.record("scripts/film/1.txt", Some(now), End::TimedOut).await;
    assert!(matches!(recorded, Recorded::GivenUp(_)), "{recorded:?}");
    let FrameState::Failed(fault) = &world.manifest().frames[0].state else { panic!() };
    assert_eq!(fault.reason.as_ref().unwrap().message, "timed out in each of 3 attempts");
}

#[tokio::test]
async fn a_failure_record_of_what_has_a_result_changes_nothing() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    let version = world.store.bucket.lock().unwrap().head("scripts/film/1.txt").unwrap().etag;
    let before = world.keys("");
    for end in [End::TimedOut, End::Died, End::TooOld, End::Error("busy".into())] {
        let recorded = world.record("scripts/film/1.txt", Some(version.clone()), end).await;
        assert!(matches!(recorded, Recorded::Resolved(_)), "{recorded:?}");
    }
    assert_eq!(world.keys(""), before);
    assert_eq!(world.manifest().head.status, Status::Done);
}

#[tokio::test]
async fn a_retry_counts_anew_and_the_manifest_says_so_at_once() {
    let world = World::new();
    world.upload("1.txt", "bad 1").await;
    world.upload("2.txt", "frame 2").await;
    assert_eq!(world.manifest().head.status, Status::Failed);
    let version = world.store.bucket.lock().unwrap().head("scripts/film/1.txt").unwrap().etag;
    for attempt in 1..=3 {
        world.put(&format!("retries/film/1@{version}-p1/{attempt}"), "");
        world.put(&format!("frames/film/1@{version}-p1.begun-{attempt}"), "");
        world.put(&format!("retries/film/9@{version}-p1/{attempt}"), "another's");
    }
    let retried =
        world.with(async |invocation| retry(invocation, &World::film(), Scope::Failed).await.unwrap()).await;
    assert_eq!((retried.deleted, retried.woken), (1, 1));
    assert_eq!(world.keys("retries/film/1@"), [format!("retries/film/1@{version}-p1/1")]);
    assert_eq!(world.keys("retries/film/9@").len(), 3);
    assert!(world.keys("frames/film/1@").is_empty());
    let head = world.manifest().head;
    assert_eq!((head.status, head.pending), (Status::Rendering, 1), "not failed any more");
}

/// The events of these parts came while another version of the script was current, and drew nothing.
#[tokio::test]
async fn parts_from_before_the_upload_are_put_again() {
    let world = World::new();
    let version = world.put("scripts/film/1.txt", "split 3 1");
    let part = |number: u32| format!("parts/film/1@{version}-p1/{number}.json");
    for number in [1, 2] {
        world.put(&part(number), "{}");
    }
    world.store.clock.sleep(Duration::from_secs(9)).await;
    world.put("scripts/film/1.txt", "split 3 1");
    world.store.clock.sleep(Duration::from_secs(9)).await;
    world.put(&part(2), "{}");
    let put_at =
        |world: &World, number| world.store.bucket.lock().unwrap().head(&part(number)).unwrap().modified;
    let before = [1, 2].map(|number| put_at(&world, number));
    world.store.clock.sleep(Duration::from_secs(9)).await;
    assert!(matches!(world.render("scripts/film/1.txt").await, Outcome::Split(_)));
    let after = [1, 2, 3].map(|number| put_at(&world, number));
    assert!(after[0] > before[0], "the first one's event may have come too early");
    assert_eq!(after[1], before[1], "the second one was put since");
}

#[tokio::test]
async fn a_reason_that_cannot_be_had_is_waited_for_and_not_left_out() {
    let world = World::new();
    let replace = |bucket: &mut Bucket, now: Timestamp, key: &str, number: u64| {
        let reason = format!(r#"{{"message":"reason {number}"}}"#);
        bucket.put(now, key, reason.into(), PutOptions::always()).unwrap();
    };
    // Twice the receipt is another one when it is read; then it is the one that was listed.
    let mut times = 0;
    world.meddle(move |request, bucket, now| {
        if let Some(key) = request.strip_prefix("get ").filter(|key| key.ends_with(".error.json"))
            && times < 2
        {
            times += 1;
            replace(bucket, now, key, times);
        }
    });
    world.upload("1.txt", "bad 1").await;
    let FrameState::Failed(fault) = &world.manifest().frames[0].state else { panic!() };
    assert_eq!(fault.reason.as_ref().unwrap().message, "reason 2");

    // One that is another each time is asked for no more than a few times, with pauses.
    let mut times = 10;
    world.meddle(move |request, bucket, now| {
        if let Some(key) = request.strip_prefix("get ").filter(|key| key.ends_with(".error.json")) {
            times += 1;
            assert!(times < 40, "asked for without bound");
            replace(bucket, now, key, times);
        }
    });
    world.put("scripts/film/1.txt", "bad 2");
    let before = world.store.clock.now();
    let rendering = world
        .with(async |invocation| {
            render_frame(invocation, &InstantRenderer { bands: BANDS }, "scripts/film/1.txt").await
        })
        .await;
    assert!(rendering.unwrap_err().is_retryable());
    assert!(world.store.clock.now().since(before) > Duration::from_millis(500));
}

#[tokio::test]
async fn ranges_of_a_listing_share_no_name() {
    let world = World::new();
    for number in 0..2_300 {
        world.put(&format!("scripts/film/{number}.txt"), "frame 1");
    }
    let folding = async |invocation: &Invocation<'_, Meddled, JumpingClock>| {
        crate::fold::fold(invocation, &World::film()).await.unwrap()
    };
    world.with(folding).await;
    assert_eq!(world.manifest().head.marks.len(), 2);
    // Now that there are marks the listing comes in ranges.
    world.put("scripts/film/9999.txt", "frame 1");
    world.with(folding).await;
    assert_eq!((world.manifest().head.total, world.manifest().frames.len()), (2_301, 2_301));
    let claims = world.keys("assemblies/");
    assert!(claims.iter().all(|key| matches!(key.parse(), Ok(Key::Claim { .. }))));
}
