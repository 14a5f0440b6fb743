//! Tests of frames that are too big for one invocation, and of their bands, when another client acts in between and
//! when events are lost.

use super::*;
use crate::manifest::Frame;

/// A name that looks like a receipt's.
const NAME: &str = "1@0-p1";

const STUCK: Duration = Duration::from_secs(16 * 60);

impl World {
    /// Uploads a script, and delivers its event, but not the events that follow. Returns its version.
    async fn upload_big(&self, text: &str) -> ETag {
        let key = format!("scripts/film/{NAME}.txt");
        let version = self.put(&key, text);
        assert_eq!(self.render(&key).await, Outcome::Cut(BANDS));
        version
    }

    fn frame_key(version: &ETag) -> String {
        format!("frames/film/{NAME}@{version}-p1.png")
    }

    fn frame(&self, version: &ETag) -> Option<String> {
        let object = self.store.bucket.lock().unwrap().get(&Self::frame_key(version)).ok()?;
        Some(String::from_utf8_lossy(&object.body).into_owned())
    }

    fn delete(&self, key: &str) {
        assert!(self.store.bucket.lock().unwrap().delete(key), "{key}");
    }

    /// Delivers the events of these bands, given the keys that trigger them.
    async fn draw_bands(&self, keys: &[String]) -> Vec<Outcome> {
        let mut outcomes = Vec::new();
        for key in keys {
            outcomes.push(self.render(key).await);
        }
        outcomes
    }
}

fn woken(version: &ETag, band: &str, attempt: u64) -> String {
    format!("parts/film/{NAME}@{version}-p1/{band}.band-{attempt}.json")
}

fn banded(version: &ETag, band: &str) -> String {
    format!("frames/film/{NAME}@{version}-p1.{band}.band")
}

fn name() -> ScriptName {
    ScriptName::new(NAME).unwrap()
}

#[tokio::test]
async fn a_big_frame_is_drawn_in_bands_and_put_together_by_the_last() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    assert_eq!(world.manifest().head.status, Status::Rendering, "it is shown as being drawn");
    let keys = world.keys("parts/");
    assert_eq!(keys, ["1-of-3", "2-of-3", "3-of-3"].map(|band| woken(&version, band, 0)));
    // In any order.
    let outcomes = world.draw_bands(&[keys[2].clone(), keys[0].clone()]).await;
    assert!(outcomes.iter().all(|outcome| matches!(outcome, Outcome::Band(_))), "{outcomes:?}");
    assert_eq!(world.frame(&version), None);
    assert_eq!(world.render(&keys[1]).await, Outcome::Drawn);
    assert_eq!(world.frame(&version).unwrap(), picture(&name(), b"big frame 1", None));
    assert_eq!(world.manifest().head.status, Status::Done);
    assert_eq!(world.keys("assemblies/").len(), 1);
    // All of it comes again: nothing is drawn.
    let again: Vec<String> = keys.into_iter().chain([format!("scripts/film/{NAME}.txt")]).collect();
    for outcome in world.draw_bands(&again).await {
        assert_eq!(outcome, Outcome::Present);
    }
    assert_eq!(world.keys("assemblies/").len(), 1);
}

#[tokio::test]
async fn each_frame_of_a_script_may_be_big() {
    let world = World::new();
    let version = world.put("scripts/film/1.txt", "big split 2 1");
    assert!(matches!(world.render("scripts/film/1.txt").await, Outcome::Split(_)));
    for number in [1, 2] {
        let part = format!("parts/film/1@{version}-p1/{number}.json");
        assert_eq!(world.render(&part).await, Outcome::Cut(BANDS));
    }
    for key in world.keys("parts/").into_iter().filter(|key| key.contains(".band-")) {
        world.render(&key).await;
    }
    let manifest = world.manifest();
    assert_eq!((manifest.head.status, manifest.head.done), (Status::Done, 2));
    for number in [1, 2] {
        let key = format!("frames/film/1@{version}-p1/{number}.png");
        let frame = world.store.bucket.lock().unwrap().get(&key).unwrap().body;
        let expected = picture(&ScriptName::new("1").unwrap(), b"big split 2 1", NonZeroU64::new(number));
        assert_eq!(frame, expected);
    }
    // Those of parts are swept, too.
    world.visit().await;
    assert_eq!(world.keys("frames/").len(), 3, "{:?}", world.keys("frames/"));
}

/// The last invocation is killed when it has put its band. The platform's next attempt at its event finds all bands.
#[tokio::test]
async fn bands_that_are_not_put_together_are_by_the_next_invocation() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    let keys = world.keys("parts/");
    world.draw_bands(&keys).await;
    for next in [&keys[0], &format!("scripts/film/{NAME}.txt")] {
        world.delete(&World::frame_key(&version));
        assert_eq!(world.render(next).await, Outcome::Drawn, "{next}");
        assert!(world.frame(&version).is_some());
    }
}

/// Otherwise a frame whose joining kills the process would be triggered for ever.
#[tokio::test]
async fn putting_together_counts_as_an_attempt() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.draw_bands(&world.keys("parts/")).await;
    world.delete(&World::frame_key(&version));
    assert_eq!(world.render(&format!("retries/film/{NAME}@{version}-p1/1")).await, Outcome::Drawn);
    assert!(world.keys("frames/").contains(&format!("frames/film/{NAME}@{version}-p1.begun-1")));
}

#[tokio::test]
async fn bands_of_different_versions_never_meet() {
    let world = World::new();
    let first = world.upload_big("big frame 1").await;
    let keys = world.keys("parts/");
    assert!(matches!(world.render(&keys[0]).await, Outcome::Band(_)));
    let second = world.upload_big("big frame 2").await;
    // Events of the first version come while the second one is current.
    assert_eq!(world.render(&keys[1]).await, Outcome::Superseded);
    assert_eq!(world.render(&keys[2]).await, Outcome::Superseded);
    for band in ["2-of-3", "3-of-3"] {
        assert!(matches!(world.render(&woken(&second, band, 0)).await, Outcome::Band(_)));
    }
    assert_eq!((world.frame(&first), world.frame(&second)), (None, None));
    // It is changed back: those that drew nothing are woken once more.
    world.later(Duration::from_secs(5)).await;
    world.put(&format!("scripts/film/{NAME}.txt"), "big frame 1");
    let before: Vec<_> = keys.iter().map(|key| world.modified(key)).collect();
    world.later(Duration::from_secs(5)).await;
    assert_eq!(world.render(&format!("scripts/film/{NAME}.txt")).await, Outcome::Cut(BANDS));
    let is_new = |k: usize| world.modified(&keys[k]) > before[k];
    assert_eq!((is_new(0), is_new(1), is_new(2)), (false, true, true));
    world.draw_bands(&keys[1..]).await;
    assert_eq!(world.frame(&first).unwrap(), picture(&name(), b"big frame 1", None));
    assert_eq!(world.frame(&second), None);
}

/// The invocation that cut the frame may have died before the store had sent the events of its writes.
#[tokio::test]
async fn an_event_of_a_frame_that_is_cut_wakes_all_that_is_missing() {
    let world = World::new();
    world.upload_big("big frame 1").await;
    let keys = world.keys("parts/");
    world.render(&keys[1]).await;
    let before: Vec<_> = keys.iter().map(|key| world.modified(key)).collect();
    world.later(Duration::from_secs(5)).await;
    assert_eq!(world.render(&format!("scripts/film/{NAME}.txt")).await, Outcome::Cut(BANDS));
    let is_new = |k: usize| world.modified(&keys[k]) > before[k];
    assert_eq!((is_new(0), is_new(1), is_new(2)), (true, false, true));
}

#[tokio::test]
async fn a_band_is_put_once() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    let keys = world.keys("parts/");
    world.render(&keys[0]).await;
    let before = world.modified(&banded(&version, "1-of-3"));
    let manifest = world.manifest().head.revision;
    world.later(Duration::from_secs(5)).await;
    assert!(matches!(world.render(&keys[0]).await, Outcome::Band(_)));
    assert_eq!(world.modified(&banded(&version, "1-of-3")), before);
    assert_eq!(world.manifest().head.revision, manifest);
}

/// An attempt counts when one of its bands has begun, not while they only wait in the queue.
#[tokio::test]
async fn the_sweep_wakes_what_is_missing_and_gives_up_only_what_was_tried() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.render(&woken(&version, "1-of-3", 0)).await;
    let begun = |world: &World| {
        world.keys("frames/").into_iter().filter(|key| key.contains(".begun-")).collect::<Vec<_>>()
    };
    let mut wait = STUCK;
    for attempt in 1..=5 {
        world.later(wait).await;
        wait *= 2;
        assert_eq!(world.visit().await.woken, 1, "attempt {attempt}");
        let retry = format!("retries/film/{NAME}@{version}-p1/{attempt}");
        assert_eq!(world.render(&retry).await, Outcome::Cut(BANDS));
        let woken: Vec<_> = world
            .keys("parts/")
            .into_iter()
            .filter(|key| key.ends_with(&format!(".band-{attempt}.json")))
            .collect();
        assert_eq!(woken, ["2-of-3", "3-of-3"].map(|band| self::woken(&version, band, attempt)));
        assert_eq!(begun(&world), Vec::<String>::new(), "they wait in the queue");
    }
    // Now they begin, one after the other, and are killed in it: the renderer of this test would not be.
    for attempt in 1..=3 {
        world.put(&format!("frames/film/{NAME}@{version}-p1.begun-{attempt}"), "");
    }
    world.later(wait).await;
    let visit = world.visit().await;
    assert_eq!((visit.woken, visit.given_up), (0, 1));
    // A late band still makes the frame.
    world.render(&woken(&version, "2-of-3", 4)).await;
    world.draw_bands(&[woken(&version, "3-of-3", 4)]).await;
    let FrameState::Failed(_) = world.manifest().frames[0].state else { panic!("{:?}", world.manifest()) };
}

#[tokio::test]
async fn a_band_that_a_retry_woke_says_that_it_has_begun() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.render(&woken(&version, "2-of-3", 7)).await;
    assert!(world.keys("frames/").contains(&format!("frames/film/{NAME}@{version}-p1.begun-7")));
    world.render(&woken(&version, "3-of-3", 0)).await;
    assert_eq!(world.keys("frames/").into_iter().filter(|key| key.contains(".begun-")).count(), 1);
}

#[tokio::test]
async fn a_band_that_cannot_be_read_is_drawn_anew() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.render(&woken(&version, "1-of-3", 0)).await;
    world.render(&woken(&version, "2-of-3", 0)).await;
    let band = banded(&version, "1-of-3");
    let before = world.store.bucket.lock().unwrap().get(&band).unwrap().body;
    world.put(&band, "garbled");
    assert_eq!(world.render(&woken(&version, "3-of-3", 0)).await, Outcome::Drawn);
    assert_eq!(world.frame(&version).unwrap(), picture(&name(), b"big frame 1", None));
    assert_eq!(world.store.bucket.lock().unwrap().get(&band).unwrap().body, before);
}

/// A band is deleted between the listing and its reading.
#[tokio::test]
async fn no_frame_is_put_together_without_a_band_that_is_gone() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.draw_bands(&[woken(&version, "1-of-3", 0), woken(&version, "2-of-3", 0)]).await;
    let gone = banded(&version, "1-of-3");
    world.meddle(move |request, bucket, _| {
        if request == format!("get {gone}") {
            bucket.delete(&gone);
        }
    });
    let key = woken(&version, "3-of-3", 0);
    let rendering = world
        .with(async |invocation| render_frame(invocation, &InstantRenderer { bands: BANDS }, &key).await)
        .await;
    assert!(rendering.unwrap_err().is_retryable());
    assert_eq!(world.frame(&version), None);
}

#[tokio::test]
async fn a_failure_record_names_the_band_and_blames_nobody_who_only_woke_others() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    let script = format!("scripts/film/{NAME}.txt");
    let recorded = world.record(&script, Some(version.clone()), End::Died).await;
    assert!(matches!(recorded, Recorded::Woken { .. }), "{recorded:?}");
    let recorded = world.record(&woken(&version, "2-of-3", 0), None, End::Error("busy".into())).await;
    assert!(matches!(recorded, Recorded::Woken { .. }), "{recorded:?}");
    let recorded = world.record(&woken(&version, "2-of-3", 0), None, End::TimedOut).await;
    assert!(matches!(recorded, Recorded::GivenUp(_)), "{recorded:?}");
    let FrameState::Failed(fault) = &world.manifest().frames[0].state else { panic!() };
    let message = &fault.reason.as_ref().unwrap().message;
    assert_eq!(message, "band 2 of 3: timed out in each of 3 attempts");
    // It says nothing of another version.
    world.put(&script, "big frame 2");
    let recorded = world.record(&woken(&version, "2-of-3", 0), None, End::TimedOut).await;
    assert!(matches!(recorded, Recorded::Resolved(_)), "{recorded:?}");
}

/// Each of the old bands would trigger all the others.
#[tokio::test]
async fn bands_that_are_too_old_wake_the_frame_no_more_often_than_a_few_times() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    for (attempt, band) in ["1-of-3", "2-of-3", "3-of-3"].into_iter().enumerate() {
        let recorded = world.record(&woken(&version, band, 0), None, End::TooOld).await;
        assert_eq!(recorded, Recorded::Woken { attempt: attempt as u64 + 1 });
    }
    let recorded = world.record(&woken(&version, "1-of-3", 1), None, End::TooOld).await;
    assert_eq!(recorded, Recorded::LeftToSweep);
}

#[tokio::test]
async fn bands_are_swept_once_their_frame_is_there_and_not_before() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.render(&woken(&version, "1-of-3", 0)).await;
    assert_eq!(world.visit().await.deleted, 0);
    let there = |world: &World| (world.keys("frames/").len(), world.keys("parts/").len());
    assert_eq!(there(&world), (2, 3));
    world.draw_bands(&[woken(&version, "2-of-3", 0), woken(&version, "3-of-3", 0)]).await;
    // The cut, its bands, and the objects that woke them.
    assert_eq!(world.visit().await.deleted, 7);
    assert_eq!((world.keys("frames/"), world.keys("parts/")), (vec![World::frame_key(&version)], vec![]));
    // Those of a version that is no longer current stay for as long as its frame would.
    let version = world.upload_big("big frame 2").await;
    world.render(&woken(&version, "1-of-3", 0)).await;
    world.upload_big("big frame 3").await;
    world.later(Duration::from_secs(3600)).await;
    world.visit().await;
    assert!(world.keys("frames/").contains(&banded(&version, "1-of-3")));
    world.later(Duration::from_secs(8 * 24 * 3600)).await;
    world.visit().await;
    let left: Vec<_> = ["frames/", "parts/"].iter().flat_map(|prefix| world.keys(prefix)).collect();
    assert!(!left.iter().any(|key| key.contains(version.as_str())), "{left:?}");
}

#[tokio::test]
async fn a_retry_of_what_failed_begins_anew_and_of_what_is_on_its_way_goes_on() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.render(&woken(&version, "1-of-3", 0)).await;
    let again = async |world: &World, scope: Scope<'_>| {
        world.with(async |invocation| retry(invocation, &World::film(), scope).await.unwrap()).await
    };
    again(&world, Scope::Failed).await;
    assert!(world.keys("frames/").contains(&banded(&version, "1-of-3")), "it is on its way");
    world.record(&woken(&version, "2-of-3", 0), None, End::TimedOut).await;
    again(&world, Scope::Failed).await;
    assert_eq!(world.keys("frames/"), Vec::<String>::new());
    assert_eq!(world.render(&format!("retries/film/{NAME}@{version}-p1/1")).await, Outcome::Cut(BANDS));
    world.draw_bands(&world.keys("parts/")).await;
    assert!(world.frame(&version).is_some());
    // A frame that is there is drawn, not put together again.
    again(&world, Scope::All).await;
    assert_eq!(world.keys("frames/"), Vec::<String>::new());
}

/// An invocation that a renderer of another pixel version triggered cuts again, so no frame is joined from bands of
/// both.
#[tokio::test]
async fn bands_of_different_renderers_never_meet() {
    let mut world = World::new();
    let version = world.upload_big("big frame 1").await;
    let old = world.keys("parts/");
    world.render(&old[0]).await;
    world.policy = Policy::new(2);
    assert_eq!(world.render(&old[1]).await, Outcome::Cut(BANDS));
    assert_eq!(world.render(&old[2]).await, Outcome::Cut(BANDS));
    let new: Vec<_> = world.keys("parts/").into_iter().filter(|key| key.contains("-p2/")).collect();
    assert_eq!(new.len(), 3);
    world.draw_bands(&new[..2]).await;
    assert!(!world.keys("frames/").iter().any(|key| key.ends_with(".png")));
    assert_eq!(world.render(&new[2]).await, Outcome::Drawn);
    let frame = format!("frames/film/{NAME}@{version}-p2.png");
    assert!(world.keys("frames/").contains(&frame));
    // Those of the older renderer go with the others.
    world.visit().await;
    assert_eq!(world.keys("frames/"), [frame]);
}

/// Two invocations found at once that the frame is too big, and chose different numbers of bands.
#[tokio::test]
async fn of_two_cuts_each_is_whole_by_itself() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.put(&format!("frames/film/{NAME}@{version}-p1.cut-2"), "");
    for key in [woken(&version, "1-of-2", 0), woken(&version, "2-of-3", 0), woken(&version, "3-of-3", 0)] {
        assert!(matches!(world.render(&key).await, Outcome::Band(_)), "{key}");
    }
    assert_eq!(world.render(&woken(&version, "2-of-2", 0)).await, Outcome::Drawn);
    assert_eq!(world.frame(&version).unwrap(), picture(&name(), b"big frame 1", None));
    assert_eq!(world.render(&woken(&version, "1-of-3", 0)).await, Outcome::Present);
    let Frame { state: FrameState::Done { .. }, .. } = world.manifest().frames[0] else { panic!() };
}

/// The tenth is not the second.
#[tokio::test]
async fn many_bands_are_put_together_from_the_top() {
    let world = World::new();
    let key = format!("scripts/film/{NAME}.txt");
    let version = world.put(&key, "big frame 1");
    let drawer = InstantRenderer { bands: NonZeroU64::new(12).unwrap() };
    let render = async |key: &str| {
        world.with(async |invocation| render_frame(invocation, &drawer, key).await.unwrap().outcome).await
    };
    render(&key).await;
    let bands = world.keys("parts/");
    assert_eq!(bands.len(), 12);
    for band in &bands {
        render(band).await;
    }
    assert_eq!(world.frame(&version).unwrap(), picture(&name(), b"big frame 1", None));
}

/// Each invocation had listed before the other one put its band.
#[tokio::test]
async fn of_those_who_put_the_last_bands_at_once_one_finds_all() {
    let world = World::new();
    let version = world.upload_big("big frame 1").await;
    world.draw_bands(&[woken(&version, "1-of-3", 0)]).await;
    let other = banded(&version, "3-of-3");
    let image = format!("3-of-3 of {}", picture(&name(), b"big frame 1", None));
    let own = format!("put {}", banded(&version, "2-of-3"));
    world.meddle(move |request, bucket, now| {
        if request == own {
            bucket.put(now, &other, image.clone().into(), PutOptions::always()).unwrap();
        }
    });
    assert_eq!(world.render(&woken(&version, "2-of-3", 0)).await, Outcome::Drawn);
    assert_eq!(world.frame(&version).unwrap(), picture(&name(), b"big frame 1", None));
}
