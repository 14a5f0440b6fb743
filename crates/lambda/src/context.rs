//! The context that a process makes once, at its cold start, and keeps while it is warm.

use std::env;
use std::str::FromStr;
use std::time::Duration;

use anyhow::Context as _;
use rayfold_pipeline::store::{S3Store, Store};
use rayfold_pipeline::{Invocation, Policy, Randomness, SystemClock, Timestamp};

use crate::animator::MovieAnimator;
use crate::limits::{capacity, limits, most_frames};
use crate::raytracer::RayTracer;

/// The store's client and the inputs of the steps.
#[derive(Debug)]
pub struct Context<S> {
    /// The client of the bucket.
    pub store: S,
    /// The name of the bucket. Events of other buckets are ignored.
    pub bucket: String,
    /// The renderer of frames.
    pub renderer: RayTracer,
    /// The animator that makes the GIF.
    pub animator: MovieAnimator,
    /// The parameters of the protocol.
    pub policy: Policy,
    /// The random source that spreads invocations which would collide.
    pub random: Randomness,
}

/// One call of the function.
#[derive(Clone, Debug)]
pub struct Call {
    /// The platform's id of the event, which its retries share.
    pub request_id: String,
    /// The time at which the platform kills the process.
    pub deadline: Timestamp,
}

impl Context<S3Store> {
    /// Reads the function's environment: `RAYFOLD_BUCKET`, and the standard AWS variables for credentials and region.
    ///
    /// `RAYFOLD_MAX_OBJECTS` and the other `RAYFOLD_MAX_` variables limit scripts. `RAYFOLD_QUIET_MS` and
    /// `RAYFOLD_STUCK_AFTER_MS` set the pauses of the protocol. `RAYFOLD_ATTEMPTS` sets how often the sweep triggers a
    /// frame before it gives up. `RAYFOLD_SPARE_FRAMES` sets how early an assembler hands a long GIF over to the next
    /// one. `RAYFOLD_SEED` makes random pauses repeatable.
    ///
    /// # Errors
    /// Returns which variable is missing or unreadable.
    pub async fn from_environment() -> anyhow::Result<Self> {
        let bucket = env::var("RAYFOLD_BUCKET").context("RAYFOLD_BUCKET must name the bucket")?;
        let store = S3Store::from_environment(&bucket).await?;
        let mut policy = Policy::new(rayfold_tracer::PIXEL_VERSION);
        if let Some(ms) = number("RAYFOLD_QUIET_MS")? {
            policy.quiet = Duration::from_millis(ms);
        }
        if let Some(ms) = number("RAYFOLD_STUCK_AFTER_MS")? {
            policy.stuck_after = Duration::from_millis(ms);
        }
        if let Some(attempts) = number("RAYFOLD_ATTEMPTS")? {
            policy.attempts = attempts;
        }
        if let Some(frames) = number("RAYFOLD_SPARE_FRAMES")? {
            policy.spare_frames = frames;
        }
        policy.most_frames = most_frames(|name| env::var(name).ok())?;
        let seed = match number("RAYFOLD_SEED")? {
            Some(seed) => seed,
            None => getrandom::u64().context("no randomness from the system")?,
        };
        let variable = |name: &str| env::var(name).ok();
        let renderer = RayTracer::new(limits(variable)?, capacity(variable)?);
        let animator = MovieAnimator { most_pixels: renderer.limits.max_pixels };
        Ok(Self { store, bucket, renderer, animator, policy, random: Randomness::seeded(seed) })
    }
}

impl<S: Store> Context<S> {
    /// Returns the context of the pipeline's steps during a call.
    pub(crate) fn invocation<'a>(
        &'a self,
        policy: &'a Policy,
        call: &'a Call,
    ) -> Invocation<'a, S, SystemClock> {
        Invocation::new(&self.store, &SystemClock, &self.random, policy, &call.request_id)
            .until(call.deadline)
    }
}

fn number<T: FromStr<Err: std::error::Error + Send + Sync + 'static>>(
    name: &str,
) -> anyhow::Result<Option<T>> {
    match env::var(name) {
        Ok(text) => Ok(Some(text.parse().with_context(|| format!("{name}={text} is not a number"))?)),
        Err(_) => Ok(None),
    }
}
