//! A counter of channels that were NaN before their conversion to a level. It is for measurements, which run one at a
//! time.

use std::sync::atomic::{AtomicU64, Ordering};

static FOUND: AtomicU64 = AtomicU64::new(0);

pub(crate) fn add(count: u32) {
    if count > 0 {
        FOUND.fetch_add(u64::from(count), Ordering::Relaxed);
    }
}

/// Returns the count of all pictures since the last call.
pub fn take() -> u64 {
    FOUND.swap(0, Ordering::Relaxed)
}
