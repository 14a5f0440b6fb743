//! Lists an animation: both prefixes at once, in ranges side by side when it is large. Reads the things that the
//! listing alone does not show (settings, the parts of split scripts, the reasons of faults).

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroU64;

use futures_util::future::try_join;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_scene::Container;

use crate::invocation::{Invocation, Known};
use crate::keys::{Animation, Key, NameHash, Part, Receipt, ScriptName, Tag, Uploaded, VersionHash};
use crate::manifest::{Fault, FrameState, MAX_SETTINGS_BYTES, Manifest, Reason, Rejected, Settings, Status};
use crate::reconcile::{FileFound, MARK_EVERY, ReceiptFound, Results, ScriptFound, Scripts, reconcile};
use crate::store::{ETag, ListPage, ListRequest, Listed, Listing, Object, Store};
use crate::{Clock, Error, Result, Timestamp};

/// The maximum number of listings of an animation whose receipts are replaced between the listing and their reading.
const LOOKS: u32 = 8;

/// The maximum number of rejected keys that a manifest names. Without this limit any user who may upload could make it
/// arbitrarily large.
const MAX_REJECTED: usize = 100;

/// The receipts of an animation that a listing shows.
#[derive(Debug, Clone)]
pub(crate) struct Receipts {
    pub(crate) found: Vec<ReceiptFound>,
    /// Whether the receipts of the parts of split scripts are included.
    pub(crate) has_parts: bool,
    has_lease: bool,
    has_sweep_lease: bool,
    marked: BTreeSet<Container>,
}

/// A listing of an animation and the manifest that follows from it.
#[derive(Debug)]
pub(crate) struct Observation {
    pub(crate) scripts: Scripts,
    pub(crate) results: Results,
    pub(crate) manifest: Manifest,
    /// The assembler's lease: an assembler waits or builds, or died doing so.
    pub(crate) has_lease: bool,
    /// The sweep's lease: a sweep deletes results, or died doing so.
    pub(crate) has_sweep_lease: bool,
    /// The files, besides the GIF, that may exist.
    pub(crate) marked: BTreeSet<Container>,
}

impl Receipts {
    fn of(animation: &Animation, listed: Vec<Listed>, has_parts: bool) -> Self {
        let has = |key: Key| {
            let key = key.to_string();
            listed.iter().any(|listed| listed.key == key)
        };
        let has_lease = has(Key::Lease { animation: animation.clone() });
        let has_sweep_lease = has(Key::SweepLease { animation: animation.clone() });
        let marks = Container::ALL.into_iter();
        let mark =
            |output: &Container| has(Key::OutputMark { animation: animation.clone(), output: *output });
        let marked = marks.filter(mark).collect();
        let found = listed.into_iter().filter_map(|listed| receipt(animation, listed)).collect();
        Receipts { found, has_parts, has_lease, has_sweep_lease, marked }
    }
}

impl Observation {
    /// The time when the newest script, or file beside it, was uploaded.
    pub(crate) fn newest_script(&self) -> Option<Timestamp> {
        let scripts = self.scripts.found.iter().map(|script| script.modified);
        scripts.chain(self.scripts.files.values().map(|file| file.modified)).max()
    }

    /// Whether nothing is uploaded, neither scripts nor settings.
    pub(crate) fn is_of_nothing(&self) -> bool {
        let Scripts { found, rejected, warnings, files: _ } = &self.scripts;
        let is_empty = found.is_empty() && rejected.is_empty() && warnings.is_empty();
        is_empty && self.manifest.head.settings == Settings::absent()
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Lists an animation and reconciles the listing. `known` is the manifest as last read. It saves requests, and does
    /// not affect the outcome.
    ///
    /// # Errors
    ///
    /// The errors of the store, and [`Error::Conflict`] if a receipt is replaced after each listing.
    pub(crate) async fn observe(&self, animation: &Animation, known: Option<&Known>) -> Result<Observation> {
        let mut pause = self.policy.request_pause;
        for _ in 0..LOOKS {
            let marks = known.map_or(&[][..], |known| &known.manifest.head.marks);
            let (scripts, receipts) =
                try_join(self.list_scripts(animation, marks), self.list_receipts(animation, marks)).await?;
            if let Some(observation) = self.amount(animation, known, scripts, receipts).await? {
                return Ok(observation);
            }
            self.clock.sleep(self.random.up_to(pause)).await;
            pause = pause.saturating_mul(2);
        }
        Err(Error::Conflict { key: animation.frames() })
    }

    /// Observes the animation with receipts that have already been listed. Returns `None` if one of them has been
    /// replaced since.
    pub(crate) async fn observe_with(
        &self,
        animation: &Animation,
        known: Option<&Known>,
        receipts: &Receipts,
    ) -> Result<Option<Observation>> {
        let marks = known.map_or(&[][..], |known| &known.manifest.head.marks);
        let scripts = self.list_scripts(animation, marks).await?;
        self.amount(animation, known, scripts, receipts.clone()).await
    }

    async fn amount(
        &self,
        animation: &Animation,
        known: Option<&Known>,
        (mut scripts, settings): (Scripts, Option<ETag>),
        receipts: Receipts,
    ) -> Result<Option<Observation>> {
        let settings = self.settings(animation, settings, known).await?;
        let Receipts { found, has_parts, has_lease, has_sweep_lease, marked } = receipts;
        let mut results = Results { receipts: found };
        scripts.resolve(&results.receipts);
        if !has_parts {
            self.add_parts(animation, &scripts, &mut results).await?;
        }
        let manifest = reconcile(animation, &scripts, &results, &settings);
        let mut manifest = manifest.bounded(self.policy.most_frames);
        let has_reasons = self.add_reasons(animation, &results, known, &mut manifest).await?;
        let observation = Observation { scripts, results, manifest, has_lease, has_sweep_lease, marked };
        Ok(has_reasons.then_some(observation))
    }

    /// The entity tags of the scripts on the first page of a listing.
    pub(crate) async fn scripts_on_a_page(&self, animation: &Animation) -> Result<Vec<(ScriptName, ETag)>> {
        let page = self.list(ListRequest::level(animation.scripts())).await?;
        let script = |listed: Listed| match Uploaded::of(&listed.key, listed.size) {
            Uploaded::Script(_, name) => Some((name, listed.etag)),
            _ => None,
        };
        Ok(page.objects.into_iter().filter_map(script).collect())
    }

    /// The receipts right below the animation's folder.
    pub(crate) async fn list_results(&self, animation: &Animation) -> Result<Vec<ReceiptFound>> {
        self.list_receipts(animation, &[]).await.map(|receipts| receipts.found)
    }

    /// Returns the receipts if a page shows them all, including those of parts if `has_parts`.
    pub(crate) async fn receipts_on_a_page(
        &self,
        animation: &Animation,
        has_parts: bool,
    ) -> Result<Option<Receipts>> {
        let request = ListRequest { delimiter: !has_parts, ..ListRequest::all(animation.frames()) };
        let ListPage { objects, next, .. } = self.list(request).await?;
        Ok(next.is_none().then(|| Receipts::of(animation, objects, has_parts)))
    }

    pub(crate) async fn list_scripts(
        &self,
        animation: &Animation,
        marks: &[ScriptName],
    ) -> Result<(Scripts, Option<ETag>)> {
        let bounds = marks.iter().map(|name| animation.script(name)).collect();
        Ok(scripts_of(animation, self.list_level(animation.scripts(), bounds).await?))
    }

    async fn list_receipts(&self, animation: &Animation, marks: &[ScriptName]) -> Result<Receipts> {
        let prefix = animation.frames();
        let bounds = marks.iter().map(|name| format!("{prefix}{name}@")).collect();
        let listed = self.list_level(prefix, bounds).await?;
        Ok(Receipts::of(animation, listed, false))
    }

    /// Lists the objects directly below a prefix. The ranges between the bounds are listed in parallel.
    async fn list_level(&self, prefix: String, mut bounds: Vec<String>) -> Result<Vec<Listed>> {
        bounds.sort();
        self.list_ranges(ListRequest::level(prefix), bounds).await
    }

    /// Reads a listing to its end. The ranges between the sorted bounds are read in parallel.
    pub(crate) async fn list_ranges(&self, request: ListRequest, bounds: Vec<String>) -> Result<Vec<Listed>> {
        let starts = std::iter::once(None).chain(bounds.iter().cloned().map(Some));
        let ends = bounds.iter().cloned().map(Some).chain(std::iter::once(None));
        let ranges = starts
            .zip(ends)
            .map(|(start, end)| self.list_range(ListRequest { start_after: start, ..request.clone() }, end));
        let ranges: Vec<_> = ranges.collect();
        let pages: Vec<Vec<Listed>> =
            stream::iter(ranges).buffered(self.policy.concurrency).try_collect().await?;
        Ok(pages.into_iter().flatten().collect())
    }

    /// Reads a listing up to and including `end`.
    async fn list_range(&self, request: ListRequest, end: Option<String>) -> Result<Vec<Listed>> {
        Ok(Listing::read(request, end.as_deref(), |request| self.list(request)).await?.objects)
    }

    /// Reads `animation.json`, unless the manifest has it in this version and without a fault: settings that an older
    /// function rejected may be valid.
    async fn settings(
        &self,
        animation: &Animation,
        version: Option<ETag>,
        known: Option<&Known>,
    ) -> Result<Settings> {
        let Some(version) = version else { return Ok(Settings::absent()) };
        let known = known.map(|known| &known.manifest.head.settings);
        if let Some(settings) = known.filter(|known| known.version == Some(version) && known.fault.is_none())
        {
            return Ok(settings.clone());
        }
        Ok(match self.get_start(&animation.settings(), MAX_SETTINGS_BYTES).await? {
            None => Settings::absent(),
            Some(Object { info, .. }) if info.size > MAX_SETTINGS_BYTES => {
                Settings::too_large(info.etag, info.size)
            }
            Some(object) => Settings::parse(object.info.etag, &object.body),
        })
    }

    /// Lists the parts of scripts that are split.
    async fn add_parts(&self, animation: &Animation, scripts: &Scripts, results: &mut Results) -> Result<()> {
        let current: BTreeMap<&ScriptName, &ETag> =
            scripts.found.iter().map(|script| (&script.name, &script.version)).collect();
        // Renderers of different pixels may both have split a script: its results are listed once.
        let splits: BTreeMap<&ScriptName, (&Tag, u64)> = results
            .receipts
            .iter()
            .filter_map(|found| match &found.receipt {
                Receipt::Split { name, tag, count } if current.get(name) == Some(&&tag.version) => {
                    Some((name, (tag, count.get())))
                }
                _ => None,
            })
            .collect();
        let frames = animation.frames();
        let listings = splits.into_iter().map(|(name, (tag, count))| {
            let below = format!("{frames}{name}@{tag}/");
            let prefix = format!("{frames}{}", Tag::receipts_of(name, &tag.version));
            let bounds = if count > MARK_EVERY as u64 {
                let mut files: Vec<String> =
                    (1..=count).map(|number| format!("{below}{number}.png")).collect();
                files.sort();
                files.into_iter().skip(MARK_EVERY - 1).step_by(MARK_EVERY).collect()
            } else {
                Vec::new()
            };
            self.list_ranges(ListRequest::all(prefix), bounds)
        });
        let listings: Vec<_> = listings.collect();
        let listed: Vec<Vec<Listed>> =
            stream::iter(listings).buffered(self.policy.concurrency).try_collect().await?;
        let parts = listed.into_iter().flatten().filter_map(|listed| receipt(animation, listed));
        results.receipts.extend(parts.filter(|found| match &found.receipt {
            Receipt::Frame { part, .. }
            | Receipt::Fault { part, .. }
            | Receipt::Begun { part, .. }
            | Receipt::Cut { part, .. }
            | Receipt::Band { part, .. } => part.is_some(),
            Receipt::Split { .. }
            | Receipt::Files { .. }
            | Receipt::Taken { .. }
            | Receipt::Waits { .. }
            | Receipt::Refusal { .. } => false,
        }));
        Ok(())
    }

    /// Returns the parts of a split script that have neither frame nor error yet.
    pub(crate) async fn missing_parts(
        &self,
        animation: &Animation,
        name: &ScriptName,
        version: &ETag,
        count: NonZeroU64,
    ) -> Result<Vec<NonZeroU64>> {
        let prefix = format!("{}{}", animation.frames(), Tag::receipts_of(name, version));
        let listed = self.list_ranges(ListRequest::all(prefix), Vec::new()).await?;
        let there: BTreeSet<NonZeroU64> = listed
            .into_iter()
            .filter_map(|listed| receipt(animation, listed))
            .filter(|found| found.receipt.is_of(name, version))
            .filter_map(|found| match found.receipt {
                Receipt::Frame { part, .. } | Receipt::Fault { part, .. } => part,
                _ => None,
            })
            .collect();
        let numbers = (1..=count.get()).filter_map(NonZeroU64::new);
        Ok(numbers.filter(|number| !there.contains(number)).collect())
    }

    /// Adds the reasons of faults: those in the manifest and, if no frame is pending, all others. Returns whether the
    /// reasons could be read; if not, the listing is out of date.
    async fn add_reasons(
        &self,
        animation: &Animation,
        results: &Results,
        known: Option<&Known>,
        manifest: &mut Manifest,
    ) -> Result<bool> {
        let head = &manifest.head;
        let faulty = head.failed + head.waiting > 0 || head.refusal.is_some();
        if !faulty {
            return Ok(true);
        }
        let reasons: BTreeMap<&ETag, &Reason> =
            known.into_iter().flat_map(|known| faults(&known.manifest)).collect();
        for fault in faults_mut(manifest) {
            fault.reason = reasons.get(&fault.receipt).map(|reason| (*reason).clone());
        }
        let is_for_files = manifest.head.status == Status::Waiting && manifest.head.waiting > 0;
        if !manifest.head.is_terminal() && !is_for_files {
            return Ok(true);
        }
        let keys: BTreeMap<&ETag, String> = results
            .receipts
            .iter()
            .filter(|found| {
                matches!(
                    found.receipt,
                    Receipt::Fault { .. } | Receipt::Waits { .. } | Receipt::Refusal { .. }
                )
            })
            .map(|found| (&found.etag, animation.receipt(&found.receipt)))
            .collect();
        let mut missing: Vec<ETag> = faults_mut(manifest)
            .filter(|fault| fault.reason.is_none())
            .map(|fault| fault.receipt.clone())
            .collect();
        missing.sort();
        missing.dedup();
        let reads = missing.iter().filter_map(|etag| keys.get(etag)).map(|key| async move {
            let object = self.get(key).await?;
            Ok::<_, Error>(object.map(|object| (object.info.etag, Reason::of_receipt(&object.body))))
        });
        let reads: Vec<_> = reads.collect();
        let read: Vec<Option<(ETag, Reason)>> =
            stream::iter(reads).buffered(self.policy.concurrency).try_collect().await?;
        let read: BTreeMap<ETag, Reason> = read.into_iter().flatten().collect();
        for fault in faults_mut(manifest).filter(|fault| fault.reason.is_none()) {
            match read.get(&fault.receipt) {
                Some(reason) => fault.reason = Some(reason.clone().shortened()),
                None => return Ok(false),
            }
        }
        Ok(true)
    }
}

/// Returns the scripts in a listing of the animation's folder, and the version of its settings.
fn scripts_of(animation: &Animation, listed: Vec<Listed>) -> (Scripts, Option<ETag>) {
    let (mut scripts, mut rejected, mut warnings) = (Scripts::default(), Vec::new(), Vec::new());
    let mut settings = None;
    for listed in listed {
        match Uploaded::of(&listed.key, listed.size) {
            Uploaded::Script(_, name) => {
                scripts.found.push(ScriptFound { name, version: listed.etag, modified: listed.modified });
            }
            Uploaded::Settings(_) => settings = Some(listed.etag),
            Uploaded::Rejected(_, problem) => {
                rejected.push(Rejected { key: listed.key, problem: problem.to_owned() });
            }
            Uploaded::NearMiss(_, problem) => {
                warnings.push(Rejected { key: listed.key, problem: problem.to_owned() });
            }
            Uploaded::File(_, name) => {
                let (version, modified) = (VersionHash::of(&listed.etag), listed.modified);
                scripts.files.insert(NameHash::of(&name), FileFound { version, modified });
            }
            Uploaded::Misplaced(_) | Uploaded::Nothing => {}
        }
    }
    scripts.rejected = bounded(rejected, animation.scripts(), "that no script can have");
    scripts.warnings = bounded(warnings, animation.scripts(), "of files that are not read");
    (scripts, settings)
}

/// Returns the version of each script of an animation, from listings of its scripts and of its receipts.
pub fn script_versions(
    animation: &Animation,
    scripts: Vec<Listed>,
    receipts: Vec<Listed>,
) -> BTreeMap<ScriptName, ETag> {
    let (mut scripts, _) = scripts_of(animation, scripts);
    let receipts: Vec<ReceiptFound> =
        receipts.into_iter().filter_map(|listed| receipt(animation, listed)).collect();
    scripts.resolve(&receipts);
    scripts.found.into_iter().map(|script| (script.name, script.version)).collect()
}

/// Keeps the first ones, and the number of the others.
fn bounded(mut rejected: Vec<Rejected>, folder: String, which: &str) -> Vec<Rejected> {
    let more = rejected.len().saturating_sub(MAX_REJECTED);
    rejected.truncate(MAX_REJECTED);
    if more > 0 {
        let keys = if more == 1 { "key" } else { "keys" };
        rejected.push(Rejected { key: folder, problem: format!("{more} more {keys} {which}") });
    }
    rejected
}

/// Returns the receipt for an object in a listing of the animation's frames.
fn receipt(animation: &Animation, listed: Listed) -> Option<ReceiptFound> {
    match listed.key.parse() {
        Ok(Key::Receipt { animation: of, receipt }) if of == *animation => {
            Some(ReceiptFound { receipt, etag: listed.etag, modified: listed.modified })
        }
        _ => None,
    }
}

fn faults(manifest: &Manifest) -> impl Iterator<Item = (&ETag, &Reason)> {
    let frames = manifest.frames.iter().filter_map(|frame| match &frame.state {
        FrameState::Failed(fault) | FrameState::Waiting(fault) => Some(fault),
        _ => None,
    });
    frames.chain(&manifest.head.refusal).filter_map(|fault| Some((&fault.receipt, fault.reason.as_ref()?)))
}

fn faults_mut(manifest: &mut Manifest) -> impl Iterator<Item = &mut Fault> {
    let frames = manifest.frames.iter_mut().filter_map(|frame| match &mut frame.state {
        FrameState::Failed(fault) | FrameState::Waiting(fault) => Some(fault),
        _ => None,
    });
    frames.chain(&mut manifest.head.refusal)
}

/// Returns whether the receipt is a result of a script, or of a part of it, with any files. An invocation that stops
/// for a frame to come must also consider other versions of the script: the result of another version may be the one
/// that was to come.
pub(crate) fn is_result_of(found: &ReceiptFound, script: &ScriptName, version: &ETag, part: Part) -> bool {
    match &found.receipt {
        Receipt::Frame { name, tag, part: of } | Receipt::Fault { name, tag, part: of } => {
            (name, tag.version.script(), *of) == (script, version.script(), part)
        }
        Receipt::Split { name, tag, .. } | Receipt::Waits { name, tag } => {
            part.is_none() && (name, tag.version.script()) == (script, version.script())
        }
        _ => false,
    }
}

/// Returns the result of one script's version, from the receipts of one listing.
pub(crate) fn version_result(receipts: &[ReceiptFound], part: Part) -> Option<VersionResult> {
    let mut standing = None;
    for found in receipts {
        let next = match &found.receipt {
            Receipt::Split { tag, count, .. } if part.is_none() => {
                VersionResult::Split { tag: tag.clone(), count: *count }
            }
            Receipt::Frame { tag, part: of, .. } if *of == part => VersionResult::Drawn(tag.pixels),
            Receipt::Fault { part: of, .. } if *of == part => VersionResult::Faulty(found.etag.clone()),
            Receipt::Waits { .. } if part.is_none() => VersionResult::Waits(found.etag.clone()),
            _ => continue,
        };
        standing = standing.max(Some(next));
    }
    standing
}

/// The result of a script's version; a later variant overrides an earlier one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum VersionResult {
    /// The version waits for files, as this receipt says.
    Waits(ETag),
    /// The version has an error receipt.
    Faulty(ETag),
    /// A frame of this pixel version.
    Drawn(u32),
    /// The script has several frames.
    Split {
        /// The tag in the parts' keys.
        tag: Tag,
        /// The number of frames in the script.
        count: NonZeroU64,
    },
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Returns whether there is a frame of a script's version or of a part of it, an error, or a split.
    pub(crate) async fn has_result(
        &self,
        animation: &Animation,
        name: &ScriptName,
        version: &ETag,
        part: Part,
    ) -> Result<bool> {
        let has_receipt = async {
            let receipts = match part {
                None => {
                    let script = ETag::new(version.script());
                    self.receipts_of_all_versions(animation, name, &script).await?
                }
                Some(_) => self.receipts_of(animation, name, version, part).await?,
            };
            Ok(version_result(&receipts, part).is_some())
        };
        if part.is_none() {
            return has_receipt.await;
        }
        // Only parts of this renderer's pixels are looked for; if another one has drawn some, it may be among them.
        let frames = animation.frames();
        let own = Tag { version: version.clone(), pixels: self.policy.pixels };
        let own = format!("{frames}{name}@{own}/");
        let level = ListRequest::level(format!("{frames}{}", Tag::receipts_of(name, version)));
        let level = Listing::read(level, None, |request| self.list(request));
        let (has_receipt, level) = try_join(has_receipt, level).await?;
        Ok(has_receipt || level.prefixes.iter().any(|folder| *folder != own))
    }

    /// Returns the receipts of all versions of a script with this entity tag, whatever its files: one request, unless it
    /// is cut into very many bands.
    pub(crate) async fn receipts_of_all_versions(
        &self,
        animation: &Animation,
        name: &ScriptName,
        script: &ETag,
    ) -> Result<Vec<ReceiptFound>> {
        let prefix = format!("{}{}", animation.frames(), Tag::receipts_of_script(name, script));
        let listed = self.list_ranges(ListRequest::level(prefix), Vec::new()).await?;
        let receipts = listed.into_iter().filter_map(|listed| receipt(animation, listed));
        Ok(receipts.filter(|found| found.receipt.is_of_script(name, script)).collect())
    }

    /// Returns the receipts of a script's version, or of a part of it: one request, unless it is cut
    /// into very many bands.
    pub(crate) async fn receipts_of(
        &self,
        animation: &Animation,
        name: &ScriptName,
        version: &ETag,
        part: Part,
    ) -> Result<Vec<ReceiptFound>> {
        let frames = animation.frames();
        let request = match part {
            None => ListRequest::level(format!("{frames}{}", Tag::receipts_of(name, version))),
            Some(number) => {
                let tag = Tag { version: version.clone(), pixels: self.policy.pixels };
                ListRequest::all(format!("{frames}{name}@{tag}/{number}."))
            }
        };
        let listed = self.list_ranges(request, Vec::new()).await?;
        let receipts = listed.into_iter().filter_map(|listed| receipt(animation, listed));
        // The receipts of a script that is called like this one's receipts start the same.
        Ok(receipts.filter(|found| found.receipt.is_of(name, version)).collect())
    }
}
