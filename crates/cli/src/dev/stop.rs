//! The wait for a signal to stop.

use std::time::Duration;

use crate::interrupt;

/// The time between two looks at whether a signal came.
const LOOK: Duration = Duration::from_millis(50);

/// Returns when a signal to stop came.
pub(super) async fn interrupted() {
    while !interrupt::stopping() {
        tokio::time::sleep(LOOK).await;
    }
}
