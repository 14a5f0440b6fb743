//! The protocol in a simulated world: store, clock, events, functions and users, all from one seed.
//!
//! [`run`] makes up a story (scripts uploaded, overwritten, changed back, deleted, faulty; settings coming and going)
//! and a world that fails in its own ways (events lost, doubled, late; invocations killed between any two requests;
//! answers lost; 409, 412 and 503; listings that mix two moments; writes that land after their writer is dead), lets
//! the real steps work in it, and checks at the end what the protocol guarantees:
//!
//! - once everything has come to rest, the manifest says what the bucket's scripts say, frame by frame, and there is
//!   exactly the GIF that they give;
//! - that holds **without** a sweep, unless something happened that by design only the sweep heals;
//! - manifests' revisions grow by one, no function writes below `scripts/`, every GIF has its frames in order.
//!
//! The expected results of the scripts are worked out here, apart from [`rayfold_pipeline::reconcile()`].
//!
//! ```
//! rayfold_simulation::run(1, None).expect("the protocol holds");
//! ```

use std::sync::Arc;

use rayfold_pipeline::Mutation;

mod bucket;
pub mod conformance;
mod engine;
mod expected;
pub mod explore;
mod pieces;
mod platform;
mod scale;
mod slow;
mod story;
mod timed;

pub use bucket::Limits;
pub use pieces::{Pieces, PiecesReport, in_pieces};
pub use scale::{Scale, ScaleReport, measure};
pub use slow::{Slow, SlowReport, slowly};

/// The pixel version of the frames drawn here.
const PIXELS: u32 = 1;

/// A guarantee that did not hold.
#[derive(Debug, Clone, thiserror::Error)]
#[error("seed {seed}: {what}\nreplay it with RAYFOLD_SEED={seed}")]
pub struct Violation {
    /// The seed of the run.
    pub seed: u64,
    /// The guarantee that does not hold.
    pub what: String,
}

/// The statistics of a run, for reports.
#[derive(Debug, Clone, Default)]
pub struct Run {
    /// Requests to the bucket.
    pub requests: u64,
    /// Invocations of the render and of the assemble function.
    pub invocations: [u64; 2],
    /// Whether the run had to come right without a sweep, and did.
    pub without_sweep: bool,
    /// Events that the platform gave up.
    pub given_up: u64,
    /// GIFs that an invocation left unfinished to the next one.
    pub left: u64,
    /// Writes that landed after their writer was killed.
    pub late_writes: u64,
    /// The actions of each function below each prefix, as `function action prefix`.
    pub permissions: Vec<String>,
}

/// Runs one seed, with a rule of the protocol broken on purpose if asked for.
///
/// # Errors
///
/// The first guarantee that did not hold.
pub fn run(seed: u64, mutation: Option<Mutation>) -> Result<Run, Violation> {
    story::run(seed, mutation, None).map_err(|what| Violation { seed, what })
}

/// Runs one seed and records its history, a line a request.
///
/// # Errors
///
/// The errors of [`run`].
pub fn replay(seed: u64, mutation: Option<Mutation>, log: &mut Vec<String>) -> Result<Run, Violation> {
    story::run(seed, mutation, Some(log)).map_err(|what| Violation { seed, what })
}

/// The seed that the environment variable `RAYFOLD_SEED` asks to replay.
pub fn seed_to_replay(variable: Option<&str>) -> Option<u64> {
    variable?.parse().ok()
}

/// Shared by the parts of a run.
type Shared<T> = Arc<std::sync::Mutex<T>>;

#[cfg(test)]
mod tests;
