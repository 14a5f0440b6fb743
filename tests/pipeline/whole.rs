//! The pipeline from end to end: uploads through the SDK, events through the store's webhook, unmodified function
//! binaries.

use std::path::Path;
use std::time::Duration;

use super::stage::stores::on_every_store;
use super::stage::{
    SMALL_MB, Stage, big_scene, built, drawn, frames, outcomes, requests, scene, scene_of_a_model,
};
use rayfold_lambda::raytracer::RayTracer;
use rayfold_local::StoreKind;
use rayfold_local::invoker::{Chaos, Listing, Settings};
use rayfold_local::observation::{RequestKind, Seen};
use rayfold_local::routes::Function;
use rayfold_pipeline::keys::ScriptName;
use rayfold_pipeline::manifest::{FrameState, Manifest, Reason, Status};
use rayfold_pipeline::store::{ListRequest, Store};
use rayfold_pipeline::{Drawing, Files, Renderer, Source};
use rayfold_scene::parse_settings;

async fn stage(store: StoreKind, change: impl FnOnce(&mut Settings)) -> Stage {
    let functions = Path::new(env!("CARGO_BIN_EXE_rayfold-render")).parent().unwrap();
    assert!(Path::new(env!("CARGO_BIN_EXE_rayfold-assemble")).parent() == Some(functions));
    super::stage::stage(store, functions, change).await
}

fn failures(manifest: &Manifest) -> Vec<(&str, &Reason)> {
    let failed = manifest.frames.iter().filter_map(|frame| match &frame.state {
        FrameState::Failed(fault) => Some((frame.script.as_str(), fault.reason.as_ref().unwrap())),
        _ => None,
    });
    failed.collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn hello_uploaded_file_by_file_is_the_gif_that_is_made_locally() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/hello");
        let mut files = Vec::new();
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name: &'static str = entry.file_name().into_string().unwrap().leak();
            files.push((name, std::fs::read_to_string(entry.path()).unwrap()));
        }
        assert_eq!(files.len(), 51, "50 scripts and animation.json");
        for file in &files {
            stage.upload("hello", std::slice::from_ref(file)).await;
        }
        stage.until_gif_of("hello", &files).await;
        let seen = stage.seen();
        assert_eq!((drawn(&seen), built(&seen)), (50, 1));
    })
    .await;
}

/// The model, the library of its colours and the scripts, in an order in which each comes after what needs it.
#[tokio::test(flavor = "multi_thread")]
async fn files_beside_scripts_may_come_late_change_and_go() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let model =
            |x: f64| format!("mtllib corner.mtl\nusemtl a\nv {x} 2 -9\nv 20 2 -9\nv 12 16 -9\nf 1 2 3\n");
        let color = |red: f64| format!("newmtl a\nKd {red} .6 .2\n");
        let mut files = vec![
            ("f1.txt", scene_of_a_model(0.1)),
            ("f2.txt", scene_of_a_model(0.4)),
            ("f3.txt", scene(12.0)),
            ("corner.obj", model(4.0)),
            ("corner.mtl", color(0.9)),
        ];
        stage.upload("film", &files[..3]).await;
        let manifest = stage.until("film", Status::Waiting).await;
        assert_eq!((manifest.head.done, manifest.head.waiting), (1, 2), "{manifest:?}");
        let waits = manifest.frames.iter().find_map(|frame| match &frame.state {
            FrameState::Waiting(fault) => fault.reason.as_ref(),
            _ => None,
        });
        let message = &waits.unwrap().message;
        assert_eq!(message, "f1.txt:4:6: there is no file `corner.obj` in the script's folder");

        // Without its library the model has the colour .8, and with it the scripts are drawn again.
        stage.upload("film", &files[3..4]).await;
        stage.until_gif_of("film", &files[..4]).await;
        stage.upload("film", &files[4..]).await;
        stage.until_gif_of("film", &files).await;
        stage.seen();

        files[4].1 = color(0.2);
        stage.upload("film", &files[4..]).await;
        stage.until_gif_of("film", &files).await;
        let seen = stage.seen();
        assert_eq!((drawn(&seen), built(&seen)), (2, 1), "{:?}", outcomes(&seen));

        // What no script names is nothing.
        stage.upload("film", &[("notes.md", "later".to_owned())]).await;
        stage.settle().await;
        assert_eq!(outcomes(&stage.seen()).get("nothing that is read"), Some(&1));

        stage.remove("film", "corner.obj").await;
        stage.until("film", Status::Waiting).await;
        files[3].1 = model(6.0);
        stage.upload("film", &files[3..4]).await;
        stage.until_gif_of("film", &files).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn only_what_changed_is_drawn_again() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let mut files = vec![("f1.txt", scene(8.0)), ("f2.txt", scene(12.0)), ("f10.txt", scene(16.0))];
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        assert_eq!(drawn(&stage.seen()), 3);

        // One changed: one frame is drawn, and a new GIF built.
        files[1].1 = scene(13.0);
        stage.upload("film", &files[1..2]).await;
        stage.until_gif_of("film", &files).await;
        let seen = stage.seen();
        assert_eq!((drawn(&seen), built(&seen)), (1, 1));

        // One deleted: the GIF is built without it.
        let deleted = files.remove(0);
        stage.remove("film", deleted.0).await;
        let manifest = stage.until_gif_of("film", &files).await;
        assert_eq!(manifest.head.total, 2);
        let seen = stage.seen();
        assert_eq!((drawn(&seen), built(&seen)), (0, 1));

        // One added later.
        files.push(("f11.txt", scene(20.0)));
        stage.upload("film", &files[2..]).await;
        stage.until_gif_of("film", &files).await;
        assert_eq!(drawn(&stage.seen()), 1);

        // A repeated upload: no work, no new GIF, and at most four requests per event.
        let before = stage.gif_info("film").await.unwrap();
        stage.upload("film", &files).await;
        stage.settle().await;
        let seen = stage.seen();
        assert_eq!((drawn(&seen), built(&seen)), (0, 0));
        assert_eq!(outcomes(&seen).get("present"), Some(&3));
        for requests in requests(&seen, Function::Render) {
            assert!(requests.billed() <= 4, "{requests:?}");
        }
        assert_eq!(stage.gif_info("film").await.unwrap(), before);

        // The last one deleted: no GIF.
        for (name, _) in &files {
            stage.remove("film", name).await;
        }
        stage.until("film", Status::Empty).await;
        assert_eq!(stage.gif_info("film").await, None);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_trace_of_a_script_is_a_frame() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let three = format!("{}Sphere 3 6 9 -9 .9 0 0 0 0 0\nTrace\nBackground 0 0 0\nTrace\n", scene(12.0));
        let files = vec![("a.txt", three), ("b.txt", scene(4.0)), frames(4)];
        stage.upload("traces", &files).await;
        let manifest = stage.until_gif_of("traces", &files).await;
        assert_eq!((manifest.head.scripts, manifest.head.total), (2, 4));
        let seen = stage.seen();
        assert_eq!(drawn(&seen), 4);
        assert_eq!(outcomes(&seen).get("split into 3"), Some(&1));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_script_is_named_with_its_place_until_it_is_mended() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let mut files = vec![
            ("good.txt", scene(8.0)),
            ("bad.txt", scene(9.0).replace("Sphere 6", "  Spere 6")),
            frames(2),
        ];
        stage.upload("film", &files).await;
        let manifest = stage.until("film", Status::Failed).await;
        let failures = failures(&manifest);
        assert_eq!(failures.len(), 1);
        let (script, reason) = failures[0];
        assert_eq!(script, "bad");
        let diagnostic = &reason.diagnostics[0];
        assert_eq!((diagnostic.line, diagnostic.column), (3, 3), "{diagnostic:?}");
        assert_eq!(stage.gif_info("film").await, None, "a failed animation is never a shorter GIF");
        let seen = stage.seen();
        assert!(
            seen.iter().all(|o| !matches!(&o.seen, Seen::Finished { outcome, .. } if !outcome.is_success()))
        );

        files[1].1 = scene(9.0);
        stage.upload("film", &files[1..2]).await;
        stage.until_gif_of("film", &files).await;
        assert_eq!(drawn(&stage.seen()), 1);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_invalid_animation_json_fails_the_animation_until_it_is_mended() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let mut files = vec![("f.txt", scene(8.0)), ("animation.json", "{ \"frmes\": 1 }".to_owned())];
        stage.upload("film", &files).await;
        let manifest = stage.until("film", Status::Failed).await;
        assert!(manifest.head.settings.fault.is_some());
        assert_eq!(stage.gif_info("film").await, None);
        files[1] = frames(1);
        stage.upload("film", &files[1..]).await;
        stage.until_gif_of("film", &files).await;
    })
    .await;
}

/// Without a frame that is drawn again; the second frame is transparent.
#[tokio::test(flavor = "multi_thread")]
async fn files_are_made_and_go_as_the_settings_ask() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let settings =
            |outputs: &str| format!("{{\"frames\": 2, \"bounce\": true, \"outputs\": [{outputs}]}}");
        let clear = scene(9.0).replace("Background .1 .2 .3", "Background none");
        let mut files = vec![
            ("a.txt", scene(8.0)),
            ("b.txt", clear),
            ("animation.json", settings("\"gif\", \"webp\", \"apng\", \"y4m\"")),
        ];
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        assert_eq!(drawn(&stage.seen()), 2);
        for outputs in ["\"apng\"", "\"apng\", \"gif\"", "\"webp\""] {
            files[2].1 = settings(outputs);
            stage.upload("film", &files[2..]).await;
            while stage.manifest("film").await.unwrap().head.settings.value
                != parse_settings("animation.json", files[2].1.as_bytes()).settings
            {
                tokio::time::sleep(Duration::from_millis(25)).await;
            }
            stage.until_gif_of("film", &files).await;
            assert_eq!(drawn(&stage.seen()), 0, "{outputs}");
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn fewer_frames_than_expected_wait() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let files = vec![("a.txt", scene(8.0)), ("b.txt", scene(9.0)), frames(2)];
        stage.upload("film", &[files[2].clone(), files[0].clone()]).await;
        let manifest = stage.until("film", Status::Waiting).await;
        assert_eq!((manifest.head.done, manifest.head.total), (1, 1));
        assert_eq!(stage.gif_info("film").await, None);
        stage.upload("film", &files[1..2]).await;
        stage.until_gif_of("film", &files).await;
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_event_twice_and_in_reverse() {
    on_every_store(async |store| {
        let mut stage = stage(store, |settings| {
            settings.chaos = Chaos {
                seed: 1,
                duplicate: 1.0,
                reverse_after: Some(Duration::from_millis(200)),
                ..Chaos::default()
            };
        })
        .await;
        let files: Vec<_> = ["a.txt", "b.txt", "c.txt", "d.txt", "e.txt"]
            .into_iter()
            .zip(1..)
            .map(|(name, x)| (name, scene(f64::from(x) * 4.0)))
            .chain([frames(5)])
            .collect();
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        let events = stage
            .seen()
            .iter()
            .filter(|o| matches!(&o.seen, Seen::Started(a) if a.function == Function::Render))
            .count();
        assert_eq!(events, 12, "each event twice");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_animations_at_once_keep_apart() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let one = vec![("a.txt", scene(4.0)), ("b.txt", scene(8.0)), frames(2)];
        let two = vec![("a.txt", scene(12.0)), ("b.txt", scene(16.0)), ("c.txt", scene(20.0)), frames(3)];
        // Also one below the other: the name of one animation may be a folder of another.
        let below = vec![("a.txt", scene(2.0)), frames(1)];
        tokio::join!(
            stage.upload("one", &one),
            stage.upload("two", &two),
            stage.upload("one/deeper", &below)
        );
        stage.until_gif_of("one", &one).await;
        stage.until_gif_of("two", &two).await;
        stage.until_gif_of("one/deeper", &below).await;
        assert_eq!(drawn(&stage.seen()), 6);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_with_blanks_plus_signs_umlauts_and_slashes() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let name = "Über uns/1 + 1 = 2 & 100%/ß";
        let files = vec![
            ("a b.txt", scene(4.0)),
            ("a+b.txt", scene(8.0)),
            ("ä%20@1.txt", scene(12.0)),
            ("日本.txt", scene(16.0)),
            frames(4),
        ];
        stage.upload(name, &files).await;
        stage.until_gif_of(name, &files).await;
        assert_eq!(drawn(&stage.seen()), 4);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn three_hundred_tiny_frames_at_a_concurrency_of_fifty() {
    on_every_store(async |store| {
        let mut stage = stage(store, |settings| settings.concurrency = 50).await;
        let names: Vec<String> = (1..=300).map(|number| format!("f{number}.txt")).collect();
        let mut files: Vec<_> =
            names.iter().zip(1..).map(|(name, x)| (name.as_str(), scene(f64::from(x) / 12.0))).collect();
        files.insert(0, frames(300));
        let uploads = files.chunks(25).map(|chunk| stage.upload("film", chunk));
        futures_util::future::join_all(uploads).await;
        stage.until_gif_of("film", &files).await;
        let seen = stage.seen();
        assert_eq!(drawn(&seen), 300);
        let billed: u64 = Function::ALL.iter().flat_map(|f| requests(&seen, *f)).map(|r| r.billed()).sum();
        // One request is the assembler's read of each frame. The contract bounds the rest, the protocol's requests.
        let per_frame = (billed as f64 - 300.0) / 300.0;
        assert!(per_frame <= 12.0, "{per_frame} requests a frame");
        assert_eq!(built(&seen), 1, "with `frames` given no GIF is made too early");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_requests_of_a_lonely_frame_are_these() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        stage.upload("film", &[frames(2)]).await;
        stage.settle().await;
        stage.upload("film", &[("a.txt", scene(4.0))]).await;
        stage.settle().await;
        stage.seen();
        stage.upload("film", &[("b.txt", scene(8.0))]).await;
        stage.until("film", Status::Done).await;
        let seen = stage.seen();
        let render = requests(&seen, Function::Render);
        assert_eq!(render.len(), 1);
        assert!(render[0].billed() <= 12, "{render:?}");
        assert_eq!(render[0].delete, 0);
        // It writes its frame, the manifest and the claim.
        assert_eq!(render[0].put, 3, "{render:?}");
        let kinds = |of: Function| {
            let keys = seen.iter().filter_map(move |o| match &o.seen {
                Seen::Requested { attempt, request }
                    if attempt.function == of && request.kind == RequestKind::Put =>
                {
                    Some(request.key.split('/').next().unwrap().to_owned())
                }
                _ => None,
            });
            keys.collect::<Vec<_>>()
        };
        assert_eq!(kinds(Function::Render), ["frames", "manifests", "assemblies"]);
        // Its lease, the GIF, and the reference to the GIF in the manifest.
        assert_eq!(kinds(Function::Assemble), ["frames", "animations", "manifests"]);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn logs_hold_no_script_contents() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let secret = "# the villain is the gardener\n";
        let files = vec![
            ("a.txt", format!("{secret}{}", scene(4.0))),
            ("b.txt", format!("{secret}Sphere gardener\nTrace\n")),
            frames(2),
        ];
        stage.upload("film", &files).await;
        stage.until("film", Status::Failed).await;
        let lines = super::stage::logged(&stage.seen());
        assert!(lines.iter().any(|line| line["message"] == "rendered" && line["animation"] == "film"));
        for line in &lines {
            assert!(!line.to_string().contains("gardener"), "{line}");
            if line["message"] == "rendered" && line["frame"].is_string() {
                for field in ["request_id", "animation", "read_ms", "draw_ms", "put_ms", "fold_ms"] {
                    assert!(!line[field].is_null(), "{field} is missing in {line}");
                }
            }
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn nothing_is_written_where_it_does_not_belong() {
    on_every_store(async |store| {
        let mut stage = stage(store, |_| {}).await;
        let files = vec![("a.txt", scene(4.0)), ("b.txt", scene(8.0)), frames(2)];
        stage.upload("film", &files).await;
        stage.until_gif_of("film", &files).await;
        let page = stage.store().list(ListRequest::all("")).await.unwrap();
        let mut prefixes: Vec<&str> =
            page.objects.iter().map(|object| object.key.split('/').next().unwrap()).collect();
        prefixes.dedup();
        // The invoker's own object, where it lists the bucket.
        prefixes.retain(|prefix| *prefix != "invokers");
        assert_eq!(prefixes, ["animations", "assemblies", "frames", "manifests", "scripts"]);
        for observation in stage.seen() {
            if let Seen::Requested { attempt, request } = observation.seen
                && matches!(request.kind, RequestKind::Put | RequestKind::Delete)
            {
                assert!(!request.key.starts_with("scripts/"), "{attempt:?} wrote {}", request.key);
                let is_gif = request.key.starts_with("animations/");
                assert!(!(is_gif && attempt.function == Function::Render), "render wrote {}", request.key);
            }
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_script_beyond_the_limits_of_the_stack_is_named_with_the_limit() {
    on_every_store(async |store| {
        let limits = [("RAYFOLD_MAX_OBJECTS", "1"), ("RAYFOLD_MAX_PIXELS", "432"), ("RAYFOLD_MAX_FRAMES", "2")];
        let mut stage = stage(store, |settings| {
            settings.environment.extend(limits.map(|(name, value)| (name.into(), value.into())));
        })
        .await;
        let within = scene(8.0);
        let sphere = "Sphere 1 0 0 -5 .1 .1 .1 .1 .1 .1\nTrace";
        let files = [
            ("frames.txt", within.replace("Trace", "Trace\nTrace\nTrace")),
            ("objects.txt", within.replace("Trace", sphere)),
            ("pixels.txt", within.replace("Screen 24 18", "Screen 24 19")),
            ("within.txt", within),
            frames(4),
        ];
        stage.upload("film", &files).await;
        let manifest = stage.until("film", Status::Failed).await;
        let said: Vec<_> = failures(&manifest)
            .into_iter()
            .map(|(script, reason)| (script, reason.diagnostics.iter().map(|found| &found.message).collect::<Vec<_>>()))
            .collect();
        assert_eq!(
            format!("{said:?}"),
            r#"[("frames", ["more than 2 frames"]), ("objects", ["more than 1 objects in a scene"]), ("pixels", ["the image has 456 pixels, the limit is 432"])]"#
        );
    })
    .await;
}

/// If a frame does not fit into the memory of one function, several functions draw it. The bytes are the same.
#[tokio::test(flavor = "multi_thread")]
async fn a_frame_too_big_for_one_invocation_is_drawn_in_bands_with_the_same_bytes() {
    on_every_store(async |store| {
        let mut stage = stage(store, |settings| settings.memory_mb = SMALL_MB).await;
        let small = big_scene(50.0).replace("Samples 4 0\n", "");
        let several =
            big_scene(70.0).replace("Trace\n", "Trace\nSphere 9 20 20 -50 .9 .2 .2 .3 .3 .3\nTrace\n");
        let files = [("a.txt", big_scene(30.0)), ("b.txt", small), ("c.txt", several), frames(4)];
        stage.upload("film", &files).await;
        // The GIF equals the one that is made locally, in one piece.
        let manifest = stage.until_gif_of("film", &files).await;
        let seen = stage.seen();
        let outcomes = outcomes(&seen);
        assert_eq!(outcomes.get("cut into 4"), Some(&3), "{outcomes:?}");
        assert_eq!((drawn(&seen), built(&seen)), (4, 1), "{outcomes:?}");
        for frame in &manifest.frames {
            let key = rayfold_pipeline::assemble::frame_key(&manifest.head.animation, frame).unwrap();
            let there = stage.store().get(&key).await.unwrap().body;
            let (_, text) = files.iter().find(|(file, _)| file.starts_with(frame.script.as_str())).unwrap();
            let name = ScriptName::new(frame.script.as_str()).unwrap();
            let (script, files) = (text.clone().into(), Files::default());
            let source = Source { name, script, files, part: frame.part };
            let whole = RayTracer::default().draw(source, None).await.unwrap();
            let Drawing::Frame(whole) = whole else { panic!("{key}") };
            assert!(there == whole, "{key}");
        }
        // A repeated upload costs no more than for any existing frame.
        stage.upload("film", &files[..1]).await;
        stage.settle().await;
        for requests in requests(&stage.seen(), Function::Render) {
            assert!(requests.billed() <= 4, "{requests:?}");
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_that_fits_in_no_number_of_bands_is_named_with_what_it_takes() {
    on_every_store(async |store| {
        let mut stage = stage(store, |settings| {
            settings.memory_mb = SMALL_MB;
            settings.environment.push(("RAYFOLD_MAX_BANDS".into(), "3".into()));
        })
        .await;
        stage.upload("film", &[("a.txt", big_scene(30.0))]).await;
        let manifest = stage.until("film", Status::Failed).await;
        let [(_, reason)] = failures(&manifest)[..] else { panic!("{manifest:?}") };
        let expected = "a.txt: 160 x 400 pixels take 4 MB of memory, in 3 bands 2 MB each, and the render function has 1 MB";
        assert!(reason.message.starts_with(expected), "{}", reason.message);
    })
    .await;
}

/// The webhook says that there is news; the listing shows the objects.
#[tokio::test(flavor = "multi_thread")]
async fn a_webhook_hastens_the_listing() {
    let mut stage = stage(StoreKind::BuiltIn, |_| {}).await;
    let never = Duration::from_secs(100_000);
    let listing = Listing { every: never, ..Listing::new(stage.store().clone(), "lister") };
    stage.platform.settings_mut().listing = Some(listing);
    stage.restart_invoker().await;
    let files = vec![("1.txt", scene(8.0)), ("2.txt", scene(12.0)), frames(2)];
    stage.upload("film", &files).await;
    stage.until_gif_of("film", &files).await;
    assert_eq!(drawn(&stage.seen()), 2);
}
