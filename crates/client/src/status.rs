//! The state of the animations of a bucket.

use std::collections::BTreeSet;

use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_pipeline::Clock;
use rayfold_pipeline::keys::{Animation, Key, MANIFESTS, SCRIPTS, Uploaded, misplaced as misplaced_because};
use rayfold_pipeline::manifest::{Frame, FrameState, Manifest, Reason};
use rayfold_pipeline::store::{ListRequest, Listed, Listing, Store};
use rayfold_scene::SETTINGS_FILE;

use crate::client::{Client, SIDE_BY_SIDE};
use crate::error::{Error, Result};
use crate::watch::Watch;

/// The number of leading slashes before `scripts/` up to which misplaced objects are searched.
const MAX_SLASHES: usize = 4;

/// The contents of a bucket.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Overview {
    /// The animations by name: those with a manifest, and folders of scripts without one.
    pub animations: Vec<Animation>,
    /// Objects that look like a part of an animation and belong to none.
    pub misplaced: Vec<Misplaced>,
}

/// An object that is not rendered because of its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misplaced {
    /// The key of the object.
    pub key: String,
    /// The problem, with the right place.
    pub problem: &'static str,
}

/// A reason why an animation is not done.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle<'a> {
    /// The faulty object for messages: a script, `animation.json`, the GIF.
    pub what: String,
    /// The reason, once it is known.
    pub reason: Option<&'a Reason>,
}

/// Returns everything in a manifest that keeps its animation from being done, except rejected keys.
pub fn obstacles(manifest: &Manifest) -> Vec<Obstacle<'_>> {
    let head = &manifest.head;
    let settings = head.settings.fault.as_ref();
    let settings = settings.map(|reason| Obstacle { what: SETTINGS_FILE.to_owned(), reason: Some(reason) });
    let excess = head.excess.as_ref();
    let excess = excess.map(|reason| Obstacle { what: head.animation.to_string(), reason: Some(reason) });
    let frames = manifest.frames.iter().filter_map(|frame| match &frame.state {
        FrameState::Failed(fault) | FrameState::Waiting(fault) => {
            Some(Obstacle { what: frame_name(frame), reason: fault.reason.as_ref() })
        }
        FrameState::Pending | FrameState::Done { .. } => None,
    });
    let refusal = head.refusal.as_ref();
    let refusal = refusal.map(|fault| Obstacle {
        what: format!("the GIF of {}", head.animation),
        reason: fault.reason.as_ref(),
    });
    settings.into_iter().chain(excess).chain(frames).chain(refusal).collect()
}

/// Returns a frame's name for messages: its script, and its number within the script.
pub fn frame_name(frame: &Frame) -> String {
    match frame.part {
        None => format!("{}.txt", frame.script),
        Some(part) => format!("{}.txt, frame {part}", frame.script),
    }
}

impl<'a, S: Store, C: Clock> Client<'a, S, C> {
    /// Lists the animations of the bucket, and the objects that belong to none.
    ///
    /// # Errors
    /// The errors of the store.
    pub async fn overview(&self) -> Result<Overview> {
        let manifests = self.list(ListRequest::all(MANIFESTS)).await?.objects;
        let of_manifests = manifests.iter().filter_map(|object| match object.key.parse() {
            Ok(Key::Manifest { animation }) => Some(animation),
            _ => None,
        });
        let mut animations: BTreeSet<Animation> = of_manifests.collect();
        let mut misplaced = Vec::new();
        let mut objects = self.list(ListRequest::all(SCRIPTS)).await?.objects;
        objects.extend(self.beside_scripts().await?);
        for Listed { key, size, .. } in objects {
            match misplaced_because(&key, size) {
                Some(problem) => misplaced.push(Misplaced { key, problem }),
                None => animations.extend(Uploaded::of(&key, size).animation()),
            }
        }
        Ok(Overview { animations: animations.into_iter().collect(), misplaced })
    }

    /// Lists objects in folders whose names are almost that of the scripts.
    async fn beside_scripts(&self) -> Result<Vec<Listed>> {
        let mut found = Vec::new();
        let mut levels = vec![String::new()];
        while let Some(level) = levels.pop() {
            // Some callers may list nothing in a bucket but its scripts and manifests.
            let Some(listed) = self.list_if_allowed(ListRequest::level(level)).await? else { continue };
            found.extend(listed.objects.into_iter().filter(|object| object.key.contains('\\')));
            for folder in listed.prefixes.into_iter().filter(|folder| folder != SCRIPTS) {
                let name = folder.trim_matches('/');
                if name.is_empty() && folder.len() < MAX_SLASHES {
                    levels.push(folder);
                } else if name.eq_ignore_ascii_case(SCRIPTS.trim_matches('/')) {
                    let below = self.list_if_allowed(ListRequest::all(folder)).await?;
                    found.extend(below.into_iter().flat_map(|below| below.objects));
                }
            }
        }
        Ok(found)
    }

    async fn list_if_allowed(&self, request: ListRequest) -> Result<Option<Listing>> {
        match self.list(request).await {
            Ok(listing) => Ok(Some(listing)),
            Err(Error::Store(rayfold_pipeline::Error::Refused { .. })) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Lists the animations of the bucket by name.
    ///
    /// # Errors
    /// The errors of the store.
    pub async fn animations(&self) -> Result<Vec<Animation>> {
        Ok(self.overview().await?.animations)
    }

    /// Polls each of these animations once, in their order, and compares it with its scripts.
    ///
    /// # Errors
    /// The errors of the store.
    pub async fn look(&self, animations: &[Animation]) -> Result<Vec<Watch<'a, S, C>>> {
        let looks = animations.iter().map(|animation| {
            let mut watch = Watch::new(*self, animation.clone());
            async move {
                watch.poll().await?;
                watch.compare().await?;
                Ok::<_, Error>(watch)
            }
        });
        let looks: Vec<_> = looks.collect();
        stream::iter(looks).buffered(SIDE_BY_SIDE).try_collect().await
    }
}

#[cfg(test)]
mod tests {
    use rayfold_pipeline::store::{PutOptions, Store};

    use super::*;
    use crate::world::World;

    #[tokio::test]
    async fn animations_are_those_with_a_manifest_and_new_folders() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        world.put("scripts/films/one/1.txt", "frame").await;
        world.functions().await;
        world.put("scripts/new/1.txt", "frame").await;
        let names = world.client().animations().await.unwrap();
        let texts: Vec<&str> = names.iter().map(Animation::as_str).collect();
        assert_eq!(texts, ["film", "films/one", "new"]);
        let looks = world.client().look(&names).await.unwrap();
        let seen: Vec<_> = looks.iter().map(|watch| (watch.is_settled(), watch.is_current())).collect();
        assert_eq!(seen, [(true, true), (true, true), (false, false)]);
    }

    /// Each manifest that was set aside counted as another animation: four times `film`.
    #[tokio::test]
    async fn an_animation_whose_manifests_were_set_aside_is_named_once() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        for garbage in ["one", "two", "three"] {
            world.put("manifests/film.json", garbage).await;
            world.functions().await;
            world.put("scripts/film/1.txt", garbage).await;
            world.functions().await;
        }
        assert_eq!(world.keys("manifests/film.json~").await.len(), 3);
        assert_eq!(world.client().animations().await.unwrap(), [world.film()]);
    }

    /// The marker of a folder counted as an animation that never ends.
    #[tokio::test]
    async fn what_systems_leave_makes_no_animation_and_what_is_misplaced_is_named() {
        let world = World::new();
        for key in [
            "scripts/film/1.txt",
            "scripts/near/3.TXT",
            "scripts/notes/readme.md",
            "scripts/hidden/._1.txt",
            "scripts/__MACOSX/film/._1.txt",
            "scripts/.git/1.txt",
        ] {
            world.put(key, "frame").await;
        }
        world.put("scripts/marked/", "").await;
        let misplaced = [
            "scripts/1.txt",
            "scripts//h/1.txt",
            "scripts/a\\b/1.txt",
            "Scripts/film/1.txt",
            "/scripts/film/1.txt",
            "//scripts/film/1.TXT",
            "scripts\\film\\1.txt",
        ];
        for key in misplaced {
            world.put(key, "frame").await;
        }
        let overview = world.client().overview().await.unwrap();
        let names: Vec<&str> = overview.animations.iter().map(Animation::as_str).collect();
        assert_eq!(names, ["film", "near"]);
        let mut found: Vec<&str> =
            overview.misplaced.iter().map(|misplaced| misplaced.key.as_str()).collect();
        found.sort_unstable();
        let mut misplaced = misplaced;
        misplaced.sort_unstable();
        assert_eq!(found, misplaced);
        let no = |name| Animation::new(name).unwrap();
        for name in ["marked", "hidden", "notes"] {
            let error = world.client().must_exist(&no(name)).await.unwrap_err();
            assert!(matches!(error, Error::NoAnimation(_)), "{name}");
        }
    }

    /// The status was "Done, GIF current" while the functions could not read the uploaded files.
    #[tokio::test]
    async fn what_the_functions_have_not_seen_is_not_done() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        world.put("scripts/film/notes.md", "not ours").await;
        world.functions().await;
        let seen = async |world: &World| {
            let looks = world.client().look(&[world.film()]).await.unwrap();
            (looks[0].is_behind(), looks[0].is_settled(), looks[0].is_current())
        };
        assert_eq!(seen(&world).await, (false, true, true));
        for (key, text) in [
            ("scripts/film/animation.json", "[]"),
            ("scripts/film/animation.json", r#"{"fps": 20}"#),
            ("scripts/film/1.txt", "other"),
            ("scripts/film/2.txt", "more"),
        ] {
            world.put(key, text).await;
            assert_eq!(seen(&world).await, (true, false, false), "{key}");
            world.functions().await;
            let (is_behind, is_settled, is_current) = seen(&world).await;
            assert_eq!((is_behind, is_settled, is_current), (false, true, text != "[]"), "{key}");
        }
    }

    /// The status was "behind" for ever if no file was in the folder: the versions of scripts whose files are all absent were
    /// not looked for.
    #[tokio::test]
    async fn what_waits_for_the_only_file_of_its_folder_is_not_behind() {
        let world = World::new();
        let seen = async || {
            let looks = world.client().look(&[world.film()]).await.unwrap();
            (looks[0].is_behind(), looks[0].manifest().unwrap().head.waiting, looks[0].is_settled())
        };
        world.put("scripts/film/1.txt", "with ball.obj").await;
        world.functions().await;
        assert_eq!(seen().await, (false, 1, false), "it has not come");
        world.put("scripts/film/ball.obj", "round").await;
        assert!(seen().await.0, "nobody has seen it yet");
        world.functions().await;
        assert_eq!(seen().await, (false, 0, true), "it is there");
        world.store.delete("scripts/film/ball.obj").await.unwrap();
        assert!(seen().await.0, "nobody has seen that it is gone");
        world.deletions(&["scripts/film/ball.obj"]).await;
        world.functions().await;
        assert_eq!(seen().await, (false, 1, false), "it is gone");
    }

    /// The status was "Done, GIF current" for half a GIF whose metadata had been copied.
    #[tokio::test]
    async fn a_gif_that_was_cut_off_is_not_current() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        world.functions().await;
        let gif = world.store.get("animations/film.gif").await.unwrap();
        let half = gif.body.slice(..gif.body.len() / 2);
        let options = PutOptions { metadata: gif.info.metadata, ..PutOptions::always() };
        world.store.put("animations/film.gif", half, options).await.unwrap();
        let looks = world.client().look(&[world.film()]).await.unwrap();
        assert!(!looks[0].is_settled() && !looks[0].is_current());
    }

    #[tokio::test]
    async fn what_keeps_an_animation_from_being_done_is_named() {
        let world = World::new();
        world.put("scripts/film/1.txt", "bad").await;
        world.put("scripts/film/2.txt", "frame").await;
        world.put("scripts/film/animation.json", "[]").await;
        world.functions().await;
        let looks = world.client().look(&[world.film()]).await.unwrap();
        let obstacles = obstacles(looks[0].manifest().unwrap());
        let what: Vec<&str> = obstacles.iter().map(|obstacle| obstacle.what.as_str()).collect();
        assert_eq!(what, ["animation.json", "1.txt"]);
        assert!(obstacles.iter().all(|obstacle| obstacle.reason.is_some()));
        assert!(looks[0].is_settled() && !looks[0].is_current());
    }
}
