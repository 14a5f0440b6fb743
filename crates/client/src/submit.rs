//! Submission: makes an animation's folder in the bucket equal to a local one, with as few uploads as possible.
//!
//! The order matters: scripts are deleted first, then the new number of frames is put, then the files that scripts
//! name, then the new scripts. So the animation is never complete before its content is the wanted one, and no script
//! waits for its files.

use std::collections::{BTreeMap, BTreeSet};

use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_pipeline::Clock;
use rayfold_pipeline::keys::{Animation, Key, ScriptName, Uploaded};
use rayfold_pipeline::store::{ETag, ListRequest, Listed, Store};
use rayfold_scene::AnimationSettings;

use crate::client::{Client, SIDE_BY_SIDE};
use crate::error::{Error, Result};
use crate::file::{DIGEST, File};

/// The memory that files in transit may take, in bytes.
const UNDER_WAY: u64 = 256 << 20;

/// The wanted content of an animation's folder in the bucket.
#[derive(Debug)]
pub struct Submission {
    animation: Animation,
    /// The files by key.
    files: BTreeMap<String, File>,
    deletable: Deletable,
}

/// The scripts that a submission may delete from the bucket's folder if it does not contain them.
#[derive(Debug, Clone, Default)]
enum Deletable {
    #[default]
    None,
    /// The scripts with these keys.
    These(BTreeSet<String>),
    All,
}

/// The changes that a submission would make.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Preview {
    /// The keys of the scripts, files and settings that would be uploaded.
    pub upload: Vec<String>,
    /// The keys of the scripts that would be deleted.
    pub delete: Vec<String>,
    /// The number of files, settings included, that are there already.
    pub unchanged: u64,
}

/// The progress of a submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sending {
    /// Scripts that are no longer wanted have been deleted.
    Deleted {
        /// The number of deleted scripts.
        scripts: u64,
    },
    /// Files are being uploaded.
    Uploading {
        /// The number of uploaded files.
        done: u64,
        /// The number of files to upload.
        total: u64,
    },
    /// The folder is as wanted.
    Finished {
        /// The number of files that were uploaded.
        uploaded: u64,
        /// The number of files, settings included, that were there already.
        unchanged: u64,
    },
}

/// The result of a submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Submitted {
    /// The version of each file, by key.
    pub versions: BTreeMap<String, ETag>,
}

/// The differences between the bucket's folder and the wanted one.
#[derive(Debug, Default, PartialEq)]
struct Difference {
    /// The keys to put, in order.
    changed: Vec<String>,
    /// The keys to delete.
    surplus: Vec<String>,
    /// The versions of the objects that need no change.
    same: BTreeMap<String, ETag>,
}

/// Makes settings that state the number of frames, so that the functions need not wait for a quiet period to know
/// that the upload has ended.
///
/// # Errors
/// [`Error::Settings`] if the number is 0.
pub fn settings_with_frames(settings: &AnimationSettings, frames: u64) -> Result<File> {
    let counted =
        settings.clone().with_frames(Some(frames)).map_err(|source| Error::Settings(source.into()))?;
    let text = serde_json::to_string_pretty(&counted).map_err(|source| Error::Settings(source.into()))?;
    Ok(File::of_text(text + "\n"))
}

impl Submission {
    /// Makes a submission of these scripts and this `animation.json`.
    ///
    /// # Errors
    /// The pipeline's [`Key`](rayfold_pipeline::Error::Key) if it refuses a name.
    pub fn new(
        animation: Animation,
        scripts: impl IntoIterator<Item = (ScriptName, File)>,
        settings: File,
    ) -> Result<Self> {
        let mut files = BTreeMap::from([(animation.settings(), settings)]);
        for (name, file) in scripts {
            let key = animation.script(&name);
            key.parse::<Key>()?;
            files.insert(key, file);
        }
        Ok(Self { animation, files, deletable: Deletable::None })
    }

    /// Adds the files that the scripts name, by their names.
    ///
    /// # Errors
    /// The pipeline's [`Key`](rayfold_pipeline::Error::Key) if scripts cannot name such a file.
    pub fn with_files(mut self, files: impl IntoIterator<Item = (String, File)>) -> Result<Self> {
        for (name, file) in files {
            let key = format!("{}{name}", self.animation.scripts());
            if !Uploaded::is_file(&key) {
                let problem = "scripts name no such file";
                return Err(rayfold_pipeline::Error::Key { key, problem }.into());
            }
            self.files.insert(key, file);
        }
        Ok(self)
    }

    /// Allows it to delete the scripts with these keys if it does not contain them.
    pub fn deleting(mut self, keys: impl IntoIterator<Item = String>) -> Self {
        self.deletable = Deletable::These(keys.into_iter().collect());
        self
    }

    /// Allows it to delete every script in the folder that it does not contain.
    pub fn deleting_all_others(mut self) -> Self {
        self.deletable = Deletable::All;
        self
    }

    /// Returns the animation that is submitted.
    pub fn animation(&self) -> &Animation {
        &self.animation
    }
}

impl<S: Store, C: Clock> Client<'_, S, C> {
    /// Returns the changes that [`submit`](Self::submit) would make.
    ///
    /// # Errors
    /// The errors of the store.
    pub async fn preview(&self, submission: &Submission) -> Result<Preview> {
        let Difference { changed, surplus, same } =
            self.compare(&submission.animation, &submission.files).await?;
        Ok(Preview { upload: changed, delete: surplus, unchanged: same.len() as u64 })
    }

    /// Makes the bucket's folder as wanted, and reports the progress to `report`.
    ///
    /// # Errors
    /// [`Error::WouldDelete`] before anything is changed; the errors of the store; [`Error::Read`] or
    /// [`Error::FileChanged`] if a file can no longer be read or has changed.
    pub async fn submit(
        &self,
        submission: &Submission,
        mut report: impl FnMut(Sending),
    ) -> Result<Submitted> {
        let Submission { animation, files, deletable } = submission;
        let Difference { mut changed, surplus, same: mut versions } = self.compare(animation, files).await?;
        let may_go = |key: &String| match deletable {
            Deletable::None => false,
            Deletable::These(keys) => keys.contains(key),
            Deletable::All => true,
        };
        let keys: Vec<String> = surplus.iter().filter(|key| !may_go(key)).cloned().collect();
        if !keys.is_empty() {
            return Err(Error::WouldDelete { keys });
        }
        if !surplus.is_empty() {
            self.delete(&surplus, |_| {}).await?;
            report(Sending::Deleted { scripts: surplus.len() as u64 });
        }
        let unchanged = versions.len() as u64;
        let settings = animation.settings();
        if let Some(place) = changed.iter().position(|key| *key == settings) {
            changed.remove(place);
            versions.extend(self.send(std::slice::from_ref(&settings), files, |_| {}).await?);
        }
        let total = changed.len() as u64;
        if total > 0 {
            report(Sending::Uploading { done: 0, total });
        }
        let (first, last): (Vec<String>, Vec<String>) =
            changed.into_iter().partition(|key| Uploaded::is_file(key));
        let mut sent = 0;
        for keys in [first, last] {
            let show = |done| report(Sending::Uploading { done: sent + done, total });
            versions.extend(self.send(&keys, files, show).await?);
            sent += keys.len() as u64;
        }
        report(Sending::Finished { uploaded: total, unchanged });
        Ok(Submitted { versions })
    }

    /// Compares the objects directly in the animation's folder with the wanted ones.
    async fn compare(&self, animation: &Animation, files: &BTreeMap<String, File>) -> Result<Difference> {
        let listing = self.list(ListRequest::level(animation.scripts())).await?;
        let there: BTreeMap<String, Listed> =
            listing.objects.into_iter().map(|object| (object.key.clone(), object)).collect();
        let is_ours = |key: &&String| matches!(key.parse(), Ok(Key::Script { .. } | Key::Settings { .. }));
        let surplus = there.keys().filter(is_ours).filter(|key| !files.contains_key(*key)).cloned();
        let mut difference = Difference { surplus: surplus.collect(), ..Difference::default() };
        let looks = files.iter().map(|(key, file)| {
            let there = there.get(key);
            async move { Ok::<_, Error>((key.clone(), self.version_if_same(key, file, there).await?)) }
        });
        let looks: Vec<_> = looks.collect();
        let mut looks = stream::iter(looks).buffered(SIDE_BY_SIDE);
        while let Some((key, same)) = looks.try_next().await? {
            match same {
                Some(version) => _ = difference.same.insert(key, version),
                None => difference.changed.push(key),
            }
        }
        Ok(difference)
    }

    /// Returns the object's version if it holds the file.
    async fn version_if_same(&self, key: &str, file: &File, there: Option<&Listed>) -> Result<Option<ETag>> {
        let Some(there) = there.filter(|there| there.size == file.size()) else { return Ok(None) };
        if there.etag.as_str() == file.digest() {
            return Ok(Some(there.etag.clone()));
        }
        let info = self.store.head(key).await?;
        let is_same = info.metadata.get(DIGEST).is_some_and(|digest| digest == file.digest());
        Ok(is_same.then_some(info.etag))
    }

    /// Puts files, several at once, and reports the number put after each. Returns their versions.
    async fn send(
        &self,
        keys: &[String],
        files: &BTreeMap<String, File>,
        mut report: impl FnMut(u64),
    ) -> Result<BTreeMap<String, ETag>> {
        let files = keys.iter().filter_map(|key| Some((key, files.get(key)?)));
        let largest = files.clone().map(|(_, file)| file.memory()).max().unwrap_or(1).max(1);
        let at_once = usize::try_from(UNDER_WAY / largest).unwrap_or(SIDE_BY_SIDE).clamp(1, SIDE_BY_SIDE);
        let puts = files.map(|(key, file)| async move {
            Ok::<_, Error>((key.clone(), file.send(self.store, key).await?))
        });
        let puts: Vec<_> = puts.collect();
        let mut puts = stream::iter(puts).buffer_unordered(at_once);
        let mut versions = BTreeMap::new();
        while let Some((key, version)) = puts.try_next().await? {
            versions.insert(key, version);
            report(versions.len() as u64);
        }
        Ok(versions)
    }

    /// Deletes objects, several at once, and reports the number deleted after each.
    pub(crate) async fn delete(&self, keys: &[String], mut report: impl FnMut(u64)) -> Result<()> {
        let deletions: Vec<_> = keys.iter().map(|key| self.store.delete(key)).collect();
        let mut deletions = stream::iter(deletions).buffer_unordered(SIDE_BY_SIDE);
        let mut gone = 0;
        while let Some(()) = deletions.try_next().await? {
            gone += 1;
            report(gone);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;
    use rayfold_pipeline::store::PutOptions;

    fn submission(scripts: &[(&str, &str)], settings: &str) -> Submission {
        let scripts =
            scripts.iter().map(|(name, text)| (ScriptName::new(name).unwrap(), File::of_text(*text)));
        Submission::new(Animation::new("film").unwrap(), scripts, File::of_text(settings)).unwrap()
    }

    async fn submit(world: &World, scripts: &[(&str, &str)], settings: &str) -> (Submitted, Vec<Sending>) {
        let mut reports = Vec::new();
        let submission = submission(scripts, settings).deleting_all_others();
        let submitted = world.client().submit(&submission, |sending| reports.push(sending)).await.unwrap();
        (submitted, reports)
    }

    #[tokio::test]
    async fn the_folder_becomes_equal_and_only_what_changed_is_uploaded() {
        let world = World::new();
        world.put("scripts/film/old.txt", "old").await;
        world.put("scripts/film/notes.md", "not ours").await;
        world.put("scripts/film/2/1.txt", "another animation's").await;
        let (submitted, reports) = submit(&world, &[("1", "a"), ("2", "b")], "{}").await;
        assert_eq!(reports.first(), Some(&Sending::Deleted { scripts: 1 }));
        assert_eq!(reports.last(), Some(&Sending::Finished { uploaded: 2, unchanged: 0 }));
        assert!(reports.contains(&Sending::Uploading { done: 2, total: 2 }));
        let kept = ["scripts/film/2/1.txt", "scripts/film/notes.md"];
        let mut keys: Vec<&str> = submitted.versions.keys().map(String::as_str).chain(kept).collect();
        keys.sort_unstable();
        assert_eq!(world.keys("scripts/").await, keys);

        world.requests.clear();
        let (again, reports) = submit(&world, &[("1", "a"), ("2", "b")], "{}").await;
        assert_eq!(reports, [Sending::Finished { uploaded: 0, unchanged: 3 }]);
        assert_eq!(again, submitted);
        assert!(!world.requests.seen().iter().any(|request| request.starts_with("put")));

        let (changed, reports) = submit(&world, &[("1", "A"), ("2", "b")], "{}").await;
        assert_eq!(reports.last(), Some(&Sending::Finished { uploaded: 1, unchanged: 2 }));
        assert_ne!(changed.versions["scripts/film/1.txt"], submitted.versions["scripts/film/1.txt"]);
    }

    #[tokio::test]
    async fn scripts_of_others_are_not_deleted_unasked() {
        let world = World::new();
        for name in ["mine", "other1", "other2"] {
            world.put(&format!("scripts/film/{name}.txt"), name).await;
        }
        let others = ["scripts/film/other1.txt", "scripts/film/other2.txt"].map(String::from);
        let before = world.keys("").await;
        let wanted = || submission(&[("mine", "changed")], "{}");
        let preview = world.client().preview(&wanted()).await.unwrap();
        let upload = ["scripts/film/animation.json", "scripts/film/mine.txt"].map(String::from).to_vec();
        assert_eq!(preview, Preview { upload, delete: others.to_vec(), unchanged: 0 });

        let refused = world.client().submit(&wanted(), |_| {}).await;
        assert!(matches!(refused, Err(Error::WouldDelete { keys }) if keys == others));
        // Permission to delete one script is no permission to delete another.
        let half = wanted().deleting([others[0].clone()]);
        let refused = world.client().submit(&half, |_| {}).await;
        assert!(matches!(refused, Err(Error::WouldDelete { keys }) if keys == others[1..]));
        assert_eq!(world.keys("").await, before);
        let mine = world.store.get("scripts/film/mine.txt").await.unwrap().body;
        assert_eq!(mine, "mine", "nothing was uploaded either");

        world.client().submit(&wanted().deleting(others), |_| {}).await.unwrap();
        assert_eq!(world.keys("scripts/").await, ["scripts/film/animation.json", "scripts/film/mine.txt"]);
    }

    #[tokio::test]
    async fn deletions_go_first_then_the_settings_then_the_scripts() {
        let world = World::new();
        world.put("scripts/film/0.txt", "old").await;
        world.requests.clear();
        submit(&world, &[("1", "a")], "{}").await;
        let mut seen = world.requests.seen();
        seen.retain(|request| !request.starts_with("list"));
        let expected =
            ["delete scripts/film/0.txt", "put scripts/film/animation.json", "put scripts/film/1.txt"];
        assert_eq!(seen, expected);
    }

    #[tokio::test]
    async fn files_that_scripts_name_go_before_the_scripts() {
        let world = World::new();
        let wanted = |earth: &str| {
            let files = [("earth.png".to_owned(), File::of_text(earth))];
            submission(&[("1", "a")], "{}").with_files(files).unwrap()
        };
        let puts = |world: &World| {
            let mut seen = world.requests.seen();
            seen.retain(|request| request.starts_with("put"));
            seen
        };
        world.client().submit(&wanted("blue"), |_| {}).await.unwrap();
        let order = ["animation.json", "earth.png", "1.txt"].map(|name| format!("put scripts/film/{name}"));
        assert_eq!(puts(&world), order);
        world.requests.clear();
        world.client().submit(&wanted("green"), |_| {}).await.unwrap();
        assert_eq!(puts(&world), ["put scripts/film/earth.png"], "nothing else has changed");
        let hidden = [(".earth".to_owned(), File::of_text(""))];
        let refused = submission(&[], "{}").with_files(hidden).unwrap_err();
        assert!(refused.to_string().contains("scripts name no such file"), "{refused}");
    }

    /// With customer-managed encryption or parts, the entity tag is not the MD5. The memory store's never is.
    #[tokio::test]
    async fn an_object_of_other_tags_and_no_digest_is_sent_again() {
        let world = World::new();
        let key = "scripts/film/1.txt";
        world.store.put(key, "a".into(), PutOptions::always()).await.unwrap();
        let (_, reports) = submit(&world, &[("1", "a")], "{}").await;
        assert_eq!(reports.last(), Some(&Sending::Finished { uploaded: 1, unchanged: 0 }));
        assert!(world.store.head(key).await.unwrap().metadata.contains_key(DIGEST));
    }

    #[test]
    fn names_that_the_pipeline_refuses_are_refused_before_anything_is_sent() {
        let long = ScriptName::new(&"x".repeat(900)).unwrap();
        let submission =
            Submission::new(Animation::new("film").unwrap(), [(long, File::of_text(""))], File::of_text(""));
        assert!(submission.unwrap_err().to_string().contains("longer than 900 bytes"));
    }

    #[tokio::test]
    async fn settings_say_how_many_frames_there_are() {
        let (world, settings) = (World::new(), AnimationSettings::new(None, 25.0, 3).unwrap());
        let file = settings_with_frames(&settings, 7).unwrap();
        file.send(&world.store, "k").await.unwrap();
        let sent = world.store.get("k").await.unwrap();
        let parsed = rayfold_scene::parse_settings("animation.json", &sent.body);
        assert_eq!(parsed.settings, AnimationSettings::new(Some(7), 25.0, 3).ok());
        assert!(matches!(settings_with_frames(&settings, 0), Err(Error::Settings(_))));
    }
}
