//! The simulated bucket: latency, faults, kills, and the counts of the platform.
//!
//! A request takes effect at some moment between its start and its reply, even if its sender has been killed. Listings
//! are not atomic: each name is seen as it was at one of two moments within the request.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bytes::{Bytes, BytesMut};

use super::engine::{Engine, WorldClock, lock};
use rayfold_pipeline::store::{
    Bucket, Condition, ETag, ListPage, ListRequest, Object, ObjectInfo, Patch, PutOptions, Store,
    UnfinishedUpload, Upload,
};
use rayfold_pipeline::{Clock, Error, Randomness, Result, Timestamp};

/// The rates of faults: one in this many requests, or never if 0.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Faults {
    /// Replies with status 503.
    pub(super) busy: u64,
    /// Replies with status 409 to a conditional put.
    pub(super) conflict: u64,
    /// The answer is lost.
    pub(super) lost_answer: u64,
    /// Listings that mix two moments.
    pub(super) torn_listings: bool,
    /// Requests that take up to eight times as long.
    pub(super) slow: u64,
}

/// The number of bytes of a part of an upload; the simulated files are small.
const PART: usize = 256;

/// The request rate that a bucket of S3 accepts, and the transfer rate.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// The puts and deletes per second; more are answered with 503. S3 allows 3,500 per partitioned prefix, but
    /// partitions prefixes only over time, so the whole bucket counts as one here.
    pub writes: u64,
    /// The reads and listings per second. S3 allows 5,500 per prefix.
    pub reads: u64,
    /// The bytes of a body that are transferred per microsecond on one connection.
    pub bytes_a_microsecond: u64,
}

impl Limits {
    /// The limits in S3's documentation. Bodies at 80 MB/s, as on one connection of a function (assumed).
    pub const S3: Limits = Limits { writes: 3_500, reads: 5_500, bytes_a_microsecond: 80 };
}

/// The used share of the limits of a second.
#[derive(Debug, Default)]
struct Second {
    number: u64,
    writes: u64,
    reads: u64,
}

/// The sender of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Actor {
    /// A user who uploads, or a command.
    User,
    Render,
    Assemble,
}

/// A kind of request, as permissions distinguish it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Action {
    /// `s3:GetObject`: `get`, `get_range`, `head`.
    Get,
    /// The permission `s3:PutObject`, for `put` and `upload`.
    Put,
    /// The permission `s3:DeleteObject`, for `delete`.
    Delete,
    /// The permission `s3:ListBucket`, for `list`.
    List,
}

/// The faults of one invocation.
#[derive(Debug)]
pub(super) struct Fate {
    /// The number of requests until the invocation is killed; never if it starts at 0.
    countdown: AtomicU32,
    /// Whether the request during which it is killed is lost, too.
    lose_last: bool,
    /// The delay after which the request otherwise takes effect.
    delay_last: Duration,
    killed: AtomicBool,
    requests: AtomicU64,
    /// The time of its last request for the listing of scripts, in microseconds.
    listed_us: AtomicU64,
}

impl Fate {
    pub(super) fn new(kill_in_request: u32, lose_last: bool, delay_last: Duration) -> Self {
        Fate {
            countdown: AtomicU32::new(kill_in_request),
            lose_last,
            delay_last,
            killed: AtomicBool::new(false),
            requests: AtomicU64::new(0),
            listed_us: AtomicU64::new(0),
        }
    }

    pub(super) fn requests(&self) -> u64 {
        self.requests.load(Ordering::Relaxed)
    }

    pub(super) fn is_killed(&self) -> bool {
        self.killed.load(Ordering::Relaxed)
    }

    pub(super) fn kill(&self) {
        self.killed.store(true, Ordering::Relaxed);
    }
}

/// A moment at which a user's action is most likely to cause trouble.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Moment {
    /// A function requests the listing of the scripts.
    Listing,
    /// The listing has been made, but the reply has not arrived.
    Listed,
    /// An assembler begins to write a GIF.
    Building,
}

/// A function that is called after each change, with the actor, the key, and whether the object exists now.
pub(super) type Notify = dyn Fn(Actor, &str, bool, &Bucket) + Send + Sync;

/// A function that is called at a moment at which a change is most likely to cause trouble.
pub(super) type MomentListener = dyn Fn(Moment) + Send + Sync;

/// The bucket and everything around it.
pub(super) struct SimEnvironment {
    pub(super) engine: Engine,
    pub(super) random: Randomness,
    pub(super) faults: Mutex<Faults>,
    /// `None`: the bucket accepts any rate.
    pub(super) limits: Mutex<Option<Limits>>,
    second: Mutex<Second>,
    /// The number of bytes of a part of an upload.
    pub(super) part: AtomicUsize,
    /// The number of requests that were refused because of the limits.
    pub(super) throttled: AtomicU64,
    pub(super) bucket: Mutex<Bucket>,
    pub(super) notify: Mutex<Option<Arc<Notify>>>,
    /// Called at the moments at which a change is most likely to cause trouble.
    pub(super) moments: Mutex<Option<Arc<MomentListener>>>,
    /// For each GIF, the time of the oldest listing from which it was made. Equal files are one GIF.
    gifs: Mutex<BTreeMap<ETag, u64>>,
    /// Whether a GIF was replaced by one from an older listing.
    pub(super) set_back: Mutex<Option<String>>,
    /// The seed that decides which frames are too big for one invocation, if any.
    pub(super) big: Mutex<Option<u64>>,
    /// The seed that decides which scripts name files, if any.
    pub(super) files: Mutex<Option<u64>>,
    /// The objects that users have overwritten or deleted, with their keys.
    pub(super) past: Mutex<Vec<(String, Option<String>)>>,
    /// Whether a write took effect after its sender was killed.
    pub(super) late_writes: AtomicU64,
    /// The actions of each actor, with the prefix up to the first slash.
    pub(super) seen: Mutex<BTreeSet<(Actor, Action, String)>>,
    /// The number of requests, by actor.
    pub(super) requests: [AtomicU64; 3],
    /// The number of requests of the functions by kind, in the order of [`Action`].
    pub(super) kinds: [AtomicU64; 4],
    /// The number of bytes that were read from objects, by actor.
    pub(super) bytes: [AtomicU64; 3],
    /// The events of a run, line by line, for reading its replay.
    pub(super) log: Option<Mutex<Vec<String>>>,
}

impl SimEnvironment {
    pub(super) fn new(engine: Engine, seed: u64, logged: bool) -> Arc<Self> {
        Arc::new(SimEnvironment {
            log: logged.then(Mutex::default),
            engine,
            random: Randomness::seeded(seed),
            faults: Mutex::default(),
            limits: Mutex::default(),
            second: Mutex::default(),
            part: AtomicUsize::new(PART),
            throttled: AtomicU64::new(0),
            bucket: Mutex::default(),
            notify: Mutex::new(None),
            moments: Mutex::new(None),
            gifs: Mutex::default(),
            set_back: Mutex::default(),
            big: Mutex::default(),
            files: Mutex::default(),
            past: Mutex::default(),
            late_writes: AtomicU64::new(0),
            seen: Mutex::default(),
            requests: Default::default(),
            kinds: Default::default(),
            bytes: Default::default(),
        })
    }

    /// Writes a line into the log, if there is one.
    pub(super) fn note(&self, line: impl FnOnce() -> String) {
        if let Some(log) = &self.log {
            let ms = self.engine.now_us() / 1000;
            lock(log).push(format!("{ms:>8} ms  {}", line()));
        }
    }

    /// Returns `true` once in `of` times, and never if `of` is 0.
    pub(super) fn chance(&self, of: u64) -> bool {
        of > 0 && self.random.one_in(of)
    }

    pub(super) fn between_ms(&self, range: Range<u64>) -> Duration {
        Duration::from_micros(range.start * 1000 + self.random.below((range.end - range.start) * 1000))
    }

    /// Returns whether the bucket accepts one more request in this second.
    fn is_borne(&self, limits: Limits, action: Action) -> bool {
        let mut second = lock(&self.second);
        let number = self.engine.now_us() / 1_000_000;
        if second.number != number {
            *second = Second { number, ..Second::default() };
        }
        let (used, most) = match action {
            Action::Put | Action::Delete => (&mut second.writes, limits.writes),
            Action::Get | Action::List => (&mut second.reads, limits.reads),
        };
        *used += 1;
        *used <= most
    }

    /// Returns the transfer time of a request's body.
    fn transfer(&self, limits: Limits, effect: &Effect) -> Duration {
        let bytes = match effect {
            Effect::Put(_, body, _) => body.len() as u64,
            Effect::Get(key, range) => {
                let size = lock(&self.bucket).head(key).map_or(0, |info| info.size);
                range.end.min(size).saturating_sub(range.start)
            }
            Effect::Part { body, .. } => body.len() as u64,
            Effect::Complete { tail, .. } => tail.len() as u64,
            Effect::Delete(_) | Effect::List(_) | Effect::Begin(_) | Effect::Abort(..) => 0,
        };
        Duration::from_micros(bytes / limits.bytes_a_microsecond.max(1))
    }

    fn tell(&self, moment: Moment) {
        let moments = lock(&self.moments).clone();
        if let Some(listen) = moments {
            listen(moment);
        }
    }

    /// Checks that a GIF is never replaced by one from an older listing.
    fn replace_gif(&self, key: &str, before: Option<&ETag>, next: &ETag, listed_us: u64) {
        let mut gifs = lock(&self.gifs);
        let older = before.and_then(|before| gifs.get(before)).filter(|before| **before > listed_us);
        if let Some(before) = older {
            let what = format!("{key} of a listing at {before} us gave way to one of {listed_us} us");
            lock(&self.set_back).get_or_insert(what);
        }
        let first = gifs.entry(next.clone()).or_insert(listed_us);
        *first = listed_us.min(*first);
    }

    fn changed(&self, actor: Actor, key: &str, there: bool) {
        let notify = lock(&self.notify).clone();
        if let Some(notify) = notify {
            notify(actor, key, there, &lock(&self.bucket));
        }
    }
}

/// The bucket as one invocation sees it.
#[derive(Clone)]
pub(super) struct WorldStore {
    pub(super) env: Arc<SimEnvironment>,
    pub(super) actor: Actor,
    /// The id of the request.
    pub(super) name: String,
    pub(super) fate: Arc<Fate>,
    /// Ends the invocation that uses this bucket.
    pub(super) die: Arc<dyn Fn() + Send + Sync>,
}

/// The answer to a request.
enum Answer {
    Object(Object),
    ETag(ETag),
    Deleted,
    Page(ListPage),
    /// The id of an upload that has begun.
    Id(u64),
}

/// The effect of a request on the bucket.
#[derive(Clone)]
enum Effect {
    Get(String, Range<u64>),
    Put(String, Bytes, PutOptions),
    Delete(String),
    List(ListRequest),
    Begin(String),
    Part { key: String, id: u64, number: usize, body: Bytes },
    Complete { key: String, id: u64, parts: Vec<ETag>, tail: Bytes, options: PutOptions },
    Abort(String, u64),
}

impl Effect {
    fn action(&self) -> Action {
        match self {
            Effect::Get(..) => Action::Get,
            Effect::Put(..)
            | Effect::Begin(_)
            | Effect::Part { .. }
            | Effect::Complete { .. }
            | Effect::Abort(..) => Action::Put,
            Effect::Delete(_) => Action::Delete,
            Effect::List(_) => Action::List,
        }
    }

    fn key(&self) -> &str {
        match self {
            Effect::Get(key, _)
            | Effect::Put(key, ..)
            | Effect::Delete(key)
            | Effect::Begin(key)
            | Effect::Part { key, .. }
            | Effect::Complete { key, .. }
            | Effect::Abort(key, _) => key,
            Effect::List(request) => &request.prefix,
        }
    }

    /// The range of milliseconds from request to reply.
    fn latency_ms(&self) -> Range<u64> {
        match self {
            Effect::Get(..) => 10..25,
            Effect::Put(..)
            | Effect::Delete(_)
            | Effect::Begin(_)
            | Effect::Part { .. }
            | Effect::Complete { .. }
            | Effect::Abort(..) => 25..60,
            Effect::List(_) => 20..40,
        }
    }

    fn is_conditional(&self) -> bool {
        match self {
            Effect::Put(_, _, options) | Effect::Complete { options, .. } => {
                options.condition != Condition::Always
            }
            _ => false,
        }
    }
}

/// The number of times that S3's client sends a request that is over the limits, and its first pause, which doubles.
const SENDINGS: u32 = 3;
const RESENT_AFTER: Duration = Duration::from_secs(1);

impl WorldStore {
    /// If the bucket has limits, the client repeats a request that is over them, as that of `S3Store` does.
    async fn request(&self, effect: Effect) -> Result<Answer> {
        let sendings = if lock(&self.env.limits).is_some() { SENDINGS } else { 1 };
        let mut pause = RESENT_AFTER;
        for _ in 1..sendings {
            match self.send(effect.clone()).await {
                Err(Error::Throttled { .. }) => {
                    self.env.engine.sleep(self.env.random.up_to(pause)).await;
                    pause *= 2;
                }
                answer => return answer,
            }
        }
        self.send(effect).await
    }

    async fn send(&self, effect: Effect) -> Result<Answer> {
        let env = &self.env;
        env.requests[self.actor as usize].fetch_add(1, Ordering::Relaxed);
        self.fate.requests.fetch_add(1, Ordering::Relaxed);
        if self.actor != Actor::User {
            env.kinds[effect.action() as usize].fetch_add(1, Ordering::Relaxed);
        }
        let key = effect.key().to_owned();
        let folder = key.split_inclusive('/').next().unwrap_or_default().to_owned();
        lock(&env.seen).insert((self.actor, effect.action(), folder));

        match &effect {
            Effect::List(request) if request.prefix.starts_with("scripts/") => {
                self.fate.listed_us.store(env.engine.now_us(), Ordering::Relaxed);
                env.tell(Moment::Listing);
            }
            Effect::Begin(_) | Effect::Part { .. } | Effect::Abort(..) => env.tell(Moment::Building),
            _ => {}
        }

        let faults = *lock(&env.faults);
        let slowness = if env.chance(faults.slow) { 1 + env.random.below(8) } else { 1 };
        let limits = *lock(&env.limits);
        let transfer = limits.map_or(Duration::ZERO, |limits| env.transfer(limits, &effect));
        let latency = env.between_ms(effect.latency_ms()) * u32::try_from(slowness).unwrap_or(1) + transfer;
        let before_effect = env.random.up_to(latency);
        let countdown = self.fate.countdown.load(Ordering::Relaxed);
        if countdown > 0 {
            self.fate.countdown.store(countdown - 1, Ordering::Relaxed);
            if countdown == 1 {
                self.kill_within(latency);
            }
        }
        if limits.is_some_and(|limits| !env.is_borne(limits, effect.action())) {
            env.throttled.fetch_add(1, Ordering::Relaxed);
            env.engine.sleep(latency).await;
            return Err(Error::Throttled { key, source: "slow down".into() });
        }
        if env.chance(faults.busy) {
            env.engine.sleep(latency).await;
            return Err(Error::Throttled { key, source: "slow down".into() });
        }
        if effect.is_conditional() && env.chance(faults.conflict) {
            env.engine.sleep(latency).await;
            return Err(Error::Conflict { key });
        }
        let slot = Arc::new(Mutex::new(None));
        self.take_effect(before_effect, effect.clone(), slot.clone(), false);
        if let (Effect::List(request), true) = (&effect, faults.torn_listings) {
            let (env, request, slot) = (self.env.clone(), request.clone(), slot.clone());
            let second = before_effect + self.env.random.up_to(latency.saturating_sub(before_effect));
            self.env.engine.after(second, move || {
                let later = lock(&env.bucket).list(&request);
                let salt = env.random.bits();
                let mut slot = lock(&slot);
                if let Some(Ok(Answer::Page(page))) = slot.as_mut() {
                    tear(page, later, salt);
                }
            });
        }
        env.engine.sleep(latency).await;
        if env.chance(faults.lost_answer) {
            // Either the caller sees that, or the client has repeated the request before it says anything.
            if env.random.one_in(2) {
                return Err(Error::Ambiguous { key, source: "connection reset".into() });
            }
            let again = Arc::new(Mutex::new(None));
            self.take_effect(before_effect, effect, again.clone(), false);
            env.engine.sleep(latency).await;
            return take(&again, key);
        }
        take(&slot, key)
    }

    /// Ends the invocation at some moment of its next request.
    fn kill_within(&self, latency: Duration) {
        let (fate, die) = (self.fate.clone(), self.die.clone());
        let moment = self.env.random.up_to(latency);
        self.env.engine.after(moment, move || {
            fate.kill();
            die();
        });
    }

    fn take_effect(
        &self,
        delay: Duration,
        effect: Effect,
        slot: Arc<Mutex<Option<Result<Answer>>>>,
        late: bool,
    ) {
        let store = self.clone();
        self.env.engine.after(delay, move || {
            if store.fate.is_killed() && !late {
                if !store.fate.lose_last {
                    store.take_effect(store.fate.delay_last, effect, slot, true);
                }
                return;
            }
            if late && matches!(effect, Effect::Put(..) | Effect::Complete { .. } | Effect::Delete(_)) {
                store.env.late_writes.fetch_add(1, Ordering::Relaxed);
            }
            let line = store.env.log.as_ref().map(|_| describe(&effect));
            let answer = store.apply(effect);
            store.env.note(|| {
                let outcome = match &answer {
                    Ok(Answer::Object(object)) => format!("{}", object.info.etag),
                    Ok(Answer::Page(page)) => {
                        let keys = page.objects.iter().map(|object| object.key.as_str());
                        keys.collect::<Vec<_>>().join(" ")
                    }
                    Ok(_) => String::new(),
                    Err(error) => error.to_string(),
                };
                let late = if late { " (late)" } else { "" };
                let line = line.unwrap_or_default();
                format!("{:.6} {:?} {line}{late}: {outcome}", store.name, store.actor)
            });
            *lock(&slot) = Some(answer);
        });
    }

    fn apply(&self, effect: Effect) -> Result<Answer> {
        let env = &self.env;
        match effect {
            Effect::Get(key, range) => {
                let object = lock(&env.bucket).get_range(&key, range)?;
                env.bytes[self.actor as usize].fetch_add(object.body.len() as u64, Ordering::Relaxed);
                Ok(Answer::Object(object))
            }
            Effect::List(request) => {
                let page = lock(&env.bucket).list(&request);
                if request.prefix.starts_with("scripts/") {
                    env.tell(Moment::Listed);
                }
                Ok(Answer::Page(page))
            }
            Effect::Begin(_) => Ok(Answer::Id(lock(&env.bucket).begin_upload())),
            Effect::Part { key, id, number, body } => {
                lock(&env.bucket).put_part(&key, id, number, body).map(Answer::ETag)
            }
            Effect::Abort(_, id) => {
                lock(&env.bucket).abort_upload(id);
                Ok(Answer::Deleted)
            }
            Effect::Put(key, body, options) => {
                self.replace(&key, |bucket, now| bucket.put(now, &key, body, options))
            }
            Effect::Complete { key, id, parts, tail, options } => self
                .replace(&key, |bucket, now| bucket.complete_upload(now, &key, id, (&parts, &tail), options)),
            Effect::Delete(key) => {
                if lock(&env.bucket).delete(&key) {
                    env.changed(self.actor, &key, false);
                }
                Ok(Answer::Deleted)
            }
        }
    }
}

impl WorldStore {
    /// Makes an object, and tells of it.
    fn replace(&self, key: &str, put: impl FnOnce(&mut Bucket, Timestamp) -> Result<ETag>) -> Result<Answer> {
        let env = &self.env;
        let now = WorldClock::exact(&env.engine).now();
        let before = lock(&env.bucket).head(key).ok().map(|info| info.etag);
        let etag = put(&mut lock(&env.bucket), now)?;
        if key.starts_with("animations/") {
            let listed_us = self.fate.listed_us.load(Ordering::Relaxed);
            env.replace_gif(key, before.as_ref(), &etag, listed_us);
        }
        env.changed(self.actor, key, true);
        Ok(Answer::ETag(etag))
    }
}

fn describe(effect: &Effect) -> String {
    match effect {
        Effect::Put(key, body, options) => {
            let text = String::from_utf8_lossy(body);
            let start: String = text.chars().take(300).map(|c| if c == '\n' { ' ' } else { c }).collect();
            format!("put {key} {:?} {start}", options.condition)
        }
        Effect::Get(key, _) => format!("get {key}"),
        Effect::Delete(key) => format!("delete {key}"),
        Effect::List(request) => format!("list {}", request.prefix),
        Effect::Begin(key) => format!("begin upload of {key}"),
        Effect::Part { key, id, number, .. } => format!("part {number} of {key} in upload {id}"),
        Effect::Complete { key, id, options, .. } => {
            format!("put {key} of upload {id} {:?}", options.condition)
        }
        Effect::Abort(key, id) => format!("abort upload {id} of {key}"),
    }
}

fn take(slot: &Mutex<Option<Result<Answer>>>, key: String) -> Result<Answer> {
    lock(slot).take().unwrap_or_else(|| Err(Error::Ambiguous { key, source: "no effect, no answer".into() }))
}

/// Replaces about half of the names on a page by those of a later moment.
fn tear(page: &mut ListPage, later: ListPage, salt: u64) {
    if page.next.is_some() || later.next.is_some() {
        return;
    }
    let of_later = |name: &str| {
        let hash = name.bytes().fold(salt, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(29)
        });
        hash.count_ones() % 2 == 0
    };
    page.objects.retain(|object| !of_later(&object.key));
    page.objects.extend(later.objects.into_iter().filter(|object| of_later(&object.key)));
    page.objects.sort_by(|a, b| a.key.cmp(&b.key));
    page.prefixes.retain(|prefix| !of_later(prefix));
    page.prefixes.extend(later.prefixes.into_iter().filter(|prefix| of_later(prefix)));
    page.prefixes.sort();
}

fn wrong_answer(key: &str) -> Error {
    Error::Refused { key: key.to_owned(), source: "an answer to another request".into() }
}

impl Store for WorldStore {
    type Upload = WorldUpload;

    async fn get(&self, key: &str) -> Result<Object> {
        self.get_range(key, 0..u64::MAX).await
    }

    async fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
        match self.request(Effect::Get(key.to_owned(), range)).await? {
            Answer::Object(object) => Ok(object),
            _ => Err(wrong_answer(key)),
        }
    }

    async fn head(&self, key: &str) -> Result<ObjectInfo> {
        self.get_range(key, 0..0).await.map(|object| object.info)
    }

    async fn put(&self, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
        match self.request(Effect::Put(key.to_owned(), body, options)).await? {
            Answer::ETag(etag) => Ok(etag),
            _ => Err(wrong_answer(key)),
        }
    }

    async fn delete(&self, key: &str) -> Result<()> {
        self.request(Effect::Delete(key.to_owned())).await.map(drop)
    }

    async fn list(&self, request: ListRequest) -> Result<ListPage> {
        let prefix = request.prefix.clone();
        match self.request(Effect::List(request)).await? {
            Answer::Page(page) => Ok(page),
            _ => Err(wrong_answer(&prefix)),
        }
    }

    async fn upload(&self, key: &str, options: PutOptions) -> Result<WorldUpload> {
        let Answer::Id(id) = self.request(Effect::Begin(key.to_owned())).await? else {
            return Err(wrong_answer(key));
        };
        let begun = UnfinishedUpload { id: Some(id.to_string()), ..UnfinishedUpload::default() };
        Ok(self.take_up(key, options, begun))
    }

    fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> WorldUpload {
        let UnfinishedUpload { id, parts, tail, .. } = unfinished;
        let part = self.env.part.load(Ordering::Relaxed);
        let id = id.and_then(|id| id.parse().ok()).unwrap_or_default();
        WorldUpload {
            store: self.clone(),
            key: key.to_owned(),
            options,
            id,
            parts,
            gathered: tail.into(),
            part,
        }
    }
}

/// An object being written to the simulated bucket.
pub(super) struct WorldUpload {
    store: WorldStore,
    key: String,
    options: PutOptions,
    id: u64,
    parts: Vec<ETag>,
    gathered: BytesMut,
    /// The number of bytes of a part.
    part: usize,
}

impl Upload for WorldUpload {
    async fn write(&mut self, bytes: Bytes) -> Result<()> {
        self.gathered.extend_from_slice(&bytes);
        // A start that may change is sent at the end; here with all the rest.
        while self.gathered.len() >= self.part && !self.options.is_start_last {
            let (key, body) = (self.key.clone(), self.gathered.split_to(self.part).freeze());
            let part = Effect::Part { key, id: self.id, number: self.parts.len() + 1, body };
            match self.store.request(part).await? {
                Answer::ETag(etag) => self.parts.push(etag),
                _ => return Err(wrong_answer(&self.key)),
            }
        }
        Ok(())
    }

    async fn finish(self, patch: Option<Patch>) -> Result<ETag> {
        let WorldUpload { store, key, options, id, parts, mut gathered, .. } = self;
        patch.iter().for_each(|patch| patch.apply(&mut gathered));
        let tail = gathered.freeze();
        match store.request(Effect::Complete { key: key.clone(), id, parts, tail, options }).await? {
            Answer::ETag(etag) => Ok(etag),
            _ => Err(wrong_answer(&key)),
        }
    }

    async fn abort(self) -> Result<()> {
        self.store.request(Effect::Abort(self.key, self.id)).await.map(drop)
    }

    fn leave(self) -> UnfinishedUpload {
        let (id, parts, tail) = (Some(self.id.to_string()), self.parts, self.gathered.freeze());
        UnfinishedUpload { id, parts, tail, ..UnfinishedUpload::default() }
    }
}
