//! The cost of a slow upload or a slow removal: scripts come or go one by one, and `animation.json` does not say how
//! many there will be.
//!
//! There are no faults. A claim is written each time that all known frames are done; the cost is that of the assemblers
//! of these claims.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::bucket::{Actor, SimEnvironment};
use super::engine::{Engine, lock};
use super::expected::Expected;
use super::platform::Platform;
use super::scale::change;
use super::timed::Pace;
use super::{PIXELS, Shared};
use rayfold_pipeline::Policy;
use rayfold_pipeline::keys::{Animation, Key};
use rayfold_pipeline::store::Bucket;

/// The time limit of an invocation: Lambda's maximum.
const TIMEOUT: Duration = Duration::from_secs(900);

/// A slow change of a set.
#[derive(Debug, Clone, Copy)]
pub struct Slow {
    /// The number of scripts that are uploaded, one after the other.
    pub scripts: u64,
    /// The milliseconds between two of them.
    pub apart_ms: u64,
    /// The number of scripts that are deleted again, equally slowly, once all are done.
    pub removed: u64,
    /// The time limit of an invocation.
    pub timeout: Option<Duration>,
    /// The seed of everything else.
    pub seed: u64,
}

/// The cost of a slow upload or removal.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SlowReport {
    /// The number of GIFs that were built.
    pub gifs: u64,
    /// The number of claims that were put.
    pub claims: u64,
    /// The time of the assemble function's invocations, all together.
    pub assembling: Duration,
    /// The most of them at once.
    pub at_once: u64,
    /// The number of requests of the assemble function.
    pub requests: u64,
    /// The number of requests of the render function.
    pub rendering: u64,
    /// The time from the first change to rest.
    pub whole: Duration,
}

/// Runs a slow upload, and a slow removal if requested. The counts are those of the last of them.
///
/// # Errors
///
/// Returns the final contents of the bucket as an error if they are not the animation.
pub fn slowly(slow: Slow) -> Result<SlowReport, String> {
    let engine = Engine::default();
    let env = SimEnvironment::new(engine.clone(), slow.seed, false);
    let timeout = slow.timeout.unwrap_or(TIMEOUT);
    let policy = Policy::new(PIXELS);
    let platform = Platform::new(env.clone(), policy, None, 1_000, timeout, (100, 300), Pace::default());
    let animation = Animation::new("slow").map_err(|error| error.to_string())?;
    let counted: Shared<SlowReport> = Shared::default();
    {
        let (platform, counted) = (Arc::downgrade(&platform), counted.clone());
        *lock(&env.notify) = Some(Arc::new(move |_: Actor, key: &str, there: bool, bucket: &Bucket| {
            match key.parse() {
                Ok(Key::Output { .. }) if there => lock(&counted).gifs += 1,
                Ok(Key::Claim { .. }) => lock(&counted).claims += 1,
                _ => {}
            }
            if let Some(platform) = platform.upgrade() {
                let etag = bucket.head(key).ok().filter(|_| there).map(|info| info.etag);
                platform.object_event(key, etag);
            }
        }));
    }
    let key = |number: u64| format!("{}{number}.txt", animation.scripts());
    let after = |number: u64| Duration::from_millis(number * slow.apart_ms);
    for number in 0..slow.scripts {
        change(&env, key(number), Some(format!("frame {number}")), after(number));
    }
    engine.run(TIMEOUT * 24);
    let start_us = if slow.removed > 0 {
        *lock(&counted) = SlowReport::default();
        *lock(&platform.diary) = Default::default();
        env.requests.iter().for_each(|requests| requests.store(0, Ordering::Relaxed));
        for number in 0..slow.removed {
            change(&env, key(number), None, after(number));
        }
        engine.now_us()
    } else {
        0
    };
    engine.run(TIMEOUT * 48);
    *lock(&env.notify) = None;
    engine.end();
    if let Some(bug) = &lock(&platform.diary).bug {
        return Err(bug.clone());
    }
    let bucket = lock(&env.bucket);
    Expected::of(&bucket, &animation).check(&bucket, &animation)?;
    if bucket.keys().any(|key| matches!(key.parse(), Ok(Key::Lease { .. }))) {
        return Err("a lease is left".to_owned());
    }
    let requests = |of: Actor| env.requests[of as usize].load(Ordering::Relaxed);
    let (counted, diary) = (lock(&counted), lock(&platform.diary));
    Ok(SlowReport {
        assembling: diary.assembling,
        at_once: diary.assemblers_at_once,
        requests: requests(Actor::Assemble),
        rendering: requests(Actor::Render),
        whole: Duration::from_micros(diary.last_end_us.saturating_sub(start_us)),
        ..*counted
    })
}
