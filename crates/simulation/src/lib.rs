//! The protocol in a simulated world: store, clock, events, functions and users, all from one seed.
//!
//! [`run`] generates a story and a world with faults. In the story scripts are uploaded, overwritten, changed back,
//! deleted and faulty, and settings come and go. In the world events are lost, duplicated and late, invocations are
//! killed between any two requests, and replies are lost. There are 409, 412 and 503, listings that mix two moments,
//! and writes that take effect after their writer was killed. The real steps work in this world, and at the end [`run`]
//! checks the guarantees of the protocol:
//!
//! - when nothing is left to do, the manifest agrees with the bucket's scripts, frame by frame, and the only GIF is the
//!   one that they give;
//! - this holds **without** a sweep, unless something happened that by design only the sweep repairs;
//! - revisions of manifests grow by one, no function writes below `scripts/`, and every GIF has its frames in order.
//!
//! The expected results are computed here, independently of [`rayfold_pipeline::reconcile()`].
//!
//! ```
//! rayfold_simulation::run(1, None).expect("the protocol holds");
//! ```
//!
//! [`explore`] models an invocation as a function from the replies received so far to its next requests, so that states
//! can be copied and compared. A step can declare the values that its remaining behaviour depends on
//! (`Invocation::forget_history_before`). Then [`explore`] drops the earlier history, which merges states.
//!
//! Rules that are broken on purpose ([`Mutation`]) are branches of the steps, so they stay in `pipeline`. Without the
//! feature `simulation` none can be chosen.

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
    /// The number of requests to the bucket.
    pub requests: u64,
    /// The number of invocations of the render and of the assemble function.
    pub invocations: [u64; 2],
    /// Whether the run had to reach the right state without a sweep, and did.
    pub without_sweep: bool,
    /// The number of events that the platform gave up.
    pub given_up: u64,
    /// The number of GIFs that an invocation left unfinished to the next one.
    pub left: u64,
    /// The number of writes that took effect after their writer was killed.
    pub late_writes: u64,
    /// The actions of each function below each prefix, as `function action prefix`.
    pub permissions: Vec<String>,
}

/// Runs one seed. `mutation` is a rule of the protocol that is broken on purpose.
///
/// # Errors
///
/// The first guarantee that did not hold.
pub fn run(seed: u64, mutation: Option<Mutation>) -> Result<Run, Violation> {
    story::run(seed, mutation, None).map_err(|what| Violation { seed, what })
}

/// Runs one seed and records its history, one line per request.
///
/// # Errors
///
/// The errors of [`run`].
pub fn replay(seed: u64, mutation: Option<Mutation>, log: &mut Vec<String>) -> Result<Run, Violation> {
    story::run(seed, mutation, Some(log)).map_err(|what| Violation { seed, what })
}

/// Returns the seed in the environment variable `RAYFOLD_SEED`, for a replay.
pub fn seed_to_replay(variable: Option<&str>) -> Option<u64> {
    variable?.parse().ok()
}

/// The data that the parts of a run share.
type Shared<T> = Arc<std::sync::Mutex<T>>;

#[cfg(test)]
mod tests;
