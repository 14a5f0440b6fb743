//! Tests of the results of a render event, of its time limit, and of a retry by the user.

use super::*;
use crate::fakes::Paste;
use crate::keys::Band;
use crate::render::{Drawing, Files, Renderer, Source, Stages};
use crate::retry::Retried;

const SCRIPT: &str = "scripts/film/1.txt";

/// A renderer that draws for as long as `takes` says, or for ever.
struct Painter {
    clock: JumpingClock,
    takes: Option<Duration>,
    /// The time limits that the renderer was given, in order.
    limits: Mutex<Vec<Option<Duration>>>,
}

impl Painter {
    fn new(world: &World, takes: Option<Duration>) -> Self {
        Painter { clock: world.store.clock.clone(), takes, limits: Mutex::default() }
    }

    async fn take_time(&self) {
        match self.takes {
            Some(takes) => self.clock.sleep(takes).await,
            None => std::future::pending().await,
        }
    }
}

const DRAWER: InstantRenderer = InstantRenderer { bands: BANDS };

impl Renderer for Painter {
    type BandJoiner = Paste;

    fn most_bytes(&self) -> u64 {
        DRAWER.most_bytes()
    }

    fn most_file_bytes(&self) -> u64 {
        DRAWER.most_file_bytes()
    }

    async fn needed(&self, name: &ScriptName, script: Bytes, files: Files) -> Result<Vec<String>> {
        DRAWER.needed(name, script, files).await
    }

    async fn draw(&self, source: Source, left: Option<Duration>) -> Result<Drawing> {
        self.limits.lock().unwrap().push(left);
        self.take_time().await;
        DRAWER.draw(source, left).await
    }

    async fn draw_band(&self, source: Source, band: Band) -> Result<Result<Bytes, Reason>> {
        self.take_time().await;
        DRAWER.draw_band(source, band).await
    }

    async fn join(&self, source: Source, count: NonZeroU64) -> Result<Result<Paste, Reason>> {
        DRAWER.join(source, count).await
    }
}

impl World {
    async fn paint(&self, painter: &Painter, key: &str) -> Result<Rendered> {
        self.with(async |invocation| render_frame(invocation, painter, key).await).await
    }

    /// Makes each request take as many milliseconds as `takes` says; pauses take none.
    fn time(&mut self, takes: impl Fn(&str) -> u64 + Send + 'static) {
        self.policy.pause_cap = Duration::ZERO;
        let clock = self.store.clock.clone();
        self.refuse(move |request| {
            clock.0.fetch_add(takes(request), Ordering::Relaxed);
            None
        });
    }

    async fn again(&self, scope: Scope<'_>) -> Retried {
        self.with(async |invocation| retry(invocation, &World::film(), scope).await.unwrap()).await
    }
}

fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

#[tokio::test]
async fn an_invocation_says_where_its_time_went() {
    let mut world = World::new();
    world.put(SCRIPT, "frame 1");
    world.time(|request| match request {
        "get scripts/film/1.txt" => 10,
        "get manifests/film.json" => 1_000,
        "put manifests/film.json" => 7_000,
        _ if request.starts_with("list frames/film/1@") => 20,
        _ if request.starts_with("put frames/film/1@") => 300,
        _ => 0,
    });
    let painter = Painter::new(&world, Some(ms(50_000)));
    let stages = world.paint(&painter, SCRIPT).await.unwrap().stages;
    // The manifest is looked at, and written.
    let expected = Stages { read: ms(30), draw: ms(50_000), put: ms(300), fold: ms(8_000) };
    assert_eq!(stages, expected);
    let again = world.paint(&painter, SCRIPT).await.unwrap().stages;
    assert_eq!((again.read, again.draw, again.put), (ms(30), ms(0), ms(0)));

    world.put("scripts/film/animation.json", "{}");
    world.time(|request| match request {
        "head scripts/film/animation.json" => 10,
        "get manifests/film.json" => 1_000,
        _ => 0,
    });
    let stages = world.paint(&painter, "scripts/film/animation.json").await.unwrap().stages;
    assert_eq!((stages.read, stages.fold >= ms(1_000)), (ms(10), true), "{stages:?}");
}

#[tokio::test]
async fn all_that_is_drawn_of_a_frame_in_bands_is_drawing() {
    let mut world = World::new();
    let version = world.put(SCRIPT, "big frame 1");
    world.time(|_| 0);
    let painter = Painter::new(&world, Some(ms(50_000)));
    assert_eq!(world.paint(&painter, SCRIPT).await.unwrap().stages.draw, ms(50_000));
    let woken = |band: &str| format!("parts/film/1@{version}-p1/{band}.band-0.json");
    for band in ["1-of-3", "2-of-3"] {
        assert_eq!(world.paint(&painter, &woken(band)).await.unwrap().stages.draw, ms(50_000));
    }
    world.put(&format!("frames/film/1@{version}-p1.2-of-3.band"), "garbled");
    let last = world.paint(&painter, &woken("3-of-3")).await.unwrap();
    assert_eq!((last.outcome, last.stages.draw), (Outcome::Drawn, ms(100_000)), "one is drawn anew");
}

#[tokio::test]
async fn a_drawing_gets_a_time_limit_and_is_stopped_before_the_deadline() {
    let mut world = World::new();
    world.put(SCRIPT, "frame 1");
    let painter = Painter::new(&world, Some(Duration::ZERO));
    world.paint(&painter, SCRIPT).await.unwrap();
    let version = world.put(SCRIPT, "frame 2");
    let begin = world.store.clock.now();
    world.deadline = Some(begin.after(ms(10_000)));
    let painter = Painter { takes: None, ..painter };
    let error = world.paint(&painter, SCRIPT).await.unwrap_err();
    assert_eq!(error.to_string(), "out of time: 1 is not drawn after 9500 ms");
    assert_eq!(world.store.clock.now(), begin.after(ms(9_500)));
    assert_eq!(*painter.limits.lock().unwrap(), [None, Some(ms(9_500))]);
    assert!(!world.keys("frames/").iter().any(|key| key.contains(version.as_str())));
}

#[tokio::test]
async fn only_an_attempt_at_this_version_is_counted() {
    let world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    assert_eq!(world.render("retries/film/1@0-p1/2").await, Outcome::Drawn, "the current one");
    let frame = format!("frames/film/1@{version}-p1.png");
    assert_eq!(world.keys("frames/"), std::slice::from_ref(&frame));
    world.store.bucket.lock().unwrap().delete(&frame);
    assert_eq!(world.render(&format!("retries/film/1@{version}-p1/2")).await, Outcome::Drawn);
    assert_eq!(world.keys("frames/"), [format!("frames/film/1@{version}-p1.begun-2"), frame]);
}

#[tokio::test]
async fn of_an_animation_with_too_many_frames_no_more_are_drawn() {
    let mut world = World::new();
    world.policy.most_frames = Some(2);
    assert_eq!(world.upload("1.txt", "frame 1").await, Outcome::Drawn);
    assert_eq!(world.upload("2.txt", "frame 2").await, Outcome::Drawn);
    // No manifest knows yet.
    assert_eq!(world.upload("3.txt", "frame 3").await, Outcome::Drawn);
    assert_eq!(world.upload("4.txt", "frame 4").await, Outcome::TooMany);
    assert_eq!((world.manifest().head.status, world.manifest().head.total), (Status::Failed, 4));
    assert!(!world.keys("frames/").iter().any(|key| key.starts_with("frames/film/4@")));
}

#[tokio::test]
async fn a_script_has_at_most_as_many_frames_as_an_animation_may() {
    for (frames, expected) in [(2, true), (3, true), (4, false), (5, false)] {
        let mut world = World::new();
        world.policy.most_frames = Some(3);
        let outcome = world.upload(&format!("{frames}.txt"), &format!("split {frames} 1")).await;
        match outcome {
            Outcome::Split(count) => assert!(expected && count.get() == frames),
            Outcome::Faulty(reason) => {
                let message = format!("{frames}.txt has {frames} frames: expected at most 3");
                assert!(!expected && reason.message.starts_with(&message), "{reason:?}");
            }
            other => panic!("{other:?}"),
        }
        let has_error = world.keys("frames/").iter().any(|key| key.ends_with(".error.json"));
        assert_eq!(has_error, !expected, "{frames}");
    }
}

/// The events of these parts came while another version of the script was current, and drew nothing.
#[tokio::test]
async fn parts_of_a_split_from_before_the_upload_are_woken_anew_if_nothing_came_of_them() {
    let world = World::new();
    let version = world.upload("1.txt", "split 4 1").await;
    assert!(matches!(version, Outcome::Split(_)));
    let parts = world.keys("parts/");
    assert_eq!(world.render(&parts[0]).await, Outcome::Drawn);
    world.later(ms(9_000)).await;
    world.put(SCRIPT, "split 4 1");
    world.later(ms(9_000)).await;
    world.put(&parts[2], "{}");
    world.later(ms(9_000)).await;
    let before: Vec<_> = parts.iter().map(|key| world.modified(key)).collect();
    assert_eq!(world.render(SCRIPT).await, Outcome::Present);
    let is_new: Vec<_> = parts.iter().zip(before).map(|(key, before)| world.modified(key) > before).collect();
    assert_eq!(is_new, [false, true, false, true]);
}

#[tokio::test]
async fn parts_are_listed_only_while_some_are_to_come() {
    let world = World::new();
    world.upload("1.txt", "split 2 1").await;
    let (asked, parts) = (Arc::new(AtomicU64::new(0)), world.keys("parts/"));
    let counter = asked.clone();
    world.refuse(move |request| {
        counter.fetch_add(u64::from(request.starts_with("list parts/")), Ordering::Relaxed);
        None
    });
    for (drawn, expected) in [(None, 1), (Some(0), 1), (Some(1), 0)] {
        if let Some(place) = drawn {
            assert_eq!(world.render(&parts[place as usize]).await, Outcome::Drawn);
        }
        assert_eq!(world.render(SCRIPT).await, Outcome::Present);
        assert_eq!(asked.swap(0, Ordering::Relaxed), expected, "{drawn:?}");
    }
}

/// Makes an animation of a frame, a fault and a pending frame, and of a script with a frame and a fault.
async fn mixed(world: &World) {
    world.upload("1.txt", "frame 1").await;
    world.upload("2.txt", "bad 2").await;
    world.put("scripts/film/3.txt", "hang 3");
    let version = world.put("scripts/film/4.txt", "split 2 4");
    world.render("scripts/film/4.txt").await;
    world.render(&format!("parts/film/4@{version}-p1/1.json")).await;
    world.put(&format!("frames/film/4@{version}-p1/2.error.json"), r#"{"message":"why"}"#);
}

/// Returns the remaining results, without versions.
fn results(world: &World) -> Vec<String> {
    let short = |key: String| {
        let (name, rest) = key["frames/film/".len()..].split_once('@').unwrap();
        format!("{name}{}", &rest[rest.find("-p1").unwrap() + 3..])
    };
    world.keys("frames/").into_iter().map(short).collect()
}

#[tokio::test]
async fn what_is_drawn_again_is_what_was_asked_for() {
    let name = |name: &str| ScriptName::new(name).unwrap();
    let (one, four) = (name("1"), name("4"));
    let all = ["1.png", "2.error.json", "4.split-2", "4/1.png", "4/2.error.json"];
    for (what, scope, gone, woken) in [
        ("failed", Scope::Failed, &["2.error.json", "4/2.error.json"][..], 3),
        ("one", Scope::Frame(&one, None), &["1.png"], 1),
        ("a part", Scope::Frame(&four, NonZeroU64::new(1)), &["4/1.png"], 1),
        ("no such part", Scope::Frame(&one, NonZeroU64::new(1)), &[], 0),
        ("all", Scope::All, &["1.png", "2.error.json", "4/1.png", "4/2.error.json"], 5),
    ] {
        let world = World::new();
        mixed(&world).await;
        assert_eq!(results(&world), all);
        let retried = world.again(scope).await;
        let expected = Retried { deleted: gone.len() as u64, woken, reassembled: false };
        assert_eq!(retried, expected, "{what}");
        let left: Vec<_> = all.into_iter().filter(|key| !gone.contains(key)).collect();
        assert_eq!(results(&world), left, "{what}");
        assert_eq!(world.keys("retries/").len() as u64, woken, "{what}");
    }
}

#[tokio::test]
async fn a_refusal_goes_when_the_set_is_to_be_assembled_again() {
    let world = World::new();
    world.upload("1.txt", "frame 1").await;
    let refusal = format!("frames/film/@{}.error.json", world.manifest().head.generation.as_str());
    world.put(&refusal, r#"{"message":"why"}"#);
    let retried = world.again(Scope::Failed).await;
    assert_eq!(retried, Retried { deleted: 1, woken: 0, reassembled: true });
    assert!(!world.keys("frames/").contains(&refusal));
}

/// If no result was deleted, the manifest is unchanged, and the invocation that draws folds.
#[tokio::test]
async fn a_retry_folds_only_what_it_has_changed() {
    let world = World::new();
    world.put(SCRIPT, "hang 1");
    let retried = world.again(Scope::Failed).await;
    assert_eq!(retried, Retried { deleted: 0, woken: 1, reassembled: false });
    assert_eq!(world.keys("manifests/"), [""; 0]);
}

/// Another invocation has drawn the frame meanwhile.
#[tokio::test]
async fn a_frame_is_put_only_where_there_is_none() {
    let world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    let frame = format!("frames/film/1@{version}-p1.png");
    let key = frame.clone();
    world.meddle(move |request, bucket, now| {
        if request == format!("put {key}") && bucket.head(&key).is_err() {
            bucket.put(now, &key, "another's".into(), PutOptions::always()).unwrap();
        }
    });
    world.render(SCRIPT).await;
    assert_eq!(world.store.bucket.lock().unwrap().get(&frame).unwrap().body, "another's");
}

/// Otherwise a frame that ends each invocation that draws it would be triggered for ever.
#[tokio::test]
async fn an_attempt_counts_when_it_has_begun_however_it_ends() {
    let mut world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    world.deadline = Some(world.store.clock.now().after(ms(10_000)));
    let painter = Painter::new(&world, None);
    let error = world.paint(&painter, &format!("retries/film/1@{version}-p1/2")).await.unwrap_err();
    assert!(error.is_out_of_time(), "{error:?}");
    assert_eq!(world.keys("frames/"), [format!("frames/film/1@{version}-p1.begun-2")]);
}

#[tokio::test]
async fn of_an_animation_with_too_many_frames_no_parts_are_drawn_either() {
    let mut world = World::new();
    world.policy.most_frames = Some(2);
    // The manifest is written again at once, not when it is old.
    world.policy.fresh = Duration::ZERO;
    world.upload("1.txt", "split 2 1").await;
    world.upload("2.txt", "frame 2").await;
    assert_eq!(world.manifest().head.total, 3);
    for part in world.keys("parts/") {
        assert_eq!(world.render(&part).await, Outcome::TooMany);
    }
}

/// The part has an error receipt.
#[tokio::test]
async fn parts_that_cannot_be_drawn_are_not_woken_anew() {
    let world = World::new();
    world.upload("1.txt", "split 2 1").await;
    let parts = world.keys("parts/");
    let error = parts[1].replacen("parts/", "frames/", 1).replacen("/2.json", "/2.error.json", 1);
    world.put(&error, r#"{"message":"why"}"#);
    world.later(ms(9_000)).await;
    world.put(SCRIPT, "split 2 1");
    world.later(ms(9_000)).await;
    let before: Vec<_> = parts.iter().map(|key| world.modified(key)).collect();
    world.render(SCRIPT).await;
    let is_new: Vec<_> = parts.iter().zip(before).map(|(key, before)| world.modified(key) > before).collect();
    assert_eq!(is_new, [true, false]);
}

#[tokio::test]
async fn all_is_drawn_again_whatever_pixels_there_are() {
    let mut world = World::new();
    let version = world.put(SCRIPT, "frame 1");
    world.render(SCRIPT).await;
    world.policy = Policy::new(2);
    world.put(&format!("frames/film/1@{version}-p2.png"), "frame");
    let retried = world.again(Scope::All).await;
    assert_eq!(retried, Retried { deleted: 2, woken: 1, reassembled: false });
    assert_eq!(world.render(&world.keys("retries/")[0]).await, Outcome::Drawn);
}

#[tokio::test]
async fn the_attempts_at_other_parts_are_still_counted_when_one_is_drawn_again() {
    let world = World::new();
    world.upload("1.txt", "split 2 1").await;
    let version = world.store.bucket.lock().unwrap().head(SCRIPT).unwrap().etag;
    let begun = |number: u64| format!("frames/film/1@{version}-p1/{number}.begun-1");
    world.put(&begun(1), "");
    world.put(&begun(2), "");
    let name = ScriptName::new("1").unwrap();
    world.again(Scope::Frame(&name, NonZeroU64::new(1))).await;
    assert_eq!(world.keys(&format!("frames/film/1@{version}-p1/")), [begun(2)]);
}

/// Formerly all receipts were deleted before the first frame was triggered. After an interruption no frame was drawn
/// before a sweep.
#[tokio::test]
async fn a_retry_that_is_cut_off_leaves_few_frames_that_nobody_draws_and_the_next_one_draws_those() {
    let mut world = World::new();
    world.policy.concurrency = 1;
    for number in 1..=3 {
        world.upload(&format!("{number}.txt"), &format!("frame {number}")).await;
    }
    world.refuse(|request| {
        let is_it = request.starts_with("put retries/film/2@");
        is_it.then(|| Error::Refused { key: "k".into(), source: "cut off".into() })
    });
    let cut_off = world.with(async |invocation| retry(invocation, &World::film(), Scope::All).await).await;
    assert!(cut_off.is_err());
    world.refuse(|_| None);
    let is_there = |number: u32| !world.keys(&format!("frames/film/{number}@")).is_empty();
    assert_eq!([1, 2, 3].map(is_there), [false, false, true]);
    let [woken] = &world.keys("retries/")[..] else { panic!("{:?}", world.keys("retries/")) };
    assert_eq!(world.render(woken).await, Outcome::Drawn);
    assert_eq!(world.again(Scope::Failed).await.woken, 1);
    let last = world.keys("retries/film/2@").remove(0);
    assert_eq!(world.render(&last).await, Outcome::Drawn);
    assert_eq!(world.manifest().head.status, Status::Done);
}
