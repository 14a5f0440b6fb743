//! Tests of when a fold stops, waits, lists, writes and claims, by the requests that it sends.

use super::*;
use crate::fold::{Age, Folded};
use crate::manifest::Fact;

const MANIFEST: &str = "manifests/film.json";
const SCRIPT: &str = "scripts/film/1.txt";

impl World {
    /// Counts requests that start so.
    fn count(&self, request: &'static str) -> Arc<AtomicU64> {
        let counted = Arc::new(AtomicU64::new(0));
        let counter = counted.clone();
        self.refuse(move |asked| {
            counter.fetch_add(u64::from(asked.starts_with(request)), Ordering::Relaxed);
            None
        });
        counted
    }

    async fn fold(&self, fact: &Fact, age: Age) -> Folded {
        self.with(async |invocation| invocation.fold(&World::film(), fact, age).await.unwrap()).await
    }
}

fn name() -> ScriptName {
    ScriptName::new("1").unwrap()
}

/// Writes the next revision as another invocation, with the same content.
pub(super) fn write_next(bucket: &mut Bucket, now: Timestamp) {
    let mut manifest = Manifest::decode(&World::film(), &bucket.get(MANIFEST).unwrap().body).unwrap();
    manifest.head.revision += 1;
    manifest.head.writer = "someone".to_owned();
    bucket.put(now, MANIFEST, manifest.encode(32 * 1024).unwrap(), PutOptions::always()).unwrap();
}

/// If a manifest is larger than the first read, its lines are looked up, except by the invocation that has just put the
/// result.
#[tokio::test]
async fn a_fold_leaves_at_once_when_the_manifest_shows_the_fact() {
    for (glimpse, age, leaves) in [
        (32 * 1024, Age::Old, true),
        (32 * 1024, Age::New, true),
        (1_200, Age::Old, true),
        (1_200, Age::New, false),
    ] {
        let mut world = World::new();
        world.policy.glimpse = glimpse;
        for number in 1..=30 {
            world.put(&format!("scripts/film/{number}.txt"), "hang 1");
        }
        assert_eq!(world.fold(&Fact::Fold, Age::Old).await, Folded::Committed);
        let size = world.store.bucket.lock().unwrap().head(MANIFEST).unwrap().size;
        assert!((1_200..32 * 1024).contains(&size), "{size}");
        let version = world.store.bucket.lock().unwrap().head(SCRIPT).unwrap().etag;
        let listed = world.count("list ");
        let folded = world.fold(&Fact::Version(name(), version), age).await;
        assert_eq!(folded == Folded::Covered, leaves, "{glimpse}, {age:?}");
        assert_eq!(listed.load(Ordering::Relaxed) == 0, leaves, "{glimpse}, {age:?}");
        // A frame that it does not show is listed for.
        let listed = world.count("list ");
        let folded = world.fold(&Fact::Version(name(), ETag::new("other")), age).await;
        assert_eq!((folded, listed.load(Ordering::Relaxed)), (Folded::Agreed, 2), "{glimpse}, {age:?}");
    }
}

/// An unreadable manifest shows nothing, not even that something is absent.
#[tokio::test]
async fn a_manifest_that_cannot_be_read_is_made_anew_whatever_the_fact_is() {
    for fact in [Fact::Absent(name()), Fact::Settings(None), Fact::Fold] {
        let world = World::new();
        world.put("scripts/film/2.txt", "hang 1");
        world.put(MANIFEST, "garbage");
        assert_eq!(world.fold(&fact, Age::Old).await, Folded::Committed, "{fact:?}");
        assert_eq!(world.manifest().frames.len(), 1, "{fact:?}");
    }
}

/// The manifest is replaced between the read of its beginning and that of its lines, so the lines may belong to another
/// one.
#[tokio::test]
async fn lines_of_another_manifest_show_nothing() {
    for is_replaced in [false, true] {
        let mut world = World::new();
        world.policy.glimpse = 1_200;
        for number in 1..=30 {
            world.put(&format!("scripts/film/{number}.txt"), "hang 1");
        }
        world.fold(&Fact::Fold, Age::Old).await;
        let version = world.store.bucket.lock().unwrap().head(SCRIPT).unwrap().etag;
        let fact = Fact::Version(name(), version);
        let glimpse =
            world.with(async |invocation| invocation.read_prefix(&World::film()).await).await.unwrap();
        if is_replaced {
            write_next(&mut world.store.bucket.lock().unwrap(), world.store.clock.now());
        }
        let shown =
            world.with(async |invocation| invocation.shows(&World::film(), &glimpse, &fact).await).await;
        assert_eq!(shown.unwrap(), !is_replaced);
    }
}

/// The listing of the second revision after the one that was read shows the fact, or a later one.
#[tokio::test]
async fn a_fold_leaves_when_the_second_revision_is_written_and_not_before() {
    let version = Fact::Version(name(), ETag::new("never shown"));
    for (fact, written, leaves) in
        [(&version, 1, false), (&version, 2, true), (&Fact::Fold, 1, false), (&Fact::Fold, 2, false)]
    {
        let world = World::new();
        world.put(SCRIPT, "hang 1");
        world.fold(&Fact::Fold, Age::Old).await;
        for _ in 0..2 {
            write_next(&mut world.store.bucket.lock().unwrap(), world.store.clock.now());
        }
        let mut looks = 0;
        world.meddle(move |request, bucket, now| {
            looks += u32::from(request == "get manifests/film.json");
            if request == "get manifests/film.json" && (2..2 + written).contains(&looks) {
                write_next(bucket, now);
            }
        });
        let listed = world.count("list ");
        let folded = world.fold(fact, Age::Old).await;
        let expected = if leaves { (Folded::Covered, 0) } else { (Folded::Agreed, 2) };
        assert_eq!((folded, listed.load(Ordering::Relaxed)), expected, "{fact:?} {written}");
    }
}

/// The finisher was killed between its commit and its claim, and the platform tries its event again.
#[tokio::test]
async fn a_finisher_that_finds_its_own_commit_claims() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    let version = world.store.bucket.lock().unwrap().head(SCRIPT).unwrap().etag;
    let claims = world.keys("assemblies/");
    let fact = Fact::Version(name(), version);
    for (is_own, expected) in [(false, Folded::Covered), (true, Folded::Claimed)] {
        for claim in &claims {
            world.store.bucket.lock().unwrap().delete(claim);
        }
        if is_own {
            world.requests.store(0, Ordering::Relaxed);
        }
        assert_eq!(world.fold(&fact, Age::Old).await, expected);
        assert_eq!(world.keys("assemblies/").len(), usize::from(is_own));
    }
}

#[tokio::test]
async fn nothing_is_claimed_while_frames_are_to_come() {
    let world = World::new();
    world.put(SCRIPT, "hang 1");
    assert_eq!(world.fold(&Fact::Fold, Age::Old).await, Folded::Committed);
    assert_eq!(world.keys("assemblies/"), [""; 0]);
    world.put(SCRIPT, "frame 1");
    assert_eq!(world.render(SCRIPT).await, Outcome::Drawn);
    assert_eq!(world.keys("assemblies/").len(), 1);
}

#[tokio::test]
async fn what_is_uploaded_while_the_manifest_is_written_is_listed_again_for() {
    let world = World::new();
    world.put(SCRIPT, "hang 1");
    world.meddle(|request, bucket, now| {
        if request == "put manifests/film.json" {
            bucket.put(now, "scripts/film/2.txt", "hang 2".into(), PutOptions::always()).unwrap();
        }
    });
    assert_eq!(world.fold(&Fact::Fold, Age::Old).await, Folded::Committed);
    let head = world.manifest().head;
    assert_eq!((head.total, head.revision), (2, 2));
}

/// After 16 commits the fold lets others commit for a while, and then continues.
#[tokio::test]
async fn a_fold_goes_on_for_as_long_as_scripts_come() {
    let world = World::new();
    world.put(SCRIPT, "hang 1");
    let mut number = 1;
    world.meddle(move |request, bucket, now| {
        if request == "put manifests/film.json" && number < 40 {
            number += 1;
            let key = format!("scripts/film/{number}.txt");
            bucket.put(now, &key, "hang 2".into(), PutOptions::always()).unwrap();
        }
    });
    assert_eq!(world.fold(&Fact::Fold, Age::Old).await, Folded::Committed);
    assert_eq!(world.manifest().head.total, 40);
}

#[tokio::test]
async fn a_claim_is_named_by_the_revision_and_the_set_that_it_is_put_for() {
    let world = World::new();
    for text in ["frame 1", "frame 2", "bad 3"] {
        world.upload("1.txt", text).await;
        let head = world.manifest().head;
        let claim = format!("assemblies/film/{}-{}.json", head.revision, head.generation.as_str());
        assert!(world.keys("assemblies/").contains(&claim), "{:?}", world.keys("assemblies/"));
    }
    assert_eq!(world.keys("assemblies/").len(), 3);
}

#[tokio::test]
async fn a_manifest_that_somebody_else_has_just_written_is_not_written_over() {
    let world = World::new();
    world.put(SCRIPT, "hang 1");
    world.fold(&Fact::Fold, Age::Old).await;
    world.put("scripts/film/2.txt", "hang 2");
    let mut done = false;
    world.meddle(move |request, bucket, now| {
        if request == "put manifests/film.json" && !std::mem::replace(&mut done, true) {
            write_next(bucket, now);
        }
    });
    assert_eq!(world.fold(&Fact::Fold, Age::Old).await, Folded::Committed);
    let head = world.manifest().head;
    assert_eq!((head.total, head.revision), (2, 3));
}

/// Returns the fold and the requests of a finisher. Another frame is `to come`.
async fn finishes(world: &World) -> (Folded, Vec<String>) {
    let requests = Arc::new(Mutex::new(Vec::new()));
    let noted = requests.clone();
    world.refuse(move |asked| {
        noted.lock().unwrap().push(asked.to_owned());
        None
    });
    let folded = world.try_render("scripts/film/2.txt").await.unwrap().folded;
    world.refuse(|_| None);
    let requests = std::mem::take(&mut *requests.lock().unwrap());
    (folded, requests)
}

/// Makes three scripts, and a manifest that shows the first one as drawn.
async fn one_of_three() -> World {
    let world = World::new();
    for number in 1..=3 {
        world.put(&format!("scripts/film/{number}.txt"), &format!("frame {number}"));
    }
    assert_eq!(world.try_render(SCRIPT).await.unwrap().folded, Folded::Committed);
    assert_eq!(world.manifest().head.done, 1);
    world
}

/// Each finisher wrote a manifest, and listed everything for it: 15 to 17 requests per frame with two places.
#[tokio::test]
async fn a_finisher_leaves_while_another_frame_is_to_come_and_the_last_one_lists() {
    let world = one_of_three().await;
    let (folded, requests) = finishes(&world).await;
    assert_eq!(folded, Folded::Awaited);
    let looks = ["get manifests/film.json", "list frames/film/", "head scripts/film/3.txt"];
    assert_eq!(requests[3..], looks);
    assert_eq!((world.manifest().head.done, world.manifest().head.revision), (1, 1));
    assert_eq!(world.try_render("scripts/film/3.txt").await.unwrap().folded, Folded::Claimed);
    assert_eq!((world.manifest().head.done, world.manifest().head.revision), (3, 2));
}

/// The invocation that draws the frame has already listed, or draws another version, or no invocation draws it.
#[tokio::test]
async fn a_frame_that_is_there_or_is_no_longer_current_is_left_for_by_nobody() {
    for (key, text) in [
        ("frames/film/3@{}-p1.png", Some("drawn")),
        ("frames/film/3@{}-p2.png", Some("drawn by another renderer")),
        ("frames/film/3@{}-p1.error.json", Some("{\"message\":\"why\"}")),
        ("frames/film/3@{}-p1.split-2", Some("")),
        ("scripts/film/3.txt", Some("frame 4")),
        ("scripts/film/3.txt", None),
    ] {
        let world = one_of_three().await;
        let version = world.put("scripts/film/3.txt", "frame 3");
        let key = key.replace("{}", version.as_str());
        match text {
            Some(text) => drop(world.put(&key, text)),
            None => drop(world.store.bucket.lock().unwrap().delete(&key)),
        }
        assert_ne!(finishes(&world).await.0, Folded::Awaited, "{key} {text:?}");
        let manifest = world.manifest();
        let is_done = manifest
            .frames
            .iter()
            .any(|frame| frame.script.as_str() == "2" && matches!(frame.state, FrameState::Done { .. }));
        assert!(is_done, "{key} {text:?}");
    }
}

/// Only receipts of this renderer's pixel version are searched for a part, so another renderer may have drawn it.
#[tokio::test]
async fn a_part_that_another_renderer_may_have_drawn_is_left_for_by_nobody() {
    for (other, folded) in
        [(None, Folded::Awaited), (Some("p1"), Folded::Awaited), (Some("p2"), Folded::Committed)]
    {
        let world = World::new();
        world.upload("1.txt", "split 3 1").await;
        let version = world.store.bucket.lock().unwrap().head(SCRIPT).unwrap().etag;
        if let Some(pixels) = other {
            world.put(&format!("frames/film/1@{version}-{pixels}/1.png"), "drawn");
        }
        let part = format!("parts/film/1@{version}-p1/2.json");
        let seen = world.try_render(&part).await.unwrap().folded;
        // With the first one there the lot may fall on that.
        assert!(seen == folded || other == Some("p1"), "{other:?}: {seen:?}");
    }
}

/// Settings, deletions and splits change the set, so the manifest must show them soon.
#[tokio::test]
async fn what_is_no_frames_result_is_written_down_whatever_is_to_come() {
    for (key, text) in [
        ("scripts/film/animation.json", Some("{\"fps\": 20}")),
        ("scripts/film/2.txt", None),
        ("scripts/film/2.txt", Some("split 2 1")),
    ] {
        let world = one_of_three().await;
        match text {
            Some(text) => drop(world.put(key, text)),
            None => drop(world.store.bucket.lock().unwrap().delete(key)),
        }
        assert_eq!(world.try_render(key).await.unwrap().folded, Folded::Committed, "{key} {text:?}");
        assert_eq!(world.manifest().head.revision, 2);
    }
}

/// People want to see the progress.
#[tokio::test]
async fn a_manifest_that_is_old_is_written_anew_whatever_is_to_come() {
    for (seconds, folded) in [(9, Folded::Awaited), (10, Folded::Committed)] {
        let world = one_of_three().await;
        world.later(Duration::from_secs(seconds)).await;
        assert_eq!(finishes(&world).await.0, folded, "{seconds} s");
    }
}

/// The manifest's first bytes do for that.
#[tokio::test]
async fn a_finisher_of_a_large_animation_sends_six_requests() {
    let world = World::new();
    for number in 1..=1_000 {
        world.put(&format!("scripts/film/{number}.txt"), "frame 1");
    }
    world.render(SCRIPT).await;
    let (folded, requests) = finishes(&world).await;
    assert_eq!((folded, requests.len()), (Folded::Awaited, 6), "{requests:?}");
}

#[tokio::test]
async fn the_pause_is_the_longer_the_longer_a_look_takes() {
    let mut world = World::new();
    for (look, most) in [(0, 0), (3, 24), (20, 160), (1_000, 500)] {
        let mut longest = Duration::ZERO;
        for seed in 0..30 {
            world.random = Randomness::seeded(seed);
            world
                .with(async |invocation| {
                    let before = world.store.clock.now();
                    invocation.pause(Duration::from_millis(look)).await;
                    longest = longest.max(world.store.clock.now().since(before));
                })
                .await;
        }
        let most = Duration::from_millis(most);
        assert!(longest >= most / 2 && longest <= most, "{look}: {longest:?}");
    }
}

/// Between the attempts there are pauses, each of which may be twice as long as the one before.
#[tokio::test]
async fn a_request_is_sent_five_times_before_it_fails() {
    let throttled = || Error::Throttled { key: "k".into(), source: "busy".into() };
    let refused = || Error::Refused { key: "k".into(), source: "no".into() };
    for (failures, error, sent) in [
        (0, throttled as fn() -> Error, 1),
        (4, throttled, 5),
        (5, throttled, 5),
        (1, refused as fn() -> Error, 1),
    ] {
        let world = World::new();
        let mut left = failures;
        let counted = Arc::new(AtomicU64::new(0));
        let counter = counted.clone();
        world.put("key", "body");
        world.refuse(move |_| {
            counter.fetch_add(1, Ordering::Relaxed);
            left -= i32::from(left >= 0);
            (left >= 0).then(error)
        });
        let before = world.store.clock.now();
        let read = world.with(async |invocation| invocation.get("key").await).await;
        assert_eq!(counted.load(Ordering::Relaxed), sent, "{failures}");
        assert_eq!(read.is_ok(), failures < sent as i32, "{failures}: {read:?}");
        let paused = world.store.clock.now().since(before);
        assert_eq!(paused > Duration::ZERO, sent > 1, "{failures}: {paused:?}");
        assert!(paused <= Duration::from_millis(50 + 100 + 200 + 400), "{failures}: {paused:?}");
    }
}

/// Makes this many scripts and no manifest. The first ones after the second script are drawn.
fn drawn_without_a_manifest(scripts: usize, drawn: usize) -> World {
    let world = World::new();
    for number in 1..=scripts {
        let version = world.put(&format!("scripts/film/{number}.txt"), &format!("frame {number}"));
        if (3..3 + drawn).contains(&number) {
            world.put(&format!("frames/film/{number}@{version}-p1.png"), "drawn");
        }
    }
    world
}

/// Otherwise the others would write the same manifest, one after the other.
#[tokio::test]
async fn of_those_who_find_no_manifest_the_first_one_writes_it_and_few_others() {
    for (drawn, writers) in [(0, 30..=30), (1, 10..=20), (5, 1..=9)] {
        let mut wrote = 0;
        for request in 0..30 {
            let world = drawn_without_a_manifest(10, drawn);
            world.requests.store(request, Ordering::Relaxed);
            let (folded, requests) = finishes(&world).await;
            if folded == Folded::Awaited {
                let looks = ["get manifests/film.json", "list frames/film/", "list scripts/film/"];
                assert_eq!(requests[3..], looks, "{drawn}");
                assert_eq!(world.keys("manifests/"), [""; 0]);
            } else {
                assert_eq!(world.manifest().head.done, drawn as u64 + 1);
                wrote += 1;
            }
        }
        assert!(writers.contains(&wrote), "{drawn}: {wrote}");
    }
}

#[tokio::test]
async fn the_last_one_writes_the_manifest_whatever_the_lot_says() {
    for request in 0..10 {
        let world = drawn_without_a_manifest(10, 8);
        let version = world.store.bucket.lock().unwrap().head(SCRIPT).unwrap().etag;
        world.put(&format!("frames/film/1@{version}-p1.error.json"), r#"{"message":"why"}"#);
        world.requests.store(request, Ordering::Relaxed);
        assert_eq!(finishes(&world).await.0, Folded::Claimed);
    }
}

/// With many finishers one listing should serve all; with few there is no reason to wait.
#[tokio::test]
async fn a_finisher_pauses_before_it_lists_only_in_a_crowd() {
    for (others, looks) in [(0, 1), (7, 1), (8, 2)] {
        let world = World::new();
        world.put(SCRIPT, "hang 1");
        world.put("scripts/film/2.txt", "frame 2");
        world.fold(&Fact::Fold, Age::Old).await;
        for number in 1..=others {
            let version = ETag::new(&format!("older{number}"));
            world.put(&format!("frames/film/1@{version}-p1.png"), "drawn");
        }
        // No invocation draws the first one's new version, so that there is none to leave for.
        world.put(SCRIPT, "hang 2");
        let (folded, requests) = finishes(&world).await;
        assert_eq!(folded, Folded::Committed);
        let counted = requests.iter().take_while(|request| !request.starts_with("put manifests/"));
        let counted = counted.filter(|request| *request == "get manifests/film.json").count();
        assert_eq!(counted, looks, "{others}: {requests:?}");
    }
}

/// A listing from before the manifest was read again would overwrite newer results.
#[tokio::test]
async fn a_page_is_written_down_only_over_the_manifest_that_was_read_before_it() {
    let world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    world.put("scripts/film/2.txt", "frame 2");
    world.fold(&Fact::Fold, Age::Old).await;
    let frame = format!("frames/film/1@{version}-p1.png");
    world.put(&frame, "drawn");
    let mut done = false;
    world.meddle(move |request, bucket, now| {
        if request == "put manifests/film.json" && !std::mem::replace(&mut done, true) {
            // The frame goes, and another invocation writes.
            bucket.delete(&frame);
            write_next(bucket, now);
        }
    });
    assert_eq!(finishes(&world).await.0, Folded::Committed);
    // With the earlier page it would have been another revision, and one more that corrects it.
    let head = world.manifest().head;
    assert_eq!((head.done, head.revision), (1, 3));
}

/// Another frame is drawn between the page and the commit. Its finisher may stop because of that commit.
#[tokio::test]
async fn the_writer_of_a_manifest_leaves_for_no_frame_because_of_an_older_page() {
    let world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    world.put("scripts/film/2.txt", "frame 2");
    let mut commits = 0;
    let bucket = world.store.bucket.clone();
    let now = world.store.clock.now();
    world.refuse(move |request| {
        if request != "put manifests/film.json" {
            return None;
        }
        commits += 1;
        if commits == 1 {
            let frame = format!("frames/film/1@{version}-p1.png");
            bucket.lock().unwrap().put(now, &frame, "drawn".into(), PutOptions::always()).unwrap();
        }
        (commits == 2).then(|| Error::PreconditionFailed { key: MANIFEST.to_owned() })
    });
    assert_eq!(world.try_render("scripts/film/2.txt").await.unwrap().folded, Folded::Claimed);
    assert_eq!(world.manifest().head.done, 2);
}

/// There are more receipts than a page shows.
#[tokio::test]
async fn a_finisher_looks_at_one_frame_where_there_is_more_than_a_page() {
    let world = one_of_three().await;
    for number in 0..crate::store::PAGE {
        world.put(&format!("frames/film/old@{number}-p1.png"), "drawn");
    }
    let version = world.put("scripts/film/3.txt", "frame 3");
    let (folded, requests) = finishes(&world).await;
    assert_eq!(folded, Folded::Awaited);
    let looks = [
        "get manifests/film.json".to_owned(),
        "list frames/film/".to_owned(),
        format!("list frames/film/3@{version}"),
        "head scripts/film/3.txt".to_owned(),
    ];
    assert_eq!(requests[3..], looks);
}

/// Half of a thousand finishers find that the first frame that they check is drawn.
#[tokio::test]
async fn of_a_crowd_that_finds_its_first_frame_drawn_few_list() {
    let (mut left_at_once, mut left_by_the_page, mut listed) = (0, 0, 0);
    for request in 0..30 {
        let world = World::new();
        for number in 1..=600 {
            world.put(&format!("scripts/film/{number}.txt"), "frame 1");
        }
        world.fold(&Fact::Fold, Age::Old).await;
        let version = world.store.bucket.lock().unwrap().head(SCRIPT).unwrap().etag;
        for number in (3..=600).step_by(2) {
            world.put(&format!("frames/film/{number}@{version}-p1.png"), "drawn");
        }
        world.requests.store(request, Ordering::Relaxed);
        let (folded, requests) = finishes(&world).await;
        match folded {
            Folded::Awaited if requests.len() == 6 => left_at_once += 1,
            Folded::Awaited => {
                assert_eq!(requests[5], "list frames/film/");
                assert_eq!(requests.len(), 7, "{requests:?}");
                left_by_the_page += 1;
            }
            _ => listed += 1,
        }
    }
    assert!(
        left_at_once > 5 && left_by_the_page > 5 && listed < 5,
        "{left_at_once} {left_by_the_page} {listed}"
    );
}
