//! Tests of the requests by which an animation is observed, and of the conclusions from the replies.

use super::*;
use crate::fold::fold;
use crate::keys::{Receipt, Tag};
use crate::observe::{VersionResult, version_result};
use crate::reconcile::ReceiptFound;

const SETTINGS: &str = "scripts/film/animation.json";

impl World {
    /// Observes and writes the manifest. Returns how many requests began with this text.
    async fn asks(&self, request: &'static str) -> u64 {
        let counted = Arc::new(AtomicU64::new(0));
        let counter = counted.clone();
        self.refuse(move |asked| {
            counter.fetch_add(u64::from(asked.starts_with(request)), Ordering::Relaxed);
            None
        });
        self.with(async |invocation| {
            let known = invocation.manifest(&World::film()).await.unwrap();
            invocation.observe(&World::film(), known.as_ref()).await.unwrap();
        })
        .await;
        self.refuse(|_| None);
        self.with(async |invocation| fold(invocation, &World::film()).await.unwrap()).await;
        counted.load(Ordering::Relaxed)
    }
}

#[tokio::test]
async fn of_many_keys_that_no_script_can_have_the_first_are_named_and_the_others_counted() {
    for (keys, last) in [(100, None), (101, Some("1 more key")), (2_500, Some("2400 more keys"))] {
        let world = World::new();
        let name = "x".repeat(900);
        for number in 0..keys {
            world.put(&format!("scripts/film/{name}{number}.txt"), "");
        }
        world.upload("1.txt", "frame 1").await;
        let head = world.manifest().head;
        assert_eq!((head.rejected.len(), head.status), (100 + usize::from(last.is_some()), Status::Failed));
        let expected =
            last.map(|more| ("scripts/film/".to_owned(), format!("{more} that no script can have")));
        assert_eq!(head.rejected.get(100).map(|more| (more.key.clone(), more.problem.clone())), expected);
    }
}

/// A backup file of an editor failed the animation, and a script with a name in capitals was left out without a
/// message.
#[tokio::test]
async fn what_systems_leave_counts_for_nothing_and_what_is_misnamed_is_a_warning() {
    let world = World::new();
    for ignored in ["notes.md", ".txt", ".old.txt", "._1.txt", ".#1.txt", "Thumbs.db", ""] {
        world.put(&format!("scripts/film/{ignored}"), "");
    }
    let warned = ["3.TXT", "5.txt ", "a\\6.txt", "animation.JSON"].map(|name| format!("scripts/film/{name}"));
    for near_miss in &warned {
        world.put(near_miss, "frame 9");
    }
    world.upload("1.txt", "frame 1").await;
    let head = world.manifest().head;
    let warnings: Vec<_> = head.warnings.iter().map(|warning| warning.key.as_str()).collect();
    assert_eq!((warnings, head.rejected), (warned.iter().map(String::as_str).collect(), Vec::new()));
    assert_eq!((head.total, head.status), (1, Status::Done));
}

#[tokio::test]
async fn a_misnamed_file_is_in_the_manifest_as_soon_as_it_comes_and_until_it_goes() {
    let world = World::new();
    let key = "scripts/film/3.TXT";
    let named =
        || world.manifest().head.warnings.iter().map(|warning| warning.key.clone()).collect::<Vec<_>>();
    assert!(matches!(world.upload("3.TXT", "frame 3").await, Outcome::NearMiss(_)));
    assert_eq!((named(), world.manifest().head.status), (vec![key.to_owned()], Status::Empty));
    world.upload("1.txt", "frame 1").await;
    assert_eq!((named(), world.manifest().head.status), (vec![key.to_owned()], Status::Done));
    world.store.bucket.lock().unwrap().delete(key);
    world.render(key).await;
    assert!(named().is_empty());
}

#[tokio::test]
async fn of_many_misnamed_files_the_first_are_named_and_the_others_counted() {
    let world = World::new();
    for number in 0..250 {
        world.put(&format!("scripts/film/{number:03}.TXT"), "");
    }
    world.upload("1.txt", "frame 1").await;
    let warnings = world.manifest().head.warnings;
    assert_eq!((warnings.len(), warnings[0].key.as_str()), (101, "scripts/film/000.TXT"));
    assert_eq!(warnings[100].problem, "150 more keys of files that are not read");
}

#[tokio::test]
async fn settings_have_at_most_64_kib() {
    for (size, expected) in [(65_535, true), (65_536, true), (65_537, false)] {
        let world = World::new();
        world.put(SETTINGS, &format!(r#"{{"frames": 2}}{}"#, " ".repeat(size - 13)));
        world.upload("1.txt", "frame 1").await;
        let settings = world.manifest().head.settings;
        assert_eq!(settings.value.is_some(), expected, "{size}: {settings:?}");
        if let Some(fault) = settings.fault {
            let message = "animation.json has 65537 bytes: expected at most 65536";
            assert_eq!(fault.message, message);
        }
    }
}

#[tokio::test]
async fn settings_are_read_when_they_are_new_or_could_not_be_read() {
    let world = World::new();
    world.put("scripts/film/1.txt", "hang 1");
    assert_eq!(world.asks("get scripts/film/animation.json").await, 0, "there are none");
    for (text, times) in [(r#"{"frames": 2}"#, [1, 0]), (r#"{"frames": 3}"#, [1, 0]), ("garbage", [1, 1])] {
        world.put(SETTINGS, text);
        for expected in times {
            assert_eq!(world.asks("get scripts/film/animation.json").await, expected, "{text}");
        }
    }
}

/// The parts are listed in parallel ranges of a thousand names each. Parts of a version that is no longer current are
/// not listed.
#[tokio::test]
async fn the_parts_of_a_split_script_are_listed() {
    for (count, ranges) in [(2, 1), (1_000, 1), (1_001, 2), (2_000, 3)] {
        let world = World::new();
        world.put("frames/film/1@0-p1.split-7", "");
        let version = world.put("scripts/film/1.txt", "split 2 1");
        assert_eq!(world.asks("list frames/film/1@").await, 0, "the script is not split yet");
        world.put(&format!("frames/film/1@{version}-p1.split-{count}"), "");
        world.put(&format!("frames/film/1@{version}-p1/1.png"), "frame");
        world.put(&format!("frames/film/1@{version}-p1/{count}.png"), "frame");
        assert_eq!(world.asks("list frames/film/1@").await, ranges, "{count}");
        let head = world.manifest().head;
        assert_eq!((head.total, head.done), (count, 2), "{count}");
    }
}

/// Reasons are read when no frame is pending, each once.
#[tokio::test]
async fn reasons_are_read_when_all_has_been_tried() {
    let world = World::new();
    for number in [1, 2] {
        let version = world.put(&format!("scripts/film/{number}.txt"), &format!("bad {number}"));
        let reason = format!(r#"{{"message":"reason {number}"}}"#);
        world.put(&format!("frames/film/{number}@{version}-p1.error.json"), &reason);
    }
    world.put("scripts/film/3.txt", "hang 3");
    assert_eq!(world.asks("get frames/film/").await, 0, "one is still to come");
    assert_eq!((world.manifest().head.failed, world.manifest().head.status), (2, Status::Rendering));
    world.store.bucket.lock().unwrap().delete("scripts/film/3.txt");
    assert_eq!(world.asks("get frames/film/").await, 2);
    assert_eq!(world.asks("get frames/film/").await, 0, "the manifest has them");
    let manifest = world.manifest();
    let reasons: Vec<_> = manifest
        .frames
        .iter()
        .map(|frame| match &frame.state {
            FrameState::Failed(fault) => fault.reason.clone().unwrap().message,
            state => panic!("{state:?}"),
        })
        .collect();
    assert_eq!(reasons, ["reason 1", "reason 2"]);
}

/// The assembler of a refused set also finds the reason in the manifest.
#[tokio::test]
async fn the_reason_of_a_refusal_is_read_once() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    let generation = world.manifest().head.generation;
    world.put(&format!("frames/film/@{}.error.json", generation.as_str()), r#"{"message":"why"}"#);
    assert_eq!(world.asks("get frames/film/@").await, 1);
    assert_eq!(world.asks("get frames/film/@").await, 0);
    let refusal = world.manifest().head.refusal.unwrap();
    assert_eq!(refusal.reason.unwrap().message, "why");
}

#[test]
fn a_version_has_come_to_the_strongest_of_what_there_is_of_it() {
    let name = || ScriptName::new("1").unwrap();
    let tag = |pixels: u32| Tag { version: ETag::new("v"), pixels };
    let (one, two) = (crate::manifest::part(1), crate::manifest::part(2));
    let count = NonZeroU64::new(3).unwrap();
    let found = |receipt: Receipt, etag: &str| ReceiptFound {
        receipt,
        etag: ETag::new(etag),
        modified: Timestamp(0),
    };
    let frame = |pixels: u32, part| found(Receipt::Frame { name: name(), tag: tag(pixels), part }, "f");
    let fault = |part| found(Receipt::Fault { name: name(), tag: tag(1), part }, "e");
    let split = || found(Receipt::Split { name: name(), tag: tag(1), count }, "s");
    let begun = || {
        let attempt = NonZeroU64::MIN;
        found(Receipt::Begun { name: name(), tag: tag(1), part: None, attempt }, "b")
    };
    let is_split = || Some(VersionResult::Split { tag: tag(1), count });
    let is_faulty = || Some(VersionResult::Faulty(ETag::new("e")));
    for (receipts, whole, first) in [
        (vec![], None, None),
        (vec![begun()], None, None),
        (vec![fault(None)], is_faulty(), None),
        (vec![frame(1, None), fault(None)], Some(VersionResult::Drawn(1)), None),
        (vec![frame(2, None), frame(1, None)], Some(VersionResult::Drawn(2)), None),
        (vec![split(), frame(1, None)], is_split(), None),
        (vec![split(), frame(2, one), fault(one)], is_split(), Some(VersionResult::Drawn(2))),
        (vec![fault(one), frame(1, two)], None, is_faulty()),
    ] {
        assert_eq!(version_result(&receipts, None), whole, "{receipts:?}");
        assert_eq!(version_result(&receipts, one), first, "{receipts:?}");
    }
}

#[tokio::test]
async fn an_animation_that_is_called_like_anothers_receipts_draws_none_of_its_frames() {
    let world = World::new();
    let [first, second] = [1, 2].map(|number| {
        let version = world.put(&format!("scripts/film/{number}.txt"), &format!("split 2 {number}"));
        world.put(&format!("frames/film/{number}@{version}-p1.split-2"), "");
        version
    });
    world.put(&format!("frames/film/1@{first}-p1/2@{second}-p1/1.png"), "another's");
    world.asks("").await;
    let head = world.manifest().head;
    assert_eq!((head.total, head.done), (4, 0));
}
