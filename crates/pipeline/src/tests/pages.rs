//! Listings of more than a page: objects on the second page count, too.

use super::*;
use crate::store::PAGE;
use crate::sweep::sweep;

const SCRIPT: &str = "scripts/film/1.txt";

/// A page, and some more.
const MANY: usize = PAGE + 100;

/// The number of the part whose name is the last one in the listing.
const LAST: u64 = 999;

impl World {
    /// Makes a split script of many frames, and returns its version.
    fn split_in_many(&self) -> ETag {
        let version = self.put(SCRIPT, &format!("split {MANY} 1"));
        self.put(&format!("frames/film/1@{version}-p1.split-{MANY}"), "");
        version
    }

    /// Draws all frames of the script but these.
    fn drawn_but(&self, version: &ETag, missing: &[usize]) {
        for number in (1..=MANY).filter(|number| !missing.contains(number)) {
            self.put(&format!("frames/film/1@{version}-p1/{number}.png"), "frame");
        }
    }
}

#[tokio::test]
async fn a_sweep_visits_the_animations_behind_one_of_many_scripts() {
    let world = World::new();
    for number in 0..MANY {
        world.put(&format!("scripts/a/{number}.txt"), "hang 1");
    }
    world.put("scripts/b/1.txt", "hang 1");
    let swept = world.with(async |invocation| sweep(invocation).await.unwrap()).await;
    let mut visited: Vec<_> = swept.visits.iter().map(|(animation, _)| animation.as_str()).collect();
    visited.sort_unstable();
    assert_eq!(visited, ["a", "b"]);
}

#[tokio::test]
async fn attempts_are_counted_behind_many_others() {
    let world = World::new();
    let version = world.split_in_many();
    world.drawn_but(&version, &[LAST as usize]);
    for attempt in 1..=3 {
        world.put(&format!("frames/film/1@{version}-p1/{LAST}.begun-{attempt}"), "");
    }
    let part = format!("parts/film/1@{version}-p1/{LAST}.json");
    let recorded = world.record(&part, None, End::Error("busy".into())).await;
    assert!(matches!(recorded, Recorded::GivenUp(_)), "{recorded:?}");
}

#[tokio::test]
async fn retries_are_counted_behind_many_others() {
    let world = World::new();
    let version = world.put(SCRIPT, "hang 1");
    for attempt in 1..=MANY {
        world.put(&format!("retries/film/0@{version}-p1/{attempt}"), "");
    }
    world.put(&format!("retries/film/1@{version}-p1/7"), "");
    let recorded = world.record(SCRIPT, Some(version), End::TooOld).await;
    assert_eq!(recorded, Recorded::Woken { attempt: 8 });
}

/// The script was uploaded once more, so only parts without a result are triggered.
#[tokio::test]
async fn parts_that_are_there_are_seen_behind_many_others() {
    let world = World::new();
    let version = world.split_in_many();
    world.drawn_but(&version, &[7]);
    let part = |number: u64| format!("parts/film/1@{version}-p1/{number}.json");
    world.put(&part(7), "{}");
    world.put(&part(LAST), "{}");
    world.later(Duration::from_secs(9)).await;
    world.put(SCRIPT, &format!("split {MANY} 1"));
    world.later(Duration::from_secs(9)).await;
    let before = [7, LAST].map(|number| world.modified(&part(number)));
    world.render(SCRIPT).await;
    let is_new = [7, LAST].map(|number| world.modified(&part(number)));
    assert_eq!((is_new[0] > before[0], is_new[1] > before[1]), (true, false));
}

#[tokio::test]
async fn a_frame_is_seen_behind_many_bands() {
    let world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    for band in 1..=MANY {
        world.put(&format!("frames/film/1@{version}-p1.{band}-of-{MANY}.band"), "band");
    }
    world.put(&format!("frames/film/1@{version}-p1.png"), "frame");
    assert_eq!(world.render(SCRIPT).await, Outcome::Present);
}

#[tokio::test]
async fn all_that_came_of_an_older_version_goes_however_much_it_is() {
    let world = World::new();
    let before = world.split_in_many();
    world.drawn_but(&before, &[]);
    for number in 1..=MANY {
        world.put(&format!("parts/film/1@{before}-p1/{number}.json"), "{}");
    }
    world.upload("1.txt", "frame 1").await;
    world.later(Duration::from_secs(8 * 24 * 3600)).await;
    // The frames, the objects that woke them, and the split.
    assert_eq!(world.visit().await.deleted, 2 * MANY as u64 + 1);
    assert!(world.keys("parts/").is_empty() && world.keys("frames/").len() == 1);
}
