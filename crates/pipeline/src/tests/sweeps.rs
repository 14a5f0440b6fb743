//! Tests of the sweep: the frames that it triggers and gives up, its claims, repairs and deletions, and the objects
//! that it leaves alone.

use super::*;
use crate::sweep::{Swept, sweep};

const MINUTE: Duration = Duration::from_secs(60);
const DAY: Duration = Duration::from_secs(24 * 3600);
const SCRIPT: &str = "scripts/film/1.txt";

/// The shortest time that a clock shows.
const MOMENT: Duration = Duration::from_millis(1);

impl World {
    async fn sweep(&self) -> Swept {
        self.with(async |invocation| sweep(invocation).await.unwrap()).await
    }

    /// Waits until an object has this age.
    async fn until(&self, key: &str, age: Duration) {
        let then = self.modified(key).after(age);
        self.later(then.since(self.store.clock.now())).await;
        assert_eq!(self.store.clock.now(), then);
    }

    /// Returns the remaining keys below these prefixes.
    fn left(&self, prefixes: &[&str]) -> Vec<String> {
        prefixes.iter().flat_map(|prefix| self.keys(prefix)).collect()
    }
}

fn woken(count: u64) -> Visit {
    Visit { woken: count, ..Visit::default() }
}

#[tokio::test]
async fn a_sweep_visits_whatever_is_uploaded_or_has_a_manifest() {
    let mut world = World::new();
    for key in [
        "scripts/a/1.txt",
        "scripts/b/animation.json",
        "scripts/c/3.TXT",
        "manifests/d.json",
        "scripts/1.txt",
        "scripts/notes.md",
        // Leftovers of systems make no animation.
        "scripts/e/",
        "scripts/f/.old.txt",
        "scripts/g/.ipynb_checkpoints/1.txt",
        "scripts/__MACOSX/a/._1.txt",
    ] {
        world.put(key, if key.ends_with('/') { "" } else { "{}" });
    }
    for left in [None, Some(60 * MINUTE)] {
        world.deadline = left.map(|left| world.store.clock.now().after(left));
        let swept = world.sweep().await;
        let mut visited: Vec<_> = swept.visits.iter().map(|(animation, _)| animation.to_string()).collect();
        visited.sort();
        assert_eq!((visited, swept.unvisited), (["a", "b", "c", "d"].map(str::to_owned).into(), 0));
        assert!(swept.visits.iter().all(|(_, visit)| visit.is_ok()));
        let rejected: Vec<_> = swept.rejected.iter().map(|(key, _)| key.as_str()).collect();
        assert_eq!(rejected, ["scripts/1.txt"]);
    }
    world.deadline = Some(world.store.clock.now().after(world.policy.margin));
    let late = world.sweep().await;
    assert_eq!((late.visits.len(), late.unvisited), (0, 4));
}

#[tokio::test]
async fn a_claim_is_put_where_manifest_or_gif_are_not_as_they_should_be() {
    let claimed = async |world: &World| world.visit().await.claimed;
    let world = World::new();
    assert!(!claimed(&world).await, "there is nothing at all");
    world.put_gif("any");
    assert!(claimed(&world).await, "a GIF of nothing");
    let world = World::new();
    world.put(SCRIPT, "frame 1");
    assert!(claimed(&world).await, "no manifest");
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    assert!(claimed(&world).await, "no GIF");
    world.put_gif("another");
    assert!(claimed(&world).await, "another set's GIF");
    let (generation, claim) = (world.manifest().head.generation, world.keys("assemblies/").remove(0));
    world.put_gif(generation.as_str());
    assert!(claimed(&world).await, "a GIF of this set that nobody has named");
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 0);
    assert_eq!(world.visit().await, Visit::default(), "all is right");
    world.put("scripts/film/2.txt", "frame 2");
    assert!(claimed(&world).await, "a script that the manifest does not show");
    world.store.bucket.lock().unwrap().delete("animations/film.gif");
    for key in world.keys("scripts/") {
        world.store.bucket.lock().unwrap().delete(&key);
    }
    assert!(claimed(&world).await, "the manifest shows scripts that are gone");
}

/// Makes two frames that no invocation draws, and a manifest that shows them as pending. Returns their versions.
async fn stuck(world: &World) -> [ETag; 2] {
    let versions = [1, 2].map(|number| world.put(&format!("scripts/film/{number}.txt"), "hang 1"));
    world.with(async |invocation| crate::fold::fold(invocation, &World::film()).await.unwrap()).await;
    versions
}

#[tokio::test]
async fn frames_are_woken_when_nothing_has_happened_for_a_while_and_then_less_and_less_often() {
    let world = World::new();
    let [version, _] = stuck(&world).await;
    world.until(SCRIPT, 15 * MINUTE - MOMENT).await;
    assert_eq!(world.visit().await, Visit::default());
    world.later(MOMENT).await;
    assert_eq!(world.visit().await, woken(2));
    for (attempt, minutes) in (2..).zip([15, 30, 60, 120, 240, 480, 960, 960, 960]) {
        world.later(minutes * MINUTE - MOMENT).await;
        assert_eq!(world.visit().await, Visit::default(), "attempt {attempt}");
        world.later(MOMENT).await;
        assert_eq!(world.visit().await, woken(2), "attempt {attempt}");
        assert!(world.keys("retries/").contains(&format!("retries/film/1@{version}-p1/{attempt}")));
    }
    // Something happens, if only to another frame.
    world.upload("3.txt", "frame 3").await;
    world.later(15 * MINUTE - MOMENT).await;
    assert_eq!(world.visit().await.woken, 0);
}

#[tokio::test]
async fn frames_that_were_begun_in_vain_are_given_up_and_the_claim_says_so() {
    let world = World::new();
    let versions = stuck(&world).await;
    let begin = |attempt: u64| {
        for (number, version) in (1..).zip(&versions) {
            world.put(&format!("frames/film/{number}@{version}-p1.begun-{attempt}"), "");
        }
    };
    begin(1);
    begin(2);
    world.later(15 * MINUTE).await;
    assert_eq!(world.visit().await, woken(2));
    begin(3);
    world.later(30 * MINUTE).await;
    assert_eq!(world.visit().await, Visit { given_up: 2, claimed: true, ..Visit::default() });
    let receipts: Vec<_> =
        world.keys("frames/").into_iter().filter(|key| key.ends_with(".error.json")).collect();
    assert_eq!(receipts.len(), 2);
}

#[tokio::test]
async fn where_attempts_do_not_count_those_at_pending_frames_are_forgotten() {
    let mut world = World::new();
    let [version, _] = stuck(&world).await;
    world.policy.is_fresh_start = true;
    let other = "frames/film/1@0-p1.begun-1".to_owned();
    world.put(&other, "");
    for attempt in 1..=3 {
        world.put(&format!("frames/film/1@{version}-p1.begun-{attempt}"), "");
    }
    world.later(15 * MINUTE).await;
    assert_eq!(world.visit().await, woken(2));
    assert_eq!(world.keys("frames/"), [other], "of another version");
}

/// The sweep at the start of the functions failed a frame whose file had not arrived yet.
#[tokio::test]
async fn a_fresh_start_wakes_pending_frames_at_once_and_fails_none_that_waits() {
    let mut world = World::new();
    stuck(&world).await;
    world.upload("3.txt", "with earth frame 3").await;
    world.policy.is_fresh_start = true;
    for _ in 0..6 {
        let visit = world.visit().await;
        assert_eq!((visit.woken, visit.given_up), (2, 0));
    }
    world.policy.is_fresh_start = false;
    assert_eq!(world.visit().await.given_up, 0);
    // It waits no longer than ever.
    world.policy.is_fresh_start = true;
    world.later(15 * MINUTE).await;
    assert_eq!(world.visit().await.given_up, 1);
}

#[tokio::test]
async fn of_an_animation_that_has_too_many_frames_none_is_woken() {
    let mut world = World::new();
    world.policy.most_frames = Some(1);
    stuck(&world).await;
    world.later(15 * MINUTE).await;
    assert_eq!(world.visit().await, Visit::default());
    world.policy.most_frames = Some(2);
    assert_eq!(world.visit().await.woken, 2);
}

#[tokio::test]
async fn error_receipts_that_cannot_be_read_go_and_their_frames_are_woken() {
    let world = World::new();
    world.upload("1.txt", "bad 1").await;
    let versions = [2, 3].map(|number| world.put(&format!("scripts/film/{number}.txt"), "bad 2"));
    let keys: Vec<_> = (2..)
        .zip(&versions)
        .map(|(number, version)| format!("frames/film/{number}@{version}-p1.error.json"))
        .collect();
    for key in &keys {
        world.put(key, &format!("garbage of {key}"));
    }
    let older = "frames/film/2@0-p1.error.json".to_owned();
    world.put(&older, "garbage of another version");
    // The manifest shows the receipts.
    world.with(async |invocation| crate::fold::fold(invocation, &World::film()).await.unwrap()).await;
    assert_eq!(world.manifest().head.status, Status::Failed);
    let before = world.keys("frames/");
    let visit = world.visit().await;
    assert_eq!(visit, Visit { woken: 2, deleted: 2, claimed: true, ..Visit::default() });
    let left: Vec<_> = before.into_iter().filter(|key| !keys.contains(key)).collect();
    assert_eq!(world.keys("frames/"), left);
    assert!(left.contains(&older) && left.len() == 2, "{left:?}");
    assert_eq!(world.keys("retries/").len(), 2);
}

/// Puts a refusal of this set and one of another.
fn refusals(world: &World, body: &str) -> [String; 2] {
    let this = world.manifest().head.generation.as_str().to_owned();
    [this, "0a".repeat(16)].map(|generation| {
        let key = format!("frames/film/@{generation}.error.json");
        world.put(&key, body);
        key
    })
}

#[tokio::test]
async fn a_refusal_that_cannot_be_read_goes() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    let [refusal, other] = refusals(&world, "garbage");
    let visit = world.visit().await;
    assert_eq!(visit, Visit { deleted: 1, claimed: true, ..Visit::default() });
    let left = world.keys("frames/");
    assert!(left.contains(&other) && !left.contains(&refusal), "{left:?}");
}

#[tokio::test]
async fn refusals_of_other_sets_go_after_a_week_and_that_of_this_set_stays() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    let [refusal, other] = refusals(&world, r#"{"message":"why"}"#);
    world.until(&other, 7 * DAY - MOMENT).await;
    assert_eq!(world.visit().await.deleted, 0);
    world.later(MOMENT).await;
    assert_eq!(world.visit().await.deleted, 1);
    let left = world.keys("frames/");
    assert!(left.contains(&refusal) && !left.contains(&other), "{left:?}");
}

#[tokio::test]
async fn frames_of_older_pixels_go_after_a_week_where_there_is_a_newer_one() {
    let mut world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    world.render(SCRIPT).await;
    let key = |pixels: u32| format!("frames/film/1@{version}-p{pixels}.png");
    for pixels in [2, 3] {
        world.later(DAY).await;
        world.put(&key(pixels), "frame");
    }
    world.policy = Policy::new(2);
    for (pixels, left) in [(1, &[key(2), key(3)][..]), (2, &[key(3)])] {
        world.until(&key(pixels), 7 * DAY - MOMENT).await;
        assert_eq!(world.visit().await.deleted, 0);
        world.later(MOMENT).await;
        assert_eq!(world.visit().await.deleted, 1);
        assert_eq!(world.keys("frames/"), left);
    }
    world.later(30 * DAY).await;
    assert_eq!(world.visit().await.deleted, 0);
}

/// The script was two frames, then one; another script is two frames.
#[tokio::test]
async fn what_came_of_older_versions_goes_after_a_week_and_all_else_stays() {
    let world = World::new();
    let before = world.put(SCRIPT, "split 2 1");
    world.render(SCRIPT).await;
    for key in world.keys("parts/") {
        world.render(&key).await;
    }
    world.put(&format!("frames/film/1@{before}-p1/1.begun-1"), "");
    world.put("frames/film/1@0-p1.error.json", r#"{"message":"why"}"#);
    world.put("frames/film/1@0-p1.begun-1", "");
    world.upload("2.txt", "split 2 2").await;
    for key in world.keys("parts/film/2@") {
        world.render(&key).await;
    }
    let now = world.put(SCRIPT, "frame 1");
    world.render(SCRIPT).await;
    // The part is of an animation below this one.
    world.put("parts/film/sub/1@0-p1/1.json", "{}");
    world.later(6 * DAY).await;
    assert_eq!(world.visit().await.deleted, 0);
    // Its event may still be to come.
    let new_part = format!("parts/film/1@{before}-p1/2.json");
    world.put(&new_part, "{}");
    let is_kept =
        |key: &String| key.contains("/2@") || key.contains("film/sub/") || key.contains(now.as_str());
    let check = async |of_version: &ETag, deleted: u64| {
        let there = world.left(&["frames/", "parts/"]);
        let kept: Vec<_> = there
            .into_iter()
            .filter(|key| is_kept(key) || *of_version != before && key.contains(before.as_str()))
            .collect();
        assert_eq!(world.visit().await.deleted, deleted);
        assert_eq!(world.left(&["frames/", "parts/"]), kept);
    };
    // The error, and the receipt of its beginning.
    world.later(2 * DAY).await;
    check(&ETag::new("0"), 2).await;
    // The split, its two frames, the receipt that one has begun, and both parts.
    world.until(&new_part, 7 * DAY).await;
    check(&before, 6).await;
}

/// The frames of a script are drawn after it was split, some of them days after.
#[tokio::test]
async fn what_came_late_of_an_older_version_goes_too() {
    let world = World::new();
    let before = world.put(SCRIPT, "split 2 1");
    world.render(SCRIPT).await;
    for key in world.keys("parts/") {
        world.later(DAY).await;
        world.render(&key).await;
    }
    world.put(SCRIPT, "frame 1");
    world.render(SCRIPT).await;
    let split = format!("frames/film/1@{before}-p1.split-2");
    let last = world.keys(&format!("frames/film/1@{before}-p1/")).pop().unwrap();
    for (key, expected) in [(&split, 0), (&last, 5)] {
        world.until(key, 7 * DAY - MOMENT).await;
        assert_eq!(world.visit().await.deleted, 0, "{key}");
        world.later(MOMENT).await;
        assert_eq!(world.visit().await.deleted, expected, "{key}");
    }
    let left = world.left(&["frames/", "parts/"]);
    assert!(!left.iter().any(|key| key.contains(before.as_str())), "{left:?}");
}

/// The object that records that there are parts is deleted last, because a sweep that does not find it does not search
/// for parts.
#[tokio::test]
async fn what_a_sweep_could_not_delete_the_next_one_does() {
    let world = World::new();
    let before = world.put(SCRIPT, "split 2 1");
    world.render(SCRIPT).await;
    for key in world.keys("parts/") {
        world.render(&key).await;
    }
    world.put(SCRIPT, "frame 1");
    world.render(SCRIPT).await;
    world.later(7 * DAY).await;
    world.refuse(|request| {
        let is_it = request.starts_with("delete ") && request.ends_with("/2.png");
        is_it.then(|| Error::Refused { key: "k".into(), source: "no".into() })
    });
    let visited = world.with(async |invocation| visit(invocation, &World::film()).await).await;
    assert!(matches!(visited, Err(Error::Refused { .. })), "{visited:?}");
    world.refuse(|_| None);
    // Until its time is up another one leaves the results alone.
    assert_eq!(world.visit().await.deleted, 0);
    world.later(17 * MINUTE).await;
    world.visit().await;
    let left = world.left(&["frames/", "parts/"]);
    assert!(!left.iter().any(|key| key.contains(before.as_str())), "{left:?}");
}

/// Two renderers of different pixels have split the script at once.
#[tokio::test]
async fn an_attempt_counts_once_however_often_its_script_was_split() {
    let world = World::new();
    let version = world.put(SCRIPT, "split 2 1");
    for pixels in [1, 2] {
        world.put(&format!("frames/film/1@{version}-p{pixels}.split-2"), "");
    }
    world.with(async |invocation| crate::fold::fold(invocation, &World::film()).await.unwrap()).await;
    for attempt in 1..=2 {
        world.put(&format!("frames/film/1@{version}-p1/1.begun-{attempt}"), "");
    }
    world.later(15 * MINUTE).await;
    assert_eq!(world.visit().await, woken(2));
}

/// Scripts that were uploaded at once are drawn one after the other, so a frame that is not drawn yet is not stuck.
#[tokio::test]
async fn as_long_as_frames_are_drawn_nothing_is_stuck() {
    let world = World::new();
    stuck(&world).await;
    world.put("scripts/film/3.txt", "frame 3");
    world.later(10 * MINUTE).await;
    world.render("scripts/film/3.txt").await;
    let frame = world.keys("frames/film/3@").pop().unwrap();
    world.until(&frame, 15 * MINUTE - MOMENT).await;
    assert_eq!(world.visit().await.woken, 0);
    world.later(MOMENT).await;
    assert_eq!(world.visit().await.woken, 2);
}

/// The invocation that began last may still be running, or wait to be tried again.
#[tokio::test]
async fn a_frame_is_not_given_up_before_the_next_attempt_would_be_due() {
    let world = World::new();
    let version = world.put(SCRIPT, "hang 1");
    world.with(async |invocation| crate::fold::fold(invocation, &World::film()).await.unwrap()).await;
    let retry = |attempt: u64| format!("retries/film/1@{version}-p1/{attempt}");
    for attempt in 1..=3 {
        world.put(&retry(attempt), "");
        world.put(&format!("frames/film/1@{version}-p1.begun-{attempt}"), "");
    }
    world.until(&retry(3), 60 * MINUTE - MOMENT).await;
    assert_eq!(world.visit().await, Visit::default());
    world.later(MOMENT).await;
    assert_eq!(world.visit().await.given_up, 1);
}

#[tokio::test]
async fn retries_of_an_animation_below_do_not_count() {
    let world = World::new();
    let [version, _] = stuck(&world).await;
    world.until(SCRIPT, 15 * MINUTE).await;
    world.put(&format!("retries/film/sub/1@{version}-p1/5"), "");
    assert_eq!(world.visit().await, woken(2));
    assert!(world.keys("retries/").contains(&format!("retries/film/1@{version}-p1/1")));
}

#[tokio::test]
async fn attempts_at_a_part_that_is_drawn_are_not_forgotten() {
    let mut world = World::new();
    let version = world.put(SCRIPT, "split 2 1");
    world.render(SCRIPT).await;
    world.render(&format!("parts/film/1@{version}-p1/1.json")).await;
    let begun = |number: u64| format!("frames/film/1@{version}-p1/{number}.begun-1");
    world.put(&begun(1), "");
    world.put(&begun(2), "");
    world.policy.is_fresh_start = true;
    world.later(15 * MINUTE).await;
    assert_eq!(world.visit().await.woken, 1);
    let left = world.keys("frames/");
    assert!(left.contains(&begun(1)) && !left.contains(&begun(2)), "{left:?}");
}

/// Another renderer's error receipt of the same frame can be read.
#[tokio::test]
async fn of_two_error_receipts_only_that_goes_which_cannot_be_read() {
    let world = World::new();
    let version = world.put(SCRIPT, "bad 1");
    let key = |pixels: u32| format!("frames/film/1@{version}-p{pixels}.error.json");
    world.put(&key(1), r#"{"message":"why"}"#);
    world.put(&key(2), "garbage");
    world.with(async |invocation| crate::fold::fold(invocation, &World::film()).await.unwrap()).await;
    assert_eq!(world.visit().await.deleted, 1);
    assert_eq!(world.keys("frames/"), [key(1)]);
}

/// If an assembler fails at the set in each attempt, it refuses the set that the claim names.
#[tokio::test]
async fn a_claim_of_the_sweeps_names_the_set_that_is_there_now() {
    let world = World::new();
    world.upload("1.txt", "hang 1").await;
    let revision = world.manifest().head.revision;
    world.put("scripts/film/2.txt", "hang 2");
    assert!(world.visit().await.claimed);
    let claims = world.keys("assemblies/");
    world.with(async |invocation| crate::fold::fold(invocation, &World::film()).await.unwrap()).await;
    let generation = world.manifest().head.generation;
    let claim = format!("assemblies/film/{revision}-{}.json", generation.as_str());
    assert!(claims.contains(&claim), "{claims:?}");
}

/// This holds for any result of the script: an error, frames of its own, or a cut.
#[tokio::test]
async fn whatever_goes_of_a_script_that_comes_back_the_script_is_woken() {
    for text in ["bad 1", "split 2 1", "big frame 1"] {
        let world = World::new();
        let before = world.put(SCRIPT, text);
        world.render(SCRIPT).await;
        world.upload("1.txt", "frame 2").await;
        world.later(8 * DAY).await;
        world.meddle(move |request, bucket, now| {
            if request.starts_with("delete ") && bucket.head(SCRIPT).unwrap().etag != before {
                bucket.put(now, SCRIPT, text.into(), PutOptions::always()).unwrap();
            }
        });
        assert_eq!(world.visit().await.woken, 1, "{text}");
    }
}

/// The scripts of these frames were uploaded before the others.
#[tokio::test]
async fn frames_are_woken_while_more_are_to_be_uploaded() {
    let world = World::new();
    world.put("scripts/film/animation.json", r#"{"frames": 3}"#);
    stuck(&world).await;
    assert_eq!(world.manifest().head.status, Status::Waiting);
    world.later(15 * MINUTE).await;
    assert_eq!(world.visit().await, woken(2));
}

/// Another client replaced the GIF by half of it, with its metadata.
#[tokio::test]
async fn a_claim_is_put_where_the_gif_is_not_the_one_that_was_built() {
    let world = World::new();
    let claim = world.announced(1).await;
    world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!(world.visit().await, Visit::default());
    world.put_gif(world.manifest().head.generation.as_str());
    assert!(world.visit().await.claimed);
}

/// The assembler died after it had put the GIF. The manifest recorded that of an older set, and a GIF that was
/// truncated later stayed.
#[tokio::test]
async fn a_gif_that_a_dead_assembler_has_put_is_named_so_that_one_in_its_place_is_noticed() {
    let world = World::new();
    let claim = world.announced(1).await;
    world.assemble(&world.joiner(), &claim).await.unwrap();
    world.upload("1.txt", "another frame").await;
    world.put_gif(world.manifest().head.generation.as_str());
    assert_ne!(world.manifest().head.gif.unwrap().generation, world.manifest().head.generation);
    assert!(world.visit().await.claimed);
    world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!(world.visit().await, Visit::default());
    let cut_off = world.manifest().head.generation;
    world.put_gif(cut_off.as_str());
    world.put("animations/film.gif", "");
    assert!(world.visit().await.claimed);
}

/// Formerly such manifests stayed for ever.
#[tokio::test]
async fn a_manifest_that_was_set_aside_goes_after_a_week() {
    let world = World::new();
    world.put(SCRIPT, "frame 1");
    world.put("manifests/film.json", "garbage");
    world.render(SCRIPT).await;
    let [aside] = world.keys("manifests/film.json~").try_into().unwrap();
    for (age, left) in [(DAY * 7 - MOMENT, 1), (DAY * 7, 0)] {
        world.until(&aside, age).await;
        assert_eq!(world.sweep().await.cleared, 1 - left as u64);
        assert_eq!(world.keys("manifests/film.json~").len(), left);
    }
    assert_eq!(world.manifest().head.total, 1);
}

/// A refusal does not change the set.
#[tokio::test]
async fn a_claim_is_put_where_the_manifest_does_not_show_that_the_set_is_refused() {
    let world = World::new();
    let claim = world.announced(1).await;
    world.assemble(&world.joiner(), &claim).await.unwrap();
    refusals(&world, r#"{"message":"why"}"#);
    assert!(world.visit().await.claimed);
}

impl World {
    /// Runs a sweep that deletes the results of a script, which is `text` again by then, and dies before its next
    /// request.
    async fn dies_deleting(&self, text: &'static str, request_id: &str) {
        let (bucket, clock, mut has_deleted) = (self.store.bucket.clone(), self.store.clock.clone(), false);
        self.refuse(move |request| {
            let deletes = request.starts_with("delete frames/film/1@");
            if deletes && !std::mem::replace(&mut has_deleted, true) {
                let mut bucket = bucket.lock().unwrap();
                bucket.put(clock.now(), SCRIPT, text.into(), PutOptions::always()).unwrap();
            }
            let is_dead = has_deleted && !deletes;
            is_dead.then(|| Error::Refused { key: "k".into(), source: "dead".into() })
        });
        assert!(matches!(self.visit_as(request_id).await, Err(Error::Refused { .. })), "{text}");
        self.refuse(|_| None);
    }

    async fn visit_as(&self, request_id: &str) -> Result<Visit> {
        let (store, policy) = (&self.store, &self.policy);
        let invocation = Invocation::new(store, &store.clock, &self.random, policy, request_id);
        visit(&invocation, &World::film()).await
    }
}

/// The script was too new to count as stuck, and the frame stayed pending until a later sweep.
#[tokio::test]
async fn what_comes_back_while_a_sweep_dies_over_its_results_the_next_attempt_wakes() {
    for text in ["frame 1", "bad 1", "split 2 1", "big frame 1"] {
        let world = World::new();
        world.upload("1.txt", text).await;
        world.upload("1.txt", "frame 2").await;
        world.later(8 * DAY).await;
        world.dies_deleting(text, "sweep").await;
        // Another frame is to come: which ones were deleted is not known.
        world.put("scripts/film/2.txt", "hang 1");
        let other = world.visit_as("other").await.unwrap();
        assert_eq!((other.woken, other.deleted), (0, 0), "{text}: a sweep is at it");
        assert_eq!(world.visit_as("sweep").await.unwrap().woken, 2, "{text}");
        assert!(world.keys("frames/film/@").is_empty(), "{text}: the lease is given back");
        assert_eq!(world.visit_as("sweep").await.unwrap().woken, 0, "{text}");
    }
}
