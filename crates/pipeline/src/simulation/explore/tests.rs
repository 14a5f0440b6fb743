//! A slice of the search; `rayfold-bench explore` goes to the end.

use super::*;

/// States of a world up to which every `cargo test` searches it.
const SMALL: u64 = 2_000;

/// States of every other world that are seen.
const SLICE: u64 = 300;

/// Worlds of no more states than that, searched to their ends.
const SMALL_WORLDS: [&str; 9] = [
    "one frame, a kill",
    "one frame, a kill and a late write",
    "one frame, a lost answer",
    "one frame, an event twice",
    "one frame, an event lost",
    "one frame, overwritten when done, a late write",
    "one frame, deleted when done, a lost answer",
    "two frames, one deleted when done, a kill",
    "three frames, the last one new",
];

fn world(name: &str) -> World {
    worlds().into_iter().find(|world| world.name == name).expect(name)
}

#[test]
fn small_worlds_hold_whatever_happens_in_whatever_order() {
    for name in SMALL_WORLDS {
        let explored = explore(&world(name), None, SMALL).unwrap_or_else(|found| panic!("{found}"));
        println!("{name}: {explored:?}");
        assert!(explored.complete && explored.rests > 0, "{name}: {explored:?}");
    }
}

#[test]
fn large_worlds_hold_as_far_as_they_are_searched() {
    for world in worlds() {
        let explored = explore(&world, None, SLICE).unwrap_or_else(|found| panic!("{found}"));
        assert!(explored.steps >= explored.states - 1, "{}: {explored:?}", world.name);
    }
}

/// The search finds what breaks without the rule.
#[track_caller]
fn notices(rule: Mutation, name: &str, most: u64) {
    let found = explore(&world(name), Some(rule), most).expect_err("a broken rule is noticed");
    assert!(found.steps.len() > 5, "{found}");
    println!("{rule:?}: {} states: {found}", found.states);
}

#[test]
fn a_missing_second_listing_is_noticed() {
    notices(Mutation::SkipSecondListing, "one of two frames, changed and changed back", 20_000);
}

/// A schedule by hand: whatever is described like `first` goes on, until something described like `end` is done.
fn drive(world: &World, memo: &mut Memo, mut state: State, first: &str, end: &str) -> Result<State, String> {
    for _ in 0..200 {
        let mut choices = state.choices(world);
        choices.retain(|choice| is_plain(*choice));
        let words = |choice: &Choice| state.describe(world, *choice);
        let mine = choices.iter().find(|choice| words(choice).starts_with(first));
        // A request that meets no other may be all that is offered.
        let lone = choices.iter().find(|choice| words(choice).contains("): get scripts/"));
        let Some(choice) = mine.or(lone).copied() else { return Ok(state) };
        let is_last = mine.is_some() && words(&choice).contains(end);
        state = state.after(world, memo, choice)?;
        if is_last {
            return Ok(state);
        }
    }
    Err(format!("{first} does not come to {end}"))
}

/// A set was whole when it was claimed, not when the assembler looked, and whole again when it was committed: whoever
/// came then found the commit, and nobody claimed. Too rare for the search's first states and for most schedules.
#[test]
fn claims_before_their_commit_are_noticed() {
    let name = "the second of two frames comes, goes and comes back";
    let claimed =
        |rule| {
            let (world, mut memo) = (world(name), Memo::new(rule));
            let mut state = State::begin(&world, &mut memo)?;
            state = drive(&world, &mut memo, state, "the user", "Once")?;
            // Up to its commit, which waits.
            while !state.choices(&world).iter().any(|choice| {
                state.describe(&world, *choice).starts_with("scripts/a/2.txt#1 (1): put manifests")
            }) {
                let next = state
                    .choices(&world)
                    .into_iter()
                    .find(|choice| is_plain(*choice) && !matches!(choice, Choice::User(_)));
                let next = next.ok_or("it ended before its commit")?;
                state = state.after(&world, &mut memo, next)?;
            }
            for (first, end) in [
                ("the user", "Once"),
                ("assemblies/", "never"),
                ("the user", "Once"),
                ("scripts/a/2.txt#1", "never"),
                ("", "never"),
            ] {
                state = drive(&world, &mut memo, state, first, end)?;
            }
            state.judge(&world, &mut memo)
        };
    claimed(None).expect("with the rule it holds");
    println!("{}", claimed(Some(Mutation::ClaimBeforeCommit)).expect_err("a broken rule is noticed"));
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

#[test]
fn assemblers_that_leave_early_are_noticed() {
    let worlds = [world("one frame, changed thrice when done")];
    let rule = Some(Mutation::AssemblerLeavesEarly);
    let found = (0..1_000).find_map(|seed| Some((seed, provoke(&worlds, seed, rule).err()?)));
    let (seed, found) = found.expect("a broken rule is noticed");
    println!("seed {seed}: {found}");
}

#[test]
fn assemblers_that_do_not_look_again_are_noticed() {
    notices(Mutation::AssemblerDoesNotLookAgain, "one frame, overwritten", 20_000);
}

/// The GIF of an assembler that was killed landed on that of its successor, which knew newer scripts.
#[test]
fn unconditional_gifs_are_noticed() {
    let turns = [
        ("the user", "Once"),
        ("scripts/", "never"),
        ("the user", "Once"),
        ("scripts/", "never"),
        ("assemblies/", "never"),
        ("", "never"),
    ];
    let name = "one frame, overwritten twice when done, a late write";
    let put = |rule| {
        let (world, mut memo) = (world(name), Memo::new(rule));
        let mut state = State::begin(&world, &mut memo)?;
        state = drive(&world, &mut memo, state, turns[0].0, turns[0].1)?;
        state = drive(&world, &mut memo, state, turns[1].0, turns[1].1)?;
        // Up to the GIF, which is on its way when its sender dies.
        loop {
            let choices = state.choices(&world);
            let late = |choice: &&Choice| {
                let words = state.describe(&world, **choice);
                words.contains("put animations/") && words.ends_with("KilledAndLate")
            };
            if let Some(choice) = choices.iter().find(late) {
                state = state.after(&world, &mut memo, *choice)?;
                break;
            }
            let next =
                choices.into_iter().find(|choice| is_plain(*choice) && !matches!(choice, Choice::User(_)));
            state = state.after(&world, &mut memo, next.ok_or("no GIF is put")?)?;
        }
        for (first, end) in &turns[2..] {
            state = drive(&world, &mut memo, state, first, end)?;
        }
        state.judge(&world, &mut memo)
    };
    put(None).expect("with the rule it holds");
    println!("{}", put(Some(Mutation::DropGifCondition)).expect_err("a broken rule is noticed"));
}

#[test]
fn schedules_find_nothing_where_all_rules_hold() {
    let worlds = provoking();
    for seed in 0..20 {
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
