//! The work of an assembler: the GIFs that it builds, waits for, leaves to the next one, refuses and deletes.

use super::*;
use crate::fakes::film;

pub(super) const GIF: &str = "animations/film.gif";
pub(super) const LEASE: &str = "frames/film/@assembler.json";
pub(super) const CHECKPOINT: &str = "checkpoints/film.state";

pub(super) fn seconds(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

impl World {
    /// Draws this many frames, as many as the settings announce. Returns the claim.
    pub(super) async fn announced(&self, frames: u64) -> String {
        self.put("scripts/film/animation.json", &format!(r#"{{"frames": {frames}}}"#));
        for number in 1..=frames {
            self.upload(&format!("{number}.txt"), &format!("frame {number}")).await;
        }
        self.keys("assemblies/").pop().unwrap()
    }

    pub(super) fn gif(&self) -> Option<String> {
        let object = self.store.bucket.lock().unwrap().get(GIF).ok()?;
        Some(String::from_utf8_lossy(&object.body).into_owned())
    }

    /// Returns the GIF of all frames.
    pub(super) fn film_of(&self, frames: u64) -> String {
        let name = |number: u64| ScriptName::new(&number.to_string()).unwrap();
        let text = |number: u64| format!("frame {number}");
        let pictures: Vec<_> =
            (1..=frames).map(|number| picture(&name(number), text(number).as_bytes(), None)).collect();
        film(&AnimationSettings::default(), Container::Gif, &pictures)
    }

    pub(super) fn slow(&self, takes: Duration) -> Joiner {
        Joiner { takes, ..self.joiner() }
    }

    /// Returns whether no lease is held, nothing is unfinished, and the manifest records the existing files.
    pub(super) fn is_at_rest(&self) -> bool {
        let head = self.manifest().head;
        let bucket = self.store.bucket.lock().unwrap();
        let is_named = |output: Container| {
            let file = bucket.head(&World::film().output(output)).ok().map(|info| info.etag);
            file.is_none() || file.as_ref() == head.version_of(output)
        };
        let is_clean = bucket.keys().all(|key| key != LEASE && key != CHECKPOINT);
        is_clean && bucket.unfinished_uploads() == 0 && Container::ALL.into_iter().all(is_named)
    }
}

#[tokio::test]
async fn a_set_is_built_when_it_is_quiet_and_not_again() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    world.upload("2.txt", "frame 2").await;
    let claim = world.keys("assemblies/").pop().unwrap();
    let quiet = world.modified("scripts/film/2.txt").after(world.policy.quiet);
    let waited = quiet.since(world.store.clock.now());
    let revision = world.manifest().head.revision;
    let assembled = world.assemble(&world.slow(seconds(3)), &claim).await.unwrap();
    // It waits, builds, and finds nothing to do.
    assert_eq!((assembled.rounds, assembled.built, assembled.frames), (3, 1, 2));
    assert_eq!((assembled.waited, assembled.building, assembled.left_after), (waited, seconds(6), None));
    assert_eq!(world.gif(), Some(world.film_of(2)));
    assert!(world.is_at_rest());
    assert_eq!(world.manifest().head.revision, revision, "the GIF is no revision");
    let again = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((again.rounds, again.built, again.waited), (1, 0, Duration::ZERO));
    assert!(world.is_at_rest());
}

#[tokio::test]
async fn a_set_that_was_announced_is_built_at_once() {
    let world = World::new();
    let claim = world.announced(2).await;
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.rounds, assembled.built, assembled.waited), (2, 1, Duration::ZERO));
    assert_eq!(world.gif(), Some(world.film_of(2)));
}

#[tokio::test]
async fn an_assembler_whose_time_does_not_do_for_the_quiet_wakes_the_next_one() {
    let mut world = World::new();
    world.upload("1.txt", "frame 1").await;
    let claim = world.keys("assemblies/").pop().unwrap();
    let quiet = world.modified("scripts/film/1.txt").after(world.policy.quiet);
    world.deadline = Some(quiet.after(world.policy.margin));
    let before = world.modified(&claim);
    world.later(seconds(1)).await;
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.rounds, assembled.built, assembled.waited), (1, 0, Duration::ZERO));
    assert!(world.modified(&claim) > before && world.is_at_rest());
    world.deadline = world.deadline.map(|deadline| deadline.after(seconds(1)));
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 1);
}

/// An invocation has time for five frames, of which it keeps that of one free.
#[tokio::test]
async fn a_gif_that_takes_too_long_is_left_where_it_stands_and_gone_on_with() {
    let mut world = World::new();
    world.policy.spare_frames = 1;
    let claim = world.announced(12).await;
    for (pieces, (left_after, built)) in (1..).zip([(Some(5), 0), (Some(10), 0), (None, 1)]) {
        assert_eq!(world.gif(), None);
        let before = world.modified(&claim);
        world.later(seconds(1)).await;
        world.deadline = Some(world.store.clock.now().after(seconds(60)));
        let assembled = world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
        assert_eq!((assembled.left_after, assembled.built), (left_after, built));
        assert_eq!(world.modified(&claim) > before, left_after.is_some(), "the next one is woken");
        assert_eq!(world.keys("checkpoints/").len(), usize::from(left_after.is_some()));
        if left_after.is_some() {
            let lease = world.store.bucket.lock().unwrap().get(LEASE).unwrap().body;
            assert_eq!(lease, r#"{"assembler":"","until":0,"checkpoint":true}"#);
            let state = world.store.bucket.lock().unwrap().get(CHECKPOINT).unwrap().body;
            assert!(String::from_utf8_lossy(&state).contains(&format!(r#""pieces":{pieces},"#)));
        }
    }
    assert_eq!(world.gif(), Some(world.film_of(12)));
    assert!(world.is_at_rest());
}

/// After the last frame, no time for one more is needed.
#[tokio::test]
async fn a_gif_that_has_all_its_frames_is_finished_unless_it_is_too_late() {
    for (frames, expected) in [(5, (None, 1)), (6, (Some(5), 0))] {
        let mut world = World::new();
        world.policy.spare_frames = 1;
        let claim = world.announced(frames).await;
        world.deadline = Some(world.store.clock.now().after(seconds(60)));
        let assembled = world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
        assert_eq!((assembled.left_after, assembled.built), expected, "{frames}");
    }
    let mut world = World::new();
    let claim = world.announced(2).await;
    world.policy.spare_frames = 0;
    for expected in [(Some(2), 0), (None, 1)] {
        world.deadline = Some(world.store.clock.now().after(seconds(60)));
        let assembled = world.assemble(&world.slow(seconds(30)), &claim).await.unwrap();
        assert_eq!((assembled.left_after, assembled.built), expected);
    }
    assert_eq!(world.gif(), Some(world.film_of(2)));
}

#[tokio::test]
async fn sets_that_make_no_gif_are_refused_by_name_and_the_gif_before_goes() {
    for (text, trouble, takes, reason) in [
        ("frame odd", None, 0, "odd"),
        ("frame 2", Some(Trouble::Begin), 0, "Begin"),
        ("frame 2", Some(Trouble::Finish), 0, "Finish"),
        ("frame 2", Some(Trouble::Suspend), 10, "Suspend"),
        ("frame 2", None, 100, "1 of 3 frames were assembled in the 100 s"),
    ] {
        let mut world = World::new();
        world.put("scripts/film/animation.json", r#"{"frames": 3}"#);
        for (file, text) in [("1.txt", "frame 1"), ("2.txt", text), ("3.txt", "frame 3")] {
            world.upload(file, text).await;
        }
        world.put_gif("another");
        let claim = world.keys("assemblies/").pop().unwrap();
        world.deadline = Some(world.store.clock.now().after(seconds(60)));
        let joiner = Joiner { trouble, ..world.slow(seconds(takes)) };
        let assembled = world.assemble(&joiner, &claim).await.unwrap();
        assert_eq!((assembled.built, assembled.status), (0, Status::Refused), "{reason}");
        let message = world.manifest().head.refusal.unwrap().reason.unwrap().message;
        assert!(message.starts_with(reason), "{message}");
        assert!(world.gif().is_none() && world.is_at_rest(), "{reason}");
    }
}

#[tokio::test]
async fn a_gif_goes_when_a_frame_cannot_be_drawn() {
    let world = World::new();
    world.upload("1.txt", "bad 1").await;
    world.put_gif("another");
    let claim = world.keys("assemblies/").pop().unwrap();
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.rounds, assembled.built, assembled.status), (2, 0, Status::Failed));
    assert!(world.gif().is_none() && world.is_at_rest());
}

#[tokio::test]
async fn a_frame_that_is_none_is_drawn_again_until_that_has_been_tried_often_enough() {
    for (attempts, begun) in [(0, 0), (2, 2), (5, 2), (3, 3), (4, 4)] {
        let world = World::new();
        let claim = world.announced(2).await;
        let version = world.store.bucket.lock().unwrap().head("scripts/film/1.txt").unwrap().etag;
        let frame = format!("frames/film/1@{version}-p1.png");
        world.put(&frame, "garbled");
        for attempt in 1..=attempts {
            world.put(&format!("retries/film/1@{version}-p1/{attempt}"), "");
        }
        for attempt in 1..=begun {
            world.put(&format!("frames/film/1@{version}-p1.begun-{attempt}"), "");
        }
        let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
        assert_eq!(assembled.built, 0);
        assert!(!world.keys("frames/").contains(&frame) && world.is_at_rest());
        let is_given_up = begun >= 3;
        let next = format!("retries/film/1@{version}-p1/{}", attempts + 1);
        assert_eq!(world.keys("retries/").contains(&next), !is_given_up, "{attempts}, {begun}");
        if is_given_up {
            let FrameState::Failed(fault) = &world.manifest().frames[0].state else { panic!() };
            let message = format!("{frame} is no frame, though drawn {begun} times: no picture");
            assert_eq!(fault.reason.as_ref().unwrap().message, message);
        } else {
            assert_eq!(assembled.status, Status::Rendering);
        }
    }
}

/// The assembler of the GIF died before it could record its version.
#[tokio::test]
async fn a_gif_of_this_set_that_nobody_has_named_is_named_and_one_in_its_place_is_built_anew() {
    let world = World::new();
    let claim = world.announced(2).await;
    world.put_gif(world.manifest().head.generation.as_str());
    assert!(!world.is_at_rest());
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.rounds, assembled.built), (1, 0));
    assert_eq!(world.gif().unwrap(), "GIF");
    assert!(world.is_at_rest());
    // Another client cuts it off, and keeps its metadata.
    {
        let mut bucket = world.store.bucket.lock().unwrap();
        let metadata = bucket.head(GIF).unwrap().metadata;
        let options = PutOptions { metadata, ..PutOptions::always() };
        bucket.put(world.store.clock.now(), GIF, "GI".into(), options).unwrap();
    }
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 1);
    assert_eq!(world.gif(), Some(world.film_of(2)));
    assert!(world.is_at_rest());
}

#[tokio::test]
async fn an_assembler_leaves_the_gif_to_the_holder_of_the_lease() {
    let world = World::new();
    let claim = world.announced(2).await;
    let until = world.store.clock.now().after(seconds(600)).0;
    let lease = format!(r#"{{"assembler":"another","until":{until}}}"#);
    world.put(LEASE, &lease);
    let claims = world.keys("assemblies/");
    let put_at: Vec<_> = claims.iter().map(|claim| world.modified(claim)).collect();
    world.later(seconds(1)).await;
    let requests = Arc::new(AtomicU64::new(0));
    let counted = requests.clone();
    world.meddle(move |_, _, _| _ = counted.fetch_add(1, Ordering::Relaxed));
    assert_eq!(world.try_assemble(&world.joiner(), &claim).await.unwrap(), None);
    assert_eq!(requests.load(Ordering::Relaxed), 1, "it looks at the lease and at nothing else");
    assert_eq!(world.store.bucket.lock().unwrap().get(LEASE).unwrap().body, lease);
    let is_old = |(claim, put_at): (&String, Timestamp)| world.modified(claim) == put_at;
    assert!(world.keys("assemblies/") == claims && claims.iter().zip(put_at).all(is_old), "nobody is woken");
    // Nor does it give it back when there is nothing to build.
    world.put_gif(world.manifest().head.generation.as_str());
    assert_eq!(world.try_assemble(&world.joiner(), &claim).await.unwrap(), None);
    assert_eq!(world.store.bucket.lock().unwrap().get(LEASE).unwrap().body, lease);
}

/// The other assembler began after the first check of the lease, which was free then.
#[tokio::test]
async fn an_assembler_leaves_the_gif_to_one_that_has_just_taken_the_lease() {
    let world = World::new();
    let claim = world.announced(2).await;
    let until = world.store.clock.now().after(seconds(600)).0;
    let lease = format!(r#"{{"assembler":"another","until":{until}}}"#);
    let taken = lease.clone();
    world.meddle(move |request, bucket, now| {
        if request == "get manifests/film.json" {
            bucket.put(now, LEASE, taken.clone().into(), PutOptions::always()).unwrap();
        }
    });
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.rounds, assembled.built), (1, 0));
    assert_eq!(world.store.bucket.lock().unwrap().get(LEASE).unwrap().body, lease);
}

/// `rayfold dev` was stopped while an assembler waited, and started again: no earlier assembler is alive.
#[tokio::test]
async fn a_restarted_platform_waits_for_no_assembler_of_before() {
    for (until, is_freed) in [(599, true), (600, false), (700, false)] {
        let mut world = World::new();
        world.announced(2).await;
        let now = world.store.clock.now();
        let lease =
            format!(r#"{{"assembler":"before","until":{},"checkpoint":true}}"#, now.after(seconds(until)).0);
        world.put(LEASE, &lease);
        assert!(world.visit().await.claimed);
        assert_eq!(
            world.store.bucket.lock().unwrap().get(LEASE).unwrap().body,
            lease,
            "a sweep like any other"
        );
        world.policy.is_fresh_start = true;
        world.deadline = Some(now.after(seconds(600)));
        assert!(world.visit().await.claimed);
        let expected = if is_freed { r#"{"assembler":"","until":0,"checkpoint":true}"# } else { &lease };
        assert_eq!(world.store.bucket.lock().unwrap().get(LEASE).unwrap().body, expected, "{until}");
    }
}

/// Otherwise a retry by the user would wait until the lease expires.
#[tokio::test]
async fn an_assembler_that_the_platform_has_given_up_holds_nobody_off() {
    for (assembler, is_freed) in [("given-up", true), ("another", false), ("", false)] {
        for end in [End::Died, End::TimedOut, End::Error("busy".into())] {
            let world = World::new();
            let claim = world.announced(2).await;
            let until = world.store.clock.now().after(seconds(600)).0;
            let lease = format!(r#"{{"assembler":"{assembler}","until":{until}}}"#);
            world.put(LEASE, &lease);
            world.record(&claim, None, end).await;
            let there = world.store.bucket.lock().unwrap().get(LEASE).unwrap().body;
            assert_eq!(there == r#"{"assembler":"","until":0}"#, is_freed, "{assembler}: {there:?}");
            assert!(is_freed || there == lease, "{assembler}: {there:?}");
        }
    }
}

/// The earlier attempt died when it had put the GIF.
#[tokio::test]
async fn the_lease_of_an_earlier_attempt_is_given_back_when_there_is_nothing_left_to_do() {
    let world = World::new();
    let claim = world.announced(2).await;
    world.put_gif(world.manifest().head.generation.as_str());
    let next = world.requests.load(Ordering::Relaxed);
    world.put(LEASE, &format!(r#"{{"assembler":"request-{next}","until":9000000000}}"#));
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 0);
    assert!(world.is_at_rest());
}

#[tokio::test]
async fn an_unfinished_gif_that_nobody_needs_any_more_is_given_up() {
    for is_gone in [false, true] {
        let mut world = World::new();
        world.policy.spare_frames = 1;
        let claim = world.announced(6).await;
        world.deadline = Some(world.store.clock.now().after(seconds(60)));
        world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
        assert_eq!(world.store.bucket.lock().unwrap().unfinished_uploads(), 1);
        world.deadline = None;
        if is_gone {
            // The whole bucket, except the keys that were left.
            for key in world.keys("") {
                if key != LEASE && key != CHECKPOINT {
                    world.store.bucket.lock().unwrap().delete(&key);
                }
            }
        } else {
            world.upload("1.txt", "bad 1").await;
        }
        let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
        assert_eq!(assembled.built, 0);
        assert!(world.keys("checkpoints/").is_empty() && !world.keys("frames/").contains(&LEASE.to_owned()));
        assert_eq!(world.store.bucket.lock().unwrap().unfinished_uploads(), 0, "{is_gone}");
    }
}

/// The assembler that found the lease taken was invoked for a manifest that the holder had not read.
#[tokio::test]
async fn an_assembler_looks_once_more_after_it_has_given_the_lease_back() {
    let world = World::new();
    let claim = world.announced(1).await;
    world.meddle({
        let mut done = false;
        move |request, bucket, now| {
            if request == "head manifests/film.json" && !std::mem::replace(&mut done, true) {
                bucket.put(now, "scripts/film/1.txt", "frame 2".into(), PutOptions::always()).unwrap();
                let version = bucket.head("scripts/film/1.txt").unwrap().etag;
                let frame = format!("frames/film/1@{version}-p1.png");
                bucket.put(now, &frame, "1:0:frame 2".into(), PutOptions::always()).unwrap();
                let manifest = bucket.get("manifests/film.json").unwrap().body;
                let manifest = [&manifest[..], b"\n"].concat();
                bucket.put(now, "manifests/film.json", manifest.into(), PutOptions::always()).unwrap();
            }
        }
    });
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!(assembled.built, 2);
    assert!(world.gif().unwrap().contains("frame 2"));
}

/// Another assembler ran when a frame could not be drawn. It deleted the GIF of the next set, found the lease taken,
/// and exited.
#[tokio::test]
async fn a_gif_that_goes_while_its_assembler_gives_the_lease_back_is_built_again() {
    let world = World::new();
    let claim = world.announced(2).await;
    let mut done = false;
    world.meddle(move |request, bucket, _| {
        if request == "delete frames/film/@assembler.json" && !std::mem::replace(&mut done, true) {
            assert!(bucket.delete(GIF));
        }
    });
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!(assembled.built, 2);
    assert_eq!(world.gif(), Some(world.film_of(2)));
    assert!(world.is_at_rest());
}

/// The manifest records an empty set, whatever it said before. Only if there is no manifest either, nothing is written.
#[tokio::test]
async fn a_set_whose_scripts_are_gone_is_empty_and_one_without_a_manifest_gets_one() {
    let world = World::new();
    let claim = world.announced(2).await;
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 1);
    for key in world.keys("scripts/") {
        world.store.bucket.lock().unwrap().delete(&key);
    }
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.status, world.manifest().head.status), (Status::Empty, Status::Empty));
    assert_eq!(world.gif(), None);
    let world = World::new();
    let claim = world.announced(2).await;
    world.store.bucket.lock().unwrap().delete("manifests/film.json");
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 1);
    assert_eq!(world.manifest().head.status, Status::Done);
}

/// When the assembler looked, a frame was gone. When it had committed that, the frame was there again. No other
/// invocation is triggered for this.
#[tokio::test]
async fn an_assembler_that_has_written_something_looks_again() {
    let world = World::new();
    let claim = world.announced(2).await;
    let frame = world.keys("frames/film/1@").pop().unwrap();
    let body = world.store.bucket.lock().unwrap().get(&frame).unwrap().body;
    world.store.bucket.lock().unwrap().delete(&frame);
    world.meddle(move |request, bucket, now| {
        if request == "put manifests/film.json" && bucket.head(&frame).is_err() {
            bucket.put(now, &frame, body.clone(), PutOptions::always()).unwrap();
        }
    });
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.built, assembled.status), (1, Status::Done));
    assert_eq!(world.gif(), Some(world.film_of(2)));
    assert!(world.is_at_rest());
}

#[tokio::test]
async fn a_lease_that_the_listing_does_not_show_is_not_asked_for() {
    let world = World::new();
    world.put_gif("late");
    let asked = Arc::new(AtomicU64::new(0));
    let counter = asked.clone();
    world.refuse(move |request| {
        counter.fetch_add(u64::from(request.ends_with(LEASE)), Ordering::Relaxed);
        None
    });
    let claim = format!("assemblies/film/1-{}.json", "0a".repeat(16));
    let assembled = world.assemble(&world.joiner(), &claim).await.unwrap();
    assert_eq!((assembled.rounds, world.gif()), (2, None));
    assert_eq!(asked.load(Ordering::Relaxed), 1, "the look with which every assembler begins");
}

/// Another client replaced the GIF by half of it, and then the set was another one for a moment.
#[tokio::test]
async fn the_gif_of_a_set_is_remembered_while_the_set_changes_and_changes_back() {
    let world = World::new();
    let claim = world.announced(2).await;
    world.assemble(&world.joiner(), &claim).await.unwrap();
    world.put_gif(world.manifest().head.generation.as_str());
    world.upload("1.txt", "frame 7").await;
    world.upload("1.txt", "frame 1").await;
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().built, 1);
    assert_eq!(world.gif(), Some(world.film_of(2)));
}

/// Both for a GIF that the assembler puts, and for one that it finds.
#[tokio::test]
async fn a_gif_is_named_in_no_manifest_but_the_one_that_was_read() {
    for is_found in [false, true] {
        let world = World::new();
        let claim = world.announced(2).await;
        if is_found {
            world.put_gif(world.manifest().head.generation.as_str());
        }
        let revision = world.manifest().head.revision;
        let mut done = false;
        world.meddle(move |request, bucket, now| {
            if request == "put manifests/film.json" && !std::mem::replace(&mut done, true) {
                super::folds::write_next(bucket, now);
            }
        });
        world.assemble(&world.joiner(), &claim).await.unwrap();
        assert_eq!(world.manifest().head.revision, revision + 1, "{is_found}");
        assert!(world.gif().is_some() && world.is_at_rest(), "{is_found}");
    }
}

/// The unreadable frame is deleted, although this renderer would draw another one.
#[tokio::test]
async fn a_frame_of_older_pixels_that_is_none_is_drawn_again() {
    let mut world = World::new();
    let claim = world.announced(1).await;
    let frame = world.keys("frames/film/1@").pop().unwrap();
    world.put(&frame, "garbled");
    world.policy = Policy::new(2);
    let mut asked = 0;
    let before = frame.clone();
    world.meddle(move |request, _, _| {
        asked += u32::from(request == format!("get {before}"));
        assert!(asked < 9, "read again and again");
    });
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().status, Status::Rendering);
    assert!(!world.keys("frames/").contains(&frame));
}

/// The last script by name was uploaded first.
#[tokio::test]
async fn a_set_is_quiet_when_its_newest_script_is() {
    let world = World::new();
    world.upload("2.txt", "frame 2").await;
    world.later(seconds(60)).await;
    world.upload("1.txt", "frame 1").await;
    let claim = world.keys("assemblies/").pop().unwrap();
    let quiet = world.modified("scripts/film/1.txt").after(world.policy.quiet);
    let left = quiet.since(world.store.clock.now());
    assert!(left > Duration::ZERO);
    assert_eq!(world.assemble(&world.joiner(), &claim).await.unwrap().waited, left);
}
