//! Tests of scripts that name files: the files that trigger a script, and the frames that are drawn again.

use std::collections::BTreeMap;

use super::*;
use crate::fakes::Paste;
use crate::keys::Band;
use crate::render::{Drawing, File, Files, Renderer, Source};

const ONE: &str = "scripts/film/1.txt";
const TWO: &str = "scripts/film/2.txt";
const EARTH: &str = "scripts/film/earth";

impl World {
    /// Renders the events of the objects below `parts/` that were put since `since`. Returns their keys.
    async fn woken(&self, since: &[String]) -> Vec<String> {
        let mut keys = self.keys("parts/");
        keys.retain(|key| !since.contains(key));
        for key in &keys {
            self.render(key).await;
        }
        keys
    }

    fn pictures(&self) -> Vec<String> {
        let mut frames = self.keys("frames/film/");
        frames.retain(|key| key.ends_with(".png"));
        let bucket = self.store.bucket.lock().unwrap();
        frames
            .iter()
            .map(|key| String::from_utf8_lossy(&bucket.get(key).unwrap().body).into_owned())
            .collect()
    }

    fn status(&self) -> (Status, u64, u64, u64) {
        let head = self.manifest().head;
        (head.status, head.done, head.pending, head.waiting)
    }
}

const DRAWER: InstantRenderer = InstantRenderer { bands: BANDS };

/// A process of a function, which keeps the files that it has read and those to which they refer.
#[derive(Default)]
struct Warm(Mutex<BTreeMap<String, File>>);

impl Renderer for Warm {
    type BandJoiner = Paste;

    fn most_bytes(&self) -> u64 {
        DRAWER.most_bytes()
    }

    fn most_file_bytes(&self) -> u64 {
        DRAWER.most_file_bytes()
    }

    /// Kept files replace those that are not read yet.
    async fn needed(&self, name: &ScriptName, script: Bytes, files: Files) -> Result<Vec<String>> {
        let kept = self.0.lock().unwrap().clone();
        let kept =
            kept.into_iter().map(|(key, file)| (key.rsplit('/').next().unwrap().to_owned(), Some(file)));
        let mut all: BTreeMap<_, _> = kept.collect();
        all.extend(files.iter().map(|(name, file)| (name.clone(), file.clone())));
        DRAWER.needed(name, script, Arc::new(all)).await
    }

    fn kept(&self, key: &str) -> Option<File> {
        self.0.lock().unwrap().get(key).cloned()
    }

    fn keep(&self, key: &str, file: Option<&File>) {
        let mut kept = self.0.lock().unwrap();
        match file {
            Some(file) => kept.insert(key.to_owned(), file.clone()),
            None => kept.remove(key),
        };
    }

    async fn draw(&self, source: Source, left: Option<Duration>) -> Result<Drawing> {
        DRAWER.draw(source, left).await
    }

    async fn draw_band(&self, source: Source, band: Band) -> Result<Result<Bytes, Reason>> {
        DRAWER.draw_band(source, band).await
    }

    async fn join(&self, source: Source, count: NonZeroU64) -> Result<Result<Paste, Reason>> {
        DRAWER.join(source, count).await
    }
}

impl World {
    async fn render_warm(&self, process: &Warm, key: &str) -> Outcome {
        self.with(async |invocation| render_frame(invocation, process, key).await.unwrap().outcome).await
    }

    /// Renders the events of new objects below `parts/` until there are none. The first process handles those for whole
    /// scripts; the processes take turns with those of parts and bands.
    async fn render_woken(&self, processes: &[&Warm], seen: &mut Vec<String>) {
        loop {
            let mut keys = self.keys("parts/");
            keys.retain(|key| !seen.contains(key));
            if keys.is_empty() {
                return;
            }
            for (number, key) in keys.into_iter().enumerate() {
                let process = if key.ends_with("files.json") { 0 } else { number % processes.len() };
                self.render_warm(processes[process], &key).await;
                seen.push(key);
            }
        }
    }
}

/// A process that still had the older file treated the part's version as superseded, and no invocation drew the frame.
#[tokio::test]
async fn a_process_that_keeps_an_older_file_draws_the_frames_of_the_newer_one() {
    for script in ["with earth split 3 1", "big with earth frame 1", "big with earth split 2 1"] {
        let world = World::new();
        let (writer, reader) = (Warm::default(), Warm::default());
        let mut seen = Vec::new();
        world.put(EARTH, "blue");
        world.put(ONE, script);
        world.render_warm(&writer, ONE).await;
        world.render_woken(&[&writer, &reader], &mut seen).await;
        assert_eq!(world.manifest().head.status, Status::Done, "{script}");
        // Another file, none, and the first one again.
        for (text, status) in
            [(Some("green"), Status::Done), (None, Status::Waiting), (Some("red"), Status::Done)]
        {
            world.later(Duration::from_secs(1)).await;
            match text {
                Some(text) => drop(world.put(EARTH, text)),
                None => drop(world.store.bucket.lock().unwrap().delete(EARTH)),
            }
            world.render_warm(&writer, EARTH).await;
            world.render_woken(&[&reader, &writer], &mut seen).await;
            assert_eq!(world.manifest().head.status, status, "{script}: {text:?}");
        }
    }
}

/// The set of a process that had read the older model contained a file to which the newer one no longer refers, so no
/// other process could read the files of that version.
#[tokio::test]
async fn a_set_has_no_file_that_only_an_older_model_refers_to() {
    let world = World::new();
    let (warm, cold) = (Warm::default(), Warm::default());
    let mut seen = Vec::new();
    world.put("scripts/film/moon", "grey");
    world.put(EARTH, "also moon");
    world.put(ONE, "with earth split 2 1");
    world.render_warm(&warm, ONE).await;
    world.render_woken(&[&warm], &mut seen).await;
    world.later(Duration::from_secs(1)).await;
    world.put(EARTH, "blue");
    world.render_warm(&warm, EARTH).await;
    world.render_woken(&[&warm, &cold], &mut seen).await;
    assert_eq!(world.status(), (Status::Done, 2, 0, 0));
    // A change of the other file concerns nobody.
    world.later(Duration::from_secs(1)).await;
    world.put("scripts/film/moon", "white");
    world.render_warm(&warm, "scripts/film/moon").await;
    world.render_woken(&[&warm, &cold], &mut seen).await;
    assert_eq!(world.status(), (Status::Done, 2, 0, 0));
}

#[tokio::test]
async fn a_part_of_an_older_file_is_superseded_and_its_file_read_once() {
    let world = World::new();
    let (writer, reader) = (Warm::default(), Warm::default());
    world.put(EARTH, "blue");
    world.put(ONE, "with earth split 2 1");
    world.render_warm(&writer, ONE).await;
    let parts = world.keys("parts/");
    world.put(EARTH, "green");
    let count = Arc::new(AtomicU64::new(0));
    let counted = count.clone();
    world.refuse(move |request| {
        counted.fetch_add(u64::from(request == "get scripts/film/earth"), Ordering::Relaxed);
        None
    });
    assert_eq!(world.render_warm(&reader, &parts[0]).await, Outcome::Superseded);
    assert_eq!(count.load(Ordering::Relaxed), 1);
    // What it has kept need not be what is there.
    assert_eq!(world.render_warm(&reader, &parts[1]).await, Outcome::Superseded);
    assert_eq!(count.load(Ordering::Relaxed), 2);
}

#[tokio::test]
async fn a_frame_is_drawn_from_the_files_that_its_script_names() {
    let world = World::new();
    world.put(EARTH, "also moon");
    world.put("scripts/film/moon", "grey");
    world.put(ONE, "with earth frame 1");
    assert_eq!(world.render(ONE).await, Outcome::Drawn);
    assert_eq!(world.pictures(), ["1:0:with earth frame 1 | earth = also moon | moon = grey"]);
    assert_eq!(world.status(), (Status::Done, 1, 0, 0));
    assert!(world.manifest().frames[0].version.has_files());
    // The event again finds it done.
    assert_eq!(world.render(ONE).await, Outcome::Present);
}

#[tokio::test]
async fn a_script_waits_for_its_file_and_says_so() {
    let world = World::new();
    world.put(ONE, "with earth frame 1");
    world.put(TWO, "frame 2");
    assert!(matches!(world.render(ONE).await, Outcome::Waits(_)));
    world.render(TWO).await;
    assert_eq!(world.status(), (Status::Waiting, 1, 0, 1));
    let FrameState::Waiting(fault) = &world.manifest().frames[0].state else { panic!() };
    assert_eq!(fault.reason.as_ref().unwrap().message, "1.txt waits for earth");
    assert!(world.keys("assemblies/").is_empty());

    world.later(Duration::from_secs(1)).await;
    world.put(EARTH, "blue");
    assert_eq!(world.render(EARTH).await, Outcome::File);
    assert_eq!(world.woken(&[]).await.len(), 1);
    assert_eq!(world.status(), (Status::Done, 2, 0, 0));
    assert_eq!(world.keys("assemblies/").len(), 1);
}

#[tokio::test]
async fn a_changed_file_has_only_the_scripts_drawn_again_that_name_it() {
    let world = World::new();
    world.put(EARTH, "blue");
    world.put("scripts/film/notes.md", "read by nobody");
    world.put(ONE, "with earth frame 1");
    world.put(TWO, "frame 2");
    world.render(ONE).await;
    world.render(TWO).await;
    assert_eq!(world.render("scripts/film/notes.md").await, Outcome::NoFile);
    let before = world.manifest().head.generation;

    world.later(Duration::from_secs(1)).await;
    world.put(EARTH, "green");
    world.render(EARTH).await;
    assert_eq!(world.status(), (Status::Rendering, 1, 1, 0));
    // A repeated event triggers nothing again.
    world.render(EARTH).await;
    assert_eq!(world.woken(&[]).await.len(), 1);
    assert_eq!(world.status(), (Status::Done, 2, 0, 0));
    assert_ne!(world.manifest().head.generation, before);
    assert_eq!(world.pictures().len(), 3);

    // Changed back: the frame is there still.
    world.later(Duration::from_secs(1)).await;
    world.put(EARTH, "blue");
    let parts = world.keys("parts/");
    world.render(EARTH).await;
    assert!(world.woken(&parts).await.is_empty());
    assert_eq!((world.status(), world.manifest().head.generation), ((Status::Done, 2, 0, 0), before));
}

#[tokio::test]
async fn a_deleted_file_makes_its_scripts_wait() {
    let world = World::new();
    world.put(EARTH, "blue");
    world.put(ONE, "with earth split 2 1");
    world.render(ONE).await;
    world.woken(&[]).await;
    assert_eq!(world.status(), (Status::Done, 2, 0, 0));
    world.store.bucket.lock().unwrap().delete(EARTH);
    let parts = world.keys("parts/");
    world.render(EARTH).await;
    world.woken(&parts).await;
    assert_eq!(world.status(), (Status::Waiting, 0, 0, 1));
}

#[tokio::test]
async fn a_file_that_changes_before_its_version_is_put_is_read_again() {
    let world = World::new();
    world.put(EARTH, "blue");
    world.put(ONE, "with earth frame 1");
    world.meddle(|request, bucket, now| {
        let is_set = request.starts_with("put frames/film/1@") && request.contains(".files-");
        if is_set && bucket.get(EARTH).unwrap().body == "blue" {
            bucket.put(now, EARTH, "green".into(), PutOptions::always()).unwrap();
        }
    });
    assert_eq!(world.render(ONE).await, Outcome::Drawn);
    assert_eq!(world.pictures(), ["1:0:with earth frame 1 | earth = green"]);
    assert_eq!(world.status(), (Status::Done, 1, 0, 0));
}

/// For a frame that exists, a script with files costs only one request more: a listing of the folder.
#[tokio::test]
async fn an_event_again_costs_four_requests() {
    let world = World::new();
    world.put(EARTH, "blue");
    world.put(ONE, "with earth frame 1");
    world.render(ONE).await;
    let count = Arc::new(AtomicU64::new(0));
    let counted = count.clone();
    world.refuse(move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        None
    });
    assert_eq!(world.render(ONE).await, Outcome::Present);
    assert_eq!(count.load(Ordering::Relaxed), 4);
}

#[tokio::test]
async fn the_sweep_gives_up_waiting_after_its_patience() {
    let world = World::new();
    world.put(ONE, "with earth frame 1");
    world.render(ONE).await;
    let sweep =
        async || world.with(async |invocation| visit(invocation, &World::film()).await.unwrap()).await;
    assert_eq!(sweep().await.given_up, 0);
    world.later(world.policy.stuck_after).await;
    assert_eq!(sweep().await.given_up, 1);
    world.with(async |invocation| crate::fold(invocation, &World::film()).await.unwrap()).await;
    assert_eq!(world.status().0, Status::Failed);
    // Its file comes after all.
    world.put(EARTH, "blue");
    world.render(EARTH).await;
    world.woken(&[]).await;
    assert_eq!(world.status(), (Status::Done, 1, 0, 0));
}

/// Otherwise the keys of sets with many files would be too long for some stores.
#[tokio::test]
async fn a_set_of_many_files_has_several_receipts() {
    let world = World::new();
    world.put(EARTH, "blue");
    world.put(ONE, "with a,b,c,d,e,earth frame 1");
    assert!(matches!(world.render(ONE).await, Outcome::Waits(_)));
    let lists = world.keys("frames/film/");
    assert_eq!(lists.iter().filter(|key| key.contains(".files-")).count(), 2, "{lists:?}");
}
