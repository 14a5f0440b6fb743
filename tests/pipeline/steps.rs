//! The steps with the real renderer and encoder on a store in memory, with events delivered by hand: the contents of a
//! bucket after users' actions.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use rayfold_lambda::animator::MovieAnimator;
use rayfold_lambda::raytracer::RayTracer;
use rayfold_movie::{Container, Movie, Plays};
use rayfold_pipeline::failure::{End, Failure, Recorded};
use rayfold_pipeline::keys::{Animation, Key, Receipt};
use rayfold_pipeline::manifest::{FrameState, Manifest, Status};
use rayfold_pipeline::render::Outcome;
use rayfold_pipeline::retry::{Scope, retry};
use rayfold_pipeline::store::{ListRequest, MemoryStore, PutOptions, Store};
use rayfold_pipeline::sweep::Visit;
use rayfold_pipeline::{
    Clock, Invocation, Policy, Randomness, Result, Timestamp, assemble, record_failure, render_frame, sweep,
};

/// A clock that jumps to the end of each wait.
#[derive(Clone, Default)]
struct JumpingClock(Arc<AtomicU64>);

impl Clock for JumpingClock {
    fn now(&self) -> Timestamp {
        Timestamp(self.0.load(Ordering::Relaxed))
    }

    async fn sleep(&self, duration: Duration) {
        self.0.fetch_add(duration.as_millis() as u64, Ordering::Relaxed);
    }
}

struct World {
    store: MemoryStore<JumpingClock>,
    clock: JumpingClock,
    random: Randomness,
    policy: Policy,
    renderer: RayTracer,
    delivered: BTreeSet<String>,
    events: u64,
}

impl World {
    fn new() -> Self {
        let clock = JumpingClock::default();
        clock.0.store(1_000_000, Ordering::Relaxed);
        World {
            store: MemoryStore::new(clock.clone()),
            clock,
            random: Randomness::seeded(1),
            policy: Policy::new(rayfold_tracer::PIXEL_VERSION),
            renderer: RayTracer::default(),
            delivered: BTreeSet::new(),
            events: 0,
        }
    }

    async fn upload(&mut self, key: &str, text: &str) -> Outcome {
        self.store.put(key, text.to_owned().into(), PutOptions::always()).await.unwrap();
        self.event(key).await
    }

    async fn remove(&mut self, key: &str) -> Outcome {
        self.store.delete(key).await.unwrap();
        self.event(key).await
    }

    /// Delivers an event to the render function, and then the events that this causes.
    async fn event(&mut self, key: &str) -> Outcome {
        self.events += 1;
        let id = format!("request-{}", self.events);
        let invocation = Invocation::new(&self.store, &self.clock, &self.random, &self.policy, &id);
        // The functions run on runtimes that move futures between threads.
        let rendering = require_send(render_frame(&invocation, &self.renderer, key)).await;
        let outcome = rendering.unwrap().outcome;
        Box::pin(self.deliver()).await;
        outcome
    }

    /// Delivers the new keys below `parts/`, `retries/` and `assemblies/`.
    async fn deliver(&mut self) {
        for prefix in ["parts/", "retries/", "assemblies/"] {
            for listed in self.store.list(ListRequest::all(prefix)).await.unwrap().objects {
                if !self.delivered.insert(listed.key.clone()) {
                    continue;
                }
                if prefix == "assemblies/" {
                    let invocation =
                        Invocation::new(&self.store, &self.clock, &self.random, &self.policy, &listed.key);
                    require_send(assemble(&invocation, &MovieAnimator::default(), &listed.key))
                        .await
                        .unwrap();
                } else {
                    self.event(&listed.key).await;
                }
            }
        }
    }

    async fn put(&self, key: &str, body: impl Into<bytes::Bytes>) {
        self.store.put(key, body.into(), PutOptions::always()).await.unwrap();
    }

    /// Sweeps, and delivers the events that this causes. Returns the result for the animation `a`.
    async fn sweep(&mut self) -> Visit {
        self.events += 1;
        let id = format!("sweep-{}", self.events);
        let invocation = Invocation::new(&self.store, &self.clock, &self.random, &self.policy, &id);
        let swept = require_send(sweep(&invocation)).await.unwrap();
        let of_a = |(animation, visit)| (Animation::as_str(&animation) == "a").then_some(visit);
        let visit: Result<Visit> = swept.visits.into_iter().find_map(of_a).unwrap();
        // A key that is put again sends another event.
        self.delivered.retain(|key| key.starts_with("parts/"));
        let visit = visit.unwrap();
        if visit.claimed || visit.woken > 0 {
            Box::pin(self.deliver()).await;
        }
        visit
    }

    async fn manifest(&self, name: &str) -> Manifest {
        let animation = Animation::new(name).unwrap();
        let body = self.store.get(&animation.manifest()).await.unwrap().body;
        Manifest::decode(&animation, &body).unwrap()
    }

    async fn gif(&self, name: &str) -> Option<Vec<u8>> {
        self.store.get(&format!("animations/{name}.gif")).await.ok().map(|gif| gif.body.to_vec())
    }
}

fn require_send<F: Future + Send>(future: F) -> F {
    future
}

fn script(x: u32, traces: usize) -> String {
    let sphere = format!("Screen 16 12\nSphere 3 {x} 6 -9 1 .5 0 0 0 0\n");
    let more: String = (1..traces).map(|n| format!("Sphere 1 {} 2 -5 0 1 0 0 0 0\nTrace\n", 2 * n)).collect();
    format!("{sphere}Trace\n{more}")
}

/// Returns the GIF of the same scripts, made in one process.
fn local_gif(scripts: &[String], fps: f64) -> Vec<u8> {
    let mut file = Vec::new();
    let movie = Movie {
        size: (16, 12),
        frames: None,
        fps,
        plays: Plays::Endless,
        last_delay_cs: None,
        exact: false,
        alpha: false,
    };
    let mut encoding = rayfold_movie::Encoding::begin(&mut file, Container::Gif, movie).unwrap();
    for script in scripts {
        let parsed = rayfold_scene::parse("x.txt", script.as_bytes(), &rayfold_scene::Limits::default());
        for scene in parsed.script.unwrap().frames() {
            encoding.push(rayfold_tracer::render(&scene, &Default::default()).unwrap(), None).unwrap();
        }
    }
    encoding.finish().unwrap();
    file
}

#[tokio::test]
async fn a_folder_becomes_the_gif_that_local_rendering_gives() {
    let mut world = World::new();
    let scripts: Vec<String> = (1..=11).map(|n| script(n, 1)).collect();
    for (n, text) in scripts.iter().enumerate() {
        assert_eq!(world.upload(&format!("scripts/films/ü + 1/f{}.txt", n + 1), text).await, Outcome::Drawn);
    }
    let manifest = world.manifest("films/ü + 1").await;
    assert_eq!((manifest.head.status, manifest.head.done), (Status::Done, 11));
    let names: Vec<&str> = manifest.frames.iter().map(|frame| frame.script.as_str()).collect();
    assert_eq!(names[..3], ["f1", "f2", "f3"]);
    assert_eq!(names[10], "f11");
    assert!(world.gif("films/ü + 1").await.unwrap() == local_gif(&scripts, 10.0));
}

#[tokio::test]
async fn a_script_with_curves_is_split_into_its_frames() {
    let mut world = World::new();
    let text =
        "Screen 16 12\nSphere 3 (1:2 5:14) 6 -9 1 .5 0 0 0 0\nFrames 2 5\nTrace\nBackground 0 0 1\nTrace\n";
    world.upload("scripts/a/wave.txt", text).await;
    let manifest = world.manifest("a").await;
    assert_eq!((manifest.head.status, manifest.head.done), (Status::Done, 8));
    assert!(world.gif("a").await.unwrap() == local_gif(&[text.to_owned()], 10.0));
}

#[tokio::test]
async fn changes_deletions_and_repetitions() {
    let mut world = World::new();
    world.upload("scripts/a/animation.json", r#"{"frames": 2, "fps": 25}"#).await;
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    let waiting = world.manifest("a").await.head;
    assert_eq!((waiting.status, waiting.total, waiting.missing()), (Status::Waiting, 1, 1));
    assert_eq!(world.gif("a").await, None);
    world.upload("scripts/a/2.txt", &script(2, 1)).await;
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(1, 1), script(2, 1)], 25.0));

    let revision = world.manifest("a").await.head.revision;
    assert_eq!(world.upload("scripts/a/2.txt", &script(2, 1)).await, Outcome::Present);
    assert_eq!(world.manifest("a").await.head.revision, revision, "the same again changes nothing");

    world.upload("scripts/a/1.txt", &script(7, 1)).await;
    world.upload("scripts/a/3.txt", &script(3, 1)).await;
    let three = [script(7, 1), script(2, 1), script(3, 1)];
    assert!(world.gif("a").await.unwrap() == local_gif(&three, 25.0), "more than expected are all used");

    assert_eq!(world.remove("scripts/a/2.txt").await, Outcome::Gone);
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(7, 1), script(3, 1)], 25.0));

    for key in ["scripts/a/animation.json", "scripts/a/1.txt", "scripts/a/3.txt"] {
        world.remove(key).await;
    }
    assert_eq!(world.manifest("a").await.head.status, Status::Empty);
    assert_eq!(world.gif("a").await, None, "no script, no GIF");
}

#[tokio::test]
async fn a_script_with_several_traces_is_several_frames() {
    let mut world = World::new();
    assert!(
        matches!(world.upload("scripts/a/1.txt", &script(1, 3)).await, Outcome::Split(count) if count.get() == 3)
    );
    world.upload("scripts/a/2.txt", &script(2, 1)).await;
    let manifest = world.manifest("a").await;
    assert_eq!((manifest.head.scripts, manifest.head.total, manifest.head.status), (2, 4, Status::Done));
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(1, 3), script(2, 1)], 10.0));
}

#[tokio::test]
async fn a_bad_script_fails_the_animation_with_its_place_until_it_is_mended() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    assert!(world.gif("a").await.is_some());
    let bad = "Screen 16 12\n  Spere 1 2 3 4\nTrace\n";
    assert!(matches!(world.upload("scripts/a/2.txt", bad).await, Outcome::Faulty(_)));
    let manifest = world.manifest("a").await;
    assert_eq!(manifest.head.status, Status::Failed);
    let FrameState::Failed(fault) = &manifest.frames[1].state else { panic!() };
    let reason = fault.reason.as_ref().unwrap();
    assert!(reason.message.starts_with("2.txt:2:3: "), "{}", reason.message);
    assert_eq!((reason.diagnostics[0].line, reason.diagnostics[0].column), (2, 3));
    assert_eq!(world.gif("a").await, None, "never silently shorter");

    world.upload("scripts/a/2.txt", &script(2, 1)).await;
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(1, 1), script(2, 1)], 10.0));

    world.upload("scripts/a/animation.json", r#"{"fps": "ten"}"#).await;
    let head = world.manifest("a").await.head;
    assert_eq!(head.status, Status::Failed);
    assert!(head.settings.fault.unwrap().message.starts_with("animation.json:1:"));
    world.remove("scripts/a/animation.json").await;
    assert!(world.gif("a").await.is_some());

    let long = format!("scripts/a/{}.txt", "x".repeat(900));
    world.store.put(&long, script(3, 1).into(), PutOptions::always()).await.unwrap();
    world.upload("scripts/a/3.txt", &script(3, 1)).await;
    let head = world.manifest("a").await.head;
    assert_eq!((head.status, head.rejected.len()), (Status::Failed, 1));
    assert_eq!(head.rejected[0].problem, "the key is longer than 900 bytes");
}

#[tokio::test]
async fn frames_of_unlike_sizes_are_refused_by_name() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    world.upload("scripts/a/2.txt", &script(1, 1).replace("16 12", "12 16")).await;
    let head = world.manifest("a").await.head;
    assert_eq!(head.status, Status::Refused);
    let message = head.refusal.unwrap().reason.unwrap().message;
    assert!(message.contains("frame 2") && message.contains("12 x 16"), "{message}");
    assert_eq!(world.gif("a").await, None);
    world.upload("scripts/a/2.txt", &script(2, 1)).await;
    assert!(world.gif("a").await.is_some());
}

/// Returns the key that an invocation woken by this retry puts first.
fn begun(retry: &str) -> String {
    let Ok(Key::Retry { animation, name, tag, part, attempt }) = retry.parse() else { panic!("{retry}") };
    animation.receipt(&Receipt::Begun { name, tag, part, attempt })
}

/// Regression test: a frame that waited behind those of another animation was given up after three wake-ups, though no
/// attempt had begun.
#[tokio::test]
async fn a_frame_that_waits_in_the_queue_is_not_given_up() {
    let mut world = World::new();
    world.store.put("scripts/a/1.txt", script(1, 1).into(), PutOptions::always()).await.unwrap();
    let mut woken = 0;
    for sweep_number in 1..=30 {
        let before = world.policy.stuck_after * 8;
        world.clock.sleep(before).await;
        let id = format!("sweep-{sweep_number}");
        let invocation = Invocation::new(&world.store, &world.clock, &world.random, &world.policy, &id);
        let swept = require_send(sweep(&invocation)).await.unwrap();
        let visit = *swept.visits[0].1.as_ref().unwrap();
        assert_eq!(visit.given_up, 0, "sweep {sweep_number}");
        woken += visit.woken;
    }
    assert!((4..=10).contains(&woken), "it is woken on and on, but ever more seldom: {woken}");
    let retries = world.store.list(ListRequest::all("retries/")).await.unwrap().objects;
    let retry = &retries.last().unwrap().key;
    assert_eq!(world.event(retry).await, Outcome::Drawn);
    assert!(world.store.head(&begun(retry)).await.is_ok(), "the attempt was counted");
    assert!(world.gif("a").await.is_some());
}

#[tokio::test]
async fn the_sweep_wakes_what_was_lost_and_gives_up_in_the_end() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    for key in ["scripts/a/2.txt", "scripts/b//3.txt"] {
        world.store.put(key, script(2, 1).into(), PutOptions::always()).await.unwrap();
    }
    for attempt in 1..=4_u64 {
        let before = world.policy.stuck_after * 8;
        world.clock.sleep(before).await;
        let id = format!("sweep-{attempt}");
        let invocation = Invocation::new(&world.store, &world.clock, &world.random, &world.policy, &id);
        let swept = require_send(sweep(&invocation)).await.unwrap();
        assert_eq!(swept.rejected.len(), 1, "scripts/b//3.txt is named");
        let visit = *swept.visits[0].1.as_ref().unwrap();
        let expected = if attempt <= 3 { (1, 0) } else { (0, 1) };
        assert_eq!((visit.woken, visit.given_up), expected, "attempt {attempt}");
        let retries = world.store.list(ListRequest::all("retries/")).await.unwrap().objects;
        assert_eq!(retries.len() as u64, attempt.min(3));
        // Each wake-up starts an invocation, which is killed.
        for retry in &retries {
            world.store.put(&begun(&retry.key), "".into(), PutOptions::always()).await.unwrap();
        }
        world.delivered.extend(retries.into_iter().map(|listed| listed.key));
        world.deliver().await;
    }
    let manifest = world.manifest("a").await;
    assert_eq!(manifest.head.status, Status::Failed);
    let FrameState::Failed(fault) = &manifest.frames[1].state else { panic!() };
    assert_eq!(fault.reason.as_ref().unwrap().message, "no result in each of 3 attempts");

    let animation = Animation::new("a").unwrap();
    let invocation = Invocation::new(&world.store, &world.clock, &world.random, &world.policy, "retry");
    let retried = retry(&invocation, &animation, Scope::Failed).await.unwrap();
    assert_eq!((retried.deleted, retried.woken), (1, 1));
    let retries = world.store.list(ListRequest::all("retries/")).await.unwrap().objects;
    let key: Key = retries[0].key.parse().unwrap();
    assert!(matches!(key, Key::Retry { attempt, .. } if attempt.get() == 1), "the count starts again");
    assert_eq!(world.event(&retries[0].key).await, Outcome::Drawn);
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(1, 1), script(2, 1)], 10.0));
}

#[tokio::test]
async fn the_sweep_deletes_what_is_long_superseded() -> Result<()> {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 3)).await;
    world.upload("scripts/a/1.txt", &script(2, 1)).await;
    let count = async |world: &World, prefix: &str| {
        world.store.list(ListRequest::all(prefix)).await.unwrap().objects.len()
    };
    assert_eq!((count(&world, "frames/").await, count(&world, "parts/").await), (5, 3));
    for (days, frames, parts) in [(6, 5, 3), (2, 1, 0)] {
        world.clock.sleep(Duration::from_secs(days * 24 * 3600)).await;
        let invocation = Invocation::new(&world.store, &world.clock, &world.random, &world.policy, "sweep");
        sweep(&invocation).await?.visits[0].1.as_ref().unwrap();
        assert_eq!((count(&world, "frames/").await, count(&world, "parts/").await), (frames, parts));
    }
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(2, 1)], 10.0));
    Ok(())
}

/// Garbage, an empty file, a later schema. Regression test: uploads, sweeps, `status` and `retry` all failed until the
/// manifest was deleted by hand.
#[tokio::test]
async fn a_manifest_that_cannot_be_read_is_made_anew_and_set_aside() {
    let mut world = World::new();
    world.upload("scripts/b/1.txt", &script(1, 1)).await;
    let of_another = world.store.get("manifests/b.json").await.unwrap().body;
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    let whole = world.store.get("manifests/a.json").await.unwrap().body;
    let whole = std::str::from_utf8(&whole).unwrap();
    let broken: Vec<bytes::Bytes> = vec![
        "".into(),
        "garbage".into(),
        whole.replace("\"schema\":1", "\"schema\":2").into(),
        whole.replace("\"revision\":1,", &format!("\"revision\":{},", u64::MAX)).into(),
        whole.replace("\"state\":\"done\"", "\"state\":\"eaten\"").into(),
        of_another,
        vec![b'x'; 100_000].into(),
        [b"{\n".to_vec(), vec![b'x'; 100_000]].concat().into(),
    ];
    let expected = world.manifest("a").await;
    for (place, body) in broken.into_iter().enumerate() {
        assert_ne!(whole.as_bytes(), body, "{place}");
        for by_sweep in [true, false] {
            world.put("manifests/a.json", body.clone()).await;
            let version = world.store.head("manifests/a.json").await.unwrap().etag;
            if by_sweep {
                assert!(world.sweep().await.claimed, "{place}");
            } else {
                assert_eq!(world.event("scripts/a/1.txt").await, Outcome::Present, "{place}");
            }
            let healed = world.manifest("a").await;
            assert!(healed.agrees_with(&expected) && healed.head.revision < 3, "{place}: {healed:?}");
            let aside = format!("manifests/a.json~{version}");
            assert_eq!(world.store.get(&aside).await.unwrap().body, body, "{place}");
            world.store.delete(&aside).await.unwrap();
        }
        // The manifest that an event has rebuilt refers to no GIF, which the sweep detects.
        assert_eq!(world.sweep().await, Visit { claimed: true, ..Visit::default() }, "{place}");
        assert_eq!(world.sweep().await, Visit::default(), "{place}: nothing is left to do");
    }
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(1, 1)], 10.0));
}

#[tokio::test]
async fn an_error_receipt_that_cannot_be_read_is_made_anew() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    world.upload("scripts/a/2.txt", "Spere 1\n").await;
    let message = async |world: &World| match &world.manifest("a").await.frames[1].state {
        FrameState::Failed(fault) => fault.reason.as_ref().unwrap().message.clone(),
        state => panic!("{state:?}"),
    };
    let before = message(&world).await;
    let receipts = world.store.list(ListRequest::all("frames/a/2@")).await.unwrap().objects;
    world.put(&receipts[0].key, "{").await;
    world.upload("scripts/a/1.txt", &script(2, 1)).await;
    assert_eq!(world.manifest("a").await.head.status, Status::Failed);
    assert!(message(&world).await.starts_with("the error receipt cannot be read"));
    let visit = world.sweep().await;
    assert_eq!((visit.deleted, visit.woken), (1, 1));
    assert_eq!(message(&world).await, before);
    assert_eq!(world.sweep().await, Visit::default());
}

#[tokio::test]
async fn a_faulty_script_whose_name_starts_with_an_at_sign_is_named() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    world.upload("scripts/a/@2.txt", "Spere 1\n").await;
    let manifest = world.manifest("a").await;
    assert_eq!((manifest.head.status, manifest.head.pending), (Status::Failed, 0));
    let FrameState::Failed(fault) = &manifest.frames[1].state else { panic!() };
    assert!(fault.reason.as_ref().unwrap().message.starts_with("@2.txt:1:1: "));
    assert_eq!(world.sweep().await, Visit::default());
}

/// Regression test: `x@<etag of x>-p1.txt`, uploaded first, kept `x.txt` pending, because its receipt was mistaken for
/// one of `x`.
#[tokio::test]
async fn a_script_that_is_called_like_anothers_receipts_does_not_stand_for_it() {
    let mut world = World::new();
    world.put("scripts/a/x.txt", script(1, 1)).await;
    let version = world.store.head("scripts/a/x.txt").await.unwrap().etag;
    world.upload(&format!("scripts/a/x@{version}-p1.txt"), &script(2, 1)).await;
    world.upload(&format!("scripts/a/x@{version}-p2.txt"), &script(2, 3)).await;
    assert_eq!(world.event("scripts/a/x.txt").await, Outcome::Drawn);
    let head = world.manifest("a").await.head;
    assert_eq!((head.status, head.done), (Status::Done, 5));
}

#[tokio::test]
async fn what_is_too_large_is_named_and_not_read_whole() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    let large = format!("{{{}\"fps\": 20}}", " ".repeat(64 * 1024));
    world.upload("scripts/a/animation.json", &large).await;
    let head = world.manifest("a").await.head;
    assert_eq!(head.status, Status::Failed);
    let size = large.len();
    let message = head.settings.fault.unwrap().message;
    assert_eq!(message, format!("animation.json has {size} bytes: expected at most 65536"));
    world.upload("scripts/a/animation.json", &large[size - 64 * 1024..].replacen(' ', "{", 1)).await;
    assert_eq!(world.manifest("a").await.head.status, Status::Done, "at the limit it is read");

    world.renderer.limits.max_script_bytes = 200;
    let long = script(2, 1) + &"#".repeat(1_000_000);
    let Outcome::Faulty(reason) = world.upload("scripts/a/2.txt", &long).await else { panic!("it is drawn") };
    assert!(reason.message.contains("200 bytes"), "{}", reason.message);
}

/// Regression test: an invalid frame was rejected without its name, and `retry` had no effect.
#[tokio::test]
async fn a_frame_that_is_none_is_drawn_anew_and_in_the_end_named() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    let frames = world.store.list(ListRequest::all("frames/a/1@")).await.unwrap().objects;
    let key = &frames[0].key;
    let whole = world.store.get(key).await.unwrap().body;
    // It is a part of the next set.
    for (number, garbage) in
        ["".into(), "garbage".into(), whole.slice(..whole.len() / 2)].into_iter().enumerate()
    {
        world.put(key, garbage).await;
        world.upload("scripts/a/2.txt", &script(number as u32 + 2, 1)).await;
        world.deliver().await;
        assert_eq!(world.manifest("a").await.head.status, Status::Done, "{number}");
        let expected = local_gif(&[script(1, 1), script(number as u32 + 2, 1)], 10.0);
        assert!(world.gif("a").await.unwrap() == expected, "{number}");
        assert!(world.store.get(key).await.unwrap().body == whole, "{number}");
    }
    // This is the last attempt at a frame: from now on it is reported.
    world.put(key, "garbage").await;
    world.upload("scripts/a/2.txt", &script(9, 1)).await;
    world.deliver().await;
    let manifest = world.manifest("a").await;
    assert_eq!((manifest.head.status, manifest.head.failed), (Status::Failed, 1));
    let FrameState::Failed(fault) = &manifest.frames[0].state else { panic!() };
    let message = &fault.reason.as_ref().unwrap().message;
    assert!(message.starts_with(&format!("{key} is no frame, though drawn 3 times: ")), "{message}");

    let animation = Animation::new("a").unwrap();
    let invocation = Invocation::new(&world.store, &world.clock, &world.random, &world.policy, "retry");
    retry(&invocation, &animation, Scope::Failed).await.unwrap();
    world.delivered.clear();
    world.deliver().await;
    assert_eq!(world.manifest("a").await.head.status, Status::Done);
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(1, 1), script(9, 1)], 10.0));
}

/// Regression test: half of the GIF was considered current because of its metadata.
#[tokio::test]
async fn a_gif_that_was_cut_off_with_its_metadata_is_built_anew() {
    let mut world = World::new();
    world.upload("scripts/a/1.txt", &script(1, 2)).await;
    let key = "animations/a.gif";
    let whole = world.store.get(key).await.unwrap();
    let built = world.manifest("a").await.head.gif.expect("written down");
    assert_eq!(built.version, whole.info.etag);
    assert!(!world.sweep().await.claimed, "all is right");
    let cut = async |world: &World| {
        let metadata = whole.info.metadata.clone();
        let options = PutOptions { metadata, ..PutOptions::always() };
        world.store.put(key, whole.body.slice(..whole.body.len() / 2), options).await.unwrap();
    };
    cut(&world).await;
    assert!(world.sweep().await.claimed);
    assert!(world.gif("a").await.unwrap() == whole.body);
    // The set changes and changes back before a GIF of the other set is built.
    cut(&world).await;
    world.upload("scripts/a/animation.json", r#"{"frames": 9}"#).await;
    world.remove("scripts/a/animation.json").await;
    assert!(world.gif("a").await.unwrap() == whole.body);
}

/// One animation of millions of frames, or one script of them, could be drawn at the cost of other users.
#[tokio::test]
async fn of_an_animation_with_too_many_frames_no_more_are_drawn() {
    let mut world = World::new();
    world.policy.most_frames = Some(3);
    let Outcome::Faulty(reason) = world.upload("scripts/b/1.txt", &script(1, 4)).await else { panic!() };
    assert!(reason.message.starts_with("1.txt has 4 frames: expected at most 3"), "{}", reason.message);
    assert!(world.store.list(ListRequest::all("parts/b/")).await.unwrap().objects.is_empty());

    world.upload("scripts/a/1.txt", &script(1, 3)).await;
    assert_eq!(world.manifest("a").await.head.status, Status::Done, "at the limit");
    world.upload("scripts/a/2.txt", &script(2, 1)).await;
    let head = world.manifest("a").await.head;
    assert_eq!((head.status, head.total), (Status::Failed, 4));
    let message = head.excess.unwrap().message;
    assert!(message.starts_with("the animation has 4 frames: expected at most 3"), "{message}");
    assert_eq!(world.gif("a").await, None, "it is failed, not shortened");
    for number in 3..9 {
        let outcome = world.upload(&format!("scripts/a/{number}.txt"), &script(number, 1)).await;
        assert_eq!(outcome, Outcome::TooMany);
    }
    let head = world.manifest("a").await.head;
    assert_eq!((head.status, head.total, head.pending), (Status::Failed, 10, 6));
    world.clock.sleep(Duration::from_secs(48 * 3600)).await;
    assert_eq!(world.sweep().await, Visit::default(), "the sweep wakes none of them");

    for number in (1..9).filter(|number| *number != 4 && *number != 5) {
        world.remove(&format!("scripts/a/{number}.txt")).await;
    }
    assert_eq!(world.manifest("a").await.head.status, Status::Rendering);
    world.clock.sleep(Duration::from_secs(48 * 3600)).await;
    assert_eq!(world.sweep().await.woken, 2, "now there is room for them");
    assert!(world.gif("a").await.unwrap() == local_gif(&[script(4, 1), script(5, 1)], 10.0));
}

/// Regression test: settings that an older function could not read stayed a fault, though a newer function can read
/// them.
#[tokio::test]
async fn settings_that_could_not_be_read_are_read_again() {
    let mut world = World::new();
    world.upload("scripts/a/animation.json", r#"{"fps": 20}"#).await;
    world.upload("scripts/a/1.txt", &script(1, 1)).await;
    let manifest = world.store.get("manifests/a.json").await.unwrap().body;
    let text = std::str::from_utf8(&manifest).unwrap();
    let value = text.find("\"value\":{").unwrap();
    let end = value + text[value..].find('}').unwrap() + 1;
    let older = format!("{}\"fault\":{{\"message\":\"unknown\"}}{}", &text[..value], &text[end..]);
    world.put("manifests/a.json", older.replace("\"status\":\"done\"", "\"status\":\"failed\"")).await;
    assert!(world.manifest("a").await.head.settings.fault.is_some());
    world.sweep().await;
    let head = world.manifest("a").await.head;
    assert_eq!((head.status, head.settings.fault), (Status::Done, None));
}

/// Regression test: three restarts counted as three attempts. Then 75 s of a busy store made a frame fail for good, and
/// so did the next sweep.
#[tokio::test]
async fn restarts_are_no_attempts_at_a_frame() {
    let world = World::new();
    world.put("scripts/a/1.txt", script(1, 1)).await;
    let catch_up = Policy { stuck_after: Duration::ZERO, is_fresh_start: true, ..world.policy.clone() };
    let begun_attempts = async |world: &World| {
        let receipts = world.store.list(ListRequest::all("frames/a/")).await.unwrap().objects;
        receipts.iter().filter(|listed| listed.key.contains(".begun-")).count()
    };
    for restart in 1..=5 {
        let id = format!("catch-up-{restart}");
        let invocation = Invocation::new(&world.store, &world.clock, &world.random, &catch_up, &id);
        let swept = sweep(&invocation).await.unwrap();
        let visit = *swept.visits[0].1.as_ref().unwrap();
        assert_eq!((visit.woken, visit.given_up), (1, 0), "restart {restart}");
        assert_eq!(begun_attempts(&world).await, 0, "restart {restart}");
        // The woken invocation begins, and is ended by the next restart.
        let retries = world.store.list(ListRequest::all("retries/")).await.unwrap().objects;
        world.put(&begun(&retries.last().unwrap().key), "").await;
    }
    let key = "scripts/a/1.txt".to_owned();
    let failure =
        |end: End| Failure { key: key.clone(), version: None, attempts: 3, end, request_id: "r".to_owned() };
    for _ in 0..5 {
        let invocation = Invocation::new(&world.store, &world.clock, &world.random, &world.policy, "record");
        let recorded = record_failure(&invocation, &failure(End::Error("busy".into()))).await.unwrap();
        assert!(matches!(recorded, Recorded::Woken { .. } | Recorded::LeftToSweep), "{recorded:?}");
    }
    // Attempts that did begin count.
    for retry in world.store.list(ListRequest::all("retries/")).await.unwrap().objects {
        world.put(&begun(&retry.key), "").await;
    }
    let invocation = Invocation::new(&world.store, &world.clock, &world.random, &world.policy, "record");
    let recorded = record_failure(&invocation, &failure(End::Error("busy".into()))).await.unwrap();
    assert!(matches!(recorded, Recorded::GivenUp(_)), "{recorded:?}");
}
