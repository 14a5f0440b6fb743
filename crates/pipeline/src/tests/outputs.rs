//! Tests of several files that are made of an animation, as `animation.json` requests.

use super::assemblies::seconds;
use super::*;
use crate::fakes::film;

const GIF: Container = Container::Gif;
const WEBP: Container = Container::Webp;

impl World {
    /// Changes the settings.
    async fn ask_for(&self, settings: &str) {
        self.upload("animation.json", settings).await;
    }

    /// Runs the assembler on the newest claim.
    async fn make(&self) -> Assembled {
        self.assemble(&self.joiner(), &self.newest_claim()).await.unwrap()
    }

    fn newest_claim(&self) -> String {
        self.keys("assemblies/").into_iter().max_by_key(|key| self.modified(key)).unwrap()
    }

    fn file(&self, output: Container) -> Option<String> {
        let object = self.store.bucket.lock().unwrap().get(&World::film().output(output)).ok()?;
        Some(String::from_utf8_lossy(&object.body).into_owned())
    }

    fn files(&self) -> Vec<String> {
        self.keys("animations/")
    }
}

/// Returns a file of two frames.
fn film_of_two(output: Container) -> String {
    let pictures = [1, 2].map(|number| format!("{number}:0:frame {number}"));
    film(&AnimationSettings::default(), output, &pictures)
}

/// Uploads two frames, and settings that request these files.
async fn two_frames(outputs: &str) -> World {
    let world = World::new();
    world.ask_for(&format!(r#"{{"frames": 2, "outputs": [{outputs}]}}"#)).await;
    world.upload("1.txt", "frame 1").await;
    world.upload("2.txt", "frame 2").await;
    world
}

#[tokio::test]
async fn each_file_that_is_asked_for_is_made_once() {
    let world = two_frames(r#""gif", "webp", "apng", "y4m""#).await;
    let assembled = world.make().await;
    assert_eq!((assembled.built, assembled.rounds, assembled.status), (4, 5, Status::Done));
    for output in Container::ALL {
        assert_eq!(world.file(output), Some(film_of_two(output)), "{output:?}");
        let info = world.store.bucket.lock().unwrap().head(&World::film().output(output)).unwrap();
        assert_eq!(world.manifest().head.version_of(output), Some(&info.etag));
    }
    assert!(world.is_at_rest());
    let again = world.make().await;
    assert_eq!((again.built, again.rounds), (0, 1));
    assert_eq!(world.visit().await, Visit::default(), "the sweep finds nothing to do");
}

/// The frames and the existing files are not made again.
#[tokio::test]
async fn a_file_more_is_all_that_is_made_when_the_settings_ask_for_it() {
    let world = two_frames(r#""gif""#).await;
    assert_eq!(world.make().await.built, 1);
    let (gif, frames) = (world.modified("animations/film.gif"), world.keys("frames/"));
    world.later(seconds(9)).await;
    world.ask_for(r#"{"frames": 2, "outputs": ["webp", "gif"]}"#).await;
    assert_eq!(world.make().await.built, 1);
    assert_eq!(world.file(WEBP), Some(film_of_two(WEBP)));
    assert_eq!(world.modified("animations/film.gif"), gif);
    let new: Vec<String> = world.keys("frames/").into_iter().filter(|key| !frames.contains(key)).collect();
    assert_eq!(new, ["frames/film/@output.webp"]);
    // Then the GIF goes, as nobody asks for it any more; then the other one.
    world.ask_for(r#"{"frames": 2, "outputs": ["webp"]}"#).await;
    assert_eq!(world.make().await.built, 0);
    assert_eq!(world.files(), ["animations/film.webp"]);
    world.ask_for(r#"{"frames": 2}"#).await;
    assert_eq!(world.make().await.built, 1);
    assert_eq!(world.files(), ["animations/film.gif"]);
}

/// The mark records that there may be a file of an earlier output. It does so even if the manifest is gone.
#[tokio::test]
async fn a_file_of_before_goes_also_when_the_manifest_is_gone() {
    let world = two_frames(r#""gif", "webp""#).await;
    world.make().await;
    world.store.bucket.lock().unwrap().delete("manifests/film.json");
    world.ask_for(r#"{"frames": 2}"#).await;
    world.make().await;
    assert_eq!(world.files(), ["animations/film.gif"]);
    // A late one, of an assembler that was killed, is found by the sweep.
    world.put("animations/film.webp", "late");
    assert!(world.visit().await.claimed);
    world.make().await;
    assert_eq!(world.files(), ["animations/film.gif"]);
    assert_eq!(world.visit().await, Visit::default());
}

#[tokio::test]
async fn all_files_go_with_the_last_script() {
    let world = two_frames(r#""gif", "webp""#).await;
    world.make().await;
    for file in ["1.txt", "2.txt", "animation.json"] {
        let key = format!("scripts/film/{file}");
        world.store.bucket.lock().unwrap().delete(&key);
        world.render(&key).await;
    }
    world.make().await;
    assert_eq!(world.files(), [""; 0]);
}

/// While frames are pending, the old files stay.
#[tokio::test]
async fn a_changed_frame_makes_each_file_anew() {
    let world = two_frames(r#""gif", "webp""#).await;
    world.make().await;
    world.upload("2.txt", "split 2 3").await;
    world.make().await;
    assert_eq!(world.files().len(), 2);
    world.upload("2.txt", "frame 3").await;
    assert_eq!(world.make().await.built, 2);
    let pictures = ["1:0:frame 1".to_owned(), "2:0:frame 3".to_owned()];
    for output in [GIF, WEBP] {
        assert_eq!(world.file(output), Some(film(&AnimationSettings::default(), output, &pictures)));
    }
}

/// The animation stays refused until that file is no longer requested.
#[tokio::test]
async fn a_file_that_cannot_be_made_is_named_and_no_other_one_stays() {
    let world = two_frames(r#""gif", "y4m""#).await;
    let joiner = Joiner { trouble: Some(Trouble::Output(Container::Y4m)), ..world.joiner() };
    let assembled = world.assemble(&joiner, &world.newest_claim()).await.unwrap();
    assert_eq!((assembled.built, assembled.status), (1, Status::Refused));
    assert_eq!(world.files(), [""; 0]);
    let refusal = world.manifest().head.refusal.unwrap();
    assert_eq!(refusal.reason.unwrap().message, "Y4M: Output(Y4m)");
    world.ask_for(r#"{"frames": 2}"#).await;
    let assembled = world.assemble(&joiner, &world.newest_claim()).await.unwrap();
    assert_eq!((assembled.built, assembled.status), (1, Status::Done));
    assert_eq!(world.files(), ["animations/film.gif"]);
}

/// A file is begun without alpha, and begun again when the first frame with alpha comes.
#[tokio::test]
async fn a_frame_with_alpha_costs_one_more_beginning() {
    let world = World::new();
    world.ask_for(r#"{"frames": 2, "outputs": ["webp"]}"#).await;
    world.upload("1.txt", "frame 1").await;
    world.upload("2.txt", "frame clear").await;
    assert_eq!(world.make().await.built, 1);
    let pictures = ["1:0:frame 1".to_owned(), "2:0:frame clear".to_owned()];
    assert_eq!(world.file(WEBP), Some(film(&AnimationSettings::default(), WEBP, &pictures)));
    assert!(world.is_at_rest());
}

/// The files are built in turn. A WebP's length is at its start, which is held back until the end.
#[tokio::test]
async fn files_that_take_too_long_are_gone_on_with_in_turn() {
    let mut world = two_frames(r#""webp", "apng""#).await;
    world.policy.spare_frames = 1;
    let mut left = Vec::new();
    for _ in 0..9 {
        world.later(seconds(1)).await;
        // Time for one frame.
        world.deadline = Some(world.store.clock.now().after(seconds(25)));
        let claim = world.newest_claim();
        let assembled = world.assemble(&world.slow(seconds(10)), &claim).await.unwrap();
        left.push(assembled.left_after);
        if world.files().len() == 2 {
            break;
        }
    }
    // The first frame of one, its second, the first frame of the other, its second.
    assert_eq!(left, [Some(1), None, Some(1), None], "{left:?}");
    for output in [WEBP, Container::Apng] {
        assert_eq!(world.file(output), Some(film_of_two(output)));
    }
    assert!(world.is_at_rest());
}

/// Settings that affect a file are part of its generation: the order there and back, and the times of frames.
#[tokio::test]
async fn settings_that_show_make_the_file_anew() {
    let world = two_frames(r#""gif""#).await;
    world.make().await;
    let generations: Vec<String> = {
        let mut generations = vec![world.manifest().head.generation.to_string()];
        for settings in
            [r#""bounce": true"#, r#""durations": {"1": 2}"#, r#""durations": {"1": 3}"#, r#""loop": 1"#]
        {
            world.ask_for(&format!(r#"{{"frames": 2, {settings}}}"#)).await;
            assert_eq!(world.make().await.built, 1, "{settings}");
            generations.push(world.manifest().head.generation.to_string());
        }
        generations
    };
    let different: std::collections::BTreeSet<_> = generations.iter().collect();
    assert_eq!(different.len(), generations.len());
}
