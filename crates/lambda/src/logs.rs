//! Logs as JSON, a line an event, to standard output, where the platform collects them.
//!
//! Script contents are never logged: they are the user's.

use std::env;

use tracing::level_filters::LevelFilter;

/// From here on, events of at least the platform's level are logged (`AWS_LAMBDA_LOG_LEVEL`; INFO without it).
pub(crate) fn start() {
    let level = env::var("AWS_LAMBDA_LOG_LEVEL").ok().and_then(|level| level.parse().ok());
    // One logger a process: a second start finds the first.
    let _ = tracing_subscriber::fmt()
        .json()
        .flatten_event(true)
        .with_current_span(false)
        .with_span_list(false)
        .with_target(false)
        .with_max_level(level.unwrap_or(LevelFilter::INFO))
        .try_init();
}

/// Whole milliseconds, the unit of every duration that is logged.
pub(crate) fn ms(duration: std::time::Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}
