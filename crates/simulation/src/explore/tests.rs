//! A slice of the search; `rayfold-bench explore` goes to the end.

use super::*;

/// States of a world up to which every `cargo test` searches it.
const SMALL: u64 = 8_000;

/// Worlds of no more states than that.
const SMALL_WORLDS: usize = 26;

fn world(name: &str) -> World {
    worlds().into_iter().find(|world| world.name == name).expect(name)
}

/// Small worlds are searched to their ends, and once more with nothing forgotten; the others as far as that goes.
#[test]
fn worlds_hold_whatever_happens_in_whatever_order_and_nothing_is_missed_by_forgetting() {
    let search = |world: &World, most| explore(world, None, most).unwrap_or_else(|found| panic!("{found}"));
    let mut small = 0;
    for world in worlds() {
        let explored = search(&world, SMALL);
        println!("{}: {explored:?}", world.name);
        assert!(explored.steps >= explored.states - 1, "{}: {explored:?}", world.name);
        if explored.complete {
            small += 1;
            let remembered = search(&world.remembering(), 4 * SMALL);
            assert!(
                remembered.complete && remembered.saw_the_same_as(&explored),
                "{}: {remembered:?}",
                world.name
            );
            assert!(remembered.states >= explored.states && explored.rests > 0, "{}", world.name);
        }
    }
    assert_eq!(small, SMALL_WORLDS);
}

/// The search finds the error without the rule, and it is a story: the same search with the rule finds nothing.
#[track_caller]
fn notices(rule: Mutation, name: &str, most: u64) {
    let found = explore(&world(name), Some(rule), most).expect_err("a broken rule is noticed");
    assert!(found.steps.len() > 5, "{found}");
    println!("{rule:?}: {} states: {found}", found.states);
    explore(&world(name), None, most).unwrap_or_else(|found| panic!("{found}"));
}

#[test]
fn a_missing_second_listing_is_noticed() {
    notices(Mutation::SkipSecondListing, "one of two frames, changed and changed back", 20_000);
}

/// A set was whole when it was claimed, not when the assembler looked, and whole again when it was committed. The
/// finisher that came then found the commit, and none claimed.
#[test]
fn claims_before_their_commit_are_noticed() {
    notices(Mutation::ClaimBeforeCommit, "the second of two frames comes, goes and comes back", 20_000);
}

#[test]
fn unconditional_manifests_are_noticed() {
    notices(Mutation::DropIfMatch, "one frame, a kill and a late write", 20_000);
}

#[test]
fn leaving_ones_own_commit_is_noticed() {
    notices(Mutation::LeaveOwnCommit, "one frame, a kill", 20_000);
}

#[test]
fn missing_claims_are_noticed() {
    notices(Mutation::NeverClaim, "one frame, a kill", 20_000);
}

/// An assembler wrote down that a frame was pending which was there again, and left. The invocation that had brought
/// the frame back had found the earlier manifest.
#[test]
fn assemblers_that_leave_early_are_noticed() {
    notices(Mutation::AssemblerLeavesEarly, "the second of two frames comes, goes and comes back", 20_000);
}

#[test]
fn assemblers_that_do_not_look_again_are_noticed() {
    notices(Mutation::AssemblerDoesNotLookAgain, "one frame, overwritten", 20_000);
}

#[test]
fn frames_put_together_too_early_are_noticed() {
    notices(Mutation::JoinTooEarly, "a frame in bands", 20_000);
}

/// Two whose frames the manifest shows to come left for each other.
#[test]
fn leaving_for_a_frame_that_is_there_is_noticed() {
    notices(Mutation::LeaveForAnyFrame, "two frames, announced last", 20_000);
}

/// A file that changes while it is read has an event that finds no set of it.
#[test]
fn a_file_that_is_not_looked_at_again_is_noticed() {
    notices(Mutation::FilesNotLookedAtAgain, "a file after its script", 20_000);
}

/// The GIF of an assembler that was killed landed on that of its successor, which knew newer scripts.
#[test]
fn unconditional_gifs_are_noticed() {
    notices(Mutation::DropGifCondition, "one frame, overwritten twice when done, a late write", 20_000);
}

/// An assembler that had found the lease taken took it when it was handed over, as one that none wanted, and gave up
/// the unfinished GIF; the claim's assembler found the lease taken, and none built.
#[test]
fn a_lease_that_is_handed_over_is_not_taken_by_who_has_left_the_gif_to_its_holder() {
    for name in ["two frames in two pieces, a kill", "two frames in two pieces, the first overwritten"] {
        let explored = explore(&world(name), None, 5_000).unwrap_or_else(|found| panic!("{found}"));
        assert!(explored.states > 1_000, "{name}: {explored:?}");
    }
}

/// The first frame was another one when the GIF was left unfinished.
#[test]
fn unfinished_gifs_of_another_set_that_are_gone_on_with_are_noticed() {
    notices(Mutation::TakeUpAnyCheckpoint, "two frames in two pieces, the first overwritten", 20_000);
}

#[test]
fn schedules_find_nothing_where_all_rules_hold() {
    let worlds = provoking();
    for seed in 0..20 {
        provoke(&worlds, seed, None).unwrap_or_else(|found| panic!("seed {seed}: {found}"));
    }
}

/// Two rules that few seeds notice, so they are named here; the report of `rayfold-bench explore` lists the
/// worlds that notice them.
#[test]
fn rules_that_few_schedules_notice_are_noticed() {
    let worlds = provoking();
    for rule in [Mutation::ClaimBeforeCommit, Mutation::DropGifCondition] {
        let noticed = (0..1000).find_map(|seed| Some((seed, provoke(&worlds, seed, Some(rule)).err()?)));
        let (seed, found) = noticed.unwrap_or_else(|| panic!("{rule:?} is not noticed"));
        println!("{rule:?}: seed {seed}: {found}");
        provoke(&worlds, seed, None).unwrap_or_else(|found| panic!("seed {seed}: {found}"));
    }
}

#[test]
fn a_seed_gives_the_same_schedule() {
    let noticed = || {
        let worlds = provoking();
        let rule = Some(Mutation::NeverClaim);
        (0..20).map(|seed| provoke(&worlds, seed, rule).err().map(|found| found.steps)).collect::<Vec<_>>()
    };
    assert_eq!(noticed(), noticed());
}
