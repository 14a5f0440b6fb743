//! Removal of an animation from the bucket, with everything that was made of it.

use std::collections::BTreeSet;
use std::time::Duration;

use rayfold_pipeline::Clock;
use rayfold_pipeline::keys::{Animation, Key, NameHash, Receipt, Uploaded, goes_with};
use rayfold_pipeline::manifest::Status;
use rayfold_pipeline::store::{ListRequest, Listed, Store};

use crate::client::Client;
use crate::error::{Error, Result};
use crate::watch::Watch;

/// The time that the functions get to notice that the scripts are gone. They then write an empty manifest, which
/// would reappear if the manifest were removed before.
const NOTICE: Duration = Duration::from_secs(15);

/// The progress of a removal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RemoveProgress {
    /// This many objects are deleted.
    Deleted(u64),
    /// The client waits until the functions notice that the scripts are gone.
    WaitingForFunctions,
}

/// The objects of an animation in the bucket, by key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contents {
    /// The scripts and settings in the folder. Includes misnamed ones, and files that operating systems leave there.
    pub scripts: Vec<String>,
    /// The objects made of them: frames, the GIF, the manifest.
    pub made: Vec<String>,
}

impl<S: Store, C: Clock> Client<'_, S, C> {
    /// Returns the objects that [`remove`](Self::remove) would delete.
    ///
    /// # Errors
    /// [`Error::NoAnimation`], and the errors of the store.
    pub async fn contents(&self, animation: &Animation) -> Result<Contents> {
        // Listed before anything is deleted: a caller who may not list all of an animation deletes nothing of it.
        let made = self.made_of(animation).await?;
        let scripts = self.uploaded_of(animation, &made).await?;
        if scripts.is_empty() && made.is_empty() {
            return Err(Error::NoAnimation(animation.clone()));
        }
        Ok(Contents { scripts, made })
    }

    /// Removes an animation. Returns the number of objects deleted.
    ///
    /// # Errors
    /// [`Error::NoAnimation`], and the errors of the store.
    pub async fn remove(&self, animation: &Animation, mut report: impl FnMut(RemoveProgress)) -> Result<u64> {
        let Contents { scripts, .. } = self.contents(animation).await?;
        self.delete(&scripts, |done| report(RemoveProgress::Deleted(done))).await?;
        let mut removed = scripts.len() as u64;
        let mut watch = Watch::new(*self, animation.clone());
        watch.poll().await?;
        while !scripts.is_empty() && is_pending(&watch) && watch.elapsed() < NOTICE {
            report(RemoveProgress::WaitingForFunctions);
            watch.pause().await;
            watch.poll_with_retry().await?;
        }
        // Functions that were still running may have written more since.
        loop {
            let rest = self.made_of(animation).await?;
            if rest.is_empty() {
                return Ok(removed);
            }
            self.delete(&rest, |done| report(RemoveProgress::Deleted(removed + done))).await?;
            removed += rest.len() as u64;
        }
    }

    /// Returns the scripts and settings, including misnamed ones, the files from which a result was drawn, and files
    /// that operating systems leave there. `made` are the keys of the results.
    async fn uploaded_of(&self, animation: &Animation, made: &[String]) -> Result<Vec<String>> {
        let lists = made.iter().filter_map(|key| match key.parse() {
            Ok(Key::Receipt { receipt: Receipt::Files { list, .. }, .. }) => Some(list),
            _ => None,
        });
        let named: BTreeSet<NameHash> = lists.flat_map(|list| list.entries).map(|(name, _)| name).collect();
        let listed = self.list(ListRequest::all(animation.scripts())).await?.objects;
        let all = listed.iter().filter_map(|object| Uploaded::of(&object.key, object.size).animation());
        let mut others: Vec<Animation> = all.filter(|other| other != animation).collect();
        others.dedup();
        let is_named = |object: &Listed| {
            matches!(Uploaded::of(&object.key, object.size), Uploaded::File(of, name)
                if of == *animation && named.contains(&NameHash::of(&name)))
        };
        let ours = listed
            .into_iter()
            .filter(|object| is_named(object) || goes_with(animation, &object.key, &others));
        Ok(ours.map(|object| object.key).collect())
    }

    /// Returns everything but the scripts.
    async fn made_of(&self, animation: &Animation) -> Result<Vec<String>> {
        let prefixes = [
            animation.retries(),
            animation.parts(),
            format!("assemblies/{animation}/"),
            animation.frames(),
            animation.checkpoint(),
            format!("animations/{animation}."),
            animation.manifest(),
        ];
        self.keys_of(animation, &prefixes).await
    }

    /// Returns the keys under the prefixes that belong to this animation, and not to one whose name starts
    /// with the same letters.
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
    use std::num::NonZeroU64;

    use rayfold_pipeline::keys::{FileList, ScriptName, Tag};
    use rayfold_pipeline::store::ETag;

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
    async fn the_files_of_its_scripts_go_with_an_animation() {
        let world = World::new();
        for name in ["1.txt", "earth.png", "notes.md"] {
            world.put(&format!("scripts/film/{name}"), "a").await;
        }
        let (name, tag) = ("1", "v+0123456789abcdef");
        let earth = NameHash::of("earth.png");
        let list = FileList { number: NonZeroU64::MIN, of: NonZeroU64::MIN, entries: vec![(earth, None)] };
        let tag = Tag { version: ETag::new(tag), pixels: 1 };
        let receipt = Receipt::Files { name: ScriptName::new(name).unwrap(), tag, list };
        world.put(&world.film().receipt(&receipt), "").await;
        world.client().remove(&world.film(), |_| {}).await.unwrap();
        assert_eq!(world.keys("").await, ["scripts/film/notes.md"]);
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
        let mut reports = Vec::new();
        // The functions notice while the client waits for them.
        let removing = client.remove(&film, |removing| reports.push(removing));
        let (removed, ()) =
            futures_util::future::join(removing, world.deletions(&["scripts/film/1.txt"])).await;
        assert_eq!(world.keys("").await, others);
        let (first, last) = (reports.first().cloned(), reports.last().cloned());
        assert_eq!(first, Some(RemoveProgress::Deleted(1)));
        let removed = removed.unwrap();
        assert_eq!(last, Some(RemoveProgress::Deleted(removed)));
        assert!(
            removed as usize >= before - others.len()
                && reports.contains(&RemoveProgress::WaitingForFunctions)
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
        // An animation that consists of a folder marker only can be removed, too.
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
