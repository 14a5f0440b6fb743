//! A GIF that takes several invocations, one after the other, while a user changes its scripts
//! and invocations are killed.

use std::sync::Arc;
use std::time::Duration;

use super::bucket::{Actor, SimEnvironment};
use super::engine::{Engine, lock};
use super::expected::Expected;
use super::platform::{Chaos, Platform};
use super::scale::change;
use super::timed::Pace;
use super::{PIXELS, Shared};
use rayfold_pipeline::keys::{Animation, Key};
use rayfold_pipeline::store::Bucket;
use rayfold_pipeline::{Mutation, Policy};

/// The time limit of an invocation. With the margin of 5 s and the spare time it has time for two frames.
const TIMEOUT: Duration = Duration::from_secs(60);

/// The time that a frame takes.
const PUSH: Duration = Duration::from_secs(4);

/// The time by which everything must have come to rest.
const PATIENCE: Duration = Duration::from_secs(24 * 3600);

/// An animation that is assembled in pieces.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pieces {
    /// The number of frames in the animation.
    pub frames: u64,
    /// The number of the checkpoint, from 1, at whose put the first script is overwritten.
    pub overwritten_at: Option<u64>,
    /// Whether the script is changed back at once.
    pub is_changed_back: bool,
    /// One in `kill` invocations is killed, and its event is tried again.
    pub kill: u64,
    /// A rule that is broken.
    pub mutation: Option<Mutation>,
    /// The seed of everything else.
    pub seed: u64,
}

/// The result of an assembly in pieces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PiecesReport {
    /// The number of times that a GIF was left unfinished to the next invocation.
    pub left: u64,
    /// The number of GIFs that were put.
    pub gifs: u64,
    /// The number of checkpoints that were put.
    pub checkpoints: u64,
    /// The largest number of concurrent invocations of the assemble function.
    pub at_once: u64,
    /// The uploads that were neither finished nor aborted.
    pub unfinished: usize,
}

/// Assembles an animation in pieces.
///
/// # Errors
///
/// Returns the final contents of the bucket as an error if they are not the animation, or include a lease or a
/// checkpoint.
pub fn in_pieces(pieces: Pieces) -> Result<PiecesReport, String> {
    let engine = Engine::default();
    let env = SimEnvironment::new(engine.clone(), pieces.seed, false);
    // A part has two or three frames.
    env.part.store(32, std::sync::atomic::Ordering::Relaxed);
    let pace = Pace { push: PUSH, is_eager: true };
    let (policy, rule) = (Policy::new(PIXELS), pieces.mutation);
    let platform = Platform::new(env.clone(), policy, rule, 1_000, TIMEOUT, (100, 300), pace);
    *lock(&platform.chaos) = Chaos { kill: pieces.kill, ..Chaos::default() };
    let animation = Animation::new("pieces").map_err(|error| error.to_string())?;
    let counted: Shared<PiecesReport> = Shared::default();
    let script = |number: u64| format!("{}{number}.txt", animation.scripts());
    {
        let (platform, counted) = (Arc::downgrade(&platform), counted.clone());
        let (world, first) = (Arc::downgrade(&env), script(0));
        *lock(&env.notify) = Some(Arc::new(move |_: Actor, key: &str, there: bool, bucket: &Bucket| {
            match key.parse() {
                Ok(Key::Output { .. }) if there => lock(&counted).gifs += 1,
                Ok(Key::Checkpoint { .. }) if there => {
                    lock(&counted).checkpoints += 1;
                    let is_due = pieces.overwritten_at == Some(lock(&counted).checkpoints);
                    if let Some(world) = world.upgrade().filter(|_| is_due) {
                        let text = |number: u64| Some(format!("frame {number}"));
                        change(&world, first.clone(), text(1_000), Duration::ZERO);
                        if pieces.is_changed_back {
                            change(&world, first.clone(), text(0), Duration::from_millis(20));
                        }
                    }
                }
                _ => {}
            }
            if let Some(platform) = platform.upgrade() {
                let etag = bucket.head(key).ok().filter(|_| there).map(|info| info.etag);
                platform.object_event(key, etag);
            }
        }));
    }
    let settings = format!(r#"{{"frames": {}}}"#, pieces.frames);
    change(&env, animation.settings(), Some(settings), Duration::ZERO);
    for number in 0..pieces.frames {
        change(&env, script(number), Some(format!("frame {number}")), Duration::from_millis(number));
    }
    if !engine.run(PATIENCE) {
        return Err("the world does not come to rest".to_owned());
    }
    *lock(&env.notify) = None;
    engine.end();
    if let Some(bug) = &lock(&platform.diary).bug {
        return Err(bug.clone());
    }
    let bucket = lock(&env.bucket);
    Expected::of(&bucket, &animation).check(&bucket, &animation)?;
    let is_litter = |key: &str| matches!(key.parse(), Ok(Key::Lease { .. } | Key::Checkpoint { .. }));
    if let Some(key) = bucket.keys().find(|key| is_litter(key)) {
        return Err(format!("{key} is left"));
    }
    let (counted, diary) = (lock(&counted), lock(&platform.diary));
    let (left, at_once) = (diary.left, diary.assemblers_at_once);
    Ok(PiecesReport { left, at_once, unfinished: bucket.unfinished_uploads(), ..*counted })
}
