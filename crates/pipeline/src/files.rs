//! The files that scripts name, as the protocol sees them.
//!
//! A script that names files is drawn from itself and from those files. Its *version* is therefore its entity tag,
//! followed by the hash of a *set* of files: each file with a hash of its content, or that the file is absent. The
//! receipts `files-…` of a version contain the set, so a listing alone shows the current version of a script: the one
//! whose set agrees with the files in the listing. If none agrees, the version is the entity tag alone. It has no
//! result, so the frame is pending.
//!
//! The set is complete: the files to which a model refers follow from the model's content, and so from its entity tag.
//! The set contains no other files. So all processes give the same files the same version, whatever they have read
//! before.
//!
//! Invariant: a set is put before any result of its version, and the files are checked once more after the set was put.
//! The check detects a file that changed before it. If a file changes later, its event finds the set and triggers the
//! script.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroU64;
use std::sync::Arc;

use bytes::Bytes;

use crate::invocation::{Invocation, Mutation};
use crate::keys::{Animation, Entry, FileList, Key, NameHash, Receipt, ScriptName, Tag, VersionHash};
use crate::reconcile::{FileFound, ReceiptFound, Scripts};
use crate::render::{File, Files, Renderer};
use crate::store::{ETag, Store};
use crate::{Clock, Error, Result, Timestamp};

/// The maximum number of files that a receipt names. With more, its key would be too long for some stores.
const PER_RECEIPT: usize = 4;

/// The maximum number of times that files are read again because they changed meanwhile.
const MAX_READS: u32 = 8;

/// Returns the set of files that a drawing has read, in the order of the hash in its version.
fn set_of(files: &BTreeMap<String, Option<File>>) -> Vec<Entry> {
    let entry = |(name, file): (&String, &Option<File>)| {
        (NameHash::of(name), file.as_ref().map(|file| VersionHash::of(&file.version)))
    };
    let mut set: Vec<Entry> = files.iter().map(entry).collect();
    set.sort();
    set
}

/// A set as the receipts of a listing contain it.
#[derive(Default)]
struct SetSeen<'a> {
    numbers: BTreeSet<NonZeroU64>,
    of: Option<NonZeroU64>,
    entries: BTreeSet<&'a Entry>,
    pixels: u32,
    modified: Timestamp,
}

impl SetSeen<'_> {
    fn is_whole(&self) -> bool {
        self.of.is_some_and(|of| self.numbers.len() as u64 == of.get())
    }
}

/// The sets of files of all versions of scripts, from the receipts of a listing.
pub(crate) struct FileSets<'a>(BTreeMap<(&'a ScriptName, &'a str), BTreeMap<&'a ETag, SetSeen<'a>>>);

impl<'a> FileSets<'a> {
    pub(crate) fn of(receipts: &'a [ReceiptFound]) -> Self {
        let mut sets: BTreeMap<_, BTreeMap<&ETag, SetSeen<'_>>> = BTreeMap::new();
        for found in receipts {
            let Receipt::Files { name, tag, list } = &found.receipt else { continue };
            let of_script = sets.entry((name, tag.version.script())).or_default();
            let seen = of_script.entry(&tag.version).or_default();
            seen.numbers.insert(list.number);
            seen.of = Some(list.of);
            seen.entries.extend(&list.entries);
            seen.pixels = seen.pixels.max(tag.pixels);
            seen.modified = seen.modified.max(found.modified);
        }
        FileSets(sets)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns whether any set has this file.
    fn names(&self, file: &NameHash) -> bool {
        self.0.values().flat_map(BTreeMap::values).any(|set| set.entries.iter().any(|(name, _)| name == file))
    }

    /// The files of a version's set.
    fn files_of(&self, name: &ScriptName, version: &ETag) -> Vec<&NameHash> {
        let set = self.0.get(&(name, version.script())).and_then(|sets| sets.get(version));
        set.into_iter().flat_map(|set| set.entries.iter().map(|(name, _)| name)).collect()
    }

    /// Returns the version of a script whose set agrees with the files of a folder. If two renderers have read a model
    /// differently, the version of the newer one is returned.
    pub(crate) fn current(
        &self,
        name: &ScriptName,
        script: &ETag,
        files: &BTreeMap<NameHash, FileFound>,
    ) -> Option<&'a ETag> {
        let sets = self.0.get(&(name, script.as_str()))?;
        let agrees = |set: &SetSeen<'_>| {
            set.is_whole()
                && set
                    .entries
                    .iter()
                    .all(|(name, version)| files.get(name).map(|found| &found.version) == version.as_ref())
        };
        let current = sets.iter().filter(|(_, set)| agrees(set)).max_by_key(|(_, set)| set.pixels);
        current.map(|(version, _)| *version)
    }

    /// Returns the version that a script will most likely have, if one of its sets has this file. It is made of the
    /// files that the script's newest set names, with their current contents.
    fn expected(
        &self,
        name: &ScriptName,
        script: &ETag,
        file: &NameHash,
        files: &BTreeMap<NameHash, FileFound>,
    ) -> Option<ETag> {
        let sets = self.0.get(&(name, script.as_str()))?;
        sets.values().find(|set| set.entries.iter().any(|(name, _)| name == file))?;
        let newest = sets.values().filter(|set| set.is_whole()).max_by_key(|set| set.modified);
        let now = |name: &NameHash| files.get(name).map(|found| found.version.clone());
        let names: BTreeSet<&NameHash> = newest?.entries.iter().map(|(name, _)| name).collect();
        let set: Vec<Entry> = names.into_iter().map(|name| (name.clone(), now(name))).collect();
        Some(script.with_files(&set))
    }
}

/// Returns whether a version of a script is drawn, or invocations are drawing it. Invocations that began before a file
/// was `changed` do not count, because they may have ended for another version. Without a time the file is absent now.
fn is_drawn(
    receipts: &[ReceiptFound],
    name: &ScriptName,
    version: &ETag,
    changed: Option<Timestamp>,
) -> bool {
    let (mut is_taken, mut is_cut) = (false, false);
    for found in receipts.iter().filter(|found| found.receipt.is_of(name, version)) {
        let is_newer = changed.is_some_and(|changed| found.modified > changed);
        match found.receipt {
            Receipt::Frame { .. } | Receipt::Fault { .. } | Receipt::Waits { .. } => return true,
            Receipt::Split { .. } => return is_newer,
            Receipt::Cut { .. } => is_cut |= !is_newer,
            // A store may tell times in seconds: a change and what follows it may have the same.
            Receipt::Taken { .. } => is_taken |= changed.is_some_and(|changed| found.modified >= changed),
            _ => {}
        }
    }
    is_taken && !is_cut
}

impl Scripts {
    /// Gives each script that names files the version whose set agrees with the files of the same listing.
    pub(crate) fn resolve(&mut self, receipts: &[ReceiptFound]) {
        let sets = FileSets::of(receipts);
        if sets.is_empty() {
            return;
        }
        for script in &mut self.found {
            if let Some(version) = sets.current(&script.name, &script.version, &self.files) {
                script.version = version.clone();
            }
        }
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Returns the version of a script with this entity tag, by a listing of its receipts and, if it names files, of
    /// its folder.
    pub(crate) async fn current_version(
        &self,
        animation: &Animation,
        name: &ScriptName,
        script: ETag,
    ) -> Result<ETag> {
        let receipts = self.receipts_of_all_versions(animation, name, &script).await?;
        let agreed = self.agreed_version(animation, name, &script, &receipts).await?;
        Ok(agreed.map_or(script, |(version, _)| version))
    }

    /// Returns the version whose set of files agrees with the folder, if there is one, and the earliest time since when
    /// it may have agreed. Without sets nothing is listed.
    pub(crate) async fn agreed_version(
        &self,
        animation: &Animation,
        name: &ScriptName,
        script: &ETag,
        receipts: &[ReceiptFound],
    ) -> Result<Option<(ETag, Timestamp)>> {
        let sets = FileSets::of(receipts);
        if sets.is_empty() {
            return Ok(None);
        }
        let (scripts, _) = self.list_scripts(animation, &[]).await?;
        let Some(version) = sets.current(name, script, &scripts.files) else { return Ok(None) };
        // No listing shows since when a file is absent.
        let since = |file: &NameHash| {
            scripts.files.get(file).map_or_else(|| self.clock.now(), |found| found.modified)
        };
        let since = sets.files_of(name, version).into_iter().map(since).max();
        Ok(Some((version.clone(), since.unwrap_or_default())))
    }

    /// Reads the files that a script's drawing needs, and determines the script's version with them. If `agreed` is an
    /// existing version and the files are those of it, nothing is written. If they are not, and the event is about that
    /// version alone (`is_only`), nothing is written either, because nothing is to be drawn.
    ///
    /// Kept files may only show that the files are those of the agreed version. If they are not, all files are read
    /// again.
    ///
    /// # Errors
    ///
    /// [`Error::Conflict`] if the files change as fast as they are read.
    pub(crate) async fn read_files<R: Renderer>(
        &self,
        renderer: &R,
        animation: &Animation,
        name: &ScriptName,
        script: &ETag,
        body: &Bytes,
        (agreed, is_only): (Option<&ETag>, bool),
    ) -> Result<(ETag, Files)> {
        let mut may_keep = true;
        for _ in 0..MAX_READS {
            let (files, are_kept) = self.read_once(renderer, animation, (name, body), may_keep).await?;
            may_keep = false;
            if files.is_empty() {
                return Ok((script.clone(), Files::default()));
            }
            let set = set_of(&files);
            let version = script.with_files(&set);
            if agreed == Some(&version) || is_only && !are_kept {
                return Ok((version, Arc::new(files)));
            }
            if is_only || are_kept && agreed.is_some() {
                continue;
            }
            self.put_set(animation, name, &version, &set).await?;
            if self.are_current(animation, &files).await? {
                return Ok((version, Arc::new(files)));
            }
        }
        Err(Error::Conflict { key: animation.script(name) })
    }

    /// Reads the files that a script's drawing needs. Returns also whether any of them was kept from an earlier
    /// drawing.
    async fn read_once<R: Renderer>(
        &self,
        renderer: &R,
        animation: &Animation,
        (name, body): (&ScriptName, &Bytes),
        may_keep: bool,
    ) -> Result<(BTreeMap<String, Option<File>>, bool)> {
        let (mut files, mut are_kept) = (BTreeMap::new(), false);
        loop {
            let needed = renderer.needed(name, body.clone(), Arc::new(files.clone())).await?;
            let missing: Vec<_> = needed.iter().filter(|file| !files.contains_key(*file)).cloned().collect();
            if missing.is_empty() {
                // What an older content of a file has asked for is no part of the version.
                files.retain(|file, _| needed.contains(file));
                return Ok((files, are_kept));
            }
            for file in missing {
                let kept = renderer.kept(&animation.file(&file)).filter(|_| may_keep);
                are_kept |= kept.is_some();
                let content = match kept {
                    Some(kept) => Some(kept),
                    None => self.file(renderer, animation, &file).await?,
                };
                files.insert(file, content);
            }
        }
    }

    async fn file<R: Renderer>(
        &self,
        renderer: &R,
        animation: &Animation,
        name: &str,
    ) -> Result<Option<File>> {
        let key = animation.file(name);
        let object = self.get_start(&key, renderer.most_file_bytes()).await?;
        let file = object.map(|object| File { version: object.info.etag, body: object.body });
        renderer.keep(&key, file.as_ref());
        Ok(file)
    }

    /// Records that this version is being drawn, so that a file's event triggers no other invocation for it.
    pub(crate) async fn take_version(
        &self,
        animation: &Animation,
        name: &ScriptName,
        version: &ETag,
    ) -> Result<()> {
        let tag = Tag { version: version.clone(), pixels: self.policy.pixels };
        let key = animation.receipt(&Receipt::Taken { name: name.clone(), tag });
        self.put_receipt(&key, Bytes::new(), "text/plain").await.map(drop)
    }

    async fn put_set(
        &self,
        animation: &Animation,
        name: &ScriptName,
        version: &ETag,
        set: &[Entry],
    ) -> Result<()> {
        let tag = Tag { version: version.clone(), pixels: self.policy.pixels };
        let of = set.len().div_ceil(PER_RECEIPT) as u64;
        for (entries, number) in set.chunks(PER_RECEIPT).zip(1..) {
            let (Some(number), Some(of)) = (NonZeroU64::new(number), NonZeroU64::new(of)) else { continue };
            let list = FileList { number, of, entries: entries.to_vec() };
            let receipt = Receipt::Files { name: name.clone(), tag: tag.clone(), list };
            self.put_receipt(&animation.receipt(&receipt), Bytes::new(), "text/plain").await?;
        }
        Ok(())
    }

    async fn are_current(
        &self,
        animation: &Animation,
        files: &BTreeMap<String, Option<File>>,
    ) -> Result<bool> {
        if self.breaks(Mutation::FilesNotLookedAtAgain) {
            return Ok(true);
        }
        for (name, file) in files {
            let now = self.head(&animation.file(name)).await?.map(|info| info.etag);
            if now.as_ref() != file.as_ref().map(|file| &file.version) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Triggers the scripts whose files have changed with this one. Returns whether any script names it.
    pub(crate) async fn wake_for_file(&self, animation: &Animation, file: &str) -> Result<bool> {
        let file = NameHash::of(file);
        let receipts = self.list_results(animation).await?;
        let sets = FileSets::of(&receipts);
        if !sets.names(&file) {
            return Ok(false);
        }
        let (scripts, _) = self.list_scripts(animation, &[]).await?;
        let changed = scripts.files.get(&file).map(|found| found.modified);
        for script in &scripts.found {
            let expected = match sets.current(&script.name, &script.version, &scripts.files) {
                Some(version) if is_drawn(&receipts, &script.name, version, changed) => None,
                // The writer of the set has found other files after that.
                Some(version) => Some(version.clone()),
                None => sets.expected(&script.name, &script.version, &file, &scripts.files),
            };
            if let Some(version) = expected {
                self.wake_script(animation, &script.name, version, changed).await?;
            }
        }
        Ok(true)
    }

    /// Triggers a script, unless it was triggered for this version since the file was `changed`.
    async fn wake_script(
        &self,
        animation: &Animation,
        name: &ScriptName,
        version: ETag,
        changed: Option<Timestamp>,
    ) -> Result<()> {
        let tag = Tag { version, pixels: self.policy.pixels };
        let key = Key::Wake { animation: animation.clone(), name: name.clone(), tag }.to_string();
        let body: Bytes = serde_json::json!({ "woken_by": self.request_id() }).to_string().into();
        if self.put_receipt(&key, body.clone(), "application/json").await?.is_some() {
            return Ok(());
        }
        let woken = self.head(&key).await?.map(|info| info.modified);
        if woken.is_none() || changed.is_none() || woken <= changed {
            self.put(&key, body).await?;
        }
        Ok(())
    }
}
