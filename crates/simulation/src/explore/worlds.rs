//! The small worlds: the actions of their users, and the faults that may happen.

use super::Budget;

/// A world that is small enough for a search.
#[derive(Debug, Clone)]
pub struct World {
    /// The name of the world in reports.
    pub name: &'static str,
    /// The objects that the user puts or deletes, in this order: keys and texts.
    pub(super) acts: Vec<(String, Option<&'static str>)>,
    /// The number of actions that are in the past. After each of them everything came to rest.
    pub(super) past: usize,
    /// Whether the event of the past's last claim is delivered once more.
    pub(super) is_claimed_again: bool,
    /// Whether an assembler has time for only one frame, so that a GIF of several takes as many invocations.
    pub(super) is_cut: bool,
    /// The faults that may happen.
    pub budget: Budget,
    /// Whether invocations are distinguished by their whole history, not only by the state from which they continue.
    pub(super) remembers: bool,
}

impl World {
    /// Returns the world with invocations that drop no history: its search has the same result, and takes longer.
    pub fn remembering(&self) -> Self {
        World { remembers: true, ..self.clone() }
    }
}

/// Worlds without faults; only the order varies.
const CALM: Budget = Budget { kills: 0, ghosts: 0, losses: 0, doubles: 0, drops: 0 };

/// A script of one frame.
const A: Option<&str> = Some("frame 0");
/// A second text of the script.
const B: Option<&str> = Some("frame 1");
/// A third text of the script.
const C: Option<&str> = Some("frame 2");
/// One frame that is drawn in bands.
const BIG: Option<&str> = Some("big frame 0");
/// Settings that request two files.
const BOTH: Option<&str> = Some("{\"outputs\": [\"gif\", \"webp\"]}");
/// Settings that request another file than a GIF.
const WEBP: Option<&str> = Some("{\"outputs\": [\"webp\"]}");
/// A script that names a file.
const WITH_F: Option<&str> = Some("with f frame 0");
/// The file.
const RED: Option<&str> = Some("red");
/// The file with another content.
const BLUE: Option<&str> = Some("blue");
/// A file that refers to another one.
const ALSO_G: Option<&str> = Some("also g");
/// The object is deleted.
const GONE: Option<&str> = None;

fn world(name: &'static str, past: usize, budget: Budget, acts: &[(&str, Option<&'static str>)]) -> World {
    let acts = acts.iter().map(|(file, text)| (format!("scripts/a/{file}"), *text)).collect();
    World { name, acts, past, is_claimed_again: false, is_cut: false, budget, remembers: false }
}

/// Between the past and the actions, an assembler is invoked that has nothing to do, because events may be late and
/// duplicated.
fn claimed_again(world: World) -> World {
    World { is_claimed_again: true, ..world }
}

/// Each frame of a GIF takes a separate invocation.
fn cut(world: World) -> World {
    World { is_cut: true, ..world }
}

/// Returns all worlds that are searched.
pub fn worlds() -> Vec<World> {
    let kill = Budget { kills: 1, ..CALM };
    let late = Budget { kills: 1, ghosts: 1, ..CALM };
    let loss = Budget { losses: 1, ..CALM };
    let twice = Budget { doubles: 1, ..CALM };
    let lost = Budget { drops: 1, ..CALM };
    let one = [("1.txt", A)];
    let two = [("1.txt", A), ("2.txt", A)];
    let three = [("1.txt", A), ("2.txt", A), ("3.txt", A)];
    let overwrite = [("1.txt", A), ("1.txt", B)];
    let revert = [("1.txt", A), ("1.txt", B), ("1.txt", A)];
    let delete = [("1.txt", A), ("2.txt", A), ("2.txt", GONE)];
    let emptied = [("1.txt", A), ("1.txt", GONE)];
    let flicker = [("1.txt", A), ("2.txt", A), ("2.txt", B), ("2.txt", A)];
    let fault = [("1.txt", Some("bad 0")), ("1.txt", A)];
    let split = [("1.txt", Some("split 2 0"))];
    let thrice = [("1.txt", A), ("1.txt", B), ("1.txt", C)];
    let again = [("1.txt", A), ("1.txt", B), ("1.txt", C), ("1.txt", B)];
    let to_and_fro = [("1.txt", A), ("1.txt", B), ("1.txt", A), ("1.txt", B)];
    let waiting = [("animation.json", Some("{\"frames\": 2}")), ("1.txt", A), ("1.txt", B), ("1.txt", A)];
    let returning = [
        ("animation.json", Some("{\"frames\": 2}")),
        ("1.txt", A),
        ("2.txt", A),
        ("2.txt", GONE),
        ("2.txt", A),
    ];
    let big = [("1.txt", BIG)];
    let big_overwrite = [("1.txt", BIG), ("1.txt", A)];
    let big_revert = [("1.txt", BIG), ("1.txt", A), ("1.txt", BIG)];
    let mended = [("1.txt", A), ("1.txt", Some("bad 0")), ("1.txt", B)];
    let refilled = [("1.txt", A), ("1.txt", GONE), ("1.txt", B)];
    let joined = [("1.txt", A), ("2.txt", A), ("1.txt", B)];
    let announced = [("animation.json", Some("{\"frames\": 2}")), ("1.txt", A), ("2.txt", A)];
    let announced_last = [("1.txt", A), ("2.txt", A), ("animation.json", Some("{\"frames\": 2}"))];
    let returning_early = [("1.txt", A), ("2.txt", A), ("2.txt", B), ("2.txt", A)];
    let deleted_early = [("1.txt", A), ("2.txt", A), ("3.txt", A), ("3.txt", GONE)];
    let both = [("animation.json", BOTH), ("1.txt", A), ("1.txt", B)];
    let both_late = [("1.txt", A), ("animation.json", BOTH), ("animation.json", GONE)];
    let one_for_another = [("animation.json", WEBP), ("1.txt", A), ("animation.json", GONE)];
    let file = [("f", RED), ("1.txt", WITH_F)];
    let file_late = [("1.txt", WITH_F), ("f", RED)];
    let file_changed = [("f", RED), ("1.txt", WITH_F), ("f", BLUE)];
    let file_to_and_fro = [("f", RED), ("1.txt", WITH_F), ("f", BLUE), ("f", RED)];
    let file_gone = [("f", RED), ("1.txt", WITH_F), ("f", GONE)];
    let file_back = [("f", RED), ("1.txt", WITH_F), ("f", GONE), ("f", RED)];
    let referred = [("f", ALSO_G), ("1.txt", WITH_F), ("g", RED)];
    let two_with_file = [("1.txt", WITH_F), ("2.txt", WITH_F), ("f", RED)];
    let file_and_script = [("f", RED), ("1.txt", WITH_F), ("f", BLUE), ("1.txt", A)];
    vec![
        world("a file before its script", 0, CALM, &file),
        world("a file before its script, a kill", 0, kill, &file),
        world("a file before its script, an event twice", 0, twice, &file),
        world("a file after its script", 0, CALM, &file_late),
        world("a file after its script, a kill", 0, kill, &file_late),
        world("a file after its script, a lost answer", 0, loss, &file_late),
        world("a file after its script, an event lost", 0, lost, &file_late),
        world("a file, changed", 1, CALM, &file_changed),
        world("a file, changed when all is done, a kill", 2, kill, &file_changed),
        world("a file, changed when all is done, a late write", 2, late, &file_changed),
        world("a file, changed and changed back when all is done", 2, CALM, &file_to_and_fro),
        world("a file, changed and changed back when all is done, a kill", 2, kill, &file_to_and_fro),
        world("a file, deleted when all is done", 2, CALM, &file_gone),
        world("a file, deleted and uploaded again when all is done", 2, CALM, &file_back),
        world("a file that refers to another one", 0, CALM, &referred),
        world("two scripts that name a file", 2, CALM, &two_with_file),
        world("two scripts that name a file, at once", 0, CALM, &two_with_file),
        world("a file and then its script, changed", 2, CALM, &file_and_script),
        world("two outputs, one frame", 1, CALM, &both),
        world("two outputs, one frame, a kill", 1, kill, &both),
        world("two outputs, one frame, overwritten when done, a late write", 2, late, &both),
        world("another output when done, and no longer", 1, CALM, &both_late),
        world("another output when done, and no longer, a kill", 1, kill, &both_late),
        world("an output that gives way to another", 2, kill, &one_for_another),
        world("one frame, a kill", 0, kill, &one),
        world("one frame, a kill and a late write", 0, late, &one),
        world("one frame, a lost answer", 0, loss, &one),
        world("one frame, an event twice", 0, twice, &one),
        world("one frame, an event lost", 0, lost, &one),
        world("one frame, overwritten", 0, CALM, &overwrite),
        world("one frame, overwritten when done, a kill", 1, kill, &overwrite),
        world("one frame, overwritten when done, a late write", 1, late, &overwrite),
        world("one frame, changed and changed back", 0, CALM, &revert),
        world("one frame, changed and changed back when done", 1, CALM, &revert),
        world("one frame, changed and changed back when done, a kill", 1, kill, &revert),
        world("one frame, deleted", 0, CALM, &emptied),
        world("one frame, deleted when done, a lost answer", 1, loss, &emptied),
        world("a fault that is mended", 0, CALM, &fault),
        world("one script of two frames", 0, CALM, &split),
        world("two frames", 0, CALM, &two),
        world("two frames, a kill", 0, kill, &two),
        world("two frames, a lost answer", 0, loss, &two),
        world("two frames, announced", 1, CALM, &announced),
        world("two frames, one deleted when done", 2, CALM, &delete),
        world("two frames, one deleted when done, a kill", 2, kill, &delete),
        world("two frames, one changed and changed back when done", 2, CALM, &flicker),
        world("one frame, overwritten twice when done, a late write", 1, late, &thrice),
        world("one frame, changed thrice when done", 1, CALM, &again),
        world("one frame, changed, changed back and changed again when done", 1, CALM, &to_and_fro),
        claimed_again(world(
            "one frame, changed and changed back while an assembler looks",
            1,
            CALM,
            &revert,
        )),
        world("one of two frames, changed and changed back", 2, CALM, &waiting),
        world("the second of two frames comes, goes and comes back", 2, CALM, &returning),
        world("one frame, broken and mended when done", 1, CALM, &mended),
        world("one frame, deleted and uploaded again when done", 1, CALM, &refilled),
        world("three frames, the last one new", 2, kill, &three),
        world("three frames", 1, CALM, &three),
        world("three frames at once", 0, CALM, &three),
        world("three frames at once, a kill", 0, kill, &three),
        world("two frames, announced last", 0, CALM, &announced_last),
        world("two frames, announced last, a kill", 0, kill, &announced_last),
        world("two frames, announced last, a lost answer", 0, loss, &announced_last),
        world("two frames, one changed and changed back", 0, CALM, &returning_early),
        world("three frames, one deleted before it is drawn", 0, CALM, &deleted_early),
        world("a frame in bands", 0, CALM, &big),
        world("a frame in bands, a kill", 0, kill, &big),
        world("a frame in bands, a kill and a late write", 0, late, &big),
        world("a frame in bands, a lost answer", 0, loss, &big),
        world("a frame in bands, an event twice", 0, twice, &big),
        world("a frame in bands, an event lost", 0, lost, &big),
        world("a frame in bands, overwritten", 0, CALM, &big_overwrite),
        world("a frame in bands, changed and changed back", 0, CALM, &big_revert),
        cut(world("two frames in two pieces, a kill", 1, kill, &two)),
        cut(world("two frames in two pieces, a kill and a late write", 1, late, &two)),
        cut(world("two frames in two pieces, a lost answer", 1, loss, &two)),
        cut(world("two frames in two pieces, an event twice", 1, twice, &two)),
        cut(world("two frames in two pieces, the first overwritten", 1, CALM, &joined)),
        cut(world("two frames in two pieces, one deleted", 1, CALM, &delete)),
        cut(world("two frames in two pieces, one changed and changed back when done", 2, CALM, &flicker)),
        cut(world("three frames in pieces", 2, CALM, &three)),
    ]
}

/// Returns the worlds in which few schedules find many errors, which suit [`super::provoke`] best.
pub fn provoking() -> Vec<World> {
    const NAMES: [&str; 14] = [
        "a file after its script",
        "a file, changed and changed back when all is done",
        "one frame, a kill",
        "one frame, an event twice",
        "one frame, deleted when done, a lost answer",
        "one frame, changed and changed back when done, a kill",
        "one frame, overwritten twice when done, a late write",
        "one frame, changed thrice when done",
        "one frame, changed, changed back and changed again when done",
        "one frame, changed and changed back while an assembler looks",
        "one of two frames, changed and changed back",
        "the second of two frames comes, goes and comes back",
        "a frame in bands",
        "two frames in two pieces, the first overwritten",
    ];
    worlds().into_iter().filter(|world| NAMES.contains(&world.name)).collect()
}
