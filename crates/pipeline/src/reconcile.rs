//! Turns listings into a manifest: the fold that decides everything, as a pure function.
//!
//! A script's version resolves to a split, a frame or an error, in that order: a late frame beats a timeout's error.
//! A frame of any pixel version counts, and the newest is used.

use std::collections::BTreeMap;
use std::num::NonZeroU64;

use sha2::{Digest, Sha256};

use crate::Timestamp;
use crate::keys::{Animation, Generation, NameHash, Part, Receipt, ScriptName, VersionHash};
use crate::manifest::{Fault, Frame, FrameState, Head, Manifest, Rejected, SCHEMA, Settings, Status};
use crate::store::ETag;

/// The number of scripts between two of a manifest's marks: as many as a page of a listing shows.
pub const MARK_EVERY: usize = crate::store::PAGE;

/// The most marks that a manifest holds.
const MAX_MARKS: usize = 200;

/// The scripts of an animation, as a listing of `scripts/<animation>/` shows them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Scripts {
    /// The scripts, each once.
    pub found: Vec<ScriptFound>,
    /// Objects that are meant as scripts but cannot be scripts.
    pub rejected: Vec<Rejected>,
    /// Objects that are not read because of their names.
    pub warnings: Vec<Rejected>,
    /// Files that scripts may name.
    pub files: BTreeMap<NameHash, FileFound>,
}

/// A script in a listing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScriptFound {
    /// The name of the script within its animation.
    pub name: ScriptName,
    /// The entity tag of the script. If the script names files and a set agrees with the listing, the hash of the set
    /// follows.
    pub version: ETag,
    /// The time of its upload.
    pub modified: Timestamp,
}

/// A file in a listing of a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileFound {
    /// A hash of its entity tag.
    pub version: VersionHash,
    /// The time of its upload.
    pub modified: Timestamp,
}

/// The results of scripts, as a listing of `frames/<animation>/` shows them, in any order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Results {
    /// The receipts of current and superseded versions.
    pub receipts: Vec<ReceiptFound>,
}

/// A receipt in a listing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReceiptFound {
    /// The parsed key of the receipt.
    pub receipt: Receipt,
    /// The entity tag of the receipt.
    pub etag: ETag,
    /// The time when it was written.
    pub modified: Timestamp,
}

/// The result of a script or a part of one.
#[derive(Debug, Clone, Default)]
struct Resolution<'a> {
    split: Option<NonZeroU64>,
    whole: Outcome<'a>,
    parts: BTreeMap<NonZeroU64, Outcome<'a>>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Outcome<'a> {
    pixels: Option<u32>,
    fault: Option<(u32, &'a ETag)>,
    waits: Option<&'a ETag>,
}

/// Folds the listings of an animation into its manifest, with revision 0 and no writer. The invocation that
/// commits it sets both.
///
/// Reasons are left out, because listings do not show them.
pub fn reconcile(
    animation: &Animation,
    scripts: &Scripts,
    results: &Results,
    settings: &Settings,
) -> Manifest {
    let resolutions = resolve(results);
    let mut order: Vec<&ScriptFound> = scripts.found.iter().collect();
    order.sort_by(|a, b| {
        let (a, b) = (a.name.as_str(), b.name.as_str());
        rayfold_scene::natural_cmp(a, b).then_with(|| a.cmp(b))
    });
    let mut frames = Vec::with_capacity(order.len());
    for script in order {
        let frame = |part: Part, outcome: Option<&Outcome<'_>>| Frame {
            script: script.name.clone(),
            version: script.version.clone(),
            part,
            state: outcome.map_or(FrameState::Pending, Outcome::state),
        };
        match resolutions.get(&(&script.name, &script.version)) {
            None => frames.push(frame(None, None)),
            Some(Resolution { split: None, whole, .. }) => frames.push(frame(None, Some(whole))),
            Some(Resolution { split: Some(count), parts, .. }) => {
                let numbers = (1..=count.get()).filter_map(NonZeroU64::new);
                frames.extend(numbers.map(|number| frame(Some(number), parts.get(&number))));
            }
        }
    }
    let count = |wanted: fn(&FrameState) -> bool| frames.iter().filter(|f| wanted(&f.state)).count() as u64;
    let (total, done) = (frames.len() as u64, count(|state| matches!(state, FrameState::Done { .. })));
    let pending = count(|state| matches!(state, FrameState::Pending));
    let waiting = count(|state| matches!(state, FrameState::Waiting(_)));
    let failed = count(|state| matches!(state, FrameState::Failed(_)));
    let generation = generation(&frames, settings);
    let refusal = results.receipts.iter().find_map(|found| match &found.receipt {
        Receipt::Refusal { generation: refused, output }
            if *refused == generation && settings.outputs().contains(output) =>
        {
            Some(Fault { receipt: found.etag.clone(), reason: None })
        }
        _ => None,
    });
    let expected = settings.value.as_ref().and_then(|settings| settings.frames());
    let status = if frames.is_empty() && scripts.rejected.is_empty() {
        Status::Empty
    } else if expected.is_some_and(|expected| total < expected) {
        Status::Waiting
    } else if pending > 0 {
        Status::Rendering
    } else if waiting > 0 {
        Status::Waiting
    } else if failed > 0 || settings.value.is_none() || !scripts.rejected.is_empty() {
        Status::Failed
    } else if refusal.is_some() {
        Status::Refused
    } else {
        Status::Done
    };
    let head = Head {
        schema: SCHEMA,
        animation: animation.clone(),
        revision: 0,
        writer: String::new(),
        status,
        generation,
        scripts: scripts.found.len() as u64,
        total,
        done,
        pending,
        waiting,
        failed,
        settings: settings.clone(),
        rejected: scripts.rejected.clone(),
        warnings: scripts.warnings.clone(),
        refusal: refusal.filter(|_| status == Status::Refused),
        excess: None,
        removed_at: None,
        gif: None,
        outputs: BTreeMap::new(),
        marks: marks(scripts),
    };
    Manifest { head, frames }
}

impl Outcome<'_> {
    fn state(&self) -> FrameState {
        match (self.pixels, self.fault) {
            (Some(pixels), _) => FrameState::Done { pixels },
            (None, Some((_, etag))) => FrameState::Failed(Fault { receipt: etag.clone(), reason: None }),
            (None, None) => self.waits.map_or(FrameState::Pending, |etag| {
                FrameState::Waiting(Fault { receipt: etag.clone(), reason: None })
            }),
        }
    }
}

fn resolve(results: &Results) -> BTreeMap<(&ScriptName, &ETag), Resolution<'_>> {
    let mut resolutions: BTreeMap<(&ScriptName, &ETag), Resolution<'_>> = BTreeMap::new();
    for ReceiptFound { receipt, etag, .. } in &results.receipts {
        match receipt {
            Receipt::Split { name, tag, count } => {
                let resolution = resolutions.entry((name, &tag.version)).or_default();
                resolution.split = resolution.split.max(Some(*count));
            }
            Receipt::Frame { name, tag, part } => {
                let outcome = resolutions.entry((name, &tag.version)).or_default().outcome(*part);
                outcome.pixels = outcome.pixels.max(Some(tag.pixels));
            }
            Receipt::Fault { name, tag, part } => {
                let outcome = resolutions.entry((name, &tag.version)).or_default().outcome(*part);
                outcome.fault = outcome.fault.max(Some((tag.pixels, etag)));
            }
            Receipt::Waits { name, tag } => {
                let outcome = &mut resolutions.entry((name, &tag.version)).or_default().whole;
                outcome.waits = outcome.waits.max(Some(etag));
            }
            Receipt::Begun { .. }
            | Receipt::Cut { .. }
            | Receipt::Band { .. }
            | Receipt::Files { .. }
            | Receipt::Taken { .. }
            | Receipt::Refusal { .. } => {}
        }
    }
    resolutions
}

impl<'a> Resolution<'a> {
    fn outcome(&mut self, part: Part) -> &mut Outcome<'a> {
        match part {
            None => &mut self.whole,
            Some(number) => self.parts.entry(number).or_default(),
        }
    }
}

/// Returns the hash of the sorted frames with their states, and of the settings that affect a file.
fn generation(frames: &[Frame], settings: &Settings) -> Generation {
    let mut hash = Sha256::new();
    // Without lengths, different fields could concatenate to the same bytes.
    let mut field = |bytes: &[u8]| {
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    };
    match &settings.value {
        Some(value) => {
            field(&value.frames().unwrap_or(0).to_le_bytes());
            field(&value.fps().to_bits().to_le_bytes());
            field(&value.loops().to_le_bytes());
            // No script has such a name.
            if value.bounces() {
                field(b"/bounce");
            }
            for (frame, seconds) in value.durations() {
                field(b"/duration");
                field(&frame.to_le_bytes());
                field(&seconds.to_bits().to_le_bytes());
            }
        }
        None => field(settings.version.as_ref().map_or("", ETag::as_str).as_bytes()),
    }
    for frame in frames {
        field(frame.script.as_str().as_bytes());
        field(frame.version.as_str().as_bytes());
        field(&frame.part.map_or(0, NonZeroU64::get).to_le_bytes());
        match &frame.state {
            FrameState::Pending => field(b"pending"),
            FrameState::Done { pixels } => field(&pixels.to_le_bytes()),
            FrameState::Waiting(_) => field(b"waiting"),
            FrameState::Failed(_) => field(b"failed"),
        }
    }
    let digits: String = hash.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    Generation::of_hash(digits)
}

/// Returns the names of scripts at regular distances, in byte order.
fn marks(scripts: &Scripts) -> Vec<ScriptName> {
    let count = scripts.found.len();
    if count <= MARK_EVERY {
        return Vec::new();
    }
    let mut names: Vec<&ScriptName> = scripts.found.iter().map(|script| &script.name).collect();
    names.sort();
    let stride = MARK_EVERY.max(count.div_ceil(MAX_MARKS));
    names.into_iter().skip(stride - 1).step_by(stride).cloned().collect()
}

#[cfg(test)]
mod tests;
