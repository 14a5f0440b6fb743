//! A watch: polls an animation until it is done.

use std::collections::BTreeMap;
use std::time::Duration;

use rayfold_pipeline::assemble::is_current;
use rayfold_pipeline::keys::{Animation, Key, Uploaded};
use rayfold_pipeline::manifest::{Head, Manifest, Status};
use rayfold_pipeline::store::{ETag, ListRequest, ObjectInfo, Store};
use rayfold_pipeline::{Clock, Timestamp, found, script_versions};
use rayfold_scene::{AnimationSettings, Container};

use crate::client::Client;
use crate::error::{Error, Result};
use crate::submit::Submitted;

/// After this long without progress, [`Waiting::Quiet`] is reported.
const UNUSUAL: Duration = Duration::from_secs(20);

/// The time that an upload which has just begun may take to become visible.
const GRACE: Duration = Duration::from_secs(5);

/// The time for which a store may be busy or unreachable.
const PATIENCE: Duration = Duration::from_secs(3600);

/// The state of an animation as its manifest and its files show it.
#[derive(Debug)]
pub struct Watch<'a, S, C> {
    client: Client<'a, S, C>,
    animation: Animation,
    version: Option<ETag>,
    manifest: Option<Manifest>,
    is_unreadable: bool,
    files: BTreeMap<Container, ObjectInfo>,
    is_behind: bool,
    has_looked: bool,
    started: Timestamp,
}

/// The progress of the frames of a submission.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Waiting {
    /// The functions render the submitted frames.
    Frames {
        /// The number of frames that are drawn or failed.
        done: u64,
        /// The number of frames of the animation.
        total: u64,
    },
    /// Nothing has happened for this long.
    Quiet(Duration),
}

/// The outcome of a submission.
#[derive(Debug, Clone, PartialEq)]
pub enum Ended {
    /// The files that `animation.json` asks for are complete, in its order.
    Files(Vec<(Container, ObjectInfo)>),
    /// There are no files; the manifest has the reasons.
    Failed(Box<Manifest>),
}

impl<'a, S: Store, C: Clock> Watch<'a, S, C> {
    /// Makes a watch. It knows nothing before the first poll.
    pub fn new(client: Client<'a, S, C>, animation: Animation) -> Self {
        let started = client.clock.now();
        Self {
            client,
            animation,
            version: None,
            manifest: None,
            is_unreadable: false,
            files: BTreeMap::new(),
            is_behind: false,
            has_looked: false,
            started,
        }
    }

    /// Returns the animation that is watched.
    pub fn animation(&self) -> &Animation {
        &self.animation
    }

    /// Returns the manifest as of the last poll that read it.
    pub fn manifest(&self) -> Option<&Manifest> {
        self.manifest.as_ref()
    }

    /// Returns whether there is a manifest that could not be read.
    pub fn is_unreadable(&self) -> bool {
        self.is_unreadable
    }

    /// Returns the files that are to be made of the animation, in the order of `animation.json`.
    pub fn outputs(&self) -> &[Container] {
        let head = self.manifest.as_ref().map(|manifest| &manifest.head);
        head.map_or(AnimationSettings::DEFAULT_OUTPUTS, Head::outputs)
    }

    /// Returns a file as of the last poll that read it.
    pub fn file(&self, output: Container) -> Option<&ObjectInfo> {
        self.files.get(&output)
    }

    /// Returns the age of a file.
    pub fn age(&self, output: Container) -> Option<Duration> {
        Some(self.client.clock.now().since(self.file(output)?.modified))
    }

    /// Polls once, and returns whether anything changed. Reads the manifest, which may be large, only if its entity
    /// tag has changed. Reads the versions of the files on the first call, and again once all frames are drawn.
    ///
    /// # Errors
    /// The errors of the store.
    pub async fn poll(&mut self) -> Result<bool> {
        let (store, key) = (self.client.store, self.animation.manifest());
        // The first request is a whole GET, because its refusal says more than that of a HEAD.
        let is_known = match &self.version {
            Some(_) => found(store.head(&key).await)?.map(|info| info.etag) == self.version,
            None => false,
        };
        let mut changed = false;
        if !is_known {
            let object = found(store.get(&key).await)?;
            let version = object.as_ref().map(|object| object.info.etag.clone());
            changed = version != self.version;
            // The functions rebuild an unreadable manifest. Until then nothing is known.
            self.manifest =
                object.as_ref().and_then(|object| Manifest::decode(&self.animation, &object.body).ok());
            self.is_unreadable = object.is_some() && self.manifest.is_none();
            self.version = version;
        }
        let is_first = !std::mem::replace(&mut self.has_looked, true);
        let is_terminal = self.manifest.as_ref().is_some_and(|manifest| manifest.head.is_terminal());
        if is_terminal || (is_first && self.version.is_some()) {
            let mut files = BTreeMap::new();
            for output in self.outputs() {
                if let Some(file) = found(store.head(&self.animation.output(*output)).await)? {
                    files.insert(*output, file);
                }
            }
            changed |= files != self.files;
            self.files = files;
        }
        Ok(changed)
    }

    /// Compares the manifest with the current scripts. Until the functions have seen an upload, the manifest and the
    /// files are about older scripts.
    ///
    /// # Errors
    /// The errors of the store.
    pub async fn compare(&mut self) -> Result<()> {
        let Some(manifest) = &self.manifest else { return Ok(()) };
        let versions = self.client.versions(&self.animation, manifest).await?;
        self.is_behind = !stands_for(manifest, &self.animation, &versions);
        Ok(())
    }

    /// Returns whether the last comparison found scripts that the functions have not seen.
    pub fn is_behind(&self) -> bool {
        self.is_behind
    }

    /// Polls once, but does not fail if the store is busy or unreachable for a moment.
    ///
    /// # Errors
    /// The permanent errors of the store.
    pub async fn poll_with_retry(&mut self) -> Result<bool> {
        match self.poll().await {
            Err(Error::Store(error)) if error.is_retryable() && self.elapsed() < PATIENCE => Ok(false),
            answer => answer,
        }
    }

    /// Polls with retries. If there is nothing, waits a moment for an upload that has just begun.
    ///
    /// # Errors
    /// [`Error::NoAnimation`] if there is still nothing then, and the permanent errors of the store.
    pub async fn look_for(&mut self) -> Result<bool> {
        let begun = self.client.clock.now();
        loop {
            let changed = self.poll_with_retry().await?;
            if self.version.is_some() {
                return Ok(changed);
            }
            match self.client.must_exist(&self.animation).await {
                Ok(()) => return Ok(changed),
                Err(Error::NoAnimation(_)) if self.client.clock.now().since(begun) < GRACE => {}
                Err(Error::Store(error)) if error.is_retryable() && self.elapsed() < PATIENCE => {}
                Err(error) => return Err(error),
            }
            self.pause().await;
        }
    }

    /// Returns whether all files show what the manifest says, and the manifest is about the newest scripts.
    pub fn is_current(&self) -> bool {
        self.outputs().iter().all(|output| self.has_current(*output))
    }

    /// Returns whether a file shows what the manifest says, and the manifest is about the newest scripts. An animation that is
    /// not done has no such file: what is there will be replaced or deleted.
    pub fn has_current(&self, output: Container) -> bool {
        let shows = |Manifest { head, .. }: &Manifest| {
            head.status == Status::Done && is_current(head, output, self.file(output))
        };
        !self.is_behind && self.manifest.as_ref().is_some_and(shows)
    }

    /// Returns whether nothing more will happen unless a script or an object is changed.
    pub fn is_settled(&self) -> bool {
        match self.manifest.as_ref().map(|manifest| manifest.head.status) {
            _ if self.is_behind => false,
            None | Some(Status::Waiting | Status::Rendering) => false,
            Some(Status::Done) => self.is_current(),
            Some(Status::Empty) => self.files.is_empty(),
            Some(Status::Failed | Status::Refused) => true,
        }
    }

    /// Waits before the next poll: a moment at first, longer if it has taken long already.
    pub async fn pause(&self) {
        let pause = (self.elapsed() / 20).clamp(Duration::from_millis(100), Duration::from_secs(2));
        self.client.clock.sleep(pause).await;
    }

    /// Returns the time since the watch was made.
    pub(crate) fn elapsed(&self) -> Duration {
        self.client.clock.now().since(self.started)
    }
}

impl<S: Store, C: Clock> Client<'_, S, C> {
    /// Returns the versions of the animation's scripts, with their files, and settings, by key. Only the receipts show the
    /// files of a version, which may all be absent. They are not listed if neither the folder nor this manifest has files.
    async fn versions(&self, animation: &Animation, manifest: &Manifest) -> Result<BTreeMap<String, ETag>> {
        let scripts = self.list(ListRequest::level(animation.scripts())).await?.objects;
        let has_files = scripts.iter().any(|object| Uploaded::is_file(&object.key))
            || manifest.frames.iter().any(|frame| frame.version.has_files());
        let receipts = match has_files {
            true => self.list(ListRequest::level(animation.frames())).await?.objects,
            false => Vec::new(),
        };
        let settings = scripts.iter().find(|object| object.key == animation.settings());
        let settings = settings.map(|object| (object.key.clone(), object.etag.clone()));
        let versions = script_versions(animation, scripts, receipts);
        let versions = versions.into_iter().map(|(name, version)| (animation.script(&name), version));
        Ok(versions.chain(settings).collect())
    }

    /// Waits until all files of the submission are made, or the manifest says why they will not be. Reports
    /// the progress to `report`.
    ///
    /// # Errors
    /// The permanent errors of the store, and [`Error::ChangedMeanwhile`] if the scripts are
    /// no longer those submitted.
    pub async fn wait(
        &self,
        animation: &Animation,
        submitted: &Submitted,
        mut report: impl FnMut(Waiting),
    ) -> Result<Ended> {
        let mut watch = Watch::new(*self, animation.clone());
        let mut last_change = self.clock.now();
        loop {
            if watch.poll_with_retry().await? {
                last_change = self.clock.now();
            }
            if let Some(manifest) = watch.manifest()
                && is_of_scripts(manifest, animation, &submitted.versions)
            {
                let head = &manifest.head;
                let total = head.total + head.not_uploaded();
                report(Waiting::Frames { done: head.done + head.failed, total });
                // The files may have changed since, and the functions not have seen it.
                let is_whole = !head.is_terminal()
                    || !manifest.frames.iter().any(|frame| frame.version.has_files())
                    || stands_for(manifest, animation, &self.versions(animation, manifest).await?);
                match head.status {
                    _ if !is_whole => {}
                    Status::Done if watch.is_current() => {
                        let made = |output: &Container| Some((*output, watch.file(*output)?.clone()));
                        return Ok(Ended::Files(watch.outputs().iter().filter_map(made).collect()));
                    }
                    Status::Failed | Status::Refused => {
                        return Ok(Ended::Failed(Box::new(manifest.clone())));
                    }
                    _ => {}
                }
            }
            if self.clock.now().since(last_change) > UNUSUAL {
                last_change = self.clock.now();
                self.must_be_unchanged(animation, &submitted.versions).await?;
                report(Waiting::Quiet(UNUSUAL));
            }
            watch.pause().await;
        }
    }

    async fn must_be_unchanged(
        &self,
        animation: &Animation,
        versions: &BTreeMap<String, ETag>,
    ) -> Result<()> {
        let listing = self.list(ListRequest::level(animation.scripts())).await?;
        let now: BTreeMap<_, _> =
            listing.objects.into_iter().map(|object| (object.key, object.etag)).collect();
        let gone = versions.iter().find(|(key, version)| now.get(*key) != Some(*version));
        let is_script = |key: &str| matches!(key.parse(), Ok(Key::Script { .. }));
        let new = now.keys().find(|key| is_script(key) && !versions.contains_key(*key));
        match gone.map(|(key, _)| key).or(new) {
            Some(key) => Err(Error::ChangedMeanwhile { key: key.clone() }),
            None => Ok(()),
        }
    }
}

/// Returns whether the manifest is about exactly these scripts and settings, whatever the files that the scripts name.
fn is_of_scripts(manifest: &Manifest, animation: &Animation, versions: &BTreeMap<String, ETag>) -> bool {
    let without_files = |version: &ETag| ETag::new(version.script());
    let frames = manifest.frames.iter();
    let mut seen: BTreeMap<String, ETag> =
        frames.map(|frame| (animation.script(&frame.script), without_files(&frame.version))).collect();
    seen.extend(manifest.head.settings.version.iter().map(|version| (animation.settings(), version.clone())));
    seen.iter().eq(versions.iter().filter(|(key, _)| !Uploaded::is_file(key)))
}

/// Returns whether the manifest is about exactly these versions of exactly these scripts and settings.
fn stands_for(manifest: &Manifest, animation: &Animation, versions: &BTreeMap<String, ETag>) -> bool {
    let mut seen: BTreeMap<String, &ETag> =
        manifest.frames.iter().map(|frame| (animation.script(&frame.script), &frame.version)).collect();
    if let Some(version) = &manifest.head.settings.version {
        seen.insert(animation.settings(), version);
    }
    seen.len() == versions.len() && seen.iter().all(|(key, version)| versions.get(key) == Some(*version))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;
    use crate::{File, Submission};
    use rayfold_pipeline::keys::ScriptName;

    async fn submitted(world: &World, scripts: &[(&str, &str)]) -> Submitted {
        let scripts =
            scripts.iter().map(|(name, text)| (ScriptName::new(name).unwrap(), File::of_text(*text)));
        let settings = File::of_text(r#"{"frames": 2}"#);
        let submission = Submission::new(world.film(), scripts, settings).unwrap();
        world.client().submit(&submission, |_| {}).await.unwrap()
    }

    #[tokio::test]
    async fn waiting_ends_with_the_gif_of_what_was_submitted() {
        let world = World::new();
        let submitted = submitted(&world, &[("1", "frame"), ("2", "frame 2")]).await;
        let mut reports = Vec::new();
        let client = world.client();
        let film = world.film();
        let ended = client.wait(&film, &submitted, |waiting| reports.push(waiting));
        let (ended, ()) = futures_util::future::join(ended, world.functions()).await;
        let Ended::Files(files) = ended.unwrap() else { panic!("no GIF") };
        let [(Container::Gif, gif)] = &files[..] else { panic!("{files:?}") };
        assert_eq!(*gif, world.store.head("animations/film.gif").await.unwrap());
        assert_eq!(reports.last(), Some(&Waiting::Frames { done: 2, total: 2 }));
    }

    #[tokio::test]
    async fn waiting_ends_with_the_manifest_of_what_fails() {
        let world = World::new();
        let submitted = submitted(&world, &[("1", "frame"), ("2", "bad")]).await;
        world.functions().await;
        let ended = world.client().wait(&world.film(), &submitted, |_| {}).await.unwrap();
        let Ended::Failed(manifest) = ended else { panic!("a GIF") };
        assert_eq!((manifest.head.status, manifest.head.failed), (Status::Failed, 1));
    }

    #[tokio::test]
    async fn silence_is_reported_and_others_changes_end_the_waiting() {
        let world = World::new();
        let submitted = submitted(&world, &[("1", "frame"), ("2", "frame")]).await;
        let reports = std::sync::Mutex::new(Vec::new());
        let (client, film) = (world.client(), world.film());
        let wait = client.wait(&film, &submitted, |waiting| reports.lock().unwrap().push(waiting));
        let meddle = async {
            while reports.lock().unwrap().is_empty() {
                tokio::task::yield_now().await;
            }
            world.put("scripts/film/3.txt", "frame").await;
        };
        let (ended, ()) = futures_util::future::join(wait, meddle).await;
        assert_eq!(reports.into_inner().unwrap(), [Waiting::Quiet(UNUSUAL)]);
        assert!(
            matches!(ended, Err(Error::ChangedMeanwhile { key }) if key == "scripts/film/3.txt"),
            "the third script is none of ours"
        );
    }

    #[tokio::test]
    async fn a_manifest_that_cannot_be_read_is_no_failure_but_nothing_known() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        world.put("manifests/film.json", "garbage").await;
        let mut watch = Watch::new(world.client(), world.film());
        assert!(watch.poll().await.unwrap());
        assert!(watch.is_unreadable() && !watch.is_settled() && !watch.is_current());
        world.functions().await;
        assert!(watch.poll().await.unwrap());
        assert!(!watch.is_unreadable() && watch.is_current());
    }

    #[tokio::test]
    async fn an_animation_that_does_not_exist_is_not_waited_for_for_ever() {
        let world = World::new();
        let mut watch = Watch::new(world.client(), world.film());
        assert!(matches!(watch.look_for().await, Err(Error::NoAnimation(name)) if name == world.film()));
        assert!(watch.elapsed() >= GRACE);

        // An upload within the grace period is waited for.
        let mut watch = Watch::new(world.client(), world.film());
        let upload = async {
            for _ in 0..10 {
                tokio::task::yield_now().await;
            }
            world.put("scripts/film/1.txt", "frame").await;
        };
        let (looked, ()) = futures_util::future::join(watch.look_for(), upload).await;
        assert!(looked.is_ok() && watch.manifest().is_none() && watch.elapsed() < GRACE);
    }

    #[tokio::test]
    async fn the_last_gif_is_seen_while_it_is_being_replaced() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        world.functions().await;
        let gif = world.store.head("animations/film.gif").await.unwrap();
        // Two frames are wanted, but only one is there.
        world.put("scripts/film/animation.json", r#"{"frames": 2}"#).await;
        world.functions().await;
        let watch = world.client().look(&[world.film()]).await.unwrap().remove(0);
        assert_eq!(watch.manifest().unwrap().head.status, Status::Waiting);
        assert_eq!(watch.file(Container::Gif), Some(&gif));
        assert!(!watch.is_current() && watch.age(Container::Gif).is_some());
    }

    #[tokio::test]
    async fn a_manifest_of_other_versions_is_not_what_was_submitted() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        world.functions().await;
        let mut watch = Watch::new(world.client(), world.film());
        assert!(watch.poll().await.unwrap() && !watch.poll().await.unwrap());
        let manifest = watch.manifest().unwrap();
        let version = manifest.frames[0].version.clone();
        let key = || "scripts/film/1.txt".to_owned();
        let is_it = |versions: &[(String, ETag)]| {
            stands_for(manifest, &world.film(), &versions.iter().cloned().collect())
        };
        assert!(is_it(&[(key(), version.clone())]));
        assert!(!is_it(&[(key(), ETag::new("other"))]));
        assert!(!is_it(&[]) && !is_it(&[(key(), version.clone()), (world.film().settings(), version)]));
    }
}
