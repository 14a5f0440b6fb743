//! Looking at an animation again and again until it is what was asked for.

use std::time::{Duration, Instant};

use rayfold_pipeline::assemble::generation_of;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Manifest, Status};
use rayfold_pipeline::store::{ETag, ObjectInfo, S3Store, Store};

use super::found;

/// An animation as its manifest and its GIF show it.
#[derive(Debug)]
pub(crate) struct Watch<'a> {
    store: &'a S3Store,
    animation: &'a Animation,
    version: Option<ETag>,
    /// As last seen.
    pub(crate) manifest: Option<Manifest>,
    /// As last seen.
    pub(crate) gif: Option<ObjectInfo>,
    started: Instant,
}

impl<'a> Watch<'a> {
    pub(crate) fn new(store: &'a S3Store, animation: &'a Animation) -> Self {
        Self { store, animation, version: None, manifest: None, gif: None, started: Instant::now() }
    }

    /// Looks. The manifest, which may be large, is read only when it has changed, the GIF's version only once all
    /// frames are drawn. Says whether anything changed.
    ///
    /// # Errors
    /// Those of the store.
    pub(crate) async fn look(&mut self) -> rayfold_pipeline::Result<bool> {
        let key = self.animation.manifest();
        // At first a whole GET, whose refusal says more than that of a HEAD.
        let is_known = match &self.version {
            Some(_) => found(self.store.head(&key).await)?.map(|info| info.etag) == self.version,
            None => false,
        };
        let mut changed = false;
        if !is_known {
            let object = found(self.store.get(&key).await)?;
            let version = object.as_ref().map(|object| object.info.etag.clone());
            changed = version != self.version;
            self.version = version;
            self.manifest =
                object.map(|object| Manifest::decode(self.animation, &object.body)).transpose()?;
        }
        if self.manifest.as_ref().is_some_and(|m| m.head.is_terminal()) {
            let gif = found(self.store.head(&self.animation.gif()).await)?;
            changed |= gif != self.gif;
            self.gif = gif;
        }
        Ok(changed)
    }

    /// The same, but a store that is busy or out of reach for a moment is no reason to give up.
    ///
    /// # Errors
    /// When the store refuses.
    pub(crate) async fn look_patiently(&mut self) -> rayfold_pipeline::Result<bool> {
        match self.look().await {
            Err(error) if error.is_retryable() && self.started.elapsed() < Duration::from_secs(3600) => {
                Ok(false)
            }
            answer => answer,
        }
    }

    /// The GIF shows what the manifest says.
    pub(crate) fn is_current(&self) -> bool {
        let generation = self.manifest.as_ref().map(|manifest| manifest.head.generation.as_str());
        generation.is_some() && generation_of(self.gif.as_ref()) == generation
    }

    /// Nothing more will happen unless somebody changes something.
    pub(crate) fn is_settled(&self) -> bool {
        match self.manifest.as_ref().map(|manifest| manifest.head.status) {
            None | Some(Status::Waiting | Status::Rendering) => false,
            Some(Status::Done) => self.is_current(),
            Some(Status::Empty) => self.gif.is_none(),
            Some(Status::Failed | Status::Refused) => true,
        }
    }

    /// Waits before the next look: a moment at first, longer when it takes long anyway.
    pub(crate) async fn pause(&self) {
        let pause = (self.started.elapsed() / 20).clamp(Duration::from_millis(100), Duration::from_secs(2));
        tokio::time::sleep(pause).await;
    }
}
