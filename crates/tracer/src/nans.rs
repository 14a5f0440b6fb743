//! How many channels were not a number before they became a level: for measurements alone, which are one at a time.

use std::sync::atomic::{AtomicU64, Ordering};

static FOUND: AtomicU64 = AtomicU64::new(0);

pub(crate) fn add(count: u32) {
    if count > 0 {
        FOUND.fetch_add(u64::from(count), Ordering::Relaxed);
    }
}

/// Those of all pictures since the last call.
pub fn take() -> u64 {
    FOUND.swap(0, Ordering::Relaxed)
}
