//! Chaos tests of the real parts. The built-in store, the invoker and the unmodified functions run as processes, each
//! of which is killed (`kill -9`) again and again. Proxies before the store and before the invoker delay and cut
//! connections and falsify replies. The disk is full for a while, clocks step, events are lost, duplicated and late.
//! Meanwhile a user changes animations. After the faults end, each animation equals the uploaded set byte for byte, or
//! reports why it does not.
//!
//! A run consists of rounds, each with its own seed and folder. `RAYFOLD_SEED` replays one with the same user actions
//! and the same random faults; their assignment to requests depends on the machine. For a long run:
//!
//! ```text
//! RAYFOLD_CHAOS_MINUTES=10 cargo test -p rayfold-lambda --test chaos -- --nocapture
//! ```
//!
//! and with `RAYFOLD_CHAOS_REPORT=$PWD/docs/reports/chaos.md` it writes its results there. With
//! `RAYFOLD_CHAOS_STORE=minio` the store is MinIO, which does not accept other clocks.
//!
//! A full disk is a limit on the size of files (`ulimit -f`), slightly above the current size of the largest file. This
//! needs no separate file system and no right to mount one. Clocks step by `libfaketime` if that is installed (Debian's
//! package). If it is not, a line reports that they did not step.

#![allow(clippy::print_stderr, reason = "says what a run was like")]
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

#[path = "chaos/gate.rs"]
mod gate;
#[path = "chaos/parts.rs"]
mod parts;
#[path = "chaos/report.rs"]
mod report;
mod stage;
#[path = "chaos/tally.rs"]
mod tally;
#[path = "chaos/wishes.rs"]
mod wishes;
#[path = "chaos/world.rs"]
mod world;

use std::time::{Duration, Instant};

use fastrand::Rng;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::retry::{Scope, retry};
use rayfold_pipeline::{Invocation, Policy, Randomness, SystemClock};
use report::Round;
use tally::Tally;
use wishes::{ANIMATIONS, Wishes, given_up, wrong};
use world::World;

/// The duration of the faults in a round.
const WILD: Duration = Duration::from_secs(20);

/// The time limit for recovery after the faults end.
const PATIENCE: Duration = Duration::from_secs(240);

/// The test, which is also the entry point of the parts.
const TEST: &str = "animations_end_right_or_named_whatever_happens";

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok().map(|text| text.parse().unwrap())
}

#[tokio::test(flavor = "multi_thread")]
async fn animations_end_right_or_named_whatever_happens() {
    if parts::is_part().await {
        return;
    }
    if parts::lying_clock().is_none() {
        eprintln!("clocks do not step: libfaketime is not installed");
    }
    eprintln!("chaos on {}", parts::store_kind());
    let first = number("RAYFOLD_SEED").unwrap_or_else(|| fastrand::u64(..1_000_000));
    let length = Duration::from_secs(60 * number("RAYFOLD_CHAOS_MINUTES").unwrap_or(0));
    let (start, mut rounds) = (Instant::now(), Vec::new());
    for seed in first.. {
        eprintln!("replay this round with RAYFOLD_SEED={seed}");
        let round = round(seed).await;
        eprintln!("{round}");
        rounds.push(round);
        if start.elapsed() >= length {
            break;
        }
    }
    if let Ok(path) = std::env::var("RAYFOLD_CHAOS_REPORT") {
        std::fs::write(path, report::page(parts::store_kind(), &rounds, start.elapsed())).unwrap();
    }
}

/// Runs one round. Returns its faults and the recovery.
async fn round(seed: u64) -> Round {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Rng::with_seed(seed);
    let (mut of_world, mut of_user) = (random.fork(), random.fork());
    let tally = Tally::default();
    let mut world = World::start(folder.path(), tally.clone(), of_world.fork()).await;
    let store = world.store();
    let (mut wishes, end) = (Wishes::default(), Instant::now() + WILD);
    let disasters = async {
        while Instant::now() < end {
            tokio::time::sleep(Duration::from_millis(of_world.u64(200..2_000))).await;
            world.disaster(&mut of_world).await;
        }
    };
    let acts = async {
        while Instant::now() < end {
            wishes.act(&mut of_user, &store).await;
            tokio::time::sleep(Duration::from_millis(of_user.u64(10..400))).await;
        }
    };
    tokio::join!(disasters, acts);
    world.calm_down().await;
    let said_again = wishes.make_sure(&store).await;
    let calm = Instant::now();
    let named = come_right(&store, &wishes).await;
    let took = calm.elapsed();
    drop(world);
    tally.add_notes(folder.path());
    assert!(wishes.acts > 10 && tally.of("invocations") > 0, "nothing happened: {tally}");
    Round { seed, acts: wishes.acts, said_again, named, took, tally }
}

/// Waits until all animations are right. Returns the names of the items that were given up in between, which the user
/// has retried.
async fn come_right(store: &rayfold_pipeline::store::S3Store, wishes: &Wishes) -> Vec<String> {
    let (start, mut named, mut quiet) = (Instant::now(), Vec::new(), 0);
    // Twice in a row, to check that the state is stable.
    while quiet < 2 {
        tokio::time::sleep(Duration::from_millis(700)).await;
        let mut faults = Vec::new();
        for name in ANIMATIONS {
            let files = wishes.of(name);
            faults.extend(wrong(store, name, &files).await);
            let given_up = given_up(store, name, &files).await;
            if !given_up.is_empty() {
                let id = format!("chaos-{name}-{}", named.len());
                named.extend(given_up);
                let (random, policy) = (Randomness::seeded(1), Policy::new(rayfold_tracer::PIXEL_VERSION));
                let invocation = Invocation::new(store, &SystemClock, &random, &policy, &id);
                retry(&invocation, &Animation::new(name).unwrap(), Scope::Failed).await.unwrap();
            }
        }
        quiet = if faults.is_empty() { quiet + 1 } else { 0 };
        assert!(start.elapsed() < PATIENCE, "{}", faults.join("\n"));
    }
    named
}
