//! The pipeline with faults at a chosen moment: processes killed between two requests, replies lost, the invoker down,
//! events lost. After each fault the animation equals the uploaded set, or reports why it does not.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use super::stage::stores::on_every_store;
use super::stage::{SMALL_MB, Stage, big_scene, built, drawn, frames, scene};
use rayfold_local::StoreKind;
use rayfold_local::invoker::{Chaos, Fate, Fates, Settings};
use rayfold_local::observation::{Outcome, RequestKind, Seen};
use rayfold_local::routes::Function;
use rayfold_pipeline::manifest::{FrameState, Status};

async fn stage(store: StoreKind, change: impl FnOnce(&mut Settings)) -> Stage {
    super::stage::stage(store, Path::new(env!("CARGO_BIN_EXE_rayfold-render")).parent().unwrap(), change)
        .await
}

/// Returns a fate for the first `times` puts below a prefix by a function.
fn at_put(of: Function, prefix: &'static str, times: usize, fate: Fate) -> (Fates, Arc<AtomicUsize>) {
    let met = Arc::new(AtomicUsize::new(0));
    let count = met.clone();
    let fates: Fates = Arc::new(move |attempt, request| {
        let matches = attempt.function == of
            && request.kind == RequestKind::Put
            && request.key.starts_with(prefix)
            && count.fetch_add(1, Ordering::SeqCst) < times;
        if matches { fate } else { Fate::Pass }
    });
    (fates, met)
}

fn film() -> Vec<(&'static str, String)> {
    vec![("a.txt", scene(4.0)), ("b.txt", scene(8.0)), ("c.txt", scene(12.0)), frames(3)]
}

fn crashes(stage: &mut Stage) -> usize {
    let ended = stage.seen();
    ended.iter().filter(|o| matches!(&o.seen, Seen::Finished { outcome: Outcome::Crashed(_), .. })).count()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_render_process_killed_in_the_middle_is_made_good() {
    on_every_store(async |store| {
        for prefix in ["frames/", "manifests/", "assemblies/"] {
            for fate in [Fate::KillBefore, Fate::KillAfter, Fate::LoseAnswer] {
                let (fates, met) = at_put(Function::Render, prefix, 1, fate);
                let mut stage = stage(store, |settings| settings.fates = Some(fates)).await;
                stage.upload("film", &film()).await;
                stage.until_gif_of("film", &film()).await;
                // A manifest whose put took effect stays, even if the reply was lost. The next attempt at the event
                // finds its own commit, lists once more, and puts another one only if there are new results.
                let again = prefix != "manifests/" || fate == Fate::KillBefore;
                let met = met.load(Ordering::SeqCst);
                assert!(met > usize::from(again), "{fate:?} at {prefix}: written {met} times");
                let expected = usize::from(fate != Fate::LoseAnswer);
                assert_eq!(crashes(&mut stage), expected, "{fate:?} at {prefix}");
            }
        }
    })
    .await;
}

/// Returns a fate for the first put of a key with this ending.
fn at_put_of(ending: &'static str, fate: Fate) -> (Fates, Arc<AtomicUsize>) {
    let met = Arc::new(AtomicUsize::new(0));
    let count = met.clone();
    let fates: Fates = Arc::new(move |_, request| {
        let is_it = request.kind == RequestKind::Put
            && request.key.ends_with(ending)
            && count.fetch_add(1, Ordering::SeqCst) == 0;
        if is_it { fate } else { Fate::Pass }
    });
    (fates, met)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_in_bands_is_put_together_after_a_kill_of_any_invocation() {
    on_every_store(async |store| {
        for ending in [".cut-4", ".band-0.json", ".band", ".png"] {
            for fate in [Fate::KillBefore, Fate::KillAfter, Fate::LoseAnswer] {
                let (fates, met) = at_put_of(ending, fate);
                let mut stage = stage(store, |settings| {
                    settings.memory_mb = SMALL_MB;
                    settings.fates = Some(fates);
                })
                .await;
                let film = [("a.txt", big_scene(40.0)), frames(1)];
                stage.upload("film", &film).await;
                stage.until_gif_of("film", &film).await;
                assert!(met.load(Ordering::SeqCst) > 0, "{fate:?} at {ending}");
                let expected = usize::from(fate != Fate::LoseAnswer);
                assert_eq!(crashes(&mut stage), expected, "{fate:?} at {ending}");
            }
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_assembler_killed_while_writing_is_made_good() {
    on_every_store(async |store| {
        for fate in [Fate::KillBefore, Fate::KillAfter, Fate::LoseAnswer, Fate::SlowDown] {
            let (fates, _) = at_put(Function::Assemble, "animations/", 1, fate);
            let mut stage = stage(store, |settings| settings.fates = Some(fates)).await;
            stage.upload("film", &film()).await;
            stage.until_gif_of("film", &film()).await;
            let expected = usize::from(matches!(fate, Fate::KillBefore | Fate::KillAfter));
            assert_eq!(crashes(&mut stage), expected, "{fate:?}");
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_whose_function_dies_every_time_is_named() {
    on_every_store(async |store| {
        let fates: Fates = Arc::new(|attempt, request| {
            let is_it = attempt.function == Function::Render
                && request.kind == RequestKind::Put
                && request.key.starts_with("frames/film/b@");
            if is_it { Fate::KillBefore } else { Fate::Pass }
        });
        let mut stage = stage(store, |settings| settings.fates = Some(fates)).await;
        stage.upload("film", &film()).await;
        let manifest = stage.until("film", Status::Failed).await;
        let failed: Vec<_> = manifest
            .frames
            .iter()
            .filter_map(|frame| match &frame.state {
                FrameState::Failed(fault) => {
                    Some((frame.script.as_str(), &fault.reason.as_ref().unwrap().message))
                }
                _ => None,
            })
            .collect();
        assert_eq!(failed.len(), 1);
        assert_eq!(failed[0].0, "b");
        assert!(failed[0].1.contains("died in each of 3 attempts"), "{}", failed[0].1);
        assert_eq!(crashes(&mut stage), 3);
        assert_eq!(stage.gif_info("film").await, None);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_that_takes_too_long_is_named() {
    on_every_store(async |store| {
    let mut stage = stage(store, |settings| {
        settings.timeout = Duration::from_secs(3);
        settings.retry_pauses = vec![Duration::from_millis(10), Duration::from_millis(10)];
        // In bands it would be drawn. With more pixels it would be reported at once.
        settings.environment.push(("RAYFOLD_MAX_BANDS".into(), "1".into()));
    })
    .await;
    let endless = scene(4.0).replace("Screen 24 18", "Screen 4000 4000").replace("Trace", &mirrors());
    let files = vec![("slow.txt", endless), ("quick.txt", scene(8.0)), frames(2)];
    stage.upload("film", &files).await;
    let manifest = stage.until("film", Status::Failed).await;
    let frame = manifest.frames.iter().find(|frame| frame.script.as_str() == "slow").unwrap();
    let FrameState::Failed(fault) = &frame.state else { panic!("{frame:?}") };
    assert!(fault.reason.as_ref().unwrap().message.contains("timed out in each of 3 attempts"), "{fault:?}");
    let seen = stage.seen();
    let timeouts = seen
        .iter()
        .filter(|o| matches!(&o.seen, Seen::Finished { outcome: Outcome::Failed(body), .. } if body.contains("out of time")))
        .count();
    assert_eq!(timeouts, 3, "it stops in time to say so and is not killed");
    }).await;
}

/// Returns a script that takes a minute to trace.
fn mirrors() -> String {
    let mut script = String::new();
    for number in 0..400 {
        let (x, y) = (f64::from(number % 20), f64::from(number / 20));
        script.push_str(&format!("Sphere 900 {} {} -2000 .1 .1 .1 .5 .5 .5 1 1 1\n", x * 400.0, y * 400.0));
    }
    script + "Trace"
}

#[tokio::test(flavor = "multi_thread")]
async fn uploads_while_the_invoker_is_down_are_caught_up_with() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let mut files = film();
        stage.upload("film", &files[..2]).await;
        stage.settle().await;
        stage.platform.stop_invoker().await;
        files[1].1 = scene(9.0);
        stage.upload("film", &files[1..]).await;
        stage.upload("other", &film()).await;
        assert_eq!(stage.gif_info("other").await, None);
        stage.restart_invoker().await;
        stage.until_gif_of("film", &files).await;
        stage.until_gif_of("other", &film()).await;

        // The next start does not repeat completed work.
        stage.seen();
        stage.restart_invoker().await;
        stage.settle().await;
        let seen = stage.seen();
        assert_eq!((drawn(&seen), built(&seen)), (0, 0));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn lost_events_are_found_by_the_sweep() {
    on_every_store(async |store| {
        let mut stage = stage(store, |settings| {
            settings.chaos = Chaos { seed: 3, drop: 0.4, ..Chaos::default() };
            settings.sweep_every = Some(Duration::from_millis(500));
            settings.environment.push(("RAYFOLD_STUCK_AFTER_MS".into(), "1000".into()));
            // Wake-ups are events too, and are lost as often. With three attempts some frames would be given up.
            settings.environment.push(("RAYFOLD_ATTEMPTS".into(), "20".into()));
        })
        .await;
        let names: Vec<String> = (1..=12).map(|number| format!("f{number}.txt")).collect();
        let mut files: Vec<_> =
            names.iter().zip(1..).map(|(name, x)| (name.as_str(), scene(f64::from(x)))).collect();
        files.push(frames(12));
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        let woken: u64 =
            super::stage::logged(&stage.seen()).iter().filter_map(|line| line["woken"].as_u64()).sum();
        assert!(woken > 0, "with two fifths of the events lost something had to be woken");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_storm_of_everything_ends_in_the_right_gif() {
    on_every_store(async |store| {
        let seed = std::env::var("RAYFOLD_TEST_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(11);
        eprintln!("RAYFOLD_TEST_SEED={seed}");
        let random = std::sync::Mutex::new(fastrand::Rng::with_seed(seed));
        let fates: Fates = Arc::new(move |_, _| match random.lock().unwrap().u32(0..200) {
            0 => Fate::KillBefore,
            1 => Fate::KillAfter,
            2 | 3 => Fate::LoseAnswer,
            4..=7 => Fate::SlowDown,
            _ => Fate::Pass,
        });
        let mut stage = stage(store, |settings| {
            settings.concurrency = 8;
            settings.fates = Some(fates);
            // The assembler reads thirty frames. If one request in a hundred is fatal, all of three attempts fail in
            // one case of forty, and the animation is rightly rejected.
            settings.retry_pauses = vec![Duration::from_millis(50); 5];
            settings.sweep_every = Some(Duration::from_secs(1));
            settings.environment.push(("RAYFOLD_STUCK_AFTER_MS".into(), "3000".into()));
            settings.chaos = Chaos {
                seed,
                duplicate: 0.2,
                delay: 0.3,
                delay_up_to: Duration::from_millis(500),
                drop: 0.05,
                ..Chaos::default()
            };
        })
        .await;
        let names: Vec<String> = (1..=30).map(|number| format!("f{number}.txt")).collect();
        let mut files: Vec<_> =
            names.iter().zip(1..).map(|(name, x)| (name.as_str(), scene(f64::from(x)))).collect();
        files.push(frames(30));
        stage.upload("film", &files).await;
        for place in [3, 17, 29] {
            files[place].1 = scene(place as f64 / 2.0);
            stage.upload("film", &files[place..=place]).await;
        }
        stage.until_gif_of("film", &files).await;
    })
    .await;
}
