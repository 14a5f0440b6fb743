//! Chaos on the real parts. The store on board, the invoker and the unmodified functions run as processes that are killed
//! again and again (`kill -9`), each by itself; a proxy stands before the store, another before the invoker, which slow, cut and
//! lie; the disk is full for a while, clocks step, events are lost, doubled and late. A user changes animations meanwhile.
//! In the end, in a calm world, each animation is what the uploaded set says, byte for byte, or says by name why it is not.
//!
//! A run is rounds, each of a seed and a folder of its own. `RAYFOLD_SEED` replays one: the same acts and the same dice;
//! which request meets which of them is up to the machine. At length:
//!
//! ```text
//! RAYFOLD_CHAOS_MINUTES=10 cargo test -p rayfold-lambda --test chaos -- --nocapture
//! ```
//!
//! and with `RAYFOLD_CHAOS_REPORT=$PWD/docs/reports/chaos.md` it writes what it saw there. With `RAYFOLD_CHAOS_STORE=minio` the
//! store is MinIO, which does not believe in other clocks.
//!
//! A full disk is a limit on the size of files (`ulimit -f`), set where the largest one has nearly arrived: no file system of
//! its own is needed, nor rights to mount one. Clocks step by `libfaketime` where that is installed (Debian's package); where
//! it is not a line says that they did not.

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

/// How long things go wrong in a round.
const WILD: Duration = Duration::from_secs(20);

/// By when a calm world must have come right.
const PATIENCE: Duration = Duration::from_secs(240);

/// The test that parts are started as, too.
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

/// One round: what was wrong in it, and how it came right.
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

/// Waits until all animations are right; gives the names of what was given up on the way. That the user has tried again.
async fn come_right(store: &rayfold_pipeline::store::S3Store, wishes: &Wishes) -> Vec<String> {
    let (start, mut named, mut quiet) = (Instant::now(), Vec::new(), 0);
    // Twice in a row: it stays so.
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
