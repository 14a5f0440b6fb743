//! Scripts that name files: which files wake what, and which frames are drawn again.

use super::*;

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
    // The same event twice wakes nothing twice.
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

/// A present frame costs a look at the folder more than one without files, and no more.
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

/// Keys of many files would be too long for some stores.
#[tokio::test]
async fn a_set_of_many_files_has_several_receipts() {
    let world = World::new();
    world.put(EARTH, "blue");
    world.put(ONE, "with a,b,c,d,e,earth frame 1");
    assert!(matches!(world.render(ONE).await, Outcome::Waits(_)));
    let lists = world.keys("frames/film/");
    assert_eq!(lists.iter().filter(|key| key.contains(".files-")).count(), 2, "{lists:?}");
}
