//! How many requests a frame costs, and how soon the claim follows the last result.
//!
//! No faults here: the requests' latencies (GET 10-25 ms, PUT 25-60 ms, LIST 20-40 ms a page), the platform's
//! concurrency and the drawing times are all there is.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use bytes::Bytes;

use super::bucket::{Actor, Grounds};
use super::engine::{Engine, WorldClock, lock};
use super::expected::Expected;
use super::platform::Platform;
use super::{PIXELS, Shared};
use crate::keys::{Animation, Key, Receipt};
use crate::store::PutOptions;
use crate::{Clock, Policy, Randomness};

/// How long an invocation may run: as long as Lambda lets one.
const TIMEOUT: Duration = Duration::from_secs(900);

/// What to measure.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    /// Frames of the animation.
    pub frames: u64,
    /// Invocations at once.
    pub concurrency: usize,
    /// Milliseconds that a frame takes, from and to.
    pub draw_ms: (u64, u64),
    /// Milliseconds over which the scripts are uploaded.
    pub upload_ms: u64,
    /// Decides everything.
    pub seed: u64,
}

/// What was measured.
#[derive(Debug, Clone, Default)]
pub struct ScaleReport {
    /// Requests of the render function's invocations, divided by the frames.
    pub requests_a_frame: f64,
    /// Requests of both functions by kind (GET, PUT, DELETE, LIST), divided by the frames.
    pub kinds_a_frame: [f64; 4],
    /// Mean time of the render function's invocations that was not drawing: requests and pauses.
    pub beyond_drawing: Duration,
    /// Bytes that the render function read, divided by the frames.
    pub bytes_a_frame: f64,
    /// From the last result's put to the last claim's.
    pub tail: Duration,
    /// Claims that were put.
    pub claims: u64,
    /// Manifests that were written.
    pub revisions: u64,
    /// Requests of the assemble function, all invocations together.
    pub assembling: u64,
    /// The most requests of an event that comes once more when all is done.
    pub idle: u64,
    /// From the first upload to the GIF.
    pub whole: Duration,
}

#[derive(Default)]
struct Moments {
    last_result_us: u64,
    last_claim_us: u64,
    gif_us: u64,
    claims: u64,
    revisions: u64,
}

/// Renders an animation in the simulated world and counts.
///
/// # Errors
///
/// What the bucket holds in the end, when that is not the animation.
pub fn measure(scale: Scale) -> Result<ScaleReport, String> {
    let engine = Engine::default();
    let random = Randomness::seeded(scale.seed);
    let grounds = Grounds::new(engine.clone(), scale.seed, false);
    let platform = Platform::new(
        grounds.clone(),
        Policy::new(PIXELS),
        None,
        scale.concurrency,
        TIMEOUT,
        scale.draw_ms,
        Duration::ZERO,
    );
    let animation = Animation::new("long").map_err(|error| error.to_string())?;
    let moments: Shared<Moments> = Shared::default();
    {
        let (platform, moments, engine) = (Arc::downgrade(&platform), moments.clone(), engine.clone());
        *lock(&grounds.notify) = Some(Arc::new(move |_: Actor, key: &str, there: bool, bucket: &_| {
            lock(&moments).see(key, engine.now_us());
            let bucket: &crate::store::Bucket = bucket;
            if let Some(platform) = platform.upgrade() {
                let etag = bucket.head(key).ok().filter(|_| there).map(|info| info.etag);
                platform.object_event(key, etag);
            }
        }));
    }
    let settings = format!(r#"{{"frames": {}}}"#, scale.frames);
    change(&grounds, animation.settings(), Some(settings), Duration::ZERO);
    for number in 1..=scale.frames {
        let key = format!("{}{number}.txt", animation.scripts());
        let delay = Duration::from_millis(random.below(scale.upload_ms + 1));
        change(&grounds, key, Some(format!("frame {number}")), delay);
    }
    engine.run(Duration::from_secs(24 * 3600));
    if let Some(bug) = &lock(&platform.diary).bug {
        return Err(bug.clone());
    }
    {
        let bucket = lock(&grounds.bucket);
        Expected::of(&bucket, &animation).check(&bucket, &animation)?;
    }
    let by_render = grounds.requests_of(Actor::Render);
    let by_kind = [0, 1, 2, 3].map(|kind: usize| grounds.kinds[kind].load(Ordering::Relaxed) as f64);
    let beyond_drawing = {
        let diary = lock(&platform.diary);
        diary.beyond_drawing / u32::try_from(diary.invocations[0]).unwrap_or(u32::MAX)
    };
    let read_by_render = grounds.bytes[Actor::Render as usize].load(Ordering::Relaxed);
    let by_assemble = grounds.requests_of(Actor::Assemble);
    lock(&platform.diary).idle.clear();
    for number in [1, scale.frames / 2 + 1, scale.frames] {
        let key = format!("{}{number}.txt", animation.scripts());
        change(&grounds, key, Some(format!("frame {number}")), Duration::ZERO);
    }
    engine.run(Duration::from_secs(48 * 3600));
    let idle = lock(&platform.diary).idle.clone();
    if idle.len() != 3 {
        return Err(format!("{} of 3 repeated events found everything done", idle.len()));
    }
    *lock(&grounds.notify) = None;
    engine.end();
    let moments = lock(&moments);
    let between = |from: u64, to: u64| Duration::from_micros(to.saturating_sub(from));
    Ok(ScaleReport {
        requests_a_frame: by_render as f64 / scale.frames as f64,
        kinds_a_frame: by_kind.map(|requests| requests / scale.frames as f64),
        beyond_drawing,
        bytes_a_frame: read_by_render as f64 / scale.frames as f64,
        tail: between(moments.last_result_us, moments.last_claim_us),
        claims: moments.claims,
        revisions: moments.revisions,
        assembling: by_assemble,
        idle: idle.into_iter().max().unwrap_or(0),
        whole: between(0, moments.gif_us),
    })
}

impl Moments {
    fn see(&mut self, key: &str, now_us: u64) {
        match key.parse() {
            Ok(Key::Receipt { receipt: Receipt::Frame { .. }, .. }) => self.last_result_us = now_us,
            Ok(Key::Claim { .. }) => {
                self.last_claim_us = now_us;
                self.claims += 1;
            }
            Ok(Key::Manifest { .. }) => self.revisions += 1,
            Ok(Key::Gif { .. }) => self.gif_us = now_us,
            _ => {}
        }
    }
}

/// The user puts an object, or deletes it.
pub(super) fn change(grounds: &Arc<Grounds>, key: String, text: Option<String>, delay: Duration) {
    let world = grounds.clone();
    grounds.engine.after(delay, move || {
        let now = WorldClock::exact(&world.engine).now();
        let there = text.is_some();
        let is_done = match text {
            Some(text) => lock(&world.bucket).put(now, &key, Bytes::from(text), PutOptions::always()).is_ok(),
            None => lock(&world.bucket).delete(&key),
        };
        let notify = lock(&world.notify).clone();
        if let Some(notify) = notify.filter(|_| is_done) {
            notify(Actor::User, &key, there, &lock(&world.bucket));
        }
    });
}

impl Grounds {
    fn requests_of(&self, actor: Actor) -> u64 {
        self.requests[actor as usize].load(Ordering::Relaxed)
    }
}
