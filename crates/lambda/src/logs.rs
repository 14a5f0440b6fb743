//! JSON logs, one line per event, to standard output, where the platform collects them.
//!
//! Script contents are never logged, because they belong to the user. An error that neither a retry nor a receipt
//! covers carries the field `unhandled = true`, which the stack's alarms count.

use std::env;

use tracing::Subscriber;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::fmt::MakeWriter;

/// Starts logging events of at least the platform's level (`AWS_LAMBDA_LOG_LEVEL`; default: INFO).
pub(crate) fn start() {
    let level = env::var("AWS_LAMBDA_LOG_LEVEL").ok().and_then(|level| level.parse().ok());
    let format = json(std::io::stdout, level.unwrap_or(LevelFilter::INFO));
    // A process has one logger: a second start finds the first.
    let _ = tracing::subscriber::set_global_default(format);
}

/// Returns whole milliseconds, the unit of every duration that is logged.
pub(crate) fn ms(duration: std::time::Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

/// Returns the format of the logs.
fn json<W>(writer: W, level: LevelFilter) -> impl Subscriber + Send + Sync
where
    W: for<'a> MakeWriter<'a> + Send + Sync + 'static,
{
    tracing_subscriber::fmt()
        .json()
        .flatten_event(true)
        .with_current_span(false)
        .with_span_list(false)
        .with_target(false)
        .with_max_level(level)
        .with_writer(writer)
        .finish()
}

#[cfg(test)]
pub(crate) mod tests {
    use std::io::{self, Write};
    use std::sync::{Arc, Mutex, PoisonError};

    use super::*;

    /// The lines of a log.
    #[derive(Clone, Default)]
    pub(crate) struct Kept(Arc<Mutex<Vec<u8>>>);

    impl Write for Kept {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner).write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Kept {
        /// Keeps the thread's events from now on until the guard is dropped.
        pub(crate) fn start() -> (Self, tracing::subscriber::DefaultGuard) {
            let kept = Self::default();
            let writer = kept.clone();
            let guard = tracing::subscriber::set_default(json(move || writer.clone(), LevelFilter::INFO));
            (kept, guard)
        }

        /// Returns the lines that the alarm of the stack counts: those that match `{ $.unhandled IS TRUE }`.
        pub(crate) fn unhandled(&self) -> Vec<serde_json::Value> {
            let bytes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let lines = std::str::from_utf8(&bytes).unwrap().lines();
            lines
                .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
                .filter(|line| line["unhandled"] == true)
                .collect()
        }
    }

    #[test]
    fn the_alarm_counts_what_is_unhandled() {
        let alarms = include_str!("../../../infra/terraform/alarms.tf");
        assert!(alarms.contains("{ $.unhandled IS TRUE }"));
        let (kept, _guard) = Kept::start();
        tracing::info!("handled");
        tracing::error!(unhandled = true, "not handled");
        assert_eq!(kept.unhandled().len(), 1);
        assert_eq!(kept.unhandled()[0]["message"], "not handled");
    }
}
