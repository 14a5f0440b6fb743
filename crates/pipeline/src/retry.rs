//! Draws frames again, on demand: the effect of `rayfold retry` on the bucket.
//!
//! Error receipts are deleted first, for a receipt is what makes an event find its work done; then the wakings that
//! the sweep has counted; then each frame is woken again. Everything after that is the render function's.

use std::collections::BTreeSet;

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
    /// All of them, also those that are drawn.
    All,
    /// This one, also if it is drawn.
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
    /// Receipts that were deleted.
    pub deleted: u64,
    /// Frames, or whole scripts, that were woken.
    pub woken: u64,
    /// The set of frames had been refused: it will be assembled again.
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
        let (mut doomed, mut counted) = (Vec::new(), Vec::new());
        for found in &observation.results.receipts {
            let (name, tag, part) = match &found.receipt {
                Receipt::Frame { name, tag, part } | Receipt::Fault { name, tag, part } => (name, tag, *part),
                Receipt::Refusal { .. } => {
                    doomed.push(animation.receipt(&found.receipt));
                    continue;
                }
                // Attempts are counted from the start.
                Receipt::Begun { name, tag, part, .. } => {
                    if named.contains(&(name, &tag.version, *part)) {
                        counted.push(animation.receipt(&found.receipt));
                    }
                    continue;
                }
                // A frame that failed is looked at from the beginning; of one that is on its way the bands stay.
                Receipt::Cut { name, tag, part, .. } | Receipt::Band { name, tag, part, .. } => {
                    if stopped.contains(&(name, &tag.version, *part)) {
                        counted.push(animation.receipt(&found.receipt));
                    }
                    continue;
                }
                Receipt::Split { .. }
                | Receipt::Files { .. }
                | Receipt::Taken { .. }
                | Receipt::Waits { .. } => continue,
            };
            if named.contains(&(name, &tag.version, part)) {
                doomed.push(animation.receipt(&found.receipt));
            }
        }
        let deleted = doomed.len() as u64;
        doomed.extend(counted);
        for listed in self.retries(animation).await? {
            if let Ok(Key::Retry { name, tag, part, .. }) = listed.key.parse()
                && named.contains(&(&name, &tag.version, part))
            {
                doomed.push(listed.key);
            }
        }
        let deletions: Vec<_> = doomed.iter().map(|key| self.delete(key)).collect();
        stream::iter(deletions).buffer_unordered(self.policy.concurrency).try_collect::<Vec<()>>().await?;
        let wakings = wanted.iter().map(|frame| {
            let tag = Tag { version: frame.version.clone(), pixels: self.policy.pixels };
            self.put_retry(animation, &frame.script, tag, frame.part, 1)
        });
        let wakings: Vec<_> = wakings.collect();
        stream::iter(wakings).buffer_unordered(self.policy.concurrency).try_collect::<Vec<()>>().await?;
        let reassembled = manifest.head.refusal.is_some();
        if deleted > 0 {
            // No other invocation looks when only receipts go: the manifest must not stay as it was.
            crate::fold::fold(self, animation).await?;
        }
        Ok(Retried { deleted, woken: wanted.len() as u64, reassembled })
    }
}
