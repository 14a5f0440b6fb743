//! Measurements for animations of any size and number: requests per frame, the time from the last result to the claim
//! and from the first upload to the GIF, the waits for a free place, and the requests that the bucket refuses.
//!
//! There are no faults here except the bucket's limits, if requested. The model consists of the latencies of requests
//! (GET 10-25 ms, PUT 25-60 ms, LIST 20-40 ms per page, and the transfer time of bodies), the platform's concurrency,
//! and the drawing times.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use bytes::Bytes;

use super::bucket::{Actor, Limits, SimEnvironment};
use super::engine::{Engine, WorldClock, lock};
use super::expected::Expected;
use super::platform::Platform;
use super::timed::Pace;
use super::{PIXELS, Shared};
use rayfold_pipeline::keys::{Animation, Key, Receipt};
use rayfold_pipeline::store::{Bucket, PutOptions};
use rayfold_pipeline::{Clock, Policy, Randomness};

/// The time limit of an invocation: Lambda's maximum.
const TIMEOUT: Duration = Duration::from_secs(900);

/// The parameters of a measurement.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    /// The number of frames of each animation.
    pub frames: u64,
    /// The number of animations that are uploaded at once.
    pub animations: u64,
    /// The number of concurrent invocations of both functions together.
    pub concurrency: usize,
    /// Whether the bucket and the platform have the limits of AWS: a bucket's requests per second, the transfer time of
    /// large bodies, and 1,000 more invocations every 10 s.
    pub limits: Option<Limits>,
    /// The time that the assembler takes for a frame.
    pub push: Duration,
    /// The minimum and the maximum milliseconds that a frame takes.
    pub draw_ms: (u64, u64),
    /// The milliseconds over which the scripts are uploaded.
    pub upload_ms: u64,
    /// The seed of everything.
    pub seed: u64,
}

impl Scale {
    /// Returns the settings for one animation in a bucket without limits, which is assembled in no time.
    pub fn unlimited(frames: u64, concurrency: usize, seed: u64) -> Self {
        let (animations, limits, push) = (1, None, Duration::ZERO);
        let (draw_ms, upload_ms) = ((800, 1_200), 200);
        Scale { frames, animations, concurrency, limits, push, draw_ms, upload_ms, seed }
    }

    /// Returns the settings for AWS, as far as it is modelled. `uploaded` scripts are uploaded per second.
    pub fn on_aws(frames: u64, animations: u64, uploaded: u64, concurrency: usize, push: Duration) -> Self {
        let upload_ms = frames * animations * 1_000 / uploaded.max(1);
        let (limits, draw_ms) = (Some(Limits::S3), (800, 1_200));
        Scale { frames, animations, concurrency, limits, push, draw_ms, upload_ms, seed: 1 }
    }
}

/// The number of bytes of a part that the store for S3 sends.
const PART_OF_S3: usize = 8 << 20;

/// The number of places that Lambda adds every 10 seconds.
const RAMP: usize = 1_000;

/// The results of a measurement.
#[derive(Debug, Clone, Default)]
pub struct ScaleReport {
    /// The requests of the render function's invocations, divided by the frames.
    pub requests_a_frame: f64,
    /// The requests of both functions by kind (GET, PUT, DELETE, LIST), divided by the frames.
    pub kinds_a_frame: [f64; 4],
    /// The mean time of the render function's invocations without drawing: requests and pauses.
    pub beyond_drawing: Duration,
    /// The bytes that the render function read, divided by the frames.
    pub bytes_a_frame: f64,
    /// The time from the last result's put to the render function's last claim.
    pub tail: Duration,
    /// The number of claims that were put.
    pub claims: u64,
    /// The number of manifests that were written.
    pub revisions: u64,
    /// The requests of the assemble function, all invocations together.
    pub assembling: u64,
    /// The largest number of requests of an event that is delivered once more when everything is done.
    pub idle: u64,
    /// The time from the first upload to the last GIF.
    pub whole: Duration,
    /// The time from the first upload to the first GIF.
    pub first: Duration,
    /// The mean drawing time of the render function's invocations.
    pub drawing: Duration,
    /// The time of the assemble function's invocations, all together.
    pub assembling_time: Duration,
    /// The average and the longest time that events waited for a free place: the render
    /// function's, the assemble function's.
    pub waits: [[Duration; 2]; 2],
    /// Invocations of the render and of the assemble function.
    pub invocations: [u64; 2],
    /// The most invocations at once.
    pub at_once: usize,
    /// The requests that the bucket refused because of its limits, divided by the frames.
    pub throttled: f64,
    /// The number of bytes of the largest manifest.
    pub manifest: u64,
    /// The number of times that an assembler left a GIF unfinished to the next one.
    pub left: u64,
}

#[derive(Default)]
struct Moments {
    last_result_us: u64,
    last_claim_us: u64,
    first_gif_us: Option<u64>,
    gif_us: u64,
    claims: u64,
    revisions: u64,
    manifest: u64,
}

/// Renders animations in the simulated world and counts.
///
/// # Errors
///
/// Returns the final contents of the bucket as an error if they are not the animations.
pub fn measure(scale: Scale) -> Result<ScaleReport, String> {
    let engine = Engine::default();
    let random = Randomness::seeded(scale.seed);
    let env = SimEnvironment::new(engine.clone(), scale.seed, false);
    *lock(&env.limits) = scale.limits;
    let platform = Platform::new(
        env.clone(),
        Policy::new(PIXELS),
        None,
        scale.concurrency,
        TIMEOUT,
        scale.draw_ms,
        Pace { push: scale.push, is_eager: true },
    );
    if scale.limits.is_some() {
        env.part.store(PART_OF_S3, Ordering::Relaxed);
    }
    *lock(&platform.ramp) = scale.limits.map(|_| RAMP);
    let names = (1..=scale.animations).map(|number| Animation::new(&format!("long{number}")));
    let animations: Vec<Animation> =
        names.collect::<rayfold_pipeline::Result<_>>().map_err(|error| error.to_string())?;
    let moments: Shared<Moments> = Shared::default();
    {
        let (platform, moments, engine) = (Arc::downgrade(&platform), moments.clone(), engine.clone());
        *lock(&env.notify) = Some(Arc::new(move |actor: Actor, key: &str, there: bool, bucket: &Bucket| {
            lock(&moments).see((actor, key), bucket, engine.now_us());
            if let Some(platform) = platform.upgrade() {
                let etag = bucket.head(key).ok().filter(|_| there).map(|info| info.etag);
                platform.object_event(key, etag);
            }
        }));
    }
    for animation in &animations {
        let settings = format!(r#"{{"frames": {}}}"#, scale.frames);
        change(&env, animation.settings(), Some(settings), Duration::ZERO);
        for number in 1..=scale.frames {
            let key = format!("{}{number}.txt", animation.scripts());
            let delay = Duration::from_millis(random.below(scale.upload_ms + 1));
            change(&env, key, Some(format!("frame {number}")), delay);
        }
    }
    engine.run(Duration::from_secs(24 * 3600));
    if let Some(bug) = &lock(&platform.diary).bug {
        return Err(bug.clone());
    }
    {
        let bucket = lock(&env.bucket);
        for animation in &animations {
            Expected::of(&bucket, animation).check(&bucket, animation)?;
        }
    }
    let mut report = platform.report(scale.frames * scale.animations);
    report.idle = idle(&env, &platform, &animations, scale.frames)?;
    *lock(&env.notify) = None;
    engine.end();
    let moments = lock(&moments);
    let between = |from: u64, to: u64| Duration::from_micros(to.saturating_sub(from));
    Ok(ScaleReport {
        tail: between(moments.last_result_us, moments.last_claim_us),
        claims: moments.claims,
        revisions: moments.revisions,
        whole: between(0, moments.gif_us),
        first: between(0, moments.first_gif_us.unwrap_or_default()),
        manifest: moments.manifest,
        ..report
    })
}

/// Returns the largest number of requests of events that are delivered once more when everything is done.
fn idle(
    env: &Arc<SimEnvironment>,
    platform: &Platform,
    animations: &[Animation],
    frames: u64,
) -> Result<u64, String> {
    lock(&platform.diary).idle.clear();
    if let Some(animation) = animations.first() {
        for number in [1, frames / 2 + 1, frames] {
            let key = format!("{}{number}.txt", animation.scripts());
            change(env, key, Some(format!("frame {number}")), Duration::ZERO);
        }
    }
    env.engine.run(Duration::from_secs(48 * 3600));
    let idle = lock(&platform.diary).idle.clone();
    match idle.len() {
        3 => Ok(idle.into_iter().max().unwrap_or(0)),
        found => Err(format!("{found} of 3 repeated events found everything done")),
    }
}

impl Platform {
    fn report(&self, frames: u64) -> ScaleReport {
        let (env, diary) = (&self.env, lock(&self.diary));
        let a_frame = |count: &AtomicU64| count.load(Ordering::Relaxed) as f64 / frames as f64;
        let of = |actor: Actor| &env.requests[actor as usize];
        let mean = |all: Duration, function: usize| {
            all.div_f64(u32::try_from(diary.invocations[function]).unwrap_or(u32::MAX).max(1).into())
        };
        ScaleReport {
            requests_a_frame: a_frame(of(Actor::Render)),
            kinds_a_frame: [0, 1, 2, 3].map(|kind: usize| a_frame(&env.kinds[kind])),
            beyond_drawing: mean(diary.beyond_drawing, 0),
            bytes_a_frame: a_frame(&env.bytes[Actor::Render as usize]),
            assembling: of(Actor::Assemble).load(Ordering::Relaxed),
            drawing: mean(diary.drawing, 0),
            assembling_time: diary.assembling,
            waits: [0, 1]
                .map(|function| [mean(diary.waits[function], function), diary.longest_wait[function]]),
            invocations: diary.invocations,
            left: diary.left,
            at_once: diary.at_once,
            throttled: a_frame(&env.throttled),
            ..ScaleReport::default()
        }
    }
}

impl Moments {
    fn see(&mut self, (actor, key): (Actor, &str), bucket: &Bucket, now_us: u64) {
        match key.parse() {
            Ok(Key::Receipt { receipt: Receipt::Frame { .. }, .. }) => self.last_result_us = now_us,
            Ok(Key::Claim { .. }) => {
                // An assembler's is that of a GIF that it left unfinished.
                if actor == Actor::Render {
                    self.last_claim_us = now_us;
                }
                self.claims += 1;
            }
            Ok(Key::Manifest { .. }) => {
                self.revisions += 1;
                self.manifest = self.manifest.max(bucket.head(key).map_or(0, |info| info.size));
            }
            Ok(Key::Output { .. }) => {
                self.first_gif_us.get_or_insert(now_us);
                self.gif_us = now_us;
            }
            _ => {}
        }
    }
}

/// The user puts an object, or deletes it.
pub(super) fn change(env: &Arc<SimEnvironment>, key: String, text: Option<String>, delay: Duration) {
    let world = env.clone();
    env.engine.after(delay, move || {
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
