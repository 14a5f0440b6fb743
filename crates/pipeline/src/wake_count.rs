//! The number of times that frames were triggered, from the objects below `retries/` and the receipts of those that
//! began.

use std::collections::BTreeMap;

use crate::invocation::Invocation;
use crate::keys::{Animation, Key, Part, Receipt, ScriptName};
use crate::observe::Observation;
use crate::store::{ETag, ListRequest, Listed, Store};
use crate::{Clock, Result, Timestamp};

/// The number of times that a frame was triggered, and the last of them.
#[derive(Clone, Copy, Default)]
pub(crate) struct WakeCount {
    /// The last one's number.
    pub(crate) attempts: u64,
    pub(crate) last: Timestamp,
    /// The number of triggers for which an invocation has begun. The others may wait behind a thousand frames.
    pub(crate) begun: u64,
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Returns how often each frame of an animation was triggered.
    pub(crate) async fn wakings(
        &self,
        animation: &Animation,
        observation: &Observation,
    ) -> Result<BTreeMap<(ScriptName, ETag, Part), WakeCount>> {
        let mut wakings: BTreeMap<_, WakeCount> = BTreeMap::new();
        for listed in self.retries(animation).await? {
            if let Ok(Key::Retry { name, tag, part, attempt, .. }) = listed.key.parse() {
                let waking = wakings.entry((name, tag.version, part)).or_default();
                waking.attempts = waking.attempts.max(attempt.get());
                waking.last = waking.last.max(listed.modified);
            }
        }
        for found in &observation.results.receipts {
            if let Receipt::Begun { name, tag, part, .. } = &found.receipt {
                wakings.entry((name.clone(), tag.version.clone(), *part)).or_default().begun += 1;
            }
        }
        Ok(wakings)
    }

    /// Lists the objects below `retries/<animation>/` that belong to this animation, and not to one below it.
    pub(crate) async fn retries(&self, animation: &Animation) -> Result<Vec<Listed>> {
        let mut listed = self.list_ranges(ListRequest::all(animation.retries()), Vec::new()).await?;
        listed.retain(|listed| listed.key.parse::<Key>().is_ok_and(|key| key.animation() == animation));
        Ok(listed)
    }
}
