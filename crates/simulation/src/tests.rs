//! A slice of the simulation; `rayfold-bench simulate` runs the long ones.

use std::time::Duration;

use rayfold_pipeline::SystemClock;
use rayfold_pipeline::store::MemoryStore;

use super::*;

/// The number of seeds that every `cargo test` runs.
const SEEDS: u64 = 1_000;

#[tokio::test]
async fn the_memory_store_conforms() {
    conformance::check(&MemoryStore::new(SystemClock), "suite").await;
}

#[test]
fn the_protocol_holds() {
    if let Some(seed) = seed_to_replay(std::env::var("RAYFOLD_SEED").ok().as_deref()) {
        let mut log = Vec::new();
        let outcome = replay(seed, None, &mut log);
        println!("{}", log.join("\n"));
        outcome.unwrap_or_else(|violation| panic!("{violation}"));
        return;
    }
    let (mut without_sweep, mut left) = (0, 0);
    for seed in 0..SEEDS {
        let run = run(seed, None).unwrap_or_else(|violation| panic!("{violation}"));
        left += run.left;
        without_sweep += u64::from(run.without_sweep);
    }
    assert!(without_sweep > SEEDS / 2, "most runs must not need the sweep: {without_sweep}");
    assert!(left > SEEDS / 8, "GIFs must be built in pieces, too: {left}");
}

/// Many seeds detect the violation of some rules; the search ([`explore`](super::explore)) detects that of all rules.
/// The last one is detected by about one seed in 30,000.
#[test]
fn broken_rules_are_noticed_by_seeds() {
    for (rule, mut seeds) in [
        (Mutation::DropIfMatch, 0..20),
        (Mutation::LeaveOwnCommit, 0..300),
        (Mutation::NeverClaim, 0..20),
        (Mutation::JoinTooEarly, 0..30),
        (Mutation::TakeUpAnyCheckpoint, 0..500),
        (Mutation::LeaveForAnyFrame, 0..300),
        (Mutation::FilesNotLookedAtAgain, 20_481..20_482),
    ] {
        let noticed = seeds.find_map(|seed| run(seed, Some(rule)).err());
        println!("{rule:?}: {}", noticed.unwrap_or_else(|| panic!("{rule:?}")));
    }
}

/// Frames in bands are cut again by invocations that list before the cut is written. Meanwhile events are lost,
/// duplicated and late, invocations are killed, replies are lost, and scripts are overwritten.
#[test]
fn frames_in_bands_are_put_together_whatever_happens() {
    let mut put_together = 0;
    for seed in 0..SEEDS / 2 {
        let mut log = Vec::new();
        replay(seed, None, &mut log).unwrap_or_else(|violation| panic!("{violation}"));
        let is_banded = log.iter().any(|line| line.contains("put frames/") && line.contains(".band "));
        put_together += u64::from(is_banded);
    }
    assert!(put_together > SEEDS / 20, "few runs have bands: {put_together}");
}

#[test]
fn a_seed_gives_the_same_run() {
    let (mut first, mut second) = (Vec::new(), Vec::new());
    replay(32, None, &mut first).unwrap();
    replay(32, None, &mut second).unwrap();
    assert!(first.len() > 50 && first == second);
}

/// `docs/pipeline.md` lists the actions of each function, except those for superseded parts.
#[test]
fn functions_do_only_what_their_permissions_say() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in 0..SEEDS {
        seen.extend(run(seed, None).unwrap_or_else(|violation| panic!("{violation}")).permissions);
    }
    seen.retain(|permission| !permission.starts_with("User"));
    let table = "
        Render: scripts/ List Get, parts/ List Get Put, frames/ List Get Put, manifests/ Get Put, assemblies/ Put
        Assemble: scripts/ List Get, parts/ List Delete, frames/ List Get Put Delete, manifests/ List Get Put Delete,
            assemblies/ Put, retries/ List Put, animations/ Get Put Delete, checkpoints/ Get Put Delete";
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

/// Each time that all known frames were done, an assembler was invoked and waited until the upload was quiet: 56 at
/// once, and 20 GIFs of 20 frames.
#[test]
fn a_slow_upload_has_one_assembler_that_waits() {
    for (scripts, apart_ms) in [(60, 1_000), (20, 4_000), (300, 80)] {
        let slow = Slow { scripts, apart_ms, removed: 0, timeout: None, seed: 1 };
        let report = slowly(slow).unwrap();
        println!("{slow:?}: {report:?}");
        assert!(report.gifs <= 2, "{report:?}");
        // Others find the lease, and leave after this one request.
        let upload = Duration::from_millis(scripts * apart_ms + 10_000);
        assert!(report.assembling < upload + Duration::from_millis(250) * report.claims as u32, "{report:?}");
        // A fast upload takes 1 of the assemblers, and about as many of the others.
        assert!(report.requests < 7 * scripts && report.rendering < 12 * scripts, "{report:?}");
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

/// If an upload lasts longer than an invocation may run, assemblers wait for it one after the other.
#[test]
fn an_assembler_hands_over_before_its_time_is_up() {
    let timeout = Some(Duration::from_secs(60));
    let report = slowly(Slow { scripts: 200, apart_ms: 2_000, removed: 0, timeout, seed: 1 }).unwrap();
    println!("{report:?}");
    assert!(report.gifs <= 2, "{report:?}");
}

/// The GIF equals that of an assembler that has time for all of it.
#[test]
fn a_gif_that_takes_too_long_for_one_assembler_is_built_by_several() {
    for (frames, left) in [(1, 0), (2, 0), (3, 1), (40, 19)] {
        let report = in_pieces(Pieces { frames, seed: 1, ..Pieces::default() }).unwrap();
        println!("{frames} frames: {report:?}");
        let expected = PiecesReport { left, gifs: 1, checkpoints: left, ..report };
        assert_eq!(report, expected);
        assert!(report.unfinished == 0 && report.at_once <= 2, "{report:?}");
    }
}

/// A GIF is refused if it would take longer than an unfinished upload is kept.
#[test]
fn a_gif_that_takes_a_day_is_refused() {
    assert_eq!(
        in_pieces(Pieces { frames: 180, seed: 1, ..Pieces::default() }).map(|report| report.left),
        Ok(89)
    );
    let refused = in_pieces(Pieces { frames: 182, seed: 1, ..Pieces::default() }).unwrap_err();
    assert_eq!(refused, "the manifest is Refused, not Done");
}

/// The build starts over, and the upload of the earlier build is aborted.
#[test]
fn a_set_that_changes_between_two_pieces_is_begun_anew() {
    let mut noticed = 0;
    for overwritten_at in 1..6 {
        for is_changed_back in [false, true] {
            let overwritten_at = Some(overwritten_at);
            let pieces = Pieces { frames: 12, overwritten_at, is_changed_back, seed: 1, ..Pieces::default() };
            let report = in_pieces(pieces).unwrap();
            println!("{pieces:?}: {report:?}");
            assert!(report.gifs == 1 && report.unfinished == 0, "{report:?}");
            let broken = Pieces { mutation: Some(Mutation::TakeUpAnyCheckpoint), ..pieces };
            let found = in_pieces(broken).err();
            noticed += u64::from(found.is_some_and(|what| what.contains("the GIF is from another set")));
        }
    }
    assert!(noticed > 1, "the rule that keeps them apart is broken unnoticed");
}

/// The leftovers of a killed assembler cost time, never the GIF.
#[test]
fn assemblers_of_pieces_may_be_killed_at_any_moment() {
    let (mut left, mut unhealed) = (0, 0);
    for seed in 0..60 {
        let overwritten_at = (seed % 3 == 0).then_some(1 + seed % 4);
        let pieces = Pieces { frames: 9, overwritten_at, kill: 8, seed, ..Pieces::default() };
        match in_pieces(pieces) {
            Ok(report) => left += report.left,
            // The platform gave up an event: only the sweep heals that, and the seeds of all stories see to it.
            Err(what) => {
                let needs_sweep = ["there is no GIF", "is left", "pending", "the manifest is Refused"];
                assert!(needs_sweep.iter().any(|known| what.contains(known)), "{seed}: {what}");
                unhealed += 1;
            }
        }
    }
    println!("{left} pieces, {unhealed} that wait for the sweep");
    assert!(left > 200 && unhealed < 10, "{left} pieces, {unhealed} that wait for the sweep");
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

/// 299 frames of 8 x 8 pixels took 33 s on two places, because finishers paused, and 2,000 took 17 requests each.
#[test]
fn on_few_places_nobody_waits_for_a_crowd() {
    for (frames, places) in [(50, 1), (300, 1), (300, 2), (1_000, 4), (1_000, 16)] {
        let scale = Scale { draw_ms: (1, 5), ..Scale::unlimited(frames, places, 1) };
        let report = measure(scale).unwrap();
        println!("{frames} frames, {places} at once: {report:?}");
        assert!(report.requests_a_frame <= 8.0, "{report:?}");
        // Six requests one after the other, of which two go side by side.
        assert!(report.beyond_drawing <= Duration::from_millis(180), "{report:?}");
        assert!(report.tail <= Duration::from_secs(1) && report.idle <= 4, "{report:?}");
    }
}
