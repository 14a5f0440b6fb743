//! A slice of the simulation; `rayfold-bench simulate` runs the long ones.

use std::time::Duration;

use super::*;

/// How many seeds every `cargo test` runs.
const SEEDS: u64 = 1_000;

#[test]
fn the_protocol_holds() {
    if let Some(seed) = seed_to_replay(std::env::var("RAYFOLD_SEED").ok().as_deref()) {
        let mut log = Vec::new();
        let outcome = replay(seed, None, &mut log);
        println!("{}", log.join("\n"));
        outcome.unwrap_or_else(|violation| panic!("{violation}"));
        return;
    }
    let mut without_sweep = 0;
    for seed in 0..SEEDS {
        let run = run(seed, None).unwrap_or_else(|violation| panic!("{violation}"));
        without_sweep += u64::from(run.without_sweep);
    }
    assert!(without_sweep > SEEDS / 2, "most runs must not need the sweep: {without_sweep}");
}

/// Some rules are noticed by many seeds; all of them by the search ([`explore`](super::explore)).
#[test]
fn broken_rules_are_noticed_by_seeds() {
    for (rule, seeds) in
        [(Mutation::DropIfMatch, 20), (Mutation::LeaveOwnCommit, 300), (Mutation::NeverClaim, 20)]
    {
        let noticed = (0..seeds).find_map(|seed| run(seed, Some(rule)).err());
        println!("{rule:?}: {}", noticed.unwrap_or_else(|| panic!("{rule:?}")));
    }
}

/// A user flickered a script while the sweep deleted what was superseded: the deleted frame was current again, and
/// pending until the next sweep.
#[test]
fn what_comes_back_while_it_is_tidied_away_is_drawn_again() {
    run(141, None).unwrap_or_else(|violation| panic!("{violation}"));
}

/// An assembler that had waited for most of its time refused a set for which only a moment was left.
#[test]
fn a_set_that_becomes_whole_late_is_not_refused() {
    run(23_812, None).unwrap_or_else(|violation| panic!("{violation}"));
}

/// An attempt that found the lease of an earlier one, and could not renew it, took it for another's and left.
#[test]
fn an_assembler_knows_its_own_lease() {
    run(61_305, None).unwrap_or_else(|violation| panic!("{violation}"));
}

#[test]
fn a_seed_gives_the_same_run() {
    let (mut first, mut second) = (Vec::new(), Vec::new());
    replay(32, None, &mut first).unwrap();
    replay(32, None, &mut second).unwrap();
    assert!(first.len() > 50 && first == second);
}

/// What `docs/pipeline.md` says that each function does, besides what only superseded parts lead to.
#[test]
fn functions_do_only_what_their_permissions_say() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in 0..SEEDS {
        seen.extend(run(seed, None).unwrap_or_else(|violation| panic!("{violation}")).permissions);
    }
    seen.retain(|permission| !permission.starts_with("User"));
    let table = "
        Render: scripts/ List Get, parts/ List Get Put, frames/ List Get Put, manifests/ Get Put, assemblies/ Put
        Assemble: scripts/ List Get, parts/ List Delete, frames/ List Get Put Delete, manifests/ List Get Put,
            assemblies/ Put, retries/ List Put, animations/ Get Put Delete";
    let mut expected = std::collections::BTreeSet::new();
    for function in ["Render", "Assemble"] {
        let (_, rest) = table.split_once(&format!("{function}:")).unwrap();
        let line = rest.split_once(':').map_or(rest, |(line, _)| line);
        for entry in line.trim_end_matches("Assemble").split(',') {
            let mut words = entry.split_whitespace();
            let folder = words.next().unwrap();
            expected.extend(words.map(|action| format!("{function} {action} {folder}")));
        }
    }
    assert_eq!(seen, expected);
}

/// Each finished moment woke an assembler that waited until the upload was quiet: 56 at once, and 20 GIFs of 20 frames.
#[test]
fn a_slow_upload_has_one_assembler_that_waits() {
    for (scripts, apart_ms) in [(60, 1_000), (20, 4_000), (300, 80)] {
        let slow = Slow { scripts, apart_ms, removed: 0, timeout: None, seed: 1 };
        let report = slowly(slow).unwrap();
        println!("{slow:?}: {report:?}");
        assert!(report.gifs <= 2, "{report:?}");
        // Others look, find the lease, and leave within a few requests.
        let upload = Duration::from_millis(scripts * apart_ms + 10_000);
        assert!(report.assembling < upload + Duration::from_millis(250) * report.claims as u32, "{report:?}");
        assert!(report.requests < 8 * report.claims + 6 * scripts, "{report:?}");
    }
}

/// 140 GIFs were built while 300 scripts were deleted.
#[test]
fn a_slow_removal_is_assembled_once_it_is_over() {
    let slow = Slow { scripts: 310, apart_ms: 80, removed: 300, timeout: None, seed: 1 };
    let report = slowly(slow).unwrap();
    println!("{report:?}");
    assert!(report.gifs <= 2 && report.whole < Duration::from_secs(24 + 10), "{report:?}");
}

/// An upload that lasts longer than an invocation may run is watched by one after the other.
#[test]
fn an_assembler_hands_over_before_its_time_is_up() {
    let timeout = Some(Duration::from_secs(60));
    let report = slowly(Slow { scripts: 200, apart_ms: 2_000, removed: 0, timeout, seed: 1 }).unwrap();
    println!("{report:?}");
    assert!(report.gifs <= 2, "{report:?}");
}

fn scaled(frames: u64, concurrency: usize, most_requests: f64) {
    let report = measure(Scale::unlimited(frames, concurrency, 1)).unwrap();
    println!("{frames} frames, {concurrency} at once: {report:?}");
    assert!(report.requests_a_frame <= most_requests, "{report:?}");
    assert!(report.tail <= Duration::from_secs(1), "{report:?}");
    assert!(report.idle <= 4, "{report:?}");
}

#[test]
fn few_frames_on_as_many_invocations() {
    scaled(50, 50, 12.0);
}

#[test]
fn many_frames_on_as_many_invocations() {
    scaled(300, 300, 8.0);
}

#[test]
fn more_frames_than_a_page_on_fewer_invocations() {
    scaled(1_100, 150, 12.0);
}
