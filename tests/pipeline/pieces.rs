//! GIFs that several invocations build, one after the other, with the real encoder, stores and function binaries. Their
//! bytes equal those of a GIF made locally at once.
//!
//! The assemblers are configured to keep so much of their time free that each adds a frame and leaves the rest to the
//! next one.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::stage::stores::on_every_store;
use super::stage::{ALL_ITS_TIME, Stage, frames, logged};
use rayfold_local::StoreKind;
use rayfold_local::invoker::{Fate, Fates, Settings};
use rayfold_local::observation::{Observation, RequestKind};
use rayfold_local::routes::Function;
use rayfold_pipeline::store::{ListRequest, Store};

async fn stage(store: StoreKind, change: impl FnOnce(&mut Settings)) -> Stage {
    let functions = Path::new(env!("CARGO_BIN_EXE_rayfold-render")).parent().unwrap();
    let settings = |settings: &mut Settings| {
        settings.environment.push(("RAYFOLD_SPARE_FRAMES".into(), ALL_ITS_TIME.into()));
        change(settings);
    };
    super::stage::stage(store, functions, settings).await
}

/// Returns a scene with many colours, so that the encoder has state to keep.
fn clouds(size: (u32, u32), x: f64) -> String {
    let (width, height) = size;
    let (radius, left, top) = (height / 2, f64::from(width) / 2.0 + x, height / 2);
    format!(
        "Screen {width} {height}\nBackground .1 .2 .3\nMaterial dark  diffuse .2 .1 .1\nMaterial clay  diffuse .9 .7 .45   \
         noise 2.5 dark\nSphere {radius}  {left} {top} -{height}  clay\nIlight 1 1 1 .2 -.3 -1\nTrace\n"
    )
}

fn film(size: (u32, u32), count: usize) -> Vec<(&'static str, String)> {
    let names = ["a.txt", "b.txt", "c.txt", "d.txt", "e.txt", "f.txt", "g.txt", "h.txt"];
    let scripts = names.into_iter().take(count).zip(0_u8..);
    let mut files: Vec<_> = scripts.map(|(name, number)| (name, clouds(size, f64::from(number)))).collect();
    files.push(frames(count));
    files
}

/// Returns the numbers of frames after which GIFs were left unfinished, in order.
fn left(seen: &[Observation]) -> Vec<u64> {
    logged(seen).iter().filter_map(|line| line["left_after"].as_u64()).collect()
}

/// Checks that neither a checkpoint nor a lease is left.
async fn assert_tidy(stage: &Stage) {
    let checkpoints = stage.store().list(ListRequest::all("checkpoints/")).await.unwrap();
    assert_eq!(checkpoints.objects, []);
    assert!(stage.store().head("frames/film/@assembler.json").await.unwrap_err().is_not_found());
}

/// Each invocation adds one frame.
#[tokio::test(flavor = "multi_thread")]
async fn a_gif_in_pieces_has_the_bytes_of_one_in_one_piece() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let files = film((480, 360), 6);
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        let seen = stage.seen();
        assert_eq!((left(&seen), super::stage::built(&seen)), (vec![1, 2, 3, 4, 5], 1));
        assert_tidy(&stage).await;
    })
    .await;
}

/// Each in turn. The length of a WebP stands at its start, which is sent last.
#[tokio::test(flavor = "multi_thread")]
async fn files_of_all_kinds_in_pieces_have_the_bytes_of_those_in_one_piece() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let mut files = film((480, 360), 3);
        let settings = r#"{"frames": 3, "bounce": true, "outputs": ["webp", "gif", "apng", "y4m"]}"#;
        files.last_mut().unwrap().1 = settings.to_owned();
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        let seen = stage.seen();
        assert_eq!((left(&seen), super::stage::built(&seen)), ([1, 2, 3].repeat(4), 4));
        assert_tidy(&stage).await;
    })
    .await;
}

/// Returns a fate for the `number`th request of a kind below a prefix by assemblers.
/// From the third frame on there is no background.
#[tokio::test(flavor = "multi_thread")]
async fn a_gif_in_pieces_keeps_what_is_transparent() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let mut files = film((240, 180), 5);
        for (_, script) in &mut files[2..5] {
            *script = script.replace("Background .1 .2 .3", "Background none");
        }
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        assert_tidy(&stage).await;
    })
    .await;
}

fn at(number: usize, kind: RequestKind, prefix: &'static str, fate: Fate) -> (Fates, Arc<AtomicUsize>) {
    let met = Arc::new(AtomicUsize::new(0));
    let count = met.clone();
    let fates: Fates = Arc::new(move |attempt, request| {
        let is_one = attempt.function == Function::Assemble
            && request.kind == kind
            && request.key.starts_with(prefix)
            && count.fetch_add(1, Ordering::SeqCst) == number;
        if is_one { fate } else { Fate::Pass }
    });
    (fates, met)
}

#[tokio::test(flavor = "multi_thread")]
async fn an_assembler_that_dies_between_two_pieces_is_made_good() {
    on_every_store(async |store| {
        for (number, kind, prefix) in [
            (0, RequestKind::Put, "checkpoints/"),
            (1, RequestKind::Put, "checkpoints/"),
            (0, RequestKind::Get, "checkpoints/"),
            (0, RequestKind::Delete, "checkpoints/"),
            (1, RequestKind::Put, "frames/film/@assembler"),
            (2, RequestKind::Put, "frames/film/@assembler"),
            (0, RequestKind::Put, "animations/"),
        ] {
            for fate in [Fate::KillBefore, Fate::KillAfter, Fate::LoseAnswer] {
                let (fates, met) = at(number, kind, prefix, fate);
                let mut stage = stage(store, |settings| settings.fates = Some(fates)).await;
                let files = film((160, 120), 3);
                stage.upload("film", &files).await;
                stage.until_gif_of("film", &files).await;
                assert!(
                    met.load(Ordering::SeqCst) > number,
                    "{fate:?} at {kind:?} {number} of {prefix}: never came"
                );
                assert!(!left(&stage.seen()).is_empty(), "{fate:?} at {kind:?} {number} of {prefix}");
                assert_tidy(&stage).await;
            }
        }
    })
    .await;
}

/// The checkpoint is that of another set, or is malformed.
#[tokio::test(flavor = "multi_thread")]
async fn what_is_left_of_another_set_or_cannot_be_read_is_begun_anew() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let mut files = film((160, 120), 4);
        stage.upload("film", &files).await;
        // At the first checkpoint the first script changes. At the next one the checkpoint becomes malformed.
        let mut changed = 0;
        while changed < 2 {
            let _ = stage.next().await;
            if stage.store().head("checkpoints/film.state").await.is_ok() {
                match changed {
                    0 => {
                        files[0].1 = clouds((160, 120), 2.0);
                        stage.upload("film", &files[..1]).await;
                    }
                    _ => stage.put("checkpoints/film.state", "garbage").await,
                }
                changed += 1;
            }
        }
        stage.until_gif_of("film", &files).await;
        assert_tidy(&stage).await;
    })
    .await;
}
