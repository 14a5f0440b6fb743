//! A test environment: a bucket in memory that records its requests, a clock that jumps, and functions that run on
//! demand. The functions are the real steps with a renderer of one line.

use std::collections::BTreeSet;
use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bytes::{Bytes, BytesMut};
use rayfold_pipeline::keys::{Animation, Band, Key, ScriptName};
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::store::{
    ETag, ListPage, ListRequest, Listing, MemoryStore, MemoryUpload, Object, ObjectInfo, Patch, PutOptions,
    Store, UnfinishedUpload,
};
use rayfold_pipeline::{
    Animator, BandJoiner, Clock, Drawing, Encoding, Files, Invocation, Policy, Randomness, Renderer, Result,
    Source, Timestamp, Unfit, assemble, render_frame,
};
use rayfold_scene::{AnimationSettings, Container};

use crate::client::Client;

/// The pixel version of the frames drawn in these tests.
pub(crate) const PIXELS: u32 = 1;

/// A clock that jumps to the time that a caller waits for. Other tasks run meanwhile.
#[derive(Debug, Clone)]
pub(crate) struct JumpingClock(Arc<AtomicU64>);

impl Clock for JumpingClock {
    fn now(&self) -> Timestamp {
        Timestamp(self.0.load(Ordering::Relaxed))
    }

    async fn sleep(&self, duration: Duration) {
        tokio::task::yield_now().await;
        self.0.fetch_add(duration.as_millis() as u64, Ordering::Relaxed);
    }
}

/// The requests made to the store.
#[derive(Debug, Clone, Default)]
pub(crate) struct Requests(Arc<Mutex<Vec<String>>>);

impl Requests {
    pub(crate) fn clear(&self) {
        self.0.lock().unwrap().clear();
    }

    pub(crate) fn seen(&self) -> Vec<String> {
        self.0.lock().unwrap().clone()
    }
}

/// A replacement of an object before a request with a given name.
struct Replacement {
    request: &'static str,
    after: u32,
    body: Vec<u8>,
    times: u8,
}

/// The bucket, which records requests.
pub(crate) struct WatchedStore {
    inner: MemoryStore<JumpingClock>,
    requests: Requests,
    replacement: Mutex<Option<Replacement>>,
}

impl WatchedStore {
    async fn note(&self, action: &str, key: &str) {
        let request = format!("{action} {key}");
        let body =
            self.replacement.lock().unwrap().as_mut().and_then(|replacement| replacement.due(&request));
        if let Some(body) = body {
            self.inner.put(key, body.into(), PutOptions::always()).await.unwrap();
        }
        self.requests.0.lock().unwrap().push(request);
    }
}

impl Replacement {
    /// Returns the new body if the object is replaced now. The remaining count is appended, so that no
    /// two bodies are equal.
    fn due(&mut self, request: &str) -> Option<Vec<u8>> {
        if self.request != request || self.times == 0 {
            return None;
        }
        if self.after > 0 {
            self.after -= 1;
            return None;
        }
        self.times -= 1;
        Some([&self.body[..], &[self.times]].concat())
    }
}

impl Store for WatchedStore {
    type Upload = MemoryUpload<JumpingClock>;

    async fn get(&self, key: &str) -> Result<Object> {
        self.note("get", key).await;
        self.inner.get(key).await
    }

    async fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
        self.note("get", key).await;
        self.inner.get_range(key, range).await
    }

    async fn head(&self, key: &str) -> Result<ObjectInfo> {
        self.note("head", key).await;
        self.inner.head(key).await
    }

    async fn put(&self, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
        self.note("put", key).await;
        self.inner.put(key, body, options).await
    }

    async fn delete(&self, key: &str) -> Result<()> {
        self.note("delete", key).await;
        self.inner.delete(key).await
    }

    async fn list(&self, request: ListRequest) -> Result<ListPage> {
        self.note("list", &request.prefix).await;
        self.inner.list(request).await
    }

    async fn upload(&self, key: &str, options: PutOptions) -> Result<Self::Upload> {
        self.note("upload", key).await;
        self.inner.upload(key, options).await
    }

    fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Self::Upload {
        self.inner.take_up(key, options, unfinished)
    }
}

/// The bucket, the clock, and the functions together.
pub(crate) struct World {
    pub(crate) store: WatchedStore,
    pub(crate) requests: Requests,
    clock: JumpingClock,
    random: Randomness,
    policy: Policy,
    delivered: Mutex<BTreeSet<(String, ETag)>>,
}

impl World {
    pub(crate) fn new() -> Self {
        let clock = JumpingClock(Arc::new(AtomicU64::new(1_000_000)));
        let requests = Requests::default();
        let store = WatchedStore {
            inner: MemoryStore::new(clock.clone()),
            requests: requests.clone(),
            replacement: Mutex::default(),
        };
        let (random, policy) = (Randomness::seeded(1), Policy::new(PIXELS));
        World { store, requests, clock, random, policy, delivered: Mutex::default() }
    }

    pub(crate) fn client(&self) -> Client<'_, WatchedStore, JumpingClock> {
        Client::new(&self.store, &self.clock)
    }

    /// Returns the animation of most tests.
    pub(crate) fn film(&self) -> Animation {
        Animation::new("film").unwrap()
    }

    pub(crate) async fn put(&self, key: &str, text: &str) {
        self.store.put(key, text.to_owned().into(), PutOptions::always()).await.unwrap();
    }

    pub(crate) async fn keys(&self, prefix: &str) -> Vec<String> {
        let request = ListRequest::all(prefix);
        let listing = Listing::read(request, None, |request| self.store.inner.list(request)).await.unwrap();
        listing.objects.into_iter().map(|object| object.key).collect()
    }

    /// Replaces an object before each of `times` requests of this name, after the first `after` of them.
    pub(crate) fn replace_before(&self, request: &'static str, after: u32, body: Vec<u8>, times: u8) {
        *self.store.replacement.lock().unwrap() = Some(Replacement { request, after, body, times });
    }

    /// Runs the functions on all new objects, and on the objects that they write.
    pub(crate) async fn functions(&self) {
        for prefix in ["scripts/", "parts/", "retries/", "assemblies/"] {
            let listing = Listing::read(ListRequest::all(prefix), None, |r| self.store.inner.list(r)).await;
            for object in listing.unwrap().objects {
                if self.delivered.lock().unwrap().insert((object.key.clone(), object.etag)) {
                    self.event(&object.key).await;
                }
            }
        }
    }

    /// Runs the functions for the deletions of these scripts, once they have happened.
    pub(crate) async fn deletions(&self, keys: &[&str]) {
        for key in keys {
            while self.store.inner.head(key).await.is_ok() {
                tokio::task::yield_now().await;
            }
            tokio::task::yield_now().await;
            self.event(key).await;
        }
    }

    async fn event(&self, key: &str) {
        let id = format!("request-{:016x}", self.random.bits());
        let invocation = Invocation::new(&self.store, &self.clock, &self.random, &self.policy, &id);
        if matches!(key.parse(), Ok(Key::Claim { .. })) {
            assemble(&invocation, &Joiner, key).await.unwrap();
        } else {
            match render_frame(&invocation, &OneLine, key).await {
                // An object that is no script belongs to no animation.
                Err(rayfold_pipeline::Error::Key { .. }) => {}
                rendered => drop(rendered.unwrap()),
            }
        }
    }
}

/// A renderer for which `bad` has no frame. Every other script is one frame, which shows its name and its text. A
/// script `with FILE` has no frame before the file exists.
struct OneLine;

/// Returns the name of the file that a script names.
fn named(script: &[u8]) -> Option<String> {
    Some(str::from_utf8(script).ok()?.strip_prefix("with ")?.to_owned())
}

impl Renderer for OneLine {
    type BandJoiner = Whole;

    fn most_bytes(&self) -> u64 {
        1_000
    }

    fn most_file_bytes(&self) -> u64 {
        1_000
    }

    async fn needed(&self, _: &ScriptName, script: Bytes, _: Files) -> Result<Vec<String>> {
        Ok(named(&script).into_iter().collect())
    }

    async fn draw(&self, source: Source, _: Option<Duration>) -> Result<Drawing> {
        let (name, text) = (&source.name, String::from_utf8_lossy(&source.script));
        if let Some(absent) = named(&source.script).filter(|file| source.files[file].is_none()) {
            return Ok(Drawing::Waits(Reason::new(format!("{name}.txt waits for {absent}"))));
        }
        Ok(match text.as_ref() {
            "bad" => Drawing::Fault(Reason::new(format!("{name}.txt: bad"))),
            text => Drawing::Frame(format!("{name}: {text}").into()),
        })
    }

    /// No frame is too big in these tests.
    async fn draw_band(&self, _: Source, band: Band) -> Result<Result<Bytes, Reason>> {
        Ok(Err(Reason::new(format!("no frame has a band {band}"))))
    }

    async fn join(&self, _: Source, _: NonZeroU64) -> Result<Result<Whole, Reason>> {
        Ok(Err(Reason::new("no frame has bands")))
    }
}

/// A joiner that is never used, because no frame is in bands.
enum Whole {}

impl BandJoiner for Whole {
    async fn push(&mut self, _: Bytes) -> Result<(), Reason> {
        match *self {}
    }

    async fn finish(self) -> Result<Bytes, Reason> {
        match self {}
    }
}

/// An animator that concatenates the frames.
struct Joiner;

struct Joined(BytesMut);

impl Animator for Joiner {
    type Encoding = Joined;

    fn begin(&self, _: &AnimationSettings, _: Container, _: bool) -> Result<Joined, Reason> {
        Ok(Joined(BytesMut::new()))
    }

    async fn resume(&self, _: &AnimationSettings, _: Container, state: Bytes) -> Result<Joined, Reason> {
        Ok(Joined(state.into()))
    }
}

impl Encoding for Joined {
    async fn push(&mut self, frame: Bytes) -> Result<Bytes, Unfit> {
        self.0.extend_from_slice(&frame);
        Ok(Bytes::new())
    }

    async fn finish(self) -> Result<(Bytes, Option<Patch>), Reason> {
        Ok((self.0.freeze(), None))
    }

    async fn suspend(self) -> Result<Bytes, Reason> {
        Ok(self.0.freeze())
    }
}
