//! When a fold leaves, waits, lists, writes and claims, by the requests that it sends.

use super::*;
use crate::fold::{Age, Folded, fold};
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

/// Someone else writes the next revision, which says the same.
pub(super) fn write_next(bucket: &mut Bucket, now: Timestamp) {
    let mut manifest = Manifest::decode(&World::film(), &bucket.get(MANIFEST).unwrap().body).unwrap();
    manifest.head.revision += 1;
    manifest.head.writer = "someone".to_owned();
    bucket.put(now, MANIFEST, manifest.encode(32 * 1024).unwrap(), PutOptions::always()).unwrap();
}

/// Of a manifest that is larger than what is read at once the lines are looked up, but not by whoever has just put the result.
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
        // What it does not show is listed for.
        let listed = world.count("list ");
        let folded = world.fold(&Fact::Version(name(), ETag::new("other")), age).await;
        assert_eq!((folded, listed.load(Ordering::Relaxed)), (Folded::Agreed, 2), "{glimpse}, {age:?}");
    }
}

/// What cannot be read shows nothing, not even that something is not there.
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

/// The manifest is replaced between the look at its beginning and that at its lines: the lines may be others'.
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
        let glimpse = world.with(async |invocation| invocation.glimpse(&World::film()).await).await.unwrap();
        if is_replaced {
            write_next(&mut world.store.bucket.lock().unwrap(), world.store.clock.now());
        }
        let shown =
            world.with(async |invocation| invocation.shows(&World::film(), &glimpse, &fact).await).await;
        assert_eq!(shown.unwrap(), !is_replaced);
    }
}

/// The listing of the second revision after the one that was read has seen the fact, or what came later.
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

/// It was killed between its commit and its claim, and the platform tries its event again.
#[tokio::test]
async fn whoever_finds_its_own_commit_claims() {
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

/// After 16 commits it is others' turn for a while, and then this one's again.
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

/// Of 1,000 frames: one in four of those who have seen nobody write, and after one more pause everyone.
#[tokio::test]
async fn where_a_listing_is_dear_few_list_at_first_and_all_soon() {
    let mut world = World::new();
    for number in 0..1_000 {
        world.put(&format!("scripts/film/{number}.txt"), "hang 1");
    }
    world.fold(&Fact::Fold, Age::Old).await;
    let mut pauses = [0; 4];
    for seed in 0..32 {
        world.random = Randomness::seeded(seed);
        let looks = Arc::new(AtomicU64::new(0));
        let counter = looks.clone();
        world.refuse(move |asked| {
            counter.fetch_add(u64::from(asked == "get manifests/film.json"), Ordering::Relaxed);
            asked.starts_with("list ").then(|| Error::Refused { key: "k".into(), source: "no".into() })
        });
        let folded = world.with(async |invocation| fold(invocation, &World::film()).await).await;
        assert!(matches!(folded, Err(Error::Refused { .. })), "{folded:?}");
        // The first look is before the first pause; a large manifest is read whole at last.
        pauses[looks.load(Ordering::Relaxed) as usize - 2] += 1;
    }
    // 8 and 24 are to be expected, and whether the manifest is read whole is the same for all.
    let seen: Vec<u32> = pauses.into_iter().filter(|count| *count > 0).collect();
    assert!(seen.len() == 2 && (3..14).contains(&seen[0]), "{pauses:?}");
}

#[tokio::test]
async fn the_pause_is_the_longer_the_more_frames_are_to_come() {
    let mut world = World::new();
    world.put("scripts/film/animation.json", r#"{"frames": 10}"#);
    for (file, text, most) in [("1.txt", "frame 1", 500), ("2.txt", "frame 2", 27), ("3.txt", "frame 3", 24)]
    {
        let mut longest = Duration::ZERO;
        let key = format!("scripts/film/{file}");
        world.put(&key, text);
        for seed in 0..30 {
            world.random = Randomness::seeded(seed);
            world
                .with(async |invocation| {
                    let known = invocation.manifest(&World::film()).await.unwrap();
                    let before = world.store.clock.now();
                    invocation.pause(known.as_ref().map(|known| &known.manifest.head)).await;
                    longest = longest.max(world.store.clock.now().since(before));
                })
                .await;
        }
        let most = Duration::from_millis(most);
        assert!(longest > most / 2 && longest <= most, "{file}: {longest:?}");
        world.render(&key).await;
    }
}

/// With pauses in between, each of which may be twice as long as the one before.
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
