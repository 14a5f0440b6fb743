//! Draws frames again, on demand: the effect of `rayfold retry` on the bucket.
//!
//! For each frame, it first deletes the receipts, because with a receipt an event finds its work done. It also deletes
//! the triggers that the sweep has counted. Then it triggers the frame again, and the render function does the rest. If
//! a retry was cut off, another one of [`Scope::Failed`] completes it, because that scope includes missing frames.

use std::collections::{BTreeMap, BTreeSet};

use futures_util::stream::{self, StreamExt, TryStreamExt};

use crate::invocation::Invocation;
use crate::keys::{Animation, Key, Part, Receipt, ScriptName, Tag};
use crate::manifest::{Frame, FrameState};
use crate::store::Store;
use crate::{Clock, Result};

/// The frames to draw again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope<'a> {
    /// Frames that failed or are missing.
    Failed,
    /// Every frame, even if it is drawn.
    All,
    /// This frame, even if it is drawn.
    Frame(&'a ScriptName, Part),
}

impl Scope<'_> {
    fn has(self, frame: &Frame) -> bool {
        match self {
            Scope::Failed => !matches!(frame.state, FrameState::Done { .. }),
            Scope::All => true,
            Scope::Frame(name, part) => frame.script == *name && frame.part == part,
        }
    }
}

/// The result of a retry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Retried {
    /// The number of deleted receipts.
    pub deleted: u64,
    /// The number of frames, or whole scripts, that were triggered.
    pub woken: u64,
    /// Whether the set of frames had been refused, so that it will be assembled again.
    pub reassembled: bool,
}

/// Draws frames of an animation again.
///
/// # Errors
///
/// The errors of the store.
pub async fn retry<S: Store, C: Clock>(
    invocation: &Invocation<'_, S, C>,
    animation: &Animation,
    scope: Scope<'_>,
) -> Result<Retried> {
    invocation.retry(animation, scope).await
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    async fn retry(&self, animation: &Animation, scope: Scope<'_>) -> Result<Retried> {
        let known = self.manifest(animation).await?;
        let observation = self.observe(animation, known.as_ref()).await?;
        let manifest = &observation.manifest;
        let wanted: Vec<_> = manifest.frames.iter().filter(|frame| scope.has(frame)).collect();
        let named: BTreeSet<_> =
            wanted.iter().map(|frame| (&frame.script, &frame.version, frame.part)).collect();
        let stopped = wanted.iter().filter(|frame| frame.state != FrameState::Pending);
        let stopped: BTreeSet<_> = stopped.map(|frame| (&frame.script, &frame.version, frame.part)).collect();
        let (mut refusals, mut deleted) = (Vec::new(), 0);
        let mut doomed: BTreeMap<_, Vec<String>> = BTreeMap::new();
        for found in &observation.results.receipts {
            let key = || animation.receipt(&found.receipt);
            let (of, is_doomed, is_counted) = match &found.receipt {
                Receipt::Frame { name, tag, part } | Receipt::Fault { name, tag, part } => {
                    let of = (name, &tag.version, *part);
                    (of, named.contains(&of), true)
                }
                Receipt::Refusal { .. } => {
                    refusals.push(key());
                    continue;
                }
                // Attempts are counted from the start.
                Receipt::Begun { name, tag, part, .. } => {
                    let of = (name, &tag.version, *part);
                    (of, named.contains(&of), false)
                }
                // A frame that failed is looked at from the beginning; of one that is on its way the bands stay.
                Receipt::Cut { name, tag, part, .. } | Receipt::Band { name, tag, part, .. } => {
                    let of = (name, &tag.version, *part);
                    (of, stopped.contains(&of), false)
                }
                Receipt::Split { .. }
                | Receipt::Files { .. }
                | Receipt::Taken { .. }
                | Receipt::Waits { .. } => continue,
            };
            if is_doomed {
                doomed.entry(of).or_default().push(key());
                deleted += u64::from(is_counted);
            }
        }
        deleted += refusals.len() as u64;
        let earlier = self.retries(animation).await?.into_iter();
        let earlier: Vec<_> = earlier.map(|listed| (listed.key.parse::<Key>(), listed.key)).collect();
        for (parsed, key) in &earlier {
            if let Ok(Key::Retry { name, tag, part, .. }) = parsed
                && named.contains(&(name, &tag.version, *part))
            {
                doomed.entry((name, &tag.version, *part)).or_default().push(key.clone());
            }
        }
        for key in &refusals {
            self.delete(key).await?;
        }
        // Frame by frame: if this is cut off, no more are missing and not woken than are worked on at the same time.
        let doomed = &doomed;
        let frames = wanted.iter().map(|frame| async move {
            for key in doomed.get(&(&frame.script, &frame.version, frame.part)).into_iter().flatten() {
                self.delete(key).await?;
            }
            let tag = Tag { version: frame.version.clone(), pixels: self.policy.pixels };
            self.put_retry(animation, &frame.script, tag, frame.part, 1).await
        });
        let frames: Vec<_> = frames.collect();
        stream::iter(frames).buffer_unordered(self.policy.concurrency).try_collect::<Vec<()>>().await?;
        let reassembled = manifest.head.refusal.is_some();
        if deleted > 0 {
            // No other invocation looks when only receipts go: the manifest must not stay as it was.
            crate::fold::fold(self, animation).await?;
        }
        Ok(Retried { deleted, woken: wanted.len() as u64, reassembled })
    }
}
