//! The environment for end-to-end tests: an S3 server, the invoker and the unmodified function binaries. Scripts are
//! uploaded and GIFs are built. Everything starts fresh for each test, on free loopback ports, and ends with it. Each
//! function runs under the policy of its own role, in the document that Terraform uses on AWS, so a missing permission
//! fails a test.

#![allow(dead_code, unreachable_pub, reason = "a module of several test files, which use each a part of it")]

pub mod role;
pub mod stores;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfold_local::invoker::{Invoker, Settings};
use rayfold_local::observation::{Observation, Requests, Seen};
use rayfold_local::routes::Function;
use rayfold_local::{Functions, Plan, Platform, StoreKind};
use rayfold_movie::{Encoding, Movie, Plays};
use rayfold_pipeline::assemble::is_current;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Manifest, Status};
use rayfold_pipeline::store::{ObjectInfo, PutOptions, S3Store, Store};
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{AnimationSettings, Container, Limits, natural_cmp, parse_settings, parse_with_files};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

/// A value for `RAYFOLD_SPARE_FRAMES`: the time to keep free, in frames, so that an assembler adds one frame and leaves
/// the rest. Any frame takes a thousandth of a second at least.
pub const ALL_ITS_TIME: &str = "1000000";

/// Longer than anything here takes on a loaded machine.
pub const PATIENCE: Duration = Duration::from_secs(240);

pub struct Stage {
    pub platform: Platform,
    sender: UnboundedSender<Observation>,
    seen: UnboundedReceiver<Observation>,
    data: tempfile::TempDir,
}

/// Returns the folder of the function binaries, which is that of the program. `cargo test` for one package does not
/// build the binaries of another. In that case they are built here.
pub fn functions_beside(program: &Path) -> &Path {
    let folder = program.parent().unwrap();
    if folder.join("rayfold-render").exists() && folder.join("rayfold-assemble").exists() {
        return folder;
    }
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["build", "--locked", "-p", "rayfold-lambda", "--bins", "--target-dir"])
        .arg(folder.parent().unwrap());
    cargo.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."));
    if folder.ends_with("release") {
        cargo.arg("--release");
    }
    assert!(cargo.status().unwrap().success(), "the function binaries do not build");
    folder
}

/// Starts everything; `change` alters the invoker's settings.
pub async fn stage(store: StoreKind, functions: &Path, change: impl FnOnce(&mut Settings)) -> Stage {
    let data = tempfile::tempdir().unwrap();
    let plan = Plan::new(store, data.path(), Functions::in_folder(functions));
    let settings = |settings: &mut Settings| {
        settings.concurrency = 4;
        settings.retry_pauses = vec![Duration::from_millis(50), Duration::from_millis(100)];
        settings.sweep_every = None;
        settings.timeout = Duration::from_secs(60);
        settings.environment.push(("RAYFOLD_QUIET_MS".into(), "1500".into()));
        change(settings);
    };
    let mut platform = Platform::start(&plan, settings, &mut |line| eprintln!("{line}")).await.unwrap();
    // SeaweedFS has no temporary credentials for its owner.
    let of_roles = Function::ALL.into_iter().filter(|_| store != StoreKind::SeaweedFs);
    for function in of_roles {
        let own = role::environment(platform.server(), function, &plan.bucket).await;
        platform.settings_mut().environment_of.insert(function, own);
    }
    let (sender, seen) = unbounded_channel();
    platform.start_invoker(Some(sender.clone())).await.unwrap();
    let mut stage = Stage { platform, sender, seen, data };
    stage.settle().await;
    stage
}

impl Stage {
    pub fn store(&self) -> &S3Store {
        self.platform.store()
    }

    pub fn invoker(&self) -> &Invoker {
        self.platform.invoker().unwrap()
    }

    pub async fn restart_invoker(&mut self) {
        let sender = self.sender.clone();
        self.platform.start_invoker(Some(sender)).await.unwrap();
    }

    /// Puts an object. As from any client, a put that the store could not answer is sent again, up to five times.
    pub async fn put(&self, key: &str, body: impl Into<Bytes>) {
        let body = body.into();
        for attempt in 1.. {
            match self.store().put(key, body.clone(), PutOptions::always()).await {
                Err(error) if error.is_retryable() && attempt < 5 => {
                    tokio::time::sleep(Duration::from_millis(200)).await;
                }
                put => return drop(put.unwrap()),
            }
        }
    }

    pub async fn upload(&self, animation: &str, files: &[(&str, String)]) {
        for (name, text) in files {
            self.put(&format!("scripts/{animation}/{name}"), text.clone()).await;
        }
    }

    pub async fn remove(&self, animation: &str, name: &str) {
        self.store().delete(&format!("scripts/{animation}/{name}")).await.unwrap();
    }

    pub async fn manifest(&self, animation: &str) -> Option<Manifest> {
        let animation = Animation::new(animation).unwrap();
        match self.store().get(&animation.manifest()).await {
            Ok(object) => Some(Manifest::decode(&animation, &object.body).unwrap()),
            Err(error) => {
                assert!(error.is_not_found(), "{error:?}");
                None
            }
        }
    }

    pub async fn gif_info(&self, animation: &str) -> Option<ObjectInfo> {
        self.file_info(animation, Container::Gif).await
    }

    pub async fn file_info(&self, animation: &str, output: Container) -> Option<ObjectInfo> {
        match self.store().head(&Animation::new(animation).unwrap().output(output)).await {
            Ok(info) => Some(info),
            Err(error) => {
                assert!(error.is_not_found(), "{error:?}");
                None
            }
        }
    }

    pub async fn gif(&self, animation: &str) -> Bytes {
        self.store().get(&Animation::new(animation).unwrap().gif()).await.unwrap().body
    }

    /// Waits until there is no work left: all invocations have ended, and the store has no event left to deliver.
    pub async fn settle(&mut self) {
        let start = Instant::now();
        let mut quiet = 0;
        while quiet < 4 {
            assert!(start.elapsed() < PATIENCE, "invocations never end:\n{}", self.story());
            tokio::time::sleep(Duration::from_millis(50)).await;
            if self.invoker().pending() == 0 {
                self.invoker().look().await;
            }
            quiet = if self.invoker().pending() == 0 { quiet + 1 } else { 0 };
        }
    }

    /// Waits until the animation has the status `wanted`, and settles.
    pub async fn until(&mut self, animation: &str, wanted: Status) -> Manifest {
        let start = Instant::now();
        loop {
            let manifest = self.manifest(animation).await;
            if let Some(manifest) = manifest {
                let mut is_there = true;
                for output in manifest.head.outputs().iter().filter(|_| wanted == Status::Done) {
                    let file = self.file_info(animation, *output).await;
                    is_there &= is_current(&manifest.head, *output, file.as_ref());
                }
                if manifest.head.status == wanted && is_there {
                    break;
                }
            }
            if start.elapsed() > PATIENCE {
                let manifest = self.manifest(animation).await;
                panic!("{animation} is not {wanted:?}: {manifest:#?}\n{}", self.story());
            }
            tokio::time::sleep(Duration::from_millis(25)).await;
        }
        self.settle().await;
        let manifest = self.manifest(animation).await.unwrap();
        assert_eq!(manifest.head.status, wanted, "it did not stay so");
        manifest
    }

    /// Waits until the animation is done. Checks that it has the files that its settings ask for and no others, each
    /// with exactly the bytes that these scripts give locally.
    pub async fn until_gif_of(&mut self, animation: &str, files: &[(&str, String)]) -> Manifest {
        let manifest = self.until(animation, Status::Done).await;
        for output in Container::ALL {
            let key = Animation::new(animation).unwrap().output(output);
            let file = self.store().get(&key).await.ok().map(|object| object.body);
            let is_wanted = manifest.head.outputs().contains(&output);
            let expected = is_wanted.then(|| locally_as(output, files));
            assert!(
                file.as_deref() == expected.as_deref(),
                "{key} is not the local one, wanted: {is_wanted}"
            );
        }
        manifest
    }

    /// Returns the observations since the last call.
    pub fn seen(&mut self) -> Vec<Observation> {
        std::iter::from_fn(|| self.seen.try_recv().ok()).collect()
    }

    /// Returns the next observation.
    pub async fn next(&mut self) -> Observation {
        tokio::time::timeout(PATIENCE, self.seen.recv()).await.expect("something happens").unwrap()
    }

    /// Returns the observations as text, to explain why a test failed.
    pub fn story(&mut self) -> String {
        let lines = self.seen().into_iter().map(|observation| match observation.seen {
            Seen::Event { name, key, .. } => format!("event {name} {key}"),
            Seen::Started(attempt) => format!("started {attempt:?}"),
            Seen::Finished { attempt, outcome, .. } => format!("finished {} {outcome:?}", attempt.request_id),
            Seen::Requested { attempt, request } => format!("  {} {request:?}", attempt.request_id),
            Seen::Log { line, .. } => format!("  log {line}"),
            Seen::Joined { invoker } => format!("joined {invoker}"),
            Seen::Lost { invoker } => format!("lost {invoker}"),
            Seen::DeadLetter { body } => format!("dead letter {body}"),
        });
        lines.collect::<Vec<_>>().join("\n")
    }
}

/// Returns the number of frames drawn.
pub fn drawn(seen: &[Observation]) -> usize {
    outcomes(seen).get("drawn").copied().unwrap_or(0)
}

/// Returns the number of GIFs built.
pub fn built(seen: &[Observation]) -> u64 {
    logged(seen).iter().filter_map(|line| line["built"].as_u64()).sum()
}

/// Returns the number of each outcome that render logged.
pub fn outcomes(seen: &[Observation]) -> BTreeMap<String, usize> {
    let mut outcomes = BTreeMap::new();
    for line in logged(seen).iter().filter(|line| line["message"] == "rendered") {
        *outcomes.entry(line["outcome"].as_str().unwrap().to_owned()).or_default() += 1;
    }
    outcomes
}

/// Returns the functions' log entries.
pub fn logged(seen: &[Observation]) -> Vec<serde_json::Value> {
    let lines = seen.iter().filter_map(|observation| match &observation.seen {
        Seen::Log { line, .. } => Some(line),
        _ => None,
    });
    lines.map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("no JSON: {line}"))).collect()
}

/// Returns the requests of a function's invocations, one by one.
pub fn requests(seen: &[Observation], of: Function) -> Vec<Requests> {
    let ended = seen.iter().filter_map(|observation| match &observation.seen {
        Seen::Finished { attempt, requests, .. } if attempt.function == of => Some(*requests),
        _ => None,
    });
    ended.collect()
}

/// Returns a small scene that depends on `x`.
pub fn scene(x: f64) -> String {
    format!(
        "Screen 24 18\nBackground .1 .2 .3\nSphere 6 {x} 9 -9 .2 .2 .2 .7 .6 .5\nIlight 1 1 1 .2 -.3 -1\nTrace\n"
    )
}

/// Returns a frame of `corner.obj` in front of the sky, which depends on `red`.
pub fn scene_of_a_model(red: f64) -> String {
    format!("Screen 24 18\nBackground {red} .2 .3\nIlight 1 1 1  .2 -.3 -1\nMesh \"corner.obj\"\nTrace\n")
}

/// Returns a frame that functions of [`SMALL_MB`] megabytes draw in four bands. It depends on `x`.
pub fn big_scene(x: f64) -> String {
    format!(
        "Screen 160 400\nSamples 4 0\nBackground .1 .2 .3  .7 .8 .9\nSphere 60 {x} 200 -90 .2 .2 .2 .7 .6 .5 .2 .2 .2\n\
         Sphere 30 90 330 -70 .1 .2 .1 .3 .8 .5\nIlight 1 1 1 .2 -.3 -1\nTrace\n"
    )
}

/// A memory size that is too small for four samples per pixel of [`big_scene`], but sufficient for one.
pub const SMALL_MB: u32 = 2;

/// Returns an `animation.json` that waits for this many frames.
pub fn frames(count: usize) -> (&'static str, String) {
    ("animation.json", format!("{{\"frames\": {count}}}"))
}

/// Returns the GIF that the scripts give without a bucket: parsed, traced and encoded in this process.
pub fn locally(files: &[(&str, String)]) -> Vec<u8> {
    locally_as(Container::Gif, files)
}

/// Returns the file of a kind that the scripts give without a bucket.
pub fn locally_as(output: Container, files: &[(&str, String)]) -> Vec<u8> {
    let limits = Limits::default();
    let mut settings = AnimationSettings::default();
    let mut beside = MemoryFiles::default();
    for (name, text) in files {
        beside.insert(name, text.as_bytes().to_vec());
    }
    let library = Library::new(beside);
    let mut scripts = Vec::new();
    for (name, text) in files {
        if *name == "animation.json" {
            settings = parse_settings(name, text.as_bytes()).settings.unwrap();
        } else if name.ends_with(".txt") {
            let parsed = parse_with_files(name, text.as_bytes(), &limits, &library);
            scripts.push((*name, parsed.script.unwrap()));
        }
    }
    scripts.sort_by(|(a, _), (b, _)| natural_cmp(a, b));
    let scenes: Vec<_> = scripts.iter().flat_map(|(_, script)| script.frames()).collect();
    let pictures = scenes.iter().map(|scene| {
        let options = rayfold_tracer::RenderOptions::default();
        rayfold_tracer::render_picture(rayfold_tracer::Exposure::still(scene), &options).unwrap()
    });
    let pictures: Vec<_> = pictures.collect();
    let mut file = Vec::new();
    let Some(first) = pictures.first() else { return file };
    let movie = Movie {
        size: (first.width(), first.height()),
        frames: Some(settings.shown_count(pictures.len() as u64)),
        fps: settings.fps(),
        plays: Plays::repeated(settings.loops()),
        last_delay_cs: None,
        exact: false,
        alpha: pictures.iter().any(|picture| picture.color().has_alpha()),
    };
    let durations = settings.shown_durations(pictures.len() as u64);
    let mut encoding = Encoding::begin(&mut file, output, movie).unwrap();
    for (place, picture) in (0..).zip(settings.shown(&pictures)) {
        encoding.push(picture.clone(), durations.get(&place).copied()).unwrap();
    }
    encoding.finish().unwrap().complete(&mut file);
    file
}
