//! The handling of events that the platform has given up.

use super::*;

const SCRIPT: &str = "scripts/film/1.txt";

impl World {
    /// Uploads a script that no invocation has drawn, and returns its version.
    fn pending(&self) -> ETag {
        self.put(SCRIPT, "frame 1")
    }

    /// Puts `attempts` retries of a frame, and the receipts that `begun` of them have begun.
    fn tried(&self, of: &str, attempts: u64, begun: u64) {
        for attempt in 1..=attempts {
            self.put(&format!("retries/film/{of}/{attempt}"), "");
        }
        for attempt in 1..=begun {
            self.put(&format!("frames/film/{of}.begun-{attempt}"), "");
        }
    }

    fn message_of(&self, place: usize) -> String {
        let manifest = self.manifest();
        let FrameState::Failed(fault) = &manifest.frames[place].state else { panic!("{manifest:?}") };
        fault.reason.clone().unwrap().message
    }
}

fn busy() -> End {
    End::Error("busy".into())
}

#[tokio::test]
async fn whatever_woke_the_frame_that_timed_out_the_frame_gets_the_error() {
    for (end, message) in [
        (End::TimedOut, "timed out in each of 3 attempts"),
        (End::Died, "the render function died in each of 3 attempts, most likely for lack of memory"),
    ] {
        for is_retry in [false, true] {
            let world = World::new();
            let version = world.pending();
            let recorded = if is_retry {
                world.record(&format!("retries/film/1@{version}-p1/2"), None, end.clone()).await
            } else {
                world.record(SCRIPT, Some(version), end.clone()).await
            };
            assert!(matches!(recorded, Recorded::GivenUp(_)), "{recorded:?}");
            assert_eq!(world.message_of(0), message);
        }
    }
}

#[tokio::test]
async fn a_part_that_timed_out_is_named_and_one_of_another_version_is_not() {
    let world = World::new();
    let version = world.put(SCRIPT, "split 2 1");
    world.render(SCRIPT).await;
    let part = |of: &ETag, number: u64| format!("parts/film/1@{of}-p1/{number}.json");
    let superseded = world.record(&part(&ETag::new("0"), 2), None, End::TimedOut).await;
    assert!(matches!(superseded, Recorded::Resolved(_)), "{superseded:?}");
    assert_eq!(world.keys("retries/"), [""; 0]);
    let recorded = world.record(&part(&version, 2), None, End::TimedOut).await;
    assert!(matches!(recorded, Recorded::GivenUp(_)), "{recorded:?}");
    assert!(world.keys("frames/").contains(&format!("frames/film/1@{version}-p1/2.error.json")));
    assert_eq!(world.manifest().frames[0].state, FrameState::Pending);
    world.render(&part(&version, 1)).await;
    assert_eq!(world.message_of(1), "timed out in each of 3 attempts");
}

#[tokio::test]
async fn other_failed_events_are_about_what_is_there_now() {
    let world = World::new();
    let gone = world.record("scripts/film/7.txt", None, End::TimedOut).await;
    assert!(matches!(gone, Recorded::Resolved(_)), "{gone:?}");
    world.pending();
    world.put("scripts/film/animation.json", r#"{"frames": 2}"#);
    let settings = world.record("scripts/film/animation.json", None, End::TimedOut).await;
    assert!(matches!(settings, Recorded::Resolved(_)), "{settings:?}");
    assert_eq!(world.manifest().head.status, Status::Waiting, "the settings are in the manifest");
    let key = "frames/film/1@v-p1.png".to_owned();
    let failure = Failure { key, version: None, attempts: 3, end: End::TimedOut, request_id: "r".into() };
    let recorded = world.with(async |invocation| record_failure(invocation, &failure).await).await;
    assert!(matches!(recorded, Err(Error::Key { .. })), "{recorded:?}");
}

/// After a transient error a frame is tried again a few times, and then left to the sweep. If invocations have begun it
/// that many times without a result, it is given up. A frame that no invocation has tried is never given up.
#[tokio::test]
async fn a_frame_is_woken_left_or_given_up_as_its_attempts_say() {
    for (end, attempts, begun, expected) in [
        (busy(), 0, 0, Recorded::Woken { attempt: 1 }),
        (busy(), 2, 2, Recorded::Woken { attempt: 3 }),
        (busy(), 3, 2, Recorded::LeftToSweep),
        (busy(), 4, 2, Recorded::LeftToSweep),
        (End::TooOld, 2, 2, Recorded::Woken { attempt: 3 }),
        (End::TooOld, 3, 2, Recorded::Woken { attempt: 4 }),
        (End::TooOld, 4, 4, Recorded::Woken { attempt: 5 }),
        (End::TimedOut, 0, 0, Recorded::Woken { attempt: 1 }),
        (End::Died, 3, 0, Recorded::LeftToSweep),
    ] {
        let (world, what) = (World::new(), format!("{end:?} after {attempts}, {begun} begun"));
        let version = world.pending();
        world.tried(&format!("1@{version}-p1"), attempts, begun);
        assert_eq!(world.record(SCRIPT, None, end).await, expected, "{what}");
        if let Recorded::Woken { attempt } = expected {
            let last = format!("retries/film/1@{version}-p1/{attempt}");
            assert_eq!(world.keys("retries/").last(), Some(&last), "{what}");
        }
    }
    for (end, begun, message) in [
        (busy(), 3, "no result in each of 3 attempts: busy"),
        (busy(), 4, "no result in each of 4 attempts: busy"),
        (End::TimedOut, 3, "no result in each of 3 attempts"),
        (End::Died, 3, "no result in each of 3 attempts"),
    ] {
        let world = World::new();
        let version = world.pending();
        world.tried(&format!("1@{version}-p1"), 0, begun);
        let recorded = world.record(SCRIPT, None, end).await;
        assert!(matches!(recorded, Recorded::GivenUp(_)), "{recorded:?}: {message}");
        assert_eq!(world.message_of(0), message);
    }
}

#[tokio::test]
async fn attempts_at_other_frames_do_not_count() {
    let world = World::new();
    let version = world.pending();
    for other in [format!("2@{version}-p1"), "1@0-p1".to_owned()] {
        world.tried(&other, 5, 5);
    }
    world.put(&format!("retries/film/1@{version}-p1/7/5"), "of a part");
    world.put(&format!("frames/film/1@{version}-p1/7.begun-5"), "of a part");
    world.tried(&format!("1@{version}-p1"), 1, 1);
    assert_eq!(world.record(SCRIPT, None, busy()).await, Recorded::Woken { attempt: 2 });
}

impl World {
    /// Makes a set of frames without a GIF, and its claim.
    async fn claimed(&self) -> String {
        self.upload("1.txt", "frame 1").await;
        self.upload("2.txt", "frame 2").await;
        self.keys("assemblies/").pop().unwrap()
    }
}

#[tokio::test]
async fn a_set_that_cannot_be_assembled_in_any_attempt_is_refused() {
    for (end, what) in [(End::TimedOut, "timed out"), (End::Died, "died, most likely for lack of memory,")] {
        let world = World::new();
        let claim = world.claimed().await;
        // The GIF is of an older set.
        world.put_gif("another");
        let recorded = world.record(&claim, None, end).await;
        assert!(matches!(recorded, Recorded::Refused(_)), "{recorded:?}");
        let head = world.manifest().head;
        let message = head.refusal.unwrap().reason.unwrap().message;
        assert_eq!(head.status, Status::Refused);
        let expected = format!("the assemble function {what} in each of 3 attempts at 2 frames: ");
        assert!(message.starts_with(&expected), "{message}");
    }
}

#[tokio::test]
async fn a_failed_assembly_is_left_to_the_sweep_when_another_may_do() {
    // The failure may pass.
    for end in [busy(), End::TooOld] {
        let world = World::new();
        let claim = world.claimed().await;
        assert_eq!(world.record(&claim, None, end).await, Recorded::LeftToSweep);
    }
    // The GIF is there.
    let world = World::new();
    let claim = world.claimed().await;
    world.put_gif(world.manifest().head.generation.as_str());
    assert_eq!(world.record(&claim, None, End::TimedOut).await, Recorded::LeftToSweep);
    // The set is another one.
    let world = World::new();
    let claim = world.claimed().await;
    world.upload("3.txt", "frame 3").await;
    assert_eq!(world.record(&claim, None, End::TimedOut).await, Recorded::LeftToSweep);
    // A frame cannot be drawn, so that there is to be no GIF.
    let world = World::new();
    world.upload("1.txt", "bad 1").await;
    let claim = world.keys("assemblies/").pop().unwrap();
    assert_eq!(world.record(&claim, None, End::TimedOut).await, Recorded::LeftToSweep);
    assert_eq!(world.manifest().head.status, Status::Failed);
}

/// The user must see that the frame is known and pending.
#[tokio::test]
async fn the_manifest_shows_a_frame_that_is_left_to_the_sweep() {
    let world = World::new();
    let version = world.pending();
    world.tried(&format!("1@{version}-p1"), 3, 2);
    assert_eq!(world.record(SCRIPT, None, busy()).await, Recorded::LeftToSweep);
    assert_eq!(world.manifest().frames[0].state, FrameState::Pending);
}

/// Another client replaced the GIF by half of it, with its metadata.
#[tokio::test]
async fn a_set_is_refused_though_there_is_what_looks_like_its_gif() {
    let world = World::new();
    let claim = world.claimed().await;
    world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!(world.record(&claim, None, End::TimedOut).await, Recorded::LeftToSweep);
    world.put_gif(world.manifest().head.generation.as_str());
    let recorded = world.record(&claim, None, End::TimedOut).await;
    assert!(matches!(recorded, Recorded::Refused(_)), "{recorded:?}");
}

/// No manifest shows the other script yet.
#[tokio::test]
async fn no_set_is_refused_that_is_another_one_by_now() {
    let world = World::new();
    let claim = world.claimed().await;
    world.put("scripts/film/3.txt", "frame 3");
    assert_eq!(world.record(&claim, None, End::TimedOut).await, Recorded::LeftToSweep);
    assert!(!world.keys("frames/").iter().any(|key| key.ends_with(".error.json")));
}
