//! An animation out of the bucket, with all that was made of it.

use std::time::Duration;

use rayfold_pipeline::Clock;
use rayfold_pipeline::keys::{Animation, Key, Uploaded, goes_with};
use rayfold_pipeline::manifest::Status;
use rayfold_pipeline::store::{ListRequest, Store};

use crate::client::Client;
use crate::error::{Error, Result};
use crate::watch::Watch;

/// How long the functions have to notice that the scripts are gone. They write an empty manifest then, which would come
/// back if it were removed before.
const NOTICE: Duration = Duration::from_secs(15);

/// How far a removal is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RemoveProgress {
    /// So many objects are gone.
    Deleted(u64),
    /// The functions must notice that there are no scripts any more.
    WaitingForFunctions,
}

/// What the bucket holds of an animation, by key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contents {
    /// The folder's scripts and settings, also those that are misnamed, and what systems have left beside them.
    pub scripts: Vec<String>,
    /// What was made of them: frames, the GIF, the manifest.
    pub made: Vec<String>,
}

impl<S: Store, C: Clock> Client<'_, S, C> {
    /// What [`remove`](Self::remove) would remove.
    ///
    /// # Errors
    /// [`Error::NoAnimation`], and those of the store.
    pub async fn contents(&self, animation: &Animation) -> Result<Contents> {
        let scripts = self.uploaded_of(animation).await?;
        // Listed before anything goes: whoever may not see all of an animation removes nothing of it.
        let made = self.made_of(animation).await?;
        if scripts.is_empty() && made.is_empty() {
            return Err(Error::NoAnimation(animation.clone()));
        }
        Ok(Contents { scripts, made })
    }

    /// Removes an animation; says how many objects there were.
    ///
    /// # Errors
    /// [`Error::NoAnimation`], and those of the store.
    pub async fn remove(&self, animation: &Animation, mut told: impl FnMut(RemoveProgress)) -> Result<u64> {
        let Contents { scripts, .. } = self.contents(animation).await?;
        self.delete(&scripts, |done| told(RemoveProgress::Deleted(done))).await?;
        let mut removed = scripts.len() as u64;
        let mut watch = Watch::new(*self, animation.clone());
        watch.poll().await?;
        while !scripts.is_empty() && is_pending(&watch) && watch.elapsed() < NOTICE {
            told(RemoveProgress::WaitingForFunctions);
            watch.pause().await;
            watch.poll_with_retry().await?;
        }
        // Whatever was under way may have left something since.
        loop {
            let rest = self.made_of(animation).await?;
            if rest.is_empty() {
                return Ok(removed);
            }
            self.delete(&rest, |done| told(RemoveProgress::Deleted(removed + done))).await?;
            removed += rest.len() as u64;
        }
    }

    /// The scripts and settings, also those that are misnamed, and what systems have left beside them.
    async fn uploaded_of(&self, animation: &Animation) -> Result<Vec<String>> {
        let listed = self.list(ListRequest::all(animation.scripts())).await?.objects;
        let all = listed.iter().filter_map(|object| Uploaded::of(&object.key, object.size).animation());
        let mut others: Vec<Animation> = all.filter(|other| other != animation).collect();
        others.dedup();
        let ours = listed.into_iter().filter(|object| goes_with(animation, &object.key, &others));
        Ok(ours.map(|object| object.key).collect())
    }

    /// Everything but the scripts.
    async fn made_of(&self, animation: &Animation) -> Result<Vec<String>> {
        let prefixes = [
            animation.retries(),
            animation.parts(),
            format!("assemblies/{animation}/"),
            animation.frames(),
            animation.checkpoint(),
            animation.gif(),
            animation.manifest(),
        ];
        self.keys_of(animation, &prefixes).await
    }

    /// Keys below the prefixes that belong to this animation, and not to one whose name starts with it.
    async fn keys_of(&self, animation: &Animation, prefixes: &[String]) -> Result<Vec<String>> {
        let mut keys = Vec::new();
        for prefix in prefixes {
            let listed = self.list(ListRequest::all(prefix.clone())).await?.objects;
            let is_ours = |key: &String| key.parse::<Key>().is_ok_and(|key| key.animation() == animation);
            keys.extend(listed.into_iter().map(|object| object.key).filter(is_ours));
        }
        Ok(keys)
    }
}

fn is_pending<S: Store, C: Clock>(watch: &Watch<'_, S, C>) -> bool {
    watch.manifest().is_some_and(|manifest| manifest.head.status != Status::Empty)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    async fn filled() -> World {
        let world = World::new();
        for key in ["film/1", "film/two/1", "films/1"] {
            world.put(&format!("scripts/{key}.txt"), "frame").await;
        }
        world.put("scripts/film/2.txt", "bad").await;
        world.functions().await;
        world
    }

    #[tokio::test]
    async fn nothing_of_an_animation_is_left_and_everything_of_others() {
        let world = filled().await;
        let (client, film) = (world.client(), world.film());
        let of_others = |keys: Vec<String>| {
            keys.into_iter().filter(|key| key.contains("film/two") || key.contains("films"))
        };
        let others: Vec<String> = of_others(world.keys("").await).collect();
        let before = world.keys("").await.len();
        let mut told = Vec::new();
        // The functions notice while the client waits for them.
        let removing = client.remove(&film, |removing| told.push(removing));
        let (removed, ()) =
            futures_util::future::join(removing, world.deletions(&["scripts/film/1.txt"])).await;
        assert_eq!(world.keys("").await, others);
        let (first, last) = (told.first().cloned(), told.last().cloned());
        assert_eq!(first, Some(RemoveProgress::Deleted(1)));
        let removed = removed.unwrap();
        assert_eq!(last, Some(RemoveProgress::Deleted(removed)));
        assert!(
            removed as usize >= before - others.len() && told.contains(&RemoveProgress::WaitingForFunctions)
        );
        assert!(matches!(client.remove(&film, |_| {}).await, Err(Error::NoAnimation(name)) if name == film));
    }

    #[tokio::test]
    async fn what_systems_have_left_beside_the_scripts_goes_with_them() {
        let world = filled().await;
        for name in [
            "",
            "._1.txt",
            ".ipynb_checkpoints/1.txt",
            "__MACOSX/._1.txt",
            "Thumbs.db",
            "3.TXT",
            "sub/.DS_Store",
        ] {
            world.put(&format!("scripts/film/{name}"), "").await;
        }
        let others = [
            "scripts/film/notes.md",
            "scripts/film/two/",
            "scripts/film/two/._1.txt",
            "scripts/films/._1.txt",
        ];
        for key in others {
            world.put(key, "").await;
        }
        world.client().remove(&world.film(), |_| {}).await.unwrap();
        let mut left = others.map(String::from).to_vec();
        left.extend(["scripts/film/two/1.txt", "scripts/films/1.txt"].map(String::from));
        left.sort();
        assert_eq!(world.keys("scripts/").await, left);
        // Of an animation of which nothing but a marker is there, too.
        world.put("scripts/marked/", "").await;
        let marked = Animation::new("marked").unwrap();
        assert_eq!(world.client().remove(&marked, |_| {}).await.unwrap(), 1);
    }

    #[tokio::test]
    async fn a_removal_ends_without_functions() {
        let world = filled().await;
        world.client().remove(&world.film(), |_| {}).await.unwrap();
        assert!(world.keys("").await.iter().all(|key| !key.starts_with("manifests/film.")));
    }
}
